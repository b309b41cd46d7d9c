"""Checks of names and numbers that a caller passes, and the messages about wrong ones."""
from __future__ import annotations

import difflib
import functools
import inspect
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from .model import Model

WHERE = {"parameter": "a parameter; give it in parameters={...}", "input": "an input; give it in inputs={...}",
         "option": "an option; give it to refdyn.Model", "coordinate": "a coordinate; give it in q"}


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that differs least from `name`. Small and capital letters count only between names that differ in nothing else."""
    by_lower: dict[str, list[str]] = {}
    for other in known:
        by_lower.setdefault(other.lower(), []).append(other)
    near = difflib.get_close_matches(str(name).lower(), by_lower, 1)
    return max(by_lower[near[0]], key=lambda other: difflib.SequenceMatcher(None, str(name), other).ratio()) if near else None


def unknown(kind: str, name: str, known: Collection[str], kinds: Mapping[str, Collection[str]] = {}) -> str:
    """The message about an unknown name. `kinds` has the model's names by kind, so that a name of another kind gets a hint."""
    if kind == "input" and name == "t":
        return "t: unknown input; inputs are constant here, and samples with their times are for arm.simulate"
    for other, names in kinds.items():
        if name in names:
            return f"{name}: not {article(kind)} {kind} but {WHERE[other]}"
    near = nearest(name, known)
    hint = f"did you mean {near!r}?" if near else f"use one of {', '.join(known)}" if known else f"the model has no {kind}"
    return f"{name}: unknown {kind}; {hint}"


def not_one_of(name: Any, known: Collection[str], hints: Mapping[str, str] = {}) -> str:
    """The message about a value that is not a known name. `hints` has names from elsewhere, in small letters, and what to use instead."""
    near = hints.get(str(name).lower()) or nearest(name, known)
    return f"{name!r} is not one of {', '.join(known)}" + (f"; did you mean {near!r}?" if near else "")


Call = TypeVar("Call", bound=Callable[..., Any])
Kind = TypeVar("Kind", bound=type)


def unexpected(call: str, name: str, known: Iterable[str]) -> TypeError:
    """The error about a keyword that a call does not have, in Python's words."""
    near = nearest(name, known)
    return TypeError(f"{call}() got an unexpected keyword argument {name!r}" + (f"; did you mean {near!r}?" if near else ""))


def suggests(call: Call) -> Call:
    """Wraps a function so that its error about a misspelt keyword suggests the nearest one."""
    code = call.__code__
    keywords = [name for name in code.co_varnames[code.co_posonlyargcount:code.co_argcount + code.co_kwonlyargcount] if name != "self"]
    known = frozenset(keywords)

    @functools.wraps(call)
    def checked(*values: Any, **given: Any) -> Any:
        if not known.issuperset(given):
            raise unexpected(call.__name__, next(name for name in given if name not in known), keywords)
        return call(*values, **given)
    return checked  # type: ignore[return-value]


def suggesting(*quick: str) -> Callable[[Kind], Kind]:
    """Wraps the public methods of a class by `suggests`, except those in `quick`, which control loops call, and those with **options, which
    check keywords themselves."""
    def decorate(kind: Kind) -> Kind:
        for name, call in list(vars(kind).items()):
            if inspect.isfunction(call) and not name.startswith("_") and name not in quick and not call.__code__.co_flags & inspect.CO_VARKEYWORDS:
                setattr(kind, name, suggests(call))
        return kind
    return decorate


class Fixed:
    """An object with read-only attributes: an assignment is an error, which names the remedy. dir() lists the public attributes."""

    _remedy = "these values cannot be changed"

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"{name}: {self._remedy}")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{name}: {self._remedy}")

    def __dir__(self) -> list[str]:
        return sorted(name for name in super().__dir__() if not name.startswith("_"))


class ByName(dict[str, Any]):
    """Read-only values by name. The error about an unknown name suggests the nearest one; the error about an assignment ends with the
    remedy."""

    def __init__(self, kind: str, values: Mapping[str, Any] | Iterable[tuple[str, Any]], remedy: str = "copy them with dict(...)") -> None:
        super().__init__(values)
        self.kind, self.remedy = kind, remedy

    def __missing__(self, name: str) -> Any:
        raise KeyError(unknown(self.kind, name, self))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.kind, dict(self), self.remedy)

    def _refuse(self, *values: Any, **given: Any) -> Any:
        raise TypeError(f"{self.kind}s: these values are read-only; {self.remedy}")

    __setitem__ = __delitem__ = __ior__ = update = setdefault = pop = popitem = clear = _refuse


