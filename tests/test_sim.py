"""Additional options of `refdyn sim`: error of a motion, tolerance for an error, sampled inputs, stop conditions."""
import json
import math
import re

import numpy
import pytest

from program import MODELS, REFERENCE, SCALE, TESTS, check, motion, read_run, refdyn

PENDULUM = TESTS / "models" / "double_pendulum.lua"
RIGID = [REFERENCE, "--set", "n_rfe=1", "--until", 5, "--every", 0.5]
SWING = [PENDULUM, "--until", 5, "--every", 0.5]
FLEXIBLE = [REFERENCE, "--from", "statics", "--until", 1, "--every", 0.1]
REFERENCES = {}


def exact(case):
    """The motion with negligible errors."""
    key = str(case)
    if key not in REFERENCES:
        REFERENCES[key] = motion(*case, "--method", "rk8", "--tol", "1e-13")[0]
    return REFERENCES[key]


def errors(run, reference, summary):
    """Largest distances of points and differences of coordinates from the reference, by name."""
    error = summary["error"]
    found = {name: numpy.sqrt(sum((run[f"{name}_{axis}"] - reference[f"{name}_{axis}"])**2 for axis in "xyz")).max()
             for name in error["points"]}
    return found, {name: abs(run[name] - reference[name]).max() for name in error["coordinates"]}


# ---- The error of a motion ----

@pytest.mark.parametrize("case", [RIGID, SWING, FLEXIBLE], ids=["rigid", "pendulum", "flexible"])
@pytest.mark.parametrize("how", [("rodas5p", "--tol", "1e-5"), ("rodas6p", "--tol", "1e-7"), ("ros34pw2", "--tol", "1e-6"),
                                 ("rk54", "--tol", "1e-7"), ("rk8", "--tol", "1e-6"), ("rk4", "--step", "2e-4"),
                                 ("rodas5p", "--step", "5e-3")], ids=" ".join)
def test_verify(case, how):
    """The estimate is within a factor 3 of the error relative to a practically exact motion."""
    run, said, summary = motion(*case, "--method", *how, "--verify")
    points, coordinates = errors(run, exact(case), summary)
    found = max(points.values() if points else coordinates.values())
    estimated = summary["error"]["largest"]
    assert summary["error"]["is_trusted"] and "error" in said
    assert found / 3 <= estimated <= 3 * found, f"{estimated:.1e} estimated, {found:.1e} found"
    assert summary["error"]["t"] == list(run["t"])
    for name, listed in summary["error"]["points"].items():
        assert len(listed) == len(run["t"]) and listed[0] == 0 and max(listed) >= points[name] / 10


@pytest.mark.parametrize("model, until, how", [("slidercrank", 0.2, ("rodas5p", "--tol", "1e-4")), ("fourbar", 1, ("gauss12", "--tol", "3.16228e-6")),
                                               ("fourbar", 1, ("rk8", "--tol", "3.16227766e-4"))])
def test_verify_where_a_tenth_of_the_tolerance_has_the_same_error(model, until, how):
    """At one output, where nothing else shows it: these motions have equal errors at a tenth of their tolerance, and the difference is a
    hundredth of the error. The estimate is nevertheless within a factor 10."""
    case = [MODELS / f"{model}.lua", "--until", until, "--every", until]
    run, _, summary = motion(*case, "--method", *how, "--verify")
    found = max(errors(run, exact(case), summary)[0].values())
    estimated = summary["error"]["largest"]
    assert found / 10 <= estimated <= 10 * found, f"{estimated:.1e} estimated, {found:.1e} found"


def test_verify_after_a_jump_at_the_start():
    """A start off the programme: its error is estimated like any other. Energy does not balance at any tolerance, and the suggested remedy
    is not a smaller tolerance."""
    off = [REFERENCE, "--set", "n_rfe=1", "--set", "program=chapter", "--until", 1, "--every", 0.1]
    run, said, summary = motion(*off, "--tol", "1e-6", "--verify")
    found = max(errors(run, exact(off), summary)[0].values())
    assert found / 3 <= summary["error"]["largest"] <= 3 * found and summary["error"]["is_trusted"]
    assert summary["energy_error"] > 0.1 and "begin on it with --start project" in said and "smaller" not in said, said
    _, said, summary = motion(*off, "--tol", "1e-6", "--start", "project")
    assert summary["energy_error"] < 1e-4 and "balance: " not in said


