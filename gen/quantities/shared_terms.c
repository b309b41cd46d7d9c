/*
 * Terms that several quantities share: each is derived when first requested, and kept in the derivation;
 * and the cost of values.
 *
 * Input: the tree. Output: inertias beyond joints, rows, forces and their sums.
 */
#include "gen/tree/tree.h"
#include "gen/quantities/quantities.h"

#include <string.h>

expression *derivation_new_values(const struct derivation *d, int count) {
    return memory_get(d->memory, ((size_t)count + 1) * sizeof(expression));
}

struct derivation *derivation_start(struct plan *plan, const struct tree *tree) {
    struct derivation *d = memory_get(plan->memory, sizeof *d);
    *d = (struct derivation){.plan = plan,
                             .memory = plan->memory,
                             .g = plan->g,
                             .model = plan->model,
                             .n = plan->tree->count,
                             .m = plan->model->row_count,
                             .points = plan->model->point_count,
                             .frames = tree->count};
    kinematics_derive(plan->memory, plan->model, tree, &d->kinematics);
    return d;
}

struct derivation *derivation_without_runs(struct derivation *d) {
    if (!d->kinematics.tree->run_count)
        return d;
    if (!d->flat) {
        struct tree *tree = memory_get(d->memory, sizeof *tree);
        roll_tree(d->memory, d->model, d->plan->tree, LOOPS_NEVER, tree);
        d->flat = derivation_start(d->plan, parallel_axes_keep(d->memory, tree, d->kinematics.tree->axes));
        d->flat->is_second = true;
    }
    return d->flat;
}

const struct inertia *derivation_composites(struct derivation *d) {
    if (!d->composites)
        d->composites = dynamics_composite_inertias(&d->kinematics, NULL);
    return d->composites;
}

const struct row_terms *derivation_rows(struct derivation *d) {
    if (!d->rows)
        d->rows = constraints_derive(&d->kinematics);
    return d->rows;
}

static struct row_terms *rows_at(struct derivation *d, const struct reference *references) {
    struct kinematics moved = d->kinematics;
    const size_t size = (size_t)d->model->marker_count * sizeof *moved.points;
    moved.points = memory_grow(d->memory, moved.points, size, size + sizeof *moved.points);
    for (int i = 0; i < d->model->marker_count; i++) {
        const int frame = d->kinematics.tree->points[i].frame;
        const struct reference *of = &references[frame < 0 ? 0 : frame];
        moved.points[i].d =
            kinematics_acceleration_less_gravity(&d->kinematics, i, of->linear, &of->gradient);
    }
    return constraints_derive(&moved);
}

const struct row_terms *derivation_rows_beside_loads(struct derivation *d,
                                                     const struct reference *references) {
    return references ? rows_at(d, references) : derivation_rows(d);
}

const expression *derivation_mass_matrix(struct derivation *d) {
    if (!d->M) {
        d->M = derivation_new_values(d, d->n * d->n);
        d->composites = dynamics_composite_inertias(&d->kinematics, d->M);
    }
    return d->M;
}

const struct applied *derivation_applied(struct derivation *d) {
    if (!d->applied.others)
        d->applied = forces_generalized(&d->kinematics);
    return &d->applied;
}

/* The sum of two or three lists by frame; the first has the opposite sign if it is `negative`. */
static expression *total_of(struct derivation *d, bool negative, const expression *first,
                            const expression *second, const expression *third) {
    struct graph *g = d->g;
    expression *sum = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(g, d->kinematics.tree, &i);) {
        const expression signed_first = negative ? expr_neg(g, first[i]) : first[i];
        const expression others = expr_add(g, second ? second[i] : 0, third ? third[i] : 0);
        sum[i] = expr_add(g, signed_first, others);
    }
    return sum;
}

/* Q without gravity, plus the extra term of the printed form. */
const expression *derivation_applied_total(struct derivation *d) {
    const struct applied *forces = derivation_applied(d);
    expression *first = derivation_new_values(d, d->frames), *second = derivation_new_values(d, d->frames);
    for (int i = 0; i < d->frames; i++) {
        first[i] = forces->strained[i] ? forces->strained[i] : forces->conservative[i];
        second[i] = forces->strained[i] ? 0 : forces->others[i];
    }
    const expression *printed = d->model->printed_form ? forces_printed_rates(&d->kinematics) : NULL;
    return total_of(d, false, first, second, printed);
}

/* h = -c; in the printed form it is c + 2 s. */
expression *derivation_bias_forces(struct derivation *d) {
    if (!d->bias)
        d->bias = dynamics_bias_forces(&d->kinematics, false);
    if (!d->model->printed_form)
        return total_of(d, true, d->bias, NULL, NULL);
    const expression *s = dynamics_printed_sum(&d->kinematics);
    return total_of(d, false, d->bias, s, s);
}

