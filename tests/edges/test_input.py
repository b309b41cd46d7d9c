"""No setting, number, option or entry of a state is ignored silently; each error message has a place or the usage line."""
import json
import re

import pytest

from program import all_models, models_of_tests, refdyn

MODEL = """local rd = require "refdyn"
local n, wide = rd.option("n_rfe", 2, { from = 1, to = 64 }), rd.option("wide", true)
local p = rd.parameters { { "m", 2, "kg" }, { "t1", 3, "s" } }
local push, turn = rd.input("push", 0.5), rd.input("turn", 0)
return rd.model { name = "input", gravity = { 0, 0, -9.81 }, hold = { "arm_z" },
  links = { { "arm", joint = "z, psi", mass = p.m, inertia = { zz = 1 }, spring = { z = 100, psi = 50 } } },
  points = { E = { on = "arm", at = { 1, 0, 0 } } },
  forces = function(s) return { arm_z = push * rd.ramp(s.t, 0, p.t1), arm_psi = turn * n } end,
}
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "model.lua"
    path.write_text(MODEL)
    return path


SETTINGS = {
    "n_rfe=4.5": "a whole number", "n_rfe=1e300": "a whole number", "n_rfe=-1e17": "a whole number", "n_rfe= 4": "a whole number",
    "n_rfe=4 ": "a whole number", "n_rfe=0x4": "a whole number", "n_rfe=": "a whole number",
    "n_rfe=inf": "a whole number", "n_rfe=four": "a whole number", "n_rfe=4,5": "a whole number", "n_rfe=4..": "a whole number",
    "m= 1": "a number", "m=1 ": "a number", "m=1kg": "a number", "m=0x1p3": "a number", "m=nan": "a number",
    "m=-inf": "a number", "m=infinity": "a number", "m=1e400": "a number", "m=": "a number", "m=1e": "a number",
    "m=1,5": "a number", "push=nan": "a number", "push=1 N": "a number", "wide=yes": "true or false", "wide=True": "true or false",
    "wide=": "true or false",
}
LINES = {"n_rfe": 2, "wide": 2, "m": 3, "push": 4}  # where the model declares the names
UNIT = "; write the number alone, in SI units and radians"


@pytest.mark.parametrize("setting", SETTINGS)
def test_setting_that_is_no_value(setting, model):
    name, value = setting.split("=", 1)
    done = refdyn("check", model, "--set", setting, status=1)
    advice = {"m=1kg": UNIT, "push=1 N": UNIT, "m=1,5": "; write 1.5"}.get(setting, "")
    assert done.stderr == f'{model}:{LINES[name]}: --set {name}: value "{value}"; must be {SETTINGS[setting]}{advice}\n' and done.stdout == ""


def test_settings_out_of_range(model):
    """Relations between values are checked at the set values."""
    facts = {"n_rfe=65": 'option n_rfe: value "65"; must be a number from 1 to 64', "m=-1": "links[1].mass: value -1; must be positive",
             "t1=-2": "rd.ramp: from 0 to -2; the range must ascend", "t1=0": "rd.ramp: from 0 to 0; the range must ascend"}
    for setting, fact in facts.items():
        assert refdyn("check", model, "--set", setting, status=1).stderr.rstrip("\n").endswith(": " + fact)
    for setting in ("n_rfe=64", "n_rfe=+4", "n_rfe=1e1", "m=1e-3", "m=.5", "t1=1E2", "push=-0.5", "wide=false"):
        assert refdyn("check", model, "--set", setting).stderr == ""


def test_names_of_settings(model):
    facts = {"n_rf=4": 'did you mean "n_rfe"', " n_rfe=4": 'did you mean "n_rfe"',
             "n_rfe =4": 'did you mean "n_rfe"', "M=1": 'did you mean "m"', "gravity=1": "no option, parameter or input of this name"}
    for setting, fact in facts.items():
        done = refdyn("check", model, "--set", setting, status=1)
        assert fact in done.stderr and done.stderr.count("\n") == 1, done.stderr


USAGE = {
    "option twice": (["sim", "--until", "1", "--until", "2"], "--until is given twice"),
    "flag twice": (["check", "--fold", "--fold"], "--fold is given twice"),
    "output twice": (["gen", "-o", "a", "--output", "b"], "-o is given twice"),
    "setting twice": (["check", "--set", "m=1", "--set", "n_rfe=2", "--set", "m=2"], "--set m: given twice, as '1' and as '2'"),
    "setting twice alike": (["check", "--set", "m=1", "--set", "m=1"], "--set m: given twice, as '1' and as '1'"),
    "setting without a name": (["check", "--set", "=1"], "--set: '=1' is not of the form NAME=VALUE"),
    "stop twice": (["sim", "--until", "1", "--stop", "arm_z<1", "--stop", "arm_z<1"], "--stop: 'arm_z<1' is given twice; give it once"),
    "stop in hexadecimal": (["sim", "--until", "1", "--stop", "arm_z<0x1"], "--stop: 'arm_z<0x1' is not of the form NAME<VALUE or NAME>VALUE"),
    "stop behind a blank": (["sim", "--until", "1", "--stop", "arm_z< 1"], "--stop: 'arm_z< 1' is not of the form NAME<VALUE or NAME>VALUE"),
    "held twice": (["statics", "--hold", "arm_z,arm_z"], "--hold: 'arm_z' is given twice; give it once"),
    "held empty": (["statics", "--hold", "arm_z,,arm_psi"], "--hold: 'arm_z,,arm_psi' has an empty item"),
    "held with a comma behind": (["modes", "--hold", "arm_z,"], "--hold: 'arm_z,' has an empty item"),
    "held with a blank": (["statics", "--hold", "arm_z, arm_psi"], "--hold: 'arm_z, arm_psi' has a blank next to a comma or at an end; remove it"),
    "emitted twice": (["gen", "-o", "a", "--emit", "M,h,M"], "--emit: 'M' is given twice; give it once"),
    "emitted empty": (["gen", "-o", "a", "--emit", ""], "--emit: '' has an empty item"),
    "methods twice": (["report", "--until", "1", "-o", "a", "--methods", "rk8,rk8"], "--methods: 'rk8' is given twice; give it once"),
    "methods empty": (["report", "--until", "1", "-o", "a", "--methods", ""], "--methods: '' has an empty item"),
    "tolerances twice": (["report", "--until", "1", "-o", "a", "--tols", "1e-3,0.001"], "--tols: '1e-3,0.001' has a number twice"),
    "tolerances in words": (["report", "--until", "1", "-o", "a", "--tols", "1e-3,nan"], "--tols: '1e-3,nan' is not a list of up to"),
    "steps empty": (["report", "--until", "1", "-o", "a", "--steps", ",1e-3"], "--steps: ',1e-3' has an empty item"),
    "varied twice": (["report", "--until", "1", "-o", "a", "--vary", "n_rfe=1,1"], "--vary: '1' is given twice; give it once"),
    "varied and set": (["report", "--until", "1", "-o", "a", "--set", "n_rfe=1", "--vary", "n_rfe=1,2"], "--vary: --set sets n_rfe, too"),
    "time behind a blank": (["sim", "--until", " 1"], "--until: ' 1' is not a positive number"),
    "time before a blank": (["sim", "--until", "1 "], "--until: '1 ' is not a positive number"),
    "time in hexadecimal": (["sim", "--until", "0x10"], "--until: '0x10' is not a positive number"),
    "time without end": (["sim", "--until", "inf"], "--until: 'inf' is not a positive number"),
    "time beyond numbers": (["sim", "--until", "1e400"], "--until: '1e400' is not a positive number"),
    "time with a unit": (["sim", "--until", "1s"], "--until: '1s' is not a positive number"),
    "time empty": (["sim", "--until", ""], "--until: '' is not a positive number"),
    "modes without number": (["modes", "--modes", "1e12"], "--modes: 1e12 is not a whole number up to 1000000"),
    "modes in parts": (["modes", "--modes", "2.5"], "--modes: 2.5 is not a whole number up to 1000000"),
    "outputs without number": (["sim", "--until", "1", "--every", "1e-300"], "--every 1e-300: 1e+300 outputs; must be at most 10000000"),
    "steps without number": (["sim", "--until", "1", "--step", "1e-12"], "--step 1e-12: 1e+12 steps; must be at most 1000000000"),
    "state empty": (["eval", "--state", ""], "--state: the value is empty"),
    "method empty": (["sim", "--until", "1", "--method", ""], "--method: the value is empty"),
}


@pytest.mark.parametrize("which", USAGE)
def test_wrong_usage(which, model, tmp_path):
    (command, *arguments), fact = USAGE[which]
    done = refdyn(command, model, *arguments, status=2, cwd=tmp_path)
    lines = done.stderr.splitlines()
    assert lines[0].startswith(f"refdyn {command}: {fact}") and lines[-1].startswith(f"usage: refdyn {command} "), done.stderr
    assert done.stdout == "" and [path.name for path in tmp_path.iterdir()] == ["model.lua"]


def test_an_empty_operand():
    assert refdyn("check", "", status=2).stderr.startswith("refdyn check: MODEL.lua is an empty text\nusage:")


STATES = {
    "unknown key": ('{\n"t": 0,\n"Qd": [1, 2]\n}', 3, "Qd: unknown key of a state (t, q, qd, states, inputs, parameters); the nearest is qd"),
    "key in capitals": ('{"t": 0,\n"Q": [1, 2]}', 2, "Q: unknown key of a state (t, q, qd, states, inputs, parameters); the nearest is q"),
    "key twice": ('{"q": [1, 2],\n"q": [1, 3]}', 2, "state: duplicate object key near '\"q\"'; must be one JSON object of finite numbers"),
    "input twice": ('{"inputs": {"push": 1,\n"push": 2}}', 2, "state: duplicate object key near '\"push\"'; must be one JSON object of finite numbers"),
    "unknown input": ('{"inputs":\n{"pusch": 1}}', 2, "pusch: unknown input; the nearest is push"),
    "unknown parameter": ('{"parameters": {"m": 1,\n"t2": 1}}', 2, "t2: unknown parameter; the nearest is t1"),
    "too short": ('{\n"q": [1]}', 2, "q: has 1 values; must have 2, one for each coordinate from arm_z to arm_psi"),
    "too long": ('{"q": [1, 2],\n"qd": [1, 2, 3]}', 2, "qd: has 3 values; must have 2, one for each coordinate from arm_z to arm_psi; "
                 "numbers are written with a point"),
    "by name": ('{"q": {"arm_z": 1}}', 1, "q: an object; must be an array of 2 numbers"),
    "a text in an array": ('{"q": [0,\n"1"]}', 2, "q[1] (arm_psi): a text; must be a number"),
    "an array in an array": ('{"q": [0,\n[1]]}', 2, "q[1] (arm_psi): an array; must be a number"),
    "null": ('{"t": null}', 1, "t: null; must be a number"),
    "a number for inputs": ('{\n\n"inputs": 1}', 3, "inputs: a number; must be an object of numbers"),
    "a number beyond numbers": ('{"t":\n1e400}', 2, "state: real number overflow near '1e400'; must be one JSON object of finite numbers"),
    "a number without end": ('{"q": [1,\nInfinity]}', 2, "state: invalid token near 'Infinity'; must be one JSON object of finite numbers"),
    "no number": ('{"q": [1, NaN]}', 1, "state: invalid token near 'NaN'; must be one JSON object of finite numbers"),
    "a number in hexadecimal": ('{"t": 0x1}', 1, "state: '}' expected near 'x'; must be one JSON object of finite numbers"),
    "more behind": ('{"t": 0}\n{"t": 1}', 2, "state: end of file expected near '{'; must be one JSON object of finite numbers"),
    "more behind a zero byte": ('{"t": 0}\0{"t": 1}', 0, "state: contains a byte 0; must be text"),
    "a comma behind": ('{"t": 0,\n}', 2, "state: string or '}' expected near '}'; must be one JSON object of finite numbers"),
    "cut off": ('{"t": 0,\n"q": [1', 2, "state: ']' expected near end of file; must be one JSON object of finite numbers"),
    "empty": ("", 1, "state: '[' or '{' expected near end of file; must be one JSON object of finite numbers"),
    "an array": ("[0]", 1, "state: an array; must be an object"),
}


@pytest.mark.parametrize("which", STATES)
def test_wrong_state(which, model, tmp_path):
    text, line, fact = STATES[which]
    state = tmp_path / "state.json"
    state.write_text(text)
    for command in (["eval", "--state"], ["sim", "--until", "1", "--from"], ["modes", "--at"]):
        done = refdyn(command[0], model, *command[1:], state, status=1)
        place = f"{state}:{line}" if line else state
        own = fact.replace("qd, states", "qd, qdd, states") if command[0] == "eval" else fact
        assert done.stderr == f"{place}: {own}\n" and done.stdout == ""


def test_accelerations_of_a_state(model, tmp_path):
    """Only `eval` reads them."""
    state = tmp_path / "state.json"
    for text, fact in ("[1, 2]", None), ("[1]", "qdd: has 1 values; must have 2, one for each coordinate from arm_z to arm_psi"), (
            "[1, null]", "qdd[1] (arm_psi): null; must be a number"):
        state.write_text(f'{{"qdd": {text}}}')
        done = refdyn("eval", model, "--state", state, status=1 if fact else 0)
        assert done.stderr == (f"{state}:1: {fact}\n" if fact else "")
        for command in (["sim", "--until", "1", "--from"], ["modes", "--at"]):
            done = refdyn(command[0], model, *command[1:], state, status=1)
            assert done.stderr == f"{state}:1: qdd: unknown key of a state (t, q, qd, states, inputs, parameters); the nearest is qd\n"


def test_a_state_of_impossible_values(model, tmp_path):
    """Relations between values are checked at the values of the state."""
    state = tmp_path / "state.json"
    facts = {"t1": (-1, "rd.ramp: from 0 to -1; the range must ascend"), "m": (0, "links[1].mass: value 0; must be positive")}
    for name, (value, fact) in facts.items():
        state.write_text(json.dumps({"parameters": {name: value}}))
        assert re.fullmatch(rf"{re.escape(str(model))}:\d+: {re.escape(fact)}\n", refdyn("eval", model, "--state", state, status=1).stderr)


def test_rates_of_a_state_for_modes(model, tmp_path):
    """Small motions start from rest."""
    state = tmp_path / "state.json"
    for qd, warning in ([0, 0.5], f"{state}: warning: qd: modes are small motions about rest; all rates are set to 0\n"), ([0, 0], ""):
        state.write_text(json.dumps({"q": [-0.2, 0], "qd": qd}))
        errors = refdyn("modes", model, "--at", state).stderr
        assert "".join(line for line in errors.splitlines(True) if "qd" in line) == warning


def test_columns_of_sampled_inputs(model, tmp_path):
    """Other columns are ignored, so that the CSV of a motion is accepted; a name close to an input causes a message."""
    samples = tmp_path / "samples.csv"
    warning = f"{samples}:1: warning: inputs: column pusch is ignored; the nearest input is push\n"
    for text, expected in {"t,pusch,turn\n0,1,2\n": warning, "t,pusch,push,turn\n0,1,2,3\n": "", "t,energy,turn\n0,1,2\n": ""}.items():
        samples.write_text(text)
        done = refdyn("sim", model, "--until", "0.1", "--inputs", samples, "-o", tmp_path / "run.csv")
        assert "".join(line for line in done.stderr.splitlines(True) if "samples.csv" in line) == expected
    for number in ("0x1", "inf", "nan", "1e400", "", "1 N", "1;2"):
        samples.write_text(f"t,push\n0,1\n1,{number}\n")
        done = refdyn("sim", model, "--until", "0.1", "--inputs", samples, "-o", tmp_path / "run.csv", status=1)
        fact = f"'{number}' is not a finite number" if number else "the field is empty; must be a finite number"
        assert done.stderr == f"{samples}:3: inputs: push: {fact}{UNIT if number == '1 N' else ''}\n"


def test_a_file_beside_the_model_gives_one_value(tmp_path):
    (tmp_path / "parts.lua").write_text('return { "a", joint = "z", mass = 1, spring = { z = 1 } }, { mass = 2 }\n')
    (tmp_path / "model.lua").write_text('local rd = require "refdyn"\nlocal part = require "parts"\n'
                                        'return rd.model { name = "two", links = { part } }\n')
    done = refdyn("check", tmp_path / "model.lua", status=1)
    assert done.stderr == f'{tmp_path}/model.lua:2: require: "parts" returns two values; must return one\n'


def test_files_of_another_model_are_not_written_over(tmp_path):
    """Part 2 of the model `arm` has the file name of the model `arm_2`."""
    model, out = tmp_path / "model.lua", tmp_path / "out"
    model.write_text(MODEL.replace('"input"', 'rd.option("name", "arm")'))
    refdyn("gen", model, "-o", out)
    part = (out / "arm.c").read_text().replace("arm, part 1", "arm, part 2")
    (out / "arm_2.c").write_text(part)
    done = refdyn("gen", model, "--set", "name=arm_2", "-o", out, status=1)
    assert done.stderr == f"{out}/arm_2.c: belongs to another model; choose another folder\n"
    assert sorted(path.name for path in out.iterdir()) == ["arm.c", "arm.h", "arm_2.c"] and (out / "arm_2.c").read_text() == part
    refdyn("gen", model, "--set", "name=arm_2", "-o", tmp_path / "other")
    refdyn("gen", model, "--set", "name=arm_2", "-o", tmp_path / "other")


def test_segments_beside_a_value_of_their_beam(tmp_path):
    """A value that each segment sets replaces the beam's value."""
    (tmp_path / "model.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "hidden", gravity = { 0, 0, -9.81 }, links = { { "rod", joint = "theta", beam = {
  section = rd.round(0.01), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4,
  segments = { { length = 1, rfe = 2 }, { length = 1, rfe = 3, rho = 2700 } } } } } }
