/*
 * The visible parts of a run of motion.js: groups of three.js, one for each frame that carries something.
 * moveBody moves them to the present placements of the run.
 */
"use strict";

/* Sizes of marks as parts of the size of the bodies, and other sizes as parts of the size of the scene. */
const MARK = {stick: 0.0045, joint: 0.013, point: 0.011, triad: 0.06};
const SIZE = {thread: 0.0022, arrow: 0.25, letter: 0.036};

/* Shapes of length and width 1; a box and a cylinder begin at x = 0 and are along x, as in drawn_model.c. */
function unitShape(kind, bore, sides) {
    if (kind === 0)
        return new THREE.SphereBufferGeometry(0.5, sides, 0.7 * sides);
    if (kind === 2)
        return new THREE.BoxBufferGeometry(1, 1, 1).translate(0.5, 0, 0);
    return turnedTube(bore / 2, 0.5, sides);
}

/* Each edge occurs twice, so that faces meet sharply; a solid rod has no inner wall. */
function turnedTube(inner, outer, sides) {
    const wall = [[inner, 0], [outer, 0], [outer, 0], [outer, 1], [outer, 1], [inner, 1]];
    const corners = inner > 0 ? [...wall, [inner, 1], [inner, 0]] : wall;
    const profile = corners.map(([radius, height]) => new THREE.Vector2(radius, height));
    return new THREE.LatheBufferGeometry(profile, sides).rotateZ(-Math.PI / 2);
}

/* Thin shapes have few sides: more are invisible and cost time if software draws. */
function sidesOf(body, matrix) {
    const scale = new THREE.Vector3().setFromMatrixScale(matrix);
    return Math.max(scale.y, scale.z) < 0.02 * body.size ? 8 : 20;
}

/* The matrix of a map x -> M x + p, given as M row by row, then p. */
function matrixOf(list) {
    const [a, b, c, d, e, f, g, h, i, x, y, z] = list;
    return new THREE.Matrix4().set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1);
}

function fixedMesh(geometry, material, matrix) {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.matrixAutoUpdate = false;
    mesh.matrix.copy(matrix);
    return mesh;
}

/* Maps the unit cylinder to one of the given radius between two places. */
function stickMatrix(from, to, radius) {
    const along = new THREE.Vector3(...to).sub(new THREE.Vector3(...from));
    const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(1, 0, 0), along.clone().normalize());
    const size = new THREE.Vector3(along.length(), 2 * radius, 2 * radius);
    return new THREE.Matrix4().compose(new THREE.Vector3(...from), turn, size);
}

/* The group that moves with a frame; the group of the ground does not move. */
function groupOf(body, frame) {
    if (!body.groups.has(frame)) {
        const group = new THREE.Group();
        group.matrixAutoUpdate = false;
        body.groups.set(frame, group);
        body.all.add(group);
    }
    return body.groups.get(frame);
}

/* ---- Many shapes of one kind and material are drawn at once ---- */

/* `matrix` maps the unit shape to the axes of the frame. */
function addPart(body, kind, bore, material, frame, matrix, isSolid = false) {
    const sides = sidesOf(body, matrix), key = `${kind} ${bore} ${sides} ${isSolid} ${material.uuid}`;
    if (!body.parts.has(key))
        body.parts.set(key, {geometry: unitShape(kind, bore, sides), material, isSolid, places: []});
    body.parts.get(key).places.push({frame, matrix});
}

function closeParts(body) {
    for (const part of body.parts.values()) {
        part.mesh = new THREE.InstancedMesh(part.geometry, part.material, part.places.length);
        part.mesh.frustumCulled = false;
        body.all.add(part.mesh);
    }
}

const instanceMatrix = new THREE.Matrix4();

function moveParts(body) {
    for (const part of body.parts.values()) {
        part.places.forEach((place, i) => {
            instanceMatrix.multiplyMatrices(body.matrices.get(place.frame), place.matrix);
            part.mesh.setMatrixAt(i, instanceMatrix);
        });
        part.mesh.instanceMatrix.needsUpdate = true;
    }
}

/* ---- Marks of a run ---- */

function addShapes(body, materialOf) {
    for (const [kind, frame, link, isSolid, bore, ...map] of body.run.shapes)
        addPart(body, kind, bore, materialOf(link), frame, matrixOf(map), isSolid === 1);
    for (const [frame, link, ...ends] of body.run.sticks)
        if (Math.hypot(ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]) > 1e-4 * body.size)
            addPart(body, 1, 0, materialOf(link), frame, stickMatrix(ends.slice(0, 3), ends.slice(3), MARK.stick * body.marks));
}

