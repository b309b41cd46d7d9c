"""Cases of a batch: grids, random samples, what is kept of each motion, and the report about failed cases."""
from __future__ import annotations

import collections
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .names import flag, not_one_of, reals
from .program import text_of, warn

if TYPE_CHECKING:
    import xarray

KEPT = ("final", "at", "extremes", "norms", "history", "derivatives", "limits")
NUMBER = re.compile(r"(?<![\w.\[])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")  # numbers are left out when reasons are compared
SHOWN_REASONS = 5


class Grid(Mapping[str, np.ndarray]):
    """All combinations of the values of several names, made by `refdyn.grid`. As a mapping, it has a column for each name."""

    __module__ = "refdyn"

    def __init__(self, axes: Mapping[str, npt.ArrayLike]) -> None:
        self.axes = {name: np.atleast_1d(np.asarray(values)) for name, values in axes.items()}
        for name, values in self.axes.items():
            if values.ndim != 1 or not values.size:
                raise ValueError(f"{name}: has shape {values.shape}; must be a row of values")
        if not self.axes:
            raise ValueError("grid: no name; add values of at least one, m_E=[1, 2]")
        self.shape = tuple(values.size for values in self.axes.values())

    def __getitem__(self, name: str) -> np.ndarray:
        place = list(self.axes).index(name) if name in self.axes else -1
        if place < 0:
            raise KeyError(name)
        along = self.axes[name].reshape([-1 if axis == place else 1 for axis in range(len(self.shape))])
        return np.broadcast_to(along, self.shape).ravel()

    def __iter__(self) -> Iterator[str]:
        return iter(self.axes)

    def __len__(self) -> int:
        return len(self.axes)

    def __repr__(self) -> str:
        return f"<refdyn grid of {' x '.join(f'{values.size} {name}' for name, values in self.axes.items())}>"


def grid(axes: Mapping[str, npt.ArrayLike] | None = None, /, **more: npt.ArrayLike) -> Grid:
    """Returns all combinations for `arm.batch`: `refdyn.grid(m_E=[1, 2, 3], arm_psi=[0.7, 0.8])`.

    The names become dimensions of the result, in this order."""
    return Grid({**(axes or {}), **more})


def by_names_of_results(cases: Any, coordinates: Collection[str], others: Collection[str]) -> Any:
    """Returns the cases with start values under the names of coordinates. Results call the start value of `arm_psi` `arm_psi_start`,
    and calls may do so, too, unless the model has another value of this name (`others`)."""
    starts = {f"{name}{rate}_start": name + rate for name in coordinates for rate in ("", "_d")}
    renamed = {name: starts[name] for name in getattr(cases, "keys", tuple)() if name in starts and name not in others}
    if not renamed:
        return cases
    doubled = [name for name, other in renamed.items() if other in cases]
    if doubled:
        raise ValueError(f"cases: {doubled[0]} and {renamed[doubled[0]]} are the same start value; give one of them")
    if isinstance(cases, Grid):
        return Grid({renamed.get(name, name): values for name, values in cases.axes.items()})
    return {renamed.get(name, name): values for name, values in cases.items()}


NOT_COLUMNS = ("inputs", "parameters", "q", "qd")  # arguments of other calls; in a batch their values are columns


def refuse_values(options: Mapping[str, Any], coordinates: Sequence[str]) -> None:
    """Raises an error that says how a batch gets inputs, parameters and start values."""
    for name in NOT_COLUMNS:
        if name in options:
            value = options[name]
            named = next(iter(value.items()), ("NAME", 1.0)) if isinstance(value, Mapping) else None
            rate = "_d" if name == "qd" else ""
            column, example = named or ((coordinates[0] + rate, 0.1) if name.startswith("q") else ("NAME", 1.0))
            raise TypeError(f"{name}: not an argument of batch; give its values as columns: cases={{{column!r}: {example}}}")


def columns(cases: Any) -> dict[str, Any]:
    """Returns the columns of a mapping, a data frame or a grid. Names of files of inputs become absolute."""
    if not hasattr(cases, "items"):
        raise TypeError(f"cases: {type(cases).__name__}; must be columns by name, {{'NAME': values}}, a data frame or refdyn.grid(NAME=values)")
    found = dict(cases.items())
    for name in found:
        if not isinstance(name, str):
            raise TypeError(f"cases: column {name!r}; the names of columns must be texts")
    if not found:
        raise ValueError("cases: no column; add values of at least one name")
    if "inputs" in found:
        found["inputs"] = [os.path.abspath(file) for file in np.atleast_1d(np.asarray(found["inputs"]))]
    return found


