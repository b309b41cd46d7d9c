"""Keeps the files of a model as they were when it was read, so that all its results belong to the same text."""
from __future__ import annotations

import os
import pathlib
import shutil
import tempfile
import threading
import weakref
from collections.abc import Iterable, Mapping

from .program import PRIVATE, warn

TEXT = "text.lua"  # name of a model that is given as a text and has no file


class Sources:
    """`main`: the model's file, or TEXT. The files that it requires are in the same folder.

    The program reads `path()`: the file itself while it is unchanged, otherwise a copy of the old text. `places` maps the folder
    of the copies to the original folder, so that messages name the original.
    """

    def __init__(self, main: str, texts: Mapping[str, bytes] | None = None) -> None:
        self.main, self.texts = main, dict(texts or {})
        self.places: dict[str, str] = {}
        self._lock = threading.Lock()
        self._copies: str | None = None

    def keep(self, paths: Iterable[str]) -> None:
        """Keeps the texts of the files that the program has read; the model's file comes first."""
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
        if bytes_of(changed) is None:
            warn(f"{changed}: the file can no longer be read; the model stays as it was")
        else:
            warn(f"{changed}: the file has changed since the model was read; the model stays as it was, and refdyn.Model reads the new file")


def bytes_of(file: str) -> bytes | None:
    try:
        return pathlib.Path(file).read_bytes()
    except OSError:
        return None
