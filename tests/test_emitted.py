"""The emitted C: free of warnings in both languages and with both compilers, equal on every run, and without anything that a scene does not
use."""
import json
import re
import shutil
import subprocess

import pytest

from program import LONG, REFERENCE, SOURCE, TESTS, evaluate, few_models, few_models_of_tests, refdyn

WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()
COMPILERS = [["gcc", "-std=c11"], ["clang", "-std=c11"], ["clang++", "-std=c++17", "-x", "c++"], ["g++", "-std=c++17", "-x", "c++"]]
SCENES = [(path, []) for path in few_models() + few_models_of_tests()]
SCENES += [(REFERENCE, ["--set", "n_rfe=1"]), (REFERENCE, ["--set", "form=printed"]), (REFERENCE, ["--set", "dofs=psi"]),
           (REFERENCE, ["--set", "program=none"]), (REFERENCE, ["--set", "drive=input"])]
SCENES += [(TESTS / "models" / "control" / "states.lua", [])]
RUNS = TESTS / "models" / "runs.lua"
SCENES += [(RUNS, ["--set", f"kind={kind}", "--set", f"rfe={rfe}", "--loops", "always"]) for kind, rfe in (("rods", 3), ("slides", 6))]
SCENES += [(path, [*options, "--fold"]) for path, options in (SCENES if LONG else SCENES[::3])]


def name_of(scene):
    return " ".join([scene[0].stem, *(word for word in scene[1] if word != "--set")])


def emit(folder, model, *options):
    """The emitted files by name."""
    folder.mkdir(exist_ok=True)
    refdyn("gen", model, *options, "-o", folder)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", folder)
    return {path.name: path.read_text() for path in sorted(folder.iterdir()) if path.name != "refdyn_model.h"}


def code(files):
    """All emitted text without comments and string contents."""
    text = "\n".join(files.values())
    text = re.sub(r'"(\\.|[^"\\\n])*"', '""', text)
    return re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)


@pytest.mark.parametrize("scene", SCENES, ids=name_of)
def test_compiles_alone_without_warning(scene, tmp_path):
    """Of the compilers each scene takes the next one, in tests/long all."""
    files = emit(tmp_path, scene[0], *scene[1])
    for compiler in COMPILERS if LONG else [COMPILERS[SCENES.index(scene) % len(COMPILERS)]]:
        for source in (name for name in files if name.endswith(".c")):
            done = subprocess.run([*compiler, *WARNINGS, "-O0", "-c", source, "-o", "out.o"], cwd=tmp_path, capture_output=True,
                                  text=True)
            assert done.returncode == 0, f"{compiler[0]} {source}\n{done.stderr[:2000]}"
    header = next(name for name in files if name.endswith(".h"))
    for compiler in ["gcc", "-std=c11", "-x", "c"], COMPILERS[3]:
        done = subprocess.run([*compiler, *WARNINGS, "-fsyntax-only", "-"], cwd=tmp_path, text=True, capture_output=True,
                              input=f'#include "{header}"\n#include "{header}"\n')
        assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.parametrize("kind, rfe", [("driven", 4), ("rods", 3), ("sides", 6)])
@pytest.mark.parametrize("level", ["-O2", "-O3"] if LONG else ["-O2"])
def test_derivatives_compile_optimised_without_warning(kind, rfe, level, tmp_path):
    """An optimiser finds values that are read but never set, and checks that loops of derivatives set all of them."""
    files = emit(tmp_path, RUNS, "--set", f"kind={kind}", "--set", f"rfe={rfe}", "--emit", "tangent,d_qdd,d_statics")
    for source in (name for name in files if name.endswith(".c")):
        subprocess.run(["gcc", "-std=c11", *WARNINGS, level, "-c", source, "-o", "out.o"], cwd=tmp_path, check=True)


