"""`sim --singular pass`: motions through states where the rows lose rank, compared with the same motions under regular rows or with closed
forms. A motion that cannot pass stops, or reverses if it must."""
import json
import math
import re

import numpy
import pytest

from program import LEAN, MODELS, SCALE, TESTS, check, close, motion, read_run, refdyn

ARM, CRANK, FOUR_BAR, REACH = [TESTS / "models" / f"{name}.lua" for name in ("arm_through", "equal_crank", "four_bar", "reach")]
PASS = ("--singular", "pass")
FINE = ("--method", "rk8", "--tol", "1e-13")
METHODS = ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]


def root(function, low, high):
    """Root by bisection; function(low) < 0 < function(high)."""
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return low


# Times at which the arm's elbow, 0.9 + rate t + 0.1 sin 2t, is straight (rate -1) and folded (rate 2.5).
STRETCHED = root(lambda t: -0.9 + t - 0.1 * math.sin(2 * t), 0, 2)
FOLDED = root(lambda t: 0.9 + 2.5 * t + 0.1 * math.sin(2 * t) - math.pi, 0, 2)
# Model, arguments, settings that make the rows regular, times of rank loss (None: from the motion).
CASES = {
    "stretched": (ARM, ["--until", 1.6], ["--set", "rows=angles"], [STRETCHED]),
    "folded": (ARM, ["--set", "rate=2.5", "--until", 1.5], ["--set", "rows=angles"], [FOLDED]),
    "crank": (CRANK, ["--until", 0.6], ["--set", "row=angles"], None),
}
references = {}


def reference(which):
    if which not in references:
        model, arguments, regular, _ = CASES[which]
        references[which] = motion(model, *arguments, *regular, *FINE)[0]
    return references[which]


def coordinates(run):
    return [name for name in run if name + "_d" in run]


def compare(run, expected, tolerance):
    names = coordinates(run)
    forces = [name for name in run if name.startswith("force_")]
    return ([close(name, run[name], expected[name], tolerance, 1) for name in names]
            + [close(f"{name}_d", run[f"{name}_d"], expected[f"{name}_d"], 30 * tolerance, 1) for name in names]
            + [close(name, run[name], expected[name], 1e3 * tolerance) for name in forces])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("which", CASES)
def test_through(which, method):
    """Coordinates, rates and forces keep their accuracy before and after; the time and the accuracy of the crossing are reported."""
    model, arguments, _, times = CASES[which]
    for tol in (1e-5, 1e-8):
        run, said, summary = motion(model, *arguments, *PASS, "--method", method, "--tol", tol)
        passed = summary["passed"]
        times = times or [0.0864136, 0.4794280]
        assert passed["count"] == len(times) and f"passed       {len(times)} state" in said, said
        check([*compare(run, reference(which), 20 * tol),
               *[close("time", found, expected, 1e-5) for found, expected in zip(passed["t"], times)],
               close("error", passed["error_max"], 0, 0.1 * tol, 1), close("energy", summary["energy_error"], 0, 300 * tol, 1)])
        assert all(stretch > 0 for stretch in passed["stretch"])


@pytest.mark.parametrize("which", CASES)
@pytest.mark.quick
def test_through_by_fixed_steps(which):
    model, arguments, _, _ = CASES[which]
    run, _, summary = motion(model, *arguments, *PASS, "--step", 1e-3)
    assert summary["passed"]["count"] > 0
    check(compare(run, reference(which), 1e-7))


@pytest.mark.parametrize("stabilise", ["none", "baumgarte", "baumgarte-auto", "project"])
def test_through_however_stabilised(stabilise):
    run, _, summary = motion(ARM, "--until", 1.6, *PASS, "--stabilise", stabilise, "--tol", 1e-8)
    assert summary["passed"]["count"] == 1
    check(compare(run, reference("stretched"), 2e-7))


@pytest.mark.parametrize("method", ["auto", "rodas5p", "radau9", "gauss12", "ros34pw2"])
def test_through_with_stiff_modes(method):
    """Steps of 10 ms with modes of 5000 rad/s, which the step through the state must follow."""
    arguments = ["--set", "hang=true", "--until", 1.6, "--tol", 1e-7]
    expected, _, _ = motion(ARM, *arguments, "--set", "rows=angles", "--method", "rodas6p")
    run, _, summary = motion(ARM, *arguments, *PASS, "--method", method)
    assert summary["passed"]["count"] == 1 and summary["passed"]["stretch"][0] < 5e-3, summary["passed"]
    check([close(name, run[name], expected[name], 1e-5, 1) for name in coordinates(run)])


