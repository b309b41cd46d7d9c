/*
 * Quantities: what the emitted functions return, each from the recursions of kinematics, dynamics and rows.
 *
 * Takes model and tree, gives the outputs of plan.h. One table names every quantity, says when a scene has it
 * and how it is built; terms that several quantities share are derived once, when first asked for.
 */
#include "gen/quantities/quantities.h"
#include "gen/dynamics/dynamics.h"

#include <stdio.h>
#include <string.h>

/* An entry of the last array. */
static void set_last(struct derivation *d, struct function *f, int entry, expression value) {
    plan_set_entry(d->memory, f, f->array_count - 1, entry, value);
}

static void fill_array(struct derivation *d, struct function *f, const char *name, const char *about,
                       const expression *values, int count) {
    plan_set_entries(d->memory, f, derivation_add_array(d, f, name, about, count, 0), 0, values, count);
}

/* Into entries begin + coordinate of the last array. */
static void spread_last(struct derivation *d, struct function *f, int begin, const expression *by_frame) {
    derivation_spread(d, f, f->array_count - 1, begin, 1, by_frame);
}

/* An array with a value for each coordinate. */
static void spread_array(struct derivation *d, struct function *f, const char *name, const char *about,
                         const expression *by_frame) {
    derivation_add_array(d, f, name, about, d->n, 0);
    spread_last(d, f, 0, by_frame);
}

static void build_h(struct derivation *d, struct function *f) {
    spread_array(d, f, "h", "(n) bias forces [N, N m]", derivation_bias_forces(d));
}

static void build_M(struct derivation *d, struct function *f) {
    mass_matrix_fill(d, f, mass_matrix_add(d, f));
}

static void build_M_h(struct derivation *d, struct function *f) {
    const int mass = mass_matrix_add(d, f);
    build_h(d, f);
    mass_matrix_fill(d, f, mass);
}

static void build_Q(struct derivation *d, struct function *f) {
    spread_array(d, f, "Q", "(n) generalized forces [N, N m]", derivation_generalized_forces(d));
}

static void build_u(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "u", "(m x n) row coefficients, u qdd + v = 0", d->m * d->n, d->n);
    for (int i = 0; i < d->m; i++)
        spread_last(d, f, i * d->n, derivation_rows(d)[i].u);
}

/* The function of a quantity, built when it is not there yet. */
static const struct function *provide(struct derivation *d, const char *quantity);

static int find_array(const struct function *function, const char *name) {
    int index = 0;
    while (strcmp(function->arrays[index].name, name))
        index++;
    return index;
}

/* Where an array is computed: a composed function has it from another one. */
static struct composed_array source_of(const struct function *function, int array) {
    for (int i = 0; i < function->part_count; i++)
        if (function->parts[i].to_array == array && !function->loop_count)
            return function->parts[i];
    return (struct composed_array){.from = function, .from_array = array};
}

/* An array of a quantity, as a part of a composed function; its place there is left open. */
static struct composed_array *add_part(struct derivation *d, struct function *f, const char *quantity,
                                       const char *array) {
    const struct function *from = provide(d, quantity);
    f->parts = memory_room(d->memory, f->parts, f->part_count, &f->part_capacity, sizeof *f->parts);
    f->parts[f->part_count] = source_of(from, find_array(from, array));
    return &f->parts[f->part_count++];
}

static const struct array *array_of(const struct composed_array *part) {
    return &part->from->arrays[part->from_array];
}

/* One array more of a composed function. */
static void compose(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    const struct array *source = array_of(part);
    derivation_add_array(d, f, source->name, source->about, source->count, source->columns);
    part->to_array = f->array_count - 1;
}

/* Added to the array before. */
static void compose_sum(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    part->to_array = f->array_count - 1;
    part->is_added = true;
}

/* The same into a local array, for loops; its number. */
static int compose_local(struct derivation *d, struct function *f, const char *quantity, const char *array) {
    struct composed_array *part = add_part(d, f, quantity, array);
    const struct array *source = array_of(part);
    return part->to_array = pair_loops_add_local(d->memory, f, source->name, source->count,
                                                 source->columns ? source->columns : 1);
}

static void build_v(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "v", "(m) remaining terms of the rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].v);
}

static void build_phi(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "phi", "(m) residuals of position rows, 0 for others", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].phi);
}

