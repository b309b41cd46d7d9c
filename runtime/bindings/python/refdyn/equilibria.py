"""Equilibria in the process: the results of `refdyn statics`."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import motion
from .names import finite_row

if TYPE_CHECKING:
    from .model import Model

WAYS = ("load", "path", "downhill")


def names_of(value: str | Sequence[str] | None) -> list[str] | None:
    return value if value is None else [name for name in (value.split(",") if isinstance(value, str) else value) if name]


def find(model: Model, purpose: str, q: npt.ArrayLike | None, t: Any, inputs: Mapping[str, float], parameters: Mapping[str, float], hold: str | Sequence[str] | None,
         release: str | Sequence[str] | None, way: str | None) -> dict[str, Any] | None:
    """Computes the equilibrium near q; None if the program has to say what is wrong with the arguments."""
    held, released = names_of(hold), names_of(release) or []
    state = None if q is None else finite_row("q", q, "one state: a row of numbers")
    time = None if t is None else finite_row("t", t, "one state: a row of numbers")
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
    x = compiled.x.copy()
    for name, value in inputs.items():
        x[compiled.inputs[name]] = value
    values, anchored = motion.values_of(compiled, parameters)
    marks = bytes(name in (model.held if held is None else held) for name in names)
    starts = tuple(starts[0] if starts else None for starts in model._row_starts)
    status, text, result = compiled.library.statics(values, anchored, x, tuple(compiled.description["requirements"]), 0.0 if time is None else float(time),
                                                    None if state is None else np.ascontiguousarray(state), marks, holds, WAYS.index(way or "load"), starts)
    motion.tell(model, text)
    if status != motion.DONE:
        raise motion.failure_of(model, status, text, False)
    return {"coordinates": names, "given": given, "held": [name for name, mark in zip(names, marks) if mark], **result}
