/*
 * refdyn.core: evaluates the functions of a compiled model on Python arrays.
 *
 * Opens a library that `refdyn compile` has built. Arguments are buffers (PEP 3118) of doubles in C order,
 * such as NumPy arrays, and are not copied. One state is evaluated by the functions of refdyn_model.h, many
 * states by the functions of refdyn_lanes.h, both without the interpreter's lock. An object never changes
 * after its creation, so any number of threads may call it. The stable interface of Python (Py_LIMITED_API)
 * is enough, so that one wheel suits Python 3.11 and later versions.
 */
#include "runtime/bindings/python/extension.h"

#include <dlfcn.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Quantities by name ---- */

struct quantity {
    const char *name;
    size_t of_one, of_lanes; /* offsets of its function in struct refdyn_model and refdyn_lane_model */
};

#define QUANTITY(name) {#name, offsetof(struct refdyn_model, name), offsetof(struct refdyn_lane_model, name)},
static const struct quantity quantities[] = {REFDYN_QUANTITIES(QUANTITY)};

enum { QUANTITY_COUNT = sizeof quantities / sizeof quantities[0] };

static const struct quantity *find_quantity(const char *name) {
    for (int i = 0; i < QUANTITY_COUNT; i++)
        if (strcmp(quantities[i].name, name) == 0)
            return &quantities[i];
    return NULL;
}

/* ---- Buffers ---- */

static int has_doubles(const Py_buffer *view) {
    return view->itemsize == sizeof(double) && view->format && strcmp(view->format, "d") == 0 &&
           (uintptr_t)view->buf % sizeof(double) == 0;
}