/* The rotation that turns x into an axis of a frame. */
function axisTurn(axis) {
    const to = new THREE.Vector3().setComponent(axis, 1);
    return new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(1, 0, 0), to);
}

/* Elements of beams show no joints, nor does a link with six coordinates, which nothing guides. */
function showsJoint(frames, i) {
    const {link, element} = frames[i];
    return element === 0 && frames.filter((frame) => frame.link === link && frame.element === 0).length < 6;
}

/* A turn is drawn as a pin along its axis, a slide as a block on a rail. */
function addJoints(body, material) {
    const size = MARK.joint * body.marks;
    const alone = material.clone(); /* three.js makes one program of a material, for parts or for what stands alone */
    body.run.frames.forEach((frame, i) => {
        if (!showsJoint(body.run.frames, i))
            return;
        const scale = frame.isTurn ? new THREE.Vector3(2.6 * size, 2 * size, 2 * size)
                                   : new THREE.Vector3(2.4 * size, 1.6 * size, 1.6 * size);
        const middle = new THREE.Vector3().setComponent(frame.axis, -scale.x / 2);
        const matrix = new THREE.Matrix4().compose(middle, axisTurn(frame.axis), scale);
        addPart(body, frame.isTurn ? 1 : 2, 0, material, i, matrix);
        if (!frame.isTurn)
            body.rails.push({frame: i, mesh: addRail(body, i, alone)});
    });
}

function addRail(body, frame, material) {
    const mesh = fixedMesh(unitShape(1, 0, 8), material, new THREE.Matrix4());
    groupOf(body, frame).add(mesh);
    return mesh;
}

/* The rail leads from the zero of the slide, which is -q along the axis, to the frame. */
function moveRail(body, rail) {
    const frame = body.run.frames[rail.frame], q = body.run.state[rail.frame], radius = MARK.stick * body.marks;
    const from = new THREE.Vector3().setComponent(frame.axis, Math.min(0, -q));
    const size = new THREE.Vector3(Math.max(Math.abs(q), 1e-6 * body.size), 1.2 * radius, 1.2 * radius);
    rail.mesh.matrix.compose(from, axisTurn(frame.axis), size);
}

function addPoints(body, material, letters) {
    const size = 2 * MARK.point * body.marks;
    for (const [i, point] of body.run.points.entries()) {
        const matrix = new THREE.Matrix4().makeScale(size, size, size).setPosition(...point.at);
        addPart(body, 0, 0, material, point.frame, matrix);
        if (letters)
            groupOf(body, point.frame).add(letterAt(point.name, point.at, SIZE.letter * body.size, letters, lineOf(body, i)));
    }
}

/* Names of points that begin at the same place are stacked. */
function lineOf(body, point) {
    const begin = body.paths[point][0];
    return body.paths.slice(0, point).filter((path) => Math.hypot(...path[0].map((x, i) => x - begin[i])) < 0.02 * body.size).length;
}

/* Ends of a closure are open diamonds around the points that it joins. */
function addClosures(body, material) {
    const diamond = new THREE.OctahedronBufferGeometry(1.9 * MARK.joint * body.marks);
    for (const closure of body.run.closures)
        for (const end of closure.ends)
            groupOf(body, end.frame).add(fixedMesh(diamond, material, new THREE.Matrix4().setPosition(...end.at)));
}

function addTriads(body) {
    body.run.frames.forEach((frame, i) => {
        if (frame.element > 0)
            return;
        const axes = new THREE.AxesHelper(MARK.triad * body.marks);
        axes.visible = false;
        body.triads.push(axes);
        groupOf(body, i).add(axes);
    });
}

/* A text that faces the reader, a number of lines above a place. */
function letterAt(text, at, size, colour, line) {
    const canvas = document.createElement("canvas"), height = 64;
    const pen = canvas.getContext("2d");
    pen.font = `600 ${0.7 * height}px sans-serif`;
    canvas.width = Math.ceil(pen.measureText(text).width) + 8;
    canvas.height = height;
    pen.font = `600 ${0.7 * height}px sans-serif`;
    pen.fillStyle = colour;
    pen.fillText(text, 4, 0.75 * height);
    const texture = new THREE.CanvasTexture(canvas);
    texture.minFilter = THREE.LinearFilter;
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, depthTest: false, transparent: true}));
    sprite.center.set(0, -0.2 - line);
    sprite.position.set(...at);
    sprite.scale.set(size * canvas.width / height, size, 1);
    return sprite;
}

