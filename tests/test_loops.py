"""Runs of equal elements as loops, as straight code, and with M as a matrix: every quantity is the same."""
import os
import random
import re
import subprocess

import numpy
import pytest

from compiled import Compiled
from program import LONG, REFDYN, REFERENCE, TESTS, check, close, refdyn, some
from random_models import as_lua, random_model, random_state

RUNS = TESTS / "models" / "runs.lua"
KINDS = re.findall(r"^  (\w+) *= \{ links", RUNS.read_text(), re.M)
QUANTITIES = ("M", "h", "Q", "u", "v", "phi", "psi", "k", "r", "rd", "C", "d", "energy", "power", "Q_q")
LOOPS = ["--accelerations", "recursive", "--loops", "always"]
STRAIGHT = ["--accelerations", "recursive", "--loops", "never"]
OTHERS = {"chosen": [], "dense": ["--accelerations", "dense"]}
EXACT = 1e-12
# Each kind with the smallest run or with another count, in tests/long with both; all counts from 2 to 9 occur.
COUNTS = [(kind, count) for i, kind in enumerate(KINDS) for count in (2, 3 + i % 7) if LONG or (count == 2) == (i % 3 == 0)]


def loops_of(path, folder, *options):
    """Elements of each loop, as `refdyn gen` prints them."""
    printed = refdyn("gen", path, *options, "-o", folder).stdout
    return [(int(count), int(period)) for count, period in re.findall(r"^loop over (\d+) elements of (\d+) ", printed, re.M)]


def sizes(found, expected):
    return max(1e-9, float(abs(expected).max(initial=0)))


def compare(found, expected, state):
    """Lines where one variant differs from the other. Accelerations are compared in the metric of M, as its condition number allows no
    other comparison."""
    lines = []
    for name in QUANTITIES:
        one, other = found(name, state), expected(name, state)
        assert (one is None) == (other is None), name
        if other is not None and other.size:
            lines.append(close(name, one, other, EXACT, sizes(one, other)))
    M = expected("M", state)
    for name, tolerance in (("qdd_free", EXACT), ("qdd", 1e-9)):
        one, other = found(name, state), expected(name, state)
        assert (one is None) == (other is None), name
        if other is not None:
            assert numpy.isfinite(other).all(), name
            lines.append(close("M " + name, M @ one, M @ other, tolerance, float((abs(M) @ abs(other)).max())))
    one, other = found("force", state), expected("force", state)
    return lines + ([close("force", one, other, 1e-9, float((abs(M) @ abs(expected("qdd", state))).max()))] if other is not None else [])


def state_of(model, seed):
    return random_state(random.Random(seed), model.n, 0.3)


@pytest.mark.parametrize("kind, rfe", COUNTS)
def test_loops_are_straight_code(kind, rfe, tmp_path):
    options = ["--set", f"kind={kind}", "--set", f"rfe={rfe}"] + ["--fold"] * (rfe % 3 == 0)
    loops, straight = (Compiled(RUNS, tmp_path / name, *options, *variant) for name, variant in (("loops", LOOPS), ("straight", STRAIGHT)))
    check(compare(loops, straight, state_of(straight, rfe)))


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("kind", KINDS[::3])
def test_other_variants(kind, other, tmp_path):
    options = ["--set", f"kind={kind}", "--set", "rfe=5"]
    found, loops = (Compiled(RUNS, tmp_path / name, *options, *variant) for name, variant in (("other", OTHERS[other]), ("loops", LOOPS)))
    check(compare(found, loops, state_of(loops, 3)))


