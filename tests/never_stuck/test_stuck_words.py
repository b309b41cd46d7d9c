"""Mistakes of beginners: each has one clear message with its place, the fact, and what to write instead."""
import pytest

from program import refdyn

ARM = '{ "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 }, inertia = { zz = 0.1 } }'
CART = '{ "cart", joint = "x, y", mass = 1, spring = { x = 1 } }'
BEAM = '{ "arm", joint = "psi", beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } }'


def model(lead="", links=ARM, rest="", gravity="{ 0, -9.81, 0 }"):
    """Line 2 is `lead`, line 4 has the links, line 5 the remaining fields."""
    return (f'local rd = require "refdyn"\n{lead}\nreturn rd.model {{ name = "newcomer", gravity = {gravity},\n'
            f'  links = {{ {links} }},\n  {rest}\n}}\n')


def said(tmp_path, text, *arguments, status=1, command="check"):
    """Lines of stderr, from the file's name on."""
    path = tmp_path / "m.lua"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    done = refdyn(command, path, *arguments, status=status)
    return [line.replace(f"{tmp_path}/", "") for line in done.stderr.splitlines()]


# ---- characters ----

CHARACTERS = {
    "“": ("U+201C (a typographic quotation mark)", '"'), "’": ("U+2019 (a typographic quotation mark)", "'"),
    "−": ("U+2212 (a typographic dash or minus sign)", "-"), "–": ("U+2013 (a typographic dash or minus sign)", "-"),
    "\u00a0": ("U+00A0 (a typographic blank)", "a plain blank"), "\u3000": ("U+3000 (a typographic blank)", "a plain blank"),
    "\u200b": ("U+200B (a character without width)", "nothing in its place"),
    "\ufeff": ("U+FEFF (a character without width)", "nothing in its place"),
    "，": ("U+FF0C (a full-width character)", ","), "９": ("U+FF19 (a full-width character)", "9"),
    "×": ("U+00D7 (a multiplication sign)", "*"), "²": ("U+00B2 (a typographic exponent)", "a power such as x^2"),
    "π": ("U+03C0 (the letter pi)", "rd.pi"), "α": ("U+03B1 (a Greek letter)", "its name in the letters a to z"),
    "і": ("U+0456 (a Cyrillic letter)", "one of the letters a to z"), "≤": ("U+2264 (an inequality sign)", "<="),
    "°": ("U+00B0 (a degree sign)", "rd.pi / 180 times the angle"), "é": ("U+00E9 (a character beyond ASCII)", "letters a to z, digits and _"),
    "\u202e": ("U+202E (a character that turns the direction of reading)", "nothing in its place"),
}


@pytest.mark.parametrize("character", CHARACTERS, ids=[f"{ord(character):04X}" for character in CHARACTERS])
def test_characters_that_look_like_ascii(tmp_path, character):
    fact, instead = CHARACTERS[character]
    assert said(tmp_path, model(f"local a = 1{character}2 -- {character} in a comment\nlocal b = '{character if character != '’' else ''}'"
                                if character != "\u202e" else f"local a = 1{character}")) == [f"m.lua:2: {fact} outside a text; write {instead}"]


def test_one_message_a_line_and_texts_that_a_typographic_mark_was_to_end(tmp_path):
    assert said(tmp_path, model("local a, b = “x”, “y”\nlocal c = −1")) == [
        'm.lua:2: U+201C (a typographic quotation mark) outside a text; write "',
        "m.lua:3: U+2212 (a typographic dash or minus sign) outside a text; write -"]
    assert said(tmp_path, model('local a = "x”')) == ['m.lua:2: U+201D (a typographic quotation mark) outside a text; write "']
    assert said(tmp_path, model().encode() + "-- ä\n".encode("latin-1"), status=0) == []
    assert said(tmp_path, model("local ä = 1").encode("latin-1")) == ["m.lua:2: byte 228 (not UTF-8) outside a text; save the file as UTF-8"]
    assert said(tmp_path, model(links=ARM.replace('"arm"', '"arm\u00a0"'))) == [
        'm.lua:4: link "arm\u00a0": not an identifier of C (contains U+00A0 (a typographic blank)); use a letter, then letters, digits and _']


