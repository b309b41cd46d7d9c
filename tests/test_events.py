"""State events: their times compared with closed forms and independent solutions, by methods of all kinds; the values they set; events at
the start, simultaneous, grazing or accumulating ones; their reports in summaries, CSV and batches."""
import csv
import json
import math
import re
import tempfile

import numpy
import pytest

from compiled import Compiled
from program import TESTS, check, close, motion, read_run, refdyn

MODELS = TESTS / "models" / "events"
METHODS = ["auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
G = 9.81


def events(name, *arguments):
    """Times of each event by its name, and the summary."""
    _, _, summary = motion(MODELS / f"{name}.lua", *arguments)
    times = {}
    for mark in summary["events"]:
        times.setdefault(mark["event"], []).append(mark["t"])
    return times, summary


def failed(name, *arguments):
    """The message of a motion that fails."""
    return refdyn("sim", MODELS / f"{name}.lua", *arguments, "-o", tempfile.mkdtemp() + "/run.csv", status=3).stderr


def settings(**values):
    return [word for name, value in values.items() for word in ("--set", f"{name}={value}")]


def root(function, low, high):
    """Root by bisection; the function changes its sign between the ends."""
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if (function(middle) < 0) == (function(low) < 0) else (low, middle)
    return low


def secant(function, x, y):
    a, b = function(x), function(y)
    while abs(a - b) > 0 and abs(x - y) > 1e-15:
        x, y, a, b = y, y - b * (y - x) / (b - a), b, None
        b = function(y)
    return y


def bounces(e, h, count):
    v, times = math.sqrt(2 * G * h), [math.sqrt(2 * h / G)]
    for _ in range(count - 1):
        v *= e
        times.append(times[-1] + 2 * v / G)
    return times


@pytest.mark.parametrize("method", METHODS)
def test_ball(method):
    times, summary = events("ball", "--until", 4, "--method", method)
    found = times["impact 1"]
    assert len(found) == 19 and summary["energy_error"] < 1e-9
    check([close("impacts", found, bounces(0.8, 1, 19), 1e-11)])


@pytest.mark.parametrize("e", [0.5, 0.95])
def test_ball_comes_to_rest(e):
    """Impacts accumulate at a known time: the motion ends there, with a message."""
    told = failed("ball", "--until", 60, *settings(e=e))
    rest = math.sqrt(2 / G) * (1 + e) / (1 - e)
    first = told.splitlines()[0]
    assert first.endswith(": events follow each other without time between") and "at the event impact 1" in told
    check([close("rest", [float(first.split("t = ")[1].split()[0])], [rest], 1e-9)])


def test_ball_without_restitution():
    """No time passes between an impact and the next one."""
    told = failed("ball", "--until", 60, *settings(e=0))
    assert told.startswith("refdyn: ball: t = 0.4515236")
    assert "events follow each other without time between" in told


def test_vibrating_table():
    """The gap's rate includes the rate of the table; restitution applies to the gap."""
    times, _ = events("ball", "--until", 2, "--method", "rk8", "--tol", 1e-10, *settings(A=0.02, e=0.9))
    A, w, e = 0.02, 20, 0.9
    t, z, v, expected = 0.0, 1.0, 0.0, []
    while True:
        def gap(at):
            return z + v * (at - t) - G * (at - t) ** 2 / 2 - A * math.sin(w * at)
        grid = t + numpy.arange(1, 40000) * 1e-4
        values = [gap(at) for at in grid]
        first = next(k for k, value in enumerate(values) if value < 0)
        hit = root(gap, grid[first - 1] if first else t + 1e-9, grid[first])
        if hit > 2:
            break
        z, v, t = z + v * (hit - t) - G * (hit - t) ** 2 / 2, v - G * (hit - t), hit
        v = v - (1 + e) * (v - A * w * math.cos(w * t))
        expected.append(hit)
    assert len(expected) >= 2
    check([close("impacts", times["impact 1"], expected, 1e-10)])


@pytest.mark.parametrize("method", METHODS)
def test_rocking_block(method):
    tolerance = [] if method == "rk4" else ["--tol", 1e-11]
    times, _ = events("block", "--until", 8, "--method", method, *tolerance)
    p, alpha, keep, start = 2, 0.2, 0.9, 0.15
    t = math.acosh(alpha / (alpha - start)) / p
    rate = (alpha - start) * p * math.sinh(p * t)
    expected = []
    while t < 8:
        expected.append(t)
        rate *= keep
        t += 2 / p * math.atanh(rate / (p * alpha))
    assert len(expected) > 4
    check([close("impacts", times["impact"], expected, 1e-9)])


def step_of_bulirsch(f, y, h):
    """A step of Gragg's method extrapolated to order 16 (Hairer, Norsett and Wanner, Solving ODEs I, II.9)."""
    table = []
    for k in range(1, 9):
        n = 2 * k
        before, now = y, y + h / n * f(y)
        for _ in range(n - 1):
            before, now = now, before + 2 * h / n * f(now)
        row = [0.5 * (now + before + h / n * f(now))]
        for j in range(1, k):
            row.append(row[j - 1] + (row[j - 1] - table[-1][j - 1]) / ((n / (2 * (k - j))) ** 2 - 1))
        table.append(row)
    return table[-1][-1]


def test_arm_on_stop(tmp_path):
    """A flexible arm's tip compared with an extrapolation method with its own impacts, M^-1 by numpy."""
    until, e, stop = 0.8, 0.6, -0.35
    arm = Compiled(MODELS / "arm.lua", tmp_path / "arm")
    n = arm.n

    def state(y):
        return {"t": 0.0, "q": y[:n], "qd": y[n:]}

    def rates(y):
        return numpy.concatenate([y[n:], arm("qdd_free", state(y))])

    def gap(y):
        return arm("r", state(y))[0][2] - stop
    t, y, h, expected = 0.0, numpy.array(arm.start), 4e-3, []
    while t < until:
        new = step_of_bulirsch(rates, y, h)
        if gap(new) >= 0:
            t, y = t + h, new
            continue
        part = secant(lambda part: gap(step_of_bulirsch(rates, y, part)), h * gap(y) / (gap(y) - gap(new)), h)
        t, y = t + part, step_of_bulirsch(rates, y, part)
        expected.append(t)
        g = arm("C", state(y))[0][2]
        along = numpy.linalg.solve(arm("M", state(y)), g)
        y[n:] -= (1 + e) * (g @ y[n:]) / (g @ along) * along
        y = step_of_bulirsch(rates, y, 1e-5)
        t += 1e-5
    assert len(expected) >= 3
    lines = []
    for method in ("rk8", "gauss12", "radau9"):
        found, _ = events("arm", "--until", until, "--method", method, "--tol", 1e-12)
        count = min(len(found["stop"]), len(expected))
        lines.append("" if count == len(expected) else f"{method}: {len(found['stop'])} impacts, not {count}")
        lines.append(close(method, found["stop"][:count], expected[:count], 1e-9))
    check(lines)


@pytest.mark.parametrize("method", METHODS)
def test_relay(method):
    """A switch with hysteresis: parabolas between its ends."""
    times, summary = events("relay", "--until", 6, "--method", method)
    b, F, x, v, t, push = 0.3, 2, 0.0, 0.7, 0.0, 1
    expected = {"off": [], "on": []}
    while True:
        end, a = push * b, push * F
        dt = (-v + push * math.sqrt(v * v + 2 * a * (end - x))) / a
        t, x, v = t + dt, end, v + a * dt
        if t > 6:
            break
        expected["off" if push > 0 else "on"].append(t)
        push = -push
    assert len(expected["off"]) >= 2
    check([close(name, times[name], expected[name], 1e-11) for name in expected])
    assert summary["energy_error"] < 1e-9


@pytest.mark.parametrize("stabilise", ["project", "baumgarte", "none"])
@pytest.mark.parametrize("method", ["rk8", "radau9", "rodas5p"])
def test_impact_with_rows(method, stabilise):
    """The impulse respects the rows: a point on a circle moves like a turn."""
    fine = ("--until", 6, "--tol", 1e-11)
    turn, _ = events("pendulum", *fine, "--method", "rk8")
    row, _ = events("pendulum", *fine, "--method", method, "--stabilise", stabilise, *settings(form="row"))
    assert len(turn["wall"]) >= 4
    check([close("impacts", row["wall"], turn["wall"], 1e-8 if stabilise == "none" else 1e-9)])


@pytest.mark.quick
def test_rates_against_rows():
    told = failed("pendulum", "--until", 3, *settings(form="row", set="rates"))
    assert "what an event sets is not finite, or the rows do not allow it, constraint row 1" in told
    assert "refdyn: at the event wall" in told


@pytest.mark.parametrize("method", ["auto", "rk4", "radau9"])
def test_parameter(method):
    """The stiffness jumps at the first passage; later ones change nothing."""
    fine = [] if method == "rk4" else ["--tol", 1e-12]
    times, summary = events("spring", "--until", 8, "--method", method, *fine)
    passage = math.pi / 2 / 3
    middle = [passage + k * math.pi for k in range(3)]
    turn = [passage + math.pi / 4 + k * math.pi for k in range(3)]
    check([close("middle", times["middle"], middle, 1e-9), close("turn", times["turn"], turn, 1e-9)])
    assert summary["energy_error"] < 1e-6


def test_second_run_has_first_values():
    """Values set by events do not survive a motion: --verify and --accuracy run it again."""
    run = ("--until", 3, "--method", "rk8")
    _, _, alone = motion(MODELS / "spring.lua", *run)
    _, _, verified = motion(MODELS / "spring.lua", *run, "--verify")
    assert verified["events"] == alone["events"]
    assert verified["error"]["largest"] < 1e-5 and verified["error"]["is_trusted"]


@pytest.mark.parametrize("form", ["max", "where", "energy"])
@pytest.mark.parametrize("method, tolerance", [("gauss12", 1e-11), ("radau9", 1e-7), ("rk8", 1e-4)])
def test_kinks(method, tolerance, form):
    """Steps end where a formula of coordinates has a kink: a ball touches a spring for slightly more than half a period. A step across the
    kink would reduce the accuracy of high-order methods by a factor of 1e5 and more."""
    times, _ = events("penalty", "--until", 10, "--method", method, "--tol", 1e-9, *settings(form=form))
    w, fall = math.sqrt(1e5), math.sqrt(2 / G)
    touch = 2 * (math.pi - math.atan(G * fall * w / G)) / w
    assert len(times["top"]) == 11 and times["top"][0] == 0
    check([close("tops", times["top"], [k * (2 * fall + touch) for k in range(11)], tolerance, 1)])


@pytest.mark.parametrize("k, h, tolerance", [(107505, 0.575, 1e-6), (759220, 0.532, 1e-7), (213970.4290570586, 1.047816429399195, 1e-10)])
def test_kinks_after_refused_steps(k, h, tolerance):
    """auto detects kinks, however far its refused steps reached: the energy of a ball on a stiff spring is constant."""
    run, _, _ = motion(MODELS / "stiff.lua", "--until", 8, "--every", 1, "--tol", tolerance, *settings(k=k, h=h))
    energy = [v**2 / 2 + G * z + k * min(z, 0)**2 / 2 for z, v in zip(run["ball_z"], run["ball_z_d"])]
    check([close("energy", [value / (G * h) for value in energy], [1] * len(energy), 1e3 * tolerance)])


JUMPS = """local rd = require "refdyn"
return rd.model { name = "jumps", links = { { "b", joint = "x", mass = 1, start = { x = 0.3 }, start_rate = { x = 0.7 } } },
  forces = function(s) return { b_x = rd.where(rd.less(0, s.q.b_x), -3.9, 2.1) } end }
"""


@pytest.mark.parametrize("method", ["auto", "rk54", "radau9", "gauss12", "rodas5p"])
def test_jump_of_a_force(tmp_path, method):
    """Parabolas that meet where the force jumps, each on the side to which its crossing leads."""
    (tmp_path / "jumps.lua").write_text(JUMPS)
    t, x, v, side = 0, 0.3, 0.7, 1
    while True:
        a = -3.9 if side > 0 else 2.1
        ahead = (-v - side * math.sqrt(v * v - 2 * a * x)) / a
        if t + ahead > 5:
            break
        t, x, v, side = t + ahead, 0, v + a * ahead, -side
    expected, lines = x + v * (5 - t) + a / 2 * (5 - t) ** 2, []
    for tol in 1e-4, 1e-6, 1e-8:
        run, _, _ = motion(tmp_path / "jumps.lua", "--until", 5, "--every", 5, "--method", method, "--tol", tol)
        lines.append(close(f"tol {tol}", run["b_x"][-1:], [expected], 10 * tol, 1))
    check(lines)


@pytest.mark.quick
def test_directions():
    """A ball thrown up crosses a level twice."""
    v, h = 5, 1
    up, down = 0.0, (v + math.sqrt(v * v + 2 * G * h)) / G
    level = ("--until", 2)
    rise = (v - math.sqrt(v * v - 2 * G * 0.5)) / G, (v + math.sqrt(v * v - 2 * G * 0.5)) / G
    thrown = settings(h=-0.5, v=v)
    for act, expected in (("up", [rise[0]]), ("record", [rise[1]]), ("both", list(rise))):
        times, _ = events("ball", *level, *settings(act=act), *thrown)
        check([close(act, next(iter(times.values())), expected, 1e-11)])
    times, _ = events("ball", *level, *settings(act="both", h=h, v=v))
    check([close("fall", times["level 1"], [down], 1e-11)])
    assert up == 0.0


@pytest.mark.parametrize("part", [1e-3, 1e-6, 1e-9])
def test_grazing(part):
    """A level just below the top is crossed twice in one step; a level just above is not crossed."""
    v, top = 2, 2 / G
    level = v * top / 2
    times, _ = events("ball", "--until", 1, "--method", "rk8", *settings(act="both", v=v, h=-level * (1 - part)))
    half = math.sqrt(2 * level * part / G)
    check([close("passages", times["level 1"], [top - half, top + half], 1e-8)])
    times, _ = events("ball", "--until", 1, "--method", "rk8", *settings(act="both", v=v, h=-level * (1 + part)))
    assert not times


@pytest.mark.quick
def test_start():
    """A value that starts at zero is an event if it leaves zero in the event's direction."""
    for v, act, count in ((-1, "record", 1), (1, "record", 1), (1, "up", 1), (-1, "up", 0), (1, "both", 2), (-1, "both", 1)):
        times, _ = events("ball", "--until", 1, *settings(h=0, v=v, act=act))
        found = [t for list in times.values() for t in list]
        assert len(found) == count, (v, act)
        assert (bool(found) and found[0] == 0) == ((v < 0 and act != "up") or (v > 0 and act in ("up", "both"))), (v, act)
    times, _ = events("ball", "--until", 0.5, *settings(h=0, v=-3))
    check([close("impacts", times["impact 1"], [0, 2 * 0.8 * 3 / G], 1e-11)])
    assert "refdyn: ball: t = 0 s: events follow each other without time between" in failed("ball", "--until", 1, *settings(h=0))


@pytest.mark.parametrize("apart", [0, 1e-14, 1e-10, 1e-3])
def test_at_the_same_time(apart):
    """Three balls, equal or nearly equal: all impacts of each."""
    times, _ = events("ball", "--until", 2.4, *settings(balls=3, apart=apart))
    check([close(f"ball {i}", times[f"impact {i}"], bounces(0.8, 1 + (i - 1) * apart, 4), 1e-11) for i in (1, 2, 3)])


@pytest.mark.quick
def test_end():
    with tempfile.TemporaryDirectory() as folder:
        path, summary = f"{folder}/run.csv", f"{folder}/summary.json"
        told = refdyn("sim", MODELS / "ball.lua", "--until", 2, "--every", 0.1, *settings(act="ends"), "-o", path, "--summary", summary).stderr
        run = read_run(path)
        ended = json.load(open(summary))["ended"]
    t = math.sqrt(2 / G)
    assert "ended        by level 1 at t = 0.45152364" in told and ended["event"] == "level 1"
    assert list(run["t"][:-1]) == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    check([close("end", [run["t"][-1], ended["t"]], [t, t], 1e-12), close("z", run["ball1_z"][-1:], [0], 1e-12, 1)])
    at_once, _, summary = motion(MODELS / "ball.lua", "--until", 2, *settings(act="ends", h=0, v=-1))
    assert list(at_once["t"]) == [0] and summary["ended"]["t"] == 0


FALLING = """local rd = require "refdyn"
local u = rd.input("u", 0)
return rd.model {{ name = "falling", gravity = {{ 0, 0, -10 }}, links = {{ {{ "b", joint = "z", mass = 1, start = {{ z = {z} }}, start_rate = {{ z = {v} }} }} }},
  events = function(s) local z, v, t = s.q.b_z, s.qd.b_z, s.t; return {{ {events} }} end }}
"""
LEVEL = math.sqrt(0.9 / 10)  # from 1 to 0.55, at rate -3


def falling(tmp_path, lines, *arguments, z=1, v=0):
    """[name, t] of the events of a mass that falls."""
    (tmp_path / "falling.lua").write_text(FALLING.format(z=z, v=v, events=lines))
    _, _, summary = motion(tmp_path / "falling.lua", "--until", 0.95, *arguments)
    return [(mark["event"], mark["t"]) for mark in summary["events"]]


def same_events(found, expected, allowed=1e-9):
    assert [name for name, _ in found] == [name for name, _ in expected], found
    check([close("t", [t for _, t in found], [t for _, t in expected], allowed)])


@pytest.mark.parametrize("action", ["restitution = 0.7", "rates = { b_z = -0.7 * v }"])
@pytest.mark.parametrize("direction", ["both", "up"])
def test_carried_across_once(tmp_path, action, direction):
    """A rate that an impact or an action carries across zero: one event each time, and one on its way back."""
    lines = f'rd.event {{ z - 0.55, direction = "down", {action}, name = "level" }}, rd.event {{ v + 0.1, direction = "{direction}", name = "rate" }}'
    back = [("rate", LEVEL + 0.22)] if direction == "both" else []
    expected = ([("rate", 0.01)] if direction == "both" else []) + [("level", LEVEL), ("rate", LEVEL)] + back
    again = LEVEL + 0.42
    same_events(falling(tmp_path, lines), expected + [("level", again), ("rate", again)] + ([("rate", again + 0.157)] if direction == "both" else []))


def test_jumps_once(tmp_path):
    """Inputs that an event or samples switch, and step functions of time and position."""
    lines = 'rd.event { z - 0.55, inputs = { u = 1 }, name = "level" }, rd.event { u - 0.5, name = "carried" }'
    same_events(falling(tmp_path, lines), [("level", LEVEL), ("carried", LEVEL)])
    (tmp_path / "u.csv").write_text("t,u\n0,0\n0.31,1\n0.62,0\n")
    lines = 'rd.event { u - 0.5, name = "sample", rates = { b_z = 5 } }'
    same_events(falling(tmp_path, lines, "--inputs", tmp_path / "u.csv"), [("sample", 0.31), ("sample", 0.62)])
    for condition, t in ("rd.less(t, 0.73)", 0.73), ("rd.less(0.55, z)", LEVEL):
        for act in "", ", rates = { b_z = -2 }":
            same_events(falling(tmp_path, f'rd.event {{ rd.where({condition}, -1, 1), name = "jump"{act} }}'), [("jump", t)])


@pytest.mark.parametrize("value, t", [("rd.max(0, 0.55 - z)", LEVEL), ("rd.less(z, 0.55)", LEVEL), ("rd.ramp(t, 0.43, 0.6)", 0.43),
                                      ("rd.where(rd.less(t, 0.73), 0, 1)", 0.73), ("rd.max(0, 0.55 - z) + rd.min(0, 0.8 - z)", LEVEL)])
@pytest.mark.parametrize("method", ["auto", "rk54", "radau9"])
def test_leaves_a_stretch_of_zero(tmp_path, value, t, method):
    """A ramp begins so flat that rounding hides its first 1e-9 s."""
    found = falling(tmp_path, f'rd.event {{ {value}, name = "leaves" }}', "--method", method)
    same_events(found, [("leaves", t)], 1e-8 if "ramp" in value else 1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_grazes_exactly(tmp_path, method):
    """No event, or two events within the accuracy of the steps."""
    found = falling(tmp_path, 'rd.event { z - 0.8, name = "g" }', "--method", method, z=0, v=4)
    assert len(found) in (0, 2, 4, 6) and all(abs(t - 0.4) < 1e-6 for _, t in found), found


@pytest.mark.parametrize("method", METHODS)
def test_at_outputs(tmp_path, method):
    """Impacts at 1 s and 2 s, on whichever side rounding puts them: output rows show the state before, and the event at the end occurs,
    too."""
    (tmp_path / "falling.lua").write_text(FALLING.format(z=5, v=0, events='rd.event { z, restitution = 0.5, name = "floor" }'))
    fixed = ["--step", 0.01] if method == "rk4" else ["--tol", 1e-7]
    for until, rates in (1, [-10]), (2, [-10, -5]):
        run, _, summary = motion(tmp_path / "falling.lua", "--until", until, "--every", 0.1, "--method", method, *fixed)
        check([close("rates", run["b_z_d"][10::10], rates, 1e-9), close("t", [mark["t"] for mark in summary["events"]], [1, 2][:until], 1e-13)])


def test_start_beyond_a_stop(tmp_path):
    lines = 'rd.event { z, restitution = 0.5, name = "floor" }, rd.event { z - 3, name = "other" }'
    told = "refdyn: warning: the start is beyond the event floor, whose value is -0.25; an impact occurs only when the value reaches zero from the other side\n"
    for z, is_told in (-0.25, True), (0, False), (0.25, False):
        (tmp_path / "falling.lua").write_text(FALLING.format(z=z, v=-1, events=lines))
        _, said, _ = motion(tmp_path / "falling.lua", "--until", 0.1)
        assert (told in said) == is_told and ("is beyond" in said) == is_told, said


LOSING = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "s", 5, "N/m" } }
return rd.model { name = "losing", gravity = { 0, 0, -10 }, links = { { "b", joint = "z", mass = 2 * p.m, start = { z = 1 }, spring = { z = p.s } } },
  events = function(s) return { rd.event { s.q.b_z - 0.8, parameters = { s = 3 }, name = "softer" },
    rd.event { s.q.b_z - 0.3, parameters = { m = LEFT }, name = "loses" } } end }
