/*
 * refdyn.core: evaluates the functions of a compiled model on Python arrays.
 *
 * Arguments are buffers (PEP 3118) of doubles in C order, such as NumPy arrays, and are not copied. One state
 * is evaluated by the functions of refdyn_model.h, many states by the functions of refdyn_lanes.h, both
 * without the interpreter's lock. An object never changes after its creation, so any number of threads may
 * call it. The stable interface of Python (Py_LIMITED_API) is enough, so that one wheel suits Python 3.11 and
 * later versions.
 */
#include "runtime/bindings/python/extension.h"

#include <stddef.h>
#include <stdint.h>
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

/* ---- A function ---- */

struct function {
    PyObject_HEAD struct library *library; /* held */
    refdyn_function *of_one;
    refdyn_lane_function *of_lanes; /* NULL: the quantity, or a model with events, is not emitted for lanes */
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
PyObject *refdyn_library_function(PyObject *self, PyObject *arguments) {
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

/* Returns qd of the call, or zeros for None. With `qdd` (n), returns both in one row. Returns NULL, without a
 * Python error, for anything else. */
static const double *open_rates(struct one_call *call, const struct function *function, PyObject *qd,
                                PyObject *qdd) {
    const int n = function->library->model->n;
    if (qd == Py_None)
        return qdd ? NULL : function->rest;
    if (!qdd)
        return refdyn_one_call_row(call, VIEW_QD, qd, function->rates);
    const double *rates = refdyn_one_call_row(call, VIEW_QD, qd, n),
                 *accelerations = refdyn_one_call_row(call, VIEW_QDD, qdd, n);
    if (!rates || !accelerations || function->rates != 2 * n)
        return NULL;
    memcpy(call->more, rates, (size_t)n * sizeof *rates);
    memcpy(call->more + n, accelerations, (size_t)n * sizeof *accelerations);
    return call->more;
}

/* Returns whether the arguments have the form of `one` and the model accepts the parameters; then out has the
 * result. */
static int compute_one(struct one_call *call, const struct function *function, PyObject *const *given,
                       PyObject *qdd) {
    double t;
    const double *q = refdyn_one_call_row(call, VIEW_Q, given[0], function->library->model->n),
                 *qd = open_rates(call, function, given[1], qdd);
    double *out = refdyn_one_call_row(call, VIEW_OUT, given[3], function->size);
    if (!q || !qd || !out || !refdyn_one_call_number(given[2], &t) ||
        !refdyn_one_call_values(call, given[4], given[5]))
        return 0;
    int is_good;
    Py_BEGIN_ALLOW_THREADS;
    is_good = refdyn_one_call_prepare(call);
    if (is_good)
        function->of_one(call->p, call->x, t, q, qd, out);
    Py_END_ALLOW_THREADS;
    return is_good;
}

/* one(q, qd, t, out, inputs, parameters[, qdd]): writes the result at one state to out. qd None means zero
 * rates; inputs and parameters are None, a dictionary of numbers or a row in the model's order. qdd: of a
 * quantity that expects qd and qdd in one row. Returns False and computes nothing if t is not a finite
 * number, another argument is not of this form, or the model refuses the parameters. */
static PyObject *function_one(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    const struct function *function = (const struct function *)self;
    struct one_call call;
    if (count != 6 && count != 7)
        return PyErr_Format(PyExc_TypeError, "one: has %zd arguments; must have 6 or 7", count);
    if (!refdyn_one_call_begin(&call, function->library, self, function->rates))
        return NULL;
    const int is_good = compute_one(&call, function, given, count == 7 ? given[6] : NULL);
    refdyn_one_call_end(&call);
    return PyErr_Occurred() ? NULL : PyBool_FromLong(is_good);
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
    const Py_ssize_t sizes[] = {refdyn_parameter_width(model), model->input_count, 1, model->n,
                                function->rates};
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
    const int width = many.of_lanes ? function->library->lanes->width : 1;
    PyObject *result = open > ROWS_COUNT ? compute_many(&many, width) : NULL;
    while (open > 0)
        PyBuffer_Release(&views[--open]);
    return result;
}

/* ---- The module ---- */

#define FAST(function) (PyCFunction)(void (*)(void))(function)

static PyMethodDef function_methods[] = {
    {"one", FAST(function_one), METH_FASTCALL, "one(q, qd, t, out, inputs, parameters[, qdd])"},
    {"many", FAST(function_many), METH_FASTCALL, "many(count, q, qd, t, out, p, x)"},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot function_slots[] = {
    {Py_tp_doc, "An emitted function; created by Library.function"},
    {Py_tp_dealloc, function_dealloc},
    {Py_tp_methods, function_methods},
    {0, NULL},
};

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
    PyObject *library = PyType_FromModuleAndSpec(module, &refdyn_library_spec, NULL);
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
    if (status == 0)
        status = PyModule_AddStringConstant(module, "VERSION", REFDYN_VERSION);
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
