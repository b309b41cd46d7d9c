"""Chains of loops that pass states where rows lose rank cost as much as one loop; motions without changes of energy are not called
unresolved; a model states its unit of length."""
import json
import math

import numpy
import pytest
from scipy.integrate import solve_ivp

from program import MODELS, SCALE, check, close, motion, read_run, refdyn

# ---- Chains through states where rows lose rank ----

# N parallelograms of rods of 1 m and 1 kg in a row, the IFToMM benchmark A02: one degree of freedom, flat ten times in 10 s. In
# `deep`, all couplers form one chain, so that the row of each loop has entries in all coordinates before it.
CHAIN = """local rd = require "refdyn"
local n, deep, upright = rd.option("n", 10), rd.option("deep", 0), rd.pi / 2
local links, points, closes = {}, {}, {}
local function bar(name, at, on, angle, rate)
  links[#links + 1] = { name, on = on, at = at, joint = "psi", start = { psi = angle }, start_rate = { psi = rate }, mass = 1,
                        center = { 0.5, 0, 0 }, inertia = { zz = 1 / 12 } }
end
for i = 0, n do bar("rocker" .. i, { i, 0, 0 }, nil, upright, -1) end
for i = 1, n do
  if deep == 1 and i > 1 then bar("coupler" .. i, { 1, 0, 0 }, "coupler" .. (i - 1), 0, 0)
  else bar("coupler" .. i, { 1, 0, 0 }, "rocker" .. (i - 1), -upright, 1) end
  points["pin" .. i] = { on = "coupler" .. i, at = { 1, 0, 0 } }
  closes[i] = { "pin" .. i, { on = "rocker" .. i, at = { 1, 0, 0 } }, keep = "x, y" }
end
return rd.model { name = "bars", gravity = { 0, -9.81, 0 }, links = links, points = points,
  constraints = function(s)
    local rows = {}
    for i = 1, n do rows[i] = rd.loop(closes[i]) end
    return rows
  end }
"""
# N separate parallelograms; each starts at another angle and passes at another time.
APART = """local rd = require "refdyn"
local n, unit = rd.option("n", 3), rd.option("unit", 1)
local links, points, closes = {}, {}, {}
local function bar(name, x, on, angle)
  links[#links + 1] = { name, on = on, at = { x * unit, 0, 0 }, joint = "psi", start = { psi = angle }, mass = 1,
                        center = { 0.5 * unit, 0, 0 }, inertia = { zz = unit ^ 2 / 12 } }
end
for i = 1, n do
  local angle = rd.pi / 3 + 0.3 * i / n
  bar("crank" .. i, 2 * i, nil, angle)
  bar("coupler" .. i, 1, "crank" .. i, -angle)
  bar("rocker" .. i, 2 * i + 1, nil, angle)
  points["pin" .. i] = { on = "coupler" .. i, at = { unit, 0, 0 } }
  closes[i] = { "pin" .. i, { on = "rocker" .. i, at = { unit, 0, 0 } }, keep = "x, y" }
end
return rd.model { name = "apart", gravity = { 0, -9.81 * unit, 0 }, links = links, points = points,
  constraints = function(s)
    local rows = {}
    for i = 1, n do rows[i] = rd.loop(closes[i]) end
    return rows
  end }
"""
PASS, STOP = ("--singular", "pass"), ("--singular", "stop")


def written(folder, text, name="model.lua"):
    (folder / name).write_text(text)
    return folder / name


def angle_of(rockers, couplers, start, rate, times):
    """A parallelogram's angle: its rods turn, its couplers only shift."""
    inertia, moment = rockers / 3 + couplers, 9.81 * (rockers / 2 + couplers)
    return solve_ivp(lambda t, y: [y[1], -moment * numpy.cos(y[0]) / inertia], (0, times[-1]), [start, rate], method="DOP853",
                     rtol=1e-13, atol=1e-13, t_eval=times).y[0]


@pytest.mark.parametrize("deep, sizes", [(0, (10, 30)), (1, (12,))])
def test_steps_of_a_chain_do_not_grow(deep, sizes, tmp_path):
    """Ten crossings for every N; no more steps and little more CPU time than without passing; the error is no larger."""
    model = written(tmp_path, CHAIN)
    for n in sizes:
        arguments = ["--set", f"n={n}", "--set", f"deep={deep}", "--until", 10, "--tol", 1e-6]
        runs = {how: motion(model, *arguments, *how) for how in (STOP, PASS)}
        errors = {how: abs(run["rocker0_psi"] - angle_of(n + 1, n, math.pi / 2, -1, run["t"])).max() for how, (run, _, _) in runs.items()}
        stop, passed = runs[STOP][2], runs[PASS][2]
        assert passed["passed"]["count"] == 10 and passed["energy_error"] <= 1e-5 * SCALE
        assert passed["steps"] <= 110 * SCALE and passed["rejected"] <= 20 * SCALE, passed
        assert passed["cpu_s"] < 5 * max(stop["cpu_s"], 0.01) * SCALE, (passed["cpu_s"], stop["cpu_s"])
        assert errors[PASS] <= 2 * errors[STOP] * SCALE, errors


