"""Pages and comments speak of what there is: folders stand in their README, files exist, "is written only by" holds."""
import functools
import re
import subprocess

import pytest

from program import SOURCE, some

TRACKED = subprocess.run(["git", "-C", SOURCE, "ls-files", "--cached", "--others", "--exclude-standard"], capture_output=True, text=True)
FILES = some(path for path in (TRACKED.stdout.split() if TRACKED.returncode == 0 else
                               (str(path.relative_to(SOURCE)) for path in SOURCE.rglob("*") if path.is_file())) if (SOURCE / path).exists())
NAMES = {path.rpartition("/")[2] for path in FILES}
C_FILES = [path for path in FILES if path.startswith(("gen/", "runtime/", "tests/")) and path.endswith((".c", ".h", ".inc", ".def"))]
PAGES = [path for path in FILES if path.endswith(".md")]
# What the examples of pages and the program write, and a header of C. Emitted files are called NAME....
EXAMPLES = {"arm", "main", "motion", "motion_auto", "heun", "drive", "refdyn_fmu", "math"}


@functools.cache
def text_of(path):
    return (SOURCE / path).read_text()


# ---- Folders ----

def readme_above(folder):
    """The nearest README above a folder, and the folder's path from there."""
    parts = folder.split("/")
    for depth in range(len(parts) - 1, -1, -1):
        page = "/".join([*parts[:depth], "README.md"])
        if page in FILES:
            return page, "/".join(parts[depth:])
    raise AssertionError(f"{folder}: no README above it")


def is_listed(table, name):
    """Whether a row names the folder, as `name/`, `name` or the target of a link."""
    return re.search(rf"[`(\[]{re.escape(name)}/?(?:README\.md)?[`)\]]", table) is not None


@pytest.mark.parametrize("top", ["gen", "runtime", "tests"])
def test_every_folder_stands_in_the_readme_above_it(top):
    folders = some({path.rpartition("/")[0] for path in FILES if path.startswith(top + "/") and path.endswith((".c", ".h", ".py", ".lua"))} - {top})
    if top == "tests":  # its models stand in folders by subject
        folders = some({"/".join(folder.split("/")[:2]) for folder in folders})
    missing = []
    for folder in folders:
        page, name = readme_above(folder)
        table = "\n".join(line for line in text_of(page).splitlines() if line.startswith("|"))
        if not is_listed(table, name):
            missing.append(f"{page}: {name}/")
    assert not missing


def test_missing_folders_are_seen():
    table = "| [base](base) | | `read/` | `tool/support` |"
    assert is_listed(table, "base") and is_listed(table, "read") and is_listed(table, "tool/support") and not is_listed(table, "tool")


# ---- Quantities ----

def test_page_lists_all_quantities():
    """In the order of the table that the generator reads, with its texts."""
    of_def = re.findall(r'^QUANTITY\((\w+), "(.*?)",\s*\w+, "(.*?)", (\w+), \w+\)', text_of("gen/quantities/quantities.def"), re.M)
    when = {"BY_DEFAULT": "by default", "IF_PRESENT": "by default", "ALWAYS": "always", "ON_REQUEST": "if named", "IN_BLOCKS": "if named, or its blocks"}
    table = re.search(r"^\| name \| what it is \| needs \| emitted \|\n\|---.*\n((?:\|.*\n)+)", text_of("docs/commands.md"), re.M)[1]
    assert len(of_def) == len(re.findall(r"^QUANTITY\(", text_of("gen/quantities/quantities.def"), re.M))
    assert table.splitlines() == [f"| `{name}` | {about} | {needs} | {when[use]} |" for name, about, needs, use in of_def]


# ---- Files ----

def test_names_of_c_files_are_unique():
    names = [path.rpartition("/")[2] for path in C_FILES]
    assert [name for name in sorted(set(names)) if names.count(name) > 1] == []


def missing_files(text, folder=""):
    """Names of our kinds of files in a text that no file has."""
    found = re.findall(r"(?<![\w./*<%-])((?:\.\./)*(?:[\w-]+/)*[A-Za-z]\w{2,}\.(?:c|h|inc|def|py|cmake))(?![\w*(]|\.\w)", text)
    missing = []
    for name in found:
        base = name.rpartition("/")[2]
        path = name.replace("../", "")
        is_there = base in NAMES and (path == base or any(file == path or file.endswith("/" + path) for file in FILES))
        if not is_there and base.partition(".")[0] not in EXAMPLES and not base.startswith("NAME"):
            missing.append(name)
    return missing


