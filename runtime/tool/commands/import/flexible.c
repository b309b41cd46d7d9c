/*
 * Mass data of rigid bodies, and a link as a uniform beam and a rest.
 *
 * The second moments of a body are the symmetric 4x4 matrix J = int p p^T dm with p = (x, y, z, 1). It
 * combines mass, first moments and int r r^T dm. Second moments of several bodies add up. A body with given
 * J exists if and only if J has no negative eigenvalue. Source: Wensing, Kim, Slotine (2018), Linear matrix
 * inequalities for physically consistent inertial parameter identification, eq. (8) to (12). Eigenvalues are
 * those of LAPACK.
 *
 * The beam runs from the origin of the link's frame to its tip. Its mass is a given density's, or 99 % of
 * the largest mass for which the rest is still a body that can exist. Its second moments are those of
 * gen/theory.md, sect. 3.3. The rest is a body with the remaining mass, first and second moments, fixed to
 * the section that is nearest to its centre.
 */
#include <lapacke.h>
#include <math.h>
#include <string.h>

#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/format/format.h"

/* ---- Mass data ---- */

static const double rounding = 1e-14;

void import_tidy(double *list, int count, double scale) {
    char text[NUMBER_LENGTH];
    for (int i = 0; i < count; i++)
        if (fabs(list[i]) < rounding * scale)
            list[i] = 0;
        else
            text_to_number(format_near_number(list[i], text), &list[i]);
}

/* Places of xx yy zz xy xz yz. */
static const int rows[6] = {0, 1, 2, 0, 0, 1}, columns[6] = {0, 1, 2, 1, 2, 2};

/* Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]), by rows. */
static void rotation_of_rpy(const double rpy[3], double R[9]) {
    const double cr = cos(rpy[0]), sr = sin(rpy[0]), cp = cos(rpy[1]), sp = sin(rpy[1]), cy = cos(rpy[2]),
                 sy = sin(rpy[2]);
    const double made[9] = {cy * cp,
                            cy * sp * sr - sy * cr,
                            cy * sp * cr + sy * sr,
                            sy * cp,
                            sy * sp * sr + cy * cr,
                            sy * sp * cr - cy * sr,
                            -sp,
                            cp * sr,
                            cp * cr};
    memcpy(R, made, sizeof made);
}

/* The tensor xx yy zz xy xz yz along other axes, onto which R turns the given ones. */
static void inertia_turn(const double R[9], const double tensor[6], double turned[6]) {
    double full[9];
    for (int k = 0; k < 6; k++)
        full[3 * rows[k] + columns[k]] = full[3 * columns[k] + rows[k]] = tensor[k];
    for (int k = 0; k < 6; k++) {
        turned[k] = 0;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                turned[k] += R[3 * rows[k] + i] * full[3 * i + j] * R[3 * columns[k] + j];
    }
}

/* int r r^T dm of a tensor of inertia, and back: each is tr/2 or tr times the unit tensor, less the other. */
static void flip(const double from[6], double part, double to[6]) {
    const double trace = from[0] + from[1] + from[2];
    for (int k = 0; k < 6; k++)
        to[k] = (k < 3 ? part * trace : 0) - from[k];
}

static void second_moments(const struct body *body, double J[16]) {
    double about_center[6];
    flip(body->inertia, 0.5, about_center);
    for (int k = 0; k < 6; k++)
        J[4 * rows[k] + columns[k]] = J[4 * columns[k] + rows[k]] =
            about_center[k] + body->mass * body->center[rows[k]] * body->center[columns[k]];
    for (int i = 0; i < 3; i++)
        J[4 * i + 3] = J[12 + i] = body->mass * body->center[i];
    J[15] = body->mass;
}

static struct body body_of_moments(const double J[16]) {
    struct body body = {.mass = J[15]};
    double about_center[6];
    for (int i = 0; i < 3; i++)
        body.center[i] = J[12 + i] / body.mass;
    for (int k = 0; k < 6; k++)
        about_center[k] =
            J[4 * rows[k] + columns[k]] - body.mass * body.center[rows[k]] * body.center[columns[k]];
    flip(about_center, 1, body.inertia);
    return body;
}

