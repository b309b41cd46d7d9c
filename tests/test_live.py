"""`refdyn view --live`: numbers of the page against `sim`, sliders, address and export, failures, texts of users, and what is refused."""
import base64
import hashlib
import json
import os
import re
import shlex
import shutil
import statistics
import time

import numpy as np
import pytest

import browser
import firefox
from program import LONG, MODELS, refdyn
from python_package import package  # noqa: F401 (a fixture)

# The compiler of the reference figures; without it there is nothing to test but the message.
pytestmark = pytest.mark.skipif(not os.path.exists("/usr/include/wasm32-wasi/stdio.h"), reason="wasi-libc is not installed")

# A parameter of each that changes its motion, with a factor.
SLID = {"manipulator": "L", "crane": "L", "scara": "m_tool", "fourbar": "b", "stewart": "heave"}
# Two seconds with fixed steps that resolve the fastest oscillation of each.
SCENES = {"manipulator": ["--step", "5e-5"], "crane": ["--step", "2e-4"], "scara": ["--step", "1e-3"]}
SHOWN = browser.SHOWN
FAILED = "document.documentElement.dataset.state === 'failed'"


def live(*arguments, **more):
    return refdyn("view", "--live", *arguments, **more)


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    for name, step in SCENES.items():
        live(MODELS / f"{name}.lua", *step, "-o", folder / f"{name}.html")
    live(MODELS / "manipulator.lua", "-o", folder / "adaptive.html")
    return folder


@pytest.fixture
def manipulator(pages):
    with browser.Session(pages / "adaptive.html") as page:
        page.wait(SHOWN)
        yield page


def set_value(page, name, value):
    """By the field next to the slider."""
    page.ask(f"const one = [...values.p, ...values.x, ...values.q].find((one) => one.name === '{name}'); one.field.value = '{value}';"
             "one.field.dispatchEvent(new Event('change')); showCommand();")
    page.wait("state.answered === state.asked && document.documentElement.dataset.state !== 'computing'")


def rows_of(page):
    """Names of the columns, and the rows."""
    names = page.ask("return state.motion.columns.map((column) => column.name)")
    return names, np.array(page.ask("return Array.from(state.motion.rows)")).reshape(-1, len(names))


def run_command(page, folder):
    """The command that the page shows, run in a folder; its rows."""
    words = shlex.split(page.ask("return byId('command').value"))
    assert words[0] == "refdyn" and words[-2:] == ["-o", "run.csv"]
    refdyn(*words[1:-1], folder / "run.csv", cwd=folder)
    with open(folder / "run.csv") as file:
        return file.readline().strip().split(","), np.loadtxt(file, delimiter=",")


def farthest(page, folder):
    """The largest difference of a coordinate between page and command, as a part of the largest coordinate."""
    names, rows = rows_of(page)
    columns, expected = run_command(page, folder)
    assert names == columns and rows.shape == expected.shape and (rows[:, 0] == expected[:, 0]).all()
    count = names.index(f"{names[1]}_d") - 1
    q, wanted = rows[:, 1:1 + count], expected[:, 1:1 + count]
    assert np.ptp(wanted, axis=0).max() > 1e-3, "nothing moves"
    return np.abs(q - wanted).max() / np.abs(wanted).max()


# ---- Numbers

@pytest.mark.parametrize("name", SCENES)
def test_numbers_are_those_of_sim(pages, tmp_path, name):
    with browser.Session(pages / f"{name}.html") as page:
        page.wait(SHOWN)
        assert not [line for line in page.console if "rror" in line or "efused" in line], page.console
        assert farthest(page, tmp_path) < 1e-12


def test_numbers_after_changes(manipulator, tmp_path):
    """Parameters, one that follows the start unless it is set, and a start value; the command line and start.json say all of them."""
    set_value(manipulator, "m_E", 3.25)
    set_value(manipulator, "E", 1.7e11)
    assert farthest(manipulator, tmp_path) < 1e-9, "adaptive steps"
    set_value(manipulator, "xc", 0.54)
    command = manipulator.ask("return byId('command').value")
    assert "--set m_E=3.25 --set xc=0.54" in command.replace("--set E=170000000000 ", "") and "m_base" not in command
    set_value(manipulator, "base_z", 0.002)
    assert "--from start.json" in manipulator.ask("return byId('command').value")
    (tmp_path / "start.json").write_text(manipulator.ask("return stateText(state.motion.start, live)"))
    assert farthest(manipulator, tmp_path) < 1e-9
    text = manipulator.ask("return csvText(state.motion)").splitlines()
    names, rows = rows_of(manipulator)
    assert text[0].split(",") == names and [float(x) for x in text[-1].split(",")] == list(rows[-1])


def test_a_motion_from_an_equilibrium(manipulator, pages, tmp_path):
    """With the parameter that the ellipse reads from the start, free and given; start values then have no effect."""
    manipulator.ask("options.until = 1; const field = byId('option-from'); field.value = 'statics'; field.dispatchEvent(new Event('change'));")
    manipulator.wait("state.answered === state.asked")
    assert "--from statics" in manipulator.ask("return byId('command').value")
    assert farthest(manipulator, tmp_path) < 1e-9
    assert manipulator.ask("return values.q[0].slider.disabled && state.motion.rows[1] !== 0")
    set_value(manipulator, "xc", 0.55)
    assert farthest(manipulator, tmp_path) < 1e-9
    set_value(manipulator, "s_sup", 0)
    message = manipulator.ask("return byId('failure').textContent")
    failed = refdyn("sim", MODELS / "manipulator.lua", "--set", "s_sup=0", "--set", "xc=0.55", "--from", "statics", "--until", "1", "-o", tmp_path / "run.csv",
                    status=None)
    assert message and message.splitlines()[0] in failed.stderr
    with browser.Session(pages / "crane.html", "#from=statics") as page:
        page.wait(SHOWN)
        assert farthest(page, tmp_path) < 1e-12


MODES = "state.answered === state.asked && document.documentElement.dataset.modes === String(state.asked)"


