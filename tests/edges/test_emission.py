"""The information that a header contains for callers, and quantities that every model has, or has in parts."""
import ctypes
import re
import shutil
import subprocess

import numpy
import pytest

from program import MODELS, REFERENCE, SOURCE, TESTS, all_models, refdyn

STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]
PENDULUM = MODELS / "pendulum.lua"  # without rows
DERIVATIVES = ("d_qdd", "d_qdd_free", "d_force", "d_inverse", "d_statics", "d_rows")
BLOCKS = ("q", "qd", "t", "x", "p", "qdd")


def emit(folder, model, *arguments):
    """Name of the model, and the text of its header."""
    done = refdyn("gen", model, "-o", folder, *arguments)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", folder)
    name = re.match(r"\w+", done.stdout).group()
    return name, (folder / f"{name}.h").read_text()


def compile_and_run(folder, name, text, language=("-x", "c", "-std=c11")):
    (folder / "caller.c").write_text(text)
    subprocess.run(["gcc", *language, *STRICT, "caller.c", *sorted(path.name for path in folder.glob(f"{name}*.c")), "-o", "caller", "-lm"],
                   cwd=folder, check=True)
    return subprocess.run([folder / "caller"], capture_output=True, text=True, check=True).stdout


# ---- constants ----

TABLES = {"COORDINATE": ("coordinates[%s].name", "n"), "PARAMETER": ("parameters[%s].name", "parameter_count"),
          "INPUT": ("inputs[%s].name", "input_count"), "POINT": ("points[%s]", "point_count"), "ROW": ("rows[%s].name", "m"),
          "COURSE": ("courses[%s]", "course_count")}


def places(header, name):
    """Names of all constants of places; the preprocessor expands those of long runs."""
    done = subprocess.run(["gcc", "-E", "-P", "-"], input=header.replace('#include "refdyn_model.h"', ""), capture_output=True, text=True,
                          check=True)
    return re.findall(rf"\b{name}_({'|'.join(TABLES)})_(\w+) = ", done.stdout)


def check_constants(folder, model, *arguments):
    """Each constant refers to the entry of its name, and each entry has one."""
    name, header = emit(folder, model, *arguments)
    found = places(header, name)
    table = f"{name}_model"
    lines = [f'printf("%s %s\\n", "{kind} {entry}", {table}.{TABLES[kind][0] % f"{name}_{kind}_{entry}"});' for kind, entry in found]
    sizes = ["n", "m", "parameter_count", "derived_count", "input_count", "point_count", "course_count"]
    lines += [f'if ({name}_{size} != {table}.{size}) return 1;' for size in sizes]
    counts = [f'if ({name}_{TABLES[kind][1]} != {sum(k == kind for k, _ in found)}) return 2;' for kind in TABLES]
    struct = [f"if ({name}_parameter_bytes != (int)sizeof(struct {name}_parameters)) return 3;"] if "_defaults(" in header else []
    text = f'#include "{name}.h"\n#include <stdio.h>\nint main(void) {{\n' + "\n".join(lines + counts + struct) + "\nreturn 0;\n}\n"
    for line in compile_and_run(folder, name, text).splitlines():
        _, constant, entry = line.split(" ", 2)
        plain = re.sub(rb"\W", b"_", entry.encode()).decode()
        assert constant == plain or re.fullmatch(re.escape(plain) + r"_\d+", constant), line
    return found


@pytest.mark.parametrize("model", all_models(), ids=lambda path: path.stem)
def test_constants_of_every_model(model, tmp_path):
    assert check_constants(tmp_path, model)


@pytest.mark.parametrize("rfe", [2, 3, 9, 40])
def test_constants_of_long_beams(rfe, tmp_path):
    """Each element has its own constant, whether constants are listed or made by one line for all of them."""
    found = check_constants(tmp_path, REFERENCE, "--set", f"n_rfe={rfe}", "--set", "drive=input")
    assert ("COORDINATE", f"arm_phi_{rfe - 1}") in found and ("INPUT", "tau") in found and ("POINT", "E") in found
    assert sum(kind == "COORDINATE" for kind, _ in found) == 4 + 3 * (rfe - 1)


