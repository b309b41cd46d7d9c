/*
 * Quantities that are exact derivatives, emitted on request, by q, qd, t, inputs and parameters.
 *
 * Input: the motion at given qdd, and the forces of model and rows (tangent.h). Output: functions with one
 * part for each kind of variable. Entries by q and qd are computed by loops (tangent_loops.c,
 * acceleration_sweeps.c), the others by one forward sweep. Theory, sect. 7.7 and 7.8.
 */
#include "gen/quantities/quantities.h"
#include "runtime/core/linear/chain_cost.h"
#include "gen/dynamics/dynamics.h"

#include <string.h>

/* ---- Blocks: derivatives by q, qd, t, inputs and parameters, side by side in one function ---- */

struct block_kind {
    const char *name, *about;
    enum symbol_kind kind;
};

static const struct block_kind blocks[NAMED_BLOCKS] = {
    [BY_Q] = {"q", "by the coordinates", SYMBOL_COORDINATE},
    [BY_QD] = {"qd", "by their rates", SYMBOL_COORDINATE},
    [BY_T] = {"t", "by time", SYMBOL_TIME},
    [BY_X] = {"x", "by the inputs", SYMBOL_INPUT},
    [BY_P] = {"p", "by the parameters, in the order of the table", SYMBOL_PARAMETER},
    [BY_QDD] = {"qdd", "by the accelerations", SYMBOL_COORDINATE},
};

/* ---- Terms that are differentiated by t, inputs and parameters ---- */

/* A symbol with respect to which the terms are differentiated. */
struct variable {
    enum symbol_kind kind;
    int index;
};

static expression derivative_by_variable(void *context, struct graph *g, expression e) {
    const struct variable *by = context;
    const struct symbol *s = expr_as_symbol(g, e);
    return s->kind == by->kind && s->index == by->index ? EXPR_ONE : EXPR_ZERO;
}

/* Sets the derivatives of all blocks of variables that have columns, in one sweep. */
static void differentiate_terms(struct derivation *d, struct terms *terms, const int widths[BLOCK_COUNT]) {
    int total = 0;
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        total += widths[k];
    struct variable *variables = memory_get(d->memory, ((size_t)total + 1) * sizeof *variables);
    void **contexts = memory_get(d->memory, ((size_t)total + 1) * sizeof *contexts);
    expression *derivatives = derivation_new_values(d, total * terms->count);
    int at = 0;
    for (int k = BY_T; k < BLOCK_COUNT; k++) {
        terms->derivatives[k] = derivatives + at * terms->count;
        for (int index = 0; index < widths[k]; index++, at++) {
            variables[at] = (struct variable){blocks[k].kind, index};
            contexts[at] = &variables[at];
        }
    }
    rewrite_derivatives(d->g, terms->values, derivatives, terms->count, derivative_by_variable, contexts,
                        total);
}

static bool reads_parameters(const struct derivation *d, const expression *values, int count) {
    const struct graph *g = d->g;
    bool *needed = memory_get(d->memory, g->count * sizeof *needed);
    for (int i = 0; i < count; i++)
        needed[values[i]] = true;
    rewrite_mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++)
        if (needed[e] && expr_as_symbol(g, e) && expr_as_symbol(g, e)->kind == SYMBOL_PARAMETER)
            return true;
    return false;
}

const char *derivatives_block_name(int block) {
    return block < NAMED_BLOCKS ? blocks[block].name : NULL;
}

/* Columns of a block; 0: the block is left out. */
static int width_of(const struct derivation *d, enum block block, bool has_parameters) {
    const int widths[BLOCK_COUNT] = {d->n, d->n, 1, d->model->input_count,
                                     has_parameters ? d->model->parameter_count : 0};
    return d->wanted_blocks & 1u << block ? widths[block] : 0;
}

static int add_matrix(struct derivation *d, struct function *f, const char *name, int rows, int columns) {
    return pair_loops_add_local(d->memory, f, name, rows * columns, columns);
}

