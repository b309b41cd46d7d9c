"""Equilibria under rows: compared with the least energy of formulas written by hand and with closed forms; messages and refusals."""
import json
import math
import re

import numpy
import pytest

from least_energy import gradient, least_energy, negative_directions
from program import MODELS, REFERENCE, TESTS, refdyn

sin, cos, pi = numpy.sin, numpy.cos, numpy.pi


def statics(model, *arguments, state=None, folder=None, status=0):
    if state is not None:
        (folder / "state.json").write_text(json.dumps(state))
        arguments = (*arguments, "--state", folder / "state.json")
    done = refdyn("statics", model, *arguments, status=status)
    return (json.loads(done.stdout), done.stderr) if status == 0 else done.stderr


def wrapped(angles):
    return (numpy.asarray(angles) + pi) % (2 * pi) - pi


def agree(found, wanted, limit=1e-10):
    assert abs(wrapped(numpy.subtract(found, wanted))).max() < limit, (found, wanted)


# ---- The four-bar linkage ----

A, B, C, D, G = 0.2, 0.6, 0.45, 0.55, 9.81


def four_bar(torque):
    """Energy as a function of the angles of crank, coupler and rocker relative to the ground."""
    def energy(x):
        per_length = 2700 * 0.04 * 0.01 * G
        return (per_length * (A**2 / 2 * sin(x[0]) + B * (A * sin(x[0]) + B / 2 * sin(x[1])) + C**2 / 2 * sin(x[2]))
                - torque * x[0])

    def rows(x):
        return numpy.array([A * cos(x[0]) + B * cos(x[1]) - D - C * cos(x[2]), A * sin(x[0]) + B * sin(x[1]) - C * sin(x[2])])
    return energy, rows


@pytest.mark.parametrize("joints", ["planar", "spatial"])
@pytest.mark.parametrize("torque", [0, 0.317, 0.913])
def test_four_bar(joints, torque, tmp_path):
    energy, rows = four_bar(torque)
    found, said = statics(MODELS / "fourbar.lua", "--set", f"joints={joints}", "--way", "downhill", state={"inputs": {"torque": torque}},
                          folder=tmp_path)
    x, _ = least_energy(energy, rows, [1.1, 0.6, 1.5])
    agree(found["q"], [x[0], x[1] - x[0], x[2]])
    assert found["stability"] == "stable" and "warning" not in said and found["phi"] < 1e-14 and found["residual"] < 1e-13
    assert len(found["rows"]) == len(found["lambda"]) == (2 if joints == "planar" else 5)


def test_four_bar_that_stands(tmp_path):
    """The raised load leads to the upper equilibrium, which is reported."""
    found, said = statics(MODELS / "fourbar.lua", state={"inputs": {"torque": 0.317}}, folder=tmp_path)
    q = found["q"]
    unstable, slope = negative_directions(*four_bar(0.317), [q[0], q[0] + q[1], q[2]])
    assert unstable == found["unstable"] == 1 and slope < 1e-12
    assert "refdyn: warning: this equilibrium is unstable in 1 direction, coupler_psi moves most; --way downhill finds a stable one\n" in said


def test_four_bar_without_equilibrium():
    """Its motor is too strong: the motion starts elsewhere."""
    for way, last in {"load": "reached only up to 0.782 of the load", "downhill": "the forces lead to no equilibrium"}.items():
        said = statics(MODELS / "fourbar.lua", "--way", way, status=3)
        assert "Newton's iteration did not converge, coordinate" in said and last in said, said


def test_change_point():
    """Equal cranks from 1 rad down by steps of 0.5 rad: where all bars are collinear a row has no coefficients, and the path passes
    through."""
    found, _ = statics(TESTS / "models" / "four_bar.lua", "--way", "downhill")
    agree(found["q"], [-pi / 2, pi / 2, -pi / 2], 1e-14)
    assert found["stability"] == "stable" and found["residual"] < 1e-14 and abs(found["lambda"][1] - 9.81 * 1.2 / 2) < 1e-13


# ---- The slider-crank ----