FORMATS = {"utf-16": "it is in UTF-16; save it as UTF-8", "utf-16-le": "it is in UTF-16; save it as UTF-8",
           "utf-16-be": "it is in UTF-16; save it as UTF-8", "utf-32": "it is in UTF-32; save it as UTF-8"}


def test_files_that_are_no_utf8(tmp_path):
    for encoding, message in FORMATS.items():
        assert said(tmp_path, model().encode(encoding)) == [f"m.lua: cannot be read: {message}"]
    assert said(tmp_path, b"\x1f\x8b\x08\0x") == ["m.lua: cannot be read: it is compressed; unpack it with gunzip"]
    assert said(tmp_path, b"PK\3\4\0") == ["m.lua: cannot be read: it is an archive; unpack it with unzip"]
    assert said(tmp_path, model().encode("utf-8-sig"), status=0) == []


# ---- calls of the module ----

CALLS = {
    "rd:parameters{}": "rd:parameters: the colon passes rd as first argument; write rd.parameters",
    "rd:sin(1)": "rd:sin: the colon passes rd as first argument; write rd.sin",
    "rd:tube(2, 1)": "rd:tube: the colon passes rd as first argument; write rd.tube",
    "rd:box{}": "rd:box: the colon passes rd as first argument; write rd.box",
    "rd:position{}": "rd:position: the colon passes rd as first argument; write rd.position",
    "math:sin(1)": "math:sin: the colon passes math as first argument; write math.sin",
    "table:concat({})": "table:concat: the colon passes table as first argument; write table.concat",
    'rd.parameters("m", 1)': 'rd.parameters: 2 arguments; must have at most 1, as in rd.parameters { { "m", 0.5, "kg" } }',
    'rd.parameters("m")': 'rd.parameters: argument 1 is a text; must be a list of { "name", value, "unit" }, as in '
                          'rd.parameters { { "m", 0.5, "kg" } }',
    'rd.parameter{ "m", 1 }': 'rd.parameter: argument 1 is a table; must be a text, as in rd.parameter("m", 0.5, "kg")',
    'rd.input{ "tau" }': 'rd.input: argument 1 is a table; must be a text, as in rd.input("tau", 0, "N m")',
    'rd.option{ "n", 4 }': 'rd.option: argument 1 is a table; must be a text, as in rd.option("n_rfe", 4)',
    "rd.ramp{ 1, 2, 3 }": "rd.ramp: argument 1 is a table; must be a number or an expression, as in rd.ramp(t, t0, t1)",
    "rd.min(1, 2, 3)": "rd.min: 3 arguments; must have 2, as in rd.min(a, b)",
    "rd.where(1)": "rd.where: 1 argument; must have 3, as in rd.where(a, b, c)",
    "rd.spline({ 0, 1 }, { 0, 1 })": "rd.spline: 2 arguments; must have at most 1, as in rd.spline { { 0, 0 }, { 1, 2 } }",
    "rd.round{ 0.01 }": "rd.round: argument 1 is a table; must be a number or an expression, as in rd.round(diameter)",
    "rd.box(1, 1, 1)": "rd.box: argument 1 is a number; must be a table, as in rd.box { { 1, 1, 1 }, mass = 1 }",
    "rd.position(1)": "rd.position: argument 1 is a number; must be a table, as in rd.position { expression }",
    'rd.loop("a", "b")': 'rd.loop: argument 1 is a text; must be a table, as in rd.loop { "a", "b" }',
    "rd.model()": 'rd.model: argument 1 is nothing; must be a table, as in rd.model { name = "arm", links = { ... } }',
    "sin(1)": 'undefined global "sin"; write rd.sin',
    "loop { 1 }": 'undefined global "loop"; write rd.loop',
    "pi": 'undefined global "pi"; write rd.pi',
    "rad(90)": 'undefined global "rad"; write math.rad',
    "True": 'undefined global "True"; write true',
    "None": 'undefined global "None"; write nil',
    "t": 'undefined global "t"; write s.t, a field of the state s',
    "s.t": 'undefined global "s"; write function(s), since s is the argument of a model\'s functions',
    "require(refdyn)": 'undefined global "refdyn"; write "refdyn" in quotation marks',
    "rd.sweep {}": "rd.sweep: belongs to sweep files; run them by refdyn batch MODEL.lua SWEEP.lua",
}


