/*
 * refdyn.core.Motion: one motion of a compiled model in the process, by the runtime.
 *
 * The object owns the workspace, the integrator and their memory. One thread at a time may use it: calls from
 * others are refused. The interpreter's lock is released while C computes; about every 10 ms the motion asks
 * for signals, so that Ctrl-C interrupts it. After an error of the numbers, and after an interruption, the
 * motion is at its last accepted state. Messages are those of `refdyn sim`.
 */
#include "runtime/bindings/python/extension.h"

#include <stdlib.h>
#include <string.h>

/* ---- Memory ---- */

void *refdyn_motion_memory(void *context, size_t size) {
    struct motion *motion = context;
    struct motion_piece *piece = calloc(1, sizeof *piece + size);
    if (!piece)
        longjmp(motion->no_memory, 1);
    piece->next = motion->pieces;
    motion->pieces = piece;
    return piece->data;
}

void refdyn_motion_release(struct motion *motion) {
    while (motion->pieces) {
        struct motion_piece *next = motion->pieces->next;
        free(motion->pieces);
        motion->pieces = next;
    }
}

static size_t rounded(size_t size) {
    const size_t unit = 2 * sizeof(double);
    return (size + unit - 1) / unit * unit;
}

void *refdyn_motion_at(const struct motion *motion, size_t place) {
    return (char *)motion->block + place;
}

/* Returns 0 with a Python error without memory. */
static int allocate_block(struct motion *motion) {
    const struct refdyn_model *model = motion->library->model;
    motion->work_at = rounded(sizeof *motion->block);
    motion->integrator_at = motion->work_at + rounded(refdyn_workspace_size(model));
    motion->start_at = motion->integrator_at + rounded(refdyn_integrator_size(model, &motion->options));
    motion->before_at = motion->start_at + 2 * (size_t)model->n * sizeof(double);
    motion->size = motion->before_at +
                   2 * (size_t)(model->parameter_count + model->input_count + 2 * model->n) * sizeof(double);
    motion->block = calloc(1, motion->size);
    motion->given = calloc((size_t)model->anchored_count + 1, sizeof *motion->given);
    if (!motion->block || !motion->given) {
        PyErr_NoMemory();
        return 0;
    }
    return 1;
}

static void motion_dealloc(PyObject *self) {
    struct motion *motion = (struct motion *)self;
    PyTypeObject *type = Py_TYPE(self);
    refdyn_motion_release(motion);
    free(motion->block);
    free(motion->given);
    Py_XDECREF(motion->held);
    Py_XDECREF(motion->places);
    Py_XDECREF(motion->follow);
    Py_XDECREF(motion->newer);
    Py_XDECREF((PyObject *)motion->library);
    PyObject_Free(self);
    Py_DECREF(type);
}

/* ---- One thread at a time ---- */

int refdyn_motion_enter(struct motion *motion) {
    if (motion->is_busy) {
        PyErr_SetString(
            PyExc_RuntimeError,
            "motion: another thread is computing with it; give each thread its own, motion.copy()");
        return 0;
    }
    motion->is_busy = 1;
    return 1;
}

PyObject *refdyn_motion_leave(struct motion *motion, PyObject *result) {
    motion->is_busy = 0;
    return result;
}

double refdyn_seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static const double between_signals = 0.01; /* [s] */

/* Continues with the functions of another compilation of the same model. Errors of the runtime. */
static int exchange(struct motion *motion, PyObject *library) {
    const int status =
        refdyn_integrator_exchange_model(&motion->block->integrator, ((struct library *)library)->model);
    if (status == REFDYN_OK) {
        Py_XDECREF(motion->newer);
        motion->newer = Py_NewRef(library);
    }
    return status;
}

/* The optimised library computes the same bits; a motion that cannot follow to it continues as it is. */
static void follow(struct motion *motion) {
    PyObject *library = PyObject_CallNoArgs(motion->follow);
    if (!library)
        PyErr_WriteUnraisable(motion->follow);
    else if (library != Py_None) {
        exchange(motion, library);
        Py_CLEAR(motion->follow);
    }
    Py_XDECREF(library);
}

