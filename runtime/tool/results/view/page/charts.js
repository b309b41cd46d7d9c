/*
 * Charts next to the picture: each has a canvas and a cursor that follows the time. A chart is drawn once for a
 * size and a theme; then only its cursor moves.
 */
"use strict";

const MARGIN = {left: 52, right: 10, top: 8, bottom: 22}, CHART_HEIGHT = 150, KEYS_MOST = 4;

/* ---- What is drawn ---- */

function timeCurves(runs, kind) {
    return runs.flatMap((run, index) => run.courses.filter((course) => course.kind === kind)
        .map((course) => ({name: course.name, run: index, x: run.t, y: course.values, bounds: boundsOf(run, course.name)})));
}

/* Limits of the model for a column. */
function boundsOf(run, column) {
    return run.bounds.filter((bound) => bound.column === column);
}

function coordinateCurves(runs, isTurn) {
    return runs.flatMap((run, index) => run.frames.flatMap((frame, i) => frame.isTurn === isTurn
        ? [{name: run.coordinates[i], run: index, x: run.t, y: run.q[i], bounds: boundsOf(run, run.coordinates[i])}] : []));
}

/* A point's path: one of its components over another one. */
function pathCurves(runs, across, up) {
    return runs.flatMap((run, index) => run.points.map((point, i) => ({
        name: point.name, run: index, x: run.paths[i].map((place) => place[across]), y: run.paths[i].map((place) => place[up]),
    })));
}

function heightCurves(runs, up) {
    return runs.flatMap((run, index) => run.points.map((point, i) => (
        {name: `${point.name} ${"xyz"[up]}`, run: index, x: run.t, y: run.paths[i].map((place) => place[up])})));
}

/* Loads have three components. */
function appliedCurves(runs) {
    return runs.flatMap((run, index) => run.applied.flatMap((applied) => applied.parts.map((part, i) => (
        {name: applied.parts.length > 1 ? `${applied.name} ${"xyz"[i]}` : applied.name, run: index, x: run.t, y: part}))));
}

/* Decimal logarithms of absolute values; 0 is drawn at the floor of rounding. */
function logarithmic(curves) {
    return curves.map((curve) => ({...curve, y: Array.from(curve.y, (y) => Math.log10(Math.max(1e-17, Math.abs(y))))}));
}

/* All charts with a curve; `up` is the upward axis. */
function listCharts(runs, up) {
    const charts = [
        {title: "Path, y over x [m]", isPath: true, curves: pathCurves(runs, 0, 1)},
        {title: "Path, z over x [m]", isPath: true, curves: pathCurves(runs, 0, 2)},
        {title: "Path, z over y [m]", isPath: true, across: "y", curves: pathCurves(runs, 1, 2)},
        {title: `Height of points, ${"xyz"[up]} [m]`, curves: heightCurves(runs, up)},
        {title: "Slides [m]", curves: coordinateCurves(runs, false)},
        {title: "Turns [rad]", curves: coordinateCurves(runs, true)},
        {title: "Applied forces [N, N m]", curves: appliedCurves(runs)},
        {title: "Programme forces [N, N m]", curves: timeCurves(runs, "force")},
        {title: "Contact forces [N]", curves: timeCurves(runs, "contact")},
        {title: "Inputs and courses", curves: timeCurves(runs, "course")},
        {title: "Energy [J]", curves: timeCurves(runs, "energy")},
        {title: "Position residuals", isPower: true, curves: logarithmic(timeCurves(runs, "phi"))},
        {title: "Velocity residuals", isPower: true, curves: logarithmic(timeCurves(runs, "psi"))},
    ];
    return charts.filter((chart) => chart.curves.length > 0 && chart.curves.some((curve) => curve.y.some((y) => y !== 0 && !Number.isNaN(y))));
}

/* ---- Scales ---- */

function rangeOf(lists) {
    let low = Infinity, high = -Infinity;
    for (const list of lists)
        for (const value of list) {
            if (Number.isNaN(value)) /* a force that is not unique */
                continue;
            low = Math.min(low, value);
            high = Math.max(high, value);
        }
    const room = 0.04 * (high - low) || 0.05 * Math.abs(high) || 1;
    return {low: low - room, high: high + room};
}

/* About `count` round values within a range. */
function ticksOf(range, count) {
    const wanted = (range.high - range.low) / Math.max(2, count), least = roundLength(0.8 * wanted);
    const step = [1, 2, 2.5, 5].map((factor) => roundLength(factor * least * 1.001)).find((length) => length >= 0.8 * wanted);
    const ticks = [];
    for (let i = Math.ceil(range.low / step); i * step <= range.high; i++)
        ticks.push(i * step);
    return {ticks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9))};
}