@pytest.mark.parametrize("method", [*METHODS, "rk4"])
def test_parallelogram(method):
    """Three of five rows are redundant, and it is flat three times: it stays a parallelogram, at the rate that follows from its height."""
    tol = ["--tol", 1e-8] if method != "rk4" else []
    run, said, summary = motion(FOUR_BAR, "--until", 1.2, *PASS, "--method", method, *tol)
    inertia = 0.3**2 * 1.2 + 2 * 0.75 * ((0.3**2 + 0.02**2) / 12 + 0.15**2)
    crank = run["crank_psi"]
    square = 2 * 9.81 * (1.2 * 0.3 + 2 * 0.75 * 0.15) * (math.sin(1) - numpy.sin(crank)) / inertia
    assert summary["passed"]["count"] == 3 and said.count("redundant rows, left out") == 1
    assert min(crank) < -math.pi
    check([close("coupler", run["coupler_psi"], -crank, 1e-9), close("rocker", run["rocker_psi"], crank, 1e-9),
           close("square of rate", run["crank_psi_d"]**2, square, 1e-6)])
    for t in summary["passed"]["t"]:
        check([close("flat", math.sin(numpy.interp(t, run["t"], crank)), 0, 1e-3, 1)])


@pytest.mark.parametrize("method", ["auto", "rodas5p", "gauss12", "rk4"])
@pytest.mark.parametrize("off", [0, 1e-9, -1e-6])
def test_seen_there(off, method, tmp_path):
    """An output at exactly this time has the rates and forces of its neighbours; without passing there is none."""
    there = STRETCHED + off
    arguments = ["--every", repr(float(there)), "--until", 2 * there]
    expected, _, _ = motion(ARM, *arguments, "--set", "rows=angles", *FINE)
    run, _, _ = motion(ARM, *arguments, *PASS, "--method", method)
    check(compare(run, expected, 1e-6))
    done = refdyn("sim", ARM, *arguments, "--method", method, "-o", tmp_path / "run.csv", status=None)
    if done.returncode == 0:
        check([close(f"{name}_d", read_run(tmp_path / "run.csv")[f"{name}_d"], expected[f"{name}_d"], 0.1, 1)
               for name in coordinates(expected)])


@pytest.mark.parametrize("method", ["auto", "rk54", "rodas5p", "radau9", "rk4"])
@pytest.mark.parametrize("which", CASES)
def test_its_error_is_told(which, method):
    """--verify includes the error of the crossing at every tolerance."""
    model, arguments, _, _ = CASES[which]
    settings = [["--step", 2e-3]] if method == "rk4" else [["--tol", tol] for tol in (1e-3, 1e-5, 1e-7)]
    for setting in settings:
        run, _, summary = motion(model, *arguments, *PASS, "--method", method, *setting, "--verify")
        expected = reference(which)
        error = max(abs(run[name] - expected[name]).max() for name in coordinates(run))
        told = max(summary["error"]["coordinates"].values())
        assert error < 1e-9 or error / 3 <= told * SCALE <= 3 * error, (setting, error, told)


# ---- what cannot be passed ----

@pytest.mark.parametrize("method", [*METHODS, "rk4"])
def test_beyond_reach(method, tmp_path):
    """Stretched without a continuation: it stops there and reports that it searched for one."""
    said = refdyn("sim", REACH, "--until", 3, "--method", method, *PASS, "-o", tmp_path / "run.csv", status=3).stderr
    time = float(re.search(r"reach: t = (\S+) s", said)[1])
    end = math.sqrt(2 * (1 - math.cos(0.9)) / 0.3)
    assert abs(time - end) <= (1e-3 if method == "rk4" else 1e-6) * SCALE and time <= end + 1e-9, said
    assert re.search(r"crossing the singular position was attempted \d+ times?, last through t = 1\.588\d+ s by a step of \S+ s: "
                     "(no state on the programme was found|the state found may lie on another branch)\n", said), said
    assert "condition of the constraint rows" in said and "passed " not in said and "--singular pass" not in said, said
    assert all(numpy.isfinite(column).all() for column in read_run(tmp_path / "run.csv.part").values())


