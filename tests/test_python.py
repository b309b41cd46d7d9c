"""The Python package: its wheel, built as a user builds it, and everything that its page promises."""
import copy
import importlib
import inspect
import json
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
import zipfile

import numpy as np
import pytest
import xarray

import browser
import python_package
from program import BUILD, LONG, MODELS, REFERENCE, SOURCE, TESTS, VERSION, check, evaluate, motion, refdyn
from python_package import same

PAGE = (SOURCE / "docs" / "python.md").read_text()
THREADS = 20
MAKE_WHEEL = SOURCE / "runtime" / "bindings" / "python" / "make_wheel"
C_LIBRARY = {"linux-vdso.so.1", "libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
COPY_WITHOUT = shutil.ignore_patterns("build", ".git", "__pycache__")


def run(*words, cwd=None, timeout=300, **env):
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True, timeout=timeout,
                          env={**{name: value for name, value in os.environ.items() if name != "PYTHONPATH"}, **env})
    assert done.returncode == 0, f"{words}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def make_wheel(folder):
    """The wheel that stands alone; its tools come from PyPI. Optimising takes a minute, and only tests/long does it."""
    quickly = [] if LONG else ["--config-settings=cmake.define.CMAKE_C_FLAGS_RELEASE=-O0 -DNDEBUG"]
    done = subprocess.run([sys.executable, MAKE_WHEEL, folder, *quickly], capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode and re.search("Temporary failure in name resolution|Failed to establish a new connection|No matching distribution found", said):
        pytest.fail(f"PyPI is out of reach, from where the tools of the build come:\n{said[-1500:]}", pytrace=False)
    assert done.returncode == 0, said[-6000:]
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, and the Python of a fresh environment in which it is installed. NumPy, xarray and h5py are Debian's."""
    folder = tmp_path_factory.mktemp("python")
    run(sys.executable, "-m", "venv", "--system-site-packages", folder / "v")
    python = folder / "v" / "bin" / "python"
    file = make_wheel(folder)
    run(python, "-m", "pip", "install", "--no-deps", "--no-index", file)
    return file, python


@pytest.fixture(scope="module")
def package(wheel):
    """The installed package in this process."""
    site = run(wheel[1], "-c", "import sysconfig; print(sysconfig.get_path('platlib'))").strip()
    sys.path.insert(0, site)
    yield importlib.import_module("refdyn")
    sys.path.remove(site)


@pytest.fixture(scope="module")
def arm(package):
    return package.Model(REFERENCE, n_rfe=4)


def states(model, count, seed=1):
    """States without symmetry near the start."""
    random = np.random.default_rng(seed)
    return [center + size * random.standard_normal((count, len(center))) for center, size in ((model.q0, 0.1), (model.qd0, 0.5))]


@pytest.mark.quick
def test_package_of_the_sources(tmp_path):
    folder = python_package.build(tmp_path)
    model = TESTS / "models" / "double_pendulum.lua"
    expected = evaluate(model)
    said = run(sys.executable, "-c", f"""import refdyn
model = refdyn.Model({str(model)!r})
print([float(value).hex() for value in model.M(model.q0).ravel()])
print(float(model.simulate(0.1, tol=1e-6).upper_theta[-1]))""", cwd=folder, PYTHONPATH=str(folder)).splitlines()
    assert said[0] == str([float(value).hex() for row in expected["M"] for value in row])
    columns, _, _ = motion(model, "--until", 0.1, "--tol", 1e-6)
    assert float(said[1]) == columns["upper_theta"][-1]


def test_interrupt_of_a_compilation(tmp_path):
    """Ctrl-C while the program compiles: neither a file in the cache nor the compiler remains."""
    python_package.build(tmp_path)
    (tmp_path / "cc").write_text(f'#!/bin/sh\necho $$ >>"{tmp_path}/pids"\nexec sleep 100\n')
    (tmp_path / "cc").chmod(0o755)
    env = {**os.environ, "PYTHONPATH": str(tmp_path), "REFDYN_CACHE": str(tmp_path / "cache"), "REFDYN_BACKGROUND": "0", "CC": str(tmp_path / "cc")}
    program = f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); import refdyn; refdyn.Model({str(REFERENCE)!r})"
    process = subprocess.Popen([sys.executable, "-c", program], env=env, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 60
    while not (tmp_path / "pids").exists() and time.monotonic() < end:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in process.communicate(timeout=60)[1] and os.listdir(tmp_path / "cache") == []
    for pid in (tmp_path / "pids").read_text().split():
        with pytest.raises(ProcessLookupError):
            os.kill(int(pid), 0)


def test_quantities_change_over(tmp_path):
    """A quantity begins with the first tier, and continues with the optimised library, by the same bits. A damaged one is not
    loaded. A long compilation is reported meanwhile."""
    python_package.build(tmp_path)
    (tmp_path / "cc").write_text(f'#!/bin/sh\ncase "$*" in *-fsyntax-only*) ;; *) while test -e "{tmp_path}/hold"; do sleep 0.01; done ;; esac\nexec cc "$@"\n')
    (tmp_path / "cc").chmod(0o755)
    (tmp_path / "hold").touch()
    program = f"""import os, threading, time, numpy, refdyn
arm = refdyn.Model({str(REFERENCE)!r}, n_rfe=2)
compiled, first = arm.M._compiled, arm.M._library
q = numpy.random.default_rng(7).standard_normal((30, len(arm.q0)))
before = [arm.M(row).tobytes() + arm.Q(row).tobytes() for row in q]
print(compiled.optimised is not None, compiled.library is first)
os.unlink({str(tmp_path / "hold")!r})
end = time.monotonic() + 60
while compiled.library is first and time.monotonic() < end:
    time.sleep(0.01)
    arm.M(q[0])
print(compiled.optimised is None, arm.M._library is compiled.library, arm.Q._library is first)
print(before == [arm.M(row).tobytes() + arm.Q(row).tobytes() for row in q], arm.Q._library is compiled.library)
open({str(tmp_path / "hold")!r}, "w").close()
threading.Timer(3, os.unlink, [{str(tmp_path / "hold")!r}]).start()
arm.M(q)
other = refdyn.Model({str(REFERENCE)!r}, n_rfe=3)
path = other.M._compiled.optimised
with open(path + ".new", "wb") as file:
    file.write(open(compiled.description["library"], "rb").read()[:-1])
os.rename(path + ".new", path)
other.M(other.q0)
print(other.M._compiled.optimised, other.M._compiled.library is other.M._library)"""
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=300,
                          env={**os.environ, "PYTHONPATH": str(tmp_path), "REFDYN_BACKGROUND": "1", "CC": str(tmp_path / "cc"), "REFDYN_CACHE": str(tmp_path / "cache")})
    assert done.stdout.splitlines() == ["True True", "True True True", "True True", "None True"], done.stderr
    assert done.stderr == "refdyn: compiling manipulator.c and 1 more ...\n"


# ---- The wheel ----

def test_wheel_has_all(wheel):
    file, python = wheel
    names = zipfile.ZipFile(file).namelist()
    for name in ("bin/refdyn", "include/refdyn/refdyn.h", "lib/librefdyn_runtime.a", "py.typed", "core.pyi", "model.py", "share/refdyn/three.min.js"):
        assert f"refdyn/{name}" in names
    assert all(name.split("/")[0] in ("refdyn", f"refdyn-{VERSION}.dist-info") for name in names), names
    program = python.parent / "refdyn"
    assert run(program, "--version").split()[1] == VERSION


def test_wheel_has_the_licences_of_what_it_contains(wheel):
    with zipfile.ZipFile(wheel[0]) as file:
        info = f"refdyn-{VERSION}.dist-info"
        metadata = file.read(f"{info}/METADATA").decode()
        assert metadata.count("\nLicense-Expression: MIT AND BSD-2-Clause AND BSD-3-Clause AND Zlib\n") == 1
        listed = re.findall(r"^License-File: (.*)", metadata, re.M)
        assert sorted(f"{info}/licenses/{name}" for name in listed) == sorted(name for name in file.namelist() if "/licenses/" in name and not name.endswith("/"))
        assert listed[0] == "LICENSE" and {path.rpartition("/")[2] for path in listed} >= {"lua", "jansson", "libmd", "lapack", "hdf5", "zlib", "expat", "minizip", "three.js"}
        assert all(re.search("copyright|public domain", file.read(f"{info}/licenses/{name}").decode(), re.I) for name in listed)


def libraries_of(file):
    return set(re.findall(r"[\w.+-]+\.so[.\d]*(?= )", run("ldd", file)))


