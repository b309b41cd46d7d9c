"""Sweep files and tables of cases: their cases, refusals and their messages, random numbers."""
import json
import math
import os
import re
import subprocess

import pytest

from program import BUILD, REFERENCE, SOURCE

CASES = (BUILD / "bin" / "sweep_cases").resolve()

MODEL = """
local rd = require "refdyn"
local n = rd.option("n_rfe", 2, { from = 1, to = 20 })
local shape = rd.option("shape", "round", { "round", "flat" })
local heavy = rd.option("heavy", false)
local m = rd.parameter("mass", heavy and 2 or 1, "kg")
local b = rd.parameter("both", 1)
local E = rd.parameter("E", 2.1e11, "Pa")
local F, both = rd.input("F", 0, "N"), rd.input("both", 0, "N")
return rd.model { name = "swept", gravity = { 0, 0, -9.81 },
  links = { { "cart", joint = { "x" }, mass = m },
            { "arm", on = "cart", joint = { "theta" },
              beam = { length = 1, section = rd.round(0.01), E = E, nu = 0.3, rho = 7800, rfe = n } } },
  points = { tip = "arm.tip" },
  forces = function(s) return { cart_x = s.inputs.F } end }
"""


@pytest.fixture()
def folder(tmp_path):
    (tmp_path / "model.lua").write_text(MODEL)
    return tmp_path


def call(folder, text, *arguments, name="sweep.lua"):
    (folder / name).write_text(text)
    return subprocess.run([CASES, "model.lua", name, *arguments], cwd=folder, capture_output=True, text=True, timeout=120)


def sweep_text(fields, t_end=True):
    return 'local rd = require "refdyn"\nreturn rd.sweep {\n' + fields + (",\nt_end = 1" if t_end else "") + "\n}\n"


def read(folder, fields, *arguments, t_end=True):
    done = call(folder, sweep_text(fields, t_end), *arguments)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return json.loads(done.stdout)


def values(result, name):
    return result["columns"][name]["values"]


def refusals(folder, text, *arguments, name="sweep.lua"):
    done = call(folder, text, *arguments, name=name)
    assert done.returncode == 1, (done.returncode, done.stdout, done.stderr)
    assert done.stdout == ""
    return done.stderr.splitlines()


def needs_gsl(folder):
    """Passes in a build without GSL if that build says so."""
    done = call(folder, sweep_text("vary = { mass = rd.uniform(0, 1) }, draws = 2, sequence = 'sobol'"))
    if done.returncode:
        assert done.stderr == "sweep.lua:2: sequence: sobol needs GSL; build refdyn with it\n"
        pytest.skip("built without GSL")


# ---- Cases ----

def test_grids_and_lists_are_crossed_in_the_order_of_names(folder):
    result = read(folder, "vary = { n_rfe = { 2, 4 }, mass = rd.grid(1, 3, 3), E = { 1e11, 2e11 }, arm_theta = 0.5 }")
    assert result["count"] == 12
    assert list(result["columns"]) == ["E", "arm_theta", "mass", "n_rfe"]
    assert values(result, "E") == [1e11] * 6 + [2e11] * 6
    assert values(result, "arm_theta") == [0.5] * 12
    assert values(result, "mass") == [1, 1, 2, 2, 3, 3] * 2
    assert values(result, "n_rfe") == ["2", "4"] * 6


def test_what_names_are(folder):
    (folder / "calm.csv").write_text("t,F\n0,1\n")
    result = read(folder, 'vary = { n_rfe = rd.grid(1, 3, 3), heavy = { true, false }, shape = { "flat" }, mass = 1, F = 2, '
                          'cart_x = 3, cart_x_d = 4, arm_theta = 5, arm_theta_d = 6, inputs = { "calm.csv" } }')
    found = {name: (column["kind"], column["target"], column["unit"]) for name, column in result["columns"].items()}
    assert found == {"n_rfe": ("option", "n_rfe", ""), "heavy": ("option", "heavy", ""), "shape": ("option", "shape", ""),
                     "mass": ("parameter", "mass", "kg"), "F": ("input", "F", "N"), "cart_x": ("coordinate", "cart_x", "m"),
                     "cart_x_d": ("rate", "cart_x", "m/s"), "arm_theta": ("coordinate", "arm_theta", "rad"),
                     "arm_theta_d": ("rate", "arm_theta", "rad/s"), "inputs": ("samples", "inputs", "")}
    assert set(values(result, "heavy")) == {"true", "false"} and result["columns"]["n_rfe"]["texts"] == 3