@pytest.mark.parametrize("name, parameter, value", [("manipulator", "m_E", 3.7), ("crane", "E", 1.3e11), ("scara", "m_tool", 2.1), ("spacearm", "rho", 2400), ("puma", "E", 5e10)])
def test_modes_are_those_of_the_command(tmp_path, name, parameter, value):
    """Nine eigenvalues 0 with shapes of their own (spacearm), and programmes. The table shows four digits of the same."""
    live(MODELS / f"{name}.lua", "-o", tmp_path / "page.html")
    with browser.Session(tmp_path / "page.html") as page:
        page.wait(MODES)
        first = page.ask("return state.modes")
        set_value(page, parameter, value)
        page.wait(MODES)
        modes = np.array(page.ask("return state.modes"))
        assert modes.tolist() != first
        rows = page.ask("byId('modes').closest('details').open = true; return byId('modes').innerText").splitlines()
    expected = np.array([[mode["frequency"], mode["damping"]] for mode in json.loads(refdyn("modes", MODELS / f"{name}.lua", "--set", f"{parameter}={value}").stdout)["modes"]])
    assert modes.shape == expected.shape and np.abs(modes - expected).max() < 1e-9 * np.abs(expected).max()
    assert len(rows) == len(expected) + 1 and float(rows[-1].split()[2]) == pytest.approx(expected[-1, 1], rel=5e-3)


VERIFIED = "state.answered === state.asked && document.documentElement.dataset.verified === String(state.asked)"


@pytest.mark.parametrize("name, step, tol_rates", [("manipulator", "0", "0"), ("crane", "2e-4", "0"), ("fourbar", "0", "1e-5")])
def test_the_error_is_that_of_verify(sliding, tmp_path, name, step, tol_rates):
    """Adaptive steps and fixed ones; of positions, and of the worst rate, acceleration and force."""
    with browser.Session(sliding / f"{name}.html") as page:
        page.wait(SHOWN)
        page.ask(f"options.step = {step}; options.tol = 1e-5; options.tolRates = {tol_rates}; changedValue();")
        page.wait(VERIFIED, 60)
        shown, command = page.ask("return [byId('error').textContent, byId('command').value]")
    words = shlex.split(command)
    said = refdyn(*words[1:-2], "--verify", "--summary", tmp_path / "summary.json", "-o", tmp_path / "run.csv").stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    expected, given = summary["error"], summary.get("tol_rates", 0)
    error, at, others = re.fullmatch(r"Estimated error of the motion: (\S+) m, largest at t = (\S+) s; relative to the largest of their kind: (.*)\.", shown).groups()
    kinds = {kind: (float(relative), column) for kind, relative, column in re.findall(r"(\w+) (\S+) \((\w+)\)", others)}
    printed = {kind: (float(relative), column) for kind, relative, column in re.findall(r"^  (rates|accelerations|forces) .*, (\S+) of the largest, in (\w+) at", said, re.M)}
    assert kinds.keys() == printed.keys() == {"rates", "accelerations", "forces"} and given == float(tol_rates)
    for kind, (relative, column) in printed.items():
        assert kinds[kind][1] == column and kinds[kind][0] == pytest.approx(relative, rel=0.5) and relative > 0
    assert float(error) == pytest.approx(expected["largest"], rel=0.06) and float(at) == pytest.approx(expected["largest_t"], abs=1e-3) and float(error) > 0


@pytest.mark.parametrize("name, text", [("fourbar", "Newton's iteration did not converge"), ("branched", "rows in accelerations"), ("stewart", "leaves no motion free")])
def test_a_model_without_modes(tmp_path, name, text):
    live(MODELS / f"{name}.lua", "-o", tmp_path / "page.html")
    with browser.Session(tmp_path / "page.html") as page:
        page.wait(MODES)
        assert text in page.ask("return byId('no-modes').textContent") and page.ask("return byId('modes').hidden")


def test_continuous_states(tmp_path):
    """Their starts have sliders, and start.json says them."""
    live(MODELS.parent / "tests/models/control/states.lua", "--until", "0.3", "--tol", "1e-8", "-o", tmp_path / "states.html")
    with browser.Session(tmp_path / "states.html") as page:
        page.wait(SHOWN)
        assert farthest(page, tmp_path) < 1e-9
        assert page.ask("return values.q.map((one) => one.name)")[-len(page.ask("return live.states")):] == page.ask("return live.states")
        name, before = page.ask("return live.states")[-1], rows_of(page)[1]
        set_value(page, name, 0.37)
        (tmp_path / "start.json").write_text(page.ask("return stateText(state.motion.start, live)"))
        assert farthest(page, tmp_path) < 1e-9
        names, rows = rows_of(page)
        assert rows[0, names.index(name)] == 0.37 != before[0, names.index(name)]


def test_contact_forces_have_a_chart(tmp_path):
    """A ball that falls, bounces and comes to rest: its weight is the last value."""
    live(MODELS.parent / "tests/models/contacts/ball.lua", "--until", "3", "-o", tmp_path / "ball.html")
    with browser.Session(tmp_path / "ball.html") as page:
        page.wait(SHOWN)
        curves = page.ask("return page.charts.find((chart) => chart.title === 'Contact forces [N]').curves.map((curve) => [curve.name, curve.y[curve.y.length - 1]])")
        names, rows = rows_of(page)
        assert curves == [["contact_floor", rows[-1, names.index("contact_floor")]]] and curves[0][1] > 1


def test_the_drawing_follows_the_parameters(pages, tmp_path):
    """Frames and shapes after a change equal those of a page whose file has the value from the start."""
    given = "return {frames: runs[0].frames.map((frame) => Array.from(frame.constant)), shapes: runs[0].shapes, sticks: runs[0].sticks, points: runs[0].points, curves: runs[0].curves}"
    settings = {"L": 1.6, "h": 1.3, "d": 0.02, "m_base": 9, "xc": 0.232, "a": 0.9}
    with browser.Session(pages / "adaptive.html") as page:
        page.wait(SHOWN)
        before = page.ask(given)
        for name, value in settings.items():
            set_value(page, name, value)
        changed = page.ask(given)
    refdyn("sim", MODELS / "manipulator.lua", *[word for name, value in settings.items() for word in ("--set", f"{name}={value}")],
           "--until", "2", "--every", "0.005", "-o", tmp_path / "run.h5")
    refdyn("view", tmp_path / "run.h5", "-o", tmp_path / "run.html")
    expected, _ = browser.ask(tmp_path / "run.html", given)
    assert changed["frames"] != before["frames"]
    for part in ("frames", "shapes", "sticks"):
        assert np.array(changed[part]) == pytest.approx(np.array(expected[part]), rel=1e-5, abs=1e-6), part
    assert [point["at"] for point in changed["points"]] == [pytest.approx(point["at"], abs=1e-6) for point in expected["points"]]
    (curve,), (wanted,) = changed["curves"], expected["curves"]
    assert [curve[key] for key in ("point", "axes", "closed")] == [wanted[key] for key in ("point", "axes", "closed")] == [0, [0, 1], True]
    assert np.array(curve["path"]) == pytest.approx(np.array(wanted["path"]), abs=1e-5)


