/*
 * What a batch keeps of its motions: the layout of the numbers of a case, and the recorder that fills them.
 *
 * Takes what the sweep wants to be kept and the models of all structures; gives the items of a runs file and
 * the times at which states are looked at. A recorder belongs to one thread and one structure: it takes the
 * states of a case one after the other.
 */
#ifndef REFDYN_TOOL_RECORDER_H
#define REFDYN_TOOL_RECORDER_H

#include "batch/keep.h"
#include "batch/runs_file.h"
#include "simulate/motion_table.h"

/* Times at which states are seen: number 0 is the start, the last the end. */
struct seen_times {
    int count;         /* with the start */
    const double *t;   /* (count) [s] */
    const int *output; /* (count) which output it is, -1: none */
    const int *at;     /* (count) which of keep.at, -1: none */
    int output_count;
};

enum kept_kind { KEPT_FINAL, KEPT_AT, KEPT_EXTREMES, KEPT_NORM, KEPT_HISTORY };

/* Items of a layout, and what each of them is. */
struct kept {
    struct seen_times times;
    enum kept_kind *kinds; /* (layout.item_count) */
    const char **columns;  /* (layout.item_count) names in the table of a motion */
};

/* The outputs of `every` from t to `until`, those of a 200th of the motion where it is 0 and something is
 * kept of them, and the times of keep->at. */
struct seen_times seen_times_make(struct memory *memory, const struct keep *keep, double t, double until,
                                  double every);

/* Adds items and axes for these models to the layout. False, with a complaint: a name of `keep` is no column
 * of any of them. */
bool kept_lay_out(struct memory *memory, const struct keep *keep, const struct refdyn_model *const *models,
                  int model_count, struct kept *kept, struct runs_layout *layout);

/* Can an HDF5 file have all names of `keep` in that layout? Complains about the first one that it cannot
 * have. */
bool kept_fits_hdf5(const struct keep *keep, const struct runs_layout *layout);

struct recorder {
    const struct kept *kept;
    const struct runs_layout *layout;
    struct table table;
    int *places;    /* (item_count) columns of the table, -1: this structure has none */
    double *values; /* (layout->width) of the case */
    double *before; /* (item_count) squares at the output before, of norms */
    double t_before;
    bool keeps_ends_alone;
};

void recorder_start(struct recorder *recorder, const struct kept *kept, const struct runs_layout *layout,
                    struct refdyn_integrator *integrator);
/* A case begins: nothing is known of it. */
void recorder_clear(struct recorder *recorder);
/* The state number `number` of seen times, as the integrator has it. */
void recorder_see(struct recorder *recorder, int number);
/* An event has ended the case at t: what is kept of its end, and of its whole way. */
void recorder_end(struct recorder *recorder, double t);
/* The case failed: what would be of its end or of its whole way is not known. */
void recorder_fail(struct recorder *recorder, double t);

#endif
