/* What this folder offers. */
#ifndef REFDYN_TOOL_EQUILIBRIA_H
#define REFDYN_TOOL_EQUILIBRIA_H

#include <complex.h>

#include "runtime/tool/scene/scene.h"

/*
 * Eigenvalues and shapes of small motions (theory, sect. 8.10).
 *
 * Takes the linear equations (scene.h), gives each x = shape e^(eigenvalue t) once: of a conjugate
 * pair the one with a positive imaginary part.
 */

struct mode {
    double complex eigenvalue;   /* [1/s]; its parts exactly 0 where they are within rounding */
    const double complex *shape; /* (n) the largest entry is 1 */
};

struct spectrum {
    struct mode *modes; /* by |eigenvalue|, ascending; a growing one before a decaying one */
    int count;
    const int *redundant; /* (redundant_count) rows that say what others say, or nothing at rest */
    int redundant_count;
};

/* Returns a status of the runtime. */
int equilibria_find_spectrum(struct spectrum *spectrum, const struct linear *linear);

/* Equilibria as the options of a command ask for them. */

/* Marks in held (n) the coordinates of --hold, or the model's. Complains about names that there are not. */
enum status equilibria_choose_held(struct scene *scene, const struct options *options, int *held);

/*
 * How equilibria of the scene are looked for: its position rows hold, but those of --release and those of a
 * programme that begins where the motion does (struct row, starts) while what it reads there is not given.
 * is_given (parameters of the model in C): besides those of scene->given; NULL: none. Complains about words
 * and rows that there are not.
 */
enum status equilibria_choose_options(const struct scene *scene, const struct options *options,
                                      const int *is_given, struct refdyn_statics_options *statics);
/* What --way may be, by enum refdyn_statics_way; NULL ends the list. */
/* The options of equilibria. */
extern const struct option_rule statics_rules[];
extern const struct command statics_command, modes_command;
/* Complains of options of statics where the command looks for no equilibrium; `place` is "--from statics". */
enum status equilibria_refuse_options(const struct options *options, const char *place);

/*
 * Equilibrium from the scene's q, with the coordinates of --hold (or the model's); q becomes the equilibrium.
 * It lives as long as the scene. Complains on stderr when it fails, and warns when it is unstable.
 */
struct equilibrium {
    int *held;          /* (n) non-zero: held */
    double *hold_force; /* (n) */
    struct refdyn_statics_options options;
    struct refdyn_statics_result result;
};

enum status equilibria_find(struct scene *scene, const struct options *options,
                            struct equilibrium *equilibrium);
/* Says which rows do not hold without being released, and why. */
void equilibria_print_rows_without_part(const struct scene *scene,
                                        const struct refdyn_statics_options *statics);
/* "stable", "neutral in 1 direction", "unstable in 2 directions". */
const char *equilibria_stability_text(const struct refdyn_statics_result *result);
/* How stability was judged: a word for each value of the enum; for forces without a potential, a line on
 * stderr. */
extern const char *const equilibria_criterion_words[];
void equilibria_print_criterion(const struct refdyn_statics_result *result);

#endif
