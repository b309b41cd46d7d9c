"""`refdyn gen --explain PASS`: the data of the generator after each pass, the same on each call, without written files."""
import re

import pytest

from program import REFERENCE, TESTS, refdyn

PASSES = ["expand", "roll", "derive", "sums", "plan"]


def explain(pass_name, *arguments, model=REFERENCE, **options):
    return refdyn("gen", model, "--explain", pass_name, *arguments, **options).stdout


@pytest.mark.parametrize("pass_name", PASSES)
def test_same_text_each_time(pass_name, tmp_path):
    text = explain(pass_name, "--set", "n_rfe=3", cwd=tmp_path)
    assert len(text.splitlines()) > 5 and text == explain(pass_name, "--set", "n_rfe=3", cwd=tmp_path)
    assert not list(tmp_path.iterdir())


def test_wrong_passes_are_told(tmp_path):
    for wrong in ("schedule", "Plan", "expand,roll"):
        done = refdyn("gen", REFERENCE, "--explain", wrong, status=2)
        assert f"--explain: '{wrong}' is not a pass; use one of {' '.join(PASSES)}\n" in done.stderr and done.stdout == ""
    done = refdyn("gen", REFERENCE, "--explain", "plan", "-o", tmp_path / "out", status=2)
    assert "--explain prints and writes no files; leave out -o" in done.stderr and not (tmp_path / "out").exists()
    assert all(name in refdyn("gen", "--help").stdout for name in PASSES)


def test_trees():
    """Five elements are separate frames at first, then one, between an entry and an exit."""
    expanded, rolled = (explain(name, "--set", "n_rfe=6", "--set", "dofs=psi").splitlines() for name in ("expand", "roll"))
    assert len(expanded) == 9 and expanded[5] == "  frame 5, on 4: arm_psi_3 turns about z, coordinate 5"
    assert [line for line in rolled if line.endswith(" e") or " run " in line] == [
        "  frame 3, on 2: entry of run 0", "  frame 4, on 3: arm_psi_e turns about z, coordinate 3 + 1 e", "  frame 5, on 4: exit of run 0",
        "  run 0, arm_psi_e: 5 elements of 1 coordinates from 3 on, the last one with another inertia"]


def definitions(text):
    """Right sides by named value, of one function."""
    return dict(re.findall(r"^ +(\w*#\d+) = (.*)$", text, re.M))


def counts(text, quantity):
    return {name: int(count) for name, count in re.findall(r"([A-Z]\w*) (\d+)", re.search(rf"^{quantity}: nodes (.*)$", text, re.M)[1])}


def test_before_and_behind_the_order_of_sums():
    """The same number of operations of each kind; sums in another order."""
    derived, ordered = (explain(name, "--emit", "Q") for name in ("derive", "sums"))
    before, behind = counts(derived, "Q"), counts(ordered, "Q")
    assert before["ADD"] + before["SUB"] == behind["ADD"] + behind["SUB"] > 20 and before["MUL"] == behind["MUL"]
    assert derived != ordered and len(definitions(derived)) == len(definitions(ordered)) > 20


def test_counts_are_those_of_the_graph():
    text = explain("derive", "--emit", "M", model=TESTS / "models" / "double_pendulum.lua")
    assert counts(text, "M")["COS"] == 1 and counts(text, "M")["MUL"] >= text.count(" * ") > 0


def test_plan_is_what_is_run():
    """Each named value is computed before it is read, or by `prepare`; entries of M follow their operands."""
    text = explain("plan", "--emit", "M", "--loops", "never", "--set", "n_rfe=2")
    body, prepare = text.split("prepare: nodes")
    known = set(definitions(prepare))
    assert "block 0, once" in body and known
    for line in body.splitlines():
        name = re.match(r" +(\w*#\d+) = ", line)
        right = line.split(" = ", 1)[-1] if " = " in line else ""
        assert set(re.findall(r"\w*#\d+", right)) <= known, line
        known |= {name[1]} if name else set()
    assert len(re.findall(r"^ +M\.M\[\d+\] = ", body, re.M)) >= 20
