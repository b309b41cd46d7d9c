"""Features of robots: joint axes in any direction, rotors, limits, angular velocities, orientations. Values by hand, in numpy, and by
Pinocchio (make_robot_references.py)."""
import json
import re

import numpy
import pytest
from numpy import cos, sin

from program import REFERENCE, TESTS, check, close, evaluate, motion, oracle, read_run, refdyn
from test_features import rotation

ROBOT = TESTS / "models" / "robot.lua"
STATE = {"t": 0.3, "q": [0.37, -0.82, 1.13, -0.46, 0.71, 1.94, 0.023], "qd": [0.61, -1.27, 0.83, 1.71, -0.94, 2.13, -0.38]}
ACROSS = (0.12, 0.97, -0.05)
# Placement of each frame in the one before, and its joint: position, turn of the placement, axis, is it a slide?
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
    """Rotation, origin, and the joint's axis and whether it slides, of each frame in the ground's axes."""
    R, r, found = numpy.eye(3), numpy.zeros(3), []
    for (at, turn, axis, slides), value in zip(CHAIN, q):
        r, R = r + R @ at, R @ turn
        e = R @ axis / numpy.linalg.norm(axis)
        r, R = (r + e * value, R) if slides else (r, R @ about(axis, value))
        found.append((R, r, e, slides))
    return found


def test_axes():
    """Points of the arm and their columns: e x (r - origin) for a turn, e for a slide."""
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
    """The components are parameters: any direction, along the frame's axes and against them, of any length."""
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
    """The C of links without its comments and its hash."""
    (folder / "arm.lua").write_text(f"""local rd = require "refdyn"
return rd.model {{ name = "arm", gravity = {{ 0, 0, -9.81 }}, links = {{ {links} }} }}""")
    refdyn("gen", folder / "arm.lua", "-o", folder / "out")
    return re.sub(r'/\*.*?\*/|"\w{16}"|\s', "", (folder / "out" / "arm.c").read_text(), flags=re.S)


BODY = "mass = 1.3, center = { 0.1, 0.2, 0.3 }, inertia = { xx = 0.1, yy = 0.1, zz = 0.1 }"


def test_axis_of_the_frame_costs_nothing(tmp_path):
    """The C equals that of the joint about that axis: an axis of the frame, of any length, and by its letter."""
    plain = emitted(tmp_path, f'{{ "a", joint = "theta", {BODY} }}, {{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", {BODY} }}')
    for first, second in (("{ 0, 1, 0 }", "{ 0, 0, 0.2 }"), ('"y"', '"z"')):
        assert plain == emitted(tmp_path, f'{{ "a", joint = "theta", axis = {first}, {BODY} }}, '
                                          f'{{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", axis = {second}, {BODY} }}')
    other = emitted(tmp_path, f'{{ "a", joint = "psi", axis = {{ 0, 3, 0 }}, {BODY} }}, {{ "b", on = "a", at = {{ 0.3, 0.1, 0 }}, joint = "z", {BODY} }}')
    assert plain == other.replace("a_psi", "a_theta")


def test_parallel_axes_stay_parallel(tmp_path):
    """The elbow's frame is not turned relative to the shoulder's: the generator tries frames that keep their axes."""
    assert "choices: axes of parallel turns" in refdyn("gen", ROBOT, "-o", tmp_path).stdout


# ---- rotors ----

@pytest.mark.parametrize("method", ("recursive", "dense"))
def test_references(method):
    lines = []
    for state in oracle("robot")["states"]:
        found = evaluate(ROBOT, {"q": state["q"], "qd": state["qd"], "qdd": state["qdd_given"]}, "--accelerations", method)
        lines += [close("inverse", found["inverse"], state["inverse"], 1e-14),
                  close("M", found["M"], state["M"], 1e-14), close("h + Q", numpy.add(found["h"], found["Q"]), state["f"], 1e-14),
                  close("qdd", found["qdd_free"], state["qdd"], 1e-13)]
    check(lines)


