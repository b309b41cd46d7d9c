"""Robots from URDF in Python: names of joints, limits, beams; what a notebook shows of models, quantities and motions."""
import json
import pickle
import re
import xml.etree.ElementTree

import numpy as np
import pytest

from program import REFERENCE, SOURCE, TESTS, evaluate, refdyn
from python_package import package, same  # noqa: F401 (a fixture)

ROBOTS = TESTS / "robots"
ODD = '''<robot name="odd">
<link name="a"/>
<link name="b"><inertial><mass value="2"/><inertia ixx="0.3" ixy="0" ixz="0" iyy="0.4" iyz="0" izz="0.5"/></inertial></link>
<joint name="joint 1 (left)" type="continuous"><parent link="a"/><child link="b"/><dynamics damping="0.7"/></joint>
</robot>
'''


NAMES = """<robot name="names"><link name="a"/>
  <link name="b"><inertial><origin xyz="0.3 0 0"/><mass value="4"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.14" iyz="0" izz="0.14"/></inertial></link>
  <link name="c"><inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial></link>
  <link name="d"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="end" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="90"/></joint>
  <joint name="joint 1/\u03b1" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.6 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="reach" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="1 0 0"/><limit lower="0" upper="2" velocity="3" effort="40"/></joint></robot>
"""


@pytest.fixture(scope="module")
def seven(package):
    return package.Model.from_urdf(ROBOTS / "seven.urdf", drives=True)


def test_names_and_equations(package, seven, tmp_path):
    """The coordinates have the names of the joints, and the numbers are those of the imported file."""
    joints = [joint.get("name") for joint in xml.etree.ElementTree.parse(ROBOTS / "seven.urdf").findall("joint") if joint.get("type") != "fixed"]
    assert sorted(seven.coordinates) == sorted(joints) and dict(seven.joints) == {name: name for name in joints}
    refdyn("import", ROBOTS / "seven.urdf", "--drives", "-o", "seven.lua", cwd=tmp_path)
    random = np.random.default_rng(3)
    q, qd, u = 0.4 * random.standard_normal(7), random.standard_normal(7), random.standard_normal(7)
    inputs = [entry["name"] for entry in json.loads(refdyn("compile", tmp_path / "seven.lua").stdout)["inputs"]]
    told = evaluate(tmp_path / "seven.lua", {"q": q.tolist(), "qd": qd.tolist(), "inputs": dict(zip(inputs, u.tolist()))})
    assert same(seven.M(q), told["M"]) and same(seven.Q(q, qd, inputs=u), told["Q"]) and all(name.split("_", 1)[1] in joints for name in seven.inputs)
    again = pickle.loads(pickle.dumps(seven))
    assert again.joints == seven.joints and again.coordinates == seven.coordinates and same(again.limits.upper, seven.limits.upper)


def test_joints_with_other_names(package, tmp_path):
    """Names that a model cannot have, and joints with several coordinates."""
    (tmp_path / "odd.urdf").write_text(ODD)
    odd = package.Model.from_urdf(tmp_path / "odd.urdf")
    assert odd.coordinates == ("b_phi",) and dict(odd.joints) == {"joint 1 (left)": "b_phi"}
    free = package.Model.from_urdf(ROBOTS / "free.urdf")
    assert free.joints["slab_joint"] == ("slab_z", "slab_x", "slab_theta") and free.joints["arm_joint"] == "arm_joint"
    assert package.Model(REFERENCE, n_rfe=1).joints == {}
    assert odd.limits["joint 1 (left)"] == odd.limits["b_phi"] == pickle.loads(pickle.dumps(odd)).limits["joint 1 (left)"] and list(odd.limits) == ["b_phi"]
    with pytest.raises(KeyError, match="slab_joint: this joint has the coordinates slab_z, slab_x, slab_theta; use one of them"):
        free.limits["slab_joint"]
    with pytest.raises(KeyError, match=re.escape("joint 1 (right): unknown coordinate; did you mean 'joint 1 (left)'?")):
        odd.limits["joint 1 (right)"]
    with pytest.raises(KeyError, match="b_ph: unknown coordinate; did you mean 'b_phi'?"):
        odd.limits.units["b_ph"]


