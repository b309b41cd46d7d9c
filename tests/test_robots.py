"""What robots have: joint axes in any direction, rotors, limits. Values by hand, in numpy, and by Pinocchio (make_robot_references.py)."""
import json
import re

import numpy
import pytest
from numpy import cos, sin

from program import TESTS, check, close, evaluate, oracle, read_run, refdyn
from test_features import rotation

ROBOT = TESTS / "models" / "robot.lua"
STATE = {"t": 0.3, "q": [0.37, -0.82, 1.13, -0.46, 0.71, 1.94, 0.023], "qd": [0.61, -1.27, 0.83, 1.71, -0.94, 2.13, -0.38]}
ACROSS = (0.12, 0.97, -0.05)
# Where each frame stands in the one before, and its joint: placement, turn of the placement, axis, is it a slide?
CHAIN = [((0.021, -0.013, 0.163), rotation("z", 0.21), (0, 0, 1), False), ((0.013, 0.138, 0.004), rotation("y", 0.4), ACROSS, False),
         ((0.425, -0.119, 0.008), numpy.eye(3), ACROSS, False), ((0.392, 0.003, -0.011), numpy.eye(3), (0.17, 0.9, 0.1), False),
         ((0.004, 0.093, 0.002), numpy.eye(3), (0, 0, -1), False), ((-0.002, 0.006, -0.095), numpy.eye(3), (-0.3, 0.7, 0.2), False),
         ((0.017, 0.112, 0.009), numpy.eye(3), (0.3, -0.4, 0.5), True)]


def about(axis, angle):
    """Rodrigues' rotation."""
    x, y, z = numpy.array(axis) / numpy.linalg.norm(axis)
    K = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + sin(angle) * K + (1 - cos(angle)) * K @ K


def frames(q):
    """Rotation, origin, and the joint's axis and whether it slides, of each frame in the ground's."""
    R, r, found = numpy.eye(3), numpy.zeros(3), []
    for (at, turn, axis, slides), value in zip(CHAIN, q):
        r, R = r + R @ at, R @ turn
        e = R @ axis / numpy.linalg.norm(axis)
        r, R = (r + e * value, R) if slides else (r, R @ about(axis, value))
        found.append((R, r, e, slides))
    return found


def test_axes():
    """Points of the arm and their columns: e x (r - origin) of a turn, e of a slide."""
    found, chain, lines = evaluate(ROBOT, STATE)["points"], frames(STATE["q"]), []
    for name, place, last in (("E", (0.011, 0.082, -0.017), 5), ("grip", (0.003, 0.031, 0.002), 6)):
        R, origin, *_ = chain[last]
        r = origin + R @ place
        C = [e if slides else numpy.cross(e, r - r0) for _, r0, e, slides in chain[:last + 1]] + [numpy.zeros(3)] * (6 - last)
        lines += [close(f"r of {name}", found[name]["r"], r, 1e-15), close(f"C of {name}", found[name]["C"], numpy.transpose(C), 2e-15)]
    check(lines)


DOOR = """local rd = require "refdyn"
local p = rd.parameters { { "x", 0.2 }, { "y", -0.5 }, { "z", 0.4 } }
return rd.model { name = "door",
  links = { { "door", joint = "psi", axis = { p.x, p.y, p.z }, mass = 1, inertia = { xx = 0.3, yy = 0.4, zz = 0.5 } } },
  points = { E = { on = "door", at = { 0.3, 0.4, 0.5 } } } }"""


def test_axis_by_parameters(tmp_path):
    """Components are parameters: any direction, along the frame's axes and against them, of any length."""
    lines = []
    (tmp_path / "door.lua").write_text(DOOR)
    for axis in ((0, 0, 1), (0, 0, -3), (0, 2, 0), (0, -1, 0), (-1, 0, 0), (0.3, -0.2, 0.9), (0.3, 0.2, -1e-20), (1e-9, -1e-30, -1)):
        text = [option for name, value in zip("xyz", axis) for option in ("--set", f"{name}={value}")]
        found = evaluate(tmp_path / "door.lua", {"q": [0.7]}, *text)
        R = about(axis, 0.7)
        lines += [close(f"r {axis}", found["points"]["E"]["r"], R @ (0.3, 0.4, 0.5), 3e-16, 1),
                  close(f"M {axis}", found["M"], numpy.array(axis) @ numpy.diag((0.3, 0.4, 0.5)) @ axis / numpy.dot(axis, axis), 1e-15)]
    check(lines)


