"""`refdyn plot RUNS.h5`: maps and curves over what varied, percentiles over time, the worst cases."""
import re
import subprocess
import xml.etree.ElementTree as xml

import h5py
import numpy as np
import pytest

from program import BUILD, refdyn

SVG = "{http://www.w3.org/2000/svg}"
TIMES = np.array([0, 0.1, 0.25, 0.5, 1])


def smooth(path, x, y, programs=None):
    """A file of runs with these start values, a motion that depends on them, and failures at every seventh case."""
    count = len(x)
    subprocess.run([BUILD / "bin" / "make_runs", path, str(count), "0", "1", str(count)], check=True)
    with h5py.File(path, "r+") as file:
        failed = file["status"][()] != 0
        values = np.sin(x)[:, None] * np.cos(6 * TIMES) + y[:, None] * 3 * TIMES
        values[failed] = np.nan
        extremes = np.array([[v.min(), TIMES[v.argmin()], v.max(), TIMES[v.argmax()]] for v in values])
        extremes[failed] = np.nan
        file["cases/m_E"][:], file["cases/arm_psi_d"][:] = x, y
        file["cases/program"][:] = programs or "none"
        file["history/E_x"][:], file["history/energy"][:] = values, values**2
        file["extremes/E_x"][:], file["final/E_x"][:] = extremes, values[:, -1]
    return values, extremes


def draw(path, *arguments):
    svg = path.with_suffix(".svg")
    refdyn("plot", path, *arguments, "-o", svg)
    root = xml.parse(svg).getroot()
    return root, [text.text for text in root.iter(SVG + "text")]


def fills(root):
    return [path.get("fill") for path in root.iter(SVG + "path") if path.get("shape-rendering")]


def grid(n):
    x, y = np.meshgrid(np.linspace(1, 4, n), np.linspace(0, 0.5, n))
    return x.ravel(), y.ravel()


def test_maps_over_two_quantities(tmp_path):
    _, extremes = smooth(tmp_path / "runs.h5", *grid(9))
    root, texts = draw(tmp_path / "runs.h5")
    assert {"largest E_x [m] (grey: no value)", "m_E [kg]", "arm_psi_d [rad/s]", "E_x over time, percentiles of the cases"} <= set(texts)
    colours = fills(root)
    largest = extremes[:, 2]
    assert len(colours) == 81 and colours.count("#d4d4d4") == np.isnan(largest).sum()
    assert f"{np.nanmax(largest):.4g}" in texts and f"{np.nanmin(largest):.4g}" in texts
    light = [sum(int(colour[k:k + 2], 16) for k in (1, 3, 5)) for colour in colours]
    assert np.nanargmin(largest) == np.argmin(light)


def test_curve_over_one_quantity(tmp_path):
    x = np.random.default_rng(1).permutation(np.linspace(1, 4, 50))
    values, _ = smooth(tmp_path / "runs.h5", x, np.full(50, 0.2))
    root, texts = draw(tmp_path / "runs.h5", "--panel", "final/E_x")
    assert texts.count("final E_x [m]") == 2 and "m_E [kg]" in texts and not fills(root)
    curve = [path.get("d") for path in root.iter(SVG + "path") if path.get("stroke-linecap")]
    steps = re.findall(r"l(-?[\d.]+) ", curve[0])
    assert len(curve) == 1 and all(float(step) >= 0 for step in steps)
    assert len(steps) == np.isfinite(values[:, -1]).sum() - 1


def test_options_whose_texts_are_numbers_are_an_axis(tmp_path):
    smooth(tmp_path / "runs.h5", np.full(20, 2.0), np.full(20, 0.2), [str(1 + k) for k in range(20)])
    _, texts = draw(tmp_path / "runs.h5", "--panel", "final/E_x")
    assert "program" in texts and "10" in texts and "20" in texts
    smooth(tmp_path / "names.h5", np.full(20, 2.0), np.full(20, 0.2), ["a<b", "c&d"] * 10)
    _, texts = draw(tmp_path / "names.h5", "--panel", "final/E_x")
    assert "program: 0 a<b, 1 c&d" in texts


