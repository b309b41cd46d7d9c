/* What this folder offers. */
#ifndef REFDYN_TOOL_REPORT_H
#define REFDYN_TOOL_REPORT_H

#include "runtime/tool/motions/simulate/simulate.h"

/*
 * Error against run time: the runs of one scene with any of the methods, over tolerances or steps, judged by
 * a reference that two methods agree on.
 */

enum {
    SETTINGS_MAX = 24,
    HALVINGS_MAX = 26 /* of the time between outputs */,
    SERIES_MAX = REFDYN_METHOD_COUNT * STABILISE_COUNT,
    REFERENCES = 2
};

/* Tolerances or steps, descending. */
struct settings {
    double list[HALVINGS_MAX];
    int count;
    bool are_given; /* else a series ends where the next one tells nothing */
};

/* What is to be run. */
struct study_plan {
    bool methods[REFDYN_METHOD_COUNT];
    struct settings tols, steps;
    double until, every; /* [s] */
};

/* One run: at a tolerance (step is 0), or at a fixed step (tol is 0). */
struct method_run {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    double tol, step;
    int result, cause;  /* statuses of the runtime, or MOTION_...; cause: of what the steps shrank for */
    double stopped_t;   /* where it ended [s] */
    double error;       /* largest distance from the reference over the outputs; NaN when it failed */
    double cpu_s;       /* least of its repetitions; of one that was too slow: expected to the end [s] */
    double cpu_limit_s; /* what it was given [s] */
    double phi_max, psi_max, energy_error;
    long steps, rejected, evaluations, tangents;
};

/* Runs of one method and stabilisation, from the loosest setting on. Behind one that is too slow none
 * follows. */
struct series {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    bool is_fixed; /* settings are steps, otherwise tolerances */
    struct method_run trials[SETTINGS_MAX];
    int count;
    int next;     /* setting to be run */
    bool is_over; /* no further one */
};

struct study {
    const char *name; /* "n_rfe=4", or the model's name */
    char *facts;      /* of the scene, as HTML */
    struct series series[SERIES_MAX];
    int series_count;
    struct method_run references[REFERENCES]; /* errors are distances from the first one */
    int reference_count;                      /* that were found */
    double from;                              /* start of the motion [s] */
    double floor;                             /* their distance: no error below it is claimed */
    double way;                               /* how far the motion gets from its start */
    long outputs;                             /* times at which runs are compared */
    bool has_points;                          /* errors are those of points, else those of coordinates */
};

/* Runs all within about `seconds`; an interrupt ends it early. Returns STATUS_DONE also when runs failed,
 * STATUS_NUMBERS when no two methods came to the end for a reference. */
enum status report_study_run(struct study *study, const struct study_plan *plan, struct scene *scene,
                             double seconds);
/* The run came to the end. */
bool report_is_done(const struct method_run *trial);
/* The two references are the same motion: nearer than 5 % of the way. */
bool report_has_reference(const struct study *study);
/* It came to the end near the reference: within 5 % of the way. */
bool report_is_settled(const struct study *study, const struct method_run *trial);

/*
 * What the runs of a study say: of its reference in sentences, of each method in a row of a table.
 */

/* "rk4", "rk4, baumgarte": the stabilisation where the method has several. */
const char *report_series_name(const struct study *study, const struct series *series);
/* "tolerance 1e-06" or "step 0.001 s". */
const char *report_trial_setting(const struct method_run *trial);
/* "done", or where the run stopped and why. */
const char *report_trial_outcome(const struct method_run *trial);
/* Unit of errors. */
const char *report_study_unit(const struct study *study);

/* What errors are measured against. */
const char *report_findings_reference(const struct study *study);

enum {
    LEVEL_COUNT = 3,
    FINDING_COLUMNS = 5 + LEVEL_COUNT /* method, CPU times, slope, least error, limit of stability, stops */
};

/* What the table's times are, for a line below it. */
extern const char report_findings_note[];

/* What is in a column of the table for a series, or NULL: the column's head. */
const char *report_findings_cell(const struct study *study, const struct series *series, int column);

/*
 * What a report draws and writes of its studies: error over run time as a figure, a chart for each study and
 * one line a method and stabilisation; facts, findings, figure and all runs as one HTML file that needs no
 * other.
 */

/* What was computed: model, options, start, parameters; part of the page, in heap memory. */
char *report_page_facts(const struct scene *scene, const struct options *options,
                        const struct study_plan *plan);
/* The text of the figure, an SVG file, goes to `out`. */
void report_diagram_draw(FILE *out, const char *title, const struct study *studies, int count);
/* The whole page; the figure is the text of an SVG file. */
void report_page_write(FILE *out, const char *title, const struct study *studies, int count,
                       const char *figure);

extern const struct command report_command;

#endif
