"""Texts of users in figures, pages and tables: they appear unchanged, and nothing in them is executed."""
import csv
import html.parser
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree

import pytest

from harm import HARMFUL, files_in, run_harmful
from program import REFDYN, REFERENCE, TESTS, refdyn, some

DATA = HARMFUL / "data"
PENDULUM = TESTS / "models" / "double_pendulum.lua"
HEADERS = some(path.name for path in DATA.glob("header_*.csv"))
RUN = "t,a_psi,a_psi_d,energy\n0,1,2,3\n1,2,3,4\n"


def texts_of(figure):
    """All texts of an SVG file, which must be well-formed."""
    return [text.text or "" for text in xml.etree.ElementTree.parse(figure).iter("{http://www.w3.org/2000/svg}text")]


def plot(folder, *arguments, **keywords):
    return run_harmful(folder, "plot", "-o", "figure.svg", *arguments, status=0, written=["figure.svg"], **keywords)


def work(folder):
    (folder / "work").mkdir()
    return folder / "work"


@pytest.mark.parametrize("name", HEADERS)
def test_names_of_columns(name, tmp_path):
    """A name that would end a text, or begin something in SVG, is shown unchanged."""
    shutil.copy(DATA / name, work(tmp_path) / "run.csv")
    plot(tmp_path, "run.csv")
    shown = texts_of(tmp_path / "work" / "figure.svg")
    column = (DATA / name).read_bytes().decode(errors="replace").split("\n")[0].split(",")[-1]
    wanted = re.sub(r"[\x00-\x1f\x7f-\x9f]", "\ufffd", column).strip()
    assert f"Input or course: {wanted}".replace("\ufffd", "") in [text.replace("\ufffd", "") for text in shown], shown


def test_what_the_headers_say(tmp_path):
    """The table of headers contains all special characters of XML and a shell."""
    together = "".join((DATA / name).read_bytes().decode(errors="replace").split("\n")[0] for name in HEADERS)
    assert len(HEADERS) > 15 and all(sign in together for sign in "'\"`$@{}_^~\\%<>&;|!#")


FILES = ["it's.csv", "'; system('touch canary'); '.csv", '"; system("touch canary"); ".csv', "`touch canary`.csv", "$(touch canary).csv",
         "|touch canary", "< touch canary", "-run.csv", "-", "@file.csv", "two\nlines.csv", "{_}^~&.csv", "a%s%n.csv", "<b>&amp;.csv",
         "back\\slash\\", "'", "tab\t.csv", "#.csv", "*.csv"]


@pytest.mark.parametrize("name", FILES)
def test_names_of_files(name, tmp_path):
    (work(tmp_path) / name).write_text(RUN)
    plot(tmp_path, "--", name)
    shown = texts_of(tmp_path / "work" / "figure.svg")
    assert any(text.strip() == re.sub(r"[\n\t]", " ", name).strip() or text == name for text in shown), shown


def test_many_and_long_names(tmp_path):
    """A figure contains only as many texts as are visible, of limited length."""
    names = ["".join(chr(97 + i % 26) for i in range(5000)), "y" * 101]
    (work(tmp_path) / "run.csv").write_text("t,a_psi,a_psi_d,energy," + ",".join(names) + "\n0,1,2,3,4,5\n1,2,3,4,5,6\n")
    points = [f"P{i}_{axis}{rate}" for i in range(700) for rate in ("", "d", "dd") for axis in "xyz"]
    (work_file := tmp_path / "work" / "points.csv").write_text(
        "t,a_psi,a_psi_d," + ",".join(points) + "\n" + "\n".join(",".join(str(t + k) for k in range(3 + len(points))) for t in range(2)) + "\n")
    plot(tmp_path, "run.csv")
    assert max(map(len, texts_of(tmp_path / "work" / "figure.svg"))) < 120
    plot(tmp_path, work_file.name)
    assert "P699" in texts_of(tmp_path / "work" / "figure.svg")


