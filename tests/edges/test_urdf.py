"""Harmful URDF files: large ones, other kinds of files, and files with randomly changed bytes."""
import random

import pytest

from harm import PATIENCE, SECONDS, SLOWNESS, run_harmful
from program import TESTS, refdyn, some

ROBOTS = some((TESTS / "robots").glob("*.urdf"))
HEAD = b'<robot name="r">'


def work(folder, content=None):
    (folder / "work").mkdir(exist_ok=True)
    if content is not None:
        (folder / "work" / "r.urdf").write_bytes(content)
    return folder / "work"


def links(count):
    return b"\n".join(b"<link name='l%d'/>" % i for i in range(count))


MADE = {
    "large": (lambda: HEAD + b" " * (16 << 20), "r.urdf: URDF: larger than 16777216 bytes, the most that is read\n"),
    "long name": (lambda: HEAD + b'<link name="' + b"x" * 2000000 + b'"/>' * 2, None),
    "many links": (lambda: HEAD + links(10001) + b"</robot>", "r.urdf:10001: robot: more than 10000 <link>\n"),
    "many roots": (lambda: HEAD + links(10000) + b"</robot>", "r.urdf:2: link l1: no joint carries it, nor link l0 in line 1; there must be one root\n"),
    "many elements": (lambda: HEAD + b"<a/>" * 4000000 + b"</robot>", "r.urdf:1: XML: more than 200000 elements\n"),
    "many names": (lambda: HEAD + b"".join(b"<a%d/>" % i for i in range(100000)), None),
    "many attributes": (lambda: HEAD + b"<link " + b" ".join(b"a%d=''" % i for i in range(100000)), None),
    "open for ever": (lambda: HEAD + b"<link>" * 2000000, "r.urdf:1: XML: elements are nested more than 100 deep\n"),
    "bytes of 0": (lambda: b"\0" * 1000, None), "wide characters": (lambda: (HEAD + b"<link/></robot>").decode().encode("utf-16"), None),
}


@pytest.mark.parametrize("which", MADE)
def test_files_that_try_to_harm(which, tmp_path):
    make, message = MADE[which]
    work(tmp_path, make())
    said = run_harmful(tmp_path, "import", "r.urdf", "-o", "r.lua")
    assert said == message if message else said.startswith("r.urdf:") and len(said) < 2000 and said.count("\n") == 1


def test_long_chain(tmp_path):
    """Each link carries the next one, and each joint mimics the one before."""
    count = 3000
    joints = "\n".join(f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>' +
                       (f'<mimic joint="j{i - 1}"/>' if i else "") + "</joint>" for i in range(count - 1))
    work(tmp_path, HEAD + links(count) + joints.encode() + b"</robot>")
    run_harmful(tmp_path, "import", "r.urdf", "-o", "r.lua", status=0, written=["r.lua"])


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", ".", "none.urdf"])
def test_files_that_are_none(path, tmp_path):
    work(tmp_path)
    said = run_harmful(tmp_path, "import", path, "-o", "r.lua")
    assert said.startswith(path) and said.count("\n") == 1


def changed(chance, text):
    """Some bytes are changed, some stretches are removed, repeated or moved."""
    text = bytearray(text)
    for _ in range(chance.choice((1, 1, 2, 5))):
        at, length = chance.randrange(len(text)), chance.choice((1, 3, 20, 200))
        piece = text[at:at + length]
        kind = chance.randrange(5)
        if kind == 0:
            text[at] = chance.choice((0, 34, 38, 45, 60, 62, 101, 255, chance.randrange(256)))
        elif kind == 1:
            del text[at:at + length]
        else:
            place = chance.randrange(len(text)) if kind == 2 else at
            text[place:place + (length if kind == 4 else 0)] = piece
    return bytes(text)


def test_changed_bytes(tmp_path):
    """Each is read, or refused with one line that is not a warning; only a complete model is written."""
    chance, statuses = random.Random(74), set()
    texts = [path.read_bytes() for path in ROBOTS]
    for i in range(60):
        (tmp_path / "r.urdf").write_bytes(changed(chance, texts[i % len(texts)]))
        done = refdyn("import", "r.urdf", "-o", "r.lua", "--friction-width", "1", cwd=tmp_path, status=None, timeout=PATIENCE * SECONDS * SLOWNESS)
        statuses.add(done.returncode)
        assert sum(": warning: " not in line for line in done.stderr.splitlines()) == 1, done.stderr
        assert [path.name for path in tmp_path.iterdir() if path.suffix != ".urdf"] == (["r.lua"] if done.returncode == 0 else [])
        if done.returncode == 0:
            assert (tmp_path / "r.lua").read_text().endswith("},\n}\n")
            (tmp_path / "r.lua").unlink()
    assert statuses == {0, 1}
