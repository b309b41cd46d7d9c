/*
 * Predictive control of the arm of arm.lua at 1 kHz: each millisecond one Gauss-Newton iteration of the
 * optimal control problem over the horizon ahead, from the state as it is, with the emitted step and its
 * derivatives; the first input of the horizon acts until the next. Prints what became of the motion, and how
 * long a step and an iteration took.
 *
 *     refdyn gen docs/casadi/arm.lua --set n_rfe=4 --fold --emit step -o arm
 *     cc -O2 -Iruntime -Iarm docs/casadi/control.c arm/arm.c arm/arm_step.c -lm -o control && ./control
 */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include "arm_step.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { N = arm_n, STATES = 2 * N, INPUTS = arm_input_count, NODES = 16, CYCLES = 3000 };
static const double period = 1e-3, spacing = 25e-3; /* of the loop, of the nodes of the horizon [s] */
static const double weight_of_input = 0.01, last_weight = 20;

struct horizon {
    double u[NODES][INPUTS]; /* inputs between nodes, improved by each iteration */
    double A[NODES][STATES][STATES], B[NODES][STATES][INPUTS];
    double x[NODES + 1][STATES];
    double k[NODES][INPUTS], K[NODES][INPUTS][STATES]; /* change of inputs, and by that of the state */
};

static double work[arm_step_gauss_derivatives_work];
static double step_times[CYCLES * NODES], cycle_times[CYCLES];
static int step_count;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, by_size);
    return values[count / 2];
}

/* Of coordinates and rates: both joints arrive, links are straight and at rest. */
static double weight(int i) {
    return i < N ? 400 : 10;
}

static double goal(int i) {
    return i == arm_COORDINATE_upper_psi ? 1.0 : i == arm_COORDINATE_fore_psi ? -0.8 : 0.0;
}

/* States of the horizon and their derivatives; 1: a step failed. */
static int predict(struct horizon *h, const double *state) {
    static struct arm_step_derivatives d;
    memcpy(h->x[0], state, sizeof h->x[0]);
    for (int i = 0; i < NODES; i++) {
        const double begin = now();
        if (arm_step_gauss(NULL, (const struct arm_inputs *)(const void *)h->u[i], 0, spacing, 1, h->x[i],
                           h->x[i] + N, h->x[i + 1], &d, work))
            return 1;
        step_times[step_count++] = now() - begin;
        memcpy(h->A[i], d.state, sizeof h->A[i]);
        memcpy(h->B[i], d.x, sizeof h->B[i]);
    }
    return 0;
}

/* C (rows x columns) += A^T B, A (inner x rows), B (inner x columns) */
static void add_product(double *C, const double *A, const double *B, int rows, int columns, int inner) {
    for (int k = 0; k < inner; k++)
        for (int i = 0; i < rows; i++)
            for (int j = 0; j < columns; j++)
                C[i * columns + j] += A[k * rows + i] * B[k * columns + j];
}

/* x = S^-1 x for the symmetric S (INPUTS = 2), columns side by side. */
static void solve_two(const double S[4], double *x, int columns) {
    const double det = S[0] * S[3] - S[1] * S[2];
    for (int j = 0; j < columns; j++) {
        const double a = x[j], b = x[columns + j];
        x[j] = (S[3] * a - S[1] * b) / det;
        x[columns + j] = (S[0] * b - S[2] * a) / det;
    }
}

/* Riccati's recursion from the last node: V, v are the second and first derivatives of the cost ahead by the
 * state. */