/* The largest eigenvalue of B x = lambda A x is 1/s; A is positive definite. */
/* The largest s for which A - s B belongs to a body; 0 if A itself belongs to none. B belongs to a body. */
static double second_moments_share(const double A[16], const double B[16]) {
    double a[16], b[16], lambda[4];
    memcpy(a, A, sizeof a);
    memcpy(b, B, sizeof b);
    if (LAPACKE_dsygv(LAPACK_ROW_MAJOR, 1, 'N', 'U', 4, b, 4, a, 4, lambda) != 0)
        return 0;
    return 1 / lambda[3];
}

/* Eigenvalues, ascending, of a symmetric tensor xx yy zz xy xz yz; V has its eigenvectors as columns. */
static bool solve_tensor(const double tensor[6], double lambda[3], double V[9]) {
    for (int k = 0; k < 6; k++)
        V[3 * rows[k] + columns[k]] = V[3 * columns[k] + rows[k]] = tensor[k];
    return LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'V', 'U', 3, V, 3, lambda) == 0;
}

/* As the generator decides: if a moment is missing, it checks only the given ones. */
static bool is_possible(const double inertia[6]) {
    const double slack = 1e-11; /* the generator checks more */
    const bool is_complete = inertia[0] > 0 && inertia[1] > 0 && inertia[2] > 0;
    double second[6], lambda[3], V[9];
    flip(inertia, 0.5, second);
    return !solve_tensor(is_complete ? second : inertia, lambda, V) || lambda[0] >= -slack * fabs(lambda[2]);
}

bool import_inertia_mend(double inertia[6]) {
    double second[6], V[9], lambda[3], mended[6] = {0};
    flip(inertia, 0.5, second);
    const bool is_kept = is_possible(inertia) || !solve_tensor(second, lambda, V);
    for (int i = 0; i < 3 && is_kept; i++)
        inertia[i] = fmax(inertia[i], 0); /* negative values come from rounding */
    if (is_kept)
        return false;
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 3; i++)
            mended[k] += fmax(lambda[i], 0) * V[3 * rows[k] + i] * V[3 * columns[k] + i];
    flip(mended, 1, inertia);
    return true;
}

/* The beam has this part of the largest mass that it could have. A beam with less than the second part of the
 * link's mass is refused as negligible. */
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
    rotation_of_rpy(link->pose.rpy, R);
    memcpy(body.center, link->pose.xyz, sizeof body.center);
    inertia_turn(R, link->inertia, body.inertia);
    second_moments(&body, J);
}

/* J of the beam, divided by its mass. */
static void moments_of_beam(const struct flexible *flexible, const struct beam_choice *choice, double J[16]) {
    const double rpy[3] = {0, flexible->theta, flexible->psi};
    const double across = flexible->length * flexible->length / 12, y = choice->Iz / choice->area,
                 z = choice->Iy / choice->area;
    const double along_beam[6] = {y + z, across + z, across + y};
    double R[9];
    struct body body = {.mass = 1};
    rotation_of_rpy(rpy, R);
    for (int i = 0; i < 3; i++)
        body.center[i] = flexible->tip[i] / 2;
    inertia_turn(R, along_beam, body.inertia);
    second_moments(&body, J);
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
    const double volume = choice->area * flexible->length, most = second_moments_share(whole, beam);
    const double mass = choice->rho > 0 ? choice->rho * volume : taken_share * most;
    if (!(mass < most) || !(most > least_share * robot->links[link].mass))
        return complain_of_rest(robot, flexible, most, mass / volume, volume);
    flexible->rho = mass / volume;
    for (int i = 0; i < 16; i++)
        whole[i] -= mass * beam[i];
    flexible->rest = body_of_moments(whole);
    return true;
}

double import_flexible_along(const struct flexible *flexible, const double point[3]) {
    const double *e = flexible->direction;
    return fmin(fmax(point[0] * e[0] + point[1] * e[1] + point[2] * e[2], 0), flexible->length);
}

void import_flexible_turn_back(const struct flexible *flexible, const double vector[3], double turned[3]) {
    const double rpy[3] = {0, flexible->theta, flexible->psi};
    double R[9];
    rotation_of_rpy(rpy, R);
    for (int i = 0; i < 3; i++)
        turned[i] = R[i] * vector[0] + R[3 + i] * vector[1] + R[6 + i] * vector[2];
}
