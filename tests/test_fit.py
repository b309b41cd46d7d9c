"""Values from measured data: statistics over noise, far starts, what data do not determine, bad data, --check, --parameters."""
import csv
import json
import math
import random
import resource

import pytest

from program import MODELS, LEAN, LONG, REFERENCE, SOURCE, refdyn

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
    print(f"{seeds} seeds: mean chi^2 {sum(chi2) / seeds:.4f}, {100 * held / (4 * seeds):.1f} % of the truths within 1.96 standard errors")
    if not LEAN:
        assert 0.97 < sum(chi2) / seeds < 1.03
    assert 0.9 <= held / (4 * seeds) <= 0.99 or LEAN


def is_recovered(found, near):
    return all(abs(found["values"][name] - near["values"][name]) < 0.05 * near["standard_errors"][name] for name in TRUTH)


# Starts as parts of the truth, and seeds of the noise. The last two lead single searches to a minimum with chi^2 2.5.
FAR = [(1.5, 0.5, 1.5, 0.5, 1), (0.5, 0.5, 0.5, 0.5, 1), (1.5, 1.5, 1.5, 1.5, 1), (1.48, 0.5, 1.45, 1, 2), (0.89, 1.19, 0.63, 0.75, 2),
       (0.84, 0.74, 0.88, 1.18, 4)]


@pytest.mark.parametrize("far", FAR[: 1 if LEAN else len(FAR)])
def test_far_starts(true_rows, far, tmp_path):
    """Starts 50 % off lead to the values found from the truth."""
    *factors, seed = far
    data = measured(tmp_path / "d.csv", true_rows, seed)
    near = fit_arm(data, TRUTH, tmp_path)
    found = fit_arm(data, {name: factor * value for (name, value), factor in zip(TRUTH.items(), factors)}, tmp_path)
    assert is_recovered(found, near) and found["starts_tried"] > 1 and found["evaluations"] < 4000


@pytest.mark.skipif(not LONG, reason="a quarter of an hour; tests/long")
def test_random_far_starts(true_rows, tmp_path):
    """40 random starts within 50 % of the truth for each of five seeds of the noise."""
    recovered, evaluations = 0, []
    for seed in range(5):
        data = measured(tmp_path / "d.csv", true_rows, 100 + seed)
        near = fit_arm(data, TRUTH, tmp_path)
        for number in range(40):
            chance = random.Random(1000 * seed + number)
            start = {name: value * math.exp(chance.uniform(math.log(0.5), math.log(1.5))) for name, value in TRUTH.items()}
            found = fit_arm(data, start, tmp_path)
            recovered += is_recovered(found, near)
            evaluations.append(found["evaluations"])
    print(f"recovered {recovered} of {len(evaluations)}; motions: median {sorted(evaluations)[100]}, largest {max(evaluations)}")
    assert recovered == len(evaluations) and max(evaluations) < 5000


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
    crane = SOURCE / "models" / "crane.lua"  # a plane motion, in which Poisson's ratio changes rounding alone
    refdyn("sim", crane, "--from", "statics", "--until", 2, "--every", 0.02, "-o", tmp_path / "crane.csv")
    rows = measured(tmp_path / "boom.csv", list(csv.DictReader((tmp_path / "crane.csv").open())), 1, columns={"column_psi": 1e-4})
    found, done = fit(crane, rows, "--vary", "E,nu,slew", "--noise", "column_psi=1e-4", "--from", "statics", folder=tmp_path, status=1)
    assert "nu: the measured columns do not depend on it" in done.stderr and found["not_identifiable"] == [["nu"]]
    weak = slide_data(tmp_path / "weak.csv", slide_rows(), sigma=0.1)
    found, done = fit(slide, weak, "--vary", "c,d", "--noise", "a_x=0.1", folder=tmp_path)
    assert "the data do not determine d" in done.stderr and found["not_identifiable"] == [["d"]]


