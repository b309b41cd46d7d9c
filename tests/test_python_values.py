"""Inputs and parameters of Python's quantities: by name and as arrays, for one state and many, and what such a call costs."""
import collections
import pickle
import re
import time
import warnings

import numpy as np
import pytest

from program import REFERENCE, SANITIZED, TESTS, evaluate
from python_package import package, same  # noqa: F401 (a fixture)

RANDOM = np.random.default_rng(29)


@pytest.fixture(scope="module")
def arm(package):
    return package.Model(REFERENCE, n_rfe=1, drive="input")


@pytest.fixture(scope="module")
def swing(package):
    """The values `at` and `level` at the start depend on the input f. Only a course reads `gain`."""
    return package.Model.from_text('''local rd = require "refdyn"
local p = rd.parameters { { "gain", 1.5 }, { "m", 2, "kg" }, { "L", 0.5, "m" }, { "c", 0.3, "N m s" }, { "unread", 7 } }
local f, g = rd.input("f", 1, "N"), rd.input("g", 0.5, "N m")
return rd.model { name = "swing", gravity = { 0, 0, -9.81 },
  links = { { "rod", turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, mass = p.m, center = { p.L, 0, 0 }, damper = { psi = p.c } },
            { "tip", on = "rod", at = { 1, 0, 0 }, joint = { "psi" }, mass = 0.3, center = { 0.2, 0, 0 }, inertia = { zz = 0.01 } } },
  forces = function(s) return { tip_psi = f * rd.sin(s.q.rod_psi) + g } end,
  constraints = function(s) return { rd.position { s.q.rod_psi - rd.parameter("at", 0.1 * s.start.inputs.f, "rad"), alpha = 1, beta = 2 } } end,
  courses = function(s) return { level = p.gain * s.q.tip_psi + rd.parameter("level", 0.2 * s.start.inputs.f, "rad") } end }''')


def state(model):
    return model.q0 + 0.1 * RANDOM.standard_normal(len(model.q0)), 0.5 * RANDOM.standard_normal(len(model.q0))


def row(values, **changed):
    """An array in the model's order."""
    return np.array(list({**values, **changed}.values()))


def test_arrays_equal_values_by_name(arm, swing):
    for model, inputs, parameters in ((arm, {"tau": 2.7}, {"m_E": 2.3, "a": 0.9}), (swing, {"g": -0.8, "f": 1.3}, {"c": 0.7})):
        q, qd = state(model)
        free = row(model.parameters, **parameters, **dict.fromkeys(("xc",) if model is arm else ("at", "level"), np.nan))
        for quantity in (model.qdd, model.Q, model.k, model.constrained):
            by_name = quantity(q, qd, 0.3, inputs, parameters)
            by_array = quantity(q, qd, 0.3, row(model.inputs, **inputs), free)
            parts = by_name if isinstance(by_name, dict) else {None: by_name}
            assert all(same(by_array if name is None else by_array[name], value) for name, value in parts.items())
        q, qd = q + np.zeros((3, 1, 1)), qd + np.zeros((5, 1))
        many, x = model.qdd(q, qd, 0.3, row(model.inputs, **inputs), free), np.tile(row(model.inputs, **inputs), (3, 5, 1))
        assert many.shape == (3, 5, len(model.q0)) and same(many, model.qdd(q, qd, 0.3, inputs, parameters))
        assert same(many, model.qdd(q[0, 0], qd[0], 0.3, x, free)) and same(many, model.qdd(q, qd, 0.3, x, np.tile(free, (5, 1))))
        assert np.allclose(many[1, 2], model.qdd(q[0, 0], qd[0], 0.3, inputs, parameters), rtol=1e-11)


def test_arrays_against_the_program(arm):
    q, qd = state(arm)
    given = {"m_E": 2.9, "a": 0.93, "xc": 0.51}
    told = evaluate(REFERENCE, {"t": 0.2, "q": q.tolist(), "qd": qd.tolist(), "inputs": {"tau": -1.7}, "parameters": given}, "--set", "drive=input", "--set", "n_rfe=1")
    assert same(arm.Q(q, qd, 0.2, [-1.7], row(arm.parameters, **given)), told["Q"]) and same(arm.k(q, qd, 0.2, [-1.7], row(arm.parameters, **given)), told["k"])


