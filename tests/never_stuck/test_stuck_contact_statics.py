"""Equilibria on one-sided contacts: which contacts carry and with which forces; modes and motions from there; unsupported bodies."""
import json

import pytest

from program import TESTS, check, close, motion, refdyn

G = 9.81
CONTACTS = TESTS / "models" / "contacts"

SPRUNG = """
local rd = require "refdyn"
local p = rd.parameters { { "pull", 30, "N" }, { "s", 100, "N/m" } }
return rd.model {
  name = "sprung",
  links = { { "cart", joint = "x", mass = 2, spring = { x = p.s } }, { "rider", on = "cart", joint = "x", mass = 1, start = { x = 0.1 } } },
  forces = function(s) return { cart_x = p.pull } end,
  constraints = function(s) return {
    rd.lock { "rider_x", 0.1 },
    rd.contact { 0.2 - s.q.cart_x, name = "stop" } } end,
}
"""

BEAM = """
local rd = require "refdyn"
local p = rd.parameters { { "high", 0, "m" } }
return rd.model {
  name = "resting", gravity = { 0, 0, -9.81 },
  links = {
    { "foot", joint = "z, theta", mass = 0.1, inertia = { yy = 1e-3 }, start = { z = 0.1 } },
    { "arm", on = "foot", beam = { length = 2, section = rd.round(0.01), E = 2.1e11, nu = 0.33, rho = 7801, rfe = 8, dofs = "theta" } },
    { "tip", on = "arm.tip", mass = 0.1 } },
  points = { a = "foot", b = "tip", m = { on = "arm", along = 1 } },
  constraints = function(s) return {
    rd.contact { s.points.a.z, name = "left" },
    rd.contact { s.points.m.z - p.high, name = "middle" },
    rd.contact { s.points.b.z, name = "right" } } end,
}
"""


def statics(model, *arguments, **ways):
    return json.loads(refdyn("statics", model, *arguments, **ways).stdout)


def forces(found):
    """Forces by name; each contact is closed or has no force, and gaps and forces are never negative."""
    for contact in found["contacts"]:
        assert contact["gap"] > -1e-9 and contact["force"] >= 0 and contact["gap"] * contact["force"] < 1e-9, contact
    return {contact["name"]: contact["force"] for contact in found["contacts"]}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    for name, text in (("sprung", SPRUNG), ("beam", BEAM)):
        (folder / f"{name}.lua").write_text(text)
    return lambda name: folder / f"{name}.lua"


@pytest.mark.parametrize("floor", [0, 0.3, -1000, 1e6])
def test_ball_on_a_floor(floor):
    found = statics(CONTACTS / "ball.lua", "--set", f"floor={floor}")
    check([close("z", found["q"], [floor], 1e-12, scale=max(1, abs(floor))), close("force", forces(found)["floor"], G, 1e-12)])
    assert found["stability"] == "stable"


def test_ball_that_is_held():
    found = statics(CONTACTS / "ball.lua", "--hold", "ball_z")
    assert forces(found) == {"floor": 0}
    check([close("gap", found["contacts"][0]["gap"], 1, 1e-12), close("hold force", found["hold_force"], [G], 1e-12)])


def test_released_contact_has_no_part():
    """Then nothing holds the ball, and the message says so."""
    done = refdyn("statics", CONTACTS / "ball.lua", "--release", "floor", status=3)
    assert "nothing holds the coordinate, coordinate ball_z" in done.stderr


def test_load_that_leads_away(scene):
    """Without its spring the slide leaves the stop."""
    done = refdyn("statics", scene("sprung"), "--set", "s=0", "--set", "pull=-1", status=3)
    assert "nothing holds the coordinate, coordinate cart_x" in done.stderr


@pytest.mark.parametrize(("pull", "x", "force"), [(30, 0.2, 10), (10, 0.1, 0), (20, 0.2, 0), (-15, -0.15, 0)])
def test_slide_on_a_spring_against_a_stop(scene, pull, x, force):
    """With or without contact; a programme row acts as well."""
    found = statics(scene("sprung"), "--set", f"pull={pull}")
    check([close("x", found["q"], [x, 0.1], 1e-12), close("force", forces(found)["stop"], force, 1e-10)])
    assert len(found["rows"]) == len(found["lambda"]) == 1


