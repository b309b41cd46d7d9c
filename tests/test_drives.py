"""Programmes performed by drives: published and closed cases, forces against inverse dynamics, playback from rest, and refusals."""
import json
import math
import re

import numpy
import pytest

from program import LONG, MODELS, SOURCE, TESTS, check, close, read_run, refdyn

DRIVES = TESTS / "models" / "drives"
HUB = SOURCE / "docs" / "drives" / "hub_link.lua"


def realise(model, folder, *arguments, ending="csv"):
    """Columns, summary and standard error of `refdyn sim --realise`."""
    run, summary = folder / f"run.{ending}", folder / "summary.json"
    done = refdyn("sim", model, "--realise", *arguments, "-o", run, "--summary", summary)
    return read_run(run) if ending == "csv" else run, json.loads(summary.read_text())["realise"], done.stderr


def played(model, folder, until, *arguments, ending="csv"):
    refdyn("sim", model, "--play", folder / f"run.{ending}", "--from", folder / "run.start.json", "--until", until, "--tol", 1e-11,
           "--every", 0.05, *arguments, "-o", folder / "played.csv")
    return read_run(folder / "played.csv")


@pytest.mark.parametrize(("elements", "eta"), [(5, 0), (9, 0), (17, 0), (33, 0), (9, 1e-3), (9, 1e-2)])
def test_hub_driven_link(elements, eta, tmp_path):
    """Of control.md's figures: iterations, growth, and the tip of the motion played back from rest with forces held for 1 ms."""
    _, report, _ = realise(HUB, tmp_path, "--until", 1, "--every", 1e-3, "--before", 0.3, "--after", 0.3, "--set", f"n_rfe={elements}", "--set", f"eta={eta}")
    assert report["newton_iterations"] <= 6 and report["playback_error"] < 2e-6 and report["mesh_change"] < 1e-3
    assert report["growing"] == report["decaying"] == elements - 1
    if eta == 0:
        assert abs(report["growth_slowest"] / {5: 80.3, 9: 81.7, 17: 82.2, 33: 82.2}[elements] - 1) < 0.01
    assert 3.6 < report["peak"]["hub_psi"] < 3.66


def test_drives_in_hdf5(tmp_path):
    """Forces of drives have a group for themselves, with units; other inputs stay in theirs, and the numbers are those of the CSV."""
    h5py = pytest.importorskip("h5py")
    model = tmp_path / "hub_link.lua"
    text = HUB.read_text().replace("return rd.model {", 'local load = rd.input("drive_load", 0, "N m")\nreturn rd.model {').replace(
        "forces      = feedback and function() return { hub_psi = correction } end or nil", "forces      = function() return { hub_psi = load } end")
    assert "hub_psi = load" in text
    model.write_text(text)
    arguments = ("--until", 1, "--every", 1e-2, "--before", 0.3, "--after", 0.3)
    columns = realise(model, tmp_path, *arguments)[0]
    run, _, _ = realise(model, tmp_path, *arguments, ending="h5")
    refdyn("sim", model, "--play", run, "--from", tmp_path / "run.start.json", "--until", 0.2, "-o", tmp_path / "played.h5")
    for path in (run, tmp_path / "played.h5"):
        with h5py.File(path) as file:
            force = file["drives/hub_psi"]
            assert list(file["drives"]) == ["hub_psi"] and list(file["inputs"]) == ["drive_load"]
            assert force.attrs["units"] == "N m" and list(force.attrs["columns"]) == ["drive_hub_psi"] and force.shape == file["t"].shape
            if path == run:
                assert numpy.array_equal(force[()], columns["drive_hub_psi"])


def test_shorter_cells_follow_with_their_square(tmp_path):
    errors = [realise(HUB, tmp_path, "--until", 1, "--every", every, "--before", 0.3, "--after", 0.3)[1]["playback_error"] for every in (1e-3, 0.25e-3)]
    assert errors[1] < 2e-7 and 12 < errors[0] / errors[1] < 20


@pytest.mark.parametrize("ending", ["csv", "h5"])
def test_play(ending, tmp_path):
    """The forces applied to the mechanism without the rows: the tip's polar angle is that of the programme, and at rest after the end."""
    realise(HUB, tmp_path, "--until", 1, "--every", 1e-3, ending=ending)
    run = played(HUB, tmp_path, 1.25, ending=ending)
    assert "phi_1" not in run and run["t"][0] < -0.1 and json.loads((tmp_path / "run.start.json").read_text())["t"] == run["t"][0]
    x = numpy.clip(run["t"], 0, 1)
    course = math.pi / 2 * (126 * x**5 - 420 * x**6 + 540 * x**7 - 315 * x**8 + 70 * x**9)
    angle = numpy.arctan2(run["tip_y"], run["tip_x"])
    check([close("course", angle, course, 3e-6, scale=1), close("rest", run["hub_psi_d"][-1], 0, 1e-3, scale=1)])
    assert abs(run["arm_psi_4"][run["t"] < 0]).max() > 1e-7  # the link is bent before its tip moves


