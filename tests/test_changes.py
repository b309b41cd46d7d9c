"""Motions that are changed on their way: `advance`, `set` and `copy` in any pattern lead to the motion of `sim`, in Python, in C and in FMUs."""
import itertools
import math
import random
import subprocess
import zipfile

import numpy as np
import pytest

from program import BUILD, CORE_LIBRARY, LONG, SOURCE, UNOPTIMISED, motion, refdyn
from python_package import package  # noqa: F401: a fixture
from test_fmi import description, export, variables

# Each model has an input u of 0 and a parameter w of 1. Its events depend on coordinates, rates, states, times, rows and contacts.
FORM = """local rd = require "refdyn"
local u, w = rd.input("u", 0), rd.parameter("w", 1, "kg")
{more}
return rd.model {{ name = "{name}", gravity = {{ 0, 0, -9.81 }}, {text} }}
"""
X = 'links = {{ {{ "m", joint = "x", mass = w, {} }} }}, '
MODELS = {
    "wall": (X.format("start_rate = { x = 1 }") + """forces = function(s) return { m_x = u } end,
        events = function(s) return { rd.event { 0.4 - s.q.m_x, direction = "down", restitution = 1, name = "bounce" } } end""", 1),
    "counter": (X.format("spring = { x = 40 }, start_rate = { x = 1.3 }") + """forces = function(s) return { m_x = u - n } end,
        events = function(s) return { rd.event { s.q.m_x - 0.05, direction = "up", inputs = { n = n + 0.3 } }, rd.event { s.qd.m_x - 0.4, inputs = { n = 0.7 * n } },
            rd.event { s.q.m_x + 0.02, direction = "down", inputs = { n = n - 0.2 } } } end""", 2),
    "relay": (X.format("damper = { x = 0.5 }") + """forces = function(s) return { m_x = u + rd.where(rd.less(0.5, on), 2, -1.5) } end,
        events = function(s) return { rd.event { s.q.m_x - 0.3, direction = "up", parameters = { on = 0 } }, rd.event { s.q.m_x - 0.2, direction = "down", parameters = { on = 1 } } } end""", 3),
    "sampled": (X.format("spring = { x = 3 }, start = { x = 0.2 }") + """forces = function(s) return { m_x = u + n } end,
        events = function(s) return { rd.sampled { every = 0.1, inputs = { n = 1 - 4 * s.q.m_x - s.qd.m_x } } } end""", 1.5),
    "states": (X.format("spring = { x = 9 }, start = { x = 0.3 }") + """forces = function(s) return { m_x = u - 0.3 * s.states.z + 0.2 * n } end,
        states = function(s) return { rd.state { "z", rate = 4 * (s.q.m_x - s.states.z), start = 0.1 } } end,
        events = function(s) return { rd.event { s.states.z - 0.1, direction = "down", inputs = { n = n + 1 } }, rd.event { s.q.m_x, direction = "up", inputs = { n = n - 0.5 } } } end""", 3),
    "kinks": (X.format("start = { x = 0.3 }, start_rate = { x = 1 }") + """forces = function(s) return {
            m_x = u - 20 * rd.max(0, s.q.m_x - 0.2) - 15 * rd.min(0, s.q.m_x + 0.1) + rd.where(rd.less(s.q.m_x, 0), 1, -0.7) } end,
        events = function(s) return { rd.event { s.q.m_x - 0.1, direction = "down" } } end""", 2),
    "times": (X.format("spring = { x = 5 }, start = { x = 0.3 }") + """forces = function(s) return { m_x = u + rd.where(rd.less(rd.sin(7 * s.t), 0), 1, -1) + rd.where(rd.less(s.t, 0.77), 2, 0) } end,
        events = function(s) return { rd.event { rd.cos(5 * s.t), direction = "down", rates = { m_x = s.qd.m_x + 0.2 } },
            rd.event { s.q.m_x - 0.1, direction = "up", rates = { m_x = 0.9 * s.qd.m_x } } } end""", 2),
    "plate": ("""links = { { "b", joint = "z", mass = w, start = { z = 0.4 } }, { "p", joint = "z", mass = 3 } }, forces = function(s) return { b_z = u } end,
        constraints = function(s) return { rd.drive { coordinate = "p_z", value = 0.05 * rd.sin(12 * s.t) }, rd.contact { s.q.b_z - s.q.p_z, restitution = 0.4, name = "plate" } } end""", 1.5),
    "stack": ("""links = { { "a", joint = "z", mass = w, start = { z = 0.2 } }, { "b", joint = "z", mass = 2, start = { z = 0.7 } } }, forces = function(s) return { a_z = u } end,
        constraints = function(s) return { rd.contact { s.q.a_z, restitution = 0.3, name = "floor" }, rd.contact { s.q.b_z - s.q.a_z, restitution = 0.5, name = "upper" } } end""", 1.5),
    "rows": ("""links = { { "a", turn = { { "x", rd.pi / 2 } }, joint = "psi", mass = w, center = { 0.5, 0, 0 } },
            { "b", on = "a", at = { 1, 0, 0 }, joint = "psi", mass = 1, center = { 0.5, 0, 0 } } }, forces = function(s) return { a_psi = u } end,
        constraints = function(s) return { rd.position { s.q.b_psi - s.q.a_psi - rd.where(rd.less(s.t, 0.5), 0, 0.6 * (s.t - 0.5)) } } end,
        events = function(s) return { rd.event { s.q.a_psi + 0.8, restitution = 0.7, direction = "down", name = "stop" } } end""", 1.5),
}
METHODS = ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]
TOL, ALLOWED = 1e-9, 1e-6
TOUCHES = ["input", "parameter", "state", "input and back", "parameter and back", "none"]
COUNT = 100 if LONG else 3


