"""tests/bench without the peers: the table of ratios, its figure, the timing of emitted C, wrong usage."""
import json
import pathlib
import shutil
import subprocess
import sys

import pytest

from program import REFDYN, TESTS, check, close, evaluate

BENCH = TESTS / "bench"
sys.path.insert(0, str(BENCH))
import emitted  # noqa: E402
import publish  # noqa: E402
import ratios  # noqa: E402

RESULTS = [  # program, variant, n_rfe, microseconds
    ("refdyn", "qdd_free/O2", 4, 0.30), ("refdyn", "qdd_free/O3n_fold", 4, 0.25), ("refdyn", "qdd_free/O3n_fold", 4, 0.20),
    ("refdyn", "M_and_h/O2", 4, 0.5), ("refdyn", "qdd/O2", 4, 0.5), ("casadi", "ca_fd_O2", 4, 0.50), ("casadi", "ca_fd_O3n", 4, 0.46),
    ("casadi", "pinca_fd_O3n", 4, 0.10), ("casadi", "ca_mh_O2", 4, 0.75), ("casadi", "ca_lag_O2", 4, 1.5), ("pinocchio", "fd_aba/rz,ry,rx", 4, 3.0),
    ("pinocchio", "fd_aba_world/rz,ry,rx", 4, 2.6), ("pinocchio", "fd_aba/sphericalZYX", 4, 2.0), ("pinocchio", "fd_crba_nle_llt/rz,ry,rx", 4, 0.1),
    ("pinocchio", "M_and_h/rz,ry,rx", 4, 1.0), ("pinocchio", "fd_constrained_3d_pv/sphericalZYX", 4, 1.0),
    ("pinocchio", "fd_constrained_3d/rz,ry,rx", 4, 4.0), ("mujoco", "fd_lean(kin)", 4, 1.6), ("mujoco", "M_and_h", 4, 2.0),
]
ERRORS = {"refdyn-O2": "1.0e-13", "refdyn-O3n_fold": "1.0e-13", "ca_fd-O3n": "2.0e-10", "pinca_fd-O3n": "5.0e-9", "pinocchio": "1.0e-13",
          "pinocchio_zyx": "3.0e-01", "mujoco": "2.0e-09"}


def write_lines(path, lines):
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))


@pytest.fixture
def work(tmp_path):
    """A working folder with made-up measurements."""
    out = tmp_path / "out"
    out.mkdir()
    write_lines(out / "results.jsonl", [dict(peer=peer, what=what, n_rfe=n_rfe, n=3 * n_rfe + 1, us=us) for peer, what, n_rfe, us in RESULTS])
    write_lines(out / "agree.jsonl", [dict(agree=name, n_rfe=4, n=13, norm=error) for name, error in ERRORS.items()])
    write_lines(out / "ca_gen.log", [dict(peer="casadi", what="gen_ca_fd", n_rfe=4, n=13, gen_s=0.5)])
    write_lines(out / "ca_compile.log", [dict(what="compile_ca_fd_O2", n_rfe=4, ok=True, cpu_s=0.7, C_KiB=60),
                                         dict(what="compile_ca_fd_O3n", n_rfe=4, ok=False, cpu_s=150, C_KiB=60)])
    write_lines(out / "refdyn_build.jsonl", [dict(what=what, n_rfe=4, adds=5, muls=7, divs=1, funcs=2, gen_s=0.1, cc_s=seconds, C_KiB=40)
                                             for what, seconds in (("qdd_free/O2", 0.3), ("qdd_free/O2_fold", 0.2), ("qdd/O2", 9))])
    return tmp_path


def run(script, *arguments):
    return subprocess.run([BENCH / script, *map(str, arguments)], capture_output=True, text=True, timeout=100)


