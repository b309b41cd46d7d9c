"""What the program writes, as xarray datasets with units; and the tables that it reads."""
from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray

from .program import text_of
from .quantity import unknown

if TYPE_CHECKING:
    from .model import Model

AXES = ("x", "y", "z")
EXTREMES = ("_min", "_min_t", "_max", "_max_t")


def variable(dims: Iterable[str], values: Any, unit: str | None = None) -> xarray.Variable:
    return xarray.Variable(tuple(dims), values, {"units": unit} if unit else {})


def put(variables: dict[str, xarray.Variable], name: str, kind: str, value: xarray.Variable) -> None:
    """A name that is taken gets its kind before it."""
    while name in variables:
        name = f"{kind}_{name}"
    variables[name] = value


def moment(unit: str) -> str:
    """The unit of the force of a coordinate."""
    return "N m" if unit == "rad" else "N"


def put_points(variables: dict[str, xarray.Variable], points: Mapping[str, Any]) -> None:
    for point, place in points.items():
        for axis, value in zip(AXES, place):
            put(variables, f"{point}_{axis}", "point", variable((), float(value), "m"))


# ---- Equilibria and modes ----

def of_equilibrium(model: Model, told: Mapping[str, Any], held: Collection[str]) -> xarray.Dataset:
    variables: dict[str, xarray.Variable] = {}
    for name, value in zip(told["coordinates"], told["q"]):
        put(variables, name, "coordinate", variable((), float(value), model.units[name]))
    put_points(variables, told["points"])
    for name, value in zip((name for name in model.coordinates if name in held), told["hold_force"]):
        put(variables, f"force_{name}", "hold", variable((), float(value), moment(model.units[name])))
    put(variables, "lambda", "row", variable(("row",), np.array(told["lambda"], dtype=float)))
    put(variables, "row", "row", variable(("row",), np.array(told["rows"], dtype=str)))
    keys = ("residual", "phi", "stability", "unstable", "neutral", "potential")
    return xarray.Dataset(variables, attrs={key: told[key] for key in keys})


def complex_of(told: Mapping[str, Any]) -> np.ndarray:
    return np.array(told["re"]) + 1j * np.array(told["im"])


def of_modes(model: Model, told: Mapping[str, Any]) -> xarray.Dataset:
    modes, points = told["modes"], list(model.points)
    free = len(modes)
    shape = np.array([complex_of(mode["shape"]) for mode in modes]).reshape(free, len(model.coordinates))
    moved = np.array([[complex_of(mode["points"][point]) for point in points] for mode in modes]).reshape(free, len(points), 3)
    data = {key: variable(("mode",), np.array([mode[key] for mode in modes], dtype=float), unit)
            for key, unit in (("frequency", "Hz"), ("omega", "rad/s"), ("damping", None))}
    data["eigenvalue"] = variable(("mode",), np.array([complex(*mode["eigenvalue"]) for mode in modes]), "1/s")
    data["shape"] = variable(("mode", "coordinate"), shape)
    data["displacement"] = variable(("mode", "point", "axis"), moved, "m")
    data["q"] = variable(("coordinate",), np.array(told["q"], dtype=float))
    coords = {"mode": np.arange(1, free + 1), "coordinate": list(model.coordinates), "point": points, "axis": list(AXES),
              "unit": ("coordinate", [model.units[name] for name in model.coordinates])}
    keys = ("at", "t", "held", "phi", "residual", "unstable")
    return xarray.Dataset(data, coords, {key: told[key] for key in keys})


# ---- Motions ----

def of_motion(model: Model, path: str, summary: str | None) -> xarray.Dataset:
    """The columns of a CSV along t."""
    told = json.loads(pathlib.Path(summary).read_text()) if summary else {}
    units = {"t": "s", **told.pop("units", {})}
    with open(path, encoding="utf-8") as file:
        names = file.readline().rstrip("\n").split(",")
        rows = [line.split(",") for line in file if line.endswith("\n")]
    table = np.array(rows, dtype=float).reshape(len(rows), len(names))
    units.update((name, unit) for name, unit in {**model.units, **model._units["inputs"]}.items() if name not in units)
    data = {name: variable(("t",), table[:, i], units.get(name)) for i, name in enumerate(names)}
    return xarray.Dataset(data, attrs=told)