void derivatives_add_blocks(struct derivation *d, struct function *f, const struct block_rows *rows,
                            const int widths[BLOCK_COUNT], int arrays[BLOCK_COUNT]) {
    static const char *const sizes[BLOCK_COUNT] = {"x n", "x n", "x 1", "x inputs", "x parameters"};
    for (int k = 0; k < BLOCK_COUNT; k++) {
        const char *name = memory_format(d->memory, "%s%s", rows->before, blocks[k].name);
        arrays[k] = NOTHING;
        if (!widths[k])
            continue;
        arrays[k] = rows->what ? derivation_add_array(d, f, name,
                                                      memory_format(d->memory, "(%s %s) %s %s", rows->shape,
                                                                    sizes[k], rows->what, blocks[k].about),
                                                      rows->count * widths[k], widths[k])
                               : add_matrix(d, f, name, rows->count, widths[k]);
        f->arrays[arrays[k]].by_parameter = k == BY_P;
    }
}

/* Spreads the derivatives of terms [first, first + frames), by frame, one column for each variable. */
static void spread_block(struct builder *b, const struct terms *terms, int first, enum block block,
                         int array) {
    const int width = array == NOTHING ? 0 : b->f->arrays[array].columns;
    for (int column = 0; column < width; column++)
        derivation_spread(b->d, b->f, array, column, width,
                          terms->derivatives[block] + column * terms->count + first);
}

void derivatives_fill_block(const struct builder *b, const struct terms *terms, int first, enum block block,
                            double factor, int array) {
    struct graph *g = b->d->g;
    const int width = array == NOTHING ? 0 : b->f->arrays[array].columns;
    const int rows = width ? b->f->arrays[array].count / width : 0;
    for (int column = 0; column < width; column++)
        for (int i = 0; i < rows; i++)
            plan_set_entry(b->d->memory, b->f, array, i * width + column,
                           expr_mul(g, expr_number(g, factor),
                                    terms->derivatives[block][column * terms->count + first + i]));
}

void derivatives_fill_by_state(const struct builder *b, const expression *in_symbols, int order,
                               double factor, int array) {
    const int rows = array == NOTHING ? 0 : b->f->arrays[array].count / b->d->n;
    for (int i = 0; i < rows; i++)
        if (in_symbols[i])
            derivation_spread(b->d, b->f, array, i * b->d->n, 1,
                              force_derivatives_scaled(
                                  b->d, factor, given_motion_derivatives(b->given, in_symbols[i], order)));
}

static void spread_u(struct derivation *d, struct function *f, int array) {
    for (int i = 0; i < d->m; i++)
        derivation_spread(d, f, array, i * d->n, 1, derivation_rows(d)[i].u);
}

/* ---- The motion at given accelerations ---- */

/* Values that every derivative treats as constant. */
static const expression *given_accelerations(struct derivation *d, const expression *by_frame) {
    expression *given = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        given[i] = expr_apply1(d->g, OP_HOLD, by_frame[i]);
    return given;
}

static const expression *given_multipliers(struct derivation *d) {
    expression *given = derivation_new_values(d, d->m);
    for (int i = 0; i < d->m; i++)
        given[i] = expr_apply1(d->g, OP_HOLD, d->solution->lambda[i]);
    return given;
}

static struct builder open_builder(struct derivation *d, struct function *f, bool has_rows) {
    struct applied_forces *applied_forces = tangent_no_forces(&d->kinematics);
    tangent_add_applied_forces(&d->kinematics, applied_forces);
    if (has_rows)
        tangent_add_row_forces(&d->kinematics, applied_forces);
    return (struct builder){.d = d, .f = f, .applied_forces = applied_forces};
}

/* Starts derivatives at the accelerations of the equations of motion. */
static struct builder start(struct derivation *d, struct function *f, bool has_rows) {
    struct builder b = open_builder(d, f, has_rows);
    if (has_rows)
        accelerations_constrained(d);
    const expression *accelerations =
        given_accelerations(d, has_rows ? d->solution->qdd : accelerations_free(d));
    b.given = given_motion_derive(&d->kinematics, accelerations, has_rows ? given_multipliers(d) : NULL);
    return b;
}

