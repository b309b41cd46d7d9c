"""`refdyn import`: robots of robots/ compared with Pinocchio's values, links as beams, names, and every refused file."""
import json
import math
import pathlib
import re
import sys

import numpy
import pytest

from program import LONG, TESTS, check, close, evaluate, oracle, read_run, refdyn

ROBOTS = TESTS / "robots"
REFERENCES = oracle("import")
TOLERANCE = 1e-12

HEAD = '<robot name="r">\n'
MASS = '<inertial><mass value="2"/><inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.5"/></inertial>'
PAIR = f'<link name="a"/>\n<link name="b">{MASS}</link>\n'


def joint(inside="", name="j", kind="continuous", parent="a", child="b"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>\n'


def imported(folder, text, *arguments, status=0, name="r.urdf"):
    """The model's text, and the messages."""
    (folder / name).write_text(text) if isinstance(text, str) else (folder / name).write_bytes(text)
    done = refdyn("import", name, "-o", "r.lua", *arguments, cwd=folder, status=status)
    return (folder / "r.lua").read_text() if status == 0 else None, done.stderr


def model_of(folder, text, *arguments):
    imported(folder, text, *arguments)
    return folder / "r.lua"


def undamped(model):
    """Pinocchio's values have no damping."""
    model.write_text(re.sub(r"damper = \{[^}]*\},?", "", model.read_text()))
    return model


def compare(model, coordinates, state):
    """Lines about differences from Pinocchio at a state of robot `coordinates`."""
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


# ---- Links as beams ----

BEAM = ["--section", "tube:0.043:0.031", "--E", "7.1e10"]
OBLIQUE = ["--tip", "0.13,-0.27,0.19"]
BEAMS = {"upper of two": ("two", "upper", []), "fore of seven": ("seven", "fore", OBLIQUE + ["--rfe", "2", "--section", "rectangle:0.05:0.021"])}
if LONG:
    BEAMS |= {"fore of two": ("two", "fore", OBLIQUE), "column of seven": ("seven", "column", []),
              "carriage of seven": ("seven", "carriage", ["--tip", "0,0,-0.4", "--rfe", "7", "--section", "round:0.017"])}


def with_beam(folder, robot, link, more):
    section = BEAM[2:] if "--section" in more else BEAM
    return undamped(model_of(folder, (ROBOTS / f"{robot}.urdf").read_text(), "--flexible", link, *section, *more))


@pytest.mark.parametrize("which", BEAMS)
def test_straight_beam_is_the_link(which, tmp_path):
    """Mass, centre and inertia of a beam and its rest equal the link's, and the links that it carries keep their places."""
    robot, link, more = BEAMS[which]
    model, rigid = with_beam(tmp_path, robot, link, more), REFERENCES[robot]
    own = json.loads(refdyn("eval", model).stdout)["coordinates"]
    place = [own.index(name) for name in rigid["coordinates"]]
    assert len(own) > len(place)
    for state in rigid["states"]:
        q, qd = numpy.zeros((2, len(own)))
        q[place], qd[place] = state["q"], state["qd"]
        found = evaluate(model, {"q": q.tolist(), "qd": qd.tolist()})
        check([close("M", numpy.array(found["M"])[numpy.ix_(place, place)], state["M"], TOLERANCE),
               close("h + Q", numpy.add(found["h"], found["Q"])[place], state["f"], TOLERANCE)])


def test_stiff_beam_tends_to_the_link(tmp_path):
    """Joint forces against gravity differ from the rigid robot's in proportion to 1/E."""
    text = (ROBOTS / "two.urdf").read_text().replace('<axis xyz="0 0 1"/>', '<axis xyz="0.3 -0.5 0.2"/>')
    rigid = json.loads(refdyn("statics", model_of(tmp_path, text)).stdout)["hold_force"]
    flexible, errors = model_of(tmp_path, text, "--flexible", "upper", *BEAM), []
    for E in "7.1e9", "7.1e15":
        found = json.loads(refdyn("statics", flexible, "--set", f"E={E}").stdout)["hold_force"]
        errors.append(numpy.abs(numpy.subtract(found, rigid)).max() / numpy.abs(rigid).max())
    assert 1e-3 < errors[0] < 0.1 and 0.9e6 < errors[0] / errors[1] < 1.1e6, errors


@pytest.mark.quick
def test_given_density(tmp_path):
    text = (ROBOTS / "two.urdf").read_text()
    model, said = imported(tmp_path, text, "--flexible", "upper", *BEAM, "--rho", "431")
    length = float(re.search(r"length = ([\d.e-]+)", model).group(1))
    mass = 431 * math.pi / 4 * (0.043**2 - 0.031**2) * length
    whole, rest = (float(number) for number in re.search(r"of ([\d.]+) kg, rho 431 kg/m\^3; the rest, ([\d.]+) kg", said).groups())
    assert abs(whole - rest - mass) < 1e-5 * whole and "rho = 431," in model
    said = imported(tmp_path, text, "--flexible", "upper", *BEAM, "--rho", "1e5", status=1)[1]
    most = float(re.fullmatch(r"r\.urdf:\d+: link upper: a beam with rho 100000 kg/m\^3 has [\d.]+ kg and leaves a body that cannot exist; "
                              r"rho must be less than ([\d.]+) kg/m\^3\n", said).group(1))
    imported(tmp_path, text, "--flexible", "upper", *BEAM, "--rho", str(0.9999 * most))
    imported(tmp_path, text, "--flexible", "upper", *BEAM, "--rho", str(1.0001 * most), status=1)


LINE = PAIR + joint()
NO_BEAM = {
    "leaf": (LINE, "b", [], "r.urdf:3: link b: it carries nothing; add --tip x,y,z"),
    "no length": (LINE, "a", [], "r.urdf:2: link a: its tip is its origin; add --tip x,y,z"),
    "no mass": (LINE, "a", OBLIQUE, "r.urdf:2: link a: has no mass; a beam needs it"),
    "two tips": (PAIR + joint('<origin xyz="1 0 0"/>') + '<link name="c"/>' + joint('<origin xyz="0 2 0"/>', "k", child="c"), "a", [],
                 "r.urdf:2: link a: joints j and k begin at different places; add --tip x,y,z"),
    "point": (LINE.replace("0.3", "1e-12").replace("0.4", "1e-12").replace("0.5", "1e-12"), "b", OBLIQUE,
              "r.urdf:3: link b: a body with this mass and inertia cannot contain a beam of 0.354824 m"),
    "unknown": (LINE, "bb", OBLIQUE, "r.urdf: --flexible: there is no link 'bb'; did you mean \"b\"?"),
}


@pytest.mark.parametrize("which", NO_BEAM)
def test_links_that_are_no_beams(which, tmp_path):
    links, link, more, message = NO_BEAM[which]
    said = imported(tmp_path, HEAD + links + "</robot>", "--flexible", link, *BEAM, *more, status=1)[1]
    assert said == message + "\n" and not (tmp_path / "r.lua").exists()


WRONG_USE = {
    "--section: applies to beams only; add --flexible LINK": ["--section", "round:1"], "--rfe: applies to beams only; add --flexible LINK": ["--rfe", "3"],
    "--flexible: add --section": ["--flexible", "b", "--E", "1e9"], "--flexible: add --E": ["--flexible", "b", "--section", "round:1"],
    "--nu: '0.6' must be a number above -1 and at most 0.5": ["--flexible", "b", *BEAM, "--nu", "0.6"],
    "--eta: '-1' must be a number of at least 0": ["--flexible", "b", *BEAM, "--eta", "-1"], "--tip: '1,2' is not of the form x,y,z": ["--flexible", "b", *BEAM, "--tip", "1,2"],
    "--tip: applies to one link; --flexible has several": ["--flexible", "a,b", *BEAM, "--tip", "1,2,3"],
    **{f"--section: '{shape}' is not one of round:DIAMETER, tube:OUTER:INNER, rectangle:WIDTH_Y:HEIGHT_Z": ["--flexible", "b", "--E", "1e9", "--section", shape]
       for shape in ("round", "round:", "round:0", "round:1:2", "tube:1", "tube:1:0", "rectangle:1", "rectangle:1:-1", "box:1:1", "round:nan", "round:1e-90")},
    **{f"--section: '{shape}' has an inner diameter that is not smaller than the outer one; write tube:OUTER:INNER": ["--flexible", "b", "--E", "1e9", "--section", shape]
       for shape in ("tube:1:1", "tube:1:2")},
}


@pytest.mark.parametrize("message", WRONG_USE)
def test_wrong_use(message, tmp_path):
    said = imported(tmp_path, HEAD + LINE + "</robot>", *WRONG_USE[message], status=2)[1]
    assert said.splitlines()[0] == f"refdyn import: {message}" and not (tmp_path / "r.lua").exists()


# ---- Other data of a joint ----

def test_damping_and_friction(tmp_path):
    text = (ROBOTS / "gripper.urdf").read_text()
    names, states = REFERENCES["gripper"]["coordinates"], REFERENCES["gripper"]["states"]
    model, said = imported(tmp_path, text, "--friction-width", "0.37")
    assert "friction" not in said
    own = json.loads(refdyn("eval", tmp_path / "r.lua").stdout)["coordinates"]
    place = [names.index(name) for name in own]
    for state in states:
        q, qd, f = ([state[key][i] for i in place] for key in ("q", "qd", "f"))
        found = evaluate(tmp_path / "r.lua", {"q": q, "qd": qd})
        for name, damping, level in ("wrist_psi", 0.137, 0.42), ("left_y", 3.21, 1.7):
            i = own.index(name)
            f[i] -= damping * qd[i] + level * math.tanh(qd[i] / 0.37)
        check([close("h + Q", numpy.add(found["h"], found["Q"]), f, TOLERANCE)])


def test_joints_that_follow(tmp_path):
    """right = -1.25 left + 0.0042, cover = 3.7 right; left starts at the centre of its range, which does not contain 0."""
    model = model_of(tmp_path, (ROBOTS / "gripper.urdf").read_text(), "--friction-width", "0.37")
    own = json.loads(refdyn("eval", model).stdout)["coordinates"]
    psi, left, right, cover = (own.index(name) for name in ("wrist_psi", "left_y", "right_y", "cover_psi"))
    start = evaluate(model)
    assert max(map(abs, start["phi"])) < 1e-16 and start["u"][0][left] == 1.25 and start["u"][1][right] == -3.7
    q = [0.0] * 4
    q[psi], q[left], q[right], q[cover] = 0.3, 0.07, -0.11, 0.9
    check([close("phi", evaluate(model, {"q": q})["phi"], [-0.11 + 1.25 * 0.07 - 0.0042, 0.9 + 3.7 * 0.11], 1e-15)])
    assert 'start = { y = 0.05 }' in model.read_text()


@pytest.mark.quick
def test_limits(tmp_path):
    """As in the emitted C, where omitted limits are infinite."""
    text = HEAD + PAIR + '<link name="c"/><link name="d"/>' + "".join((
        joint('<limit lower="-1.25" upper="2.5" velocity="3.5" effort="47"/>', kind="revolute"), joint('<limit lower="-1" upper="1" effort="7"/>', "k", child="c"),
        joint('<limit upper="1.5" velocity="0"/>', "l", "prismatic", child="d"))) + "</robot>"
    model, _ = imported(tmp_path, text)
    assert "limits = { phi = { from = -1.25, to = 2.5, rate = 3.5, force = 47 } }" in model
    assert "limits = { phi = { force = 7 } }" in model and "limits = { x = { from = 0, to = 1.5 } }" in model
    refdyn("check", tmp_path / "r.lua")


def test_floating_root(tmp_path):
    """It equals a floating joint between the ground and the root."""
    text = (ROBOTS / "two.urdf").read_text()
    other = text.replace('<link name="base">', '<link name="world"/>\n' + joint(kind="floating", parent="world", child="base") + '<link name="base">')
    found = [json.loads(refdyn("eval", model_of(tmp_path, *arguments)).stdout) for arguments in ((text, "--floating"), (other,))]
    assert found[0]["coordinates"][:6] == ["base_x", "base_y", "base_z", "base_psi", "base_theta", "base_phi"] and found[0] == found[1]


IMPOSSIBLE = {
    "triangle": ("0.3 0.4 0.9 0 0 0", "0.4 0.5 0.9 with 0 0 0"), "negative": ("-0.1 0.3 0.3 0 0 0", "0 0.35 0.35 with 0 0 0"),
    "products": ("0.4 0.4 0.4 0.5 0 0", "0.55 0.55 0.7 with 0.35 0 0"), "products alone": ("0 0 0 0.2 0 0", "0.1 0.1 0.2 with 0.1 0 0"),
}


@pytest.mark.parametrize("which", IMPOSSIBLE)
def test_impossible_inertia(which, tmp_path):
    """It becomes the nearest possible one, which the generator accepts."""
    numbers, mended = IMPOSSIBLE[which]
    given = numbers.split()
    inertia = " ".join(f'{name}="{number}"' for name, number in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), given))
    text = HEAD + re.sub("<inertia .*?/>", f"<inertia {inertia}/>", PAIR) + joint() + "</robot>"
    said = imported(tmp_path, text)[1]
    assert said.startswith(f"r.urdf:3: warning: link b: no body has the moments {' '.join(given[:3])} with the products {' '.join(given[3:])}; "
                           f"the nearest possible ones replace them: {mended}\n"), said
    refdyn("check", tmp_path / "r.lua")


