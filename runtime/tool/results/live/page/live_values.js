/*
 * The values of a live page: sliders for parameters, inputs and start, the options of the motion, and their
 * forms in the address and on the command line.
 */
"use strict";

const POSITIONS = 1000; /* of a slider */
const DIGITS = 4; /* of a value that a slider sets */
const FIELD_LETTERS = 7; /* of a value that a field shows */

/* ---- One value ---- */

/* A tenth to ten times the value; about zero, from -1 to 1. */
function rangeAbout(value, from, to) {
    if (from !== null && to !== null)
        return {from, to};
    if (value === 0)
        return {from: -1, to: 1};
    const ends = [value / 10, 10 * value];
    return {from: Math.min(...ends), to: Math.max(...ends)};
}

/* The start of a turn may be anywhere; that of a slide and of a rate about as far as it is. */
function rangeOfStart(value, unit, from, to) {
    if (from !== null && to !== null)
        return {from, to};
    const reach = unit === "rad" ? Math.PI : Math.max(1, 2 * Math.abs(value));
    return {from: -reach, to: reach};
}

function isLogarithmic({from, to}) {
    return from * to > 0 && Math.max(from / to, to / from) > 5;
}

function valueAtPosition(range, position) {
    const part = position / POSITIONS;
    const value = isLogarithmic(range) ? range.from * (range.to / range.from) ** part : range.from + part * (range.to - range.from);
    return Number(value.toPrecision(DIGITS));
}

function positionOf(range, value) {
    const part = isLogarithmic(range) ? Math.log(value / range.from) / Math.log(range.to / range.from) : (value - range.from) / (range.to - range.from);
    return Math.round(POSITIONS * Math.min(1, Math.max(0, Number.isFinite(part) ? part : 0)));
}

/* A number in at most FIELD_LETTERS letters: of its decimal and its exponential forms the one closest to it, of equally close ones the decimal one. */
function shortNumber(value) {
    const texts = [];
    for (let digits = FIELD_LETTERS; digits > 0; digits--) {
        const rounded = Number(value.toPrecision(digits));
        texts.push(String(rounded), rounded.toExponential().replace("+", ""));
    }
    const far = (text) => Math.abs(Number(text) - value);
    return texts.filter((text) => text.length <= FIELD_LETTERS).reduce((best, text) => (far(text) < far(best) ? text : best));
}

/* A value with its slider and its field. `kind` is p, x or q; with `isFree` it follows the model until it is set. */
function makeValue(kind, index, about, makeRange) {
    return {kind, index, name: about.name, unit: about.unit, standard: about.value, fileValue: about.fileValue, value: about.value, isFree: about.value === null,
            range: null, makeRange};
}

/* Shows the ends of the slider, and "log" between them if equal distances are equal factors. */
function setRange(one, range) {
    const ends = [range.from, range.to].map((end) => withMinus(shortNumber(Number(end.toPrecision(DIGITS))))), isLog = isLogarithmic(range);
    one.range = range;
    one.slider.title = `${ends.join(" to ")}${isLog ? ", logarithmic" : ""}`;
    one.ends.replaceChildren(...[ends[0], isLog ? "log" : "", ends[1]].map((text) => newElement("span", "", text)));
}

function showValue(one) {
    if (!one.slider || one.value === null)
        return;
    if (!one.range)
        setRange(one, one.makeRange(one.standard === null ? one.value : one.standard));
    one.slider.value = String(positionOf(one.range, one.value));
    one.slider.setAttribute("aria-valuetext", `${one.value} ${one.unit}`);
    if (document.activeElement !== one.field)
        one.field.value = shortNumber(one.value);
}

/* Sets a value that the user has chosen. */
function chooseValue(one, value, changed) {
    if (!Number.isFinite(value))
        return;
    one.value = value;
    one.isFree = false;
    showValue(one);
    changed(one);
}

