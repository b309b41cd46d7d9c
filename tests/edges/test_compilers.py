"""Emitted C under flags that change arithmetic: results as without them, or a compile error with the reason."""
import collections
import math
import os
import re
import shutil
import subprocess

import pytest

from program import BUILD, LONG, REFERENCE, SCALE, SOURCE, TESTS, refdyn, some

MODELS = {
    "manipulator": [REFERENCE, "drive=input", "n_rfe=2"],
    "runs": [TESTS / "models" / "runs.lua", "kind=swinging", "rfe=3"],
    "functions": [TESTS / "models" / "functions.lua"],
}
if LONG:
    MODELS["manipulator_rigid"] = [REFERENCE, "n_rfe=1", "name=manipulator_rigid", "program=chapter"]
    MODELS["fourbar"] = [SOURCE / "models" / "fourbar.lua"]
REORDERED = ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]
# Under these flags the compilation fails with the reason.
REFUSED = [["-Ofast"], ["-ffast-math"], ["-O2", "-ffinite-math-only"]]
# These give the same results. The second ones are a part of the first ones.
TAKEN = [["-O1", "-funsafe-math-optimizations"], ["-O1", *REORDERED]] if LONG else [["-O1", "-funsafe-math-optimizations"]]
X87 = [["-O0", "-mfpmath=387"]]
# So do these, which are tried with fewer models, since they take longer to compile.
RELATIVES = [["-O2", "-ffp-contract=fast", "-march=native"], ["-O3", "-ffast-math", "-fno-finite-math-only", "-march=native"]]
X87_RELATIVES = [["-O2", "-mfpmath=387"]]
if LONG:
    RELATIVES += [["-Ofast", "-fno-finite-math-only"], ["-O3", "-march=native", *REORDERED], ["-O2", "-freciprocal-math", "-fno-math-errno"],
                  ["-Os", "-frounding-math"], ["-O2", "-fno-signed-zeros"]]
    X87_RELATIVES += [["-O1", "-mfpmath=387", "-funsafe-math-optimizations"], ["-O1", "-mfpmath=387", "-fexcess-precision=fast"]]
FEW = ("functions", "runs") if LONG else ("runs",)  # one without the pass over angles, one with it
BITS32 = [["-m32", "-O0"], ["-m32", "-O1", "-funsafe-math-optimizations"], ["-m32", "-O1", "-msse2", "-mfpmath=sse"]]
LANGUAGES = {"c11": ["-x", "c", "-std=c11"], "c++17": ["-x", "c++", "-std=c++17"]}
TOLERANCE = 1e-10  # of the largest entry: sums in another order; the largest is 5e-13, or 8e-12 with x87 arithmetic


def parse(text):
    values = collections.defaultdict(list)
    for line in text.splitlines():
        state, quantity, _, value = line.split()
        values[int(state), quantity].append(float(value))
    return values


@pytest.fixture(scope="module", params=MODELS, ids=str)
def model(request, tmp_path_factory):
    """Folder with the emitted C and the values, and the results of the interpreter for them."""
    folder = tmp_path_factory.mktemp(request.param)
    file, *settings = MODELS[request.param]
    done = subprocess.run([BUILD / "bin" / "interpreted", file, folder, *settings], capture_output=True, text=True, check=True)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", folder)
    return request.param, folder, parse(done.stdout)


def build(folder, name, compiler, language, flags):
    """Compiles the emitted C under `flags` and links it with the program that evaluates it; returns the compiler's message, or ''."""
    width = ["-m32"] if "-m32" in flags else []
    commands = [[compiler, "-std=c11", "-O1", *width, f"-DNAME={name}", "-I", folder, "-I", TESTS / "unit", "-c",
                 TESTS / "edges" / "evaluated.c", "-o", folder / "driver.o"]]
    sources = some(folder.glob(f"{name}*.c"))
    objects = [source.with_suffix(".o") for source in sources]
    commands += [[compiler, *LANGUAGES[language], *flags, "-c", source, "-o", target] for source, target in zip(sources, objects)]
    commands += [[compiler, *flags, folder / "driver.o", *objects, "-o", folder / "evaluated", "-lm"]]
    for command in commands:
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            return done.stderr
    return ""


def check_equal(model, compiler, language, flags):
    name, folder, expected = model
    complaint = build(folder, name, compiler, language, flags)
    assert not complaint, complaint[:2000]
    done = subprocess.run([folder / "evaluated", folder / "values"], capture_output=True, text=True, check=True)
    lines = differences(parse(done.stdout), expected)
    assert not lines, "\n".join(lines[:20])


NOT_A_NUMBER, OTHERS = 3, (4, 5)  # the state with an angle that is NaN, and the same with two other angles


def differs(found, expected, size):
    return math.isnan(found) or not abs(found - expected) <= TOLERANCE * SCALE * size