@pytest.mark.parametrize("none", ["0", "-1e-20"])
def test_moments_of_plane_robots(none, tmp_path):
    """A link that turns about one axis may have only the moment about that axis."""
    text = HEAD + PAIR.replace('ixx="0.3"', f'ixx="{none}"').replace('iyy="0.4"', 'iyy="0"') + joint('<axis xyz="0 0 1"/>') + "</robot>"
    model, said = imported(tmp_path, text)
    assert "warning" not in said and "inertia = { zz = 0.5 }" in model
    refdyn("check", tmp_path / "r.lua")


# ---- Drives and points ----

ARM = (PAIR + joint('<limit lower="-1" upper="1" effort="47.5"/><dynamics friction="0.3"/>', kind="revolute") + f'<link name="flange"/><link name="tool">{MASS}</link>'
       + f'<link name="slide">{MASS}</link><link name="cart">{MASS}</link>'
       + joint('<origin xyz="0 0 1"/>', "f", "fixed", "b", "flange") + joint("", "t", "fixed", "flange", "tool")
       + joint('<axis xyz="0 1 0"/>', "s", "prismatic", "tool", "slide")
       + joint('<axis xyz="0 0 1"/><mimic joint="s" multiplier="-1.5"/>', "c", "prismatic", "tool", "cart"))


