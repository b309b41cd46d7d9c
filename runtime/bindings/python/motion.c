/*
 * refdyn.core.Motion: one motion of a compiled model in the process, by the runtime.
 *
 * The object owns the workspace, the integrator and their memory. One thread at a time may use it: calls from
 * others are refused. The interpreter's lock is released while C computes; about every 10 ms the motion asks
 * for signals, so that Ctrl-C interrupts it. After an error of the numbers, and after an interruption, the
 * motion is at its last accepted state. Messages are those of `refdyn sim`.
 */
#include "runtime/bindings/python/extension.h"

#include <math.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* What copies of a motion contain: one piece of memory, whose pointers into itself move with it. */
struct block {
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct record_motion record;
};

/* Pieces of memory of the record. */
struct piece {
    struct piece *next;
    double data[];
};

struct motion {
    PyObject_HEAD struct library *library; /* held */
    PyObject *places;                      /* held: "FILE:LINE" of each requirement of the model */
    struct block *block;                   /* with the memory of workspace and integrator, and the start */
    size_t size, work_at, integrator_at, start_at; /* of the block, and places in it [bytes] */
    int *given; /* (anchored_count) non-zero: the parameter keeps its value */
    struct piece *pieces;
    jmp_buf no_memory;
    struct refdyn_options options;
    struct record_table table;
    struct record_limits limits;
    struct record_stops stops;
    struct refdyn_samples samples;
    PyObject *held;                           /* what stops and samples read */
    struct refdyn_statics_result equilibrium; /* where the motion starts, if has_equilibrium */
    int has_equilibrium;
    double cpu_s, wall_s;
    int status, is_started; /* of the last call of the runtime; the start could be evaluated */
    const char *unfit;      /* the column that was not finite; NULL if none was */
    int is_busy;
};

/* ---- Memory ---- */

static void *get_memory(void *context, size_t size) {
    struct motion *motion = context;
    struct piece *piece = calloc(1, sizeof *piece + size);
    if (!piece)
        longjmp(motion->no_memory, 1);
    piece->next = motion->pieces;
    motion->pieces = piece;
    return piece->data;
}

static void release_pieces(struct motion *motion) {
    while (motion->pieces) {
        struct piece *next = motion->pieces->next;
        free(motion->pieces);
        motion->pieces = next;
    }
}

static size_t rounded(size_t size) {
    const size_t unit = 2 * sizeof(double);
    return (size + unit - 1) / unit * unit;
}

static void *at(const struct motion *motion, size_t place) {
    return (char *)motion->block + place;
}

/* Returns 0 with a Python error without memory. */
static int allocate_block(struct motion *motion) {
    const struct refdyn_model *model = motion->library->model;
    motion->work_at = rounded(sizeof *motion->block);
    motion->integrator_at = motion->work_at + rounded(refdyn_workspace_size(model));
    motion->start_at = motion->integrator_at + rounded(refdyn_integrator_size(model, &motion->options));
    motion->size = motion->start_at + 2 * (size_t)model->n * sizeof(double);
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
    release_pieces(motion);
    free(motion->block);
    free(motion->given);
    Py_XDECREF(motion->held);
    Py_XDECREF(motion->places);
    Py_XDECREF(motion->library);
    type->tp_free(self);
    Py_DECREF(type);
}

/* ---- One thread at a time ---- */

static int enter(struct motion *motion) {
    if (motion->is_busy) {
        PyErr_SetString(
            PyExc_RuntimeError,
            "motion: another thread is computing with it; give each thread its own, motion.copy()");
        return 0;
    }
    motion->is_busy = 1;
    return 1;
}

static PyObject *leave(struct motion *motion, PyObject *result) {
    motion->is_busy = 0;
    return result;
}

static double seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static const double between_signals = 0.01; /* [s] */

/* The interpreter's lock, while C computes without it. */
struct unlocked {
    PyThreadState *thread;
    double asked; /* for signals [s] */
};