/* The minus sign is as wide as a digit. */
function withMinus(text) {
    return text.replace(/-/g, "\u2212");
}

function tickText(value, digits, isPower) {
    if (isPower)
        return `1e${Math.round(value)}`;
    return Math.abs(value) >= 1e5 || digits > 4 ? value.toExponential(1) : withMinus(value.toFixed(digits));
}

/* Gives both axes of a path the same scale: the shorter range grows at both ends. */
function equalise(x, y, width, height) {
    const scale = Math.max((x.high - x.low) / width, (y.high - y.low) / height);
    for (const [range, pixels] of [[x, width], [y, height]]) {
        const more = (scale * pixels - (range.high - range.low)) / 2;
        range.low -= more;
        range.high += more;
    }
}

/* ---- A chart on the page ---- */

function newElement(kind, className, text) {
    const element = document.createElement(kind);
    element.className = className;
    element.textContent = text;
    return element;
}

/* Colours distinguish the curves of a single run, or several runs. */
function colourOf(chart, curve, index, palette) {
    const isMany = chart.curves.length > palette.length && chart.runCount === 1;
    if (isMany)
        return `hsl(${265 - 215 * index / (chart.curves.length - 1)}, 65%, ${30 + 25 * index / chart.curves.length}%)`;
    return `#${shownColour(palette[(chart.runCount > 1 ? curve.run : index) % palette.length]).getHexString()}`;
}

/* `previous` are curves of an earlier motion, drawn pale. */
function makeChart(chart, parent, runCount, palette) {
    const figure = newElement("figure", "chart", ""), plot = newElement("div", "plot", "");
    Object.assign(chart, {runCount, palette, previous: [], canvas: document.createElement("canvas"), keys: newElement("p", "keys", "")});
    figure.append(newElement("figcaption", "", chart.title), plot, chart.keys);
    plot.append(chart.canvas);
    chart.pen = chart.canvas.getContext("2d", {willReadFrequently: true}); /* drawn by the CPU, since a graphics card may be emulated */
    chart.canvas.setAttribute("role", "img");
    chart.canvas.setAttribute("aria-label", `${chart.title}, ${chart.curves.length} curves`);
    chart.marks = (chart.isPath ? chart.curves : [null]).map(() => newElement("div", chart.isPath ? "dot" : "cursor", ""));
    plot.append(...chart.marks);
    parent.append(figure);
    makeKeys(chart);
}

/* Names of the first curves, with their values at the time. */
function makeKeys(chart) {
    chart.keys.textContent = "";
    chart.values = chart.curves.slice(0, KEYS_MOST).map((curve, i) => {
        const key = newElement("span", "key", ""), sample = newElement("span", "sample", "");
        sample.style.background = colourOf(chart, curve, i, chart.palette);
        const value = newElement("span", "value", "");
        key.append(sample, chart.runCount > 1 ? `${curve.name} (${curve.run + 1})` : curve.name, " ", value);
        chart.keys.append(key);
        return value;
    });
    if (chart.curves.length > KEYS_MOST)
        chart.keys.append(newElement("span", "key", `and ${chart.curves.length - KEYS_MOST} more`));
}

/* Sets the size of a canvas, which costs time, only if it has changed. */
function resizeChart(chart, width, ratio) {
    const pixels = {width: Math.round(width * ratio), height: Math.round(CHART_HEIGHT * ratio)};
    if (chart.canvas.width !== pixels.width || chart.canvas.height !== pixels.height)
        Object.assign(chart.canvas, pixels);
    chart.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    chart.pen.clearRect(0, 0, width, CHART_HEIGHT);
}

function layOut(chart) {
    const width = chart.canvas.parentElement.clientWidth;
    resizeChart(chart, width, window.devicePixelRatio || 1);
    chart.box = {left: MARGIN.left, top: MARGIN.top, width: Math.max(1, width - MARGIN.left - MARGIN.right),
                 height: CHART_HEIGHT - MARGIN.top - MARGIN.bottom};
    const all = [...chart.curves, ...chart.previous];
    chart.x = rangeOf(all.map((curve) => curve.x));
    chart.y = rangeOf(all.map((curve) => curve.y));
    if (chart.isPath)
        equalise(chart.x, chart.y, chart.box.width, chart.box.height);
    else
        chart.x = rangeWithout(all);
}

/* Time fills the width. */
function rangeWithout(curves) {
    const low = Math.min(...curves.map((curve) => curve.x[0])), high = Math.max(...curves.map((curve) => curve.x[curve.x.length - 1]));
    return {low, high: high > low ? high : low + 1};
}