@pytest.mark.parametrize("method", ["rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12"])
def test_chain_by_any_method(method, tmp_path):
    """A tolerance of 1e-8: as many steps as without passing, where those miss the states, and errors of as many tolerances."""
    run, _, summary = motion(written(tmp_path, CHAIN), "--set", "n=6", "--until", 4, "--tol", 1e-8, *PASS, "--method", method)
    assert summary["passed"]["count"] == 4 and summary["rejected"] <= 0.2 * summary["steps"] + 10, summary
    check([close("angle", run["rocker0_psi"], angle_of(7, 6, math.pi / 2, -1, run["t"]), 1e-5, 1)])


@pytest.mark.parametrize("unit", [1, 1000])
def test_loops_that_pass_one_after_another(unit, tmp_path):
    """One of three loops loses its own row, and the others do not; their angles equal those of each loop alone, in m or in mm."""
    run, _, summary = motion(written(tmp_path, APART), "--set", f"unit={unit}", "--until", 2, *PASS)
    assert summary["passed"]["count"] == 6
    check([close(f"crank{i}", run[f"crank{i}_psi"], angle_of(2, 1, math.pi / 3 + 0.1 * i, 0, run["t"]), 1e-6, 1) for i in (1, 2, 3)])
    assert summary["steps"] < 45 * SCALE, summary


# ---- Energies that do not change ----

def held(gravity, links, rows=""):
    return (f'local rd = require "refdyn"\nreturn rd.model {{ name = "m", gravity = {{ 0, 0, {gravity} }}, links = {{ {links} }},\n'
            f"  constraints = function(s) local q, qd = s.q, s.qd return {{ {rows} }} end }}\n")


COIN = '{ "coin", joint = "x, y, z, psi, theta", mass = 1, inertia = { xx = 0.0025, yy = 0.005, zz = 0.0025 }, start = { z = 0.1 }, start_rate = { %s } }'
ROLLS = ("rd.position { q.coin_z - 0.1 }, rd.velocity { qd.coin_x - 0.1 * qd.coin_theta * rd.cos(q.coin_psi) }, "
         "rd.velocity { qd.coin_y - 0.1 * qd.coin_theta * rd.sin(q.coin_psi) }")
STILL = {
    "point on a slope": held(-9.81, '{ "p", joint = "x, z", mass = 1 }', "rd.position { q.p_z - 0.3 * q.p_x, alpha = 10, beta = 10 }, rd.position { q.p_x, alpha = 10, beta = 10 }"),
    "body held by rows": held(-9.81, '{ "a", joint = "x, z, theta", mass = 3, center = { 0.2, 0, 0 }, inertia = { yy = 0.1 } }',
                              "rd.position { q.a_x }, rd.position { q.a_z }, rd.position { q.a_theta }"),
    "heavy body in millinewtons": held(-9.81e3, '{ "a", joint = "x, z", mass = 3e3 }', "rd.position { q.a_x }, rd.position { q.a_z - 0.1 * q.a_x }"),
    "cart at constant speed": held(-9.81, '{ "c", joint = "x", mass = 2, start_rate = { x = 0.5 } }', "rd.position { q.c_x - 0.5 * s.t, alpha = 100, beta = 100 }"),
    "cart that stays": held(-9.81, '{ "c", joint = "x", mass = 2 }', "rd.position { q.c_x, alpha = 100, beta = 100 }"),
    "coin on a circle": held(-9.81, COIN % "psi = 3, x = 0.2, theta = 2", ROLLS),
    "coin at rest": held(-9.81, COIN % "", ROLLS),
}


@pytest.mark.parametrize("which", STILL)
def test_motions_without_changes_of_energy(which, tmp_path):
    """The largest change of energy is then itself an error."""
    model = written(tmp_path, STILL[which])
    for method in ("auto", "rk54", "rodas5p", "radau9"):
        for tol in (1e-3, 1e-6):
            _, said, _ = motion(model, "--until", 5, "--method", method, "--tol", tol)
            assert "balance: " not in said and "not resolved" not in said, (method, tol, said)


@pytest.mark.parametrize("start", [0.5, 0.1])
def test_what_is_not_resolved_is_still_said(start, tmp_path):
    """Swings with fixed steps that are too long."""
    text = held(-9.81, '{ "p", joint = "theta", mass = 1, center = { 0, 0, -1 }, start = { theta = %r } }' % start)
    _, said, _ = motion(written(tmp_path, text.replace("constraints = function(s) local q, qd = s.q, s.qd return {  } end", "")),
                        "--until", 60, "--step", 0.5)
    assert "the motion is not resolved" in said


# ---- The unit of length ----

ORBIT = """local rd = require "refdyn"
local R, mu = %r, %r
return rd.model { name = "orbit", %s links = { { "sat", joint = "x, y", mass = 100, start = { x = R }, start_rate = { y = (mu / R) ^ 0.5 } } },
  forces = function(s)
    local x, y = s.q.sat_x, s.q.sat_y
    local r = rd.sqrt(x^2 + y^2)
    return { sat_x = -100 * mu * x / r^3, sat_y = -100 * mu * y / r^3 }
  end }
"""


