/*
 * Motions of the runtime core: tables, orders, landing, energy, drift, failures.
 */
#include <float.h>
#include <stdbool.h>
#include <string.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "check.h"
#include "runtime/core/linear/linear.h"
#include "runtime_models.h"
#include "runtime/core/motion/motion.h"

static const double row_forever = 1e9;

/* The first methods are explicit; the others need an emitted tangent. */
enum { EXPLICIT_COUNT = REFDYN_RODAS5P };

static double largest_difference(const double *a, const double *b, int count) {
    double largest = 0;
    for (int i = 0; i < count; i++)
        largest = fmax(largest, fabs(a[i] - b[i]));
    return largest;
}

/* An integrator of the model, started at time t from its start values and qd (NULL: at rest). */
static int rig_start(struct rig *rig, struct refdyn_model model, struct refdyn_options options, double t,
                     const double *qd) {
    rig_open(rig, model);
    if (qd)
        memcpy(rig->qd, qd, (size_t)model.n * sizeof *qd);
    const int status = rig_integrator(rig, &options);
    return status ? status : refdyn_integrator_start(&rig->integrator, t, rig->q, rig->qd);
}

static void test_names(void) {
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        CHECK(refdyn_method_find(refdyn_method_name(method)) == method);
    CHECK(refdyn_method_find("rk5") == -1 && refdyn_method_name(-1) == NULL);
    CHECK(refdyn_method_name(REFDYN_METHOD_COUNT) == NULL);
}

/* ---- Observed order ---- */

/* State at the end of a constrained, time-dependent motion with equal steps. */
static void end_state(enum refdyn_method method, enum refdyn_stabilise stabilise, long steps, double *state) {
    const double begin = 0.2, end = 0.7131, qd[] = {0.2317, -0.713, 0.617};
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(method);
    options.step = (end - begin) / (double)steps;
    options.tol = 0;
    options.stabilise = stabilise;
    options.project_start = 1;
    CHECK(rig_start(&rig, spring_model(2), options, begin, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, end) == REFDYN_OK);
    CHECK(rig.integrator.statistics.steps == steps && rig.integrator.statistics.rejected == 0);
    CHECK(rig.integrator.t == end);
    memcpy(state, rig.integrator.q, 6 * sizeof *state);
    CHECK(rig_close(&rig));
}

static void test_orders(void) {
    double exact[6], coarse[6], fine[6];
    end_state(REFDYN_RK8, REFDYN_PROJECT, 1500, exact);
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++)
        for (int stabilise = REFDYN_NONE; stabilise <= REFDYN_PROJECT; stabilise++) {
            const int order = refdyn_method_order((enum refdyn_method)method), steps = order > 5 ? 12 : 60;
            end_state((enum refdyn_method)method, (enum refdyn_stabilise)stabilise, steps, coarse);
            end_state((enum refdyn_method)method, (enum refdyn_stabilise)stabilise, 2 * steps, fine);
            const double rate =
                log2(largest_difference(coarse, exact, 6) / largest_difference(fine, exact, 6));
            /*
             * order 8 reaches rounding before its limit: at these steps the observed order still decreases
             * towards 8
             */
            CHECK_NEAR(rate, order > 5 ? 8.25 : order, 0.35);
        }
}

/* ---- Landing, counting, reproducing ---- */

static void test_landing(void) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    options.step = 0.0173;
    const double qd[] = {0.2317, -0.713, 0.617};
    CHECK(rig_start(&rig, spring_model(0), options, 0, qd) == REFDYN_OK);
    for (int i = 1; i <= 30; i++) {
        CHECK(refdyn_integrator_to(&rig.integrator, i * 0.1) == REFDYN_OK);
        CHECK(rig.integrator.t == i * 0.1);
        CHECK(rig.integrator.statistics.steps == 6 * i); /* 5.78 steps, rounded up */
    }
    CHECK_NEAR(rig.integrator.statistics.step_largest, 0.1 / 6, 1e-15);
    /* two at the start; the outputs are ends of steps */
    CHECK(rig.integrator.statistics.evaluations == 4 * rig.integrator.statistics.steps + 2);
    CHECK(refdyn_integrator_to(&rig.integrator, 3) == REFDYN_OK); /* already there */
    CHECK(refdyn_integrator_to(&rig.integrator, 2.9) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_to(&rig.integrator, NAN) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_to(&rig.integrator, INFINITY) == REFDYN_BAD_TIME);
    CHECK(rig_close(&rig));
    /* an interval that is a multiple of the step, up to rounding, takes exactly this many steps */
    options.step = 1e-5;
    CHECK(rig_start(&rig, film_model(), options, 0, NULL) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.05) == REFDYN_OK &&
          rig.integrator.statistics.steps == 5000);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.1) == REFDYN_OK &&
          rig.integrator.statistics.steps == 10000);
    CHECK(rig_close(&rig));
}

static void test_adaptive_landing(void) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    options.tol = 1e-8;
    CHECK(rig_start(&rig, spring_model(0), options, 0, NULL) == REFDYN_OK);
    for (int i = 1; i <= 100; i++) {
        CHECK(refdyn_integrator_to(&rig.integrator, i * 0.02) == REFDYN_OK);
        CHECK(rig.integrator.t == i * 0.02);
    }
    const long many_stops = rig.integrator.statistics.steps;
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, rig.qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 2) == REFDYN_OK);
    CHECK(rig.integrator.statistics.steps <= many_stops);
    /* without projection each step costs six evaluations, the first of the next step is its last one */
    const struct refdyn_statistics *statistics = &rig.integrator.statistics;
    CHECK(statistics->evaluations == 6 * (statistics->steps + statistics->rejected) + 3);
    CHECK(rig_close(&rig));
}

