/*
 * A library that `refdyn compile` has built, as an object of Python: opens it, checks its versions, and keeps
 * the model's values and how calls pass others. Arrays are buffers (PEP 3118) of doubles in C order.
 */
#include "runtime/bindings/python/extension.h"

#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- Buffers ---- */

static int has_doubles(const Py_buffer *view) {
    return view->itemsize == sizeof(double) && view->format && strcmp(view->format, "d") == 0 &&
           (uintptr_t)view->buf % sizeof(double) == 0;
}

int refdyn_open_doubles(PyObject *object, Py_buffer *view, int more_flags) {
    if (!PyObject_CheckBuffer(object))
        return 0;
    if (PyObject_GetBuffer(object, view, PyBUF_FORMAT | PyBUF_C_CONTIGUOUS | more_flags) != 0) {
        PyErr_Clear();
        return 0;
    }
    if (has_doubles(view))
        return 1;
    PyBuffer_Release(view);
    return 0;
}

int refdyn_need_doubles(PyObject *object, const char *name, Py_ssize_t count, Py_ssize_t rows, int more_flags,
                        Py_buffer *view) {
    const Py_ssize_t size = count * (Py_ssize_t)sizeof(double);
    if (!refdyn_open_doubles(object, view, more_flags)) {
        PyErr_Format(PyExc_TypeError, "%s: not an array of doubles in C order", name);
        return 0;
    }
    if (view->len == size || view->len == size * rows)
        return 1;
    PyErr_Format(PyExc_ValueError, "%s: has %zd numbers; must have %zd", name,
                 view->len / (Py_ssize_t)sizeof(double), count);
    PyBuffer_Release(view);
    return 0;
}

/* ---- A library ---- */

static void passing_clear(struct passing *passing) {
    Py_XDECREF(passing->places);
    free(passing->order);
}

static void library_dealloc(PyObject *self) {
    struct library *library = (struct library *)self;
    PyTypeObject *type = Py_TYPE(self);
    passing_clear(&library->parameters);
    passing_clear(&library->inputs);
    free(library->p);
    if (library->handle)
        dlclose(library->handle);
    PyObject_Free(self);
    Py_DECREF(type);
}

const void *refdyn_find_symbol(const struct library *library, const char *name) {
    return dlsym(library->handle, name);
}

static const void *find_table(const struct library *library, PyObject *symbol) {
    const char *name = symbol ? PyUnicode_AsUTF8AndSize(symbol, NULL) : NULL;
    const void *table = name ? dlsym(library->handle, name) : NULL;
    if (name && !table)
        PyErr_Format(PyExc_ImportError, "the compiled library has no table %s", name);
    Py_XDECREF(symbol);
    return table;
}

static const struct refdyn_spatial *find_spatial(const struct library *library, const char *name) {
    PyObject *symbol = PyUnicode_FromFormat("%s_spatial", name);
    const char *text = symbol ? PyUnicode_AsUTF8AndSize(symbol, NULL) : NULL;
    const struct refdyn_spatial *spatial = text ? dlsym(library->handle, text) : NULL;
    Py_XDECREF(symbol);
    return spatial;
}

/* Finds the tables of the library and checks that their versions are the ones of this file. */
static int find_tables(struct library *library, const char *name, int width) {
    library->model = find_table(library, PyUnicode_FromFormat("%s_model", name));
    if (!library->model)
        return 0;
    library->spatial = find_spatial(library, name);
    if (width) {
        library->lanes = find_table(library, PyUnicode_FromFormat("%s_lanes_%d", name, width));
        if (!library->lanes)
            return 0;
    }
    if (library->model->interface_version == REFDYN_MODEL_VERSION &&
        (!width || library->lanes->interface_version == REFDYN_LANES_VERSION))
        return 1;
    PyErr_SetString(PyExc_ImportError,
                    "the compiled library belongs to another version of refdyn; install the package again");
    return 0;
}

/* ---- The creation of a library ---- */

/* Keeps the dictionary, and copies the list. Returns 0 with a Python error. */
static int read_passing(struct passing *passing, PyObject *places, PyObject *order) {
    passing->given = (int)PyList_Size(order);
    passing->order = malloc(((size_t)passing->given + 1) * sizeof *passing->order);
    Py_INCREF(places);
    passing->places = places;
    if (!passing->order) {
        PyErr_NoMemory();
        return 0;
    }
    for (int i = 0; i < passing->given; i++) {
        const long place = PyLong_AsLong(PyList_GetItem(order, i));
        if (PyErr_Occurred())
            return 0;
        passing->order[i] = (int)place;
    }
    return 1;
}

/* Copies the model's values; `is_anchored` marks the parameters that the start of a motion sets. Returns 0
 * with a Python error. */
static int keep_values(struct library *library, PyObject *p_object, const char *is_anchored,
                       PyObject *x_object) {
    const size_t p_count = (size_t)library->model->parameter_count,
                 p_width = (size_t)refdyn_parameter_width(library->model),
                 x_count = (size_t)library->model->input_count;
    Py_buffer p, x;
    if (!refdyn_need_doubles(p_object, "p", (Py_ssize_t)p_count, 1, 0, &p))
        return 0;
    if (!refdyn_need_doubles(x_object, "x", (Py_ssize_t)x_count, 1, 0, &x)) {
        PyBuffer_Release(&p);
        return 0;
    }
    library->p = calloc(2 * p_count + x_count + p_width + 1, sizeof *library->p);
    if (library->p) {
        library->free_p = library->p + p_count;
        library->x = library->free_p + p_count;
        library->prepared = library->x + x_count;
        memcpy(library->p, p.buf, (size_t)p.len);
        memcpy(library->x, x.buf, (size_t)x.len);
        for (size_t i = 0; i < p_count; i++)
            library->free_p[i] = is_anchored[i] ? NAN : library->p[i];
    } else
        PyErr_NoMemory();
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    return library->p != NULL;
}

