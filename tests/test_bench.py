"""tests/bench without other programs: the table of ratios, its figure, the timing of emitted C, wrong usage."""
import array
import pathlib
import shutil
import subprocess
import sys

import pytest

from program import TESTS, check, close, evaluate

BENCH = TESTS / "bench"
sys.path.insert(0, str(BENCH / "peers"))
import chain  # noqa: E402
import emitted  # noqa: E402
import tables  # noqa: E402

TIMES = [  # program, quantity, variant, microseconds, relative deviation, all of n_rfe = 4
    ("refdyn", "accelerations", "O2", 0.30, 1e-13), ("refdyn", "accelerations", "O3n_fold", 0.25, 1e-13), ("refdyn", "accelerations", "O3n_fold", 0.20, 1e-13),
    ("refdyn", "mass", "O2", 0.5, 1e-15), ("refdyn", "rows", "O2", 0.5, 1e-15), ("casadi", "accelerations", "own-O2", 0.50, 2e-10),
    ("casadi", "accelerations", "own-O3n", 0.46, 2e-10), ("casadi", "accelerations", "pinocchio-O3n", 0.10, 5e-9), ("casadi", "mass", "own-O2", 0.75, 1e-15),
    ("casadi", "mass", "pinocchio-O2", 1.5, 1e-15), ("pinocchio", "accelerations", "aba-turns", 3.0, 1e-13),
    ("pinocchio", "accelerations", "aba_world-turns", 2.6, 1e-13), ("pinocchio", "accelerations", "aba-euler", 2.0, 0.3),
    ("pinocchio", "mass", "crba+nle-turns", 1.0, 1e-15), ("pinocchio", "rows", "pv-euler", 1.0, 0.3), ("pinocchio", "rows", "constraintDynamics-turns", 4.0, 1e-13),
    ("mujoco", "accelerations", "needed", 1.6, 2e-9), ("mujoco", "mass", "crb+rne", 2.0, 1e-15),
]
RECORDS = [  # program, variant, level, seconds
    ("refdyn", "O2", "O2", 0.4), ("refdyn", "O2_fold", "O2", 0.3), ("refdyn", "O3n_fold", "O3n", None), ("casadi", "own-O2", "O2", 1.2), ("casadi", "own-O3n", "O3n", None)]


def measured_rows(times=TIMES):
    """Rows of made-up measurements, with two batches."""
    lines = [dict(program=program, quantity=quantity, variant=variant, n_rfe=4, n=13, us=us) for program, quantity, variant, us, _ in times]
    errors = {(program, quantity, variant, 4): error for program, quantity, variant, _, error in times}
    counts = {"adds": "5", "muls": "7", "divs": "1", "funcs": "2"}
    records = [dict(program=program, quantity="accelerations", variant=variant, level=level, n_rfe=4, seconds=seconds, KiB=40, **counts)
               for program, variant, level, seconds in RECORDS]
    records += [dict(program="refdyn", quantity=quantity, variant="O2", level="O2", n_rfe=4, seconds=9, KiB=40, **counts) for quantity in ("mass", "rows")]
    batches = [dict(quantity=f"{tables.BATCH}, {scene}", program=program, variant="RK4", n_rfe=4, n=13, us=us, error=5e-7)
               for scene, ratio in (("plane", 500), ("column", 30)) for program, us in (("refdyn", 1e3), ("mujoco", ratio * 1e3))]
    return tables.call_rows(lines, errors, records) + tables.build_rows(records) + batches


def cells_of(markdown):
    quantity, found = "", {}
    for line in markdown.splitlines()[2:]:
        first, program, cell = (part.strip() for part in line.split("|")[1:4])
        quantity = first or quantity
        found[quantity, program] = cell
    return found


def run(script, *arguments):
    return subprocess.run([BENCH / script, *map(str, arguments)], capture_output=True, text=True, timeout=100)


def test_ratios(tmp_path):
    rows = measured_rows()
    assert cells_of(tables.ratio_table(rows)) == {
        ("accelerations", "Refdyn"): "0.2 us, error 1e-13",
        ("accelerations", "CasADi, C"): "2.30 >= 2.2 (0.46 us)",  # the faster variant has an error of 5e-9
        ("accelerations", "Pinocchio"): "13.00 >= 10 (2.6 us)",  # Euler angles are not accurate
        ("accelerations", "MuJoCo"): "8.00 >= 7 (1.6 us, error 2e-09)",  # it has no better one
        ("accelerations, tip held", "Refdyn"): "0.5 us, error 1e-15",
        ("accelerations, tip held", "Pinocchio"): "8.00 >= 7 (4 us)",
        ("M and h", "Refdyn"): "0.5 us, error 1e-15",
        ("M and h", "CasADi, C"): "1.50 (0.75 us)",
        ("M and h", "Pinocchio"): "2.00 (1 us)",
        ("M and h", "MuJoCo"): "4.00 (2 us)",
        ("M and h", "best of CasADi, Pinocchio, MuJoCo"): "1.50 >= 1.5 (0.75 us)",
        ("generate and compile, -O2", "Refdyn"): "0.3 s",
        ("generate and compile, -O2", "CasADi, C"): "4.00 >= 1 (1.2 s)",
    }
    assert [line.split(" | ")[-2:] for line in tables.batch_table(rows).splitlines()[2:]] == [["1000", " |"], ["2", "500 |"], ["1000", " |"], ["33.3", "30 |"]]
    tables.write_csv(rows, tmp_path / "times.csv")
    read = tables.read_csv(tmp_path / "times.csv")
    assert (tables.ratio_table(read), tables.batch_table(read)) == (tables.ratio_table(rows), tables.batch_table(rows))