# ---- Errors of rates, accelerations and forces ----

KINDS = ("rates", "accelerations", "forces")
STIFF = {name: [MODELS / f"{name}.lua", "--until", until, "--every", every]
         for name, until, every in (("planar", 1, 0.0025), ("spinup", 6, 0.03), ("scara", 1.7, 0.0085), ("slidercrank", 0.3, 0.0015))}
TIGHT = {}


def tight(name):
    if name not in TIGHT:
        TIGHT[name] = motion(*STIFF[name], "--method", "radau9", "--tol", "1e-12")[0]
    return TIGHT[name]


def of_accelerations(run, name):
    """The largest error of an acceleration over the largest of all."""
    reference, columns = tight(name), [column for column in run if column.endswith("dd")]
    return max(abs(run[column] - reference[column]).max() for column in columns) / max(abs(reference[column]).max() for column in columns)


@pytest.mark.parametrize("name, outputs", [("planar", 400), ("planar", 2000), ("spinup", 400), ("spinup", 2000)])
def test_no_step_excites_what_the_motion_does_not(name, outputs):
    """Explicit steps at their stability limit once left vibrations of 66 times the largest acceleration."""
    model, _, until, _, every = STIFF[name]
    case = [model, "--until", until, "--every", until / outputs]
    run, reference = motion(*case)[0], motion(*case, "--method", "radau9", "--tol", "1e-12")[0]
    columns = [column for column in run if column.endswith("dd")]
    off = max(abs(run[column] - reference[column]).max() for column in columns)
    assert off <= 1e-3 * SCALE * max(abs(reference[column]).max() for column in columns)


def test_trial_steps_count_with_the_length_that_positions_allow():
    """Otherwise the bound on errors of rates makes explicit trials look slow: the points of Gauss win, and keep vibrations of 0.16 of the
    largest acceleration."""
    assert of_accelerations(motion(*STIFF["scara"])[0], "scara") <= 0.03 * SCALE


@pytest.mark.parametrize("name", STIFF)
def test_tolerance_of_rates(name):
    run, _, summary = motion(*STIFF[name], "--tol-rates", "1e-7")
    assert of_accelerations(run, name) <= 1e-5 * SCALE and summary["tol_rates"] == 1e-7


@pytest.mark.parametrize("how", [(), ("--tol-rates", "1e-4"), ("--method", "rodas5p")], ids=str)
@pytest.mark.parametrize("name", ["planar", "scara", "slidercrank"])
def test_verify_estimates_rates_and_forces(name, how):
    """The worst column of each kind within a factor of 3."""
    run, said, summary = motion(*STIFF[name], *how, "--verify")
    for kind in KINDS:
        estimated = summary["error"][kind]
        found = {column: abs(run[column] - tight(name)[column]).max() for column in estimated}
        worst = max(found, key=found.get)
        assert found[worst] / 3 <= estimated[worst] <= 3 * found[worst] or found[worst] < 1e-9, (kind, worst, found[worst], estimated[worst])
        assert kind in said


def test_verify_where_no_motion_bounds_errors_of_rates():
    """Past a singular position. The errors of positions are estimated as anywhere else."""
    case = [TESTS / "models" / "equal_crank.lua", "--until", 1]
    refdyn("sim", *case, "--tol-rates", "1e-7", "-o", "/dev/null", status=3)
    run, said, summary = motion(*case, "--verify")
    angles = motion(*case, "--set", "row=angles", "--tol", "1e-11")[0]
    found = max(errors(run, angles, summary)[0].values())
    assert found / 3 <= summary["error"]["largest"] <= 3 * found and summary["error"]["is_trusted"]
    assert all(summary["error"][kind] is None for kind in KINDS) and "rates, accelerations and forces: no estimate" in said


SPIN = """local rd = require "refdyn"
return rd.model { name = "spin", links = { { "body", joint = "%s", start = { %s }, start_rate = { psi = 2.3, %s }, mass = 1.7,
  inertia = { xx = 0.11, yy = 0.2, zz = 0.25 } } } }
"""