static int ask(void *context, const struct record_motion *record) {
    struct unlocked *unlocked = context;
    const double now = seconds(CLOCK_MONOTONIC);
    (void)record;
    if (now - unlocked->asked < between_signals)
        return REFDYN_OK;
    unlocked->asked = now;
    PyEval_RestoreThread(unlocked->thread);
    const int is_interrupted = PyErr_CheckSignals() != 0;
    unlocked->thread = PyEval_SaveThread();
    return is_interrupted ? RECORD_INTERRUPTED : REFDYN_OK;
}

/* ---- A new motion ---- */

/* Reads (method, tol, step, step_max, stabilise, follows_step, singular, project_start, balance). A tolerance
 * or step of 0 and a negative stabilise select the defaults of the method; a step selects fixed steps. */
static int read_options(struct refdyn_options *options, PyObject *given) {
    const char *name, *fact = "method is unknown";
    double tol, step, step_max;
    int stabilise, follows_step, singular, project_start, balance;
    if (!PyArg_ParseTuple(given, "sdddiiiii", &name, &tol, &step, &step_max, &stabilise, &follows_step,
                          &singular, &project_start, &balance))
        return 0;
    const int method = refdyn_method_find(name);
    *options = refdyn_options_default((enum refdyn_method)method);
    options->tol = step > 0 ? 0 : tol > 0 ? tol : options->tol;
    options->step = step > 0 ? step : options->step;
    options->step_max = step_max;
    options->stabilise = stabilise < 0 ? options->stabilise : (enum refdyn_stabilise)stabilise;
    options->gain_share = follows_step ? record_gain_share : 0;
    options->singular = (enum refdyn_singular)singular;
    options->project_start = project_start;
    options->balance = balance;
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
    struct block *block = motion->block;
    const struct refdyn_model *model = motion->library->model;
    int status = refdyn_workspace_init(&block->work, model, at(motion, motion->work_at),
                                       motion->integrator_at - motion->work_at);
    if (!status)
        status = refdyn_integrator_init(&block->integrator, &block->work, &motion->options,
                                        at(motion, motion->integrator_at),
                                        motion->start_at - motion->integrator_at);
    if (status)
        PyErr_Format(PyExc_ValueError, "motion: %s", refdyn_status_text(status));
    return status == REFDYN_OK;
}

static struct motion *new_motion(PyTypeObject *type, struct library *library, PyObject *places) {
    struct motion *motion = (struct motion *)type->tp_alloc(type, 0);
    if (!motion)
        return NULL;
    motion->library = (struct library *)Py_NewRef((PyObject *)library);
    motion->places = Py_NewRef(places);
    return motion;
}

PyObject *refdyn_library_motion(PyObject *self, PyObject *arguments) {
    const struct types *types = PyType_GetModuleState(Py_TYPE(self));
    struct library *library = (struct library *)self;
    PyObject *options, *places;
    struct given_values values;
    if (!PyArg_ParseTuple(arguments, "O!Oy#OO!", &PyTuple_Type, &options, &values.p, &values.is_anchored,
                          &values.flags, &values.x, &PyTuple_Type, &places))
        return NULL;
    struct motion *motion = new_motion(types->motion, library, places);
    if (motion && read_options(&motion->options, options) && allocate_block(motion) && begin_block(motion) &&
        refdyn_read_values(library, &values, &motion->block->work, motion->given))
        return (PyObject *)motion;
    Py_XDECREF((PyObject *)motion);
    return NULL;
}

/* ---- The start ---- */

