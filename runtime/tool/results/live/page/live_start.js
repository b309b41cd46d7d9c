/*
 * Starts a live page: a worker computes a motion for the present values, and the page shows it as a recorded
 * run. Until then, and after a failure, the last good motion stays.
 */
"use strict";

const written = JSON.parse(byId("data").textContent), modules = JSON.parse(byId("module").textContent);
const structure = {choices: written.choices, place: addressedStructure(written)};
let data = written.structures[structure.place], live = data.live, values = listValues(live);
const options = {until: live.until, step: live.step, tol: live.tol, tolRates: live.tolRates, from: "initial"};
const runs = [];
let page = null, clock = null;

/* charts: all charts of the present motion; baseline: those of the motion before the last change. */
const state = {worker: null, asked: 0, answered: 0, motion: null, modes: null, charts: [], baseline: [], changedAt: -Infinity, askedAt: 0, delay: 0, hidden: new Set()};
const GESTURE = 700; /* changes that follow each other faster are one change: the pale curves stay [ms] */

/* ---- From a motion to a run ---- */

/* Fills the numbers of the drawn model in, in the order in which drawn_model.c prints them. */
function drawnModel(drawn, numbers) {
    let at = 0;
    const take = (count) => Array.from(numbers.subarray(at, at += count));
    const frames = drawn.frames.map((frame) => [...frame.slice(0, 4), ...take(frame.length - 4)]);
    const countEnds = drawn.closures.reduce((count, closure) => count + closure.ends.length, 0);
    const rest = 4 * drawn.sticks.length + 3 * (drawn.points.length + countEnds + drawn.applied.length);
    const shapeStart = numbers.length - SHAPE_NUMBERS * drawn.shapes.length;
    at = shapeStart - rest;
    const sticks = drawn.sticks.map(([frame, link]) => {
        const [from, ...to] = take(4);
        return [frame, link, from, 0, 0, ...to];
    });
    const points = drawn.points.map((point) => ({...point, at: take(3)}));
    const closures = drawn.closures.map((closure) => ({...closure, ends: closure.ends.map((end) => ({...end, at: take(3)}))}));
    const applied = drawn.applied.map((force) => ({...force, at: take(3)}));
    const shapes = drawn.shapes.map(([, frame, link, isSolid]) => {
        const [kind, ...others] = take(SHAPE_NUMBERS);
        return [kind, frame, link, isSolid, ...others];
    }).filter((shape) => shape[0] >= 0);
    return {...drawn, frames, sticks, points, closures, applied, shapes};
}

const SHAPE_NUMBERS = 14;

function countNumbers(drawn) {
    const frames = drawn.frames.reduce((count, frame) => count + frame.length - 4, 0);
    const ends = drawn.closures.reduce((count, closure) => count + closure.ends.length, 0);
    return frames + live.shapeNumbers + 4 * drawn.sticks.length + 3 * (drawn.points.length + ends + drawn.applied.length) + SHAPE_NUMBERS * drawn.shapes.length;
}

/* One of `width` columns of numbers row by row. */
function columnOf(numbers, width, count, column) {
    return Float64Array.from({length: count}, (_, row) => numbers[row * width + column]);
}

function runOf(motion) {
    const drawn = {...drawnModel(data.runs[0], motion.drawing), curves: motion.curves}, width = motion.columns.length, n = drawn.frames.length;
    const column = (i) => columnOf(motion.rows, width, motion.count, i);
    const courses = motion.columns.flatMap(({name, kind}, i) => kind ? [{name, kind, values: column(i)}] : [])
        .filter((course) => course.kind !== "force" || course.values.some((value) => value !== 0));
    const parts = drawn.applied.reduce((count, force) => count + force.count, 0);
    let first = 0;
    const applied = drawn.applied.map((force) => ({...force, parts: Array.from({length: force.count}, () => columnOf(motion.applied, parts, motion.count, first++))}))
        .filter((force) => force.parts.some((part) => part.some((value) => value !== 0)));
    const run = makeRun(drawn, {t: column(0), q: drawn.frames.map((_, i) => column(1 + i)), courses, applied});
    if (run.q.length !== n || motion.columns[1].name !== drawn.coordinates[0])
        throw new Error("the columns of the motion are not those of the model");
    return Object.assign(run, tracePaths(run));
}

