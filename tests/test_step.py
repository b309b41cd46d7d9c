"""Emitted fixed steps (`--emit step`): their order, and their derivatives compared with differences of steps."""
import ctypes
import re
import subprocess

import numpy
import pytest

from compiled import Compiled, array, pointer
from program import LONG, MODELS, REFERENCE, SOURCE, TESTS, check, close, motion, refdyn, settings

METHODS = ("rk4", "gauss")
WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Werror".split()
# Rows with gains, inputs, time, splines, friction, one coordinate and many: the variants of a step.
ZERO = 1e-5  # change of a parameter whose value is zero, such as a time constant of damping
SCENES = [(REFERENCE, ["--set", "n_rfe=2", "--set", "drive=input"]), (MODELS / "pendulum.lua", []), (MODELS / "crane.lua", []),
          (TESTS / "models" / "functions.lua", [])]
MORE = [(MODELS / "fourbar.lua", []), (MODELS / "spacearm.lua", []), (MODELS / "gantry.lua", []), (TESTS / "models" / "switched.lua", [])]


def name_of(scene):
    return scene[0].stem


class Stepper:
    """The emitted steps of one model, loaded."""

    def __init__(self, scene, folder, emit="step.p"):
        self.model = Compiled(scene[0], folder, *scene[1], "--emit", f"{emit},start")
        header = next(folder.glob("*_step.h"))
        self.name, self.n = header.stem[:-len("_step")], self.model.n
        self.text = header.read_text()
        self.sizes = {name: int(size) for name, size in re.findall(r"_step_(?:(\w+)_)?work = (\d+)", self.text)}
        parts = re.search(r"_step_derivatives \{(.*?)\};", self.text, re.S)[1]
        self.parts = {part: (int(rows), int(columns)) for part, rows, columns in re.findall(r"double (\w+)\[\d+\]; /\* \((\d+) x (\d+)\)", parts)}

    def step(self, method, t, h, count, state, x=None, p=None, has_derivatives=False):
        """The state at the end, and the derivatives by name."""
        n, values = self.n, array(numpy.full(sum(a * b for a, b in self.parts.values()), numpy.nan))
        state, out = array(state), array(numpy.full(2 * n, numpy.nan))
        work = array(numpy.full(self.sizes[f"{method}_derivatives" if has_derivatives else method] + 1, numpy.nan))
        work[-1] = 12.5
        failed = getattr(self.model.library, f"{self.name}_step_{method}")(
            pointer(self.model.p if p is None else p), pointer(self.model.x if x is None else x), ctypes.c_double(t), ctypes.c_double(h), count,
            pointer(state[:n].copy()), pointer(state[n:].copy()), pointer(out), pointer(values) if has_derivatives else None, pointer(work))
        assert work[-1] == 12.5, "more memory is written than the header states"
        ends = numpy.cumsum([a * b for a, b in self.parts.values()])
        derivatives = {part: values[end - a * b:end].reshape(a, b) for (part, (a, b)), end in zip(self.parts.items(), ends)}
        return (failed, out, derivatives) if has_derivatives else (failed, out)

    def state(self, seed=3, size=0.02):
        """A state without symmetry, near the start."""
        random = numpy.random.default_rng(seed)
        return self.model.start + size * random.standard_normal(2 * self.n)

    def prepared(self, i, value):
        """Prepared parameters with another value of the i-th."""
        p = with_entry(self.model.p, i, value)
        prepare = getattr(self.model.library, f"{self.name}_prepare", None)
        if prepare:
            prepare(pointer(p))
        return p

    def inputs(self, seed=4):
        count = len(self.model.x) - 1
        return array([*(self.model.x[:count] + 0.3 * numpy.random.default_rng(seed).standard_normal(count)), 0.0])


def difference(function, at, size):
    """Difference of order 6 by an argument of any unit."""
    return sum(weight * (function(at + k * size) - function(at - k * size)) for k, weight in ((1, 0.75), (2, -0.15), (3, 1 / 60))) / size


def with_entry(values, i, value):
    copy = array(values).copy()
    copy[i] = value
    return copy


