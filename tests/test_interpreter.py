"""The emitted C against the interpreter of the plan, over several models; the program test_interpreter says what it compares."""
import subprocess

import pytest

from program import BUILD, LEAN, REFERENCE, TESTS

PENDULUM, RUNS, TREES = (TESTS / "models" / f"{name}.lua" for name in ("pendulum_flexible", "runs", "trees"))
SCENES = [
    (REFERENCE,), (REFERENCE, "fold", "loops=never"), (REFERENCE, "n_rfe=1"), (REFERENCE, "n_rfe=3", "form=printed"),
    (REFERENCE, "n_rfe=2", "program=chapter"), (REFERENCE, "program=none", "drive=input"), (REFERENCE, "dofs=psi", "eta=1.3e-3"),
    (PENDULUM,), (RUNS, "loops=always", "kind=segments", "rfe=3"), (RUNS, "loops=always", "kind=rods", "rfe=2"),
    (RUNS, "loops=always", "kind=closed", "rfe=5", "fold"), (RUNS, "loops=always", "kind=swinging", "rfe=3"),
    (TREES, "kind=two", "rfe=8"), (TREES, "kind=nested", "rfe=2"), (TREES, "kind=comb", "rfe=21"),
]


@pytest.mark.parametrize("scene", SCENES[1::3] if LEAN else SCENES, ids=lambda scene: " ".join([scene[0].stem, *scene[1:]]))
def test_emitted_is_interpreted(scene):
    done = subprocess.run([BUILD / "bin" / "test_interpreter", *scene], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
