"""Emitted C for motions side by side: each lane computes what the functions for one motion compute, regardless of the other lanes."""
import re
import shutil
import subprocess

import pytest

from program import LONG, REFERENCE, SOURCE, TESTS, all_models, models_of_tests, refdyn

WIDTHS = (1, 2, 4, 8)
WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()
COMPILERS = [["gcc", "-std=c11"], ["clang", "-std=c11"], ["g++", "-std=c++17", "-x", "c++"], ["clang++", "-std=c++17", "-x", "c++"]]
# The quantities that integrators call; compilers need long for vectors that the processor lacks, so large models have few quantities.
CALLED = ["--emit", "M,h,Q,energy,qdd_free,constrained"]
DERIVATIVES = ["--emit", "all,tangent,tangent_vectors,d_statics,inverse,d_inverse"]
RUNS, FUNCTIONS, SWITCHED = (TESTS / "models" / f"{name}.lua" for name in ("runs", "functions", "switched"))
RODS = (RUNS, ["--set", "kind=rods", "--set", "rfe=3", "--loops", "always", *CALLED])
FLEXIBLE = (REFERENCE, ["--set", "n_rfe=4", "--emit", "M,h,Q,energy,qdd_free,constrained,tangent,inverse"])
ALL = [(path, []) for path in all_models() + models_of_tests()]
TREE = (TESTS / "models" / "trees.lua", ["--set", "kind=joined", "--set", "rfe=1", "--accelerations", "recursive", *CALLED[:1], CALLED[1] + ",d_qdd"])
SOME = {"fourbar", "functions", "switched"}
SCENES = (ALL if LONG else [scene for scene in ALL if scene[0].stem in SOME]) + [RODS, FLEXIBLE, TREE]
SCENES += [(TESTS / "models" / "control" / "states.lua", [])] * LONG
FEW = [(FUNCTIONS, []), (SWITCHED, []), (REFERENCE, ["--set", "n_rfe=1", *DERIVATIVES])]
# Differently fused sums, or sines of libm, differ by rounding; solutions with them differ more.
ROUNDING, SOLVED = 1e-13, 1e-10
SOLUTIONS = re.compile("qdd|qdd_free|constrained|accelerations|force|d_qdd")


def name_of(value):
    return " ".join([value[0].stem, *(word for word in value[1] if word[0] != "-")]) if isinstance(value, tuple) else " ".join(value)


def emit(folder, scene, *options):
    """The model's name and the emitted files by name."""
    refdyn("gen", scene[0], *scene[1], *options, "-o", folder)
    files = {path.name: path.read_text() for path in sorted(folder.iterdir())}
    return next(name for name in files if name.endswith("_lanes.h"))[:-len("_lanes.h")], files


def compile_all(folder, scene, compiler, widths=WIDTHS):
    """Compiles all sources, and the source of lanes for each width; returns the symbols of the objects of lanes by width."""
    name, files = emit(folder, scene, "--for-lanes")
    include = ["-I", SOURCE, "-I", SOURCE / "runtime"]
    jobs = [(source, []) for source in files if source.endswith(".c") and not source.endswith("_lanes.c")]
    jobs += [(f"{name}_lanes.c", [f"-DLANES={width}", "-Wno-psabi"]) for width in widths]
    objects = [f"{i}.o" for i in range(len(jobs))]
    for (source, options), target in zip(jobs, objects):
        subprocess.run([*compiler, *options, *include, "-c", source, "-o", target], cwd=folder, check=True)
    only = [f"-DONLY={widths[0]}"] if len(widths) == 1 else []
    subprocess.run(["gcc", "-O1", *include, "-I", ".", f"-DMODEL={name}", *only, TESTS / "lanes" / "compare.c", *objects, "-lm", "-o", "compare"],
                   cwd=folder, check=True)
    return name, objects[-len(widths):]


def compared(folder, scene, compiler, widths=WIDTHS):
    """Quantity and width, error, entries with other bits, entries, and the number of influences of other lanes."""
    compile_all(folder, scene, compiler, widths)
    lines = subprocess.run([folder / "compare"], check=True, capture_output=True, text=True).stdout.splitlines()
    rows = []
    for line in lines:
        width, quantity, error, different, entries, reached = line.split()
        rows.append((f"{quantity}, {width} lanes", quantity, float(error), int(different), int(entries), int(reached)))
    assert {row[1] for row in rows} >= {"M", "h", "Q", "qdd_free", "energy"} and len(rows) % len(widths) == 0
    assert all(row[4] > 0 for row in rows)
    return rows


def check(rows, rounding=ROUNDING, solved=SOLVED):
    bound = {row[0]: solved if SOLUTIONS.fullmatch(row[1]) else rounding for row in rows}
    assert not [row for row in rows if not row[2] <= bound[row[0]]], "a lane differs from one motion"
    assert not [row for row in rows if row[5]], "a lane depends on another one"


