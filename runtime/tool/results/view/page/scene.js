/*
 * The picture: a stage on a canvas draws runs and their paths with ground, light and a triad of the ground's
 * axes, in the colours of the page.
 */
"use strict";

function pageColour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/* Lightens the palette on a dark page, where its dark colours would be invisible. */
function shownColour(colour) {
    const isDark = pageColour("--is-dark") === "1";
    return isDark ? new THREE.Color(colour).lerp(new THREE.Color(0xffffff), 0.36) : new THREE.Color(colour);
}

function joinBoxes(boxes) {
    const joined = {low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity]};
    boxes.forEach((box) => { growBox(joined, box.low); growBox(joined, box.high); });
    return joined;
}

function diagonalOf(box) {
    return Math.hypot(...box.high.map((high, i) => high - box.low[i]));
}

/* 1, 2 or 5 times a power of ten. */
function roundLength(length) {
    const power = 10 ** Math.floor(Math.log10(length));
    return power * [5, 2, 1].find((factor) => factor * power <= length * (1 + 1e-9));
}

/* Horizontal grid lines below everything, at a round distance that limits their number. */
function makeGrid(box, size, up) {
    const cell = roundLength(Math.max(size / 6, diagonalOf(box) / 300)), group = new THREE.Group(), level = [(up + 1) % 3, (up + 2) % 3];
    const ends = level.map((i) => [Math.floor(box.low[i] / cell - 0.2) * cell, Math.ceil(box.high[i] / cell + 0.2) * cell]);
    const places = [], height = Math.min(0, box.low[up]);
    for (let i = 0; i < 2; i++)
        for (let x = ends[i][0]; x <= ends[i][1] + 0.5 * cell; x += cell)
            for (const y of ends[1 - i]) {
                const place = [height, height, height];
                place[level[i]] = x;
                place[level[1 - i]] = y;
                places.push(...place);
            }
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
    group.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: pageColour("--grid")})));
    return {group, cell};
}

function makeLights(scene) {
    scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.75));
    const lamp = new THREE.DirectionalLight(0xffffff, 0.55);
    lamp.position.set(-0.5, -1, 1.6);
    scene.add(lamp);
}

/* The directions of x, y and z, drawn in a corner of the picture. */
function makeTriad(camera) {
    const scene = new THREE.Scene(), colours = ["#c8442c", "#2e8b3d", "#2f62c9"];
    colours.forEach((colour, axis) => {
        const end = [0, 0, 0];
        end[axis] = 1;
        const material = new THREE.MeshBasicMaterial({color: shownColour(colour)});
        scene.add(fixedMesh(unitShape(1, 0, 8), material, stickMatrix([0, 0, 0], end, 0.035)));
        scene.add(letterAt("xyz"[axis], end, 0.55, `#${shownColour(colour).getHexString()}`, 0));
    });
    const lens = new THREE.OrthographicCamera(-1.6, 1.6, 1.6, -1.6, 0, 10);
    lens.up.copy(camera.lens.up);
    return {scene, lens};
}

/* Of faces in one plane, as in a planar linkage or equal runs, the one of the earlier link or run is visible. */
function behind(material, others) {
    return Object.assign(material, {polygonOffset: true, polygonOffsetFactor: 0.5 * others, polygonOffsetUnits: 4 * others});
}

/* The largest size of the runs at any one time, and the radius that the camera keeps in its picture. */
const extentOf = (runs) => Math.max(...runs.map((run) => run.extent));

function radiusOf(stage, runs) {
    const whole = 0.5 * diagonalOf(stage.box) || 0.5;
    return stage.isFollowing ? Math.min(whole, Math.max(0.7 * extentOf(runs), 1e-3 * whole)) : whole;
}

/* If paths are long compared with the bodies, marks stay small enough not to cover these, but visible. */
function marksOf(stage, runs) {
    return Math.min(stage.size, Math.max(3 * extentOf(runs), stage.size / 8));
}

const FORCE_COLOURS = {programme: "#b3261e", applied: "#6a3d9a"};

/* A single run has a colour for each link; several runs have one colour each. */
function lookOf(stage, index, count) {
    const behindOthers = (material) => behind(material, 4 * index);
    const plain = (colour) => behindOthers(new THREE.MeshLambertMaterial({color: colour}));
    const own = plain(shownColour(stage.palette[index % stage.palette.length]));
    const links = new Map();
    const materialOf = (link) => {
        if (!links.has(link))
            links.set(link, behind(plain(shownColour(stage.palette[link % stage.palette.length])), link));
        return count > 1 ? own : links.get(link);
    };
    const ink = pageColour("--ink");
    return {size: stage.size, marks: stage.marks, behindOthers, materialOf, joint: plain(shownColour("#5a6068")), point: plain(shownColour(stage.palette[6])),
            closure: new THREE.MeshBasicMaterial({color: shownColour("#a84400"), wireframe: true}),
            programme: plain(shownColour(FORCE_COLOURS.programme)), applied: plain(shownColour(FORCE_COLOURS.applied)), trail: shownColour(stage.palette[count > 1 ? index % stage.palette.length : 6]),
            curve: pageColour("--quiet"), letters: index === 0 ? ink : null};
}

