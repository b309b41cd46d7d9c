"""Programmes and inputs that jump: rates jump by an impulse, or a message says why not; coincident times; fast functions of time."""
import json
import math
import random
import re

import pytest

from program import LONG, motion, refdyn

METHODS = [["--method", "auto"], ["--method", "rk54"], ["--method", "rodas5p"], ["--method", "radau9"], ["--method", "gauss12"],
           ["--method", "rk4", "--step", 1e-3], ["--method", "rk4", "--step", 1e-3, "--stabilise", "project"],
           ["--stabilise", "none"], ["--stabilise", "baumgarte"]]
IDS = [" ".join(map(str, method)).replace("--", "") for method in METHODS]

# A slide on a programme carries another slide on a spring: where the programme's rate jumps, only the first slide's rate jumps with it.
SLIDES = """
local rd = require "refdyn"
local kind = rd.option("kind", "min")
local v = rd.parameter("v", 0.5, "m/s")
local u = rd.input("u", 0.5, "m/s")
return rd.model {
  name = "slides",
  links = {
    { "a", joint = "x", mass = 2, start_rate = { x = kind == "abs" and -1 or 0.5 } },
    { "b", joint = "x", mass = 1, start = { x = 0.2 }, start_rate = { x = 0.5 } },
  },
  forces = function(s) return { { "spring", stiffness = 50, at = { "a", "b" } } } end,
  events = function(s) return kind == "event" and { rd.event { s.t - 1, parameters = { v = 0 } } } or {} end,
  constraints = function(s)
    local t, x, rate = s.t, s.q.a_x, s.qd.a_x
    local rows = {
      min = function() return rd.position { x - rd.min(0.5 * t, 0.5), name = "course" } end,
      abs = function() return rd.position { x + 1 - rd.abs(t - 1), name = "course" } end,
      where = function() return rd.position { x - rd.where(rd.less(t, 1), 0.5 * t, 0.5), name = "course" } end,
      sine = function() return rd.position { x - rd.where(rd.less(rd.sin(t), rd.sin(1)), 0.5 * t, 0.5), name = "course" } end,
      rate = function() return rd.velocity { rate - rd.where(rd.less(t, 1), 0.5, 0), name = "course" } end,
      event = function() return rd.velocity { rate - v, name = "course" } end,
      input = function() return rd.velocity { rate - u, name = "course" } end,
      step = function() return rd.position { x - rd.where(rd.less(t, 1), 0.5 * t, 0), name = "course" } end,
    }
    return { rows[kind]() }
  end,
}
""".replace("""  forces = function(s) return { { "spring", stiffness = 50, at = { "a", "b" } } } end,
""", """  forces = function(s) local F = 50 * (s.q.b_x - s.q.a_x); return { a_x = F, b_x = -F } end,
""")
AFTER = {"abs": 1}  # rate of the programme after 1 s; before it 0

# A cam lifts a slide: the cam's slope changes at 0 from `c` to `d`.
CAM = """
local rd = require "refdyn"
local g, c, d = rd.parameter("g", 0, "m/s^2"), rd.parameter("c", 0), rd.parameter("d", 0.5)
return rd.model {
  name = "cam", gravity = { 0, -g, 0 },
  links = {
    { "a", joint = "x", mass = 2, start = { x = -0.5 }, start_rate = { x = 1 } },
    { "b", on = "a", joint = "y", mass = 1, start = { y = -0.5 * c }, start_rate = { y = c } },
  },
  constraints = function(s)
    return { rd.position { s.q.b_y - rd.where(rd.less(s.q.a_x, 0), c * s.q.a_x, d * s.q.a_x), name = "cam" } }
  end,
}
"""

KINK = """
local rd = require "refdyn"
local K, f = rd.parameter("K", 0.3, "s"), rd.option("f", "ramp")
local u = rd.input("u", 0, "N")
return rd.model {
  name = "kink", links = { { "a", joint = "x", mass = 2, spring = { x = 50 } } },
  forces = function(s) return { a_x = u + (f == "ramp" and rd.max(0, s.t - K) or rd.where(rd.less(s.t, K), 0, 1)) } end,
}
"""