/* ---- Paths ---- */

/* Two directions orthogonal to the path at a row. */
function acrossPath(path, row) {
    const along = new THREE.Vector3(...path[Math.min(row + 1, path.length - 1)]).sub(new THREE.Vector3(...path[Math.max(row - 1, 0)]));
    const away = new THREE.Vector3(0.36, 0.48, 0.8); /* any direction that is hardly along a path */
    const first = along.clone().cross(away).normalize();
    return [first, along.cross(first).normalize()];
}

/* A thread along a path with four corners at each row, so that a part of it is a range of indices. */
function threadGeometry(path, radius) {
    const places = [], indices = [];
    path.forEach((place, row) => {
        const [first, second] = acrossPath(path, row);
        for (const [direction, sign] of [[first, 1], [second, 1], [first, -1], [second, -1]])
            places.push(...place.map((x, i) => x + sign * radius * direction.getComponent(i)));
        for (let side = 0; side < 4 && row + 1 < path.length; side++) {
            const a = 4 * row + side, b = 4 * row + (side + 1) % 4;
            indices.push(a, b, a + 4, b, b + 4, a + 4);
        }
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    geometry.setIndex(indices);
    return geometry;
}

const THREAD_INDICES = 24; /* from one row to the next */

/* The whole path in a pale colour, and on it the part that the point has already covered. */
function addTrails(body, colour, behindOthers) {
    for (const path of body.paths) {
        const pale = behindOthers(new THREE.MeshBasicMaterial({color: colour, transparent: true, opacity: 0.28, side: THREE.DoubleSide}));
        const full = behindOthers(new THREE.MeshBasicMaterial({color: colour, side: THREE.DoubleSide}));
        const whole = new THREE.Mesh(threadGeometry(path, 0.6 * SIZE.thread * body.size), pale);
        const trail = new THREE.Mesh(threadGeometry(path, SIZE.thread * body.size), full);
        trail.frustumCulled = false;
        body.trails.push(trail);
        body.paths3d.add(whole, trail);
    }
}

/* Curves of a programme are in planes that move with their points. */
function addCurves(body, colour) {
    const dash = 0.012 * body.size, material = new THREE.LineDashedMaterial({color: colour, dashSize: dash, gapSize: dash});
    for (const curve of body.run.curves) {
        const places = [];
        for (let i = 0; i < curve.path.length; i += 2) {
            const place = new THREE.Vector3().setComponent(curve.axes[0], curve.path[i]);
            places.push(place.setComponent(curve.axes[1], curve.path[i + 1]));
        }
        if (curve.closed)
            places.push(places[0]);
        const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(places), material).computeLineDistances();
        body.curves.push({line, point: body.run.points[curve.point], across: 3 - curve.axes[0] - curve.axes[1]});
        body.paths3d.add(line);
    }
}

function moveCurve(body, curve) {
    curve.line.position.setComponent(curve.across, placeNow(body.run, curve.point)[curve.across]);
}

/* ---- Forces ---- */

const TIP = 0.22; /* of the full length */

/* Shaft and tip of an arrow along x, or three quarters of a circle about x with a tip. */
function arrowGroup(isTurn, material) {
    const group = new THREE.Group(), tip = new THREE.ConeBufferGeometry(0.07, TIP, 16);
    const [shaft, head] = isTurn
        ? [new THREE.TorusBufferGeometry(0.5, 0.025, 8, 36, 1.5 * Math.PI).rotateY(Math.PI / 2),
           tip.rotateX(-Math.PI / 2).translate(0, -0.5, 0)]
        : [turnedTube(0, 0.025, 12), tip.rotateZ(-Math.PI / 2).translate(TIP / 2, 0, 0)];
    group.add(new THREE.Mesh(shaft, material), new THREE.Mesh(head, material));
    return group;
}

/* The shaft has the length that the tip leaves; an arrow shorter than its tip is a smaller tip. */
function stretchArrow(group, part) {
    const [shaft, tip] = group.children, length = Math.abs(part);
    shaft.visible = length > TIP;
    shaft.scale.x = Math.max(length - TIP, 1e-6);
    tip.position.x = Math.max(length - TIP, 0);
    tip.scale.setScalar(Math.min(1, length / TIP));
}

/* A force on a coordinate, along or about the axis of its joint. */
function addCoordinateForce(body, frame, values, material) {
    const isTurn = body.run.frames[frame].isTurn, group = arrowGroup(isTurn, material);
    group.quaternion.copy(axisTurn(body.run.frames[frame].axis));
    groupOf(body, frame).add(group);
    body.forces.push({group, isTurn, parts: [values]});
}

/* A force or torque at a point, with components along the axes of the ground. */
function addLoad(body, load, material) {
    const group = arrowGroup(load.kind === "torque", material);
    body.all.add(group);
    body.forces.push({group, isTurn: load.kind === "torque", parts: load.parts, at: load});
}

function largestPart(forces) {
    return forces.reduce((most, force) => force.parts.reduce(
        (all, part) => part.reduce((one, value) => Math.max(one, Math.abs(value)), all), most), 0);
}

/* The largest force and the largest torque have the full length. */
function addForces(body, programme, applied) {
    for (const course of body.run.courses.filter((one) => one.kind === "force")) {
        const isOf = (name) => course.name === `force_${name}` || course.name === `force_force_${name}`;
        addCoordinateForce(body, body.run.coordinates.findIndex(isOf), course.values, programme);
    }
    for (const force of body.run.applied)
        if (force.kind === "drive")
            addCoordinateForce(body, force.frame, force.parts[0], applied);
        else
            addLoad(body, force, applied);
    for (const force of body.forces)
        force.largest = largestPart(body.forces.filter((other) => other.isTurn === force.isTurn));
}

/* Turns and places the arrow of a load; returns its length. */
function directLoad(body, force, row) {
    const vector = new THREE.Vector3(...force.parts.map((part) => valueAt(part, row))), length = vector.length();
    force.group.position.set(...placeNow(body.run, force.at));
    if (length > 0)
        force.group.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), vector.divideScalar(length));
    return length;
}

