/*
 * The motion of the frames: computes the placements of all frames at any time from the data of the page.
 *
 * A placement is twelve numbers, R row by row, then the position: x = R x' + p. Frame i has a constant
 * placement A in its parent p and moves by its joint: T_i = T_p A D(q_i).
 */
"use strict";

/* The values of a course from its steps in whole units. */
function decodeCourse(course) {
    let sum = 0;
    return Float64Array.from(course.steps, (step) => (sum += step) * course.unit);
}

function identityPlacement() {
    return [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];
}

/* result = outer inner. */
function composePlacements(outer, inner, result) {
    for (let row = 0; row < 3; row++) {
        const a = outer[3 * row], b = outer[3 * row + 1], c = outer[3 * row + 2];
        for (let column = 0; column < 3; column++)
            result[3 * row + column] = a * inner[column] + b * inner[3 + column] + c * inner[6 + column];
        result[9 + row] = a * inner[9] + b * inner[10] + c * inner[11] + outer[9 + row];
    }
}

/* Coordinates in the ground frame of a place in a frame. */
function placePoint(placement, at) {
    return [0, 1, 2].map((row) => placement[3 * row] * at[0] + placement[3 * row + 1] * at[1] +
                                  placement[3 * row + 2] * at[2] + placement[9 + row]);
}

/* A frame from its list in the data, as drawn_model.c describes it. */
function readFrame(list) {
    const constant = identityPlacement();
    constant.splice(9, 3, ...list.slice(4, 7));
    if (list.length > 7)
        constant.splice(0, 9, ...list.slice(7, 16));
    return {parent: list[0], link: list[1], element: list[2], axis: list[3] % 3, isTurn: list[3] >= 3, constant};
}

/* A slide along an axis, or a turn about it. */
function setJoint(frame, q, result) {
    const next = (frame.axis + 1) % 3, last = (frame.axis + 2) % 3;
    result.set(GROUND);
    if (!frame.isTurn) {
        result[9 + frame.axis] = q;
        return;
    }
    result[4 * next] = result[4 * last] = Math.cos(q);
    result[3 * last + next] = Math.sin(q);
    result[3 * next + last] = -Math.sin(q);
}

const GROUND = Float64Array.from(identityPlacement());
const jointPlacement = new Float64Array(12), carriedPlacement = new Float64Array(12);

/* Computes the placements of all frames at the coordinates q. */
function placeFrames(frames, q, placements) {
    frames.forEach((frame, i) => {
        const parent = frame.parent < 0 ? GROUND : placements[frame.parent];
        setJoint(frame, q[i], jointPlacement);
        composePlacements(parent, frame.constant, carriedPlacement);
        composePlacements(carriedPlacement, jointPlacement, placements[i]);
    });
}

/* The last row at or before a time, and the fraction of the way to the next row. */
function findRow(t, time) {
    let low = 0, high = t.length - 1;
    while (low + 1 < high) {
        const middle = (low + high) >> 1;
        if (t[middle] <= time)
            low = middle;
        else
            high = middle;
    }
    const length = t[high] - t[low];
    const part = length > 0 ? (time - t[low]) / length : 0;
    return {low, high, part: Math.min(1, Math.max(0, part))};
}

function valueAt(values, row) {
    return values[row.low] + row.part * (values[row.high] - values[row.low]);
}

/* A run of the data, with its moving state, from its drawn model and from arrays over its rows. */
function makeRun(data, {t, q, courses, applied}) {
    const frames = data.frames.map(readFrame);
    return {
        name: data.name, model: data.model, coordinates: data.coordinates, links: data.links, frames,
        shapes: data.shapes, sticks: data.sticks, points: data.points, closures: data.closures, curves: data.curves,
        bounds: data.bounds,
        t, q, courses, applied,
        placements: frames.map(() => new Float64Array(12)),
        state: new Float64Array(frames.length),
    };
}

/* The same with courses as recorded runs have them. */
function readRun(data) {
    return makeRun(data, {
        t: decodeCourse(data.t), q: data.q.map(decodeCourse),
        courses: data.courses.map((course) => ({name: course.name, kind: course.kind, values: decodeCourse(course)})),
        applied: data.applied.map((applied) => ({...applied, parts: applied.parts.map(decodeCourse)})),
    });
}

/* Moves a run to a time; returns the row. */
function moveRun(run, time) {
    const row = findRow(run.t, time);
    run.q.forEach((values, i) => { run.state[i] = valueAt(values, row); });
    placeFrames(run.frames, run.state, run.placements);
    return row;
}

function placementOf(run, frame) {
    return frame < 0 ? GROUND : run.placements[frame];
}

/* The present position of something that has a frame and a place in it. */
function placeNow(run, fixed) {
    return placePoint(placementOf(run, fixed.frame), fixed.at);
}

/* Paths of the points over all rows, [point][row] = [x, y, z]; the box of all frames and points over the motion;
 * and the largest diagonal of such a box at one time. */
function tracePaths(run) {
    const paths = run.points.map(() => []), box = emptyBox();
    let extent = 0;
    for (const time of run.t) {
        moveRun(run, time);
        run.points.forEach((point, i) => paths[i].push(placeNow(run, point)));
        const now = boxNow(run);
        growBox(box, now.low);
        growBox(box, now.high);
        extent = Math.max(extent, Math.hypot(...now.high.map((high, i) => high - now.low[i])));
    }
    return {paths, box, extent};
}

function emptyBox() {
    return {low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity]};
}

/* The box of all moving parts at the present time. */
function boxNow(run) {
    const box = emptyBox();
    run.points.forEach((point) => growBox(box, placeNow(run, point)));
    run.placements.forEach((placement) => growBox(box, placement.subarray(9)));
    run.shapes.forEach((shape) => growBoxByShape(box, run, shape));
    return box;
}

function growBox(box, place) {
    for (let i = 0; i < 3; i++) {
        box.low[i] = Math.min(box.low[i], place[i]);
        box.high[i] = Math.max(box.high[i], place[i]);
    }
}

/* Both ends of the axis of a shape, from its list in the data, as drawn_model.c describes it. */
function growBoxByShape(box, run, shape) {
    const placement = placementOf(run, shape[1]), origin = shape.slice(14, 17);
    growBox(box, placePoint(placement, origin));
    growBox(box, placePoint(placement, [0, 1, 2].map((i) => origin[i] + shape[5 + 3 * i])));
}