/* Starts at accelerations, and multipliers of rows, that the caller provides. */
static struct builder start_given(struct derivation *d, struct function *f, enum given given) {
    struct builder b = open_builder(d, f, given == GIVEN_MOTION && d->m > 0);
    expression *accelerations = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        accelerations[i] = kinematics_coordinate_of(&d->kinematics, i, 2);
    b.given = given_motion_derive(&d->kinematics, accelerations, NULL);
    f->given = given;
    return b;
}

/* Where the parts of motion_terms begin: M qdd - h - Q - u^T lambda and u^T lambda by frame, u qdd - k by
 * row. */
struct parts {
    int motion, rows, force;
};

static struct parts parts_of(const struct derivation *d) {
    return (struct parts){0, d->frames, d->frames + d->m};
}

static expression *difference(struct derivation *d, const expression *of, const expression *minus) {
    expression *difference =
        memory_grow(d->memory, of, (size_t)d->frames * sizeof *of, ((size_t)d->frames + 1) * sizeof *of);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        difference[i] = expr_sub(d->g, of[i], minus[i]);
    return difference;
}

/* M qdd - h - Q, less u^T lambda if the rows are among the applied forces, by frame. */
static const expression *required_forces(const struct builder *b) {
    return difference(b->d, tangent_inertia_forces(b->given),
                      tangent_generalized_forces(b->given, b->applied_forces));
}

static struct terms motion_terms(const struct builder *b) {
    struct derivation *d = b->d;
    const struct parts parts = parts_of(d);
    struct applied_forces *rows_alone = tangent_no_forces(&d->kinematics);
    struct terms terms = {.values = derivation_new_values(d, 2 * d->frames + d->m),
                          .count = 2 * d->frames + d->m};
    tangent_add_row_forces(&d->kinematics, rows_alone);
    const expression *motion = required_forces(b), *row = tangent_row_balances(&d->kinematics),
                     *force = tangent_generalized_forces(b->given, rows_alone);
    memcpy(terms.values + parts.motion, motion, (size_t)d->frames * sizeof *motion);
    memcpy(terms.values + parts.force, force, (size_t)d->frames * sizeof *force);
    for (int i = 0; i < d->m; i++)
        terms.values[parts.rows + i] = given_motion_place(b->given, row[i]);
    return terms;
}

/* Adds what both forms of the tangent share: derivatives by time, and the rows. */
static void add_given_results(struct builder *b) {
    struct derivation *d = b->d;
    const int n = d->n, m = d->m;
    const struct parts parts = parts_of(d);
    struct terms terms = motion_terms(b);
    const expression *balances = tangent_row_balances(&d->kinematics);
    differentiate_terms(d, &terms, (const int[BLOCK_COUNT]){[BY_T] = 1});
    const int f_t = derivation_add_array(d, b->f, "f_t",
                                         "(n) d(M qdd - h - Q - u^T lambda)/dt at given qdd, lambda", n, 1);
    spread_block(b, &terms, parts.motion, BY_T, f_t);
    if (!m)
        return;
    const int g_t = derivation_add_array(d, b->f, "g_t", "(m) d(u qdd - k)/dt at given qdd", m, 1);
    const int G_q = derivation_add_array(d, b->f, "G_q", "(m x n) the same by q", m * n, n);
    const int G_qd = derivation_add_array(d, b->f, "G_qd", "(m x n) the same by qd", m * n, n);
    const int u = derivation_add_array(d, b->f, "u", "(m x n) row coefficients", m * n, n);
    derivatives_fill_block(b, &terms, parts.rows, BY_T, 1, g_t);
    derivatives_fill_by_state(b, balances, 0, 1, G_q);
    derivatives_fill_by_state(b, balances, 1, 1, G_qd);
    spread_u(d, b->f, u);
}

/* ---- The tangent ---- */

void quantity_tangent(struct derivation *d, struct function *f) {
    const int n = d->n;
    struct builder b = start_given(d, f, GIVEN_MOTION);
    add_given_results(&b);
    const int K = derivation_add_array(
        d, f, "K", "(n x n) d(M qdd - h - Q - u^T lambda)/dq at given qdd, lambda", n * n, n);
    const int D = derivation_add_array(d, f, "D", "(n x n) the same by qd", n * n, n);
    const int M = derivation_add_array(d, f, "M", "(n x n) mass matrix", n * n, n);
    tangent_add_loops(&b, &(struct targets){K, D, M, true, -1});
    pair_loops_drop_unread(d->memory, f);
}

