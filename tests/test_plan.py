"""Plans: least times against closed forms and scans, multipliers, local minima, jumps, cases, infeasible tasks, wrong files, Ctrl-C."""
import csv
import json
import math
import os
import signal
import subprocess
import time

import pytest

from program import MODELS, REFDYN, refdyn

pytestmark = pytest.mark.skipif("NLopt" not in refdyn("--version").stdout, reason="built without NLopt")

# A slide from rest to rest; its largest force is m d k/T^2, its largest rate 15/8 d/T with a law of degree 5.
SLIDE = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "m", 2, "kg" }}, {{ "T", 1, "s" }}, {{ "d", 1, "m" }}, {{ "idle", 1 }} }}
local degree = rd.option("degree", 5)
return rd.model {{
  name = "slide", gravity = {{ 0, 0, 0 }},
  links = {{ {{ "cart", joint = "x", mass = p.m, limits = {{ x = {{ rate = {rate}, force = {force} }} }} }} }},
  constraints = function(s) return {{ rd.drive {{ "cart_x", p.d * rd.smoothstep(s.t, 0, p.T, degree), alpha = 0, beta = 0 }} }} end,
  courses = function(s) return {{ moving = s.q.cart_x, twice = 2 * p.T }} end,
}}"""
# Largest acceleration of each law for d = T = 1.
PEAK = {3: 6, 5: 10 / math.sqrt(3)}
FREE = "vary = { T = rd.within(0.2, 5) }, t_end = \"T\", minimise = \"T\""

# The reference manipulator with a rigid arm turns a quarter, and lifts its arm by r on the way.
ARM = """local rd = require "refdyn"
local p = rd.parameters {
  { "m_base", 18.54331045, "kg" }, { "s_sup", 1e4, "N/m" }, { "d_sup", 2.5, "N s/m" }, { "m_col", 10, "kg" }, { "h", 1.1, "m" },
  { "Izz_col", 0.05, "kg m^2" }, { "L", 2, "m" }, { "d", 0.01413200743, "m" }, { "m_E", 2, "kg" }, { "T", 1.5, "s" }, { "r", 0.2, "rad" },
}
local function lift(t) local c = rd.min(t / p.T, 1) return p.r * 16 * c^2 * (1 - c)^2 end
return rd.model {
  name = "quarter_turn", gravity = { 0, 0, -9.81 },
  links = {
    { "base", joint = { "z" }, mass = p.m_base, spring = { z = p.s_sup }, damper = { z = p.d_sup } },
    { "column", on = "base", joint = { "psi" }, mass = p.m_col, inertia = { zz = p.Izz_col }, limits = { psi = { force = 25 } } },
    { "arm", on = "column", at = { 0, 0, p.h }, turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, start = { psi = rd.pi / 6 },
      beam = { length = p.L, section = rd.round(p.d), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 1 }, limits = { psi = { force = 65 } } },
    { "effector", on = "arm.tip", turn = { { "y", rd.pi / 2 } }, joint = { "z" }, mass = p.m_E },
  },
  constraints = function(s)
    return { rd.drive { "column_psi", rd.pi / 2 * rd.smoothstep(s.t, 0, p.T, 5), alpha = 0, beta = 0 },
             rd.drive { "arm_psi", rd.pi / 6 + lift(s.t), alpha = 0, beta = 0 }, rd.drive { "effector_z", 0, alpha = 0, beta = 0 } }
  end,
  hold = { "column_psi", "arm_psi", "effector_z" },
}"""

# A force that changes its sign at the fraction s of the motion: its kink moves with two values.
THRUST = """local rd = require "refdyn"
local p = rd.parameters { { "m", 2, "kg" }, { "F", 5, "N" }, { "T", 1, "s" }, { "s", 0.4 } }
return rd.model {
  name = "thrust", gravity = { 0, 0, 0 }, links = { { "cart", joint = "x", mass = p.m } },
  forces = function(s) return { cart_x = rd.where(rd.less(s.t, p.s * p.T), p.F, -p.F) } end,
}"""


def write(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


def plan(folder, model, fields, *arguments, status=0):
    """The result and what was said; `fields` are those of rd.plan."""
    text = f'local rd = require "refdyn"\nreturn rd.plan {{\n  {fields}\n}}\n'
    out = folder / "plan.json"
    out.unlink(missing_ok=True)
    done = refdyn("plan", write(folder, "model.lua", model), write(folder, "plan.lua", text), "-o", out, *arguments, status=status)
    return (json.loads(out.read_text()) if out.exists() else None), done.stderr


def slide(rate=100, force=20):
    return SLIDE.format(rate=rate, force=force)


def limit(result, name):
    return next(limit for limit in result["limits"] if limit["name"] == name)


# ---- Closed forms ----

@pytest.mark.parametrize("degree", PEAK)
def test_least_time_under_a_limit_of_force(degree, tmp_path):
    """With degree 3 the force is largest at both ends, where it jumps."""
    result, said = plan(tmp_path, slide(), FREE, "--set", f"degree={degree}")
    exact = math.sqrt(2 * PEAK[degree] / 20)
    assert result["feasible"] and result["violation"] == {}
    assert abs(result["parameters"]["T"] / exact - 1) < 1e-7 and result["objective"] == result["parameters"]["T"]
    force = limit(result, "force_cart_x")
    assert force["active"] and not limit(result, "cart_x_d")["active"] and abs(force["largest"] - 20) < 1e-6
    assert all(abs(reached / exact - 1) < 1e-7 for reached in result["starts"]) and "derivatives do not exist" not in said
    # dT/dF = -T/(2 F), also as a difference quotient of plans
    assert abs(force["multiplier"] / (exact / 40) - 1) < 1e-4
    more, _ = plan(tmp_path, slide(force=20.2), FREE, "--set", f"degree={degree}")
    assert abs((result["objective"] - more["objective"]) / 0.2 / force["multiplier"] - 1) < 1e-2


def test_least_time_under_a_limit_of_rate(tmp_path):
    result, _ = plan(tmp_path, slide(rate=2), FREE)
    assert abs(result["objective"] - 15 / 16) < 1e-7 and limit(result, "cart_x_d")["active"]
    assert abs(limit(result, "cart_x_d")["t"] - 15 / 32) < 1e-4


def test_fixed_end(tmp_path):
    result, _ = plan(tmp_path, slide(), FREE.replace('t_end = "T"', "t_end = 5.5"))
    assert abs(result["objective"] / math.sqrt(PEAK[5] / 10) - 1) < 1e-7


def test_end_by_a_course(tmp_path):
    """The motion rests for as long as it has moved; minimise also takes the name of the end."""
    result, _ = plan(tmp_path, slide(), FREE.replace('"T"', '"twice"'))
    assert abs(result["objective"] / (2 * math.sqrt(PEAK[5] / 10)) - 1) < 1e-7 and result["t_end"] == pytest.approx(result["objective"], rel=1e-12)
    assert abs(limit(result, "force_cart_x")["multiplier"] / (result["objective"] / 40) - 1) < 1e-4


def test_sim_confirms_the_plan(tmp_path):
    result, _ = plan(tmp_path, slide(), FREE)
    done = refdyn("sim", tmp_path / "model.lua", "--parameters", tmp_path / "plan.json", "--until", repr(result["parameters"]["T"]), "-o", tmp_path / "run.csv")
    assert "exceeds its limits" not in done.stderr
    assert abs(float(list(csv.DictReader((tmp_path / "run.csv").open()))[-1]["cart_x"]) - 1) < 1e-9


@pytest.mark.parametrize("objective, exact", [('rd.largest("force_cart_x")', PEAK[5] * 2), ('rd.integral("energy")', 10 / 7), ('rd.at_end("cart_x")', 1)])
def test_measures_of_columns(objective, exact, tmp_path):
    """The kinetic energy m/2 (30 c^2 (1 - c)^2)^2 (d/T)^2 has the mean 10/7 m/2 (d/T)^2."""
    result, _ = plan(tmp_path, slide(), f'vary = {{ T = rd.within(0.8, 1), m = rd.within(2, 3) }}, t_end = "T", minimise = {objective}')
    assert abs(result["objective"] / exact - 1) < 1e-6
    if "at_end" not in objective:
        assert abs(result["parameters"]["T"] - 1) < 1e-7 and abs(result["parameters"]["m"] - 2) < 1e-7


# A cart at unit speed, which keeps a third of it at a wall. `y` may kink and jump where the motion has no event.
COLUMN = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "a", 0.8 }}, {{ "gain", 1 }} }}
return rd.model {{
  name = "column", gravity = {{ 0, 0, 0 }}, links = {{ {{ "c", joint = "x", mass = 3, start_rate = {{ x = 1 }} }} }},
  events = function(s) return {{ rd.event {{ {wall} - s.q.c_x, direction = "down", restitution = 1 / 3 }} }} end,
  courses = function(s) local x, v, t, a, rest = s.q.c_x, s.qd.c_x, s.t, p.a, (p.a - 1.1)^2 return {{ y = p.gain * ({column}) }} end,
}}"""
# y, the place of the wall, the end; the least integral and where it is.
COLUMNS = {
    "smooth": ("(x - a)^2", 5, "2.2", 2 / 3 * 1.1**3, 1.1),
    "kink": ("rd.abs(x - a)", 5, "2.2", 1.21, 1.1),
    "jump": ("rd.where(rd.less(x, a), 0, -1) + (2.2 - a)^2 / 2.2", 5, "2.2", -0.25, 1.7),
    "jump in time": ("rd.where(rd.less(t, 1.234), 1, 0) + rest", 5, "2.2", 1.234, 1.1),
    "spike": ("rd.exp(-((t - a) / 1e-3)^2) + rest", 5, "2.2", 1e-3 * math.sqrt(math.pi), 1.1),
    "event": ("a^2 / 2.2 - 1.5 * v", "p.a", "2.2", 1.1 - 1, 1),
    "end": ("3 * t - a - 1", 5, '"a"', -0.5, 1),
}