void refdyn_write_refused(const struct refdyn_workspace *work, PyObject *places, char *text, size_t size) {
    const struct refdyn_requirement *rule = &work->model->requirements[work->refused];
    PyObject *place = PyTuple_GetItem(places, work->refused);
    const char *where = place ? PyUnicode_AsUTF8(place) : NULL;
    double x[REFDYN_REQUIREMENT_NUMBERS];
    refdyn_refused_numbers(work, x);
    const int length = snprintf(text, size, "%s: %s: ", where ? where : "model", rule->subject);
    if (length > 0 && (size_t)length < size)
        snprintf(text + length, size - (size_t)length, rule->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
}

/* Prints what `sim` prints on stderr after a failure. */
static void print_failure(const struct motion *motion, FILE *out) {
    char refused[512] = "";
    if (motion->status == REFDYN_REFUSED)
        refdyn_write_refused(&motion->block->work, motion->places, refused, sizeof refused);
    if (motion->status == REFDYN_REFUSED && !motion->is_started)
        fprintf(out, "%s\n", refused);
    else
        record_print_failure(&motion->block->record, motion->status, motion->is_started, motion->unfit,
                             refused, out);
}

/* The arguments of `start`. */
struct start {
    double t, until, every;
    PyObject *q, *qd, *stops, *samples, *places, *equilibrium;
    int limit_count, has_rows, is_as_requested;
};

static int copy_state(const struct motion *motion, const struct start *start) {
    const Py_ssize_t n = motion->library->model->n;
    double *state = at(motion, motion->start_at);
    PyObject *const given[] = {start->q, start->qd};
    static const char *const names[] = {"q", "qd"};
    refdyn_initial_state(&motion->block->work, state, state + n);
    for (int i = 0; i < 2; i++) {
        Py_buffer view;
        if (given[i] == Py_None)
            continue;
        if (!refdyn_need_doubles(given[i], names[i], n, 1, 0, &view))
            return 0;
        memcpy(state + i * n, view.buf, (size_t)view.len);
        PyBuffer_Release(&view);
    }
    return 1;
}

/* samples: rows (count x (1 + width)) of doubles, which the motion keeps; places: bytes of ints. */
static int open_samples(struct motion *motion, const struct start *start) {
    Py_buffer rows, places;
    if (start->samples == Py_None)
        return 1;
    if (PyObject_GetBuffer(start->samples, &rows, PyBUF_SIMPLE) != 0)
        return 0;
    if (PyObject_GetBuffer(start->places, &places, PyBUF_SIMPLE) != 0) {
        PyBuffer_Release(&rows);
        return 0;
    }
    const int width = (int)(places.len / (Py_ssize_t)sizeof(int));
    double *own = get_memory(motion, (size_t)rows.len);
    int *own_places = get_memory(motion, (size_t)places.len + 1);
    memcpy(own, rows.buf, (size_t)rows.len);
    memcpy(own_places, places.buf, (size_t)places.len);
    motion->samples =
        (struct refdyn_samples){.count = (int)(rows.len / (Py_ssize_t)sizeof(double)) / (1 + width),
                                .width = width,
                                .place = own_places,
                                .rows = own};
    motion->block->record.samples = &motion->samples;
    PyBuffer_Release(&rows);
    PyBuffer_Release(&places);
    return 1;
}

/* Returns 0 with a ValueError if a condition is none; the caller has its message from the program. */
static int open_stops(struct motion *motion, PyObject *stops) {
    const int count = (int)PyTuple_GET_SIZE(stops);
    if (count == 0)
        return 1;
    record_stops_start(&motion->stops, (struct record_memory){get_memory, motion}, count,
                       &motion->block->integrator, motion->library->spatial);
    for (int i = 0; i < count; i++) {
        const char *text = PyUnicode_AsUTF8(PyTuple_GET_ITEM(stops, i));
        if (!text)
            return 0;
        if (record_stops_add(&motion->stops, text) != RECORD_STOP_READ) {
            PyErr_SetString(PyExc_ValueError, "stop");
            return 0;
        }
    }
    motion->block->record.stops = &motion->stops;
    return 1;
}

static const struct refdyn_limits *find_limits(const struct library *library) {
    char symbol[512];
    snprintf(symbol, sizeof symbol, "%s_limits", library->model->name);
    return refdyn_find_symbol(library, symbol);
}

static int open_parts(struct motion *motion, const struct start *start) {
    const struct record_memory memory = {get_memory, motion};
    struct refdyn_integrator *integrator = &motion->block->integrator;
    if (start->has_rows)
        record_table_start(&motion->table, memory, integrator, motion->library->spatial);
    if (start->limit_count > 0)
        record_limits_start(&motion->limits, memory, motion->library->model, find_limits(motion->library),
                            start->limit_count);
    return open_samples(motion, start) && open_stops(motion, start->stops);
}

static int begin(struct motion *motion, const struct start *start) {
    struct refdyn_workspace *work = &motion->block->work;
    struct record_motion *record = &motion->block->record;
    const double *state = at(motion, motion->start_at);
    refdyn_prepare(work);
    int status = refdyn_check_parameters(work);
    if (status)
        return status;
    refdyn_anchor(work, start->t, state, state + work->n, motion->given);
    record->work = work;
    record->integrator = &motion->block->integrator;
    record->from = start->t;
    record->until = start->until;
    record->every = start->every;
    record->q = state;
    record->qd = state + work->n;
    return record_start(record, (struct record_memory){get_memory, motion});
}

static PyObject *report_start(struct motion *motion, const struct start *start) {
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    if (motion->is_started) {
        record_print_gains(&motion->block->work, &motion->options, text.out);
        record_print_start(&motion->block->record, start->is_as_requested, text.out);
    } else
        print_failure(motion, text.out);
    PyObject *said = refdyn_text_close(&text);
    return said ? Py_BuildValue("iNl", motion->status, said, motion->block->record.outputs) : NULL;
}

static PyObject *start_locked(struct motion *motion, const struct start *start) {
    if (setjmp(motion->no_memory))
        return PyErr_NoMemory();
    const double clock = seconds(CLOCK_THREAD_CPUTIME_ID);
    if (!copy_state(motion, start) || !open_parts(motion, start))
        return NULL;
    motion->status = begin(motion, start);
    motion->is_started = motion->status == REFDYN_OK;
    motion->cpu_s = seconds(CLOCK_THREAD_CPUTIME_ID) - clock;
    if (motion->is_started && motion->block->record.stops)
        record_stops_hold(motion->block->record.stops);
    return report_start(motion, start);
}

/* start(t, q, qd, until, every, stops, samples, places, equilibrium, limit_count, has_rows, is_as_requested):
 * returns (status, messages, outputs). */
static PyObject *motion_start(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    struct start start;
    if (!PyArg_ParseTuple(arguments, "dOOddO!OOOiii", &start.t, &start.q, &start.qd, &start.until,
                          &start.every, &PyTuple_Type, &start.stops, &start.samples, &start.places,
                          &start.equilibrium, &start.limit_count, &start.has_rows, &start.is_as_requested))
        return NULL;
    if (start.equilibrium != Py_None &&
        !PyArg_ParseTuple(start.equilibrium, "ii", &motion->equilibrium.unstable,
                          &motion->equilibrium.neutral))
        return NULL;
    if (!enter(motion))
        return NULL;
    motion->has_equilibrium = start.equilibrium != Py_None;
    motion->held = Py_NewRef(start.stops);
    return leave(motion, start_locked(motion, &start));
}

/* ---- Steps ---- */

/* After a failure or an interruption: the record of it, with the motion at its last accepted state. */
static PyObject *fail(struct motion *motion) {
    struct text_stream text;
    struct refdyn_integrator *integrator = &motion->block->integrator;
    if (!refdyn_text_open(&text))
        return NULL;
    print_failure(motion, text.out);
    PyObject *said = refdyn_text_close(&text);
    const int cause = integrator->cause;
    const double failed_t = integrator->failed_t;
    refdyn_integrator_refresh(integrator);
    integrator->cause = cause;
    integrator->failed_t = failed_t;
    return said;
}

/* advance(t): returns None, or the message of a failure. */
static PyObject *motion_advance(PyObject *self, PyObject *t_object) {
    struct motion *motion = (struct motion *)self;
    const double t = PyFloat_AsDouble(t_object);
    if (PyErr_Occurred() || !enter(motion))
        return NULL;
    struct unlocked unlocked = {PyEval_SaveThread(), seconds(CLOCK_MONOTONIC)};
    const struct record_watch watch = {ask, &unlocked};
    motion->status = record_advance(&motion->block->record, t, &watch);
    PyEval_RestoreThread(unlocked.thread);
    if (motion->status == RECORD_INTERRUPTED)
        return leave(motion, NULL);
    if (motion->status != REFDYN_OK)
        return leave(motion, fail(motion));
    return leave(motion, Py_NewRef(Py_None));
}

/* refresh(p, x, state): continues with these values instead of the present ones; None: as they are. Returns
 * None, or the message of a failure. */
static PyObject *motion_refresh(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    const struct refdyn_model *model = motion->library->model;
    struct refdyn_workspace *work = &motion->block->work;
    PyObject *given[3];
    double *const to[] = {work->p, work->x, motion->block->integrator.q};
    const Py_ssize_t counts[] = {model->parameter_count, model->input_count, 2 * model->n};
    static const char *const names[] = {"p", "x", "state"};
    if (!PyArg_ParseTuple(arguments, "OOO", &given[0], &given[1], &given[2]) || !enter(motion))
        return NULL;
    for (int i = 0; i < 3; i++) {
        Py_buffer view;
        if (given[i] == Py_None)
            continue;
        if (!refdyn_need_doubles(given[i], names[i], counts[i], 1, 0, &view))
            return leave(motion, NULL);
        memcpy(to[i], view.buf, (size_t)view.len);
        PyBuffer_Release(&view);
    }
    refdyn_prepare(work);
    motion->status = refdyn_integrator_refresh(&motion->block->integrator);
    if (motion->status == REFDYN_OK)
        return leave(motion, Py_NewRef(Py_None));
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return leave(motion, NULL);
    print_failure(motion, text.out);
    return leave(motion, refdyn_text_close(&text));
}

/* ---- Rows of a recorded motion ---- */

/* The rows (outputs x columns) that are filled. */
struct rows {
    double *next;
    long count;
    double t; /* of the last one [s] */
};

static void copy_row(struct motion *motion, struct rows *rows) {
    const int width = motion->table.count;
    memcpy(rows->next, motion->table.values, (size_t)width * sizeof *rows->next);
    rows->next += width;
    rows->count++;
    rows->t = motion->block->integrator.t;
    record_limits_add(&motion->limits, &motion->block->integrator);
}

/* Adds a row if all its values are finite; otherwise the motion ends there. */
static int add_row(struct motion *motion, struct rows *rows) {
    record_table_fill(&motion->table);
    motion->unfit = record_table_not_finite(&motion->table);
    if (motion->unfit) {
        motion->block->work.fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
        return REFDYN_NOT_FINITE;
    }
    copy_row(motion, rows);
    return REFDYN_OK;
}

static int record_rows(struct motion *motion, struct rows *rows, const struct record_watch *watch) {
    struct record_motion *record = &motion->block->record;
    int status = add_row(motion, rows);
    for (long i = 1; i < record->outputs && status == REFDYN_OK && !record_is_stopped(record); i++) {
        status = record_to(record, i, watch);
        if (status == REFDYN_OK && motion->block->integrator.t > rows->t)
            status = add_row(motion, rows);
    }
    if (status == REFDYN_OK)
        refdyn_energy_scale(&record->energy, record->integrator);
    return status;
}

/* Adds the last state of a motion that ended early as one more row. */
static void add_last(struct motion *motion, struct rows *rows) {
    struct refdyn_integrator *integrator = &motion->block->integrator;
    const struct refdyn_fault fault = motion->block->work.fault;
    const int cause = integrator->cause;
    const double failed_t = integrator->failed_t;
    if (rows->count > 0 && integrator->t > rows->t && refdyn_integrator_refresh(integrator) == REFDYN_OK) {
        record_table_fill(&motion->table);
        if (!record_table_not_finite(&motion->table))
            copy_row(motion, rows);
    }
    motion->block->work.fault = fault;
    integrator->cause = cause;
    integrator->failed_t = failed_t;
}

static PyObject *report_rows(const struct motion *motion, const struct rows *rows, PyObject *interrupt) {
    const struct record_motion *record = &motion->block->record;
    const int has_failed = motion->status != REFDYN_OK;
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    if (has_failed)
        print_failure(motion, text.out);
    if (record->work->m > 0)
        record_print_rows_warning(record->integrator, text.out);
    if (!has_failed || refdyn_energy_changes(&record->energy))
        record_print_balance_warning(record, text.out);
    record_limits_print(&motion->limits, text.out);
    PyObject *said = refdyn_text_close(&text);
    return said ? Py_BuildValue("ilNO", motion->status, rows->count, said, interrupt) : NULL;
}

/* Takes the exception of a signal, None if there is none. */
static PyObject *take_exception(void) {
    PyObject *type, *value, *traceback;
    PyErr_Fetch(&type, &value, &traceback);
    PyErr_NormalizeException(&type, &value, &traceback);
    Py_XDECREF(type);
    Py_XDECREF(traceback);
    return value ? value : Py_NewRef(Py_None);
}

/* rows(out): computes the motion and fills out (outputs x columns); returns (status, rows, messages,
 * exception of the signal that has interrupted it, or None). */
static PyObject *motion_rows(PyObject *self, PyObject *out) {
    struct motion *motion = (struct motion *)self;
    struct record_motion *record = &motion->block->record;
    Py_buffer view;
    if (!enter(motion))
        return NULL;
    if (!refdyn_need_doubles(out, "rows", record->outputs * motion->table.count, 1, PyBUF_WRITABLE, &view))
        return leave(motion, NULL);
    struct rows rows = {.next = view.buf};
    struct unlocked unlocked = {PyEval_SaveThread(), seconds(CLOCK_MONOTONIC)};
    const struct record_watch watch = {ask, &unlocked};
    const double cpu = seconds(CLOCK_THREAD_CPUTIME_ID), wall = unlocked.asked;
    motion->status = record_rows(motion, &rows, &watch);
    if (motion->status != REFDYN_OK && !motion->unfit)
        add_last(motion, &rows);
    motion->cpu_s += seconds(CLOCK_THREAD_CPUTIME_ID) - cpu;
    motion->wall_s += seconds(CLOCK_MONOTONIC) - wall;
    PyEval_RestoreThread(unlocked.thread);
    PyBuffer_Release(&view);
    PyObject *interrupt = take_exception(), *result = report_rows(motion, &rows, interrupt);
    Py_DECREF(interrupt);
    return leave(motion, result);
}

static PyObject *motion_summary(PyObject *self, PyObject *nothing) {
    struct motion *motion = (struct motion *)self;
    const struct record_summary summary = {.motion = &motion->block->record,
                                           .method = refdyn_method_name((int)motion->options.method),
                                           .equilibrium =
                                               motion->has_equilibrium ? &motion->equilibrium : NULL,
                                           .cpu_s = motion->cpu_s,
                                           .wall_s = motion->wall_s,
                                           .limits = &motion->limits};
    struct dict_writer dict;
    (void)nothing;
    if (!enter(motion))
        return NULL;
    const struct record_writer writer = refdyn_dict_begin(&dict);
    if (dict.open[0])
        record_put_summary(&summary, &writer);
    return leave(motion, refdyn_dict_end(&dict));
}

/* ---- Steps of many states ---- */

/* Arguments and results of a call: one row for each state, or one row for all. */
enum { STEP_P, STEP_X, STEP_Q, STEP_QD, STEP_T, STEP_NEW_Q, STEP_NEW_QD, STEP_VIEWS };

struct step_states {
    Py_buffer views[STEP_VIEWS];
    Py_ssize_t size[STEP_VIEWS]; /* of a row */
    double h;
    long count, next;
};

static double *row_of(const struct step_states *states, int which) {
    double *data = states->views[which].buf;
    const Py_ssize_t size = states->size[which];
    return data + (states->views[which].len <= size * (Py_ssize_t)sizeof(double) ? 0 : states->next * size);
}

/* Steps one state by h, in steps of the motion's options. */
static int step_state(struct motion *motion, const struct step_states *states) {
    struct refdyn_workspace *work = &motion->block->work;
    struct refdyn_integrator *integrator = &motion->block->integrator;
    const size_t n = (size_t)work->n;
    const double t = *row_of(states, STEP_T);
    memcpy(work->p, row_of(states, STEP_P), (size_t)states->size[STEP_P] * sizeof *work->p);
    memcpy(work->x, row_of(states, STEP_X), (size_t)states->size[STEP_X] * sizeof *work->x);
    int status = refdyn_integrator_start(integrator, t, row_of(states, STEP_Q), row_of(states, STEP_QD));
    refdyn_integrator_until(integrator, t + states->h);
    if (!status)
        status = refdyn_integrator_to(integrator, t + states->h);
    memcpy(row_of(states, STEP_NEW_Q), integrator->q, n * sizeof(double));
    memcpy(row_of(states, STEP_NEW_QD), integrator->qd, n * sizeof(double));
    return status == REFDYN_EVENT_ENDS ? REFDYN_OK : status;
}

static int step_all(struct motion *motion, struct step_states *states, struct unlocked *unlocked) {
    int status = REFDYN_OK;
    for (states->next = 0; states->next < states->count && status == REFDYN_OK; states->next++) {
        status = step_state(motion, states);
        if (status == REFDYN_OK)
            status = ask(unlocked, &motion->block->record);
    }
    return status;
}

/* Returns (index of the state that has failed, message). */
static PyObject *report_step(struct motion *motion, const struct step_states *states) {
    const struct refdyn_integrator *integrator = &motion->block->integrator;
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    record_print_failed(&motion->block->work, motion->status, integrator->t, integrator->q, integrator->qd,
                        text.out);
    return Py_BuildValue("lN", states->next - 1, refdyn_text_close(&text));
}

/* steps(count, q, qd, t, h, p, x, new_q, new_qd): steps `count` states by h; p is prepared. Returns None, or
 * (index of the state that has failed, message). The motion is scratch. */
static PyObject *motion_steps(PyObject *self, PyObject *arguments) {
    static const char *const names[] = {"p", "x", "q", "qd", "t", "new_q", "new_qd"};
    struct motion *motion = (struct motion *)self;
    const struct refdyn_model *model = motion->library->model;
    struct step_states states = {.size = {model->parameter_count + model->derived_count, model->input_count,
                                          model->n, model->n, 1, model->n, model->n}};
    PyObject *given[STEP_VIEWS], *result = NULL;
    int open = 0;
    if (!PyArg_ParseTuple(arguments, "lOOOdOOOO", &states.count, &given[STEP_Q], &given[STEP_QD],
                          &given[STEP_T], &states.h, &given[STEP_P], &given[STEP_X], &given[STEP_NEW_Q],
                          &given[STEP_NEW_QD]) ||
        !enter(motion))
        return NULL;
    while (open < STEP_VIEWS &&
           refdyn_need_doubles(given[open], names[open], states.size[open], states.count,
                               open < STEP_NEW_Q ? 0 : PyBUF_WRITABLE, &states.views[open]))
        open++;
    if (open == STEP_VIEWS) {
        struct unlocked unlocked = {PyEval_SaveThread(), seconds(CLOCK_MONOTONIC)};
        motion->status = step_all(motion, &states, &unlocked);
        PyEval_RestoreThread(unlocked.thread);
        if (motion->status == REFDYN_OK)
            result = Py_NewRef(Py_None);
        else if (motion->status != RECORD_INTERRUPTED)
            result = report_step(motion, &states);
    }
    while (open > 0)
        PyBuffer_Release(&states.views[--open]);
    return leave(motion, result);
}

/* ---- Its state ---- */

/* Writes (q, qd), accelerations or forces into `out`. */
static PyObject *fill(PyObject *self, PyObject *out, int count, void (*write)(struct motion *, double *)) {
    struct motion *motion = (struct motion *)self;
    Py_buffer view;
    if (!enter(motion))
        return NULL;
    if (!refdyn_need_doubles(out, "out", count, 1, PyBUF_WRITABLE, &view))
        return leave(motion, NULL);
    write(motion, view.buf);
    PyBuffer_Release(&view);
    return leave(motion, Py_NewRef(Py_None));
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

static PyObject *motion_has_ended(PyObject *self, void *closure) {
    (void)closure;
    return PyBool_FromLong(((struct motion *)self)->block->record.events.has_ended);
}

/* ---- Copies ---- */

/* Moves pointers into the old block to the same places in the new one. The block has only numbers and
 * pointers, aligned; a number with the bits of such a pointer would be a double below 1e-308, or two indices
 * above 10^4. */
static void move_pointers(struct block *block, const struct block *old, size_t size) {
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
    own->list = get_memory(copy, RECORD_EVENTS_KEPT * sizeof *own->list);
    own->modes = get_memory(copy, (contacts + 1) * sizeof *own->modes);
    memcpy(own->list, events->list, RECORD_EVENTS_KEPT * sizeof *own->list);
    memcpy(own->modes, events->modes, contacts * sizeof *own->modes);
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
    copy->is_started = motion->is_started;
    copy->cpu_s = motion->cpu_s;
    return 1;
}

static PyObject *motion_copy(PyObject *self, PyObject *nothing) {
    struct motion *motion = (struct motion *)self;
    (void)nothing;
    if (!enter(motion))
        return NULL;
    struct motion *copy = new_motion(Py_TYPE(self), motion->library, motion->places);
    if (copy && !copy_block(copy, motion))
        Py_CLEAR(copy);
    return leave(motion, (PyObject *)copy);
}

/* ---- Columns of a library ---- */

static PyObject *list_of(const char *const *texts, int count) {
    PyObject *list = PyList_New(count);
    for (int i = 0; list && i < count; i++) {
        PyObject *text = texts[i] ? PyUnicode_FromString(texts[i]) : Py_NewRef(Py_None);
        if (!text)
            Py_CLEAR(list);
        else
            PyList_SET_ITEM(list, i, text);
    }
    return list;
}

static PyObject *list_columns(const struct library *library, struct motion *own) {
    const struct record_memory memory = {get_memory, own};
    struct refdyn_workspace work = {.model = library->model, .n = library->model->n, .m = library->model->m};
    struct refdyn_integrator integrator = {.work = &work};
    struct record_table table;
    record_table_start(&table, memory, &integrator, library->spatial);
    PyObject *names = list_of(table.names, table.count), *units = list_of(table.units, table.count);
    return names && units ? Py_BuildValue("NN", names, units) : NULL;
}

PyObject *refdyn_library_columns(PyObject *self, PyObject *nothing) {
    struct motion own = {.pieces = NULL};
    (void)nothing;
    PyObject *columns = setjmp(own.no_memory) ? PyErr_NoMemory() : list_columns((struct library *)self, &own);
    release_pieces(&own);
    return columns;
}

/* ---- The type ---- */

static PyMethodDef motion_methods[] = {
    {"start", motion_start, METH_VARARGS,
     "start(t, q, qd, until, every, stops, samples, places, equilibrium, limit_count, has_rows, "
     "is_as_requested)"},
    {"advance", motion_advance, METH_O, "advance(t)"},
    {"refresh", motion_refresh, METH_VARARGS, "refresh(p, x, state)"},
    {"steps", motion_steps, METH_VARARGS, "steps(count, q, qd, t, h, p, x, new_q, new_qd)"},
    {"rows", motion_rows, METH_O, "rows(out)"},
    {"summary", motion_summary, METH_NOARGS, "summary()"},
    {"state", motion_state, METH_O, "state(out)"},
    {"accelerations", motion_accelerations, METH_O, "accelerations(out)"},
    {"force", motion_force, METH_O, "force(out)"},
    {"parameters", motion_parameters, METH_O, "parameters(out)"},
    {"inputs", motion_inputs, METH_O, "inputs(out)"},
    {"copy", motion_copy, METH_NOARGS, "copy()"},
    {NULL, NULL, 0, NULL},
};

static PyGetSetDef motion_values[] = {
    {"t", motion_t, NULL, "time of the state [s]", NULL},
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
