"""How calls of Python read their arguments: containers with names, flags, names of files and of methods, and the message about each wrong one."""
import collections

import numpy as np
import pandas
import pytest
import xarray

from python_package import package, same  # noqa: F401 (a fixture)

RANDOM = np.random.default_rng(41)
SWING = '''local rd = require "refdyn"
local p = rd.parameters { { "load", 2, "kg" }, { "reach", 0.5, "m" }, { "drag", 0.3, "N m s" }, { "spare", 7 } }
local push, twist = rd.input("push", 1, "N"), rd.input("twist", 0.5, "N m")
return rd.model { name = "swing", gravity = { 0, 0, -9.81 },
  links = { { "rod", turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, mass = p.load, center = { p.reach, 0, 0 }, damper = { psi = p.drag }, spring = { psi = 40 } },
            { "tip", on = "rod", at = { 1, 0, 0 }, joint = { "psi" }, mass = 0.3, center = { 0.2, 0, 0 }, inertia = { zz = 0.01 }, spring = { psi = 3 } } },
  forces = function(s) return { tip_psi = push * rd.sin(s.q.rod_psi) + twist } end }'''
PARAMETERS, INPUTS = {"drag": 0.71, "load": 3.1}, {"twist": -0.83, "push": 1.37}  # in another order than the model's
Q, QD = np.array([0.31, 0.22]), np.array([0.13, -0.41])


@pytest.fixture(scope="module")
def swing(package):
    return package.Model.from_text(SWING)


# ---- Containers with names ----

def record(values):
    """A record of a structured array; its fields have different types."""
    return np.array([tuple(values.values())], dtype=[(name, "f8" if place else "f4") for place, name in enumerate(values)])[0]


def in_single(values):
    """The first value as `record` keeps it."""
    return {name: value if place else float(np.float32(value)) for place, (name, value) in enumerate(values.items())}


KINDS = {"series": pandas.Series, "row of a frame": lambda values: pandas.DataFrame([values]).iloc[0], "series of objects": lambda values: pandas.Series(values, dtype=object),
         "labelled array": lambda values: xarray.DataArray(list(values.values()), {"value": list(values)}, ("value",)), "dataset": xarray.Dataset,
         "record": record, "named tuple": lambda values: collections.namedtuple("Values", values)(**values), "dictionary": dict}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("ignore:.*(not an equilibrium|equilibrium is unstable):Warning")
def test_containers_with_names(swing, kind):
    """Every call takes the values by name, in any order and some of them only, as it takes those of a dictionary."""
    wrapped = KINDS[kind]
    parameters, inputs = (in_single(values) if kind == "record" else values for values in (PARAMETERS, INPUTS))
    p, x = wrapped(PARAMETERS), wrapped(INPUTS)
    values, numbers = {"parameters": p, "inputs": x}, {"parameters": parameters, "inputs": inputs}

    def motion(given):
        found = swing.motion(Q, QD, **given)
        found.advance(0.03)
        return found.state

    def changed(given):
        found = swing.motion(Q, QD)
        found.set(**given)
        return [*found.qdd, *found.inputs.values(), *found.parameters.values()]
    for call in (lambda given: swing.qdd(Q, QD, 0.2, **given), lambda given: swing.qdd([Q, QD], QD, 0.2, **given), lambda given: swing.step(Q, QD, 0, 0.01, **given),
                 lambda given: swing.step(Q, QD, 0, 0.01, **given, method="radau"), lambda given: swing.inverse_dynamics(Q, QD, Q, **given), motion, changed,
                 lambda given: swing.simulate(0.02, q=Q, qd=QD, every=0.02, **given).tip_psi, lambda given: swing.statics(**given).tip_psi,
                 lambda given: swing.modes(**given).frequency, lambda given: swing.linearise(**given).A):
        assert same(call(values), call(numbers)) and not same(call(values), call({}))


