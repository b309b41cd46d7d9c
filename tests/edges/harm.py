"""Runs the program on harmful files in a separate folder, and checks that no harm was done."""
import os
import pathlib
import resource
import signal
import subprocess
import threading

from program import REFDYN, SANITIZED, TESTS

HARMFUL = TESTS / "harmful"
SECONDS, MEGABYTES = 10, 512
PATIENCE = 4  # wall time may be longer by this factor, when other programs run: beyond it the program must be waiting for something
SLOWNESS = float(os.environ.get("REFDYN_SLOWNESS", "1"))  # a build with sanitizers needs more time and memory


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in pathlib.Path(folder).rglob("*") if path.is_file())


def run_harmful(folder, *arguments, status=1, written=(), stdin=subprocess.DEVNULL, megabytes=MEGABYTES):
    """
    Runs the program in `folder`/work, which is made when it is missing. Home, cache and temporary folder lie beside it.
    The program has to end with `status` within the bounds on time and memory. The peak of its memory includes that of the
    Python process that starts it, some 50 MB. The program may add the files `written` to the folder and to its cache, and no
    others. The result is the standard error.
    """
    work, private = pathlib.Path(folder) / "work", pathlib.Path(folder) / "private"
    for path in (work, private / "tmp", private / "home"):
        path.mkdir(parents=True, exist_ok=True)
    before = files_in(work)
    environment = {**os.environ, "HOME": str(private / "home"), "TMPDIR": str(private / "tmp"),
                   "REFDYN_CACHE": str(private / "cache"), "XDG_CACHE_HOME": str(private / "xdg")}
    with open(private / "stderr", "w+", errors="replace") as errors, open(private / "stdout", "w") as output:
        process = subprocess.Popen([REFDYN, *map(str, arguments)], cwd=work, env=environment, stdin=stdin, stdout=output,
                                   stderr=errors, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)))
        alarm = threading.Timer(PATIENCE * SECONDS * SLOWNESS, process.kill)
        alarm.start()
        _, ended, usage = os.wait4(process.pid, 0)
        alarm.cancel()
        process.returncode = os.waitstatus_to_exitcode(ended)
        errors.seek(0)
        text = errors.read()
    assert process.returncode != -signal.SIGKILL, f"refdyn {arguments}: has no end"
    used = usage.ru_utime + usage.ru_stime
    assert used <= SECONDS * SLOWNESS, f"refdyn {arguments}: took {used:.1f} s"
    peak = usage.ru_maxrss / 1024 / (3 if SANITIZED else 1)  # sanitizers use memory, too
    assert peak <= megabytes, f"refdyn {arguments}: took {peak:.0f} MB"
    assert process.returncode == status, f"refdyn {arguments}: exit status {process.returncode}, not {status}\n{text[-2000:]}"
    added = sorted(set(files_in(work)) - set(before) - set(written))
    assert not added, f"refdyn {arguments} wrote {added}"
    assert not files_in(private / "home") and not files_in(private / "tmp"), "files were left behind"
    return text
