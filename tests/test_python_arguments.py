"""How calls of Python read their arguments: containers with names, flags, names of files and of methods, and the message about each wrong one."""
import collections
import inspect
import re

import numpy as np
import pandas
import pytest
import xarray

from program import refdyn
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
    "inputs: contains dict; must be real numbers; give values of many states by name as one dictionary of arrays": (TypeError, lambda m: m.step(Q, QD, 0, 0.1, inputs=[{"push": 1}] * 4)),
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


# ---- Values that the model refuses ----

def calls_with(parameters):
    return {"qdd": lambda m: m.qdd(Q, QD, parameters=parameters), "inverse": lambda m: m.inverse_dynamics(Q, QD, Q, parameters=parameters), "step": lambda m: m.step(Q, QD, 0, 0.01, parameters=parameters),
            "implicit step": lambda m: m.step(Q, QD, 0, 0.01, parameters=parameters, method="gauss"), "motion": lambda m: m.motion(parameters=parameters),
            "set": lambda m: m.motion().set(parameters=parameters), "simulate": lambda m: m.simulate(0.1, parameters=parameters),
            "program": lambda m: m.simulate(0.1, parameters=parameters, verify=True), "statics": lambda m: m.statics(parameters=parameters),
            "modes": lambda m: m.modes(parameters=parameters), "linearise": lambda m: m.linearise(parameters=parameters)}


@pytest.mark.parametrize("call", calls_with(None))
def test_refused_values_are_one_error(package, swing, call):
    """A ModelError, which is a ValueError, with the line of the model and the same text in all calls."""
    with pytest.raises(package.ModelError) as told:
        calls_with({"load": -1.5})[call](swing)
    assert str(told.value) == "<text>:5: links[1].mass: value -1.5; must be positive" and (told.value.file, told.value.line) == ("<text>", 5)
    assert isinstance(told.value, ValueError)


def test_refused_values_of_a_batch(package, swing):
    """The message names the first state with such values."""
    loads = np.array([[1.0, 2.0, 3.0], [4.0, -5.0, 6.0]])
    for call in (lambda given: swing.qdd(Q, QD, parameters=given), lambda given: swing.step(Q, QD, 0, 0.01, parameters=given), lambda given: swing.step(Q, QD, 0, 0.01, parameters=given, method="radau"),
                 lambda given: swing.d_qdd(Q, QD, parameters=given)):
        for values, state in ((loads, "(1, 1)"), (loads[1], "(1,)")):
            p = np.tile(list(swing.parameters.values()), (*values.shape, 1))
            p[..., list(swing.parameters).index("load")] = values
            for given in ({"load": values}, p):
                with pytest.raises(package.ModelError) as told:
                    call(given)
                assert str(told.value) == f"state {state}: <text>:5: links[1].mass: value -5; must be positive" and (told.value.file, told.value.line) == ("<text>", 5)
    with pytest.raises(package.ModelError, match="^<text>:5: links"):
        swing.qdd([Q, Q], QD, parameters={"load": -1.0})


# ---- Wrong arguments ----

METHODS = "rk4, rk54, rk8, rodas5p, rodas6p, radau9, gauss12, ros34pw2, gauss, radau"
FLAGS = {
    "dataset": lambda m, value: m.simulate(0.1, dataset=value), "realise": lambda m, value: m.simulate(0.1, realise=value), "verify": lambda m, value: m.simulate(0.1, verify=value),
    "fold": lambda m, value: m.simulate(0.1, fold=value), "move_held": lambda m, value: m.linearise(move_held=value), "pull": lambda m, value: m.live(pull=value),
    "check": lambda m, value: m.fit(check=value, vary=["load"], noise={"tip_psi": 1}), "progress": lambda m, value: m.plan(vary={"load": (1, 2)}, t_end=1, minimise="load", progress=value),
    "keep: limits": lambda m, value: m.batch({"load": [1]}, 0.1, keep={"limits": value}), "keep: final": lambda m, value: m.batch({"load": [1]}, 0.1, keep={"final": value}),
}


@pytest.mark.parametrize("name", FLAGS)
def test_flags(package, swing, name):
    for value, shown in (("no", "'no'"), (1, "1"), (0.0, "0.0"), (np.array([True]), "array([ True])")):
        check_message(package, lambda: FLAGS[name](swing, value), TypeError, f"{name}: {shown}; must be True or False")


def test_flags_of_numpy(swing):
    assert type(swing.simulate(0.1, every=0.1, dataset=np.False_)["t"]) is np.ndarray and "error" in str(swing.simulate(0.1, every=0.1, verify=np.True_).attrs)
    assert same(swing.linearise(move_held=np.bool_(True)).A, swing.linearise(move_held=True).A)