void quantity_tangent_vectors(struct derivation *d, struct function *f) {
    const int n = d->n;
    struct builder b = start_given(d, f, GIVEN_MOTION);
    add_given_results(&b);
    const int stiffness =
        derivation_add_array(d, f, "stiffness", "(n) diagonal of K in addition to the vectors", n, 0);
    const int damping =
        derivation_add_array(d, f, "damping", "(n) diagonal of D in addition to the vectors", n, 0);
    force_derivatives_set_own_derivatives(&b, -1, stiffness, damping);
    b.shifts = kinematics_ground_shifts(&d->kinematics);
    b.arrays = pair_loops_open_results(d->plan, &d->kinematics, f);
    tangent_add_joint_vectors(&b);
    d->plan->coupling_count = force_derivatives_add_couplings(&b, -1);
}

bool tangent_prefers_vectors(struct derivation *d) {
    if (derivation_has_massless_joint(d))
        return false;
    struct function scratch = {.quantity = "", .about = ""};
    struct builder b = start_given(d, &scratch, GIVEN_MOTION);
    const int couplings = force_derivatives_add_couplings(&b, -1);
    return refdyn_chain_pays(d->n, d->m, couplings, tangent_is_planar(&b));
}

void quantity_tangent_x(struct derivation *d, struct function *f) {
    const int inputs = d->model->input_count;
    struct builder b = start_given(d, f, GIVEN_MOTION);
    const struct parts parts = parts_of(d);
    struct terms terms = motion_terms(&b);
    differentiate_terms(d, &terms, (const int[BLOCK_COUNT]){[BY_X] = inputs});
    const int f_x = derivation_add_array(d, f, "f_x",
                                         "(n x inputs) d(M qdd - h - Q - u^T lambda)/dx at given qdd, lambda",
                                         d->n * inputs, inputs);
    spread_block(&b, &terms, parts.motion, BY_X, f_x);
    if (!d->m)
        return;
    const int g_x =
        derivation_add_array(d, f, "g_x", "(m x inputs) d(u qdd - k)/dx at given qdd", d->m * inputs, inputs);
    derivatives_fill_block(&b, &terms, parts.rows, BY_X, 1, g_x);
}

void derivatives_open_blocks(struct derivation *d, struct terms *terms, int widths[BLOCK_COUNT]) {
    const bool has_parameters = reads_parameters(d, terms->values, terms->count);
    for (int k = 0; k < BLOCK_COUNT; k++)
        widths[k] = width_of(d, k, has_parameters);
    differentiate_terms(d, terms, widths);
}

/* Adds the straight-line entries of t, inputs and parameters, and the loops of q and qd. */
static void add_block_derivatives(struct builder *b, const struct terms *terms, int first,
                                  const int arrays[BLOCK_COUNT], struct targets targets) {
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        spread_block(b, terms, first, k, arrays[k]);
    targets.by_q = arrays[BY_Q];
    targets.by_qd = arrays[BY_QD];
    tangent_add_loops(b, &targets);
}

/* Arrays for the derivatives of the multipliers, named as in quantities.c. */
struct row_arrays {
    int u, responses, inverse; /* m x n; M^-1 u^T, n x m; (u M^-1 u^T)^-1, m x m */
};

/* (u M^-1 u^T)^-1 */
static int add_inverse(struct builder *b) {
    struct derivation *d = b->d;
    const int m = d->m, inverse = add_matrix(d, b->f, "inverse", m, m);
    for (int row = 0; row < m; row++) {
        expression *unit = derivation_new_values(d, m);
        unit[row] = EXPR_ONE;
        accelerations_solve_rows(d, d->solution, unit, memory_format(d->memory, "inverse_%d", row + 1));
        plan_set_entries(d->memory, b->f, inverse, row * m, unit, m);
    }
    return inverse;
}