def test_start_on_a_kink(tmp_path):
    """The slide starts where it touches the wall, so that only one side of a change of `wall` has the event of touching."""
    model = tmp_path / "wall.lua"
    model.write_text("""local rd = require "refdyn"
local p = rd.parameters { { "m", 1.5, "kg" }, { "wall", 0.25, "m" }, { "c", 300, "N/m" } }
return rd.model {
  name = "wall", gravity = { 0, 0, 0 }, links = { { "a", joint = "x", mass = p.m, spring = { x = 20 }, start = { x = 0.25 } } },
  forces = function(s) return { a_x = -p.c * rd.max(0, s.q.a_x - p.wall) + 9 * rd.sin(7 * s.t) } end,
}""")
    truth = {"m": 1.4, "wall": 0.24, "c": 280}
    refdyn("sim", model, *settings(truth), "--until", 3, "--every", 0.01, "-o", tmp_path / "run.csv")
    data = measured(tmp_path / "d.csv", list(csv.DictReader((tmp_path / "run.csv").open())), 3, columns={"a_x": 1e-4})
    found, done = fit(model, data, "--vary", ",".join(truth), "--noise", "a_x=1e-4", folder=tmp_path)
    assert all(abs(found["values"][name] - value) < 4 * found["standard_errors"][name] for name, value in truth.items())
    assert found["chi2_dof"] < 1.3 and found["rough_errors"] == []
    found, done = fit(model, data, "--vary", "wall=0.25:0.3", "--noise", "a_x=1e-4", folder=tmp_path)  # ends at the kink
    assert found["at_bounds"] == found["rough_errors"] == ["wall"]
    assert "warning: a slight change of wall reorders events: its derivatives are differences of separate motions" in done.stderr


def test_start_of_a_value_on_a_kink(tmp_path):
    """The search leaves the kink of a spring that only pulls."""
    model = tmp_path / "pulled.lua"
    model.write_text("""local rd = require "refdyn"
local p = rd.parameters { { "pull", 1, "N" }, { "d", 0.4, "N s/m" } }
return rd.model { name = "pulled", gravity = { 0, 0, 0 }, links = { { "a", joint = "x", mass = 1.5, spring = { x = 20 }, damper = { x = p.d } } },
  forces = function(s) return { a_x = 3 * rd.max(p.pull, 1) + rd.sin(7 * s.t) } end }""")
    refdyn("sim", model, "--set", "pull=1.7", "--until", 3, "--every", 0.02, "-o", tmp_path / "run.csv")
    data = measured(tmp_path / "d.csv", list(csv.DictReader((tmp_path / "run.csv").open())), 3, columns={"a_x": 1e-3})
    found, done = fit(model, data, "--vary", "pull,d", "--noise", "a_x=1e-3", folder=tmp_path)
    assert abs(found["values"]["pull"] - 1.7) < 4 * found["standard_errors"]["pull"] and found["rough_errors"] == [], done.stderr