@pytest.mark.quick
def test_slidercrank(tmp_path):
    """Its drive and its guide hold it, the drive at the time of the state. With the rod's root held off the straight rod's angle, the rod
    bends."""
    r, l, t, dl = 0.15, 0.5, 0.217, 0.5 / 3
    crank = 0.6 + 15 * (t / 2 - 0.3 / (2 * pi) * math.sin(pi * t / 0.3))
    straight = -math.asin(r * math.sin(crank) / l) - crank
    found, _ = statics(MODELS / "slidercrank.lua", state={"t": t}, folder=tmp_path)
    agree(found["q"], [crank, straight, 0, 0, 0], 1e-12)
    held = straight + 0.113
    stiffness = 7e10 * 0.02 * 0.008**3 / 12 / dl

    def rows(x):
        angles = numpy.cumsum([x[0], held, x[1], x[2], x[3]])
        rise = sum(length * sin(angle) for length, angle in zip([dl / 2, dl, dl, dl / 2], angles[1:]))
        return numpy.array([x[0] - crank, r * sin(angles[0]) + rise])
    x, force = least_energy(lambda x: stiffness / 2 * (x[1]**2 + x[2]**2 + x[3]**2), rows, [crank, 0, 0, 0])
    found, _ = statics(MODELS / "slidercrank.lua", "--hold", "rod_psi", state={"t": t, "q": [0.6, held, 0, 0, 0]}, folder=tmp_path)
    agree(found["q"], [x[0], held, *x[1:]])
    assert found["rows"] == ["drive crank_psi", "guide y"] and found["stability"] == "stable"
    # multipliers u^T lambda = -Q: those of the least energy with the other sign
    assert abs(numpy.subtract(found["lambda"], -force)).max() < 1e-9 * abs(force).max()


# ---- Bricard's linkage ----

def turn(axis, angle):
    c, s = cos(angle), sin(angle)
    return numpy.array({"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
                        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis])


def bricard(x):
    """Heights of the rods' centres, then the closing error at the last hinge."""
    at, R, heights = numpy.zeros(3), numpy.eye(3), []
    for angle, (axis, tip) in zip(x, [("y", (1, 0, 0)), ("z", (0, 1, 0)), ("x", (0, 0, 1)), ("y", (-1, 0, 0)), ("z", (0, -1, 0))]):
        R = R @ turn(axis, angle)
        heights.append((at + R @ tip / 2)[1])
        at = at + R @ tip
    return sum(heights), numpy.array([*(at - [0, 0, 1]), R[1, 0], R[2, 0]])


def test_bricard():
    """One of five rows is redundant."""
    energy, rows = (lambda x: 9.81 * bricard(x)[0]), (lambda x: bricard(x)[1])
    found, _ = statics(MODELS / "bricard.lua", "--way", "downhill")
    x, _ = least_energy(energy, rows, numpy.zeros(5))
    agree(found["q"], x)
    assert found["stability"] == "stable" and found["residual"] < 1e-13
    upper, said = statics(MODELS / "bricard.lua")
    unstable, slope = negative_directions(energy, rows, upper["q"])
    assert unstable == upper["unstable"] == 1 and slope < 1e-12 and "unstable in 1 direction" in said


# ---- The manipulator with its programme ----

L, d, E, nu, rho = 2, 0.01413200743, 2.1e11, 0.3, 7801
xc, a, b, column, arm = 0.4317, 0.875, 1.75, 0.217, 0.713


def manipulator(x, column=column, arm=arm):
    """Energy and the ellipse's residual as functions of base_z, three elements' psi, theta, phi, and effector_z."""
    dl, per_length = L / 3, rho * pi * d**2 / 4
    bending, torsion = E * pi * d**4 / 64 / dl, E / (2 * (1 + nu)) * pi * d**4 / 32 / dl
    at, R = numpy.array([0, 0, x[0] + 1.1]), turn("z", column) @ turn("x", pi / 2) @ turn("z", arm)
    height = per_length * dl / 2 * (at + R @ [dl / 4, 0, 0])[2]
    at, energy = at + R @ [dl / 2, 0, 0], 1e4 / 2 * x[0]**2
    for r, length in enumerate([dl, dl, dl / 2]):
        psi, theta, phi = x[1 + 3 * r:4 + 3 * r]
        R = R @ turn("z", psi) @ turn("y", theta) @ turn("x", phi)
        height = height + per_length * length * (at + R @ [length / 2, 0, 0])[2]
        at = at + R @ [length, 0, 0]
        energy = energy + bending / 2 * (psi**2 + theta**2) + torsion / 2 * phi**2
    at = at + x[10] * R[:, 0]
    height = height + 2 * at[2] + (18.54331045 + 10) * x[0]
    return energy + 9.81 * height, numpy.array([((at[0] - xc) / a)**2 + (at[1] / b)**2 - 1])


