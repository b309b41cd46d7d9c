"""Refdyn's side: C of each quantity, emitted, compiled in several ways, and timed."""
import json
import os
import pathlib
import re
import shutil
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[2]
REFDYN = os.path.abspath(os.environ.get("REFDYN", SOURCE / "build" / "release" / "bin" / "refdyn"))
NAME = "manipulator"
LEVELS = {"O2": ["-O2"], "O3n": ["-O3", "-march=native"]}
SOURCES = [REFDYN, HERE / "held.lua", SOURCE / "models" / "manipulator.lua", SOURCE / "runtime" / "refdyn_model.h"]
FOLDS = {"": [], "_fold": ["--fold"]}  # parameters as symbols or as numbers
SETTINGS = ["--set", "program=none", "--set", "drive=input"]
PATIENCE = 150  # CPU seconds of one compilation, for all programs
DERIVATIVES = ("d_accelerations", "d_rows", "d_inverse")
# Option `hold` of held.lua, the functions to emit, those to call, and the doubles of the result of each.
QUANTITIES = {
    "accelerations": ("none", "qdd_free", ["qdd_free"], lambda n: [n]),
    "rows": ("tip", "qdd", ["qdd"], lambda n: [n]),
    "mass": ("none", "M_h", ["M_h"], lambda n: [n * n + n]),
    "d_accelerations": ("none", "d_qdd_free.q,d_qdd_free.qd", ["d_qdd_free"], lambda n: [2 * n * n]),
    "d_rows": ("tip", "d_qdd.q,d_qdd.qd", ["d_qdd"], lambda n: [2 * n * n]),
    "inverse": ("none", "inverse", ["inverse"], lambda n: [n]),
    "d_inverse": ("none", "d_inverse.q,d_inverse.qd,d_inverse.qdd", ["d_inverse"], lambda n: [3 * n * n]),
}


def kept(path, sources, make):
    """What `make` returns, kept in a file until one of its sources changes."""
    if not path.exists() or path.stat().st_mtime < max(pathlib.Path(source).stat().st_mtime for source in sources):
        path.write_text(json.dumps(make()))
    return json.loads(path.read_text())


def measured(command, **options):
    """Exit status, CPU seconds and standard output of a command and of the processes that it started."""
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True, **options)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, output


def compile_c(sources, level, library, *options):
    """CPU seconds of gcc, None if it took too long."""
    status, seconds, _ = measured(["prlimit", f"--cpu={PATIENCE}", "gcc", *LEVELS[level], "-fPIC", "-shared", *options, *sources, "-o", library, "-lm"],
                                  stderr=subprocess.DEVNULL)
    if status and seconds < PATIENCE:
        raise SystemExit(f"{sources[0]}: gcc fails")
    if status:
        library.unlink(missing_ok=True)
    return None if status else seconds


def prepare(work):
    """The model and the timing program in the working folder."""
    for name in ("models", "values", "refdyn"):
        (work / name).mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE / "held.lua", work / "refdyn")
    shutil.copy(SOURCE / "models" / "manipulator.lua", work / "refdyn")
    subprocess.run(["gcc", "-O2", "-Wall", "-I", HERE, "-I", SOURCE / "runtime", HERE / "time_emitted.c", "-o", work / "time_emitted", "-ldl"], check=True)


def emit(work, quantity, n_rfe, fold):
    """Writes the C; returns its folder, the CPU seconds and the counted operations."""
    hold, wanted, called, _ = QUANTITIES[quantity]
    folder = work / "refdyn" / f"{quantity}{fold}_{n_rfe}"
    shutil.rmtree(folder, ignore_errors=True)
    status, seconds, summary = measured([REFDYN, "gen", work / "refdyn" / "held.lua", "--set", f"n_rfe={n_rfe}", *SETTINGS,
                                         "--set", f"hold={hold}", "--emit", wanted, *FOLDS[fold], "-o", folder])
    if status:
        raise SystemExit(f"refdyn gen fails: {quantity}, n_rfe={n_rfe}")
    counts = [re.search(rf"^{name} +(\d+) +(\d+) +(\d+) +(\d+)$", summary, re.M).groups() for name in called]
    return folder, seconds, dict(zip(("adds", "muls", "divs", "funcs"), (sum(map(int, column)) for column in zip(*counts))))


def build(work, n_rfe, quantities=QUANTITIES):
    """Records of all variants for one n_rfe: what building took, and the command that times the variant."""
    records, n = [], 3 * n_rfe + 1
    for quantity in quantities:
        for fold in FOLDS:
            folder, seconds, counts = emit(work, quantity, n_rfe, fold)
            files = sorted(folder.glob("*.c"))
            for level in LEVELS:
                library, variant = folder / f"{level}.so", level + fold
                taken = compile_c(files, level, library, "-I", SOURCE / "runtime")
                _, _, called, sizes = QUANTITIES[quantity]
                records.append({
                    "program": "refdyn", "quantity": quantity, "variant": variant, "level": level, "n_rfe": n_rfe, **counts,
                    "seconds": None if taken is None else seconds + taken, "KiB": round(sum(path.stat().st_size for path in files) / 1024, 1),
                    "command": None if taken is None else ["time_emitted", n_rfe, str(library), NAME, quantity, variant, ",".join(called),
                                                           ",".join(map(str, sizes(n)))]})
    return records


def call(work, mode, program, *arguments):
    """What a timing program of the working folder measures: the lines that it prints, none with mode "values"."""
    done = subprocess.run([work / program, mode, *map(str, arguments)], cwd=work, check=True, stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in done.stdout.splitlines()]
