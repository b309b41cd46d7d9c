"""The best values of a motion within limits: the request of `arm.plan`, and its result."""
from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .cases import lua_text
from .fitting import entry
from .names import one_real, suggests
from .program import text_of

if TYPE_CHECKING:
    import xarray

RANGE = "must be (from, to) or (from, to, start)"
NUMBERS = ("smallest", "largest", "from", "to", "t", "multiplier")  # of a limit


@dataclasses.dataclass(frozen=True)
class Measure:
    """A measure of a column, for `minimise` and `within` of `arm.plan`: made by `at_end`, `integral` and `largest`."""

    __module__ = "refdyn"

    kind: str
    column: str
    bounds: tuple[tuple[str, float], ...] = ()

    def text(self) -> str:
        bounds = ", ".join(f"{name} = {number_text(name, value)}" for name, value in self.bounds)
        return f"rd.{self.kind}({lua_text(self.column)}{f', {{ {bounds} }}' if bounds else ''})"


@suggests
def at_end(column: str, from_: float | None = None, to: float | None = None) -> Measure:
    """The value of a column at the end of the motion: an objective, or with bounds a limit."""
    return Measure("at_end", column, tuple((name, one_real(name, value)) for name, value in (("from", from_), ("to", to)) if value is not None))


@suggests
def integral(column: str) -> Measure:
    """The integral of a column over time."""
    return Measure("integral", column)


@suggests
def largest(column: str) -> Measure:
    """The largest value of a column."""
    return Measure("largest", column)


for _function in (at_end, integral, largest):
    _function.__module__ = "refdyn"


class Plan:
    """Result of `arm.plan`.

    values       by name, as found
    parameters   those of them that are parameters, for `arm.simulate(found.t_end, parameters=found.parameters)`
    objective    the least value; t_end is the end of the motion [s]
    feasible     whether all limits are kept; otherwise `violation` has the amounts beyond them, by limit
    limits       along `limit`: smallest, largest, from, to, t, active, multiplier
    starts       objectives that the local searches have reached; NaN for those beyond limits
    worst_case   the case of `for_all` that is nearest to its limits
    evaluations  number of motions
    attrs        all keys of the PLAN.json of the program
    """

    __module__ = "refdyn"

    values: dict[str, float]
    parameters: dict[str, float]
    objective: float
    t_end: float
    feasible: bool
    violation: dict[str, float]
    limits: xarray.Dataset
    starts: np.ndarray
    worst_case: dict[str, float]
    evaluations: int
    attrs: dict[str, Any]

    def __init__(self, found: Mapping[str, Any], parameters: Sequence[str]) -> None:
        import xarray
        limits = found["limits"]
        self.values = dict(found["parameters"])
        self.parameters = {name: value for name, value in self.values.items() if name in parameters}
        self.objective, self.t_end, self.feasible = found["objective"], found["t_end"], found["feasible"]
        self.violation, self.worst_case, self.evaluations = dict(found["violation"]), dict(found["worst_case"]), found["evaluations"]
        self.limits = xarray.Dataset({**{key: ("limit", numbers([limit[key] for limit in limits])) for key in NUMBERS},
                                      "active": ("limit", np.array([limit["active"] for limit in limits], dtype=bool))},
                                     {"limit": [limit["name"] for limit in limits]})
        self.starts = numbers(found["starts"])
        self.attrs = dict(found)

    def __repr__(self) -> str:
        active = [name for name, is_active in zip(self.limits["limit"].values.tolist(), self.limits["active"].values.tolist()) if is_active]
        lines = [f"  {name:12} {value:.6g}" for name, value in self.values.items()]
        last = [f"  active       {', '.join(active)}"] if active and self.feasible else []
        beyond = [f"  {name} must give way by {amount:.4g}" for name, amount in self.violation.items()]
        return "\n".join([f"<refdyn plan: {self.objective:.6g}{'' if self.feasible else ', beyond limits'}>", *lines, *last, *beyond])


def numbers(values: Sequence[float | None]) -> np.ndarray:
    return np.array([np.nan if value is None else value for value in values], dtype=float)


# ---- The file PLAN.lua of a call ----

def number_text(name: str, value: Any) -> str:
    """A number of the file. Lua has no words for NaN and infinity, which the program refuses with the name of the field."""
    number = one_real(name, value)
    return text_of(name, number) if math.isfinite(number) else "0/0" if math.isnan(number) else f"{math.copysign(1, number):.0f}/0"


def range_text(name: str, value: Any) -> str:
    if isinstance(value, str) or np.ndim(value) != 1 or np.size(value) not in (2, 3):
        raise ValueError(f"vary: {name}: {value!r}; {RANGE}")
    return f"rd.within({', '.join(number_text(name, number) for number in value)})"


def named(argument: str, value: Any, form: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise TypeError(f"{argument}: {type(value).__name__}; must be a dictionary such as {form}")
    return value


def measure_text(argument: str, value: Any) -> str:
    if isinstance(value, Measure):
        return value.text()
    if isinstance(value, str):
        return lua_text(value)
    raise TypeError(f"{argument}: {type(value).__name__}; must be a name, or made by refdyn.at_end, refdyn.integral or refdyn.largest")


def cases_text(name: str, values: Any) -> str:
    if np.ndim(values) != 1:
        raise ValueError(f"for_all: {name}: {values!r}; must be a list of numbers")
    return f"{{ {', '.join(number_text(name, value) for value in values)} }}"


def write(folder: str, vary: Any, t_end: Any, minimise: Any, within: Any, for_all: Any, search: str | None, starts: int | None, seed: int | None) -> str:
    """Writes a PLAN.lua; returns its path."""
    ranges = named("vary", vary, "{'T': (0.5, 2)}")
    fields = [f"vary = {{ {', '.join(entry(name, range_text(name, value)) for name, value in ranges.items())} }}",
              f"t_end = {lua_text(t_end) if isinstance(t_end, str) else number_text('t_end', t_end)}", f"minimise = {measure_text('minimise', minimise)}"]
    if within is not None:
        limits = [within] if isinstance(within, (str, Measure)) else list(within)
        fields.append(f"within = {{ {', '.join(measure_text('within', limit) for limit in limits)} }}")
    if for_all is not None:
        cases = named("for_all", for_all, "{'m_E': [1.8, 2.2]}")
        fields.append(f"for_all = {{ {', '.join(entry(name, cases_text(name, values)) for name, values in cases.items())} }}")
    if search is not None:
        fields.append(f"search = {lua_text(search)}")
    fields += [f"{name} = {number_text(name, value)}" for name, value in (("starts", starts), ("seed", seed)) if value is not None]
    path = os.path.join(folder, "plan.lua")
    with open(path, "w", encoding="utf-8") as file:
        file.write('local rd = require "refdyn"\nreturn rd.plan {\n' + "".join(f"  {field},\n" for field in fields) + "}\n")
    return path