def test_files_of_samples_are_beside_the_sweep(folder):
    (folder / "deep").mkdir()
    (folder / "deep" / "calm.csv").write_text("t,F\n0,1\n")
    done = call(folder, sweep_text('vary = { inputs = "calm.csv" }, from = "state.json"'), name="deep/sweep.lua")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert values(result, "inputs") == ["deep/calm.csv"] and result["options"]["from"] == "deep/state.json"


def test_names_of_other_structures(folder):
    """arm_theta_3 exists only with four elements."""
    result = read(folder, "vary = { n_rfe = { 1, 4 }, arm_theta_3 = 0.1 }")
    assert result["columns"]["arm_theta_3"]["kind"] == "coordinate"
    assert refusals(folder, sweep_text("vary = { n_rfe = { 1, 2 }, arm_theta_3 = 0.1 }")) == [
        'sweep.lua:3: arm_theta_3: unknown name; did you mean "arm_theta_1"?']


def test_the_points_of_grids(folder):
    result = read(folder, "vary = { mass = rd.grid(0.1, 0.7, 7), E = rd.log_grid(1, 1e4, 5) }")
    assert values(result, "mass")[:7] == [0.1 + (0.7 - 0.1) * (i / 6) if 0 < i < 6 else (0.1, 0.7)[i > 0] for i in range(7)]
    assert all(math.isclose(a, b, rel_tol=1e-15) for a, b in zip(values(result, "E")[::7], [1, 10, 100, 1000, 10000]))


def test_derived_values(folder):
    result = read(folder, """vary = { mass = { 1, 2 }, n_rfe = { 2, 3 } },
        derive = function(c) return { E = 1e10 * c.mass * c.n_rfe, shape = c.mass > 1 and "flat" or "round", heavy = c.n_rfe == 2 } end""")
    assert list(result["columns"]) == ["mass", "n_rfe", "E", "heavy", "shape"]
    assert values(result, "E") == [2e10, 3e10, 4e10, 6e10]
    assert values(result, "shape") == ["round", "round", "flat", "flat"]
    assert values(result, "heavy") == ["true", "false", "true", "false"]


def test_derived_files(folder):
    for name in ("a", "b"):
        (folder / f"{name}.csv").write_text("t,F\n0,1\n")
    result = read(folder, 'vary = { mass = rd.grid(1, 4, 4) }, derive = function(c) return { inputs = (c.mass > 2 and "a" or "b") .. ".csv" } end')
    assert values(result, "inputs") == ["b.csv", "b.csv", "a.csv", "a.csv"] and result["columns"]["inputs"]["texts"] == 2


def test_how_motions_run_and_what_is_kept(folder):
    result = read(folder, """vary = { mass = 1 }, tol = 1e-7, step_max = 0.5, every = 0.25, method = "rk54", from = "statics", stabilise = "project",
        singular = "pass", start = "project", hold = { "cart_x", "arm_theta" },
        release = { "guide x" }, way = "downhill",
        keep = { final = true, at = { 0.5, 1 }, extremes = { "tip_z" }, norms = "tip_x, tip_z", history = { "tip_x" } }""")
    assert result["options"] == {"until": 1, "tol": 1e-7, "step": 0, "step_max": 0.5, "every": 0.25, "method": "rk54", "from": "statics",
                                 "stabilise": "project", "singular": "pass", "start": "project", "hold": "cart_x,arm_theta",
                                 "release": "guide x", "way": "downhill"}
    assert result["keep"] == {"final": True, "at": [0.5, 1], "extremes": ["tip_z"], "norms": ["tip_x", "tip_z"], "history": ["tip_x"]}
    assert result["text"] == (folder / "sweep.lua").read_text()


def test_final_states_are_kept_where_nothing_is_said(folder):
    assert read(folder, "vary = { mass = 1 }")["keep"]["final"] is True
    assert read(folder, 'vary = { mass = 1 }, keep = { norms = "tip_x" }')["keep"]["final"] is False


# ---- Random numbers ----

def drawn(folder, form, draws=20000, more="", name="mass"):
    return values(read(folder, f"vary = {{ {name} = {form} }}, draws = {draws}{more}"), name)