def test_reference_manipulator(tmp_path):
    """Not of minimum phase: the programme is held to 1e-6 by forces that are held for 1 ms, from rest."""
    run, report, _ = realise(MODELS / "manipulator.lua", tmp_path, "--set", "driven=true", "--from", "statics", "--until", 1.9, "--every", 1e-3)
    assert report["playback_error"] < 1e-6 and report["newton_iterations"] <= 7 and report["growing"] == 3
    during = (run["t"] >= 0) & (run["t"] <= 1.9)
    check([close("ellipse", abs(run["phi_1"][during]).max(), 0, 1e-8, scale=1), close("rate", abs(run["psi_2"][during]).max(), 0, 1e-8, scale=1)])
    after = played(MODELS / "manipulator.lua", tmp_path, 1.9, "--set", "driven=true")
    rise = 0.05 * (after["t"] / 2 - 10 / (4 * math.pi) * numpy.sin(2 * math.pi * after["t"] / 10))
    late = after["t"] > 0
    check([close("height", after["E_z"][late] - after["E_z"][0], rise[late], 1e-6, scale=1)])


def puma(folder, degree):
    """The six-axis robot with a flexible forearm and a drive at each axis."""
    text = (MODELS / "puma.lua").read_text().replace("rd.smoothstep(s.t, 0, p.T)", f"rd.smoothstep(s.t, 0, p.T, {degree})").replace(
        "  links = links,", "  links = links,\n  drives = { " + ", ".join(f'"axis{i}_psi"' for i in range(1, 7)) + " },")
    (folder / "puma.lua").write_text(text)
    return folder / "puma.lua"


def test_reference_manipulator_held_by_its_drives(tmp_path):
    """--from held: the equilibrium near the model's initial state, not another one that needs less force."""
    run, report, _ = realise(MODELS / "manipulator.lua", tmp_path, "--set", "driven=true", "--from", "held", "--until", 1.9, "--every", 1e-2)
    assert abs(run["arm_psi"][0] - math.pi / 4) < 0.1 and abs(run["column_psi"][0]) < 1e-9 and report["playback_error"] < 1e-5
    assert abs(run["effector_z"][0]) < 0.1 and abs(run["base_z"][0]) < 0.1


@pytest.mark.parametrize("mesh", [None, 0.04, 0.025])
def test_six_axes(mesh, tmp_path):
    """On intervals of 25 ms the equations are nearly singular. Other meshes then agree, and the course is not refused."""
    _, report, said = realise(puma(tmp_path, 9), tmp_path, "--from", "held", "--until", 1.5, "--every", 1e-3, *(("--mesh", mesh) if mesh else ()))
    assert report["playback_error"] < 1e-6 and report["mesh_change"] < 1e-3 and (mesh == 0.04) == (" 88 intervals" in said)


def test_six_axes_on_a_rough_course(tmp_path):
    said = refdyn("sim", puma(tmp_path, 3), "--realise", "--from", "held", "--until", 1.5, "--every", 1e-3, "-o", tmp_path / "run.csv", status=1).stderr
    time = re.search(r"puma.lua:\d+: x: too rough for the drives: .* most about t = (\S+) s", said)
    assert time and min(abs(float(time[1])), abs(float(time[1]) - 1.5)) < 0.05  # an interval


@pytest.mark.parametrize("share", [0.5, 0.8, 1 / 3, 0.1])
def test_arm_with_a_passive_joint(share, tmp_path):
    """Seifried and Blajer, Mech. Sci. 4:113-129, 2013: the output q1 + share q2 is or is not of minimum phase; one command serves both."""
    _, report, _ = realise(DRIVES / "passive_joint.lua", tmp_path, "--until", 1.5, "--every", 1e-3, "--set", f"share={share}")
    assert report["playback_error"] < 3e-6
    assert report["growing"] == (1 if share >= 0.5 else 0)
    if share == 0.5:
        assert abs(report["growth_slowest"] / 26.04 - 1) < 1e-3


@pytest.mark.parametrize("damping", [0, 0.25])
def test_arm_without_coupling_of_row_and_drive(damping, tmp_path):
    """The same arm with its second link turning about its centre, and the direction of this link as output. J ydd = -c q2 - d q2d: flat without
    the damper, in closed form; with it of relative degree 3, with one decaying mode. The cosine is 0."""
    run, report, _ = realise(DRIVES / "passive_joint.lua", tmp_path, "--until", 1.5, "--every", 1e-3, "--set", "share=1", "--set", "center=0", "--set", f"d={damping}")
    assert report["cosines"][0] < 1e-12 and report["playback_error"] < 2e-6 and report["newton_iterations"] <= 3
    assert (report["growing"], report["centre"], report["decaying"]) == (0, 0, 1 if damping else 0)
    law = numpy.polynomial.Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70])
    x, inertia, stiffness = numpy.clip(run["t"] / 1.5, 0, 1), 1 / 12, 50
    y = [math.pi / 2 * law.deriv(k)(x) / 1.5**k for k in (2, 3, 4)]
    if not damping:
        second, first_dd = -inertia * y[0] / stiffness, y[0] + inertia * y[2] / stiffness
        tau = (inertia + 0.25 + 1) * first_dd + inertia * y[0]
        check([close("spring", run["b_psi"], second, 1e-7), close("torque", run["drive_a_psi"][:-1], (tau[:-1] + tau[1:]) / 2, 1e-5)])
    else:
        check([close("spring and damper", stiffness * run["b_psi"] + damping * run["b_psi_d"], -inertia * y[0], 1e-6)])


