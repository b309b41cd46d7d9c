/*
 * The insides of an integrator: each struct is written by the file of its name alone.
 */
#ifndef REFDYN_MOTION_H
#define REFDYN_MOTION_H

#include "implicit/linearisation.h"
#include "methods/step.h"
#include "motion/parameters.h"
#include "motion/programme.h"
#include "motion/state_events.h"
#include "motion/step_control.h"
#include "motion/time_events.h"
#include "refdyn.h"

/* The automatic method: automatic_method.c. */
struct refdyn_automatic {
    struct refdyn_choice found;
    int chosen;                /* candidate that won the last trial, -1: none has ended yet */
    int at;                    /* candidate on trial, -1: no trial is on */
    enum refdyn_method next;   /* method of the next step */
    long steps_left, patience; /* until the trial of this candidate ends, or the next one begins */
    int wants_spectrum;
    double marked_t, marked_operations;
};

/* Through a state where the rows lose rank: singular_crossing.c. */
struct refdyn_singular_crossing {
    int is_on;                 /* the last step leads through such a state: by rk8, */
    enum refdyn_method before; /* instead of this method; */
    double *unpassed;          /* state and rates before, for when the step is refused, */
    double t;                  /* when the rows lose rank [s], */
    double gap;                /* distance of the nearest stage from that time, relative to the step */
    double stretch;    /* longest step through the state that the error should allow [s]; INFINITY: unknown */
    int count, *rows;  /* (m) independent rows, in the order of the model */
    double *distance;  /* (m) of each row from the span of those before it, for reference */
    int *first, *last; /* (n) first and last of these rows that have an entry in a column */
    struct refdyn_refused_crossing refused;
    struct refdyn_stage_guide guide;
};

/* Rows that fade out towards a time event: fading_rows.c. */
struct refdyn_fading {
    int is_on;                 /* the last step leads to such an event: by gauss12, */
    enum refdyn_method before; /* instead of this method */
    double t, looked;          /* event that was looked at last, from how far [s], */
    int is_known;              /* and rows fade out towards it, */
    int rank;                  /* which was this before */
    struct refdyn_stage_guide guide;
};

/* Residuals before a jump: row_changes.c. */
struct refdyn_residuals_before {
    double *phi, *psi; /* (m) */
    double *state;     /* (2 n) they belong to this state */
    int are_seen;      /* and the caller has seen it last */
};

/* The last failure of an evaluation or projection: accepted_step.c. */
struct refdyn_failure {
    int cause; /* 0: none */
    double t;  /* [s] */
};

struct refdyn_motion {
    struct refdyn_workspace *work;
    struct refdyn_options options;
    struct refdyn_parameters parameters;
    struct refdyn_linear linear;
    struct refdyn_step step;
    struct refdyn_step_control control;
    struct refdyn_time_events events;
    struct refdyn_state_events state_events;
    struct refdyn_programme programme;
    struct refdyn_automatic automatic;
    struct refdyn_singular_crossing crossing;
    struct refdyn_fading fading;
    struct refdyn_residuals_before before;
    struct refdyn_statistics statistics;
    struct refdyn_failure failure;
    int rows_change;         /* at the time event where the last step ended: row_changes.c */
    double t_final;          /* end of the motion, see refdyn_integrator_until [s] */
    double t_most;           /* no step reaches beyond, see refdyn_integrator_limit [s] */
    long evaluations_before; /* of the workspace, at the start */
};

#endif
