/* The module of a live page: what the program emits for one model; the motion and its drawing. */
#ifndef REFDYN_TOOL_LIVE_MODULE_H
#define REFDYN_TOOL_LIVE_MODULE_H

#include <stdbool.h>

#include "refdyn.h"
#include "runtime/record/record.h"
#include "runtime/tool/results/view/drawn_shapes.h"

/* A parameter that the drawing reads. */
struct live_parameter {
    const char *name;
    double value; /* if the model's functions do not read it, so that it cannot change */
};

/* A curve on which the programme keeps a point, in two of its components. */
struct live_curve {
    int point, axes[2];
};

/* One model. The functions read the values of `parameters`, in their order. */
struct live_model {
    const struct refdyn_model *model;
    const struct refdyn_spatial *spatial; /* NULL if no point has angular columns */
    const struct live_parameter *parameters;
    int parameter_count;
    /* Numbers of the drawn model, as drawn_model.c prints them. Those of shapes are consecutive. */
    int number_count, shape_start;
    int shape_count;
    const int *shape_places; /* (shape_count) places of a solid; -1: an element of a beam */
    void (*numbers)(const double *parameters, double *out);
    /* Forces and torques at a state: parts of the applied forces, one after another. */
    int applied_count;
    void (*applied)(const double *parameters, const double *x, double t, const double *q, const double *qd,
                    const double *r, const double *rd, double *out);
    int hand_input_count; /* inputs of the hand, the last of the model; they have no columns */
    const char *const *requirement_places; /* (requirement_count) "FILE:LINE" */
    /* (m x anchored_count) non-zero: the row reads this anchored parameter from the start of the motion, so
     * that it holds in statics only if the parameter is given. */
    const int *row_waits;
    const struct live_curve *curves;
    int curve_count;
    /* (curve_count) at the positions r of the points */
    void (*curve_residuals)(const double *parameters, const double *r, double *out);
};

extern const struct live_model live_model;

/* ---- The motion ---- */

#ifdef __wasm__
#define EXPORT(name) __attribute__((export_name(#name)))
#else
#define EXPORT(name) /* compiled with the program, so that the compiler checks it */
#endif

enum {
    LIVE_SHAPE_NUMBERS = 14, /* kind (-1: none), bore, axes, origin */
    LIVE_FACTS = 6,
    LIVE_SHARE = 5 /* place of the share among the facts */
};

/* Memory of one motion. */
struct block {
    struct block *next;
    double data[]; /* aligned for all types in use */
};

/* A hand that pulls a point. */
struct live_pull {
    int point;   /* of interest; -1: none */
    double from; /* time from which on it pulls [s] */
    double hand[3];
    double mass; /* that the point feels at the start [kg] */
    bool is_released;
};

struct live {
    struct refdyn_samples samples; /* the first member: refdyn_samples_set gets its address */
    struct live_pull pull;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct record_motion record;
    struct refdyn_statics_options statics;
    struct refdyn_statics_result equilibrium; /* its start, if has_equilibrium */
    bool has_equilibrium;
    int *held;
    double *hold_force;
    struct record_table table;
    struct block *blocks;
    double *defaults;          /* (parameters) as the model has them, then the inputs */
    double *start, *q, *qd;    /* start: (2 n) values of the caller; q, qd: the start in use */
    int *start_given, *given;  /* (2 n) non-zero: start has the value; (anchored_count) keep the parameter */
    double *parameters;        /* of the drawing */
    double *numbers, *applied; /* of the drawing; (rows x applied_count) */
    double *points;            /* (2 x points x 3) positions and velocities */
    double *rows;              /* (room x columns) */
    long row_count, room, output;
    const char *unfit;
    struct drawn_curve curve;
    double places[DRAWN_CURVE_PLACES][DRAWN_CURVE_AXES];
    double *residuals;   /* (curve_count) */
    char *start_message; /* warnings of its start */
    char *message;       /* of the last motion, "" if there is none */
    size_t text_size;    /* of the one that is being written */
    double facts[LIVE_FACTS];
    struct refdyn_options finer; /* of a motion that repeats the last one */
    double *modes;               /* of live_find_modes */
};

/* Zeroed memory until the next motion begins. */
void *live_get_block(void *live, size_t size);
void live_release_blocks(struct live *live);
/* Ends the motion, and sets q and qd to the equilibrium for the values of the page. Returns a status of the
 * runtime. */
int live_set_equilibrium(struct live *live);
void live_clear_message(struct live *live);
/* Writes into live->message why there is no start. */
void live_explain_start(struct live *live, int status);

/* Lets go, and prepares the planned pull. Call it when q and qd are the start. */
void live_start_pull(struct live *live);
/* Sets the inputs of the hand from t on; returns the time of the next sample [s]. */
double live_sample_pull(struct live *live, double t, double *x);
/* The columns of a row, and those that precede the inputs of the hand in the table. */
int live_column_count(struct live *live);
int live_columns_before_hand(const struct live *live);
/* Computes the drawn model from the parameters. Call it after the start. */
void live_draw(struct live *live);
/* Computes the applied forces at the integrator's state, for the row that follows the present ones. */
void live_add_applied(struct live *live);

#endif