static void build_psi(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "psi", "(m) velocity-level residuals, 0 for acceleration rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].psi);
}

static void build_k(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "k", "(m) stabilised right side, u qdd = k", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].k);
}

/* All about the rows: most of it they share. */
static void build_row_terms(struct derivation *d, struct function *f) {
    build_u(d, f);
    build_v(d, f);
    build_phi(d, f);
    build_psi(d, f);
    build_k(d, f);
}

static void build_point_vectors(struct derivation *d, struct function *f, const char *name,
                                const char *about) {
    derivation_add_array(d, f, name, about, 3 * d->points, 3);
    for (int p = 0; p < d->points; p++) {
        const struct point_motion *point = &d->kinematics.points[p];
        const struct vector *value = !strcmp(name, "r")    ? &point->r
                                     : !strcmp(name, "rd") ? &point->rd
                                                           : &point->d;
        plan_set_entries(d->memory, f, f->array_count - 1, 3 * p, value->at, 3);
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
    derivation_add_array(d, f, "C", "(points x 3 x n) rd = C qd", 3 * d->points * d->n, d->n);
    expression *row = derivation_new_values(d, d->frames);
    for (int p = 0; p < d->points; p++)
        for (int a = 0; a < 3; a++) {
            for (int j = 0; j < d->frames; j++)
                row[j] = d->kinematics.points[p].columns[j].at[a];
            spread_last(d, f, (3 * p + a) * d->n, row);
        }
}

/* All about the points. */
static void build_point_terms(struct derivation *d, struct function *f) {
    build_r(d, f);
    build_rd(d, f);
    build_C(d, f);
    build_d(d, f);
}

static void build_terms(struct derivation *d, struct function *f) {
    build_row_terms(d, f);
    build_point_terms(d, f);
}

static void build_energy(struct derivation *d, struct function *f) {
    struct graph *g = d->g;
    derivation_add_array(d, f, "energy", "(2) kinetic, potential [J]", 2, 0);
    set_last(d, f, 0, dynamics_kinetic_energy(&d->kinematics));
    const expression gravity = dynamics_gravity_energy(&d->kinematics, derivation_composites(d));
    set_last(d, f, 1, expr_add(g, gravity, forces_energy(&d->kinematics)));
}

/* The sum of values by frame, each times the rate of its coordinate. */
static expression sum_times_rates(struct derivation *d, const expression *by_frame) {
    struct recursion sum = recursion_sum(d->memory, d->g, d->kinematics.tree);
    for (int i = -1; recursion_next_term(&sum, &i);)
        recursion_add_term(&sum, i,
                           expr_mul(d->g, by_frame[i], kinematics_coordinate_of(&d->kinematics, i, 1)));
    return recursion_total(&sum);
}

static void build_power(struct derivation *d, struct function *f) {
    const struct applied *applied = derivation_applied(d);
    derivation_add_array(d, f, "power", "(1) of forces in Q without a potential [W]", 1, 0);
    set_last(d, f, 0, sum_times_rates(d, applied->others));
}

static void build_Q_q(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "Q_q", "(n x n) dQ_i/dq_j at qd = 0", d->n * d->n, d->n);
    mass_matrix_fill_statics_tangent(d, f, 0);
}

static void build_qdd_free(struct derivation *d, struct function *f) {
    spread_array(d, f, "qdd", "(n) accelerations without constraints, M qdd = h + Q", accelerations_free(d));
}

/* u qd of a row, at the places that it names. */
static expression row_speed(struct derivation *d, int a) {
    const struct row_terms *row = &derivation_rows(d)[a];
    expression sum = sum_times_rates(d, row->pull);
    for (int p = 0; p < d->model->marker_count; p++)
        sum = expr_add(d->g, sum, vector_dot(d->g, row->pulls[p], d->kinematics.points[p].rd));
    return sum;
}

static expression programme_power(struct derivation *d, const expression *lambda) {
    expression sum = expr_zero(d->g);
    for (int a = 0; a < d->m; a++)
        sum = expr_add(d->g, sum, expr_mul(d->g, lambda[a], row_speed(d, a)));
    return sum;
}

