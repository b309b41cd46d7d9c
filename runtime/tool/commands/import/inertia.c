/* Mass data of rigid bodies: rotations, principal axes by the eigenvalues of LAPACK, and computed numbers
 * without rounding. */
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/format/format.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

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

void import_rotation_of_rpy(const double rpy[3], double R[9]) {
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

void import_inertia_turn(const double R[9], const double tensor[6], double turned[6]) {
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

void import_second_moments(const struct body *body, double J[16]) {
    double about_center[6];
    flip(body->inertia, 0.5, about_center);
    for (int k = 0; k < 6; k++)
        J[4 * rows[k] + columns[k]] = J[4 * columns[k] + rows[k]] =
            about_center[k] + body->mass * body->center[rows[k]] * body->center[columns[k]];
    for (int i = 0; i < 3; i++)
        J[4 * i + 3] = J[12 + i] = body->mass * body->center[i];
    J[15] = body->mass;
}

struct body import_body_of(const double J[16]) {
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
double import_second_moments_share(const double A[16], const double B[16]) {
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
