"""`refdyn batch`: its numbers equal those of `refdyn sim`, regardless of threads, kills and neighbouring cases; what the file of runs
keeps; how the journal survives failures; `refdyn sim --case`."""
import hashlib
import os
import random
import resource
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

from program import REFDYN, REFERENCE, TESTS, read_run, refdyn

MODEL = TESTS / "batch" / "model.lua"
HEAD = 'local rd = require "refdyn"\n'
KEEP = 'keep = { final = true, at = { 0.25, 0.5 }, extremes = { "tip_z" }, norms = { "tip_z" }, history = { "tip_x", "energy" } }'
SWEEP = HEAD + """return rd.sweep {
  vary = { mass = rd.grid(0.5, 2, 4), pieces = { 2, 3 }, arm_psi = rd.uniform(-0.7, 0.9) },
  draws = 3, seed = 5, t_end = 0.5, every = 0.05, tol = 1e-7,
  %s,
}
""" % KEEP
CASES = 24


def datasets(path):
    """All numbers and texts of a file by name, except CPU times."""
    found = {}

    def add(name, item):
        if isinstance(item, h5py.Dataset) and name != "cpu_s":
            found[name] = item[...].tobytes() if item.dtype.kind in "fiu" else repr(item[...].tolist())
    with h5py.File(path) as file:
        file.visititems(add)
    return found


def batch(folder, sweep=SWEEP, *arguments, model=MODEL, output="runs.h5", status=0, **options):
    (folder / "sweep.lua").write_text(sweep)
    return refdyn("batch", model, folder / "sweep.lua", "-o", folder / output, *arguments, status=status, **options)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batch")
    batch(folder, SWEEP, "--threads", "2", "--lanes", "1")
    return folder / "runs.h5"


# ---- The numbers ----

def test_what_varies_without_effect_is_reported(tmp_path):
    """A parameter that nothing reads; not one that only a course reads, nor one that only some structures have."""
    (tmp_path / "slide.lua").write_text(HEAD + """local p = rd.parameters { { "m", 2, "kg" }, { "gain", 3 }, { "idle", 4 } }
local is_braked = rd.option("is_braked", false)
local damper = is_braked and { x = rd.parameter("c", 0.3, "N s/m") } or nil
return rd.model { name = "slide", links = { { "cart", joint = "x", mass = p.m, damper = damper, start_rate = { x = 1 } } },
  courses = function(s) return { level = p.gain * s.q.cart_x } end }
""")
    vary = "vary = { m = { 1, 3 }, gain = { 2, 5 }, idle = { 1, 2 }, is_braked = { true, false }, c = { 0.1, 0.2 } }"
    said = batch(tmp_path, HEAD + "return rd.sweep { " + vary + ", t_end = 0.1 }", model=tmp_path / "slide.lua").stderr
    assert [line for line in said.splitlines() if "warning" in line] == ["refdyn: warning: idle: varies, but nothing in this model reads it"], said



def test_each_case_is_a_motion_of_sim(done, tmp_path):
    """Final states, times, extremes, norms and histories are those of the CSV of `sim`, bit for bit."""
    with h5py.File(done) as file:
        for case in (0, 5, 13, 23):
            pieces = int(file["cases/pieces"][case])
            refdyn("sim", MODEL, "--set", f"mass={float(file['cases/mass'][case])!r}", "--set", f"pieces={pieces}", "--from", write_state(tmp_path, file, case), "--until", "0.5", "--every", "0.05", "--tol", "1e-7", "-o", tmp_path / "sim.csv")
            run = read_run(tmp_path / "sim.csv")
            final = file["final"]
            for name in run:
                if name in final:
                    assert final[name][case] == run[name][-1], name
            z = run["tip_z"]
            assert list(file["extremes/tip_z"][case]) == [z.min(), run["t"][z.argmin()], z.max(), run["t"][z.argmax()]]
            square = np.sqrt(np.sum(np.diff(run["t"]) * (z[1:]**2 + z[:-1]**2) / 2) / 0.5)
            assert abs(file["norms/tip_z"][case] - square) <= 1e-14 * square
            assert np.array_equal(file["history/energy"][case], run["energy"])
            assert np.array_equal(file["history/t"][...], run["t"])
            assert np.array_equal(file["at/tip_x"][case], run["tip_x"][[5, 10]])
            assert np.isnan(final["third_psi"][case]) == (pieces == 2)


def write_state(folder, file, case):
    """The start of a case as a STATE.json: the swept start value, and the model's initial state otherwise."""
    import json
    pieces = int(file["cases/pieces"][case])
    q = [file["cases/arm_psi"][case]] + [0.05] * (pieces - 1)
    (folder / "state.json").write_text(json.dumps({"q": q, "qd": [0.0] * pieces}))
    return folder / "state.json"


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_do_not_matter(threads, done, tmp_path):
    batch(tmp_path, SWEEP, "--threads", threads, "--lanes", "1")
    assert datasets(tmp_path / "runs.h5") == datasets(done)


@pytest.fixture(scope="module")
def in_lanes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lanes")
    batch(folder, SWEEP, "--lanes", "2")
    return folder / "runs.h5"


@pytest.mark.parametrize("arguments", [["--lanes", "4"], ["--lanes", "8", "--threads", "3"], ["--lanes", "4", "--threads", "1"]])
def test_lanes_do_not_matter(arguments, in_lanes, tmp_path):
    """Results in lanes are the same for all widths, threads and neighbours; results of one case at a time differ by rounding."""
    batch(tmp_path, SWEEP, *arguments)
    assert datasets(tmp_path / "runs.h5") == datasets(in_lanes)
    batch(tmp_path, SWEEP, *arguments, "--cases", "3:4", output="one.h5")
    batch(tmp_path, SWEEP, "--lanes", "1", output="alone.h5")
    with h5py.File(in_lanes) as lanes, h5py.File(tmp_path / "one.h5") as one, h5py.File(tmp_path / "alone.h5") as alone:
        assert one["final/tip_x"][0] == lanes["final/tip_x"][3] and lanes.attrs["lanes"] == "2"
        for name in ("final/tip_x", "history/energy"):
            assert np.nanmax(abs(lanes[name][...] - alone[name][...])) <= 1e-9, name
        assert np.array_equal(np.isnan(lanes["final/third_psi"][...]), np.isnan(alone["final/third_psi"][...]))