# ---- Sliders

def picture(page):
    return page.ask("drawStage(page.stage, false); const gl = page.stage.renderer.getContext(), pixels = new Uint8Array(4 * page.stage.canvas.width * page.stage.canvas.height);"
                    "gl.readPixels(0, 0, page.stage.canvas.width, page.stage.canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);"
                    "let sum = 0; for (let i = 0; i < pixels.length; i++) sum = (sum * 31 + pixels[i]) % 1000000007; return sum;")


CURVES = "return page.charts.map((chart) => Array.from(chart.curves[0].y))"


def check_slider(page, name, folder):
    """After a slider has moved, curves differ and the numbers are those of the command, both before and after."""
    parameter = SLID[name]
    page.wait(SHOWN, 60)
    assert farthest(page, folder) < 1e-9
    before = page.ask(CURVES)
    page.ask(f"const {{slider}} = values.p.find((one) => one.name === '{parameter}'); slider.value = '512'; slider.dispatchEvent(new Event('input'));")
    page.wait(f"state.asked === 2 && state.answered === 2 && {SHOWN}", 60)
    assert page.ask(CURVES) != before and page.ask("return page.charts.map((chart) => Array.from(chart.previous[0].y))") == before
    assert f"--set {parameter}=" in page.ask("showCommand(); return byId('command').value")
    assert farthest(page, folder) < 1e-9


