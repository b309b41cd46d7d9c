/* What this folder offers. */
#ifndef REFDYN_TOOL_VIEW_H
#define REFDYN_TOOL_VIEW_H

#include <stdio.h>

#include "gen/gen.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/system/system.h"

/*
 * The numbers of a run as the page draws them, as JSON: so many rows as one can see, in few digits.
 *
 *     "t": {"unit": 1e-5, "steps": [0, 5000, ...]}        value = unit times the sum of the steps so far
 *     "q": [{"unit": , "steps": }, ...]                   by frame; turns to 1e-5 rad or less, slides to five
 *                                                         digits of the largest
 *     "courses": [{"name": , "kind": , "unit": , "steps": }, ...]
 *                                                         residuals, energy, programme forces that are not 0,
 *                                                         inputs and courses, to four digits of the largest
 */

/* Rows at equal distances, and the last one. */
struct drawn_rows {
    double *values; /* (count x width), all columns of the run */
    long count, width;
};

/* `share`: how many runs are on the page. */
struct drawn_rows view_drawn_run_rows(const struct run *run, int share);
/* These members, without brackets around them, of a run that has the coordinates of that tree. */
void view_drawn_run_put(FILE *out, const struct run *run, const struct tree *tree,
                        const struct drawn_rows *rows);

/*
 * Applied forces of a model along a run, as JSON: drives on coordinates, and forces and torques at points.
 *
 *     "applied": [{"name": , "kind": "drive", "frame": , "parts": [{"unit": , "steps": }]},
 *                 {"name": , "kind": "force" or "torque", "frame": , "at": [x, y, z], "parts": [3 of them]},
 * ...]
 *
 * Values are those of the model's formulas at the coordinates, rates, inputs and points of the rows, to four
 * digits of the largest. What a formula takes beside these (points that are none of interest, values of a
 * start that nobody gave) is in no row: that force is left out, and so is one that is 0 throughout.
 */

void view_applied_forces_put(FILE *out, struct generation *generation, const struct run *run,
                             const struct drawn_rows *rows);

/*
 * A model as the page draws it, as JSON: frames with their joints, from which the page finds all placements,
 * and what is fixed to them: shapes, sticks, points, ends of closures.
 *
 *     "coordinates": ["base_z", ...]       the names, by frame
 *     "links": ["base", ...]
 *     "frames": [[parent, link, element, joint, x, y, z, (R11 R12 ... R33)], ...]
 *                joint 0 1 2: slides along x y z, 3 4 5: turns; T = T_parent A D(q); without R the axes are
 *                the parent's
 *     "shapes": [[kind, frame, link, is_solid, bore, m11 m12 ... m33, x, y, z], ...]    view.h
 *     "sticks": [[frame, link, x, y, z, x, y, z], ...]                                  from, to
 *     "points": [{"name": , "frame": , "at": [x, y, z]}, ...]
 *     "closures": [{"name": , "ends": [{"frame": , "at": }, ...]}, ...]
 */

/* These members, without brackets around them. Parameters are numbers in the model's graph. */
void view_drawn_model_put(FILE *out, struct generation *generation);

/*
 * A model as a picture: the tree of its links on the left, its rows and drives on the right, each with lines
 * to the links that it acts on. Takes a model that was read; gives the text of an SVG file, the same for the
 * same model.
 */

void view_model_drawing_put(FILE *out, struct generation *generation);

/*
 * The page of `refdyn view`: one HTML file that needs no other and no network. In it are three.js as the
 * system has it, with its licence, our own style and scripts as they lie in page/, and the data.
 */

/* The text of three.js; NULL, with a complaint that tells what to install. */
char *view_page_read_three(void);
/* The page with that title, `data` a JSON text. */
void view_page_put(FILE *out, const char *title, const char *three, const char *data);

/*
 * Curves on which a programme holds points of interest, as JSON: of each position row that is a formula in
 * two components of one point, and in nothing else, the curve through the place where the motion begins.
 *
 *     "curves": [{"point": , "axes": [0, 1], "closed": true, "path": [x, y, x, y, ...]}, ...]
 *
 * By steps along the tangent of phi(x, y) = 0, each brought back by Newton's method.
 */

void view_programme_curves_put(FILE *out, struct generation *generation, const struct run *run);

/*
 * Numbers of a page, rounded to what a picture needs, as JSON. None of them is NaN or infinite: what is not
 * finite becomes 0, since no motion was computed with it.
 */

/* A length, or another number of a scale of its own: seven digits. */
void view_put_length(FILE *out, double value);
/* An entry of a rotation, to 1e-8. */
void view_put_cosine(FILE *out, double value);
/* `digits` of the largest absolute value: a power of ten. 1 where that is 0. */
double view_rounded_unit(double largest, int digits);
/* Values at that distance from each other as whole numbers of `unit`, each but the first less the one before:
 * "[3,0,-1]". */
void view_put_course(FILE *out, const double *values, long count, long stride, double unit);

/*
 * What stands for the bodies of a model: elements of beams by their sections, solids by mass and inertia.
 *
 * Takes a model whose parameters have their values; gives shapes of unit size (a ball of diameter 1, a
 * cylinder and a box along x of length and width 1), each with the map from its axes to those of a frame.
 * Solids that are mostly air, as wrong inertias make them, are drawn smaller, about their centre.
 */

/* A box and a cylinder begin at x = 0 and lie about the x axis; a ball has its middle at 0. */
enum shape_kind { SHAPE_BALL, SHAPE_CYLINDER, SHAPE_BOX };

struct shape {
    enum shape_kind kind;
    int frame; /* of the tree, -1: the ground */
    int link;
    bool is_solid;    /* else an element of a beam */
    double bore;      /* of a cylinder: inner over outer diameter */
    double axes[9];   /* row-major: columns are the images of the unit axes [m] */
    double origin[3]; /* [m] */
};

/* Calls `take` for each shape, link by link. */
void view_shapes_give(const struct generation *generation,
                      void take(void *context, const struct shape *shape), void *context);

/*
 * The model of a run that is drawn: that of a file of HDF5 from the texts, options and parameters that the
 * file carries, that of a CSV from --model and --set.
 */

/* Parameters are numbers in its graph, with the values that the motion had. */
struct viewed_model {
    struct scene scene;    /* that is read and no more */
    struct scratch folder; /* of the files that the run carries */
    bool has_folder;
};

/* Reads the model of the run, whose columns have to be its coordinates. Complains on stderr;
 * view_model_release in any case. */
enum status view_model_read(struct viewed_model *viewed, const struct run *run,
                            const struct options *options);
void view_model_release(struct viewed_model *viewed);

extern const struct command view_command;

#endif
