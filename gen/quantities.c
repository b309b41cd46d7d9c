/*
 * Quantities: what the emitted functions return, each from the recursions of kinematics, dynamics and rows.
 *
 * Takes model and tree, gives the outputs of plan.h. One table names every quantity, says when a scene has it
 * and how it is built; terms that several quantities share are derived once, when first asked for.
 */
#include "quantities.h"
#include "breaks.h"
#include "pairs.h"
#include "runs.h"
#include "sensitivity.h"

#include <stdio.h>
#include <string.h>

/* A pivot below this part of its diagonal term is rounding. */
static const double redundant = 1e-12;

expression *new_values(const struct derivation *d, int count) {
    return memory_get(d->memory, ((size_t)count + 1) * sizeof(expression));
}

static struct derivation *start_derivation(struct plan *plan, const struct tree *tree) {
    struct derivation *d = memory_get(plan->memory, sizeof *d);
    *d = (struct derivation){.plan = plan,
                             .memory = plan->memory,
                             .g = plan->g,
                             .model = plan->model,
                             .n = plan->tree->count,
                             .m = plan->model->row_count,
                             .points = plan->model->point_count,
                             .frames = tree->count};
    derive_kinematics(plan->memory, plan->model, tree, &d->kinematics);
    return d;
}

struct derivation *without_runs(struct derivation *d) {
    if (!d->kinematics.tree->run_count)
        return d;
    if (!d->flat) {
        struct tree *tree = memory_get(d->memory, sizeof *tree);
        roll(d->memory, d->model, d->plan->tree, LOOPS_NEVER, tree);
        d->flat = start_derivation(d->plan, tree);
        d->flat->is_second = true;
    }
    return d->flat;
}

const struct inertia *composites(struct derivation *d) {
    if (!d->composites)
        d->composites = derive_composites(&d->kinematics);
    return d->composites;
}

const struct row_terms *rows(struct derivation *d) {
    if (!d->rows)
        d->rows = derive_rows(&d->kinematics);
    return d->rows;
}

static const expression *mass_matrix(struct derivation *d) {
    if (!d->M)
        d->M = derive_mass_matrix(&d->kinematics, composites(d));
    return d->M;
}

static const struct applied *applied(struct derivation *d) {
    if (!d->applied.others)
        d->applied = derive_applied_forces(&d->kinematics);
    return &d->applied;
}

/* sum of up to three lists, by frame; `sign` of the first */
struct total {
    struct derivation *d;
    const expression *first, *second, *third;
    bool negative;
    expression *sum;
};

static void add_up(void *context, int i) {
    const struct total *x = context;
    struct graph *g = x->d->g;
    const expression first = x->negative ? neg(g, x->first[i]) : x->first[i];
    x->sum[i] = add(g, first, add(g, x->second[i], x->third[i]));
}

static expression *total_of(struct derivation *d, bool negative, const expression *first,
                            const expression *second, const expression *third) {
    const expression *none = new_values(d, d->frames);
    struct total x = {
        d, first, second ? second : none, third ? third : none, negative, new_values(d, d->frames)};
    visit_joints(d->g, d->kinematics.tree, add_up, &x);
    return x.sum;
}

/* Q without gravity, and the printed form's extra term. */
static const expression *applied_total(struct derivation *d) {
    const struct applied *forces = applied(d);
    const expression *printed = d->model->printed_form ? derive_printed_rates(&d->kinematics) : NULL;
    return total_of(d, false, forces->conservative, forces->others, printed);
}

/* h = -c; the printed form is c + 2 s. */
static expression *bias_forces(struct derivation *d) {
    if (!d->bias)
        d->bias = derive_bias_forces(&d->kinematics, false);
    if (!d->model->printed_form)
        return total_of(d, true, d->bias, NULL, NULL);
    const expression *s = derive_printed_sum(&d->kinematics);
    return total_of(d, false, d->bias, s, s);
}

expression *generalized_forces(struct derivation *d) {
    const expression *gravity = derive_gravity_forces(&d->kinematics, composites(d));
    return total_of(d, true, gravity, applied_total(d), NULL);
}

/* f = h + Q in one recursion: gravity stands in the accelerations. The printed h has no such form. */
static expression *all_forces(struct derivation *d) {
    if (d->model->printed_form)
        return total_of(d, false, bias_forces(d), generalized_forces(d), NULL);
    if (!d->falling)
        d->falling = derive_bias_forces(&d->kinematics, true);
    return total_of(d, true, d->falling, applied_total(d), NULL);
}

const struct wrench *loads(struct derivation *d) {
    if (!d->loads)
        d->loads = derive_loads(&d->kinematics);
    return d->loads;
}

static const struct elimination *elimination(struct derivation *d) {
    if (!d->elimination)
        d->elimination = eliminate(&d->kinematics);
    return d->elimination;
}

static const struct factors *factors(struct derivation *d) {
    if (!d->factors)
        d->factors = factor(&d->kinematics, mass_matrix(d));
    return d->factors;
}

/* M^-1 f */
static expression *solve(struct derivation *d, const struct solution *solution, const expression *f) {
    return solution->is_dense ? solve_factored(factors(d), f)
                              : solve_eliminated(&d->kinematics, elimination(d), f, NULL, NULL);
}