static struct row_arrays add_row_arrays(struct builder *b) {
    struct derivation *d = b->d;
    const int n = d->n, m = d->m;
    struct row_arrays a;
    a.u = add_matrix(d, b->f, "u", m, n);
    spread_u(d, b->f, a.u);
    a.responses = add_matrix(d, b->f, "responses", n, m);
    for (int i = 0; i < m; i++)
        derivation_spread(d, b->f, a.responses, i, m, d->solution->responses[i]);
    a.inverse = add_inverse(b);
    return a;
}

/*
 * d(lambda) of one block from its derivatives r of M qdd - h - Q - u^T lambda and g of u qdd - k at given
 * qdd, lambda: M dqdd - u^T dlambda = -r and u dqdd = -g give (u M^-1 u^T) dlambda = (M^-1 u^T)^T r - g.
 * Theory, sect. 7.7.
 */
static void add_multiplier_loops(struct builder *b, const struct row_arrays *a, const int r[BLOCK_COUNT],
                                 const int minus_g[BLOCK_COUNT], const int dlambda[BLOCK_COUNT]) {
    for (int k = 0; k < BLOCK_COUNT; k++) {
        if (r[k] == NOTHING)
            continue;
        force_derivatives_add_product(
            b, minus_g[k], a->responses, r[k], 1,
            memory_format(b->d->memory, "derivatives of lambda %s", blocks[k].about));
        force_derivatives_add_product(b, dlambda[k], a->inverse, minus_g[k], 1, "(u M^-1 u^T)^-1");
    }
}

static void fill_minus_g(struct builder *b, const struct terms *terms, const int minus_g[BLOCK_COUNT]) {
    const expression *balance = tangent_row_balances(&b->d->kinematics);
    derivatives_fill_by_state(b, balance, 0, -1, minus_g[BY_Q]);
    derivatives_fill_by_state(b, balance, 1, -1, minus_g[BY_QD]);
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        derivatives_fill_block(b, terms, parts_of(b->d).rows, k, -1, minus_g[k]);
}

/* Derivatives of lambda, m x width each, from the derivatives `r` of the equations of motion. */
static struct row_arrays add_multiplier_blocks(struct builder *b, const struct terms *terms,
                                               const int widths[BLOCK_COUNT], const int r[BLOCK_COUNT],
                                               int dlambda[BLOCK_COUNT]) {
    int minus_g[BLOCK_COUNT];
    const struct row_arrays arrays = add_row_arrays(b);
    derivatives_add_blocks(b->d, b->f, &(struct block_rows){.before = "rows_", .count = b->d->m}, widths,
                           minus_g);
    derivatives_add_blocks(b->d, b->f, &(struct block_rows){.before = "lambda_", .count = b->d->m}, widths,
                           dlambda);
    fill_minus_g(b, terms, minus_g);
    add_multiplier_loops(b, &arrays, r, minus_g, dlambda);
    return arrays;
}

/* The same from the derivatives at given lambda, dqdd0 = -M^-1 r: (u M^-1 u^T) dlambda = -u dqdd0 - g, and
 * dqdd = dqdd0 + M^-1 u^T dlambda. */
static void add_row_corrections(struct builder *b, const struct terms *terms, const int widths[BLOCK_COUNT],
                                const int dqdd[BLOCK_COUNT]) {
    struct derivation *d = b->d;
    const int n = d->n, m = d->m;
    int minus_g[BLOCK_COUNT], dlambda[BLOCK_COUNT];
    const int u = add_matrix(d, b->f, "u", n, m), responses = add_matrix(d, b->f, "responses", m, n);
    for (int i = 0; i < m; i++) {
        derivation_spread(d, b->f, u, i, m, derivation_rows(d)[i].u);
        derivation_spread(d, b->f, responses, i * n, 1, d->solution->responses[i]);
    }
    const int inverse = add_inverse(b);
    derivatives_add_blocks(d, b->f, &(struct block_rows){.before = "rows_", .count = m}, widths, minus_g);
    derivatives_add_blocks(d, b->f, &(struct block_rows){.before = "lambda_", .count = m}, widths, dlambda);
    fill_minus_g(b, terms, minus_g);
    for (int k = 0; k < BLOCK_COUNT; k++) {
        if (dqdd[k] == NOTHING)
            continue;
        const char *about = memory_format(d->memory, "derivatives of lambda %s", blocks[k].about);
        force_derivatives_add_product(b, minus_g[k], u, dqdd[k], -1, about);
        force_derivatives_add_product(b, dlambda[k], inverse, minus_g[k], 1, "(u M^-1 u^T)^-1");
        force_derivatives_add_product(b, dqdd[k], responses, dlambda[k], 1, "M^-1 u^T dlambda");
    }
}

