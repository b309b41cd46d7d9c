"""The two tiers of compiled models: equal bits, one compilation for all callers, the change-over, and repetition by --watch."""
import json
import os
import pathlib
import pty
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

import pytest

from program import LONG, MODELS, REFDYN, SOURCE, TESTS, all_models, models_of_tests, refdyn

PENDULUM = TESTS / "models" / "double_pendulum.lua"
BITS = TESTS / "tiers" / "same_bits.c"
HEADER = SOURCE / "runtime"
FIRST = {"tcc": ["tcc", "-shared"], **{name: [name, "-std=c11", "-O0", "-fPIC", "-ffp-contract=off", "-shared"] for name in ("clang", "gcc")}}
DERIVATIVES = "all,tangent,d_qdd,d_qdd_free,d_force,d_statics,d_rows"
FEW = [MODELS / f"{name}.lua" for name in ("manipulator",)] + [TESTS / "models" / f"{name}.lua" for name in ("functions", "arm_through")]


def wait_for(what, seconds=60):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


# ---- Bits ----

@pytest.fixture(scope="module")
def comparer(tmp_path_factory):
    program = tmp_path_factory.mktemp("comparer") / "same_bits"
    subprocess.run(["gcc", "-std=c11", "-O1", "-Wall", "-Wextra", "-I", HEADER, BITS, "-o", program, "-ldl", "-lm"], check=True)
    return program


def emitted(model, folder):
    """Emits all functions that the model has, with their derivatives, and returns its name."""
    for emit in (DERIVATIVES, DERIVATIVES.replace("d_rows", "step"), "all,tangent,d_qdd_free,d_statics", "all"):
        if refdyn("gen", model, "--emit", emit, "-o", folder, status=None).returncode == 0:
            return min(folder.glob("*.h"), key=lambda file: len(file.name)).stem
    raise AssertionError(f"{model}: not emitted")