/* ---- Charts ---- */

function chartKey(chart) {
    return `${chart.title} ${chart.curves.map((curve) => curve.name).join()}`;
}

/* The curves of the same chart in the baseline. */
function paleCurves(chart) {
    const before = state.baseline.find((one) => one.title === chart.title);
    return before && before.curves.length === chart.curves.length ? before.curves : [];
}

/* Charts of the same curves stay; otherwise all are made again. */
function showCharts() {
    const charts = state.charts.filter((chart) => !state.hidden.has(chart.title));
    if (charts.map(chartKey).join() === page.charts.map(chartKey).join())
        page.charts.forEach((chart, i) => { chart.curves = charts[i].curves; });
    else {
        byId("charts").textContent = "";
        page.charts = charts.map((chart) => ({...chart}));
        page.charts.forEach((chart) => makeChart(chart, byId("charts"), runs.length, data.palette));
    }
    page.charts.forEach((chart) => {
        chart.previous = paleCurves(chart);
        drawChart(chart);
    });
    showChoices();
}

/* Boxes for all charts that the motion has. */
function showChoices() {
    const titles = state.charts.map((chart) => chart.title), place = byId("choices");
    if (place.dataset.titles === titles.join())
        return;
    place.dataset.titles = titles.join();
    place.textContent = "";
    for (const title of titles) {
        const label = newElement("label", "", ""), box = newElement("input", "", "");
        Object.assign(box, {type: "checkbox", checked: !state.hidden.has(title)});
        box.addEventListener("change", () => {
            state.hidden[box.checked ? "delete" : "add"](title);
            showCharts();
            moveAll(clock);
        });
        label.append(box, title);
        place.append(label);
    }
}

/* ---- The present motion ---- */

/* The picture stays as it is unless the motion has become much larger or smaller, and no hand pulls. */
function fitStage(stage) {
    const before = diagonalOf(stage.box);
    stage.box = joinBoxes(runs.map((run) => run.box));
    const ratio = diagonalOf(stage.box) / before;
    if (hand.point < 0 && (ratio > 1.3 || ratio < 0.5))
        setFollowing(stage, runs, stage.isFollowing);
    else
        fillScene(stage, runs);
}

function showFacts(motion) {
    const rejected = motion.rejected > 0 ? `, ${motion.rejected} rejected` : "";
    const end = motion.hasEnded ? ` An event has ended the motion at t = ${motion.t.toPrecision(4)} s.` : "";
    byId("error").textContent = "";
    byId("facts").textContent = `${motion.steps} steps${rejected}; energy error ${motion.energyError.toExponential(1)} J; ` +
                                `computed in ${(1000 * motion.seconds).toFixed(0)} ms.${end}`;
}

function openPage() {
    page = {stage: makeStage(byId("stage"), runs, data.palette, data.runs[0].up), charts: [], rows: [], isStale: true, isCoarse: false, drawn: 0, valuesShown: 0};
    clock = makeClock(runs[0].t[0], runs[0].t[runs[0].t.length - 1], runs[0].t, moveAll);
    startPage();
    showCharts();
    if (live.canPull && page.stage)
        connectHand();
}

function showMotion(motion) {
    const run = runOf(motion);
    state.motion = motion;
    runs[0] = run;
    state.charts = listCharts(runs, data.runs[0].up);
    followModel(values, motion.p, motion.start);
    if (!page) {
        openPage();
    } else {
        Object.assign(clock, {end: run.t[run.t.length - 1], rowTimes: run.t});
        if (page.stage)
            fitStage(page.stage);
        showCharts();
        byId("runs").textContent = "";
        describeRuns();
    }
    setTime(clock, clock.time);
    showFacts(motion);
}

