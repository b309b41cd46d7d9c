"""The reference motions, the start off the programme, and conserved quantities."""
import json
import math
import os
import tempfile
import time

import numpy
import pytest

from program import REFERENCE, SCALE, TESTS, check, close, evaluate, motion, oracle


def deviations(run, reference, names, points):
    """Largest deviation from the oracle's samples: of the end-effector [m] and of the coordinates."""
    samples = reference["samples"]
    times = [sample["t"] for sample in samples]
    numpy.testing.assert_allclose(run["t"], times, rtol=0, atol=1e-12)
    q = numpy.array([run[name] for name in names]).T
    of_q = abs(q - numpy.array([sample["q"] for sample in samples])).max()
    if not points:
        return None, of_q
    r = numpy.array([run["E_x"], run["E_y"], run["E_z"]]).T
    return abs(r - numpy.array([sample["r_E"] for sample in samples])).max(), of_q


REFERENCE_MOTIONS = {
    "rigid": ("traj_seed_rigid", ["--set", "n_rfe=1", "--step", "1e-3"]),
    "flexible": ("traj_seed_flexible_4", ["--set", "n_rfe=4", "--step", "1e-5", "--from", "statics"]),
    "flexible, damped": ("traj_seed_flexible_4_damped",
                         ["--set", "n_rfe=4", "--set", "eta=1.3e-3", "--step", "1e-5", "--from", "statics"]),
}


@pytest.mark.parametrize("which", REFERENCE_MOTIONS)
def test_reference_motion(which, capsys):
    name, arguments = REFERENCE_MOTIONS[which]
    reference = oracle(name)
    start = time.time()
    run, _, summary = motion(REFERENCE, *arguments, "--method", "rk4", "--every", "0.5", "--until", "10")
    of_r, of_q = deviations(run, reference, reference["coordinates"], True)
    with capsys.disabled():
        print(f"\n{which}: r_E within {of_r:.1e} m, q within {of_q:.1e}; {summary['steps']} steps, "
              f"{summary['wall_s']:.1f} s of {time.time() - start:.1f} s")
    assert of_r <= 1e-6 * SCALE and of_q <= 1e-6 * SCALE
    assert summary["steps"] == round(10 / float(arguments[arguments.index("--step") + 1]))
    assert summary["evaluations"] >= 4 * summary["steps"]


# Two explicit methods and an implicit one for each, at steps that need at most a second.
TO_THE_LAST_DIGITS = [
    ("rigid", 1e-8, ["rk4 --step 1e-3 --stabilise project", "rk8 --tol 1e-9", "rodas5p --tol 1e-9"]),
    ("flexible", 1e-7, ["rk4 --step 1e-4", "rk8 --tol 1e-9", "rk54 --tol 1e-9", "rodas5p --tol 1e-9"]),
    ("flexible, damped", 1e-8, ["rk8 --tol 1e-8", "rodas5p --tol 1e-10", "rodas6p --tol 1e-10"]),
]


@pytest.mark.parametrize("which, tolerance, method",
                         [(which, tolerance, method) for which, tolerance, methods in TO_THE_LAST_DIGITS for method in methods])
def test_reference_motion_by_every_kind_of_method(which, tolerance, method):
    name, arguments = REFERENCE_MOTIONS[which]
    step = arguments.index("--step")
    reference = oracle(name)
    run, _, _ = motion(REFERENCE, *arguments[:step], *arguments[step + 2:], "--method", *method.split(), "--every", "0.5",
                       "--until", "10")
    of_r, _ = deviations(run, reference, reference["coordinates"], True)
    assert of_r <= tolerance * SCALE, f"r_E differs by {of_r:.1e} m"


def start_file(folder, state):
    path = os.path.join(folder, "start.json")
    with open(path, "w") as file:
        json.dump(state, file)
    return path


