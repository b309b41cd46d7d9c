"""Numbers without a value, targets out of reach, and harmful states."""
import json
import math
import re
import shutil

import pytest

from harm import HARMFUL, run_harmful
from program import LEAN, REFERENCE, TESTS, read_run, refdyn, some

DATA = HARMFUL / "data"
PENDULUM = TESTS / "models" / "double_pendulum.lua"
PLACE = re.compile(r"^[^:\n]+(:\d+)?: [^\n]+: .+", re.M)


def work(folder):
    (folder / "work").mkdir()
    return folder / "work"


# ---- States ----

GIVEN = some(path.name for path in DATA.glob("state_*.json"))
MADE = {
    "deep lists": lambda: "[" * 100000, "deep objects": lambda: '{"q":' * 5000 + "1" + "}" * 5000, "deep value": lambda: '{"q": ' + "[" * 1900 + "]" * 1900 + "}",
    "huge whole number": lambda: '{"t": ' + "9" * 5000 + "}", "long number": lambda: '{"t": 0.' + "1" * 1000000 + "e400}",
    "many unknown keys": lambda: "{" + ",\n".join(f'"k{i}": 1' for i in range(100000)) + "}",
    "many parameters": lambda: '{"parameters": {' + ",\n".join(f'"k{i}": 1' for i in range(100000)) + "}}",
    "many inputs": lambda: '{"inputs": {' + ",\n".join(f'"k{i}": []' for i in range(100000)) + "}}",
    "long key": lambda: '{"' + "k" * 5000000 + '": 1}', "long array": lambda: '{"q": [' + "0," * 1000000 + "0]}", "blanks": lambda: " " * 20000000,
    "texts": lambda: '{"qd": ["' + "x" * 5000000 + '", "y"]}', "lines": lambda: "\n" * 5000000 + "{",
}


@pytest.mark.parametrize("command", [["eval", "--state"], ["sim", "--until", "1", "--from"], ["modes", "--at"], ["report", "--until", "1", "-o", "out", "--from"]][:1 if LEAN else 4],
                         ids=lambda words: words[0])
@pytest.mark.parametrize("which", [*GIVEN, *MADE])
def test_states_that_try_to_harm(which, command, tmp_path):
    folder = work(tmp_path)
    if which in MADE:
        (folder / "state.json").write_text(MADE[which]())
    else:
        shutil.copy(DATA / which, folder / "state.json")
    said = run_harmful(tmp_path, command[0], PENDULUM, *command[1:], "state.json")
    assert re.match(r"state\.json(:\d+)?: .+: .+|state\.json: state: .+", said), said[:500]
    assert len(said) < 20000 and said.count("\n") <= 20 and not re.search("[\x00-\x09\x0b-\x1f\x7f]", said)


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/full", ".", "none.json", "/dev/null"])
def test_states_that_are_no_files(path, tmp_path):
    said = run_harmful(tmp_path, "eval", PENDULUM, "--state", path, megabytes=300)
    assert said.startswith(path) and ": state: " in said


SAMPLES = {
    "empty": ("", 1), "no time": ("push\n1\n", 1), "no input": ("t,pull\n0,1\n", 1), "twice": ("t,push,push\n0,1,2\n", 1), "other twice": ("t,push,a,a\n0,1,2,3\n", 1),
    "no sample": ("t,push\n", 1), "short": ("t,push\n0,1\n1\n", 3), "long": ("t,push\n0,1,2\n", 2), "no cell": ("t,push\n0,\n", 2), "text": ("t,push\n0,one\n", 2),
    "nan": ("t,push\n0,nan\n", 2), "infinite": ("t,push\n0,inf\n", 2), "too large": ("t,push\n0,1e999\n", 2), "back": ("t,push\n0,1\n0,2\n", 3),
    "zero byte": ("t,push\n0,1\n1,\0\n", 3), "escape": ("t,push,\x1b[2J\n0,1,2\n", 1), "comment": ("# samples\nt,push\n0,1\n", 1), "half": ("t,push\n0,1e\n", 2),
    "hexadecimal": ("t,push\n0,0x1p3\n", 2), "long line": ("t,push\n0," + "1" * (17 << 20), 2), "nan time": ("t,push\nnan,1\n", 2),
}
CART = """local rd = require "refdyn"
rd.input("push", 0, "N")
return rd.model { name = "cart", links = { { "cart", joint = "x", mass = 2 } }, forces = function(s) return { cart_x = s.inputs.push } end }
"""


