"""`refdyn eval` on random trees against the brute-force evaluation of the formulation."""
import random

import numpy
import pytest

from brute_force import Tree, dynamics, number, rows
from program import check, close, evaluate
from random_models import KINDS, as_lua, random_model, random_state

SEEDS = range(12)


def write(folder, seed):
    path = folder / f"random_{seed}.lua"
    path.write_text(as_lua(random_model(seed)))
    return path


def comparisons(found, tree, state):
    expected = {**dynamics(tree, state["t"], state["q"], state["qd"]), **rows(tree, state["t"], state["q"], state["qd"])}
    q, qd = (numpy.array([number(x) for x in state[name]]) for name in ("q", "qd"))
    E, C = found["points"]["E"], tree.C("E", q)
    lines = [close(name, found[name], expected[name], 1e-13) for name in ("M", "h", "Q", "u", "v", "k") if expected[name] is not None]
    for name in ("phi", "psi"):
        assert [entry is None for entry in found[name]] == [entry is None for entry in expected[name]]
        lines.append(close(name, [x for x in found[name] if x is not None], [x for x in expected[name] if x is not None], 1e-13))
    return lines + [
        close("energy", [found["energy"]["kinetic"], found["energy"]["potential"]],
              [expected["kinetic"], expected["potential"]], 1e-13),
        close("r", E["r"], tree.r("E", q), 1e-13),
        close("rd", E["rd"], C.dot(qd), 1e-13),
        close("C", E["C"], C, 1e-13),
        close("d", E["d"], tree.d("E", q, qd), 1e-13),
    ]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_tree(seed, tmp_path):
    tree = Tree(random_model(seed))
    state = random_state(random.Random(1000 + seed), tree.n)
    found = evaluate(write(tmp_path, seed), state)
    assert found["coordinates"] == tree.names
    check(comparisons(found, tree, state))


def test_every_kind_of_joint_occurs():
    kinds = {kind for seed in SEEDS for kind in Tree(random_model(seed)).kinds}
    assert kinds == set(KINDS)
    assert any("beam" in link and link["beam"]["rfe"] > 1 for seed in SEEDS for link in random_model(seed)["links"])


def test_brute_force_reproduces_the_oracle():
    """The judge is judged: the seed manipulator, written as data, gives the values of oracle/seed_rigid.json."""
    from program import oracle
    reference = oracle("seed_flexible_2")
    p, state = reference["params"], reference["states"][2]
    half_turn = float(numpy.pi / 2)
    rod = {"length": p["L"], "diameter": p["d"], "E": p["E"], "nu": p["nu"], "rho": p["rho"], "rfe": 2}
    tree = Tree({"gravity": (0, 0, -p["g"]), "points": {"E": {"on": "effector"}}, "links": [
        {"name": "base", "joint": ["z"], "mass": p["m_base"], "spring": {"z": p["s_sup"]}, "damper": {"z": p["d_sup"]}},
        {"name": "column", "on": "base", "joint": ["psi"], "mass": p["m_col"], "center": (0, 0, p["h"] / 2),
         "inertia": (0, 0, p["Izz_col"], 0, 0, 0)},
        {"name": "arm", "on": "column", "at": (0, 0, p["h"]), "turn": [("x", half_turn)], "joint": ["psi"], "beam": rod},
        {"name": "effector", "on": "arm.tip", "turn": [("y", half_turn)], "joint": ["z"], "mass": p["m_E"]},
    ], "forces": [("column_psi", lambda t, q, qd: state["tau"], "")]})
    assert tree.names == reference["coordinates"]
    found = dynamics(tree, state["t"], state["q"], state["qd"])
    check([close(name, found[name], state[name], 1e-14) for name in ("M", "h", "Q")]
          + [close("energy", [found["kinetic"], found["potential"]], [state["kinetic"], state["potential"]], 1e-14),
             close("d", tree.d("E", state["q"], state["qd"]), state["d"], 1e-14)])
