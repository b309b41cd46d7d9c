"""Friction that sticks and slides: `auto` compared with references, what `--verify` reports for every method, which formulas count as
friction."""
import math
import re

import numpy
import pytest

from friction_suite import ALLOWED, ROUGH, ROUGH_STEPS_ALLOWED, SCENES, STEPS_ALLOWED, TOLERANCES, WIDTHS, run
from program import LONG, SCALE, check, close, motion, refdyn

# tests/long: all scenes.
SOME_WIDTHS = WIDTHS if LONG else ("1e-2", "1e-6", "1e-10")
SOME_TOLERANCES = TOLERANCES if LONG else ("1e-3", "1e-6", "1e-8")
# Other methods by name; an explicit one has no time for small widths.
OTHERS = ("gauss12", "rodas5p")
# A trustworthy estimate may be at most this many times smaller than the error that it estimates.
MISSED = 10


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_auto_meets_its_tolerance(scene):
    """Sticking and sliding at every width, in a number of steps that hardly depends on the width."""
    for width in SOME_WIDTHS:
        runs = {tol: run(scene, width, "auto", tol) for tol in SOME_TOLERANCES}
        check([f"width {width}, tol {tol}: error {found.error:.1e}" for tol, found in runs.items()
               if not found.error <= ALLOWED * float(tol) * SCALE])
        assert all(set(found.summary["chosen"]) == {"radau9"} for found in runs.values())
        assert all(found.steps < 1000 for found in runs.values()), {tol: found.steps for tol, found in runs.items()}


@pytest.mark.parametrize("scene", SCENES if LONG else SCENES[1:3], ids=lambda scene: scene.name)
def test_steps_beside_the_best_method(scene):
    """The best single method is chosen among those within ten tolerances."""
    for width in SOME_WIDTHS:
        for tol in SOME_TOLERANCES:
            others = [run(scene, width, method, tol) for method in OTHERS if not (method == "rodas5p" and float(width) < 1e-5)]
            good = [other.steps for other in others if other.error <= ALLOWED * float(tol)]
            own = run(scene, width, "auto", tol).steps
            allowed = ROUGH_STEPS_ALLOWED if tol == ROUGH else STEPS_ALLOWED
            assert not good or own <= allowed * min(good), (width, tol, own, good)


@pytest.mark.parametrize("method", ["auto", *OTHERS])
@pytest.mark.parametrize("scene", SCENES if LONG else SCENES[:2], ids=lambda scene: scene.name)
def test_what_is_trusted_is_right(scene, method):
    """Also for methods that never resolve the sliding: the finer motion uses the points of Radau."""
    for width in SOME_WIDTHS if method == "auto" else ("1e-2", "1e-6"):
        for tol in SOME_TOLERANCES:
            found = run(scene, width, method, tol, "--verify")
            told = found.summary["error"]
            assert not told["is_trusted"] or found.error <= MISSED * told["largest"], (width, tol, found.error, told["largest"])


STOPPING = """local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }
return rd.model { name = "stopping", links = { { "block", joint = "x", mass = 1, start_rate = { x = 0.7 } } },
  forces = function(s) return { block_x = rd.friction(1.3, s.qd.block_x, p.w) } end }
"""


@pytest.mark.parametrize("width", ["1e-1", "1e-4", "1e-7", "1e-10"])
def test_block_stops(tmp_path, width):
    """In closed form: sinh(v/w) falls by e^(-L t/(m w)), so the distance is the integral of v/(L tanh(v/w)) over v."""
    model, w, level, speed = tmp_path / "stopping.lua", float(width), 1.3, 0.7
    model.write_text(STOPPING)
    # v coth(v/w) = v + 2 v/(e^(2 v/w) - 1); of the second term, 2 w^2 times the integral of y/(e^(2 y) - 1)
    y = numpy.linspace(0, min(speed / w, 40), 400001)
    with numpy.errstate(invalid="ignore"):
        term = numpy.where(y > 0, 2 * y / numpy.expm1(2 * y), 1)
    way = (speed**2 / 2 + w**2 * numpy.sum((term[1:] + term[:-1]) / 2 * numpy.diff(y))) / level
    for tol in 1e-4, 1e-6, 1e-8:
        found, said, summary = motion(model, "--set", f"w={width}", "--until", 5, "--every", 5, "--tol", tol)
        left = w / level * w * math.exp(-level * 5 / w) if w > 0.05 else 0  # remaining integral
        assert abs(found["block_x"][-1] + left - way) < ALLOWED * tol * SCALE, said