FAST = """
local rd = require "refdyn"
local kind, w = rd.option("kind", "sine"), rd.parameter("w", 1000 * rd.pi, "rad/s")
local values = {
  sine = function(t) return rd.sin(w * t) end,
  touch = function(t) return rd.sin(w * t) - 0.9999 end,
  chirp = function(t) return rd.sin(w * t^2 / 2) end,
  power = function(t) return rd.cos(w * t / 4)^4 - 0.5 end,
  modulated = function(t) return rd.sin(w * t + 5 * rd.sin(0.1 * w * t)) end,
  inside = function(t) return rd.abs(rd.sin(w * t)) - 0.5 end,
  near = function(t) return (t - 0.5) * (t - 0.501) end,
}
return rd.model {
  name = "fast", links = { { "a", joint = "x", mass = 2, spring = { x = 50 }, start = { x = 0.1 } } },
  forces = function(s) return { a_x = kind == "force" and rd.where(rd.less(0, rd.sin(2 * w * s.t)), 1, 0) or 0 } end,
  events = function(s) return kind ~= "force" and { rd.event { values[kind](s.t), name = "zero" } } or {} end,
}
"""


def simulate(folder, text, *arguments, status=0):
    """The last row, the messages and the summary."""
    (folder / "model.lua").write_text(text)
    done = refdyn("sim", folder / "model.lua", *arguments, "-o", folder / "run.csv", "--summary", folder / "run.json", status=status)
    if status:
        return None, done.stderr, None
    names, *_, last = (folder / "run.csv").read_text().splitlines()
    return dict(zip(names.split(","), map(float, last.split(",")))), done.stderr, json.loads((folder / "run.json").read_text())


def slides(kind):
    """The second slide at 2 s: it swings about the first, whose rate jumps at 1 s."""
    w, before, after = math.sqrt(50), -1 if kind == "abs" else 0.5, AFTER.get(kind, 0)
    swing, rate = 0.2, 0.5 - before  # relative to the first slide, which moves uniformly
    for change in before - after, 0:
        c, s = math.cos(w), math.sin(w)
        swing, rate = c * swing + s / w * rate, c * rate - w * s * swing
        rate += change
    return before + after + swing


@pytest.mark.parametrize("method", METHODS, ids=IDS)
@pytest.mark.parametrize("kind", ["min", "abs", "where", "sine", "rate", "event", "input"])
def test_rates_of_a_programme_jump(kind, method, tmp_path):
    """For every kind of jump and stabilisation: the closed form, and an energy balance that includes the work of the impulse."""
    (tmp_path / "inputs.csv").write_text("t,u\n0,0.5\n1,0\n")
    inputs = ["--inputs", tmp_path / "inputs.csv"] if kind == "input" else []
    last, _, summary = simulate(tmp_path, SLIDES, "--set", f"kind={kind}", "--until", 2, "--every", 0.4, *method, *inputs)
    assert abs(last["b_x"] - slides(kind)) < 2e-5
    assert summary["energy_error"] < 1e-5
    assert summary["phi_max"] < 1e-9 and summary["psi_max"] < 1e-9


@pytest.mark.parametrize("method", METHODS[:-4] + METHODS[-3:-1], ids=IDS[:-4] + IDS[-3:-1])
def test_position_of_a_programme_jumps(method, tmp_path):
    """No impulse moves positions: the message names the row and the time."""
    _, said, _ = simulate(tmp_path, SLIDES, "--set", "kind=step", "--until", 2, *method, status=3)
    assert re.search(r"t = 1(\.0+\d)? s: rows that begin to act or jump at this time, or a changed parameter, require positions other than those of the motion, constraint course\n", said), said


def test_gains_leave_a_position_to_be_pulled_in(tmp_path):
    """Baumgarte's gains may do that; without gains, a warning says that the row is not satisfied."""
    _, said, _ = simulate(tmp_path, SLIDES, "--set", "kind=step", "--until", 2, "--stabilise", "baumgarte")
    assert "warning: course is not satisfied: its phi is up to 0.5" in said


@pytest.mark.parametrize("method", METHODS, ids=IDS)
def test_rows_that_turn_at_a_position(method, tmp_path):
    """At a corner of a cam, rates are projected in the metric of M: (1, 0) onto (1, d) with masses 3 and 1."""
    for every in 0.5, 0.37:
        last, _, summary = simulate(tmp_path, CAM, "--until", 2, "--every", every, *method)
        rate = 3 / (3 + 0.25)
        assert abs(last["a_x_d"] - rate) < 1e-9 and abs(last["b_y_d"] - rate / 2) < 1e-9
        assert abs(last["a_x"] - 1.5 * rate) < 1e-8
        assert summary["energy_error"] in (0, None) or summary["energy_error"] < 1e-6