@pytest.mark.parametrize("call", CALLS)
def test_calls(tmp_path, call):
    assert said(tmp_path, model(f"local a = {call}")) == [f"m.lua:2: {CALLS[call]}"]


def test_brackets_of_the_model(tmp_path):
    many = "<eof> expected near '}'; a file ends with its return: a bracket or an end before this place may be one too many"
    assert said(tmp_path, model() + "}") == [f"m.lua:7: {many}"]


def test_values_that_are_not_finite(tmp_path):
    lines = said(tmp_path, model(rest="forces = function(s) return { arm_psi = 1 / s.t } end,"), "--until", "1", status=3, command="sim")
    assert lines[-1] == ("refdyn: such a value comes from a division by 0, the root or logarithm of a negative number, or an overflow; "
                         "bound the argument, as in rd.max(x, 1e-9)")


def test_the_model_itself(tmp_path):
    assert said(tmp_path, model().replace("rd.model", "rd:model")) == ["m.lua:3: rd:model: the colon passes rd as first argument; write rd.model"]
    assert said(tmp_path, "\n" + model().split("\n", 1)[1]) == ['m.lua:3: undefined global "rd"; write local rd = require "refdyn" before it']
    assert said(tmp_path, model().replace('"refdyn"', '"Refdyn"')) == [
        'm.lua:1: require: Refdyn.lua in the folder of the model cannot be read: No such file or directory; did you mean "refdyn"?']
    assert said(tmp_path, model().replace("rd.model {", "rd.model( ")) == [
        "m.lua:3: ')' expected near '='; write names and their values in braces, rd.model { name = \"arm\" }"]


# ---- other languages ----

SYNTAX = {
    "if 1 != 2 then end": "'then' expected near '!'; write a ~= b to compare, not a to negate",
    "if a = 2 then end": "'then' expected near '='; write == to compare",
    "if 1 && 2 then end": "unexpected symbol near '&'; write and",
    "if 1 || 2 then end": "unexpected symbol near '|'; write or",
    "local a = 2**3": "unexpected symbol near '*'; write a power as a^b, and -- before a comment",
    "# a comment": "unexpected symbol near '#'; write -- before a comment",
    "local a = [1, 2]": "unexpected symbol near '['; write a list in braces, { 1, 2 }",
    "local a = b ? 1 : 2": "unexpected symbol near '?'; use rd.where(c, x, y) to choose during the motion",
    "a += 1": "syntax error near '+'; write a = a + b",
    "import refdyn": "syntax error near 'refdyn'; write a statement as local a = 1, a = 1 or a call",
    "local a = { mass: 1 }": "<name> expected near '1'; a name begins with a letter; write = to set a field: { mass = 1 }",
    "local a = 45m": "malformed number near '45m'; leave out units, and write * to multiply",
    "local a = { x = 1 y = 2 }": "'}' expected near 'y'; a comma or a quotation mark may be missing before it",
    'local a = { "x, joint = "psi" }': "'}' expected near 'psi'; a comma or a quotation mark may be missing before it",
    "local a = { x = 1 )": "'}' expected near ')'; it closes no '('",
    "local a = { x = (1 }": "')' expected near '}'; a '(' before it lacks its end",
    "local a = { f = function() return 1 }": "'end' expected near '}'; a function before it lacks its end",
    "local a = { f = function() return 1, }": "unexpected symbol near '}'; a value, or the end of a function, may be missing before it",
    "local f = function() return a = 1 end": "'end' expected near '='; write names and their values in braces, return { arm_psi = 1 }",
    "local a = { s.x = 0 }": "'}' expected near '='; write a name and its value as { name = value }, and a row as the expression that must be zero",
    "for i = 1, 3 { }": "'do' expected near '{'; write a loop as for i = 1, 3 do ... end",
    'local a = "a" + "b"': "attempt to add a 'string' with a 'string'; write .. to join texts",
}


@pytest.mark.parametrize("line", SYNTAX)
def test_words_of_other_languages(tmp_path, line):
    assert said(tmp_path, model(line)) == [f"m.lua:2: {SYNTAX[line]}"]


