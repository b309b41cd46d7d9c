"""Derivatives of whole motions (`sim --derivatives`): closed forms, emitted steps, tight runs, lanes; where they do not exist."""
import csv
import json
import random
import re

import numpy
import pytest

from program import LONG, MODELS, REFERENCE, SOURCE, TESTS, refdyn, settings
from random_scenes import damped_scene, eventful_scene
from test_step import Stepper

BALL = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "H", 1.3, "m" }}, {{ "e", 0.8, "1" }}, {{ "g", 9.81, "m/s^2" }} }}
return rd.model {{
  name = "ball", gravity = {{ 0, 0, -p.g }},
  links = {{ {{ "ball", joint = "z", mass = 2, start = {{ z = p.H }} }} }},
  events = function(s) return {{ rd.event {{ s.q.ball_z, restitution = p.e, name = "floor"{more} }} }} end,
}}"""
# Two slides: a force that ends at T, the same as a value that changes its sign there, and one that grows from T0 on.
BREAK = """local rd = require "refdyn"
local p = rd.parameters { { "T", 0.6, "s" }, { "F", 3, "N" }, { "T0", 0, "s" }, { "m", 1.5, "kg" }, { "d", 0.7, "N s/m" } }
return rd.model {
  name = "breaks", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = p.m, damper = { x = p.d } }, { "b", joint = "x", mass = p.m, damper = { x = p.d } },
            { "c", joint = "x", mass = p.m, damper = { x = p.d } } },
  forces = function(s)
    return { a_x = rd.where(rd.less(s.t, p.T), p.F, 0), b_x = rd.where(rd.less(rd.sin(s.t), rd.sin(p.T)), p.F, 0), c_x = rd.where(rd.less(s.t, p.T0), p.F, 1) }
  end,
}"""


def derive(model, *arguments, names, folder, kind="csv", status=0):
    """The columns of a motion with its derivatives, and what the program said."""
    out = folder / f"derived.{kind}"
    done = refdyn("sim", model, *arguments, "--derivatives", ",".join(names), "-o", out, status=status)
    with open(out) as file:
        rows = list(csv.DictReader(file))
    return {name: numpy.array([float(row[name]) for row in rows]) for name in rows[0]}, done.stderr


def written(folder, name, text):
    path = folder / f"{name}.lua"
    path.write_text(text)
    return path


def largest(a, b):
    """The largest difference, relative to the largest value."""
    return numpy.max(numpy.abs(a - b)) / numpy.max(numpy.abs(b))


def complex_step(function, values, name):
    return function(**{**values, name: values[name] + 1e-30j}).imag / 1e-30


# ---- Closed forms ----

def ball_height(t, H, e, g):
    """After two impacts."""
    speed = (2 * g * H) ** 0.5
    second = (2 * H / g) ** 0.5 + 2 * e * speed / g
    return e * e * speed * (t - second) - g / 2 * (t - second) ** 2


@pytest.mark.parametrize("method", ["rk8", "rk54", "radau9", "rodas5p", "auto"])
def test_through_two_impacts(method, tmp_path):
    values = {"H": 1.3, "e": 0.8, "g": 9.81}
    found, said = derive(written(tmp_path, "ball", BALL.format(more="")), "--until", 1.8, "--method", method, names=list(values), folder=tmp_path)
    assert "warning" not in said
    late = found["t"] > 1.5  # the second impact is at 1.34 s
    for name in values:
        exact = numpy.array([complex_step(lambda **v: ball_height(t, **v), values, name) for t in found["t"]])
        assert largest(found[f"d_ball_z_by_{name}"][late], exact[late]) < 1e-7


def test_last_output_is_at_the_event_that_ends(tmp_path):
    """The derivatives of the last row include the change of its time."""
    model = written(tmp_path, "ball", BALL.format(more=", ends = true"))
    found, said = derive(model, "--until", 3, "--set", "e=0.5", names=["H", "g", "ball_z_d"], folder=tmp_path)
    assert "warning" not in said
    H, g = 1.3, 9.81
    t = (2 * H / g) ** 0.5
    assert abs(found["t"][-1] - t) < 1e-12
    exact = {"H": t / (2 * H), "g": -t / (2 * g), "ball_z_d": 1 / g}
    for name, value in exact.items():
        assert abs(found[f"d_t_by_{name}"][-1] / value - 1) < 1e-7
        assert abs(found[f"d_ball_z_by_{name}"][-1]) < 1e-9
        assert numpy.all(found[f"d_t_by_{name}"][:-1] == 0)
    assert abs(found["d_ball_z_d_by_H"][-1] / -((g / (2 * H)) ** 0.5) - 1) < 1e-7


@pytest.mark.parametrize("method", ["rk8", "radau9", "rodas5p", "gauss12", "rk4"])
def test_time_of_a_break(method, tmp_path):
    """Fractions between time events: the time at which a force ends, known or found by a change of sign."""
    model = written(tmp_path, "breaks", BREAK)
    fixed = ["--step", 0.01] if method == "rk4" else ["--method", method]
    found, said = derive(model, "--until", 1, "--every", 0.025, *fixed, names=["T", "F", "m", "d"], folder=tmp_path)
    T, F, m, d = 0.6, 3, 1.5, 0.7

    def x(t, T, F, m, d):
        v = lambda t: F / d * (1 - numpy.exp(-d / m * t))
        y = lambda t: F / d * (t - m / d * (1 - numpy.exp(-d / m * t)))
        return y(t) if t <= 0.6 else y(T) + v(T) * m / d * (1 - numpy.exp(-d / m * (t - T)))
    values = {"T": T, "F": F, "m": m, "d": d}
    for name in values:
        exact = numpy.array([complex_step(lambda **v: x(t, **v), values, name) for t in found["t"]])
        for slide in "ab":
            column, row = found[f"d_{slide}_x_by_{name}"], int(round(T / 0.025))
            assert largest(numpy.delete(column, row), numpy.delete(exact, row)) < 1e-6, (slide, name)
            assert abs(column[row] - exact[row]) < 1e-5 * numpy.max(numpy.abs(exact))  # the curvature differs between the sides
    # The acceleration jumps at its own output, at T.
    assert numpy.isnan(found["d_a_x_dd_by_T"][row]) and numpy.isfinite(numpy.delete(found["d_a_x_dd_by_T"], row)).all()
    assert re.search(r"warning: --derivatives T: \d+ values jump at an output at which an event happens, the first at t = 0.6", said), said
    assert not numpy.isnan(found["d_a_x_dd_by_F"]).any()


# ---- The reference manipulator, and tight runs ----

@pytest.mark.parametrize("eta, method, bound", [(1.3e-3, "radau9", 1e-5), (0.0, "gauss12", 1e-3)], ids=["damped", "undamped"])
def test_compared_with_emitted_steps(eta, method, bound, tmp_path):
    """n_rfe = 4, tol 1e-6, 1 s: the chain of emitted steps has no projections and no error control."""
    setting = settings({"n_rfe": 4, "eta": eta})
    stepper = Stepper((REFERENCE, setting), tmp_path)
    failed, end, exact = stepper.step("gauss", 0.0, 1 / 1600, 1600, stepper.model.start, has_derivatives=True)
    assert not failed
    names = ["E", "eta", "m_E"]
    found, said = derive(REFERENCE, *setting, "--until", 1, "--method", method, "--tol", 1e-6, names=names, folder=tmp_path)
    assert "warning" not in said
    order = re.findall(r"^    double (\w+);", re.search(r"struct manipulator_parameters \{(.*?)^\};", (tmp_path / "manipulator.h").read_text(), re.S | re.M)[1], re.M)
    coordinates = [name[:-2] for name in found if name.endswith("_d") and name[:-2] in found][:stepper.n]
    for name in names:
        column = exact["p"][:, order.index(name)]
        n = len(coordinates)
        q = numpy.array([found[f"d_{c}_by_{name}"][-1] for c in coordinates])
        qd = numpy.array([found[f"d_{c}_d_by_{name}"][-1] for c in coordinates])
        assert largest(q, column[:n]) < bound and largest(qd, column[n:]) < bound, name


# Scenes with rows, impacts, contacts, actions of events, time events: file, end, names. Each run has random values near the model's.
SCENES = [
    (MODELS / "fourbar.lua", 1.1, ["a", "g", "rho", "torque"]), (MODELS / "crane.lua", 0.9, ["E", "rope", "m"]),
    (MODELS / "slidercrank.lua", 0.6, ["E", "m_slider", "T"]), (MODELS / "gantry.lua", 0.8, ["m_load", "reach_x", "T"]),
    (TESTS / "models" / "events" / "pendulum.lua", 1.3, ["e", "wall"]), (TESTS / "models" / "events" / "crane.lua", 3, ["e", "rail"]),
    (TESTS / "models" / "switched.lua", 0.9, ["at", "push", "stiffness", "begin"]), (MODELS / "jib.lua", 0.5, ["E"]),
    (TESTS / "models" / "contacts" / "ball.lua", 1.0, []), (TESTS / "models" / "events" / "spring.lua", 1.0, []),
]


def parameters_of(model):
    return {name: float(value) for name, value in re.findall(r'\{ ?"(\w+)", (-?[\d.]+(?:e[-+]?\d+)?)', model.read_text())}


@pytest.mark.parametrize("number", range(0, len(SCENES), 1 if LONG else 2), ids=lambda i: SCENES[i][0].stem)
def test_compared_with_differences_of_tight_runs(number, tmp_path):
    model, until, names = SCENES[number]
    random = numpy.random.default_rng(number)
    method = ["rk8", "radau9", "auto", "rodas5p"][number % 4]
    known = parameters_of(model)
    values = {name: known[name] * (1 + 0.05 * random.uniform(-1, 1)) for name in names or list(known)[:2] if name in known}
    every = until / 7.3
    found, said = derive(model, *settings(values), "--until", until, "--every", every, "--method", method, "--tol", 1e-8, names=list(values),
                         folder=tmp_path)
    assert "warning: --derivatives" not in said
    columns = [name[:-2] for name in found if name.endswith("_d") and name[:-2] in found]
    columns += [f"{name}_d" for name in columns]
    # Control of errors gives the two sides of an undamped beam other steps, whose noise vibrations amplify.
    accuracy = ["--method", "gauss12", "--step", 5e-4] if model == MODELS / "crane.lua" else ["--tol", 1e-12]
    for name, value in values.items():
        change = (1e-5 if name == "E" else 1e-4) * abs(value)  # vibrations respond to E by their phases
        sides = []
        for side in (value + change, value - change):
            refdyn("sim", model, *settings({**values, name: side}), "--until", until, "--every", every, *accuracy, "-o", tmp_path / "side.csv")
            with open(tmp_path / "side.csv") as file:
                sides.append(list(csv.DictReader(file)))
        for column in columns:
            exact = numpy.array([(float(a[column]) - float(b[column])) / (2 * change) for a, b in zip(*sides)])
            size = max(numpy.max(numpy.abs(exact)), 1e-5 * numpy.max(numpy.abs(found[column])) / abs(value), 1e-9 / abs(value))
            assert numpy.max(numpy.abs(found[f"d_{column}_by_{name}"] - exact)) < 5e-4 * size, (column, name)


def test_kinks_that_steps_meet_by_chance(tmp_path):
    """The force of a motor saturates. A step may end just before this kink, so that the next one passes it without an event."""
    model, arguments = SOURCE / "docs" / "control" / "motor.lua", ["--until", 0.1, "--every", 0.002, "--tol", 1e-10]
    for R in numpy.linspace(0.8, 1.1, 120 if LONG else 30):
        found, said = derive(model, "--set", f"R={R}", *arguments, names=["R", "i"], folder=tmp_path)
        assert "warning" not in said, (R, said)
        sides = [derive(model, "--set", f"R={R + change}", *arguments, names=["J"], folder=tmp_path)[0]["rotor_psi_d"] for change in (1e-5, -1e-5)]
        assert largest(found["d_rotor_psi_d_by_R"], (sides[0] - sides[1]) / 2e-5) < 1e-5


# Slides on a base with friction that saturates: its kinks refuse steps, so that short ones lead to them. An impact, an event that sets an input.
KINKS = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1.27, "kg" }, { "T", 0.41, "s" }, { "e", 0.77 }, { "stop", 0.21 }, { "gap", 0.02 }, { "A", 1.4 }, { "mu", 0.41 } }
local tau = rd.input("tau", 2.1, "N m")
return rd.model {
  name = "kinks", gravity = { 0, 0.4, -9.81 },
  links = {
    { "base", joint = "psi,z", mass = p.m, inertia = { zz = 0.05 }, spring = { z = 900, psi = 49.3 }, damper = { z = 9, psi = 0.66 }, start = { psi = 0.21 } },
    { "left", on = "base", at = { 0.2, 0.1, 0 }, joint = "theta", mass = 0.9, center = { 0.01, 0, -0.2 }, inertia = { yy = 0.03 }, start = { theta = -0.6 } },
    { "slide", on = "left", at = { 0, 0, -0.2 }, joint = "x", mass = 0.3, spring = { x = 60 }, damper = { x = 0.5 } },
    { "right", on = "base", at = { -0.2, 0.05, 0 }, joint = "phi", mass = 0.5, center = { 0, 0, -0.25 }, inertia = { xx = 0.01 }, start = { phi = 0.5 } },
  },
  forces = function(s)
    return { base_psi = tau * rd.where(rd.less(s.t, p.T), 1, -0.4),
             right_phi = -p.mu * rd.max(-1, rd.min(1, s.qd.right_phi / 0.1)) + p.A * rd.where(rd.less(s.t, p.T + 0.33), 0, rd.sin(5 * s.t)) }
  end,
  events = function(s)
    return { rd.event { p.stop - s.q.left_theta, restitution = p.e, name = "stop" },
             rd.event { s.q.slide_x - p.gap, direction = "up", inputs = { tau = tau - 0.9 }, name = "switch" } }
  end,
}"""


