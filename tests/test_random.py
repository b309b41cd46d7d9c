"""The emitted C of random models against the brute-force evaluation of the formulation, every quantity at 1e-13."""
import random

import numpy
import pytest

from brute_force import Tree, accelerations, dynamics, force_tangent, number, numbers, rows
from compiled import Compiled
from program import check, close
from random_models import as_lua, random_model, random_state

SEEDS = range(int(__import__("os").environ.get("A","0")), int(__import__("os").environ.get("B","20")))
EXACT = 1e-13


def residual(what, found, size, tolerance):
    """One line when the largest entry of found is more than tolerance times size."""
    return close(what, [abs(entry) for entry in found], [0] * len(found), tolerance, max([float(abs(entry)) for entry in size] + [1e-300]))


def sizes(matrix, vector):
    return [abs(a * b) for row in matrix for a, b in zip(row, vector)]


def check_dynamics(found, tree, state, expected):
    lines = [close(name, found(name, state), expected[name], EXACT) for name in ("M", "h")]
    lines.append(close("Q", found("Q", state), expected["Q"], EXACT))
    lines.append(close("energy", found("energy", state), [expected["kinetic"], expected["potential"]], EXACT))
    power = found("power", state)
    if power is not None:
        lines.append(close("power", power, [expected["power"]], EXACT, max(float(abs(expected["power"])), 1e-3)))
    return lines


def check_points(found, tree, state):
    lines, q, qd = [], numbers(state["q"]), numbers(state["qd"])
    for i, name in enumerate(found.points):
        C = tree.C(name, q)
        scale = max(1, float(abs(C.dot(qd)).max()))
        lines += [close(f"r of {name}", found("r", state)[i], tree.r(name, q), EXACT, 1),
                  close(f"rd of {name}", found("rd", state)[i], C.dot(qd), EXACT, scale),
                  close(f"C of {name}", found("C", state)[i], C, EXACT, 1),
                  close(f"d of {name}", found("d", state)[i], tree.d(name, q, qd), EXACT, scale ** 2)]
    return lines


def check_rows(found, state, expected):
    lines = []
    for name in ("u", "v", "phi", "psi", "k"):
        values = found(name, state)
        for i, entry in enumerate(expected[name]):
            if entry is not None:
                lines.append(close(f"{name} of row {i + 1}", values[i], entry, EXACT, max(1, *[abs(float(x)) for x in numpy.ravel(entry)])))
    return lines


def check_accelerations(found, tree, state, expected, expected_rows):
    M, f = expected["M"], numbers(expected["h"]) + numbers(expected["Q"])
    free = numbers(found("qdd_free", state))
    lines = [residual("M qdd_free = h + Q", M.dot(free) - f, sizes(M, free) + list(f), 1e-12)]
    u, k = numpy.array(expected_rows["u"], dtype=object), expected_rows["k"]
    if not len(k) or is_redundant(u):
        return lines
    qdd, force = numbers(found("qdd", state)), numbers(found("force", state))
    exact_qdd, exact_force = accelerations(M, f, u, k)
    return lines + [residual("M qdd = h + Q + force", M.dot(qdd) - f - force, sizes(M, qdd) + list(f) + list(force), 1e-11),
                    residual("u qdd = k", u.dot(qdd) - k, sizes(u, qdd) + list(k), 1e-10),
                    close("qdd", qdd, exact_qdd, 1e-7), close("force", force, exact_force, 1e-7)]


def is_redundant(u):
    u = u.astype(float)
    size = numpy.linalg.norm(u, axis=1)
    return size.min() < 1e-9 or numpy.linalg.svd(u / size[:, None])[1][-1] < 1e-5


def comparisons(seed, folder, few=True, tangent=False):
    model = random_model(seed, few)
    path = folder / "model.lua"
    path.write_text(as_lua(model))
    tree, found = Tree(model), Compiled(path, folder / "emitted")
    assert found.names == tree.names
    state = random_state(random.Random(1000 + seed), tree.n)
    expected, expected_rows = dynamics(tree, state["t"], state["q"], state["qd"]), rows(tree, state["t"], state["q"], state["qd"])
    lines = check_dynamics(found, tree, state, expected) + check_points(found, tree, state) + check_rows(found, state, expected_rows)
    lines += check_accelerations(found, tree, state, expected, expected_rows)
    if tangent:
        lines.append(close("Q_q", found("Q_q", state), force_tangent(tree, state["t"], state["q"]), EXACT))
    return lines


@pytest.mark.parametrize("seed", SEEDS)
def test_random_model(seed, tmp_path):
    check(comparisons(seed, tmp_path, tangent=seed % 4 == 0))
