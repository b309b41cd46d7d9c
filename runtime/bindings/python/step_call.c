/*
 * refdyn.core.Stepper: explicit Runge-Kutta steps from emitted accelerations, of one state or of many in
 * lanes.
 *
 * A step is the method's step of the runtime (runge_kutta_step.inc) with the emitted `constrained`, or
 * `qdd_free` without rows. Lanes of width w are one system with w times as many components, since all states
 * have the same h: entry i of lane l is at [i * w + l]. An object never changes after its creation, so any
 * number of threads may use it.
 */
#include "runtime/bindings/python/extension.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/core/methods/step_of_one.inc"

#include "runtime/core/methods/runge_kutta_step.inc"

struct stepper {
    PyObject_HEAD struct library *library; /* held */
    struct refdyn_tableau tableau;         /* of the method, without its error estimate */
    refdyn_function *of_one;
    refdyn_lane_function *of_lanes; /* NULL: states are stepped one by one */
    double *p, *x;                  /* the model's prepared parameters and inputs */
};

/* The arrays of a call, in lanes of `width`. */
struct lanes {
    const struct stepper *stepper;
    int width, n, rates_size; /* rates of one lane */
    double h;
    struct unlocked *unlocked;
    long taken; /* steps of the call */
    double *p, *x, *t, *t_stage, *state, *rates, *state_new, *stage, *error, *memory;
};

/* ---- One step of all lanes ---- */

/* Computes the rates of a stage, as refdyn_rates does for one motion; its error is a NaN. */
static int find_lane_rates(void *context, double c, double *stage, double *rates) {
    const struct lanes *lanes = context;
    const int size = lanes->n * lanes->width;
    for (int l = 0; l < lanes->width; l++)
        lanes->t_stage[l] = lanes->t[l] + c * lanes->h;
    memcpy(rates, stage + size, (size_t)size * sizeof *rates);
    if (lanes->stepper->of_lanes)
        lanes->stepper->of_lanes(lanes->p, lanes->x, lanes->t_stage, stage, stage + size, rates + size);
    else
        lanes->stepper->of_one(lanes->p, lanes->x, *lanes->t_stage, stage, stage + size, rates + size);
    return REFDYN_OK;
}

enum { STEPS_PER_ASK = 64 }; /* between two looks at the clock, whose time is then negligible */

/* Takes `steps` steps of h from state, which becomes the state after them. Returns RECORD_INTERRUPTED after a
 * signal. */
static int take_steps(struct lanes *lanes, long steps) {
    const int width = lanes->width, size = 2 * lanes->n * width;
    const struct arrays_of_one arrays = {.n = lanes->n * width,
                                         .size = size,
                                         .rates_size = lanes->rates_size * width,
                                         .state = lanes->state,
                                         .rates = lanes->rates,
                                         .state_new = lanes->state_new,
                                         .stage = lanes->stage,
                                         .error = lanes->error,
                                         .memory = lanes->memory};
    for (long i = 0; i < steps; i++) {
        find_lane_rates(lanes, 0, lanes->state, lanes->rates);
        take_explicit_of_one(&lanes->stepper->tableau, &arrays, lanes->h, 0, find_lane_rates, lanes);
        memcpy(lanes->state, lanes->state_new, (size_t)size * sizeof *lanes->state);
        for (int l = 0; l < width; l++)
            lanes->t[l] += lanes->h;
        if (++lanes->taken % STEPS_PER_ASK == 0 && refdyn_ask(lanes->unlocked))
            return RECORD_INTERRUPTED;
    }
    return REFDYN_OK;
}

/* ---- Memory of a call ---- */

enum { WIDEST = 8 }; /* the largest lane width */

/* Hands out arrays, each aligned for the widest vectors; without memory it only counts. */
struct counter {
    char *memory;
    size_t used;
    int width;
};

static double *take(struct counter *counter, int count) {
    const size_t line = WIDEST * sizeof(double);
    double *piece = counter->memory ? (double *)(void *)(counter->memory + counter->used) : NULL;
    counter->used += ((size_t)(count * counter->width) * sizeof(double) + line - 1) / line * line;
    return piece;
}

static int parameter_count(const struct stepper *stepper) {
    return stepper->library->model->parameter_count + stepper->library->model->derived_count;
}

