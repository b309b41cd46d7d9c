/*
 * A rigid link of a robot as a uniform beam and what the beam does not have of it.
 *
 * The beam runs from the origin of the link's frame to its tip. It takes as much of the link's mass as leaves
 * a body that can exist, less a hundredth of that, or what a given density says; the rest, a body with the
 * remaining mass, first and second moments, is fixed to the section that is nearest to its centre. So the
 * straight beam and the rest have the link's mass, centre and inertia.
 */
#ifndef REFDYN_TOOL_FLEXIBLE_H
#define REFDYN_TOOL_FLEXIBLE_H

#include "import/inertia.h"
#include "import/robot.h"

struct beam_choice {
    const char *section; /* as the model has it, "rd.round(0.05)" */
    double area, Iy, Iz; /* of it [m^2, m^4] */
    double E, nu, eta;   /* [Pa, 1, s] */
    double rho;          /* [kg/m^3] 0: from the link's mass */
    int rfe;             /* rigid finite elements */
    const double *tip;   /* (3) in the link's frame; NULL: the origin of its child joints */
};

struct flexible {
    int link;
    double tip[3], length;
    double psi, theta;   /* Rz(psi) Ry(theta) turns the link's x axis onto the beam */
    double direction[3]; /* of it in the link's frame */
    double rho;
    struct body rest; /* in the link's frame */
};

/* False with a complaint. */
bool flexible_make(const struct robot *robot, int link, const struct beam_choice *choice,
                   struct flexible *flexible);
/* How far along the beam the section lies that is nearest to a point of the link. */
double flexible_along(const struct flexible *flexible, const double point[3]);
/* A vector of the link's frame along the beam's axes. */
void flexible_turn_back(const struct flexible *flexible, const double vector[3], double turned[3]);

#endif
