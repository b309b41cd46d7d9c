"""The models of the gallery compared with closed forms, published figures and identities; their page."""
import json
import re
import struct

import mpmath
import numpy
import pytest
from numpy import arctan2, cos, pi, sin, sqrt

import draw_gallery
from program import LONG, MODELS, SCALE, SOURCE, all_models, check, close, evaluate, motion, refdyn, settings

FINE = ["--method", "rk8", "--tol", "1e-12", "--stabilise", "project"]


def classical_steps(slope, t, y, until, step):
    """The state at `until` by the classical Runge-Kutta method, in equal steps of about `step`, and its time."""
    steps = round((until - t) / step)
    for h in [(until - t) / max(steps, 1)] * steps:
        k1 = slope(t, y)
        k2 = slope(t + h / 2, y + h / 2 * k1)
        k3 = slope(t + h / 2, y + h / 2 * k2)
        y, t = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(t + h, y + h * k3)), t + h
    return y, t


def model(name):
    return MODELS / (name + ".lua")


def statics(name, *arguments, **values):
    return json.loads(refdyn("statics", model(name), *settings(values), *arguments).stdout)


def states(run, names):
    return numpy.array([run[name] for name in names]).T, numpy.array([run[name + "_d"] for name in names]).T


def names_of(name, *arguments):
    return evaluate(model(name), None, *arguments)["coordinates"]


def mass_matrix(name, q):
    return numpy.array(evaluate(model(name), {"q": list(map(float, q))})["M"])


def balanced(summary, tolerance):
    error = summary["energy_error"]
    return "" if error <= tolerance * SCALE else f"energy: balance error {error:.1e}, allowed {tolerance * SCALE:.0e}"


# ---- four-bar linkage ----

A, B, C, D = 0.2, 0.6, 0.45, 0.55


def fourbar_angles(crank):
    """Freudenstein: d/a cos r - d/c cos t + K = cos(t - r), t the crank, r the rocker; then the coupler."""
    K1, K2, K3 = D / A, D / C, (A**2 - B**2 + C**2 + D**2) / (2 * A * C)
    first, second, third = cos(crank) - K1 - K2 * cos(crank) + K3, -2 * sin(crank), K1 - (K2 + 1) * cos(crank) + K3
    rocker = 2 * arctan2(-second - sqrt(second**2 - 4 * first * third), 2 * first)
    return arctan2(C * sin(rocker) - A * sin(crank), D + C * cos(rocker) - A * cos(crank)), rocker


def fourbar_rate(crank, start, torque):
    """The crank's rate from rest: torque times angle equals the gain of kinetic and potential energy."""
    masses = {length: 2700 * length * 0.04 * 0.01 for length in (A, B, C)}
    own = {length: mass * (length**2 + 0.04**2) / 12 for length, mass in masses.items()}

    def height_of_all(crank):
        coupler, rocker = fourbar_angles(crank)
        return (masses[A] * A / 2 * sin(crank) + masses[B] * (A * sin(crank) + B / 2 * sin(coupler))
                + masses[C] * C / 2 * sin(rocker))

    coupler, rocker = fourbar_angles(crank)
    by_coupler = A * sin(rocker - crank) / (B * sin(coupler - rocker))
    by_rocker = A * sin(crank - coupler) / (C * sin(rocker - coupler))
    across = A**2 + (B / 2 * by_coupler)**2 + A * B * by_coupler * cos(crank - coupler)
    inertia = (own[A] + masses[A] * A**2 / 4 + own[B] * by_coupler**2 + masses[B] * across
               + (own[C] + masses[C] * C**2 / 4) * by_rocker**2)
    work = torque * (crank - start) - 9.81 * (height_of_all(crank) - height_of_all(start))
    return sqrt(numpy.maximum(2 * work / inertia, 0))


def turned(angle):
    return (angle + pi) % (2 * pi) - pi


@pytest.mark.parametrize("joints", ["planar", "spatial"])
def test_fourbar(joints):
    """Over more than a turn. With hinges in space, the rows across the plane are redundant and named."""
    run, said, summary = motion(model("fourbar"), "--set", f"joints={joints}", "--until", 0.6, *FINE)
    crank = run["crank_psi"]
    coupler, rocker = fourbar_angles(crank)
    assert crank[-1] - crank[0] > 2 * pi
    redundant = "redundant rows, left out: close 1 z, close 1 turn 1, close 1 turn 2\n"
    assert (redundant in said) == (joints == "spatial"), said
    check([close("rocker", turned(run["rocker_psi"] - rocker), 0 * rocker, 1e-13),
           close("coupler", turned(crank + run["coupler_psi"] - coupler), 0 * coupler, 1e-12),
           close("rate", run["crank_psi_d"], fourbar_rate(crank, 1.1, 1.5), 1e-10), balanced(summary, 1e-9)])


def test_fourbar_is_the_same_with_spatial_joints():
    planar, spatial = (motion(model("fourbar"), "--set", f"joints={joints}", "--until", 0.6, *FINE)[0]
                       for joints in ("planar", "spatial"))
    names = [name for name in planar if not name.startswith(("phi_", "psi_", "lambda_", "force_"))]
    check([close(name, spatial[name], planar[name], 1e-9) for name in names])


# ---- Bricard's linkage ----

@pytest.mark.parametrize("stabilise", ["project", "baumgarte"])
@pytest.mark.parametrize("method", ["rk54", "rk8", "rodas5p"])
def test_bricard_between_steps(method, stabilise):
    """Off the programme the redundant row looks independent and contradicts the others. Nevertheless the linkage neither stops there nor
    needs shorter steps than its errors require."""
    steps = []
    for tol in "1e-4", "1e-9":
        run, _, summary = motion(model("bricard"), "--until", 2, "--method", method, "--tol", tol, "--stabilise", stabilise)
        assert summary["partition_changes"] < 10
        steps.append(summary["steps"])
    check([close("end", run["rod1_theta"][-1:], [3.5947538183], 1e-6), balanced(summary, 1e-6)])
    assert steps[0] < steps[1] / 3, steps