def test_decimal_commas(tmp_path):
    assert said(tmp_path, model("local a = 1,5"), status=0) == [
        "m.lua:2: warning: 1,5: two values for one name; write the number with a point, 1.5"]
    assert said(tmp_path, model(gravity="{ 0, 0, -9,81 }")) == ["m.lua:3: gravity: 4 numbers; must have 3, with decimal points"]


# ---- rows without a slope ----

POWER = "its residual is a power, which has no slope at 0 and so constrains nothing; write its base"
BELOW = ("its residual is never below 0, so that it has no slope at 0 and constrains nothing; "
         "write a row for each term, without squares, abs or less")
ABOVE = BELOW.replace("below", "above")
ROWS = {
    "rd.position { s.q.cart_x^2 }": POWER, "rd.position { -3 * (s.q.cart_x - s.q.cart_y)^2 }": POWER,
    "rd.position { (s.q.cart_x - s.t)^3 }": POWER, "rd.velocity { s.qd.cart_x^4 }": POWER,
    "rd.position { s.q.cart_x^2 + s.q.cart_y^2 }": BELOW, "rd.position { rd.abs(s.q.cart_x) }": BELOW,
    "rd.position { rd.sqrt(s.q.cart_x^2 + s.q.cart_y^2) }": BELOW, "rd.position { rd.cos(s.q.arm_psi) - 1 }": ABOVE,
    "rd.position { s.points.E.x^2 + s.points.E.y^2 }": BELOW, "rd.position { rd.max(0, s.q.cart_x) }": BELOW,
    "rd.position { rd.less(s.q.cart_x, 1) }": BELOW, "rd.velocity { -rd.abs(s.qd.cart_x) - s.qd.cart_y^2 }": ABOVE,
    "rd.position { s.q.cart_x^2 + 0.5 }": "its residual is at least 0.5 and never 0; subtract the intended value",
    # these have a slope, or may have one
    "rd.position { s.q.cart_x^2 - 1 }": None, "rd.position { s.q.cart_x - rd.abs(s.q.cart_y) }": None,
    "rd.position { rd.sqrt(s.points.E.x^2 + s.points.E.y^2) - 1 }": None, "rd.velocity { s.qd.cart_x * s.qd.cart_y - 1 }": None,
    "rd.position { rd.exp(s.q.cart_x) - 1 }": None, "rd.position { s.q.cart_x^2 * s.q.cart_y }": None,
}


@pytest.mark.parametrize("row", ROWS)
def test_rows_without_a_slope(tmp_path, row):
    rest = 'points = { E = { on = "cart", at = { 1, 0, 0 } } }, constraints = function(s) return { %s } end,' % row
    expected = [f"m.lua:5: warning: constraints[1]: {ROWS[row]}"] if ROWS[row] else []
    assert said(tmp_path, model(links=f"{ARM}, {CART}", rest=rest), status=0) == expected


def test_a_row_that_has_no_slope_at_the_start(tmp_path):
    """Only the state shows it."""
    text = model(links=f"{ARM}, {CART}", rest="constraints = function(s) return { rd.position { s.q.cart_x * s.q.cart_y } } end,", gravity="{ 0, 0, 0 }")
    lines = said(tmp_path, text, "--until", "0.1", status=None, command="sim")
    assert ("refdyn: warning: row 1 has no slope there: no coordinate changes its residual; write what is to be 0 without powers, "
            "products or abs") in lines


# ---- values that are probably wrong ----

def test_springs_and_friction(tmp_path):
    for joint, unit in ("psi", "N m"), ("x", "N/m"):
        link = f'{{ "arm", joint = "{joint}", mass = 1, inertia = {{ zz = 1 }}, spring = {{ {joint} = -5 }} }}'
        assert said(tmp_path, model(links=link), status=0) == [
            f"m.lua:4: warning: link arm: spring: {joint} = -5 {unit} pushes away from its rest; to pull back write 5 {unit}"]
    turn = ARM[:-2] + ", spring = { psi = 5 }, rest = { psi = 90 } }"
    assert said(tmp_path, model(links=turn), status=0) == [
        "m.lua:4: warning: link arm: rest: psi = 90 rad; if it is in degrees, multiply by rd.pi / 180"]
    rest = "forces = function(s) return { arm_psi = rd.friction(%s, 0.01) } end,"
    assert said(tmp_path, model(rest=rest % "-2, s.qd.arm_psi"), status=0) == [
        "m.lua:5: warning: rd.friction: argument 1 is -2 and drives the motion; to brake it write 2"]
    assert said(tmp_path, model(rest=rest % "2, s.q.arm_psi"), status=0) == [
        "m.lua:5: warning: rd.friction: argument 2 depends on no rate; must be a rate such as s.qd.arm_psi"]
    assert said(tmp_path, model(rest=rest % "2, s.qd.arm_psi"), status=0) == []


