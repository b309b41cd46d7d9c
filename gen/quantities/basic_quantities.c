/*
 * Quantities that need no derivatives: mass matrix, forces, rows, points, energies, accelerations, courses,
 * and the values that the runtime reads before a motion.
 *
 * Each function fills the arrays of one quantity from the terms of dynamics.h, which the derivation keeps.
 */
#include "gen/quantities/quantities.h"
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

/* Sets an entry of the last array. */
static void set_last(struct derivation *d, struct function *f, int entry, expression value) {
    plan_set_entry(d->memory, f, f->array_count - 1, entry, value);
}

static void fill_array(struct derivation *d, struct function *f, const char *name, const char *about,
                       const expression *values, int count) {
    plan_set_entries(d->memory, f, derivation_add_array(d, f, name, about, count, 0), 0, values, count);
}

/* Spreads values to entries begin + coordinate of the last array. */
static void spread_last(struct derivation *d, struct function *f, int begin, const expression *by_frame) {
    derivation_spread(d, f, f->array_count - 1, begin, 1, by_frame);
}

/* Adds an array with a value for each coordinate. */
static void spread_array(struct derivation *d, struct function *f, const char *name, const char *about,
                         const expression *by_frame) {
    derivation_add_array(d, f, name, about, d->n, 0);
    spread_last(d, f, 0, by_frame);
}

void quantity_h(struct derivation *d, struct function *f) {
    spread_array(d, f, "h", "(n) bias forces [N, N m]", derivation_bias_forces(d));
}

void quantity_M(struct derivation *d, struct function *f) {
    mass_matrix_fill(d, f, mass_matrix_add(d, f));
}

void quantity_M_h(struct derivation *d, struct function *f) {
    const int mass = mass_matrix_add(d, f);
    quantity_h(d, f);
    mass_matrix_fill(d, f, mass);
}

void quantity_Q(struct derivation *d, struct function *f) {
    spread_array(d, f, "Q", "(n) generalized forces [N, N m]", derivation_generalized_forces(d));
}

void quantity_u(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "u", "(m x n) row coefficients, u qdd + v = 0", d->m * d->n, d->n);
    for (int i = 0; i < d->m; i++)
        spread_last(d, f, i * d->n, derivation_rows(d)[i].u);
}

void quantity_v(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "v", "(m) remaining terms of the rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].v);
}

void quantity_phi(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "phi", "(m) residuals of position rows, 0 for others", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].phi);
}

void quantity_psi(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "psi", "(m) velocity-level residuals, 0 for acceleration rows", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].psi);
}

void quantity_k(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "k", "(m) stabilised right side, u qdd = k", d->m, 0);
    for (int i = 0; i < d->m; i++)
        set_last(d, f, i, derivation_rows(d)[i].k);
}

void quantity_row_sizes(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "row_sizes", "(m x n) sizes of u without cancellation", d->m * d->n, d->n);
    for (int i = 0; i < d->m; i++)
        spread_last(d, f, i * d->n, constraints_sizes(&d->kinematics, i, &derivation_rows(d)[i]));
}

void quantity_row_terms(struct derivation *d, struct function *f) {
    quantity_u(d, f);
    quantity_v(d, f);
    quantity_phi(d, f);
    quantity_psi(d, f);
    quantity_k(d, f);
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

void quantity_r(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "r", "(points x 3) positions [m]");
}

void quantity_rd(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "rd", "(points x 3) velocities [m/s]");
}

void quantity_d(struct derivation *d, struct function *f) {
    build_point_vectors(d, f, "d", "(points x 3) bias accelerations, rdd = C qdd + d [m/s^2]");
}

void quantity_C(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "C", "(points x 3 x n) rd = C qd", 3 * d->points * d->n, d->n);
    expression *row = derivation_new_values(d, d->frames);
    for (int p = 0; p < d->points; p++)
        for (int a = 0; a < 3; a++) {
            for (int j = 0; j < d->frames; j++)
                row[j] = d->kinematics.points[p].columns[j].at[a];
            spread_last(d, f, (3 * p + a) * d->n, row);
        }
}

void quantity_point_terms(struct derivation *d, struct function *f) {
    quantity_r(d, f);
    quantity_rd(d, f);
    quantity_C(d, f);
    quantity_d(d, f);
}