def test_wheel_needs_the_c_library_alone(wheel, package):
    """auditwheel has repaired it, and its name says for which C libraries and versions of Python it is."""
    assert re.fullmatch(rf"refdyn-{VERSION}-cp311-abi3-manylinux_2_\d+_\w+\.whl", wheel[0].name), wheel[0].name
    for file in (package.prefix / "bin" / "refdyn", package.prefix / "core.abi3.so"):
        assert "libc.so.6" in libraries_of(file) and libraries_of(file) <= C_LIBRARY, libraries_of(file)
    assert not list(package.prefix.rglob("*gsl*"))


def test_wheel_computes_with_what_it_contains(package, tmp_path):
    """Eigenvalues and singular values of LAPACK, HDF5, three.js, expat and minizip: as the program that links shared libraries."""
    alone = package.prefix / "bin" / "refdyn"
    modes = [json.loads(run(program, "modes", MODELS / "midspan.lua", "--modes", "4"))["modes"] for program in (BUILD / "bin" / "refdyn", alone)]
    assert np.allclose([mode["omega"] for mode in modes[1]], [mode["omega"] for mode in modes[0]], rtol=1e-10)
    said = [subprocess.run([program, "sim", TESTS / "models" / "reach.lua", "--until", "2", "-o", tmp_path / "reach.csv"], capture_output=True, text=True).stderr
            for program in (BUILD / "bin" / "refdyn", alone)]
    found = [re.findall("condition of the constraint rows there is (.*?):", text) for text in said]
    assert len(found[0]) == 1 and abs(np.log10(float(found[1][0]) / float(found[0][0]))) < 0.5, said
    three = package.prefix / "share" / "refdyn" / "three.min.js"
    assert three.stat().st_size > 500_000
    installed = three.read_bytes()
    run(alone, "sim", MODELS / "pendulum.lua", "--until", 0.1, "-o", tmp_path / "run.h5")
    three.write_bytes(b"/* of the wheel */\n" + installed)
    try:
        run(alone, "view", tmp_path / "run.h5", "-o", tmp_path / "page.html", REFDYN_THREE="")
    finally:
        three.write_bytes(installed)
    assert b"/* of the wheel */" in browser.program_of((tmp_path / "page.html").read_text())
    run(alone, "import", next((TESTS / "robots").glob("*.urdf")), "-o", tmp_path / "robot.lua")
    run(alone, "export", MODELS / "pendulum.lua", "--fmu", "3.0", "-o", tmp_path / "pendulum.fmu")
    assert zipfile.ZipFile(tmp_path / "pendulum.fmu").testzip() is None


def test_make_wheel_says_how_it_is_called():
    done = subprocess.run([sys.executable, MAKE_WHEEL], capture_output=True, text=True)
    assert done.returncode == 1 and "runtime/bindings/python/make_wheel FOLDER" in done.stderr and "runtime/bindings/python/make_wheel dist\n" in PAGE


@pytest.mark.skipif(not LONG or os.getuid() != 0 or not shutil.which("debootstrap"), reason="tests/long, as root and with debootstrap: installs a bare Debian")
def test_wheel_on_a_bare_debian(wheel, tmp_path):
    """Debian with Python and a C compiler alone; NumPy, xarray and h5py come from PyPI."""
    root, given = tmp_path / "root", tmp_path / "root" / "given"
    run("debootstrap", "--variant=minbase", "--include=python3,python3-venv,gcc,libc6-dev", "bookworm", root, timeout=1500)
    given.mkdir()
    run(wheel[1], "-m", "pip", "download", "-q", "-d", given, f"{wheel[0]}[batch]", timeout=600)
    shutil.copytree(MODELS, given / "models")
    lacking = ("inputs=None", "arm.live(", ".plan(")
    (given / "page.py").write_text("\n".join(text for _, text in blocks("python") if not any(word in text for word in lacking)))
    for name, text in blocks("xml"):
        (given / name).write_text(text)
    (given / "commands").write_text("""cd /given && python3 -m venv v && v/bin/pip install -q --no-index --find-links . 'refdyn[batch]' && v/bin/python page.py
v/bin/refdyn sim models/midspan.lua --until 0.1 -o run.h5 && v/bin/refdyn view run.h5 -o page.html && ls page.html""")
    said = run("unshare", "--pid", "--fork", f"--mount-proc={root}/proc", "chroot", root, "sh", "-e", "/given/commands", timeout=1500).split()
    assert said[:2] == ["(13,", "13)"] and said[-1] == "page.html", said


def test_methods_of_gsl_are_not_in_the_wheel(package):
    for method in ("msbdf", "bsimp"):
        done = subprocess.run([package.prefix / "bin" / "refdyn", "sim", REFERENCE, "--until", "1", "--method", method], capture_output=True, text=True)
        assert done.returncode == 2 and f"--method: '{method}' needs GSL; build refdyn with it\n" in done.stderr


def test_planning_is_not_in_the_wheel(package, tmp_path):
    done = subprocess.run([package.prefix / "bin" / "refdyn", "plan", REFERENCE, tmp_path / "plan.lua", "-o", tmp_path / "plan.json"], capture_output=True, text=True)
    command = "pip install . -C cmake.define.REFDYN_NLOPT=ON"
    assert done.returncode == 1 and done.stderr == f"refdyn: plan needs NLopt; install Debian's libnlopt-dev and build refdyn again (for Python: {command})\n"
    assert command in (SOURCE / "docs" / "python.md").read_text()
    with pytest.raises(package.ModelError, match=f"^plan needs NLopt; .*{re.escape(command)}"):
        package.Model(REFERENCE).plan(vary={"m_E": (1, 2)}, t_end=1, minimise="m_E")


def test_imports_are_light(package, wheel):
    """The command and `import refdyn` load no package, quantities no xarray."""
    heavy = "{'numpy', 'xarray', 'h5py', 'subprocess', 'typing'} & set(sys.modules)"
    for name in ("refdyn", "refdyn.launcher"):
        assert run(wheel[1], "-S", "-c", f"import sys; sys.path.append({str(package.prefix.parent)!r}); import {name}; print({heavy})") == "set()\n"
    assert "from refdyn.launcher import main" in (wheel[1].parent / "refdyn").read_text()
    said = run(wheel[1], "-c", f"import sys, refdyn; model = refdyn.Model({str(MODELS / 'pendulum.lua')!r}); model.M(model.q0); print('xarray' in sys.modules, model.statics().sizes)")
    assert said.startswith("False "), said


def test_names_of_the_package(package):
    assert set(package.__all__) | {"__version__"} <= set(dir(package)) and package.__version__ == VERSION
    with pytest.raises(AttributeError, match="module 'refdyn' has no attribute 'model_of'"):
        package.model_of


def test_is_found_by_cmake(package, tmp_path):
    """Headers and library are in the folders of find_package."""
    refdyn("gen", REFERENCE, "--set", "name=manipulator_rigid", "--set", "n_rfe=1", "-o", tmp_path / "emitted")
    run("cmake", "-S", TESTS / "install", "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={package.prefix}", f"-DEMITTED={tmp_path / 'emitted'}")


def test_extension_knows_every_quantity():
    known = re.findall(r"\bREFDYN_ENTRY\((\w+)\)", (SOURCE / "runtime" / "refdyn_model.h").read_text())
    assert sorted(json.loads(refdyn("compile", REFERENCE).stdout)["quantities"]) == sorted([*known, "J", "Jd_qd"])  # which have a table of their own


# ---- Bits ----

FREE = ("M", "h", "Q", "qdd_free")
ROWS = ("u", "v", "k")
ROBOT = TESTS / "models" / "robot.lua"  # whose points have spatial Jacobians


@pytest.mark.parametrize("file", [*(MODELS / f"{name}.lua" for name in ("manipulator", "branched", "midspan", "bricard")), ROBOT], ids=lambda file: file.stem)
def test_quantities_are_those_of_eval(package, file):
    model = package.Model(file)
    of_points = ("r", "rd", "C", "d", "J", "Jd_qd") if file == ROBOT else ("r", "rd", "C", "d")
    for q, qd in zip(*states(model, 3)):
        told = evaluate(file, {"t": 0.3, "q": q.tolist(), "qd": qd.tolist()})
        lines = ["" if same(getattr(model, key)(q, qd, 0.3), told[key]) else key for key in (*FREE, *(ROWS if model.rows else ()))]
        for place, point in enumerate(model.points):
            lines += ["" if same(getattr(model, key)(q, qd, 0.3)[place], told["points"][point][key]) else key for key in of_points]
        lines.append("" if same(model.energy(q, qd, 0.3), [told["energy"]["kinetic"], told["energy"]["potential"]]) else "energy")
        check(lines)


