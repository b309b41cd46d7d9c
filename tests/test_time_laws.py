"""rd.timing against SciPy and against its bounds, rd.shaper against the vibrations that it leaves."""
import json

import numpy
import pytest
import scipy.integrate
import scipy.interpolate

from program import MODELS, motion, refdyn


def columns(model, *arguments):
    return motion(model, *arguments)[0]


FREE = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "y", {y}, "m" }}, {{ "v", {v}, "m/s" }}, {{ "a", {a}, "m/s^2" }}, {{ "j", {j}, "m/s^3" }}, {{ "T", {T}, "s" }} }}
return rd.model {{
  name = "law", gravity = {{ 0, 0, 0 }}, links = {{ {{ "a", joint = "x", mass = 1, spring = {{ x = 1 }} }} }},
  courses = function(s)
    local law = rd.timing {{ s.t, {law} }}
    return {{ way = law.way, duration = law.duration }}
  end,
}}"""
VALUES = {"y": 0.37, "v": 0.53, "a": 1.7, "j": 23, "T": 2.3}


def ways(law, folder, until, **values):
    """Times, ways and the duration of a law."""
    model = folder / "law.lua"
    model.write_text(FREE.format(law=law, **{**VALUES, **values}))
    run = columns(model, "--until", until, "--every", until / 997, "--step", until / 97, "--method", "rk4")
    return run["t"], run["way"], run["duration"][0]


@pytest.mark.parametrize("degree", [3, 5])
def test_knots_are_the_spline_of_scipy(degree, tmp_path):
    times = numpy.array([0, 0.31, 0.55, 0.83, 1.34, 1.6])
    heights = numpy.array([0.1, VALUES["y"], 0.5, 0.92, 0.9, 1.1])
    knots = ", ".join(f"{{ {t}, {'p.y' if i == 1 else h} }}" for i, (t, h) in enumerate(zip(times, heights)))
    rest = [(order, 0.0) for order in range(1, (degree + 1) // 2)]
    exact = scipy.interpolate.make_interp_spline(times, heights, k=degree, bc_type=(rest, rest))
    for scale, more in ((1, ""), (VALUES["T"] / 1.6, ", duration = p.T")):
        t, way, duration = ways(f"knots = {{ {knots} }}, degree = {degree}{more}", tmp_path, 2.9)
        assert duration == pytest.approx(1.6 * scale, rel=1e-14)
        assert numpy.max(numpy.abs(way - exact(numpy.minimum(t / scale, 1.6)))) < 1e-12


@pytest.mark.parametrize("count", [2, 3, 12])
def test_control_points_are_the_spline_of_scipy(count, tmp_path):
    """The derivatives are those of rd.rate, three times."""
    control = numpy.array([0.1, VALUES["y"], 0.5, 0.92, 0.9, 1.1, 1.3, 1.25, 1.9, 2, 2.2, 2.1])[:count]
    pieces = count + 1
    whole = numpy.concatenate([[control[0]] * 2, control, [control[-1]] * 2])
    exact = scipy.interpolate.BSpline(numpy.arange(-3, pieces + 4) / pieces * VALUES["T"], whole, 3)
    law = f"control = {{ {', '.join('p.y' if i == 1 else str(c) for i, c in enumerate(control))} }}, duration = p.T"
    (tmp_path / "law.lua").write_text(FREE.format(law=law, **VALUES).replace(
        "duration = law.duration", "duration = law.duration, rate = rd.rate(law.way), second = rd.rate(rd.rate(law.way)), third = rd.rate(rd.rate(rd.rate(law.way)))"))
    run = columns(tmp_path / "law.lua", "--until", 2.9, "--every", 2.9 / 997, "--step", 2.9 / 97, "--method", "rk4")
    t, T = run["t"], VALUES["T"]
    assert run["duration"][0] == T
    assert numpy.max(numpy.abs(run["way"] - exact(numpy.minimum(t, T)))) < 1e-12
    for order, name in enumerate(("rate", "second", "third"), 1):
        values = numpy.where(t < T, exact.derivative(order)(numpy.minimum(t, T)), 0)
        assert numpy.max(numpy.abs(run[name] - values)) < 1e-10 * numpy.max(numpy.abs(values))


def test_sixty_knots(tmp_path):
    random = numpy.random.default_rng(4)
    heights = numpy.cumsum(random.uniform(0, 1, 60))
    knots = ", ".join(f"{{ {i / 50}, {h:.17g} }}" for i, h in enumerate(heights))
    exact = scipy.interpolate.make_interp_spline(numpy.arange(60) / 50, heights, k=5, bc_type=([(1, 0.0), (2, 0.0)],) * 2)
    t, way, _ = ways(f"knots = {{ {knots} }}, degree = 5", tmp_path, 1.3)
    assert numpy.max(numpy.abs(way - exact(numpy.minimum(t, 1.18)))) < 1e-11 * heights[-1]


@pytest.mark.parametrize("values", [{}, {"v": 5.0}, {"a": 80.0, "j": 30.0}], ids=["usual", "short way", "low jerk"])
def test_bounds(values, tmp_path):
    """Differences of the way never exceed a bound, and reach those that are meant to hold it."""
    v, a, j = (({**VALUES, **values})[name] for name in "vaj")
    t, way, duration = ways("length = 0.7, rate = p.v, acceleration = p.a, jerk = p.j", tmp_path, 3.7, **values)
    assert duration == pytest.approx(0.7 / v + v / a + a / j, rel=1e-14)
    h, largest = t[1] - t[0], []
    for order in (1, 2, 3):
        largest.append(numpy.max(numpy.abs(numpy.diff(way, order))) / h**order)
    assert largest[0] < v * (1 + 1e-9) and largest[1] < a * (1 + 1e-7) and largest[2] < j * (1 + 1e-4)
    assert numpy.all(numpy.diff(way) > -1e-14) and way[0] == 0 and numpy.all(numpy.abs(way[t >= duration] - 0.7) < 1e-13)
    if not values:
        assert largest[0] > v * (1 - 1e-9) and largest[1] > a * (1 - 1e-7)


def test_without_jerk_the_acceleration_jumps(tmp_path):
    t, way, duration = ways("length = 0.7, rate = p.v, acceleration = p.a", tmp_path, 2.1)
    v, a = VALUES["v"], VALUES["a"]
    assert duration == pytest.approx(0.7 / v + v / a, rel=1e-14)
    x = numpy.minimum(t, duration)
    exact = numpy.where(x < v / a, a * x**2 / 2, numpy.where(x < 0.7 / v, v * x - v**2 / a / 2, 0.7 - a * (duration - x)**2 / 2))
    assert numpy.max(numpy.abs(way - exact)) < 1e-14


def test_speeds_along_the_way(tmp_path):
    """The square of the speed is linear in the way between knots."""
    speeds = numpy.array([0, 0.3, VALUES["v"], 0.2, 0.6, 0])
    text = ", ".join("p.v" if s == VALUES["v"] else f"{s}" for s in speeds)
    t, way, duration = ways(f"length = 0.9, speeds = {{ {text} }}", tmp_path, 4.3)
    assert duration == pytest.approx(sum(2 * 0.9 / 5 / (a + b) for a, b in zip(speeds, speeds[1:])), rel=1e-14)
    middle, rate = (way[2:] + way[:-2]) / 2, (way[2:] - way[:-2]) / (t[2:] - t[:-2])
    squares = numpy.interp(middle, numpy.linspace(0, 0.9, 6), speeds**2)
    inside = numpy.all([numpy.abs(t[1:-1] - knot) > 0.01 for knot in numpy.cumsum([0, *(0.36 / (a + b) for a, b in zip(speeds, speeds[1:]))])], axis=0)
    assert numpy.max(numpy.abs(rate**2 - squares)[inside & (t[1:-1] < duration)]) < 1e-4 and abs(way[-1] - 0.9) < 1e-14


@pytest.mark.parametrize("degree", [3, 5, 7, 9])
def test_smoothstep(degree, tmp_path):
    """The polynomial whose derivatives vanish at both ends, against its definition as an integral."""
    model = tmp_path / "step.lua"
    more = f", {degree}" if degree != 3 else ""
    model.write_text(f"""local rd = require "refdyn"