@pytest.mark.parametrize("name", COLUMNS)
@pytest.mark.parametrize("search", ["slsqp", "cobyla"])
def test_integrals(name, search, tmp_path):
    """The derivatives are those of the value if the search finds the least one; of two cases the larger integral counts."""
    column, wall, end, exact, a = COLUMNS[name]
    gains = (0.7, 1.3) if exact > 0 else (1.3, 2.1)
    result, said = plan(tmp_path, COLUMN.format(wall=wall, column=column), f"""vary = {{ a = rd.within(0.5, 2) }}, t_end = {end}, minimise = rd.integral("y"),
      starts = 8, search = "{search}", for_all = {{ gain = {{ {gains[0]}, {gains[1]} }} }}""")
    assert abs(result["objective"] - gains[exact > 0] * exact) < 1e-11 and "derivatives do not exist" not in said
    assert abs(result["parameters"]["a"] - a) < 1e-6


def test_bounds_at_the_end(tmp_path):
    """Thrust for s T, then braking: x = F/m T^2 (2 s - s^2 - 1/2), v = F/m T (2 s - 1)."""
    result, said = plan(tmp_path, THRUST, """vary = { T = rd.within(0.2, 5), s = rd.within(0.2, 0.8) }, t_end = "T", minimise = "T",
      within = { rd.at_end("cart_x", { from = 1 }), rd.at_end("cart_x_d", { from = 0, to = 0 }) }""")
    T, s = result["parameters"]["T"], result["parameters"]["s"]
    assert abs(T - 2 * math.sqrt(0.4)) < 1e-6 and abs(s - 0.5) < 1e-6 and "derivatives do not exist" not in said
    assert [limit["name"] for limit in result["limits"]] == ["cart_x at end", "cart_x_d at end"]


