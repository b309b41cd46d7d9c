/*
 * Accelerations with and without constraints, and the choice of a way to solve M x = f for them.
 *
 * Input: terms of the derivation. Output: qdd_free, qdd, the multipliers, and the values that derivatives
 * need of them. Counted operations decide; the choice goes to the summary.
 */
#include "gen/quantities/quantities.h"

#include <string.h>

/* A pivot of S is rounding, of doubles and of floats, if it is smaller than the first part of its diagonal
 * term, or than the second part of the response of free bodies: theory, sect. 5.6. */
static const double redundant[2] = {1e-12, 2e-5}, vanishing[2] = {1e-24, 1e-12};

static const struct elimination *elimination(struct derivation *d, struct solution *solution) {
    if (!solution->elimination)
        solution->elimination = articulated_body_eliminate(&d->kinematics);
    return solution->elimination;
}

static const struct factors *factors(struct derivation *d) {
    if (!d->factors)
        d->factors = mass_factor(&d->kinematics, derivation_mass_matrix(d));
    return d->factors;
}

/* M^-1 f */
static expression *solve(struct derivation *d, struct solution *solution, const expression *f) {
    return solution->is_dense ? mass_factor_solve(factors(d), f)
                              : articulated_body_solve(&d->kinematics, elimination(d, solution),
                                                       (struct right_side){.f = f}, NULL);
}

static const expression *free_by(struct derivation *d, struct solution *solution) {
    if (solution->free)
        return solution->free;
    if (solution->is_dense || d->model->printed_form)
        return solution->free = solve(d, solution, derivation_all_forces(d));
    /* The recursion adds up h on its way. */
    const struct elimination *of = elimination(d, solution);
    solution->references = reference_accelerations_derive(&d->kinematics, of);
    const struct right_side side = {derivation_applied_total(d),
                                    dynamics_loads(&d->kinematics, solution->references),
                                    solution->references};
    return solution->free = articulated_body_solve(&d->kinematics, of, side, &solution->frames);
}

static expression dot(struct derivation *d, const expression *a, const expression *b) {
    struct recursion sum = recursion_sum(d->memory, d->g, d->kinematics.tree);
    for (int i = -1; recursion_next_term(&sum, &i);)
        recursion_add_term(&sum, i, expr_mul(d->g, a[i], b[i]));
    return recursion_total(&sum);
}

/*
 * 1 / pivot, or 0 for a redundant row: S is positive semidefinite, so that only the rounding of its diagonal
 * term remains. Where the joints take up the whole row, that term is itself rounding. The multiplier of a
 * redundant row is 0. Theory, sect. 5.6.
 */
static expression pivot_inverse(struct derivation *d, expression pivot, expression diagonal,
                                expression free_response) {
    struct graph *g = d->g;
    const bool is_single = d->plan->is_single;
    const expression least = expr_add(g, expr_mul(g, expr_number(g, redundant[is_single]), diagonal),
                                      expr_mul(g, expr_number(g, vanishing[is_single]), free_response));
    if (!pivot)
        return EXPR_ZERO;
    const expression is_own = expr_apply2(g, OP_LESS, least, pivot);
    time_events_leave_out(d->plan, is_own);
    return expr_where(g, is_own, expr_div(g, EXPR_ONE, pivot), EXPR_ZERO);
}

/* Solves S x = rest for the symmetric S = u M^-1 u^T (m x m), by elimination in order of the rows. */
void accelerations_solve_rows(struct derivation *d, const struct solution *solution, expression *rest,
                              const char *what) {
    struct graph *g = d->g;
    const int m = d->m;
    const expression *matrix = solution->S;
    expression *S = derivation_new_values(d, m * m), *inverse = derivation_new_values(d, m);
    memcpy(S, matrix, (size_t)(m * m) * sizeof *S);
    for (int p = 0; p < m; p++) {
        inverse[p] = pivot_inverse(d, S[p * m + p], matrix[p * m + p], solution->free_responses[p]);
        graph_name_value(g, inverse[p], memory_format(d->memory, "row_%d_pivot_inverse", p + 1));
        for (int i = p + 1; i < m; i++) {
            const expression factor = expr_mul(g, S[i * m + p], inverse[p]);
            for (int j = p + 1; j < m; j++)
                S[i * m + j] = expr_sub(g, S[i * m + j], expr_mul(g, factor, S[p * m + j]));
            rest[i] = expr_sub(g, rest[i], expr_mul(g, factor, rest[p]));
        }
    }
    for (int i = m - 1; i >= 0; i--) {
        for (int j = i + 1; j < m; j++)
            rest[i] = expr_sub(g, rest[i], expr_mul(g, S[i * m + j], rest[j]));
        rest[i] = expr_mul(g, rest[i], inverse[i]);
        graph_name_value(g, rest[i], memory_format(d->memory, "row_%d_%s", i + 1, what));
    }
}

