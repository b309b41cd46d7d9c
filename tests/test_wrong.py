"""Each file of wrong/ is refused by the program with exactly the messages that its first comments name."""
import re

import pytest

from program import TESTS, refdyn

FILES = sorted((TESTS / "wrong").glob("*.lua"))


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_refused(path, tmp_path):
    comments = path.read_text().splitlines()
    expected = [comment[len("-- expect: "):] for comment in comments if comment.startswith("-- expect: ")]
    settings = [word for comment in comments if comment.startswith("-- set: ") for word in ("--set", comment[len("-- set: "):])]
    assert expected, "names no message"
    for arguments in (["check", path], ["gen", path, "-o", tmp_path / "out"]):
        done = refdyn(*arguments, *settings, status=1)
        assert done.stdout == ""
        assert done.stderr.splitlines() == [f"{path}:{line}" for line in expected]
    assert not (tmp_path / "out").exists()


def test_all_kinds_are_there():
    text = "".join(path.read_text() for path in FILES)
    for what in ("unknown field", "nearest known", "positive number", "chain", "twice", "unit", "compar", "rd.where"):
        assert re.search(what, text), what
