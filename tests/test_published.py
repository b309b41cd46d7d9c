"""Cases that others have published: a planar pendulum as a constrained point mass, the car axis, a cantilever bent far."""
import json

import numpy
import pytest

from program import SCALE, TESTS, read_run, refdyn

PENDULUM = TESTS / "models" / "pendulum_point.lua"
CANTILEVER = TESTS / "models" / "cantilever.lua"


@pytest.mark.parametrize("options, tolerance", [
    (["--method", "rk4", "--step", "1e-4"], 1e-8), (["--method", "rk4", "--step", "1e-4", "--stabilise", "project"], 1e-8),
    (["--method", "rk54", "--tol", "1e-10"], 1e-6)])
def test_planar_pendulum(options, tolerance, tmp_path):
    """IFToMM A01: m = 1 kg, L = 1 m, from the horizontal at rest. The dependent coordinate has to change on the way."""
    refdyn("sim", PENDULUM, "--until", 10, "--every", 5, *options, "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    expected = [[-1, 0], [-0.942305435044, -0.334754338414], [-0.275087462576, -0.961419205099]]
    error = abs(numpy.array([run["bob_x"], run["bob_y"]]).T - expected).max()
    assert error <= tolerance * SCALE, f"{error:.1e}"
    assert abs(run["energy"] - run["energy"][0]).max() <= 10 * tolerance * SCALE


@pytest.mark.parametrize("method", ["rk8", "rodas5p"])
def test_car_axis(method, tmp_path):
    """Test Set for IVP Solvers: stiff springs, a constraint that moves, four redundant coordinates; 3 s."""
    refdyn("sim", TESTS / "bench" / "car_axis.lua", "--until", 3, "--every", 3, "--method", method, "--tol", "1e-10", "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    expected = {"left_x": 0.0493455784275402809122, "left_z": 0.496989460230171153861,
                "right_x": 1.04174252488542151681, "right_z": 0.373911027265361256927}
    error = max(abs(run[name][-1] - value) for name, value in expected.items())
    assert error <= 1e-9 * SCALE, f"{error:.1e}"


# P L^2/(E I), deflection across and shortening along, over L
MATTIASSON = [(1, 0.301720774, 0.056433236), (2, 0.493457480, 0.160641721), (5, 0.713791524, 0.387628361),
              (10, 0.810609025, 0.554995598)]


def tip(load, n_rfe):
    found = json.loads(refdyn("statics", CANTILEVER, "--set", f"P={load}", "--set", f"n_rfe={n_rfe}").stdout)
    E = found["points"]["E"]
    return numpy.array([-E[1], 1 - E[0]])


@pytest.mark.parametrize("load, across, along", MATTIASSON)
def test_cantilever_under_a_dead_load(load, across, along):
    """The error falls with the square of the number of elements, and its extrapolation is the published value."""
    exact = numpy.array([across, along])
    coarse, fine = tip(load, 11), tip(load, 21)
    ratio = abs(coarse - exact) / abs(fine - exact)
    assert (abs(ratio - 4) < 0.2).all(), ratio
    error = abs(fine + (fine - coarse) / 3 - exact).max()
    assert error <= 2e-5 * SCALE, f"{error:.1e}"
