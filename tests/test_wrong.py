"""The program refuses each file of wrong/ with exactly the messages that its first comments name."""
import re

import pytest

from program import LEAN, TESTS, refdyn, some

FILES = some((TESTS / "wrong").glob("*.lua"))


@pytest.mark.parametrize("path", [pytest.param(path, id=path.stem, marks=[pytest.mark.quick] * (i % 20 == 0)) for i, path in enumerate(FILES)])
def test_refused(path, tmp_path):
    comments = path.read_text().splitlines()
    expected = [comment[len("-- expect: "):] for comment in comments if comment.startswith("-- expect: ")]
    settings = [word for comment in comments if comment.startswith("-- set: ") for word in ("--set", comment[len("-- set: "):])]
    assert expected, "names no message"
    for arguments in ([] if LEAN else [["check", path]]) + [["gen", path, "-o", tmp_path / "out"]]:
        done = refdyn(*arguments, *settings, status=1)
        assert done.stdout == ""
        assert done.stderr.splitlines() == [f"{path}:{line.removeprefix('0:')}" for line in expected]
    assert not (tmp_path / "out").exists()


def test_all_kinds_are_there():
    text = "".join(path.read_text() for path in FILES)
    for what in ("unknown field", "did you mean", "must be positive", "cycle", "twice", "unit", "compar", "rd.where"):
        assert re.search(what, text), what


def check_file(tmp_path, text, name="model.lua", **keywords):
    path = tmp_path / name
    path.write_text(text)
    return path, refdyn("check", path, **keywords)


def test_a_thousand_errors(tmp_path):
    """All of them are reported at once."""
    links = "".join(f'  {{ "link_{i}", joint = "x", mass = -{i} }},\n' for i in range(1, 1001))
    path, done = check_file(
        tmp_path, f'local rd = require "refdyn"\nreturn rd.model {{ name = "wrong", links = {{\n{links}}} }}\n', status=1)
    assert done.stderr.splitlines() == [
        f"{path}:{i + 2}: links[{i}].mass: value -{i}; must be positive" for i in range(1, 1001)]


def test_no_bytecode(tmp_path):
    path, done = check_file(tmp_path, "\x1bLua of another kind\n", status=1)
    assert done.stderr.splitlines() == [f"{path}: attempt to load a binary chunk (mode is 't')"]


def test_errors_in_a_file_beside_the_model(tmp_path):
    """The place of a table and of an error is in the file that contains it."""
    (tmp_path / "parts.lua").write_text('return {\n  { "a", joint = "x", mass = -1 },\n}\n')
    _, done = check_file(
        tmp_path, 'local rd = require "refdyn"\nreturn rd.model { name = "wrong", links = require "parts" }\n', status=1)
    assert done.stderr.splitlines() == [f"{tmp_path}/parts.lua:2: links[1].mass: value -1; must be positive"]
    (tmp_path / "parts.lua").write_text("local x = nil\nreturn x.y\n")
    done = refdyn("check", tmp_path / "model.lua", status=1)
    assert done.stderr.splitlines() == [f"{tmp_path}/parts.lua:2: attempt to index a nil value (local 'x')"]


def test_doubts_do_not_refuse(tmp_path):
    path, done = check_file(tmp_path, """local rd = require "refdyn"
return rd.model { name = "doubtful", gravity = { 0, 0, -9.81 }, links = {
  { "spin", joint = "psi", mass = 1, inertia = { zz = 1 } },
  { "empty", joint = "x, phi", mass = 1 },
  { "still", joint = "theta", mass = 1, inertia = { yy = 1 }, start_rate = { theta = 1 } },
  { "floating", joint = "free", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } },
} }
""")
    assert done.stderr.splitlines() == [
        f"{path}:3: warning: coordinate spin_psi: no load acts on it: no gravity, spring, damper, force or row",
        f"{path}:4: warning: coordinate empty_x: no load acts on it: no gravity, spring, damper, force or row",
        f"{path}:4: warning: coordinate empty_phi: moves no inertia about its axis, so that only rows can determine "
        "its acceleration; add inertia or a row"]


@pytest.mark.quick
def test_inputs_that_nothing_reads(tmp_path):
    """Each place where a model may read an input counts; an event that sets one does not read it."""
    path, done = check_file(tmp_path, """local rd = require "refdyn"
local names = { "force", "load", "torque", "slope", "level", "result", "course", "first" }
local x = {}
for _, name in ipairs(names) do x[name] = rd.input(name, 1) end
local idle, set = rd.input("idle", 0), rd.input("set", 0)
local unused = 2 * idle + set
return rd.model { name = "m", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "x", mass = 1 }, { "b", joint = "y", mass = 1 } },
  forces = function(s)
    local anchored = rd.parameter("anchored", s.start.inputs.first * s.start.q.a_x, "m")
    return { a_x = x.force * anchored, rd.force { "b", { x.load, 0, 0 } }, rd.torque { "b", { 0, x.torque, 0 } } }
  end,
  constraints = function(s) return { rd.velocity { s.qd.b_y - x.slope } } end,
  events = function(s) return { rd.event { s.q.a_x - x.level, inputs = { set = x.result } } } end,
  courses = function(s) return { seen = x.course * s.t } end,
}
""")
    assert done.stderr.splitlines() == [f"{path}:5: warning: input {name}: nothing reads it" for name in ("idle", "set")]