static const expression *free_by(struct derivation *d, struct solution *solution) {
    if (solution->free)
        return solution->free;
    if (solution->is_dense || d->model->printed_form)
        solution->free = solve(d, solution, all_forces(d));
    else /* the recursion sums up h on its way */
        solution->free =
            solve_eliminated(&d->kinematics, elimination(d), applied_total(d), loads(d), &solution->frames);
    return solution->free;
}

struct dot_product {
    struct graph *g;
    const expression *a, *b;
};

static expression product_term(void *context, int i) {
    const struct dot_product *x = context;
    return mul(x->g, x->a[i], x->b[i]);
}

static expression dot(struct derivation *d, const expression *a, const expression *b) {
    struct dot_product x = {d->g, a, b};
    return sum_over_joints(d->g, d->kinematics.tree, product_term, &x);
}

/*
 * 1 / pivot, or 0 for a row that says what earlier rows say: S is positive semidefinite, so what is left of
 * such a row's diagonal term is rounding. Its multiplier is then 0.
 */
static expression pivot_inverse(struct derivation *d, expression pivot, expression diagonal) {
    struct graph *g = d->g;
    const expression least = mul(g, number(g, redundant), diagonal);
    if (!pivot)
        return zero(g);
    return choose(g, apply2(g, OP_LESS, least, pivot), quotient(g, one(g), pivot), zero(g));
}

/* S x = rest for the symmetric S = u M^-1 u^T (m x m), by elimination in order of the rows. */
void solve_rows(struct derivation *d, const expression *matrix, expression *rest, const char *what) {
    struct graph *g = d->g;
    const int m = d->m;
    expression *S = new_values(d, m * m), *inverse = new_values(d, m);
    memcpy(S, matrix, (size_t)(m * m) * sizeof *S);
    for (int p = 0; p < m; p++) {
        inverse[p] = pivot_inverse(d, S[p * m + p], matrix[p * m + p]);
        name_value(g, inverse[p], memory_format(d->memory, "row_%d_pivot_inverse", p + 1));
        for (int i = p + 1; i < m; i++) {
            const expression factor = mul(g, S[i * m + p], inverse[p]);
            for (int j = p + 1; j < m; j++)
                S[i * m + j] = sub(g, S[i * m + j], mul(g, factor, S[p * m + j]));
            rest[i] = sub(g, rest[i], mul(g, factor, rest[p]));
        }
    }
    for (int i = m - 1; i >= 0; i--) {
        for (int j = i + 1; j < m; j++)
            rest[i] = sub(g, rest[i], mul(g, S[i * m + j], rest[j]));
        rest[i] = mul(g, rest[i], inverse[i]);
        name_value(g, rest[i], memory_format(d->memory, "row_%d_%s", i + 1, what));
    }
}

/* What the multipliers add. */
struct constraint_effect {
    struct derivation *d;
    struct solution *solution;
};

static void add_effect(void *context, int j) {
    const struct constraint_effect *x = context;
    struct solution *s = x->solution;
    struct graph *g = x->d->g;
    s->qdd[j] = s->free[j];
    for (int i = 0; i < x->d->m; i++)
        s->qdd[j] = add(g, s->qdd[j], mul(g, s->responses[i][j], s->lambda[i]));
}

/* ---- Rows as loads ---- */

/*
 * u^T acts as a force at each point that the row names and on the coordinates that it names itself: solving
 * for those loads, and reading u x from the accelerations of the same points, needs no coefficients of all
 * the coordinates in between.
 */
static bool act_as_loads(struct derivation *d) {
    for (int i = 0; i < d->m; i++)
        for (int p = 0; p < d->model->marker_count; p++) {
            const int frame = d->kinematics.tree->points[p].frame;
            if (frame >= 0 && !vector_is_zero(rows(d)[i].pulls[p]) && !takes_load(elimination(d), frame))
                return false;
        }
    return true;
}

/* The load of one row, negative as solve_eliminated takes it: own axes and origin of each frame. */
static struct wrench *loads_of_row(struct derivation *d, const struct row_terms *row) {
    const struct kinematics *k = &d->kinematics;
    struct wrench *loads = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *loads);
    for (int p = 0; p < d->model->marker_count; p++) {
        const struct fixed_frame *fixed = &k->tree->points[p];
        if (fixed->frame < 0 || vector_is_zero(row->pulls[p]))
            continue;
        const struct vector pull = transpose_times(d->g, k->frames[fixed->frame].rotation.at, row->pulls[p]);
        const struct vector force = vector_scale(d->g, neg(d->g, one(d->g)), pull), none = {{0, 0, 0}};
        const struct vector moment = vector_cross(d->g, vector_of(fixed->placement.position), force);
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
            sum = add(g, sum, mul(g, row->pull[i], x[i]));
        sum = sub(g, sum, vector_dot(g, loads[i].moment, frames[i].angular));
        sum = sub(g, sum, vector_dot(g, loads[i].force, frames[i].linear));
    }
    return sum;
}

