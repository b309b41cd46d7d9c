/*
 * Pulling a point of interest with the pointer: from the present time on, a spring draws it to the place of the pointer,
 * in the plane through the point that faces the camera. The worker computes the motion as time passes; after the release it
 * goes on without the spring, and all of it is the motion of the page.
 */
"use strict";

const REACH = 22; /* of the pointer around a point [px] */
const hand = {point: -1, pointer: 0, depth: 0, place: null, line: null};

/* A place of the scene in the picture: x and y in [-1, 1], and the depth. */
function projected(place) {
    return new THREE.Vector3(...place).project(page.stage.camera.lens);
}

function inPicture(event) {
    const box = byId("stage").getBoundingClientRect();
    return [2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height];
}

/* The nearest point within reach of the pointer; -1: none. */
function pointAt(event) {
    const {width, height} = byId("stage").getBoundingClientRect(), [x, y] = inPicture(event);
    const far = runs[0].points.map((point) => {
        const at = projected(placeNow(runs[0], point));
        return Math.hypot(0.5 * width * (at.x - x), 0.5 * height * (at.y - y));
    });
    const nearest = far.indexOf(Math.min(...far));
    return far[nearest] < REACH ? nearest : -1;
}

function placeHand(event) {
    hand.place = new THREE.Vector3(...inPicture(event), hand.depth).unproject(page.stage.camera.lens).toArray();
}

/* A line from the point to the hand. */
function drawHand() {
    if (hand.line) {
        page.stage.scene.remove(hand.line);
        hand.line.geometry.dispose();
        hand.line = null;
    }
    if (hand.point >= 0) {
        const ends = [placeNow(runs[0], runs[0].points[hand.point]), hand.place].map((place) => new THREE.Vector3(...place));
        hand.line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineBasicMaterial({color: pageColour("--accent")}));
        page.stage.scene.add(hand.line);
    }
    page.isStale = true;
}

function grasp(event) {
    const point = pointAt(event);
    if (point < 0 || event.button !== 0)
        return;
    event.stopPropagation();
    byId("stage").setPointerCapture(event.pointerId);
    setPlaying(clock, false);
    state.baseline = state.charts;
    Object.assign(hand, {point, pointer: event.pointerId, depth: projected(placeNow(runs[0], runs[0].points[point])).z});
    placeHand(event);
    ask({point, from: clock.time < clock.end ? clock.time : clock.start, speed: clock.speed, hand: hand.place});
}

function release(event) {
    if (hand.point < 0 || event.pointerId !== hand.pointer)
        return;
    hand.point = -1;
    state.worker.postMessage({release: state.asked});
    drawHand();
}

/* The motion so far: its end is the present time. The worker sends the next part when this one is shown. */
function showPulled(motion) {
    showMotion(motion);
    setTime(clock, clock.end);
    drawHand();
    state.worker.postMessage({isShown: true});
}

/* Before the camera, which takes what no point takes. */
function connectHand() {
    const picture = byId("picture"), stage = byId("stage");
    picture.addEventListener("pointerdown", grasp, true);
    picture.addEventListener("pointermove", (event) => {
        if (hand.point >= 0 && event.pointerId === hand.pointer) {
            event.stopPropagation();
            placeHand(event);
            state.worker.postMessage({hand: hand.place});
            drawHand();
        } else if (event.buttons === 0)
            stage.style.cursor = pointAt(event) >= 0 ? "pointer" : "";
    }, true);
    picture.addEventListener("pointerup", release, true);
    picture.addEventListener("pointercancel", release, true);
}