/*
 * Readings inside the last step equal the values of an output there, and leave the motion unchanged, up to
 * the directions along which it is projected.
 */
static void check_look(enum refdyn_method method) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(method);
    const double qd[] = {0.2317, -0.713, 0.617};
    double at_output[3], end[3];
    options.tol = options.tol > 0 ? 1e-7 : 0;
    CHECK(rig_start(&rig, spring_model(2), options, 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_look(&rig.integrator, 0) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.5) == REFDYN_OK);
    memcpy(at_output, rig.integrator.q, sizeof at_output);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_OK);
    memcpy(end, rig.integrator.q, sizeof end);
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, rig.qd) == REFDYN_OK);
    while (rig.integrator.t_end < 0.5)
        CHECK(refdyn_integrator_step(&rig.integrator, 0.5, 1) == REFDYN_OK);
    CHECK(refdyn_integrator_look(&rig.integrator, rig.integrator.t_begin) == REFDYN_OK &&
          rig.integrator.t == rig.integrator.t_begin);
    CHECK(refdyn_integrator_look(&rig.integrator, 0.5) == REFDYN_OK && rig.integrator.t == 0.5);
    CHECK(largest_difference(at_output, rig.integrator.q, 3) < 1e-9);
    memcpy(at_output, rig.integrator.q, sizeof at_output);
    CHECK(refdyn_integrator_look_at_state(&rig.integrator, rig.integrator.t_begin) == REFDYN_OK &&
          refdyn_integrator_look_at_state(&rig.integrator, 0.5) == REFDYN_OK &&
          memcmp(at_output, rig.integrator.q, sizeof at_output) == 0);
    CHECK(refdyn_integrator_look(&rig.integrator, rig.integrator.t_end + 1e-9) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_look(&rig.integrator, nextafter(rig.integrator.t_begin, 0)) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_look(&rig.integrator, NAN) == REFDYN_BAD_TIME && rig.integrator.t == 0.5);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_OK);
    CHECK(largest_difference(end, rig.integrator.q, 3) < 1e-9);
    CHECK(rig_close(&rig));
}

/* What the caller sees at the end of a step are the rates and row terms of the step, also after a look at an
 * earlier time, whose row terms the workspace has then. */
static void check_end(enum refdyn_method method) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(method);
    const double qd[] = {0.2317, -0.713, 0.617};
    double qdd[3], lambda[2], u[6], phi[2];
    options.tol = 0;
    options.step = 0.0173;
    CHECK(rig_start(&rig, spring_model(2), options, 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.5) == REFDYN_OK);
    CHECK(rig.integrator.t_end == 0.5 && rig.work.n == 3 && rig.work.m == 2);
    memcpy(qdd, rig.integrator.qdd, sizeof qdd);
    memcpy(lambda, rig.integrator.lambda, sizeof lambda);
    memcpy(u, rig.work.u, sizeof u);
    memcpy(phi, rig.work.phi, sizeof phi);
    CHECK(refdyn_integrator_look(&rig.integrator, rig.integrator.t_begin) == REFDYN_OK);
    CHECK(memcmp(u, rig.work.u, sizeof u) != 0 && largest_difference(qdd, rig.integrator.qdd, 3) > 1e-4);
    CHECK(refdyn_integrator_look(&rig.integrator, 0.5) == REFDYN_OK);
    CHECK(memcmp(u, rig.work.u, sizeof u) == 0 && memcmp(phi, rig.work.phi, sizeof phi) == 0);
    CHECK(memcmp(lambda, rig.integrator.lambda, sizeof lambda) == 0);
    CHECK(refdyn_accelerate(&rig.work, 0.5, rig.integrator.q, rig.integrator.qd, options.stabilise, qdd) ==
          REFDYN_OK);
    CHECK(memcmp(u, rig.work.u, sizeof u) == 0 && memcmp(phi, rig.work.phi, sizeof phi) == 0);
    CHECK(largest_difference(qdd, rig.integrator.qdd, 3) < 1e-12);
    CHECK(rig_close(&rig));
}

static void test_look(void) {
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        check_look((enum refdyn_method)method);
        check_end((enum refdyn_method)method);
    }
}

static void test_tolerance(void) {
    double exact[6], error_last = row_forever;
    const double qd[] = {0.2317, -0.713, 0.617};
    for (double tol = 1e-13; tol < 1e-4; tol = tol < 1e-12 ? 1e-10 : tol * 100) {
        struct rig rig;
        struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
        options.tol = tol;
        options.project_start = 1;
        CHECK(rig_start(&rig, spring_model(2), options, 0.2, qd) == REFDYN_OK);
        CHECK(rig.integrator.start_is_off && rig.integrator.start.phi > 1e-3);
        CHECK(refdyn_integrator_to(&rig.integrator, 1.2) == REFDYN_OK);
        if (tol < 1e-12)
            memcpy(exact, rig.integrator.q, sizeof exact);
        else {
            const double error = largest_difference(rig.integrator.q, exact, 3);
            CHECK(error < 30 * tol);
            CHECK(error_last == row_forever || error > error_last);
            error_last = error;
        }
        CHECK(rig.integrator.statistics.phi_max < 1e-14 && rig.integrator.statistics.psi_max < 1e-13);
        CHECK(rig_close(&rig));
    }
}