def test_coordinates_of_inputs(package, tmp_path):
    """`held` has the coordinate that each input drives, for all names of joints."""
    (tmp_path / "names.urdf").write_text(NAMES)
    for file, names in ((tmp_path / "names.urdf", ["tau_b_theta", "tau_c_theta", "f_reach"]), (ROBOTS / "gripper.urdf", None), (ROBOTS / "free.urdf", None), (ROBOTS / "seven.urdf", None)):
        robot = package.Model.from_urdf(file, drives=True)
        assert len(robot.held) == len(robot.inputs) > 0 and list(robot.inputs) == (names or list(robot.inputs))
        random = np.random.default_rng(5)
        q, qd = robot.q0 + 0.1 * random.standard_normal(robot.q0.shape), 0.1 * random.standard_normal(robot.q0.shape)
        for place, name in enumerate(robot.held):
            inputs = np.zeros(len(robot.inputs))
            inputs[place] = 0.37
            moved = robot.Q(q, qd, inputs=inputs) - robot.Q(q, qd)
            assert np.flatnonzero(moved).tolist() == [robot.coordinates.index(name)]
    named = package.Model.from_urdf(tmp_path / "names.urdf", drives=True)
    assert [named.joints[joint] for joint in ("end", "joint 1/\u03b1", "reach")] == list(named.held)


def test_limits(package, seven):
    """Those of the file, with units; infinite where there is none."""
    for joint in xml.etree.ElementTree.parse(ROBOTS / "seven.urdf").findall("joint"):
        if joint.get("type") == "fixed":
            continue
        limit, slides = joint.find("limit"), joint.get("type") == "prismatic"
        found = seven.limits[joint.get("name")]
        of = {} if limit is None else limit.attrib
        has_range = joint.get("type") != "continuous" and of
        assert (found.lower, found.upper) == ((float(of.get("lower", 0)), float(of.get("upper", 0))) if has_range else (-np.inf, np.inf))
        assert found.velocity == (float(of.get("velocity", 0)) or np.inf) and found.effort == (float(of.get("effort", 0)) or np.inf)
        assert seven.limits.units[joint.get("name")] == {"lower": "m" if slides else "rad", "upper": "m" if slides else "rad", "velocity": "m/s" if slides else "rad/s", "effort": "N" if slides else "N m"}
    place = seven.coordinates.index("elbow")
    assert seven.limits.upper[place] == seven.limits["elbow"].upper and not seven.limits.upper.flags.writeable and list(seven.limits) == list(seven.coordinates)
    with pytest.raises(KeyError, match="elbw: unknown coordinate; did you mean 'elbow'"):
        seven.limits["elbw"]
    free = package.Model(REFERENCE, n_rfe=1)
    assert np.isinf(free.limits.effort).all() and repr(free.limits) == "<refdyn limits of 0 of 4 coordinates>" and "shoulder: lower=" in repr(seven.limits)


def test_named_limits(package):
    """Those of drives and of the function `limits`, by name, with their columns."""
    limits = package.Model(SOURCE / "docs" / "drives" / "hub_link.lua", limit=3.25).limits
    assert dict(limits.named) == {"drive_hub_psi": ("drive_hub_psi", -3.25, 3.25), "aim": ("miss", -0.01, 0.01)}
    with pytest.raises(KeyError, match="aims: unknown limit; did you mean 'aim'"):
        limits.named["aims"]
    assert limits.named["aim"].column == "miss" and pickle.loads(pickle.dumps(limits)).named == limits.named


def test_links_as_beams(package):
    arm = package.Model.from_urdf(ROBOTS / "two.urdf", {"fore": {"section": "tube:0.043:0.031", "E": 7.1e10, "rfe": 2, "tip": [0.13, -0.27, 0.19]}}, eta=1e-4)
    assert arm.coordinates[:2] == ("shoulder", "elbow") and len(arm.coordinates) == 5 and arm.options["n_rfe"] == 2 and arm.parameters["eta"] == 1e-4
    assert np.allclose(arm.M(arm.q0)[:2, :2], package.Model.from_urdf(ROBOTS / "two.urdf").M([0, 0]), rtol=1e-10)
    assert len(package.Model.from_urdf(ROBOTS / "two.urdf", {"fore": {"section": "tube:0.043:0.031", "E": 7.1e10, "tip": [0.13, -0.27, 0.19]}}, n_rfe=3).coordinates) == 8


