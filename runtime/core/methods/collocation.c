/*
 * Collocation methods on the constrained equations of motion: the step and its interpolant.
 *
 * In: a state and a step h. Out: the state after it, an error estimate, and states between.
 * collocation_step.inc has the step. Tangent and factors are reused in later steps while the iteration
 * converges with them.
 *
 * A step of h (theory, sect. 8.6): accelerations a_i at the times t + c_i h, so that with
 *     Q_i = q + h c_i qd + h^2 sum_j aa_ij a_j,   V_i = qd + h sum_j a_ij a_j
 * they are those of the states (Q_i, V_i); then
 *     q_new = q + h qd + h^2 sum_j bb_j a_j,   qd_new = qd + h sum_j b_j a_j
 * (Hairer, Norsett and Wanner, Solving ODEs I, II.7). L_j(theta) = sum_k lagrange_jk theta^k are the
 * polynomials that are 1 at c_j and 0 at the others. The matrix a_ij is R B L, R L = 1, with a block of B
 * for each eigenvalue: lambda_k of a real one, the rows (re, -im) and (im, re) of a conjugate pair, of which
 * one is listed. L has the left eigenvectors as rows, of pairs their real parts above their imaginary ones.
 *
 * Error: d = acceleration at t_begin + sum_j e_j a_j, the defect of the polynomial there, decreases with h^s;
 * d_low, with one abscissa less, decreases with h^(s - 1). A vibration of x radians a step has d = K x^s and
 * d_low = K_low x^(s - 1) times its acceleration, and an error of its position of C x^(order + 1) times its
 * amplitude: so
 *     x = ratio |d| / |d_low|,   error = share h^2 |d| x^(order - s - 1),   ratio = K_low / K, share = C / K.
 */
#include "runtime/core/methods/methods.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"
#include "runtime/core/methods/step_of_one.inc"

#include "runtime/core/methods/collocation_step.inc"

/* Upper bound on the tolerance that Newton's iteration works to: larger remaining corrections would excite
 * fast modes without damping. */
static const double settled_most = 1e-5;

double refdyn_settled_tolerance(double tol) {
    return fmin(tol, settled_most);
}

static const struct refdyn_collocation_table *table_of(const struct refdyn_step *step) {
    return step->method->table;
}

static int memory_size(const struct refdyn_method_definition *method, const struct refdyn_model *model) {
    const struct refdyn_collocation_table *table = method->table;
    return (int)(sizeof(struct collocation_memory) / sizeof(double)) + table->stages * (4 * model->n + 1);
}

static void begin(struct refdyn_step *step, int is_new) {
    struct collocation_memory *memory = memory_of(step);
    memory->tried_t = INFINITY;
    memory->last_h = 0;
    if (is_new)
        memory->rate = 0;
}

int refdyn_collocation_iterations(const struct refdyn_step *step, int *keeps) {
    *keeps = memory_of(step)->kept != 0;
    return (int)memory_of(step)->iterations;
}

static void solve(void *context, int count, const double *lambda, double *x) {
    const struct taking *taking = context;
    refdyn_linear_solve_all(taking->step->linear, count, lambda, x);
}

static int saturates(const struct refdyn_step *step) {
    return step->evaluation.work->model->saturates;
}

/* Returns whether a guided step has no memory for matrices. */
static int goes_without_matrices(const struct refdyn_step *step) {
    return step->guide && step->linear->complexes < step->method->kind->complexes;
}

static struct collocation_of_one collocation_of(struct taking *taking) {
    struct refdyn_step *step = taking->step;
    struct collocation_of_one collocation = {
        .table = table_of(step),
        .arrays = arrays_of(step),
        .units = step->units,
        .h = taking->h,
        .last_h = memory_of(step)->last_h,
        .sees_missed = saturates(step),
        .needs = {find_rates, goes_without_matrices(step) ? NULL : solve, taking}};
    collocation.arrays.memory = memory_of(step)->arrays;
    collocation.stages = arrays_of_stages_of_one(collocation.table, &collocation.arrays);
    return collocation;
}

/* Evaluates the tangent at the middle of the step predicted by the first guess, because this suits all
 * stages. Without a guess, or if that state is not finite, evaluates it at the start. */
static int find_tangent(struct refdyn_step *step, const struct collocation_of_one *collocation) {
    if (collocation->last_h > 0) {
        state_between_of_one(collocation, 0.5, step->stage);
        const double t = refdyn_step_inside(step, step->t_begin + collocation->h / 2);
        if (!refdyn_rates(&step->evaluation, t, step->stage, step->side) &&
            !refdyn_linear_evaluate(step->linear, step->evaluation.work, t, step->stage, step->side))
            return REFDYN_OK;
    }
    return refdyn_linear_at_begin(step->linear, step->evaluation.work, step->t_begin, step->state,
                                  step->rates);
}

