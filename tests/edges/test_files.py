"""Files that are written and files that are trusted: an unwritable output is reported before anything is computed, and no data are lost."""
import fcntl
import hashlib
import json
import os
import re
import shutil
import stat
import subprocess
import tempfile
import time

import pytest

from harm import files_in
from program import MODELS, REFDYN, REFERENCE, SOURCE, TESTS, evaluate, read_run, refdyn

PENDULUM = TESTS / "models" / "double_pendulum.lua"
BRANCHED = MODELS / "branched.lua"
IS_ROOT = os.geteuid() == 0
OTHER = 54321  # a user that does not exist
SOON, NEVER = "0.05", "1e5"  # [s] a motion that ends at once, and a long one


@pytest.fixture(autouse=True)
def default_compiler(monkeypatch):
    """The cache is compiled by `cc`, because tcc refuses some names of folders."""
    monkeypatch.delenv("CC", raising=False)


def run(*arguments, **keywords):
    keywords.setdefault("stderr", subprocess.PIPE)
    return subprocess.run([REFDYN, *map(str, arguments)], text=True, timeout=100, **keywords)


# ---- The standard descriptors ----

DESCRIPTORS = [(0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)]


def without(closed):
    return lambda: [os.close(descriptor) for descriptor in closed]


@pytest.mark.parametrize("closed", DESCRIPTORS, ids=str)
def test_closed_descriptors(closed, tmp_path):
    """Messages do not go into a result whose file got the number of a closed descriptor."""
    model = tmp_path / "off.lua"
    model.write_text(REFERENCE.read_text())
    arguments = ["sim", model, "--set", "n_rfe=1", "--set", "program=chapter", "--until", SOON, "--step", "1e-3", "-o"]
    said = run(*arguments, tmp_path / "open.csv")
    assert "warning: the start is off the programme" in said.stderr
    done = subprocess.run([REFDYN, *map(str, arguments), tmp_path / "run.csv", "--summary", tmp_path / "run.json"], preexec_fn=without(closed),
                          close_fds=False)
    assert done.returncode == 0 and (tmp_path / "run.csv").read_bytes() == (tmp_path / "open.csv").read_bytes()
    assert json.loads((tmp_path / "run.json").read_text())["method"] == "rk4"
    done = subprocess.run([REFDYN, "plot", tmp_path / "run.csv", "-o", tmp_path / "run.svg"], preexec_fn=without(closed), close_fds=False)
    assert done.returncode == 0 and (tmp_path / "run.svg").read_text().rstrip().endswith("</svg>")
    done = subprocess.run([REFDYN, "gen", PENDULUM, "-o", tmp_path / "out"], preexec_fn=without(closed), close_fds=False)
    assert done.returncode == (1 if 1 in closed else 0) and (tmp_path / "out" / "double_pendulum.c").exists()


TO_STDOUT = {"eval": [PENDULUM], "statics": [PENDULUM], "modes": [PENDULUM], "check": [PENDULUM], "sim": [PENDULUM, "--until", SOON],
             "bench": [PENDULUM, "--emit", "M"], "--help": [], "--version": [], "plot": ["--help"]}


@pytest.mark.parametrize("command", TO_STDOUT)
@pytest.mark.parametrize("how", ["closed", "full", "read only"])
def test_results_that_cannot_go_out(how, command):
    if how == "closed":
        done = run(command, *TO_STDOUT[command], preexec_fn=without((1,)), close_fds=False)
    else:
        with open("/dev/full" if how == "full" else "/dev/null", "w" if how == "full" else "r") as file:
            done = run(command, *TO_STDOUT[command], stdout=file)
    assert done.returncode == 1 and "stdout: output: " in done.stderr, done


@pytest.mark.parametrize("command", [["eval"], ["sim", "--until", SOON], ["bench", "--emit", "M"], ["statics"], ["modes"]], ids=lambda words: words[0])
def test_full_device(command):
    done = run(command[0], PENDULUM, *command[1:], "-o", "/dev/full")
    assert done.returncode == 1 and "/dev/full: output: not all could be written: No space left on device" in done.stderr


def test_a_motion_ends_where_it_cannot_be_written():
    """Not hours later, at its end."""
    started = time.monotonic()
    done = run("sim", PENDULUM, "--until", NEVER, "--every", "1e-2", "-o", "/dev/full")
    assert done.returncode == 1 and time.monotonic() - started < 60
    assert re.search(r"could no longer be written at t = [0-9.]+ s", done.stderr), done.stderr


# ---- One file, two programs ----

