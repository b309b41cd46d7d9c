"""Reads the program's results as xarray datasets with units, and writes the tables that it reads."""
from __future__ import annotations

import json
import os
import pathlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .core import VERSION
from .program import text_of
from .recorded import Columns
from .wording import shown

if TYPE_CHECKING:
    import xarray

    from .model import Model

AXES = ("x", "y", "z")
EXTREMES = ("_min", "_min_t", "_max", "_max_t")
LIMIT = (*EXTREMES, "_beyond_t", "_beyond_s")
TIME_AXES = {"at": "t_at", "history": "t"}


def variable(dims: Iterable[str], values: Any, unit: str | None = None) -> xarray.Variable:
    import xarray  # takes half a second, which quantities do not need
    return xarray.Variable(tuple(dims), values, {"units": unit} if unit else {})


def dataset(variables: Mapping[str, xarray.Variable], coords: Mapping[str, Any] | None = None, *, attrs: Mapping[str, Any]) -> xarray.Dataset:
    import xarray
    return xarray.Dataset(variables, coords, attrs)


def put(variables: dict[str, xarray.Variable], name: str, kind: str, value: xarray.Variable) -> str:
    """Adds a variable and returns its name. If the name is taken, its kind precedes it."""
    while name in variables:
        name = f"{kind}_{name}"
    variables[name] = value
    return name


def moment(unit: str) -> str:
    """Returns the unit of the generalised force of a coordinate."""
    return "N m" if unit == "rad" else "N"


def put_points(variables: dict[str, xarray.Variable], points: Mapping[str, Any]) -> None:
    for point, place in points.items():
        for axis, value in zip(AXES, place):
            put(variables, f"{point}_{axis}", "point", variable((), float(value), "m"))


# ---- Attributes ----

def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Returns attributes that netCDF can store: numbers and texts. Lists and objects become JSON; None is left out."""
    forms = {bool: int, list: json.dumps, dict: json.dumps}
    return {key: forms.get(type(value), lambda same: same)(value) for key, value in values.items() if value is not None}


def attributes(model: Model, parameters: Mapping[str, float], inputs: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Returns the attributes that name the version of the package, the model of a dataset, its options and its values."""
    constants = {name: float(np.reshape(value, ())) for name, value in (inputs or {}).items() if name != "t" and np.size(value) == 1}
    return plain({"refdyn": VERSION, "model": model._name, "options": dict(model.options), "parameters": {**model._fixed, **parameters}, "inputs": constants or None})


# ---- Equilibria and modes ----

def of_equilibrium(model: Model, result: Mapping[str, Any], held: Collection[str], attrs: Mapping[str, Any]) -> xarray.Dataset:
    variables: dict[str, xarray.Variable] = {}
    for name, value in zip(model._joints, result["q"]):
        put(variables, name, "coordinate", variable((), float(value), model.units[name]))
    for name, value in (result["states"] if "states" in result else dict(zip(model.state_names, result["qd"][len(model._joints):]))).items():
        put(variables, name, "state", variable((), float(value), model.units[name]))
    put_points(variables, result["points"])
    for name, value in zip((name for name in model.coordinates if name in held), result["hold_force"]):
        put(variables, f"force_{name}", "hold", variable((), float(value), moment(model.units[name]) if name in model._joints else None))
    for contact in result.get("contacts", ()):
        put(variables, f"contact_{contact['name']}", "contact", variable((), float(contact["force"])))
        put(variables, f"gap_{contact['name']}", "contact", variable((), float(contact["gap"])))
    put(variables, "lambda", "row", variable(("row",), np.array(result["lambda"], dtype=float)))
    put(variables, "row", "row", variable(("row",), np.array(result["rows"], dtype=str)))
    keys = ("residual", "phi", "stability", "unstable", "neutral", "potential", "criterion")
    return dataset(variables, attrs={**attrs, **plain({key: result[key] for key in keys})})


def complex_of(result: Mapping[str, Any]) -> np.ndarray:
    return np.array(result["re"]) + 1j * np.array(result["im"])


def of_modes(model: Model, result: Mapping[str, Any], attrs: Mapping[str, Any]) -> xarray.Dataset:
    modes, points = result["modes"], list(model.points)
    free = len(modes)
    shape = np.array([complex_of(mode["shape"]) for mode in modes]).reshape(free, len(model._joints))
    moved = np.array([[complex_of(mode["points"][point]) for point in points] for mode in modes]).reshape(free, len(points), 3)
    data = {key: variable(("mode",), np.array([mode[key] for mode in modes], dtype=float), unit)
            for key, unit in (("frequency", "Hz"), ("omega", "rad/s"), ("damping", None))}
    data["eigenvalue"] = variable(("mode",), np.array([complex(*mode["eigenvalue"]) for mode in modes]), "1/s")
    data["shape"] = variable(("mode", "coordinate"), shape)
    data["displacement"] = variable(("mode", "point", "axis"), moved, "m")
    data["q"] = variable(("coordinate",), np.array(result["q"], dtype=float))
    coords: dict[str, Any] = {"mode": np.arange(1, free + 1), "coordinate": list(model._joints), "point": points, "axis": list(AXES),
                              "unit": ("coordinate", [model.units[name] for name in model._joints])}
    if model.state_names:
        data["shape_of_states"] = variable(("mode", "state"), np.array([complex_of(mode["shape_of_states"]) for mode in modes]).reshape(free, len(model.state_names)))
        coords["state"] = list(model.state_names)
    keys = ("at", "t", "held", "phi", "residual", "unstable")
    return dataset(data, coords, attrs={**attrs, **plain({key: result[key] for key in keys})})


