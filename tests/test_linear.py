"""`refdyn linearise`: eigenvalues against `modes`, the model against the equations nearby, responses against small sines of `sim`, messages."""
import json
import math

import numpy
import pytest

from program import LONG, MODELS, REFERENCE, TESTS, check, close, motion, refdyn, settings

ARM = TESTS / "models" / "linear.lua"
LEVELS = ("none", "position", "velocity", "acceleration")


def linear(model, *arguments, **values):
    """The result of `refdyn linearise`, with arrays, and its messages."""
    done = refdyn("linearise", model, *arguments, *settings(values))
    found = json.loads(done.stdout)
    sizes = {name: len(found[name]) for name in ("states", "inputs", "outputs")}
    for name, (rows, columns) in {"A": ("states", "states"), "B": ("states", "inputs"), "C": ("outputs", "states"), "D": ("outputs", "inputs")}.items():
        found[name] = numpy.array(found[name]).reshape(sizes[rows], sizes[columns])
    found["eigenvalues"] = numpy.array([complex(*pair) for pair in found["eigenvalues"]])
    return found, done.stderr


def both_of_pairs(modes):
    values = [complex(*mode["eigenvalue"]) for mode in modes]
    return [each for value in values for each in ([value, value.conjugate()] if value.imag else [value])]


def largest_distance(found, expected):
    """Differences relative to the eigenvalues, each paired with the nearest remaining one."""
    left, largest = list(expected), 0.0
    for value in found:
        nearest = min(left, key=lambda other: abs(other - value))
        left.remove(nearest)
        largest = max(largest, abs(nearest - value) / max(abs(value), 1e-3))
    return largest


@pytest.mark.parametrize("model, options", [
    (REFERENCE, ()), (MODELS / "crane.lua", ()), (MODELS / "slidercrank.lua", ("--way", "downhill")), (ARM, ("--set", "level=velocity", "--at", "initial")),
    (REFERENCE, ("--set", "eta=1.3e-3", "--hold", "base_z")), (TESTS / "models" / "small_motions.lua", ()), (TESTS / "models" / "clamped_beam.lua", ()),
    (MODELS / "jib.lua", ())][:None if LONG else 4], ids=lambda value: value.stem if hasattr(value, "stem") else " ".join(value))
def test_eigenvalues_are_those_of_modes(model, options):
    found, _ = linear(model, *options)
    if "initial" in options:  # modes takes accelerations as 0; away from an equilibrium they are not
        assert largest_distance(numpy.linalg.eigvals(found["A"]), found["eigenvalues"]) < 1e-9
        return
    expected = both_of_pairs(json.loads(refdyn("modes", model, *options).stdout)["modes"])
    zeros = [0.0] * (len(found["eigenvalues"]) - len(expected))  # a coordinate that moves freely has two
    assert largest_distance(found["eigenvalues"], expected + zeros) < 1e-9
    assert len(found["eigenvalues"]) == len(found["states"])


class Nearby:
    """States near a moving one, on the rows, with their equations by `eval`."""

    def __init__(self, level, folder):
        self.level, self.folder = level, folder
        start = {"t": 0.2, "q": [0.13, -0.9, 0.6], "qd": [0.7, 0.3, -1.1], "inputs": {"tau": 0.3}}
        found = self.evaluate(start)
        self.coordinates = found["coordinates"]
        rows = [value is not None for value in found["phi"]], [value is not None for value in found["psi"]]
        self.base = self.on_rows(start, [name for kind, has in zip(("", "_d"), rows) for name in [coordinate + kind for coordinate in self.coordinates][any(has):]])

    def evaluate(self, state):
        path = self.folder / "state.json"
        path.write_text(json.dumps(state))
        return json.loads(refdyn("eval", ARM, "--set", f"level={self.level}", "--state", path).stdout)

    def on_rows(self, state, states):
        """Moves the other coordinates and rates onto the rows by Newton's method, with slopes by differences."""
        state = {**state, "q": list(state["q"]), "qd": list(state["qd"])}
        for kind, residual, ending in (("q", "phi", ""), ("qd", "psi", "_d")):
            place = [i for i, name in enumerate(self.coordinates) if name + ending not in states]
            for _ in range(5 if place else 0):
                moved = [{**state, kind: [value + (1e-6 if i == place[0] else 0) * sign for i, value in enumerate(state[kind])]} for sign in (0, 1, -1)]
                now, up, down = ([value for value in self.evaluate(each)[residual] if value is not None][0] for each in moved)
                state[kind][place[0]] -= now / ((up - down) / 2e-6)
        return state

    def rates_and_outputs(self, states, change, tau):
        state = {**self.base, "q": list(self.base["q"]), "qd": list(self.base["qd"]), "inputs": {"tau": 0.3 + tau}}
        for name, value in zip(states, change):
            state["qd" if name.endswith("_d") else "q"][self.coordinates.index(name.removesuffix("_d"))] += value
        state = self.on_rows(state, states)
        found = self.evaluate(state)
        rates = dict(zip(self.coordinates, state["qd"])) | {f"{name}_d": value for name, value in zip(self.coordinates, found["qdd"])}
        point = found["points"]["T"]
        accelerations = numpy.array(point["C"]) @ found["qdd"] + point["d"]
        return numpy.array([rates[name] for name in states]), numpy.array([*point["r"], *point["rd"], *accelerations])