""")
    assert refdyn("check", tmp_path / "model.lua").stderr == (
        f"{tmp_path}/model.lua:3: warning: links[1].beam.rfe: has no effect, since each segment has its own\n")


def test_turns_that_elements_do_not_have(tmp_path):
    (tmp_path / "model.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "plane", gravity = { 0, 0, -9.81 }, links = { { "rod", joint = "theta", beam = {
  section = rd.round(0.01), E = 2.1e11, nu = 0.3, rho = 7800, dofs = "theta",
  damping = { psi = 0, theta = 1, phi = 1 }, curvature = { theta = 0.1 },
  segments = { { length = 1, rfe = 2 },
               { length = 1, rfe = 3,
                 curvature = { psi = 0.2 } } } } } } }
""")
    told = "has no effect, since the elements do not turn by {0} (dofs)"
    assert refdyn("check", tmp_path / "model.lua").stderr.splitlines() == [
        f"{tmp_path}/model.lua:4: warning: links[1].beam.damping.phi: " + told.format("phi"),
        f"{tmp_path}/model.lua:7: warning: links[1].beam.segments[2].curvature.psi: " + told.format("psi")]


@pytest.mark.parametrize("path", all_models() + models_of_tests(), ids=lambda path: path.stem)
def test_good_models_are_taken(path):
    refdyn("check", path)


