"""Identities that are true for every model: all models of the repository and random trees."""
import json
import random

import numpy
import pytest

from compiled import Compiled
from program import MODELS, SCALE, TESTS, all_models, check, difference, evaluate, few_models, few_models_of_tests, read_run, refdyn, settings
from random_models import as_lua, random_model, random_state

RANDOM = [6, 9, 14, 26, 28, 33]
CASES = ([(path, ()) for path in few_models()] + [(path, ()) for path in few_models_of_tests()]
         + [(MODELS / "manipulator.lua", ("--set", f"n_rfe={n}")) for n in (1, 2)] + [(seed, ()) for seed in RANDOM])
NAMES = [f"random {path}" if isinstance(path, int) else " ".join([path.name, *options]) for path, options in CASES]


class Values:
    """What the emitted C of a case says of one state, by name as in the results of `refdyn eval`."""

    def __init__(self, found, state):
        self.found, self.state = found, state

    def __getitem__(self, name):
        if name == "energy":
            return dict(zip(("kinetic", "potential"), self.found("energy", self.state)))
        if name == "points":
            r, rd = self.found("r", self.state), self.found("rd", self.state)
            return {point: {"r": r[i], "rd": rd[i]} for i, point in enumerate(self.found.points)}
        return self.found(name, self.state)


class Case:
    """A model at a random state: what the program says there, and the emitted C for the states around it."""

    def __init__(self, path, options, folder):
        if isinstance(path, int):
            seed, path = path, folder / "random.lua"
            path.write_text(as_lua(random_model(seed)))
        self.found = Compiled(path, folder / "emitted", *options, "--emit", "all,inverse")
        state = random_state(random.Random(7), self.found.n, 0.15)
        self.t, self.q, self.qd = state["t"], numpy.array(state["q"]), numpy.array(state["qd"])
        now = evaluate(path, {"t": self.t, "q": self.q.tolist(), "qd": self.qd.tolist()}, *options)
        self.at_state = {name: numpy.array(value) if name in ARRAYS else value for name, value in now.items()}

    def at(self, **changes):
        return Values(self.found, {"t": self.t, "q": self.q, "qd": self.qd, **changes})

    def slope(self, read, step, **direction):
        """Derivative of read(values) along a direction in t, q, qd: central differences of order four."""
        def at(scale):
            return read(self.at(**{name: getattr(self, name) + scale * step * way for name, way in direction.items()}))
        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)


ARRAYS = ("M", "h", "Q", "qdd", "qdd_free", "force", "u", "v", "k")


@pytest.fixture(params=CASES, ids=NAMES, scope="module")
def case(request, tmp_path_factory):
    return Case(*request.param, tmp_path_factory.mktemp("case"))


def agrees(what, found, expected, tolerance, scale):
    error = difference(found, expected, scale)
    return "" if error <= tolerance * SCALE else f"{what}: {error:.1e} of {scale:.2g}, allowed {tolerance * SCALE:.0e}"


def test_mass_matrix(case):
    M = case.at_state["M"]
    assert (M == M.T).all()
    scaled = M / numpy.sqrt(numpy.outer(M.diagonal(), M.diagonal()))
    assert numpy.linalg.eigvalsh(scaled)[0] > 0


def test_forward_and_inverse_dynamics(case):
    now = case.at_state
    M, f, force = now["M"], now["h"] + now["Q"], now.get("force")
    terms = abs(M) * abs(now["qdd_free"])
    lines = [agrees("M qdd_free = h + Q", M @ now["qdd_free"], f, 1e-12, max(abs(f).max(), terms.max()))]
    if len(now.get("u", [])):
        u, qdd = now["u"], now["qdd"]
        size = max((abs(M) * abs(qdd)).max(), abs(f).max())
        lines.append(agrees("M qdd - h - Q = force", M @ qdd - f, force, 1e-12, size))
        for row, k in zip(u, now["k"]):
            lines.append(agrees("u qdd = k", row @ qdd, k, 1e-10, max(abs(row * qdd).max(), abs(k))))
        multipliers = numpy.linalg.lstsq(u.T, force, rcond=None)[0]
        lines.append(agrees("force = u^T lambda", u.T @ multipliers, force, 1e-7, abs(force).max()))
    check(lines)


def test_inverse_dynamics(case):
    """It is M qdd - h - Q at any qdd, 0 at the accelerations without rows, and the programme force at those with rows."""
    now, rng = case.at_state, numpy.random.default_rng(3)
    M, f = now["M"], now["h"] + now["Q"]
    for qdd, expected in (rng.uniform(-9, 9, len(f)), None), (now["qdd_free"], 0 * f), (now["qdd"], now["force"] if case.found.m else 0 * f):
        found = case.at(qd=numpy.concatenate([case.qd, qdd]))["inverse"]
        size = max((abs(M) * abs(qdd)).max(), abs(now["h"]).max(), abs(now["Q"]).max())
        check([agrees("inverse", found, M @ qdd - f if expected is None else expected, 1e-12, size)])


