/* Steps of a motion in the caller's loop, and steps of many states with its memory. */
#include "runtime/bindings/python/extension.h"

#include <string.h>

/* ---- In the loop of the caller ---- */

/* After a failure or an interruption: the record of it, with the motion at its last accepted state. */
static PyObject *fail(struct motion *motion) {
    struct text_stream text;
    struct refdyn_integrator *integrator = &motion->block->integrator;
    if (!refdyn_text_open(&text))
        return NULL;
    refdyn_motion_print_failure(motion, text.out);
    PyObject *said = refdyn_text_close(&text);
    const int cause = integrator->cause;
    const double failed_t = integrator->failed_t;
    refdyn_integrator_refresh(integrator);
    integrator->cause = cause;
    integrator->failed_t = failed_t;
    return said;
}

/* advance(t): returns None, or the message of a failure. */
PyObject *refdyn_motion_advance(PyObject *self, PyObject *t_object) {
    struct motion *motion = (struct motion *)self;
    const double t = PyFloat_AsDouble(t_object);
    if (PyErr_Occurred() || !refdyn_motion_enter(motion))
        return NULL;
    struct unlocked unlocked = {
        .thread = PyEval_SaveThread(), .asked = refdyn_seconds(CLOCK_MONOTONIC), .motion = motion};
    const struct record_watch watch = {refdyn_motion_ask, &unlocked};
    motion->status = record_advance(&motion->block->record, t, &watch);
    PyEval_RestoreThread(unlocked.thread);
    if (motion->status == RECORD_INTERRUPTED)
        return refdyn_motion_leave(motion, NULL);
    if (motion->status != REFDYN_OK)
        return refdyn_motion_leave(motion, fail(motion));
    return refdyn_motion_leave(motion, Py_NewRef(Py_None));
}

/* Why the motion cannot continue from its values. */
static PyObject *report_refresh(const struct motion *motion) {
    const struct refdyn_integrator *integrator = &motion->block->integrator;
    const struct refdyn_workspace *work = &motion->block->work;
    char refused[512];
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    if (motion->status == REFDYN_REFUSED) {
        refdyn_write_refused(work, motion->places, refused, sizeof refused);
        fprintf(text.out, "%s\n", refused);
    } else
        record_print_failed(work, motion->status, integrator->t, integrator->q, integrator->qd, text.out);
    return refdyn_text_close(&text);
}

/* Continues from the values that the caller has set. A motion that an event has ended begins again at the
 * state; only a new state lets it continue. */
static int continue_from_here(struct motion *motion, int has_state, int is_new) {
    struct motion_block *block = motion->block;
    struct refdyn_integrator *integrator = &block->integrator;
    refdyn_prepare(&block->work);
    if (!has_state || !block->record.events.has_ended)
        return refdyn_integrator_refresh(integrator);
    double *start = refdyn_motion_at(motion, motion->start_at), *rates = start + block->work.n;
    memcpy(start, integrator->q, 2 * (size_t)block->work.n * sizeof *start);
    const int status = refdyn_integrator_start(integrator, integrator->t, start, rates);
    if (status == REFDYN_OK && is_new)
        record_events_resume(&block->record.events);
    return status;
}

/* The parameters, inputs and state of a motion, which the caller may change. */
enum { SET_P, SET_X, SET_STATE, SETS };

struct settable {
    double *values[SETS], *before[SETS]; /* in the motion, and where it keeps the values before a change */
    double *seen[SETS];                  /* those that the caller has seen before it */
    size_t counts[SETS];
};

static struct settable settable_of(struct motion *motion) {
    const struct refdyn_model *model = motion->library->model;
    const size_t p = (size_t)model->parameter_count, x = (size_t)model->input_count;
    double *before = refdyn_motion_at(motion, motion->before_at),
           *seen = before + p + x + 2 * (size_t)model->n;
    return (struct settable){
        {motion->block->work.p, motion->block->work.x, motion->block->integrator.q},
        {before, before + p, before + p + x},
        {seen, seen + p, seen + p + x},
        {p, x, 2 * (size_t)model->n},
    };
}

static void copy_values(const struct settable *settable, double *const *from, double *const *to) {
    for (int i = 0; i < SETS; i++)
        memcpy(to[i], from[i], settable->counts[i] * sizeof(double));
}

