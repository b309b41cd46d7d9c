"""Cases of a batch: grids, random samples, what is kept of each motion, and the report about failed cases."""
from __future__ import annotations

import collections
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .names import file_name, finite_row, flag, has_masked, is_list, not_one_of, texts_of
from .program import text_of, warn
from .sampling import Distribution, joined

if TYPE_CHECKING:
    import xarray

KEPT = ("final", "at", "extremes", "norms", "history", "derivatives", "limits")
FLAGS = ("final", "limits")  # fields of `keep` that are true or false; the others list names, except `at`
NUMBER = re.compile(r"(?<![\w.\[])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")  # numbers are left out when reasons are compared
SHOWN_REASONS = 5
OF_PANDAS = ("NAType", "NaTType")  # types of missing values


# ---- Columns ----

def is_missing(value: Any) -> bool:
    return value is None or type(value).__name__ in OF_PANDAS or isinstance(value, (float, np.floating)) and bool(np.isnan(value))


def row_of(name: str, values: Any) -> np.ndarray:
    """Returns one value or a row of values as a row of numbers, texts or truth values. Missing values are NaN."""
    if isinstance(values, Distribution):
        raise TypeError(f"{name}: {values!r}; must be one value or a row of values; refdyn.sample draws random ones")
    if has_masked(values):
        raise TypeError(f"{name}: has masked values; each case needs a value")
    try:
        array = np.asarray(values)
    except ValueError as error:  # NumPy: "setting an array element with a sequence ..."
        raise ValueError(f"{name}: rows of different lengths; must be a row of values") from error
    if array.ndim == 0 and array.dtype.kind == "O" and (callable(values) or isinstance(values, Iterable)):
        raise TypeError(f"{name}: {type(values).__name__}; must be one value or a row of values")
    if array.ndim > 1:
        raise ValueError(f"{name}: has shape {array.shape}; must be one value or a row of values")
    if not array.size:
        raise ValueError(f"{name}: has no values; must have at least one")
    if array.dtype.kind not in "biufUO":
        raise TypeError(f"{name}: values of {array.dtype}; must be real numbers, texts or truth values")
    if array.dtype.kind in "OU":  # NumPy turns NaN among texts into a text
        items = np.atleast_1d(np.asarray(values, dtype=object))
        array = np.empty(items.shape, dtype=object)
        array[:] = [np.nan if is_missing(item) else item for item in items]
    return np.atleast_1d(array)


class Grid(Mapping[str, np.ndarray]):
    """All combinations of the values of several names, made by `refdyn.grid`. As a mapping, it has a column for each name."""

    __module__ = "refdyn"

    def __init__(self, axes: Mapping[str, npt.ArrayLike]) -> None:
        self.axes = {name: row_of(name, values) for name, values in axes.items()}
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
    if axes is not None and not isinstance(axes, Mapping):
        raise TypeError(f"grid: {type(axes).__name__}; must be values by name, m_E=[1, 2]")
    return Grid(joined("grid", axes or {}, more))


OF_SAMPLES = "write samples along t to files, whose names form a column: cases={'inputs': ['a.csv', 'b.csv']}"
NOT_COLUMNS = ("inputs", "parameters", "q", "qd")  # arguments of other calls; in a batch their values are columns


def refuse_values(options: Mapping[str, Any], coordinates: Sequence[str]) -> None:
    """Raises an error about arguments that a batch takes as columns of cases or in `keep`; the error says how."""
    for name in KEPT:
        if name in options:
            raise TypeError(f"{name}: not an argument of batch; use keep={{{name!r}: {options[name]!r}}}")
    for name in NOT_COLUMNS:
        if name in options:
            value = options[name]
            if name == "inputs" and hasattr(value, "keys") and "t" in value:
                raise TypeError(f"inputs: not an argument of batch; {OF_SAMPLES}")
            named = next(iter(value.items()), ("NAME", 1.0)) if isinstance(value, Mapping) else None
            rate = "_d" if name == "qd" else ""
            column, example = named or ((coordinates[0] + rate, 0.1) if name.startswith("q") else ("NAME", 1.0))
            raise TypeError(f"{name}: not an argument of batch; give its values as columns: cases={{{column!r}: {example}}}")


def check_sources(cases: Any, sweep: Any, keep: Any, t_end: Any) -> None:
    """Checks that either `cases` or `sweep` is given, and that the call has the arguments that this one needs."""
    if cases is None and sweep is None:
        raise ValueError("cases: missing; must be columns by name, {'NAME': values}, a data frame or refdyn.grid(NAME=values)")
    if cases is not None and sweep is not None:
        raise ValueError("sweep: given together with cases; give one of them")
    if sweep is not None:
        file_name("sweep", sweep, "a sweep file")
    if sweep is not None and keep is not None:
        raise ValueError("keep: the sweep file defines what is kept; write it there")
    if cases is not None and t_end is None:
        raise TypeError("batch: t_end is missing; add the end of the motions [s]")