def differences(stepper, method, t, h, count, state, x):
    """The same derivatives by differences of steps."""
    def after(t=t, h=h, state=state, x=x, p=None):
        failed, out = stepper.step(method, t, h, count, state, x, p)
        assert not failed
        return out

    found = {"state": [difference(lambda v, i=i: after(state=with_entry(state, i, v)), state[i], 5e-5) for i in range(2 * stepper.n)],
             "t": [difference(lambda v: after(t=v), t, 1e-2)], "h": [difference(lambda v: after(h=v), h, 4e-3 * h)],
             "x": [difference(lambda v, i=i: after(x=with_entry(x, i, v)), x[i], 0.05) for i in range(len(x) - 1)]}
    if "p" in stepper.parts:
        found["p"] = [difference(lambda v, i=i: after(p=stepper.prepared(i, v)), stepper.model.p[i], 3e-3 * (abs(stepper.model.p[i]) or ZERO))
                      for i in range(stepper.parts["p"][1])]
    return {part: numpy.array(found[part]).T for part in stepper.parts}


def units(stepper, part, h):
    """The size of changes of the arguments of a part; parameters have their own."""
    count = stepper.parts[part][1]
    return {"h": array([h]), "p": array([abs(value) or ZERO for value in stepper.model.p[:count]])}.get(part, numpy.ones(count))


@pytest.mark.parametrize("scene", SCENES + (MORE if LONG else []), ids=name_of)
def test_derivatives_of_steps_are_those_of_differences(scene, tmp_path):
    stepper = Stepper(scene, tmp_path / "c")
    state, x, t, count = stepper.state(), stepper.inputs(), 0.3, 3
    lines = []
    for method, h in (("rk4", 2e-5), ("gauss", 1e-3)):
        failed, out, found = stepper.step(method, t, h, count, state, x, has_derivatives=True)
        assert not failed
        assert (out == stepper.step(method, t, h, count, state, x)[1]).all(), "derivatives change the state"
        expected = differences(stepper, method, t, h, count, state, x)
        for part in found:
            values, unit = expected[part] * units(stepper, part, h), units(stepper, part, h)
            scale = max(abs(values).max(), 1e-4 * abs(out).max())  # smaller values are rounding of the states
            lines.append(close(f"{method} by {part}", found[part] * unit, values, 1e-8, scale))
    check(lines)


def test_rk4_takes_the_steps_of_sim(tmp_path):
    """With rows, which sim keeps by their gains with this method, and a drive that varies with time."""
    options = settings({"n_rfe": 2})
    stepper = Stepper((REFERENCE, options), tmp_path / "c", "step")
    run, _, _ = motion(REFERENCE, *options, "--method", "rk4", "--step", "1e-4", "--until", "0.02", "--every", "0.02")
    failed, out = stepper.step("rk4", 0.0, 1e-4, 200, stepper.model.start)
    expected = [run[name + rate][-1] for rate in ("", "_d") for name in stepper.model.names]
    assert not failed and "p" not in stepper.parts
    check([close("state", out, expected, 1e-11)])


def test_the_state_alone(tmp_path):
    """rk4 without derivatives has a separate function, whose results are equal to the bit."""
    stepper = Stepper((MODELS / "crane.lua", []), tmp_path / "c", "step")
    n, state, out, work = stepper.n, stepper.state(), array(numpy.zeros(2 * stepper.n)), array(numpy.full(stepper.sizes["rk4"], numpy.nan))
    step = getattr(stepper.model.library, f"{stepper.name}_step_rk4_state")
    assert not step(pointer(stepper.model.p), pointer(stepper.model.x), ctypes.c_double(0.3), ctypes.c_double(2e-5), 3, pointer(state[:n].copy()),
                    pointer(state[n:].copy()), pointer(out), pointer(work))
    assert (out == stepper.step("rk4", 0.3, 2e-5, 3, state)[1]).all() and (out != state).any()


def test_steps_without_derivatives_need_little_memory(tmp_path):
    stepper = Stepper((MODELS / "crane.lua", []), tmp_path / "c", "step")
    n, sizes = stepper.n, stepper.sizes
    assert sizes["rk4"] == 8 * n and sizes["gauss"] < sizes["gauss_derivatives"] and sizes["rk4"] < sizes["rk4_derivatives"]
    assert sizes[""] == max(sizes.values())