static int factor(struct refdyn_step *step, const struct collocation_of_one *collocation) {
    const struct refdyn_collocation_table *table = collocation->table;
    if (goes_without_matrices(step))
        return REFDYN_OK;
    const int status = find_tangent(step, collocation);
    return status ? status
                  : refdyn_linear_factor_all(step->linear, step->evaluation.work, table->eigenvalues,
                                             table->lambda, collocation->h);
}

/* Where forces saturate and corrections no longer decrease, the defect of the stages is rounding of stiff
 * springs: for steps of at least this length [s], and up to this fraction of the largest acceleration. */
static const double shortest = 1e-3, small = 1e-6;

static int misses_rounding_alone(const struct collocation_of_one *collocation,
                                 const struct iteration *iteration) {
    const double h = collocation->h, missed = iteration->last.missed;
    return h * fmax(h, shortest) * missed <= stalled &&
           missed <= small * largest_of_stages_of_one(collocation, collocation->stages.now);
}

/* Accelerations of all stages, with factors as they are or new ones; keeps how fast it went. */
static int find_stages(struct refdyn_step *step, const struct collocation_of_one *collocation, int is_kept) {
    struct iteration iteration;
    guess_of_one(collocation, collocation->stages.now);
    int status = is_kept ? REFDYN_OK : factor(step, collocation);
    if (status)
        return status;
    begin_iteration(&iteration, step, collocation->h);
    if (saturates(step) && !step->guide)
        begin_with_friction(&iteration, step, collocation->h);
    if (goes_without_matrices(step))
        iteration.most = PICARD_MOST;
    status = solve_stages_of_one(collocation, &iteration);
    note_iteration(step, &iteration, is_kept);
    if (iteration.status && saturates(step) && misses_rounding_alone(collocation, &iteration))
        iteration.status = REFDYN_OK;
    return status ? status : iteration.status;
}

/*
 * ---- Jumps and kinks of friction within a step ----
 *
 * Divided differences d_k of the accelerations over theta = 0, c_1 ... c_s, of orders k = s - 3 ... s, show
 * them. A vibration of x radians a step has x^k/k! times its acceleration, alternately with sine and cosine,
 * so that with X > x
 *     max(s! d_s/X^s, (s - 1)! d_(s-1)/X^(s-1)) < max((s - 2)! d_(s-2)/X^(s-2), (s - 3)! d_(s-3)/X^(s-3)).
 * Otherwise the error is that of a vibration that the step does not resolve: with x radians a step it is
 * share c_1 ... c_s h^2 d_s x^(order - 1 - s), by the formulas above with K = c_1 ... c_s / s!. The
 * differences are not multiplied by the matrix of the step: in a step that begins at rest, it would damp the
 * sign that sliding has begun.
 *
 * Where the polynomial misses a large part of the accelerations, the error exceeds the tolerance of the step,
 * so that no step continues beyond a layer of friction that it has passed unnoticed.
 */

/* Largest radians a step of a smooth motion: a jump or a kink anywhere in the step looks like more than 2.4.
 */
static const double smooth = 2.3;
/* Radians that represent a jump or a kink. With this value the error is that of the velocity over about ten
 * steps, several times the error of the position over h. */
static const double unresolved = 50;
/* Defect of the polynomial over the difference of order s: about the largest product of distances from s + 1
 * nodes. */
static const double missed = 0.005;
/* The polynomial follows the accelerations if its defect is below this fraction of the largest one. */
static const double followed = 0.25;
/* Rates that change by less in a step count as at rest [unit/s]: a hundredth of the smallest width of
 * friction. */
static const double at_rest = 1e-12;
/* Error, in tolerances, of a step whose defect equals that fraction. */
static const double refused = 2;

static double node(const struct refdyn_collocation_table *table, int j) {
    return j == 0 ? 0 : table->c[j - 1];
}

/* Replaces differences by those of the next order. Returns the largest, times order!/smooth^order. */
static double differ(const struct refdyn_step *step, int order, double *d) {
    const struct refdyn_collocation_table *table = step->method->table;
    const int n = step->n;
    double largest = 0;
    for (int j = 0; j + order <= table->stages; j++) {
        const double distance = node(table, j + order) - node(table, j);
        for (int i = 0; i < n; i++)
            d[j * n + i] = (d[(j + 1) * n + i] - d[j * n + i]) / distance;
        largest = fmax(largest, refdyn_step_largest_change(step, d + j * n, NULL));
    }
    for (int k = 1; k <= order; k++)
        largest *= k / smooth;
    return largest;
}

/* most (n) := the largest of `count` accelerations of each coordinate. */
static void find_most(const double *accelerations, int count, int n, double *most) {
    for (int j = 0; j < n; j++)
        most[j] = 0;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < n; j++)
            most[j] = fmax(most[j], fabs(accelerations[i * n + j]));
}

