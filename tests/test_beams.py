"""Beams bent in two planes and twisted: their order of convergence, compared with a rod that is solved independently (kirchhoff_rod.py)."""
import json

import numpy
import pytest

from kirchhoff_rod import rod_tip, torsion_constant
from program import SCALE, TESTS, refdyn, settings

PRINCETON = TESTS / "models" / "princeton.lua"
LENGTH, WIDTH, HEIGHT, E, NU = 0.508, 12.377e-3, 3.2024e-3, 71.7e9, 0.31
RIGIDITY = [E / (2 * (1 + NU)) * torsion_constant(WIDTH, HEIGHT), E * WIDTH * HEIGHT ** 3 / 12, E * HEIGHT * WIDTH ** 3 / 12]
ELEMENTS = (8, 16, 32, 64)
LOADS = [(4.448, 0), (4.448, 30), (4.448, 60), (4.448, 90), (13.345, 0), (13.345, 30), (13.345, 60), (13.345, 90)]


def tips(**values):
    found = [json.loads(refdyn("statics", PRINCETON, *settings(dict(n=n, **values))).stdout) for n in ELEMENTS]
    return [numpy.array(one["points"]["tip"]) for one in found]


def force(P, angle):
    return [0, P * numpy.sin(numpy.radians(angle)), P * numpy.cos(numpy.radians(angle))]


def judged(found, exact):
    """Relative errors of the deflection, the orders between them, and the error of the extrapolation of the finest two."""
    size = numpy.linalg.norm(exact - [LENGTH, 0, 0])
    errors = [numpy.linalg.norm(tip - exact) / size for tip in found]
    limit = numpy.linalg.norm((4 * found[-1] - found[-2]) / 3 - exact) / size
    return errors, numpy.log2(numpy.array(errors[:-1]) / errors[1:]), limit


@pytest.mark.parametrize("P, angle", LOADS)
def test_princeton_beam(P, angle):
    errors, orders, limit = judged(tips(P=P, angle=angle), rod_tip(LENGTH, RIGIDITY, force(P, angle)))
    assert (abs(orders - 2) < 0.1).all(), (errors, orders)
    assert limit < 1e-6 * SCALE, limit


def test_printed_springs_are_of_first_order():
    """The springs of the chapter, which the option keeps, have the known errors."""
    errors, orders, _ = judged(tips(P=13.345, angle=60, springs="printed"), rod_tip(LENGTH, RIGIDITY, force(13.345, 60)))
    assert (abs(orders - 1) < 0.05).all() and abs(errors[-1] / 2.974e-3 - 1) < 1e-3, (errors, orders)


def test_beam_that_is_curved_in_two_planes():
    """Bent and twisted without load, and loaded in addition."""
    exact = rod_tip(LENGTH, RIGIDITY, force(4.448, 30), [2, 1.5, 0])
    errors, orders, limit = judged(tips(P=4.448, angle=30, curved="true"), exact)
    assert (abs(orders - 2) < 0.1).all(), (errors, orders)
    assert limit < 1e-6 * SCALE, (errors, limit)


def test_two_turns_have_no_strains(tmp_path):
    """The option has no effect there, and a warning says so."""
    model = PRINCETON.read_text().replace("springs = springs,", 'springs = springs, dofs = "psi, theta",')
    (tmp_path / "strip.lua").write_text(model)
    line = 1 + model[:model.index("springs = springs,")].count("\n")
    done = refdyn("check", tmp_path / "strip.lua")
    assert (f"{tmp_path}/strip.lua:{line}: warning: links[1].beam.springs: has no effect, since the elements have fewer than three turns (dofs)"
            in done.stderr), done.stderr


def test_start_without_load_is_an_equilibrium():
    values = settings(dict(n=4, curved="true", P=0))
    found = json.loads(refdyn("eval", PRINCETON, *values).stdout)
    assert abs(numpy.array(found["Q"])).max() == 0 and found["energy"]["potential"] == 0, found["energy"]