@pytest.mark.parametrize("model", all_models() + models_of_tests() if LONG else FEW, ids=lambda path: path.stem)
def test_all_compilers_compute_the_same_bits(model, comparer, tmp_path):
    """tcc, clang and gcc without optimisation, and the optimised build: every function, with the derivatives."""
    name = emitted(model, tmp_path)
    sources = sorted(tmp_path.glob("*.c"))
    builds = {**FIRST, "optimised": ["gcc", "-std=c11", "-O2", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-shared"]}
    libraries = []
    for compiler, words in builds.items():
        libraries.append(tmp_path / f"{compiler}.so")
        subprocess.run([*words, "-I", HEADER, *sources, "-o", libraries[-1], "-lm"], check=True)
    done = subprocess.run([comparer, name, *libraries], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(re.search(r"(\d+) compared", done.stdout)[1]) > 500


def test_no_operation_of_two_literals(tmp_path):
    """tcc would fold it in more than double precision. In the second model, the order of sums brings numbers together."""
    number = r"\d+\.\d+(?:e[-+]?\d+)?"
    pair = re.compile(rf"(?:^|[=(,?:])\s*-?{number} (?:[*/] {number}|[-+] {number}(?![\d.e]| [*/]))|[-+] {number} [*/] {number}", re.M)
    assert pair.search("a = 0.25 + 0.5 + b") and pair.search("(0.25 * 0.5)") and not pair.search("a = 0.25 + 0.5 * b")
    for model in FEW:
        emitted(model, tmp_path / model.stem)
        for source in (tmp_path / model.stem).glob("*.c"):
            assert not pair.search(source.read_text()), (source, pair.search(source.read_text())[0])


# ---- Calls ----

class Place:
    """A separate cache, and programs that are found before others and record their calls."""

    def __init__(self, folder):
        self.folder, self.cache, self.bin = folder, folder / "cache", folder / "bin"
        self.bin.mkdir()
        self.env = {**os.environ, "REFDYN_CACHE": str(self.cache), "REFDYN_BACKGROUND": "1", "TMPDIR": str(folder),
                    "PATH": f"{self.bin}:{os.environ['PATH']}"}
        self.env.pop("CC", None)

    def program(self, name, before="", real=None):
        """A compiler that records its calls with their process, runs `before`, and calls the real one."""
        path = self.bin / name
        path.write_text(f'#!/bin/sh\necho "$$ $*" >>"{self.folder}/calls_{name}"\n{before}\nexec {shutil.which(real or name)} "$@"\n')
        path.chmod(0o755)

    def calls(self, name, word=""):
        path = self.folder / f"calls_{name}"
        return [line for line in path.read_text().splitlines() if word in line] if path.exists() else []

    def start(self, *arguments, env=None, **keywords):
        return subprocess.Popen([REFDYN, *map(str, arguments)], cwd=self.folder, env={**self.env, **(env or {})}, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, **keywords)

    def run(self, *arguments, status=0, **keywords):
        process = self.start(*arguments, **keywords)
        out, said = process.communicate(timeout=120)
        assert process.returncode == status, (process.returncode, said)
        return out, said

    def libraries(self):
        return sorted(path.name for path in self.cache.glob("*.so"))

    def folders(self):
        return [path.name for path in self.cache.iterdir() if path.suffix != ".so"]

    def settled(self, count):
        """Waits until the cache has this many libraries and nothing is compiled."""
        wait_for(lambda: len(self.libraries()) == count and not self.folders())


@pytest.fixture
def place(tmp_path):
    place = Place(tmp_path)
    yield place
    for calls in tmp_path.glob("calls_*"):  # of tests that failed
        for line in calls.read_text().splitlines():
            try:
                os.kill(int(line.split()[0]), signal.SIGKILL)
            except (OSError, ValueError):
                pass


SIM = ["sim", PENDULUM, "--until", "1", "-o"]


def test_first_call_and_second_call(place):
    """The first call works with the first tier, the next one with the optimised library; both write the same bytes."""
    place.program("tcc")
    place.program("cc")
    place.run(*SIM, "a.csv")
    place.settled(2)
    assert len(place.calls("tcc")) == 1 and len(place.calls("cc", " -shared ")) == 1
    place.run(*SIM, "b.csv")
    place.run(*SIM, "c.csv", env={"REFDYN_BACKGROUND": "0"})
    assert len(place.calls("tcc")) == 1 and len(place.calls("cc", " -shared ")) == 1 and len(place.libraries()) == 2
    texts = {(place.folder / f"{name}.csv").read_bytes() for name in "abc"}
    assert len(texts) == 1 and len(texts.pop()) > 10000


def test_no_background(place):
    """Only $CC compiles, before the work begins: for measurements."""
    place.program("tcc")
    place.run(*SIM, "a.csv", env={"REFDYN_BACKGROUND": "0"})
    assert not place.calls("tcc") and len(place.libraries()) == 1 and not place.folders()
    _, said = place.run(*SIM, "b.csv", status=1, env={"REFDYN_BACKGROUND": "no"})
    assert said == "refdyn: REFDYN_BACKGROUND: 'no': must be 0 or 1\n"


@pytest.mark.parametrize("command", [["bench", PENDULUM, "--emit", "M"], ["batch", PENDULUM, "--table", "cases.csv", "--until", "0.1", "-o", "runs.csv"],
                                     ["sim", PENDULUM, "--until", "1", "--step", "9e-6", "-o", "a.csv"],
                                     ["sim", PENDULUM, "--until", "1", "--accuracy", "1e-3", "-o", "a.csv"],
                                     ["report", PENDULUM, "--until", "0.1", "-o", "out"]], ids=["bench", "batch", "steps", "accuracy", "report"])
def test_work_that_is_optimised_from_the_start(command, place):
    (place.folder / "cases.csv").write_text("upper_theta\n0.1\n0.2\n")
    place.program("tcc")
    place.run(*command)
    assert not place.calls("tcc") and not place.folders()


def test_a_few_calls_are_not_optimised(place):
    place.program("cc")
    place.run("eval", PENDULUM)
    assert not place.calls("cc") and len(place.libraries()) == 1


def test_compilers_of_the_first_tier(place):
    """tcc, else clang, else gcc. If $CC has several words, it compiles alone, since they may change arithmetic."""
    real = {name: shutil.which(name) for name in ("clang", "gcc", "cc", "ld", "as")}
    for name in ("cc", "ld", "as"):
        (place.bin / name).symlink_to(real[name])
    for name in ("gcc", "clang"):
        place.program(name)
        place.run("eval", PENDULUM, env={"PATH": str(place.bin)})
        assert [call.split()[-1] for call in place.calls(name)] == ["-lm"] and "-O0" in place.calls(name)[0]
    place.program("tcc")
    place.run("eval", PENDULUM, env={"CC": "cc -O1"})
    assert not place.calls("tcc")
    place.run("eval", PENDULUM, env={"CC": "gcc"})
    assert len(place.calls("tcc")) == 1


def test_a_first_tier_that_fails(place):
    """$CC compiles instead, without a message."""
    (place.bin / "tcc").write_text("#!/bin/sh\necho wrong >&2\nexit 1\n")
    (place.bin / "tcc").chmod(0o755)
    _, said = place.run("eval", PENDULUM)
    assert said == "" and len(place.libraries()) == 1 and not place.folders()


def test_limits_by_tcc(place):
    """A missing limit is infinite. tcc compiles this number like the other compilers: the model has its first tier."""
    (place.folder / "slide.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "slide", gravity = { 0, 0, 0 }, links = { { "cart", joint = { "x", "y" }, mass = 2.1, limits = { x = { to = 0.7 }, y = { from = -0.3 } } } } }
""")
    place.program("tcc")
    place.program("cc")
    place.run("eval", "slide.lua")
    assert len(place.calls("tcc")) == 1 and not place.calls("cc")
    place.run("gen", "slide.lua", "-o", ".")
    (place.folder / "print.c").write_text("""#include "slide.h"
#include <stdio.h>
int main(void) {
    for (int i = 0; i < slide_limit_count; i++)
        printf("%g %g %g %g\\n", slide_limits[i].from, slide_limits[i].to, slide_limits[i].rate, slide_limits[i].force);
    return 0;
}
""")
    for words in (["tcc"], ["gcc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"], ["clang", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"],
                  ["g++", "-x", "c++", "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]):
        subprocess.run([*words, "-I", HEADER, "print.c", "slide.c", "-o", "print", "-lm"], cwd=place.folder, check=True)
        assert subprocess.check_output([place.folder / "print"], text=True) == "-inf 0.7 inf inf\n-0.3 inf inf inf\n"


def test_compile_says_where_the_optimised_library_will_be(place):
    description = json.loads(place.run("compile", PENDULUM)[0])
    assert description["library"] != description["optimised"] and pathlib.Path(description["library"]).exists()
    wait_for(lambda: os.path.exists(description["optimised"]))
    later = json.loads(place.run("compile", PENDULUM)[0])
    assert later["library"] == description["optimised"] and "optimised" not in later


# ---- Several programs ----

@pytest.mark.parametrize("count", [2, 8])
def test_calls_at_the_same_time_compile_once(count, place):
    place.program("tcc", "sleep 0.5")
    place.program("cc", "sleep 0.2")
    processes = [place.start(*SIM, f"{i}.csv") for i in range(count)]
    for process in processes:
        assert process.wait(timeout=120) == 0, process.stderr.read()
    place.settled(2)
    assert len(place.calls("tcc")) == 1 and len(place.calls("cc", " -shared ")) == 1
    assert len({(place.folder / f"{i}.csv").read_bytes() for i in range(count)}) == 1


@pytest.mark.parametrize("count", [2, 8])
def test_optimised_calls_at_the_same_time_compile_once(count, place):
    place.program("cc", "sleep 0.2")
    processes = [place.start(*SIM, f"{i}.csv", env={"REFDYN_BACKGROUND": "0"}) for i in range(count)]
    for process in processes:
        assert process.wait(timeout=120) == 0, process.stderr.read()
    assert len(place.calls("cc", " -shared ")) == 1 and not place.folders()


def test_another_program_builds_if_the_first_one_fails(place):
    """A compiler that fails once: the program that waited for it compiles again."""
    place.program("cc", f'case "$*" in *-shared*) if mkdir "{place.folder}/once" 2>/dev/null; then sleep 0.5; exit 1; fi ;; esac')
    processes = [place.start("eval", PENDULUM, env={"REFDYN_BACKGROUND": "0"}) for _ in range(2)]
    assert sorted(process.wait(timeout=120) for process in processes) == [0, 1]
    assert len(place.libraries()) == 1 and not place.folders()


def background_of(place):
    """The number of the background process, from the call of its compiler."""
    wait_for(lambda: place.calls("cc"))
    compiler = place.calls("cc")[-1].split()[0]
    return int(pathlib.Path(f"/proc/{compiler}/stat").read_text().rsplit(")", 1)[1].split()[1])


def test_background_process(place):
    """It has its own session and a low priority, and keeps nothing of the command open."""
    place.program("cc", "sleep 1")
    place.run(*SIM, "a.csv")
    process = background_of(place)
    assert os.getsid(process) == process and os.getpriority(os.PRIO_PROCESS, process) == min(19, 5 + os.getpriority(os.PRIO_PROCESS, 0))
    opened = {os.readlink(f"/proc/{process}/fd/{name}") for name in os.listdir(f"/proc/{process}/fd")}
    own = (str(place.cache), "/tmp/#")  # a file without a name has its messages
    assert {path for path in opened if not path.startswith(own)} == {"/dev/null"}
    place.settled(2)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT], ids=lambda number: number.name)
def test_background_process_that_is_ended(number, place):
    place.program("cc", "sleep 100")
    place.run(*SIM, "a.csv")
    os.kill(background_of(place), number)
    wait_for(lambda: not place.folders())
    assert len(place.libraries()) == 1


def test_background_process_that_is_killed(place):
    """Its folders remain until the next build; the next call compiles again."""
    place.program("cc", f'test -e "{place.folder}/again" || sleep 3')
    place.run(*SIM, "a.csv")
    os.kill(background_of(place), signal.SIGKILL)
    (place.folder / "again").touch()
    assert len(place.libraries()) == 1 and place.folders()
    place.run(*SIM, "b.csv")
    place.settled(2)
    assert (place.folder / "a.csv").read_bytes() == (place.folder / "b.csv").read_bytes()


LATE = "#include <unistd.h>\n#include <sys/syscall.h>\npid_t setsid(void) { sleep(1); return (pid_t)syscall(SYS_setsid); }\n"


def test_the_background_has_no_locks_of_the_command(place):
    """The lock of an output ends with its command, also if the process in the background begins late."""
    (place.folder / "late.c").write_text(LATE)
    subprocess.run(["cc", "-shared", "-fPIC", place.folder / "late.c", "-o", place.folder / "late.so"], check=True)
    place.run(*SIM, "a.csv", env={"LD_PRELOAD": str(place.folder / "late.so")})
    place.run(*SIM, "a.csv")
    place.settled(2)


def test_two_calls_with_one_output(place):
    """On a busy machine, with a cache that lacks the optimised library."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(4)]
    try:
        for i in range(500 if LONG else 8):
            env = {"REFDYN_CACHE": str(place.folder / f"cache_{i}")}
            for _ in range(2):
                place.run(*SIM[:3], "0.01", "-o", "a.csv", env=env)
    finally:
        for process in busy:
            process.kill()
            process.wait()


BROKEN = {"fails": "echo no licence >&2; exit 1", "nothing": "exit 0", "garbage": 'echo "no library" >"$out"; exit 0',
          "empty": ': >"$out"; exit 0', "link": 'ln -s "$VICTIM" "$out"; exit 0', "hard link": 'ln "$VICTIM" "$out"; exit 0',
          "pipe": 'mkfifo "$out"; exit 0'}
SAID = {"fails": "no licence", "nothing": "No such file", "garbage": "cannot be loaded", "empty": "cannot be loaded", "link": "has made a link",
        "hard link": "has made a link", "pipe": "has made a link or a device"}


@pytest.mark.parametrize("how", BROKEN)
def test_a_compiler_that_is_broken(how, place):
    """What it does in the background is reported by the next call, once; it ends a call that waits for it. No link is followed."""
    find = 'while [ $# -gt 0 ]; do if [ "$1" = -o ]; then out=$2; fi; shift; done\n'
    repaired = f'if [ -e "{place.folder}/repaired" ]; then exec {shutil.which("gcc")} "$@"; fi\n'
    (place.bin / "cc").write_text(f"#!/bin/sh\n{repaired}{find}{BROKEN[how]}\n")
    (place.bin / "cc").chmod(0o755)
    victim = place.folder / "victim"
    victim.write_text("kept")
    env = {"VICTIM": str(victim)}

    def ended():
        wait_for(lambda: len(list(place.cache.glob("*.failed"))) == 1 and not list(place.cache.glob("build-*")))

    _, said = place.run(*SIM, "a.csv", env=env)
    assert "warning" not in said
    ended()
    for call in range(3):
        _, said = place.run(*SIM, "a.csv", env=env)
        assert ("failed; slower ones are used" in said and SAID[how] in said) == (call == 0), said
        ended()
    _, said = place.run(*SIM, "a.csv", status=1, env={**env, "REFDYN_BACKGROUND": "0"})
    assert SAID[how] in said and len(place.libraries()) == 1 and victim.read_text() == "kept"
    (place.folder / "repaired").touch()
    place.run(*SIM, "a.csv", env=env)
    place.settled(2)
    assert "warning" not in place.run(*SIM, "a.csv", env=env)[1]


def test_folders_of_a_killed_build_go_with_the_next_call(place):
    """Also if that call compiles nothing."""
    place.run(*SIM, "a.csv", env={"REFDYN_BACKGROUND": "0"})
    (place.cache / "build-AAAAAA" / "deep").mkdir(parents=True)
    place.run(*SIM, "a.csv", env={"REFDYN_BACKGROUND": "0"})
    assert not place.folders()


def test_old_libraries_go_with_the_next_compilation(place):
    """Those unused for 60 days, and the least recently used ones beyond 1 GiB; other files stay. Loading one is a use."""
    def make(name, days, size):
        with open(place.cache / name, "wb") as file:
            file.truncate(size)
        os.utime(place.cache / name, (time.time() - days * 86400,) * 2)
    once = {"REFDYN_BACKGROUND": "0"}
    place.run("eval", PENDULUM, env=once)
    [used] = place.libraries()
    os.utime(place.cache / used, (time.time() - 61 * 86400,) * 2)
    place.run("eval", PENDULUM, env=once)
    for name, days, size in (("a.so", 61, 10), ("b.so", 59, 10), ("note.txt", 400, 10), ("c.so", 2, 1 << 30), ("d.so", 3, 10), ("e.so", 1.5, 1 << 29)):
        make(name, days, size)
    place.run("eval", MODELS / "crane.lua", env=once)
    left = {path.name for path in place.cache.iterdir()}
    assert left >= {used, "note.txt", "e.so"} and not left & {"a.so", "b.so", "c.so", "d.so"} and len(left) == 4


def test_one_background_process_at_a_time(place):
    place.program("cc", "sleep 0.3")
    for size in range(1, 4):
        place.run("sim", MODELS / "manipulator.lua", "--set", f"n_rfe={size}", "--until", "0.1", "-o", "a.csv")
    most = 0
    while len(place.libraries()) < 6:
        most = max(most, len([name for name in place.folders() if re.fullmatch("build-[0-9a-f]{6}", name)]))
        time.sleep(0.01)
    assert most == 1
    place.settled(6)


def test_disk_that_is_full(place):
    """No library is left, and the reason is reported."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
    _, said = place.run("eval", PENDULUM, status=1, preexec_fn=limit)
    assert said.count("File too large") == 1 and not place.libraries() and not place.folders()


# ---- Motions ----

def loaded_libraries(process, place):
    """The libraries of the cache that a program has loaded."""
    try:
        lines = pathlib.Path(f"/proc/{process.pid}/maps").read_text().splitlines()
    except OSError:
        return set()
    return {line.split()[-1] for line in lines if str(place.cache) in line}


@pytest.mark.parametrize("how", [["--method", "rk8"], ["--method", "gauss12"], ["--method", "rk4", "--step", "1e-3"], []], ids=["rk8", "gauss12", "rk4", "auto"])
def test_a_motion_changes_over(how, place):
    """The running motion loads the optimised library, and its rows are those of a motion that had it from the start."""
    motion = ["sim", MODELS / "manipulator.lua", "--set", "n_rfe=2", "--from", "statics", "--until", "60", "--every", "0.05", *how]
    place.program("cc", f'while test -e "{place.folder}/hold"; do sleep 0.01; done')
    (place.folder / "hold").touch()
    process = place.start(*motion, "-o", "a.csv")
    part = place.folder / "a.csv.part"
    wait_for(lambda: part.exists() and part.stat().st_size > 0)
    process.send_signal(signal.SIGSTOP)
    before = loaded_libraries(process, place)
    (place.folder / "hold").unlink()
    place.settled(2)
    process.send_signal(signal.SIGCONT)
    wait_for(lambda: len(loaded_libraries(process, place)) == 2 or process.poll() is not None)
    after = loaded_libraries(process, place)
    assert process.wait(timeout=120) == 0
    assert len(before) == 1 and len(after) == 2
    place.run(*motion, "-o", "b.csv", env={"REFDYN_BACKGROUND": "0"})
    assert (place.folder / "a.csv").read_bytes() == (place.folder / "b.csv").read_bytes()


# ---- Notices ----

def on_terminal(place, *arguments, env=None):
    """What a command writes to stderr if that is a terminal."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen([REFDYN, *map(str, arguments)], cwd=place.folder, env={**place.env, **(env or {})}, stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    said = b""
    while True:
        try:
            block = os.read(ours, 4096)
        except OSError:
            break
        if not block:
            break
        said += block
    os.close(ours)
    assert process.wait() == 0
    return said.decode()


def test_notice_of_a_long_compilation(place):
    """On a terminal, after half a second; the line is removed. Other programs ask for it. A second call compiles nothing."""
    place.program("cc", "sleep 0.8")
    no_background = {"REFDYN_BACKGROUND": "0"}
    said = on_terminal(place, "eval", PENDULUM, env=no_background)
    assert "refdyn: compiling double_pendulum.c ..." in said and said.endswith("\r\x1b[K")
    _, said = place.run("eval", MODELS / "pendulum.lua", env={**no_background, "REFDYN_NOTICES": "1"})
    assert "refdyn: compiling pendulum.c ...\n" in said
    _, said = place.run("eval", MODELS / "crane.lua", env=no_background)
    assert said == ""
    assert on_terminal(place, "eval", PENDULUM, env=no_background) == ""


def test_notice_of_a_long_question(place):
    """The program also says that it waits for the answer to its first question: whether the compiler is gcc."""
    place.program("cc", 'case "$*" in *-fsyntax-only*) sleep 0.8 ;; esac')
    _, said = place.run("eval", PENDULUM, env={"REFDYN_BACKGROUND": "0", "REFDYN_NOTICES": "1"})
    assert said.startswith("refdyn: asking cc whether it is gcc ...\n")


# ---- --watch ----

class Watching:
    """`refdyn ... --watch` in the background."""

    def __init__(self, place, *arguments):
        self.said = place.folder / "said"
        with open(self.said, "w") as file:
            self.process = subprocess.Popen([REFDYN, *map(str, arguments), "--watch"], cwd=place.folder, env=place.env, stderr=file)

    def wait_for(self, text):
        wait_for(lambda: text in self.said.read_text())

    def end(self, number=signal.SIGINT):
        self.process.send_signal(number)
        assert self.process.wait(timeout=60) == -number
        return self.said.read_text()


MODEL = """local rd = require "refdyn"
local size = require "size"
return rd.model { name = "swing", gravity = { 0, 0, -9.81 }, links = { { "a", joint = { "phi" }, turn = { { "x", rd.pi / 2 } },
  mass = size.mass, center = { 0, 0, -size.length }, start = { phi = 0.3 } } } }
"""


@pytest.fixture
def swing(place):
    (place.folder / "swing.lua").write_text(MODEL)
    (place.folder / "size.lua").write_text("return { mass = 1, length = 0.5 }\n")
    return place


def test_watch_repeats_when_a_file_is_saved(swing):
    """The model, or a file that it requires; errors are printed, and watching continues."""
    run, size = swing.folder / "run.csv", swing.folder / "size.lua"
    watching = Watching(swing, "sim", "swing.lua", "--until", "1", "-o", "run.csv")
    watching.wait_for("refdyn: watching swing.lua and 1 more file; Ctrl-C ends\n")
    texts = [run.read_text()]
    size.write_text("return { mass = 1, length = 0.7 }\n")
    wait_for(lambda: run.read_text() != texts[0])
    texts.append(run.read_text())
    (swing.folder / "new").write_text(MODEL.replace("0.3", "0.4"))
    os.replace(swing.folder / "new", swing.folder / "swing.lua")  # as editors do
    wait_for(lambda: run.read_text() != texts[1])
    size.write_text("return { mass = 1, length = }\n")
    watching.wait_for("size.lua:1: unexpected symbol near '}'")
    assert run.read_text() not in texts
    size.write_text("return { mass = 1, length = 0.5 }\n")
    (swing.folder / "swing.lua").write_text(MODEL)
    wait_for(lambda: run.read_text() == texts[0])
    said = watching.end()
    assert re.findall(r"\n\nrefdyn: \d\d:\d\d:\d\d: (\S+) has changed\n", said)[:2] == [str(size.name), "swing.lua"], said


def test_watch_repeats_when_inputs_or_the_start_change(swing):
    (swing.folder / "swing.lua").write_text(MODEL.replace("return rd", 'rd.input("push", 0, "N m")\nreturn rd').replace("\n}\n", "\n  forces = function(s) return { a_phi = s.inputs.push } end }\n"))
    run, inputs, start = (swing.folder / name for name in ("run.csv", "inputs.csv", "start.json"))
    inputs.write_text("t,push\n0,0.3\n")
    start.write_text('{"q": [0.7]}')
    watching = Watching(swing, "sim", "swing.lua", "--until", "1", "--inputs", "inputs.csv", "--from", "start.json", "-o", "run.csv")
    watching.wait_for("refdyn: watching swing.lua and 3 more files; Ctrl-C ends\n")
    texts = [run.read_text()]
    for file, text in ((inputs, "t,push\n0,0.9\n"), (start, '{"q": [0.71]}')):
        file.write_text(text)
        wait_for(lambda: run.read_text() != texts[-1])
        texts.append(run.read_text())
    assert len(set(texts)) == 3
    watching.end()


def test_watch_begins_with_a_wrong_model(swing):
    """Also if the error is in a file that the model requires."""
    size = swing.folder / "size.lua"
    size.write_text("return { mass = }\n")
    watching = Watching(swing, "sim", "swing.lua", "--until", "1", "-o", "run.csv")
    watching.wait_for("Ctrl-C ends")
    size.write_text("return { mass = 1, length = 0.7 }\n")
    wait_for((swing.folder / "run.csv").exists)
    watching.end(signal.SIGTERM)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_watch_ends_a_motion_that_runs(number, swing):
    """When a file changes, and with the program; the rows until then remain."""
    part = swing.folder / "run.csv.part"
    watching = Watching(swing, "sim", "swing.lua", "--until", "1e5", "--every", "2e-2", "-o", "run.csv")
    wait_for(lambda: part.exists() and part.stat().st_size > 20000)
    (swing.folder / "swing.lua").write_text(MODEL.replace("0.3", "0.45"))
    wait_for(lambda: part.exists() and "\n0,0.45," in part.read_text()[:200] and part.stat().st_size > 20000)
    said = watching.end(number)
    assert said.count("refdyn: interrupted at t = ") == 2
    rows = part.read_text()
    assert rows.endswith("\n")
    time.sleep(0.2)
    assert part.read_text() == rows


def test_watch_of_a_page(swing):
    page, run = swing.folder / "page.html", swing.folder / "run.csv"
    swing.run("sim", "swing.lua", "--until", "1", "-o", "run.csv")
    watching = Watching(swing, "view", "run.csv", "--model", "swing.lua", "-o", "page.html")
    watching.wait_for("refdyn: watching swing.lua and 2 more files; Ctrl-C ends\n")
    first = page.read_text()
    swing.run("sim", "swing.lua", "--until", "2", "-o", "run.csv")
    wait_for(lambda: page.read_text() != first)
    second = page.read_text()
    (swing.folder / "size.lua").write_text("return { mass = 1, length = 0.8 }\n")
    wait_for(lambda: page.read_text() != second)
    watching.end()
    assert run.exists()


def test_wrong_usage_of_watch(swing):
    _, said = swing.run("sim", "swing.lua", "--until", "1", "--watch", status=2)
    assert said.startswith("refdyn sim: --watch needs -o\n")
    _, said = swing.run("sim", "swing.lua", "--until", "1", "--tol", "1e-6", "--step", "1e-3", "--method", "rk8", "--watch", "-o", "a.csv", status=2)
    assert "Ctrl-C" not in said