# ---- Texts of users in messages ----

ESCAPE = "\x1b[31m\a"
WITH_ESCAPES = [["check", f"x{ESCAPE}.lua"], [f"comm{ESCAPE}"], ["check", "MODEL", f"{ESCAPE}"], ["check", "MODEL", f"--opt{ESCAPE}"],
                ["check", "MODEL", "--set", f"m{ESCAPE}=1"], ["check", "MODEL", "--set", f"m=1{ESCAPE}"], ["sim", "MODEL", "--until", f"1{ESCAPE}"],
                ["sim", "MODEL", "--until", "1", "--method", f"rk4{ESCAPE}"], ["sim", "MODEL", "--until", "1", "--stop", f"a{ESCAPE}<1"],
                ["sim", "MODEL", "--until", "1", "--inputs", f"a{ESCAPE}.csv"], ["sim", "MODEL", "--until", "1", "--derivatives", f"a{ESCAPE}"],
                ["sim", "MODEL", "--until", "1", "-o", f"none{ESCAPE}/a.csv"], ["fit", "MODEL", "d.csv", "--vary", f"m{ESCAPE}", "--noise", "arm_z=1", "-o", "f.json"],
                ["fit", "MODEL", "d.csv", "--vary", "m", "--noise", f"arm{ESCAPE}=1", "-o", "f.json"], ["statics", "MODEL", "--hold", f"a{ESCAPE}"],
                ["gen", "MODEL", "--emit", f"M{ESCAPE}", "-o", "out"], ["report", "MODEL", "--until", "1", "--methods", f"rk{ESCAPE}", "-o", "out"]]


