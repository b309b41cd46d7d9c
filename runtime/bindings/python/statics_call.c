/* Equilibria of a compiled model in the process, with the messages of `refdyn statics`. */
#include "runtime/bindings/python/extension.h"

#include <stdlib.h>
#include <string.h>

/* The arguments of a call, and its memory. */
struct equilibrium {
    const struct refdyn_model *model;
    struct given_values values;
    PyObject *places, *q_object, *starts_object;
    const char *is_held, *is_row; /* (n) held coordinates; (m) rows that hold */
    Py_ssize_t held_flags, row_flags;
    double t;
    int way;

    struct refdyn_workspace work;
    struct refdyn_statics_options options;
    struct refdyn_statics_result result;
    char *memory; /* of the workspace, of statics, then: */
    size_t work_size, statics_size;
    double *q, *qd, *hold_force;          /* (n) */
    int *held, *held_list, *rows, *given; /* (n) (n) (m) (anchored_count) */
    const char **starts;                  /* (m) */
};

static void *take(char **at, size_t count, size_t size) {
    void *piece = *at;
    *at += (count * size + 15) / 16 * 16;
    return piece;
}

/* Returns 0 with a Python error without memory. */
static int allocate(struct equilibrium *e) {
    const size_t n = (size_t)e->model->n, m = (size_t)e->model->m,
                 anchored = (size_t)e->model->anchored_count;
    e->work_size = refdyn_workspace_size(e->model);
    e->statics_size = refdyn_statics_size(e->model);
    e->memory = calloc(1, e->work_size + e->statics_size + 64 * (n + m + anchored + 16));
    if (!e->memory) {
        PyErr_NoMemory();
        return 0;
    }
    char *at = e->memory + (e->work_size + 15) / 16 * 16 + (e->statics_size + 15) / 16 * 16;
    e->q = take(&at, 2 * n, sizeof(double)); /* with qd */
    e->qd = e->q + n;
    e->hold_force = take(&at, n, sizeof(double));
    e->starts = take(&at, m, sizeof(char *));
    e->held = take(&at, n, sizeof(int));
    e->held_list = take(&at, n, sizeof(int));
    e->rows = take(&at, m, sizeof(int));
    e->given = take(&at, anchored, sizeof(int));
    return 1;
}

static int read_lists(struct equilibrium *e) {
    const struct refdyn_model *model = e->model;
    if (e->held_flags != model->n || e->row_flags != model->m || PyTuple_Size(e->starts_object) != model->m) {
        PyErr_SetString(PyExc_ValueError, "statics: held, rows or starts: wrong length");
        return 0;
    }
    e->options = refdyn_statics_default();
    e->options.t = e->t;
    e->options.way = (enum refdyn_statics_way)e->way;
    e->options.rows = e->rows;
    for (int i = 0; i < model->n; i++)
        e->held[i] = e->is_held[i] != 0;
    for (int i = 0; i < model->m; i++) {
        PyObject *start = PyTuple_GetItem(e->starts_object, i);
        e->starts[i] = start == Py_None ? NULL : PyUnicode_AsUTF8AndSize(start, NULL);
        if (e->is_row[i])
            e->rows[e->options.row_count++] = i;
    }
    return !PyErr_Occurred();
}

static int read_state(struct equilibrium *e) {
    Py_buffer view;
    refdyn_prepare(&e->work);
    refdyn_initial_state(&e->work, e->q, e->qd);
    refdyn_anchor(&e->work, 0, e->q, e->qd, e->given);
    if (e->q_object != Py_None) {
        if (!refdyn_need_doubles(e->q_object, "q", e->model->n, 1, 0, &view))
            return 0;
        memcpy(e->q, view.buf, (size_t)view.len);
        PyBuffer_Release(&view);
    }
    refdyn_enter_statics(e->model, e->q, e->qd);
    return 1;
}

