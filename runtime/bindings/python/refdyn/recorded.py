"""Recorded motions in the process: the numbers of `refdyn sim` as arrays."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import equilibria, motion
from .passing import States

if TYPE_CHECKING:
    from .model import Model
    from .quantity import Compiled

OPTIONS = ("tol_rates", "step_max", "stabilise", "singular", "start")  # further options of arm.simulate that need no program
OF_STATICS = ("hold", "release", "way")                  # and those of a start at the equilibrium
OF_GSL = ("msbdf", "bsimp")                              # methods that only the program may have
OUTPUTS_MOST = 10_000_000                                 # as for `refdyn sim`


class Columns(dict[str, np.ndarray]):
    """The columns of a motion by name, (rows,) each; `attrs`: its summary, `units`: the known units of the columns."""

    __module__ = "refdyn"

    def __init__(self, names: Sequence[str], table: np.ndarray, units: Mapping[str, str], attrs: dict[str, Any]) -> None:
        super().__init__(zip(names, table.T))
        self.units, self.attrs = units, attrs
        self.variables: tuple[str, ...] = ()  # names by which d_COLUMN, (rows, variables), has derivatives

    def gather(self, names: Sequence[str], model: Model) -> None:
        """Replaces the columns d_COLUMN_by_NAME of the program by d_COLUMN, (rows, names)."""
        for column in [column for column in self if f"d_{column}_by_{names[0]}" in self]:
            self[f"d_{column}"] = np.column_stack([self.pop(f"d_{column}_by_{name}") for name in names])
        self.derive(names, model)

    def derive(self, names: Sequence[str], model: Model) -> None:
        """Keeps the names of the values by which d_COLUMN are derivatives, and adds units: one if all are alike, otherwise one for each name."""
        self.variables = tuple(names)
        known, values = {**model.units, **model._units["inputs"], **self.units}, [unit_of_value(model, name) for name in names]
        of = {f"d_{column}": [quotient(unit, value) for value in values] for column, unit in known.items() if f"d_{column}" in self}
        self.units = {**self.units, **{name: units[0] if len(set(units)) == 1 else ", ".join(units) for name, units in of.items()}}


def unit_of_value(model: Model, name: str) -> str:
    """The unit of a parameter, an input, or a start value NAME or NAME_d of a coordinate."""
    joint = name.removesuffix("_d")
    return f"{model.units[joint]}/s" if joint != name and joint in model._joints else model.units_of(name)


def quotient(unit: str, divisor: str) -> str:
    """The unit of a derivative, in the form of the program."""
    if not unit or divisor in ("", "1"):
        return unit
    return "1" if unit == divisor else f"{unit}/({divisor})" if " " in divisor or "/" in divisor else f"{unit}/{divisor}"


def is_in_process(method: str | None, from_: str, stop: Sequence[str], options: Mapping[str, Any]) -> bool:
    """Whether a motion needs no option that only the program has."""
    allowed = {*OPTIONS, *(OF_STATICS if from_ == "statics" else ())}
    return method not in OF_GSL and from_ in ("initial", "statics") and set(options) <= allowed and all(isinstance(text, str) for text in stop)


def samples_of(columns: Mapping[str, np.ndarray], compiled: Compiled, by_events: Sequence[str]) -> tuple[np.ndarray, np.ndarray] | None:
    """Rows (t, values) of sampled inputs and the inputs' places; None for samples that the program has to refuse."""
    times, names = np.atleast_1d(columns["t"]), [name for name in columns if name != "t"]
    if np.any(np.diff(times) <= 0) or any(name in by_events for name in names):
        return None
    rows = np.column_stack([np.broadcast_to(columns[name], times.shape) for name in ("t", *names)])
    return np.ascontiguousarray(rows), np.array([compiled.inputs[name] for name in names], dtype=np.intc)


