"""What the program says on stderr, as a user of Python reads it."""
from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping

PRIVATE = "refdyn-"  # begin of the names of private folders
ARGUMENTS = {"until": "t_end", "from": "from_", "table": "cases"}  # that have other names than their options
OPTIONS = ("accuracy", "at", "every", "hold", "inputs", "lanes", "method", "modes", "release", "singular", "stabilise", "start", "step", "step-max",
           "stop", "threads", "tol", "verify", "way", *ARGUMENTS)
VALUES = ("baumgarte", "baumgarte-auto", "downhill", "load", "none", "pass", "path", "project", "statics", "stop")
OPTION = re.compile(rf"--({'|'.join(sorted(OPTIONS, key=len, reverse=True))})(?![\w-])(?: ({'|'.join(VALUES)})(?![\w-]))?")
LONG_NUMBER = re.compile(r"-?\b\d+\.\d{12,}(?:e[+-]?\d+)?\b|(?<![\w.])-0(?![\w.])")


def shown(text: str, places: Mapping[str, str] = {}) -> str:
    """With `<cases>` for the file cases.csv of a private folder, and folders of `places` by what they stand for."""
    for folder, name in places.items():
        text = text.replace(folder, name)
    return re.sub(re.escape(f"{tempfile.gettempdir()}/{PRIVATE}") + r"\w{8}/(text|state|cases|inputs)\.\w+", r"<\1>", text)


def argument(found: re.Match[str]) -> str:
    name = ARGUMENTS.get(found[1], found[1].replace("-", "_"))
    return f'{name}="{found[2]}"' if found[2] else name


def of_python(text: str) -> str:
    """Options as arguments: `start="project"` for `--start project`."""
    if text.startswith("unknown option"):
        return text
    text = text.replace("the CSV has no column", "a motion has no column")
    return re.sub(r"^refdyn: ", "", OPTION.sub(argument, text), flags=re.M)


def rounded(text: str) -> str:
    """Numbers that tell of a state with as many digits as one reads."""
    return LONG_NUMBER.sub(lambda found: f"{float(found[0]) or 0.0:.10g}", text)


def without_summary(text: str) -> str:
    """What `refdyn sim` says of a motion that fails, without the summary, and the file that nobody sees, behind it."""
    return re.sub(r"^method {5,}.*?(?=^refdyn: |\Z)|^refdyn: what was computed until then is in [^\n]*", "", text, flags=re.M | re.S).strip()