@pytest.mark.parametrize("values, line, is_told", [
    (("psi", "", ""), "energy       changes only by rounding, ", False),
    (("psi, theta, phi", "theta = 0.3", "theta = 0.5, phi = 1.1"), "energy       changes by no more than its balance error, ", True)])
def test_energy_that_does_not_change(values, line, is_told, tmp_path):
    """In a free rotation only errors change energy: their ratio would be 1 however small they are."""
    (tmp_path / "spin.lua").write_text(SPIN % values)
    _, said, summary = motion(tmp_path / "spin.lua", "--until", 2)
    assert line in said and "warning" not in said, said
    assert (summary["energy_error"] is not None) == is_told


SLIDE = """local rd = require "refdyn"
return rd.model { name = "slide", gravity = { 0, 0, 0 }, links = { { "cart", joint = "x", mass = 2 } },
  constraints = function(s) return { rd.drive { "cart_x", rd.smoothstep(s.t, 0, 0.76, 5), alpha = 0, beta = 0 } } end }
"""
ARM = """local rd = require "refdyn"
local law = function(s) return rd.smoothstep(s.t, 0, 1, %d) end
return rd.model { name = "arm", gravity = { 0, -9.81, 0 },
  links = { { "arm", joint = "psi", mass = 2, center = { 0.4, 0.05, 0 }, inertia = { zz = 0.5 } },
            { "fore", on = "arm", joint = "psi", at = { 0.8, 0, 0 }, mass = 1.3, center = { 0.3, 0, 0 }, inertia = { zz = 0.2 } } },
  constraints = function(s) return { rd.drive { "arm_psi", %g * law(s), alpha = 0, beta = 0 },
                                     rd.drive { "fore_psi", %g * law(s), alpha = 0, beta = 0 } } end }
"""
# A driven parallelogram: projection onto the rows of the loop makes its state exact, regardless of the error of the step.
LOOP = """local rd = require "refdyn"
return rd.model { name = "loop", gravity = { 0, -9.81, 0 },
  links = { { "crank", joint = "psi", mass = 2, center = { 0.4, 0.05, 0 }, inertia = { zz = 0.5 }, start = { psi = 0.5 } },
            { "coupler", on = "crank", joint = "psi", at = { 0.8, 0, 0 }, mass = 1.3, center = { 0.5, 0, 0 }, inertia = { zz = 0.2 }, start = { psi = -0.5 } },
            { "rocker", joint = "psi", at = { 1, 0, 0 }, mass = 1.3, center = { 0.5, 0, 0 }, inertia = { zz = 0.2 }, start = { psi = 0.5 } } },
  points = { A = { on = "coupler", at = { 1, 0, 0 } }, B = { on = "rocker", at = { 0.8, 0, 0 } } },
  constraints = function(s) return { rd.drive { "crank_psi", 0.5 + 1.4 * rd.smoothstep(s.t, 0, 1, 5), alpha = 0, beta = 0 },
                                     rd.position { s.points.A.x - s.points.B.x }, rd.position { s.points.A.y - s.points.B.y } } end }
"""
PRESCRIBED = {"loop": LOOP, "slide": SLIDE, "slow": ARM % (5, 1, 0.7), "fast": ARM % (5, 10, 13), "cubic": ARM % (3, 3, 2)}


@pytest.mark.parametrize("how", [[], ["--every", 1]], ids=["dense", "sparse"])
@pytest.mark.parametrize("name, methods", [("slide", "auto rk8 rodas6p"), ("slow", "rk8 rodas6p radau9"), ("fast", "auto rk8 gauss12"),
                                           ("cubic", "rk54 rodas6p"), ("loop", "auto rodas6p radau9")])
def test_balance_of_exact_steps(name, methods, how, tmp_path):
    """Steps on a prescribed polynomial are exact and few; their power is no polynomial. Energy and work balance nevertheless."""
    (tmp_path / "model.lua").write_text(PRESCRIBED[name])
    for method in methods.split():
        run, said, summary = motion(tmp_path / "model.lua", "--until", 1.3, "--method", method, *how)
        assert "balance: " not in said and (summary["energy_error"] or 0) < 1e-3, said
        assert method.startswith(("radau", "gauss")) or summary["steps"] <= 5
        if name == "slide":
            numpy.testing.assert_allclose(run["energy"], run["cart_x_d"]**2, rtol=1e-13, atol=1e-13)