CLAMPED = """local rd = require "refdyn"
local p = rd.parameters { { "w", 0.1, "m/s" } }
return rd.model { name = "clamped", links = { { "block", joint = "x", mass = 1 } },
  forces = function(s) return { block_x = 2 * rd.sin(3 * s.t) - 1.3 * rd.max(-1, rd.min(1, s.qd.block_x / p.w)) } end }
"""


def pushed(until, w, L=1.3):
    """x of x'' = 2 sin 3t - L clamp(x'/w), from rest: closed forms inside and outside the layer, joined at its ends, which bisection
    locates."""
    k = L / w

    def particular(t):
        return 2 * (k * math.sin(3 * t) - 3 * math.cos(3 * t)) / (k * k + 9)

    def rate(t, t0, v0, side):
        if side:
            return v0 + 2 / 3 * (math.cos(3 * t0) - math.cos(3 * t)) - side * L * (t - t0)
        return particular(t) + (v0 - particular(t0)) * math.exp(-k * (t - t0))

    def way(t, t0, v0, side):
        d = t - t0
        if side:
            return (v0 + 2 / 3 * math.cos(3 * t0)) * d - 2 / 9 * (math.sin(3 * t) - math.sin(3 * t0)) - side * L * d * d / 2
        return (v0 - rate(t, t0, v0, 0) + 2 / 3 * (math.cos(3 * t0) - math.cos(3 * t))) / k
    t, x, v, side = 0.0, 0.0, 0.0, 0
    while True:
        grid = numpy.append(numpy.arange(t + 1e-9, until, 1e-3), until)
        rates = [rate(at, t, v, side) for at in grid]
        left = [abs(now) > w if side == 0 else side * now < w for now in rates]
        if not any(left):
            return x + way(until, t, v, side)
        first = left.index(True)
        end = math.copysign(w, rates[first]) if side == 0 else side * w
        low, high, sign = grid[first - 1] if first else t, grid[first], math.copysign(1, rates[first] - end)
        for _ in range(100):
            middle = (low + high) / 2
            low, high = (low, middle) if sign * (rate(middle, t, v, side) - end) > 0 else (middle, high)
        x += way(high, t, v, side)
        t, v, side = high, end, 0 if side else int(math.copysign(1, end))


@pytest.mark.parametrize("method", ["auto", "radau9", "gauss12", "rodas5p", "rk8"])
def test_kinks_in_rates(tmp_path, method):
    """Steps end where a straight line meets its level: steps across it have errors of thousands of tolerances."""
    model = tmp_path / "clamped.lua"
    model.write_text(CLAMPED)
    lines = []
    for width in 0.3, 0.1, 1e-3:
        expected = pushed(3, width)
        for tol in (1e-6, 3e-8, 3e-9) if method != "rodas5p" else (1e-6,):
            found, _, _ = motion(model, "--set", f"w={width}", "--until", 3, "--every", 3, "--method", method, "--tol", tol)
            lines.append(close(f"width {width}, tol {tol}", found["block_x"][-1:], [expected], ALLOWED * tol * SCALE, 1))
    check(lines)


