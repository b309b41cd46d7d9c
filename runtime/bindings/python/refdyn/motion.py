"""Motions in the process: a simulator inside the caller's own loop."""
from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import program
from .core import METHODS
from .names import ByName, Fixed, finite, in_order, not_one_of, one_real, suggesting, with_names
from .passing import Given, States
from .wording import shown

if TYPE_CHECKING:
    from .core import Library
    from .core import Motion as Core
    from .model import Model
    from .quantity import Compiled

STEPS_MOST = 1e9  # as for `refdyn sim`
DONE, REFUSED = 0, -19  # statuses of the runtime
STABILISE = {"none": 0, "baumgarte": 1, "baumgarte-auto": 1, "project": 2}
START = {"as-is": 0, "project": 1}
SINGULAR = {"stop": 0, "pass": 1}
ALIASES = {"gauss": "gauss12", "radau": "radau9"}
OF_SCIPY = {"rk45": "rk54", "dop853": "rk8"}  # methods of SciPy and the ones that are closest to them
FIXED = ("rk4",)  # methods without an error estimate
NAMES = (*METHODS, *ALIASES)


def choose(name: str, value: str | None, words: Collection[str]) -> str | None:
    if value is not None and value not in words:
        raise ValueError(f"{name}: {not_one_of(value, words, OF_SCIPY)}")
    return value


def positive(name: str, value: Any) -> float:
    """Returns a positive number, 0 for None."""
    if value is None:
        return 0.0
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: {value}; must be a number")
    number = one_real(name, value)
    if not (number > 0 and np.isfinite(number)):
        raise ValueError(f"{name}: {program.text_of(name, value)!r} is not a positive number")
    return number


def count(name: str, value: Any) -> int:
    """A whole number from 1 to 1e9."""
    if type(value) is not int and (isinstance(value, bool) or not isinstance(value, (int, np.integer))):
        raise TypeError(f"{name}: {type(value).__name__}; must be a whole number")
    if value < 1:
        raise ValueError(f"{name}: {value}; must be at least 1")
    if one_real(name, value) > STEPS_MOST:
        raise ValueError(f"{name}: {value}; must be at most {STEPS_MOST:g}")
    return int(value)


def method_of(method: str | None, has_step: bool) -> str:
    choose("method", method, NAMES)
    return ALIASES.get(method, method) if method is not None else "rk4" if has_step else "auto"


def options_of(method: str | None, tol: Any, step: Any, tol_rates: Any, step_max: Any, stabilise: str | None, singular: str | None, start: str | None,
               has_balance: bool, step_limit: Any = None) -> tuple[Any, ...]:
    """Returns the options of core.Library.motion, with the rules and messages of `refdyn sim`."""
    sizes = tuple(positive(name, value) for name, value in (("tol", tol), ("step", step), ("step_max", step_max), ("tol_rates", tol_rates)))
    name = method_of(method, sizes[1] > 0)
    for other, value in (("tol", sizes[0]), ("step_max", sizes[2]), ("tol_rates", sizes[3])):
        if value and sizes[1]:
            what = f"sets fixed steps and {other} {'bounds adaptive ones' if other == 'step_max' else 'adaptive ones'}"
            raise ValueError(f"step {what}; omit one of them")
        if value and name in FIXED:
            raise ValueError(f"{other}: {name} has fixed steps; use step")
    if sizes[1] and name == "auto":
        raise ValueError("step: auto chooses its steps; use tol")
    choose("stabilise", stabilise, STABILISE)
    choose("singular", singular, SINGULAR)
    choose("start", start, START)
    return (name, *sizes, -1 if stabilise is None else STABILISE[stabilise], int(stabilise == "baumgarte-auto"),
            SINGULAR[singular or "stop"], START[start or "as-is"], int(has_balance), 0 if step_limit is None else count("step_limit", step_limit))


def values_of(compiled: Compiled, parameters: Mapping[str, float]) -> tuple[np.ndarray, bytes]:
    """Values of the parameters, and flags of those that the start of a motion sets."""
    values = compiled.values.copy()
    for name, value in parameters.items():
        if name in compiled.places:
            values[compiled.places[name]] = value
    return values, bytes(is_anchored and name not in parameters for name, is_anchored in zip(compiled.places, compiled.anchored))


def warn_of_unread(model: Model, parameters: Collection[str]) -> None:
    """Warns about parameters that nothing in the model reads. The libraries of some calls also lack parameters that others read."""
    unread = [name for name in parameters if name not in model.parameters]
    if unread:
        program.warn("\n".join(f"{name}: nothing in this model reads it" for name in unread))


