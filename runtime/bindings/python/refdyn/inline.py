"""What a notebook shows: pages of motions, and short tables of models and quantities."""
from __future__ import annotations

import html
import json
import os
import pathlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .names import file_name, finite, one_real, unknown
from .program import text_of
from .recorded import Columns

if TYPE_CHECKING:
    import xarray

    from .model import Model
    from .quantity import Quantity
    from .urdf import Limits

LONGEST = 200  # bytes of the name of a run, which becomes that of a file
ROWS = 12  # rows of a table; the others are counted


class Page:
    """A page of `arm.view(run)` or `arm.live()`, which a notebook shows in its place. It needs no network."""

    __module__ = "refdyn"

    def __init__(self, text: str, height: int) -> None:
        self.text, self.height = text, height

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.text)}" width="100%" height="{self.height}" style="border: 0" allowfullscreen></iframe>'

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes the page to a file."""
        pathlib.Path(page_file(file)).write_text(self.text, encoding="utf-8")

    def __repr__(self) -> str:
        return f"<refdyn page of {len(self.text)} characters; a notebook shows it, and save(FILE) writes it>"


def page_file(file: str | os.PathLike[str]) -> str:
    """Returns the absolute path of a page. An ending, if there is one, must be that of a page."""
    name = file_name("file", file, "a page, 'arm.html'")
    if os.path.splitext(name)[1].lower() not in ("", ".html", ".htm"):
        raise ValueError(f"file: {name!r} must end in .html or .htm")
    return os.path.abspath(name)


def check_height(height: int) -> None:
    if isinstance(height, bool) or not isinstance(height, (int, np.integer)) or height <= 0:
        raise ValueError(f"height: {height!r}; must be a positive whole number of pixels")


def runs_by_name(model: str, runs: Any) -> dict[str, tuple[str, xarray.Dataset]]:
    """Returns, by the name of each run, the words for it in messages, and the run. Names must be usable as file names."""
    if hasattr(runs, "data_vars"):
        return {model: ("the run", runs)}
    if isinstance(runs, Columns):
        raise TypeError("view: columns by name; must be a dataset of arm.simulate, without dataset=False")
    if isinstance(runs, Mapping):
        found = {name: (f"run {name!r}", run) for name, run in runs.items()}
    elif isinstance(runs, (list, tuple)):
        found = {f"{model} {number + 1}": (f"runs[{number}]", run) for number, run in enumerate(runs)}
    else:
        raise TypeError(f"view: {type(runs).__name__}; must be a dataset of arm.simulate, or several by name or in a list")
    if not found:
        raise ValueError("view: no run; give at least one")
    for name, (words, run) in found.items():
        if not isinstance(name, str):
            raise TypeError(f"view: {words}: {type(name).__name__}; its name must be a text")
        if not hasattr(run, "data_vars"):
            raise TypeError(f"view: {words}: {type(run).__name__}; must be a dataset of arm.simulate")
        if not name or "/" in name or name.startswith("-") or len(name.encode()) > LONGEST:
            raise ValueError(f"view: {words}: not a file name; its name must not be empty, contain /, begin with - or have more than {LONGEST} bytes")
    return found


def settings_of(model: Model, runs: Mapping[str, tuple[str, xarray.Dataset]]) -> dict[str, Any]:
    """Returns the options and parameters of motions that differ from the model's; they must be the same in all runs."""
    found: list[tuple[str, dict[str, Any]]] = []
    for words, run in runs.values():
        other = run.attrs.get("model", model._name)
        if other != model._name:
            raise ValueError(f"view: {words} is a motion of the model {other!r}; must be one of {model._name!r}")
        missing = [coordinate for coordinate in model._joints if coordinate not in run]
        if missing:
            raise ValueError(f"view: {words} has no {missing[0]}; must have all coordinates, as a dataset of arm.simulate does")
        given = {**json.loads(run.attrs.get("options", "{}")), **json.loads(run.attrs.get("parameters", "{}"))}
        found.append((words, {key: value for key, value in given.items() if value != {**model.options, **model._fixed}.get(key)}))
    first, settings = found[0]
    for words, given in found:
        if given != settings:
            raise ValueError(f"view: {words} has other options or parameters than {first}; must have the same, or use refdyn view with files of `refdyn sim -o RUN.h5`")
    return settings


