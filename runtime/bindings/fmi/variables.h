/*
 * The variables of an FMU by value reference, for the FMU and for the program, which describes them.
 * Value references count through the kinds below, each with the number of variables that the model has. Rows
 * and points that a kind leaves out keep their numbers.
 */
#ifndef REFDYN_VARIABLES_H
#define REFDYN_VARIABLES_H

#include "refdyn_model.h"

enum fmu_kind {
    FMU_TIME,
    FMU_COORDINATE,         /* (joints) q */
    FMU_RATE,               /* (n) qd: rates of joints, then states of controllers */
    FMU_COORDINATE_CHANGE,  /* (joints) the derivative of q, which is qd */
    FMU_ACCELERATION,       /* (n) qdd, the derivative of qd */
    FMU_POSITION,           /* (points x 3) r */
    FMU_VELOCITY,           /* (points x 3) rd */
    FMU_POINT_ACCELERATION, /* (points x 3) rdd */
    FMU_PHI,                /* (m) position rows only */
    FMU_PSI,                /* (m) position and velocity rows only */
    FMU_ENERGY,             /* (3) total, kinetic, potential */
    FMU_FORCE,              /* (joints) programme force, if there are rows */
    FMU_MULTIPLIER,         /* (m) lambda */
    FMU_INPUT,
    FMU_COURSE,
    FMU_ANGULAR_VELOCITY,     /* (points of spatial x 3) */
    FMU_ANGULAR_ACCELERATION, /* (points of spatial x 3) */
    FMU_PARAMETER,
    FMU_CONTACT_FORCE, /* (contacts) 0 while the contact does not rest */
    FMU_CONTACT_SINCE, /* (contacts) time at which it came to rest; 0 while it is open */
    FMU_INDICATOR,     /* event indicators: variables in FMI 3.0 only */
    FMU_KIND_COUNT
};

struct fmu_variable {
    enum fmu_kind kind; /* FMU_KIND_COUNT: no such variable */
    int index;
};

/* Returns the number of continuous states of the FMU: q of joints, then qd (n). */
int fmu_count_states(const struct refdyn_model *model);
/* Returns the number of one-sided contacts; their rows are the last ones. */
int fmu_count_contacts(const struct refdyn_model *model);
/* Returns the number of event indicators: state events, kinks, values whose sign changes at time events. */
int fmu_count_indicators(const struct refdyn_model *model);
/* Returns the number of variables of a kind. spatial may be NULL. */
int fmu_count_variables(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                        enum fmu_kind kind);
/* Returns whether the row belongs to the kind. */
int fmu_has_row(const struct refdyn_model *model, enum fmu_kind kind, int row);
unsigned fmu_reference(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                       struct fmu_variable variable);
struct fmu_variable fmu_find_variable(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                                      unsigned reference);
/* Returns whether events of the model set the input (or parameter), so that it cannot be set from outside. */
int fmu_is_set_by_events(const struct refdyn_model *model, enum refdyn_changed what, int place);
/* Returns the number of the contact whose mode this parameter is; -1: none. */
int fmu_contact_of_parameter(const struct refdyn_model *model, int place);

#endif
