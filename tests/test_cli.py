"""The command line: exit statuses, messages, faulty files, the compile cache, and the files that a failed run leaves."""
import csv
import json
import math
import os
import re
import stat
import subprocess

import pytest

from program import LEAN, MODELS, REFDYN, REFERENCE, SCALE, TESTS, VERSION, evaluate, motion, oracle, read_run, refdyn, some

PENDULUM = TESTS / "models" / "double_pendulum.lua"
COMMANDS = ["gen", "check", "compile", "eval", "statics", "modes", "sim", "plot", "merge", "bench", "report"]
PLACE = re.compile(r"^[^:\n]+:\d+: [^:\n]+: .+", re.M)  # FILE:LINE: what: fact


@pytest.mark.quick
def test_help_and_version():
    lines = refdyn("--version").stdout.splitlines()
    assert lines[0] == f"refdyn {VERSION}" and re.fullmatch(r"with LAPACK(, (GSL|HDF5|URDF|FMUs|NLopt))*", lines[-1])
    assert lines[1:-1] == [] or re.fullmatch(r"commit [0-9a-f]{12}\+?", lines[1])
    help_text = refdyn("--help").stdout
    for command in COMMANDS:
        assert re.search(rf"^\s*{command}\b", help_text, re.M)
        assert "usage: refdyn " + command in refdyn(command, "--help").stdout
        assert refdyn("help", command).stdout == refdyn(command, "-h").stdout == refdyn(command, "--help").stdout
        texts = re.findall(r"^  --?\S.*?  +(\S.*)$", refdyn(command, "--help").stdout, re.M)
        assert len(texts) > 1 and len(set(texts)) == len(texts) and not any("%" in text for text in texts), texts


SLIDER = """local rd = require "refdyn"
local m = rd.parameter("m", 2.3, "kg")
return rd.model { name = "slider", gravity = { 0, 0, 0 },
  links = { { "cart", joint = "x", mass = m, spring = { x = 31 }, limits = { x = { force = 20 } } } },
  points = { E = "cart" }, drives = { { "cart_x" } },
  constraints = function(s) return { rd.drive { "cart_x", 0.3 * rd.smoothstep(s.t, 0, rd.parameter("T", 1.3, "s"), 5), name = "push" } } end }
"""


def test_results_state_the_version(tmp_path):
    """All JSON has the version under one key; results of statics and modes remain states, and equal calls give equal bytes."""
    (tmp_path / "slider.lua").write_text(SLIDER)
    (tmp_path / "sweep.lua").write_text('local rd = require "refdyn"\nreturn rd.sweep { vary = { m = rd.grid(1, 2, 3) }, t_end = 0.1 }')
    (tmp_path / "plan.lua").write_text('local rd = require "refdyn"\nreturn rd.plan { vary = { T = rd.within(0.5, 3) }, t_end = "T", minimise = "T" }')
    commands = {
        "eval.json": ["eval", PENDULUM], "statics.json": ["statics", PENDULUM], "modes.json": ["modes", PENDULUM], "linear.json": ["linearise", PENDULUM],
        "again.json": ["modes", PENDULUM, "--at", "statics.json"], "more.json": ["linearise", PENDULUM, "--at", "again.json"],
        "plan.json": ["plan", "slider.lua", "plan.lua"],
    }
    for name, words in commands.items():
        refdyn(*words, "-o", name, cwd=tmp_path)
        first = (tmp_path / name).read_bytes()
        refdyn(*words, "-o", name, cwd=tmp_path)
        assert (tmp_path / name).read_bytes() == first, name
    refdyn("sim", "slider.lua", "--until", 1, "--parameters", "plan.json", "-o", "run.csv", "--summary", "sim.json", cwd=tmp_path)
    refdyn("sim", "slider.lua", "--until", 1, "--realise", "-o", "real.csv", "--summary", "realise.json", cwd=tmp_path)
    refdyn("batch", "slider.lua", "sweep.lua", "-o", "runs.csv", "--summary", "batch.json", cwd=tmp_path)
    refdyn("sim", PENDULUM, "--until", 1, "-o", "pendulum.csv", cwd=tmp_path)
    refdyn("fit", PENDULUM, "pendulum.csv", "--vary", "upper_theta", "--noise", "E_z=1e-3", "-o", "fit.json", cwd=tmp_path)
    for name in [*commands, "sim.json", "realise.json", "real.start.json", "batch.json", "fit.json"]:
        assert json.loads((tmp_path / name).read_text())["refdyn"] == VERSION, name


def test_values_that_nothing_reads(tmp_path):
    (tmp_path / "m.lua").write_text("""local rd = require "refdyn"
local load, spare = rd.parameter("load", 1, "kg"), rd.parameter("spare", 3)
return rd.model { name = "m", gravity = { 0, 0, -9.81 }, links = { { "a", joint = "z", mass = load } } }""")
    said = refdyn("sim", "m.lua", "--until", "0.1", "--set", "load=2", "--set", "spare=4", "-o", "m.csv", cwd=tmp_path).stderr
    assert [line for line in said.splitlines() if "warning" in line] == ["refdyn: warning: --set spare: nothing that this command computes reads it"]