@pytest.mark.parametrize(("elements", "eta", "growing"), [(2, 0, 3), (2, 1e-3, 3), (3, 0, 6), (3, 1e-3, 4), (5, 0, 10), (5, 1e-3, 8)])
def test_two_flexible_links_in_space(elements, eta, growing, tmp_path):
    """The tip turns about the vertical and rises; both hubs act through links that bend in two directions. Cosines of 1e-8 do no harm."""
    run, report, _ = realise(DRIVES / "two_flexible.lua", tmp_path, "--from", "held", "--until", 1, "--every", 1e-3, "--set", f"n_rfe={elements}", "--set", f"eta={eta}")
    assert report["playback_error"] < 1e-5 and report["newton_iterations"] <= 6 and report["growing"] == growing
    assert 3.8 < report["peak"]["hub_psi"] < 3.86 and 1.33 < report["peak"]["elbow_theta"] < 1.335
    check([close(row, abs(run[row]).max(), 0, 1e-8, scale=1) for row in ("phi_1", "phi_2")])


def test_rigid_arm_against_inverse_dynamics(tmp_path):
    """Collocated drives: tau = M qdd - h - Q, here of the two-link arm in closed form, as means over 0.1 ms."""
    run, report, _ = realise(DRIVES / "two_links.lua", tmp_path, "--until", 1, "--every", 1e-4)
    assert report["growing"] + report["centre"] + report["decaying"] == 0
    q1, q2, v1, v2, a1, a2 = (run[name] for name in ("a_psi", "b_psi", "a_psi_d", "b_psi_d", "a_psi_dd", "b_psi_dd"))
    m1, m2, l, c1, c2, i1, i2, g = 5, 3, 0.8, 0.4, 0.3, 0.3, 0.12, 9.81
    h = m2 * l * c2
    tau2 = (i2 + m2 * c2**2 + h * numpy.cos(q2)) * a1 + (i2 + m2 * c2**2) * a2 + h * numpy.sin(q2) * v1**2 + m2 * g * c2 * numpy.cos(q1 + q2)
    tau1 = ((i1 + m1 * c1**2 + m2 * l**2 + h * numpy.cos(q2)) * a1 + h * numpy.cos(q2) * a2 - h * numpy.sin(q2) * (v1 + v2)**2
            + (m1 * c1 + m2 * l) * g * numpy.cos(q1)) + tau2
    for name, tau in (("drive_a_psi", tau1), ("drive_b_psi", tau2)):
        mean = (tau[:-1] + tau[1:]) / 2  # over the cell, to the square of its length
        check([close(name, run[name][:-1], mean, 1e-5, scale=abs(tau).max())])


@pytest.mark.skipif(not LONG, reason="tests/long runs it, with Pinocchio (`pip install pin`)")
def test_rigid_arm_against_pinocchio(tmp_path):
    """A robot of seven joints from URDF, imported with drives: tau is the inverse dynamics of the motion. Means over a cell of `every` are those
    of Pinocchio's torques by Boole's rule at the states of a run with a quarter of it."""
    pytest.importorskip("pinocchio")
    from urdf_by_pinocchio import Reference
    text = re.sub(r"<dynamics damping=.*?/>", "", (TESTS / "robots" / "seven.urdf").read_text())
    (tmp_path / "seven.urdf").write_text(text)
    refdyn("import", tmp_path / "seven.urdf", "--drives", "-o", tmp_path / "seven.lua")
    model, reference = (tmp_path / "seven.lua").read_text(), Reference(text)
    names = reference.coordinates
    rows = "".join(f'      rd.position {{ s.q.{name} + 0.3 * s.q.{after} - rd.parameter("c{i}", s.start.q.{name} + 0.3 * s.start.q.{after}, "") - {0.3 + 0.07 * i} * rd.smoothstep(s.t, 0, 1, 9) }},\n'
                   for i, (name, after) in enumerate(zip(names, names[1:] + names[:1])))
    (tmp_path / "course.lua").write_text(model.replace("  hold = ", "  constraints = function(s)\n    return {\n" + rows + "    }\n  end,\n  hold = "))
    every = 4e-3
    coarse, report, _ = realise(tmp_path / "course.lua", tmp_path, "--set", "driven=true", "--until", 1, "--every", every, "--mesh", 0.01)
    fine, _, _ = realise(tmp_path / "course.lua", tmp_path, "--set", "driven=true", "--until", 1, "--every", every / 4, "--mesh", 0.01)
    assert report["growing"] + report["centre"] + report["decaying"] == 0 and abs(coarse["t"][0] - fine["t"][0]) < 1e-12

    def torques(row):
        q, qd, qdd = ([fine[name + ending][row] for name in names] for ending in ("", "_d", "_dd"))
        found = reference.values(q, qd)
        return numpy.array(found["M"]) @ qdd - found["f"]

    tau = numpy.array([torques(row) for row in range(len(fine["t"]))])
    cells = (len(tau) - 1) // 4
    means = sum(weight * tau[k::4][:cells] for k, weight in enumerate((7, 32, 12, 32, 7))) / 90
    found = numpy.array([coarse[f"drive_{name}"][:cells] for name in names]).T
    assert abs(found - means).max() < 1e-8 * abs(tau).max()
    for row in range(100, len(tau) - 100, 97):
        q, qd, qdd = ([fine[name + ending][row] for name in names] for ending in ("", "_d", "_dd"))
        own = json.loads(refdyn("eval", tmp_path / "seven.lua").stdout)["coordinates"]
        (tmp_path / "state.json").write_text(json.dumps({key: [dict(zip(names, values))[name] for name in own] for key, values in (("q", q), ("qd", qd), ("qdd", qdd))}))
        inverse = json.loads(refdyn("eval", tmp_path / "seven.lua", "--state", tmp_path / "state.json").stdout)["inverse"]
        assert abs(numpy.array([inverse[own.index(name)] for name in names]) - tau[row]).max() < 1e-12 * abs(tau).max()


