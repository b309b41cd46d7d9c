"""One-sided contacts: balls on floors at any place, slides, pendulums, rods, tables, stacks and beams compared with closed forms and
independent solutions; which contacts rest, which release, and what is refused."""
import csv
import json
import math
import random
import tempfile

import numpy
import pytest

from program import TESTS, check, close, motion, refdyn

MODELS = TESTS / "models" / "contacts"
METHODS = ["auto", "rk54", "rodas5p", "radau9", "gauss12"]
G = 9.81


def settings(**values):
    return [word for name, value in values.items() for word in ("--set", f"{name}={value}")]


def run(name, *arguments):
    """Columns of a motion, its events by contact and kind, and the summary."""
    columns, _, summary = motion(MODELS / f"{name}.lua", *arguments)
    marks = {}
    for mark in summary["events"]:
        marks.setdefault((mark["event"], mark["contact"]), []).append(mark["t"])
    return columns, marks, summary


def height(e, t):
    """Height of a ball that falls from 1 m at rest, at times t, and the time when its last rebound ends."""
    begin, speed = math.sqrt(2 / G), e * math.sqrt(2 * G)
    rest = begin + 2 * speed / G / (1 - e)
    found = numpy.where(t < begin, 1 - G * t**2 / 2, 0.0)
    while speed > 1e-9 and begin < t[-1]:
        end = begin + 2 * speed / G
        inside = (t >= begin) & (t < end)
        found[inside] = (speed - G / 2 * (t[inside] - begin)) * (t[inside] - begin)
        begin, speed = end, e * speed
    return found, rest


@pytest.mark.parametrize("floor", [-1e3, 0, 0.3, 1e6])
@pytest.mark.parametrize("e", [0, 0.3, 0.6, 0.9])
def test_ball(floor, e):
    found, marks, summary = run("ball", "--until", 10, "--every", 0.01, *settings(floor=floor, e=e))
    tolerance = max(1e-6, 64 * 2.2e-16 * 2 * abs(floor + 1))
    expected, rest = height(e, found["t"])
    bound = math.sqrt(8 * tolerance / G) / (1 - e)
    check([close("height", found["ball_z"] - floor, expected, 10 * tolerance),
           close("rest", marks["floor", "rests"], [rest], 0.01 * bound),
           close("force", [found["contact_floor"][-1]], [G], 1e-9),
           close("rest column", [found["rest_floor"][-1]], marks["floor", "rests"], 0)])
    switched = max(marks["floor", "impact"])
    assert rest - bound <= switched <= rest + 1e-9 and summary["energy_error"] < 1e-8
    assert min(found["ball_z"] - floor) >= -10 * tolerance


@pytest.mark.parametrize("method", METHODS)
def test_driven_slide_holds_and_lets_go(method):
    """The force -5 cos t on a cart of 2 kg holds it at the buffer until t = pi / 2."""
    found, marks, _ = run("slide", "--until", 4, "--every", 0.01, "--method", method)
    t, held = found["t"], (found["t"] > 1.1) & (found["t"] < 1.57)
    free = t > 1.58
    check([close("leaves", marks["buffer", "leaves"], [math.pi / 2], 5e-15 if method != "rodas5p" else 1e-14),
           close("force", found["contact_buffer"][held], 5 * numpy.cos(t[held]), 1e-9),
           close("position", found["cart_x"][held], 0 * t[held], 1e-12),
           close("after", found["cart_x"][free], 2.5 * (numpy.cos(t[free]) + t[free] - math.pi / 2), 1e-5)])


