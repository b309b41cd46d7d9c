"""Harmful models are refused, or read, within bounds on time and memory, and leave nothing behind.

Each file of harmful/ says in its first comments what it attempts, and names the expected messages:
    -- expect: LINE: TEXT            of `check`; without such a line the model is read
    -- expect of gen: LINE: TEXT     of `gen`, if its messages differ
Files that are no text of a model, and large sources, are made here.
"""
import os
import shutil

import pytest

from harm import HARMFUL, run_harmful
from program import LEAN, LONG, MODELS, SANITIZED, refdyn, some

# These files take more than 1.2 s of CPU with sanitizers. They run in the other build, all others here; smaller models
# take the same paths. tests/long runs all of them in both builds.
SLOW = set("""breaks_many bytes chain_near courses_near energy_deep energy_many forces_memory forces_near format_quoted format_wide
    gsub_empty_captures insert_texts links_near loops_of_chain memory_of_classes memory_tables move points_near points_of_axes powers
    remainders remainders_of_library remove_first rows_near rows_unnamed springs_many text_many text_zeros text_zeros_made""".split())
SLOW_SOURCES = {"inputs", "names", "twice"}


def is_run(name, slow):
    return LONG or (name in slow) != SANITIZED


FILES = [path for path in some(HARMFUL.glob("*.lua")) if is_run(path.stem, SLOW)]
ONLY_OPTIMISED = pytest.mark.skipif(LEAN, reason="takes long with sanitizers: tests/long")
STEPS = "more than 100 million steps to read the model; look for a loop without an end"
NESTED = "C stack overflow: calls, parentheses, tables or blocks are nested too deep"
WRITTEN = ["out/harmful.h", "out/harmful.c"] + [f"out/harmful_{part}.c" for part in range(2, 100)]


def comments_after(text, lead):
    return [line[len(lead):] for line in text.splitlines() if line.startswith(lead)]


def messages(path, expected):
    return [f"{path}:{line.removeprefix('0:')}" for line in expected]


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_harmful(path, tmp_path):
    text = path.read_text()
    assert "-- Tries " in text
    expected = comments_after(text, "-- expect: ")
    said = run_harmful(tmp_path, "check", path, status=1 if expected else 0)
    if expected:
        assert said.splitlines() == messages(path, expected)
    else:
        expected = comments_after(text, "-- expect of gen: ")
        said = run_harmful(tmp_path, "gen", path, "-o", "out", status=1 if expected else 0, written=() if expected else WRITTEN)
        assert said.splitlines()[len(said.splitlines()) - len(expected):] == messages(path, expected)


def refuse(tmp_path, name, *expected):
    """The model `name` in the program's folder causes exactly these messages."""
    said = run_harmful(tmp_path, "check", name)
    assert said.splitlines() == [f"{name}{message}" for message in expected]


def work_folder(tmp_path):
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


@pytest.mark.parametrize("kind, fault", [
    ("pipe", "it is a device, pipe or socket; name a regular file"), ("zero", "it is a device, pipe or socket; name a regular file"),
    ("terminal", "it is a device, pipe or socket; name a regular file"), ("folder", "it is a folder; name a file"),
    ("circle", "Too many levels of symbolic links"), ("missing", "No such file or directory"),
    ("long", "the files of a model are longer than 4 MB"), ("secret", "Permission denied")])
@pytest.mark.parametrize("how", ["model", "required"])
def test_no_model_file(tmp_path, kind, fault, how):
    """A path that is no file, has no end or waits for a writer is refused, as the model and by `require`."""
    work = work_folder(tmp_path)
    path = work / "parts.lua"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "long":
        path.touch()
        os.truncate(path, 5 << 30)
    elif kind == "secret":
        path.touch(mode=0)
        if os.access(path, os.R_OK):
            pytest.skip("this user may read everything")
    elif kind != "missing":
        path.symlink_to({"zero": "/dev/zero", "terminal": "/dev/ptmx", "circle": "parts.lua"}[kind])
    if how == "model":
        refuse(tmp_path, "parts.lua", f": cannot be read: {fault}")
    else:
        (work / "model.lua").write_text('local rd = require "refdyn"\nlocal parts = require "parts"\n')
        refuse(tmp_path, "model.lua", f":2: require: parts.lua in the folder of the model cannot be read: {fault}")


def test_model_without_length(tmp_path):
    """A file of the system without a reported length is read to its end."""
    work = work_folder(tmp_path)
    (work / "model.lua").symlink_to("/proc/self/status")
    run_harmful(tmp_path, "check", "model.lua")


def test_many_files(tmp_path):
    work = work_folder(tmp_path)
    (work / "model.lua").write_text('for i = 1, 200 do require("part" .. i) end\n')
    for i in range(1, 201):
        (work / f"part{i}.lua").write_text("return 1\n")
    refuse(tmp_path, "model.lua", ":1: require: part100.lua in the folder of the model cannot be read: a model has more than 100 files")


