"""Massless frames that rows determine: M is singular, but not on the motions that the rows allow."""
import re

import numpy
import pytest

from program import SCALE, TESTS, check, close, evaluate, motion, refdyn

MODEL = TESTS / "models" / "massless" / "frames.lua"
METHODS = ["auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]


def settings(scene, method):
    return ["--set", f"scene={scene}", "--start", "project", "--method", method] + ([] if method == "rk4" else ["--tol", 1e-9])


def pendulum(psi, rate, times):
    """0.09 psi'' = 0.2 (-0.7 sin psi - 9.81 cos psi) by the classical method in steps of 1e-4 s; psi at multiples of them."""
    def slope(y):
        return numpy.array([y[1], 0.2 * (-0.7 * numpy.sin(y[0]) - 9.81 * numpy.cos(y[0])) / 0.09])
    y, h, found = numpy.array([psi, rate]), 1e-4, [psi]
    for i in range(round(times[-1] / h)):
        k1 = slope(y)
        k2 = slope(y + h / 2 * k1)
        k3 = slope(y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(y + h * k3))
        if (i + 1) % round(times[1] / h) == 0:
            found.append(y[0])
    return found


@pytest.mark.parametrize("stabilise", ["project", "baumgarte", "none"])
@pytest.mark.parametrize("method", METHODS)
def test_four_bar(method, stabilise):
    """The massless link does not affect the crank."""
    run, _, summary = motion(MODEL, *settings("four_bar", method), "--until", 0.8, "--every", 0.05, "--stabilise", stabilise)
    expected = pendulum(run["crank_psi"][0], run["crank_psi_d"][0], run["t"])
    check([close("crank", run["crank_psi"], expected, 2e-7), close("force on the crank", run["force_crank_psi"], 0 * run["t"], 1e-5, 1),
           close("energy", summary["energy_error"], 0, 1e-6, 1), close("residual", summary["phi_max"], 0, 1e-7, 1)])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scene", ["slides", "rates"])
def test_slides(scene, method):
    """a + b is a free mass accelerated by 0.7 m/s^2; the projected start keeps its rate, and c does not change."""
    run, _, _ = motion(MODEL, *settings(scene, method), "--until", 1)
    t, sum_ = run["t"], run["a_x"] + run["b_x"]
    row = run["a_x"] - 0.5 * run["b_x"] + (0.2 * run["c_y"] - 0.02 if scene == "slides" else 0)
    check([close("a + b", sum_, 0.9 + 0.4 * t + 0.35 * t**2, 1e-8), close("c", run["c_y"], 0.1 - 9.81 / 2 * t**2, 1e-8),
           close("row", row, 0 * t, 1e-8, 1)])


@pytest.mark.parametrize("n_rfe", [4, 24])
def test_rod(n_rfe):
    """A flexible arm after a rod: explicit, Rosenbrock and collocation methods agree, and energy is constant."""
    arguments = ["--set", f"n_rfe={n_rfe}", "--until", 0.1]
    methods = ["auto", "rodas5p", "radau9"] + (["rk8"] if n_rfe == 4 else [])
    runs = [motion(MODEL, *settings("rod", method), *arguments) for method in methods]
    for run, _, summary in runs:
        check([close(name, run[name], runs[0][0][name], 1e-7, 1) for name in ("arm_psi", "rod_psi", "car_x")]
              + [close("energy", summary["energy_error"], 0, 1e-6, 1)])


def test_accelerations():
    """Accelerations of the bordered equations M qdd - u^T lambda = f, u qdd = k, solved densely."""
    state = {"q": [0.31, 0.62, 0.13], "qd": [0.4, -0.3, 0.2], "t": 0.1}
    for scene in ("slides", "rates"):
        found = evaluate(MODEL, state, "--set", f"scene={scene}")
        M, u = numpy.array(found["M"]), numpy.array(found["u"])
        bordered = numpy.block([[M, -u.T], [u, numpy.zeros((1, 1))]])
        solved = numpy.linalg.solve(bordered, numpy.concatenate([numpy.array(found["h"]) + found["Q"], found["k"]]))
        check([close("qdd", found["qdd"], solved[:3], 1e-14), close("force", found["force"], u.T @ solved[3:], 1e-13, 1)])
        assert found["qdd_free"] is None and numpy.linalg.matrix_rank(M) == 2


def test_rows_that_do_not_tell(tmp_path):
    done = refdyn("sim", MODEL, "--set", "scene=free", "--until", 1, "-o", tmp_path / "run.csv", status=3)
    assert re.search(r"t = 0 s: the mass matrix is not positive definite for the admissible motions, coordinate [ab]_x\n", done.stderr)


def test_batch(tmp_path):
    """Lanes compute NaN there; each case then runs alone, and equals `sim`."""
    table = tmp_path / "cases.csv"
    table.write_text("crank_psi_d\n0.7\n0.9\n1.1\n-0.2\n0.3\n")
    refdyn("batch", MODEL, "--table", table, "--until", 0.5, "--tol", 1e-9, "-o", tmp_path / "runs.csv")
    rows = numpy.genfromtxt(tmp_path / "runs.csv", delimiter=",", names=True)
    run, _, _ = motion(MODEL, "--until", 0.5, "--tol", 1e-9)
    assert set(rows["status"]) == {0}
    assert abs(rows["crank_psi"][0] - run["crank_psi"][-1]) < 1e-6 * SCALE
