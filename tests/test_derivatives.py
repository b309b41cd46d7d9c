"""Emitted derivatives compared with differences of the functions.

The emitted C is compiled again with 113-bit numbers in place of double; central differences of order six then leave more than 25 digits.
The same emitted lines compute the compared values, so only formulas matter, not rounding. The pass over angles is only accurate to doubles,
so libm replaces it.
"""
import ctypes
import random
import re
import subprocess

import numpy
import pytest

from compiled import WARNINGS, array, pointer
from program import LONG, MODELS, REFERENCE, SOURCE, TESTS, UNOPTIMISED, all_models, check, close, few_models_of_tests, refdyn, some
from random_models import as_lua, random_model, random_state

DERIVATIVES = ["tangent", "tangent_x", "d_qdd", "d_qdd_free", "d_force", "d_inverse", "d_statics", "d_rows", "d_points", "d_course"]
NEEDED = ["M", "h", "Q", "u", "v", "phi", "psi", "k", "r", "rd", "C", "d", "course", "qdd", "qdd_free", "force", "inverse", "constrained", "start"]
COMPILERS = [["gcc", "-std=c11"], ["clang", "-std=c11"], ["g++", "-std=c++17", "-x", "c++"], ["clang++", "-std=c++17", "-x", "c++"]]
FUNCTIONS = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt pow fabs fmin fmax".split()
RANDOM = [6, 33, 48, 118, 301] if LONG else [6, 48, 301]
BRANCHED = [2, 14, 32] if LONG else [14]  # some of their bodies carry several branches
# Loops, trees, beams and a platform; the other models have what these, the tests' own models and the random ones have, too.
FEW = ("branched", "bricard", "fivebar", "gantry", "planar", "slidercrank", "spinup")
CASES = [(path, ()) for path in all_models() if path != REFERENCE and (LONG or path.stem in FEW)]
CASES += [(REFERENCE, ("--set", "n_rfe=1")), (REFERENCE, ("--set", "drive=input", "--set", "eta=1e-3"))]
CASES += [(REFERENCE, ()), (REFERENCE, ("--fold",))] * LONG
CASES += [(TESTS / "models" / "control" / "states.lua", ())]
LOOPS = ("--loops", "always")
CASES += [(REFERENCE, (*LOOPS, "--set", "n_rfe=6")), (REFERENCE, (*LOOPS, "--fold")), (MODELS / "planar.lua", (*LOOPS, "--set", "n_rfe=5")),
          (TESTS / "models" / "loaded_beams.lua", (*LOOPS, "--set", "n_rfe=2"))]
CASES += [(TESTS / "models" / "runs.lua", (*LOOPS, "--set", f"kind={kind}", "--set", "rfe=3")) for kind in ("sides", "segments", "slides", "driven")]
SWEEPS = ("--accelerations", "recursive")  # for short chains the matrix is the default
CASES += [(REFERENCE, (*SWEEPS, *LOOPS, "--fold")), (MODELS / "gantry.lua", SWEEPS),
          (TESTS / "models" / "loaded_beams.lua", (*SWEEPS, *LOOPS, "--set", "n_rfe=2")),
          (TESTS / "models" / "runs.lua", (*SWEEPS, *LOOPS, "--set", "kind=driven", "--set", "rfe=3")), (MODELS / "branched.lua", SWEEPS)]
CASES += [(TESTS / "models" / "trees.lua", (*SWEEPS, "--set", f"kind={kind}", "--set", "rfe=2")) for kind in ("joined", "nested")]
CASES += [(path, SWEEPS) for path in all_models() if LONG and path != REFERENCE]
# The beam of cantilever.lua has hardly any mass: its accelerations of 1e10 cancel, and folded constants with them.
CASES += [(path, ()) for path in few_models_of_tests() if path.stem != "cantilever"] + [(seed, ()) for seed in RANDOM]
CASES += [(seed, SWEEPS) for seed in BRANCHED]
NAMES = [f"random {path}" if isinstance(path, int) else " ".join([path.stem, *options]) for path, options in CASES]
EXACT = 1e-13    # of the largest entry: numerical rotations are orthogonal to 1e-16
SOLVED = 1e-9    # the same for ill-conditioned equations
ROUNDED = 1e-6   # of emitted code in doubles