@pytest.mark.parametrize("which", SAMPLES)
def test_samples_that_try_to_harm(which, tmp_path):
    folder, (text, line) = work(tmp_path), SAMPLES[which]
    (folder / "cart.lua").write_text(CART)
    (folder / "samples.csv").write_text(text)
    said = run_harmful(tmp_path, "sim", "cart.lua", "--until", "1", "--inputs", "samples.csv")
    assert re.match(rf"samples\.csv:{line}: inputs: .+", said) and len(said) < 300 and "\x1b" not in said, said


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/urandom", ".", "none.csv", "/dev/null"])
def test_samples_that_are_no_files(path, tmp_path):
    (work(tmp_path) / "cart.lua").write_text(CART)
    said = run_harmful(tmp_path, "sim", "cart.lua", "--until", "1", "--inputs", path)
    assert said.startswith(path) and ": inputs: " in said


def test_samples_as_spreadsheets_write_them(tmp_path):
    folder = work(tmp_path)
    (folder / "cart.lua").write_text(CART)
    (folder / "samples.csv").write_bytes(b"\xef\xbb\xbf t , push \r\n0, 4\r\n\r\n0.5,0")
    refdyn("sim", "cart.lua", "--until", "1", "--inputs", "samples.csv", "-o", "run.csv", cwd=folder)
    assert abs(read_run(folder / "run.csv")["cart_x_d"][-1] - 1) < 1e-12


# ---- Numbers without a value ----

OSCILLATOR = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" }, { "k", 100, "N/m" }, { "c", 0.1, "N s/m" }, { "l", 1, "m" }, { "f", 1, "N" } }
return rd.model { name = "oscillator", gravity = { 0, 0, -9.81 }, points = { E = "b" },
  links = { { "a", joint = "z", mass = p.m, spring = { z = p.k }, damper = { z = p.c }, start_rate = { z = 1 } },
            { "b", on = "a", at = { p.l, 0, 0 }, joint = "x", mass = p.m, spring = { x = p.k } } },
  forces = function(s) return { b_x = p.f*s.q.a_z^2 } end, courses = function(s) return { product = p.f*p.l*s.q.a_z } end }