@pytest.mark.quick
def test_drives(tmp_path):
    """An input for each joint that follows no other, which acts up to the joint's effort."""
    model, said = imported(tmp_path, HEAD + ARM + "</robot>", "--drives", "--friction-width", "0.1")
    assert said.splitlines()[-1] == "6 links, 5 joints, 3 coordinates without those of beams, 2 inputs"
    assert 'rd.input("tau_b_phi", 0, "N m")\nrd.input("f_slide_y", 0, "N")\n' in model and model.count("rd.input") == 2
    assert '\nlocal driven = rd.option("driven", false)\n' in model and '  drives = driven and { "b_phi", "slide_y" } or nil,\n' in model
    path = tmp_path / "r.lua"
    refdyn("sim", path, "--set", "tau_b_phi=-61.3", "--until", "0.01", "-o", tmp_path / "run.csv")
    run = read_run(tmp_path / "run.csv")
    assert (run["tau_b_phi"] == -61.3).all() and (run["tau_b_phi_applied"] == -47.5).all() and "f_slide_y_applied" not in run
    own = json.loads(refdyn("eval", path).stdout)["coordinates"]
    turn, slide, cart = (own.index(name) for name in ("b_phi", "slide_y", "cart_z"))
    rest = evaluate(path)["Q"]
    for torque, force in (31.7, -613), (-90, 1e6), (90, 0.3):
        moved = numpy.subtract(evaluate(path, {"inputs": {"tau_b_phi": torque, "f_slide_y": force}})["Q"], rest)
        check([close("Q", moved[[turn, slide, cart]], [max(-47.5, min(47.5, torque)), force, 0], 1e-15)])
    assert "rd.input" not in imported(tmp_path, HEAD + ARM + "</robot>")[0]