def simulate(model: Model, t_end: Any, options: tuple[Any, ...], every: Any, state: tuple[States | None, States | None, Any], constants: Mapping[str, float],
             columns: Mapping[str, np.ndarray], values: Mapping[str, float], stop: Sequence[str], from_: str, further: Mapping[str, Any],
             names: Sequence[str] = ()) -> Columns | None:
    """Computes a motion; None if the program has to compute it, or to say what is wrong with it."""
    until, distance = motion.positive("t_end", t_end), motion.positive("every", every)
    q, qd, t = (None if value is None else model._start(name, value) for name, value in zip(("q", "qd", "t"), state))
    begin, n = 0.0 if t is None else float(t.reshape(-1)[0]), len(model.coordinates)
    span = until - begin
    if t is not None and t.ndim or any(row is not None and row.shape != (n,) for row in (q, qd)) or not 0 < span < np.inf:
        return None
    if distance and span / distance > OUTPUTS_MOST or options[2] and span / options[2] > motion.STEPS_MOST:
        return None
    model._sources.path()
    equilibrium = None
    if from_ == "statics":
        constant = {**constants, **{name: column.reshape(-1)[0] for name, column in columns.items() if name != "t"}}
        rest = equilibria.find(model, "motion,statics", None, None, constant, values, *(further.get(name) for name in OF_STATICS))
        if rest is None:
            return None
        q, qd, equilibrium = np.array(rest["q"]), np.array(rest["qd"]), (rest["unstable"], rest["neutral"])
        compiled = model._purpose("motion,statics", rest["given"])
    else:
        compiled = model._purpose("motion")
    variables = variables_of(model, compiled, names) if names else None
    if names and (variables is None or from_ == "statics"):
        return None
    samples = samples_of(columns, compiled, list(model._by_events)) if columns else (None, None)
    if samples is None:
        return None
    motion.warn_of_unread(model, values)
    core = motion.new_core(compiled, options, compiled.input_rows(constants), values)
    try:
        status, text, outputs = core.start(begin, q, qd, until, distance, tuple(stop), *samples, equilibrium, bounds_of(compiled), 1, further.get("start") is not None)
    except ValueError:
        return None
    motion.tell(model, text)
    if status != motion.DONE:
        raise motion.failure_of(model, status, text, False)
    run = recorded(model, compiled, core, outputs)
    if variables is not None:
        add_derivatives(model, run, core, variables, begin, until, names)
    return run


def bounds_of(compiled: Compiled) -> tuple[tuple[str, str, float, float], ...]:
    """Name, column and bounds of each limit of the model."""
    return tuple((bound["name"], bound["column"], bound.get("from", -np.inf), bound.get("to", np.inf)) for bound in compiled.description["bounds"])


def variables_of(model: Model, compiled: Compiled, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray] | None:
    """The kind and the place of each name; None if one is wrong, which the program then reports."""
    coordinates = {name: i for i, name in enumerate(model._joints)}
    rates = {f"{name}_d": i for name, i in coordinates.items()} | {name: len(coordinates) + i for i, name in enumerate(model.state_names)}
    kinds = [compiled.places, compiled.inputs, coordinates, rates]
    found = [[(what, kind[name]) for what, kind in enumerate(kinds) if name in kind] for name in names]
    if len(set(names)) < len(names) or any(len(meanings) != 1 for meanings in found):
        return None
    whats, places = np.array([meanings[0] for meanings in found], dtype=np.intc).T
    return np.ascontiguousarray(whats), np.ascontiguousarray(places)


def add_derivatives(model: Model, run: Columns, core: Any, variables: tuple[np.ndarray, np.ndarray], begin: float, until: float, names: Sequence[str]) -> None:
    """Adds d_COLUMN, (rows, names), for each column; for the time only if an event has ended the motion."""
    t, columns = run["t"], list(run)
    times = t[1:] if not core.has_ended else np.append(t[1:-1], until)
    out = np.empty((len(names), len(times) + 2, len(columns)))
    status, text = core.derivatives(*variables, tuple(names), np.ascontiguousarray(times), 1, out)
    motion.tell(model, text)
    if status != motion.DONE:
        raise motion.failure_of(model, status, text, True)
    for i, column in enumerate(columns):
        if i > 0 or core.has_ended:
            run[f"d_{column}"] = np.ascontiguousarray(out[:, :len(t), i].T)
    run.derive(names, model)


def recorded(model: Model, compiled: Compiled, core: Any, outputs: int) -> Columns:
    names, units = compiled.columns
    table = np.empty((outputs, len(names)))
    status, rows, text, interrupt = core.rows(table)
    motion.tell(model, text)
    run = Columns(names, table[:rows], units, core.summary() if status == motion.DONE else {})
    if interrupt is not None:
        interrupt.run = run
        raise interrupt
    if status != motion.DONE:
        failure = motion.failure_of(model, status, text, True)
        failure.run = run
        raise failure
    return run
