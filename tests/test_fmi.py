"""FMUs of `refdyn export`: their contents, what is refused, and how FMPy (from PyPI) reads, compiles and simulates them."""
import ctypes
import importlib
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree
import zipfile

import numpy as np
import pytest

from program import BUILD, CORE_LIBRARY, LONG, MODELS, REFDYN, REFERENCE, SOURCE, TESTS, VERSION, check, close, motion, refdyn

ARM = SOURCE / "docs" / "casadi" / "arm.lua"
BALL = TESTS / "models" / "events" / "ball.lua"
VERSIONS = ["2.0", "3.0"]
KINDS = ["ModelExchange", "CoSimulation"]
OUTPUTS = 40

# A model, its options, and the end of its motion [s].
SCENES = {
    "rows": (MODELS / "fourbar.lua", [], 0.5),
    "inputs": (ARM, ["--set", "shoulder=0.3"], 0.3),
    "free": (MODELS / "pendulum.lua", ["--set", "n_rfe=1"], 1),
    "parameters": (MODELS / "pendulum.lua", ["--set", "n_rfe=1", "--set", "m_bob=0.8", "--set", "L=1.7"], 1),
    "programme": (REFERENCE, ["--set", "n_rfe=1"], 2.5),
    "redundant rows": (MODELS / "fourbar.lua", ["--set", "joints=spatial"], 0.3),
    "directions": (TESTS / "models" / "orientation.lua", [], 1),
    "platform": (MODELS / "stewart.lua", [], 0.3),
    "impacts": (TESTS / "models" / "bouncing.lua", [], 0.07),
    "stop": (TESTS / "models" / "events" / "pendulum.lua", [], 1),
    "ball": (BALL, [], 3),
    "time events": (TESTS / "models" / "switched.lua", ["--set", "form=left"], 0.9),
    "wave": (TESTS / "models" / "switched.lua", ["--set", "form=wave"], 0.9),
    "input of events": (TESTS / "models" / "events" / "block.lua", [], 1),
    "continuous states": (TESTS / "models" / "control" / "states.lua", [], 0.4),
}
# Scenes and versions; all of them in tests/long.
FEW = [("rows", "2.0"), ("inputs", "3.0"), ("free", "2.0"), ("continuous states", "3.0")]
CHOSEN = [(scene, version) for scene in SCENES for version in VERSIONS] if LONG else FEW


def versions_of(scene):
    return [version for name, version in CHOSEN if name == scene]


# ---- What is in an FMU ----

def export(model, version, file, *arguments, **ways):
    refdyn("export", model, "--fmu", version, *arguments, "-o", file, **ways)
    return file


def description(file):
    return xml.etree.ElementTree.fromstring(zipfile.ZipFile(file).read("modelDescription.xml"))


def variables(about):
    """Attributes by name; for FMI 2.0 also those of the inner element."""
    return {entry.get("name"): {**entry.attrib, **(entry[0].attrib if len(entry) else {})} for entry in about.find("ModelVariables")}


@pytest.fixture(scope="module")
def file_of(tmp_path_factory):
    """The FMU of a scene in one version; each is made once."""
    made = {}

    def get(scene, version):
        if (scene, version) not in made:
            model, arguments, until = SCENES[scene]
            made[scene, version] = export(model, version, tmp_path_factory.mktemp("fmu") / "a.fmu", *arguments, "--until", until, "--tol", 1e-9)
        return made[scene, version]
    return get


@pytest.fixture(scope="module", params=versions_of("rows"))
def linkage(request, file_of):
    return request.param, file_of("rows", request.param)


def test_same_bytes(linkage, tmp_path):
    version, file = linkage
    again = export(MODELS / "fourbar.lua", version, tmp_path / "b.fmu", "--until", 0.5, "--tol", 1e-9, cwd=tmp_path)
    assert again.read_bytes() == file.read_bytes()