COARSE = """local rd = require "refdyn"
return rd.model { name = "coarse", links = { { "cart", joint = "x", mass = 1.3, spring = { x = 130 }, start = { x = 0.3 } } },
  forces = function(s) return { cart_x = 7 * rd.sin(3 * s.t) - 0.4 * s.qd.cart_x } end }
"""


@pytest.mark.parametrize("method, step", [("rk4", 0.15), ("rk54", 0.2), ("rk8", 0.4)])
def test_balance_of_long_steps(method, step, tmp_path):
    """Fixed steps that are too long for the motion leave energy and work apart."""
    (tmp_path / "coarse.lua").write_text(COARSE)
    _, said, summary = motion(tmp_path / "coarse.lua", "--until", 3, "--method", method, "--step", step, "--every", step)
    assert "energy and work do not balance: the motion is not resolved" in said and summary["energy_error"] > 0.02, said


def test_balance_of_wrong_forces():
    """Forces that do not belong to the energy leave energy and work apart, whatever the accuracy."""
    free = [REFERENCE, "--set", "n_rfe=1", "--set", "program=none", "--set", "drive=input", "--until", 0.7]
    for tol in "1e-6", "1e-10":
        _, said, summary = motion(*free, "--set", "form=printed", "--tol", tol)
        assert "energy and work do not balance: the motion is not resolved" in said and summary["energy_error"] > 0.02, said


def test_verify_tells_chaos(tmp_path):
    """Within a minute, a double pendulum diverges at every tolerance, and the estimate says so."""
    (tmp_path / "high.json").write_text('{"q": [2.5, 2.5]}')
    _, said, summary = motion(PENDULUM, "--from", tmp_path / "high.json", "--until", 60, "--tol", "1e-4", "--verify")
    assert not summary["error"]["is_trusted"] and "not reliable" in said


@pytest.mark.parametrize("case", [RIGID, SWING, FLEXIBLE], ids=["rigid", "pendulum", "flexible"])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-8])
@pytest.mark.parametrize("method", ["rodas5p", "rk8"])
def test_accuracy(case, accuracy, method):
    run, said, summary = motion(*case, "--method", method, "--accuracy", accuracy)
    points, coordinates = errors(run, exact(case), summary)
    found = max(points.values() if points else coordinates.values())
    assert found <= accuracy * SCALE, f"{found:.1e} found"
    assert found / 10 <= summary["error"]["largest"] <= accuracy and summary["accuracy"] == accuracy
    assert 0 < summary["tol"] and summary["cpu_total_s"] >= summary["cpu_s"]


REST = """local rd = require "refdyn"
return rd.model {{ name = "rest", gravity = {{ 0, 0, -{g} }}, links = {{ {{ "m", joint = "x", mass = 1.3 }},
    {{ "p", on = "m", turn = {{ {{ "x", rd.pi / 2 }} }}, joint = "psi", mass = 0.8, center = {{ 0.3, 0, 0 }}, start = {{ psi = {psi} }} }} }},
  points = {{ E = {{ on = "p", at = {{ 0.3, 0, 0 }} }} }}, forces = function(s) return {{ m_x = -0.2 * rd.tanh(s.qd.m_x / 1e-3) }} end }}
"""


@pytest.mark.parametrize("method", ["auto", "rk54", "rk8", "radau9"])
def test_verify_trusts_a_body_at_rest(method, tmp_path):
    """Hanging, upright and without gravity: rounding and the errors of steps alone move it."""
    for g, psi, until in (9.81, "-rd.pi / 2", 3), (9.81, "rd.pi / 2", 1), (0, "0.7", 3):
        (tmp_path / "rest.lua").write_text(REST.format(g=g, psi=psi))
        for tol in "1e-4", "1e-10":
            _, said, summary = motion(tmp_path / "rest.lua", "--until", until, "--method", method, "--tol", tol, "--verify")
            assert summary["error"]["is_trusted"] and summary["error"]["largest"] < max(float(tol), 1e-7), (g, psi, said)