def pendulum_at_wall(t_end, e=0.4):
    """The same pendulum with independent steps: angle and rate at the end, times of rest and of release."""
    inertia, h = 1 * (0.05**2 + 1) / 12 + 0.25, 1e-4
    stop = math.asin(0.1)

    def pull(t, a):
        return (6 * math.sin(1.3 * t) - G * 0.5 * math.sin(a)) / inertia

    def step(t, a, w, h):
        k = [(w, pull(t, a))]
        for part in (h / 2, h / 2, h):
            k.append((w + part * k[-1][1], pull(t + part, a + part * k[-1][0])))
        return tuple(x + h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]) for i, x in enumerate((a, w)))
    t, a, w, resting, marks = 0.0, -0.8, 0.0, False, []
    while t < t_end - 1e-12:
        h_now = min(h, t_end - t)
        if resting:
            if pull(t + h_now, stop) < 0:
                low, high = t, t + h_now
                for _ in range(60):
                    middle = (low + high) / 2
                    low, high = (middle, high) if pull(middle, stop) > 0 else (low, middle)
                marks.append(("leaves", high))
                t, resting = high, False
            else:
                t += h_now
            continue
        new = step(t, a, w, h_now)
        if new[0] > stop and new[1] > 0:
            low, high = 0, h_now
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if step(t, a, w, middle)[0] < stop else (low, middle)
            a, w = step(t, a, w, high)
            t, a, w = t + high, stop, -e * w
            acceleration = pull(t, stop)
            if acceleration > 0 and w**2 / (2 * acceleration) < 1e-10:
                marks.append(("rests", t + 2 * abs(w) / (acceleration * (1 - e))))
                t, w, resting = t + 2 * abs(w) / (acceleration * (1 - e)), 0.0, True
        else:
            t, (a, w) = t + h_now, new
    return a, w, marks


def test_pendulum_at_a_wall():
    """The wall is at x = -0.1, and the tip at x = -sin theta."""
    found, marks, _ = run("wall", "--until", 3, "--every", 0.01, "--tol", 1e-9)
    a, w, expected = pendulum_at_wall(3)
    own = sorted([("rests", t) for t in marks.get(("wall", "rests"), [])] + [("leaves", t) for t in marks.get(("wall", "leaves"), [])],
                 key=lambda mark: mark[1])
    assert [kind for kind, _ in own] == [kind for kind, _ in expected] and len(own) >= 2
    check([close("times", [t for _, t in own], [t for _, t in expected], 2e-6),
           close("angle", [found["pend_theta"][-1]], [a], 1e-5), close("rate", [found["pend_theta_d"][-1]], [w], 1e-5)])
    assert min(found["tip_x"]) >= -0.1 - 1e-8


def no_gap_below(found, gaps, tolerance=1e-6):
    for name, offset in gaps.items():
        assert min(found[name] - offset) >= -10 * tolerance, name


@pytest.mark.parametrize("tilt, e", [(0, 0.5), (0, 0), (0.1, 0.5), (0.3, 0.9)])
def test_rod(tilt, e):
    found, marks, summary = run("rod", "--until", 8, "--every", 0.01, *settings(tilt=tilt, e=e))
    no_gap_below(found, {"L_z": 0, "R_z": 0})
    assert summary["energy_error"] < 1e-6 and max(numpy.diff(found["energy"])) < 1e-8
    check([close("forces", [found["contact_left"][-1], found["contact_right"][-1]], [G / 2, G / 2], 1e-6)])
    if tilt == 0:
        check([close("flat", found["rod_theta"], 0 * found["rod_theta"], 1e-12)])


def test_table_on_four_legs():
    """Its forces are not unique: the smallest ones are those of an elastic floor."""
    found, _, summary = run("table", "--until", 2, "--every", 0.01)
    total = 12 * G
    check([close("even", [found[f"contact_leg_{leg}"][-1] for leg in "abcd"], [total / 4] * 4, 1e-6)])
    found, _, _ = run("table", "--until", 2, *settings(off=0.1, tilt=0.1))
    no_gap_below(found, {f"{leg}_z": 0 for leg in "abcd"})
    forces = numpy.array([found[f"contact_leg_{leg}"][-1] for leg in "abcd"])
    at = numpy.array([[0.4, 0.4], [-0.4, 0.4], [-0.4, -0.4], [0.4, -0.4]])
    check([close("weight", [forces.sum()], [total], 1e-6), close("moments", forces @ at, numpy.array([0.1, 0.05]) * 2 * G, 1e-6),
           close("least", [forces[0] - forces[1] + forces[2] - forces[3]], [0], 1e-6)])
    assert summary["energy_error"] < 1e-6


@pytest.mark.parametrize("name, arguments, bodies", [("stack", ["--until", 3], ["lower_z", "upper_z"]),
                                                     ("beam", ["--until", 0.5], ["s1_z", "s2_z", "s3_z"]),
                                                     ("beam", ["--until", 0.5, "--method", "rk54"], ["s1_z", "s2_z", "s3_z"])])
