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

static void library_dealloc(PyObject *self) {
    struct library *library = (struct library *)self;
    PyTypeObject *type = Py_TYPE(self);
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

/* Library(path, name, lanes): the model's name, and the lane width of its functions for lanes; 0: none. */
static PyObject *library_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords) {
    const char *path, *name;
    int width;
    (void)keywords;
    if (!PyArg_ParseTuple(arguments, "ssi", &path, &name, &width))
        return NULL;
    struct library *library = (struct library *)PyType_GenericAlloc(type, 0);
    if (!library)
        return NULL;
    library->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library->handle)
        PyErr_SetString(PyExc_ImportError, dlerror());
    if (library->handle && find_tables(library, name, width))
        return (PyObject *)library;
    Py_DECREF(library);
    return NULL;
}

/* Arguments and scratch for the preparation of one set of parameters. */
struct preparation {
    const struct refdyn_model *model;
    const char *is_anchored;  /* (parameter_count) non-zero: the start of a motion sets the value */
    double *state, *anchored; /* scratch: (2 n) and (anchored_count + 2 n) */
    double *required;         /* scratch for the results of the model's `required` */
};

/* Computes the same as refdyn_prepare, refdyn_initial_state and refdyn_anchor. */
static void prepare(const struct preparation *with, double *p, const double *x) {
    const struct refdyn_model *model = with->model;
    double *q = with->state, *qd = with->state + model->n;
    if (model->prepare)
        model->prepare(p);
    if (!model->anchor)
        return;
    for (int j = 0; j < model->n; j++) {
        q[j] = model->coordinates[j].value;
        qd[j] = 0;
    }
    double *start = with->anchored + model->anchored_count; /* (2 n) */
    if (model->start) {
        model->start(p, x, 0, q, qd, start);
        memcpy(q, start, 2 * (size_t)model->n * sizeof *q);
    }
    model->anchor(p, x, 0, q, qd, with->anchored);
    for (int i = 0; i < model->anchored_count; i++)
        if (with->is_anchored[model->anchored[i]])
            p[model->anchored[i]] = with->anchored[i];
    if (model->prepare)
        model->prepare(p);
}

/* Number of doubles in the result of `required`. */
static size_t required_count(const struct refdyn_model *model) {
    size_t count = 0;
    for (int i = 0; i < model->requirement_count; i++)
        count += 1 + (size_t)model->requirements[i].count;
    return count;
}

/* Returns the index of the first requirement that the parameters p violate, and its numbers; -1 if p meets
 * all. */