def test_drives_perform_a_programme(tmp_path):
    """The imported robot, with a course of its tool added: the joints' drives perform it, each within the limit of its joint."""
    text = HEAD + ('<link name="a"/><link name="l"><inertial><origin xyz="0.4 0 0"/><mass value="5"/><inertia ixx="0.1" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
                   '<joint name="j" type="revolute"><parent link="a"/><child link="l"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1.5" velocity="9"/></joint></robot>')
    model, _ = imported(tmp_path, text, "--drives")
    changed = model.replace("  hold = ", '  constraints = function(s) return { rd.position { s.q.l_psi - 0.7 * rd.smoothstep(s.t, 0, 1, 7) } } end,\n  hold = ')
    (tmp_path / "course.lua").write_text(changed)
    done = refdyn("sim", tmp_path / "course.lua", "--set", "driven=true", "--realise", "--until", 1, "--every", 1e-3, "-o", tmp_path / "run.csv", "--summary", tmp_path / "run.json")
    largest = json.loads((tmp_path / "run.json").read_text())["realise"]["peak"]["l_psi"]
    exact = 0.7 * (0.3 + 5 * 0.16) * 84 / (5**0.5 * 5)  # f'' = 420 x^2 (1 - x)^2 (1 - 2 x), largest at x = (1 - 1/sqrt(5))/2
    assert "compares only" not in done.stderr and "drive_l_psi exceeds its limits" in done.stderr
    assert abs(largest / exact - 1) < 1e-3, (largest, exact)


def test_no_drive_for_several_coordinates(tmp_path):
    _, said = imported(tmp_path, HEAD + LINE.replace("continuous", "planar") + "</robot>", "--drives")
    assert said == ("r.urdf:4: warning: joint j: has several coordinates; they get no inputs\n"
                    "2 links, 1 joint, 3 coordinates without those of beams, 0 inputs\n")


def test_points_of_frames_and_slides(tmp_path):
    """A frame such as a tool's becomes a point although it carries something; no point has the columns of a slide."""
    model, _ = imported(tmp_path, HEAD + ARM + "</robot>")
    assert 'points = { flange = "flange", slide_end = "slide", cart_end = "cart" }' in model
    assert refdyn("check", tmp_path / "r.lua").stderr == ""
    root = '<link name="world"/><link name="base"/>' + joint(name="w", kind="fixed", parent="world", child="base") + joint(name="k", kind="fixed", parent="base", child="a")
    model, _ = imported(tmp_path, HEAD + root + LINE + "</robot>")
    assert 'points = { b = "b" }' in model, "frames that stand still are no points"
    model, _ = imported(tmp_path, HEAD + root + LINE + "</robot>", "--floating")
    assert 'points = { base = "base", a = "a", b = "b" }' in model
    free = LINE.replace("continuous", "floating") + '<link name="b_end"/>' + joint(name="k", kind="fixed", parent="a", child="b_end")
    model, _ = imported(tmp_path, HEAD + free + "</robot>")
    assert 'b_end_2 = "b"' in model and 'b_end = "b_end"' in model
    assert "warning" not in refdyn("check", tmp_path / "r.lua").stderr


@pytest.mark.parametrize("name", ["r.urdf", "r.xml", "r.txt"])
@pytest.mark.parametrize("command", ["check", "sim"])
def test_robots_where_models_are_needed(command, name, tmp_path):
    (tmp_path / name).write_text("\ufeff\n  " + HEAD + LINE + "</robot>")
    said = refdyn(command, name, "--until" if command == "sim" else "--fold", *(["1"] if command == "sim" else []), cwd=tmp_path, status=1).stderr
    assert said == f"{name}: is XML and not a model in Lua; convert a URDF file by `refdyn import`\n"


# ---- Text ----