local p = rd.parameters {{ {{ "T", 1.7, "s" }} }}
return rd.model {{ name = "step", gravity = {{ 0, 0, 0 }}, links = {{ {{ "a", joint = "x", mass = 1, spring = {{ x = 1 }} }} }},
  courses = function(s) return {{ way = rd.smoothstep(s.t, 0.2, p.T{more}) }} end }}""")
    run = columns(model, "--until", 2, "--every", 0.05)
    k = (degree - 1) // 2
    bell = numpy.poly1d([1, 0])**k * numpy.poly1d([-1, 1])**k
    exact = (bell.integ() / bell.integ()(1))(numpy.clip((run["t"] - 0.2) / 1.5, 0, 1))
    assert numpy.max(numpy.abs(run["way"] - exact)) < 1e-13


# ---- Shapers ----

OSCILLATOR = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "w", {w}, "rad/s" }}, {{ "z", {z}, "1" }}, {{ "f", {f}, "Hz" }}, {{ "T", 0.37, "s" }} }}
return rd.model {{
  name = "oscillator", gravity = {{ 0, 0, 0 }},
  links = {{ {{ "a", joint = "x", mass = 1, spring = {{ x = p.w^2 }}, damper = {{ x = 2 * p.z * p.w }} }} }},
  forces = function(s)
    local course = rd.smoothstep(s.t, 0.05, 0.05 + p.T)
    return {{ a_x = p.w^2 * {course} }}
  end,
}}"""