@pytest.mark.parametrize("method", ["auto", "rk54", "radau9"])
def test_stop_at_once(method, tmp_path):
    """A condition that holds right after the start stops within rounding of a step, at no time near the smallest numbers."""
    (tmp_path / "at_once.lua").write_text(REST.format(g=9.81, psi="0.3"))
    _, _, summary = motion(tmp_path / "at_once.lua", "--until", 1, "--method", method, "--stop", "p_psi_d<0")
    assert 1e-25 < summary["stop"]["t"] < 1e-12


CLOSE = [(TESTS / "models/double_pendulum.lua", "rk54", 3, 1e-3), (TESTS / "models/double_pendulum.lua", "rk54", 3, 1e-7),
         (PENDULUM, "auto", 2, 1e-5), (PENDULUM, "auto", 2, 1e-7), (MODELS / "jib.lua", "rk54", 5, 1e-7)]


@pytest.mark.parametrize("model, method, until, accuracy", CLOSE)
def test_accuracy_is_used(model, method, until, accuracy):
    """The error is near the requested one where a looser tolerance saves steps."""
    run, _, summary = motion(model, "--until", until, "--every", 0.05, "--method", method, "--accuracy", accuracy)
    exact_run, _, _ = motion(model, "--until", until, "--every", 0.05, "--tol", "1e-12")
    points, coordinates = errors(run, exact_run, summary)
    found = max(points.values() if points else coordinates.values())
    assert accuracy / 6 <= found <= accuracy and found / 2 <= summary["error"]["largest"] <= accuracy, found


def test_accuracy_compares_events(tmp_path):
    """A first run that misses a short event does not agree with the next one, which looks more closely."""
    (tmp_path / "narrow.lua").write_text("""local rd = require "refdyn"
local n = rd.input("n", 0)
return rd.model { name = "narrow", links = { { "m", joint = "x", mass = 2, start_rate = { x = 1.3 } } },
  events = function(s) return { rd.event { rd.exp(-((s.q.m_x / 1.3 - 7.21) / 0.04)^2) - 0.5, name = "short", inputs = { n = n + 1 } } } end }
""")
    for tolerance in ["--tol", "1e-4"], ["--accuracy", "1e-5"]:
        _, _, summary = motion(tmp_path / "narrow.lua", "--until", 10, *tolerance)
        assert summary["event_count"] == (0 if tolerance[0] == "--tol" else 2)
    assert summary["error"]["is_trusted"]


def test_accuracy_out_of_reach(tmp_path):
    """Below rounding: exit 3, the best error is reported, and its rows remain in the partial file."""
    done = refdyn("sim", *SWING, "--accuracy", "1e-17", "-o", tmp_path / "run.csv", status=3)
    assert "cannot be reached" in done.stderr and "best estimated error" in done.stderr, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv.part"]
    assert len(read_run(tmp_path / "run.csv.part")["t"]) == 11


@pytest.mark.parametrize("arguments", [["--accuracy", "1e-6", "--tol", "1e-6"], ["--accuracy", "1e-6", "--step", "1e-3"],
                                       ["--accuracy", "1e-6", "--method", "rk4"], ["--accuracy", "0"], ["--verify", "--tol", "1e-15"],
                                       ["--step-max", "1e-3", "--step", "1e-3"]], ids=" ".join)
def test_errors_that_do_not_go_together(arguments, tmp_path):
    done = refdyn("sim", PENDULUM, "--until", "1", *arguments, "-o", tmp_path / "run.csv", status=2)
    assert "usage: refdyn sim" in done.stderr and not list(tmp_path.iterdir())


# ---- Sampled inputs ----

CART = """local rd = require "refdyn"
rd.input("push", 0, "N")
rd.input("pull", 0, "N")
return rd.model { name = "cart", links = { { "cart", joint = { "x" }, mass = 2 } },
  forces = function(s) return { cart_x = s.inputs.push - s.inputs.pull } end, points = { P = "cart" } }
"""
SAMPLES = [(0.1, 4), (0.25, -6), (0.5, 0), (0.9, 10)]