@pytest.mark.parametrize("arguments", WITH_ESCAPES, ids=repr)
def test_messages_have_no_control_characters(arguments, model, tmp_path):
    (tmp_path / "d.csv").write_text("t,arm_z\n0,0\n0.1,0.1\n")
    done = refdyn(*(str(model) if word == "MODEL" else word for word in arguments), status=None, cwd=tmp_path)
    assert done.returncode in (1, 2) and not re.search(r"[\x00-\x09\x0b-\x1f]", done.stderr), done.stderr
    assert r"\x1b[31m\x07" in done.stderr.lower()


MANY = {
    "vary": "local v = {{}} for i = 1, {count} do v['no_' .. i] = {{ 1 }} end return rd.sweep {{ vary = v, t_end = 0.1 }}",
    "derive": "return rd.sweep {{ vary = {{ m = {{ 1 }} }}, t_end = 0.1, derive = function(c) local v = {{}} for i = 1, {count} do v['no_' .. i] = 1 end return v end }}",
    "table": "return rd.sweep {{ table = 'table.csv', t_end = 0.1 }}",
    "plan": "local v = {{}} for i = 1, {count} do v['no_' .. i] = rd.within(1, 2) end return rd.plan {{ vary = v, t_end = 1, minimise = 'm' }}",
}


