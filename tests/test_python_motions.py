"""Motions, steps and equilibria in the process of Python, against the program and against each other."""
import json
import multiprocessing
import os
import pickle
import re
import resource
import signal
import threading
import time
import warnings

import numpy as np
import pytest

from python_package import package  # noqa: F401 (a fixture)
from program import MODELS, REFERENCE, SOURCE, TESTS, motion, refdyn

CONTACTS = TESTS / "models" / "contacts"
SIX_AXES = TESTS / "models" / "six_axes.lua"
SWING = '''local rd = require "refdyn"
local p = rd.parameters { { "mass", 2, "kg" } }
local push = rd.input("push", 0, "N m")
return rd.model { name = "swing", gravity = { 0, 0, -9.81 },
  links = { { "rod", turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, mass = p.mass, center = { 0.5, 0, 0 }, damper = { psi = 0.3 } },
            { "tip", on = "rod", at = { 1, 0, 0 }, joint = { "psi" }, mass = 0.5, center = { 0.3, 0.1, 0 } } },
  forces = function(s) return { rod_psi = push + 2 * rd.sin(3 * s.t) } end,
  events = function(s) return { rd.event { s.q.rod_psi + 1.3, name = "low", direction = "down" }, rd.event { s.t - 50, ends = true, name = "late" } } end }
'''
STOP = SWING.replace('direction = "down"', 'direction = "down", ends = true')
SMOOTH = re.sub(r"  events = .*\n", "}\n", SWING)


@pytest.fixture(scope="module")
def arm(package):
    return package.Model(REFERENCE)


@pytest.fixture(scope="module")
def swing(package):
    return package.Model.from_text(SWING)


@pytest.fixture(scope="module")
def smooth(package):
    return package.Model.from_text(SMOOTH)


def same(found, expected):
    return np.array_equal(np.asarray(found, float), np.array(expected, float), equal_nan=True)


def state(model, seed=1, size=0.2):
    random = np.random.default_rng(seed)
    return model.q0 + size * random.standard_normal(len(model.q0)), size * random.standard_normal(len(model.q0))