# ---- Cases ----

def test_for_all_is_the_plan_of_the_worst_case(tmp_path):
    result, _ = plan(tmp_path, slide(), FREE + ", for_all = { m = { 1.8, 2, 2.2 }, d = { 0.9, 1.1 } }")
    worst, _ = plan(tmp_path, slide(), FREE, "--set", "m=2.2", "--set", "d=1.1")
    assert result["worst_case"] == {"d": 1.1, "m": 2.2}
    assert abs(result["objective"] / worst["objective"] - 1) < 1e-7


def test_largest_objective_of_all_cases(tmp_path):
    """The force falls with T up to the end of the range, and grows with the mass."""
    result, _ = plan(tmp_path, slide(force=1000), 'vary = { T = rd.within(0.5, 2) }, t_end = "T", minimise = rd.largest("force_cart_x"), for_all = { m = { 1, 3 } }')
    assert abs(result["objective"] / (3 * PEAK[5] / 4) - 1) < 1e-6 and result["worst_case"] == {"m": 3}


# ---- Contradicting limits ----

def test_infeasible(tmp_path):
    """The force must give way; the plan is the least violation."""
    result, said = plan(tmp_path, slide(), FREE.replace("5)", "0.7)"), status=3)
    amount = 2 * PEAK[5] / 0.49 - 20
    assert not result["feasible"] and abs(result["violation"]["force_cart_x"] - amount) < 1e-5 and result["starts"] == [None] * len(result["starts"])
    assert abs(result["parameters"]["T"] - 0.7) < 1e-7
    assert f"refdyn: slide: force_cart_x: must give way by {amount:.6g}, at t = " in said


# ---- The manipulator ----

def test_manipulator_against_a_scan(tmp_path):
    """Two values, with a local minimum at r = 0; the least time of a grid of 100 x 100 lies just above."""
    fields = 'vary = { T = rd.within(0.8, 3), r = rd.within(0, 0.8) }, t_end = 3.5, from = "statics", minimise = "T"'
    result, said = plan(tmp_path, ARM, fields)
    sweep = """local rd = require "refdyn"
return rd.sweep { vary = { T = rd.grid(0.8, 3, 100), r = rd.grid(0, 0.8, 100) }, t_end = 3.5, from = "statics", keep = { limits = true } }"""
    refdyn("batch", tmp_path / "model.lua", write(tmp_path, "sweep.lua", sweep), "-o", tmp_path / "scan.csv")
    table = [{name: float(value or "nan") for name, value in row.items()} for row in csv.DictReader((tmp_path / "scan.csv").open())]
    within = [row["T"] for row in table if all(-most <= row[f"limit_force_{name}_min"] and row[f"limit_force_{name}_max"] <= most
                                              for name, most in (("column_psi", 25), ("arm_psi", 65)))]
    assert len(table) == 10000 and len(within) > 300
    assert 0 <= min(within) - result["objective"] < 2.2 / 99
    assert all(limit["active"] and limit["multiplier"] > 0 for limit in result["limits"]) and "derivatives do not exist" not in said
    assert 0 < result["parameters"]["r"] < 0.8
    with_end, _ = plan(tmp_path, ARM, fields.replace("t_end = 3.5", 't_end = "T"'))
    assert sum(abs(reached - with_end["objective"]) < 1e-6 for reached in with_end["starts"]) >= 3
    assert abs(with_end["objective"] - result["objective"]) < 1e-5 and result["evaluations"] < 1600


