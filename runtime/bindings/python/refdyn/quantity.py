"""Emitted quantities as functions of NumPy arrays.

The arguments of a quantity are coordinates, rates, time, inputs and parameters. The emitted C reads the arrays without a
copy where their layout allows it. A leading axis of any argument is a batch, which is evaluated in lanes.
"""
from __future__ import annotations

import functools
import hashlib
import math
import os
import threading
import time
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import inline, program, wording
from .core import Library
from .names import Fixed, common_lead, in_order, reals
from .passing import Given, States, Values, spread

if TYPE_CHECKING:
    from .core import Function
    from .model import Model

PREPARING = ("start", "anchor", "required")  # functions that the preparation of parameters calls
POINT_ROWS = {"C": 3, "J": 6}  # rows of each point; the first axis counts the points


DOUBLE = np.dtype(float)
LOOK_SECONDS = 0.05  # between two looks for the optimised library
SEAL = b"refdyn seal "  # then the SHA-256 of the file before it, and a zero: runtime/tool/support/compile/compiled_cache.c


def is_whole(path: str) -> bool:
    """Whether a library in the cache is complete and belongs to this user alone."""
    with open(path, "rb") as file:
        status, data = os.fstat(file.fileno()), file.read()
    body, end = data[:-len(SEAL) - 65], data[-len(SEAL) - 65:]
    return status.st_uid == os.geteuid() and not status.st_mode & 0o022 and end == SEAL + hashlib.sha256(body).hexdigest().encode() + b"\0"


class Compiled:
    """A compiled library from the cache, and the model's parameters and inputs in the order of its functions.

    `order` has the names of the parameters in the order of arrays, and whether the start of a motion sets them. `folders` maps folders
    of copies to the folders that messages name; `requirements` has FILE:LINE of each rule of the model.
    """

    def __init__(self, description: Mapping[str, Any], kinds: Mapping[str, Collection[str]], order: Mapping[str, bool], folders: Mapping[str, str]) -> None:
        self.description, self.kinds = description, kinds
        self.requirements = tuple(wording.shown(place, folders) for place in description["requirements"])
        self.optimised: str | None = description.get("optimised")  # where the library that replaces this one will appear
        self._next_look = 0.0
        self.places = {entry["name"]: place for place, entry in enumerate(description["parameters"])}
        self.inputs = {entry["name"]: place for place, entry in enumerate(description["inputs"])}
        self.anchored = [entry["anchored"] for entry in description["parameters"]]
        self.values = np.array([entry["value"] for entry in description["parameters"]], dtype=float)
        self.x = np.array([entry["value"] for entry in description["inputs"]], dtype=float)
        self.of_parameters = Values("parameter", self.places, np.where(np.array(self.anchored, dtype=bool), np.nan, self.values), order, kinds)
        self.of_inputs = Values("input", self.inputs, self.x, dict.fromkeys(kinds["input"], False), kinds)
        self.inputs_move_parameters = any(entry["reads_inputs"] for entry in description["functions"] if entry["quantity"] in PREPARING)
        self.library = self._opened(description["library"])
        self.p = self._prepared(self.of_parameters.free, self.x)

    def _opened(self, path: str) -> Library:
        return Library(path, self.description["name"], self.description["lanes"], self.values, bytes(self.anchored), self.x,
                       *self.of_parameters.passing, *self.of_inputs.passing, self.inputs_move_parameters)

    def change_over(self) -> None:
        """Replaces the library by the optimised one as soon as it is there. Both compute the same bits."""
        path, now = self.optimised, time.monotonic()
        if path is None or now < self._next_look:
            return
        self._next_look = now + LOOK_SECONDS
        if os.path.exists(path):
            self.optimised = None
            if is_whole(path):
                self.library = self._opened(path)

    @functools.cached_property
    def columns(self) -> tuple[list[str], dict[str, str]]:
        """The columns of a motion, and their known units."""
        names, units = self.library.columns()
        return names, {name: unit for name, unit in zip(names, units) if unit is not None}

    def input_rows(self, inputs: Given) -> np.ndarray:
        """A row of inputs, or one for each state of a batch."""
        if inputs is None:
            return self.x
        quick = self.of_inputs.quick(inputs)
        if quick is not None:
            return quick
        given = self.of_inputs.checked(inputs)
        return self.of_inputs.filled(given) if given else self.x

    def parameter_rows(self, parameters: Given, x: np.ndarray) -> np.ndarray:
        """A row of prepared parameters, or one for each state of a batch. Parameters that this library does not read are skipped. Raises
        the error about values that the model refuses."""
        given = self.of_parameters.checked(parameters)
        moves = x is not self.x and self.inputs_move_parameters
        return self._prepared(self.of_parameters.filled(given), x) if given or moves else self.p

    def _prepared(self, values: np.ndarray, x: np.ndarray) -> np.ndarray:
        lead = common_lead((("parameters", values.shape[:-1]), ("inputs", x.shape[:-1] if self.inputs_move_parameters else ())))
        p = np.empty(lead + (values.shape[-1] + self.library.derived_count,))
        p[..., :values.shape[-1]] = values
        refused = self.library.prepare(math.prod(lead), p, spread(x, lead) if self.inputs_move_parameters else self.x)
        if refused is not None:
            row, requirement, fact = refused
            raise program.refusal(f"{self.requirements[requirement]}: {fact}", f"state {index_of(row, lead)}: " if lead else "")
        return p