def test_tolerance_of_rates(tmp_path):
    file = export(MODELS / "fourbar.lua", "2.0", tmp_path / "a.fmu", "--tol", 1e-9, "--tol-rates", 1e-7)
    archive = zipfile.ZipFile(file)
    assert any(b".tol_rates = 1e-07," in archive.read(name) for name in archive.namelist() if name.startswith("sources/"))


def test_files(linkage):
    version, file = linkage
    archive = zipfile.ZipFile(file)
    names = archive.namelist()
    folder = "linux64" if version == "2.0" else "x86_64-linux"
    assert description(file).get("generationTool") == f"refdyn {VERSION}"
    assert archive.testzip() is None and f"binaries/{folder}/fourbar.so" in names
    assert archive.read("documentation/licenses/license.txt") == (SOURCE / "LICENSE").read_bytes()
    listed = description(file) if version == "2.0" else xml.etree.ElementTree.fromstring(archive.read("sources/buildDescription.xml"))
    tag = "File" if version == "2.0" else "SourceFile"
    sources = {f"sources/{entry.get('name')}" for entry in listed.iter(tag)}
    assert sources == {name for name in names if name.endswith(".c")}
    texts = {name: archive.read(name).decode() for name in names if name.startswith("sources/")}
    assert not [name for name, text in texts.items() if re.search(r"GPL|gsl|General Public|/tmp/|/home/", text)]
    included = {name for text in texts.values() for name in re.findall(r'#include "(.*?)"', text)}
    assert not {name for name in included if f"sources/{name}" not in names}


def test_variables(linkage):
    about = description(linkage[1])
    found = variables(about)
    units = {"crank_psi": "rad", "crank_psi_d": "rad/s", "der(crank_psi)": "rad/s", "crank_psi_dd": "rad/s^2", "torque": "N m", "rho": "kg/m^3", "pin_x": "m", "energy": "J"}
    check(f"{name}: {found[name].get('unit')}" for name, unit in units.items() if found[name].get("unit") != unit)
    assert found["torque"]["causality"] == "input" and float(found["torque"]["start"]) == 1.5
    assert found["rho"]["variability"] == "tunable" and float(found["rho"]["start"]) == 2700
    assert {unit.get("name") for unit in about.find("UnitDefinitions")} >= set(units.values())
    density = next(unit for unit in about.find("UnitDefinitions") if unit.get("name") == "kg/m^3")
    assert density[0].attrib == {"kg": "1", "m": "-3"}


def test_parameters_of_events(tmp_path):
    """Parameters that events set change during a motion, so they are no parameters for an importer. A variable without a unit names none.
    No file of a model has a name of ours."""
    text = (TESTS / "models" / "events" / "spring.lua").read_text().replace('1, "m"', '1')
    model = tmp_path / "refdyn_fmu_model.lua"
    model.write_text(re.sub(r'name = "\w+"', 'name = "fmu_model"', text, count=1))
    about = description(export(model, "2.0", tmp_path / "a.fmu"))
    found = variables(about)["s"]
    assert (found["causality"], found["variability"], found["initial"]) == ("local", "discrete", "exact")
    assert not [unit for unit in about.find("UnitDefinitions") if not unit.get("name")]
    assert not [name for name, entry in variables(about).items() if entry.get("unit") == ""]


# ---- What is refused ----

