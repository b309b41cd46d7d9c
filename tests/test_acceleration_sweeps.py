"""Derivatives of accelerations in sweeps: the digits of each column, the same values as with the matrix, and O(n^2) operations."""
import math
import re

import numpy
import pytest

from program import MODELS, REFERENCE, refdyn
from test_derivatives import Emitted, state_near

CHAIN = ("--set", "program=none", "--set", "drive=input", "--fold")
# Relative errors of a state with turns of 0.2 rad: of the worst column, and of all entries in their norm. With the matrix: 4e-11 and
# 9e-12 for 4 elements, 2e-9 and 7e-10 for 16.
DIGITS = {4: (3e-11, 1e-12), 16: (3e-10, 3e-12)}
FORMS = [(MODELS / "fivebar.lua", ()), (MODELS / "gantry.lua", ()), (REFERENCE, ("--set", "n_rfe=2", "--set", "eta=1e-3"))]
SAME = 1e-8  # of the largest entry; the matrix loses digits


def emitted(folder, path, options, form, quantities, width="narrow"):
    folder.mkdir()
    refdyn("gen", path, *options, "--accelerations", form, "--emit", quantities, "-o", folder)
    return Emitted(folder, path.stem, width)


@pytest.mark.parametrize("n_rfe", DIGITS)
def test_columns_keep_their_digits(n_rfe, tmp_path):
    options = (*CHAIN, "--set", f"n_rfe={n_rfe}")
    forms = [emitted(tmp_path / width, REFERENCE, options, "recursive", "d_qdd_free.q,d_qdd_free.qd,qdd_free,start", width) for width in ("wide", "narrow")]
    n = forms[0].n
    exact, found = (form.result("d_qdd_free", state_near(form.start, 3, n)) for form in forms)
    for part, expected in exact.items():
        error, expected = (values.reshape(n, n) for values in (found[part] - expected, expected))
        sizes = numpy.linalg.norm(expected, axis=0)
        columns = numpy.linalg.norm(error, axis=0)[sizes > 0] / sizes[sizes > 0]
        assert columns.max() < DIGITS[n_rfe][0], f"{part}: column {columns.argmax() + 1}"
        assert numpy.linalg.norm(error) < DIGITS[n_rfe][1] * numpy.linalg.norm(expected), part


@pytest.mark.parametrize("path, options", FORMS, ids=[path.stem for path, _ in FORMS])
def test_both_forms_have_the_same_values(path, options, tmp_path):
    forms = [emitted(tmp_path / form, path, options, form, "d_qdd,d_qdd_free,qdd_free,start") for form in ("recursive", "dense")]
    for quantity in ("d_qdd", "d_qdd_free"):
        sweeps, matrix = (form.result(quantity, state_near(form.start, 5, form.n)) for form in forms)
        assert sweeps.keys() == matrix.keys() and {"q", "qd"} <= sweeps.keys()
        for part, expected in matrix.items():
            assert abs(sweeps[part] - expected).max() <= SAME * abs(expected).max(), f"{quantity}.{part}"


def test_operations_grow_with_the_square(tmp_path):
    counts = []
    for n_rfe in (16, 64):
        summary = refdyn("gen", REFERENCE, *CHAIN, "--set", f"n_rfe={n_rfe}", "--emit", "d_qdd_free.q,d_qdd_free.qd", "-o", tmp_path).stdout
        counts.append(sum(map(int, re.search(r"^d_qdd_free +(\d+) +(\d+)", summary, re.M).groups())))
    assert math.log(counts[1] / counts[0]) / math.log(193 / 49) <= 2.0
    assert counts[1] < 50 * 193 ** 2