@pytest.fixture(scope="module")
def sliding(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sliding")
    for name in SLID:
        live(MODELS / f"{name}.lua", "--until", "1", "-o", folder / f"{name}.html")
    return folder


@pytest.mark.parametrize("name", SLID)
def test_sliders_of_five_models(sliding, tmp_path, name):
    with browser.Session(sliding / f"{name}.html") as page:
        page.wait(SHOWN)
        page.ask("setTime(clock, 0.5); await new Promise((done) => setTimeout(done, 800));")
        before = picture(page)
        check_slider(page, name, tmp_path)
        assert picture(page) != before and not page.console, page.console


@pytest.mark.skipif(not LONG, reason="of tests/long")
@pytest.mark.skipif(not firefox.FIREFOX, reason="Firefox is not installed")
@pytest.mark.parametrize("name", SLID)
def test_sliders_in_firefox(sliding, tmp_path, name):
    """Headless Firefox may lack WebGL; the page then says so and shows everything else."""
    with firefox.Firefox(sliding / f"{name}.html") as page:
        check_slider(page, name, tmp_path)
        assert page.ask("return byId('no-webgl').hidden === (page.stage !== null)")
        assert [line for line in page.console if "WebGL" not in line] == []


@pytest.mark.parametrize("name, parameter", [("adaptive", "L"), ("crane", "L")])
def test_a_slider_moves_picture_and_curves(pages, name, parameter):
    """By the keyboard, which then does not move the time; the curves before the change stay, pale."""
    with browser.Session(pages / f"{name}.html") as page:
        page.wait(SHOWN)
        page.ask("setTime(clock, 1); await new Promise((done) => setTimeout(done, 800));")
        before = [picture(page), page.ask("return page.charts.map((chart) => Array.from(chart.curves[0].y))"), page.ask("return clock.time")]
        page.ask(f"values.p.find((one) => one.name === '{parameter}').slider.focus()")
        for _ in range(5):
            page.press("ArrowRight")
        page.wait(f"state.asked === 6 && state.answered === 6 && {SHOWN}")
        after = [picture(page), page.ask("return page.charts.map((chart) => Array.from(chart.curves[0].y))"), page.ask("return clock.time")]
        assert before[0] != after[0] and before[1] != after[1] and before[2] == after[2] == 1
        assert page.ask("return page.charts.map((chart) => Array.from(chart.previous[0].y))") == before[1]
        page.ask("await new Promise((done) => setTimeout(done, 1.5 * GESTURE));")
        page.press("ArrowRight")
        page.wait(f"state.asked === 7 && state.answered === 7 && {SHOWN}")
        assert page.ask("return page.charts.map((chart) => Array.from(chart.previous[0].y))") == after[1], "another change: pale is the motion before it"
        text = page.ask(f"const one = values.p.find((one) => one.name === '{parameter}'); return [one.slider.getAttribute('aria-valuetext'), one.slider.labels[0].textContent]")
        assert text[1].startswith(parameter) and float(text[0].split()[0]) != 0
        assert page.ask("return [...document.querySelectorAll('#values input, #values textarea')].filter((one) => !one.labels?.length && !one.getAttribute('aria-label')).length") == 0


def test_names_and_numbers_can_be_read(manipulator):
    """No label is cut, a field shows at most seven letters, and its exact value stays in use; the window has the model's name."""
    manipulator.ask("[...document.querySelectorAll('#values details')].forEach((one) => { one.open = true; });")
    cut = "return [...document.querySelectorAll('#values label')].filter((one) => one.offsetWidth === 0 || one.scrollWidth > one.clientWidth || one.scrollHeight > one.clientHeight + 1).map((one) => one.textContent)"
    assert manipulator.ask("return document.title") == "manipulator" and manipulator.ask(cut) == []
    fields = "return [...values.p, ...values.x, ...values.q].filter((one) => one.field).map((one) => [one.name, one.field.value, one.field.scrollWidth <= one.field.clientWidth])"
    shown = manipulator.ask(fields)
    assert ["E", "2.1e11", True] in shown and all(len(text) <= 7 and text and fits for _, text, fits in shown), shown
    assert manipulator.ask("return byId('option-tol').value") == "1e-6"
    ends = "const {ends, slider} = [...values.p, ...values.q].find((one) => one.name === '%s'); return [[...ends.children].map((one) => one.textContent), slider.title, ends.scrollWidth <= ends.clientWidth];"
    assert manipulator.ask(ends % "E") == [["2.1e10", "log", "2.1e12"], "2.1e10 to 2.1e12, logarithmic", True]
    assert manipulator.ask(ends % "column_psi") == [["\u22123.142", "", "3.142"], "\u22123.142 to 3.142", True]
    texts = {210000000000: "2.1e11", 0.001: "0.001", 1000: "1000", 0.000123456: "1.23e-4", -0.123456789: "-0.1235", 1234567.8: "1234568", -1.5e-12: "-2e-12", 0: "0"}
    assert manipulator.ask(f"return {list(texts)}.map(shortNumber)") == list(texts.values())
    set_value(manipulator, "m_E", "2.123456789")
    assert manipulator.ask("const one = values.p.find((one) => one.name === 'm_E'); return [one.value, one.field.value]") == [2.123456789, "2.12346"]
    assert "m_E=2.123456789" in manipulator.ask("return byId('command').value")


def test_motions_are_there_at_once(manipulator):
    """Median from the event of a slider to the new motion; docs/view.md has the figure of an idle machine."""
    delays = []
    for i in range(25):
        manipulator.ask(f"const one = values.p.find((one) => one.name === 'm_E'); one.slider.value = '{480 + i}'; one.slider.dispatchEvent(new Event('input'));")
        manipulator.wait("state.answered === state.asked")
        delays.append(manipulator.ask("return state.delay"))
        time.sleep(0.05)
    print(f"median {statistics.median(delays):.1f} ms")
    assert statistics.median(delays) < 2000, delays


def test_a_hundred_random_changes(manipulator):
    """No error, and no more memory afterwards than after the first changes."""
    manipulator.ask("""
        let seed = 7;
        window.randomChange = () => {
            seed = (seed * 48271) % 2147483647;
            const list = values.p.filter((one) => ["m_base", "L", "h", "E", "m_E", "rho", "g"].includes(one.name)), one = list[seed % list.length];
            one.slider.value = String(400 + seed % 200);
            one.slider.dispatchEvent(new Event("input"));
        };""")

    def change(count):
        for _ in range(count):
            manipulator.ask("randomChange()")
            manipulator.wait("state.answered === state.asked")
        manipulator.ask("drawStage(page.stage, false)")
        manipulator.call("HeapProfiler.collectGarbage")
        heap = manipulator.call("Runtime.getHeapUsage")["usedSize"]
        return [heap, *manipulator.ask("return [state.motion.memory, page.stage.renderer.info.memory.geometries, page.stage.renderer.info.memory.textures]")]

    first, last = change(20), change(100)
    assert last[0] < first[0] + 3e6 and last[1] == first[1], (first, last)
    assert max(last[2] - first[2], last[3] - first[3]) <= 3, "buffers on the graphics card that are not freed"
    assert manipulator.ask("return byId('failure').classList.contains('is-failed')") is False
    assert not [line for line in manipulator.console if "rror" in line], manipulator.console


def test_the_page_never_waits(pages):
    """A motion that takes seconds does not stop the page, and a newer one replaces it."""
    with browser.Session(pages / "manipulator.html") as page:
        page.wait(SHOWN)
        page.ask("options.until = 2000; changedValue();")
        asked = page.ask("return state.asked")
        page.ask("for (let i = 0; i < 20; i++) await new Promise(requestAnimationFrame);")
        assert page.ask("return state.answered") < asked
        page.ask("options.until = 2; changedValue();")
        page.wait(f"state.answered === {asked + 1} && {SHOWN}")
        assert page.ask("return state.motion.rows[state.motion.rows.length - state.motion.columns.length]") == 2


def test_values_that_no_motion_can_have(manipulator):
    """A duration of 0 is refused next to its field; a value that is no number leaves the last one."""
    asked = manipulator.ask("return state.asked")
    for name, value, message in (("until", "0", "must be positive"), ("tol", "-1", "must be positive"), ("step", "-1", "must be positive, or 0")):
        said = manipulator.ask(f"const field = byId('option-{name}'); field.value = '{value}'; field.dispatchEvent(new Event('change')); return [field.validationMessage, state.asked, options.{name}]")
        assert said == [message, asked, {"until": 2, "tol": 1e-6, "step": 0}[name]]
    said = manipulator.ask("const one = values.p[0]; one.field.value = ''; one.field.dispatchEvent(new Event('change')); one.field.dispatchEvent(new Event('blur')); return [one.field.value, state.asked]")
    assert said == ["18.5433", asked]
    assert manipulator.ask("const field = byId('option-until'); field.value = '1'; field.dispatchEvent(new Event('change')); return [field.validationMessage, state.asked, options.until]") == ["", asked + 1, 1]


# ---- Pulling

CART = """local rd = require "refdyn"
return rd.model { name = "cart", gravity = { 0, 0, -9.81 }, links = { { "cart", joint = "x", start_rate = { x = 0.25 }, mass = 3.7 } },
  points = { E = "cart", F = { on = "cart", at = { 0, 0.2, 0 } } } }
"""


def test_the_motion_of_a_pulled_cart(tmp_path):
    """A spring and a damper of 2 Hz and ratio 0.7 between the second point and a hand at rest, from t = 0.4 on; then free."""
    (tmp_path / "cart.lua").write_text(CART)
    live(tmp_path / "cart.lua", "--pull", "--until", "3", "--tol", "1e-9", "-o", tmp_path / "cart.html")
    with browser.Session(tmp_path / "cart.html") as page:
        page.wait(SHOWN)
        command = page.ask("return byId('command').value")
        assert page.ask("return values.x.length") == 0 and "live" not in command
        page.ask("hand.point = 1; hand.place = [0.9, 0.2, 0]; window.started = performance.now(); ask({point: 1, from: 0.4, speed: 1, hand: hand.place});")
        page.wait("clock.time > 0.9 && clock.time === clock.end")
        page.ask("hand.point = -1; state.worker.postMessage({release: state.asked})")
        page.wait(f"state.answered === state.asked && {SHOWN}")
        names, rows = rows_of(page)
        assert page.ask("return byId('pulled').hidden") is False
        assert page.ask("return 2000 * state.motion.seconds < performance.now() - window.started"), "the time of computation excludes the pull"
        set_value(page, "cart_x", 0.1)
        assert page.ask("return byId('pulled').hidden") is True
        (tmp_path / "start.json").write_text(page.ask("return stateText(state.motion.start, live)"))
        assert farthest(page, tmp_path) < 1e-9
    t, x, rate = (rows[:, names.index(name)] for name in ("t", "cart_x", "cart_x_d"))
    assert t[-1] == 3 and rate[-1] == rate[-2]
    let_go = t[np.flatnonzero(rate != rate[-1])[-1]]
    free, pulled, after = t <= 0.4, (t > 0.4) & (t < let_go - 0.02), t > let_go + 0.02
    assert np.abs(x[free] - 0.25 * t[free]).max() < 1e-9 and pulled.sum() > 20 and after.sum() > 20
    omega, damping, since = 12.6, 0.7, t[pulled] - 0.4
    turn = omega * np.sqrt(1 - damping**2)
    away, speed = 0.1 - 0.9, 0.25
    expected = 0.9 + np.exp(-damping * omega * since) * (away * np.cos(turn * since) + (speed + damping * omega * away) / turn * np.sin(turn * since))
    assert np.abs(x[pulled] - expected).max() < 1e-7
    assert np.abs(np.diff(x[after]) - rate[-1] * np.diff(t[after])).max() < 1e-9


def test_the_pointer_pulls_a_point(tmp_path):
    """From the present time on; what precedes it stays. A drag elsewhere turns the camera."""
    live(MODELS / "pendulum.lua", "--pull", "--until", "4", "-o", tmp_path / "page.html")
    with browser.Session(tmp_path / "page.html") as page:
        page.wait(SHOWN)
        page.ask("setTime(clock, 0.5);")
        before = rows_of(page)[1]

        def mouse(kind, x, y, buttons):
            page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if buttons or kind == "mouseReleased" else "none", buttons=buttons, clickCount=1)

        x, y = page.ask("const box = byId('stage').getBoundingClientRect(), at = projected(placeNow(runs[0], runs[0].points[0]));"
                        "return [box.left + box.width * (at.x + 1) / 2, box.top + box.height * (1 - at.y) / 2]")
        mouse("mouseMoved", x, y, 0)
        assert page.ask("return byId('stage').style.cursor") == "pointer"
        azimuth = page.ask("return page.stage.camera.azimuth")
        mouse("mousePressed", x, y, 1)
        mouse("mouseMoved", x + 60, y - 80, 1)
        page.wait("clock.time > 0.8 && hand.line !== null")
        held = page.ask("return [page.stage.camera.azimuth, Math.hypot(...hand.place.map((at, i) => at - placeNow(runs[0], runs[0].points[0])[i]))]")
        mouse("mouseReleased", x + 60, y - 80, 0)
        page.wait(f"state.answered === state.asked && {SHOWN}")
        after = rows_of(page)[1]
        assert held[0] == azimuth and page.ask("return [hand.line, clock.isPlaying]") == [None, True]
        apart = np.abs(after - before)[:, 1:1 + page.ask("return values.q.length / 2")]
        assert apart[before[:, 0] < 0.5].max() < 1e-6 and apart[-1].max() > 0.01, "adaptive steps end at the time at which the hand begins"
        page.ask("ask({point: 0, from: 0.5, speed: 1, hand: placeNow(runs[0], runs[0].points[0])}); state.worker.postMessage({release: state.asked});")
        page.wait(f"state.answered === state.asked && {SHOWN}")
        again = rows_of(page)[1]
        assert np.ptp(again[again[:, 0] > 3, 1]) > 0.1, "the hand has let go before the worker knew of it"
        mouse("mousePressed", x - 200, y - 60, 1)
        mouse("mouseMoved", x - 160, y - 60, 1)
        mouse("mouseReleased", x - 160, y - 60, 0)
        assert page.ask("return page.stage.camera.azimuth") != azimuth and not page.console, page.console