def test_manipulator_with_its_programme(tmp_path):
    """The end-effector hangs on the ellipse, the column and the arm's root are held: bent in two planes, and turned."""
    x, force = least_energy(lambda x: manipulator(x)[0], lambda x: manipulator(x)[1], numpy.zeros(11))
    found, _ = statics(REFERENCE, "--hold", "column_psi,arm_psi", "--set", f"xc={xc}", state={"q": [0, column, arm, *[0] * 10]}, folder=tmp_path)
    agree(found["q"], [x[0], column, arm, *x[1:]])
    assert found["rows"] == ["ellipse"] and found["stability"] == "stable" and len(found["hold_force"]) == 2
    assert abs(found["lambda"][0] + force[0]) < 1e-9 * abs(force[0]) and abs(found["q"][4]) > 1e-3
    # forces that hold the column and the arm: the slope of energy + force . rows by their angles
    slope = gradient(lambda held: numpy.array([manipulator(x, *held)[0] + force @ manipulator(x, *held)[1]]), numpy.array([column, arm]))[0]
    assert abs(found["hold_force"] - slope).max() < 1e-9 * abs(slope).max()


def test_programme_that_begins_with_the_motion():
    """Without a value for its anchored parameter the programme has no effect: the model's own statics are those of the chapter."""
    found, said = statics(REFERENCE)
    assert found["rows"] == [] == found["lambda"]
    assert said == ("refdyn: the row ellipse begins where the motion does and has no part in statics; --set xc=VALUE includes it\n"
                    "refdyn: the row rise is not a row of positions and has no part in statics or stability\n")
    said = statics(REFERENCE, "--set", "n_rfe=1", "--hold", "column_psi,arm_psi", "--way", "downhill", status=3)
    assert "the forces lead to no equilibrium" in said


LOCKED = """local rd = require "refdyn"
local where = rd.option("where", "start", { "start", "given" })
return rd.model { name = "locked", gravity = { 0, -10, 0 },
  links = { { "a", joint = "x, y", start = { x = 0.3, y = 0.7 }, mass = 2, spring = { x = 100, y = 100 } } },
  points = { tip = "a" },
  constraints = function(s)
    return { rd.lock { "a_x", where == "given" and 0.11 or nil }, %s }
  end }
"""


@pytest.mark.parametrize("where, x", [("start", 0.3), ("given", 0.11)])
def test_lock(where, x, tmp_path):
    """It holds the coordinate at its start or at the given value."""
    (tmp_path / "locked.lua").write_text(LOCKED % "")
    found, _ = statics(tmp_path / "locked.lua", "--set", f"where={where}")
    assert numpy.allclose(found["q"], [x, -0.2], rtol=0, atol=1e-14) and numpy.allclose(found["lambda"], [100 * x], rtol=0, atol=1e-12)


SLIDER = """local rd = require "refdyn"
return rd.model { name = "slider",
  links = { { "crank", joint = "psi", mass = 1, start = { psi = 0.6 } },
            { "rod", on = "crank", at = { 0.2, 0, 0 }, joint = "psi", mass = 2, inertia = { zz = 0.05 }, start = { psi = -0.8278226675295883 } },
            { "slide", joint = "x", mass = 3, start = { x = 0.6521473577374979 } } },
  points = { P = { on = "rod", at = { 0.5, 0, 0 } } },
  constraints = function() return { rd.loop { "P", "slide", keep = "x, y" }, rd.lock { "crank_psi", %r } } end }
"""


@pytest.mark.parametrize("angle", [2.317, 5, -7.193, 41.37])
def test_lock_far_from_the_start(angle, tmp_path):
    """The linkage follows the crank through the required number of turns; the rod makes no turns of its own."""
    (tmp_path / "slider.lua").write_text(SLIDER % angle)
    found, _ = statics(tmp_path / "slider.lua")
    tilt = math.asin(0.4 * sin(angle))
    assert numpy.allclose(found["q"], [angle, -angle - tilt, 0.2 * cos(angle) + 0.5 * cos(tilt)], rtol=0, atol=1e-13)


