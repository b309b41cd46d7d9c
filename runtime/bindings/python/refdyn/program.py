"""Runs the program `refdyn` of the package and turns its messages into exceptions and warnings."""
from __future__ import annotations

import inspect
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import IO, Any

import numpy as np

from . import wording
from .launcher import PROGRAM
from .names import flag, one_real, unexpected

prefix = pathlib.Path(__file__).absolute().parent  # has the folders bin, lib and include that `cmake --install` writes

FAULT, USAGE, NUMBERS = 1, 2, 3  # exit statuses
SECONDS_TO_END = 5  # for a program to remove its temporary folders
PRIVATE = wording.PRIVATE
PLACE = re.compile(r"(?P<file>[^\n]+?):(?P<line>\d+): (?!warning: )")
WARNING = re.compile(r"^.*warning: .*\n?(?:  .*\n?)*", re.M)  # with the indented lines after it
NOTICE = re.compile(rb"^refdyn: .* \.\.\.\n", re.M)
BAR = re.compile(rb"\r[^\r\n]*\033\[K")
FAILURE = re.compile(r"refdyn: .*?: t = (?P<t>\S+) s: (?P<reason>.*)")


class ModelError(ValueError):
    """A model, a state or a file is wrong, or the model refuses a value. `file` and `line` (0: no line) name the place; the text says what
    to do."""

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


# Options whose value is a name.
NAMES = ("at", "from", "hold", "method", "release", "section", "singular", "stabilise", "start", "way")

# Further options of commands, which calls pass on.
OF_MOTIONS = ("tol_rates", "step_max", "stabilise", "singular", "start", "hold", "release", "way")
OF_REALISE = ("realise", "before", "after", "mesh")
OF_SIM = (*OF_MOTIONS, "accuracy", "verify", "fold", *OF_REALISE)
OF_BATCH, OF_FIT = (*OF_MOTIONS, "step", "every", *OF_REALISE), (*OF_MOTIONS, "step", "lanes")


def further(options: Mapping[str, Any], call: Callable[..., Any], known: Collection[str]) -> Mapping[str, Any]:
    """Returns the additional options of a call after a check of their names."""
    for name in options:
        own = [other for other in inspect.signature(call).parameters if other not in ("self", "options")]
        if wording.ARGUMENTS.get(name) in own:
            raise TypeError(f"{call.__name__}() got an unexpected keyword argument {name!r}; did you mean {wording.ARGUMENTS[name]!r}?")
        if name.rstrip("_").replace("-", "_") in OWN_OPTIONS:
            raise TypeError(f"{name}: not an option of this call; use its arguments and its result instead")
        if name not in known:
            raise unexpected(call.__name__, name, [*known, *own])
    return options


