"""Signals and other programs: unfinished work is ended and removed, computed results remain readable."""
import csv
import fcntl
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import time
import xml.etree.ElementTree

import pytest

from harm import SLOWNESS, files_in
from program import MODELS, REFDYN, REFERENCE, TESTS, read_run

PENDULUM = TESTS / "models" / "double_pendulum.lua"
ENDING = [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGXCPU, signal.SIGXFSZ, signal.SIGPIPE]
LONG = ["--until", "1e5", "--every", "2e-2", "--tol", "1e-10"]  # a motion that takes long


def wait_for(what, seconds=30):
    """Waits until what() is true."""
    end = time.monotonic() + seconds * SLOWNESS
    while not what():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


class Place:
    """Folders of one program: its working folder, and the folder of its temporary files."""

    def __init__(self, folder):
        self.work, self.tmp, self.cache, self.bin = (folder / name for name in ("work", "tmp", "cache", "bin"))
        for path in (self.work, self.tmp, self.cache, self.bin):
            path.mkdir(mode=0o700)
        self.env = {**os.environ, "TMPDIR": str(self.tmp), "REFDYN_CACHE": str(self.cache), "PATH": f"{self.bin}:{os.environ['PATH']}"}

    def start(self, *arguments, **keywords):
        env = {**self.env, **keywords.pop("env", {})}
        return subprocess.Popen([REFDYN, *map(str, arguments)], cwd=self.work, env=env, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                **keywords)

    def run(self, *arguments, status=0, **keywords):
        process = self.start(*arguments, **keywords)
        out, said = process.communicate(timeout=60 * SLOWNESS)
        assert process.returncode == status, (process.returncode, said)
        return said

    def program(self, name, text):
        """A program that is found before others of its name, and records the number of each of its processes."""
        (self.bin / name).write_text(f'#!/bin/sh\necho $$ >>"{self.bin}/numbers"\n{text}')
        (self.bin / name).chmod(0o755)
        return self.bin / "numbers"

    def leftovers(self):
        return [path.name for folder in (self.tmp, self.cache) for path in folder.iterdir() if path.suffix != ".so"]


@pytest.fixture
def place(tmp_path):
    return Place(tmp_path)


def is_alive(number):
    """Whether it runs: a dead process that is not yet waited for does not."""
    try:
        return pathlib.Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False


def cpu_seconds(process):
    """What a process that runs has used, without its children."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


# ---- A motion ----

@pytest.mark.parametrize("number", ENDING, ids=lambda number: number.name)
@pytest.mark.parametrize("how", [[], ["--method", "rk4", "--step", "1e-3"], ["--stop", "E_x>1e9"]], ids=["tol", "step", "stop"])
def test_a_motion_that_is_ended(number, how, place):
    """The program ends by the signal; the rows until then remain, and the last one is the last state."""
    model = MODELS / "pendulum.lua" if how and how[0] == "--stop" else PENDULUM
    long = [word for word in LONG if word not in ("--tol", "1e-10")] if how and how[0] == "--method" else LONG
    if how and how[0] == "--stop":
        how = ["--stop", "energy>1e30"]
    process = place.start("sim", model, *long, *how, "-o", "run.csv", "--summary", "run.json")
    part = place.work / "run.csv.part"
    wait_for(lambda: part.exists() and part.stat().st_size > 20000)
    process.send_signal(number)
    _, said = process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -number, (process.returncode, said)
    stopped = re.search(r"refdyn: interrupted at t = (\S+) s", said)
    assert stopped and "what was computed until then is in " in said, said
    assert files_in(place.work) == ["run.csv.part"] and not place.leftovers()
    run = read_run(part)
    assert run["t"][-1] == float(stopped[1]) and all(run["t"][1:] > run["t"][:-1])


def test_a_second_signal_ends_at_once(place):
    process = place.start("sim", PENDULUM, *LONG, "-o", "run.csv")
    part = place.work / "run.csv.part"
    wait_for(lambda: part.exists() and part.stat().st_size > 20000)
    process.send_signal(signal.SIGSTOP)
    process.send_signal(signal.SIGTERM)
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGCONT)
    process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode in (-signal.SIGTERM, -signal.SIGINT) and part.stat().st_size > 10000


def test_the_limit_on_sizes_of_files(place):
    """The signal of the system, when a file grows beyond the limit."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (50000, 50000))
    place.run("eval", PENDULUM)
    place.run("sim", PENDULUM, "--until", "0.1")
    said = place.run("sim", PENDULUM, *LONG, "-o", "run.csv", status=-signal.SIGXFSZ, preexec_fn=limit)
    assert "could no longer be written at t = " in said and "not all could be written: File too large" in said
    assert "limit on the size of files" in said and files_in(place.work) == ["run.csv.part"]
    text = (place.work / "run.csv.part").read_text()
    rows = text[:text.rindex("\n")].split("\n")
    assert len(rows) > 50 and {row.count(",") for row in rows} == {rows[0].count(",")}


