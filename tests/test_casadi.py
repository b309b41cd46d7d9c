"""CasADi (from PyPI) loads emitted functions (`--for-casadi`); the examples of docs/casadi.md run."""
import ctypes
import importlib
import os
import re
import runpy
import subprocess
import sys
import tempfile
import types

import numpy
import pytest

from python_package import package  # noqa: F401 (a fixture)
from program import BUILD, LONG, MODELS, REFERENCE, SOURCE, TESTS, check, close, evaluate, refdyn

EXAMPLE = SOURCE / "docs" / "casadi"
ARM = EXAMPLE / "arm.lua"
COMPILERS = [["gcc", "-std=c11"], ["clang", "-std=c11"], ["g++", "-std=c++17", "-x", "c++"], ["clang++", "-std=c++17", "-x", "c++"]]
WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()
INCLUDE = ["-I", SOURCE / "runtime"]
# Rows of two levels, an input, parameters of which one is anchored; and an arm without rows, with --fold.
SCENES = [(REFERENCE, ["--set", "n_rfe=1", "--set", "drive=input", "--emit", "M,h,u,phi,psi,k,r,C,force,inverse,constrained,qdd_free,qdd,step"]),
          (ARM, ["--fold", "--emit", "M,inverse,qdd,step"])]
# A kink in time, events and friction, a closed chain, 65 coordinates as loops.
MORE = [(MODELS / "fourbar.lua", []), (TESTS / "models" / "bouncing.lua", []), (MODELS / "gantry.lua", []),
        (REFERENCE, ["--set", "n_rfe=22", "--set", "program=none", "--emit", "M,qdd"])]
QUANTITIES = ["M", "h", "u", "phi", "psi", "k", "force", "inverse", "qdd_free", "qdd"]


def name_of(scene):
    return scene[0].stem + str(len(scene[1]))


def install(folder):
    """Installs CasADi from PyPI with the pip of a fresh environment. NumPy is Debian's."""
    with tempfile.TemporaryDirectory(dir=BUILD) as part:
        subprocess.run([sys.executable, "-m", "venv", f"{part}/v"], check=True)
        done = subprocess.run([f"{part}/v/bin/python", "-m", "pip", "install", "-q", "--no-deps", "--disable-pip-version-check", "--target", f"{part}/casadi",
                               "casadi>=3.6"], capture_output=True, text=True)
        if done.returncode:
            pytest.skip(f"CasADi is not to be had from PyPI:\n{done.stderr[-1500:]}")
        os.rename(f"{part}/casadi", folder)


@pytest.fixture(scope="session")
def site():
    """The folder with CasADi in the build; it is installed there once."""
    folder = BUILD / f"casadi-{sys.version_info.major}.{sys.version_info.minor}"
    if not folder.exists():
        install(folder)
    return str(folder)


@pytest.fixture(scope="session")
def casadi(site):
    sys.path.append(site)
    yield importlib.import_module("casadi")
    sys.path.remove(site)


def build(scene, folder):
    """The shared library of a scene, built by the command that its source names, and the model's name."""
    refdyn("gen", scene[0], *scene[1], "--for-casadi", "-o", folder)
    name = next(folder.glob("*_casadi.c")).stem[:-len("_casadi")]
    command = re.search(r"^ \*     (cc .*)$", (folder / f"{name}_casadi.c").read_text(), re.M)[1]
    env = {**os.environ, "REFDYN_INCLUDE": str(SOURCE / "runtime")}
    subprocess.run(["sh", "-c", command.replace("-O2", "-O0")], cwd=folder, env=env, check=True)
    return str(folder / f"lib{name}_casadi.so"), name


def symbols(library):
    lines = subprocess.run(["nm", "-D", "--defined-only", library], check=True, capture_output=True, text=True).stdout.splitlines()
    return {line.split()[-1] for line in lines}


def functions(library):
    return sorted(name[:-len("_n_in")] for name in symbols(library) if name.endswith("_n_in") and not name.startswith("jac_"))


def flat(matrix):
    return numpy.array(matrix).ravel(order="F")


def arguments_of(function, start):
    """Arguments by name, without symmetry, near the start."""
    random = numpy.random.default_rng(5)
    values = {"t": numpy.array([0.3]), "h": numpy.array([1e-4]), "qdd": 2 * numpy.cos(1 + numpy.arange(start["q"].numel()))}
    for name, size in (("q", 0.02), ("qd", 0.02), ("inputs", 0.3), ("parameters", 0)):
        values[name] = flat(start[name]) + size * random.standard_normal(start[name].numel())
    return [values[name] for name in function.name_in()]


