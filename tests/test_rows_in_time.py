"""Rows that come and go at known times: at once, linearly, smoothly; compared with the equations of each interval by hand."""
import re

import numpy
import pytest

from program import TESTS, check, close, motion, refdyn

MODEL = TESTS / "models" / "rows_in_time.lua"
METHODS = ["auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
T, END, EVERY = 0.37, 0.8, 0.01
LENGTHS, MASSES, GRAVITY = (0.7, 0.5, 0.4), (1.3, 0.8, 0.6), numpy.array([0.6, -9.81])
LEVEL, SECOND = [1, 1, 1], [0, 1, 0]
references = {}


def equations(q, qd):
    """M and f of three point masses, from the derivatives of their positions by the absolute angles."""
    angles, rates = numpy.cumsum(q), numpy.cumsum(qd)
    M, f = numpy.zeros((3, 3)), numpy.zeros(3)
    J, bias = numpy.zeros((2, 3)), numpy.zeros(2)
    for k in range(3):
        along = LENGTHS[k] * numpy.array([numpy.cos(angles[k]), numpy.sin(angles[k])])
        J[:, :k + 1] += numpy.array([-along[1], along[0]])[:, None]
        bias = bias - along * rates[k]**2
        M += MASSES[k] * J.T @ J
        f += MASSES[k] * J.T @ (GRAVITY - bias)
    return M, f


def slope(y, rows):
    M, f = equations(y[:3], y[3:])
    m = len(rows)
    solved = numpy.linalg.solve(numpy.block([[M, -rows.T], [rows, numpy.zeros((m, m))]]), numpy.concatenate([f, numpy.zeros(m)]))
    return numpy.concatenate([y[3:], solved[:3]])


def integrate(y, rows, start, end, found, h=2.5e-4):
    rows = numpy.array(rows, dtype=float)
    for i in range(round((end - start) / h)):
        k1 = slope(y, rows)
        k2 = slope(y + h / 2 * k1, rows)
        k3 = slope(y + h / 2 * k2, rows)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(y + h * k3, rows))
        if (i + 1) % round(EVERY / h) == 0:
            found.append(y)
    return y


def reference(comes):
    """Both rows until T and one afterwards, or the other way round: then velocities change with the smallest kinetic energy."""
    if comes not in references:
        y = numpy.array([0.4, -0.7, 1.1] + ([0.9, 0.5, -1.4] if comes else [0.9, 0, -0.9]))
        found = [y]
        y = integrate(y, [LEVEL] if comes else [LEVEL, SECOND], 0, T, found)
        if comes:
            M, rows = equations(y[:3], y[3:])[0], numpy.array([LEVEL, SECOND], dtype=float)
            y[3:] -= numpy.linalg.solve(M, rows.T @ numpy.linalg.solve(rows @ numpy.linalg.solve(M, rows.T), rows @ y[3:]))
        integrate(y, [LEVEL, SECOND] if comes else [LEVEL], T, END, found)
        references[comes] = numpy.array(found)
    return references[comes]


def compare(run, comes, tolerance):
    expected, seen = reference(comes), abs(run["t"] - T) > 1e-9  # at T rates may jump
    names = ("a_psi", "b_psi", "c_psi")
    return ([close(name, run[name], expected[:, j], tolerance, 1) for j, name in enumerate(names)]
            + [close(f"{name}_d", run[f"{name}_d"][seen], expected[seen, 3 + j], 30 * tolerance, 1) for j, name in enumerate(names)])


@pytest.mark.parametrize("weight", ["jump", "straight", "ramp", "cubic", "gone", "comes"])
@pytest.mark.parametrize("method", METHODS)
def test_motion(weight, method):
    """No row is released too early or too late."""
    for tol in ([1e-6, 1e-9] if method != "rk4" else [None]):
        arguments = ["--until", END, "--every", EVERY, "--set", f"weight={weight}", "--method", method]
        run, said, summary = motion(MODEL, *arguments, *(["--tol", tol] if tol else ["--stabilise", "project"]))
        check(compare(run, weight == "comes", 20 * tol if tol else 1e-8))
        assert summary["energy_error"] < 1e-3 and "do not balance" not in said, said


@pytest.mark.parametrize("stabilise", ["none", "baumgarte", "project"])
@pytest.mark.parametrize("weight", ["jump", "ramp", "cubic"])
@pytest.mark.parametrize("method", ["rk8", "rodas5p", "gauss12", "rk4"])
def test_however_stabilised(weight, method, stabilise):
    run, _, _ = motion(MODEL, "--until", END, "--every", EVERY, "--set", f"weight={weight}", "--method", method, "--stabilise", stabilise)
    check(compare(run, False, 1e-5))


@pytest.mark.parametrize("weight", ["jump", "cubic"])
def test_forces(weight):
    """Before T the programme force on the second link is from both rows, after it from one: the same as on the other links."""
    run, _, _ = motion(MODEL, "--until", END, "--every", EVERY, "--set", f"weight={weight}", "--tol", 1e-9)
    expected, lines = reference(False), []
    for i, t in enumerate(run["t"]):
        if abs(t - T) < 0.02:
            continue
        rows = numpy.array([LEVEL, SECOND] if t < T else [LEVEL], dtype=float)
        M, f = equations(expected[i, :3], expected[i, 3:])
        force = M @ slope(expected[i], rows)[3:] - f
        lines.append(close(f"{t:.2f} s", [run[f"force_{name}_psi"][i] for name in "abc"], force, 1e-6, 10))
    check(lines)


@pytest.mark.parametrize("method", METHODS)
def test_position_that_is_not_met(method, tmp_path):
    """A row that begins to act requires another position: the motion stops there with a message."""
    tol = [] if method == "rk4" else ["--tol", 1e-6]
    done = refdyn("sim", MODEL, "--until", END, "--set", "weight=step", "--method", method, "--stabilise", "project", *tol, "-o",
                  tmp_path / "run.csv", status=3)
    assert re.search(r"t = 0\.37\d* s: rows that begin to act or jump at this time, or a changed parameter, require positions other than those of the motion, "
                     r"constraint both\n", done.stderr), done.stderr


@pytest.mark.parametrize("weight", ["straight", "gone"])
@pytest.mark.parametrize("method", ["auto", "rk8", "radau9"])
def test_output_shortly_before(weight, method):
    """Where a row has almost faded: the state there is on the programme and keeps its energy."""
    for before in 1e-2, 1e-4, 1e-7:
        run, _, summary = motion(MODEL, "--until", END, "--every", (T - before) / 10, "--set", f"weight={weight}", "--method", method)
        check([close(f"{before} s", [run["b_psi"][10], sum(run[f"{name}_psi"][10] for name in "abc")], [-0.7, 0.8], 1e-9, 1)])
        assert summary["energy_error"] < 1e-5


def test_output_at_the_time(tmp_path):
    """An output at exactly this time shows the side before it."""
    run, _, _ = motion(MODEL, "--until", 2 * T, "--every", T, "--set", "weight=jump", "--tol", 1e-9)
    assert abs(run["b_psi_d"][1]) < 1e-9 and abs(run["b_psi_d"][2]) > 0.1