def test_the_limit_on_time(place):
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (1, 20))
    place.run("sim", PENDULUM, "--until", "0.1")
    said = place.run("sim", PENDULUM, *LONG, "-o", "run.csv", status=-signal.SIGXCPU, preexec_fn=limit)
    assert "limit on CPU time" in said and len(read_run(place.work / "run.csv.part")["t"]) > 10


def test_a_reader_that_goes(place):
    """Rows to a closed pipe end the program like any program in a pipeline."""
    process = place.start("sim", PENDULUM, *LONG)
    process.stdout.readline()
    process.stdout.close()
    process.stderr.read()
    assert process.wait(timeout=60 * SLOWNESS) == -signal.SIGPIPE and not place.leftovers()


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_signals_that_the_caller_ignores(number, place):
    """As with nohup and a shell's background jobs."""
    process = place.start("sim", PENDULUM, *LONG, "-o", "run.csv", preexec_fn=lambda: signal.signal(number, signal.SIG_IGN))
    part = place.work / "run.csv.part"
    wait_for(lambda: part.exists() and part.stat().st_size > 20000)
    process.send_signal(number)
    size = part.stat().st_size
    wait_for(lambda: part.stat().st_size > size + 20000)
    assert process.poll() is None
    process.kill()
    process.communicate()


@pytest.mark.parametrize("command", ["eval", "plot"])
def test_a_caller_that_ignores_the_ends_of_its_children(command, place):
    """Like some programs that start others: the ends of a compiler and of a converter are nevertheless detected."""
    (place.work / "run.csv").write_text("t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n")
    arguments = ["eval", PENDULUM] if command == "eval" else ["plot", "run.csv", "-o", "figure.png"]
    place.run(*arguments, preexec_fn=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN))
    assert not place.leftovers()


def test_the_search_for_an_accuracy(place):
    process = place.start("sim", PENDULUM, "--until", "1e4", "--every", "1e-1", "--accuracy", "1e-9", "-o", "run.csv")
    wait_for(lambda: (place.work / "run.csv.part").exists() and not place.leftovers())
    time.sleep(0.5)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -signal.SIGTERM and set(files_in(place.work)) <= {"run.csv.part"} and not place.leftovers()


def test_the_rows_of_a_search_that_cannot_be_kept(place):
    """They wait in a temporary file: without space for it, the motion is not reported as computed."""
    arguments = ["sim", PENDULUM, "--until", "1", "--accuracy", "1e-3", "-o", "run.csv"]
    place.run(*arguments)
    (place.work / "run.csv").unlink()

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))

    said = place.run(*arguments, status=1, preexec_fn=limit)
    assert "a temporary file could not be written: File too large" in said and not files_in(place.work)


# ---- The compiler ----

SLEEPS = "sleep 1000 &\necho $! >>\"$(dirname \"$0\")/numbers\"\ntouch \"$TMPDIR/temporary\"\nmkdir \"$TMPDIR/folder\"\ntouch \"$TMPDIR/folder/file\"\nwait\n"
STUBBORN = "trap '' TERM HUP INT\n" + SLEEPS.replace("wait\n", "while :; do wait; done\n")
KILLING = [*ENDING[:4], signal.SIGQUIT]