/* Responses M^-1 u^T, S and k - u qdd_free, rows as loads. */
static void respond_to_loads(struct derivation *d, struct solution *solution) {
    const int m = d->m;
    const struct row_terms *row = rows(d);
    struct wrench **loads = memory_get(d->memory, ((size_t)m + 1) * sizeof *loads);
    for (int i = 0; i < m; i++) {
        struct acceleration *frames;
        loads[i] = loads_of_row(d, &row[i]);
        solution->responses[i] =
            solve_eliminated(&d->kinematics, elimination(d), row[i].pull, loads[i], &frames);
        for (int j = 0; j <= i; j++)
            solution->S[i * m + j] = solution->S[j * m + i] =
                row_times(d, &row[j], loads[j], solution->responses[i], frames);
    }
    for (int i = 0; i < m; i++)
        solution->lambda[i] =
            sub(d->g, row[i].k, row_times(d, &row[i], loads[i], solution->free, solution->frames));
}

/* The same by the coefficients u. */
static void respond_to_coefficients(struct derivation *d, struct solution *solution) {
    const int m = d->m;
    const struct row_terms *row = rows(d);
    for (int i = 0; i < m; i++)
        solution->responses[i] = solve(d, solution, row[i].u);
    for (int i = 0; i < m; i++) {
        solution->lambda[i] = sub(d->g, row[i].k, dot(d, row[i].u, solution->free));
        for (int j = 0; j <= i; j++)
            solution->S[i * m + j] = solution->S[j * m + i] = dot(d, row[i].u, solution->responses[j]);
    }
}

/*
 * qdd = qdd_free + M^-1 u^T lambda with (u M^-1 u^T) lambda = k - u qdd_free: the GPME with the
 * multipliers eliminated, one more O(n) solution a row.
 */
static const expression *constrained_by(struct derivation *d, struct solution *solution) {
    if (solution->qdd)
        return solution->qdd;
    free_by(d, solution);
    solution->responses = memory_get(d->memory, ((size_t)d->m + 1) * sizeof *solution->responses);
    solution->S = new_values(d, d->m * d->m);
    solution->lambda = new_values(d, d->m);
    remark(d->g, "rows: (u M^-1 u^T) lambda = k - u qdd_free");
    if (solution->frames && act_as_loads(d))
        respond_to_loads(d, solution);
    else
        respond_to_coefficients(d, solution);
    solve_rows(d, solution->S, solution->lambda, "lambda");
    remark(d->g, "qdd = qdd_free + M^-1 u^T lambda");
    solution->qdd = new_values(d, d->frames);
    struct constraint_effect x = {d, solution};
    visit_joints(d->g, d->kinematics.tree, add_effect, &x);
    return solution->qdd;
}

/* ---- Which way of solving M x = f ---- */

/* A division keeps its unit busy for four to five cycles, in which as many products or sums begin and more.
 */
enum { DIVISION_WEIGHT = 4 };

/* How often a call computes a node. */
static long trips(const struct derivation *d, expression e) {
    const uint16_t loop = d->g->nodes[e].loop;
    return !loop || loop == ANY_LOOP ? 1 : d->plan->rolled->runs[d->g->loops[loop].run].count;
}

/* Operations of a call that computes these values and nothing else; what depends on parameters alone is free.
 */
static long weigh(const struct derivation *d, const expression *values, int count) {
    const struct graph *g = d->g;
    bool *needed = memory_get(d->memory, g->count * sizeof *needed);
    long operations = 0;
    for (int i = 0; i < count; i++)
        needed[values[i]] = true;
    mark_operands(g, needed, g->count);
    for (expression e = 0; e < g->count; e++) {
        const enum cost cost = operation_cost(g->nodes[e].operation);
        if (needed[e] && (g->nodes[e].depends & ~ON_PARAMETER) != 0)
            operations +=
                trips(d, e) * (cost == COST_DIV ? DIVISION_WEIGHT : cost == COST_ADD || cost == COST_MUL);
    }
    return operations;
}

typedef const expression *solve_by(struct derivation *d, struct solution *solution);

/* One more choice for the summary and the header. */
static void say(struct derivation *d, const char *choice) {
    struct plan *plan = d->plan;
    if (d->is_second)
        return;
    plan->choices = plan->choices ? memory_format(plan->memory, "%s; %s", plan->choices, choice) : choice;
}

/* "qdd_free recursive, 1055 operations (dense 1512)" */
static void say_choice(struct derivation *d, const char *quantity, const struct solution *chosen,
                       const char *costs) {
    say(d, memory_format(d->memory, "%s %s%s", quantity, chosen->is_dense ? "dense" : "recursive", costs));
}

/*
 * The matrix is taken where it saves a tenth and more: for less the recursion is not given up, which loses no
 * digits to the condition of M. The matrix is not even derived where its factors alone could cost more than
 * the whole recursion, nor with runs of equal elements, whose recursions are loops.
 */
