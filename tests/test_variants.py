"""Both ways to solve M qdd = f, forced: equal to the oracle and to each other; which of them is chosen."""
import random
import re

import numpy
import pytest

from compiled import Compiled
from program import REFERENCE, TESTS, all_models, check, close, evaluate, few_models, few_models_of_tests, models_of_tests, oracle, refdyn, settings
from random_models import random_state

METHODS = ["recursive", "dense"]
MODELS = all_models() + models_of_tests()


def choice(folder, model, *options):
    """quantity -> (method, operations by method), as `refdyn gen` prints and the header says; {} without accelerations."""
    printed = refdyn("gen", model, *options, "-o", folder).stdout
    line = re.search(r"^choices: (.*)$", printed, re.M).group(1)
    assert f"Choices by counted operations: {line}." in next(folder.glob("*.h")).read_text()
    chosen = {}
    for name, method, part in re.findall(r"(qdd\w*) (\w+)([^;]*)", line):
        counts = {method: int(count) for count in re.findall(r", (\d+) operations", part)}
        counts.update((other, int(count)) for other, count in re.findall(r"\((dense|recursive) (\d+)\)", part))
        chosen[name] = method, counts
    return chosen


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", ["seed_rigid", "seed_flexible_2", "seed_flexible_4"])
def test_oracle(seed, method):
    reference = oracle(seed)
    state = reference["states"][1]
    found = evaluate(REFERENCE, {"t": state["t"], "q": state["q"], "qd": state["qd"], "inputs": {"tau": state["tau"]},
                                 "parameters": {"xc": reference["params"]["xc"]}},
                     *settings({"n_rfe": reference["n_rfe"], "drive": "input"}), "--accelerations", method)
    check([close("qdd", found["qdd"], state["qdd"], 1e-9), close("qdd_free", found["qdd_free"], state["qdd_free"], 1e-9),
           close("force", found["force"], state["r"], 1e-9)])


@pytest.mark.parametrize("model", few_models() + few_models_of_tests(), ids=lambda path: path.stem)
def test_equal(model, tmp_path):
    """As far as the condition of M lets a factored M be."""
    compiled = [Compiled(model, tmp_path / method, "--accelerations", method) for method in METHODS]
    state = random_state(random.Random(11), compiled[0].n, 0.15)
    tolerance = 1e-10 + 1e-15 * numpy.linalg.cond(compiled[0]("M", state))
    for name in ("qdd_free", "qdd", "force"):
        one, other = (variant(name, state) for variant in compiled)
        assert (one is None) == (other is None), name
        if one is not None:
            assert numpy.isfinite(one).all() and numpy.isfinite(other).all(), name
            check([close(name, other, one, tolerance)])


@pytest.mark.parametrize("model", MODELS, ids=lambda path: path.stem)
def test_dense_where_it_saves_a_tenth(model, tmp_path):
    for method, counts in choice(tmp_path, model).values():
        if "dense" in counts:
            assert (10 * counts["dense"] <= 9 * counts["recursive"]) == (method == "dense"), counts
        else:
            assert method == "recursive"


def test_small_trees_are_solved_as_matrices_and_long_chains_by_recursion(tmp_path):
    assert choice(tmp_path, TESTS / "models" / "double_pendulum.lua")["qdd_free"][0] == "dense"
    assert choice(tmp_path, REFERENCE)["qdd_free"][0] == "recursive"


def test_branches_have_no_fill_in(tmp_path):
    """Two arms on one column: no product of the pivots of both."""
    model = tmp_path / "two_arms.lua"
    model.write_text(TWO_ARMS)
    refdyn("gen", model, "--accelerations", "dense", "--emit", "qdd_free", "-o", tmp_path)
    text = (tmp_path / "two_arms.c").read_text()
    assert "left_psi_pivot_inverse" in text and "right_psi_pivot_inverse" in text
    for line in re.findall(r"[^;]*right_psi_pivot_inverse[^;]*;", text):
        assert "left_psi_pivot_inverse" not in line
    one, other = (evaluate(model, {"q": [0.3, -0.5, 0.8], "qd": [1, 2, -1]}, "--accelerations", method)["qdd_free"]
                  for method in METHODS)
    assert numpy.allclose(one, other, rtol=1e-12)


TWO_ARMS = """local rd = require "refdyn"
local p  = rd.parameters { { "J", 0.125, "kg m^2" } }
return rd.model { name = "two_arms", gravity = { 0, -9.75, 0 }, links = {
  { "column", joint = { "psi" }, mass = 2, center = { 0.5, 0, 0 }, inertia = { zz = 0.75 } },
  { "left", on = "column", at = { 1, 0.5, 0 }, joint = { "psi" }, mass = 1, center = { 0.25, 0, 0 }, inertia = { zz = p.J } },
  { "right", on = "column", at = { 1, -0.5, 0 }, joint = { "psi" }, mass = 1.5, center = { 0.5, 0, 0 }, inertia = { zz = 2 * p.J } },
} }
"""


def test_wrong_word(tmp_path):
    done = refdyn("gen", REFERENCE, "--accelerations", "fast", "-o", tmp_path, status=2)
    assert "--accelerations: 'fast' is not one of auto, recursive, dense" in done.stderr
    assert not list(tmp_path.iterdir())