def test_frames_are_batches(swing):
    """A data frame and a structured array have a column for each name; their rows are the states of a batch."""
    columns = {"drag": RANDOM.uniform(0.1, 1, 3), "load": RANDOM.uniform(1, 4, 3)}
    table = np.zeros(3, dtype=[("drag", "f8"), ("load", "f8")])
    for name, values in columns.items():
        table[name] = values
    labelled = xarray.DataArray(list(columns.values()), {"name": list(columns), "case": [3, 4, 5]}, ("name", "case"))
    expected = swing.qdd(Q, QD, parameters=columns)
    assert np.allclose(expected, [swing.qdd(Q, QD, parameters={name: values[i] for name, values in columns.items()}) for i in range(3)], rtol=1e-12)
    for given in (pandas.DataFrame(columns, index=list("abc")), table, table.view(np.recarray), labelled, labelled.T):
        assert same(swing.qdd(Q, QD, parameters=given), expected) and same(swing.step(Q, QD, 0, 0.01, parameters=given), swing.step(Q, QD, 0, 0.01, parameters=columns))
    samples = {"twist": [0.3, -0.2], "t": [0, 0.01]}
    assert same(swing.simulate(0.02, every=0.02, inputs=pandas.DataFrame(samples)).tip_psi, swing.simulate(0.02, every=0.02, inputs=samples).tip_psi)


def test_containers_without_names(swing):
    """Numbered rows are arrays in the model's order."""
    expected = swing.qdd(Q, QD, inputs=[1.37, -0.83])
    for given in (pandas.Series([1.37, -0.83]), pandas.Series([1.37, -0.83], index=[7, 5]), xarray.DataArray([1.37, -0.83]), xarray.DataArray([1.37, -0.83], {"x": [0.1, 0.2]}, ("x",))):
        assert same(swing.qdd(pandas.Series(Q), QD, inputs=given), expected)
    assert same(swing.qdd(pandas.DataFrame([Q, QD]), inputs=pandas.DataFrame([[1.37, -0.83]] * 2)), swing.qdd([Q, QD], inputs=[1.37, -0.83]))
    assert same(swing.qdd(Q, QD, parameters={"load": pandas.Series([2.5, 3.5], index=["a", "b"])}), swing.qdd(Q, QD, parameters={"load": [2.5, 3.5]}))


@pytest.mark.filterwarnings("ignore:.*not an equilibrium:Warning")
def test_states_by_name(package, swing):
    """Coordinates, rates and accelerations by the names of all coordinates, or as columns of a motion are called."""
    def turned(values, suffix=""):
        return {f"tip_psi{suffix}": values[1], f"rod_psi{suffix}": values[0]}
    at = swing.motion(Q, QD)
    at.set(q=pandas.Series(turned(QD)), qd=turned(Q, "_d"))
    assert same(at.state, [QD, Q])
    for wrapped in (dict, pandas.Series):
        q, qd, rates = wrapped(turned(Q)), wrapped(turned(QD)), wrapped(turned(QD, "_d"))
        for each in (qd, rates):
            assert same(swing.qdd(q, each), swing.qdd(Q, QD)) and same(swing.step(q, each, 0, 0.01), swing.step(Q, QD, 0, 0.01)) and same(swing.motion(q, each).state, [Q, QD])
            assert same(swing.simulate(0.01, every=0.01, q=q, qd=each).tip_psi, swing.simulate(0.01, every=0.01, q=Q, qd=QD).tip_psi)
            assert same(swing.linearise(q=q, qd=each).A, swing.linearise(q=Q, qd=QD).A)
        assert same(swing.inverse_dynamics(q, qd, wrapped(turned(QD, "_dd"))), swing.inverse_dynamics(Q, QD, QD))
        assert same(swing.modes(q=q).frequency, swing.modes(q=Q).frequency) and same(swing.statics(q=q).tip_psi, swing.statics(q=Q).tip_psi)
    run = swing.simulate(0.02, every=0.01)
    frame = run.to_dataframe()[["tip_psi", "rod_psi", "rod_psi_d", "tip_psi_d"]]
    assert same(swing.qdd(frame.iloc[:, :2], frame.iloc[:, 2:]), swing.qdd(*swing.states(run)))
    motor = package.Model.from_text('''local rd = require "refdyn"
return rd.model { name = "motor", gravity = { 0, 0, 0 }, links = { { "cart", joint = "x", mass = 2 } },
  states = function(s) return { rd.state { "i", rate = 3 - s.states.i - s.qd.cart_x, unit = "A" } } end, forces = function(s) return { cart_x = s.states.i } end }''')
    for names in (("i", "cart_x"), ("i", "cart_x_d")):
        assert same(motor.qdd([0.3, 0], dict(zip(names, (0.7, 0.2)))), motor.qdd([0.3, 0], [0.2, 0.7]))


