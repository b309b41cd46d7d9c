/*
 * Time and keys: a clock plays and steps, and is set by the slider, by keys and by the page's fragment
 * (#t=2.5&view=top&theme=dark&forces=1&frames=1&paths=0&solids=0&follow=1&play=1, and for pictures
 * alone=1&azimuth=-50&height=25&nearer=1.4&right=0.1&up=-0.05).
 */
"use strict";

function byId(id) {
    return document.getElementById(id);
}

/* Calls show(clock) whenever the time or what is shown has changed. */
function makeClock(start, end, rowTimes, show) {
    return {time: start, start, end, rowTimes, isPlaying: false, speed: 1, shown: {paths: true, solids: true, forces: false, frames: false, follow: false}, show};
}

function setTime(clock, time) {
    clock.time = Math.min(clock.end, Math.max(clock.start, time));
    clock.show(clock);
}

function showTime(clock) {
    const slider = byId("time");
    slider.value = String((clock.time - clock.start) / (clock.end - clock.start || 1));
    slider.setAttribute("aria-valuetext", `${clock.time.toFixed(3)} seconds`);
    byId("now").textContent = clock.time.toFixed(3);
}

/* Moves by rows of the longest run; a time between two rows moves to the next one in that direction. */
function stepTime(clock, rows) {
    const times = clock.rowTimes, row = findRow(times, clock.time);
    const tolerance = 1e-9 * (clock.end - clock.start);
    const at = times[row.high] <= clock.time + tolerance ? row.high : row.low;
    const isOnRow = Math.abs(times[at] - clock.time) <= tolerance;
    const next = rows > 0 || isOnRow ? at + rows : at + rows + 1;
    setPlaying(clock, false);
    setTime(clock, times[Math.min(times.length - 1, Math.max(0, next))]);
}

function setPlaying(clock, isPlaying) {
    clock.isPlaying = isPlaying;
    clock.last = null;
    const button = byId("play");
    button.textContent = isPlaying ? "Pause" : "Play";
    button.setAttribute("aria-pressed", String(isPlaying));
    if (isPlaying && clock.time >= clock.end)
        setTime(clock, clock.start);
    clock.show(clock);
    if (!isPlaying)
        byId("said").textContent = `${clock.time.toFixed(3)} seconds`;
}

/* Called before each picture with the wall time [ms]; the motion starts again after its end. */
function playOn(clock, now) {
    if (!clock.isPlaying)
        return;
    const passed = clock.last === null ? 0 : 1e-3 * (now - clock.last) * clock.speed;
    clock.last = now;
    setTime(clock, clock.time + passed > clock.end ? clock.start : clock.time + passed);
}

function setShown(clock, name, isShown) {
    clock.shown[name] = isShown;
    byId(name).checked = isShown;
    clock.show(clock);
}

/* ---- Elements ---- */

function connectControls(clock, actions) {
    byId("play").addEventListener("click", () => setPlaying(clock, !clock.isPlaying));
    byId("time").addEventListener("input", (event) => {
        setPlaying(clock, false);
        setTime(clock, clock.start + Number(event.target.value) * (clock.end - clock.start));
    });
    byId("speed").addEventListener("change", (event) => { clock.speed = Number(event.target.value); });
    for (const name of Object.keys(clock.shown))
        byId(name).addEventListener("change", (event) => setShown(clock, name, event.target.checked));
    byId("view").addEventListener("change", (event) => actions.view(event.target.value));
    byId("theme").addEventListener("click", () => actions.theme());
    document.addEventListener("keydown", (event) => pressKey(clock, actions, event));
}

/* ---- Keys ---- */

const TURN = 0.08;

function keyTable(clock, actions) {
    const choose = (view) => () => { byId("view").value = view; actions.view(view); };
    const toggle = (name) => () => setShown(clock, name, !clock.shown[name]);
    return {
        " ": () => setPlaying(clock, !clock.isPlaying),
        ArrowRight: () => stepTime(clock, 1), ArrowLeft: () => stepTime(clock, -1),
        PageDown: () => stepTime(clock, 10), PageUp: () => stepTime(clock, -10),
        Home: () => setTime(clock, clock.start), End: () => setTime(clock, clock.end),
        a: () => actions.turn(-TURN, 0), d: () => actions.turn(TURN, 0),
        w: () => actions.turn(0, TURN), s: () => actions.turn(0, -TURN),
        "+": () => actions.zoom(1 / 1.15), "-": () => actions.zoom(1.15),
        1: choose("free"), 2: choose("front"), 3: choose("side"), 4: choose("top"),
        p: toggle("paths"), o: toggle("solids"), c: toggle("follow"), f: toggle("forces"), k: toggle("frames"), t: () => actions.theme(),
    };
}

/* Buttons, boxes and lists keep their own keys. */
function isOwnKey(event) {
    const kind = event.target.tagName, type = event.target.type;
    if (kind === "SELECT" || event.target.closest("[data-own-keys]"))
        return true;
    return event.key === " " && (kind === "BUTTON" || kind === "SUMMARY" || type === "checkbox");
}

function pressKey(clock, actions, event) {
    const action = keyTable(clock, actions)[event.key];
    if (!action || event.ctrlKey || event.altKey || event.metaKey || isOwnKey(event))
        return;
    event.preventDefault();
    action();
}

/* ---- The fragment ---- */

/* The numbers of these names that the fragment has. */
function numbersAsked(asked, names) {
    return Object.fromEntries(names.map((name) => [name, parseFloat(asked.get(name))]).filter(([, value]) => Number.isFinite(value)));
}

function readFragment(clock, actions) {
    const asked = new URLSearchParams(location.hash.slice(1)), {t} = numbersAsked(asked, ["t"]);
    if (asked.has("alone"))
        actions.alone(asked.get("alone") !== "0");
    if (asked.has("theme"))
        actions.theme(asked.get("theme"));
    if (asked.has("view")) {
        byId("view").value = asked.get("view");
        actions.view(asked.get("view"));
    }
    for (const name of Object.keys(clock.shown))
        if (asked.has(name))
            setShown(clock, name, asked.get(name) !== "0");
    actions.aim(numbersAsked(asked, ["azimuth", "height", "nearer", "right", "up"]));
    if (t !== undefined)
        setTime(clock, t);
    if (asked.get("play") === "1")
        setPlaying(clock, true);
}
