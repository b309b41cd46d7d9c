"""Reports of batches: CPU time, lanes, reasons in CSV, the quantities that a figure shows."""
import csv
import json
import os
import resource
import signal
import subprocess
import time
import xml.etree.ElementTree as xml

import h5py
import numpy as np
import pytest

from program import REFDYN, REFERENCE, SOURCE, TESTS, refdyn

PENDULUM = TESTS / "batch" / "model.lua"
SPATIAL = SOURCE / "models" / "fourbar.lua"
FRICTION = TESTS / "models" / "friction" / "pendulum.lua"
EVENT = """local rd = require "refdyn"
local p = rd.parameters { { "mass", 1, "kg" }, { "a_idle", 0, "1" }, { "a_spare", 0, "1" }, { "shape", 1, "1" } }
return rd.model { name = "swing", gravity = { 0, 0, -9.81 },
  links = { { "arm", joint = "psi", turn = { { "x", rd.pi / 2 } }, mass = p.mass, center = { 0.4, 0, 0 }, inertia = { zz = 0.02 } } },
  points = { tip = { on = "arm", at = { 0.4, 0, 0 } } },
  EVENTS }
"""
ENDS = 'events = function(s) return { rd.event { s.q.arm_psi + 0.5, name = "low, and slow", ends = true } } end,'
DAMPED = ["--set", "eta=1.3e-3", "--from", "statics", "--until", 0.3]
LONG = ["--set", "n_rfe=12", "--set", "program=none", "--set", "eta=1.3e-3", "--until", 0.1]


def table(folder, **columns):
    path = folder / "cases.csv"
    path.write_text(",".join(columns) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in zip(*columns.values())))
    return path


def batch(folder, model, *arguments, output="runs.h5", **options):
    refdyn("batch", model, *arguments, "-o", folder / output, "--summary", folder / "summary.json", cwd=folder, **options)
    return json.loads((folder / "summary.json").read_text())