def write_samples(inputs: Mapping[str, npt.ArrayLike] | None, known: Iterable[str], folder: str) -> str | None:
    """The file of --inputs: samples along t, or one for all times."""
    if not inputs:
        return None
    for name in inputs:
        if name != "t" and name not in known:
            raise ValueError(unknown("input", name, known))
    columns = {"t": inputs.get("t", 0.0), **{name: value for name, value in inputs.items() if name != "t"}}
    return write_table(columns, os.path.join(folder, "inputs.csv"))


def write_cases(cases: Mapping[str, npt.ArrayLike], folder: str) -> str:
    return write_table(cases, os.path.join(folder, "cases.csv"))


def write_table(columns: Mapping[str, Any], path: str) -> str:
    """Columns of one length, or of one value for all rows."""
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values)) for values in columns.values()))
    fields = [[field_of(name, value) for value in array] for name, array in zip(columns, arrays)]
    lines = [",".join(columns), *map(",".join, zip(*fields))]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def field_of(name: str, value: Any) -> str:
    text = text_of(value)
    if any(letter in text for letter in ',"\n'):
        raise ValueError(f"{name}: {text!r} has a comma, a quote or the end of a line, which a table cannot have")
    return text


# ---- Batches ----

def need_h5py() -> Any:
    try:
        import h5py
    except ImportError as error:
        raise ImportError("batches are read by h5py: pip install h5py") from error
    return h5py


def texts(values: np.ndarray) -> np.ndarray:
    return np.array([value.decode() if isinstance(value, bytes) else value for value in values], dtype=object)


def of_runs(path: str, summary: str) -> xarray.Dataset:
    with need_h5py().File(path) as file, open(summary) as told:
        variables: dict[str, xarray.Variable] = {"case": variable(("case",), file["case"][()])}
        for name in ("status", "reason", "steps", "cpu_s"):
            put(variables, name, "case", of_item(file[name], ("case",)))
        for name, item in file["cases"].items():
            is_start = text_of_attribute(item, "kind").startswith("start ")
            put(variables, name + ("_start" if is_start else ""), "case", of_item(item, ("case",)))
        for group in ("final", "at", "extremes", "norms", "history"):
            put_group(variables, group, file.get(group, {}))
        return xarray.Dataset(variables, attrs=json.load(told))


def text_of_attribute(item: Any, name: str) -> str:
    value = item.attrs.get(name, "")
    return value.decode() if isinstance(value, bytes) else str(value)


def of_item(item: Any, dims: Iterable[str]) -> xarray.Variable:
    values = item[()]
    if values.dtype.kind in "OS":
        values = texts(values)
    return variable(dims, values, text_of_attribute(item, "units"))


def put_group(variables: dict[str, xarray.Variable], group: str, items: Mapping[str, Any]) -> None:
    """A group of the file under the names of RUNS.csv."""
    suffix = {"norms": "_rms", "at": "_at", "history": "_history"}.get(group, "")
    axis = {"at": "t_at", "history": "t"}.get(group)
    for name, item in items.items():
        if group == "extremes" and name != "which":
            columns = of_item(item, ("case", "which"))
            for place, ending in enumerate(EXTREMES):
                unit = "s" if ending.endswith("_t") else columns.attrs.get("units")
                put(variables, name + ending, group, variable(("case",), columns.values[:, place], unit))
        elif axis and name == "t":
            variables[axis] = of_item(item, (axis,))
        elif group == "final" and name == "t":
            put(variables, "t_end", group, of_item(item, ("case",)))
        elif name != "which":
            put(variables, name + suffix, group, of_item(item, ("case", axis) if axis else ("case",)))
