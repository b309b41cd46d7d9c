/*
 * Directional derivatives.
 *
 * The derivatives of accelerations, and of programme forces on coordinates that no row drives, are emitted.
 * Most others follow from functions of the model without differences. Functions quadratic in the rates, such
 * as bias accelerations d(qd) and bias forces h(qd), have the symmetric bilinear form b(a, v) = (b(a + v) -
 * b(a - v))/4, exact for any length of v. With v = dq:
 *
 *   d(rd) = C dqd + d(qd, v)          since both are r'', contracted with qd and v;
 *   d(T)  = qd.M dqd - qd.h(qd, v)    by Christoffel's symbols, of which two cancel;
 *   d(V)  = power(v) - v.Q(v)         Q without its forces that have no potential, at rates v.
 *
 * Central differences are used for courses, which are arbitrary formulas, for multipliers, forces of drives
 * and event indicators.
 */
#include "runtime/bindings/fmi/fmi.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/motion/motion.h"

/* A direction: changes of q, qd and inputs, in scratch memory of the instance; then results. */
struct direction {
    double *q, *qd, *x, *moved, *inputs, *out;
};

static struct direction direction_open(struct fmu_instance *instance) {
    const int n = instance->work.n, inputs = instance->work.model->input_count;
    double *scratch = instance->scratch;
    memset(scratch, 0, (size_t)(2 * n + inputs) * sizeof *scratch);
    double *moved = scratch + 2 * n + inputs, *moved_inputs = moved + 2 * n;
    return (struct direction){scratch, scratch + n,  scratch + 2 * n,
                              moved,   moved_inputs, moved_inputs + inputs};
}

static int is_input_of_importer(const struct fmu_instance *instance, int place) {
    return !fmu_is_set_by_events(instance->work.model, REFDYN_CHANGED_INPUT, place);
}

static enum fmu_status add_known(struct fmu_instance *instance, unsigned reference, double seed,
                                 const struct direction *direction) {
    const struct fmu_variable known = fmu_find_variable(refdyn_fmu.model, refdyn_fmu.spatial, reference);
    if (known.kind == FMU_COORDINATE)
        direction->q[known.index] += seed;
    else if (known.kind == FMU_RATE)
        direction->qd[known.index] += seed;
    else if (known.kind == FMU_INPUT && is_input_of_importer(instance, known.index))
        direction->x[known.index] += seed;
    else
        return fmu_tell(instance, FMU_DISCARD,
                        "value reference %u: not a state or an input; derivatives exist for these only",
                        reference);
    return FMU_OK;
}