def test_bias_forces_follow_from_mass_matrix(case):
    """h_i = qd dM/dq_i qd / 2 - (dM/dt qd)_i"""
    n, qd = len(case.q), case.qd
    along = case.slope(lambda now: now["M"], 1e-3, q=qd)
    h = -along @ qd
    for i in range(n):
        h[i] += qd @ case.slope(lambda now: now["M"], 1e-3, q=numpy.eye(n)[i]) @ qd / 2
    check([agrees("h", case.at_state["h"], h, 1e-8, max(abs(h).max(), abs(case.at_state["M"]).max()))])


def test_forces_follow_from_potential(case):
    """Without rates and inputs, at t = 0 (no drive, no course) Q = -dV/dq."""
    n, t, qd, inputs = len(case.q), case.t, case.qd, case.found.x.copy()
    try:
        case.t, case.qd, case.found.x[:] = 0.0, 0 * qd, 0
        found = case.at()["Q"]
        expected = [-case.slope(lambda now: now["energy"]["potential"], 1e-3, q=numpy.eye(n)[i]) for i in range(n)]
    finally:
        case.t, case.qd, case.found.x[:] = t, qd, inputs
    check([agrees("Q", found, expected, 1e-8, abs(found).max())])


def test_kinetic_energy(case):
    now = case.at_state
    expected = case.qd @ now["M"] @ case.qd / 2
    assert abs(now["energy"]["kinetic"] - expected) <= 1e-13 * expected * SCALE


def test_points(case):
    """rd = C qd, C = dr/dq and d = d(C qd)/dt at constant rates."""
    lines = []
    n = len(case.q)
    for name, point in case.at_state["points"].items():
        C = numpy.array(point["C"])
        slopes = [case.slope(lambda now: numpy.array(now["points"][name]["r"]), 1e-3, q=numpy.eye(n)[i]) for i in range(n)]
        bias = case.slope(lambda now: numpy.array(now["points"][name]["rd"]), 1e-3, q=case.qd)
        lines += [agrees("rd = C qd", point["rd"], C @ case.qd, 1e-13, max(abs(C).max() * abs(case.qd).max(), 1e-300)),
                  agrees("C = dr/dq", C.T, numpy.array(slopes), 1e-9, max(1, abs(C).max())),
                  agrees("d", point["d"], bias, 1e-7, max(1, abs(bias).max()))]
    check(lines)


def test_rows(case):
    """psi = dphi/dt along the motion; u = dphi/dq or dpsi/dqd; v = dpsi/dt at constant rates."""
    now, n, lines = case.at_state, len(case.q), []
    for row, phi in enumerate(now.get("phi", [])):
        if now["psi"][row] is None:
            continue
        psi = lambda values: values["psi"][row]
        rest = case.slope(psi, 1e-4, t=1.0, q=case.qd)
        lines.append(agrees(f"v of row {row + 1}", now["v"][row], rest, 1e-6, max(abs(rest), abs(now["psi"][row]), 1)))
        slopes = [case.slope(psi, 1e-2, qd=numpy.eye(n)[i]) for i in range(n)]
        lines.append(agrees(f"u of row {row + 1}", now["u"][row], slopes, 1e-9, max(1, abs(now["u"][row]).max())))
        if phi is not None:
            rate = case.slope(lambda values: values["phi"][row], 1e-4, t=1.0, q=case.qd)
            lines.append(agrees(f"psi of row {row + 1}", now["psi"][row], rate, 1e-7, max(abs(rate), abs(phi), 1)))
    check(lines)


def end_of_motion(folder, *arguments):
    """Coordinates of a smooth motion after 2 s, and the number of steps."""
    refdyn("sim", TESTS / "models" / "double_pendulum.lua", *arguments, "--until", 2, "--every", 2, "-o", folder / "run.csv",
           "--summary", folder / "summary.json")
    run = read_run(folder / "run.csv")
    names = [name for name in run if name + "_d" in run]
    return numpy.array([run[name][-1] for name in names]), json.loads((folder / "summary.json").read_text())["steps"]


@pytest.mark.parametrize("method, order, option, values", [
    ("rk4", 4, "--step", (0.005, 0.0025, 0.00125)), ("rk54", 5, "--tol", (1e-6, 1e-8, 1e-10))])
def test_observed_order(method, order, option, values, tmp_path):
    """The error falls with the number of steps according to the method's order."""
    exact, _ = end_of_motion(tmp_path, "--method", "rk4", "--step", 0.0002)
    ends = [end_of_motion(tmp_path, "--method", method, option, value) for value in values]
    errors, steps = numpy.array([abs(q - exact).max() for q, _ in ends]), numpy.array([count for _, count in ends])
    observed = numpy.log(errors[:-1] / errors[1:]) / numpy.log(steps[1:] / steps[:-1])
    assert (abs(observed - order) < 0.4).all(), (errors, steps, observed)