def test_text_and_report_of_an_import(package, tmp_path):
    """Those of the command; a model has the text that it was read from."""
    options = {"section": "tube:0.043:0.031", "E": 7.1e10, "rfe": 2, "tip": [0.13, -0.27, 0.19]}
    arm = package.Model.from_urdf(ROBOTS / "two.urdf", {"fore": options})
    said = refdyn("import", ROBOTS / "two.urdf", "--joint-names", "--flexible", "fore", "--section", "tube:0.043:0.031", "--E", "7.1e10", "--rfe", "2", "--tip", "0.13,-0.27,0.19",
                  "-o", "two.lua", cwd=tmp_path)
    assert arm.text == (tmp_path / "two.lua").read_text() and "\n".join(arm.imported) == said.stderr.strip() and arm.imported[0].startswith("link fore: a beam of 0.")
    assert package.Model.from_text(arm.text, n_rfe=1).text == arm.text and pickle.loads(pickle.dumps(arm)).imported == arm.imported
    (tmp_path / "two.lua").write_text("changed")
    free = package.Model(REFERENCE, n_rfe=1)
    assert free.text == REFERENCE.read_text() and free.imported == ()
    with pytest.raises(AttributeError):
        free.text = ""


def test_one_rigid_element_is_a_rigid_link(package):
    one, three = (package.Model.from_urdf(ROBOTS / "two.urdf", {"fore": {"section": "tube:0.043:0.031", "E": 7.1e10, "rfe": rfe, "tip": [0.13, -0.27, 0.19]}}) for rfe in (1, 3))
    assert one.coordinates == ("shoulder", "elbow") and len(three.coordinates) == 2 + 3 * 2


def test_flags_of_numpy(package):
    robot = package.Model.from_urdf(ROBOTS / "two.urdf", drives=np.True_, floating=np.False_)
    assert list(robot.inputs) == ["tau_shoulder", "tau_elbow"] and len(robot.coordinates) == 2


def test_warnings_of_the_import(package, tmp_path):
    (tmp_path / "odd.urdf").write_text(ODD.replace('ixx="0.3"', 'ixx="3"'))
    with pytest.warns(package.ModelWarning, match="no body has the moments 3 0.4 0.5") as told:
        package.Model.from_urdf(tmp_path / "odd.urdf")
    assert told[0].filename == __file__


def test_one_warning_for_all_limits(package, seven):
    """A motion that exceeds several limits warns once, with a line for each."""
    with pytest.warns(package.ModelWarning) as told:
        seven.simulate(0.02, every=0.01, qd=np.full(7, 40.3))
    lines = str(told[0].message).splitlines()
    assert len(told) == 1 and told[0].filename == __file__ and sum("exceeds its limits: " in line for line in lines) >= 2, lines


def test_names_of_joints_and_inputs(seven):
    for values, name, message in ((seven.joints, "elbw", "elbw: unknown joint; did you mean 'elbow'?"), (seven.inputs, "elbow", "elbow: unknown input; did you mean 'tau_elbow'?"),
                                  (seven.parameters, "mass", "mass: unknown parameter; the model has no parameter")):
        with pytest.raises(KeyError) as told:
            values[name]
        assert told.value.args == (message,) and values.get(name) is None


