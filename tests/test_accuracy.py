"""Digits of the emitted accelerations, as loops and as straight code.

`oracle/accelerations.json`: the reference manipulator without programme or torque at one state for each number of elements,
by another formulation (articulated bodies in 6 x 6 matrices) in 60 digits. Many more states: the emitted C once more with
113-bit numbers in place of double, where both variants must agree to 30 digits.
"""
import ctypes
import random
import re
import subprocess

import numpy
import pytest

from compiled import Compiled, array, pointer
from program import REFERENCE, SOURCE, check, close, oracle, refdyn
from test_derivatives import WIDE
from test_loops import LOOPS, STRAIGHT

VARIANTS = {"loops": LOOPS, "straight": STRAIGHT}
NORMWISE = 5e-16   # at the states of the oracle
MANY_NORMWISE, MANY_EACH, LEAST = 1e-14, 1e-9, 1e-6
STATES = 1000

# Results as the sum of two doubles.
SHIM = """
#include "manipulator.h"

void evaluate(const NARROW *state, NARROW *high, NARROW *low);

void evaluate(const NARROW *state, NARROW *high, NARROW *low) {
    const struct refdyn_model *m = &manipulator_model;
    double p[200], x[2] = {0, 0}, q[400], qdd[200];
    for (int i = 0; i < m->parameter_count; i++)
        p[i] = m->parameters[i].value;
    m->prepare(p);
    for (int i = 0; i < 2 * m->n; i++)
        q[i] = state[i];
    m->qdd_free(p, x, 0, q, q + m->n, qdd);
    for (int i = 0; i < m->n; i++) {
        high[i] = (NARROW)qdd[i];
        low[i] = (NARROW)(qdd[i] - high[i]);
    }
}
"""


def options_of(n_rfe, variant):
    return ["--set", f"n_rfe={n_rfe}", "--set", "program=none", "--set", "drive=input", "--emit", "qdd_free,start", *VARIANTS[variant]]


class Wide:
    """qdd_free with 113-bit numbers; the pass over sines and cosines, which has the digits of a double, is told to ask libm."""

    def __init__(self, folder, n_rfe, variant):
        refdyn("gen", REFERENCE, *options_of(n_rfe, variant), "-o", folder)
        for path in folder.glob("*.c"):
            path.write_text(re.sub(r"fabs\(x\[i\]\) <= [0-9.]*", "fabs(x[i]) <= -1.0", path.read_text()))
        (folder / "wide.h").write_text("typedef double NARROW;\n" + WIDE)
        (folder / "shim.c").write_text(SHIM)
        subprocess.run(["gcc", "-std=gnu11", "-O0", "-fPIC", "-shared", "-include", folder / "wide.h", "-I", folder, "-I", SOURCE / "runtime",
                        "-o", folder / "wide.so", *folder.glob("*.c"), "-lm"], check=True)
        self.library = ctypes.CDLL(str(folder / "wide.so"))

    def __call__(self, state):
        high, low = array([0.0] * len(state["q"])), array([0.0] * len(state["q"]))
        self.library.evaluate(pointer(array(state["q"] + state["qd"])), pointer(high), pointer(low))
        return high, low


def norm(values):
    return float(numpy.linalg.norm(values))


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("case", oracle("accelerations"), ids=lambda case: f"{case['n_rfe']}")
def test_oracle(case, variant, tmp_path):
    found = Compiled(REFERENCE, tmp_path, *options_of(case["n_rfe"], variant))("qdd_free", {"t": 0, **case})
    expected = array(case["qdd_free"])
    check([close("qdd_free, normwise", norm(found - expected), 0, NORMWISE, norm(expected))])


def test_many_states(tmp_path):
    n_rfe = 16
    wide = {variant: Wide(tmp_path / variant, n_rfe, variant) for variant in VARIANTS}
    found = {variant: Compiled(REFERENCE, tmp_path / f"{variant}_double", *options_of(n_rfe, variant)) for variant in VARIANTS}
    rng, n, lines = random.Random(16), found["loops"].n, []
    for number in range(STATES):
        state = {"t": 0, "q": [rng.uniform(-0.1, 0.1) for _ in range(n)], "qd": [rng.uniform(-1, 1) for _ in range(n)]}
        high, low = wide["straight"](state)
        other, other_low = wide["loops"](state)
        lines.append(close(f"113 bits, state {number}", norm((other - high) + (other_low - low)), 0, 1e-30, norm(high)))
        large = abs(high) > LEAST * abs(high).max()
        for variant in VARIANTS:
            error = (found[variant]("qdd_free", state) - high) - low
            lines.append(close(f"{variant}, state {number}, normwise", norm(error), 0, MANY_NORMWISE, norm(high)))
            lines.append(close(f"{variant}, state {number}, each", abs(error / high)[large].max(), 0, MANY_EACH, 1))
    check(lines)