# (elements, coordinates of one) of each loop at rfe = 4: at the root and the tip of a tree, split where a formula names an element or an
# element
# carries something. A run begins at the first turn of an element. The first element of a beam that is turned relative to its carrier
# differs.
EXPECTED = {
    "beam": [(2, 3)], "weighted": [], "sides": [(3, 3), (4, 2)], "segments": [(3, 3), (3, 3), (5, 3)], "tree": [],
    "middle": [(3, 3), (2, 3)], "chain": [(3, 1)], "slides": [(3, 2)], "swinging": [(4, 1)], "named": [(3, 3), (3, 3)],
    "friction": [], "spread": [(3, 3), (2, 3), (3, 3)], "driven": [(2, 1), (4, 1)], "floating": [(3, 3)],
}


@pytest.mark.parametrize("kind", EXPECTED)
def test_where_loops_run(kind, tmp_path):
    options = ["--set", f"kind={kind}", "--emit", "Q"]
    assert loops_of(RUNS, tmp_path, *options, "--loops", "always") == EXPECTED[kind]
    assert loops_of(RUNS, tmp_path, *options, "--loops", "never") == []
    assert loops_of(RUNS, tmp_path, *options, "--loops", "always", "--accelerations", "dense") == []


def test_printed_form_has_no_loops(tmp_path):
    assert loops_of(REFERENCE, tmp_path, "--set", "n_rfe=8", "--set", "form=printed", "--loops", "always") == []


# Models with loops.
ROLLED = "M,h,Q,u,v,phi,psi,k,r,rd,C,d,energy,power,Q_q,qdd_free,qdd,force,equations,course,start"


def functions(folder):
    """Bodies of the emitted functions by name: numbers as 0, tables of them as one, blanks and line ends as one blank."""
    text = "\n".join(path.read_text() for path in sorted(folder.glob("*.c")))
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    found = {}
    for name, body in re.findall(r"^(?:static )?\w+ (\w+)\([^;{]*\) \{\n(.*?)^\}", text, re.M | re.S):
        found[name] = re.sub(r"(0, )+0,?", "0", re.sub(r"\s+", " ", re.sub(r"\d+(\.\d+)?(e-?\d+)?", "0", body)))
    return found


@pytest.mark.parametrize("emit", [ROLLED, "all"], ids=["each", "all"])
def test_text_does_not_grow(tmp_path, emit):
    """16 elements compared with 64: functions differ only in numbers and in the length of tables."""
    for n_rfe in (16, 64):
        refdyn("gen", REFERENCE, "--set", f"n_rfe={n_rfe}", "--emit", emit, "-o", tmp_path / str(n_rfe))
    few, many = (functions(tmp_path / name) for name in ("16", "64"))
    assert few.keys() == many.keys() and len(few) > 15
    assert [name for name in few if few[name] != many[name]] == []


