/*
 * Chooses the tree from which everything is derived: runs of equal elements rolled or written out, parallel
 * axes turned or kept.
 *
 * Input: the rolled tree. Counts the operations of M, h and qdd_free for each form and returns the cheapest.
 */
#include "gen/quantities/quantities.h"
#include "gen/tree/tree.h"

#include <string.h>

/* Operations of M, h and qdd_free together. */
static long weigh_equations(struct derivation *d) {
    const int square = d->n > MOST_WRITTEN_OUT ? 0 : d->n * d->n;
    expression *values = derivation_new_values(d, 2 * d->frames + square);
    memcpy(values, accelerations_recursive(d), (size_t)d->frames * sizeof *values);
    memcpy(values + d->frames, derivation_bias_forces(d), (size_t)d->frames * sizeof *values);
    if (square)
        memcpy(values + 2 * d->frames, derivation_mass_matrix(derivation_without_runs(d)),
               (size_t)square * sizeof *values);
    return operation_cost_of_values(d, values, 2 * d->frames + square);
}

/* Derives in a copy of the graph, so that a trial leaves neither names nor nodes. */
static long weigh_axes(const struct plan *plan, const struct tree *tree) {
    struct graph graph = graph_copy(plan->g);
    struct model model = *plan->model;
    struct plan trial = *plan;
    model.graph = trial.g = &graph;
    trial.model = &model;
    return weigh_equations(derivation_start(&trial, tree));
}

/* A tree from which everything may be derived, and its operations. */
struct candidate {
    const struct tree *tree;
    long operations;
    long turned; /* operations with axes that turn */
    long looped; /* operations with loops, if runs are written out; else 0 */
};

/* Axes are kept if that saves a twentieth. Both forms are tried: qdd_free gains 8 to 27 % in planar
 * linkages with all but the first axes kept, and up to 46 % in arms that turn about parallel axes with all
 * kept. */
static struct candidate choose_axes(const struct plan *plan, const struct tree *rolled) {
    struct candidate best = {.tree = rolled, .operations = weigh_axes(plan, rolled)};
    best.turned = best.operations;
    for (enum kept_axes axes = AXES_KEPT_AFTER; axes <= AXES_KEPT; axes++) {
        const struct tree *tree = parallel_axes_keep(plan->memory, rolled, axes);
        const long operations = tree == rolled ? best.turned : weigh_axes(plan, tree);
        if (operations >= best.operations || 20 * operations > 19 * best.turned)
            continue;
        best.tree = tree;
        best.operations = operations;
    }
    return best;
}

static bool has_parallel_turns(const struct plan *plan, const struct tree *tree) {
    return parallel_axes_keep(plan->memory, tree, AXES_KEPT) != tree;
}

/* Runs are written out if that saves a quarter. All functions then have more text, and if these three save
 * less, others, among them the derivatives, need more operations than with loops. */
enum { WORTH_WRITING = 3 };

static struct candidate choose_runs(struct plan *plan) {
    const struct candidate rolled = choose_axes(plan, plan->rolled);
    struct tree *flat = memory_get(plan->memory, sizeof *flat);
    roll_tree(plan->memory, plan->model, plan->tree, LOOPS_NEVER, flat);
    struct candidate written = choose_axes(plan, flat);
    if (WORTH_WRITING * rolled.operations <= (WORTH_WRITING + 1) * written.operations)
        return rolled;
    plan->rolled = flat;
    written.looped = rolled.operations;
    return written;
}

static bool may_write_runs(const struct plan *plan) {
    return plan->model->loops == LOOPS_AUTO && plan->rolled->run_count &&
           plan->tree->count <= MOST_WRITTEN_OUT;
}

struct derivation *choice_of_tree(struct plan *plan) {
    static const char *const names[] = {"turned", "kept after the first", "kept"};
    _Static_assert(sizeof names / sizeof *names == AXES_KEPT + 1, "each way has a name");
    struct candidate best = {.tree = plan->rolled};
    if (may_write_runs(plan))
        best = choose_runs(plan);
    else if (has_parallel_turns(plan, plan->rolled))
        best = choose_axes(plan, plan->rolled);
    struct derivation *d = derivation_start(plan, best.tree);
    if (best.looped)
        operation_cost_note_choice(d, memory_format(plan->memory, "runs written out, %ld (loops %ld)",
                                                    best.operations, best.looped));
    if (has_parallel_turns(plan, plan->rolled))
        operation_cost_note_choice(d,
                                   memory_format(plan->memory, "axes of parallel turns %s, %ld (turned %ld)",
                                                 names[best.tree->axes], best.operations, best.turned));
    return d;
}