@pytest.mark.parametrize("start", [(0.9, 0.75), (2.9, 0.78), (0.85, 0.02)])
def test_manipulator_from_bad_starts(start, tmp_path):
    fields = 'vary = {{ T = rd.within(0.8, 3, {}), r = rd.within(0, 0.8, {}) }}, t_end = "T", from = "statics", minimise = "T", starts = 1'.format(*start)
    result, _ = plan(tmp_path, ARM, fields)
    assert abs(result["objective"] - 1.685992) < 1e-6 and result["evaluations"] <= 400


# The tip of the reference manipulator runs along a quarter circle about the column, at constant height above the base, and comes
# nearer to the column by r on the way. All three drives have limits.
DRIVES = """local rd = require "refdyn"
local model = rd.model
local p = rd.parameters { { "T_move", 1.5, "s" }, { "r", 0.2, "m" } }
function rd.model(it)
  it.links[2].limits, it.links[3].limits, it.links[4].limits = { psi = { force = 40 } }, { psi = { force = 75 } }, { z = { force = 14 } }
  it.forces, it.courses, it.dependent = nil, nil, nil
  function it.constraints(s)
    local E, start = s.points.E, s.start.points.E
    local c, turned = rd.max(rd.min(s.t / p.T_move, 1), 0), rd.pi / 2 * rd.smoothstep(s.t, 0, p.T_move, 5)
    local reach = rd.parameter("reach", rd.sqrt(start.x^2 + start.y^2), "m") - p.r * 64 * c^3 * (1 - c)^3
    local height = rd.parameter("height", start.z - s.start.q.base_z, "m")
    return { rd.position { E.x - reach * rd.cos(turned), alpha = 0, beta = 0 }, rd.position { E.y - reach * rd.sin(turned), alpha = 0, beta = 0 },
             rd.position { E.z - s.q.base_z - height, alpha = 0, beta = 0 } }
  end
  return model(it)
end
return require "manipulator"
"""


def test_three_drives_against_a_scan(tmp_path):
    """From three bad starts, in at most 400 motions; a step of the grid in r costs more than one in time."""
    write(tmp_path, "manipulator.lua", (MODELS / "manipulator.lua").read_text())
    sweep = """local rd = require "refdyn"
return rd.sweep { vary = { T_move = rd.grid(0.6, 3, 100), r = rd.grid(-0.3, 1.2, 100) }, t_end = 3, from = "statics", keep = { limits = true } }"""
    refdyn("batch", write(tmp_path, "model.lua", DRIVES), write(tmp_path, "sweep.lua", sweep), "--set", "n_rfe=1", "-o", tmp_path / "scan.csv")
    most = {"column_psi": 40, "arm_psi": 75, "effector_z": 14}
    within = [float(row["T_move"]) for row in csv.DictReader((tmp_path / "scan.csv").open())
              if all(-force <= float(row[f"limit_force_{name}_min"]) and float(row[f"limit_force_{name}_max"]) <= force for name, force in most.items())]
    assert len(within) > 1000
    for T, r in (0.65, 1.15), (2.95, -0.25), (0.7, -0.28):
        fields = f'vary = {{ T_move = rd.within(0.6, 3, {T}), r = rd.within(-0.3, 1.2, {r}) }}, t_end = "T_move", from = "statics", minimise = "T_move", starts = 1'
        result, _ = plan(tmp_path, DRIVES, fields, "--set", "n_rfe=1")
        assert result["feasible"] and result["evaluations"] <= 400
        assert 0 <= min(within) - result["objective"] < 0.06 and sum(limit["active"] for limit in result["limits"]) >= 2


def test_the_same_plan_again(tmp_path):
    """Bytes do not depend on threads; another seed has other starts."""
    fields = 'vary = { T = rd.within(0.8, 3), r = rd.within(0, 0.8) }, t_end = 3.5, from = "statics", minimise = "T", starts = 30'
    first, again, other = (plan(tmp_path, ARM, fields + more)[0] for more in ("", "", ", seed = 7"))
    assert first == again and first != other and abs(first["objective"] - other["objective"]) < 1e-5


def test_tolerance_of_rates(tmp_path):
    """In the file as on the command line, which has precedence."""
    fields = 'vary = { T = rd.within(1.6, 1.8), r = rd.within(0, 0.2) }, t_end = "T", from = "statics", minimise = "T", starts = 4, tol = 1e-4'
    plain, file, line, both = (plan(tmp_path, ARM, fields + more, *arguments)[0] for more, *arguments in (
        ("",), (", tol_rates = 1e-9",), ("", "--tol-rates", 1e-9), (", tol_rates = 1e-3", "--tol-rates", 1e-9)))
    best = plan(tmp_path, ARM, fields, "--tol", 1e-11)[0]["objective"]
    assert file == line == both and abs(file["objective"] - best) < abs(plain["objective"] - best) / 5