@pytest.mark.parametrize("scene", SCENES[::2 if LONG else 4], ids=name_of)
def test_needs_libm_alone(scene, tmp_path):
    """No external symbol except functions of libm; no variable that changes; no allocation."""
    files = emit(tmp_path, scene[0], *scene[1])
    objects = []
    for source in (name for name in files if name.endswith(".c")):
        objects.append(source + ".o")
        subprocess.run(["gcc", "-std=c11", "-O1", "-c", source, "-o", objects[-1]], cwd=tmp_path, check=True)
    symbols = subprocess.run(["nm", *objects], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.splitlines()
    defined = {line.split()[-1] for line in symbols if re.match(r"[0-9a-f]+ [TDRBVWdrbt] ", line)}
    wanted = {line.split()[-1] for line in symbols if re.match(r"\s+U ", line)} - defined
    libm = {"sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "pow",
            "fabs", "fmin", "fmax", "floor", "hypot", "_GLOBAL_OFFSET_TABLE_"}
    assert wanted <= libm, wanted - libm
    changing = [line for line in symbols if re.match(r"[0-9a-f]+ [BbCDd] ", line) and ".data.rel.ro" not in line]
    sections = subprocess.run(["objdump", "-h", *objects], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    for section in (".data", ".bss"):
        sizes = re.findall(rf"\s{re.escape(section)}\s+([0-9a-f]+)\s", sections)
        assert all(int(size, 16) == 0 for size in sizes), (section, changing)
    name = next(file for file in files if file.endswith(".h"))[:-2]
    outside = {line.split()[-1] for line in symbols if re.match(r"[0-9a-f]+ [TDRBVW] ", line)}
    assert all(symbol.startswith(name + "_") for symbol in outside), outside


@pytest.mark.parametrize("scene", SCENES, ids=name_of)
def test_equal_on_every_run(scene, tmp_path):
    first, second = (emit(tmp_path / folder, scene[0], *scene[1]) for folder in "ab")
    assert first == second


def test_no_date_or_path(tmp_path):
    text = "\n".join(emit(tmp_path, REFERENCE).values())
    assert str(SOURCE) not in text and not re.search(r"\b20\d\d-\d\d-\d\d\b|\b\d\d:\d\d:\d\d\b", text)


def parameters(files):
    """Fields of the struct of parameters, without the derived values."""
    text = code(files)
    body = re.search(r"struct \w+_parameters\s*\{(.*?)\}", text, re.S).group(1)
    return set(re.findall(r"\bdouble (\w+)", body))


def operations(files):
    """Additions, multiplications and divisions of all functions, as the header counts them."""
    header = next(text for name, text in files.items() if name.endswith(".h"))
    return sum(int(number) for row in re.findall(r"^ \*   \w+ +(\d+) +(\d+) +(\d+) +\d+ +\d+$", header, re.M) for number in row)


def functions(files):
    return set(re.findall(r"^void \w+?_(M|h|Q|u|v|phi|psi|k|r|rd|C|d|energy|power|Q_q|qdd_free|qdd|force|equations)\(",
                          code(files), re.M))


def test_no_constraints_no_rows(tmp_path):
    files = emit(tmp_path, TESTS / "models" / "double_pendulum.lua")
    assert functions(files) >= {"M", "h", "Q", "qdd", "qdd_free", "energy", "r", "C", "d"}
    assert not functions(files) & {"u", "v", "phi", "psi", "k", "force"}


def test_no_points_no_columns(tmp_path):
    files = emit(tmp_path, TESTS / "models" / "pendulum_flexible.lua")
    assert functions(files) >= {"M", "h", "Q"}
    assert not functions(files) & {"r", "rd", "C", "d", "u", "v", "k"}


def test_plane_elements_cost_nothing_elsewhere(tmp_path):
    files = emit(tmp_path, REFERENCE, "--set", "dofs=psi", "--loops", "never")
    assert "arm_psi_3" in "\n".join(files.values())
    assert not re.findall(r"\w*theta\w*|\w*arm_phi\w*", code(files))
    assert "nu" not in parameters(files), "the shear modulus is not needed without torsion"
    whole = emit(tmp_path / "whole", REFERENCE, "--loops", "never")
    assert operations(files) < 0.5 * operations(whole)


def test_parameter_that_nothing_reads(tmp_path):
    used = parameters(emit(tmp_path, REFERENCE))
    assert used >= {"m_E", "s_sup", "d_sup", "E", "rho", "a", "b", "alpha", "beta", "v0", "T"}
    free = parameters(emit(tmp_path / "free", REFERENCE, "--set", "program=none"))
    assert not free & {"a", "b", "alpha", "beta", "v0", "T", "xc"}
    # It may nevertheless be set.
    refdyn("gen", REFERENCE, "--set", "program=none", "--set", "alpha=5", "-o", tmp_path / "free")


SMALL = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "g", {g}, "m/s^2" }}, {{ "eta", {eta}, "s" }}, {{ "mass", 1.25, "kg" }}, {{ "unused", 3.5, "kg" }} }}
return rd.model {{ name = "small", gravity = {{ 0, 0, -p.g }}, links = {{
  {{ "arm", joint = {{ "theta" }}, beam = {{ length = 1, section = rd.round(0.01), E = 2e9, nu = 0.3, rho = 1000, eta = p.eta, rfe = 2 }} }},
  {{ "load", on = "arm.tip", joint = {{ "x" }}, mass = p.mass }} }} }}