static void build_constrained(struct derivation *d, struct function *f) {
    const struct solution *solution = accelerations_constrained(d);
    spread_array(d, f, "qdd", "(n) accelerations with stabilised constraints", solution->qdd);
    const expression power = programme_power(d, solution->lambda);
    fill_array(d, f, "power", "(1) of the programme force, lambda . (u qd) [W]", &power, 1);
    fill_array(d, f, "lambda", "(m) multipliers, r = u^T lambda", solution->lambda, d->m);
}

static void build_accelerations(struct derivation *d, struct function *f) {
    build_constrained(d, f);
    spread_array(d, f, "qdd_free", "(n) accelerations without constraints, M qdd = h + Q",
                 accelerations_free(d));
}

/* With rows and without, so that callers need not know which model they have. */
static void build_qdd(struct derivation *d, struct function *f) {
    compose(d, f, d->m ? "constrained" : "qdd_free", "qdd");
}

/* r = u^T lambda */
static void build_force(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "force", "(n) programme force r = M qdd - h - Q = u^T lambda [N, N m]", d->n,
                         0);
    const int u = compose_local(d, f, "u", "u"), lambda = compose_local(d, f, "constrained", "lambda");
    pair_loops_add_loop(d->memory, f, LOOP_PRODUCT, "r = u^T lambda")->of.product =
        (struct product){0, u, lambda, 1};
}

static void build_f(struct derivation *d, struct function *f) {
    spread_array(d, f, "f", "(n) h + Q [N, N m]", derivation_all_forces(d));
}

static bool asks_for_all(const struct derivation *d);

/* h + Q where both are there anyway. */
static void compose_f(struct derivation *d, struct function *f) {
    if (!asks_for_all(d)) {
        compose(d, f, "f", "f");
        return;
    }
    compose(d, f, "h", "h");
    f->arrays[f->array_count - 1].name = "f";
    f->arrays[f->array_count - 1].about = "(n) h + Q [N, N m]";
    compose_sum(d, f, "Q", "Q");
}

static void build_equations(struct derivation *d, struct function *f) {
    compose(d, f, "M", "M");
    compose_f(d, f);
    const struct function *rows = d->m ? provide(d, "row_terms") : NULL;
    for (int i = 0; rows && i < rows->array_count; i++)
        compose(d, f, "row_terms", rows->arrays[i].name);
}

static void build_course(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "course", "values that the model records, by NAME_model.courses",
                         d->model->course_count, 0);
    for (int i = 0; i < d->model->course_count; i++)
        set_last(d, f, i, coordinate_derivatives_with_points(&d->kinematics, d->model->courses[i].value));
}

static void build_breaks(struct derivation *d, struct function *f) {
    fill_array(d, f, "breaks", "times at which formulas of time alone have kinks, in no order [s]",
               d->plan->breaks, d->plan->break_count);
}

static void build_switches(struct derivation *d, struct function *f) {
    fill_array(d, f, "switches", "values that change sign where formulas of time alone have other kinks",
               d->plan->switches, d->plan->switch_count);
}

static void build_pace(struct derivation *d, struct function *f) {
    fill_array(d, f, "pace", "largest angular frequency of the switches [rad/s]", &d->plan->pace, 1);
}

static bool has_events(const struct derivation *d) {
    return d->model->event_count + d->model->kink_count > 0;
}

