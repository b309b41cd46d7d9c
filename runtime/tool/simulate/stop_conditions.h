/*
 * Conditions that end a motion, NAME<VALUE or NAME>VALUE with NAME a column of the CSV: the time at which the
 * first of them holds.
 *
 * Takes the texts of --stop and an integrator; moves the integrator to that time. What holds between two
 * accepted states, but at neither of them nor at an output between, is not seen.
 */
#ifndef REFDYN_TOOL_STOP_CONDITIONS_H
#define REFDYN_TOOL_STOP_CONDITIONS_H

#include "command_line/options.h"
#include "simulate/motion_table.h"

struct stop {
    const char *text; /* as given */
    int column;
    bool is_below; /* '<' */
    double value;
};

struct stops {
    struct stop *list;
    int count;
    struct table table; /* of the integrator that is watched */
    struct refdyn_integrator *integrator;
    const struct stop *reached; /* NULL: none yet */
    double t;                   /* when it was [s] */
};

/* Complains as usage errors are. */
enum status stops_read(struct stops *stops, const struct options *options,
                       struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial);
/* Does one of them hold at the integration's state? Then it is the one that was reached. */
bool stops_hold(struct stops *stops);
/* None held at t_before, inside the last step or at its begin: when one holds now, moves the integrator back
 * to the first time at which one does. Returns a status of the runtime. */
int stops_meet(struct stops *stops, double t_before);

#endif