function withoutProgram(text) {
    return text.replace(/^refdyn: /gm, "").trim();
}

/* Messages of the motion, in the words of `sim`. */
function showMessage(text, isFailure) {
    const failure = byId("failure");
    failure.textContent = withoutProgram(text);
    failure.hidden = failure.textContent === "";
    failure.classList.toggle("is-failed", isFailure);
}

/* Frequencies and damping ratios about the equilibrium; answers to earlier requests come too late. */
function showModes({id, modes, message}) {
    const table = byId("modes"), rows = modes || [];
    if (id !== state.asked)
        return;
    state.modes = modes;
    byId("no-modes").textContent = modes ? (rows.length > 0 ? "" : "The programme leaves no motion free.")
        : withoutProgram(message) || "The model has rows in accelerations, or no equations from which modes follow.";
    table.hidden = rows.length === 0;
    table.tBodies[0].replaceChildren(...rows.map((mode, i) => {
        const row = document.createElement("tr");
        row.append(...[String(i + 1), ...mode.map((number) => withMinus(shortNumber(Number(number.toPrecision(DIGITS)))))].map((text) => newElement("td", "", text)));
        return row;
    }));
    document.documentElement.dataset.modes = String(id);
}

function makeModes() {
    const group = newElement("details", "group", ""), table = newElement("table", "", ""), row = newElement("tr", "", "");
    row.append(...["Mode", "Frequency [Hz]", "Damping ratio"].map((text) => Object.assign(newElement("th", "", text), {scope: "col"})));
    Object.assign(table, {id: "modes", hidden: true}).createTHead().append(row);
    table.createTBody();
    group.append(newElement("summary", "", "Small motions"), Object.assign(newElement("p", "", ""), {id: "no-modes"}), table);
    return group;
}

/* An error of the whole motion; answers to earlier requests come too late. */
function showError({id, estimate: {error, at, kinds, isTrusted}}) {
    if (id !== state.asked)
        return;
    const unit = data.runs[0].points.length > 0 ? " m" : "";
    const others = kinds.map((kind) => `${kind.name} ${kind.relative.toExponential(1)} (${kind.column})`).join(", ");
    byId("error").textContent = isTrusted ? `Estimated error of the motion: ${error.toExponential(1)}${unit}, largest at t = ${at.toPrecision(4)} s` +
                                            (others ? `; relative to the largest of their kind: ${others}.` : "; no estimate of rates, accelerations and forces.")
        : "A finer motion takes another path: the tolerance or step is too large, or the motion chaotic.";
    document.documentElement.dataset.verified = String(id);
}

function takeAnswer(answer) {
    if (answer.estimate) {
        showError(answer);
        return;
    }
    if (answer.modes !== undefined) {
        showModes(answer);
        return;
    }
    if (answer.isPartial) {
        showPulled(answer);
        return;
    }
    state.answered = answer.id;
    if (answer.isDone)
        showMotion(answer);
    else if (state.motion)
        byId("facts").textContent = "Shown is the last motion that succeeded.";
    byId("pulled").hidden = !state.motion || !state.motion.isPulled;
    showMessage(answer.message, !answer.isDone);
    if (answer.isDone && answer.isPulled)
        setPlaying(clock, true);
    state.delay = performance.now() - state.askedAt;
    document.documentElement.dataset.state = answer.id < state.asked ? "computing" : answer.isDone ? "shown" : "failed";
}

/* ---- Changes ---- */

function ask(pull = null) {
    state.asked++;
    state.askedAt = performance.now();
    document.documentElement.dataset.state = "computing";
    const drawn = data.runs[0];
    state.worker.postMessage({...requestOf(values, options, live), id: state.asked, pull, points: drawn.points.length, drawing: countNumbers(drawn),
                              applied: drawn.applied.reduce((count, force) => count + force.count, 0)});
}