function valueRow(one, changed) {
    const row = newElement("div", "row value", ""), label = newElement("label", "", one.unit ? `${one.name} [${one.unit}]` : one.name);
    one.slider = newElement("input", "", "");
    one.field = newElement("input", "", "");
    one.ends = newElement("span", "ends", "");
    one.ends.setAttribute("aria-hidden", "true"); /* the title of the slider says the same */
    Object.assign(one.slider, {type: "range", min: "0", max: String(POSITIONS), step: "1", id: `slider-${one.kind}-${one.index}`});
    Object.assign(one.field, {type: "number", step: "any"});
    label.htmlFor = one.slider.id;
    one.field.setAttribute("aria-label", `${one.name}, number`);
    one.slider.addEventListener("input", () => chooseValue(one, valueAtPosition(one.range, Number(one.slider.value)), changed));
    one.field.addEventListener("change", () => chooseValue(one, parseFloat(one.field.value), changed));
    one.field.addEventListener("blur", () => showValue(one));
    row.append(label, one.slider, one.field, one.ends);
    showValue(one);
    return row;
}

/* ---- All values ---- */

/* The module has an array of n coordinates, in which those of states stay unused, and an array of n rates. */
function listValues(live) {
    const joints = (live.starts.length - live.states.length) / 2, place = (i) => i < joints ? i : i + live.states.length;
    const plain = (kind, list) => list.map((about, i) => makeValue(kind, i, about, (value) => rangeAbout(value, about.from, about.to)));
    return {
        p: plain("p", live.parameters).map((one, i) => ({...one, anchor: live.parameters[i].anchor, isHidden: live.parameters[i].value === null,
                                                         isFree: live.parameters[i].anchor >= 0 && !live.parameters[i].given})),
        x: plain("x", live.inputs),
        q: live.starts.map((about, i) => makeValue("q", place(i), about, (value) => rangeOfStart(value, about.unit, about.from, about.to))),
    };
}

const OPTIONS = {until: {label: "Duration [s]", from: 0.1, to: 20}, step: {label: "Step [s], 0: adaptive", from: 0, to: 0.01}, tol: {label: "Tolerance", from: 1e-10, to: 1e-3},
                 tolRates: {label: "Tolerance of rates, 0: none", from: 0, to: 1e-2}};
const MAY_BE_ZERO = ["step", "tolRates"];
const OUTPUTS = 400;

function isFitOption(name, value) {
    return (value > 0 && Number.isFinite(value) && !(name === "tolRates" && value >= 1)) || (value === 0 && MAY_BE_ZERO.includes(name));
}

function optionField(name, options, changed) {
    const row = newElement("div", "row option", ""), label = newElement("label", "", OPTIONS[name].label), field = newElement("input", "", "");
    Object.assign(field, {type: "number", step: "any", min: "0", id: `option-${name}`, value: shortNumber(options[name])});
    label.htmlFor = field.id;
    field.addEventListener("change", () => {
        const value = parseFloat(field.value), isFit = isFitOption(name, value);
        field.setCustomValidity(isFit ? "" : `must be positive${name === "tolRates" ? " and below 1" : ""}${MAY_BE_ZERO.includes(name) ? ", or 0" : ""}`);
        field.reportValidity();
        if (isFit) {
            options[name] = value;
            changed();
        }
    });
    row.append(label, field);
    return row;
}

const PLACES = {initial: "initial state", statics: "equilibrium"};

/* Where the motion begins; start values have no effect on an equilibrium. */
function placeField(options, values, changed) {
    const row = newElement("div", "row choice", ""), label = newElement("label", "", "From"), field = newElement("select", "", "");
    field.id = label.htmlFor = "option-from";
    for (const [value, text] of Object.entries(PLACES))
        field.append(Object.assign(newElement("option", "", text), {value}));
    field.value = options.from;
    field.addEventListener("change", () => {
        options.from = field.value;
        showPlace(options, values);
        changed();
    });
    row.append(label, field);
    return row;
}

/* The choices of --options; structures are numbered so that the values of the last choice follow each other. */
function strideOf(structure, choice) {
    return structure.choices.slice(choice + 1).reduce((product, {values}) => product * values.length, 1);
}