/* Two integrators in turns give to the bit the results of one alone, and so does a repetition. */
static void test_reproduces(void) {
    struct rig one, two;
    const double qd[] = {0.2317, -0.713, 0.617};
    double alone[7];
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    options.balance = options.project_start = 1;
    CHECK(rig_start(&one, spring_model(2), options, 0.2, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&one.integrator, 1) == REFDYN_OK);
    memcpy(alone, one.integrator.q, sizeof alone);
    CHECK(rig_start(&two, spring_model(2), options, 0.2, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_start(&one.integrator, 0.2, one.q, one.qd) == REFDYN_OK);
    while (one.integrator.t < 1 || two.integrator.t < 1) {
        CHECK(refdyn_integrator_step(&one.integrator, 1, 1) == REFDYN_OK);
        CHECK(refdyn_integrator_step(&two.integrator, 1, 1) == REFDYN_OK);
    }
    CHECK(memcmp(alone, one.integrator.q, sizeof alone) == 0);
    CHECK(memcmp(alone, two.integrator.q, sizeof alone) == 0);
    CHECK(rig_close(&one));
    CHECK(rig_close(&two));
}

static long allocated(void) {
#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)
    return (long)mallinfo2().uordblks;
#else
    return 0;
#endif
}

static void test_allocates_nothing(void) {
    struct rig rig;
    const double qd[] = {0.2317, -0.713, 0.617};
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    options.project_start = 1;
    options.balance = 1;
    rig_open(&rig, spring_model(2));
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    const long before = allocated();
    CHECK(refdyn_integrator_start(&rig.integrator, 0.2, rig.q, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.5) == REFDYN_OK);
    CHECK(allocated() == before);
    CHECK(rig_close(&rig));
}

/* ---- Energy ---- */

static double balance_error(enum refdyn_method method, enum refdyn_stabilise stabilise, int rows,
                            double step) {
    struct rig rig;
    struct refdyn_energy energy;
    const double qd[] = {0.2317, -0.713, 0.617};
    struct refdyn_options options = refdyn_options_default(method);
    options.balance = options.project_start = 1;
    options.stabilise = stabilise;
    options.tol = step > 0 ? 0 : 1e-11;
    options.step = step;
    CHECK(rig_start(&rig, spring_model(rows), options, 0.2, qd) == REFDYN_OK);
    CHECK(refdyn_energy_start(&energy, &rig.integrator) == REFDYN_OK);
    for (int i = 1; i <= 20; i++) {
        CHECK(refdyn_integrator_to(&rig.integrator, 0.2 + i * 0.05) == REFDYN_OK);
        CHECK(refdyn_energy_add(&energy, &rig.integrator) == REFDYN_OK);
    }
    CHECK(rig.integrator.work_done != 0 && energy.largest_change > 0.1);
    CHECK(rig_close(&rig));
    return refdyn_energy_error(&energy);
}

static void test_energy(void) {
    for (int rows = 0; rows <= 2; rows++)
        for (int stabilise = REFDYN_NONE; stabilise <= REFDYN_PROJECT; stabilise++) {
            CHECK_NEAR(balance_error(REFDYN_RK4, (enum refdyn_stabilise)stabilise, rows, 5e-4), 0, 1e-10);
            CHECK_NEAR(balance_error(REFDYN_RK54, (enum refdyn_stabilise)stabilise, rows, 0), 0, 1e-9);
        }
    struct rig rig;
    struct refdyn_energy energy;
    CHECK(rig_start(&rig, film_model(), refdyn_options_default(REFDYN_RK4), 0, NULL) == REFDYN_OK);
    CHECK(refdyn_energy_start(&energy, &rig.integrator) == REFDYN_FUNCTION_MISSING);
    CHECK_NEAR(refdyn_energy_error(&energy), 0, 0);
    CHECK(rig_close(&rig));
}

/* ---- Published and known motions ---- */

static void test_pendulum(void) {
    const double at_5[] = {-0.942305435044, -0.334754338414}, at_10[] = {-0.275087462576, -0.961419205099};
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    options.tol = 1e-12;
    CHECK(rig_start(&rig, rod_model(rod_dependent), options, 0, NULL) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 5) == REFDYN_OK);
    CHECK_NEAR(largest_difference(rig.integrator.q, at_5, 2), 0, 1e-9);
    CHECK(refdyn_integrator_to(&rig.integrator, 10) == REFDYN_OK);
    CHECK_NEAR(largest_difference(rig.integrator.q, at_10, 2), 0, 1e-9);
    double energy[2];
    CHECK(refdyn_energies(&rig.work, 10, rig.integrator.q, rig.integrator.qd, energy) == REFDYN_OK);
    CHECK_NEAR(energy[0] + energy[1], 0, 1e-9);
    CHECK(rig_close(&rig));
}

static void test_car_axis(void) {
    const double at_3[] = {0.0493455784275402809, 0.496989460230171154, 1.04174252488542152,
                           0.373911027265361257};
    const double qd[] = {-0.5, 0, -0.5, 0};
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    options.tol = 1e-12;
    CHECK(rig_start(&rig, axis_model(), options, 0, qd) == REFDYN_OK);
    CHECK(!rig.integrator.start_is_off);
    CHECK(refdyn_integrator_to(&rig.integrator, 3) == REFDYN_OK);
    CHECK_NEAR(largest_difference(rig.integrator.q, at_3, 4), 0, 1e-9);
    CHECK(rig_close(&rig));
}

/*
 * Once round the circle without gravity: the declared coordinate x is unusable where x = 0, so the choice
 * changes.
 */
