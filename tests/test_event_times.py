"""Times of events: values that are zero at the start, that jump or have poles in time and in angles, and clocks, against closed forms."""
import itertools
import json
import math
import random

import pytest

from program import LONG, TESTS, motion, settings

METHODS = ["auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
# A mass at 1.3 m/s and a turn at `rate`; the event counts itself.
MODEL = """local rd = require "refdyn"
local n, u = rd.input("n", 0), rd.input("u", 0)
local p = rd.parameters {{ {{ "c", {start}, "s" }}, {{ "next", {start}, "s" }}, {{ "rate", 3, "rad/s" }} }}
return rd.model {{ name = "times", links = {{ {{ "m", joint = "x", mass = 2, start_rate = {{ x = 1.3 }} }},
    {{ "r", joint = "psi", mass = 1, inertia = {{ zz = 0.7 }}, start_rate = {{ psi = p.rate }} }} }},
  forces = function(s) return {{ m_x = u }} end,
  events = function(s)
    local t, a, x = s.t, s.q.r_psi, s.q.m_x
    return {{ {event} }}
  end }}
"""


def write(path, value, direction="both", more="", start=0.0):
    path.write_text(MODEL.format(start=repr(start), event=value if "rd.event" in value or "rd.sampled" in value else
                                 f'rd.event {{ {value}, direction = "{direction}", inputs = {{ n = n + 1 }}{more} }}'))
    return path


def times(model, until, *arguments):
    _, _, summary = motion(model, "--until", until, *arguments)
    assert summary["event_count"] == len(summary["events"])
    return [mark["t"] for mark in summary["events"]]


def same(found, expected, allowed=1e-9):
    assert len(found) == len(expected), (found, expected)
    assert all(abs(a - b) <= allowed for a, b in zip(found, expected)), (found, expected)


def from_state(tmp_path, start):
    (tmp_path / "state.json").write_text(json.dumps({"t": start}))
    return ["--from", tmp_path / "state.json"]


@pytest.mark.parametrize("method", METHODS)
def test_clock_that_starts_at_its_first_tick(method, tmp_path):
    model = write(tmp_path / "clock.lua", "t - p.next", "up", ", parameters = { next = p.next + 0.1 }")
    same(times(model, 1, "--method", method), [k / 10 for k in range(11)], 1e-12)


@pytest.mark.quick
@pytest.mark.parametrize("start", [0.0, 0.3, -0.7, 731.1])
def test_zero_at_the_start(start, tmp_path):
    """The first of these values are events at the start, whichever way they leave zero; the others are not."""
    forms = [("2 * (t - p.c)", "up"), ("t - p.c", "both"), ("p.c - t", "down"), ("rd.max(0, t - p.c)", "up"), ("rd.min(p.c, 2 * p.c - t) - p.c", "down"),
             ("rd.less(p.c, t)", "up"), ("(t - p.c)^2", "up"), ("rd.sin(t - p.c)", "up"), ("rd.tan(t - p.c)", "up"), ("x - 0.2 * (t - p.c)", "up"),
             ("rd.abs(x)", "up"), ("rd.abs(t - p.c) * rd.exp(t - p.c)", "both"), ("rd.where(rd.less(p.c, t), x + 1, 0)", "up")]
    never = [("2 * (t - p.c)", "down"), ("rd.max(0, t - p.c)", "down"), ("rd.abs(t - p.c)", "down"), ("x", "down"), ("rd.less(p.c - 1, t)", "both")]
    for form, direction in forms:
        same(times(write(tmp_path / "zero.lua", form, direction, start=start), start + 1, *from_state(tmp_path, start)), [start], 0)
    for form, direction in never:
        same(times(write(tmp_path / "zero.lua", form, direction, start=start), start + 1, *from_state(tmp_path, start)), [])


def jumps(form, direction, rate, until):
    """The times before `until` at which a form of a = rate t changes its sign in this direction; the first change is downwards."""
    w = 2 * math.pi
    places = {"square": [(k * math.pi - 0.3) / w for k in range(1, 80)], "tan": [(k * math.pi / 2 - 0.4) / w for k in range(1, 80)],
              "pole": [1.25 * (k + 0.5) for k in range(20)], "pulse": sorted((side * math.acos(0.99) + w * k) / w for k in range(20) for side in (-1, 1)),
              "saw": [(math.pi / 2 * k - 0.2) / w for k in range(1, 80)]}[form]
    places = [place / rate * w for place in places if 0 < place / rate * w < until]
    return [place for place, side in zip(places, itertools.cycle(("down", "up"))) if direction in ("both", side)]


FORMS = {"square": "rd.where(rd.less(rd.sin({a} + 0.3), 0), -1, 1)", "tan": "rd.tan({a} + 0.4)", "pole": "1 / rd.cos({a} / 2.5)",
         "pulse": "rd.where(rd.less(rd.cos({a}), 0.99), -1, 1)", "saw": "rd.atan2(rd.sin(2 * {a} + 0.4), rd.cos(2 * {a} + 0.4))"}


@pytest.mark.parametrize("method", METHODS if LONG else ["auto", "rk4", "rk54", "radau9", "rodas5p"])
@pytest.mark.parametrize("form", FORMS)
def test_jumps_and_poles_in_time(form, method, tmp_path):
    """Also with an input that each event changes, and parameters in the formula."""
    for direction, rate in (("both", 6.1), ("up", 17.3), ("down", 2.9)):
        model = write(tmp_path / "jump.lua", FORMS[form].format(a="(p.rate * t)"), direction)
        same(times(model, 4, "--method", method, *settings({"rate": rate})), jumps(form, direction, rate, 4))


@pytest.mark.parametrize("method", METHODS if LONG else ["auto", "rk4", "rk54", "radau9", "rodas5p"])
@pytest.mark.parametrize("form", FORMS)
def test_jumps_and_poles_in_an_angle(form, method, tmp_path):
    """The same of an angle, at a rate of many turns a step."""
    for direction, rate, until in (("both", 6.1, 4), ("up", 173.0, 0.4), ("down", 29.0, 1.5)):
        model = write(tmp_path / "jump.lua", FORMS[form].format(a="a"), direction)
        same(times(model, until, "--method", method, *settings({"rate": rate})), jumps(form, direction, rate, until), 1e-8)


@pytest.mark.quick
def test_narrow_passages_of_a_fast_rotor(tmp_path):
    """A tooth of 0.06 rad and a point, a thousand radians a second."""
    tooth, period = math.acos(0.9995) / 1000, 2 * math.pi / 1000
    expected = sorted(k * period + side * tooth for k in range(60) for side in (-1, 1) if 0 < k * period + side * tooth < 0.3)
    for value in ("rd.where(rd.less(rd.cos(a), 0.9995), -1, 1)", "rd.cos(a) - 0.9995"):
        for method in "auto", "rk54", "radau9":
            same(times(write(tmp_path / "tooth.lua", value), 0.3, "--method", method, *settings({"rate": 1000})), expected, 1e-8)


@pytest.mark.parametrize("kind", ["sampled", "clock"])
def test_many_samples_lose_no_time(kind, tmp_path):
    """A thousand samples a second, from any start: a constant rate stays the distance over the time."""
    event = ('rd.sampled { every = 0.001, inputs = { n = n + 1 } }' if kind == "sampled" else
             'rd.event { t - p.next, direction = "up", inputs = { n = n + 1 }, parameters = { next = p.next + 0.001 } }')
    for start in 0.0, 0.3:
        model = write(tmp_path / "many.lua", event, start=start)
        run, _, _ = motion(model, "--until", start + 5, "--every", 1, *from_state(tmp_path, start))
        assert abs(run["m_x"][-1] - 1.3 * 5) < 1e-13 * 65 and run["n"][-1] in (5000, 5001)


@pytest.mark.parametrize("seed", range(6))
def test_samples_from_any_start(seed, tmp_path):
    """The rate of a mass that a sampled force drives, from starts on and between the multiples."""
    choice = random.Random(seed)
    every = choice.choice([0.1, 0.03, 1 / 3])
    start = choice.choice([choice.uniform(-1, 5), every * choice.randint(-20, 2000)])
    span, method = every * choice.uniform(0.3, 30), choice.choice(METHODS)
    model = write(tmp_path / "any.lua", f"rd.sampled {{ every = {every!r}, inputs = {{ u = 1 + t }} }}")
    run, _, _ = motion(model, "--until", start + span, "--every", 2 * span, "--method", method, *from_state(tmp_path, start))
    rate, u, before = 1.3, 0.0, start
    for k in itertools.count(math.ceil((start - 1e-12) / every)):
        at = min(max(k * every, start), start + span)
        rate, u, before = rate + u / 2 * (at - before), 1 + at, at
        if at == start + span:
            break
    assert abs(run["m_x_d"][-1] - rate) < 1e-11 * (1 + abs(start))


# ---- The second opinion of --verify ----

# Values that are above zero in a short time about `at` alone, for a mass at 1.3 m/s and a turn at 3 rad/s.
NARROW = {"bell": "rd.exp(-((x / 1.3 - {at}) / {width})^2) - 0.5", "turn": "rd.exp(-((a / 3 - {at}) / {width})^2) - 0.5",
          "time": "rd.exp(-((t - {at}) / {width})^2) - 0.5"}


@pytest.mark.parametrize("method", ["auto", "rk54", "rodas5p"])
@pytest.mark.parametrize("form", NARROW)
def test_verify_tells_of_missed_events(form, method, tmp_path):
    """What the motion misses and the finer one finds is named; what the motion finds stays trusted."""
    missed = 0
    for at, width in (5.37, 0.05), (7.21, 0.04), (8.93, 0.03), (6.41, 0.06), (6.77, 0.001), (5.9, 1.5):
        model = write(tmp_path / "narrow.lua", NARROW[form].format(at=at, width=width))
        _, said, summary = motion(model, "--until", 10, "--method", method, "--verify")
        is_missed = summary["event_count"] == 0
        missed += is_missed
        assert summary["error"]["is_trusted"] is not is_missed and ("events_differ" in summary) is is_missed, (at, width, said)
        if is_missed:
            first = summary["events_differ"]
            assert abs(first["t"] - at) < 2 * width and first["event"] in said and "which this motion misses" in said
    assert missed


AGREE = {"ball": ["events/ball", "--until", 4], "relay": ["events/relay", "--until", 3], "block": ["events/block", "--until", 2],
         "rod": ["events/rod", "--until", 0.5, *settings({"tilt": 0.2})], "far": ["events/ball", "--until", 3, *settings({"act": "ends"})],
         "contact": ["contacts/ball", "--until", 3], "stack": ["contacts/stack", "--until", 2], "bar": ["contacts/bar", "--until", 2],
         "shaker": ["contacts/shaker", "--until", 1]}


@pytest.mark.parametrize("case", AGREE)
def test_verify_trusts_events_that_agree(case):
    for tol in ("1e-6",) if not LONG else ("1e-4", "1e-6", "1e-8"):
        model, *arguments = AGREE[case]
        _, said, summary = motion(TESTS / "models" / f"{model}.lua", *arguments, "--tol", tol, "--verify")
        assert summary["event_count"] > 0 and summary["error"]["is_trusted"] and "events_differ" not in summary, said


def test_verify_trusts_a_clock(tmp_path):
    model = write(tmp_path / "clock.lua", "t - p.next", "up", ", parameters = { next = p.next + 0.001 }")
    _, said, summary = motion(model, "--until", 1.0005, "--verify")
    assert summary["event_count"] == 1001 and summary["error"]["is_trusted"], said
