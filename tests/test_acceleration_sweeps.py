"""Derivatives of accelerations in sweeps: the digits of each column, the same values as with the matrix, and O(n^2) operations."""
import math
import re

import numpy
import pytest

from program import MODELS, REFERENCE, TESTS, refdyn
from test_derivatives import Emitted, state_near

CHAIN = ("--set", "program=none", "--set", "drive=input", "--fold")
# Relative errors of a state with turns of 0.2 rad: of the worst column, and of all entries in their norm. With the matrix: 4e-11 and
# 9e-12 for 4 elements, 2e-9 and 7e-10 for 16.
DIGITS = {4: (3e-11, 1e-12), 16: (3e-10, 3e-12)}
TREES = TESTS / "models" / "trees.lua"
KINDS = {"two": 8, "three": 3, "nested": 2, "comb": 5, "short": 1}  # elements, or ribs
FORMS = [(MODELS / "fivebar.lua", ()), (MODELS / "gantry.lua", ()), (MODELS / "branched.lua", ()), (REFERENCE, ("--set", "n_rfe=2", "--set", "eta=1e-3"))]
FORMS += [(TREES, ("--set", f"kind={kind}", "--set", f"rfe={rfe}")) for kind, rfe in {**KINDS, "joined": 3, "between": 1}.items()]
SAME = 1e-8  # of the largest entry; the matrix loses digits
ROUNDED = 4e-15  # of a column: a few roundings


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


def errors_of_columns(found, expected, n):
    """Relative to the columns; 0 for those that are zero."""
    expected = expected.reshape(n, n)
    sizes = numpy.linalg.norm(expected, axis=0)
    return numpy.linalg.norm(found.reshape(n, n) - expected, axis=0) / numpy.where(sizes > 0, sizes, 1)


@pytest.mark.parametrize("kind", KINDS)
def test_columns_of_trees_are_as_accurate_as_with_the_matrix(kind, tmp_path):
    options = ("--set", f"kind={kind}", "--set", f"rfe={KINDS[kind]}")
    wide, sweeps, matrix = (emitted(tmp_path / f"{form}_{width}", TREES, options, form, "d_qdd_free.q,d_qdd_free.qd,qdd_free,start", width)
                            for form, width in (("recursive", "wide"), ("recursive", "narrow"), ("dense", "narrow")))
    exact, found, other = (form.result("d_qdd_free", state_near(wide.start, 3, wide.n)) for form in (wide, sweeps, matrix))
    for part, expected in exact.items():
        here, there = (errors_of_columns(values[part], expected, wide.n) for values in (found, other))
        assert (here <= numpy.maximum(2 * there, ROUNDED)).all(), f"{part}: {max(here)}, with the matrix {max(there)}"
        assert here.max() <= max(1.5 * there.max(), ROUNDED), part


@pytest.mark.parametrize("path, options", FORMS, ids=[path.stem + "".join(options[1:2]) for path, options in FORMS])
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


def test_operations_of_trees_grow_with_the_square(tmp_path):
    counts, sizes = [], []
    for rfe in (9, 33):
        summary = refdyn("gen", TREES, "--set", f"rfe={rfe}", "--emit", "d_qdd_free.q,d_qdd_free.qd", "-o", tmp_path).stdout
        counts.append(sum(map(int, re.search(r"^d_qdd_free +(\d+) +(\d+)", summary, re.M).groups())))
        sizes.append(int(re.search(r"trees: (\d+) coordinates", summary)[1]))
    assert math.log(counts[1] / counts[0]) / math.log(sizes[1] / sizes[0]) <= 2.0
    assert counts[1] < 60 * sizes[1] ** 2


def test_the_longest_branch_is_last(tmp_path):
    """Then few responses to unit wrenches are carried at once: none to the spine, however many ribs it has."""
    refdyn("gen", TREES, "--set", "kind=comb", "--set", "rfe=21", "--emit", "d_qdd_free", "-o", tmp_path)
    text = "".join(path.read_text() for path in tmp_path.glob("*.c"))
    starts = re.search(r" starts\[\d+\] = \{([^}]*)\}", text)[1].split(",")
    assert len(starts) == 2 * 20 + 1 and " levels[" not in text  # they are all 0


@pytest.mark.parametrize("kind, rfe, form", [("short", 1, "with the matrix"), ("two", 9, "in sweeps")])
def test_short_trees_keep_the_matrix(kind, rfe, form, tmp_path):
    summary = refdyn("gen", TREES, "--set", f"kind={kind}", "--set", f"rfe={rfe}", "--emit", "d_qdd_free", "-o", tmp_path).stdout
    assert f"d_qdd_free {form}" in summary