def test_flexible_pendulum(tmp_path):
    reference = oracle("traj_pendulum_4")
    first = reference["samples"][0]
    start = start_file(tmp_path, {"q": first["q"], "qd": first["qd"]})
    model = TESTS / "models" / "pendulum_flexible.lua"
    found = evaluate(model, {"q": first["q"], "qd": first["qd"]})
    assert found["coordinates"] == reference["coordinates"]
    assert abs(found["energy"]["kinetic"] - first["kinetic"]) <= 1e-13 * first["kinetic"] * SCALE
    assert abs(found["energy"]["potential"] - first["potential"]) <= 1e-13 * first["potential"] * SCALE
    run, _, _ = motion(model, "--from", start, "--method", "rk4", "--step", "2e-6", "--every", "0.1", "--until", "3")
    _, of_q = deviations(run, reference, reference["coordinates"], False)
    # Torsion at 2e4 rad/s: the error of a step is mainly in its phase.
    assert of_q <= 1e-6 * SCALE, f"q differs by {of_q:.1e}"
    energy = first["kinetic"] + first["potential"]
    assert abs(run["energy"] - energy).max() <= 1e-9 * energy * SCALE


@pytest.mark.parametrize("method", ["rk8 --tol 1e-10", "rodas5p --tol 1e-10", "rodas6p --tol 1e-10"])
def test_flexible_pendulum_by_adaptive_steps(method, tmp_path):
    reference = oracle("traj_pendulum_4")
    first = reference["samples"][0]
    run, _, _ = motion(TESTS / "models" / "pendulum_flexible.lua", "--from",
                       start_file(tmp_path, {"q": first["q"], "qd": first["qd"]}), "--every", "0.1", "--until", "3",
                       "--method", *method.split())
    _, of_q = deviations(run, reference, reference["coordinates"], False)
    assert of_q <= 1e-7 * SCALE, f"q differs by {of_q:.1e}"


def test_start_off_the_programme():
    """The chapter's own programme: the start is off the ellipse, which a warning says, and the gains pull the motion in."""
    run, said, summary = motion(REFERENCE, "--set", "n_rfe=1", "--set", "program=chapter", "--method", "rk4",
                                "--step", "1e-3", "--every", "0.5", "--until", "4")
    assert "1.612" in said, said
    assert "--start project" in said and "stabilis" in said, said
    residual = abs(run["phi_1"])
    assert abs(run["phi_1"][0] - (1.4142135623730951 / 0.875) ** 2 + 1) < 1e-12
    assert (residual[1:] < residual[:-1]).all(), residual
    assert residual[-1] < 1e-6
    assert summary["phi_max"] > 1.6


@pytest.mark.quick
def test_start_is_shown_as_it_is(tmp_path):
    """Also with redundant rows, the reported and shown start is off the programme, and not the projected beginning of the first step."""
    model = tmp_path / "off.lua"
    model.write_text((TESTS / "models" / "four_bar.lua").read_text().replace('start = { psi = 1 }', 'start = { psi = 1.05 }', 1))
    first = {}
    for how in ("none", "project"):
        run, said, _ = motion(model, "--until", "0.02", "--every", "0.01", "--method", "rk8", "--stabilise", how)
        first[how] = {name: column[0] for name, column in run.items()}
        assert f"phi = {float(first[how]['phi_2'])!r}, psi" in said, said
    gap = 0.3 * (math.sin(1.05) - math.sin(1)) + 0.8 * math.sin(0.05)
    check([close("gap", abs(first["project"]["phi_2"]), gap, 1e-12)])
    assert repr(first["project"]) == repr(first["none"])  # multipliers that are not unique are nan


def test_projected_start():
    run, said, summary = motion(REFERENCE, "--set", "n_rfe=1", "--set", "program=chapter", "--start", "project",
                                "--method", "rk4", "--step", "1e-3", "--until", "0.5")
    assert abs(run["phi_1"][0]) < 1e-12 and abs(run["psi_1"][0]) < 1e-12 and abs(run["psi_2"][0]) < 1e-12
    assert summary["phi_max"] < 1e-6


FREE = ["--set", "program=none", "--set", "drive=input", "--set", "d_sup=0"]


def energy_change(tmp_path, until, *arguments):
    """Largest change of the energy over the largest change of kinetic energy, in free motion."""
    names = evaluate(REFERENCE, None, *FREE, *arguments)["coordinates"]
    qd = [{"column_psi": 1, "arm_psi": -0.5}.get(name, 0) for name in names]
    run, _, summary = motion(REFERENCE, *FREE, *arguments, "--from", start_file(tmp_path, {"qd": qd}),
                             "--method", "rk4", "--step", "1e-5", "--until", until, "--every", until / 20)
    kinetic = []
    for sample in range(len(run["t"])):
        state = {"q": [run[name][sample] for name in names], "qd": [run[name + "_d"][sample] for name in names]}
        kinetic.append(evaluate(REFERENCE, state, *FREE, *arguments)["energy"]["kinetic"])
    change = max(abs(numpy.array(kinetic) - kinetic[0]))
    return max(abs(run["energy"] - run["energy"][0])) / change, summary


