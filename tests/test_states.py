"""Continuous states (rd.state) against matrix exponentials: a motor with inductance, PI with a notch filter, jumps, events; in every
method, in statics, modes, linear models, batches, derivatives, Python and FMUs."""
import csv
import ctypes
import json
import re
import zipfile

import h5py
import numpy
import pytest
import scipy.linalg
import scipy.optimize

from python_package import package  # noqa: F401 (a fixture)
from program import LONG, SOURCE, evaluate, motion, read_run, refdyn, settings

CONTROL = SOURCE / "docs" / "control"
MOTOR, CONTINUOUS = CONTROL / "motor.lua", CONTROL / "continuous.lua"
# Options with which each method reaches 1e-9; methods of low order take short motions and many steps.
METHODS = {"rk4": ("--step", 1e-5), "rk54": (), "rk8": (), "rodas5p": (), "rodas6p": (), "ros34pw2": ("--tol", 1e-10), "radau9": (), "gauss12": (),
           "msbdf": ("--tol", 1e-13), "bsimp": ("--tol", 1e-13), "auto": ()}


def exact(A, b, x, t):
    """x(t) of x' = A x + b."""
    n = len(x)
    step = scipy.linalg.expm(t * numpy.block([[A, b[:, None]], [numpy.zeros((1, n + 1))]]))
    return step[:n, :n] @ x + step[:n, n]


# ---- A motor ----

def motor_pieces(J=0.02, c=0.05, R=0.8, L=4e-3, k=0.3, i_most=20, u=24):
    """x' = A x + b of x = (psi, psi', i) with a current below and above the bound."""
    free = numpy.array([[0, 1, 0], [0, -c / J, k / J], [0, -k / L, -R / L]])
    bound = free.copy()
    bound[1, 2] = 0
    return (free, numpy.array([0, 0, u / L])), (bound, numpy.array([0, k * i_most / J, u / L])), i_most


def motor_at(times, x, **values):
    """The states at ascending times, from piece to piece between the times at which the current passes the bound."""
    *pieces, most = motor_pieces(**values)
    t, rows, is_beyond = 0.0, [], bool(x[2] > most)
    for end in times:
        while True:
            A, b = pieces[is_beyond]
            grid = numpy.linspace(0, end - t, 200)[1:]
            beyond = [bool(exact(A, b, x, h)[2] > most) for h in grid]
            if all(value == is_beyond for value in beyond):
                break
            first = next(i for i, value in enumerate(beyond) if value != is_beyond)
            h = scipy.optimize.brentq(lambda h: exact(A, b, x, h)[2] - most, grid[first - 1] if first else 1e-12, grid[first], xtol=1e-17, rtol=1e-15)
            x, t, is_beyond = exact(A, b, x, h), t + h, not is_beyond
        x, t = exact(A, b, x, end - t), end
        rows.append(x)
    return numpy.array(rows)


def of_motor(run):
    return numpy.array([run[name] for name in ("rotor_psi", "rotor_psi_d", "i")]).T


@pytest.mark.parametrize("method", METHODS)
def test_motor_in_every_method(method):
    times = 0.0025 * numpy.arange(1, 9)
    expected = motor_at(times, numpy.zeros(3))
    run, said, summary = motion(MOTOR, "--until", 0.02, "--every", 0.0025, "--method", method, *(METHODS[method] or ("--tol", 1e-12)))
    assert expected[:, 2].max() > 20 > expected[0, 2] and numpy.max(numpy.abs(of_motor(run)[1:] - expected)) < 1e-9
    assert list(run)[:3] == ["t", "rotor_psi", "rotor_psi_d"] and "i_d" not in run and "force_i" not in run
    assert summary["energy_error"] < 1e-8  # a state has no energy, and its rate no power


def test_tolerance_is_that_of_the_scale(tmp_path):
    """A local error of tol times the scale: a current in mA with a scale of 1000 has the errors of one in A."""
    milli = tmp_path / "milli.lua"
    milli.write_text(re.sub(r'"i", rate = (.*), unit = "A"', r'"i", rate = 1000 * (\1), scale = 1000', MOTOR.read_text()).replace("s.states.i", "(s.states.i / 1000)"))
    runs = [motion(model, "--until", 0.2, "--method", "rk8", "--tol", 1e-7) for model in (MOTOR, milli)]
    assert abs(runs[0][2]["steps"] - runs[1][2]["steps"]) <= 2
    assert numpy.max(numpy.abs(runs[0][0]["i"] - runs[1][0]["i"] / 1000)) < 1e-6
    exact_i = motor_at(runs[0][0]["t"][1:], numpy.zeros(3))[:, 2]
    assert 1e-13 < numpy.max(numpy.abs(runs[0][0]["i"][1:] - exact_i)) < 1e-5