WRITERS = {
    "sim": (["sim", PENDULUM, "--until", SOON, "-o", "run.csv"], "run.csv"), "summary": (["sim", PENDULUM, "--until", SOON, "-o", "run.csv", "--summary", "s.json"], "s.json"),
    "eval": (["eval", PENDULUM, "-o", "e.json"], "e.json"), "statics": (["statics", PENDULUM, "-o", "e.json"], "e.json"),
    "modes": (["modes", PENDULUM, "-o", "e.json"], "e.json"), "bench": (["bench", PENDULUM, "--emit", "M", "-o", "e.json"], "e.json"),
    "plot": (["plot", "given.csv", "-o", "f.svg"], "f.svg"), "gen": (["gen", PENDULUM, "-o", "."], "double_pendulum.h"),
    "report": (["report", PENDULUM, "--until", SOON, "--methods", "rk4", "--steps", "1e-2", "--seconds", "5", "-o", "."], "double_pendulum.html"),
    "link": (["eval", PENDULUM, "-o", "link.json"], "e.json"),
}


@pytest.mark.parametrize("which", WRITERS)
def test_another_program_writes_it(which, tmp_path):
    """A file that another program writes is refused; leftovers of a killed program do not prevent writing."""
    arguments, name = WRITERS[which]
    (tmp_path / "given.csv").write_text("t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n")
    (tmp_path / "link.json").symlink_to("e.json")
    part = tmp_path / f"{name}.part"
    with open(part, "w") as file:
        file.write("begun")
        file.flush()
        fcntl.flock(file, fcntl.LOCK_EX)
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 1 and "another refdyn is writing this file" in done.stderr, done.stderr
        assert part.read_text() == "begun" and not (tmp_path / name).exists()
        assert {path for path in files_in(tmp_path) if path.endswith(".part")} == {part.name}
    assert run(*arguments, cwd=tmp_path).returncode == 0
    assert (tmp_path / name).exists() and not part.exists() and (tmp_path / "link.json").is_symlink()


def start_motion(folder, name="run.csv", *more):
    """Starts a motion that takes hours; returns when it has written rows."""
    process = subprocess.Popen([REFDYN, "sim", PENDULUM, "--until", NEVER, "--every", "2e-2", "--tol", "1e-10", "-o", name, *more], cwd=folder, stderr=subprocess.PIPE,
                               text=True)
    part, end = folder / f"{name}.part", time.monotonic() + 60
    while time.monotonic() < end and not (part.exists() and part.stat().st_size > 10000):
        time.sleep(0.01)
    return process


def test_two_motions(tmp_path):
    first = start_motion(tmp_path)
    try:
        for name in ("run.csv", "./run.csv", tmp_path / "run.csv"):
            done = run("sim", PENDULUM, "--until", SOON, "-o", name, cwd=tmp_path)
            assert done.returncode == 1 and "another refdyn is writing this file" in done.stderr
        assert first.poll() is None
    finally:
        first.kill()
        first.communicate()
    assert run("sim", PENDULUM, "--until", SOON, "-o", "run.csv", cwd=tmp_path).returncode == 0
    assert files_in(tmp_path) == ["run.csv"] and len(read_run(tmp_path / "run.csv")["t"]) == 201


# ---- Files that are read, and other outputs ----

def spoil_cases():
    """Arguments whose output is one of their input files, or a file that the model requires."""
    state, inputs = ["--from", "state.csv"], ["--inputs", "inputs.csv"]
    sim = ["sim", "model.lua", "--until", NEVER]
    ways = {"": "{}", "dot": "./{}", "above": "folder/../{}", "link": "link_{}", "hard": "hard_{}"}
    for way, form in ways.items():
        for what, name, arguments in (("model", "model.lua", sim), ("state", "state.csv", sim + state), ("inputs", "inputs.csv", sim + inputs),
                                      ("required", "shape.lua", sim)):
            yield f"{what} {way}", arguments + ["-o", form.format(name)], name
        yield f"summary {way}", sim + ["-o", "run.csv", "--summary", form.format("model.lua")], "model.lua"
    for command in ("eval", "statics", "modes", "bench"):
        yield f"{command} model", [command, "model.lua", "-o", "model.lua"], "model.lua"
    yield "eval state", ["eval", "model.lua", "--state", "state.json", "-o", "state.json"], "state.json"
    yield "modes state", ["modes", "model.lua", "--at", "state.json", "-o", "link_state.json"], "state.json"
    yield "plot run", ["plot", "given.svg", "-o", "given.svg"], "given.svg"
    yield "plot second run", ["plot", "inputs.csv", "given.svg", "-o", "hard_given.svg"], "given.svg"
    yield "plot units", ["plot", "inputs.csv", "--units", "given.svg", "-o", "link_given.svg"], "given.svg"
    yield "part", sim + ["-o", "partly", "--from", "partly.part"], "partly.part"
    yield "gen", ["gen", "cart.c", "-o", "."], "cart.c"
    yield "report", ["report", "model.lua", "--until", "1", "--from", "cart.csv", "-o", "."], "cart.csv"