# ---- Stability, and loads that are too large ----

COLUMN = """local rd = require "refdyn"
local P, spring = rd.parameter("P", 1, "N"), rd.parameter("c", 3, "N m")
return rd.model { name = "column", gravity = { 0, -1, 0 },
  links = { { "lower", joint = "psi", turn = { { "z", rd.pi / 2 } }, mass = 1e-13, inertia = { zz = 0.001 }, spring = { psi = spring } },
            { "upper", on = "lower", at = { 1, 0, 0 }, joint = "psi", mass = 1e-13, inertia = { zz = 0.001 }, spring = { psi = spring } },
            { "load", on = "upper", at = { 1, 0, 0 }, mass = P } },
  points = { tip = "load" } }
"""


def test_buckling(tmp_path):
    """Two rods of 1 m on springs of 3 N m under P buckle at P = (3 -+ sqrt(5)) / 2 * 3 N; the upright position remains an equilibrium."""
    (tmp_path / "column.lua").write_text(COLUMN)
    for P, unstable in (1.14, 0), (1.15, 1), (7.85, 1), (7.86, 2):
        found, said = statics(tmp_path / "column.lua", "--set", f"P={P}")
        assert found["q"] == [0, 0] and found["unstable"] == unstable, (P, found)
        assert ("warning: this equilibrium is unstable in %d direction" % unstable in said) == (unstable > 0)
    found, said = statics(tmp_path / "column.lua", "--set", "P=2.3", "--way", "downhill")
    x, _ = least_energy(lambda x: 1.5 * (x[0]**2 + (x[1] - x[0])**2) + 2.3 * (cos(x[0]) + cos(x[1])), lambda x: numpy.zeros(1) * x[0],
                        numpy.sign(found["q"][0]) * numpy.array([0.5, 0.7]))
    agree(found["q"], [x[0], x[1] - x[0]])
    assert found["stability"] == "stable" and said == ""


TRUSS = """local rd = require "refdyn"
local P = rd.parameter("P", 1, "N")
return rd.model { name = "truss",
  links = { { "bar", joint = "psi, x", start = { psi = rd.atan2(0.3, 1), x = rd.sqrt(1.09) }, mass = 1, inertia = { zz = 0.1 } } },
  points = { top = "bar" },
  forces = function(s) return { bar_x = -200 * (s.q.bar_x - rd.sqrt(1.09)), rd.force { "bar", { 0, -P, 0 } } } end,
  constraints = function() return { rd.loop { "top", { on = "ground", at = { 1, 0, 0 } }, keep = "x" } } end }
"""


def test_snap_through(tmp_path):
    """Half of a shallow truss of two bars under P: below the limit point the equilibrium follows the load, above it the path leads to the
    other side."""
    (tmp_path / "truss.lua").write_text(TRUSS)
    stretch = lambda y: math.sqrt(1 + y * y)
    bears = lambda y: -200 * (stretch(y) - math.sqrt(1.09)) * y / stretch(y)

    def height(P, low, high):
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if bears(middle) > P else (low, middle)
        return low
    limit = max(bears(y) for y in numpy.linspace(0, 0.3, 20001))
    for P, way, y in ((0.9 * limit, "load", height(0.9 * limit, 0.18, 0.3)), (1.3 * limit, "path", height(1.3 * limit, -1, -0.3)),
                      (1.3 * limit, "downhill", height(1.3 * limit, -1, -0.3))):
        found, said = statics(tmp_path / "truss.lua", "--set", f"P={float(P)!r}", "--way", way)
        assert abs(found["points"]["top"][1] - y) < 1e-12 and abs(found["points"]["top"][0] - 1) < 1e-14 and found["stability"] == "stable"
        assert ("refdyn: 2 limit points of the load passed\n" in said) == (way == "path"), said
    said = statics(tmp_path / "truss.lua", "--set", f"P={float(1.3 * limit)!r}", status=3)
    assert "refdyn: equilibrium reached only up to 0.774 of the load\nrefdyn: --way path passes limit points of the load;" in said, said


HORIZONTAL = """local rd = require "refdyn"
return rd.model { name = "pendulum", gravity = { 0, -9.81, 0 },
  links = { { "a", joint = "psi", mass = 1, center = { 1, 0, 0 }, inertia = { zz = 0.1 } } } }
"""


