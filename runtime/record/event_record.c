/* Records the events of a motion, and writes them into summaries and messages. */
#include "runtime/record/record.h"

#include <math.h>

enum {
    LISTED_MOST = 8 /* events listed in the text of a summary */
};

void record_events_start(struct record_events *events, struct record_memory memory,
                         const struct refdyn_model *model) {
    const size_t contacts = (size_t)(model->m - refdyn_programme_rows(model));
    *events = (struct record_events){.count = 0};
    if (model->event_count == 0)
        return;
    events->list = memory.get(memory.context, RECORD_EVENTS_KEPT * sizeof *events->list);
    events->modes = memory.get(memory.context, (contacts + 1) * sizeof *events->modes);
    events->left = memory.get(memory.context, (contacts + 1) * sizeof *events->left);
    for (size_t k = 0; k < contacts; k++)
        events->left[k] = NAN;
}

static const char *const kind_names[] = {"", "impact", "rests", "leaves"};

const char *record_event_kind_name(enum record_event_kind kind) {
    return kind_names[kind];
}

static void add(struct record_events *record, struct record_mark mark) {
    if (record->count < RECORD_EVENTS_KEPT)
        record->list[record->count] = mark;
    record->count++;
}

/* The contact of an event, negative if the event is of no contact. */
static int contact_of(const struct refdyn_model *model, int event) {
    return model->events[event].contact - 1 - refdyn_programme_rows(model);
}

/* Modes change at the beginning of steps. A contact may rest and open again between two calls. A new start
 * opens contacts as well. */
static void take_modes(struct record_events *record, const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    record->lacks_forces |= !integrator->forces_are_unique;
    for (int i = 0; i < model->event_count; i++) {
        const int k = contact_of(model, i);
        if (k < 0)
            continue;
        const double left = integrator->contact_left[k];
        const bool was_free = record->modes[k] == REFDYN_CONTACT_FREE;
        const bool is_free = integrator->contact_mode[k] == REFDYN_CONTACT_FREE;
        const bool has_left = !isnan(left) && left != record->left[k];
        if (was_free && (has_left || !is_free))
            add(record, (struct record_mark){i, RECORD_RESTS, integrator->contact_since[k]});
        if (has_left || (is_free && !was_free))
            add(record, (struct record_mark){i, RECORD_LEAVES, has_left ? left : record->t_last});
        record->modes[k] = integrator->contact_mode[k];
        record->left[k] = left;
    }
}

/* Records an event that is due, but for samples. If its contact is closed, its mode changes instead, which
 * take_modes records. */
static void take_due(struct record_events *record, const struct refdyn_integrator *integrator, int event) {
    const struct refdyn_model *model = integrator->work->model;
    const int k = contact_of(model, event);
    const struct record_mark mark = {event, k < 0 ? RECORD_EVENT : RECORD_IMPACT, integrator->t};
    if (model->events[event].contact < 0)
        return;
    if (k < 0 || integrator->contact_mode[k] == REFDYN_CONTACT_FREE)
        add(record, mark);
    if (model->events[event].ends && !record->has_ended) {
        record->has_ended = true;
        record->end = mark;
    }
}

int record_events_take(struct record_events *record, const struct refdyn_integrator *integrator, int status) {
    if (status != REFDYN_OK && status != REFDYN_EVENT_ENDS)
        return status;
    if (integrator->contact_count > 0)
        take_modes(record, integrator);
    for (int k = 0; k < integrator->event_count; k++)
        take_due(record, integrator, integrator->event[k]);
    record->t_last = integrator->t;
    return REFDYN_OK;
}

void record_events_resume(struct record_events *record) {
    record->has_ended = false;
}

static void print_mark(const struct record_mark *mark, const struct refdyn_model *model, FILE *out) {
    fprintf(out, " %s%s%s at t = %.9g s", model->events[mark->event].name,
            mark->kind == RECORD_EVENT || mark->kind == RECORD_IMPACT ? "" : " ",
            mark->kind == RECORD_IMPACT ? "" : kind_names[mark->kind], mark->t);
}

void record_events_print(const struct record_events *record, const struct refdyn_model *model, FILE *out) {
    char text[RECORD_NUMBER_LENGTH];
    if (model->event_count == 0)
        return;
    fprintf(out, "events       %ld%s", record->count, record->count > 0 ? ":" : "");
    for (long i = 0; i < record->count && i < LISTED_MOST; i++) {
        fputs(i ? "," : "", out);
        print_mark(&record->list[i], model, out);
    }
    fputs(record->count > LISTED_MOST ? ", ...\n" : "\n", out);
    if (record->lacks_forces)
        fputs("contacts     more are closed than bodies can move, so that their forces are not unique\n",
              out);
    if (record->has_ended)
        fprintf(out, "ended        by %s at t = %s s\n", model->events[record->end.event].name,
                record_number(record->end.t, text));
}

