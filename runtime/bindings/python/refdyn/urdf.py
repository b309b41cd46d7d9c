"""Robots from URDF files, by `refdyn import`; names of joints and limits of coordinates."""
from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import inline, program, wording
from .names import ByName, Fixed, nearest, not_one_of, unknown

OF_BEAMS = ("section", "E", "tip", "nu", "eta", "rho", "rfe")  # options of a flexible link
Joints = Mapping[str, "str | tuple[str, ...]"]


def beam_options(flexible: Mapping[str, Mapping[str, Any]] | None) -> dict[str, Any]:
    """Returns the options of `refdyn import` for links that become beams. All of them have one section and material."""
    if not flexible:
        return {}
    if not isinstance(flexible, Mapping) or not all(isinstance(options, Mapping) for options in flexible.values()):
        raise TypeError('flexible: must be options by link, {"forearm": {"section": "tube:0.08:0.076", "E": 7e10}}')
    for link in flexible:
        if not isinstance(link, str):
            raise TypeError(f"flexible: link {link!r}; the names of links must be texts")
    first_link, first = next(iter(flexible.items()))
    for link, options in flexible.items():
        for name in options:
            if name not in OF_BEAMS:
                raise ValueError(f"flexible: {link}: {not_one_of(name, OF_BEAMS)}")
        if dict(options) != dict(first):
            raise ValueError(f"flexible: {link} has other options than {first_link}; all flexible links of an import have the same")
    for name in ("section", "E"):
        if first.get(name) is None:
            raise ValueError(f"flexible: {first_link}: add {name}")
    tip = first.get("tip")
    return {"flexible": ",".join(flexible), **first, "tip": None if tip is None else ",".join(program.text_of("tip", value) for value in tip)}


def imported(file: str | os.PathLike[str], options: Mapping[str, Any]) -> tuple[str, Joints, tuple[str, ...]]:
    """Returns the text of the model, the coordinate or coordinates of each joint that moves, and the report of the import."""
    with program.private_folder() as folder:
        model, joints = (pathlib.Path(folder, name) for name in ("text.lua", "joints.json"))
        name = os.fspath(file)
        _, _, report = program.run("import", os.path.join(".", name) if name.startswith("-") else name, *program.arguments({**options, "output": str(model), "joints": str(joints)}), "--joint-names")
        names = {joint: tuple(coordinates) for joint, coordinates in json.loads(joints.read_text(encoding="utf-8")).items()}
        of_joints = {joint: of[0] if len(of) == 1 else of for joint, of in names.items()}
        return model.read_text(encoding="utf-8"), of_joints, tuple(wording.of_python(report).strip().splitlines())


def check_keyword(message: str, settings: Mapping[str, Any], keywords: Collection[str]) -> None:
    """Raises an error if the message is about a name that the model does not have and that resembles a keyword of from_urdf."""
    name, _, fact = message.partition(": ")
    near = nearest(name, keywords) if name in settings and "option, parameter or input" in fact else None
    if near:
        raise TypeError(f"from_urdf() got an unexpected keyword argument {name!r}; did you mean {near!r}?") from None


# ---- Limits ----

class Limit(NamedTuple):
    """Limits of one coordinate; infinite where there is none."""

    lower: float
    upper: float
    velocity: float
    effort: float


class Bounds(NamedTuple):
    """Bounds of a column of motions; infinite where there is none."""

    column: str
    lower: float
    upper: float


class Limits(Fixed, Mapping[str, Limit]):
    """Limits of the coordinates, from the field `limits` of links or a URDF file: `arm.limits["elbow"].upper`. The name of a
    joint in the URDF file serves as well as that of its coordinate.

    `lower`, `upper`, `velocity` and `effort` are arrays in the order of `coordinates`, infinite where there is no limit.
    `units` has their units by coordinate. `named` has all limits that motions are compared with, also those of drives and of the model's
    function `limits`: `arm.limits.named["tip_speed"].upper`. Motions are not changed by limits.
    """

    __module__ = "refdyn"
    _remedy = "limits cannot be changed; set them in the model file"

    coordinates: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray
    named: Mapping[str, Bounds]
    units: Mapping[str, Mapping[str, str]]

    def __init__(self, coordinates: Sequence[str], units: Mapping[str, str], entries: Sequence[Mapping[str, float]],
                 bounds: Sequence[Mapping[str, Any]], joints: Joints = {}) -> None:
        self._made_of = tuple(coordinates), dict(units), list(entries), list(bounds), dict(joints)
        self._joints = dict(joints)
        arrays = {name: fixed([entry.get(key, none) for entry in entries])
                  for name, key, none in (("lower", "from", -np.inf), ("upper", "to", np.inf), ("velocity", "rate", np.inf), ("effort", "force", np.inf))}
        named = {bound["name"]: Bounds(bound["column"], bound.get("from", -np.inf), bound.get("to", np.inf)) for bound in bounds}
        vars(self).update(coordinates=tuple(coordinates), named=ByName("limit", named, self._remedy),
                          units=ByName("coordinate", {name: ByName("unit", units_of(units[name])) for name in coordinates}), **arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._made_of

    def __getitem__(self, name: str) -> Limit:
        coordinate = name if name in self.coordinates else self._joints.get(name) if isinstance(name, str) else None
        if isinstance(coordinate, tuple):
            raise KeyError(f"{name}: this joint has the coordinates {', '.join(coordinate)}; use one of them")
        if coordinate is None:
            raise KeyError(unknown("coordinate", name, (*self.coordinates, *(joint for joint in self._joints if joint not in self.coordinates))))
        place = self.coordinates.index(coordinate)
        return Limit(*(float(values[place]) for values in (self.lower, self.upper, self.velocity, self.effort)))

    def __iter__(self) -> Iterator[str]:
        return iter(self.coordinates)

    def __len__(self) -> int:
        return len(self.coordinates)

    def _repr_html_(self) -> str:
        return inline.of_limits(self)

    def __repr__(self) -> str:
        limited = [f"{name}: {' '.join(f'{key}={value:g}' for key, value in limit._asdict().items() if np.isfinite(value))}" for name, limit in self.items()
                   if np.isfinite(limit).any()]
        return f"<refdyn limits of {len(limited)} of {len(self)} coordinates{''.join(chr(10) + '  ' + line for line in limited)}>"


def fixed(values: Sequence[float]) -> np.ndarray:
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def units_of(unit: str) -> dict[str, str]:
    return {"lower": unit, "upper": unit, "velocity": f"{unit}/s", "effort": "N m" if unit == "rad" else "N"}