/* Returns the largest relative defect of the polynomial among coordinates whose rate changes; top (n):
 * differences of order s. */
static double largest_part_missed(const struct refdyn_step *step, const double *most, const double *top,
                                  double h) {
    double part = 0;
    for (int j = 0; j < step->n; j++)
        if (h * missed * fabs(top[j]) > at_rest * step->units[j])
            part = fmax(part, missed * fabs(top[j]) / most[j]);
    return part;
}

/* The error of the positions after a step of h, in the step's units, where friction causes a jump or a kink;
 * 0 where the accelerations ((s + 1) x n), at theta = 0 and at the stages, are smooth. Overwrites them. */
static double error_of_kink(const struct refdyn_step *step, double *accelerations, double h) {
    const struct refdyn_collocation_table *table = step->method->table;
    const int s = table->stages;
    double *most = step->stage, low[2] = {0, 0}, error = table->share * h * h;
    find_most(accelerations, s + 1, step->n, most);
    for (int order = 1; order <= s - 2; order++) {
        low[0] = low[1];
        low[1] = differ(step, order, accelerations);
    }
    const double before = differ(step, s - 1, accelerations), last = differ(step, s, accelerations);
    const double high = fmax(before, last);
    if (high <= fmax(low[0], low[1]))
        return 0;
    for (int k = 1; k <= s; k++)
        error *= table->c[k - 1] * smooth / k;
    error *= high * pow(unresolved, step->method->order - 1 - s);
    const double part = largest_part_missed(step, most, accelerations, h);
    return part > followed ? fmax(error, refused * step->tolerance * part / followed) : error;
}

/* The last stage is the end of the step, where stiff transients are damped: the next step may begin there. */
static int ends_with_stage(const struct refdyn_collocation_table *table) {
    return table->c[table->stages - 1] == 1;
}

/* Uses the acceleration of the last stage before as that at the beginning: in that of the equations,
 * stiffness would amplify the rounding of the state. */
static double unsmooth_error(struct refdyn_step *step, const struct stages_of_one *stages, double h) {
    const int n = step->n, size = table_of(step)->stages * n;
    const double *first = memory_of(step)->last_h > 0 ? stages->last + size - n : step->rates + n;
    double *a = stages->missing; /* and the parts after it */
    memcpy(a, first, (size_t)n * sizeof *a);
    memcpy(a + n, stages->now, (size_t)size * sizeof *a);
    return error_of_kink(step, a, h);
}

/* ---- The step ---- */

static int take(struct refdyn_step *step, double h) {
    struct taking taking = {step, h};
    const struct refdyn_step *motion = step;
    const int is_kept =
        refdyn_linear_has_factors(step->linear, step->evaluation.work, h) && keeps_factors(step);
    begin_attempt(step, h);
    const struct collocation_of_one collocation = collocation_of(&taking);
    int status = find_stages(step, &collocation, is_kept);
    if (status == REFDYN_NO_CONVERGENCE && is_kept)
        status = find_stages(step, &collocation, 0);
    if (status)
        return status;
    finish_of_one(&collocation);
    estimate_by_defect_of_one(&collocation, &motion);
    if (saturates(step) && ends_with_stage(table_of(step)))
        step->error[step->n] = step->units[0] * unsmooth_error(step, &collocation.stages, h) / h;
    return refdyn_is_finite(step->state_new, 2 * step->n) ? REFDYN_OK : REFDYN_NOT_FINITE;
}

void refdyn_collocation_accelerations(const struct refdyn_step *step, double theta, double *qdd) {
    const struct refdyn_collocation_table *table = table_of(step);
    const int n = step->n, s = table->stages;
    const double *now = memory_of(step)->arrays + s * n;
    memset(qdd, 0, (size_t)n * sizeof *qdd);
    for (int j = 0; j < s; j++) {
        double weight = 0;
        for (int k = s - 1; k >= 0; k--)
            weight = weight * theta + table->lagrange[j * s + k];
        dense_add(qdd, weight, now + j * n, n);
    }
}

static int interpolate(struct refdyn_step *step, double theta, double *state) {
    struct taking taking = {step, step->t_end - step->t_begin};
    const struct collocation_of_one collocation = collocation_of(&taking);
    state_between_of_one(&collocation, theta, state);
    return REFDYN_OK;
}

const struct refdyn_method_kind refdyn_collocation = {
    .controller = REFDYN_FILTER,
    .is_implicit = 1,
    .complexes = REFDYN_COMPLEXES_MOST,
    .ends_at_outputs = 1,
    .memory_size = memory_size,
    .begin = begin,
    .take = take,
    .interpolate = interpolate,
};