def test_each_state_has_its_inputs_and_parameters(arm, swing):
    for model in (arm, swing):
        q, qd = state(model)
        x = row(model.inputs) + RANDOM.standard_normal((7, len(model.inputs)))
        p = row(model.parameters) * (1 + 0.01 * RANDOM.standard_normal((7, len(model.parameters))))
        for inputs, parameters in ((x, None), (None, p), (x, p), (x, {"m_E" if model is arm else "m": p[:, 0]})):
            many = model.qdd(q, qd, 0.1, inputs, parameters)
            one = [model.qdd(q, qd, 0.1, None if inputs is None else inputs[i], parameters if parameters is None else {name: value[i] for name, value in parameters.items()}
                   if isinstance(parameters, dict) else parameters[i]) for i in range(7)]
            assert many.shape == (7, len(model.q0)) and np.allclose(many, one, rtol=1e-9, atol=1e-12)


def test_values_at_the_start_of_a_motion(swing):
    """They follow the inputs by name and as arrays; a number in an array stays, NaN leaves the value to the start."""
    assert dict(swing.parameters) == {"gain": 1.5, "m": 2, "L": 0.5, "c": 0.3, "at": 0.1, "level": 0.2}
    half = row(swing.parameters, at=0.3, level=np.nan)
    assert swing.course([0.7, 0.1], inputs=[3, 0], parameters=half)[0] == 1.5 * 0.1 + 0.2 * 3 and swing.phi([0.7, 0.1], inputs=[3, 0], parameters=half)[0] == 0.7 - 0.3
    for inputs in ({"f": 3}, [3, 0.5], np.array([3.0, -1]), {"f": [3, 3]}, np.array([[3, 0.5], [3, 9]])):
        assert np.allclose(swing.phi([0.7, 0], inputs=inputs), 0.4, rtol=1e-14)
    assert swing.phi([0.7, 0], inputs=[3, 0.5], parameters=row(swing.parameters))[0] == 0.7 - 0.1
    assert np.allclose(swing.phi([0.7, 0], inputs=[[2, 0], [3, 0]], parameters=np.array([row(swing.parameters, at=np.nan), row(swing.parameters, at=0.2)]))[:, 0], [0.5, 0.5])


def test_another_library_reads_arrays_in_the_same_order(swing):
    """d_qdd reads other parameters than the functions that are emitted by default."""
    assert [entry["name"] for entry in swing._library("d_qdd", False).description["parameters"]] == ["m", "L", "c", "at"]
    q, qd = state(swing)
    for quantity in (swing.d_qdd, swing.d_rows):
        found, expected = quantity(q, qd, 0, [1.3, 0.2], row(swing.parameters, L=0.6)), quantity(q, qd, 0, {"f": 1.3, "g": 0.2}, {"L": 0.6, "at": 0.1})
        assert all(same(found[name], expected[name]) for name in expected)
    qdd, x, p = swing.qdd(q, qd, 0, [1.3, 0.2]), np.array([[1.3, 0.2], [0.1, 7]]), row(swing.parameters)
    assert same(swing.inverse_dynamics(q, qd, qdd, 0, x[0], p), swing.inverse_dynamics(q, qd, qdd, 0, {"f": 1.3, "g": 0.2}, {"at": 0.1}))
    assert swing.inverse_dynamics(q, qd, qdd, 0, x, p).shape == (2, 2)
    free = row(swing.parameters, at=np.nan, level=np.nan)
    for many in (free, np.tile(free, (2, 1))):
        assert np.allclose(swing.d_qdd(q, qd, 0, [3, 0], many)["q"], swing.d_qdd(q, qd, 0, [3, 0])["q"], rtol=1e-12)
        with pytest.raises(ValueError, match="parameters: contains nan; all numbers must be finite"):
            swing.d_qdd(q, qd, 0, None, many * np.where(np.arange(free.size) == 0, np.nan, 1))
    assert same(swing.d_qdd(q, qd, parameters={"unread": 3})["q"], swing.d_qdd(q, qd)["q"])


def test_numbers_of_any_kind(arm):
    q, qd = state(arm)
    expected = arm.qdd(q, qd, 0, {"tau": 2.0}, {"m_E": 3.0})
    p = row(arm.parameters, m_E=3, xc=np.nan)
    mapping = collections.UserDict(tau=2)
    for inputs in ({"tau": 2}, {"tau": np.float32(2)}, {"tau": np.float64(2)}, {"tau": np.array(2)}, [2], (2.0,), np.array([2]), np.array([2.0, 9])[::2], np.array([2.0], dtype=">f8"), mapping, {"tau": True + 1}):
        for parameters in ({"m_E": 3}, {"m_E": np.int64(3)}, p, p.tolist(), np.stack([p, p], axis=1)[:, 0]):
            assert same(arm.qdd(q, qd, 0, inputs, parameters), expected)


