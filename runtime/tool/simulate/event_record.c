/* The events of a motion: see event_record.h. */
#include "simulate/event_record.h"
#include "base/memory.h"

#include <stdlib.h>

enum { LISTED_MOST = 8 }; /* in the text of a summary */

static void add(struct event_record *record, int event, double t) {
    if (record->count == record->room) {
        const long room = 2 * record->room + LISTED_MOST;
        struct event_mark *list = allocate_large((size_t)room, sizeof *list);
        for (long i = 0; i < record->count; i++)
            list[i] = record->list[i];
        free(record->list);
        record->list = list;
        record->room = room;
    }
    record->list[record->count++] = (struct event_mark){event, t};
}

int events_take(struct event_record *record, const struct refdyn_integrator *integrator, int status) {
    if (status != REFDYN_OK && status != REFDYN_EVENT_ENDS)
        return status;
    for (int k = 0; k < integrator->event_count; k++)
        add(record, integrator->event[k], integrator->t);
    record->has_ended = status == REFDYN_EVENT_ENDS;
    return REFDYN_OK;
}

void events_release(struct event_record *record) {
    free(record->list);
    *record = (struct event_record){.list = NULL};
}

/* The event that ended the motion: the first of those at its end that do so. */
static const struct event_mark *end_of(const struct event_record *record, const struct refdyn_model *model) {
    const struct event_mark *mark = &record->list[record->count - 1];
    while (!model->events[mark->event].ends)
        mark--;
    return mark;
}

void events_print(const struct event_record *record, const struct refdyn_model *model) {
    char text[NUMBER_LENGTH];
    if (model->event_count == 0)
        return;
    fprintf(stderr, "events       %ld%s", record->count, record->count > 0 ? ":" : "");
    for (long i = 0; i < record->count && i < LISTED_MOST; i++)
        fprintf(stderr, "%s %s at t = %.9g s", i ? "," : "", model->events[record->list[i].event].name,
                record->list[i].t);
    fputs(record->count > LISTED_MOST ? ", ...\n" : "\n", stderr);
    if (record->has_ended) {
        const struct event_mark *end = end_of(record, model);
        fprintf(stderr, "ended        by %s at t = %s s\n", model->events[end->event].name,
                exact_text(end->t, text));
    }
}

static void put_mark(const struct event_mark *mark, const struct refdyn_model *model, const char *key,
                     struct document *document) {
    put_open(document, key, '{');
    put_text(document, "event", model->events[mark->event].name);
    put_number(document, "t", mark->t);
    put_close(document, '}');
}

void events_put(const struct event_record *record, const struct refdyn_model *model,
                struct document *document) {
    if (model->event_count == 0)
        return;
    put_open(document, "events", '[');
    for (long i = 0; i < record->count; i++)
        put_mark(&record->list[i], model, NULL, document);
    put_close(document, ']');
    if (record->has_ended)
        put_mark(end_of(record, model), model, "ended", document);
}

void events_print_refused(const struct refdyn_integrator *integrator, const char *fact) {
    const struct refdyn_model *model = integrator->work->model;
    char t[NUMBER_LENGTH];
    fprintf(stderr, "refdyn: %s: t = %s s: the event ", model->name, exact_text(integrator->t, t));
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(stderr, "%s%s", k ? ", " : "", model->events[integrator->event[k]].name);
    fprintf(stderr, ": %s\n", fact);
}

void events_print_failed(const struct refdyn_integrator *integrator) {
    const struct refdyn_model *model = integrator->work->model;
    for (int k = 0; k < integrator->event_count; k++)
        fprintf(stderr, "%s%s", k ? ", " : "refdyn: at the event ", model->events[integrator->event[k]].name);
    if (integrator->event_count > 0)
        fputs("\n", stderr);
}