def test_both_methods_are_of_order_4(tmp_path):
    stepper = Stepper((MODELS / "pendulum.lua", settings({"n_rfe": 1})), tmp_path / "c", "step")
    state = stepper.state(size=0.3)
    for method in METHODS:
        ends = [stepper.step(method, 0.0, 0.4 / count, count, state)[1] for count in (8, 16, 1000)]
        ratio = abs(ends[0] - ends[2]).max() / abs(ends[1] - ends[2]).max()
        assert 12 < ratio < 22, f"{method}: half the step, 1/{ratio:.3g} of the error"


def test_implicit_steps_are_stable_where_explicit_ones_are_not(tmp_path):
    """A steel rod of four elements, steps of 5 ms; a failure is reported."""
    stepper = Stepper((MODELS / "pendulum.lua", []), tmp_path / "c", "step")
    failed, out = stepper.step("gauss", 0.0, 5e-3, 400, stepper.model.start)
    assert not failed and abs(out).max() < 20
    assert stepper.step("rk4", 0.0, 5e-3, 400, stepper.model.start)[0] == 1
    for seed in range(4):  # unaligned elements, whose accelerations are far from any stage
        assert not stepper.step("gauss", 0.0, 1e-2, 3, stepper.state(seed, 1e-3))[0]
    for method in METHODS:
        assert stepper.step(method, 0.0, 1e-4, 1, with_entry(stepper.model.start, 0, numpy.nan))[0] == 1
        assert (stepper.step(method, 0.0, 1e-4, 0, stepper.model.start)[1] == stepper.model.start).all()


def test_implicit_steps_at_rest_under_a_preload(tmp_path):
    """Large forces cancel except for their rounding, compared with which no moving part is large."""
    random = numpy.random.default_rng(11)
    link = Stepper((TESTS / "models" / "preload.lua", []), tmp_path / "link", "step")
    for mass in random.uniform(0.1, 50, 1000):
        p, x = link.prepared(0, mass), array([mass * 9.81 * 0.8, 0])
        failed, out = link.step("gauss", 0, 0.01, 1, [0, 0], x, p)
        assert not failed and abs(out).max() < 1e-12, mass
    sliders = Stepper((TESTS / "models" / "preload.lua", settings({"which": "sliders"})), tmp_path / "sliders", "step")
    for h in (1e-3, 1e-2, 0.1):
        for size in 10**random.uniform(-14, -7, 200):
            state = array([*size * random.standard_normal(2), 0, 0])
            failed, out = sliders.step("gauss", 0, h, 1, state)
            assert not failed, (h, state)
            assert abs(out[:2]).max() < 100 * abs(state).max() + 1e-12, (h, state)


COUNTER = """#include "slider_step.h"
#include <stdio.h>
static unsigned values, derivatives, number = 12345;
void slider_qdd(const struct slider_parameters *p, const struct slider_inputs *x, double t, const double q[1], const double qd[1], double qdd[1]) {
    (void)p; (void)x; (void)t; (void)q; (void)qd;
    values++;
    number = number * 1664525u + 1013904223u;
    qdd[0] = (double)number / 4294967296.0 - 0.5;
}
void slider_d_qdd(const struct slider_parameters *p, const struct slider_inputs *x, double t, const double q[1], const double qd[1],
                  struct slider_d_qdd_result *out) {
    (void)p; (void)x; (void)t; (void)q; (void)qd;
    derivatives++;
    *out = (struct slider_d_qdd_result){.t = {0}};
}
int main(void) {
    const double q[1] = {0.3}, qd[1] = {0.7};
    double state[2], work[slider_step_gauss_work];
    const int failed = slider_step_gauss(NULL, NULL, 0, 0.9, 5, q, qd, state, NULL, work);
    printf("%d %u %u\\n", failed, values, derivatives);
    return 0;
}
"""


