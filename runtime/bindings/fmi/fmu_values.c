/* Values of variables, read and set by the importer. Results of the model's functions are kept until the
 * state changes. */
#include "runtime/bindings/fmi/fmi.h"

#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/motion/motion.h"

/* ---- Blocks ---- */

static void call(const struct fmu_instance *instance, refdyn_function *function, double *out) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    function(instance->work.p, instance->work.x, integrator->t_right, integrator->q, integrator->qd, out);
}

/* out (rows) += matrix (rows x n) vector */
static void add_product(const double *matrix, const double *vector, int rows, int n, double *out) {
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < n; j++)
            out[i] += matrix[i * n + j] * vector[j];
}

/* rdd = C qdd + d */
static void fill_points(struct fmu_instance *instance) {
    const struct refdyn_model *model = instance->work.model;
    if (model->point_count == 0)
        return;
    call(instance, model->r, instance->r);
    call(instance, model->rd, instance->rd);
    call(instance, model->C, instance->C);
    call(instance, model->d, instance->rdd);
    add_product(instance->C, instance->integrator.qdd, 3 * model->point_count, model->n, instance->rdd);
}

static void fill_energy(struct fmu_instance *instance) {
    double *energy = instance->energy;
    if (!instance->work.model->energy)
        return;
    call(instance, instance->work.model->energy, energy + 1);
    energy[0] = energy[1] + energy[2];
}

/* (w, wd) = J qd, J qdd + Jd_qd in the last three rows of each. */
static void fill_angular(struct fmu_instance *instance) {
    if (!refdyn_fmu.spatial)
        return;
    call(instance, refdyn_fmu.spatial->J, instance->J);
    call(instance, refdyn_fmu.spatial->Jd_qd, instance->drift);
}

/* Derivatives of the motion, including its stabilising gains. */
static void fill_derivatives(const struct fmu_instance *instance, refdyn_function *function, double *out) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    if (function)
        function(fmu_motion_parameters(instance), instance->work.x, integrator->t_right, integrator->q,
                 integrator->qd, out);
}

void fmu_fill(struct fmu_instance *instance, unsigned blocks) {
    const struct refdyn_model *model = instance->work.model;
    const unsigned missing = blocks & ~instance->filled;
    if (missing & FMU_POINTS)
        fill_points(instance);
    if (missing & FMU_ENERGIES)
        fill_energy(instance);
    if (missing & FMU_FORCES) {
        refdyn_integrator_force(&instance->integrator, instance->force);
        refdyn_integrator_multipliers(&instance->integrator, instance->lambda);
    }
    if (missing & FMU_COURSES && model->course)
        call(instance, model->course, instance->course);
    if (missing & FMU_ANGULAR)
        fill_angular(instance);
    if (missing & FMU_D_QDD)
        fill_derivatives(instance, model->m > 0 ? model->d_qdd : model->d_qdd_free, instance->d_qdd);
    if (missing & FMU_D_FORCE)
        fill_derivatives(instance, model->d_force, instance->d_force);
    instance->filled |= missing;
}

/* ---- Reading values ---- */

static double from_block(struct fmu_instance *instance, enum fmu_block block, const double *values,
                         int index) {
    fmu_fill(instance, block);
    return values[index];
}

/* Returns w or wd of a point: row 3 + axis of its six rows. */
static double angular_value(struct fmu_instance *instance, int index, int is_acceleration) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const int n = instance->work.n, row = 6 * (index / 3) + 3 + index % 3;
    fmu_fill(instance, FMU_ANGULAR);
    double value = is_acceleration ? instance->drift[row] : 0;
    add_product(instance->J + row * n, is_acceleration ? integrator->qdd : integrator->qd, 1, n, &value);
    return value;
}

