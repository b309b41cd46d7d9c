"""Emitted C under flags that change arithmetic: results as without them, or a compile error that says why."""
import collections
import itertools
import math
import os
import pathlib
import re
import shutil
import subprocess

import pytest

from program import BUILD, REFERENCE, SOURCE, TESTS, refdyn

MODELS = {
    "manipulator": [REFERENCE, "drive=input"],
    "manipulator_rigid": [REFERENCE, "n_rfe=1", "name=manipulator_rigid", "program=chapter"],
    "runs": [TESTS / "models" / "runs.lua", "kind=rods", "rfe=3"],
    "functions": [TESTS / "models" / "functions.lua"],
    "fourbar": [SOURCE / "models" / "fourbar.lua"],
}
REORDERED = ["-fassociative-math", "-fno-signed-zeros", "-fno-trapping-math"]
# What is wrong under these is told while compiling.
REFUSED = [["-Ofast"], ["-ffast-math"], ["-O2", "-ffinite-math-only"], ["-O3", "-march=native", "-ffast-math"]]
# These give the same results.
TAKEN = [["-O2", "-funsafe-math-optimizations"], ["-O3", "-march=native", *REORDERED], ["-O1", *REORDERED],
         ["-Ofast", "-fno-finite-math-only"], ["-O3", "-ffast-math", "-fno-finite-math-only", "-march=native"],
         ["-O2", "-freciprocal-math"], ["-O2", "-fno-signed-zeros"], ["-O2", "-ffp-contract=fast", "-march=native"],
         ["-O2", "-frounding-math"], ["-Os", "-fno-math-errno"], ["-O0"]]
X87 = [["-O2", "-mfpmath=387"], ["-O0", "-mfpmath=387"], ["-O3", "-mfpmath=387", "-funsafe-math-optimizations"]]
BITS32 = [["-m32", "-O2"], ["-m32", "-O0"], ["-m32", "-O2", "-msse2", "-mfpmath=sse"], ["-m32", "-O3", "-funsafe-math-optimizations"]]
LANGUAGES = {"c11": ["-x", "c", "-std=c11"], "c++17": ["-x", "c++", "-std=c++17"]}
TOLERANCE = 1e-9  # of the largest entry; the sums of a stiff beam lose up to five digits when they are reordered


def parse(text):
    values = collections.defaultdict(list)
    for line in text.splitlines():
        state, quantity, _, value = line.split()
        values[int(state), quantity].append(float(value))
    return values


@pytest.fixture(scope="module", params=MODELS, ids=str)
def model(request, tmp_path_factory):
    """Folder with the emitted C and the values, and what the interpreter makes of them."""
    folder = tmp_path_factory.mktemp(request.param)
    file, *settings = MODELS[request.param]
    done = subprocess.run([BUILD / "bin" / "interpreted", file, folder, *settings], capture_output=True, text=True, check=True)
    shutil.copy(SOURCE / "runtime" / "refdyn_model.h", folder)
    return request.param, folder, parse(done.stdout)


def build(folder, name, compiler, language, flags):
    """Compiles the emitted C under `flags` and links it with the program that evaluates it; what the compiler says, or ''."""
    width = ["-m32"] if "-m32" in flags else []
    commands = [[compiler, "-std=c11", "-O1", *width, f"-DNAME={name}", "-I", folder, "-I", TESTS / "unit", "-c",
                 TESTS / "edges" / "evaluated.c", "-o", folder / "driver.o"]]
    sources = sorted(folder.glob(f"{name}*.c"))
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
    assert not lines, "\n".join(lines)


def differences(found, expected):
    assert found.keys() == expected.keys(), "other quantities"
    lines = []
    for key, values in expected.items():
        assert len(found[key]) == len(values), key
        if [math.isnan(v) for v in found[key]] != [math.isnan(v) for v in values]:
            lines.append(f"{key}: NaN in other entries")
            continue
        size = max((abs(v) for v in values if not math.isnan(v)), default=0)
        worst = max((abs(a - b) for a, b in zip(found[key], values) if not math.isnan(b)), default=0)
        if not worst <= TOLERANCE * size:
            lines.append(f"{key}: differs by {worst:.2e}, largest entry {size:.2e}")
    return lines


ALL = [(compiler, language) for compiler in ("gcc", "clang") for language in LANGUAGES]


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


@pytest.mark.parametrize("flags", X87, ids=" ".join)
@pytest.mark.parametrize("language", LANGUAGES)
def test_x87(model, language, flags):
    """clang has no such unit in 64 bits."""
    if "x86_64" not in os.uname().machine:
        pytest.skip("left out: no x87 unit here")
    check_equal(model, "gcc", language, flags)


@pytest.mark.parametrize("flags", BITS32, ids=" ".join)
@pytest.mark.parametrize("compiler, language", ALL)
def test_32_bits(model, compiler, language, flags, tmp_path):
    source = tmp_path / "empty.c"
    source.write_text("#include <math.h>\nint main(void) { return 0; }\n")
    if subprocess.run([compiler, "-m32", source, "-o", tmp_path / "empty", "-lm"], capture_output=True).returncode != 0:
        pytest.skip("left out: -m32 needs gcc-multilib")
    check_equal(model, compiler, language, flags)