def test_large_files(tmp_path):
    work = work_folder(tmp_path)
    (work / "model.lua").write_text('for i = 1, 5 do require("part" .. i) end\n')
    for i in range(1, 6):
        (work / f"part{i}.lua").write_text("-- " + "x" * 1000000 + "\n")
    refuse(tmp_path, "model.lua",
           ":1: require: part5.lua in the folder of the model cannot be read: the files of a model are longer than 4 MB")


@pytest.mark.parametrize("count, expected", [(90, "part90.lua:1: the last"), (99, "part99.lua:1: the last")])
def test_deep_files(tmp_path, count, expected):
    """Each file requires the next one."""
    work = work_folder(tmp_path)
    (work / "model.lua").write_text('require "part1"\n')
    for i in range(1, count):
        (work / f"part{i}.lua").write_text(f'return require "part{i + 1}"\n')
    (work / f"part{count}.lua").write_text("error('the last')\n")
    assert run_harmful(tmp_path, "check", "model.lua").splitlines() == [expected]


SOURCES = {
    "parentheses": ("local x = " + "(" * 100000 + "1" + ")" * 100000, [f":1: {NESTED}"]),
    "tables": ("local x = " + "{" * 100000 + "}" * 100000, [f":1: {NESTED}"]),
    "blocks": ("do " * 100000 + "end " * 100000, [f":1: {NESTED}"]),
    "labels": ("".join(f"::a{i}:: " for i in range(40000)), [f": {STEPS}"]),
    "functions": ("".join(f"local function f{i}() " + "".join(f"local v{j} " for j in range(180)) for i in range(150))
                  + "x=x " * 100000 + "end " * 150, [f": {STEPS}"]),
    "names": ("local x = {" + "".join(f"a{i}=1," for i in range(300000)) + "}\n", None),
    "inputs": ("local rd = require 'refdyn'\n" + "".join(f"a{i}=rd.input('a{i}')\n" for i in range(120000)), None),
    "twice": ("local x = {" + "a=1,\n" * 300000 + "}", None),
    "text": ('local x = "' + "x" * 1000000, None),
    "number": ("local x = 0x" + "f" * 1000000 + "p", None),
    "name": ("local x = " + "y" * 1000000 + " z", None),
    "comment": ("--[" + "=" * 1000000 + "[", None),
    "escapes": ('local x = "' + "\\u{7FFFFFFF}" * 100000 + '"\nreturn { name = x }', None),
}


@pytest.mark.parametrize("kind", [kind for kind in SOURCES if is_run(kind, SLOW_SOURCES)])
def test_source(tmp_path, kind):
    """Sources that are expensive to read: nested, long, or with many names."""
    source, expected = SOURCES[kind]
    work = work_folder(tmp_path)
    (work / "model.lua").write_text(source)
    said = run_harmful(tmp_path, "check", "model.lua").splitlines()
    assert all(len(line) < 9000 and line.startswith("model.lua:") for line in said) and len(said) <= 1001
    if expected:
        assert [line[len("model.lua"):].split(" near ")[0] for line in said] == [
            message.split(" near ")[0] for message in expected] or NESTED in said[0]


@ONLY_OPTIMISED
def test_names_near_each_other(tmp_path):
    """5,000 misspelt names, each of which is close to 5,000 names."""
    work = work_folder(tmp_path)
    (work / "model.lua").write_text("""local rd = require "refdyn"
local hold, links = {}, {}
for i = 1, 5000 do hold[i] = "nothing_of_that_name_" .. i end
for i = 1, 5000 do links[i] = { "nothing_of_this_name_" .. i, joint = "x", mass = 1 } end
return rd.model { name = "near", links = links, hold = hold }
""")
    said = run_harmful(tmp_path, "check", "model.lua").splitlines()
    assert len(said) == 1001 and "model.lua: more than 1000 messages; the others are left out" in said


def test_file_name_in_messages(tmp_path):
    """A file name that would start a second line, or change the reading direction of the first."""
    work = work_folder(tmp_path)
    name = "mo\n\u202edel\x1b[31m.lua"
    shutil.copy(HARMFUL / "goto.lua", work / name)
    said = run_harmful(tmp_path, "check", name)
    assert said == f"mo\\n\\u{{202E}}del\\x1B[31m.lua:5: {STEPS}\n"


def test_bytes_of_a_file(tmp_path):
    """A file in another encoding than UTF-8: its texts are refused when they are read."""
    work = work_folder(tmp_path)
    (work / "model.lua").write_bytes(b"""local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "k\xe9g" } } -- \xe9
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = p.m } } }
""")
    refuse(tmp_path, "model.lua", ':2: text "k\\xE9g": contains byte 233, which is not UTF-8; save the file as UTF-8')


