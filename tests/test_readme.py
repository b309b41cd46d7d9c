"""Every command line of every page runs: the lines of its fenced blocks marked `sh`.

The blocks of a page run one after another in a copy of the repository, those of the tutorial in an empty folder. A block that begins with a
file's name (```lua arm.lua) is this file, or is inserted into it before the line that begins with the third word (```lua arm.lua hold).
Commands that build or test the repository itself are omitted, since this test is part of them. The main job, models/run, runs once in the
repository itself.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

from program import BUILD, CORE_LIBRARY, LONG, SOURCE, some

ELSEWHERE = re.compile(r"\s*(#.*)?$|(sudo |git |export |cmake |ctest |cpack |tests/run|models/run|\.ci/run)")
TUTORIAL = SOURCE / "docs" / "tutorial.md"
FOLDERS = [path for path in SOURCE.iterdir() if path.is_dir() and path.name not in ("build", ".git")]  # other tests add and remove folders in build
DOCUMENTS = some([*SOURCE.glob("*.md"), *(path for folder in FOLDERS for path in folder.rglob("*.md"))])


def commands(document):
    blocks = re.findall(r"^```sh\n(.*?)^```", document.read_text(), re.M | re.S)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [line for line in lines if not ELSEWHERE.match(line)]


def run(script, folder, timeout):
    env = {**os.environ, "REFDYN_INCLUDE": str(SOURCE / "runtime"), "PATH": f"{BUILD / 'bin'}:{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
    return subprocess.run(["bash", "-e", "-o", "pipefail", "-c", script], cwd=folder, env=env, capture_output=True, text=True,
                          timeout=timeout)


def steps(document):
    """The blocks of a page in order: (language, file, line before which the text goes, text)."""
    return re.findall(r"^```(\w+)(?: (\S+))?(?: (\S+))?\n(.*?)^```", document.read_text(), re.M | re.S)


def write(path, before, text):
    if before:
        was = path.read_text()
        place = was.index(f"\n  {before} ") + 1
        text = was[:place] + text + was[place:]
    path.write_text(text)


def test_tutorial(tmp_path):
    said = ""
    for language, name, before, text in steps(TUTORIAL):
        if name:
            write(tmp_path / name, before, text)
        elif language == "sh" and not ELSEWHERE.match(text):
            done = run(text, tmp_path, 300)
            assert done.returncode == 0, f"{text}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
            said += done.stdout + done.stderr
    for figure in ("swing.svg", "follow.svg"):
        assert (tmp_path / figure).read_text().rstrip().endswith("</svg>")
    assert re.search(r"^ +1 +6\.45\d* ", said, re.M) and re.search(r"^ +1 +4\.04\d* ", said, re.M), said
    assert re.search(r"^upper_psi +-?\d", said, re.M), said
    assert re.search(r"^missing torque: 5.906 N m$", said, re.M), said


PAGES = [path for path in DOCUMENTS if path not in (TUTORIAL, SOURCE / "docs" / "python.md", SOURCE / "docs" / "casadi.md", SOURCE / "docs" / "fmi.md", SOURCE / "docs" / "control-in-c.md")]  # test_python.py, test_casadi.py, test_fmi.py and test_control.py run the last four


@pytest.mark.parametrize("document", PAGES, ids=[str(path.relative_to(SOURCE)) for path in PAGES])
def test_commands(document, tmp_path):
    copy = tmp_path / "refdyn"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("build", ".git", "__pycache__"))
    (copy / "build" / "release" / "bin").mkdir(parents=True)
    for program in ("refdyn", "test_editor"):
        (copy / "build" / "release" / "bin" / program).symlink_to(BUILD / "bin" / program)
    for language, name, before, text in steps(document):
        if name:
            write(copy / name, before, text)
    core, of_page = "runtime/core/*/*.c", 0
    for line in commands(document):
        of_page += core in line
        line = line.replace("cc -O2 ", "cc -O0 ")  # the same programs in a third of the time
        done = run(line.replace(core, str(CORE_LIBRARY)) if of_page > 1 and not LONG else line, copy, 300)
        assert done.returncode == 0, f"{line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def anchors(document):
    """Names of the headings of a page, as in links to them."""
    text = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in re.findall(r"^#+ (.*?)\s*$", text, re.M)}


def test_links_lead_somewhere():
    for document in DOCUMENTS:
        for target, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", document.read_text()):
            path = document.parent / target if target else document
            assert "://" in target or path.exists(), f"{document.relative_to(SOURCE)}: {target}"
            assert "://" in target or not anchor or anchor in anchors(path), f"{document.relative_to(SOURCE)}: {target}#{anchor}"


def test_main_job():
    done = subprocess.run([SOURCE / "models" / "run"], capture_output=True, text=True, timeout=500,
                          env={**os.environ, "REFDYN": str(BUILD / "bin" / "refdyn")})
    assert done.returncode == 0, done.stdout + done.stderr
    table = re.findall(r"^end-effector .*\[m\] +(\S+) +(\S+)$", done.stdout, re.M)
    assert len(table) == 6 and all(float(printed) == abs(float(found)) for printed, found in table), done.stdout
    for name in ("figures.svg", "reference_motion.svg"):
        assert (SOURCE / "build" / "chapter" / name).read_text().rstrip().endswith("</svg>")


def test_committed_figure_is_small():
    assert (SOURCE / "models" / "reference_motion.svg").stat().st_size < 200_000