def residual(course, folder, z, detuned=1.0):
    """Amplitude of the vibration at a time after the move. Of a decaying one the first parts have then decayed more."""
    w = 2 * numpy.pi * 1.7
    damped = w * (1 - z**2)**0.5
    model = folder / "oscillator.lua"
    model.write_text(OSCILLATOR.format(w=w, z=z, f=damped / (2 * numpy.pi) * detuned, course=course))
    run = columns(model, "--until", 1.6, "--tol", 1e-12, "--every", 0.4)
    x, xd = run["a_x"][-1] - 1, run["a_x_d"][-1]
    return numpy.hypot(x, (xd + z * w * x) / damped)


@pytest.mark.parametrize("z", [0.0, 0.07])
@pytest.mark.parametrize("kind, exact, detuned", [("zv", 1e-9, 0.17), ("zvd", 1e-9, 0.03), ("ei", 0.055, 0.055)])
def test_what_a_shaper_leaves_of_one_mode(kind, exact, detuned, z, tmp_path):
    plain = residual("course", tmp_path, z)
    shaped = f'rd.shaper {{ course, frequency = p.f, damping = p.z, kind = "{kind}" }}'
    assert plain > 0.1
    later = numpy.exp(2 * numpy.pi * z / (1 - z**2)**0.5) if kind == "ei" else 1  # the unshaped vibration, a period before
    assert residual(shaped, tmp_path, z) < exact * plain * later
    assert residual(shaped, tmp_path, z, 1.1) < detuned * plain * later
    if kind == "ei":
        assert residual(shaped, tmp_path, z) > 0.045 * plain * later


def test_a_shaper_of_a_shaper(tmp_path):
    """Two modes: a shaper takes what the other one makes. The first alone leaves its share of the second."""
    one = 'rd.shaper { course, frequency = 2.9 }'
    both = f'rd.shaper {{ {one}, frequency = p.f, damping = p.z }}'
    plain = residual("course", tmp_path, 0.03)
    assert residual(both, tmp_path, 0.03) < 1e-9 * plain < 0.1 * residual(one, tmp_path, 0.03)


