"""What Python shows of a model and a motion: read-only attributes, views that can be pickled, and arrays and frames of any layout."""
import copy
import importlib
import io
import pickle
import re

import numpy as np
import pandas
import pytest

from python_package import package, same  # noqa: F401 (a fixture)
from test_python_arguments import INPUTS, PARAMETERS, Q, QD, SWING

RANDOM = np.random.default_rng(48)


@pytest.fixture(scope="module")
def swing(package):
    return package.Model.from_text(SWING)


# ---- Read-only attributes; times as an index; arrays of any layout ----

ASSIGNMENTS = {
    "motion.q[0] = 5": ValueError, "motion.state[1] = 0": ValueError, "motion.qdd[:] = 0": ValueError, "motion.force[0] = 1": ValueError,
    "motion.q = [1, 2]": AttributeError, "motion.t = 3": AttributeError, "motion.velocity = 1": AttributeError, "del motion.t": AttributeError,
    "motion.inputs['push'] = 1": TypeError, "motion.parameters.update(load=3)": TypeError, "motion.states.clear()": TypeError,
    "model.q0[0] = 1": ValueError, "model.load = 3": AttributeError, "model.parameters['load'] = 3": TypeError, "model.inputs.pop('push')": TypeError,
    "model.options['n'] = 3": TypeError, "model.units |= {}": TypeError, "del model.units['rod_psi']": TypeError, "model.qdd.unit = 'm'": AttributeError,
    "model.limits.upper[0] = 1": ValueError, "model.limits.upper = 1": AttributeError, "model.limits.units['rod_psi']['upper'] = 'm'": TypeError,
}


@pytest.mark.parametrize("assignment", ASSIGNMENTS)
def test_assignments_without_effect_are_errors(swing, assignment):
    with pytest.raises(ASSIGNMENTS[assignment]):
        exec(assignment, {"model": swing, "motion": swing.motion(Q, QD)})


def test_errors_about_assignments_name_the_remedy(swing):
    motion = swing.motion(Q, QD)
    with pytest.raises(AttributeError, match=re.escape("speed: a motion is changed by motion.advance(t) and motion.set(...)")):
        motion.speed = 1
    with pytest.raises(TypeError, match=re.escape("inputs: these values are read-only; use motion.set(inputs={...})")):
        motion.inputs["push"] = 2


@pytest.mark.parametrize("name", ["parameters", "inputs", "options", "units", "limits", "joints", "q0", "coordinates"])
def test_views_are_copied_and_pickled(swing, name):
    view = getattr(swing, name)
    for other in (pickle.loads(pickle.dumps(view)), copy.deepcopy(view), copy.copy(view)):
        assert type(other) is type(view) and (np.array_equal(other, view) if name == "q0" else other == view)
    motion = swing.motion(Q, QD)
    assert pickle.loads(pickle.dumps(motion.inputs)) == motion.inputs == copy.deepcopy(motion.inputs)


def test_dir_lists_what_users_need(package, swing):
    motion = swing.motion(Q, QD)
    for shown in (dir(swing), dir(motion), dir(swing.limits), dir(swing.qdd)):
        assert not [name for name in shown if name.startswith("_")]
    assert {"simulate", "qdd", "parameters"} <= set(dir(swing)) and {"advance", "set", "q", "events"} <= set(dir(motion))
    assert set(dir(package)) == {*package.__all__, "__version__"}


@pytest.mark.filterwarnings("ignore:this state is not an equilibrium")
def test_strided_states(swing):
    """A column of an array is a state for every call."""
    columns = RANDOM.normal(size=(2, 3))
    q, qd = columns[:, 1], 0.3 * columns[:, 2]
    row, rates = q.copy(), qd.copy()
    assert not q.flags.c_contiguous
    assert same(swing.qdd(q, qd), swing.qdd(row, rates)) and same(swing.inverse_dynamics(q, qd, qd), swing.inverse_dynamics(row, rates, rates))
    for found, expected in ((swing.step(q, qd, 0.2, 0.01), swing.step(row, rates, 0.2, 0.01)), (swing.motion(q, qd).state, swing.motion(row, rates).state)):
        assert same(found, expected)
    assert swing.simulate(0.2, q=q, qd=qd).equals(swing.simulate(0.2, q=row, qd=rates))
    assert swing.linearise(q=q).equals(swing.linearise(q=row)) and swing.statics(q=q).equals(swing.statics(q=row)) and swing.modes(q=q).equals(swing.modes(q=row))


