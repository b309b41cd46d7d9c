"""Rewrites the program's messages on stderr for users of Python."""
from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping

PRIVATE = "refdyn-"  # prefix of the names of private folders
ARGUMENTS = {"until": "t_end", "from": "from_", "table": "cases"}  # arguments whose names differ from their options
OPTIONS = ("accuracy", "at", "every", "hold", "inputs", "lanes", "method", "modes", "release", "singular", "stabilise", "start", "step", "step-max",
           "stop", "threads", "tol", "verify", "way", *ARGUMENTS)
VALUES = ("baumgarte", "baumgarte-auto", "downhill", "load", "none", "pass", "path", "project", "statics", "stop")
OPTION = re.compile(rf"--({'|'.join(sorted(OPTIONS, key=len, reverse=True))})(?![\w-])(?: ({'|'.join(VALUES)})(?![\w-]))?")
LONG_NUMBER = re.compile(r"-?\b\d+\.\d{12,}(?:e[+-]?\d+)?\b|(?<![\w.])-0(?![\w.])")


def shown(text: str, places: Mapping[str, str] = {}) -> str:
    """Replaces a file cases.csv in a private folder by `<cases>`, and each folder of `places` by its original."""
    for folder, name in places.items():
        text = text.replace(folder, name)
    return re.sub(re.escape(f"{tempfile.gettempdir()}/{PRIVATE}") + r"\w{8}/(text|state|cases|inputs)\.\w+", r"<\1>", text)


def argument(found: re.Match[str]) -> str:
    name = ARGUMENTS.get(found[1], found[1].replace("-", "_"))
    return f'{name}="{found[2]}"' if found[2] else name


def of_python(text: str) -> str:
    """Writes options as arguments: `start="project"` for `--start project`."""
    if text.startswith("unknown option"):
        return text
    text = text.replace("the CSV has no column", "a motion has no column")
    return re.sub(r"^refdyn: ", "", OPTION.sub(argument, text), flags=re.M)


def rounded(text: str) -> str:
    """Rounds the numbers of a state, which the program prints exactly, to ten digits."""
    return LONG_NUMBER.sub(lambda found: f"{float(found[0]) or 0.0:.10g}", text)


def without_summary(text: str) -> str:
    """Removes the summary of a failed motion and the name of its private file from the message of `refdyn sim`."""
    return re.sub(r"^method {5,}.*?(?=^refdyn: |\Z)|^refdyn: what was computed until then is in [^\n]*", "", text, flags=re.M | re.S).strip()