def test_motions_are_no_models(tmp_path):
    (tmp_path / "m.lua").write_text('return require "refdyn".model { name = "m", links = { { "a", joint = "z", mass = 1 } } }')
    for name in ("run.csv", "run.h5"):
        refdyn("sim", "m.lua", "--until", "0.1", "-o", name, cwd=tmp_path)
        assert refdyn("check", name, cwd=tmp_path, status=1).stderr == f"{name}: contains motions; name a model in Lua\n"


def test_failed_motions_say_nothing_of_energies_that_were_not_seen(tmp_path):
    said = refdyn("sim", REFERENCE, "--set", "program=none", "--until", "1", "--every", "1", "--method", "rk4", "--step", "0.1", "-o", "run.csv", cwd=tmp_path, status=3).stderr
    assert "does not change" not in said, said


def test_compile_tells_what_it_leaves():
    """A library in the cache, the same one for the same model; its values, and the parts of each result."""
    told, again, lanes = (json.loads(refdyn("compile", REFERENCE, *words).stdout) for words in ([], ["--set", "m_E=3"], ["--emit", "qdd,d_qdd", "--for-lanes"]))
    assert os.path.exists(told["library"]) and told["library"] == again["library"] != lanes["library"]
    assert told["lanes"] == 0 and lanes["lanes"] in (2, 4, 8) and told["coordinates"][0] == {"name": "base_z", "unit": "m"}
    values = [{entry["name"]: entry for entry in one["parameters"]} for one in (told, again)]
    assert values[1]["m_E"] == {"name": "m_E", "unit": "kg", "value": 3, "anchored": False} and values[0]["xc"]["anchored"]
    parts = {entry["quantity"]: [(part["name"], part["count"]) for part in entry["parts"]] for entry in lanes["functions"]}
    assert parts["qdd"] == [("qdd", 13)] and parts["d_qdd"][:3] == [("q", 169), ("qd", 169), ("t", 13)] and "M_h" in told["quantities"]


WRONG_USAGE = [
    [], ["nothing"], ["gen"], ["gen", PENDULUM], ["gen", PENDULUM, "-o"], ["eval", PENDULUM, "--stat", "x", "--nothing"],
    ["sim", PENDULUM], ["sim", PENDULUM, "--until", "-1", "-o", "x.csv"], ["sim", PENDULUM, "--until", "one", "-o", "x.csv"],
    ["sim", PENDULUM, "--until", "1", "--method", "rk3", "-o", "x.csv"],
    ["sim", PENDULUM, "--until", "1", "--stabilise", "much", "-o", "x.csv"],
    ["sim", PENDULUM, "--until", "1", "--step", "0", "-o", "x.csv"],
    ["gen", PENDULUM, "--emit", "qddd", "-o", "x"], ["gen", PENDULUM, "--emit", "M,nothing", "-o", "x"], ["gen", PENDULUM, "--emit", "", "-o", "x"],
    ["gen", PENDULUM, "--emit", "qdd_free,,M", "-o", "x"], ["gen", PENDULUM, "--emit", "M,", "-o", "x"], ["bench", PENDULUM, "--emit", ",M"],
    ["report", PENDULUM, "--until", "1", "--methods", "rk4,rk3", "-o", "x"], ["report", PENDULUM, "--until", "1", "--tols", "1e-3,2", "-o", "x"],
    ["report", PENDULUM, "--until", "1", "--steps", "1e-3,", "--seconds", "0", "-o", "x"],
    ["check", PENDULUM, PENDULUM], ["check", PENDULUM, "--set", "n_rfe"], ["check", PENDULUM, "--until", "1"], ["plot", "-o", "x.svg"],
    ["merge", "-o", "x.h5"], ["merge", "a.h5"],
]


@pytest.mark.parametrize("arguments", WRONG_USAGE, ids=lambda arguments: " ".join(str(a).split("/")[-1] for a in arguments) or "none")
def test_wrong_usage(arguments, tmp_path):
    done = refdyn(*arguments, status=2, cwd=tmp_path)
    assert "usage: refdyn" in done.stderr and done.stdout == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments, said", [
    ("gen m.lua --emit -o o1", "--emit needs a value before '-o'"), ("gen m.lua -o --emit M", "-o needs a value before '--emit'"),
    ("sim m.lua --until -h", "--until needs a value before '-h'"), ("sim m.lua --set --until 1", "--set needs a value before '--until'"),
    ("view a.csv -o a.pdf", "-o: 'a.pdf' must end in .html or .htm"), ("view a.csv -o b.c/a.h5", "-o: 'b.c/a.h5' must end in .html or .htm"),
    ("sim m.lua --until -1 -o x.csv", "--until: '-1' is not a positive number"), ("gen m.lua --emit=-o o1", "unexpected operand 'o1'; give only MODEL.lua"),
])
def test_an_option_is_no_value_of_another(arguments, said, tmp_path):
    """Negative numbers and what follows an equals sign are values. Pages end in .html or .htm."""
    done = refdyn(*arguments.split(), status=2, cwd=tmp_path)
    assert done.stderr.splitlines()[0] == f"refdyn {arguments.split()[0]}: {said}" and not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments, said", [
    (["--emit", "foo"], "--emit: 'foo' is not a quantity; use some of all implicit step step.p M h "), (["--emit", "qdds"], "--emit: 'qdds' is not a quantity; did you mean \"qdd\"?\n"),
    (["--emit", "M, h"], "--emit: 'M, h' has a blank next to a comma or at an end; remove it\n"), (["--emit", "M,h "], "--emit: 'M,h ' has a blank next to a comma or at an end; remove it\n"),
    (["--real", "float", "--emit", "qdd,breaks"],
     "--emit: 'breaks' is only for the runtime, which computes with doubles; leave out this name, or --real float\n"),
    (["--dt", "0.1"], "unknown option --dt\n"),
], ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_wrong_quantities(arguments, said, tmp_path):
    assert refdyn("gen", PENDULUM, *arguments, "-o", tmp_path / "c", status=2).stderr.startswith(f"refdyn gen: {said}") and not list(tmp_path.iterdir())