# ---- The address

def test_values_are_in_the_address(pages, manipulator):
    set_value(manipulator, "m_E", 2.5)
    set_value(manipulator, "base_z", 0.001)
    fragment = manipulator.wait("location.hash.length > 10 && location.hash")
    assert "p.m_E=2.5" in fragment and "q.base_z=0.001" in fragment
    expected = manipulator.ask("return Array.from(state.motion.rows)")
    with browser.Session(pages / "adaptive.html", fragment + "&t=1&p.none=3&p.E=abc&forces=1") as page:
        page.wait(SHOWN)
        assert page.ask("return Array.from(state.motion.rows)") == expected
        assert page.ask("return [clock.time, clock.shown.forces, values.p.find((one) => one.name === 'm_E').field.value]") == [1, True, "2.5"]
        page.ask("[...document.querySelectorAll('#values button')].find((one) => one.textContent === 'Reset all').click()")
        page.wait("state.answered === 2 && location.hash.indexOf('m_E') < 0")


# ---- Failures

def test_failures_leave_the_last_motion(manipulator, tmp_path):
    good = manipulator.ask("return Array.from(state.motion.rows)")
    set_value(manipulator, "m_E", -1)
    manipulator.wait(FAILED)
    message = manipulator.ask("return byId('failure').textContent")
    refused = refdyn("sim", MODELS / "manipulator.lua", "--set", "m_E=-1", "--until", "2", "-o", tmp_path / "run.csv", status=1).stderr
    assert message in refused and re.match(r".*manipulator\.lua:\d+: links\[\d\]\.mass: .*; must be positive", message)
    assert manipulator.ask("return [byId('failure').hidden, byId('failure').getAttribute('role'), Array.from(state.motion.rows)]") == [False, "alert", good]
    set_value(manipulator, "m_E", 2)
    manipulator.wait(SHOWN)
    assert manipulator.ask("return byId('failure').hidden") is True
    manipulator.ask("options.step = 1e-3; changedValue();")
    manipulator.wait(FAILED)
    message = manipulator.ask("return byId('failure').textContent")
    failed = refdyn("sim", MODELS / "manipulator.lua", "--step", "1e-3", "--until", "2", "--every", "0.005", "-o", tmp_path / "run.csv", status=3).stderr
    assert message.splitlines()[0] in failed and "equal steps of 0.001 s may be too long: use a smaller --step, or --tol" in message