MODEL = MODELS / "pendulum.lua"
NOWHERE = "no_such_folder/a.fmu"
REFUSED = {
    "version": (["--fmu", "1.0"], 2, "refdyn export: --fmu: '1.0' is not one of 2.0, 3.0"),
    "no version": ([], 2, "refdyn export: --fmu is missing"),
    "platform": (["--fmu", "2.0", "--platform", "linux64,win32"], 2, "refdyn export: --platform: 'win32' is not one of linux64, win64"),
    "folder": (["--fmu", "2.0", "-o", NOWHERE], 1, f"{NOWHERE}: output: cannot be written: No such file or directory"),
    "method": (["--fmu", "3.0", "--method", "msbdf"], 2, "refdyn export: --method: 'msbdf' is a method of GSL, which FMUs do not contain"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case, tmp_path):
    arguments, status, message = REFUSED[case]
    output = [] if "-o" in arguments else ["-o", "a.fmu"]
    done = refdyn("export", MODEL, *arguments, *output, status=status, cwd=tmp_path)
    assert message in done.stderr.splitlines() and not list(tmp_path.iterdir()), done.stderr


# ---- For Windows ----

MINGW = shutil.which("x86_64-w64-mingw32-gcc")
WINE = next((path for path in (shutil.which("wine64"), "/usr/lib/wine/wine64") if path and os.path.exists(path)), None)


def test_compilers_that_are_missing(tmp_path):
    """Each missing compiler is named with the remedy, and no FMU remains."""
    done = refdyn("export", MODEL, "--fmu", "2.0", "-o", "a.fmu", status=1, cwd=tmp_path, env={"CC": "no-such-cc", "REFDYN_CACHE": str(tmp_path / "cache")})
    assert "no-such-cc" in done.stderr
    done = refdyn("export", MODEL, "--fmu", "2.0", "-o", "a.fmu", status=1, cwd=tmp_path, env={"CC": "cc -U__LP64__", "REFDYN_CACHE": str(tmp_path / "cache")})
    assert "refdyn: --platform linux64: $CC does not build for x86_64-linux" in done.stderr.splitlines()
    only = tmp_path / "only"
    only.mkdir()
    for program in ("as", "ld"):  # of cc
        (only / program).symlink_to(shutil.which(program))
    done = refdyn("export", MODEL, "--fmu", "2.0", "--platform", "win64", "-o", "a.fmu", status=1, cwd=tmp_path, env={"CC": shutil.which("cc"), "PATH": str(only)})
    assert "refdyn: --platform win64: no x86_64-w64-mingw32-gcc is installed (Debian: apt install gcc-mingw-w64-x86-64)" in done.stderr
    assert not (tmp_path / "a.fmu").exists()


@pytest.mark.skipif(not (LONG and MINGW), reason="takes long: tests/long; and needs gcc-mingw-w64-x86-64")
@pytest.mark.parametrize("version", VERSIONS)
def test_windows_library(version, tmp_path):
    """It exports the functions of FMI and needs only libraries of Windows."""
    file = export(MODELS / "fourbar.lua", version, tmp_path / "a.fmu", "--platform", "win64")
    assert export(MODELS / "fourbar.lua", version, tmp_path / "b.fmu", "--platform", "win64").read_bytes() == file.read_bytes()
    folder = "win64" if version == "2.0" else "x86_64-windows"
    library = tmp_path / "fourbar.dll"
    library.write_bytes(zipfile.ZipFile(file).read(f"binaries/{folder}/fourbar.dll"))
    said = subprocess.run(["x86_64-w64-mingw32-objdump", "-p", library], check=True, capture_output=True, text=True).stdout
    assert {name.lower() for name in re.findall("DLL Name: (.*)", said)} == {"kernel32.dll", "msvcrt.dll"}
    header = (SOURCE / "runtime" / "bindings" / "fmi" / f"fmi{version[0]}.h").read_text()
    exported = set(re.findall(r"\] (fmi\w+)$", said, re.M))
    assert exported == set(re.findall(rf"#define (fmi{version[0]}\w+) ", header)) if version == "2.0" else {"fmi3DoStep", "fmi3GetFloat64"} <= exported


def stepper(folder, compiler, name, *more):
    """fmi/cosimulate.c, a caller of Co-Simulation without FMPy, compiled."""
    subprocess.run([compiler, "-std=gnu11", "-I", SOURCE, "-I", SOURCE / "runtime", TESTS / "fmi" / "cosimulate.c", *more, "-o", folder / name], check=True)
    return folder / name


@pytest.mark.quick
def test_steps_of_a_caller(tmp_path):
    """
    The sources of an FMU that are the model's own, linked with the libraries of the build, since all sources together take long to
    compile. For the same reason the library in the FMU holds nothing of them here.
    """
    (tmp_path / "empty").write_text("""#!/bin/sh
case "$*" in *fourbar* | *machine.c*) exec cc "$@" ;; esac
while [ "$1" != -o ]; do shift; done
exec cc -c -x c /dev/null -o "$2"
""")
    (tmp_path / "empty").chmod(0o755)
    file = export(MODELS / "fourbar.lua", "2.0", tmp_path / "a.fmu", "--tol", 1e-9, env={"CC": str(tmp_path / "empty")})
    zipfile.ZipFile(file).extractall(tmp_path)
    own = [tmp_path / "sources" / name for name in ("refdyn_fmu.c", "fourbar.c")]
    program = stepper(tmp_path, "cc", "step", "-rdynamic", *own, "-Wl,--whole-archive", BUILD / "librefdyn_fmi.a", "-Wl,--no-whole-archive",
                      CORE_LIBRARY, "-lm")
    said = subprocess.run([program, "", description(file).get("guid"), "0.03"], check=True, capture_output=True, text=True).stdout
    found = np.array([[float(value) for value in line.split()] for line in said.splitlines()])
    names = {int(entry["valueReference"]): name for name, entry in variables(description(file)).items()}
    run, _, _ = motion(MODELS / "fourbar.lua", "--every", 0.03, "--until", 0.3, "--tol", 1e-9)
    compared = [k for k in range(found.shape[1]) if names[k] in run]
    assert len(compared) > 3
    check([close(names[k], found[:, k], run[names[k]][1:], 1e-6, 1) for k in compared])


@pytest.mark.skipif(not (LONG and MINGW and WINE), reason="takes long: tests/long; and needs gcc-mingw-w64-x86-64 and wine64")
def test_windows_motion(tmp_path):
    """The motion under Wine equals the motion on Linux."""
    file = export(MODELS / "fourbar.lua", "2.0", tmp_path / "a.fmu", "--platform", "linux64,win64")
    zipfile.ZipFile(file).extractall(tmp_path)
    guid = description(file).get("guid")
    stepper(tmp_path, "cc", "step")
    stepper(tmp_path, MINGW, "step.exe")
    here = subprocess.run([tmp_path / "step", tmp_path / "binaries/linux64/fourbar.so", guid, "0.03"], check=True, capture_output=True, text=True).stdout
    env = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    there = subprocess.run([WINE, "step.exe", "binaries/win64/fourbar.dll", guid, "0.03"], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=600)
    assert there.returncode == 0, there.stderr
    check([close("states", *[[float(value) for value in said.split()] for said in (there.stdout, here)], 1e-9)])


# ---- By FMPy ----

@pytest.fixture(scope="session")
def fmpy(tmp_path_factory):
    """FMPy and its requirements without notebooks, in a fresh environment. NumPy is Debian's."""
    folder = tmp_path_factory.mktemp("fmpy")
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", folder / "v"], check=True)
    python = folder / "v" / "bin" / "python"
    packages = ["fmpy", "attrs", "lark", "lxml", "msgpack"]
    done = subprocess.run([python, "-m", "pip", "install", "-q", "--no-deps", "--no-compile", "--disable-pip-version-check", *packages],
                          capture_output=True, text=True)
    if done.returncode:
        pytest.fail(f"FMPy is not to be had from PyPI:\n{done.stderr[-1500:]}", pytrace=False)
    site = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('platlib'))"], check=True, capture_output=True, text=True).stdout.strip()
    sys.path.insert(0, site)
    yield importlib.import_module("fmpy")
    sys.path.remove(site)


