"""Steps of fixed length from states of the caller: `q, qd = arm.step(q, qd, t, h)`."""
from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import motion, program
from .names import common_lead, finite, one_real, reals
from .passing import States
from .quantity import Bound, index_of, spread, states_of

if TYPE_CHECKING:
    from .core import Report
    from .model import Model
    from .quantity import Compiled

EXPLICIT = ("rk4", "rk54", "rk8")
REMEDY = 'use more steps, or method="ros34pw2" or "rodas5p"'


def are(count: int) -> str:
    return "is" if count == 1 else "are"


class Stepper(Bound):
    """The steps of one method and one way to keep the rows.

    Explicit methods with the gains of the rows step by the emitted accelerations alone, many states in lanes. All others, and
    models with events, let the runtime begin a motion at each state.
    """

    def __init__(self, model: Model, method: str | None, stabilise: str | None) -> None:
        motion.choose("stabilise", stabilise, motion.STABILISE)
        words = [other for other in motion.NAMES if other != "auto"]
        if method == "auto":
            raise ValueError(f"method: 'auto' has no fixed steps; use one of {', '.join(words)}")
        motion.choose("method", method, words)
        name = motion.method_of(method, True)
        self._model, self._method, self._stabilise = model, name, stabilise
        compiled = model._libraries[None, False]
        self._n = len(model.coordinates)
        self._is_direct = name in EXPLICIT and compiled.library.event_count == 0 and (stabilise in (None, "baumgarte") or not model.rows)
        self._compiled = compiled if self._is_direct else model._purpose("motion")
        self._bind()
        self._many: Any = None

    def _bind(self) -> None:
        self._library, self._local = self._compiled.library, threading.local()
        self._one = self._direct(self._compiled) if self._is_direct else None

    def _direct(self, compiled: Compiled) -> Any:
        return compiled.library.stepper(self._method, compiled.p, compiled.x)

    def __call__(self, q: States, qd: States, t: npt.ArrayLike, h: float, inputs: Any, parameters: Any, steps: int) -> tuple[np.ndarray, np.ndarray]:
        self._keep_up()
        if self._one is not None:
            new_q, new_qd = np.empty(self._n), np.empty(self._n)
            if self._one.one(q, qd, t, h, steps, inputs, parameters, new_q, new_qd):
                return new_q, new_qd
        return self._general(q, qd, t, h, inputs, parameters, steps)

    def _general(self, q: States, qd: States, t: npt.ArrayLike, h: float, inputs: Any, parameters: Any, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Steps from arguments of any type, for one state or a batch."""
        q, qd, t = states_of("q", q, self._model), states_of("qd", qd, self._model), reals("t", t)
        h = h if type(h) is float else one_real("h", h)
        if not (h > 0 and math.isfinite(h)):
            raise ValueError(f"h: {h:g} is not a positive number")
        steps = motion.count("steps", steps)
        compiled = self._compiled
        x = compiled.input_rows(inputs)
        p = compiled.parameter_rows(parameters, x)
        if q.ndim == qd.ndim == x.ndim == p.ndim == 1 and t.ndim == 0:
            lead: tuple[int, ...] = ()
            count = 1
        else:
            lead = common_lead((("q", q.shape[:-1]), ("qd", qd.shape[:-1]), ("t", t.shape), ("inputs", x.shape[:-1]), ("parameters", p.shape[:-1])))
            count = math.prod(lead)
        new_q, new_qd = np.empty(lead + (self._n,)), np.empty(lead + (self._n,))
        if count:
            if lead and self._is_direct:
                compiled, x, p = self._with_lanes(inputs, parameters)
            arguments = [spread(array, lead) for array in (q, qd, t[..., np.newaxis], p, x)] if lead else [np.ascontiguousarray(q), np.ascontiguousarray(qd), np.atleast_1d(t), p, x]
            report = self._compute(count, *arguments, h, steps, new_q, new_qd)
            if report is not None:
                self._tell(report, lead, q, qd, t, h / steps)
        return new_q, new_qd

    def _tell(self, report: Report, lead: tuple[int, ...], q: np.ndarray, qd: np.ndarray, t: np.ndarray, step: float) -> None:
        """Raises the error about a single state. Warns about a batch, and about motions that an event has ended."""
        (unfit, _), (failed, failed_first), (ended, ended_first), reason, event, after = report
        if not lead and unfit:
            for name, values in (("q", q), ("qd", qd), ("t", t)):
                finite(name, values)
        if failed and reason is None:
            failed_t = np.broadcast_to(t, lead).flat[failed_first]
            reason = f"refdyn: {self._model._name}: t = {failed_t:g} s: the state after the step is not finite\nrefdyn: {step:g} s is too long for {self._method}, or the equations are undefined there; {REMEDY}"
        error = motion.failure_of(self._model, program.NUMBERS, reason, True) if failed and reason is not None else None
        if error is not None and not lead:
            raise error
        count = math.prod(lead)
        said = [f"step: {unfit} of {count} states {are(unfit)} not finite before the step, and NaN after it"] if unfit else []
        if error is not None:
            facts = "\n".join(line for line in str(error).splitlines() if not line.startswith("  "))
            said.append(f"step: {failed} of {count} states {are(failed)} NaN after a failure; the first is {index_of(failed_first, lead)}: {facts}")
        if ended:
            what = f"events have ended {ended} of {count} motions; the first is {index_of(ended_first, lead)}, by {event}" if lead else f"the event {event} has ended the motion"
            said.append(f"step: {what} at t + {after:g} s; the result is the state there")
        program.warn("\n".join(said))

    def _with_lanes(self, inputs: Any, parameters: Any) -> tuple[Compiled, np.ndarray, np.ndarray]:
        compiled = self._model._library(None, True)
        if self._many is None:
            self._many = self._direct(compiled)
        x = compiled.input_rows(inputs)
        return compiled, x, compiled.parameter_rows(parameters, x)

    def _compute(self, count: int, q: np.ndarray, qd: np.ndarray, t: np.ndarray, p: np.ndarray, x: np.ndarray, h: float, steps: int, new_q: np.ndarray,
                 new_qd: np.ndarray) -> Report | None:
        if self._is_direct:
            return (self._one if new_q.ndim == 1 else self._many).states(count, q, qd, t, h, steps, p, x, new_q, new_qd)
        return self._scratch(h / steps).steps(count, q, qd, t, h, p, x, new_q, new_qd)

    def _scratch(self, step: float) -> Any:
        """The memory of a motion with steps of this length, for this thread."""
        kept = getattr(self._local, "kept", None)
        if kept is None or kept[0] != step:
            options = motion.options_of(self._method, None, step, None, None, self._stabilise, None, None, False)
            self._local.kept = kept = step, motion.new_core(self._compiled, options, self._compiled.x, {})
        return kept[1]