UNIFORM = lambda x: (x - 2) / 5
NORMAL = lambda x: 0.5 * math.erfc((10 - x) / 3 / math.sqrt(2))
LOG_UNIFORM = lambda x: math.log(x / 1e-4) / math.log(100)
FORMS = {"rd.uniform(2, 7)": (UNIFORM, 4.5, 25 / 12), "rd.normal(10, 3)": (NORMAL, 10, 9),
         "rd.log_uniform(1e-4, 1e-2)": (LOG_UNIFORM, 0.0099 / math.log(100), (1e-4 - 1e-8) / (2 * math.log(100)) - (0.0099 / math.log(100)) ** 2)}


def largest_gap(sample, distribution):
    """Kolmogorov-Smirnov distance."""
    sample, n = sorted(sample), len(sample)
    return max(max(distribution(x) - i / n, (i + 1) / n - distribution(x)) for i, x in enumerate(sample))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("more", ["", ", seed = 7", ", sequence = 'sobol'", ", sequence = 'halton', seed = 3"])
def test_distributions(folder, form, more):
    if "sobol" in more:
        needs_gsl(folder)
    distribution, mean, variance = FORMS[form]
    sample = drawn(folder, form, more=more)
    n = len(sample)
    found = math.fsum(sample) / n
    spread = math.fsum((x - found) ** 2 for x in sample) / (n - 1)
    fourth = math.fsum((x - found) ** 4 for x in sample) / n
    assert abs(found - mean) < 4 * math.sqrt(variance / n)
    assert abs(spread - variance) < 4 * math.sqrt((fourth - variance ** 2) / n)
    assert largest_gap(sample, distribution) < 1.95 / math.sqrt(n)  # 1 in 1,000


def test_draws_are_told_by_seed_and_name_alone(folder):
    alone = drawn(folder, "rd.uniform(0, 1)", 50, ", seed = 5")
    assert alone == drawn(folder, "rd.uniform(0, 1)", 100, ", seed = 5")[:50]
    beside = read(folder, "vary = { mass = rd.uniform(0, 1), E = rd.uniform(0, 1), F = rd.normal(0, 1) }, draws = 50, seed = 5")
    assert values(beside, "mass") == alone and values(beside, "E") != alone
    assert drawn(folder, "rd.uniform(0, 1)", 50, ", seed = 6") != alone
    crossed = values(read(folder, "vary = { mass = rd.uniform(0, 1), E = { 1, 2 } }, draws = 25, seed = 5"), "mass")
    assert crossed == alone and len(set(crossed)) == 50


KNOWN = {"rd.uniform(0, 1)": ['0x1.c0ffbf6adca78p-4', '0x1.2957e355f24a2p-2', '0x1.0a3f3e0e5dd83p-1'],
         "rd.normal(0, 1)": ['-0x1.3a82bcadedd61p+0', '-0x1.1ac5f3605af66p-1', '0x1.9b2410fa942ccp-5'],
         "rd.log_uniform(1, 100)": ['0x1.a81bf9219d85dp+0', '0x1.e77b67812646dp+1', '0x1.5ee52ea851bf8p+3']}


@pytest.mark.parametrize("form", KNOWN)
def test_draws_stay_what_they_are(folder, form):
    """The first numbers, to the bit: other machines and later versions draw the same."""
    assert [x.hex() for x in drawn(folder, form, 3, ", seed = 1")] == KNOWN[form]


def test_philox_gives_the_published_numbers():
    """Random123, kat_vectors: philox4x32 10."""
    out = subprocess.run([CASES, "philox"], capture_output=True, text=True, check=True).stdout
    assert out.split("\n")[:3] == ["6627e8d5 e169c58d bc57ac4c 9b00dbd8", "408f276d 41c83b0e a20bc7c6 6d5451fd", "d16cfe09 94fdcceb 5001e420 24126ea1"]


def test_quantile_logarithm_and_exponential():
    given = [i / 1000 for i in range(1, 1000)] + [10.0 ** -k for k in range(4, 17)] + [1 - 10.0 ** -k for k in range(4, 16)]
    out = subprocess.run([CASES, "numbers"], input="\n".join(map(repr, given)), capture_output=True, text=True, check=True).stdout
    for u, line in zip(given, out.splitlines(), strict=True):
        quantile, logarithm, exponential = map(float, line.split())
        tail = 0.5 * math.erfc(abs(quantile) / math.sqrt(2))
        assert math.isclose(tail, min(u, 1 - u), rel_tol=1e-14 * (1 + quantile ** 2)) and (quantile > 0) == (u > 0.5)
        assert abs(logarithm - math.log(u)) <= 2 * math.ulp(math.log(u))
        assert math.isclose(exponential, math.exp(100 * u - 50), rel_tol=4e-16)