FORMULAS = {
    "rd.tanh(r)": True, "rd.atan(r / 1e-3)": True, "r / rd.sqrt(r * r + 1e-6)": True, "r / (rd.abs(r) + 1e-3)": True,
    "rd.max(-1, rd.min(1, r / 1e-3))": True, "2 / (1 + rd.exp(-r / 1e-3)) - 1": True, "rd.where(rd.less(r, 0), -1, 1)": True,
    "r * (r * r + 1e-6) ^ -0.5": True, "0.3 * r": False, "rd.abs(r) * r": False, "r * rd.sqrt(r * r + 1)": False,
    "rd.tanh(s.q.block_x)": False, "r / (1 + s.q.block_x ^ 2)": False, "rd.sin(r)": False,
}
SCENE = """local rd = require "refdyn"
return rd.model { name = "formula", links = { { "block", joint = "x", mass = 1 } },
  forces = function(s) local r = s.qd.block_x; return { block_x = -(FORMULA) } end }
"""


@pytest.mark.parametrize("formula", FORMULAS)
def test_formulas_that_saturate(tmp_path, formula):
    (tmp_path / "formula.lua").write_text(SCENE.replace("FORMULA", formula))
    refdyn("gen", tmp_path / "formula.lua", "-o", tmp_path)
    assert f"SET(saturates) {int(FORMULAS[formula])}," in (tmp_path / "formula.c").read_text()


def test_points_of_loops(tmp_path):
    """The rate of a point at the end of a chain with loops is carried from element to element."""
    (tmp_path / "chain.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "chain", links = { { "arm", joint = "psi", beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 12, dofs = "psi" } } },
  points = { tip = "arm.tip" }, forces = function(s) local v = s.points.tip.yd; return { rd.force { "tip", { 0, FORCE, 0 } } } end }
""")
    for force, saturates in ("-v / rd.sqrt(v * v + 1e-6)", 1), ("-v", 0):
        path = tmp_path / f"chain_{saturates}.lua"
        path.write_text((tmp_path / "chain.lua").read_text().replace("FORCE", force))
        refdyn("gen", path, "-o", tmp_path)
        assert f"SET(saturates) {saturates}," in (tmp_path / "chain.c").read_text()


RELAY = """local rd = require "refdyn"
return rd.model { name = "relay", links = { { "b", joint = "x", mass = 1, start = { x = 0.3 }, start_rate = { x = 0.7 } } },
  forces = function(s) local x, v = s.q.b_x, s.qd.b_x; return { b_x = -5 * x + rd.sin(3 * s.t) - 3 * rd.where(rd.less(0, x + 0.5 * v), 1, -1) } end }
"""


@pytest.mark.parametrize("method", ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "ros34pw2", "gauss12"])
def test_relay_that_slides(tmp_path, method):
    """Forces that return to their jump from both sides cause a message instead of steps without end. The relay slides once x + v/2 is zero."""
    (tmp_path / "relay.lua").write_text(RELAY)
    done = refdyn("sim", tmp_path / "relay.lua", "--until", 5, "--method", method, "-o", tmp_path / "run.csv", status=3)
    assert "give friction a width" in done.stderr
    assert re.search(r"t = 0\.3[01]\d* s: forces or rows jump here, and lead back to the jump from both sides\n", done.stderr), done.stderr
    assert "refdyn: a relay needs two levels: write two events that set an input\n" in done.stderr


def test_friction_that_jumps(tmp_path):
    """A sign function has no state in which it sticks: the message says what to write instead."""
    (tmp_path / "formula.lua").write_text(SCENE.replace("FORMULA", "1.3 * rd.where(rd.less(r, 0), -1, 1) + rd.sin(3 * s.t)"))
    done = refdyn("sim", tmp_path / "formula.lua", "--until", 1, "-o", tmp_path / "run.csv", status=3)
    assert ("refdyn: a force jumps, or reaches a limit, as a rate passes a value; give friction a width of 1e-10 or more, as in "
            "rd.friction(level, rate, width)\n") in done.stderr
