/* Report: error against run time of all methods for one scene. Parts: study, the runs and their reference;
 * findings, what the runs show; figure and HTML page. */
#ifndef REFDYN_TOOL_REPORT_H
#define REFDYN_TOOL_REPORT_H

#include "runtime/tool/motions/simulate/simulate.h"

/* Study: runs of one scene with several methods over tolerances or steps. A reference on which two methods
 * agree measures their errors. */

enum {
    SETTINGS_MAX = 24,
    HALVINGS_MAX = 26 /* halvings of the time between outputs */,
    SERIES_MAX = REFDYN_METHOD_COUNT * RECORD_STABILISE_COUNT,
    REFERENCES = 2
};

/* Tolerances or steps, descending. */
struct settings {
    double list[HALVINGS_MAX];
    int count;
    bool are_given; /* otherwise a series ends when the next setting gains nothing */
};

struct study_plan {
    bool methods[REFDYN_METHOD_COUNT];
    struct settings tols, steps;
    double until, every; /* [s] */
};

/* One run at a tolerance (step is 0) or at a fixed step (tol is 0). */
struct method_run {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    double tol, step;
    int result, cause;  /* statuses of the runtime or MOTION_...; cause: why the steps became shorter */
    double stopped_t;   /* time at which it ended [s] */
    double error;       /* largest distance from the reference over the outputs; NaN if the run failed */
    double cpu_s;       /* shortest of its repetitions; for a run that was too slow, the expected total [s] */
    double cpu_limit_s; /* its limit [s] */
    double phi_max, psi_max, energy_error;
    long steps, rejected, evaluations, tangents;
};

/* Runs of one method and stabilisation, from the loosest setting on. A run that is too slow is the last. */
struct series {
    enum refdyn_method method;
    enum refdyn_stabilise stabilise;
    bool is_fixed; /* the settings are steps, otherwise tolerances */
    struct method_run trials[SETTINGS_MAX];
    int count;
    int next;     /* the next setting to run */
    bool is_over; /* no setting is left to run */
};

struct study {
    const char *name; /* "n_rfe=4", or the model's name */
    char *facts;      /* about the scene, as HTML by report_page_facts */
    struct series series[SERIES_MAX];
    int series_count;
    struct method_run references[REFERENCES]; /* errors are distances from the first */
    int reference_count;                      /* how many were found */
    double from;                              /* start of the motion [s] */
    double floor;                             /* distance of the references; smaller errors are not claimed */
    double way;                               /* largest distance of the motion from its start */
    long outputs;                             /* times at which runs are compared */
    bool has_points;                          /* errors are of points, otherwise of coordinates */
};

/* Runs everything within about `seconds`; an interrupt ends it early. Returns STATUS_DONE even if runs
 * failed, and STATUS_NUMBERS if fewer than two methods completed the motion for a reference. */
enum status report_study_run(struct study *study, const struct study_plan *plan, struct scene *scene,
                             double seconds);
/* Returns whether the run completed the motion. */
bool report_is_done(const struct method_run *trial);
/* Returns whether both references are the same motion, within 5 % of the way. */
bool report_has_reference(const struct study *study);
/* Returns whether the run completed the motion within 5 % of the way from the reference. */
bool report_is_settled(const struct study *study, const struct method_run *trial);

/* Findings: sentences about the reference, and a row of a table for each method. */

/* "done", or when and why the run stopped. */
const char *report_trial_outcome(const struct method_run *trial);
/* Describes the reference. */
const char *report_findings_reference(const struct study *study);

/* method, CPU times, slope, least error, limit of stability, stops */
enum { LEVEL_COUNT = 3, FINDING_COLUMNS = 5 + LEVEL_COUNT };

/* A line below the table that explains its times. */
extern const char report_findings_note[];

/* The cell of a series in a column of the table; the head of the column if series is NULL. */
const char *report_findings_cell(const struct study *study, const struct series *series, int column);

/* Page: the figure of error over run time, with a chart for each study; and one HTML file with facts,
 * findings, figure and all runs. */

/* The part of the page about model, options, start and parameters, in heap memory. */
char *report_page_facts(const struct scene *scene, const struct options *options,
                        const struct study_plan *plan);
/* Writes the text of the figure, an SVG file, to `out`. */
void report_diagram_draw(FILE *out, const char *title, const struct study *studies, int count);
/* Writes the page; `figure` is the text of an SVG file. */
void report_page_write(FILE *out, const char *title, const struct study *studies, int count,
                       const char *figure);

extern const struct command report_command;

#endif