# Doubles are wider here than constants, which emitted C refuses elsewhere.
WIDE = ("#define _GNU_SOURCE\n#include <math.h>\n#include <stdlib.h>\n#include <string.h>\n#define double _Float128\n"
        "#define _Static_assert(...) struct no_such_check\n" + "".join(f"#undef {name}\n#define {name} {name}f128\n" for name in FUNCTIONS))

# NARROW is double even where `double` is not.
SHIM = """
#include "MODEL.h"
#include <stdlib.h>
#include <string.h>

static const struct refdyn_model *const model = &MODEL_model;
static double *p, *x, *qdd, *lambda, *room, off;
static int is_replaced;
static double gain;

/* The derived parameters; then, as a caller may, gains after them, each a different one. */
static void prepare(void) {
    if (model->prepare)
        model->prepare(p);
    for (int i = 0; i < 2 * model->m && is_replaced; i++)
        if (model->gains[i] >= 0)
            p[model->gains[i]] = gain * (i + 1);
}

void replace_gains(int replace, NARROW by) {
    is_replaced = replace;
    gain = by;
    prepare();
}

/* 2 alpha and beta^2 of each row, 0 where k does not read one. */
void gains(NARROW *out) {
    for (int i = 0; i < 2 * model->m; i++)
        out[i] = model->gains[i] >= 0 ? (NARROW)p[model->gains[i]] : 0;
}

static refdyn_function *function_of(const char *name) {
#define CHOOSE(quantity) if (!strcmp(name, #quantity)) return model->quantity;
    QUANTITIES(CHOOSE)
    return NULL;
}

/* M qdd - h - Q - u^T lambda and u qdd - k at given qdd and lambda. */
static void balance(const double *at, const double *inputs, double t, const double *q, const double *qd, double *out) {
    const int n = model->n, m = model->m;
    double *M = room, *h = M + n * n, *Q = h + n, *u = Q + n, *k = u + m * n;
    model->M(at, inputs, t, q, qd, M);
    model->h(at, inputs, t, q, qd, h);
    model->Q(at, inputs, t, q, qd, Q);
    if (m) {
        model->u(at, inputs, t, q, qd, u);
        model->k(at, inputs, t, q, qd, k);
    }
    for (int i = 0; i < n; i++) {
        out[i] = -h[i] - Q[i];
        for (int j = 0; j < n; j++)
            out[i] += M[i * n + j] * qdd[j];
        for (int j = 0; j < m; j++)
            out[i] -= u[j * n + i] * lambda[j];
    }
    for (int i = 0; i < m; i++) {
        out[n + i] = -k[i];
        for (int j = 0; j < n; j++)
            out[n + i] += u[i * n + j] * qdd[j];
    }
}

/* Accelerations of the points at given qdd. */
static void accelerate_points(const double *at, const double *inputs, double t, const double *q, const double *qd, double *out) {
    const int n = model->n, count = 3 * model->point_count;
    model->C(at, inputs, t, q, qd, room);
    model->d(at, inputs, t, q, qd, out);
    for (int i = 0; i < count; i++)
        for (int j = 0; j < n; j++)
            out[i] += room[i * n + j] * qdd[j];
}

/* Holds qdd and lambda of a state, or values off them. */
static void hold(double t, const double *q, const double *qd) {
    const int n = model->n, m = model->m;
    (m ? model->constrained : model->qdd_free)(p, x, t, q, qd, room);
    for (int i = 0; i < n; i++)
        qdd[i] = room[i] + off * (1 + i % 3);
    for (int i = 0; i < m; i++)
        lambda[i] = room[n + 1 + i] + off * (2 + i);
}

void hold_off(NARROW by) {
    off = by;
}

/* Functions that read what is held after qd. */
static int reads_held(const char *name) {
    static const char *const names[] = {"tangent", "tangent_x", "inverse", "d_inverse", "d_points"};
    int reads = 0;
    for (int i = 0; i < 5; i++)
        reads |= !strcmp(name, names[i]);
    return reads;
}

static void call_held(refdyn_function *f, const double *at, const double *inputs, double t, const double *q, const double *qd, double *out) {
    const int n = model->n, m = model->m;
    double *rest = room;
    memcpy(rest, qd, (size_t)n * sizeof *rest);
    memcpy(rest + n, qdd, (size_t)n * sizeof *rest);
    memcpy(rest + 2 * n + 1, lambda, (size_t)m * sizeof *rest);
    f(at, inputs, t, q, rest, out);
}

static int call(const char *name, const double *at, const double *inputs, double t, const double *q, const double *qd,
                double *out) {
    refdyn_function *f = !strcmp(name, "balance") ? balance : strcmp(name, "rdd") ? function_of(name) : model->C ? accelerate_points : NULL;
    if (f && reads_held(name))
        call_held(f, at, inputs, t, q, qd, out);
    else if (f)
        f(at, inputs, t, q, qd, out);
    return f != NULL;
}

void sizes(int *out) {
    const int values[] = {model->n, model->m, model->parameter_count, model->input_count, 3 * model->point_count, model->course_count};
    memcpy(out, values, sizeof values);
}

/* Parameters as at the start of a motion, inputs a little off; the coordinates there. */
void set_up(NARROW *start, NARROW *parameters) {
    const int n = model->n, m = model->m;
    double anchors[100], *state = calloc(2 * (size_t)n, sizeof *state);
    p = calloc((size_t)(model->parameter_count + model->derived_count) + 1, sizeof *p);
    x = calloc((size_t)model->input_count + 1, sizeof *x);
    qdd = calloc((size_t)n, sizeof *qdd);
    lambda = calloc((size_t)m + 1, sizeof *lambda);
    room = calloc((size_t)(n * n + 4 * n + 2 * m * n + 3 * m + 1 + 3 * n * model->point_count), sizeof *room);
    for (int i = 0; i < model->parameter_count; i++)
        p[i] = model->parameters[i].value;
    for (int i = 0; i < model->input_count; i++)
        x[i] = model->inputs[i].value + 0.375;
    if (model->prepare)
        model->prepare(p);
    model->start(p, x, 0, NULL, NULL, state);
    if (model->anchor) {
        model->anchor(p, x, 0, state, state + n, anchors);
        for (int i = 0; i < model->anchored_count; i++)
            p[model->anchored[i]] = anchors[i];
        if (model->prepare)
            model->prepare(p);
    }
    for (int i = 0; i < 2 * n; i++)
        start[i] = (NARROW)state[i];
    for (int i = 0; i < model->parameter_count; i++)
        parameters[i] = (NARROW)p[i];
    free(state);
}

/* One value or, with `by` not NULL, its derivative: by[0] chooses q, qd, qdd, t, x or p, index one of them. */
int evaluate(const char *name, NARROW t_in, const NARROW *state, const char *by, int index, int count, NARROW *out) {
    static const int weights[] = {45, -9, 1};
    const int n = model->n;
    double *q = calloc(2 * (size_t)n, sizeof *q), *now = calloc(2 * (size_t)count, sizeof *now), *sum = now + count;
    double t = t_in, *from = by == NULL ? NULL : !strcmp(by, "q") ? q + index : !strcmp(by, "qd") ? q + n + index
                           : !strcmp(by, "qdd") ? qdd + index : !strcmp(by, "t") ? &t : !strcmp(by, "x") ? x + index : p + index;
    for (int i = 0; i < 2 * n; i++)
        q[i] = state[i];
    if (reads_held(name) || !strcmp(name, "balance") || !strcmp(name, "rdd"))
        hold(t, q, q + n);
    int known = call(name, p, x, t, q, q + n, now);
    if (known && from) {
        /* A locked coordinate has accelerations of 1e-30 or so. */
        const double middle = *from, step = (middle && strcmp(by, "qdd") ? fabs(middle) : 1) * (double)1e-6;
        for (int s = 0; s < 6; s++) {
            const int far = s / 2 + 1;
            *from = middle + (s % 2 ? -far : far) * step;
            prepare();
            call(name, p, x, t, q, q + n, now);
            for (int i = 0; i < count; i++)
                sum[i] += (s % 2 ? -weights[s / 2] : weights[s / 2]) * now[i] / (60 * step);
        }
        *from = middle;
        prepare();
    }
    for (int i = 0; i < count; i++)
        out[i] = (NARROW)(from ? sum[i] : now[i]);
    free(now);
    free(q);
    return known;
}
"""