static size_t lay_out(struct lanes *lanes, char *memory) {
    const struct refdyn_model *model = lanes->stepper->library->model;
    struct counter counter = {memory, 0, lanes->width};
    lanes->p = take(&counter, parameter_count(lanes->stepper));
    lanes->x = take(&counter, model->input_count);
    lanes->t = take(&counter, 1);
    lanes->t_stage = take(&counter, 1);
    lanes->state = take(&counter, 2 * lanes->n);
    lanes->state_new = take(&counter, 2 * lanes->n);
    lanes->stage = take(&counter, 2 * lanes->n);
    lanes->error = take(&counter, 2 * lanes->n);
    lanes->rates = take(&counter, lanes->rates_size);
    lanes->memory = take(&counter, lanes->rates_size * lanes->stepper->tableau.stages);
    return counter.used;
}

/* Returns the memory, to be freed, or NULL. */
static void *open_lanes(struct lanes *lanes, const struct stepper *stepper, int width, double h) {
    const struct refdyn_model *model = stepper->library->model;
    *lanes = (struct lanes){
        .stepper = stepper, .width = width, .n = model->n, .rates_size = 2 * model->n + 1 + model->m, .h = h};
    const size_t line = WIDEST * sizeof(double);
    char *memory = aligned_alloc(line, lay_out(lanes, NULL) + line);
    if (memory)
        lay_out(lanes, memory);
    return memory;
}

/* ---- States ---- */

/* Arguments and results of a call: one row for each state, or one row for all. */
enum { Q, QD, T, P, X, ARGUMENTS, NEW_Q = ARGUMENTS, NEW_QD, VIEWS };

struct states {
    Py_buffer views[VIEWS];
    int is_open[VIEWS];
    double *data[VIEWS];
    Py_ssize_t size[VIEWS]; /* of a row */
    Py_ssize_t count;
};

static void close_states(struct states *states) {
    for (int i = 0; i < VIEWS; i++)
        if (states->is_open[i])
            PyBuffer_Release(&states->views[i]);
}

static int is_shared(const struct states *states, int which) {
    return states->views[which].len <= states->size[which] * (Py_ssize_t)sizeof(double);
}

static double *row_of(const struct states *states, int which, Py_ssize_t place) {
    return states->data[which] + (is_shared(states, which) ? 0 : place * states->size[which]);
}

/* Copies `width` rows, beginning with `first`, into lanes. Lanes after the last row repeat it. */
static void gather(const struct states *states, int which, Py_ssize_t first, int width, double *lanes) {
    const Py_ssize_t size = states->size[which];
    for (int l = 0; l < width; l++) {
        const Py_ssize_t place = first + l < states->count ? first + l : states->count - 1;
        const double *row = row_of(states, which, place);
        for (Py_ssize_t i = 0; i < size; i++)
            lanes[i * width + l] = row[i];
    }
}

static void scatter(const struct states *states, int which, Py_ssize_t first, int width,
                    const double *lanes) {
    const Py_ssize_t size = states->size[which];
    for (int l = 0; l < width && first + l < states->count; l++)
        for (Py_ssize_t i = 0; i < size; i++)
            states->data[which][(first + l) * size + i] = lanes[i * width + l];
}

/* Notes the states of these lanes that were not finite before the steps, or are not after them. */
static void judge(const struct lanes *lanes, const struct states *states, Py_ssize_t first,
                  struct step_report *report) {
    for (Py_ssize_t i = first; i < first + lanes->width && i < states->count; i++) {
        const struct step_row row = {.index = i,
                                     .n = lanes->n,
                                     .t = row_of(states, T, i),
                                     .q = row_of(states, Q, i),
                                     .qd = row_of(states, QD, i),
                                     .new_q = row_of(states, NEW_Q, i),
                                     .new_qd = row_of(states, NEW_QD, i)};
        if (!refdyn_step_is_finite(&row))
            refdyn_step_note(report, &row, refdyn_step_is_unfit(&row) ? STEP_UNFIT : STEP_FAILED);
    }
}

/* Steps all states. Returns RECORD_INTERRUPTED after a signal. */
static int step_states(struct lanes *lanes, const struct states *states, long steps,
                       struct step_report *report) {
    const int width = lanes->width, n = lanes->n;
    int status = REFDYN_OK;
    for (Py_ssize_t first = 0; first < states->count && status == REFDYN_OK; first += width) {
        if (first == 0 || !is_shared(states, P))
            gather(states, P, first, width, lanes->p);
        if (first == 0 || !is_shared(states, X))
            gather(states, X, first, width, lanes->x);
        gather(states, T, first, width, lanes->t);
        gather(states, Q, first, width, lanes->state);
        gather(states, QD, first, width, lanes->state + n * width);
        status = take_steps(lanes, steps);
        scatter(states, NEW_Q, first, width, lanes->state);
        scatter(states, NEW_QD, first, width, lanes->state + n * width);
        judge(lanes, states, first, report);
    }
    return status;
}

