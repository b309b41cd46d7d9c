"""Figures as a reader sees them: nothing overlaps, and everything can be distinguished and is named."""
import colorsys
import itertools
import json
import re
import time
import xml.etree.ElementTree

import pytest

from program import REFERENCE, TESTS, refdyn

SVG = "{http://www.w3.org/2000/svg}"
PENDULUM = TESTS / "models" / "double_pendulum.lua"
LETTER = 7  # pixels, at least the mean width of a letter


class Figure:
    """The texts of a figure with their positions, and its lines with their strokes, in the order of the file."""

    def __init__(self, path):
        self.root = xml.etree.ElementTree.parse(path).getroot()
        self.texts = [(float(text.get("x")), float(text.get("y")), text) for text in self.root.iter(SVG + "text") if not text.get("transform")]
        self.lines = [path for path in self.root.iter(SVG + "path") if path.get("stroke-width")]

    def find(self, words):
        return [(x, y) for x, y, text in self.texts if text.text == words]

    def samples(self):
        """Strokes in the key, by their height."""
        return {float(place[1]): line for line in self.lines if (place := re.fullmatch(r"M\S+ (\S+?)h\d+", line.get("d")))}

    def key(self):
        """Stroke of each name in the key; the name follows its sample."""
        samples = self.samples()
        return {text.text: samples[y - 4] for _, y, text in self.texts if y - 4 in samples}

    def curves(self):
        return [line for line in self.lines if "l" in line.get("d")]


def stroke(line):
    return line.get("stroke"), line.get("stroke-width"), line.get("stroke-dasharray")