def star_discrepancy(x, y):
    """The largest discrepancy over boxes with a corner at a point, which is a sufficient approximation."""
    n = len(x)
    return max(abs(sum(1 for a, b in zip(x, y) if a <= p and b <= q) / n - p * q) for p, q in zip(x, y))


def test_sequences_fill_more_evenly_than_random_numbers(folder):
    needs_gsl(folder)
    found = {}
    for sequence in ("random", "sobol", "halton"):
        result = read(folder, f"vary = {{ mass = rd.uniform(0, 1), E = rd.uniform(0, 1) }}, draws = 256, sequence = '{sequence}'")
        found[sequence] = star_discrepancy(values(result, "mass"), values(result, "E"))
    assert found["sobol"] < found["random"] / 3 and found["halton"] < found["random"] / 3


def test_a_sequence_is_the_same_at_each_point_and_a_seed_shifts_it(folder):
    needs_gsl(folder)
    text = "vary = { mass = rd.uniform(0, 1), F = { 1, 2, 3 } }, draws = 4, sequence = 'sobol'"
    plain, shifted = values(read(folder, text), "mass"), values(read(folder, text + ", seed = 1"), "mass")
    assert plain == [0.5, 0.75, 0.25, 0.375] * 3
    shift = (shifted[0] - 0.5) % 1
    assert all(math.isclose(b, (a + shift) % 1) for a, b in zip(plain, shifted)) and shift != 0


# ---- Refusals ----