def test_bricard():
    """One of five rows is redundant during the whole motion; the swing is large; the angles keep threefold symmetry."""
    run, said, summary = motion(model("bricard"), "--until", 2, *FINE)
    assert len(re.findall("redundant rows, left out: close 1 [a-z0-9 ]+\n", said)) == 1, said
    corners = [numpy.array([run[f"{name}_{axis}"] for axis in "xyz"]) for name in "ABCDE"]
    corners = [0 * corners[0], *corners, 0 * corners[0]]
    rods = [end - start for start, end in zip(corners, corners[1:])]
    cosines = [(first * second).sum(axis=0) for first, second in zip(rods, rods[1:] + rods[:1])]
    even, odd = cosines[0], cosines[1]
    assert numpy.ptp(run["rod2_psi"]) > 3
    check([close(f"angle {i + 1}", cosine, (even, odd)[i % 2], 1e-10) for i, cosine in enumerate(cosines)]
          + [close("loop", [summary["phi_max"]], [0], 1e-12), balanced(summary, 1e-9),
             close("symmetry", even + odd + even * odd, 0 * even, 1e-10, 1),
             close("end", corners[5].T - (0, 0, 1), 0 * corners[5].T, 1e-9)])


# ---- gantry ----

def test_gantry():
    bridge, trolley, ram = 7850 * 0.2 * 3 * 0.1 + 30, 25, 7850 * pi / 4 * (0.08**2 - 0.06**2) * 1.2 + 20
    carried = numpy.array([bridge + trolley + ram, trolley + ram, ram])
    M = evaluate(model("gantry"), {"q": [0.3, -0.2, 0.1]})["M"]
    run, _, summary = motion(model("gantry"), "--until", 3, *FINE)
    part, T = numpy.minimum(run["t"] / 2, 1), 2
    place, rate = 3 * part**2 - 2 * part**3, 6 * (part - part**2) / T
    acceleration = (6 - 12 * part) / T**2 * (run["t"] < 2)
    drag, weight = {"bridge_x": 80, "trolley_y": 40, "ram_z": 0}, {"ram_z": 9.81 * ram}
    lines = [close("M", M, numpy.diag(carried).tolist(), 1e-15), balanced(summary, 1e-9)]
    smooth = abs(run["t"] - 2) > 1e-9
    for mass, name, reach in zip(carried, ("bridge_x", "trolley_y", "ram_z"), (1.5, -0.8, -0.6)):
        force = mass * reach * acceleration + drag[name] * numpy.tanh(reach * rate / 0.01) + weight.get(name, 0)
        lines += [close(name, run[name], reach * place, 1e-12),
                  close(name + "_d", run[name + "_d"], reach * rate, 1e-12),
                  close("force of " + name, run["force_" + name][smooth], force[smooth], 1e-11)]
    check(lines)


# ---- beams ----

def torsion_constant(a, b):
    """Torsion constant of a rectangle by Saint-Venant's series (Timoshenko and Goodier, sect. 109)."""
    odd = numpy.arange(1, 999, 2)
    return a * b**3 / 3 * (1 - 192 * b / (pi**5 * a) * (numpy.tanh(odd * pi * a / (2 * b)) / odd**5).sum())


E_ALU, G_ALU = 7e10, 7e10 / (2 * 1.33)
SECTIONS = [  # length, Iy, Iz, It
    (0.6, 0.03 * 0.05**3 / 12, 0.05 * 0.03**3 / 12, torsion_constant(0.05, 0.03)),
    (0.4, *[pi / 64 * (0.03**4 - 0.02**4)] * 2, pi / 32 * (0.03**4 - 0.02**4)),
    (0.3, *[pi / 64 * 0.016**4] * 2, pi / 32 * 0.016**4)]


def stepped_deflection(x, load, which):
    """int_0^x (x - s) P (L - s) / (E I(s)) ds"""
    total, start, L = 0, 0, 1.3
    for length, *inertias in SECTIONS:
        end = min(start + length, x)
        if end > start:
            antiderivative = lambda s: x * L * s - (x + L) * s**2 / 2 + s**3 / 3
            total += load * (antiderivative(end) - antiderivative(start)) / (E_ALU * inertias[which])
        start += length
    return total


def test_stepped_beam():
    """The sections turn at midpoints of equal parts: the error falls like (2 n - 1)^-2, and extrapolation is exact."""
    load, across, torque = 1e-3, 3e-4, 2e-3
    found = [statics("stepped", n=n, P_down=load, P_across=across)["points"] for n in (1, 2)]
    lines = []
    for name, x in {"first": 0.6, "second": 1.0, "tip": 1.3}.items():
        coarse, fine = (numpy.array(points[name]) for points in found)
        extrapolated = fine + (fine - coarse) / 8
        lines += [close(name + " z", extrapolated[2:], [-stepped_deflection(x, load, 0)], 1e-12),
                  close(name + " y", extrapolated[1:2], [stepped_deflection(x, across, 1)], 1e-12)]
    twisted = statics("stepped", P_down=0.0, P_across=0.0, T_tip=torque)
    twist = sum(q for name, q in zip(twisted["coordinates"], twisted["q"]) if "_phi_" in name)
    expected = sum(torque * length / (G_ALU * It) for length, _, _, It in SECTIONS)
    check(lines + [close("twist", [twist], [expected], 1e-12)])