"""


def small(folder, g, eta, *options):
    folder.mkdir()
    (folder / "small.lua").write_text(SMALL.format(g=g, eta=eta))
    return emit(folder / "out", folder / "small.lua", *options)


def test_no_gravity_no_damping(tmp_path):
    whole = small(tmp_path / "a", 9.75, 0.125)
    assert parameters(whole) >= {"g", "eta", "mass"} and "unused" not in parameters(whole)
    folded = small(tmp_path / "b", 9.75, 0.125, "--fold")
    weightless = small(tmp_path / "c", 0, 0.125, "--fold")
    undamped = small(tmp_path / "d", 0, 0, "--fold")
    sizes = [len(code(files)) for files in (folded, weightless, undamped)]
    assert sizes[0] > sizes[1] > sizes[2], sizes
    assert "power" in functions(weightless) and "power" not in functions(undamped), "no power without a force that has it"


def test_another_name(tmp_path):
    """The C equals that of a model with this name; the name is checked like a model's."""
    model = TESTS / "models" / "double_pendulum.lua"
    (tmp_path / "twin.lua").write_text(re.sub(r'name\s*=\s*"double_pendulum"', 'name = "twin"', model.read_text()))
    renamed, named = emit(tmp_path / "a", model, "--name", "twin"), emit(tmp_path / "b", tmp_path / "twin.lua")
    assert set(renamed) == {"twin.c", "twin.h"} and renamed == named
    for name, fact in {"my-arm": "not an identifier of C; use a letter, then letters, digits and _", "math": "math.h is a header of the system; choose another name"}.items():
        said = refdyn("gen", model, "--name", name, "-o", tmp_path / "c", status=2).stderr.splitlines()[0]
        assert said in (f'refdyn gen: --name: model "{name}": {fact}', f"refdyn gen: --name: model {name}: {fact}") and not (tmp_path / "c").exists(), said


def test_emit_narrows(tmp_path):
    files = emit(tmp_path, REFERENCE, "--emit", "M")
    assert functions(files) == {"M"}
    assert functions(emit(tmp_path / "two", REFERENCE, "--emit", "M,C")) == {"M", "C"}
    done = refdyn("gen", REFERENCE, "--emit", "M,mass", "-o", tmp_path / "none", status=None)
    assert done.returncode in (1, 2) and "mass" in done.stderr


def test_size_grows_as_it_should(tmp_path):
    """Linear in the number of elements for accelerations, at most quadratic for M."""
    def size(quantity, n_rfe):
        files = emit(tmp_path / f"{quantity}_{n_rfe}", REFERENCE, "--emit", quantity, "--set", f"n_rfe={n_rfe}")
        return sum(len(text) for name, text in files.items() if name.endswith(".c"))
    for quantity, increase in (("qdd_free", 1), ("M", (32**2 - 24**2) / (24**2 - 16**2))):
        sixteen, more, most = (size(quantity, n) for n in (16, 24, 32))
        assert most - more <= 1.1 * increase * (more - sixteen), (quantity, sixteen, more, most)


@pytest.mark.parametrize("n_rfe", [1, 2, 3, 8, 16, 32])
def test_every_number_of_elements(n_rfe):
    """Generates, compiles, evaluates; the O(n) accelerations are those of M, h and Q."""
    import numpy
    n = 4 + 3 * (n_rfe - 1)
    wave = [0.03 * numpy.sin(1.7 * i) for i in range(n)]
    found = evaluate(REFERENCE, {"q": wave, "qd": wave[::-1]}, "--set", f"n_rfe={n_rfe}")
    M, qdd, f = (numpy.array(found[name]) for name in ("M", "qdd_free", "h"))
    f = f + numpy.array(found["Q"])
    assert len(found["coordinates"]) == n
    assert abs(M @ qdd - f).max() <= 1e-10 * max((abs(M) * abs(qdd)).max(), abs(f).max())


def test_every_number_generates(tmp_path):
    for n_rfe in range(1, 33):
        refdyn("gen", REFERENCE, "--set", f"n_rfe={n_rfe}", "-o", tmp_path / str(n_rfe))