REFUSALS = {
    "vary = { mas = 1 }": 'vary.mas: unknown name; did you mean "mass"?',
    "vary = { qqqqqq = 1 }": "vary.qqqqqq: unknown name; use a parameter, an input, an option, a coordinate, its rate NAME_d or inputs",
    "vary = { cart_xd = 1 }": 'vary.cart_xd: unknown name; did you mean "cart_x"?',
    "vary = { both = 1 }": "vary.both: the model uses this name for a parameter and for an input; rename one of them",
    "vary = { mass = rd.grid(3, 1, 5) }": "vary.mass: rd.grid: from 3 to 1; the range must ascend",
    "vary = { mass = rd.grid(1, 1, 5) }": "vary.mass: rd.grid: from 1 to 1; the range must ascend",
    "vary = { mass = rd.grid(1, 2, 0) }": "vary.mass: rd.grid: 0 points; must be a positive whole number",
    "vary = { mass = rd.grid(1, 2, 2.5) }": "vary.mass: rd.grid: 2.5 points; must be a positive whole number",
    "vary = { mass = rd.grid(0/0, 2, 2) }": "vary.mass: rd.grid: a number is not finite; numbers must be finite",
    "vary = { mass = rd.uniform(-1e308, 1e308) }, draws = 3": "vary.mass: rd.uniform: a number is beyond 1e300; numbers must be smaller",
    "vary = { mass = 1 }, derive = function(c) return { E = 'a\\nb' } end": "derive: case 0: E: contains control character 10; remove it",
    "vary = { mass = 1 }, tol = 0/0": "tol: value nan; must be positive",
    "vary = { mass = rd.grid(1, 2) }": "rd.grid: 2 arguments; must have 3: from, to and the number of points",
    "vary = { mass = rd.grid('a', 2, 3) }": "rd.grid: argument 1 is of type string; must be a number",
    "vary = { mass = rd.uniform(2, 1) }, draws = 3": "vary.mass: rd.uniform: from 2 to 1; the range must ascend",
    "vary = { mass = rd.uniform(1, 1) }, draws = 3": "vary.mass: rd.uniform: from 1 to 1; the range must ascend",
    "vary = { mass = rd.log_uniform(0, 1) }, draws = 3": "vary.mass: rd.log_uniform: from 0; bounds must be positive",
    "vary = { mass = rd.log_grid(-1, 1, 3) }": "vary.mass: rd.log_grid: from -1; bounds must be positive",
    "vary = { mass = rd.normal(1, -2) }, draws = 3": "vary.mass: rd.normal: standard deviation -2; must not be negative",
    "vary = { mass = rd.uniform(0, 1) }": "vary.mass: random, but draws is missing; add draws, the cases at each point of the grids",
    "vary = { mass = 1 }, draws = 3": "draws: has no effect, since nothing random varies; remove it",
    "vary = { mass = 1 }, seed = 3": "seed: has no effect, since nothing random varies; remove it",
    "vary = { mass = rd.uniform(0, 1) }, draws = 0": "draws: value 0; must be a positive whole number",
    "vary = { mass = rd.uniform(0, 1) }, draws = 1.5": "draws: value 1.5; must be a positive whole number",
    "vary = { mass = rd.uniform(0, 1) }, draws = 3, seed = -1": "seed: value -1; must be a whole number and not negative",
    "vary = { mass = rd.uniform(0, 1) }, draws = 3, sequence = 'sobl'": 'sequence: "sobl"; did you mean "sobol"?',
    "vary = { mass = rd.grid(0, 1, 2), mass = 2 }": "mass: already given in line 3 of this table; give it once",
    "vary = { n_rfe = rd.uniform(0, 1) }, draws = 3": "vary.n_rfe: random numbers; write a list of values",
    "vary = { n_rfe = { 2, 2.5 } }": 'with n_rfe = 2.5 the model has an error: --set n_rfe: value "2.5"; must be a whole number',
    "vary = { n_rfe = { 2, 99 } }": 'with n_rfe = 99 the model has an error: option n_rfe: value "99"; must be a number from 1 to 20',
    "vary = { mass = {} }": "vary.mass: an empty list; must have at least one value",
    "vary = { mass = 1/0 }": "vary.mass: value inf; must be finite",
    "vary = { mass = { 1, 0/0 } }": "vary.mass[2]: value nan; must be finite",
    "vary = { mass = { 1, 'a' } }": "vary.mass[2]: a text; must be of the same kind as the values before it",
    "vary = { mass = 'a' }": "vary.mass: a text; must be a number",
    "vary = { mass = true }": "vary.mass: true or false; must be a number",
    "vary = { mass = { from = 1 } }": "vary.mass: has named entries (from); must be a list of values",
    "vary = { mass = function() end }": "vary.mass: a function; must be a number, a text, true or false",
    "vary = { inputs = 3 }": "vary.inputs: a number; must be names of files",
    "vary = { inputs = 'no.csv' }": "inputs: no.csv: No such file or directory; name a readable file",
    "vary = {}": "vary: empty; must have at least one name",
    "vary = { 1 }": "vary: has entries without a name; must be a table such as { m = rd.grid(1, 3, 5) }",
    "vary = 3": "vary: a number; must be a table such as { m = rd.grid(1, 3, 5) }",
    "vari = { mass = 1 }, vary = { mass = 1 }": 'vari: unknown field; did you mean "vary"?',
    "tol = 1e-6": "rd.sweep: vary is missing; add vary = { m = rd.grid(1, 3, 5) }",
    "vary = { mass = 1 }, tol = -1": "tol: value -1; must be positive",
    "vary = { mass = 1 }, tol = 1e-6, step = 1": "step: fixed steps, but tol, tol_rates or step_max is given for adaptive steps; remove one of them",
    "vary = { mass = 1 }, method = 3": "method: a number; must be a text",
    "vary = { mass = 1 }, keep = {}": "keep: keeps nothing; add final = true or names of columns",
    "vary = { mass = 1 }, keep = { finl = true }": 'keep.finl: unknown field; did you mean "final"?',
    "vary = { mass = 1 }, keep = { at = { 1, 0.5 } }": "keep.at[2]: time 0.5; times must ascend and not be negative",
    "vary = { mass = 1 }, keep = { at = { 0.5, 2 } }": "keep.at[2]: time 2; must not be after the end of the motions at 1",
    "vary = { mass = 1 }, keep = { norms = { 3 } }": "keep.norms[1]: a number; must be a name",
    "vary = { mass = 1 }, keep = { norms = { 'a', 'a' } }": 'keep.norms: "a" is given twice; give it once',
    "vary = { mass = 1 }, derive = 3": "derive: a number; must be a function of the values of a case",
    "vary = { mass = { 1, 2 } }, derive = function(c) return { E = 1 / (c.mass - 2) } end": "derive: case 1: E: value inf; must be finite",
    "vary = { mass = 1 }, derive = function(c) return { E = 0/0 } end": "derive: case 0: E: value nan; must be finite",
    "vary = { mass = 1 }, derive = function(c) return { mass = 1 } end": "derive: case 0: mass: already varies; choose another name or remove it from vary",
    "vary = { mass = 1 }, derive = function(c) return 3 end": "derive: case 0: the function returns number; must return a table such as { NAME = value }",
    "vary = { mass = 1 }, derive = function(c) return {} end": "derive: case 0: an empty table; return { NAME = value }",
    "vary = { mass = 1 }, derive = function(c) return { 3 } end": "derive: case 0: an entry without a name; return { NAME = value }",
    "vary = { mass = 1 }, derive = function(c) return { E = {} } end": "derive: case 0: E: of type table; must be a number, a text, true or false",
    "vary = { mass = { 1, 2 } }, derive = function(c) return { E = c.mass > 1 and 'a' or 1 } end": "derive: case 1: E: of another type than in the first case; must be of one type",
    "vary = { mass = { 1, 2 } }, derive = function(c) return c.mass > 1 and { F = 1 } or { E = 1 } end": "derive: case 1: F: missing in the first case; return the same names in each case",
    "vary = { mass = { 1, 2 } }, derive = function(c) return { E = 1, F = c.mass < 2 and 1 or nil } end": "derive: case 1: fewer names than in the first case; return the same names in each case",
    "vary = { mass = 1 }, derive = function(c) return { EE = 1 } end": 'derive: EE: unknown name; did you mean "E"?',
    "vary = { mass = 1 }, derive = function(c) return { E = c.mas } end": 'derive: "mas" does not vary; did you mean "mass"?',
    "vary = { mass = 1 }, derive = function(c) while true do end end": "more than 100 million steps to read the sweep; look for a loop without an end",
    "vary = { mass = rd.grid(1, 2, 1001), E = rd.uniform(1, 2), F = rd.grid(0, 1, 10) }, draws = 100":
        "rd.sweep: 1001000 cases (10 of F x 1001 of mass x 100 draws), more than 1000000; to allow them add cases_max = 1001000",
    "vary = { mass = rd.grid(1, 2, 3) }, cases_max = 2": "rd.sweep: 3 cases (3 of mass), more than 2; to allow them add cases_max = 3",
}


