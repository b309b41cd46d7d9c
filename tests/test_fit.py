"""Values from measured data: statistics over noise, far starts, what data do not determine, bad data, --check, --parameters."""
import csv
import json
import math
import random

import pytest

from program import LEAN, REFERENCE, refdyn

TRUTH = {"E": 2.1e11, "eta": 1e-3, "m_E": 2.0, "Izz_col": 0.05}
NOISE = {"column_psi": 2e-4, "E_xdd": 0.05}
ARM = ["--from", "statics", "--noise", ",".join(f"{name}={sigma}" for name, sigma in NOISE.items())]
# A slide on a spring, with a force as input: its motions are known in closed form.
SLIDE = """local rd = require "refdyn"
local p = rd.parameters { { "m", 2, "kg" }, { "c", 50, "N/m" }, { "d", 0.3, "N s/m" }, { "d2", 0.3, "N s/m" }, { "idle", 3 } }
local force = rd.input("push", 0, "N")
return rd.model {
  name = "slide", gravity = { 0, 0, 0 },
  links  = { { "a", joint = "x", mass = p.m, spring = { x = p.c }, damper = { x = p.d + p.d2 } }, { "b", joint = "x", mass = p.idle } },
  forces = function(s) return { a_x = force } end,
}"""


def settings(values):
    return [text for name, value in values.items() for text in ("--set", f"{name}={value!r}")]


@pytest.fixture(scope="module")
def true_rows(tmp_path_factory):
    """The motion of the reference manipulator from which all data are made."""
    run = tmp_path_factory.mktemp("truth") / "run.csv"
    refdyn("sim", REFERENCE, "--from", "statics", "--until", 2, "--every", 0.01, "-o", run, *settings(TRUTH))
    return list(csv.DictReader(run.open()))


def measured(path, rows, seed, change=lambda row, values: values, columns=NOISE):
    """A file of measurements with noise; `change` may alter the values of each row."""
    noise = random.Random(seed)
    with path.open("w") as file:
        file.write(",".join(["t", *columns]) + "\n")
        for number, row in enumerate(rows):
            values = [float(row["t"])] + [float(row[name]) + noise.gauss(0, sigma) for name, sigma in columns.items()]
            file.write(",".join(str(value) for value in change(number, values)) + "\n")
    return path


def fit(*arguments, folder, status=0):
    out = folder / "fit.json"
    out.unlink(missing_ok=True)
    done = refdyn("fit", *arguments, "-o", out, status=status)
    return (json.loads(out.read_text()) if out.exists() else None), done


def fit_arm(data, start, folder, *more):
    return fit(REFERENCE, data, "--vary", ",".join(TRUTH), *ARM, *settings(start), *more, folder=folder)[0]


def test_statistics_over_noise(true_rows, tmp_path):
    """chi^2 and intervals over noise seeds, from starts 5 % off."""
    seeds = 10 if LEAN else 60
    chi2, held = [], 0
    for seed in range(seeds):
        found = fit_arm(measured(tmp_path / "d.csv", true_rows, seed), {name: 1.05 * value for name, value in TRUTH.items()}, tmp_path)
        chi2.append(found["chi2_dof"])
        held += sum(abs(found["values"][name] - value) < 1.96 * found["standard_errors"][name] for name, value in TRUTH.items())
        assert found["not_identifiable"] == [] and found["degrees_of_freedom"] == 398
    if not LEAN:
        assert 0.97 < sum(chi2) / seeds < 1.03
    assert 0.9 <= held / (4 * seeds) <= 0.99 or LEAN


@pytest.mark.parametrize("factors", [(1.5, 0.5, 1.5, 0.5), (0.5, 0.5, 0.5, 0.5), (1.5, 1.5, 1.5, 1.5)][: 1 if LEAN else 3])
def test_far_starts(true_rows, factors, tmp_path):
    """Starts 50 % off lead to the values found from the truth."""
    data = measured(tmp_path / "d.csv", true_rows, 1)
    near = fit_arm(data, TRUTH, tmp_path)
    found = fit_arm(data, {name: factor * value for (name, value), factor in zip(TRUTH.items(), factors)}, tmp_path)
    for name in TRUTH:
        assert abs(found["values"][name] - near["values"][name]) < 0.05 * near["standard_errors"][name]
    assert found["starts"] > 1


def slide_rows(m=2.0, c=50.0, d=0.6, x=0.0, v=0.0, push=1.0, count=400, step=0.01):
    """x(t) of the slide under a constant force."""
    w, a = math.sqrt(c / m - (d / 2 / m) ** 2), d / 2 / m
    rest = push / c
    rows = []
    for i in range(count):
        t = i * step + (0.2 * step if i % 3 else 0)  # times that are not equidistant
        b = (v + a * (x - rest)) / w
        rows.append({"t": t, "a_x": rest + math.exp(-a * t) * ((x - rest) * math.cos(w * t) + b * math.sin(w * t)), "push": push})
    return rows