@pytest.mark.parametrize("which, miss", [("stretched", 1e-3), ("stretched", 1e-5), ("folded", -1e-3), ("folded", -1e-5)])
def test_target_out_of_reach(which, miss, tmp_path):
    """The same programmes a little beyond the arm's reach and back: no motion satisfies them."""
    model, arguments, _, _ = CASES[which]
    said = refdyn("sim", model, *arguments, *PASS, "--start", "project", "--set", f"miss={miss}", "-o", tmp_path / "run.csv",
                  status=3).stderr
    assert "crossing the singular position was attempted" in said and "passed " not in said, said


@pytest.mark.parametrize("longer", [1e-3, -1e-4, 1e-5, -1e-6, 1e-7])
def test_branches_that_do_not_meet(longer, tmp_path):
    """A slightly longer bar: there is nothing to pass, and the linkage must turn into its other form, however sharply."""
    near = tmp_path / "near.lua"
    near.write_text(FOUR_BAR.read_text().replace("at = { 0.3, 0, 0 } }, joint", f"at = {{ {float(0.3 + longer)!r}, 0, 0 }} }}, joint"))
    run, said, summary = motion(near, "--until", 0.4, "--start", "project", *PASS, "--tol", 1e-9)
    assert summary["passed"]["count"] == 0 and "passed " not in said, said
    crank, rocker = run["crank_psi"][-1], run["rocker_psi"][-1]
    assert math.sin(crank) * math.sin(rocker) < 0 and min(abs(math.sin(crank)), abs(math.sin(rocker))) > 0.1, (crank, rocker)
    assert summary["energy_error"] <= 1e-4 * SCALE


def test_coarse_fixed_steps():
    """A step that leaves its branch at the crossing is refused until it is short enough."""
    model, arguments, _, _ = CASES["folded"]
    run, _, summary = motion(model, *arguments, *PASS, "--step", 0.05, "--stabilise", "project", "--every", 0.1)
    expected, _, _ = motion(model, *arguments, "--every", 0.1, "--set", "rows=angles", *FINE)
    assert summary["passed"]["count"] == 1
    check([close(name, run[name], expected[name], 6e-4, 1) for name in coordinates(run)])