def of_linear_model(model: Model, result: Mapping[str, Any], attrs: Mapping[str, Any]) -> xarray.Dataset:
    sizes = {"state": len(result["states"]), "of_state": len(result["states"]), "input": len(result["inputs"]), "output": len(result["outputs"])}
    dims = {"A": ("state", "of_state"), "B": ("state", "input"), "C": ("output", "of_state"), "D": ("output", "input"), "rate": ("state",)}
    data = {name: variable(axes, np.array(result[name], dtype=float).reshape([sizes[axis] for axis in axes])) for name, axes in dims.items()}
    data["eigenvalue"] = variable(("mode",), np.array([complex(*pair) for pair in result["eigenvalues"]]), "1/s")
    data["q"] = variable(("coordinate",), np.array(result["q"], dtype=float))
    data["qd"] = variable(("coordinate",), np.array(result["qd"], dtype=float))
    coords = {"state": result["states"], "of_state": result["states"], "input": result["inputs"], "output": result["outputs"], "coordinate": list(model._joints)}
    return dataset(data, coords, attrs={**attrs, **plain({key: result[key] for key in ("at", "t", "held", "state_values") if key in result})})


# ---- Motions ----

def of_motion(model: Model, path: str, summary: str | None, attrs: Mapping[str, Any], is_dataset: bool, by: Sequence[str]) -> Any:
    """Reads the columns of a CSV along t."""
    facts = json.loads(pathlib.Path(summary).read_text()) if summary else {}
    units = {"t": "s", **facts.pop("units", {})}
    with open(path, encoding="utf-8") as file:
        names = file.readline().rstrip("\n").split(",")
        rows = [line.split(",") for line in file if line.endswith("\n")]
    run = Columns(names, np.array(rows, dtype=float).reshape(len(rows), len(names)), units, facts)
    if by:
        run.gather(by, model)
    return of_columns(model, run, attrs) if is_dataset else run


def of_columns(model: Model, run: Columns, attrs: Mapping[str, Any]) -> xarray.Dataset:
    """The dataset of a motion. From the third motion with the same columns and times on, it is a copy of a form, which takes xarray half as long."""
    layout = (tuple(run), run.variables, run["t"].tobytes())
    if layout == model._layout and model._form is not None:
        found = model._form.copy(data={name: column for name, column in run.items() if name != "t"})
    else:
        found = of_layout(model, run)
        model._form = found.copy(data=without_values(run)) if layout == model._layout else None
        model._layout = layout
    found.attrs = {**attrs, **plain(run.attrs)}
    return found


def of_layout(model: Model, run: Columns) -> xarray.Dataset:
    """The columns with their units, names and times."""
    units = {**model.units, **model._units["inputs"], **run.units}
    data = {name: variable(("t", "parameter")[:column.ndim], column, units.get(name)) for name, column in run.items()}
    for name, row in residuals(model, data):
        data[name].attrs["long_name"] = row
    return dataset(data, {"parameter": list(run.variables)} if run.variables else None, attrs={})


def without_values(run: Columns) -> dict[str, np.ndarray]:
    """Zeros in the shapes of the columns; they take no memory."""
    return {name: np.broadcast_to(0.0, column.shape) for name, column in run.items() if name != "t"}


def residuals(model: Model, names: Iterable[str]) -> list[tuple[str, str]]:
    """Returns the columns that belong to a row, such as phi_2, and a text that names the row."""
    of_model = {*model.units, *(name + "_d" for name in model.units), *model.inputs, *model.courses}
    found = ((name, re.fullmatch(r"(?:phi|psi)_(\d+)", name)) for name in names if name not in of_model)
    return [(name, f"{name[:3]} of {model.rows[int(place[1]) - 1]}") for name, place in found if place and 0 < int(place[1]) <= len(model.rows)]