def test_jacobians_of_many_states(package):
    """These quantities have no functions for lanes."""
    model = package.Model(ROBOT)
    q, qd = states(model, 5)
    assert model.J(q).shape == (5, 2, 6, 7) and model.Jd_qd(q, qd).shape == (5, 2, 6)
    assert same(model.J(q), [model.J(row) for row in q]) and same(model.Jd_qd(q, qd), [model.Jd_qd(*row) for row in zip(q, qd)])


def test_accelerations_are_those_of_emitted_c(arm, tmp_path):
    """`eval` refines them, so the comparison is with the emitted C itself."""
    refdyn("gen", REFERENCE, "-o", tmp_path)
    (tmp_path / "main.c").write_text('''#include "manipulator.h"
#include <stdio.h>
extern const struct refdyn_model manipulator_model;
int main(void) {
    struct manipulator_parameters p;
    double state[26], out[26];
    manipulator_defaults(&p);
    manipulator_model.start((double *)&p, NULL, 0, state, state, out);
    manipulator_model.anchor((double *)&p, NULL, 0, out, out + 13, state);
    ((double *)&p)[manipulator_model.anchored[0]] = state[0];
    manipulator_prepare(&p);
    while (fread(state, sizeof state, 1, stdin) == 1) {
        manipulator_model.qdd((double *)&p, NULL, 0.3, state, state + 13, out);
        manipulator_model.force((double *)&p, NULL, 0.3, state, state + 13, out + 13);
        fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
''')
    run("cc", "-O2", "-ffp-contract=off", f"-I{SOURCE / 'runtime'}", *tmp_path.glob("*.c"), "-lm", "-o", tmp_path / "main")
    q, qd = states(arm, 20)
    found = subprocess.run([tmp_path / "main"], input=np.hstack([q, qd]).tobytes(), capture_output=True, check=True).stdout
    expected = np.frombuffer(found).reshape(-1, 26)
    for row, one_q, one_qd in zip(expected, q, qd):
        assert same(arm.qdd(one_q, one_qd, 0.3), row[:13]) and same(arm.force(one_q, one_qd, 0.3), row[13:])


def test_inverse_dynamics_is_that_of_emitted_c(arm, tmp_path):
    """Emitted with the same other functions, since all of them share the order of their sums."""
    refdyn("gen", REFERENCE, "--set", "n_rfe=4", "--emit", "start,equations,inverse", "-o", tmp_path)
    (tmp_path / "main.c").write_text('''#include "manipulator.h"
#include <stdio.h>
int main(void) {
    struct manipulator_parameters p;
    double state[39], tau[13];
    manipulator_defaults(&p);
    while (fread(state, sizeof state, 1, stdin) == 1) {
        manipulator_inverse(&p, NULL, 0.3, state, state + 13, state + 26, tau);
        fwrite(tau, sizeof tau, 1, stdout);
    }
    return 0;
}
''')
    run("cc", "-O2", "-ffp-contract=off", f"-I{SOURCE / 'runtime'}", *tmp_path.glob("*.c"), "-lm", "-o", tmp_path / "main")
    q, qd = states(arm, 20)
    qdd = np.random.default_rng(2).uniform(-5, 5, q.shape)
    found = subprocess.run([tmp_path / "main"], input=np.hstack([q, qd, qdd]).tobytes(), capture_output=True, check=True).stdout
    for row, *state in zip(np.frombuffer(found).reshape(-1, 13), q, qd, qdd):
        assert same(arm.inverse_dynamics(*state, 0.3), row)


# ---- Batches of states ----

@pytest.mark.parametrize("quantity", ["M", "qdd", "energy", "constrained", "C"])
def test_batch_gives_what_one_state_gives(arm, quantity):
    function = getattr(arm, quantity)
    q, qd = states(arm, 11)
    many = function(q, qd, 0.3)
    some = function(q[3:6], qd[3:6], 0.3)
    for name in many if isinstance(many, dict) else [None]:
        part, other = (many, some) if name is None else (many[name], some[name])
        assert same(part[3:6], other), "a state's numbers depend on the others"
        for i in range(11):
            one = function(q[i], qd[i], 0.3)
            one = one if name is None else one[name]
            assert part[i].shape == one.shape and np.abs(part[i] - one).max() <= 1e-13 * np.abs(one).max()


def test_every_argument_may_be_a_batch(arm):
    q, qd = (array[0] for array in states(arm, 1))
    t = np.linspace(0, 2, 5)
    assert np.allclose(arm.course(q, qd, t), [arm.course(q, qd, time) for time in t], rtol=1e-13)
    grid = arm.qdd(q + np.zeros((3, 1, 13)), qd, t)
    assert grid.shape == (3, 5, 13) and same(grid[0], grid[2]) and not same(grid[:, 0], grid[:, 1])
    masses = np.array([1.0, 2.5, 3.0])
    heavy = arm.qdd(q, qd, parameters={"m_E": masses})
    assert heavy.shape == (3, 13) and np.allclose(heavy[1], arm.qdd(q, qd, parameters={"m_E": 2.5}), rtol=1e-12)
    assert arm.qdd(np.zeros((0, 13)), qd).shape == (0, 13) and arm.M(q[np.newaxis]).shape == (1, 13, 13)


def test_arrays_of_any_kind(arm):
    q, qd = (array[0] for array in states(arm, 1))
    expected = arm.qdd(q, qd, 1)
    strided, whole = np.empty((13, 2)), np.rint(10 * q).astype(int)
    strided[:, 0] = q
    for other in (q.tolist(), tuple(q), strided[:, 0], q.astype(">f8"), np.asfortranarray(q)):
        assert same(arm.qdd(other, qd, np.int64(1)), expected)
    assert same(arm.qdd(whole, qd), arm.qdd(whole.astype(float), qd)) and same(arm.qdd(q), arm.qdd(q, np.zeros(13)))
    assert np.isnan(arm.qdd(np.full(13, np.nan), qd)).all()


def test_inverse_dynamics(arm):
    """It undoes forward dynamics, and its arguments are batches like those of quantities; the derivative by qdd is M."""
    q, qd = states(arm, 6)
    qdd, heavy = arm.qdd(q, qd, 0.3), {"m_E": [1, 2.5, 3, 4, 5, 6]}
    force = arm.force(q, qd, 0.3)
    assert np.abs(arm.inverse_dynamics(q, qd, qdd, 0.3) - force).max() <= 1e-9 * np.abs(force).max()
    grid = arm.inverse_dynamics(q[0], qd, qdd[1], 0.3, parameters=heavy)
    for i in range(6):
        one = arm.inverse_dynamics(q[0], qd[i].tolist(), qdd[1], 0.3, parameters={"m_E": heavy["m_E"][i]})
        assert one.shape == (13,) and np.abs(grid[i] - one).max() <= 1e-13 * np.abs(one).max()
        assert same(one, arm.inverse(q[0], np.concatenate([qd[i], qdd[1]]), 0.3, parameters={"m_E": heavy["m_E"][i]}))
    assert np.allclose(arm.d_inverse(q[0], np.concatenate([qd[0], qdd[0]]))["qdd"], arm.M(q[0]), rtol=1e-12, atol=1e-15)


# ---- Parameters and inputs ----

def test_parameters_are_those_of_another_model(package, arm):
    q, qd = (array[0] for array in states(arm, 1))
    heavy = package.Model(REFERENCE, m_E=3)
    assert heavy.parameters["m_E"] == 3 and same(heavy.qdd(q, qd), arm.qdd(q, qd, parameters={"m_E": 3}))
    # xc is a value at the start of the motion and depends on a; if it is set, it stays
    for given in ({"a": 0.9}, {"a": 0.9, "xc": 0.5}):
        told = evaluate(REFERENCE, {"q": q.tolist(), "qd": qd.tolist(), "parameters": given})
        assert same(arm.k(q, qd, parameters=given), told["k"])
    assert not same(arm.k(q, qd), arm.k(q, qd, parameters={"a": 0.9}))
    assert arm.units_of("s_sup") == "N/m" and arm.units["base_z"] == "m"


def test_inputs(package):
    driven = package.Model(REFERENCE, drive="input")
    q, qd = (array[0] for array in states(driven, 1))
    told = evaluate(REFERENCE, {"q": q.tolist(), "qd": qd.tolist(), "inputs": {"tau": 2.5}}, "--set", "drive=input")
    assert driven.inputs == {"tau": 0} and same(driven.Q(q, qd, inputs={"tau": 2.5}), told["Q"])
    assert np.allclose(driven.Q(q, qd, inputs={"tau": [0, 2.5]})[1], told["Q"], rtol=1e-13)