@pytest.mark.parametrize("count", [1000, 30000])
@pytest.mark.parametrize("kind", MANY)
def test_many_unknown_names(kind, count, model, tmp_path):
    """Some of them and their number; a table in Lua has at most 10,000 entries for a plan."""
    (tmp_path / "many.lua").write_text("local rd = require 'refdyn'\n" + MANY[kind].format(count=count))
    (tmp_path / "table.csv").write_text(",".join(f"no_{i}" for i in range(count)) + "\n" + ",".join(["1"] * count) + "\n")
    command = ["plan", model, "many.lua", "-o", "out.json"] if kind == "plan" else ["batch", model, "many.lua", "-o", "out.csv"]
    said = refdyn(*command, status=1, cwd=tmp_path, timeout=20).stderr
    if kind == "plan" and count > 10000:
        assert said == "many.lua:2: more than 10000 entries in a table\n"
        return
    lines = said.splitlines()
    file = "table.csv:1" if kind == "table" else "many.lua:2"
    assert len(lines) <= 12 and "no_1" in said and all(line.startswith(file) or line.startswith("many.lua") for line in lines), said
    assert re.fullmatch(rf"{file}: {count - 10} more names are unknown", lines[-1]), said


def test_many_unused_columns_of_data(model, tmp_path):
    columns = ",".join(f"no_{i}" for i in range(1000))
    (tmp_path / "d.csv").write_text(f"t,arm_z,{columns}\n" + "".join(f"{0.1 * i},{0.01 * i * i}" + ",0" * 1000 + "\n" for i in range(9)))
    said = refdyn("fit", model, "d.csv", "--vary", "m", "--noise", "arm_z=1", "-o", "f.json", cwd=tmp_path, status=None).stderr
    assert "d.csv:1: warning: data: 1000 columns are no columns of the motion and are not used" in said and said.count("no_") == 5