def write_motion(words: str, run: xarray.Dataset, path: str) -> None:
    """Writes the variables along t as a CSV of `refdyn sim`."""
    names = [str(name) for name in run.variables if run[name].dims == ("t",)]
    if "t" not in names or not run.sizes["t"]:
        raise ValueError(f"view: {words} is not a dataset of arm.simulate; must have rows along t")
    table = np.column_stack([run["t"].values, *(run[name].values for name in names if name != "t")])
    for name in names:
        if not np.isfinite(run[name].values).all():
            raise ValueError(f"view: {words}: {name} contains values that are not finite; leave out these rows or this variable")
    lines = [",".join(["t", *(name for name in names if name != "t")]), *(",".join(map(repr, row)) for row in table.tolist())]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_samples(columns: Mapping[str, npt.ArrayLike], folder: str) -> str | None:
    """Writes the file of --inputs."""
    return write_table(columns, os.path.join(folder, "inputs.csv")) if columns else None


def write_cases(cases: Mapping[str, npt.ArrayLike], folder: str) -> str:
    return write_table(cases, os.path.join(folder, "cases.csv"))


def write_table(columns: Mapping[str, Any], path: str) -> str:
    """Writes columns of equal length; a column with one value has it in all rows."""
    rows = max(np.size(values) for values in columns.values())
    arrays = [np.broadcast_to(values, rows) for values in columns.values()]
    fields = [[field_of(name, value) for value in array] for name, array in zip(columns, arrays)]
    lines = [",".join(columns), *map(",".join, zip(*fields))]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def field_of(name: str, value: Any) -> str:
    text = text_of(name, value)
    if any(letter in text for letter in ',"\n'):
        raise ValueError(f"{name}: {text!r} contains a comma, a quote or a line break; remove it")
    return text


# ---- Batches ----

def need_h5py() -> Any:
    try:
        import h5py
    except ImportError as error:
        raise ImportError("batch: h5py is missing; install it with pip install h5py") from error
    return h5py


def texts(values: np.ndarray) -> np.ndarray:
    return np.array([value.decode() if isinstance(value, bytes) else value for value in values], dtype=object)


def of_options(model: Model, name: str, values: np.ndarray) -> np.ndarray:
    """Returns the values of an option that varies, in the type that `model.options` has."""
    kind = type(model.options.get(name, ""))
    read = {bool: lambda text: text == "true", int: lambda text: int(float(text)), float: float}.get(kind)
    return np.array([read(text) for text in texts(values)]) if read else values


def of_runs(model: Model, path: str, summary: str, attrs: Mapping[str, Any]) -> tuple[xarray.Dataset, dict[str, str]]:
    """Returns the dataset, and the name of the variable of each varied value."""
    names = {}
    with need_h5py().File(path) as file, open(summary) as summary_file:
        variables = {"case": variable(("case",), file["case"][()])}
        for group, axis in TIME_AXES.items():
            if f"{group}/t" in file:
                variables[axis] = of_item(file[f"{group}/t"], (axis,))
        for name in ("status", "reason", "steps", "cpu_s"):
            put(variables, name, "case", of_item(file[name], ("case",)))
        variables["reason"].values = np.array([shown(text) for text in variables["reason"].values], dtype=object)
        for name, item in file["cases"].items():
            is_start = text_of_attribute(item, "kind").startswith("start ")
            varied = of_item(item, ("case",))
            if varied.dtype.kind == "O":
                varied.values = of_options(model, name, varied.values)
            names[name] = put(variables, name + ("_start" if is_start else ""), "case", varied)
        for group in ("final", "at", "extremes", "norms", "history", "derivatives", "limits", "realise"):
            put_group(variables, group, file.get(group, {}))
        return dataset(variables, attrs={**attrs, **plain(json.load(summary_file))}), names


def text_of_attribute(item: Any, name: str) -> str:
    value = item.attrs.get(name, "")
    return value.decode() if isinstance(value, bytes) else str(value)


def of_item(item: Any, dims: Iterable[str]) -> xarray.Variable:
    values = item[()]
    if values.dtype.kind in "OS":
        values = texts(values)
    return variable(dims, values, text_of_attribute(item, "units"))


def put_group(variables: dict[str, xarray.Variable], group: str, items: Mapping[str, Any]) -> None:
    """Adds a group of the file under the names of RUNS.csv."""
    suffix = {"norms": "_rms", "at": "_at", "history": "_history"}.get(group, "")
    axis = TIME_AXES.get(group)
    for name, item in items.items():
        if name == {"at": "t", "history": "t", "extremes": "which", "limits": "which"}.get(group):
            continue
        if group in ("extremes", "limits"):
            columns = of_item(item, ("case", "which"))
            for place, ending in enumerate(EXTREMES if group == "extremes" else LIMIT):
                unit = "s" if ending.endswith(("_t", "_s")) else columns.attrs.get("units")
                put(variables, ("limit_" if group == "limits" else "") + name + ending, group, variable(("case",), columns.values[:, place], unit))
        elif group == "final" and name == "t":
            put(variables, "t_end", group, of_item(item, ("case",)))
        else:
            put(variables, name + suffix, group, of_item(item, ("case", axis) if axis else ("case",)))