def numbers(path, without=()):
    """All numbers of a file, by name."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[...]}) if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and name not in without else None)
    return found


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


# ---- Processor time ----

def spent_by_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@pytest.mark.parametrize("cases, arguments", [
    (1, ["--lanes", 4, "--threads", 1, "--until", 20]),
    (3, ["--lanes", 8, "--threads", 2, "--until", 10]),
    (2, ["--lanes", 1, "--threads", 2, "--until", 10]),
    (6000, ["--set", "n_rfe=1", "--lanes", 2, "--threads", 1, "--until", 1e-6])])
def test_time_is_what_was_spent(cases, arguments, tmp_path):
    """With idle lanes, several threads, and where journal and file take most of the time."""
    loads = table(tmp_path, m_E=list(np.linspace(1, 3, cases)))
    common = ["--table", loads, "--set", "program=none", "--method", "rk8", *arguments]
    nothing = ["--cases", "0:1", *common[:-1], 1e-6]
    batch(tmp_path, REFERENCE, *nothing, output="nothing.h5")  # compiled
    before = spent_by_children()
    batch(tmp_path, REFERENCE, *nothing, output="nothing.h5")
    between = spent_by_children()
    summary = batch(tmp_path, REFERENCE, *common)
    spent = spent_by_children() - between - (between - before)
    assert 0.6 * spent < summary["cpu_s"] < 1.1 * spent + 0.03, (summary, spent)
    assert summary["cpu_s"] < 1.05 * summary["threads"] * summary["wall_s"] + 0.01
    assert numbers(tmp_path / "runs.h5")["cpu_s"].sum() == pytest.approx(summary["cpu_s"], rel=1e-9)


def test_time_adds_up_where_cases_fail_or_end(tmp_path):
    """Refused, not finite, ended by an event, of several structures: each has its share, and the sum is complete."""
    (tmp_path / "swing.lua").write_text(EVENT.replace("EVENTS", ENDS))
    loads = table(tmp_path, mass=[1.0, -1.0, 1.0, 2.0, 1.0], arm_psi_d=[0.0, 0.0, 1e200, 0.1, -3.0])
    for arguments in (["--lanes", 4], ["--lanes", 1, "--threads", 3], ["--step", 1e-3]):
        summary = batch(tmp_path, "swing.lua", "--table", loads, "--until", 1, *arguments)
        cpu = numbers(tmp_path / "runs.h5")["cpu_s"]
        assert summary["failed"] > 0 and (cpu > 0).all() and cpu.sum() == pytest.approx(summary["cpu_s"], rel=1e-9)
    (tmp_path / "sweep.lua").write_text("""local rd = require "refdyn"
      return rd.sweep { vary = { pieces = { 2, 3 }, mass = rd.grid(1, 2, 5) }, t_end = 0.3 }""")
    summary = batch(tmp_path, PENDULUM, "sweep.lua")
    assert numbers(tmp_path / "runs.h5")["cpu_s"].sum() == pytest.approx(summary["cpu_s"], rel=1e-9)


def test_time_of_parts_adds_up(tmp_path):
    loads = table(tmp_path, mass=list(np.linspace(1, 2, 9)))
    total = 0
    for part in ("0:4", "4:9"):
        total += batch(tmp_path, PENDULUM, "--table", loads, "--until", 0.5, "--cases", part, "--resume", output=part[0] + ".h5")["cpu_s"]
    refdyn("merge", "0.h5", "4.h5", "-o", "all.h5", cwd=tmp_path)
    assert numbers(tmp_path / "all.h5")["cpu_s"].sum() == pytest.approx(total, rel=1e-9)


def test_a_long_case_has_the_larger_share(tmp_path):
    """The other cases end at once; time that a case uses alone is its own."""
    loads = table(tmp_path, eta=[1e-3, 0.0, 1e-3, 1e-3])
    for lanes in (1, 4):
        batch(tmp_path, REFERENCE, "--table", loads, "--set", "program=none", "--method", "rodas5p", "--until", 8, "--tol", 1e-7, "--lanes", lanes, "--threads", 1)
        cpu = numbers(tmp_path / "runs.h5")["cpu_s"]
        steps = numbers(tmp_path / "runs.h5")["steps"]
        assert steps[1] > 3 * steps[0] and cpu[1] > 1.5 * max(cpu[[0, 2, 3]]), (lanes, steps, cpu)


# ---- Lanes ----

@pytest.mark.parametrize("method, tol, most", [("auto", 1e-6, 1e-11), ("radau9", 1e-6, 1e-11), ("gauss12", 1e-6, 1e-11), ("gauss12", 1e-4, 1e-11),
                                               ("radau9", 1e-4, 1e-11), ("rodas5p", 1e-6, 1e-11)])
def test_lanes_differ_by_rounding(method, tol, most, tmp_path):
    """Neither the length of the last step, determined by the step before, nor a failing step changes decisions in lanes."""
    loads = table(tmp_path, m_E=[1.0, 1.4, 1 + 2 / 3, 7 / 3, 3.0])
    for lanes in (1, 4):
        batch(tmp_path, REFERENCE, "--table", loads, *DAMPED, "--method", method, "--tol", tol, "--lanes", lanes, output=f"{lanes}.h5")
    one, four = numbers(tmp_path / "1.h5"), numbers(tmp_path / "4.h5")
    assert one["steps"].tolist() == four["steps"].tolist()
    for name in one:
        if name.startswith("final/"):
            assert np.max(abs(one[name] - four[name])) < most * max(1, np.max(abs(one[name]))), name


@pytest.mark.parametrize("model, column, arguments", [
    (REFERENCE, "m_E", [*LONG, "--method", "auto", "--tol", 1e-8]), (REFERENCE, "m_E", [*LONG, "--method", "radau9"]),
    (REFERENCE, "m_E", [*LONG, "--method", "rodas5p"]), (SPATIAL, "a", ["--set", "joints=spatial", "--until", 1]),
    (FRICTION, "w", ["--until", 1])])
def test_steps_that_lanes_leave_are_those_of_one(model, column, arguments, tmp_path):
    """Tangents as vectors of joints, redundant rows, friction: the same bits, since a motion continues with its own factors."""
    low = {"m_E": 1.0, "a": 0.2, "w": 1e-6}[column]
    loads = table(tmp_path, **{column: [low * (1 + 0.01 * i) for i in range(6)]})
    kept = []
    for lanes in (1, 4):
        batch(tmp_path, model, "--table", loads, *arguments, "--lanes", lanes)
        kept.append(numbers(tmp_path / "runs.h5", without=["cpu_s"]))
    assert all(kept[0][name].tobytes() == values.tobytes() for name, values in kept[1].items())


def default_lanes(folder, model, *arguments):
    return batch(folder, model, *arguments)["lanes"]


def test_default_lanes_have_two_cases_each(tmp_path):
    """One case and three cases run one by one, as in `refdyn sim`; parts of a batch have the lanes of the whole."""
    widest = default_lanes(tmp_path, PENDULUM, "--table", table(tmp_path, mass=[1 + i / 64 for i in range(64)]), "--until", 1e-3)
    assert widest in (2, 4, 8)
    assert default_lanes(tmp_path, PENDULUM, "--table", tmp_path / "cases.csv", "--until", 1e-3, "--cases", "0:1") == widest
    for cases, lanes in ((1, 1), (3, 1), (4, 2), (7, 2), (8, 4), (16, 8)):
        loads = table(tmp_path, mass=[1 + i / 64 for i in range(cases)])
        assert default_lanes(tmp_path, PENDULUM, "--table", loads, "--until", 1e-3) == min(lanes, widest)
    refdyn("sim", PENDULUM, "--set", "mass=1.0", "--until", 0.4, "--every", 0.4, "-o", tmp_path / "sim.csv")
    batch(tmp_path, PENDULUM, "--table", table(tmp_path, mass=[1.0]), "--until", 0.4)
    assert numbers(tmp_path / "runs.h5")["final/arm_psi"][0] == float(rows(tmp_path / "sim.csv")[-1]["arm_psi"])


def test_default_lanes_count_cases_of_a_structure(tmp_path):
    (tmp_path / "sweep.lua").write_text("""local rd = require "refdyn"
      return rd.sweep { vary = { pieces = { 2, 3 }, mass = { 1, 2, 3 } }, t_end = 0.3 }""")
    assert default_lanes(tmp_path, PENDULUM, "sweep.lua") == 1
    loads = table(tmp_path, mass=[1 + i / 64 for i in range(16)])
    assert default_lanes(tmp_path, PENDULUM, "--table", loads, "--until", 0.1, "--step", 0.01) == 1
    refdyn("sim", "--case", 3, "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv", cwd=tmp_path)
    assert float(rows(tmp_path / "case.csv")[-1]["arm_psi"]) == numbers(tmp_path / "runs.h5")["final/arm_psi"][3]


def test_named_events_go_without_lanes(tmp_path):
    """Steps are counted, and the numbers equal those of one lane, also in `sim --case`."""
    (tmp_path / "swing.lua").write_text(EVENT.replace("EVENTS", ENDS))
    loads = table(tmp_path, mass=[1.0 + i / 8 for i in range(8)])
    done = refdyn("batch", "swing.lua", "--table", loads, "--until", 1, "-o", "four.h5", "--lanes", 4, cwd=tmp_path)
    batch(tmp_path, "swing.lua", "--table", loads, "--until", 1, "--lanes", 1, output="one.h5")
    four, one = numbers(tmp_path / "four.h5", ["cpu_s"]), numbers(tmp_path / "one.h5", ["cpu_s"])
    assert f"of {one['steps'].sum()} steps {one['steps'].sum()} were taken one by one" in done.stderr
    assert all(one[name].tobytes() == values.tobytes() for name, values in four.items())
    refdyn("sim", "--case", 5, "--of", "four.h5", "-o", "case.csv", cwd=tmp_path)
    assert float(rows(tmp_path / "case.csv")[-1]["arm_psi_d"]) == four["final/arm_psi_d"][5]


# ---- Reasons in CSV ----

def test_csv_has_the_reasons(tmp_path):
    """For cases that are refused, that fail or that an event ends, with its comma, as in HDF5."""
    (tmp_path / "swing.lua").write_text(EVENT.replace("EVENTS", ENDS))
    loads = table(tmp_path, mass=[1.0, -1.0, 1.0, 1.0], arm_psi_d=[0.0, 0.0, 1e200, 9.0])
    for output in ("runs.csv", "runs.h5"):
        batch(tmp_path, "swing.lua", "--table", loads, "--until", 0.6, output=output)
    with h5py.File(tmp_path / "runs.h5") as file:
        reasons = [text.decode() for text in file["reason"][()]]
    found = rows(tmp_path / "runs.csv")
    assert [row["reason"] for row in found] == reasons and list(found[0])[-1] == "reason"
    assert [row["status"] for row in found] == ["0", "1", "3", "0"] and "low, and slow" in reasons[0]
    assert all(reasons[:3]) and not reasons[3]


def test_csv_of_numbers_stays_so(tmp_path):
    batch(tmp_path, PENDULUM, "--table", table(tmp_path, mass=[1.0, 2.0]), "--until", 0.1, output="runs.csv")
    assert "reason" not in rows(tmp_path / "runs.csv")[0]
    assert np.loadtxt(tmp_path / "runs.csv", delimiter=",", skiprows=1).shape[0] == 2


def test_csv_has_reasons_of_the_call_before(tmp_path):
    """The failing case is in the journal that --resume reads."""
    (tmp_path / "swing.lua").write_text(EVENT.replace("EVENTS", ""))
    loads = table(tmp_path, mass=[1.0] * 40, arm_psi_d=[1e200] + [1.0 + i for i in range(39)])
    command = ["batch", "swing.lua", "--table", "cases.csv", "--until", "400", "--tol", "1e-10", "--threads", "1", "--lanes", "1", "-o", "runs.csv"]
    process = subprocess.Popen([REFDYN, *command], cwd=tmp_path, stderr=subprocess.DEVNULL)
    journal = tmp_path / "runs.csv.journal"
    while process.poll() is None and not (journal.exists() and os.stat(journal).st_size > 1000):
        time.sleep(0.005)
    process.send_signal(signal.SIGTERM)
    process.wait()
    assert loads.exists() and journal.exists()
    refdyn(*command, "--resume", cwd=tmp_path)
    found = rows(tmp_path / "runs.csv")
    assert found[0]["status"] == "3" and found[0]["reason"] and not any(row["reason"] for row in found[1:])


# ---- Figures ----

SWEEP = """local rd = require "refdyn"
return rd.sweep { vary = { a_idle = rd.uniform(0, 1), mass = rd.uniform(1, 2), a_spare = VALUES, arm_psi = rd.uniform(-1, 1) },
  draws = 60, seed = 4, t_end = 1e-3, keep = { final = true } }
