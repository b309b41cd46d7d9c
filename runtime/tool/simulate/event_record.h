/* The events of a motion, in order: what summaries tell of them. */
#ifndef REFDYN_TOOL_EVENT_RECORD_H
#define REFDYN_TOOL_EVENT_RECORD_H

#include "refdyn.h"
#include "text/output.h"

#include <stdbool.h>

struct event_mark {
    int event; /* of the model */
    double t;  /* [s] */
};

struct event_record {
    struct event_mark *list;
    long count, room;
    bool has_ended; /* the last one ended the motion */
};

/* What a call of refdyn_integrator_step has stopped at; the status of that call, 0 in place of EVENT_ENDS. */
int events_take(struct event_record *record, const struct refdyn_integrator *integrator, int status);
void events_release(struct event_record *record);
/* Lines and members of a summary; none where the model has no events. */
void events_print(const struct event_record *record, const struct refdyn_model *model);
void events_put(const struct event_record *record, const struct refdyn_model *model,
                struct document *document);
/* On stderr: the events at which a motion stands, and what the model refuses of what they set. */
void events_print_refused(const struct refdyn_integrator *integrator, const char *fact);
/* Where a motion has failed at events: which. */
void events_print_failed(const struct refdyn_integrator *integrator);

#endif
