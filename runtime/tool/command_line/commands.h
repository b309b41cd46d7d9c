/*
 * The commands of `refdyn`, one file each, and what several of them need.
 */
#ifndef REFDYN_TOOL_COMMANDS_H
#define REFDYN_TOOL_COMMANDS_H

#include "command_line/options.h"
#include "scene/scene.h"

enum status run_gen(const struct options *options);
enum status run_check(const struct options *options);
enum status run_compile(const struct options *options);
enum status run_eval(const struct options *options);
enum status run_statics(const struct options *options);
enum status run_modes(const struct options *options);
enum status run_sim(const struct options *options);
/* `sim` of a case of a batch. */
enum status run_case_again(const struct options *options);
enum status run_batch(const struct options *options);
/* With --slurm gives the batch to Slurm, and is run_batch without. */
enum status run_batch_anywhere(const struct options *options);
enum status run_plot(const struct options *options);
enum status run_view(const struct options *options);
enum status run_merge(const struct options *options);
enum status run_import(const struct options *options);
enum status run_export(const struct options *options);
enum status run_new(const struct options *options);
enum status run_completion(const struct options *options);
enum status run_bench(const struct options *options);
enum status run_report(const struct options *options);

/* Says on stderr which status of the runtime came at which time and state, of many coordinates those that are
 * at fault or largest; returns STATUS_NUMBERS. */
enum status numbers_failed(const struct scene *scene, int result, double t, const double *q,
                           const double *qd);
/* The rows that are farthest from what they ask for at a state, of which `where` tells in words; at most
 * three. */
void print_residuals(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                     const char *where);
/* The condition of the rows at a state, in words; true when they are near losing rank. */
bool print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd);
/* Rows that say what others say, by name. */
void print_rows_left_out(const struct refdyn_model *model, const int *rows, int count);
/* The same for all rows of a workspace, once its accelerations were solved. */
void print_redundant_rows(const struct refdyn_workspace *work);

/* Marks in held (n) the coordinates of --hold, or the model's. Complains about names that there are not. */
enum status choose_held(struct scene *scene, const struct options *options, int *held);

/*
 * How equilibria of the scene are looked for: its position rows hold, but those of --release and those of a
 * programme that begins where the motion does (struct row, starts) while what it reads there is not given.
 * is_given (parameters of the model in C): besides those of scene->given; NULL: none. Complains about words
 * and rows that there are not.
 */
enum status choose_statics(const struct scene *scene, const struct options *options, const int *is_given,
                           struct refdyn_statics_options *statics);
/* What --way may be, by enum refdyn_statics_way; NULL ends the list. */
extern const char *const statics_way_words[];
/* Complains of options of statics where the command looks for no equilibrium; `place` is "--from statics". */
enum status refuse_statics_options(const struct options *options, const char *place);

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

enum status find_equilibrium(struct scene *scene, const struct options *options,
                             struct equilibrium *equilibrium);
/* Says which rows do not hold without being released, and why. */
void print_rows_without_part(const struct scene *scene, const struct refdyn_statics_options *statics);
/* "stable", "neutral in 1 direction", "unstable in 2 directions". */
const char *stability_text(const struct refdyn_statics_result *result);
/* How stability was judged: a word for each value of the enum; for forces without a potential, a line on
 * stderr. */
extern const char *const statics_criterion_words[];
void print_criterion(const struct refdyn_statics_result *result);

#endif