"""
HUGE = [{"k": "1.7e308", "m": "1e-200"}, {"m": "1.7e308"}, {"l": "1.7e308", "m": "1e155"}, {"f": "1.7e308", "l": "1e155"}, {"c": "1e308", "k": "1e308"},
        {"k": "1e-308", "m": "1e308"}, {"m": "1e-308"}, {"m": "1e-200", "k": "1e200"}, {"l": "1e200", "f": "1e200"}, {"c": "1.7e308", "m": "1e-10"}]
COMMANDS = [["modes"], ["modes", "--at", "initial"], ["modes", "--modes", "1"], ["statics"], ["eval"], ["bench", "--emit", "M,Q,energy"],
            ["sim", "--until", "0.1"], ["sim", "--until", "0.1", "--step", "1e-2"], ["sim", "--until", "0.1", "--verify", "--method", "rk8"]]
TOKEN = re.compile(r"(?<![A-Za-z_])-?(nan|inf|infinity)(?![A-Za-z_])", re.I)


def numbers_of(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [number for entry in value for number in numbers_of(entry)]
    return [value]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
@pytest.mark.parametrize("values", HUGE, ids=lambda values: ",".join("=".join(item) for item in values.items()))
def test_huge_parameters(values, command, tmp_path):
    """Every reported success is finite; every non-finite value is reported with its time and its state."""
    (tmp_path / "o.lua").write_text(OSCILLATOR)
    more = ["--summary", "summary.json", "-o", "run.csv"] if command[0] == "sim" else []
    done = refdyn(command[0], "o.lua", *command[1:], *more, *[word for item in values.items() for word in ("--set", "=".join(item))], status=None, cwd=tmp_path,
                  timeout=100)
    assert done.returncode in (0, 1, 3), done
    said = "\n".join(line for line in done.stderr.split("\n") if "warning: " not in line)
    assert not TOKEN.search(done.stdout + said), done
    if done.returncode == 0:
        found = [json.loads(line) for line in (done.stdout.splitlines() if command[0] == "bench" else [done.stdout] if done.stdout else [])]
        found += [json.loads((tmp_path / "summary.json").read_text())] if command[0] == "sim" else []
        for result in found:
            result.pop("qdd_free", None)  # null only where M is singular
            assert all(value is not None for value in numbers_of(result)), result
        assert command[0] != "sim" or all(map(math.isfinite, (value for column in read_run(tmp_path / "run.csv").values() for value in column)))
    else:
        assert done.returncode == 1 or re.search(r"^refdyn: oscillator: t = \S+ s: \w+", said, re.M), said
        assert done.stdout == "" or command[0] == "bench"
        assert not (tmp_path / "run.csv").exists() and not (tmp_path / "summary.json").exists()


def test_some_of_them_fail(tmp_path):
    """The cases above include both kinds for each command."""
    (tmp_path / "o.lua").write_text(OSCILLATOR)
    for command in COMMANDS:
        ends = set()
        for values in HUGE:
            settings = [word for item in values.items() for word in ("--set", "=".join(item))]
            ends.add(refdyn(command[0], "o.lua", *command[1:], *settings, status=None, cwd=tmp_path).returncode)
        assert 3 in ends and (0 in ends or command[0] == "modes"), (command, ends)


SLIDES = """local rd = require "refdyn"
local p = rd.parameters { { "l", 1, "m" } }
return rd.model { name = "slides", points = { E = "c" }, links = { { "a", joint = "x", mass = 1, spring = { x = 1 } },
  { "b", on = "a", at = { 0, p.l, 0 }, mass = 1 }, { "c", on = "b", at = { 0, p.l, 0 } } } }
