"""HDF5 files that are damaged or refer to other files: plot, view, merge, sim --case and batch --resume refuse them with one message and
leave their output unchanged; names that such a file cannot have are refused before anything is computed."""
import os
import random
import shutil
import struct
import subprocess

import h5py
import numpy as np
import pytest

from program import LONG, REFDYN, refdyn

MODEL = """local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg" } }
return rd.model { name = "fall", gravity = { 0, 0, -9.81 }, links = { { "b", joint = { "z" }, mass = p.m, start = { z = 1 } } },
  points = { E = "b" }, forces = function(s) return { b_z = rd.input("which", 0, "N") } end, %s }
"""
SWEEP = """local rd = require "refdyn"
return rd.sweep { vary = { m = { 1, 2, 3 }, b_z = { 0, 1 } }, t_end = 0.1, every = 0.05,
  keep = { final = true, extremes = { "b_z" }, history = { "b_z" } } }
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a motion, run.h5, and a batch, runs.h5."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "fall.lua").write_text(MODEL % "")
    (folder / "sweep.lua").write_text(SWEEP)
    refdyn("sim", "fall.lua", "--until", "0.1", "--every", "0.02", "-o", "run.h5", cwd=folder)
    refdyn("batch", "fall.lua", "sweep.lua", "-o", "runs.h5", "--threads", "1", cwd=folder)
    return folder


def commands(kind, path, out):
    if kind == "run.h5":
        return [["plot", path, "-o", out / "x.svg"], ["view", path, "-o", out / "x.html"]]
    return [["plot", path, "-o", out / "x.svg"], ["merge", path, "-o", out / "x.h5"], ["sim", "--case", "1", "--of", path, "-o", out / "x.csv"]]


def refused(arguments, path):
    """The reported fact about the file; the output is unchanged."""
    out = arguments[-1]
    out.write_text("kept")
    done = refdyn(*arguments, status=1, timeout=30)
    assert done.stderr.count("\n") == 1 and done.stdout == "", done
    assert out.read_text() == "kept" and not list(out.parent.glob("x.*.part"))
    return done.stderr.replace(f"refdyn: {path}", str(path)).removeprefix(f"{path}: ").strip()


# ---- Links to other places, and missing data ----

def replace(make):
    """Replaces the dataset by another one of this form, with its attributes."""
    def how(file, name):
        old = file[name]
        form, attributes = (old.shape, old.dtype), {key: old.attrs[key] for key in ("columns", "kind", "target", "units") if key in old.attrs}
        del file[name]
        make(file, name, *form)
        file[name].attrs.update(attributes)
    return how


def virtual(source):
    def make(file, name, shape, dtype):
        layout = h5py.VirtualLayout(shape, dtype)
        layout[...] = h5py.VirtualSource(source, "x", shape)
        file.create_virtual_dataset(name, layout)
    return replace(make)


def external(source):
    return replace(lambda file, name, shape, dtype: file.create_dataset(name, shape, dtype, external=[(source, 0, 8 * int(np.prod(shape)))]))


def link(target):
    def how(file, name):
        del file[name]
        file[name] = target
    return how


ELSEWHERE = "its data lie in other files, which are not followed"
WRONG = {
    "external": (external("secret"), "{}: " + ELSEWHERE),
    "external pipe": (external("pipe"), "{}: " + ELSEWHERE),
    "virtual": (virtual("secret"), "{}: " + ELSEWHERE),
    "virtual pipe": (virtual("pipe"), "{}: " + ELSEWHERE),
    "external link": (link(h5py.ExternalLink("secret", "/x")), "{}: is a link to another file, which is not followed"),
    "soft link": (link(h5py.SoftLink("/other")), "{}: is a link to another name, which is not followed"),
    "hard link": (lambda file, name: file.__setitem__("zz", file[name]), "{}: has 2 names in the file; it must have one"),
    "circle": (lambda file, name: file.__setitem__("zz", file["/"]), "/zz: has 2 names in the file; it must have one"),
    "missing": (lambda file, name: file.__delitem__(name), "a dataset along this scale is missing"),
    "endless": (replace(lambda file, name, shape, dtype: file.create_dataset(name, (2**40, *shape[1:]), dtype, chunks=(99, *shape[1:]))), "do not fit into a file of"),
    "hole": (replace(lambda file, name, shape, dtype: file.create_dataset(name, shape, dtype, chunks=shape)), "damaged: {}: data are missing"),
    "texts": (replace(lambda file, name, shape, dtype: file.create_dataset(name, data=np.full(shape, b"1"))), "missing|{}: has no form"),
    "scalar": (replace(lambda file, name, shape, dtype: file.create_dataset(name, data=1.0)), "missing|{}: has no form"),
}


@pytest.mark.parametrize("name", ["run.h5:/q", "run.h5:/points/E/r", "runs.h5:/final/b_z", "runs.h5:/cases/m", "runs.h5:/cpu_s"])
def test_one_gate_for_every_file(made, tmp_path, name):
    kind, dataset = name.split(":")
    path = tmp_path / kind
    os.mkfifo(tmp_path / "pipe")
    with h5py.File(tmp_path / "secret", "w") as file:
        file["x"] = np.ones((6, 3))
    for how, fact in WRONG.values():
        shutil.copy(made / kind, path)
        with h5py.File(path, "r+") as file:
            how(file, dataset)
        for arguments in commands(kind, path, tmp_path):
            said = refused(arguments, path)
            assert any(part.format(dataset) in said for part in fact.split("|")), said


def write(place, value):
    def how(file, name):
        file[name][place] = value
    return how


def drop(file, name):
    del file[name]


def unname(file, name):
    del file[name].attrs["columns"]


@pytest.mark.parametrize("name, how, fact", [
    ("t", write(2, np.nan), "t: row 2 has no finite number"),
    ("t", write(2, 0.01), "t: row 2 is at 0.01 s, before the row above it at 0.02 s"),
    ("q", write((3, 0), np.inf), "b_z: row 3 has no finite number"),
    ("qd", write((0, 0), np.nan), "b_z_d: row 0 has no finite number"),
    ("energy", write(5, -np.inf), "energy: row 5 has no finite number"),
    ("t", drop, "the scale of an axis is missing"),
    ("qd", drop, "a dataset along this scale is missing"),
    ("q", unname, "/q: does not have the form of a motion as refdyn sim writes it"),
    ("t", unname, "/t: does not have the form of a motion as refdyn sim writes it")])
def test_a_motion_is_whole_and_finite(made, tmp_path, name, how, fact):
    path = shutil.copy(made / "run.h5", tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        how(file, name)
    for arguments in commands("run.h5", path, tmp_path):
        assert fact in refused(arguments, path)


def test_parameters_of_a_motion_are_finite(made, tmp_path):
    path = shutil.copy(made / "run.h5", tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        file["parameters"].attrs["m"] = np.nan
    assert refused(["view", path, "-o", tmp_path / "x.html"], path) == "/parameters: m is nan; must be finite"


@pytest.mark.parametrize("name, how, fact, which", [
    ("case", drop, "the scale of an axis is missing", "plot merge sim"),
    ("cases", drop, "a dataset along this scale is missing", "plot merge sim"),
    ("status", drop, "a dataset along this scale is missing", "plot merge sim"),
    ("history/t", drop, "/history/b_z: the scale of an axis is missing", "plot merge sim"),
    ("extremes/which", drop, "/extremes/b_z: the scale of an axis is missing", "plot merge sim"),
    ("history/t", write(1, np.nan), "/history/t: entry 1 is nan; entries must be finite and ascend", "plot merge sim"),
    ("status", write(1, 7), "/status: row 1 has 7; must be 0, 1 or 3", "plot merge"),
    ("steps", write(1, -7), "/steps: row 1 has -7; must be a number of steps", "plot merge"),
    ("cases/m", write(1, np.nan), "m: value nan; must be finite", "sim"),
    ("cases/b_z", write(1, -np.inf), "b_z: value -inf; must be finite", "sim"),
    ("cases/m", lambda file, name: file[name].attrs.__delitem__("kind"), "/cases/m: does not have the form of a file of runs", "plot merge sim"),
    ("/", lambda file, name: file.attrs.__setitem__("model", file.attrs["model"].replace("9.81", "1.62")),
     "damaged: attribute model does not match model_hash", "sim")])
def test_a_batch_is_whole(made, tmp_path, name, how, fact, which):
    path = shutil.copy(made / "runs.h5", tmp_path / "runs.h5")
    with h5py.File(path, "r+") as file:
        how(file, name)
    for arguments in commands("runs.h5", path, tmp_path):
        if arguments[0] in which.split():
            assert fact in refused(arguments, path)


def test_what_is_packed_or_has_texts_of_fixed_length_is_read(made, tmp_path):
    path = shutil.copy(made / "runs.h5", tmp_path / "runs.h5")
    def pack(file, name, shape, dtype):
        file.create_dataset(name, data=np.arange(6.0), compression="gzip", shuffle=True, fletcher32=True)
    with h5py.File(path, "r+") as file:
        replace(pack)(file, "final/b_z")
        file["case"].attrs.__delitem__("REFERENCE_LIST")
        replace(lambda file, name, shape, dtype: file.create_dataset(name, data=np.array([b"", b"a", b"why", b"", b"", b"b"])))(file, "reason")
        file.attrs["command"] = np.bytes_("refdyn")
    refdyn("merge", path, "-o", tmp_path / "x.h5")
    with h5py.File(tmp_path / "x.h5") as file:
        assert list(file["final/b_z"]) == list(range(6)) and list(file["reason"].asstr()) == ["", "a", "why", "", "", "b"]


def test_resume_does_not_trust_a_damaged_result(made, tmp_path):
    for name in ("fall.lua", "sweep.lua"):
        shutil.copy(made / name, tmp_path / name)
    damaged = bytearray((made / "runs.h5").read_bytes())
    damaged[-3000:-1000] = bytes(2000)
    (tmp_path / "runs.h5").write_bytes(damaged)
    done = refdyn("batch", "fall.lua", "sweep.lua", "-o", "runs.h5", "--resume", cwd=tmp_path, status=1)
    assert "runs.h5: " in done.stderr and (tmp_path / "runs.h5").read_bytes() == damaged


# ---- Damage ----

def heaps(data):
    """Positions of the lengths of texts in the heaps of a file (HDF5's format, III.E)."""
    for heap in [at for at in range(len(data)) if data[at:at + 4] == b"GCOL"]:
        at, end = heap + 16, heap + struct.unpack_from("<Q", data, heap + 8)[0]
        while at + 16 <= min(end, len(data)) and struct.unpack_from("<H", data, at)[0]:
            yield at + 8
            at += 16 + -(-struct.unpack_from("<Q", data, at + 8)[0] // 8) * 8


def try_damaged(data, kind, arguments, path):
    """The command succeeds, or refuses the file with one message; it neither crashes nor hangs."""
    path.write_bytes(data)
    arguments[-1].write_text("kept")
    done = subprocess.run([REFDYN, *map(str, arguments)], capture_output=True, timeout=60)
    assert done.returncode in (0, 1), (arguments[0], done)
    if done.returncode == 1:
        assert done.stderr.count(b"\n") == 1 and arguments[-1].read_text() == "kept", (arguments[0], done)
    return done.returncode


@pytest.mark.parametrize("kind", ["run.h5", "runs.h5"])
def test_damaged_lengths_of_texts(made, tmp_path, kind):
    data, rng = (made / kind).read_bytes(), random.Random(kind)
    places = list(heaps(data))
    assert len(places) > 10
    tried = [(place, length) for place in (places if LONG else rng.sample(places, 6)) for length in (0x7fff, 2**32 - 1, 2**63)]
    tried += [(place, 0) for place in (places if LONG else rng.sample(places, 2))]  # HDF5 may look for the next one forever
    answers = []
    for place, length in tried:
        damaged = bytearray(data)
        struct.pack_into("<Q", damaged, place, length)
        arguments = rng.choice(commands(kind, tmp_path / kind, tmp_path))
        answers.append(try_damaged(damaged, kind, arguments, tmp_path / kind))
    assert sum(answers) > len(answers) / 2


def spoil(data, rng):
    if rng.random() < 0.1:
        return data[:rng.randrange(len(data))]
    spoiled = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 4, 16])):
        at = rng.randrange(len(data))
        spoiled[at] = rng.choice([0, 255, rng.randrange(256), spoiled[at] ^ 1 << rng.randrange(8)])
    return spoiled