ROOT = 'forces[1]: acts at the root of the beam "arm"; for its end write "arm.tip"'
WALL = '{ on = "ground", at = { 1, 1, 0 } }'
LOADS = {
    'rd.force { "arm", { 0, -5, 0 } }': ROOT, 'rd.force { { on = "arm" }, { 0, -5, 0 } }': ROOT, 'rd.force { "E", { 0, -5, 0 } }': ROOT,
    f'rd.actuator {{ "arm", {WALL}, 5 }}': ROOT, f'rd.damper {{ "arm", {WALL}, damping = 5 }}': ROOT, f'rd.spring {{ {WALL}, "arm", stiffness = 5 }}': ROOT,
    'rd.force { "arm.tip", { 0, -5, 0 } }': None, 'rd.force { { on = "arm", along = 0.5 }, { 0, -5, 0 } }': None,
    'rd.torque { "arm", { 0, 0, 5 } }': None,
}


@pytest.mark.parametrize("load", LOADS)
def test_loads_at_the_root_of_a_beam(tmp_path, load):
    rest = 'points = { E = "arm" }, forces = function(s) return { %s } end,' % load
    assert said(tmp_path, model(links=BEAM, rest=rest), status=0) == ([f"m.lua:5: warning: {LOADS[load]}"] if LOADS[load] else [])


def test_places_that_do_not_move(tmp_path):
    rest = 'forces = function(s) return { rd.force { "arm", { 0, -5, 0 } } } end,'
    assert said(tmp_path, model(rest=rest), status=0) == [
        'm.lua:5: warning: forces[1]: acts at the origin of "arm", which does not move; for another place write { on = "arm", at = { x, y, z } }']
    assert said(tmp_path, model(links=ARM.replace('"psi"', '"x, psi"'), rest=rest), status=0) == []
    hand = '{ "hand", on = "arm", joint = "psi", mass = 1, center = { 0.1, 0, 0 } }'
    assert said(tmp_path, model(links=f"{BEAM}, {hand}"), status=0) == [
        'm.lua:4: warning: link hand: on: "arm" is the root of the beam; for its end write "arm.tip"']
    assert said(tmp_path, model(links=f"{BEAM}, {hand.replace('on = ', 'along = 0.2, on = ')}"), status=0) == []


NOT_IN_IT = "m.lua:4: warning: coordinate arm_psi: limits.force compares only the programme force with 3, without %s"
DRIVES = {
    "arm_psi = 5 * s.inputs.tau": "input tau", "arm_psi = s.inputs.tau + s.inputs.push": "inputs tau, push",
    "arm_psi = 5 * rd.sin(s.t)": "forces.arm_psi", 'rd.torque { "arm", { 0, s.inputs.tau, s.inputs.tau } }': "input tau",
    "arm_psi = rd.max(-3, rd.min(3, s.inputs.tau))": None, "arm_psi = -5 * s.qd.arm_psi": None,
}


@pytest.mark.parametrize("force", DRIVES)
def test_limits_of_force_and_what_is_not_in_them(tmp_path, force):
    inputs = " ".join(f'rd.input("{name}", 1)' for name in ("tau", "push") if f"inputs.{name}" in force)
    text = model(inputs, ARM[:-2] + ", limits = { psi = { force = 3 } } }", "forces = function(s) return { %s } end," % force)
    assert said(tmp_path, text, status=0) == ([NOT_IN_IT % DRIVES[force]] if DRIVES[force] else [])


def test_a_limit_of_force_that_is_left(tmp_path):
    rest = 'constraints = function(s) return { rd.drive { "arm_psi", s.t^3 } } end, forces = function(s) return { arm_psi = s.inputs.tau } end,'
    lines = said(tmp_path, model('rd.input("tau", 0, "N m")', ARM[:-2] + ", limits = { psi = { force = 3 } } }", rest), "--until", "0.5", status=0, command="sim")
    assert NOT_IN_IT % "input tau" in lines
    assert any(line.startswith("refdyn: warning: force_arm_psi exceeds its limits: programme force ") for line in lines)