def test_tolerance_of_rates(tmp_path):
    """From the file or the command line, in lanes and without, it is that of `sim`."""
    cases = "vary = { mass = rd.grid(0.7, 1.9, 3) }, t_end = 0.5, tol = 1e-6, keep = { final = true }"
    given = HEAD + "return rd.sweep { %s, tol_rates = 1e-7 }" % cases
    for name, sweep, arguments in (("plain", HEAD + "return rd.sweep { %s }" % cases, ["--lanes", "1"]), ("file", given, ["--lanes", "1"]), ("lanes", given, ["--lanes", "2"]),
                                   ("line", HEAD + "return rd.sweep { %s, tol_rates = 1e-3 }" % cases, ["--tol-rates", "1e-7", "--lanes", "1"])):
        batch(tmp_path, sweep, *arguments, output=f"{name}.h5")
    refdyn("sim", MODEL, "--set", "mass=1.9", "--until", "0.5", "--every", "0.5", "--tol", "1e-6", "--tol-rates", "1e-7", "-o", tmp_path / "sim.csv")
    refdyn("sim", "--of", tmp_path / "file.h5", "--case", "2", "-o", tmp_path / "again.csv")
    run, again = read_run(tmp_path / "sim.csv"), read_run(tmp_path / "again.csv")
    with h5py.File(tmp_path / "file.h5") as file, h5py.File(tmp_path / "lanes.h5") as lanes, h5py.File(tmp_path / "plain.h5") as plain, h5py.File(tmp_path / "line.h5") as line:
        found = file["final/tip_z"][...]
        assert found[2] == run["tip_z"][-1] == again["tip_z"][-1] and np.array_equal(line["final/tip_z"][...], found)
        assert np.abs(lanes["final/tip_z"][...] - found).max() < 1e-9 and not np.array_equal(plain["final/tip_z"][...], found)


def test_parts_are_joined(done, tmp_path):
    """Ranges run separately, in any order, and merged make the same file."""
    for name, cases in (("b.h5", "9:17"), ("a.h5", ":9"), ("c.h5", "17:")):
        batch(tmp_path, SWEEP, "--cases", cases, "--lanes", "1", output=name)
    refdyn("merge", tmp_path / "c.h5", tmp_path / "a.h5", tmp_path / "b.h5", "-o", tmp_path / "all.h5")
    assert datasets(tmp_path / "all.h5") == datasets(done)


def test_a_failed_case_leaves_the_others(tmp_path):
    """The model refuses a mass in one row of a table, and another row has infinite accelerations: these cases fail with a reason, and no
    bit of the others changes."""
    rows = [f"{0.5 + 0.01 * i!r},{0.2 + 0.001 * i!r},0.1" for i in range(40)]
    good = tmp_path / "good.csv"
    good.write_text("mass,arm_psi,torque\n" + "\n".join(rows) + "\n")
    rows[17] = "-5,0.3,0.1"
    rows[29] = "1,0.3,1e308"
    bad = tmp_path / "bad.csv"
    bad.write_text("mass,arm_psi,torque\n" + "\n".join(rows) + "\n")
    for table in (good, bad):
        done = refdyn("batch", MODEL, "--table", table, "--until", "0.3", "--threads", "2", "-o", table.with_suffix(".h5"))
    assert "2 of these failed\nfailed       case 17, the first of them: " in done.stderr and "links[1].mass: value -5; must be positive\n" in done.stderr
    with h5py.File(good.with_suffix(".h5")) as all_good, h5py.File(bad.with_suffix(".h5")) as two_bad:
        assert list(np.flatnonzero(two_bad["status"][...])) == [17, 29] and not all_good["status"][...].any()
        assert list(two_bad["status"][[17, 29]]) == [1, 3]
        reasons = two_bad["reason"].asstr()[...]
        assert reasons[17].endswith("model.lua:10: links[1].mass: value -5; must be positive")
        assert reasons[29].startswith("start at t = 0 s: ") and reasons[0] == ""
        others = [i for i in range(40) if i not in (17, 29)]
        for name in all_good["final"]:
            assert all_good["final"][name][others].tobytes() == two_bad["final"][name][others].tobytes(), name
            assert name == "t" or np.isnan(two_bad["final"][name][[17, 29]]).all(), name


