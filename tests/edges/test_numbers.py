"""Extreme numbers in options and files of every command: an answer within 10 s of CPU time and 1 GB, and never a wrong result without a word."""
import csv
import json
import math
import os
import random
import re
import resource
import signal
import subprocess

import pytest

from extreme import CART, DRIVEN, MEGABYTES, SECONDS
from harm import SLOWNESS
from program import LONG, REFDYN, SANITIZED, TESTS, refdyn

EXTREME = ["0", "-0", "-1", "5e-324", "1e-310", "1e-300", "1e-12", "1e9", "1e300", "1.7e308", "inf", "-inf", "nan"]
IN_LUA = {"inf": "1/0", "-inf": "-1/0", "nan": "0/0"}
IN_JSON = {"inf": "Infinity", "-inf": "-Infinity", "nan": "NaN"}

FILES = {
    "cart.lua": CART, "driven.lua": DRIVEN,
    "sweep.lua": 'local rd = require "refdyn"\nreturn rd.sweep { vary = { m = rd.grid(1, 2, 3), c = { 40, 50 } }, t_end = 1, every = 0.1, tol = 1e-6,\n'
                 '  keep = { final = true, at = { 0.5, 0.7 }, extremes = { "a_x" } } }\n',
    "sample.lua": 'local rd = require "refdyn"\nreturn rd.sweep { vary = { m = rd.normal(2, 0.1) }, draws = 5, seed = 3, t_end = 1, keep = { final = true } }\n',
    "plan.lua": 'local rd = require "refdyn"\nreturn rd.plan { vary = { T = rd.within(0.5, 3) }, t_end = "T", minimise = "T", starts = 2, tol = 1e-6,\n'
                '  within = { rd.at_end("a_x", { from = 0.9, to = 1.1 }) } }\n',
    "fit.lua": 'local rd = require "refdyn"\nreturn rd.fit { vary = { m = rd.within(1, 3) }, noise = { a_x = 0.01 }, data = { "data.csv" } }\n',
    "fit.json": '{"parameters": {"m": 2.1, "c": 51.5}}\n',
    "state.json": '{"t": 0.25, "q": [0.125], "qd": [0.5], "inputs": {"push": 1.5}, "parameters": {"m": 2.5}}\n',
    "inputs.csv": "t,push\n0,1\n0.25,2\n0.75,0\n",
    "cases.csv": "m,c\n2,50\n3,60\n",
    "data.csv": None,
}
# The command, then what it writes.
COMMANDS = {
    "sim": (["sim", "cart.lua", "--until", "1", "-o", "run.csv"], "run.csv"),
    "sim, steps": (["sim", "cart.lua", "--until", "1", "--step", "0.01", "-o", "run.csv"], "run.csv"),
    "sim, verify": (["sim", "cart.lua", "--until", "1", "--verify", "-o", "run.csv", "--summary", "sum.json"], "run.csv"),
    "sim, accuracy": (["sim", "cart.lua", "--until", "1", "--accuracy", "1e-4", "-o", "run.csv"], "run.csv"),
    "sim, derivatives": (["sim", "cart.lua", "--until", "1", "--derivatives", "m,push", "-o", "run.csv"], "run.csv"),
    "sim, inputs": (["sim", "cart.lua", "--until", "1", "--inputs", "inputs.csv", "-o", "run.csv"], "run.csv"),
    "sim, state": (["sim", "cart.lua", "--until", "1", "--from", "state.json", "-o", "run.csv"], "run.csv"),
    "sim, fitted": (["sim", "cart.lua", "--until", "1", "--parameters", "fit.json", "-o", "run.csv"], "run.csv"),
    "sim, realise": (["sim", "driven.lua", "--realise", "--until", "1", "-o", "run.csv"], "run.csv"),
    "batch": (["batch", "cart.lua", "sweep.lua", "-o", "runs.h5"], "runs.h5"),
    "batch, samples": (["batch", "cart.lua", "sample.lua", "-o", "runs.h5"], "runs.h5"),
    "batch, table": (["batch", "cart.lua", "--table", "cases.csv", "--until", "1", "-o", "runs.h5"], "runs.h5"),
    "batch, realise": (["batch", "driven.lua", "--table", "driven.csv", "--until", "1", "--realise", "-o", "runs.h5"], "runs.h5"),
    "plan": (["plan", "driven.lua", "plan.lua", "--reference", "ref.csv", "-o", "plan.json"], "plan.json"),
    "fit": (["fit", "cart.lua", "data.csv", "--vary", "m,c", "--noise", "a_x=0.01", "-o", "found.json"], "found.json"),
    "fit, file": (["fit", "cart.lua", "fit.lua", "-o", "found.json"], "found.json"),
    "fit, check": (["fit", "cart.lua", "--check", "--vary", "m,c", "--noise", "a_x=0.01", "--until", "1", "-o", "found.json"], "found.json"),
    "report": (["report", "cart.lua", "--until", "1", "--seconds", "1", "--methods", "rk4,auto", "-o", "report"], "report/cart.csv"),
    "statics": (["statics", "cart.lua", "--state", "state.json", "-o", "found.json"], "found.json"),
    "modes": (["modes", "cart.lua", "-o", "found.json"], "found.json"),
    "linearise": (["linearise", "cart.lua", "-o", "found.json"], "found.json"),
    "eval": (["eval", "cart.lua", "--state", "state.json", "-o", "found.json"], "found.json"),
    "export": (["export", "cart.lua", "--fmu", "2.0", "-o", "cart.fmu"], "cart.fmu"),
    "import": (["import", TESTS / "robots" / "two.urdf", "--flexible", "upper", "--section", "round:0.02", "--E", "2e11", "--friction-width", "0.01",
                "-o", "robot.lua"], "robot.lua"),
}
# Options whose values are lists or texts with numbers.
TEXTS = {"sim": ["--set=m={}", "--set=c={}", "--stop=a_x>{}"], "sim, derivatives": ["--stop=t>{}"], "report": ["--tols={}", "--steps={}"],
         "batch": ["--cases=0:{}", "--set=c={}"], "fit": ["--noise=a_x={}", "--vary=m=1:{}", "--vary=m={}:3"], "statics": ["--set=c={}", "--set=m={}"],
         "modes": ["--set=c={}", "--set=m={}"], "linearise": ["--set=d={}"], "eval": ["--set=m={}"], "plan": ["--set=m={}"], "import": ["--nu={}", "--eta={}", "--tip={},0,0"]}