@pytest.mark.parametrize("scene", SCENES, ids=name_of)
def test_lanes_are_motions(scene, tmp_path):
    check(compared(tmp_path, scene, ["gcc", "-O0", "-march=native", "-ffp-contract=off"]))


OPTIMISED = [["gcc", "-O3", "-march=native"], ["clang", "-O2", "-march=native", "-ffp-contract=fast"],
             ["gcc", "-O2", "-Ofast", "-fno-finite-math-only"], ["clang", "-O1"]]


@pytest.mark.parametrize("scene, compiler", [(scene, compiler) for i, scene in enumerate(FEW) for j, compiler in enumerate(OPTIMISED)
                                             if LONG or (i + j) % 2], ids=name_of)
def test_optimised_lanes_are_motions(scene, compiler, tmp_path):
    check(compared(tmp_path, scene, compiler, [4]), rounding=1e-11, solved=1e-9)


@pytest.mark.parametrize("compiler", [["gcc", "-O2", "-ffp-contract=off"], ["clang", "-O2", "-ffp-contract=off"]], ids=name_of)
def test_same_bits_without_fused_sums(compiler, tmp_path):
    """Where functions of one motion also compute their sines in the pass, and no sine is in a formula."""
    rows = compared(tmp_path, (REFERENCE, ["--set", "n_rfe=4", "--set", "program=none", *CALLED]), compiler, [4])
    assert not [row for row in rows if row[3] and row[1] in ("M", "h", "energy")]
    check(rows)


@pytest.mark.parametrize("compiler", COMPILERS, ids=name_of)
@pytest.mark.parametrize("scene", FEW, ids=name_of)
def test_compiles_without_warning(scene, compiler, tmp_path):
    name, _ = emit(tmp_path, scene, "--for-lanes")
    for width in (1, 4, 8) if LONG else (4,):
        done = subprocess.run([*compiler, *WARNINGS, f"-DLANES={width}", "-I", SOURCE, "-I", SOURCE / "runtime", "-O1", "-c", f"{name}_lanes.c", "-o", "out.o"],
                              cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0 and "warning" not in done.stderr, done.stderr[:2000]


@pytest.mark.parametrize("scene", FEW, ids=name_of)
def test_one_name_and_libm(scene, tmp_path):
    """The table is the only name outside; it needs the model's own files and libm."""
    widths = WIDTHS if LONG else (2,)
    name, objects = compile_all(tmp_path, scene, ["gcc", "-O1"], widths)
    for width, target in zip(widths, objects):
        symbols = [line.split() for line in subprocess.run(["nm", target], cwd=tmp_path, check=True, capture_output=True,
                                                           text=True).stdout.splitlines()]
        assert [words[-1] for words in symbols if words[-2].isupper() and words[-2] != "U"] == [f"{name}_lanes_{width}"]
        wanted = {words[-1] for words in symbols if words[-2] == "U"}
        libm = {"sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "pow", "fabs"}
        libc = {"memcpy", "memset", "__stack_chk_fail", "_GLOBAL_OFFSET_TABLE_"}
        assert {symbol for symbol in wanted if not re.fullmatch(rf"{name}_(model|spline_\d+)", symbol)} <= libm | libc


def test_width_is_asked_for(tmp_path):
    name, _ = emit(tmp_path, FEW[-1], "--for-lanes")
    for option in ([], ["-DLANES=3"]):
        done = subprocess.run(["gcc", *option, "-I", SOURCE, "-I", SOURCE / "runtime", "-c", f"{name}_lanes.c"], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode != 0 and "how many motions run side by side" in done.stderr


@pytest.mark.parametrize("scene", FEW, ids=name_of)
def test_equal_on_every_run_and_beside_the_same_files(scene, tmp_path):
    first, again = (emit(tmp_path / folder, scene, "--for-lanes")[1] for folder in "ab")
    assert first == again
    refdyn("gen", scene[0], *scene[1], "-o", tmp_path / "plain")
    plain = {path.name: path.read_text() for path in (tmp_path / "plain").iterdir()}
    assert plain == {name: text for name, text in first.items() if "_lanes." not in name}


def test_old_lanes_are_removed(tmp_path):
    """They would be compiled with functions for which they are not made; a file of the user remains."""
    scene = FEW[-1]
    name, files = emit(tmp_path, scene, "--for-lanes")
    refdyn("gen", scene[0], *scene[1], "-o", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.h", f"{name}.c"}
    (tmp_path / f"{name}_lanes.c").write_text("int mine;\n")
    refdyn("gen", scene[0], *scene[1], "-o", tmp_path)
    assert (tmp_path / f"{name}_lanes.c").read_text() == "int mine;\n"
    shutil.rmtree(tmp_path)
    long = (REFERENCE, ["--set", "n_rfe=16", "--loops", "never", "--emit", "all,tangent"])
    parts = [path for path in emit(tmp_path, long, "--for-lanes")[1] if re.search(r"_\d+\.c$", path)]
    assert parts
    emit(tmp_path, scene, "--for-lanes")
    assert {path.name for path in tmp_path.iterdir()} == set(files)
