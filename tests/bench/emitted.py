"""The emitted C of the peers' model: generated, compiled, timed. Takes the program and a folder; gives JSON-ready records."""
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
NAME = "manipulator"
LEVELS = {"O2": ["-O2"], "O3n": ["-O3", "-march=native"]}
FOLDS = ("", "_fold")  # parameters symbolic or numbers
# Program and functions of what is timed: the reference manipulator with an input on its column.
QUANTITIES = {"qdd_free": ("none", "qdd_free"), "M_and_h": ("none", "M,h"), "qdd": ("consistent", "qdd,anchor,start")}
DRIVEN = "driven"  # the same accelerations with an input on each coordinate, as the peers have them: compared, not timed
TOGETHER = {"M,h": "M_h"}  # one function for both, where the generator has it
PATIENCE = 150  # seconds for one run of gcc, as the peers'


def measured(command, **options):
    """Exit status, CPU seconds and standard output of a command and what it started."""
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True, **options)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, text


def prepare(folder):
    """The model and the program that times, in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(HERE / "driven.lua", folder)
    shutil.copy(SOURCE / "models" / "manipulator.lua", folder)
    subprocess.run(["gcc", "-O2", "-I", SOURCE / "runtime", HERE / "time_emitted.c", "-o", folder / "time_emitted", "-ldl"], check=True)


def emit(refdyn, folder, quantity, n_rfe, fold):
    """Writes the C; the functions that give the quantity, what generating took, counted operations."""
    program, functions = QUANTITIES["qdd_free" if quantity == DRIVEN else quantity]
    model = ["driven.lua"] if quantity == DRIVEN else ["manipulator.lua", "--set", "drive=input"]
    target = folder / f"{quantity}{fold}_{n_rfe}"
    for wanted in (TOGETHER.get(functions), functions):
        if not wanted:
            continue
        shutil.rmtree(target, ignore_errors=True)
        status, seconds, text = measured([refdyn, "gen", folder / model[0], *model[1:], "--set", f"n_rfe={n_rfe}", "--set", f"program={program}",
                                          "--emit", wanted, "-o", target, *(["--fold"] if fold else [])],
                                         stderr=None if wanted == functions else subprocess.DEVNULL)
        if status == 0:
            break
    else:
        raise SystemExit(f"refdyn gen failed for {quantity}, n_rfe={n_rfe}")
    called = [name for name in wanted.split(",") if name not in ("anchor", "start")]
    counts = [re.search(rf"^{name} +(\d+) +(\d+) +(\d+) +(\d+)$", text, re.M).groups() for name in called]
    operations = [sum(map(int, column)) for column in zip(*counts)]
    return target, called, dict(zip(("adds", "muls", "divs", "funcs"), operations), gen_s=seconds)


def compile_c(source, level, library):
    """CPU seconds of gcc, None when it took too long. Done again only when the C has changed."""
    files = sorted(source.glob("*.c"))
    read = [*files, SOURCE / "runtime" / "refdyn_model.h"]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in read)).hexdigest()
    record = library.with_suffix(".json")
    if record.exists():
        known = json.loads(record.read_text())
        if known["digest"] == digest:
            return known["cc_s"]
    status, seconds, _ = measured(["timeout", PATIENCE, "gcc", *LEVELS[level], "-fPIC", "-shared", "-I", SOURCE / "runtime", *files, "-o",
                                   library, "-lm"])
    if status not in (0, 124):
        raise SystemExit(f"gcc failed: {files[0]}")
    if status:
        library.unlink(missing_ok=True)
    record.write_text(json.dumps({"digest": digest, "cc_s": None if status else seconds}))
    return None if status else seconds


def build(refdyn, folder, n_rfe):
    """Every quantity and variant for one n_rfe: records of what it took, each with its library and functions."""
    records = []
    for quantity in [*QUANTITIES, DRIVEN]:
        for fold in FOLDS:
            source, called, facts = emit(refdyn, folder, quantity, n_rfe, fold)
            size = sum(path.stat().st_size for path in source.glob("*.c")) / 1024
            for level in LEVELS if quantity != DRIVEN else ["O2"]:
                library = folder / f"{source.name}_{level}.so"
                seconds = compile_c(source, level, library)
                records.append({"peer": "refdyn", "what": f"{quantity}/{level}{fold}", "n_rfe": n_rfe, "n": 3 * n_rfe + 1, **facts,
                                "cc_s": seconds, "C_KiB": round(size, 1), "library": str(library), "called": ",".join(called)})
    return records


def accelerate(folder, record, state, work):
    """Accelerations of a driven record as those of all variants with its parameters, for the comparison with the reference."""
    fold = record["what"].partition("/O2")[2]
    first, *others = [work / "out" / f"refdyn-{level}{fold}_{record['n_rfe']}.txt" for level in LEVELS]
    time_one(folder, record, state, first, None)
    for other in others:
        shutil.copy(first, other)


def time_one(folder, record, state, result, core):
    """Microseconds a call of a built record; its first function's result goes into `result`."""
    command = [*(["taskset", "-c", core] if core else []), folder / "time_emitted", record["library"], NAME, state, record["called"], result]
    done = subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True)
    return {**{key: record[key] for key in ("peer", "what", "n_rfe", "n")}, "us": float(done.stdout)}