def test_rotor_moves_nothing_else(tmp_path):
    """A massless joint turns by its rotor alone: I gear^2 qdd = tau; the links that it carries feel the rotor only along its axis."""
    (tmp_path / "drive.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "drive", links = { { "shaft", joint = "psi", rotor = { psi = { inertia = 2e-4, gear = -50 } } } },
  forces = function(s) return { shaft_psi = 3 } end }""")
    found = evaluate(tmp_path / "drive.lua", {"q": [0.3], "qd": [2]})
    check([close("qdd", found["qdd_free"], [6], 1e-15), close("energy", found["energy"]["kinetic"], 1, 1e-15)])
    assert refdyn("check", tmp_path / "drive.lua").stderr == ""


# ---- accelerations ----

def test_accelerations_of_a_motion(tmp_path):
    """Each row equals `eval` at this state, for coordinates and for points with accelerations; a file without them, in the older form, is
    drawn alike."""
    refdyn("sim", ROBOT, "--until", 0.2, "--every", 0.1, "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    names = evaluate(ROBOT)["coordinates"]
    for row in range(3):
        state = {"t": run["t"][row], "q": [run[name][row] for name in names], "qd": [run[name + "_d"][row] for name in names]}
        check([close(f"row {row}", [run[name + "_dd"][row] for name in names], evaluate(ROBOT, state)["qdd"], 1e-12)])
    lines = [line.split(",") for line in (tmp_path / "run.csv").read_text().splitlines()]
    angular = [f"{point}_w{axis}{rate}" for point in ("E", "grip") for rate in ("", "d") for axis in "xyz"]
    assert lines[0][-19:] == [name + "_dd" for name in names] + angular
    J = numpy.array(evaluate(ROBOT, state)["points"]["E"]["J"])[3:]
    drift = evaluate(ROBOT, state)["points"]["E"]["Jd_qd"][3:]
    qdd = [run[name + "_dd"][row] for name in names]
    check([close("w", [run[name][row] for name in angular[:3]], J @ state["qd"], 1e-13),
           close("wd", [run[name][row] for name in angular[3:6]], J @ qdd + drift, 1e-12)])
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "run.csv").write_text("".join(",".join(line[:-19]) + "\n" for line in lines))
    for folder in (tmp_path, tmp_path / "old"):
        refdyn("plot", folder / "run.csv", "-o", folder / "run.svg")
    assert (tmp_path / "run.svg").read_text() == (tmp_path / "old" / "run.svg").read_text()


def test_taken_names_of_accelerations(tmp_path):
    """If a course has the name, all accelerations have the ending of their kind; a figure does not show them as inputs."""
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


def test_times_of_warnings_are_short(tmp_path):
    """The largest rate of an oscillator is at the end of the motion, at output 95 of 0.005 s, which is 0.47500000000000003 s."""
    (tmp_path / "mass.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "mass", gravity = { 0, 0, 0 }, links = {
  { "a", joint = "x", mass = 1, spring = { x = (rd.pi / 0.95)^2 }, start = { x = 1 }, limits = { x = { rate = 1 } } } } }""")
    said = refdyn("sim", tmp_path / "mass.lua", "--until", 95 * 0.005, "--every", 0.005, "--method", "rk4", "--step", 0.005, "-o", tmp_path / "run.csv").stderr
    assert " at t = 0.475 s; allowed is at least -1; beyond for " in said and 95 * 0.005 != 0.475
    (tmp_path / "fall.lua").write_text("""local rd = require "refdyn"
return rd.model { name = "fall", gravity = { 0, 0, -9.81 }, links = { { "a", joint = "z", mass = 1, limits = { z = { from = -1 } } } } }""")
    said = refdyn("sim", tmp_path / "fall.lua", "--until", 20, "--every", 10, "-o", tmp_path / "run.csv").stderr
    assert " -1962 m at t = 20 s; allowed is at least -1; beyond for 19.5 s, from t = 0.45152" in said


def test_limits_of_a_motion(tmp_path):
    """x = 0.1 + t + 2 t^2 with the force 2 x'' = 8, psi = -2 t: the largest excess over each limit, its value and time."""
    (tmp_path / "swing.lua").write_text(SWING)
    done = refdyn("sim", tmp_path / "swing.lua", "--until", 0.5, "--every", 0.125, "-o", tmp_path / "run.csv", "--summary", tmp_path / "run.json")
    assert [re.sub(r" at t = \S+ s|; beyond for .*", "", line) for line in done.stderr.splitlines() if "limits" in line] == [
        "refdyn: warning: slide_x exceeds its limits: 1.1 m; allowed is at most 0.5",
        "refdyn: warning: slide_x_d exceeds its limits: 3 m/s; allowed is at most 0.5",
        "refdyn: warning: force_slide_x exceeds its limits: programme force 8 N; allowed is at most 3",
        "refdyn: warning: wheel_psi exceeds its limits: -1 rad; allowed is at least -0.8"]
    found = json.loads((tmp_path / "run.json").read_text())["limits"]
    assert [(each["name"], each["from"], each["to"]) for each in found] == [
        ("slide_x", 0.2, 0.5), ("slide_x_d", -0.5, 0.5), ("force_slide_x", -3, 3), ("wheel_psi", -0.8, None), ("wheel_psi_d", -2, 2)]
    check([close("values", [each["violation"] for each in found], [0.6, 2.5, 5, 0.2, 0], 1e-9),
           close("t", [found[i]["t"] for i in (0, 1, 2, 3)], [0, 0, 0, 0.4], 1e-8), close("t", [found[i]["t_largest"] for i in (0, 1)], [0.5, 0.5], 0),
           close("duration", [found[i]["duration"] for i in (1, 2, 3)], [0.5, 0.5, 0.1], 1e-8)])
    lower = refdyn("sim", tmp_path / "swing.lua", "--until", 0.05, "--every", 0.05, "-o", tmp_path / "run.csv").stderr
    assert "slide_x exceeds its limits: 0.1 m at t = 0 s; allowed is at least 0.2; beyond for 0.05 s, from t = 0 s on" in lower