# ---- The sweep file of a call ----

def lua_text(text: str) -> str:
    """Writes a text as a literal of Lua."""
    return '"' + "".join(letter if letter.isalnum() or letter in "_ .[]()-+" else "".join(f"\\{byte:03d}" for byte in letter.encode()) for letter in text) + '"'


def kept(keep: Mapping[str, Any]) -> str:
    """Writes the field `keep` of a sweep file."""
    if not isinstance(keep, Mapping):
        raise TypeError(f"keep: {type(keep).__name__}; must be a dictionary with {', '.join(KEPT)}")
    fields = []
    for name, value in keep.items():
        if name not in KEPT:
            raise ValueError(f"keep: {not_one_of(name, KEPT)}")
        if name in ("final", "limits"):
            fields.append(f"{name} = {'true' if flag(f'keep: {name}', value) else 'false'}")
        elif name == "at":
            times = np.atleast_1d(reals("keep: at", value))
            fields.append(f"at = {{ {', '.join(text_of('keep: at', time) for time in times)} }}")
        else:
            listed = [value] if isinstance(value, str) else list(value)
            fields.append(f"{name} = {{ {', '.join(lua_text(str(column)) for column in listed)} }}")
    return f"{{ {', '.join(fields)} }}"


def write_sweep(table: str, keep: Mapping[str, Any] | None, folder: str) -> str:
    """Writes a sweep file for the cases of a table. --until replaces its t_end."""
    path = os.path.join(folder, "sweep.lua")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f'return require "refdyn".sweep {{ t_end = 1e300, table = {lua_text(os.path.basename(table))}, keep = {kept(keep or {"final": True})} }}\n')
    return path


# ---- Results ----

def along_axes(runs: xarray.Dataset, grid_: Grid, names: Mapping[str, str]) -> xarray.Dataset:
    """Returns the dataset with a dimension for each axis of the grid instead of `case`. `names` has the names of the varied values."""
    import xarray
    dims = tuple(names[name] for name in grid_.axes)
    variables: dict[str, xarray.Variable] = {}
    coordinates: dict[str, xarray.Variable] = {}
    for key, variable in runs.variables.items():
        name = str(key)
        if "case" not in variable.dims:
            (coordinates if name in runs.coords else variables)[name] = variable
        elif name in dims:
            place = dims.index(name)
            at = tuple(slice(None) if axis == place else 0 for axis in range(len(dims)))
            coordinates[name] = xarray.Variable((name,), variable.values.reshape(grid_.shape)[at], variable.attrs)
        else:
            values = variable.values.reshape(grid_.shape + variable.shape[1:])
            (coordinates if name == "case" else variables)[name] = xarray.Variable(dims + variable.dims[1:], values, variable.attrs)
    return xarray.Dataset(variables, coordinates, runs.attrs)


def reasons(status: Iterable[int], texts: Iterable[str]) -> list[str]:
    """Returns a line for each kind of reason: how many cases failed, and why the first of them."""
    found: dict[str, list[tuple[int, str]]] = collections.defaultdict(list)
    for number, (code, text) in enumerate(zip(status, texts)):
        if code:
            found[NUMBER.sub("", text)].append((number, text))
    ordered = sorted(found.values(), key=len, reverse=True)
    lines = [f"  {len(cases)}: {cases[0][1]} (case {cases[0][0]}{' is the first' if len(cases) > 1 else ''})" for cases in ordered[:SHOWN_REASONS]]
    return lines + ([f"  and {len(ordered) - SHOWN_REASONS} further reasons"] if len(ordered) > SHOWN_REASONS else [])


def warn_of_failures(runs: xarray.Dataset) -> None:
    """Raises one warning about all failed cases."""
    status, texts = runs.status.values.ravel(), runs.reason.values.ravel()
    failed = int(np.count_nonzero(status))
    if failed:
        warn("\n".join([f"{failed} of {status.size} cases failed; see `status` and `reason` of the dataset:", *reasons(status, texts)]))