static PyObject *compute(const struct stepper *stepper, const struct states *states, double h, long steps) {
    struct lanes lanes;
    void *memory = open_lanes(&lanes, stepper, stepper->of_lanes ? stepper->library->lanes->width : 1,
                              h / (double)steps);
    if (!memory)
        return PyErr_NoMemory();
    struct unlocked unlocked = {.asked = refdyn_seconds(CLOCK_MONOTONIC)};
    lanes.unlocked = &unlocked;
    struct step_report report = {.reason = NULL};
    unlocked.thread = PyEval_SaveThread();
    const int status = step_states(&lanes, states, steps, &report);
    free(memory);
    PyEval_RestoreThread(unlocked.thread);
    return status == REFDYN_OK ? refdyn_step_report(&report) : NULL;
}

/* states(count, q, qd, t, h, steps, p, x, new_q, new_qd): steps `count` states by h in equal steps; p and x
 * None: the model's. Returns the report. */
static PyObject *stepper_states(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    static const char *const names[] = {"q", "qd", "t", "p", "x", "new_q", "new_qd"};
    static const int places[] = {1, 2, 3, 6, 7, 8, 9};
    const struct stepper *stepper = (const struct stepper *)self;
    const struct refdyn_model *model = stepper->library->model;
    const int p_size = parameter_count(stepper), x_size = model->input_count, n = model->n;
    struct states states = {.size = {n, n, 1, p_size, x_size, n, n},
                            .data = {[P] = stepper->p, [X] = stepper->x}};
    if (count != 10)
        return PyErr_Format(PyExc_TypeError, "states: has %zd arguments; must have 10", count);
    states.count = PyLong_AsSsize_t(given[0]);
    const double h = PyFloat_AsDouble(given[4]);
    const long steps = PyLong_AsLong(given[5]);
    int is_good = !PyErr_Occurred() && states.count > 0 && steps > 0;
    for (int i = 0; i < VIEWS && is_good; i++) {
        if ((i == P || i == X) && given[places[i]] == Py_None)
            continue;
        is_good = states.is_open[i] =
            refdyn_need_doubles(given[places[i]], names[i], states.size[i], states.count,
                                i < ARGUMENTS ? 0 : PyBUF_WRITABLE, &states.views[i]);
        if (is_good)
            states.data[i] = states.views[i].buf;
    }
    if (!is_good && !PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "states: has no states or steps; both must be positive");
    PyObject *result = is_good ? compute(stepper, &states, h, steps) : NULL;
    close_states(&states);
    return result;
}

/* Returns the number of steps, 0 for anything but a positive integer. */
static long read_steps(PyObject *object) {
    int is_beyond;
    const long steps = PyLong_CheckExact(object) ? PyLong_AsLongAndOverflow(object, &is_beyond) : 0;
    return steps > 0 ? steps : 0;
}

/* Reads the arguments of `one`, except steps. Returns 0, without a Python error, if Python has to check them.
 */
static int read_one(struct one_call *call, PyObject *const *given, double *t, double *h,
                    struct states *states) {
    const int n = call->library->model->n;
    states->data[Q] = refdyn_one_call_row(call, VIEW_Q, given[0], n);
    states->data[QD] = refdyn_one_call_row(call, VIEW_QD, given[1], n);
    states->data[NEW_Q] = refdyn_one_call_row(call, VIEW_OUT, given[7], n);
    states->data[NEW_QD] = refdyn_one_call_row(call, VIEW_OUT_QD, given[8], n);
    states->data[T] = t;
    return states->data[Q] && states->data[QD] && states->data[NEW_Q] && states->data[NEW_QD] &&
           refdyn_one_call_number(given[2], t) && refdyn_one_call_number(given[3], h) && *h > 0 &&
           isfinite(*h) && refdyn_one_call_values(call, given[5], given[6]);
}

/* one(q, qd, t, h, steps, inputs, parameters, new_q, new_qd): steps one state; inputs and parameters as those
 * of Function.one. Returns False if an argument is not of that form, the model refuses the parameters, or the
 * result is not finite; `states` then reports why. */