def test_names(tmp_path):
    names = ["base link", "base_link", "2nd", "double", "end", "ground", "ä", "a\nb]]", "_lead", "link_2nd", "x" * 150]
    links = "".join(f'<link name="{name}">{MASS}</link>'.replace("\n", "&#10;") for name in names)
    joints = "".join(joint(name=str(i), parent="base link", child=name.replace("\n", "&#10;")) for i, name in enumerate(names[1:]))
    model, _ = imported(tmp_path, HEAD.replace('"r"', '"3 robots"') + links + joints + "</robot>")
    assert model.splitlines()[1:11] == [
        "-- Link 'base link' of the file is base_link_1.", "-- Link '2nd' of the file is link_2nd_3.", "-- Link 'double' of the file is link_double.",
        "-- Link 'end' of the file is link_end.", "-- Link 'ground' of the file is link_ground.", "-- Link 'ä' of the file is link__.",
        "-- Link 'a\\nb]]' of the file is a_b__.", "-- Link '_lead' of the file is link__lead.",
        f"-- Link '{'x' * 150}' of the file is {'x' * 100}.", 'local rd = require "refdyn"']
    assert 'name = "robot_3_robots"' in model
    refdyn("check", tmp_path / "r.lua")


def test_text_is_the_same_each_time(tmp_path):
    text = (ROBOTS / "seven.urdf").read_text()
    model, _ = imported(tmp_path, text, "--flexible", "column", *BEAM)
    again = refdyn("import", "r.urdf", "--flexible", "column", *BEAM, cwd=tmp_path).stdout
    assert model == again and max(map(len, model.splitlines())) <= 130
    assert set(re.findall(r"[\d.]+e-1\d+", model)) == set()


@pytest.mark.quick
def test_right_angles(tmp_path):
    angles = [math.pi, -math.pi / 2, math.pi / 4]
    model, _ = imported(tmp_path, HEAD + PAIR + joint(f'<origin rpy="{float(angles[0])!r} {float(angles[1])!r} {float(angles[2])!r}"/>') + "</robot>")
    assert 'turn = { { "z", rd.pi / 4 }, { "y", -rd.pi / 2 }, { "x", rd.pi } }' in model


def test_angles_that_are_nearly_right(tmp_path):
    text = HEAD + PAIR + joint('<origin rpy="1.57079 -3.1416 0.3"/>') + joint('<origin rpy="-4.7124 6.28318531 1.58"/>', "k", "fixed", child="c") + '<link name="c"/></robot>'
    model, said = imported(tmp_path, text)
    assert "4 angles are within 1.1e-05 rad of a right angle; --right-angles 2e-05 makes them exact, which saves operations\n" in said
    assert 'turn = { { "z", 0.3 }, { "y", -3.1416 }, { "x", 1.57079 } }' in model
    model, said = imported(tmp_path, text, "--right-angles", "2e-5")
    assert "4 angles are set to right angles, changed by at most 1.1e-05 rad\n" in said and "of a right angle" not in said and 'turn = { { "z", 0.3 }, { "y", -rd.pi }, { "x", rd.pi / 2 } }' in model
    assert 'turn = { { "z", 1.58 }, { "x", rd.pi / 2 } }' in model


def test_angles_that_are_not_nearly_right(tmp_path):
    (tmp_path / "r.urdf").write_text(HEAD + PAIR + joint('<origin rpy="1.2 0.2 0"/>') + "</robot>")
    said = refdyn("import", tmp_path / "r.urdf", "--right-angles", "0.5", "-o", tmp_path / "r.lua", status=2).stderr
    assert said.startswith("refdyn import: --right-angles: 0.5 rad is larger than any rounding of an angle; must be at most 0.01\n")


# ---- What is omitted, and what is refused ----