"""


@pytest.mark.parametrize("command, section", [(["eval"], "points"), (["statics"], "points"), (["modes"], "points"), (["modes", "--at", "initial"], "points"),
                                              (["eval", "--state", "fast.json"], "energy")], ids=lambda words: words if isinstance(words, str) else " ".join(words))
def test_results_that_overflow(command, section, tmp_path):
    """The equations are satisfied, but a number of the result overflows: no result is written."""
    (tmp_path / "slides.lua").write_text(SLIDES)
    (tmp_path / "fast.json").write_text('{"qd": [1e200]}')
    values = [] if section == "energy" else ["--set", "l=1.7e308"]
    done = refdyn(command[0], "slides.lua", *command[1:], *values, "-o", "result.json", status=3, cwd=tmp_path)
    assert f'refdyn: the result has numbers that are not finite, under "{section}"\nrefdyn: slides: t = 0 s: ' in done.stderr, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fast.json", "slides.lua"] and done.stdout == ""


def test_a_report_of_points_that_overflow(tmp_path):
    (tmp_path / "slides.lua").write_text(SLIDES)
    done = refdyn("report", "slides.lua", "--until", "1", "--set", "l=1.7e308", "--methods", "rk8", "--seconds", "10", "-o", "out", status=3, cwd=tmp_path)
    assert not TOKEN.search(done.stdout + done.stderr) and "no reference" in done.stderr and not (tmp_path / "out").exists()


@pytest.mark.parametrize("course, start", [("rd.sqrt(0.5 - s.t)", 0.5), ("1/(s.t - 0.25)", 0.25), ("rd.log(0.3 - s.t)", 0.3), ("1/s.t", 0), ("rd.exp(1e4*s.t)", 0.07)])
def test_columns_that_lose_their_value(course, start, tmp_path):
    """Even if the equations can be evaluated further, the motion ends there and names the column."""
    (tmp_path / "cart.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "cart", links = { { "cart", joint = "x", mass = 1, '
                                       f'start_rate = {{ x = 1 }} }} }}, courses = function(s) return {{ root = {course} }} end }}\n')
    done = refdyn("sim", "cart.lua", "--until", "1", "--every", "0.05", "-o", "run.csv", cwd=tmp_path, status=3)
    assert done.stderr.startswith("refdyn: column root is infinite or not a number\nrefdyn: cart: t = "), done.stderr
    assert not (tmp_path / "run.csv").exists()
    text = (tmp_path / "run.csv.part").read_text()
    assert not TOKEN.search(text) and all(float(row.split(",")[0]) <= start + 1e-9 for row in text.split("\n")[1:-1])


# ---- Targets out of reach ----

ARM = """local rd = require "refdyn"
return rd.model { name = "arm", gravity = { 0, 0, -9.81 }, points = { P = "hand" },
  links = { { "upper", joint = "psi", mass = 1, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 }, spring = { psi = 1 } },
            { "lower", on = "upper", at = { 1, 0, 0 }, joint = "psi", mass = 1, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 }, start = { psi = 1 } },
            { "hand", on = "lower", at = { 1, 0, 0 } } },
  constraints = function(s) return { rd.position { s.points.P.x - X, name = "reach" }, rd.position { s.points.P.y - 1, name = "side" } } end }