@pytest.fixture(scope="module")
def fmus(fmpy, file_of, tmp_path_factory):
    """The FMU of a scene in one version, and its files in a folder."""
    folders = {}

    def get(scene, version):
        file = str(file_of(scene, version))
        if file not in folders:
            folders[file] = fmpy.extract(file, str(tmp_path_factory.mktemp("files")))
        return file, folders[file]
    return get


def simulate(fmpy, folder, kind, until, outputs, **ways):
    return fmpy.simulate_fmu(folder, fmi_type=kind, stop_time=until, output_interval=until / OUTPUTS, relative_tolerance=1e-9,
                             output=outputs, record_events=False, **ways)


def differences(run, found, names, tolerance):
    """Differences at those times of FMPy that are also output times of the motion."""
    rows = [(i, int(k)) for i, t in enumerate(found["time"]) for k in np.flatnonzero(np.isclose(run["t"], t, rtol=0, atol=1e-9))]
    assert len(rows) >= OUTPUTS, f"{len(rows)} times in common"
    here, there = map(list, zip(*rows))
    return [close(name, found[name][here], run[name][there], tolerance, scale=max(1, abs(run[name]).max())) for name in names]


def coordinates_of(run):
    """Coordinates and rates of a motion."""
    return [name for name in run if name + "_d" in run or name.endswith("_d") and name[:-2] in run]


