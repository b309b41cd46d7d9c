"""`refdyn import`: robots of robots/ against Pinocchio's values, links as beams, names, and every file that is refused."""
import json
import math
import os
import pathlib
import re

import numpy
import pytest

from program import LONG, SCALE, TESTS, check, close, evaluate, oracle, refdyn

ROBOTS = TESTS / "robots"
REFERENCES = oracle("import")
TOLERANCE = 1e-12

HEAD = '<robot name="r">\n'
MASS = '<inertial><mass value="2"/><inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.5"/></inertial>'
PAIR = f'<link name="a"/>\n<link name="b">{MASS}</link>\n'


def joint(inside="", name="j", kind="continuous", parent="a", child="b"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>\n'


def imported(folder, text, *arguments, status=0, name="r.urdf"):
    """The model's text, and what was said."""
    (folder / name).write_text(text) if isinstance(text, str) else (folder / name).write_bytes(text)
    done = refdyn("import", name, "-o", "r.lua", *arguments, cwd=folder, status=status)
    return (folder / "r.lua").read_text() if status == 0 else None, done.stderr


def model_of(folder, text, *arguments):
    imported(folder, text, *arguments)
    return folder / "r.lua"


def undamped(model):
    """Damping is no part of Pinocchio's values."""
    model.write_text(re.sub(r"damper = \{[^}]*\},?", "", model.read_text()))
    return model


def compare(model, coordinates, state):
    """Lines about what differs from Pinocchio at a state of robot `coordinates`."""
    own = json.loads(refdyn("eval", model).stdout)["coordinates"]
    assert sorted(own) == sorted(coordinates)
    place = [coordinates.index(name) for name in own]
    q, qd, f, gravity = ([state[key][i] for i in place] for key in ("q", "qd", "f", "gravity"))
    moving, still = evaluate(model, {"q": q, "qd": qd}), evaluate(model, {"q": q, "qd": [0] * len(q)})
    return [close("M", moving["M"], numpy.array(state["M"])[numpy.ix_(place, place)], TOLERANCE),
            close("h + Q", numpy.add(moving["h"], moving["Q"]), f, TOLERANCE),
            close("gravity", numpy.add(still["h"], still["Q"]), gravity, TOLERANCE)]


@pytest.mark.parametrize("robot", REFERENCES)
def test_equations_are_pinocchios(robot, tmp_path):
    model = undamped(model_of(tmp_path, (ROBOTS / f"{robot}.urdf").read_text()))
    for state in REFERENCES[robot]["states"]:
        check(compare(model, REFERENCES[robot]["coordinates"], state))
