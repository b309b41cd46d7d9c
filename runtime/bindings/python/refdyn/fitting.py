"""Values of a model from measured data: the request of `arm.fit`, and its result."""
from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .cases import lua_text
from .names import not_one_of, one_real
from .program import text_of
from .samples import is_along_t

if TYPE_CHECKING:
    import xarray

SENSOR = ("offset", "gain", "delay")
RANGE = "must be None, (from, to) or (from, to, start)"


class Fit:
    """Result of `arm.fit`. Arrays have the names of the values as coordinates, so that `found.covariance.sel(value="E")` is a row.

    values              of the model, then of sensors (`E_xdd_gain`), then starts of files (`arm_psi@0`: of data[0]); None after a check
    standard_errors     of the values that the fit finds; None if the data cannot tell some values apart
    covariance, correlations   of the same values
    parameters          the values of parameters, for `arm.simulate(..., parameters=found.parameters)`
    chi2_dof            chi^2 for each of `degrees_of_freedom`; about 1 if the model explains the data
    residuals           along `column`: count, rms, mean, largest, noise, in the unit of the column
    not_identifiable    groups of names that the data do not determine, alone or together
    validation          chi2_dof and residuals of the files held out, or None
    attrs               all keys of the FIT.json of the program
    """

    __module__ = "refdyn"

    values: xarray.DataArray | None
    standard_errors: xarray.DataArray | None
    covariance: xarray.DataArray | None
    correlations: xarray.DataArray | None
    parameters: dict[str, float]
    chi2_dof: float
    degrees_of_freedom: int
    residuals: xarray.Dataset | None
    not_identifiable: tuple[tuple[str, ...], ...]
    validation: dict[str, Any] | None
    attrs: dict[str, Any]

    def __init__(self, found: Mapping[str, Any], parameters: Sequence[str]) -> None:
        errors = found.get("standard_errors")
        values = {**found.get("values", {}), **found.get("sensors", {}), **found.get("starts", {})}
        self.values = row(values) if values else None
        self.standard_errors = row(errors) if errors else None
        self.covariance = square(found["covariance"], list(errors)) if errors else None
        self.correlations = square(found["correlations"], list(errors)) if errors else None
        self.parameters = {name: value for name, value in found.get("values", {}).items() if name in parameters}
        self.chi2_dof = found.get("chi2_dof", np.nan)
        self.degrees_of_freedom = found.get("degrees_of_freedom", 0)
        self.residuals = by_column(found["residuals"]) if "residuals" in found else None
        self.not_identifiable = tuple(map(tuple, found["not_identifiable"]))
        validation = found.get("validation")
        self.validation = {**validation, "residuals": by_column(validation["residuals"])} if validation else None
        self.attrs = dict(found)

    def __repr__(self) -> str:
        errors = {} if self.standard_errors is None else dict(zip(self.standard_errors["value"].values.tolist(), self.standard_errors.values.tolist()))
        values = dict.fromkeys(errors, None) if self.values is None else dict(zip(self.values["value"].values.tolist(), self.values.values.tolist()))
        lines = [f"  {name:12}" + ("" if value is None else f" {value:.6g}") + (f" +- {errors[name]:.2g}" if name in errors else "") for name, value in values.items()]
        last = [] if np.isnan(self.chi2_dof) else [f"  chi2_dof     {self.chi2_dof:.4g}"]
        return "\n".join([f"<refdyn fit of {len(values)} value{'s' if len(values) != 1 else ''}>", *lines, *last])


def row(values: Mapping[str, float]) -> xarray.DataArray:
    import xarray
    return xarray.DataArray(np.array(list(values.values()), dtype=float), {"value": list(values)}, ("value",))


def square(values: Sequence[Sequence[float]], names: list[str]) -> xarray.DataArray:
    import xarray
    return xarray.DataArray(np.array(values, dtype=float).reshape(len(names), len(names)), {"value": names, "other": names}, ("value", "other"))


def by_column(residuals: Mapping[str, Mapping[str, float]]) -> xarray.Dataset:
    import xarray
    keys = next(iter(residuals.values()), {})
    return xarray.Dataset({key: ("column", np.array([entry[key] for entry in residuals.values()])) for key in keys}, {"column": list(residuals)})


# ---- The file FIT.lua of a call ----

def range_text(name: str, value: Any) -> str:
    """Writes bounds as rd.within, and None as rd.free."""
    if value is None:
        return "rd.free()"
    if isinstance(value, str) or np.ndim(value) != 1 or np.size(value) not in (2, 3):
        raise ValueError(f"{name}: {value!r}; {RANGE}")
    return f"rd.within({', '.join(text_of(name, one_real(name, number)) for number in value)})"


def entry(name: str, text: str) -> str:
    return f"[{lua_text(name)}] = {text}"


def vary_text(vary: Any) -> str:
    if isinstance(vary, str):
        vary = vary.split(",")
    given = vary if isinstance(vary, Mapping) else dict.fromkeys(vary)
    return f"{{ {', '.join(entry(name, range_text(f'vary: {name}', value)) for name, value in given.items())} }}"


