"""The programs of "Reading results" in docs/batches.md run on a file of runs, and print and draw its numbers."""
import os
import re
import subprocess
import sys

import h5py
import numpy as np
import pytest

from program import SOURCE
from test_runs_figure import grid, smooth

PAGE = (SOURCE / "docs" / "batches.md").read_text().partition("## Reading results")[2]
PROGRAMS = re.findall(r"^```python\n(.*?)^```", PAGE, re.M | re.S)


def run(program, folder):
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", program], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, "MPLBACKEND": "Agg", "MPLCONFIGDIR": str(folder)})
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def values(tmp_path):
    return smooth(tmp_path / "runs.h5", *grid(6))[0]


def test_there_are_programs():
    assert len(PROGRAMS) == 2 and all(len(program.splitlines()) <= 6 for program in PROGRAMS)


def test_percentiles_are_drawn(tmp_path, values):
    names = "\nlines = plt.gca().get_lines()\nprint([[repr(float(y)) for y in line.get_ydata()] for line in lines])"
    drawn = np.array(eval(run(PROGRAMS[0] + names, tmp_path)), dtype=float)
    kept = values[np.isfinite(values[:, 0])]
    assert np.allclose(drawn, np.percentile(kept, [5, 25, 50, 75, 95], axis=0), rtol=1e-14, atol=1e-14)
    assert (tmp_path / "place.png").read_bytes().startswith(b"\x89PNG")


def test_results_stand_beside_what_varied(tmp_path, values):
    text = run(PROGRAMS[1], tmp_path)
    with h5py.File(tmp_path / "runs.h5") as file:
        final = file["final/E_x"][()]
        assert "m_E" in text and "program" in text
        assert len(text.splitlines()) == 5 and f"{np.nanmax(final):.6f}" in text
