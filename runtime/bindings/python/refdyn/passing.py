"""How a call passes inputs and parameters: by name, in a dictionary or another container with names, or as an array in the model's order."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from .names import by_name, common_lead, finite, reals, with_names

Given = Union[Mapping[str, npt.ArrayLike], npt.ArrayLike, None]
States = Union[Mapping[str, npt.ArrayLike], npt.ArrayLike]  # coordinates, rates or accelerations


SCALARS = (float, int, np.float64)
UNREAD, FREE_UNREAD = -1, -2  # instead of the place of a value that a library does not read; FREE_UNREAD may be NaN


class Checked:
    """Checked values of one kind: arrays by name, or an array `row` with the values of `names` along its last axis."""

    def __init__(self, arrays: Mapping[str, np.ndarray], names: Sequence[str] = (), row: np.ndarray | None = None) -> None:
        self.arrays, self.names, self.row = arrays, names, row

    def leads(self, kind: str) -> dict[str, tuple[int, ...]]:
        """The leading axes by the names that messages use."""
        return {f"{kind}s": self.row.shape[:-1]} if self.row is not None else {f"{kind} {name}": array.shape for name, array in self.arrays.items()}

    def __bool__(self) -> bool:
        return self.row is not None or bool(self.arrays)

    def of_one(self) -> dict[str, float] | np.ndarray | None:
        """Returns the values of one state as Function.one expects them."""
        if self.row is not None:
            return np.ascontiguousarray(self.row)
        return {name: float(array) for name, array in self.arrays.items()} or None

    def by_name(self) -> dict[str, np.ndarray]:
        return dict(self.arrays) if self.row is None else {name: self.row[..., place] for place, name in enumerate(self.names)}


class Values:
    """The inputs or the parameters of a library: default values, and how calls replace them.

    `places` has the place of each name that the library reads. `order` has the names in the order of arrays, and whether the
    start of a motion sets the value where an array has NaN; such values are NaN in `free`. `kinds` has the model's names by
    kind, also those that this library does not read.
    """

    def __init__(self, kind: str, places: Mapping[str, int], free: np.ndarray, order: Mapping[str, bool], kinds: Mapping[str, Collection[str]]) -> None:
        self.kind, self.free, self.kinds, self.order = kind, free, kinds, tuple(order)
        self.places = {**dict.fromkeys(kinds[kind], UNREAD), **places}
        self.may_be_nan = np.array(list(order.values()), dtype=bool)
        self.passing = self.places, [places.get(name, FREE_UNREAD if is_free else UNREAD) for name, is_free in order.items()]
        self.is_whole = self.passing[1] == list(range(free.size))  # an array has exactly the values of the library

    def quick(self, given: Given) -> np.ndarray | None:
        """Returns the rows of what control loops pass: numbers by name, or doubles in the library's order. None: `checked` decides."""
        if type(given) is dict:
            row = self.free.copy()
            for name, value in given.items():
                place = self.places.get(name, UNREAD)
                if place == UNREAD or type(value) not in SCALARS:
                    return None
                try:
                    row[place] = value
                except OverflowError:  # an integer beyond the doubles
                    return None
        elif type(given) is np.ndarray and self.is_whole and given.dtype == np.float64 and given.shape[-1:] == self.free.shape:
            row = np.ascontiguousarray(given)
        else:
            return None
        return row if np.isfinite(row).all() else None

    def checked(self, given: Given) -> Checked:
        """Checks names, shapes and numbers."""
        name = f"{self.kind}s"
        given = with_names(name, given)
        if given is None:
            return Checked({})
        if isinstance(given, Mapping):
            by_name(self.kind, given, self.kinds)
            return Checked({name: finite(f"{self.kind} {name}", value) for name, value in given.items()})
        if isinstance(given, (str, bytes)) or np.ndim(given) == 0:
            raise TypeError(f"{name}: {type(given).__name__}; must be an array in the order of the model's {name}, or values by name, {{'NAME': value}}")
        row = reals(name, given)
        if row.shape[-1] != len(self.order):
            known = f" ({', '.join(self.order)})" if self.order else ""
            raise ValueError(f"{name}: has shape {row.shape}; its last axis must have {len(self.order)} entries{known}")
        finite(name, row[~(np.isnan(row) & self.may_be_nan)])
        return Checked({}, self.order, row)

    def filled(self, given: Checked) -> np.ndarray:
        """Rows of default values in which the given values replace theirs. Values that the library does not read are left out."""
        read = {name: array for name, array in given.by_name().items() if self.places[name] != UNREAD}
        rows = np.empty(common_lead((f"{self.kind} {name}", array.shape) for name, array in read.items()) + self.free.shape)
        rows[...] = self.free
        for name, array in read.items():
            rows[..., self.places[name]] = array
        return rows


def spread(array: np.ndarray, lead: tuple[int, ...]) -> np.ndarray:
    """Returns one row for all states, or one row for each state of the batch, in C order."""
    if array.ndim > 1 and array.shape[:-1] != lead:
        array = np.broadcast_to(array, lead + array.shape[-1:])
    return np.ascontiguousarray(array)