def emitted(folder, links):
    """The C of links without its remarks and its hash."""
    (folder / "arm.lua").write_text(f"""local rd = require "refdyn"
return rd.model {{ name = "arm", gravity = {{ 0, 0, -9.81 }}, links = {{ {links} }} }}""")
    refdyn("gen", folder / "arm.lua", "-o", folder / "out")
    return re.sub(r'/\*.*?\*/|"\w{16}"|\s', "", (folder / "out" / "arm.c").read_text(), flags=re.S)


BODY = "mass = 1.3, center = { 0.1, 0.2, 0.3 }, inertia = { xx = 0.1, yy = 0.1, zz = 0.1 }"


def test_axis_of_the_frame_costs_nothing(tmp_path):
    """The C is that of the joint about that axis: an axis of the frame, of any length, and by its letter."""
    plain = emitted(tmp_path, f'{{ "a", joint = "theta", {BODY} }}, {{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", {BODY} }}')
    for first, second in (("{ 0, 1, 0 }", "{ 0, 0, 0.2 }"), ('"y"', '"z"')):
        assert plain == emitted(tmp_path, f'{{ "a", joint = "theta", axis = {first}, {BODY} }}, '
                                          f'{{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", axis = {second}, {BODY} }}')
    other = emitted(tmp_path, f'{{ "a", joint = "psi", axis = {{ 0, 3, 0 }}, {BODY} }}, {{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", {BODY} }}')
    assert plain == other.replace("a_psi", "a_theta")


def test_parallel_axes_stay_parallel(tmp_path):
    """The elbow's frame is not turned in that of the shoulder: they are tried with the axes kept."""
    assert "choices: axes of parallel turns" in refdyn("gen", ROBOT, "-o", tmp_path).stdout


# ---- rotors ----

@pytest.mark.parametrize("method", ("recursive", "dense"))
def test_references(method):
    lines = []
    for state in oracle("robot")["states"]:
        found = evaluate(ROBOT, {"q": state["q"], "qd": state["qd"]}, "--accelerations", method)
        lines += [close("M", found["M"], state["M"], 1e-14), close("h + Q", numpy.add(found["h"], found["Q"]), state["f"], 1e-14),
                  close("qdd", found["qdd_free"], state["qdd"], 1e-13)]
    check(lines)


def test_rotor_moves_nothing_else(tmp_path):
    """A joint without mass turns by its rotor alone: I gear^2 qdd = tau; what it carries feels the rotor along its axis only."""
    (tmp_path / "drive.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "drive", links = { { "shaft", joint = "psi", rotor = { psi = { inertia = 2e-4, gear = -50 } } } },
  forces = function(s) return { shaft_psi = 3 } end }""")
    found = evaluate(tmp_path / "drive.lua", {"q": [0.3], "qd": [2]})
    check([close("qdd", found["qdd_free"], [6], 1e-15), close("energy", found["energy"]["kinetic"], 1, 1e-15)])
    assert refdyn("check", tmp_path / "drive.lua").stderr == ""


# ---- accelerations ----

def test_accelerations_of_a_motion(tmp_path):
    """Each row's are those of `eval` at that state; a file without them, as it was written before, is drawn alike."""
    refdyn("sim", ROBOT, "--until", 0.2, "--every", 0.1, "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    names = evaluate(ROBOT)["coordinates"]
    for row in range(3):
        state = {"t": run["t"][row], "q": [run[name][row] for name in names], "qd": [run[name + "_d"][row] for name in names]}
        check([close(f"row {row}", [run[name + "_dd"][row] for name in names], evaluate(ROBOT, state)["qdd"], 1e-12)])
    lines = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()]
    assert lines[0][-7:] == [name + "_dd" for name in names]
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "run.csv").write_text("".join(",".join(line[:-7]) + "\n" for line in lines))
    for folder in (tmp_path, tmp_path / "old"):
        refdyn("plot", folder / "run.csv", "-o", folder / "run.svg")
    assert (tmp_path / "run.svg").read_text() == (tmp_path / "old" / "run.svg").read_text()