/* dqdd by q and qd in sweeps, and the other blocks by solving M x = f: theory, sect. 7.7. */
static void add_by_sweeps(struct builder *b, const struct terms *terms, const int widths[BLOCK_COUNT],
                          bool has_rows) {
    struct derivation *d = b->d;
    int dqdd[BLOCK_COUNT];
    derivatives_add_blocks(d, b->f, &(struct block_rows){"", "d(qdd)", "n", d->n}, widths, dqdd);
    acceleration_sweeps_add(b, dqdd[BY_Q], dqdd[BY_QD]);
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        for (int column = 0; column < widths[k]; column++) {
            const struct right_side side = {.f = terms->derivatives[k] + column * terms->count +
                                                 parts_of(d).motion};
            const expression *solved =
                articulated_body_solve(&d->kinematics, accelerations_elimination(d), side, NULL);
            derivation_spread(d, b->f, dqdd[k], column, widths[k], force_derivatives_scaled(d, -1, solved));
        }
    if (has_rows)
        add_row_corrections(b, terms, widths, dqdd);
    pair_loops_drop_unread(d->memory, b->f);
}

/* Replaces r by dqdd = -M^-1 (r - u^T dlambda) with the matrix M: theory, sect. 7.7. */
static void add_by_matrix(struct builder *b, const struct terms *terms, const int widths[BLOCK_COUNT],
                          bool has_rows) {
    struct derivation *d = b->d;
    struct function *f = b->f;
    int r[BLOCK_COUNT], dlambda[BLOCK_COUNT];
    derivatives_add_blocks(d, f, &(struct block_rows){"", "d(qdd)", "n", d->n}, widths, r);
    const int M = add_matrix(d, f, "M", d->n, d->n);
    add_block_derivatives(b, terms, parts_of(d).motion, r,
                          (struct targets){.mass = M, .has_inertia = true, .sign = -1});
    if (has_rows) {
        const struct row_arrays arrays = add_multiplier_blocks(b, terms, widths, r, dlambda);
        for (int k = 0; k < BLOCK_COUNT; k++)
            if (r[k] != NOTHING)
                force_derivatives_add_product(b, r[k], arrays.u, dlambda[k], -1,
                                              "programme forces u^T dlambda");
    }
    pair_loops_add_loop(d->memory, f, LOOP_FACTORING, "M = L^T D L (5.7)")->of.factoring =
        (struct factoring){M};
    for (int k = 0; k < BLOCK_COUNT; k++)
        if (r[k] != NOTHING)
            pair_loops_add_loop(d->memory, f, LOOP_SOLVING, "accelerations")->of.solving =
                (struct solving){M, r[k]};
    pair_loops_drop_unread(d->memory, f);
}

/* Takes the form with fewer operations. With many coordinates the matrix always costs more. */
static void build_acceleration_derivatives(struct derivation *d, struct function *f, bool has_rows) {
    int widths[BLOCK_COUNT];
    struct builder b = start(d, f, has_rows);
    struct terms terms = motion_terms(&b);
    struct function by_sweeps = *f, by_matrix = *f;
    long sweeps = 0, matrix = 0;
    derivatives_open_blocks(d, &terms, widths);
    const bool fits =
        d->model->accelerations != ACCELERATIONS_DENSE && acceleration_sweeps_fit(d, b.applied_forces);
    if (fits) {
        b.f = &by_sweeps;
        add_by_sweeps(&b, &terms, widths, has_rows);
        sweeps = operation_cost_with_loops(d, &by_sweeps);
    }
    const bool is_certain = d->n > MOST_WRITTEN_OUT || d->model->accelerations == ACCELERATIONS_RECURSIVE;
    if (!fits || !is_certain) {
        b.f = &by_matrix;
        add_by_matrix(&b, &terms, widths, has_rows);
        matrix = operation_cost_with_loops(d, &by_matrix);
    }
    *f = fits && (is_certain || sweeps <= matrix) ? by_sweeps : by_matrix;
    if (fits && !is_certain)
        operation_cost_note_choice(d, memory_format(d->memory, "%s %s, %ld (%s %ld)", f->quantity,
                                                    sweeps <= matrix ? "in sweeps" : "with the matrix",
                                                    sweeps <= matrix ? sweeps : matrix,
                                                    sweeps <= matrix ? "with the matrix" : "in sweeps",
                                                    sweeps <= matrix ? matrix : sweeps));
    else
        operation_cost_note_choice(
            d, memory_format(d->memory, "%s %s", f->quantity, fits ? "in sweeps" : "with the matrix"));
}

