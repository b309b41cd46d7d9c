"""Runs the program `refdyn` of the package and turns its messages into exceptions and warnings."""
from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Collection, Mapping, Sequence
from typing import IO, Any

import numpy as np

from . import wording
from .launcher import PROGRAM
from .names import one_real

prefix = pathlib.Path(__file__).absolute().parent  # has the folders bin, lib and include that `cmake --install` writes

FAULT, USAGE, NUMBERS = 1, 2, 3  # exit statuses
PRIVATE = wording.PRIVATE
PLACE = re.compile(r"(?P<file>[^\n]+?):(?P<line>\d+): (?!warning: )")
WARNING = re.compile(r"^.*warning: .*\n?(?:  .*\n?)*", re.M)  # with the indented lines after it
NOTICE = re.compile(r"refdyn: .* \.\.\.\n")
FAILURE = re.compile(r"refdyn: .*?: t = (?P<t>\S+) s: (?P<reason>.*)")


class ModelError(Exception):
    """A model, a state or a file is wrong. `file` and `line` (0: no line) name the place; the text says what to do."""

    def __init__(self, text: str, file: str | None = None, line: int = 0) -> None:
        super().__init__(text)
        self.file, self.line = file, line

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.file, self.line)


class NumericalError(ArithmeticError):
    """A computation failed at time `t` [s] (None if it has no time) for `reason`. `run` has the motion up to that time."""

    def __init__(self, text: str, t: float | None = None, reason: str = "", run: Any = None) -> None:
        super().__init__(text)
        self.t, self.reason, self.run = t, reason, run

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.t, self.reason, self.run)


class ModelWarning(UserWarning):
    """A warning of the program."""


for _exception in (ModelError, NumericalError, ModelWarning):
    _exception.__module__ = "refdyn"


# Options of commands that only the package sets.
OWN_OPTIONS = ("until", "from", "output", "summary", "inputs", "stop", "table", "set", "of", "case", "cases", "resume", "dry_run", "slurm",
               "chunks", "slurm_options", "help")


def further(options: Mapping[str, Any]) -> Mapping[str, Any]:
    """Returns the additional options of a call after a check of their names."""
    for name in options:
        if name.rstrip("_").replace("-", "_") in OWN_OPTIONS:
            raise TypeError(f"{name}: not an option of this call; use its arguments and its result instead")
    return options


def text_of(name: str, value: Any) -> str:
    """Writes a value as a word of the command line. A number keeps all its digits."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, np.ndarray) or np.ndim(value) == 0 and not isinstance(value, (str, os.PathLike)):
        return repr(one_real(name, value))
    return str(value)


def arguments(options: Mapping[str, Any]) -> list[str]:
    """Writes options by name as words of a command line. Options that are None or False are left out."""
    words = []
    for name, value in options.items():
        word = "--" + name.rstrip("_").replace("_", "-")
        if value is True:
            words.append(word)
        elif isinstance(value, Sequence) and not isinstance(value, str):
            words += [word, ",".join(map(str, value))]
        elif value is not None and value is not False:
            words += [word, text_of(wording.of_python(word), value)]
    return words


def settings(values: Mapping[str, Any]) -> list[str]:
    return [word for name, value in values.items() for word in ("--set", f"{name}={text_of(name, value)}")]


def failure(status: int, said: str) -> Exception:
    """Returns the exception for an exit status of the program."""
    said = said.strip()
    if status == FAULT:
        place = PLACE.search(said)
        text = wording.of_python(said)
        return ModelError(text, place["file"], int(place["line"])) if place else ModelError(text)
    if status == USAGE:
        return ValueError(wording.of_python(re.sub(r"^refdyn \w+: ", "", said.splitlines()[0])))
    if status == NUMBERS:
        found = FAILURE.search(said)
        text = wording.rounded(wording.of_python(wording.without_summary(said)))
        return NumericalError(text, float(found["t"]), wording.of_python(found["reason"])) if found else NumericalError(text, None, text.splitlines()[0])
    return RuntimeError(f"refdyn ended with status {status}: {said}")


def warnings_of(said: str) -> list[str]:
    return [wording.rounded(wording.of_python(text.strip().removeprefix("refdyn: ").removeprefix("warning: "))) for text in WARNING.findall(said)]


def fact_of(warning: str) -> str:
    """Removes the place: the same file can have several names there."""
    return warning.partition("warning: ")[2] or warning


def warn(text: str) -> None:
    """Warns at the line that has called the package."""
    frame, level = sys._getframe(), 1
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == __package__:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, ModelWarning, stacklevel=level)


def private_folder() -> tempfile.TemporaryDirectory[str]:
    """A temporary folder for the files that a call exchanges with the program."""
    return tempfile.TemporaryDirectory(prefix=PRIVATE)


def listen(stream: IO[str], lines: list[str]) -> None:
    """Shows notices, such as that of a long compilation, when they come; collects the other lines."""
    for line in stream:
        if NOTICE.fullmatch(line):
            print(line, end="", file=sys.stderr, flush=True)
        else:
            lines.append(line)


def finished(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Runs a command to its end, as subprocess.run does, but shows its notices meanwhile."""
    lines: list[str] = []
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", errors="replace",
                          env={**os.environ, "REFDYN_NOTICES": "1"}) as process:
        listener = threading.Thread(target=listen, args=(process.stderr, lines))
        listener.start()
        try:
            printed = process.stdout.read() if process.stdout else ""
        except BaseException:
            process.kill()
            raise
        finally:
            listener.join()
    return subprocess.CompletedProcess(command, process.returncode, printed, "".join(lines))


def run(*words: str | os.PathLike[str], places: Mapping[str, str] = {}, warned: Collection[str] = ()) -> tuple[str, list[str]]:
    """Runs the program; returns its output and the facts of its warnings. Facts that are not in `warned` become warnings.
    `places` maps folders to their names in messages."""
    done = finished([PROGRAM, *map(str, words)])
    said = wording.shown(done.stderr, places)
    found = warnings_of(said)
    for text in found:
        if fact_of(text) not in warned:
            warn(text)
    if done.returncode:
        raise failure(done.returncode, WARNING.sub("", said))
    return done.stdout, [fact_of(text) for text in found]