def end_while_it_works(place, process, numbers, number):
    """Ends the program while its child works; no file may remain."""
    wait_for(lambda: numbers.exists() and len(numbers.read_text().split()) >= 2 and list(place.tmp.glob("*")) + list(place.cache.glob("build-*/folder")))
    children = [int(word) for word in numbers.read_text().split()]
    assert all(map(is_alive, children)) and place.leftovers()
    process.send_signal(number)
    process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -number
    assert not place.leftovers()
    wait_for(lambda: not any(map(is_alive, children)))


@pytest.mark.parametrize("number", KILLING, ids=lambda number: number.name)
@pytest.mark.parametrize("command", [["eval"], ["sim", "--until", "1", "-o", "run.csv"], ["statics", "-o", "s.json"], ["modes"],
                                     ["report", "--until", "1", "-o", "out"]], ids=lambda words: words[0])
def test_a_compilation_that_is_ended(command, number, place):
    numbers = place.program("slow", SLEEPS)
    process = place.start(command[0], PENDULUM, *command[1:], env={"CC": "slow"}, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)))
    end_while_it_works(place, process, numbers, number)
    assert not files_in(place.work)


def test_a_generation_that_is_ended(place):
    """Neither its folder nor a part of a file remains."""
    process = place.start("gen", REFERENCE, "--set", "n_rfe=64", "--loops", "never", "--emit", "all,d_qdd", "-o", "deep/out")
    wait_for(lambda: (place.work / "deep" / "out").exists())
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -signal.SIGTERM and not list(place.work.iterdir())


def test_a_compiler_that_does_not_listen(place):
    numbers = place.program("slow", STUBBORN)
    end_while_it_works(place, place.start("eval", PENDULUM, env={"CC": "slow"}), numbers, signal.SIGTERM)


def test_a_program_that_is_killed(place):
    """SIGKILL leaves the folder and the compiler, which comes to its own end; the next start removes the folder."""
    numbers = place.program("slow", 'touch "$TMPDIR/temporary"\nsleep 1\n')
    process = place.start("eval", PENDULUM, env={"CC": "slow"})
    wait_for(lambda: numbers.exists() and place.leftovers())
    process.kill()
    process.communicate(timeout=60 * SLOWNESS)
    wait_for(lambda: not any(is_alive(int(word)) for word in numbers.read_text().split()))
    assert place.leftovers()
    place.run("eval", PENDULUM)
    assert not place.leftovers()


def test_signals_to_all_processes(place):
    """As from a terminal, to the whole group."""
    numbers = place.program("slow", SLEEPS)
    process = place.start("eval", PENDULUM, env={"CC": "slow"}, start_new_session=True)
    wait_for(lambda: numbers.exists() and len(numbers.read_text().split()) >= 2)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -signal.SIGINT
    wait_for(lambda: not any(is_alive(int(word)) for word in numbers.read_text().split()) and not place.leftovers())


def test_bench_compiles_in_a_folder_that_goes(place):
    place.run("bench", PENDULUM, "--emit", "M", "-o", "b.json")
    numbers = place.program("slow", SLEEPS + "exit 1\n")
    (place.bin / "once").write_text(f'#!/bin/sh\nif [ -e "{place.bin}/again" ]; then exec slow "$@"; fi\ncase "$*" in *-shared*) touch "{place.bin}/again" ;; esac\nexec cc "$@"\n')
    (place.bin / "once").chmod(0o755)
    process = place.start("bench", PENDULUM, "--emit", "M", env={"CC": "once"})
    end_while_it_works(place, process, numbers, signal.SIGTERM)


def test_a_compiler_that_ends_leaves_nothing(place):
    """Also if it fails, with files in its folder for temporary files."""
    place.program("failing", "touch \"$TMPDIR/temporary\"\nmkdir \"$TMPDIR/folder\"\necho no >&2\nexit 1\n")
    assert "the compiler failed" in place.run("eval", PENDULUM, status=1, env={"CC": "failing"})
    assert not place.leftovers()


