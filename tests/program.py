"""How the tests call the program, and how they compare numbers."""
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent
TESTS = SOURCE / "tests"
MODELS = SOURCE / "models"
BUILD = pathlib.Path(os.environ.get("REFDYN_BUILD", SOURCE / "build" / "release"))
# Tests compile without a background, so that one model is compiled at a time; test_tiers.py sets it for its calls.
os.environ.setdefault("REFDYN_BACKGROUND", "0")
REFDYN = os.path.abspath(os.environ.get("REFDYN", BUILD / "bin" / "refdyn"))
# 0 shows the actual residuals: every comparison then fails and prints its figure.
SCALE = float(os.environ.get("REFDYN_TOLERANCE_SCALE", "1"))

# The public header is the only place where the version is written.
VERSION = ".".join(re.findall(r"^#define REFDYN_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)$", (SOURCE / "runtime" / "refdyn.h").read_text(), re.M))
REFERENCE = MODELS / "manipulator.lua"
# tests/long: all models instead of a few representatives.
LONG = "REFDYN_LONG" in os.environ
# tcc compiles emitted C in a hundredth of the time of gcc -O2, and computes the same bits on x86-64 (test_tiers.py). tests/run uses it
# except where the subject is the compiler, or where a motion takes longer than the compilation (`optimised` in CMakeLists.txt).
HAS_TCC = platform.machine() == "x86_64" and shutil.which("tcc") is not None and not LONG
UNOPTIMISED = ["tcc", "-w"] if HAS_TCC else ["gcc", "-std=gnu11", "-O0", "-ffp-contract=off", "-fPIC"]
if HAS_TCC:
    os.environ.setdefault("CC", str(TESTS / "quick_cc"))
# A build with sanitizers finds faults in memory; numbers and bounds are compared in the other build. LEAN is such a build in
# tests/run, which leaves the slowest cases to tests/long.
SANITIZED = "REFDYN_SLOWNESS" in os.environ
LEAN = SANITIZED and not LONG


def some(paths):
    """Sorts the paths. There must be at least one, so that no test passes without a file."""
    paths = sorted(paths)
    assert paths, "no file of that name"
    return paths


def sources(folder, *patterns):
    """Files of a folder of the project and of its subfolders."""
    return some(path for pattern in patterns or ("*.[ch]",) for path in (SOURCE / folder).rglob(pattern))


# The public headers and the files of the runtime core.
CORE_FILES = some([*(SOURCE / "runtime").glob("*.h"), *sources("runtime/core", "*.[ch]", "*.inc")])
CORE_LIBRARY = BUILD / "librefdyn_runtime.a"
CORE_SOURCES = some(path for path in CORE_FILES if path.suffix == ".c")


def oracle(name):
    return json.loads((TESTS / "oracle" / (name + ".json")).read_text())


def all_models():
    return some(MODELS.glob("*.lua"))


def models_of_tests():
    return some((TESTS / "models").glob("*.lua"))


def few_models():
    """Models that differ in structure from the others; all models in tests/long. Used where one model takes seconds."""
    return [path for path in all_models() if LONG or path.stem not in ("chain", "puma", "scara", "writer")]


def few_models_of_tests():
    """Every third model; all of them in tests/long. Used where the models of `models/` already take long."""
    return models_of_tests() if LONG else models_of_tests()[::3]


def refdyn(*arguments, status=0, env=None, cwd=None, timeout=300):
    """Runs the program, checks its exit status and returns the finished process."""
    done = subprocess.run([REFDYN, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=timeout,
                          env={**os.environ, **(env or {})})
    if status is not None:
        assert done.returncode == status, (
            f"refdyn {' '.join(map(str, arguments))}: exit status {done.returncode}, not {status}\n"
            f"stdout: {done.stdout[-2000:]}\nstderr: {done.stderr[-2000:]}")
    return done


def settings(values):
    return [text for name, value in values.items() for text in ("--set", f"{name}={value}")]


def evaluate(model, state=None, *arguments, env=None):
    """The JSON object that `refdyn eval` prints."""
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(state or {}, file)
        file.flush()
        return json.loads(refdyn("eval", model, "--state", file.name, *arguments, env=env).stdout)


def flat(value):
    if isinstance(value, (list, tuple)):
        return [number for entry in value for number in flat(entry)]
    if hasattr(value, "tolist"):
        return flat(value.tolist())
    return [value]


def difference(found, expected, scale=None):
    """Largest difference divided by the largest expected entry (or by `scale`)."""
    found, expected = flat(found), flat(expected)
    assert len(found) == len(expected), f"{len(found)} entries, not {len(expected)}"
    size = scale if scale is not None else max((abs(float(e)) for e in expected), default=0)
    worst = max((abs(float(f - e)) for f, e in zip(found, expected)), default=0)
    return worst / size if size else worst


def close(what, found, expected, tolerance, scale=None):
    """One line if found and expected differ by more than the tolerance, otherwise ''."""
    error = difference(found, expected, scale)
    return "" if error <= tolerance * SCALE else f"{what}: differs by {error:.2e}, allowed {tolerance * SCALE:.0e}"


def check(lines):
    """Fails with one line for each fact that is wrong."""
    lines = [line for line in lines if line]
    assert not lines, "\n" + "\n".join(lines)


def read_run(path):
    """Columns of a CSV file by name."""
    import numpy
    with open(path) as file:
        header = file.readline().strip().split(",")
    table = numpy.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    assert table.shape[1] == len(header), f"{path}: {table.shape[1]} columns under {len(header)} names"
    return {name: table[:, column] for column, name in enumerate(header)}


def motion(model, *arguments, timeout=300):
    """Columns, standard error and summary of one `refdyn sim`."""
    with tempfile.TemporaryDirectory() as folder:
        run, summary = os.path.join(folder, "run.csv"), os.path.join(folder, "summary.json")
        done = refdyn("sim", model, *arguments, "-o", run, "--summary", summary, timeout=timeout)
        with open(summary) as file:
            return read_run(run), done.stderr, json.load(file)