@pytest.mark.parametrize("fields", REFUSALS)
def test_refusals(folder, fields):
    line = 2 if REFUSALS[fields].startswith("rd.sweep:") else 3
    assert refusals(folder, sweep_text(fields)) == [f"sweep.lua:{line}: {REFUSALS[fields]}"]


def test_a_sweep_needs_its_end(folder):
    assert refusals(folder, sweep_text("vary = { mass = 1 }", t_end=False)) == [
        "sweep.lua:2: rd.sweep: t_end is missing; add t_end = 10, the end of the motions [s]"]


def test_all_mistakes_are_told_at_once(folder):
    found = refusals(folder, sweep_text("vary = { mas = 1,\n EE = 2 },\n keep = { at = { 3 } }"))
    assert found == ['sweep.lua:3: vary.mas: unknown name; did you mean "mass"?', 'sweep.lua:4: vary.EE: unknown name; did you mean "E"?',
                     "sweep.lua:5: keep.at[1]: time 3; must not be after the end of the motions at 1"]


def test_options_that_a_structure_refuses_are_told_where_they_stand(folder):
    assert refusals(folder, sweep_text("vary = { E = 1,\n mass = 1,\n n_rfe = { 2, 99 } }")) == [
        'sweep.lua:5: with n_rfe = 99 the model has an error: option n_rfe: value "99"; must be a number from 1 to 20']


def test_what_derive_may_take(folder):
    loop = "vary = { mass = rd.grid(1, 2, 1000) }, derive = function(c) for i = 1, 2e5 do end return { E = 1 } end"
    assert refusals(folder, sweep_text(loop)) == ["sweep.lua:3: more than 102 million steps to read the sweep; look for a loop without an end"]


def test_columns_that_a_sequence_has(folder):
    many = ", ".join(f"arm_theta_{i} = rd.uniform(0, 1)" for i in range(1, 42))
    assert refusals(folder, sweep_text(f"vary = {{ {many} }}, draws = 3, sequence = 'sobol'")) == [
        "sweep.lua:3: sequence: 41 random columns; sobol has at most 40"]


def test_other_files(folder):
    assert refusals(folder, "return 3\n") == ["sweep.lua: the file returns a number; must return rd.sweep { ... }"]
    assert refusals(folder, "return {\n") == ["sweep.lua:2: unexpected symbol near <eof>; the '{' in line 1 lacks its end"]
    assert refusals(folder, MODEL)[0].startswith("sweep.lua:3: rd.option: belongs to model files; in a sweep use one of sweep, grid, log_grid,")
    assert refusals(folder, 'return require "refdyn".free()') == [
        "sweep.lua:1: rd.free: belongs to fit files; in a sweep use one of sweep, grid, log_grid, uniform, log_uniform, normal, pi"]
    assert refusals(folder, 'return require "refdyn".gridd(1, 2, 3)') == ['sweep.lua:1: rd.gridd: unknown function; did you mean "grid"?']
    assert refusals(folder, 'return io.open("x")')[0].startswith('sweep.lua:1: undefined global "io": not available in a sweep')
    assert refusals(folder, "while true do end") == ["sweep.lua:1: more than 100 million steps to read the sweep; look for a loop without an end"]
    done = subprocess.run([CASES, "model.lua", "none.lua"], cwd=folder, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, "none.lua: cannot be read: No such file or directory\n")