def test_what_dead_programs_have_left(place):
    """The next start removes folders that no process has locked; folders in use and foreign files remain."""
    for folder in (place.cache / "build-AAAAAA", place.cache / "build-BBBBBB", place.tmp / "refdyn-plot-CCCCCC"):
        (folder / "deep").mkdir(parents=True)
        (folder / "deep" / "file").write_text("left")
    (place.cache / "build-notes").mkdir()
    (place.cache / "build-file").write_text("")
    (place.cache / "build-DDDDDD").symlink_to(place.work)
    (place.work / "kept").write_text("")
    lock = os.open(place.cache / "build-BBBBBB", os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    place.run("eval", PENDULUM)
    assert sorted(place.leftovers()) == ["build-BBBBBB", "build-DDDDDD", "build-file", "build-notes", "refdyn-plot-CCCCCC"]
    (place.work / "run.csv").write_text("t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n")
    place.run("plot", "run.csv", "-o", "run.png")
    os.close(lock)
    for path in place.cache.glob("*.so"):
        path.unlink()
    place.run("eval", PENDULUM)
    assert sorted(place.leftovers()) == ["build-DDDDDD", "build-file", "build-notes"] and (place.work / "kept").exists()


def running_of(session):
    """Running processes of a session."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if fields[3] == str(session) and fields[0] not in "ZX":
            found.append(int(path.parent.name))
    return found


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGKILL], ids=lambda number: number.name)
def test_signals_while_the_folder_is_made(number, place):
    """At any moment of the start, the folder is removed; only SIGKILL may leave it."""
    for i in range(60):
        process = place.start("eval", PENDULUM, start_new_session=True)
        time.sleep(0.0003 * i)
        process.send_signal(number)
        process.communicate(timeout=60 * SLOWNESS)
        wait_for(lambda process=process: not running_of(process.pid))
        for library in place.cache.glob("*.so"):
            library.unlink()
        assert number == signal.SIGKILL or not place.leftovers()


@pytest.mark.parametrize("command", [["gen", PENDULUM, "-o", "out/deep"], ["bench", PENDULUM, "-o", "bench.json"]], ids=lambda words: words[0])
def test_signals_while_outputs_are_made(command, place):
    """At any moment: all files with their names, or none and no folder."""
    for i in range(60):
        process = place.start(*command)
        time.sleep(0.0002 * i)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60 * SLOWNESS)
        left = sorted(path.name for path in place.work.rglob("*"))
        assert left in ([], ["deep", "double_pendulum.c", "double_pendulum.h", "out"]), left
        shutil.rmtree(place.work / "out", ignore_errors=True)


@pytest.mark.parametrize("text", ["#!/nowhere/shell\n", "\x7fELF"], ids=["script", "binary"])
def test_a_compiler_that_does_not_start(text, place):
    (place.bin / "bad").write_text(text)
    (place.bin / "bad").chmod(0o755)
    assert "compiler" in place.run("eval", PENDULUM, status=1, env={"CC": str(place.bin / "bad")}) and not place.leftovers()


def test_many_programs_with_one_cache(place):
    """They build at the same time in separate folders, and none regards another as dead."""
    processes = [place.start("eval", PENDULUM) for _ in range(12)]
    results = [process.communicate(timeout=120 * SLOWNESS) for process in processes]
    assert {process.returncode for process in processes} == {0} and len({out for out, _ in results}) == 1
    assert not place.leftovers() and len(list(place.cache.iterdir())) == 1


# ---- Drawings ----

RUN = "t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n"


@pytest.mark.parametrize("number", KILLING, ids=lambda number: number.name)
def test_a_drawing_that_is_ended(number, place):
    numbers = place.program("rsvg-convert", SLEEPS)
    (place.work / "run.csv").write_text(RUN)
    process = place.start("plot", "run.csv", "-o", "run.png", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)))
    end_while_it_works(place, process, numbers, number)
    assert set(files_in(place.work)) <= {"run.csv", "run.png.part"}


@pytest.mark.parametrize("name", ["run.png", "run.pdf"])
@pytest.mark.parametrize("text", ["exit 1\n", "kill -9 $$\n", "echo nonsense >&2; exit 3\n"])
def test_a_converter_that_fails(text, name, place):
    place.program("rsvg-convert", text)
    (place.work / "run.csv").write_text(RUN)
    said = place.run("plot", "run.csv", "-o", name, status=1)
    assert "rsvg-convert failed" in said and ("signal 9" in said) == ("kill" in text) and ("nonsense" in said) == ("nonsense" in text)
    assert files_in(place.work) == ["run.csv"] and not place.leftovers()


def test_a_converter_that_is_not_there(place):
    """The error comes before the run is read; SVG needs no converter."""
    said = place.run("plot", "none.csv", "-o", "run.pdf", status=1, env={"PATH": str(place.bin)})
    assert said == "refdyn: rsvg-convert is not installed, which writes .pdf files (Debian: apt install librsvg2-bin)\n"
    assert files_in(place.work) == []
    (place.work / "run.csv").write_text(RUN)
    place.run("plot", "run.csv", "-o", "run.svg", env={"PATH": str(place.bin)})


# ---- A report ----

REPORT = ["report", REFERENCE, "--set", "n_rfe=1", "--until", "0.5", "--methods", "rk4,rk8,rodas5p", "--seconds", "1000"]


def check_report(folder, name):
    """All three files are complete; returns the lines of the table."""
    with open(folder / f"{name}.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert xml.etree.ElementTree.parse(folder / f"{name}.svg") and (folder / f"{name}.html").read_text().endswith("</html>\n")
    assert all(None not in line and None not in line.values() for line in lines)
    return lines


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGXCPU], ids=lambda number: number.name)
def test_a_report_that_is_ended(number, place):
    """It has the runs until then."""
    place.run("sim", REFERENCE, "--set", "n_rfe=1", "--until", "0.1")
    process = place.start(*REPORT, "--tols", "1e-3,1e-4,1e-5", "--steps", "1e-3,5e-4,1e-8", "-o", "out")
    wait_for(lambda: cpu_seconds(process) > 1 + SLOWNESS / 2)  # the references and six runs take a third of that
    process.send_signal(number)
    out, said = process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -number and "interrupted; the report has the runs so far" in said, said
    lines = check_report(place.work / "out", "manipulator")
    assert len([line for line in lines if line["kind"] == "reference"]) == 2 and any(line["result"] == "done" for line in lines if line["kind"] == "run")
    assert "== manipulator" in out and not place.leftovers()
    assert "interrupted" in (place.work / "out" / "manipulator.html").read_text()
    assert files_in(place.work / "out") == ["manipulator.csv", "manipulator.html", "manipulator.svg"]


def test_a_report_that_is_ended_while_it_compiles(place):
    """The results of the variants before remain; the compiler of the present one is ended."""
    numbers = place.program("slow", SLEEPS)
    (place.bin / "often").write_text(f'#!/bin/sh\nif [ -e "{place.bin}/again" ]; then exec slow "$@"; fi\ncase "$*" in *-shared*) touch "{place.bin}/again" ;; esac\nexec cc "$@"\n')
    (place.bin / "often").chmod(0o755)
    process = place.start("report", REFERENCE, "--vary", "n_rfe=1,2", "--until", "0.05", "--methods", "rk8", "--tols", "1e-3", "--seconds", "20", "-o", "out",
                          env={"CC": "often"})
    wait_for(lambda: numbers.exists() and len(numbers.read_text().split()) >= 2, 60)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -signal.SIGTERM and "the report has the runs so far" in said, said
    assert {line["variant"] for line in check_report(place.work / "out", "manipulator")} == {"n_rfe=1"} and not place.leftovers()
    wait_for(lambda: not any(is_alive(int(word)) for word in numbers.read_text().split()))


def test_a_report_that_is_ended_before_it_has_anything(place):
    process = place.start("report", REFERENCE, "--set", "n_rfe=4", "--until", "100", "--methods", "rk8", "-o", "deep/out")
    wait_for(lambda: (place.work / "deep" / "out").exists() and list(place.cache.glob("*.so")) and not place.leftovers())
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60 * SLOWNESS)
    assert process.returncode == -signal.SIGTERM and "before a reference was found" in said, said
    assert not list(place.work.iterdir())
