"""Contacts and impacts in FMUs: balls come to rest, a driven slide holds and releases, accumulating impacts end with an error."""
import importlib
import math

import numpy as np
import pytest

from program import LONG, TESTS, check, close, motion
from test_fmi import KINDS, OUTPUTS, Instance, description, export, fmpy, variables  # noqa: F401: fmpy is a fixture

G, E = 9.81, 0.6
CONTACTS = TESTS / "models" / "contacts"
FLOORS = [0, 0.3, -1000, 1e6]

PAIR = """
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.6 }, { "floor", 0.3, "m" } }
return rd.model {
  name = "pair", gravity = { 0, 0, -9.81 },
  links = {
    { "ball", joint = "z", mass = 1, start = { z = p.floor + 1 } },
    { "cart", joint = "x", mass = 2, start = { x = 0.5 } } },
  forces = function(s) return { cart_x = -5 * rd.cos(s.t) } end,
  constraints = function(s) return {
    rd.contact { s.q.ball_z - p.floor, restitution = p.e, name = "floor" },
    rd.contact { s.q.cart_x, restitution = 0.2, name = "buffer" } } end,
}
"""

IMPACTS = """
local rd = require "refdyn"
local p = rd.parameters { { "floor", 0.3, "m" } }
return rd.model {
  name = "impacts", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start = { z = p.floor + 1 } } },
  events = function(s) return { rd.event { s.q.ball_z - p.floor, direction = "down", restitution = 0.6, name = "ground" } } end,
}
"""


@pytest.fixture(scope="module")
def made(fmpy, tmp_path_factory):  # noqa: F811
    """The FMU of a scene, its model, and its files in a folder; each is made once."""
    folder, known = tmp_path_factory.mktemp("contacts"), {}

    def get(name):
        if name not in known:
            model = CONTACTS / f"{name}.lua"
            if name in ("pair", "impacts"):
                model = folder / f"{name}.lua"
                model.write_text(PAIR if name == "pair" else IMPACTS)
            file = export(model, "2.0" if name in ("pair", "rod") else "3.0", folder / f"{name}.fmu", "--until", 4, "--tol", 1e-9)
            known[name] = file, model, fmpy.extract(str(file), str(folder / name))
        return known[name]
    return get


def simulate(fmpy, files, kind, until, names, tolerance=1e-9, **ways):  # noqa: F811
    return fmpy.simulate_fmu(files, fmi_type=kind, stop_time=until, output_interval=until / OUTPUTS, relative_tolerance=tolerance, output=names,
                             record_events=False, **ways)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("name", "until"), [("pair", 2.5)] + ([("rod", 1.5), ("table", 1.2), ("stack", 1.5), ("wall", 3)] if LONG else []))
def test_motions(fmpy, made, name, until, kind):  # noqa: F811
    """As in `sim`, with the contact forces and the times of rest. Impacts that accumulate make a small error of the importer a large one:
    near the end of the bounces, rates differ by 5e-5 if the importer's tolerance is 1e-9, and by 5e-7 if it is 1e-11."""
    _, model, files = made(name)
    run, _, _ = motion(model, "--until", until, "--every", until / OUTPUTS, "--tol", 1e-9)
    states = [key for key in run if key + "_d" in run or key.endswith("_d") and key[:-2] in run]
    names = states + [key for key in run if key.startswith(("contact_", "rest_"))]
    found = simulate(fmpy, files, kind, until, names, tolerance=1e-11)
    tolerances = {key: 1e-5 if key in states else 1e-3 for key in names}
    at = [int(np.flatnonzero(np.isclose(found["time"], t, rtol=0, atol=1e-9))[-1]) for t in run["t"]]
    check(close(key, found[key][at], run[key], tolerances[key], scale=1) for key in names)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("floor", FLOORS)
def test_ball_comes_to_rest(fmpy, made, floor, kind):  # noqa: F811
    """At its closed-form time, to the importer's tolerance at that height in Model Exchange, with its weight as the force."""
    found = simulate(fmpy, made("pair")[2], kind, 4, ["ball_z", "ball_z_d", "contact_floor", "rest_floor", "floor_rests"], start_values={"floor": floor, "ball_z": floor + 1})
    h = max(1e-6, 64 * 2.2e-16 * abs(floor)) if kind == "CoSimulation" else max(1e-6, 1e-8 * abs(floor))
    expected = math.sqrt(2 / G) * (1 + E) / (1 - E)
    last = found[-1]
    check([close("z", last["ball_z"], floor, 1e-9 * max(1, abs(floor)), scale=1), close("rate", last["ball_z_d"], 0, 1e-9, scale=1),
           close("force", last["contact_floor"], G, 1e-9), close("rests", last["floor_rests"], 1, 0),
           close("time", last["rest_floor"], expected, math.sqrt(8 * h / G) / (1 - E), scale=1)])
    free = found["time"] < 1.6
    assert not found["contact_floor"][free].any() and not found["rest_floor"][free].any()
    assert found["ball_z"].min() - floor > (-1e-5 if kind == "CoSimulation" or abs(floor) < 1 else -0.06)