static struct solution *cheaper(struct derivation *d, const char *quantity, solve_by *by) {
    struct solution *recursive = &d->by_method[0], *dense = &d->by_method[1];
    const struct tree *tree = d->kinematics.tree;
    if (tree->run_count) {
        const long operations = weigh(d, by(d, recursive), d->frames);
        say_choice(d, quantity, recursive, memory_format(d->memory, ", %ld operations", operations));
        return recursive;
    }
    const long own = weigh(d, by(d, recursive), d->frames), factoring = factor_operations(tree);
    if (factoring >= own) {
        say_choice(d, quantity, recursive,
                   memory_format(d->memory, ", %ld operations (dense: up to %ld for the factors alone)", own,
                                 factoring));
        return recursive;
    }
    const long other = weigh(d, by(d, dense), d->frames);
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
    say_choice(d, quantity, asked, ", as asked");
    return asked;
}

const expression *free_accelerations(struct derivation *d) {
    if (!d->free_solution)
        d->free_solution = choose_solution(d, "qdd_free", free_by);
    return free_by(d, d->free_solution);
}

void constrained_accelerations(struct derivation *d) {
    if (d->solution)
        return;
    d->solution = choose_solution(d, "qdd", constrained_by);
    d->qdd = (expression *)constrained_by(d, d->solution);
    d->responses = d->solution->responses;
    d->S = d->solution->S;
    d->lambda = d->solution->lambda;
}

expression *add_field(struct derivation *d, struct function *f, const char *name, const char *about,
                      int count, int columns) {
    expression *values = open_field(d->memory, f, (struct field){name, about, 0, count, columns, 0, false});
    f->field_count++;
    f->out_count += count;
    return values;
}

static void fill_field(struct derivation *d, struct function *f, const char *name, const char *about,
                       const expression *values, int count) {
    expression *out = add_field(d, f, name, about, count, 0);
    memcpy(out, values, (size_t)count * sizeof *out);
}

void spread(struct derivation *d, struct function *f, int field, int first, int stride,
            const expression *by_frame) {
    for (int i = 0; i < d->frames; i++) {
        const struct frame *frame = &d->kinematics.tree->frames[i];
        if (frame->kind == FRAME_JOINT)
            give(d->memory, d->kinematics.tree, f, field, first + stride * frame->coordinate,
                 stride * frame->step, i, by_frame[i]);
    }
}

/* Into entries begin + coordinate of the last field. */
static void spread_last(struct derivation *d, struct function *f, int begin, const expression *by_frame) {
    spread(d, f, f->field_count - 1, begin, 1, by_frame);
}

/* A field with a value for each coordinate. */
static void spread_field(struct derivation *d, struct function *f, const char *name, const char *about,
                         const expression *by_frame) {
    add_field(d, f, name, about, d->n, 0);
    spread_last(d, f, 0, by_frame);
}

static void build_h(struct derivation *d, struct function *f) {
    spread_field(d, f, "h", "(n) bias forces [N, N m]", bias_forces(d));
}

/* ---- M: written out, or loops over pairs ---- */

enum {
    MOST_WRITTEN_OUT = 40, /* coordinates: beyond, written-out matrices are not even weighed */
    LOOP_ADVANTAGE = 2     /* operations of loops over pairs, which compilers turn into vectors, for one */
};

/* Operations of loops and of the vectors that they read. */
static long weigh_loops(const struct derivation *d, const struct function *f) {
    struct operation_count count = {.quantity = f->quantity};
    expression *values = new_values(d, value_count(f) + f->run_result_count);
    int kept = 0;
    for (int i = 0; i < value_count(f); i++)
        if (f->out[i] != GIVEN_IN_LOOP)
            values[kept++] = f->out[i];
    for (int i = 0; i < f->run_result_count; i++)
        values[kept++] = f->run_results[i].value;
    for (int i = 0; i < f->loop_count; i++)
        count_loop(f, &f->loops[i], &count);
    return weigh(d, values, kept) + (count.adds + count.muls) / LOOP_ADVANTAGE;
}

/* A matrix, n x n, in both forms. */
struct chosen_matrix {
    const char *name;
    void (*add_loops)(struct derivation *d, struct function *f, int field);
    const expression *(*write_out)(struct derivation *d); /* of a tree without runs */
};

static enum matrix_form cheaper_form(struct derivation *d, const struct chosen_matrix *matrix) {
    struct function trial = {.quantity = matrix->name};
    const char *name = matrix->name;
    add_field(d, &trial, name, "", d->n * d->n, d->n);
    matrix->add_loops(d, &trial, 0);
    drop_unread(d->memory, &trial);
    const long loops = weigh_loops(d, &trial);
    if (d->n > MOST_WRITTEN_OUT) {
        say(d, memory_format(d->memory, "%s in loops, %ld", name, loops));
        return FORM_LOOPS;
    }
    const long written = weigh(d, matrix->write_out(without_runs(d)), d->n * d->n);
    if (loops < written) {
        say(d, memory_format(d->memory, "%s in loops, %ld (written out %ld)", name, loops, written));
        return FORM_LOOPS;
    }
    say(d, memory_format(d->memory, "%s written out, %ld (loops %ld)", name, written, loops));
    return FORM_WRITTEN;
}

static bool is_symmetric(const expression *matrix, int n) {
    for (int i = 0; i < n * n; i++)
        if (matrix[i] != matrix[i % n * n + i / n])
            return false;
    return true;
}