def peak(*arguments):
    """Peak memory of the program in KiB, including its start by Python."""
    process = subprocess.Popen([REFDYN, *map(str, arguments)], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return usage.ru_maxrss


def test_long_chain_is_small(tmp_path):
    """512 elements, 1,537 coordinates: the memory of `gen` and the size of its files."""
    assert peak("gen", REFERENCE, "--set", "n_rfe=512", "-o", tmp_path) < 150_000
    assert sum(path.stat().st_size for path in some(tmp_path.iterdir())) < 300_000


# Beams of different length in series: 512 elements each.
SERIES = """local rd = require "refdyn"
local links = {}
for i = 1, rd.option("beams", 4) do
  links[i] = { "b" .. i, on = i > 1 and "b" .. (i - 1) .. ".tip" or nil, joint = "psi",
               beam = { length = 1 + 0.1 * i, section = rd.round(0.02), E = 7e10, nu = 0.3, rho = 2700, eta = 1e-4, rfe = 512 } }
end
return rd.model { name = "series", gravity = { 0, -9.81, 0 }, links = links, points = { E = { on = "b1", along = 0.5 } } }
"""


@pytest.mark.parametrize("command", [["check"], ["gen"], ["gen", "--emit", "M,tangent,d_statics"]], ids=" ".join)
def test_memory_is_linear(command, tmp_path):
    """6,136 coordinates: any n x n array would need at least 150 MB."""
    (tmp_path / "series.lua").write_text(SERIES)
    folder = ["-o", tmp_path / "out"] if command[0] == "gen" else []
    one, four = (peak(*command, tmp_path / "series.lua", "--set", f"beams={beams}", *folder) for beams in (1, 4))
    assert four < 150_000
    assert four < one + 60_000


# Equal rigid links that turn about parallel axes.
LINKS = """local rd = require "refdyn"
local links = {}
for i = 1, rd.option("n", 6) do
  links[i] = { "l" .. i, on = i > 1 and "l" .. (i - 1) or nil, at = i > 1 and { 0.2, 0, 0 } or nil, joint = "psi", mass = 0.3,
               center = { 0.1, 0, 0.01 }, inertia = { xx = 1e-3, yy = 2e-3, zz = 2e-3 }, spring = { psi = 3 } }
end
return rd.model { name = "links", gravity = { 0.1, -1, -9.81 }, links = links }
"""


@pytest.mark.parametrize("n", [5, 6, 8, 12])
def test_runs_are_written_out_where_that_saves_a_quarter(n, tmp_path):
    (tmp_path / "links.lua").write_text(LINKS)
    printed = {loops: refdyn("gen", tmp_path / "links.lua", "--set", f"n={n}", "--emit", "M,h,qdd_free", "--loops", loops, "-o", tmp_path).stdout
               for loops in ("auto", "always", "never")}
    weighed = {loops: int(re.search(r"axes of parallel turns [^,]*, (\d+)", printed[loops]).group(1)) for loops in printed}
    is_written = 3 * weighed["always"] > 4 * weighed["never"]
    assert weighed["auto"] == weighed["never" if is_written else "always"]
    assert (f"runs written out, {weighed['never']} (loops {weighed['always']})" in printed["auto"]) == is_written
    assert ("loop over" in printed["auto"]) != is_written
    assert is_written == (n < 7)


# Thirty-two flexible links in a tree: functions long enough to be cut into pieces.
FOREST = """local rd = require "refdyn"
local p = rd.parameters { { "g", 9.75, "m/s^2" }, { "E", 2e9, "Pa" }, { "rho", 1200, "kg/m^3" }, { "d", 0.02, "m" } }
local links = {}
for i = 1, 32 do
  links[i] = { "arm" .. i, on = i > 1 and "arm" .. (i // 2) .. ".tip" or nil, turn = { { "z", 0.2 * i } }, joint = "theta",
               beam = { length = 0.5 + 0.02 * i, section = rd.round(p.d), E = p.E, nu = 0.3, rho = p.rho, rfe = 3 + i % 2, eta = 1e-3 } }
end
return rd.model { name = "forest", gravity = { 0, 0, -p.g }, links = links, points = { E = "arm16.tip", F = "arm9.tip" },
  constraints = function(s)
    return { rd.distance { "E", "F", 1.5, alpha = 2, beta = 3 }, rd.velocity { s.points.E.xd - s.points.F.zd },
             rd.on_plane { "arm7.tip", { "ground", { 1, 2, 3 } }, alpha = 1, beta = 1 } }
  end }
"""


def test_loops_in_pieces(tmp_path):
    """Values of loops that are used across the cut of a function."""
    (tmp_path / "forest.lua").write_text(FOREST)
    emit = ["--emit", "M,qdd,start"]
    loops, straight = (Compiled(tmp_path / "forest.lua", tmp_path / name, *emit, *variant) for name, variant in (("loops", LOOPS), ("straight", STRAIGHT)))
    text = "\n".join(path.read_text() for path in (tmp_path / "loops").glob("forest*.c"))
    assert re.search(r"^struct forest_constrained_carried \{[^}]*\[\d+\];", text, re.M | re.S), "nothing of a loop is carried"
    check(compare(loops, straight, state_of(straight, 12)))