static PyObject *stepper_one(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    const struct stepper *stepper = (const struct stepper *)self;
    const struct refdyn_model *model = stepper->library->model;
    const int n = model->n;
    struct states states = {.size = {n, n, 1, parameter_count(stepper), model->input_count, n, n},
                            .count = 1};
    struct one_call call;
    double t, h;
    if (count != 9)
        return PyErr_Format(PyExc_TypeError, "one: has %zd arguments; must have 9", count);
    if (!refdyn_one_call_begin(&call, stepper->library, self, 0))
        return NULL;
    const long steps = read_steps(given[4]);
    PyObject *report = NULL;
    if (steps && read_one(&call, given, &t, &h, &states) && refdyn_one_call_prepare(&call)) {
        states.data[P] = (double *)call.p;
        states.data[X] = (double *)call.x;
        report = compute(stepper, &states, h, steps);
    }
    refdyn_one_call_end(&call);
    if (PyErr_Occurred())
        return NULL;
    const int is_good = report == Py_None;
    Py_XDECREF(report);
    return PyBool_FromLong(is_good);
}

/* ---- The type ---- */

static void stepper_dealloc(PyObject *self) {
    struct stepper *stepper = (struct stepper *)self;
    PyTypeObject *type = Py_TYPE(self);
    free(stepper->p);
    Py_XDECREF((PyObject *)stepper->library);
    PyObject_Free(self);
    Py_DECREF(type);
}

static int keep_values(struct stepper *stepper, PyObject *p_object, PyObject *x_object) {
    const int p_count = parameter_count(stepper), x_count = stepper->library->model->input_count;
    Py_buffer p, x;
    if (!refdyn_need_doubles(p_object, "p", p_count, 1, 0, &p))
        return 0;
    if (!refdyn_need_doubles(x_object, "x", x_count, 1, 0, &x)) {
        PyBuffer_Release(&p);
        return 0;
    }
    stepper->p = calloc((size_t)(p_count + x_count) + 1, sizeof *stepper->p);
    if (stepper->p) {
        stepper->x = stepper->p + p_count;
        memcpy(stepper->p, p.buf, (size_t)p.len);
        memcpy(stepper->x, x.buf, (size_t)x.len);
    } else
        PyErr_NoMemory();
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    return stepper->p != NULL;
}

static int choose_functions(struct stepper *stepper, const char *name) {
    const struct library *library = stepper->library;
    const struct refdyn_model *model = library->model;
    const struct refdyn_method_definition *method =
        refdyn_method_definition((enum refdyn_method)refdyn_method_find(name));
    if (!method || method->kind != &refdyn_explicit) {
        PyErr_Format(PyExc_ValueError, "%s: not an explicit method", name);
        return 0;
    }
    stepper->tableau = *(const struct refdyn_tableau *)method->table;
    stepper->tableau.e = stepper->tableau.e_low = NULL;
    stepper->of_one = model->m ? model->constrained : model->qdd_free;
    if (library->lanes)
        stepper->of_lanes = model->m ? library->lanes->constrained : library->lanes->qdd_free;
    if (!stepper->of_one)
        PyErr_SetString(PyExc_ValueError, "the compiled library has no function for accelerations");
    return stepper->of_one != NULL;
}

/* stepper(method, p, x): p (prepared) and x are the default values of its calls. */
PyObject *refdyn_library_stepper(PyObject *self, PyObject *arguments) {
    const char *method;
    PyObject *p, *x;
    if (!PyArg_ParseTuple(arguments, "sOO", &method, &p, &x))
        return NULL;
    PyTypeObject *type = ((const struct types *)PyType_GetModuleState(Py_TYPE(self)))->stepper;
    struct stepper *stepper = (struct stepper *)PyType_GenericAlloc(type, 0);
    if (!stepper)
        return NULL;
    stepper->library = (struct library *)Py_NewRef(self);
    if (choose_functions(stepper, method) && keep_values(stepper, p, x))
        return (PyObject *)stepper;
    Py_DECREF((PyObject *)stepper);
    return NULL;
}

static PyMethodDef stepper_methods[] = {
    {"states", (PyCFunction)(void (*)(void))stepper_states, METH_FASTCALL,
     "states(count, q, qd, t, h, steps, p, x, new_q, new_qd)"},
    {"one", (PyCFunction)(void (*)(void))stepper_one, METH_FASTCALL,
     "one(q, qd, t, h, steps, inputs, parameters, new_q, new_qd)"},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot stepper_slots[] = {
    {Py_tp_doc, "Explicit steps of a compiled model; created by Library.stepper"},
    {Py_tp_dealloc, stepper_dealloc},
    {Py_tp_methods, stepper_methods},
    {0, NULL},
};

PyType_Spec refdyn_stepper_spec = {"refdyn.core.Stepper", sizeof(struct stepper), 0,
                                   Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, stepper_slots};