static void build_start(struct derivation *d, struct function *f) {
    const struct frame *frames = d->kinematics.tree->frames;
    expression *start = derivation_new_values(d, d->frames), *rate = derivation_new_values(d, d->frames);
    derivation_add_array(d, f, "start", "(2 n) q and qd at the start of a motion", 2 * d->n, 0);
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
    derivation_add_array(d, f, "anchored", "values at the start of a motion, by NAME_model.anchored",
                         plan->anchored_count, 0);
    for (int i = 0; i < plan->anchored_count; i++)
        set_last(d, f, i,
                 coordinate_derivatives_with_points(&d->kinematics,
                                                    d->model->parameters[plan->anchored[i]].anchor));
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

static bool has_rows_and_points(const struct derivation *d) {
    return has_rows(d) && has_points(d);
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

static bool has_switches(const struct derivation *d) {
    return d->plan->switch_count > 0;
}

static bool has_pace(const struct derivation *d) {
    return has_switches(d) && d->plan->pace != expr_zero(d->plan->g);
}

static bool has_anchors(const struct derivation *d) {
    return d->plan->anchored_count > 0;
}

/* Emitted by default, by default where the scene has it and without a word elsewhere, when it is named, or
 * when it or parts of it are named, as in `d_qdd.q`. */
enum use { BY_DEFAULT, WHERE_THERE, ON_REQUEST, IN_BLOCKS };

struct quantity {
    const char *name, *about;
    bool (*exists)(const struct derivation *d);
    const char *reason; /* why a scene has it not */
    void (*build)(struct derivation *d, struct function *f);
    enum use use;
};

/* `anchor` and `start` come after the functions that read the values they set; `required` concerns all values
 * that are read, and comes last. */
static const struct quantity quantities[] = {
    {"M", "mass matrix", always, "", build_M, BY_DEFAULT},
    {"h", "bias forces h = -c (Coriolis, centrifugal)", always, "", build_h, BY_DEFAULT},
    {"Q", "generalized forces: gravity, springs, dampers and the model's own forces", always, "", build_Q,
     BY_DEFAULT},
    {"u", "row coefficients, u qdd + v = 0", has_rows, "constraints", build_u, BY_DEFAULT},
    {"v", "remaining terms of the rows, u qdd + v = 0", has_rows, "constraints", build_v, BY_DEFAULT},
    {"phi", "position-level residuals", has_position_rows, "position rows", build_phi, BY_DEFAULT},
    {"psi", "velocity-level residuals", has_velocity_rows, "position or velocity rows", build_psi,
     BY_DEFAULT},
    {"k", "stabilised right side k = -v - 2 alpha psi - beta^2 phi", has_rows, "constraints", build_k,
     BY_DEFAULT},
    {"r", "positions of the points", has_points, "points", build_r, BY_DEFAULT},
    {"rd", "velocities of the points", has_points, "points", build_rd, BY_DEFAULT},
    {"C", "columns of the points, rd = C qd", has_points, "points", build_C, BY_DEFAULT},
    {"d", "bias accelerations of the points, rdd = C qdd + d", has_points, "points", build_d, BY_DEFAULT},
    {"J", "spatial Jacobians of points with angular = true", spatial_jacobian_exists,
     "points with angular = true", spatial_jacobian_build, WHERE_THERE},
    {"Jd_qd", "their rates times qd", spatial_jacobian_exists, "points with angular = true",
     spatial_jacobian_build_drift, WHERE_THERE},
    {"energy", "kinetic and potential energy", always, "", build_energy, BY_DEFAULT},
    {"power", "power of all forces in Q that have no potential", has_work, "forces without a potential",
     build_power, BY_DEFAULT},
    {"Q_q", "tangent of statics, dQ/dq at qd = 0", always, "", build_Q_q, BY_DEFAULT},
    {"M_h", "M and h in one call, work shared", always, "", build_M_h, ON_REQUEST},
    {"qdd_free", "accelerations without constraints, O(n)", always, "", build_qdd_free, BY_DEFAULT},
    {"qdd", "accelerations, with stabilised constraints where there are any, O(n m)", always, "", build_qdd,
     BY_DEFAULT},
    {"force", "programme force r = M qdd - h - Q", has_rows, "constraints", build_force, BY_DEFAULT},
    {"equations", "M, h + Q and the rows in one call, work shared", always, "", build_equations, BY_DEFAULT},
    {"tangent", "derivatives of M qdd - h - Q - u^T lambda and u qdd - k at given qdd and lambda",
     is_corrected, "corrected form", derivatives_build_tangent, ON_REQUEST},
    {"tangent_vectors", "the tangent as vectors of joints, O(n)", is_corrected, "corrected form",
     derivatives_build_tangent_vectors, ON_REQUEST},
    {"d_qdd", "derivatives of qdd", is_corrected, "corrected form", derivatives_build_d_qdd, IN_BLOCKS},
    {"d_qdd_free", "derivatives of qdd_free", is_corrected, "corrected form", derivatives_build_d_qdd_free,
     IN_BLOCKS},
    {"d_force", "derivatives of the programme force", is_corrected_with_rows,
     "constraints in the corrected form", derivatives_build_d_force, IN_BLOCKS},
    {"d_statics", "derivatives of Q at qd = 0", is_corrected, "corrected form", derivatives_build_d_statics,
     IN_BLOCKS},
    {"d_rows", "derivatives of phi, psi and k", has_rows, "constraints", derivatives_build_d_rows, IN_BLOCKS},
    {"f", "h + Q in one recursion", always, "", build_f, ON_REQUEST},
    {"row_terms", "u, v, phi, psi and k in one call", has_rows, "constraints", build_row_terms, ON_REQUEST},
    {"point_terms", "r, rd, C and d in one call", has_points, "points", build_point_terms, ON_REQUEST},
    {"constrained", "qdd and multipliers in one call", has_rows, "constraints", build_constrained,
     ON_REQUEST},
    {"terms", "row_terms and point_terms in one call", has_rows_and_points, "constraints and points",
     build_terms, ON_REQUEST},
    {"accelerations", "constrained and qdd_free in one call", has_rows, "constraints", build_accelerations,
     ON_REQUEST},
    {"course", "values that the model records with a motion", has_courses, "courses", build_course,
     BY_DEFAULT},
    {"breaks", "times at which formulas of time alone have kinks", has_breaks, "kinks in time", build_breaks,
     BY_DEFAULT},
    {"switches", "values that change sign at kinks in time that `breaks` does not list", has_switches,
     "kinks at unknown times", build_switches, BY_DEFAULT},
    {"pace", "largest angular frequency of these changes of sign", has_pace,
     "recurring kinks at unknown times", build_pace, BY_DEFAULT},
    {"event", "values whose zeros are events", has_events, "events", event_terms_build_values, BY_DEFAULT},
    {"event_terms", "derivatives of these values, and the values that events set", has_events, "events",
     event_terms_build, BY_DEFAULT},
    {"anchor", "parameters whose default is a value at the start of a motion", has_anchors,
     "anchored parameters", build_anchor, BY_DEFAULT},
    {"start", "coordinates and rates at the start of a motion", always, "", build_start, BY_DEFAULT},
    {"required", "the model's rules for parameters", required_values_exist, "rules for parameters",
     required_values_build, BY_DEFAULT},
};

enum { QUANTITY_COUNT = sizeof quantities / sizeof *quantities };

const char *gen_quantity(int number) {
    return number < QUANTITY_COUNT ? quantities[number].name : NULL;
}

/* A quantity that calls one which gives it and others at once: less text (without, the manipulator's is half
 * as long again), and more time than it would take alone. */
struct membership {
    const char *quantity, *group;
    bool in_all;          /* where all is asked for; else with another one of the group */
    const char *parts[6]; /* what it takes of it */
};

static const struct membership memberships[] = {
    {"u", "row_terms", true, {"u"}},
    {"v", "row_terms", false, {"v"}},
    {"phi", "row_terms", false, {"phi"}},
    {"psi", "row_terms", false, {"psi"}},
    {"k", "row_terms", false, {"k"}},
    {"r", "point_terms", false, {"r"}},
    {"rd", "point_terms", false, {"rd"}},
    {"C", "point_terms", false, {"C"}},
    {"d", "point_terms", false, {"d"}},
    {"row_terms", "terms", true, {"u", "v", "phi", "psi", "k"}},
    {"point_terms", "terms", true, {"r", "rd", "C", "d"}},
    {"qdd_free", "accelerations", true, {"qdd_free"}},
    {"constrained", "accelerations", true, {"qdd", "power", "lambda"}},
};

enum { MEMBERSHIP_COUNT = sizeof memberships / sizeof *memberships };

/* Is `name` one of the comma-separated words of `list`? */
static bool is_in_list(const char *list, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == ',' || !at[length]))
            return true;
    return false;
}