@pytest.mark.parametrize("kind", KINDS)
def test_slide_holds_and_lets_go(fmpy, made, kind, capfd):  # noqa: F811
    """At the buffer with the force of the drive, 5 cos t, until this is 0 at pi/2; messages report both."""
    found = simulate(fmpy, made("pair")[2], kind, 2.5, ["cart_x", "contact_buffer"], debug_logging=True)
    said = "".join(capfd.readouterr())
    assert "contact buffer rests from 1.073" in said and "contact buffer lets go" in said and "contact floor rests from 1.806" in said
    t = found["time"]
    rests = (t > 1.09) & (t < 1.57)
    away = t > 1.58
    s = t[away] - math.pi / 2
    check([close("held", abs(found["cart_x"][rests]).max(), 0, 1e-9, scale=1), close("force", found["contact_buffer"][rests], 5 * np.cos(t[rests]), 1e-6, scale=5),
           close("away", found["cart_x"][away], 2.5 * (s - np.sin(s)), 1e-5, scale=1)])
    assert not found["contact_buffer"][away].any()


@pytest.mark.parametrize("h", [1e-2, 1e-3])
def test_importer_of_fixed_steps(fmpy, made, h):  # noqa: F811
    """It steps well into a contact and locates no zeros: the ball nevertheless comes to rest, at a time resolved by its steps."""
    one = Instance(fmpy, made("pair")[2], True)
    names, indicators = one.states(), one.about.numberOfEventIndicators
    vector = importlib.import_module("ctypes").c_double
    x = one.get(names)

    def read(function, count):
        values = (vector * count)()
        function(values, count)
        return np.array(values)

    for i in range(round(2.4 / h)):
        before, k = read(one.fmu.getEventIndicators, indicators), read(one.fmu.getDerivatives, len(x))
        one.fmu.setTime((i + 1) * h)
        one.set_states(x + h * k)
        one.set_states(x + h / 2 * (k + read(one.fmu.getDerivatives, len(x))))
        after = read(one.fmu.getEventIndicators, indicators)
        wants, _ = one.fmu.completedIntegratorStep()
        if getattr(wants, "value", wants) or ((before > 0) != (after > 0)).any():
            one.fmu.enterEventMode()
            one.take_events()
            one.fmu.enterContinuousTimeMode()
        x = read(one.fmu.getContinuousStates, len(x))
    expected = math.sqrt(2 / G) * (1 + E) / (1 - E)
    z, force, since = one.get(["ball_z", "contact_floor", "rest_floor"])
    check([close("z", z, 0.3, 1e-12), close("force", force, G, 1e-9), close("time", since, expected, 30 * h, scale=1)])
    one.close()


@pytest.mark.parametrize("is_exchange", [True, False])
def test_modes_are_of_the_contact(fmpy, made, is_exchange):  # noqa: F811
    """No importer sets them; they can be read."""
    one = Instance(fmpy, made("pair")[2], is_exchange, is_begun=False)
    one.enter_initialisation()
    with pytest.raises(Exception, match="status 3"):
        one.set("floor_rests", 1)
    one.fmu.freeInstance()
    entry = variables(description(made("pair")[0]))["floor_rests"]
    assert entry["causality"] == "local" and entry["variability"] == "discrete" and "start" not in entry


def test_saved_states_keep_modes(fmpy, made):  # noqa: F811
    """Saved at rest, restored after the slide was released: force, time of rest and the further motion are the same to the bit."""
    one = Instance(fmpy, made("pair")[2], False)
    names = one.states() + ["contact_buffer", "rest_buffer", "buffer_rests", "contact_floor"]
    one.steps(0, 140)
    there, saved = one.get(names), one.fmu.getFMUState()
    one.steps(140, 200)
    end = one.get(names)
    one.fmu.setFMUState(saved)
    assert np.array_equal(one.get(names), there) and one.get(["buffer_rests", "floor_rests"]).tolist() == [1, 0]
    one.steps(140, 200)
    assert np.array_equal(one.get(names), end) and one.get(["buffer_rests", "floor_rests"]).tolist() == [0, 1]
    one.fmu.freeFMUState(saved)
    one.close()


def test_validate(fmpy, made):  # noqa: F811
    validation = importlib.import_module("fmpy.validation")
    assert validation.validate_fmu(str(made("pair")[0])) == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("floor", FLOORS)
def test_impacts_that_accumulate(fmpy, made, floor, kind, capfd):  # noqa: F811
    """An error that names the event, soon after the last of the impacts."""
    with pytest.raises(Exception, match="status 3"):
        simulate(fmpy, made("impacts")[2], kind, 6, ["ball_z"], start_values={"floor": floor, "ball_z": floor + 1})
    text = "".join(capfd.readouterr())
    assert "event ground" in text
    t = float(text.split("t = ")[1].split(" s:")[0])
    assert 1.75 < t < (1.81 if kind == "CoSimulation" else 3.2)