def test_missing_files_are_seen():
    assert missing_files("`gen/graph/graph.h`, `graph.h`, [x](../gen/graph/graph.c), main.c, <lua.h>") == []
    assert missing_files("`gen/plan/graph.h` and `nowhere.c`") == ["gen/plan/graph.h", "nowhere.c"]


@pytest.mark.parametrize("page", PAGES)
def test_files_that_a_page_names_exist(page):
    text = re.sub(r"^```.*?^```", "", text_of(page), flags=re.M | re.S)
    assert not missing_files(text)


def rows_without_header(text):
    """First rows of tables that no line |---| follows, as after an empty line within a table."""
    lines = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S).splitlines()
    return [line for before, line, after in zip(["", *lines], lines, [*lines[1:], ""])
            if line.startswith("|") and not before.startswith("|") and not re.fullmatch(r"\|[-:| ]+\|", after)]


def test_rows_without_header_are_seen():
    assert rows_without_header("| a | b |\n|---|---|\n| 1 | 2 |\n\n| 3 | 4 |\n") == ["| 3 | 4 |"]


@pytest.mark.parametrize("page", PAGES)
def test_tables_of_a_page_are_whole(page):
    assert not rows_without_header(text_of(page))


def test_files_that_comments_name_exist():
    missing = {}
    for path in C_FILES:
        if path.startswith("tests/") or path.endswith("refdyn_model.h"):
            continue
        names = missing_files(" ".join(re.findall(r"/\*.*?\*/", text_of(path), re.S)))
        if names:
            missing[path] = names
    assert not missing


# ---- Who writes what ----

ASSIGNED = r"(?:\[[^\]]*\]|(?:->|\.)\w+)*\s*(?:[-+*/|&]?=(?!=)|\+\+|--)"


@functools.cache
def code_of(path):
    return re.sub(r"/\*.*?\*/", "", text_of(path), flags=re.S)


def ways_to(name, text):
    """Patterns of what names a member `name`, or in this text a struct of this name: as a member, and by a pointer."""
    if not name.startswith("refdyn_"):
        return [rf"(?:->|\.){re.escape(name)}"]
    members = {member for path in C_FILES if path.endswith(".h") for member in re.findall(rf"struct {name} (\w+);", code_of(path))}
    pointers = set(re.findall(rf"(?<!const )struct {name} \*(?:const )?(\w+)", text))
    return [rf"(?:->|\.){member}\.\w+" for member in sorted(members)] + [rf"\b{pointer}->\w+" for pointer in sorted(pointers)]


def writers(name, files):
    """Files that assign to a member of this name, to one of its own members, or to a member of a struct of this name."""
    return {path.rpartition("/")[2] for path in files for text in [code_of(path)]
            if any(re.search(way + ASSIGNED, text) or re.search(rf"(?:\+\+|--)[\w\->.]*{way}", text) for way in ways_to(name, text))}


def promises():
    """(header, name, file) of every comment that says of a struct or a member that it "is written only by" a file."""
    for path in C_FILES:
        if path.startswith("runtime/core/"):
            text = re.sub(r"\s+(?:\*\s+)?", " ", text_of(path))
            for name, file in re.findall(r"([\w.]+)`? (?:is|are) written only by (\w+\.c)", text):
                yield path, name, file


def test_writers_are_seen():
    assert writers("looks_again", C_FILES) and not writers("no_such_member", C_FILES)
    assert writers("refdyn_step_control", C_FILES)


def test_what_is_written_only_by_one_file():
    core = [path for path in C_FILES if path.startswith("runtime/")]
    found = list(promises())
    assert len(found) > 5
    broken = [f"{path}: {name} is written by {sorted(writers(name, core) - {file})}, too" for path, name, file in found
              if writers(name, core) - {file}]
    assert not broken


def test_changes_are_short():
    """One line each, at most 60 lines a version."""
    versions = text_of("CHANGELOG.md").split("\n## ")[1:]
    assert len(versions) > 1
    for version in versions:
        entries = [line for line in version.splitlines() if line.startswith("- ")]
        assert len(entries) <= 60 and not re.search(r"^ ", version, re.M) and max(map(len, version.splitlines())) <= 160, version[:20]
