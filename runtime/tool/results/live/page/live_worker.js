/*
 * Computes motions beside the page, in a module of WebAssembly. Messages to it: first {module: packed bytes}, then
 * requests {id, p, x, starts: [[index, value], ...], given, until, every, step, tol, tolRates, fromStatics, pull: null or {point, from, speed, hand}};
 * while a point is pulled {hand: [x, y, z]}, {isShown: true} after each part of the motion, and {release: id}. It answers each with the
 * motion or with why it has failed. Of several waiting requests only the newest is computed. When no request has come for
 * a while, it also sends the modes {id, modes: [[frequency, damping], ...], message} for the values of the last motion, and an
 * estimate of its error {id, estimate: {error, at, kinds: [{name, relative, column}, ...], isTrusted}}.
 */
"use strict";

const SLICE = 12; /* time between two looks for messages [ms] */
const QUIET = 60; /* time without a request after which modes and error are computed, so that they do not delay a motion [ms] */
const PATIENCE = 300; /* a motion that has taken longer is given up for a newer request [ms] */

const engine = {module: null, live: 0, waiting: null, isRunning: false, columns: null, quiet: 0, judged: null, released: 0, isShown: true};

/* The C library would print to files, which a page does not have; it takes this answer as an error. */
function wasiFunctions(module) {
    const BAD_FILE = 8, functions = {};
    for (const {module: space, name} of WebAssembly.Module.imports(module)) {
        functions[space] = functions[space] || {};
        functions[space][name] = name === "proc_exit" ? () => { throw new Error("the module has stopped"); } : () => BAD_FILE;
    }
    return functions;
}

function openModule(bytes) {
    const module = new WebAssembly.Module(bytes);
    engine.module = new WebAssembly.Instance(module, wasiFunctions(module)).exports;
    engine.module._initialize();
    engine.live = engine.module.live_open();
}

/* Arrays in the memory of the module, which moves when it grows: use them at once. */
function numbersAt(place, count) {
    return new Float64Array(engine.module.memory.buffer, place, count);
}

function wholesAt(place, count) {
    return new Int32Array(engine.module.memory.buffer, place, count);
}

function textAt(place) {
    const bytes = new Uint8Array(engine.module.memory.buffer);
    let end = place;
    while (bytes[end] !== 0)
        end++;
    return new TextDecoder().decode(bytes.subarray(place, end));
}

function call(name, ...values) {
    return engine.module[`live_${name}`](engine.live, ...values);
}

function listColumns() {
    return Array.from({length: call("column_count")}, (_, i) => (
        {name: textAt(call("column_name", i)), unit: textAt(call("column_unit", i)), kind: textAt(call("column_kind", i)),
        motionKind: textAt(call("column_motion_kind", i))}));
}

function setValues(asked) {
    numbersAt(call("parameters"), asked.p.length).set(asked.p);
    numbersAt(call("inputs"), asked.x.length).set(asked.x);
    wholesAt(call("given"), asked.given.length).set(asked.given);
    const starts = numbersAt(call("start"), 2 * asked.n), chosen = wholesAt(call("start_given"), 2 * asked.n);
    chosen.fill(0);
    for (const [index, value] of asked.starts) {
        starts[index] = value;
        chosen[index] = 1;
    }
    call("plan_pull", asked.pull ? asked.pull.point : -1, asked.pull ? asked.pull.from : 0);
    call("move_hand", ...(asked.pull ? asked.pull.hand : [0, 0, 0]));
}

function listCurves() {
    return Array.from({length: call("curve_count")}, (_, i) => {
        const count = call("trace_curve", i), [point, ...axes] = [0, 1, 2].map((fact) => call("curve_fact", i, fact));
        return {point, axes, closed: call("curve_fact", i, 3) === 1, path: Array.from(numbersAt(call("curve_places"), 2 * count))};
    }).filter((curve) => curve.path.length > 0);
}