"""


@pytest.mark.parametrize("values", ["rd.grid(0, 1, 2)", "rd.normal(0, 1)", "{ 1, 2, 3 }"])
@pytest.mark.parametrize("panel", ["final/tip_z", "final/tip_x"])
def test_figures_show_what_correlates(values, panel, tmp_path):
    """The start value is last by name; tip_x is an even function of it, which a linear correlation misses."""
    (tmp_path / "swing.lua").write_text(EVENT.replace("EVENTS", ""))
    (tmp_path / "sweep.lua").write_text(SWEEP.replace("VALUES", values))
    batch(tmp_path, "swing.lua", "sweep.lua")
    refdyn("plot", "runs.h5", "--panel", panel, "-o", "runs.svg", cwd=tmp_path)
    texts = " ".join(text.text or "" for text in xml.parse(tmp_path / "runs.svg").getroot().iter("{http://www.w3.org/2000/svg}text"))
    assert "arm_psi" in texts, texts


@pytest.mark.parametrize("law, shown", [("c.c - 0.01 * c.a", "c"), ("(c.d - 0.5)^2 + 0.001 * c.a", "d"), ("c.b == 'two' and 1 or 0", "b")])
def test_each_chart_has_its_own_quantities(law, shown, tmp_path):
    """Of four quantities, one of them a text, the second chart shows other ones than the first."""
    model = """local rd = require "refdyn"
      local b = rd.option("b", "one", { "one", "two", "three" })
      local p = rd.parameters { { "a", 0, "1" }, { "c", 0, "1" }, { "d", 0, "1" }, { "y", 0, "m" } }
      return rd.model { name = "law", links = { { "block", joint = "x", mass = 1, start = { x = p.y } } } }"""
    (tmp_path / "law.lua").write_text(model)
    (tmp_path / "sweep.lua").write_text("""local rd = require "refdyn"
      return rd.sweep { vary = { a = rd.uniform(0, 1), b = { "one", "two", "three" }, c = rd.uniform(0, 1), d = rd.uniform(0, 1) },
        derive = function(c) return { y = LAW } end, draws = 20, t_end = 1e-3, keep = { final = true } }""".replace("LAW", law))
    batch(tmp_path, "law.lua", "sweep.lua")
    refdyn("plot", "runs.h5", "--panel", "final/block_x", "-o", "runs.svg", cwd=tmp_path)
    texts = [text.text or "" for text in xml.parse(tmp_path / "runs.svg").getroot().iter("{http://www.w3.org/2000/svg}text")]
    assert any(text.startswith((shown + " ", shown + ":")) or text == shown for text in texts), texts


def test_the_page_names_what_xarray_needs():
    page = (SOURCE / "docs" / "batches.md").read_text().partition("## Reading results")[2]
    assert "pip install xarray h5netcdf" in page
