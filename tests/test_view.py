"""`refdyn view`: what the page computes and shows, compared with the numbers of the motion; what is refused."""
import re
import zlib
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest

import browser
from program import MODELS, TESTS, all_models, read_run, refdyn

MANIPULATOR = MODELS / "manipulator.lua"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Motions of a flexible arm as CSV, of a crane, of a linkage with a closed loop, of an arm under loads."""
    folder = tmp_path_factory.mktemp("runs")
    refdyn("sim", MANIPULATOR, "--set", "n_rfe=3", "--set", "m_E=2.5", "--until", "1", "-o", folder / "arm.csv")
    refdyn("sim", MODELS / "crane.lua", "--until", "1", "-o", folder / "crane.h5")
    refdyn("sim", TESTS / "models" / "loads.lua", "--until", "1", "-o", folder / "loads.h5")
    refdyn("sim", MODELS / "fourbar.lua", "--set", "torque=0.2", "--until", "1", "-o", folder / "bars.h5")
    return folder


def write_page(runs, name):
    """A CSV does not contain the position of its ellipse."""
    centre = points_of(runs / "arm.csv")["E"][0, 0] - 0.875
    view(runs / "arm.csv", runs / "crane.h5", runs / "bars.h5", runs / "loads.h5", "--model", MANIPULATOR, "--set", "n_rfe=3",
         "--set", f"xc={float(centre)!r}", "-o", runs / name)
    return runs / name


@pytest.fixture(scope="module")
def page(runs):
    return write_page(runs, "page.html")


def view(*arguments, **more):
    return refdyn("view", *arguments, **more)


def points_of(path):
    """(rows x 3) by name."""
    if path.suffix == ".h5":
        with h5py.File(path) as file:
            return {name: group["r"][()] for name, group in file["points"].items()}
    columns = read_run(path)
    return {"E": np.stack([columns[f"E_{axis}"] for axis in "xyz"], axis=1)}


ASKED = """
const key = (name, at) => (at || document.body).dispatchEvent(new KeyboardEvent("keydown", {key: name, bubbles: true}));
const said = {places: runs.map((run) => Object.fromEntries(run.points.map((point, i) => [point.name, run.paths[i]])))};
said.applied = runs.map((run) => run.applied.map((one) => [one.kind, one.name, ...one.parts.map((part) => [...part])]));
said.curves = runs.map((run) => run.curves);
said.start = clock.time;
key("ArrowRight"); key("ArrowRight"); key("ArrowLeft"); said.row = clock.time;
key("PageDown"); said.rows = clock.time;
key("End"); said.end = clock.time; said.slider = byId("time").getAttribute("aria-valuetext");
key(" "); said.plays = [clock.isPlaying, byId("play").textContent, byId("play").getAttribute("aria-pressed"), clock.time];
key(" "); said.stops = [clock.isPlaying, byId("play").textContent];
key(" ", byId("play")); said.button = clock.isPlaying;
key("f"); said.forces = [clock.shown.forces, byId("forces").checked]; key("f");
const before = page.stage.camera.azimuth; key("d"); said.turned = page.stage.camera.azimuth - before;
const far = page.stage.camera.lens.position.length(); key("+"); said.nearer = page.stage.camera.lens.position.length() < far;
key("4"); said.view = byId("view").value;
key("t"); said.theme = document.documentElement.dataset.theme; key("t");
setTime(clock, 0.35); said.text = byId("places").textContent;
const corner = new THREE.Vector3(), edge = [Infinity, -Infinity];
setView(page.stage.camera, "free"); page.stage.camera.lens.updateMatrixWorld();
for (const place of runs.flatMap((run) => run.paths.flat()))
    for (const x of corner.set(...place).project(page.stage.camera.lens).toArray().slice(0, 2)) {
        edge[0] = Math.min(edge[0], x);
        edge[1] = Math.max(edge[1], x);
    }