def test_a_case_without_a_number(tmp_path):
    """nan and inf in a table: the case fails alone, `sim --case` prints the same reason, and lanes and other cases do not matter. NaN of an
    anchored parameter leaves it to the start, as if it did not vary."""
    rows = [f"{1.1 + 0.02 * i!r},{0.31 + 0.001 * i!r},{0.7 + 0.002 * i!r}" for i in range(12)]
    rows[2], rows[5], rows[7], rows[9] = "nan,0.3,0.7", "1.3,nan,0.71", "1.4,0.3,-Inf", "1.2,NaN,0.73"
    (tmp_path / "cases.csv").write_text("m_E,xc,arm_psi\n" + "\n".join(rows) + "\n")
    (tmp_path / "start.csv").write_text("m_E,arm_psi\n1.3,0.71\n1.2,0.73\n")
    arguments = ["--set", "n_rfe=1", "--until", "0.1"]
    for name, lanes in (("cases", 4), ("cases", 1), ("start", 1)):
        refdyn("batch", REFERENCE, "--table", tmp_path / f"{name}.csv", *arguments, "--lanes", lanes, "-o", tmp_path / f"{name}_{lanes}.h5")
    with h5py.File(tmp_path / "cases_1.h5") as one, h5py.File(tmp_path / "cases_4.h5") as four, h5py.File(tmp_path / "start_1.h5") as start:
        for file in (one, four):
            assert list(np.flatnonzero(file["status"])) == [2, 7] and list(file["status"][[2, 7]]) == [1, 1]
            assert list(file["reason"].asstr()[[2, 7]]) == ["m_E: value nan; must be finite", "arm_psi: value -inf; must be finite"]
            assert np.isnan(file["cases/xc"][[5, 9]]).all() and file["cases/xc"][0] == 0.31
        assert np.array_equal(one["final/E_z"][[5, 9]], start["final/E_z"]) and np.isnan(one["final/E_z"][[2, 7]]).all()
        refdyn("sim", "--case", "5", "--of", tmp_path / "cases_1.h5", "-o", tmp_path / "case.csv")
        assert read_run(tmp_path / "case.csv")["E_z"][-1] == one["final/E_z"][5]
    again = refdyn("sim", "--case", "7", "--of", tmp_path / "cases_1.h5", "-o", tmp_path / "none.csv", status=1)
    assert again.stderr == "arm_psi: value -inf; must be finite\n" and not (tmp_path / "none.csv").exists()
    refdyn("batch", REFERENCE, "--table", tmp_path / "cases.csv", *arguments, "--from", "statics", "-o", tmp_path / "rest.h5")
    with h5py.File(tmp_path / "rest.h5") as file:
        assert list(file["status"][[5, 9]]) == [1, 1] and list(file["reason"].asstr()[[5, 9]]) == ["xc: value nan; must be finite"] * 2


NEEDS = """local rd = require "refdyn"
local p = rd.parameters { { "ramp", 2 }, { "rise", 3 }, { "width", 0.1 }, { "outer", 0.05 }, { "hole", 0.03 }, { "size", 0.02 }, { "at", 0.4 }, { "yy", 0.2 },
  { "xy", 0.01 }, { "way", 1 }, { "density", 7800 } }
return rd.model {
  name = "needs",
  links = {
    { "arm", joint = "psi", bodies = { rd.tube { outer = p.outer, inner = p.hole, length = 0.3, density = p.density } },
      beam = { length = 0.5, section = rd.round(p.size), E = 7e10, nu = 0.3, rho = 2700, rfe = 2 } },
    { "load", on = "arm", along = p.at, joint = "z", mass = 1 },
    { "block", joint = "psi, theta", mass = 1, inertia = { xx = 0.15, yy = p.yy, zz = 0.25, xy = p.xy } },
  },
  points = { E = "load", B = "block" },
  forces = function(s) return { arm_psi = rd.ramp(s.t, 0, p.ramp) - rd.smoothstep(s.t, 1, p.rise) + rd.friction(0.1, s.qd.arm_psi, p.width) } end,
  constraints = function(s) return { rd.on_plane { "E", { "ground", { 0, 0, p.way } } } } end,
}
"""
WRONG = [("ramp", 0), ("ramp", -1), ("rise", 1), ("width", 0), ("hole", 0.05), ("hole", -1), ("size", -0.02), ("at", 0.6), ("yy", 0.5), ("xy", 0.2),
         ("way", 0), ("density", 0)]


def test_what_a_case_is_refused_for(tmp_path):
    """Numbers within formulas, the order of two of them, sections, places along beams, inertias, directions: a case fails with the message
    of sim."""
    (tmp_path / "needs.lua").write_text(NEEDS)
    names = sorted({name for name, _ in WRONG})
    sound = dict(ramp=2, rise=3, width=0.1, hole=0.03, size=0.02, at=0.4, yy=0.2, xy=0.01, way=1, density=7800)
    rows = [{**sound, name: value} for name, value in [*WRONG, ("way", 2)]]
    (tmp_path / "cases.csv").write_text("\n".join(",".join(map(str, row)) for row in [names, *([row[name] for name in names] for row in rows)]) + "\n")
    refdyn("batch", tmp_path / "needs.lua", "--table", tmp_path / "cases.csv", "--until", "0.01", "-o", tmp_path / "runs.h5")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert list(file["status"]) == [1] * len(WRONG) + [0]
        for (name, value), reason in zip(WRONG, file["reason"].asstr()[...]):
            said = refdyn("sim", tmp_path / "needs.lua", "--set", f"{name}={value}", "--until", "0.01", "-o", tmp_path / "sim.csv", status=1).stderr
            assert reason == said.splitlines()[0], (name, value, reason, said)


def test_from_statics(tmp_path):
    batch(tmp_path, HEAD + 'return rd.sweep { vary = { mass = { 0.7, 1.9 } }, t_end = 0.2, from = "statics" }', "--lanes", "1")
    with h5py.File(tmp_path / "runs.h5") as file:
        for case, mass in enumerate((0.7, 1.9)):
            refdyn("sim", MODEL, "--set", f"mass={mass}", "--from", "statics", "--until", "0.2", "-o", tmp_path / "sim.csv")
            assert file["final/arm_psi"][case] == read_run(tmp_path / "sim.csv")["arm_psi"][-1]


@pytest.mark.parametrize("threads", [1, 4])
def test_no_equilibrium(threads, tmp_path):
    """A case without an equilibrium reports no steps, regardless of what its thread did before."""
    sweep = HEAD + 'return rd.sweep { vary = { torque = { 0.1, 1e308, 0.2, -1e308 }, arm_psi_d = 3 }, t_end = 1, from = "statics" }'
    batch(tmp_path, sweep, "--threads", threads)
    with h5py.File(tmp_path / "runs.h5") as file:
        assert list(file["status"]) == [0, 3, 0, 3]
        assert list(file["steps"][...] == 0) == [False, True, False, True]
        assert file["reason"].asstr()[1].startswith("equilibrium at t = 0 s: ")


