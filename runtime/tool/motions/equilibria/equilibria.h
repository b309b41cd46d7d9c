/* Equilibria and small motions: the equations of small motions and their spectrum; the choices and the
 * computation of an equilibrium for a command. */
#ifndef REFDYN_TOOL_EQUILIBRIA_H
#define REFDYN_TOOL_EQUILIBRIA_H

#include <complex.h>

#include "runtime/tool/scene/scene.h"

/* The equations of small motions about a state at rest, for x, the change of the coordinates that are not
 * held: M x'' + D x' + K x - u^T mu = 0,   position rows: u x = 0,   velocity rows: u x' + psi_q x = 0 */
struct linear {
    int n, m;
    int *place;      /* (n) of the coordinates not held, in q */
    double *M, *D;   /* (n x n) */
    double *K;       /* (n x n) */
    double *u;       /* (m x n) */
    double *psi_q;   /* (m x n) 0 in position rows */
    int *is_level_q; /* (m) non-zero: a position row */
    double *force;   /* (n) Q + u^T lambda, the unbalanced force */
    double residual; /* the largest of these */
};

/* Spectrum of small motions x = shape e^(eigenvalue t) (theory, sect. 8.10). Each occurs once: of a conjugate
 * pair, the one with positive imaginary part. */

struct mode {
    double complex eigenvalue;   /* [1/s]; parts within rounding are exactly 0 */
    const double complex *shape; /* (n) the largest entry is 1 */
};

struct spectrum {
    struct mode *modes; /* by |eigenvalue|, ascending; a growing one before a decaying one */
    int count;
    const int *redundant; /* (redundant_count) rows that depend on others, or have no effect at rest */
    int redundant_count;
};

/* Returns a status of the runtime. */
int equilibria_find_spectrum(struct spectrum *spectrum, const struct linear *linear);

/* Marks in held (n) the coordinates of --hold, or those of the model by default. Reports unknown names. */
enum status equilibria_choose_held(struct scene *scene, const struct options *options, int *held);

/* Sets how equilibria of the scene are computed. All position rows must be satisfied, except for two kinds:
 * rows of --release, and rows of a programme that begins where the motion does (struct row, starts) while a
 * parameter that they read there has no value. is_given (parameters of the model in C): further parameters
 * with a value, besides those of scene->given; may be NULL. Reports unknown words and rows. */
enum status equilibria_choose_options(const struct scene *scene, const struct options *options,
                                      const int *is_given, struct refdyn_statics_options *statics);
/* The options of equilibria. */
extern const struct option_rule equilibria_rules[];
extern const struct command statics_command, modes_command;
/* Reports options of statics that are given without an equilibrium to compute; `place` is the option they
 * need, such as "--from statics". */
enum status equilibria_refuse_options(const struct options *options, const char *place);

/* Equilibrium, computed from the scene's q with the coordinates of --hold or the model's; q becomes the
 * equilibrium. It lives as long as the scene. Reports failure on stderr, and warns if it is unstable. */
struct equilibrium {
    int *held;          /* (n) non-zero for held coordinates */
    double *hold_force; /* (n) */
    struct refdyn_statics_options options;
    struct refdyn_statics_result result;
};

enum status equilibria_find(struct scene *scene, const struct options *options,
                            struct equilibrium *equilibrium);
/* "stable", "neutral in 1 direction", "unstable in 2 directions". */
const char *equilibria_stability_text(const struct refdyn_statics_result *result);

#endif
