"""What an implicit step solves with the diagonals of K and D alone: emitted solutions against matrices, and the diagonals."""
import ctypes
import subprocess

import numpy
import pytest

from compiled import WARNINGS, array, pointer
from program import MODELS, REFERENCE, SOURCE, TESTS, all_models, motion, refdyn, settings

ARM = TESTS / "models" / "suite" / "arm.lua"
RUNS = TESTS / "models" / "runs.lua"
CASES = {path.stem: (path, {}) for path in all_models() if path != REFERENCE}
CASES |= {f"tests_{path.stem}": (path, {}) for path in sorted((TESTS / "models").glob("*.lua"))}
CASES |= {"rigid": (REFERENCE, dict(n_rfe=1)), "flexible": (REFERENCE, dict(eta=1e-3)), "planar_chain": (MODELS / "planar.lua", dict(n_rfe=6)),
          "fine": (REFERENCE, dict(n_rfe=16, eta=1e-3)), "driven": (REFERENCE, dict(drive="input")),
          "finest": (ARM, dict(n_rfe=64, dofs="psi,theta,phi", ratio=0.05))}
CASES |= {f"runs_{kind}": (RUNS, dict(kind=kind, rfe=3)) for kind in ("sides", "segments", "slides", "driven")}
STATES, SOLVED, EXACT = 3, 1e-13, 1e-12

SHIM = """
#include "MODEL.h"
const struct refdyn_model *model_of(void);
const struct refdyn_model *model_of(void) { return &MODEL_model; }
void sizes(int *out);
void sizes(int *out) {
    out[0] = MODEL_model.n, out[1] = MODEL_model.m, out[2] = MODEL_model.parameter_count + MODEL_model.derived_count;
    out[3] = MODEL_model.input_count;
}
void set_up(double *p, double *x, double *state);
void set_up(double *p, double *x, double *state) {
    for (int i = 0; i < MODEL_model.parameter_count; i++)
        p[i] = MODEL_model.parameters[i].value;
    for (int i = 0; i < MODEL_model.input_count; i++)
        x[i] = MODEL_model.inputs[i].value;
    if (MODEL_model.prepare)
        MODEL_model.prepare(p);
    MODEL_model.start(p, x, 0, 0, 0, state);
}
#define CALL(name) void call_##name(const double *p, const double *x, double t, const double *q, const double *qd, double *out); \\
    void call_##name(const double *p, const double *x, double t, const double *q, const double *qd, double *out) { \\
        if (MODEL_model.name) MODEL_model.name(p, x, t, q, qd, out); }
CALL(M)
CALL(u)
CALL(tangent)
CALL(diagonals)
CALL(shifted)
"""


class Emitted:
    def __init__(self, model, folder, options):
        refdyn("gen", model, *settings(options), "--emit", "start,M,u,tangent,diagonals,shifted", "-o", folder)
        name = next(folder.glob("*.h")).stem
        (folder / "shim.c").write_text(SHIM.replace("MODEL", name))
        subprocess.run(["gcc", "-std=c11", "-O1", *WARNINGS, "-fPIC", "-shared", "-I", SOURCE / "runtime", "-o", folder / "model.so",
                        *folder.glob("*.c"), "-lm"], check=True)
        self.library = ctypes.CDLL(str(folder / "model.so"))
        sizes = (ctypes.c_int * 4)()
        self.library.sizes(sizes)
        self.n, self.m = sizes[:2]
        self.p, self.x, self.start = array([0.0] * (sizes[2] + 1)), array([0.0] * (sizes[3] + 1)), array([0.0] * 2 * self.n)
        self.library.set_up(pointer(self.p), pointer(self.x), pointer(self.start))

    def __call__(self, name, size, q, qd):
        out = array(numpy.full(size, numpy.nan))
        getattr(self.library, "call_" + name)(pointer(self.p), pointer(self.x), ctypes.c_double(0.7), pointer(q), pointer(qd), pointer(out))
        return out


def states(of, random):
    for _ in range(STATES):
        yield array(of.start[:of.n] + random.uniform(-0.3, 0.3, of.n)), random.uniform(-1.5, 1.5, of.n)


def independent(u):
    """Rows that say something new, as the emitted elimination finds them: in their order."""
    kept = []
    for i in range(len(u)):
        if numpy.linalg.matrix_rank(u[[*kept, i]], tol=1e-9 * numpy.abs(u).max()) > len(kept):
            kept.append(i)
    return kept


@pytest.mark.parametrize("case", CASES)
def test_solution(case, tmp_path):
    """(M + diag(s)) y - u^T lambda = f, u y = k; s small, large, and zero here and there."""
    model, options = CASES[case]
    of, random = Emitted(model, tmp_path, options), numpy.random.default_rng(20241122)
    n, m = of.n, of.m
    for q, qd in states(of, random):
        M, u = of("M", n * n, q, qd).reshape(n, n), of("u", m * n, q, qd).reshape(m, n)
        rows = independent(u) if m else []
        for power in -6, -2, 2:
            s = numpy.diag(M) * 10.0**(power + random.uniform(-2, 2, n)) * (random.uniform(0, 1, n) > 0.2)
            f = random.uniform(-1, 1, n) * (numpy.diag(M) + s)
            k = u @ random.uniform(-1, 1, n)
            x = of("shifted", n, q, array(numpy.concatenate([qd, f, [numpy.nan], k, s])))
            A = numpy.block([[M + numpy.diag(s), -u[rows].T], [u[rows], numpy.zeros((len(rows), len(rows)))]])
            scale = 1 / numpy.sqrt(numpy.concatenate([numpy.diag(M) + s, [1 / (abs(u[i]) @ (abs(u[i]) / (numpy.diag(M) + s))) for i in rows]]))
            A = scale[:, None] * A * scale
            wanted = numpy.linalg.solve(A, scale * numpy.concatenate([f, k[rows]]))
            error = numpy.abs(x / scale[:n] - wanted[:n]).max() / numpy.abs(wanted[:n]).max()
            assert error < SOLVED * max(numpy.linalg.cond(A), 10), (power, error, numpy.linalg.cond(A))