class Emitted:
    """The emitted derivatives of one model, compiled with numbers of one width."""

    def __init__(self, folder, name, width):
        self.folder, self.name = folder, name
        shim = SHIM.replace("MODEL", name).replace("QUANTITIES(CHOOSE)", " ".join(f"CHOOSE({q})" for q in NEEDED[:-1] + DERIVATIVES))
        (folder / f"{width}.h").write_text(("typedef double NARROW;\n" + WIDE) if width == "wide" else
                                           "#define _GNU_SOURCE\n#include <math.h>\ntypedef double NARROW;\n")
        (folder / width).mkdir(exist_ok=True)
        (folder / width / "shim.c").write_text(shim)
        for source in folder.glob("*.c"):
            text = source.read_text()
            (folder / width / source.name).write_text(re.sub("<= (0.785|100000.0);", "< 0;", text) if width == "wide" else text)
        compiler = ["gcc", "-std=gnu11", "-O0", "-ffp-contract=off", "-fPIC"] if width == "wide" else UNOPTIMISED
        subprocess.run([*compiler, "-shared", "-include", folder / f"{width}.h", "-I", folder, "-I", SOURCE / "runtime", "-o", folder / f"{width}.so", *(folder / width).glob("*.c"), "-lm"], check=True)
        self.library = ctypes.CDLL(str(folder / f"{width}.so"))
        sizes = (ctypes.c_int * 6)()
        self.library.sizes(sizes)
        self.n, self.m, parameters, inputs, self.of_points, self.courses = sizes
        self.joints = self.n - (folder / f"{name}.h").read_text().count(", a continuous state: ")
        self.counts = {"q": self.n, "qd": self.n, "qdd": self.n, "t": 1, "x": inputs, "p": parameters}
        self.start = array([0.0] * (2 * self.n))
        self.p = array([0.0] * parameters)
        self.library.set_up(pointer(self.start), pointer(self.p))
        self.p[self.p == 0] = 1

    def gains(self):
        """(m x 2) 2 alpha and beta^2, 0 where k does not read one."""
        gains = array([0.0] * (2 * self.m))
        self.library.gains(pointer(gains))
        return gains.reshape(self.m, 2)

    def replace_gains(self, by):
        """Makes the i-th gain `by` times i, where rows that share a gain have the last value; None restores the gains of the model."""
        self.library.replace_gains(by is not None, ctypes.c_double(by or 0))

    def fields(self, quantity):
        """Parts of a result and their lengths, from the header."""
        header = (self.folder / f"{self.name}.h").read_text()
        body = re.search(rf"struct {self.name}_{quantity}_result \{{(.*?)\}};", header, re.S)
        alone = re.search(rf" {self.name}_{quantity}\([^;]*double f_x\[(\d+) \* (\d+)\]\);", header)  # without rows it is the only part
        if alone:
            return [("f_x", int(alone[1]) * int(alone[2]))]
        return [(name, int(count)) for name, count in re.findall(r"double (\w+)\[(\d+)\];", body[1])] if body else []

    def values(self, quantity, state, count, by=None, index=0):
        out = array(numpy.full(count, numpy.nan))
        known = self.library.evaluate(quantity.encode(), ctypes.c_double(state["t"]), pointer(array(state["q"] + state["qd"])),
                                      by and by.encode(), index, count, pointer(out))
        return out if known else None

    def result(self, quantity, state):
        """The parts of a result by name; {} if the model lacks it."""
        fields, parts, at = self.fields(quantity), {}, 0
        values = self.values(quantity, state, sum(count for _, count in fields)) if fields else []
        for name, count in fields:
            parts[name] = values[at:at + count]
            at += count
        return parts

    def slopes(self, quantity, state, count, by):
        """Array of count x variables, by differences."""
        columns = [self.values(quantity, state, count, by, index) for index in range(self.counts[by])]
        return numpy.array(columns).reshape(self.counts[by], count).T