def test_contacts(package):
    """Forces and times of rest of contacts in motions, batches and equilibria."""
    ball = package.Model(TESTS / "models" / "contacts" / "ball.lua")
    run, cases, rest = ball.simulate(3.0, every=0.1), ball.batch({"e": [0.1, 0.6]}, 5.0), ball.statics()
    fall = np.sqrt(2 / 9.81)
    assert abs(float(run.rest_floor[-1]) - fall * 1.6 / 0.4) < 1e-6 and abs(float(run.contact_floor[-1]) - 9.81) < 1e-9
    assert np.allclose(cases.rest_floor, [fall * 1.1 / 0.9, fall * 1.6 / 0.4], atol=1e-6)
    assert [mark["contact"] for mark in json.loads(run.attrs["events"])][-1] == "rests"
    assert abs(float(rest.contact_floor) - 9.81) < 1e-9 and abs(float(rest.gap_floor)) < 1e-12


def test_values_at_the_start_follow_inputs(package):
    text = GOOD.replace("return rd", 'rd.input("f", 1, "N")\nreturn rd').replace("\n}", '''
  constraints = function(s) return { rd.position { s.q.rod_psi - rd.parameter("at", 0.1 * s.start.inputs.f, "rad"), alpha = 1, beta = 1 } } end }''')
    swing = package.Model.from_text(text)
    assert swing.parameters["at"] == 0.1 and swing.phi([0.7])[0] == 0.7 - 0.1
    for inputs in ({"f": 3}, {"f": [3, 3]}):
        assert np.allclose(swing.phi([0.7], inputs=inputs), 0.4, rtol=1e-14)
    assert np.allclose(swing.phi([0.7], inputs={"f": [2, 3]}, parameters={"at": [[0.5], [0.6]]})[..., 0], [[0.2, 0.2], [0.1, 0.1]])


def test_derivatives_are_compiled_when_they_are_named(arm):
    q, qd = (array[0] for array in states(arm, 1))
    by_q, step = arm.d_qdd(q, qd)["q"], 1e-6
    differences = [(arm.qdd(q + step * unit, qd) - arm.qdd(q - step * unit, qd)) / (2 * step) for unit in np.eye(13)]
    assert np.abs(by_q - np.transpose(differences)).max() <= 1e-6 * np.abs(by_q).max()
    given = arm.constrained(q, qd)
    tangent = arm.tangent(q, np.concatenate([qd, given["qdd"], given["power"], given["lambda"]]))
    assert np.allclose(tangent["M"], arm.M(q), rtol=1e-12, atol=1e-15) and "d_qdd" in dir(arm) and "bias forces" in arm.h.__doc__


# ---- What the program computes ----

def test_statics_and_modes(arm):
    told = json.loads(refdyn("statics", REFERENCE).stdout)
    rest = arm.statics()
    assert same(arm.states(rest)[0], told["q"]) and rest.stability == "stable" and rest.E_z.units == "m" and rest.base_z.units == "m"
    assert same([rest[f"force_{name}"] for name in arm.held], told["hold_force"]) and rest.force_arm_psi.units == "N m"
    assert set(arm.statics(hold=["column_psi", "effector_z", "arm_psi"])) == set(rest)
    modes, expected = arm.modes(modes=3), json.loads(refdyn("modes", REFERENCE, "--modes", "3").stdout)["modes"]
    assert same(modes.omega, [mode["omega"] for mode in expected]) and modes.frequency.units == "Hz"
    assert same(modes.shape.real, [mode["shape"]["re"] for mode in expected]) and modes.displacement.shape == (3, 1, 3)
    assert same(modes.q, told["q"]) and list(modes.unit.values[:2]) == ["m", "rad"]


def test_linear_models(package):
    """The matrices of the command, with names; also about a state of the caller."""
    moved = package.Model(REFERENCE, drive="input", program="none")
    found, expected = moved.linearise(move_held=True), json.loads(refdyn("linearise", REFERENCE, "--set", "drive=input", "--set", "program=none", "--move-held").stdout)
    for name, rows in (("A", "state"), ("B", "state"), ("C", "output"), ("D", "output")):
        assert np.array_equal(found[name].values, np.array(expected[name]).reshape(found[name].shape)) and list(found[rows].values) == expected[f"{rows}s"]
    assert np.array_equal(found.eigenvalue.values, [complex(*pair) for pair in expected["eigenvalues"]])
    rates = np.linspace(-0.3, 0.4, len(moved.coordinates))
    state = moved.linearise(q=moved.q0, qd=rates, hold=[], inputs={"tau": 2.5})
    accelerations = moved.qdd(moved.q0, rates, 0.0, inputs={"tau": 2.5})
    assert np.allclose(state.rate.values, np.concatenate([rates, accelerations]), rtol=1e-9, atol=1e-9)


def test_motion(arm):
    columns, _, summary = motion(REFERENCE, "--until", 0.2, "--tol", "1e-7", "--from", "statics")
    found = arm.simulate(0.2, tol=1e-7, from_="statics")
    assert list(found.variables) == list(columns) and all(same(found[name], values) for name, values in columns.items())
    assert found.steps == summary["steps"] and found.E_xd.units == "m/s" and found.t.units == "s"
    assert np.allclose(arm.energy(*arm.states(found), found.t).sum(axis=1), found.energy, rtol=1e-12)
    again = arm.simulate(0.1, q=found.isel(t=0)[list(arm.coordinates)].to_array(), parameters={"m_E": 3}, method="rodas5p", every=0.05)
    assert again.sizes["t"] == 3 and again.method == "rodas5p"


def test_samples_of_inputs(package):
    driven = package.Model(REFERENCE, n_rfe=1, drive="input")
    found = driven.simulate(0.2, every=0.05, inputs={"t": [0, 0.1], "tau": [1.0, 3.0]}, stop=["t>0.17"])
    assert found.tau.values[0] == 1 and found.tau.values[-1] == 3 and 0.17 < found.t[-1] < 0.2 and found.tau.units == "N m"
    assert driven.simulate(0.1, inputs={"tau": 2}).tau.values.tolist() == [2] * 201


def test_batch(arm, tmp_path):
    pytest.importorskip("h5py")
    runs = arm.batch({"m_E": [1, 2.5], "arm_psi": [0.75, 0.8]}, t_end=0.1, tol=1e-6, lanes=1)
    assert runs.status.values.tolist() == [0, 0] and runs.m_E.units == "kg" and same(runs.arm_psi_start, [0.75, 0.8]) and runs.E_z.units == "m"
    one = arm.simulate(0.1, tol=1e-6, every=0.1, q=[0, 0, 0.8] + [0] * 10, parameters={"m_E": 2.5})
    assert same(runs.E_z[1], one.E_z[-1]) and same(arm.states(runs)[1][1], arm.states(one)[1][-1])
    (tmp_path / "sweep.lua").write_text('''local rd = require "refdyn"
return rd.sweep { vary = { m_E = { 1, 2 } }, t_end = 0.1, every = 0.05,
  keep = { final = true, at = { 0.05 }, extremes = { "E_z" }, norms = { "E_x" }, history = { "E_z" } } }''')
    kept = arm.batch(sweep=tmp_path / "sweep.lua")
    assert kept.E_z_history.dims == ("case", "t") and kept.t.size == 3 and kept.E_z_max_t.units == "s" and kept.E_x_rms.shape == (2,)
    assert same(kept.E_z_history[:, -1], kept.E_z) and kept.E_z_at.dims == ("case", "t_at") and same(kept.t_end, [0.1, 0.1])
    assert same(kept.E_z_min, kept.E_z_history.min("t"))


def test_names_of_a_batch_that_clash_with_its_axes(package, tmp_path):
    """A parameter called t is not lost to the times, nor an input called which to the axis of extremes."""
    pytest.importorskip("h5py")
    fall = package.Model.from_text('''local rd = require "refdyn"
local p = rd.parameters { { "t", 1, "kg" } }
return rd.model { name = "fall", links = { { "b", joint = { "z" }, mass = p.t } }, forces = function(s) return { b_z = rd.input("which", 2, "N") } end }''')
    (tmp_path / "sweep.lua").write_text('''local rd = require "refdyn"
return rd.sweep { vary = { t = { 1, 2 } }, t_end = 0.1, every = 0.05, keep = { final = true, norms = { "which" }, history = { "which" } } }''')
    runs = fall.batch(sweep=tmp_path / "sweep.lua")
    assert runs.t.dims == ("t",) and same(runs.t, [0, 0.05, 0.1]) and same(runs.case_t, [1, 2])
    assert same(runs.which_rms, [2, 2]) and runs.which_history.dims == ("case", "t") and same(runs.which_history[0], [2, 2, 2])


# ---- Inputs that events set, and options of all kinds ----