static double dot(const double *a, const double *b, int n) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static double largest(const double *values, int n) {
    double most = 0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

/* Product of a direction with row `index` of the derivatives by q, qd and inputs, three consecutive matrices.
 */
static double emitted(const struct fmu_instance *instance, const double *derivatives, int index,
                      const struct direction *direction) {
    const int n = instance->work.n, inputs = instance->work.model->input_count;
    return dot(derivatives + index * n, direction->q, n) +
           dot(derivatives + (n + index) * n, direction->qd, n) +
           dot(derivatives + 2 * n * n + index * inputs, direction->x, inputs);
}

static void call_at(const struct fmu_instance *instance, refdyn_function *function, const double *qd,
                    double *out) {
    function(instance->work.p, instance->work.x, instance->integrator.t_right, instance->integrator.q, qd,
             out);
}

/* Entries of b(qd, v) (count): weights (count) times them, or of one entry where that is given. */
static double bilinear(const struct fmu_instance *instance, refdyn_function *function,
                       const struct direction *direction, const double *weights, int entry, int count) {
    const double *qd = instance->integrator.qd;
    const int n = instance->work.n;
    const double change = largest(direction->q, n), size = largest(qd, n);
    const double scale =
        change > 0 && size > 0 ? size / change : 1; /* so that neither vanishes in rounding of the other */
    double sum = 0;
    if (change == 0)
        return 0;
    for (int sign = 1; sign >= -1; sign -= 2) {
        for (int i = 0; i < n; i++)
            direction->moved[i] = qd[i] + sign * scale * direction->q[i];
        call_at(instance, function, direction->moved, direction->out);
        sum += sign * (weights ? dot(weights, direction->out, count) : direction->out[entry]);
    }
    return sum / (4 * scale);
}

static double velocity_change(struct fmu_instance *instance, int index, const struct direction *direction) {
    const int n = instance->work.n;
    fmu_fill(instance, FMU_POINTS);
    return dot(instance->C + index * n, direction->qd, n) +
           bilinear(instance, instance->work.model->d, direction, NULL, index, 0);
}

static double kinetic_change(const struct fmu_instance *instance, const struct direction *direction) {
    const struct refdyn_model *model = instance->work.model;
    const double *qd = instance->integrator.qd;
    const int n = model->n, joints = refdyn_joint_count(model);
    double sum = 0;
    call_at(instance, model->M, qd, instance->work.M);
    for (int i = 0; i < joints; i++) /* states of controllers have no energy */
        sum += qd[i] * dot(instance->work.M + i * n, direction->qd, n);
    return sum - bilinear(instance, model->h, direction, qd, 0, joints);
}

static double potential_change(const struct fmu_instance *instance, const struct direction *direction) {
    const struct refdyn_model *model = instance->work.model;
    const int n = model->n;
    double power = 0;
    call_at(instance, model->Q, direction->q, direction->out);
    const double work = dot(direction->q, direction->out, n);
    if (model->power)
        call_at(instance, model->power, direction->q, &power);
    return power - work;
}

static double energy_change(const struct fmu_instance *instance, int index,
                            const struct direction *direction) {
    return (index != 2 ? kinetic_change(instance, direction) : 0) +
           (index != 1 ? potential_change(instance, direction) : 0);
}

/* ---- By central differences ---- */

/* Returns the force on a coordinate of the rows that drive it, from the rates of a state whose row terms are
 * in the workspace. */
static double drive_force(const struct refdyn_workspace *work, const double *rates, int coordinate) {
    double force = 0;
    for (int a = 0; a < work->m; a++)
        if (work->model->rows[a].driven == coordinate + 1)
            force += rates[2 * work->n + 1 + a] * work->u[a * work->n + coordinate];
    return force;
}

/* Computes courses, indicators or multipliers, or one force of drives, at the state moved by a distance along
 * the direction; scratch for inputs follows the direction. */
static int find_moved(struct fmu_instance *instance, struct fmu_variable unknown,
                      const struct direction *direction, double step) {
    struct refdyn_integrator *integrator = &instance->integrator;
    struct refdyn_motion *motion = integrator->motion;
    struct refdyn_workspace *work = &instance->work;
    const struct refdyn_model *model = work->model;
    const int n = model->n;
    double *q = direction->moved, *qd = q + n, *own = work->x, *x = direction->inputs;
    int status = REFDYN_OK;
    for (int i = 0; i < n; i++) {
        q[i] = integrator->q[i] + step * direction->q[i];
        qd[i] = integrator->qd[i] + step * direction->qd[i];
    }
    for (int i = 0; i < model->input_count; i++)
        x[i] = own[i] + step * direction->x[i];
    work->x = x;
    refdyn_parameters_enter(&motion->parameters, work);
    if (unknown.kind == FMU_COURSE)
        model->course(work->p, x, integrator->t_right, q, qd, direction->out);
    else if (unknown.kind == FMU_INDICATOR)
        fmu_find_indicators(instance, q, direction->out);
    else
        status = refdyn_rates(&motion->step.evaluation, integrator->t_right, q, direction->out);
    if (unknown.kind == FMU_FORCE && !status)
        status = refdyn_row_terms(work, integrator->t_right, q, qd);
    if (unknown.kind == FMU_FORCE)
        direction->out[unknown.index] = drive_force(work, direction->out, unknown.index);
    refdyn_parameters_leave(&motion->parameters, work);
    work->x = own;
    return status;
}

/* Computes the row terms of the present state, since the workspace may have those of a moved one. */
static void restore_rows(struct fmu_instance *instance) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    struct refdyn_parameters *parameters = &integrator->motion->parameters;
    refdyn_parameters_enter(parameters, &instance->work);
    refdyn_row_terms(&instance->work, integrator->t_right, integrator->q, integrator->qd);
    refdyn_parameters_leave(parameters, &instance->work);
}

static double difference(struct fmu_instance *instance, struct fmu_variable unknown,
                         const struct direction *direction) {
    const int n = instance->work.n;
    const int contact_row = instance->work.m - instance->integrator.contact_count;
    const int place = unknown.index + (unknown.kind == FMU_MULTIPLIER      ? 2 * n + 1
                                       : unknown.kind == FMU_CONTACT_FORCE ? 2 * n + 1 + contact_row
                                                                           : 0);
    const double change = largest(direction->q, 2 * n + instance->work.model->input_count);
    const double step = cbrt(DBL_EPSILON) * fmax(1, largest(instance->integrator.q, 2 * n)) / change;
    double sum = 0;
    if (change == 0)
        return 0;
    if (unknown.kind == FMU_CONTACT_FORCE && !instance->integrator.forces_are_unique)
        return NAN;
    for (int sign = 1; sign >= -1; sign -= 2) {
        if (find_moved(instance, unknown, direction, sign * step))
            return NAN;
        sum += sign * direction->out[place];
    }
    restore_rows(instance);
    return sum / (2 * step);
}