void fmu_find_indicators(const struct fmu_instance *instance, const double *state, double *indicators) {
    const struct refdyn_workspace *work = &instance->work;
    const struct refdyn_model *model = work->model;
    const double *qd = state + model->n, t = instance->integrator.t_right;
    const int values = model->event_count + model->kink_count;
    struct refdyn_motion *motion = instance->integrator.motion;
    if (values > 0)
        refdyn_state_events_values(&motion->state_events, &motion->step, t, state, indicators);
    if (model->switch_count > 0)
        model->switches(work->p, work->x, t, state, qd, indicators + values);
}

/* Returns an event indicator as event mode has left it. */
static double indicator_value(struct fmu_instance *instance, int index) {
    fmu_find_indicators(instance, instance->integrator.q, instance->scratch);
    return instance->scratch[index] - instance->zeros[index];
}

static double contact_force(struct fmu_instance *instance, int contact) {
    refdyn_integrator_contact_forces(&instance->integrator, instance->scratch);
    return instance->scratch[contact];
}

static double value_of(struct fmu_instance *instance, struct fmu_variable variable) {
    const struct refdyn_integrator *integrator = &instance->integrator;
    const struct refdyn_workspace *work = &instance->work;
    const int i = variable.index;
    switch (variable.kind) {
    case FMU_TIME:
        return integrator->t;
    case FMU_COORDINATE:
        return integrator->q[i];
    case FMU_RATE:
    case FMU_COORDINATE_CHANGE:
        return integrator->qd[i];
    case FMU_ACCELERATION:
        return integrator->qdd[i];
    case FMU_POSITION:
        return from_block(instance, FMU_POINTS, instance->r, i);
    case FMU_VELOCITY:
        return from_block(instance, FMU_POINTS, instance->rd, i);
    case FMU_POINT_ACCELERATION:
        return from_block(instance, FMU_POINTS, instance->rdd, i);
    case FMU_PHI:
        return work->phi[i];
    case FMU_PSI:
        return work->psi[i];
    case FMU_ENERGY:
        return from_block(instance, FMU_ENERGIES, instance->energy, i);
    case FMU_FORCE:
        return from_block(instance, FMU_FORCES, instance->force, i);
    case FMU_MULTIPLIER:
        return from_block(instance, FMU_FORCES, instance->lambda, i);
    case FMU_COURSE:
        return from_block(instance, FMU_COURSES, instance->course, i);
    case FMU_ANGULAR_VELOCITY:
    case FMU_ANGULAR_ACCELERATION:
        return angular_value(instance, i, variable.kind == FMU_ANGULAR_ACCELERATION);
    case FMU_INDICATOR:
        return indicator_value(instance, i);
    case FMU_CONTACT_FORCE:
        return contact_force(instance, i);
    case FMU_CONTACT_SINCE:
        return integrator->contact_mode[i] == REFDYN_CONTACT_FREE ? 0 : integrator->contact_since[i];
    case FMU_INPUT:
    case FMU_PARAMETER:
    case FMU_KIND_COUNT:
        break;
    }
    return NAN;
}

static struct fmu_variable find(unsigned reference) {
    return fmu_find_variable(refdyn_fmu.model, refdyn_fmu.spatial, reference);
}

static enum fmu_status get(struct fmu_instance *instance, unsigned reference, double *value) {
    const struct fmu_variable variable = find(reference);
    if (variable.kind == FMU_KIND_COUNT)
        return fmu_tell(instance, FMU_ERROR, "value reference %u: unknown", reference);
    if (variable.kind == FMU_INPUT)
        *value = instance->work.x[variable.index];
    else if (variable.kind == FMU_PARAMETER && instance->mode == FMU_INSTANTIATED)
        *value = instance->work.p[variable.index];
    else {
        const enum fmu_status status = fmu_evaluate(instance); /* also sets anchored parameters */
        if (status != FMU_OK)
            return status;
        *value =
            variable.kind == FMU_PARAMETER ? instance->work.p[variable.index] : value_of(instance, variable);
    }
    return FMU_OK;
}

/* At a communication point of Co-Simulation, values are those from there on, where an event that is due sets
 * only inputs and parameters. */