static void test_changes_partition(void) {
    struct rig rig;
    const double rate = 0.917, qd[] = {0, -rate};
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
        options.tol = method == REFDYN_RK4 ? 0 : 1e-10;
        rig_open(&rig, rod_model(rod_dependent));
        rig.work.p[0] = 0;
        refdyn_prepare(&rig.work);
        CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
        CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_OK);
        CHECK(rig.work.partition.is_declared);
        CHECK(refdyn_integrator_to(&rig.integrator, 2 * acos(-1) / rate) == REFDYN_OK);
        CHECK_NEAR(rig.integrator.q[0], -1, 1e-8);
        CHECK_NEAR(rig.integrator.q[1], 0, 1e-8);
        const struct refdyn_statistics *statistics = &rig.integrator.statistics;
        CHECK(statistics->partition_changes >= 2 && statistics->partition_changes <= 8);
        CHECK(statistics->condition_max < 20 && statistics->pivot_min > 0.05);
        CHECK(rig_close(&rig));
    }
}

/*
 * Redundant rows during a motion: cranks stay parallel, energy is constant. (At 0.446 s they are flat, a
 * bifurcation.)
 */
static void test_redundant_motion(void) {
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        struct rig rig;
        struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
        options.tol = method == REFDYN_RK4 ? 0 : 1e-10;
        const double qd[] = {0.317, 0, 0.317, 0.317};
        CHECK(rig_start(&rig, cranks_model(), options, 0, qd) == REFDYN_OK);
        CHECK(!rig.integrator.start_is_off && rig.work.partition.rank == 3);
        const double energy = cranks_energy(rig.q, qd);
        CHECK(refdyn_integrator_to(&rig.integrator, 0.4) == REFDYN_OK);
        CHECK(rig.work.partition.rank == 3);
        CHECK_NEAR(rig.integrator.q[0] - rig.integrator.q[2], 0, 1e-9);
        CHECK_NEAR(rig.integrator.q[0] - rig.integrator.q[3], 0, 1e-9);
        CHECK_NEAR(rig.integrator.q[1], 0, 1e-9);
        CHECK_NEAR(cranks_energy(rig.integrator.q, rig.integrator.qd), energy, 1e-8 * fabs(energy));
        CHECK(rig_close(&rig));
    }
}

/*
 * Through the flat position, and through it again on the way back, with redundant rows on both sides and one
 * more where all cranks are level: the motion is that of one crank.
 */
static void test_passing(void) {
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        struct rig rig;
        struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
        options.tol = method == REFDYN_RK4 ? 0 : 1e-9;
        options.step_max = method == REFDYN_RK4 ? options.step : 0; /* has no effect on fixed steps */
        options.singular = REFDYN_PASS;
        const double qd[] = {0.317, 0, 0.317, 0.317};
        CHECK(rig_start(&rig, cranks_model(), options, 0, qd) == REFDYN_OK);
        const double energy = cranks_energy(rig.q, qd);
        const struct refdyn_statistics *statistics = &rig.integrator.statistics;
        for (int i = 1; i <= 30; i++) {
            CHECK(refdyn_integrator_to(&rig.integrator, 0.05 * i) == REFDYN_OK);
            CHECK(rig.work.partition.rank == 3);
            CHECK_NEAR(rig.integrator.q[0] - rig.integrator.q[2], 0, 1e-9);
            CHECK_NEAR(rig.integrator.q[0] - rig.integrator.q[3], 0, 1e-9);
            CHECK_NEAR(rig.integrator.q[1], 0, 1e-9);
            CHECK_NEAR(cranks_energy(rig.integrator.q, rig.integrator.qd), energy, 1e-7 * fabs(energy));
        }
        CHECK(statistics->crossings == 2);
        const struct refdyn_crossing crossings[2] = {statistics->crossing[0], statistics->crossing[1]};
        for (int i = 0; i < 2; i++) { /* output at this time */
            CHECK(crossings[i].t_begin < crossings[i].t && crossings[i].t < crossings[i].t_end);
            CHECK(crossings[i].error <= 1e-9);
            CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_OK);
            CHECK(refdyn_integrator_to(&rig.integrator, crossings[i].t) == REFDYN_OK);
            const double *now = rig.integrator.qd, *qdd = rig.integrator.qdd;
            double force[CRANKS_N];
            CHECK(rig.integrator.is_undetermined);
            refdyn_integrator_force(&rig.integrator, force);
            CHECK_NEAR(dense_dot(force, now, CRANKS_N), 0, 1e-4);
            CHECK_NEAR(cranks_energy(rig.integrator.q, now), energy, 1e-7 * fabs(energy));
            CHECK_NEAR(now[1], 0, 1e-7);
            CHECK_NEAR(now[2], now[0], 1e-7);
            CHECK_NEAR(qdd[1], 0, 1e-4);
            CHECK_NEAR(qdd[2], qdd[0], 1e-4);
            /* and the reading after it is computed again */
            CHECK(refdyn_integrator_to(&rig.integrator, crossings[i].t_end + 0.01) == REFDYN_OK);
            CHECK(!rig.integrator.is_undetermined);
        }
        CHECK(rig_close(&rig));
    }
}

/* ---- Another compilation of the model ---- */

static long other_calls;

static void other_M(const double *p, const double *x, double t, const double *q, const double *qd,
                    double *out) {
    other_calls++;
    spring_M(p, x, t, q, qd, out);
}

/* States at the outputs of a motion. With `is_exchanged` another table replaces the first one on the way,
 * which is then overwritten, so that a pointer to it would be noticed. */
