/*
 * Computed-torque control of the Puma at 1 kHz. The controller has the robot with a rigid forearm (robot.h).
 * A motion of the robot with a flexible forearm (plant.h) takes the place of the hardware. Prints how far the
 * axes are from the reference motion with inverse dynamics and without, and the time of a controller call.
 */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include "plant.h"
#include "refdyn.h"
#include "robot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { AXES = robot_n, CYCLES = 1500, MEMORY = 1 << 16 };
static const double period = 1e-3, duration = 1.0; /* of the loop, of the reference motion [s] */
static const double stiffness = 400, damping = 40; /* of the errors: 1/s^2, 1/s; both roots are -20/s */
static const double from[AXES] = {0, 0.785, 3.142, 0, 0.785, 0}, way[AXES] = {1.2, 0.5, -0.6, 0.4, 0.5, 1.0};

/* The axes among the coordinates of the plant, in the order of the robot's. */
static const int axis[AXES] = {plant_COORDINATE_axis1_psi, plant_COORDINATE_axis2_psi,
                               plant_COORDINATE_axis3_psi, plant_COORDINATE_axis4_psi,
                               plant_COORDINATE_axis5_psi, plant_COORDINATE_axis6_psi};

struct reference {
    double q[AXES], qd[AXES], qdd[AXES];
};

/* From rest to rest along the polynomial 10 s^3 - 15 s^4 + 6 s^5. */
static void reference_at(double t, struct reference *c) {
    const double s = t < duration ? t / duration : 1, T = duration;
    for (int i = 0; i < AXES; i++) {
        c->q[i] = from[i] + way[i] * s * s * s * (10 + s * (6 * s - 15));
        c->qd[i] = way[i] * 30 * s * s * (1 - s) * (1 - s) / T;
        c->qdd[i] = way[i] * 60 * s * (1 - s) * (1 - 2 * s) / (T * T);
    }
}

/* Torques for the measured q and qd: tau = M (qdd + damping de/dt + stiffness e) - h - Q, with Q of the model
 * at zero inputs. It allocates nothing, and each call executes the same operations. */
static void control(const struct robot_parameters *p, const struct reference *c, const double *q,
                    const double *qd, double *tau) {
    static const struct robot_inputs none;
    double qdd[AXES];
    for (int i = 0; i < AXES; i++)
        qdd[i] = c->qdd[i] + damping * (c->qd[i] - qd[i]) + stiffness * (c->q[i] - q[i]);
    robot_inverse(p, &none, 0, q, qd, qdd, tau);
}

/* The same gains without a model: each axis has its mean inertia, and nothing bears its weight. */
static void control_axes(const struct reference *c, const double *q, const double *qd, double *tau) {
    static const double inertia[AXES] = {3.0, 4.0, 1.1, 0.2, 0.18, 0.19}; /* [kg m^2] */
    for (int i = 0; i < AXES; i++)
        tau[i] = inertia[i] * (damping * (c->qd[i] - qd[i]) + stiffness * (c->q[i] - q[i]));
}

/* ---- The plant ---- */

struct plant {
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    _Alignas(16) unsigned char work_memory[MEMORY], integrator_memory[MEMORY]; /* of fixed size, checked */
};

static int start(struct plant *plant) {
    const struct refdyn_options options = refdyn_options_default(REFDYN_RODAS5P);
    double q[plant_n] = {0}, qd[plant_n] = {0};
    for (int i = 0; i < AXES; i++)
        q[axis[i]] = from[i];
    int status = refdyn_workspace_init(&plant->work, &plant_model, plant->work_memory, MEMORY);
    if (!status)
        status = refdyn_integrator_init(&plant->integrator, &plant->work, &options, plant->integrator_memory,
                                        MEMORY);
    return status ? status : refdyn_integrator_start(&plant->integrator, 0, q, qd);
}

/* Moves the plant to t under constant torques. */
static int move(struct plant *plant, const double *tau, double t) {
    for (int i = 0; i < AXES; i++)
        plant->work.x[i] = tau[i];
    refdyn_integrator_limit(&plant->integrator, t);
    return refdyn_integrator_to(&plant->integrator, t);
}

/* ---- The loop ---- */

/* Subtracts whole numbers, so that the result keeps its nanoseconds however large the times are. */
static double microseconds(const struct timespec *begin, const struct timespec *end) {
    return 1e6 * (double)(end->tv_sec - begin->tv_sec) + 1e-3 * (double)(end->tv_nsec - begin->tv_nsec);
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The largest error of an axis, or -1 if the motion fails. */
static double run(int has_model, double times[CYCLES]) {
    static struct plant plant;
    struct robot_parameters p;
    struct reference reference;
    double q[AXES], qd[AXES], tau[AXES], worst = 0;
    robot_defaults(&p);
    int status = start(&plant);
    for (int k = 0; k < CYCLES && !status; k++) {
        reference_at(k * period, &reference);
        for (int i = 0; i < AXES; i++) {
            q[i] = plant.integrator.q[axis[i]];
            qd[i] = plant.integrator.qd[axis[i]];
            worst = fmax(worst, fabs(reference.q[i] - q[i]));
        }
        struct timespec begin, end;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        if (has_model)
            control(&p, &reference, q, qd, tau);
        else
            control_axes(&reference, q, qd, tau);
        clock_gettime(CLOCK_MONOTONIC, &end);
        times[k] = microseconds(&begin, &end);
        status = move(&plant, tau, (k + 1) * period);
    }
    if (status)
        fprintf(stderr, "%g s: %s\n", plant.integrator.t, refdyn_status_text(status));
    return status ? -1 : worst;
}

int main(void) {
    static double times[CYCLES];
    const double without = run(0, times), with = run(1, times);
    qsort(times, CYCLES, sizeof *times, by_size);
    printf("error without the model %.3g rad, with inverse dynamics %.3g rad\n", without, with);
    printf("controller: median %.2f us, longest of %d %.2f us\n", times[CYCLES / 2], CYCLES,
           times[CYCLES - 1]);
    return without < 0 || with < 0;
}