"""


def test_values_that_the_model_refuses(tmp_path):
    """The check precedes the setting, and the message names the event and the faulty line; a second run begins with the values of the
    first."""
    model = tmp_path / "losing.lua"
    model.write_text(LOSING.replace("LEFT", "s.q.b_z - 0.55"))
    done = refdyn("sim", model, "--until", 2, "-o", tmp_path / "run.csv", status=3)
    assert re.search(r"refdyn: losing: t = 0\.\d+ s: the event loses: .*losing\.lua:3: links\[1\]\.mass: value -0\.5; must be positive\n",
                     done.stderr), done.stderr
    model.write_text(LOSING.replace("LEFT", "p.m - 0.7"))
    _, _, summary = motion(model, "--until", 0.5, "--verify")
    assert [mark["event"] for mark in summary["events"]] == ["softer", "loses"] and summary["error"]["is_trusted"]


def test_stops_beside_events():
    """A stop condition of the command line that occurs first."""
    _, told, summary = motion(MODELS / "ball.lua", "--until", 2, "--stop", "ball1_z<0.5", *settings(act="ends"))
    check([close("stop", [summary["stop"]["t"]], [math.sqrt(1 / G)], 1e-12)])
    assert summary["events"] == [] and "ended" not in summary and "stopped" in told
    _, _, summary = motion(MODELS / "ball.lua", "--until", 2, "--stop", "t>1.9")
    check([close("impacts", [mark["t"] for mark in summary["events"]], bounces(0.8, 1, 3), 1e-11)])


def test_inputs_belong_to_one(tmp_path):
    samples = tmp_path / "samples.csv"
    samples.write_text("t,push\n0,1\n")
    done = refdyn("sim", MODELS / "relay.lua", "--until", 1, "--inputs", samples, "-o", tmp_path / "run.csv", status=1)
    assert done.stderr == f"{samples}:1: inputs: column push: events of the model set this input; samples must not\n"


def test_batch(tmp_path):
    """Cases that an event ends are done, with its time and state; others fail with its name."""
    (tmp_path / "cases.csv").write_text("h\n1\n2\n30\n")
    command = ("batch", MODELS / "ball.lua", "--table", tmp_path / "cases.csv")
    refdyn(*command, "--until", 1, *settings(act="ends"), "-o", tmp_path / "ended.csv")
    with open(tmp_path / "ended.csv") as file:
        rows = list(csv.DictReader(file))
    ended = {name: [float(row[name]) for row in rows] for name in ("t", "status", "ball1_z_d")}
    assert [row["reason"].partition(" at ")[0] for row in rows] == ["ended by level 1"] * 2 + [""]
    falls = [math.sqrt(2 * h / G) for h in (1, 2)]
    assert list(ended["status"]) == [0, 0, 0]
    check([close("t", ended["t"], falls + [1], 1e-12), close("rates", ended["ball1_z_d"], [-G * t for t in falls + [1]], 1e-12)])
    refdyn(*command, "--until", 9, *settings(e=0.5), "-o", tmp_path / "rest.csv")
    rest = [line.split(",") for line in (tmp_path / "rest.csv").read_text().splitlines()[1:]]
    assert [line[2] for line in rest] == ["3"] * 3
    check([close("t", [float(line[3]) for line in rest], [math.sqrt(2 * h / G) * 3 for h in (1, 2, 30)], 1e-9)])
    refdyn(*command, "--until", 1, *settings(e=0.5), "--lanes", 2, "-o", tmp_path / "lanes.csv")
    refdyn(*command, "--until", 1, *settings(e=0.5), "--lanes", 1, "-o", tmp_path / "alone.csv")
    assert (tmp_path / "lanes.csv").read_text() == (tmp_path / "alone.csv").read_text()


def test_refused(tmp_path):
    run = tmp_path / "run.csv"
    done = refdyn("sim", MODELS / "ball.lua", "--until", 1, "--method", "msbdf", "-o", run, status=None)
    assert done.returncode in (1, 2) and "msbdf" in done.stderr
    done = refdyn("sim", MODELS / "spring.lua", "--until", 1, "--fold", "-o", run, status=1)
    assert done.stderr.endswith("events[1].parameters.s: --fold makes it a number, which no event can change; omit --fold\n")


@pytest.mark.parametrize("floor", [-1e3, 0, 0.3, 1e6])
@pytest.mark.parametrize("name", ["floor", "floor_inches"])
def test_impacts_accumulate_wherever_the_floor_is(name, floor):
    """The rounding of a height would keep a ball bouncing; impacts below this size accumulate. In inches, above a tilted base."""
    told = failed(name, "--until", 60, *settings(floor=floor))
    assert ": events follow each other without time between" in told and "at the event floor" in told
    height = 1 if name == "floor" else math.cos(0.3) * math.cos(0.2)
    rest = math.sqrt(2 * height / G) * (1 + 0.6) / (1 - 0.6) if name == "floor" else None
    if rest:
        check([close("rest", [float(told.split("t = ")[1].split()[0])], [rest], 1e-4)])


@pytest.mark.parametrize("method", ["auto", "rk54", "radau9"])
@pytest.mark.parametrize("e", [0, 0.5])
def test_a_driven_crane_stays_at_its_buffer(method, e):
    told = failed("crane", "--until", 30, "--method", method, *settings(e=e))
    assert ": events follow each other without time between" in told and "at the event buffer" in told


@pytest.mark.parametrize("e", [0, 0.5, 0.9])
def test_a_rod_that_falls_flat_does_not_fall_through(e):
    """Both ends meet the floor simultaneously, and the impact of each end pushes the other one down again."""
    told = failed("rod", "--until", 30, *settings(e=e))
    assert ": events follow each other without time between" in told
    state = dict(re.findall(r"(rod_\w+) = ([-+.\de]+)", told))
    ends = [float(state["rod_z"]) + side * 0.5 * math.sin(float(state["rod_theta"])) for side in (-1, 1)]
    assert min(ends) > -1e-9
