"""Forces of rows: a drive in a closed chain reports its own force, and multipliers that are not unique are NaN."""
import json
import random

import h5py
import numpy
import pytest

from program import LONG, TESTS, check, close, evaluate, motion, read_run, refdyn, settings

CLOSED = TESTS / "models" / "row_forces" / "closed.lua"
SCENES = {"four_bar": ["crank_psi"], "geared": ["motor_psi"], "rod": ["crank_psi"], "slider": ["crank_psi"], "five_bar": ["left_psi", "right_psi"], "parallel": ["a_psi"]}


def null_space(matrix):
    _, sizes, right = numpy.linalg.svd(matrix)
    return right[(sizes > 1e-7 * sizes.max()).sum():]


def state_of(run, names, i):
    return {"t": run["t"][i], "q": [run[name][i] for name in names], "qd": [run[f"{name}_d"][i] for name in names]}


def terms_at(run, given, options, i):
    return evaluate(CLOSED, {**state_of(run, names_of(run), i), "parameters": given}, *options)


def virtual_work(terms, run, driven, i):
    """The forces of drives at row i: the work of M qdd - h - Q along motions that all other rows allow, one drive moving at a time."""
    names = terms["coordinates"]
    qdd = numpy.array([run[f"{name}_dd"][i] for name in names])
    force = numpy.array(terms["M"]) @ qdd - terms["h"] - terms["Q"]
    u, places = numpy.array(terms["u"]), [names.index(name) for name in driven]
    kept = [row for row in range(len(u)) if not any(numpy.count_nonzero(u[row]) == 1 and u[row][j] for j in places)]
    motions = null_space(u[kept])
    return numpy.linalg.solve(motions[:, places], motions @ force)


def names_of(run):
    return [name[:-2] for name in run if name.endswith("_d") and name[:-2] in run]


def random_setting(rng):
    return {"tilt_x": rng.uniform(-3, 3), "tilt_y": rng.uniform(-3, 3), "tilt_z": rng.uniform(-3, 3), "fast": rng.uniform(0.5, 3)}


@pytest.mark.parametrize("stabilise", ["project", "baumgarte"])
@pytest.mark.parametrize("scene", SCENES)
def test_virtual_work(scene, stabilise, count=20 if LONG else 1):
    """Drives of closed mechanisms turned in space, with springs, dampers, rotors and gears in their hinges. A multiplier is a number
    if and only if no null vector of u^T changes it."""
    rng = random.Random(f"{scene} {stabilise}")
    for _ in range(count):
        given, options = random_setting(rng), ["--set", f"scene={scene}", "--set", f"size={rng.choice([1e-3, 0.7, 40.0])}"]
        run, _, _ = motion(CLOSED, *options, *settings(given), "--start", "project", "--until", 0.7, "--every", 0.07, "--tol", 1e-10,
                           "--stabilise", stabilise)
        multipliers = [name for name in run if name.startswith("lambda_")]
        for i in rng.sample(range(len(run["t"])), 2):
            terms = terms_at(run, given, options, i)
            found = [run[f"force_{name}"][i] for name in SCENES[scene]]
            free = null_space(numpy.array(terms["u"]).T)
            is_open = [abs(free[:, row]).max(initial=0) > 1e-6 for row in range(len(multipliers))]
            check([close("drives", found, virtual_work(terms, run, SCENES[scene], i), 1e-7),
                   close("their multipliers", [run[f"lambda_drive_{name}"][i] for name in SCENES[scene]], found, 1e-12),
                   close("open", numpy.isnan([run[name][i] for name in multipliers]), is_open, 0.5, 1)])


def test_a_mechanism_without_redundant_rows():
    """Every force is a number. The force on the rocker is the multiplier of the rod times a lever, which is no longer than the rocker."""
    run, said, summary = motion(CLOSED, "--set", "scene=rod", "--start", "project", "--until", 0.5, "--tol", 1e-9)
    slope = run["force_rocker_psi"] / run["lambda_distance_1"]
    assert "not unique" not in said and summary["units"]["lambda_distance_1"] == "N" and summary["units"]["lambda_drive_crank_psi"] == "N m"
    assert not numpy.isnan(list(run.values())).any() and numpy.ptp(slope) > 0.01 and abs(slope).max() < 0.8