/* The word for the form of the tangent that takes fewer operations. */
static const char implicit[] = "implicit";

/* Without a list, and as "all" in one. */
static bool asks_for_all(const struct derivation *d) {
    return !d->emit || is_in_list(d->emit, "all");
}

/* "d_qdd.q" */
static const char *block_word(struct memory *memory, const struct quantity *quantity, int block) {
    return memory_format(memory, "%s.%s", quantity->name, derivatives_block_name(block));
}

/* The blocks of derivatives that are asked for, all of them where the quantity is named as a whole. */
static unsigned wanted_blocks(const struct derivation *d, const struct quantity *quantity) {
    unsigned wanted = 0;
    if (quantity->use != IN_BLOCKS || !d->emit || is_in_list(d->emit, quantity->name))
        return ~0u;
    for (int k = 0; derivatives_block_name(k); k++)
        if (is_in_list(d->emit, block_word(d->memory, quantity, k)))
            wanted |= 1u << k;
    return wanted;
}

/* All is all but what is emitted on request alone. */
static bool is_asked_for(const struct derivation *d, const struct quantity *quantity) {
    const char *emit = d->emit;
    if (emit &&
        (is_in_list(emit, quantity->name) || (quantity->use == IN_BLOCKS && wanted_blocks(d, quantity))))
        return true;
    if (emit && is_in_list(emit, implicit) &&
        quantity->build == (d->has_vectors ? derivatives_build_tangent_vectors : derivatives_build_tangent))
        return true;
    return (quantity->use == BY_DEFAULT || (quantity->use == WHERE_THERE && quantity->exists(d))) &&
           asks_for_all(d);
}

