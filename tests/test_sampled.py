"""Sampled controllers (rd.sampled) against loops of matrix exponentials: PI with notch filter and bounds, LQR with observer."""
import json
import math
import re
import shutil
import subprocess
import sys

import numpy
import pytest
import scipy.linalg

from program import SCALE, SOURCE, evaluate, motion, read_run, refdyn, settings

CONTROL = SOURCE / "docs" / "control"
METHODS = ["rk8", "rk54", "radau9", "rodas5p", "gauss12", "auto"]
J, LOAD, K, C = 0.02, 0.05, 60.0, 0.02


def plant(h):
    """Exact step of motor and load with a held torque: x = (angles, rates)."""
    A = numpy.zeros((5, 5))
    A[0, 2] = A[1, 3] = 1
    A[2, :4], A[3, :4], A[2, 4] = numpy.array([-K, K, -C, C]) / J, numpy.array([K, -K, C, -C]) / LOAD, 1 / J
    step = scipy.linalg.expm(A * h)
    return step[:4, :4], step[:4, 4]


def velocity_loop(end, wish=5.0, Kp=0.6, Ki=3.0, most=2.0, h=1e-3):
    """States at the samples and at half of the time between them, with torque and sum."""
    w = 2 * numpy.pi * 10.3 * h
    a = numpy.sin(w) / (2 * 0.7)
    b = numpy.array([1, -2 * numpy.cos(w), 1]) / (1 + a)
    a1, a2 = b[1], (1 - a) / (1 + a)
    (A, B), x, u, total, n1, n2, rows = plant(h / 2), numpy.zeros(4), 0.0, 0.0, 0.0, 0.0, []
    for k in range(round(end / h)):
        e = wish - x[2]
        wanted = Kp * e + Ki * total
        filtered = b[0] * wanted + n1
        n1, n2 = b[1] * wanted - a1 * filtered + n2, b[2] * wanted - a2 * filtered
        u, total = min(max(filtered, -most), most), total if abs(filtered) > most else total + h * e
        for half in range(2):
            x = A @ x + B * u
            rows.append([(k + (half + 1) / 2) * h, *x, u, total])
    return numpy.array(rows)


@pytest.mark.parametrize("method", METHODS)
def test_pi_with_notch_and_bounds(method):
    rows = velocity_loop(0.8)
    for every in (0.0005, 0.35):
        run, said, _ = motion(CONTROL / "velocity.lua", "--until", 0.8, "--every", every, "--method", method, "--tol", 1e-11)
        for t, *found in zip(*(run[name] for name in ("t", "motor_psi", "load_psi", "motor_psi_d", "load_psi_d", "torque", "sum"))):
            if t > 0 and abs(t / 0.0005 - round(t / 0.0005)) < 1e-6 and round(t / 0.0005) % 2:  # between samples
                assert numpy.max(numpy.abs(numpy.array(found) - rows[round(t / 0.0005) - 1, 1:])) < 1e-9, (t, found)
        last = rows[-1]
        assert max(abs(run["motor_psi"][-1] - last[1]), abs(run["load_psi_d"][-1] - last[4])) < 1e-9
    assert rows[:, 5].max() == 2 and abs(last[3] - 5) < 0.5 and re.search(r"^events +0$", said, re.M), said


def regulator(folder):
    for name in ("lqr.lua", "lqr.py"):
        shutil.copy(CONTROL / name, folder)
    refdyn("linearise", folder / "lqr.lua", "--at", "initial", "-o", folder / "linear.json")
    subprocess.run([sys.executable, folder / "lqr.py", folder / "linear.json", folder / "gains.lua"], check=True)
    return folder / "lqr.lua"