def test_several_at_once(name, arguments, bodies):
    """Within a hundred tolerances of the same motion at a thousandth of the tolerance."""
    found, _, summary = run(name, "--every", 0.01, *arguments)
    finer, _, _ = run(name, "--every", 0.01, "--tol", 1e-9, *arguments)
    check([close(body, found[body], finer[body], 1e-4) for body in bodies])
    assert summary["energy_error"] < (1e-4 if "rk54" in arguments else 1e-6)


def test_gap_in_other_units():
    found, marks, _ = run("jaws", "--until", 10, "--every", 0.01)
    metres, other, _ = run("jaws", "--until", 10, "--every", 0.01, *settings(mm=1))
    check([close("angle", found["bar_psi"], metres["bar_psi"], 1e-4)])
    assert len(marks["lower", "rests"]) == len(other["lower", "rests"]) == 1


def test_programme_along_a_surface():
    found, marks, summary = run("programme", "--until", 4, "--every", 0.01)
    no_gap_below(found, {"tool_z": -0.3})
    assert ("surface", "rests") in marks and found["contact_surface"][-1] > 0 and summary["energy_error"] < 1e-5
    check([close("programme", found["phi_1"], 0 * found["t"], 1e-12)])


@pytest.mark.parametrize("name, arguments, status, said", [
    ("driven", ["--start", "project"], 3, "the programme drives the bodies of a closed contact into each other, contact buffer"),
    ("wall", ["--from", "STATE"], 3, "gap: wall = -0.61735609089952"),
    ("ball", ["--set", "e=1.5"], 1, "constraints[1].restitution: value 1.5; must be from 0 to 1"),
    ("ball", ["--set", "floor_rests=1"], 0, "warning: floor_rests is set, but the contact does not rest at the start")])
def test_refused(name, arguments, status, said, tmp_path):
    state = tmp_path / "state.json"
    state.write_text('{"q": [0.8], "qd": [0]}')
    arguments = [state if word == "STATE" else word for word in arguments]
    done = refdyn("sim", MODELS / f"{name}.lua", "--until", 4, *arguments, "-o", tmp_path / "run.csv", status=status)
    assert said in done.stderr


