"""Splits the inputs of a motion into constants and columns of samples along `t`."""
from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .names import by_name, finite_row


def of_dataset(inputs: Any) -> Any:
    """Returns the variables of a dataset along t with its times, by name, and a frame indexed by t with its times as a column; other
    inputs as they are."""
    if is_along_t(inputs):
        return inputs.reset_index()
    return {str(name): inputs[name].values for name in inputs.variables} if hasattr(inputs, "data_vars") else inputs


def is_along_t(data: Any) -> bool:
    """Returns whether data are a frame of pandas whose index has the times."""
    return hasattr(data, "columns") and getattr(getattr(data, "index", None), "name", None) == "t" and "t" not in data.columns


def split(inputs: Mapping[str, npt.ArrayLike] | None, kinds: Mapping[str, Collection[str]],
          by_events: Collection[str]) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Returns settings of the model and the columns of --inputs.

    Constants for inputs that events change become settings, since a column of --inputs must not set such an input. Samples
    and the other constants become columns."""
    given = {name: finite_row("times" if name == "t" else f"input {name}", value, "one value or a row of samples")
             for name, value in by_name("input", inputs, kinds, ("t",)).items()}
    times = given.pop("t", None)
    if times is None:
        given, times = {name: constant(name, values) for name, values in given.items()}, np.zeros(1)
    else:
        check_samples(times, given)
    settings = {name: float(values) for name, values in given.items() if name in by_events and values.ndim == 0}
    columns = {name: values for name, values in given.items() if name not in settings}
    return settings, {"t": times, **columns} if columns else {}


def constant(name: str, values: np.ndarray) -> np.ndarray:
    if values.size != 1:
        raise ValueError(f"input {name}: {values.size} values without times; write inputs={{'t': times, {name!r}: values}}")
    return values.reshape(())


def check_samples(times: np.ndarray, given: Mapping[str, np.ndarray]) -> None:
    if not given:
        raise ValueError("inputs: times 't' without an input; add an input with a value for each time")
    if not times.ndim or not times.size:
        raise ValueError(f"inputs: 't' has shape {times.shape}; must be a row of times")
    for name, values in given.items():
        if values.ndim and values.size != times.size:
            raise ValueError(f"input {name}: has shape {values.shape}; must have the shape of 't', {times.shape}")