# Order, and the numbers of steps between which the error is neither pre-asymptotic nor rounding.
ORDERS = {"rk4": (4, (80, 120, 160)), "rk54": (5, (120, 160, 240)), "rk8": (8, (24, 30, 40)), "rodas5p": (5, (80, 120, 160)),
          "rodas6p": (6, (60, 80, 120)), "ros34pw2": (3, (80, 120, 160))}


def end_on_programme(folder, method, step, stabilise):
    """Coordinates and rates of an elastic arm with a prescribed tip, after 0.5 s."""
    refdyn("sim", TESTS / "models" / "suite" / "arm.lua", *settings(dict(n_rfe=3, row="swing", E="2e9", omega=4, ratio=0.02)),
           "--until", 0.5, "--every", 0.5, "--method", method, "--step", step, "--stabilise", stabilise,
           "-o", folder / "run.csv")
    run = read_run(folder / "run.csv")
    names = [name for name in run if name + "_d" in run]
    return numpy.array([run[name][-1] for name in names] + [run[name + "_d"][-1] / 10 for name in names])


@pytest.fixture(scope="module")
def exact_on_programme(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exact")
    exact = end_on_programme(folder, "rk8", 2e-4, "project")
    assert abs(end_on_programme(folder, "rk4", 2e-5, "none") - exact).max() < 1e-12
    return exact


@pytest.mark.parametrize("stabilise", ["none", "baumgarte", "project"])
@pytest.mark.parametrize("method", ORDERS)
def test_observed_order_on_a_programme(method, stabilise, exact_on_programme, tmp_path):
    """Rows that depend on time reduce no method's order, however they are kept."""
    order, counts = ORDERS[method]
    errors = [abs(end_on_programme(tmp_path, method, 0.5 / count, stabilise) - exact_on_programme).max() for count in counts]
    observed = -numpy.polyfit(numpy.log(counts), numpy.log(errors), 1)[0]
    assert abs(observed - order) < 0.5, (errors, observed)


# With a stiff arm, high-order methods reach rounding before their order shows: here the rigid manipulator, with gains that are slow
# compared with a step; fast gains are followed only to the order of the stages.
HIGH_ORDERS = {"radau9": (9, (13, 16, 20, 25)), "gauss12": (12, (8, 10, 12, 14))}


def manipulator_after_1_s(folder, method, step, stabilise):
    """Coordinates and rates on the programme, an ellipse that is traversed in time."""
    refdyn("sim", MODELS / "manipulator.lua", *settings(dict(n_rfe=1, alpha=4, beta=4)), "--until", 1, "--every", 1,
           "--method", method, "--step", step, "--stabilise", stabilise, "-o", folder / "run.csv")
    run = read_run(folder / "run.csv")
    names = [name for name in run if name + "_d" in run]
    return numpy.array([run[name][-1] for name in names] + [run[name + "_d"][-1] for name in names])


@pytest.fixture(scope="module")
def exact_manipulator(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exact")
    exact = manipulator_after_1_s(folder, "rk8", 2.5e-4, "project")
    assert abs(manipulator_after_1_s(folder, "rk8", 5e-4, "none") - exact).max() < 1e-13
    return exact


@pytest.mark.parametrize("stabilise", ["none", "baumgarte", "project"])
@pytest.mark.parametrize("method", HIGH_ORDERS)
def test_observed_high_order_on_a_programme(method, stabilise, exact_manipulator, tmp_path):
    order, counts = HIGH_ORDERS[method]
    errors = [abs(manipulator_after_1_s(tmp_path, method, 1 / count, stabilise) - exact_manipulator).max() for count in counts]
    observed = numpy.log(numpy.divide(errors[:-1], errors[1:])) / numpy.log(numpy.divide(counts[1:], counts[:-1]))
    print(method, stabilise, errors, observed)
    assert errors[-1] > 1e-12
    assert (abs(observed - order) < 0.5 * SCALE).all(), (errors, observed)


def test_energy_balance(tmp_path):
    """The work of drives, dampers and programme forces equals the change of energy in every model; without work, energy is constant."""
    for path in all_models():
        said = refdyn("sim", path, "--method", "rk4", "--step", "1e-5", "--until", "0.05", "-o", tmp_path / "run.csv",
                      "--summary", tmp_path / "summary.json").stderr
        error = json.loads((tmp_path / "summary.json").read_text())["energy_error"]
        stays = "changes only by rounding" in said
        assert stays if error is None else error < 1e-6 * SCALE, (path.name, said)
