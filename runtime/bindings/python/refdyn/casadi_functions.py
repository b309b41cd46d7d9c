"""Emitted functions of a model as functions of CasADi: generated, compiled and loaded in one call."""
from __future__ import annotations

import atexit
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import types
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from . import program
from .names import nearest, texts_of

if TYPE_CHECKING:
    from .model import Model

USUAL = ("M", "h", "energy", "qdd", "phi", "psi", "r")  # by default, as far as the model has them
COMMAND = re.compile(r"^ \*     (cc .*)$", re.M)
FUNCTION = re.compile(r"^CASADI_FUNCTION\((\w+),", re.M)


def casadi_module() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise ImportError("casadi: CasADi is missing; install it with pip install casadi") from error
    return casadi


class CasadiFunctions:
    """Functions of CasADi, made by `arm.casadi()`: `f.qdd(q, qd, t, inputs, parameters)`, `f.step_gauss(q, qd, t, h, inputs, parameters)`.

    `names` lists them. `defaults` has the model's `q`, `qd`, `inputs` and `parameters`; the tuples `coordinates`, `inputs` and
    `parameters` name the entries. Derivatives are exact where docs/casadi.md says so, and differences elsewhere. `library` is
    the shared library, which exists until the process ends.
    """

    __module__ = "refdyn"

    def __init__(self, model: str, library: str, source: str) -> None:
        casadi = casadi_module()
        exported = FUNCTION.findall(source)
        names = [name[len(model) + 1:] for name in exported if not name.startswith("jac_") and name != f"{model}_defaults"]
        self.library, self.names = library, tuple(names)
        self.coordinates, self.inputs, self.parameters = (tuple(re.findall(rf"^ \*   {kind} \d+ (\w+)", source, re.M)) for kind in ("q", "inputs", "parameters"))
        self.defaults: Mapping[str, Any] = types.MappingProxyType(casadi.external(f"{model}_defaults", library)())
        for name in names:
            options = {} if f"jac_{model}_{name}" in exported else {"enable_fd": True}
            setattr(self, name, casadi.external(f"{model}_{name}", library, options))

    def __getattr__(self, name: str) -> Any:
        near = None if name.startswith("_") else nearest(name, self.names)
        raise AttributeError(f"the functions have no {name!r}; " + (f"did you mean {near!r}?" if near else "add it to the quantities of arm.casadi"))

    def __repr__(self) -> str:
        return f"<refdyn functions of CasADi: {', '.join(self.names)}>"


def load(model: Model, quantities: Sequence[str] | None, folds: bool) -> CasadiFunctions:
    casadi_module()
    emit = [name for name in USUAL if name in model._default] + ["step"] if quantities is None else list(texts_of("quantities", quantities))
    if not isinstance(folds, bool):
        raise TypeError(f"fold: {folds!r}; must be True or False")
    if not emit:
        raise ValueError("quantities: no name; give at least one")
    folder = tempfile.mkdtemp(prefix=program.PRIVATE)
    atexit.register(remove, folder, os.getpid())
    model._run("gen", {"emit": ",".join(emit), "for_casadi": True, "fold": folds, "output": folder})
    source = next(pathlib.Path(folder).glob("*_casadi.c"))
    name = source.name[:-len("_casadi.c")]
    text = source.read_text(encoding="utf-8")
    compiled = COMMAND.search(text)
    assert compiled
    words = shlex.split(compiled[1].replace("$REFDYN_INCLUDE", shlex.quote(str(program.prefix / "include" / "refdyn"))))
    compile_in(folder, [*shlex.split(os.environ.get("CC") or "cc"), *words[1:]])
    return CasadiFunctions(name, os.path.join(folder, f"lib{name}_casadi.so"), text)


def compile_in(folder: str, command: Sequence[str]) -> None:
    try:
        done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", errors="replace")
    except OSError as error:
        raise RuntimeError(f"casadi: the compiler {command[0]} cannot be run: {error.strerror}; set CC or install a C compiler") from error
    if done.returncode:
        raise RuntimeError(f"casadi: {shlex.join(command)}: {done.stderr.strip()}")


def remove(folder: str, process: int) -> None:
    """Removes the library at the end of the process that made it, not of its forks."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)