def test_settings_are_texts(tmp_path):
    """An option set by --set passes the same checks as a text of the file."""
    work = work_folder(tmp_path)
    (work / "model.lua").write_text("""local rd = require "refdyn"
return rd.model { name = rd.option("name", "set"), links = { { "a", joint = "x", mass = 1 } } }
""")
    said = run_harmful(tmp_path, "check", "model.lua", "--set", "name=a\nb")
    assert said.splitlines()[0] == 'model.lua: --set name "a\\nb": contains control character 10; remove it'


# ---- harmless models are still read ----

LINKS = """local rd = require "refdyn"
local links, on = {}, nil
for i = 1, 300 do
  links[i] = { "link" .. i, on = on, at = { 0, 0, i > 1 and 0.1 or 0 }, joint = i % 2 == 0 and "phi" or "theta",
               mass = 0.1 + i * 1e-3, center = { 0, 0, 0.05 }, inertia = { xx = 1e-4, yy = 1e-4, zz = 1e-5 } }
  on = "link" .. i
end
return rd.model { name = "links", gravity = { 0, 0, -9.81 }, links = links }
"""
PARAMETERS = """local rd = require "refdyn"
local list = {}
for i = 1, 2000 do list[i] = { "p" .. i, i * 1e-3, "N" } end
local p = rd.parameters(list)
return rd.model { name = "parameters", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "x", mass = 1 }, { "b", on = "a", joint = "theta", mass = p.p1, center = { 0, 0, -1 } } },
  forces = function(s)
    local f = 0
    for i = 1, 2000 do f = f + p["p" .. i] * rd.sin(i * s.t) end
    return { a_x = f }
  end }
"""
LIBRARY = """local rd = require "refdyn"
local Vector = {}
Vector.__index = Vector
local function vector(x, y, z) return setmetatable({ x, y, z }, Vector) end
function Vector.__add(a, b) return vector(a[1] + b[1], a[2] + b[2], a[3] + b[3]) end
function Vector.__eq(a, b) return a[1] == b[1] and a[2] == b[2] and a[3] == b[3] end
function Vector:list() return { self[1], self[2], self[3] } end
local Named = setmetatable({}, { __index = Vector })
Named.__index = Named
function count(list) return #list end
local sum = setmetatable({ 0, 0, 1 }, Named)
for i = 1, 1000 do sum = sum + vector(i, 0, 0) end
assert(sum == vector(500500, 0, 1) and getmetatable(sum) == Vector and sum.list and Named.list)
local samples = {}
for at, value in ("0 1; 0.5 2.5; 2 -1e3;"):gmatch("(%S+) (%S+);") do samples[#samples + 1] = { tonumber(at), value + 0 } end
table.sort(samples, function(a, b) return a[1] > b[1] end)
assert(samples[1][1] == 2 and samples[3][2] == 1 and count(samples) == 3 and count { table.unpack(samples, 2) } == 2)
local words = { "b", "a", "C" }
table.sort(words)
table.insert(words, 1, "first")
assert(table.concat(words, ",") == "first,C,a,b" and table.remove(words) == "b" and select("#", table.unpack(words)) == 3)
assert(("%5.2f|%s|%q"):format(1.005, true, "x"):gsub("|", "/") == ' 1.00/true/"x"' and ("abc"):rep(2, "-") == "abc-abc")
local keys = ""
for key, value in pairs { b = 1, a = 2, 5, 6 } do keys = keys .. key end
assert(keys == "12ab" and tostring(12) == "12" and math.max(table.unpack { 3, 9, 4 }) == 9 and 7 % 4 == 3)
helper = function(x) return 2 * x end
return rd.model { name = "library", links = { { "a", joint = "x", mass = helper(1), center = sum:list() } } }
"""


@ONLY_OPTIMISED
@pytest.mark.parametrize("name, text, settings", [
    ("links", LINKS, ()), ("parameters", PARAMETERS, ()), ("library", LIBRARY, ()),
    ("manipulator", (MODELS / "manipulator.lua").read_text(), ("--set", "n_rfe=4000"))])
def test_honest(tmp_path, name, text, settings):
    """Large models, and helpers of all kinds, are read and emitted."""
    work = work_folder(tmp_path)
    (work / "model.lua").write_text(text)
    run_harmful(tmp_path, "check", "model.lua", *settings, status=0)
    written = [f"out/{name}.h", f"out/{name}.c"] + [f"out/{name}_{part}.c" for part in range(2, 100)]
    run_harmful(tmp_path, "gen", "model.lua", *settings, "-o", "out", status=0, written=written)


@ONLY_OPTIMISED
def test_same_count_everywhere(tmp_path):
    """The bound is on work, not on time: a loop just within it passes regardless of the machine's load."""
    text = 'local rd = require "refdyn"\nfor i = 1, %d do end\nreturn rd.model { name = "a", links = { { "b", joint = "x", mass = 1 } } }\n'
    for count, status in ((99000000, 0), (100100000, 1)):
        path = tmp_path / "model.lua"
        path.write_text(text % count)
        done = refdyn("check", path, status=status)
        assert status == 0 or done.stderr == f"{path}:2: {STEPS}\n"