def new_core(compiled: Compiled, options: tuple[Any, ...], x: np.ndarray, parameters: Mapping[str, float]) -> Core:
    """A motion that has not started."""
    values, anchored = values_of(compiled, parameters)
    follow = None if compiled.optimised is None else lambda library=compiled.library: followed(compiled, library)
    return compiled.library.motion(options, values, anchored, np.ascontiguousarray(x), compiled.requirements, follow)


def followed(compiled: Compiled, library: Library) -> Library | None:
    """The optimised library as soon as it has replaced this one."""
    compiled.change_over()
    return None if compiled.library is library else compiled.library


def one_row(kind: str, rows: np.ndarray) -> np.ndarray:
    if rows.ndim != 1:
        raise ValueError(f"{kind}s: have shape {rows.shape[:-1]}; a motion needs one value each")
    return rows


def row_of(name: str, value: States | None, model: Model) -> np.ndarray | None:
    """A state of a motion, by name or in the order of the model: finite, and as long as the model has coordinates."""
    if value is None:
        return None
    count = len(model.coordinates)
    array = finite(name, in_order(name, value, model))
    if array.shape != (count,):
        raise ValueError(f"{name}: has shape {array.shape}; must be one state, ({count},)")
    return np.ascontiguousarray(array)


def tell(model: Model, text: str) -> None:
    """Turns the warnings in a text of the runtime into one of Python."""
    if text:
        program.warn_of(program.warnings_of(text), model._warned)


def failure_of(model: Model, status: int, text: str, is_started: bool) -> Exception:
    said = shown(program.WARNING.sub("", text), model._sources.places)
    return program.failure(program.FAULT if status == REFUSED and not is_started else program.NUMBERS, said)


