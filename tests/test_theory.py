"""gen/theory.md: every citation of it leads to a section, and its symbols are names in the code and in the emitted C."""
import pathlib
import re

import pytest

from program import SOURCE, refdyn

THEORY = SOURCE / "gen" / "theory.md"
FOLDERS = ("gen", "runtime", "models", "tests", "generated")
SUFFIXES = {".c", ".h", ".def", ".md", ".lua", ".py"}
NUMBERS = r"\d+(?:\.\d+)?(?:(?:,| and| to)\s+\d+(?:\.\d+)?)*"
CITATION = re.compile(rf"\btheory(?:\]\([^)]*\))?,?\s+(?:sect\.\s+)?({NUMBERS})", re.I)
EMISSION = "all,tangent,tangent_vectors,d_qdd,d_qdd_free,d_force,d_inverse,d_statics,d_rows,inverse"


def read(path):
    """A file as running text: a citation may continue after the star of the next comment line."""
    return re.sub(r"\n\s*(\*(?!/)|#|--|\")?\s*", " ", path.read_text())


def documents():
    """All files that may cite the page, except the page itself, which cites its sections without its name."""
    here = [SOURCE / "README.md"] + [path for folder in FOLDERS for path in sorted((SOURCE / folder).rglob("*"))]
    return [path for path in here if path.suffix in SUFFIXES and path not in (THEORY, pathlib.Path(__file__).resolve())]


def numbers(text):
    return re.findall(r"\d+(?:\.\d+)?", text)


def sections():
    return re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", THEORY.read_text(), re.M)


def cited(text):
    """Section numbers that a text cites, all of "sect. 4.1, 4.2 and 4.3"."""
    return [number for found in CITATION.findall(text) for number in numbers(found)]


def test_sections_are_numbered_in_order():
    places = [tuple(map(int, number.split("."))) for number in sections()]
    assert len(places) > 50 and places == sorted(set(places))


def test_citations_lead_to_sections():
    known, seen = set(sections()), {}
    for path in documents():
        for number in cited(read(path)):
            seen.setdefault(number, path.relative_to(SOURCE))
    wrong = {number: str(path) for number, path in seen.items() if number not in known}
    assert len(seen) > 20, f"only {sorted(seen)} are cited"
    assert not wrong


def test_sections_within_the_page():
    text = re.sub(r"Featherstone,\s+sect\.", "", read(THEORY))
    inner = [number for found in re.findall(rf"\bsect\. ({NUMBERS})", text) for number in numbers(found)]
    assert len(inner) > 30 and not set(inner) - set(sections())


def test_no_page_beside_it_is_cited():
    """The page is in the repository; the documents that it was written from are not."""
    wrong = [str(path.relative_to(SOURCE)) for path in documents()
             if re.search(r"formulation(\.md)?,?\s+sect|chapter,\s+eq", read(path), re.I)]
    assert not wrong


def symbols(section, column):
    """(symbol, name) of all names in one column of a section's table."""
    table = re.search(rf"^### {re.escape(section)} .*?(?=^##)", THEORY.read_text(), re.M | re.S).group()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("|")][2:]
    found = [(row[0], name) for row in rows for name in re.findall(r"`([^`]+)`", row[column])]
    assert len(found) > 15
    return found


@pytest.mark.parametrize("section, folder", [("1.2", "gen"), ("8.11", "runtime")])
def test_symbols_are_names_in_the_code(section, folder):
    code = [re.sub(r"/\*.*?\*/", " ", path.read_text(), flags=re.S) for path in sorted((SOURCE / folder).rglob("*.[ch]"))]
    words = {word for text in code for word in re.findall(r"\w+", text)}
    assert words and not [(symbol, name) for symbol, name in symbols(section, 2) if name not in words]


@pytest.fixture(scope="module")
def emitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("theory")
    for part, options in ("all", ["--emit", EMISSION]), ("sweeps", ["--accelerations", "recursive", "--emit", "d_qdd"]):
        refdyn("gen", SOURCE / "models" / "manipulator.lua", "--set", "n_rfe=3", *options, "-o", folder / part)
    return " ".join(path.read_text() for path in sorted(folder.rglob("*.[ch]")))


def test_symbols_are_names_in_the_emitted_code(emitted):
    """FRAME is any coordinate, ROW any row or a value that rows share, POINT the point; one of three axes is enough."""
    def pattern(name):
        of = {"FRAME": r"[a-z]+(_[a-z]+)*(_\d+)?", "ROW": r"(row_\d|shared)", "POINT": r"point_E"}
        return re.sub("FRAME|ROW|POINT", lambda found: of[found.group()], re.sub(r"(?<=_)x(?=d?$)", "[xyz]", name))
    missing = [(symbol, name) for symbol, name in symbols("1.2", 3) if not re.search(rf"\b{pattern(name)}\b", emitted)]
    assert emitted and not missing