def test_courses_of_inputs(tmp_path):
    """Files of samples vary; each motion equals `sim --inputs`."""
    (tmp_path / "calm.csv").write_text("t,torque\n0,0.1\n")
    (tmp_path / "gust.csv").write_text("t,torque\n0,0.1\n0.0731,0.4\n0.1713,-0.3\n")
    batch(tmp_path, HEAD + 'return rd.sweep { vary = { inputs = { "calm.csv", "gust.csv" } }, t_end = 0.3 }', "--lanes", "1")
    with h5py.File(tmp_path / "runs.h5") as file:
        for case, name in enumerate(("calm.csv", "gust.csv")):
            refdyn("sim", MODEL, "--inputs", tmp_path / name, "--until", "0.3", "-o", tmp_path / "sim.csv")
            assert file["final/arm_psi"][case] == read_run(tmp_path / "sim.csv")["arm_psi"][-1]


def test_one_case_again(done, in_lanes, tmp_path):
    """`sim --case` needs only the file, and computes the same bits at the output times of the batch."""
    for case in (3, 22):
        refdyn("sim", "--case", case, "--of", in_lanes, "-o", tmp_path / "lanes.csv", cwd=tmp_path)
        with h5py.File(in_lanes) as file:
            assert np.array_equal(file["history/tip_x"][case], read_run(tmp_path / "lanes.csv")["tip_x"])
        refdyn("sim", "--case", case, "--of", done, "-o", tmp_path / "case.csv", cwd=tmp_path)
        run = read_run(tmp_path / "case.csv")
        with h5py.File(done) as file:
            assert np.array_equal(file["history/tip_x"][case], run["tip_x"])
            for name, values in run.items():
                assert name not in file["final"] or values[-1] == file["final"][name][case], name
    assert "has no case 24" in refdyn("sim", "--case", "24", "--of", done, "-o", tmp_path / "x.csv", status=1).stderr
    assert "stand together" in refdyn("sim", MODEL, "--case", "2", "--until", "1", status=2).stderr


@pytest.mark.parametrize("arguments, message", [
    (["-o", "case.csv", "--tol", "1e-9"], "--tol: the case of --of has its own"),
    (["-o", "case.csv", "--set", "mass=3"], "--set: the case of --of has its own"),
    (["-o", "case.h5"], "-o case.h5: a case of --of is written as CSV")])
def test_one_case_again_takes_no_options(arguments, message, done, tmp_path):
    said = refdyn("sim", "--case", "0", "--of", done, *arguments, cwd=tmp_path, status=2).stderr
    assert message in said, said
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize("where, name, value, message", [
    ("/", "model", "[]", "has no attributes for its model and options"),
    ("/", "options", "[]", "has no attributes for its model and options"),
    ("/", "options", '{"set": {"torque": 3}, "until": 0.5}', "torque"),
    ("cases/mass", "kind", "option", "/cases/mass: does not have the form of a file of runs"),
    ("cases/pieces", "kind", "parameter", "/cases/pieces: does not have the form of a file of runs")])
def test_one_case_of_a_damaged_file(where, name, value, message, done, tmp_path):
    import shutil
    shutil.copy(done, tmp_path / "runs.h5")
    with h5py.File(tmp_path / "runs.h5", "r+") as file:
        file[where].attrs[name] = value
        if where == "/":
            file.attrs[name + "_hash"] = hashlib.sha256(value.encode()).hexdigest()
    said = refdyn("sim", "--case", "0", "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv", status=1).stderr
    assert message in said, said


WITH_FILES = HEAD + """return rd.sweep {
  vary = { inputs = { "calm.csv", "gust.csv" }, mass = rd.grid(0.5, 2, 1000) }, t_end = 10, tol = 1e-9, from = "state.json" }
"""


def write_files(folder):
    (folder / "calm.csv").write_text("t,torque\n0,0.1\n")
    (folder / "gust.csv").write_text("t,torque\n0,0.1\n0.07,0.4\n")
    (folder / "state.json").write_text('{"q": [0.3, 0.1], "qd": [0, 0]}')


def test_one_case_again_after_its_files_changed(tmp_path):
    """A case reads only its own files, unchanged since the batch, and does not overwrite them."""
    write_files(tmp_path)
    batch(tmp_path, WITH_FILES.replace("1000", "2").replace("10,", "0.3,"))
    again = ["sim", "--case", "0", "--of", tmp_path / "runs.h5", "-o"]
    (tmp_path / "gust.csv").unlink()
    refdyn(*again, tmp_path / "case.csv")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert file["final/arm_psi"][0] == read_run(tmp_path / "case.csv")["arm_psi"][-1]
    for name in ("calm.csv", "state.json"):
        assert "give another name" in refdyn(*again, tmp_path / name, status=1).stderr
    for name in ("calm.csv", "state.json"):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace("0.1", "0.2"))
        said = refdyn(*again, tmp_path / "other.csv", status=1).stderr
        assert f"{name}: has changed since the batch was computed; restore it" in said, said
        (tmp_path / name).write_text(text)
    assert not (tmp_path / "other.csv").exists()


def test_one_case_again_after_its_files_moved(done, tmp_path):
    """Files are searched from the folder of the call, of the batch and of the file of runs; if all fail, the message names all three."""
    home, away = tmp_path / "home", tmp_path / "away"
    home.mkdir()
    write_files(home)
    (home / "sweep.lua").write_text(WITH_FILES.replace("1000", "2").replace("10,", "0.3,"))
    refdyn("batch", MODEL, "sweep.lua", "-o", "runs.h5", cwd=home)
    again = ["sim", "--case", "3", "--of", "home/runs.h5", "-o", "case.csv"]
    refdyn(*again, cwd=tmp_path)
    expected = (tmp_path / "case.csv").read_bytes()
    home.rename(away)
    again[4] = "away/runs.h5"
    refdyn(*again, cwd=tmp_path)
    assert (tmp_path / "case.csv").read_bytes() == expected
    (away / "gust.csv").rename(tmp_path / "gust.csv")
    refdyn(*again, cwd=tmp_path)
    assert (tmp_path / "case.csv").read_bytes() == expected
    (tmp_path / "gust.csv").unlink()
    said = refdyn(*again, cwd=tmp_path, status=1).stderr
    assert (f"refdyn: gust.csv: the case reads this file, which does not exist, nor does {home}/gust.csv or away/gust.csv; put it in one of these places"
            in said), said