def differences(found, expected):
    """Entries are compared relative to the largest one of their quantity. NaN must stay NaN, except where the NaN angle cancels: sums in
    another order may omit it."""
    assert found.keys() == expected.keys(), "other quantities"
    sizes, lines = collections.Counter(), []
    for (_, quantity), values in expected.items():
        sizes[quantity] = max([sizes[quantity], *(abs(v) for v in values if not math.isnan(v))])
    for (state, quantity), values in expected.items():
        size = sizes[quantity]
        for i, (a, b) in enumerate(zip(found[state, quantity], values, strict=True)):
            if math.isnan(b) and not math.isnan(a) and state == NOT_A_NUMBER:
                is_wrong = any(differs(a, expected[other, quantity][i], size) for other in OTHERS)
            else:
                is_wrong = not math.isnan(b) and differs(a, b, size)
            if is_wrong:
                lines.append(f"{quantity}[{i}] at state {state}: {a!r} instead of {b!r}, largest entry {size:.2e}")
    return lines


ALL = [(compiler, language) for compiler in ("gcc", "clang") for language in LANGUAGES] if LONG else [("gcc", "c11"), ("clang", "c++17")]
# Flags with both compilers, or with one after the other.
PAIRS = [(compiler, flags) for i, flags in enumerate(RELATIVES) for j, compiler in enumerate(("gcc", "clang")) if LONG or (i + j) % 2 == 0]


@pytest.mark.parametrize("flags", TAKEN, ids=" ".join)
@pytest.mark.parametrize("compiler, language", ALL)
def test_equal(model, compiler, language, flags):
    check_equal(model, compiler, language, flags)


@pytest.mark.parametrize("flags", REFUSED, ids=" ".join)
@pytest.mark.parametrize("compiler, language", ALL)
def test_refused_with_a_sentence(model, compiler, language, flags):
    name, folder, _ = model
    complaint = build(folder, name, compiler, language, flags)
    assert f"{name}.c needs infinities and NaN: compile it without -ffinite-math-only" in complaint


@pytest.mark.parametrize("language", LANGUAGES)
def test_rounded_constants_are_refused(model, language):
    """A compiler that reads 0.1 as a float defines no macro for that; of the compilers here, gcc has the flag."""
    name, folder, _ = model
    complaint = build(folder, name, "gcc", language, ["-O1", "-fsingle-precision-constant"])
    assert f"{name}.c needs doubles of 64 bits: compile it without -fsingle-precision-constant" in complaint


@pytest.mark.parametrize("compiler, flags", PAIRS, ids=str)
def test_relatives_equal(model, compiler, flags):
    if model[0] not in FEW:
        pytest.skip("tried with fewer models")
    check_equal(model, compiler, "c11", flags)


@pytest.mark.parametrize("flags", X87 + X87_RELATIVES, ids=" ".join)
@pytest.mark.parametrize("language", LANGUAGES)
def test_x87(model, language, flags):
    """clang has no such unit in 64 bits."""
    if os.uname().machine != "x86_64":
        pytest.skip("left out: no x87 unit here")
    if flags not in X87 and (model[0] not in FEW or language != "c11"):
        pytest.skip("tried with fewer models")
    check_equal(model, "gcc", language, flags)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_without_a_barrier_of_the_compiler(model, compiler, tmp_path):
    """The path for compilers without a barrier; a mask keeps sums in their order."""
    name, folder, expected = model
    if name not in FEW:
        pytest.skip("tried with fewer models")
    plain = tmp_path / "plain"
    shutil.copytree(folder, plain)
    for source in plain.glob(f"{name}*.c"):
        text = source.read_text().replace("#ifdef __has_builtin", "#if 0").replace("__GNUC__ >= 12", "__GNUC__ >= 999")
        source.write_text(text)
    for flags in [["-O1", *REORDERED]] + [["-O3", "-march=native", *REORDERED]] * LONG:
        check_equal((name, plain, expected), compiler, "c11", flags)


def test_both_paths_are_there(model):
    text = "".join(source.read_text() for source in sorted(model[1].glob("*.c")))
    assert ("#ifdef __has_builtin" in text) == ("_sincos(q + " in text)
    assert model[0] != "runs" or "_sincos(q + " in text


@pytest.mark.parametrize("flags", REFUSED, ids=" ".join)
def test_a_part_alone_is_refused(flags, tmp_path):
    """Each file of a long emission is refused."""
    refdyn("gen", TESTS / "models" / "runs.lua", "--set", "kind=rods", "--set", "rfe=3", "--emit", "all,tangent,d_qdd", "-o", tmp_path)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", tmp_path)
    parts = sorted(tmp_path.glob("*_*.c"))
    assert parts
    for part in parts:
        done = subprocess.run(["gcc", *flags, "-fsyntax-only", part], capture_output=True, text=True)
        assert done.returncode != 0 and f"{part.name} needs infinities and NaN" in done.stderr


def test_no_switches_of_a_compiler(model):
    for source in some(model[1].glob("*.c")):
        assert not re.search(r"#pragma|__attribute__|__asm__", source.read_text())


@pytest.mark.parametrize("flags", BITS32, ids=" ".join)
@pytest.mark.parametrize("compiler, language", ALL)
def test_32_bits(model, compiler, language, flags, tmp_path):
    source = tmp_path / "empty.c"
    source.write_text("#include <math.h>\nint main(void) { return 0; }\n")
    command = [compiler, *LANGUAGES[language], "-m32", source, "-o", tmp_path / "empty", "-lm"]
    if subprocess.run(command, capture_output=True).returncode != 0:
        pytest.skip("left out: -m32 needs gcc-multilib, and g++-multilib for C++")
    check_equal(model, compiler, language, flags)