def test_ratios(work):
    done = run("ratios.py", work, "--csv", work / "times.csv")
    assert done.returncode == 0, done.stderr
    quantity, found = "", {}
    for line in done.stdout.splitlines()[2:]:
        first, program, cell = (part.strip() for part in line.split("|")[1:4])
        quantity = first or quantity
        found[quantity, program] = cell
    assert found == {
        ("accelerations", "Refdyn"): "0.2 us, error 1e-13",
        ("accelerations", "CasADi, C"): "2.30 >= 2.2 (0.46 us)",  # the faster one is off by 5e-9
        ("accelerations", "Pinocchio"): "13.00 >= 10 (2.6 us)",  # neither its Euler angles nor what is no articulated body
        ("accelerations", "MuJoCo"): "8.00 >= 7 (1.6 us, error 2e-09)",  # it has no better one
        ("accelerations with two rows", "Refdyn"): "0.5 us",
        ("accelerations with two rows", "Pinocchio"): "8.00 >= 7 (4 us)",
        ("M and h", "Refdyn"): "0.5 us",
        ("M and h", "CasADi, C"): "1.50 (0.75 us)",
        ("M and h", "Pinocchio"): "2.00 (1 us)",
        ("M and h", "MuJoCo"): "4.00 (2 us)",
        ("M and h", "best of CasADi, Pinocchio, MuJoCo"): "1.50 >= 1.5 (0.75 us)",
        ("generate and compile, -O2", "Refdyn"): "0.3 s",
        ("generate and compile, -O2", "CasADi, C"): "4.00 >= 1 (1.2 s)",
    }
    assert run("ratios.py", work / "times.csv").stdout == done.stdout


def test_missed_target(work):
    text = (work / "out" / "results.jsonl").read_text()
    (work / "out" / "results.jsonl").write_text(text.replace("0.46", "0.4"))
    assert "| 2.00 < 2.2 (0.4 us) |" in run("ratios.py", work).stdout


@pytest.mark.parametrize("script, arguments", [
    ("peers", []), ("peers", ["nowhere"]), ("peers", ["nowhere", "work"]), ("peers", [BENCH, "work"]), ("ratios.py", []),
    ("ratios.py", ["nowhere"]), ("ratios.py", [BENCH, "--csv"]), ("publish.py", ["nowhere"]), ("publish.py", ["--nothing"])])
def test_wrong_usage(script, arguments):
    done = run(script, *arguments)
    assert done.returncode == 2 and "usage: " + script in done.stderr and done.stdout == ""


def test_committed_times_are_drawn(tmp_path):
    """Table and figure in generated/ are what their CSV gives, byte for byte."""
    names = ["README.md", "times.csv", "times.svg"]
    for name in names[:2]:
        shutil.copy(publish.GENERATED / name, tmp_path)
    text = (tmp_path / "README.md").read_text()
    (tmp_path / "README.md").write_text(publish.MARKS.sub(r"\1\2", text))
    assert run("publish.py", tmp_path).returncode == 0
    for name in names:
        assert (tmp_path / name).read_bytes() == (publish.GENERATED / name).read_bytes(), name


def test_emitted_is_timed(tmp_path):
    """The bench's models compile and give the accelerations that `refdyn eval` gives for the same inputs."""
    emitted.prepare(tmp_path)
    names = ["base_z", "column_psi", "arm_psi", "effector_z"]
    q, qd, tau = [0.02, -0.8, 0.7, 0.07], [0.3, -0.8, -0.7, -0.6], [-0.7, 1.0, 0.5, -0.5]
    (tmp_path / "state.txt").write_text("\n".join(" ".join(map(str, row)) for row in (q, qd, tau)))
    driven = {"q": q, "qd": qd, "inputs": {f"tau_{name}": value for name, value in zip(names, tau)}}
    records = {record["what"]: record for record in emitted.build(REFDYN, tmp_path, 1)}
    variants = [level + fold for level in emitted.LEVELS for fold in emitted.FOLDS]
    assert set(records) == {f"{quantity}/{variant}" for quantity in emitted.QUANTITIES for variant in variants} | {"driven/O2", "driven/O2_fold"}
    lines = []
    for quantity, model, state, program in (("qdd_free", "manipulator.lua", {"q": q, "qd": qd}, "none"), ("qdd", "manipulator.lua", {"q": q, "qd": qd}, "consistent"),
                                            ("driven", "driven.lua", driven, "none")):
        settings = ["--set", "n_rfe=1", "--set", f"program={program}", "--set", "drive=input"]
        expected = evaluate(tmp_path / model, state, *settings)["qdd" if quantity == "qdd" else "qdd_free"]
        for what in (what for what in records if what.startswith(quantity + "/")):
            line = emitted.time_one(tmp_path, records[what], tmp_path / "state.txt", tmp_path / "result.txt", None)
            assert line["us"] > 0 and line["n"] == 4
            lines.append(close(what, [float(text) for text in (tmp_path / "result.txt").read_text().split()], expected, 1e-12))
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