def files(values: Any) -> np.ndarray:
    """Returns the absolute names of files of inputs."""
    given = list(values) if is_list(values) and not isinstance(values, (str, Mapping)) else [values]
    for value in given:
        if not isinstance(value, (str, os.PathLike)):
            raise TypeError(f"inputs: {type(value).__name__}; must be names of files with samples along t")
    return row_of("inputs", [os.path.abspath(file) for file in given])


class Columns:
    """The cases of a call as rows of equal length by name, from a mapping, a data frame or a grid.

    In results, the start value of `arm_psi` has the name `arm_psi_start`. Cases may use it, too, unless the model has another value
    of this name (`others`). `labels` is the index of a data frame or of its columns, None if it only counts the rows.
    """

    def __init__(self, cases: Any, coordinates: Collection[str], options: Collection[str], others: Collection[str]) -> None:
        if not hasattr(cases, "items"):
            raise TypeError(f"cases: {type(cases).__name__}; must be columns by name, {{'NAME': values}}, a data frame or refdyn.grid(NAME=values)")
        starts = {f"{name}{rate}_start": name + rate for name in coordinates for rate in ("", "_d")}
        given: dict[str, np.ndarray] = {}
        names: dict[str, str] = {}  # of the columns, by the names that the program knows
        for column, values in cases.items():
            check_name(column, others)
            name = column if column in others else starts.get(column, column)
            other = names.setdefault(name, column)
            if name in given and other == column:
                raise ValueError(f"cases: two columns are called {column!r}; each needs its own name")
            if name in given:
                raise ValueError(f"cases: {other} and {column} are the same start value; give one of them")
            given[name] = files(values) if column == "inputs" else row_of(column, values)
        if not given:
            raise ValueError("cases: no column; add values of at least one name")
        self.rows = spread(given)
        for name in options:
            missing = [number for number, value in enumerate(self.rows.get(name, ())) if is_missing(value)]
            if missing:
                raise ValueError(f"{name}: case {missing[0]} has no value; an option needs one in each case")
        self.labels = labels_of(cases, len(next(iter(self.rows.values()))))
        self.shape = cases.shape if isinstance(cases, Grid) else None


def check_name(column: Any, others: Collection[str]) -> None:
    if not isinstance(column, str):
        raise TypeError(f"cases: column {column!r}; the names of columns must be texts")
    if not re.fullmatch(r"\w+", column):
        raise ValueError(f"cases: column {column!r}; a name has only letters, digits and underscores")
    if column == "t" and column not in others:
        raise ValueError(f"cases: column 't'; {OF_SAMPLES}")