SPOIL = {name: rest for name, *rest in spoil_cases()}
CART = """local rd = require "refdyn"
local shape = require "shape"
rd.input("push", 0, "N")
return rd.model { name = "cart", links = { { "cart", joint = "x", mass = shape.mass } }, forces = function(s) return { cart_x = s.inputs.push } end }
"""


@pytest.fixture
def project(tmp_path):
    folder = tmp_path / "project"
    (folder / "folder").mkdir(parents=True)
    texts = {"model.lua": CART, "cart.c": CART, "shape.lua": "return { mass = 2 }\n", "state.json": '{"q": [1]}', "state.csv": '{"q": [1]}', "partly.part": '{"q": [1]}',
             "cart.csv": '{"q": [1]}', "inputs.csv": "t,push\n0,1\n", "given.svg": "t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n"}
    for name, text in texts.items():
        (folder / name).write_text(text)
        (folder / f"link_{name}").symlink_to(name)
        os.link(folder / name, folder / f"hard_{name}")
    return folder


@pytest.mark.parametrize("which", SPOIL)
def test_no_output_is_a_file_that_is_read(which, project, tmp_path):
    arguments, name = SPOIL[which]
    before = {path: (project / path).read_bytes() for path in files_in(project)}
    done = run(*arguments, cwd=project, env={**os.environ, "REFDYN_CACHE": str(tmp_path / "cache")})
    assert done.returncode == 1 and re.search(r": output: .* is the file .*, which this command also reads or writes", done.stderr), done.stderr
    assert {path: (project / path).read_bytes() for path in files_in(project)} == before
    assert not (tmp_path / "cache").exists(), "something was compiled"


@pytest.mark.parametrize("names", [("a", "a"), ("a", "./a"), ("a", "folder/../a"), ("a", "link_a"), ("link_a", "a"), ("a", "a.part"), ("a.part", "a"),
                                   ("here", "hard_here")], ids=" ".join)