def index_of(place: int, lead: tuple[int, ...]) -> tuple[int, ...]:
    """The index of a state in a batch."""
    return tuple(map(int, np.unravel_index(place, lead)))


def states_of(name: str, value: States, model: Model, size: int | None = None) -> np.ndarray:
    """Coordinates, rates or accelerations of states, by name or in the order of the model. `size`: numbers of a state, if they are not the
    coordinates alone."""
    size = len(model.coordinates) if size is None else size
    if type(value) is np.ndarray and value.dtype is DOUBLE and value.flags.aligned and value.shape[-1:] == (size,):
        return value  # what control loops pass
    array = reals(name, in_order(name, value, model))
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{name}: has shape {array.shape}; its last axis must have {size} entries")
    return array


class Bound:
    """What calls functions of a compiled model. `_bind` takes them from the library."""

    _compiled: Compiled
    _library: Library

    def _bind(self) -> None:
        raise NotImplementedError

    def _keep_up(self) -> None:
        """Uses the optimised library as soon as it is there."""
        if self._compiled.optimised is not None:
            self._compiled.change_over()
        if self._library is not self._compiled.library:
            self._bind()


class Quantity(Fixed, Bound):
    """An emitted function of a model: `arm.qdd(q, qd)`.

    q       coordinates (..., n) in the order of `arm.coordinates`
    qd      their rates (..., n); default: zero. For a tangent: qd, then the result of `constrained` (qdd, power, lambda);
            for `inverse` and `d_inverse`: qd, then qdd
    t       time [s] (...)
    inputs, parameters   values by name (...), or an array in the order of `arm.inputs` and `arm.parameters` (..., number of
                         them); default: the model's. Values that the model refuses, such as a negative mass, raise ModelError

    Axes before the last one (for t and values by name: all axes) are a batch. They are broadcast and precede the axes of
    the result. Returns an array, or a dictionary of arrays for a quantity with several parts. Undefined values are NaN. NaN in
    an array of parameters leaves a value to the start of the motion, if the model anchors it there.
    """

    __module__ = "refdyn"
    _remedy = "a quantity cannot be changed; pass inputs={...} and parameters={...} to one call"

    def __init__(self, name: str, model: Model, compiled: Compiled, lanes: Callable[[], Compiled]) -> None:
        self.__name__ = name
        self._model, self._compiled, self._open_lanes = model, compiled, lanes
        self._lock = threading.Lock()
        self._lanes: tuple[Compiled, Function] | None = None
        self._description = description = next(entry for entry in compiled.description["functions"] if entry["quantity"] == name)
        n = len(compiled.description["coordinates"])
        self._n, self._rates = n, n + description["given"]
        self._parts = {part["name"]: self._shape_of(part) for part in description["parts"]}
        self._size = sum(map(math.prod, self._parts.values()))
        self._shape = None if description["is_struct"] else next(iter(self._parts.values()))
        self._bind()
        parts = "".join(f"\n    {part['name']}  {part['about']}" for part in description["parts"])
        self.__doc__ = f"{description['about']}{parts}\n\n{type(self).__doc__}"

    def __repr__(self) -> str:
        shape = self._shape or self._parts
        return f"<refdyn quantity {self.__name__} of {self._compiled.description['name']}: {shape}>"

    def _repr_html_(self) -> str:
        return inline.of_quantity(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return getattr, (self._model, self.__name__)

    def __copy__(self) -> Quantity:
        return self

    def __deepcopy__(self, memo: Any) -> Quantity:
        return self

    def _shape_of(self, part: Mapping[str, Any]) -> tuple[int, ...]:
        count, columns = part["count"], part["columns"]
        if part["name"] in POINT_ROWS:
            rows = POINT_ROWS[part["name"]]
            return (count // (rows * columns), rows, columns)
        return (count // columns, columns) if columns else (count,)

    def _bind(self) -> None:
        self._library = self._compiled.library
        self._one = self._function(self._compiled).one

    def _function(self, compiled: Compiled) -> Function:
        return compiled.library.function(self.__name__, self._rates, self._size)

    def _of_accelerations(self, q: States, qd: States, qdd: States, t: npt.ArrayLike, inputs: Given, parameters: Given) -> np.ndarray | None:
        """Evaluates a quantity of q, qd and qdd at one state, given as rows of doubles; None for arguments of another form."""
        self._keep_up()
        out = np.empty(self._size)
        return out if self._one(q, qd, t, out, inputs, parameters, qdd) else None

    def __call__(self, q: States | None = None, qd: States | None = None, t: npt.ArrayLike = 0.0, inputs: Given = None, parameters: Given = None) -> Any:
        self._keep_up()
        out = np.empty(self._shape or self._size)
        if self._one(q, qd, t, out, inputs, parameters):
            return out if self._shape else self._shaped(out)
        return self._general(q, qd, t, inputs, parameters)

    def _general(self, q: States | None, qd: States | None, t: npt.ArrayLike, inputs: Given, parameters: Given) -> Any:
        """Evaluates arguments of any type, for one state or a batch."""
        if q is None:
            raise TypeError(f"{self.__name__}() missing 1 required positional argument: 'q'")
        q = states_of("q", q, self._model)
        qd = np.zeros(self._rates) if qd is None else states_of("qd", qd, self._model, self._rates)
        t = reals("t", t)
        x, p = self._compiled.of_inputs.checked(inputs), self._compiled.of_parameters.checked(parameters)
        lead = common_lead({"q": q.shape[:-1], "qd": qd.shape[:-1], "t": t.shape, **x.leads("input"), **p.leads("parameter")}.items())
        out = np.empty(lead + (self._size,))
        if not lead:
            if not self._one(np.ascontiguousarray(q), np.ascontiguousarray(qd), float(t), out, x.of_one(), p.of_one()):
                self._compiled.parameter_rows(parameters, self._compiled.input_rows(inputs))  # the model refuses them
                raise AssertionError("the arguments of one state must be rows of doubles")
        elif out.size:
            compiled, function = self._with_lanes()
            x_rows = compiled.input_rows(inputs)
            p_rows = compiled.parameter_rows(parameters, x_rows)
            q, qd, t, p_rows, x_rows = (spread(array, lead) for array in (q, qd, t[..., np.newaxis], p_rows, x_rows))
            function.many(math.prod(lead), q, qd, t, out, p_rows, x_rows)
        return self._shaped(out)

    def _with_lanes(self) -> tuple[Compiled, Function]:
        with self._lock:
            if self._lanes is None:
                compiled = self._open_lanes()
                self._lanes = compiled, self._function(compiled)
            return self._lanes

    def _shaped(self, out: np.ndarray) -> Any:
        lead = out.shape[:-1]
        if self._shape is not None:
            return out.reshape(lead + self._shape)
        parts, begin = {}, 0
        for name, shape in self._parts.items():
            end = begin + math.prod(shape)
            parts[name] = out[..., begin:end].reshape(lead + shape)
            begin = end
        return parts