/* When all other fields are there: loops and their local arrays stand behind them. */
static void fill_matrix(struct derivation *d, struct function *f, int field,
                        const struct chosen_matrix *matrix, enum matrix_form *form) {
    if (*form == FORM_OPEN)
        *form = cheaper_form(d, matrix);
    if (*form == FORM_LOOPS) {
        matrix->add_loops(d, f, field);
        drop_unread(d->memory, f);
        return;
    }
    const expression *entries = matrix->write_out(without_runs(d));
    memcpy(f->out + f->fields[field].offset, entries, (size_t)(d->n * d->n) * sizeof(expression));
    f->fields[field].symmetric = is_symmetric(entries, d->n) ? d->n : 0;
}

static int add_mass_field(struct derivation *d, struct function *f) {
    add_field(d, f, "M", "(n x n) mass matrix [kg, kg m, kg m^2]", d->n * d->n, d->n);
    return f->field_count - 1;
}

static void fill_mass_field(struct derivation *d, struct function *f, int field) {
    static const struct chosen_matrix mass = {"M", add_mass_pairs, mass_matrix};
    fill_matrix(d, f, field, &mass, &d->mass_form);
}

static const expression *statics_tangent(struct derivation *d) {
    const int n = d->n;
    if (d->statics_tangent)
        return d->statics_tangent;
    d->statics_tangent = new_values(d, n * n);
    const expression *gravity = derive_gravity_tangent(&d->kinematics, composites(d));
    const expression *forces = derive_applied_tangent(&d->kinematics);
    for (int i = 0; i < n * n; i++)
        d->statics_tangent[i] = sub(d->g, forces[i], gravity[i]);
    return d->statics_tangent;
}

void fill_statics_tangent(struct derivation *d, struct function *f, int field) {
    static const struct chosen_matrix tangent = {"Q_q", add_statics_pairs, statics_tangent};
    fill_matrix(d, f, field, &tangent, &d->statics_form);
}

static void build_M(struct derivation *d, struct function *f) {
    fill_mass_field(d, f, add_mass_field(d, f));
}

static void build_M_h(struct derivation *d, struct function *f) {
    const int mass = add_mass_field(d, f);
    build_h(d, f);
    fill_mass_field(d, f, mass);
}

static void build_Q(struct derivation *d, struct function *f) {
    spread_field(d, f, "Q", "(n) generalized forces [N, N m]", generalized_forces(d));
}

static void build_u(struct derivation *d, struct function *f) {
    add_field(d, f, "u", "(m x n) row coefficients, u qdd + v = 0", d->m * d->n, d->n);
    for (int i = 0; i < d->m; i++)
        spread_last(d, f, i * d->n, rows(d)[i].u);
}

/* The function of a quantity, built when it is not there yet. */
static const struct function *provide(struct derivation *d, const char *quantity);

/* One field more of a composed function. */
static void compose(struct derivation *d, struct function *f, const char *quantity, const char *field) {
    const struct function *from = provide(d, quantity);
    int index = 0;
    while (strcmp(from->fields[index].name, field))
        index++;
    const struct field source = from->fields[index];
    add_field(d, f, source.name, source.about, source.count, source.columns);
    f->parts = memory_room(d->memory, f->parts, f->part_count, &f->part_capacity, sizeof *f->parts);
    f->parts[f->part_count++] = (struct part){from, index, f->field_count - 1};
}

/* The same into a local array, for loops; its number. */
static int compose_local(struct derivation *d, struct function *f, const char *quantity, const char *field) {
    const struct function *from = provide(d, quantity);
    int index = 0, local;
    while (strcmp(from->fields[index].name, field))
        index++;
    const struct field source = from->fields[index];
    add_local(d->memory, f, source.name, source.count, source.columns ? source.columns : 1, &local);
    f->parts = memory_room(d->memory, f->parts, f->part_count, &f->part_capacity, sizeof *f->parts);
    f->parts[f->part_count++] = (struct part){from, index, local};
    return local;
}

static void add_v(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "v", "(m) rest of the rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        out[i] = rows(d)[i].v;
}

static void build_phi(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "phi", "(m) residuals of position rows, 0 for others", d->m, 0);
    for (int i = 0; i < d->m; i++)
        out[i] = rows(d)[i].phi;
}

static void build_psi(struct derivation *d, struct function *f) {
    expression *out =
        add_field(d, f, "psi", "(m) velocity-level residuals, 0 for acceleration rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        out[i] = rows(d)[i].psi;
}

static void add_k(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "k", "(m) stabilised right side, u qdd = k", d->m, 0);
    for (int i = 0; i < d->m; i++)
        out[i] = rows(d)[i].k;
}

/* All about the rows: most of it they share. */
static void build_row_terms(struct derivation *d, struct function *f) {
    build_u(d, f);
    add_v(d, f);
    build_phi(d, f);
    build_psi(d, f);
    add_k(d, f);
}

static void build_v(struct derivation *d, struct function *f) {
    compose(d, f, "row_terms", "v");
}

static void build_k(struct derivation *d, struct function *f) {
    compose(d, f, "row_terms", "k");
}

