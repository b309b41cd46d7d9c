"""Small motions about an equilibrium: closed forms, published deviations, and motions of `refdyn sim`."""
import cmath
import ctypes
import json
import math
import re
import subprocess

import numpy
import pytest

from program import CORE_SOURCES, MODELS, REFERENCE, SCALE, SOURCE, TESTS, UNOPTIMISED, check, close, motion, refdyn, settings

BEAM = TESTS / "models" / "clamped_beam.lua"
CHAIN = TESTS / "models" / "hanging_chain.lua"
SMALL = TESTS / "models" / "small_motions.lua"
ROUNDED = 1e-12


def analyse(model, *arguments, **values):
    """The JSON object of `refdyn modes`, and its messages."""
    done = refdyn("modes", model, *arguments, *settings(values))
    found = json.loads(done.stdout)
    check_form(found)
    return found, done.stderr


def modes(model, *arguments, **values):
    return analyse(model, *arguments, **values)[0]["modes"]


def eigenvalues(found):
    return [complex(*mode["eigenvalue"]) for mode in found]


def shape(mode):
    return numpy.array(mode["shape"]["re"]) + 1j * numpy.array(mode["shape"]["im"])


def check_form(found):
    """Properties of every answer."""
    sizes = [mode["omega"] for mode in found["modes"]]
    assert all(a <= b * (1 + 1e-9) for a, b in zip(sizes, sizes[1:])), sizes
    for mode in found["modes"]:
        value = complex(*mode["eigenvalue"])
        assert value.imag >= 0 and mode["omega"] == abs(value), mode
        assert abs(mode["frequency"] - value.imag / (2 * math.pi)) <= 1e-15 * abs(value)
        assert mode["damping"] == (0 if value == 0 else -value.real / abs(value))
        entries = shape(mode)
        assert len(entries) == len(found["coordinates"]) and 1 in entries and abs(entries).max() <= 1 + 1e-9, entries
        assert set(mode["points"]) == set(found["points"])
        for name in found["held"]:
            assert entries[found["coordinates"].index(name)] == 0


def near(what, found, expected, tolerance):
    """One line if complex numbers differ by more than tolerance times the largest, otherwise ''."""
    found, expected = numpy.asarray(found, complex).ravel(), numpy.asarray(expected, complex).ravel()
    assert len(found) == len(expected), f"{what}: {len(found)} entries, not {len(expected)}"
    return close(what, abs(found - expected), 0 * abs(expected), tolerance, scale=abs(expected).max())


def state(tmp_path, **values):
    path = tmp_path / "state.json"
    path.write_text(json.dumps(values))
    return path


# ---- Beams ----

BETA_L = [1.875104068711961, 4.694091132974174, 7.854757438237613]
# Number of spring-damping elements; errors of f1, f2, f3 of the clamped beam in percent, all too high, with half elements at both ends.
DEVIATIONS = {5: (0.925, 3.27, 5.08), 10: (0.230, 0.802, 1.30), 20: (0.0574, 0.200, 0.327), 40: (0.0143, 0.0498, 0.0817)}


@pytest.mark.parametrize("elements", DEVIATIONS)
def test_deviations_of_a_clamped_beam(elements):
    """Published for the method of rigid finite elements, d/L = 5e-5."""
    found = modes(BEAM, "--modes", 3, n_rfe=elements + 1)
    deviations = [100 * (mode["omega"] / beta**2 - 1) for mode, beta in zip(found, BETA_L)]
    check(close(f"f{i + 1}", deviation, expected, 0.02)
          for i, (deviation, expected) in enumerate(zip(deviations, DEVIATIONS[elements])))
    assert len(found) == 3 and all(mode["damping"] == 0 and not any(mode["shape"]["im"]) for mode in found)