LEFT_OUT = {
    "shapes": ('<link name="a"><visual><geometry><mesh filename="x.stl"/></geometry></visual><collision/></link>\n<link name="b">' + MASS + '<visual/>\n<visual/></link>'
               + joint(), ["r.urdf:2: warning: <visual> in <link>, 3 in all with 1 meshes, left out: shapes do not enter the dynamics",
                           "r.urdf:2: warning: <collision> in <link>, 1 in all, left out: shapes do not enter the dynamics"]),
    "drives": (LINE + '<transmission name="t"><type>x</type><actuator name="m"/></transmission><gazebo reference="a"><sensor/></gazebo>',
               ["r.urdf:5: warning: <transmission> in <robot>, 1 in all, left out: only rotors as <drake:rotor_inertia> are read",
                "r.urdf:5: warning: <gazebo> in <robot>, 1 in all, left out: it is for Gazebo"]),
    "sensor": (LINE + '<sensor name="s"/>', ["r.urdf:5: warning: <sensor> in <robot>, 1 in all, left out: unknown"]),
    "joint": (PAIR + joint('<safety_controller k_velocity="1"/><calibration rising="0"/>\n<limit uper="3"/>'),
              ["r.urdf:4: warning: <safety_controller> in <joint>, 1 in all, left out: controllers are written in Lua",
               "r.urdf:4: warning: <calibration> in <joint>, 1 in all, left out: coordinates keep the joint's zero",
               "r.urdf:5: warning: <limit>: attribute uper, 1 in all, left out: unknown"]),
    "friction": (PAIR + joint('<dynamics friction="0.7"/>'), ["r.urdf:4: warning: joint j: friction 0.7 is left out; --friction-width RATE includes it"]),
    "nothing to move": (LINE + '<link name="c"/>\n<link name="d"/>' + joint(name="k", kind="prismatic", parent="b", child="c") + joint(name="l", parent="c", child="d").strip()
                        + '<link name="e"/>' + joint(name="m", parent="b", child="e") + f'<link name="f">{MASS}</link>' + joint(name="n", kind="fixed", parent="e", child="f"),
                        ["r.urdf:6: warning: joint k: moves no mass; add mass, or make the joint fixed"]),
    "no range": (PAIR + joint('<limit lower="0.3" upper="0.3" velocity="0" effort="0"/>', kind="prismatic"),
                 ["r.urdf:4: warning: joint j: <limit>: lower and upper are both 0.3; the range is left out"]),
    "several": (PAIR + joint('<dynamics damping="0.7" friction="2"/><limit velocity="3"/>', kind="planar"),
                ["r.urdf:4: warning: joint j: friction 2 is left out", "r.urdf:4: warning: joint j: limits of several coordinates are left out",
                 "r.urdf:4: warning: joint j: damping 0.7 of several coordinates is left out"]),
    "fixed": (PAIR + joint().strip() + '<link name="c"/>' + joint('<mimic joint="j"/>', "k", "fixed", child="c"),
              ["r.urdf:4: warning: joint k: <mimic>: a fixed joint cannot follow another; left out"]),
    "differential": (LINE + '<transmission name="t"><actuator name="m"/><actuator name="n"/><joint name="a"/><joint name="b"/></transmission>',
                     ["r.urdf:5: warning: <transmission> in <robot>, 1 in all, left out: only rotors as <drake:rotor_inertia> are read"]),
    "no mass": (PAIR + joint().replace("/>\n", "/>") + '<link name="c"><inertial><mass value="0"/>' + MASS.partition("/>")[2] + "</link>" + joint(name="k", kind="fixed", child="c"),
                ["r.urdf:5: warning: link c: an inertia without mass is left out"]),
}


@pytest.mark.parametrize("which", LEFT_OUT)
def test_what_is_left_out_is_told(which, tmp_path):
    links, warnings = LEFT_OUT[which]
    said = imported(tmp_path, HEAD + links + "</robot>")[1].splitlines()
    assert said[:-1] == warnings and re.fullmatch(r"\d+ links?, \d+ joints?, \d+ coordinates? without those of beams", said[-1])


def with_origin(text):
    return HEAD + PAIR + joint(f"<origin {text}/>") + "</robot>"


def with_mass(mass, inertia="ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'"):
    return HEAD + f'<link name="a"><inertial>\n<mass value="{mass}"/><inertia {inertia}/></inertial></link></robot>'


def with_mimic(text, more="", kind="continuous"):
    return HEAD + PAIR + '<link name="c"/>' + joint(f"<mimic {text}/>", kind=kind) + joint(more, name="k", child="c") + "</robot>"


def links_and(*joints):
    return HEAD + '<link name="a"/>\n<link name="b"/>\n<link name="c"/>\n' + "".join(joints) + "</robot>"