def test_forces_that_are_not_unique(tmp_path):
    """Two drives that do the same: each share is NaN, which messages, limits, figures and pages say or show as a gap."""
    csv, h5, summary = (tmp_path / f"run.{kind}" for kind in ("csv", "h5", "json"))
    scene = ["--set", "scene=twice", "--start", "project", "--until", 0.2, "--every", 0.02]
    said = refdyn("sim", CLOSED, *scene, "-o", csv, "--summary", summary).stderr
    assert "these forces are not unique and are nan in the results: the multiplier of pin x" in said and "force_a_psi, force_b_psi" in said
    assert "torque: redundant rows share force_a_psi" in said
    limit, = json.loads(summary.read_text())["limits"]
    assert limit["smallest"] is None and limit["largest"] is None
    run = read_run(csv)
    assert numpy.isnan(run["force_a_psi"]).all() and numpy.isfinite(run["force_c_psi"]).all() and numpy.isfinite(run["a_psi_dd"]).all()
    refdyn("sim", CLOSED, *scene, "-o", h5)
    with h5py.File(h5) as file:
        rows = [name.decode() for name in file["lambda_row"]]
        assert numpy.array_equal(file["lambda"], numpy.array([run[name] for name in rows]).T, equal_nan=True) and rows[-1] == "lambda_drive_b_psi"
    for path in (csv, h5):
        refdyn("plot", path, "-o", tmp_path / "run.svg")
        assert "nan" not in (tmp_path / "run.svg").read_text()
    refdyn("view", csv, "--model", CLOSED, "--set", "scene=twice", "-o", tmp_path / "run.html")


def test_outputs_do_not_change_a_motion_with_redundant_rows():
    arguments = ["--set", "scene=parallel", "--set", "tilt_x=0.4", "--start", "project", "--until", 0.6]
    few, many = (motion(CLOSED, *arguments, "--every", every)[0] for every in (0.6, 0.01))
    assert all(numpy.array_equal(few[name][-1], many[name][-1], equal_nan=True) for name in few)


def test_a_singular_position():
    """Where all bars lie on one line, the multipliers of the loop have poles; the drive's force is smooth."""
    arguments = ["--set", "scene=fold", "--start", "project", "--singular", "pass", "--until", 1, "--every", 0.02, "--tol", 1e-9]
    run, _, summary = motion(CLOSED, *arguments)
    near = numpy.array([-4, -3, -2, 2, 3, 4])
    smooth = numpy.polyval(numpy.polyfit(near, run["force_a_psi"][25 + near], 5), 0)
    assert summary["passed"]["count"] == 1 and numpy.isnan(run["lambda_pin_x"][25]) and abs(run["lambda_pin_x"][24]) > 100
    check([close("drive", run["force_a_psi"][25], smooth, 1e-6), close("multiplier", run["lambda_drive_a_psi"][25], smooth, 1e-6)])


@pytest.mark.parametrize("scene, column", [("slider", "force_crank_psi"), ("slider", "lambda_pin_x"), ("five_bar", "force_right_psi")])
def test_derivatives(scene, column):
    arguments = ["--set", f"scene={scene}", "--start", "project", "--until", 0.5, "--every", 0.1, "--tol", 1e-11]
    run, _, _ = motion(CLOSED, *arguments, "--derivatives", "fast")
    low, high = (motion(CLOSED, *arguments, "--set", f"fast={1 + change}")[0][column] for change in (-1e-4, 1e-4))
    check([close(column, run[f"d_{column}_by_fast"][1:], (high - low)[1:] / 2e-4, 1e-5)])


def test_batches_keep_the_same_forces(tmp_path):
    sweep = tmp_path / "sweep.lua"
    sweep.write_text('local rd = require "refdyn"\nreturn rd.sweep { t_end = 0.4, every = 0.1, vary = { fast = rd.grid(0.5, 2, 4) },\n'
                     '  keep = { history = { "force_crank_psi", "lambda_distance_1" } } }\n')
    refdyn("batch", CLOSED, sweep, "--set", "scene=rod", "--start", "project", "--tol", 1e-9, "-o", tmp_path / "runs.h5")
    with h5py.File(tmp_path / "runs.h5") as file:
        for i, fast in enumerate(file["cases/fast"]):
            run, _, _ = motion(CLOSED, "--set", "scene=rod", "--set", f"fast={fast!r}", "--start", "project", "--until", 0.4, "--every", 0.1, "--tol", 1e-9)
            check([close(name, file["history"][name][i], run[name], 1e-6) for name in ("force_crank_psi", "lambda_distance_1")])