/* Makes everything that has a colour, at the start and when the theme changes. */
function dressStage(stage, runs) {
    if (stage.triad)
        stage.discarded.push(stage.triad.scene);
    stage.triad = makeTriad(stage.camera);
    fillScene(stage, runs);
}

/* Makes all but the triad. */
function fillScene(stage, runs) {
    if (stage.scene)
        stage.discarded.push(stage.scene);
    stage.scene = new THREE.Scene();
    stage.scene.background = new THREE.Color(pageColour("--stage"));
    makeLights(stage.scene);
    stage.size = 2 * stage.camera.radius;
    stage.marks = marksOf(stage, runs);
    stage.grid = makeGrid(stage.box, stage.size, stage.up);
    stage.scene.add(stage.grid.group);
    stage.bodies = runs.map((run, i) => makeBody(run, run.paths, lookOf(stage, i, runs.length)));
    stage.bodies.forEach((body) => stage.scene.add(body.all));
}

/* Frees the memory of earlier scenes: after the next picture, so that it uses their programs again. */
function emptyDiscarded(stage) {
    for (const scene of stage.discarded.splice(0))
        scene.traverse((object) => {
            if (object.geometry && !object.isSprite) /* all sprites of three.js share one */
                object.geometry.dispose();
            for (const material of object.material ? [object.material].flat() : []) {
                if (material.map)
                    material.map.dispose();
                material.dispose();
            }
        });
}

/* Returns whether software draws instead of a graphics card. */
function isDrawnBySoftware() {
    const gl = document.createElement("canvas").getContext("webgl");
    const facts = gl && gl.getExtension("WEBGL_debug_renderer_info");
    return Boolean(facts) && /swiftshader|llvmpipe|software/i.test(gl.getParameter(facts.UNMASKED_RENDERER_WEBGL));
}

/* Returns null if the browser has no WebGL. */
function makeRenderer(canvas, antialias) {
    try {
        return new THREE.WebGLRenderer({canvas, antialias});
    } catch (error) {
        return null;
    }
}

/* ---- Sharpness: pixels of the picture per pixel of the page, at rest and in motion ---- */

const SLOW = 34, COARSEST = 0.5; /* a picture every 34 ms is 30 a second */

/* The time of software grows with the number of pixels, so it smooths edges by more pixels only at rest. */
function sharpnessOf(isSoftware) {
    const still = Math.max(isSoftware ? 1.5 : 1, Math.min(2, window.devicePixelRatio || 1));
    return {still, moving: isSoftware ? 0.8 : still, now: 0, times: []};
}

function setSharpness(stage, isMoving) {
    const {sharpness} = stage, wanted = isMoving ? sharpness.moving : sharpness.still;
    if (wanted === sharpness.now)
        return;
    sharpness.now = wanted;
    stage.renderer.setPixelRatio(wanted);
}

/* Makes moving pictures coarser if they are too slow; `passed` is the time since the last one [ms]. */
function watchSpeed(stage, passed) {
    const {sharpness} = stage;
    sharpness.times.push(passed);
    if (sharpness.times.length < 12)
        return;
    const middle = sharpness.times.sort((a, b) => a - b)[6];
    sharpness.times = [];
    if (middle > SLOW)
        sharpness.moving = Math.max(COARSEST, 0.8 * sharpness.moving);
}

/* up: the upward axis. */
function makeStage(canvas, runs, palette, up) {
    const isSoftware = isDrawnBySoftware(), renderer = makeRenderer(canvas, !isSoftware), box = joinBoxes(runs.map((run) => run.box));
    if (!renderer)
        return null;
    renderer.autoClear = false;
    const stage = {canvas, renderer, box, camera: makeCamera(box, up), palette, up, sharpness: sharpnessOf(isSoftware), isFollowing: false, discarded: []};
    dressStage(stage, runs);
    return stage;
}

/* Keeps the moving bodies in the picture, or the whole motion, with marks of matching size. */
function setFollowing(stage, runs, isFollowing) {
    stage.isFollowing = isFollowing;
    holdRadius(stage.camera, radiusOf(stage, runs));
    centreCamera(stage.camera, isFollowing ? boxNow(runs[0]) : stage.box);
    fillScene(stage, runs);
}

/* The camera follows the first run. */
function follow(stage, runs) {
    if (stage.isFollowing)
        centreCamera(stage.camera, boxNow(runs[0]));
}

function resizeStage(stage) {
    const width = stage.canvas.clientWidth, height = stage.canvas.clientHeight;
    if (width > 0 && height > 0) {
        stage.renderer.setSize(width, height, false);
        resizeCamera(stage.camera, width, height);
    }
}

function drawTriad(stage) {
    const {lens, scene} = stage.triad, side = 92;
    lens.position.copy(stage.camera.lens.position).sub(stage.camera.target).setLength(5);
    lens.lookAt(0, 0, 0);
    stage.renderer.setViewport(6, 6, side, side);
    stage.renderer.clearDepth();
    stage.renderer.render(scene, lens);
    stage.renderer.setViewport(0, 0, stage.canvas.clientWidth, stage.canvas.clientHeight);
}

function drawStage(stage, isMoving) {
    setSharpness(stage, isMoving);
    stage.renderer.clear();
    stage.renderer.render(stage.scene, stage.camera.lens);
    drawTriad(stage);
    emptyDiscarded(stage);
}