def test_two_outputs_are_two_files(names, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link_a").symlink_to("a")
    (tmp_path / "here").write_text("here")
    os.link(tmp_path / "here", tmp_path / "hard_here")
    before = sorted(path.name for path in tmp_path.iterdir())
    done = run("sim", PENDULUM, "--until", NEVER, "-o", names[0], "--summary", names[1], cwd=tmp_path)
    assert done.returncode == 1 and "output: " in done.stderr, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_a_link_stays_a_link(tmp_path):
    """Also a link to a missing file, or through another link."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("folder/c")
    for _ in range(2):
        refdyn("eval", PENDULUM, "-o", tmp_path / "a")
        assert (tmp_path / "a").is_symlink() and (tmp_path / "b").is_symlink() and json.loads((tmp_path / "folder" / "c").read_text())
        assert files_in(tmp_path) == ["a", "b", "folder/c"]
    (tmp_path / "x").symlink_to("y")
    (tmp_path / "y").symlink_to("x")
    assert "the link cannot be followed" in run("eval", PENDULUM, "-o", tmp_path / "x").stderr


def as_owner(path, owner):
    if owner != os.geteuid():
        os.chown(path, owner, owner, follow_symlinks=False)


@pytest.mark.parametrize("through", ["itself", "a link to it", "a folder", "its part", "a hard link of its part"])
@pytest.mark.parametrize("is_ours", [True, False], ids=["ours", "of another user"])
def test_links_of_other_users(is_ours, through, tmp_path):
    """In a folder of all users, a link leads where its owner wants. Root follows it no more than others do."""
    if not IS_ROOT:
        pytest.skip("needs files of two users")
    common, private = tmp_path / "common", tmp_path / "private"
    common.mkdir()
    private.mkdir()
    common.chmod(0o1777)
    victim = private / "victim"
    victim.write_text("kept")
    owner = os.geteuid() if is_ours else OTHER
    name = common / "x"
    if through == "a folder":
        (common / "folder").symlink_to(private)
        as_owner(common / "folder", owner)
        name = common / "folder" / "victim"
    elif "part" in through:
        part = common / "x.part"
        os.link(victim, part) if "hard" in through else part.symlink_to(victim)
    else:
        name.symlink_to(victim)
        as_owner(name, owner)
        if through == "a link to it":
            name = tmp_path / "ours"
            name.symlink_to(common / "x")
    done = run("eval", PENDULUM, "-o", name)
    is_followed = is_ours and "part" not in through
    assert done.returncode == (0 if is_followed else 1) and (victim.read_text() == "kept") == (not is_followed), done.stderr
    assert is_followed or "link of another user" in done.stderr or "NAME.part exists" in done.stderr or "Too many levels" in done.stderr
    assert not files_in(private) or files_in(private) == ["victim"]


@pytest.mark.parametrize("name", ["z.start.json", "z.csv", "z.json"])
def test_links_in_place_of_files_that_a_motion_adds(name, tmp_path):
    """Also under a name that follows from that of the output. This is reported before the work."""
    if not IS_ROOT:
        pytest.skip("needs files of two users")
    tmp_path.chmod(0o1777)
    (tmp_path / name).symlink_to(tmp_path / "elsewhere")
    as_owner(tmp_path / name, OTHER)
    done = run("sim", SOURCE / "docs" / "drives" / "hub_link.lua", "--realise", "--until", "1", "-o", "z.csv", "--summary", "z.json", cwd=tmp_path)
    assert done.returncode == 1 and f"{name}: output: is or passes through a link of another user" in done.stderr
    assert sorted(os.listdir(tmp_path)) == [name]


def test_a_motion_that_goes_to_a_device_adds_no_file(tmp_path):
    done = run("sim", SOURCE / "docs" / "drives" / "hub_link.lua", "--realise", "--until", "1", "-o", "/dev/null", cwd=tmp_path)
    assert done.returncode == 0 and not os.path.exists("/dev/null.start.json"), done.stderr


def test_a_named_pipe_is_no_output(tmp_path):
    """A shell's own pipe is one, under its name in /dev."""
    os.mkfifo(tmp_path / "pipe")
    done = run("eval", PENDULUM, "-o", tmp_path / "pipe")
    assert done.returncode == 1 and "is a named pipe" in done.stderr
    done = subprocess.run(["bash", "-c", f"{REFDYN} eval {PENDULUM} -o >(cat)"], capture_output=True, text=True)
    assert done.returncode == 0 and json.loads(done.stdout)


# ---- Unwritable targets ----

TARGETS = {"no/such/folder/x": "No such file", "folder": "is a folder", "folder/": "is a folder", ".": "is a folder",
           "file/x": "Not a directory", "n" * 300: "File name too long", "no/": "No such file"}
LONG = {"sim": ["sim", PENDULUM, "--until", NEVER, "-o"], "summary": ["sim", PENDULUM, "--until", NEVER, "-o", "run.csv", "--summary"],
        "eval": ["eval", PENDULUM, "-o"], "statics": ["statics", PENDULUM, "-o"], "modes": ["modes", PENDULUM, "-o"], "bench": ["bench", PENDULUM, "-o"],
        "plot": ["plot", "given.csv", "-o"]}
NAMED = ["no/such/folder/x", "n" * 300]  # to which a suffix can be added, as plot needs one


@pytest.mark.parametrize("target", TARGETS, ids=lambda name: name[:12])
@pytest.mark.parametrize("command", LONG)
def test_said_before_the_work(command, target, tmp_path):
    work = tmp_path / "work"
    (work / "folder").mkdir(parents=True)
    (work / "file").write_text("")
    (work / "given.csv").write_text("t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n")
    if command == "plot" and target not in NAMED:
        pytest.skip("has no suffix")
    done = run(*LONG[command], target + (".svg" if command == "plot" else ""), cwd=work, env={**os.environ, "REFDYN_CACHE": str(tmp_path / "cache")})
    assert done.returncode == 1 and ": output: " in done.stderr and TARGETS[target] in done.stderr, done.stderr
    assert files_in(work) == ["file", "given.csv"] and not (tmp_path / "cache").exists()


@pytest.mark.parametrize("command", [["gen", PENDULUM], ["report", PENDULUM, "--until", "1"]], ids=lambda words: words[0])
@pytest.mark.parametrize("target", ["file", "file/x"], ids=["file", "below"])
def test_folders_that_cannot_be_made(command, target, tmp_path):
    (tmp_path / "file").write_text("")
    done = run(*command, "-o", target, cwd=tmp_path)
    assert done.returncode == 1 and ": output: the folder cannot be made: " in done.stderr, done.stderr


@pytest.mark.parametrize("command", [*LONG.values(), ["gen", PENDULUM, "-o"], ["report", PENDULUM, "--until", "1", "-o"]], ids=lambda words: words[0])
def test_a_target_without_a_name_is_wrong_usage(command, tmp_path):
    done = run(*command, "", cwd=tmp_path)
    assert done.returncode == 2 and ": the value is empty\n  -" in done.stderr and not files_in(tmp_path)


def as_other():
    """Runs in a child process as another user, if this one has all rights."""
    if IS_ROOT:
        os.setgroups([])
        os.setgid(OTHER)
        os.setuid(OTHER)


@pytest.fixture
def ours(tmp_path_factory):
    """A folder that as_other owns, in a folder that it may enter."""
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        os.chmod(folder, 0o755)
        mine = os.path.join(folder, "mine")
        os.mkdir(mine)
        shutil.copy(REFDYN, folder)
        shutil.copy(PENDULUM, mine)
        if IS_ROOT:
            os.chown(mine, OTHER, OTHER)
        yield type(PENDULUM)(mine)


def run_as_other(folder, *arguments, env=None):
    return subprocess.run([folder.parent / "refdyn", *map(str, arguments)], cwd=folder, text=True, capture_output=True, preexec_fn=as_other,
                          timeout=100, env={**os.environ, "REFDYN_CACHE": str(folder / "cache"), "HOME": str(folder), **(env or {})})


@pytest.mark.parametrize("background", ["0", "1"])
def test_cache_that_may_only_be_read(background, ours):
    """Libraries in it are loaded. A model that it lacks is refused with the reason."""
    env = {"REFDYN_BACKGROUND": background}
    assert run_as_other(ours, "eval", PENDULUM.name, env=env).returncode == 0
    (ours / "cache").chmod(0o500)
    files = files_in(ours / "cache")
    assert run_as_other(ours, "eval", PENDULUM.name, env=env).returncode == 0
    done = run_as_other(ours, "eval", PENDULUM.name, "--accelerations", "dense", env=env)
    assert done.returncode == 1 and done.stderr == f"refdyn: {ours}/cache: cannot make a temporary folder: Permission denied\n", done.stderr
    assert files_in(ours / "cache") == files and len(files) == 1


@pytest.mark.parametrize("command", [["eval", "-o"], ["sim", "--until", NEVER, "-o"], ["sim", "--until", NEVER, "-o", "run.csv", "--summary"],
                                     ["gen", "-o"], ["report", "--until", "1", "-o"]], ids=" ".join)
@pytest.mark.parametrize("what", ["folder", "file"])
def test_what_may_not_be_written(what, command, ours):
    """A folder, and a file in a writable folder."""
    if what == "file" and command[0] in ("gen", "report"):
        pytest.skip("takes a folder")
    folder = ours / "closed"
    folder.mkdir()
    (folder / "x").write_text("kept")
    if IS_ROOT:
        os.chown(folder, OTHER, OTHER)
    os.chmod(folder / "x", 0o444)
    os.chmod(folder, 0o555 if what == "folder" else 0o755)
    done = run_as_other(ours, command[0], "double_pendulum.lua", *command[1:], "closed" if command[0] in ("gen", "report") else "closed/x")
    assert done.returncode == 1 and "ermission denied" in done.stderr and ": output: " in done.stderr, done.stderr
    assert (folder / "x").read_text() == "kept" and not (ours / "cache").exists()
    os.chmod(folder, 0o755)


def test_a_file_of_another_user_in_a_common_folder(ours):
    if not IS_ROOT:
        pytest.skip("needs files of two users")
    common = ours / "common"
    common.mkdir()
    (common / "x").write_text("kept")
    os.chmod(common, 0o1777)
    os.chmod(common / "x", 0o666)
    done = run_as_other(ours, "eval", "double_pendulum.lua", "-o", "common/x")
    assert done.returncode == 1 and "is another user's" in done.stderr and (common / "x").read_text() == "kept"


FULL = """
set -e
mkdir mnt && mount -t tmpfs -o size=64k none mnt
head -c 1M /dev/zero >mnt/all 2>/dev/null || true
"$@"
"""


def test_a_disk_that_is_full_is_said_before(tmp_path):
    """Where a user may mount a file system."""
    tried = subprocess.run(["unshare", "-m", "sh", "-c", FULL.replace('"$@"', "true")], cwd=tmp_path, capture_output=True)
    if tried.returncode != 0:
        pytest.skip("no file system may be mounted here")
    shutil.rmtree(tmp_path / "mnt")
    done = subprocess.run(["unshare", "-m", "sh", "-c", FULL, "-", REFDYN, "sim", PENDULUM, "--until", NEVER, "-o", "mnt/run.csv"], cwd=tmp_path,
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "run.csv.part: output: cannot be written: No space left on device" in done.stderr, done.stderr


def test_a_disk_that_fills_while_code_is_written(tmp_path):
    """An error is reported, and the files of the model are written all or not at all."""
    small = FULL.replace("head -c 1M /dev/zero >mnt/all 2>/dev/null || true\n", "").replace('"$@"', '"$@" || status=$?; find mnt; exit $status')
    tried = subprocess.run(["unshare", "-m", "sh", "-c", FULL.replace('"$@"', "true")], cwd=tmp_path, capture_output=True)
    if tried.returncode != 0:
        pytest.skip("no file system may be mounted here")
    shutil.rmtree(tmp_path / "mnt")
    done = subprocess.run(["unshare", "-m", "sh", "-c", small, "-", REFDYN, "gen", REFERENCE, "-o", "mnt/code"], cwd=tmp_path, capture_output=True,
                          text=True, timeout=60)
    assert done.returncode == 1 and re.search(r"\.c\.part: output: not all could be written: No space left on device", done.stderr), done.stderr
    assert done.stdout.split() == ["mnt"]


# ---- The cache ----

def library_of(cache):
    [path] = cache.glob("*.so")
    return path


SPOILS = {
    "empty": lambda data: b"", "one byte": lambda data: data[:1], "header": lambda data: data[:64], "half": lambda data: data[:len(data) // 2],
    "a page": lambda data: data[:4096], "without its end": lambda data: data[:-1], "zeros": lambda data: bytes(len(data)),
    "garbage": lambda data: data[:64] + os.urandom(len(data) - 64), "one bit": lambda data: data[:5000] + bytes([data[5000] ^ 1]) + data[5001:],
    "longer": lambda data: data + b"\0", "no library": lambda data: b"no library", "a script": lambda data: b"GROUP ( /lib/x )\n",
}


@pytest.mark.parametrize("how", SPOILS)
def test_spoiled_libraries_are_built_again(how, tmp_path):
    env = {"REFDYN_CACHE": str(tmp_path)}
    first = evaluate(PENDULUM, None, env=env)
    path = library_of(tmp_path)
    whole = path.read_bytes()
    path.unlink()
    path.write_bytes(SPOILS[how](whole))
    assert evaluate(PENDULUM, None, env=env) == first
    assert evaluate(PENDULUM, None, env={**env, "CC": "cc"}) == first and files_in(tmp_path) == [path.name]


@pytest.mark.parametrize("what", ["link", "pipe", "unreadable", "folder", "writable"])
def test_what_is_no_plain_library(what, tmp_path):
    cache, elsewhere = tmp_path / "cache", tmp_path / "elsewhere.so"
    first = evaluate(PENDULUM, None, env={"REFDYN_CACHE": str(cache)})
    path = library_of(cache)
    path.rename(elsewhere)
    if what == "link":
        path.symlink_to(elsewhere)
    elif what == "pipe":
        os.mkfifo(path)
    elif what == "folder":
        path.mkdir()
    else:
        shutil.copy(elsewhere, path)
        path.chmod(0 if what == "unreadable" else 0o777)
    done = refdyn("eval", PENDULUM, env={"REFDYN_CACHE": str(cache)}, status=1 if what == "folder" else 0, timeout=60)
    if what == "folder":
        assert "cannot be made: Is a directory" in done.stderr
    else:
        assert json.loads(done.stdout) == first
        if what != "unreadable" or not IS_ROOT:
            assert stat.S_ISREG(os.lstat(path).st_mode) and not os.lstat(path).st_mode & 0o022


def plant(path, canary):
    """A library of that name that runs code when it is loaded, sealed in the program's way."""
    source = path.parent / "planted.c"
    source.write_text(f'#include <fcntl.h>\n__attribute__((constructor)) static void act(void) {{ open("{canary}", O_CREAT | O_WRONLY, 0600); }}\n')
    subprocess.run(["cc", "-shared", "-fPIC", source, "-o", path], check=True)
    source.unlink()
    data = path.read_bytes()
    path.write_bytes(data + b"refdyn seal " + hashlib.sha256(data).hexdigest().encode() + b"\0")


def test_the_seal_is_what_the_program_takes(tmp_path):
    """A planted library of the same user would be loaded: only ownership protects against others."""
    evaluate(PENDULUM, None, env={"REFDYN_CACHE": str(tmp_path / "cache")})
    plant(library_of(tmp_path / "cache"), tmp_path / "canary")
    evaluate(PENDULUM, None, env={"REFDYN_CACHE": str(tmp_path / "cache")})
    assert (tmp_path / "canary").exists()


WHERE = {"own": lambda folder: {"REFDYN_CACHE": str(folder)}, "xdg": lambda folder: {"XDG_CACHE_HOME": str(folder.parent)},
         "home": lambda folder: {"HOME": str(folder.parent.parent)}, "temporary": lambda folder: {"TMPDIR": str(folder.parent)}}


def cache_of(where, tmp_path):
    """A cache folder determined in this way, and its environment."""
    name = {"home": "home/.cache/refdyn", "temporary": f"tmp/refdyn-{os.geteuid()}"}.get(where, "base/refdyn")
    folder = tmp_path / name
    (tmp_path / "other").mkdir(exist_ok=True)
    env = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME", "REFDYN_CACHE")}
    env.update({"TMPDIR": str(tmp_path / "other"), **WHERE[where](folder)})
    folder.parent.mkdir(parents=True, exist_ok=True)
    return folder, env


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("what", ["library", "folder"])
def test_libraries_of_another_user(what, where, tmp_path):
    """Neither a library nor a folder of another user is used."""
    if not IS_ROOT:
        pytest.skip("needs files of two users")
    folder, env = cache_of(where, tmp_path)
    first = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True)
    assert first.returncode == 0
    path = library_of(folder)
    plant(path, tmp_path / "canary")
    os.chown(path, OTHER, OTHER)
    if what == "folder":
        os.chown(folder, OTHER, OTHER)
    done = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True)
    assert not (tmp_path / "canary").exists()
    is_refused = what == "folder" and where in ("own", "temporary")
    assert done.returncode == (1 if is_refused else 0) and (is_refused or done.stdout == first.stdout)
    if what == "folder":
        assert b"belongs to another user" in done.stderr


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o770, 0o757, 0o1777], ids=oct)
def test_folders_that_others_may_write(mode, where, tmp_path):
    folder, env = cache_of(where, tmp_path)
    folder.mkdir()
    folder.chmod(mode)
    done = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True, text=True)
    assert done.returncode == (1 if where in ("own", "temporary") else 0) and "others may write there" in done.stderr
    assert not list(folder.iterdir())