/* Which value of a choice the structure has. */
function indexOf(structure, choice) {
    return Math.floor(structure.place / strideOf(structure, choice)) % structure.choices[choice].values.length;
}

function structureField(structure, choice, chosen) {
    const row = newElement("div", "row choice", ""), {name, values} = structure.choices[choice];
    const label = newElement("label", "", name), field = newElement("select", "", "");
    field.id = label.htmlFor = `structure-${choice}`;
    values.forEach((text, i) => field.append(Object.assign(newElement("option", "", text), {value: String(i)})));
    field.value = String(indexOf(structure, choice));
    field.addEventListener("change", () => chosen(structure.place + (Number(field.value) - indexOf(structure, choice)) * strideOf(structure, choice)));
    row.append(label, field);
    return row;
}

function structureFields(structure, chosen) {
    return structure.choices.map((_, choice) => structureField(structure, choice, chosen));
}

function showStructure(structure) {
    structure.choices.forEach((_, choice) => { byId(`structure-${choice}`).value = String(indexOf(structure, choice)); });
}

function showPlace(options, values) {
    byId("option-from").value = options.from;
    for (const one of values.q)
        one.slider.disabled = one.field.disabled = options.from === "statics";
}

function valueGroup(title, rows, isOpen) {
    const group = newElement("details", "group", "");
    group.open = isOpen;
    group.append(newElement("summary", "", title), ...rows);
    return rows.length > 0 ? [group] : [];
}

/* Fills the element with all sliders. */
function makePanel(panel, values, options, changed) {
    const rows = (list) => list.filter((one) => !one.isHidden).map((one) => valueRow(one, changed));
    panel.append(...valueGroup("Parameters", rows(values.p), true), ...valueGroup("Inputs", rows(values.x), true),
                 ...valueGroup("Motion", [...Object.keys(OPTIONS).map((name) => optionField(name, options, changed)), placeField(options, values, changed)], true),
                 ...valueGroup("Start", rows(values.q), false));
}

/* What the worker computes with. */
function requestOf(values, options, live) {
    const given = [];
    for (const one of values.p)
        if (one.anchor >= 0)
            given[one.anchor] = one.isFree ? 0 : 1;
    return {p: values.p.map((one) => one.value === null ? 0 : one.value), x: values.x.map((one) => one.value), given,
            fromStatics: options.from === "statics",
            starts: values.q.filter((one) => !one.isFree).map((one) => [one.index, one.value]), n: (live.starts.length + live.states.length) / 2,
            until: options.until, every: options.until / OUTPUTS, step: options.step, tol: options.tol, tolRates: options.tolRates};
}

/* Shows values that follow the model as the last motion has had them. */
function followModel(values, p, start) {
    for (const [list, used] of [[values.p, p], [values.q, start]])
        for (const one of list)
            if (one.isFree && !one.isHidden) {
                one.value = used[one.index];
                showValue(one);
            }
}

function isChanged(one) {
    return !one.isHidden && !one.isFree && (one.value !== one.standard || one.kind === "q" || one.anchor >= 0);
}

function resetValues(values, live) {
    for (const one of [...values.p, ...values.x, ...values.q]) {
        one.value = one.standard;
        one.isFree = one.standard === null || (one.kind === "p" && one.anchor >= 0 && !live.parameters[one.index].given);
        showValue(one);
    }
}

/* Keeps what the user has changed in another structure. */
function carryValues(before, values) {
    for (const kind of ["p", "x", "q"])
        for (const one of before[kind].filter(isChanged)) {
            const same = values[kind].find((other) => other.name === one.name && !other.isHidden);
            if (same)
                Object.assign(same, {value: one.value, isFree: false});
        }
}

/* ---- The address ---- */

/* A page inside another document, as in a notebook, has no address of its own. */
function hasAddress() {
    return location.protocol !== "about:";
}