def cart(folder, samples="t,note,push\n" + "".join(f"{t},{9 * i},{value}\n" for i, (t, value) in enumerate(SAMPLES))):
    (folder / "cart.lua").write_text(CART)
    (folder / "samples.csv").write_text(samples)
    return folder / "cart.lua", "--inputs", folder / "samples.csv"


def pushed(t):
    """x and its rate at t: the first value is valid from the start on, the last one to the end."""
    x = v = at = 0
    for i, (_, value) in enumerate(SAMPLES):
        end = min(t, SAMPLES[i + 1][0] if i + 1 < len(SAMPLES) else math.inf)
        if end > at:
            x, v, at = x + v * (end - at) + value / 4 * (end - at)**2, v + value / 2 * (end - at), end
    return x, v


@pytest.mark.parametrize("how", [("--tol", "1e-2"), ("--method", "rk54"), ("--method", "rk8"), ("--step", "0.3"),
                                 ("--method", "rodas6p", "--step", "0.07")], ids=" ".join)
def test_inputs(how, tmp_path):
    """Constant between samples, so the motion is piecewise polynomial: exact with any step, since steps end at the samples."""
    run, _, summary = motion(*cart(tmp_path), "--until", 1.3, "--every", 0.05, *how)
    expected = numpy.array([pushed(t) for t in run["t"]]).T
    held = [([value for t, value in SAMPLES if t <= at] or [4])[-1] for at in run["t"]]
    check([f"{name} differs by {abs(run[name] - values).max():.1e}"
           for name, values in {"cart_x": expected[0], "cart_x_d": expected[1]}.items() if abs(run[name] - values).max() > 1e-12 * SCALE])
    # At a sample the row has the new value.
    assert list(run["push"]) == held and abs(run["P_xdd"] - numpy.array(held) / 2).max() < 1e-14 and set(run["pull"]) == {0}
    assert summary["energy_error"] <= 1e-12 * SCALE


def test_byte_order_marks(tmp_path):
    """UTF-8 byte order marks at the beginning of a model and of its samples are ignored."""
    arguments = *cart(tmp_path), "--until", 1.3
    plain, _, _ = motion(*arguments)
    for path in tmp_path / "cart.lua", tmp_path / "samples.csv":
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    marked, _, _ = motion(*arguments)
    assert plain.keys() == marked.keys() and all((plain[name] == marked[name]).all() for name in plain)
    (tmp_path / "cart.lua").write_bytes(b"\xef\xbb\xbf" + CART.replace("mass = 2", "mass = -2").encode())
    assert refdyn("check", tmp_path / "cart.lua", status=1).stderr.startswith(f"{tmp_path}/cart.lua:4: ")


def test_auto_with_many_samples(tmp_path):
    """The next sample is not the end of the motion: a stiff motion nevertheless gets an implicit method."""
    samples = tmp_path / "samples.csv"
    samples.write_text("t,tau\n" + "".join(f"{i / 1000},{i % 7 / 10}\n" for i in range(301)))
    _, _, summary = motion(REFERENCE, "--set", "eta=1.3e-3", "--set", "drive=input", "--inputs", samples, "--until", "0.3",
                           "--method", "auto")
    assert summary["steps"] < 1500, f"{summary['steps']} steps"


@pytest.mark.quick
def test_inputs_of_a_run(tmp_path):
    """The CSV of a motion is a file of samples: its inputs drive another motion."""
    first, _, _ = motion(*cart(tmp_path), "--until", 1.3, "--every", 0.05)
    refdyn("sim", *cart(tmp_path), "--until", 1.3, "--every", 0.05, "-o", tmp_path / "first.csv")
    again, _, _ = motion(tmp_path / "cart.lua", "--inputs", tmp_path / "first.csv", "--until", 1.3, "--every", 0.05)
    assert abs(again["cart_x"] - first["cart_x"]).max() < 1e-13


