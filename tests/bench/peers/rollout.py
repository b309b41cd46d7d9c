"""Motions a second of refdyn batch compared with MuJoCo's rollout and its pool of threads, at one error.

Both compute the same motions of the arm with four elements, without programme and torque, for 1 s from random starts: at rest, when the
arm stays in its plane, and with a turning column, when all its modes move. For each program the quickest setting counts that brings
the end-effector of every motion within 1e-6 m of a reference. They run in turn, with the code in the cache. The time is that of the
motions alone: the call of rollout, and wall_s in the summary of batch, which includes writing the journal.
"""
import csv
import json
import statistics
import subprocess
import time

import mujoco
import mujoco.rollout
import numpy as np

import chain
import emitted
import tables

MODEL = emitted.SOURCE / "models" / "manipulator.lua"
ELEMENTS, ALLOWED, T_END = 4, 1e-6, 1.0
# Steps a second of MuJoCo's RK4, unstable at 3,000. Its other integrators are of first order, and 1e-4 m off at 100,000 steps.
STEPS = (3000, 3500, 4000, 5000, 10000)
FINEST = 20000
TOLERANCES = ("1e-4", "3e-5", "1e-5", "3e-6", "1e-6", "3e-7", "1e-7")
SETTINGS = [(method, tol) for method in ("auto", "rk8", "gauss12", "radau9") for tol in TOLERANCES]
SCENES = {"arm in its plane": 0.0, "column turning": 0.5}  # largest rate of the column at the start, rad/s


def starts(count, rate):
    """arm_psi and column_psi_d of each motion, as texts that both programs read to the same bits."""
    draw = np.random.default_rng(18)
    return [(repr(float(psi)), repr(float(turning))) for psi, turning in zip(draw.uniform(0.6, 1.0, count), rate * draw.uniform(-1, 1, count))]


def batch(folder, cases, threads, method, tol):
    """Seconds, and the places of the end-effector at the end."""
    (folder / "cases.csv").write_text("arm_psi,column_psi_d\n" + "".join(f"{psi},{rate}\n" for psi, rate in cases))
    subprocess.run([emitted.REFDYN, "batch", MODEL, "--table", folder / "cases.csv", "--set", f"n_rfe={ELEMENTS}", "--set", "program=none",
                    "--set", "drive=input", "--until", str(T_END), "--method", method, "--tol", tol, "--threads", str(threads),
                    "-o", folder / "runs.csv", "--summary", folder / "summary.json"], check=True, capture_output=True)
    with open(folder / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    places = np.array([[float(row[f"E_{axis}"] or "nan") for axis in "xyz"] for row in rows])
    return json.loads((folder / "summary.json").read_text())["wall_s"], places


class Rollout:
    """Motions of MuJoCo by RK4."""

    def __init__(self, cases, threads):
        self.model = mujoco.MjModel.from_xml_string(chain.mjcf(ELEMENTS, "RK4"))
        self.data = [mujoco.MjData(self.model) for _ in range(threads)]
        self.threads, self.kind = threads, mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.start = np.zeros((len(cases), mujoco.mj_stateSize(self.model, self.kind)))
        for row, (psi, rate) in zip(self.start, cases):
            mujoco.mj_resetData(self.model, self.data[0])
            self.data[0].qpos[2], self.data[0].qvel[1] = float(psi), float(rate)
            mujoco.mj_getState(self.model, self.data[0], row, self.kind)

    def run(self, steps):
        self.model.opt.timestep = T_END / steps
        with mujoco.rollout.Rollout(nthread=self.threads) as pool:
            begin = time.perf_counter()
            states, _ = pool.rollout(self.model, self.data, self.start, nstep=steps)
            seconds = time.perf_counter() - begin
        places = []
        for state in states[:, -1]:
            mujoco.mj_setState(self.model, self.data[0], state, self.kind)
            mujoco.mj_kinematics(self.model, self.data[0])
            arrived = abs(self.data[0].time - T_END) < 1e-6  # MuJoCo resets a motion that it loses
            places.append(self.data[0].xpos[-1].copy() if arrived else np.full(3, np.nan))
        return seconds, np.array(places)


def distance(places, reference):
    """The largest one; NaN if a motion is lost."""
    return float(np.linalg.norm(places - reference, axis=1).max())


def quickest(settings, reference):
    """Of (name, function) the quickest setting within the allowed error: name, function, error."""
    found = []
    for name, function in settings:
        seconds, places = function()
        off = distance(places, reference)
        print(f"    {name}: {len(places) / seconds:.4g} motions/s, error {off:.2g} m", flush=True)
        if off <= ALLOWED:
            found.append((seconds, name, function, off))
    return min(found, key=lambda each: each[0])[1:]


def measure(work, motions, threads, repeats):
    """The rows of the table, one for each scene and program."""
    mujoco.set_mju_user_warning(lambda text: None)  # about motions that are lost: their error shows it
    folder, rows = work / "batch", []
    folder.mkdir(exist_ok=True)
    for scene, rate in SCENES.items():
        cases = starts(motions, rate)
        theirs = Rollout(cases, threads)
        reference = batch(folder, cases, threads, "rk8", "1e-12")[1]
        apart = distance(theirs.run(FINEST)[1], reference)
        print(f"motions in a batch, {scene}: the two references are {apart:.1g} m apart", flush=True)
        if not apart < ALLOWED / 10:
            raise SystemExit("refdyn batch and rollout do not compute the same motions")
        chosen = {
            "refdyn": quickest([(f"--method {method} --tol {tol}", lambda method=method, tol=tol: batch(folder, cases, threads, method, tol))
                                for method, tol in SETTINGS], reference),
            "mujoco": quickest([(f"RK4, {steps} steps", lambda steps=steps: theirs.run(steps)) for steps in STEPS], reference)}
        seconds = {program: [] for program in chosen}
        for _ in range(repeats):
            for program, (_, function, _) in chosen.items():
                seconds[program].append(function()[0])
        for program, (setting, _, off) in chosen.items():
            rows.append({"quantity": f"{tables.BATCH}, {scene}", "program": program, "variant": setting, "n_rfe": ELEMENTS, "n": 3 * ELEMENTS + 1,
                         "us": 1e6 * statistics.median(seconds[program]) / motions, "error": off})
    return rows