void quantity_terms(struct derivation *d, struct function *f) {
    quantity_row_terms(d, f);
    quantity_point_terms(d, f);
}

void quantity_energy(struct derivation *d, struct function *f) {
    struct graph *g = d->g;
    derivation_add_array(d, f, "energy", "(2) kinetic, potential [J]", 2, 0);
    set_last(d, f, 0, dynamics_kinetic_energy(&d->kinematics));
    const expression gravity = dynamics_gravity_energy(&d->kinematics, derivation_composites(d));
    set_last(d, f, 1, expr_add(g, gravity, forces_energy(&d->kinematics)));
}

/* The sum of values by frame, each multiplied by the rate of its coordinate. */
static expression sum_times_rates(struct derivation *d, const expression *by_frame) {
    struct recursion sum = recursion_sum(d->memory, d->g, d->kinematics.tree);
    for (int i = -1; recursion_next_term(&sum, &i);)
        recursion_add_term(&sum, i,
                           expr_mul(d->g, by_frame[i], kinematics_coordinate_of(&d->kinematics, i, 1)));
    return recursion_total(&sum);
}

/* The rates of states are no forces and have no power. */
void quantity_power(struct derivation *d, struct function *f) {
    const struct applied *applied = derivation_applied(d);
    expression *others = derivation_new_values(d, d->frames);
    for (int i = 0; i < d->frames; i++)
        others[i] = d->kinematics.tree->frames[i].is_state ? EXPR_ZERO : applied->others[i];
    derivation_add_array(d, f, "power", "(1) of forces in Q without a potential [W]", 1, 0);
    set_last(d, f, 0, sum_times_rates(d, others));
}

void quantity_Q_q(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "Q_q", "(n x n) dQ_i/dq_j at qd = 0", d->n * d->n, d->n);
    mass_matrix_fill_statics_tangent(d, f, 0);
}

void quantity_qdd_free(struct derivation *d, struct function *f) {
    spread_array(d, f, "qdd", "(n) accelerations without constraints, M qdd = h + Q", accelerations_free(d));
}

/* u qd of a row, from the coordinates and points that the row names. */
static expression row_speed(struct derivation *d, int a) {
    const struct row_terms *row = &derivation_rows(d)[a];
    expression sum = sum_times_rates(d, row->pull);
    for (int p = 0; p < d->model->marker_count; p++)
        sum = expr_add(d->g, sum, vector_dot(d->g, row->pulls[p], d->kinematics.points[p].rd));
    return sum;
}

static expression programme_power(struct derivation *d, const expression *lambda) {
    expression sum = EXPR_ZERO;
    for (int a = 0; a < d->m; a++)
        sum = expr_add(d->g, sum, expr_mul(d->g, lambda[a], row_speed(d, a)));
    return sum;
}

void quantity_constrained(struct derivation *d, struct function *f) {
    const struct solution *solution = accelerations_constrained(d);
    spread_array(d, f, "qdd", "(n) accelerations with stabilised constraints", solution->qdd);
    const expression power = programme_power(d, solution->lambda);
    fill_array(d, f, "power", "(1) of the programme force, lambda . (u qd) [W]", &power, 1);
    fill_array(d, f, "lambda", "(m) multipliers, r = u^T lambda", solution->lambda, d->m);
}

void quantity_accelerations(struct derivation *d, struct function *f) {
    quantity_constrained(d, f);
    spread_array(d, f, "qdd_free", "(n) accelerations without constraints, M qdd = h + Q",
                 accelerations_free(d));
}

void quantity_f(struct derivation *d, struct function *f) {
    spread_array(d, f, "f", "(n) h + Q [N, N m]", derivation_all_forces(d));
}

void quantity_course(struct derivation *d, struct function *f) {
    derivation_add_array(d, f, "course", "values that the model records, by NAME_model.courses",
                         d->model->course_count, 0);
    for (int i = 0; i < d->model->course_count; i++)
        set_last(d, f, i, coordinate_derivatives_with_points(&d->kinematics, d->model->courses[i].value));
}

void quantity_breaks(struct derivation *d, struct function *f) {
    fill_array(d, f, "breaks", "times at which formulas of time alone have kinks, in no order [s]",
               d->plan->breaks, d->plan->break_count);
}