def text_of(name: str, value: Any) -> str:
    """Writes a value as a word of the command line. A number keeps all its digits."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        one_real(name, value)  # an integer beyond the doubles is no number of the command line
        return str(int(value))
    if isinstance(value, np.ndarray) or np.ndim(value) == 0 and not isinstance(value, (str, os.PathLike)):
        return repr(one_real(name, value))
    return str(value)


def arguments(options: Mapping[str, Any]) -> list[str]:
    """Writes options by name as words of a command line. Options that are None or False are left out."""
    words = []
    for name, value in options.items():
        option = name.rstrip("_")
        word, argument = "--" + option.replace("_", "-"), wording.ARGUMENTS.get(option, name)
        if value is None:
            continue
        if option in wording.FLAGS:
            words += [word] if flag(argument, value) else []
        elif isinstance(value, (bool, np.bool_)):
            raise TypeError(f"{argument}: {value}; must be a {'name' if option in NAMES else 'number'}")
        elif isinstance(value, Sequence) and not isinstance(value, str):
            words += [word, ",".join(map(str, value))]
        else:
            words += [word, text_of(argument, value)]
    return words


def settings(values: Mapping[str, Any]) -> list[str]:
    return [word for name, value in values.items() for word in ("--set", f"{name}={text_of(name, value)}")]


def failure(status: int, said: str) -> Exception:
    """Returns the exception for an exit status of the program."""
    said = said.strip()
    if status == FAULT:
        place = PLACE.search(said)
        text = wording.of_python(said)
        if wording.is_about_arguments(said):
            return ValueError(wording.of_arguments(said))
        return ModelError(text, place["file"], int(place["line"])) if place else ModelError(text)
    if status == USAGE:
        return ValueError(wording.of_python(re.sub(r"^refdyn \w+: ", "", said.splitlines()[0])))
    if status == NUMBERS:
        found = FAILURE.search(said)
        text = wording.rounded(wording.of_python(wording.without_summary(said)))
        return NumericalError(text, float(found["t"]), wording.of_python(found["reason"])) if found else NumericalError(text, None, text.splitlines()[0])
    return RuntimeError(f"refdyn ended with status {status}: {said}")


def refusal(said: str, state: str) -> ModelError:
    """The error about parameters that a model refuses, FILE:LINE: subject: fact. `state` names one state of a batch."""
    found = PLACE.match(said)
    assert found
    return ModelError(state + said, found["file"], int(found["line"]))


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


def warn_of(found: Sequence[str], warned: Collection[str]) -> None:
    """One Python warning for all warnings of a call, a line each; omits those whose facts are in `warned`."""
    texts = [text for text in found if fact_of(text) not in warned]
    if texts:
        warn("\n".join(texts))


def private_folder() -> tempfile.TemporaryDirectory[str]:
    """A temporary folder for the files that a call exchanges with the program."""
    return tempfile.TemporaryDirectory(prefix=PRIVATE)


def end(process: subprocess.Popen[bytes]) -> None:
    """Ends a program. It removes its temporary folders and ends its compilers if it has time to do so."""
    process.terminate()
    try:
        process.wait(SECONDS_TO_END)
    except subprocess.TimeoutExpired:
        process.kill()


def call(command: Sequence[str], shows_progress: bool) -> tuple[int, str, str]:
    """Runs a program to its end; returns its status and both outputs. Notices, such as that of a long compilation, and progress
    bars go to sys.stderr as they come."""
    wanted = {"REFDYN_NOTICES": "1", **({"REFDYN_PROGRESS": "1"} if shows_progress else {})}
    said: list[bytes] = []
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, **wanted}) as process:
        listener = threading.Thread(target=listen, args=(process.stderr, said))
        listener.start()
        try:
            printed = process.stdout.read() if process.stdout else b""
        except BaseException:
            end(process)
            raise
        finally:
            listener.join()
    return process.returncode, printed.decode("utf-8", "replace"), said[0].decode("utf-8", "replace")


def listen(stream: IO[bytes], said: list[bytes]) -> None:
    """Copies notices and progress bars to sys.stderr; adds the other text to `said`."""
    text = b""
    while part := stream.read1():  # type: ignore[attr-defined]
        text += part
        for pattern in (BAR, NOTICE):
            for shown in pattern.findall(text):
                if sys.stderr is not None:  # a program without a console has none
                    sys.stderr.write(shown.decode("utf-8", "replace"))
                    sys.stderr.flush()
            text = pattern.sub(b"", text)
    said.append(text)


def run(*words: str | os.PathLike[str], places: Mapping[str, str] = {}, warned: Collection[str] = (), shows_progress: bool = False) -> tuple[str, list[str], str]:
    """Runs the program; returns its output, the facts of its warnings and what else it says. Facts that are not in `warned` become warnings.
    `places` maps folders to their names in messages."""
    status, printed, complained = call([PROGRAM, *map(str, words)], shows_progress)
    said = wording.shown(complained, places)
    found = warnings_of(said)
    warn_of(found, warned)
    if status:
        raise failure(status, WARNING.sub("", said))
    return printed, [fact_of(text) for text in found], WARNING.sub("", said)
