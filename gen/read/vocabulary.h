/* Formulas that model files call by name: courses in time and sections of beams. */
#ifndef REFDYN_GEN_VOCABULARY_H
#define REFDYN_GEN_VOCABULARY_H

#include "graph/graph.h"

/* 0 before t0, 1 after t1, (1 - cos) / 2 between. */
expression vocabulary_ramp(struct graph *g, expression t, expression t0, expression t1);
/* 0 before t0, 1 after t1, 3 c^2 - 2 c^3 between. */
expression vocabulary_smoothstep(struct graph *g, expression t, expression t0, expression t1);

struct section {
    expression area, Iy, Iz, It; /* [m^2, m^4] */
};

struct section vocabulary_round_section(struct graph *g, expression diameter);
struct section vocabulary_tube_section(struct graph *g, expression outer, expression inner);
struct section vocabulary_rectangle_section(struct graph *g, expression width_y, expression height_z);

/* -level tanh(rate / width): dry friction, smooth within `width` of rest. */
expression vocabulary_friction(struct graph *g, expression level, expression rate, expression width);

#endif
