/*
 * The torque that a four-bar linkage needs at its crank for a given acceleration of the crank. The linkage
 * has three coordinates, two rows that close its loop, and one drive. The matrix A has the crank's unit
 * vector and the two rows u; then
 *
 *     A qdd = (acceleration, k)       the accelerations of all coordinates
 *     A^T (torque, lambda) = tau      the drive and the rows supply tau = M qdd - h - Q together
 *
 * Prints the torque, and the crank's acceleration under this torque.
 */
#include "fourbar.h"

#include <math.h>
#include <stdio.h>

enum { N = fourbar_n, M = fourbar_m, DRIVES = N - M };

static void swap(double *a, double *b) {
    const double kept = *a;
    *a = *b;
    *b = kept;
}

/* Replaces b by the solution x of A x = b, by elimination with the largest pivot of each column. */
static void solve(double A[N][N], double b[N]) {
    for (int p = 0; p < N; p++) {
        int largest = p;
        for (int i = p + 1; i < N; i++)
            if (fabs(A[i][p]) > fabs(A[largest][p]))
                largest = i;
        for (int j = 0; j < N; j++)
            swap(&A[p][j], &A[largest][j]);
        swap(&b[p], &b[largest]);
        for (int i = p + 1; i < N; i++) {
            const double factor = A[i][p] / A[p][p];
            for (int j = p; j < N; j++)
                A[i][j] -= factor * A[p][j];
            b[i] -= factor * b[p];
        }
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int j = i + 1; j < N; j++)
            b[i] -= A[i][j] * b[j];
        b[i] /= A[i][i];
    }
}

/* A, or its transpose. */
static void set_matrix(const double u[M * N], int is_transposed, double A[N][N]) {
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double value = i < DRIVES ? j == fourbar_COORDINATE_crank_psi : u[(i - DRIVES) * N + j];
            *(is_transposed ? &A[j][i] : &A[i][j]) = value;
        }
}

int main(void) {
    struct fourbar_parameters p;
    struct fourbar_inputs x = {0}; /* no torque: the model's forces are then the weight alone */
    double start[2 * N], k[M], u[M * N], A[N][N], qdd[N], tau[N];
    const double *q = start, *qd = start + N;
    fourbar_defaults(&p);
    fourbar_start(&p, &x, 0, NULL, NULL, start);

    const double acceleration = 12; /* of the crank [rad/s^2] */
    fourbar_u(&p, &x, 0, q, qd, u);
    fourbar_k(&p, &x, 0, q, qd, k);
    qdd[0] = acceleration;
    for (int i = 0; i < M; i++)
        qdd[DRIVES + i] = k[i];
    set_matrix(u, 0, A);
    solve(A, qdd);
    fourbar_inverse(&p, &x, 0, q, qd, qdd, tau);
    set_matrix(u, 1, A);
    solve(A, tau);

    x.torque = tau[0];
    fourbar_qdd(&p, &x, 0, q, qd, qdd);
    printf("torque %.6f N m, acceleration %.9g rad/s^2\n", tau[0], qdd[fourbar_COORDINATE_crank_psi]);
    return 0;
}