@pytest.mark.parametrize("kind", ["run.h5", "runs.h5"])
def test_bytes_changed_at_random(made, tmp_path, kind):
    data, rng = (made / kind).read_bytes(), random.Random(7)
    answers = [try_damaged(spoil(data, rng), kind, rng.choice(commands(kind, tmp_path / kind, tmp_path)), tmp_path / kind)
               for _ in range(3000 if LONG else 50)]
    assert 0 < sum(answers) < len(answers)


# ---- Names ----

COURSES = 'courses = function(s) return { ["a/b"] = s.t, ["."] = s.t, z = s.t, ["z/L"] = s.t, t = s.t, [".."] = s.t, Z = s.t } end'


def test_names_of_courses_before_a_motion(tmp_path):
    (tmp_path / "fall.lua").write_text(MODEL % COURSES)
    said = refdyn("sim", "fall.lua", "--until", "0.1", "-o", "x.h5", cwd=tmp_path, status=1).stderr.splitlines()
    slash, dot = "HDF5 reserves a slash for groups", "HDF5 reserves a dot for the group itself"
    assert said == [f"fall.lua:4: courses: '{name}': {why}; rename the course, or write a CSV"
                    for name, why in ((".", dot), ("a/b", slash), ("z/L", slash))]
    assert [path.name for path in tmp_path.iterdir()] == ["fall.lua"]
    refdyn("sim", "fall.lua", "--until", "0.1", "-o", "x.csv", cwd=tmp_path)
    (tmp_path / "fall.lua").write_text(MODEL % COURSES.replace('["a/b"] = s.t, ["."] = s.t, ', "").replace("z/L", "z per L"))
    refdyn("sim", "fall.lua", "--until", "0.1", "-o", "x.h5", cwd=tmp_path)
    refdyn("plot", "x.h5", "-o", "x.svg", cwd=tmp_path)