/* qdd = qdd_free + M^-1 u^T lambda: theory, sect. 5.6. */
static const expression *add_constraints(struct derivation *d, const struct solution *s) {
    struct graph *g = d->g;
    expression *qdd = derivation_new_values(d, d->frames);
    graph_remark(g, "qdd = qdd_free + M^-1 u^T lambda (5.6)");
    for (int j = -1; recursion_next_joint(g, d->kinematics.tree, &j);) {
        qdd[j] = s->free[j];
        for (int i = 0; i < d->m; i++)
            qdd[j] = expr_add(g, qdd[j], expr_mul(g, s->responses[i][j], s->lambda[i]));
    }
    return qdd;
}

/* ---- Rows as loads ---- */

/*
 * u^T acts as a force at each point and on each coordinate that the row names (theory, sect. 5.6). The
 * solution takes these loads, and u x is computed from the accelerations of the same points, so that a row
 * needs none of its n coefficients.
 */
static bool act_as_loads(struct derivation *d, const struct solution *solution) {
    for (int i = 0; i < d->m; i++)
        for (int p = 0; p < d->model->marker_count; p++) {
            const int frame = d->kinematics.tree->points[p].frame;
            if (frame >= 0 && !vector_is_zero(derivation_rows(d)[i].pulls[p]) &&
                !articulated_body_takes_load(solution->elimination, frame))
                return false;
        }
    return true;
}

/* The load of one row, negative as articulated_body_solve expects it: about the origin and in the axes of
 * each frame. */
static struct wrench *loads_of_row(struct derivation *d, const struct row_terms *row) {
    const struct kinematics *k = &d->kinematics;
    struct wrench *loads = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *loads);
    for (int p = 0; p < d->model->marker_count; p++) {
        const struct fixed_frame *fixed = &k->tree->points[p];
        if (fixed->frame < 0 || vector_is_zero(row->pulls[p]))
            continue;
        const struct vector pull =
            matrix_transpose_times(d->g, k->frames[fixed->frame].rotation.at, row->pulls[p]);
        const struct vector force = vector_scale(d->g, expr_neg(d->g, EXPR_ONE), pull), none = {{0, 0, 0}};
        const struct vector rho = kinematics_from_body(k, fixed->frame, vector_of(fixed->placement.position));
        const struct vector moment = vector_cross(d->g, rho, force);
        const struct wrench load = {moment, d->model->points[p].is_direction ? none : force};
        loads[fixed->frame] = wrench_add(d->g, loads[fixed->frame], load);
    }
    return loads;
}

/* u x, from the accelerations x of the coordinates and those of the frames. */
static expression row_times(struct derivation *d, const struct row_terms *row, const struct wrench *loads,
                            const expression *x, const struct acceleration *frames) {
    struct graph *g = d->g;
    expression sum = 0;
    for (int i = 0; i < d->frames; i++) {
        if (row->pull[i])
            sum = expr_add(g, sum, expr_mul(g, row->pull[i], x[i]));
        sum = expr_sub(g, sum, vector_dot(g, loads[i].moment, frames[i].angular));
        sum = expr_sub(g, sum, vector_dot(g, loads[i].force, frames[i].linear));
    }
    return sum;
}

/* Computes the responses M^-1 u^T, S and k - u qdd_free, with rows as loads. */
static void respond_to_loads(struct derivation *d, struct solution *solution) {
    const int m = d->m;
    const struct row_terms *row = derivation_rows_beside_loads(d, solution->references);
    struct wrench **loads = memory_get(d->memory, ((size_t)m + 1) * sizeof *loads);
    for (int i = 0; i < m; i++) {
        struct acceleration *frames;
        loads[i] = loads_of_row(d, &row[i]);
        solution->responses[i] =
            articulated_body_solve(&d->kinematics, solution->elimination,
                                   (struct right_side){.f = row[i].pull, .loads = loads[i]}, &frames);
        for (int j = 0; j <= i; j++)
            solution->S[i * m + j] = solution->S[j * m + i] =
                row_times(d, &row[j], loads[j], solution->responses[i], frames);
    }
    for (int i = 0; i < m; i++)
        solution->lambda[i] =
            expr_sub(d->g, row[i].k, row_times(d, &row[i], loads[i], solution->free, solution->frames));
}

/* Computes the same with the coefficients u. */
static void respond_to_coefficients(struct derivation *d, struct solution *solution) {
    const int m = d->m;
    const struct row_terms *row = derivation_rows(d);
    for (int i = 0; i < m; i++)
        solution->responses[i] = solve(d, solution, row[i].u);
    for (int i = 0; i < m; i++) {
        solution->lambda[i] = expr_sub(d->g, row[i].k, dot(d, row[i].u, solution->free));
        for (int j = 0; j <= i; j++)
            solution->S[i * m + j] = solution->S[j * m + i] = dot(d, row[i].u, solution->responses[j]);
    }
}

