/*
 * Vibration of a flexible arm after a motion from rest to rest under two feed-forwards: by the inverse
 * dynamics of the arm with rigid links (stiff.h), and by that of the arm with flexible links (soft.h), which
 * bends the links as the motion requires. The emitted step moves the arm, 1 ms a call; neither the runtime
 * nor any memory but the program's variables is needed. Prints how far the hand swings about its goal after
 * the end.
 */
#include "soft_step.h"
#include "stiff.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    N = soft_n,
    JOINTS = stiff_n,
    BENDS = N - JOINTS,
    LONGEST = 2000, /* cycles of a motion */
    AFTER = 2000    /* cycles in which the hand is observed */
};
static const double period = 1e-3;               /* of the loop [s] */
static const double stiffness = 20, damping = 6; /* of the feedback: N m/rad, N m s/rad */
static const double way[JOINTS] = {0.8, -0.6};   /* [rad] */
static const int joint[JOINTS] = {soft_COORDINATE_upper_psi, soft_COORDINATE_fore_psi};

/* Each cycle of a motion: the coordinates, their rates and accelerations, and the torques of the motors. */
static double q[LONGEST + 1][N], qd[LONGEST + 1][N], qdd[LONGEST + 1][N], torque[LONGEST + 1][JOINTS];
static struct soft_parameters soft;
static struct stiff_parameters stiff;
static const struct soft_inputs none;

/* The joints follow 126 u^5 - 420 u^6 + 540 u^7 - 315 u^8 + 70 u^9, u = t/T; the links are straight. */
static void set_motion(int cycles) {
    const double T = cycles * period;
    memset(q, 0, sizeof q);
    memset(qd, 0, sizeof qd);
    memset(qdd, 0, sizeof qdd);
    for (int k = 0; k <= cycles; k++)
        for (int i = 0; i < JOINTS; i++) {
            const double u = (double)k / cycles, v = 1 - u;
            q[k][joint[i]] = way[i] * pow(u, 5) * (126 + u * (-420 + u * (540 + u * (-315 + u * 70))));
            qd[k][joint[i]] = way[i] * 630 * pow(u * v, 4) / T;
            qdd[k][joint[i]] = way[i] * 2520 * pow(u * v, 3) * (1 - 2 * u) / (T * T);
        }
}

static void feed_stiff(int cycles) {
    static const struct stiff_inputs still;
    for (int k = 0; k <= cycles; k++) {
        double at[JOINTS], rate[JOINTS], acceleration[JOINTS];
        for (int i = 0; i < JOINTS; i++) {
            at[i] = q[k][joint[i]];
            rate[i] = qd[k][joint[i]];
            acceleration[i] = qdd[k][joint[i]];
        }
        stiff_inverse(&stiff, &still, 0, at, rate, acceleration, torque[k]);
    }
}

/* ---- Bent links ---- */

static int is_joint(int i) {
    return i == joint[0] || i == joint[1];
}

/* Solves A x = b for the positive definite A, by elimination. */
static void solve(double A[BENDS][BENDS], double b[BENDS]) {
    for (int p = 0; p < BENDS; p++)
        for (int i = p + 1; i < BENDS; i++) {
            const double factor = A[i][p] / A[p][p];
            for (int j = p; j < BENDS; j++)
                A[i][j] -= factor * A[p][j];
            b[i] -= factor * b[p];
        }
    for (int i = BENDS - 1; i >= 0; i--) {
        for (int j = i + 1; j < BENDS; j++)
            b[i] -= A[i][j] * b[j];
        b[i] /= A[i][i];
    }
}

/* One Newton iteration: bends the links until they bear the loads of the joints' motion with no force but
 * their own. The loads of their own vibration are left out here. */
static void bend(int k) {
    static struct soft_d_inverse_result d;
    double tau[N], A[BENDS][BENDS], b[BENDS];
    soft_inverse(&soft, &none, 0, q[k], qd[k], qdd[k], tau);
    soft_d_inverse(&soft, &none, 0, q[k], qd[k], qdd[k], &d);
    for (int i = 0, row = 0; i < N; i++) {
        if (is_joint(i))
            continue;
        for (int j = 0, column = 0; j < N; j++)
            if (!is_joint(j))
                A[row][column++] = d.q[i * N + j];
        b[row++] = -tau[i];
    }
    solve(A, b);
    for (int i = 0, row = 0; i < N; i++)
        if (!is_joint(i))
            q[k][i] += b[row++];
}

/* Rates and accelerations of the bends, by differences; they are 0 at both ends. */
static void differentiate(int cycles) {
    for (int k = 1; k < cycles; k++)
        for (int i = 0; i < N; i++)
            if (!is_joint(i)) {
                qd[k][i] = (q[k + 1][i] - q[k - 1][i]) / (2 * period);
                qdd[k][i] = (q[k + 1][i] - 2 * q[k][i] + q[k - 1][i]) / (period * period);
            }
}

static void feed_soft(int cycles) {
    for (int k = 0; k <= cycles; k++)
        for (int iteration = 0; iteration < 3; iteration++)
            bend(k);
    differentiate(cycles);
    for (int k = 0; k <= cycles; k++) {
        double tau[N];
        soft_inverse(&soft, &none, 0, q[k], qd[k], qdd[k], tau);
        for (int i = 0; i < JOINTS; i++)
            torque[k][i] = tau[joint[i]];
    }
}

/* ---- The motion ---- */

/* Largest distance of the hand from its goal after the motion [m]; -1: a step failed. */
static double swing(int cycles) {
    static double work[soft_step_gauss_work];
    double state[2 * N] = {0}, next[2 * N], goal[3 * soft_point_count], r[3 * soft_point_count], largest = 0;
    const double *hand = r + 3 * soft_POINT_hand, *end = goal + 3 * soft_POINT_hand;
    soft_r(&soft, &none, 0, q[cycles], qd[cycles], goal);
    for (int k = 0; k < cycles + AFTER; k++) {
        const int at = k < cycles ? k : cycles;
        double u[JOINTS];
        for (int i = 0; i < JOINTS; i++)
            u[i] = torque[at][i] + stiffness * (q[at][joint[i]] - state[joint[i]]) +
                   damping * (qd[at][joint[i]] - state[N + joint[i]]);
        const struct soft_inputs x = {.shoulder = u[0], .elbow = u[1]};
        if (soft_step_gauss(&soft, &x, k * period, period, 1, state, state + N, next, NULL, work))
            return -1;
        memcpy(state, next, sizeof state);
        soft_r(&soft, &none, 0, state, state + N, r);
        if (k >= cycles)
            largest = fmax(largest, hypot(hand[0] - end[0], hand[1] - end[1]));
    }
    return largest;
}

int main(void) {
    static const int lengths[] = {1000, 1500, LONGEST};
    soft_defaults(&soft);
    stiff_defaults(&stiff);
    for (int i = 0; i < 3; i++) {
        set_motion(lengths[i]);
        feed_stiff(lengths[i]);
        const double of_stiff = swing(lengths[i]);
        feed_soft(lengths[i]);
        const double of_soft = swing(lengths[i]);
        printf("%.1f s: the hand swings by %.2g mm, with the feed-forward of flexible links by %.2g mm\n",
               lengths[i] * period, 1e3 * of_stiff, 1e3 * of_soft);
        if (of_stiff < 0 || of_soft < 0)
            return 1;
    }
    return 0;
}
