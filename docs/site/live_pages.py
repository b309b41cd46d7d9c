"""Live pages of the site (docs/live.md): one for each model of the gallery, with the values of its command, and one of the tutorial's arm.

Without the compiler for WebAssembly or without three.js the site has none, and its gallery says why. Each page is one file, also in the site: from
disk, a browser would not let several pages share a script.
"""
import concurrent.futures
import pathlib
import re
import shlex
import subprocess
import tempfile

ROW = re.compile(r"^\| (!\[(\w+)\]\(\S+\)) \| (.*?<br><br>`refdyn sim (.*?) -o \S+`) \|$", re.M)
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?(?: (\S+))?\n(.*?)^```\n", re.M | re.S)
MISSING = re.compile(r"compiles to WebAssembly with|install three\.js")


class NoLivePages(Exception):
    """The command lacks a compiler or three.js; the text is its message."""


def write(program, words, folder, page):
    page.parent.mkdir(parents=True, exist_ok=True)
    done = subprocess.run([program, "view", "--live", *words, "-o", page], cwd=folder, capture_output=True, text=True)
    if done.returncode and MISSING.search(done.stderr):
        raise NoLivePages(done.stderr.strip())
    if done.returncode:
        raise SystemExit(f"{' '.join(words)}: {done.stderr}")


def words_of(command):
    """The arguments of `refdyn sim` as those of `view --live`, and the fragment of the page's address."""
    words, fragment = shlex.split(command), ""
    for option in ("--every", "--from"):
        if option in words:
            at = words.index(option)
            fragment = f"#from={words[at + 1]}" if option == "--from" else fragment
            words[at:at + 2] = []
    return [*words, "--pull"], fragment


def size_of(page):
    return f"{page.stat().st_size / 1e6:.2f} MB"


def gallery(text, program, source, pages):
    """The page of the gallery, in which each picture is a link to the live page of its model."""
    rows = {match[2]: words_of(match[4]) for match in ROW.finditer(text)}
    names = list(rows)
    page = {name: pages / f"{name}.html" for name in names}
    try:
        write(program, rows[names[0]][0], source, page[names[0]])  # compiles what all pages share
    except NoLivePages as missing:
        return text.replace("\n\n", f"\n\nThis site is built without [live pages](live.md): {missing}.\n\n", 1)
    with concurrent.futures.ThreadPoolExecutor(2) as executor:
        list(executor.map(lambda name: write(program, rows[name][0], source, page[name]), names[1:]))

    def linked(match):
        picture, name, words = match[1], match[2], match[3]
        start = f'<a href="../live/{name}.html{rows[name][1]}">'
        return f"| {start}{picture}</a> | {words}<br><br>{start}Move it</a> ({size_of(page[name])}) |"
    total = sum(one.stat().st_size for one in page.values()) / 1e6
    text = text.replace("\n\n", "\n\n**Each picture opens a [live page](live.md)**: move the sliders, watch the motion, and pull the named points with the pointer. Each page is "
                        f"one file that you can save and send; all {len(page)} have {total:.1f} MB. For a model of your own, `refdyn view --live --pull MODEL.lua -o PAGE.html` "
                        "writes such a page.\n\n", 1)
    return ROW.sub(linked, text)


def tutorial(text, program, pages):
    """The page of the tutorial, with the page that its command writes below the command."""
    with tempfile.TemporaryDirectory() as folder:
        model = pathlib.Path(folder) / "arm.lua"
        for block in BLOCK.finditer(text):
            language, name, before, lines = block.groups()
            command = re.search(r"^refdyn view --live (.*) -o arm\.html$", lines, re.M)
            if name == model.name and not before:
                model.write_text(lines)
            elif name == model.name:
                was = model.read_text()
                at = was.index(f"\n  {before} ") + 1
                model.write_text(was[:at] + lines + was[at:])
            elif language == "sh" and command:
                try:
                    write(program, shlex.split(command[1]), folder, pages / "arm.html")
                except NoLivePages:
                    return text
                frame = '\n<iframe src="../live/arm.html#from=statics" title="The arm of this page, live" width="100%" height="1040"></iframe>\n'
                return text[:block.end()] + frame + text[block.end():]
    raise SystemExit("the tutorial has no command for a live page")