def orbit(folder, size, unit):
    """Radius `size` and one revolution in 2 pi s, in a unit of length."""
    return written(folder, ORBIT % (size, size**3, f"length = {unit!r}," if unit else ""), f"orbit{unit}.lua")


@pytest.mark.parametrize("size", [7e6, 7, 7e-6])
@pytest.mark.parametrize("method", ["auto", "rk54", "rodas5p", "gauss12", "ros34pw2"])
def test_steps_follow_the_unit(size, method, tmp_path):
    """The same steps and the same relative errors at every size if the unit is scaled as well."""
    arguments = ["--until", 6, "--tol", 1e-5, "--method", method, "--every", 0.5]
    run, said, summary = motion(orbit(tmp_path, size, size / 7), *arguments)
    _, _, other = motion(orbit(tmp_path, 7, None), *arguments)
    assert abs(summary["steps"] - other["steps"]) <= 1, (summary["steps"], other["steps"])
    check([close("x", run["sat_x"], size * numpy.cos(run["t"]), 2e-3 if method == "ros34pw2" else 1e-4, size)])
    assert ("of 1 rad and" in said) == (size != 7)


def test_coarse_tolerances_of_large_models(tmp_path):
    """10 km at an orbit of 7000 km; without a unit of length such a tolerance is refused, and the message names its unit."""
    run, _, summary = motion(orbit(tmp_path, 7e6, 1e6), "--until", 6, "--tol", 1e-2, "--every", 0.5)
    assert summary["steps"] < 40
    check([close("x", run["sat_x"], 7e6 * numpy.cos(run["t"]), 1e-2, 7e6)])
    said = refdyn("sim", orbit(tmp_path, 7e6, None), "--until", 6, "--tol", 1e4, "-o", tmp_path / "run.csv", status=2).stderr
    assert "--tol must lie between the rounding of doubles and 1, in units of 1 rad and the model's length" in said


def test_accuracy_of_small_models(tmp_path):
    """The accuracy is in metres; the chosen tolerance is relative to the unit."""
    arguments = ["--until", 6, "--every", 0.5, "--accuracy", 7e-12]
    run, _, summary = motion(orbit(tmp_path, 7e-6, 1e-6), *arguments)
    assert 1e-9 < summary["tol"] < 1e-3, summary["tol"]
    check([close("x", run["sat_x"], 7e-6 * numpy.cos(run["t"]), 1e-6, 7e-6)])


def test_batches_and_equilibria_have_the_unit(tmp_path):
    """Batches step like motions; equilibria are followed in steps of that size: 1 m at a time takes 10 s."""
    (tmp_path / "cases.csv").write_text("sat_y_d\n7e6\n7.1e6\n6.9e6\n")
    steps = {}
    for unit in (1e6, None):
        refdyn("batch", orbit(tmp_path, 7e6, unit), "--table", tmp_path / "cases.csv", "--until", 6, "--tol", 1e-4, "--lanes", 1, "-o", tmp_path / "runs.csv",
               "--summary", tmp_path / "runs.json")
        rows = read_run(tmp_path / "runs.csv")
        steps[unit] = rows
    x = [steps[unit]["sat_x"] for unit in steps]
    assert abs(x[0] - x[1]).max() > 1e-3, "the tolerance is the same"
    check([close("x", x[0], x[1], 1e-3, 7e6)])
    spring = 'local rd = require "refdyn"\nreturn rd.model { name = "s", length = %r, gravity = { 0, 0, -9.81 }, links = { { "p", joint = "z", mass = 1, spring = { z = 1e-6 } } } }\n'
    found = json.loads(refdyn("statics", written(tmp_path, spring % 1e7, "spring.lua"), timeout=5).stdout)
    check([close("z", found["q"], [-9.81e6], 1e-9)])


@pytest.mark.parametrize("value", ["0", "-1", "1 / 0", "0 / 0", '"m"', "rd.parameters { { \"L\", 1, \"m\" } }.L"])
def test_a_length_is_a_positive_number(value, tmp_path):
    model = written(tmp_path, ORBIT % (7, 343, f"length = {value},"))
    said = refdyn("check", model, status=1).stderr
    assert "model.lua:3: length: " in said and "must be " in said, said


def test_emitted_tables_have_the_length(tmp_path):
    for length, text in (("", "SET(length) 1,"), ("length = 2.5e6,", "SET(length) 2500000,"), ("length = 0.1,", "SET(length) 0.1")):
        refdyn("gen", written(tmp_path, ORBIT % (7, 343, length)), "-o", tmp_path / "emitted")
        assert text in (tmp_path / "emitted" / "orbit.c").read_text()


def test_models_without_a_unit_are_as_before():
    """1 m, and the summary does not mention it."""
    _, said, _ = motion(MODELS / "pendulum.lua", "--until", 0.1)
    assert "of 1 rad and" not in said