@pytest.mark.parametrize("mode, is_taken", [(0o777, False), (0o1777, True), (0o755, True)])
def test_folders_above(mode, is_taken, tmp_path):
    """Where everybody may rename a folder, the cache could be exchanged; not with the sticky bit, as in /tmp."""
    above = tmp_path / "above"
    (above / "between").mkdir(parents=True)
    above.chmod(mode)
    (tmp_path / "link").symlink_to(above / "between")
    for folder in (above / "cache", above / "between" / "cache", tmp_path / "link" / "more"):
        done = run("eval", PENDULUM, env={**os.environ, "REFDYN_CACHE": str(folder)}, stdout=subprocess.PIPE)
        assert done.returncode == (0 if is_taken else 1) and is_taken == (done.stderr == ""), done.stderr
        assert is_taken or "everybody may rename folders in" in done.stderr


def test_a_link_in_place_of_the_temporary_folder(tmp_path):
    folder, env = cache_of("temporary", tmp_path)
    (tmp_path / "mine").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "mine")
    done = subprocess.run([REFDYN, "eval", PENDULUM], env=env, capture_output=True, text=True)
    assert done.returncode == 1 and "REFDYN_CACHE" in done.stderr and not list((tmp_path / "mine").iterdir())


@pytest.mark.parametrize("name", ["-o", "@file", "a b", "it's", 'a"b', "new\nline", "$(touch canary)", "`touch canary`", "; touch canary", "-Wl,x", "été"])
def test_names_of_the_cache(name, tmp_path):
    """No name of a folder acts as an option, a file of options or a command of the compiler."""
    done = run("eval", PENDULUM, cwd=tmp_path, env={**os.environ, "REFDYN_CACHE": name}, stdout=subprocess.PIPE)
    assert done.returncode == 0 and json.loads(done.stdout), done.stderr
    assert {path.split("/")[0] for path in files_in(tmp_path)} == {name}


