/* The events of a motion, in order, for summaries. Events of contacts are impacts, coming to rest, and
 * leaving. */
#ifndef REFDYN_TOOL_EVENT_RECORD_H
#define REFDYN_TOOL_EVENT_RECORD_H

#include "refdyn.h"
#include "text/output.h"

#include <stdbool.h>

enum event_kind { EVENT_PLAIN, EVENT_IMPACT, EVENT_RESTS, EVENT_LEAVES };

struct event_mark {
    int event; /* of the model */
    enum event_kind kind;
    double t; /* of a rest: the end of all rebounds [s] */
};

enum { EVENTS_KEPT = 500 }; /* the first ones; the rest is counted */

struct event_record {
    struct event_mark *list; /* (EVENTS_KEPT) NULL before the first event */
    long count;              /* of all events */
    bool has_ended;          /* by the event `end` */
    struct event_mark end;
    int *modes;        /* (contact_count) of the contacts at the last look, NULL: none yet */
    double t_last;     /* of the last look [s] */
    bool lacks_forces; /* at times the forces of contacts were not unique */
};

/* What a call of refdyn_integrator_step has stopped at; the status of that call, 0 in place of EVENT_ENDS. */
int events_take(struct event_record *record, const struct refdyn_integrator *integrator, int status);
void events_release(struct event_record *record);
/* Lines and members of a summary; none where the model has no events. */
void events_print(const struct event_record *record, const struct refdyn_model *model);
void events_put(const struct event_record *record, const struct refdyn_model *model,
                struct document *document);
/* On stderr: the events at which a motion stands, and the value among those they set that the model refuses.
 */
void events_print_refused(const struct refdyn_integrator *integrator, const char *fact);
/* Where a motion has failed at events: which. */
void events_print_failed(const struct refdyn_integrator *integrator);

#endif