def test_constants_of_any_name(tmp_path):
    """Names of rows and courses are any text; constants stay different."""
    (tmp_path / "odd.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "odd", gravity = { 0, 0, -9.81 }, links = {
  { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } }, { "b", on = "a", joint = { "y", "z" }, mass = 1 } },
  points = { terms = "b", row = "a" },
  courses = function(s) return { ["a b"] = s.t, ["a-b"] = 2 * s.t, ["länge"] = s.t, ["1"] = s.t } end,
  constraints = function(s) return { rd.position { s.q.a_x, name = "x & y" }, rd.position { s.q.b_y, name = "x | y" },
    rd.velocity { s.qd.b_z, name = "x___y_2" } } end }
""")
    found = check_constants(tmp_path, tmp_path / "odd.lua")
    assert [entry for kind, entry in found if kind == "ROW"] == ["x___y", "x___y_2", "x___y_2_2"]
    name, header = emit(tmp_path, tmp_path / "odd.lua")
    compile_and_run(tmp_path, name, f'#include "{name}.h"\nint main(void) {{ return 0; }}\n', ("-x", "c++", "-std=c++17"))


@pytest.mark.parametrize("language", [("-x", "c", "-std=c11"), ("-x", "c++", "-std=c++17")], ids=" ".join)
def test_files_compile_as_one(language, tmp_path):
    """Parts of a long emission and other models, joined as in a unity build; no macro is visible in another file."""
    runs = TESTS / "models" / "runs.lua"
    names = [emit(tmp_path, runs, "--set", "kind=rods", "--set", "rfe=3", "--emit", "all,tangent,d_qdd")[0],
             emit(tmp_path, PENDULUM, "--emit", "qdd")[0], emit(tmp_path, REFERENCE, "--set", "n_rfe=5", "--emit", "qdd")[0]]
    files = [path.name for name in names for path in sorted(tmp_path.glob(f"{name}*.c"))]
    assert len(files) > len(names)
    text = "".join(f'#include "{file}"\n' for file in files)
    macros = "".join(f"#ifdef {macro}\n#error {macro}\n#endif\n" for macro in ("SET", "HAS_BUILTIN", "ELEMENT_1"))
    done = subprocess.run(["gcc", *language, *STRICT, "-fsyntax-only", "-I", tmp_path, "-"], input=text + macros, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


# ---- qdd with rows and without ----

def load(folder, name):
    library = folder / f"{name}.so"
    subprocess.run(["gcc", "-std=c11", "-O1", "-ffp-contract=off", "-fPIC", "-shared", *sorted(folder.glob(f"{name}*.c")), "-o", library,
                    "-lm"], check=True)
    return ctypes.CDLL(str(library))


def call(library, name, quantity, n, count, parameters, inputs=0):
    rng = numpy.random.default_rng(8)
    q, qd, out = rng.uniform(-0.7, 0.7, n), rng.uniform(-1, 1, n), numpy.full(count, numpy.nan)
    given = [rng.uniform(-1, 1, n)] if quantity == "d_inverse" else []
    p, x = numpy.zeros(parameters + 1), rng.uniform(-1, 1, inputs + 1)
    pointer = lambda array: array.ctypes.data_as(ctypes.c_void_p)
    if parameters:
        getattr(library, f"{name}_defaults")(pointer(p))
    getattr(library, f"{name}_{quantity}")(pointer(p), pointer(x), ctypes.c_double(0.3), *map(pointer, [q, qd, *given, out]))
    return out


def constant(header, name, what):
    return int(re.search(rf"{name}_{what} = (\d+)", header).group(1))


@pytest.mark.parametrize("arguments", [["--emit", "qdd"], ["--emit", "qdd", "--fold"], ["--emit", "qdd,qdd_free"], []], ids=" ".join)
def test_qdd_without_rows(arguments, tmp_path):
    name, header = emit(tmp_path, PENDULUM, *arguments)
    n, doubles = constant(header, name, "n"), constant(header, name, "parameter_bytes") // 8
    library = load(tmp_path, name)
    qdd = call(library, name, "qdd", n, n, doubles)
    assert numpy.all(numpy.isfinite(qdd)) and numpy.array_equal(qdd, call(library, name, "qdd_free", n, n, doubles))


@pytest.mark.parametrize("model", all_models(), ids=lambda path: path.stem)
def test_qdd_of_every_model(model, tmp_path):
    name, header = emit(tmp_path, model, "--emit", "qdd")
    assert re.search(rf"^void {name}_qdd\(", header, re.M) and re.search(r"SET\(qdd\) \w+_qdd_doubles", (tmp_path / f"{name}.c").read_text())


@pytest.mark.parametrize("emit_list, reason", [
    ("u", "u: no constraints"), ("force,k", "k force: no constraints"), ("d_force", "d_force: no constraints in the corrected form"),
    ("course", "course: no courses"), ("row_terms", "row_terms: no constraints"), ("d_qdd.x", "d_qdd: no variables of that kind"),
    ("d_statics.qd", "d_statics: no variables of that kind"), ("constrained,d_rows,course", "d_rows constrained: no constraints; course: no courses")])
def test_nothing_to_emit(emit_list, reason, tmp_path):
    done = refdyn("gen", PENDULUM, "--emit", emit_list, "-o", tmp_path / "out", status=1)
    assert done.stderr.splitlines() == [f"{PENDULUM}:10: --emit {emit_list}: nothing to emit for this model; {reason}"]
    assert not (tmp_path / "out").exists() and done.stdout == ""


def test_what_is_left_out_is_said(tmp_path):
    done = refdyn("gen", PENDULUM, "--emit", "qdd,u,force", "-o", tmp_path)
    assert "left out: u force: no constraints\n" in done.stdout


# ---- derivatives by parts ----

def parts_of(header, name, quantity):
    """Names and sizes of the parts of a result."""
    struct = re.search(rf"struct {name}_{quantity}_result {{\n(.*?)}};", header, re.S).group(1)
    return [(part, int(size)) for part, size in re.findall(r"double (\w+)\[(\d+)\]", struct)]


# One way of solving M x = f for the whole and for a part alone, which would take the cheaper one.
WHOLE = [REFERENCE, "--set", "n_rfe=2", "--set", "drive=input", "--accelerations", "recursive"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    name, header = emit(folder, *WHOLE, "--emit", ",".join(DERIVATIVES))
    return name, header, load(folder, name)


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("quantity", DERIVATIVES)
def test_a_part_is_that_of_the_whole(whole, quantity, block, tmp_path):
    name, header, library = whole
    wanted = parts_of(header, name, quantity)
    n, doubles = constant(header, name, "n"), constant(header, name, "parameter_bytes") // 8
    all_values, at, expected = call(library, name, quantity, n, sum(size for _, size in wanted), doubles, 1), 0, []
    for part, size in wanted:
        if part.split("_")[-1] == block:
            expected.append(all_values[at:at + size])
        at += size
    emission = [*WHOLE, "--emit", f"{quantity}.{block}"]
    if not expected:
        refdyn("gen", *emission, "-o", tmp_path, status=2 if block == "qdd" else 1)  # only inverse dynamics reads qdd
        return
    _, own_header = emit(tmp_path, *emission)
    if block == "p":  # the parameters that this emission reads have a column each
        order, own = ([entry for kind, entry in places(text, name) if kind == "PARAMETER"] for text in (header, own_header))
        columns = [order.index(entry) for entry in own]
        values = [part.reshape(-1, len(order))[:, columns].ravel() for part in expected]
    else:
        values = [part for part in expected]
    values = numpy.concatenate(values)
    found = call(load(tmp_path, name), name, quantity, n, len(values), constant(own_header, name, "parameter_bytes") // 8, 1)
    assert numpy.max(abs(found - values)) <= 1e-12 * max(1, numpy.max(abs(values)))


def test_a_part_costs_less(tmp_path):
    counts = {}
    for asked in ("d_qdd", "d_qdd.q", "d_qdd.x"):
        out = refdyn("gen", REFERENCE, "--set", "drive=input", "--emit", asked, "-o", tmp_path / asked).stdout
        counts[asked] = sum(map(int, re.search(r"^d_qdd +(\d+) +(\d+)", out, re.M).groups()))
    assert counts["d_qdd.q"] < 0.6 * counts["d_qdd"] and counts["d_qdd.x"] < 0.15 * counts["d_qdd"]


@pytest.mark.parametrize("word", ["d_qdd.z", "d_qdd.", ".q", "tangent.K", "qdd.q", "d_qdd.q.x", "d_qdd_free.Q", "d_rows.phi", "d_qdd.qdd", "step.q"])
def test_no_such_part(word, tmp_path):
    done = refdyn("gen", REFERENCE, "--emit", word, "-o", tmp_path / "out", status=2)
    assert done.stderr.splitlines()[0] == (
        f"refdyn gen: --emit: '{word}' is not a part of a quantity; d_qdd d_qdd_free d_force d_inverse d_statics d_rows d_points d_course have .q .qd .t .x .p, "
        "d_inverse also .qdd, and step .p")
