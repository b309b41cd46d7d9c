"""Random scenes of contacts whose loads jump, by callers: `motion.set` in Python, batches side by side, and FMUs. Each is compared with a tight run
that stops at each jump; no contact pulls."""
import random

import numpy as np
import pytest

from program import LONG, motion
from python_package import package  # noqa: F401: a fixture
from random_scenes import RestingScene
from test_fmi import Instance, export, fmpy  # noqa: F401: fmpy is a fixture

UNTIL, EVERY, TOL = 1.5, 0.05, 1e-6
TIMES = EVERY * np.arange(1, 31)
METHODS = ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
# Many tolerances of ros34pw2 add up in these motions.
ALLOWED = {"ros34pw2": 100}


def reference(scene, folder):
    """A tight motion, and its outputs before the third impact of rods and tables, whose order a small error changes."""
    model = folder / "scene.lua"
    model.write_text(scene.text())
    found, _, summary = motion(model, "--until", UNTIL, "--every", EVERY, "--method", "rk8", "--tol", 1e-11)
    impacts = [mark["t"] for mark in summary["events"] if mark.get("contact") == "impact"]
    last = impacts[2] if len(impacts) > 2 and not scene.is_steady else np.inf
    return found, [k for k in range(len(TIMES)) if TIMES[k] < last - 1e-3]


def rows_of(model, states):
    """The states of motions that end at each output: (output, coordinate)."""
    return dict(zip(model.coordinates, np.array(states)[:, 0, :].T))


def is_near(found, expected, outputs, allowed):
    for name, values in found.items():
        error = np.abs(np.asarray(values)[outputs] - expected[name][1:][outputs])
        assert error.size == 0 or error.max() < allowed, (name, error.max())


@pytest.mark.parametrize("seed", range(300 if LONG else 4))
def test_loads_set_on_the_way(package, seed, tmp_path):  # noqa: F811
    """The caller sets what jumps at a time, and also sets or copies at other times, at rest and in flight."""
    expected, outputs = reference(RestingScene(seed), tmp_path)
    scene, rng = RestingScene(seed, by_caller=True), random.Random(seed)
    model = package.Model.from_text(scene.text())
    for method in METHODS if LONG else [METHODS[seed % len(METHODS)]]:
        one, states = model.motion(method=method, tol=TOL), []
        for t in sorted({*TIMES, *(at for at, _, _, _ in scene.schedule), *(rng.uniform(0, UNTIL) for _ in range(10))}):
            one.advance(t)
            if t in TIMES:
                states.append(one.state)
            for _, name, _, value in [jump for jump in scene.schedule if jump[0] == t]:
                one.set(inputs={name: value})
            if t not in TIMES:
                one = one.copy() if rng.random() < 0.5 else one
                one.set(inputs=one.inputs, parameters=one.parameters)
        is_near(rows_of(model, states), expected, outputs, ALLOWED.get(method, 10) * TOL)


@pytest.mark.parametrize("seed", range(300 if LONG else 2))
def test_batches(package, seed, tmp_path):  # noqa: F811
    """Cases whose jumps happen at different times, alone and side by side."""
    scene = RestingScene(seed)
    _, outputs = reference(scene, tmp_path)
    model = package.Model.from_text(scene.text())
    contacts = [f"contact_c{k}" for k in range(len(scene.contacts))]
    rates = np.linspace(0.97, 1.03, 5)
    start = model.motion().qd
    for method, lanes in zip(random.Random(seed).sample(METHODS, 2), (1, 4)):
        found = model.batch({"k_x_d": rates}, UNTIL, keep={"at": list(TIMES), "extremes": contacts}, method=method, lanes=lanes, tol=TOL)
        assert (found["status"] == 0).all() and all((found[f"{name}_min"] >= 0).all() for name in contacts)
        for case in (0, 2, 4):
            begin = np.array(start)
            begin[model.coordinates.index("k_x")] = rates[case]
            tight = model.simulate(UNTIL, 1e-11, method="rk8", every=EVERY, qd=begin)
            is_near({name: found[f"{name}_at"][case] for name in model.coordinates}, tight, outputs, ALLOWED.get(method, 10) * TOL)


def signal_of(schedule):
    """The inputs as samples of an importer: at each jump the values before and after it."""
    times = sorted({0.0, UNTIL, *(t for t, _, _, _ in schedule)})
    rows = [(t, *(after if (t, side) >= (at, 1) else before for at, _, before, after in schedule)) for t in times for side in (0, 1)]
    return np.array(rows, dtype=[("time", float)] + [(name, float) for _, name, _, _ in schedule])


def stepped(one, schedule, names):
    """The states of Co-Simulation at the outputs; its steps also end at the jumps."""
    states, last = [], 0.0
    for t in sorted({*TIMES, *(at for at, _, _, _ in schedule)}):
        one.fmu.doStep(last, t - last)
        last = t
        if t in TIMES:
            states.append(one.get(names))
        for _, name, _, value in [jump for jump in schedule if jump[0] == t]:
            one.set(name, value)
    return dict(zip(names, np.array(states).T))


SET_BY_CALLERS = [seed for seed in range(300) if RestingScene(seed, by_caller=True).schedule]


@pytest.mark.parametrize("seed", SET_BY_CALLERS if LONG else SET_BY_CALLERS[:2])
def test_fmus(fmpy, seed, tmp_path):  # noqa: F811
    expected, outputs = reference(RestingScene(seed), tmp_path)
    scene, model = RestingScene(seed, by_caller=True), tmp_path / "resting.lua"
    model.write_text(scene.text())
    names = [name for name in expected if name + "_d" in expected]
    version = ("2.0", "3.0")[SET_BY_CALLERS.index(seed) % 2]
    files = fmpy.extract(str(export(model, version, tmp_path / "resting.fmu", "--tol", TOL)), str(tmp_path / "files"))
    is_near(stepped(Instance(fmpy, files, False), scene.schedule, names), expected, outputs, 10 * TOL)
    result = fmpy.simulate_fmu(files, fmi_type="ModelExchange", stop_time=UNTIL, output_interval=EVERY, relative_tolerance=1e-9, output=names,
                               input=signal_of(scene.schedule), record_events=False)
    is_near({name: np.interp(TIMES, result["time"], result[name]) for name in names}, expected, outputs, 1000 * TOL)