def test_batches_and_folded_models(tmp_path):
    table = tmp_path / "cases.csv"
    table.write_text("e,floor\n0.1,0\n0.5,0.3\n0.9,-1000\n")
    refdyn("batch", MODELS / "ball.lua", "--table", table, "--until", 10, "-o", tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv") as file:
        rows = list(csv.DictReader(file))
    rests = [height(float(row["e"]), numpy.array([0.0, 10.0]))[1] for row in rows]
    check([close("rest", [float(row["rest_floor"]) for row in rows], rests, 1e-6),
           close("force", [float(row["contact_floor"]) for row in rows], [G] * 3, 1e-9)])
    folded, _, _ = run("ball", "--until", 3, "--fold")
    plain, _, _ = run("ball", "--until", 3)
    check([close("folded", folded["ball_z"], plain["ball_z"], 1e-9)])


def test_summary_keeps_some_hundreds_of_events():
    with tempfile.TemporaryDirectory() as folder:
        summary = folder + "/summary.json"
        refdyn("sim", MODELS / "ball.lua", "--until", 900, *settings(e=0.99), "-o", folder + "/run.csv", "--summary", summary)
        told = json.loads(open(summary).read())
    assert told["event_count"] > 600 and len(told["events"]) == 500


@pytest.mark.parametrize("left, tip", [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_rows_act_where_contacts_rest(left, tip, tmp_path):
    """Accelerations of `eval` from the emitted function and the multipliers of its rows; a free contact has no force."""
    state = tmp_path / "state.json"
    state.write_text(json.dumps({"t": 0.37, "q": [0.113, -0.271, 0.219, 0.157], "qd": [0.41, -0.63, 0.72, 0.29],
                                 "parameters": {"left_rests": left, "tip_rests": tip}}))
    found = json.loads(refdyn("eval", MODELS / "bar.lua", "--state", state).stdout)
    M, u, v, qdd, force = (numpy.array(found[key]) for key in ("M", "u", "v", "qdd", "force"))
    acts = numpy.array([1, left, tip], dtype=bool)
    assert not u[~acts].any() and numpy.linalg.matrix_rank(u) == acts.sum()
    multipliers = numpy.linalg.lstsq(u[acts].T, force, rcond=None)[0]
    check([close("rows", u @ qdd, found["k"], 1e-11), close("force", M @ qdd - numpy.array(found["h"]) - numpy.array(found["Q"]), force, 1e-11),
           close("along the rows", u[acts].T @ multipliers, force, 1e-11)])


def test_a_bar_and_a_tool_that_swing_and_meet_the_floor():
    """Contacts, a programme and a projected start; methods of all kinds agree."""
    found, marks, summary = run("bar", "--start", "project", "--until", 3, "--every", 0.01, "--tol", 1e-8)
    other, _, _ = run("bar", "--start", "project", "--until", 3, "--every", 0.01, "--tol", 1e-8, "--method", "radau9")
    assert ("tip", "rests") in marks and ("tip", "leaves") in marks and summary["energy_error"] < 1e-6
    check([close(name, found[name], other[name], 1e-5) for name in ("bar_x", "bar_z", "bar_theta")])


@pytest.mark.parametrize("v", [0.4, -0.4])
@pytest.mark.parametrize("method", ["auto", "rk54", "radau9"])
def test_table_that_begins_to_move(method, v):
    """Upwards it is an impact, downwards the ball stays behind and falls; both end at rest on the table."""
    found, marks, summary = run("lift", "--until", 2, "--every", 0.01, "--method", method, *settings(v=v))
    e, late = 0.3, 0 if v > 0 else 2 * abs(v) / G
    first = 2 * e * v / G if v > 0 else late
    rest = 0.5 + late + 2 * e * abs(v) / G / (1 - e)
    check([close("leaves", marks["table", "leaves"], [0.5], 1e-12), close("impact", marks["table", "impact"][:1], [0.5 + first], 1e-9),
           close("rest", marks["table", "rests"][1:], [rest], 1e-9), close("at the end", found["ball_z"][-1:], [1.5 * v], 1e-9)])
    assert summary["energy_error"] < 1e-9


def test_shaken_table_loses_the_ball():
    """It leaves where the table falls as fast as the ball: A w^2 sin(w t) = g."""
    _, marks, summary = run("shaker", "--until", 1)
    check([close("leaves", marks["table", "leaves"][:1], [math.asin(G / (0.02 * 30**2)) / 30], 1e-13)])
    assert summary["energy_error"] < 1e-6


def test_stiff_arm_between_a_stop_and_the_floor():
    found, marks, summary = run("arm", "--until", 2, "--every", 0.01)
    no_gap_below(found, {"tip_z": -0.5})
    assert ("floor", "rests") in marks and max(found["arm_theta"]) < 0.5 + 1e-5 and summary["energy_error"] < 1e-5


@pytest.mark.parametrize("seed", range(12))
def test_piles_at_random(seed, tmp_path):
    """Balls above each other, with random masses, heights, rates and restitutions, come to rest."""
    draw = random.Random(seed)
    count = draw.randint(2, 5)
    heights = [0.3 * (i + 1) + draw.uniform(0, 0.1) for i in range(count)]
    links = ", ".join(f'{{ "b{i}", joint = "z", mass = {draw.uniform(0.2, 5)}, start = {{ z = {heights[i]} }}, start_rate = {{ z = {draw.uniform(-2, 2)} }} }}'
                      for i in range(count))
    gaps = ", ".join(f'rd.contact {{ s.q.b{i}_z - {f"s.q.b{i - 1}_z" if i else 0} - 0.2, restitution = {draw.uniform(0, 0.7)}, name = "c{i}" }}'
                     for i in range(count))
    (tmp_path / "pile.lua").write_text(f'local rd = require "refdyn"\nreturn rd.model {{ name = "pile", gravity = {{ 0, 0, -9.81 }}, '
                                       f'links = {{ {links} }}, constraints = function(s) return {{ {gaps} }} end }}\n')
    found, _, summary = motion(tmp_path / "pile.lua", "--until", 6, "--every", 0.01)
    places = numpy.array([found[f"b{i}_z"] for i in range(count)])
    check([close("at rest", places[:, -1], [0.2 * (i + 1) for i in range(count)], 1e-6)])
    assert min(numpy.diff(numpy.vstack([0 * places[0], places]), axis=0).flat) > 0.2 - 1e-5 and summary["energy_error"] < 1e-8
    assert max(numpy.diff(found["energy"])) < 1e-8