def test_start_at_a_limit_point(tmp_path):
    """A horizontal pendulum has no stiffness: the load alone cannot be increased."""
    (tmp_path / "pendulum.lua").write_text(HORIZONTAL)
    for way in "path", "downhill":
        found, _ = statics(tmp_path / "pendulum.lua", "--way", way)
        assert abs(found["q"][0] + pi / 2) < 1e-14 and found["stability"] == "stable"
    said = statics(tmp_path / "pendulum.lua", status=3)
    assert said.endswith("refdyn: --hold keeps free coordinates at their start\n"
                         "refdyn: --way path passes limit points of the load; --way downhill follows the forces\n"), said


def test_neutral_across_coordinates():
    """A floating body with arms settles downhill on its springs at any place."""
    found, _ = statics(MODELS / "branched.lua", "--way", "downhill")
    assert found["stability"] == "neutral in 4 directions" and found["residual"] < 1e-11


@pytest.mark.quick
def test_neutral(tmp_path):
    """A wheel that nothing holds or drives."""
    (tmp_path / "wheel.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "wheel",\n'
                                        '  links = { { "wheel", joint = "psi", mass = 1, inertia = { zz = 1 } },\n'
                                        '            { "mass", joint = "x", mass = 1, spring = { x = 3 } } } }\n')
    found, said = statics(tmp_path / "wheel.lua")
    assert (found["stability"], found["unstable"], found["neutral"]) == ("neutral in 1 direction", 0, 1) and "equilibrium" not in said


@pytest.mark.parametrize("P, unstable", [(0.917, 0), (17.3, 2)])
def test_without_potential(P, unstable, tmp_path):
    """A follower load on the tip: the growing modes of M y'' + [[2 c - P, P - c], [-c, c]] y = 0 are counted and reported."""
    follows = '  forces = function() return { rd.force { "load", { -P, 0, 0 }, axes = "load" } } end,\n'
    model = COLUMN.replace("gravity = { 0, -1, 0 },", "").replace("  points =", follows + "  points =")
    (tmp_path / "column.lua").write_text(model)
    found, said = statics(tmp_path / "column.lua", "--set", f"P={P}")
    mass = P + 0.001 * numpy.eye(2)
    rates = numpy.sqrt(numpy.linalg.eigvals(-numpy.linalg.solve(mass, [[6 - P, P - 3], [-3, 3]])).astype(complex))
    assert (abs(rates.real) > 1e-9 * abs(rates)).sum() == unstable == found["unstable"] and found["potential"] is False
    assert found["criterion"] == "linear motion"
    assert "; its forces have no potential, so the growing modes were counted; refdyn modes shows them\n" in said


ASSISTED = """local rd = require "refdyn"
local p = rd.parameters { { "gain", 1 }, { "turn", 0 } }
return rd.model { name = "assisted", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1.3, spring = { x = 2 }, damper = { x = 0.1 } }, { "b", joint = "psi", mass = 1, inertia = { zz = 0.7 }, spring = { psi = 3 } } },
  forces = function(s) return { a_x = -p.gain * s.qd.a_x + p.turn * s.qd.b_psi, b_psi = -p.turn * s.qd.a_x } end%s }
"""
ROW = ',\n  constraints = function(s) return { rd.position { s.q.a_x - 2 * s.q.b_psi } } end'


@pytest.mark.parametrize("row", ["", ROW])
@pytest.mark.parametrize("gain, turn, grows", [(1, 0, False), (-0.1, 0.3, False), (-0.3, 0, True), (-0.3, 4, True), (0.4, 4, False)])
def test_negative_damping(row, gain, turn, grows, tmp_path):
    """The gain of a controller has the wrong sign: the potential has a minimum, and the motion grows. Gyroscopic terms add no energy."""
    (tmp_path / "assisted.lua").write_text(ASSISTED % row)
    found, said = statics(tmp_path / "assisted.lua", "--set", f"gain={gain}", "--set", f"turn={turn}")
    assert found["potential"] is True and found["criterion"] == ("linear motion" if grows else "potential")
    assert ("; dampers or states can add energy there, so the growing modes were counted; refdyn modes shows them\n" in said) == grows
    modes = json.loads(refdyn("modes", tmp_path / "assisted.lua", "--set", f"gain={gain}", "--set", f"turn={turn}").stdout)
    assert modes["unstable"] == found["unstable"] and (found["unstable"] > 0) == grows