def spread(given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Returns rows of equal length; a row of one value is repeated for all cases."""
    longest = max(given, key=lambda name: given[name].size)
    count = given[longest].size
    for name, row in given.items():
        if row.size not in (1, count):
            raise ValueError(f"{name}: has {row.size} values; must have {count}, as {longest} has, or one for all cases")
    return {name: np.broadcast_to(row, count) for name, row in given.items()}


def labels_of(cases: Any, count: int) -> Any:
    """The index that the columns of a data frame or of a mapping share; None for an index of several levels, and for one that counts
    the rows from 0."""
    indexes = {str(name): values.index for name, values in cases.items() if hasattr(values, "index") and hasattr(values, "dtype")}
    first = next(iter(indexes), None)
    if first is None:
        return None
    for name, index in indexes.items():
        if not indexes[first].equals(index):
            raise ValueError(f"cases: {first} and {name} have different indexes; use pandas.DataFrame(cases), which aligns them")
    labels = np.asarray(indexes[first])
    if labels.size != count or getattr(indexes[first], "nlevels", 1) > 1 or labels.dtype.kind in "iu" and np.array_equal(labels, np.arange(count)):
        return None
    return indexes[first]


# ---- The sweep file of a call ----

def lua_text(text: str) -> str:
    """Writes a text as a literal of Lua."""
    return '"' + "".join(letter if letter.isalnum() or letter in "_ .[]()-+" else "".join(f"\\{byte:03d}" for byte in letter.encode()) for letter in text) + '"'


def kept(keep: Mapping[str, Any], t_end: float) -> str:
    """Writes the field `keep` of a sweep file."""
    if not isinstance(keep, Mapping):
        raise TypeError(f"keep: {type(keep).__name__}; must be a dictionary with {', '.join(KEPT)}")
    fields = []
    for name, value in keep.items():
        if name not in KEPT:
            raise ValueError(f"keep: {not_one_of(name, KEPT)}")
        if name in FLAGS:
            items = ["true"] if flag(f"keep: {name}", value) else []
        elif name == "at":
            items = [text_of("keep: at", time) for time in times_of(value, t_end)]
        else:
            items = [lua_text(column) for column in texts_of(f"keep: {name}", value)]
        if items:
            fields.append(f"{name} = {items[0] if name in FLAGS else '{ ' + ', '.join(items) + ' }'}")
    if not fields:
        raise ValueError("keep: keeps nothing; add 'final': True or names of columns, 'history': ['NAME']")
    return f"{{ {', '.join(fields)} }}"


def times_of(value: Any, t_end: float) -> np.ndarray:
    """Checks the times at which states are kept."""
    times = np.atleast_1d(finite_row("keep: at", value, "one time or a row of times"))
    for number, time in enumerate(times):
        if time < 0 or number and time <= times[number - 1]:
            raise ValueError(f"keep: at[{number}]: time {time:g}; times must ascend and not be negative")
        if time > t_end:
            raise ValueError(f"keep: at[{number}]: time {time:g}; must not be after t_end, {t_end:g}")
    return times


def write_sweep(table: str, keep: Mapping[str, Any] | None, t_end: float, folder: str) -> str:
    """Writes a sweep file for the cases of a table. --until replaces its t_end."""
    path = os.path.join(folder, "sweep.lua")
    with open(path, "w", encoding="utf-8") as file:
        fields = kept({"final": True} if keep is None else keep, t_end)
        file.write(f'return require "refdyn".sweep {{ t_end = 1e300, table = {lua_text(os.path.basename(table))}, keep = {fields} }}\n')
    return path


# ---- Results ----

def along_axes(runs: xarray.Dataset, shape: tuple[int, ...], names: Sequence[str]) -> xarray.Dataset:
    """Returns the dataset with a dimension of each of these names instead of `case`."""
    import xarray
    dims = tuple(names)
    variables: dict[str, xarray.Variable] = {}
    coordinates: dict[str, xarray.Variable] = {}
    for key, variable in runs.variables.items():
        name = str(key)
        if "case" not in variable.dims:
            (coordinates if name in runs.coords else variables)[name] = variable
        elif name in dims:
            place = dims.index(name)
            at = tuple(slice(None) if axis == place else 0 for axis in range(len(dims)))
            coordinates[name] = xarray.Variable((name,), variable.values.reshape(shape)[at], variable.attrs)
        else:
            values = variable.values.reshape(shape + variable.shape[1:])
            (coordinates if name == "case" else variables)[name] = xarray.Variable(dims + variable.dims[1:], values, variable.attrs)
    return xarray.Dataset(variables, coordinates, runs.attrs)


def labelled(runs: xarray.Dataset, labels: Any) -> xarray.Dataset:
    """Returns the dataset with the index of the data frame of cases along `case`."""
    if labels is None:
        return runs
    return runs.assign_coords(case=("case", np.asarray(labels), {"long_name": str(labels.name)} if labels.name is not None else {}))


def shown_label(label: Any) -> str:
    return repr(label) if isinstance(label, str) else str(label)


def reasons(cases: Iterable[Any], status: Iterable[int], texts: Iterable[str]) -> list[str]:
    """Returns a line for each kind of reason: the first case that failed for it, and how many others did."""
    found: dict[str, list[tuple[Any, str]]] = collections.defaultdict(list)
    for case, code, text in zip(cases, status, texts):
        if code:
            found[NUMBER.sub("", text)].append((case, text))
    ordered = sorted(found.values(), key=len, reverse=True)
    lines = [f"  case {shown_label(failed[0][0])}{others(len(failed) - 1)}: {failed[0][1]}" for failed in ordered[:SHOWN_REASONS]]
    return lines + ([f"  and {len(ordered) - SHOWN_REASONS} further reasons"] if len(ordered) > SHOWN_REASONS else [])


def others(count: int) -> str:
    return f" and {count} other{'s' if count > 1 else ''}" if count else ""


def warn_of_failures(runs: xarray.Dataset) -> None:
    """Raises one warning about all failed cases."""
    status, texts = runs.status.values.ravel(), runs.reason.values.ravel()
    failed = int(np.count_nonzero(status))
    if failed:
        warn("\n".join([f"{failed} of {status.size} cases failed; see `status` and `reason` of the dataset:", *reasons(runs.case.values.ravel(), status, texts)]))