@pytest.mark.parametrize("method", METHODS)
def test_regulator_with_observer(method, tmp_path):
    model = regulator(tmp_path)
    gains = {name: numpy.array(json.loads(values.replace("{", "[").replace("}", "]")))
             for name, values in re.findall(r"(\w+) = (\{.*?\}(?=, \w+ =| \}\n))", (tmp_path / "gains.lua").read_text())}
    A, B = plant(0.005)
    assert numpy.max(numpy.abs(gains["A"] - A)) < 1e-9 and numpy.max(numpy.abs(gains["B"] - B)) < 1e-9  # from the linear model
    x, seen = numpy.array([0.3, -0.2, 0, 0]), numpy.zeros(4)
    for _ in range(600):
        u = -gains["K"] @ seen
        seen = gains["A"] @ seen + gains["B"] * u + gains["L"] * (x[0] - seen[0])
        x = A @ x + B * u
    run, _, _ = motion(model, "--set", "control=true", "--until", 3, "--every", 0.4, "--method", method, "--tol", 1e-10)
    found = [run[name][-1] for name in ("motor_psi", "load_psi", "motor_psi_d", "load_psi_d")]
    assert numpy.max(numpy.abs(found - x)) < 1e-9 and numpy.max(numpy.abs(x)) < 1e-2


def test_batches_are_single_motions(tmp_path):
    """Cases of a batch have the bits of their motions; each begins with the declared values."""
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { Kp = { 0.4, 0.6, 0.9 } }, t_end = 0.2, keep = { final = true } }')
    refdyn("batch", CONTROL / "velocity.lua", tmp_path / "sweep.lua", "-o", tmp_path / "runs.csv", "--threads", 2)
    header, *rows = [line.split(",") for line in (tmp_path / "runs.csv").read_text().splitlines()]
    for row in rows:
        case = dict(zip(header, row))
        run, _, _ = motion(CONTROL / "velocity.lua", *settings({"Kp": case["Kp"]}), "--until", 0.2)
        for name in ("motor_psi", "load_psi_d"):
            assert abs(float(case[name]) / run[name][-1] - 1) < 1e-14


def test_without_samples_there_are_no_events(tmp_path):
    """The model without its controller needs no gains, and its C has no table of events."""
    shutil.copy(CONTROL / "lqr.lua", tmp_path)
    refdyn("gen", tmp_path / "lqr.lua", "-o", tmp_path / "out")
    assert "refdyn_event" not in (tmp_path / "out" / "lqr.c").read_text()
    assert evaluate(tmp_path / "lqr.lua")


REPLAYED = """local rd = require "refdyn"
local u, w, v = rd.input("u", 0.2, "N"), rd.input("w", -0.1, "N"), rd.input("v", 0, "N")
local p = rd.parameters { { "phase", 0, "1" } }
local closed = rd.option("closed", true)
return rd.model { name = "replayed", links = { { "m", joint = "x", mass = 1 }, { "n", on = "m", joint = "x", mass = 0.7, start = { x = 0.3 } } },
  forces = function(s) return { m_x = u + w - 0.3 * s.qd.m_x, n_x = v - 4 * s.q.n_x } end,
  courses = function(s) return { pull = 2 * u + s.q.n_x } end,
  events = closed and function(s) return {
    rd.sampled { every = 0.1, inputs = { u = 1 + s.t - s.q.m_x + 0.5 * w } },
    rd.sampled { every = 0.15, inputs = { w = 0.4 * s.q.n_x - 0.2 * u } },
    rd.event { rd.sin(10 * rd.pi / 3 * (s.t - 0.05)), direction = "up", inputs = { v = v + 0.3 }, name = "tick" } } end or nil }
"""


