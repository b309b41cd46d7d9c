"""The files of a model as they were when it was read, so that all that is computed of it is of one text."""
from __future__ import annotations

import os
import pathlib
import shutil
import tempfile
import threading
import warnings
import weakref
from collections.abc import Iterable, Mapping

from .program import PRIVATE, ModelWarning

TEXT = "text.lua"  # of a model that is given as a text, which no folder has


class Sources:
    """`main`: the model's file, or TEXT; the files that it requires lie beside it.

    The program reads `path()`: the file where it lies while it says the same as then, else a copy. `places` tells, for
    messages, which folder that of the copies stands for.
    """

    def __init__(self, main: str, texts: Mapping[str, bytes] | None = None) -> None:
        self.main, self.texts = main, dict(texts or {})
        self.places: dict[str, str] = {}
        self._lock = threading.Lock()
        self._copies: str | None = None

    def take(self, paths: Iterable[str]) -> None:
        """The files that the program has read, the model's first."""
        if not self.texts:
            self.main = os.path.abspath(self.main)
            self.texts = {os.path.abspath(path): pathlib.Path(path).read_bytes() for path in paths}

    def path(self) -> str:
        changed = [file for file, text in self.texts.items() if self.main == TEXT or bytes_of(file) != text]
        if not changed:
            return self.main
        with self._lock:
            if self._copies is None:
                self._copy(changed[0])
            assert self._copies
            return os.path.join(self._copies, os.path.basename(self.main))

    def _copy(self, changed: str) -> None:
        self._copies = tempfile.mkdtemp(prefix=PRIVATE)
        weakref.finalize(self, shutil.rmtree, self._copies, ignore_errors=True)
        for file, text in self.texts.items():
            pathlib.Path(self._copies, os.path.basename(file)).write_bytes(text)
        if self.main == TEXT:
            return
        self.places[self._copies] = os.path.dirname(self.main)
        warnings.warn(f"{changed}: the file has changed since this model was read, which stays as it was; refdyn.Model reads it anew",
                      ModelWarning, stacklevel=6)


def bytes_of(file: str) -> bytes | None:
    try:
        return pathlib.Path(file).read_bytes()
    except OSError:
        return None