/* Opens doubles in C order of any shape. Returns 0, without a Python error, if the object has none. */
static int open_doubles(PyObject *object, Py_buffer *view, int more_flags) {
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

/* Opens `count` doubles, or `rows` rows of `count` doubles. Returns 0 with a Python error if the object has
 * others. */
int refdyn_need_doubles(PyObject *object, const char *name, Py_ssize_t count, Py_ssize_t rows, int more_flags,
                        Py_buffer *view) {
    const Py_ssize_t size = count * (Py_ssize_t)sizeof(double);
    if (!open_doubles(object, view, more_flags)) {
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

/* ---- Preparation of parameters ---- */

static int width_of(const struct refdyn_model *model) {
    return model->parameter_count + model->derived_count;
}

/* Number of doubles in the result of `required`. */
static size_t required_count(const struct refdyn_model *model) {
    size_t count = 0;
    for (int i = 0; i < model->requirement_count; i++)
        count += 1 + (size_t)model->requirements[i].count;
    return count;
}

/* Number of doubles in the scratch of `prepare` and `find_refused`. */
static size_t scratch_count(const struct refdyn_model *model) {
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

/* Computes the same as refdyn_prepare, refdyn_initial_state and refdyn_anchor. */
static void prepare(const struct library *library, double *p, const double *x, double *scratch) {
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

/* Returns the index of the first requirement that the parameters p violate, and its numbers; -1 if p meets
 * all. */
static int find_refused(const struct refdyn_model *model, const double *p, const double *x, double *scratch,
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

static PyObject *refuse(const struct refdyn_requirement *requirement, const double *numbers) {
    double own[REFDYN_REQUIREMENT_NUMBERS] = {0};
    char fact[512];
    memcpy(own, numbers, (size_t)requirement->count * sizeof *own);
    snprintf(fact, sizeof fact, requirement->fact, own[0], own[1], own[2], own[3], own[4], own[5]);
    return PyErr_Format(PyExc_ValueError, "parameters: the model refuses them: %s: %s", requirement->subject,
                        fact);
}

/* Prepares rows up to the first one that the model refuses. Returns the index of the violated requirement;
 * -1 if the model accepts all rows. */
static int prepare_rows(const struct library *library, Py_ssize_t rows, double *p, const double *x,
                        int has_x_by_row, double *scratch, const double **numbers) {
    const struct refdyn_model *model = library->model;
    int refused = -1;
    Py_BEGIN_ALLOW_THREADS;
    for (Py_ssize_t i = 0; i < rows && refused < 0; i++, p += width_of(model)) {
        prepare(library, p, x, scratch);
        refused = find_refused(model, p, x, scratch, numbers);
        x += has_x_by_row ? model->input_count : 0;
    }
    Py_END_ALLOW_THREADS;
    return refused;
}

/* prepare(rows, p, x): each row of p (rows x (parameters + derived)) begins with the parameters, NaN for
 * those that the start of a motion sets; the function sets these and the derived ones. x has one row of
 * inputs, or one for each row of p. */
static PyObject *library_prepare(PyObject *self, PyObject *arguments) {
    const struct library *library = (struct library *)self;
    const struct refdyn_model *model = library->model;
    const Py_ssize_t width = width_of(model);
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
    const double *numbers = NULL;
    int refused = -1;
    double *scratch = malloc(scratch_count(model) * sizeof *scratch);
    const Py_ssize_t given_rows = width ? p.len / (width * (Py_ssize_t)sizeof(double)) : 0;
    const int has_x_by_row = x.len > model->input_count * (Py_ssize_t)sizeof(double) && given_rows == rows;
    if (scratch)
        refused = prepare_rows(library, given_rows, p.buf, x.buf, has_x_by_row, scratch, &numbers);
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    if (!scratch)
        return PyErr_NoMemory();
    if (refused >= 0)
        refuse(&model->requirements[refused], numbers);
    free(scratch);
    if (refused >= 0)
        return NULL;
    Py_RETURN_NONE;
}

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
                 p_width = (size_t)width_of(library->model), x_count = (size_t)library->model->input_count;
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

static int prepare_own(struct library *library) {
    const struct refdyn_model *model = library->model;
    const double *numbers = NULL;
    double *scratch = malloc(scratch_count(model) * sizeof *scratch);
    if (!scratch) {
        PyErr_NoMemory();
        return 0;
    }
    memcpy(library->prepared, library->free_p, (size_t)model->parameter_count * sizeof *library->p);
    const int refused = prepare_rows(library, 1, library->prepared, library->x, 0, scratch, &numbers);
    if (refused >= 0)
        refuse(&model->requirements[refused], numbers);
    free(scratch);
    return refused < 0;
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

/* ---- A function ---- */

struct function {
    PyObject_HEAD struct library *library; /* held */
    refdyn_function *of_one;
    refdyn_lane_function *of_lanes; /* NULL: the quantity is not emitted for lanes */
    int rates, size;                /* numbers in qd and in a result */
    double *rest;                   /* (rates) zeros */
};

static void function_dealloc(PyObject *self) {
    struct function *function = (struct function *)self;
    PyTypeObject *type = Py_TYPE(self);
    free(function->rest);
    Py_XDECREF((PyObject *)function->library);
    PyObject_Free(self);
    Py_DECREF(type);
}

/* Returns a function of struct refdyn_spatial, which is not emitted for lanes; NULL for another name. */
static refdyn_function *find_spatial_function(const struct refdyn_spatial *spatial, const char *name) {
    if (spatial && strcmp(name, "J") == 0)
        return spatial->J;
    return spatial && strcmp(name, "Jd_qd") == 0 ? spatial->Jd_qd : NULL;
}

static int find_function(struct function *function, const char *name) {
    const struct library *library = function->library;
    const struct quantity *quantity = find_quantity(name);
    if (quantity)
        memcpy(&function->of_one, (const char *)library->model + quantity->of_one, sizeof function->of_one);
    if (quantity && library->lanes)
        memcpy(&function->of_lanes, (const char *)library->lanes + quantity->of_lanes,
               sizeof function->of_lanes);
    if (!quantity)
        function->of_one = find_spatial_function(library->spatial, name);
    if (!function->of_one)
        PyErr_Format(PyExc_ImportError, "the compiled library has no function %s", name);
    return function->of_one != NULL;
}

/* function(quantity, rates, size): numbers in qd and in a result. */
static PyObject *library_function(PyObject *self, PyObject *arguments) {
    const char *name;
    int rates, size;
    if (!PyArg_ParseTuple(arguments, "sii", &name, &rates, &size))
        return NULL;
    PyTypeObject *type = ((const struct types *)PyType_GetModuleState(Py_TYPE(self)))->function;
    struct function *function = (struct function *)PyType_GenericAlloc(type, 0);
    if (!function)
        return NULL;
    Py_INCREF(self);
    function->library = (struct library *)self;
    function->rates = rates;
    function->size = size;
    function->rest = calloc((size_t)rates + 1, sizeof *function->rest);
    if (!function->rest)
        PyErr_NoMemory();
    if (function->rest && find_function(function, name))
        return (PyObject *)function;
    Py_DECREF(function);
    return NULL;
}

/* ---- One state ---- */

/* The arguments of one call: the doubles of a view, scratch, or the model's values. */
enum { VIEW_Q, VIEW_QD, VIEW_OUT, VIEW_P, VIEW_X, VIEWS };

struct call {
    Py_buffer views[VIEWS];
    int is_open[VIEWS];
    const double *p, *x, *q, *qd;
    double t, *out;
    double *own_p, *own_x, *scratch;
    int prepares;              /* own_p must be prepared */
    const PyTypeObject *array; /* the only type that a row may have */
};

enum { LOCAL_DOUBLES = 512 }; /* scratch on the stack, enough for small models */

static void close_views(struct call *call) {
    for (int i = 0; i < VIEWS; i++)
        if (call->is_open[i])
            PyBuffer_Release(&call->views[i]);
}

/* Opens one row of `count` doubles. Returns NULL, without a Python error, for anything else. */
static double *open_row(struct call *call, int which, PyObject *object, int count) {
    Py_buffer *view = &call->views[which];
    if (Py_TYPE(object) != call->array)
        return NULL;
    call->is_open[which] = open_doubles(object, view, which == VIEW_OUT ? PyBUF_WRITABLE : 0);
    if (!call->is_open[which] || view->len != count * (Py_ssize_t)sizeof(double) ||
        (view->ndim != 1 && which != VIEW_OUT))
        return NULL;
    return view->buf;
}

/* Reads a finite Python number. Returns 0, without a Python error, for anything else. */
static int read_number(PyObject *object, double *number) {
    if (!PyFloat_Check(object) && !PyLong_CheckExact(object))
        return 0;
    *number = PyFloat_AsDouble(object);
    if (*number == -1 && PyErr_Occurred()) { /* an integer beyond the doubles */
        PyErr_Clear();
        return 0;
    }
    return isfinite(*number);
}

/* Writes the numbers of a dictionary to their places in `to`. Returns 0, without a Python error, if it has an
 * unknown name or anything but finite numbers. */
static int read_by_name(const struct passing *passing, PyObject *given, double *to) {
    PyObject *name, *value;
    Py_ssize_t position = 0;
    double number;
    while (PyDict_Next(given, &position, &name, &value)) {
        PyObject *place = PyUnicode_CheckExact(name) ? PyDict_GetItem(passing->places, name) : NULL;
        if (!place || !read_number(value, &number))
            return 0;
        const long index = PyLong_AsLong(place);
        if (index > UNREAD)
            to[index] = number;
    }
    return 1;
}

/* Writes the numbers of an array to their places in `to`. `free`, unless NULL, is NaN where NaN is allowed.
 * Returns 0, without a Python error, for anything but a row of such numbers. */
static int read_row(struct call *call, int which, const struct passing *passing, PyObject *given,
                    const double *free, double *to) {
    const double *row = open_row(call, which, given, passing->given);
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

/* Returns the inputs of the call; NULL, without a Python error, if Python has to check them. */
static const double *open_inputs(struct call *call, const struct library *library, PyObject *given) {
    if (given == Py_None)
        return library->x;
    memcpy(call->own_x, library->x, (size_t)library->model->input_count * sizeof *call->own_x);
    const int is_good = PyDict_CheckExact(given)
                            ? read_by_name(&library->inputs, given, call->own_x)
                            : read_row(call, VIEW_X, &library->inputs, given, NULL, call->own_x);
    return is_good ? call->own_x : NULL;
}

/* Returns the parameters of the call, prepared unless call->prepares; NULL as above. */
static const double *open_parameters(struct call *call, const struct library *library, PyObject *given) {
    const struct refdyn_model *model = library->model;
    call->prepares = given != Py_None || (call->x != library->x && library->inputs_move_parameters);
    if (!call->prepares)
        return library->prepared;
    memcpy(call->own_p, library->free_p, (size_t)model->parameter_count * sizeof *call->own_p);
    if (given == Py_None)
        return call->own_p;
    const int is_good = PyDict_CheckExact(given) ? read_by_name(&library->parameters, given, call->own_p)
                                                 : read_row(call, VIEW_P, &library->parameters, given,
                                                            library->free_p, call->own_p);
    return is_good ? call->own_p : NULL;
}

static int open_call(struct call *call, const struct function *function, PyObject *const *given) {
    const struct library *library = function->library;
    const int is_number = PyFloat_Check(given[2]) || PyLong_Check(given[2]);
    call->q = open_row(call, VIEW_Q, given[0], library->model->n);
    call->qd = given[1] == Py_None ? function->rest : open_row(call, VIEW_QD, given[1], function->rates);
    call->t = is_number ? PyFloat_AsDouble(given[2]) : 0;
    call->out = open_row(call, VIEW_OUT, given[3], function->size);
    call->x = open_inputs(call, library, given[4]);
    call->p = call->x ? open_parameters(call, library, given[5]) : NULL;
    return is_number && call->q && call->qd && call->out && call->p;
}

/* Returns the index of a violated requirement, whose numbers are in the scratch; -1: the result is in out. */
static int compute_one(const struct call *call, const struct function *function, const double **numbers) {
    const struct library *library = function->library;
    int refused = -1;
    Py_BEGIN_ALLOW_THREADS;
    if (call->prepares) {
        prepare(library, call->own_p, call->x, call->scratch);
        refused = find_refused(library->model, call->p, call->x, call->scratch, numbers);
    }
    if (refused < 0)
        function->of_one(call->p, call->x, call->t, call->q, call->qd, call->out);
    Py_END_ALLOW_THREADS;
    return refused;
}

/* Opens the arguments and computes, with `room` as scratch. Returns whether out has the result. */
static int call_one(struct call *call, const struct function *function, PyObject *const *given,
                    double *room) {
    const struct refdyn_model *model = function->library->model;
    const double *numbers = NULL;
    call->own_x = room;
    call->own_p = call->own_x + model->input_count;
    call->scratch = call->own_p + width_of(model);
    const int is_good = open_call(call, function, given);
    const int refused = is_good && !PyErr_Occurred() ? compute_one(call, function, &numbers) : -1;
    if (refused >= 0)
        refuse(&model->requirements[refused], numbers);
    close_views(call);
    return is_good;
}

/* one(q, qd, t, out, inputs, parameters): writes the result at one state to out. qd None means zero rates;
 * inputs and parameters are None, a dictionary of numbers or a row in the model's order. Returns False and
 * computes nothing if t is not a number or another argument is not of this form. */
static PyObject *function_one(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    const struct function *function = (const struct function *)self;
    const struct types *types = PyType_GetModuleState(Py_TYPE(self));
    const struct refdyn_model *model = function->library->model;
    struct call call = {.t = 0, .array = types->array};
    double local[LOCAL_DOUBLES];
    if (count != 6)
        return PyErr_Format(PyExc_TypeError, "one: has %zd arguments; must have 6", count);
    const size_t size = (size_t)(model->input_count + width_of(model)) + scratch_count(model);
    double *room = size <= LOCAL_DOUBLES ? local : malloc(size * sizeof *room);
    if (!room)
        return PyErr_NoMemory();
    const int is_good = call_one(&call, function, given, room);
    if (room != local)
        free(room);
    if (PyErr_Occurred())
        return NULL;
    return PyBool_FromLong(is_good);
}

/* ---- Many states ---- */

/* An argument for many states: one row for each state, or one row for all. */
struct rows {
    const double *data;
    double *lanes; /* (size x width) entry i of lane l is at i * width + l */
    Py_ssize_t size;
    int is_shared;
};

enum { ROWS_P, ROWS_X, ROWS_T, ROWS_Q, ROWS_QD, ROWS_COUNT };

struct many {
    struct rows rows[ROWS_COUNT];
    Py_ssize_t count, size;
    double *out, *out_lanes;
    refdyn_function *of_one;
    refdyn_lane_function *of_lanes; /* NULL: the quantity is not emitted for lanes */
};

enum { WIDEST = 8 }; /* the largest lane width */

/* Copies `width` rows, beginning with `first`, into lanes. Lanes after the last row repeat it. */
static inline void interleave(const struct rows *rows, Py_ssize_t first, Py_ssize_t count, int width) {
    const double *row[WIDEST];
    for (int l = 0; l < width; l++)
        row[l] = rows->data + (first + l < count ? first + l : count - 1) * rows->size;
    for (Py_ssize_t i = 0; i < rows->size; i++)
        for (int l = 0; l < width; l++)
            rows->lanes[i * width + l] = row[l][i];
}

/* Copies the results of the used lanes into rows, beginning with `first`. */
static inline void part_lanes(const struct many *many, Py_ssize_t first, int width) {
    double *row = many->out + first * many->size;
    const int used = many->count - first < width ? (int)(many->count - first) : width;
    for (int l = 0; l < used; l++)
        for (Py_ssize_t i = 0; i < many->size; i++)
            row[l * many->size + i] = many->out_lanes[i * width + l];
}

/* Every call passes a constant `width`, so that the compiler unrolls the loops over lanes. */
static inline void run_width(struct many *many, int width) {
    struct rows *rows = many->rows;
    for (int k = 0; k < ROWS_COUNT; k++)
        if (rows[k].is_shared)
            interleave(&(struct rows){rows[k].data, rows[k].lanes, rows[k].size, 1}, 0, 1, width);
    for (Py_ssize_t first = 0; first < many->count; first += width) {
        for (int k = 0; k < ROWS_COUNT; k++)
            if (!rows[k].is_shared)
                interleave(&rows[k], first, many->count, width);
        many->of_lanes(rows[ROWS_P].lanes, rows[ROWS_X].lanes, rows[ROWS_T].lanes, rows[ROWS_Q].lanes,
                       rows[ROWS_QD].lanes, many->out_lanes);
        part_lanes(many, first, width);
    }
}

static const double *row_of(const struct rows *rows, Py_ssize_t i) {
    return rows->data + (rows->is_shared ? 0 : i * rows->size);
}

static void run_singly(struct many *many) {
    const struct rows *rows = many->rows;
    for (Py_ssize_t i = 0; i < many->count; i++)
        many->of_one(row_of(&rows[ROWS_P], i), row_of(&rows[ROWS_X], i), *row_of(&rows[ROWS_T], i),
                     row_of(&rows[ROWS_Q], i), row_of(&rows[ROWS_QD], i), many->out + i * many->size);
}

static void run_many(struct many *many, int width) {
    if (!many->of_lanes)
        run_singly(many);
    else if (width == 2)
        run_width(many, 2);
    else if (width == 4)
        run_width(many, 4);
    else
        run_width(many, WIDEST);
}

/* Allocates the arrays of all lanes, each aligned for the widest vectors. Returns NULL without memory. */
static void *lay_out_lanes(struct many *many, int width) {
    const size_t line = WIDEST * sizeof(double);
    size_t sizes[ROWS_COUNT + 1], all = line;
    for (int k = 0; k <= ROWS_COUNT; k++) {
        const size_t size = (size_t)(k < ROWS_COUNT ? many->rows[k].size : many->size);
        sizes[k] = (size * (size_t)width * sizeof(double) + line - 1) / line * line;
        all += sizes[k];
    }
    char *memory = aligned_alloc(line, all), *at = memory;
    for (int k = 0; k <= ROWS_COUNT && memory; k++, at += sizes[k - 1]) {
        if (k < ROWS_COUNT)
            many->rows[k].lanes = (double *)(void *)at;
        else
            many->out_lanes = (double *)(void *)at;
    }
    return memory;
}

static PyObject *compute_many(struct many *many, int width) {
    void *memory = lay_out_lanes(many, width);
    if (!memory)
        return PyErr_NoMemory();
    Py_BEGIN_ALLOW_THREADS;
    run_many(many, width);
    free(memory);
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

/* many(count, q, qd, t, out, p, x): writes the results at `count` states to the rows of out, in lanes if the
 * quantity is emitted for lanes. An argument has one row for each state, or one row for all. */
static PyObject *function_many(PyObject *self, PyObject *const *given, Py_ssize_t arguments) {
    static const char *const names[] = {"p", "x", "t", "q", "qd"};
    static const int places[] = {5, 6, 3, 1, 2};
    const struct function *function = (const struct function *)self;
    const struct refdyn_model *model = function->library->model;
    const Py_ssize_t sizes[] = {width_of(model), model->input_count, 1, model->n, function->rates};
    struct many many = {.size = function->size, .of_one = function->of_one, .of_lanes = function->of_lanes};
    Py_buffer views[ROWS_COUNT + 1];
    int open = 0;
    if (arguments != 7)
        return PyErr_Format(PyExc_TypeError, "many: has %zd arguments; must have 7", arguments);
    many.count = PyLong_AsSsize_t(given[0]);
    if (many.count < 1)
        return PyErr_Occurred()
                   ? NULL
                   : PyErr_Format(PyExc_ValueError, "many: has no states; count must be positive");
    for (; open < ROWS_COUNT; open++) {
        if (!refdyn_need_doubles(given[places[open]], names[open], sizes[open], many.count, 0, &views[open]))
            break;
        const int is_shared = views[open].len <= sizes[open] * (Py_ssize_t)sizeof(double);
        many.rows[open] = (struct rows){views[open].buf, NULL, sizes[open], is_shared};
    }
    if (open == ROWS_COUNT &&
        refdyn_need_doubles(given[4], "out", many.size * many.count, 1, PyBUF_WRITABLE, &views[open]))
        many.out = views[open++].buf;
    PyObject *result = open > ROWS_COUNT ? compute_many(&many, function->library->lanes->width) : NULL;
    while (open > 0)
        PyBuffer_Release(&views[--open]);
    return result;
}

/* ---- The module ---- */

#define FAST(function) (PyCFunction)(void (*)(void))(function)

static PyMethodDef library_methods[] = {
    {"prepare", library_prepare, METH_VARARGS, "prepare(rows, p, x)"},
    {"function", library_function, METH_VARARGS, "function(quantity, rates, size)"},
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

static PyMethodDef function_methods[] = {
    {"one", FAST(function_one), METH_FASTCALL, "one(q, qd, t, out, inputs, parameters)"},
    {"many", FAST(function_many), METH_FASTCALL, "many(count, q, qd, t, out, p, x)"},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot function_slots[] = {
    {Py_tp_doc, "An emitted function; created by Library.function"},
    {Py_tp_dealloc, function_dealloc},
    {Py_tp_methods, function_methods},
    {0, NULL},
};

static PyType_Spec library_spec = {"refdyn.core.Library", sizeof(struct library), 0, Py_TPFLAGS_DEFAULT,
                                   library_slots};
static PyType_Spec function_spec = {"refdyn.core.Function", sizeof(struct function), 0,
                                    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, function_slots};

/* The names of the methods, as a tuple. */
static PyObject *list_methods(void) {
    PyObject *names = PyTuple_New(REFDYN_METHOD_COUNT);
    for (int i = 0; names && i < REFDYN_METHOD_COUNT; i++)
        PyTuple_SetItem(names, i, PyUnicode_FromString(refdyn_method_name(i)));
    return names;
}

static PyTypeObject *numpy_array(void) {
    PyObject *numpy = PyImport_ImportModule("numpy");
    PyObject *array = numpy ? PyObject_GetAttrString(numpy, "ndarray") : NULL;
    Py_XDECREF(numpy);
    return (PyTypeObject *)array;
}

static int module_exec(PyObject *module) {
    struct types *types = PyModule_GetState(module);
    PyObject *library = PyType_FromModuleAndSpec(module, &library_spec, NULL);
    types->function = (PyTypeObject *)PyType_FromModuleAndSpec(module, &function_spec, NULL);
    types->motion = (PyTypeObject *)PyType_FromModuleAndSpec(module, &refdyn_motion_spec, NULL);
    types->stepper = (PyTypeObject *)PyType_FromModuleAndSpec(module, &refdyn_stepper_spec, NULL);
    types->array = numpy_array();
    int status = library && types->function && types->motion && types->stepper && types->array
                     ? PyModule_AddObjectRef(module, "Library", library)
                     : -1;
    Py_XDECREF(library);
    PyObject *methods = list_methods();
    if (status == 0)
        status = PyModule_AddObjectRef(module, "METHODS", methods);
    Py_XDECREF(methods);
    return status;
}

static int module_traverse(PyObject *module, visitproc visit, void *arg) {
    const struct types *types = PyModule_GetState(module);
    Py_VISIT(types->function);
    Py_VISIT(types->motion);
    Py_VISIT(types->stepper);
    Py_VISIT(types->array);
    return 0;
}

static int module_clear(PyObject *module) {
    struct types *types = PyModule_GetState(module);
    Py_CLEAR(types->function);
    Py_CLEAR(types->motion);
    Py_CLEAR(types->stepper);
    Py_CLEAR(types->array);
    return 0;
}

static PyModuleDef_Slot module_slots[] = {
    {Py_mod_exec, module_exec},
    {0, NULL},
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "refdyn.core",
    .m_doc = "Evaluates the functions of compiled models on arrays.",
    .m_size = sizeof(struct types),
    .m_slots = module_slots,
    .m_traverse = module_traverse,
    .m_clear = module_clear,
};

PyMODINIT_FUNC PyInit_core(void) {
    return PyModuleDef_Init(&module_definition);
}