def ranges_and_settings(values: Mapping[str, Any], kinds: Mapping[str, Collection[str]]) -> tuple[list[str], dict[str, Any]]:
    """Returns the values of `arm.live` as words of the command line, --range NAME=FROM:TO and --options NAME=VALUE,..., and as settings. `kinds` has the model's names by kind."""
    starts = [name + end for end in ("", "_d") for name in kinds["coordinate"]]
    settable = [*kinds["parameter"], *kinds["input"], *kinds["option"]]
    words, settings = [], {}
    for name, value in values.items():
        if name not in settable and name not in starts:
            raise ValueError(unknown("name", name, [*settable, *starts]))
        if name in kinds["option"] and np.ndim(value) > 0:
            words += ["--options", f"{name}={','.join(text_of(name, one) for one in value)}"]
        elif np.ndim(value) > 0:
            words += ["--range", "{}={!r}:{!r}".format(name, *ends_of_range(name, value))]
        elif name in starts:
            raise ValueError(f"{name}: a start value has a range only; must be two numbers, (from, to)")
        else:
            settings[name] = value if name in kinds["option"] else one_real(name, finite(name, value))
    return words, settings


def ends_of_range(name: str, value: Any) -> list[float]:
    ends: list[float] = finite(name, value).tolist()
    if np.shape(ends) != (2,):
        raise ValueError(f"{name}: has shape {np.shape(ends)}; must be one value, or a range of two numbers, (from, to)")
    if ends[0] >= ends[1]:
        raise ValueError(f"{name}: from {ends[0]:g} to {ends[1]:g}; the range must ascend")
    return ends


def table(title: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table with a title, cut after some rows; nothing without rows."""
    lines = ["<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows]
    if not lines:
        return ""
    left = len(lines) - ROWS
    if left > 1:
        lines[ROWS:] = [f"<tr><td colspan={len(head)}>and {left} more</td></tr>"]
    return f"<table><caption>{html.escape(title)}</caption><tr>{''.join(f'<th>{html.escape(name)}</th>' for name in head)}</tr>{''.join(lines)}</table>"


def of_model(model: Model) -> str:
    lists = [f"{name}: {', '.join(getattr(model, name))}" for name in ("rows", "points", "courses", "held") if getattr(model, name)]
    options = ", ".join(f"{name} = {value}" for name, value in model.options.items())
    return "".join([
        f"<b>{html.escape(model._name)}</b>", f"<div>options: {html.escape(options)}</div>" if options else "",
        table("coordinates", ("name", "unit", "start", "rate at start"), ((name, model.units[name], f"{q:.6g}", f"{qd:.6g}") for name, q, qd in zip(model.coordinates, model.q0, model.qd0))),
        *(table(f"{kind}s", ("name", "unit", "value"), ((name, model.units_of(name), f"{value:.6g}") for name, value in values.items()))
          for kind, values in (("input", model.inputs), ("parameter", model.parameters))),
        *(f"<div>{html.escape(text)}</div>" for text in lists)])


def of_quantity(quantity: Quantity) -> str:
    about = {part["name"]: part["about"] for part in quantity._description["parts"]}
    rows = ((name, " x ".join(map(str, shape)), about[name]) for name, shape in quantity._parts.items())
    call = f"{quantity.__name__}(q, qd=None, t=0.0, inputs=None, parameters=None)"
    return f"<code>{call}</code><div>{html.escape(quantity._description['about'])}</div>" + table("result", ("part", "shape", "meaning"), rows)


def of_limits(limits: Limits) -> str:
    """A row for each coordinate that has a limit; missing limits are left empty."""
    rows = ((name, *(f"{value:.6g} {limits.units[name][key]}" if np.isfinite(value) else "" for key, value in limit._asdict().items()))
            for name, limit in limits.items() if np.isfinite(limit).any())
    return table("limits", ("name", "lower", "upper", "velocity", "effort"), rows) or "<div>no limits</div>"