static int find_refused(const struct preparation *with, const double *p, const double *x,
                        const double **numbers) {
    const struct refdyn_model *model = with->model;
    const double *required = with->required;
    if (model->requirement_count > 0)
        model->required(p, x, 0, with->state, with->state, with->required);
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
static int prepare_rows(const struct preparation *with, Py_ssize_t rows, double *p, const double *x,
                        int has_x_by_row, const double **numbers) {
    const Py_ssize_t width = with->model->parameter_count + with->model->derived_count;
    int refused = -1;
    Py_BEGIN_ALLOW_THREADS;
    for (Py_ssize_t i = 0; i < rows && refused < 0; i++) {
        const double *own_x = x + (has_x_by_row ? i * with->model->input_count : 0);
        prepare(with, p + i * width, own_x);
        refused = find_refused(with, p + i * width, own_x, numbers);
    }
    Py_END_ALLOW_THREADS;
    return refused;
}

/* prepare(rows, p, is_anchored, x): each row of p (rows x (parameters + derived)) begins with the
 * parameters; the function sets the derived ones and those that the start of a motion sets. x has one row of
 * inputs, or one for each row of p. */
static PyObject *library_prepare(PyObject *self, PyObject *arguments) {
    const struct refdyn_model *model = ((struct library *)self)->model;
    const Py_ssize_t width = model->parameter_count + model->derived_count;
    PyObject *p_object, *x_object;
    Py_buffer p, x;
    Py_ssize_t rows, flags;
    struct preparation with = {.model = model};
    if (!PyArg_ParseTuple(arguments, "nOy#O", &rows, &p_object, &with.is_anchored, &flags, &x_object))
        return NULL;
    if (flags != model->parameter_count)
        return PyErr_Format(PyExc_ValueError, "is_anchored: has %zd flags; must have %d", flags,
                            model->parameter_count);
    if (!refdyn_need_doubles(p_object, "p", width, rows, PyBUF_WRITABLE, &p))
        return NULL;
    if (!refdyn_need_doubles(x_object, "x", model->input_count, rows, 0, &x)) {
        PyBuffer_Release(&p);
        return NULL;
    }
    const double *numbers = NULL;
    int refused = -1;
    with.state = malloc((4 * (size_t)model->n + (size_t)model->anchored_count + required_count(model) + 1) *
                        sizeof *with.state);
    with.required = with.state + 4 * model->n + model->anchored_count;
    with.anchored = with.state + 2 * model->n;
    const Py_ssize_t given_rows = width ? p.len / (width * (Py_ssize_t)sizeof(double)) : 0;
    const int has_x_by_row = x.len > model->input_count * (Py_ssize_t)sizeof(double);
    if (with.state)
        refused = prepare_rows(&with, given_rows, p.buf, x.buf, has_x_by_row && given_rows == rows, &numbers);
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    if (!with.state)
        return PyErr_NoMemory();
    if (refused >= 0)
        refuse(&model->requirements[refused], numbers);
    free(with.state);
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

/* ---- A function ---- */

struct function {
    PyObject_HEAD struct library *library; /* held */
    refdyn_function *of_one;
    refdyn_lane_function *of_lanes; /* NULL: the quantity is not emitted for lanes */
    int rates, size;                /* numbers in qd and in a result */
    double *p, *x, *rest;           /* the model's prepared parameters and inputs; (rates) zeros */
};

static void function_dealloc(PyObject *self) {
    struct function *function = (struct function *)self;
    PyTypeObject *type = Py_TYPE(self);
    free(function->p);
    Py_XDECREF((PyObject *)function->library);
    PyObject_Free(self);
    Py_DECREF(type);
}

static int parameter_count(const struct function *function) {
    return function->library->model->parameter_count + function->library->model->derived_count;
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

static int keep_values(struct function *function, PyObject *p_object, PyObject *x_object) {
    const struct refdyn_model *model = function->library->model;
    const size_t p_count = (size_t)parameter_count(function), x_count = (size_t)model->input_count;
    Py_buffer p, x;
    if (!refdyn_need_doubles(p_object, "p", (Py_ssize_t)p_count, 1, 0, &p))
        return 0;
    if (!refdyn_need_doubles(x_object, "x", (Py_ssize_t)x_count, 1, 0, &x)) {
        PyBuffer_Release(&p);
        return 0;
    }
    function->p = calloc(p_count + x_count + (size_t)function->rates + 1, sizeof *function->p);
    if (function->p) {
        function->x = function->p + p_count;
        function->rest = function->x + x_count;
        memcpy(function->p, p.buf, (size_t)p.len);
        memcpy(function->x, x.buf, (size_t)x.len);
    } else
        PyErr_NoMemory();
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    return function->p != NULL;
}

/* function(quantity, rates, size, p, x): p (prepared) and x are the default values of its calls. */
static PyObject *library_function(PyObject *self, PyObject *arguments) {
    const char *name;
    int rates, size;
    PyObject *p, *x;
    if (!PyArg_ParseTuple(arguments, "siiOO", &name, &rates, &size, &p, &x))
        return NULL;
    PyTypeObject *type = ((const struct types *)PyType_GetModuleState(Py_TYPE(self)))->function;
    struct function *function = (struct function *)PyType_GenericAlloc(type, 0);
    if (!function)
        return NULL;
    Py_INCREF(self);
    function->library = (struct library *)self;
    function->rates = rates;
    function->size = size;
    if (find_function(function, name) && keep_values(function, p, x))
        return (PyObject *)function;
    Py_DECREF(function);
    return NULL;
}

/* The arguments of one call: the doubles of a view, or the function's default values. */
enum { VIEW_Q, VIEW_QD, VIEW_OUT, VIEW_P, VIEW_X, VIEWS };

struct call {
    Py_buffer views[VIEWS];
    int is_open[VIEWS];
    const double *p, *x, *q, *qd;
    double t, *out;
    const PyTypeObject *array; /* the only type that a row may have */
};

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

static int open_call(struct call *call, const struct function *function, PyObject *const *given,
                     Py_ssize_t count) {
    const struct refdyn_model *model = function->library->model;
    const int is_number = PyFloat_Check(given[2]) || PyLong_Check(given[2]);
    call->q = open_row(call, VIEW_Q, given[0], model->n);
    call->qd = given[1] == Py_None ? function->rest : open_row(call, VIEW_QD, given[1], function->rates);
    call->t = is_number ? PyFloat_AsDouble(given[2]) : 0;
    call->out = open_row(call, VIEW_OUT, given[3], function->size);
    call->p = count > 4 ? open_row(call, VIEW_P, given[4], parameter_count(function)) : function->p;
    call->x = count > 5 ? open_row(call, VIEW_X, given[5], model->input_count) : function->x;
    return is_number && call->q && call->qd && call->out && call->p && call->x;
}

/* one(q, qd, t, out[, p, x]): writes the result at one state to out; qd None means zero rates. Returns False
 * and computes nothing if t is not a number or another argument is not a row of doubles of the right size. */
static PyObject *function_one(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    const struct function *function = (const struct function *)self;
    const struct types *types = PyType_GetModuleState(Py_TYPE(self));
    struct call call = {.t = 0, .array = types->array};
    if (count != 4 && count != 6)
        return PyErr_Format(PyExc_TypeError, "one: has %zd arguments; must have 4 or 6", count);
    const int is_good = open_call(&call, function, given, count);
    if (is_good) {
        Py_BEGIN_ALLOW_THREADS;
        function->of_one(call.p, call.x, call.t, call.q, call.qd, call.out);
        Py_END_ALLOW_THREADS;
    }
    close_views(&call);
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
    const Py_ssize_t sizes[] = {parameter_count(function), model->input_count, 1, model->n, function->rates};
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
    {"prepare", library_prepare, METH_VARARGS, "prepare(rows, p, is_anchored, x)"},
    {"function", library_function, METH_VARARGS, "function(quantity, rates, size, p, x)"},
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
    {Py_tp_doc, "Library(path, name, lanes): functions of a compiled model"},
    {Py_tp_new, library_new},
    {Py_tp_dealloc, library_dealloc},
    {Py_tp_methods, library_methods},
    {Py_tp_getset, library_values},
    {0, NULL},
};

static PyMethodDef function_methods[] = {
    {"one", FAST(function_one), METH_FASTCALL, "one(q, qd, t, out[, p, x])"},
    {"many", FAST(function_many), METH_FASTCALL, "many(count, q, qd, t, out, p, x)"},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot function_slots[] = {
    {Py_tp_doc, "An emitted function and the model's values; created by Library.function"},
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
