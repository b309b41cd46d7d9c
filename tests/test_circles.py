"""No files, and no folders, of the generator and of the runtime call each other in a circle, according to the symbols that the linker sees."""
import collections
import subprocess

import pytest

from program import BUILD, SOURCE, sources


def object_files():
    """Objects of the build by source file, for existing sources: a build may keep objects of deleted files."""
    found = {}
    for path in (BUILD / "CMakeFiles").rglob("*.c.o"):  # other tests add and remove folders beside it
        within = str(path.relative_to(BUILD)).partition(".dir/")[2]
        if within.startswith(("gen/", "runtime/")) and (SOURCE / within[:-2]).exists():
            found[within[:-2]] = path
    return found


def symbols(objects):
    """Names that each file defines for others, and names that it needs from them."""
    given, taken = collections.defaultdict(set), collections.defaultdict(set)
    file_of = {str(path): file for file, path in objects.items()}
    listing = subprocess.run(["nm", "-A", "-P", *file_of], capture_output=True, text=True, check=True).stdout
    for line in listing.splitlines():
        path, _, rest = line.partition(": ")
        name, kind = rest.split()[:2]
        if kind == "U":
            taken[file_of[path]].add(name)
        elif kind.isupper():
            given[file_of[path]].add(name)
    return given, taken


@pytest.fixture(scope="module")
def calls():
    """(file, file) to the names for which the first file needs the second."""
    objects = object_files()
    assert objects, f"no object of gen/ or runtime/ in {BUILD}: build first"
    missing = {str(path.relative_to(SOURCE)) for folder in ("gen", "runtime") for path in sources(folder, "*.c")} - set(objects)
    alone = ("runtime/bindings/gsl/", "runtime/bindings/python/", "runtime/tool/commands/export/", "runtime/tool/support/hdf5/",
             "runtime/tool/support/system/fortran_runtime.c", "runtime/tool/support/xml/")  # where a library may be missing or is contained
    assert all(file.startswith(alone) for file in missing), f"without an object: {sorted(missing)}"
    given, taken = symbols(objects)
    homes = collections.defaultdict(set)
    for file, names in given.items():
        for name in names:
            homes[name].add(file)
    found = collections.defaultdict(set)
    for file, names in taken.items():
        for name in names:
            if len(homes[name]) == 1 and file not in homes[name]:
                found[file, *homes[name]].add(name)
    assert len(found) > len(objects)
    return found


def reached(edges, start):
    """All nodes that can be reached."""
    seen, waiting = set(), [start]
    while waiting:
        new = {to for by, to in edges if by == waiting[-1]} - seen
        waiting.pop()
        seen |= new
        waiting += new
    return seen


def circles(edges):
    """Sets of nodes that can reach each other; each set is reported once, in order."""
    reach = {node: reached(edges, node) for node in {node for edge in edges for node in edge}}
    return sorted({tuple(sorted(other for other in reach[node] if node in reach[other])) for node in reach if node in reach[node]})


def told(calls):
    """Circles and the names that form them, as text."""
    lines = []
    for circle in circles(calls):
        lines.append(f"a circle of {len(circle)}: {', '.join(circle)}")
        lines += [f"  {by} calls {to} for {', '.join(sorted(names)[:4])}" for (by, to), names in sorted(calls.items()) if {by, to} <= set(circle)]
    return "\n".join(lines)


def by_folder(calls, depth):
    """The same for folders; deeper folders count as their ancestor of the given depth."""
    found = collections.defaultdict(set)
    for (by, to), names in calls.items():
        folders = tuple("/".join(file.split("/")[:-1][:depth]) for file in (by, to))
        if folders[0] != folders[1]:
            found[folders] |= names
    return found


def test_circles_are_seen():
    edges = {("a", "b"), ("b", "c"), ("c", "a"), ("d", "a"), ("c", "e"), ("f", "g"), ("g", "f")}
    assert circles(edges) == [("a", "b", "c"), ("f", "g")] and circles({("a", "b"), ("a", "c"), ("b", "c")}) == []
    calls = {("gen/one/x.c", "gen/two/y.c"): {"y"}, ("gen/two/deep/z.c", "gen/one/w.c"): {"w"}}
    assert not circles(calls) and circles(by_folder(calls, 2)) == [("gen/one", "gen/two")] and not circles(by_folder(calls, 1))
    assert not circles(by_folder(calls, 3))


def test_no_circle_of_files(calls):
    found = told(calls)
    assert not found, "\n" + found


def test_no_circle_of_folders(calls):
    for depth in range(1, 1 + max(file.count("/") for edge in calls for file in edge)):
        found = told(by_folder(calls, depth))
        assert not found, f"folders down to depth {depth}:\n{found}"