# ---- PI and notch filter ----

def loop(J=0.02, J_load=0.05, k=60, c=0.02, Kp=0.6, Ki=3, f=10.3, d=0.7, wish=5):
    """x' = A x + b of x = (motor, shaft, their rates, sum, n1, n2)."""
    w = 2 * numpy.pi * f
    A, b = numpy.zeros((7, 7)), numpy.zeros(7)
    wanted, torque = numpy.array([0, 0, -Kp, 0, Ki, 0, 0.0]), numpy.array([0, 0, -Kp, 0, Ki, 0, -2 * d * w])
    shaft = numpy.array([0, k, 0, c, 0, 0, 0.0])  # on the motor; its opposite is on the load
    A[0, 2] = A[1, 3] = 1
    A[2], b[2] = (torque + shaft) / J, Kp * wish / J
    A[3], b[3] = -shaft / J_load - A[2], -b[2]
    A[4, 2], b[4] = -1, wish
    A[5, 6] = 1
    A[6], b[6] = wanted, Kp * wish
    A[6, 5] -= w ** 2
    A[6, 6] -= 2 * d * w
    return A, b


LOOP = ["motor_psi", "load_psi", "motor_psi_d", "load_psi_d", "sum", "n1", "n2"]


@pytest.mark.parametrize("method", ["rk8", "rk54", "rodas6p", "radau9", "gauss12", "auto"])
def test_velocity_loop(method):
    A, b = loop()
    run, _, _ = motion(CONTINUOUS, "--until", 1, "--every", 0.05, "--method", method, "--tol", 1e-12)
    expected = numpy.array([exact(A, b, numpy.zeros(7), t) for t in run["t"]])
    found = numpy.array([run[name] for name in LOOP]).T
    assert numpy.max(numpy.abs(found - expected)) < 1e-9 and abs(expected[-1, 2] - 5) < 0.2
    assert numpy.max(numpy.abs(run["torque"] - (0.6 * (5 - expected[:, 2]) + 3 * expected[:, 4] - 1.4 * 2 * numpy.pi * 10.3 * expected[:, 6]))) < 1e-7


def test_linear_model_and_modes(tmp_path):
    """A is the matrix of the loop; the modes are its eigenvalues, without poles of integrals."""
    A, _ = loop(Kp=0.7)
    linear = json.loads(refdyn("linearise", CONTINUOUS, "--set", "Kp=0.7", "--at", "initial").stdout)
    assert linear["states"] == LOOP and numpy.max(numpy.abs(numpy.array(linear["A"]) - A)) < 1e-9 * numpy.max(numpy.abs(A))
    values = numpy.sort_complex(numpy.linalg.eigvals(A))
    found = numpy.sort_complex(numpy.array([complex(*pair) for pair in linear["eigenvalues"]]))
    assert numpy.max(numpy.abs(found - values)) < 1e-6
    modes = json.loads(refdyn("modes", CONTINUOUS, "--set", "Kp=0.7", "--at", "initial").stdout)["modes"]
    of_modes = [complex(*mode["eigenvalue"]) for mode in modes]
    pairs = of_modes + [value.conjugate() for value in of_modes if value.imag]
    assert len(pairs) == 7 and numpy.max(numpy.abs(numpy.sort_complex(numpy.array(pairs)) - values)) < 1e-6
    assert all(len(mode["shape"]["re"]) == 2 and len(mode["shape_of_states"]["re"]) == 3 for mode in modes)


# ---- Other models ----