said.edge = edge;
const all = (which) => [...document.querySelectorAll(which)];
said.focus = all("button, input, select, canvas[tabindex], aside, summary").map((element) => element.id || element.tagName);
const isNamed = (element) => element.getAttribute("aria-label") || element.textContent.trim() || (element.labels && element.labels.length);
said.unnamed = all("button, input, select, canvas").filter((element) => !isNamed(element)).length;
said.charts = page.charts.map((chart) => chart.title);
said.loaded = performance.getEntriesByType("resource").length;
drawStage(page.stage, false);
const gl = page.stage.renderer.getContext(), pixels = new Uint8Array(4 * page.stage.canvas.width * page.stage.canvas.height);
gl.readPixels(0, 0, page.stage.canvas.width, page.stage.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
const colours = new Set();
for (let i = 0; i < pixels.length; i += 4) colours.add(65536 * pixels[i] + 256 * pixels[i + 1] + pixels[i + 2]);
said.colours = colours.size;
return said;
"""


@pytest.fixture(scope="module")
def said(page):
    answer, console = browser.ask(page, ASKED, "#t=0.5")
    assert not [line for line in console if "rror" in line or "efused" in line], console
    return answer


def test_points_are_where_the_motion_has_them(runs, said):
    for name, places in zip(("arm.csv", "crane.h5", "bars.h5", "loads.h5"), said["places"]):
        expected = points_of(runs / name)
        assert places.keys() == expected.keys()
        size = max(np.abs(path).max() for path in expected.values())
        for point, path in expected.items():
            assert path.std(axis=0).max() > 1e-3 * size, f"{name} {point} stands still"
            assert np.abs(np.array(places[point]) - path).max() < 1e-4 * size, f"{name} {point}"


def test_applied_forces_are_those_of_the_formulas(runs, said):
    arm, crane, bars, loads = said["applied"]
    torque = read_run(runs / "arm.csv")["torque"]
    assert [one[:2] for one in arm] == [["drive", "column_psi"]] and np.abs(arm[0][2] - torque).max() < 1e-4 * np.abs(torque).max()
    assert [one[:2] for one in bars] == [["drive", "crank_psi"]] and np.ptp(bars[0][2]) == 0 and bars[0][2][0] == pytest.approx(0.2)
    away = points_of(runs / "loads.h5")["E"] - [4, 0, 0]
    pushed = 7 * away / np.linalg.norm(away, axis=1)[:, None]
    forces = [np.array(one[2:]).T for one in loads if one[0] == "force"]
    assert min(np.abs(force - pushed).max() for force in forces) < 2e-3 and "torque" in [one[0] for one in loads]


def test_the_ellipse_of_the_programme(runs, said):
    (curve,), *others = said["curves"]
    assert curve["closed"] and curve["axes"] == [0, 1] and others == [[], [], []]
    x, y = np.array(curve["path"]).reshape(-1, 2).T
    x -= points_of(runs / "arm.csv")["E"][0, 0] - 0.875
    assert np.abs((x / 0.875) ** 2 + (y / 1.75) ** 2 - 1).max() < 1e-5
    assert min(x.max(), -x.min()) > 0.87 and min(y.max(), -y.min()) > 1.74 and len(x) < 700


def test_keys(said):
    assert said["start"] == 0.5 and said["row"] == pytest.approx(0.505) and said["rows"] == pytest.approx(0.555) and said["end"] == 1
    assert said["plays"] == [True, "Pause", "true", 0] and said["stops"] == [False, "Play"]
    assert said["button"] is False, "a button takes its own key"
    assert said["forces"] == [True, True] and said["turned"] > 0 and said["nearer"] and said["view"] == "top" and said["theme"] == "dark"


AIMED = """
const {camera} = page.stage, place = camera.lens.position.clone().sub(camera.target), up = camera.axes[2];
const said = {azimuth: camera.azimuth, height: Math.asin(place.dot(up) / place.length()), nearer: fittingDistance(camera) / place.length()};
said.home = camera.home.clone().project(camera.lens).toArray().slice(0, 2);
said.home[0] *= camera.aspect;
const hidden = () => [...document.querySelectorAll("header, aside, footer, #places, #cell")].map((element) => getComputedStyle(element).display === "none");
said.alone = hidden();
said.wide = byId("stage").clientWidth === document.body.clientWidth;
location.hash = "#alone=0";
readFragment(clock, actions);
said.back = hidden();
return said;
"""


def test_the_camera_of_a_fragment(page):
    """A shift by a tenth of the picture's height is 0.2, where the picture reaches from -1 to 1 in height."""
    said, _ = browser.ask(page, AIMED, "#alone=1&azimuth=-30&height=50&nearer=2&right=0.1&up=-0.2")
    assert said["azimuth"] == pytest.approx(-np.pi / 6) and said["height"] == pytest.approx(np.deg2rad(50)) and said["nearer"] == pytest.approx(2)
    assert said["home"] == pytest.approx([0.2, -0.4]) and said["wide"] is True
    assert said["alone"] == 5 * [True] and said["back"] == 5 * [False]


def test_a_free_link_shows_no_joints(tmp_path):
    model = tmp_path / "free.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "free", links = {\n'
                     '{ "body", joint = "free", start_rate = { x = 1 }, bodies = { rd.box { { 1, 1, 1 }, mass = 1 } } },\n'
                     '{ "ram", on = "body", joint = "z, psi", start_rate = { z = 1 }, bodies = { rd.box { { 0.1, 0.1, 1 }, mass = 1 } } } } }\n')
    refdyn("sim", model, "--until", "0.1", "-o", tmp_path / "free.h5")
    view(tmp_path / "free.h5", "-o", tmp_path / "free.html")
    said, _ = browser.ask(tmp_path / "free.html", "return runs.map((run) => run.frames.map((frame, i) => showsJoint(run.frames, i)));")
    assert said == [6 * [False] + 2 * [True]]