/* The motion so far, or all of it. */
function answerDone(asked, isPartial) {
    const count = call("row_count"), width = call("column_count");
    engine.columns = engine.columns || listColumns();
    const rows = numbersAt(call("rows"), count * width).slice(), drawing = numbersAt(call("drawing"), asked.drawing).slice();
    const applied = numbersAt(call("applied"), count * asked.applied).slice();
    const [steps, rejected, energyError, t, hasEnded, share] = numbersAt(call("facts"), 6);
    engine.judged = isPartial || asked.pull ? null : {asked: {...asked, until: t}, rows: rows.slice(), share};
    postMessage({
        id: asked.id, isDone: true, isPartial, isPulled: asked.pull !== null, columns: engine.columns, curves: listCurves(), count, rows, drawing, applied, p: asked.used.p, start: asked.used.start,
        message: textAt(call("message")), steps, rejected, energyError, t, hasEnded, seconds: 1e-3 * asked.spent,
        memory: engine.module.memory.buffer.byteLength,
    }, [rows.buffer, drawing.buffer, applied.buffer]);
}

/* Lets the messages in that have come meanwhile. */
const pauses = new MessageChannel();
function pause() {
    return new Promise((resolve) => {
        pauses.port1.onmessage = resolve;
        pauses.port2.postMessage(null);
    });
}

function lastTime() {
    return numbersAt(call("rows"), call("row_count") * call("column_count"))[(call("row_count") - 1) * call("column_count")];
}

/* Takes steps for at most a slice of time, or until `isThere`; notes the time spent. Returns the status of the module. */
function advance(asked, isThere) {
    const began = performance.now();
    let status = 1, now = began;
    while (status === 1 && now < began + SLICE && !isThere()) {
        status = call("advance");
        now = performance.now();
    }
    asked.spent += now - began;
    return status;
}

/* Computes the motion as time passes, from the time at which the hand begins to pull until it lets go; sends parts of it, each
 * after the one before is shown. Returns the status of the module. */
async function followHand(asked) {
    const {from, speed} = asked.pull;
    let status = 1, sent = 0;
    engine.isShown = true;
    while (status === 1 && lastTime() < from)
        status = advance(asked, () => lastTime() >= from);
    for (const started = performance.now(); status === 1 && engine.released !== asked.id && !engine.waiting;) {
        const goal = from + 1e-3 * (performance.now() - started) * speed;
        status = advance(asked, () => lastTime() >= goal);
        if (engine.isShown && status === 1 && call("row_count") > Math.max(1, sent)) {
            sent = call("row_count");
            engine.isShown = false;
            answerDone(asked, true);
        }
        await new Promise((resolve) => setTimeout(resolve, SLICE));
    }
    call("release_pull");
    return status;
}

/* Computes to the end, or until `isLate`; returns the status of the module. */
async function finish(asked, status, isLate) {
    while (status === 1) {
        status = advance(asked, () => false);
        if (status !== 1)
            break;
        await pause();
        if (isLate())
            break;
    }
    return status;
}

async function compute(asked) {
    const began = performance.now();
    setValues(asked);
    let status = call("begin", asked.until, asked.every, asked.step, asked.tol, asked.tolRates, asked.fromStatics ? 1 : 0);
    asked.used = {p: numbersAt(call("parameters"), asked.p.length).slice(), start: numbersAt(call("used_start"), 2 * asked.n).slice()};
    asked.spent = performance.now() - began;
    if (asked.pull && status === 1)
        status = await followHand(asked);
    status = await finish(asked, status, () => engine.waiting && asked.spent > PATIENCE);
    if (status === 1)
        return;
    if (status === 0)
        answerDone(asked, false);
    else
        postMessage({id: asked.id, isDone: false, message: textAt(call("message"))});
}

/* The largest distance of points at a row of two motions, or of coordinates in a model without points. */
function distanceOf(a, i, b, j, {n, points}) {
    const width = call("column_count"), far = (column) => a[i * width + column] - b[j * width + column];
    const ofPoint = (_, k) => Math.hypot(...[0, 1, 2].map((axis) => far(1 + 2 * n + 9 * k + axis)));
    return Math.max(...(points > 0 ? Array.from({length: points}, ofPoint) : Array.from({length: n}, (_, k) => Math.abs(far(1 + k)))));
}

const NEAR = 0.05; /* part of the way of the motion; motions that differ by more do not estimate an error */
const LEAST_WAY = 1e-6; /* of a body at rest that moves by rounding [m, rad] */

/* For each kind of column the largest error, relative to the largest value of the same kind and unit. A value that is not unique is
 * NaN in both motions. */