def compare(what, found, expected, tolerance=EXACT, size=0.0):
    """Compares columns relative to the largest one, or to the values themselves: cancelling terms are zero to that accuracy."""
    if not expected.size:
        return ["" if found is None else f"{what}: not asked for"]
    largest = max(abs(expected).max(), size, 1e-300)
    if found is None:
        return [close(f"{what}, left out", expected, 0 * expected, tolerance, largest)]
    found = numpy.reshape(found, expected.shape)
    return [close(f"{what}, column {i + 1}", found[:, i], expected[:, i], tolerance, largest) for i in range(expected.shape[1])]


def compare_blocks(wide, quantity, of, state, count, before="", without=()):
    parts, lines = wide.result(quantity, state), []
    if not parts:
        return []
    size, tolerance = abs(wide.values(of, state, count)).max(), SOLVED if quantity in ("d_qdd", "d_qdd_free", "d_force") else EXACT
    for by in ("q", "qd", "t", "x", "p", *["qdd"] * (quantity == "d_inverse")):
        if by not in without:
            slopes, found = wide.slopes(of, state, count, by), parts.get(before + by)
            if quantity == "d_statics" and by == "q":  # at rest, states are their own coordinates
                slopes[:, wide.joints:] = wide.slopes(of, state, count, "qd")[:, wide.joints:]
            if by == "p":  # in the units of the values, all columns alike
                slopes, found = slopes * wide.p, found if found is None else found.reshape(slopes.shape) * wide.p
            lines += compare(f"{quantity}.{before}{by}", found, slopes, tolerance, size)
    return lines


