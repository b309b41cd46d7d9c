"""The judge of random models is judged: brute-force evaluation against the oracle, and `refdyn eval` against both."""
import random

import numpy
import pytest

from brute_force import Tree, dynamics, numbers, rows
from program import check, close, evaluate, oracle
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


def test_brute_force_reproduces_the_oracle():
    """The judge is judged: the seed manipulator, written as data, gives the values of oracle/seed_rigid.json."""
    reference = oracle("seed_flexible_2")
    p, state = reference["params"], reference["states"][2]
    half_turn = float(numpy.pi / 2)
    rod = {"length": p["L"], "section": Tagged("round", p["d"]), "E": p["E"], "nu": p["nu"], "rho": p["rho"], "rfe": 2}
    tree = Tree({"gravity": (0, 0, -p["g"]), "points": {"E": {"on": "effector"}}, "links": [
        {"name": "base", "joint": ["z"], "mass": p["m_base"], "spring": {"z": p["s_sup"]}, "damper": {"z": p["d_sup"]}},
        {"name": "column", "on": "base", "joint": ["psi"], "mass": p["m_col"], "center": (0, 0, p["h"] / 2),
         "inertia": {"zz": p["Izz_col"]}},
        {"name": "arm", "on": "column", "at": (0, 0, p["h"]), "turn": [("x", half_turn)], "joint": ["psi"], "beam": rod},
        {"name": "effector", "on": "arm.tip", "turn": [("y", half_turn)], "joint": ["z"], "mass": p["m_E"]},
    ], "forces": {"by_coordinate": {"column_psi": Formula(repr(state["tau"]))}}})
    assert tree.names == reference["coordinates"]
    found = dynamics(tree, state["t"], state["q"], state["qd"])
    check([close(name, found[name], state[name], 1e-14) for name in ("M", "h", "Q")]
          + [close("energy", [found["kinetic"], found["potential"]], [state["kinetic"], state["potential"]], 1e-14),
             close("d", tree.d("E", state["q"], state["qd"]), state["d"], 1e-14)])
