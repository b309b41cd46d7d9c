"""The header's bound of the stack holds for each function at both levels of optimisation, and is not far above the larger of the
two uses. Single precision is for microcontrollers: on x86-64, compilers keep four floats in a vector and need more."""
import shutil

import pytest

from program import LONG, MODELS, TESTS, all_models, models_of_tests
from stack import LEVELS, TARGETS, compare, emit

# Loops; frames that come closest to the bound; functions that call others; sweeps over a tree.
SCENES = [(TESTS / "models" / "hanging_chain.lua", []), (TESTS / "models" / "programme.lua", []), (MODELS / "slidercrank.lua", []),
          (TESTS / "models" / "trees.lua", ["--set", "rfe=9"])]
BRANCHED = (MODELS / "branched.lua", [])  # its d_force has the most values alive at once
LOADED_BEAMS = (TESTS / "models" / "loaded_beams.lua", [])  # its tangent comes closest to the bound
# In tests/long, these take all models; each other target takes a third, and the two models above.
WIDEST = ["gcc, x86-64", "floats, Cortex-M4"]
LARGE, FURTHEST = 500, 3.5  # bytes of a function from which the bound may be at most so many times as large


def scenes_of(target):
    if LONG:
        scenes = [(model, []) for model in all_models() + models_of_tests()]
        part = list(TARGETS).index(target) % 3
        return [scene for i, scene in enumerate(scenes) if target in WIDEST or i % 3 == part or scene in (BRANCHED, LOADED_BEAMS)]
    return SCENES if target == WIDEST[0] else SCENES[1:2] + [BRANCHED] * (target == WIDEST[1])


@pytest.mark.parametrize("target", TARGETS)
def test_the_bound_holds(target, tmp_path):
    real, words = TARGETS[target]
    if not shutil.which(words[0]):
        pytest.skip(f"{words[0]} is not installed")
    lines = []
    for model, options in scenes_of(target):
        folder = tmp_path / model.stem
        emit(model, folder, real, *options)
        found = compare(folder, words)
        assert any(all(used) for _, _, used in found)
        allowed = 1.1 if words[0] == "clang" else 1  # it turns more loops over few entries into vectors
        lines += [f"{name}, {level}: {size} bytes, and the header has at most {bound}"
                  for name, bound, used in found for level, size in zip(LEVELS, used) if size > allowed * bound]
        lines += [f"{name}: the header has {bound} bytes, which is far above {used}" for name, bound, used in found
                  if max(used) > LARGE and bound > FURTHEST * max(used)]
    assert not lines, "\n" + "\n".join(lines)