def test_limits_elsewhere(tmp_path):
    """`check` reports them, the C contains them, and nothing else changes there."""
    (tmp_path / "swing.lua").write_text(SWING)
    text = refdyn("check", tmp_path / "swing.lua").stdout
    assert "slide_x [m] on the ground, starts at 0.1, limits from 0.2 to 0.5 rate 0.5 force 3\n" in text
    assert "wheel_psi [rad] on the ground, starts at 0, limits from -0.8 rate 2\n" in text
    (tmp_path / "free.lua").write_text(re.sub(r", limits = \{ \w+ = \{.*?\} \}", "", SWING))
    for name in ("swing", "free"):
        refdyn("gen", tmp_path / f"{name}.lua", "-o", tmp_path / name)
    table = ("const struct refdyn_limits swing_limits[2] = {\n    {0, 0.2, 0.5, 0.5, 3.0},\n"
             "    {1, -0.8, 1 / 0.0, 2.0, 1 / 0.0},\n};\n\n")
    limited, free = ((tmp_path / name / "swing.c").read_text() for name in ("swing", "free"))
    assert table in limited and re.sub(r'"\w{16}"', "", limited.replace(table, "")) == re.sub(r'"\w{16}"', "", free)
    assert "limits" not in (tmp_path / "free" / "swing.h").read_text()


# ---- angular velocities and orientations ----

def robot_with(folder, constraints):
    path = folder / "robot_with.lua"
    path.write_text(ROBOT.read_text().replace("  points = {", "  constraints = function(s) local E = s.points.E\n"
                                              f"    return {{ {constraints} }} end,\n  points = {{", 1))
    return path


def test_angular_velocity(tmp_path):
    """u of rows on w and wd is the angular part of the Jacobian, v its rate times qd; for a point and for its link."""
    path, lines = robot_with(tmp_path, "rd.velocity { E.wx }, rd.acceleration { E.wyd }, rd.velocity { s.axes.wrist_3.wz }"), []
    for state in oracle("robot")["states"]:
        found, point = evaluate(path, {"q": state["q"], "qd": state["qd"]}), state["points"]["E"]
        w = numpy.array(point["J"][3:]) @ state["qd"]
        lines += [close("u", found["u"], point["J"][3:], 1e-14, 1), close("v", found["v"], point["Jd_qd"][3:], 1e-13),
                  close("w", [found["psi"][0], found["psi"][2]], [w[0], w[2]], 1e-14)]
    check(lines)


def test_spatial_jacobian():
    lines = []
    for state in oracle("robot")["states"]:
        found = evaluate(ROBOT, {"q": state["q"], "qd": state["qd"]})["points"]
        for name, point in state["points"].items():
            lines += [close(f"J of {name}", found[name]["J"], point["J"], 1e-14), close(f"Jd_qd of {name}", found[name]["Jd_qd"], point["Jd_qd"], 1e-13)]
    assert "J" not in evaluate(REFERENCE)["points"]["E"]
    check(lines)


def test_spatial_jacobian_behind_equal_links(tmp_path):
    """In loops over elements and written out."""
    path = tmp_path / "runs.lua"
    path.write_text((TESTS / "models" / "runs.lua").read_text().replace("at = { 0.2, 0, 0 } } } },", "at = { 0.2, 0, 0 }, angular = true } } },"))
    q = [0.1 * i - 0.4 for i in range(9)]
    state, options = {"q": q, "qd": [1 - value for value in q]}, ["--set", "kind=skew", "--set", "rfe=9", "--accelerations", "recursive"]
    one, other = (evaluate(path, state, *options, "--loops", loops)["points"]["E"] for loops in ("always", "never"))
    w = 9 * [numpy.array((0.3, 0.8, -0.2)) / numpy.linalg.norm((0.3, 0.8, -0.2))]
    check([close("J", one["J"], other["J"], 1e-14), close("Jd_qd", one["Jd_qd"], other["Jd_qd"], 1e-13),
           close("angular", one["J"][3:], numpy.transpose(w), 1e-14)])