function pixelX(chart, x) {
    return chart.box.left + chart.box.width * (x - chart.x.low) / (chart.x.high - chart.x.low);
}

function pixelY(chart, y) {
    return chart.box.top + chart.box.height * (chart.y.high - y) / (chart.y.high - chart.y.low);
}

function drawAxes(chart) {
    const {pen, box} = chart;
    pen.font = "11px sans-serif";
    pen.fillStyle = pageColour("--quiet");
    pen.strokeStyle = pageColour("--grid");
    pen.lineWidth = 1;
    const x = ticksOf(chart.x, box.width / 70), y = ticksOf(chart.y, box.height / 30);
    const powers = y.ticks.filter((tick) => !chart.isPower || Math.abs(tick - Math.round(tick)) < 1e-9);
    pen.beginPath();
    pen.textAlign = "center";
    for (const tick of x.ticks) {
        pen.moveTo(pixelX(chart, tick), box.top);
        pen.lineTo(pixelX(chart, tick), box.top + box.height);
        pen.fillText(tickText(tick, x.digits, false), pixelX(chart, tick), box.top + box.height + 15);
    }
    pen.textAlign = "right";
    pen.fillText(chart.isPath ? `${chart.across || "x"} [m]` : "t [s]", box.left - 16, box.top + box.height + 15);
    for (const tick of powers) {
        pen.moveTo(box.left, pixelY(chart, tick));
        pen.lineTo(box.left + box.width, pixelY(chart, tick));
        pen.fillText(tickText(tick, y.digits, chart.isPower), box.left - 6, pixelY(chart, tick) + 4);
    }
    pen.stroke();
}

function drawCurve(chart, curve, colour) {
    const {pen} = chart;
    pen.strokeStyle = colour;
    pen.lineWidth = chart.curves.length > chart.palette.length ? 0.8 : 1.6;
    pen.lineJoin = "round";
    strokePath(chart, curve);
}

function strokePath(chart, curve) {
    const {pen} = chart;
    pen.beginPath();
    for (let i = 0; i < curve.x.length; i++)
        pen.lineTo(pixelX(chart, curve.x[i]), pixelY(chart, curve.y[i]));
    pen.stroke();
}

/* A limit as a dashed line, and what is beyond it as a broad band. isAbove: the limit is the largest value. */
function drawLimit(chart, curve, limit, isAbove) {
    const {pen, box} = chart;
    if (limit === null || limit < chart.y.low || limit > chart.y.high)
        return;
    const y = pixelY(chart, limit);
    pen.save();
    pen.strokeStyle = pageColour("--beyond");
    pen.lineWidth = 1;
    pen.setLineDash([4, 3]);
    strokePath(chart, {x: [chart.x.low, chart.x.high], y: [limit, limit]});
    pen.beginPath();
    pen.rect(box.left, isAbove ? box.top : y, box.width, isAbove ? y - box.top : box.top + box.height - y);
    pen.clip();
    pen.setLineDash([]);
    pen.lineWidth = 4;
    pen.globalAlpha = 0.5;
    strokePath(chart, curve);
    pen.restore();
}

function drawChart(chart) {
    layOut(chart);
    drawAxes(chart);
    chart.pen.globalAlpha = 0.3;
    chart.previous.forEach((curve, i) => drawCurve(chart, curve, colourOf(chart, curve, i, chart.palette)));
    chart.pen.globalAlpha = 1;
    for (const curve of chart.curves)
        for (const bound of chart.isPower ? [] : curve.bounds || []) {
            drawLimit(chart, curve, bound.from, false);
            drawLimit(chart, curve, bound.to, true);
        }
    chart.curves.forEach((curve, i) => drawCurve(chart, curve, colourOf(chart, curve, i, chart.palette)));
}

/* ---- What follows the time ---- */

function moveMark(mark, x, y) {
    mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
}

/* rows: by run, as moveRun returns them. */
function moveChart(chart, time, rows) {
    if (chart.isPath)
        chart.curves.forEach((curve, i) => moveMark(chart.marks[i], pixelX(chart, valueAt(curve.x, rows[curve.run])),
                                                    pixelY(chart, valueAt(curve.y, rows[curve.run]))));
    else
        moveMark(chart.marks[0], pixelX(chart, Math.min(time, chart.x.high)), chart.box.top);
}

function showValues(chart, rows) {
    chart.values.forEach((element, i) => {
        const curve = chart.curves[i], y = valueAt(curve.y, rows[curve.run]), x = valueAt(curve.x, rows[curve.run]);
        const text = chart.isPower ? (10 ** y).toExponential(1) : y.toPrecision(4);
        element.textContent = withMinus(chart.isPath ? `(${x.toPrecision(4)}, ${text})` : text);
    });
}
