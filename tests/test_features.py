"""Every feature of the model language compared with values computed without it: by hand, or by a few lines of numpy."""
import json
import re

import mpmath
import numpy
import pytest
from numpy import cos, exp, pi, sin, sqrt

from program import TESTS, check, close, evaluate, motion, refdyn, settings
from test_gallery import torsion_constant

FINE = ["--method", "rk54", "--tol", "1e-10"]


def model(name):
    return TESTS / "models" / (name + ".lua")


def rotation(axis, angle):
    c, s = cos(angle), sin(angle)
    i, j, k = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}[axis]
    R = numpy.zeros((3, 3))
    R[i, i], R[j, j], R[k, k], R[j, k], R[k, j] = 1, c, c, -s, s
    return R


# ---- names of coordinates ----

def test_coordinates_with_chosen_names(tmp_path):
    """The equations equal those with LINK_JOINT. Functions, lists and outputs use the chosen name, fields of the link the joint's."""
    first, second, third = model("double_pendulum").read_text().split('joint = { "theta" }')
    lock = 'hold = { "knee" }, forces = function(s) return { knee = 0 * s.q.hip } end, points ='
    (tmp_path / "named.lua").write_text(f'{first}joint = "theta", coordinate = "hip"{second}joint = "theta", coordinate = "knee"{third}'.replace("points =", lock))
    state = {"q": [0.3, -0.7], "qd": [1.1, 0.4]}
    found, expected = evaluate(tmp_path / "named.lua", state), evaluate(model("double_pendulum"), state)
    assert found["coordinates"] == ["hip", "knee"] and found["M"] == expected["M"] and found["h"] == expected["h"]
    assert list(json.loads(refdyn("statics", tmp_path / "named.lua").stdout)["coordinates"]) == ["hip", "knee"]
    columns, _, _ = motion(tmp_path / "named.lua", "--until", "0.1", "--tol", "1e-8")
    plain, _, _ = motion(model("double_pendulum"), "--until", "0.1", "--tol", "1e-8")
    assert (columns["knee_d"] == plain["lower_theta_d"]).all() and "hip" in columns and "upper_theta" not in columns


# ---- bodies ----

def cylinder(mass, outer, inner, length, axis):
    along, across = mass * (outer**2 + inner**2) / 8, mass * ((outer**2 + inner**2) / 16 + length**2 / 12)
    return numpy.diag([along if name == axis else across for name in "xyz"])