@pytest.mark.parametrize("method", METHODS[:5] + METHODS[7:8], ids=IDS[:5] + IDS[7:8])
def test_corner_that_holds_a_motion(method, tmp_path):
    """A valley in which each crossing removes a part of the rate: the motion comes to rest in the corner, and ends there."""
    _, said, _ = simulate(tmp_path, CAM, "--set", "c=-1", "--set", "d=1", "--set", "g=9.81", "--until", 3, *method, status=3)
    assert re.search(r"t = 1\.865\d* s: forces or rows jump here, and lead back to the jump from both sides", said), said


def moved(t, steps):
    for _ in range(abs(steps)):
        t = math.nextafter(t, math.copysign(math.inf, steps))
    return t


@pytest.mark.parametrize("method", METHODS[:6], ids=IDS[:6])
@pytest.mark.parametrize("f", ["ramp", "jump"])
def test_samples_within_rounding(f, method, tmp_path):
    """Within rounding of a kink in time, of each other, of outputs, of the end and of the start."""
    ends = []
    for samples, every, until in [((-2,), 0.3, 0.6), ((-1,), 0.3, 0.6), ((1, 2), 0.3, 0.6), ((-9, -1, 0, 1, 2), 0.1, 0.6), ((-1, 1), 0.6, moved(0.3, 2)),
                                  ((-2, 0), 0.3, moved(0.3, -1))]:
        rows = "".join(f"{moved(0.3, k)!r},2\n" for k in samples)
        (tmp_path / "inputs.csv").write_text("t,u\n0,1\n" + rows)
        last, said, _ = simulate(tmp_path, KINK, "--set", f"f={f}", "--until", repr(until), "--every", repr(every), "--inputs", tmp_path / "inputs.csv", *method)
        assert math.isfinite(last["a_x"]) and "not resolved" not in said
        ends.append((until, last["a_x"]))
    assert all(abs(x - ends[0][1]) < 1e-5 for until, x in ends if until == 0.6)
    assert abs(ends[-1][1] - ends[-2][1]) < 1e-5


@pytest.mark.parametrize("method", METHODS[:5], ids=IDS[:5])
def test_samples_next_to_the_start(method, tmp_path):
    """Steps after a step of 1e-17 s are not too short."""
    for t in 5e-324, 1e-200, 1e-17, 1e-15:
        (tmp_path / "inputs.csv").write_text(f"t,u\n0,0\n{t!r},1\n")
        last, _, _ = simulate(tmp_path, KINK, "--set", f"K={max(t, 1e-300)!r}", "--set", "f=jump", "--until", 0.5, "--inputs", tmp_path / "inputs.csv", *method)
        assert abs(last["a_x"] - 0.04 * (1 - math.cos(2.5))) < 1e-4


def expected_zeros(kind):
    w = 1000 * math.pi
    if kind == "touch":
        apart = math.acos(0.9999) / w
        return [k / 500 + 0.0005 + side * apart for k in range(500) for side in (-1, 1)]
    if kind == "chirp":
        return [math.sqrt(k / 500) for k in range(501)]
    if kind == "power":
        first = math.acos(0.5**0.25) * 4 / w
        return sorted(k * 0.004 + side * first for k in range(251) for side in (-1, 1) if 0 < k * 0.004 + side * first < 1)
    if kind == "inside":
        return [k / 1000 + part / 6000 for k in range(1000) for part in (1, 5)]
    if kind == "near":
        return [0.5, 0.501]
    return [k / 1000 for k in range(1001)]


@pytest.mark.parametrize("method", METHODS[:5] + [["--method", "rk4", "--step", 0.02]], ids=IDS[:5] + ["rk4"])
@pytest.mark.parametrize("kind", ["sine", "touch", "chirp", "power", "inside", "near"])
def test_zeros_in_time_are_all_found(kind, method, tmp_path):
    """Each at its time, although steps would be much longer."""
    summary = simulate(tmp_path, FAST, "--set", f"kind={kind}", "--until", 1, "--every", 0.5, *method)[2]
    found, expected = [event["t"] for event in summary["events"]], expected_zeros(kind)
    assert summary["event_count"] == len(expected) and len(found) == min(len(expected), 500)
    assert all(abs(a - b) < 1e-9 for a, b in zip(found, expected))


