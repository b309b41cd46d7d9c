/* Records the events of a motion, and writes them into summaries and messages. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "gen/base/base.h"

#include <stdlib.h>

enum {
    EVENTS_KEPT = 500, /* the first events; further ones are only counted */
    LISTED_MOST = 8    /* events listed in the text of a summary */
};

/* Events of contacts are impact, rest and release. */
enum event_kind { EVENT_PLAIN, EVENT_IMPACT, EVENT_RESTS, EVENT_LEAVES };

struct event_mark {
    int event; /* of the model */
    enum event_kind kind;
    double t; /* time; for a rest, the end of all rebounds [s] */
};

struct event_record {
    struct event_mark *list; /* (EVENTS_KEPT), NULL before the first event */
    long count;              /* of all events */
    bool has_ended;          /* by the event `end` */
    struct event_mark end;
    int *modes;        /* (contact_count) modes of the contacts at the last call, NULL before the first */
    double t_last;     /* time of the last call [s] */
    bool lacks_forces; /* the forces of contacts were not unique at some time */
};

struct event_record *simulate_events_start(void) {
    return format_allocate_large(1, sizeof(struct event_record));
}

bool simulate_events_have_ended(const struct event_record *record) {
    return record->has_ended;
}

static const char *const kind_names[] = {"", "impact", "rests", "leaves"};

static void add(struct event_record *record, struct event_mark mark) {
    if (!record->list)
        record->list = format_allocate_large(EVENTS_KEPT, sizeof *record->list);
    if (record->count < EVENTS_KEPT)
        record->list[record->count] = mark;
    record->count++;
}

/* The contact of an event, negative if the event is of no contact. */
static int contact_of(const struct refdyn_model *model, int event) {
    return model->events[event].contact - 1 - refdyn_programme_rows(model);
}

/* Modes change at the beginning of a call, at the time at which the last call stopped. */
static void take_modes(struct event_record *record, const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    if (!record->modes)
        record->modes = format_allocate_large((size_t)integrator->contact_count, sizeof *record->modes);
    record->lacks_forces |= !integrator->forces_are_unique;
    for (int i = 0; i < model->event_count; i++) {
        const int k = contact_of(model, i);
        if (k < 0)
            continue;
        const int was_free = record->modes[k] == REFDYN_CONTACT_FREE;
        const int is_free = integrator->contact_mode[k] == REFDYN_CONTACT_FREE;
        if (was_free && !is_free)
            add(record, (struct event_mark){i, EVENT_RESTS, integrator->contact_since[k]});
        else if (is_free && !was_free)
            add(record, (struct event_mark){i, EVENT_LEAVES, record->t_last});
        record->modes[k] = integrator->contact_mode[k];
    }
}

/* Records an event that is due. If its contact is closed, its mode changes instead, which take_modes records.
 */
static void take_due(struct event_record *record, const struct refdyn_integrator *integrator, int event) {
    const struct refdyn_model *model = integrator->work->model;
    const int k = contact_of(model, event);
    const struct event_mark mark = {event, k < 0 ? EVENT_PLAIN : EVENT_IMPACT, integrator->t};
    if (k < 0 || integrator->contact_mode[k] == REFDYN_CONTACT_FREE)
        add(record, mark);
    if (model->events[event].ends && !record->has_ended) {
        record->has_ended = true;
        record->end = mark;
    }
}

int simulate_events_take(struct event_record *record, const struct refdyn_integrator *integrator,
                         int status) {
    if (status != REFDYN_OK && status != REFDYN_EVENT_ENDS)
        return status;
    if (integrator->contact_count > 0)
        take_modes(record, integrator);
    for (int k = 0; k < integrator->event_count; k++)
        take_due(record, integrator, integrator->event[k]);
    record->t_last = integrator->t;
    return REFDYN_OK;
}

void simulate_events_release(struct event_record *record) {
    if (record) {
        free(record->list);
        free(record->modes);
    }
    free(record);
}

static void print_mark(const struct event_mark *mark, const struct refdyn_model *model) {
    fprintf(stderr, " %s%s%s at t = %.9g s", model->events[mark->event].name,
            mark->kind == EVENT_PLAIN || mark->kind == EVENT_IMPACT ? "" : " ",
            mark->kind == EVENT_IMPACT ? "" : kind_names[mark->kind], mark->t);
}

void simulate_events_print(const struct event_record *record, const struct refdyn_model *model) {
    char text[NUMBER_LENGTH];
    if (model->event_count == 0)
        return;
    fprintf(stderr, "events       %ld%s", record->count, record->count > 0 ? ":" : "");
    for (long i = 0; i < record->count && i < LISTED_MOST; i++) {
        fputs(i ? "," : "", stderr);
        print_mark(&record->list[i], model);
    }
    fputs(record->count > LISTED_MOST ? ", ...\n" : "\n", stderr);
    if (record->lacks_forces)
        fputs("contacts     more are closed than bodies can move, so that their forces are not unique\n",
              stderr);
    if (record->has_ended)
        fprintf(stderr, "ended        by %s at t = %s s\n", model->events[record->end.event].name,
                exact_text(record->end.t, text));
}

static void put_mark(const struct event_mark *mark, const struct refdyn_model *model, const char *key,
                     struct document *document) {
    format_put_open(document, key, '{');
    format_put_text(document, "event", model->events[mark->event].name);
    format_put_number(document, "t", mark->t);
    if (mark->kind != EVENT_PLAIN)
        format_put_text(document, "contact", kind_names[mark->kind]);
    format_put_close(document, '}');
}

void simulate_events_put(const struct event_record *record, const struct refdyn_model *model,
                         struct document *document) {
    if (model->event_count == 0)
        return;
    format_put_number(document, "event_count", (double)record->count);
    format_put_open(document, "events", '[');
    for (long i = 0; i < record->count && i < EVENTS_KEPT; i++)
        put_mark(&record->list[i], model, NULL, document);
    format_put_close(document, ']');
    if (record->has_ended)
        put_mark(&record->end, model, "ended", document);
}

void simulate_events_print_refused(const struct refdyn_integrator *integrator, const char *fact) {
    const struct refdyn_model *model = integrator->work->model;
    char t[NUMBER_LENGTH];
    fprintf(stderr, "refdyn: %s: t = %s s: the event ", model->name, exact_text(integrator->t, t));
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(stderr, "%s%s", k ? ", " : "", model->events[integrator->event[k]].name);
    fprintf(stderr, ": %s\n", fact);
}

void simulate_events_print_failed(const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(stderr, "%s%s", k ? ", " : "refdyn: at the event ", model->events[integrator->event[k]].name);
    if (integrator->event_count > 0)
        fputs("\n", stderr);
}