BALL = '''local rd = require "refdyn"
local p = rd.parameters { { "stiff", 3, "N/m" }, { "unread", 1 } }
local wind, lift = rd.input("wind", 0.1, "N"), rd.input("lift", 0, "N")
local height, name, mirrored = rd.option("height", 1), rd.option("word", "7"), rd.option("mirrored", false)
local share = rd.option("share", 0.5)
return rd.model { name = "ball", gravity = { 0, 0, -9.81 }, points = { B = "ball" }, hold = { "ball_z" },
  links = { { "ball", joint = "x, z", mass = 1, start = { z = height }, start_rate = { x = 1 }, spring = { x = p.stiff } } },
  forces = function(s) return { ball_x = wind, ball_z = lift } end,
  constraints = function(s) return { rd.velocity { s.qd.ball_z + 9.81 * s.t, alpha = 1, name = "fall" } } end,
  events = function(s) return {
    rd.event { s.q.ball_x - 0.3, direction = "up", inputs = { wind = -0.2 }, name = "gust" },
    rd.event { s.q.ball_z - 0.2, ends = true, name = "low" } } end }
'''


@pytest.fixture(scope="module")
def ball(package):
    return package.Model.from_text(BALL)


def test_constants_of_inputs_that_events_set(package, ball):
    """They are valid until the event; samples of such an input are refused, samples of another input are accepted."""
    found = ball.simulate(1, every=0.1, inputs={"wind": -0.7, "t": [0, 0.1], "lift": [0.25, 0.5]})
    assert found.wind.values[0] == -0.7 and found.wind.values[-1] == -0.2 and found.lift.values[[0, -1]].tolist() == [0.25, 0.5]
    alone = ball.simulate(1, every=0.1, inputs={"wind": -0.7, "lift": 0.5})
    assert alone.wind.values[0] == -0.7 and json.loads(alone.inputs) == {"wind": -0.7, "lift": 0.5}
    assert ball.inputs["wind"] == 0.1 and float(ball.simulate(0.1).wind[0]) == 0.1
    with pytest.raises(ValueError, match="^inputs: column wind: events of the model set this input; samples must not"):
        ball.simulate(1, inputs={"t": [0, 1], "wind": [0, 1]})
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"lift": [0.25, 0.5], "t": [0, 0.1]}, index=[7, 9])
    expected = ball.simulate(0.3, every=0.1, inputs={"t": [0, 0.1], "lift": [0.25, 0.5]})
    for samples in (frame, frame.set_index("t").to_xarray()):
        assert same(ball.simulate(0.3, every=0.1, inputs=samples).to_array(), expected.to_array())
    with pytest.raises(ValueError, match="^input lift: 2 values without times; write inputs="):
        ball.simulate(0.3, inputs=frame[["lift"]])
    with pytest.raises(ValueError, match="^inputs: lift is given twice; give it once$"):
        ball.simulate(0.3, inputs=frame[["t", "lift", "lift"]])


def test_an_input_of_the_model_is_not_compiled_anew(package):
    """One library for all values."""
    models = [package.Model.from_text(BALL, wind=value) for value in (0.1, 0.337)]
    assert models[0]._libraries[None, False].description["library"] == models[1]._libraries[None, False].description["library"]
    assert models[1].inputs["wind"] == 0.337 and models[1].Q(models[1].q0)[0] == 0.337
    assert float(models[1].simulate(0.1).wind[0]) == 0.337 and float(models[1].statics(inputs={"lift": 1}).ball_x) == pytest.approx(0.337 / 3)


def test_parameters_that_nothing_reads(ball):
    """They may be set, as in the program."""
    assert list(ball.parameters) == ["stiff"] and same(ball.M(ball.q0, parameters={"unread": 2}), ball.M(ball.q0))
    assert json.loads(ball.simulate(0.1, parameters={"unread": 2}).parameters) == {"stiff": 3, "unread": 2}


def test_equilibria_under_inputs(package, ball):
    assert float(ball.statics(inputs={"wind": 1.5}).ball_x) == pytest.approx(0.5)
    with pytest.warns(package.ModelWarning, match="this state is not an equilibrium: ball_x is out of balance by 1.5"):
        assert float(ball.modes(inputs={"wind": 1.5}).q[0]) == pytest.approx(0.5) and float(ball.modes(at="initial", inputs={"wind": 1.5}).q[0]) == 0


def test_options_have_their_types(package, ball):
    assert dict(ball.options) == {"height": 1, "word": "7", "mirrored": False, "share": 0.5} and type(ball.options["height"]) is int
    pytest.importorskip("h5py")
    runs = ball.batch({"height": [1, 2], "word": ["7", "8"], "mirrored": [True, False], "share": [0.5, 0.25]}, t_end=0.1)
    assert runs.height.dtype.kind == "i" and runs.word.values.tolist() == ["7", "8"] and runs.mirrored.values.tolist() == [True, False] and runs.share.values[1] == 0.25
    assert package.Model.from_text(BALL, height=3).batch({"height": [2, 1]}, t_end=0.1).height.values.tolist() == [2, 1]
    told = ball.batch({"stiff": [0.5], "height": [-1]}, t_end=0.1).reason.values[0]
    assert "refdyn-" not in told, told


# ---- Datasets as files and pages ----

@pytest.mark.parametrize("engine", ["netcdf4", "h5netcdf"])
def test_datasets_as_netcdf(ball, arm, engine, tmp_path):
    """With all attributes; plain netCDF has no complex numbers."""
    pytest.importorskip("netCDF4" if engine == "netcdf4" else engine)
    motion, rest, modes = ball.simulate(2, every=0.1, stop="ball_z<0.3", parameters={"stiff": 0.7}), arm.statics(), arm.modes(modes=2)
    assert json.loads(motion.stop)["condition"] == "ball_z<0.3" and isinstance(motion.events, str)
    sets = [motion, rest, ball.simulate(0.1), modes if engine == "h5netcdf" else modes[["frequency", "damping", "q"]]]
    for number, data in enumerate(sets):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            data.to_netcdf(tmp_path / f"{number}.nc", engine=engine, **({"invalid_netcdf": True} if engine == "h5netcdf" else {}))
        with xarray.open_dataset(tmp_path / f"{number}.nc", engine=engine) as again:
            assert set(again.attrs) == set(data.attrs) and again.identical(data.assign_attrs(again.attrs))
            assert all(np.all(again.attrs[key] == value) for key, value in data.attrs.items())


def test_attributes_tell_the_model(arm, ball):
    found = arm.simulate(0.01, parameters={"m_E": 3})
    assert found.model == "manipulator" and json.loads(found.options)["n_rfe"] == 4 and found.phi_1.long_name == "phi of ellipse" and found.psi_2.long_name == "psi of rise"
    values = json.loads(found.parameters)
    assert values["m_E"] == 3 and values["d"] == arm.parameters["d"] and "xc" not in values and "m_E" in json.loads(arm.modes(modes=1).parameters)
    assert ball.simulate(0.01).psi_1.long_name == "psi of fall"
    assert {data.attrs["refdyn"] for data in (found, arm.simulate(0.01, verify=True), arm.statics(), arm.modes(modes=1), ball.linearise(at="initial"))} == {VERSION}


def test_a_dataset_owns_its_values_and_its_form(arm):
    """Motions with the same times share a form from the second on; what a user changes in a dataset must not reach the next."""
    kept = arm.simulate(0.1, every=0.05).copy(deep=True)
    for _ in range(3):
        changed = arm.simulate(0.1, every=0.05)
        xarray.testing.assert_equal(changed, kept)
        assert changed.arm_psi.units == changed.arm_psi_d.units.split("/")[0] == "rad" and set(changed.attrs) == set(kept.attrs)
        changed["extra"], changed.attrs["note"], changed.arm_psi.attrs["units"], changed.t.attrs["units"] = 3.0, "mine", "deg", "h"
        changed.arm_psi[:] = 7.0
    later = arm.simulate(0.1, every=0.02, parameters={"m_E": 3})
    assert later.sizes["t"] == 6 and later.t.units == "s" and later.sel(t=0.04, method="nearest").t == pytest.approx(0.04)
    assert later.arm_psi[-1] != kept.arm_psi[-1]