static void exchange_on_the_way(enum refdyn_method method, bool is_exchanged, double *states) {
    const double qd[] = {0.2317, -0.713, 0.617};
    struct refdyn_model first = spring_model(2), second = first;
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(method);
    options.project_start = options.balance = 1;
    second.M = other_M;
    other_calls = 0;
    CHECK(rig_start(&rig, first, options, 0.2, qd) == REFDYN_OK);
    for (int i = 0; i < 5; i++) {
        CHECK(refdyn_integrator_to(&rig.integrator, 0.2371 + 0.0713 * i) == REFDYN_OK);
        memcpy(states + 7 * i, rig.integrator.q, 6 * sizeof *states);
        states[7 * i + 6] = rig.integrator.work_done;
        if (i != 2 || !is_exchanged)
            continue;
        CHECK(refdyn_integrator_exchange_model(&rig.integrator, &second) == REFDYN_OK);
        CHECK(rig.work.model == &second && rig.integrator.motion->linear.chain.model == &second);
        memset(&rig.model, 0xa5, sizeof rig.model);
    }
    CHECK((other_calls > 0) == is_exchanged);
    CHECK(rig_close(&rig));
}

static void test_exchange(void) {
    double states[35], others[35];
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        exchange_on_the_way((enum refdyn_method)method, false, states);
        exchange_on_the_way((enum refdyn_method)method, true, others);
        CHECK(memcmp(states, others, sizeof states) == 0);
    }
}

/* Tables of other models are refused, and the motion continues with the first one. */
static void test_exchange_refused(void) {
    struct refdyn_model first = spring_model(2), other;
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK8);
    struct rig rig;
    rig_open(&rig, first);
    const struct refdyn_model *model = rig.work.model;
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
#define REFUSED_WITH(status, field, value)                                          \
    (other = first, other.field = (value),                                          \
     CHECK(refdyn_integrator_exchange_model(&rig.integrator, &other) == (status) && \
           rig.work.model == model))
    REFUSED_WITH(REFDYN_BAD_MODEL, hash, "713");
    REFUSED_WITH(REFDYN_BAD_MODEL, hash, NULL);
    REFUSED_WITH(REFDYN_BAD_MODEL, name, "autumn");
    REFUSED_WITH(REFDYN_BAD_MODEL, m, 1);
    REFUSED_WITH(REFDYN_BAD_MODEL, derived_count, 2);
    REFUSED_WITH(REFDYN_BAD_MODEL, energy, NULL);
    REFUSED_WITH(REFDYN_BAD_MODEL, qdd_free, spring_h);
    REFUSED_WITH(REFDYN_BAD_MODEL, coordinates, NULL);
    REFUSED_WITH(REFDYN_OTHER_VERSION, interface_version, REFDYN_MODEL_VERSION + 1);
#undef REFUSED_WITH
    CHECK(refdyn_exchange_model(&rig.work, NULL) == REFDYN_BAD_MODEL);
    other = first;
    CHECK(refdyn_exchange_model(&rig.work, &other) == REFDYN_OK && rig.work.model == &other);
    CHECK(rig_close(&rig));
    struct refdyn_workspace work;
    CHECK(refdyn_workspace_init(&work, &first, NULL, 0) == REFDYN_BAD_MEMORY);
    CHECK(refdyn_exchange_model(&work, &other) == REFDYN_BAD_MEMORY && work.model == &first);
}

/* ---- Calls before the start ---- */

/* All calls that need a motion return NOT_STARTED and write nothing. */
static void expect_not_started(struct refdyn_integrator *integrator, const struct refdyn_model *model) {
    const struct refdyn_integrator before = *integrator;
    const double untouched[] = {0.713, -1.37, 0.317};
    double force[SPRING_N], contact[SPRING_N];
    struct refdyn_energy energy;
    memcpy(force, untouched, sizeof untouched);
    memcpy(contact, untouched, sizeof untouched);
    CHECK(refdyn_integrator_to(integrator, 0.713) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_to(integrator, -0.713) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_step(integrator, 0.713, 3) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_look(integrator, 0) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_refresh(integrator) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_until(integrator, 0.713) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_limit(integrator, 0.713) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_force(integrator, force) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_contact_forces(integrator, contact) == REFDYN_NOT_STARTED);
    CHECK(refdyn_energy_start(&energy, integrator) == REFDYN_NOT_STARTED);
    CHECK(refdyn_energy_add(&energy, integrator) == REFDYN_NOT_STARTED);
    CHECK(refdyn_energy_scale(&energy, integrator) == REFDYN_NOT_STARTED && energy.unit == 0);
    CHECK(memcmp(force, untouched, sizeof untouched) == 0 &&
          memcmp(contact, untouched, sizeof untouched) == 0);
    CHECK(memcmp(integrator, &before, sizeof before) == 0);
    if (integrator->motion)
        return;
    const double state[SPRING_N] = {0.2317, -0.713, 0.617};
    CHECK(refdyn_integrator_start(integrator, 0, state, state) == REFDYN_NOT_STARTED);
    CHECK(refdyn_integrator_exchange_model(integrator, model) == REFDYN_NOT_STARTED);
    CHECK(memcmp(integrator, &before, sizeof before) == 0);
}

static void test_not_started(void) {
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK8);
    struct refdyn_integrator integrator;
    struct rig rig;
    memset(&integrator, 0, sizeof integrator);
    rig_open(&rig, spring_model(2));
    expect_not_started(&integrator, &rig.model); /* never initialised */
    CHECK(refdyn_integrator_init(&integrator, &rig.work, &options, NULL, 0) == REFDYN_BAD_MEMORY);
    expect_not_started(&integrator, &rig.model); /* initialisation failed */
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    expect_not_started(&rig.integrator, &rig.model); /* initialised, not started */
    CHECK(rig_close(&rig));

    const double qd[] = {0.713};
    rig_open(&rig, film_model());
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_OK);
    rig.work.x[0] = -1;
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_NOT_FINITE);
    expect_not_started(&rig.integrator, &rig.model); /* start failed, after one that succeeded */
    rig.work.x[0] = 2;
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.713) == REFDYN_OK);
    CHECK(rig_close(&rig));
}