@pytest.mark.parametrize("name", ["-o", "@file", "a b", "$(touch canary)"])
def test_names_of_the_temporary_folder(name, tmp_path):
    (tmp_path / name).mkdir()
    (tmp_path / "given.csv").write_text("t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n")
    for arguments in (["bench", PENDULUM, "--emit", "M"], ["plot", "given.csv", "-o", "f.png"]):
        assert run(*arguments, cwd=tmp_path, env={**os.environ, "TMPDIR": name}, stdout=subprocess.DEVNULL).returncode == 0
    assert files_in(tmp_path) == ["f.png", "given.csv"] and not list((tmp_path / name).iterdir())


def test_devices_are_appended_to(tmp_path):
    """/dev/stdout is the file that the shell has opened, which may already have contents."""
    (tmp_path / "log").write_text("before\n")
    with open(tmp_path / "log", "a") as log:
        assert run("eval", PENDULUM, "-o", "/dev/stdout", stdout=log).returncode == 0
    assert (tmp_path / "log").read_text().startswith("before\n{")


@pytest.mark.parametrize("command", ["cc -O1", "cc\t-O1", " cc ", "cc\n-O1", "env cc"])
def test_words_of_the_compiler(command, tmp_path):
    done = run("eval", PENDULUM, env={**os.environ, "REFDYN_CACHE": str(tmp_path), "CC": command}, stdout=subprocess.PIPE)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", ["cc; touch canary", "cc $(touch canary)", "cc `touch canary`", "cc | touch canary", "touch canary #", "/bin", "."])