def test_closed_loop(tmp_path):
    """The rows of the loop hold in the motion that is played, too."""
    _, report, _ = realise(DRIVES / "closed_loop.lua", tmp_path, "--until", 1.5, "--every", 1e-3)
    run = played(DRIVES / "closed_loop.lua", tmp_path, 1.5)
    check([close("loop", abs(run["phi_1"]).max(), 0, 1e-9, scale=1), close("rocker", run["rocker_psi"][-1] - run["rocker_psi"][0], 0.4, 1e-5, scale=1)])
    assert report["playback_error"] < 1e-5


def test_start_that_the_drives_hold(tmp_path):
    """--from held finds the angles at which the closed loop is closed and at rest."""
    text = (DRIVES / "closed_loop.lua").read_text().replace("psi = -0.8632121961010154", "psi = -0.9")
    model = tmp_path / "loop.lua"
    model.write_text(text)
    said = refdyn("sim", model, "--realise", "--until", 1.5, "-o", tmp_path / "no.csv", status=1).stderr
    assert "loop.lua:14: start: is off the programme: the residual of loop 1 " in said and "--from held" in said
    _, report, _ = realise(model, tmp_path, "--until", 1.5, "--every", 1e-3, "--from", "held")
    assert report["playback_error"] < 1e-5


def test_limits_of_drives(tmp_path):
    """Warnings and summary have the limits of sim, here over the rows of the motion."""
    run, _, said = realise(DRIVES / "two_links.lua", tmp_path, "--until", 1, "--every", 1e-3, "--set", "T=0.5")
    assert re.search(r"warning: drive_a_psi exceeds its limits: 82\.7\S* N m at t = \S+ s; allowed is at most 70; ", said) and "drive_b_psi exceeds" not in said
    limit, = json.loads((tmp_path / "summary.json").read_text())["limits"]
    beyond = run["drive_a_psi"] > 70
    assert abs(limit["t"] - run["t"][beyond][0]) < 2e-3 and abs(limit["duration"] - beyond.sum() * 1e-3) < 4e-3 and abs(limit["violation"] - 12.7) < 0.1


# ---- More drives than rows ----

LENGTHS, CENTERS, MASSES, INERTIAS = (0.8, 0.6, 0.4), (0.4, 0.3, 0.2), (5, 3, 1), (0.3, 0.12, 0.02)
START = numpy.array([-0.5, 1, 0.7])


def torques(q, v, a, g):
    """Of the planar chain of three links, (times, 3): recursive Newton and Euler in the plane, with complex numbers."""
    angle, rate, growth = (numpy.cumsum(x, axis=1) for x in (q, v, a))
    along = numpy.exp(1j * angle)
    turned = along * (1j * growth - rate**2)  # acceleration of a point at distance 1 relative to the joint
    joint, forces, moments = 1j * g * numpy.ones(len(q)), [], []
    for i in range(3):
        forces.append(MASSES[i] * (joint + CENTERS[i] * turned[:, i]))
        joint = joint + LENGTHS[i] * turned[:, i]
    total, moment, out = numpy.zeros(len(q), complex), numpy.zeros(len(q)), numpy.zeros((len(q), 3))
    for i in (2, 1, 0):
        moment = moment + INERTIAS[i] * growth[:, i] + numpy.imag(numpy.conj(CENTERS[i] * along[:, i]) * forces[i] + numpy.conj(LENGTHS[i] * along[:, i]) * total)
        total, out[:, i] = total + forces[i], moment
    return out


def least_effort(times, knots, weights, g, guess):
    """Least integral of (w tau)^2 over splines of the direction of the last link; the other angles follow from the place of the tip. `guess`:
    that direction at the times, from which the search starts."""
    scipy_optimize, interpolate = pytest.importorskip("scipy.optimize"), pytest.importorskip("scipy.interpolate")
    tip0 = (numpy.array(LENGTHS) * numpy.exp(1j * numpy.cumsum(START))).sum()
    x = numpy.clip(times, 0, 1)
    law = numpy.polynomial.Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70])
    f = [law.deriv(k)(x) if k else law(x) for k in range(3)]
    tip = [(tip0 if k == 0 else 0) + (-0.3 + 0.4j) * f[k] for k in range(3)]
    places = numpy.array([knots[i + 1:i + 6].mean() for i in range(len(knots) - 6)])  # of the coefficients of splines of degree 5

    def motion(free):
        coefficients = numpy.concatenate([[START.sum()] * 2, free, free[-1:]])  # at rest at both ends
        spline = interpolate.BSpline(knots, coefficients, 5)
        theta = [spline(times, nu=k) for k in range(3)]
        wrist = tip[0] - LENGTHS[2] * numpy.exp(1j * theta[0])
        b = numpy.arccos(numpy.clip((abs(wrist)**2 - LENGTHS[0]**2 - LENGTHS[1]**2) / (2 * LENGTHS[0] * LENGTHS[1]), -0.999999, 0.999999))
        first = numpy.angle(wrist / (LENGTHS[0] + LENGTHS[1] * numpy.exp(1j * b)))
        angles = numpy.column_stack([first, first + b, theta[0]])
        along = numpy.array(LENGTHS) * numpy.exp(1j * angles)

        def solve(side):  # of the first two angles; side: what their terms add up to
            matrix = numpy.stack([numpy.stack([along[:, j].real, along[:, j].imag], -1) for j in range(2)], -1)
            return numpy.linalg.solve(matrix, numpy.column_stack([side.real, side.imag])[..., None])[..., 0]

        rates = numpy.column_stack([solve(tip[1] / 1j - along[:, 2] * theta[1]), theta[1]])
        growth = numpy.column_stack([solve((tip[2] + (along * rates**2).sum(1)) / 1j - along[:, 2] * theta[2]), theta[2]])
        return [numpy.diff(values, axis=1, prepend=0) for values in (angles, rates, growth)]

    step = numpy.gradient(times)
    step[[0, -1]] /= 2
    step = numpy.sqrt(step)
    found = scipy_optimize.least_squares(lambda free: (torques(*motion(free), g) * weights * step[:, None]).ravel(), numpy.interp(places[2:-1], times, guess), x_scale=0.1)
    return 2 * found.cost, torques(*motion(found.x), g)