@pytest.mark.parametrize("tilt", [0, 0.3, -0.5])
@pytest.mark.parametrize("off", [0, 0.2, 0.6])
def test_table_with_an_eccentric_load(tilt, off):
    """Four legs: their least forces, a + b x + c y, have the moments of the load."""
    done = refdyn("statics", CONTACTS / "table.lua", "--set", f"off={off}", "--set", f"tilt={tilt}")
    assert "the forces of the contacts are not unique" in done.stderr
    found = json.loads(done.stdout)
    legs = {"leg_a": (1, 1), "leg_b": (-1, 1), "leg_c": (-1, -1), "leg_d": (1, -1)}
    wanted = [12 * G / 4 + 2 * G * off * (x + y / 2) / (4 * 0.4) for x, y in legs.values()]
    p = forces(found)
    check([close("legs", [p[name] for name in legs], wanted, 1e-9), close("q", found["q"], [0.5, 0, 0], 1e-9)])
    assert found["stability"] == "stable"


def test_table_that_stands_on_three_legs():
    """The load is near one leg: the opposite leg is closed, and its least force would pull."""
    p = forces(statics(CONTACTS / "table.lua", "--set", "off=1.1"))
    check([close("sum", sum(p.values()), 12 * G, 1e-9), close("about y", p["leg_a"] + p["leg_d"] - p["leg_b"] - p["leg_c"], 2 * G * 1.1 / 0.4, 1e-9),
           close("about x", p["leg_a"] + p["leg_b"] - p["leg_c"] - p["leg_d"], G * 1.1 / 0.4, 1e-9)])


def test_stack():
    p = forces(statics(CONTACTS / "stack.lua"))
    check([close("stack", [p["ground"], p["between"]], [1.7 * G, 0.7 * G], 1e-12)])


@pytest.mark.parametrize(("high", "carries"), [(0, True), (-0.3, False)])
def test_beam_on_three_supports(scene, high, carries):
    """Symmetric forces bear its weight; a support out of reach bears nothing."""
    found = statics(scene("beam"), "--set", f"high={high}")
    p = forces(found)
    area, load = 3.141592653589793 * 0.005**2, 0.2 * G
    check([close("sum", sum(p.values()), 7801 * 2 * area * G + load, 1e-9), close("symmetry", p["left"], p["right"], 1e-5)])
    assert (p["middle"] > 0) == carries
    if carries:  # 5/8 of the weight of the whole beam; rigid elements are a coarse approximation
        check([close("middle", p["middle"], 5 / 8 * 7801 * 2 * area * G, 2e-2 * p["middle"])])


def test_modes_have_the_contacts_that_carry_as_rows(scene):
    """The slide against its stop has no mode; away from it, the mode of its spring."""
    there = json.loads(refdyn("modes", scene("sprung"), "--at", "statics").stdout)
    away = json.loads(refdyn("modes", scene("sprung"), "--set", "pull=10", "--at", "statics").stdout)
    assert there["modes"] == [] and len(away["modes"]) == 1
    check([close("omega", away["modes"][0]["omega"], (100 / 3)**0.5, 1e-10)])


@pytest.mark.parametrize("name", ["ball", "table", "stack"])
def test_motions_start_at_rest_on_their_contacts(name):
    arguments = ["--set", "off=0.2"] if name == "table" else []
    run, _, _ = motion(CONTACTS / f"{name}.lua", *arguments, "--from", "statics", "--until", 0.5, "--every", 0.1)
    still = [key for key in run if key + "_d" in run]
    check(close(key, run[key], run[key][0] + 0 * run[key], 1e-12, scale=1) for key in still)


def test_batches_start_from_statics(tmp_path):
    (tmp_path / "cases.csv").write_text("floor\n0\n0.3\n-1000\n")
    refdyn("batch", CONTACTS / "ball.lua", "--table", tmp_path / "cases.csv", "--from", "statics", "--until", 0.2, "-o", tmp_path / "runs.csv")
    lines = [line.split(",") for line in (tmp_path / "runs.csv").read_text().splitlines() if not line.startswith("#")]
    place = lines[0].index("ball_z") if "ball_z" in lines[0] else next(i for i, name in enumerate(lines[0]) if name.endswith("ball_z"))
    check([close("z", [float(line[place]) for line in lines[1:]], [0, 0.3, -1000], 1e-12, scale=1000)])
