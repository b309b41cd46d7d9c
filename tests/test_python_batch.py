"""Batches from Python: cases as dictionaries, data frames, grids and samples; what is kept; failed cases; progress; wrong calls."""
import io
import json
import pickle
import re
import subprocess
import sys
import warnings

import numpy as np
import pytest

from program import BUILD, REFERENCE, refdyn
from python_package import package, same  # noqa: F401 (a fixture)

pytest.importorskip("h5py")
BALL = '''local rd = require "refdyn"
local p = rd.parameters { { "m", 2, "kg" }, { "k", 30, "N/m" } }
local shape, heavy = rd.option("shape", "round", { "round", "flat" }), rd.option("heavy", false)
local f = rd.input("f", 0.5, "N")
return rd.model { name = "ball", gravity = { 0, 0, -9.81 }, points = { B = "ball" },
  links = { { "ball", joint = "x, z", mass = heavy and 2 * p.m or p.m, spring = { x = p.k }, start = { z = 1 }, start_rate = { x = 0.3 } } },
  forces = function(s) return { ball_x = f + (shape == "flat" and 0.1 or 0) } end }
'''


@pytest.fixture(scope="module")
def ball(package):
    return package.Model.from_text(BALL)


def test_what_is_kept(ball):
    """Every kind, against the motions one by one."""
    cases = {"m": [1.7, 2.9], "ball_x": [0.11, -0.2]}
    runs = ball.batch(cases, 0.4, keep={"final": True, "at": [0.1, 0.3], "extremes": "B_x", "norms": ["ball_x_d"], "history": ["B_x", "B_z"]}, every=0.05, lanes=1, tol=1e-8)
    assert runs.B_x_history.dims == ("case", "t") and runs.B_z_at.dims == ("case", "t_at") and same(runs.t_at, [0.1, 0.3]) and same(runs.t, np.arange(9) * 0.05)
    for case in range(2):
        one = ball.simulate(0.4, tol=1e-8, every=0.05, q=[cases["ball_x"][case], 1], qd=[0.3, 0], parameters={"m": cases["m"][case]})
        assert np.allclose(runs.B_x_history[case], one.B_x, rtol=1e-9) and np.allclose(runs.B_z_at[case], one.B_z.sel(t=[0.1, 0.3], method="nearest"), rtol=1e-7)
        assert np.isclose(runs.B_x_max[case], one.B_x.max()) and np.isclose(runs.ball_x[case], one.ball_x[-1]) and 0 < runs.ball_x_d_rms[case] < 2
    assert "B_x_max" not in ball.batch(cases, 0.1) and "B_x" not in ball.batch(cases, 0.1, keep={"history": "B_z"})


def test_a_table_and_keep_change_no_number(ball, tmp_path):
    """The program computes the same from a table on the command line."""
    columns = {"m": [1.25, 0.1 + 0.2], "f": [np.pi, -1e-7]}
    (tmp_path / "ball.lua").write_text(BALL)
    (tmp_path / "cases.csv").write_text("m,f\n" + "".join(f"{m!r},{f!r}\n" for m, f in zip(*columns.values())))
    refdyn("batch", "ball.lua", "--table", "cases.csv", "--until", "0.3", "-o", "runs.csv", cwd=tmp_path)
    header, *rows = [line.split(",") for line in (tmp_path / "runs.csv").read_text().splitlines()]
    runs = ball.batch(columns, 0.3, keep={"final": True})
    for name in ("ball_x", "B_z"):
        assert same(runs[name], [float(row[header.index(name)]) for row in rows])