WRONG = {
    "file: NoneType; must be the name of a model file": (TypeError, lambda m: type(m)(None)),
    "file: bytes; must be the name of a model file": (TypeError, lambda m: type(m)(b"arm.lua")),
    "text: NoneType; must be the text of a model": (TypeError, lambda m: type(m).from_text(None)),
    "text: bytes; must be the text of a model": (TypeError, lambda m: type(m).from_text(SWING.encode())),
    "file: NoneType; must be the name of a URDF file": (TypeError, lambda m: type(m).from_urdf(None)),
    "flexible: link 1; the names of links must be texts": (TypeError, lambda m: type(m).from_urdf("arm.urdf", {1: {"section": "round:0.1", "E": 7e10}})),
    "file: int; must be the name of a page, 'arm.html'": (TypeError, lambda m: m.live(3)),
    "sweep: int; must be the name of a sweep file": (TypeError, lambda m: m.batch(sweep=3)),
    "from_: NoneType; must be a name or a file; give a state as q=": (TypeError, lambda m: m.simulate(1, from_=None)),
    "data: NoneType; must be a motion of arm.simulate or an equilibrium of arm.statics": (TypeError, lambda m: m.states(None)),
    "data: no rod_psi; must have all coordinates of this model, as a motion of arm.simulate does": (ValueError, lambda m: m.states(xarray.Dataset({"arm_psi": 1.0}))),
    "data: no tip_psi; must have all coordinates of this model, as a motion of arm.simulate does": (ValueError, lambda m: m.states({"rod_psi": [1.0]})),
    f"steps: {2 ** 70}; must be at most 1e+09": (ValueError, lambda m: m.step(Q, QD, 0, 0.1, steps=2 ** 70)),
    "parameter load: values of <U4; must be real numbers": (TypeError, lambda m: type(m).from_text(SWING, load="2e-1")),
    "input push: values of <U1; must be real numbers": (TypeError, lambda m: type(m).from_text(SWING, push="3")),
    "load: value \"heavy\"; must be a number": (ValueError, lambda m: type(m).from_text(SWING, load="heavy")),
    "parameter load: values of <U3; must be real numbers; ": (TypeError, lambda m: m.simulate(1, parameters={"load": "2.5"})),
    "lanes: True; must be a number": (TypeError, lambda m: m.batch({"load": [1]}, 1, lanes=True)),
    "threads: False; must be a number": (TypeError, lambda m: m.batch({"load": [1]}, 1, threads=False)),
    "t_end: True; must be a number": (TypeError, lambda m: m.batch({"load": [1]}, True)),
    "modes: True; must be a number": (TypeError, lambda m: m.modes(modes=True)),
    "method: True; must be a name": (TypeError, lambda m: m.batch({"load": [1]}, 1, method=True)),
    f"method: 'euler' is not one of {METHODS}": (ValueError, lambda m: m.step(Q, QD, 0, 0.1, method="euler")),
    f"method: 'auto' has no fixed steps; use one of {METHODS}": (ValueError, lambda m: m.step(Q, QD, 0, 0.1, method="auto")),
    f"method: 'euler' is not one of auto, {METHODS}": (ValueError, lambda m: m.motion(method="euler")),
    f"method: 'eulr' is not one of auto, {METHODS}": (ValueError, lambda m: m.simulate(1, method="eulr", verify=True)),
    "step: auto chooses its steps; use tol": (ValueError, lambda m: m.motion(method="auto", step=1e-4)),
    "step: auto chooses its steps; use tol ": (ValueError, lambda m: m.simulate(1, method="auto", step=1e-4, verify=True)),
    "simulate() got an unexpected keyword argument 'from'; did you mean 'from_'?": (TypeError, lambda m: m.simulate(1, **{"from": "statics"})),
    "simulate() got an unexpected keyword argument 'until'; did you mean 't_end'?": (TypeError, lambda m: m.simulate(1, until=2)),
    "fit() got an unexpected keyword argument 'from'; did you mean 'from_'?": (TypeError, lambda m: m.fit({"t": [0], "tip_psi": [1]}, vary=["load"], noise={"tip_psi": 1}, **{"from": "statics"})),
    "M() missing 1 required positional argument: 'q'": (TypeError, lambda m: m.M()),
    "hold: the model has no coordinate 'xyz'; use one of rod_psi, tip_psi": (ValueError, lambda m: m.statics(hold=["xyz"])),
    "hold: the model has no coordinate 'tip_ps'; did you mean 'tip_psi'?": (ValueError, lambda m: m.modes(hold="tip_ps")),
    "release: the model has no constraint row 'x'; there are none": (ValueError, lambda m: m.linearise(release=["x"])),
    "t: unknown input; inputs are constant here, and samples with their times are for arm.simulate": (ValueError, lambda m: m.motion(inputs={"t": [0, 1], "push": [1, 2]})),
    "fit: until is missing; check=True needs the end of the motion [s]": (TypeError, lambda m: m.fit(check=True, vary=["load"], noise={"tip_psi": 1})),
    "until: '-1' is not a positive number": (ValueError, lambda m: m.fit(check=True, until=-1, vary=["load"], noise={"tip_psi": 1})),
    **{f"{name}: contains an integer that is too large; all numbers must be finite": (ValueError, call) for name, call in {
        "t": lambda m: m.qdd(Q, QD, 10 ** 400), "h": lambda m: m.step(Q, QD, 0, 10 ** 400), "steps": lambda m: m.step(Q, QD, 0, 0.1, steps=10 ** 400),
        "step_limit": lambda m: m.motion(step_limit=10 ** 400), "input push": lambda m: m.motion().set(inputs={"push": 10 ** 400}), "accuracy": lambda m: m.simulate(1, accuracy=10 ** 400),
        "threads": lambda m: m.batch({"load": [1]}, 1, threads=10 ** 400), "data[0]: tip_psi": lambda m: m.fit({"t": [0, 1], "tip_psi": [1, 10 ** 400]}, vary=["load"], noise={"tip_psi": 1})}.items()},
    "before needs realise=True": (ValueError, lambda m: m.simulate(1, before=0.1)),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_arguments(package, swing, message):
    kind, call = WRONG[message]
    check_message(package, lambda: call(swing), kind, message.rstrip("; "))


def test_methods_with_short_names(swing):
    """The names in the message are those that the calls take, also where the program computes."""
    for name in METHODS.split(", "):
        assert np.isfinite(swing.step(Q, QD, 0, 1e-3, method=name)).all() and swing.motion(method=name).advance(1e-3)
    assert swing.simulate(0.01, method="gauss").attrs["method"] == swing.simulate(0.01, method="gauss", verify=True).attrs["method"] == "gauss12"


def test_states_of_columns(swing):
    run, columns = (swing.simulate(0.02, every=0.01, dataset=kind) for kind in (True, False))
    for data in (columns, dict(columns), run.to_dataframe(), run):
        assert same(swing.states(data), swing.states(run))
    rest = swing.statics()
    assert same(swing.states(rest), [[rest.rod_psi, rest.tip_psi], [0, 0]])


@pytest.mark.filterwarnings("error")
def test_one_warning_about_an_unread_parameter(package, swing):
    """Also where an equilibrium precedes what the call computes."""
    given = {"spare": 3.0}
    for call in (lambda: swing.simulate(0.01, from_="statics", parameters=given), lambda: swing.modes(parameters=given), lambda: swing.statics(parameters=given),
                 lambda: swing.simulate(0.01, parameters=given), lambda: swing.motion(parameters=given), lambda: swing.motion().set(parameters=given)):
        with pytest.warns(package.ModelWarning) as told:
            call()
        assert [str(each.message) for each in told] == ["spare: nothing in this model reads it"] and told[0].filename == __file__


# ---- Words ----

OTHERS = ("cases", "parameters")  # options that mean something else than the arguments of these names
COMMANDS = {"simulate": "sim", "statics": "statics", "modes": "modes", "linearise": "linearise", "batch": "batch", "fit": "fit", "plan": "plan", "from_urdf": "import", "live": "view", "casadi": "gen"}
FURTHER = {"simulate": "OF_SIM", "batch": "OF_BATCH", "fit": "OF_FIT", "plan": "OF_FIT"}


@pytest.mark.parametrize("call", COMMANDS)
def test_options_in_messages_are_arguments(package, call):
    """Every option of a command that the call offers as an argument: `name`, or `name=True` for a flag, and `name` as the subject."""
    from refdyn import program, urdf, wording
    offered = {*inspect.signature(getattr(package.Model, call)).parameters, *getattr(program, FURTHER.get(call, ""), ()), *(urdf.OF_BEAMS if call == "from_urdf" else ())}
    options = re.findall(r"^  --([a-zA-Z-]+)( [^ ]+)?(?: |$)", refdyn(COMMANDS[call], "--help").stdout, re.M)
    tried = 0
    for option, value in options:
        name = wording.ARGUMENTS.get(option, option.replace("-", "_"))
        if name in offered and name not in OTHERS:
            tried += 1
            assert wording.of_python(f"x: --{option} is in use") == f"x: {name}{'' if value else '=True'} is in use" and wording.of_python(f"--{option}: wrong") == f"{name}: wrong"
            assert wording.of_python(f"a--{option}s --{option}-s") == f"a--{option}s --{option}-s"
    assert tried >= {"casadi": 2, "statics": 3}.get(call, 4), options


def test_held_coordinates_of_a_linear_model(package):
    held = package.Model.from_text(SWING.replace("return rd.model {", "return rd.model { hold = { 'rod_psi', 'tip_psi' },"))
    with pytest.warns(package.ModelWarning, match=r"the input push moves no state: it acts on held coordinates \(move_held=True lets them move\), or on nothing"):
        held.linearise("initial")