WRONG = {
    "mismatch": (HEAD + "<link></robot>", ":2: XML: mismatched tag; must be a well-formed file"),
    "empty": ("", ":1: XML: no element found; must be a well-formed file"),
    "cut": (HEAD + "<link name='a'", ":2: XML: unclosed token; must be a well-formed file"),
    "two documents": (HEAD + "</robot><robot/>", ":2: XML: junk after document element; must be a well-formed file"),
    "twice": (HEAD + "<link name='a' name='b'/></robot>", ":2: XML: duplicate attribute; must be a well-formed file"),
    "encoding": (b'<robot name="\xff"/>', ":1: XML: not well-formed (invalid token); must be a well-formed file"),
    "entity": (HEAD + "<link name='&x;'/></robot>", ":2: XML: undefined entity; must be a well-formed file"),
    "bomb": ('<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>\n' + HEAD + "&b;</robot>", ":1: XML: a document type, which may define entities; remove it"),
    "external": ('<!DOCTYPE r [<!ENTITY a SYSTEM "/etc/passwd">]>\n<robot name="&a;"/>', ":1: XML: a document type, which may define entities; remove it"),
    "deep": (HEAD + "<link>" * 100 + "</link>" * 100 + "</robot>", ":2: XML: elements are nested more than 100 deep"),
    "other root": ("<sdf/>", ":1: robot: the outermost element is <sdf>; must be <robot>"),
    "no name": ("<robot/>", ":1: robot: <robot> has no name; add it"),
    "no link": (HEAD + "</robot>", ":1: robot: it has no <link>; add at least one"),
    "nothing moves": (HEAD + PAIR + joint(kind="fixed") + "</robot>", ":1: robot: no joint moves; add one, or give --floating for the root"),
    "macro": (HEAD + '<link name="a">\n<xacro:box/></link></robot>', ":3: xacro: <xacro:box> is a macro; run `xacro FILE > FILE.urdf` first"),
    "substitution": (with_origin('xyz="0 0 ${h}"'), ":4: joint j: <origin>: xyz: '0 0 ${h}' belongs to xacro; run `xacro FILE > FILE.urdf` first"),
    "nameless link": (HEAD + "<link/></robot>", ":2: link: <link> has no name; add it"),
    "empty link": (HEAD + "<link name=''/></robot>", ":2: link: its name is empty; each link needs one"),
    "same link": (HEAD + "<link name='a'/>\n<link name='a'/></robot>", ":3: link a: line 2 has the same name; each link must have its own"),
    "two inertials": (HEAD + f"<link name='a'>{MASS}\n{MASS}</link></robot>", ":3: link a: a second <inertial>; the first is in line 2"),
    "no inertia": (HEAD + "<link name='a'><inertial><mass value='1'/></inertial></link></robot>", ":2: link a: <inertial> has no <inertia>; add it"),
    "no value": (HEAD + "<link name='a'><inertial><mass>1</mass><inertia/></inertial></link></robot>", ":2: link a: <mass> has no value; add it"),
    "negative mass": (with_mass("-2"), ":3: link a: <mass>: value is -2; must be at least 0"),
    "NaN": (with_mass("nan"), ":3: link a: <mass>: value: 'nan' is not a number up to 1e100"),
    "infinite": (with_mass("1e999"), ":3: link a: <mass>: value: '1e999' is not a number up to 1e100"),
    "huge": (with_mass("1e101"), ":3: link a: <mass>: value: '1e101' is not a number up to 1e100"),
    "five moments": (with_mass("1", "ixx='1' ixy='0' ixz='0' iyy='1' izz='1'"), ":3: link a: <inertia> has no iyz; add it"),
    "two numbers": (with_origin('xyz="0 1"'), ":4: joint j: <origin>: xyz: '0 1' has 2 numbers; must have 3"),
    "four numbers": (with_origin('rpy="0 1 2 3"'), ":4: joint j: <origin>: rpy: '0 1 2 3' has 4 numbers; must have 3"),
    "comma": (with_origin('xyz="0,1,2"'), ":4: joint j: <origin>: xyz: '0,1,2' is not a number up to 1e100; write blanks between numbers"),
    "hexadecimal": (with_origin('xyz="0 1 0x10"'), ":4: joint j: <origin>: xyz: '0x10' is not a number up to 1e100"),
    "control": (with_origin('xyz="0 1 &#9;a"'), ":4: joint j: <origin>: xyz: 'a' is not a number up to 1e100"),
    "no type": (HEAD + PAIR + '<joint name="j"/></robot>', ":4: joint j: <joint> has no type; add it"),
    "type": (HEAD + PAIR + joint(kind="ball") + "</robot>", ":4: joint j: type 'ball' is not one of fixed, revolute, continuous, prismatic, planar, floating"),
    "no parent": (HEAD + PAIR + '<joint name="j" type="fixed"><child link="b"/></joint></robot>', ":4: joint j: <joint> has no <parent>; add it"),
    "unknown parent": (HEAD + PAIR.replace('"a"', '"base"') + joint(parent="bse") + "</robot>", ":4: joint j: <parent>: there is no link 'bse'; did you mean \"base\"?"),
    "same joint": (links_and(joint(), joint(child="c")), ":6: joint j: line 5 has the same name; each joint must have its own"),
    "no axis": (HEAD + PAIR + joint('<axis xyz="0 0 0"/>') + "</robot>", ":4: joint j: <axis>: xyz has length 0; must be a direction"),
    "negative damping": (HEAD + PAIR + joint('<dynamics damping="-1"/>') + "</robot>", ":4: joint j: <dynamics>: damping is -1; must be at least 0"),
    "limits": (HEAD + PAIR + joint('<limit lower="1" upper="-1"/>') + "</robot>", ":4: joint j: <limit>: lower 1 is above upper -1"),
    "two roots": (links_and(joint()), ":4: link c: no joint carries it, nor link a in line 2; there must be one root"),
    "no root": (HEAD + PAIR + joint() + joint(name="k", parent="b", child="a") + "</robot>", ":1: robot: a joint carries each link; there must be a root"),
    "loop": (links_and(joint(parent="b", child="c"), joint(name="k", parent="c", child="b")), ":4: link c: carries itself in a loop of joints, a URDF is a tree"),
    "itself": (links_and(joint(), joint(name="k", parent="c", child="c")), ":4: link c: carries itself in a loop of joints, a URDF is a tree"),
    "two carriers": (links_and(joint(), joint(name="k", child="c"), joint(name="l", parent="b", child="c")),
                     ":7: joint l: link c is carried by joint k already, which closes a loop: a URDF is a tree"),
    "mimic unknown": (with_mimic('joint="m"'), ":4: joint j: <mimic>: there is no joint 'm'"),
    "mimic itself": (with_mimic('joint="j"'), ":4: joint j: <mimic>: it follows itself; name a joint that does not follow this one"),
    "mimic in a circle": (with_mimic('joint="k"', '<mimic joint="j"/>'), ":5: joint k: <mimic>: it follows itself; name a joint that does not follow this one"),
    "mimic of many": (with_mimic('joint="k"', kind="planar"), ":4: joint j: <mimic>: it is planar; must have one coordinate"),
    "mimic too far": (links_and(joint('<mimic joint="k" multiplier="1e100"/>'), joint('<mimic joint="l" multiplier="1e100"/>', "k", child="c"),
                                '<link name="d"/><link name="e"/><link name="f"/>' + joint('<mimic joint="m" multiplier="1e100"/>', "l", child="d"),
                                joint('<mimic joint="n" multiplier="1e100"/>', "m", child="e"), joint('<limit lower="1" upper="2"/>', "n", "revolute", child="f")),
                      ":5: joint j: the joint that it follows gives it an infinite value"),
    "rotor": (HEAD + LINE + '<transmission name="t"><joint name="x"/><actuator name="m"><drake:rotor_inertia value="1"/></actuator></transmission></robot>',
              ":5: transmission: <joint>: there is no joint 'x'"),
    "second rotor": (HEAD + LINE + '<transmission name="t"><joint name="j"/><actuator name="m"><drake:rotor_inertia value="1"/></actuator></transmission>\n' * 2 + "</robot>",
                     ":6: joint j: a second rotor; a joint has one"),
}