def results(function, arguments):
    out = function(*arguments)
    return [flat(one) for one in (out if isinstance(out, tuple) else [out])]


def difference(function, arguments, i, j):
    """Derivative of all results by one entry, by differences of order 6."""
    name, value = function.name_in(i), arguments[i][j]
    sizes = {"parameters": 5e-4 * (abs(value) or 1e-5), "h": 4e-3 * value, "t": 1e-2, "inputs": 0.05}
    size = sizes.get(name, 5e-5)
    columns = 0
    for k, weight in ((-3, -1 / 60), (-2, 0.15), (-1, -0.75), (1, 0.75), (2, -0.15), (3, 1 / 60)):
        moved = [array.copy() for array in arguments]
        moved[i][j] += k * size
        columns = columns + weight / size * numpy.concatenate(results(function, moved))
    return columns


def wrong_derivatives(function, arguments):
    """One line for each block that differs from the differences."""
    values = results(function, arguments)
    blocks = function.jacobian()(*arguments, *[0 * value for value in values])
    blocks, ends, lines = [numpy.array(block) for block in blocks], numpy.cumsum([len(value) for value in values]), []
    for i in range(function.n_in()):
        unit = numpy.abs(arguments[i]) + 1e-5 if function.name_in(i) in ("parameters", "h") else numpy.ones(len(arguments[i]))
        for j in range(len(arguments[i])):
            found = numpy.concatenate([blocks[o * function.n_in() + i][:, j] for o in range(len(values))]) * unit[j]
            expected = difference(function, arguments, i, j) * unit[j]
            for value, a, b in zip(values, numpy.split(found, ends[:-1]), numpy.split(expected, ends[:-1])):
                scale = max(abs(b).max(), 1e-3 * abs(value).max(), 1e-9)
                lines.append(close(f"{function.name()} by {function.name_in(i)} {j}", a, b, 1e-7, scale))
    return lines


@pytest.mark.parametrize("scene", SCENES + (MORE if LONG else []), ids=name_of)
def test_values_and_derivatives(scene, tmp_path, casadi):
    library, name = build(scene, tmp_path)
    start, lines, differentiable = casadi.external(f"{name}_defaults", library)(), [], 0
    options = [word for word in scene[1] if not word.startswith("M,")]
    options = options[:options.index("--emit")] if "--emit" in options else options
    qdd = casadi.external(f"{name}_qdd", library)
    q, qd, t, inputs, parameters = arguments_of(qdd, start)
    names = re.findall(r" \*   inputs \d+ (\w+)", (tmp_path / f"{name}_casadi.c").read_text())
    expected = evaluate(scene[0], {"t": t[0], "q": list(q), "qd": list(qd), "qdd": list(2 * numpy.cos(1 + numpy.arange(len(q)))), "inputs": dict(zip(names, inputs))}, *options)
    for one in functions(library):
        function, quantity = casadi.external(one, library), one[len(name) + 1:]
        if quantity == "defaults":
            continue
        arguments = arguments_of(function, start)
        if quantity in QUANTITIES and quantity in expected:
            rows = [[value or 0 for value in row] if isinstance(row, list) else row or 0 for row in expected[quantity]]
            found = numpy.array(function(*arguments)).reshape(numpy.shape(rows))
            lines.append(close(quantity, found, rows, 1e-10))
        if f"jac_{one}" in symbols(library):
            differentiable += 1
            lines += wrong_derivatives(function, arguments)
    assert differentiable >= (2 if "qdd" in scene[1] else 1)
    check(lines)


def test_true_patterns(tmp_path, casadi):
    """Entries that are always zero are not in the pattern: those of other branches, and those that rows do not read."""
    library, name = build((MODELS / "branched.lua", ["--emit", "M,C"]), tmp_path)
    start = casadi.external(f"{name}_defaults", library)()
    M, C = (casadi.external(f"{name}_{quantity}", library) for quantity in "MC")
    parents = evaluate(MODELS / "branched.lua")
    n = len(parents["coordinates"])
    assert 0 < M.nnz_out(0) < n * n and 0 < C.nnz_out(0) < C.numel_out(0)
    arguments = arguments_of(M, start)
    found, full = M(*arguments), evaluate(MODELS / "branched.lua", {"t": 0.3, "q": list(arguments[0]), "qd": list(arguments[1])})["M"]
    check([close("M", numpy.array(found), full, 1e-12)])
    assert (numpy.array(casadi.DM(found.sparsity(), 1)) >= (numpy.abs(full) > 1e-12)).all()