def by_program(package, call):
    """What a call computes where the program has to do it, with its warnings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(package.recorded, "is_in_process", lambda *_: False)
        patch.setattr(package.equilibria, "find", lambda *_: None)
        patch.setattr(package.equilibria, "modes", lambda *_: None)
        return told(call)


def told(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = call()
        except Exception as error:
            result = error
    return result, [str(warning.message) for warning in caught]


def known(attrs):
    """Attributes without times; the lists and objects in them are JSON."""
    return {key: json.loads(value) if isinstance(value, str) and value[:1] in "[{" else value for key, value in attrs.items() if key not in ("cpu_s", "wall_s")}


# ---- Simulations are those of the program ----

Q, QD = [0.01, 0.2, 0.6, 0.03], [0.1, -0.2, 0.3, 0.05]
SIMULATIONS = {
    "adaptive": (REFERENCE, {}, dict(t_end=0.1, tol=1e-7)),
    "rates": (REFERENCE, {"n_rfe": 1}, dict(t_end=0.1, tol_rates=1e-6)),
    "rk4": (REFERENCE, {"n_rfe": 1}, dict(t_end=0.1, step=1e-3, every=0.013)),
    "statics": (REFERENCE, {}, dict(t_end=0.05, from_="statics", every=0.01, parameters={"m_E": 2.3, "xc": 0.54})),
    "held": (REFERENCE, {}, dict(t_end=0.02, from_="statics", hold=["column_psi", "effector_z"], parameters={"m_E": 2.1})),
    "off the programme": (REFERENCE, {"n_rfe": 1}, dict(t_end=0.05, q=Q, qd=QD, t=0.3, method="rodas5p", stabilise="baumgarte-auto", tol=1e-5)),
    "projected": (REFERENCE, {"n_rfe": 1}, dict(t_end=0.35, q=Q, qd=QD, t=0.3, start="project")),
    "samples": (REFERENCE, {"n_rfe": 1, "drive": "input"}, dict(t_end=0.2, every=0.05, inputs={"t": [0.01, 0.11], "tau": [1.3, 3.1]}, stop=["t>0.17", "E_z>90"])),
    "constants": (SIX_AXES, {}, dict(t_end=0.1, inputs={"tau_lift": 33.0, "tau_pan": -2.0}, parameters={"payload": 2.7, "rho": 2500})),
    "contact": (CONTACTS / "ball.lua", {}, dict(t_end=3, every=0.1)),
    "loops": (MODELS / "stewart.lua", {}, dict(t_end=0.3)),
    "limits": (MODELS / "puma.lua", {}, dict(t_end=0.2, singular="pass")),
    "not resolved": (REFERENCE, {}, dict(t_end=1, step=1e-2)), "fails between outputs": (REFERENCE, {}, dict(t_end=1, step=1e-2, every=0.05)),
    "refused": (REFERENCE, {}, dict(t_end=1, parameters={"m_E": -0.3})),
    "unread": (SIX_AXES, {}, dict(t_end=0.01, parameters={"payload": 1.2})),
    "no column": (REFERENCE, {}, dict(t_end=1, stop="E_q<1")),
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_simulations_are_those_of_the_program(package, name):
    """Numbers, units, attributes, warnings and errors."""
    file, settings, arguments = SIMULATIONS[name]
    model = package.Model(file, **settings)
    (found, said), (expected, expected_said) = told(lambda: model.simulate(**arguments)), by_program(package, lambda: model.simulate(**arguments))
    assert said == expected_said
    if isinstance(expected, Exception):
        assert type(found) is type(expected) and str(found) == str(expected)
        assert getattr(found, "t", None) == getattr(expected, "t", None) and getattr(found, "reason", None) == getattr(expected, "reason", None)
        found, expected = getattr(found, "run", None), getattr(expected, "run", None)
        if expected is None:
            return
    assert list(found.variables) == list(expected.variables)
    for column in expected.variables:
        assert same(found[column], expected[column]), column
    if "steps" in expected.attrs:  # the rows of a failed motion have no summary, and by the program no units
        assert all(found[column].attrs == expected[column].attrs for column in expected.variables)
        assert known(found.attrs) == known(expected.attrs)


def test_simulation_runs_no_program(package, arm, monkeypatch):
    arm.simulate(0.01), arm.simulate(0.01, from_="statics"), arm.statics(), arm.modes()
    monkeypatch.setattr(package.program, "run", None)
    assert arm.simulate(0.02, tol=1e-5).sizes["t"] == 201 and arm.simulate(0.01, from_="statics").t[-1] == 0.01 and arm.statics().stability == "stable"
    assert arm.modes().sizes["mode"] == 9


def test_libraries_are_those_of_the_commands(tmp_path):
    """A motion of `sim` needs no further compilation after compile --for motion; likewise statics and modes."""
    for purpose, command in (("motion", ("sim", "--until", "0.01", "-o", os.devnull)), ("statics", ("statics",)), ("modes", ("modes",))):
        cache = {"REFDYN_CACHE": str(tmp_path / purpose)}
        library = json.loads(refdyn("compile", TESTS / "models" / "double_pendulum.lua", "--for", purpose, env=cache).stdout)["library"]
        refdyn(command[0], TESTS / "models" / "double_pendulum.lua", *command[1:], env=cache)
        assert [str(path) for path in (tmp_path / purpose).glob("*.so")] == [library]
    for message, words in {"--for: 'motions' is not one of motion, statics, modes": ("--for", "motions"),
                           "--for chooses the quantities itself; omit --emit": ("--for", "motion", "--emit", "M")}.items():
        done = refdyn("compile", SIX_AXES, *words, status=2)
        assert message in done.stderr


def test_columns_without_a_dataset(package, arm):
    plain, data = (arm.simulate(0.02, tol=1e-6, every=0.005, dataset=is_dataset) for is_dataset in (False, True))
    assert type(plain) is package.recorded.Columns and list(plain) == list(data.variables) and all(same(plain[name], data[name]) for name in plain)
    assert plain.attrs["steps"] == data.steps and plain.units["E_xd"] == "m/s" and "t" in plain
    program = arm.simulate(0.02, tol=1e-6, every=0.005, verify=True, dataset=False)
    assert same(program["E_z"], plain["E_z"]) and program.attrs["error"]


STATICS = {
    "default": (REFERENCE, {}, {}), "held": (REFERENCE, {}, dict(hold="column_psi,arm_psi", parameters={"m_E": 3.1, "xc": 0.54})),
    "free": (REFERENCE, {}, dict(hold="")), "unstable": (MODELS / "pendulum.lua", {}, dict(q=[2.9, 0.2])), "contact": (CONTACTS / "ball.lua", {}, {}),
    "loop": (MODELS / "slidercrank.lua", {}, dict(release=["guide y"])), "none": (MODELS / "fourbar.lua", {}, dict(way="downhill")),
    "refused": (REFERENCE, {}, dict(parameters={"m_E": -3})), "no name": (REFERENCE, {}, dict(hold="colum_psi")), "inputs": (SIX_AXES, {}, dict(hold="pan_psi", inputs={"tau_lift": 20})),
}


@pytest.mark.parametrize("name", STATICS)
def test_equilibria_are_those_of_the_program(package, name):
    file, settings, arguments = STATICS[name]
    model = package.Model(file, **settings)
    if name == "unstable":
        arguments = dict(q=state(model)[0])
    (found, said), (expected, expected_said) = told(lambda: model.statics(**arguments)), by_program(package, lambda: model.statics(**arguments))
    assert said == expected_said
    assert (type(found), str(found)) == (type(expected), str(expected)) if isinstance(expected, Exception) else found.identical(expected)


MODES = {
    "default": (REFERENCE, {}, {}), "first": (REFERENCE, {}, dict(modes=3, parameters={"m_E": 3.1, "xc": 0.54}, hold=["column_psi"])),
    "rigid motions": (MODELS / "spacearm.lua", {}, dict(at="initial")), "damped": (SIX_AXES, {}, dict(hold="pan_psi", inputs={"tau_lift": 3.0})),
    "redundant rows": (MODELS / "bricard.lua", {}, dict(at="initial")), "none": (MODELS / "gantry.lua", {}, {}), "loop": (MODELS / "slidercrank.lua", {}, {}),
    "printed": (REFERENCE, {"form": "printed"}, {}), "no name": (REFERENCE, {}, dict(hold="colum_psi")), "unbalanced": (SIX_AXES, {}, dict(q=np.linspace(0.1, 0.2, 14), t=0.3, inputs={"tau_pan": 1.5})),
}


@pytest.mark.parametrize("name", MODES)
def test_modes_are_those_of_the_program(package, name):
    """To rounding, since left vectors are computed in another way."""
    file, settings, arguments = MODES[name]
    model = package.Model(file, **settings)
    if name == "unbalanced":
        arguments = {**arguments, "q": state(model)[0]}
    (found, said), (expected, expected_said) = told(lambda: model.modes(**arguments)), by_program(package, lambda: model.modes(**arguments))
    assert said == expected_said
    if isinstance(expected, Exception):
        assert (type(found), str(found)) == (type(expected), str(expected))
        return
    assert same(found.q, expected.q) and {**found.attrs, "at": ""} == {**expected.attrs, "at": ""}
    assert np.allclose(found.eigenvalue, expected.eigenvalue, rtol=1e-10, atol=0)
    for variable in ("shape", "displacement", "frequency", "omega", "damping"):
        assert np.allclose(found[variable], expected[variable], rtol=1e-8, atol=1e-9) and found[variable].attrs == expected[variable].attrs


# ---- Motions ----

@pytest.mark.parametrize("method", ["rk4", "gauss12", "rodas5p"])
def test_motion_of_fixed_steps_is_that_of_the_program(arm, method):
    columns, _, _ = motion(REFERENCE, "--until", 0.05, "--step", 1e-4, "--method", method, "--every", 0.0125)
    found = arm.motion(method=method, step=1e-4)
    for row, t in enumerate(columns["t"][1:], 1):
        assert found.advance(t) and found.t == t
        assert same(found.q, [columns[name][row] for name in arm.coordinates]) and same(found.qdd, [columns[name + "_dd"][row] for name in arm.coordinates])
        assert same(found.force, [columns["force_" + name][row] for name in arm.coordinates])
    assert found.statistics["method"] == method and found.statistics["steps"] == 500


def test_default_of_fixed_steps(smooth):
    """At most 1 ms, in equal parts of the time between two outputs or of an advance."""
    motion = smooth.motion(method="rk4")
    for k, steps in enumerate((3, 6, 7)):
        motion.advance((2.3e-3, 4.6e-3, 5.1e-3)[k])
        assert motion.statistics["steps"] == steps
    for every, steps in ((None, 200), (3.5e-3, 12)):
        run = smooth.simulate(0.0105, method="rk4", every=every, dataset=False)
        assert run.attrs["steps"] == steps


def test_motion_with_tolerance(arm):
    """On the programme, and as accurate as the tolerance says."""
    rough, fine = arm.motion(tol=1e-6), arm.motion(tol=1e-10, method="rk8")
    for t in (0.03, 0.07, 0.2):
        rough.advance(t), fine.advance(t)
    assert np.abs(rough.q - fine.q).max() < 1e-5 and np.abs(arm.phi(rough.q, rough.qd, 0.2)).max() < 1e-12
    assert rough.statistics["rejected"] >= 0 and rough.statistics["phi_max"] < 1e-10


def test_motion_with_tolerance_of_rates(smooth):
    """Accelerations are much more accurate. Fixed steps, and a tolerance of 1, are refused."""
    plain, strict, fine = smooth.motion(), smooth.motion(tol_rates=1e-9), smooth.motion(tol=1e-13, method="rk8")
    for each in (plain, strict, fine):
        each.advance(0.37)
    far = [np.abs(each.qdd - fine.qdd).max() for each in (plain, strict)]
    assert far[1] < 1e-7 * np.abs(fine.qdd).max() and far[1] < 0.1 * far[0], far
    for given in (dict(step=0.01), dict(tol_rates=1), dict(method="rk4")):
        with pytest.raises(ValueError, match="tol_rates"):
            smooth.motion(**{"tol_rates": 1e-4, **given})


def test_events_of_a_motion(package, swing):
    fall = swing.motion([0.1, 0.2], [0, 0.4], method="rk8", tol=1e-10)
    assert fall.advance(2) and not fall.has_ended
    (t, name, kind), *_ = fall.events
    assert name == "low" and kind == ""
    before = swing.motion([0.1, 0.2], [0, 0.4], method="rk8", tol=1e-10)
    before.advance(t)
    assert abs(before.q[0] + 1.3) < 1e-8
    late = swing.motion(t=49.9)
    assert late.advance(49.95) and not late.advance(60) and late.has_ended and abs(late.t - 50) < 1e-9 and late.events[-1][1] == "late" and not late.advance(60)
    ball = package.Model(CONTACTS / "ball.lua").motion()
    ball.advance(3)
    assert [kind for _, _, kind in ball.events][0] == "impact" and ball.events[-1][2] == "rests" and abs(ball.events[0][0] - np.sqrt(2 / 9.81)) < 1e-9


def test_set(package, swing):
    """Inputs by name and as a row, parameters, the state."""
    free, pushed = (swing.motion(*state(swing), method="rk8", tol=1e-9) for _ in range(2))
    free.advance(0.3), pushed.advance(0.3)
    pushed.set(inputs={"push": 3.7})
    assert pushed.inputs == {"push": 3.7} and np.allclose(pushed.qdd, swing.qdd(pushed.q, pushed.qd, 0.3, inputs={"push": 3.7}), rtol=1e-12) and not np.allclose(pushed.qdd, free.qdd)
    free.set(inputs=[3.7], parameters={"mass": 2.9})
    assert free.parameters["mass"] == 2.9 and np.allclose(free.qdd, swing.qdd(free.q, free.qd, 0.3, inputs={"push": 3.7}, parameters={"mass": 2.9}), rtol=1e-12)
    q, qd = state(swing, 5)
    free.set(q=q)
    free.set(qd=qd)
    assert same(free.state, [q, qd])
    before = free.state, free.parameters
    with pytest.raises(package.ModelError, match=r"<text>:5: links\[1\].mass: value -1; must be positive"):
        free.set(parameters={"mass": -1.0})
    assert same(free.state, before[0]) and free.parameters == before[1] and free.advance(0.5)


def test_set_after_the_end(package):
    """A new state continues a motion that an event has ended, as a motion that begins there; its events stay. Other values do not."""
    stop = package.Model.from_text(STOP)
    motion = stop.motion(tol=1e-8, inputs=[-3.7])
    assert not motion.advance(2) and motion.has_ended
    t, events, ended = motion.t, motion.events, motion.copy()
    motion.set(inputs=[0.4], parameters={"mass": 1.7})
    assert motion.has_ended and not motion.advance(3) and motion.t == t
    q, qd = state(stop, 9, 0.3)
    motion.set(q=q, qd=qd)
    assert not motion.has_ended and motion.events == events and motion.t == t and same(motion.state, [q, qd])
    begun = stop.motion(q, qd, t, tol=1e-8, inputs=[0.4], parameters={"mass": 1.7})
    assert motion.advance(t + 0.2) and begun.advance(t + 0.2) and same(motion.state, begun.state)
    assert not motion.advance(t + 9) and not begun.advance(t + 9) and motion.t == begun.t and motion.events == events + begun.events
    assert ended.has_ended and ended.t == t
    ended.set(qd=-ended.qd)                                        # leaves the stop upwards, without an event
    assert ended.advance(t + 0.05) and ended.q[0] > -1.3
    with pytest.raises(package.NumericalError):
        motion.set(qd=[1e200, 0])
    assert motion.has_ended and motion.t == begun.t and same(motion.q, begun.q)
    motion.set(q=q, qd=qd)
    assert not motion.has_ended and motion.advance(motion.t + 0.1)


def test_copies_continue_with_the_same_numbers(arm, swing):
    """Of a motion with events, with memory of implicit steps, and in the middle of a step."""
    for model, options in ((swing, {"method": "rk8", "tol": 1e-8}), (arm, {"tol": 1e-6}), (arm, {"method": "gauss12", "tol": 1e-7}), (arm, {"method": "radau9", "step": 1e-3})):
        first = model.motion(*(state(model) if model is swing else ()), **options)
        first.advance(0.0537)
        second, third = first.copy(), first.copy()
        first.advance(0.1), second.advance(0.1)
        assert same(first.state, second.state) and first.events == second.events and first.statistics == second.statistics and third.t == 0.0537
        third.advance(0.1)
        assert same(first.state, third.state)


def test_copies_have_separate_events(swing):
    first, alone = (swing.motion([0.1, 0.2], [0, 0.4], method="rk8", tol=1e-9) for _ in range(2))
    second = first.copy()
    second.set(qd=[-2.0, 0.1])
    for each in (first, second, alone):
        each.advance(3)
    assert first.events == alone.events and len(second.events) > 0 and second.events[0][0] < first.events[0][0]


def test_failure_leaves_the_last_accepted_state(package, arm):
    failing = arm.motion(step=1e-2)
    with pytest.raises(package.NumericalError) as told:
        for k in range(1, 100):
            failing.advance(0.01 * k)
    assert 0 < told.value.t == failing.t < 0.1 and told.value.reason.startswith(("the mass matrix is not positive definite", "the equations gave an infinite or undefined value")) and np.isfinite(failing.state).all()
    failing.set(q=arm.q0, qd=arm.qd0)
    assert np.isfinite(failing.qdd).all()


def test_warnings_of_the_start(package):
    with pytest.warns(package.ModelWarning, match='the start is off the programme:\n  ellipse \\(position\\): phi') as told:
        package.Model(REFERENCE, n_rfe=1).motion(Q, QD)
    assert told[0].filename == __file__ and 'solve for a consistent start with start="project"' in str(told[0].message)


def test_motions_change_over(package, monkeypatch, tmp_path):
    """To the optimised library as soon as it is there, between calls and within one, with the same bits."""
    monkeypatch.setenv("REFDYN_CACHE", str(tmp_path))
    swing = package.Model.from_text(SMOOTH)
    running, compiled, end = swing.motion([0.4, 0.1], tol=1e-7), swing._purpose("motion"), 0.0
    first, before, until = compiled.library, swing.step([0.4, 0.1], [0, 0], 0, 0.01), time.monotonic() + 120
    while compiled.optimised and time.monotonic() < until:
        end += 0.001
        running.advance(end)
        time.sleep(0.02)
    assert compiled.library is not first or end == 0, "no optimised library"
    again, t = swing.motion([0.4, 0.1], tol=1e-7), 0.0
    while t < end:
        t += 0.001
        again.advance(t)
    running.advance(end + 0.1), again.advance(end + 0.1)
    assert same(running.state, again.state) and same(swing.step([0.4, 0.1], [0, 0], 0, 0.01), before)
    asked = []
    other = compiled._opened(compiled.description["library"])
    values, anchored = package.motion.values_of(compiled, {})
    core = compiled.library.motion(package.motion.options_of("rk8", 1e-12, None, None, None, None, None, None, False), values, anchored, compiled.x, (), lambda: asked.append(1) or other)
    core.start(0.0, None, None, np.inf, 0.0, (), None, None, None, (), 0, False)
    assert core.advance(200.0) is None and asked == [1] and core.t == 200


# ---- Steps ----

METHODS = {"rk4": 4, "rk54": 5, "rk8": 8, "gauss": 12, "radau": 9, "rodas5p": 5, "ros34pw2": 3}


@pytest.mark.parametrize("method", METHODS)
def test_steps_are_of_their_order(smooth, method):
    """The error of one step falls as h^(order + 1), and several steps in one call are those of several calls."""
    q, qd = state(smooth, 3, 0.5)
    h = {"rk8": 0.08, "gauss": 0.16, "radau": 0.16}.get(method, 0.05)
    errors = []
    for size in (h, h / 2):
        exact = np.ravel(smooth.step(q, qd, 0.2, size, [1.3], method="gauss", steps=40))
        errors.append(np.abs(np.ravel(smooth.step(q, qd, 0.2, size, {"push": 1.3}, method=method)) - exact).max())
    assert errors[0] < 1e-3 and (errors[0] < 1e-13 or np.log2(errors[0] / errors[1]) > METHODS[method] - 0.5), errors
    two = smooth.step(*smooth.step(q, qd, 0.2, h / 2, [1.3], method=method), 0.2 + h / 2, h / 2, [1.3], method=method)
    assert np.allclose(two, smooth.step(q, qd, 0.2, h, [1.3], method=method, steps=2), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("method, stabilise", [("rk4", None), ("rk8", None), ("rk4", "project"), ("gauss", None), ("rodas5p", "none")])
def test_steps_are_those_of_a_motion(package, method, stabilise):
    model = package.Model(SIX_AXES)
    q, qd = state(model, 2, 0.05)
    found = model.motion(q, qd, 0.4, method=package.motion.ALIASES.get(method, method), step=1e-4, stabilise=stabilise, inputs=np.arange(6.0))
    found.advance(0.4 + 3e-4)
    assert np.allclose(model.step(q, qd, 0.4, 3e-4, np.arange(6.0), method=method, steps=3, stabilise=stabilise), found.state, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("method", ["rk4", "gauss"])
def test_many_states(package, method):
    """A leading axis of any argument, one that is shared, and one axis that is broadcast."""
    model = package.Model(SIX_AXES)
    pairs = [state(model, seed, 0.05) for seed in range(11)]
    q, qd = (np.array(rows) for rows in zip(*pairs))
    t, tau, payload = np.linspace(0, 1, 11), np.random.default_rng(4).standard_normal((11, 6)), np.linspace(1, 2, 11)
    new = model.step(q, qd, t, 1e-4, tau, {"payload": payload}, method=method)
    for i in (0, 4, 10):
        one = model.step(*pairs[i], t[i], 1e-4, dict(zip(model.inputs, tau[i].tolist())), {"payload": payload[i]}, method=method)
        assert np.allclose([new[0][i], new[1][i]], one, rtol=1e-12, atol=1e-13)
    grid = model.step(q[0], qd[:3, np.newaxis], t[:2], 1e-4, method=method)
    assert grid[0].shape == (3, 2, len(q[0])) and np.allclose(grid[1][2, 1], model.step(q[0], qd[2], t[1], 1e-4, method=method)[1], rtol=1e-12)
    assert model.step(q[:0], qd[0], 0, 1e-4)[0].shape == (0, len(q[0]))


def test_arrays_of_inputs_and_parameters(arm, smooth):
    """Simulations, equilibria and modes read arrays in the model's order, as steps do; the start sets a value that is NaN."""
    names = {"inputs": dict(zip(smooth.inputs, [0.37])), "parameters": {name: 1.13 * value for name, value in smooth.parameters.items()}}
    arrays = {kind: np.array(list(values.values())) for kind, values in names.items()}
    for call in (lambda **given: smooth.simulate(0.05, every=0.01, **given), lambda **given: smooth.statics(hold="rod_psi", **given),
                 lambda **given: smooth.modes(at="initial", hold=[], **given)):
        found, other = call(**arrays), call()
        assert found.equals(call(**names)) and found.attrs["parameters"] == call(**names).attrs["parameters"] and not found.equals(other)
    p = np.array(list(arm.parameters.values()))
    p[list(arm.parameters).index("xc")] = np.nan
    assert arm.simulate(0.01, every=0.01, parameters=p, dataset=False)["E_z"][-1] == arm.simulate(0.01, every=0.01, dataset=False)["E_z"][-1]