/* What is wrong with a word for a part of a quantity, NULL: nothing. */
static const char *wrong_block(struct memory *memory, const char *word) {
    const char *names = "", *parts = "";
    for (int k = 0; derivatives_block_name(k); k++)
        parts = memory_format(memory, "%s .%s", parts, derivatives_block_name(k));
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        if (quantities[i].use != IN_BLOCKS)
            continue;
        names = memory_format(memory, "%s%s%s", names, *names ? " " : "", quantities[i].name);
        for (int k = 0; derivatives_block_name(k); k++)
            if (!strcmp(block_word(memory, &quantities[i], k), word))
                return NULL;
    }
    return memory_format(memory, "'%s' is not a part of a quantity; %s have%s", word, names, parts);
}

/* The first word of `emit` that names no quantity, with what is allowed; NULL when there is none. */
static const char *wrong_word(struct memory *memory, const char *word) {
    const char *names[QUANTITY_COUNT], *all = "all implicit step step.p";
    if (!strcmp(word, "all") || !strcmp(word, implicit) || quantities_is_word(word))
        return NULL;
    if (strchr(word, '.'))
        return wrong_block(memory, word);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        names[i] = quantities[i].name;
        all = memory_format(memory, "%s %s", all, names[i]);
        if (!strcmp(names[i], word))
            return NULL;
    }
    const char *near = message_nearest_name(word, names, QUANTITY_COUNT);
    if (near)
        return memory_format(memory, "no quantity is called '%s', the nearest is %s", word, near);
    return memory_format(memory, "no quantity is called '%s', known: %s", word, all);
}

const char *gen_wrong_emit(struct generation *generation, const char *emit) {
    if (setjmp(generation->out_of_memory))
        return "out of memory";
    char *rest = memory_text(&generation->memory, emit);
    const char *wrong = NULL;
    while (rest && !wrong) {
        const char *word = rest;
        rest = strchr(word, ',');
        if (rest)
            *rest++ = 0;
        wrong = *word ? wrong_word(&generation->memory, word)
                      : memory_format(&generation->memory, "a name in '%s' is empty", emit);
    }
    return wrong;
}

/* "no constraints: u v k qdd force; no points: r rd C d" */
static void say_left_out(struct plan *plan, const char *quantity, const char *reason,
                         const char **last_reason) {
    const char *before = plan->left_out ? plan->left_out : "";
    if (*last_reason && !strcmp(*last_reason, reason))
        plan->left_out = memory_format(plan->memory, "%s %s", before, quantity);
    else
        plan->left_out =
            memory_format(plan->memory, "%s%sno %s: %s", before, *before ? "; " : "", reason, quantity);
    *last_reason = reason;
}

/* Takes a function that nothing stands in out again, which is the last one then: derivatives by what the
 * scene has not.
 */
static void drop_empty(struct plan *plan, const char **last_reason) {
    const struct function *last = &plan->functions[plan->function_count - 1];
    if (last->array_count)
        return;
    say_left_out(plan, last->quantity, "variables of that kind", last_reason);
    plan->function_count--;
}