void quantity_d_qdd(struct derivation *d, struct function *f) {
    build_acceleration_derivatives(d, f, d->m > 0);
}

void quantity_d_qdd_free(struct derivation *d, struct function *f) {
    build_acceleration_derivatives(d, f, false);
}

/* d(u^T lambda) = its derivatives at given lambda + u^T dlambda: theory, sect. 7.7. */
void quantity_d_force(struct derivation *d, struct function *f) {
    int widths[BLOCK_COUNT], force[BLOCK_COUNT], r[BLOCK_COUNT], dlambda[BLOCK_COUNT];
    struct builder b = start(d, f, true);
    struct terms terms = motion_terms(&b);
    struct applied_forces *rows_alone = tangent_no_forces(&d->kinematics);
    derivatives_open_blocks(d, &terms, widths);
    derivatives_add_blocks(d, f, &(struct block_rows){"", "d(force)", "n", d->n}, widths, force);
    derivatives_add_blocks(d, f, &(struct block_rows){.before = "motion_", .count = d->n}, widths, r);
    const int M = add_matrix(d, f, "M", d->n, d->n);
    add_block_derivatives(&b, &terms, parts_of(d).motion, r,
                          (struct targets){.mass = M, .has_inertia = true, .sign = -1});
    const struct row_arrays arrays = add_multiplier_blocks(&b, &terms, widths, r, dlambda);
    tangent_add_row_forces(&d->kinematics, rows_alone);
    b.applied_forces = rows_alone;
    add_block_derivatives(&b, &terms, parts_of(d).force, force, (struct targets){.sign = 1});
    for (int k = 0; k < BLOCK_COUNT; k++)
        if (force[k] != NOTHING)
            force_derivatives_add_product(&b, force[k], arrays.u, dlambda[k], 1,
                                          "programme forces u^T dlambda");
    pair_loops_drop_unread(d->memory, f);
}

/* ---- Inverse dynamics ---- */

void quantity_inverse(struct derivation *d, struct function *f) {
    const struct builder b = start_given(d, f, GIVEN_ACCELERATIONS);
    const int tau = derivation_add_array(d, f, "tau", "(n) M qdd - h - Q [N, N m]", d->n, 0);
    derivation_spread(d, f, tau, 0, 1, required_forces(&b));
}

void quantity_d_inverse(struct derivation *d, struct function *f) {
    int widths[BLOCK_COUNT], arrays[BLOCK_COUNT];
    struct builder b = start_given(d, f, GIVEN_ACCELERATIONS);
    struct terms terms = {.values = (expression *)required_forces(&b), .count = d->frames};
    struct targets targets = {.mass = NOTHING, .sign = -1};
    derivatives_open_blocks(d, &terms, widths);
    derivatives_add_blocks(d, f, &(struct block_rows){"", "d(tau)", "n", d->n}, widths, arrays);
    if (d->wanted_blocks & 1u << BY_QDD)
        targets.mass =
            derivation_add_array(d, f, blocks[BY_QDD].name,
                                 "(n x n) d(tau) by the accelerations: the mass matrix", d->n * d->n, d->n);
    targets.has_inertia = targets.mass != NOTHING || widths[BY_Q] || widths[BY_QD];
    add_block_derivatives(&b, &terms, 0, arrays, targets);
    pair_loops_drop_unread(d->memory, f);
}