def test_expressions_of_casadi(tmp_path, casadi):
    """Derivatives pass through CasADi's graph, forward and in reverse; CasADi's own C calls the functions."""
    library, name = build(SCENES[1], tmp_path)
    qdd, start = casadi.external(f"{name}_qdd", library), casadi.external(f"{name}_defaults", library)()
    q, qd, t, inputs, parameters = arguments_of(qdd, start)
    x, u = casadi.MX.sym("x", 2 * len(q)), casadi.MX.sym("u", 2)
    rates = casadi.vertcat(x[len(q):], qdd(x[:len(q)], x[len(q):], 0, u, start["parameters"]))
    cost = casadi.sumsqr(rates)
    function = casadi.Function("f", [x, u], [rates, casadi.jacobian(rates, u), casadi.gradient(cost, x), casadi.jtimes(rates, x, x)])
    state = numpy.concatenate([q, qd])
    found = function(state, inputs)
    plain = casadi.Function("g", [x, u], [rates])
    size = 1e-5

    def along(direction):
        return sum(weight * flat(plain(state + k * size * direction, inputs)) for k, weight in ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12))) / size

    expected = numpy.array([2 * flat(plain(state, inputs)) @ along(e) for e in numpy.eye(len(state))])
    check([close("gradient", flat(found[2]), expected, 1e-7), close("forward", flat(found[3]), along(state), 1e-7)])
    current = os.getcwd()
    os.chdir(tmp_path)
    try:
        function.generate("f.c")
    finally:
        os.chdir(current)
    subprocess.run(["gcc", "-fPIC", "-shared", "f.c", "-o", "libf.so", "-L.", f"-l{name}_casadi", "-Wl,-rpath,.", "-Wl,-rpath,$ORIGIN", "-lm"], cwd=tmp_path, check=True)
    again = casadi.external("f", str(tmp_path / "libf.so"))(state, inputs)
    assert all((flat(a) == flat(b)).all() for a, b in zip(found, again))


def test_second_derivatives_by_differences(tmp_path, casadi):
    """Second derivatives as in docs/casadi/rest_to_rest.py: differences of exact first derivatives, with rows and an input; quantities
    without derivatives on request."""
    library, name = build((REFERENCE, ["--set", "n_rfe=2", "--set", "drive=input", "--emit", "qdd,h"]), tmp_path)
    start, lines = casadi.external(f"{name}_defaults", library)(), []
    qdd, jacobian = casadi.external(f"{name}_qdd", library), casadi.external(f"jac_{name}_qdd", library, {"enable_fd": True})
    inputs = qdd.mx_in()
    twice = casadi.Function(f"{name}_qdd", inputs, qdd.call(inputs), qdd.name_in(), qdd.name_out(),
                            {"custom_jacobian": jacobian, "jac_penalty": 0, "never_inline": True})
    arguments, n = arguments_of(qdd, start), start["q"].numel()
    state, weights = casadi.MX.sym("state", 2 * n), numpy.random.default_rng(7).standard_normal(n)
    H, g = casadi.hessian(casadi.dot(weights, twice(state[:n], state[n:], *arguments[2:])), state)
    function, at = casadi.Function("H", [state], [H, g]), numpy.concatenate(arguments[:2])
    found, size = numpy.array(function(at)[0]), 1e-4
    expected = sum(weight / size * numpy.array([flat(function(at + k * size * e)[1]) for e in numpy.eye(2 * n)])
                   for k, weight in ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)))
    lines.append(close("second derivatives", found, expected, 1e-5))
    h, fd = (casadi.external(f"{name}_h", library, options) for options in ({}, {"enable_fd": True}))
    with pytest.raises(RuntimeError, match=f"Derivatives cannot be calculated for {name}_h"):
        h.jacobian()
    by_qd = numpy.array(fd.jacobian()(*arguments, numpy.zeros(n))[1])
    expected = numpy.array([difference(h, arguments, 1, j) for j in range(n)]).T
    lines.append(close("h by qd", by_qd, expected, 1e-5))
    check(lines)


