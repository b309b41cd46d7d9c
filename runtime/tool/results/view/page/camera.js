/*
 * The camera turns about a target by mouse, finger or key. From a canvas and the box of the scene it makes a
 * camera of three.js that keeps the box in its picture.
 */
"use strict";

const VIEWS = {
    free: [-0.9, 0.42], front: [-Math.PI / 2, 0], side: [0, 0], top: [-Math.PI / 2, Math.PI / 2 - 1e-4],
};

/* Two horizontal axes and the upward one, a right-handed system, by the axis opposite to gravity. */
const AXES = [[[0, 1, 0], [0, 0, 1], [1, 0, 0]], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]];

function middleOf(box) {
    return new THREE.Vector3(...box.low).add(new THREE.Vector3(...box.high)).multiplyScalar(0.5);
}

function makeCamera(box, up) {
    const target = middleOf(box);
    const radius = 0.5 * Math.hypot(...box.high.map((high, i) => high - box.low[i])) || 0.5;
    const lens = new THREE.PerspectiveCamera(30, 1, radius / 100, radius * 200);
    const axes = AXES[up].map((axis) => new THREE.Vector3(...axis));
    lens.up.copy(axes[2]);
    const camera = {lens, axes, home: target.clone(), target, radius, azimuth: 0, height: 0, distance: 1, aspect: 1};
    setView(camera, "free");
    return camera;
}

/* Sets the radius of the scene, all of which is in the picture. */
function holdRadius(camera, radius) {
    camera.radius = radius;
    camera.distance = null;
    camera.lens.near = radius / 100;
    camera.lens.updateProjectionMatrix();
}

/* Follows the middle of a box. */
function centreCamera(camera, box) {
    const middle = middleOf(box);
    camera.target.add(middle.clone().sub(camera.home));
    camera.home.copy(middle);
    placeCamera(camera);
}

/* Looks at the whole scene from one of VIEWS. */
function setView(camera, name) {
    [camera.azimuth, camera.height] = VIEWS[name] || VIEWS.free;
    camera.target.copy(camera.home);
    camera.distance = null;
    placeCamera(camera);
}

/* A sphere of the scene's radius fits into the narrower angle of the picture. */
function fittingDistance(camera) {
    const half = THREE.Math.degToRad(camera.lens.fov / 2);
    const narrow = Math.min(half, Math.atan(Math.tan(half) * camera.aspect));
    return 1.08 * camera.radius / Math.sin(narrow);
}

function placeCamera(camera) {
    const distance = camera.distance === null ? fittingDistance(camera) : camera.distance;
    const flat = Math.cos(camera.height) * distance;
    const parts = [flat * Math.cos(camera.azimuth), flat * Math.sin(camera.azimuth), Math.sin(camera.height) * distance];
    camera.lens.position.copy(camera.target);
    parts.forEach((part, i) => camera.lens.position.addScaledVector(camera.axes[i], part));
    camera.lens.lookAt(camera.target);
    camera.lens.updateMatrixWorld();
}

function resizeCamera(camera, width, height) {
    camera.aspect = width / height;
    camera.lens.aspect = camera.aspect;
    camera.lens.updateProjectionMatrix();
    placeCamera(camera);
}

function turnCamera(camera, byAzimuth, byHeight) {
    const most = Math.PI / 2 - 1e-4;
    camera.azimuth += byAzimuth;
    camera.height = Math.min(most, Math.max(-most, camera.height + byHeight));
    placeCamera(camera);
}

function zoomCamera(camera, factor) {
    const distance = camera.distance === null ? fittingDistance(camera) : camera.distance;
    camera.distance = Math.min(50 * camera.radius, Math.max(0.05 * camera.radius, distance * factor));
    placeCamera(camera);
}

/* Angles in degrees; zoom factor relative to the whole scene; shifts as parts of the picture's height. */
function aimCamera(camera, {azimuth, height, nearer, right, up}) {
    const most = Math.PI / 2 - 1e-4;
    if (azimuth !== undefined)
        camera.azimuth = THREE.Math.degToRad(azimuth);
    if (height !== undefined)
        camera.height = Math.min(most, Math.max(-most, THREE.Math.degToRad(height)));
    if (nearer > 0)
        camera.distance = fittingDistance(camera) / nearer;
    placeCamera(camera);
    if (right !== undefined || up !== undefined)
        shiftCamera(camera, right || 0, up || 0);
}

/* By parts of the picture's height. */
function shiftCamera(camera, right, up) {
    const size = 2 * Math.tan(THREE.Math.degToRad(camera.lens.fov / 2)) * camera.lens.position.distanceTo(camera.target);
    const axes = camera.lens.matrixWorld.elements;
    for (let i = 0; i < 3; i++)
        camera.target.setComponent(i, camera.target.getComponent(i) - size * (right * axes[i] + up * axes[4 + i]));
    placeCamera(camera);
}

/* Left button turns, right button or shift moves, wheel zooms; two fingers zoom. `changed` is called after each. */
function steerByPointer(canvas, camera, changed) {
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, event);
    });
    const release = (event) => pointers.delete(event.pointerId);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointermove", (event) => {
        const before = pointers.get(event.pointerId);
        if (!before)
            return;
        const gap = pointerGap(pointers);
        pointers.set(event.pointerId, event);
        if (pointers.size === 2)
            zoomCamera(camera, gap / pointerGap(pointers));
        else
            dragCamera(canvas, camera, event, before);
        changed();
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoomCamera(camera, Math.exp(0.001 * event.deltaY));
        changed();
    }, {passive: false});
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
}

function pointerGap(pointers) {
    const [a, b] = [...pointers.values()];
    return b ? Math.max(1, Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY)) : 1;
}

function dragCamera(canvas, camera, event, before) {
    const x = (event.clientX - before.clientX) / canvas.clientHeight;
    const y = (event.clientY - before.clientY) / canvas.clientHeight;
    if (event.buttons & 2 || event.shiftKey)
        shiftCamera(camera, x, -y);
    else
        turnCamera(camera, -Math.PI * x, Math.PI * y);
}