/* The row of a contact that does not rest is 0. The diagonal of S is 1 there, so that its multiplier is 0. */
static void leave_out_free_contacts(struct derivation *d, struct solution *solution) {
    struct graph *g = d->g;
    for (int i = 0; i < d->m; i++) {
        const expression rests = d->model->rows[i].rests;
        expression *diagonal = &solution->S[i * d->m + i];
        if (rests)
            *diagonal = expr_add(g, *diagonal, expr_sub(g, EXPR_ONE, rests));
    }
}

/*
 * qdd = qdd_free + M^-1 u^T lambda with (u M^-1 u^T) lambda = k - u qdd_free: one O(n) solution for each row.
 * Theory, sect. 5.6.
 */
static const expression *constrained_by(struct derivation *d, struct solution *solution) {
    if (solution->qdd)
        return solution->qdd;
    free_by(d, solution);
    solution->responses = memory_get(d->memory, ((size_t)d->m + 1) * sizeof *solution->responses);
    solution->S = derivation_new_values(d, d->m * d->m);
    solution->lambda = derivation_new_values(d, d->m);
    graph_remark(d->g, "rows: S lambda = k - u qdd_free, S = u M^-1 u^T (5.6)");
    if (solution->frames && act_as_loads(d, solution))
        respond_to_loads(d, solution);
    else
        respond_to_coefficients(d, solution);
    leave_out_free_contacts(d, solution);
    solution->free_responses = constraints_free_responses(&d->kinematics, derivation_rows(d));
    accelerations_solve_rows(d, solution, solution->lambda, "lambda");
    return solution->qdd = add_constraints(d, solution);
}

/* ---- Which way of solving M x = f ---- */

typedef const expression *solve_by(struct derivation *d, struct solution *solution);

/* "qdd_free recursive, 1055 operations (dense 1512)" */
static void say_choice(struct derivation *d, const char *quantity, const struct solution *chosen,
                       const char *costs) {
    operation_cost_note_choice(
        d, memory_format(d->memory, "%s %s%s", quantity, chosen->is_dense ? "dense" : "recursive", costs));
}

/*
 * The dense matrix is chosen if it saves at least a tenth (in a Bricard linkage 16 % of qdd_free, 29 % of
 * qdd). For less, the recursion stays: it loses no digits to the condition of M. The matrix is not even
 * derived if its factors alone could cost more than the whole recursion, nor for runs of equal elements,
 * whose recursions are loops.
 */
static struct solution *cheaper(struct derivation *d, const char *quantity, solve_by *by) {
    struct solution *recursive = &d->by_method[0], *dense = &d->by_method[1];
    const struct tree *tree = d->kinematics.tree;
    if (tree->run_count) {
        const long operations = operation_cost_of_values(d, by(d, recursive), d->frames);
        say_choice(d, quantity, recursive, memory_format(d->memory, ", %ld operations", operations));
        return recursive;
    }
    const long own = operation_cost_of_values(d, by(d, recursive), d->frames),
               factoring = mass_factor_operations(tree);
    if (factoring >= own) {
        say_choice(d, quantity, recursive,
                   memory_format(d->memory, ", %ld operations (dense: up to %ld for the factors alone)", own,
                                 factoring));
        return recursive;
    }
    const long other = operation_cost_of_values(d, by(d, dense), d->frames);
    if (10 * other <= 9 * own) {
        say_choice(d, quantity, dense,
                   memory_format(d->memory, ", %ld operations (recursive %ld)", other, own));
        return dense;
    }
    say_choice(d, quantity, recursive, memory_format(d->memory, ", %ld operations (dense %ld)", own, other));
    return recursive;
}

static struct solution *choose_solution(struct derivation *d, const char *quantity, solve_by *by) {
    d->by_method[1].is_dense = true;
    if (d->model->accelerations == ACCELERATIONS_AUTO)
        return cheaper(d, quantity, by);
    struct solution *asked = &d->by_method[d->model->accelerations == ACCELERATIONS_DENSE];
    say_choice(d, quantity, asked, ", as requested");
    return asked;
}

const expression *accelerations_free(struct derivation *d) {
    if (!d->free_solution)
        d->free_solution = choose_solution(d, "qdd_free", free_by);
    return free_by(d, d->free_solution);
}

const struct elimination *accelerations_elimination(struct derivation *d) {
    return elimination(d, &d->by_method[0]);
}

const expression *accelerations_recursive(struct derivation *d) {
    return free_by(d, &d->by_method[0]);
}

const struct solution *accelerations_constrained(struct derivation *d) {
    if (!d->solution)
        d->solution = choose_solution(d, "qdd", constrained_by);
    constrained_by(d, d->solution);
    return d->solution;
}