@pytest.mark.parametrize("ending", ["png", "pdf"])
def test_names_in_other_forms(ending, tmp_path):
    """PNG and PDF are made from the same SVG, and nothing else."""
    folder = work(tmp_path)
    for name in FILES:
        (folder / name).write_text("t,a_psi,a_psi_d,energy,<image href='x.png'/>&x;`touch canary`\n0,1,2,3,4\n1,2,3,4,5\n")
    run_harmful(tmp_path, "plot", "-o", f"figure.{ending}", "--", *FILES, status=0, written=[f"figure.{ending}"])
    assert (tmp_path / "work" / f"figure.{ending}").stat().st_size > 10000


def test_names_of_courses_and_units(tmp_path):
    """From the model through the CSV of a motion to its figure."""
    course = "x'; system('touch canary'); print '<b>&"
    (work(tmp_path) / "cart.lua").write_text(
        'local rd = require "refdyn"\nreturn rd.model { name = "cart",\n  links = { { "cart", joint = "x", mass = 1, start_rate = { x = 1 } } },\n'
        f'  courses = function(s) return {{ ["{course}"] = s.t }} end }}\n')
    run_harmful(tmp_path, "sim", "cart.lua", "--until", 1, "-o", "run.csv", status=0, written=["run.csv"])
    assert (tmp_path / "work" / "run.csv").read_text().split("\n")[0].split(",")[-2] == course
    plot(tmp_path, "run.csv")
    assert course in texts_of(tmp_path / "work" / "figure.svg")


class Elements(html.parser.HTMLParser):
    """The elements that a browser sees on a page."""

    def __init__(self):
        super().__init__()
        self.tags, self.texts = set(), []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        assert not any(name.startswith("on") for name, _ in attrs), attrs

    def handle_data(self, data):
        self.texts.append(data)


def test_report(tmp_path):
    """Options, units and varied values, on the page, in its figure and in the table."""
    unit, value = "</td><script>alert(1)</script>", 'a"b</h2><img src=x onerror=alert(1)>'
    (work(tmp_path) / "swing.lua").write_text(
        'local rd = require "refdyn"\nlocal kind = rd.option("kind", "plain")\n'
        f'local p = rd.parameters {{ {{ "k", 4, "{unit}" }} }}\n'
        'return rd.model { name = "swing", links = { { "a", joint = "x", mass = 1, spring = { x = p.k }, start = { x = 1 } } } }\n')
    folder = tmp_path / "work" / "out"
    done = refdyn("report", "swing.lua", "--until", 1, "--methods", "rk4", "--steps", "1e-2", "--seconds", 10, "--vary", f"kind={value},'=1+1",
                  "-o", folder, cwd=tmp_path / "work")
    page = Elements()
    page.feed((folder / "swing.html").read_text())
    assert not {"script", "img", "a", "b"} & page.tags and unit in page.texts and f"kind={value}" in page.texts
    assert texts_of(folder / "swing.svg") and f"kind={value}" in done.stdout
    with open(folder / "swing.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert {line["variant"] for line in lines} == {f"kind={value}", "kind='=1+1"} and all(None not in line for line in lines)


@pytest.mark.parametrize("name", [b"a\xffb.json", b'quote".json', b"back\\slash.json", b"line\nend.json", b"esc\x1b[2J.json", b"tab\t.json"])
def test_names_in_json(name, tmp_path):
    """The result contains the name of a state's file and remains JSON and UTF-8."""
    (tmp_path / "a").mkdir()
    with open(bytes(tmp_path) + b"/" + name, "w") as file:
        file.write('{"q": [0, 0]}')
    done = subprocess.run([REFDYN, "modes", PENDULUM, "--at", bytes(tmp_path) + b"/" + name], capture_output=True, check=True)
    found = json.loads(done.stdout.decode())["at"]
    assert found == (bytes(tmp_path) + b"/" + name).decode(errors="replace")


MESSAGES = {
    "empty": r":1: run: the file is empty", "blank_lines": r":1: run: the header does not begin", "header_alone": r":2: run: there are no rows",
    "short_row": r":2: run: 2 fields under 3 names", "long_row": r":2: run: 4 fields under 3 names",
    "missing_cell": r":3: run: a_psi: the field is empty", "text_cell": r":2: run: a_psi: 'one' is not a finite number",
    "half_number": r":2: run: a_psi: '1abc' is not a finite", "nan": r":2: run: a_psi: 'nan' is not a finite", "infinite": r":2: run: a_psi: '-inf'",
    "too_large": r":2: run: a_psi: '1e999'", "hexadecimal": r":2: run: a_psi: '0x10'", "twice": r":1: run: two columns are called 'a_psi'",
    "twice_time": r":1: run: two columns are called 't'", "no_time": r":1: run: the header does not begin with t", "zero_byte": r":2: run: contains a byte 0",
    "escape": r":1: run: column 2: a control character", "bytes": r":1: run: ", "quoted": r":2: run: 3 fields under 4 names",
    "old_ends": r":1: run: column 3: a control character", "cell_escape": r":2: run: a_psi: '\\x1b\[31m' is no", "semicolons": r":1: run: semicolons separate the columns; write commas",
}


def test_every_bad_run_is_listed():
    assert set(MESSAGES) == {path.stem[len("run_"):] for path in DATA.glob("run_*.csv")}


@pytest.mark.parametrize("which", MESSAGES)
def test_bad_run(which, tmp_path):
    shutil.copy(DATA / f"run_{which}.csv", work(tmp_path) / "run.csv")
    said = run_harmful(tmp_path, "plot", "run.csv", "-o", "figure.svg")
    assert re.match("run.csv" + MESSAGES[which], said), said
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f]", said), said