def turned(angles):
    return rotation("z", angles[0]) @ rotation("y", angles[1]) @ rotation("x", angles[2])


def test_path_in_space(tmp_path):
    """E moves along a curve while its axes turn as given: position and orientation to 1e-12, by six rows."""
    names, start = evaluate(ROBOT)["coordinates"], evaluate(ROBOT)
    place = rotation("z", 0.3) @ rotation("x", -0.4)
    R = frames([0.2, -0.7, 0.9, -0.3, 0.4, 1.1, 0.012])[5][0] @ place
    r = start["points"]["E"]["r"]
    first = [float(angle) for angle in (numpy.arctan2(R[1, 0], R[0, 0]), -numpy.arcsin(R[2, 0]), numpy.arctan2(R[2, 1], R[2, 2]))]
    angles = [f"{float(first[0])!r} + 0.4 * (1 - rd.cos(2 * s.t))", f"{float(first[1])!r} - 0.3 * s.t^2", f"{float(first[2])!r} + 0.2 * s.t^3"]
    path = robot_with(tmp_path, f"""
      rd.position {{ E.x - {float(r[0])!r} - 0.05 * s.t^2 }}, rd.position {{ E.y - {float(r[1])!r} }}, rd.position {{ E.z - {float(r[2])!r} - 0.04 * (1 - rd.cos(3 * s.t)) }},
      rd.orientation {{ "E", {{ {{ "z", {angles[0]} }}, {{ "y", {angles[1]} }}, {{ "x", {angles[2]} }} }}, alpha = 20, beta = 20 }}""")
    run, _, summary = motion(path, "--until", 1, "--every", 0.25, "--tol", 1e-8)
    lines = [close("phi", summary["phi_max"], 0, 1e-12, 1)]
    for row, t in enumerate(run["t"]):
        R, origin, *_ = frames([run[name][row] for name in names])[5]
        wanted = turned((first[0] + 0.4 * (1 - cos(2 * t)), first[1] - 0.3 * t**2, first[2] + 0.2 * t**3))
        lines += [close(f"R at {t}", R @ place, wanted, 1e-12, 1),
                  close(f"r at {t}", origin + R @ (0.011, 0.082, -0.017), (r[0] + 0.05 * t**2, r[1], r[2] + 0.04 * (1 - cos(3 * t))), 1e-12, 1)]
    check(lines)


BODY_FREE = """local rd = require "refdyn"
return rd.model {{ name = "body", links = {{ {{ "a", joint = "free", mass = 1, start = {{ psi = {psi}, theta = {theta} }},
    inertia = {{ xx = 0.3, yy = 0.4, zz = 0.5 }} }} }}, points = {{ E = "a" }},
  constraints = function(s) return {{ rd.orientation {{ "a", {{}}, name = "level" }} }} end }}"""


@pytest.mark.parametrize("psi, theta", [(3, 0.02), (-2.2, 0.9), (1e-7, 0)])
def test_orientation_has_one_solution(psi, theta, tmp_path):
    """phi = 2 tan(angle / 2) about the axis; a projected start ends at the target, also from far away."""
    (tmp_path / "body.lua").write_text(BODY_FREE.format(psi=psi, theta=theta))
    R = turned((psi, theta, 0))
    sine = numpy.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    angle = numpy.arctan2(numpy.linalg.norm(sine), numpy.trace(R) - 1)
    found = evaluate(tmp_path / "body.lua")["phi"]
    run, _, _ = motion(tmp_path / "body.lua", "--until", 0.1, "--every", 0.1, "--start", "project")
    check([close("phi", found, 2 * numpy.tan(angle / 2) * sine / numpy.linalg.norm(sine), 1e-12),
           close("R", turned([run[f"a_{name}"][0] for name in ("psi", "theta", "phi")]), numpy.eye(3), 1e-9, 1)])


def test_orientation_at_half_a_turn(tmp_path):
    """There the rows have no value, and the motion does not begin."""
    (tmp_path / "body.lua").write_text(BODY_FREE.format(psi="rd.pi", theta=0))
    said = refdyn("sim", tmp_path / "body.lua", "--until", 1, "-o", tmp_path / "run.csv", status=3).stderr
    assert "level" in said, said