def test_what_a_structure_lacks(tmp_path):
    """A start value of the third rod varies in the cases that have one, and is NaN in the others."""
    batch(tmp_path, HEAD + "return rd.sweep { vary = { third_psi = { 0.1, 0.2 }, pieces = { 2, 3 } }, t_end = 0.1 }")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert [int(pieces) for pieces in file["cases/pieces"][...]] == [2, 2, 3, 3]
        assert np.array_equal(file["cases/third_psi"][...], [np.nan, np.nan, 0.1, 0.2], equal_nan=True)
        assert np.array_equal(np.isnan(file["final/third_psi"][...]), [True, True, False, False])
        assert file["final/arm_psi"][0] == file["final/arm_psi"][1] and file["final/arm_psi"][2] != file["final/arm_psi"][3]
        refdyn("sim", "--case", "1", "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv")
        assert read_run(tmp_path / "case.csv")["arm_psi"][-1] == file["final/arm_psi"][1]


def test_names_of_many_structures(tmp_path):
    """A name that only the 66th structure has is known; a name that no structure has causes an error message."""
    (tmp_path / "chain.lua").write_text("""local rd = require "refdyn"
local links = {}
for i = 1, rd.option("n", 1, { from = 1 }) do
  links[i] = { "l" .. i, on = i > 1 and "l" .. i - 1 or nil, joint = { "psi" }, mass = 1, center = { 0.2, 0, 0 }, inertia = { zz = 1 } }
end
return rd.model { name = "chain", gravity = { 0, -9.81, 0 }, links = links }
""")
    sweep = HEAD + """local n = {}
for i = 1, 70 do n[i] = i end
return rd.sweep { vary = { n = n, l66_psi = 0.1, l71_psi = 0.1 }, t_end = 0.1 }"""
    said = batch(tmp_path, sweep, model=tmp_path / "chain.lua", status=1).stderr
    assert "l71_psi: unknown name" in said and "l66_psi: unknown" not in said, said


def test_too_many_structures(tmp_path):
    (tmp_path / "cart.lua").write_text("""local rd = require "refdyn"
rd.option("n", 1, { from = 1 })
return rd.model { name = "cart", links = { { "cart", joint = { "x" }, mass = 1 } } }
""")
    sweep = HEAD + "return rd.sweep { vary = { n = rd.grid(1, 513, 513), cart_x = { 1, 2 } }, t_end = 0.1 }"
    said = batch(tmp_path, sweep, model=tmp_path / "cart.lua", status=1).stderr
    assert "sweep.lua: more than 512 structures; split the sweep into several batches" in said, said
    assert sorted(os.listdir(tmp_path)) == ["cart.lua", "sweep.lua"]


def test_help_names_the_methods_that_a_batch_takes():
    assert "bsimp" not in refdyn("batch", "--help").stdout
    assert ("bsimp" in refdyn("sim", "--help").stdout) == ("bsimp" in refdyn("sim", MODEL, "--until", "1", "--method", "bsimp", "--step", "1", status=2).stderr)


