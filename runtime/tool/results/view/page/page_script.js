/*
 * The whole page: shows the runs at the time of the clock, and draws whenever something has changed. The start
 * script makes `data`, `runs`, `page` and `clock`.
 */
"use strict";

const RESTING = 180; /* time without a change after which the picture is at rest */

function describeRuns() {
    runs.forEach((run, i) => {
        const item = newElement("li", "", "");
        const sample = newElement("span", "sample", "");
        sample.style.background = runs.length > 1 ? `#${shownColour(data.palette[i % data.palette.length]).getHexString()}` : "none";
        item.append(sample, runs.length > 1 ? `${i + 1} ` : "", run.name, newElement("small", "",
            ` ${run.model}, ${run.frames.length} coordinates, ${run.t[run.t.length - 1].toPrecision(4)} s`));
        byId("runs").append(item);
    });
}

function placesText() {
    const several = runs.length > 1;
    return runs.flatMap((run, i) => run.points.map((point) => {
        const place = placeNow(run, point).map((x) => withMinus(x.toFixed(4)));
        return `${point.name}${several ? ` (${i + 1})` : ""}: ${place.join(", ")} m`;
    })).join("\n");
}

/* Texts and the slider change at most ten times a second, since they redraw the page around the picture. */
function showTexts(clock, now) {
    if (clock.isPlaying && now - page.valuesShown < 100)
        return;
    page.valuesShown = now;
    showTime(clock);
    byId("places").textContent = placesText();
    page.charts.forEach((chart) => showValues(chart, page.rows));
}

function moveStage(stage, shown) {
    if (shown.follow !== stage.isFollowing) {
        setFollowing(stage, runs, shown.follow);
        showCell(stage);
    }
    follow(stage, runs);
    stage.bodies.forEach((body, i) => moveBody(body, page.rows[i], shown));
}

function showCell(stage) {
    byId("cell").textContent = `ground lines every ${Number(stage.grid.cell.toPrecision(3))} m`;
}

function moveAll(clock) {
    byId("force-key").hidden = !clock.shown.forces;
    page.rows = runs.map((run) => moveRun(run, clock.time));
    if (page.stage)
        moveStage(page.stage, clock.shown);
    page.charts.forEach((chart) => moveChart(chart, clock.time, page.rows));
    showTexts(clock, performance.now());
    page.isStale = true;
}

function drawAll() {
    if (page.stage)
        resizeStage(page.stage);
    page.charts.forEach((chart) => { makeKeys(chart); drawChart(chart); });
    if (page.stage)
        showCell(page.stage);
    moveAll(clock);
}

function setTheme(name) {
    const isDark = name ? name === "dark" : pageColour("--is-dark") !== "1";
    document.documentElement.dataset.theme = isDark ? "dark" : "light";
    byId("theme").textContent = isDark ? "Light" : "Dark";
    if (page.stage)
        dressStage(page.stage, runs);
    for (const kind of Object.keys(FORCE_COLOURS))
        byId(`${kind}-sample`).style.background = `#${shownColour(FORCE_COLOURS[kind]).getHexString()}`;
    byId("runs").textContent = "";
    describeRuns();
    drawAll();
}

/* Shows only the picture. */
function setAlone(isAlone) {
    document.documentElement.dataset.alone = isAlone ? "1" : "0";
    drawAll();
}

const changed = () => { page.isStale = true; };
const withCamera = (change) => (...values) => {
    if (page.stage)
        change(page.stage.camera, ...values);
    changed();
};
const actions = {view: withCamera(setView), turn: withCamera(turnCamera), zoom: withCamera(zoomCamera), aim: withCamera(aimCamera), theme: setTheme, alone: setAlone};

/* Draws fast while the picture changes, and finely at rest. */
function drawPicture(now) {
    const passed = now - page.drawn, isMoving = clock.isPlaying || (page.isStale && page.drawn > 0 && passed < RESTING);
    const isOverdue = page.isCoarse && !isMoving && passed > RESTING;
    if (!page.isStale && !isOverdue)
        return;
    if (isMoving && page.isCoarse)
        watchSpeed(page.stage, passed);
    drawStage(page.stage, isMoving);
    Object.assign(page, {isStale: false, isCoarse: isMoving, drawn: now});
}

function picture(now) {
    playOn(clock, now);
    if (page.stage)
        drawPicture(now);
    requestAnimationFrame(picture);
}

/* Connects everything and begins to draw. */
function startPage() {
    byId("no-webgl").hidden = page.stage !== null;
    page.charts.forEach((chart) => makeChart(chart, byId("charts"), runs.length, data.palette));
    connectControls(clock, actions);
    if (page.stage)
        steerByPointer(byId("stage"), page.stage.camera, changed);
    setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    setTime(clock, clock.start);
    readFragment(clock, actions);
    window.addEventListener("resize", drawAll);
    window.addEventListener("hashchange", () => readFragment(clock, actions));
    requestAnimationFrame(picture);
    document.documentElement.dataset.state = "shown";
}