@pytest.fixture
def slide(tmp_path):
    (tmp_path / "slide.lua").write_text(SLIDE)
    return tmp_path / "slide.lua"


def slide_data(path, rows, seed=0, sigma=1e-5, keep=lambda number: True):
    noise = random.Random(seed)
    lines = ["t,a_x,push"] + [f"{row['t']!r},{repr(row['a_x'] + noise.gauss(0, sigma)) if keep(i) else ''},{row['push']!r}" for i, row in enumerate(rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_inputs_gaps_and_several_files(slide, tmp_path):
    """Two files with other inputs and gaps, one held out; values against the closed form, standard errors against those of its Jacobian."""
    numpy = pytest.importorskip("numpy")
    files = [slide_data(tmp_path / f"{i}.csv", slide_rows(push=1.0 + i), seed=i, keep=lambda n: n % 4) for i in range(3)]
    found, done = fit(slide, *files[:2], "--held-out", files[2], "--vary", "m=1:9,c,d", "--noise", "a_x=1e-5", "--set", "m=2.2", "--set", "c=47",
                      "--tol", 1e-9, folder=tmp_path)
    truth = {"m": 2, "c": 50, "d": 0.3}
    assert found["degrees_of_freedom"] == 597 and found["residuals"]["a_x"]["count"] == 600
    for name, value in truth.items():
        assert abs(found["values"][name] - value) < 4 * found["standard_errors"][name]
    assert 0.8 < found["validation"]["chi2_dof"] < 1.2 and found["validation"]["residuals"]["a_x"]["count"] == 300
    columns = []
    for name, value in truth.items():
        h = 1e-4 * value
        sides = []
        for sign in (1, -1):
            changed = {**truth, name: value + sign * h}
            changed["d"] += 0.3
            sides.append(numpy.array([row["a_x"] for push in (1.0, 2.0) for n, row in enumerate(slide_rows(push=push, **changed)) if n % 4]))
        columns.append((sides[0] - sides[1]) / (2 * h) / 1e-5)
    covariance = numpy.linalg.inv(numpy.array(columns) @ numpy.array(columns).T)
    assert numpy.allclose(found["covariance"], covariance, rtol=0.02)
    assert numpy.allclose([found["standard_errors"][name] for name in truth], numpy.sqrt(numpy.diag(covariance)), rtol=0.01)


def test_start_values_and_parameters_file(slide, tmp_path):
    """An unknown start is found, and --parameters hands all values to `sim`, `statics` and `modes`; --set takes precedence."""
    data = slide_data(tmp_path / "d.csv", slide_rows(x=0.04, v=-0.1))
    found, _ = fit(slide, data, "--vary", "a_x,a_x_d,c", "--noise", "a_x=1e-5", "--tol", 1e-9, folder=tmp_path)
    for name, value in {"a_x": 0.04, "a_x_d": -0.1, "c": 50}.items():
        assert abs(found["values"][name] - value) < 4 * found["standard_errors"][name]
    run = tmp_path / "run.csv"
    refdyn("sim", slide, "--parameters", tmp_path / "fit.json", "--inputs", data, "--until", 3, "--tol", 1e-9, "-o", run)
    first, *_, last = csv.DictReader(run.open())
    assert float(first["a_x"]) == found["values"]["a_x"] and float(first["a_x_d"]) == found["values"]["a_x_d"]
    w, rest = math.sqrt(25 - 0.15**2), 0.02
    exact = rest + math.exp(-0.45) * (0.02 * math.cos(3 * w) + (-0.1 + 0.15 * 0.02) / w * math.sin(3 * w))
    assert abs(float(last["a_x"]) - exact) < 1e-5
    modes = json.loads(refdyn("modes", slide, "--parameters", tmp_path / "fit.json", "--set", "c=8").stdout)
    assert any(abs(mode["frequency"] - math.sqrt(8 / 2) / 2 / math.pi) < 1e-3 for mode in modes["modes"])


def test_bounds(slide, tmp_path):
    """A value whose best is beyond a bound ends at the bound, which is reported."""
    data = slide_data(tmp_path / "d.csv", slide_rows())
    found, done = fit(slide, data, "--vary", "c=20:45,d=0:9", "--noise", "a_x=1e-5", folder=tmp_path)
    assert found["values"]["c"] == pytest.approx(45) and found["at_bounds"] == ["c"] and "the model does not explain the data" in done.stderr


def test_not_identifiable(slide, true_rows, tmp_path):
    """Values that act together or not at all are refused by name; a weak one is named in the result."""
    data = slide_data(tmp_path / "d.csv", slide_rows())
    found, done = fit(slide, data, "--vary", "c,d,d2", "--noise", "a_x=1e-5", folder=tmp_path, status=1)
    assert "d and d2: act only together" in done.stderr and found["not_identifiable"] == [["d", "d2"]] and "standard_errors" not in found
    found, done = fit(slide, data, "--vary", "c,idle", "--noise", "a_x=1e-5", folder=tmp_path, status=1)
    assert "idle: the measured columns do not depend on it" in done.stderr and found["not_identifiable"] == [["idle"]]
    rows = measured(tmp_path / "arm.csv", true_rows, 1)
    found, done = fit(REFERENCE, rows, "--vary", "E,m_base,m_col,nu", *ARM, *settings(TRUTH), folder=tmp_path, status=1)
    assert "m_base and m_col: act only together" in done.stderr and found["not_identifiable"] == [["m_base", "m_col"], ["nu"]]
    weak = slide_data(tmp_path / "weak.csv", slide_rows(), sigma=0.1)
    found, done = fit(slide, weak, "--vary", "c,d", "--noise", "a_x=0.1", folder=tmp_path)
    assert "the data do not determine d" in done.stderr and found["not_identifiable"] == [["d"]]


BAD = {
    "degrees": (lambda i, v: [v[0], math.degrees(v[1]), v[2]], ":1: data: column column_psi is 57.* times the motion: it seems to be in degrees"),
    "exchanged": (lambda i, v: [v[0], v[2], v[1]], ":1: data: columns column_psi and E_xdd seem exchanged: each resembles the motion of the other"),
    "constant": (lambda i, v: [v[0], v[1], 1.5], ":1: data: column E_xdd is 1.5 in all 201 rows: a sensor that does not move"),
    "two_times": (lambda i, v: [v[0] % 1, v[1], v[2]], ":102: data: t = 0 does not follow 0.99, the time before it; times must ascend"),
    "nan": (lambda i, v: [v[0], v[1], "nan" if i == 7 else v[2]], ":9: data: E_xdd: 'nan' is not a finite number"),
    "early": (lambda i, v: [v[0] - 1, v[1], v[2]], ":2: data: t = -1; must not be before the motion, which starts at 0"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_data(name, true_rows, tmp_path):
    change, message = BAD[name]
    data = measured(tmp_path / "d.csv", true_rows, 1, change)
    done = fit(REFERENCE, data, "--vary", "E,m_E", *ARM, *settings(TRUTH), folder=tmp_path, status=1)[1]
    before, _, after = message.partition("*")
    assert before in done.stderr and after in done.stderr


def test_other_time_base(true_rows, tmp_path):
    """A second file in milliseconds."""
    first = measured(tmp_path / "a.csv", true_rows, 1)
    second = measured(tmp_path / "b.csv", true_rows, 2, lambda i, v: [1000 * v[0], v[1], v[2]])
    done = fit(REFERENCE, first, second, "--vary", "E,m_E", *ARM, folder=tmp_path, status=1)[1]
    assert "b.csv:1: data: the rows are 10 s apart, but 0.01 s in " in done.stderr


def test_columns_without_use(slide, tmp_path):
    """Columns that are not measured, or that are misspelt, are reported."""
    data = slide_data(tmp_path / "d.csv", slide_rows(count=50))
    lines = data.read_text().splitlines()
    data.write_text("\n".join([lines[0] + ",a_xd,b_x"] + [line + ",1,2" for line in lines[1:]]) + "\n")
    done = fit(slide, data, "--vary", "c", "--noise", "a_x=1e-5", folder=tmp_path)[1]
    assert "column a_xd is no column of the motion and is not used; the nearest is" in done.stderr
    assert "column b_x is not used; to use it, add its noise to --noise" in done.stderr


USAGE = {
    "no data": (["--vary", "c", "--noise", "a_x=1"], "DATA.csv is missing"),
    "unknown value": (["d.csv", "--vary", "cc", "--noise", "a_x=1"], "--vary: 'cc' is unknown; the nearest is 'c'"),
    "unread": (["d.csv", "--vary", "unread", "--noise", "a_x=1"], "--vary: 'unread' is unknown"),
    "twice": (["d.csv", "--vary", "c,c=1:2", "--noise", "a_x=1"], "--vary: c is given twice; give it once"),
    "range": (["d.csv", "--vary", "c=2:1", "--noise", "a_x=1"], "--vary: c=2:1: the range must ascend"),
    "form": (["d.csv", "--vary", "c=2", "--noise", "a_x=1"], "--vary: c=2: must be NAME or NAME=FROM:TO with two numbers"),
    "zero": (["d.csv", "--vary", "push", "--noise", "a_x=1"], "--vary: push is 0, which says nothing about its size; give its range, push=FROM:TO"),
    "column": (["d.csv", "--vary", "c", "--noise", "a_y=1"], "--noise: a_y is no column of the motion; the nearest is a_x"),
    "no sigma": (["d.csv", "--vary", "c", "--noise", "a_x"], "--noise: 'a_x' must be COLUMN=SIGMA, the standard deviation"),
    "sigma": (["d.csv", "--vary", "c", "--noise", "a_x=0"], "--noise: a_x=0: must be positive"),
    "time": (["d.csv", "--vary", "c", "--noise", "t=1"], "--noise: t is the time, which has no noise"),
    "until": (["d.csv", "--vary", "c", "--noise", "a_x=1", "--until", "1"], "--until needs --check; the data have their own times"),
    "check": (["d.csv", "--vary", "c", "--noise", "a_x=1", "--check"], "--check needs no data; omit "),
    "end": (["--vary", "c", "--noise", "a_x=1", "--check"], "--check needs --until, the end of the motion"),
}


@pytest.mark.parametrize("name", USAGE)
def test_wrong_usage(name, slide, tmp_path):
    arguments, message = USAGE[name]
    slide_data(tmp_path / "d.csv", slide_rows(count=20))
    found, done = fit(slide, *[tmp_path / text if text == "d.csv" else text for text in arguments], folder=tmp_path, status=2)
    assert message in done.stderr and found is None


def test_wrong_files(slide, tmp_path):
    """Too few rows; a file that --parameters cannot read."""
    (tmp_path / "d.csv").write_text("t,a_x\n0,1\n")
    assert "fewer than 2 rows" in fit(slide, tmp_path / "d.csv", "--vary", "c", "--noise", "a_x=1", folder=tmp_path, status=1)[1].stderr
    (tmp_path / "d.csv").write_text("t,a_x\n0,0\n0.1,1\n")
    assert "2 measurements for 3 values; must have more" in fit(slide, tmp_path / "d.csv", "--vary", "m,c,d", "--noise", "a_x=1", folder=tmp_path, status=1)[1].stderr
    wrong = tmp_path / "wrong.json"
    for text, message in {'{"values": {"cc": 1}}': "cc: unknown value of this model; the nearest is c", '{"name": "x"}': "parameters: no values",
                          "[": "parameters: ", '{"values": {"c": "1"}}': "c: a text; must be a number"}.items():
        wrong.write_text(text)
        done = refdyn("sim", slide, "--until", 1, "--parameters", wrong, status=1)
        assert f"{wrong}:1: {message}" in done.stderr


def test_check(slide, tmp_path):
    """Before data exist: errors as after them; what a column does not determine; the further column that helps most."""
    data = slide_data(tmp_path / "d.csv", slide_rows())
    after, _ = fit(slide, data, "--vary", "c,d", "--noise", "a_x=1e-5", "--set", "push=1", folder=tmp_path)
    before, _ = fit(slide, "--check", "--until", 3.99, "--every", 0.01, "--vary", "c,d", "--noise", "a_x=1e-5", "--set", "push=1", folder=tmp_path)
    for name in ("c", "d"):
        assert before["standard_errors"][name] == pytest.approx(after["standard_errors"][name], rel=0.05)
    found, done = fit(slide, "--check", "--until", 3, "--vary", "c,d,d2", "--noise", "a_x=1e-5", "--set", "push=1", folder=tmp_path)
    assert found["not_identifiable"] == [["d", "d2"]] and "these columns do not determine d and d2" in done.stderr
    found, done = fit(REFERENCE, "--check", "--until", 1, "--every", 0.01, "--vary", "E,m_base,m_col", *ARM[:2], "--noise", "column_psi=2e-4", *settings(TRUTH),
                      folder=tmp_path)
    assert ["m_base", "m_col"] in found["not_identifiable"] and "best_column" in found


def test_many_rows(slide, tmp_path):
    """A hundred thousand rows."""
    rows = slide_rows(count=100_000, step=1e-3)
    found, _ = fit(slide, slide_data(tmp_path / "d.csv", rows), "--vary", "c,d", "--noise", "a_x=1e-5", "--set", "c=49", folder=tmp_path)
    assert abs(found["values"]["c"] - 50) < 4 * found["standard_errors"]["c"] + 1e-3 and found["degrees_of_freedom"] == 99998