def test_link_in_the_middle_of_a_beam():
    """Small gravity keeps the problem linear. The hinge is at a cell's end for 5 and 10 cells, where extrapolation is exact."""
    L, a, EI, g = 1.5, 0.9, 2.1e11 * pi / 64 * 0.02**4, 1e-4
    P, w = 3 * g, 7800 * pi / 4 * 0.02**2 * g

    def deflection(x):
        near = min(x, a)
        by_load = P * near**2 * (3 * a - near) / 6 + (x - near) * P * a**2 / 2
        return (by_load + w * x**2 * (6 * L**2 - 4 * L * x + x**2) / 24) / EI

    slope = P * a**2 / (2 * EI) + w * a * (3 * L**2 - 3 * L * a + a**2) / (6 * EI)
    coarse, fine = (statics("midspan", n_rfe=n, g=g) for n in (6, 11))
    lines = []
    for name, x, below in ("hinge", a, 0), ("tip", L, 0), ("load", a, 0.4):
        sag = [-found["points"][name][2] - below for found in (coarse, fine)]
        lines.append(close(name, [sag[1] + (sag[1] - sag[0]) / 3], [deflection(x)], 1e-8))
    hangs = [found["q"][found["coordinates"].index("rope_theta")] for found in (coarse, fine)]
    check(lines + [close("rope", [hangs[1] + (hangs[1] - hangs[0]) / 3], [-slope], 1e-12)])


# ---- five-bar robot ----

def test_fivebar():
    run, _, summary = motion(model("fivebar"), "--until", 2, "--every", 0.002, "--method", "rk54", "--step", "0.002")
    course = lambda t: 0.5 * (1 - cos(4 * t)) / 2
    left, right = 2.3 + course(run["t"]), 0.9 - 0.6 * course(1.7 * run["t"])
    start, end = (numpy.array([side + 0.35 * cos(angle), 0.35 * sin(angle)])
                  for side, angle in ((-0.15, left), (0.15, right)))
    apart = end - start
    half = sqrt((apart**2).sum(axis=0)) / 2
    across = numpy.array([-apart[1], apart[0]]) / (2 * half)
    tool = (start + end) / 2 + across * sqrt(0.5**2 - half**2)
    power = sum(run["force_" + name] * run[name + "_d"] for name in ("left_psi", "right_psi"))
    rate = numpy.gradient(run["energy"], run["t"], edge_order=2)
    assert numpy.ptp(tool, axis=1).min() > 0.1
    check([close("left", run["left_psi"], left, 1e-12), close("right", run["right_psi"], right, 1e-12),
           close("tool", [run["tool_x"], run["tool_y"]], tool, 1e-12), balanced(summary, 1e-12),
           close("power", power[2:-2], rate[2:-2], 5e-4)])


# ---- crane ----

def test_crane_swings_as_a_pendulum():
    """With a stiff boom, a held rope and no drive: the swing is zero after a quarter of the period, and reversed after a half."""
    period = 4 * sqrt(2.5 / 9.81) * float(mpmath.ellipk(sin(0.9 / 2)**2))
    run, _, _ = motion(model("crane"), *settings({"n_rfe": 1, "slew": 0, "lift": 0, "swing": 0.9}),
                       "--until", repr(float(period)), "--every", repr(float(period / 4)), *FINE)
    check([close("swing", run["rope_theta"], [0.9, 0, -0.9, 0, 0.9], 1e-8)])


def test_crane_balances():
    """Slewing and hoisting: the angular momentum about the column is the motor's angular impulse, and energy is balanced. Stability
    determines the steps, so that errors at tolerances a factor of ten apart differ by a factor of 80: from 7e-12 to 6e-10 about 1e-9, at
    most 1e-11 here."""
    names = names_of("crane")
    run, _, summary = motion(model("crane"), "--until", 4, "--every", 1, "--method", "rk8", "--tol", "1e-10")
    q, qd = states(run, names)
    moment = [mass_matrix("crane", at)[0] @ rate for at, rate in zip(q, qd)]
    given = 20 * numpy.where(run["t"] < 1, run["t"] - sin(pi * run["t"]) / pi, 2 * run["t"] - 1) / 2
    assert abs(run["load_z"][-1] + 1.7) < 1e-9
    check([close("moment of momentum", moment, given, 1e-10), balanced(summary, 1e-9)])


# ---- jib ----

JIB_EI, JIB_MASS = 2.1e11 * pi / 64 * (0.15**4 - 0.14**4), 7850 * pi / 4 * (0.15**2 - 0.14**2)


def jib_knots(run, axis):
    """Coefficients of the natural cubic splines through the knots at each time: their values, and their curvatures times cells^-2."""
    values = numpy.array([run[name] for name in sorted(name for name in run if name.startswith("knot_") and name.endswith("_" + axis))])
    inner = len(values) - 2
    curvatures = numpy.zeros_like(values)
    curvatures[1:-1] = numpy.linalg.solve(4 * numpy.eye(inner) + numpy.eye(inner, k=1) + numpy.eye(inner, k=-1), 6 * numpy.diff(values, 2, axis=0))
    return values, curvatures


def jib_spline(run, axis):
    """Place and slope of the spline where the trolley is."""
    values, curvatures = jib_knots(run, axis)
    at, moment = run["travel_x"] / 8 * (len(values) - 1), numpy.arange(len(run["t"]))
    cell = numpy.minimum(at.astype(int), len(values) - 2)
    b = at - cell
    a = 1 - b
    left, right, bent, rebent = values[cell, moment], values[cell + 1, moment], curvatures[cell, moment], curvatures[cell + 1, moment]
    return (a * left + b * right + ((a**3 - a) * bent + (b**3 - b) * rebent) / 6,
            (right - left + ((3 * b**2 - 1) * rebent - (3 * a**2 - 1) * bent) / 6) * (len(values) - 1) / 8)