void quantity_switches(struct derivation *d, struct function *f) {
    fill_array(d, f, "switches", "values that change sign where formulas of time alone have other kinks",
               d->plan->switches, d->plan->switch_count);
}

void quantity_pace(struct derivation *d, struct function *f) {
    const expression paces[] = {d->plan->pace, d->plan->event_pace};
    fill_array(d, f, "pace", "largest angular frequencies of the switches, and of events [rad/s]", paces, 2);
}

void quantity_start(struct derivation *d, struct function *f) {
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

void quantity_anchor(struct derivation *d, struct function *f) {
    struct plan *plan = d->plan;
    derivation_add_array(d, f, "anchored", "values at the start of a motion, by NAME_model.anchored",
                         plan->anchored_count, 0);
    for (int i = 0; i < plan->anchored_count; i++)
        set_last(d, f, i,
                 coordinate_derivatives_with_points(&d->kinematics,
                                                    d->model->parameters[plan->anchored[i]].anchor));
}

/* ---- Spatial Jacobians ---- */

/*
 * The spatial Jacobian of points with `angular = true`: the quantities J and Jd_qd.
 *
 * Input: kinematics. Results: for each of these points, in their order, six rows: the velocity of the point,
 * then the angular velocity of the body that carries it, both in ground axes, (rd, w) = J qd and (rdd, wd) =
 * J qdd + Jd_qd. Theory, sect. 4.4.
 */

static int count_points(const struct derivation *d) {
    int count = 0;
    for (int p = 0; p < d->points; p++)
        count += d->model->points[p].is_angular;
    return count;
}

bool spatial_jacobian_exists(const struct derivation *d) {
    return count_points(d) > 0;
}

/* e_j, in ground axes, of each revolute joint on the way to the ground: w = sum of e_j qd_j. */
static struct vector *angular_columns(const struct derivation *d, int point) {
    const struct kinematics *k = &d->kinematics;
    struct vector *columns = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *columns);
    for (int j = -1; recursion_next_joint(d->g, k->tree, &j);)
        if (k->tree->frames[j].joint.is_revolute && kinematics_is_on_path(k, j, k->tree->points[point].frame))
            columns[j] = kinematics_joint_axis(k, j);
    return columns;
}

static void spread_rows(struct derivation *d, struct function *f, int first, const struct vector *columns) {
    expression *row = derivation_new_values(d, d->frames);
    for (int a = 0; a < 3; a++) {
        for (int j = 0; j < d->frames; j++)
            row[j] = columns[j].at[a];
        derivation_spread(d, f, f->array_count - 1, (first + a) * d->n, 1, row);
    }
}

void quantity_J(struct derivation *d, struct function *f) {
    int row = 0;
    derivation_add_array(d, f, "J", "(angular points x 6 x n) (rd, w) = J qd", 6 * count_points(d) * d->n,
                         d->n);
    for (int p = 0; p < d->points; p++) {
        if (!d->model->points[p].is_angular)
            continue;
        spread_rows(d, f, row, d->kinematics.points[p].columns);
        spread_rows(d, f, row + 3, angular_columns(d, p));
        row += 6;
    }
}

/* dw/dt at qdd = 0 of the body that carries the point, in ground axes. */
static struct vector angular_drift(const struct derivation *d, int point) {
    const struct kinematics *k = &d->kinematics;
    const int frame = k->tree->points[point].frame;
    const struct vector still = {{0, 0, 0}};
    return frame < 0 ? still
                     : matrix_times(d->g, k->frames[frame].rotation.at, k->frames[frame].bias_angular);
}

void quantity_Jd_qd(struct derivation *d, struct function *f) {
    int row = 0;
    derivation_add_array(d, f, "Jd_qd", "(angular points x 6) (rdd, wd) = J qdd + Jd_qd [m/s^2, rad/s^2]",
                         6 * count_points(d), 6);
    for (int p = 0; p < d->points; p++) {
        if (!d->model->points[p].is_angular)
            continue;
        const struct vector drift = angular_drift(d, p);
        plan_set_entries(d->memory, f, f->array_count - 1, row, d->kinematics.points[p].d.at, 3);
        plan_set_entries(d->memory, f, f->array_count - 1, row + 3, drift.at, 3);
        row += 6;
    }
}