@pytest.mark.parametrize("limit", [1, 0.25])
def test_least_effort(limit, tmp_path):
    """Three drives for two rows, against splines of 66 values by another method; a lower limit of a drive reduces its torque."""
    run, report, _ = realise(DRIVES / "three_links.lua", tmp_path, "--until", 1, "--every", 1e-3, "--before", 0.3, "--after", 0.3, "--set", f"limit_a={limit}")
    turned = run["a_psi"] + run["b_psi"] + run["c_psi"]
    knots = numpy.concatenate([[-0.3] * 5, numpy.linspace(-0.3, 1.3, 65), [1.3] * 5])
    effort, tau = least_effort(run["t"], knots, numpy.array([1 / limit, 1, 1]), 0, 0.8 * turned + 0.2 * turned[0])
    check([close("effort", report["effort"], effort, 3e-5), close("start", run["t"][0], -0.3, 1e-9, scale=1)])
    mean, inner = (tau[:-1] + tau[1:]) / 2, slice(50, -50)  # at the ends, splines oscillate
    check([close(name, run[f"drive_{name}"][:-1][inner], mean[inner, i], 0.015) for i, name in enumerate(("a_psi", "b_psi", "c_psi"))])
    assert report["playback_error"] < 5e-6 and abs(run["c_psi_d"][-1]) < 1e-6
    assert abs(run["phi_1"]).max() < 1e-9 and report["growing"] == 0


def test_least_effort_under_gravity(tmp_path):
    """The arm moves its elbow while the tip follows the programme. The end is at rest, in a pose with less torque than the start."""
    run, report, _ = realise(DRIVES / "three_links.lua", tmp_path, "--until", 1, "--every", 1e-3, "--set", "g=9.81")
    both = realise(DRIVES / "two_links.lua", tmp_path, "--until", 1, "--every", 1e-3)[1]
    assert report["playback_error"] < 2e-3 and both["playback_error"] < 2e-6
    assert abs(report["effort"] / 3545.2 - 1) < 1e-3 and abs(run["phi_2"]).max() < 1e-9


def hub_with_two_drives(folder, limit):
    """The hub-driven link with a second drive that bends its root, as a piezo-electric patch does."""
    text = HUB.read_text().replace('{ { "hub_psi", limit = limit } }', f'{{ {{ "hub_psi", limit = 1 }}, {{ "arm_psi_1", limit = {limit} }} }}')
    assert "arm_psi_1" in text
    (folder / "two.lua").write_text(text)
    return folder / "two.lua"


@pytest.mark.parametrize("elements", [2, 5, 9])
def test_least_effort_of_a_flexible_link(elements, tmp_path):
    """A second drive reduces the effort. If its force counts a thousandfold, the forces are those of one drive."""
    arguments = ("--until", 1, "--every", 1e-3, "--before", 0.2, "--after", 0.2, "--set", f"n_rfe={elements}")
    alone, one, _ = realise(HUB, tmp_path, *arguments, "--set", "limit=1")
    both, two, _ = realise(hub_with_two_drives(tmp_path, 1), tmp_path, *arguments)
    assert two["effort"] < one["effort"] and two["playback_error"] < 2e-6 and two["mesh_change"] < 0.02
    assert abs(both["phi_1"]).max() < 1e-8 and abs(both["arm_psi_1"][-1]) < 1e-3 and abs(both["hub_psi_d"][-1]) < 1e-5
    rare, _, _ = realise(hub_with_two_drives(tmp_path, 1e-3), tmp_path, *arguments)
    check([close("torque", rare["drive_hub_psi"], alone["drive_hub_psi"], 2e-3, scale=3.6), close("second", rare["drive_arm_psi_1"], 0 * rare["t"], 2e-3, scale=3.6)])


# ---- The page ----

def largest(path):
    return abs(read_run(path)["miss"]).max()