BAD = {
    "degrees": (lambda i, v: [v[0], math.degrees(v[1]), v[2]], ":1: data: column column_psi is 57.* times the motion: it seems to be in degrees"),
    "exchanged": (lambda i, v: [v[0], v[2], v[1]], ":1: data: columns column_psi and E_xdd seem exchanged: each resembles the motion of the other"),
    "constant": (lambda i, v: [v[0], v[1], 1.5], ":1: data: column E_xdd is 1.5 in all 201 rows: a sensor that does not move"),
    "two_times": (lambda i, v: [v[0] % 1, v[1], v[2]], ":102: data: t = 0 does not follow 0.99, the time before it; times must ascend"),
    "nan": (lambda i, v: [v[0], v[1], "nan" if i == 7 else v[2]], ":9: data: E_xdd: 'nan' is not a finite number"),
    "milliseconds": (lambda i, v: [1000 * v[0], v[1], v[2]], ":1: data: t ends at 2000: it seems to be in milliseconds; must be in seconds"),
    "millimetres": (lambda i, v: [v[0], v[1], 1000 * v[2]], "times the motion: it seems to be in thousandths of the model's unit, such as mm"),
    "of_g": (lambda i, v: [v[0], v[1], v[2] / 9.81], ":1: data: column E_xdd is 0.107 times the motion: it seems to be in multiples of g"),
    "inches": (lambda i, v: [v[0], v[1], v[2] / 0.0254], "times the motion: it seems to be in inches instead of metres"),
    "revolutions": (lambda i, v: [v[0], v[1] / 2 / math.pi, v[2]], "times the motion: it seems to be in revolutions instead of radians"),
    "microseconds": (lambda i, v: [1e6 * v[0], v[1], v[2]], ":1: data: t ends at 2e+06: it seems to be in microseconds; must be in seconds"),
    "clock": (lambda i, v: [v[0] + 1.7e9, v[1], v[2]], ":2: data: t begins at 1.7e+09, but the motion starts at 0, earlier by 8.5e+08 times the length of the data;"),
    "late": (lambda i, v: [v[0] + 3, v[1], v[2]], ":1: data: t begins at 3, but the motion starts at 0 and differs from the data at these times; t must be in seconds"),
    "missing": (lambda i, v: [v[0], v[1], ""], ":1: data: E_xdd has no measurement in this file; add its column, or omit it from --noise"),
    "early": (lambda i, v: [v[0] - 1, v[1], v[2]], ":2: data: t = -1; must not be before the motion, which starts at 0"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_data(name, true_rows, tmp_path):
    change, message = BAD[name]
    data = measured(tmp_path / "d.csv", true_rows, 1, change)
    done = fit(REFERENCE, data, "--vary", "E,m_E", *ARM, *settings(TRUTH), folder=tmp_path, status=1)[1]
    before, _, after = message.partition("*")
    assert before in done.stderr and after in done.stderr


def test_reversed_sign(slide, tmp_path):
    """A warning, since the search may find an input of the other sign."""
    data = slide_data(tmp_path / "d.csv", slide_rows(push=-1.0))
    data.write_text(data.read_text().replace(",push", ",other"))
    found, done = fit(slide, data, "--vary", "c,push=-3:3", "--noise", "a_x=1e-5", "--set", "push=1.1", folder=tmp_path)
    assert "warning: data: column a_x is -0.9" in done.stderr and "times the motion: its sign seems to be reversed" in done.stderr
    assert abs(found["values"]["push"] + 1) < 4 * found["standard_errors"]["push"]


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
    assert "1 column without noise is not used (b_x); to use one, add it to --noise" in done.stderr


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
    assert "best_column" not in found and "warning: no single further column would help" in done.stderr
    found, done = fit(REFERENCE, "--check", "--until", 1, "--every", 0.01, "--vary", "E,m_base,m_col", *ARM[:2], "--noise", "column_psi=2e-4", *settings(TRUTH),
                      folder=tmp_path)
    assert ["m_base", "m_col"] in found["not_identifiable"] and "best_column" in found


def test_tolerance_of_rates(tmp_path):
    """A column of accelerations."""
    plain, strict, best = (fit(MODELS / "pendulum.lua", "--check", "--until", 0.3, "--every", 0.05, "--vary", "E,rho", "--noise", "E_xdd=1e-3", *more,
                               folder=tmp_path)[0]["standard_errors"]["E"] for more in (("--tol", 1e-4), ("--tol", 1e-4, "--tol-rates", 1e-8), ("--tol", 1e-11)))
    assert abs(strict - best) < abs(plain - best) / 100


def test_many_rows(slide, tmp_path):
    """Twenty thousand rows with inputs."""
    rows = slide_rows(count=20_000, step=1e-3)
    found, _ = fit(slide, slide_data(tmp_path / "d.csv", rows), "--vary", "c,d", "--noise", "a_x=1e-5", "--set", "c=49", folder=tmp_path)
    assert abs(found["values"]["c"] - 50) < 4 * found["standard_errors"]["c"] + 1e-3 and found["degrees_of_freedom"] == 19998


@pytest.mark.skipif(not LONG, reason="a minute; tests/long")
def test_a_million_rows(slide, tmp_path):
    """Memory is bounded by the rows; a far start uses a part of them until the end."""
    data = tmp_path / "d.csv"
    noise = random.Random(1)
    with data.open("w") as file:
        file.write("t,a_x\n")
        for i in range(1_000_000):
            file.write(f"{1e-5 * i:.5f},{slide_at(1e-5 * i) + noise.gauss(0, 1e-4):.9g}\n")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    found, done = fit(slide, data, "--vary", "c,d", "--noise", "a_x=1e-4", "--set", "push=1", "--set", "c=80", folder=tmp_path)
    memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"{done.stderr.splitlines()[-1]}; {memory / 1024:.0f} MB")
    assert found["degrees_of_freedom"] == 999_998 and found["starts_tried"] > 1 and max(before, 400_000) >= memory
    for name, value in {"c": 50, "d": 0.3}.items():
        assert abs(found["values"][name] - value) < 4 * found["standard_errors"][name]


# ---- FIT.lua ----

def lua_file(folder, text, name="fit.lua"):
    path = folder / name
    path.write_text(f'local rd = require "refdyn"\nreturn rd.fit {{\n{text}\n}}\n')
    return path


def slide_at(t, m=2.0, c=50.0, d=0.6, x=0.0, v=0.0, push=1.0):
    """x(t) of the slide; before the start it is at rest at x."""
    w, a, rest = math.sqrt(c / m - (d / 2 / m) ** 2), d / 2 / m, push / c
    b = (v + a * (x - rest)) / w
    return x if t <= 0 else rest + math.exp(-a * t) * ((x - rest) * math.cos(w * t) + b * math.sin(w * t))


def sensor_data(path, seed=0, sigma=1e-5, gain=1.0, offset=0.0, delay=0.0, count=400, start=0.0, **motion):
    noise = random.Random(seed)
    times = [start + 0.01 * i for i in range(count)]
    lines = ["t,a_x"] + [f"{t!r},{gain * slide_at(t - delay, **motion) + offset + noise.gauss(0, sigma)!r}" for t in times]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_file_in_place_of_options(slide, tmp_path):
    """FIT.lua finds what the same options find, with paths relative to its folder, a file held out, and weights."""
    for i in range(3):
        slide_data(tmp_path / f"{i}.csv", slide_rows(push=1.0 + i), seed=i)
    options, _ = fit(slide, tmp_path / "0.csv", tmp_path / "1.csv", "--held-out", tmp_path / "2.csv", "--vary", "m=1:9,c", "--noise", "a_x=1e-5", folder=tmp_path)
    text = 'vary = { c = rd.free(), m = rd.within(1, 9) }, noise = { a_x = 1e-5 }, data = { "0.csv", { "1.csv", weight = %s } }, held_out = { "2.csv" },'
    found, _ = fit(slide, lua_file(tmp_path, text % 1), folder=tmp_path)
    for name in ("m", "c"):
        assert found["values"][name] == pytest.approx(options["values"][name], rel=1e-9)
        assert found["standard_errors"][name] == pytest.approx(options["standard_errors"][name], rel=1e-6)
    assert found["validation"]["chi2_dof"] == pytest.approx(options["validation"]["chi2_dof"])
    light, _ = fit(slide, lua_file(tmp_path, text % 0.01), folder=tmp_path)
    alone, _ = fit(slide, tmp_path / "0.csv", "--vary", "m=1:9,c", "--noise", "a_x=1e-5", folder=tmp_path)
    assert abs(light["values"]["c"] - alone["values"]["c"]) < 0.2 * alone["standard_errors"]["c"]
    assert light["residuals"]["a_x"]["rms"] == pytest.approx(found["residuals"]["a_x"]["rms"], rel=0.05)
    data = lua_file(tmp_path, 'vary = { c = rd.within(20, 80, 45) }, noise = { a_x = 1e-5 },')
    before, _ = fit(slide, data, "--check", "--until", 3.99, "--every", 0.01, "--set", "push=1", folder=tmp_path)
    assert before["standard_errors"]["c"] > 0


def test_result_is_no_file_that_the_fit_reads(slide, tmp_path):
    data = slide_data(tmp_path / "0.csv", slide_rows(push=1.0))
    path = lua_file(tmp_path, 'vary = { c = rd.free() }, noise = { a_x = 1e-5 }, data = { "0.csv" },')
    before = data.read_text(), path.read_text()
    for out in (data, path):
        said = refdyn("fit", slide, path, "-o", out, status=1).stderr
        assert f"{out}: output: {out} is the file {out}, which this command also reads or writes; give another name\n" in said
    refdyn("fit", slide, data, "--vary", "c", "--noise", "a_x=1e-5", "-o", data, status=1)
    assert before == (data.read_text(), path.read_text())


SENSORS = {"offset": (0.02, "rd.free()"), "gain": (1.1, "rd.within(0.5, 2)"), "delay": (0.0123, "rd.within(0, 0.05)")}


@pytest.mark.parametrize("unknown", [(), ("offset",), ("gain",), ("delay",), ("offset", "gain", "delay")])
def test_sensors(slide, unknown, tmp_path):
    """Properties of a sensor that are known or to be found: values within their errors, chi^2 of the noise."""
    truth = {name: value for name, (value, _) in SENSORS.items()}
    sensor_data(tmp_path / "d.csv", seed=3, **truth)
    fields = ", ".join(f"{name} = {SENSORS[name][1] if name in unknown else value}" for name, value in truth.items())
    text = f'vary = {{ c = rd.free(), d = rd.free() }}, noise = {{ a_x = 1e-5 }}, sensors = {{ a_x = {{ {fields} }} }}, data = {{ "d.csv" }},'
    found, _ = fit(slide, lua_file(tmp_path, text), "--set", "push=1", "--set", "c=52", "--tol", 1e-9, folder=tmp_path)
    assert 0.8 < found["chi2_dof"] < 1.2 and list(found["values"]) == ["c", "d"]
    assert set(found.get("sensors", {})) == {f"a_x_{name}" for name in unknown}
    for name, value in {"c": 50, "d": 0.3, **{f"a_x_{name}": truth[name] for name in unknown}}.items():
        assert abs({**found["values"], **found.get("sensors", {})}[name] - value) < 4.5 * found["standard_errors"][name], name
    refdyn("sim", slide, "--parameters", tmp_path / "fit.json", "--until", 1, "-o", tmp_path / "run.csv")


def test_derivative_by_delay(slide, tmp_path):
    """The standard error of a delay is that of dy/dt in closed form."""
    numpy = pytest.importorskip("numpy")
    sensor_data(tmp_path / "d.csv", delay=0.02)
    text = 'vary = {}, noise = { a_x = 1e-5 }, sensors = { a_x = { delay = rd.within(0, 0.05) } }, data = { "d.csv" },'
    found, _ = fit(slide, lua_file(tmp_path, text), "--set", "push=1", "--tol", 1e-9, folder=tmp_path)
    slopes = [(slide_at(0.01 * i - 0.02 + 1e-6) - slide_at(0.01 * i - 0.02 - 1e-6)) / 2e-6 for i in range(400)]
    assert found["standard_errors"]["a_x_delay"] == pytest.approx(1e-5 / numpy.linalg.norm(slopes), rel=1e-3)


def test_far_starts_with_sensors(slide, tmp_path):
    """Many starts, of which all have the delay of the start: a stiffness 60 % off drifts out of phase."""
    sensor_data(tmp_path / "d.csv", seed=5, delay=0.02, offset=0.01, count=1500)
    text = 'vary = { c = rd.free() }, noise = { a_x = 1e-5 }, sensors = { a_x = { delay = rd.within(0, 0.05), offset = rd.free() } }, data = { "d.csv" },'
    path = lua_file(tmp_path, text)
    found, _ = fit(slide, path, "--set", "push=1", "--set", "c=80", "--tol", 1e-9, folder=tmp_path)
    assert found["starts_tried"] > 1 and abs(found["values"]["c"] - 50) < 4.5 * found["standard_errors"]["c"]
    path.write_text(path.read_text().replace("sensors", 'starts = { "a_x", "a_x_d" }, sensors'))
    found, done = fit(slide, path, "--set", "push=1", folder=tmp_path, status=1)  # a delay is another start
    assert found["not_identifiable"] == [["a_x_delay", "a_x_d@d.csv"]] and "a_x_delay and a_x_d@d.csv: act only together" in done.stderr


def test_starts_of_files(slide, tmp_path):
    """Each file has its own start; the start of a file that is held out is found after the fit."""
    starts = {"a.csv": (0.04, -0.1), "b.csv": (-0.02, 0.2), "c.csv": (0.01, 0.3)}
    for seed, (name, (x, v)) in enumerate(starts.items()):
        sensor_data(tmp_path / name, seed=seed, x=x, v=v)
    text = 'vary = { c = rd.free() }, noise = { a_x = 1e-5 }, starts = { "a_x", "a_x_d" }, data = { "a.csv", "b.csv" }, held_out = { "c.csv" },'
    found, _ = fit(slide, lua_file(tmp_path, text), "--set", "push=1", "--tol", 1e-9, folder=tmp_path)
    assert list(found["starts"]) == [f"{name}@{file}" for file in starts for name in ("a_x", "a_x_d")]
    assert list(found["standard_errors"]) == ["c", *list(found["starts"])[:4]] and len(found["covariance"]) == 5
    for file, values in starts.items():
        for name, value in zip(("a_x", "a_x_d"), values):
            assert found["starts"][f"{name}@{file}"] == pytest.approx(value, abs=2e-5)
    assert abs(found["values"]["c"] - 50) < 4.5 * found["standard_errors"]["c"]
    assert 0.8 < found["validation"]["chi2_dof"] < 1.2


def test_bounds_and_sizes_of_starts(slide, tmp_path):
    """Without bounds a start is searched within the size of its motion, however large; bounds restrict it, also in files that are held out."""
    sensor_data(tmp_path / "a.csv", seed=1, x=400.0, v=-900.0, sigma=1e-2)
    sensor_data(tmp_path / "b.csv", seed=2, x=0.004, v=0.02)
    text = 'vary = { c = rd.free() }, noise = { a_x = %s }, starts = { %s }, data = { "%s" },'
    found, _ = fit(slide, lua_file(tmp_path, text % ("1e-2", '"a_x", "a_x_d"', "a.csv")), "--set", "push=1", "--tol", 1e-9, folder=tmp_path)
    assert found["starts_tried"] > 0 and 0.8 < found["chi2_dof"] < 1.2
    assert found["starts"]["a_x@a.csv"] == pytest.approx(400, abs=0.01) and found["starts"]["a_x_d@a.csv"] == pytest.approx(-900, abs=0.1)
    bounded = text % ("1e-5", '"a_x", a_x_d = rd.within(-0.01, 0.01)', "b.csv")
    found, done = fit(slide, lua_file(tmp_path, bounded), "--set", "push=1", folder=tmp_path)
    assert found["starts"]["a_x_d@b.csv"] == pytest.approx(0.01) and found["at_bounds"] == ["a_x_d@b.csv"] and "does not explain" in done.stderr
    sensor_data(tmp_path / "c.csv", seed=3)
    held = bounded.replace("b.csv", "c.csv") + ' held_out = { "b.csv" },'
    found, _ = fit(slide, lua_file(tmp_path, held), "--set", "push=1", folder=tmp_path)
    assert found["starts"]["a_x_d@b.csv"] == pytest.approx(0.01) and found["validation"]["chi2_dof"] > 2 > found["chi2_dof"]


GOOD = {"vary": "{ c = rd.free() }", "noise": "{ a_x = 1e-5 }", "data": '{ "d.csv" }'}
# Fields that differ from the good ones (None: left out), and the message, of which the first line of fields is line 3.
WRONG_FILES = {
    "vary number": ({"vary": "{ c = 3 }"}, "3: vary.c: a number; must be rd.free() or rd.within(FROM, TO)"),
    "vary list": ({"vary": "{ 3 }"}, "3: vary: has entries without a name; must be a table such as { m = rd.free() }"),
    "vary text": ({"vary": '"c"'}, "3: vary: a text; must be a table such as { m = rd.free() }"),
    "vary empty": ({"vary": "{}"}, "2: rd.fit: no value is to be found; add vary = { m = rd.free() }"),
    "unknown value": ({"vary": "{ cc = rd.free() }"}, "3: vary: 'cc' is unknown; the nearest is 'c'"),
    "zero": ({"vary": "{ push = rd.free() }"}, "3: vary: push is 0, which says nothing about its size; give its range, push = rd.within(FROM, TO)"),
    "range": ({"vary": "{ c = rd.within(2, 1) }"}, "3: vary.c: rd.within: from 2 to 1; the range must ascend"),
    "start": ({"vary": "{ c = rd.within(1, 2, 3) }"}, "3: vary.c: rd.within: start 3; must be from 1 to 2"),
    "infinite": ({"vary": "{ c = rd.within(1, 1/0) }"}, "3: vary.c: rd.within: a number is not finite; numbers must be finite"),
    "arguments": ({"vary": "{ c = rd.within(1) }"}, "3: rd.within: 1 argument; must have 2 or 3: from and to, and optionally the start"),
    "free": ({"vary": "{ c = rd.free(1) }"}, "3: rd.free: 1 argument; must have 0: none"),
    "no noise": ({"noise": None}, "2: rd.fit: noise is missing; add noise = { psi = 1e-3 }"),
    "noise empty": ({"noise": "{}"}, "4: noise: empty; must have at least one column, as in { psi = 1e-3 }"),
    "noise text": ({"noise": '{ a_x = "1" }'}, "4: noise.a_x: a text; must be a number"),
    "noise zero": ({"noise": "{ a_x = 0 }"}, "4: noise.a_x: value 0; must be positive"),
    "column": ({"noise": "{ a_y = 1 }"}, "4: noise: a_y is no column of the motion; the nearest is a_x"),
    "time": ({"noise": "{ t = 1 }"}, "4: noise: t is the time, which has no noise"),
    "no data": ({"data": None}, '2: rd.fit: data is missing; add data = { "run.csv" }'),
    "data empty": ({"data": "{}"}, '5: data: an empty list; must have at least one file, as in { "run.csv" }'),
    "data text": ({"data": '"d.csv"'}, '5: data: a text; must be a list such as { "run.csv" }'),
    "data number": ({"data": "{ 3 }"}, '5: data[1]: a number; must be a file such as "run.csv" or { "run.csv", weight = 0.5 }'),
    "data twice": ({"data": '{ "d.csv", "d.csv" }'}, '5: data[2]: "d.csv" is given twice; give it once'),
    "weight": ({"data": '{ { "d.csv", weight = -1 } }'}, "5: data[1].weight: value -1; must be positive"),
    "weigth": ({"data": '{ { "d.csv", weigth = 1 } }'}, '5: data[1].weigth: unknown field; did you mean "weight"?'),
    "sensor column": ({"sensors": "{ b_x = { gain = 2 } }"}, "6: sensors.b_x: no measured column; add its noise to noise"),
    "sensor field": ({"sensors": "{ a_x = { gian = 2 } }"}, '6: sensors.a_x.gian: unknown field; did you mean "gain"?'),
    "sensor gain": ({"sensors": "{ a_x = { gain = 0 } }"}, "6: sensors.a_x.gain: value 0; must be finite and not 0"),
    "sensor offset": ({"sensors": '{ a_x = { offset = "1" } }'}, "6: sensors.a_x.offset: a text; must be a number, rd.free() or rd.within(FROM, TO)"),
    "sensor delay": ({"sensors": "{ a_x = { delay = rd.free() } }"}, "6: sensors.a_x.delay: made by rd.free; must be a number [s] or rd.within(FROM, TO)"),
    "sensor number": ({"sensors": "{ a_x = 2 }"}, "6: sensors.a_x: a number; must be a table such as { offset = rd.free() }"),
    "starts text": ({"starts": '"a_x"'}, '6: starts: a text; must be a table such as { "psi", psi_d = rd.within(-1, 1) }'),
    "starts value": ({"starts": "{ a_x = 3 }"}, "6: starts.a_x: a number; must be rd.free() or rd.within(FROM, TO)"),
    "starts named twice": ({"starts": '{ "a_x", a_x = rd.free() }'}, '6: starts.a_x: "a_x" is given twice; give it once'),
    "starts number": ({"starts": "{ 1 }"}, "6: starts[1]: a number; must be a name"),
    "starts twice": ({"starts": '{ "a_x", "a_x" }'}, '6: starts[2]: "a_x" is given twice; give it once'),
    "starts parameter": ({"starts": '{ "m" }'}, "6: starts: m has no start; use a coordinate or its rate NAME_d"),
    "starts unknown": ({"starts": '{ "a_xx" }'}, "6: starts: 'a_xx' is unknown; the nearest is 'a_x'"),
    "starts and vary": ({"starts": '{ "a_x" }', "vary": "{ a_x = rd.free() }"}, "6: starts: a_x is in vary, too; remove one of them"),
    "field": ({"weights": "{}"}, "6: weights: unknown field; use one of vary, noise, sensors, starts, data, held_out"),
    "of sweeps": ({"vary": "{ c = rd.grid(1, 2, 3) }"}, "3: rd.grid: belongs to sweep files; in a fit use one of fit, free, within, pi"),
    "of models": ({"vary": "{ c = rd.sin(1) }"}, "3: rd.sin: belongs to model files; in a fit use one of fit, free, within, pi"),
    "unknown function": ({"vary": "{ c = rd.withn(1, 2) }"}, '3: rd.withn: unknown function; did you mean "within"?'),
}


@pytest.mark.parametrize("name", WRONG_FILES)
def test_wrong_fit_files(name, slide, tmp_path):
    changes, message = WRONG_FILES[name]
    slide_data(tmp_path / "d.csv", slide_rows(count=20))
    fields = {**GOOD, **changes}
    path = lua_file(tmp_path, "\n".join(f"{field} = {value}," if value else "" for field, value in fields.items()))
    done = fit(slide, path, folder=tmp_path, status=1)[1]
    assert [line for line in done.stderr.splitlines() if line.startswith(str(path))][0] == f"{path}:{message}"


def test_other_files_in_place_of_a_fit(slide, tmp_path):
    """Files that are no fit, and options that FIT.lua replaces."""
    slide_data(tmp_path / "d.csv", slide_rows(count=20))
    path = tmp_path / "fit.lua"
    for text, message in {"return 3\n": ": the file returns a number; must return rd.fit { ... }", "return {\n": ":2: unexpected symbol near <eof>",
                          'return require "refdyn".fit(3)\n': ":1: rd.fit: argument 1 is a number; must be a table, as in rd.fit { vary = ",
                          "while true do end\n": ":1: more than 100 million steps to read the fit; look for a loop without an end"}.items():
        path.write_text(text)
        assert fit(slide, path, folder=tmp_path, status=1)[1].stderr.startswith(f"{path}{message}")
    lua_file(tmp_path, "\n".join(f"{field} = {value}," for field, value in GOOD.items()))
    for more, message in {("--vary", "c"): "--vary is set by ", (tmp_path / "d.csv",): "fit.lua names the data; omit "}.items():
        assert message in fit(slide, path, *more, folder=tmp_path, status=2)[1].stderr
    assert "none.lua: cannot be read: No such file or directory" in fit(slide, tmp_path / "none.lua", folder=tmp_path, status=1)[1].stderr
    assert "--vary NAME,... is missing; add it or FIT.lua" in fit(slide, tmp_path / "d.csv", folder=tmp_path, status=2)[1].stderr
    assert "--noise COLUMN=SIGMA,... is missing; add it or FIT.lua" in fit(slide, tmp_path / "d.csv", "--vary", "c", folder=tmp_path, status=2)[1].stderr


# ---- Figures ----

def test_series(slide, tmp_path):
    """Data and model by file and column; every k-th row of many, gaps left out."""
    few = slide_data(tmp_path / "a.csv", slide_rows(count=200), keep=lambda number: number % 4)
    many = slide_data(tmp_path / "b.csv", slide_rows(count=5000, step=1e-3))
    found, _ = fit(slide, few, many, "--held-out", few, "--vary", "c", "--noise", "a_x=1e-5", "--tol", 1e-9, folder=tmp_path)
    series = found["series"]
    assert series["every"] == 3 and [(one["file"], one["held_out"]) for one in series["files"]] == [(str(few), False), (str(many), False), (str(few), True)]
    columns = [one["columns"]["a_x"] for one in series["files"]]
    assert [len(column["t"]) for column in columns] == [50, 1667, 50] and columns[0]["t"] == columns[2]["t"]
    assert columns[0]["noise"] == 1e-5 and columns[0]["unit"] == "m"
    for column in columns:
        assert all(abs(a - b) < 6e-5 for a, b in zip(column["data"], column["model"])) and len(column["model"]) == len(column["data"]) == len(column["t"])


def test_figure(slide, tmp_path):
    """Three charts for each column of each file, with bands and keys."""
    for name in ("a.csv", "b.csv"):
        slide_data(tmp_path / name, slide_rows())
    refdyn("fit", slide, tmp_path / "a.csv", tmp_path / "b.csv", "--vary", "c", "--noise", "a_x=1e-5", "-o", tmp_path / "fit.json")
    refdyn("plot", tmp_path / "fit.json", "-o", tmp_path / "fit.svg")
    text = (tmp_path / "fit.svg").read_text()
    for name in ("a.csv", "b.csv"):
        assert all(f"{title}, {tmp_path / name}"[:100] in text for title in ("a_x", "Residuals of a_x", "Autocorrelation of residuals"))
    assert text.count(">2 sigma<") == 4 and text.count(">95 %<") == 2 and text.count(">lag [rows]<") == 2 and text.count(">a_x [m]<") == 2
    assert text.count(">data - model, a_x [m]<") == 2 and "nan" not in text


def test_wrong_figures(slide, tmp_path):
    slide_data(tmp_path / "d.csv", slide_rows(count=40))
    path = tmp_path / "fit.json"
    refdyn("fit", slide, tmp_path / "d.csv", "--vary", "c", "--noise", "a_x=1e-5", "-o", path)
    out = ["-o", tmp_path / "fit.svg"]
    assert "--panel: a fit has its own panels; omit it" in refdyn("plot", path, "--panel", "path", *out, status=2).stderr
    assert "--units: a fit has its own units; omit it" in refdyn("plot", path, "--units", path, *out, status=2).stderr
    assert f"{path}: a fit must be the only operand" in refdyn("plot", path, path, *out, status=2).stderr
    for text, message in {'{"values": {}}': "fit: no object 'series' with files; give a FIT.json of refdyn fit", "[": "fit: ",
                          '{"series": {"every": 1, "files": [{"file": "a", "columns": {"x": {"noise": 1, "t": [0, 1], "data": [0], "model": [0, 1]}}}]}}': "fit: no object"}.items():
        path.write_text(text)
        assert f"{path}:1: {message}" in refdyn("plot", path, *out, status=1).stderr
