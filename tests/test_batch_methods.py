"""Methods in lanes: the result of a case depends on no width, thread or neighbour, and equals the result of a single motion to within the
tolerance."""
import re

import h5py
import numpy as np
import pytest

from program import REFERENCE, TESTS, refdyn

SWEEP = """local rd = require "refdyn"
return rd.sweep { vary = { n_rfe = 2, m_E = { 1, 1.37, 1.71, 1.8, 2.23, 2.6, 2.91 }, eta = rd.log_uniform(1e-4, 2e-3), OPTIONS }, draws = 1, seed = 3,
  derive = function(c) return { arm_psi_d = c.m_E == 1.8 and 1e200 or 0 } end,
  t_end = 0.3, every = 0.017, keep = { final = true, history = { "E_x", "E_y", "E_z" } } }
"""
ROUNDING = 1e-12
METHODS = ["auto", "rk54", "rk8", "rodas5p", "rodas6p", "ros34pw2", "radau9", "gauss12"]
SCENES = {"rows": "", "free": 'program = "none"'}


def run(folder, output, *arguments):
    refdyn("batch", REFERENCE, "sweep.lua", "-o", output, *arguments, cwd=folder)
    with h5py.File(folder / output) as file:
        numbers = {}
        file.visititems(lambda name, item: numbers.update({name: item[...]}) if isinstance(item, h5py.Dataset) and name != "cpu_s" and item.dtype.kind in "fiu" else None)
    return numbers


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("method", METHODS)
def test_lanes_do_not_matter(method, scene, tmp_path):
    (tmp_path / "sweep.lua").write_text(SWEEP.replace("OPTIONS", SCENES[scene]))
    two, four, eight, one = (run(tmp_path, f"{lanes}.h5", "--method", method, "--lanes", lanes, "--threads", 1 + lanes % 3) for lanes in (2, 4, 8, 1))
    few = run(tmp_path, "few.h5", "--method", method, "--lanes", 4, "--cases", "3:6")
    for name, values in four.items():
        assert values.tobytes() == two[name].tobytes() == eight[name].tobytes(), name
        if values.shape and values.shape[0] == 7:
            assert values[3:6].tobytes() == few[name].tobytes(), name
    for axis in "xyz":
        alone, beside = one[f"history/E_{axis}"], four[f"history/E_{axis}"]
        assert np.array_equal(np.isnan(alone), np.isnan(beside)) and np.isnan(alone[3]).any()
        assert np.nanmax(abs(alone - beside)) < 1e-6
        same = (one["steps"] == four["steps"]) & ~np.isnan(alone).any(axis=1)
        assert same.any() and np.max(abs(alone - beside)[same]) < ROUNDING


@pytest.mark.parametrize("model, taken_alone", [(REFERENCE, 0.0), (TESTS / "models" / "bouncing.lua", 1.0)])
def test_steps_taken_one_by_one_are_counted(model, taken_alone, tmp_path):
    """All steps of a model with named events are."""
    name = "m_E" if taken_alone == 0 else "e"
    (tmp_path / "cases.csv").write_text(f"{name}\n" + "".join(f"{0.31 + 0.07 * i}\n" for i in range(5)))
    done = refdyn("batch", model, "--table", "cases.csv", "-o", "runs.csv", "--lanes", 4, "--method", "rk8", "--tol", "1e-4", "--until", 0.02, cwd=tmp_path)
    steps, alone = map(int, re.search(r"lanes +4; of (\d+) steps (\d+) were taken one by one", done.stderr).groups())
    assert steps > 5 and alone == taken_alone * steps