static void build_point_vectors(struct derivation *d, struct function *f, const char *name,
                                const char *about) {
    expression *out = add_field(d, f, name, about, 3 * d->points, 3);
    for (int p = 0; p < d->points; p++) {
        const struct point_motion *point = &d->kinematics.points[p];
        const struct vector *value = !strcmp(name, "r")    ? &point->r
                                     : !strcmp(name, "rd") ? &point->rd
                                                           : &point->d;
        memcpy(out + 3 * p, value->at, sizeof value->at);
    }
}

static void build_r(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "r", "(points x 3) positions [m]");
}

static void build_rd(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "rd", "(points x 3) velocities [m/s]");
}

static void build_d(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "d", "(points x 3) bias accelerations, rdd = C qdd + d [m/s^2]");
}

static void build_C(struct derivation *d, struct function *f) {
    add_field(d, f, "C", "(points x 3 x n) rd = C qd", 3 * d->points * d->n, d->n);
    expression *row = new_values(d, d->frames);
    for (int p = 0; p < d->points; p++)
        for (int a = 0; a < 3; a++) {
            for (int j = 0; j < d->frames; j++)
                row[j] = d->kinematics.points[p].columns[j].at[a];
            spread_last(d, f, (3 * p + a) * d->n, row);
        }
}

static void build_energy(struct derivation *d, struct function *f) {
    struct graph *g = d->g;
    expression *out = add_field(d, f, "energy", "(2) kinetic, potential [J]", 2, 0);
    out[0] = derive_kinetic_energy(&d->kinematics);
    const expression gravity = derive_gravity_energy(&d->kinematics, composites(d));
    out[1] = add(g, gravity, derive_applied_energy(&d->kinematics));
}

static expression power_of_joint(void *context, int i) {
    const struct derivation *d = context;
    return mul(d->g, d->applied.others[i], coordinate_of(&d->kinematics, i, 1));
}

static void build_power(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "power", "(1) of forces in Q without a potential [W]", 1, 0);
    applied(d);
    out[0] = sum_over_joints(d->g, d->kinematics.tree, power_of_joint, d);
}

static void build_Q_q(struct derivation *d, struct function *f) {
    add_field(d, f, "Q_q", "(n x n) dQ_i/dq_j at qd = 0", d->n * d->n, d->n);
    fill_statics_tangent(d, f, 0);
}

static void build_qdd_free(struct derivation *d, struct function *f) {
    spread_field(d, f, "qdd", "(n) accelerations without constraints, M qdd = h + Q", free_accelerations(d));
}

static void build_constrained(struct derivation *d, struct function *f) {
    constrained_accelerations(d);
    spread_field(d, f, "qdd", "(n) accelerations with stabilised constraints", d->qdd);
    fill_field(d, f, "lambda", "(m) multipliers, r = u^T lambda", d->lambda, d->m);
}

static void build_qdd(struct derivation *d, struct function *f) {
    compose(d, f, "constrained", "qdd");
}

/* r = u^T lambda */
static void build_force(struct derivation *d, struct function *f) {
    add_field(d, f, "force", "(n) programme force r = M qdd - h - Q = u^T lambda [N, N m]", d->n, 0);
    const int u = compose_local(d, f, "u", "u"), lambda = compose_local(d, f, "constrained", "lambda");
    add_loop(d->memory, f, LOOP_PRODUCT, "r = u^T lambda")->of.product = (struct product){0, u, lambda, 1};
}

static void build_f(struct derivation *d, struct function *f) {
    spread_field(d, f, "f", "(n) h + Q [N, N m]", all_forces(d));
}

static void build_equations(struct derivation *d, struct function *f) {
    static const char *const rows[] = {"u", "v", "phi", "psi", "k"};
    compose(d, f, "M", "M");
    compose(d, f, "f", "f");
    for (int i = 0; d->m && i < 5; i++)
        compose(d, f, "row_terms", rows[i]);
}

static void build_course(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "course", "values that the model records, by NAME_model.courses",
                                d->model->course_count, 0);
    for (int i = 0; i < d->model->course_count; i++)
        out[i] = with_points(&d->kinematics, d->model->courses[i].value);
}

static void build_breaks(struct derivation *d, struct function *f) {
    fill_field(d, f, "breaks", "times at which formulas of time alone have kinks, in no order [s]",
               d->plan->breaks, d->plan->break_count);
}

static void build_start(struct derivation *d, struct function *f) {
    const struct frame *frames = d->kinematics.tree->frames;
    expression *start = new_values(d, d->frames), *rate = new_values(d, d->frames);
    add_field(d, f, "start", "(2 n) q and qd at the start of a motion", 2 * d->n, 0);
    for (int i = 0; i < d->frames; i++) {
        start[i] = frames[i].joint.start;
        rate[i] = frames[i].joint.start_rate;
    }
    spread_last(d, f, 0, start);
    spread_last(d, f, d->n, rate);
}

static bool is_set_by_anchor(const struct derivation *d, int parameter) {
    return d->model->parameters[parameter].is_anchored && !d->model->parameters[parameter].is_given;
}