/* ---- Values and times that are not finite ---- */

/* Each value of a start and of a refresh, with its coordinate. */
static void test_given_states(void) {
    const double bad[] = {NAN, INFINITY, -INFINITY};
    const double good[2 * SPRING_N] = {0.1317, 0.8713, 0.3171, 0.2317, -0.713, 0.617};
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    struct rig rig;
    rig_open(&rig, spring_model(0));
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    for (int i = 0; i < 2 * SPRING_N; i++)
        for (int k = 0; k < 3; k++) {
            double state[2 * SPRING_N];
            memcpy(state, good, sizeof state);
            state[i] = bad[k];
            CHECK(refdyn_integrator_start(&rig.integrator, 0, state, state + SPRING_N) == REFDYN_NOT_FINITE);
            CHECK(rig.work.fault.coordinate == i % SPRING_N && rig.work.fault.row == -1);
            CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_NOT_STARTED);
            CHECK(refdyn_integrator_start(&rig.integrator, 0, good, good + SPRING_N) == REFDYN_OK);
            rig.integrator.q[i] = bad[k]; /* q and qd are contiguous */
            CHECK(refdyn_integrator_refresh(&rig.integrator) == REFDYN_NOT_FINITE);
            CHECK(rig.work.fault.coordinate == i % SPRING_N && rig.work.fault.row == -1);
        }
    CHECK(rig_close(&rig));
}

static void test_times(void) {
    const double bad[] = {NAN, INFINITY, -INFINITY}, qd[] = {0.713};
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    struct rig rig;
    rig_open(&rig, film_model());
    rig.work.x[0] = 2;
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    for (int k = 0; k < 3; k++) {
        CHECK(refdyn_integrator_start(&rig.integrator, bad[k], rig.q, qd) == REFDYN_BAD_TIME);
        CHECK(refdyn_integrator_until(&rig.integrator, 1) == REFDYN_NOT_STARTED);
    }
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_until(&rig.integrator, NAN) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_limit(&rig.integrator, NAN) == REFDYN_BAD_TIME);
    CHECK(refdyn_integrator_limit(&rig.integrator, INFINITY) == REFDYN_OK);
    /* no step leads across the end; a call with a later time continues beyond it */
    CHECK(refdyn_integrator_until(&rig.integrator, 0.0513) == REFDYN_OK);
    int has_met = 0;
    while (rig.integrator.t < 0.0613) {
        CHECK(refdyn_integrator_step(&rig.integrator, 0.0613, 1) == REFDYN_OK);
        CHECK(rig.integrator.t_begin >= 0.0513 || rig.integrator.t_end <= 0.0513);
        has_met |= rig.integrator.t_end == 0.0513;
    }
    CHECK(has_met);
    CHECK(rig_close(&rig));
}

/* ---- Changed values ---- */

/* The state after a motion whose input, or first parameter, changes on the way. */
static void change_on_the_way(struct refdyn_model model, int changes_input, int has_refresh, double *state) {
    const struct refdyn_options options = refdyn_options_default(REFDYN_RK54);
    const double qd[SPRING_N] = {0.713, -0.317, 0.137};
    struct rig rig;
    CHECK(rig_start(&rig, model, options, 0.01, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.0713) == REFDYN_OK);
    *(changes_input ? rig.work.x : rig.work.p) *= 1.317;
    refdyn_prepare(&rig.work);
    if (has_refresh)
        CHECK(refdyn_integrator_refresh(&rig.integrator) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.1713) == REFDYN_OK);
    const long steps = rig.integrator.statistics.evaluations;
    CHECK(refdyn_integrator_to(&rig.integrator, 0.1713) == REFDYN_OK);
    CHECK(rig.integrator.statistics.evaluations == steps); /* noticed once */
    memcpy(state, rig.integrator.q, 2 * (size_t)model.n * sizeof *state);
    CHECK(rig_close(&rig));
}

/* After changed inputs and parameters, a step has the same bits as after a refresh. */
static void test_changed_values(void) {
    double refreshed[2 * SPRING_N] = {0}, noticed[2 * SPRING_N] = {0};
    change_on_the_way(film_model(), 1, 1, refreshed);
    change_on_the_way(film_model(), 1, 0, noticed);
    CHECK(memcmp(refreshed, noticed, sizeof noticed) == 0);
    change_on_the_way(rod_model(NULL), 0, 1, refreshed);
    change_on_the_way(rod_model(NULL), 0, 0, noticed);
    CHECK(memcmp(refreshed, noticed, sizeof noticed) == 0);

    struct rig rig;
    const double qd[] = {0.713};
    CHECK(rig_start(&rig, film_model(), refdyn_options_default(REFDYN_RK54), 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.0713) == REFDYN_OK);
    rig.work.x[0] = -1;
    CHECK(refdyn_integrator_to(&rig.integrator, 0.1) == REFDYN_NOT_FINITE && rig.integrator.t == 0.0713);
    CHECK(rig_close(&rig));
}

/* ---- Failures ---- */