/* ---- Statics ---- */

/* Q at qd = 0, by frame. */
static const expression *resting_forces(struct derivation *d) {
    struct applied_forces *applied_forces = tangent_no_forces(&d->kinematics);
    tangent_add_applied_forces(&d->kinematics, applied_forces);
    const expression *applied =
        tangent_generalized_forces(given_motion_at_rest(&d->kinematics), applied_forces);
    return difference(d, applied, dynamics_gravity_forces(&d->kinematics, derivation_composites(d)));
}

void quantity_d_statics(struct derivation *d, struct function *f) {
    int widths[BLOCK_COUNT], arrays[BLOCK_COUNT];
    struct builder b = {.d = d, .f = f};
    struct terms terms = {.values = (expression *)resting_forces(d), .count = d->frames};
    derivatives_open_blocks(d, &terms, widths);
    widths[BY_QD] = 0;
    derivatives_add_blocks(d, f, &(struct block_rows){"", "d(Q)", "n", d->n}, widths, arrays);
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        spread_block(&b, &terms, 0, k, arrays[k]);
    if (arrays[BY_Q] != NOTHING)
        mass_matrix_fill_statics_tangent(d, f, arrays[BY_Q]);
}

/* ---- Parameters that are not emitted ---- */

/* Number of emitted columns before `column`. */
static int columns_before(const bool *is_emitted, int column) {
    int count = 0;
    for (int i = 0; i < column; i++)
        count += is_emitted[i];
    return count;
}

/* Keeps the emitted columns of results that loops over elements write: whole columns. */
static void keep_run_results(struct function *f, const bool *is_emitted) {
    int kept = 0;
    for (int i = 0; i < f->run_result_count; i++) {
        struct run_result result = f->run_results[i];
        const struct array *array = &f->arrays[result.array];
        if (array->by_parameter) {
            const int row = result.entry / array->columns, column = result.entry % array->columns;
            const int width = columns_before(is_emitted, array->columns);
            if (!is_emitted[column])
                continue;
            result.entry = row * width + columns_before(is_emitted, column);
            result.stride = result.stride / array->columns * width;
        }
        f->run_results[kept++] = result;
    }
    f->run_result_count = kept;
}

static void keep_singles(struct array *array, const bool *is_emitted, int width) {
    int kept = 0;
    for (int i = 0; i < array->single_count; i++) {
        struct single single = array->singles[i];
        const int row = single.entry / array->columns, column = single.entry % array->columns;
        if (!is_emitted[column])
            continue;
        single.entry = row * width + columns_before(is_emitted, column);
        array->singles[kept++] = single;
    }
    array->single_count = kept;
}

static void keep_columns(struct function *f, const bool *is_emitted) {
    int offset = 0;
    for (int i = 0; i < plan_count_arrays(f); i++) {
        struct array *array = &f->arrays[i];
        array->offset = offset;
        if (array->by_parameter) {
            const int rows = array->count / array->columns,
                      width = columns_before(is_emitted, array->columns);
            keep_singles(array, is_emitted, width);
            *(i < f->array_count ? &f->out_count : &f->local_out_count) += rows * width - array->count;
            array->columns = width;
            array->count = rows * width;
        }
        offset += array->count;
    }
}

void derivatives_keep_emitted_parameters(struct plan *plan) {
    const int count = plan->model->parameter_count;
    bool *is_emitted = memory_get(plan->memory, ((size_t)count + 1) * sizeof *is_emitted);
    for (int i = 0; i < count; i++)
        expr_symbol(plan->g, SYMBOL_PARAMETER, i,
                    0); /* the zero makes all handles exist before an array by handle is made */
    const bool *needed = plan_mark_nodes_of_functions(plan);
    for (int i = 0; i < count; i++)
        is_emitted[i] = needed[expr_symbol(plan->g, SYMBOL_PARAMETER, i, 0)];
    for (int f = 0; f < plan->function_count; f++) {
        keep_run_results(&plan->functions[f], is_emitted);
        keep_columns(&plan->functions[f], is_emitted);
    }
}