def test_the_compiler_is_no_shell_line(command, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    done = run("eval", PENDULUM, cwd=work, env={**os.environ, "REFDYN_CACHE": str(tmp_path / "cache"), "CC": command})
    assert done.returncode == 1 and "compiler" in done.stderr and not (work / "$(touch").exists()
    assert "canary" not in files_in(work) or command.startswith("touch")


# ---- Columns ----

CLASHES = """local rd = require "refdyn"
rd.input("t", 2, "N") rd.input("energy", 1, "N") rd.input("E_x", 3, "N") rd.input("force_E_x", 4, "N")
return rd.model { name = "clash",
  links = { { "E", joint = { "x", "y" }, mass = 1 }, { "force_E", joint = "x", mass = 1 } },
  points = { E = "E", energy = "E" },
  forces = function(s) return { E_x = s.inputs.E_x + s.inputs.t + s.inputs.force_E_x + s.inputs.energy } end,
  courses = function(s) return { E_y = s.q.E_y, E_x_d = s.qd.E_x, phi_1 = s.t, input_E_x = s.t, plain = s.t } end }
"""


def test_columns_have_names_of_their_own(tmp_path):
    """A name that an earlier column has gets the ending of its kind; all other names are unchanged."""
    (tmp_path / "clash.lua").write_text(CLASHES)
    refdyn("sim", "clash.lua", "--until", SOON, "-o", "run.csv", cwd=tmp_path)
    names = (tmp_path / "run.csv").read_text().split("\n")[0].split(",")
    assert len(set(names)) == len(names)
    points = [f"{lead}_{axis}{rate}" for lead in ("point_E", "energy") for rate in ("", "d", "dd") for axis in "xyz"]
    assert names == ["t", "E_x", "E_y", "force_E_x", "E_x_d", "E_y_d", "force_E_x_d", *points, "energy",
                     "force_force_E_x", "force_force_E_y", "force_force_force_E_x", "input_t", "input_energy", "input_E_x", "input_force_E_x",
                     "course_E_x_d", "course_E_y", "course_input_E_x", "phi_1", "plain", "E_x_dd", "E_y_dd", "force_E_x_dd"]
    figure = refdyn("plot", "run.csv", "-o", "run.svg", cwd=tmp_path)
    assert figure.stderr == "" and ">point_E<" in (tmp_path / "run.svg").read_text()
    refdyn("sim", "clash.lua", "--until", SOON, "--stop", "input_t>1", "-o", "stop.csv", cwd=tmp_path)
    assert len(read_run(tmp_path / "stop.csv")["t"]) == 1


def test_inputs_with_names_of_columns(tmp_path):
    """The CSV of a motion provides its inputs, not the coordinates of the same names; t is the time."""
    (tmp_path / "clash.lua").write_text(CLASHES)
    refdyn("sim", "clash.lua", "--until", "1", "-o", "first.csv", "--step", "1e-2", cwd=tmp_path)
    refdyn("sim", "clash.lua", "--until", "1", "-o", "again.csv", "--step", "1e-2", "--inputs", "first.csv", cwd=tmp_path)
    first, again = (read_run(tmp_path / f"{name}.csv") for name in ("first", "again"))
    assert abs(first["E_x"] - again["E_x"]).max() < 1e-12 and first["E_x"][-1] > 1
    (tmp_path / "t.csv").write_text("t,energy\n0,5\n")
    refdyn("sim", "clash.lua", "--until", "1", "-o", "t_is_time.csv", "--inputs", "t.csv", cwd=tmp_path)
    run_with = read_run(tmp_path / "t_is_time.csv")
    assert set(run_with["input_t"]) == {2} and set(run_with["input_energy"]) == {5}