def test_one_case_again_is_interrupted(tmp_path):
    """A signal ends it between steps, and the completed rows remain readable."""
    batch(tmp_path, HEAD + 'return rd.sweep { vary = { mass = 1.3 }, t_end = 3000, every = 1, tol = 1e-10, keep = { history = { "tip_z" } } }')
    run = tmp_path / "case.csv.part"
    process = subprocess.Popen([REFDYN, "sim", "--case", "0", "--of", str(tmp_path / "runs.h5"), "-o", str(tmp_path / "case.csv")],
                               stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not (run.exists() and run.stat().st_size > 0):
        time.sleep(0.005)
    process.send_signal(signal.SIGTERM)
    said = process.communicate()[1]
    assert process.returncode in (-signal.SIGTERM, 128 + signal.SIGTERM) and "case.csv.part" in said, (process.returncode, said)
    assert 0 < len(read_run(run)["t"]) < 3001 and not (tmp_path / "case.csv").exists()


def test_csv(tmp_path):
    sweep = HEAD + """return rd.sweep { vary = { mass = rd.grid(0.5, 2, 3) }, t_end = 0.3,
      keep = { final = true, extremes = { "tip_z" }, norms = { "tip_x" } } }"""
    batch(tmp_path, sweep)
    batch(tmp_path, sweep, output="runs.csv")
    run = read_run(tmp_path / "runs.csv")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert np.array_equal(run["arm_psi"], file["final/arm_psi"][...])
        assert np.array_equal(run["tip_z_max_t"], file["extremes/tip_z"][:, 3])
        assert np.array_equal(run["tip_x_rms"], file["norms/tip_x"][...])
        assert list(run["case"]) == [0, 1, 2] and list(run["mass"]) == [0.5, 1.25, 2]


def test_csv_names_starts_apart_from_ends(tmp_path):
    (tmp_path / "cases.csv").write_text("arm_psi_d,arm_psi\n0.3173,0.2719\n-0.1381,0.4337\n")
    for name in ("runs.csv", "runs.h5"):
        refdyn("batch", MODEL, "--table", tmp_path / "cases.csv", "--until", "0.3", "-o", tmp_path / name)
    names = (tmp_path / "runs.csv").read_text().splitlines()[0].split(",")
    assert len(set(names)) == len(names) and names[1:3] == ["arm_psi_d_start", "arm_psi_start"]
    run = read_run(tmp_path / "runs.csv")
    with h5py.File(tmp_path / "runs.h5") as file:
        for name in ("arm_psi", "arm_psi_d"):
            assert np.array_equal(run[name + "_start"], file["cases/" + name][...])
            assert np.array_equal(run[name], file["final/" + name][...]) and set(run[name]) != set(run[name + "_start"])


def test_command_is_told(tmp_path):
    """The command is quoted for a shell, regardless of the characters in it."""
    import shlex
    output = "it's \"50 %\" $x.h5"
    batch(tmp_path, VARY % ("mass = 1", ""), "--from", "statics", "--hold", "", output=output)
    with h5py.File(tmp_path / output) as file:
        words = shlex.split(file.attrs["command"])
    assert words[1] == "batch" and "" in words and str(tmp_path / output) in words


@pytest.mark.quick
def test_csv_with_texts(tmp_path):
    """Names of files with a comma and quotes are readable by other programs."""
    import csv
    names = ["a,b.csv", 'say "x".csv', "plain.csv"]
    for name in names:
        (tmp_path / name).write_text("t,torque\n0,0.1\n")
    listed = ", ".join("[[%s]]" % name for name in names)
    batch(tmp_path, HEAD + "return rd.sweep { vary = { inputs = { %s } }, t_end = 0.1 }" % listed, output="runs.csv")
    with open(tmp_path / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [os.path.basename(row["inputs"]) for row in rows] == names
    assert all(row["status"] == "0" and row["t"] == "0.1" for row in rows)


def test_input_has_one_source(tmp_path):
    """Samples of an input would hide its varied number."""
    write_files(tmp_path)
    said = batch(tmp_path, HEAD + 'return rd.sweep { vary = { inputs = "gust.csv", torque = { 1, 2 } }, t_end = 0.1 }', status=1).stderr
    assert "the input torque varies as a number and in files of inputs; remove one of them" in said, said


def test_failed_cases_again(tmp_path):
    """The message equals the batch's, and no empty file remains if no motion began."""
    (tmp_path / "cases.csv").write_text("mass,torque\n-5,0\n1,1e308\n")
    refdyn("batch", MODEL, "--table", tmp_path / "cases.csv", "--until", "0.1", "--from", "statics", "-o", tmp_path / "runs.h5")
    for case, status in ((0, 1), (1, 3)):
        said = refdyn("sim", "--case", case, "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv", status=status).stderr
        assert not case and said.startswith("model.lua:10: links[1].mass: value -5") or "Newton" in said, said
    assert sorted(os.listdir(tmp_path)) == ["cases.csv", "runs.h5"]


def test_dry_run_writes_nothing_and_needs_no_name(tmp_path):
    (tmp_path / "sweep.lua").write_text(SWEEP)
    assert "cases        24" in refdyn("batch", MODEL, tmp_path / "sweep.lua", "--dry-run").stderr
    assert "-o is missing" in refdyn("batch", MODEL, tmp_path / "sweep.lua", status=2).stderr
    assert os.listdir(tmp_path) == ["sweep.lua"]


def test_summary_is_not_the_journal(tmp_path):
    said = batch(tmp_path, SWEEP, "--summary", tmp_path / "runs.h5.journal", status=2).stderr
    assert "the journal of" in said and "use another name" in said, said


@pytest.mark.quick
def test_dry_run(tmp_path):
    said = batch(tmp_path, SWEEP, "--dry-run").stderr
    assert "cases        24, 2 structures; what varies: arm_psi mass pieces" in said
    assert "time         about " in said and "file         about " in said
    assert sorted(os.listdir(tmp_path)) == ["sweep.lua"]


@pytest.mark.quick
def test_summary(tmp_path):
    import json
    batch(tmp_path, SWEEP, "--summary", tmp_path / "s.json")
    summary = json.loads((tmp_path / "s.json").read_text())
    assert set(summary) == {"refdyn", "cases", "failed", "wall_s", "cpu_s", "cases_per_s", "lanes", "threads"}
    assert summary["cases"] == CASES and summary["failed"] == 0


# ---- What goes wrong ----

LONG = HEAD + """return rd.sweep { vary = { mass = rd.grid(0.5, 2, 3000) }, t_end = 4, tol = 1e-9,
  keep = { final = true, history = { "tip_x" } }, every = 0.1 }"""


def start(folder, *arguments, sweep=LONG):
    (folder / "sweep.lua").write_text(sweep)
    return subprocess.Popen([REFDYN, "batch", str(MODEL), str(folder / "sweep.lua"), "-o", str(folder / "runs.h5"),
                             "--threads", "2", *arguments], stderr=subprocess.PIPE, text=True)


@pytest.fixture(scope="module")
def long_done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("long")
    begun = time.time()
    assert start(folder).wait() == 0
    return folder / "runs.h5", time.time() - begun


def test_killed_at_any_moment(long_done, tmp_path):
    """kill -9 at twenty random moments, each followed by a resumption; the file equals that of an undisturbed batch."""
    path, seconds = long_done
    moments = random.Random(5)
    for kill in range(20):
        process = start(tmp_path, *(["--resume"] if kill else []))
        try:
            process.wait(timeout=moments.uniform(0, seconds / 8))
            break
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    process = start(tmp_path, "--resume")
    assert process.wait() == 0, process.stderr.read()
    assert datasets(tmp_path / "runs.h5") == datasets(path)
    assert sorted(os.listdir(tmp_path)) == ["runs.h5", "sweep.lua"]


def interrupt(folder, *arguments, sweep=LONG):
    """A batch with some cases in its journal."""
    process = start(folder, *arguments, sweep=sweep)
    journal = folder / "runs.h5.journal"
    while not journal.exists() or journal.stat().st_size < 20000:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    said = process.stderr.read()
    process.wait()
    return said


def test_interrupted(long_done, tmp_path):
    said = interrupt(tmp_path)
    assert "interrupted: " in said and "--resume computes the others" in said
    assert sorted(os.listdir(tmp_path)) == ["runs.h5.journal", "sweep.lua"]
    again = start(tmp_path)
    assert "an interrupted batch has left its cases here; resume it with --resume" in again.stderr.read() and again.wait() == 1
    assert start(tmp_path, "--resume").wait() == 0
    assert datasets(tmp_path / "runs.h5") == datasets(long_done[0])


def test_resume_refuses_another_batch(tmp_path):
    interrupt(tmp_path)
    kept = (tmp_path / "runs.h5.journal").read_bytes()
    changes = {"cases": (LONG.replace("3000", "2999"), MODEL, []), "options": (LONG.replace("1e-9", "1e-8"), MODEL, [])}
    model = tmp_path / "batch.lua"
    model.write_text(MODEL.read_text() + "-- changed\n")
    changes["model files"] = (LONG, model, [])
    for what, (sweep, path, arguments) in changes.items():
        said = batch(tmp_path, sweep, "--resume", *arguments, model=path, status=1).stderr
        assert "the journal's; --resume continues only the same batch" in said and (what in said or what == "options"), said
        assert (tmp_path / "runs.h5.journal").read_bytes() == kept


def test_resume_refuses_another_range(long_done, tmp_path):
    """Completed cases are not discarded; a wider range includes them."""
    interrupt(tmp_path, "--cases", "0:2000")
    kept = (tmp_path / "runs.h5.journal").read_bytes()
    said = batch(tmp_path, LONG, "--resume", "--cases", "2500:2501", status=1).stderr
    assert "case 0 is done here, but --cases excludes it" in said, said
    assert (tmp_path / "runs.h5.journal").read_bytes() == kept
    batch(tmp_path, LONG, "--resume")
    assert datasets(tmp_path / "runs.h5") == datasets(long_done[0])


def test_resume_refuses_changed_files(tmp_path):
    write_files(tmp_path)
    interrupt(tmp_path, sweep=WITH_FILES)
    for name in ("calm.csv", "state.json"):
        text = (tmp_path / name).read_text()
        (tmp_path / name).write_text(text.replace("0.1", "0.2"))
        said = batch(tmp_path, WITH_FILES, "--resume", status=1).stderr
        assert "the files of inputs or of the state of this batch differ from the journal's" in said, said
        (tmp_path / name).write_text(text)
    batch(tmp_path, WITH_FILES, "--resume")


def test_two_writers(tmp_path):
    process = start(tmp_path)
    while not (tmp_path / "runs.h5.journal").exists():
        time.sleep(0.01)
    said = batch(tmp_path, LONG, status=1).stderr
    assert "another" in said, said
    process.kill()
    process.wait()


@pytest.mark.parametrize("damage", ["cut", "changed", "foreign"])
def test_damaged_journals(damage, long_done, tmp_path):
    interrupt(tmp_path)
    journal = tmp_path / "runs.h5.journal"
    content = bytearray(journal.read_bytes())
    if damage == "foreign":
        journal.write_bytes(b"this is a text of somebody\n" * 1000)
        assert "not a journal of a batch" in start(tmp_path, "--resume").stderr.read()
        return
    if damage == "cut":
        del content[-7:]
    else:
        content[len(content) // 2] ^= 64
    journal.write_bytes(content)
    assert start(tmp_path, "--resume").wait() == 0
    assert datasets(tmp_path / "runs.h5") == datasets(long_done[0])


def test_short_file_with_the_name_of_the_journal(tmp_path):
    """A file of the user is neither overwritten nor removed; the incomplete beginning of a journal is."""
    journal = tmp_path / "runs.h5.journal"
    journal.write_text("a note")
    assert "not a journal of a batch" in batch(tmp_path, SWEEP, status=1).stderr
    assert journal.read_text() == "a note"
    journal.write_text("refdyn ba")
    batch(tmp_path, SWEEP)
    assert not journal.exists()


def test_outputs_spare_inputs(tmp_path):
    """Files of samples and of the state, which the batch reads, are not overwritten."""
    (tmp_path / "in.csv").write_text("t,torque\n0,0.1\n")
    (tmp_path / "state.h5").write_text('{"q": [0.3, 0.1], "qd": [0, 0]}')
    sweep = HEAD + 'return rd.sweep { vary = { inputs = "in.csv" }, t_end = 0.1, from = "state.h5" }'
    for name in ("in.csv", "state.h5"):
        before = (tmp_path / name).read_bytes()
        assert "give another name" in batch(tmp_path, sweep, output=name, status=1).stderr
        assert (tmp_path / name).read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["in.csv", "state.h5", "sweep.lua"]


def test_disk_full(tmp_path):
    """On a full disk the completed results remain, and the batch resumes when there is space."""
    (tmp_path / "sweep.lua").write_text(SWEEP)

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))
    command = [REFDYN, "batch", str(MODEL), str(tmp_path / "sweep.lua"), "-o", str(tmp_path / "runs.h5")]
    refdyn("check", MODEL)
    batch(tmp_path, SWEEP, "--dry-run")  # compiled before the file size is limited
    done = subprocess.run(command, preexec_fn=limit, capture_output=True, text=True)
    assert done.returncode == 1 and "File too large" in done.stderr and "--resume" in done.stderr, done.stderr
    batch(tmp_path, SWEEP, "--resume")
    assert len(datasets(tmp_path / "runs.h5")) > 10


def test_read_only_target(tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root writes everywhere")
    (tmp_path / "closed").mkdir(mode=0o500)
    assert "Permission denied" in batch(tmp_path, SWEEP, output="closed/runs.h5", status=1).stderr


VARY = HEAD + "return rd.sweep { vary = { %s }, t_end = 0.1%s }"


@pytest.mark.parametrize("sweep, arguments, status, message", [
    (SWEEP, ["--cases", "5:25"], 2, "--cases 5:25: the batch has the cases 0 to 23; choose a range of these"),
    (SWEEP, ["--cases", "5"], 2, "--cases: '5' is not of the form A:B, the cases A to B - 1"),
    (SWEEP, ["--cases", "7:7"], 2, "--cases 7:7: the batch has the cases 0 to 23"),
    (SWEEP, ["--threads", "0"], 2, "--threads: '0' is not a positive number"),
    (SWEEP, ["--lanes", "3"], 2, "--lanes: 3 is not a lane width; use 1, 2, 4 or 8"),
    (SWEEP, ["--threads", "5000"], 2, "--threads: 5000; must be at most 1024"),
    (SWEEP, ["--table", "x.csv"], 2, "--table replaces the sweep"),
    (VARY % ("mass = { 1, 2 }", ', keep = { extremes = { "tip_zz" } }'), [], 1,
     "sweep.lua:2: keep.extremes: a motion has no column 'tip_zz'; did you mean \"tip_z\"?"),
    (VARY % ("mass = 1", ', keep = { history = { "tip_x",\n"tip_y",\n"nix" } }'), [], 1, "sweep.lua:4: keep.history: a motion has no column 'nix'"),
    (VARY % ("mass = 1", ',\nmethod = "rk9"'), [], 1, "sweep.lua:3: method: 'rk9' is not one of auto, rk4, rk54"),
    (VARY % ("mass = 1", ',\nmethod = "rk8"'), ["--method", "rk9"], 2, "--method: 'rk9' is not one of auto, rk4, rk54"),
    (VARY % ("mass = 1", ',\ntol = 5'), [], 1, "sweep.lua:3: tol must lie between the rounding of doubles and 1"),
    (VARY % ("mass = 1", ',\ntol = 1e-20'), [], 1, "sweep.lua:3: tol must lie between the rounding of doubles and 1"),
    (VARY % ("mass = 1", ',\nmethod = "rk4",\ntol = 1e-3'), [], 1, "sweep.lua:4: tol: rk4 has fixed steps; use --step"),
    (VARY % ("mass = 1", ',\nmethod = "rk4",\ntol = 1e-3'), ["--tol", "1e-3"], 2, "--tol: rk4 has fixed steps; use --step"),
    (VARY % ("mass = 1", ',\nstabilise = "x"'), [], 1, "sweep.lua:3: stabilise: 'x' is not one of none, baumgarte, baumgarte-auto, project"),
    (VARY % ("mass = 1", ',\nstart = "x"'), [], 1, "sweep.lua:3: start: 'x' is not one of as-is, project"),
    (VARY % ("mass = 1", ',\nsingular = "x"'), [], 1, "sweep.lua:3: singular: 'x' is not one of stop, pass"),
    (VARY % ("mass = 1", ',\nhold = { "tip" }'), [], 1, "sweep.lua:3: hold: needs --from statics"),
    (VARY % ("mass = 1", ',\nfrom = "statics", hold = { "nix" }'), [], 1, "sweep.lua:3: hold: the model has no coordinate 'nix'"),
    (VARY % ("mass = 1", ',\nevery = 1e-8'), [], 1, "sweep.lua:3: every 1e-08: 1e+07 outputs; must be at most 1000000"),
    (VARY % ("mass = 1", ',\nstep = 1e-12'), [], 1, "sweep.lua:3: step 1e-12: 1e+11 steps; must be at most 1000000000"),
    (VARY % ("mass = 1", ',\nfrom = "late.json"'), [], 1, "sweep.lua:2: t_end 0.1: must be after the start of the motion at t = 2"),
    (VARY % ("mass = 1", ',\nmethod = "msbdf"'), [], 1, "sweep.lua:3: method: msbdf computes single motions"),
    (VARY % ("mass = 1", ',\ngoal = 3'), [], 1, "sweep.lua:3: goal: unknown field; use one of vary, table, draws"),
    (VARY % ("mass = 1", ',\ntoll = 3'), [], 1, "sweep.lua:3: toll: unknown field; did you mean \"tol\"?"),
    (VARY % ("mass = { 1, 2 }", ", keep = { at = { 0.05, 0.2 } }"), [], 1, "sweep.lua:2: keep.at[2]: time 0.2; must not be after the end of the motions at 0.1"),
    (VARY % ("arm_psi = { 0.1, 0.2 }", ', from = "statics"'), [], 1,
     "the start value of arm_psi varies, but statics moves this coordinate; add it to hold"),
    (VARY % ("mass = { 1, 2 }", ', method = "msbdf"'), [], 1, "msbdf computes single motions"),
])
def test_refused(sweep, arguments, status, message, tmp_path):
    if "late.json" in sweep:
        sweep = sweep.replace("late.json", str(tmp_path.with_suffix(".json")))
        tmp_path.with_suffix(".json").write_text('{"t": 2}')
    said = batch(tmp_path, sweep, *arguments, status=status).stderr
    assert message in said, said
    assert sorted(os.listdir(tmp_path)) == ["sweep.lua"]


@pytest.mark.parametrize("output, message", [
    ("runs.txt", "unknown kind of file; the name must end in .h5 or .csv"),
    ("runs.csv", "a CSV has one row a case and cannot keep the times of arm_psi"), ("sweep.lua", "")])
def test_wrong_outputs(output, message, tmp_path):
    said = batch(tmp_path, SWEEP, output=output, status=2).stderr
    assert message in said, said


def test_memory_does_not_grow(tmp_path):
    """100,000 cases of a small model use less than 300 MB."""
    sweep = HEAD + "return rd.sweep { vary = { mass = rd.uniform(0.5, 2) }, draws = 100000, t_end = 0.01, tol = 1e-4, method = 'rk54' }"
    (tmp_path / "sweep.lua").write_text(sweep)
    process = subprocess.Popen([REFDYN, "batch", str(MODEL), str(tmp_path / "sweep.lua"), "-o", str(tmp_path / "runs.h5")])
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = 0
    assert status == 0 and usage.ru_maxrss < 300e3
    with h5py.File(tmp_path / "runs.h5") as file:
        assert len(file["final/arm_psi"]) == 100000 and not np.isnan(file["final/arm_psi"][...]).any()