def test_digits_of_soft_modes_beside_stiff_ones(tmp_path):
    """Torsion makes the spectrum a million times as wide; bending in both planes keeps its digits, and Kelvin and Voigt's damping ratio eta
    omega / 2, also where this is above 1. Torsion is a chain: omega_k = 2 sqrt(k/J) sin((2 k - 1) pi / 4 N)."""
    full = tmp_path / "full.lua"
    full.write_text(BEAM.read_text().replace('dofs = "psi"', 'eta = 1e-3'))
    bending = [mode["omega"] for mode in modes(BEAM, n_rfe=21)]
    torsion = [2 * 20 * math.sqrt(8) / 5e-5 * math.sin((2 * k - 1) * math.pi / 80) for k in range(1, 21)]
    found = eigenvalues(modes(full, n_rfe=21))
    expected = [(root, 1e-13) for omega in torsion for root in damped_roots(omega, 5e-4 * omega)]
    expected += 2 * [(root, 1e-10) for omega in bending for root in damped_roots(omega, 5e-4 * omega)]  # two planes
    assert len(found) == len(expected) and 5e-4 * min(bending) < 1 < 5e-4 * max(bending) and abs(found[-1]) > 1e9 * abs(found[0])
    for root, tolerance in expected:
        nearest = min(found, key=lambda value: abs(value - root))
        found.remove(nearest)
        check([near(f"{root}", [nearest], [root], tolerance)])


def damped_roots(omega, ratio):
    """Roots with imaginary part not below 0; the slow one of two real roots is computed without cancellation."""
    fast = omega * (-ratio - cmath.sqrt(ratio**2 - 1))
    return [fast.conjugate()] if ratio < 1 else [omega**2 / fast, fast]


def test_floating_beam(tmp_path):
    """Free at both ends: six motions without restoring force, then beta L = 4.730041 and 7.853205."""
    model = tmp_path / "floating.lua"
    place = '"rod", joint = "free", start = { x = 0.3, y = -2, psi = 0.4, theta = -0.7, phi = 1.1 }, '
    model.write_text(BEAM.read_text().replace('"rod", ', place).replace("5e-5", "1e-3"))
    found = modes(model, "--at", "initial", n_rfe=41)
    assert [mode["omega"] == 0 for mode in found[:8]] == 6 * [True] + 2 * [False]
    assert numpy.array_equal([shape(mode)[:6] for mode in found[:6]], numpy.eye(6))
    check([near("omega", [mode["omega"] for mode in found[6:8]], [4.730040744862704**2, 7.853204624095838**2], 5e-4)])


def test_spring_that_is_next_to_nothing(tmp_path):
    """It does not reduce the accuracy of the stiff one."""
    model = tmp_path / "soft.lua"
    model.write_text('local rd = require "refdyn"\nreturn rd.model { name = "soft", links = {\n'
                     '  { "first", joint = { "x" }, mass = 1, spring = { x = 1e-60 } },\n'
                     '  { "second", on = "first", joint = { "x" }, mass = 2, spring = { x = 6e6 } } } }\n')
    check([near("omega", eigenvalues(modes(model)), [0, 3000j], ROUNDED)])


def test_upright_column_falls_under_its_weight():
    """Its frequency falls as its weight grows, and is 0 at g = 7.83735 E I / (rho A L^3) (Greenhill 1881)."""
    def slowest(g):
        return modes(BEAM, "--at", "initial", "--modes", 1, n_rfe=41, g=g)[0]
    omegas = [slowest(g)["omega"] for g in (0, 2, 4, 6, 7.8)]
    assert all(a > b for a, b in zip(omegas, omegas[1:])), omegas
    below, above = slowest(7.8), slowest(7.9)
    assert below["damping"] == 0 and above["damping"] == -1
    # omega^2 falls almost linearly there
    critical = 7.8 + 0.1 * below["omega"]**2 / (below["omega"]**2 + above["omega"]**2)
    check([close("g", critical, 7.83735, 5e-4)])


def test_hanging_chain():
    """The error falls with the square of the number of links, and extrapolation yields the string's frequency."""
    exact = numpy.array([2.404825557695773, 5.520078110286311, 8.653727912911013]) / 2 * math.sqrt(9.81)
    coarse, fine = (numpy.array([mode["omega"] for mode in modes(CHAIN, "--modes", 3, links=links)]) for links in (64, 128))
    ratio = (coarse - exact) / (fine - exact)
    assert (abs(ratio - 4) < 0.1).all(), ratio
    check([close("omega", fine + (fine - coarse) / 3, exact, 1e-4)])


# ---- Few coordinates ----

G = 9.81


