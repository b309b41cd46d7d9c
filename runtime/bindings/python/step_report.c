/*
 * What has become of the states of one call of arm.step. Both kinds of steps use it.
 *
 * In: each state before and after its steps. Out: NaN for states that could not be stepped. For each outcome
 * other than success, the report counts the states and has the index of the first one. It also has the reason
 * of the first failure, and the event and time of the first motion that has ended. stepping.py raises or
 * warns accordingly.
 */
#include "runtime/bindings/python/extension.h"
#include "runtime/core/linear/linear.h"

#include <math.h>

int refdyn_step_is_unfit(const struct step_row *row) {
    return !(isfinite(*row->t) && refdyn_is_finite(row->q, row->n) && refdyn_is_finite(row->qd, row->n));
}

int refdyn_step_is_finite(const struct step_row *row) {
    return isfinite(*row->t) && refdyn_is_finite(row->new_q, row->n) && refdyn_is_finite(row->new_qd, row->n);
}

static void clear(const struct step_row *row) {
    for (int j = 0; j < row->n; j++)
        row->new_q[j] = row->new_qd[j] = NAN;
}

int refdyn_step_note(struct step_report *report, const struct step_row *row, enum step_outcome outcome) {
    const int is_first = report->count[outcome]++ == 0;
    if (is_first)
        report->first[outcome] = row->index;
    if (outcome != STEP_ENDED)
        clear(row);
    return is_first;
}

PyObject *refdyn_step_report(const struct step_report *report) {
    const Py_ssize_t *count = report->count, *first = report->first;
    PyObject *reason = report->reason ? report->reason : Py_None;
    if (count[STEP_UNFIT] + count[STEP_FAILED] + count[STEP_ENDED] == 0)
        return Py_NewRef(Py_None);
    return Py_BuildValue("((nn)(nn)(nn)Ozd)", count[STEP_UNFIT], first[STEP_UNFIT], count[STEP_FAILED],
                         first[STEP_FAILED], count[STEP_ENDED], first[STEP_ENDED], reason, report->event,
                         report->after);
}