static void build_anchor(struct derivation *d, struct function *f) {
    struct plan *plan = d->plan;
    expression *out = add_field(d, f, "anchored", "values at the start of a motion, by NAME_model.anchored",
                                plan->anchored_count, 0);
    for (int i = 0; i < plan->anchored_count; i++)
        out[i] = with_points(&d->kinematics, d->model->parameters[plan->anchored[i]].anchor);
}

static bool always(const struct derivation *d) {
    return d->n > 0;
}

static bool is_corrected(const struct derivation *d) {
    return d->n > 0 && !d->model->printed_form;
}

static bool has_rows(const struct derivation *d) {
    return d->m > 0;
}

static bool is_corrected_with_rows(const struct derivation *d) {
    return is_corrected(d) && has_rows(d);
}

static bool has_level(const struct derivation *d, enum row_level highest) {
    for (int i = 0; i < d->m; i++)
        if (d->model->rows[i].level <= highest)
            return true;
    return false;
}

static bool has_position_rows(const struct derivation *d) {
    return has_level(d, ROW_POSITION);
}

static bool has_velocity_rows(const struct derivation *d) {
    return has_level(d, ROW_VELOCITY);
}

static bool has_points(const struct derivation *d) {
    return d->points > 0;
}

static bool has_work(const struct derivation *d) {
    for (int i = 0; i < d->n; i++)
        if (d->plan->tree->frames[i].joint.damping)
            return true;
    return d->model->force_count + d->model->load_count > 0;
}

static bool has_courses(const struct derivation *d) {
    return d->model->course_count > 0;
}

static bool has_breaks(const struct derivation *d) {
    return d->plan->break_count > 0;
}

static bool has_anchors(const struct derivation *d) {
    return d->plan->anchored_count > 0;
}

struct quantity {
    const char *name, *about;
    bool (*exists)(const struct derivation *d);
    const char *reason; /* why a scene has it not */
    void (*build)(struct derivation *d, struct function *f);
    bool on_request; /* emitted when it is named, not by default */
};

/* `anchor` and `start` stand last: they set what the others read. */
static const struct quantity quantities[] = {
    {"M", "mass matrix", always, "", build_M, false},
    {"h", "bias forces h = -c (Coriolis, centrifugal)", always, "", build_h, false},
    {"Q", "generalized forces: gravity, springs, dampers and those that the model names", always, "", build_Q,
     false},
    {"u", "row coefficients, u qdd + v = 0", has_rows, "constraints", build_u, false},
    {"v", "rest of the rows, u qdd + v = 0", has_rows, "constraints", build_v, false},
    {"phi", "position-level residuals", has_position_rows, "position rows", build_phi, false},
    {"psi", "velocity-level residuals", has_velocity_rows, "position or velocity rows", build_psi, false},
    {"k", "stabilised right side k = -v - 2 alpha psi - beta^2 phi", has_rows, "constraints", build_k, false},
    {"r", "positions of the points", has_points, "points", build_r, false},
    {"rd", "velocities of the points", has_points, "points", build_rd, false},
    {"C", "columns of the points, rd = C qd", has_points, "points", build_C, false},
    {"d", "bias accelerations of the points, rdd = C qdd + d", has_points, "points", build_d, false},
    {"energy", "kinetic and potential energy", always, "", build_energy, false},
    {"power", "power of all forces in Q that have no potential", has_work, "forces without a potential",
     build_power, false},
    {"Q_q", "tangent of statics, dQ/dq at qd = 0", always, "", build_Q_q, false},
    {"M_h", "M and h in one call, work shared", always, "", build_M_h, true},
    {"qdd_free", "accelerations without constraints, O(n)", always, "", build_qdd_free, false},
    {"qdd", "accelerations with stabilised constraints, O(n m)", has_rows, "constraints", build_qdd, false},
    {"force", "programme force r = M qdd - h - Q", has_rows, "constraints", build_force, false},
    {"equations", "M, h + Q and the rows in one call, work shared", always, "", build_equations, false},
    {"tangent", "derivatives of M qdd - h - Q - u^T lambda and u qdd - k at held qdd and lambda",
     is_corrected, "corrected form", build_tangent, true},
    {"d_qdd", "derivatives of qdd", is_corrected_with_rows, "constraints in the corrected form", build_d_qdd,
     true},
    {"d_qdd_free", "derivatives of qdd_free", is_corrected, "corrected form", build_d_qdd_free, true},
    {"d_force", "derivatives of the programme force", is_corrected_with_rows,
     "constraints in the corrected form", build_d_force, true},
    {"d_statics", "derivatives of Q at qd = 0", is_corrected, "corrected form", build_d_statics, true},
    {"d_rows", "derivatives of phi, psi and k", has_rows, "constraints", build_d_rows, true},
    {"f", "h + Q in one recursion", always, "", build_f, true},
    {"row_terms", "u, v, phi, psi and k in one call", has_rows, "constraints", build_row_terms, true},
    {"constrained", "qdd and multipliers in one call", has_rows, "constraints", build_constrained, true},
    {"course", "values that the model records with a motion", has_courses, "courses", build_course, false},
    {"breaks", "times at which formulas of time alone have kinks", has_breaks, "kinks in time", build_breaks,
     false},
    {"anchor", "parameters whose default is a value at the start of a motion", has_anchors,
     "anchored parameters", build_anchor, false},
    {"start", "coordinates and rates at the start of a motion", always, "", build_start, false},
};

