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

/* refresh(p, x, state): continues with these values instead of the present ones; None: as they are. Returns
 * None, or the message of a failure. */
PyObject *refdyn_motion_refresh(PyObject *self, PyObject *arguments) {
    struct motion *motion = (struct motion *)self;
    const struct refdyn_model *model = motion->library->model;
    struct refdyn_workspace *work = &motion->block->work;
    PyObject *given[3];
    double *const to[] = {work->p, work->x, motion->block->integrator.q};
    const Py_ssize_t counts[] = {model->parameter_count, model->input_count, 2 * model->n};
    static const char *const names[] = {"p", "x", "state"};
    if (!PyArg_ParseTuple(arguments, "OOO", &given[0], &given[1], &given[2]) || !refdyn_motion_enter(motion))
        return NULL;
    for (int i = 0; i < 3; i++) {
        Py_buffer view;
        if (given[i] == Py_None)
            continue;
        if (!refdyn_need_doubles(given[i], names[i], counts[i], 1, 0, &view))
            return refdyn_motion_leave(motion, NULL);
        memcpy(to[i], view.buf, (size_t)view.len);
        PyBuffer_Release(&view);
    }
    refdyn_prepare(work);
    motion->status = refdyn_integrator_refresh(&motion->block->integrator);
    if (motion->status == REFDYN_OK)
        return refdyn_motion_leave(motion, Py_NewRef(Py_None));
    return refdyn_motion_leave(motion, report_refresh(motion));
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
    return status == REFDYN_EVENT_ENDS ? REFDYN_OK : status;
}

static int step_all(struct motion *motion, struct step_states *states, struct unlocked *unlocked) {
    int status = REFDYN_OK;
    for (states->next = 0; states->next < states->count && status == REFDYN_OK; states->next++)
        status = step_state(motion, states, unlocked);
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
        motion->status = step_all(motion, &states, &unlocked);
        PyEval_RestoreThread(unlocked.thread);
        if (motion->status == REFDYN_OK)
            result = Py_NewRef(Py_None);
        else if (motion->status != RECORD_INTERRUPTED)
            result = report_step(motion, &states);
    }
    while (open > 0)
        PyBuffer_Release(&states.views[--open]);
    return refdyn_motion_leave(motion, result);
}
