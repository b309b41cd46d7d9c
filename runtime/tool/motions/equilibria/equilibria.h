/* Equilibria and small motions: the choices and the computation of an equilibrium for a command. */
#ifndef REFDYN_TOOL_EQUILIBRIA_H
#define REFDYN_TOOL_EQUILIBRIA_H

#include "runtime/tool/scene/scene.h"

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
extern const struct command statics_command, modes_command, linearise_command;
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
/* Writes list "limits": the values of the model's limits at the equilibrium; warns of those that are
 * exceeded. */
void equilibria_put_limits(const struct scene *scene, const struct equilibrium *equilibrium,
                           struct document *document);
/* The state of --at: "statics" (default), "initial" or the path of a STATE.json. */
const char *equilibria_place(const struct options *options);
/* Sets q and qd from that state, the rates of an equilibrium being 0, and marks the coordinates to hold in
 * held (n). Reports failures. */
enum status equilibria_choose_state(struct scene *scene, const struct options *options, const char *at,
                                    int *held);
/* Linear algebra by LAPACK, with memory of the program. */
extern const struct record_algebra equilibria_algebra;
/* "stable", "neutral in 1 direction", "unstable in 2 directions". */
const char *equilibria_stability_text(const struct refdyn_statics_result *result);

#endif