FLYING = """local rd = require "refdyn"
return rd.model { name = "flying", links = {
  { "hand", joint = "free", start_rate = { x = 23, psi = 1.7 }, bodies = { rd.box { { 0.11, 0.07, 0.23 }, mass = 1.9 } } },
  { "finger", on = "hand", at = { 0.31, 0, 0 }, joint = "psi", start_rate = { psi = -2.3 }, mass = 1.219, inertia = { xx = 0.1112, yy = 0.1112, zz = 0.2194 } },
  { "cap", on = "hand", at = { -0.3, 0, 0 }, joint = "theta", start_rate = { theta = 1.1 }, mass = 1.219, inertia = { xx = 0.1112, yy = 0.1112, zz = 0.2194 } },
  { "rod", on = "finger", at = { 0, 0, 0.093 }, beam = { length = 0.2, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
}, points = { E = "rod.tip" } }
"""

SEEN = """
const {stage} = page, said = {shapes: runs[0].shapes.map(([kind, frame, link, isSolid, bore, ...map]) => ({isSolid, link, map}))};
const gl = stage.renderer.getContext(), size = () => 4 * stage.canvas.width * stage.canvas.height;
const picture = () => {
    drawStage(stage, false);
    const pixels = new Uint8Array(size());
    gl.readPixels(0, 0, stage.canvas.width, stage.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
};
const differences = (a, b) => a.reduce((count, value, i) => count + (i % 4 === 0 && (value !== b[i] || a[i + 1] !== b[i + 1] || a[i + 2] !== b[i + 2])), 0);
const key = (name) => document.body.dispatchEvent(new KeyboardEvent("keydown", {key: name, bubbles: true}));
const radiusOfPins = () => Math.max(...[...stage.bodies[0].parts.values()].flatMap((part) => part.isSolid ? [] : part.places.map((place) => new THREE.Vector3().setFromMatrixScale(place.matrix).y)));
setShown(clock, "paths", false);
said.whole = stage.camera.radius;
said.pins = radiusOfPins();
key("c"); said.follow = [clock.shown.follow, byId("follow").checked, stage.camera.radius];
said.middles = [0.1, 0.6, 0.93].map((time) => {
    setTime(clock, time);
    const box = boxNow(runs[0]), corners = [box.low, box.high].map((corner) => new THREE.Vector3(...corner).project(stage.camera.lens));
    return corners.flatMap((corner) => [corner.x, corner.y]);
});
const both = picture();
stage.bodies[1].all.visible = false; const first = picture(); stage.bodies[1].all.visible = true;
stage.bodies[0].all.visible = false; const second = picture(); stage.bodies[0].all.visible = true;
said.drawn = [differences(both, first), differences(both, second)];
key("o"); said.solids = [clock.shown.solids, byId("solids").checked];
said.hidden = stage.bodies.map((body) => [...body.parts.values()].map((part) => [part.isSolid, part.mesh.visible]));
key("o"); said.again = [...stage.bodies[0].parts.values()].every((part) => part.mesh.visible);
key("c"); said.back = [stage.isFollowing, stage.camera.radius];
return said;
"""


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A hand that flies 23 m, twice; its finger has the inertia of a disc of 1.2 m, as in a common file of the UR5."""
    folder = tmp_path_factory.mktemp("flight")
    (folder / "flying.lua").write_text(FLYING)
    refdyn("sim", folder / "flying.lua", "--until", "1", "-o", folder / "a.h5")
    (folder / "b.h5").write_bytes((folder / "a.h5").read_bytes())
    view(folder / "a.h5", folder / "b.h5", "-o", folder / "flying.html")
    answer, _ = browser.ask(folder / "flying.html", SEEN)
    return answer


def test_solids_of_air_are_bounded(flight):
    """A disc of 1.2 m with 1.2 kg hides the robot: it shrinks to the length of its link, here to the first joint of the rod, or to the size
    of water of its mass; a possible solid stays."""
    maps = [np.array(shape["map"]) for shape in flight["shapes"]]
    assert [shape["isSolid"] for shape in flight["shapes"]] == [1, 1, 1, 0, 0]
    hand, finger, cap = (np.linalg.norm(numbers[:9].reshape(3, 3), axis=0) for numbers in maps[:3])
    assert sorted(hand) == pytest.approx([0.07, 0.11, 0.23], rel=1e-5)
    assert finger[1] == finger[2] == pytest.approx(2 * np.hypot(0.093, 0.1), rel=1e-5)
    assert cap[1] == cap[2] and np.pi / 4 * cap[0] * cap[1]**2 * 1000 == pytest.approx(1.219, rel=1e-5)
    for numbers in maps[1:3]:
        assert numbers[9:] + numbers[[0, 3, 6]] / 2 == pytest.approx([0, 0, 0], abs=1e-7), "about its centre"


def test_solids_can_be_left_out(flight):
    assert flight["solids"] == [False, False] and flight["again"] is True
    for parts in flight["hidden"]:
        assert {tuple(part) for part in parts} == {(True, False), (False, True)}


def test_of_equal_runs_the_first_one_is_seen(flight):
    without_second, without_first = flight["drawn"]
    assert without_second == 0 and without_first > 1000


def test_marks_of_long_motions(flight):
    """Pins remain smaller than the bodies, and the camera follows."""
    assert flight["whole"] > 11 and 0.03 < flight["pins"] < 0.1
    shown, checked, radius = flight["follow"]
    assert shown and checked and 0.2 < radius < 0.7 and flight["back"] == [False, flight["whole"]]
    for middle in np.array(flight["middles"]).reshape(-1, 2, 2):
        assert np.abs(middle).max() < 1 and np.abs(middle.mean(axis=0)).max() < 0.1 and np.abs(middle).max() > 0.1


def test_it_can_be_read_and_reached(runs, said):
    assert said["slider"] == "1.000 seconds" and said["unnamed"] == 0
    assert said["focus"] == ["theme", "stage", "charts", "play", "time", "speed", "view", "paths", "solids", "forces", "frames", "follow", "SUMMARY"]
    where = points_of(runs / "arm.csv")["E"][70]
    assert said["text"].splitlines()[0] == "E (1): " + ", ".join(f"{x:.4f}" for x in where).replace("-", "\u2212") + " m"


def test_the_picture_shows_it_all(said):
    assert -1 < said["edge"][0] and said["edge"][1] < 1 and said["colours"] > 100
    assert {"Path, y over x [m]", "Slides [m]", "Turns [rad]", "Programme forces [N, N m]", "Energy [J]", "Position residuals"} <= set(said["charts"])


def test_nothing_comes_from_a_network(page, said):
    text = page.read_text()
    assert "Content-Security-Policy\" content=\"default-src 'none';" in text and said["loaded"] == 0
    assert not re.search(r"<[^>]*\b(src|href)\s*=|@import|url\(", text[:text.index("three.js\n")]) and "<link" not in text
    assert "Permission is hereby granted, free of charge" in text and "Copyright (c) 2010-2019 three.js authors" in text


def test_limits_are_marked(tmp_path):
    """A dashed line at each bound within the chart, and a band where the motion is beyond it; no mark on what has no bound."""
    (tmp_path / "swing.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "swing", gravity = { 0, -9.81, 0 }, links = {'
                                        '{ "a", joint = "psi", mass = 1, center = { 0.7, 0, 0 }, inertia = { zz = 0.1 }, limits = { psi = { from = -2.1, to = 9 } } },'
                                        '{ "b", joint = "x", mass = 1, start_rate = { x = 0.3 } } } }')
    refdyn("sim", tmp_path / "swing.lua", "--until", 3, "-o", tmp_path / "swing.h5")
    view(tmp_path / "swing.h5", "-o", tmp_path / "swing.html")
    script = """return page.charts.map((chart) => {
        const pixels = chart.pen.getImageData(0, 0, chart.canvas.width, chart.canvas.height).data;
        const ratio = chart.canvas.height / CHART_HEIGHT, y = pixelY(chart, -2.1) * ratio;
        let above = 0, below = 0;
        for (let i = 0; i < pixels.length; i += 4)
            if (pixels[i] > pixels[i + 1] + 60 && pixels[i] > pixels[i + 2] + 60)
                Math.floor(i / 4 / chart.canvas.width) < y - 3 ? above++ : below++;
        return [chart.title, chart.curves.map((curve) => curve.bounds), above, below];
    });"""
    said, console = browser.ask(tmp_path / "swing.html", script)
    charts = {title: rest for title, *rest in said}
    assert not [line for line in console if "rror" in line]
    assert charts["Turns [rad]"][0] == [[{"column": "a_psi", "from": -2.1, "to": 9}]] and charts["Slides [m]"] == [[[]], 0, 0]
    assert charts["Turns [rad]"][1] == 0 and charts["Turns [rad]"][2] > 200


def test_limits_are_marked_in_live_pages(tmp_path):
    """The same for motions that the page computes, with limits of a coordinate and of an expression. A slider moves the motion beyond a limit."""
    (tmp_path / "swing.lua").write_text('local rd = require "refdyn"\nlocal p = rd.parameters { { "g", 1, "m/s^2" } }\n'
                                        'return rd.model { name = "swing", gravity = { 0, -p.g, 0 }, links = {'
                                        '{ "a", joint = "psi", mass = 1, center = { 0.7, 0, 0 }, inertia = { zz = 0.1 }, limits = { psi = { from = -2.1, to = 9 } } } },'
                                        'limits = function(s) return { { "push", s.qd.a_psi ^ 2, to = 5 } } end }')
    refdyn("view", "--live", tmp_path / "swing.lua", "--until", 1, "-o", tmp_path / "swing.html")
    script = """return page.charts.map((chart) => {
        const pixels = chart.pen.getImageData(0, 0, chart.canvas.width, chart.canvas.height).data;
        let red = 0;
        for (let i = 0; i < pixels.length; i += 4)
            red += pixels[i] > pixels[i + 1] + 60 && pixels[i] > pixels[i + 2] + 60;
        return [chart.title, chart.curves.map((curve) => [curve.name, curve.bounds]), red];
    });"""
    with browser.Session(tmp_path / "swing.html") as page:
        page.wait("document.documentElement.dataset.state === 'shown'")
        before = {title: rest for title, *rest in page.ask(script)}
        page.ask("const one = values.p.find((one) => one.name === 'g'); one.field.value = '30'; one.field.dispatchEvent(new Event('change'));")
        page.wait("state.answered === state.asked && document.documentElement.dataset.state !== 'computing'")
        after = {title: rest for title, *rest in page.ask(script)}
    assert before["Turns [rad]"][0] == [["a_psi", [{"column": "a_psi", "from": -2.1, "to": 9}]]]
    assert ["push", [{"column": "push", "from": None, "to": 5}]] in [curve for rest in before.values() for curve in rest[0]]
    assert before["Turns [rad]"][1] == 0 < 200 < after["Turns [rad]"][1]


def test_equal_calls_give_equal_bytes(runs, page):
    assert write_page(runs, "again.html").read_bytes() == page.read_bytes()


def write_run(path, names, rows, step):
    """A CSV without repeated numbers."""
    t = np.arange(rows) * step
    phases = np.array([zlib.crc32(name.encode()) % 1000 for name in names])
    q = 0.05 * np.sin(np.outer(t, 1 + 0.01 * phases) + phases)
    rates = np.gradient(q, step, axis=0)
    force = 100 * np.cos(np.outer(t, 2 + 0.01 * phases))
    header = ",".join(["t", *names, *(f"{name}_d" for name in names), "energy", *(f"force_{name}" for name in names)])
    np.savetxt(path, np.column_stack([t, q, rates, q[:, 0], force]), delimiter=",", header=header, comments="", fmt="%.9g")


@pytest.mark.quick
def test_pages_are_small(tmp_path):
    """With 193 coordinates over ten seconds, a thousand rows, and as many forces."""
    names = ["column_psi", *(f"rod_{turn}_{i}" for i in range(1, 65) for turn in ("psi", "theta", "phi"))]
    model = tmp_path / "rod.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "rod", gravity = { 0, 0, -9.81 }, links = {\n'
                     '{ "column", joint = "psi", mass = 1, inertia = { zz = 1 } },\n'
                     '{ "rod", on = "column", beam = { length = 2, section = rd.tube(0.02, 0.015), E = 2e11, nu = 0.3, rho = 7800, rfe = 65 } } },\n'
                     'points = { E = "rod.tip" } }\n')
    write_run(tmp_path / "rod.csv", names, 1001, 1e-2)
    view(tmp_path / "rod.csv", "--model", model, "-o", tmp_path / "rod.html")
    assert 700_000 < (tmp_path / "rod.html").stat().st_size < 1_000_000


def test_names_of_files_stay_texts(runs, tmp_path):
    name = 'a<b></script><script>alert(1)<!--"&.h5'.replace("/", "\u2215")
    (tmp_path / name).write_bytes((runs / "bars.h5").read_bytes())
    view(tmp_path / name, "-o", tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert text.count("<script") == text.count("</script>") and "<b>" not in text and "a\\u003cb>" in text and "<title>a&lt;b&gt;" in text


# ---- The drawing of a model

def drawing(model, folder, *more):
    refdyn("check", model, "--draw", folder / "model.svg", *more)
    return ElementTree.parse(folder / "model.svg").getroot()


@pytest.mark.quick
def test_a_model_is_drawn(tmp_path):
    svg = drawing(MODELS / "fivebar.lua", tmp_path)
    texts = [text.text for text in svg.iter("{http://www.w3.org/2000/svg}text")]
    assert texts[0] == "fivebar: 4 coordinates, 4 rows"
    assert texts[1:7] == ["left", "turns psi", "0.2405 kg", "left_lower", "turns psi", "0.3435 kg"]
    assert {"the ground", "tool", "welded on", "right_lower", "loop 1", "2 rows of position", "drive left_psi"} <= set(texts)
    ties = [path for path in svg.iter("{http://www.w3.org/2000/svg}path") if "C" in path.get("d")]
    branches = [path for path in svg.iter("{http://www.w3.org/2000/svg}path") if "V" in path.get("d")]
    assert len(ties) == 4 and len(branches) == 5


@pytest.mark.quick
def test_a_row_leads_to_the_link_that_is_named(tmp_path):
    """Not to the link to which it is welded; the message names an axis that is not the link's own, and uses singular and plural correctly."""
    model = tmp_path / "arm.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "arm", gravity = { 0, 0, -9.81 }, links = {\n'
                     '{ "lower", joint = "psi", axis = { 2, 2, 1 }, mass = 3, center = { 0.3, 0, 0 }, inertia = { xx = 0.1, yy = 0.2, zz = 0.2 } },\n'
                     '{ "gripper", on = "lower", at = { 0.7, 0, 0 }, mass = 0.4 },\n'
                     '{ "rod", on = "gripper", beam = { length = 0.8, section = rd.round(0.02), E = 2e11, nu = 0.3, rho = 7800, rfe = 1 } },\n'
                     '}, points = { tip = "gripper" }, constraints = function(s) return { rd.position { s.points.tip.z } } end }\n')
    svg = drawing(model, tmp_path)
    name = "{http://www.w3.org/2000/svg}"
    texts = [text.text for text in svg.iter(name + "text")]
    assert texts[0] == "arm: 1 coordinate, 1 row" and "about (2, 2, 1)" in texts
    assert "1.96 kg" in texts, "mass of the beam"
    boxes = [(float(box.get("y")), float(box.get("height"))) for box in svg.iter(name + "rect") if box.get("x")]
    (tie,) = [path.get("d") for path in svg.iter(name + "path") if "C" in path.get("d")]
    height = float(tie.split("C")[0].split()[1])
    assert [height == y + h / 2 for y, h in boxes[:4]] == [False, True, False, False], "lower, gripper, rod, the ground"
    done = refdyn("check", model)
    assert done.stdout.splitlines()[0] == "arm: 3 links, 1 coordinate, 1 constraint row"
    assert "  rod on gripper, 1.96035 kg, beam of 0.8 m in 1 rigid finite elements" in done.stdout