function errorsOfKinds(rows, finer, count, factor) {
    const width = call("column_count"), scales = new Map(), worst = new Map();
    const list = engine.columns.map(({name, unit, motionKind}, i) => ({name, motionKind, scale: `${motionKind} ${unit}`, i})).filter(({motionKind}) => motionKind);
    const largestOf = (valueAt) => Array.from({length: count}, (_, k) => valueAt(k * width)).reduce((most, value) => Math.abs(value) > most ? Math.abs(value) : most, 0);
    for (const {scale, i} of list)
        scales.set(scale, Math.max(scales.get(scale) || 0, largestOf((at) => rows[at + i])));
    for (const {name, motionKind, scale, i} of list) {
        const error = factor * largestOf((at) => rows[at + i] - finer[at + i]), relative = error > 0 ? error / scales.get(scale) : 0;
        if (!worst.has(motionKind) || relative > worst.get(motionKind).relative)
            worst.set(motionKind, {name: motionKind, relative, column: name});
    }
    return [...worst.values()];
}

/* The error of a motion from its difference to a finer one, as `sim --verify` estimates it. */
function errorOf({asked, rows, share}, finer, hasKinds) {
    const width = call("column_count"), factor = 1 / (1 - share);
    let largest = 0, at = 0, way = 0, i = 0;
    for (; i < Math.min(rows.length, finer.length) / width && rows[i * width] === finer[i * width]; i++) {
        const distance = distanceOf(rows, i, finer, i, asked);
        way = Math.max(way, LEAST_WAY, distanceOf(rows, i, rows, 0, asked));
        if (distance > largest) {
            largest = distance;
            at = rows[i * width];
        }
    }
    return {error: factor * largest, at, kinds: hasKinds ? errorsOfKinds(rows, finer, i, factor) : [], isTrusted: largest <= NEAR * way};
}

/* Repeats the last motion more accurately, unless a request comes. If this motion cannot bound its errors of rates, as near a singular
 * position, it bounds those of positions alone, which are then the only ones with an estimate. */
async function verify(judged) {
    const {asked} = judged;
    let status = -1, hasKinds = 1;
    const repeat = async () => {
        setValues(asked);
        status = await finish(asked, call("begin_finer", asked.until, asked.every, asked.fromStatics ? 1 : 0, hasKinds), () => engine.waiting);
    };
    await repeat();
    if (status < 0) {
        hasKinds = 0;
        await repeat();
    }
    if (status === 0)
        postMessage({id: asked.id, estimate: errorOf(judged, numbersAt(call("rows"), call("row_count") * call("column_count")), hasKinds === 1)});
}

function sendModes(id) {
    const count = call("find_modes"), numbers = count > 0 ? numbersAt(call("modes"), 2 * count) : [];
    postMessage({id, modes: count < 0 ? null : Array.from({length: count}, (_, i) => [numbers[2 * i], numbers[2 * i + 1]]), message: textAt(call("message"))});
}

/* After an error the module begins again. */
async function guard(id, work) {
    try {
        await work();
    } catch (error) {
        openModule(engine.bytes);
        postMessage({id, isDone: false, message: `The module has stopped: ${error.message}`});
    }
}

/* What takes its time after a motion. */
async function review(id) {
    const {judged} = engine;
    engine.isRunning = true;
    await guard(id, async () => {
        sendModes(id);
        if (judged)
            await verify(judged);
    });
    engine.isRunning = false;
    if (engine.waiting)
        computeAll();
}

async function computeAll() {
    engine.isRunning = true;
    let id = 0;
    while (engine.waiting) {
        const asked = engine.waiting;
        Object.assign(engine, {waiting: null, judged: null});
        id = asked.id;
        await guard(id, () => compute(asked));
    }
    engine.isRunning = false;
    engine.quiet = setTimeout(() => review(id), QUIET);
}

onmessage = async ({data}) => {
    if (data.hand && engine.waiting)
        engine.waiting.pull = engine.waiting.pull && {...engine.waiting.pull, hand: data.hand};
    else if (data.hand)
        call("move_hand", ...data.hand);
    else if (data.release)
        engine.released = data.release;
    else if (data.isShown)
        engine.isShown = true;
    else
        await take(data);
};

async function take(data) {
    clearTimeout(engine.quiet);
    if (data.module) {
        engine.bytes = await unpack(data.module);
        openModule(engine.bytes);
    } else
        engine.waiting = data;
    if (engine.module && engine.waiting && !engine.isRunning)
        computeAll();
}