@pytest.mark.quick
def test_double_pendulum():
    expected = [math.sqrt(G / 0.5 * (2 - math.sqrt(2))), math.sqrt(G / 0.5 * (2 + math.sqrt(2)))]
    found, said = analyse(SMALL, kind="double")
    check([near("omega", eigenvalues(found["modes"]), [1j * omega for omega in expected], ROUNDED),
           near("shape", [shape(mode) for mode in found["modes"]], [[1, math.sqrt(2) - 1], [1 - math.sqrt(2), 1]], ROUNDED)])
    assert found["at"] == "statics" and found["unstable"] == 0 and found["held"] == [] and "warning" not in said
    # E moves by l theta_upper + l (theta_upper + theta_lower)
    moved = found["modes"][0]["points"]["E"]
    check([close("E", moved["re"], [-0.5 * (2 + math.sqrt(2) - 1), 0, 0], ROUNDED), close("E", moved["im"], [0, 0, 0], ROUNDED, 1)])


def test_rows_against_fewer_coordinates():
    """Two masses on slides kept by rods: the same frequencies, no mode of the stabilisation, and the stiffness due to the multipliers."""
    reduced, redundant = modes(SMALL, kind="double"), modes(SMALL, "--at", "initial", kind="rods")
    assert len(redundant) == 2
    check([near("omega", eigenvalues(redundant), eigenvalues(reduced), ROUNDED),
           *(close("E", a["points"]["E"]["re"] / numpy.array(a["points"]["E"]["re"][0]),
                   b["points"]["E"]["re"] / numpy.array(b["points"]["E"]["re"][0]), ROUNDED) for a, b in zip(reduced, redundant))])


def test_closed_loop(tmp_path):
    """A parallelogram with redundant rows: M psidd + 0.585 g cos(psi) = 0 about -pi/2, and about pi/2."""
    M = 0.153 + 2 * 0.75 * 0.02**2 / 12  # the bars are 0.02 m wide
    path, omega = TESTS / "models" / "four_bar.lua", math.sqrt(0.585 * G / M)
    low = state(tmp_path, q=[-math.pi / 2, math.pi / 2, -math.pi / 2])
    found, said = analyse(path, "--at", low)
    check([near("omega", eigenvalues(found["modes"]), [1j * omega], ROUNDED), near("shape", shape(found["modes"][0]), [1, -1, 1], ROUNDED)])
    assert "redundant rows, left out" in said and "close 1 z" in said and "equilibrium" not in said and "off" not in said
    found, said = analyse(path, "--at", state(tmp_path, q=[math.pi / 2, -math.pi / 2, math.pi / 2]))
    check([near("omega", eigenvalues(found["modes"]), [omega, -omega], ROUNDED)])
    assert found["unstable"] == 1 and re.search(r"-1 +unstable$", said, re.M), said


@pytest.mark.parametrize("c", [0, 0.6, 11.9, 12, 12.1, 500])
def test_damped_oscillator(c):
    """2 xdd + c xd + 18 x = 0: omega 3, critically damped at c = 12."""
    found = modes(SMALL, kind="oscillator", c=c)
    root = cmath.sqrt((c / 4)**2 - 9)
    expected = [-c / 4 + root] if root.imag > 0 else [-c / 4 + root, -c / 4 - root]
    # rounding separates two equal roots by its square root
    check([near("eigenvalues", eigenvalues(found), expected, 1e-7 if c == 12 else ROUNDED)])
    if root.imag > 0:
        check([close("ratio", found[0]["damping"], c / 12, ROUNDED, 1), close("omega", found[0]["omega"], 3, ROUNDED)])
    else:
        assert [(mode["frequency"], mode["damping"]) for mode in found] == [(0, 1), (0, 1)]


def test_upright_pendulum():
    found, said = analyse(SMALL, "--at", "initial", kind="upright")
    omega = math.sqrt(G / 0.5)
    check([near("eigenvalues", eigenvalues(found["modes"]), [omega, -omega], ROUNDED)])
    assert [mode["damping"] for mode in found["modes"]] == [-1, 1] and found["unstable"] == 1
    assert said.count("unstable") == 1


def test_what_nothing_brings_back():
    """A free body: six eigenvalues exactly 0, one for each coordinate. Elastic links on it keep their eigenvalues."""
    assert [(mode["omega"], mode["damping"]) for mode in modes(TESTS / "models" / "solid.lua")] == 6 * [(0, 0)]
    found, _ = analyse(MODELS / "spacearm.lua", "--at", "initial")
    resting = [mode for mode in found["modes"] if mode["omega"] == 0]
    assert len(resting) == 9 and all(sorted(shape(mode)) == 14 * [0] + [1] for mode in resting)
    # the damped joint, then the elastic arm
    assert found["modes"][9]["frequency"] == 0 and found["modes"][9]["damping"] == 1 and found["modes"][10]["frequency"] > 5