def test_interrupt_keeps_the_best(tmp_path):
    """Ctrl-C after the first search: PLAN.json has its result."""
    text = """local rd = require "refdyn"
return rd.plan { vary = { T = rd.within(0.8, 3), r = rd.within(0, 0.8) }, t_end = "T", from = "statics", minimise = "T", tol = 1e-13 }"""
    refdyn("compile", write(tmp_path, "model.lua", ARM))
    with subprocess.Popen([REFDYN, "plan", tmp_path / "model.lua", write(tmp_path, "plan.lua", text), "-o", tmp_path / "plan.json"],
                          stderr=subprocess.PIPE, text=True, env={**os.environ}) as process:
        for line in process.stderr:
            if line.startswith("search 1 "):
                process.send_signal(signal.SIGINT)
                break
        said = process.stderr.read()
    result = json.loads((tmp_path / "plan.json").read_text())
    assert result["feasible"] and len(result["starts"]) < 5 and "interrupted; this is the best so far" in said, said


# ---- Results ----

def rows(path):
    return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(path.open())]


def test_reference_is_the_motion_of_sim(tmp_path):
    """With cases, the reference has the values of the model."""
    fields = 'vary = { T = rd.within(0.8, 3), r = rd.within(0, 0.8) }, t_end = "T", from = "statics", minimise = "T", starts = 30, for_all = { m_E = { 1.8, 2.1 } }'
    result, _ = plan(tmp_path, ARM, fields, "--reference", tmp_path / "reference.csv", "--every", 0.01)
    refdyn("sim", tmp_path / "model.lua", "--parameters", tmp_path / "plan.json", "--from", "statics", "--tol", 1e-9, "--every", 0.01, "--until", repr(result["t_end"]),
           "-o", tmp_path / "run.csv")
    found, run = rows(tmp_path / "reference.csv"), rows(tmp_path / "run.csv")
    names = ["base_z", "column_psi", "arm_psi", "effector_z"]
    assert list(found[0]) == ["t", *names, *(f"{name}_d" for name in names), *(f"{name}_dd" for name in names), *(f"force_{name}" for name in names)]
    assert len(found) == len(run) > 100 and found[-1]["t"] == result["t_end"] == result["parameters"]["T"]
    for name in found[0]:
        scale = max(abs(row[name]) for row in run) or 1
        assert max(abs(a[name] - b[name]) for a, b in zip(found, run)) < 1e-9 * scale, name
    assert "--every: applies to --reference; add it" in refdyn("plan", tmp_path / "model.lua", tmp_path / "plan.lua", "-o", tmp_path / "x.json", "--every", 1, status=2).stderr


def test_resume(tmp_path):
    """The earlier result is kept if nothing better is found; results of other plans are refused."""
    fields = 'vary = { T = rd.within(0.8, 3), r = rd.within(0, 0.8) }, t_end = "T", from = "statics", minimise = "T", starts = 1'
    first, _ = plan(tmp_path, ARM, fields)
    arguments = ["plan", tmp_path / "model.lua", tmp_path / "plan.lua", "-o", tmp_path / "plan.json", "--resume"]
    (tmp_path / "plan.lua").write_text((tmp_path / "plan.lua").read_text().replace("0, 0.8)", "0, 0.8, 0.79)").replace("0.8, 3)", "0.8, 3, 2.9)"))
    said = refdyn(*arguments).stderr
    again = json.loads((tmp_path / "plan.json").read_text())
    assert again["objective"] <= first["objective"] + 1e-9 and f"\nresume       {again['objective']:.6g}"[:-1] in said
    (tmp_path / "plan.lua").write_text((tmp_path / "plan.lua").read_text().replace("0.8, 3, 2.9)", "2, 3)"))
    said = refdyn(*arguments, status=1).stderr
    assert said == f"{tmp_path / 'plan.json'}:1: parameters: T = {again['parameters']['T']:.15g} is outside its range from 2 to 3; omit --resume\n"
    (tmp_path / "plan.json").write_text('{ "parameters": { "T": 2.5 } }')
    assert f"{tmp_path / 'plan.json'}:1: parameters: no r, which the plan varies; omit --resume\n" == refdyn(*arguments, status=1).stderr
    (tmp_path / "plan.json").unlink()
    assert refdyn(*arguments).stderr.startswith(f"resume       no {tmp_path / 'plan.json'} yet\n")


BALLS = """local rd = require "refdyn"
return rd.model {
  name = "balls", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "z", mass = 1, start = { z = 2 } }, { "b", joint = "z", mass = 1, start = { z = 2 } } },
  constraints = function(s) return { rd.contact { s.q.a_z, restitution = 0.8, name = "a" }, rd.contact { s.q.b_z, restitution = 0.5, name = "b" } } end,
  courses = function(s) return { lack = (s.q.a_z - s.q.b_z - 0.1)^2 } end,
}"""