@pytest.mark.parametrize("method, tol", [("rk54", 1e-8), ("rodas5p", 1e-8), ("rodas6p", 1e-7), ("radau9", 1e-9)])
def test_short_steps_to_kinks(method, tol, tmp_path):
    """Refused steps leave short ones near a kink, which moves farther than these in the copies. Two copies of each value suffice."""
    model, summary = written(tmp_path, "kinks", KINKS), tmp_path / "summary.json"
    arguments, values = ["--until", 1.4, "--every", 0.07], {"m": 1.27, "T": 0.41, "e": 0.77, "stop": 0.21, "gap": 0.02, "A": 1.4, "mu": 0.41, "tau": 2.1}
    found, said = derive(model, *arguments, "--method", method, "--tol", tol, "--summary", summary, names=list(values), folder=tmp_path)
    assert "warning" not in said
    assert json.loads(summary.read_text())["derivatives"]["motions"] == 2 * len(values) + 1  # one of them without a change
    columns = [name[:-2] for name in found if name.endswith("_d") and name[:-2] in found]
    for name, value in values.items():
        sides = [derive(model, *arguments, "--tol", 1e-12, "--set", f"{name}={value * (1 + change)!r}", names=["m"], folder=tmp_path)[0] for change in (1e-4, -1e-4)]
        exact = {column: (sides[0][column] - sides[1][column]) / (2e-4 * value) for column in columns}
        size = max(numpy.max(numpy.abs(column)) for column in exact.values())
        for column in columns:
            assert numpy.max(numpy.abs(found[f"d_{column}_by_{name}"] - exact[column])) < 1e-3 * size, (name, column)