WRONG_NAMES = {
    "parameters: load is given twice; give it once": (ValueError, lambda m: m.qdd(Q, parameters=pandas.Series([1, 2], ["load", "load"]))),
    "inputs: push is given twice; give it once": (ValueError, lambda m: m.simulate(1, inputs=pandas.DataFrame([[1, 2]], columns=["push", "push"]))),
    "parameters: name 1; names must be texts": (TypeError, lambda m: m.statics(parameters=pandas.Series([1, 2], ["load", 1]))),
    "inputs: name ('push', 'N'); names must be texts": (TypeError, lambda m: m.motion(inputs=pandas.Series([1], pandas.MultiIndex.from_tuples([("push", "N")])))),
    "lod: unknown parameter; did you mean 'load'?": (ValueError, lambda m: m.step(Q, QD, 0, 0.1, parameters=pandas.Series({"lod": 1}))),
    "load: not an input but a parameter; give it in parameters={...}": (ValueError, lambda m: m.motion().set(inputs=pandas.Series({"load": 1}))),
    "parameter load: 3 values; must be one number": (ValueError, lambda m: m.simulate(1, parameters=pandas.DataFrame({"load": [1, 2, 3]}))),
    "q: no tip_psi; must have the model's coordinates, rod_psi, tip_psi, or be an array in their order": (ValueError, lambda m: m.qdd(pandas.Series({"rod_psi": 1.0}))),
    "qd: x: unknown coordinate; must have the model's coordinates, rod_psi, tip_psi, or be an array in their order": (
        ValueError, lambda m: m.simulate(1, q=Q, qd={"rod_psi": 1, "tip_psi": 2, "x": 3})),
    "q: no rod_psi; must have the model's coordinates, rod_psi, tip_psi, or be an array in their order": (ValueError, lambda m: m.motion(xarray.Dataset())),
    "q tip_psi: values of <U1; must be real numbers": (TypeError, lambda m: m.statics(q={"rod_psi": 1, "tip_psi": "2"})),
    "q: has shape (2, 2); must be one state, (2,)": (ValueError, lambda m: m.motion({"rod_psi": [1, 2], "tip_psi": 2})),
    "inputs: contains dict; must be real numbers; values of many by name are one dictionary of arrays": (TypeError, lambda m: m.step(Q, QD, 0, 0.1, inputs=[{"push": 1}] * 4)),
    "q: contains str; must be real numbers": (TypeError, lambda m: m.qdd(np.array(["1", 2], dtype=object))),
    "parameters: contains None; must be real numbers": (TypeError, lambda m: m.qdd(Q, parameters=[1, 2, None])),
}


def check_message(package, call, kind, message):
    with pytest.raises(Exception) as told:
        call()
    assert type(told.value) is kind and str(told.value) == message, f"{type(told.value).__name__}: {told.value}"


@pytest.mark.parametrize("message", WRONG_NAMES)
def test_wrong_names(package, swing, message):
    kind, call = WRONG_NAMES[message]
    check_message(package, lambda: call(swing), kind, message)