def test_energy_is_constant(tmp_path):
    change, summary = energy_change(tmp_path, 1)
    assert change <= 1e-9 * SCALE, f"energy changes by {change:.1e} of the kinetic energy's change"
    assert summary["energy_error"] <= 1e-9 * SCALE


def test_printed_form_drifts(tmp_path):
    """It adds energy to the rigid arm, and to the flexible arm within a millisecond."""
    change, _ = energy_change(tmp_path, 0.1, "--set", "n_rfe=1", "--set", "form=printed")
    assert change > 1e-3, f"the printed form's energy changes by {change:.1e} only"


STICKING = """local rd = require "refdyn"
return rd.model { name = "sticking", links = { { "base", joint = "psi", mass = 1, inertia = { zz = 0.05 } },
    { "arm", on = "base", joint = "psi", at = { 0.4, 0, 0 }, mass = 0.3, inertia = { zz = 1e-3 }, center = { 0.2, 0, 0 }, spring = { psi = 40 }, damper = { psi = 0.3 } } },
  forces = function(s) return { base_psi = 1.8 * rd.sin(4 * s.t) + rd.friction(1, s.qd.base_psi, WIDTH) } end }
"""


@pytest.mark.parametrize("width", ["1e-1", "1e-2", "1e-3", "1e-4"])
def test_friction_lets_go(tmp_path, width):
    """A sticking block begins to slide, and sticks again: linear steps would damp the signal of it."""
    model = tmp_path / "sticking.lua"
    model.write_text(STICKING.replace("WIDTH", width))
    scene = [model, "--until", 2, "--every", 0.1]
    exact, other = (motion(*scene, "--method", method, "--tol", "1e-11")[0]["base_psi"] for method in ("radau9", "gauss12"))
    assert abs(exact).max() > 0.1 and abs(exact - other).max() < 1e-8
    for tol in 1e-2, 1e-4, 1e-6:
        run, said, summary = motion(*scene, "--tol", tol)
        assert abs(run["base_psi"] - exact).max() < 10 * tol, summary["chosen"]
        assert "rodas5p" not in summary["chosen"], said


JUMP = """local rd = require "refdyn"
return rd.model { name = "jump", links = { { "cart", joint = { "x" }, mass = 2 } },
  forces = function(s) return { cart_x = rd.where(rd.less(s.t, TIME), 3, -5) + rd.max(s.t - 0.777, 0) } end,
  courses = function(s) return { pull = rd.where(rd.less(s.t, TIME), 3, -5) } end }
"""


@pytest.mark.parametrize("method", [("rk4", "--step", "0.1"), ("rk54", "--tol", "1e-4")])
@pytest.mark.quick
def test_breaks_end_a_step(tmp_path, method):
    """A force that jumps and a force with a kink, both functions of time: polynomials in between, so any step is exact."""
    model, at = tmp_path / "jump.lua", 0.333
    model.write_text(JUMP.replace("TIME", str(at)))
    run, _, summary = motion(model, "--until", "1", "--every", "1", "--method", *method)
    late, ramp = 1 - at, 1 - 0.777
    x = 0.75 * at**2 + 1.5 * at * late - 1.25 * late**2 + ramp**3 / 12
    v = 1.5 * at - 2.5 * late + ramp**2 / 4
    check([f"{name}: {run[name][-1]!r}, not {value!r}" for name, value in {"cart_x": x, "cart_x_d": v}.items()
           if abs(run[name][-1] - value) > 1e-14 * SCALE])
    assert list(run["pull"]) == [3, -5]
    assert summary["steps"] <= 13


SWITCHED = TESTS / "models" / "switched.lua"
WAVE = [(numpy.pi * k / 20, 1 - 2 * (k % 2)) for k in range(7)]
JUMPS = dict.fromkeys(["left", "right", "product", "rounded", "input"], [(0.25, 1)])
JUMPS |= {"twice": [(0.3, 2)], "wave": WAVE, "pulse": [(0.3, 1), (0.7, -1)], "ramp": [(0.7 * numpy.arccos(-0.2) / numpy.pi, 1)]}


