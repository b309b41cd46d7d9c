"""The emitted C of random models compared with the brute-force evaluation of the sums, every quantity at 1e-13."""
import json
import os
import random
import re
import subprocess

import numpy
import pytest

from brute_force import Tree, accelerations, dynamics, force_tangent, forces, numbers, rows
from compiled import WARNINGS, Compiled
from program import BUILD, LEAN, SOURCE, check, close, refdyn
from random_models import KINDS, as_lua, features, random_model, random_state, statics_model

# Together these models use every part of the language in `NEEDED`; REFDYN_SEEDS=FROM:TO selects others.
SEEDS = [20, 33, 38, 48, 60, 77, 117, 118, 127, 131, 173, 279, 301, 376, 379, 462]
STATICS = [1, 2, 4]
INTERPRETED = [33, 118, 279]
# Beams of up to ELEMENTS elements and chains of equal links, which become loops.
RUNS, ELEMENTS = [8, 9, 11, 15, 20, 22, 23, 27, 30, 36, 40, 46], 7
if "REFDYN_SEEDS" in os.environ:
    SEEDS = STATICS = RUNS = range(*map(int, os.environ["REFDYN_SEEDS"].split(":")))
NEEDED = """
    free, one link, links, euler, two, apart, turned, child, weight, slide, box, cylinder, tube, sphere, density, mass, center,
    inertia, turn, axis, round, rectangle, area, segments, rfe, dofs, curvature, eta, damping, ratio, mode, frequency, tip_mass,
    along, spring, rest, damper, stiffness, energy, actuator, force, torque, axes, against, friction, position, velocity,
    acceleration, loop, parallel, perpendicular, on_line, on_plane, distance, drive, lock, keep, alpha, beta, close weld,
    close ball, close x, close psi, close theta phi, close phi theta psi, close x z, close x y psi, printed, inputs, course,
    where, less, ramp, smoothstep, max, min, abs, exp, log, sqrt, pow, asin, acos, atan, atan2, tan, sinh, cosh, tanh
"""
EXACT = 1e-13


def residual(what, found, size, tolerance):
    """One line if the largest entry of found exceeds tolerance times size."""
    return close(what, [abs(entry) for entry in found], [0] * len(found), tolerance, max([float(abs(entry)) for entry in size] + [1e-300]))


def sizes(matrix, vector):
    return [abs(a * b) for row in matrix for a, b in zip(row, vector)]


def check_dynamics(found, state, expected):
    lines = [close(name, found(name, state), expected[name], EXACT, max(1e-6, float(abs(expected[name]).max()))) for name in ("M", "h", "Q")]
    lines.append(close("energy", found("energy", state), [expected["kinetic"], expected["potential"]], EXACT))
    power = found("power", state)
    if power is not None:
        lines.append(close("power", power, [expected["power"]], EXACT, expected["power_size"]))
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


def check_accelerations(found, state, expected, expected_rows):
    M, f = expected["M"], numbers(expected["h"]) + numbers(expected["Q"])
    free = numbers(found("qdd_free", state))
    lines = [residual("M qdd_free = h + Q", M.dot(free) - f, sizes(M, free) + list(f), 1e-12)]
    u, k = numpy.array(expected_rows["u"], dtype=object), expected_rows["k"]
    if not len(k) or is_redundant(u):
        return lines
    qdd, force = numbers(found("qdd", state)), numbers(found("force", state))
    exact_qdd, exact_force = accelerations(M, f, u, k)
    return lines + [residual("M qdd = h + Q + force", M.dot(qdd) - f - force, sizes(M, qdd) + list(f) + list(force), 1e-11),
                    residual("u qdd = k", u.dot(qdd) - k, [abs(u).max() * abs(qdd).max()] + list(k), 1e-10),
                    close("qdd", qdd, exact_qdd, 1e-7), close("force", force, exact_force, 1e-7)]


def is_redundant(u):
    u = u.astype(float)
    size = numpy.linalg.norm(u, axis=1)
    return size.min() < 1e-9 or numpy.linalg.svd(u / size[:, None])[1][-1] < 1e-5


def comparisons(seed, folder, elements=0, *options):
    """With sanitizers the model is generated alone: its C is the same as that of the other build."""
    model = random_model(seed, elements=elements)
    path = folder / "model.lua"
    path.write_text(as_lua(model))
    if LEAN:
        refdyn("gen", path, *options, "-o", folder / "emitted")
        return []
    tree, found = Tree(model), Compiled(path, folder / "emitted", *options)
    assert found.names == tree.names
    state = random_state(random.Random(1000 + seed), tree.n)
    expected, expected_rows = dynamics(tree, state["t"], state["q"], state["qd"]), rows(tree, state["t"], state["q"], state["qd"])
    lines = check_dynamics(found, state, expected) + check_points(found, tree, state) + check_rows(found, state, expected_rows)
    lines += check_accelerations(found, state, expected, expected_rows)
    if tree.n < 7:
        lines.append(close("Q_q", found("Q_q", state), force_tangent(tree, state["t"], state["q"]), EXACT))
    return lines


