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

#include <math.h>
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
    call->is_open[which] = refdyn_open_doubles(object, view, which == VIEW_OUT ? PyBUF_WRITABLE : 0);
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

/* Returns whether the model accepts the parameters, and then writes the result to out. */
static int compute_one(const struct call *call, const struct function *function) {
    const struct library *library = function->library;
    const double *numbers;
    int refused = -1;
    Py_BEGIN_ALLOW_THREADS;
    if (call->prepares) {
        refdyn_prepare_values(library, call->own_p, call->x, call->scratch);
        refused = refdyn_find_refused(library->model, call->p, call->x, call->scratch, &numbers);
    }
    if (refused < 0)
        function->of_one(call->p, call->x, call->t, call->q, call->qd, call->out);
    Py_END_ALLOW_THREADS;
    return refused < 0;
}

/* Opens the arguments and computes, with `room` as scratch. Returns whether out has the result. */
static int call_one(struct call *call, const struct function *function, PyObject *const *given,
                    double *room) {
    const struct refdyn_model *model = function->library->model;
    call->own_x = room;
    call->own_p = call->own_x + model->input_count;
    call->scratch = call->own_p + refdyn_parameter_width(model);
    const int is_good = open_call(call, function, given);
    const int is_computed = is_good && !PyErr_Occurred() && compute_one(call, function);
    close_views(call);
    return is_computed;
}

/* one(q, qd, t, out, inputs, parameters): writes the result at one state to out. qd None means zero rates;
 * inputs and parameters are None, a dictionary of numbers or a row in the model's order. Returns False and
 * computes nothing if t is not a number, another argument is not of this form, or the model refuses the
 * parameters. */
static PyObject *function_one(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    const struct function *function = (const struct function *)self;
    const struct types *types = PyType_GetModuleState(Py_TYPE(self));
    const struct refdyn_model *model = function->library->model;
    struct call call = {.t = 0, .array = types->array};
    double local[LOCAL_DOUBLES];
    if (count != 6)
        return PyErr_Format(PyExc_TypeError, "one: has %zd arguments; must have 6", count);
    const size_t size =
        (size_t)(model->input_count + refdyn_parameter_width(model)) + refdyn_prepare_scratch(model);
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