int refdyn_ask(void *context) {
    struct unlocked *unlocked = context;
    const double now = refdyn_seconds(CLOCK_MONOTONIC);
    if (!unlocked->is_interrupted && now - unlocked->asked >= between_signals) {
        unlocked->asked = now;
        PyEval_RestoreThread(unlocked->thread);
        unlocked->is_interrupted = PyErr_CheckSignals() != 0;
        if (!unlocked->is_interrupted && unlocked->motion && unlocked->motion->follow)
            follow(unlocked->motion);
        unlocked->thread = PyEval_SaveThread();
    }
    return unlocked->is_interrupted ? RECORD_INTERRUPTED : REFDYN_OK;
}

int refdyn_motion_ask(void *context, const struct record_motion *record) {
    (void)record;
    return refdyn_ask(context);
}

/* ---- Failures ---- */

void refdyn_write_refused(const struct refdyn_workspace *work, PyObject *places, char *text, size_t size) {
    const struct refdyn_requirement *rule = &work->model->requirements[work->refused];
    PyObject *place = PyTuple_GetItem(places, work->refused);
    const char *where = place ? PyUnicode_AsUTF8AndSize(place, NULL) : NULL;
    double x[REFDYN_REQUIREMENT_NUMBERS];
    refdyn_refused_numbers(work, x);
    const int length = snprintf(text, size, "%s: %s: ", where ? where : "model", rule->subject);
    if (length > 0 && (size_t)length < size)
        snprintf(text + length, size - (size_t)length, rule->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
}

void refdyn_motion_print_failure(const struct motion *motion, FILE *out) {
    char refused[512] = "";
    if (motion->status == REFDYN_REFUSED)
        refdyn_write_refused(&motion->block->work, motion->places, refused, sizeof refused);
    if (motion->status == REFDYN_REFUSED && !motion->is_started)
        fprintf(out, "%s\n", refused);
    else
        record_print_failure(&motion->block->record, motion->status, motion->is_started, motion->unfit,
                             refused, out);
}

/* ---- A new motion ---- */

/* Reads (method, tol, step, step_max, tol_rates, stabilise, follows_step, singular, project_start, balance,
 * step_limit). A tolerance or step of 0 and a negative stabilise select the defaults of the method; a step
 * selects fixed steps. */
static int read_options(struct refdyn_options *options, PyObject *given) {
    const char *name, *fact = "method is unknown";
    double tol, step, step_max, tol_rates;
    int stabilise, follows_step, singular, project_start, balance;
    long step_limit;
    if (!PyArg_ParseTuple(given, "sddddiiiiil", &name, &tol, &step, &step_max, &tol_rates, &stabilise,
                          &follows_step, &singular, &project_start, &balance, &step_limit))
        return 0;
    const int method = refdyn_method_find(name);
    *options = refdyn_options_default((enum refdyn_method)method);
    options->tol = step > 0 ? 0 : tol > 0 ? tol : options->tol;
    options->step = step > 0 ? step : options->step;
    options->step_max = step_max;
    options->tol_rates = tol_rates;
    options->stabilise = stabilise < 0 ? options->stabilise : (enum refdyn_stabilise)stabilise;
    options->gain_share = follows_step ? record_gain_share : 0;
    options->singular = (enum refdyn_singular)singular;
    options->project_start = project_start;
    options->balance = balance;
    options->step_limit = step_limit;
    if (refdyn_options_validate(options, &fact) == REFDYN_OK)
        return 1;
    PyErr_SetString(PyExc_ValueError, fact);
    return 0;
}

int refdyn_read_values(const struct library *library, const struct given_values *values,
                       struct refdyn_workspace *work, int *given) {
    const struct refdyn_model *model = library->model;
    Py_buffer p, x;
    if (values->flags != model->parameter_count) {
        PyErr_Format(PyExc_ValueError, "is_anchored: has %zd flags; must have %d", values->flags,
                     model->parameter_count);
        return 0;
    }
    if (!refdyn_need_doubles(values->p, "p", model->parameter_count, 1, 0, &p))
        return 0;
    if (!refdyn_need_doubles(values->x, "x", model->input_count, 1, 0, &x)) {
        PyBuffer_Release(&p);
        return 0;
    }
    memcpy(work->p, p.buf, (size_t)p.len);
    memcpy(work->x, x.buf, (size_t)x.len);
    for (int i = 0; i < model->anchored_count; i++)
        given[i] = !values->is_anchored[model->anchored[i]];
    PyBuffer_Release(&p);
    PyBuffer_Release(&x);
    return 1;
}

static int begin_block(struct motion *motion) {
    struct motion_block *block = motion->block;
    const struct refdyn_model *model = motion->library->model;
    int status = refdyn_workspace_init(&block->work, model, refdyn_motion_at(motion, motion->work_at),
                                       motion->integrator_at - motion->work_at);
    if (!status)
        status = refdyn_integrator_init(&block->integrator, &block->work, &motion->options,
                                        refdyn_motion_at(motion, motion->integrator_at),
                                        motion->start_at - motion->integrator_at);
    if (status)
        PyErr_Format(PyExc_ValueError, "motion: %s", refdyn_status_text(status));
    return status == REFDYN_OK;
}

struct motion *refdyn_motion_new(PyTypeObject *type, struct library *library, PyObject *places,
                                 PyObject *follow) {
    struct motion *motion = (struct motion *)PyType_GenericAlloc(type, 0);
    if (!motion)
        return NULL;
    motion->library = (struct library *)Py_NewRef((PyObject *)library);
    motion->places = Py_NewRef(places);
    motion->follow = follow == Py_None ? NULL : Py_XNewRef(follow);
    return motion;
}

PyObject *refdyn_library_motion(PyObject *self, PyObject *arguments) {
    const struct types *types = PyType_GetModuleState(Py_TYPE(self));
    struct library *library = (struct library *)self;
    PyObject *options, *places, *follow;
    struct given_values values;
    if (!PyArg_ParseTuple(arguments, "O!Oy#OO!O", &PyTuple_Type, &options, &values.p, &values.is_anchored,
                          &values.flags, &values.x, &PyTuple_Type, &places, &follow))
        return NULL;
    struct motion *motion = refdyn_motion_new(types->motion, library, places, follow);
    if (motion && read_options(&motion->options, options) && allocate_block(motion) && begin_block(motion) &&
        refdyn_read_values(library, &values, &motion->block->work, motion->given))
        return (PyObject *)motion;
    Py_XDECREF((PyObject *)motion);
    return NULL;
}

/* ---- Its state ---- */

/* Writes a part of the present values into `out`. As in rows, inputs, parameters, accelerations and forces
 * are those from the present time on, where an event that is due sets only inputs and parameters. */
static PyObject *fill(PyObject *self, PyObject *out, int count, void (*write)(struct motion *, double *)) {
    struct motion *motion = (struct motion *)self;
    Py_buffer view;
    if (!refdyn_motion_enter(motion))
        return NULL;
    if (!refdyn_need_doubles(out, "out", count, 1, PyBUF_WRITABLE, &view))
        return refdyn_motion_leave(motion, NULL);
    const int is_after = refdyn_integrator_see_after(&motion->block->integrator);
    write(motion, view.buf);
    if (is_after)
        refdyn_integrator_see_before(&motion->block->integrator);
    PyBuffer_Release(&view);
    return refdyn_motion_leave(motion, Py_NewRef(Py_None));
}

static int coordinates_of(PyObject *self) {
    return ((struct motion *)self)->library->model->n;
}

static void write_state(struct motion *motion, double *out) {
    const size_t n = (size_t)motion->library->model->n;
    memcpy(out, motion->block->integrator.q, n * sizeof *out);
    memcpy(out + n, motion->block->integrator.qd, n * sizeof *out);
}

static void write_accelerations(struct motion *motion, double *out) {
    memcpy(out, motion->block->integrator.qdd, (size_t)motion->library->model->n * sizeof *out);
}

static void write_force(struct motion *motion, double *out) {
    refdyn_integrator_force(&motion->block->integrator, out);
}

static void write_parameters(struct motion *motion, double *out) {
    memcpy(out, motion->block->work.p, (size_t)motion->library->model->parameter_count * sizeof *out);
}

static void write_inputs(struct motion *motion, double *out) {
    memcpy(out, motion->block->work.x, (size_t)motion->library->model->input_count * sizeof *out);
}

static PyObject *motion_state(PyObject *self, PyObject *out) {
    return fill(self, out, 2 * coordinates_of(self), write_state);
}

static PyObject *motion_accelerations(PyObject *self, PyObject *out) {
    return fill(self, out, coordinates_of(self), write_accelerations);
}

static PyObject *motion_force(PyObject *self, PyObject *out) {
    return fill(self, out, coordinates_of(self), write_force);
}

static PyObject *motion_parameters(PyObject *self, PyObject *out) {
    return fill(self, out, ((struct motion *)self)->library->model->parameter_count, write_parameters);
}

static PyObject *motion_inputs(PyObject *self, PyObject *out) {
    return fill(self, out, ((struct motion *)self)->library->model->input_count, write_inputs);
}

static PyObject *motion_t(PyObject *self, void *closure) {
    (void)closure;
    return PyFloat_FromDouble(((struct motion *)self)->block->integrator.t);
}

static PyObject *motion_status(PyObject *self, void *closure) {
    (void)closure;
    return PyLong_FromLong(((struct motion *)self)->status);
}

static PyObject *motion_has_ended(PyObject *self, void *closure) {
    (void)closure;
    return PyBool_FromLong(((struct motion *)self)->block->record.events.has_ended);
}

/* ---- Copies ---- */

/* Moves pointers into the old block to the same places in the new one. The block has only numbers and
 * pointers, aligned; a number with the bits of such a pointer would be a double below 1e-308, or two indices
 * above 10^4. */
static void move_pointers(struct motion_block *block, const struct motion_block *old, size_t size) {
    const uintptr_t from = (uintptr_t)old, to = (uintptr_t)block;
    char *words = (char *)block;
    for (size_t i = 0; i + sizeof(uintptr_t) <= size; i += sizeof(uintptr_t)) {
        uintptr_t word;
        memcpy(&word, words + i, sizeof word);
        if (word < from || word >= from + size)
            continue;
        word += to - from;
        memcpy(words + i, &word, sizeof word);
    }
}

static void copy_events(struct motion *copy, const struct record_events *events) {
    struct record_events *own = &copy->block->record.events;
    const size_t contacts = (size_t)copy->block->integrator.contact_count;
    if (!events->list)
        return;
    own->list = refdyn_motion_memory(copy, RECORD_EVENTS_KEPT * sizeof *own->list);
    own->modes = refdyn_motion_memory(copy, (contacts + 1) * sizeof *own->modes);
    own->left = refdyn_motion_memory(copy, (contacts + 1) * sizeof *own->left);
    memcpy(own->list, events->list, RECORD_EVENTS_KEPT * sizeof *own->list);
    memcpy(own->modes, events->modes, contacts * sizeof *own->modes);
    memcpy(own->left, events->left, contacts * sizeof *own->left);
}

static int copy_block(struct motion *copy, const struct motion *motion) {
    const struct refdyn_model *model = motion->library->model;
    copy->options = motion->options;
    if (!allocate_block(copy))
        return 0;
    if (setjmp(copy->no_memory)) {
        PyErr_NoMemory();
        return 0;
    }
    memcpy(copy->block, motion->block, motion->size);
    move_pointers(copy->block, motion->block, motion->size);
    memcpy(copy->given, motion->given, (size_t)model->anchored_count * sizeof *copy->given);
    copy_events(copy, &motion->block->record.events);
    copy->block->record.values = NULL;
    copy->block->record.stops = NULL;
    copy->block->record.samples = NULL;
    copy->newer = Py_XNewRef(motion->newer);
    copy->is_started = motion->is_started;
    copy->cpu_s = motion->cpu_s;
    return 1;
}

/* exchange(library): continues with the functions of another compilation. */
static PyObject *motion_exchange(PyObject *self, PyObject *library) {
    struct motion *motion = (struct motion *)self;
    if (Py_TYPE(library) != Py_TYPE((PyObject *)motion->library))
        return PyErr_Format(PyExc_TypeError, "exchange: %R; must be a library", library);
    if (!refdyn_motion_enter(motion))
        return NULL;
    exchange(motion, library);
    Py_CLEAR(motion->follow);
    return refdyn_motion_leave(motion, Py_NewRef(Py_None));
}

static PyObject *motion_copy(PyObject *self, PyObject *nothing) {
    struct motion *motion = (struct motion *)self;
    (void)nothing;
    if (!refdyn_motion_enter(motion))
        return NULL;
    struct motion *copy = refdyn_motion_new(Py_TYPE(self), motion->library, motion->places, motion->follow);
    if (copy && !copy_block(copy, motion))
        Py_CLEAR(copy);
    return refdyn_motion_leave(motion, (PyObject *)copy);
}

/* ---- The type ---- */

static PyMethodDef motion_methods[] = {
    {"start", refdyn_motion_start, METH_VARARGS,
     "start(t, q, qd, until, every, stops, samples, places, equilibrium, limits, has_rows, "
     "is_as_requested)"},
    {"advance", refdyn_motion_advance, METH_O, "advance(t)"},
    {"refresh", refdyn_motion_refresh, METH_VARARGS, "refresh(p, x, state)"},
    {"set", (PyCFunction)(void (*)(void))refdyn_motion_set, METH_FASTCALL, "set(inputs, parameters)"},
    {"steps", refdyn_motion_steps, METH_VARARGS, "steps(count, q, qd, t, h, p, x, new_q, new_qd)"},
    {"rows", refdyn_motion_rows, METH_O, "rows(out)"},
    {"derivatives", refdyn_motion_derivatives, METH_VARARGS,
     "derivatives(whats, places, names, times, threads, out)"},
    {"summary", refdyn_motion_summary, METH_NOARGS, "summary()"},
    {"state", motion_state, METH_O, "state(out)"},
    {"accelerations", motion_accelerations, METH_O, "accelerations(out)"},
    {"force", motion_force, METH_O, "force(out)"},
    {"parameters", motion_parameters, METH_O, "parameters(out)"},
    {"inputs", motion_inputs, METH_O, "inputs(out)"},
    {"exchange", motion_exchange, METH_O, "exchange(library)"},
    {"copy", motion_copy, METH_NOARGS, "copy()"},
    {NULL, NULL, 0, NULL},
};

static PyGetSetDef motion_values[] = {
    {"t", motion_t, NULL, "time of the state [s]", NULL},
    {"status", motion_status, NULL, "status of the last call of the runtime", NULL},
    {"has_ended", motion_has_ended, NULL, "whether an event of the model has ended the motion", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyType_Slot motion_slots[] = {
    {Py_tp_doc, "One motion of a compiled model; created by Library.motion"},
    {Py_tp_dealloc, motion_dealloc},
    {Py_tp_methods, motion_methods},
    {Py_tp_getset, motion_values},
    {0, NULL},
};

PyType_Spec refdyn_motion_spec = {"refdyn.core.Motion", sizeof(struct motion), 0,
                                  Py_TPFLAGS_DEFAULT | Py_TPFLAGS_DISALLOW_INSTANTIATION, motion_slots};