@pytest.mark.parametrize("more", ["", ', search = "cobyla"'])
def test_kink_at_the_least_value(more, tmp_path):
    """At the end of 1 s the ball just touches the floor: it falls from g/2 - v."""
    result, _ = plan(tmp_path, BALLS, f'vary = {{ a_z = rd.within(2.6, 7), a_z_d = rd.within(-2, 2, 0.3) }}, t_end = 1, minimise = rd.at_end("a_z"), within = {{}}, starts = 3{more}')
    assert 0 <= result["objective"] < 1e-7 and abs(result["parameters"]["a_z"] + result["parameters"]["a_z_d"] - 9.81 / 2) < 1e-6
    assert result["search"] == ("cobyla" if more else "slsqp")


# The values of F and s at creases are best; the cart must go 2 m: 2 = F/m T^2 (2 s - s^2 - 1/2).
CREASES = [("rd.abs(p.F - 4.2) + 0.1 * (p.s - 0.55)^2", 0.150004, "slsqp"), ("rd.abs(p.F - 4.2) + 0.1 * (p.s - 0.55)^2", 0.150004, "cobyla"),
           ("rd.abs(p.F - 4.2) + 2 * rd.abs(p.s - 0.55)", 0.1 * math.sqrt(4 / 4.2 / (2 * 0.55 - 0.55**2 - 0.5)), "slsqp")]


@pytest.mark.parametrize("crease, exact, search", CREASES)
def test_creases(crease, exact, search, tmp_path):
    """COBYLA goes on along a crease, at which its first run ends 30 % above the least value."""
    model = THRUST.replace("forces = ", f"courses = function(s) return {{ crease = {crease} + 0.1 * p.T }} end,\n  forces = ")
    result, _ = plan(tmp_path, model, f"""vary = {{ T = rd.within(0.5, 4), F = rd.within(2, 6), s = rd.within(0.3, 0.9) }}, t_end = "T",
      minimise = rd.at_end("crease"), search = "{search}", within = {{ rd.at_end("cart_x", {{ from = 2 }}) }}""")
    assert -1e-4 < result["objective"] / exact - 1 < 1e-3 and result["search"] == search


def test_cobyla_continues_where_derivatives_do_not_exist(tmp_path):
    """Both balls hit the floor at the same time, but not with the slightest change."""
    result, said = plan(tmp_path, BALLS, 'vary = { a_z = rd.within(1.8, 2.2, 2) }, t_end = 1, minimise = rd.at_end("lack"), within = {}, starts = 1')
    best = min(refdyn_lack(tmp_path, 1.8 + 0.02 * i) for i in range(21))
    assert result["search"] == "cobyla" and "1 derivatives do not exist" in said and "COBYLA, which needs none, continued" in said
    assert result["objective"] < best + 1e-9


def refdyn_lack(folder, height):
    (folder / "state.json").write_text(json.dumps({"q": [height, 2]}))
    refdyn("sim", folder / "model.lua", "--from", folder / "state.json", "--until", 1, "--tol", 1e-9, "-o", folder / "run.csv")
    return rows(folder / "run.csv")[-1]["lack"]


PUSHED = """local rd = require "refdyn"
local p, u = rd.parameters { { "m", 2, "kg" }, { "F", 1, "N" } }, rd.input("u", 0, "1")
return rd.model {
  name = "pushed", gravity = { 0, 0, 0 }, links = { { "cart", joint = "x", mass = p.m } },
  forces = function(s) return { cart_x = p.F * u } end,
  limits = function(s) return { { "power", p.F * u * s.qd.cart_x, to = 3 } } end,
}"""


def test_sampled_inputs(tmp_path):
    """u is 1, -0.5, 1 for 1 s each: v = F/m (1, 0.5, 1.5) after each, and x = 2.25 F/m."""
    samples = write(tmp_path, "samples.csv", "t,u\n0,1\n1,-0.5\n2,1\n")
    result, _ = plan(tmp_path, PUSHED, 'vary = { F = rd.within(0.1, 5), m = rd.within(1, 3) }, t_end = 3, minimise = rd.at_end("cart_x_d"), '
                     'within = { "power", rd.at_end("cart_x", { from = 2 }) }', "--inputs", samples)
    F, m = result["parameters"]["F"], result["parameters"]["m"]
    assert abs(F / m * 2.25 - 2) < 1e-6 and abs(result["objective"] - 1.5 * F / m) < 1e-8
    wrong = 'vary = { u = rd.within(0, 1) }, t_end = 3, minimise = rd.at_end("cart_x")'
    assert "vary.u: --inputs has samples of it; remove one of them" in plan(tmp_path, PUSHED, wrong, "--inputs", samples, status=1)[1]