static void test_undefined_mid_run(void) {
    struct rig rig;
    const double qd[] = {0.713};
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    CHECK(rig_start(&rig, film_model(), options, 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_NOT_FINITE);
    CHECK(rig.integrator.cause == REFDYN_NOT_FINITE && rig.work.fault.coordinate == 0);
    CHECK(rig.integrator.t <= 0.5173 && rig.integrator.t > 0.5173 - 2e-3 && rig.integrator.failed_t > 0.5173);
    CHECK(isfinite(rig.integrator.q[0]) && isfinite(rig.integrator.qd[0]));
    /* the input is corrected, and the motion continues from the last accepted state */
    rig.work.x[0] = 2;
    CHECK(refdyn_integrator_refresh(&rig.integrator) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_OK);
    CHECK(rig_close(&rig));

    options = refdyn_options_default(REFDYN_RK54);
    CHECK(rig_start(&rig, film_model(), options, 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_STEP_TOO_SMALL);
    CHECK(rig.integrator.cause == REFDYN_NOT_FINITE);
    CHECK_NEAR(rig.integrator.t, 0.5173, 1e-12);
    CHECK(rig_close(&rig));

    rig_open(&rig, film_model());
    rig.work.x[0] = -1;
    CHECK(rig_integrator(&rig, &options) == REFDYN_OK);
    CHECK(refdyn_integrator_start(&rig.integrator, 0, rig.q, qd) == REFDYN_NOT_FINITE);
    CHECK(rig.integrator.cause == REFDYN_NOT_FINITE && rig.integrator.failed_t == 0);
    CHECK(rig_close(&rig));
}

/* A step far beyond the stability limit ends with a status, never with a state that is not finite. */
static void test_unstable(void) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    const double qd[] = {3.17, -7.13, 6.17};
    options.step = 0.7;
    CHECK(rig_start(&rig, spring_model(0), options, 0, qd) == REFDYN_OK);
    const int status = refdyn_integrator_to(&rig.integrator, 1e3);
    CHECK(status > 0);
    for (int i = 0; i < 6; i++)
        CHECK(isfinite(rig.integrator.q[i]));
    CHECK(rig_close(&rig));
}

static void test_limits(void) {
    struct rig rig;
    struct refdyn_options options = refdyn_options_default(REFDYN_RK4);
    options.step_limit = 100;
    CHECK(rig_start(&rig, spring_model(0), options, 0, NULL) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_TOO_MANY_STEPS);
    CHECK(rig.integrator.statistics.steps == 100);
    CHECK_NEAR(rig.integrator.t, 0.1, 1e-15);
    CHECK(rig_close(&rig));
    options.step = 1e-20;
    CHECK(rig_start(&rig, spring_model(0), options, 0, NULL) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 1) == REFDYN_STEP_TOO_SMALL);
    CHECK(rig_close(&rig));
    /* no step is longer than step_max, including the first */
    options = refdyn_options_default(REFDYN_RK8);
    options.step = 0.5;
    options.step_max = 0.01;
    CHECK(rig_start(&rig, spring_model(0), options, 0, NULL) == REFDYN_OK);
    CHECK(refdyn_integrator_step(&rig.integrator, 1, 1) == REFDYN_OK);
    CHECK(rig.integrator.statistics.step_largest == 0.01);
    CHECK(rig_close(&rig));
}

/* No step, fixed or adaptive, reaches beyond the limit. */
static void test_limit(void) {
    for (int method = REFDYN_RK4; method < EXPLICIT_COUNT; method++) {
        struct rig rig;
        struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
        int ends = 0;
        options.step = 0.07;
        CHECK(rig_start(&rig, spring_model(0), options, 0, NULL) == REFDYN_OK);
        refdyn_integrator_limit(&rig.integrator, 0.25);
        while (rig.integrator.t_end < 0.5) {
            CHECK(refdyn_integrator_step(&rig.integrator, 0.5, 1) == REFDYN_OK);
            ends += rig.integrator.t_end == 0.25;
        }
        CHECK(ends == 1);
        CHECK(rig_close(&rig));
    }
}

static void check_refused(struct refdyn_options options) {
    const char *fact = NULL;
    CHECK(refdyn_options_validate(&options, &fact) == REFDYN_BAD_OPTION && fact);
    CHECK(refdyn_options_validate(&options, NULL) == REFDYN_BAD_OPTION);
}

/* The automatic choice measures the time advanced, also where the motion continues inside its last step. */
static void test_choice_after_refresh(void) {
    struct rig rig;
    const double qd[] = {0.713};
    CHECK(rig_start(&rig, film_model(), refdyn_options_default(REFDYN_AUTO), 0, qd) == REFDYN_OK);
    CHECK(refdyn_integrator_to(&rig.integrator, 0.0713) == REFDYN_OK);
    const double back = rig.integrator.t_end - rig.integrator.t, way = rig.integrator.motion->automatic.way;
    CHECK(back > 0);
    CHECK(refdyn_integrator_refresh(&rig.integrator) == REFDYN_OK);
    CHECK(rig.integrator.t_end == rig.integrator.t);
    CHECK_NEAR(rig.integrator.motion->automatic.way, way, 0);
    CHECK(rig_close(&rig));
}

struct counted {
    long accepted, refused;
    double length;
};

static void count_tried(void *context, const struct refdyn_tried *tried) {
    struct counted *counted = context;
    const int is_accepted = tried->verdict == REFDYN_TRIED_ACCEPTED;
    *(is_accepted ? &counted->accepted : &counted->refused) += 1;
    counted->length += is_accepted ? tried->h : 0;
    CHECK(refdyn_method_name((int)tried->method) && refdyn_step_kind_name((int)tried->kind));
    CHECK(refdyn_verdict_name((int)tried->verdict) && refdyn_obstacle_name((int)tried->obstacle));
    CHECK(tried->error <= 1 || !is_accepted);
    CHECK(tried->rank == 2 && tried->event == -1);
}

