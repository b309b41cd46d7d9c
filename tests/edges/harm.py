"""Runs the program on harmful files in a separate folder, and checks that no harm was done."""
import os
import pathlib
import resource
import subprocess

from program import REFDYN, TESTS

HARMFUL = TESTS / "harmful"
SECONDS, MEGABYTES = 10, 512
PATIENCE = 4  # wall time may be longer by this factor, when other programs run: beyond it the program must be waiting for something
SLOWNESS = float(os.environ.get("REFDYN_SLOWNESS", "1"))  # a build with sanitizers needs more time and memory


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in pathlib.Path(folder).rglob("*") if path.is_file())


def cpu_seconds():
    """Of all processes that have ended so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_harmful(folder, *arguments, status=1, written=(), stdin=subprocess.DEVNULL):
    """
    Runs the program in `folder`/work, which is made when it is missing. Home, cache and temporary folder lie beside it.
    The program has to end with `status` within the bounds on time and memory. It may add the files `written` to the
    folder and to its cache, and no others. The result is the standard error.
    """
    work, private = pathlib.Path(folder) / "work", pathlib.Path(folder) / "private"
    for path in (work, private / "tmp", private / "home"):
        path.mkdir(parents=True, exist_ok=True)
    before = files_in(work)
    environment = {**os.environ, "HOME": str(private / "home"), "TMPDIR": str(private / "tmp"),
                   "REFDYN_CACHE": str(private / "cache"), "XDG_CACHE_HOME": str(private / "xdg")}
    used = cpu_seconds()
    with open(private / "stderr", "w+", errors="replace") as errors, open(private / "stdout", "w") as output:
        process = subprocess.Popen([REFDYN, *map(str, arguments)], cwd=work, env=environment, stdin=stdin, stdout=output,
                                   stderr=errors, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CORE, (0, 0)))
        try:
            process.wait(timeout=PATIENCE * SECONDS * SLOWNESS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise AssertionError(f"refdyn {arguments}: has no end") from None
        errors.seek(0)
        text = errors.read()
    used = cpu_seconds() - used
    assert used <= SECONDS * SLOWNESS, f"refdyn {arguments}: took {used:.1f} s"
    assert process.returncode == status, f"refdyn {arguments}: exit status {process.returncode}, not {status}\n{text[-2000:]}"
    added = sorted(set(files_in(work)) - set(before) - set(written))
    assert not added, f"refdyn {arguments} wrote {added}"
    assert not files_in(private / "home") and not files_in(private / "tmp"), "files were left behind"
    return text


def peak_megabytes(*arguments, cwd):
    """Largest resident memory of the program alone, in MB; it is told by a small process of its own."""
    script = ("import os, resource, subprocess, sys\n"
              "subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)\n"
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)\n")
    done = subprocess.run(["python3", "-c", script, REFDYN, *map(str, arguments)], capture_output=True, text=True, cwd=cwd,
                          timeout=PATIENCE * SECONDS * SLOWNESS)
    return float(done.stdout)