expression *derivation_generalized_forces(struct derivation *d) {
    const expression *gravity = dynamics_gravity_forces(&d->kinematics, derivation_composites(d));
    return total_of(d, true, gravity, derivation_applied_total(d), NULL);
}

/* f = h + Q in one recursion, with gravity in the accelerations. The printed h has no form of this kind. */
expression *derivation_all_forces(struct derivation *d) {
    if (d->model->printed_form)
        return total_of(d, false, derivation_bias_forces(d), derivation_generalized_forces(d), NULL);
    if (!d->less_gravity)
        d->less_gravity = dynamics_bias_forces(&d->kinematics, true);
    return total_of(d, true, d->less_gravity, derivation_applied_total(d), NULL);
}

int derivation_add_array(struct derivation *d, struct function *f, const char *name, const char *about,
                         int count, int columns) {
    return plan_open_result(d->memory, f, name, about, count, columns);
}

void derivation_spread(struct derivation *d, struct function *f, int array, int first, int stride,
                       const expression *by_frame) {
    for (int i = 0; i < d->frames; i++) {
        const struct frame *frame = &d->kinematics.tree->frames[i];
        if (frame->kind == FRAME_JOINT)
            plan_set_frame(d->memory, d->kinematics.tree, f, array, first + stride * frame->coordinate,
                           stride * frame->step, i, by_frame[i]);
    }
}

/* ---- Operations of functions ---- */

/*
 * The cost of values: the operations of a call that computes them and nothing else. Forms are chosen by it.
 * The last function adds a line about a choice to the summary.
 */

/* A division keeps its unit busy for four to five cycles, in which at least as many products or sums
 * begin. */
enum { DIVISION_WEIGHT = 4 };

/* Operations of all nodes on which the marked ones depend. */
static long weigh_marked(const struct derivation *d, bool *needed) {
    const struct graph *g = d->g;
    long operations = 0;
    rewrite_mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++) {
        const enum cost cost = operation_cost(g->nodes[e].operation);
        if (needed[e] && (g->nodes[e].depends & ~ON_PARAMETER) != 0)
            operations += plan_trips_of(d->plan, e) *
                          (cost == COST_DIV ? DIVISION_WEIGHT : cost == COST_ADD || cost == COST_MUL);
    }
    return operations;
}

long operation_cost_of_values(const struct derivation *d, const expression *values, int count) {
    const struct memory_mark mark = memory_mark(d->memory);
    bool *needed = memory_scratch(d->memory, d->g->count * sizeof *needed);
    for (int i = 0; i < count; i++)
        needed[values[i]] = true;
    const long operations = weigh_marked(d, needed);
    memory_back(d->memory, mark);
    return operations;
}

long operation_cost_of_results(const struct derivation *d, const struct function *function) {
    const struct memory_mark mark = memory_mark(d->memory);
    bool *needed = memory_scratch(d->memory, d->g->count * sizeof *needed);
    plan_mark_results(function, needed);
    const long operations = weigh_marked(d, needed);
    memory_back(d->memory, mark);
    return operations;
}

/* This many operations of a loop over arrays count as one, because compilers turn them into vector
 * instructions. */
enum { LOOP_ADVANTAGE = 2 };

long operation_cost_with_loops(const struct derivation *d, const struct function *function) {
    struct operation_count count = {.quantity = function->quantity};
    for (int i = 0; i < function->loop_count; i++)
        loops_count_operations(d->memory, function, &function->loops[i], &count);
    return operation_cost_of_results(d, function) + (count.adds + count.muls) / LOOP_ADVANTAGE;
}

void operation_cost_note_choice(struct derivation *d, const char *choice) {
    struct plan *plan = d->plan;
    if (d->is_second)
        return;
    plan->choices = plan->choices ? memory_format(plan->memory, "%s; %s", plan->choices, choice) : choice;
}

bool derivation_has_massless_joint(const struct derivation *d) {
    const struct tree *tree = d->kinematics.tree;
    bool *has_mass = memory_get(d->memory, ((size_t)tree->count + 1) * sizeof *has_mass);
    for (int i = tree->count - 1; i >= 0; i--) {
        const struct frame *frame = &tree->frames[i];
        has_mass[i] |= frame->is_state || !inertia_is_zero(&frame->inertia);
        if (!has_mass[i] && frame->kind == FRAME_JOINT)
            return true;
        if (frame->parent >= 0)
            has_mass[frame->parent] |= has_mass[i];
    }
    return false;
}
