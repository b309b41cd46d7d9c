/*
 * View: motions as an HTML page in three dimensions, and a model as a picture.
 *
 *   run                the rows of a run and the applied forces, as JSON
 *   model              frames, shapes, points and closures, as JSON
 *   picture            the links, rows and drives of a model as SVG
 *   programme curves   the curves on which a programme keeps points
 *   numbers            rounded numbers in JSON
 *   shapes             bodies as balls, cylinders and boxes
 *   viewed model       the model that belongs to a run
 *
 * view.c is the command and writes the page; page/ has its style and scripts.
 */
#ifndef REFDYN_TOOL_VIEW_H
#define REFDYN_TOOL_VIEW_H

#include <stdio.h>

#include "gen/gen.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/system/system.h"

/*
 * Run: as many rows as one can see, in few digits.
 *
 *     "t": {"unit": 1e-5, "steps": [0, 5000, ...]}        value = unit times the sum of the steps up to it
 *     "q": [{"unit": , "steps": }, ...]                   by frame; turns to 1e-5 rad or less, slides to five
 *                                                         digits of the largest
 *     "courses": [{"name": , "kind": , "unit": , "steps": }, ...]
 *                                                         residuals, energy, programme forces that are not 0,
 *                                                         inputs and courses, to four digits of the largest
 */

/* Rows at equal distances, and the last row. */
struct drawn_rows {
    double *values; /* (count x width), all columns of the run */
    long count, width;
};

/* share: the number of runs on the page. */
struct drawn_rows view_drawn_run_rows(const struct run *run, int share);
/* Writes the members above, without outer brackets, for a run with the coordinates of the tree. */
void view_drawn_run_put(FILE *out, const struct run *run, const struct tree *tree,
                        const struct drawn_rows *rows);

/*
 * Applied forces along a run: drives on coordinates, and forces and torques at points.
 *
 *     "applied": [{"name": , "kind": "drive", "frame": , "parts": [{"unit": , "steps": }]},
 *                 {"name": , "kind": "force" or "torque", "frame": , "at": [x, y, z], "parts": [3 of them]},
 * ...]
 * The model's formulas are evaluated at the coordinates, rates, inputs and points of the rows, to four digits
 * of the largest. A force is omitted if it is 0 throughout, or if its formula needs something else: points
 * that are no points of interest, or values of a start that was not given.
 */

void view_applied_forces_put(FILE *out, struct generation *generation, const struct run *run,
                             const struct drawn_rows *rows);

/*
 * Model: frames with their joints, from which the page computes all placements, and what is fixed to them:
 * shapes, sticks, points, ends of closures.
 *
 *     "coordinates": ["base_z", ...]       the names, by frame
 *     "links": ["base", ...]
 *     "frames": [[parent, link, element, joint, x, y, z, (R11 R12 ... R33)], ...]
 *                joint 0 1 2: slides along x y z, 3 4 5: turns; T = T_parent A D(q); without R the axes are
 *                parallel to the parent's
 *     "shapes": [[kind, frame, link, is_solid, bore, m11 m12 ... m33, x, y, z], ...]    view.h
 *     "sticks": [[frame, link, x, y, z, x, y, z], ...]                                  from, to
 *     "points": [{"name": , "frame": , "at": [x, y, z]}, ...]
 *     "closures": [{"name": , "ends": [{"frame": , "at": }, ...]}, ...]
 */

/* Writes these members, without outer brackets. Parameters must be numbers in the model's graph. */
void view_drawn_model_put(FILE *out, struct generation *generation);

/* Picture of a model as SVG: the tree of its links on the left; its rows and drives on the right, each with
 * lines to the links on which it acts. */

void view_model_drawing_put(FILE *out, struct generation *generation);

/*
 * Programme curves: each position row that is a formula in two components of one point, and in nothing else,
 * defines a curve through the point at the start of the motion.
 *
 *     "curves": [{"point": , "axes": [0, 1], "closed": true, "path": [x, y, x, y, ...]}, ...]
 * The curve is computed by steps along the tangent of phi(x, y) = 0, each corrected by Newton's method.
 */

void view_programme_curves_put(FILE *out, struct generation *generation, const struct run *run);

/* Numbers in JSON, rounded to what a picture needs. Values that are not finite become 0, since no motion was
 * computed with them. */

/* A length, or another number with its own scale: seven digits. */
void view_put_length(FILE *out, double value);
/* An entry of a rotation, to 1e-8. */
void view_put_cosine(FILE *out, double value);
/* The power of ten that leaves `digits` digits of the largest absolute value; 1 if that is 0. */
double view_rounded_unit(double largest, int digits);
/* Writes values, `stride` apart in memory, as differences in whole units: "[3,0,-1]". The first one is
 * relative to 0. */
void view_put_course(FILE *out, const double *values, long count, long stride, double unit);

/*
 * Shapes represent the bodies of a model: elements of beams by their sections, solids by mass and inertia.
 *
 * Shapes have unit size (a ball of diameter 1; a cylinder and a box along x with length and width 1) and a
 * map from their axes to those of a frame. The parameters of the model must have values. A solid of very low
 * density, as wrong inertias cause, is drawn smaller, about its centre.
 */

/* A box and a cylinder begin at x = 0 and are centred on the x axis; a ball has its centre at 0. */
enum shape_kind { SHAPE_BALL, SHAPE_CYLINDER, SHAPE_BOX };

struct shape {
    enum shape_kind kind;
    int frame; /* of the tree, -1 for the ground */
    int link;
    bool is_solid;    /* otherwise an element of a beam */
    double bore;      /* for a cylinder, inner over outer diameter */
    double axes[9];   /* row-major: columns are the images of the unit axes [m] */
    double origin[3]; /* [m] */
};

/* Calls `take` for each shape, link by link. */
void view_shapes_give(const struct generation *generation,
                      void take(void *context, const struct shape *shape), void *context);

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

extern const struct command view_command;

#endif