def test_every_model_is_drawn_without_overlap(tmp_path):
    for model in all_models() + [TESTS / "models" / "loads.lua"]:
        svg = drawing(model, tmp_path)
        boxes = [tuple(float(box.get(name)) for name in ("x", "y", "width", "height"))
                 for box in svg.iter("{http://www.w3.org/2000/svg}rect") if box.get("x")]
        width, height = float(svg.get("width")), float(svg.get("height"))
        for i, (x, y, w, h) in enumerate(boxes):
            assert 0 <= x and x + w <= width and 0 <= y and y + h <= height, model
            assert not any(x < b[0] + b[2] and b[0] < x + w and y < b[1] + b[3] and b[1] < y + h for b in boxes[:i]), model


def test_drawings_that_are_refused(tmp_path):
    fivebar = MODELS / "fivebar.lua"
    done = refdyn("check", fivebar, "--draw", tmp_path / "a.gif", status=2)
    assert done.stderr.splitlines()[0] == f"refdyn check: --draw: '{tmp_path}/a.gif' must end in .svg, .png or .pdf" and not done.stdout
    copy = tmp_path / "model.svg"
    copy.write_bytes(fivebar.read_bytes())
    done = refdyn("check", copy, "--draw", copy, status=1)
    assert "model.svg" in done.stderr and copy.read_bytes() == fivebar.read_bytes()
    done = refdyn("check", fivebar, "--draw", "/none/a.svg", status=1)
    assert done.stderr.endswith("No such file or directory\n") and not done.stdout


