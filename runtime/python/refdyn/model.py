"""A model: its emitted quantities, and what the program computes of it, as datasets."""
from __future__ import annotations

import contextlib
import hashlib
import json
import os
import pathlib
import tempfile
import threading
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import datasets, program
from .quantity import Compiled, Quantity, unknown

if TYPE_CHECKING:
    import xarray


class Model:
    """A model file with its options and parameters: `Model("models/manipulator.lua", n_rfe=4)`.

    Every emitted quantity is a function of the model, `arm.qdd(q, qd)`: `dir(arm)` lists them, `help(arm.qdd)` tells what
    one takes and gives. Derivatives are compiled when they are first named. Any number of threads may use one model.
    """

    coordinates: tuple[str, ...]                 # in the order of q
    parameters: Mapping[str, float]              # that some quantity reads, with their values
    inputs: Mapping[str, float]
    options: Mapping[str, str]
    units: Mapping[str, str]                     # of coordinates; `units_of` tells those of parameters and inputs
    rows: tuple[str, ...]
    points: tuple[str, ...]
    courses: tuple[str, ...]
    held: tuple[str, ...]                        # in statics and modes
    q0: np.ndarray                               # where a motion starts
    qd0: np.ndarray
    _folder: tempfile.TemporaryDirectory[str]    # of a model from a text
    if TYPE_CHECKING:
        M: Quantity
        h: Quantity
        Q: Quantity
        u: Quantity
        v: Quantity
        phi: Quantity
        psi: Quantity
        k: Quantity
        r: Quantity
        rd: Quantity
        C: Quantity
        d: Quantity
        J: Quantity
        Jd_qd: Quantity
        energy: Quantity
        power: Quantity
        Q_q: Quantity
        qdd: Quantity
        qdd_free: Quantity
        force: Quantity
        equations: Quantity
        course: Quantity

    def __init__(self, file: str | os.PathLike[str], /, **settings: Any) -> None:
        name = os.fspath(file)
        self._read(os.path.join(".", name) if name.startswith("-") else name, settings)

    @classmethod
    def from_text(cls, text: str, /, **settings: Any) -> Model:
        """The same from the text of a model file; its errors have the file '<text>'."""
        model = cls.__new__(cls)
        model._folder = program.private_folder()
        file = os.path.join(model._folder.name, "text.lua")
        pathlib.Path(file).write_text(text, encoding="utf-8")
        model._read(file, settings)
        return model

    def _read(self, file: str, settings: Mapping[str, Any]) -> None:
        self._lock, self._settings = threading.RLock(), dict(settings)
        self._libraries: dict[tuple[str | None, bool], Compiled] = {}
        told = json.loads(program.run("compile", file, *program.settings(settings)))
        self._file = os.path.abspath(file)
        self._sources = {os.path.abspath(path): digest(path) for path in told["sources"]}
        self._known = told["quantities"]
        self._default = {entry["quantity"] for entry in told["functions"]}
        self.coordinates = tuple(entry["name"] for entry in told["coordinates"])
        self.parameters = named(told["parameters"], "value")
        self.inputs = named(told["inputs"], "value")
        self.units = named(told["coordinates"], "unit")
        self._units = {kind: named(told[kind], "unit") for kind in ("coordinates", "parameters", "inputs")}
        self.options = types.MappingProxyType(told["options"])
        self.rows, self.points, self.courses, self.held = (tuple(told[key]) for key in ("rows", "points", "courses", "held"))
        self.q0, self.qd0 = (constant(told[key]) for key in ("q", "qd"))
        self._libraries[None, False] = Compiled(told, self.parameters)

    def __repr__(self) -> str:
        return (f"<refdyn.Model {self._libraries[None, False].told['name']}: {len(self.coordinates)} coordinates, "
                f"{len(self.rows)} rows, {len(self.parameters)} parameters>")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._known})

    # ---- Quantities ----

    def __getattr__(self, name: str) -> Quantity:
        """A quantity, when it is first named: from then on it is an attribute."""
        if name.startswith("_") or name not in self._known:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        with self._lock:
            if name not in self.__dict__:
                self.__dict__[name] = self._quantity(name)
            return self.__dict__[name]

    def _quantity(self, name: str) -> Quantity:
        emit = None if name in self._default else name
        try:
            compiled = self._library(emit, False)
        except program.ModelError as error:
            raise AttributeError(str(error)) from error
        if name not in {entry["quantity"] for entry in compiled.told["functions"]}:
            raise AttributeError(f"{program.shown(self._file)}: the model has no {name}")
        return Quantity(name, compiled, lambda: self._library(emit, True))

    def _library(self, emit: str | None, has_lanes: bool) -> Compiled:
        with self._lock:
            if (emit, has_lanes) not in self._libraries:
                told = self._run("compile", {"emit": emit, "for_lanes": has_lanes})
                self._libraries[emit, has_lanes] = Compiled(json.loads(told), self.parameters)
            return self._libraries[emit, has_lanes]

    def units_of(self, name: str) -> str:
        """The unit of a coordinate, a parameter or an input."""
        for units in self._units.values():
            if name in units:
                return units[name]
        raise ValueError(unknown("coordinate, parameter or input", name, [name for units in self._units.values() for name in units]))

    # ---- What the program computes ----

    def statics(self, q: npt.ArrayLike | None = None, *, t: float | None = None, inputs: Mapping[str, float] | None = None,
                parameters: Mapping[str, float] | None = None, hold: str | Sequence[str] | None = None,
                release: str | Sequence[str] | None = None, way: str | None = None) -> xarray.Dataset:
        """The equilibrium, looked for from q; the options are those of `refdyn statics`."""
        with state_file(q, None, t, inputs) as state:
            told = self._run("statics", {"state": state, "hold": listed(hold), "release": listed(release), "way": way}, parameters)
        return datasets.of_equilibrium(self, json.loads(told), self.held if hold is None else (listed(hold) or "").split(","))

    def modes(self, at: str = "statics", *, q: npt.ArrayLike | None = None, t: float | None = None, inputs: Mapping[str, float] | None = None,
              parameters: Mapping[str, float] | None = None, modes: int | None = None, hold: str | Sequence[str] | None = None,
              release: str | Sequence[str] | None = None, way: str | None = None) -> xarray.Dataset:
        """Frequencies, damping ratios and shapes about the equilibrium, `at="initial"` about the start, or about q."""
        with state_file(q, None, t, inputs) as state:
            told = self._run("modes", {"at": state or at, "modes": modes, "hold": listed(hold), "release": listed(release), "way": way}, parameters)
        return datasets.of_modes(self, json.loads(told))

    def simulate(self, t_end: float, tol: float | None = None, *, method: str | None = None, step: float | None = None, every: float | None = None,
                 from_: str = "initial", q: npt.ArrayLike | None = None, qd: npt.ArrayLike | None = None, t: float | None = None,
                 inputs: Mapping[str, npt.ArrayLike] | None = None, parameters: Mapping[str, float] | None = None,
                 stop: Sequence[str] = (), **options: Any) -> xarray.Dataset:
        """A motion until t_end [s]: a variable for each column of `refdyn sim`, along t, with its unit; the summary as attributes.

        tol        error of a step (1e-6), when no fixed `step` is given
        from_      "initial" or "statics"; q, qd and t give another start
        inputs     constant values by name, or with times `t` samples that each hold until the next
        stop       conditions that end the motion: "E_z<2"
        options    further ones of `refdyn sim`: accuracy, verify, step_max, stabilise, singular, start, hold, release, way
        """
        with program.private_folder() as folder, state_file(q, qd, t, None) as state:
            run, summary = os.path.join(folder, "run.csv"), os.path.join(folder, "summary.json")
            given = {"until": t_end, "tol": tol, "method": method, "step": step, "every": every, "from": state or from_,
                     "inputs": datasets.write_samples(inputs, self.inputs, folder), "output": run, "summary": summary, **options}
            try:
                self._run("sim", given, parameters, *(word for condition in stop for word in ("--stop", condition)))
            except program.NumericalError as error:
                error.run = datasets.of_motion(self, run + ".part", None) if os.path.exists(run + ".part") else None
                raise
            return datasets.of_motion(self, run, summary)

    def batch(self, cases: Mapping[str, npt.ArrayLike] | None = None, t_end: float | None = None, *, sweep: str | os.PathLike[str] | None = None,
              tol: float | None = None, method: str | None = None, from_: str | None = None, threads: int | None = None, lanes: int | None = None,
              **options: Any) -> xarray.Dataset:
        """Many motions, along `case`.

        cases      a column of values for each parameter, option, input or start value (NAME, NAME_d) that varies: a motion
                   until t_end for each row, of which the final state is kept
        sweep      instead of these a sweep file, which says what varies and what is kept
        options    further ones of `refdyn batch`: step, step_max, every, stabilise, singular, start, hold, release, way

        Variables are named as the columns of RUNS.csv: what varied, `status`, `reason`, final values, NAME_min ...; histories
        are NAME_history, along t. What a case does not have is NaN. Needs h5py.
        """
        datasets.need_h5py()
        if (cases is None) == (sweep is None):
            raise ValueError("either cases or a sweep file is needed")
        with program.private_folder() as folder:
            runs, summary = os.path.join(folder, "runs.h5"), os.path.join(folder, "summary.json")
            given = {"table": datasets.write_cases(cases, folder) if cases is not None else None, "until": t_end, "tol": tol, "method": method,
                     "from": from_, "threads": threads, "lanes": lanes, "output": runs, "summary": summary, **options}
            self._run("batch", given, None, *([os.fspath(sweep)] if sweep is not None else []))
            return datasets.of_runs(runs, summary)

    def states(self, data: xarray.Dataset) -> tuple[np.ndarray, np.ndarray]:
        """q and qd of a dataset as arrays (..., n), as quantities take them: `arm.energy(*arm.states(run), run.t)`. Rates
        that it does not have, as those of an equilibrium, are 0."""
        q = np.stack([data[name].values for name in self.coordinates], axis=-1)
        rates = [data[name + "_d"].values if name + "_d" in data else np.zeros(q.shape[:-1]) for name in self.coordinates]
        return q, np.stack(rates, axis=-1)

    def _run(self, command: str, options: Mapping[str, Any], parameters: Mapping[str, float] | None = None, *words: str) -> str:
        for name in parameters or {}:
            if name not in self.parameters:
                raise ValueError(unknown("parameter", name, self.parameters))
        self._check_sources()
        settings = program.settings({**self._settings, **(parameters or {})})
        return program.run(command, self._file, *words, *program.arguments(options), *settings)

    def _check_sources(self) -> None:
        """Quantities and motions of one model are those of one text."""
        for path, was in self._sources.items():
            if digest(path) != was:
                raise program.ModelError(f"{path}: the file has changed since this model was read, make a new refdyn.Model", path)


def digest(path: str) -> bytes | None:
    try:
        return hashlib.sha256(pathlib.Path(path).read_bytes()).digest()
    except OSError:
        return None


def named(entries: Sequence[Mapping[str, Any]], key: str) -> Mapping[str, Any]:
    return types.MappingProxyType({entry["name"]: entry[key] for entry in entries})


def constant(values: Sequence[float]) -> np.ndarray:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def listed(names: str | Sequence[str] | None) -> str | None:
    return names if names is None or isinstance(names, str) else ",".join(names)


@contextlib.contextmanager
def state_file(q: npt.ArrayLike | None, qd: npt.ArrayLike | None, t: float | None, inputs: Mapping[str, float] | None) -> Iterator[str | None]:
    """A STATE.json of what is given, None: nothing is."""
    given = {key: np.asarray(value, dtype=float).tolist() for key, value in (("t", t), ("q", q), ("qd", qd)) if value is not None}
    if inputs:
        given["inputs"] = {name: float(value) for name, value in inputs.items()}
    if not given:
        yield None
        return
    with program.private_folder() as folder:
        path = os.path.join(folder, "state.json")
        pathlib.Path(path).write_text(json.dumps(given))
        yield path