def test_jib_sags():
    """Small gravity keeps the problem linear. The trolley stands at a cell's end for 2 and 4 cells, where extrapolation is exact."""
    g, lines = 1e-4, []
    for place in (4, 8):
        coarse, fine = (-2.5 - statics("jib", n_rfe=n, g=g, near=place)["points"]["load"][2] for n in (3, 5))
        sag = 240 * g * place**3 / 3 + JIB_MASS * g * place**2 * (6 * 64 - 32 * place + place**2) / 24
        lines.append(close(f"trolley at {place} m", [fine + (fine - coarse) / 3], [sag / JIB_EI], 1e-8))
    check(lines)


def test_jib_trolley_rolls_freely():
    """Without a drive, the trolley is on the natural spline through the knots. The spline pushes it at right angles, except for the inertia
    of its wheels. The energy is constant."""
    run, _, summary = motion(model("jib"), *settings({"drive": "input", "eta": 0}), "--until", 4, "--every", 0.05, "--method", "rk8", "--tol", "1e-10")
    places, slopes = zip(*(jib_spline(run, axis) for axis in "xyz"))
    pushed = sum(slope * run["force_trolley_" + axis] for slope, axis in zip(slopes, "xyz"))
    assert numpy.ptp(run["travel_x"]) > 0.5
    check([close("place", [run["trolley_" + axis] for axis in "xyz"], places, 1e-12), balanced(summary, 1e-8),
           close("push", pushed, -run["force_travel_x"], 1e-9, 240), close("energy", numpy.ptp(run["energy"]), 0, 1e-8, 240)])


def jib_theory(times, size=5, step=1e-3):
    """Height of the tip and of the trolley, and angle of the rope: a mass with a pendulum moves along a beam in its plane. The beam bends
    by polynomials (x/L)^2 ..., and the fourth-order rule integrates. The motion begins at the equilibrium."""
    L, rope, trolley, load, g, T = 8, 2.5, 40, 200, 1, 4
    k = numpy.arange(2, size + 2)
    power = k[:, None] + k
    own, bending = JIB_MASS * L / (power + 1), JIB_EI * numpy.multiply.outer(k * (k - 1), k * (k - 1)) / (power - 3) / L**3

    def slope(t, y):
        a, angle, ad, rate = y[:size], y[size], y[size + 1:-1], y[-1]
        x, xd, xdd = 3 + 4 * smooth(t, 0, T), 4 * 6 * (t - t**2 / T) / T**2, 4 * 6 * (1 - 2 * t / T) / T**2
        z = x / L
        shape, tilt, curve = z**k, k * z**(k - 1) / L, k * (k - 1) * z**(k - 2) / L**2
        carried = 2 * xd * tilt @ ad + (xdd * tilt + xd**2 * curve) @ a
        mass = numpy.empty((size + 1, size + 1))
        mass[:size, :size] = own + (trolley + load) * numpy.outer(shape, shape)
        mass[:size, size] = mass[size, :size] = load * rope * sin(angle) * shape
        mass[size, size] = load * rope**2
        force = numpy.append(-bending @ a - g * JIB_MASS * L / (k + 1)
                             - shape * ((trolley + load) * (carried + g) + load * rope * cos(angle) * rate**2),
                             -load * rope * (sin(angle) * (carried + g) - cos(angle) * xdd))
        return numpy.concatenate([y[size + 1:], numpy.linalg.solve(mass, force)])

    hangs = numpy.linalg.solve(bending, -g * (JIB_MASS * L / (k + 1) + (trolley + load) * (3 / L)**k))
    y, t, found = numpy.append(hangs, numpy.zeros(size + 2)), 0.0, []
    for until in times:
        y, t = classical_steps(slope, t, y, until, step)
        found.append([y[:size].sum(), ((3 + 4 * smooth(t, 0, T)) / L)**k @ y[:size], y[size]])
    return numpy.array(found).T


def test_jib_under_a_moving_mass():
    """Theory and extrapolation of the elements neglect the thrust of the drive along the jib, and the phase of its higher modes."""
    coarse, fine = (motion(model("jib"), *settings({"n_rfe": n, "g": 1, "near": 3, "far": 7, "T": 4, "eta": 0}), "--from", "statics",
                           "--until", 4, "--every", 0.1, "--tol", "1e-8")[0] for n in (4, 7))
    coarse["tip"], fine["tip"] = coarse["knot_3_z"], fine["knot_6_z"]
    tip, height, angle = jib_theory(fine["t"])
    extrapolated = {name: fine[name] + (fine[name] - coarse[name]) / 3 for name in ("tip", "trolley_z", "rope_theta")}
    assert numpy.ptp(height) > 0.01 and abs(angle).max() > 0.8
    check([close("tip", extrapolated["tip"], tip, 6e-3), close("trolley", extrapolated["trolley_z"], height, 6e-3),
           close("rope", extrapolated["rope_theta"], angle, 1e-4)])


# ---- slider-crank ----

def crank_course(t):
    """Angle, rate and acceleration of the driven crank."""
    rate, T = 15, 0.3
    rising = numpy.minimum(t, T)
    return (0.6 + rate * (rising / 2 - T / (2 * pi) * sin(pi * rising / T) + numpy.maximum(t - T, 0)),
            rate * (1 - cos(pi * rising / T)) / 2, rate * pi / T * sin(pi * rising / T) / 2)