def lightness(colour):
    red, green, blue = (int(colour[i:i + 2], 16) / 255 for i in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


def draw(folder, *runs, panel=None, name="figure.svg"):
    """Plots runs, each a table of columns over t = 0, 1, ..."""
    for i, run in enumerate(runs):
        rows = zip(range(10 ** 6), *run.values())
        (folder / f"run_{i}.csv").write_text(",".join(["t", *run]) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    refdyn("plot", *(f"run_{i}.csv" for i in range(len(runs))), *(["--panel", panel] if panel else []), "-o", name, cwd=folder)
    return Figure(folder / name) if name.endswith(".svg") else (folder / name).read_bytes()


def coordinates(names, rows=20):
    """Columns of coordinates, all different, and their rates."""
    values = {name: [(i + 1) * (k % 7) for k in range(rows)] for i, name in enumerate(names)}
    return {**values, **{name + "_d": [0] * rows for name in names}, "energy": [1] * rows}


def elements(count):
    return coordinates([f"arm_psi_{i}" for i in range(1, count + 1)])


@pytest.mark.parametrize("count", [3, 15, 64])
def test_every_element_has_a_colour_and_a_place_in_the_key(count, tmp_path):
    figure = draw(tmp_path, elements(count), panel="bending-psi")
    shown = [line.get("stroke") for line in figure.curves()]
    assert len(set(shown)) == count and [line.get("stroke") for line in figure.samples().values()] == shown
    named = figure.key()
    assert {"arm_psi_1", f"arm_psi_{count}"} <= set(named) and len(named) >= min(count, 10)
    assert all(named[name].get("stroke") == shown[int(name.split("_")[2]) - 1] for name in named)


@pytest.mark.parametrize("count", [2, 10, 15, 64])
def test_the_key_stands_beside_the_curves(count, tmp_path):
    """To the right of the axes, below the title, without overlapping names."""
    figure = draw(tmp_path, elements(count), panel="bending-psi")
    [(_, title)] = figure.find("Bending of the elements, psi")
    frame = next(re.match(r"M(\S+) \S+?v\S+?h(\S+)", path.get("d")) for path in figure.root.iter(SVG + "path") if "v" in path.get("d"))
    right = float(frame[1]) + float(frame[2])
    places = sorted((y, x, x + LETTER * len(text.text)) for x, y, text in figure.texts if text.text.startswith("arm_psi"))
    assert all(x > right and y > title + 10 and end < float(figure.root.get("width")) for y, x, end in places)
    assert all(b[0] - a[0] >= 11 for a, b in itertools.pairwise(places))
    samples = [re.match(r"M(\S+) \S+h(\d+)", line.get("d")) for line in figure.samples().values() if not line.get("stroke-linecap")]
    assert len(samples) == count and all(float(place[1]) + float(place[2]) < x for place in samples for _, x, _ in places)


RANGES = {"small": [1e-9, 3e-9], "large": [1e8, 3e9], "far": [1e6, 1e6 + 1], "narrow": [20067.1, 20067.2], "around": [-1e-3, 1e-3], "still": [5, 5],
          "huge": [-1.7e308, 1.7e308], "tiny": [0, 5e-324], "nothing": [0, 0]}


@pytest.mark.parametrize("which", RANGES)
def test_numbers_on_the_axes_stand_apart(which, tmp_path):
    for scale in (1, 0.2, 37):
        figure = draw(tmp_path, {"a_x": RANGES[which], "a_x_d": [0, 0], **{f"P_{axis}{rate}": [scale / 40 * value for value in RANGES[which]]
                                                                              for rate in ("", "d", "dd") for axis in "xyz"}})
        numbers = re.compile(r"-?[0-9.]+$")
        below = [(y, x, LETTER * len(text.text)) for x, y, text in figure.texts if text.get("text-anchor") == "middle" and numbers.match(text.text)]
        beside = [(x, y, LETTER * len(text.text)) for x, y, text in figure.texts if text.get("text-anchor") == "end" and numbers.match(text.text)]
        assert below and beside and all(width < 60 for _, _, width in beside)
        for (y, x, width), (y_next, x_next, width_next) in itertools.pairwise(sorted(below)):
            assert y != y_next or x_next - x >= (width + width_next) / 2 or abs(x_next - x) > 200, figure.texts
        columns = [sorted(y for x_at, y, _ in beside if x_at == x) for x in {x for x, _, _ in beside}]
        assert all(b - a >= 12 for column in columns for a, b in itertools.pairwise(column))


def test_neighbours_differ_in_grey_print(tmp_path):
    figure = draw(tmp_path, coordinates([f"l{i}_psi" for i in range(10)]), panel="angles")
    colours = [line.get("stroke") for line in figure.curves()]
    assert len(set(colours)) == 10 and all(abs(lightness(a) - lightness(b)) > 0.12 for a, b in itertools.pairwise(colours)), colours


def test_colours_tell_quantities_and_lines_tell_runs(tmp_path):
    """The same in every panel; a pale colour is the quantity's colour mixed with white."""
    run = {**coordinates(["a_psi", "b_psi", "c_x"]), **{f"P_{axis}{rate}": list(range(20)) for rate in ("", "d", "dd") for axis in "xyz"}}
    energy = run.pop("energy")
    figure = draw(tmp_path, *[{**run, "energy": energy, "push": energy}] * 6)
    heads = [stroke(figure.key()[f"run_{i}.csv"])[1:] for i in range(6)]
    assert len(set(heads)) == 6 and [stroke(line)[1:] for line in figure.curves()[:6]] == heads[:1] * 2 + heads[1:2] * 2 + heads[2:3] * 2
    for i, line in enumerate(figure.curves()[::2][:3]):
        assert stroke(line)[1:] == heads[i]
    hues = {name: colorsys.rgb_to_hsv(*(int(line.get("stroke")[k:k + 2], 16) for k in (1, 3, 5)))[0] for name, line in figure.key().items() if "_psi" in name}
    for i, line in enumerate(figure.curves()[:12]):
        hue = colorsys.rgb_to_hsv(*(int(line.get("stroke")[k:k + 2], 16) for k in (1, 3, 5)))[0]
        assert abs(hue - hues["ab"[i % 2] + "_psi"]) < 0.02


def test_residuals_end_at_rounding(tmp_path):
    run = coordinates(["a_psi"], 6)
    energy = run.pop("energy")
    figure = draw(tmp_path, {**run, "phi_1": [1e-300, 0, 1e-9, -1e-12, 1e-13, 1e-17], "psi_1": [0] * 6, "energy": energy})
    raised = [text.text for _, _, text in figure.texts if text.text.startswith("10")]
    powers = [int(text[2:].translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-"))) for text in raised]
    assert powers and min(powers) >= -16 and max(powers) <= -9, raised


@pytest.mark.quick
def test_forms(tmp_path):
    """The ending of the name selects the form; the same bytes each time, without the current date."""
    run = elements(3)
    png, pdf, svg = (draw(tmp_path, run, name=f"figure.{ending}") for ending in ("png", "pdf", "svg"))
    assert png.startswith(b"\x89PNG\r\n") and pdf.startswith(b"%PDF-1") and pdf.rstrip().endswith(b"%%EOF") and svg.root.tag == SVG + "svg"
    time.sleep(1.1)  # dates have a resolution of seconds
    assert png == draw(tmp_path, run, name="again.png") and pdf == draw(tmp_path, run, name="again.pdf")
    for name in ("figure.jpg", "figure", "figure.SVG", "svg", "a.png/b"):
        said = refdyn("plot", "run_0.csv", "-o", name, cwd=tmp_path, status=2).stderr
        assert said.startswith(f"refdyn plot: -o: '{name}' must end in .svg, .png or .pdf\nusage: "), said


def test_single_panels(tmp_path):
    """Names are listed in the help, and in the message about a wrong one."""
    run = coordinates(["a_psi", "b_x"])
    whole = draw(tmp_path, run)
    for panel, title in (("angles", "Joint angles"), ("slides", "Slides"), ("energy", "Kinetic and potential energy")):
        figure = draw(tmp_path, run, panel=panel)
        assert figure.find(title) and whole.find(title) and len(figure.curves()) == 1
    assert len(draw(tmp_path, run, panel="energy,angles").curves()) == 2
    said = refdyn("plot", "run_0.csv", "--panel", "energy,angel", "-o", "x.svg", cwd=tmp_path, status=2).stderr
    names = re.match(r"refdyn plot: --panel: 'angel' is not one of ([a-z, -]+)\n  --panel a,b ", said)
    assert names and f"these panels only: {names[1]}\n" in refdyn("plot", "--help").stdout
    said = refdyn("plot", "run_0.csv", "--panel", "torsion", "-o", "x.svg", cwd=tmp_path, status=1).stderr
    assert said == "run_0.csv:1: run: no column for these panels; give a file of refdyn sim\n"


@pytest.mark.quick
def test_units(tmp_path):
    """The summary has units by column, and axes without a known unit take it from there."""
    refdyn("sim", REFERENCE, "--set", "n_rfe=2", "--set", "drive=input", "--method", "rk4", "--step", "1e-3", "--until", "0.02", "-o", "run.csv",
           "--summary", "run.json", cwd=tmp_path)
    units = json.loads((tmp_path / "run.json").read_text())["units"]
    columns = (tmp_path / "run.csv").read_text().split("\n")[0].split(",")
    assert [name for name in columns if name not in units] == ["phi_1", "psi_1", "psi_2", "lambda_ellipse", "lambda_rise", "torque", "vertical_velocity"] and set(units) <= set(columns)
    wanted = {"t": "s", "base_z": "m", "arm_psi": "rad", "arm_psi_1_d": "rad/s", "effector_z_d": "m/s", "E_x": "m", "E_zd": "m/s", "E_ydd": "m/s^2",
              "energy": "J", "force_base_z": "N", "force_arm_psi_1": "N m", "tau": "N m"}
    assert {name: units[name] for name in wanted} == wanted
    labels = lambda: {text.text for text in Figure(tmp_path / "run.svg").root.iter(SVG + "text")}  # noqa: E731
    refdyn("plot", "run.csv", "-o", "run.svg", cwd=tmp_path)
    assert {"tau", "angle [rad]", "energy [J]", "dz/dt [m/s]", "force [N]", "torque [N m]"} <= labels()
    refdyn("plot", "run.csv", "--units", "run.json", "-o", "run.svg", cwd=tmp_path)
    assert "tau [N m]" in labels()
    (tmp_path / "other.json").write_text('{"unit": {}}')
    said = refdyn("plot", "run.csv", "--units", "other.json", "-o", "run.svg", cwd=tmp_path, status=1).stderr
    assert said == "other.json:1: units: no object 'units'; give a summary of refdyn sim\n"


def test_each_method_has_its_own_colour_and_mark(tmp_path):
    """The same in every figure, regardless of the other methods in it."""
    def marks(*methods):
        refdyn("report", PENDULUM, "--until", "0.2", "--tols", "1e-3,1e-5", "--steps", "1e-2", "--seconds", "20", *methods, "-o", tmp_path)
        figure = Figure(tmp_path / "double_pendulum.svg")
        shapes = {path.get("d").split("m", 1)[0].strip("M"): path.get("d").split("m", 1)[1] for path in figure.root.iter(SVG + "path")
                  if path.get("fill") and path.get("d").count("M") == 1 and "m" in path.get("d")}
        return {name: (line.get("stroke"), shape) for name, line in figure.key().items() for place, shape in shapes.items()
                if float(place.split()[1]) == float(line.get("d").split()[1].split("h")[0])}

    every = marks()
    assert not any(line.get("stroke-dasharray") for name, line in Figure(tmp_path / "double_pendulum.svg").key().items() if name != "floor")
    assert len(every) > 6 and len({colour for colour, _ in every.values()}) == len({mark for _, mark in every.values()}) == len(every), every
    assert all(every[name] == mark for name, mark in marks("--methods", "rk8,rodas5p").items())


def test_a_slope_is_that_of_the_formula(tmp_path):
    """Steps so small that the error is only rounding are excluded from the fit."""
    steps = ",".join(str(1e-2 / 2 ** i) for i in range(9))
    said = refdyn("report", REFERENCE, "--set", "n_rfe=1", "--until", "0.5", "--methods", "rk4", "--steps", steps, "--seconds", "60", "-o", tmp_path).stdout
    slopes = re.findall(r"^rk4, (?:none|project) .* step\^(\S+) \((\d) runs\)", said, re.M)
    assert len(slopes) == 2 and all(abs(float(slope) - 4) < 0.3 and int(runs) < 7 for slope, runs in slopes), said