function moveForce(body, force, row, isShown) {
    const value = force.at ? directLoad(body, force, row) : valueAt(force.parts[0], row);
    const part = value / force.largest, full = SIZE.arrow * body.size;
    force.group.visible = isShown && Math.abs(part) > 0.015;
    if (force.isTurn) { /* a mirrored bow turns the other way */
        force.group.scale.set(Math.abs(part), part, Math.abs(part)).multiplyScalar(full);
        return;
    }
    stretchArrow(force.group, part);
    force.group.scale.set(Math.sign(part) * full, full, full);
}

/* ---- The whole run ---- */

/* `look`: {size, marks: lengths, materialOf(link), joint, point, closure, programme, applied: materials, trail, curve: colours, behindOthers(material), letters: colour or null} */
function makeBody(run, paths, look) {
    const body = {run, paths, size: look.size, marks: look.marks, all: new THREE.Group(), groups: new Map(), parts: new Map(),
                  matrices: new Map(), rails: [], trails: [],
                  curves: [], forces: [], triads: [], paths3d: new THREE.Group()};
    addShapes(body, look.materialOf);
    addJoints(body, look.joint);
    addPoints(body, look.point, look.letters);
    addClosures(body, look.closure);
    addTriads(body);
    addTrails(body, look.trail, look.behindOthers);
    addCurves(body, look.curve);
    addForces(body, look.programme, look.applied);
    closeParts(body);
    body.all.add(body.paths3d);
    return body;
}

/* Moves everything to the present placements, at the row that moveRun returned. */
function moveBody(body, row, shown) {
    for (let frame = -1; frame < body.run.frames.length; frame++)
        body.matrices.set(frame, matrixOf(placementOf(body.run, frame)));
    moveParts(body);
    for (const [frame, group] of body.groups) {
        group.matrix.copy(body.matrices.get(frame));
        group.matrixWorldNeedsUpdate = true;
    }
    body.curves.forEach((curve) => moveCurve(body, curve));
    body.rails.forEach((rail) => moveRail(body, rail));
    body.forces.forEach((force) => moveForce(body, force, row, shown.forces));
    body.triads.forEach((triad) => { triad.visible = shown.frames; });
    body.paths3d.visible = shown.paths;
    for (const part of body.parts.values())
        part.mesh.visible = shown.solids || !part.isSolid;
    for (const trail of body.trails)
        trail.geometry.setDrawRange(0, THREAD_INDICES * row.low);
}