def article(kind: str) -> str:
    return "an" if kind[0] in "aeiou" else "a"


# ---- Containers with names ----

def names_in(value: Any) -> list[Any] | None:
    """The names of a data frame, a structured array, a series, a labelled array or a named tuple, as they stand there; None for anything
    else. The attributes decide, so that no package is imported."""
    if isinstance(value, (np.ndarray, np.void)):
        return list(value.dtype.names) if value.dtype.names else None
    if hasattr(value, "columns"):
        return list(value.columns)
    if hasattr(value, "dims") and hasattr(value, "coords"):
        along = labelled(value)
        return None if along is None else value.coords[along].values.tolist()
    if isinstance(value, tuple):
        return list(getattr(value, "_fields", ())) or None
    if hasattr(value, "items") and not callable(getattr(value, "index", len)):
        return list(value.index)
    return None


def labelled(array: Any) -> Any:
    """The last dimension of a labelled array whose labels are texts; None if there is none."""
    return next((along for along in reversed(array.dims) if along in array.coords and array.coords[along].dtype.kind in "UO"), None)


def values_in(value: Any, names: Sequence[str]) -> Iterable[Any]:
    """The values of a container with these names, in their order."""
    if hasattr(value, "dims"):
        return np.moveaxis(np.asarray(value), value.dims.index(labelled(value)), 0)
    if isinstance(value, tuple):
        return value
    return np.asarray(value) if hasattr(value, "items") and not hasattr(value, "columns") else [value[name] for name in names]


def with_names(argument: str, value: Any) -> Any:
    """Returns a container that has names as a mapping: a column for each name of a data frame, a value for each name of a series.
    Anything else stays as it is, also a container whose rows are numbered."""
    if value is None or isinstance(value, Mapping):
        return value
    names = names_in(value)
    if names is None or all(isinstance(name, (int, np.integer)) for name in names):
        return value
    for place, name in enumerate(names):
        if not isinstance(name, str):
            raise TypeError(f"{argument}: name {name!r}; names must be texts")
        if name in names[:place]:
            raise ValueError(f"{argument}: {name} is given twice; give it once")
    return dict(zip(names, values_in(value, names)))


def in_order(argument: str, value: Any, model: Model) -> Any:
    """Returns coordinates, rates or accelerations that have names as an array in the order of the model; others as they are. Rates may be
    called NAME_d, as in motions, and accelerations NAME_dd, except those of continuous states."""
    given = with_names(argument, value)
    if not isinstance(given, Mapping):
        return value
    names, suffix = model.coordinates, {"qd": "_d", "qdd": "_dd"}.get(argument, "")
    of_motions = [name + suffix for name in model._joints] + list(model.state_names)
    order = of_motions if of_motions[0] in given else list(names)
    for name in (*order, *given):
        if (name in given) != (name in order):
            fact = f"{name}: unknown coordinate" if name in given else f"no {name}"
            raise ValueError(f"{argument}: {fact}; must have the model's coordinates, {', '.join(names)}, or be an array in their order")
    columns = [reals(f"{argument} {name}", given[name]) for name in order]
    common_lead((f"{argument} {name}", column.shape) for name, column in zip(order, columns))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


# ---- Values ----