@pytest.mark.parametrize("level", LEVELS)
def test_a_moving_state(level, tmp_path):
    """A, B, C, D and `rate` against differences of the accelerations that `eval` computes on the rows, at a state that moves and accelerates."""
    nearby = Nearby(level, tmp_path)
    path = tmp_path / "base.json"
    path.write_text(json.dumps(nearby.base))
    found, _ = linear(ARM, "--at", path, level=level)
    states, size, lines = found["states"], len(found["states"]), []
    assert size == 6 - {"none": 0, "position": 2, "velocity": 1, "acceleration": 0}[level]
    columns = [(name, numpy.eye(size)[k] * 3e-5, 0.0) for k, name in enumerate(states)] + [("tau", numpy.zeros(size), 1e-3)]
    for k, (name, change, tau) in enumerate(columns):
        (up, out_up), (down, out_down) = (nearby.rates_and_outputs(states, sign * change, sign * tau) for sign in (1, -1))
        of_states, of_outputs = (found["A"][:, k], found["C"][:9, k]) if k < size else (found["B"][:, 0], found["D"][:9, 0])
        span = 2 * (tau or 3e-5)
        lines.append(close(f"A and B, column {name}", of_states, (up - down) / span, 1e-6, scale=max(abs(of_states).max(), 1)))
        lines.append(close(f"C and D, column {name}", of_outputs, (out_up - out_down) / span, 1e-6, scale=max(abs(of_outputs).max(), 1)))
    lines.append(close("rate", found["rate"], nearby.rates_and_outputs(states, numpy.zeros(size), 0.0)[0], 1e-10))
    check(lines)


@pytest.mark.parametrize("omega", [3.0, 17.0])
def test_frequency_response(omega):
    """Five outputs at each of two frequencies: a small sine of the input in `sim`, once transients are over."""
    found, _ = linear(ARM)
    amplitude, period, count = 1e-3, 2 * math.pi / omega, 64
    run, _, _ = motion(ARM, "--set", f"sine={amplitude}", "--set", f"omega={omega}", "--from", "statics", "--until", period * math.ceil(90 / period),
                 "--every", period / count, "--method", "rk8", "--tol", 1e-11)
    response = found["C"] @ numpy.linalg.solve(1j * omega * numpy.eye(len(found["A"])) - found["A"], found["B"]) + found["D"]
    lines = []
    for output in ("T_x", "T_yd", "T_xdd", "stretch", "pull"):
        last, at = numpy.array(run[output][-count:]), numpy.array(run["t"][-count:])
        seen = 2j * numpy.mean(last * numpy.exp(-1j * omega * at)) / amplitude  # of sin = Im e^(i omega t)
        expected = response[found["outputs"].index(output), 0] - found["D"][found["outputs"].index(output), 0] * (output == "pull")
        lines.append(close(f"{output} at {omega} rad/s", abs(seen - expected), 0.0, 1e-4, scale=abs(expected)))
    check(lines)


def test_held_coordinates_move_on_request():
    """With --move-held the holding forces stay, so that the state remains an equilibrium; the input then has an effect."""
    held, said = linear(REFERENCE, drive="input")
    assert "the input tau moves no state" in said and abs(held["B"]).max() == 0
    free, said = linear(REFERENCE, "--move-held", drive="input", program="none")
    assert "moves no state" not in said and len(free["states"]) == 2 * len(free["coordinates"])
    assert abs(numpy.array(free["rate"])).max() < 1e-9


def test_messages():
    for arguments, fact in ((ARM, "--set", "level=moved"), "the input tau moves this row, so that its rates would be inputs, too"), \
                           ((REFERENCE, "--set", "form=printed"), "linearise needs the corrected form"), \
                           ((ARM, "--hold", "arm_psy"), "the model has no coordinate 'arm_psy'; did you mean \"arm_psi\"?"):
        assert fact in refdyn("linearise", *arguments, status=1 if "--hold" not in arguments else 2).stderr