SOLIDS = {  # mass, moments about the centre of mass along the body's axes
    "box": (7.2, 0.6 * numpy.diag([0.2**2 + 0.1**2, 0.3**2 + 0.1**2, 0.3**2 + 0.2**2])),
    "cylinder_x": (6 * pi, cylinder(6 * pi, 0.2, 0, 0.5, "x")),
    "cylinder_y": (6 * pi, cylinder(6 * pi, 0.2, 0, 0.5, "y")),
    "tube_z": (2.625 * pi, cylinder(2.625 * pi, 0.2, 0.15, 0.5, "z")),
    "sphere": (5.4 * pi, 5.4 * pi * 0.3**2 / 10 * numpy.eye(3)),
    "data": (3, numpy.array([[0.05, 0.005, -0.004], [0.005, 0.07, 0.003], [-0.004, 0.003, 0.06]])),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_solid(kind):
    """The mass matrix of a floating body at rest in the origin: slides x y z, turns about z, y, x."""
    mass, own = SOLIDS[kind]
    R = rotation("z", 0.4) @ rotation("x", -0.7)
    r = numpy.array([0.3, -0.2, 0.5]) + (R @ [0.1, 0, -0.2] if kind == "data" else 0)
    turns = numpy.eye(3)[::-1]
    inertia = R @ own @ R.T + mass * (r @ r * numpy.eye(3) - numpy.outer(r, r))
    coupling = mass * numpy.array([numpy.cross(turn, r) for turn in turns]).T
    expected = numpy.block([[mass * numpy.eye(3), coupling], [coupling.T, turns @ inertia @ turns.T]])
    check([close("M", evaluate(model("solid"), None, "--set", f"kind={kind}")["M"], expected, 1e-15)])


def test_bodies_of_one_link():
    """Moments add up, and so do the heights in the potential energy."""
    found = evaluate(model("bodies"), {"q": [0.7, 0], "qd": [0, 0]})
    turned = evaluate(model("bodies"), {"q": [0.7, pi / 2], "qd": [0, 0]})
    check([close("M", found["M"], [[18, 4], [4, 2.575]], 1e-14), close("Q", found["Q"], [-18 * 9.81, -4 * 9.81], 1e-14),
           close("potential", [turned["energy"]["potential"] - found["energy"]["potential"]],
                 [9.81 * (4 - 3 * 0.2 - 1.5 * 0.4)], 1e-14)])


# ---- forces ----

def loads(q, qd, on):
    """Q by virtual work, potential energy."""
    (x, psi), (xd, psid) = q, qd
    E, J = numpy.array([x + cos(psi), sin(psi)]), numpy.array([[1, -sin(psi)], [0, cos(psi)]])
    Ed, axes = J @ qd, numpy.array([[cos(psi), -sin(psi)], [sin(psi), cos(psi)]])
    to_high, to_side = numpy.array([1, 3]) - E, numpy.array([4, 0]) - E
    length = sqrt(to_high @ to_high)
    spring = 10 * (length - 1) * to_high / length
    damper = -5 * (to_high @ Ed) / length * to_high / length
    push = -7 * on * to_side / sqrt(to_side @ to_side)
    F = spring + damper + push + on * axes @ [1, 2] + [0, -3 * E[1]]
    Q = J.T @ F + [-0.25 * xd, 5 * on - 0.5 * numpy.tanh(psid / 0.1)]
    return Q, 5 * (length - 1)**2 + 1.5 * E[1]**2


@pytest.mark.parametrize("on", [0, 1])
@pytest.mark.parametrize("q, qd", [([0, 0], [0, 2]), ([0.3, 0.5], [-0.4, 0.07]), ([-0.5, 2.4], [1.1, -0.03])])
def test_loads(q, qd, on):
    found = evaluate(model("loads"), {"q": q, "qd": qd, "inputs": {"on": on}})
    Q, energy = loads(q, qd, on)
    check([close("Q", found["Q"], Q, 1e-14), close("energy", [found["energy"]["potential"]], [energy], 1e-14)])
    if q == [0, 0] and on:
        check([close("Q by hand", Q, [-6, 16.5], 1e-8), close("energy by hand", [energy], [20], 1e-14)])


def test_springs_of_coordinates():
    """Rest value, start and rate at the start, damper, gravity along x, and a coupling one to two."""
    run, _, _ = motion(model("springs"), "--until", 3, *FINE)
    m, c, k = 1.5 + 4 * 0.5, 7, 40
    decay, mean = c / (2 * m), 0.2 + 1.5 * 9.81 / k
    omega, offset = sqrt(k / m - decay**2), 0.5 - mean
    t = run["t"]
    x = mean + exp(-decay * t) * (offset * cos(omega * t) + (0.3 + decay * offset) / omega * sin(omega * t))
    check([close("cart", run["cart_x"], x, 1e-8), close("geared", run["geared_y"], 2 * x, 1e-8)])


# ---- rows ----

def close_rows(entry, q):
    """phi of one entry of closures.lua."""
    r, (psi, theta, phi) = numpy.array(q[:3]), q[3:]
    R = rotation("z", psi) @ rotation("y", theta) @ rotation("x", phi)
    X, Y, Z = R.T
    return {
        1: r + X - (2, 2, 3), 2: (r + X - (2, 2, 3))[:1], 3: X[1:], 4: X[1:2], 5: (r - (0, 1, 1))[1:],
        6: [r @ (0, 0.6, 0.8)], 7: [sqrt(r @ r) - 3], 8: [*(r - (1, 2, 2.5)), Z[0], Z[1]], 9: [r[1], r[2], X[1], X[2]],
        10: [*r, X[1], Y[2], Z[0]], 11: [*r, Y[2]], 12: r, 13: [r[0] - 0.25], 14: [r[1] - 2], 15: [r[2] - 1],
    }[entry]


@pytest.mark.parametrize("entry", range(1, 16))
def test_closures(entry):
    """phi at the start and at a state of no symmetry; there its first and second derivatives by differences."""
    options = ["--set", f"entry={entry}"]
    start = evaluate(model("closures"), None, *options)
    q, qd = numpy.array([0.4, 1.1, 2.3, 0.5, -0.3, 0.7]), numpy.array([0.2, -0.5, 0.3, 0.7, -0.4, 0.9])
    found = evaluate(model("closures"), {"q": q.tolist(), "qd": qd.tolist()}, *options)
    phi = lambda q: numpy.array(close_rows(entry, q))
    u = numpy.array([phi(q + step) - phi(q - step) for step in 1e-5 * numpy.eye(6)]).T / 2e-5
    v = (phi(q + 1e-4 * qd) - 2 * phi(q) + phi(q - 1e-4 * qd)) / 1e-8
    check([close("phi at the start", start["phi"], phi([1, 2, 3, 0.1, 0, 0]), 1e-15, 1),
           close("phi", found["phi"], phi(q), 1e-15, 1), close("psi", found["psi"], u @ qd, 1e-9, 1),
           close("u", found["u"], u, 1e-9, 1), close("v", found["v"], v, 1e-6, 1)])


def test_fourbar_closed_by_a_hinge():
    """The parallelogram keeps its angles, at the rate that follows from its height: one degree of freedom of three coordinates."""
    run, said, _ = motion(model("four_bar"), "--until", 0.5, *FINE)
    inertia = 0.3**2 * 1.2 + 2 * 0.75 * ((0.3**2 + 0.02**2) / 12 + 0.15**2)
    crank = run["crank_psi"]
    rate = -sqrt(2 * 9.81 * (1.2 * 0.3 + 2 * 0.75 * 0.15) * (sin(1) - sin(crank)) / inertia)
    assert said.count("redundant rows, left out: close 1 z, close 1 turn 1, close 1 turn 2\n") == 1, said
    check([close("coupler", run["coupler_psi"], -crank, 1e-12), close("rocker", run["rocker_psi"], crank, 1e-12),
           close("rate", run["crank_psi_d"], rate, 1e-8)])


def test_orientation():
    """The hand stays level, so the arm swings as with a mass at its end."""
    run, _, _ = motion(model("orientation"), "--until", 1, *FINE)
    arm, inertia = run["arm_theta"], 2 * ((1 + 0.05**2) / 12 + 0.25) + 0.5
    rate = sqrt(2 * 9.81 * 1.5 * numpy.maximum(sin(arm) - sin(0.2), 0) / inertia)
    off = evaluate(model("orientation"), {"q": [0.3, 0.4], "qd": [1.5, -0.7]})
    check([close("hand", run["hand_theta"], -arm, 1e-12), close("level", run["level"], 0 * arm, 1e-12, 1),
           close("rate of level", run["rate"], 0 * arm, 1e-12, 1),
           close("rate", run["arm_theta_d"][1:], rate[1:], 1e-8),
           close("phi", off["phi"], [-sin(0.7)], 1e-15), close("psi", off["psi"], [-0.8 * cos(0.7)], 1e-15)])


def test_turned_places():
    """Axes of a point and their rates, a load along them, an axis of a row, a place next to the tip of a turned beam."""
    found = evaluate(model("places"), {"q": [0.5, 0.7], "qd": [1.3, 0]})
    run, _, _ = motion(model("places"), "--until", 0.5, "--every", 0.1, "--start", "project", *FINE)
    lines = [close("Q", found["Q"], [3 * cos(0.2), 0], 1e-14), close("phi", found["phi"], [sin(1.1)], 1e-15),
             close("E", found["points"]["E"]["r"],
                   rotation("z", 0.5) @ ([0.2, 0, 0.1] + rotation("x", pi / 2) @ [0.5, 0.3, 0]), 1e-15)]
    for sample, (angle, rate) in enumerate(zip(run["arm_psi"], run["arm_psi_d"])):
        axes = rotation("z", angle + 0.3) @ rotation("y", 0.2)
        rates = rate * numpy.cross([0, 0, 1], axes.T).T
        lines += [close(axis, [run[f"{axis}_{part}{d}"][sample] for part in "xyz"], columns[:, i], 1e-14, 1)
                  for i, axis in enumerate("xyz") for d, columns in (("", axes), ("d", rates))]
    assert run["arm_psi_d"][-1] > 0.3
    check(lines)


# ---- samples ----

def natural_spline(knots, values, x, order=0):
    """Second derivatives of the natural cubic spline; straight beyond the ends."""
    knots, values, n = numpy.array(knots, float), numpy.array(values, float), len(knots)
    h = numpy.diff(knots)
    A, b = numpy.eye(n), numpy.zeros(n)
    for i in range(1, n - 1):
        A[i, i - 1:i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
        b[i] = 6 * ((values[i + 1] - values[i]) / h[i] - (values[i] - values[i - 1]) / h[i - 1])
    m = numpy.linalg.solve(A, b)
    i = min(max(numpy.searchsorted(knots, x) - 1, 0), n - 2)
    slope = (values[i + 1] - values[i]) / h[i] - h[i] * (2 * m[i] + m[i + 1]) / 6
    d = x - knots[i]
    cubic = numpy.array([values[i], slope, m[i] / 2, (m[i + 1] - m[i]) / (6 * h[i])])
    return [cubic @ [1, d, d**2, d**3], cubic @ [0, 1, 2 * d, 3 * d**2], cubic @ [0, 0, 2, 6 * d]][order]


def test_path_and_spline():
    """The hand passes all samples at constant speed and turns according to the spline, straight beyond its end."""
    run, _, _ = motion(model("follow_path"), "--until", 15, "--every", 0.01, "--start", "project", *FINE)
    hand, t = numpy.array([run["hand_x"], run["hand_y"]]), run["t"]
    step = sqrt((numpy.diff(hand)**2).sum(axis=0))
    lines = [close("speed", run["speed"], 0.1 + 0 * t, 1e-5), close("steps", step, 1e-3 + 0 * step, 1e-5),
             close("height", run["hand_z"], 0.5 + 0 * t, 1e-12)]
    for i in range(8):
        sample = numpy.array([cos(i * pi / 16), sin(i * pi / 16)])
        j = min(max(abs(hand.T - sample).sum(axis=1).argmin(), 1), len(t) - 2)
        along = (hand[:, j + 1] - hand[:, j - 1]) / sqrt(((hand[:, j + 1] - hand[:, j - 1])**2).sum())
        apart = sample - hand[:, j]
        lines.append(close(f"sample {i + 1}", [apart[0] * along[1] - apart[1] * along[0]], [0], 1e-6))
    inside = t <= 2
    nod = [natural_spline([0, 1, 2], [0, 1, 0], time) for time in t[inside]]
    beyond = -1.5 * (t[~inside] - 2)
    check(lines + [close("nod", run["nod"][inside], nod, 1e-14), close("beyond", run["nod"][~inside], beyond, 1e-14),
                   close("half", [nod[50]], [0.6875], 1e-14), close("turn", run["hand_psi"], run["nod"], 1e-12)])


# ---- functions ----

def ramp(c):
    return (1 - mpmath.cos(mpmath.pi * c)) / 2


FUNCTIONS = [
    mpmath.sin, mpmath.cos, mpmath.tan, mpmath.asin, mpmath.acos, mpmath.atan, lambda x: mpmath.atan2(x, 2 - x),
    mpmath.sinh, mpmath.cosh, mpmath.tanh, mpmath.exp, lambda x: mpmath.log(2 + x), lambda x: mpmath.sqrt(2 + x),
    lambda x: (2 + x)**mpmath.mpf(1.5), lambda x: (2 + x)**x, lambda x: abs(x) * x,
    lambda x: min(x * x, mpmath.mpf(0.1)), lambda x: max(x**3, x), lambda x: x**2 if x < 0.1 else 3 * x**3, lambda x: ramp((x + 1) / 3),
    lambda x: ((x + 1) / 3)**2 * (3 - 2 * (x + 1) / 3), None, lambda x: -2 * mpmath.tanh(x / mpmath.mpf(0.3)),
    lambda x: (1 - x) / (2 + x) + 3 * x,
]


@pytest.mark.parametrize("at", [-0.7, -0.03, 0.04, 0.55])
def test_functions(at):
    """Value, first and second derivative of every function, on both sides of its kinks."""
    n, rate = len(FUNCTIONS), 1.25
    found = evaluate(model("functions"), {"q": [at] * n, "qd": [rate] * n})
    assert len(found["phi"]) == n
    samples = [-1, 0, 0.5, 2], [0.5, -0.25, 1, 0]
    lines = []
    with mpmath.workdps(40):
        for i, f in enumerate(FUNCTIONS):
            expected = ([natural_spline(*samples, at, order) for order in range(3)] if f is None else
                        [float(mpmath.diff(f, mpmath.mpf(at), order)) for order in range(3)])
            row = found["u"][i]
            given = [found["phi"][i], row[i], found["v"][i] / rate**2]
            lines += [close(f"function {i + 1}, derivative {order}", [given[order]], [expected[order]], 1e-13,
                            max(1, abs(expected[order]))) for order in range(3)]
            lines.append(close(f"function {i + 1}, elsewhere", row[:i] + row[i + 1:], [0] * (n - 1), 0, 1))
    check(lines)


# ---- beams ----

def test_segments():
    """Stiffness and damping of each element as `check` lists them, and damping as it acts in forces of rates."""
    EI = {"square": 7e10 * 0.02**4 / 12, "tube": 7e10 * pi / 64 * (0.02**4 - 0.016**4)}
    listed = re.findall(r"boom_(\w+) \[rad\].* spring ([0-9.e+-]+).*, damper ([0-9.e+-]+)",
                        refdyn("check", model("beams")).stdout)
    square = [EI["square"] / 0.2] * 2 + [torsion_constant(0.02, 0.02) * 2.8e10 / 0.2]
    flat = [7e10 * 0.01 * 0.03**3 / 12 / 0.2, 7e10 * 0.03 * 0.01**3 / 12 / 0.2,
            torsion_constant(0.03, 0.01) * 2.8e10 / 0.2]
    tube = [EI["tube"] / 0.2] * 2 + [EI["tube"] / 1.25 / 0.2]
    stiffness = numpy.array(square + square + flat + tube)
    damping = numpy.array([2 * 0.01 / (2 * pi * 10) * s for s in square + square] + [0.7] * 6)
    names = [f"{turn}_{element}" for element in range(1, 5) for turn in ("psi", "theta", "phi")]
    assert [name for name, _, _ in listed] == names
    rates = numpy.arange(1, 13) / 10
    still = evaluate(model("beams"), {"qd": [0] * 12})
    # straight, where strains change like turns
    slow, moving = (evaluate(model("beams"), {"q": [0] * 12, "qd": list(qd)}) for qd in (0 * rates, rates))
    same = numpy.array(still["points"]["same"]["C"])
    check([close(name, [float(s)], [expected], 5e-6) for (name, s, _), expected in zip(listed, stiffness)]
          + [close("damping", numpy.array(slow["Q"]) - moving["Q"], damping * rates, 1e-7)]
          + [close("start", [still["energy"]["potential"]], [still_weight()], 1e-12)]
          + [close(name, still["points"][name]["r"], r, 1e-15) for name, r in {
              "same": [0.5, 0, 0], "middle": [0.5, 0, -0.1], "tip": [0.5 + 0.3 * cos(0.1), 0.3 * sin(0.1), 0]}.items()]
          + [close("what bends it", (abs(same) > 1e-15).any(axis=0), [True, True, False] * 2 + [False] * 6, 0)])


def still_weight():
    """Potential energy at the start: the springs are unloaded, the beam is level, the link hangs 0.1 m below."""
    return -0.3 * 9.81 * 0.1


@pytest.mark.parametrize("turn", ["psi", "theta", "phi"])
def test_curvature(turn):
    """At rest an arc of three elements with a right angle at its end; a moment E I 1.2 straightens it."""
    free, straight = (json.loads(refdyn("statics", model("curved"), *settings({"turn": turn, "M": M})).stdout)
                      for M in (0, -0.6))
    axis = {"psi": "z", "theta": "y", "phi": "x"}[turn]
    r = sum(rotation(axis, 0.36 * i) @ [length, 0, 0] for i, length in enumerate((0.15, 0.3, 0.3, 0.15)))
    check([close("arc", free["points"]["tip"], r + rotation(axis, 1.08) @ [0, 0.1, 0], 1e-14),
           close("straight", straight["points"]["tip"], [0.9, 0.1, 0], 1e-12)])


@pytest.mark.parametrize("mode", [1, 2, 3])
@pytest.mark.parametrize("tip", ["false", "true"])
def test_damping_ratio(tip, mode):
    """eta = 2 ratio / omega, omega from the frequency equation of a clamped beam with a mass at its tip."""
    load = 1 if tip == "true" else 0
    equation = lambda b: (1 + mpmath.cos(b) * mpmath.cosh(b)
                          + load * b * (mpmath.cos(b) * mpmath.sinh(b) - mpmath.sin(b) * mpmath.cosh(b)))
    guess = [[1.875, 4.694, 7.855], [1.248, 4.031, 7.134]][load][mode - 1]
    omega = float(mpmath.findroot(equation, guess))**2 * sqrt(2e11 / 7800) * 0.02 / 4
    found = evaluate(model("damping_ratio"), {"q": [0], "qd": [1]}, *settings({"tip": tip, "mode": mode}))
    check([close("damping", found["Q"], [-0.01 / omega * 2e11 * pi / 64 * 0.02**4], 1e-9)])


def test_file_beside_the_model():
    found = evaluate(model("beside/model"))
    check([close("M", found["M"], [[2 * (1 + 0.05**2) / 12 + 0.5]], 1e-15)])