/* Keeps the present values before a change, and those that the caller sees where an event is due. */
static void keep_values(struct motion *motion, const struct settable *settable) {
    struct refdyn_integrator *integrator = &motion->block->integrator;
    copy_values(settable, settable->values, settable->before);
    const int is_after = refdyn_integrator_see_after(integrator);
    copy_values(settable, settable->values, settable->seen);
    if (is_after)
        refdyn_integrator_see_before(integrator);
}

/* A value that is set to what the caller has seen does not change: the event that is due will set it. */
static void leave_seen_values(const struct settable *settable) {
    for (int i = 0; i < SETS; i++)
        for (size_t k = 0; k < settable->counts[i]; k++)
            if (settable->values[i][k] == settable->seen[i][k])
                settable->values[i][k] = settable->before[i][k];
}

/* Continues with the values that were set. Returns None, or the message of a failure; then the motion is as
 * before. */
static PyObject *take_set(struct motion *motion, const struct settable *settable, int has_state) {
    leave_seen_values(settable);
    motion->status = continue_from_here(motion, has_state, 1);
    if (motion->status == REFDYN_OK)
        return Py_NewRef(Py_None);
    PyObject *said = report_refresh(motion);
    copy_values(settable, settable->before, settable->values);
    continue_from_here(motion, 1, 0);
    return said;
}

/* refresh(p, x, state): continues with these values instead of the present ones; None: as they are. Returns
 * None, or the message of a failure; then the motion is as before. */
PyObject *refdyn_motion_refresh(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    PyObject *given[SETS];
    static const char *const names[] = {"p", "x", "state"};
    if (!PyArg_ParseTuple(arguments, "OOO", &given[SET_P], &given[SET_X], &given[SET_STATE]) ||
        !refdyn_motion_enter(motion))
        return NULL;
    const struct settable settable = settable_of(motion);
    keep_values(motion, &settable);
    for (int i = 0; i < SETS; i++) {
        Py_buffer view;
        if (given[i] == Py_None)
            continue;
        if (!refdyn_need_doubles(given[i], names[i], (Py_ssize_t)settable.counts[i], 1, 0, &view)) {
            copy_values(&settable, settable.before, settable.values);
            return refdyn_motion_leave(motion, NULL);
        }
        memcpy(settable.values[i], view.buf, (size_t)view.len);
        PyBuffer_Release(&view);
    }
    return refdyn_motion_leave(motion, take_set(motion, &settable, given[SET_STATE] != Py_None));
}

/* set(inputs, parameters): the same for dictionaries of numbers, or None. Returns False and changes nothing
 * if Python has to check them. */
PyObject *refdyn_motion_set(PyObject *self, PyObject *const *given, Py_ssize_t count) {
    struct motion *motion = (struct motion *)self;
    const struct library *library = motion->library;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "set: has %zd arguments; must have 2", count);
    if (!refdyn_motion_enter(motion))
        return NULL;
    const struct settable settable = settable_of(motion);
    keep_values(motion, &settable);
    if (refdyn_read_by_name(&library->inputs, given[0], settable.values[SET_X]) &&
        refdyn_read_by_name(&library->parameters, given[1], settable.values[SET_P]))
        return refdyn_motion_leave(motion, take_set(motion, &settable, 0));
    copy_values(&settable, settable.before, settable.values);
    return refdyn_motion_leave(motion, Py_NewRef(Py_False));
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

enum { STEPS_PER_ASK = 16 }; /* between two looks at the clock, whose time is then negligible */

/* Steps one state by h, in steps of the motion's options. */
static int step_state(struct motion *motion, const struct step_states *states, struct unlocked *unlocked) {
    struct refdyn_workspace *work = &motion->block->work;
    struct refdyn_integrator *integrator = &motion->block->integrator;
    const size_t n = (size_t)work->n;
    const double t = *row_of(states, STEP_T), end = t + states->h;
    memcpy(work->p, row_of(states, STEP_P), (size_t)states->size[STEP_P] * sizeof *work->p);
    memcpy(work->x, row_of(states, STEP_X), (size_t)states->size[STEP_X] * sizeof *work->x);
    int status = refdyn_integrator_start(integrator, t, row_of(states, STEP_Q), row_of(states, STEP_QD));
    refdyn_integrator_until(integrator, end);
    while (!status && integrator->t < end) {
        status = refdyn_integrator_step(integrator, end, STEPS_PER_ASK);
        if (!status)
            status = refdyn_ask(unlocked);
    }
    memcpy(row_of(states, STEP_NEW_Q), integrator->q, n * sizeof(double));
    memcpy(row_of(states, STEP_NEW_QD), integrator->qd, n * sizeof(double));
    return status;
}