static int solve(struct equilibrium *e) {
    struct unlocked unlocked = {.asked = refdyn_seconds(CLOCK_MONOTONIC)};
    int count = 0;
    for (int i = 0; i < e->model->n; i++)
        if (e->held[i])
            e->held_list[count++] = i;
    e->options.ask = refdyn_ask;
    e->options.context = &unlocked;
    unlocked.thread = PyEval_SaveThread();
    const int status = refdyn_statics(&e->work, &e->options, e->held_list, count, e->q, e->hold_force,
                                      &e->result, e->memory + (e->work_size + 15) / 16 * 16, e->statics_size);
    PyEval_RestoreThread(unlocked.thread);
    refdyn_leave_statics(e->model, e->q, e->qd);
    return status;
}

static void put_points(struct equilibrium *e, const struct record_writer *writer) {
    const struct refdyn_model *model = e->model;
    double *r = malloc((3 * (size_t)model->point_count + 1) * sizeof *r);
    if (!r) {
        PyErr_NoMemory();
        return;
    }
    if (model->point_count)
        model->r(e->work.p, e->work.x, e->t, e->q, e->qd, r);
    writer->open(writer->context, "points", '{');
    for (int i = 0; i < model->point_count; i++)
        record_put_array(writer, model->points[i], r + 3 * i, 3);
    writer->close(writer->context, '}');
    free(r);
}

static PyObject *list_result(struct equilibrium *e, const struct record_equilibrium *record) {
    struct dict_writer dict;
    const struct record_writer writer = refdyn_dict_begin(&dict);
    if (!dict.open[0])
        return NULL;
    record_put_array(&writer, "q", e->q, e->model->n);
    record_put_array(&writer, "qd", e->qd, e->model->n);
    put_points(e, &writer);
    record_put_equilibrium(record, &writer);
    return refdyn_dict_end(&dict);
}

static PyObject *report(struct equilibrium *e, int status) {
    const struct record_equilibrium record = {&e->work,      &e->options, &e->result, e->held,
                                              e->hold_force, e->q,        e->qd,      e->starts};
    char refused[512];
    struct text_stream text;
    if (PyErr_Occurred() || !refdyn_text_open(&text)) /* interrupted, or without memory */
        return NULL;
    if (status == REFDYN_REFUSED) {
        refdyn_write_refused(&e->work, e->places, refused, sizeof refused);
        fprintf(text.out, "%s\n", refused);
    } else if (status == REFDYN_OK)
        record_print_equilibrium(&record, text.out);
    else
        record_print_no_equilibrium(&record, status, text.out);
    PyObject *said = refdyn_text_close(&text);
    PyObject *result = said && status == REFDYN_OK ? list_result(e, &record) : Py_NewRef(Py_None);
    return said && result ? Py_BuildValue("iNN", status, said, result) : NULL;
}

static PyObject *compute(struct equilibrium *e, const struct library *library) {
    int status = refdyn_workspace_init(&e->work, e->model, e->memory, e->work_size);
    if (status)
        return PyErr_Format(PyExc_ValueError, "statics: %s", refdyn_status_text(status));
    if (!refdyn_read_values(library, &e->values, &e->work, e->given) || !read_lists(e))
        return NULL;
    refdyn_prepare(&e->work);
    status = refdyn_check_parameters(&e->work);
    if (status == REFDYN_REFUSED)
        return report(e, status);
    return read_state(e) ? report(e, solve(e)) : NULL;
}

/* statics(p, is_anchored, x, places, t, q, held, rows, way, starts): computes the equilibrium near q, None:
 * near the initial state. Returns (status, messages, result); the result is None after a failure. */
PyObject *refdyn_library_statics(PyObject *self, PyObject *arguments) {
    const struct library *library = (const struct library *)self;
    struct equilibrium e = {.model = library->model};
    if (!PyArg_ParseTuple(arguments, "Oy#OO!dOy#y#iO!", &e.values.p, &e.values.is_anchored, &e.values.flags,
                          &e.values.x, &PyTuple_Type, &e.places, &e.t, &e.q_object, &e.is_held, &e.held_flags,
                          &e.is_row, &e.row_flags, &e.way, &PyTuple_Type, &e.starts_object))
        return NULL;
    if (!allocate(&e))
        return NULL;
    PyObject *result = compute(&e, library);
    free(e.memory);
    return result;
}