def test_grids(package, ball):
    """The axes are dimensions in the order of the call; text and truth values, starts, and axes that share a name with a result."""
    grid = package.grid(m=[1.5, 2.5, 3.5], shape=["round", "flat"], ball_x=[0.1, 0.2])
    assert pickle.loads(pickle.dumps(grid)).axes.keys() == grid.axes.keys() and pickle.loads(pickle.dumps(package.normal(1, 2))) == package.normal(1, 2)
    assert repr(grid) == "<refdyn grid of 3 m x 2 shape x 2 ball_x>" and list(grid) == ["m", "shape", "ball_x"] and grid["ball_x"].tolist() == [0.1, 0.2] * 6
    runs = ball.batch(grid, 0.2, keep={"final": True, "history": ["B_x"]}, every=0.1)
    assert runs.ball_x.dims == ("m", "shape", "ball_x_start") and runs.ball_x.shape == (3, 2, 2) and runs.B_x_history.dims == ("m", "shape", "ball_x_start", "t")
    assert same(runs.m, [1.5, 2.5, 3.5]) and runs["shape"].values.tolist() == ["round", "flat"] and same(runs.ball_x_start, [0.1, 0.2]) and runs.m.units == "kg"
    listed = ball.batch(dict(grid), 0.2)
    assert same(runs.ball_x.values.ravel(), listed.ball_x) and same(runs.case.values.ravel(), listed.case)
    one = ball.batch({"m": [2.5], "shape": ["flat"], "ball_x": [0.2]}, 0.2)
    assert np.isclose(float(runs.sel(m=2.5, shape="flat", ball_x_start=0.2).ball_x), float(one.ball_x[0]), rtol=1e-12)
    assert ball.batch(package.grid({"heavy": [True, False]}), 0.1).heavy.values.tolist() == [True, False]


def test_names_of_results_are_names_of_cases(package, ball):
    """A column x_start is the start value of x, in dictionaries, data frames and grids."""
    expected = ball.batch({"ball_x": [0.13, 0.27], "ball_x_d": [0.4, -0.1], "f": 0.8}, 0.1)
    found = ball.batch({"ball_x_start": [0.13, 0.27], "ball_x_d_start": [0.4, -0.1], "f": 0.8}, 0.1)
    assert found.drop_vars("cpu_s").equals(expected.drop_vars("cpu_s")) and same(found.ball_x_start, [0.13, 0.27]) and same(found.f, [0.8, 0.8])
    grid = ball.batch(package.grid(ball_x_start=[0.13, 0.27], m=[1.5, 2.5]), 0.1)
    assert grid.ball_x.dims == ("ball_x_start", "m") and same(grid.ball_x, ball.batch(package.grid(ball_x=[0.13, 0.27], m=[1.5, 2.5]), 0.1).ball_x)
    named = package.Model.from_text(BALL.replace('{ "k", 30, "N/m" }', '{ "ball_x_start", 30, "N/m" }').replace("p.k", "p.ball_x_start"))
    runs = named.batch({"ball_x_start": [20, 40]}, 0.1)
    assert same(runs.ball_x_start, [20, 40]) and (runs.ball_x < 1).all(), "a parameter of this name keeps it"


def test_data_frames(ball):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"m": [1.5, 2.5], "shape": ["flat", "round"]}, index=["a", "b"])
    runs = ball.batch(frame, 0.1)
    assert same(runs.ball_x, ball.batch({"m": [1.5, 2.5], "shape": ["flat", "round"]}, 0.1).ball_x) and runs["shape"].values.tolist() == ["flat", "round"]
    assert runs.to_dataframe().shape[0] == 2