function writeAddress(values, options, live, structure) {
    if (!hasAddress())
        return;
    const address = new URLSearchParams(location.hash.slice(1));
    for (const key of [...address.keys()])
        if (/^[opxq]\./.test(key) || key in OPTIONS)
            address.delete(key);
    for (const one of [...values.p, ...values.x, ...values.q])
        if (isChanged(one))
            address.set(`${one.kind}.${one.name}`, String(one.value));
    for (const name of Object.keys(OPTIONS))
        if (options[name] !== live[name])
            address.set(name, String(options[name]));
    structure.choices.forEach(({name, values: texts}, choice) => {
        const i = indexOf(structure, choice);
        if (i > 0)
            address.set(`o.${name}`, texts[i]);
    });
    address.delete("from");
    if (options.from !== "initial")
        address.set("from", options.from);
    history.replaceState(null, "", `#${address}`);
}

/* The structure that the address names; the first value of each choice that it does not name. */
function addressedStructure({choices}) {
    const address = new URLSearchParams(location.hash.slice(1));
    return choices.reduce((place, {name, values}) => place * values.length + Math.max(0, values.indexOf(address.get(`o.${name}`))), 0);
}

/* Returns whether the address sets a value. Names that the model does not have, and texts that are no numbers, have no effect. */
function readAddress(values, options) {
    const address = new URLSearchParams(location.hash.slice(1));
    let hasSet = false;
    for (const one of [...values.p, ...values.x, ...values.q]) {
        const value = parseFloat(address.get(`${one.kind}.${one.name}`));
        if (!one.isHidden && Number.isFinite(value)) {
            Object.assign(one, {value, isFree: false});
            showValue(one);
            hasSet = true;
        }
    }
    for (const name of Object.keys(OPTIONS)) {
        const value = parseFloat(address.get(name));
        if (isFitOption(name, value)) {
            options[name] = value;
            byId(`option-${name}`).value = shortNumber(value);
            hasSet = true;
        }
    }
    if (Object.keys(PLACES).includes(address.get("from")) && address.get("from") !== options.from) {
        options.from = address.get("from");
        hasSet = true;
    }
    showPlace(options, values);
    return hasSet;
}

/* ---- Forms for other programs ---- */

/* One word of a shell. */
function shellWord(text) {
    return /^[\w.\/=+:,-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
}

/* The command that computes the same rows; start values are in a file. */
function commandLine(values, options, live) {
    const words = ["refdyn", "sim", live.file, ...live.settings.flatMap(([name, value]) => ["--set", `${name}=${value}`])];
    for (const one of [...values.p, ...values.x])
        if (!one.isHidden && !one.isFree && (one.value !== one.fileValue || one.anchor >= 0))
            words.push("--set", `${one.name}=${one.value}`);
    if (options.from === "statics")
        words.push("--from", "statics");
    else if (values.q.some((one) => !one.isFree))
        words.push("--from", "start.json");
    words.push("--until", String(options.until), "--every", String(options.until / OUTPUTS));
    words.push(...(options.step > 0 ? ["--step", String(options.step)] : ["--tol", String(options.tol), ...(options.tolRates > 0 ? ["--tol-rates", String(options.tolRates)] : [])]));
    return [...words, "-o", "run.csv"].map(shellWord).join(" ");
}

function stateText(start, live) {
    const n = start.length / 2, joints = n - live.states.length;
    const states = Object.fromEntries(live.states.map((name, i) => [name, start[n + joints + i]]));
    return `${JSON.stringify({t: 0, q: Array.from(start.slice(0, joints)), qd: Array.from(start.slice(n, n + joints)), ...(live.states.length > 0 && {states})})}\n`;
}

function csvText(motion) {
    const width = motion.columns.length, lines = [motion.columns.map((column) => column.name).join(",")];
    for (let row = 0; row < motion.count; row++)
        lines.push(Array.from(motion.rows.subarray(row * width, (row + 1) * width), String).join(","));
    return `${lines.join("\n")}\n`;
}

function saveText(name, text) {
    const link = document.createElement("a"), address = URL.createObjectURL(new Blob([text], {type: "text/plain"}));
    Object.assign(link, {href: address, download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
}