def compare_tangent(wide, state, of_rows=0.0):
    """of_rows: size of what may cancel in G_q, G_qd and g_t."""
    n, m, parts = wide.n, wide.m, wide.result("tangent", state)
    if not parts:
        return []
    by_q, by_qd, by_t, by_x = (wide.slopes("balance", state, n + m, by) for by in ("q", "qd", "t", "x"))
    of_inputs = wide.result("tangent_x", state)
    lines = compare("f_x", of_inputs.get("f_x"), by_x[:n]) + compare("g_x", of_inputs.get("g_x"), by_x[n:], size=of_rows)
    lines += compare("K", parts["K"], by_q[:n]) + compare("D", parts["D"], by_qd[:n]) + compare("f_t", parts["f_t"], by_t[:n])
    lines += compare("M", parts["M"], wide.values("M", state, n * n).reshape(n, n))
    if m:
        for part, slopes in ("G_q", by_q), ("G_qd", by_qd), ("g_t", by_t):
            lines += compare(part, parts[part], slopes[n:], size=of_rows)
        lines += compare("u", parts["u"], wide.values("u", state, m * n).reshape(m, n))
    return lines


def size_of(wide, quantity, part, state):
    """Size of the values whose derivative a part is."""
    of = part.rpartition("_")[0] if quantity in ("d_rows", "d_points") else {"d_statics": "Q", "tangent": "M", "tangent_x": "M"}.get(quantity, quantity[2:])
    counts = {"d_rows": wide.m, "d_points": wide.of_points, "d_course": wide.courses}
    values = wide.values(of, state, counts.get(quantity, wide.n ** 2 if of == "M" else wide.n))
    return 0 if values is None else abs(values).max()


def model_of(path, folder):
    if not isinstance(path, int):
        return path
    (folder / "model.lua").write_text(as_lua(random_model(path)))
    return folder / "model.lua"


def emitted(path, options, folder):
    folder.mkdir()
    refdyn("gen", path, *options, "--emit", ",".join(NEEDED + DERIVATIVES), "-o", folder)
    return next(folder.glob("*.h")).stem


def state_near(start, seed, n):
    state = random_state(random.Random(seed), n, 0.2)
    return {**state, "q": [a + b for a, b in zip(start, state["q"])]}


@pytest.fixture(scope="module", params=CASES, ids=NAMES)
def compiled(request, tmp_path_factory):
    """The emitted derivatives in both widths, and a state."""
    (path, options), folder = request.param, tmp_path_factory.mktemp("derivatives")
    name = emitted(model_of(path, folder), options, folder / "emitted")
    wide, narrow = (Emitted(folder / "emitted", name, width) for width in ("wide", "narrow"))
    return wide, narrow, state_near(wide.start, 11, wide.n)


