/*
 * The commands of `refdyn`, one file each, and what several of them need.
 */
#ifndef REFDYN_TOOL_COMMANDS_H
#define REFDYN_TOOL_COMMANDS_H

#include "command_line/options.h"
#include "scene/scene.h"

enum status run_gen(const struct options *options);
enum status run_check(const struct options *options);
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
enum status run_merge(const struct options *options);
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

/* The same, where the scene is one that has equilibria: complains of rows that close a loop. */
enum status check_statics(struct scene *scene, const struct options *options, int *held);

/*
 * Equilibrium from the scene's q, with the coordinates of --hold (or the model's); q becomes the equilibrium.
 * It lives as long as the scene. Complains on stderr when it fails.
 */
struct equilibrium {
    int *held;          /* (n) non-zero: held */
    double *hold_force; /* (n) */
    double residual;    /* largest |Q| of the coordinates not held */
};

enum status find_equilibrium(struct scene *scene, const struct options *options,
                             struct equilibrium *equilibrium);

#endif