def test_slidercrank_with_a_stiff_rod():
    run, _, summary = motion(model("slidercrank"), "--set", "n_rfe=1", "--until", 1, *FINE)
    angle, rate, acceleration = crank_course(run["t"])
    r, l = 0.15, 0.5
    root = sqrt(l**2 - (r * sin(angle))**2)
    slope = -r * sin(angle) - r**2 * sin(angle) * cos(angle) / root
    bend = -r * cos(angle) - r**2 * (cos(2 * angle) / root + (r * sin(angle) * cos(angle))**2 / root**3)
    check([close("x", run["slider_x"], r * cos(angle) + root, 1e-12), close("y", run["slider_y"], 0 * angle, 1e-12, 1),
           close("xd", run["slider_xd"], slope * rate, 1e-11),
           close("xdd", run["slider_xdd"], slope * acceleration + bend * rate**2, 1e-9), balanced(summary, 1e-9)])


def test_slidercrank_nears_the_stiff_rod():
    """In a slow motion the rod bends in proportion to 1 / E."""
    slow = ["--set", "rate=3", "--set", "T=1", "--until", 1.5, "--every", 0.05, "--method", "rk54", "--tol", "1e-10"]
    stiff, _, _ = motion(model("slidercrank"), "--set", "n_rfe=1", *slow)
    soft, twice = (motion(model("slidercrank"), "--set", f"E={E}", "--set", "eta=1e-3", *slow) for E in (7e9, 1.4e10))
    bent = [numpy.array([run["middle_" + axis] - stiff["middle_" + axis] for axis in "xy"])
            for run, _, _ in (soft, twice)]
    check([close("bending", bent[0], 2 * bent[1], 0.02), balanced(soft[2], 1e-6)])


# ---- space arm ----

def momentum(q, qd):
    """Mass, centre of mass, momentum and angular momentum about the origin, from the rows of M qd of the free base."""
    M = mass_matrix("spacearm", q)
    x, y, z, psi, theta, _ = q[:6]
    generalized, mass = M @ qd, M[0, 0]
    center = numpy.array([x + M[1, 3] / mass, y - M[0, 3] / mass, z + M[0, 4] / (mass * cos(psi))])
    Rz = numpy.array([[cos(psi), -sin(psi), 0], [sin(psi), cos(psi), 0], [0, 0, 1]])
    Ry = numpy.array([[cos(theta), 0, sin(theta)], [0, 1, 0], [-sin(theta), 0, cos(theta)]])
    axes = numpy.array([[0, 0, 1], Rz[:, 1], (Rz @ Ry)[:, 0]])
    about_base = numpy.linalg.solve(axes, generalized[3:6])
    return mass, center, generalized[:3], about_base + numpy.cross([x, y, z], generalized[:3])


def test_spacearm():
    names = names_of("spacearm")
    run, _, summary = motion(model("spacearm"), "--until", 4, "--every", 0.5, "--method", "rk54", "--tol", "1e-9")
    found = zip(*(momentum(q, qd) for q, qd in zip(*states(run, names))))
    masses, centers, momenta, moments = (numpy.array(column) for column in found)
    sphere, tube = 300 * pi / 6 * 0.5**3, 2700 * pi / 4 * (0.1**2 - 0.09**2) * 1.5
    total = 150 + 8 + sphere + tube + 2700 * pi / 4 * (0.04**2 - 0.036**2) * 1.6 + 12
    assert numpy.ptp(run["shoulder_psi"]) > 0.1 and numpy.ptp(run["satellite_psi"]) > 0.05
    check([close("mass", masses, total + 0 * masses, 1e-12),
           close("momentum", momenta, momenta[0] + 0 * momenta, 1e-12),
           close("moment of momentum", moments, moments[0] + 0 * moments, 1e-12),
           close("centre", centers, centers[0] + numpy.outer(run["t"], momenta[0] / total), 1e-12),
           balanced(summary, 1e-7)])


# ---- planar arm, branched tree ----

def test_planar_arm():
    """With rigid links, the joints follow from the tip's path by the law of cosines; with flexible links the tip keeps that path."""
    run, _, summary = motion(model("planar"), "--set", "n_rfe=1", "--until", 2, *FINE)
    l1, l2, t = 0.8, 0.63, run["t"]
    rising = numpy.minimum(t, 1)
    along = 0.1 * (rising**3 - rising**4 / 2 + numpy.maximum(t - 1, 0))
    x, y = l1 * cos(0.4) + l2 * cos(1.5) + along, l1 * sin(0.4) + l2 * sin(1.5) - along
    lower = numpy.arccos((x**2 + y**2 - l1**2 - l2**2) / (2 * l1 * l2))
    upper = arctan2(y, x) - arctan2(l2 * sin(lower), l1 + l2 * cos(lower))
    flexible, _, bent = motion(model("planar"), "--until", 2, "--method", "rk54", "--tol", "1e-8")
    check([close("upper", run["upper_psi"], upper, 1e-12), close("lower", run["lower_psi"], lower, 1e-12),
           close("tip", [flexible["tip_x"], flexible["tip_y"]], [x, y], 1e-12),
           balanced(summary, 1e-9), balanced(bent, 1e-7)])


def test_branched_tree():
    """The nod's row is a linear oscillator; the free body's translation carries all masses."""
    M = mass_matrix("branched", [0.1 * (i % 3 - 1) for i in range(17)])
    total = 6.5 + 1.1 + 0.45 + 0.2 + 1200 * 2e-4 * 0.9
    names = names_of("branched")
    slides = [names.index("body_" + axis) for axis in "xyz"]
    run, _, summary = motion(model("branched"), "--until", 2, "--method", "rk54", "--tol", "1e-10",
                             "--stabilise", "baumgarte")
    nod = (sin(sqrt(3) * run["t"]) / sqrt(3) - sin(run["t"])) / 4
    check([close("total mass", M[numpy.ix_(slides, slides)], total * numpy.eye(3), 1e-14),
           close("nod", run["tail_phi"], nod, 1e-12),
           close("reach", run["phi_1"], 0 * nod, 1e-9), balanced(summary, 1e-9)])


# ---- SCARA ----