REACH = """local rd = require "refdyn"
local v = rd.parameter("v", 0.1, "m/s")
return rd.model { name = "reach", gravity = { 0, 0, -9.81 },
  links = { { "upper", joint = "psi", start = { psi = 0.5 }, mass = 1, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 } },
            { "lower", on = "upper", at = { 1, 0, 0 }, joint = "psi", start = { psi = -1 }, mass = 1, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 } } },
  points = { E = { on = "lower", at = { 1, 0, 0 } } },
  constraints = function(s) return { rd.velocity { s.points.E.xd - v, name = "pull" }, rd.position { s.points.E.y, name = "line" } } end }
"""


def test_a_programme_out_of_reach(tmp_path):
    """The arm of 2 m is pulled beyond its reach; the message says where."""
    (tmp_path / "reach.lua").write_text(REACH)
    live(tmp_path / "reach.lua", "-o", tmp_path / "reach.html")
    with browser.Session(tmp_path / "reach.html") as page:
        page.wait(SHOWN)
        set_value(page, "v", 0.4)
        page.wait(FAILED)
        message = page.ask("return byId('failure').textContent")
    failed = refdyn("sim", tmp_path / "reach.lua", "--set", "v=0.4", "--until", "2", "--every", "0.005", "-o", tmp_path / "run.csv", status=3).stderr
    assert "singular position, or the end of what the programme lets the links reach" in message
    bare = [re.sub(r"-?\d[\d.e+-]*", "#", text) for text in (message.splitlines()[0], failed)]
    assert bare[0] in bare[1], "the last digits of the time of a failed step may differ"


def test_warnings_are_those_of_sim(tmp_path):
    """Of a start off the programme, with its residuals."""
    live(MODELS / "branched.lua", "-o", tmp_path / "branched.html")
    with browser.Session(tmp_path / "branched.html") as page:
        page.wait(SHOWN)
        message, command = page.ask("return [byId('failure').textContent, byId('command').value]")
    assert message.startswith("warning: the start is off the programme:")
    said = refdyn(*shlex.split(command)[1:-1], tmp_path / "run.csv").stderr
    assert message.splitlines()[:6] == said.replace("refdyn: ", "").splitlines()[:6]


# ---- Texts of users, and the network

EVIL = "</script><script>window.hacked = 1</script><img src=x onerror=window.hacked=2><a href='javascript:window.hacked=4'>`${window.hacked = 5}`<!--"
MODEL = """local rd = require "refdyn"
-- %s
local m = rd.parameter("m", 1, "%s")
local force = rd.input("force", 0, "%s")
return rd.model { name = "evil", gravity = { 0, 0, -9.81 },
  links = { { "arm", joint = "theta", start = { theta = 0.3 }, mass = m, center = { 0.5, 0, 0 }, inertia = { yy = 0.1 } } },
  points = { E = "arm" }, forces = function(s) return { arm_theta = force } end,
  courses = function(s) return { ["%s"] = s.q.arm_theta } end }
""" % (EVIL, EVIL.replace('"', "'"), EVIL.replace('"', "'"), EVIL.replace(",", " "))


def test_texts_stay_texts(tmp_path):
    folder = tmp_path / "a'b<i>&\"$(touch hacked)"
    folder.mkdir()
    (folder / "evil.lua").write_text(MODEL)
    live(folder / "evil.lua", "--set", "m=2", "-o", tmp_path / "evil.html")
    text = (tmp_path / "evil.html").read_text()
    assert text.count("<script") == text.count("</script>") == 6 and "<img" not in text and "<a " not in text
    with browser.Session(tmp_path / "evil.html", "#p.m=3&<img src=x onerror=window.hacked=3>") as page:
        page.wait(SHOWN)
        page.ask("[...document.querySelectorAll('details')].forEach((one) => { one.open = true; });")
        assert page.ask("return [window.hacked || 0, document.images.length, document.links.length, values.p[0].unit]") == [0, 0, 0, EVIL.replace('"', "'")]
        set_value(page, "m", -1)
        assert "evil.lua:3: " in page.ask("return byId('failure').textContent") or "must be positive" in page.ask("return byId('failure').textContent")
        set_value(page, "m", 4)
        (columns, expected), (names, rows) = run_command(page, tmp_path), rows_of(page)
        assert columns[:3] == names[:3] and np.abs(rows[:, 1] - expected[:, 1]).max() < 1e-12 and not (tmp_path / "hacked").exists()


def hashes_of(text):
    """The scripts that a page runs and its style, as the policy names them: the one that unpacks, the unpacked one, the style."""
    parts = [re.search(r"<script>(.*?)</script>", text, re.S)[1].encode(), browser.program_of(text), re.search(r"<style>(.*?)</style>", text, re.S)[1].encode()]
    return [f"'sha256-{base64.b64encode(hashlib.sha256(part).digest()).decode()}'" for part in parts]


def test_nothing_comes_from_a_network(pages):
    """The policy lets no script run but those of the page, and nothing be loaded."""
    text = (pages / "crane.html").read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)[1]
    assert policy == "default-src 'none'; script-src %s %s 'wasm-unsafe-eval'; worker-src blob:; style-src %s" % tuple(hashes_of(text))
    assert "SharedArrayBuffer" not in text[text.rindex('id="worker"'):][:20000]
    with browser.Session(pages / "crane.html") as page:
        page.wait(SHOWN)
        assert [name for name in page.ask("return performance.getEntriesByType('resource').map((entry) => entry.name)") if not name.startswith("blob:")] == []
        assert not page.console
        page.ask("""const script = document.createElement('script'), button = document.createElement('button'), link = document.createElement('a');
                    script.textContent = 'window.hacked = 1';
                    button.setAttribute('onclick', 'window.hacked = 2');
                    link.href = 'javascript:window.hacked=3';
                    document.body.append(script, button, link);
                    button.click();
                    link.click();
                    try { (0, eval)('window.hacked = 4'); } catch (error) {}
                    await new Promise((done) => setTimeout(done, 100));""")
        assert page.ask("return window.hacked || 0") == 0 and len(page.console) >= 3