def test_steps_keep_the_rows(package):
    """By projection to rounding; by the gains a state off the programme is pulled in; with none it stays off."""
    arm = package.Model(REFERENCE, n_rfe=1)
    q, qd = arm.q0.copy(), arm.qd0.copy()
    q[2] += 1e-4
    off = {how: (q, qd) for how in (None, "none", "project")}
    for k in range(500):
        off = {how: arm.step(*now, k * 1e-3, 1e-3, stabilise=how, method="rk4") for how, now in off.items()}
    phi = {how: abs(arm.phi(*now)[0]) for how, now in off.items()}
    assert phi["project"] < 1e-13 and phi[None] < 0.2 * phi["none"], phi


def test_steps_through_events(package):
    """A model with events steps through them."""
    ball = package.Model(CONTACTS / "ball.lua")
    q, qd = ball.q0, ball.qd0
    for k in range(100):
        q, qd = ball.step(q, qd, 0.01 * k, 0.01, method="rk8")
    single = ball.motion(method="rk8", tol=1e-10)
    single.advance(1.0)
    assert q[0] >= -1e-9 and abs(q[0] - single.q[0]) < 1e-6


@pytest.mark.parametrize("method", ["rk4", "ros34pw2"])
def test_steps_that_an_event_ends(package, method):
    """The result is the state at the event, with a warning; the state stays there in later steps, whose warnings have one text."""
    stop = package.Model.from_text(STOP)
    q, qd = state(stop, 5, 0.1)
    q[0] = -1.2
    motion = stop.motion(q, qd - 1, 0.3, method=method, step=0.01)
    assert not motion.advance(0.7) and 0.31 < motion.t < 0.69
    (new, new_d), said = told(lambda: stop.step(q, qd - 1, 0.3, 0.4, method=method, steps=40))
    assert said == [f"step: the event low has ended the motion at t + {motion.t - 0.3:g} s; the result is the state there"]
    assert abs(new[0] + 1.3) < 1e-12 and np.allclose([new, new_d], motion.state, rtol=1e-9, atol=1e-11)
    after = [told(lambda k=k: stop.step(new, new_d, 0.7 + 0.1 * k, 0.1, method=method)) for k in range(3)]
    assert all(np.allclose(found, [new, new_d]) for found, _ in after)
    assert [said for _, said in after] == 3 * [["step: the event low has ended the motion at t + 0 s; the result is the state there"]]
    many = np.array([q, q, [0.2, 0.1]]), np.array([qd, qd - 1, qd])
    found, said = told(lambda: stop.step(*many, 0.3, 0.2, method=method, steps=20))
    one, _ = told(lambda: stop.step(q, qd - 1, 0.3, 0.2, method=method, steps=20))
    assert len(said) == 1 and re.fullmatch(r"step: events have ended 1 of 3 motions; the first is \(1,\), by low at t \+ 0\.\d+ s; the result is the state there", said[0]), said
    assert np.array_equal([found[0][1], found[1][1]], one) and told(lambda: stop.step(q, qd, 0.3, 0.001, method=method))[1] == []