# ---- Rows of velocities, multipliers ----

def test_multipliers_turn_with_a_blade():
    """Unsymmetric: the turning blade pushes the sledge, but the sledge does not turn the blade."""
    found = modes(SMALL, "--at", "initial", kind="skate")
    turning = 2 * G / (8 - 2 * 50)
    check([near("eigenvalues", eigenvalues(found), [0, 2j, 1j * math.sqrt(50)], ROUNDED),
           near("shapes", [shape(mode) for mode in found], [[0, 1, 0], [1, 0, 0], [turning, 0, 1]], 1e-6)])


def test_velocity_that_depends_on_the_position():
    """xd = -a x decays at the rate a, regardless of the gains; the load follows with -a^2 / (a^2 + 9)."""
    for a in (1.5, 40):
        found = sorted(modes(SMALL, "--at", "initial", kind="lag", a=a), key=lambda mode: mode["frequency"])
        check([near("eigenvalues", eigenvalues(found), [-a, 3j], ROUNDED),
               near("shape", shape(found[0]), [1, -a**2 / (a**2 + 9)], ROUNDED)])


@pytest.mark.parametrize("t", [0, 1.5])
def test_time_stands_still(t, tmp_path):
    found = modes(SMALL, "--at", state(tmp_path, t=t), kind="gear")
    ratio = 2 + t
    check([near("eigenvalues", eigenvalues(found), [1j * math.sqrt((5 + 3 * ratio**2) / (1 + ratio**2))], ROUNDED),
           near("shape", shape(found[0]), [-1 / ratio, 1], ROUNDED)])


def test_row_curved_in_the_rates():
    """Its multiplier, 3 N with the slide z held, damps y; freed, z under 5 N has no equilibrium."""
    found, said = analyse(SMALL, "--at", "initial", kind="curved")
    ratio = 2 * 0.1 * 3 / 4
    expected = [0, -2 * ratio + 2j * math.sqrt(1 - ratio**2)]
    check([near("eigenvalues", eigenvalues(found["modes"]), expected, ROUNDED)])
    assert found["held"] == ["third_z"] and "warning" not in said and found["residual"] < 1e-15
    found, said = analyse(SMALL, "--at", "initial", "--hold", "", kind="curved")
    assert found["held"] == [] and len(found["modes"]) == 3
    assert re.search(r"warning: this state is not an equilibrium: first_x is out of balance by 1$", said, re.M), said
    check([close("residual", found["residual"], 1, ROUNDED)])


# ---- Held coordinates ----

def test_held_coordinates_are_locked():
    """Coordinates held in statics keep their values in small motions, too; the rows of the programme act on the others."""
    found, _ = analyse(REFERENCE)
    assert found["held"] == ["column_psi", "arm_psi", "effector_z"]
    # 13 coordinates, 3 held, a position row and a velocity row: 9 positions, one of which the velocity row keeps at rest
    # the programme starts at the equilibrium
    assert found["phi"] < 1e-14 and max(map(abs, found["q"])) > 1e-3
    assert len(found["modes"]) == 9 and [mode["omega"] == 0 for mode in found["modes"]] == [True] + 8 * [False]
    more, _ = analyse(REFERENCE, "--hold", "column_psi,arm_psi,effector_z,base_z")
    assert len(more["held"]) == 4 and len(more["modes"]) == 8
    assert analyse(SMALL, "--hold", "upper_theta", kind="double")[0]["modes"][0]["omega"] == pytest.approx(math.sqrt(G / 0.5), rel=ROUNDED)
    every, _ = analyse(SMALL, "--hold", "upper_theta,lower_theta", kind="double")
    assert every["modes"] == [] and every["residual"] == 0


# ---- Motions ----