def test_pages_are_small(pages):
    """Smaller than the 1.5 MB that a mail or a telephone takes, by far: most of it is three.js and the module, packed."""
    assert max(page.stat().st_size for page in pages.glob("*.html")) < 650_000


def test_on_a_telephone(pages):
    """Nothing is wider than the window, and all sliders can be reached by scrolling."""
    with browser.Session(pages / "crane.html") as page:
        page.call("Emulation.setDeviceMetricsOverride", width=390, height=800, deviceScaleFactor=2, mobile=True)
        page.wait(SHOWN)
        assert page.ask("return document.documentElement.scrollWidth") <= 390
        assert page.ask("const slider = values.p[0].slider; slider.scrollIntoView(); const box = slider.getBoundingClientRect(); return box.left >= 0 && box.right <= 390 && box.top >= 0")


# ---- Structures

def test_structures(package, tmp_path):
    """The page changes the structure: its numbers are those of the command, changed values stay, and the address names it."""
    arm = package.Model(MODELS / "manipulator.lua")
    arm.live(tmp_path / "arm.html", n_rfe=[2, 1, 4], m_E=2.25, base_z_d=(-1, 2), arm_psi_3=(0, 1), tol=1e-8)
    live(MODELS / "manipulator.lua", "--options", "n_rfe=2,1,4", "--set", "m_E=2.25", "--range", "base_z_d=-1:2", "--range", "arm_psi_3=0:1", "--tol", "1e-8", "-o", tmp_path / "same.html")
    assert (tmp_path / "arm.html").read_text() == (tmp_path / "same.html").read_text()
    choose = "const field = byId('structure-0'); field.value = '%d'; field.dispatchEvent(new Event('change'));"
    shown = f"state.answered === state.asked && {SHOWN}"
    with browser.Session(tmp_path / "arm.html") as page:
        page.wait(shown)
        assert page.ask("return [byId('structure-0').labels[0].textContent, runs[0].frames.length, [...byId('structure-0')].map((one) => one.text)]") == ["n_rfe", 7, ["2", "1", "4"]]
        assert farthest(page, tmp_path) < 1e-9
        set_value(page, "L", 1.6)
        for place, frames, elements in ((2, 13, 4), (1, 4, 1)):
            page.ask(choose % place)
            page.wait(shown)
            assert page.ask("return [runs[0].frames.length, values.q.length / 2, page.stage.bodies[0].run.frames.length]") == [frames] * 3
            assert f"{frames} coordinates" in page.ask("return byId('runs').textContent")
            command = page.ask("return byId('command').value")
            assert f"--set n_rfe={elements} " in command and "--set L=1.6" in command and "--set m_E=2.25" in command
            assert farthest(page, tmp_path) < 1e-9
        assert page.ask("return page.charts.every((chart) => chart.curves.every((curve) => !/^arm_.*_[123]$/.test(curve.name)))")
        fragment = page.wait("location.hash.includes('o.n_rfe=1') && location.hash")
        assert "o.n_rfe=1" in fragment and "p.L=1.6" in fragment
        page.ask("for (let i = 0; i < 20; i++) chooseStructure(i % 3); chooseStructure(2);")
        page.wait(f"{shown} && runs[0].frames.length === 13")
        assert not [line for line in page.console if "rror" in line], page.console
    with browser.Session(tmp_path / "arm.html", "#o.n_rfe=4&p.L=1.5") as page:
        page.wait(shown)
        assert page.ask("return [runs[0].frames.length, byId('structure-0').value]") == [13, "2"]
        page.ask("location.hash = '#o.n_rfe=1'")
        page.wait(f"{shown} && runs[0].frames.length === 4")


def test_structures_of_two_options(tmp_path):
    """A module for each combination; each has the numbers of its own command."""
    live(MODELS / "manipulator.lua", "--options", "n_rfe=1,2", "--options", "program=consistent,chapter,none", "--until", "0.2", "-o", tmp_path / "page.html")
    shown = f"state.answered === state.asked && {SHOWN}"
    with browser.Session(tmp_path / "page.html", "#o.program=chapter") as page:
        page.wait(shown)
        assert page.ask("return [modules.length, structure.place, byId('structure-1').value]") == [6, 1, "1"]
        for field, value, words in ((0, 1, "n_rfe=2 --set program=chapter"), (1, 2, "n_rfe=2 --set program=none"), (0, 0, "n_rfe=1 --set program=none")):
            page.ask(f"const field = byId('structure-{field}'); field.value = '{value}'; field.dispatchEvent(new Event('change'));")
            page.wait(shown)
            assert f"--set {words} " in page.ask("return byId('command').value")
            assert farthest(page, tmp_path) < 1e-9
        assert page.wait("location.hash.includes('o.program=none') && !location.hash.includes('o.n_rfe')")


# ---- In a notebook