# ---- States that cannot be stepped ----

FAILING = {
    "lanes": (REFERENCE, {"n_rfe": 3}, {}, "the state after the step is not finite", "undefined there; use more steps, or method="),
    "lanes, forces without time": (SMOOTH.replace(" + 2 * rd.sin(3 * s.t)", ""), {}, {}, "the state after the step is not finite", "undefined there; use more steps, or method="),
    "implicit with rows": (REFERENCE, {"n_rfe": 3}, {"method": "gauss"}, "the equations gave an infinite", "a shorter h or more steps may help, or arm.motion"),
    "projections": (REFERENCE, {"n_rfe": 3}, {"stabilise": "project"}, "the equations gave an infinite", "a shorter h or more steps may help, or arm.motion"),
    "implicit": (SMOOTH, {}, {"method": "ros34pw2"}, "the equations gave an infinite", "a shorter h or more steps may help, or arm.motion"),
    "events": (SWING, {}, {}, "the equations gave an infinite", "a shorter h or more steps may help, or arm.motion"),
}


@pytest.mark.parametrize("kind", FAILING)
def test_states_that_cannot_be_stepped(package, kind):
    """In a batch they are NaN after the step, with one warning; a single one raises an error. The other states are those of single steps."""
    source, options, how, reason, remedy = FAILING[kind]
    model = package.Model.from_text(source) if isinstance(source, str) else package.Model(source, **options)
    q, qd = np.tile(model.q0, (2, 3, 1)), np.tile(model.qd0, (2, 3, 1))
    qd[0, 2] = qd[1, 0] = 1e200
    q[0, 1, 0], qd[1, 1, 1], t = np.nan, np.inf, np.zeros((2, 3))
    t[1, 2] = -np.inf
    with pytest.warns(package.ModelWarning) as caught:
        found = model.step(q, qd, t, 1e-5, **how)
    first, second, *rest = str(caught[0].message).split("\n")
    assert len(caught) == 1 and caught[0].filename == __file__
    assert first == "step: 3 of 6 states are not finite before the step, and NaN after it"
    assert second.startswith(f"step: 2 of 6 states are NaN after a failure; the first is (0, 2): {model._name}: t = 0 s: {reason}")
    assert len(rest) == 1 and remedy in rest[0], rest
    good = model.step(model.q0, model.qd0, 0, 1e-5, **how)
    for new, one in zip(found, good):
        assert np.allclose(new[0, 0], one, rtol=1e-12, atol=1e-13) and np.isnan(np.delete(new.reshape(6, -1), 0, axis=0)).all()
    again, said = told(lambda: model.step(*found, 1e-5, 1e-5, **how))
    assert said == ["step: 5 of 6 states are not finite before the step, and NaN after it"] and np.isfinite(again[0][0, 0]).all()
    with pytest.raises(package.NumericalError, match=re.escape(remedy)) as raised:
        model.step(q[0, 2], qd[0, 2], 0.2, 1e-5, **how)
    assert raised.value.t == 0.2 and raised.value.reason.startswith(reason)
    for name, given in {"q": (q[0, 1], qd[0, 0], 0), "qd": (q[0, 0], qd[1, 1], 0), "t": (q[0, 0], qd[0, 0], np.nan)}.items():
        with pytest.raises(ValueError, match=f"^{name}: contains (nan|inf); all numbers must be finite"):
            model.step(*given, 1e-5, **how)