let addressTimer = 0;
function changedValue() {
    const now = performance.now();
    if (now - state.changedAt > GESTURE)
        state.baseline = state.charts;
    state.changedAt = now;
    ask();
    clearTimeout(addressTimer);
    addressTimer = setTimeout(() => writeAddress(values, options, live, structure), 300);
    showCommand();
}

/* Goes on with another structure; changed values stay. */
function chooseStructure(place) {
    const before = values;
    structure.place = place;
    data = written.structures[place];
    live = data.live;
    values = listValues(live);
    carryValues(before, values);
    showStructure(structure);
    byId("sliders").textContent = "";
    makePanel(byId("sliders"), values, options, changedValue);
    showPlace(options, values);
    startWorker();
    changedValue();
}

function showCommand() {
    byId("command").value = commandLine(values, options, live);
}

/* ---- The page ---- */

function textButton(text, press) {
    const button = newElement("button", "", text);
    button.type = "button";
    button.addEventListener("click", press);
    return button;
}

function makeExport() {
    const group = newElement("details", "group", ""), label = newElement("label", "", "Command that computes the same"), command = newElement("textarea", "", "");
    const buttons = newElement("div", "buttons", "");
    Object.assign(command, {id: "command", readOnly: true, rows: 4});
    label.htmlFor = "command";
    buttons.append(textButton("Save CSV", () => state.motion && saveText(`${data.runs[0].model}.csv`, csvText(state.motion))),
                   textButton("Save start.json", () => state.motion && saveText("start.json", stateText(state.motion.start, live))));
    const pulled = Object.assign(newElement("p", "", "The motion has been pulled; the command computes it without the pull."), {id: "pulled", hidden: true});
    group.append(newElement("summary", "", "Export"), buttons, label, command, pulled);
    return group;
}

function makeModelText() {
    const group = newElement("details", "group", "");
    group.append(newElement("summary", "", "Model"), newElement("pre", "", JSON.parse(byId("model").textContent)));
    return group;
}

function makeLayout() {
    const panel = newElement("section", "", ""), choices = newElement("details", "group", ""), boxes = newElement("div", "", ""), sliders = newElement("div", "", "");
    const failure = newElement("p", "", ""), facts = newElement("p", "", "");
    Object.assign(panel, {id: "values"});
    panel.dataset.ownKeys = "1";
    panel.setAttribute("aria-label", "Values");
    Object.assign(failure, {id: "failure", hidden: true});
    failure.setAttribute("role", "alert");
    Object.assign(facts, {id: "facts"});
    boxes.id = "choices";
    document.documentElement.classList.add("live");
    document.querySelector("main").append(panel);
    byId("picture").append(failure);
    panel.append(facts, Object.assign(newElement("p", "hint", ""), {id: "error"}));
    if (live.canPull)
        panel.append(newElement("p", "hint", "Drag a named point to pull it."));
    sliders.id = "sliders";
    makePanel(sliders, values, options, changedValue);
    panel.append(...structureFields(structure, chooseStructure), sliders);
    choices.append(newElement("summary", "", "Curves"), boxes);
    panel.append(textButton("Reset all", () => { resetValues(values, live); changedValue(); }), makeModes(), choices, makeExport(), makeModelText());
}

/* The worker of the structure; what an earlier one still answers is too late. */
function startWorker() {
    const texts = [unpack, "\n", JSON.parse(byId("worker").textContent)], worker = new Worker(URL.createObjectURL(new Blob(texts, {type: "text/javascript"})));
    if (state.worker)
        state.worker.terminate();
    state.worker = worker;
    worker.onmessage = ({data: answer}) => worker === state.worker && takeAnswer(answer);
    worker.onerror = (event) => showMessage(`The worker has stopped: ${event.message}`, true);
    worker.postMessage({module: modules[structure.place]});
}

makeLayout();
readAddress(values, options);
showCommand();
startWorker();
ask();
window.addEventListener("hashchange", () => {
    if (addressedStructure(structure) !== structure.place)
        chooseStructure(addressedStructure(structure));
    if (readAddress(values, options))
        changedValue();
});
