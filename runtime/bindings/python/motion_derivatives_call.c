/*
 * Motion.derivatives: derivatives of the columns of a motion that was recorded, by copies that repeat its
 * steps (refdyn_derivatives_run).
 */
#include "runtime/bindings/python/extension.h"

#include <stdlib.h>
#include <string.h>

/* The tables of the motions that compute side by side. */
struct columns {
    struct record_table *tables; /* by room */
};

static void write_columns(void *context, const struct refdyn_batch_case *one, double *values) {
    struct record_table *table = &((struct columns *)context)->tables[one->room];
    table->integrator = one->integrator;
    record_table_fill_row(table);
    memcpy(values, table->values, (size_t)table->count * sizeof *values);
}

/* Arguments of the call, and what follows from them. */
struct call {
    Py_buffer whats, places, times, out;
    PyObject *names;
    int threads, count;
    const char **texts;
    struct refdyn_variable *variables;
    struct refdyn_underivable *underivable;
    struct columns columns;
};

static int read_variables(struct motion *motion, struct call *call) {
    const int *whats = call->whats.buf, *places = call->places.buf;
    call->count = (int)PyTuple_Size(call->names);
    const size_t count = (size_t)call->count;
    call->variables = refdyn_motion_memory(motion, (count + 1) * sizeof *call->variables);
    call->underivable = refdyn_motion_memory(motion, (count + 1) * sizeof *call->underivable);
    call->texts = refdyn_motion_memory(motion, (count + 1) * sizeof *call->texts);
    for (int i = 0; i < call->count; i++) {
        call->variables[i] = (struct refdyn_variable){(enum refdyn_varied)whats[i], places[i]};
        call->texts[i] = PyUnicode_AsUTF8AndSize(PyTuple_GetItem(call->names, i), NULL);
        if (!call->texts[i])
            return 0;
    }
    call->columns.tables = refdyn_motion_memory(motion, (size_t)call->threads * sizeof *call->columns.tables);
    for (int i = 0; i < call->threads; i++)
        record_table_start(&call->columns.tables[i], (struct record_memory){refdyn_motion_memory, motion},
                           &motion->block->integrator, motion->library->spatial);
    return 1;
}

static int compute(struct motion *motion, struct call *call) {
    static const double first_samples[] = {0};
    static const struct refdyn_batch_column samples = {REFDYN_VARIED_SAMPLES, 0, first_samples};
    const struct record_motion *record = &motion->block->record;
    const double *state = refdyn_motion_at(motion, motion->start_at);
    const int n = motion->library->model->n;
    struct refdyn_batch batch = {.model = motion->block->work.model,
                                 .options = motion->options,
                                 .p = motion->block->work.p,
                                 .x = motion->block->work.x,
                                 .given = motion->given,
                                 .q = motion->has_start[0] ? state : NULL,
                                 .qd = motion->has_start[1] ? state + n : NULL,
                                 .t = record->from,
                                 .times = call->times.buf,
                                 .time_count = (int)(call->times.len / (Py_ssize_t)sizeof(double)),
                                 .threads = call->threads};
    if (record->samples) {
        batch.samples = record->samples;
        batch.sample_count = 1;
        batch.columns = &samples;
        batch.column_count = 1;
    }
    struct refdyn_derivatives given = {.batch = &batch,
                                       .count = call->count,
                                       .variables = call->variables,
                                       .width = motion->table.count,
                                       .values = write_columns,
                                       .context = &call->columns,
                                       .derivatives = call->out.buf,
                                       .underivable = call->underivable};
    record_restore(record);
    return refdyn_derivatives_run(&given);
}

static PyObject *report(const struct motion *motion, const struct call *call, int status) {
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    if (status)
        fprintf(text.out, "refdyn: --derivatives: %s\n", refdyn_status_text(status));
    else
        record_print_underivable(motion->library->model, call->texts, motion->table.names, call->underivable,
                                 call->count, text.out);
    PyObject *said = refdyn_text_close(&text);
    return said ? Py_BuildValue("iN", status, said) : NULL;
}

static PyObject *derivatives_locked(struct motion *motion, struct call *call) {
    if (setjmp(motion->no_memory))
        return PyErr_NoMemory();
    if (!read_variables(motion, call))
        return NULL;
    const Py_ssize_t rows = call->times.len / (Py_ssize_t)sizeof(double) + 2;
    if (call->out.len != rows * call->count * motion->table.count * (Py_ssize_t)sizeof(double))
        return PyErr_Format(PyExc_ValueError, "derivatives: the array has another size");
    PyThreadState *thread = PyEval_SaveThread();
    const int status = compute(motion, call);
    PyEval_RestoreThread(thread);
    return report(motion, call, status);
}

/* derivatives(whats, places, names, times, threads, out): kinds (enum refdyn_varied) and places as bytes of
 * ints; times of the outputs after the start; out (names x (times + 2) x columns). Returns (status,
 * messages). */
PyObject *refdyn_motion_derivatives(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    struct call call = {.threads = 1};
    if (!PyArg_ParseTuple(arguments, "y*y*O!y*iw*", &call.whats, &call.places, &PyTuple_Type, &call.names,
                          &call.times, &call.threads, &call.out))
        return NULL;
    PyObject *result = NULL;
    if (refdyn_motion_enter(motion))
        result = refdyn_motion_leave(motion, derivatives_locked(motion, &call));
    PyBuffer_Release(&call.whats);
    PyBuffer_Release(&call.places);
    PyBuffer_Release(&call.times);
    PyBuffer_Release(&call.out);
    return result;
}