def test_steps_that_are_too_long(package):
    """Explicit steps grow without bounds, and end in an error; implicit ones of the same length do not."""
    arm = package.Model(REFERENCE, n_rfe=3)

    def unstable(method):
        q, qd = arm.q0, arm.qd0
        for k in range(40):
            q, qd = arm.step(q, qd, 0.02 * k, 0.02, method=method, steps=2)
        return q
    with pytest.raises(package.NumericalError) as raised:
        unstable("rk54")
    assert str(raised.value).splitlines()[1] == '0.01 s is too long for rk54, or the equations are undefined there; use more steps, or method="ros34pw2" or "rodas5p"'
    assert np.isfinite(unstable("rodas5p")).all()


def test_steps_off_the_programme(package):
    """The error shows the given state and says that it is off the programme."""
    reach = package.Model.from_text(re.sub(r"  forces = .*\n", """  points = { E = { on = "tip", at = { 0.6, 0, 0 } } },
  constraints = function(s) return { rd.position { s.points.E.x - 1.3 - 2 * s.t, name = "reach" }, rd.position { s.points.E.z - 0.6, name = "level" } } end }
""", SMOOTH.replace('local push = rd.input("push", 0, "N m")\n', "")).rsplit("}\n", 1)[0])
    q, qd = np.array([0.31, 0.73]), np.array([0.2, -0.1])
    with pytest.raises(package.NumericalError, match="did not converge") as raised:
        reach.step(q, qd, 0.3, 0.002, method="ros34pw2")
    phi, psi = np.abs(reach.phi(q, t=0.3)).max(), np.abs(reach.psi(q, qd, 0.3)).max()
    assert str(raised.value).splitlines()[1:] == ["  q: rod_psi = 0.31, tip_psi = 0.73", "  qd: rod_psi_d = 0.2, tip_psi_d = -0.1",
        f'the given state is off the programme (largest |phi| {phi:.4g}, |psi| {psi:.4g}); arm.motion(q, qd, t, start="project") finds the nearest state on it']
    with pytest.raises(package.NumericalError, match="a shorter h or more steps may help"):  # fails before the check whether the state is on the programme
        reach.step(q, [1e200, 0], 0.3, 0.002, method="ros34pw2")