# ---- Starts of motions ----

def test_motion_from_an_unstable_equilibrium(tmp_path):
    """A warning is printed, and the motion starts."""
    (tmp_path / "column.lua").write_text(COLUMN)
    done = refdyn("sim", tmp_path / "column.lua", "--set", "P=2", "--from", "statics", "--until", 0.01, "-o", tmp_path / "run.csv",
                  "--summary", tmp_path / "summary.json")
    assert "refdyn: warning: this equilibrium is unstable in 1 direction, lower_psi moves most; --way downhill finds a stable one\n" in done.stderr
    assert "start        equilibrium, unstable in 1 direction\n" in done.stderr
    assert json.loads((tmp_path / "summary.json").read_text())["equilibrium"] == "unstable in 1 direction"
    done = refdyn("sim", tmp_path / "column.lua", "--until", 0.01, "-o", tmp_path / "run.csv")
    assert "equilibrium" not in done.stderr


def test_loop_starts_from_its_equilibrium(tmp_path):
    """A linkage stays at the equilibrium from statics, also in a batch, which counts the unstable ones."""
    model = MODELS / "bricard.lua"
    refdyn("sim", model, "--from", "statics", "--way", "downhill", "--until", 0.5, "--every", 0.5, "-o", tmp_path / "run.csv")
    header, first, last = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()]
    assert abs(numpy.array(first[1:6], float) - numpy.array(last[1:6], float)).max() < 1e-9
    (tmp_path / "cases.csv").write_text("m\n1\n2\n")
    for way, warning in ("downhill", ""), ("load", "refdyn: warning: 2 cases start from an unstable equilibrium, the first is case 0\n"):
        done = refdyn("batch", model, "--table", tmp_path / "cases.csv", "--until", 0.01, "--from", "statics", "--way", way,
                      "-o", tmp_path / f"{way}.csv")
        assert ("unstable" in done.stderr) == bool(warning) and warning in done.stderr, done.stderr
    q = [float(x) for x in (tmp_path / "downhill.csv").read_text().splitlines()[1].split(",")]
    assert all(any(abs(x - float(y)) < 1e-9 for x in q) for y in first[1:6]), (q, first)


SHALLOW = """local rd = require "refdyn"
local P = rd.parameter("P", 0, "N")
return rd.model { name = "shallow", links = { { "s", joint = "z", mass = 1, start = { z = 0.4 } } }, points = { S = "s" },
  forces = function(s) return { s_z = -P,
    rd.spring { "S", { on = "ground", at = { 1, 0, 0 } }, stiffness = 1000, rest = rd.sqrt(1.16) },
    rd.spring { "S", { on = "ground", at = { -1, 0, 0 } }, stiffness = 1000, rest = rd.sqrt(1.16) } } end }
"""


def test_batch_counts_jumps_over_limit_points(tmp_path):
    """A truss of two bars that snaps through at about 22.9 N, as the same cases of `statics` report one by one."""
    (tmp_path / "shallow.lua").write_text(SHALLOW)
    loads = 20.3, 40, 0.7, 60
    (tmp_path / "cases.csv").write_text("P\n" + "".join(f"{P}\n" for P in loads))
    jumps = ["the growing load does not lead to it" in statics(tmp_path / "shallow.lua", "--set", f"P={P}")[1] for P in loads]
    assert jumps == [False, True, False, True]
    for way, count in ("load", 2), ("path", 0):
        done = refdyn("batch", tmp_path / "shallow.lua", "--table", tmp_path / "cases.csv", "--until", 0.01, "--from", "statics", "--way", way,
                      "-o", tmp_path / "runs.csv", "--summary", tmp_path / "summary.json")
        assert json.loads((tmp_path / "summary.json").read_text())["beyond_limit_point"] == count
        told = "refdyn: warning: 2 cases start from an equilibrium that the growing load does not lead to, the first is case 1\n"
        assert (told in done.stderr) == (count > 0) and ("warning" in done.stderr) == (count > 0), done.stderr