def test_options_under_the_names_of_other_programs(tmp_path):
    for other, own in (("dt", "step"), ("rtol", "tol"), ("t_end", "until")):
        said = refdyn("sim", PENDULUM, f"--{other}", "0.1", "-o", tmp_path / "run.csv", status=2).stderr
        assert said.startswith(f"refdyn sim: unknown option --{other}; did you mean --{own}?\n")


def test_unknown_setting():
    done = refdyn("check", REFERENCE, "--set", "n_rfes=3", status=1)
    assert "n_rfes" in done.stderr and "n_rfe" in done.stderr.replace("n_rfes", "")


@pytest.mark.parametrize("setting", ["n_rfe=0", "n_rfe=two", "program=nothing", "a=nan", "a=one", "dofs=psi,omega", "form=other"])
def test_setting_out_of_range(setting):
    done = refdyn("check", REFERENCE, "--set", setting, status=1)
    assert re.search(rf"^{re.escape(str(REFERENCE))}(:\d+)?: [^:\n]+: .+", done.stderr, re.M), done.stderr
    assert any(word in done.stderr for word in (setting.split("=")[0], "rfe")), done.stderr


def test_missing_model(tmp_path):
    done = refdyn("check", tmp_path / "none.lua", status=1)
    assert done.stderr == f"{tmp_path}/none.lua: cannot be read: No such file or directory\n"


def test_faults_of_no_line_name_none(tmp_path):
    """Messages about a file as a whole, or about the command line, have no line number."""
    (tmp_path / "empty.lua").write_text("")
    (tmp_path / "file").write_text("")
    facts = {
        ("check", "empty.lua"): "empty.lua: the file returns nothing; must return rd.model { ... }",
        ("check", PENDULUM, "--set", "nothing=1"): f"{PENDULUM}: --set nothing: the model has no option, parameter or input of this name; it has none; declare a number by rd.parameter",
        ("gen", PENDULUM, "-o", "file/out"): "file/out: output: the folder cannot be made: Not a directory",
        ("eval", PENDULUM, "--state", "none.json"): "none.json: state: No such file or directory; must be a readable file",
        ("plot", "none.csv", "-o", "none.svg"): "none.csv: run: No such file or directory; must be a readable file",
    }
    found = {arguments: refdyn(*arguments, status=1, cwd=tmp_path).stderr for arguments in facts}
    assert found == {arguments: fact + "\n" for arguments, fact in facts.items()}


BAD_STATES = {
    "no JSON": ("{", "1"), "a list": ("[]", "1"), "wrong length": ('{"q": [1]}', "1"), "NaN": ('{"q": [NaN, 1]}', "1"),
    "too large": ('{"q": [1e999, 1]}', "1"), "text": ('{"q": ["1", 2]}', "1"), "nested": ('{"qd": [[1], 2]}', "1"),
    "unknown key": ('{"t": 1,\n "velocity": [1, 2]}', "2"), "unknown input": ('{"t": 1,\n "inputs": {"tau": 1}}', "2"),
    "unknown parameter": ('{"parameters": {\n"mass": 1}}', "2"), "null": ('{"t": null}', "1"), "twice": ('{"t": 1, "t": 2}', "1"),
    "empty": ("", "1"),
}


@pytest.mark.parametrize("which", BAD_STATES)
def test_bad_state(which, tmp_path):
    text, line = BAD_STATES[which]
    (tmp_path / "state.json").write_text(text)
    done = refdyn("eval", PENDULUM, "--state", tmp_path / "state.json", status=1)
    assert re.search(rf"^[^\n]*state\.json:{line}: .+: .+", done.stderr, re.M), done.stderr
    assert done.stdout == ""


def test_columns_of_one_name_are_warned_of(tmp_path):
    (tmp_path / "twice.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "twice", gravity = { 0, 0, -9.81 },\n'
                                        '  links = { { "cart", joint = "z", mass = 1 } },\n  points = { cart = "cart" } }\n')
    done = refdyn("check", tmp_path / "twice.lua")
    assert re.search(r"twice\.lua:4: warning: points\.cart: .*cart_z", done.stderr), done.stderr


def test_impossible_parameter_in_state(tmp_path):
    """Values from a state are checked like values from --set: the message has the model's line, and nothing is computed."""
    (tmp_path / "state.json").write_text('{"parameters": {"m_E": -1}}')
    done = refdyn("eval", REFERENCE, "--state", tmp_path / "state.json", status=1)
    assert PLACE.search(done.stderr) and "positive" in done.stderr, done.stderr
    assert done.stdout == ""