def test_multiplier_at_a_sample(tmp_path):
    """The power is largest just before the first sample changes the input: F^2/m = 3."""
    samples = write(tmp_path, "samples.csv", "t,u\n0,1\n1,-0.5\n")
    result, _ = plan(tmp_path, PUSHED.replace("limits = function", "courses = function(s) return { way = -s.q.cart_x } end,\n  limits = function"),
                     'vary = { F = rd.within(0.1, 5) }, t_end = 2, minimise = rd.at_end("way")', "--inputs", samples)
    F = math.sqrt(3 * 2)
    assert abs(result["parameters"]["F"] - F) < 1e-6 and limit(result, "power")["active"] and abs(limit(result, "power")["t"] - 1) < 1e-6
    assert abs(limit(result, "power")["multiplier"] / (1.25 / 2 / (2 * F / 2)) - 1) < 1e-3


def test_plot_and_view(tmp_path):
    fields = FREE + ', within = { "cart_x_d", "force_cart_x", rd.at_end("cart_x", { from = 0.5 }) }'
    result, _ = plan(tmp_path, slide(), fields)
    refdyn("plot", tmp_path / "plan.json", "-o", tmp_path / "plan.svg")
    drawn = (tmp_path / "plan.svg").read_text()
    assert "force_cart_x, active" in drawn and "cart_x at end" in drawn and "cart_x [m]" in drawn and drawn.count("limit</text>") == 3
    motion = result["motion"]
    assert set(motion) == {"t", "cart_x", "cart_x_d", "force_cart_x"} and len(motion["t"]) == 201 and motion["t"][-1] == result["t_end"]
    assert abs(max(motion["force_cart_x"]) - 20) < 0.01
    usage = refdyn("plot", tmp_path / "plan.json", "--panel", "path", "-o", tmp_path / "x.svg", status=2).stderr
    assert "--panel: a plan has its own panels; omit it" in usage
    (tmp_path / "plan.json").write_text('{ "motion": { "t": [0, 1] }, "limits": [ { "name": "a", "column": "a" } ] }')
    assert f"{tmp_path / 'plan.json'}:1: plan: limits without values in 'motion'; give a PLAN.json of refdyn plan\n" == refdyn("plot", tmp_path / "plan.json", "-o", tmp_path / "x.svg", status=1).stderr
    result, _ = plan(tmp_path, slide(), fields)
    refdyn("sim", tmp_path / "model.lua", "--parameters", tmp_path / "plan.json", "--until", repr(result["t_end"]), "-o", tmp_path / "run.csv")
    refdyn("view", tmp_path / "run.csv", "--model", tmp_path / "model.lua", "-o", tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size > 1000


# ---- Wrong files ----

ONE = 'vary = { T = rd.within(1, 2) }, t_end = "T"'
WRONG = {
    FREE.replace("0.2, 5", "2, 1"): "vary.T: rd.within: from 2 to 1; the range must ascend",
    FREE.replace("0.2, 5", "1, 2, 3"): "vary.T: rd.within: start 3; must be from 1 to 2",
    FREE.replace("rd.within(0.2, 5)", "{ 1, 2 }"): "vary.T: a table; must be rd.within(from, to)",
    FREE.replace("0.2, 5", "1"): "rd.within: 1 argument; must have 2 or 3: from and to, and optionally the start",
    FREE.replace("0.2, 5", "1, \"2\""): "rd.within: argument 2 is of type string; must be a number",
    FREE.replace("0.2", "0"): "vary.T: the end of the motion begins at 0; must be after its start at t = 0",
    FREE.replace("T = rd", "degree = rd").replace('"T"', "1", 1).replace('"T"', '"degree"'):
        "vary.degree: an option of the model, which fixes its structure; use a parameter, an input or a start value",
    FREE.replace("T = rd", "idle = rd").replace('"T"', "1", 1).replace('"T"', '"idle"'): "vary.idle: nothing in this model reads it; remove it",
    ONE + ', minimise = "d"': 'minimise: d does not vary; name a value of vary, or a column as in rd.at_end("d")',
    ONE + ', minimise = rd.largest("cart_y")': 'minimise: cart_y is no column of the motion; did you mean "cart_x"?',
    ONE + ', minimise = rd.at_end("cart_x", { to = 1 })': "minimise: rd.at_end: bounds belong to the field within; remove them",
    ONE + ", minimise = 3": "minimise: a number; must be the name of a varied value, rd.at_end, rd.integral or rd.largest",
    FREE + ', within = { "cart_force" }': "within: cart_force is no limit of the model; use one of cart_x_d, force_cart_x",
    FREE + ', within = { rd.at_end("cart_x") }': 'within[1]: rd.at_end: no bounds; add them, as in rd.at_end("E_z", { to = 0.01 })',
    FREE + ', within = { rd.at_end("cart_x", { from = 2, to = 1 }) }': "within[1]: from 2 is above to 1; must ascend",
    FREE + ", for_all = { T = { 1, 2 } }": "for_all.T: vary has it as well; remove one of them",
    FREE + ", for_all = { m = 2 }": "for_all.m: a number; must be a list of numbers such as { 1.8, 2.2 }",
    FREE + ", for_all = { m = {} }": "for_all.m: empty; must have at least one number",
    FREE + ", for_all = { m = { 2, 0/0 } }": "for_all.m[2]: value nan; must be finite",
    FREE + ', within = { rd.at_end("cart_x", { to = 0/0 }) }': "within[1].to: value nan; must be finite",
    FREE + ', within = { "cart_x_d", "cart_x_d" }': 'within[2]: "cart_x_d" is given twice; give it once',
    FREE + ', within = { rd.at_end("cart_x", { to = 1 }), rd.at_end("cart_x", { from = 0 }) }':
        'within[2]: "cart_x at end" is given twice; give from and to together',
    FREE + ', hold = { "cart_z" }, from = "statics"': "hold: the model has no coordinate 'cart_z'; the nearest is cart_x",
    FREE + ', search = "mma"': 'search: a text; must be "slsqp" or "cobyla"',
    FREE.replace('t_end = "T"', 't_end = "moving"'): "t_end: the course moving changes during the motion; must depend on parameters alone",
    FREE.replace('t_end = "T"', 't_end = "Tx"'): 't_end: Tx: unknown name; did you mean "T"?',
    FREE + ", starts = 0": "starts: value 0; must be a whole number from 1 to 1000000",
    FREE + ", start = 3": 'start: unknown field; did you mean "starts"?',
    FREE.replace("within(0.2, 5)", "grid(1, 2, 3)"): "rd.grid: belongs to sweep files; in a plan use one of plan, within, at_end, integral, largest, pi",
    FREE.replace("within(0.2, 5)", "sin(1)"): "rd.sin: belongs to model files; in a plan use one of plan, within, at_end, integral, largest, pi",
}


@pytest.mark.parametrize("fields", WRONG)
def test_wrong_fields(fields, tmp_path):
    result, said = plan(tmp_path, slide(), fields, status=1)
    assert result is None and f"{tmp_path / 'plan.lua'}:3: {WRONG[fields]}\n" in said, said


@pytest.mark.parametrize("name, fields", [("vary.a_z", "vary = { a_z = rd.within(1, 2) }"), ("for_all.b_z", "vary = { a_z_d = rd.within(1, 2) }, for_all = { b_z = { 1 } }")])
def test_start_values_that_statics_moves(name, fields, tmp_path):
    _, said = plan(tmp_path, BALLS, fields + ', t_end = 1, minimise = rd.at_end("a_z"), from = "statics"', status=1)
    assert said == f"{tmp_path / 'plan.lua'}:3: {name}: statics moves this coordinate; add it to hold\n"


@pytest.mark.parametrize("bounds", ["too = 1", 'to = "1"'])
def test_one_message_for_a_wrong_bound(bounds, tmp_path):
    assert plan(tmp_path, slide(), FREE + f', within = {{ rd.at_end("cart_x", {{ {bounds} }}) }}', status=1)[1].count("\n") == 1


def test_value_that_the_model_refuses(tmp_path):
    _, said = plan(tmp_path, slide(), FREE + ", for_all = { m = { -3, 2 } }", status=1)
    line = slide()[:slide().index("mass =")].count("\n") + 1
    assert said.endswith("no motion reaches its end; the last one fails at t = 0: the model refuses a value of its parameters: "
                         f"{tmp_path / 'model.lua'}:{line}: links[1].mass: value -3; must be positive\n")


def test_start_is_a_file_beside_the_plan(tmp_path):
    state = write(tmp_path, "state.json", '{"q": [0], "parameters": {"m": 4}}')
    result, _ = plan(tmp_path, slide(), FREE + ', from = "state.json"')
    assert abs(result["objective"] / math.sqrt(4 * PEAK[5] / 20) - 1) < 1e-7
    state.unlink()
    assert plan(tmp_path, slide(), FREE + ', from = "state.json"', status=1)[1] == f"{state}: state: No such file or directory; must be a readable file\n"


def test_result_is_no_file_that_the_plan_reads(tmp_path):
    plan(tmp_path, slide(), FREE)
    path = tmp_path / "plan.lua"
    before = path.read_text()
    for more in (["-o", path], ["-o", tmp_path / "x.json", "--reference", path]):
        said = refdyn("plan", tmp_path / "model.lua", path, *more, status=1).stderr
        assert said == f"{path}: output: {path} is the file {path}, which this command also reads or writes; give another name\n"
    assert path.read_text() == before


def test_missing_fields_and_files(tmp_path):
    _, said = plan(tmp_path, slide(), "t_end = 1", status=1)
    place = f"{tmp_path / 'plan.lua'}:2: rd.plan: "
    assert said == (place + "vary is missing; add vary = { T = rd.within(0.5, 2) }\n" + place +
                    'minimise is missing; add minimise = "T", or a measure of a column such as rd.at_end("E_z")\n')
    assert "refdyn plan: PLAN.lua is missing\n" in refdyn("plan", tmp_path / "model.lua", "-o", tmp_path / "plan.json", status=2).stderr
    model = write(tmp_path, "model.lua", slide().replace("rd.model", "rd.plan"))
    assert refdyn("check", model, status=1).stderr.endswith("rd.plan: belongs to plan files; run them by refdyn plan MODEL.lua PLAN.lua\n")
