"""Rewrites the program's messages on stderr for users of Python."""
from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping

PRIVATE = "refdyn-"  # prefix of the names of private folders
ARGUMENTS = {"until": "t_end", "from": "from_", "emit": "quantities"}  # arguments whose names differ from their options
FLAGS = ("check", "drives", "floating", "fold", "for_casadi", "for_lanes", "live", "move_held", "pull", "realise", "verify")  # arguments that are True or False
OPTIONS = ("accuracy", "after", "at", "before", "derivatives", "E", "eta", "every", "flexible", "friction-width", "held-out", "hold", "inputs", "lanes",
           "mesh", "method", "modes", "noise", "nu", "options", "range", "release", "rfe", "rho", "right-angles", "section", "singular", "stabilise", "start", "step",
           "step-max", "stop", "threads", "tip", "tol", "tol-rates", "vary", "way", *ARGUMENTS, *(name.replace("_", "-") for name in FLAGS))
VALUES = ("baumgarte", "baumgarte-auto", "downhill", "held", "load", "none", "pass", "path", "project", "statics", "stop")
OPTION = re.compile(rf"--({'|'.join(sorted(OPTIONS, key=len, reverse=True))})(?![\w-])(?: ({'|'.join(VALUES)})(?![\w-]))?")
CALLS = {"import": "refdyn.Model.from_urdf", "sim": "arm.simulate"}  # calls of the package whose names differ from their commands
COMMAND = re.compile(r"(?<![\w/.-])refdyn (batch|fit|import|linearise|modes|plan|sim|statics|view)(?![\w-])(?! [A-Z-])")
NEAREST = re.compile(r"; did you mean \"([^\"\n]*)\"")
OF_OPTION = re.compile(r"^[^\n]*?: (?=--[\w-]+: )")
OF_FILE = re.compile(r"^<(?:state|cases|inputs|sweep|fit|plan|(?:data|held_out)_\d+)>(?::\d+)?: ", re.M)
OF_DATA = re.compile(r"^<(data|held_out)_(\d+)>(?::\d+)?: (?:warning: )?(?:data: )?", re.M)
OF_SETTING = re.compile(r"^[^\n]*?(?:\.lua|<text>)(?::\d+)?: (?:option )?(?=\w+: (?:value |unknown option, parameter or input|the model has no option))", re.M)
LONG_NUMBER = re.compile(r"-?\b\d+\.\d{12,}(?:e[+-]?\d+)?\b|(?<![\w.])-0(?![\w.])")


def shown(text: str, places: Mapping[str, str] = {}) -> str:
    """Replaces a file cases.csv in a private folder by `<cases>`, and each folder of `places` by its original."""
    for folder, name in places.items():
        text = text.replace(folder, name)
    return re.sub(re.escape(f"{tempfile.gettempdir()}/{PRIVATE}") + r"\w{8}/(text|state|cases|inputs|sweep|fit|plan|data_\d+|held_out_\d+)\.\w+", r"<\1>", text)


def argument(found: re.Match[str]) -> str:
    name = ARGUMENTS.get(found[1], found[1].replace("-", "_"))
    if found[2]:
        return f'{name}="{found[2]}"'
    return f"{name}=True" if name in FLAGS and found.string[found.end():found.end() + 1] != ":" else name


def of_python(text: str) -> str:
    """Writes a message as `of_model` does, and quotes a proposed name as Python does."""
    return NEAREST.sub(lambda found: f"; did you mean {found[1]!r}", of_model(text))


def of_model(text: str) -> str:
    """Writes options as arguments, `start="project"` for `--start project` and `move_held=True` for `--move-held`, and commands as calls:
    `arm.simulate` for `refdyn sim`."""
    text = text.replace("the CSV has no column", "a motion has no column").replace("that this command computes", "that this call computes").replace("--set ", "").replace("--set", "parameters")
    text = text.replace("view --live", "arm.live")
    text = COMMAND.sub(lambda found: CALLS.get(found[1], f"arm.{found[1]}"), OPTION.sub(argument, text))
    return re.sub(r"^refdyn: ", "", text, flags=re.M)


def is_about_arguments(text: str) -> bool:
    """Returns whether the message is about an option, a private file, which has arguments of the call, or a setting of the model."""
    return any(pattern.match(text.replace("--set ", "")) for pattern in (OF_OPTION, OF_FILE, OF_SETTING))


def of_arguments(text: str) -> str:
    """Removes private files from a message, and names rows of a table by the number of the case."""
    text = of_python(OF_OPTION.sub("", text))
    text = re.sub(r"^<cases>:(\d+): cases: (.*)$", lambda found: f"cases: {found[2]}" + (f" (case {int(found[1]) - 2})" if int(found[1]) > 1 else ""), text, flags=re.M)
    text = OF_DATA.sub(r"\1[\2]: ", text)
    text = re.sub(r"(\w+) = rd\.within\(FROM, TO\)", r"vary={'\1': (from, to)}", text)
    text = re.sub(r"^<(cases|inputs)>(?::\d+)?: (?:inputs: )?", r"\1: ", text, flags=re.M)
    return OF_SETTING.sub("", OF_FILE.sub("", text))


def rounded(text: str) -> str:
    """Rounds the numbers of a state, which the program prints exactly, to ten digits."""
    return LONG_NUMBER.sub(lambda found: f"{float(found[0]) or 0.0:.10g}", text)


def without_summary(text: str) -> str:
    """Removes the summary of a failed motion and the name of its private file from the message of `refdyn sim`."""
    return re.sub(r"^method {5,}.*?(?=^refdyn: |\Z)|^refdyn: what was computed until then is in [^\n]*", "", text, flags=re.M | re.S).strip()