@pytest.mark.parametrize("form", JUMPS)
@pytest.mark.parametrize("method", ["rk54", "rk8", "rodas5p", "ros34pw2", "radau9", "gauss12", "auto", "rk4"])
def test_breaks_in_any_form(method, form):
    """A time is met exactly in any formula: also one that is only right at the event, and one that is not linear in time."""
    how, within = (["--step", "0.01"], 2e-7) if method == "rk4" else (["--tol", "1e-7"], 2e-6)
    run, _, summary = motion(SWITCHED, "--set", f"form={form}", "--until", 1, "--every", 0.125, "--method", method, *how)
    t, stiffness = run["t"], 30
    x = sum(5 * sign / stiffness * (1 - numpy.cos(numpy.sqrt(stiffness) * numpy.maximum(t - at, 0))) for at, sign in JUMPS[form])
    late = numpy.maximum(t - 0.25, 0)
    check([close("place", run["pushed_x"], x, within), close("driven", run["driven_x"], late**2 / 2, within),
           close("speed", run["driven_x_d"], late, within)])
    assert abs(run["psi_1"]).max() < 1e-6
    if form in ("left", "right", "product", "rounded", "input"):
        begin = list(t).index(0.25)
        assert run["force_driven_x"][begin] == pytest.approx(1 + 20 * run["driven_x"][begin])


@pytest.mark.parametrize("method", ["rk54", "rk8", "rodas5p", "rodas6p", "ros34pw2", "radau9", "gauss12",
                                    "auto"])
def test_outputs_before_a_jump(tmp_path, method):
    """States inside the step that ends at a jump do not depend on the formula after it."""
    model, at = tmp_path / "jump.lua", 0.333
    model.write_text(JUMP.replace("TIME", str(at)))
    run, _, _ = motion(model, "--until", "0.4", "--every", "0.01", "--method", method, "--tol", "1e-4")
    check([f"{t} s: {x!r}, {v!r}" for t, x, v in zip(run["t"], run["cart_x"], run["cart_x_d"])
           if t < at and max(abs(x - 0.75 * t**2), abs(v - 1.5 * t)) > 1e-13 * SCALE])


def test_auto_without_a_derivative(tmp_path):
    """At a root of 0 no implicit step can begin; the explicit method of the automatic choice can."""
    model = tmp_path / "root.lua"
    model.write_text("""local rd = require "refdyn"
return rd.model { name = "root", links = { { "cart", joint = { "x" }, mass = 1 } },
  forces = function(s) return { cart_x = 1 - rd.sqrt(s.q.cart_x) } end }
""")
    found, _, _ = motion(model, "--until", "1", "--every", "0.5", "--method", "auto")
    wanted, _, _ = motion(model, "--until", "1", "--every", "0.5", "--method", "rk8")
    assert abs(found["cart_x"][-1] - wanted["cart_x"][-1]) < 1e-5 * SCALE


def test_auto_without_a_derivative_in_a_long_chain(tmp_path):
    """The same where vectors of joints yield M for projections: infinite entries next to it have no effect."""
    model = tmp_path / "root_chain.lua"
    model.write_text("""local rd = require "refdyn"
local links = {}
for i = 1, 30 do
  links[i] = { "bar_" .. i, on = i > 1 and "bar_" .. i - 1 or nil, at = { i > 1 and 0.1 or 0, 0, 0 }, joint = "psi",
               start = { psi = 0.03 * i }, bodies = { rd.box { { 0.1, 0.02, 0.02 }, mass = 0.2, at = { 0.05, 0, 0 } } } }
end
return rd.model { name = "root_chain", gravity = { 0, -9.81, 0 }, links = links, points = { tip = { on = "bar_30", at = { 0.1, 0, 0 } } },
  forces = function(s) return { bar_1_psi = -rd.sqrt(rd.abs(s.qd.bar_1_psi)) } end,
  constraints = function(s)
    return { rd.position { s.points.tip.x - rd.parameter("x", s.start.points.tip.x, "m") - 0.05 * rd.sin(s.t)^2 } }
  end }
""")
    found, said, _ = motion(model, "--until", "0.1", "--every", "0.05", "--method", "auto")
    wanted, _, _ = motion(model, "--until", "0.1", "--every", "0.05", "--method", "rk8")
    assert "joint by joint" in said
    assert abs(found["bar_1_psi"][-1] - wanted["bar_1_psi"][-1]) < 1e-5 * SCALE