DRIVEN = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1.3, "kg" }, { "g", 9.81, "m/s^2" }, { "decay", 0.4, "1/s" }, { "k", 2.5, "N m" }, { "i0", 0.2, "A" } }
local u = rd.input("u", 0.7, "V")
return rd.model {
  name = "driven", gravity = { 0, 0, -p.g },
  links = {
    { "arm", joint = { "theta" }, mass = p.m, center = { 0.2, 0, 0.05 }, inertia = { yy = 0.03 }, start = { theta = 0.3 }, damper = { theta = 0.3 } },
    { "tip", on = "arm", at = { 0.5, 0, 0 }, joint = { "theta" }, mass = 0.4, center = { 0.2, 0, 0 }, inertia = { yy = 0.01 },
      spring = { theta = 3 }, damper = { theta = 0.1 } },
  },
  points = { E = { on = "tip", at = { 0.4, 0, 0 } } },
  states = function(s)
    return {
      rd.state { "a", rate = s.states.b - p.decay * s.states.a * rd.cos(s.q.arm_theta), start = 0.1 },
      rd.state { "b", rate = u - s.states.a - 0.5 * s.states.b^3 + 0.2 * s.points.E.xd, start = p.i0, unit = "A" },
    }
  end,
  forces = function(s)
    return { arm_theta = -p.k * s.states.a * (1 + s.states.b), rd.force { "tip", { s.states.b * s.q.tip_theta, 0, s.states.a } } }
  end,
  courses = function(s) return { sum = s.states.a + 2 * s.states.b * s.q.arm_theta } end,
  limits = function(s) return { { "b", column = "b", to = 0.3 }, { "product", s.states.a * s.states.b, to = 1 } } end,
%s
}"""
NAMES = ["arm_theta", "tip_theta", "arm_theta_d", "tip_theta_d", "a", "b"]


def written(folder, name, text):
    (folder / f"{name}.lua").write_text(text)
    return folder / f"{name}.lua"


@pytest.fixture
def driven(tmp_path):
    return written(tmp_path, "driven", DRIVEN % "")


def values_of(state):
    return numpy.array([*state["q"], *state["qd"], *state["states"].values()])


def rates(model, x):
    """The derivatives of (q, qd, a, b)."""
    found = evaluate(model, {"q": list(x[:2]), "qd": list(x[2:4]), "states": {"a": x[4], "b": x[5]}})
    return numpy.array([*x[2:4], *found["qdd"]])


def differences(function, x, h=1e-5):
    return numpy.array([(function(x + h * e) - function(x - h * e)) / (2 * h) for e in numpy.eye(len(x))]).T


def test_statics_and_linear_model_of_a_nonlinear_one(driven, tmp_path):
    found = json.loads(refdyn("statics", driven).stdout)
    x = values_of(found)
    assert numpy.max(numpy.abs(rates(driven, x))) < 1e-9 and found["criterion"] == "linear motion"
    linear = json.loads(refdyn("linearise", driven).stdout)
    assert linear["states"] == NAMES
    A = differences(lambda y: rates(driven, y), x)
    assert numpy.max(numpy.abs(numpy.array(linear["A"]) - A)) < 1e-7 * numpy.max(numpy.abs(A))
    unstable = sum(value.real > 0 for value in numpy.linalg.eigvals(A))
    assert (found["unstable"] > 0) == (unstable > 0)
    # about a state that moves
    y = x + numpy.array([0.2, -0.3, 0.7, 0.4, -0.35, 0.6])
    (tmp_path / "y.json").write_text(json.dumps({"q": list(y[:2]), "qd": list(y[2:4]), "states": {"a": y[4], "b": y[5]}}))
    linear = json.loads(refdyn("linearise", driven, "--at", tmp_path / "y.json").stdout)
    A = differences(lambda z: rates(driven, z), y)
    assert numpy.max(numpy.abs(numpy.array(linear["A"]) - A)) < 1e-7 * numpy.max(numpy.abs(A))
    assert numpy.max(numpy.abs(numpy.array(linear["rate"]) - rates(driven, y))) < 1e-9
    i = linear["outputs"].index("sum")
    assert numpy.allclose(linear["C"][i], [2 * y[5], 0, 0, 0, 1, 2 * y[0]], atol=1e-12)
    B = differences(lambda u: numpy.array(evaluate(driven, {"q": list(y[:2]), "qd": list(y[2:4]), "states": {"a": y[4], "b": y[5]}, "inputs": {"u": u[0]}})["qdd"]), numpy.array([0.7]))
    assert numpy.allclose(numpy.array(linear["B"])[2:], B, atol=1e-8)


def test_held_states_and_rows(tmp_path):
    """A held state keeps its start; where rows hold, their multipliers balance forces of states."""
    row = '  constraints = function(s) return { rd.position { s.points.E.z + 0.1 } } end,'
    model = written(tmp_path, "rows", DRIVEN % row)
    found = json.loads(refdyn("statics", model, "--hold", "b").stdout)
    assert found["states"]["b"] == 0.2 and len(found["hold_force"]) == 1
    x = values_of(found)
    assert abs(rates(model, x)[4]) < 1e-9 and numpy.max(numpy.abs(rates(model, x)[2:4])) < 1e-8
    whole = json.loads(refdyn("statics", model).stdout)
    assert numpy.max(numpy.abs(rates(model, values_of(whole)))) < 1e-8
    modes = json.loads(refdyn("modes", model).stdout)["modes"]
    linear = json.loads(refdyn("linearise", model).stdout)
    assert len(linear["states"]) == 4 and sum(2 if mode["eigenvalue"][1] else 1 for mode in modes) == 4
    found = sorted(abs(complex(*mode["eigenvalue"])) for mode in modes)
    assert numpy.allclose(found, sorted({round(abs(complex(*pair)), 12): abs(complex(*pair)) for pair in linear["eigenvalues"]}.values()), rtol=1e-7)


SEVERAL = """local rd = require "refdyn"
local rows, list = rd.option("rows", "none"), {}
for i = 0, 2 do
  for j = 0, 2 do for _, name in ipairs { "K", "D", "B", "C", "F", "E" } do list[#list + 1] = { name .. i .. j, 0 } end end
  list[#list + 1], list[#list + 2] = { "r" .. i, 1 }, { "m" .. i, 1 }
end
local p = rd.parameters(list)
local names, states = { "a_x", "b_x", "c_psi" }, { "u", "v", "w" }
local function sum(name, i, values, keys)
  local f = 0
  for j = 0, 2 do f = f + p[name .. i .. j] * values[keys[j + 1]] end
  return f
end
return rd.model { name = "several",
  links = { { "a", joint = "x", mass = p.m0 }, { "b", on = "a", joint = "x", mass = p.m1 }, { "c", joint = "psi", mass = 1, inertia = { zz = p.m2 } } },
  states = function(s)
    local l = {}
    for i = 0, 2 do l[i + 1] = rd.state { states[i + 1], rate = sum("C", i, s.q, names) + sum("F", i, s.qd, names) + sum("E", i, s.states, states) } end
    return l
  end,
  forces = function(s)
    local f = {}
    for i = 0, 2 do f[names[i + 1]] = sum("B", i, s.states, states) - sum("K", i, s.q, names) - sum("D", i, s.qd, names) end
    return f
  end,
  constraints = function(s)
    if rows == "none" then return {} end
    local of = rows == "position" and s.q or s.qd
    return { rd[rows] { p.r0 * of.a_x + p.r1 * of.b_x + p.r2 * of.c_psi } }
  end }
"""


def random_loop(random, kind):
    """Matrices of M q'' + D q' + K q = B z, z' = C q + F q' + E z. Of six kinds, four have eigenvalues 0: an odometer, an odometer and a
    constant, a wheel that nothing holds with its odometer, a potential with dampers or their negative and an odometer; the last is a
    potential that states follow without pulling."""
    m = 10 ** random.uniform(-2, 2, 3)
    K, D, B, C, F, E = (random.normal(size=(3, 3)) for _ in range(6))
    K, D, E = K @ K.T + random.uniform(-1, 3) * numpy.eye(3), 0.3 * D @ D.T, E - random.uniform(0, 3) * numpy.eye(3)
    for i in {1: [2], 2: [1, 2], 4: [2]}.get(kind, []):
        C[i] = E[i] = E[:, i] = B[:, i] = 0
    if kind == 2:
        F[1] = 0
    if kind == 3:
        K[2] = K[:, 2] = D[2] = D[:, 2] = B[2] = C[:, 2] = 0
    if kind in (4, 5):
        B[:] = C[:] = 0
        D *= random.choice([-1, 1])
    seconds, units = 10 ** random.uniform(-4, 4), numpy.diag(10 ** random.uniform(-7, 7, 3))
    back = numpy.linalg.inv(units) * seconds
    return m, {"K": K * seconds ** 2, "D": D * seconds, "B": B @ back * seconds, "C": units @ C * seconds, "F": units @ F, "E": units @ E @ back}


def growing_modes(m, loop, rows):
    """Their number, a pair counts once; None: not clear. States that nothing reads are left out, so that 0 is no multiple eigenvalue."""
    M = numpy.array([[m[0] + m[1], m[1], 0], [m[1], m[1], 0], [0, 0, m[2]]])
    N = scipy.linalg.null_space(numpy.array(rows)) if rows else numpy.eye(3)
    inverse = numpy.linalg.inv(N.T @ M @ N) @ N.T
    A = numpy.block([[numpy.zeros((N.shape[1], N.shape[1])), numpy.eye(N.shape[1]), numpy.zeros((N.shape[1], 3))],
                     [-inverse @ loop["K"] @ N, -inverse @ loop["D"] @ N, inverse @ loop["B"]], [loop["C"] @ N, loop["F"] @ N, loop["E"]]])
    while not A.any(axis=0).all():
        keep = A.any(axis=0)
        A = A[numpy.ix_(keep, keep)]
    found = numpy.linalg.eigvals(A)
    is_clear = (abs(found.real) > 1e-7 * abs(found)).all() and min(abs(found)) > 1e-7 * max(abs(found))
    return int(((found.real > 0) & (found.imag >= 0)).sum()) if is_clear else None


@pytest.mark.parametrize("rows", ["none", "position", "velocity"])
@pytest.mark.filterwarnings("ignore")
def test_growing_modes_of_random_loops(rows, package, tmp_path):
    """The number of growing modes with states, by the eigenvalues of the system of first order. Velocity rows have no part in statics."""
    random, arm = numpy.random.default_rng(48), package.Model(written(tmp_path, "several", SEVERAL), rows=rows)
    counted = 0
    for case in range(400 if LONG else 60):
        kind = case % 6
        m, loop = random_loop(random, kind)
        r, held = random.normal(size=3), ["a_x"] if case % 5 == 0 and kind != 3 else []
        values = {f"{name}{i}{j}": X[i, j] for name, X in loop.items() for i in range(3) for j in range(3)}
        if kind == 3 and rows == "position":
            continue
        right = growing_modes(m, loop, [r] * (rows == "position") + [[1, 0, 0]] * len(held))
        if right is None:
            continue
        found = arm.statics(parameters={**values, **{f"r{i}": r[i] for i in range(3)}, **{f"m{i}": m[i] for i in range(3)}}, hold=held)
        assert found.attrs["unstable"] == right and found.attrs["criterion"] == "linear motion", (case, right, found.attrs)
        assert found.attrs["neutral"] == {1: 1, 2: 2, 3: 1, 4: 1}.get(kind, 0), (case, found.attrs)
        counted += 1
    assert counted > 40


def test_from_states_and_limits(driven, tmp_path):
    """A motion continues from a STATE.json; what that leaves out has the model's value. Limits name states."""
    run, said, summary = motion(driven, "--until", 0.8, "--every", 0.4, "--tol", 1e-11)
    state = {"t": 0.4, "q": [run[name][1] for name in NAMES[:2]], "qd": [run[name][1] for name in NAMES[2:4]], "states": {name: run[name][1] for name in "ab"}}
    (tmp_path / "s.json").write_text(json.dumps(state))
    again, _, _ = motion(driven, "--until", 0.8, "--every", 0.4, "--tol", 1e-11, "--from", tmp_path / "s.json")
    assert all(abs(again[name][-1] - run[name][-1]) < 1e-9 for name in NAMES)
    (tmp_path / "s.json").write_text(json.dumps({"states": {"b": 0.5}}))
    start, _, _ = motion(driven, "--until", 0.1, "--every", 0.1, "--from", tmp_path / "s.json")
    assert [start[name][0] for name in ("arm_theta", "a", "b")] == [0.3, 0.1, 0.5]
    assert "b exceeds its limits" in said
    for wrong, message in (({"states": {"c": 1}}, "c: unknown state"), ({"b": 1}, "b: not a key of a state; it belongs in the object states"),
                           ({"q": [0, 0, 0, 0]}, "q: has 4 values; must have 2, one for each coordinate from arm_theta to tip_theta")):
        (tmp_path / "s.json").write_text(json.dumps(wrong))
        assert message in refdyn("sim", driven, "--until", 0.1, "--from", tmp_path / "s.json", status=1).stderr


JUMPS = """local rd = require "refdyn"
local p = rd.parameters { { "up", 3, "1" }, { "z0", 0.25, "1" } }
return rd.model {
  name = "jumps",
  links = { { "slide", joint = "x", mass = 2, start_rate = { x = 0.7 } } },
  states = function(s) return { rd.state { "z", rate = rd.where(rd.less(s.q.slide_x, 0.3), p.up, -1.5) + %s, start = p.z0 } } end,
  events = function(s) return { %s } end,
}"""


@pytest.mark.parametrize("method", ["rk8", "rk54", "radau9", "gauss12", "rodas5p"])
def test_jump_of_the_rate(method, tmp_path):
    """The slide passes 0.3 at t = 0.3/0.7, where z' jumps."""
    model = written(tmp_path, "jumps", JUMPS % ("0", ""))
    run, _, summary = motion(model, "--until", 1, "--every", 0.01, "--method", method, "--tol", 1e-8)
    t1 = 0.3 / 0.7
    expected = numpy.where(run["t"] < t1, 0.25 + 3 * run["t"], 0.25 + 3 * t1 - 1.5 * (run["t"] - t1))
    assert numpy.max(numpy.abs(run["z"] - expected)) < 1e-11 and summary["steps"] < 150


@pytest.mark.parametrize("method", ["rk8", "radau9"])
def test_events_set_states(method, tmp_path):
    """A saw-tooth: z grows by 3 a second to 1 and falls to z - 0.6; the slide is not touched."""
    model = written(tmp_path, "saw", JUMPS.replace("rd.where(rd.less(s.q.slide_x, 0.3), p.up, -1.5)", "p.up") %
                    ("0 * s.t", 'rd.event { s.states.z - 1, direction = "up", name = "full", states = { z = s.states.z - 0.6 } }'))
    run, said, summary = motion(model, "--until", 2, "--every", 0.1, "--method", method)
    expected = [0.25 + 3 * t if t < 0.25 else 0.4 + 3 * ((t - 0.25) % 0.2) for t in run["t"]]
    off = numpy.abs(run["z"] - expected)
    assert numpy.max(numpy.minimum(off, numpy.abs(off - 0.6))) < 1e-9 and len(summary["events"]) == 9
    assert numpy.allclose(run["slide_x"], 0.7 * run["t"], atol=1e-12)


def test_sampled_controllers_read_states(tmp_path):
    """Each 5 ms a controller sets the voltage from the rate and the current: from sample to sample, a matrix exponential."""
    (A, b), _, _ = motor_pieces(u=0)
    model = tmp_path / "sampled.lua"
    model.write_text(MOTOR.read_text().replace("(p.u - ", "(u - ").replace("p.u * s.states.i", "u * s.states.i")
                     .replace("return rd.model {", 'local u = rd.input("u", 1, "V")\nreturn rd.model {')
                     .replace("  courses", "  events = function(s) return { rd.sampled { every = 5e-3, inputs = { u = 0.7 * (20 - s.qd.rotor_psi) - 0.4 * s.states.i } } } end,\n"
                              "  courses"))
    run, _, _ = motion(model, "--until", 0.3, "--every", 5e-3, "--tol", 1e-12)
    x, rows = numpy.zeros(3), [numpy.zeros(3)]
    for _ in run["t"][1:]:
        u = 0.7 * (20 - x[1]) - 0.4 * x[2]
        x = exact(A, numpy.array([0, 0, u / 4e-3]), x, 5e-3)
        rows.append(x)
    found = numpy.array([run[name] for name in ("rotor_psi", "rotor_psi_d", "i")]).T
    assert numpy.max(numpy.abs(found - rows)) < 1e-9 and 1 < numpy.max(found[:, 2]) < 20


@pytest.mark.parametrize("method", ["rk8", "radau9"])
def test_impacts_leave_states_alone(method, tmp_path):
    """A ball rebounds; the lagging rate has a kink there, not a jump. At rest on the floor the state is 0."""
    model = tmp_path / "ball.lua"
    model.write_text('''local rd = require "refdyn"
return rd.model {
  name = "ball", gravity = { 0, 0, -9.81 }, links = { { "ball", joint = "z", mass = 0.7, start = { z = 0.8 } } },
  states = function(s) return { rd.state { "lag", rate = (s.qd.ball_z - s.states.lag) / 0.15, start = 0.3 } } end,
  constraints = function(s) return { rd.contact { s.q.ball_z, restitution = 0.6, name = "floor" } } end,
}
''')
    run, _, _ = motion(model, "--until", 0.85, "--every", 0.05, "--method", method, "--tol", 1e-11)
    A, b = numpy.array([[0, 1, 0], [0, 0, 0], [0, 1 / 0.15, -1 / 0.15]]), numpy.array([0, -9.81, 0])
    t1 = (2 * 0.8 / 9.81) ** 0.5
    after = exact(A, b, numpy.array([0.8, 0, 0.3]), t1) * [0, -0.6, 1]
    expected = [exact(A, b, numpy.array([0.8, 0, 0.3]), t) if t < t1 else exact(A, b, after, t - t1) for t in run["t"]]
    assert numpy.max(numpy.abs(numpy.array([run[name] for name in ("ball_z", "ball_z_d", "lag")]).T - expected)) < 1e-9
    rest = json.loads(refdyn("statics", model).stdout)
    assert abs(rest["q"][0]) < 1e-12 and abs(rest["states"]["lag"]) < 1e-12


# ---- Batches, derivatives ----

SWEEP = 'local rd = require "refdyn"\nreturn rd.sweep { vary = { b = rd.grid(0.1, 0.5, 7) }, t_end = 0.5, keep = { final = true, history = { "a" } } }'


@pytest.mark.parametrize("method", ["rk8", "radau9", "rodas5p"])
def test_lanes(method, driven, tmp_path):
    """Cases have the same bits in each width, and are those of single motions."""
    (tmp_path / "sweep.lua").write_text(SWEEP)
    found = {}
    for lanes in (1, 2, 4):
        refdyn("batch", driven, tmp_path / "sweep.lua", "-o", tmp_path / f"{lanes}.h5", "--lanes", lanes, "--method", method, "--tol", 1e-8, "--threads", 1)
        with h5py.File(tmp_path / f"{lanes}.h5") as file:
            assert set(NAMES) <= set(file["final"]) and "a_d" not in file["final"] and file["final/b"].attrs["units"] in (b"A", "A")
            found[lanes] = {name: file[f"final/{name}"][()] for name in NAMES}
            starts = file["cases/b"][()]
    assert all(numpy.array_equal(found[2][name], found[4][name]) for name in NAMES)
    for i in (0, 3, 6):
        (tmp_path / "s.json").write_text(json.dumps({"states": {"b": starts[i]}}))
        run, _, _ = motion(driven, "--until", 0.5, "--method", method, "--tol", 1e-8, "--from", tmp_path / "s.json")
        assert all(abs(found[width][name][i] - run[name][-1]) < 1e-7 for name in NAMES for width in (1, 4))
        assert all(found[1][name][i] == run[name][-1] for name in NAMES)


def test_derivatives_by_starts_and_parameters(tmp_path):
    """Of the linear loop: columns of the matrix exponential; by Kp: differences of the exact solution."""
    A, b = loop()
    refdyn("sim", CONTINUOUS, "--until", 0.4, "--every", 0.2, "--tol", 1e-10, "--derivatives", "sum,n2,motor_psi_d,Kp", "-o", tmp_path / "d.csv")
    with open(tmp_path / "d.csv") as file:
        last = {name: float(value) for name, value in list(csv.DictReader(file))[-1].items()}
    step = scipy.linalg.expm(0.4 * A)
    by_Kp = (exact(*loop(Kp=0.6 + 1e-5), numpy.zeros(7), 0.4) - exact(*loop(Kp=0.6 - 1e-5), numpy.zeros(7), 0.4)) / 2e-5
    for i, name in enumerate(LOOP):
        for by, expected in (("sum", step[i, 4]), ("n2", step[i, 6]), ("motor_psi_d", step[i, 2]), ("Kp", by_Kp[i])):
            assert abs(last[f"d_{name}_by_{by}"] - expected) < 1e-6 * max(1, abs(expected)), (name, by)


def test_hdf5_and_plot(driven, tmp_path):
    refdyn("sim", driven, "--until", 0.2, "-o", tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["q"].shape[1] == 2 and file["states/b"].attrs["units"] in (b"A", "A") and file["states/a"][0] == 0.1
    refdyn("plot", tmp_path / "run.h5", "-o", tmp_path / "run.svg")
    refdyn("view", tmp_path / "run.h5", "-o", tmp_path / "run.html")
    assert (tmp_path / "run.svg").stat().st_size > 1000 and (tmp_path / "run.html").stat().st_size > 1000


# ---- Python ----

def test_python(package, driven):
    arm = package.Model(driven)
    assert arm.coordinates == ("arm_theta", "tip_theta", "a", "b") and arm.state_names == ("a", "b") and list(arm.qd0) == [0, 0, 0.1, 0.2]
    run, _, _ = motion(driven, "--until", 0.5, "--every", 0.25, "--tol", 1e-9)
    found = arm.simulate(0.5, tol=1e-9, every=0.25)
    assert all(numpy.array_equal(found[name].values, run[name]) for name in NAMES) and found["b"].attrs["units"] == "A"
    q, qd = arm.states(found)
    assert numpy.array_equal(qd[:, 2:], found[["a", "b"]].to_array().values.T) and numpy.array_equal(q[:, 0], found.arm_theta)
    turning = arm.motion(tol=1e-9)
    turning.advance(0.5)
    assert abs(turning.states["a"] - run["a"][-1]) < 1e-8 and turning.state.shape == (2, 4)
    q, qd = arm.step(arm.q0, arm.qd0, 0.0, 0.5, method="rk8", steps=200)
    assert numpy.max(numpy.abs(numpy.append(q[:2], qd) - [run[name][-1] for name in NAMES])) < 1e-8
    qdd = arm.qdd(arm.q0, arm.qd0)
    assert abs(qdd[3] - (0.7 - 0.1 - 0.5 * 0.2 ** 3)) < 1e-15
    rest, said = arm.statics(), json.loads(refdyn("statics", driven).stdout)
    assert float(rest["a"]) == said["states"]["a"] and float(rest["arm_theta"]) == said["q"][0]
    modes, linear = arm.modes(), arm.linearise()
    assert modes["shape_of_states"].shape == (modes.sizes["mode"], 2) and list(linear["state"].values) == NAMES
    from_rest = arm.simulate(0.1, from_="statics", tol=1e-9)
    assert abs(from_rest["a"].values[-1] - float(rest["a"])) < 1e-6
    start = numpy.array([0.0, 0.0, 0.3, -0.4])
    assert arm.simulate(0.1, qd=start)["b"].values[0] == -0.4
    derived = arm.simulate(0.2, derivatives=["b", "i0"], tol=1e-9)
    assert numpy.allclose(derived["d_a"].sel(parameter="b"), derived["d_a"].sel(parameter="i0"), atol=1e-7)
    cases = arm.batch({"b": [0.1, 0.2, 0.3]}, 0.25)
    assert abs(cases["a"].values[1] - run["a"][1]) < 1e-5


# ---- FMUs ----

def test_model_exchange(driven, tmp_path):
    """States are those of joints, then the continuous ones, with derivatives and nominal values."""
    refdyn("export", driven, "--fmu", "2.0", "-o", tmp_path / "a.fmu")
    zipfile.ZipFile(tmp_path / "a.fmu").extractall(tmp_path)
    text = (tmp_path / "modelDescription.xml").read_text()
    place = {name: int(number) for name, number in re.findall(r'<ScalarVariable name="(.*?)" valueReference="(\d+)"', text)}
    assert "der(a)" in place and "a_d" not in place and text.count("<Unknown", text.index("<Derivatives>"), text.index("</Derivatives>")) == 6
    library = ctypes.CDLL(str(tmp_path / "binaries" / "linux64" / "driven.so"))
    logger = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(lambda *words: None)

    class Callbacks(ctypes.Structure):
        _fields_ = [("logger", type(logger)), *((name, ctypes.c_void_p) for name in ("allocate", "release", "finished", "environment"))]
    callbacks = Callbacks(logger)
    instantiate = library.fmi2Instantiate
    instantiate.restype = ctypes.c_void_p
    guid = re.search(r'guid="(.*?)"', text)[1].encode()
    component = ctypes.c_void_p(instantiate(b"a", 0, guid, b"", ctypes.byref(callbacks), 0, 0))
    assert library.fmi2SetupExperiment(component, 0, ctypes.c_double(0), ctypes.c_double(0), 0, ctypes.c_double(1)) == 0
    assert library.fmi2EnterInitializationMode(component) == 0 and library.fmi2ExitInitializationMode(component) == 0
    info = (ctypes.c_char * 64)()
    assert library.fmi2NewDiscreteStates(component, info) == 0 and library.fmi2EnterContinuousTimeMode(component) == 0
    state = numpy.array([0.4, -0.2, 0.6, 0.5, -0.3, 0.8])
    numbers = (ctypes.c_double * 6)(*state)
    assert library.fmi2SetContinuousStates(component, numbers, ctypes.c_size_t(6)) == 0
    assert library.fmi2GetDerivatives(component, numbers, ctypes.c_size_t(6)) == 0
    assert numpy.max(numpy.abs(numpy.array(numbers) - rates(driven, state))) < 1e-12
    assert library.fmi2GetContinuousStates(component, numbers, ctypes.c_size_t(6)) == 0 and list(numbers) == list(state)
    references = (ctypes.c_uint * 2)(place["a"], place["der(b)"])
    values = (ctypes.c_double * 2)()
    assert library.fmi2GetReal(component, references, ctypes.c_size_t(2), values) == 0
    assert values[0] == -0.3 and abs(values[1] - rates(driven, state)[5]) < 1e-12


def test_drives_refuse_states(tmp_path):
    model = tmp_path / "lag.lua"
    model.write_text('''local rd = require "refdyn"
return rd.model {
  name = "lag", links = { { "arm", joint = "theta", mass = 2, center = { 1, 0, 0 } } },
  states = function(s) return { rd.state { "lag", rate = s.qd.arm_theta - s.states.lag } } end,
  constraints = function(s) return { rd.position { s.q.arm_theta - 0.3 * rd.smoothstep(s.t, 0, 1, 5) } } end,
  drives = { "arm_theta" },
}
''')
    failed = refdyn("sim", model, "--realise", "--until", 1, "-o", tmp_path / "run.csv", status=1)
    assert failed.stderr == f"{model}:4: lag: a continuous state, which --realise does not allow\n" and not (tmp_path / "run.csv").exists()


def test_fits_and_plans(tmp_path):
    """The start of a state is found like that of a coordinate."""
    model, plan = tmp_path / "motor.lua", tmp_path / "plan.lua"
    model.write_text(MOTOR.read_text().replace('unit = "A"', 'unit = "A", start = 1.5'))
    refdyn("sim", model, "--until", 0.1, "--every", 0.002, "--tol", 1e-10, "-o", tmp_path / "run.csv")
    refdyn("fit", MOTOR, tmp_path / "run.csv", "--set", "R=0.9", "--vary", "R,i", "--noise", "rotor_psi_d=1e-3", "--tol", 1e-10, "-o", tmp_path / "fit.json")
    found = json.loads((tmp_path / "fit.json").read_text())
    assert abs(found["values"]["i"] - 1.5) < 1e-5 and abs(found["values"]["R"] - 0.8) < 1e-5 and found["starts_tried"] == 1
    plan.write_text('''local rd = require "refdyn"
return rd.plan { vary = { i = rd.within(-20, 20) }, t_end = 0.05, minimise = "i", within = { rd.at_end("rotor_psi_d", { from = 14 }) }, starts = 5 }
''')
    refdyn("plan", MOTOR, plan, "-o", tmp_path / "plan.json")
    start = json.loads((tmp_path / "plan.json").read_text())["parameters"]["i"]
    run, _, _ = motion(MOTOR, "--parameters", tmp_path / "plan.json", "--until", 0.05, "--tol", 1e-10)
    assert -19 < start < 19 and abs(run["rotor_psi_d"][-1] - 14) < 1e-6