def test_derivatives(compiled):
    wide, narrow, state = compiled
    n, m = wide.n, wide.m
    still = {**state, "qd": [0.0] * wide.joints + state["qd"][wide.joints:]}
    lines = []
    for off in (0.6875, 0):
        wide.library.hold_off(ctypes.c_double(off))
        lines += compare_tangent(wide, state) + compare_blocks(wide, "d_inverse", "inverse", state, n)
    lines += compare_blocks(wide, "d_qdd_free", "qdd_free", state, n)
    lines += compare_blocks(wide, "d_qdd", "qdd", state, n) + compare_blocks(wide, "d_force", "force", state, n)
    lines += compare_blocks(wide, "d_statics", "Q", still, n, without=["qd"])
    for row in ("phi", "psi", "k"):
        if wide.values(row, state, m) is not None:
            lines += compare_blocks(wide, "d_rows", row, state, m, f"{row}_", ["qd"] if row == "phi" else [])
    for value, without in ("r", ["qd", "t", "x"]), ("rd", ["t", "x"]), ("rdd", ["t", "x"]):
        if wide.of_points:
            lines += compare_blocks(wide, "d_points", value, state, wide.of_points, f"{value}_", without)
    if wide.courses:
        lines += compare_blocks(wide, "d_course", "course", state, wide.courses)
    for quantity in DERIVATIVES:
        exact, found = wide.result(quantity, state), narrow.result(quantity, state)
        for part in exact:
            scale = numpy.tile(wide.p, len(exact[part]) // len(wide.p)) if re.search("(^|_)p$", part) else 1
            size = max(abs(exact[part] * scale).max(), size_of(wide, quantity, part, state))
            lines.append(close(f"{quantity}.{part} in doubles", found[part] * scale, exact[part] * scale, ROUNDED, size))
    check(lines)


@pytest.mark.parametrize("n_rfe", [33, 37] if LONG else [33])
def test_strips(n_rfe, tmp_path):
    """Loops over pairs of long chains write strips of columns. With 37 elements the last block is whole, with 33 it is not."""
    name = emitted(REFERENCE, ("--set", f"n_rfe={n_rfe}", "--set", "eta=1e-3"), tmp_path / "emitted")
    assert "strip_ends[" in (tmp_path / "emitted" / f"{name}.c").read_text()
    wide, narrow = (Emitted(tmp_path / "emitted", name, width) for width in ("wide", "narrow"))
    state = state_near(wide.start, n_rfe, wide.n)
    lines = compare_tangent(wide, state) + compare_blocks(wide, "d_inverse", "inverse", state, wide.n)
    for quantity in ("tangent", "d_inverse"):
        exact, found = wide.result(quantity, state), narrow.result(quantity, state)
        lines += [close(f"{quantity}.{part} in doubles", found[part], exact[part], ROUNDED, abs(exact[part]).max()) for part in exact]
    check(lines)


def test_power(compiled):
    """The power that `constrained` computes is the power of the programme force."""
    wide, narrow, state = compiled
    if not wide.m:
        return
    lines = []
    for emitted_in, tolerance in (wide, EXACT), (narrow, ROUNDED):
        force = emitted_in.values("force", state, wide.n)
        power = emitted_in.result("constrained", state)["power"][0]
        lines.append(close("power", [power], [force @ state["qd"]], tolerance, max(abs(force * state["qd"]).max(), 1e-300)))
    check(lines)


def compare_accelerations(wide, state):
    """The tangent against differences of qdd and lambda: M dqdd - u^T dlambda = -K, u dqdd = -G."""
    n, m, parts = wide.n, wide.m, wide.result("tangent", state)
    M, u = parts["M"].reshape(n, n), parts["u"].reshape(m, n)
    size = numpy.concatenate([1 / numpy.sqrt(M.diagonal()), numpy.ones(m)])
    size[n:] = 1 / abs(u * size[:n]).max(axis=1)
    matrix = size[:, None] * numpy.block([[M, -u.T], [u, numpy.zeros((m, m))]]) * size
    lines, tolerance = [], EXACT + 1e-14 * numpy.linalg.cond(matrix)
    places = [*range(n), *range(n + 1, n + 1 + m)]
    values = abs(wide.values("constrained", state, n + m + 1)[places] / size).max()
    for by, of_force, of_row in ("q", "K", "G_q"), ("qd", "D", "G_qd"), ("t", "f_t", "g_t"):
        right = -numpy.concatenate([parts[of_force].reshape(n, -1), parts[of_row].reshape(m, -1)])
        found = numpy.linalg.solve(matrix, size[:, None] * right)
        slopes = wide.slopes("constrained", state, n + m + 1, by)[places] / size[:, None]
        lines += compare(f"qdd and lambda by {by}", found, slopes, tolerance, max(values, abs(found).max()))
    return lines


def test_gains(compiled):
    """Gains that a caller replaces after `prepare` apply to k, to the accelerations and to the tangent."""
    wide, _, state = compiled
    if not wide.m:
        return
    n, m, lines = wide.n, wide.m, []
    found = {name: wide.values(name, state, m) for name in ("v", "psi", "phi")}
    v, psi, phi = (numpy.zeros(m) if values is None else values for values in found.values())
    u = wide.values("u", state, m * n).reshape(m, n)
    try:
        for by in (0, 0.75):
            wide.replace_gains(by)
            gains = wide.gains()
            terms = numpy.array([-v, -gains[:, 0] * psi, -gains[:, 1] * phi])
            k, qdd = wide.values("k", state, m), wide.result("constrained", state)["qdd"]
            lines.append(close("k", k, terms.sum(axis=0), EXACT, abs(terms).max()))
            if numpy.linalg.matrix_rank(u) == m:
                lines.append(close("u qdd = k", u @ qdd, k, EXACT, max(abs(u * qdd).max(), abs(k).max())))
                lines += compare_accelerations(wide, state)
            lines.append(close("qdd", wide.values("qdd", state, n), qdd, EXACT))
            lines += compare_tangent(wide, state, abs(u).max()) + compare_blocks(wide, "d_rows", "k", state, m, "k_", ["p"])
            lines += compare_blocks(wide, "d_qdd", "qdd", state, n, without=["p"])
    finally:
        wide.replace_gains(None)
    check(lines)


def places_of_gains(folder, path, *options):
    refdyn("gen", path, *options, "-o", folder)
    text = "".join(file.read_text() for file in sorted(folder.glob("*.c")))
    places = re.search(r"_gains\[\] = \{([-\d, ]+)\}", text)
    places = [int(place) for place in places[1].split(",")] if places else []
    rows = re.search(r"(\d+) constraint rows", next(folder.glob("*.h")).read_text())[1]
    assert len(places) == 2 * int(rows)
    return places


@pytest.mark.parametrize("path, options", [(path, ()) for path in all_models()] + [
    (TESTS / "models" / "programme.lua", ()), (TESTS / "models" / "suite" / "arm.lua", ("--set", "row=swing"))],
    ids=lambda value: getattr(value, "stem", ""))
def test_gains_have_places(path, options, tmp_path):
    """Separate places for 2 alpha and beta^2, even if their values are equal; --fold, which turns parameters into numbers, keeps them."""
    places = places_of_gains(tmp_path / "symbolic", path, *options)
    folded = places_of_gains(tmp_path / "folded", path, *options, "--fold")
    assert [place >= 0 for place in folded] == [place >= 0 for place in places]
    for of_model in places, folded:
        assert not set(of_model[::2]) & set(of_model[1::2]) - {-1}


@pytest.mark.parametrize("path", [REFERENCE] + [MODELS / f"{name}.lua" for name in (("branched", "gantry", "planar", "spacearm") if LONG else ["gantry"])],
                         ids=lambda path: path.stem)
def test_compiles_without_warning(path, tmp_path):
    emitted(path, (), tmp_path / "emitted")
    for compiler in COMPILERS:
        for source in some((tmp_path / "emitted").glob("*.c")):
            subprocess.run([*compiler, *WARNINGS, "-O0", "-I", SOURCE / "runtime", "-c", source, "-o", tmp_path / "out.o"], check=True)


@pytest.mark.parametrize("path", [REFERENCE, MODELS / "crane.lua"], ids=lambda path: path.stem)
def test_on_request_alone(path, tmp_path):
    refdyn("gen", path, "-o", tmp_path)
    text = "".join(file.read_text() for file in tmp_path.iterdir())
    assert "_tangent" not in text and "_d_qdd" not in text


def statements(folder):
    return sum(file.read_text().count(";\n") for file in some(folder.glob("*.c")))


def test_text_is_that_of_one_element(tmp_path):
    """Neither n^2 lines nor separate lines for each element."""
    sizes = []
    for n in (40, 60):
        refdyn("gen", REFERENCE, "--set", f"n_rfe={n}", "--emit", "tangent", "-o", tmp_path / str(n))
        sizes.append(statements(tmp_path / str(n)))
    assert sizes[1] == sizes[0], sizes