def test_many_samples_verified(tmp_path):
    """--verify halves steps that samples cut short: its estimate still matches the error."""
    t = numpy.arange(0, 1, 1e-2)
    text = "t,push\n" + "".join(f"{float(at)!r},{float(20 * math.sin(7 * at))!r}\n" for at in t)
    model, *given = cart(tmp_path, text)
    model.write_text(CART.replace("s.inputs.pull", "300*rd.sin(s.q.cart_x)"))
    common = [model, *given, "--until", 1, "--every", 0.1]
    run, _, summary = motion(*common, "--method", "ros34pw2", "--tol", "1e-2", "--verify")
    fine, _, _ = motion(*common, "--method", "rk8", "--tol", "1e-12")
    found = abs(run["P_x"] - fine["P_x"]).max()
    assert found > 1e-12 and found / 10 <= summary["error"]["largest"] <= 10 * found


BAD_SAMPLES = {
    "empty": ("", 1), "no time": ("push\n1\n", 1), "no input": ("t,force\n0,1\n", 1), "no sample": ("t,push\n", 1), "text": ("t,push\n0,1\n1,one\n", 3),
    "short": ("t,push\n0\n", 2), "long": ("t,push\n0,1,2\n", 2), "not finite": ("t,push\n0,nan\n", 2), "back": ("t,push\n1,0\n1,2\n", 3),
    "twice": ("t,push,push\n0,1,1\n", 1), "blank field": ("t,push\n0,\n", 2),
}


@pytest.mark.parametrize("which", BAD_SAMPLES)
def test_bad_inputs(which, tmp_path):
    text, line = BAD_SAMPLES[which]
    done = refdyn("sim", *cart(tmp_path, text), "--until", 1, "-o", tmp_path / "run.csv", status=1)
    assert re.search(rf"^[^\n]*samples\.csv:{line}: inputs: .+", done.stderr, re.M), done.stderr
    assert not (tmp_path / "run.csv").exists()


def test_inputs_of_a_model_without(tmp_path):
    (tmp_path / "samples.csv").write_text("t,push\n0,1\n")
    done = refdyn("sim", PENDULUM, "--inputs", tmp_path / "samples.csv", "--until", 1, status=1)
    assert "the model has no inputs" in done.stderr
    done = refdyn("sim", PENDULUM, "--inputs", tmp_path / "none.csv", "--until", 1, status=1)
    assert "none.csv" in done.stderr


# ---- Conditions that end a motion ----

@pytest.mark.parametrize("how", [("--tol", "1e-2"), ("--method", "rk54"), ("--method", "rk8", "--tol", "1e-3"), ("--step", "0.3"),
                                 ("--method", "ros34pw2", "--step", "0.07")], ids=" ".join)
@pytest.mark.parametrize("condition, at", [("cart_x>0.03", 0.03**0.5), ("cart_x_d<-0.1", 0.25 + 0.2), ("t>0.77", 0.77),
                                           ("push<0", 0.25), ("P_xdd<-1", 0.25), ("energy>0.2", math.sqrt(0.2) / 2)])
def test_stop(how, condition, at, tmp_path):
    """The time at which the condition first becomes true, to rounding; jumps of inputs count with their later side."""
    run, said, summary = motion(*cart(tmp_path), "--until", 2, "--every", 0.04, *how, "--stop", condition)
    assert summary["stop"]["condition"] == condition and run["t"][-1] == summary["stop"]["t"]
    assert abs(run["t"][-1] - at) <= 1e-13 * SCALE, f"{run['t'][-1]!r}, not {at!r}"
    assert f"stopped      {condition}" in said
    assert (numpy.diff(run["t"]) > 0).all() and abs(run["t"][:-1] / 0.04 - numpy.round(run["t"][:-1] / 0.04)).max() < 1e-9
    name, value = re.split("[<>]", condition)
    assert run[name][-1] < float(value) if "<" in condition else run[name][-1] > float(value)
    assert not (run[name][:-1] < float(value) if "<" in condition else run[name][:-1] > float(value)).any()


@pytest.mark.quick
def test_stop_between_outputs(tmp_path):
    """A swing that returns before the next output is detected at the ends of steps; the error is reported up to the end."""
    whole, _, _ = motion(PENDULUM, "--until", 3, "--every", 0.001)
    name = next(name for name in whole if name not in ("t", "energy"))
    value = 0.98 * abs(whole[name]).max() * (1 if whole[name].max() > -whole[name].min() else -1)
    beyond = whole[name] > value if value > 0 else whole[name] < value
    first = whole["t"][numpy.argmax(beyond)]
    run, _, summary = motion(PENDULUM, "--until", 3, "--every", 3, "--stop", f"{name}{'>' if value > 0 else '<'}{value}", "--verify")
    assert len(run["t"]) == 2 and 0 <= first - run["t"][1] <= 0.001 and summary["error"]["is_trusted"]
    assert summary["error"]["t"] == list(run["t"])