def test_numbers_read_back_exactly(tmp_path):
    state = {"t": 0.1, "q": [0.1 + 0.2, -1 / 3], "qd": [1e-17, 123456.789012345678]}
    text = json.dumps(state)
    (tmp_path / "state.json").write_text(text)
    out = refdyn("eval", PENDULUM, "--state", tmp_path / "state.json").stdout
    again = refdyn("eval", PENDULUM, "--state", tmp_path / "state.json").stdout
    assert out == again
    for number in re.findall(r"-?\d+\.\d+(?:e[+-]?\d+)?", out):
        assert len(number.replace("-", "").replace(".", "").split("e")[0].strip("0")) <= 17, number


@pytest.mark.quick
def test_keys_of_eval():
    found = evaluate(REFERENCE)
    assert set(found) >= {"name", "coordinates", "M", "h", "Q", "u", "v", "phi", "psi", "k", "points", "dependent", "qdd",
                          "qdd_free", "force", "energy"}
    assert set(found["points"]["E"]) == {"r", "rd", "C", "d"}


def test_statics_hold():
    def statics(*arguments, status=0):
        done = refdyn("statics", REFERENCE, *arguments, status=status)
        return json.loads(done.stdout) if status == 0 else done
    usual = statics()
    assert list(usual)[:3] == ["refdyn", "coordinates", "q"] and len(usual["hold_force"]) == 3
    same = statics("--hold", "column_psi,arm_psi,effector_z")
    assert same["q"] == usual["q"]
    # One more held coordinate: it keeps its value and its force is reported, in the order of q.
    more = statics("--hold", "effector_z,arm_psi,column_psi,base_z")
    assert more["q"][0] == 0 and len(more["hold_force"]) == 4
    assert abs(more["hold_force"][0] - 9.81 * (18.54331045 + 10 + 2 + 7801 * 3.141592653589793 * 0.01413200743**2 / 4 * 2)) < 1e-9
    assert "'arm_ps'" in statics("--hold", "arm_ps", status=2).stderr


def test_statics_all_free(tmp_path):
    """--hold '' frees the coordinates that the model holds: two weights on springs, one of which the model holds."""
    model = tmp_path / "weights.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "weights", gravity = { 0, 0, -10 }, hold = { "b_z" },\n'
                     '  links = { { "a", joint = { "z" }, mass = 1, spring = { z = 100 } },\n'
                     '            { "b", joint = { "z" }, mass = 2, spring = { z = 100 } } } }\n')
    held, free = (json.loads(refdyn("statics", model, *hold).stdout) for hold in ((), ("--hold", "")))
    assert abs(held["q"][0] + 0.1) < 1e-12 and held["q"][1] == 0 and abs(held["hold_force"][0] - 20) < 1e-12
    assert abs(free["q"][0] + 0.1) < 1e-12 and abs(free["q"][1] + 0.2) < 1e-12 and free["hold_force"] == []


def test_statics_without_equilibrium(tmp_path):
    model = tmp_path / "falling.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "falling", gravity = { 0, 0, -9.81 },\n'
                     '  links = { { "stone", joint = { "z" }, mass = 1 } } }\n')
    done = refdyn("statics", model, status=3)
    assert "stone_z" in done.stderr and done.stdout == ""


def test_files_of_sim(tmp_path):
    refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--method", "rk4", "--step", "1e-3", "--until", "0.2", "--every", "0.05",
           "-o", tmp_path / "run.csv", "--summary", tmp_path / "summary.json")
    header = (tmp_path / "run.csv").read_text().splitlines()[0].split(",")
    names = ["base_z", "column_psi", "arm_psi", "effector_z"]
    expected = (["t", *names, *(name + "_d" for name in names)]
                + [f"E_{axis}{order}" for order in ("", "d", "dd") for axis in "xyz"]
                + ["phi_1", "psi_1", "psi_2", "lambda_ellipse", "lambda_rise", "energy"] + ["force_" + name for name in names])
    assert header[:len(expected)] == expected and header[-4:] == [name + "_dd" for name in names]
    run = read_run(tmp_path / "run.csv")
    assert list(run["t"]) == [0, 0.05, 0.1, 0.15000000000000002, 0.2] or list(run["t"]) == [0, 0.05, 0.1, 0.15, 0.2]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert set(summary) >= set("method steps rejected evaluations phi_max psi_max energy_error cpu_s wall_s".split())
    assert summary["method"] == "rk4" and summary["steps"] == 200 and summary["rejected"] == 0


def test_outputs_fall_on_multiples(tmp_path):
    refdyn("sim", PENDULUM, "--method", "rk4", "--step", "0.03", "--until", "1", "-o", tmp_path / "run.csv")
    t = read_run(tmp_path / "run.csv")["t"]
    assert len(t) == 201 and abs(t - [i / 200 for i in range(201)]).max() < 1e-15


TWIN = """local rd = require "refdyn"
return rd.model { name = "twin", gravity = { 0, 0, -9.81 },
  links = { { "bob", joint = { "x", "y", "z" }, mass = 1, start = { x = -1 } } },
  points = { E = "bob" },
  constraints = function(s)
    local E = s.points.E
    return { rd.position { E.x^2 + E.z^2 - 1, alpha = 10, beta = 10, name = "circle" },
             rd.position { 3*(E.x^2 + E.z^2 - 1) + RATE*s.t, alpha = 10, beta = 10, name = "again" } }
  end }
"""