def test_models_have_no_functions_of_other_files(folder):
    from program import refdyn
    (folder / "wrong.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = {} }\n')
    assert refdyn("check", folder / "wrong.lua", status=1).stderr.endswith(
        "wrong.lua:2: rd.sweep: belongs to sweep files; run them by refdyn batch MODEL.lua SWEEP.lua\n")
    (folder / "wrong.lua").write_text('local rd = require "refdyn"\nreturn rd.within(1, 2)\n')
    assert refdyn("check", folder / "wrong.lua", status=1).stderr.endswith(
        "wrong.lua:2: rd.within: belongs to fit files; run them by refdyn fit MODEL.lua FIT.lua\n")


def test_the_command_line_sets_what_a_sweep_does_not_vary(folder):
    assert refusals(folder, sweep_text("vary = { mass = 1 }"), "mass=3") == ["sweep.lua:3: vary.mass: --set sets it, too; remove one of them"]
    assert read(folder, "vary = { arm_theta_3 = 1 }", "n_rfe=4")["count"] == 1


# ---- Tables ----

def table(folder, text, *arguments):
    done = call(folder, text, *arguments, name="cases.csv")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_tables(folder):
    (folder / "calm.csv").write_text("t,F\n0,1\n")
    result = table(folder, "mass, n_rfe, arm_theta_d, inputs\n1, 2, 0.5, calm.csv\n2.5, 4, -1e-3, calm.csv\n3, 2, 0, calm.csv\n")
    assert result["count"] == 3 and list(result["columns"]) == ["mass", "n_rfe", "arm_theta_d", "inputs"]
    assert values(result, "mass") == [1, 2.5, 3] and values(result, "arm_theta_d") == [0.5, -1e-3, 0]
    assert values(result, "n_rfe") == ["2", "4", "2"] and result["columns"]["n_rfe"]["texts"] == 2
    assert values(result, "inputs") == ["calm.csv"] * 3 and result["keep"]["final"] is True
    assert result["text"] == (folder / "cases.csv").read_text()


@pytest.mark.parametrize("text, message", {
    "mas\n1\n": '1: mas: unknown name; did you mean "mass"?',
    "mass,mass\n1,2\n": "1: cases: two columns are called 'mass'; each needs its own name",
    "both\n1\n": "1: both: the model uses this name for a parameter and for an input; rename one of them",
    "mass\n1\nx\n": "3: cases: mass: 'x' is not a finite number",
    "mass\n1\nnana\n": "3: cases: mass: 'nana' is not a finite number",
    "mass\n1\n-nan\n": "3: cases: mass: '-nan' is not a finite number",
    "mass,E\n1,\n": "2: cases: E: the field is empty; write a number, or nan for a case without this value",
    "mass,E\n1\n": "2: cases: 1 fields under 2 names",
    "mass\n": "1: cases: no row below the names; write at least one case",
    "mass,shape\n1,\n": "2: cases: shape: the field is empty; write a value",
    "mass,shape\n1,oval\n": '1: with shape = oval the model has an error: option shape: value "oval"; must be one of round, flat',
    "inputs\nno.csv\n": "1: inputs: no.csv: No such file or directory; name a readable file",
}.items())
def test_wrong_tables(folder, text, message):
    assert refusals(folder, text, name="cases.csv") == [f"cases.csv:{message}"]


def test_tables_of_sweeps(folder):
    """`table` has the cases, from which `derive` computes further values; the text of the batch has both files."""
    (folder / "t").mkdir()
    (folder / "t" / "calm.csv").write_text("t,F\n0,1\n")
    rows = "mass, n_rfe, arm_theta_d, inputs\n1, 2, 0.5, t/calm.csv\n2.5, 4, -1e-3, t/calm.csv\n"
    (folder / "t" / "cases.csv").write_text(rows)
    fields = 'table = "t/cases.csv", derive = function(c) return { cart_x = 2 * c.mass } end, keep = { history = { "tip_x" }, at = { 0.5 } }'
    result = read(folder, fields)
    assert result["count"] == 2 and list(result["columns"]) == ["mass", "n_rfe", "arm_theta_d", "inputs", "cart_x"]
    assert values(result, "mass") == [1, 2.5] and values(result, "n_rfe") == ["2", "4"] and values(result, "cart_x") == [2, 5]
    assert result["keep"]["final"] is False and result["keep"]["history"] == ["tip_x"] and result["keep"]["at"] == [0.5]
    assert result["text"] == sweep_text(fields) + rows


@pytest.mark.parametrize("fields, rows, messages", [
    ('table = "cases.csv", vary = { mass = 1 }', "mass\n1\n", ["sweep.lua:3: table: its rows are the cases, but vary is given as well; remove one of them"]),
    ('table = "cases.csv", seed = 3', "mass\n1\n", ["sweep.lua:3: seed: has no effect, since nothing random varies; remove it"]),
    ('table = ""', "", ["sweep.lua:3: table: an empty text; must be a name"]),
    ('table = "none.csv"', "", ["none.csv: cases: No such file or directory; must be a readable file"]),
    ('table = "cases.csv"', "mas\n1\n", ['cases.csv:1: mas: unknown name; did you mean "mass"?']),
    ('table = "cases.csv"', "mass\nx\n", ["cases.csv:2: cases: mass: 'x' is not a finite number"]),
    ('table = "cases.csv", derive = function(c) return { mas = 2 } end', "E\n1\n", ['sweep.lua:3: derive: mas: unknown name; did you mean "mass"?']),
    ('table = "cases.csv", derive = function(c) return { mass = 2 } end', "mass\n1\n", ["sweep.lua:3: derive: "]),
    ('table = "cases.csv", keep = { at = { 2 } }', "mass\n1\n", ["sweep.lua:3: keep.at[1]: time 2; must not be after the end of the motions at 1"]),
])
def test_wrong_tables_of_sweeps(folder, fields, rows, messages):
    (folder / "cases.csv").write_text(rows)
    found = refusals(folder, sweep_text(fields))
    assert len(found) == len(messages) and all(line.startswith(message) for line, message in zip(found, messages)), found


# ---- Size ----

def brief(folder, fields):
    return read(folder, fields, "--brief")


def test_a_hundred_thousand_cases_take_a_second_and_little_memory(folder):
    slowness = float(os.environ.get("REFDYN_SLOWNESS", "1"))
    text = "vary = {{ mass = rd.grid(1, 2, {}), E = rd.normal(2e11, 1e9) }}, draws = 100, derive = function(c) return {{ F = math.sin(c.E) * c.mass }} end"
    few, many = brief(folder, text.format(10)), brief(folder, text.format(1000))
    assert (few["count"], many["count"]) == (1000, 100000)
    assert many["seconds"] < 1.5 * slowness
    if slowness == 1:
        assert many["kilobytes"] - few["kilobytes"] < 8 * 1024  # three columns of 100,000 numbers are 2.4 MB


def test_a_million_cases_that_are_meant(folder):
    assert brief(folder, "vary = { mass = rd.uniform(1, 2) }, draws = 1200000, cases_max = 2e6")["count"] == 1200000


# ---- The page ----

def test_the_example_of_the_page(folder):
    page = (SOURCE / "docs" / "batches.md").read_text()
    example = re.search(r"^```lua sweep.lua\n(.*?)^```", page, re.M | re.S).group(1)
    (folder / "model.lua").write_text(REFERENCE.read_text())
    done = call(folder, example)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["count"] == 1000 and values(result, "m_E")[199] == 1 and values(result, "m_E")[200] == 1.5
    assert set(values(result, "n_rfe")[:100]) == {"2"} and set(values(result, "n_rfe")[100:200]) == {"4"}
    rows = re.search(r"^```\n(m_E.*?)^```", page, re.M | re.S).group(1)
    assert values(table(folder, rows), "arm_psi") == [0.7, 0.75]


def test_the_page_names_what_there_is(folder):
    page = (SOURCE / "docs" / "batches.md").read_text()
    known = refusals(folder, sweep_text("vary = { mass = 1 }, qqqqqqqqqqqq = 1"))[0].partition("use one of ")[2].split(", ")
    assert known and all(f"`{name}`" in page for name in known)
    functions = refusals(folder, 'return require "refdyn".model {}')[0].partition("use one of ")[2].split(", ")
    assert functions and all(f"rd.{name}" in page for name in functions)