def test_no_name_of_ours_is_in_the_way(tmp_path, casadi):
    library, name = build(SCENES[1], tmp_path)
    ours = [symbol for symbol in symbols(library) if not symbol.startswith((f"{name}_", f"jac_{name}_", "refdyn_", "_"))]
    assert not ours
    for absent in ("model", "prepare", "d_qdd", "start"):
        with pytest.raises(RuntimeError):
            casadi.external(f"{name}_{absent}", library)
    header = casadi.external(f"{name}_step_rk4", library)
    assert header.name_in() == ["q", "qd", "t", "h", "inputs", "parameters"] and header.name_out() == ["q_next", "qd_next"]
    failed = casadi.external(f"{name}_step_gauss", library)
    with pytest.raises(RuntimeError):
        failed(numpy.full(4, numpy.nan), numpy.zeros(4), 0, 1e-3, numpy.zeros(2), [])


def test_the_printed_form_has_values_alone(tmp_path):
    library, name = build((REFERENCE, ["--set", "n_rfe=1", "--set", "form=printed", "--emit", "M,qdd"]), tmp_path)
    assert ctypes.CDLL(library).manipulator_qdd_init_mem(3) == 0, "not told as done"
    assert functions(library) == ["manipulator_M", "manipulator_constrained", "manipulator_defaults", "manipulator_qdd"]
    assert not any(symbol.startswith("jac_") for symbol in symbols(library))


