/*
 * The variables of an FMU: what stands behind a value reference.
 *
 * Value references count through the kinds below, each with as many variables as the model has of it; rows
 * and points that a kind leaves out keep their numbers. The same for the program, which describes them, and
 * for the FMU.
 */
#ifndef REFDYN_VARIABLES_H
#define REFDYN_VARIABLES_H

#include "refdyn_model.h"

enum fmu_kind {
    FMU_TIME,
    FMU_COORDINATE,         /* (n) q */
    FMU_RATE,               /* (n) qd */
    FMU_COORDINATE_CHANGE,  /* (n) the derivative of q, which is qd */
    FMU_ACCELERATION,       /* (n) qdd, the derivative of qd */
    FMU_POSITION,           /* (points x 3) r */
    FMU_VELOCITY,           /* (points x 3) rd */
    FMU_POINT_ACCELERATION, /* (points x 3) rdd */
    FMU_PHI,                /* (m) of position rows alone */
    FMU_PSI,                /* (m) of position and velocity rows alone */
    FMU_ENERGY,             /* (3) both, kinetic, potential */
    FMU_FORCE,              /* (n) programme force, where there are rows */
    FMU_MULTIPLIER,         /* (m) lambda */
    FMU_INPUT,
    FMU_COURSE,
    FMU_ANGULAR_VELOCITY,     /* (points of spatial x 3) */
    FMU_ANGULAR_ACCELERATION, /* (points of spatial x 3) */
    FMU_PARAMETER,
    FMU_CONTACT_FORCE, /* (contacts) 0 while the contact does not rest */
    FMU_CONTACT_SINCE, /* (contacts) when it came to rest; 0 while it is free */
    FMU_INDICATOR,     /* event indicators: variables of FMI 3.0 alone */
    FMU_KIND_COUNT
};

struct fmu_variable {
    enum fmu_kind kind; /* FMU_KIND_COUNT: there is none */
    int index;
};

/* One-sided contacts; their rows are the last ones. */
int fmu_count_contacts(const struct refdyn_model *model);
/* Values that cross zero where something happens: events, kinks, and what changes sign at kinks in time. */
int fmu_count_indicators(const struct refdyn_model *model);
/* How many variables of a kind there are. spatial may be NULL. */
int fmu_count_variables(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                        enum fmu_kind kind);
/* Is the row one of those that the kind tells of? */
int fmu_has_row(const struct refdyn_model *model, enum fmu_kind kind, int row);
unsigned fmu_reference(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                       struct fmu_variable variable);
struct fmu_variable fmu_find_variable(const struct refdyn_model *model, const struct refdyn_spatial *spatial,
                                      unsigned reference);
/* Is the input (or parameter) set by an event of the model, and not from outside? */
int fmu_is_set_by_events(const struct refdyn_model *model, enum refdyn_changed what, int place);
/* The contact, by its place among the contacts, whose mode this parameter is; -1: no contact. */
int fmu_contact_of_parameter(const struct refdyn_model *model, int place);

#endif