@pytest.mark.parametrize(("scene", "version"), CHOSEN)
def test_validate(fmpy, fmus, scene, version):
    validation = importlib.import_module("fmpy.validation")
    assert validation.validate_fmu(fmus(scene, version)[0]) == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("scene", "version"), CHOSEN)
def test_motion(fmpy, fmus, scene, version, kind, capfd):
    """Equal to `sim`, without a message."""
    model, arguments, until = SCENES[scene]
    run, _, _ = motion(model, *arguments, "--until", until, "--every", until / OUTPUTS, "--tol", 1e-9)
    folder = fmus(scene, version)[1]
    names = [entry.derivative.name for entry in fmpy.read_model_description(folder).modelVariables if entry.derivative]
    found = simulate(fmpy, folder, kind, until, names)
    check(differences(run, found, names, 1e-5))
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
@pytest.mark.parametrize("version", VERSIONS)
def test_rows_do_not_drift(fmpy, version, tmp_path):
    """Model Exchange with rows whose gains the model does not set: at a coarse tolerance (without any gains 2e-2), and as in `sim`."""
    model = TESTS / "fmi" / "crank.lua"
    file = str(export(model, version, tmp_path / "a.fmu"))
    coarse = fmpy.simulate_fmu(file, fmi_type="ModelExchange", stop_time=20, relative_tolerance=1e-5, output_interval=0.1, output=["phi_1"])
    assert abs(coarse["phi_1"]).max() < 2e-4
    run, _, _ = motion(model, "--start", "project", "--until", 2, "--every", 2 / OUTPUTS, "--tol", 1e-9)
    names = coordinates_of(run)
    check(differences(run, simulate(fmpy, file, "ModelExchange", 2, names), names, 1e-5))


# ---- One instance ----

class Instance:
    """One instance of an FMU in either version, with the same calls."""

    def __init__(self, fmpy, folder, is_exchange, is_begun=True, **start):
        about = fmpy.read_model_description(folder)
        self.about, self.version = about, about.fmiVersion[0]
        self.of = {entry.name: entry for entry in about.modelVariables}
        kind = "Model" if is_exchange else "Slave"
        make = getattr(importlib.import_module(f"fmpy.fmi{self.version}"), f"FMU{self.version}{kind}")
        self.fmu = make(guid=about.guid, unzipDirectory=folder, modelIdentifier=about.modelExchange.modelIdentifier, instanceName="one")
        self.is_exchange = is_exchange
        self.fmu.instantiate()
        if is_begun:
            self.begin(**start)

    def begin(self, **start):
        self.enter_initialisation()
        for name, value in start.items():
            self.set(name, value)
        self.fmu.exitInitializationMode()
        if self.is_exchange:
            self.take_events()
            self.fmu.enterContinuousTimeMode()

    def enter_initialisation(self, **experiment):
        if self.version == "2":
            self.fmu.setupExperiment(startTime=0, **experiment)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=0, **experiment)

    def take_events(self):
        (self.fmu.newDiscreteStates if self.version == "2" else self.fmu.updateDiscreteStates)()

    def set(self, name, value):
        (self.fmu.setReal if self.version == "2" else self.fmu.setFloat64)([self.of[name].valueReference], [value])

    def get(self, names):
        return np.array((self.fmu.getReal if self.version == "2" else self.fmu.getFloat64)([self.of[name].valueReference for name in names]))

    def set_states(self, x):
        self.fmu.setContinuousStates((ctypes.c_double * len(x))(*x), len(x))

    def derivatives(self, unknowns, known):
        references = [self.of[name].valueReference for name in unknowns]
        return np.array(self.fmu.getDirectionalDerivative(references, [self.of[known].valueReference], [1.0]))

    def states(self):
        return [entry.derivative.name for entry in self.about.modelVariables if entry.derivative is not None]

    def rates(self):
        return [entry.name for entry in self.about.modelVariables if entry.derivative is not None]

    def outputs(self):
        return [entry.name for entry in self.about.modelVariables if entry.causality == "output"]

    def inputs(self):
        return [entry.name for entry in self.about.modelVariables if entry.causality == "input"]

    def steps(self, first, last, h=0.01):
        """The states after steps of Co-Simulation."""
        for i in range(first, last):
            self.fmu.doStep(i * h, h)
        return self.get(self.states())

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()

