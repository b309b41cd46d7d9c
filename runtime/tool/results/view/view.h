/* View: motions as an HTML page in three dimensions, and a model as a picture. The parts of the page are
 * members of JSON, without outer brackets; the file that writes them lists them. view.c is the command and
 * writes the page; page/ has its style and scripts. */
#ifndef REFDYN_TOOL_VIEW_H
#define REFDYN_TOOL_VIEW_H

#include <stdio.h>

#include "gen/gen.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/results/view/drawn_shapes.h"

/* Rows at equal distances, and the last row. */
struct drawn_rows {
    double *values; /* (count x width), all columns of the run */
    long count, width;
};

/* share: the number of runs on the page. */
struct drawn_rows view_drawn_run_rows(const struct run *run, int share);
/* Writes rows, coordinates and courses of a run with the coordinates of the tree. */
void view_drawn_run_put(FILE *out, const struct run *run, const struct tree *tree,
                        const struct drawn_rows *rows);

/* Writes the limits of the model: columns and bounds, null where there is none. */
void view_bounds_put(FILE *out, const struct model *model);

/* An applied force: a drive has one formula, a force or torque at a point has three. */
struct applied_force {
    const char *name, *kind; /* kind: "drive", "force" or "torque" */
    struct fixed_frame at;
    const expression *values; /* (count) */
    int count;
};

/* By number from 0; false: there are no more. */
bool view_applied_force(const struct generation *generation, int number, struct applied_force *force);
/* Writes the applied forces along a run. */
void view_applied_forces_put(FILE *out, struct generation *generation, const struct run *run,
                             const struct drawn_rows *rows);

/* The expressions of the numbers of a drawn model, in the order in which they are printed. Those of shapes
 * are the numbers from which drawn_shapes.h computes them. */
struct drawn_tape {
    expression *list; /* (count) */
    int count, room;
    int shape_start; /* the first number of a shape; those of all shapes are consecutive */
    int *places;     /* (shape_count) places of a solid; -1: an element of a beam */
    int shape_count, shape_room;
};

/* Returns the value, and records the expression if tape is not NULL. */
double view_tape_value(struct drawn_tape *tape, const struct generation *generation, expression e);
/* Writes frames, shapes, points and closures, and records their expressions if tape is not NULL; then solids
 * without mass are written, too. */
void view_drawn_model_put(FILE *out, struct generation *generation, struct drawn_tape *tape);

/* Picture of a model as SVG: the tree of its links on the left; its rows and drives on the right, each with
 * lines to the links on which it acts. */
void view_model_drawing_put(FILE *out, struct generation *generation);

/* A curve on which a row of the programme keeps a point: its residual reads two components and parameters. */
struct programme_curve {
    expression residual;
    int point, axes[DRAWN_CURVE_AXES];
};

/* Returns whether the row defines a curve. */
bool view_programme_curve(struct generation *generation, int row, struct programme_curve *curve);
/* Writes the curves on which a programme keeps points. */
void view_programme_curves_put(FILE *out, struct generation *generation, const struct run *run);

/* Numbers in JSON, rounded to what a picture needs. Values that are not finite become 0, since no motion was
 * computed with them. */

/* A length, or another number with its own scale: seven digits. */
void view_put_length(FILE *out, double value);
/* An entry of a rotation, to 1e-8. */
void view_put_cosine(FILE *out, double value);

/* Viewed model: an HDF5 file carries the texts, options and parameters of its model; a CSV needs --model and
 * --set. In its graph the parameters are numbers, with the values of the motion. */
struct viewed_model {
    struct scene scene;    /* read, but not compiled */
    struct scratch folder; /* for the files that the run carries */
    bool has_folder;
};

/* Reads the model of the run, whose coordinates must match the columns. Reports errors on stderr; call
 * view_model_release in any case. */
enum status view_model_read(struct viewed_model *viewed, const struct run *run,
                            const struct options *options);
void view_model_release(struct viewed_model *viewed);

/* ---- The page ---- */

/* A page. `data` and `blocks` are JSON; the others are our own texts, NULL at the end of a list. */
struct view_page {
    const char *title, *policy; /* policy: further sources of scripts, and further directives */
    const char *const *styles;
    const char *three; /* three.js */
    const char *data;
    const char *const *block_names, *const
                                        *blocks; /* further script elements that the browser does not run */
    const char *const *scripts;                  /* after those that all pages have */
};

/* Bytes as a text of JSON that load.js unpacks, in heap memory. */
char *view_pack(const char *bytes, size_t size);
/* The source of a content security policy that names a script or style with this text. */
const char *view_hash(const char *text);

/* three.js; NULL after a reported error. */
char *view_three_read(void);
void view_page_put(FILE *out, const struct view_page *page);
/* Writes "palette", the colours of links and runs. */
void view_palette_put(FILE *out);
/* The axis opposite to gravity; z if gravity is not along an axis. */
int view_upward(const struct generation *generation);

/* The command on runs, and its own options. */
extern const struct option_rule view_rules[];
enum status view_run(const struct options *options);

#endif