"""


@pytest.mark.parametrize("how", [["--start", "project"], [], ["--step", "1e-3"], ["--start", "project", "--step", "1e-3"], ["--verify", "--start", "project"]],
                         ids=lambda words: " ".join(words) or "as is")
def test_unreachable_programme(how, tmp_path):
    """The reason comes first, then the state, then the distance of the start from the programme, by row."""
    (tmp_path / "arm.lua").write_text(ARM.replace("X", "5"))
    done = refdyn("sim", "arm.lua", "--until", "0.1", "-o", "run.csv", *how, cwd=tmp_path, status=None)
    x = 1 + math.cos(1)
    if "--step" in how and "--start" not in how:
        assert f"reach (position): phi = {x - 5:.12}" in done.stderr, done.stderr  # gains pull it in as far as possible
        return
    lines = [line for line in done.stderr.split("\n") if "warning: no row has gains" not in line]
    assert done.returncode == 3 and re.match(r"refdyn: arm: t = 0 s: .+, constraint reach$", lines[0]), done.stderr
    assert lines[1].startswith("  q: upper_psi = 0, lower_psi = 1") and lines[2].startswith("  qd: ")
    found = re.match(r"refdyn: the start is off the programme by reach: phi = (\S+), side: phi = (\S+)$", lines[3])
    assert found and abs(float(found[1]) - (x - 5)) < 1e-12 and abs(float(found[2]) - (math.sin(1) - 1)) < 1e-12, lines[3]
    assert not list(tmp_path.glob("run.csv*"))


def test_programme_that_leaves_the_reach(tmp_path):
    """In the middle of a motion: the time and the row."""
    (tmp_path / "arm.lua").write_text(ARM.replace("X", "(1 + s.t)"))
    done = refdyn("sim", "arm.lua", "--until", "10", "-o", "run.csv", "--start", "project", cwd=tmp_path, status=3)
    assert re.match(r"refdyn: (warning: )?the start .+\n(refdyn: the start .+\n)?refdyn: (at|arm: t =)", done.stderr), done.stderr
    assert "run.csv.part; its last row is the complete last state" in done.stderr
    t = float(re.search(r"refdyn: arm: t = (\S+) s", done.stderr)[1])
    run = read_run(tmp_path / "run.csv.part")
    assert run["t"][-1] == t and abs(t - (math.sqrt(3) - 1)) < 1e-6 and done.stderr.index("refdyn: arm") < done.stderr.index("method  ")
    q = re.search(r"q: upper_psi = (\S+), lower_psi = (\S+)", done.stderr)
    assert [run["upper_psi"][-1], run["lower_psi"][-1]] == [float(q[1]), float(q[2])]


STATICS = {
    "falling": ('{ "stone", joint = "z", mass = 1 }', "", "stone_z", -9.81),
    "pushed": ('{ "a", joint = "x", mass = 1, spring = { x = 1 } }, { "b", joint = "y", mass = 1 }', "forces = function(s) return { b_y = 7 } end", "b_y", 7),
    "too weak": ('{ "a", joint = "x", mass = 1 }', "forces = function(s) return { a_x = 2 - rd.sin(s.q.a_x) } end", "a_x", None),
}


@pytest.mark.parametrize("which", STATICS)
@pytest.mark.parametrize("command", [["statics"], ["modes"], ["sim", "--from", "statics", "--until", "1", "-o", "run.csv"]], ids=lambda words: words[0])
def test_no_equilibrium(command, which, tmp_path):
    links, forces, name, force = STATICS[which]
    (tmp_path / "s.lua").write_text(f'local rd = require "refdyn"\nreturn rd.model {{ name = "s", gravity = {{ 0, 0, -9.81 }}, links = {{ {links} }}, {forces} }}\n')
    done = refdyn(command[0], "s.lua", *command[1:], cwd=tmp_path, status=3)
    assert re.match(r"refdyn: s: t = 0 s: ", done.stderr), done.stderr
    found = re.search(rf"refdyn: the largest imbalance there is at {name}: (\S+) N$", done.stderr, re.M)
    assert found and (abs(float(found[1]) - force) < 1e-12 if force else float(found[1]) >= 1 - 1e-9), done.stderr
    assert done.stdout == "" and [path.name for path in tmp_path.iterdir()] == ["s.lua"]


# ---- Many coordinates ----

@pytest.mark.parametrize("command", [["sim", "--until", "0.1", "-o", "run.csv"], ["eval"], ["modes"]], ids=lambda words: words[0])
def test_failures_of_many_coordinates(command, tmp_path):
    """The reason comes first, then a readable part of the state; the last row has all of it."""
    (tmp_path / "state.json").write_text(json.dumps({"qd": [1e200] * 82}))
    values = {"sim": ["--set", "E=1.7e308"], "modes": ["--set", "rho=1.7e308", "--set", "a=1e200"], "eval": ["--state", "state.json"]}[command[0]]
    values = ["--set", "n_rfe=27", *values]
    done = refdyn(command[0], REFERENCE, *values, *command[1:], cwd=tmp_path, status=3)
    state = [line for line in done.stderr.split("\n") if line.startswith(("  q: ", "  qd: "))]
    assert done.stderr.startswith("refdyn: ") and state and max(map(len, done.stderr.split("\n"))) < 600, done.stderr
    assert all(re.search(r"\(\d of 82: failing, or the largest\)$", line) and line.count("=") <= 4 for line in state)
    assert done.stderr.index("manipulator: t = ") < done.stderr.index("  q: ")
    if command[0] == "sim":
        run = read_run(tmp_path / "run.csv.part")
        t = float(re.search(r"manipulator: t = (\S+) s", done.stderr)[1])
        assert run["t"][-1] == t
        for name, value in re.findall(r"(\w+) = ([^,\s]+)", state[0]):
            assert run[name][-1] == float(value)


def test_few_coordinates_are_all_told(tmp_path):
    (tmp_path / "arm.lua").write_text(ARM.replace("X", "5"))
    said = refdyn("sim", "arm.lua", "--until", "0.1", "--start", "project", cwd=tmp_path, status=3).stderr
    assert "  q: upper_psi = 0, lower_psi = 1\n  qd: upper_psi_d = 0, lower_psi_d = 0\n" in said