def test_a_page_in_a_notebook(package, tmp_path):
    """Inside another document, the sliders move; the page equals that of the command."""
    crane = package.Model(MODELS / "crane.lua")
    page = crane.live(E=(1e10, 3e11), rope_theta_d=(-1, 2), m=80, t_end=1, step=2e-4, height=700)
    live(MODELS / "crane.lua", "--range", "E=1e10:3e11", "--range", "rope_theta_d=-1:2", "--set", "m=80", "--until", "1", "--step", "2e-4", "-o", tmp_path / "crane.html")
    assert page.text == (tmp_path / "crane.html").read_text() and 'height="700"' in page._repr_html_()
    assert '"canPull":false' in page.text and crane.live(tmp_path / "short.html", t_end=0.1, pull=True) is None
    short = (tmp_path / "short.html").read_text()
    assert '"until":0.1,' in short and '"canPull":true' in short
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><html><body>{page._repr_html_()}</body></html>")
    with browser.Session(tmp_path / "notebook.html") as notebook:
        inside = "document.querySelector('iframe').contentDocument"
        notebook.wait(f"{inside}.documentElement.dataset.state === 'shown'")
        assert notebook.ask(f"const field = {inside}.querySelector('[aria-label=\"m, number\"]'); field.value = '90'; field.dispatchEvent(new Event('change'));"
                            f"return {inside}.documentElement.dataset.state") == "computing"
        notebook.wait(f"{inside}.documentElement.dataset.state === 'shown'")
        assert "--set m=90" in notebook.ask(f"await new Promise((done) => setTimeout(done, 500)); return {inside}.getElementById('command').value")
        assert not [line for line in notebook.console if "rror" in line], notebook.console
    for message, values in {"mm: unknown name; did you mean 'm'?": {"mm": 1}, "E: from 2 to 1; the range must ascend": {"E": (2, 1)},
                            "E: has shape (3,); must be one value, or a range of two numbers, (from, to)": {"E": (1, 2, 3)},
                            "rope_theta: a start value has a range only; must be two numbers, (from, to)": {"rope_theta": 1},
                            "t_end: '-1' is not a positive number": {"t_end": -1}}.items():
        with pytest.raises(ValueError) as told:
            crane.live(**values)
        assert str(told.value) == message


# ---- Ranges, and what is refused

def test_ranges(tmp_path):
    """Of a parameter, of a start value, and those that follow from a value."""
    live(MODELS / "crane.lua", "--set", "m=50", "--range", "E=1e10:3e11", "--range", "rope_theta_d=-1:2", "-o", tmp_path / "crane.html")
    with browser.Session(tmp_path / "crane.html") as page:
        page.wait(SHOWN)
        ends = "const one = [...values.p, ...values.q].find((one) => one.name === '%s'); return [0, 1000].map((place) => valueAtPosition(one.range, place));"
        assert page.ask(ends % "E") == [1e10, 3e11] and page.ask(ends % "rope_theta_d") == [-1, 2] and page.ask(ends % "m") == [5, 500]
        assert "--set m=50" in page.ask("return byId('command').value")
        assert page.ask("const one = values.p.find((one) => one.name === 'E'); return valueAtPosition(one.range, positionOf(one.range, 2.1e11));") == pytest.approx(2.1e11, rel=0.01)


def test_usage(pages, tmp_path):
    crane, out = MODELS / "crane.lua", tmp_path / "none.html"
    assert "--range: 'none' is no parameter, input or start value of the model" in live(crane, "--range", "none=1:2", "-o", out, status=2).stderr
    assert "is not of the form NAME=FROM:TO" in live(crane, "--range", "column_psi=1", "-o", out, status=2).stderr
    assert "the range must ascend" in live(crane, "--range", "column_psi=2:1", "-o", out, status=2).stderr
    assert live(crane, "--range", "n_rfe=1:4", "-o", out, status=2).stderr.startswith(
        "refdyn view: --range: 'n_rfe' is an option of the model; --options n_rfe=VALUE,VALUE,... lets the page choose among its values\n")
    structures = {"E=1e10,2e10": "'E' is no option of the model but has a slider; --range E=FROM:TO states its range", "none=1,2": "the model has no option 'none'", "n_rfe": "'n_rfe' is not of the form NAME=VALUE,VALUE,...", "n_rfe=1,1": "'1' is given twice; give it once",
                  "n_rfe=1,,2": "'1,,2' has an empty item"}
    for text, fact in structures.items():
        assert live(crane, "--options", text, "-o", out, status=2).stderr.splitlines()[0] == f"refdyn view: --options: {fact}"
    said = live(crane, "--options", "n_rfe=1,2", "--options", "n_rfe=3", "-o", out, status=2).stderr
    assert said.startswith("refdyn view: --options: 'n_rfe' is given twice; give it once\n")
    said = live(crane, "--options", "n_rfe=1,2,3,4,5,6,7,8,9,10,11,12,13", "-o", out, status=2).stderr
    assert said.startswith("refdyn view: --options: more than 12 combinations, each of which adds a module to the page; state fewer values\n")
    said = live(crane, "--options", "n_rfe=1,2", "--set", "n_rfe=3", "-o", out, status=2).stderr
    assert said.startswith("refdyn view: --options: --set states 'n_rfe', too; omit one of them\n")
    assert live(crane, "--options", "n_rfe=2,0", "-o", out, status=1).stderr.endswith('crane.lua:5: option n_rfe: value "0"; must be a number from 1\n')
    assert live(crane, "--options", "n_rfe=2:8", "-o", out, status=1).stderr.endswith('crane.lua:5: --options n_rfe: value "2:8"; must be a whole number\n')
    assert "--options needs --live" in refdyn("view", pages / "a.h5", "--options", "n_rfe=1,2", "-o", out, status=2).stderr
    assert "--pull needs --live" in refdyn("view", pages / "a.h5", "--pull", "-o", out, status=2).stderr
    assert "--live shows one model" in live(crane, crane, "-o", out, status=2).stderr
    assert "--until needs --live" in refdyn("view", pages / "a.h5", "--until", "1", "-o", out, status=2).stderr
    assert "--model is for runs" in live(crane, "--model", crane, "-o", out, status=2).stderr
    assert not out.exists()


def test_without_a_compiler(tmp_path):
    out = tmp_path / "none.html"
    done = live(MODELS / "crane.lua", "-o", out, env={"REFDYN_WASM_CC": "no-clang"}, status=1)
    assert done.stderr == ("refdyn: view --live: no compiler 'no-clang' is installed; it compiles to WebAssembly with clang, lld, wasi-libc and "
                           "libclang-rt-dev-wasm32 (Debian: apt install clang lld wasi-libc libclang-rt-dev-wasm32)\n")
    done = live(MODELS / "crane.lua", "-o", out, env={"REFDYN_WASM_CC": shutil.which("gcc")}, status=1)
    assert "does not build for wasm32-wasi; it compiles to WebAssembly with clang" in done.stderr and not out.exists()


def test_two_calls_write_the_same_page(pages, tmp_path):
    live(MODELS / "crane.lua", "-o", tmp_path / "again.html")
    live(MODELS / "crane.lua", "-o", tmp_path / "twice.html")
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "twice.html").read_bytes()