def test_index_of_a_data_frame(package, ball, tmp_path):
    """`case` has the index, unless it only counts the rows or has several levels; warnings name cases by it."""
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    frame = pandas.DataFrame({"m": [1.5, -2.5, 3.5, -4.5], "f": [0.1, 0.2, 0.3, 0.4]})
    assert same(ball.batch(frame[:1], 0.1).case, [0]) and same(ball.batch(frame[frame.m > 0], 0.1).case, [0, 2])
    named = frame.set_index(pandas.Index(["a", "b", "c", "d"], name="run"))
    with pytest.warns(package.ModelWarning) as told:
        runs = ball.batch(named, 0.1)
    assert runs.case.values.tolist() == ["a", "b", "c", "d"] and runs.case.attrs == {"long_name": "run"} and runs.ball_x.dims == ("case",)
    assert same(runs.ball_x.sel(case="c"), ball.batch({"m": 3.5, "f": 0.3}, 0.1).ball_x[0])
    assert str(told[0].message).splitlines()[1] == "  case 'b' and 1 other: <text>:6: links[1].mass: value -2.5; must be positive"
    runs.to_netcdf(tmp_path / "runs.nc")
    assert xarray.open_dataset(tmp_path / "runs.nc").case.values.tolist() == ["a", "b", "c", "d"]
    columns = {name: named[name][["a", "c"]] for name in named}
    assert ball.batch({**columns, "k": 20.0}, 0.1).case.values.tolist() == ["a", "c"]
    several = frame[::2].set_index(pandas.MultiIndex.from_tuples([(1, "x"), (2, "y")]))
    assert same(ball.batch(several, 0.1).case, [0, 1])
    days = ball.batch(frame[::2].set_index(pandas.to_datetime(["2026-01-05", "2026-02-03"])), 0.1)
    assert str(days.case.values[1])[:10] == "2026-02-03"


def test_cases_without_a_number(package, ball):
    """NaN, None, a missing value of pandas and infinity fail their case alone; the numbers of the others are those of a batch without them."""
    pandas = pytest.importorskip("pandas")
    for missing in (np.nan, None, pandas.NA):
        with pytest.warns(package.ModelWarning) as told:
            runs = ball.batch({"m": [1.5, missing, 2.5, np.inf], "ball_x_d": [0.1, 0.2, missing, 0.4]}, 0.1)
        assert runs.status.values.tolist() == [0, 1, 1, 1] and str(told[0].message) == "\n".join([
            "3 of 4 cases failed; see `status` and `reason` of the dataset:", "  case 1: m: value nan; must be finite", "  case 2: ball_x_d: value nan; must be finite",
            "  case 3: m: value inf; must be finite"])
        assert np.isclose(runs.ball_x[0], ball.batch({"m": 1.5, "ball_x_d": 0.1}, 0.1).ball_x[0], rtol=1e-12) and np.isnan(runs.ball_x[1:]).all()
    with pytest.warns(package.ModelWarning, match="  case 3 and 2 others: m: value nan; must be finite"):
        grid = ball.batch(package.grid(m=[2, np.nan], f=[1, 2, 3]), 0.1)
    assert grid.status.values.tolist() == [[0] * 3, [1] * 3] and np.isnan(grid.m[1])


def test_the_start_decides_about_anchored_parameters(package):
    """NaN of an anchored parameter leaves it to the start, as in the arrays of parameters of other calls."""
    arm = package.Model(REFERENCE, n_rfe=1)
    runs = arm.batch({"xc": [0.31, np.nan], "m_E": [1.2, 1.4]}, 0.05, lanes=1)
    assert runs.status.values.tolist() == [0, 0] and np.isnan(runs.xc[1])
    assert same(runs.E_z[1], arm.batch({"m_E": 1.4}, 0.05, lanes=1).E_z[0]) and float(runs.E_x[0]) != float(runs.E_x[1])


def test_whole_numbers_as_floats(package):
    """pandas stores whole numbers as floats in a data frame that has gaps in other rows."""
    arm = package.Model(REFERENCE)
    runs = arm.batch({"n_rfe": [1.0, 2.0]}, 0.01)
    assert runs.n_rfe.values.tolist() == [1, 2] and runs.n_rfe.dtype.kind == "i"