@pytest.mark.parametrize("elements", [1, 4, 16])
def test_diagonals(elements, tmp_path):
    """Without gravity and rates they are all that stands on those of K and D."""
    of, random = Emitted(ARM, tmp_path, dict(n_rfe=max(elements, 2), g=0, dofs="psi,theta,phi", ratio=0.1)), numpy.random.default_rng(7)
    n = of.n
    for q, _ in states(of, random):
        still = array(numpy.zeros(2 * n + 1 + of.m))
        tangent = of("tangent", n + of.m * (1 + 3 * n) + 3 * n * n, q, still)[n + of.m * (1 + 3 * n):].reshape(3, n, n)
        stiffness, damping = of("diagonals", 2 * n, q, still[:n]).reshape(2, n)
        for found, whole in (stiffness, tangent[0]), (damping, tangent[1]):
            assert numpy.abs(found).max() > 0
            assert numpy.abs(found - numpy.diag(whole)).max() < EXACT * numpy.abs(found).max()


def test_diagonals_of_forces(tmp_path):
    """A force that a formula gives for a coordinate stands on its diagonal, as far as it depends on that one."""
    (tmp_path / "model.lua").write_text("""
        local rd = require "refdyn"
        return rd.model { name = "pulled", gravity = { 0, -9.81, 0 },
          links = { { "a", joint = "x, psi", mass = 2, inertia = { xx = 2, yy = 2, zz = 3 } } },
          forces = function(s) return { a_x = -40 * s.q.a_x^3 - 3 * s.qd.a_x, a_psi = -2 * s.qd.a_psi * s.qd.a_psi } end }
    """)
    of = Emitted(tmp_path / "model.lua", tmp_path / "out", {})
    q, qd = array([0.3, -0.2]), array([0.7, 1.1])
    assert of("diagonals", 4, q, qd) == pytest.approx([120 * 0.09, 0, 3, 4.4], rel=1e-14)


UNLOADED = [*settings(dict(n_rfe=20, g=0, push=5, ratio=0.005)), "--until", 1, "--every", 0.05]


def test_auto_of_an_unloaded_arm():
    """A rough motion takes the diagonals alone, step by step as by name; an exact one the exact matrix."""
    rough, said, summary = motion(ARM, *UNLOADED, "--tol", "1e-2")
    named, _, _ = motion(ARM, *UNLOADED, "--tol", "1e-2", "--method", "ros34pw2-diagonal")
    assert summary["chosen"].keys() == {"ros34pw2-diagonal"} and "ros34pw2-diagonal for" in said
    assert all((rough[name] == named[name]).all() for name in named)
    _, _, summary = motion(ARM, *UNLOADED, "--tol", "1e-4")
    assert "ros34pw2-diagonal" not in summary["chosen"]


@pytest.mark.parametrize("tol", ["1e-2", "1e-3"])
def test_auto_of_loaded_scenes(tol):
    """Programme forces and weight on bent links: the exact matrix takes over before the steps are long."""
    scene = [REFERENCE, "--set", "eta=1.3e-3", "--from", "statics", "--until", 10, "--every", 0.5]
    exact, _, _ = motion(*scene, "--method", "radau9", "--tol", "1e-9")
    errors, steps = {}, {}
    for method in "auto", "rodas5p", "ros34pw2-diagonal":
        run, _, summary = motion(*scene, "--tol", tol, "--method", method)
        errors[method] = max(abs(run[f"E_{axis}"] - exact[f"E_{axis}"]).max() for axis in "xyz")
        steps[method] = summary.get("chosen", {}).get("ros34pw2-diagonal", 0)
    assert 0 < steps["auto"] <= 10
    assert errors["auto"] < 2 * errors["rodas5p"] < errors["ros34pw2-diagonal"], errors


def test_redundant_rows():
    """Directions onto the programme come from the exact M: of the rows that the partition keeps, not of all."""
    scene = [MODELS / "bricard.lua", "--until", 2, "--every", 0.1]
    exact, _, _ = motion(*scene, "--method", "rk8", "--tol", "1e-10")
    run, _, summary = motion(*scene, "--method", "ros34pw2-diagonal", "--tol", "1e-7")
    assert max(abs(run[name] - exact[name]).max() for name in exact if name.endswith(("theta", "psi", "phi"))) < 2e-4
    assert summary["phi_max"] < 1e-12


@pytest.mark.parametrize("stabilise, most", [("none", 1e-3), ("baumgarte", 1e-3), ("project", 1e-12)])
def test_rows_inside(stabilise, most):
    """Rows are solved along, their gains too: however they are kept, as many steps."""
    scene = [REFERENCE, "--set", "eta=1.3e-3", "--from", "statics", "--until", 1, "--method", "ros34pw2-diagonal", "--tol", "1e-5"]
    _, _, summary = motion(*scene, "--stabilise", stabilise)
    _, _, free = motion(*scene, "--stabilise", "none")
    assert summary["steps"] <= 1.05 * free["steps"]
    assert summary["phi_max"] < most and summary["psi_max"] < most