def test_bands_are_percentiles(tmp_path):
    values, _ = smooth(tmp_path / "runs.h5", *grid(9))
    root, texts = draw(tmp_path / "runs.h5", "--panel", "history/E_x")
    assert {"5 to 95 %", "25 to 75 %", "median", "t [s]", "E_x [m]"} <= set(texts)
    points = [[[float(number) for number in pair.split()] for pair in re.split("[ML]", path.get("d")[:-1])[1:]]
              for path in root.iter(SVG + "path") if path.get("fill", "none") != "none" and path.get("d").endswith("z")]
    found = np.array(points)[:, :, 1]
    kept = values[np.isfinite(values[:, 0])]
    expected = np.array([np.concatenate([np.percentile(kept, low, axis=0), np.percentile(kept, 100 - low, axis=0)[::-1]]) for low in (5, 25)])
    scale, offset = np.polyfit(expected.ravel(), found.ravel(), 1)
    assert scale < 0 and np.abs(scale * expected + offset - found).max() < 0.1


def test_the_worst_cases_are_told(tmp_path):
    _, extremes = smooth(tmp_path / "runs.h5", *grid(9))
    _, texts = draw(tmp_path / "runs.h5")
    largest = np.nan_to_num(np.abs(extremes[:, [0, 2]])).max(axis=1)
    case = np.argmax(largest)
    assert texts[0].endswith("runs.h5: 81 cases, 18 failed")
    assert texts[1:3] == ["12 failed: case ...: Schrittweite zu klein, ∂φ/∂q „singulär“ 𝜑", "6 failed: no reason recorded"]
    assert texts[3].startswith(f"largest |E_x|: {largest[case]:.4g} m at t = 1 s in case {case} (m_E = ")


@pytest.mark.parametrize("arguments, status, fact", [
    (["--panel", "history/q"], 1, "runs.h5: --panel: 'history/q' is not in the file; name a kept value as in history/E_x\n"),
    (["--units", "runs.h5"], 2, "refdyn plot: --units: a file of runs has its own units; omit it\n"),
    (["more.h5"], 2, "refdyn plot: runs.h5: a file of runs must be the only operand\n"),
])
def test_what_cannot_be_drawn_is_told(tmp_path, arguments, status, fact):
    smooth(tmp_path / "runs.h5", *grid(3))
    done = refdyn("plot", "runs.h5", *arguments, "-o", "out.svg", status=status, cwd=tmp_path)
    assert done.stderr.startswith(fact) and not list(tmp_path.glob("out*"))


def test_files_without_numbers_are_told(tmp_path):
    """All cases failed, or there is no case."""
    smooth(tmp_path / "runs.h5", *grid(3))
    with h5py.File(tmp_path / "runs.h5", "r+") as file:
        for name in ("extremes/E_x", "history/E_x", "history/energy"):
            file[name][...] = np.nan
    fact = f"{tmp_path}/runs.h5: no case has a number to draw\n"
    assert refdyn("plot", tmp_path / "runs.h5", "-o", tmp_path / "out.svg", status=1).stderr == fact
    subprocess.run([BUILD / "bin" / "make_runs", tmp_path / "runs.h5", "50", "0", "1", "0"], check=True)
    assert refdyn("plot", tmp_path / "runs.h5", "-o", tmp_path / "out.svg", status=1).stderr == fact
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize("count", [1, 2, 50, 5000])
def test_numbers_of_any_size_are_drawn(tmp_path, count):
    subprocess.run([BUILD / "bin" / "make_runs", tmp_path / "any.h5", "5000", "0", "1", str(count)], check=True)
    draw(tmp_path / "any.h5")
    assert not re.search(r"\b(nan|inf)", (tmp_path / "any.svg").read_text())