def test_redundant_rows_are_named(tmp_path):
    """A row that follows from another one is omitted and named; a row that contradicts another one ends the run."""
    model = tmp_path / "twin.lua"
    model.write_text(TWIN.replace("RATE", "0"))
    done = refdyn("sim", model, "--until", "0.1", "-o", tmp_path / "run.csv")
    assert re.search("redundant.*(again|circle)|(again|circle).*redundant", done.stderr), done.stderr
    model.write_text(TWIN.replace("RATE", "1"))
    done = refdyn("sim", model, "--until", "0.1", "-o", tmp_path / "run.csv", status=3)
    assert "again" in done.stderr or "circle" in done.stderr


def test_failed_run_keeps_what_it_had(tmp_path):
    """A coordinate under a force that grows without bound: the computation fails, and the rows so far remain readable."""
    model = tmp_path / "runaway.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "runaway",\n'
                     '  links = { { "cart", joint = { "x" }, mass = 1, start = { x = 1 } } },\n'
                     "  forces = function(s) return { cart_x = 1/(1.5 - s.t) + s.q.cart_x^9 } end }\n")
    done = refdyn("sim", model, "--method", "rk4", "--step", "0.01", "--until", "3", "--every", "0.05", "-o", tmp_path / "run.csv",
                  status=3)
    assert re.search(r"t = ?[0-9.]+|time", done.stderr) and "cart_x" in done.stderr, done.stderr
    kept = [path for path in tmp_path.iterdir() if path.name.startswith("run.csv")]
    assert len(kept) == 1, kept
    run = read_run(kept[0])
    assert len(run["t"]) > 5 and run["t"][-1] < 3


def test_failed_gen_leaves_nothing(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    out.chmod(stat.S_IRUSR | stat.S_IXUSR)
    bad = tmp_path / "bad.lua"
    bad.write_text('local rd = require "refdyn"\nreturn rd.model { name = "bad", links = { { "a", mass = -1 } } }\n')
    refdyn("gen", bad, "-o", tmp_path / "none", status=1)
    assert not (tmp_path / "none").exists() or not list((tmp_path / "none").iterdir())
    if os.geteuid() != 0:
        refdyn("gen", PENDULUM, "-o", out, status=1)
        assert not list(out.iterdir())
    # A file already has the folder's name.
    (tmp_path / "file").write_text("")
    done = refdyn("gen", PENDULUM, "-o", tmp_path / "file", status=1)
    assert "file" in done.stderr


def test_gen_leaves_no_parts_of_an_earlier_emission(tmp_path):
    """Parts of an earlier, longer emission are removed; all other files remain."""
    refdyn("gen", REFERENCE, "--set", "n_rfe=32", "--loops", "never", "--emit", "all,d_qdd", "-o", tmp_path)
    assert len(list(tmp_path.glob("manipulator_*.c"))) >= 3
    own = {"manipulator_extra.c": "int extra;\n", "other_2.c": (tmp_path / "manipulator_2.c").read_text()}
    (tmp_path / "manipulator_2.c").write_text("int own;\n")
    for name, text in own.items():
        (tmp_path / name).write_text(text)
    refdyn("gen", REFERENCE, "--emit", "M", "-o", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"manipulator.h", "manipulator.c", "manipulator_2.c", *own}
    assert (tmp_path / "manipulator_2.c").read_text() == "int own;\n"
    assert all((tmp_path / name).read_text() == text for name, text in own.items())


def test_full_device():
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full:
            done = subprocess.run([REFDYN, "check", PENDULUM], stdout=full, stderr=subprocess.PIPE)
        assert done.returncode == 1


def counting_compiler(folder):
    """A compiler that records each call."""
    script = folder / "compiler with blanks"
    script.write_text(f'#!/bin/sh\necho call >>"{folder}/calls"\nexec cc "$@"\n')
    script.chmod(0o755)
    return script


def calls(folder):
    return len((folder / "calls").read_text().splitlines()) if (folder / "calls").exists() else 0


@pytest.mark.quick
def test_second_call_does_not_compile(tmp_path):
    folder = tmp_path / "a folder with blanks"
    folder.mkdir()
    env = {"CC": str(counting_compiler(folder)), "REFDYN_CACHE": str(folder / "the cache")}
    model = folder / "my model.lua"
    model.write_text(REFERENCE.read_text())
    first = evaluate(model, None, "--set", "n_rfe=1", env=env)
    once = calls(folder)
    assert once > 0
    second = evaluate(model, None, "--set", "n_rfe=1", env=env)
    assert calls(folder) == once and first == second
    # Another value of a parameter needs no other program; another structure does.
    evaluate(model, None, "--set", "n_rfe=1", "--set", "m_E=3.5", env=env)
    assert calls(folder) == once
    evaluate(model, None, "--set", "n_rfe=2", env=env)
    assert calls(folder) > once


def test_compiler_that_fails(tmp_path):
    script = tmp_path / "cc"
    script.write_text("#!/bin/sh\necho 'no space left' >&2\nexit 1\n")
    script.chmod(0o755)
    env = {"CC": str(script), "REFDYN_CACHE": str(tmp_path / "cache")}
    done = refdyn("eval", PENDULUM, status=1, env=env)
    assert "no space left" in done.stderr
    done = refdyn("eval", PENDULUM, status=1, env={**env, "CC": "no-such-compiler"})
    assert "no-such-compiler" in done.stderr
    evaluate(PENDULUM, None, env={"REFDYN_CACHE": str(tmp_path / "cache")})


@pytest.mark.parametrize("home", [{}, {"HOME": "/proc/none"}, {"HOME": ""}], ids=str)
def test_cache_without_a_home(home, tmp_path):
    """A user without a home compiles into a private folder in TMPDIR; a folder that others may write to is refused."""
    env = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME", "REFDYN_CACHE")}
    env.update(home, TMPDIR=str(tmp_path))
    done = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    [folder] = tmp_path.iterdir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700 and list(folder.glob("*.so"))
    folder.chmod(0o777)
    done = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True, text=True)
    assert done.returncode == 1 and "REFDYN_CACHE" in done.stderr