/* Returns whether the model has the functions for the derivative of the unknown. */
static int has_derivative(const struct refdyn_model *model, enum fmu_kind kind) {
    switch (kind) {
    case FMU_ACCELERATION:
        return model->m > 0 ? model->d_qdd != NULL : model->d_qdd_free != NULL;
    case FMU_FORCE:
        return model->d_force != NULL;
    case FMU_ENERGY:
        return model->M && model->h && model->Q && (model->d_qdd || model->d_qdd_free);
    case FMU_COORDINATE:
    case FMU_RATE:
    case FMU_COORDINATE_CHANGE:
    case FMU_POSITION:
    case FMU_VELOCITY:
    case FMU_COURSE:
    case FMU_MULTIPLIER:
    case FMU_CONTACT_FORCE:
    case FMU_INDICATOR:
        return 1;
    default:
        return 0;
    }
}

static int is_driven(const struct refdyn_model *model, int coordinate) {
    for (int a = 0; a < model->m; a++)
        if (model->rows[a].driven == coordinate + 1)
            return 1;
    return 0;
}

static double change_of(struct fmu_instance *instance, struct fmu_variable unknown,
                        const struct direction *direction) {
    const int n = instance->work.n, i = unknown.index;
    switch (unknown.kind) {
    case FMU_COORDINATE:
        return direction->q[i];
    case FMU_RATE:
    case FMU_COORDINATE_CHANGE:
        return direction->qd[i];
    case FMU_ACCELERATION:
        fmu_fill(instance, FMU_D_QDD);
        return emitted(instance, instance->d_qdd, i, direction);
    case FMU_FORCE:
        fmu_fill(instance, FMU_FORCES);
        if (is_driven(instance->work.model, i))
            return isnan(instance->force[i]) ? NAN : difference(instance, unknown, direction);
        fmu_fill(instance, FMU_D_FORCE);
        return emitted(instance, instance->d_force, i, direction);
    case FMU_POSITION:
        fmu_fill(instance, FMU_POINTS);
        return dot(instance->C + i * n, direction->q, n);
    case FMU_VELOCITY:
        return velocity_change(instance, i, direction);
    case FMU_ENERGY:
        return energy_change(instance, i, direction);
    case FMU_MULTIPLIER:
        fmu_fill(instance, FMU_FORCES);
        return isnan(instance->lambda[i]) ? NAN : difference(instance, unknown, direction);
    case FMU_COURSE:
    case FMU_CONTACT_FORCE:
    case FMU_INDICATOR:
        return difference(instance, unknown, direction);
    default:
        return NAN;
    }
}

/* Computes the change of one unknown along a direction. */
static enum fmu_status find_change(struct fmu_instance *instance, unsigned reference,
                                   const struct direction *direction, double *change) {
    const struct fmu_variable unknown = fmu_find_variable(refdyn_fmu.model, refdyn_fmu.spatial, reference);
    if (!has_derivative(refdyn_fmu.model, unknown.kind))
        return fmu_tell(instance, FMU_DISCARD, "value reference %u: this variable has no derivative",
                        reference);
    *change = change_of(instance, unknown, direction);
    if (!isfinite(*change))
        return fmu_tell(instance, FMU_DISCARD, "t = %.9g s: a derivative is not finite",
                        instance->integrator.t);
    return FMU_OK;
}

enum fmu_status fmu_directional(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                                const unsigned *knowns, size_t known_count, const double *seed,
                                double *sensitivity) {
    enum fmu_status status = fmu_evaluate(instance);
    const struct direction direction = direction_open(instance);
    for (size_t i = 0; i < known_count && status == FMU_OK; i++)
        status = add_known(instance, knowns[i], seed[i], &direction);
    for (size_t i = 0; i < unknown_count && status == FMU_OK; i++)
        status = find_change(instance, unknowns[i], &direction, &sensitivity[i]);
    return status;
}

enum fmu_status fmu_adjoint(struct fmu_instance *instance, const unsigned *unknowns, size_t unknown_count,
                            const unsigned *knowns, size_t known_count, const double *seed,
                            double *sensitivity) {
    enum fmu_status status = fmu_evaluate(instance);
    for (size_t k = 0; k < known_count && status == FMU_OK; k++) {
        const struct direction direction = direction_open(instance);
        status = add_known(instance, knowns[k], 1, &direction);
        sensitivity[k] = 0;
        for (size_t i = 0; i < unknown_count && status == FMU_OK; i++) {
            double change = 0;
            status = find_change(instance, unknowns[i], &direction, &change);
            sensitivity[k] += seed[i] * change;
        }
    }
    return status;
}
