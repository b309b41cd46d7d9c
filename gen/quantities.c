/*
 * Quantities: what the emitted functions return, each from the recursions of kinematics, dynamics and rows.
 *
 * Takes model and tree, gives the outputs of plan.h. One table names every quantity, says when a scene has it
 * and how it is built; terms that several quantities share are derived once, when first asked for.
 */
#include "quantities.h"
#include "breaks.h"
#include "sensitivity.h"

#include <stdio.h>
#include <string.h>

/* A pivot below this part of its diagonal term is rounding. */
static const double redundant = 1e-12;

expression *new_values(const struct derivation *d, int count) {
    return memory_get(d->memory, ((size_t)count + 1) * sizeof(expression));
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

static void add_applied(struct derivation *d, expression *Q) {
    const struct applied *forces = applied(d);
    const expression *printed = d->model->printed_form ? derive_printed_rates(&d->kinematics) : NULL;
    for (int i = 0; i < d->n; i++) {
        Q[i] = add(d->g, Q[i], add(d->g, forces->conservative[i], forces->others[i]));
        if (printed)
            Q[i] = add(d->g, Q[i], printed[i]);
    }
}

/* h = -c; the printed form is c + 2 s. */
static expression *bias_forces(struct derivation *d) {
    expression *h = new_values(d, d->n);
    if (!d->bias)
        d->bias = derive_bias_forces(&d->kinematics, false);
    const expression *s = d->model->printed_form ? derive_printed_sum(&d->kinematics) : NULL;
    for (int i = 0; i < d->n; i++)
        h[i] = s ? add(d->g, d->bias[i], add(d->g, s[i], s[i])) : neg(d->g, d->bias[i]);
    return h;
}

expression *generalized_forces(struct derivation *d) {
    expression *Q = new_values(d, d->n);
    const expression *gravity = derive_gravity_forces(&d->kinematics, composites(d));
    for (int i = 0; i < d->n; i++)
        Q[i] = neg(d->g, gravity[i]);
    add_applied(d, Q);
    return Q;
}

/* f = h + Q in one recursion: gravity stands in the accelerations. The printed h has no such form. */
static expression *all_forces(struct derivation *d) {
    expression *f = new_values(d, d->n);
    if (d->model->printed_form) {
        const expression *h = bias_forces(d), *Q = generalized_forces(d);
        for (int i = 0; i < d->n; i++)
            f[i] = add(d->g, h[i], Q[i]);
        return f;
    }
    if (!d->falling)
        d->falling = derive_bias_forces(&d->kinematics, true);
    for (int i = 0; i < d->n; i++)
        f[i] = neg(d->g, d->falling[i]);
    add_applied(d, f);
    return f;
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

const expression *free_accelerations(struct derivation *d) {
    const struct kinematics *k = &d->kinematics;
    if (!d->qdd_free && d->model->printed_form) {
        d->qdd_free = solve_eliminated(k, elimination(d), all_forces(d), NULL);
    } else if (!d->qdd_free) {
        expression *applied_forces = new_values(d, d->n);
        add_applied(d, applied_forces);
        d->qdd_free = solve_eliminated(k, elimination(d), applied_forces, loads(d));
    }
    return d->qdd_free;
}

static expression dot(struct derivation *d, const expression *a, const expression *b) {
    expression sum = 0;
    for (int i = 0; i < d->n; i++)
        sum = add(d->g, sum, mul(d->g, a[i], b[i]));
    return sum;
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

/*
 * qdd = qdd_free + M^-1 u^T lambda with (u M^-1 u^T) lambda = k - u qdd_free: the GPME with the
 * multipliers eliminated, one more O(n) solution a row. The programme force is r = u^T lambda.
 */
void constrained_accelerations(struct derivation *d) {
    if (d->qdd)
        return;
    const int m = d->m, n = d->n;
    const struct row_terms *row = rows(d);
    const expression *free = free_accelerations(d);
    expression **response = d->responses = memory_get(d->memory, ((size_t)m + 1) * sizeof *response);
    expression *S = d->S = new_values(d, m * m), *lambda = d->lambda = new_values(d, m);
    for (int i = 0; i < m; i++)
        response[i] = solve_eliminated(&d->kinematics, elimination(d), row[i].u, NULL);
    remark(d->g, "rows: (u M^-1 u^T) lambda = k - u qdd_free");
    for (int i = 0; i < m; i++) {
        lambda[i] = sub(d->g, row[i].k, dot(d, row[i].u, free));
        for (int j = 0; j <= i; j++)
            S[i * m + j] = S[j * m + i] = dot(d, row[i].u, response[j]);
    }
    solve_rows(d, S, lambda, "lambda");
    remark(d->g, "programme force r = u^T lambda, qdd = qdd_free + M^-1 r");
    d->qdd = new_values(d, n);
    d->force = new_values(d, n);
    for (int j = 0; j < n; j++) {
        d->qdd[j] = free[j];
        for (int i = 0; i < m; i++) {
            d->force[j] = add(d->g, d->force[j], mul(d->g, row[i].u[j], lambda[i]));
            d->qdd[j] = add(d->g, d->qdd[j], mul(d->g, response[i][j], lambda[i]));
        }
    }
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
    expression *out = add_field(d, f, name, about, count, count > d->n ? d->n : 0);
    memcpy(out, values, (size_t)count * sizeof *out);
}

static void build_M(struct derivation *d, struct function *f) {
    const expression *M = mass_matrix(d);
    fill_field(d, f, "M", "(n x n) mass matrix [kg, kg m, kg m^2]", M, d->n * d->n);
    f->fields[f->field_count - 1].symmetric = d->n;
}

static void build_h(struct derivation *d, struct function *f) {
    fill_field(d, f, "h", "(n) bias forces [N, N m]", bias_forces(d), d->n);
}

static void build_Q(struct derivation *d, struct function *f) {
    fill_field(d, f, "Q", "(n) generalized forces [N, N m]", generalized_forces(d), d->n);
}

static void build_u(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "u", "(m x n) row coefficients, u qdd + v = 0", d->m * d->n, d->n);
    for (int i = 0; i < d->m; i++)
        memcpy(out + i * d->n, rows(d)[i].u, (size_t)d->n * sizeof *out);
}

static void build_v(struct derivation *d, struct function *f) {
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

static void build_k(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "k", "(m) stabilised right side, u qdd = k", d->m, 0);
    for (int i = 0; i < d->m; i++)
        out[i] = rows(d)[i].k;
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
    expression *out = add_field(d, f, "C", "(points x 3 x n) rd = C qd", 3 * d->points * d->n, d->n);
    for (int p = 0; p < d->points; p++)
        for (int a = 0; a < 3; a++)
            for (int j = 0; j < d->n; j++)
                out[(3 * p + a) * d->n + j] = d->kinematics.points[p].columns[j].at[a];
}

static void build_energy(struct derivation *d, struct function *f) {
    struct graph *g = d->g;
    expression *out = add_field(d, f, "energy", "(2) kinetic, potential [J]", 2, 0);
    out[0] = derive_kinetic_energy(&d->kinematics);
    const expression gravity = derive_gravity_energy(&d->kinematics, composites(d));
    out[1] = add(g, gravity, derive_applied_energy(&d->kinematics));
}

static void build_power(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "power", "(1) of forces in Q without a potential [W]", 1, 0);
    for (int i = 0; i < d->n; i++)
        out[0] = add(d->g, out[0], mul(d->g, applied(d)->others[i], symbol(d->g, SYMBOL_COORDINATE, i, 1)));
}

const expression *statics_tangent(struct derivation *d) {
    const int n = d->n;
    expression *tangent = new_values(d, n * n);
    const expression *gravity = derive_gravity_tangent(&d->kinematics, composites(d));
    const expression *forces = derive_applied_tangent(&d->kinematics);
    for (int i = 0; i < n * n; i++)
        tangent[i] = sub(d->g, forces[i], gravity[i]);
    return tangent;
}

static void build_Q_q(struct derivation *d, struct function *f) {
    const int n = d->n;
    const expression *tangent = statics_tangent(d);
    bool symmetric = true; /* all forces have a potential */
    for (int i = 0; i < n * n; i++)
        symmetric = symmetric && tangent[i] == tangent[i % n * n + i / n];
    fill_field(d, f, "Q_q", "(n x n) dQ_i/dq_j at qd = 0", tangent, n * n);
    f->fields[f->field_count - 1].symmetric = symmetric ? n : 0;
}

static void build_qdd_free(struct derivation *d, struct function *f) {
    fill_field(d, f, "qdd", "(n) accelerations without constraints, M qdd = h + Q", free_accelerations(d),
               d->n);
}

static void build_qdd(struct derivation *d, struct function *f) {
    constrained_accelerations(d);
    fill_field(d, f, "qdd", "(n) accelerations with stabilised constraints", d->qdd, d->n);
}

static void build_force(struct derivation *d, struct function *f) {
    constrained_accelerations(d);
    fill_field(d, f, "force", "(n) programme force r = M qdd - h - Q [N, N m]", d->force, d->n);
}

static void build_equations(struct derivation *d, struct function *f) {
    build_M(d, f);
    fill_field(d, f, "f", "(n) h + Q [N, N m]", all_forces(d), d->n);
    if (!d->m)
        return;
    build_u(d, f);
    build_v(d, f);
    build_phi(d, f);
    build_psi(d, f);
    build_k(d, f);
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
    f->fields[f->field_count - 1].columns = 0;
}

static void build_start(struct derivation *d, struct function *f) {
    expression *out = add_field(d, f, "start", "(2 n) q and qd at the start of a motion", 2 * d->n, 0);
    for (int i = 0; i < d->n; i++) {
        out[i] = d->plan->tree->frames[i].joint.start;
        out[d->n + i] = d->plan->tree->frames[i].joint.start_rate;
    }
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

void list_functions(struct plan *plan, const char *emit) {
    struct derivation d = {.plan = plan, .memory = plan->memory, .g = plan->g, .model = plan->model};
    const char *last_reason = NULL;
    d.n = plan->tree->count;
    d.m = plan->model->row_count;
    d.points = plan->model->point_count;
    derive_kinematics(plan->memory, plan->model, plan->tree, &d.kinematics);
    plan->functions = memory_get(plan->memory, QUANTITY_COUNT * sizeof *plan->functions);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        const struct quantity *quantity = &quantities[i];
        if (quantity->build == build_breaks)
            find_breaks(plan);
        if (quantity->build == build_anchor)
            list_anchored(&d);
        if (quantity->on_request && !is_asked_for(quantity, emit))
            continue;
        if (!quantity->exists(&d)) {
            say_left_out(plan, quantity, &last_reason);
            continue;
        }
        const bool is_needed = quantity->build == build_anchor || quantity->build == build_breaks ||
                               (quantity->build == build_start && has_anchors(&d));
        if (!is_asked_for(quantity, emit) && !is_needed)
            continue;
        struct function *function = &plan->functions[plan->function_count++];
        *function = (struct function){.quantity = quantity->name, .about = quantity->about};
        quantity->build(&d, function);
    }
    keep_emitted_parameters(plan);
}