def test_what_is_asked_for_wrongly(tmp_path):
    def said(*arguments, status):
        return refdyn(*arguments, "--for-casadi", "-o", tmp_path / "out", status=status).stderr

    line = [number for number, text in enumerate(ARM.read_text().splitlines(), 1) if text.startswith("return rd.model")][0]
    assert said("gen", ARM, "--emit", "d_qdd.q,anchor", status=1) == (
        f"{ARM}:{line}: --emit d_qdd.q,anchor: nothing to emit for this model; anchor: no anchored parameters\n")
    assert said("gen", ARM, "--emit", "d_qdd.q,start", status=1) == (
        f"{ARM}:{line}: --emit d_qdd.q,start: no function for CasADi; name a function of the state, such as qdd, whose derivatives are emitted with it\n")
    assert said("gen", ARM, "--emit", "phi", status=1).startswith(f"{ARM}:{line}: --emit phi: nothing to emit for this model; phi: no position rows")
    assert said("gen", ARM, "--emit", "qdq", status=2).startswith("refdyn gen: --emit: 'qdq' is not a quantity; did you mean \"qdd\"?\n")
    assert said("sim", ARM, "--until", "1", status=2).startswith("refdyn sim: unknown option --for-casadi\n")
    assert said("gen", REFERENCE, "--set", "form=printed", "--emit", "step", status=1).endswith(": --emit step: nothing to emit; the model has no corrected form\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("compiler", COMPILERS, ids=lambda words: words[0])
def test_it_compiles_without_a_warning(compiler, tmp_path):
    refdyn("gen", REFERENCE, "--set", "n_rfe=1", "--emit", "M,phi,step", "--for-casadi", "-o", tmp_path)
    how = ["-O1"] if LONG else ["-fsyntax-only"]
    subprocess.run([*compiler, *how, *WARNINGS, *INCLUDE, "-c", tmp_path / "manipulator_casadi.c", "-o", tmp_path / "o"], check=True)


def test_parts_of_a_long_model(tmp_path):
    """Sources in several parts become one file here; the file is removed when it is no longer requested."""
    scene = (REFERENCE, ["--set", "n_rfe=10", "--loops", "never", "--emit", "M,qdd"])
    refdyn("gen", *[scene[0], *scene[1]], "--for-casadi", "-o", tmp_path)
    assert (tmp_path / "manipulator_2.c").exists() and '#include "manipulator_2.c"' in (tmp_path / "manipulator_casadi.c").read_text()
    subprocess.run(["gcc", "-fsyntax-only", *INCLUDE, tmp_path / "manipulator_casadi.c"], check=True)
    refdyn("gen", REFERENCE, "--set", "n_rfe=1", "-o", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["manipulator.c", "manipulator.h"]


# ---- The examples ----

def test_two_discretisations_find_one_minimum(tmp_path, casadi, monkeypatch):
    """The error of shooting falls with the square of the step, and its limit is the minimum of collocation."""
    library, _ = build((ARM, ["--emit", "qdd,step"]), tmp_path)
    monkeypatch.setattr(sys, "argv", ["rest_to_rest.py", library])
    example = runpy.run_path(str(EXAMPLE / "rest_to_rest.py"), run_name="example")
    first, coarse, fine = example["collocation"](25), example["shooting"](40), example["shooting"](80)
    limit = fine + (fine - coarse) / 3
    check([close("coarse shooting", [coarse], [first], 3e-3), close("fine shooting", [fine], [first], 7e-4), close("its limit", [limit], [first], 1e-5)])


def arrives(said):
    off, rate, torque, bend = map(float, re.search(r"off by (\S+) rad, rates by (\S+) rad/s; largest torque (\S+) N m, largest bend (\S+) rad", said).groups())
    return off < 2e-3 and rate < 1e-2 and torque < 10 and 0.1 < bend < 0.3


@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
def test_predictive_control(tmp_path):
    refdyn("gen", ARM, "--set", "n_rfe=4", "--fold", "--emit", "step", "-o", tmp_path)
    subprocess.run(["cc", "-O2", *INCLUDE, "-I", tmp_path, EXAMPLE / "control.c", tmp_path / "arm.c", tmp_path / "arm_step.c", "-lm", "-o", tmp_path / "control"],
                   check=True)
    said = subprocess.run([tmp_path / "control"], check=True, capture_output=True, text=True).stdout
    assert arrives(said), said


def test_steps_for_acados(tmp_path):
    """acados' form of a function compared with the step itself, with our own declarations, since acados is not installed."""
    refdyn("gen", ARM, "--set", "n_rfe=2", "--fold", "--emit", "step,start", "-o", tmp_path)
    subprocess.run(["cc", "-O1", "-Wall", "-Wextra", "-Werror", *INCLUDE, "-I", tmp_path, "-I", TESTS / "casadi", "-I", EXAMPLE, TESTS / "casadi" / "call_acados.c",
                    "-lm", "-o", tmp_path / "call"], check=True)
    refdyn("gen", ARM, "--emit", "step", "-o", tmp_path / "unfolded")
    refused = subprocess.run(["cc", "-fsyntax-only", *INCLUDE, "-I", tmp_path / "unfolded", "-I", TESTS / "casadi", "-I", EXAMPLE, EXAMPLE / "acados_step.c"],
                             capture_output=True, text=True)
    assert refused.returncode and "arm.lua is to be emitted with --fold" in refused.stderr
    random = numpy.random.default_rng(2)
    values = numpy.concatenate([random.standard_normal(2), 0.1 * random.standard_normal(8)])

    def call(values):
        lines = subprocess.run([tmp_path / "call", *map(str, values)], check=True, capture_output=True, text=True).stdout.splitlines()
        return [numpy.array([float(word) for word in line.split()]) for line in lines]

    found, size, lines = call(values), 1e-4, []
    for j in range(10):
        moved = [call(values + k * size * numpy.eye(10)[j])[0] for k in (-2, -1, 1, 2)]
        expected = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / (12 * size)
        lines.append(close(f"by {j}", [column[j] for column in found[1:]], expected, 1e-8))
    check(lines)


# ---- From Python ----

def test_page_of_python(package, casadi, capsys, monkeypatch):
    monkeypatch.chdir(SOURCE)
    monkeypatch.setenv("CC", "cc -O0")
    for text in re.findall(r"^```python\n(import refdyn.*?)^```", (SOURCE / "docs" / "casadi.md").read_text(), re.M | re.S):
        exec(text, {})
    assert "('qdd', 'qdd_free')" in capsys.readouterr().out


def test_functions_by_default(package, tmp_path, monkeypatch):
    """The functions by default are those that the page lists, for models with and without points, rows and events. Needs no CasADi."""
    loaded = types.SimpleNamespace(external=lambda name, library, options={}: lambda: {})
    monkeypatch.setitem(sys.modules, "casadi", loaded)
    monkeypatch.setenv("CC", "cc -O0")
    listed = re.search(r"^\| models \| functions \|\n(.*?)\n\n", (SOURCE / "docs" / "casadi.md").read_text(), re.M | re.S)[1]
    of = {line.split("|")[1].strip(): {*re.findall(r"`(\w+)`", line)} for line in listed.splitlines()}
    fallen = """return require "refdyn".model { name = "fallen", gravity = { 0, 0, -9.81 }, links = { { "ball", joint = "z", mass = 1, start = { z = 1 } } },
  events = function(s) return { require "refdyn".event { s.q.ball_z, restitution = 0.5, name = "floor" } } end }"""
    for model, kinds in ((package.Model(MODELS / "pendulum.lua"), ["with points", "without rows"]), (package.Model(MODELS / "fourbar.lua"), ["with points", "with rows"]),
                         (package.Model.from_text(fallen), ["without rows", "with events"])):
        assert set(model.casadi().names) == of["all"].union(*(of[kind] for kind in kinds)), model
    with pytest.raises(ValueError, match="^quantities: no name; give at least one$"):
        model.casadi([])
    with pytest.raises(TypeError, match="^fold: 'yes'; must be True or False$"):
        model.casadi("qdd", fold="yes")


def test_one_call_of_python(package, casadi, monkeypatch):
    """arm.casadi(): the numbers of the package's quantities, derivatives, names, and each wrong call."""
    monkeypatch.setenv("CC", "cc -O0")
    arm = package.Model(REFERENCE, n_rfe=1, drive="input")
    f = arm.casadi()
    assert {"M", "h", "energy", "qdd", "phi", "psi", "r", "step_rk4", "step_gauss"} <= set(f.names) and f.coordinates == arm.coordinates and f.inputs == ("tau",)
    random = numpy.random.default_rng(11)
    q, qd = arm.q0 + 0.05 * random.standard_normal(4), 0.2 * random.standard_normal(4)
    p = numpy.array([arm.parameters[name] for name in f.parameters])
    numbers = dict(zip(f.parameters, p))
    assert (flat(f.defaults["parameters"]) == p).all() and (flat(f.defaults["q"]) == arm.q0).all()
    check([close(name, flat(getattr(f, name)(q, qd, 0.3, [1.7], p)), getattr(arm, name)(q, qd, 0.3, [1.7], numbers).ravel(order="F"), 1e-13) for name in ("M", "h", "qdd", "phi", "energy")])
    u = casadi.MX.sym("u")
    by_u = casadi.Function("by_u", [u], [casadi.jacobian(f.qdd(q, qd, 0.3, u, p), u)])
    check([close("by inputs", flat(by_u(1.7)), arm.d_qdd(q, qd, 0.3, [1.7], numbers)["x"].ravel(), 1e-12)])
    w = casadi.MX.sym("w", 4)
    assert numpy.isfinite(flat(casadi.Function("by_q", [w], [casadi.jacobian(f.M(w, qd, 0.3, 0, p), w)])(q))).all()
    assert f.step_gauss(q, qd, 0, 1e-3, [1.7], p)[0].shape == (4, 1) and repr(f).startswith("<refdyn functions of CasADi: M, h")
    folded = arm.casadi(["qdd"], fold=True)
    assert folded.parameters == ("xc",) and "step_gauss" not in folded.names
    check([close("folded", flat(folded.qdd(q, qd, 0.3, [1.7], [numbers["xc"]])), arm.qdd(q, qd, 0.3, [1.7]), 1e-12)])
    for kind, message, call in ((AttributeError, "the functions have no 'qd'; did you mean 'qdd'\\?", lambda: f.qd), (ValueError, "quantities: 'qdb' is not a quantity; did you mean 'qdd'\\?", lambda: arm.casadi("qdb"))):
        with pytest.raises(kind, match=message):
            call()
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(RuntimeError, match="casadi: the compiler no-such-compiler cannot be run: No such file or directory; set CC or install a C compiler"):
        arm.casadi("qdd", fold=True)
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(ImportError, match="casadi: CasADi is missing; install it with pip install casadi"):
        arm.casadi()



@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
def test_the_page(tmp_path, site):
    """All its commands except the first: both discretisations have the same minimum to 1e-4, and the 1 kHz loop brings the arm to rest."""
    (tmp_path / "docs").symlink_to(SOURCE / "docs")
    env = {**os.environ, "REFDYN_INCLUDE": str(SOURCE / "runtime"), "PATH": f"{BUILD / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": site}
    page = (SOURCE / "docs" / "casadi.md").read_text()
    (tmp_path / "shown.py").write_text("\n".join(re.findall(r"^```python\n(import casadi.*?)^```", page, re.M | re.S)))
    lines = "".join(re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S)).splitlines()
    assert lines[0] == "python3 -m pip install casadi"
    script = "\n".join([f"python3() {{ {sys.executable} \"$@\"; }}", *lines[1:], "python3 shown.py"])
    said = subprocess.run(["bash", "-e", "-c", script], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=500)
    assert said.returncode == 0, said.stdout + said.stderr
    first, second = map(float, re.search(r"(\S+) by collocation, (\S+) by shooting", said.stdout).groups())
    check([close("collocation", [first], [8.67454], 1e-5), close("shooting", [second], [first], 1e-4)])
    assert arrives(said.stdout), said.stdout