enum { QUANTITY_COUNT = sizeof quantities / sizeof *quantities };

/* Is `name` one of the comma-separated words of `list`? */
static bool is_in_list(const char *list, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

/* Without a list, and as "all" in one, all but what is emitted on request alone. */
static bool is_asked_for(const struct quantity *quantity, const char *emit) {
    if (emit && is_in_list(emit, quantity->name))
        return true;
    return !quantity->on_request && (!emit || is_in_list(emit, "all"));
}

/* The first word of `emit` that names no quantity, with what is allowed; NULL when there is none. */
static const char *wrong_word(struct memory *memory, const char *word) {
    const char *names[QUANTITY_COUNT], *all = "all";
    if (!strcmp(word, "all"))
        return NULL;
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        names[i] = quantities[i].name;
        all = memory_format(memory, "%s %s", all, names[i]);
        if (!strcmp(names[i], word))
            return NULL;
    }
    const char *near = nearest_name(word, names, QUANTITY_COUNT);
    if (near)
        return memory_format(memory, "no quantity is called '%s', the nearest is %s", word, near);
    return memory_format(memory, "no quantity is called '%s', known: %s", word, all);
}

const char *gen_wrong_emit(struct generation *generation, const char *emit) {
    if (setjmp(generation->out_of_memory))
        return "out of memory";
    char *copy = memory_text(&generation->memory, emit);
    const char *word = strtok(copy, ","), *wrong = word ? NULL : "no quantity is named";
    for (; word && !wrong; word = strtok(NULL, ","))
        wrong = wrong_word(&generation->memory, word);
    return wrong;
}

/* "no constraints: u v k qdd force; no points: r rd C d" */
static void say_left_out(struct plan *plan, const struct quantity *quantity, const char **last_reason) {
    const char *before = plan->left_out ? plan->left_out : "";
    if (*last_reason && !strcmp(*last_reason, quantity->reason))
        plan->left_out = memory_format(plan->memory, "%s %s", before, quantity->name);
    else
        plan->left_out = memory_format(plan->memory, "%s%sno %s: %s", before, *before ? "; " : "",
                                       quantity->reason, quantity->name);
    *last_reason = quantity->reason;
}

/* Anchored parameters that some function listed so far reads. */
static void list_anchored(struct derivation *d) {
    struct plan *plan = d->plan;
    bool *read = memory_get(d->memory, ((size_t)d->model->parameter_count + 1) * sizeof *read);
    const bool *needed = nodes_of_functions(plan);
    for (expression e = 0; e < d->g->count; e++) {
        const struct symbol *s = needed[e] ? as_symbol(d->g, e) : NULL;
        if (s && s->kind == SYMBOL_PARAMETER)
            read[s->index] = true;
    }
    plan->anchored = memory_get(d->memory, ((size_t)d->model->parameter_count + 1) * sizeof *plan->anchored);
    for (int i = 0; i < d->model->parameter_count; i++)
        if (read[i] && is_set_by_anchor(d, i))
            plan->anchored[plan->anchored_count++] = i;
}

static struct function *function_of(const struct plan *plan, const char *quantity) {
    for (int f = 0; f < plan->function_count; f++)
        if (!strcmp(plan->functions[f].quantity, quantity))
            return &plan->functions[f];
    return NULL;
}

static struct function *build_quantity(struct derivation *d, const struct quantity *quantity) {
    struct function *function = &d->plan->functions[d->plan->function_count++];
    *function = (struct function){.quantity = quantity->name, .about = quantity->about};
    quantity->build(d, function);
    return function;
}

static const struct function *provide(struct derivation *d, const char *name) {
    const struct function *function = function_of(d->plan, name);
    const struct quantity *quantity = quantities;
    while (strcmp(quantity->name, name))
        quantity++;
    return function ? function : build_quantity(d, quantity);
}

/* Beside what is asked for: what anchors parameters and tells breaks. */
static bool is_wanted(const struct derivation *d, const struct quantity *quantity, const char *emit) {
    return is_asked_for(quantity, emit) || quantity->build == build_anchor ||
           quantity->build == build_breaks || (quantity->build == build_start && has_anchors(d));
}

void list_functions(struct plan *plan, const char *emit) {
    struct derivation *d = start_derivation(plan, plan->rolled);
    const char *last_reason = NULL;
    plan->functions = memory_get(plan->memory, QUANTITY_COUNT * sizeof *plan->functions);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        const struct quantity *quantity = &quantities[i];
        if (quantity->build == build_breaks)
            find_breaks(plan);
        if (quantity->build == build_anchor)
            list_anchored(d);
        if (quantity->on_request && !is_asked_for(quantity, emit))
            continue;
        if (!quantity->exists(d))
            say_left_out(plan, quantity, &last_reason);
        else if (is_wanted(d, quantity, emit) && !function_of(plan, quantity->name))
            build_quantity(d, quantity);
    }
    keep_emitted_parameters(plan);
}