def test_feedback_around_the_forces(tmp_path):
    """docs/drives.md: what the tip misses with the forces of the rigid and of the flexible link, with a heavier tip, and with feedback."""
    arguments = ("--until", 1, "--every", 1e-3, "--before", 0.3, "--after", 0.3, "--realise")
    refdyn("sim", HUB, "--set", "n_rfe=1", *arguments, "-o", tmp_path / "rigid.csv")
    refdyn("sim", HUB, *arguments, "-o", tmp_path / "drives.csv")
    found = {}
    for run in ("rigid", "drives"):
        for name, changes in (("", []), ("heavy", ["m_tip=0.11"]), ("loop", ["m_tip=0.11", "feedback=true"]), ("same loop", ["feedback=true"])):
            settings = [word for change in changes for word in ("--set", change)]
            refdyn("sim", HUB, *settings, "--play", tmp_path / f"{run}.csv", "--from", tmp_path / "drives.start.json", "--until", 1.3, "--every", 2e-3, "-o", tmp_path / "out.csv")
            found[run, name] = largest(tmp_path / "out.csv")
    expected = {("rigid", ""): 8.0e-3, ("rigid", "heavy"): 59e-3, ("rigid", "loop"): 89e-3, ("rigid", "same loop"): 80e-3,
                ("drives", ""): 1.2e-6, ("drives", "heavy"): 59e-3, ("drives", "loop"): 6.2e-3}
    for key, value in expected.items():
        assert abs(found[key] / value - 1) < 0.03, (key, found[key])
    assert found["drives", "same loop"] < 2e-5


def text_of(changes):
    text = (DRIVES / "two_links.lua").read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    return text