def test_missed_target():
    assert "| 2.00 < 2.2 (0.4 us) |" in tables.ratio_table(measured_rows([(*line[:3], 0.4 if line[3] == 0.46 else line[3], line[4]) for line in TIMES]))


@pytest.mark.parametrize("script, arguments", [
    ("peers/run", ["work", "--repeats", "0"]), ("peers/run", ["work", "--sizes", "0"]), ("peers/run", ["--only", "nothing"]),
    ("peers/run", ["--only", "batch", "--publish"]), ("peers/run", ["work", "more"])])
def test_wrong_usage(script, arguments):
    done = run(script, *arguments)
    assert done.returncode == 2 and "usage: run" in done.stderr and done.stdout == ""


def test_committed_times_are_drawn(tmp_path):
    """Tables and figure in generated/ and in docs/benchmarks.md follow from the CSV, byte for byte."""
    names = ["README.md", "times.csv", "times.svg"]
    for name in names[:2]:
        shutil.copy(tables.GENERATED / name, tmp_path)
    shutil.copy(tables.BENCHMARKS, tmp_path)
    for page, mark in ((tmp_path / "README.md", "times"), (tmp_path / "benchmarks.md", "ratios")):
        tables.between(mark, page, "nothing")
    tables.publish(tmp_path, tmp_path / "benchmarks.md")
    for name in names:
        assert (tmp_path / name).read_bytes() == (tables.GENERATED / name).read_bytes(), name
    assert (tmp_path / "benchmarks.md").read_bytes() == tables.BENCHMARKS.read_bytes()


def test_emitted_is_timed(tmp_path):
    """The model of the comparison compiles, is timed, and computes what `refdyn eval` does, with and without rows."""
    emitted.prepare(tmp_path)
    chain.write(1, tmp_path)
    q, qd, tau, qdd = chain.state(1)
    given = {"q": q, "qd": qd, "inputs": {"tau": tau[1]}}
    records = emitted.build(tmp_path, 1)
    variants = [level + fold for level in emitted.LEVELS for fold in emitted.FOLDS]
    assert {(record["quantity"], record["variant"]) for record in records} == {(quantity, variant) for quantity in emitted.QUANTITIES for variant in variants}
    lines = []
    for quantity, hold, name in (("accelerations", "none", "qdd_free"), ("rows", "tip", "qdd"), ("inverse", "none", "inverse")):
        state = {**given, "qdd": qdd, "inputs": {"tau": 0}} if quantity == "inverse" else given
        expected = evaluate(tmp_path / "refdyn" / "held.lua", state, "--set", "n_rfe=1", *emitted.SETTINGS, "--set", f"hold={hold}")[name]
        for record in (record for record in records if record["quantity"] == quantity):
            emitted.call(tmp_path, "values", *record["command"])
            line, = emitted.call(tmp_path, "times", *record["command"])
            assert line["us"] > 0 and line["n"] == 4
            values = array.array("d", (tmp_path / "values" / f"refdyn-{quantity}-{record['variant']}-1").read_bytes())
            lines.append(close(f"{quantity} {record['variant']}", list(values), expected, 1e-12))
    check(lines)


def test_implicit(tmp_path):
    """The table of an implicit step, for one length."""
    done = run("implicit", tmp_path, "--elements", "2")
    assert done.returncode == 0, done.stderr
    rows = [line.split("|")[1:-1] for line in done.stdout.splitlines()[2:]]
    assert [(row[0].strip(), int(row[2])) for row in rows] == [("manipulator", 7), ("suite_arm", 2)]
    for row in rows:
        tangent, factors, solution, step = map(float, row[7:])
        assert 0 < step and abs(step - tangent - factors - 8 * solution) < 0.01 * step


@pytest.mark.skipif(not pathlib.Path("/usr/include/cvode/cvode.h").exists(), reason="SUNDIALS is not installed")
def test_integrators(tmp_path):
    """All integrators on the scene that takes least; the best of the core gets to 1e-9 m."""
    done = run("integrators", tmp_path, "--scenes", "car axis", "--repeats", "1")
    assert done.returncode == 0, done.stderr
    decades = done.stdout[done.stdout.index("CPU ms (times the fastest)"):].splitlines()[1:]
    assert {"auto", "rk8", "radau9", "msbdf", "bsimp", "cvode", "cvode_differences", "cvode_order_2"} <= {line.split()[0] for line in decades}
    assert "-" not in decades[0].split() and any(line.startswith("cvode_order_2") and line.rstrip().endswith("-") for line in decades)


def test_shortcuts():
    """Torsion costs implicit methods no step."""
    done = run("shortcuts", "--until", "3")
    assert done.returncode == 0, done.stderr
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in done.stdout.splitlines() if line.startswith("|")]
    steps = {row[0]: (int(row[3]), int(row[4])) for row in rows if len(row) == 5 and row[1].isdigit()}
    assert set(steps) == {"rk54", "rk8", "rodas5p", "gauss12"}
    for method in "rk54", "rk8":
        assert steps[method][0] > 3 * steps[method][1]
    for method in "rodas5p", "gauss12":
        assert abs(steps[method][0] - steps[method][1]) <= 0.05 * steps[method][1]


def test_batches():
    """Each part of the measurement of batches runs and prints a positive figure; a part of another name is wrong usage."""
    done = run("batches", "--cases", 8, "--loop", 2, "--repeats", 1, "--only", "overhead,loop,threads")
    lines = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()]
    assert [what for what, _ in lines] == ["overhead a case", "2 cases of the damped arm: a loop of sim over a batch on two threads",
                                           "damped arm from statics: two threads over one"], done.stderr
    assert all(float(figure.split()[0]) > 0 for _, figure in lines), lines
    done = run("batches", "--only", "laps")
    assert done.returncode == 2 and "none of lanes, threads, overhead, loop: laps" in done.stderr