@pytest.mark.parametrize("tol", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("method", ["auto", "rk8", "rodas6p", "radau9", "gauss12"])
def test_long_steps(method, tol):
    """Steps of a quarter of a turn miss none of the four crossings."""
    _, _, summary = motion(FOUR_BAR, "--until", 2, "--every", 0.3, *PASS, "--method", method, "--tol", tol)
    assert summary["passed"]["count"] == 4


def test_branches_that_seem_to_meet():
    """Branches closer than rounding count as one."""
    _, _, summary = motion(FOUR_BAR, "--until", 0.4, *PASS)
    assert summary["passed"]["count"] == 1


def test_no_room(tmp_path):
    """The motion ends where the rows lose rank."""
    said = refdyn("sim", ARM, "--until", repr(float(STRETCHED)), "--step", 1e-3, *PASS, "-o", tmp_path / "run.csv", status=3).stderr
    assert "the step would have to end before, at a time event, a change of inputs or the end of the motion\n" in said, said


def test_hint(tmp_path):
    """If a motion stops there, the message says what could help."""
    said = refdyn("sim", REACH, "--until", 3, "-o", tmp_path / "run.csv", status=3).stderr
    assert "refdyn: --singular pass crosses it if a branch can be followed\n" in said and "crossing the singular position was attempted" not in said, said


# ---- the option ----

@pytest.mark.parametrize("model", ["manipulator", "bricard", "planar", "spacearm"])
@pytest.mark.parametrize("method", ["auto", "radau9"])
def test_nothing_to_pass(model, method, tmp_path):
    """The same to the byte."""
    texts = []
    for singular in ("stop", "pass"):
        refdyn("sim", MODELS / f"{model}.lua", "--until", 1, "--method", method, "--singular", singular, "-o", tmp_path / singular)
        texts.append((tmp_path / singular).read_bytes())
    assert texts[0] == texts[1]


def test_same_bytes(tmp_path):
    for name in ("one", "two"):
        refdyn("sim", ARM, "--until", 1.6, *PASS, "-o", tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_usage(tmp_path):
    done = refdyn("sim", ARM, "--until", 1, "--singular", "through", "-o", tmp_path / "run.csv", status=2)
    assert "refdyn sim: --singular: 'through' is not one of stop, pass\n" in done.stderr
    assert "--singular HOW" in refdyn("sim", "--help").stdout


def test_summary(tmp_path):
    """Crossings are listed only if the option is given."""
    _, _, asked = motion(ARM, "--until", 0.5, *PASS)
    _, _, other = motion(ARM, "--until", 0.5)
    assert asked["passed"] == {"count": 0, "t": [], "stretch": [], "error": [], "error_max": 0} and "passed" not in other
    assert json.dumps(asked)


@pytest.mark.parametrize("method", METHODS)
def test_starts_flat(method, tmp_path):
    """The motion begins where the rows have lost rank: four of five count as redundant there, and three afterwards. It falls half a turn,
    with the energy of test_parallelogram."""
    flat = tmp_path / "flat.lua"
    flat.write_text(FOUR_BAR.read_text().replace("psi = 1 }", "psi = 0 }").replace("psi = -1 }", "psi = 0 }"))
    run, _, _ = motion(flat, "--until", 0.55, *PASS, "--method", method, "--tol", 1e-9)
    crank, inertia = run["crank_psi"], 0.3**2 * 1.2 + 2 * 0.75 * ((0.3**2 + 0.02**2) / 12 + 0.15**2)
    square = -2 * 9.81 * (1.2 * 0.3 + 2 * 0.75 * 0.15) * numpy.sin(crank) / inertia
    assert crank[-1] < -2.5
    check([close("coupler", run["coupler_psi"], -crank, 1e-9), close("rocker", run["rocker_psi"], crank, 1e-9),
           close("square of rate", run["crank_psi_d"]**2, square, 1e-6)])


CHAIN = """local rd = require "refdyn"
local links, points, closes = {}, {}, {}
for i = 1, 20 do
  local crank, coupler, rocker = "crank" .. i, "coupler" .. i, "rocker" .. i
  links[#links + 1] = { crank, at = { 0.5 * i, 0, 0 }, joint = "psi", start = { psi = 1 }, mass = 0.5, center = { 0.15, 0, 0 },
                        inertia = { zz = 0.01 }, spring = { psi = 5 }, damper = { psi = 0.1 } }
  links[#links + 1] = { coupler, on = crank, at = { 0.3, 0, 0 }, joint = "psi", start = { psi = -1 }, mass = 0.7, center = { 0.4, 0, 0 },
                        inertia = { zz = 0.05 } }
  links[#links + 1] = { rocker, at = { 0.5 * i + 0.8, 0, 0 }, joint = "psi", start = { psi = 1.2 }, mass = 0.4, center = { 0.15, 0, 0 },
                        inertia = { zz = 0.01 } }
  points["pin" .. i] = { on = coupler, at = { 0.8, 0, 0 } }
  closes[i] = { "pin" .. i, { on = rocker, at = { 0.35, 0, 0 } }, keep = "x, y" }
end
return rd.model { name = "chain", gravity = { 0, -9.81, 0 }, links = links, points = points,
  constraints = function(s)
    local rows = {}
    for i = 1, 20 do rows[i] = rd.loop(closes[i]) end
    return rows
  end }
"""


@pytest.mark.skipif(LEAN, reason="takes 11 s with sanitizers: tests/long")
def test_many_loops(tmp_path):
    """Rows of loops that share no coordinate are treated separately: otherwise the time is 2.5 times as long, and five times with 40."""
    model = tmp_path / "chain.lua"
    model.write_text(CHAIN)
    cpu = {}
    for how in ("stop", "pass"):
        summaries = [motion(model, "--until", 0.5, "--start", "project", "--method", "rk54", "--singular", how)[2] for _ in range(5)]
        cpu[how] = min(summary["cpu_s"] for summary in summaries)
    assert cpu["pass"] < 2 * cpu["stop"] * SCALE, cpu