def test_stop_of_an_accurate_motion():
    """Runs of --accuracy end at different times: only common outputs are compared."""
    name, at = "E_z", exact([*SWING[:-1], 0.01])
    value = (at["E_z"][0] + at["E_z"].min()) / 2
    first = at["t"][numpy.argmax(at["E_z"] < value)]
    run, _, summary = motion(*SWING[:-1], 0.01, "--accuracy", "1e-8", "--stop", f"{name}<{float(value)!r}")
    assert 0 <= first - run["t"][-1] <= 0.01 and abs(run[name][-1] - value) < 1e-12
    assert summary["error"]["t"] == list(run["t"])[:-1] and summary["error"]["largest"] <= 1e-8


def test_stop_at_the_start(tmp_path):
    run, _, summary = motion(PENDULUM, "--until", 1, "--stop", "t<1")
    assert list(run["t"]) == [0] and summary["stop"] == {"condition": "t<1", "t": 0} and summary["steps"] == 0


def test_stop_that_is_not_reached():
    run, said, summary = motion(PENDULUM, "--until", 1, "--stop", "t>1", "--stop", "energy>1e9")
    assert run["t"][-1] == 1 and "stop" not in summary and "stopped" not in said


@pytest.mark.parametrize("condition", ["energy", "energy<", "<1", "energy<one", "energi<1", "energy=1", "energy<nan"])
def test_wrong_stop(condition, tmp_path):
    done = refdyn("sim", PENDULUM, "--until", 1, "--stop", condition, "-o", tmp_path / "run.csv", status=2)
    assert "--stop" in done.stderr and not list(tmp_path.iterdir())
    assert ("nearest is energy" in done.stderr) == (condition == "energi<1")


# ---- Stabilisation and summary ----

def test_gains_from_the_step():
    """Residuals stay far below those without stabilisation, regardless of the model's gains; the step determines the gains."""
    common = [REFERENCE, "--set", "n_rfe=1", "--until", 10, "--method", "rodas5p", "--tol", "1e-6"]
    held = {how: motion(*common, "--stabilise", how)[2] for how in ("none", "baumgarte-auto")}
    assert held["baumgarte-auto"]["stabilise"] == "baumgarte-auto"
    assert held["baumgarte-auto"]["phi_max"] < held["none"]["phi_max"] / 5
    off, _, _ = motion(REFERENCE, "--set", "n_rfe=1", "--set", "program=chapter", "--until", 1, "--every", 0.5, "--step", "1e-3",
                       "--stabilise", "baumgarte-auto")
    assert abs(off["phi_1"][0]) > 1 and abs(off["phi_1"][1]) < 1e-3


def test_rows_without_gains(tmp_path):
    model = tmp_path / "ring.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "ring", gravity = { 0, 0, -9.81 },\n'
                     '  links = { { "bob", joint = { "x", "z" }, mass = 1, start = { x = 1 } } }, points = { E = "bob" },\n'
                     "  constraints = function(s) return { rd.position { s.points.E.x^2 + s.points.E.z^2 - 1, name = \"ring\" } } end }\n")
    for how, is_told in (("baumgarte", True), ("baumgarte-auto", False), ("project", False), ("none", False)):
        done = refdyn("sim", model, "--until", 0.1, "--stabilise", how, "-o", tmp_path / "run.csv")
        assert ("no row has gains" in done.stderr) == is_told, done.stderr


@pytest.mark.quick
def test_summary_of_rows():
    _, said, summary = motion(*RIGID)
    assert summary["phi_row"] in said and summary["psi_row"] in said
    assert 0 < summary["pivot_min"] <= 1 <= summary["condition_max"] and summary["partition_changes"] >= 0
    assert summary["tangents"] > 0 and summary["step_smallest"] <= summary["step_largest"]
    assert json.dumps(summary)
