"""Published benchmarks: planar pendulum and car axis as constrained point masses, a cantilever with large deflection."""
import json

import numpy
import pytest

from program import SCALE, TESTS, read_run, refdyn

PENDULUM = TESTS / "models" / "pendulum_point.lua"
CAR_AXIS = TESTS / "models" / "car_axis.lua"
CANTILEVER = TESTS / "models" / "cantilever.lua"


@pytest.mark.parametrize("method", ["rk4 --step 1e-4", "rk4 --step 1e-4 --stabilise project", "rk8 --tol 1e-11",
                                    "rk54 --tol 1e-12", "rodas5p --tol 1e-11", "rodas6p --tol 1e-12"])
def test_planar_pendulum(method, tmp_path):
    """IFToMM A01: m = 1 kg, L = 1 m, from the horizontal at rest. The dependent coordinate must change on the way."""
    refdyn("sim", PENDULUM, "--until", 10, "--every", 5, "--method", *method.split(), "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    expected = [[-1, 0], [-0.942305435044, -0.334754338414], [-0.275087462576, -0.961419205099]]
    error = abs(numpy.array([run["bob_x"], run["bob_y"]]).T - expected).max()
    assert error <= 1e-9 * SCALE, f"{error:.1e}"
    assert abs(run["energy"] - run["energy"][0]).max() <= 1e-8 * SCALE


# Left mass x, y, right mass x, y after 3 s.
CAR_AXIS_END = [0.0493455784275402809122, 0.496989460230171153861, 1.04174252488542151681, 0.373911027265361256927]


@pytest.mark.parametrize("method", ["rk4 --step 2e-4", "rk8 --tol 1e-9", "rodas5p --tol 1e-9", "rodas6p --tol 1e-9",
                                    "rodas5p --step 1e-3 --stabilise none"])
def test_car_axis(method, tmp_path):
    """Of index 3, with rows and springs that depend on time."""
    refdyn("sim", CAR_AXIS, "--until", 3, "--every", 3, "--method", *method.split(), "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    found = [run[name][-1] for name in ("left_x", "left_y", "right_x", "right_y")]
    error = abs(numpy.array(found) - CAR_AXIS_END).max()
    assert error <= 1e-8 * SCALE, f"{error:.1e}"


# P L^2/(E I), deflection across and shortening along, divided by L
MATTIASSON = [(1, 0.301720774, 0.056433236), (2, 0.493457480, 0.160641721), (5, 0.713791524, 0.387628361),
              (10, 0.810609025, 0.554995598)]


def tip(load, n_rfe):
    found = json.loads(refdyn("statics", CANTILEVER, "--set", f"P={load}", "--set", f"n_rfe={n_rfe}").stdout)
    E = found["points"]["E"]
    return numpy.array([-E[1], 1 - E[0]])


@pytest.mark.parametrize("load, across, along", MATTIASSON)
def test_cantilever_under_a_dead_load(load, across, along):
    """The error falls with the square of the number of spring-damping elements, and extrapolation yields the published value."""
    exact = numpy.array([across, along])
    coarse, middle, fine = [tip(load, elements + 1) for elements in (20, 40, 80)]
    for before, after in ((coarse, middle), (middle, fine)):
        ratio = abs(before - exact) / abs(after - exact)
        assert (abs(ratio - 4) < 0.05).all(), ratio
    error = abs(fine + (fine - middle) / 3 - exact).max()
    assert error <= 1e-6 * SCALE, f"{error:.1e}"


@pytest.mark.parametrize("follows", ["false", "true"])
@pytest.mark.parametrize("n_rfe", [2, 3, 4, 5, 8, 16, 33, 64])
def test_cantilever_rolled_up(n_rfe, follows):
    """A moment 2 pi E I/L at the tip turns it by 2 pi; with at least two spring-damping elements it meets the root."""
    found = json.loads(refdyn("statics", CANTILEVER, "--set", f"M={float(2 * numpy.pi)!r}", "--set", "g=0", "--set", f"n_rfe={n_rfe}",
                              "--set", f"follows={follows}").stdout)
    assert abs(sum(found["q"]) - 2 * numpy.pi) <= 1e-10 * SCALE
    if n_rfe >= 3:
        assert max(abs(x) for x in found["points"]["E"]) <= 1e-10 * SCALE
