"""Compiles emitted C and calls it: every quantity of a model, without the runtime."""
import ctypes
import subprocess

import numpy

from program import HAS_TCC, SOURCE, UNOPTIMISED, refdyn

WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror".split()

# Calls a quantity by its name; sets parameters like a motion that starts in the model's initial state.
SHIM = """
#include "MODEL.h"
#include <stddef.h>
#include <string.h>

#define QUANTITIES(E) E(M) E(h) E(Q) E(u) E(v) E(phi) E(psi) E(k) E(r) E(rd) E(C) E(d) E(energy) E(power) E(Q_q) \\
    E(qdd_free) E(qdd) E(force) E(inverse) E(equations) E(course)

void sizes(int *out);
const char *name_of(int coordinate);
const char *name_of_point(int point);
void set_up(double *p, double *x, double *state);
int call(const char *name, const double *p, const double *x, double t, const double *q, const double *qd, double *out);

void sizes(int *out) {
    const struct refdyn_model *m = &MODEL_model;
    const int values[] = {m->n, m->m, m->point_count, m->parameter_count + m->derived_count, m->input_count};
    memcpy(out, values, sizeof values);
}

const char *name_of(int coordinate) { return MODEL_model.coordinates[coordinate].name; }
const char *name_of_point(int point) { return MODEL_model.points[point]; }

void set_up(double *p, double *x, double *state) {
    const struct refdyn_model *m = &MODEL_model;
    double anchors[100];
    for (int i = 0; i < m->parameter_count; i++)
        p[i] = m->parameters[i].value;
    for (int i = 0; i < m->input_count; i++)
        x[i] = m->inputs[i].value;
    if (m->prepare)
        m->prepare(p);
    m->start(p, x, 0, NULL, NULL, state);
    if (!m->anchor)
        return;
    m->anchor(p, x, 0, state, state + m->n, anchors);
    for (int i = 0; i < m->anchored_count; i++)
        p[m->anchored[i]] = anchors[i];
    if (m->prepare)
        m->prepare(p);
}

int call(const char *name, const double *p, const double *x, double t, const double *q, const double *qd, double *out) {
    refdyn_function *f = NULL;
#define CHOOSE(quantity) if (!strcmp(name, #quantity)) f = MODEL_model.quantity;
    QUANTITIES(CHOOSE)
    if (f)
        f(p, x, t, q, qd, out);
    return f != NULL;
}
"""


def array(values):
    return numpy.ascontiguousarray(values, dtype=float)


def pointer(values):
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Compiled:
    """The emitted C of one model, loaded."""

    def __init__(self, path, folder, *options):
        folder.mkdir(parents=True, exist_ok=True)
        refdyn("gen", path, *options, "-o", folder)
        name = min(folder.glob("*.h"), key=lambda file: len(file.name)).stem  # the names of companions are longer
        (folder / "shim.c").write_text(SHIM.replace("MODEL", name))
        subprocess.run([*UNOPTIMISED, *([] if HAS_TCC else WARNINGS), "-shared", "-I", SOURCE / "runtime", "-o",
                        folder / "model.so", *folder.glob("*.c"), "-lm"], check=True)
        self.library = ctypes.CDLL(str(folder / "model.so"))
        self.library.name_of.restype = self.library.name_of_point.restype = ctypes.c_char_p
        sizes = (ctypes.c_int * 5)()
        self.library.sizes(sizes)
        self.n, self.m, points, parameters, inputs = sizes
        self.names = [self.library.name_of(i).decode() for i in range(self.n)]
        self.points = [self.library.name_of_point(i).decode() for i in range(points)]
        self.p, self.x, self.start = array([0.0] * (parameters + 1)), array([0.0] * (inputs + 1)), array([0.0] * (2 * self.n))
        self.library.set_up(pointer(self.p), pointer(self.x), pointer(self.start))

    def shape(self, name):
        n, m, points = self.n, self.m, len(self.points)
        shapes = {"M": (n, n), "Q_q": (n, n), "u": (m, n), "energy": (2,), "power": (1,), "C": (points, 3, n)}
        shapes.update(dict.fromkeys(("r", "rd", "d"), (points, 3)), **dict.fromkeys(("v", "phi", "psi", "k"), (m,)))
        return shapes.get(name, (n,))

    def __call__(self, name, state):
        """Returns the quantity's values, or None if the model lacks it."""
        out = array(numpy.full(self.shape(name), numpy.nan))
        q, qd = array(state["q"]), array(state["qd"])
        call = self.library.call
        has = call(name.encode(), pointer(self.p), pointer(self.x), ctypes.c_double(state["t"]), pointer(q), pointer(qd), pointer(out))
        return out if has else None