# ---- states, tables, the command line ----

STATES = {
    '{"q": [−0.5]}': "state: invalid token near '−'; must be one JSON object of finite numbers; it has U+2212 (a typographic dash or minus sign); write -",
    '{“q”: [0]}': "state: string or '}' expected near '“'; must be one JSON object of finite numbers; it has U+201C (a typographic quotation mark); write \"",
    '{"q": [0,5]}': "q: has 2 values; must have 1, one for each coordinate from arm_psi to arm_psi; numbers are written with a point",
    '{"arm_psi": 1}': "arm_psi: not a key of a state; it belongs in the array q, in the order of the coordinates",
    '{"tau": 1}': "tau: not a key of a state; it belongs in the object inputs",
    '{"k": 1}': "k: not a key of a state; it belongs in the object parameters",
}
LEAD = 'local p = rd.parameters { { "k", 1, "N m" } } rd.input("tau")'
READ = "forces = function(s) return { arm_psi = s.inputs.tau } end,"


def test_states(tmp_path):
    state = tmp_path / "state.json"
    for text, message in STATES.items():
        state.write_text(text)
        assert said(tmp_path, model(LEAD, rest=READ), "--state", state, command="eval") == [f"state.json:1: {message}"]
    state.write_bytes('{"q": [0]}'.encode("utf-16"))
    assert said(tmp_path, model(LEAD, rest=READ), "--state", state, command="eval") == ["state.json: state: it is in UTF-16; must be text in UTF-8"]
    state.write_bytes('{"q": [0]}'.encode("utf-8-sig"))
    said(tmp_path, model(LEAD, rest=READ), "--state", state, command="eval", status=0)


SEPARATORS = "write commas between columns, points in numbers, \\n after lines"
TABLES = {
    "k;tau\n1,5;2\n": f"1: cases: semicolons separate the columns; {SEPARATORS}", "k\ttau\n1\t2\n": f"1: cases: tabs separate the columns; {SEPARATORS}",
    "k\r1\r2\r": f"1: cases: lines end with \\r; {SEPARATORS}", '"k"\n1\n': "1: cases: the names are in quotation marks; remove them, also from numbers",
    "k\n1,5\n": "2: cases: 2 fields under 1 names; numbers are written with a point",
    "k\n−1\n": "2: cases: k: '−1' is not a finite number; it contains U+2212 (a typographic dash or minus sign): write -",
    "k\n1 N m\n": "2: cases: k: '1 N m' is not a finite number; write the number alone, in SI units and radians",
    "k [N m]\n1\n": "1: k [N m]: unknown name; use a parameter, an input, an option, a coordinate, its rate NAME_d or inputs, without a unit",
    "k\n1\n".encode("utf-16"): "1: cases: it is in UTF-16; must be text in UTF-8",
    b"PK\3\4\0\0": "1: cases: it is a workbook or an archive; must be text",
}


def test_tables(tmp_path):
    table = tmp_path / "c.csv"
    for text, message in TABLES.items():
        table.write_bytes(text if isinstance(text, bytes) else text.encode())
        assert said(tmp_path, model(LEAD, rest=READ), "--table", table, "--until", "1", "-o", tmp_path / "r.csv", command="batch") == [f"c.csv:{message}"]