static void improve(struct horizon *h) {
    double V[STATES][STATES] = {{0}}, v[STATES];
    for (int i = 0; i < STATES; i++) {
        V[i][i] = last_weight * weight(i);
        v[i] = V[i][i] * (h->x[NODES][i] - goal(i));
    }
    for (int node = NODES - 1; node >= 0; node--) {
        double VA[STATES][STATES] = {{0}}, VB[STATES][INPUTS] = {{0}}, S[INPUTS * INPUTS] = {0};
        double next[STATES][STATES] = {{0}}, ahead[STATES] = {0};
        double(*const K)[STATES] = h->K[node], *const k = h->k[node];
        add_product(VA[0], V[0], h->A[node][0], STATES, STATES, STATES);
        add_product(VB[0], V[0], h->B[node][0], STATES, INPUTS, STATES);
        add_product(S, h->B[node][0], VB[0], INPUTS, INPUTS, STATES);
        memset(K, 0, sizeof h->K[node]);
        memset(k, 0, sizeof h->k[node]);
        add_product(K[0], h->B[node][0], VA[0], INPUTS, STATES, STATES);
        add_product(k, h->B[node][0], v, INPUTS, 1, STATES);
        for (int j = 0; j < INPUTS; j++) {
            S[j * INPUTS + j] += weight_of_input;
            k[j] += weight_of_input * h->u[node][j];
        }
        double from[INPUTS][STATES]; /* B^T V A */
        memcpy(from, K, sizeof from);
        solve_two(S, K[0], STATES);
        solve_two(S, k, 1);
        add_product(next[0], h->A[node][0], VA[0], STATES, STATES, STATES);
        add_product(ahead, h->A[node][0], v, STATES, 1, STATES);
        for (int i = 0; i < STATES; i++)
            for (int m = 0; m < INPUTS; m++) {
                for (int j = 0; j < STATES; j++)
                    next[i][j] -= from[m][i] * K[m][j];
                ahead[i] -= from[m][i] * k[m];
            }
        for (int i = 0; i < STATES; i++) {
            next[i][i] += weight(i);
            ahead[i] += weight(i) * (h->x[node][i] - goal(i));
        }
        memcpy(V, next, sizeof V);
        memcpy(v, ahead, sizeof v);
    }
}

/* Inputs along the linearised motion that the recursion found. */
static void take(struct horizon *h) {
    double dx[STATES] = {0};
    for (int node = 0; node < NODES; node++) {
        double du[INPUTS], after[STATES] = {0};
        for (int m = 0; m < INPUTS; m++) {
            du[m] = -h->k[node][m];
            for (int j = 0; j < STATES; j++)
                du[m] -= h->K[node][m][j] * dx[j];
            h->u[node][m] += du[m];
        }
        for (int i = 0; i < STATES; i++) {
            for (int j = 0; j < STATES; j++)
                after[i] += h->A[node][i][j] * dx[j];
            for (int m = 0; m < INPUTS; m++)
                after[i] += h->B[node][i][m] * du[m];
        }
        memcpy(dx, after, sizeof dx);
    }
}

static double distance(const double *state, int from, int to) {
    double largest = 0;
    for (int i = from; i < to; i++)
        largest = fmax(largest, fabs(state[i] - goal(i)));
    return largest;
}

int main(void) {
    static struct horizon h;
    double state[STATES] = {0}, largest = 0, bent = 0;
    for (int cycle = 0; cycle < CYCLES; cycle++) {
        const double begin = now();
        if (predict(&h, state))
            return 3;
        improve(&h);
        take(&h);
        cycle_times[cycle] = now() - begin;
        for (int m = 0; m < INPUTS; m++)
            largest = fmax(largest, fabs(h.u[0][m]));
        /* the arm itself: finer steps of the same equations */
        if (arm_step_gauss(NULL, (const struct arm_inputs *)(const void *)h.u[0], 0, period / 4, 4, state,
                           state + N, state, NULL, work))
            return 3;
        bent = fmax(bent, fabs(state[arm_COORDINATE_upper_psi + 1]));
    }
    printf("after %g s: coordinates off by %.2g rad, rates by %.2g rad/s; largest torque %.3g N m, largest "
           "bend %.2g rad\n",
           CYCLES * period, distance(state, 0, N), distance(state, N, STATES), largest, bent);
    printf("median: step with derivatives %.3g us, iteration over %d steps %.3g us\n",
           1e6 * median(step_times, step_count), NODES, 1e6 * median(cycle_times, CYCLES));
    return 0;
}
