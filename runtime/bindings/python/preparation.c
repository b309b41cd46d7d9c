/*
 * Prepares the parameters of a call: computes the derived ones and those that the start of a motion sets, and
 * checks the rules of the model, such as a positive mass. Rows with NaN for a value that the start sets are
 * free there.
 */
#include "runtime/bindings/python/extension.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int refdyn_parameter_width(const struct refdyn_model *model) {
    return model->parameter_count + model->derived_count;
}

/* Number of doubles in the result of `required`. */
static size_t required_count(const struct refdyn_model *model) {
    size_t count = 0;
    for (int i = 0; i < model->requirement_count; i++)
        count += 1 + (size_t)model->requirements[i].count;
    return count;
}

size_t refdyn_prepare_scratch(const struct refdyn_model *model) {
    return 4 * (size_t)model->n + 2 * (size_t)model->anchored_count + required_count(model) + 1;
}

/* Marks the parameters of p that are NaN in `is_free`: the start sets them. They have the model's values
 * until then. Returns whether there are any. */
static int mark_free(const struct library *library, double *p, double *is_free) {
    const struct refdyn_model *model = library->model;
    int count = 0;
    for (int i = 0; i < model->anchored_count; i++) {
        double *value = &p[model->anchored[i]];
        is_free[i] = isnan(*value);
        if (is_free[i] > 0)
            *value = library->p[model->anchored[i]];
        count += is_free[i] > 0;
    }
    return count > 0;
}

void refdyn_prepare_values(const struct library *library, double *p, const double *x, double *scratch) {
    const struct refdyn_model *model = library->model;
    double *q = scratch, *qd = q + model->n, *start = qd + model->n; /* start: (2 n) */
    double *anchored = start + 2 * model->n, *is_free = anchored + model->anchored_count;
    const int has_free = mark_free(library, p, is_free);
    if (model->prepare)
        model->prepare(p);
    if (!has_free || !model->anchor)
        return;
    for (int j = 0; j < model->n; j++) {
        q[j] = model->coordinates[j].value;
        qd[j] = 0;
    }
    if (model->start) {
        model->start(p, x, 0, q, qd, start);
        memcpy(q, start, 2 * (size_t)model->n * sizeof *q);
    }
    model->anchor(p, x, 0, q, qd, anchored);
    for (int i = 0; i < model->anchored_count; i++)
        if (is_free[i] > 0)
            p[model->anchored[i]] = anchored[i];
    if (model->prepare)
        model->prepare(p);
}

int refdyn_find_refused(const struct refdyn_model *model, const double *p, const double *x, double *scratch,
                        const double **numbers) {
    double *required = scratch + 4 * model->n + 2 * model->anchored_count;
    if (model->requirement_count > 0)
        model->required(p, x, 0, scratch, scratch, required);
    for (int i = 0; i < model->requirement_count; i++) {
        *numbers = required + 1;
        if (!(*required > 0))
            return i;
        required += 1 + model->requirements[i].count;
    }
    return -1;
}

/* The first row that the model refuses. */
struct refusal {
    Py_ssize_t row;
    int requirement; /* index of the violated requirement; -1: the model accepts all rows */
    const double *numbers;
};

/* Returns (row, requirement, "subject: fact"), or None if the model accepts all rows. */
static PyObject *report_refusal(const struct refdyn_model *model, const struct refusal *refusal) {
    double own[REFDYN_REQUIREMENT_NUMBERS] = {0};
    char fact[512];
    if (refusal->requirement < 0)
        return Py_NewRef(Py_None);
    const struct refdyn_requirement *requirement = &model->requirements[refusal->requirement];
    memcpy(own, refusal->numbers, (size_t)requirement->count * sizeof *own);
    snprintf(fact, sizeof fact, requirement->fact, own[0], own[1], own[2], own[3], own[4], own[5]);
    return Py_BuildValue("niN", refusal->row, refusal->requirement,
                         PyUnicode_FromFormat("%s: %s", requirement->subject, fact));
}

/* Prepares rows up to the first one that the model refuses. */
static struct refusal prepare_rows(const struct library *library, Py_ssize_t rows, double *p, const double *x,
                                   int has_x_by_row, double *scratch) {
    const struct refdyn_model *model = library->model;
    struct refusal refusal = {.row = -1, .requirement = -1};
    Py_BEGIN_ALLOW_THREADS;
    while (refusal.requirement < 0 && ++refusal.row < rows) {
        refdyn_prepare_values(library, p, x, scratch);
        refusal.requirement = refdyn_find_refused(model, p, x, scratch, &refusal.numbers);
        p += refdyn_parameter_width(model);
        x += has_x_by_row ? model->input_count : 0;
    }
    Py_END_ALLOW_THREADS;
    return refusal;
}

/* prepare(rows, p, x): each row of p (rows x (parameters + derived)) begins with the parameters, NaN for
 * those that the start of a motion sets; the function sets these and the derived ones. x has one row of
 * inputs, or one for each row of p. Returns None, or (row, requirement, "subject: fact") of the first row
 * that the model refuses. */
PyObject *refdyn_library_prepare(PyObject *self, PyObject *arguments) {
    const struct library *library = (struct library *)self;
    const struct refdyn_model *model = library->model;
    const Py_ssize_t width = refdyn_parameter_width(model);
    PyObject *p_object, *x_object;
    Py_buffer p, x;
    Py_ssize_t rows;
    if (!PyArg_ParseTuple(arguments, "nOO", &rows, &p_object, &x_object))
        return NULL;
    if (!refdyn_need_doubles(p_object, "p", width, rows, PyBUF_WRITABLE, &p))
        return NULL;
    if (!refdyn_need_doubles(x_object, "x", model->input_count, rows, 0, &x)) {
        PyBuffer_Release(&p);
        return NULL;
    }
    double *scratch = malloc(refdyn_prepare_scratch(model) * sizeof *scratch);
    const Py_ssize_t given_rows = width ? p.len / (width * (Py_ssize_t)sizeof(double)) : 0;
    const int has_x_by_row = x.len > model->input_count * (Py_ssize_t)sizeof(double) && given_rows == rows;
    PyObject *result = NULL;
    if (scratch) {
        const struct refusal refusal = prepare_rows(library, given_rows, p.buf, x.buf, has_x_by_row, scratch);
        result = report_refusal(model, &refusal);
    } else
        PyErr_NoMemory();
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    free(scratch);
    return result;
}