@pytest.mark.parametrize("keep, why", [
    ('history = { "t" }', "keep.history: 't': an HDF5 file has its axis /history/t under this name"),
    ('extremes = { "b_z", "which" }', "keep.extremes: 'which': an HDF5 file has its axis /extremes/which under this name"),
    ('extremes = { "a/b" }', "keep.extremes: 'a/b': HDF5 reserves a slash for groups"),
    ('norms = { "." }', "keep.norms: '.': HDF5 reserves a dot for the group itself"),
    ('history = { "z", "z/L" }', "keep.history: 'z/L': HDF5 reserves a slash for groups")])
def test_names_to_keep_before_a_batch(tmp_path, keep, why):
    (tmp_path / "fall.lua").write_text(MODEL % COURSES)
    (tmp_path / "sweep.lua").write_text(SWEEP.replace('history = { "b_z" }', keep).replace('extremes = { "b_z" }, extremes', "extremes"))
    for more in (["-o", "x.h5"], ["-o", "x.h5", "--resume"], ["--dry-run"]):
        said = refdyn("batch", "fall.lua", "sweep.lua", *more, cwd=tmp_path, status=1).stderr
        assert said == f"sweep.lua:3: {why}; leave it out, or rename the column\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fall.lua", "sweep.lua"]


def test_names_that_fit_are_kept(tmp_path):
    (tmp_path / "fall.lua").write_text(MODEL % COURSES)
    (tmp_path / "sweep.lua").write_text(SWEEP.replace('history = { "b_z" }', 'history = { "which", "Z", "z", ".." }, norms = { "which", "t" }'))
    refdyn("batch", "fall.lua", "sweep.lua", "-o", "x.h5", cwd=tmp_path)
    refdyn("merge", "x.h5", "-o", "y.h5", cwd=tmp_path)
    with h5py.File(tmp_path / "y.h5") as file:
        assert sorted(file["history"]) == ["..", "Z", "t", "which", "z"] and sorted(file["norms"]) == ["t", "which"]


def test_columns_of_one_name_in_a_table_of_runs(tmp_path):
    (tmp_path / "fall.lua").write_text((MODEL % "").replace('"m", 1', '"status", 1').replace("p.m", "p.status"))
    (tmp_path / "sweep.lua").write_text(SWEEP.replace("m =", "status =").replace(', history = { "b_z" }', ""))
    said = refdyn("batch", "fall.lua", "sweep.lua", "-o", "x.csv", cwd=tmp_path, status=2).stderr
    assert "-o x.csv: two columns would have the name status; write a file RUNS.h5, which has groups" in said
    refdyn("batch", "fall.lua", "sweep.lua", "-o", "x.h5", cwd=tmp_path)