def test_batch_gives_what_a_programme_takes(tmp_path):
    """A column for xc: the ellipse is valid in each case, as in a single motion."""
    (tmp_path / "cases.csv").write_text("xc\n0.5417\n0.5391\n")
    common = ["--until", 1e-6, "--from", "statics", "--method", "rk8"]
    refdyn("batch", REFERENCE, "--table", tmp_path / "cases.csv", *common, "-o", tmp_path / "runs.csv")
    header, *rows = [line.split(",") for line in (tmp_path / "runs.csv").read_text().splitlines()]
    for row, xc in zip(rows, (0.5417, 0.5391)):
        found, _ = statics(REFERENCE, "--set", f"xc={xc}")
        ends = dict(zip(header, row))
        assert found["rows"] == ["ellipse"] and abs(found["points"]["E"][0] - xc - 0.875) < 1e-14
        assert max(abs(float(ends[name]) - value) for name, value in zip(found["coordinates"], found["q"])) < 1e-9, (ends, found)


# ---- What is refused ----

REFUSED = {
    "way": (["statics", MODELS / "fourbar.lua", "--way", "up"], 2, "--way: 'up' is not one of load, path, downhill"),
    "no row": (["statics", MODELS / "slidercrank.lua", "--release", "guid y"], 2,
               "--release: the model has no constraint row 'guid y'; did you mean \"guide y\"?"),
    "rate": (["statics", REFERENCE, "--release", "rise"], 2, "--release: rise is not a row of positions and has no part in statics; omit it"),
    "release": (["sim", REFERENCE, "--until", "1", "-o", "run.csv", "--release", "ellipse"], 2, "--release needs --from statics"),
    "way of a batch": (["batch", REFERENCE, "--table", "cases.csv", "--until", "1", "-o", "runs.csv", "--way", "path"], 2,
                       "--way needs --from statics"),
    "held": (["sim", REFERENCE, "--until", "1", "-o", "run.csv", "--from", "held"], 2,
             "refdyn sim: --from held needs --realise; write ./held for a file of this name"),
    "held in a batch": (["batch", REFERENCE, "--table", "cases.csv", "--until", "1", "-o", "runs.csv", "--from", "held"], 2,
                        "refdyn batch: --from held needs --realise; write ./held for a file of this name"),
    "way of modes": (["modes", MODELS / "fourbar.lua", "--at", "initial", "--way", "path"], 2, "--way needs --at statics"),
    "printed": (["statics", REFERENCE, "--set", "form=printed", "--set", "program=chapter"], 1,
                "manipulator: statics with constraint rows needs the corrected form; release the rows with --release ellipse"),
}


@pytest.mark.parametrize("which", REFUSED)
def test_refused(which, tmp_path):
    arguments, status, text = REFUSED[which]
    (tmp_path / "cases.csv").write_text("m_E\n2\n")
    done = refdyn(*arguments, status=status, cwd=tmp_path)
    assert text in done.stderr and done.stdout == "" and [path.name for path in tmp_path.iterdir()] == ["cases.csv"], done.stderr


def test_released():
    """A slider-crank without its guide leaves the rod free: nothing acts on it, and it stays."""
    found, _ = statics(MODELS / "slidercrank.lua", "--release", "guide y")
    assert found["rows"] == ["drive crank_psi"] and found["neutral"] == 1 and found["stability"] == "neutral in 1 direction"


def test_rows_that_cannot_be_met(tmp_path):
    """Out of reach; and two rows that contradict each other."""
    (tmp_path / "far.lua").write_text(LOCKED % "rd.position { s.q.a_x^2 + s.q.a_y^2 + 1, name = 'far' }")
    said = statics(tmp_path / "far.lua", status=3)
    assert re.search(r"^refdyn: locked: t = 0 s: Newton's iteration did not converge, constraint far$", said, re.M), said
    assert "refdyn: the start is off the programme by far: phi = 1." in said
    (tmp_path / "torn.lua").write_text(LOCKED % "rd.lock { 'a_x', 0.4, name = 'other' }")
    said = statics(tmp_path / "torn.lua", status=3)
    assert re.search(r"constraint (other|lock a_x)\n", said), said


def test_rates_of_a_state(tmp_path):
    _, said = statics(MODELS / "bricard.lua", state={"qd": [1, 0, 0, 0, 0]}, folder=tmp_path)
    assert said.startswith(f"{tmp_path}/state.json: warning: qd: statics sets all rates to 0\n")