def write_files(folder, changed=None):
    for name, text in {**FILES, **(changed or {})}.items():
        if text is not None:
            (folder / name).write_text(text)
    (folder / "driven.csv").write_text("m\n2\n3\n")
    if "data.csv" not in (changed or {}):
        (folder / "data.csv").write_text(DATA)


DATA = "t,a_x,push\n" + "".join(f"{i / 20},{0.02 * (1 - math.cos(5 * i / 20) * math.exp(-0.75 * i / 20)):.4f},1\n" for i in range(41))


def numeric_options(command, folder):
    """Options whose value must be a number, as the program itself says. Others take x as a name, and may write a file."""
    known = re.findall(r"^  (--[a-z-]+) [A-Z]", refdyn(command, "--help").stdout, re.M)
    arguments = next(words for words, _ in COMMANDS.values() if words[0] == command)
    return [name for name in known if re.search(f"^refdyn {command}: {name}: 'x' is not a (positive|whole) number", refdyn(command, arguments[1], name, "x", status=None, cwd=folder).stderr)]


def places(text):
    """The numbers of a file, without those in names and quoted words."""
    return [match.span() for match in re.finditer(r"(?<![\w.\"'-])\d+(\.\d+)?(e-?\d+)?(?![\w.\"'])", text)]


def spoilt(name):
    """The file with each of its numbers replaced by each extreme one."""
    text = FILES[name] or DATA
    words = IN_LUA if name.endswith(".lua") else IN_JSON if name.endswith(".json") else {}
    found = places(text)
    if name == "data.csv":
        found = [found[i] for i in (0, 1, 2, 60, 61, 62, -3, -2, -1)]
    return [(f"{name}:{begin}={value}", {name: text[:begin] + words.get(value, value) + text[end:]}) for begin, end in found for value in EXTREME]