def noise_text(noise: Any) -> str:
    if not isinstance(noise, Mapping):
        raise TypeError(f"noise: {type(noise).__name__}; must be standard deviations by column, {{'NAME': 1e-3}}")
    return f"{{ {', '.join(entry(name, text_of(f'noise: {name}', one_real(f'noise: {name}', sigma))) for name, sigma in noise.items())} }}"


def sensor_text(name: str, sensor: Any) -> str:
    if not isinstance(sensor, Mapping):
        raise TypeError(f"sensors: {name}: {type(sensor).__name__}; must be a dictionary with {', '.join(SENSOR)}")
    for key in sensor:
        if key not in SENSOR:
            raise ValueError(f"sensors: {name}: {not_one_of(key, SENSOR)}")
    return ", ".join(f"{key} = " + (range_text(f"sensors: {name}: {key}", value) if value is None or np.ndim(value) else text_of(key, one_real(key, value)))
                     for key, value in sensor.items())


def is_file(item: Any) -> bool:
    return isinstance(item, (str, os.PathLike))


def listed(argument: str, data: Any) -> list[Any]:
    """One set of data, or a list of them."""
    if data is None:
        return []
    items = list(data) if isinstance(data, (list, tuple)) else [data]
    for item in items:
        if not is_file(item) and not hasattr(item, "keys"):
            raise TypeError(f"{argument}: {type(item).__name__}; must be a file, a data frame, a dataset, columns by name, or a list of them")
    return items


def doubles(name: str, values: Any) -> np.ndarray:
    """Converts a column of data to doubles; a missing value is NaN."""
    try:
        return np.asarray(values, dtype=float)
    except OverflowError as error:
        raise ValueError(f"{name}: contains an integer that is too large; all numbers must be finite") from error


def write_data(argument: str, item: Any, path: str) -> str:
    """Writes columns as a CSV, in which gaps are empty; returns the path of the file of data."""
    if is_file(item):
        return os.path.abspath(item)
    if is_along_t(item):
        item = item.reset_index()
    names = [str(name) for name in (item.variables if hasattr(item, "variables") else item.keys())]
    columns = {name: doubles(f"{argument}: {name}", item[name]) for name in names if not hasattr(item, "variables") or item[name].dims == ("t",)}
    if "t" not in columns:
        raise ValueError(f"{argument}: no column t; add the time of each measurement [s]")
    for name, values in columns.items():
        if values.shape != columns["t"].shape or values.ndim != 1:
            raise ValueError(f"{argument}: {name}: has shape {values.shape}; must have the shape of 't', {columns['t'].shape}")
    rows = np.column_stack(list(columns.values())).tolist()
    with open(path, "w", encoding="utf-8") as file:
        file.write(",".join(columns) + "\n")
        file.writelines(",".join("" if value != value else repr(value) for value in values) + "\n" for values in rows)
    return path


class Request:
    """A FIT.lua with its data in a folder."""

    def __init__(self, folder: str, data: Any, held_out: Any, vary: Any, noise: Any, sensors: Mapping[str, Any] | None, starts: str | Sequence[str] | Mapping[str, Any]) -> None:
        self.labels: dict[str, str] = {}  # of files, for names of starts
        used = self.write(folder, "data", data)
        held = self.write(folder, "held_out", held_out)
        names = "{ " + ", ".join(map(lua_text, [starts] if isinstance(starts, str) else starts)) + " }"
        fields = [f"vary = {vary_text(vary)}", f"noise = {noise_text(noise)}",
                  f"sensors = {{ {', '.join(entry(name, f'{{ {sensor_text(name, sensor)} }}') for name, sensor in (sensors or {}).items())} }}",
                  f"starts = {vary_text(starts) if isinstance(starts, Mapping) else names}", f"data = {{ {', '.join(map(lua_text, used))} }}", f"held_out = {{ {', '.join(map(lua_text, held))} }}"]
        self.path = os.path.join(folder, "fit.lua")
        with open(self.path, "w", encoding="utf-8") as file:
            file.write('local rd = require "refdyn"\nreturn rd.fit {\n' + "".join(f"  {field},\n" for field in fields) + "}\n")

    def write(self, folder: str, argument: str, data: Any) -> list[str]:
        paths = []
        for number, item in enumerate(listed(argument, data)):
            paths.append(write_data(f"{argument}[{number}]", item, os.path.join(folder, f"{argument}_{number}.csv")))
            self.labels[paths[-1]] = os.fspath(item) if is_file(item) else str(number) if argument == "data" else f"{argument}[{number}]"
        return paths

    def renamed(self, found: Any) -> Any:
        """The result with labels of files in place of their paths."""
        if isinstance(found, str):
            name, sign, path = found.partition("@")
            return f"{name}@{self.labels.get(path, path)}" if sign else found
        if isinstance(found, dict):
            return {self.renamed(key): self.renamed(value) for key, value in found.items()}
        return [self.renamed(item) for item in found] if isinstance(found, list) else found
