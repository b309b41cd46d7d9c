/* The start of a motion, and its rows and summary, as `sim` records them. */
#include "runtime/bindings/python/extension.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- The start ---- */

/* The arguments of `start`. */
struct start {
    double t, until, every;
    PyObject *q, *qd, *stops, *samples, *places, *equilibrium, *limits;
    int has_rows, is_as_requested;
};

static int copy_state(struct motion *motion, const struct start *start) {
    const Py_ssize_t n = motion->library->model->n;
    double *state = refdyn_motion_at(motion, motion->start_at);
    PyObject *const given[] = {start->q, start->qd};
    static const char *const names[] = {"q", "qd"};
    refdyn_initial_state(&motion->block->work, state, state + n);
    for (int i = 0; i < 2; i++) {
        Py_buffer view;
        motion->has_start[i] = given[i] != Py_None;
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
    double *own = refdyn_motion_memory(motion, (size_t)rows.len);
    int *own_places = refdyn_motion_memory(motion, (size_t)places.len + 1);
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

/* Returns 0 with a ValueError if a text is not a condition; the caller lets the program report what is wrong
 * with it. */
static int open_stops(struct motion *motion, PyObject *stops) {
    const int count = (int)PyTuple_Size(stops);
    if (count == 0)
        return 1;
    record_stops_start(&motion->stops, (struct record_memory){refdyn_motion_memory, motion}, count,
                       &motion->block->integrator, motion->library->spatial);
    for (int i = 0; i < count; i++) {
        const char *text = PyUnicode_AsUTF8AndSize(PyTuple_GetItem(stops, i), NULL);
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

/* Limits are tuples (name, column, from, to), which the caller holds. Returns 0 with an exception if not. */
static int open_limits(struct motion *motion, PyObject *limits) {
    const struct record_memory memory = {refdyn_motion_memory, motion};
    const int count = (int)PyTuple_Size(limits);
    if (count == 0)
        return 1;
    struct record_bound *bounds = refdyn_motion_memory(motion, (size_t)count * sizeof *bounds);
    for (int i = 0; i < count; i++)
        if (!PyArg_ParseTuple(PyTuple_GetItem(limits, i), "ssdd", &bounds[i].name, &bounds[i].column,
                              &bounds[i].from, &bounds[i].to))
            return 0;
    record_limits_start(&motion->limits, memory, &motion->block->integrator, motion->library->spatial, bounds,
                        count);
    motion->block->record.limits = &motion->limits;
    return 1;
}

static int open_parts(struct motion *motion, const struct start *start) {
    const struct record_memory memory = {refdyn_motion_memory, motion};
    struct refdyn_integrator *integrator = &motion->block->integrator;
    if (start->has_rows)
        record_table_start(&motion->table, memory, integrator, motion->library->spatial);
    return open_limits(motion, start->limits) && open_samples(motion, start) &&
           open_stops(motion, start->stops);
}

static int begin(struct motion *motion, const struct start *start) {
    struct refdyn_workspace *work = &motion->block->work;
    struct record_motion *record = &motion->block->record;
    const double *state = refdyn_motion_at(motion, motion->start_at);
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
    if (isfinite(start->until) && record->integrator->options.step_limit == 0)
        record->integrator->options.step_limit = RECORD_STEPS_MAX;
    record->q = state;
    record->qd = state + work->n;
    return record_start(record, (struct record_memory){refdyn_motion_memory, motion});
}

static PyObject *report_start(struct motion *motion, const struct start *start) {
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    if (motion->is_started) {
        record_print_gains(&motion->block->work, &motion->options, text.out);
        record_print_start(&motion->block->record, start->is_as_requested, text.out);
    } else
        refdyn_motion_print_failure(motion, text.out);
    PyObject *said = refdyn_text_close(&text);
    return said ? Py_BuildValue("iNl", motion->status, said, motion->block->record.outputs) : NULL;
}

static PyObject *start_locked(struct motion *motion, const struct start *start) {
    if (setjmp(motion->no_memory))
        return PyErr_NoMemory();
    const double clock = refdyn_seconds(CLOCK_THREAD_CPUTIME_ID);
    if (!copy_state(motion, start) || !open_parts(motion, start))
        return NULL;
    motion->status = begin(motion, start);
    motion->is_started = motion->status == REFDYN_OK;
    motion->cpu_s = refdyn_seconds(CLOCK_THREAD_CPUTIME_ID) - clock;
    if (motion->is_started && motion->block->record.stops)
        record_stops_hold(motion->block->record.stops);
    return report_start(motion, start);
}

/* start(t, q, qd, until, every, stops, samples, places, equilibrium, limits, has_rows, is_as_requested):
 * returns (status, messages, outputs). */
PyObject *refdyn_motion_start(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    struct start start;
    if (!PyArg_ParseTuple(arguments, "dOOddO!OOOO!ii", &start.t, &start.q, &start.qd, &start.until,
                          &start.every, &PyTuple_Type, &start.stops, &start.samples, &start.places,
                          &start.equilibrium, &PyTuple_Type, &start.limits, &start.has_rows,
                          &start.is_as_requested))
        return NULL;
    if (start.equilibrium != Py_None &&
        !PyArg_ParseTuple(start.equilibrium, "ii", &motion->equilibrium.unstable,
                          &motion->equilibrium.neutral))
        return NULL;
    if (!refdyn_motion_enter(motion))
        return NULL;
    motion->has_equilibrium = start.equilibrium != Py_None;
    motion->held = PyTuple_Pack(2, start.stops, start.limits);
    return refdyn_motion_leave(motion, start_locked(motion, &start));
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
}

/* Adds a row if all its values are finite; otherwise the motion ends there. */
static int add_row(struct motion *motion, struct rows *rows) {
    record_table_fill_row(&motion->table);
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
        record_table_fill_row(&motion->table);
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
        refdyn_motion_print_failure(motion, text.out);
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
PyObject *refdyn_motion_rows(PyObject *self, PyObject *out) {
    struct motion *motion = (struct motion *)self;
    struct record_motion *record = &motion->block->record;
    Py_buffer view;
    if (!refdyn_motion_enter(motion))
        return NULL;
    if (!refdyn_need_doubles(out, "rows", record->outputs * motion->table.count, 1, PyBUF_WRITABLE, &view))
        return refdyn_motion_leave(motion, NULL);
    struct rows rows = {.next = view.buf};
    struct unlocked unlocked = {
        .thread = PyEval_SaveThread(), .asked = refdyn_seconds(CLOCK_MONOTONIC), .motion = motion};
    const struct record_watch watch = {refdyn_motion_ask, &unlocked};
    const double cpu = refdyn_seconds(CLOCK_THREAD_CPUTIME_ID), wall = unlocked.asked;
    motion->status = record_rows(motion, &rows, &watch);
    if (motion->status != REFDYN_OK && !motion->unfit)
        add_last(motion, &rows);
    motion->cpu_s += refdyn_seconds(CLOCK_THREAD_CPUTIME_ID) - cpu;
    motion->wall_s += refdyn_seconds(CLOCK_MONOTONIC) - wall;
    PyEval_RestoreThread(unlocked.thread);
    PyBuffer_Release(&view);
    PyObject *interrupt = take_exception(), *result = report_rows(motion, &rows, interrupt);
    Py_DECREF(interrupt);
    return refdyn_motion_leave(motion, result);
}

PyObject *refdyn_motion_summary(PyObject *self, PyObject *nothing) {
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
    if (!refdyn_motion_enter(motion))
        return NULL;
    const struct record_writer writer = refdyn_dict_begin(&dict);
    if (dict.open[0])
        record_put_summary(&summary, &writer);
    return refdyn_motion_leave(motion, refdyn_dict_end(&dict));
}

/* ---- Columns of a library ---- */

static PyObject *list_of(const char *const *texts, int count) {
    PyObject *list = PyList_New(count);
    for (int i = 0; list && i < count; i++) {
        PyObject *text = texts[i] ? PyUnicode_FromString(texts[i]) : Py_NewRef(Py_None);
        if (!text)
            Py_CLEAR(list);
        else
            PyList_SetItem(list, i, text);
    }
    return list;
}

static PyObject *list_columns(const struct library *library, struct motion *own) {
    const struct record_memory memory = {refdyn_motion_memory, own};
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
    refdyn_motion_release(&own);
    return columns;
}