def cases(folder):
    found = []
    options = {words[0]: None for words, _ in COMMANDS.values()}
    for command in options:
        options[command] = numeric_options(command, folder)
    for name, (words, _) in COMMANDS.items():
        for option in options[words[0]]:
            found += [(name, f"{option}={value}", {}) for value in EXTREME]
        found += [(name, text.format(value), {}) for text in TEXTS.get(name, []) for value in EXTREME]
        for file in FILES:
            if file in map(str, words) and file not in ("cart.lua", "driven.lua") or (file == "data.csv" and name == "fit, file"):
                found += [(name, label, changed) for label, changed in spoilt(file)]
        if name in ("sim", "statics", "sim, realise"):
            found += [(name, label, changed) for label, changed in spoilt(str(words[1]))]
    return found


def with_option(words, text):
    """Replaces the value of an option that the command already has."""
    name = text.split("=")[0]
    words = [str(word) for word in words]
    if name in words and name not in ("--set", "--stop"):
        place = words.index(name)
        del words[place:place + 2]
    return [*words, text]


def bounds():
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (int(2 * SECONDS * SLOWNESS), int(2 * SECONDS * SLOWNESS) + 5))
    if not SANITIZED:
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))


def fault(folder, case):
    """Returns what is wrong with the answer to a case; '' if nothing is."""
    name, label, changed = case
    words, written = COMMANDS[name]
    write_files(folder, changed)
    arguments = list(map(str, words)) if changed else with_option(words, label)
    with open(folder / "said", "w+", errors="replace") as said:
        process = subprocess.Popen([REFDYN, *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said, preexec_fn=bounds)
        _, ended, usage = os.wait4(process.pid, 0)
        process.returncode = status = os.waitstatus_to_exitcode(ended)
        said.seek(0)
        text = said.read()
    used, peak = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
    if used > SECONDS * SLOWNESS or status == -signal.SIGXCPU:
        return f"took {used:.1f} s"
    if peak > MEGABYTES and not SANITIZED:
        return f"took {peak:.0f} MB"
    if status not in (0, 1, 2, 3):
        return f"exit status {status}: {text[-300:]}"
    if status:
        return "" if len(text) > 10 else f"exit status {status} without a word"
    return wrong_result(folder / written, arguments)


def wrong_result(path, arguments):
    if not path.exists() or path.stat().st_size == 0:
        return "exit status 0 without a result"
    if path.suffix in (".csv", ".json", ".lua"):
        text = path.read_text()
        bad = re.search(r"(?<![\w])-?(nan|inf|infinity)(?!\w)", text, re.I)
        if bad and path.suffix != ".lua" and path.parent.name != "report":
            return f"exit status 0 with {bad[0]}"
    if path.suffix == ".json":
        json.loads(path.read_text())
    if path.name == "run.csv":
        rows = list(csv.DictReader(path.open()))
        until = next((float(word.split("=")[1]) for word in arguments if word.startswith("--until=")), 1)
        is_stopped = any(word.startswith("--stop") for word in arguments) or "--realise" in arguments
        if not is_stopped and float(rows[-1]["t"]) != until:
            return f"exit status 0, but the motion ends at {rows[-1]['t']}"
    return ""


@pytest.mark.parametrize("name", COMMANDS)
def test_ordinary_numbers(name, tmp_path):
    """Each command succeeds before its numbers are changed."""
    write_files(tmp_path)
    words, written = COMMANDS[name]
    refdyn(*words, cwd=tmp_path)
    assert wrong_result(tmp_path / written, words) == ""


def test_extreme_numbers(tmp_path):
    """Every number in turn; in tests/run, a sample of them."""
    every = cases(tmp_path)
    chosen = every if LONG else random.Random(1).sample(every, 150)
    assert len(every) > 2000
    faults = []
    for i, case in enumerate(chosen):
        folder = tmp_path / str(i)
        folder.mkdir()
        found = fault(folder, case)
        if found:
            faults.append(f"{case[0]}, {case[1]}: {found}")
    assert not faults, "\n".join(faults)


STRAY = DATA.replace("\n1.0,", "\n1e9,").split("\n1.05,")[0] + "\n"
PACE = ["--until", "1e9"], ["--until", "1e10", "--method", "rk54"], ["--until", "1e11", "--method", "radau9"]
BOUNDS = {
    "sim, steps": (["sim", "cart.lua", "--until", "1", "--step", "1e-10", "-o", "run.csv"], 2, r"--step 1e-10: 1e\+10 steps; must be at most 1000000000"),
    "sim, largest step": (["sim", "cart.lua", "--until", "1", "--step-max", "1e-10", "-o", "run.csv"], 2, r"--step-max 1e-10: 1e\+10 steps"),
    "sim, outputs kept": (["sim", "cart.lua", "--until", "1", "--every", "1e-7", "--verify", "-o", "run.csv"], 2, r"--every 1e-07: 1e\+07 outputs; must be at most 1000000\n"),
    "plan": (["plan", "driven.lua", "plan.lua", "--reference", "ref.csv", "--every", "1e-9", "-o", "plan.json"], 2, r"--every 1e-09: 3e\+09 outputs"),
    "plan, steps": (["plan", "driven.lua", "plan.lua", "--step-max", "1e-12", "-o", "plan.json"], 2, r"--step-max 1e-12: 3e\+12 steps"),
    "fit": (["fit", "cart.lua", "stray.csv", "--vary", "m,c", "--noise", "a_x=0.01", "-o", "found.json"], 1,
            r"stray\.csv:1: data: t = 1e\+09 follows 0\.95, and the data are 2e\+10 times as long as the usual time between rows, 0\.05 s"),
    "fit, check": (["fit", "cart.lua", "--check", "--vary", "m", "--noise", "a_x=0.01", "--until", "1", "--every", "1e-8", "-o", "found.json"], 2, r"1e\+08 outputs"),
    "report": (["report", "cart.lua", "--until", "1", "--every", "1e-8", "-o", "report"], 2, r"--every 1e-08: 1e\+08 outputs"),
    "live": (["view", "cart.lua", "--live", "--step", "1e-300", "-o", "page.html"], 2, r"--step 1e-300: 1e\+300 steps"),
    "batch": (["batch", "driven.lua", "--table", "driven.csv", "--until", "1", "--realise", "--before", "1e9", "-o", "runs.h5"], 2, r"--before 1e\+09: 2e\+11 outputs"),
}


@pytest.mark.parametrize("which", BOUNDS)
def test_too_much_work(which, tmp_path):
    """The message has the numbers, and nothing is written."""
    arguments, status, fact = BOUNDS[which]
    write_files(tmp_path)
    (tmp_path / "stray.csv").write_text(STRAY)
    before = sorted(os.listdir(tmp_path))
    done = refdyn(*arguments, status=status, cwd=tmp_path)
    assert re.search(fact, done.stderr), done.stderr
    assert sorted(os.listdir(tmp_path)) == before


@pytest.mark.parametrize("more", PACE, ids=" ".join)
def test_motions_without_end(more, tmp_path):
    """The number of adaptive steps is not known in advance; after 10,000 of them it is clear that there would be too many."""
    write_files(tmp_path, {"cart.lua": CART.replace('"d", 3', '"d", 0')})
    arguments = ["sim", "cart.lua", *more, "-o", "run.csv"]
    process = subprocess.run([REFDYN, *arguments], cwd=tmp_path, capture_output=True, text=True, preexec_fn=bounds)
    assert process.returncode == 3 and "the limit on the number of steps" in process.stderr, process.stderr


def test_a_start_far_from_the_equilibrium(tmp_path):
    """The growing load moves it too far in each of its steps: the whole load at once finds the equilibrium."""
    write_files(tmp_path, {"state.json": '{"q": [1e9]}'})
    done = subprocess.run([REFDYN, "statics", "cart.lua", "--state", "state.json"], cwd=tmp_path, capture_output=True, text=True, preexec_fn=bounds)
    assert done.returncode == 0 and abs(json.loads(done.stdout)["q"][0] - 0.02) < 1e-9, done.stderr
