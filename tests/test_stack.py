"""The header's bound of the stack holds for each function, and is not far above what compilers use. Single precision is for
microcontrollers: on x86-64, compilers keep four floats in a vector and need more."""
import shutil

import pytest

from program import LONG, MODELS, TESTS, all_models, models_of_tests
from single import ARM, CORES, DOUBLE_CORE
from stack import compare, emit

# Loops; frames that come closest to the bound; functions that call others; sweeps over a tree.
SCENES = [(TESTS / "models" / "hanging_chain.lua", []), (TESTS / "models" / "programme.lua", []), (MODELS / "slidercrank.lua", []),
          (TESTS / "models" / "trees.lua", ["--set", "rfe=9"])]
BRANCHED = (MODELS / "branched.lua", [])  # its d_force has the most values alive at once
COMPILERS = [("double", [compiler, level]) for compiler in ("gcc", "clang") for level in ("-O2", "-Os")]
COMPILERS += [("float", [*ARM, *CORES[core], level]) for core in CORES for level in ("-O2", "-Os")]
COMPILERS += [("double", [*ARM, *core, level]) for core in (CORES["m4"], DOUBLE_CORE) for level in ("-O2", "-Os")]
MICRO = [*ARM, *CORES["m4"], "-O2"]
LARGE, FURTHEST = 500, 3.5  # bytes of a function from which the bound may be at most so many times as large


def name_of(value):
    return f"{value[0]}-{value[1][0]}-{'-'.join(word.strip('-') for word in value[1][1:] if word[:4] in ('-mcp', '-mfp', '-O2', '-Os'))}"


def scenes_of(number):
    """The scenes of a compiler. In tests/long, two compilers take all models, and each of the others a third of them."""
    words = COMPILERS[number][1]
    if LONG:
        scenes = [(model, []) for model in all_models() + models_of_tests()]
        return scenes if words in (["gcc", "-O2"], MICRO) else scenes[number % 3::3]
    return SCENES if words == ["gcc", "-O2"] else SCENES[1:2] + [BRANCHED] * (words == MICRO)


@pytest.mark.parametrize("number", range(len(COMPILERS)), ids=[name_of(value) for value in COMPILERS])
def test_the_bound_holds(number, tmp_path):
    real, words = COMPILERS[number]
    if not shutil.which(words[0]):
        pytest.skip(f"{words[0]} is not installed")
    lines = []
    for model, options in scenes_of(number):
        folder = tmp_path / model.stem
        emit(model, folder, real, *options)
        found = compare(folder, words)
        assert any(used for _, _, used in found)
        allowed = 1.1 if words[0] == "clang" else 1  # it turns more loops over few entries into vectors
        lines += [f"{name}: {used} bytes, and the header has at most {bound}" for name, bound, used in found if used > allowed * bound]
        lines += [f"{name}: the header has {bound} bytes, which is far above {used}" for name, bound, used in found
                  if used > LARGE and bound > FURTHEST * used]
    assert not lines, "\n" + "\n".join(lines)