@pytest.mark.parametrize("method", METHODS[:5], ids=IDS[:5])
def test_fast_comparison_in_a_force(method, tmp_path):
    """A sine of 1 kHz switches a force: half of it in the mean."""
    last, _, summary = simulate(tmp_path, FAST, "--set", "kind=force", "--until", 1, *method)
    w, pulse = 5.0, 0.0
    x, v = 0.1, 0.0
    for k in range(2000):  # exact over each half of a period
        F = (1 - k % 2) / 50
        c, s = math.cos(w * 0.0005), math.sin(w * 0.0005)
        x, v = F + c * (x - F) + s / w * v, c * v - w * s * (x - F)
    assert pulse == 0.0 and abs(last["a_x"] - x) < 1e-5 and summary["steps"] >= 2000


def test_slow_functions_cost_nothing(tmp_path):
    """The search follows the frequency: few steps for slow functions."""
    summary = simulate(tmp_path, FAST, "--set", "kind=sine", "--set", "w=3", "--until", 1)[2]
    assert summary["steps"] < 30 and len(summary["events"]) == 1


# ---- Forces that jump at places and rates ----

PLACES = """
local rd = require "refdyn"
return rd.model {{
  name = "places", gravity = {{ 0, 0, -9.81 }},
  links = {{
    {{ "m", turn = {{ {{ "{axis}", {tilt} }} }}, joint = "x", mass = {mass}, spring = {{ x = {spring} }}, start = {{ x = {start} }}, start_rate = {{ x = {rate} }} }},
    {{ "p", joint = "psi", turn = {{ {{ "x", rd.pi / 2 }} }}, mass = 1, center = {{ 0.4, 0, 0 }}, inertia = {{ zz = 0.02 }}, start = {{ psi = {ratio} * {start} }}, start_rate = {{ psi = {ratio} * {rate} }} }} }},
  constraints = function(s) return {{ {rows} }} end,
  forces = function(s) return {{ m_x = {force} }} end,
}}
"""
AT_PLACES = {
    "place": "rd.where(rd.less(s.q.m_x, {at}), {high}, {low})",
    "places": "rd.where(rd.less(s.q.m_x, {at}), rd.where(rd.less(s.q.m_x, {at} - 0.2), {high}, 0.3), {low}) * (1 + 0.3 * rd.sin(3 * s.t))",
    "both": "rd.where(rd.less(s.q.m_x - 0.4 * s.q.p_psi, {at}), {high}, {low})",
    "rate": "rd.where(rd.less(s.qd.m_x, 2 * {at}), {high}, 0.4 * {high})",
    "stop": "rd.where(rd.less(s.q.m_x, {at}), 0, -100 * {high} * (s.q.m_x - {at}) - 2 * {high} * s.qd.m_x)",
}


@pytest.mark.parametrize("seed", range(100 if LONG else 6))
def test_jumps_at_places(seed, tmp_path):
    """By all methods: inexact stages of a step that ends at a jump lie beyond it, and are to see the force before it."""
    rng = random.Random(seed)
    values = {"axis": rng.choice("yz"), "at": rng.uniform(-0.1, 0.25), "high": rng.uniform(0.5, 3), "low": rng.uniform(-2, -0.3)}
    ratio, is_closed = rng.uniform(1, 3), rng.random() < 0.3
    kind = list(AT_PLACES)[seed % len(AT_PLACES)]
    rows = f"rd.position {{ s.q.p_psi - {ratio} * s.q.m_x }}" if is_closed and kind != "both" else ""
    model = tmp_path / "places.lua"
    model.write_text(PLACES.format(force=AT_PLACES[kind].format(**values), rows=rows, ratio=ratio, tilt=rng.uniform(-1, 1), mass=rng.uniform(0.5, 2), spring=rng.uniform(30, 60),
                                   start=rng.uniform(-0.3, 0.3), rate=rng.uniform(0.7, 2), axis=values["axis"]))
    expected, _, _ = motion(model, "--until", 2, "--every", 0.05, "--method", "gauss12", "--tol", 1e-12)
    methods = ["rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "ros34pw2"]
    for method in methods if LONG else rng.sample(methods[:4], 1) + methods[4:]:
        steps = ["--step", 2e-3, "--stabilise", "project"] if method == "rk4" else ["--tol", 1e-8]
        found, _, _ = motion(model, "--until", 2, "--every", 0.05, "--method", method, *steps)
        off = max(abs(found[name] - expected[name]).max() for column in expected if column + "_d" in expected for name in (column, column + "_d"))
        assert off < 1e-6, (kind, method, off)
