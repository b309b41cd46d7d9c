"""Closed linkages in any orientation: rows that are rounding alone there neither hold the linkage nor let it go."""
import csv
import json
import pathlib
import re

import numpy
import pytest

from compiled import Compiled
from program import LONG, TESTS, refdyn, settings

MODEL = TESTS / "turned" / "turned.lua"
KINDS = {"fourbar": 3, "slider": 3, "bennett": 3, "spherical": 3, "sarrus": 5, "parallelogram": 3}
ORIENTATIONS = 200 if LONG else 20


def about(axis, angle):
    turn = numpy.eye(3)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    turn[j, j] = turn[k, k] = numpy.cos(angle)
    turn[k, j] = numpy.sin(angle)
    turn[j, k] = -turn[k, j]
    return turn


def tilts(seed, count):
    """Parameters of a random orientation, and of the unturned linkage with the same weight in its own axes."""
    random = numpy.random.default_rng(seed)
    for _ in range(count):
        angles = random.uniform(-3, 3, 3)
        weight = (about(0, angles[0]) @ about(1, angles[1]) @ about(2, angles[2])).T @ [0, 0, -9.81]
        yield dict(zip("abc", angles)), dict(zip(("gx", "gy", "gz"), weight))


# ---- Emitted accelerations ----

def least_squares(M, force, u, k):
    """M qdd = force + u^T lambda with u qdd = k, by singular values; and a basis of the rates that the rows leave free."""
    half = numpy.linalg.inv(numpy.linalg.cholesky(M))
    left, values, right = numpy.linalg.svd(u @ half.T, full_matrices=True)
    rank = int((values > 1e-9 * values[0]).sum())
    free = half.T @ half @ force
    change = right[:rank].T @ ((left.T @ (k - u @ free))[:rank] / values[:rank])
    return free + half.T @ change, half.T @ right[rank:].T


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("base, by, factor", [("fixed", "close", 1.0), ("moving", "close", 1.0), ("moving", "axes", 1.0),
                                              ("moving", "rows", 1e8), ("moving", "rows", 1e-8)])
