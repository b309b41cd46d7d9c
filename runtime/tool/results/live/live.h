/* Live pages: a model as an HTML page that computes its motions itself, in WebAssembly. Parts: the texts in C
 * that the module has for this model; the module; the page. module/ has the sources of the module, page/ the
 * scripts. */
#ifndef REFDYN_TOOL_LIVE_H
#define REFDYN_TOOL_LIVE_H

#include <stdio.h>

#include "runtime/tool/results/view/view.h"
#include "runtime/tool/scene/scene.h"

/* One structure of a live page while it is written: the model with one choice of --options. */
struct live {
    const struct options *options;
    struct scene scene; /* compiled, with the parameters and inputs of --set */
    struct scene drawn; /* read again with the same options: its graph may still grow */
    struct drawn_tape tape;
    struct applied_force *forces; /* (force_count) those that a state determines */
    int force_count;
    struct programme_curve *curves; /* (curve_count) */
    int curve_count;
};

/* Finds the forces that coordinates, rates, points of interest, inputs, parameters and time determine. */
void live_find_forces(struct live *live);
/* Finds the curves of the programme. */
void live_find_curves(struct live *live);
/* Writes the C of `live_model` (module/live_module.h). */
void live_model_put(FILE *out, const struct live *live);

/* Compiles the module, or takes it from the cache. Returns its bytes in heap memory; NULL after a reported
 * error. */
char *live_module_make(const struct live *live, size_t *size);

/* Range of a slider, as --range states it. */
struct live_range {
    const char *name; /* of a parameter, an input, or a start value: NAME or NAME_d of a coordinate */
    double from, to;
};

/* Writes the data of the page as JSON, and fills the tape. Ranges end with a name NULL. */
void live_data_put(FILE *out, struct live *live, const struct live_range *ranges);
/* Returns whether the model has a slider of that name. */
bool live_has_slider(const struct live *live, const char *name);

/* The number of inputs of a hand that pulls points, the last of the model: 0 without --pull. */
int live_hand_inputs(const struct live *live);
/* Returns whether the model has an option of that name. */
bool live_has_option(const struct model *model, const char *name);

extern const struct command view_command;

#endif