def test_data_frames_of_start_values(ball):
    """Columns may have the names of a result, so that its data frame can serve as a table of cases."""
    pandas = pytest.importorskip("pandas")
    columns = {"m": [1.5, 2.5, 3.5], "ball_x": [0.13, 0.27, 0.31], "ball_x_d": [0.7, -0.2, 0.4]}
    expected = ball.batch(columns, 0.1)
    frame = pandas.DataFrame({"m": columns["m"], "ball_x_start": columns["ball_x"], "ball_x_d_start": columns["ball_x_d"]}, index=["a", "b", "c"])
    first = ball.batch(frame, 0.1)
    again = ball.batch(first[["m", "ball_x_start", "ball_x_d_start"]].to_dataframe(), 0.1)
    assert first.case.values.tolist() == again.case.values.tolist() == ["a", "b", "c"]
    for runs in (first, again):
        assert runs.drop_vars(["cpu_s", "case"]).equals(expected.drop_vars(["cpu_s", "case"])) and same(runs.ball_x_d_start, columns["ball_x_d"])
    with pytest.raises(ValueError, match="cases: ball_x_start and ball_x are the same start value; give one of them"):
        ball.batch(frame.assign(ball_x=0.2), 0.1)


def test_files_of_inputs(ball, tmp_path, monkeypatch):
    """Their names are relative to the folder of the caller."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "low.csv").write_text("t,f\n0,0\n0.1,2\n")
    assert same(ball.batch({"inputs": ["low.csv"], "m": [2]}, 0.2, tol=1e-8).ball_x[0], ball.simulate(0.2, every=0.2, tol=1e-8, inputs={"t": [0, 0.1], "f": [0, 2]}).ball_x[-1])


# ---- Samples ----

def drawn(fields, tmp_path):
    """The values that a sweep file draws."""
    (tmp_path / "ball.lua").write_text(BALL)
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { t_end = 1, ' + fields + " }\n")
    done = subprocess.run([BUILD / "bin" / "sweep_cases", "ball.lua", "sweep.lua"], cwd=tmp_path, capture_output=True, text=True, check=True)
    return {name: column["values"] for name, column in json.loads(done.stdout)["columns"].items()}


@pytest.mark.parametrize("seed", [0, 7, 2**40 + 3])
def test_random_numbers_are_those_of_sweeps(package, tmp_path, seed):
    """To the bit, in the middle and in the tails of the distributions."""
    fields = f"vary = {{ m = rd.normal(2.5, 0.25), k = rd.log_uniform(1e-3, 1e5), f = rd.uniform(-0.3, 0.7), ball_x = rd.normal(-1e-3, 7) }}, draws = 20000, seed = {seed}"
    found = package.sample(20000, {"f": package.uniform(-0.3, 0.7)}, m=package.normal(2.5, 0.25), k=package.log_uniform(1e-3, 1e5), ball_x=package.normal(-1e-3, 7), seed=seed)
    expected = drawn(fields, tmp_path)
    assert list(found) == ["f", "m", "k", "ball_x"] and all(same(found[name], expected[name]) for name in found)
    assert abs(found["ball_x"].std() / 7 - 1) < 0.03 and abs(np.median(found["k"]) / 10 - 1) < 0.2


def test_halton_is_that_of_sweeps(package, tmp_path):
    """To the bit, for several primes, without SciPy; the seed shifts each name."""
    fields = "vary = { m = rd.normal(2.5, 0.25), k = rd.log_uniform(1e-3, 1e5), f = rd.uniform(-0.3, 0.7), ball_x = rd.uniform(-1e-3, 7) }, sequence = 'halton', draws = 3000, seed = %d"
    for seed in (0, 7):
        found = package.sample(3000, {"f": package.uniform(-0.3, 0.7)}, m=package.normal(2.5, 0.25), k=package.log_uniform(1e-3, 1e5), ball_x=package.uniform(-1e-3, 7),
                               seed=seed, sequence="halton")
        expected = drawn(fields % seed, tmp_path)
        assert all(same(found[name], expected[name]) for name in found) and abs(found["f"].mean() - 0.2) < 1e-3


def test_far_tails(package):
    """Against values of the normal quantile with 20 digits."""
    from refdyn.sampling import normal_quantile
    mpmath = pytest.importorskip("mpmath")
    u = np.array([2.0**-54, 1e-12, 1e-5, 0.0749, 0.3, 0.5, 0.93, 1 - 1e-10])
    with mpmath.workdps(40):
        exact = [float(mpmath.sqrt(2) * mpmath.erfinv(2 * mpmath.mpf(value) - 1)) for value in u.tolist()]
    assert np.allclose(normal_quantile(u), exact, rtol=3e-15, atol=0)


def test_sobol(package, monkeypatch):
    """Reproducible, even in each dimension, shifted by the seed; a clear message without SciPy."""
    pytest.importorskip("scipy")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw = lambda count, **more: package.sample(count, sequence="sobol", a=package.uniform(0, 1), b=package.uniform(2, 3), c=package.normal(0, 1), **more)
        first = draw(64)
        for name, begin in (("a", 0), ("b", 2)):
            assert (np.histogram(first[name] - begin, 16, (0, 1))[0] >= 3).all() and np.ptp(np.diff(np.sort(first[name]))) < 1e-9
    assert all(same(first[name], draw(64)[name]) and same(first[name][:50], draw(50)[name]) for name in first)
    moved = (draw(64, seed=5)["a"] - first["a"]) % 1
    assert np.ptp(moved) < 1e-12 and moved[0] > 1e-3 and abs(first["c"].mean()) < 0.05
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    with pytest.raises(ImportError, match='sample: sequence="sobol" needs SciPy; install it with pip install scipy'):
        draw(4)


def test_samples_are_cases(package, ball):
    cases = package.sample(6, seed=3, m=package.uniform(1, 2), ball_x_d=package.normal(0, 0.1))
    assert same(ball.batch(cases, 0.1).m, cases["m"]) and repr(package.normal(1, 2)) == "refdyn.normal(1.0, 2.0)"


# ---- Failed cases, progress ----

def test_failed_cases(package, ball):
    """One warning with the number and the reasons; it points to the call."""
    with pytest.warns(package.ModelWarning) as told:
        runs = ball.batch({"m": [1, -2, 3, -4, 5], "k": [1, 1, 1, 1, 1]}, 0.1)
    assert len(told) == 1 and told[0].filename == __file__ and runs.status.values.tolist() == [0, 1, 0, 1, 0]
    text = str(told[0].message)
    assert text == "2 of 5 cases failed; see `status` and `reason` of the dataset:\n  case 1 and 1 other: <text>:6: links[1].mass: value -2; must be positive", text
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ball.batch({"m": [1, 2]}, 0.1)


def test_progress(ball, monkeypatch):
    """A bar on sys.stderr, which is not a terminal; without `progress` nothing is written."""
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    assert ball.batch({"m": np.linspace(1, 2, 3000)}, 60, tol=1e-11, threads=1, lanes=1, keep={"final": True}, progress=True).sizes["case"] == 3000
    bars = re.findall(r"\r(\d+) of 3000 cases, \d+/s, 0 failed \[#* *\] +\d+ %, \d+ s left \033\[K", stream.getvalue())
    assert bars and stream.getvalue().endswith("\r\033[K") and not re.search("warning|time  ", stream.getvalue())
    stream.truncate(0)
    ball.batch({"m": [1, 2]}, 0.1)
    assert not stream.getvalue().strip("\0")


# ---- Words ----

def test_commands_in_messages_are_calls(package):
    from refdyn.wording import of_python
    for text, expected in (("`refdyn sim` of one case", "`arm.simulate` of one case"), ("the growing modes were counted; refdyn modes shows them", "the growing modes were counted; arm.modes shows them"),
                           ("convert a URDF file by `refdyn import`", "convert a URDF file by `refdyn.Model.from_urdf`"), ("usage: refdyn batch MODEL.lua", "usage: refdyn batch MODEL.lua"),
                           ("/tmp/refdyn sim/a.lua", "/tmp/refdyn sim/a.lua"),
                           ("--set spare: nothing that this command computes reads it", "spare: nothing that this call computes reads it")):
        assert of_python(text) == expected


# ---- Wrong calls ----

WRONG = {
    "cases: no column; add values of at least one name": (ValueError, lambda ball: ball.batch({}, 1)),
    "cases: float; must be columns by name, {'NAME': values}, a data frame or refdyn.grid(NAME=values)": (TypeError, lambda ball: ball.batch(3.0, 1)),
    "batch: t_end is missing; add the end of the motions [s]": (TypeError, lambda ball: ball.batch({"m": [1]})),
    "keep: 'histroy' is not one of final, at, extremes, norms, history, derivatives, limits; did you mean 'history'?": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"histroy": "B_x"})),
    "keep: list; must be a dictionary with final, at, extremes, norms, history, derivatives, limits": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, keep=["B_x"])),
    "inputs: not an argument of batch; give its values as columns: cases={'f': 1.5}": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, inputs={"f": 1.5})),
    "parameters: not an argument of batch; give its values as columns: cases={'NAME': 1.0}": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, parameters=[2])),
    "qd: not an argument of batch; give its values as columns: cases={'ball_x_d': 0.1}": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, qd=[0, 0])),
    "cases: ball_x and ball_x_start are the same start value; give one of them": (ValueError, lambda ball: ball.batch({"ball_x": [1], "ball_x_start": [1]}, 1)),
    "keep.history: a motion has no column 'B_q'; did you mean 'B_x'?": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"history": ["B_q"]})),
    "keep: at[1]: time 0.1; times must ascend and not be negative": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"at": [0.2, 0.1]})),
    "keep: at[0]: time 3; must not be after t_end, 1": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"at": 3})),
    "keep: at: values of <U1; must be real numbers": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, keep={"at": "a"})),
    "keep: keeps nothing; add 'final': True or names of columns, 'history': ['NAME']": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"final": False, "at": []})),
    "keep: final: ['B_x']; must be True or False": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, keep={"final": ["B_x"]})),
    "keep: history: 3; must be a text or a list of texts": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, keep={"history": 3})),
    "keep: at: contains nan; all numbers must be finite": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"at": [np.nan]})),
    "keep: at: has shape (1, 2); must be one time or a row of times": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, keep={"at": [[0.1, 0.2]]})),
    "history: not an argument of batch; use keep={'history': ['B_x']}": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, history=["B_x"])),
    "sweep: given together with cases; give one of them": (ValueError, lambda ball: ball.batch({"m": [1]}, 1, sweep="sweep.lua")),
    "sweep: an empty text; must be the name of a sweep file": (ValueError, lambda ball: ball.batch(sweep="")),
    "sweep: dict; must be the name of a sweep file": (TypeError, lambda ball: ball.batch(sweep={"m": [1]})),
    "t_end: 2 values; must be one number": (ValueError, lambda ball: ball.batch({"m": [1]}, [1, 2])),
    "inputs: not an argument of batch; write samples along t to files, whose names form a column: cases={'inputs': ['a.csv', 'b.csv']}":
        (TypeError, lambda ball: ball.batch({"m": [1]}, 1, inputs={"t": [0, 1], "f": [1, 2]})),
    "cases: column 't'; write samples along t to files, whose names form a column: cases={'inputs': ['a.csv', 'b.csv']}": (ValueError, lambda ball: ball.batch({"t": [0, 1], "f": [1, 2]}, 1)),
    "cases: m and f have different indexes; use pandas.DataFrame(cases), which aligns them": (ValueError, lambda ball: ball.batch(
        {"m": sys.modules["pandas"].Series([1, 2], index=["a", "b"]), "f": sys.modules["pandas"].Series([3, 4], index=["b", "a"])}, 1)),
    "grid: f is given twice; give it once": (TypeError, lambda ball: sys.modules["refdyn"].grid({"f": [1, 2]}, f=[3])),
    "sample: f is given twice; give it once": (TypeError, lambda ball: sys.modules["refdyn"].sample(3, {"f": sys.modules["refdyn"].normal(0, 1)}, f=sys.modules["refdyn"].normal(0, 2))),
    "view: the run: ball_x contains values that are not finite; leave out these rows or this variable": (ValueError, lambda ball: ball.view(ball.simulate(0.1).where(lambda run: run.t < 0.05))),
    "inputs: dict; must be names of files with samples along t": (TypeError, lambda ball: ball.batch({"inputs": {"t": [0], "f": [1]}}, 1)),
    "inputs: float; must be names of files with samples along t": (TypeError, lambda ball: ball.batch({"inputs": ["none.csv", np.nan]}, 1)),
    "m: has shape (2, 2); must be one value or a row of values": (ValueError, lambda ball: ball.batch({"m": np.ones((2, 2))}, 1)),
    "m: has no values; must have at least one": (ValueError, lambda ball: ball.batch({"m": [], "f": 1}, 1)),
    "m: set; must be one value or a row of values": (TypeError, lambda ball: ball.batch({"m": {1, 2}}, 1)),
    "m: refdyn.normal(2.0, 0.1); must be one value or a row of values; refdyn.sample draws random ones": (TypeError, lambda ball: ball.batch({"m": sys.modules["refdyn"].normal(2, 0.1)}, 1)),
    "m: values of datetime64[ns]; must be real numbers, texts or truth values": (TypeError, lambda ball: ball.batch({"m": np.array(["2026-01-05"], "M8[ns]")}, 1)),
    "shape: case 1 has no value; an option needs one in each case": (ValueError, lambda ball: ball.batch({"shape": ["round", np.nan]}, 1)),
    "heavy: case 2 has no value; an option needs one in each case": (ValueError, lambda ball: ball.batch({"heavy": [True, False, None]}, 1)),
    "cases: column 'm,k'; a name has only letters, digits and underscores": (ValueError, lambda ball: ball.batch({"m,k": [1]}, 1)),
    "cases: two columns are called 'm'; each needs its own name": (ValueError, lambda ball: ball.batch(sys.modules["pandas"].DataFrame([[1, 2], [3, 4]], columns=["m", "m"]), 1)),
    "keep: the sweep file defines what is kept; write it there": (ValueError, lambda ball: ball.batch(sweep="sweep.lua", keep={"final": True})),
    "cases: column 0; the names of columns must be texts": (TypeError, lambda ball: ball.batch({0: [1.0, 2.0]}, 1)),
    "m: rows of different lengths; must be a row of values": (ValueError, lambda ball: ball.batch({"m": [1, [2]]}, 1)),
    "cases: mm: unknown name; did you mean 'm'?": (ValueError, lambda ball: ball.batch({"mm": [1]}, 1)),
    "batch() got an unexpected keyword argument 'thread'; did you mean 'threads'?": (TypeError, lambda ball: ball.batch({"m": [1]}, 1, thread=2)),
    "simulate() got an unexpected keyword argument 'stepp'; did you mean 'step'?": (TypeError, lambda ball: ball.simulate(1, stepp=1e-3)),
    "f: has shape (2, 2); must be one value or a row of values": (ValueError, lambda ball: sys.modules["refdyn"].grid(f=[[1, 2], [3, 4]])),
    "f: rows of different lengths; must be a row of values": (ValueError, lambda ball: sys.modules["refdyn"].grid(f=[1, [2]])),
    "f: has masked values; each case needs a value": (TypeError, lambda ball: sys.modules["refdyn"].grid(f=np.ma.array([1, 2], mask=[0, 1]))),
    "grid: list; must be values by name, m_E=[1, 2]": (TypeError, lambda ball: sys.modules["refdyn"].grid([1, 2])),
    "sample: list; must be distributions by name, E=refdyn.normal(2.1e11, 2e9)": (TypeError, lambda ball: sys.modules["refdyn"].sample(3, ["m"])),
    "sample: name 1; must be a text": (TypeError, lambda ball: sys.modules["refdyn"].sample(3, {1: sys.modules["refdyn"].normal(0, 1)})),
    "sead: int; must be refdyn.normal, refdyn.uniform or refdyn.log_uniform; did you mean the keyword 'seed'?": (TypeError, lambda ball: sys.modules["refdyn"].sample(3, sead=1)),
    "grid: no name; add values of at least one, m_E=[1, 2]": (ValueError, lambda ball: sys.modules["refdyn"].grid()),
    "sample: count: float; must be a whole number": (TypeError, lambda ball: sys.modules["refdyn"].sample(3.5)),
    "sample: count: value 0; must be a positive whole number": (ValueError, lambda ball: sys.modules["refdyn"].sample(0)),
    "sample: seed: value -1; must be a whole number and not negative": (ValueError, lambda ball: sys.modules["refdyn"].sample(1, seed=-1)),
    "sample: no name; add at least one, E=refdyn.normal(2.1e11, 2e9)": (ValueError, lambda ball: sys.modules["refdyn"].sample(1)),
    "sequence: 'sobal' is not one of random, sobol, halton; did you mean 'sobol'?": (ValueError, lambda ball: sys.modules["refdyn"].sample(1, sequence="sobal")),
    "m: tuple; must be refdyn.normal, refdyn.uniform or refdyn.log_uniform": (TypeError, lambda ball: sys.modules["refdyn"].sample(1, m=(1, 2))),
    "uniform: from 2 to 1; the range must ascend": (ValueError, lambda ball: sys.modules["refdyn"].uniform(2, 1)),
    "log_uniform: from -1; bounds must be positive": (ValueError, lambda ball: sys.modules["refdyn"].log_uniform(-1, 1)),
    "normal: standard deviation -1; must not be negative": (ValueError, lambda ball: sys.modules["refdyn"].normal(0, -1)),
    "normal: mean: 1e+301; must not be beyond 1e+300": (ValueError, lambda ball: sys.modules["refdyn"].normal(1e301, 1)),
    "normal: mean: nan; must be finite": (ValueError, lambda ball: sys.modules["refdyn"].normal(np.nan, 1)),
    "log_uniform: to: inf; must be finite": (ValueError, lambda ball: sys.modules["refdyn"].log_uniform(1, np.inf)),
    "mm: unknown option, parameter or input; did you mean 'm'?": (ValueError, lambda ball: type(ball).from_text(BALL, mm=2)),
    "shape: value \"oval\"; must be one of round, flat": (ValueError, lambda ball: type(ball).from_text(BALL, shape="oval")),
    "view: run '7': int; must be a dataset of arm.simulate": (TypeError, lambda ball: ball.view({"7": 7})),
    "view: the run has no ball_x; must have all coordinates, as a dataset of arm.simulate does": (ValueError, lambda ball: ball.view(ball.simulate(0.1)[["B_x"]])),
    "view: int; must be a dataset of arm.simulate, or several by name or in a list": (TypeError, lambda ball: ball.view(3, "ball.html")),
    "view: run 1: int; its name must be a text": (TypeError, lambda ball: ball.view({1: ball.simulate(0.1)})),
    "view: columns by name; must be a dataset of arm.simulate, without dataset=False": (TypeError, lambda ball: ball.view(ball.simulate(0.1, dataset=False))),
    "file: 'ball.pdf' must end in .html or .htm": (ValueError, lambda ball: ball.view(ball.simulate(0.1), "ball.pdf")),
    "file: 'live.csv' must end in .html or .htm": (ValueError, lambda ball: ball.live("live.csv")),
    "file: an empty text; must be the name of a page, 'arm.html'": (ValueError, lambda ball: ball.view(ball.simulate(0.1), "")),
    "file: int; must be the name of a page, 'arm.html'": (TypeError, lambda ball: ball.view(ball.simulate(0.1), 3)),
    "height: 'tall'; must be a positive whole number of pixels": (ValueError, lambda ball: ball.view(ball.simulate(0.1), height="tall")),
    "/no/ball.html: output: cannot be written: No such file or directory": (None, lambda ball: ball.view(ball.simulate(0.1), "/no/ball.html")),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_calls(ball, message):
    kind, call = WRONG[message]
    with pytest.raises(kind or sys.modules["refdyn"].ModelError) as told:
        call(ball)
    assert str(told.value) == message or str(told.value).startswith(message + ":"), str(told.value)
