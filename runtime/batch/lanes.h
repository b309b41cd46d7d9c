/*
 * Explicit steps of several motions side by side, one in each lane of vectors.
 *
 * Takes motions that have halted at such a step (motion/lockstep.h) and the functions for lanes that were
 * emitted for their model; gives each motion the step's end, its error and where they are wanted its rates,
 * to the bit what it would have found itself. Widths are 2, 4 and 8; the wider ones are compiled for
 * processors that have such vectors, and run on these alone.
 */
#ifndef REFDYN_BATCH_LANES_H
#define REFDYN_BATCH_LANES_H

#include "refdyn_lanes.h"

#include "motion/motion.h"

/* The widest that this processor's vectors hold: 2, 4 or 8. */
int refdyn_lanes_widest(void);

/* One step of a motion, to be taken. */
struct lane_step {
    struct refdyn_step *step; /* NULL: the lane rests */
    const double *p, *x;      /* its parameters and inputs, */
    int is_new;               /* which have changed since its last step */
    double h, t_new;
    int needs_stages; /* a state inside of the step will be asked for */
    int is_taken;     /* behind lanes_take: it is; otherwise its numbers are not finite */
};

struct lanes {
    const struct refdyn_lane_model *model;
    double *memory; /* one block */
    double *p, *x, *t, *state, *rates, *state_new, *rates_new, *stage, *side, *error, *stages;
};

/* Room for all explicit methods. REFDYN_OK, FUNCTION_MISSING where no function for lanes gives accelerations,
 * OTHER_VERSION, BAD_MEMORY; lanes_release in any case. */
int refdyn_lanes_start(struct lanes *lanes, const struct refdyn_lane_model *model);
/* Takes the steps (width), each lane always of the same motion, all by one method. */
void refdyn_lanes_take(struct lanes *lanes, struct lane_step *steps);
void refdyn_lanes_release(struct lanes *lanes);

/* ---- lanes_2.c, lanes_4.c ...: refdyn_lanes_take of their width; apart: for processors without such
 * vectors, which the compiler takes apart. ---- */
typedef void lanes_take(struct lanes *lanes, struct lane_step *steps);
lanes_take refdyn_lanes_take_2, refdyn_lanes_take_4, refdyn_lanes_take_8, refdyn_lanes_take_4_apart,
    refdyn_lanes_take_8_apart;

#endif