def test_spoiled_cache(tmp_path):
    """A file in the cache that is no library is replaced, or an error is reported; it never crashes the program."""
    env = {"REFDYN_CACHE": str(tmp_path)}
    first = evaluate(PENDULUM, None, env=env)
    for path in some(tmp_path.rglob("*.so")):
        path.write_bytes(b"no library")
    assert evaluate(PENDULUM, None, env=env) == first


def test_results_go_to_stdout_or_file(tmp_path):
    done = refdyn("eval", PENDULUM)
    refdyn("eval", PENDULUM, "-o", tmp_path / "e.json")
    assert (tmp_path / "e.json").read_text() == done.stdout and json.loads(done.stdout)
    assert done.stderr == ""
    assert [path.name for path in tmp_path.iterdir()] == ["e.json"]


def test_what_is_no_plain_file_is_written_itself(tmp_path):
    """-o /dev/null or a link is written through and keeps its kind: no regular file replaces it."""
    link = tmp_path / "link"
    link.symlink_to("/dev/null")
    refdyn("sim", PENDULUM, "--until", "0.1", "--step", "1e-2", "-o", link, "--summary", link)
    refdyn("eval", PENDULUM, "-o", link)
    assert link.is_symlink() and stat.S_ISCHR(os.stat("/dev/null").st_mode)
    pipe = subprocess.run([REFDYN, "eval", PENDULUM, "-o", "/dev/stdout"], capture_output=True, text=True, check=True)
    assert json.loads(pipe.stdout) and [path.name for path in tmp_path.iterdir()] == ["link"]


def test_gen_tells_what_it_did(tmp_path):
    said = refdyn("gen", REFERENCE, "-o", tmp_path / "deep" / "folder").stdout
    assert "13 coordinates" in said and re.search(r"\bM\b", said) and re.search(r"\d+", said)


@pytest.mark.quick
def test_settings_reach_the_numbers():
    light, heavy = (evaluate(REFERENCE, None, "--set", "n_rfe=1", "--set", f"m_E={mass}") for mass in (2, 3))
    assert heavy["M"][3][3] - light["M"][3][3] == 1
    folded = evaluate(REFERENCE, None, "--set", "n_rfe=1", "--set", "m_E=3", "--fold")
    assert abs(folded["M"][3][3] - 3) < 1e-15


def test_plot(tmp_path):
    runs = []
    for name, mass in (("light", 1), ("heavy", 4)):
        runs.append(tmp_path / f"{name}.csv")
        refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--set", f"m_E={mass}", "--method", "rk4", "--step", "1e-3", "--until", "0.5",
               "-o", runs[-1])
    refdyn("plot", *runs, "-o", tmp_path / "figure.svg")
    figure = (tmp_path / "figure.svg").read_text()
    assert figure.lstrip().startswith("<?xml") and figure.rstrip().endswith("</svg>")
    assert "light" in figure and "heavy" in figure and figure.count("<path") > 10
    bad = tmp_path / "bad.csv"
    bad.write_text("t,x\n0,1\n1,two\n")
    refdyn("plot", bad, "-o", tmp_path / "none.svg", status=1)
    assert not (tmp_path / "none.svg").exists()


@pytest.mark.quick
def test_bench():
    lines = [json.loads(line) for line in refdyn("bench", REFERENCE, "--set", "n_rfe=1").stdout.splitlines()]
    keys = {"quantity", "n", "adds", "muls", "divs", "funcs", "bytes", "ns", "ns_low", "ns_high"}
    quantities = {line["quantity"]: line for line in lines}
    assert set(quantities) >= {"M", "h", "Q", "build"}
    for name, line in quantities.items():
        if name != "build":
            assert set(line) >= keys and line["n"] == 4 and line["ns_low"] <= line["ns"] <= line["ns_high"]
    assert set(quantities["build"]) >= {"gen_s", "cc_s", "source_bytes", "object_bytes", "peak_kb"}


@pytest.mark.parametrize("model", ["gantry"] if LEAN else ["manipulator", "gantry", "planar", "pendulum"])
def test_bench_has_every_quantity(model, tmp_path):
    """One line for each function that `refdyn gen` lists, with the same counts."""
    emit = ["--emit", "all,tangent,tangent_vectors,d_qdd,d_qdd_free,d_force,d_inverse,d_statics,d_rows,inverse"]
    said = refdyn("gen", MODELS / f"{model}.lua", *emit, "-o", tmp_path).stdout
    listed = re.findall(r"^(\w+) +(\d+) +(\d+) +(\d+) +(\d+)$", said, re.M)
    assert listed
    lines = [json.loads(line) for line in refdyn("bench", MODELS / f"{model}.lua", *emit).stdout.splitlines()]
    found = {line["quantity"]: [line.get(key) for key in ("adds", "muls", "divs", "funcs")] for line in lines[:-1]}
    assert lines[-1]["quantity"] == "build" and len(lines) == len(found) + 1
    assert found == {name: [int(count) for count in counts] for name, *counts in listed}