def test_the_most_calls_of_an_implicit_step(tmp_path):
    """Accelerations are random, so that no iteration converges: the calls are those of the header."""
    (tmp_path / "slider.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "slider", links = {\n'
                                         '{ "mass", joint = "x", mass = 1.3, spring = { x = 117 }, damper = { x = 0.2 } } } }\n')
    refdyn("gen", tmp_path / "slider.lua", "--emit", "step", "-o", tmp_path)
    (tmp_path / "counter.c").write_text(COUNTER)
    subprocess.run(["gcc", "-std=c11", "-O0", *WARNINGS, "-I", SOURCE / "runtime", "counter.c", "slider_step.c", "-lm", "-o", "counter"], cwd=tmp_path, check=True)
    stated = re.search(r"at most (\d+) iterations, in which it calls qdd (\d+) and d_qdd (\d+) times", (tmp_path / "slider_step.h").read_text()).groups()
    assert subprocess.run([tmp_path / "counter"], capture_output=True, text=True).stdout.split() == ["1", stated[1], stated[2]]
    assert 2 * int(stated[0]) == int(stated[1])


@pytest.mark.parametrize("compiler", (["gcc", "-std=c11"], ["clang", "-std=c11"], ["g++", "-std=c++17", "-x", "c++"], ["clang++", "-std=c++17", "-x", "c++"]),
                         ids=lambda words: words[0])
def test_steps_compile_without_a_warning(compiler, tmp_path):
    """With inputs and parameters, and without them."""
    for path, options in ((REFERENCE, ["--set", "n_rfe=1", "--set", "drive=input"]), (MODELS / "pendulum.lua", ["--fold"])):
        refdyn("gen", path, *options, "--emit", "step.p", "-o", tmp_path)
        subprocess.run([*compiler, "-O2", *WARNINGS, "-I", SOURCE / "runtime", "-c", next(tmp_path.glob("*_step.c")), "-o", tmp_path / "o"], check=True)
        for file in tmp_path.glob("*_step.[ch]"):
            file.unlink()


def test_steps_need_no_more_than_libm(tmp_path):
    stepper = Stepper((MODELS / "fourbar.lua", []), tmp_path / "c")
    subprocess.run(["gcc", "-O2", "-I", SOURCE / "runtime", "-c", f"{stepper.name}_step.c", "-o", "step.o"], cwd=tmp_path / "c", check=True)
    symbols = subprocess.run(["nm", "-u", tmp_path / "c" / "step.o"], check=True, capture_output=True, text=True).stdout.split()
    assert set(symbols) - {"U"} <= {f"{stepper.name}_qdd", f"{stepper.name}_d_qdd", "memcpy", "memset", "_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"}


def test_what_is_asked_for_wrongly(tmp_path):
    def said(*arguments, status):
        return refdyn("gen", *arguments, "-o", tmp_path / "out", status=status).stderr

    assert "--emit: 'steq' is not a quantity" in said(REFERENCE, "--emit", "steq", status=2)
    assert "step step.p" in said(REFERENCE, "--emit", "steq", status=2)
    assert "--emit: 'step.q' is not a part of a quantity" in said(REFERENCE, "--emit", "step.q", status=2)
    printed = said(REFERENCE, "--set", "form=printed", "--emit", "M,step", status=1)
    assert printed.endswith(": --emit step: nothing to emit; the model has no corrected form\n") and "manipulator.lua:" in printed


def test_steps_of_an_earlier_emission_are_removed(tmp_path):
    files = lambda: sorted(path.name for path in tmp_path.iterdir())
    refdyn("gen", MODELS / "pendulum.lua", "--emit", "step", "-o", tmp_path)
    assert files() == ["pendulum.c", "pendulum.h", "pendulum_step.c", "pendulum_step.h"]
    refdyn("gen", MODELS / "pendulum.lua", "--emit", "qdd", "-o", tmp_path)
    assert files() == ["pendulum.c", "pendulum.h"]
    (tmp_path / "pendulum_step.c").write_text("/* mine */\n")
    refdyn("gen", MODELS / "pendulum.lua", "--emit", "qdd", "-o", tmp_path)
    assert files() == ["pendulum.c", "pendulum.h", "pendulum_step.c"]
