"""Checks the reference of random models: brute-force evaluation against the oracle, and `refdyn eval` against both."""
import random

import numpy
import pytest

from brute_force import Tree, dynamics, numbers, rows
from program import check, close, evaluate, oracle, refdyn
from random_models import Formula, Tagged, as_lua, random_model, random_state

SEEDS = (0, 3, 5, 6)


def comparisons(found, tree, state):
    expected = {**dynamics(tree, state["t"], state["q"], state["qd"]), **rows(tree, state["t"], state["q"], state["qd"])}
    q, qd = numbers(state["q"]), numbers(state["qd"])
    lines = [close(name, found[name], expected[name], 1e-13) for name in ("M", "h", "Q", "u", "v", "k")]
    for name in ("phi", "psi"):
        assert [entry is None for entry in found[name]] == [entry is None for entry in expected[name]]
        lines.append(close(name, [x for x in found[name] if x is not None], [x for x in expected[name] if x is not None], 1e-13))
    lines.append(close("energy", [found["energy"]["kinetic"], found["energy"]["potential"]],
                       [expected["kinetic"], expected["potential"]], 1e-13))
    for name, point in found["points"].items():
        C = tree.C(name, q)
        for key, entry in (("r", tree.r(name, q)), ("rd", C.dot(qd)), ("C", C), ("d", tree.d(name, q, qd))):
            lines.append(close(f"{key} of {name}", point[key], entry, 1e-13, max(1, float(abs(entry).max()))))
    return lines


@pytest.mark.parametrize("seed", SEEDS)
def test_eval_of_random_model(seed, tmp_path):
    model = random_model(seed)
    tree = Tree(model)
    state = random_state(random.Random(1000 + seed), tree.n)
    path = tmp_path / "model.lua"
    path.write_text(as_lua(model))
    found = evaluate(path, state)
    assert found["coordinates"] == tree.names
    check(comparisons(found, tree, state))


def link(name, on, joint, at=(0.5, 0.02, 0.1), **fields):
    return {"name": name, "joint": joint, "at": at, "mass": 1.5, "center": (0.2, 0.03, -0.04),
            "inertia": {"xx": 0.05, "yy": 0.11, "zz": 0.12, "xy": 0.01, "xz": 0.004, "yz": -0.003}, **({"on": on} if on else {}), **fields}


# Successive turns about parallel axes: the message about them, and the links.
PARALLEL = {
    "elbow": ("kept", [link("a", None, ["psi"]), link("b", "a", ["theta"]), link("c", "b", ["theta"]), link("d", "c", ["phi"]),
                       link("e", "d", ["theta"]), link("f", "e", ["phi"])]),
    "slides": ("kept", [link("a", None, ["phi"]), link("b", "a", ["psi"], turn=[("x", 0.4)]), link("c", "b", ["psi"]),
                        link("d", "c", ["x", "psi"]), link("e", "c", ["psi", "z"]), link("f", "e", ["theta"], turn=[("z", 0.3)])]),
    "chain": ("kept", [link("a", None, ["phi"])] + [link(name, on, ["theta"]) for on, name in zip("abcde", "bcdef")]),
    "planar": ("kept after the first", [
        {"name": name, **({"on": on} if on else {}), "at": (0.5 if on else 0, 0, 0), "joint": ["psi"], "mass": 0.7, "center": (0.3, 0, 0),
         "inertia": {"zz": 0.1}} for on, name in zip(("", "a", "b", "c"), "abcf")]),
}


@pytest.mark.parametrize("case", PARALLEL)
def test_parallel_axes(case, tmp_path):
    axes, links = PARALLEL[case]
    by_coordinate = {"a_" + links[0]["joint"][0]: Formula("1.5")}
    forces = [Tagged("spring", {"on": "f", "at": (0.1, 0.2, 0)}, {"on": "ground", "at": (0.3, 0.2, 0)}, stiffness=20.0)]
    model = {"name": "parallel", "gravity": (1.0, -9.0, 3.0 if case != "planar" else 0), "links": links, "points": {"E": {"on": "f", "at": (0.1, 0.2, 0)}},
             "inputs": {}, "curves": {}, "forces": {"by_coordinate": by_coordinate, "list": forces}, "rows": []}
    tree = Tree(model)
    state = random_state(random.Random(3), tree.n)
    path = tmp_path / "model.lua"
    path.write_text(as_lua(model))
    assert f"axes of parallel turns {axes}, " in refdyn("gen", path, "-o", tmp_path).stdout
    check(comparisons(evaluate(path, state), tree, state))


def test_brute_force_reproduces_the_oracle():
    """The seed manipulator, written as data, yields the values of oracle/seed_rigid.json."""
    reference = oracle("seed_flexible_2")
    p, state = reference["params"], reference["states"][2]
    half_turn = float(numpy.pi / 2)
    rod = {"length": p["L"], "section": Tagged("round", p["d"]), "E": p["E"], "nu": p["nu"], "rho": p["rho"], "rfe": 2,
           "springs": "printed"}
    tree = Tree({"gravity": (0, 0, -p["g"]), "points": {"E": {"on": "effector"}}, "links": [
        {"name": "base", "joint": ["z"], "mass": p["m_base"], "spring": {"z": p["s_sup"]}, "damper": {"z": p["d_sup"]}},
        {"name": "column", "on": "base", "joint": ["psi"], "mass": p["m_col"], "center": (0, 0, p["h"] / 2),
         "inertia": {"zz": p["Izz_col"]}},
        {"name": "arm", "on": "column", "at": (0, 0, p["h"]), "turn": [("x", half_turn)], "joint": ["psi"], "beam": rod},
        {"name": "effector", "on": "arm.tip", "turn": [("y", half_turn)], "joint": ["z"], "mass": p["m_E"]},
    ], "forces": {"by_coordinate": {"column_psi": Formula(repr(float(state["tau"])))}}})
    assert tree.names == reference["coordinates"]
    found = dynamics(tree, state["t"], state["q"], state["qd"])
    check([close(name, found[name], state[name], 1e-14) for name in ("M", "h", "Q")]
          + [close("energy", [found["kinetic"], found["potential"]], [state["kinetic"], state["potential"]], 1e-14),
             close("d", tree.d("E", state["q"], state["qd"]), state["d"], 1e-14)])