@pytest.mark.parametrize("method", ["auto", "rk4", "radau9", "rodas5p"])
@pytest.mark.parametrize("start, every", [(0, 0.05), (0, 0.025), (0.3, 0.05)])
def test_a_motion_replays_itself(tmp_path, start, every, method):
    """An input holds from its row on, so that --inputs of a CSV or HDF5 file repeats the motion: controllers of different times, an
    event that sets an input, a later start."""
    model, state = tmp_path / "replayed.lua", tmp_path / "state.json"
    model.write_text(REPLAYED)
    state.write_text(json.dumps({"t": start, "q": [0, 0.3], "qd": [0.1, 0]}))
    for kind in ("csv", "h5"):
        closed, replay = tmp_path / f"closed.{kind}", tmp_path / "replay.csv"
        arguments = ["--from", state, "--until", start + 1.2, "--every", every, "--method", method]
        refdyn("sim", model, *arguments, "-o", closed)
        refdyn("sim", model, "--set", "closed=false", *arguments, "--inputs", closed, "-o", replay)
        refdyn("sim", model, *arguments, "-o", tmp_path / "again.csv")
        expected, found = read_run(tmp_path / "again.csv"), read_run(replay)
        for name in expected:
            assert numpy.allclose(found[name], expected[name], rtol=0, atol=1e-6), (kind, name)
        assert numpy.ptp(expected["v"]) > 0.5 and len(set(expected["u"].round(9))) >= 12


@pytest.mark.parametrize("every, first", [(0.05, None), (0.025, None), (0.1, 0.05), (0.07, 0.05), (0.03, 0.05), (0.15, 0.05)])
@pytest.mark.parametrize("start", [0, 731.1])
def test_inputs_that_change_between_rows(tmp_path, every, first, start):
    """The summary says so, with the first time: samples at 0.1 and 0.15 s, ticks at 0.05, 0.65 and 1.25 s."""
    model, state = tmp_path / "replayed.lua", tmp_path / "state.json"
    model.write_text(REPLAYED.replace("s.t - 0.05", f"s.t - {start} - 0.05"))
    state.write_text(json.dumps({"t": start, "q": [0, 0.3], "qd": [0.1, 0]}))
    said = refdyn("sim", model, "--from", state, "--until", start + 1.2, "--every", every, "-o", tmp_path / "run.csv").stderr
    lines = [line for line in said.splitlines() if line.startswith("inputs ")]
    assert len(lines) == (first is not None) and (first is None or f"t = {start + first:.6g}" in lines[0]), said


@pytest.mark.parametrize("method", ["auto", "rk8", "rodas5p"])
def test_samples_of_inputs_with_those_of_a_controller(tmp_path, method):
    """The times in a file of inputs and those of a controller differ by rounding, and limits are compared between them: no step is lost."""
    model, inputs, start, summary = (tmp_path / name for name in ("model.lua", "inputs.csv", "start.json", "summary.json"))
    model.write_text("""local rd = require "refdyn"
local push, held = rd.input("push", 0, "N"), rd.input("held", 0, "N")
return rd.model { name = "paced", gravity = { 0, 0, 0 },
  links = { { "cart", joint = "x", mass = 1, limits = { x = { from = -9, to = 9, rate = 9 } } } },
  forces = function(s) return { cart_x = push + held } end,
  events = function(s) return { rd.sampled { every = 1e-3, inputs = { held = -0.5 * s.qd.cart_x }, name = "controller" } } end }""")
    times = [k / 1000 for k in range(-300, 201)]
    inputs.write_text("t,push\n" + "".join(f"{t!r},{math.sin(7 * t)!r}\n" for t in times))
    start.write_text(json.dumps({"t": -0.3, "q": [0.2], "qd": [0.1]}))
    refdyn("sim", model, "--from", start, "--until", 0.2, "--every", 5e-3, "--inputs", inputs, "--method", method, "-o", tmp_path / "run.csv", "--summary", summary)
    x, v = 0.2, 0.1
    for t in times[:-1]:
        force = math.sin(7 * t) - 0.5 * v
        x, v = x + 1e-3 * v + 5e-7 * force, v + 1e-3 * force
    run = read_run(tmp_path / "run.csv")
    assert abs(run["cart_x"][-1] - x) <= 1e-9 * SCALE and abs(run["cart_x_d"][-1] - v) <= 1e-9 * SCALE