/* The message of a step that has failed from the given state with this status. NULL with a Python error. */
static PyObject *explain(struct motion *motion, const struct step_row *row, int status) {
    const struct refdyn_integrator *integrator = &motion->block->integrator;
    const struct refdyn_workspace *work = &motion->block->work;
    struct text_stream text;
    if (!refdyn_text_open(&text))
        return NULL;
    record_print_failed(work, status, *row->t, row->q, row->qd, text.out);
    record_events_print_failed(integrator, text.out);
    if (integrator->start_is_off)
        fprintf(
            text.out,
            "refdyn: the given state is off the programme (largest |phi| %.4g, |psi| %.4g); arm.motion(q, "
            "qd, t, --start project) finds the nearest state on it\n",
            integrator->start.phi, integrator->start.psi);
    else if (status > REFDYN_OK)
        fputs("refdyn: a shorter h or more steps may help, or arm.motion, which chooses its steps\n",
              text.out);
    return refdyn_text_close(&text);
}

/* The event that has ended the motion. */
static const char *ending_event(const struct refdyn_integrator *integrator) {
    const struct refdyn_event *events = integrator->work->model->events;
    int k = 0;
    while (!events[integrator->event[k]].ends)
        k++;
    return events[integrator->event[k]].name;
}

/* Notes the outcome of a step with this status. Returns 0 with a Python error if memory is missing. */
static int note(struct motion *motion, const struct step_row *row, int status, struct unlocked *unlocked,
                struct step_report *report) {
    const struct refdyn_integrator *integrator = &motion->block->integrator;
    const int has_ended = status == REFDYN_EVENT_ENDS;
    if (!refdyn_step_note(report, row, has_ended ? STEP_ENDED : STEP_FAILED))
        return 1;
    if (has_ended) {
        report->event = ending_event(integrator);
        report->after = integrator->t - *row->t;
        return 1;
    }
    PyEval_RestoreThread(unlocked->thread);
    report->reason = explain(motion, row, status);
    unlocked->thread = PyEval_SaveThread();
    return report->reason != NULL;
}

/* Steps all states. Returns 0 with a Python error after a signal, or if memory is missing. */
static int step_all(struct motion *motion, struct step_states *states, struct unlocked *unlocked,
                    struct step_report *report) {
    for (states->next = 0; states->next < states->count; states->next++) {
        const struct step_row row = {.index = states->next,
                                     .n = motion->library->model->n,
                                     .t = row_of(states, STEP_T),
                                     .q = row_of(states, STEP_Q),
                                     .qd = row_of(states, STEP_QD),
                                     .new_q = row_of(states, STEP_NEW_Q),
                                     .new_qd = row_of(states, STEP_NEW_QD)};
        if (refdyn_step_is_unfit(&row)) {
            refdyn_step_note(report, &row, STEP_UNFIT);
            continue;
        }
        const int status = step_state(motion, states, unlocked);
        if (status == RECORD_INTERRUPTED || (status && !note(motion, &row, status, unlocked, report)))
            return 0;
    }
    return 1;
}

/* steps(count, q, qd, t, h, p, x, new_q, new_qd): steps `count` states by h; p is prepared. Returns the
 * report. The motion is scratch. */
PyObject *refdyn_motion_steps(PyObject *self, PyObject *arguments) {
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
        !refdyn_motion_enter(motion))
        return NULL;
    while (open < STEP_VIEWS &&
           refdyn_need_doubles(given[open], names[open], states.size[open], states.count,
                               open < STEP_NEW_Q ? 0 : PyBUF_WRITABLE, &states.views[open]))
        open++;
    if (open == STEP_VIEWS) {
        struct unlocked unlocked = {
            .thread = PyEval_SaveThread(), .asked = refdyn_seconds(CLOCK_MONOTONIC), .motion = motion};
        struct step_report report = {.reason = NULL};
        const int is_done = step_all(motion, &states, &unlocked, &report);
        PyEval_RestoreThread(unlocked.thread);
        if (is_done)
            result = refdyn_step_report(&report);
        Py_XDECREF(report.reason);
    }
    while (open > 0)
        PyBuffer_Release(&states.views[--open]);
    return refdyn_motion_leave(motion, result);
}