def test_taken_names_of_accelerations(tmp_path):
    """Where a course has the name, all accelerations tell their kind; they are none of the inputs in a figure."""
    (tmp_path / "taken.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "taken", gravity = { 0, 0, -9.81 }, links = { { "b", joint = "x, z", mass = 1 } },
  courses = function(s) return { b_z_dd = s.t } end }""")
    refdyn("sim", tmp_path / "taken.lua", "--until", 0.1, "-o", tmp_path / "run.csv")
    assert list(read_run(tmp_path / "run.csv"))[-3:] == ["b_z_dd", "acceleration_b_x_dd", "acceleration_b_z_dd"]
    refdyn("plot", tmp_path / "run.csv", "-o", tmp_path / "run.svg")
    text = (tmp_path / "run.svg").read_text()
    assert "b_z_dd" in text and "acceleration_" not in text


# ---- limits ----

SWING = """local rd = require "refdyn"
return rd.model { name = "swing", links = {
    { "slide", joint = "x", mass = 2, start = { x = 0.1 }, start_rate = { x = 1 }, limits = { x = { from = 0.2, to = 0.5, rate = 0.5, force = 3 } } },
    { "wheel", joint = "psi", mass = 1, inertia = { zz = 1 }, start_rate = { psi = -2 }, limits = { psi = { from = -0.8, rate = 2 } } } },
  constraints = function(s) return { rd.drive { "slide_x", 0.1 + s.t + 2 * s.t^2 } } end }"""


def test_limits_of_a_motion(tmp_path):
    """x = 0.1 + t + 2 t^2 with the force 2 x'' = 8, psi = -2 t: the farthest beyond each limit, its value and time."""
    (tmp_path / "swing.lua").write_text(SWING)
    done = refdyn("sim", tmp_path / "swing.lua", "--until", 0.5, "--every", 0.125, "-o", tmp_path / "run.csv", "--summary", tmp_path / "run.json")
    assert [re.sub(r" at t = \S+ s", "", line) for line in done.stderr.splitlines() if "limits" in line] == [
        "refdyn: warning: slide_x leaves its limits: position 1.1 m, at most 0.5 is allowed",
        "refdyn: warning: slide_x leaves its limits: rate 3 m/s, at most 0.5 is allowed",
        "refdyn: warning: slide_x leaves its limits: force 8 N, at most 3 is allowed",
        "refdyn: warning: wheel_psi leaves its limits: position -1 rad, at least -0.8 is allowed"]
    found = json.loads((tmp_path / "run.json").read_text())["limits"]
    assert [(each["coordinate"], each["limit"], each["allowed"]) for each in found] == [
        ("slide_x", "position", 0.5), ("slide_x", "rate", 0.5), ("slide_x", "force", 3), ("wheel_psi", "position", -0.8)]
    check([close("values", [each["value"] for each in found], [1.1, 3, 8, -1], 1e-9),
           close("t", [found[i]["t"] for i in (0, 1, 3)], [0.5, 0.5, 0.5], 0)])
    lower = refdyn("sim", tmp_path / "swing.lua", "--until", 0.05, "--every", 0.05, "-o", tmp_path / "run.csv").stderr
    assert "slide_x leaves its limits: position 0.1 m at t = 0 s, at least 0.2 is allowed" in lower


def test_limits_elsewhere(tmp_path):
    """They are told by `check`, stand in the C, and change nothing else there."""
    (tmp_path / "swing.lua").write_text(SWING)
    text = refdyn("check", tmp_path / "swing.lua").stdout
    assert "slide_x [m] on the ground, starts at 0.1, limits from 0.2 to 0.5 rate 0.5 force 3\n" in text
    assert "wheel_psi [rad] on the ground, starts at 0, limits from -0.8 rate 2\n" in text
    (tmp_path / "free.lua").write_text(re.sub(r", limits = \{ \w+ = \{.*?\} \}", "", SWING))
    for name in ("swing", "free"):
        refdyn("gen", tmp_path / f"{name}.lua", "-o", tmp_path / name)
    table = ("const struct refdyn_limits swing_limits[2] = {\n    {0, 0.2, 0.5, 0.5, 3.0},\n"
             "    {1, -0.8, HUGE_VAL, 2.0, HUGE_VAL},\n};\n\n")
    limited, free = ((tmp_path / name / "swing.c").read_text() for name in ("swing", "free"))
    assert table in limited and re.sub(r'"\w{16}"', "", limited.replace(table, "")) == re.sub(r'"\w{16}"', "", free)
    assert "limits" not in (tmp_path / "free" / "swing.h").read_text()