def test_start_off_the_programme(tmp_path):
    """Under Baumgarte's stabilisation, copies begin like the motion: moved onto the programme."""
    arguments = ["--until", 0.4, "--every", 0.1, "--stabilise", "baumgarte", "--start", "project"]
    found, _ = derive(MODELS / "fourbar.lua", *arguments, "--set", "a=0.19", "--method", "radau9", "--tol", 1e-8, names=["a", "torque"], folder=tmp_path)
    sides = [derive(MODELS / "fourbar.lua", *arguments, "--set", f"a={0.19 + change}", "--tol", 1e-12, names=["g"], folder=tmp_path)[0] for change in (1e-5, -1e-5)]
    for name in ("crank_psi", "crank_psi_d", "coupler_psi"):
        assert largest(found[f"d_{name}_by_a"], (sides[0][name] - sides[1][name]) / 2e-5) < 1e-5, name


METHODS = ["rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]


@pytest.mark.parametrize("place", [0.5, 0.4713])
@pytest.mark.parametrize("method", METHODS)
def test_force_that_begins_at_a_place(method, place, tmp_path):
    """The last stage of a step to the jump keeps its side: x = t + F/2m (t - P)^2, v = 1 + F/m (t - P)."""
    model = written(tmp_path, "jump", f"""local rd = require "refdyn"
local p = rd.parameters {{ {{ "P", {place}, "m" }}, {{ "F", 3, "N" }} }}
return rd.model {{
  name = "jump", gravity = {{ 0, 0, 0 }},
  links = {{ {{ "a", joint = "x", mass = 2, start_rate = {{ x = 1 }} }} }},
  forces = function(s) return {{ a_x = rd.where(rd.less(s.q.a_x, p.P), 0, p.F) }} end,
}}""")
    found, said = derive(model, "--until", 1, "--every", 0.15, "--method", method, names=["P", "F"], folder=tmp_path)
    assert "warning" not in said
    after = numpy.maximum(found["t"] - place, 0)
    exact = {"a_x_by_P": -1.5 * after, "a_x_by_F": after ** 2 / 4, "a_x_d_by_P": -1.5 * (after > 0), "a_x_d_by_F": after / 2}
    for name, values in exact.items():
        assert largest(found[f"d_{name}"], values) < 1e-6, name


def test_value_at_its_largest(tmp_path):
    """A restitution of 1 changes to one side only, also where the first change is too large."""
    values = {"H": 130, "e": 1, "g": 9.81}
    model = written(tmp_path, "ball", BALL.format(more="").replace("events =", "constraints =").replace("rd.event", "rd.contact"))
    found, said = derive(model, "--until", 16, "--every", 16, *settings(values), names=list(values), folder=tmp_path)
    assert "warning" not in said
    for name in values:
        exact = complex_step(lambda **v: ball_height(16.0, **v), values, name)
        assert abs(found[f"d_ball_z_by_{name}"][-1] / exact - 1) < 1e-5, name


# ---- Lanes and threads ----

@pytest.mark.parametrize("seed", range(10 if LONG else 3))
def test_ten_random_damped_scenes(seed, tmp_path):
    """At tol 1e-10, derivatives agree with central differences of fourth order of free motions, to 1e-5 of the largest derivative."""
    text, values = damped_scene(seed)
    model, change = written(tmp_path, "random", text), 1e-3
    arguments = ["--until", 0.6, "--tol", 1e-10, "--every", 0.02]
    derived, said = derive(model, *arguments, names=list(values), folder=tmp_path)
    assert "no derivative" not in said and len(values) >= 6

    def free(name, factor):
        refdyn("sim", model, *arguments, "--set", f"{name}={values[name] * (1 + factor * change)!r}", "-o", tmp_path / "free.csv")
        with open(tmp_path / "free.csv") as file:
            rows = list(csv.DictReader(file))
        return {column: numpy.array([float(row[column]) for row in rows]) for column in rows[0]}

    for name in values:
        runs = {factor: free(name, factor) for factor in (-2, -1, 1, 2)}
        for column in runs[1]:
            if not column.endswith(("_d", "_dd")) and column != "energy" and f"{column}_d" not in runs[1]:
                continue
            slope = (8 * (runs[1][column] - runs[-1][column]) - runs[2][column] + runs[-2][column]) / (12 * change * values[name])
            found = derived[f"d_{column}_by_{name}"]
            size = max(numpy.max(numpy.abs(derived[f"d_{column}_by_{other}"])) * values[other] for other in values) / values[name]
            assert numpy.max(numpy.abs(found - slope)) < 1e-5 * size, (name, column)


# Left out: 7 ends early; 47 has an event 4e-7 s after an output.
EVENTFUL = sorted(set(range(60)) - {7, 47}) if LONG else [0, 8, 10, 11, 12, 17, 22, 27]


@pytest.mark.parametrize("seed", EVENTFUL)
def test_random_scenes_with_kinks_and_events(seed, tmp_path):
    """Saturating friction, forces that begin at a place or a time, impacts, contacts, rows; by all methods in turn."""
    text, values = eventful_scene(seed)
    model, rng = written(tmp_path, "random", text), random.Random(seed)
    arguments = ["--until", 0.9, "--every", 0.0713, "--start", "project"]
    names = rng.sample(sorted(values), min(4, len(values)))
    derived, said = derive(model, *arguments, "--method", (["auto"] + METHODS)[seed % 8], "--tol", 1e-8 if seed % 3 else 1e-6, names=names, folder=tmp_path)
    assert "warning: --derivatives" not in said, said
    columns = [column for column in derived if f"{column}_d" in derived]
    columns += [f"{column}_d" for column in columns]
    for name in names:
        slopes = []
        for change in (1e-4 * values[name], 1e-5 * values[name]):
            runs = []
            for side in (change, -change):
                refdyn("sim", model, *arguments, "--tol", 1e-12, "--set", f"{name}={values[name] + side!r}", "-o", tmp_path / "side.csv")
                with open(tmp_path / "side.csv") as file:
                    runs.append(list(csv.DictReader(file)))
            slopes.append({column: numpy.array([(float(a[column]) - float(b[column])) / (2 * change) for a, b in zip(*runs)]) for column in columns})
        size = max(numpy.max(numpy.abs(slope)) for slope in slopes[1].values()) + 1e-9 / abs(values[name])
        for column in columns:
            error = numpy.minimum(*(numpy.abs(derived[f"d_{column}_by_{name}"] - slope[column]) for slope in slopes))
            assert numpy.max(error) < 1e-3 * size, (name, column)


def test_widths_agree_to_the_bit(tmp_path):
    names = ["E", "eta", "m_E", "a", "arm_psi", "arm_psi_d", "column_psi_d"]
    texts = []
    for width in (2, 4, 8):
        derive(REFERENCE, "--set", "n_rfe=2", "--set", "eta=1e-3", "--until", 0.3, "--method", "radau9", "--lanes", width, names=names, folder=tmp_path)
        texts.append((tmp_path / "derived.csv").read_text())
    assert texts[0] == texts[1] == texts[2]


def test_motion_itself_is_the_same(tmp_path):
    """The columns of the motion are those of a call without --derivatives."""
    refdyn("sim", MODELS / "fourbar.lua", "--until", 0.5, "-o", tmp_path / "plain.csv")
    derive(MODELS / "fourbar.lua", "--until", 0.5, names=["a", "torque"], folder=tmp_path)
    plain, derived = [(tmp_path / name).read_text().splitlines() for name in ("plain.csv", "derived.csv")]
    assert all(b.startswith(a + ",") for a, b in zip(plain, derived, strict=True))


def test_hdf5_and_summary_hold_the_same_derivatives(tmp_path):
    """/derivatives/COLUMN/NAME has the numbers of the CSV's d_COLUMN_by_NAME; the summary says what they cost."""
    h5py = pytest.importorskip("h5py")
    names = ["a", "crank_psi_d"]
    found, _ = derive(MODELS / "fourbar.lua", "--until", 0.3, names=names, folder=tmp_path)
    refdyn("sim", MODELS / "fourbar.lua", "--until", 0.3, "--derivatives", ",".join(names), "-o", tmp_path / "run.h5", "--summary", tmp_path / "summary.json")
    with h5py.File(tmp_path / "run.h5") as file:
        stored = {f"d_{column}_by_{name}": values[()] for column, group in file["derivatives"].items() for name, values in group.items()}
        units = {name: values.attrs.get("units") for name, values in file["derivatives/crank_psi_d"].items()}
        assert units == {"a": "rad/s/m", "crank_psi_d": "1"} and file["derivatives/energy/crank_psi_d"].attrs["units"] == "J/(rad/s)"
        assert "units" not in file["derivatives/phi_1/a"].attrs
    assert stored.keys() == {name for name in found if name.startswith("d_")} and len(stored) > 10
    for name, values in stored.items():
        assert numpy.array_equal(values, found[name]), name
    cost = json.loads((tmp_path / "summary.json").read_text())["derivatives"]
    assert cost["by"] == names and cost["motions"] == 4 and 0 < cost["cpu_s"] < 60


def test_start_values_change_along_the_rows(tmp_path):
    """The start is the nearest state on the programme: its residuals do not change."""
    found, said = derive(MODELS / "fourbar.lua", "--until", 0.5, names=["crank_psi", "crank_psi_d"], folder=tmp_path)
    assert "warning" not in said
    for name in found:
        if re.match(r"d_(phi|psi)_\d+_by_", name):
            assert numpy.max(numpy.abs(found[name])) < 1e-7


# ---- Where derivatives do not exist ----

def test_event_at_the_start(tmp_path):
    """A force that begins exactly at the start: on one side the time event does not happen."""
    model = written(tmp_path, "breaks", BREAK)
    found, said = derive(model, "--until", 1, names=["T0", "F"], folder=tmp_path)
    assert re.search(r"warning: --derivatives T0: nan from t = 0 s on: .* at the start of the motion happens in another order", said), said
    assert numpy.isnan(found["d_c_x_by_T0"]).all() and numpy.isfinite(found["d_c_x_by_F"]).all()


def test_other_order_of_events(tmp_path):
    """The ball reaches the floor just before the end, or just after it: earlier derivatives exist."""
    model = written(tmp_path, "ball", BALL.format(more=""))
    end = (2 * 1.3 / 9.81) ** 0.5
    found, said = derive(model, "--until", end * (1 + 1e-13), "--every", 0.1, names=["H"], folder=tmp_path)
    assert "warning: --derivatives H" in said and "floor" in said, said
    assert numpy.isfinite(found["d_ball_z_by_H"][:-1]).all() and numpy.isnan(found["d_ball_z_d_by_H"][-1])


# Each value is exactly on a kink or jump: slide a pulls, slide b is held by a contact without force, slide c follows a row.
BENT = """local rd = require "refdyn"
local p = rd.parameters { { "a", 0 }, { "one", 1 }, { "few", 0 }, { "step", 0 }, { "late", 0 }, { "lift", 0 }, { "row", 0 }, { "course", 2 }, { "m", 1.5, "kg" } }
local u = rd.input("u", 0, "N")
return rd.model { name = "kinks", gravity = { 0, 0, 0 }, points = { b = "b" },
  links = { { "a", joint = "x", mass = p.m }, { "b", joint = "z", mass = 0.8 }, { "c", joint = "x", mass = 1 }, { "d", joint = "x", mass = 1, damper = { x = 0.3 } } },
  forces = function(s)
    return { a_x = 1 + rd.max(p.a, 0) + rd.min(p.one, 1) + 3 * p.few + 0.02 * rd.abs(p.few) + rd.where(rd.less(p.step, 0), 1, 2) + u + rd.abs(u),
             b_z = p.lift, d_x = 0.4 + rd.where(rd.less(s.t, 0.5), 1, 1 + rd.abs(p.late)) }
  end,
  constraints = function(s) return { rd.position { s.q.c_x - rd.max(0, p.row) * s.t^2 }, rd.contact { s.points.b.z, name = "floor" } } end,
  courses = function(s) return { bent = rd.abs(p.course - 2) * s.t + p.course^2 } end }
"""
# By value: column, slope above and below it for t = 1.
SIDES = {"a": ("a_x", 1 / 3, 0), "one": ("a_x", 0, 1 / 3), "few": ("a_x", 3.02 / 3, 2.98 / 3), "lift": ("b_z", 0.625, 0), "row": ("c_x", 1, 0),
         "course": ("bent", 5, 3), "u": ("a_x", 2 / 3, 0)}


@pytest.mark.parametrize("arguments", [(), ("--method", "radau9"), ("--method", "rk54", "--lanes", 4), ("--method", "rodas5p"),
                                       ("--method", "rk4", "--step", 0.05)])
def test_values_on_a_kink(arguments, tmp_path):
    """A slope of its own on each side: nan in the columns concerned, with both slopes; other columns keep their derivatives."""
    model = written(tmp_path, "kinks", BENT)
    found, said = derive(model, "--until", 1, "--every", 0.25, *arguments, names=[*SIDES, "step", "late", "m"], folder=tmp_path)
    for name, (column, above, below) in SIDES.items():
        where = re.search(rf"--derivatives {name}: nan from t = .* s on in columns that have different slopes above and below this {name}, as at a kink or jump of a "
                          rf"formula or a contact that just touches \((.*) at t = 1 s: (.*) above, (.*) below\); change {name} slightly for one side\n", said)
        assert where and where[1] == column, (name, said)
        assert abs(float(where[2]) - above) < 1e-4 and abs(float(where[3]) - below) < 1e-4, where[0]
        assert numpy.isnan(found[f"d_{column}_by_{name}"][1:]).all()
        clean = "d_x" if column != "d_x" else "a_x"
        assert (found[f"d_{clean}_by_{name}"] == 0).all()
    assert numpy.isnan(found["d_a_x_by_step"][1:]).all() and "--derivatives step: nan" in said
    late = found["d_d_x_by_late"][found["t"] < 0.49]
    assert (late == 0).all() and numpy.isnan(found["d_d_x_by_late"][-1])
    assert numpy.isfinite(found["d_a_x_by_m"]).all() and "--derivatives m:" not in said


def test_values_near_a_kink(tmp_path):
    """Slightly beside it, each side has its slope."""
    model = written(tmp_path, "kinks", BENT)
    for name, (column, above, below) in SIDES.items():
        for side, slope in ((1e-3, above), (-1e-3, below)):
            value = {"one": 1, "course": 2}.get(name, 0) + side
            found, said = derive(model, "--until", 1, "--every", 1, "--set", f"{name}={value}", names=[name], folder=tmp_path)
            extra = 2 * side if name == "course" else 0
            assert abs(found[f"d_{column}_by_{name}"][-1] - slope - extra) < 1e-5 and "warning: --derivatives" not in said, (name, side)


@pytest.mark.parametrize("method", ["auto", "radau9"])
def test_rounding_is_no_kink(method, tmp_path):
    """Accelerations that hardly depend on a value differ by rounding."""
    found, said = derive(REFERENCE, "--until", 0.5, "--every", 0.1, "--method", method, names=["m_base", "s_sup", "d_sup", "m_col", "h"], folder=tmp_path)
    assert "slopes" not in said and all(numpy.isfinite(found[name]).all() for name in found if name.startswith("d_"))


def test_batch_says_that_a_value_is_on_a_kink(tmp_path):
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { a = { 0, 1 } }, t_end = 1, keep = { derivatives = { "a" } } }')
    refdyn("batch", written(tmp_path, "kinks", BENT), sweep, "-o", tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv") as file:
        on, off = csv.DictReader(file)
    assert on["reason"] == "no derivative by a: it has different slopes above and below this a, as at a kink or jump of a formula or a contact that just touches"
    assert numpy.isnan(float(on["d_a_x_by_a"] or "nan")) and abs(float(off["d_a_x_by_a"]) - 1 / 3) < 1e-8 and not off["reason"]


@pytest.mark.parametrize("method", ["auto", "rk54", "rodas5p", "radau9"])
def test_grazing(method, tmp_path):
    """A ball that just reaches a ceiling, with dense outputs: exact before, nan from the ceiling on, also inside the step that meets it."""
    model = written(tmp_path, "graze", """local rd = require "refdyn"
local p = rd.parameters { { "v", 3, "m/s" }, { "g", 9.81, "m/s^2" } }
return rd.model {
  name = "graze", gravity = { 0, 0, -p.g },
  links = { { "ball", joint = "z", mass = 2, start_rate = { z = p.v } } },
  events = function(s) return { rd.event { 9 / 19.62 - s.q.ball_z, restitution = 0.5, name = "ceiling" } } end,
}""")
    found, said = derive(model, "--until", 0.5, "--every", 0.002, "--method", method, names=["v", "g"], folder=tmp_path)
    for name in ("v", "g"):
        start = re.search(rf"warning: --derivatives {name}: nan from t = (\S+) s on: when {name} changes by \S+, the event ceiling happens in another order", said)
        assert start and abs(float(start[1]) - 3 / 9.81) < 2e-3, said
        is_before = found["t"] < float(start[1])
        column, exact = found[f"d_ball_z_by_{name}"], found["t"] if name == "v" else -found["t"] ** 2 / 2
        assert numpy.isnan(column[~is_before]).all() and largest(column[is_before], exact[is_before]) < 1e-7


@pytest.mark.parametrize("names, message", [
    ("nope", "'nope' is unknown; use a parameter, an input, a coordinate or its rate NAME_d"),
    ("m_EE", "'m_EE' is unknown; did you mean \"m_E\"?"), ("n_rfe", "n_rfe is an option of the model, which fixes its structure"),
    ("E,E", "twice"), ("tau", "unknown")])
def test_wrong_names(names, message, tmp_path):
    done = refdyn("sim", REFERENCE, "--set", "n_rfe=2", "--until", 0.1, "--derivatives", names, "-o", tmp_path / "x.csv", status=2)
    assert message in done.stderr, done.stderr
    assert not (tmp_path / "x.csv").exists()


@pytest.mark.parametrize("arguments, message", [
    (["--accuracy", 1e-3], "--derivatives excludes --accuracy"), (["--lanes", 3], "--lanes: 3 is not a lane width; use 1, 2, 4 or 8"), (["--method", "msbdf"], "--derivatives"),
    (["--from", "statics"], "statics moves the coordinate base_z; add it to --hold or omit it")])
def test_wrong_combinations(arguments, message, tmp_path):
    done = refdyn("sim", REFERENCE, "--set", "n_rfe=2", "--until", 0.1, "--derivatives", "base_z", *arguments, "-o", tmp_path / "x.csv", status=2)
    assert message in done.stderr, done.stderr


# ---- Batches ----

def test_batch_keeps_derivatives(tmp_path):
    """The derivatives of each case are those of its motion."""
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('''local rd = require "refdyn"
return rd.sweep { vary = { a = { 0.19, 0.2, 0.205 } }, t_end = 0.4, keep = { final = true, derivatives = { "a", "torque", "crank_psi_d" } } }''')
    refdyn("batch", MODELS / "fourbar.lua", sweep, "--lanes", 1, "--threads", 2, "-o", tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3
    for row in rows:
        found, said = derive(MODELS / "fourbar.lua", "--set", f"a={row['a']}", "--until", 0.4, "--every", 0.4, names=["a", "torque", "crank_psi_d"], folder=tmp_path)
        for column in ("crank_psi", "crank_psi_d"):
            for name in ("a", "torque", "crank_psi_d"):
                assert abs(float(row[f"d_{column}_by_{name}"]) / found[f"d_{column}_by_{name}"][-1] - 1) < 1e-6


@pytest.mark.parametrize("H, reason", [(1.3, "no derivative by H: at t = 0.514[0-9]* s the event floor happens in another order"), (1.2, None)])
def test_batch_says_why_derivatives_are_missing(H, reason, tmp_path):
    """A ball that reaches the floor at the end of the motion."""
    sweep, model = tmp_path / "sweep.lua", written(tmp_path, "ball", BALL.format(more=""))
    sweep.write_text(f"""local rd = require "refdyn"
return rd.sweep {{ vary = {{ H = {{ {H} }} }}, t_end = {(2 * 1.3 / 9.81) ** 0.5 * (1 + 1e-13)!r}, keep = {{ derivatives = {{ "H" }} }} }}""")
    refdyn("batch", model, sweep, "-o", tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv") as file:
        row, = csv.DictReader(file)
    assert re.match(reason, row["reason"]) if reason else "reason" not in row, row


def test_batch_says_that_values_jump_at_the_end(tmp_path):
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { F = { 3 } }, t_end = 0.6, keep = { derivatives = { "F", "T" } } }')
    refdyn("batch", written(tmp_path, "breaks", BREAK), sweep, "-o", tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv") as file:
        row, = csv.DictReader(file)
    assert row["reason"] == "no derivative by T: values jump at the end, where an event happens" and row["d_a_x_by_F"]


def test_batch_refuses_wrong_names(tmp_path):
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { a = { 0.19 } }, t_end = 0.4,\n  keep = { derivatives = { "nope" } } }')
    done = refdyn("batch", MODELS / "fourbar.lua", sweep, "-o", tmp_path / "runs.csv", status=1)
    assert re.search(r"sweep.lua:3: keep.derivatives: 'nope' is no parameter that the model reads, input, coordinate or rate NAME_d", done.stderr), done.stderr
