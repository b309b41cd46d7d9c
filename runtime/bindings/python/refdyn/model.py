"""A model: its emitted quantities as functions, and the results of the program as datasets."""
from __future__ import annotations

import contextlib
import json
import os
import pathlib
import threading
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import casadi_functions, cases as cases_, datasets, equilibria, fitting, inline, motion, planning, program, recorded, stepping, urdf
from .names import ByName, Fixed, by_name, by_order, common_lead, file_name, finite, finite_row, flag, in_order, nearest, one_real, suggesting, texts_of, unknown, with_names
from .passing import Given, States
from .quantity import Compiled, Quantity, states_of
from .samples import of_dataset, split
from .sources import TEXT, Sources

if TYPE_CHECKING:
    import xarray


@suggesting("step")
class Model(Fixed):
    """A model file with its options and parameters: `Model("models/manipulator.lua", n_rfe=4)`.

    Every emitted quantity is a function of the model, such as `arm.qdd(q, qd)`. `dir(arm)` lists the quantities;
    `help(arm.qdd)` explains the arguments and the result of one. Derivatives are compiled when they are first named. Any
    number of threads may use one model. A model never changes, even if its file does. It can be pickled, and unpickling
    restores the same model.
    """

    __module__ = "refdyn"
    _remedy = "a model cannot be changed; create another with refdyn.Model, or pass parameters={...} to one call"

    coordinates: tuple[str, ...]                 # in the order of q: those of joints, then the continuous states
    state_names: tuple[str, ...]                 # continuous states: the value of a state is in qd, its rate in qdd; q has no meaning there
    parameters: Mapping[str, float]              # values of the parameters that some quantity reads
    inputs: Mapping[str, float]
    options: Mapping[str, int | float | bool | str]
    units: Mapping[str, str]                     # of coordinates; `units_of` also knows parameters and inputs
    rows: tuple[str, ...]
    points: tuple[str, ...]
    courses: tuple[str, ...]
    held: tuple[str, ...]                        # coordinates that statics and modes hold; of a robot from URDF with drives, in the order of its inputs
    joints: Mapping[str, str | tuple[str, ...]]  # of a URDF file: the coordinate of each joint; several if it is planar or floating
    imported: tuple[str, ...]                    # report of from_urdf: the beam and the rest of each flexible link, omitted elements
    limits: urdf.Limits                          # of positions, velocities and efforts, by coordinate
    q0: np.ndarray                               # initial state
    qd0: np.ndarray
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
        name = file_name("file", file, "a model file")
        if "\n" in name:
            raise ValueError("file: a text of several lines; use refdyn.Model.from_text")
        self._read(Sources(os.path.join(".", name) if name.startswith("-") else name), settings)

    @classmethod
    def from_text(cls, text: str, /, **settings: Any) -> Model:
        """Creates a model from the text of a model file. Errors name the file '<text>'. The text cannot `require` files."""
        if not isinstance(text, str):
            raise TypeError(f"text: {type(text).__name__}; must be the text of a model")
        if text.endswith(".lua") and "\n" not in text:
            raise ValueError(f"text: {text!r} is the name of a file; use refdyn.Model")
        return cls._of_sources(Sources(TEXT, {TEXT: text.encode()}), settings)

    @classmethod
    def from_urdf(cls, file: str | os.PathLike[str], /, flexible: Mapping[str, Mapping[str, Any]] | None = None, *, drives: bool = False, floating: bool = False,
                  friction_width: float | None = None, right_angles: float | None = None, **settings: Any) -> Model:
        """Imports a robot: `refdyn.Model.from_urdf("ur5.urdf", {"forearm": {"section": "tube:0.08:0.076", "E": 7e10}})`.

        flexible   options of links that become beams: section, E, tip, nu, eta, rho, rfe, as in `refdyn import`. Several links
                   have the same options
        drives     each joint has an input, limited to its effort
        floating, friction_width, right_angles   as in `refdyn import`
        settings   options and parameters of the model

        Coordinates have the names of their joints where the model's language allows them; `joints` maps all of them.
        `text` is the model that the import wrote, and `imported` its report: beam and rest of each flexible link, omitted elements.
        `rfe` counts rigid finite elements, with rfe - 1 spring-damping elements between them: rfe=1 is a rigid link.
        """
        given = {**urdf.beam_options(flexible), "drives": drives, "floating": floating, "friction_width": friction_width, "right_angles": right_angles}
        text, joints, report = urdf.imported(file_name("file", file, "a URDF file"), given)
        try:
            return cls._of_sources(Sources(TEXT, {TEXT: text.encode()}), settings, joints, report)
        except ValueError as error:
            urdf.check_keyword(str(error), settings, given)
            raise

    @classmethod
    def _of_sources(cls, sources: Sources, settings: Mapping[str, Any], joints: urdf.Joints = {}, imported: tuple[str, ...] = ()) -> Model:
        model = cls.__new__(cls)
        model._read(sources, settings, joints, imported)
        return model

    def _read(self, sources: Sources, settings: Mapping[str, Any], joints: urdf.Joints = {}, imported: tuple[str, ...] = ()) -> None:
        self._lock, self._settings, self._sources = threading.RLock(), dict(settings), sources
        self._libraries: dict[tuple[str | None, bool], Compiled] = {}
        self._steppers: dict[tuple[str, str | None], stepping.Stepper] = {}
        self._purposes: dict[tuple[str, frozenset[str]], Compiled] = {}
        self._layout: tuple[Any, ...] | None = None  # names and times of the last motion
        self._form: xarray.Dataset | None = None  # a dataset of this layout
        printed, facts, _ = program.run("compile", sources.path(), *program.settings(settings), places=sources.places)
        description, self._warned = json.loads(printed), frozenset(facts)
        sources.keep(description["sources"])
        self._name, self._lacks = description["name"], description["lacks"]
        self._known = [name for name in description["quantities"] if name not in self._lacks]
        self._default = {entry["quantity"] for entry in description["functions"]}
        self._units = {kind: named(description[kind], "unit") for kind in ("coordinates", "parameters", "inputs")}
        self._by_events = {entry["name"] for entry in description["inputs"] if entry["by_events"]}
        self._fixed = {entry["name"]: entry["value"] for entry in description["parameters"] if not entry["anchored"]}
        lists = {key: tuple(description[key]) for key in ("rows", "points", "courses", "held")}
        vars(self).update(coordinates=tuple(self._units["coordinates"]), parameters=named(description["parameters"], "value", "parameter"),
                          inputs=named(description["inputs"], "value", "input"), units=self._units["coordinates"], options=ByName("option", description["options"], Model._remedy),
                          q0=constant(description["q"]), qd0=constant(description["qd"]), joints=ByName("joint", joints), imported=imported,
                          limits=urdf.Limits(tuple(self._units["coordinates"]), self._units["coordinates"], description["limits"], description["bounds"], joints),
                          state_names=tuple(description["states"]), **lists)
        self._row_starts, self._given = description["row_starts"], {entry["name"] for entry in description["parameters"] if not entry["anchored"]}
        self._kinds = {"parameter": (*self.parameters, *description["unread"]), "input": self.inputs, "option": self.options, "coordinate": self.coordinates}
        for kind in ("parameter", "input"):
            for name in settings.keys() & set(self._kinds[kind]):
                finite(f"{kind} {name}", settings[name])  # the program also reads numbers from texts
        self._order = named(description["parameters"], "anchored")
        self._libraries[None, False] = Compiled(description, self._kinds, self._order, self._sources.places)

    def __repr__(self) -> str:
        states = f"{len(self.state_names)} states, " if self.state_names else ""
        return f"<refdyn.Model {self._name}: {len(self._joints)} coordinates, {states}{len(self.rows)} rows, {len(self.parameters)} parameters>"

    @property
    def _joints(self) -> tuple[str, ...]:
        """The coordinates without states."""
        return self.coordinates[:len(self.coordinates) - len(self.state_names)]

    def _repr_html_(self) -> str:
        return inline.of_model(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return restored, (type(self), self._sources.main, self._sources.texts, self._settings, dict(self.joints), self.imported)

    def __copy__(self) -> Model:
        return self

    def __deepcopy__(self, memo: Any) -> Model:
        return self

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._known})

    @property
    def text(self) -> str:
        """The text of the model file as it was read; of a robot from URDF, the text to which messages such as `<text>:28` refer."""
        return self._sources.texts[self._sources.main].decode("utf-8", "replace")

    # ---- Quantities ----

    def __getattr__(self, name: str) -> Quantity:
        """Creates a quantity when it is first named; later it is an ordinary attribute."""
        if name.startswith("_") or name not in self._known:
            if name in self.__dict__.get("_lacks", ()):
                raise AttributeError(f"{shown_file(self._sources.main)}: the model has no {name}; it needs {self._lacks[name]}")
            near = None if name.startswith("_") else nearest(name, (own for own in dir(self) if not own.startswith("_")))
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}" + (f"; did you mean {near!r}?" if near else ""))
        with self._lock:
            if name not in self.__dict__:
                self.__dict__[name] = self._quantity(name)
            return self.__dict__[name]

    def _quantity(self, name: str) -> Quantity:
        emit = None if name in self._default else name
        try:
            compiled = self._library(emit, False)
        except (program.ModelError, ValueError) as error:
            raise AttributeError(str(error)) from error
        if name not in {entry["quantity"] for entry in compiled.description["functions"]}:
            raise AttributeError(f"{shown_file(self._sources.main)}: the model has no {name}")
        return Quantity(name, self, compiled, lambda: self._library(emit, True))

    def inverse_dynamics(self, q: States, qd: States, qdd: States, t: npt.ArrayLike = 0.0,
                         inputs: Given = None, parameters: Given = None) -> np.ndarray:
        """Computes the forces on the coordinates that cause the accelerations qdd, M qdd - h - Q: (..., n), as `arm.inverse` does.

        They act in addition to the model's own forces, those of the inputs included. With rows, they are the forces of drives and
        rows together: at `qdd = arm.qdd(q, qd)` the result is `arm.force(q, qd)`. Axes before the last one are a batch.
        """
        found = self.inverse._of_accelerations(q, qd, qdd, t, inputs, parameters)
        if found is not None:
            return found
        n = len(self.coordinates)
        rates = {name: states_of(name, value, self) for name, value in (("qd", qd), ("qdd", qdd))}
        lead = common_lead((name, array.shape[:-1]) for name, array in rates.items())
        return self.inverse(q, np.concatenate([np.broadcast_to(array, lead + (n,)) for array in rates.values()], axis=-1), t, inputs, parameters)

    def _library(self, emit: str | None, has_lanes: bool) -> Compiled:
        with self._lock:
            if (emit, has_lanes) not in self._libraries:
                printed = self._run("compile", {"emit": emit, "for_lanes": has_lanes})
                self._libraries[emit, has_lanes] = Compiled(json.loads(printed), self._kinds, self._order, self._sources.places)
            return self._libraries[emit, has_lanes]

    def _purpose(self, purpose: str, given: Collection[str] = ()) -> Compiled:
        """The library of a command: "motion", "statics" or "modes". `given`: anchored parameters that have a value."""
        key = (purpose, frozenset(given))
        with self._lock:
            if key not in self._purposes:
                printed = self._run("compile", {"for": purpose}, {name: self.parameters[name] for name in given})
                self._purposes[key] = Compiled(json.loads(printed), self._kinds, self._order, self._sources.places)
            self._purposes[key].change_over()
            return self._purposes[key]

    def units_of(self, name: str) -> str:
        """Returns the unit of a coordinate, a parameter or an input."""
        for units in self._units.values():
            if name in units:
                return units[name]
        raise ValueError(unknown("coordinate, parameter or input", name, [name for units in self._units.values() for name in units]))

    # ---- Motions in the caller's own loop ----

    def motion(self, q: States | None = None, qd: States | None = None, t: float = 0.0, *, method: str | None = None, tol: float | None = None,
               tol_rates: float | None = None, step: float | None = None, step_max: float | None = None, stabilise: str | None = None, singular: str | None = None, start: str | None = None,
               step_limit: int | None = None, inputs: Given = None, parameters: Given = None) -> motion.Motion:
        """Begins a motion at q, qd (default: the model's initial state) and t [s]; `motion.advance(t)` computes it.

        The options are those of `refdyn sim`: adaptive steps with `tol` and `tol_rates`, or fixed ones of at most `step` [s], without which those of
        rk4 are 1 ms. After `step_limit` steps, accepted or rejected, `advance` raises NumericalError. Inputs and parameters are constant until `motion.set(...)`.
        """
        options = motion.options_of(method, tol, step, tol_rates, step_max, stabilise, singular, start, False, step_limit)
        return motion.begin(self, q, qd, t, options, start, inputs, parameters)

    def step(self, q: States, qd: States, t: npt.ArrayLike, h: float, inputs: Given = None, parameters: Given = None, *,
             method: str = "rk4", steps: int = 1, stabilise: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Steps from q, qd at t [s] by h [s]; returns q and qd at t + h. Axes before the last one are a batch, as in quantities; h is one number.

        method     "rk4", "rk54", "rk8", "gauss" (gauss12), "radau" (radau9), "rodas5p" ... with a fixed step
        steps      number of equal steps that divide h. Explicit steps that are too long return wrong numbers: one of rk4 must be shorter
                   than 2.6 divided by the largest abs(eigenvalue) of arm.modes(at="initial", hold=[])
        stabilise  how rows are kept: "baumgarte", the gains of the rows (default of rk4, rk54 and rk8), "project" (of the others) or "none"

        A single state that fails raises NumericalError. In a batch, states that fail or are not finite are NaN afterwards, with a
        ModelWarning. If an event of the model ends the motion, the result is the state at the event, with a ModelWarning.
        """
        key = (method, stabilise)
        stepper = self._steppers.get(key)
        if stepper is None:
            with self._lock:
                stepper = self._steppers.setdefault(key, stepping.Stepper(self, *key))
        return stepper(q, qd, t, h, inputs, parameters, steps)

    # ---- Equilibria, modes, motions, batches ----

    def statics(self, q: States | None = None, *, t: float | None = None, inputs: Given = None, parameters: Given = None, hold: str | Sequence[str] | None = None,
                release: str | Sequence[str] | None = None, way: str | None = None) -> xarray.Dataset:
        """Computes the equilibrium near q; the options are those of `refdyn statics`."""
        inputs = by_order("input", inputs, self.inputs)
        values, constants = self._values("parameter", parameters), self._values("input", inputs)
        found = equilibria.find(self, "statics", q, t, constants, values, hold, release, way)
        if found is not None:
            motion.warn_of_unread(self, values)
            return datasets.of_equilibrium(self, found, found["held"], datasets.attributes(self, values, inputs))
        with self._state_file(q, None, t, self._values("input", inputs)) as state:
            printed = self._run("statics", {"state": state, "hold": listed("hold", hold), "release": listed("release", release), "way": way}, values)
        held = self.held if hold is None else (listed("hold", hold) or "").split(",")
        return datasets.of_equilibrium(self, json.loads(printed), held, datasets.attributes(self, values, inputs))

    def modes(self, at: str = "statics", *, q: States | None = None, t: float | None = None, inputs: Given = None, parameters: Given = None,
              modes: int | None = None, hold: str | Sequence[str] | None = None,
              release: str | Sequence[str] | None = None, way: str | None = None) -> xarray.Dataset:
        """Computes frequencies, damping ratios and shapes about the equilibrium, about the initial state (`at="initial"`) or about q.

        modes    how many modes, from the lowest frequency; default: all
        hold     coordinates that do not move; default: `arm.held`, for a robot from URDF all driven joints. hold=[] holds none: these
                 are the modes that a step of `arm.step` has to resolve
        release  rows that do not act; the further options are those of `refdyn modes`
        """
        check_place("at", at, [])
        inputs = by_order("input", inputs, self.inputs)
        values, constants = self._values("parameter", parameters), self._values("input", inputs)
        is_found = q is None and at == "statics"
        if is_found and t is not None:
            raise ValueError("t: the equilibrium is computed at t = 0; add q or at=\"initial\" for another time")
        found = equilibria.modes(self, at, q, t, constants, values, modes, hold, release, way)
        if found is not None:
            motion.warn_of_unread(self, values)
            return datasets.of_modes(self, {"at": at if q is None else "state", **found}, datasets.attributes(self, values, inputs))
        with self._state_file(q, None, t, {} if is_found else constants) as state:
            given = {"at": state or at, "modes": modes, "hold": listed("hold", hold), "release": listed("release", release), "way": way}
            printed = self._run("modes", given, {**values, **constants} if is_found else values)
        return datasets.of_modes(self, json.loads(printed), datasets.attributes(self, values, inputs))

    def linearise(self, at: str = "statics", *, q: States | None = None, qd: States | None = None, t: float | None = None,
                  inputs: Given = None, parameters: Given = None, hold: str | Sequence[str] | None = None,
                  move_held: bool = False, release: str | Sequence[str] | None = None, way: str | None = None) -> xarray.Dataset:
        """Computes the linear model s' = A s + B x + rate, y = C s + D x about the equilibrium, the initial state or q, qd.

        s are the independent coordinates, then the independent rates; x the inputs; y the points with rates and accelerations,
        then the courses. The rows act without stabilisation.

        hold       coordinates that do not move; default: `arm.held`
        move_held  held coordinates move, while the forces that hold them stay as they are
        release    rows that do not act in the equilibrium; `way` as in `arm.statics`
        """
        check_place("at", at, [])
        inputs = by_order("input", inputs, self.inputs)
        values, constants = self._values("parameter", parameters), self._values("input", inputs)
        is_found = q is None and qd is None and at == "statics"
        if is_found and t is not None:
            raise ValueError("t: the equilibrium is computed at t = 0; add q or at=\"initial\" for another time")
        with self._state_file(q, qd, t, {} if is_found else constants) as state:
            given = {"at": state or at, "hold": listed("hold", hold), "move_held": move_held, "release": listed("release", release), "way": way}
            printed = self._run("linearise", given, {**values, **constants} if is_found else values)
        return datasets.of_linear_model(self, json.loads(printed), datasets.attributes(self, values, inputs))

    def simulate(self, t_end: float, tol: float | None = None, *, method: str | None = None, step: float | None = None, every: float | None = None,
                 from_: str = "initial", q: States | None = None, qd: States | None = None, t: float | None = None,
                 inputs: Given = None, parameters: Given = None, stop: str | Sequence[str] = (), derivatives: str | Sequence[str] = (),
                 dataset: bool = True, **options: Any) -> Any:
        """Computes a motion until t_end [s]. The columns of `refdyn sim` become variables along t with units, the summary attributes.

        tol        tolerance: bound on the local error (1e-6), for motions without a fixed `step`
        from_      "initial", "statics", with realise also "held", or the name of a STATE.json; q, qd and t define another start instead
        inputs     constant values, by name or as an array; or samples, each valid until the next: by name with times `t`, or a data
                   frame with a column `t`
        stop       a condition that ends the motion, "E_z<2", or several
        derivatives  parameters, inputs and start values (NAME or NAME_d of a coordinate): for each column a variable d_COLUMN with its
                   derivatives by them, (t, parameter)
        dataset    False returns the columns as arrays by name, with their summary in `attrs`, which is faster for short motions
        options    further options of `refdyn sim`: accuracy, verify, tol_rates, step_max, stabilise, singular, start, hold, release, way;
                   realise=True with before, after, mesh: the model's drives perform the programme, with their mean forces as drive_NAME
        """
        check_place("from_", from_, [name for name, value in (("q", q), ("qd", qd), ("t", t)) if value is not None], options)
        if method not in recorded.OF_GSL:
            motion.choose("method", method, motion.NAMES)
        if isinstance(options.get("accuracy"), (bool, np.bool_)):
            raise TypeError(f"accuracy: {options['accuracy']}; must be a number, the bound on the error of the motion")
        inputs = by_order("input", of_dataset(inputs), self.inputs, "; samples need their times, inputs={'t': times, 'NAME': values}")
        values = self._values("parameter", parameters)
        constants, columns = split(inputs, self._kinds, self._by_events)
        conditions, by = texts_of("stop", stop), texts_of("derivatives", derivatives)
        shown = (lambda run: self._dataset(run, values, inputs)) if flag("dataset", dataset) else (lambda run: run)
        if recorded.is_in_process(method, from_, conditions, options):
            chosen = motion.options_of(method, tol, step, *(options.get(name) for name in recorded.OPTIONS), True)
            try:
                run = recorded.simulate(self, t_end, chosen, every, (q, qd, t), constants, columns, values, conditions, from_, options, by)
            except (program.NumericalError, KeyboardInterrupt) as error:
                if getattr(error, "run", None) is not None:
                    error.run = shown(error.run)
                raise
            if run is not None:
                return shown(run)
        return self._simulate_by_program(t_end, tol, method, step, every, from_, (q, qd, t), (constants, columns), values, inputs, conditions, options, dataset, by)

    def _dataset(self, run: recorded.Columns, values: Mapping[str, float], inputs: Any) -> xarray.Dataset:
        return datasets.of_columns(self, run, datasets.attributes(self, values, inputs))

    def _simulate_by_program(self, t_end: float, tol: float | None, method: str | None, step: float | None, every: float | None, from_: str,
                             start: tuple[Any, Any, Any], given_inputs: tuple[Mapping[str, float], Mapping[str, np.ndarray]], values: Mapping[str, float],
                             inputs: Any, conditions: Sequence[str], options: Mapping[str, Any], dataset: bool, by: Sequence[str]) -> Any:
        """The same by `refdyn sim`: for options that only the program has, and for messages about wrong ones."""
        constants, columns = given_inputs
        attrs = datasets.attributes(self, values, inputs)
        with program.private_folder() as folder, self._state_file(*start, {}) as state:
            run, summary = os.path.join(folder, "run.csv"), os.path.join(folder, "summary.json")
            given = {"until": t_end, "tol": tol, "method": motion.ALIASES.get(method or "", method), "step": step, "every": every, "from": state or from_,
                     "inputs": datasets.write_samples(columns, folder), "output": run, "summary": summary, "derivatives": ",".join(by) or None, **program.further(options, self.simulate, program.OF_SIM)}
            try:
                self._run("sim", given, {**values, **constants}, *(word for condition in conditions for word in ("--stop", condition)))
            except program.NumericalError as error:
                error.run = datasets.of_motion(self, run + ".part", None, attrs, dataset, ()) if os.path.exists(run + ".part") else None
                raise
            return datasets.of_motion(self, run, summary, attrs, dataset, by)

    def batch(self, cases: Any = None, t_end: float | None = None, *, sweep: str | os.PathLike[str] | None = None, keep: Mapping[str, Any] | None = None,
              progress: bool = False, tol: float | None = None, method: str | None = None, from_: str | None = None, threads: int | None = None,
              lanes: int | None = None, **options: Any) -> xarray.Dataset:
        """Computes many motions, along `case`.

        cases      a column of values for each parameter, option, input or start value (NAME, NAME_d) that varies; one number is the
                   same in all cases: a dictionary of arrays, a data frame, refdyn.sample(...), or refdyn.grid(...), whose names become dimensions instead of `case`
        t_end      end of the motions [s]
        keep       what is kept of each motion, as in a sweep file: {"final": True, "at": times, "extremes": names, "norms": names,
                   "history": names, "limits": True}, with names of columns of `simulate`. Default: the final state
        sweep      a sweep file, which defines what varies and what is kept; it replaces `cases` and `keep`
        progress   True shows a bar on sys.stderr if the batch takes more than a second
        options    further options of `refdyn batch`: tol_rates, step, step_max, every, stabilise, singular, start, hold, release, way;
                   realise=True with before, after, mesh: the model's drives perform the programme of each case, with the numbers of
                   its report as variables

        Variables have the names of the columns of RUNS.csv: the varied values, `status`, `reason`, final values, NAME_min ...
        Histories are NAME_history, along t; values at times NAME_at, along t_at. Values that a case lacks are NaN. One warning
        reports all failed cases. Needs h5py.
        """
        datasets.need_h5py()
        cases_.refuse_values(options, self.coordinates)
        cases_.check_sources(cases, sweep, keep, t_end)
        end = motion.positive("t_end", t_end)
        check_place("from_", from_ or "initial", [], options)
        varied = cases_.Columns(cases, self.coordinates, self.options, {name for names in self._kinds.values() for name in names}) if cases is not None else None
        with program.private_folder() as folder:
            runs, summary = os.path.join(folder, "runs.h5"), os.path.join(folder, "summary.json")
            file = os.fspath(sweep) if sweep is not None else ""
            if varied is not None:
                file = cases_.write_sweep(datasets.write_cases(varied.rows, folder), keep, end, folder)
            given = {"until": t_end, "tol": tol, "method": method, "from": from_, "threads": threads, "lanes": lanes, "output": runs, "summary": summary,
                     **program.further(options, self.batch, program.OF_BATCH)}
            self._run("batch", given, dict.fromkeys(varied.rows if varied is not None else ()), file, shows_progress=progress)
            found, names = datasets.of_runs(self, runs, summary, datasets.attributes(self, {}))
        if varied is not None:
            found = cases_.labelled(found, varied.labels)
        cases_.warn_of_failures(found)
        return cases_.along_axes(found, varied.shape, [names[name] for name in varied.rows]) if varied is not None and varied.shape else found

    def fit(self, data: Any = None, *, vary: Any, noise: Mapping[str, float], sensors: Mapping[str, Any] | None = None, starts: str | Sequence[str] | Mapping[str, Any] = (),
            held_out: Any = None, check: bool = False, until: float | None = None, every: float | None = None, inputs: Given = None, parameters: Given = None,
            from_: str = "initial", tol: float | None = None, method: str | None = None, progress: bool = False, **options: Any) -> fitting.Fit:
        """Finds values of the model from measurements.

        data       a data frame, a dataset, columns by name, the name of a CSV, or a list of them: the time `t` [s], measured columns, named as
                   those of `simulate`, and inputs of the model. NaN is a gap
        vary       names of parameters, inputs or start values, or by name their bounds: {"E": None, "m_E": (1, 3), "eta": (0, 1e-2, 1e-3)}, as None,
                   (from, to) or (from, to, start)
        noise      standard deviation of each measured column, by name
        sensors    by column: {"offset": ..., "gain": ..., "delay": ...}, numbers, or bounds as in `vary`
        starts     coordinates NAME and rates NAME_d whose start is unknown in each file separately, or by name their bounds as in `vary`
        held_out   further data, which only judge the result
        check      True asks before data exist how well these columns, every `every` [s] until `until`, would determine the values
        inputs, parameters, from_   the motion from which the search begins
        options    further options of `refdyn fit`: tol_rates, step, step_max, stabilise, singular, start, hold, release, way, lanes
        """
        check = flag("check", check)
        if data is None and not check:
            raise TypeError("fit: data is missing; add measurements, or check=True before data exist")
        if data is not None and check:
            raise TypeError("fit: check=True needs no data; remove them")
        if not check and (until is not None or every is not None):
            raise TypeError(f"{'every' if until is None else 'until'}: belongs to check=True; the data have their own times")
        if check and until is None:
            raise TypeError("fit: until is missing; check=True needs the end of the motion [s]")
        motion.positive("until", until)
        check_place("from_", from_, [])
        values = {**self._values("parameter", parameters), **self._values("input", by_order("input", inputs, self.inputs))}
        with program.private_folder() as folder:
            request = fitting.Request(folder, data, held_out, vary, noise, sensors, starts)
            out = os.path.join(folder, "result.json")
            given = {"check": check, "until": until, "every": every, "from": from_, "tol": tol, "method": method, "output": out,
                     **program.further(options, self.fit, program.OF_FIT)}
            self._run("fit", given, values, request.path, shows_progress=progress)
            found = json.loads(pathlib.Path(out).read_text(encoding="utf-8"))
        return fitting.Fit(request.renamed(found), self._kinds["parameter"])

    def plan(self, *, vary: Mapping[str, Any], t_end: float | str, minimise: str | planning.Measure, within: Any = None, for_all: Mapping[str, Any] | None = None,
             search: str | None = None, starts: int | None = None, seed: int | None = None, inputs: Given = None, parameters: Given = None,
             from_: str = "initial", tol: float | None = None, method: str | None = None, progress: bool = False, **options: Any) -> planning.Plan:
        """Finds values of a motion that minimise an objective and keep limits of the model at all times.

        vary        by name: (from, to) or (from, to, start) of parameters, inputs or start values
        t_end       the end of the motion [s]: a number, or the name of a parameter or of a course of parameters
        minimise    a name of `vary`, or `refdyn.at_end(column)`, `refdyn.integral(column)`, `refdyn.largest(column)`
        within      limits of the model by name, and `refdyn.at_end(column, from_=..., to=...)`; default: all limits of the model
        for_all     lists of values by name: the limits must hold for each combination
        search      "slsqp" (default), or "cobyla", which needs no derivatives but more motions
        starts, seed   number of motions in the scan, and where its sequence begins
        options     further options of `refdyn plan`: tol_rates, step, step_max, stabilise, singular, start, hold, release, way, lanes

        If the limits contradict each other, the result is the least violation, with a warning.
        """
        check_place("from_", from_, [])
        values = {**self._values("parameter", parameters), **self._values("input", by_order("input", inputs, self.inputs))}
        with program.private_folder() as folder:
            path = planning.write(folder, vary, t_end, minimise, within, for_all, search, starts, seed)
            out = os.path.join(folder, "result.json")
            given = {"from": from_, "tol": tol, "method": method, "output": out, **program.further(options, self.plan, program.OF_FIT)}
            try:
                self._run("plan", given, values, path, shows_progress=progress)
            except program.NumericalError as error:
                if not os.path.exists(out):
                    raise
                warnings.warn(str(error), program.ModelWarning, stacklevel=2)
            found = json.loads(pathlib.Path(out).read_text(encoding="utf-8"))
        return planning.Plan(found, self._kinds["parameter"])

    def view(self, runs: xarray.Dataset | Mapping[str, xarray.Dataset] | Sequence[xarray.Dataset], file: str | os.PathLike[str] | None = None, *,
             height: int = 600) -> inline.Page | None:
        """Shows motions of this model from all sides: in a notebook by `arm.view(run)`, or as a page of HTML, `arm.view(run, "arm.html")`.

        Several runs, by name or in a list, share one scene. Their options and parameters, which are in their attributes, must
        be the same. `height` [pixels] is that of the page in a notebook.
        """
        inline.check_height(height)
        named_runs = inline.runs_by_name(self._name, runs)
        settings = {**self._settings, **inline.settings_of(self, named_runs)}
        with program.private_folder() as folder:
            page = os.path.join(folder, "page.html") if file is None else inline.page_file(file)
            paths = [os.path.join(folder, name + ".csv") for name in named_runs]
            for (words, run), path in zip(named_runs.values(), paths):
                datasets.write_motion(words, run, path)
            self._program("view", (*paths, *program.arguments({"output": page})), settings, model="--model")
            return inline.Page(pathlib.Path(page).read_text(encoding="utf-8"), height) if file is None else None

    def live(self, file: str | os.PathLike[str] | None = None, *, t_end: float | None = None, step: float | None = None, tol: float | None = None,
             tol_rates: float | None = None, pull: bool = False, height: int = 600, **values: Any) -> inline.Page | None:
        """Shows this model as a page that computes its motions itself: in a notebook by `arm.live(m_E=(1, 5))`, or as a file, `arm.live("arm.html")`.

        values   by name: a pair is the range of the slider of a parameter, an input or a start value (`NAME` or `NAME_d` of a
                 coordinate); a single value replaces that of a parameter, an input or an option; a list has the values of an option, among
                 which the page chooses

        `t_end` and `step` or `tol` and `tol_rates` are those of the first motion; with `pull` the pointer pulls the points of interest. Needs clang and the C library for WebAssembly.
        """
        inline.check_height(height)
        ranges, settings = inline.ranges_and_settings(values, self._kinds)
        with program.private_folder() as folder:
            page = os.path.join(folder, "page.html") if file is None else inline.page_file(file)
            self._run("view", {"live": True, "pull": pull, "until": t_end, "step": step, "tol": tol, "tol_rates": tol_rates, "output": page}, settings, *ranges)
            return inline.Page(pathlib.Path(page).read_text(encoding="utf-8"), height) if file is None else None

    def casadi(self, quantities: str | Sequence[str] | None = None, *, fold: bool = False) -> casadi_functions.CasadiFunctions:
        """Generates, compiles and loads functions for CasADi: `f = arm.casadi()`, then `f.qdd(q, qd, t, inputs, parameters)`.

        quantities   names as in `dir(arm)`, and "step" or "step.p" for steps with derivatives; default: M, h, energy, qdd, the
                     rows' phi and psi, r, and steps
        fold         turns parameters into numbers; derivatives are then quicker

        Needs the package casadi.
        """
        return casadi_functions.load(self, quantities, fold)

    def states(self, data: xarray.Dataset | Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Returns q and qd of a dataset, of columns by name or of a data frame as arrays (..., n) for quantities: `arm.energy(*arm.states(run), run.t)`.
        Rates that they lack, for instance at an equilibrium, are 0."""
        columns = with_names("data", data)
        if not isinstance(columns, Mapping):
            raise TypeError(f"data: {type(data).__name__}; must be a motion of arm.simulate or an equilibrium of arm.statics")
        missing = [name for name in self.coordinates if name not in columns]
        if missing:
            raise ValueError(f"data: no {missing[0]}; must have all coordinates of this model, as a motion of arm.simulate does")
        joints = [np.asarray(columns[name]) for name in self._joints]
        rest = np.zeros_like(np.asarray(columns[self.coordinates[0]]))
        rates = [np.asarray(columns[name + "_d"]) if name + "_d" in columns else rest for name in self._joints]
        rates += [np.asarray(columns[name]) for name in self.state_names]
        return np.stack(joints + [rest] * len(self.state_names), axis=-1), np.stack(rates, axis=-1)

    def _values(self, kind: str, given: Given) -> dict[str, float]:
        """Returns one number for each name. An array has the values of all inputs or parameters in their order. Where it has NaN, a
        parameter that the model anchors at the start of a motion is left out."""
        free = [name for name, is_anchored in self._order.items() if is_anchored] if kind == "parameter" else ()
        values = by_order(kind, given, self._units[f"{kind}s"], free=free)
        return {name: one_real(f"{kind} {name}", finite(f"{kind} {name}", value)) for name, value in by_name(kind, values, self._kinds).items()}

    def _start(self, name: str, value: Any) -> np.ndarray:
        """A start of a motion or of the search for an equilibrium: the time, or coordinates or rates by name or in the model's order."""
        return finite_row(name, value if name == "t" else in_order(name, value, self), "one state: a row of numbers")

    def _run(self, command: str, options: Mapping[str, Any], values: Mapping[str, float | None] = {}, *words: str, shows_progress: bool = False) -> str:
        """Runs a command with these values instead of the model's. Names with None are left out: another option sets them."""
        settings = {name: value for name, value in {**self._settings, **values}.items() if value is not None}
        return self._program(command, (*words, *program.arguments(options)), settings, shows_progress=shows_progress)

    def _program(self, command: str, words: Sequence[str], settings: Mapping[str, Any], model: str | None = None, shows_progress: bool = False) -> str:
        """Runs a command on the model as it was read. `model` is the option for its file; None: the file is an operand."""
        file = [model, self._sources.path()] if model else [self._sources.path()]
        return program.run(command, *file, *words, *program.settings(settings), places=self._sources.places, warned=self._warned,
                           shows_progress=flag("progress", shows_progress))[0]

    @contextlib.contextmanager
    def _state_file(self, q: States | None, qd: States | None, t: float | None, inputs: Mapping[str, float]) -> Iterator[str | None]:
        """Provides a STATE.json with the given values; None without values."""
        given: dict[str, Any] = {key: self._start(key, value).tolist() for key, value in (("t", t), ("q", q), ("qd", qd)) if value is not None}
        joints, n = len(self._joints), len(self.coordinates)
        if self.state_names and len(np.atleast_1d(given.get("qd", ()))) == n:
            given["states"] = dict(zip(self.state_names, given["qd"][joints:]))
        for key in ("q", "qd"):
            if key in given and self.state_names and len(np.atleast_1d(given[key])) == n:
                given[key] = given[key][:joints]
        if inputs:
            given["inputs"] = dict(inputs)
        if not given:
            yield None
            return
        with program.private_folder() as folder:
            path = os.path.join(folder, "state.json")
            pathlib.Path(path).write_text(json.dumps(given))
            yield path


def restored(kind: type[Model], main: str, texts: Mapping[str, bytes], settings: Mapping[str, Any], joints: urdf.Joints, imported: tuple[str, ...]) -> Model:
    """Restores a pickled model from its texts, even if the files have changed."""
    return kind._of_sources(Sources(main, texts), settings, joints, imported)


def check_place(argument: str, place: str, others: Sequence[str], options: Mapping[str, Any] = {}) -> None:
    """Checks the place where a motion starts or modes are computed, and that only one place is given."""
    places = ("initial", "statics", *(("held",) if options.get("realise") else ()))
    if not isinstance(place, (str, os.PathLike)):
        raise TypeError(f"{argument}: {type(place).__name__}; must be a name or a file; give a state as q=")
    if place not in places and not os.path.isfile(place):
        near = nearest(place, places)
        raise ValueError(f"{argument}: {place!r} is not one of {', '.join(places)}, and not a file" + (f"; did you mean {near!r}?" if near else ""))
    if others and place != "initial":
        raise ValueError(f"{argument}: {place!r} is given together with {', '.join(others)}; give one of them (arm.statics(q) computes an equilibrium near q)")


def shown_file(main: str) -> str:
    return "<text>" if main == TEXT else main


def named(entries: Sequence[Mapping[str, Any]], key: str, kind: str = "name") -> Mapping[str, Any]:
    return ByName(kind, {entry["name"]: entry[key] for entry in entries}, Model._remedy)


def constant(values: Sequence[float]) -> np.ndarray:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def listed(argument: str, names: str | Sequence[str] | None) -> str | None:
    return None if names is None else ",".join(texts_of(argument, names))
