"""Derivatives of whole motions (`sim --derivatives`): closed forms, emitted steps, tight runs, lanes; where they do not exist."""
import csv
import json
import re

import numpy
import pytest

from program import LONG, MODELS, REFERENCE, SOURCE, TESTS, refdyn, settings
from random_scenes import damped_scene
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
    for name, value in values.items():
        change = (1e-5 if name == "E" else 1e-4) * abs(value)  # vibrations respond to E by their phases
        sides = []
        for side in (value + change, value - change):
            refdyn("sim", model, *settings({**values, name: side}), "--until", until, "--every", every, "--tol", 1e-12, "-o", tmp_path / "side.csv")
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


@pytest.mark.parametrize("names, message", [
    ("nope", "'nope' is unknown; use a parameter, an input, a coordinate or its rate NAME_d"),
    ("m_EE", "'m_EE' is unknown; the nearest is 'm_E'"), ("n_rfe", "n_rfe is an option of the model, which fixes its structure"),
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


def test_batch_refuses_wrong_names(tmp_path):
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { a = { 0.19 } }, t_end = 0.4,\n  keep = { derivatives = { "nope" } } }')
    done = refdyn("batch", MODELS / "fourbar.lua", sweep, "-o", tmp_path / "runs.csv", status=1)
    assert re.search(r"sweep.lua:3: keep.derivatives: 'nope' is no parameter that the model reads, input, coordinate or rate NAME_d", done.stderr), done.stderr