REFUSALS = {
    "rough": (HUB.read_text(), ["--set", "degree=3"], "hub_link.lua:34: polar: too rough for the drives: their forces change by "),
    "few": (text_of([(', "b_psi" }', " }")]), [], "two_links.lua:10: drives: 1 for 2 rows of the programme; no drive is left for row 2"),
    "none": (text_of([('drives = { { "a_psi", limit = 70 }, "b_psi" },', "")]), [], "drives: the model has none; --realise needs a drive for each row"),
    "moving": (text_of([("start = { psi = 1 }", "start = { psi = 1 }, start_rate = { psi = 0.1 }")]), [], "start: b_psi moves with 0.1; a motion of --realise must start at rest"),
    "falling": ((DRIVES / "passive_joint.lua").read_text().replace("gravity = { 0, 0, 0 }", "gravity = { 0, -9.81, 0 }"), [],
                "start: is not at rest: the drives cannot hold it, "),
    "friction": (text_of([("  points =", "  forces = function(s) return { a_psi = -rd.abs(s.qd.b_psi) } end,\n  points =")]), [],
                 "forces: friction, saturation or another kink in coordinates or rates, which --realise does not allow"),
    "event": (text_of([("  points =", "  events = function(s) return { rd.event { s.q.a_psi - 3, name = 'far' } } end,\n  points =")]), [],
              "far: an event, which --realise does not allow"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals(name, tmp_path):
    text, arguments, message = REFUSALS[name]
    model = tmp_path / ("hub_link.lua" if name == "rough" else "two_links.lua")
    model.write_text(text)
    said = refdyn("sim", model, "--realise", "--until", 1, "--every", 1e-3, *arguments, "-o", tmp_path / "run.csv", status=1).stderr
    assert message in said and not (tmp_path / "run.csv").exists()
    if name == "rough":
        assert any(f" about t = {time}" in said for time in ("0.00", "0.99", "1.0"))  # the acceleration jumps at both ends


@pytest.mark.parametrize(("arguments", "message"), [
    (["--mesh", 0.1], "--mesh needs --realise"), (["--realise", "--stop", "t>1"], "--realise excludes --stop"),
    (["--play", "run.csv"], "--play needs --from START.json"), (["--play", "run.csv", "--inputs", "run.csv"], "--play excludes --inputs")])
def test_wrong_usage(arguments, message):
    assert message in refdyn("sim", HUB, "--until", 1, *arguments, status=2).stderr


def manipulator_with_three_drives(folder):
    text = (MODELS / "manipulator.lua").read_text()
    assert 'driven and { "arm_psi", "effector_z" }' in text
    (folder / "three.lua").write_text(text.replace('driven and { "arm_psi", "effector_z" }', 'driven and { "arm_psi", "effector_z", "column_psi" }'))
    return folder / "three.lua"


def test_effort_that_falls_without_end(tmp_path):
    """A third drive at the column of the undamped manipulator can excite vibrations that carry a part of the weight."""
    said = refdyn("sim", manipulator_with_three_drives(tmp_path), "--realise", "--set", "driven=true", "--set", "n_rfe=2", "--from", "held", "--until", 1.9, "--every", 1e-2,
                  "-o", tmp_path / "run.csv", status=3).stderr
    assert re.match(r"refdyn: manipulator: --realise: the effort still decreases after 1\d\d corrections; vibrations with little damping", said)


@pytest.mark.skipif(not LONG, reason="half a minute")
def test_three_drives_of_the_damped_manipulator(tmp_path):
    _, report, _ = realise(manipulator_with_three_drives(tmp_path), tmp_path, "--set", "driven=true", "--set", "eta=1e-2", "--from", "held", "--until", 1.9, "--every", 1e-3)
    assert report["playback_error"] < 1e-6 and report["mesh_change"] < 0.01 and report["effort"] < 5e3 * 1.9


LOADS = """local rd = require "refdyn"
return rd.sweep { vary = { m_tip = { 0.063, 0.117 }, n_rfe = { 3, 6 }, hub_psi = { 0, 0.1 } }, t_end = 1, every = 1e-2, realise = true,
  before = 0.31, after = 0.3, mesh = 0.045, keep = { final = true, history = { "drive_hub_psi", "tip_x" }, extremes = { "drive_hub_psi" }, limits = true } }
"""


def test_batch_of_loads(tmp_path):
    """A case has the same bits as `sim --realise`, in one process and in three. A start off the programme is the reason of a failed case."""
    h5py = pytest.importorskip("h5py")
    (tmp_path / "loads.lua").write_text(LOADS)
    refdyn("batch", HUB, tmp_path / "loads.lua", "--threads", 1, "-o", tmp_path / "one.h5")
    refdyn("batch", HUB, tmp_path / "loads.lua", "--threads", 3, "-o", tmp_path / "runs.h5")
    run, report, _ = realise(HUB, tmp_path, "--until", 1, "--every", 1e-2, "--before", 0.31, "--after", 0.3, "--mesh", 0.045, "--set", "n_rfe=6", "--set", "m_tip=0.117")
    with h5py.File(tmp_path / "runs.h5") as file, h5py.File(tmp_path / "one.h5") as one:
        one.visititems(lambda name, item: name == "cpu_s" or not isinstance(item, h5py.Dataset) or numpy.testing.assert_array_equal(item[()], file[name][()]))
        values = {name: file["cases"][name].asstr()[()].astype(float) if file["cases"][name].dtype.kind == "O" else file["cases"][name][()] for name in file["cases"]}
        case = next(i for i in range(8) if (values["m_tip"][i], values["n_rfe"][i], values["hub_psi"][i]) == (0.117, 6, 0))
        assert list(file["status"]) == [int(start != 0) for start in values["hub_psi"]]
        assert all(bool(start) == reason.endswith("the residual of polar is 0.1; --from held starts at the equilibrium that the drives hold")
                   for start, reason in zip(values["hub_psi"], file["reason"].asstr()[()]))
        numbers = {name: file["realise"][name][case] for name in file["realise"]}
        assert numbers.pop("peak_hub_psi") == report["peak"]["hub_psi"] and numbers.pop("cosine_1") == report["cosines"][0]
        assert numbers == {name: report[name] for name in numbers} and len(numbers) == 9
        for name in ("drive_hub_psi", "tip_x"):
            assert numpy.array_equal(file["history"][name][case], run[name]) and len(run[name]) == 162
        assert numpy.array_equal(file["history/t"][()], run["t"]) and file["final/t"][case] == run["t"][-1] and file["final/tip_y"][case] == run["tip_y"][-1]
        largest = max(range(len(run["t"])), key=lambda i: run["drive_hub_psi"][i])
        assert list(file["extremes/drive_hub_psi"][case][2:]) == [run["drive_hub_psi"][largest], run["t"][largest]]
        assert file["limits/drive_hub_psi"][case][5] == 0 and numpy.isnan(file["history/tip_x"][()][values["hub_psi"] != 0]).all()
    refdyn("sim", "--case", case, "--of", tmp_path / "runs.h5", "-o", tmp_path / "case.csv")
    again = read_run(tmp_path / "case.csv")
    assert set(again) == set(run) and all(numpy.array_equal(again[name], run[name]) for name in run)


def test_batch_without_tails(tmp_path):
    """Each case then begins and ends at its own times: outputs cover the programme alone, but the largest force is that of the whole motion."""
    (tmp_path / "loads.lua").write_text(LOADS.replace("before = 0.31, after = 0.3,", "").replace("n_rfe = { 3, 6 }, hub_psi = { 0, 0.1 }", "J = 0.02")
                                        .replace('history = { "drive_hub_psi", "tip_x" }, ', "").replace(", limits = true", ""))
    refdyn("batch", HUB, tmp_path / "loads.lua", "--set", "n_rfe=3", "-o", tmp_path / "runs.csv")
    runs = read_run(tmp_path / "runs.csv")
    _, report, _ = realise(HUB, tmp_path, "--until", 1, "--every", 1e-2, "--mesh", 0.045, "--set", "n_rfe=3", "--set", "m_tip=0.063")
    assert list(runs["t"]) == [1, 1] and runs["peak_hub_psi"][0] == report["peak"]["hub_psi"] > 2.9 and report["playback_error"] == runs["playback_error"][0]


def test_batch_from_the_equilibrium(tmp_path):
    """`from = "held"`: the reference manipulator begins each case at rest, held by its drives, and the loads grow with the mass."""
    (tmp_path / "loads.lua").write_text("""local rd = require "refdyn"
return rd.sweep { vary = { m_E = { 1.3, 2.9 } }, t_end = 1.9, every = 1e-2, realise = true, from = "held" }""")
    refdyn("batch", MODELS / "manipulator.lua", tmp_path / "loads.lua", "--set", "driven=true", "-o", tmp_path / "runs.csv")
    runs = read_run(tmp_path / "runs.csv")
    _, report, _ = realise(MODELS / "manipulator.lua", tmp_path, "--set", "driven=true", "--set", "m_E=2.9", "--from", "held", "--until", 1.9, "--every", 1e-2)
    assert runs["peak_effector_z"][1] == report["peak"]["effector_z"] > 2 * runs["peak_effector_z"][0] and max(runs["playback_error"]) < 5e-6


@pytest.mark.parametrize(("change", "arguments", "status", "message"), [
    (("", ""), ["--lanes", 2], 2, "--realise excludes --lanes"),
    (("realise = true,", ""), [], 1, "loads.lua:3: before needs --realise"),
    (("limits = true", 'derivatives = { "m_tip" }'), [], 1, "loads.lua:3: keep: --realise excludes keep.derivatives"),
    (("realise = true", "realise = 1"), [], 1, "realise: a number; must be true or false"),
    (("before = 0.31", "before = -1"), [], 1, "before: value -1; must be positive"),
    (("hub_psi = { 0, 0.1 }", "degree = { 3, 9 }, hub_psi = 0"), ["--from", "held", "--tol", 0], 2, "--tol"),
])
def test_wrong_batches(change, arguments, status, message, tmp_path):
    (tmp_path / "loads.lua").write_text(LOADS.replace(*change))
    assert message in refdyn("batch", HUB, tmp_path / "loads.lua", *arguments, "-o", tmp_path / "runs.h5", status=status).stderr


def test_batch_of_a_model_without_drives(tmp_path):
    (tmp_path / "loads.lua").write_text(LOADS.replace("vary = { m_tip = { 0.063, 0.117 }, n_rfe = { 3, 6 }, hub_psi = { 0, 0.1 } }", "vary = { m_E = { 1, 2 } }"))
    said = refdyn("batch", MODELS / "manipulator.lua", tmp_path / "loads.lua", "-o", tmp_path / "runs.csv", status=1).stderr
    assert re.fullmatch(r".*manipulator.lua:\d+: drives: the model has none; --realise needs a drive for each row of the programme\n", said) and not (tmp_path / "runs.csv").exists()


def test_models_without_drives_are_the_same(tmp_path):
    """No drive adds an input or a function to a model without them."""
    refdyn("gen", MODELS / "manipulator.lua", "-o", tmp_path)
    header = (tmp_path / "manipulator.h").read_text()
    assert "drive_" not in header.replace("drive_input", "") and "manipulator_input_count = 0" in header


# ---- The bound on work ----

@pytest.mark.parametrize("model, arguments, fact", [
    (HUB, ["--mesh", "1e-9"], r"--mesh 1e-09: 1\.\d+e\+09 intervals of the mesh; must be at most \d+"),
    (HUB, ["--mesh", "5e-324"], r"--mesh 4\.94066e-324: inf intervals of the mesh; must be at most \d+"),
    (HUB, ["--before", "1e9"], r"--before 1e\+09: 2e\+11 outputs; must be at most 1000000"),
    (HUB, ["--before", "1e20"], r"--before 1e\+20: 2e\+22 outputs; must be at most 1000000"),
    (HUB, ["--after", "1e300"], r"--after 1e\+300: 2e\+302 outputs; must be at most 1000000"),
    (HUB, ["--before", "4000"], r"--before 4000: 8e\+04 intervals of the mesh; must be at most \d+"),
    (HUB, ["--every", "1e-7"], r"--every 1e-07: 1e\+07 outputs; must be at most 1000000"),
], ids=lambda value: " ".join(value) if isinstance(value, list) else None)
def test_too_much_work_is_refused_before_it(model, arguments, fact, tmp_path):
    done = refdyn("sim", model, "--realise", "--until", 1, *arguments, "-o", tmp_path / "run.csv", status=2)
    assert re.match(f"refdyn sim: {fact}\n", done.stderr) and not list(tmp_path.iterdir()), done.stderr


@pytest.mark.parametrize("mesh", [0.2, 1, 1e9, 1e10, 1e300])
def test_a_long_mesh_is_divided(mesh, tmp_path):
    """No step is longer than a 20th of the motion: one interval had no forces with which another could agree."""
    run, report, _ = realise(HUB, tmp_path, "--until", 1, "--every", 1e-2, "--mesh", mesh)
    usual, _, _ = realise(HUB, tmp_path, "--until", 1, "--every", 1e-2)
    assert report["playback_error"] < 1e-3
    check([close("forces", run["drive_hub_psi"], usual["drive_hub_psi"], 1e-3)])


# A rod upright on a cart, which falls when the forces are played back; its torque is undefined below.
FALLING = """local rd = require "refdyn"
local p = rd.parameters { { "T", 1, "s" } }
return rd.model {
  name = "falling", gravity = { 0, -9.81, 0 },
  links = { { "cart", joint = "x", mass = 2 },
            { "rod", on = "cart", joint = "psi", mass = 1, center = { 0, 0.5, 0 }, inertia = { zz = 0.01 } } },
  points = { E = { on = "rod", at = { 0, 1, 0 } } },
  drives = { "cart_x" },
  forces = function(s) return { rod_psi = 0.01 * (rd.sqrt(rd.cos(s.q.rod_psi) + 0.5) - rd.sqrt(1.5)) } end,
  constraints = function(s) return { rd.position { s.points.E.x - 0.3 * rd.smoothstep(s.t, 0, p.T, 9) } } end,
}
"""


def test_forces_that_cannot_be_played_back(tmp_path):
    """The played motion reaches a state without forces: exit status 3, and no files. Without that torque it only misses the programme."""
    model = tmp_path / "falling.lua"
    model.write_text(FALLING)
    done = refdyn("sim", model, "--realise", "--until", 3, "-o", tmp_path / "run.csv", status=3)
    assert "could not be played back" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["falling.lua"]
    model.write_text(re.sub("  forces.*\n", "", FALLING))
    said = realise(model, tmp_path, "--until", 3)[2]
    assert "played back from rest, these forces miss the motion by up to 2" in said
    assert "miss" not in realise(model, tmp_path, "--until", 1)[2]