/* Anchored parameters that some function listed so far reads. */
static void list_anchored(struct derivation *d) {
    struct plan *plan = d->plan;
    bool *read = memory_get(d->memory, ((size_t)d->model->parameter_count + 1) * sizeof *read);
    const bool *needed = plan_mark_nodes_of_functions(plan);
    for (expression e = 0; e < d->g->count; e++) {
        const struct symbol *s = needed[e] ? expr_as_symbol(d->g, e) : NULL;
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

/* Functions that are always emitted: anchors of parameters, breaks, events, and rules for parameters. */
static bool is_wanted(const struct derivation *d, const struct quantity *quantity) {
    return is_asked_for(d, quantity) || quantity->build == build_anchor || quantity->build == build_breaks ||
           quantity->build == build_switches || quantity->build == build_pace ||
           quantity->build == required_values_build || quantity->build == event_terms_build_values ||
           quantity->build == event_terms_build || (quantity->build == build_start && has_anchors(d));
}

static bool is_named(const struct derivation *d, const struct quantity *quantity) {
    return d->emit && is_in_list(d->emit, quantity->name);
}

static const struct quantity *find_quantity(const char *name) {
    const struct quantity *quantity = quantities;
    while (strcmp(quantity->name, name))
        quantity++;
    return quantity;
}

/* Is one of a group's members named beside "all", or another one wanted? */
static bool is_called_for(const struct derivation *d, const struct membership *membership) {
    int wanted = 0;
    bool named = false;
    for (int i = 0; i < MEMBERSHIP_COUNT; i++) {
        const struct quantity *member = find_quantity(memberships[i].quantity);
        if (strcmp(memberships[i].group, membership->group))
            continue;
        named |= memberships[i].in_all && is_named(d, member);
        wanted += !memberships[i].in_all && member->exists(d) && is_wanted(d, member);
    }
    return membership->in_all ? asks_for_all(d) && !named : wanted > 1;
}

/* The group that a quantity calls, NULL: it computes itself what it needs. */
static const struct membership *called_group(const struct derivation *d, const struct quantity *quantity) {
    for (int i = 0; i < MEMBERSHIP_COUNT; i++)
        if (!strcmp(memberships[i].quantity, quantity->name) &&
            find_quantity(memberships[i].group)->exists(d) && is_called_for(d, &memberships[i]))
            return &memberships[i];
    return NULL;
}

static struct function *build_quantity(struct derivation *d, const struct quantity *quantity) {
    struct function *function = &d->plan->functions[d->plan->function_count++];
    *function = (struct function){
        .quantity = quantity->name, .about = quantity->about, .has_blocks = quantity->use == IN_BLOCKS};
    const struct membership *membership = called_group(d, quantity);
    d->wanted_blocks = wanted_blocks(d, quantity);
    for (int i = 0; membership && membership->parts[i]; i++)
        compose(d, function, membership->group, membership->parts[i]);
    if (!membership)
        quantity->build(d, function);
    return function;
}

static const struct function *provide(struct derivation *d, const char *name) {
    const struct function *function = function_of(d->plan, name);
    return function ? function : build_quantity(d, find_quantity(name));
}

/* Beside what others bring with them. */
static bool has_asked_for(const struct derivation *d) {
    for (int i = 0; i < QUANTITY_COUNT; i++)
        if (is_asked_for(d, &quantities[i]) && function_of(d->plan, quantities[i].name))
            return true;
    return false;
}

/* The tables of the model name all gains, also those that no function reads. */
static void make_gains(const struct derivation *d) {
    for (int i = 0; i < d->m; i++) {
        constraints_rate_gain(d->g, &d->model->rows[i]);
        constraints_position_gain(d->g, &d->model->rows[i]);
    }
}

bool quantities_list_functions(struct plan *plan, const char *emit) {
    struct derivation *d = choice_of_tree(plan);
    const char *last_reason = NULL;
    d->emit = emit;
    d->has_vectors = emit && is_in_list(emit, implicit) && is_corrected(d) && derivatives_prefer_vectors(d);
    plan->functions = memory_get(plan->memory, QUANTITY_COUNT * sizeof *plan->functions);
    for (int i = 0; i < QUANTITY_COUNT; i++) {
        const struct quantity *quantity = &quantities[i];
        if (quantity->build == build_breaks)
            time_events_find(plan);
        if (quantity->build == build_anchor)
            list_anchored(d);
        if (quantity->build == required_values_build)
            required_values_find(d);
        if (!quantity->exists(d)) {
            if (is_asked_for(d, quantity))
                say_left_out(plan, quantity->name, quantity->reason, &last_reason);
        } else if (is_wanted(d, quantity) && !function_of(plan, quantity->name)) {
            build_quantity(d, quantity);
            drop_empty(plan, &last_reason);
        }
    }
    derivatives_keep_emitted_parameters(plan);
    make_gains(d);
    return has_asked_for(d);
}
