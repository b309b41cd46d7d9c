/* Value references: the variable that each number denotes. */
#include "runtime/bindings/fmi/variables.h"

#include <stddef.h>

#include "runtime/core/base/core.h"

int fmu_count_contacts(const struct refdyn_model *model) {
    return model->m - refdyn_programme_rows(model);
}

int fmu_count_states(const struct refdyn_model *model) {
    return refdyn_joint_count(model) + model->n;
}

int fmu_count_indicators(const struct refdyn_model *model) {
    return model->event_count + model->kink_count + model->switch_count;
}

int fmu_count_variables(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                        enum fmu_kind kind) {
    const int angular = spatial ? 3 * spatial->count : 0;
    switch (kind) {
    case FMU_TIME:
        return 1;
    case FMU_COORDINATE:
    case FMU_COORDINATE_CHANGE:
        return refdyn_joint_count(model);
    case FMU_RATE:
    case FMU_ACCELERATION:
        return model->n;
    case FMU_POSITION:
    case FMU_VELOCITY:
    case FMU_POINT_ACCELERATION:
        return 3 * model->point_count;
    case FMU_PHI:
    case FMU_PSI:
    case FMU_MULTIPLIER:
        return model->m;
    case FMU_ENERGY:
        return model->energy ? 3 : 0;
    case FMU_FORCE:
        return model->m > 0 ? refdyn_joint_count(model) : 0;
    case FMU_INPUT:
        return model->input_count;
    case FMU_COURSE:
        return model->course_count;
    case FMU_ANGULAR_VELOCITY:
    case FMU_ANGULAR_ACCELERATION:
        return angular;
    case FMU_PARAMETER:
        return model->parameter_count;
    case FMU_CONTACT_FORCE:
    case FMU_CONTACT_SINCE:
        return fmu_count_contacts(model);
    case FMU_INDICATOR:
        return fmu_count_indicators(model);
    case FMU_KIND_COUNT:
        break;
    }
    return 0;
}

int fmu_has_row(const struct refdyn_model *model, enum fmu_kind kind, int row) {
    const enum refdyn_row_level level = model->rows[row].level;
    switch (kind) {
    case FMU_PHI:
        return level == REFDYN_POSITION;
    case FMU_PSI:
        return level != REFDYN_ACCELERATION;
    default:
        return 1;
    }
}

unsigned fmu_reference(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                       struct fmu_variable variable) {
    int before = 0;
    for (int kind = 0; kind < (int)variable.kind; kind++)
        before += fmu_count_variables(model, spatial, (enum fmu_kind)kind);
    return (unsigned)(before + variable.index);
}

struct fmu_variable fmu_find_variable(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                                      unsigned reference) {
    for (int kind = 0; kind < FMU_KIND_COUNT; kind++) {
        const unsigned count = (unsigned)fmu_count_variables(model, spatial, (enum fmu_kind)kind);
        if (reference < count)
            return (struct fmu_variable){(enum fmu_kind)kind, (int)reference};
        reference -= count;
    }
    return (struct fmu_variable){FMU_KIND_COUNT, 0};
}

int fmu_is_set_by_events(const struct refdyn_model *model, enum refdyn_changed what, int place) {
    for (int i = 0; i < model->change_count; i++)
        if (model->changes[i].what == what && model->changes[i].place == place)
            return 1;
    return 0;
}

int fmu_contact_of_parameter(const struct refdyn_model *model, int place) {
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact > 0 && refdyn_contact_mode_place(model, i) == place)
            return model->events[i].contact - 1 - refdyn_programme_rows(model);
    return -1;
}