@pytest.mark.parametrize("eta, limit", [(1e-6, 2.83), (1e-4, 2.785)])
def test_modes_that_steps_resolve(package, eta, limit):
    """rk4 is stable below its limit divided by the largest eigenvalue of the free robot, whose mode oscillates or, with more damping, does not.
    That the robot falls is no reason to warn."""
    beam = {"section": "tube:0.043:0.031", "E": 7.1e10, "rfe": 3, "tip": [0.13, -0.27, 0.19], "eta": eta}
    robot = package.Model.from_urdf(TESTS / "robots" / "two.urdf", {"fore": beam})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        modes = robot.modes(at="initial", hold=[])
    fastest = np.abs(modes.eigenvalue.values).max()
    assert (modes.frequency.values[-1] == 0) == (limit < 2.8)
    with pytest.warns(package.ModelWarning, match="this state is not an equilibrium: elbow"):
        robot.modes(at="initial", hold="shoulder")

    def bent(part):
        q, qd = robot.q0, robot.qd0
        for _ in range(300):
            q, qd = robot.step(q, qd, 0, part * limit / fastest)
        return np.abs(q[2:]).max()
    assert bent(0.9) < 1e-3
    with pytest.raises(package.NumericalError, match="too long for rk4"):
        bent(1.1)


# ---- Wrong calls ----