WRONG = {
    "none.urdf: URDF: No such file or directory; must be a readable file": ("ModelError", ["none.urdf"], {}),
    "flexible: fore: 'sect' is not one of section, E, tip, nu, eta, rho, rfe; did you mean 'section'?": (ValueError, [ROBOTS / "two.urdf", {"fore": {"sect": 1}}], {}),
    'flexible: must be options by link, {"forearm": {"section": "tube:0.08:0.076", "E": 7e10}}': (TypeError, [ROBOTS / "two.urdf", ["fore"]], {}),
    "flexible: there is no link 'for'; did you mean 'fore'?": (ValueError, [ROBOTS / "two.urdf", {"for": {"section": "round:0.1", "E": 7e10}}], {}),
    "flexible: upper has other options than fore; all flexible links of an import have the same": (
        ValueError, [ROBOTS / "two.urdf", {"fore": {"section": "round:0.1", "E": 7e10}, "upper": {"section": "round:0.2", "E": 7e10}}], {}),
    "flexible: fore: add section": (ValueError, [ROBOTS / "two.urdf", {"fore": {"E": 7e10}}], {}),
    "flexible: fore: add E": (ValueError, [ROBOTS / "two.urdf", {"fore": {"section": "round:0.1"}}], {}),
    "section: 'tube:0.02:0.03' has an inner diameter that is not smaller than the outer one; write tube:OUTER:INNER": (ValueError, [ROBOTS / "two.urdf", {"fore": {"section": "tube:0.02:0.03", "E": 7e10}}], {}),
    "drives: 1; must be True or False": (TypeError, [ROBOTS / "two.urdf"], {"drives": 1}),
    "drives: 'yes'; must be True or False": (TypeError, [ROBOTS / "two.urdf"], {"drives": "yes"}),
    "floating: 'no'; must be True or False": (TypeError, [ROBOTS / "two.urdf"], {"floating": "no"}),
    "friction_width: True; must be a number": (TypeError, [ROBOTS / "two.urdf"], {"friction_width": True}),
    "right_angles: 3 rad is larger than any rounding of an angle; must be at most 0.01": (ValueError, [ROBOTS / "two.urdf"], {"right_angles": 3}),
    "from_urdf() got an unexpected keyword argument 'drive'; did you mean 'drives'?": (TypeError, [ROBOTS / "two.urdf"], {"drive": True}),
    "n_rf: the model has no option, parameter or input of this name": (ValueError, [ROBOTS / "two.urdf"], {"n_rf": 3}),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_robots(package, message):
    kind, arguments, settings = WRONG[message]
    with pytest.raises(package.ModelError if kind == "ModelError" else kind) as told:
        package.Model.from_urdf(*arguments, **settings)
    assert str(told.value) == message or str(told.value).startswith(message + ";"), str(told.value)


# ---- Notebooks ----

def test_pages_in_notebooks(seven, tmp_path):
    """The page equals that of a file, and needs nothing from elsewhere."""
    run = seven.simulate(0.1, every=0.05)
    page = seven.view(run, height=432)
    seven.view(run, tmp_path / "page.html")
    assert page.text == (tmp_path / "page.html").read_text() and seven.view(run, tmp_path / "page.html") is None
    frame = xml.etree.ElementTree.fromstring(re.sub(" allowfullscreen", "", page._repr_html_()))
    assert frame.tag == "iframe" and frame.get("height") == "432" and "<html" in frame.get("srcdoc") and not re.search(r"(src|href)=.https?:", frame.get("srcdoc"))
    assert pickle.loads(pickle.dumps(page)).text == page.text and pickle.loads(pickle.dumps(seven.limits)).units == seven.limits.units
    page.save(tmp_path / "again.html")
    assert (tmp_path / "again.html").read_text() == page.text and repr(page).startswith("<refdyn page of ")


def cells(text):
    """The rows of the tables, whose markup must be well formed."""
    tree = xml.etree.ElementTree.fromstring(f"<div>{re.sub('colspan=([0-9]+)', 'colspan=_', text).replace('colspan=_', '')}</div>")
    return [["".join(cell.itertext()) for cell in row] for row in tree.iter("tr")]


def test_tables_in_notebooks(package, seven):
    rows = cells(seven._repr_html_())
    assert ["name", "unit", "start", "rate at start"] in rows and ["elbow", "rad", f"{seven.q0[seven.coordinates.index('elbow')]:.6g}", "0"] in rows and ["tau_elbow", "N m", "0"] in rows
    long = package.Model(REFERENCE, n_rfe=8, m_E=2.25)
    rows = cells(long._repr_html_())
    assert ["and 13 more"] in rows and len(long.coordinates) == 25 and ["m_E", "kg", "2.25"] in cells(package.Model(REFERENCE, n_rfe=1, m_E=2.25)._repr_html_()) + rows
    assert "rows: ellipse, rise" in long._repr_html_() and "options: n_rfe = 8" in long._repr_html_()
    shown = long.constrained._repr_html_()
    assert ["qdd", "25"] == [row for row in cells(shown) if row[0] == "qdd"][0][:2] and "constrained(q, qd=None" in shown
    assert ["M", "7 x 7"] == cells(seven.M._repr_html_())[1][:2]
    limits = cells(seven.limits._repr_html_())
    elbow = seven.limits["elbow"]
    assert limits[0] == ["name", "lower", "upper", "velocity", "effort"]
    assert ["elbow", *(f"{value:.6g} {unit}" for value, unit in zip(elbow, ("rad", "rad", "rad/s", "N m")))] in limits
    slide = package.Model.from_text('return require "refdyn".model { name = "slide", links = { { "cart", joint = "x, z", mass = 2, limits = { x = { force = 20.25 } } } } }')
    assert cells(slide.limits._repr_html_())[1:] == [["cart_x", "", "", "", "20.25 N"]]
    assert package.Model(REFERENCE, n_rfe=1).limits._repr_html_() == "<div>no limits</div>"