def test_arguments_stay_as_they_are(arm):
    q, qd = state(arm)
    x, p = np.array([2.5]), row(arm.parameters, xc=np.nan)
    arm.qdd(q, qd, 0, x, p)
    arm.qdd([q, q], qd, 0, x, p)
    assert same(x, [2.5]) and same(p, row(arm.parameters, xc=np.nan))


def test_listed_quantities_exist(arm, swing, package):
    """dir() has exactly the quantities of the model; the error about another one says what it needs."""
    bare = package.Model.from_text('local rd = require "refdyn"\nreturn rd.model { name = "bare", gravity = { 0, 9.81, 0 }, links = { { "rod", joint = { "psi" }, mass = 1, center = { 1, 0, 0 } } } }')
    for model, names in ((bare, [*bare._known, *bare._lacks]), (swing, [*swing._known, *swing._lacks]), (arm, arm._lacks)):
        for name in names:
            assert (name in dir(model)) == hasattr(model, name) == (name not in model._lacks), name
    assert "force" in dir(arm) and "course" in dir(swing) and "r" not in dir(swing)
    for name, needs in {"force": "constraints", "r": "points", "J": "points with angular = true", "course": "courses", "d_force": "constraints in the corrected form"}.items():
        with pytest.raises(AttributeError, match=f"^<text>: the model has no {name}; it needs {needs}$"):
            getattr(bare, name)
    with pytest.raises(AttributeError, match="'Model' object has no attribute 'focre'$"):
        bare.focre