WRONG = {
    "; did you mean 'rk54'?": lambda m: m.motion(method="RK45"),
    "; did you mean 'radau'?": lambda m: m.step([1, 2], [1, 2], 0, 0.1, method="radau5"),
    "method: 'rk5' is not one of auto, rk4, rk54": lambda m: m.motion(method="rk5"),
    "tol: '-1' is not a positive number": lambda m: m.motion(tol=-1),
    "step sets fixed steps and tol adaptive ones; omit one of them": lambda m: m.motion(tol=1e-3, step=1e-3),
    "tol: rk4 has fixed steps; use step": lambda m: m.motion(method="rk4", tol=1e-3),
    "stabilise: 'gains' is not one of none, baumgarte, baumgarte-auto, project": lambda m: m.motion(stabilise="gains"),
    "q: has shape (3,); must be one state, (2,)": lambda m: m.motion([1, 2, 3]),
    "qd: contains nan; all numbers must be finite": lambda m: m.motion([1, 2], [0, np.nan]),
    "t: contains inf; all numbers must be finite": lambda m: m.motion(t=np.inf),
    "pusch: unknown input; did you mean 'push'?": lambda m: m.motion(inputs={"pusch": 1}),
    "inputs: have shape (2,); a motion needs one value each": lambda m: m.motion(inputs={"push": [1, 2]}),
    "mass: not an input but a parameter; give it in parameters={...}": lambda m: m.motion().set(inputs={"mass": 1}),
    "inputs: have shape (3,); must have shape (1,)": lambda m: m.motion().set(inputs=np.ones(3)),
    "parameter mass: contains nan; all numbers must be finite": lambda m: m.motion().set(parameters={"mass": np.nan}),
    "t: 0.1 is before the motion's time 0.2; must not be earlier": lambda m: advanced(m, 0.2).advance(0.1),
    "t: inf; must be finite": lambda m: m.motion().advance(np.inf),
    "t: nan; must be finite": lambda m: m.motion().advance(np.nan),
    "q: has shape (1,); its last axis must have 2 entries": lambda m: m.step([1], [1, 2], 0, 1),
    "h: -0.1 is not a positive number": lambda m: m.step([1, 2], [1, 2], 0, -0.1),
    "steps: 0; must be at least 1": lambda m: m.step([1, 2], [1, 2], 0, 0.1, steps=0),
    "method: 'auto' has no fixed steps; use one of rk4, rk54": lambda m: m.step([1, 2], [1, 2], 0, 0.1, method="auto"),
    "inputs: has shape (2,); its last axis must have 1 entries (push)": lambda m: m.step([1, 2], [1, 2], 0, 0.1, np.ones(2)),
    "input push: contains nan; all numbers must be finite": lambda m: m.step([1, 2], [1, 2], 0, 0.1, {"push": np.nan}),
    "shape mismatch: the leading axes qd (2,), qdd (3,) cannot be broadcast": lambda m: m.inverse_dynamics(np.ones(2), np.ones((2, 2)), np.ones((3, 2))),
    "shape mismatch: the leading axes q (2,), t (3,) cannot be broadcast": lambda m: m.step(np.ones((2, 2)), np.ones(2), np.zeros(3), 0.1),
}
WRONG_TYPES = {
    "q: values of complex128; must be real numbers": lambda m: m.motion([1j, 2]),
    "t: values of <U1; must be real numbers": lambda m: m.motion().advance("1"),
    "at: ndarray; must be a name or a file; give a state as q=": lambda m: m.modes(at=np.zeros(2)),
    "steps: float; must be a whole number": lambda m: m.step([1, 2], [1, 2], 0, 0.1, steps=4.0),
    "steps: bool; must be a whole number": lambda m: m.step([1, 2], [1, 2], 0, 0.1, steps=True),
    "qd: values of <U1; must be real numbers": lambda m: m.step([1, 2], ["1", "2"], 0, 0.1),
    "inputs: values of complex128; must be real numbers": lambda m: m.motion().set(inputs=np.ones(1) * 1j),
    "parameters: str; must be values by name, {'NAME': value}": lambda m: m.motion(parameters="1"),
    "hold: 3; must be a text or a list of texts": lambda m: m.statics(hold=3),
    "release: [1]; must be a text or a list of texts": lambda m: m.modes(release=[1]),
    "hold: array('rod_psi', dtype='<U7'); must be a text or a list of texts": lambda m: m.statics(hold=np.array("rod_psi")),
    "hold: b'rod_psi'; must be a text or a list of texts": lambda m: m.linearise(hold=b"rod_psi"),
    "stop: None; must be a text or a list of texts": lambda m: m.simulate(1, stop=None),
    "derivatives: 2; must be a text or a list of texts": lambda m: m.simulate(1, derivatives=2),
    "a motion cannot be pickled: it has memory of C; pickle motion.state": lambda m: pickle.dumps(m.motion()),
}


def advanced(model, t):
    found = model.motion()
    found.advance(t)
    return found


@pytest.mark.parametrize("message", WRONG)
def test_wrong_values(smooth, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        WRONG[message](smooth)


@pytest.mark.parametrize("message", WRONG_TYPES)
def test_wrong_types(smooth, message):
    with pytest.raises(TypeError, match=re.escape(message)):
        WRONG_TYPES[message](smooth)


# ---- Interrupts, threads, processes, memory ----

def interrupt_after(seconds):
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_interrupts(package, arm):
    """Ctrl-C keeps the rows that were computed, and a motion at its last state."""
    arm.simulate(0.01)  # compiles
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt) as told:
        interrupt_after(0.3)
        arm.simulate(1e4, tol=1e-8, every=0.01)
    assert time.monotonic() - began < 5 and told.value.run.sizes["t"] > 1 and np.isfinite(told.value.run.E_z).all() and told.value.run.t[-1] < 1e4
    stepped = arm.motion(tol=1e-8)
    with pytest.raises(KeyboardInterrupt):
        interrupt_after(0.3)
        stepped.advance(1e4)
    t = stepped.t
    assert 0 < t < 1e4 and np.isfinite(stepped.state).all() and stepped.advance(t + 1e-3) and stepped.t == t + 1e-3


@pytest.mark.parametrize("method, copies", [("rk4", None), ("rk4", 5), ("gauss", None), ("ros34pw2", 2)])
def test_interrupts_of_steps(arm, method, copies):
    """Ctrl-C stops a call of many steps; the next call has the numbers of an undisturbed one."""
    q = arm.q0 if copies is None else np.tile(arm.q0, (copies, 1))
    expected = arm.step(q, arm.qd0, 0, 1e-3, method=method, steps=5)
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupt_after(0.3)
        arm.step(q, arm.qd0, 0, 1e4, method=method, steps=10**9)
    assert time.monotonic() - began < 30
    assert all(map(np.array_equal, arm.step(q, arm.qd0, 0, 1e-3, method=method, steps=5), expected))