/* Prepares the model's own parameters, which the program has checked. */
static int prepare_own(struct library *library) {
    const struct refdyn_model *model = library->model;
    double *scratch = malloc(refdyn_prepare_scratch(model) * sizeof *scratch);
    if (!scratch) {
        PyErr_NoMemory();
        return 0;
    }
    memcpy(library->prepared, library->free_p, (size_t)model->parameter_count * sizeof *library->p);
    refdyn_prepare_values(library, library->prepared, library->x, scratch);
    free(scratch);
    return 1;
}

/* Library(path, name, lanes, p, is_anchored, x, parameter_places, parameter_order, input_places, input_order,
 * inputs_move_parameters): the model's name; the lane width of its functions for lanes, 0: none; the model's
 * values; how calls pass other values. */
static PyObject *library_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords) {
    const char *path, *name, *is_anchored;
    int width, inputs_move;
    Py_ssize_t flags;
    PyObject *p, *x, *p_places, *p_order, *x_places, *x_order;
    (void)keywords;
    if (!PyArg_ParseTuple(arguments, "ssiOy#OO!O!O!O!p", &path, &name, &width, &p, &is_anchored, &flags, &x,
                          &PyDict_Type, &p_places, &PyList_Type, &p_order, &PyDict_Type, &x_places,
                          &PyList_Type, &x_order, &inputs_move))
        return NULL;
    struct library *library = (struct library *)PyType_GenericAlloc(type, 0);
    if (!library)
        return NULL;
    library->inputs_move_parameters = inputs_move;
    library->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library->handle)
        PyErr_SetString(PyExc_ImportError, dlerror());
    if (library->handle && find_tables(library, name, width)) {
        const struct refdyn_model *model = library->model;
        if (flags != model->parameter_count)
            PyErr_Format(PyExc_ValueError, "is_anchored: has %zd flags; must have %d", flags,
                         model->parameter_count);
        else if (read_passing(&library->parameters, p_places, p_order) &&
                 read_passing(&library->inputs, x_places, x_order) &&
                 keep_values(library, p, is_anchored, x) && prepare_own(library))
            return (PyObject *)library;
    }
    Py_DECREF(library);
    return NULL;
}

/* ---- The type ---- */

static PyObject *library_events(PyObject *self, void *closure) {
    (void)closure;
    return PyLong_FromLong(((struct library *)self)->model->event_count);
}

/* The levels of the rows: 0 positions, 1 velocities, 2 accelerations. */
static PyObject *library_levels(PyObject *self, void *closure) {
    const struct refdyn_model *model = ((struct library *)self)->model;
    PyObject *levels = PyTuple_New(model->m);
    (void)closure;
    for (int i = 0; levels && i < model->m; i++)
        PyTuple_SetItem(levels, i, PyLong_FromLong((long)model->rows[i].level));
    return levels;
}

static PyObject *library_tangent(PyObject *self, void *closure) {
    (void)closure;
    return PyBool_FromLong(refdyn_has_tangent(((struct library *)self)->model));
}

static PyObject *library_derived(PyObject *self, void *closure) {
    (void)closure;
    return PyLong_FromLong(((struct library *)self)->model->derived_count);
}

static PyMethodDef library_methods[] = {
    {"prepare", refdyn_library_prepare, METH_VARARGS, "prepare(rows, p, x)"},
    {"function", refdyn_library_function, METH_VARARGS, "function(quantity, rates, size)"},
    {"motion", refdyn_library_motion, METH_VARARGS, "motion(options, p, is_anchored, x, places, follow)"},
    {"statics", refdyn_library_statics, METH_VARARGS,
     "statics(p, is_anchored, x, places, t, q, held, rows, way, starts)"},
    {"modes", refdyn_library_modes, METH_VARARGS,
     "modes(p, is_anchored, x, places, t, q, held, most, solve, eigen, least_squares)"},
    {"stepper", refdyn_library_stepper, METH_VARARGS, "stepper(method, p, x)"},
    {"columns", refdyn_library_columns, METH_NOARGS, "columns(): names and units of the columns of a motion"},
    {NULL, NULL, 0, NULL},
};

static PyGetSetDef library_values[] = {
    {"derived_count", library_derived, NULL, "number of derived parameters, which follow the parameters in p",
     NULL},
    {"row_levels", library_levels, NULL, "levels of the rows: 0 positions, 1 velocities, 2 accelerations",
     NULL},
    {"has_tangent", library_tangent, NULL, "whether the tangent was emitted", NULL},
    {"event_count", library_events, NULL, "number of events of the model", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyType_Slot library_slots[] = {
    {Py_tp_doc, "Library(path, name, lanes, ...): functions and values of a compiled model"},
    {Py_tp_new, library_new},
    {Py_tp_dealloc, library_dealloc},
    {Py_tp_methods, library_methods},
    {Py_tp_getset, library_values},
    {0, NULL},
};

PyType_Spec refdyn_library_spec = {"refdyn.core.Library", sizeof(struct library), 0, Py_TPFLAGS_DEFAULT,
                                   library_slots};