@suggesting("advance")
class Motion(Fixed):
    """A motion in the process: `motion = arm.motion(q, qd)`, then `motion.advance(t)` in a loop.

    t, q, qd, state, qdd, force   time [s], coordinates, rates, both, accelerations and forces of the programme
    inputs, parameters, states    their present values by name
    events        what has happened so far: (time, name, kind), kind "" or for contacts "impact", "rests", "leaves"
    has_ended     whether an event of the model has ended the motion
    statistics    steps, evaluations, largest residuals ... so far, as in the summary of a simulation

    After a NumericalError or an interruption the motion is at its last accepted state. One thread at a time may use a motion;
    `motion.copy()` is another motion that continues from here. The interpreter's lock is released while C computes.
    """

    __module__ = "refdyn"
    _remedy = "a motion is changed by motion.advance(t) and motion.set(...)"

    def __init__(self, model: Model, compiled: Compiled, core: Core, step_most: float) -> None:
        self._model, self._compiled, self._core = model, compiled, core
        self._step_most, self._farthest = step_most, STEPS_MOST * step_most  # of one call of `advance`
        self._n, self._library = len(model.coordinates), compiled.library

    def advance(self, t: float) -> bool:
        """Computes the motion up to t [s], through all events. Returns False if an event of the model has ended it before."""
        goal = t if isinstance(t, float) else one_real("t", t)
        if not self._core.t <= goal < np.inf:
            raise ValueError(f"t: {goal:g} is before the motion's time {self._core.t:g}; must not be earlier" if goal < self._core.t else f"t: {goal}; must be finite")
        if goal - self._core.t > self._farthest:
            raise ValueError(f"t: {goal:g} needs {(goal - self._core.t) / self._step_most:.3g} steps of {self._step_most:g} s; must be at most {STEPS_MOST:g}")
        if self._compiled.optimised is not None:
            self._compiled.change_over()
        if self._compiled.library is not self._library:
            self._library = self._compiled.library
            self._core.exchange(self._library)
        said = self._core.advance(goal)
        if said is not None:
            raise failure_of(self._model, program.NUMBERS, said, True)
        return not self._core.has_ended

    def set(self, *, inputs: Given = None, parameters: Given = None, q: States | None = None, qd: States | None = None) -> None:
        """Continues with other inputs, parameters or another state; values that are not named stay. A new state also continues a
        motion that an event has ended."""
        said = self._core.set(inputs, parameters) if q is None and qd is None else False
        if said is False:
            said = self._set_checked(inputs, parameters, q, qd)
        if said is not None:
            raise failure_of(self._model, self._core.status, said, False)

    def _set_checked(self, inputs: Given, parameters: Given, q: States | None, qd: States | None) -> str | None:
        """The same for values of any type."""
        x = p = state = None
        if inputs is not None:
            x = self._changed("input", inputs, self._compiled.inputs, self._core.inputs)
        if parameters is not None:
            p = self._changed("parameter", parameters, self._compiled.places, self._core.parameters)
        if q is not None or qd is not None:
            state = self._numbers((2, self._n), self._core.state)
            for row, name, value in ((state[0], "q", q), (state[1], "qd", qd)):
                row[:] = row if value is None else row_of(name, value, self._model)
        return self._core.refresh(p, x, state)

    def _changed(self, kind: str, given: Any, places: Mapping[str, int], read: Any) -> np.ndarray:
        """The present values with the given ones, by name or as a row in the order of the model. Where a row has NaN, a
        parameter that the model anchors at the start of a motion stays."""
        row, given = self._numbers(len(places), read), with_names(f"{kind}s", given)
        if kind == "input" and isinstance(given, (np.ndarray, list, tuple)):
            values = finite("inputs", given)
            if values.shape != row.shape:
                raise ValueError(f"inputs: have shape {values.shape}; must have shape {row.shape}")
            return np.ascontiguousarray(values)
        changes = self._model._values(kind, given)
        for name, value in changes.items():
            if name in places:
                row[places[name]] = value
        if kind == "parameter":
            warn_of_unread(self._model, changes)
        return row

    @staticmethod
    def _numbers(count: Any, write: Any) -> np.ndarray:
        out = np.empty(count)
        write(out)
        return out

    def _read(self, count: Any, write: Any) -> np.ndarray:
        """Numbers in a read-only array."""
        out = self._numbers(count, write)
        out.flags.writeable = False
        return out

    def _by_name(self, kind: str, names: Iterable[str], numbers: np.ndarray) -> ByName:
        return ByName(kind, zip(names, numbers.tolist()), f"use motion.set({kind}s={{...}})" if kind != "state" else "use motion.set(qd=...)")

    @property
    def t(self) -> float:
        return self._core.t

    @property
    def state(self) -> np.ndarray:
        """q and qd, (2, n)."""
        return self._read((2, self._n), self._core.state)

    @property
    def q(self) -> np.ndarray:
        return self.state[0]

    @property
    def qd(self) -> np.ndarray:
        return self.state[1]

    @property
    def states(self) -> Mapping[str, float]:
        """The continuous states by name."""
        return self._by_name("state", self._model.state_names, self.state[1, self._n - len(self._model.state_names):])

    @property
    def qdd(self) -> np.ndarray:
        return self._read(self._n, self._core.accelerations)

    @property
    def force(self) -> np.ndarray:
        return self._read(self._n, self._core.force)

    @property
    def inputs(self) -> Mapping[str, float]:
        return self._by_name("input", self._compiled.inputs, self._numbers(len(self._compiled.inputs), self._core.inputs))

    @property
    def parameters(self) -> Mapping[str, float]:
        return self._by_name("parameter", self._compiled.places, self._numbers(len(self._compiled.places), self._core.parameters))

    @property
    def has_ended(self) -> bool:
        return self._core.has_ended

    @property
    def events(self) -> list[tuple[float, str, str]]:
        return [(mark["t"], mark["event"], mark.get("contact", "")) for mark in self._core.summary().get("events", [])]

    @property
    def statistics(self) -> dict[str, Any]:
        left_out = ("energy_error", "wall_s", "cpu_s", "events", "ended", "limits")
        return {name: value for name, value in self._core.summary().items() if name not in left_out}

    def copy(self) -> Motion:
        """Another motion, which continues from here with the same numbers."""
        return type(self)(self._model, self._compiled, self._core.copy(), self._step_most)

    __copy__ = copy

    def __deepcopy__(self, memo: Any) -> Motion:
        return self.copy()

    def __reduce__(self) -> Any:
        raise TypeError("a motion cannot be pickled: it has memory of C; pickle motion.state and the model, and start another with arm.motion(*state, t)")

    def __repr__(self) -> str:
        return f"<refdyn.Motion of {self._model._name} at t = {self.t:g} s>"


def begin(model: Model, q: States | None, qd: States | None, t: float, options: tuple[Any, ...], start: str | None, inputs: Given,
          parameters: Given) -> Motion:
    compiled = model._purpose("motion")
    values = model._values("parameter", parameters)
    warn_of_unread(model, values)
    core = new_core(compiled, options, one_row("input", compiled.input_rows(inputs)), values)
    begin_t = one_real("t", finite("t", t))
    status, text, _ = core.start(begin_t, row_of("q", q, model), row_of("qd", qd, model), np.inf, 0.0, (), None, None, None, (), 0, start is not None)
    tell(model, text)
    if status != DONE:
        raise failure_of(model, status, text, False)
    _, _, step, step_max, *_ = options
    return Motion(model, compiled, core, step or step_max or np.inf)