def test_emitted_accelerations(kind, base, by, factor, tmp_path):
    """`qdd` of the emitted C alone: equal to a solution by singular values, within 1e-9, in all orientations and on a base that turns."""
    random = numpy.random.default_rng(7)
    worst = 0
    for i, (tilt, _) in enumerate(tilts(1, max(2, ORIENTATIONS // 10) if base == "fixed" else 1)):
        options = settings(dict(kind=kind, base=base, by=by, factor=factor))
        text = MODEL.read_text()
        for name, angle in tilt.items():
            text = text.replace(f'{{ "{name}", 0, "rad" }}', f'{{ "{name}", {angle}, "rad" }}')
        file = tmp_path / f"turned{i}.lua"
        file.write_text(text)
        emitted = Compiled(file, tmp_path / str(i), *options)
        for _ in range(ORIENTATIONS if base == "moving" else 1):
            state = {"t": 0.0, "q": emitted.start[:emitted.n].copy(), "qd": numpy.zeros(emitted.n)}
            if base == "moving":
                state["q"][:2] = random.uniform(-1.4, 1.4, 2)
            free = least_squares(emitted("M", state), numpy.zeros(emitted.n), emitted("u", state), numpy.zeros(emitted.m))[1]
            state["qd"] = free @ random.normal(size=free.shape[1])
            force = emitted("h", state) + emitted("Q", state)
            expected = least_squares(emitted("M", state), force, emitted("u", state), emitted("k", state))[0]
            worst = max(worst, numpy.abs(emitted("qdd", state) - expected).max() / numpy.abs(expected).max())
    assert worst < 1e-9, worst


# ---- Motions, equilibria, modes ----

def motion(file, folder, *options, n, **values):
    """The outputs of the first n coordinates, and what the program says."""
    out = folder / "motion.csv"
    done = refdyn("sim", file, *options, "-o", out, *settings(values))
    with open(out, newline="") as lines:
        rows = numpy.array([[float(x) for x in row] for row in list(csv.reader(lines))[1:]])
    return rows[:, 1:1 + n], done.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_motions(kind, tmp_path):
    """Turned and unturned motions agree within ten tolerances."""
    for tilt, weight in tilts(2, ORIENTATIONS // 4 if LONG else 2):
        runs = [motion(MODEL, tmp_path, "--until", 0.5, "--tol", 1e-8, n=KINDS[kind], kind=kind, **values)[0] for values in (tilt, weight)]
        assert numpy.abs(runs[0] - runs[1]).max() < 1e-7


@pytest.mark.parametrize("kind, other", [("fourbar", "ball"), ("bennett", "axes"), ("sarrus", "axes")])
def test_motions_on_a_base_that_turns(kind, other, tmp_path):
    """Rows of the author, scaled by 1e8 and 1e-8, and rows of a joint or of axes that suffice give the same motion."""
    for tilt, _ in tilts(3, 20 if LONG else 1):
        n = KINDS[kind] + 2
        options = ("--until", 0.5, "--tol", 1e-8)
        expected = motion(MODEL, tmp_path, *options, n=n, kind=kind, base="moving", by=other, **tilt)[0]
        for values in (dict(by="close"), dict(by="rows", factor=1e8), dict(by="rows", factor=1e-8)):
            found = motion(MODEL, tmp_path, *options, n=n, kind=kind, base="moving", **values, **tilt)[0]
            assert numpy.abs(found - expected).max() < 1e-7, values


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_lengths_in_other_units(unit, tmp_path):
    """A Bennett linkage of some millimetres, and of some hundred metres: balanced energy."""
    (tilt, _), = tilts(4, 1)
    said = motion(MODEL, tmp_path, "--until", 0.2, n=3, kind="bennett", unit=unit, **tilt)[1]
    assert float(re.search(r"balance error (\S+) of", said).group(1)) < 1e-5


@pytest.mark.parametrize("kind", ["fourbar", "spherical"])
def test_equilibria_and_modes(kind):
    for tilt, weight in tilts(5, 20 if LONG else 2):
        at = [json.loads(refdyn("statics", MODEL, *settings(dict(kind=kind, **values))).stdout)["q"] for values in (tilt, weight)]
        assert numpy.abs(numpy.subtract(*at)).max() < 1e-9
        modes = [json.loads(refdyn("modes", MODEL, *settings(dict(kind=kind, **values))).stdout)["modes"] for values in (tilt, weight)]
        found, expected = ([mode["omega"] for mode in each] for each in modes)
        assert len(found) == len(expected) and numpy.abs(numpy.divide(found, expected) - 1).max() < 1e-9


# ---- Rows that replace each other during a motion ----

def test_bennett(tmp_path):
    """Of five rows two are independent everywhere, but not the same two. Errors against a tight run, over several turns."""
    values = dict(kind="bennett")
    tight = motion(MODEL, tmp_path, "--until", 10, "--tol", 1e-13, n=3, **values)[0]
    for tol, error in ((1e-6, 1e-5), (1e-9, 1e-7), (1e-11, 1e-9)):
        assert numpy.abs(motion(MODEL, tmp_path, "--until", 10, "--tol", tol, n=3, **values)[0] - tight).max() < error


def test_rows_replace_each_other_in_time(tmp_path):
    """With gains, states are off the programme. Rows kept for too long then contradict the omitted ones, whose parts they hardly determine."""
    twists, start, tilt = (1.062117984907628, 1.3078281821659876), 1.5451401372931197, (2.35344066, 0.68230163, 1.97613675)
    text = MODEL.read_text().replace('joint = "psi", name = "pin"', 'joint = "psi", name = "pin", alpha = 20, beta = 20')
    text = text.replace("local a, al, be = 0.4, 0.7, 1.3", "local a, al, be = 0.4, %r, %r" % twists).replace("local t1 = 1\n", f"local t1 = {start}\n")
    assert "%r" % twists[0] in text and f"t1 = {start}" in text
    (tmp_path / "gains.lua").write_text(text)
    motion(tmp_path / "gains.lua", tmp_path, "--until", 8, "--stabilise", "baumgarte", n=3, kind="bennett", **dict(zip("abc", tilt)))


def test_inexact_axis(tmp_path):
    """An error of 1e-9 rad is that of the lengths' digits; one of 1e-6 rad makes a linkage that cannot move."""
    motion(MODEL, tmp_path, "--until", 1, n=3, kind="bennett", off=1e-9)
    said = refdyn("sim", MODEL, "--until", 1, "-o", tmp_path / "x.csv", *settings(dict(kind="bennett", off=1e-6)), status=3).stderr
    assert "a constraint row depends on others but contradicts them" in said and "off the programme by pin turn" in said


CHAIN = """local rd = require "refdyn"
local links = {}
local function rod(name, on, at, angle, rate)
  links[#links + 1] = { name, on = on, at = at, joint = "psi", start = { psi = angle }, start_rate = { psi = rate }, mass = 1,
    center = { 0.5, 0, 0 }, inertia = { zz = 1 / 12 } }
end
for i = 0, 40 do rod("crank_" .. i, nil, { i, 0, 0 }, rd.pi / 2, -1) end
for i = 1, 40 do rod("coupler_" .. i, "crank_" .. (i - 1), { 1, 0, 0 }, -rd.pi / 2, 1) end
return rd.model { name = "chain", gravity = { 0, -9.81, 0 }, links = links,
  constraints = function()
    local rows = {}
    for i = 1, 40 do rows[i] = rd.loop { { on = "coupler_" .. i, at = { 1, 0, 0 } }, { on = "crank_" .. i, at = { 1, 0, 0 } }, keep = "x, y" } end
    return rows
  end }
"""


@pytest.mark.parametrize("method", ["auto", "rk8", "rodas5p", "gauss12", "radau9"] if LONG else ["auto"])
def test_forty_loops_pass_singular_positions(method, tmp_path):
    (tmp_path / "chain.lua").write_text(CHAIN)
    said = motion(tmp_path / "chain.lua", tmp_path, "--until", 10 if LONG else 1, "--tol", 1e-9, "--singular", "pass", "--method", method, n=1)[1]
    assert f"passed       {10 if LONG else 1} state" in said, said
    assert float(re.search(r"balance error (\S+) of", said).group(1)) < 1e-8


# ---- Models of the gallery ----

# The author's model on a frame that is turned and, with `moves`, slides: its weight turns with it.
FRAME = """
local rd = require "refdyn"
local angles = { %s }
local function turned(v)
  local x, y, z = v[1], v[2], v[3]
  local function turn(a, b, angle) return rd.cos(angle) * a - rd.sin(angle) * b, rd.sin(angle) * a + rd.cos(angle) * b end
  x, y = turn(x, y, angles[3])
  z, x = turn(z, x, angles[2])
  y, z = turn(y, z, angles[1])
  return { x, y, z }
end
local function placed(value)
  if value == "ground" then return "turned_frame" end
  if type(value) ~= "table" then return value end
  local out = {}
  for k, v in pairs(value) do out[k] = placed(v) end
  return setmetatable(out, getmetatable(value))
end
local function model(m)
  local links = { { "turned_frame", turn = { { "x", angles[1] }, { "y", angles[2] }, { "z", angles[3] } } } }
  for _, link in ipairs(m.links) do
    if link.on == nil or link.on == "ground" then link.on = "turned_frame" end
    links[#links + 1] = link
  end
  m.links = links
  if m.gravity then m.gravity = turned(m.gravity) end
  for name, point in pairs(m.points or {}) do m.points[name] = placed(point) end
  return rd.model(m)
end
"""


@pytest.mark.parametrize("name, options, until", [("bricard", {}, 1), ("fourbar", {"joints": "spatial"}, 0.5)])
def test_gallery(name, options, until, tmp_path):
    """Models of the gallery that are closed by joints in space move alike in every orientation."""
    source = pathlib.Path(TESTS.parent / "models" / f"{name}.lua").read_text()
    assert "return rd.model {" in source
    expected = motion(TESTS.parent / "models" / f"{name}.lua", tmp_path, "--until", until, "--tol", 1e-8, n=3, **options)[0]
    for tilt, _ in tilts(8, 20 if LONG else 2):
        text = FRAME % ", ".join(str(angle) for angle in tilt.values())
        body = source.replace('local rd = require "refdyn"', "").replace("return rd.model {", "return model {").replace('on = "ground"', 'on = "turned_frame"')
        file = tmp_path / f"{name}.lua"
        file.write_text(text + body)
        found = motion(file, tmp_path, "--until", until, "--tol", 1e-8, n=3, **options)[0]
        assert numpy.abs(found - expected).max() < 1e-7