SCARA_LENGTHS, SCARA_SECTIONS = (0.4, 0.25), [(pi / 4 * d**2 * 0.19, pi / 64 * d**4 * (1 - 0.9**4)) for d in (0.04, 0.03)]


def smooth(t, start, end):
    part = numpy.clip((t - start) / (end - start), 0, 1)
    return 3 * part**2 - 2 * part**3


def scara_course(t):
    """Across and up: there and back, 0.75 s each."""
    ways = [smooth(t, 0.75 * start, 0.75 * end) for start, end in ((0.1, 0.9), (1.1, 1.9), (0, 0.2), (0.8, 1), (1, 1.2), (1.8, 2))]
    return 0.305 * (ways[0] - ways[1] - 0.5), 0.025 * (ways[2] - ways[3] + ways[4] - ways[5])


def scara_angles(t):
    """Angles of rigid links whose tool moves across at x = 0.4 m."""
    (l1, l2), y = SCARA_LENGTHS, scara_course(t)[0]
    lower = numpy.arccos((0.16 + y**2 - l1**2 - l2**2) / (2 * l1 * l2))
    return numpy.array([arctan2(y, 0.4) - arctan2(l2 * sin(lower), l1 + l2 * cos(lower)), lower])


def scara_torques(q, qd, qdd):
    """Two links in a plane: hub, beams with their sections' inertia, elbow, quill, and the rotors, each acting only at its own joint."""
    (l1, l2), [(A1, I1), (A2, I2)] = SCARA_LENGTHS, SCARA_SECTIONS
    m1, m2 = 2700 * A1 * l1, 2700 * A2 * l2
    upper = 4 * 0.1**2 / 8 + m1 * l1**2 / 3 + 2700 * I1 * l1 + 2e-5 * 80**2
    lower = 1.5 * 0.06**2 / 8 + m2 * l2**2 / 3 + 2700 * I2 * l2 + l2**2 + 0.02**2 / 8
    coupling, carried = l1 * (m2 * l2 / 2 + l2), 1.5 + m2 + 1
    M11, M12 = upper + carried * l1**2 + lower + 2 * coupling * cos(q[1]), lower + coupling * cos(q[1])
    bend = coupling * sin(q[1])
    return (M11 * qdd[0] + M12 * qdd[1] - bend * (2 * qd[0] + qd[1]) * qd[1],
            M12 * qdd[0] + (lower + 1e-5 * 50**2) * qdd[1] + bend * qd[0]**2)


def test_scara_with_stiff_links():
    run, _, summary = motion(model("scara"), "--set", "n_rfe=1", "--until", 1.7, "--every", 0.031, *FINE)
    t, h = run["t"], 1e-4
    before, q, after = (scara_angles(t + dt) for dt in (-h, 0, h))
    torques = scara_torques(q, (after - before) / (2 * h), (after - 2 * q + before) / h**2)
    check([close("across", [run["tool_x"], run["tool_y"]], [0.4 + 0 * t, scara_course(t)[0]], 1e-12),
           close("up", run["tool_z"], 0.075 + scara_course(t)[1], 1e-12),
           close("upper torque", run["force_upper_psi"], torques[0], 1e-6),
           close("lower torque", run["force_lower_psi"], torques[1], 1e-6), balanced(summary, 1e-9)])


def test_scara_sags():
    """Castigliano: bending of both links, and torsion of the first by the eccentric weight of the second. Small gravity keeps the problem
    linear, and extrapolation is exact."""
    (l1, l2), [(A1, I1), (A2, I2)], g = SCARA_LENGTHS, SCARA_SECTIONS, 1e-3
    w1, w2, P, E = 2700 * A1 * g, 2700 * A2 * g, 1 * g, 7e10
    lower = scara_angles(0)[1]
    load, moment = P + w2 * l2 + 1.5 * g, P * l2 + w2 * l2**2 / 2
    along, across = moment * cos(lower), moment * sin(lower)
    slope = (load * l1**2 / 2 + along * l1 + w1 * l1**3 / 6) / (E * I1)
    sag = ((load * l1**3 / 3 + along * l1**2 / 2 + w1 * l1**4 / 8) / (E * I1) + slope * l2 * cos(lower)
           + across * l1 / (2 * I1 * E / (2 * 1.33)) * l2 * sin(lower) + (P * l2**3 / 3 + w2 * l2**4 / 8) / (E * I2))
    found = [0.075 - statics("scara", "--hold", "", n_rfe=n, g=g)["points"]["tool"][2] for n in (2, 3)]
    check([close("sag", [found[1] + (found[1] - found[0]) / 3], [sag], 1e-7)])


# ---- Puma 560 ----

def test_puma():
    """The published inertia of the third link is impossible for a body: the model lacks 0.0075 kg m^2 of it, which act on the second and
    third axes."""
    rigid = evaluate(model("puma"), {}, *settings({"n_rfe": 1, "rho": 1e-12}))
    M = [[3.6594, -0.4044, 0.1006, -0.0025, 0, 0], [-0.4044, 4.4137, 0.3509, 0, 0.0024, 0], [0.1006, 0.3509, 0.9378, 0, 0.0015, 0],
         [-0.0025, 0, 0, 0.1925, 0, 0], [0, 0.0024, 0.0015, 0, 0.1713, 0], [0, 0, 0, 0, 0, 0.1941]]
    more = numpy.outer([0, 1, 1, 0, 0, 0], [0, 1, 1, 0, 0, 0])
    check([close("M", numpy.array(rigid["M"]) + 0.0075 * more, M, 6e-5, 1), close("weight", rigid["Q"], [0, -31.6399, -6.0351, 0, -0.0283, 0], 6e-5, 1),
           close("pose", rigid["points"]["tool"]["r"], [0.5963 + 0.05625, -0.1501, 0.672 - 0.01435], 6e-5, 1)])


