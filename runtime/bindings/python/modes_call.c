/* Small motions of a compiled model about a state at rest, with eigenvalues by functions of Python. */
#include "runtime/bindings/python/extension.h"

#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

/* The arguments of a call, and its memory. */
struct small_motions {
    const struct library *library;
    struct given_values values;
    PyObject *places, *q_object, *solve, *eigen, *least_squares;
    const char *is_held; /* (held_flags, n) */
    Py_ssize_t held_flags;
    double t;
    long most;             /* modes in the result; 0: all */
    struct motion pieces;  /* memory */
    PyThreadState *thread; /* while C computes without the interpreter's lock; else NULL */
};

/* ---- Linear algebra ---- */

static void lock(struct small_motions *own) {
    PyEval_RestoreThread(own->thread);
    own->thread = NULL;
}

/* Calls a function with numbers and arrays, and returns its answer. An exception, also one of a signal, stays
 * set. Then releases the lock. */
static bool ask(struct small_motions *own, PyObject *function, PyObject *arguments) {
    PyObject *answer =
        arguments && PyErr_CheckSignals() == 0 ? PyObject_CallObject(function, arguments) : NULL;
    const bool is_true = answer && PyObject_IsTrue(answer) == 1;
    Py_XDECREF(answer);
    Py_XDECREF(arguments);
    own->thread = PyEval_SaveThread();
    return is_true;
}

static PyObject *view(double *numbers, int rows, int columns) {
    return PyMemoryView_FromMemory((char *)numbers, (Py_ssize_t)rows * columns * (Py_ssize_t)sizeof *numbers,
                                   PyBUF_WRITE);
}

static bool solve(void *context, int size, const double *matrix, bool is_transposed, double *columns) {
    struct small_motions *own = context;
    lock(own);
    return ask(own, own->solve,
               Py_BuildValue("iNiN", size, view((double *)(uintptr_t)matrix, size, size), (int)is_transposed,
                             view(columns, size, size)));
}

static bool find_eigenvalues(void *context, int size, double *T, double *re, double *im, double *left,
                             double *right) {
    struct small_motions *own = context;
    lock(own);
    return ask(own, own->eigen,
               Py_BuildValue("iNNNNN", size, view(T, size, size), view(re, size, 1), view(im, size, 1),
                             view(left, size, size), view(right, size, size)));
}

static bool solve_least_squares(void *context, int rows, int columns, double *A, double *b, double tol,
                                double *x) {
    struct small_motions *own = context;
    lock(own);
    return ask(own, own->least_squares,
               Py_BuildValue("iiNNdN", rows, columns, view(A, rows, columns), view(b, rows, 1), tol,
                             view(x, columns, 1)));
}

/* ---- The call ---- */

/* Memory of the model instance, its state, and flags. */
struct instance {
    struct refdyn_workspace work;
    double *q, *qd;
    int *held, *given;
};

static int begin(struct small_motions *own, struct instance *instance) {
    const struct refdyn_model *model = own->library->model;
    const size_t n = (size_t)model->n, size = refdyn_workspace_size(model);
    Py_buffer q;
    instance->q = refdyn_motion_memory(&own->pieces, (2 * n + 1) * sizeof(double));
    instance->qd = instance->q + n;
    instance->held = refdyn_motion_memory(&own->pieces, (n + 1) * sizeof(int));
    instance->given = refdyn_motion_memory(&own->pieces, ((size_t)model->anchored_count + 1) * sizeof(int));
    refdyn_workspace_init(&instance->work, model, refdyn_motion_memory(&own->pieces, size), size);
    if (!refdyn_read_values(own->library, &own->values, &instance->work, instance->given) ||
        !refdyn_need_doubles(own->q_object, "q", model->n, 1, 0, &q))
        return 0;
    memcpy(instance->q, q.buf, (size_t)q.len);
    PyBuffer_Release(&q);
    for (int i = 0; i < model->n; i++)
        instance->held[i] = own->is_held[i] != 0;
    refdyn_prepare(&instance->work);
    return 1;
}

static PyObject *list_result(const struct small_motions *own, const struct record_small_motions *motions) {
    struct dict_writer dict;
    const int count = motions->spectrum.count;
    const struct record_writer writer = refdyn_dict_begin(&dict);
    if (!dict.open[0])
        return NULL;
    record_put_small_motions(motions, own->most > 0 && own->most < count ? (int)own->most : count, &writer);
    return refdyn_dict_end(&dict);
}

static PyObject *report(const struct small_motions *own, const struct record_small_motions *motions,
                        int status) {
    char refused[512];
    struct text_stream text;
    if (PyErr_Occurred() || !refdyn_text_open(&text))
        return NULL;
    if (status == REFDYN_REFUSED) {
        refdyn_write_refused(motions->work, own->places, refused, sizeof refused);
        fprintf(text.out, "%s\n", refused);
    } else if (status == REFDYN_OK)
        record_print_small_motions(motions, text.out);
    else
        record_print_failed(motions->work, status, motions->t, motions->q, NULL, text.out);
    PyObject *said = refdyn_text_close(&text);
    PyObject *result = said && status == REFDYN_OK ? list_result(own, motions) : Py_NewRef(Py_None);
    return said && result ? Py_BuildValue("iNN", status, said, result) : NULL;
}

static PyObject *compute(struct small_motions *own) {
    struct instance instance;
    if (!begin(own, &instance))
        return NULL;
    const struct record_algebra algebra = {.memory = {refdyn_motion_memory, &own->pieces},
                                           .context = own,
                                           .solve = solve,
                                           .eigen = find_eigenvalues,
                                           .least_squares = solve_least_squares};
    struct record_small_motions motions = {
        .work = &instance.work, .t = own->t, .q = instance.q, .qd = instance.qd, .held = instance.held};
    int status = refdyn_check_parameters(&instance.work);
    refdyn_anchor(&instance.work, own->t, instance.q, instance.qd, instance.given);
    if (status == REFDYN_OK) {
        own->thread = PyEval_SaveThread();
        status = record_find_small_motions(&motions, &algebra);
        lock(own);
    }
    return report(own, &motions, status);
}

/* modes(p, is_anchored, x, places, t, q, held, most, solve, eigen, least_squares): small motions about q.
 * Returns (status, messages, result); the result is None after a failure. */
PyObject *refdyn_library_modes(PyObject *self, PyObject *arguments) {
    struct small_motions own = {.library = (struct library *)self};
    const struct refdyn_model *model = own.library->model;
    if (!PyArg_ParseTuple(arguments, "Oy#OO!dOy#lOOO", &own.values.p, &own.values.is_anchored,
                          &own.values.flags, &own.values.x, &PyTuple_Type, &own.places, &own.t, &own.q_object,
                          &own.is_held, &own.held_flags, &own.most, &own.solve, &own.eigen,
                          &own.least_squares))
        return NULL;
    if (own.held_flags != model->n || !model->tangent || (model->m && !model->d_rows)) {
        PyErr_SetString(PyExc_ValueError, "modes: wrong number of flags, or functions are missing");
        return NULL;
    }
    const bool has_memory = setjmp(own.pieces.no_memory) == 0;
    if (own.thread)
        lock(&own);
    PyObject *result = has_memory ? compute(&own) : PyErr_NoMemory();
    refdyn_motion_release(&own.pieces);
    return result;
}
