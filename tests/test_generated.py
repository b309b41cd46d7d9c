"""generated/ is exactly what the generator writes now, byte for byte."""
import pytest

from program import REFERENCE, SOURCE, refdyn

MODELS = {"manipulator_rigid": 1, "manipulator_flexible": 4}


@pytest.mark.parametrize("name", MODELS)
def test_committed_files(name, tmp_path):
    refdyn("gen", REFERENCE, "--set", f"name={name}", "--set", f"n_rfe={MODELS[name]}", "-o", tmp_path)
    fresh = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    committed = {path.name: path.read_bytes() for path in (SOURCE / "generated").glob(f"{name}*.[ch]")}
    assert f"{name}.h" in fresh and f"{name}.c" in fresh
    assert sorted(fresh) == sorted(committed)
    different = [file for file in fresh if fresh[file] != committed[file]]
    assert not different, f"{different} differ from generated/; generated/README.md says how to write them anew"


def test_nothing_else_is_there():
    others = [path.name for path in (SOURCE / "generated").iterdir()
              if path.name not in ("README.md", "times.csv", "times.svg") and not path.name.startswith(tuple(MODELS))]
    assert not others