def test_view(package, ball, tmp_path):
    """The page equals the program's for the same run, with the run's parameters and options."""
    low = package.Model.from_text(BALL, height=2, stiff=0.6)
    run = low.simulate(0.1, parameters={"stiff": 0.7})
    ball.view({"run": run}, tmp_path / "ball.html")
    (tmp_path / "ball.lua").write_text(BALL)
    refdyn("sim", tmp_path / "ball.lua", "--set", "height=2", "--set", "stiff=0.7", "--until", "0.1", "-o", tmp_path / "run.csv")
    refdyn("view", tmp_path / "run.csv", "--model", tmp_path / "ball.lua", "--set", "height=2", "--set", "stiff=0.7", "-o", tmp_path / "expected.html")
    assert (tmp_path / "ball.html").read_bytes() == (tmp_path / "expected.html").read_bytes()
    ball.view([run, run.isel(t=slice(0, 9))], tmp_path / "two.html")
    assert '"ball 2.csv"' in (tmp_path / "two.html").read_text()
    for message, runs in {"view: runs[1] has other options or parameters than runs[0]": [run, ball.simulate(0.01)],
                          "view: the run is not a dataset of arm.simulate; must have rows along t": ball.statics(), "view: no run; give at least one": [], "view: run '../a': not a file name; its name must not be empty, contain /, begin with - or have more than 200 bytes": {"../a": run},
                          "view: the run is a motion of the model 'swing'; must be one of 'ball'": package.Model.from_text(GOOD).simulate(0.01)}.items():
        with pytest.raises(ValueError, match=re.escape(message)):
            ball.view(runs, tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


# ---- Other processes ----

def accelerations_of(model, rate):
    return model.qdd([0.3, 0.7], [rate, 0])


def test_models_and_quantities_in_other_processes(ball):
    """Bound methods, quantities and errors are sent there and back; a copy is the model itself."""
    assert copy.copy(ball) is copy.deepcopy(ball) is ball and copy.deepcopy(ball.qdd) is ball.qdd
    again = pickle.loads(pickle.dumps(ball))
    assert same(again.qdd([0.3, 0.7], [1, 0]), ball.qdd([0.3, 0.7], [1, 0])) and again.options == ball.options and pickle.loads(pickle.dumps(again.M))(ball.q0).shape == (2, 2)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert [float(run.t[-1]) for run in pool.map(ball.simulate, [0.01, 0.02])] == [0.01, 0.02]
        assert same(pool.map(ball.M, [[0, 1], [0, 2]])[1], ball.M([0, 2]))
        with pytest.raises(ValueError, match="t_end: '-1' is not a positive number"):
            pool.map(ball.simulate, [-1])


# ---- Errors ----

GOOD = '''local rd = require "refdyn"
return rd.model { name = "swing", gravity = { 0, 0, -9.81 },
  links = { { "rod", turn = { { "x", rd.pi / 2 } }, joint = { "psi" }, spring = { psi = 20 }, mass = 2, center = { 0.5, 0, 0 } } },
}
'''


def test_models_at_fault(package, tmp_path):
    file = tmp_path / "wrong.lua"
    file.write_text(GOOD.replace("mass = 2", "mass = -2"))
    with pytest.raises(package.ModelError) as told:
        package.Model(file)
    assert (told.value.file, told.value.line) == (str(file), 3)
    assert str(told.value) == f"{file}:3: links[1].mass: value -2; must be positive"
    with pytest.raises(package.ModelError, match=re.escape("<text>:3: links[1].mas: unknown field; did you mean \"mass\"?")) as told:
        package.Model.from_text(GOOD.replace("mass", "mas"))
    assert (told.value.file, told.value.line) == ("<text>", 3)
    with pytest.raises(ValueError, match="^m_e: unknown option, parameter or input; did you mean 'm_E'"):
        package.Model(REFERENCE, m_e=2)
    with pytest.raises(ValueError, match="^q: has 2 values; must have 13"):
        package.Model(REFERENCE).simulate(1, q=[0, 1])
    with pytest.raises(package.ModelError, match="cannot be read: No such file or directory"):
        package.Model(tmp_path / "none.lua")


# Reasons at which a motion with steps beyond its stability ends: its rows are chosen again at a state without meaning, or the numbers overflow.
DIVERGED = ("the mass matrix is not positive definite", "the equations gave an infinite or undefined value")


def test_numbers_that_fail(package):
    arm = package.Model(REFERENCE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(package.NumericalError) as told:
            arm.simulate(1, step=1e-2)
    assert 0 < told.value.t < 0.1 and told.value.reason.startswith(DIVERGED)
    assert told.value.run.t.size > 1 and isinstance(told.value, ArithmeticError)


def test_warnings(package):
    with pytest.warns(package.ModelWarning, match="the start is off the programme:\n  ellipse \\(position\\): phi"):
        package.Model(REFERENCE, n_rfe=1).simulate(0.01, q=[0, 0, 0.6, 0], qd=[0, 0, 0.3, 0])


def test_warnings_of_the_model_are_told_once(package):
    """They appear when the model is read, and not again in later errors."""
    with pytest.warns(package.ModelWarning, match="no load acts on it") as told:
        free = package.Model.from_text(GOOD.replace("spring = { psi = 20 }, ", "").replace("-9.81", "0"))
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert free.qdd([[0.1]]).shape == (1, 1) and free.simulate(0.01).sizes["t"] == 201
        with pytest.raises(ValueError, match="^method: 'rk5' is not one of"):
            free.simulate(0.01, method="rk5")


CALLS = {
    "q: has shape (12,); its last axis must have 13 entries": lambda arm: arm.M(np.zeros(12)),
    "qd: has shape (); its last axis must have 13 entries": lambda arm: arm.h(np.zeros(13), 1.0),
    "m_e: unknown parameter; did you mean 'm_E'?": lambda arm: arm.M(np.zeros(13), parameters={"m_e": 2}),
    "qdd: has shape (12,); its last axis must have 13 entries": lambda arm: arm.inverse_dynamics(np.zeros(13), np.zeros(13), np.zeros(12)),
    "tau: unknown input; the model has no input": lambda arm: arm.M(np.zeros(13), inputs={"tau": 2}),
    "parameter m_E: contains inf; all numbers must be finite": lambda arm: arm.M(np.zeros(13), parameters={"m_E": np.inf}),
    "shape mismatch: the leading axes q (3,), qd (2,) cannot be broadcast": lambda arm: arm.M(np.zeros((3, 13)), np.zeros((2, 13))),
    "q: rows of different lengths; must be an array of real numbers": lambda arm: arm.M([[0.1, 0.2], [0.3]]),
    "n_rfe: not a parameter but an option; give it to refdyn.Model": lambda arm: arm.simulate(1, parameters={"n_rfe": 2}),
    "cases: missing; must be columns by name, {'NAME': values}, a data frame or refdyn.grid(NAME=values)": lambda arm: arm.batch(),
    "dofs: 'psi,theta' contains a comma, a quote or a line break; remove it": lambda arm: arm.batch({"dofs": ["psi,theta"]}, t_end=1),
    "E_z: unknown coordinate, parameter or input;": lambda arm: arm.units_of("E_z"),
}


@pytest.mark.parametrize("message", CALLS)
def test_wrong_calls(arm, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        CALLS[message](arm)


BALL_CALLS = {
    "from_: 'statics' is given together with q, qd; give one of them (arm.statics(q)": lambda ball: ball.simulate(1, from_="statics", q=[0, 1], qd=[0, 0]),
    "from_: 'static' is not one of initial, statics, and not a file; did you mean 'statics'?": lambda ball: ball.simulate(1, from_="static"),
    "at: 'inital' is not one of initial, statics, and not a file; did you mean 'initial'?": lambda ball: ball.modes(at="inital"),
    "t: the equilibrium is computed at t = 0; add q or at=\"initial\" for another time": lambda ball: ball.modes(t=1),
    "t_end: '0' is not a positive number": lambda ball: ball.simulate(0),
    "start: 'moved' is not one of as-is, project": lambda ball: ball.simulate(1, start="moved"),
    "way: 'up' is not one of load, path, downhill": lambda ball: ball.statics(way="up"),
    "q: contains nan; all numbers must be finite": lambda ball: ball.statics(q=[np.nan, 0]),
    "q: has shape (1, 2); must be one state: a row of numbers": lambda ball: ball.simulate(1, q=[[0, 1]]),
    "stop: a motion has no column 'B_q'; did you mean 'B_x'?": lambda ball: ball.simulate(1, stop="B_q<1"),
    "stiff: has 2 values; must have 3, as wind has, or one for all cases": lambda ball: ball.batch({"stiff": [1, 2], "wind": [1, 2, 3]}, t_end=1),
    "input lift: 2 values without times; write inputs={'t': times, 'lift': values}": lambda ball: ball.simulate(1, inputs={"lift": [1, 1]}),
    "input lift: has shape (1,); must have the shape of 't', (2,)": lambda ball: ball.simulate(1, inputs={"t": [0, 0.05], "lift": [1]}),
    "inputs: times 't' without an input; add an input": lambda ball: ball.simulate(1, inputs={"t": [0, 1]}),
    "inputs: 't' has shape (); must be a row of times": lambda ball: ball.simulate(1, inputs={"t": 0, "lift": 1}),
    "input lift: contains nan; all numbers must be finite": lambda ball: ball.simulate(1, inputs={"lift": np.nan}),
    "input lift: 2 values; must be one number": lambda ball: ball.statics(inputs={"lift": [1, 2]}),
    "parameter stiff: 2 values; must be one number": lambda ball: ball.simulate(1, parameters={"stiff": [0.1, 0.2]}),
    "lift: not a parameter but an input; give it in inputs={...}": lambda ball: ball.simulate(1, parameters={"lift": 1}),
    "ball_x: not a parameter but a coordinate; give it in q": lambda ball: ball.M(ball.q0, parameters={"ball_x": 1}),
    "height: not a parameter but an option; give it to refdyn.Model": lambda ball: ball.M(ball.q0, parameters={"height": 1}),
    "stiff: not an input but a parameter; give it in parameters={...}": lambda ball: ball.statics(inputs={"stiff": 1}),
    "file: a text of several lines; use refdyn.Model.from_text": lambda ball: type(ball)(BALL),
    "inputs: have shape (3,); must have (2,), one number for each of the model's inputs, or names": lambda ball: ball.simulate(1, inputs=np.array([0.3, 0.1, 0.7])),
    "or names; samples need their times, inputs={'t': times, 'NAME': values}": lambda ball: ball.simulate(1, inputs=np.full((5, 2), 0.3)),
    "parameters: have shape (7,); must have": lambda ball: ball.modes(parameters=np.full(7, 0.3)),
    "input wind: contains nan; all numbers must be finite": lambda ball: ball.statics(inputs=[np.nan, 0.3]),
    "text: 'ball.lua' is the name of a file; use refdyn.Model": lambda ball: type(ball).from_text("ball.lua"),
}


@pytest.mark.parametrize("message", BALL_CALLS)
def test_wrong_calls_of_motions(ball, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        BALL_CALLS[message](ball)


NO_NUMBERS = {
    "q: values of complex128; must be real numbers": lambda ball: ball.qdd(ball.q0 + 1e-20j),
    "t: values of complex128": lambda ball: ball.qdd(ball.q0, t=1j),
    "q: values of <U1; must be real numbers": lambda ball: ball.M(["1", "2"]),
    "parameter stiff: values of complex64": lambda ball: ball.simulate(1, parameters={"stiff": np.complex64(1j)}),
    "input lift: a function; must be real numbers": lambda ball: ball.simulate(1, inputs={"lift": np.sin}),
    "simulate() got an unexpected keyword argument 'methods'; did you mean 'method'?": lambda ball: ball.simulate(1, methods="rk4"),
    "cases: float; must be columns by name, {'NAME': values}": lambda ball: ball.batch(3.0, t_end=1),
    "inputs: float; must be values by name, {'NAME': value}": lambda ball: ball.simulate(1, inputs=2.0),
    "q: has masked values; must be real numbers": lambda ball: ball.M(np.ma.masked_array(ball.q0, [True] + [False] * (len(ball.q0) - 1))),
    "q: has masked values; must be real": lambda ball: ball.simulate(1, q=[np.ma.masked] * len(ball.q0)),
    "parameter stiff: has masked values": lambda ball: ball.M(ball.q0, parameters={"stiff": np.ma.masked}),
    "stiff: has masked values; each case needs a value": lambda ball: ball.batch({"stiff": np.ma.masked_array([1.0, 2.0], [True, False])}, t_end=0.1),
    "stiff: values of complex128": lambda ball: ball.batch({"stiff": [1 + 2j, 2]}, t_end=0.1),
    "t_end: values of complex128": lambda ball: ball.simulate(1j),
    "tol: True; must be a number": lambda ball: ball.simulate(0.1, tol=True),
    "accuracy: True; must be a number, the bound on the error of the motion": lambda ball: ball.simulate(0.1, accuracy=True),
    "tol: values of complex128": lambda ball: ball.simulate(0.1, tol=1e-6 + 1e-9j),
    "q: contains None; must be real": lambda ball: ball.M([None] * len(ball.q0)),
    "parameter stiff: contains None": lambda ball: ball.simulate(1, parameters={"stiff": None}),
    **{f"{name}: not an option of this call": lambda ball, name=name: ball.simulate(0.1, **{name: "precious"})
       for name in ("output", "summary", "inputs_", "set", "help", "case", "stop_")},
    **{f"{name}: not an option of this call; use its arguments": lambda ball, name=name: ball.batch({"stiff": [1.0]}, t_end=0.1, **{name: "precious"})
       for name in ("output", "table", "dry_run", "slurm", "resume", "set")},
}


MISSPELT = {
    "motion() got an unexpected keyword argument 'parameter'; did you mean 'parameters'?": lambda package, ball: ball.motion(parameter={}),
    "statics() got an unexpected keyword argument 'holds'; did you mean 'hold'?": lambda package, ball: ball.statics(holds=[]),
    "modes() got an unexpected keyword argument 'input'; did you mean 'inputs'?": lambda package, ball: ball.modes("initial", input={}),
    "linearise() got an unexpected keyword argument 'releases'; did you mean 'release'?": lambda package, ball: ball.linearise(releases=[]),
    "simulate() got an unexpected keyword argument 'toll'; did you mean 'tol'?": lambda package, ball: ball.simulate(1, toll=1e-6),
    "batch() got an unexpected keyword argument 'lane'; did you mean 'lanes'?": lambda package, ball: ball.batch({"stiff": [1]}, 1, lane=2),
    "inverse_dynamics() got an unexpected keyword argument 'qddd'; did you mean 'qdd'?": lambda package, ball: ball.inverse_dynamics(ball.q0, ball.qd0, qddd=0),
    "casadi() got an unexpected keyword argument 'folds'; did you mean 'fold'?": lambda package, ball: ball.casadi(folds=True),
    "view() got an unexpected keyword argument 'files'; did you mean 'file'?": lambda package, ball: ball.view(files="page.html"),
    "set() got an unexpected keyword argument 'input'; did you mean 'inputs'?": lambda package, ball: ball.motion().set(input={}),
    "set() got an unexpected keyword argument 'zzz'": lambda package, ball: ball.motion().set(zzz=1),
    "at_end() got an unexpected keyword argument 'from'; did you mean 'from_'?": lambda package, ball: package.at_end("t", **{"from": 1}),
    "uniform() got an unexpected keyword argument 'too'; did you mean 'to'?": lambda package, ball: package.uniform(1, too=2),
}


@pytest.mark.parametrize("message", MISSPELT)
def test_misspelt_keywords(package, ball, message):
    with pytest.raises(TypeError) as error:
        MISSPELT[message](package, ball)
    assert str(error.value) == message


def test_calls_of_control_loops_have_no_further_layer(package, ball):
    """The signatures of all calls stay as they are written; what loops call is not wrapped."""
    assert list(inspect.signature(ball.motion).parameters)[:3] == ["q", "qd", "t"] and ball.motion.__doc__.startswith("Begins a motion")
    for call in (package.Model.step, package.Motion.advance, package.Quantity.__call__):
        assert not hasattr(call, "__wrapped__")


@pytest.mark.parametrize("message", NO_NUMBERS)
def test_what_is_no_number(ball, message, tmp_path, monkeypatch):
    """Nothing is computed, and no file is overwritten."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "precious").write_text("kept")
    with pytest.raises(TypeError, match=re.escape(message)):
        NO_NUMBERS[message](ball)
    assert (tmp_path / "precious").read_text() == "kept" and len(list(tmp_path.iterdir())) == 1


def test_rows_that_are_not_aligned(arm):
    """Fields of packed records, one state and many, and bytes at any address: the same numbers."""
    n = len(arm.coordinates)
    records = np.zeros(3, dtype=np.dtype([("flag", "u1"), ("q", "f8", n)]))
    records["q"] = states(arm, 3)[0]
    one, plain = records[0]["q"], records["q"].copy()
    assert not one.flags.aligned
    assert same(arm.M(one), arm.M(plain[0])) and same(arm.M(one, parameters={"m_E": 2}), arm.M(plain[0], parameters={"m_E": 2}))
    assert same(arm.M(records["q"]), arm.M(plain)) and same(arm.qdd(one, one), arm.qdd(plain[0], plain[0]))
    shifted = np.frombuffer(b"x" + plain[0].tobytes(), offset=1)
    assert same(arm.M(shifted), arm.M(plain[0])) and same(arm.M(memoryview(plain[0])), arm.M(plain[0]))
    assert same(arm.M(np.ma.masked_array(plain[0])), arm.M(plain[0])) and same(arm.M(plain[0].astype(">f8")), arm.M(plain[0]))


REFUSED_VALUES = {"m_E": (-0.05, r"links\[4\].mass: value -0.05; must be positive"), "d": (-1e-3, "rd.round: argument 1: value -0.001; must be positive"),
                  "nu": (0.6, r"nu: value 0.6; must be above -1"), "alpha": (-1, "value -1; must not be negative")}


@pytest.mark.parametrize("name", REFUSED_VALUES)
def test_values_that_the_model_refuses(arm, name):
    """One state, many states with one value, and one bad value among many."""
    value, message = REFUSED_VALUES[name]
    good = arm.parameters[name]
    for q, parameters in ((arm.q0, value), (np.tile(arm.q0, (3, 1)), value), (arm.q0, [good, good, value])):
        with pytest.raises(ValueError, match=message):
            arm.qdd(q, parameters={name: parameters})
    assert arm.qdd(arm.q0, parameters={name: [good, good]}).shape == (2, len(arm.coordinates))


def test_a_model_does_not_change(ball):
    for name in ("stiff", "q0", "cordinates"):
        with pytest.raises(AttributeError, match=f"{name}: a model cannot be changed; create another with refdyn.Model"):
            setattr(ball, name, 1)
    with pytest.raises(AttributeError, match="q0: a model cannot be changed"):
        del ball.q0
    with pytest.raises(AttributeError, match="no attribute 'd_qddd'; did you mean 'd_qdd'\\?"):
        ball.d_qddd


def test_texts_are_of_python(package, wheel):
    """Python messages name arguments instead of options, the data of the exception instead of files, and readable numbers; `python -m
    refdyn`."""
    assert package.ModelError.__module__ == package.NumericalError.__module__ == package.ModelWarning.__module__ == package.Model.__module__ == "refdyn"
    assert run(wheel[1], "-m", "refdyn", "--version").startswith(f"refdyn {VERSION}\n")
    rigid = package.Model(REFERENCE, n_rfe=1)
    with pytest.warns(package.ModelWarning, match='consistent start with start="project",\n') as told:
        rigid.simulate(0.01, q=[0, 0, 0.6, 0], qd=[0, 0, 0.3, 0])
    assert "phi = 0, psi = -0.7743668207\n" in str(told[0].message) and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(package.NumericalError) as failed:
            package.Model(REFERENCE).simulate(1, step=1e-2)
    text = str(failed.value)
    assert re.match(r"manipulator: t = 0\.01\d* s: (the equations gave|the mass matrix is not)", text) and text.endswith("equal steps of 0.005 s may be too long: use a smaller step, or tol for adaptive steps of any method but rk4"), text
    assert not re.search(r"\.part|--|^method|^time", text, re.M) and failed.value.run.model == "manipulator"


def test_names_that_are_not_there(package):
    swing = package.Model.from_text(GOOD)
    for name in ("u", "nonsense", "_private", "d_force"):
        assert not hasattr(swing, name)
    with pytest.raises(AttributeError, match="<text>: the model has no row_terms"):
        swing.row_terms
    assert swing.qdd([0.1]).shape == (1,) and "1 coordinates" in repr(swing)


def test_a_file_that_changes(package, tmp_path):
    """A model stays as it was read, including required files and functions that are compiled later."""
    file, part = tmp_path / "swing.lua", tmp_path / "mass.lua"
    file.write_text(GOOD.replace("mass = 2", 'mass = require "mass"'))
    part.write_text("return 2")
    swing = package.Model(file)
    before, rest = swing.M([0.1]), float(swing.statics().rod_psi)
    part.write_text("return 3")
    with pytest.warns(package.ModelWarning, match=f"{part}: the file has changed since the model was read") as told:
        assert float(swing.statics().rod_psi) == rest
    assert told[0].filename == __file__
    assert same(swing.M([[0.1]])[0], before) and swing.d_qdd_free([0.1])["q"].shape == (1, 1) and same(swing.M([0.1]), before)
    assert package.Model(file).M([0.1]) == before * 1.5
    file.unlink()
    with pytest.warns(package.ModelWarning, match="stays as it was"):
        again = pickle.loads(pickle.dumps(swing))
    assert same(again.M([0.1]), before) and float(swing.statics().rod_psi) == rest
    with pytest.raises(AttributeError, match=f"^{file}: the model has no row_terms"):
        again.row_terms


# ---- Threads ----

def in_threads(work):
    """Runs work(number) in all threads at once; returns their results."""
    found, start = [None] * THREADS, threading.Barrier(THREADS)

    def one(number):
        start.wait()
        found[number] = work(number)

    threads = [threading.Thread(target=one, args=(number,)) for number in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return found


def test_threads_share_a_model(package):
    """All threads name its quantities for the first time, and compile its lanes, at once."""
    arm = package.Model(REFERENCE, n_rfe=2)
    q, qd = states(arm, THREADS)

    def work(number):
        one = [arm.qdd(q[number], qd[number]) for _ in range(50)]
        return one[0], all(same(one[0], other) for other in one), arm.qdd(q, qd)[number], arm.M_h(q[number], qd[number])["M"], arm.energy(q)[number]

    for number, (one, is_same, by_lanes, mass, energy) in enumerate(in_threads(work)):
        assert is_same and same(one, arm.qdd(q[number], qd[number])) and same(by_lanes, arm.qdd(q, qd)[number])
        assert same(mass, arm.M_h(q[number], qd[number])["M"]) and same(energy, arm.energy(q)[number])


def test_threads_have_models_of_their_own(package):
    def work(number):
        swing = package.Model.from_text(GOOD.replace("mass = 2", f"mass = {1 + number % 4}"))
        return swing.M([0.3])[0, 0], float(swing.statics().rod_psi)

    for number, (inertia, rest) in enumerate(in_threads(work)):
        mass = 1 + number % 4
        assert inertia == 0.25 * mass and abs(20 * rest + 0.5 * mass * 9.81 * np.cos(rest)) < 1e-9


def wakes_during(call):
    """How often the main thread wakes while another one makes this call."""
    done, wakes = threading.Event(), 0

    def work():
        call()
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not done.is_set():
        time.sleep(1e-4)
        wakes += 1
    thread.join()
    return wakes


def test_the_lock_is_let_go(arm):
    """Other threads run while C computes: the main thread wakes often during one long call, unless other programs have all processors."""
    q, qd = (np.repeat(array, 60000, axis=0) for array in states(arm, 1))
    arm.qdd(q[:2], qd[:2])
    compiled, function = arm.qdd._with_lanes()
    out = np.empty(q.shape)
    assert any(wakes_during(lambda: function.many(len(q), q, qd, np.zeros(1), out, compiled.p, compiled.x)) >= 5 for _ in range(50))


# ---- The page and the notebook ----

def blocks(language):
    """(file, text) of the page's blocks."""
    return re.findall(rf"^```{language}(?: (\S+))?\n(.*?)^```", PAGE, re.M | re.S)


def test_page(wheel, tmp_path):
    """The file on the page, then its other programs in one run, from a folder that has only the models."""
    texts = [text for _, text in blocks("python")]
    assert [name for name, _ in blocks("python") if name] == ["arm.py"]
    (tmp_path / "models").symlink_to(MODELS)
    for name, text in blocks("xml"):
        (tmp_path / name).write_text(text)
    lacking = ["inputs=None", ".plan(", *([] if os.path.exists("/usr/include/wasm32-wasi/stdio.h") else ["arm.live("])]
    (tmp_path / "arm.py").write_text("\n".join(text for text in texts if not any(word in text for word in lacking)))
    said = run(wheel[1], "arm.py", cwd=tmp_path).split()
    assert said[:2] == ["(13,", "13)"] and "m" in said


def test_notebook(wheel, tmp_path):
    cells = json.loads((SOURCE / "docs" / "python.ipynb").read_text())["cells"]
    program = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    (tmp_path / "notebook.py").write_text(program)
    assert "the tip sags by 12.26 mm, the shoulder bears 8.087 N m" in run(wheel[1], "notebook.py", cwd=tmp_path, MPLBACKEND="Agg", MPLCONFIGDIR=str(tmp_path))
    assert (tmp_path / "arm.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(not LONG, reason="tests/long: downloads NumPy and xarray")
def test_four_commands(tmp_path):
    """As on the page, in an environment without Debian's packages."""
    copy = tmp_path / "refdyn"
    shutil.copytree(SOURCE, copy, ignore=COPY_WITHOUT)
    (copy / "arm.py").write_text(blocks("python")[0][1])
    script = blocks("sh")[0][1]
    assert len(script.splitlines()) == 4
    assert run("bash", "-e", "-c", script, cwd=copy, timeout=1500).split()[-1] == "m"
    has_nlopt = subprocess.run(["pkg-config", "--exists", "nlopt"]).returncode == 0
    assert ("NLopt" in run(copy / "v" / "bin" / "refdyn", "--version")) == has_nlopt
