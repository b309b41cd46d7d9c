/*
 * The arguments of a call about one state, as a control loop passes them: rows of doubles; inputs and
 * parameters that are None, a dictionary of numbers or a row in the model's order. This file reads them
 * without a copy. The caller leaves arguments of any other form to the checks in Python.
 */
#include "runtime/bindings/python/extension.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Rows and numbers ---- */

double *refdyn_one_call_row(struct one_call *call, enum one_call_view which, PyObject *object, int count) {
    Py_buffer *view = &call->views[which];
    const int is_result = which == VIEW_OUT || which == VIEW_OUT_QD;
    if (Py_TYPE(object) != call->array)
        return NULL;
    call->is_open[which] = refdyn_open_doubles(object, view, is_result ? PyBUF_WRITABLE : 0);
    if (!call->is_open[which] || view->len != count * (Py_ssize_t)sizeof(double) ||
        (view->ndim != 1 && !is_result))
        return NULL;
    return view->buf;
}

int refdyn_one_call_number(PyObject *object, double *number) {
    if (!PyFloat_Check(object) && !PyLong_CheckExact(object))
        return 0;
    *number = PyFloat_AsDouble(object);
    if (*number == -1 && PyErr_Occurred()) { /* an integer beyond the doubles */
        PyErr_Clear();
        return 0;
    }
    return 1;
}

/* ---- Inputs and parameters ---- */

/* Writes the numbers of a dictionary to their places in `to`, and skips names that the library does not read.
 * Returns how many were skipped; -1, without a Python error, for an unknown name or anything but finite
 * numbers. */
static int read_dictionary(const struct passing *passing, PyObject *given, double *to) {
    PyObject *name, *value;
    Py_ssize_t position = 0;
    double number;
    int skipped = 0;
    if (!PyDict_CheckExact(given))
        return -1;
    while (PyDict_Next(given, &position, &name, &value)) {
        PyObject *place = PyUnicode_CheckExact(name) ? PyDict_GetItem(passing->places, name) : NULL;
        if (!place || !refdyn_one_call_number(value, &number) || !isfinite(number))
            return -1;
        const long index = PyLong_AsLong(place);
        if (index > UNREAD)
            to[index] = number;
        else
            skipped++;
    }
    return skipped;
}

int refdyn_read_by_name(const struct passing *passing, PyObject *given, double *to) {
    return given == Py_None || read_dictionary(passing, given, to) == 0;
}

/* Writes the numbers of an array to their places in `to`. `free`, unless NULL, is NaN where NaN is allowed.
 * Returns 0, without a Python error, for anything but a row of such numbers. */
static int read_row(struct one_call *call, enum one_call_view which, const struct passing *passing,
                    PyObject *given, const double *free, double *to) {
    const double *row = refdyn_one_call_row(call, which, given, passing->given);
    int is_good = row != NULL;
    for (int i = 0; is_good && i < passing->given; i++) {
        const int place = passing->order[i];
        const int may_be_nan = place == FREE_UNREAD || (place >= 0 && free && isnan(free[place]));
        is_good = isfinite(row[i]) || (isnan(row[i]) && may_be_nan);
        if (place > UNREAD)
            to[place] = row[i];
    }
    return is_good;
}

/* Sets the inputs of the call. Returns 0, without a Python error, if Python has to check them. */
static int read_inputs(struct one_call *call, PyObject *given) {
    const struct library *library = call->library;
    call->x = given == Py_None ? library->x : call->own_x;
    if (given == Py_None)
        return 1;
    memcpy(call->own_x, library->x, (size_t)library->model->input_count * sizeof *call->own_x);
    return PyDict_CheckExact(given) ? read_dictionary(&library->inputs, given, call->own_x) >= 0
                                    : read_row(call, VIEW_X, &library->inputs, given, NULL, call->own_x);
}

/* Sets the parameters of the call, prepared unless call->prepares; returns as above. */
static int read_parameters(struct one_call *call, PyObject *given) {
    const struct library *library = call->library;
    call->prepares = given != Py_None || (call->x != library->x && library->inputs_move_parameters);
    call->p = call->prepares ? call->own_p : library->prepared;
    if (!call->prepares)
        return 1;
    memcpy(call->own_p, library->free_p, (size_t)library->model->parameter_count * sizeof *call->own_p);
    if (given == Py_None)
        return 1;
    return PyDict_CheckExact(given)
               ? read_dictionary(&library->parameters, given, call->own_p) >= 0
               : read_row(call, VIEW_P, &library->parameters, given, library->free_p, call->own_p);
}

int refdyn_one_call_values(struct one_call *call, PyObject *inputs, PyObject *parameters) {
    return read_inputs(call, inputs) && read_parameters(call, parameters);
}

int refdyn_one_call_prepare(const struct one_call *call) {
    const double *numbers;
    if (!call->prepares)
        return 1;
    refdyn_prepare_values(call->library, call->own_p, call->x, call->scratch);
    return refdyn_find_refused(call->library->model, call->p, call->x, call->scratch, &numbers) < 0;
}

/* ---- Memory ---- */

int refdyn_one_call_begin(struct one_call *call, const struct library *library, PyObject *self, int more) {
    const struct refdyn_model *model = library->model;
    const size_t size =
        (size_t)(more + model->input_count + refdyn_parameter_width(model)) + refdyn_prepare_scratch(model);
    memset(call->is_open, 0, sizeof call->is_open);
    call->library = library;
    call->array = ((const struct types *)PyType_GetModuleState(Py_TYPE(self)))->array;
    call->more = size <= ONE_CALL_LOCAL ? call->local : malloc(size * sizeof *call->more);
    if (!call->more) {
        PyErr_NoMemory();
        return 0;
    }
    call->own_x = call->more + more;
    call->own_p = call->own_x + model->input_count;
    call->scratch = call->own_p + refdyn_parameter_width(model);
    return 1;
}

void refdyn_one_call_end(struct one_call *call) {
    for (int i = 0; i < ONE_CALL_VIEWS; i++)
        if (call->is_open[i])
            PyBuffer_Release(&call->views[i]);
    if (call->more != call->local)
        free(call->more);
}