@pytest.mark.parametrize("size, call", [(200, lambda beam: beam.statics(way="downhill")), (120, lambda beam: beam.modes(at="initial", hold=[]))], ids=["statics", "modes"])
def test_interrupts_of_equilibria(package, size, call):
    """Ctrl-C stops them early; measured in CPU time, which two threads at once do not disturb. Then they compute as before."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        beam = package.Model(TESTS / "models" / "cantilever.lua", n_rfe=size, P=4.7)
    expected, began = call(beam), time.thread_time()
    call(beam)
    whole, other = time.thread_time() - began, []
    thread = threading.Thread(target=lambda: other.append(call(beam)))
    thread.start()
    began = time.thread_time()
    with pytest.raises(KeyboardInterrupt):  # the signal may come before the call on a busy machine
        interrupt_after(0.1 * whole)
        call(beam)
    assert time.thread_time() - began < 0.7 * whole
    thread.join()
    assert other[0].equals(expected) and call(beam).equals(expected)


def test_threads(arm):
    """Motions of 16 threads have the numbers of one; C computes while another thread runs."""
    def run(seed, results):
        found = arm.motion(method="rk8", tol=1e-6, parameters={"m_E": 2 + 0.1 * seed})
        for t in (0.01, 0.02, 0.03):
            found.advance(t)
        q, qd = found.state
        for k in range(50):
            q, qd = arm.step(q, qd, 0.03 + k * 1e-5, 1e-5)
        results[seed] = np.array([q, qd])
    expected, found = {}, {}
    for seed in range(16):
        run(seed, expected)
    threads = [threading.Thread(target=run, args=(seed, found)) for seed in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same(found[seed], expected[seed]) for seed in range(16))


def test_one_thread_at_a_time(arm):
    shared, refused, count = arm.motion(tol=1e-9), [], 0
    thread = threading.Thread(target=shared.advance, args=(0.5,))
    thread.start()
    while thread.is_alive():
        count += 1
        try:
            shared.q
        except RuntimeError as error:
            refused.append(str(error))
    assert refused and count > 100 and set(refused) == {"motion: another thread is computing with it; give each thread its own, motion.copy()"} and shared.t == 0.5


def forked(t):
    INHERITED[0].advance(t)
    return INHERITED[0].state


INHERITED = []


def test_fork(smooth):
    INHERITED[:] = [smooth.motion([0.3, 0.1], tol=1e-6)]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        first, second = pool.map(forked, [0.5, 0.5], chunksize=1)[:2]
    alone = INHERITED[0].copy()
    alone.advance(0.5)
    assert same(alone.state, first) and INHERITED[0].t == 0 and second.shape == (2, 2)


def test_memory_does_not_grow(smooth):
    """1e5 steps, and thousands of motions, simulations, equilibria and errors."""
    def work(count):
        q, qd = smooth.q0, smooth.qd0
        for k in range(count):
            q, qd = smooth.step(q, qd, 0.0, 1e-3, np.ones(1))
        for k in range(count // 50):
            stepped = smooth.motion()
            stepped.copy().advance(0.01)
            stepped.set(inputs={"push": 1})
            smooth.simulate(0.01, every=0.005, dataset=False)
            with pytest.raises(ValueError):
                stepped.advance(-1)
        for k in range(count // 500):
            smooth.statics(hold="rod_psi,tip_psi")
    work(5000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    work(100_000)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 3000, "kB"


def test_statistics_and_repr(swing):
    found = advanced(swing, 0.3)
    assert repr(found) == "<refdyn.Motion of swing at t = 0.3 s>" and {"steps", "evaluations", "method"} <= set(found.statistics) and "cpu_s" not in found.statistics
    assert json.dumps(found.statistics) and found.state.shape == (2, 2) and found.q.shape == found.qdd.shape == found.force.shape == (2,)


HUB = SOURCE / "docs" / "drives" / "hub_link.lua"


def test_drives(package):
    """`realise` returns the numbers, the report and the messages of `refdyn sim --realise`."""
    import xarray
    link = package.Model(HUB, n_rfe=5)
    arguments = ("--every", 1e-2, "--realise", "--before", 0.3, "--after", 0.2, "--mesh", 0.04)
    expected, _, summary = motion(HUB, "--set", "n_rfe=5", "--until", 1, *arguments)
    options = {"every": 1e-2, "realise": True, "before": 0.3, "after": 0.2, "mesh": 0.04}
    columns = link.simulate(1, dataset=False, **options)
    assert set(columns) == set(expected) and all(same(columns[name], expected[name]) for name in columns)
    run = link.simulate(1, **options)
    assert isinstance(run, xarray.Dataset) and run.drive_hub_psi.attrs["units"] == "N m" and run.tip_x.attrs["units"] == "m" and same(run.drive_hub_psi, expected["drive_hub_psi"])
    assert json.loads(run.realise) == summary["realise"]
    with pytest.raises(package.ModelError, match="too rough for the drives") as refused:
        package.Model(HUB, degree=3).simulate(1, every=1e-2, realise=True)
    assert refused.value.line == 34
    with pytest.raises(ValueError, match="^before needs realise=True$"):
        link.simulate(1, before=0.1)
    with pytest.raises(ValueError, match="^realise=True excludes accuracy$"):
        link.simulate(1, realise=True, accuracy=1e-3)


def test_drives_over_loads(package):
    """`batch` with `realise`: the numbers of the report are variables on the axes of the grid, and one warning lists the reasons of refused cases."""
    link = package.Model(HUB, n_rfe=4)
    options = {"every": 1e-2, "realise": True, "before": 0.3, "after": 0.2}
    runs = link.batch(package.grid(m_tip=[0.07, 0.13], T=[0.9, 1.0]), 1, keep={"history": ["drive_hub_psi"], "limits": True}, threads=2, **options)
    one = link.simulate(1, parameters={"m_tip": 0.13, "T": 0.9}, **options)
    report = json.loads(one.realise)
    assert runs.peak_hub_psi.dims == ("m_tip", "T") and runs.peak_hub_psi.attrs["units"] == "N m"
    assert float(runs.peak_hub_psi[1, 0]) == report["peak"]["hub_psi"] and float(runs.playback_error[1, 0]) == report["playback_error"] < 2e-4
    assert same(runs.drive_hub_psi_history[1, 0], one.drive_hub_psi) and float(runs.limit_drive_hub_psi_beyond_s[0, 1]) == 0
    with pytest.warns(package.ModelWarning, match="1 of 2 cases failed(?s:.*)the residual of polar is 0.2"):
        assert list(link.batch({"hub_psi": [0, 0.2]}, 1, **options).status) == [0, 1]
    assert list(link.batch({"m_tip": [0.1]}, 1, from_="held", **options).status) == [0]
    with pytest.raises(ValueError, match="^from_: 'held' is not one of initial, statics, and not a file"):
        link.batch({"m_tip": [0.1]}, 1, from_="held")