# A massless slide: accelerations exist only with its constraint.
MASSLESS = """local rd      = require "refdyn"
local held    = rd.option("held", true)
local p       = rd.parameters { { "L", 1, "m" } }
return rd.model {
  name = "massless",
  links = {
    { "rod", joint = { "psi" }, mass = 1, inertia = { zz = 0.1 } },
    { "slide", on = "rod", joint = { "x" }, start = { x = 1 } },
  },
  points      = { E = "slide" },
  forces      = function(s) return { rod_psi = s.q.rod_psi / p.L } end,
  constraints = function(s) return held and { rd.position { s.q.slide_x - p.L * rd.cos(s.q.rod_psi) } } or {} end,
}
"""


@pytest.mark.parametrize("options", [[], ["held=false"]], ids=" ".join)
def test_what_is_no_finite_number(options, tmp_path):
    """If a value cannot exist, the C contains NAN or INFINITY of math.h: it compiles, and the program names the coordinate."""
    options = [word for setting in options for word in ("--set", setting)] + ["--fold"]
    model = tmp_path / "massless.lua"
    model.write_text(MASSLESS)
    files = emit(tmp_path / "out", model, *options)
    assert re.search(r"\b(NAN|INFINITY)\b", files["massless.c"])
    for compiler in COMPILERS:
        subprocess.run([*compiler, *WARNINGS, "-O2", "-c", "massless.c", "-o", "massless.o"], cwd=tmp_path / "out", check=True)
    done = refdyn("eval", model, *options, status=3 if options[1:] else 0)
    if options[1:]:
        assert "slide_x" in done.stderr
    else:
        assert json.loads(done.stdout)["qdd_free"] is None


# Copied unchanged, each of them would end a literal or a comment of C, or change.
TEXTS = ['the "slide"', "x*/y /* z", "alpha\\beta \\", "what??/ ??= ?", "größe [µm]", "\\n %s", '*/"}; int broken = "']
TEXTS_MODEL = """local rd = require "refdyn"
local o = rd.option("o", "a */ // b")
local p = rd.parameters { PARAMETERS }
return rd.model { name = "texts", links = { { "c", joint = "x, y, z, phi, theta, psi", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } } },
  forces = function(s) return { c_x = READ + rd.input("F", 0, UNIT) } end,
  courses = function(s) return { COURSES } end,
  constraints = function(s) return { ROWS } end }
"""
TEXTS_MAIN = """#include <stdio.h>
#include "texts.h"
int main(void) {
    const struct refdyn_model *m = &texts_model;
    for (int i = 0; i < m->parameter_count; i++) puts(m->parameters[i].unit);
    for (int i = 0; i < m->input_count; i++) puts(m->inputs[i].unit);
    for (int i = 0; i < m->course_count; i++) puts(m->courses[i]);
    for (int i = 0; i < m->m; i++) puts(m->rows[i].name);
    return 0;
}
"""


def quoted(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def test_texts_of_the_author(tmp_path):
    """Units, names of rows and courses, and options: C reads them exactly as written, whatever they contain."""
    coordinates = "x y z phi theta psi".split()
    rows = TEXTS[:len(coordinates) - 1]
    model = TEXTS_MODEL.replace("READ", " + ".join(f"p.p{i}" for i in range(len(TEXTS)))).replace("UNIT", quoted(TEXTS[0]))
    model = model.replace("PARAMETERS", ", ".join(f'{{ "p{i}", 1, {quoted(text)} }}' for i, text in enumerate(TEXTS)))
    model = model.replace("COURSES", ", ".join(f"[{quoted(text)}] = s.t" for text in TEXTS))
    model = model.replace("ROWS", ", ".join(f"rd.position {{ s.q.c_{c}, name = {quoted(row)} }}" for c, row in zip(coordinates, rows)))
    (tmp_path / "texts.lua").write_text(model)
    emit(tmp_path / "out", tmp_path / "texts.lua")
    (tmp_path / "out" / "main.c").write_text(TEXTS_MAIN)
    for compiler in COMPILERS:
        for source in ("texts.c", "main.c"):
            subprocess.run([*compiler, *WARNINGS, "-c", source, "-o", source + ".o"], cwd=tmp_path / "out", check=True)
        subprocess.run([compiler[0], "texts.c.o", "main.c.o", "-lm", "-o", "main"], cwd=tmp_path / "out", check=True)
        done = subprocess.run([tmp_path / "out" / "main"], check=True, capture_output=True, text=True)
        assert done.stdout.splitlines() == [*TEXTS, TEXTS[0], *sorted(TEXTS, key=str.encode), *rows]