def by_name(kind: str, given: Mapping[str, Any] | None, kinds: Mapping[str, Collection[str]], further: Collection[str] = ()) -> Mapping[str, Any]:
    """Returns the given values, {} for None. Their names must be in the model or in `further`."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise TypeError(f"{kind}s: {type(given).__name__}; must be values by name, {{'NAME': value}}")
    for name in given:
        if name not in kinds[kind] and name not in further:
            raise ValueError(unknown(kind, name, kinds[kind], kinds))
    return given


def by_order(kind: str, given: Any, names: Collection[str], samples: str = "", free: Collection[str] = ()) -> Any:
    """Returns the values of an array by name; the array has one value for each of `names`, in their order. NaN leaves a value of
    `free` out. `samples`: how to pass values along time instead."""
    given = with_names(f"{kind}s", given)
    if given is None or isinstance(given, Mapping) or np.ndim(given) == 0:
        return given
    values = reals(f"{kind}s", given)
    if values.shape != (len(names),):
        hint = samples if values.ndim == 2 and values.shape[1] == len(names) else ""
        raise ValueError(f"{kind}s: have shape {values.shape}; must have ({len(names)},), one number for each of the model's {kind}s, or names{hint}")
    return {name: value for name, value in zip(names, values.tolist()) if name not in free or not np.isnan(value)}


def flag(argument: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{argument}: {value!r}; must be True or False")
    return bool(value)


def file_name(argument: str, value: Any, what: str = "a file") -> str:
    """Returns the name of a file: a text or a path."""
    name = os.fspath(value) if isinstance(value, os.PathLike) else value
    if not isinstance(name, str):
        raise TypeError(f"{argument}: {type(value).__name__}; must be the name of {what}")
    if not name:
        raise ValueError(f"{argument}: an empty text; must be the name of {what}")
    return name


def is_list(value: Any) -> bool:
    """Returns whether texts can be in this value; an array needs an axis."""
    return isinstance(value, Iterable) and not isinstance(value, bytes) and getattr(value, "ndim", 1) > 0


def texts_of(argument: str, value: Any) -> tuple[str, ...]:
    """Returns one text, or several in a list, as a tuple."""
    found = (value,) if isinstance(value, str) else tuple(value) if is_list(value) else (None,)
    if not all(isinstance(text, str) for text in found):
        raise TypeError(f"{argument}: {value!r}; must be a text or a list of texts")
    return found


def has_masked(value: Any) -> bool:
    """Returns whether a masked array, or a list that contains one, has masked values."""
    return bool(np.ma.is_masked(value)) or isinstance(value, (list, tuple)) and any(map(has_masked, value))


def reals(name: str, value: npt.ArrayLike) -> np.ndarray:
    """Converts to aligned doubles. Values that would lose information, such as complex numbers, are errors, as are functions and texts."""
    if has_masked(value):
        raise TypeError(f"{name}: has masked values; must be real numbers")
    try:
        array = np.asarray(value)
    except TypeError as error:
        raise TypeError(f"{name}: {type(value).__name__}; must be real numbers") from error
    except ValueError as error:  # NumPy: "setting an array element with a sequence ..."
        raise ValueError(f"{name}: rows of different lengths; must be an array of real numbers") from error
    if array.dtype.kind not in "biufO" or array.dtype.kind == "O" and (callable(value) or isinstance(value, Mapping)):
        what = "a function" if callable(value) else f"values of {array.dtype}" if array.dtype.kind != "O" else type(value).__name__
        raise TypeError(f"{name}: {what}; must be real numbers")
    if array.dtype.kind == "O":
        refuse_objects(name, array)
    try:
        return np.require(array.astype(float, copy=False), requirements="A")
    except OverflowError as error:
        raise ValueError(f"{name}: contains an integer that is too large; all numbers must be finite") from error
    except TypeError as error:
        raise TypeError(f"{name}: {error}; must be real numbers") from error


def refuse_objects(name: str, array: np.ndarray) -> None:
    """Raises an error about the first object that is not a number."""
    for item in array.flat:
        if not hasattr(item, "__float__") or isinstance(item, str):
            what, hint = "None" if item is None else type(item).__name__, "; give values of many states by name as one dictionary of arrays" if isinstance(item, Mapping) else ""
            raise TypeError(f"{name}: contains {what}; must be real numbers{hint}")


def finite(name: str, value: npt.ArrayLike) -> np.ndarray:
    array = reals(name, value)
    wrong = array[~np.isfinite(array)]
    if wrong.size:
        raise ValueError(f"{name}: contains {wrong[0]}; all numbers must be finite")
    return array


def finite_row(name: str, value: npt.ArrayLike, allowed: str) -> np.ndarray:
    """A finite number or a row of finite numbers in C order; the message about another shape says what is `allowed`."""
    array = finite(name, value)
    if array.ndim > 1:
        raise ValueError(f"{name}: has shape {array.shape}; must be {allowed}")
    return np.require(array, requirements="C")


def common_lead(arguments: Iterable[tuple[str, Sequence[int]]]) -> tuple[int, ...]:
    """The leading axes of a batch: those of all arguments, each with its name, broadcast together."""
    leads = dict(arguments)
    try:
        return np.broadcast_shapes(*map(tuple, leads.values()))
    except ValueError as error:
        listed = ", ".join(f"{name} {tuple(lead)}" for name, lead in leads.items() if lead)
        raise ValueError(f"shape mismatch: the leading axes {listed} cannot be broadcast") from error


def one_real(name: str, value: npt.ArrayLike) -> float:
    array = reals(name, value)
    if array.size != 1:
        raise ValueError(f"{name}: {array.size} values; must be one number")
    return float(array.reshape(()))