enum fmu_status fmu_get(struct fmu_instance *instance, unsigned reference, double *value) {
    if (instance->is_exchange || instance->mode != FMU_STEP_MODE)
        return get(instance, reference, value);
    enum fmu_status status = fmu_evaluate(instance);
    if (status != FMU_OK)
        return status;
    const int is_after = refdyn_integrator_see_after(&instance->integrator);
    status = get(instance, reference, value);
    if (is_after)
        refdyn_integrator_see_before(&instance->integrator);
    return status;
}

/* ---- Setting values ---- */

enum {
    BEFORE_START = 1u << FMU_INSTANTIATED | 1u << FMU_INITIALISING,
    AT_REST = BEFORE_START | 1u << FMU_EVENT_MODE | 1u << FMU_STEP_MODE
};

/* Sets q or qd of the start; during the motion, setContinuousStates sets them. */
static enum fmu_status set_start(struct fmu_instance *instance, int place, double value) {
    if (!fmu_allows(instance, BEFORE_START, "setting a start value"))
        return FMU_ERROR;
    instance->start[place] = value;
    instance->is_start_set[place] = 1;
    fmu_invalidate(instance);
    return FMU_OK;
}

static enum fmu_status set_parameter(struct fmu_instance *instance, int place, double value) {
    const struct refdyn_model *model = instance->work.model;
    const int anchored = refdyn_find_anchored(model, place), contact = fmu_contact_of_parameter(model, place);
    if (contact >= 0)
        return fmu_tell(instance, FMU_ERROR, "%s cannot be set: the contact sets it",
                        model->parameters[place].name);
    const int is_fixed = anchored >= 0 || fmu_is_set_by_events(model, REFDYN_CHANGED_PARAMETER, place);
    if (!fmu_allows(instance, is_fixed ? BEFORE_START : AT_REST, "setting this parameter"))
        return FMU_ERROR;
    if (anchored >=
        0) /* importers write back start values: the exported value keeps the parameter anchored */
        instance->given[anchored] = refdyn_fmu.given[anchored] || value != refdyn_fmu.parameters[place];
    else if (instance->work.p[place] == value)
        return FMU_OK;
    instance->work.p[place] = value;
    refdyn_prepare(&instance->work);
    instance->has_new_values = 1;
    instance->has_events_due = 0;
    fmu_invalidate(instance);
    return FMU_OK;
}

/* Sets an input. Model Exchange reads inputs at each evaluation; Co-Simulation restarts its steps. */
static enum fmu_status set_input(struct fmu_instance *instance, int place, double value) {
    const unsigned modes = fmu_is_set_by_events(instance->work.model, REFDYN_CHANGED_INPUT, place)
                               ? BEFORE_START
                               : AT_REST | 1u << FMU_CONTINUOUS_MODE;
    if (!fmu_allows(instance, modes, "setting this input"))
        return FMU_ERROR;
    if (instance->work.x[place] == value)
        return FMU_OK;
    instance->work.x[place] = value;
    instance->has_new_values |= !instance->is_exchange;
    instance->has_events_due = 0;
    fmu_invalidate(instance);
    return FMU_OK;
}

enum fmu_status fmu_set(struct fmu_instance *instance, unsigned reference, double value) {
    const struct fmu_variable variable = find(reference);
    if (!isfinite(value))
        return fmu_tell(instance, FMU_ERROR, "value reference %u: value %g; must be finite", reference,
                        value);
    switch (variable.kind) {
    case FMU_COORDINATE:
        return set_start(instance, variable.index, value);
    case FMU_RATE:
        return set_start(instance, instance->work.n + variable.index, value);
    case FMU_INPUT:
        return set_input(instance, variable.index, value);
    case FMU_PARAMETER:
        return set_parameter(instance, variable.index, value);
    default:
        return fmu_tell(instance, FMU_ERROR, "value reference %u: this variable cannot be set", reference);
    }
}