# ---- What is refused

def refused(status, *arguments, **more):
    return view(*arguments, status=status, **more).stderr


def test_usage(runs):
    arm, bars, out = runs / "arm.csv", runs / "bars.h5", runs / "none.html"
    usage = "usage: refdyn view RUN... -o PAGE.html [OPTIONS]; refdyn view --help lists them\n"
    assert refused(2, arm, "-o", out) == f"refdyn view: {arm}: a CSV does not contain its model; add --model\n{usage}"
    model = "  --model MODEL.lua         model of the runs that are CSV files; HDF5 files contain theirs\n"
    assert refused(2, bars, "--model", MANIPULATOR, "-o", out) == f"refdyn view: --model: all runs are HDF5 files, which contain their models; omit it\n{model}{usage}"
    said = refused(2, bars, "--set", "n_rfe=1", "-o", out)
    assert said.startswith("refdyn view: --set: all runs are HDF5 files, which contain their models; omit it\n  --set NAME=VALUE ") and said.endswith(usage)
    assert refused(2, bars) == f"refdyn view: -o is missing\n{usage}"
    assert not out.exists()


def test_a_model_of_another_motion(runs):
    arm, out = runs / "arm.csv", runs / "none.html"
    assert refused(1, arm, "--model", MANIPULATOR, "-o", out) == (
        f"{arm}:1: run: has 10 coordinates, but model manipulator has 13; give --model and --set of the motion\n")
    chain = TESTS / "models" / "hanging_chain.lua"
    done = refused(1, arm, "--model", chain, "--set", "links=10", "-o", out)
    assert done == f"{arm}:1: run: coordinate 1 is 'base_z', but in model hanging_chain it is 'rod1_theta'; give --model and --set of the motion\n"
    assert not out.exists()


def test_files_at_fault(runs, tmp_path):
    out = tmp_path / "page.html"
    spoiled = tmp_path / "spoiled.h5"
    spoiled.write_bytes((runs / "bars.h5").read_bytes())
    with h5py.File(spoiled, "r+") as file:
        del file["model_files"]
    assert refused(1, spoiled, "-o", out) == f"{spoiled}: the file does not contain its model\n"
    with h5py.File(spoiled, "r+") as file:
        file.attrs["content"] = "refdyn runs"
    assert refused(1, spoiled, "-o", out) == f"{spoiled}: is no motion as refdyn sim writes it\n"
    assert refused(1, runs / "bars.h5", "-o", out, env={"REFDYN_THREE": "/none/three.js"}) == (
        "refdyn: /none/three.js: No such file or directory; install three.js (Debian: apt install libjs-three), or name its file in "
        "REFDYN_THREE\n")
    assert not out.exists() and not list(tmp_path.glob("*.part"))
