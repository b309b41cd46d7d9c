/* Splits a link into a beam and a rest. The beam's second moments are those of gen/theory.md, sect. 3.3. */
#include "runtime/tool/commands/import/import.h"

#include <math.h>
#include <string.h>

/* Parts of the largest mass that a beam could have, and of the link's mass below which a beam is not worth
 * its name. */
static const double taken_share = 0.99, least_share = 1e-6;

/* The origin of the child joints, which must be one place. */
static bool find_tip(const struct robot *robot, int link, double tip[3]) {
    const struct robot_link *at = &robot->links[link];
    if (at->first < 0)
        return import_robot_complain(robot, at->line, "link %s: it carries nothing; add --tip x,y,z",
                                     at->name);
    const struct robot_joint *first = &robot->joints[robot->links[at->first].joint];
    for (int child = at->first; child >= 0; child = robot->links[child].sibling) {
        const struct robot_joint *joint = &robot->joints[robot->links[child].joint];
        if (memcmp(joint->pose.xyz, first->pose.xyz, sizeof joint->pose.xyz) != 0)
            return import_robot_complain(
                robot, at->line, "link %s: joints %s and %s begin at different places; add --tip x,y,z",
                at->name, first->name, joint->name);
    }
    memcpy(tip, first->pose.xyz, sizeof first->pose.xyz);
    return true;
}

static bool set_line(const struct robot *robot, const struct beam_choice *choice, struct flexible *flexible) {
    const struct robot_link *link = &robot->links[flexible->link];
    double *tip = flexible->tip;
    if (choice->tip)
        memcpy(tip, choice->tip, sizeof flexible->tip);
    else if (!find_tip(robot, flexible->link, tip))
        return false;
    flexible->length = hypot(hypot(tip[0], tip[1]), tip[2]);
    if (!(flexible->length > 0))
        return import_robot_complain(robot, link->line, "link %s: its tip is its origin; add --tip x,y,z",
                                     link->name);
    for (int i = 0; i < 3; i++)
        flexible->direction[i] = tip[i] / flexible->length;
    flexible->psi = atan2(tip[1], tip[0]);
    flexible->theta = atan2(-tip[2], hypot(tip[0], tip[1]));
    return true;
}

/* J of the link, in its frame. */
static void moments_of_link(const struct robot_link *link, double J[16]) {
    double R[9];
    struct body body = {.mass = link->mass};
    import_rotation_of_rpy(link->pose.rpy, R);
    memcpy(body.center, link->pose.xyz, sizeof body.center);
    import_inertia_turn(R, link->inertia, body.inertia);
    import_second_moments(&body, J);
}

/* J of the beam, divided by its mass. */
static void moments_of_beam(const struct flexible *flexible, const struct beam_choice *choice, double J[16]) {
    const double rpy[3] = {0, flexible->theta, flexible->psi};
    const double across = flexible->length * flexible->length / 12, y = choice->Iz / choice->area,
                 z = choice->Iy / choice->area;
    const double along_beam[6] = {y + z, across + z, across + y};
    double R[9];
    struct body body = {.mass = 1};
    import_rotation_of_rpy(rpy, R);
    for (int i = 0; i < 3; i++)
        body.center[i] = flexible->tip[i] / 2;
    import_inertia_turn(R, along_beam, body.inertia);
    import_second_moments(&body, J);
}

static bool complain_of_rest(const struct robot *robot, const struct flexible *flexible, double most,
                             double rho, double volume) {
    const struct robot_link *link = &robot->links[flexible->link];
    if (most > least_share * link->mass)
        return import_robot_complain(
            robot, link->line,
            "link %s: a beam with rho %.6g kg/m^3 has %.6g kg and leaves a body that cannot exist; "
            "rho must be less than %.6g kg/m^3",
            link->name, rho, rho * volume, most / volume);
    return import_robot_complain(robot, link->line,
                                 "link %s: a body with this mass and inertia cannot contain a beam of %.6g m",
                                 link->name, flexible->length);
}

bool import_flexible_make(const struct robot *robot, int link, const struct beam_choice *choice,
                          struct flexible *flexible) {
    double whole[16], beam[16];
    *flexible = (struct flexible){.link = link};
    if (!set_line(robot, choice, flexible))
        return false;
    if (!robot->links[link].has_mass)
        return import_robot_complain(robot, robot->links[link].line, "link %s: has no mass; a beam needs it",
                                     robot->links[link].name);
    moments_of_link(&robot->links[link], whole);
    moments_of_beam(flexible, choice, beam);
    const double volume = choice->area * flexible->length, most = import_second_moments_share(whole, beam);
    const double mass = choice->rho > 0 ? choice->rho * volume : taken_share * most;
    if (!(mass < most) || !(most > least_share * robot->links[link].mass))
        return complain_of_rest(robot, flexible, most, mass / volume, volume);
    flexible->rho = mass / volume;
    for (int i = 0; i < 16; i++)
        whole[i] -= mass * beam[i];
    flexible->rest = import_body_of(whole);
    return true;
}

double import_flexible_along(const struct flexible *flexible, const double point[3]) {
    const double *e = flexible->direction;
    return fmin(fmax(point[0] * e[0] + point[1] * e[1] + point[2] * e[2], 0), flexible->length);
}

void import_flexible_turn_back(const struct flexible *flexible, const double vector[3], double turned[3]) {
    const double rpy[3] = {0, flexible->theta, flexible->psi};
    double R[9];
    import_rotation_of_rpy(rpy, R);
    for (int i = 0; i < 3; i++)
        turned[i] = R[i] * vector[0] + R[3 + i] * vector[1] + R[6 + i] * vector[2];
}