def test_puma_keeps_its_line():
    run, _, summary = motion(model("puma"), "--from", "statics", "--until", 2, "--every", 0.05)
    x, z = (2 * 0.4318 - 0.0203) / sqrt(2) + 0.05625, 0.672 - 0.0203 / sqrt(2)
    place = numpy.array([x + 0 * run["t"], 0.5 * smooth(run["t"], 0, 1.5) - 0.15005, z + 0 * run["t"]])
    bent = max(abs(run["forearm_theta_1"]).max(), abs(run["forearm_psi_1"]).max())
    assert 3e-4 < bent < 1e-2
    check([close("tool", [run[f"tool_{axis}"] for axis in "xyz"], place, 1e-9), balanced(summary, 1e-6),
           close("level", [run[f"phi_{row}"] for row in (4, 5, 6)], numpy.zeros((3, len(run["t"]))), 1e-9, 1)])


# ---- Stewart platform ----

def stewart_pose(t):
    """Height, and the rotation Rx(roll) Rz(turn)."""
    w = smooth(t, 0, 1)
    roll, turn = 0.15 * w * cos(3 * t), 0.2 * w * sin(6 * t)
    Rx = numpy.array([[1, 0, 0], [0, cos(roll), -sin(roll)], [0, sin(roll), cos(roll)]])
    return 1 + 0.1 * w * sin(3 * t), Rx @ [[cos(turn), -sin(turn), 0], [sin(turn), cos(turn), 0], [0, 0, 1]]


