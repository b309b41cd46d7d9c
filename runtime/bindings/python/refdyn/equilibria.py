"""Equilibria and small motions in the process: the results of `refdyn statics` and `refdyn modes`."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import motion
from .names import texts_of
from .passing import States

if TYPE_CHECKING:
    from .model import Model

WAYS = ("load", "path", "downhill")


def names_of(argument: str, value: str | Sequence[str] | None) -> list[str] | None:
    return None if value is None else [name for name in texts_of(argument, value.split(",") if isinstance(value, str) else value) if name]


def find(model: Model, purpose: str, q: States | None, t: Any, inputs: Mapping[str, float], parameters: Mapping[str, float], hold: str | Sequence[str] | None,
         release: str | Sequence[str] | None, way: str | None) -> dict[str, Any] | None:
    """Computes the equilibrium near q; None if the program has to say what is wrong with the arguments."""
    held, released = names_of("hold", hold), names_of("release", release) or []
    state = None if q is None else model._start("q", q)
    time = None if t is None else model._start("t", t)
    names = tuple(model.coordinates)
    if not set(held or ()) <= set(names) or not set(released) <= set(model.rows) or way not in (None, *WAYS):
        return None
    if state is not None and state.shape != (len(names),) or time is not None and time.ndim:
        return None
    model._sources.path()
    given = {name for starts in model._row_starts for name in starts if name in model._given or name in parameters}
    compiled = model._purpose(purpose, given)
    waits = [any(name not in given for name in starts) for starts in model._row_starts]
    levels = compiled.library.row_levels
    if any(levels[model.rows.index(name)] != 0 for name in released):
        return None
    holds = bytes(level == 0 and not wait and row not in released for level, wait, row in zip(levels, waits, model.rows))
    if any(holds) and not compiled.library.has_tangent:
        return None
    x, (values, anchored) = compiled.input_rows(inputs), motion.values_of(compiled, parameters)
    marks = bytes(name in (model.held if held is None else held) for name in names)
    starts = tuple(starts[0] if starts else None for starts in model._row_starts)
    status, text, result = compiled.library.statics(values, anchored, x, compiled.requirements, 0.0 if time is None else float(time),
                                                    None if state is None else np.ascontiguousarray(state), marks, holds, WAYS.index(way or "load"), starts)
    motion.tell(model, text)
    if status != motion.DONE:
        raise motion.failure_of(model, status, text, False)
    return {"coordinates": names, "given": given, "held": [name for name, mark in zip(names, marks) if mark], **result}


def modes(model: Model, at: str, q: States | None, t: Any, inputs: Mapping[str, float], parameters: Mapping[str, float], most: Any, hold: str | Sequence[str] | None,
          release: str | Sequence[str] | None, way: str | None) -> dict[str, Any] | None:
    """Computes small motions; None if the program has to do it, or to say what is wrong with the arguments."""
    names, held = tuple(model.coordinates), names_of("hold", hold)
    if model.state_names or most is not None and not (type(most) is int and 0 < most < 2**31) or at not in ("statics", "initial") or not set(held or ()) <= set(names):
        return None
    state = model.q0 if q is None else model._start("q", q)
    time = None if t is None else model._start("t", t)
    if state.shape != (len(names),) or time is not None and time.ndim:
        return None
    given: Collection[str] = ()
    if q is None and at == "statics":
        rest = find(model, "modes", None, None, inputs, parameters, hold, release, way)
        if rest is None:
            return None
        state, given = np.array(rest["q"]), rest["given"]
    elif release is not None or way is not None or q is None and parameters:
        return None
    model._sources.path()
    compiled = model._purpose("modes", given)
    if not compiled.library.has_tangent or 2 in compiled.library.row_levels:
        return None
    x, (values, anchored) = compiled.input_rows(inputs), motion.values_of(compiled, parameters)
    marks = bytes(name in (model.held if held is None else held) for name in names)
    begin = 0.0 if time is None else float(time)
    status, text, result = compiled.library.modes(values, anchored, x, compiled.requirements, begin, np.ascontiguousarray(state), marks, most or 0,
                                                  solve, eigen, least_squares)
    if at != "statics" and held == []:  # the modes of a step, which need no equilibrium
        text = "".join(line for line in text.splitlines(True) if "is not an equilibrium" not in line)
    motion.tell(model, text)
    if status != motion.DONE:
        raise motion.failure_of(model, status, text, False)
    return {"q": state.tolist(), "t": begin, "held": [name for name, mark in zip(names, marks) if mark], **result}


# ---- Linear algebra for core.Library.modes; matrices are row by row, and a failure returns False ----

def matrix(numbers: memoryview, rows: int, columns: int) -> np.ndarray:
    return np.frombuffer(numbers).reshape(rows, columns)


def solve(size: int, left: memoryview, is_transposed: int, columns: memoryview) -> bool:
    a, out = matrix(left, size, size), matrix(columns, size, size)
    try:
        out[:] = np.linalg.solve(a.T if is_transposed else a, out)
    except np.linalg.LinAlgError:
        return False
    return True


def eigen(size: int, T: memoryview, re: memoryview, im: memoryview, left: memoryview, right: memoryview) -> bool:
    """Eigenvalues and vectors in the form of LAPACK's dgeev. The left vectors follow from the inverse of the right ones."""
    try:
        values, vectors = np.linalg.eig(matrix(T, size, size))
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        try:
            inverse = np.linalg.pinv(vectors)
        except (np.linalg.LinAlgError, UnboundLocalError):
            return False
    np.frombuffer(re)[:], np.frombuffer(im)[:] = values.real, values.imag
    for columns, found in ((matrix(right, size, size), vectors), (matrix(left, size, size), inverse.conj().T)):
        columns[:] = found.real
        second = np.flatnonzero(values.imag < 0)  # the other one of each pair
        columns[:, second] = found[:, second - 1].imag
    return True


def least_squares(rows: int, columns: int, A: memoryview, b: memoryview, tol: float, x: memoryview) -> bool:
    try:
        np.frombuffer(x)[:] = np.linalg.lstsq(matrix(A, rows, columns), np.frombuffer(b), rcond=tol)[0]
    except np.linalg.LinAlgError:
        return False
    return True