static void put_mark(const struct record_mark *mark, const struct refdyn_model *model, const char *key,
                     const struct record_writer *writer) {
    writer->open(writer->context, key, '{');
    writer->text(writer->context, "event", model->events[mark->event].name);
    writer->number(writer->context, "t", mark->t);
    if (mark->kind != RECORD_EVENT)
        writer->text(writer->context, "contact", kind_names[mark->kind]);
    writer->close(writer->context, '}');
}

void record_events_put(const struct record_events *record, const struct refdyn_model *model,
                       const struct record_writer *writer) {
    if (model->event_count == 0)
        return;
    writer->number(writer->context, "event_count", (double)record->count);
    writer->open(writer->context, "events", '[');
    for (long i = 0; i < record->count && i < RECORD_EVENTS_KEPT; i++)
        put_mark(&record->list[i], model, NULL, writer);
    writer->close(writer->context, ']');
    if (record->has_ended)
        put_mark(&record->end, model, "ended", writer);
}

/* ---- Two motions ---- */

static long kept(const struct record_events *record) {
    return record->count < RECORD_EVENTS_KEPT ? record->count : RECORD_EVENTS_KEPT;
}

/* Up to when all events are in the list. */
static double known_until(const struct record_events *record) {
    return record->count > RECORD_EVENTS_KEPT ? record->list[RECORD_EVENTS_KEPT - 1].t : INFINITY;
}

static bool is_alike(const struct record_mark *a, const struct record_mark *b) {
    return a->event == b->event && a->kind == b->kind;
}

/* Has `other` a mark for mark i, within `most` of its time? Each mark of `other` counts for one. */
static bool has_counterpart(const struct record_events *record, long i, const struct record_events *other,
                            double most) {
    const struct record_mark *mark = &record->list[i];
    bool is_met = false;
    for (long j = 0, k = 0; j <= i; j++) {
        const double t = record->list[j].t;
        if (!is_alike(&record->list[j], mark))
            continue;
        while (k < kept(other) && !(is_alike(&other->list[k], mark) && other->list[k].t >= t - most))
            k++;
        is_met = k < kept(other) && other->list[k].t <= t + most;
        k += is_met;
    }
    return is_met;
}

/* Is it one of the last rebounds, which `other` has summed up because they are smaller than its errors? */
static bool is_summed_up(const struct record_mark *mark, const struct record_events *other, double most) {
    double rests = INFINITY, rebounds = INFINITY;
    for (long k = 0; k < kept(other) && mark->kind == RECORD_IMPACT; k++) {
        const struct record_mark *next = &other->list[k];
        if (next->event == mark->event && next->kind == RECORD_RESTS && next->t >= mark->t - most)
            rests = fmin(rests, next->t);
        if (is_alike(next, mark) && next->t > mark->t + most)
            rebounds = fmin(rebounds, next->t);
    }
    return rests < rebounds;
}

/* The first mark of `record` before `end` that `other` does not have, if it is before that of `first`. */
static void find_difference(const struct record_events *record, const struct record_events *other, double end,
                            double most, bool is_of_other, struct record_difference *first) {
    for (long i = 0; i < kept(record); i++) {
        const struct record_mark mark = record->list[i];
        const bool is_first = mark.t < end && !(first->exists && first->mark.t <= mark.t);
        if (is_first && !has_counterpart(record, i, other, most) && !is_summed_up(&mark, other, most))
            *first = (struct record_difference){true, is_of_other, mark};
    }
}

struct record_difference record_events_compare(const struct record_events *events,
                                               const struct record_events *other, double end, double most) {
    const double until = fmin(end, fmin(known_until(events), known_until(other))) - most;
    struct record_difference first = {.exists = false};
    find_difference(events, other, until, most, false, &first);
    find_difference(other, events, until, most, true, &first);
    return first;
}

void record_difference_print(const struct record_difference *difference, const struct refdyn_model *model,
                             FILE *out) {
    print_mark(&difference->mark, model, out);
}

void record_difference_put(const struct record_difference *difference, const struct refdyn_model *model,
                           const struct record_writer *writer) {
    put_mark(&difference->mark, model, "events_differ", writer);
}

void record_events_print_refused(const struct refdyn_integrator *integrator, const char *fact, FILE *out) {
    const struct refdyn_model *model = integrator->work->model;
    char t[RECORD_NUMBER_LENGTH];
    fprintf(out, "refdyn: %s: t = %s s: the event ", model->name, record_number(integrator->t, t));
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(out, "%s%s", k ? ", " : "", model->events[integrator->event[k]].name);
    fprintf(out, ": %s\n", fact);
}

void record_events_print_failed(const struct refdyn_integrator *integrator, FILE *out) {
    const struct refdyn_model *model = integrator->work->model;
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(out, "%s%s", k ? ", " : "refdyn: at the event ", model->events[integrator->event[k]].name);
    if (integrator->event_count > 0)
        fputs("\n", out);
}