AMPLITUDE = 1e-4
MOTIONS = [(TESTS / "models" / "double_pendulum.lua", []), (MODELS / "stepped.lua", []), (MODELS / "midspan.lua", []),
           (SMALL, ["--set", "kind=rods", "--at", "initial"]), (SMALL, ["--set", "kind=pair"])]


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("model, arguments", MOTIONS, ids=lambda value: getattr(value, "stem", None) or " ".join(value[1:2]))
def test_simulated_motion(model, arguments, number, tmp_path):
    """From q + a Re(shape), a Re(eigenvalue shape) the motion is q + a Re(shape e^(eigenvalue t)), up to terms in a^2."""
    found, _ = analyse(model, *arguments)
    mode = found["modes"][number]
    value, entries = complex(*mode["eigenvalue"]), shape(mode)
    assert value.imag > 0 and (abs(entries.imag).max() > 0.1 or "kind=pair" not in arguments)
    start = state(tmp_path, q=list(numpy.array(found["q"]) + AMPLITUDE * entries.real), qd=list(AMPLITUDE * (value * entries).real))
    until = 2.25 * 2 * math.pi / value.imag
    run, _, _ = motion(model, *arguments[:2], "--from", start, "--until", until, "--tol", "1e-11", "--stabilise", "project")
    moved = numpy.array([run[name] for name in found["coordinates"]]).T - found["q"]
    expected = AMPLITUDE * (numpy.exp(value * run["t"])[:, None] * entries[None, :]).real
    check([near("motion", moved, expected, 2e-3), near("second half", moved[100:], expected[100:], 2e-3)])


# ---- The command ----

@pytest.mark.quick
def test_keys_and_count(tmp_path):
    found, said = analyse(MODELS / "stepped.lua", "--modes", 2)
    assert list(found) == "refdyn name coordinates at q qd t inputs parameters points held phi residual unstable modes".split()
    assert list(found["modes"][0]) == "frequency omega damping eigenvalue shape points".split()
    assert len(found["modes"]) == 2 and len(modes(MODELS / "stepped.lua")) > 2
    assert found["q"] == json.loads(refdyn("statics", MODELS / "stepped.lua").stdout)["q"]
    lines = said.splitlines()
    assert lines[0].split() == "mode frequency [Hz] omega [rad/s] damping ratio".split() and len(lines) == 3
    first = [float(word) for word in lines[1].split()]
    assert first[0] == 1 and abs(first[1] / found["modes"][0]["frequency"] - 1) < 1e-5
    refdyn("modes", MODELS / "stepped.lua", "--modes", 2, "-o", tmp_path / "modes.json")
    assert json.loads((tmp_path / "modes.json").read_text()) == found


def test_state_and_parameters(tmp_path):
    """A state sets t, q and parameters; its rates have no effect."""
    at = state(tmp_path, t=2.5, q=[0.3], qd=[7], parameters={"c": 1.2})
    found, said = analyse(SMALL, "--at", at, kind="oscillator")
    assert found["t"] == 2.5 and found["q"] == [0.3] and found["at"] == str(at)
    check([close("ratio", found["modes"][0]["damping"], 0.1, ROUNDED)])
    assert re.search("not an equilibrium: cart_x is out of balance by 5.4", said), said


def test_state_off_the_programme(tmp_path):
    found, said = analyse(TESTS / "models" / "pendulum_point.lua", "--at", state(tmp_path, q=[0, -1.1]))
    assert re.search(r"off the programme: largest \|phi\| 0.21\b", said), said
    check([close("phi", found["phi"], 0.21, ROUNDED)])
    found, said = analyse(TESTS / "models" / "pendulum_point.lua", "--at", state(tmp_path, q=[0, -1]))
    check([near("omega", eigenvalues(found["modes"]), [1j * math.sqrt(G)], ROUNDED)])
    assert "warning" not in said and found["phi"] == 0


def test_same_text_every_time():
    first, second = (refdyn("modes", REFERENCE) for _ in range(2))
    assert (first.stdout, first.stderr) == (second.stdout, second.stderr)


WRONG = [
    (["--modes", "2.5"], 2, "--modes: 2.5 is not a whole number"), (["--modes", "0"], 2, "'0' is not a positive number"),
    (["--hold", "upper_thet"], 2, "no coordinate 'upper_thet'; the nearest is upper_theta"), (["--from", "statics"], 2, "unknown option --from"),
    (["--at"], 2, "--at needs a value"), (["--at", "none.json"], 1, "none.json: state: "),
]