@pytest.mark.quick
def test_bench_prints_what_is_named():
    """Functions that others call or that the program itself needs have no line. Steps are refused, as are quantities that the model lacks."""
    quantities = lambda *emit: [json.loads(line)["quantity"] for line in refdyn("bench", PENDULUM, "--emit", ",".join(emit)).stdout.splitlines()]
    assert quantities("M_h", "d_qdd.q") == ["M_h", "d_qdd", "build"]
    assert quantities("implicit", "qdd") == ["qdd", "tangent", "build"]
    done = refdyn("bench", PENDULUM, "--emit", "M,u")
    assert len(done.stdout.splitlines()) == 2 and done.stderr == "refdyn: double_pendulum: left out: u: no constraints\n"
    done = refdyn("bench", PENDULUM, "--emit", "u", status=1)
    assert done.stdout == "" and done.stderr == f"{PENDULUM}:4: --emit u: nothing to emit for this model; u: no constraints\n"
    for steps in ("step", "qdd,step.p"):
        assert refdyn("bench", PENDULUM, "--emit", steps, status=2).stderr.startswith("refdyn bench: --emit: steps are not measured, because ")


@pytest.mark.parametrize("command", [["bench"], ["report", "--until", 0.1, "--methods", "rk8", "--tols", 1e-3, "-o", "out"]],
                         ids=["bench", "report"])
def test_warnings_are_told_once(command, tmp_path):
    (tmp_path / "still.lua").write_text('local rd = require "refdyn"\nreturn rd.model { name = "still", links = {\n'
                                        '  { "a", joint = "x", mass = 1, start_rate = { x = 1 } },\n  { "b", joint = "x", mass = 1 } } }\n')
    done = refdyn(command[0], "still.lua", *command[1:], cwd=tmp_path)
    assert done.stderr.count("still.lua:4: warning: coordinate b_x: ") == 1, done.stderr


def read_report(folder):
    """The lines of the only CSV file there."""
    [path] = folder.glob("*.csv")
    with open(path) as file:
        return list(csv.DictReader(file))


def findings(text):
    """The rows of the printed table, headers first."""
    return [re.split("  +", line.strip()) for line in text.splitlines() if re.match(r"\S+(, \w+)?  +", line)]


@pytest.mark.quick
def test_report(tmp_path):
    """Slope, floor, page and figure; everything except the times is the same on a second call."""
    done, kept = [], []
    for folder in (tmp_path / "one", tmp_path / "two"):
        done.append(refdyn("report", REFERENCE, "--set", "n_rfe=1", "--until", "0.5", "--methods", "rk4,rodas5p", "--steps", "4e-3,2e-3,1e-3",
                           "--tols", "1e-5,1e-4", "-o", folder).stdout)
        lines = read_report(folder)
        kept.append([{key: value for key, value in line.items() if key != "cpu_s"} for line in lines])
        assert all(float(line["cpu_s"]) > 0 for line in lines if line["result"] == "done")
        assert {path.suffix for path in folder.iterdir()} == {".csv", ".svg", ".html"}
        page, figure = ((folder / f"manipulator.{ending}").read_text() for ending in ("html", "svg"))
        assert figure[figure.index("<svg"):].strip() in page and "rodas5p" in figure
        assert not re.search(r"(src|href)=.https?:", page)
    assert kept[0] == kept[1]
    references = [line for line in kept[0] if line["kind"] == "reference"]
    assert len({line["method"] for line in references}) == 2 and float(references[1]["error"]) < 1e-9
    tols = [float(line["tol"]) for line in kept[0] if line["kind"] == "run" and line["method"] == "rodas5p"]
    assert tols == [1e-4, 1e-5]
    rows = {row[0]: row[1:] for row in findings(done[0])}
    assert rows["method"][:4] == ["CPU s for 0.001 m", "CPU s for 1e-06 m", "CPU s for 1e-09 m", "error proportional to"]
    slope = re.fullmatch(r"step\^(\S+) \(3 runs\)", rows["rk4, project"][3])
    assert slope and abs(float(slope[1]) - 4) < 0.5 * SCALE and rows["rodas5p"][3] == "-", done[0]
    assert all(f"<td>{cell}</td>" in page for cell in findings(done[1])[1])


def test_report_errors_are_those_of_the_motion(tmp_path):
    """The error equals the error relative to the motion that other programs computed."""
    arguments = ["--set", "n_rfe=1", "--until", "10", "--every", "0.5"]
    refdyn("report", REFERENCE, *arguments, "--methods", "rodas5p", "--tols", "1e-6", "-o", tmp_path)
    [claimed] = [float(line["error"]) for line in read_report(tmp_path) if line["kind"] == "run"]
    run, _, _ = motion(REFERENCE, *arguments, "--method", "rodas5p", "--tol", "1e-6")
    found = max(math.dist([run[f"E_{axis}"][i] for axis in "xyz"], sample["r_E"])
                for i, sample in enumerate(oracle("traj_seed_rigid")["samples"]))
    assert abs(claimed - found) <= 1e-2 * found * SCALE, (claimed, found)