def test_runs_that_go(tmp_path):
    """CR LF, a byte order mark, blanks, empty lines and a pipe; an unterminated last line causes a message."""
    folder = work(tmp_path)
    (folder / "a.csv").write_bytes(b"\xef\xbb\xbft, a_psi ,a_psi_d,energy\r\n0,1 ,2,3\r\n\r\n1, 2,3,4\r\n")
    assert plot(tmp_path, "a.csv") == "" and "a_psi" in texts_of(folder / "figure.svg")
    (folder / "b.csv").write_text(RUN + "2,3,4,0.12")
    assert plot(tmp_path, "b.csv") == "b.csv:4: warning: run: the last line is incomplete and ignored\n"
    refdyn("sim", REFERENCE, "--set", "n_rfe=1", "--until", "0.1", "--step", "1e-3", "-o", folder / "c.csv")
    with open(folder / "c.csv") as file:
        plot(tmp_path, "/dev/stdin", stdin=file)
    assert "E_x" not in texts_of(folder / "figure.svg") and "Height" in texts_of(folder / "figure.svg")


@pytest.mark.parametrize("what", ["/dev/zero", "/dev/urandom", "/dev/null", ".", "line", "wide"])
def test_endless_runs(what, tmp_path):
    """Endless input, or lines longer than any run has, costs neither time nor memory."""
    folder = work(tmp_path)
    if what == "line":
        (folder / what).write_bytes(b"t,a_psi,a_psi_d\n" + b"1" * (17 << 20))
    if what == "wide":
        (folder / what).write_text("t," + ",".join(f"c{i}" for i in range(20000)) + "\n0\n")
    said = run_harmful(tmp_path, "plot", what, "-o", "figure.svg")
    assert what != "line" or "line:2: run: the line has more than 16777216 bytes" in said
    assert said.startswith(what) and ": run: " in said and "figure.svg" not in files_in(folder), said


def test_a_long_run_is_thinned_out(tmp_path):
    """As many rows as are visible, from the first to the last one."""
    folder = work(tmp_path)
    (folder / "long.csv").write_text("t,a_psi,a_psi_d,energy\n" + "".join(f"{i},{i},1,2\n" for i in range(100001)))
    plot(tmp_path, "long.csv")
    figure = (folder / "figure.svg").read_text()
    assert 10000 < len(figure) < 200000 and {"0", "100", "× 10³"} <= set(texts_of(folder / "figure.svg"))