@pytest.mark.parametrize("arguments, status, said", WRONG, ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_wrong_usage(arguments, status, said, tmp_path):
    done = refdyn("modes", SMALL, *arguments, status=status, cwd=tmp_path)
    assert said in done.stderr and done.stdout == "" and ("usage: refdyn modes" in done.stderr) == (status == 2)


def test_loop_about_its_own_equilibrium():
    """Computed under the rows that close it; the same modes as from a state of the equilibrium, and as many growing modes as unstable
    directions there."""
    for way, unstable in ("downhill", 0), ("load", 1):
        found = json.loads(refdyn("modes", MODELS / "bricard.lua", "--way", way).stdout)
        assert found["at"] == "statics" and found["unstable"] == unstable and found["phi"] < 1e-14 and found["residual"] < 1e-9


def test_models_at_fault(tmp_path):
    done = refdyn("modes", MODELS / "branched.lua", "--at", "initial", status=1)
    assert re.search(r"branched\.lua:\d+: nod: is a row in accelerations", done.stderr) and done.stdout == ""
    done = refdyn("modes", REFERENCE, "--set", "form=printed", status=1)
    assert "corrected form" in done.stderr and done.stdout == ""


def test_numbers_that_fail(tmp_path):
    """No equilibrium; a state where a force has no derivative; a singular mass matrix."""
    falling = tmp_path / "falling.lua"
    falling.write_text('local rd = require "refdyn"\nreturn rd.model { name = "falling", gravity = { 0, 0, -9.81 },\n'
                       '  links = { { "stone", joint = { "z" }, mass = 1 } } }\n')
    assert "stone_z" in refdyn("modes", falling, status=3).stderr
    steep = tmp_path / "steep.lua"
    steep.write_text('local rd = require "refdyn"\nreturn rd.model { name = "steep",\n  links = { { "cart", joint = { "x" }, mass = 1 } },\n'
                     "  forces = function(s) return { cart_x = -rd.sqrt(s.q.cart_x) } end }\n")
    done = refdyn("modes", steep, "--at", "initial", status=3)
    assert "steep: t = 0 s" in done.stderr and "coordinate cart_x" in done.stderr and done.stdout == ""
    light = tmp_path / "light.lua"
    light.write_text('local rd = require "refdyn"\nreturn rd.model { name = "light",\n  links = { { "cart", joint = { "x", "phi" }, mass = 1,\n'
                     "  spring = { x = 1, phi = 1 } } } }\n")
    done = refdyn("modes", light, "--at", "initial", status=3)
    assert "mass matrix" in done.stderr and "cart_phi" in done.stderr and done.stdout == ""


# ---- The spectrum that chooses a method ----

SPECTRUM = """
#include "MODEL.h"
#include "runtime/core/motion/motion.h"
#include <stdlib.h>

int spectrum(const double *q, double *rate, double *damping);

static int spectrum_at_begin(struct refdyn_step *step, double *rate, double *damping) {
    return refdyn_linear_spectrum(step->linear, step->evaluation.work, step->t_begin, step->state, step->rates, step->stage, rate, damping);
}

/* At rest at q, rows without gains. */
int spectrum(const double *q, double *rate, double *damping) {
    const struct refdyn_model *model = &MODEL_model;
    const struct refdyn_options options = refdyn_options_default(REFDYN_AUTO);
    const size_t work_size = refdyn_workspace_size(model), size = refdyn_integrator_size(model, &options);
    void *work_memory = malloc(work_size), *memory = malloc(size);
    double *qd = calloc((size_t)model->n, sizeof *qd);
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    int status = refdyn_workspace_init(&work, model, work_memory, work_size);
    if (!status)
        status = refdyn_integrator_init(&integrator, &work, &options, memory, size);
    if (!status)
        refdyn_anchor(&work, 0, q, qd, NULL);
    if (!status)
        status = refdyn_integrator_start(&integrator, 0, q, qd);
    if (!status)
        status = spectrum_at_begin(&integrator.motion->step, rate, damping);
    free(qd);
    free(memory);
    free(work_memory);
    return status;
}
"""
ARM = TESTS / "models" / "suite" / "arm.lua"


@pytest.fixture(scope="module")
def core(tmp_path_factory):
    """Objects of the runtime core."""
    folder = tmp_path_factory.mktemp("core")
    for source in CORE_SOURCES:
        subprocess.run([*UNOPTIMISED, "-I", SOURCE, "-I", SOURCE / "runtime", "-c", source, "-o", folder / f"{source.stem}.o"], check=True)
    return sorted(folder.glob("*.o"))


@pytest.mark.parametrize("model, values", [
    (ARM, dict(n_rfe=4, root="clamp", ratio=0)), (ARM, dict(n_rfe=4, root="clamp", ratio=0.02)), (ARM, dict(n_rfe=4, root="clamp", ratio=1.5)),
    (ARM, dict(n_rfe=4, root="clamp", dofs="psi,theta,phi", ratio=0.02)), (REFERENCE, dict(n_rfe=4)), (REFERENCE, dict(n_rfe=4, eta=1.3e-3)),
    (BEAM, dict(n_rfe=8))], ids=str)
def test_spectrum(model, values, core, tmp_path):
    """The runtime's largest rate, computed by vector iteration, is within 30 % of the fastest mode's rate; so is its damping."""
    found, _ = analyse(model, **values)
    refdyn("gen", model, *settings(values), "--emit", "all,tangent", "-o", tmp_path)
    name = next(tmp_path.glob("*.h")).stem
    (tmp_path / "spectrum.c").write_text(SPECTRUM.replace("MODEL", name))
    subprocess.run([*UNOPTIMISED, "-shared", "-I", SOURCE, "-I", SOURCE / "runtime", "-o", tmp_path / "spectrum.so",
                    *tmp_path.glob("*.c"), *core, "-lm"], check=True)
    q, rate, damping = (ctypes.c_double * len(found["q"]))(*found["q"]), ctypes.c_double(), ctypes.c_double()
    assert ctypes.CDLL(str(tmp_path / "spectrum.so")).spectrum(q, ctypes.byref(rate), ctypes.byref(damping)) == 0
    fastest = found["modes"][-1]
    print(f"rate {rate.value:.5g}, omega {fastest['omega']:.5g}; damping {damping.value:.5g}, {fastest['damping']:.5g}")
    assert abs(rate.value / fastest["omega"] - 1) <= 0.3 * SCALE
    assert abs(damping.value - fastest["damping"]) <= 0.3 * SCALE * max(fastest["damping"], 1e-3)


KINKED = """local rd = require "refdyn"
local p = rd.parameters {{ {{ "at", 0, "m" }} }}
return rd.model {{ name = "kinked", links = {{ {{ "m", joint = "x", mass = 1.3, spring = {{ x = 5 }}, damper = {{ x = 0.1 }} }},
    {{ "n", on = "m", joint = "psi", mass = 0.7, inertia = {{ zz = 0.2 }}, spring = {{ psi = 3 }} }} }},
  forces = function(s) local x, v, a = s.q.m_x, s.qd.m_x, s.q.n_psi return {{ m_x = {force} }} end }}
"""
ON_KINK = {"-20 * rd.max(0, x - p.at)": "m_x", "-20 * rd.abs(x) * 0.01": "m_x", "-2 * rd.where(rd.less(v, 0), -1, 1)": "m_x_d",
           "-7 * rd.min(0, a - x)": None, "-4 * rd.max(0, v + 0.3 * a)": "m_x_d"}
OFF_KINK = ["-3 * v * rd.abs(v)", "-x * rd.max(0, x)", "-20 * rd.max(0, x - 0.001)", "-20 * rd.max(-1, rd.min(x, 1))", "-rd.abs(x + 1) - rd.abs(x - 1) + 2",
            "-20 * rd.max(0, x) - 20 * rd.min(0, x)"]


@pytest.mark.parametrize("command", ["modes", "linearise"])
def test_states_exactly_on_a_kink(command, tmp_path):
    """The linear equations of both sides differ, and a warning says so; it does not where they agree."""
    model = tmp_path / "kinked.lua"
    for force, coordinate in [*ON_KINK.items(), *((force, "") for force in OFF_KINK)]:
        model.write_text(KINKED.format(force=force))
        said = refdyn(command, model, "--at", "initial").stderr
        assert ("on a kink or jump" in said) is (coordinate != ""), (force, said)
        assert not coordinate or f"change {coordinate} slightly" in said, (force, said)
    model.write_text(KINKED.format(force="-20 * rd.max(0, x - p.at)"))
    assert "kink" not in refdyn(command, model, "--at", "initial", *settings({"at": 1e-3})).stderr