WRONG = {
    "tau_: unknown input; did you mean 'tau'?": (ValueError, {"tau_": 1}, None),
    "input tau: contains inf; all numbers must be finite": (ValueError, {"tau": np.inf}, None),
    "input tau: contains an integer that is too large; all numbers must be finite": (ValueError, {"tau": 10**400}, None),
    "input tau: values of complex128; must be real numbers": (TypeError, {"tau": 1j}, None),
    "inputs: has shape (2,); its last axis must have 1 entries (tau)": (ValueError, [1, 2], None),
    "inputs: float64; must be an array in the order of the model's inputs, or values by name, {'NAME': value}": (TypeError, np.float64(1), None),
    "inputs: str; must be an array": (TypeError, "tau", None),
    "inputs: contains nan; all numbers must be finite": (ValueError, np.array([np.nan]), None),
    "inputs: values of complex128; must be real numbers": (TypeError, np.array([1j]), None),
    "parameters: has shape (3,); its last axis must have": (ValueError, None, [1, 2, 3]),
    "parameters: contains inf; all numbers must be finite": (ValueError, None, np.inf),
    "parameters: contains nan; all numbers must be finite": (ValueError, None, np.nan),
    "links[4].mass: value -1; must be positive": (ValueError, None, -1.0),
    "parameter m_E: contains inf; all numbers must be finite": (ValueError, None, {"m_E": np.inf}),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_values(arm, message):
    """The same message for one state and for many. A number stands for an array of parameters with this m_E."""
    kind, inputs, parameters = WRONG[message]
    parameters = row(arm.parameters, m_E=parameters) if isinstance(parameters, float) else parameters
    for q in (arm.q0, np.tile(arm.q0, (3, 1))):
        with pytest.raises(kind, match=re.escape(message)):
            arm.qdd(q, inputs=inputs, parameters=parameters)


def test_one_bad_row_among_many(arm):
    bad = np.tile(row(arm.parameters), (4, 1))
    bad[2, list(arm.parameters).index("m_E")] = -0.25
    with pytest.raises(ValueError, match=r"links\[4\].mass: value -0.25; must be positive"):
        arm.qdd(arm.q0, parameters=bad)
    with pytest.raises(ValueError, match=re.escape("shape mismatch: the leading axes inputs (3,), parameters (4,) cannot be broadcast")):
        arm.qdd(arm.q0, inputs=np.zeros((3, 1)), parameters=bad)


@pytest.mark.parametrize("name", ["contacts/jaws", "events/pendulum"])
def test_batches_of_a_model_with_events(name, package):
    """It has no lanes: each state of a batch has the bits of a single call."""
    model = package.Model(TESTS / "models" / f"{name}.lua")
    q, qd = (start + 0.05 * RANDOM.standard_normal((5, len(start))) for start in (model.q0, model.qd0))
    for quantity in (model.qdd, model.M, model.energy):
        assert same(quantity(q, qd, 0.2), [quantity(*state, 0.2) for state in zip(q, qd)])
    many, one = model.event_terms(q, qd, 0.2), model.event_terms(q[3], qd[3], 0.2)
    assert all(same(many[part][3], one[part]) for part in one)


@pytest.mark.filterwarnings("ignore:.*(start is far|do not balance|not an equilibrium|equilibrium is unstable):Warning")
def test_arrays_of_a_motion(arm, swing):
    """Motions, equilibria and modes take rows of all parameters. Only a parameter that the start of a motion sets may be NaN."""
    changed = row(swing.parameters, c=0.7, at=np.nan, level=np.nan)
    for call in (lambda given: swing.simulate(0.1, every=0.1, inputs=[3.0, 0.2], parameters=given, dataset=False)["tip_psi"],
                 lambda given: swing.motion(inputs=[3.0, 0.2], parameters=given).qdd, lambda given: swing.statics(inputs=[0.3, 0.2], parameters=given).tip_psi,
                 lambda given: swing.modes("initial", parameters=given).frequency):
        assert same(call(changed), call({"c": 0.7}))
        with pytest.raises(ValueError, match="^parameter m: contains nan; all numbers must be finite$"):
            call(row(swing.parameters, m=np.nan))
        with pytest.raises(ValueError, match="^parameter c: contains inf; all numbers must be finite$"):
            call({"c": np.inf})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        swing.motion(q=[0.1, 0.2], parameters={"gain": 2.0}).set(parameters=row(swing.parameters))  # only a course reads gain
    by_array, by_name = arm.motion(tol=1e-7), arm.motion(tol=1e-7)
    for motion, given in ((by_array, row(arm.parameters, m_E=2.9, xc=np.nan)), (by_name, {"m_E": 2.9})):
        motion.advance(0.05)
        motion.set(parameters=given)
        motion.advance(0.1)
    assert same(by_array.state, by_name.state) and by_array.parameters == by_name.parameters
    with pytest.raises(ValueError, match=re.escape(f"parameters: have shape (2,); must have ({len(arm.parameters)},), one number for each of the model's parameters")):
        by_array.set(parameters=[1.0, 2.0])
    for warned in (lambda: swing.motion(parameters={"unread": 3}), lambda: swing.motion().set(parameters={"unread": 3})):
        with pytest.warns(Warning, match="^unread: nothing in this model reads it$"):
            warned()


def test_a_file_that_is_gone(package, tmp_path):
    """The model keeps its text, also in a pickle, which may be loaded where the file never was."""
    file = tmp_path / "slide.lua"
    file.write_text('return require "refdyn".model { name = "slide", links = { { "cart", joint = "x", mass = 2.5, damper = { x = 0.7 } } } }')
    model = package.Model(file)
    sent = pickle.dumps(model)
    file.unlink()
    for other in (lambda: model, lambda: pickle.loads(sent)):
        with pytest.warns(package.ModelWarning, match="slide.lua: the file can no longer be read; the model stays as it was$"):
            found = other().d_qdd([0.1], [0.3])
        assert found["qd"] == [[-0.7 / 2.5]]


def test_the_nearest_name(package):
    """If names differ in small and capital letters alone, those of the given name count."""
    from refdyn.names import nearest
    assert [nearest(name, known) for name in ("elbo", "ELBO", "Wrst") for known in (["elbow", "ELBOW", "wrist"], ["ELBOW", "wrist", "elbow"])] == ["elbow", "elbow", "ELBOW", "ELBOW", "wrist", "wrist"]
    assert nearest("xyz", ["elbow"]) is None


def test_a_model_without_inputs(package):
    bare = package.Model(REFERENCE, n_rfe=1)
    assert same(bare.M(bare.q0, inputs=[]), bare.M(bare.q0)) and same(bare.M(bare.q0, inputs=np.zeros((2, 0)))[1], bare.M(bare.q0[None])[0])
    with pytest.raises(ValueError, match=re.escape("inputs: has shape (1,); its last axis must have 0 entries")):
        bare.M(bare.q0, inputs=[1.0])


@pytest.mark.skipif(SANITIZED, reason="times")
def test_what_a_call_with_values_costs(arm):
    """At most 2 us more than a call without, in alternating rounds: the least of all rounds, so that a busy machine does not matter."""
    q, qd = state(arm)
    x, p = np.array([2.5]), row(arm.parameters)
    calls = {"plain": lambda: arm.qdd(q, qd, 0.3), "array": lambda: arm.qdd(q, qd, 0.3, x), "name": lambda: arm.qdd(q, qd, 0.3, {"tau": 2.5}),
             "parameters": lambda: arm.qdd(q, qd, 0.3, None, p), "parameter": lambda: arm.qdd(q, qd, 0.3, None, {"m_E": 2.5})}
    least = dict.fromkeys(calls, np.inf)
    for _ in range(40):
        for name, call in calls.items():
            start = time.thread_time()
            for _ in range(200):
                call()
            least[name] = min(least[name], (time.thread_time() - start) / 200)
    assert max(least.values()) - least["plain"] < 2e-6, least
