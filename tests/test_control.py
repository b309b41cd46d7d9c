"""docs/control-in-c.md: its commands run, and its programs print what the page says."""
import os
import re
import subprocess

import pytest

from program import BUILD, SOURCE, check, close
from test_readme import ELSEWHERE

PAGE = (SOURCE / "docs" / "control-in-c.md").read_text()
EXAMPLES = SOURCE / "docs" / "control"
WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder in which all commands of the page ran, and what they printed. Less optimisation compiles in a third of the time."""
    folder = tmp_path_factory.mktemp("control")
    for name in ("docs", "models", "runtime"):
        (folder / name).symlink_to(SOURCE / name)
    (folder / "build" / "release" / "bin").mkdir(parents=True)
    (folder / "build" / "release" / "bin" / "refdyn").symlink_to(BUILD / "bin" / "refdyn")
    lines = "".join(re.findall(r"^```sh\n(.*?)^```", PAGE, re.M | re.S)).replace("cc -O2 ", "cc -O0 ")
    assert not [line for line in lines.splitlines() if ELSEWHERE.match(line)], "lines that do not run"
    done = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", lines], cwd=folder, env={**os.environ, "REFDYN_INCLUDE": str(SOURCE / "runtime")},
                          capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return folder, done.stdout


@pytest.fixture(scope="module")
def run_installed(tmp_path_factory):
    """What the commands for an installation print in an empty folder, without the sources."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run(["cmake", "--install", BUILD, "--prefix", folder / "prefix"], check=True, capture_output=True)
    lines = re.search(r"^```\n(export PATH=.*?)^```", PAGE, re.M | re.S)[1]
    done = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", lines.replace("cc -O2 ", "cc -O0 ")], cwd=folder,
                          env={**os.environ, "PREFIX": str(folder / "prefix")}, capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert {path.name for path in EXAMPLES.iterdir()} | {"arm.lua"} == {path.name for path in (folder / "prefix" / "share" / "refdyn" / "control").iterdir()}
    return folder, done.stdout


@pytest.mark.parametrize("how", ["run", "run_installed"])
def test_computed_torque(how, request):
    """The model reduces the errors of the axes by two orders, to what the page states."""
    printed = request.getfixturevalue(how)[1]
    without, with_model = map(float, re.search(r"error without the model (\S+) rad, with inverse dynamics (\S+) rad", printed).groups())
    shown, shown_without = map(float, re.search(r"stay within (\S+) rad .* off\s+by (\S+) rad", PAGE, re.S).groups())
    check([close("error with the model", [with_model], [shown], 0.05), close("error without", [without], [shown_without], 0.05)])
    assert with_model < 0.01 * without
    median, longest = map(float, re.search(r"controller: median (\S+) us, longest of 1500 (\S+) us", printed).groups())
    assert 0 < median < longest and "TIME_UTC" not in (EXAMPLES / "computed_torque.c").read_text(), "the clock is too coarse"


def test_vibration(run):
    found = [list(map(float, row)) for row in re.findall(r"^(\S+) s: the hand swings by (\S+) mm, .* by (\S+) mm$", run[1], re.M)]
    shown = [list(map(float, row)) for row in re.findall(r"^\| (\S+) s \| (\S+) mm \| (\S+) mm \|$", PAGE, re.M)]
    assert len(found) == len(shown) == 3 and all(flexible < 0.1 * rigid for _, rigid, flexible in found)
    check([close(f"{row[0]} s", of_program, row, 0.05, max(row[2], 0.01)) for of_program, row in zip(found, shown)])


def test_linkage(run):
    """The accelerations under the torque are those for which it was computed."""
    assert float(re.search(r"acceleration (\S+) rad/s\^2", run[1])[1]) == pytest.approx(12, rel=1e-9)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_examples_compile_without_a_warning(run, compiler):
    folder, _ = run
    sources = sorted(EXAMPLES.glob("*.c"))
    assert len(sources) == 3 and all(f"docs/control/{source.name}" in PAGE for source in sources)
    for source in sources:
        include = [word for name in ("runtime", "build/control", "build/control/soft", "build/control/linkage") for word in ("-I", folder / name)]
        subprocess.run([compiler, "-std=c11", "-D_POSIX_C_SOURCE=199309L", *WARNINGS, *include, "-fsyntax-only", source], check=True)