REFUSED_MODEL = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "outer", 0.1, "m" }, { "inner", 0.05, "m" }, { "T", 1, "s" }, { "Ix", 1, "kg m^2" }, { "c", 1 } }
return rd.model { name = "refused", gravity = { 0, 0, -9.81 },
  links = { { "cart", joint = "x", mass = p.m, damper = { x = p.c } },
    { "arm", on = "cart", joint = "theta, psi", inertia = { xx = p.Ix, yy = 1, zz = 1 }, mass = 1,
      bodies = { rd.tube { outer = p.outer, inner = p.inner, length = 1, axis = "z", density = 100, at = { 0, 0, -0.5 } } } } },
  forces = function(s) return { cart_x = rd.ramp(s.t, 0.2, p.T) } end }
"""
REFUSALS = {"m": (-0.05, "links[1].mass: value -0.05; must be positive"),
            "inner": (0.2, "links[2].bodies[1].inner: inner diameter 0.2; must be less than the outer diameter, 0.1"),
            "T": (0.1, "rd.ramp: from 0.2 to 0.1; the range must ascend"), "Ix": (3, "link arm: moments of inertia 3 1 1; each must be at most the sum of the other two"),
            "c": (-1, "links[1].damper.x: value -1; must not be negative")}


@pytest.mark.parametrize("version", VERSIONS)
def test_values_that_the_model_refuses(fmpy, version, tmp_path, capfd):
    """At the start, and between steps; each with a message. Other values are accepted."""
    (tmp_path / "refused.lua").write_text(REFUSED_MODEL)
    folder = fmpy.extract(str(export(tmp_path / "refused.lua", version, tmp_path / "a.fmu")), str(tmp_path / "files"))
    for is_exchange in (True, False):
        for name, (value, words) in REFUSALS.items():
            with pytest.raises(Exception):
                Instance(fmpy, folder, is_exchange, **{name: value})
            said = capfd.readouterr()
            assert words in said.out + said.err, said
        good = Instance(fmpy, folder, is_exchange, m=2, inner=0.09, outer=0.2)
        if is_exchange:
            good.fmu.enterEventMode()
        good.set("m", -1)
        with pytest.raises(Exception):
            good.get(["cart_x_dd"])
        said = capfd.readouterr()
        assert "links[1].mass: value -1; must be positive" in said.out + said.err, said



@pytest.mark.parametrize(("scene", "version"), CHOSEN)
def test_directional_derivatives(fmpy, fmus, scene, version):
    """Of all derivatives and outputs by all states and inputs, against central differences at a state without symmetry."""
    one = Instance(fmpy, fmus(scene, version)[1], True)
    random = np.random.default_rng(3)
    states, inputs, unknowns = one.states(), one.inputs(), one.rates() + one.outputs()
    x = one.get(states) + 0.1 * random.standard_normal(len(states))
    u = one.get(inputs) + 0.1 * random.standard_normal(len(inputs))
    step = 1e-5

    def values(dx, du):
        one.set_states(x + dx)
        for name, value in zip(inputs, u + du):
            one.set(name, value)
        return one.get(unknowns)

    size = abs(values(0, 0)) + 1
    exact = []
    differences = []
    for i, name in enumerate(states + inputs):
        move = np.zeros(len(states + inputs))
        move[i] = step
        dx, du = move[:len(states)], move[len(states):]
        differences.append((values(dx, du) - values(-dx, -du)) / (2 * step))
        values(0, 0)
        exact.append(one.derivatives(unknowns, name))
    exact, differences = np.array(exact), np.array(differences)
    scale = np.maximum(abs(differences).max(axis=0), size)
    check(close(f"d({name})", exact[:, i], differences[:, i], 1e-6, scale=scale[i]) for i, name in enumerate(unknowns))
    one.close()


@pytest.mark.parametrize("version", versions_of("rows"))
def test_states_of_instances(fmpy, fmus, version):
    """Two simultaneous instances; a state that is saved and restored; reset: equal to the bit."""
    folder = fmus("rows", version)[1]
    one, other = Instance(fmpy, folder, False), Instance(fmpy, folder, False, torque=0.4)
    middle = one.steps(0, 10)
    other.steps(0, 7)
    saved = one.fmu.getFMUState()
    end = one.steps(10, 20)
    one.fmu.setFMUState(saved)
    assert np.array_equal(one.get(one.states()), middle) and np.array_equal(one.steps(10, 20), end)
    one.fmu.freeFMUState(saved)
    one.fmu.reset()
    one.begin()
    assert np.array_equal(one.steps(0, 10), middle) and not np.array_equal(other.steps(7, 10), middle)
    one.close()
    other.close()


@pytest.mark.parametrize("version", versions_of("inputs"))
def test_parameter_changes(fmpy, fmus, version, tmp_path):
    """A tunable parameter and an input change between steps: as in two motions of `sim`, one from the end of the other."""
    model, arguments, _ = SCENES["inputs"]
    one = Instance(fmpy, fmus("inputs", version)[1], False)
    one.steps(0, 10)
    one.set("load", 0.9)
    one.set("shoulder", -0.5)
    found = one.steps(10, 20)
    run, _, _ = motion(model, *arguments, "--until", 0.1, "--every", 0.1, "--tol", 1e-9)
    names = coordinates_of(run)
    n = len(names) // 2
    state = tmp_path / "state.json"
    state.write_text('{"t": 0.1, "q": %s, "qd": %s}' % ([run[name][-1] for name in names[:n]], [run[name][-1] for name in names[n:]]))
    run, _, _ = motion(model, "--from", state, "--set", "load=0.9", "--set", "shoulder=-0.5", "--until", 0.2, "--every", 0.1, "--tol", 1e-9)
    assert [name for name in one.states()] == names
    check([close("states", found, [run[name][-1] for name in names], 1e-6)])
    one.close()


@pytest.mark.parametrize("version", versions_of("rows"))
def test_no_end_before_the_start(fmpy, fmus, version):
    """Terminate is refused while an instance initialises; the initialisation then continues."""
    one = Instance(fmpy, fmus("rows", version)[1], True, is_begun=False)
    one.enter_initialisation()
    with pytest.raises(Exception, match=f"fmi{version[0]}Terminate"):
        one.fmu.terminate()
    energy = one.get(["energy"])
    one.fmu.exitInitializationMode()
    assert np.isfinite(energy).all() and np.array_equal(one.get(["energy"]), energy)
    one.close()


@pytest.mark.parametrize("version", versions_of("rows"))
def test_values_set_before_events(fmpy, fmus, version):
    """A parameter and an input set in the first event mode are valid, whether they are set before or after the events are handled."""
    folder = fmus("rows", version)[1]
    found = []
    for order in ("initialising", "before", "after"):
        one = Instance(fmpy, folder, True, is_begun=False)
        one.enter_initialisation()
        for stage in ("initialising", "before", "after"):
            if stage == order:
                one.set("g", 3.3)
                one.set("torque", 0.7)
            if stage == "initialising":
                one.fmu.exitInitializationMode()
            elif stage == "before":
                one.take_events()
        one.take_events()
        one.fmu.enterContinuousTimeMode()
        found.append(one.get(one.rates()))
        one.close()
    usual = Instance(fmpy, folder, True)
    assert not np.allclose(usual.get(usual.rates()), found[0], rtol=1e-3)
    usual.close()
    check(close("accelerations", values, found[0], 1e-12) for values in found[1:])


@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
def test_anchored_parameter(fmpy, tmp_path):
    """It follows the start, also if the importer writes the exported value back; another value replaces it."""
    folder = fmpy.extract(str(export(TESTS / "models" / "programme.lua", "2.0", tmp_path / "a.fmu")), str(tmp_path / "files"))
    exported = float(variables(description(tmp_path / "a.fmu"))["height"]["start"])
    heights = []
    for start in ({}, {"height": exported}, {"height": exported + 0.01}):
        one = Instance(fmpy, folder, True, rod_theta=0.5, **start)
        heights.append(one.get(["height"])[0])
        one.close()
    assert heights[0] == heights[1] != exported and heights[2] == exported + 0.01


@pytest.mark.parametrize("version", versions_of("rows"))
def test_tolerances(fmpy, fmus, version):
    """Co-Simulation refuses a tolerance that no method can keep; Model Exchange takes no steps and needs no tolerance."""
    for tolerance in (1e-17, 1, 3.5):
        one = Instance(fmpy, fmus("rows", version)[1], False, is_begun=False)
        with pytest.raises(Exception, match="SetupExperiment|EnterInitializationMode"):
            one.enter_initialisation(tolerance=tolerance)
        one.fmu.freeInstance()
        one = Instance(fmpy, fmus("rows", version)[1], True, is_begun=False)
        one.enter_initialisation(tolerance=tolerance)
        one.fmu.exitInitializationMode()
        one.close()


# ---- Compiled from the sources inside, and the page ----

@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
@pytest.mark.parametrize("version", VERSIONS)
def test_compiled_by_fmpy(fmpy, fmus, version, tmp_path):
    """The same motion, to rounding, and no compiler warning about our files."""
    _, folder = fmus("rows", version)
    copy = tmp_path / "files"
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("binaries"))
    command = "import sys, fmpy.build; fmpy.build.build_platform_binary(sys.argv[1], all_warnings=True)"
    done = subprocess.run([sys.executable, "-c", command, copy], env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, capture_output=True, text=True)
    assert done.returncode == 0 and "warning" not in done.stdout + done.stderr, done.stdout[-2000:] + done.stderr[-2000:]
    names = [entry.derivative.name for entry in fmpy.read_model_description(folder).modelVariables if entry.derivative is not None]
    ours, theirs = (simulate(fmpy, str(of), "CoSimulation", 0.3, names) for of in (folder, copy))
    check(close(name, theirs[name], ours[name], 1e-9, scale=1) for name in names)


@pytest.mark.skipif(not LONG, reason="takes long: tests/long")
def test_the_page(fmpy, tmp_path):
    """Its commands, with the FMPy of the tests."""
    (tmp_path / "models").symlink_to(MODELS)
    page = (SOURCE / "docs" / "fmi.md").read_text()
    script = "\n".join(line for block in re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S) for line in block.splitlines() if "pip install" not in line)
    (tmp_path / "drive.py").write_text(re.search(r"^```python drive.py\n(.*?)^```", page, re.M | re.S)[1])
    bin_folder = os.path.join(os.path.dirname(fmpy.__file__), *[os.pardir] * 4, "bin")
    env = {**os.environ, "PATH": f"{bin_folder}:{os.path.dirname(REFDYN)}:{os.environ['PATH']}"}
    said = subprocess.run(["bash", "-e", "-c", script], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=500)
    assert said.returncode == 0, said.stdout + said.stderr
    assert "No problems found" in said.stdout, said.stdout
