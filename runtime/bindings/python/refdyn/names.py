"""What is said of names that are not there, and of values that are no real numbers."""
from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

WHERE = {"parameter": "a parameter, parameters={...} takes it", "input": "an input, inputs={...} takes it",
         "option": "an option, refdyn.Model takes it", "coordinate": "a coordinate, q takes it"}


def nearest(name: str, known: Iterable[str]) -> str | None:
    lower = {other.lower(): other for other in known}
    near = difflib.get_close_matches(str(name).lower(), lower, 1)
    return lower[near[0]] if near else None


def unknown(kind: str, name: str, known: Collection[str], kinds: Mapping[str, Collection[str]] = {}) -> str:
    """`kinds`: the names of the model by their kind; one of another kind is told to be one."""
    fact = f"no {kind} is called {name!r}"
    for other, names in kinds.items():
        if name in names:
            return f"{fact}, it is {WHERE[other]}"
    near = nearest(name, known)
    return fact + (f", the nearest is {near!r}" if near else f", known: {', '.join(known) or 'none'}")


def by_name(kind: str, given: Mapping[str, Any] | None, kinds: Mapping[str, Collection[str]], beside: Collection[str] = ()) -> Mapping[str, Any]:
    """What is given, {} for None: values by names that the model has, or that are allowed beside these."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise TypeError(f"{kind}s: {type(given).__name__}, values by name are needed: {{'NAME': value}}")
    for name in given:
        if name not in kinds[kind] and name not in beside:
            raise ValueError(unknown(kind, name, kinds[kind], kinds))
    return given


def has_masked(value: Any) -> bool:
    """Is a value of a masked array left out, or of such arrays in a list?"""
    return bool(np.ma.is_masked(value)) or isinstance(value, (list, tuple)) and any(map(has_masked, value))


def reals(name: str, value: npt.ArrayLike) -> np.ndarray:
    """Doubles at places that the compiled code can read; what would lose something on the way is refused, as are functions and texts."""
    if has_masked(value):
        raise TypeError(f"{name}: a value is masked, real numbers are needed")
    try:
        array = np.asarray(value)
    except TypeError as error:
        raise TypeError(f"{name}: {type(value).__name__}, real numbers are needed") from error
    if array.dtype.kind not in "biufO" or array.dtype.kind == "O" and (callable(value) or isinstance(value, Mapping)):
        what = "a function" if callable(value) else f"a value of {array.dtype}" if array.dtype.kind != "O" else type(value).__name__
        raise TypeError(f"{name}: {what}, real numbers are needed")
    if array.dtype.kind == "O" and any(item is None for item in array.flat):
        raise TypeError(f"{name}: a value is None, real numbers are needed")
    try:
        return np.require(array.astype(float, copy=False), requirements="A")
    except TypeError as error:
        raise TypeError(f"{name}: {error}, real numbers are needed") from error


def finite_row(name: str, value: npt.ArrayLike, needed: str) -> np.ndarray:
    """Finite numbers, in one row or a single one; `needed` says what they are."""
    array = reals(name, value)
    if array.ndim > 1:
        raise ValueError(f"{name}: an array of shape {array.shape}, {needed} is needed")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: a value is not finite")
    return array


def one_real(name: str, value: npt.ArrayLike) -> float:
    array = reals(name, value)
    if array.size != 1:
        raise ValueError(f"{name}: {array.size} values, one is needed")
    return float(array.reshape(()))