/* Each attempt is reported while somebody watches, and the motion stays the same. */
static void test_watch(void) {
    const double begin = 0.2, middle = 0.7131, end = 1.317, qd[] = {0.2317, -0.713, 0.617};
    for (int method = REFDYN_RK54; method < EXPLICIT_COUNT; method++) {
        struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
        struct counted counted = {0, 0, 0};
        struct rig rig, other;
        options.project_start = 1;
        CHECK(rig_start(&rig, spring_model(2), options, begin, qd) == REFDYN_OK);
        CHECK(rig_start(&other, spring_model(2), options, begin, qd) == REFDYN_OK);
        refdyn_integrator_until(&rig.integrator, middle);
        refdyn_integrator_until(&other.integrator, middle);
        CHECK(refdyn_integrator_watch(&rig.integrator, count_tried, &counted) == REFDYN_OK);
        CHECK(refdyn_integrator_to(&rig.integrator, middle) == REFDYN_OK);
        CHECK(refdyn_integrator_to(&other.integrator, middle) == REFDYN_OK);
        CHECK(counted.accepted == rig.integrator.statistics.steps);
        CHECK(counted.refused == rig.integrator.statistics.rejected);
        CHECK_NEAR(counted.length, middle - begin, 1e-14);
        CHECK(refdyn_integrator_watch(&rig.integrator, NULL, NULL) == REFDYN_OK);
        CHECK(refdyn_integrator_to(&rig.integrator, end) == REFDYN_OK);
        CHECK(refdyn_integrator_to(&other.integrator, end) == REFDYN_OK);
        CHECK(counted.accepted < rig.integrator.statistics.steps);
        CHECK(memcmp(rig.integrator.q, other.integrator.q, 6 * sizeof(double)) == 0);
        CHECK(rig_close(&rig) && rig_close(&other));
    }
    struct refdyn_integrator none = {.t = 0};
    CHECK(refdyn_integrator_watch(&none, count_tried, NULL) == REFDYN_NOT_STARTED);
    CHECK(!refdyn_verdict_name(-1) && !refdyn_verdict_name(REFDYN_VERDICT_COUNT));
    CHECK(!refdyn_step_kind_name(-1) && !refdyn_step_kind_name(REFDYN_STEP_KIND_COUNT));
    CHECK(!refdyn_obstacle_name(-1) && !refdyn_obstacle_name(REFDYN_OBSTACLE_COUNT));
}

static void test_options(void) {
    const struct refdyn_options fixed = refdyn_options_default(REFDYN_RK4);
    const struct refdyn_options adaptive = refdyn_options_default(REFDYN_RK54);
    CHECK(refdyn_options_validate(&fixed, NULL) == REFDYN_OK &&
          refdyn_options_validate(&adaptive, NULL) == REFDYN_OK);
    struct refdyn_options options;
#define REFUSED(start, field, value) (options = (start), options.field = (value), check_refused(options))
    REFUSED(fixed, method, REFDYN_METHOD_COUNT);
    REFUSED(fixed, step, 0);
    REFUSED(fixed, step, -1e-3);
    REFUSED(fixed, step, NAN);
    REFUSED(adaptive, step, INFINITY);
    REFUSED(adaptive, step_max, -0.1);
    REFUSED(fixed, tol_rates, 1e-4);
    REFUSED(adaptive, tol_rates, -1e-4);
    REFUSED(adaptive, tol_rates, 1);
    REFUSED(adaptive, tol_rates, NAN);
    REFUSED(adaptive, tol, 0); /* and no step is taken */
    REFUSED(fixed, tol, 1e-6);
    REFUSED(adaptive, gain_share, -1);
    REFUSED(adaptive, tol, 1e-17);
    REFUSED(adaptive, tol, NAN);
    REFUSED(adaptive, length, -1);
    REFUSED(fixed, stabilise, (enum refdyn_stabilise)3);
    REFUSED(fixed, singular, (enum refdyn_singular)2);
    REFUSED(fixed, step_limit, -1);
    REFUSED(fixed, event_looks, -1);
#undef REFUSED
    struct rig rig;
    rig_open(&rig, film_model());
    options = fixed;
    options.method = REFDYN_METHOD_COUNT;
    CHECK(refdyn_integrator_size(rig.work.model, &options) == 0);
    options = fixed;
    options.step = 0;
    CHECK(rig_integrator(&rig, &options) == REFDYN_BAD_OPTION);
    CHECK(rig_integrator(&rig, &fixed) == REFDYN_OK);
    CHECK(refdyn_integrator_init(&rig.integrator, &rig.work, &fixed, inside(rig.integrator_memory), 8) ==
          REFDYN_MEMORY_TOO_SMALL);
    CHECK(rig_close(&rig));
}

int main(void) {
    test_names();
    test_orders();
    test_landing();
    test_adaptive_landing();
    test_look();
    test_tolerance();
    test_reproduces();
    test_allocates_nothing();
    test_energy();
    test_pendulum();
    test_car_axis();
    test_changes_partition();
    test_redundant_motion();
    test_passing();
    test_exchange();
    test_exchange_refused();
    test_given_states();
    test_times();
    test_changed_values();
    test_not_started();
    test_undefined_mid_run();
    test_unstable();
    test_limits();
    test_limit();
    test_choice_after_refresh();
    test_watch();
    test_options();
    return check_summary();
}
