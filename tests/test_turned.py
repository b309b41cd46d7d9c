"""Closed linkages in any orientation: rows that are rounding alone there neither hold the linkage nor let it go."""
import csv
import json
import re
import zlib

import numpy
import pytest

from compiled import Compiled
from program import LONG, TESTS, all_models, read_run, refdyn, settings

MODEL, SEAT = TESTS / "turned" / "turned.lua", TESTS / "turned" / "seat.lua"
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

def run_of(file, folder, *options, **values):
    """The columns of a motion."""
    refdyn("sim", file, *options, "-o", folder / "run.csv", *settings(values))
    return read_run(folder / "run.csv")


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
    for tilt, weight in tilts(2, ORIENTATIONS if LONG else 2):
        until = 0.3 if kind == "sarrus" else 0.5  # flat, in a singular position, later on
        runs = [motion(MODEL, tmp_path, "--until", until, "--tol", 1e-8, n=KINDS[kind], kind=kind, **values)[0] for values in (tilt, weight)]
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


def test_drift_without_gains(tmp_path):
    """Residuals that nothing pulls back make the redundant rows contradict the kept ones. The message names the cause and the remedy."""
    said = refdyn("sim", MODEL, "--until", 10, "-o", tmp_path / "x.csv", "--stabilise", "baumgarte", *settings(dict(kind="bennett")), status=3).stderr
    assert re.search(r"the rows have drifted off the programme \(pin turn \d: phi up to \S+\), where redundant rows contradict each other; use --stabilise project", said)


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


# ---- Forces of closed linkages ----

def driven(folder):
    """turned.lua with a drive of the crank, which starts at rest with an acceleration."""
    text = MODEL.read_text().replace("return { rd.close { e, f, joint = \"psi\"", "return { rd.drive { \"crank_psi\", 0.5 + 0.3 * s.t^2 }, rd.close { e, f, joint = \"psi\"")
    assert "rd.drive" in text
    file = folder / "driven.lua"
    file.write_text(text)
    return file


def test_drives_at_rest(tmp_path):
    """Without weight, the programme alone accelerates the linkage. Its motor's torque is that of the unturned linkage."""
    file, options = driven(tmp_path), ("--until", 1, "--tol", 1e-8)
    expected = run_of(file, tmp_path, *options, gz=0)
    for tilt, _ in tilts(9, 100 if LONG else 2):
        found = run_of(file, tmp_path, *options, gz=0, **tilt)
        for name in ("rocker_psi", "force_crank_psi"):
            assert numpy.abs(found[name] - expected[name]).max() < 1e-7, name


def test_outputs_leave_the_motion_alone(tmp_path):
    """Forces are computed at outputs. The steps of the motion do not depend on them."""
    ends = [run_of(MODEL, tmp_path, "--until", 10, "--every", every, kind="bennett")["l3_psi"][-1] for every in (0.05, 0.3, 5)]
    assert numpy.ptp(ends) < 1e-10


def test_rows_that_are_switched_off(tmp_path):
    """A row that its author switches off has the multiplier 0, and the others keep theirs."""
    (tmp_path / "off.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "off",
  links = { { "a", joint = "x", mass = 2, start_rate = { x = 0.7 } }, { "b", joint = "x", mass = 3, start_rate = { x = 0.7 } } },
  forces = function(s) return { a_x = 5 } end,
  constraints = function(s) return {
    rd.velocity { rd.where(rd.less(s.t, 0.5), 1, 0) * (s.qd.b_x - s.qd.a_x), name = "clutch" }, rd.drive { "a_x", 0.7 * s.t + 0.1 * s.t^2 } } end }
""")
    run = run_of(tmp_path / "off.lua", tmp_path, "--until", 1, "--every", 0.2)
    assert numpy.abs(run["lambda_clutch"] - [0.6, 0.6, 0.6, 0, 0, 0]).max() < 1e-9
    assert numpy.abs(run["lambda_drive_a_x"] - [-4, -4, -4, -4.6, -4.6, -4.6]).max() < 1e-9


def test_a_row_without_slope_at_rest(tmp_path):
    """The multiplier of a prescribed speed grows beyond all bounds towards rest: there it is no number, and not 0."""
    (tmp_path / "speed.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "speed", links = { { "a", joint = "x, y", mass = 2 } }, forces = function(s) return { a_x = 5 } end,
  constraints = function(s) return { rd.velocity { s.qd.a_x^2 + s.qd.a_y^2 - 0.01 * s.t^2, name = "speed" } } end }
""")
    run = run_of(tmp_path / "speed.lua", tmp_path, "--until", 1, "--every", 0.5)
    assert numpy.isnan(run["lambda_speed"][0]) and numpy.abs(run["lambda_speed"][1:] - [-48, -24]).max() < 1e-6


# ---- Models of the gallery and of the tests, on a seat ----

VARIANTS = {"closures": [{"entry": i} for i in range(1, 16)], "fourbar": [{"joints": "spatial"}, {}], "stewart": [{"legs": "heavy"}, {}],
            "small_motions": [{"kind": kind} for kind in ("rods", "skate", "gear", "curved", "pair")]}
FEW = ("closures", "fivebar", "fourbar", "slidercrank", "stewart")


def models_with_rows():
    """Models of the project that have rows, each with the options that change its rows. No state satisfies those of `functions`."""
    found = [path for path in sorted([*all_models(), *(TESTS / "models").rglob("*.lua"), *(TESTS / "fmi").glob("*.lua")])
             if LONG and "constraints" in path.read_text() and path.stem != "functions" or path.stem in FEW]
    return [pytest.param(path, variant, id=f"{path.parent.name}-{path.stem}-{i}") for path in found
            for i, variant in enumerate(VARIANTS.get(path.stem, [{}])) if LONG or i < 2]


def on_a_seat(path, folder, base, random, **options):
    """The motion of the model on a seat that is turned at random, or not turned."""
    turns = random.uniform(-3, 3, 3) if random else numpy.zeros(3)
    file = folder / path.name
    file.write_text(SEAT.read_text() + path.read_text())
    seat = dict(zip(("seat_x", "seat_y", "seat_z"), turns), seat_base=base)
    return run_of(file, folder, "--until", 0.2, "--tol", 1e-8, **seat, **options)


@pytest.mark.parametrize("path, variant", models_with_rows())
def test_models_on_a_seat(path, variant, tmp_path):
    """A model on a turned seat, with rows that are scaled, moves as on an unturned seat, and its drives have the same forces."""
    random = numpy.random.default_rng(zlib.crc32(path.stem.encode()))
    for base in ("fixed", "free", "driven") if LONG else random.choice(["fixed", "free", "driven"], 1):
        expected = on_a_seat(path, tmp_path, base, None, **variant)
        for factor in (1.0, 1e8, 1e-8) if LONG else random.choice([1e8, 1e-8], 1):
            found = on_a_seat(path, tmp_path, base, random, seat_factor=factor, **variant)
            for name, values in expected.items():
                if name + "_d" in expected:
                    assert numpy.abs(found[name] - values).max() < 1e-7 * max(1, numpy.abs(values).max()), (base, factor, name)
                if name.startswith("force_"):
                    allowed = 1e-4 * max(1, numpy.nanmax(numpy.abs(values), initial=0))
                    assert numpy.allclose(found[name], values, rtol=0, atol=allowed, equal_nan=True), (base, factor, name)