def test_report_shows_every_stabilisation(tmp_path):
    """Each stabilisation is refined to steps with which it is stable, however small its gains make them."""
    refdyn("report", REFERENCE, "--vary", "n_rfe=1", "--methods", "rk4", "--from", "statics", "--until", "0.2", "-o", tmp_path)
    done = [line for line in read_report(tmp_path) if line["kind"] == "run" and line["result"] == "done"]
    assert {line["stabilise"] for line in done} == {"none", "baumgarte", "project"} and {line["variant"] for line in done} == {"n_rfe=1"}


def test_report_takes_references_of_different_kinds(tmp_path):
    """Stiff damping leaves a collocation and a Rosenbrock method; without the tangent only explicit methods and auto remain."""
    done = refdyn("report", REFERENCE, "--set", "n_rfe=16", "--set", "eta=1.3e-2", "--from", "statics", "--until", "0.5", "--methods",
                  "auto,rodas5p", "--tols", "1e-5", "--seconds", "16", "-o", tmp_path / "stiff")
    lines = read_report(tmp_path / "stiff")
    references = [line for line in lines if line["kind"] == "reference"]
    assert {line["method"] for line in references} == {"gauss12", "rodas6p"} and float(references[1]["error"]) < 1e-10, lines
    assert "makes it weaker" not in done.stdout and re.search(r"^auto .*\(\d+\.\d\d\)", done.stdout, re.M)
    done = refdyn("report", REFERENCE, "--set", "n_rfe=1", "--set", "form=printed", "--until", "0.1", "--tols", "1e-5", "--steps", "1e-3",
                  "-o", tmp_path / "printed")
    methods = {line["method"] for line in read_report(tmp_path / "printed")}
    assert methods == {"auto", "rk4", "rk54", "rk8"} and "makes it weaker" in done.stdout and "tangent" in done.stderr


def test_report_stops_what_is_too_slow(tmp_path):
    done = refdyn("report", REFERENCE, "--set", "n_rfe=1", "--until", "10", "--methods", "rk4", "--steps", "1e-8,1e-3", "--seconds", "12",
                  "-o", tmp_path)
    slow = [line for line in read_report(tmp_path) if "too slow" in line["result"]]
    assert [float(line["step"]) for line in slow] == [1e-8] * 3 and "too slow" in done.stdout
    assert refdyn("report", REFERENCE, "--until", "1", "--seconds", "1e-9", "-o", tmp_path / "none", status=3).stderr.count("--seconds")
    assert not (tmp_path / "none").exists()


PRINTED = ["--set", "n_rfe=1", "--set", "form=printed", "--until", "0.05"]


def test_methods_of_the_printed_form(tmp_path):
    """The printed form has no tangent: an implicit method is refused with a list of possible ones; without --method one of these is chosen."""
    done = refdyn("sim", REFERENCE, *PRINTED, "--method", "rodas5p", "-o", tmp_path / "run.csv", status=1)
    assert "tangent" in done.stderr and "printed" in done.stderr and "rk54" in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())
    refdyn("sim", REFERENCE, *PRINTED, "-o", tmp_path / "run.csv", "--summary", tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text())["chosen"].keys() == {"rk8"}


@pytest.mark.parametrize("command, most", [(["sim"], 10000000), (["sim", "--verify"], 1000000), (["report", "-o", "out"], 1000000)])
def test_too_many_outputs(command, most, tmp_path):
    done = refdyn(command[0], PENDULUM, "--until", 1, "--every", 1e-12, *command[1:], status=2, cwd=tmp_path)
    assert done.stderr.startswith(f"refdyn {command[0]}: --every 1e-12: 1e+12 outputs; must be at most {most}\n") and done.stdout == ""
    assert not list(tmp_path.iterdir())


def test_methods_and_steps(tmp_path):
    """With --tol, or by default, steps are adaptive; with --step they are fixed, for every method. The methods are listed."""
    known = refdyn("sim", "--help").stdout
    for method in ("rk4", "rk54", "rk8", "rodas5p", "rodas6p", "ros34pw2", "radau9", "gauss12"):
        assert method in known and method in refdyn("sim", PENDULUM, "--until", "1", "--method", "rk3", status=2).stderr
        refdyn("sim", PENDULUM, "--until", "0.1", "--every", "0.05", "--method", method, "--step", "0.01", "-o", tmp_path / "run.csv",
               "--summary", tmp_path / "summary.json")
        summary = json.loads((tmp_path / "summary.json").read_text())
        assert summary["method"] == method and summary["steps"] == 10 and summary["rejected"] == 0
    assert "--step" in refdyn("sim", PENDULUM, "--until", "1", "--method", "rk4", "--tol", "1e-6", status=2).stderr
    assert "--step" in refdyn("sim", PENDULUM, "--until", "1", "--tol", "1e-6", "--step", "1e-2", status=2).stderr
    refdyn("sim", PENDULUM, "--until", "1", "--tol", "1e-3", "--step-max", "0.02", "-o", tmp_path / "run.csv",
           "--summary", tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text())["steps"] >= 50