@pytest.fixture(scope="module")
def file_of(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")

    def get(name):
        file = folder / f"{name}.lua"
        text = MODELS[name][0]
        more = 'local n = rd.input("n", 0)' if "{ n =" in text else 'local on = rd.parameter("on", 1)' if "{ on =" in text else ""
        file.write_text(FORM.format(name=name, text=text, more=more))
        return file
    return get


def pattern(name, seed, event_times=()):
    """Stops [(t, touch, u)] of a motion; at some of them u changes for good. Some are at events, or next to them."""
    choose, until = random.Random(f"{name} {seed}"), MODELS[name][1]
    times = [until * choose.random() for _ in range(choose.choice([3, 15, 60]))] + [round(until * choose.random(), 1) for _ in range(4)]
    for t in choose.sample(event_times, min(len(event_times), 5)):
        times.append(t * (1 + choose.choice([0, 0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9])))
    u, stops = 0.0, []
    for t in sorted({t for t in times if 0 < t < until}):
        u = choose.uniform(-1, 1) if choose.random() < 2 / len(times) else u
        stops.append((t, choose.choice(TOUCHES), u))
    return stops


def samples(stops, file):
    """The changes of u as samples of `sim`."""
    rows, last = [(0.0, 0.0)], 0.0
    for t, _, u in stops:
        if u != last:
            rows.append((t, u))
        last = u
    file.write_text("t,u\n" + "".join(f"{t!r},{u!r}\n" for t, u in rows))
    return file


def reference(model, name, stops, folder):
    """The end of `sim` with these changes: coordinates and rates by name, and its events."""
    until = MODELS[name][1]
    run, _, summary = motion(model, "--until", until, "--every", until, "--method", "rk8", "--tol", TOL, "--inputs", samples(stops, folder / "u.csv"))
    return {column: values[-1] for column, values in run.items()}, [(mark["t"], mark["event"], mark.get("contact", "")) for mark in summary["events"]]


def events_of(model, name):
    _, _, summary = motion(model, "--until", MODELS[name][1], "--method", "rk8", "--tol", TOL)
    return [mark["t"] for mark in summary["events"]]


def marks_of(events):
    """Times by event, in order; of a contact, until its rebounds are so short that rounding decides their number."""
    found = {}
    for t, name, kind in events:
        times = found.setdefault(name, [])
        if not kind or not times or (t - times[-1] > 1e-2 and math.isfinite(times[-1])):
            times.append(t)
        elif math.isfinite(times[-1]):
            times.append(math.inf)
    return found


def same_events(found, expected):
    found, expected = marks_of(found), marks_of(expected)
    assert found.keys() == expected.keys() and all(len(found[name]) == len(expected[name]) for name in found), (found, expected)
    assert all(a == b or abs(a - b) < ALLOWED for name in found for a, b in zip(found[name], expected[name])), (found, expected)


# ---- Python ----

def touched(one, touch, u, last):
    """Values that are set again, or set and set back, change nothing. u is new or as before; a load that would open a contact opens it at once."""
    if touch == "input and back":
        one.set(inputs={"u": u + 1})
    if touch == "parameter and back":
        one.set(parameters={"w": 1.5}), one.set(parameters={"w": 1.0})
    if touch == "parameter":
        one = one.copy()
        one.set(parameters={"w": 1.0})
    if touch == "state":
        one.set(q=one.q, qd=one.qd)
    if u != last or touch.startswith("input"):
        one.set(inputs={"u": u})
    return one.copy() if touch == "none" else one


def advanced(one, stops, until):
    last = 0.0
    for t, touch, u in stops:
        one.advance(t)
        one = touched(one, touch, u, last)
        last = u
    one.advance(until)
    return one


@pytest.mark.parametrize("name", MODELS)
def test_patterns(package, file_of, name, tmp_path):  # noqa: F811
    """The first pattern, which changes nothing, by all methods; each of the others, with changes, by one."""
    model = package.Model(file_of(name))
    times = events_of(file_of(name), name)
    for seed in range(COUNT):
        stops = pattern(name, seed, times) if seed else [(t, touch, 0.0) for t, touch, _ in pattern(name, 0, times)]
        expected, events = reference(file_of(name), name, stops, tmp_path)
        for method in METHODS if seed == 0 else [METHODS[seed % len(METHODS)]]:
            one = advanced(model.motion(method=method, tol=TOL), stops, MODELS[name][1])
            columns = [column + end for end in ("", "_d") for column in model.coordinates]
            found = {**dict(zip(columns, one.state.ravel())), **one.states}
            off = {column: found[column] - value for column, value in expected.items() if column in found}
            assert max(map(abs, off.values())) < ALLOWED * (100 if method == "ros34pw2" else 1), (seed, method, off)
            same_events(one.events, events)


def test_loop_of_the_page(package, file_of):  # noqa: F811
    """A bounce at 0.4 s, despite sixty settings before and after it; many settings at one time do not count as accumulating events."""
    wall = package.Model(file_of("wall"))
    for method in METHODS:
        one = wall.motion(method=method)
        for k in range(1, 61):
            one.advance(0.01 * k)
            one.set(inputs={"u": 0.0})
        assert abs(one.q[0] - 0.2) < 1e-9 and len(one.events) == 1 and abs(one.events[0][0] - 0.4) < 1e-9
    one = wall.motion()
    for _ in range(100):
        one.advance(0.3)
        one.set(parameters={"w": 1.0})
    one.advance(0.6)
    assert abs(one.q[0] - 0.2) < 1e-9


ROTOR = """local rd = require "refdyn"
local u, n, w = rd.input("u", 0), rd.input("n", 0), rd.parameter("w", 1)
return rd.model {{ name = "rotor", links = {{ {{ "r", joint = "psi", mass = w, inertia = {{ zz = 0.7 }}, start_rate = {{ psi = 29 }} }} }},
  forces = function(s) return {{ r_psi = u }} end,
  events = function(s) local a = s.q.r_psi return {{ rd.event {{ {value}, direction = "{direction}", inputs = {{ n = n + 1 }} }} }} end }}
"""
JUMPS = {"square": "rd.where(rd.less(rd.sin(a + 0.3), 0), -1, 1)", "tan": "rd.tan(a + 0.4)", "pole": "1 / rd.cos(a / 2.5)", "sine": "rd.sin(a + 0.2)",
         "pulse": "rd.where(rd.less(rd.cos(a), 0.99), -1, 1)", "saw": "rd.atan2(rd.sin(2 * a + 0.4), rd.cos(2 * a + 0.4))"}


@pytest.mark.parametrize("method", METHODS if LONG else ["auto", "rk54"])
@pytest.mark.parametrize("form", JUMPS)
def test_changes_at_jumps_and_poles(package, form, method):  # noqa: F811
    """A value that is set to itself at the time of an event, or one unit of rounding next to it, adds and loses no event."""
    for direction in "both", "up", "down":
        model = package.Model.from_text(ROTOR.format(value=JUMPS[form], direction=direction))
        plain = model.motion(method=method)
        plain.advance(1.5)
        times = [t for t, _, _ in plain.events]
        assert len(times) >= 3
        for t, beside in itertools.product(times, (-1, 0, 1)):
            one = model.motion(method=method)
            one.advance(t + beside * np.spacing(t))
            one.set(inputs={"u": 0.0})
            one.advance(1.5)
            assert len(one.events) == len(times) and one.inputs["n"] == len(times), (t, beside)
            assert np.abs(np.subtract([t for t, _, _ in one.events], times)).max() < 1e-9


LEVEL = """local rd = require "refdyn"
local n, level = rd.input("n", 0), rd.parameter("level", 1, "m")
return rd.model { name = "level", links = { { "m", joint = "x", mass = 1, start_rate = { x = 1 } } },
  events = function(s) return { rd.event { s.q.m_x - level, direction = "up", inputs = { n = n + 1 }, name = "passes" } } end }
"""


def test_values_that_a_change_moves(package):  # noqa: F811
    """A value that a change carries across zero is an event at once; one that is carried back before the next step is none."""
    model = package.Model.from_text(LEVEL)
    one, other, late = (model.motion() for _ in range(3))
    for motion_, level in ((one, 0.2), (other, 1.0), (late, 2.0)):
        motion_.advance(0.3)
        motion_.set(parameters={"level": 0.2})
        motion_.set(parameters={"level": level})
    assert one.advance(0.5) and [t for t, _, _ in one.events] == [0.3] and one.inputs["n"] == 1
    assert other.advance(0.9) and other.events == [] and other.advance(1.5) and abs(other.events[0][0] - 1) < 1e-9
    assert late.advance(1.9) and late.events == [] and late.advance(2.5) and abs(late.events[0][0] - 2) < 1e-9
    for q, count in ((0.4, 0), (1.0, 1), (1.3, 1)):   # at the event, which has not acted yet: moved back, left there, moved on
        at = model.motion()
        at.advance(1.0)
        at.set(q=[q])
        assert at.advance(1.1) and at.inputs["n"] == count, q
        assert at.advance(2.5) and at.inputs["n"] == 1


def test_crossings_that_are_no_events(package):  # noqa: F811
    """A step reaches beyond a crossing in the other direction, which has not happened where the level is changed."""
    one = package.Model.from_text(LEVEL.replace('"up"', '"down"')).motion()
    one.advance(0.5), one.advance(0.7)
    one.set(parameters={"level": 1.3})
    assert one.advance(2) and one.events == []
    one.set(parameters={"level": 5.0})
    assert one.advance(3) and [t for t, _, _ in one.events] == [2]


@pytest.mark.parametrize("options", [{"method": "rk4", "step": 1e-3}, {"method": "rk8", "tol": 1e-8}])
def test_changes_at_time_events(package, file_of, options):  # noqa: F811
    """Where a formula of time jumps, the motion stays on the right side of the jump; where a row jumps, its impulse happens once."""
    times, rows = package.Model(file_of("times")), package.Model(file_of("rows"))
    for model, stops in ((times, [k * math.pi / 7 for k in range(1, 5)]), (rows, [0.5])):
        plain, changed = (model.motion(**options) for _ in range(2))
        for t in stops:
            changed.advance(t)
            changed.set(inputs={"u": 1.0})
            changed.set(inputs={"u": 0.0})
        plain.advance(2), changed.advance(2)
        assert np.abs(changed.state - plain.state).max() < 1e-8


COUNTING = """local rd = require "refdyn"
local u, sum, n = rd.input("u", 0, "N"), rd.input("sum", 0), rd.input("n", 0)
local p = rd.parameters { { "next", 0, "s" }, { "gain", 2 } }
return rd.model { name = "counting", links = { { "m", joint = "x", mass = 1.3, start = { x = 0.2 } } }, forces = function(s) return { m_x = u - 0.1 * sum } end,
  events = function(s) return { rd.sampled { every = 0.1, inputs = { u = 1 - p.gain * s.q.m_x, sum = sum + 0.1 * s.q.m_x } },
    rd.event { s.t - p.next, direction = "up", inputs = { n = n + 1 }, parameters = { next = p.next + 0.05, gain = p.gain + 0.1 } } } end }
"""


@pytest.mark.parametrize("method", ["auto", "rk4", "radau9"])
def test_values_at_samples(package, method):  # noqa: F811
    """At samples and ticks, values are those from there on, as in the rows of a simulation. Values that are set to what they are change nothing."""
    model = package.Model.from_text(COUNTING)
    run = model.simulate(1.2, every=0.025, method=method, dataset=False)
    one, touched_ = (model.motion(method=method) for _ in range(2))
    for k in range(1, 49):
        for motion_ in one, touched_:
            motion_.advance(float(run["t"][k]))
            for name, value in motion_.inputs.items():
                assert abs(value - run[name][k]) < 1e-6, (k, name)
            assert abs(motion_.qdd[0] - run["m_x_dd"][k]) < 1e-6 and abs(motion_.force[0] - run["force_m_x"][k]) < 1e-6
        touched_.set(inputs=[touched_.inputs[name] for name in ("u", "sum", "n")] if k % 2 else dict(touched_.inputs))
        touched_.set(parameters=dict(touched_.parameters))
    assert np.abs(touched_.state - one.state).max() < 1e-6 and one.inputs == pytest.approx(dict(touched_.inputs))


# ---- C ----

DRIVER = r"""
#include "MODEL.h"
#include "refdyn.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
/* "touch" in words of the test; the values of all touches but "input" are those before. */
static int touch(struct refdyn_integrator *integrator, const char *what, double u, double last) {
    struct refdyn_workspace *work = integrator->work;
    int status = 0;
    if (strstr(what, "back")) {
        status = what[0] == 'i' ? refdyn_set_input(work, "u", u + 30) : refdyn_set_parameter(work, "w", 1.5);
        status = status ? status : refdyn_integrator_refresh(integrator);
        if (!status && what[0] == 'p')
            status = refdyn_set_parameter(work, "w", 1);
    }
    if (!status && (u != last || what[0] == 'i'))
        status = refdyn_set_input(work, "u", u);
    return status || !strcmp(what, "none") ? status : refdyn_integrator_refresh(integrator);
}
int main(int count, char **words) {
    const struct refdyn_model *model = &MODEL_model;
    struct refdyn_options options = refdyn_options_default(refdyn_method_find(words[count - 1]));
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double q[4], qd[4], t, u, last = 0;
    char what[32];
    options.tol = atof(words[1]);
    const size_t size = refdyn_workspace_size(model), more = refdyn_integrator_size(model, &options);
    int status = refdyn_workspace_init(&work, model, malloc(size), size);
    status = status ? status : refdyn_integrator_init(&integrator, &work, &options, malloc(more), more);
    refdyn_initial_state(&work, q, qd);
    refdyn_anchor(&work, 0, q, qd, NULL);
    status = status ? status : refdyn_integrator_start(&integrator, 0, q, qd);
    while (!status && scanf("%lf,%31[^,],%lf", &t, what, &u) == 3) {
        status = refdyn_integrator_to(&integrator, t);
        status = status ? status : touch(&integrator, what, u, last);
        last = u;
    }
    for (int i = 0; i < 2 * model->n; i++)
        printf("%.17g ", integrator.q[i]);
    return status ? 1 : 0;
}
"""


def lines(stops, until):
    return "".join(f"{t!r},{touch},{u!r}\n" for t, touch, u in [*stops, (until, "none", stops[-1][2])])


@pytest.fixture(scope="module")
def caller(file_of, tmp_path_factory):
    """A program that reads stops and prints the state at the last one, and the coordinates of the model."""
    made = {}

    def get(name):
        if name not in made:
            folder = tmp_path_factory.mktemp(name)
            refdyn("gen", file_of(name), "--emit", "all,implicit", "-o", folder)
            (folder / "driver.c").write_text(DRIVER.replace("MODEL", name))
            for source in ("driver", name):
                subprocess.run([*UNOPTIMISED, "-I", SOURCE / "runtime", "-I", folder, "-c", folder / f"{source}.c", "-o", folder / f"{source}.o"], check=True)
            subprocess.run(["gcc", "-z", "noexecstack", folder / "driver.o", folder / f"{name}.o", CORE_LIBRARY, "-lm", "-o", folder / "driver"], check=True)
            made[name] = folder / "driver"
        return made[name]
    return get


@pytest.mark.parametrize("name", MODELS)
def test_callers_from_c(file_of, caller, name, tmp_path):
    """By refdyn_integrator_refresh, or without it, where the next step notices the change."""
    times = events_of(file_of(name), name)
    for seed in range(COUNT):
        stops = pattern(name, 1000 + seed, times)
        expected, _ = reference(file_of(name), name, stops, tmp_path)
        method = METHODS[seed % len(METHODS)]
        done = subprocess.run([caller(name), str(TOL), method], input=lines(stops, MODELS[name][1]), check=True, capture_output=True, text=True)
        found = [float(value) for value in done.stdout.split()]
        states = [value for column, value in expected.items() if column + "_d" in expected]
        assert len(states) >= 1 and np.abs(np.subtract(found[:len(states)], states)).max() < ALLOWED * (100 if method == "ros34pw2" else 1), seed


# ---- FMUs ----

EMPTY = """#!/bin/sh
case "$*" in *NAME* | *machine.c*) exec cc "$@" ;; esac
while [ "$1" != -o ]; do shift; done
exec cc -c -x c /dev/null -o "$2"
"""


FMU_DRIVER = r"""
#include "runtime/bindings/fmi/fmi2.h"
#include "runtime/bindings/fmi/fmi3.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
enum { COLUMNS_MOST = 8 };
static void *one;
static unsigned input, parameter;
static void need(int is_good, const char *what) {
    if (!is_good) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}
#if VERSION == 2
static void tell(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}
static void begin(const char *token) {
    static const fmi2CallbackFunctions functions = {.logger = tell};
    one = fmi2Instantiate("one", fmi2CoSimulation, token, "", &functions, fmi2False, fmi2False);
    need(one && !fmi2SetupExperiment(one, fmi2False, 0, 0, fmi2False, 0) && !fmi2EnterInitializationMode(one) && !fmi2ExitInitializationMode(one), "start");
}
static void set(unsigned of, double value) { need(!fmi2SetReal(one, &of, 1, &value), "set"); }
static void get(const unsigned *of, size_t count, double *values) { need(!fmi2GetReal(one, of, count, values), "get"); }
static void step(double t, double to) { need(!fmi2DoStep(one, t, to - t, fmi2False), "step"); }
static void keep(void) {
    fmi2FMUstate state = NULL;
    need(!fmi2GetFMUstate(one, &state), "save");
    set(parameter, 1.7);
    need(!fmi2SetFMUstate(one, state) && !fmi2FreeFMUstate(one, &state), "restore");
}
#else
static void begin(const char *token) {
    one = fmi3InstantiateCoSimulation("one", token, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
    need(one && !fmi3EnterInitializationMode(one, false, 0, 0, false, 0) && !fmi3ExitInitializationMode(one), "start");
}
static void set(unsigned of, double value) { need(!fmi3SetFloat64(one, &of, 1, &value, 1), "set"); }
static void get(const unsigned *of, size_t count, double *values) { need(!fmi3GetFloat64(one, of, count, values, count), "get"); }
static void step(double t, double to) {
    bool event, ends, early;
    double last;
    need(!fmi3DoStep(one, t, (to - t) / 2, false, &event, &ends, &early, &last) && !ends && !event && !early, "step");
    need(!fmi3DoStep(one, last, to - last, false, NULL, NULL, NULL, NULL), "step without results");
}
static void keep(void) {
    fmi3FMUState state = NULL;
    need(!fmi3GetFMUState(one, &state), "save");
    set(parameter, 1.7);
    need(!fmi3SetFMUState(one, state) && !fmi3FreeFMUState(one, &state), "restore");
}
#endif
/* TOKEN, references of u, w and the columns to print. A value that is read between two settings is that of the first. */
int main(int count, char **words) {
    unsigned columns[COLUMNS_MOST];
    const size_t size = (size_t)count - 4;
    double values[COLUMNS_MOST], t = 0, to, u, last = 0;
    char what[32];
    input = (unsigned)atoi(words[2]), parameter = (unsigned)atoi(words[3]);
    for (size_t i = 0; i < size; i++)
        columns[i] = (unsigned)atoi(words[4 + i]);
    begin(words[1]);
    for (; scanf("%lf,%31[^,],%lf", &to, what, &u) == 3; t = to, last = u) {
        step(t, to);
        if (!strcmp(what, "state"))
            keep();
        if (strstr(what, "back")) {
            set(what[0] == 'i' ? input : parameter, what[0] == 'i' ? u + 30 : 1.5);
            get(columns, size, values);
        } else if (what[0] == 'p')
            set(parameter, 1.5);
        if (what[0] == 'p')
            set(parameter, 1);
        if (u != last || what[0] == 'i')
            set(input, u);
    }
    get(columns, size, values);
    for (size_t i = 0; i < size; i++)
        printf("%.17g ", values[i]);
    return 0;
}
"""


def component(model, version, folder):
    """A caller of the FMU's own sources, with the libraries of the build; and the FMU's token and references."""
    (folder / "empty").write_text(EMPTY.replace("NAME", model.stem))
    (folder / "empty").chmod(0o755)
    file = export(model, version, folder / "a.fmu", "--tol", TOL, env={"CC": str(folder / "empty")})
    zipfile.ZipFile(file).extractall(folder)
    (folder / "driver.c").write_text(FMU_DRIVER)
    sources = [folder / "driver.c", folder / "sources" / "refdyn_fmu.c", folder / "sources" / f"{model.stem}.c"]
    for source in sources:
        subprocess.run([*UNOPTIMISED, f"-DVERSION={version[0]}", "-I", folder / "sources", "-I", SOURCE, "-I", SOURCE / "runtime", "-c", source, "-o", source.with_suffix(".o")], check=True)
    subprocess.run(["gcc", "-z", "noexecstack", *[source.with_suffix(".o") for source in sources], BUILD / "librefdyn_fmi.a", CORE_LIBRARY, "-lm", "-o", folder / "driver"], check=True)
    about = description(file)
    return folder / "driver", about.get("guid") or about.get("instantiationToken"), {name: entry["valueReference"] for name, entry in variables(about).items()}


FMUS = [(name, version) for name in MODELS for version in ("2.0", "3.0")] if LONG else [("wall", "2.0"), ("counter", "3.0"), ("plate", "2.0")]


@pytest.mark.parametrize(("name", "version"), FMUS)
def test_fmus(file_of, name, version, tmp_path, tmp_path_factory):
    """Parameters and inputs that are set between steps, and states that are saved and restored."""
    model = file_of(name)
    times, (driver, token, of) = events_of(model, name), component(model, version, tmp_path_factory.mktemp("fmu"))
    for seed in range(COUNT):
        stops = pattern(name, 2000 + seed, times)
        expected, _ = reference(model, name, stops, tmp_path)
        columns = [column for column in expected if column + "_d" in expected]
        done = subprocess.run([driver, token, of["u"], of["w"], *[of[column] for column in columns]], input=lines(stops, MODELS[name][1]), capture_output=True, text=True)
        assert done.returncode == 0, (seed, done.stderr)
        assert np.abs(np.subtract([float(value) for value in done.stdout.split()], [expected[column] for column in columns])).max() < ALLOWED, (seed, stops)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_fmus_at_samples(version, tmp_path):
    """At a communication point with a sample and a tick, values are those from there on, as in the rows of a simulation."""
    model = tmp_path / "counting.lua"
    model.write_text(COUNTING)
    driver, token, of = component(model, version, tmp_path)
    columns = ["m_x", "m_x_d", "m_x_dd", "u", "sum", "n"]
    for until in 0.8, 1.05, 0.93:
        run, _, _ = motion(model, "--until", until, "--tol", TOL)
        stops = [(0.05 * k, "none", 0.0) for k in range(1, 30) if 0.05 * k < until - 1e-9]
        done = subprocess.run([driver, token, of["gain"], of["gain"], *[of[column] for column in columns]], input=lines(stops, until), capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert np.abs(np.subtract([float(value) for value in done.stdout.split()], [run[column][-1] for column in columns])).max() < ALLOWED, until