def test_sweeps(tmp_path):
    sweep = tmp_path / "s.lua"
    for text, message in {
            "return rd:sweep {}": "rd:sweep: the colon passes rd as first argument; write rd.sweep",
            "return rd.sweep { vary = { k = rd:grid(1, 2, 3) } }": "rd:grid: the colon passes rd as first argument; write rd.grid",
            'return rd.sweep("k", 1)': "rd.sweep: argument 1 is a text; must be a table, as in rd.sweep { vary = { m = rd.grid(1, 3, 5) }, t_end = 10 }",
            "return rd.sweep { vary = { k = 1 }, tend = 1 }": 'tend: unknown field; did you mean "t_end"?',
            "return rd.sweep { vary = { k = 'a\\1' }, t_end = 1 }": 'text "a\\x01": contains control character 1; remove it',
            "return rd.sweep { vary = { T = 1 }, t_end = 1 }": "vary.T: unknown name; use a parameter, an input, an option, a coordinate, its rate NAME_d or inputs",
            "return rd.sweep { until = 1 }": "unexpected symbol near 'until'; until is a keyword, as are end, in and repeat; use another name",
            "return rd.sweep { vary = { k = { 1, −2 } } }": "U+2212 (a typographic dash or minus sign) outside a text; write -"}.items():
        sweep.write_text(f'local rd = require "refdyn"\n{text}\n')
        assert said(tmp_path, model(LEAD, rest=READ), sweep, "-o", tmp_path / "r.csv", command="batch") == [f"s.lua:2: {message}"]


LINES = {
    ("--set", "k=−3", "--until", "1"): 'm.lua:2: --set k: value "−3"; must be a number; it contains U+2212 (a typographic dash or minus sign): write -',
    ("--set", "k=0,5", "--until", "1"): 'm.lua:2: --set k: value "0,5"; must be a number; write 0.5',
    ("--set", "k=45deg", "--until", "1"): 'm.lua:2: --set k: value "45deg"; must be a number; write the number alone, in SI units and radians',
    ("--set", "k = 2", "--until", "1"): 'm.lua: --set k : unknown option, parameter or input; did you mean "k", without blanks?',
    ("--set", "arm_psi=2", "--until", "1"): "m.lua: --set arm_psi: a coordinate; set its start in the model or in a STATE.json",
    ("--set", "stiffness=2", "--until", "1"): "m.lua: --set stiffness: the model has no option, parameter or input of this name; it has k, tau",
    ("--from", "static", "--until", "1"): "static: no file has this name; must be initial, statics or a readable STATE.json; did you mean \"statics\"?",
    ("--from", "rest", "--until", "1"): "rest: no file has this name; must be initial, statics or a readable STATE.json",
    ("--set", "p.k=2", "--until", "1"): 'm.lua: --set p.k: unknown option, parameter or input; did you mean "k"?',
    ("--until", "0,5"): "refdyn sim: --until: '0,5' is not a positive number; write 0.5",
    ("--until", "10 s"): "refdyn sim: --until: '10 s' is not a positive number; write the number alone, in SI units and radians",
    ("–-until", "1"): "refdyn sim: '–-until' begins with a typographic dash; an option begins with --",
    ("—until", "1"): "refdyn sim: '—until' begins with a typographic dash; an option begins with --",
    ("-until", "1"): "refdyn sim: unknown option -until; write --until",
    ("--until", "1", "--stabilise", "Project"): "refdyn sim: --stabilise: 'Project' is not one of none, baumgarte, baumgarte-auto, project; did you mean \"project\"?",
    ("--until", "1", "--method", "RK8"): "refdyn sim: --method: 'RK8' is not one of auto, rk4, rk54, rk8, rodas5p, rodas6p, radau9, gauss12, ros34pw2, msbdf, bsimp; "
                                         'did you mean "rk8"?',
    ("--until", "1", "--singular", "pas"): "refdyn sim: --singular: 'pas' is not one of stop, pass; did you mean \"pass\"?",
    ("--until", "1", "-o", "x.svg"): "refdyn sim: -o: 'x.svg' must be a table, FILE.csv or FILE.h5; refdyn plot draws it",
    ("--until", "1", "-o", "x.xlsx"): "refdyn sim: -o: 'x.xlsx' must be a table, FILE.csv or FILE.h5",
}


@pytest.mark.parametrize("arguments", LINES, ids=" ".join)
def test_command_lines(tmp_path, arguments):
    assert said(tmp_path, model(LEAD, rest=READ), *arguments, status=None, command="sim")[0] == LINES[arguments]


def test_commands():
    for words, ending in {("simulate", "m.lua"): "; write refdyn sim", ("Check", "m.lua"): "; write refdyn check",
                          ("m.lua",): "; a command comes first: refdyn check m.lua"}.items():
        done = refdyn(*words, status=2)
        assert done.stderr.splitlines()[0].startswith(f"refdyn: unknown command '{words[0]}'; use one of gen, ")
        assert done.stderr.splitlines()[0].endswith(ending)