HUB = """local rd = require "refdyn"
local p = rd.parameters { { "E", 7e10, "Pa" }, { "f", 1, "Hz" }, { "T", 1, "s" } }
local kind = rd.option("kind", "none", { "none", "zv", "zvd", "ei" })
return rd.model {
  name = "hub", gravity = { 0, 0, 0 },
  links = {
    { "hub", joint = "psi", mass = 1, inertia = { zz = 0.02 } },
    { "link", on = "hub",
      beam = { length = 1, section = rd.rectangle(0.005, 0.03), E = p.E, nu = 0.33, rho = 2700, rfe = 9, dofs = "psi" } },
    { "tip", on = "link.tip", mass = 0.1 },
  },
  points = { E = "tip" },
  constraints = function(s)
    local angle = rd.pi / 2 * rd.smoothstep(s.t, 0, p.T)
    if kind ~= "none" then angle = rd.shaper { angle, frequency = p.f, kind = kind } end
    return { rd.drive { "hub_psi", angle, alpha = 0, beta = 0 } }
  end,
}"""


def peak_to_peak(run, period):
    """Of the tip across the link, over the last period and a half."""
    late = run["t"] > run["t"][-1] - 1.5 * period
    return numpy.ptp(run["E_x"][late])


@pytest.mark.parametrize("T", [0.4, 1.0])
@pytest.mark.parametrize("kind, tuned, detuned", [("zv", 0.02, 0.3), ("zvd", 0.005, 0.06), ("ei", 0.08, 0.06)])
def test_hub_driven_link(kind, tuned, detuned, T, tmp_path):
    model = tmp_path / "hub.lua"
    model.write_text(HUB)
    refdyn("modes", model, "--at", "initial", "--hold", "hub_psi", "-o", tmp_path / "modes.json")
    f = json.loads((tmp_path / "modes.json").read_text())["modes"][0]["frequency"]

    def run(kind, factor):
        found = columns(model, "--set", f"kind={kind}", "--set", f"f={f * factor}", "--set", f"T={T}", "--until", T + 2, "--every", 0.005, "--tol", 1e-8)
        return peak_to_peak(found, 1 / f)
    plain = run("none", 1)
    assert run(kind, 1) < tuned * plain and run(kind, 1.1) < detuned * plain


TURN = """local rd = require "refdyn"
local model, kind, f = rd.model, rd.option("kind", "none", { "none", "zv", "zvd", "ei" }), rd.parameter("f", 1, "Hz")
function rd.model(it)
  it.links[3].start.psi = 0.7
  it.forces, it.courses, it.dependent = nil, nil, nil
  it.hold = { "column_psi", "arm_psi", "effector_z" }
  function it.constraints(s)
    local angle = rd.pi / 2 * rd.smoothstep(s.t, 0, 0.6, 3)
    if kind ~= "none" then angle = rd.shaper { angle, frequency = f, kind = kind } end
    return { rd.drive { "column_psi", angle }, rd.lock { "arm_psi" }, rd.lock { "effector_z" } }
  end
  return model(it)
end
return require "manipulator"
"""


@pytest.mark.parametrize("kind, left", [("zv", 0.15), ("zvd", 0.06), ("ei", 0.05)])
def test_reference_manipulator_at_a_large_move(kind, left, tmp_path):
    """The column turns by 90 degrees in 0.6 s; the shaper is for the first lateral mode."""
    (tmp_path / "turn.lua").write_text(TURN)
    (tmp_path / "manipulator.lua").write_text((MODELS / "manipulator.lua").read_text())
    refdyn("modes", tmp_path / "turn.lua", "-o", tmp_path / "modes.json")
    modes = json.loads((tmp_path / "modes.json").read_text())["modes"]
    f = next(mode["frequency"] for mode in modes if abs(mode["points"]["E"]["re"][1]) > 1)

    def vibration(kind):
        run = columns(tmp_path / "turn.lua", "--from", "statics", "--set", f"kind={kind}", "--set", f"f={f}", "--until", 3.5, "--every", 0.002, "--tol", 1e-7)
        return numpy.ptp(run["E_x"][run["t"] > 2])
    assert vibration(kind) < left * vibration("none")