def stewart_circle(radius, offset):
    angles = numpy.array([2 * pi / 3 * (i // 2) - offset * (1, -1)[i % 2] for i in range(6)])
    return radius * numpy.array([cos(angles), sin(angles), 0 * angles]).T


@pytest.mark.parametrize("legs", ["light", "heavy"] if LONG else ["light"])
def test_stewart_platform_moves_as_programmed(legs):
    run, _, summary = motion(model("stewart"), "--set", f"legs={legs}", "--until", 2, "--every", 0.1, "--tol", "1e-9")
    height, R = zip(*(stewart_pose(t) for t in run["t"]))
    deck = numpy.array(R)[:, :, 0] / 2
    deck[:, 2] += height
    check([close("deck", [run[f"deck_{axis}"] for axis in "xyz"], deck.T, 1e-9), balanced(summary, 1e-7)]
          + [close(axis, run[f"platform_{axis}"], (0 * run["t"], height)[axis == "z"], 1e-9, 1) for axis in "xyz"])


def test_stewart_platform_at_rest(tmp_path):
    """The transverse part of a leg's weight is borne by its foot and by the platform; forces along the legs balance the platform."""
    state = tmp_path / "state.json"
    state.write_text('{"t": 1.3}')
    found = json.loads(refdyn("statics", model("stewart"), "--set", "legs=heavy", "--state", state).stdout)
    height, R = stewart_pose(1.3)
    feet, arms = stewart_circle(0.8, 0.2), stewart_circle(0.5, 0.85) @ R.T
    legs = arms + [0, 0, height] - feet
    lengths = numpy.linalg.norm(legs, axis=1)
    u, weight = legs / lengths[:, None], numpy.array([0, 0, -9.81])
    across = ((6 * 0.3 + 3 * (lengths - 0.3)) / lengths)[:, None] * (weight - numpy.outer(u @ weight, 1) * u)
    load = numpy.concatenate([80 * weight + across.sum(axis=0), numpy.cross(arms, across).sum(axis=0)])
    along = numpy.linalg.solve(numpy.vstack([u.T, numpy.cross(arms, u).T]), -load)
    pushes = dict(zip(found["rows"], found["lambda"]))
    check([close("legs", [pushes[f"leg {i}"] for i in range(1, 7)], along - 3 * u @ weight, 1e-10),
           close("deck", found["points"]["deck"], R[:, 0] / 2 + [0, 0, height], 1e-12)])


# ---- spin-up ----

def spinup_deflections(times, size=5, step=4e-3):
    """Deflections of the tip, by polynomials x^2 ... and the fourth-order rule: bending, tension rho A w^2 (L^2 - x^2) / 2, its softening
    in the plane, and inertia."""
    L, EI, mass = 10, 1.4e4, 1.2
    k = numpy.arange(2, size + 2)
    power = k[:, None] + k
    M, bending = mass * L / (power + 1), EI * numpy.multiply.outer(k * (k - 1), k * (k - 1)) / (power - 3) / L**3
    tension = mass * L * numpy.outer(k, k) * (1 / (power - 1) - 1 / (power + 1)) / 2
    lag = mass * L**2 / (k + 2)
    inverse = numpy.linalg.inv(M)
    stiff, stiffening, pull = inverse @ bending, inverse @ tension - numpy.eye(size), inverse @ lag

    def slope(t, y):
        rising = min(t, 15)
        rate, acceleration = 0.4 * rising - 6 / (2 * pi) * sin(2 * pi * rising / 15), 0.4 * (1 - cos(2 * pi * rising / 15)) * (t < 15)
        return numpy.concatenate([y[size:], -(stiff + rate**2 * stiffening) @ y[:size] - acceleration * pull])

    y, t, found = numpy.zeros(2 * size), 0.0, []
    for until in times:
        y, t = classical_steps(slope, t, y, until, step)
        found.append(y[:size].sum())
    return numpy.array(found)


def test_spinup():
    """The theory is linear in the deflection, which is 6 % of the length; the beam of elements converges like (n - 1)^-2."""
    coarse, fine = (motion(model("spinup"), "--set", f"n_rfe={n}", "--until", 20, "--every", 0.1, "--tol", "1e-8")[0] for n in (8, 15))
    extrapolated = fine["deflection"] + (fine["deflection"] - coarse["deflection"]) / 3
    theory = spinup_deflections(fine["t"])
    assert -0.575 < theory.min() < -0.573 and abs(fine["t"][theory.argmin()] - 6.8) < 0.11
    check([close("deflection", extrapolated, theory, 4e-3)])


# ---- chain ----

def hanging_slopes(n, pull=1.2, weight=0.6 * 9.81):
    return numpy.arctan(weight / n * (n - 1 - 2 * numpy.arange(n)) / (2 * pull))


def test_chain_hangs(tmp_path):
    """From another position of the same span it reaches the polygon, whose sag converges to the catenary's like n^-2."""
    state = tmp_path / "state.json"
    start = hanging_slopes(12) + 0.3 * sin(2 * numpy.arange(12))
    state.write_text(json.dumps({"q": list(numpy.diff(start, prepend=0))}))
    found = json.loads(refdyn("statics", model("chain"), "--state", state, "--way", "downhill").stdout)
    sags = [-statics("chain", bars=n)["points"]["middle"][2] for n in (12, 24)]
    a = 1.2 * 3 / (0.6 * 9.81)
    catenary = sqrt(1.5**2 + a**2) - a
    check([close("slopes", numpy.cumsum(found["q"]), hanging_slopes(12), 1e-8), close("pull", found["lambda"], [1.2, 0.3 * 9.81], 1e-8),
           close("sag", [sags[1] + (sags[1] - sags[0]) / 3], [catenary], 1e-4)])


@pytest.mark.skipif(not LONG, reason="REFDYN_LONG: fine bars take long to compile")
def test_chain_falls():
    """Folded closely and released at once, its end falls faster than a stone."""
    run, _, summary = motion(model("chain"), *settings({"bars": 60, "pull": 0.004, "release": 0}), "--until", 0.75, "--every", 0.002, "--tol", "1e-7")
    lowest = run["t"][run["tip_z"].argmin()]
    check([close("fall", [lowest / sqrt(2 * 3 / 9.81)], [0.847], 2e-2), balanced(summary, 1e-6)])


# ---- An arm that writes ----

STROKES = [((0, 1), (0, 0)), ((0, 1), (0, 0.5)), ((0.25, 0.5), (0.55, 0)), ((1.3, 0.45), (1.3, 0.15)), ((1.3, 1), (1.3, 0))]


def on_sheet(points):
    return numpy.array([(0.3 - 0.1 * up, 0.1 * right - 0.065) for right, up in points])


def writer_angles(x, y, z):
    """Elbow up, hand vertical: the triangle of shoulder, elbow and wrist."""
    upper, fore, r, h = 0.25, 0.16, numpy.hypot(x, y), z + 0.172 - 0.3
    far = numpy.hypot(r, h)
    shoulder = -arctan2(h, r) - numpy.arccos((upper**2 + far**2 - fore**2) / (2 * upper * far))
    elbow = pi - numpy.arccos((upper**2 + fore**2 - far**2) / (2 * upper * fore))
    return [arctan2(y, x), shoulder, elbow, pi / 2 - shoulder - elbow]


def test_writer():
    """The pen is down only between the ends of each stroke, and draws straight strokes by the smooth step."""
    run, _, summary = motion(model("writer"), "--until", 7, "--every", 0.001)
    t, place = run["t"], numpy.array([run[f"pen_{axis}"] for axis in "xyz"])
    down = numpy.concatenate([[0], abs(place[2]) < 1e-12, [0]]).astype(int)
    begins, ends = numpy.flatnonzero(numpy.diff(down) > 0), numpy.flatnonzero(numpy.diff(down) < 0) - 1
    assert len(begins) == len(ends) == len(STROKES), t[begins]
    seen = numpy.array([(place[:2, begin], place[:2, end]) for begin, end in zip(begins, ends)])
    first, third = t < 0.1 / 0.15, slice(begins[2], ends[2] + 1)
    line = place[:2, third].T - on_sheet([(0.25, 0.5)])
    names = names_of("writer")
    assert numpy.ptp(place[0]) > 0.099 and numpy.ptp(place[1]) > 0.129 and place[2].max() > 0.029
    check([close("strokes", seen, [on_sheet(stroke) for stroke in STROKES], 2e-5, 1), balanced(summary, 1e-3),
           close("stem", place[0, first], 0.2 + 0.1 * smooth(t[first], 0, 0.1 / 0.15), 1e-12),
           close("leg", 0.03 * line[:, 0], 0.05 * line[:, 1], 1e-12, 1),
           close("angles", states(run, names)[0].T, writer_angles(*place), 1e-12)])


# ---- The page ----

def test_every_model_has_its_picture_and_its_command():
    page = draw_gallery.PAGE.read_text()
    names = [path.stem for path in all_models()]
    assert sorted(draw_gallery.commands()) == sorted(draw_gallery.SEEN) == names
    assert sorted(path.stem for path in draw_gallery.PICTURES.iterdir()) == names
    for name in names:
        assert page.count(f"| ![{name}](gallery/{name}.png) | **[{name}](../models/{name}.lua)**: ") == 1, name
        head = (draw_gallery.PICTURES / f"{name}.png").read_bytes()
        assert head[1:4] == b"PNG" and struct.unpack(">II", head[16:24]) == draw_gallery.SIZE and len(head) < 40_000, name


def test_models_are_short_and_tell_their_source():
    for path in all_models():
        lines = path.read_text().splitlines()
        assert len(lines) < 60 and lines[0].startswith("-- "), path


@pytest.mark.parametrize("name", sorted(draw_gallery.SEEN) if LONG else ["chain", "spinup"])
def test_commands_of_the_page_run(name, tmp_path):
    refdyn(*draw_gallery.commands()[name], "-o", tmp_path / "run.csv", cwd=SOURCE)