def test_frames_indexed_by_time(swing):
    times = np.array([0, 0.07, 0.15])
    frame = pandas.DataFrame({"t": times, "push": RANDOM.normal(size=3)})
    assert swing.simulate(0.2, inputs=frame.set_index("t")).equals(swing.simulate(0.2, inputs=frame))
    data = swing.simulate(1, every=0.1).to_dataframe()[["rod_psi", "tip_psi"]]
    settings = {"vary": {"load": (1, 3)}, "noise": {"rod_psi": 1e-4, "tip_psi": 1e-4}, "parameters": {"load": 1.8}}
    assert data.index.name == "t"
    assert swing.fit(data, **settings).parameters == swing.fit(data.reset_index(), **settings).parameters == pytest.approx({"load": 2}, rel=1e-3)


def test_fast_and_general_calls_agree(swing):
    """One state in rows of doubles takes a short way through C; lists take the general one."""
    qdd, p = RANDOM.normal(size=2), np.array([1.7, 0.4, 0.2])
    for settings in ({}, {"inputs": INPUTS}, {"parameters": PARAMETERS}, {"inputs": np.array([0.3, -1.2]), "parameters": p}):
        assert same(swing.inverse_dynamics(Q, QD, qdd, 0.3, **settings), swing.inverse_dynamics(list(Q), list(QD), list(qdd), 0.3, **settings))
        for method in ("rk4", "rk8"):
            assert same(swing.step(Q, QD, 0.3, 0.01, **settings, method=method, steps=3), swing.step(list(Q), list(QD), 0.3, 0.01, **settings, method=method, steps=3))


def test_a_program_without_stderr(package, monkeypatch):
    """A program without a console has no sys.stderr. Notices of the program then go nowhere, and the other text is kept."""
    program, said = importlib.import_module("refdyn.program"), []
    monkeypatch.setattr("sys.stderr", None)
    program.listen(io.BufferedReader(io.BytesIO(b"refdyn: compiling arm.c ...\nrefdyn: warning: arm.lua: slow\n")), said)
    assert program.NOTICE.search(b"refdyn: compiling arm.c ...\n") and said == [b"refdyn: warning: arm.lua: slow\n"]


def test_step_limit(package, swing):
    motion = swing.motion(Q, QD, step_limit=7)
    with pytest.raises(package.NumericalError, match="the limit on the number of steps was reached"):
        motion.advance(30)
    assert 0 < motion.t < 30 and motion.statistics["steps"] + motion.statistics["rejected"] == 7


def test_set_by_dictionary_and_by_series(package, swing):
    """A dictionary of numbers takes the short way, a series the general one. A refused value leaves the motion as it was on both."""
    motions = [swing.motion(Q, QD), swing.motion(Q, QD)]
    for motion, container in zip(motions, (dict, pandas.Series)):
        motion.advance(0.2)
        motion.set(inputs=container(INPUTS), parameters=container({"load": 1.3}))
        before = motion.state, motion.qdd, dict(motion.parameters), dict(motion.inputs)
        with pytest.raises(package.ModelError, match="value -1; must be positive"):
            motion.set(inputs=container({"push": 0.1}), parameters=container({"load": -1.0}))
        for now, then in zip((motion.state, motion.qdd), before):
            assert same(now, then)
        assert (motion.parameters, motion.inputs) == before[2:] and motion.inputs["push"] == INPUTS["push"]
        motion.advance(0.5)
    assert same(motions[0].state, motions[1].state)