@pytest.mark.parametrize("which", WRONG)
def test_what_is_refused(which, tmp_path):
    text, message = WRONG[which]
    said = imported(tmp_path, text, status=1)[1]
    assert said == f"r.urdf{message}\n" and [path.name for path in tmp_path.iterdir()] == ["r.urdf"]


def test_files_of_xacro(tmp_path):
    said = imported(tmp_path, HEAD + LINE + "</robot>", name="r.urdf.xacro", status=1)[1]
    assert said == "r.urdf.xacro: xacro: a file of macros; run `xacro FILE > FILE.urdf` first\n"


def test_output_is_not_the_file_that_is_read(tmp_path):
    (tmp_path / "r.urdf").write_text(HEAD + LINE + "</robot>")
    assert "r.urdf" in refdyn("import", "r.urdf", "-o", "r.urdf", cwd=tmp_path, status=1).stderr
    assert (tmp_path / "r.urdf").read_text().endswith("</robot>")


# ---- Published robots ----

DESCRIPTIONS = "cmeel.prefix/share/example-robot-data/robots"
OTHERS = {"ur5": "ur_description/urdf/ur5_robot.urdf", "panda": "panda_description/urdf/panda.urdf"}


@pytest.mark.skipif(not LONG, reason="tests/long")
@pytest.mark.parametrize("robot", OTHERS)
def test_robots_of_others(robot, tmp_path):
    """Needs Pinocchio and the Python package example-robot-data."""
    pytest.importorskip("pinocchio")
    from urdf_by_pinocchio import Reference
    places = [pathlib.Path(folder) / DESCRIPTIONS / OTHERS[robot] for folder in sys.path]
    text = next((path.read_text() for path in places if path.exists()), None) or pytest.skip("no example-robot-data")
    model, reference = undamped(model_of(tmp_path, text)), Reference(text)
    for state in reference.states(10, robot):
        check(compare(model, reference.coordinates, state))


# ---- Names of joints ----

def test_coordinates_with_the_names_of_joints(tmp_path):
    """The same equations under other names; limits, inputs and rows of joints that follow use the names, too."""
    for robot in ("seven", "gripper", "free"):
        text = (ROBOTS / f"{robot}.urdf").read_text()
        plain = refdyn("eval", model_of(tmp_path, text, "--drives")).stdout
        named, _ = imported(tmp_path, text, "--drives", "--joint-names", "--joints", "joints.json")
        found, expected, joints = json.loads(refdyn("eval", tmp_path / "r.lua").stdout), json.loads(plain), json.loads((tmp_path / "joints.json").read_text())
        assert found["M"] == expected["M"] and found["h"] == expected["h"] and sorted(name for names in joints.values() for name in names) == sorted(found["coordinates"])
        assert all(names == [joint_] for joint_, names in joints.items() if len(names) == 1), joints
        for joint_, names in joints.items():
            assert (f'coordinate = "{joint_}"' in named) == (len(names) == 1)
    imported(tmp_path, (ROBOTS / "free.urdf").read_text(), "--joints", "joints.json")
    assert json.loads((tmp_path / "joints.json").read_text())["arm_joint"] == ["arm_psi"]


@pytest.mark.parametrize("name", ["the-joint", "end", "b_psi", "b_xd", "turn_d", "t", "int", "2nd"])
def test_names_of_joints_that_a_model_cannot_have(name, tmp_path):
    """If the joint's name is no identifier, or that of a column or a rate, the coordinate has the name of the link."""
    text = HEAD + PAIR + joint(name=name) + "</robot>"
    named, _ = imported(tmp_path, text, "--joint-names", "--joints", "joints.json")
    assert "coordinate" not in named and json.loads((tmp_path / "joints.json").read_text()) == {name: ["b_phi"]}
    assert named == imported(tmp_path, text)[0]


def test_the_file_of_joints_is_no_other_file(tmp_path):
    text = HEAD + PAIR + joint() + "</robot>"
    for name in ("r.lua", "r.urdf"):
        _, said = imported(tmp_path, text, "--joints", name, status=1)
        assert "give another name" in said
    assert (tmp_path / "r.urdf").read_text() == text