@pytest.mark.parametrize("seed", SEEDS)
def test_random_model(seed, tmp_path):
    check(comparisons(seed, tmp_path))


@pytest.mark.parametrize("seed", RUNS)
def test_runs_of_equal_elements(seed, tmp_path):
    check(comparisons(seed, tmp_path, ELEMENTS, "--loops", "always", "--accelerations", "recursive"))
    if "REFDYN_SEEDS" not in os.environ:
        assert re.search(r"^    for \(int e = ", (tmp_path / "emitted" / f"random_{seed}.c").read_text(), re.M)


@pytest.mark.skipif("REFDYN_SEEDS" in os.environ, reason="chosen seeds")
def test_all_of_the_language_occurs():
    found = set().union(*(features(random_model(seed)) for seed in SEEDS))
    assert set(KINDS) <= set().union(*(Tree(random_model(seed)).kinds for seed in SEEDS))
    assert not set(re.split(r",\s+", NEEDED.strip())) - found


@pytest.mark.skipif(LEAN, reason="the subject is the compiler")
@pytest.mark.parametrize("seed, elements", [(seed, 0) for seed in SEEDS[::5]] + [(seed, ELEMENTS) for seed in RUNS[::5]])
def test_is_clean_c_plus_plus(seed, elements, tmp_path):
    (tmp_path / "model.lua").write_text(as_lua(random_model(seed, elements=elements)))
    refdyn("gen", tmp_path / "model.lua", *["--fold"] * (seed % 2), "--loops", "always", "-o", tmp_path)
    subprocess.run(["g++", "-std=c++17", "-x", "c++", "-fsyntax-only", *WARNINGS, "-I", SOURCE / "runtime", *tmp_path.glob("*.c")],
                   check=True)


def test_singular_mass_compiles(tmp_path):
    """Two turns about one axis without a mass between them: the emitted elimination divides by an exact zero, in valid C."""
    turn = {"joint": ["theta"]}
    model = {**random_model(0), "links": [{"name": "a", **turn}, {"name": "b", "on": "a", **turn, "mass": 1.0, "center": (0.5, 0, 0)}],
             "points": {}, "forces": {"by_coordinate": {}, "list": []}, "rows": []}
    (tmp_path / "model.lua").write_text(as_lua(model))
    found = Compiled(tmp_path / "model.lua", tmp_path / "emitted")
    assert numpy.isnan(found("qdd_free", {"t": 0, "q": [0, 0], "qd": [0, 0]})).any()
    done = refdyn("eval", tmp_path / "model.lua", status=3)
    assert "mass matrix is not positive definite" in done.stderr


@pytest.mark.parametrize("seed, elements", [(seed, 0) for seed in INTERPRETED] + [(11, ELEMENTS)])
def test_interpreter_agrees(seed, elements, tmp_path):
    """Random parameters, inputs and states; there, too, accelerations as the runtime solves them, Q_q and power by differences."""
    (tmp_path / "model.lua").write_text(as_lua(random_model(seed, elements=elements)))
    done = subprocess.run([BUILD / "bin" / "test_interpreter", tmp_path / "model.lua", "loops=always"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def refine(tree, found, q, free):
    """Newton from q with Q in many digits and the emitted tangent."""
    q = numbers(q)
    for _ in range(4):
        tangent = found("Q_q", {"t": 0, "q": q, "qd": [0] * tree.n})[numpy.ix_(free, free)]
        Q = forces(tree, 0, q, [0] * tree.n)
        step = numpy.linalg.solve(tangent, Q[free].astype(float))
        q[free] = q[free] - numbers(step)
    assert abs(step).max() < 1e-18
    return q, forces(tree, 0, q, [0] * tree.n)


@pytest.mark.parametrize("seed", STATICS)
def test_equilibrium(seed, tmp_path):
    model = statics_model(seed)
    path = tmp_path / "model.lua"
    path.write_text(as_lua(model))
    tree, found = Tree(model), Compiled(path, tmp_path / "emitted")
    given = json.loads(refdyn("statics", path).stdout)
    held = [tree.names.index(name) for name in model.get("hold", ())]
    q, Q = refine(tree, found, given["q"], [i for i in range(tree.n) if i not in held])
    check([close("q", given["q"], q, 1e-11, max(1, float(abs(q).max())))]
          + [close("hold force", given["hold_force"], -Q[held], 1e-9, max([10] + [float(abs(Q[i])) for i in held]))])
