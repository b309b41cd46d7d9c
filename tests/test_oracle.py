"""Every state of oracle/seed_*.json through `refdyn eval`, the printed form, and the static equilibrium."""
import json

import mpmath
import pytest

from program import REFERENCE, SCALE, check, close, evaluate, oracle, refdyn, settings

SEEDS = ["seed_rigid", "seed_flexible_2", "seed_flexible_4"]
STATES = [(seed, number) for seed in SEEDS for number in range(5)]


def at_state(seed, number, **options):
    reference = oracle(seed)
    state = reference["states"][number]
    found = evaluate(REFERENCE, {"t": state["t"], "q": state["q"], "qd": state["qd"], "qdd": state["qdd"], "inputs": {"tau": state["tau"]},
                                 "parameters": {"xc": reference["params"]["xc"]}},
                     *settings({"n_rfe": reference["n_rfe"], "drive": "input", **options}))
    return reference, state, found


def rows(entries, width):
    return [entries[start:start + width] for start in range(0, len(entries), width)]


@pytest.mark.parametrize("seed, number", STATES)
def test_quantities(seed, number):
    reference, state, found = at_state(seed, number)
    n, p = len(state["q"]), reference["params"]
    v = [state["v"], state["rest"]]
    psi = [state["Phid"], state["Psi"]]
    k = [-v[0] - 2 * p["alpha"] * psi[0] - p["beta"] ** 2 * state["Phi"], -v[1] - 2 * p["alpha"] * psi[1]]
    assert found["coordinates"] == reference["coordinates"]
    assert found["dependent"] == [reference["coordinates"][one - 1] for one in reference["dependent_1based"]]
    assert found["phi"][1] is None
    assert [len(row) for row in found["M"]] == [n] * n and [len(row) for row in found["u"]] == [n] * 2
    E = found["points"]["E"]
    rate = [sum(c * qd for c, qd in zip(row, state["qd"])) for row in rows(state["C"], n)]
    check([
        close("M", found["M"], state["M"], 1e-13),
        close("h", found["h"], state["h"], 1e-13),
        close("Q", found["Q"], state["Q"], 1e-13),
        close("u", found["u"], [state["u"], state["row"]], 1e-13),
        close("v", found["v"], v, 1e-13),
        close("phi", found["phi"][:1], [state["Phi"]], 1e-13),
        close("psi", found["psi"], psi, 1e-13),
        close("k", found["k"], k, 1e-13),
        close("energy", [found["energy"]["kinetic"], found["energy"]["potential"]],
              [state["kinetic"], state["potential"]], 1e-13),
        close("r", E["r"], state["r_E"], 1e-13),
        close("rd", E["rd"], rate, 1e-13),
        close("C", E["C"], state["C"], 1e-13),
        close("d", E["d"], state["d"], 1e-13),
        close("qdd", found["qdd"], state["qdd"], 1e-9),
        close("qdd_free", found["qdd_free"], state["qdd_free"], 1e-9),
        close("force", found["force"], state["r"], 1e-10),
        close("inverse", found["inverse"], state["r"], 1e-12, max(abs(value) for value in state["Q"])),
    ])


def gpme_residual(found):
    """(M_i + P^T M_d) qdd - (h + Q)_i - P^T (h + Q)_d and K qdd - k, each divided by its largest term, in 40 digits."""
    mpmath.mp.dps = 40
    n = len(found["h"])
    M, K = mpmath.matrix(found["M"]), mpmath.matrix(found["u"])
    qdd, k = mpmath.matrix(found["qdd"]), mpmath.matrix(found["k"])
    f = mpmath.matrix(found["h"]) + mpmath.matrix(found["Q"])
    dependent = [found["coordinates"].index(name) for name in found["dependent"]]
    independent = [i for i in range(n) if i not in dependent]
    m = len(dependent)
    K_d = mpmath.matrix(m, m)
    K_i = mpmath.matrix(m, n - m)
    for row in range(m):
        for column, i in enumerate(dependent):
            K_d[row, column] = K[row, i]
        for column, i in enumerate(independent):
            K_i[row, column] = K[row, i]
    P = -(K_d ** -1) * K_i
    worst = mpmath.mpf(0)
    for column, i in enumerate(independent):
        terms = [M[i, j] * qdd[j] for j in range(n)] + [-f[i]]
        for row, e in enumerate(dependent):
            terms += [P[row, column] * M[e, j] * qdd[j] for j in range(n)] + [-P[row, column] * f[e]]
        worst = max(worst, abs(mpmath.fsum(terms)) / max(abs(term) for term in terms))
    for row in range(m):
        terms = [K[row, j] * qdd[j] for j in range(n)] + [-k[row]]
        worst = max(worst, abs(mpmath.fsum(terms)) / max(abs(term) for term in terms))
    return float(worst)


@pytest.mark.parametrize("seed, number", STATES)
def test_projected_equations(seed, number):
    residual = gpme_residual(at_state(seed, number)[2])
    assert residual <= 1e-12 * SCALE, f"residual {residual:.2e} of the largest term"


@pytest.mark.parametrize("seed, number", STATES)
def test_printed_form(seed, number):
    """h becomes -h + 2 s, and Q gains sum_j qd_j dQ_j/dqd_i: the dampers a second time."""
    reference, state, found = at_state(seed, number, form="printed")
    assert found["inverse"] is None
    h = [-h + 2 * second for h, second in zip(state["h"], state["h_second"])]
    Q = [Q - damper * qd for Q, damper, qd in zip(state["Q"], reference["damper"], state["qd"])]
    check([close("h", found["h"], h, 1e-13), close("Q", found["Q"], Q, 1e-13), close("M", found["M"], state["M"], 1e-13)])


def test_eval_depends_on_its_state():
    """The comparison can fail: two states of one file differ by much more than any tolerance."""
    first, second = at_state("seed_rigid", 0)[2], oracle("seed_rigid")["states"][1]
    assert close("M", first["M"], second["M"], 1e-3)


def test_statics():
    reference = oracle("statics_flexible_4")
    found = json.loads(refdyn("statics", REFERENCE, "--set", "n_rfe=4").stdout)
    undeformed = evaluate(REFERENCE, None, "--set", "n_rfe=4")["points"]["E"]["r"]
    r = found["points"]["E"]
    assert found["coordinates"] == reference["coordinates"]
    check([
        close("q", found["q"], reference["q_after"], 1e-10, 1),
        close("r_E", r, reference["r_E_after"], 1e-10, 1),
        close("r_E before gravity", undeformed, reference["r_E_before"], 1e-10, 1),
        close("hold force", found["hold_force"], reference["hold_force"], 1e-10),
    ])
    assert [round(x, 4) for x in undeformed] == reference["printed_before"]
    assert [round(x, 4) for x in r] == reference["printed_after"]
    assert abs(found["residual"]) < 1e-8
