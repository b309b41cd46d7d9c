/* Equilibria of the runtime core: known solutions, load stepping, problems without a solution. */
#include <float.h>
#include <string.h>

#include "check.h"
#include "runtime_models.h"

/*
 * Chain of five equal rods of length 1 m on rotational springs; angles relative to the previous rod. A dead
 * load P across the tip and a moment at the tip: Q_i = -s q_i + moment - P dy/dq_i, y the height of the tip.
 * Parameters: s, moment, P.
 */
enum { CHAIN_N = 5 };

static void chain_angles(const double *q, double *angle) {
    double sum = 0;
    for (int i = 0; i < CHAIN_N; i++)
        angle[i] = sum += q[i];
}

static void chain_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                    double *out) {
    (void)x, (void)t, (void)qd;
    double angle[CHAIN_N], column = 0;
    chain_angles(q, angle);
    for (int i = CHAIN_N - 1; i >= 0; i--) {
        column += cos(angle[i]);
        out[i] = -p[0] * q[i] + p[1] - p[2] * column;
    }
}

static void chain_Q_q(const double *p, const double *x, double t, const double *q, const double *qd,
                      double *out) {
    (void)x, (void)t, (void)qd;
    double angle[CHAIN_N], beyond[CHAIN_N], sum = 0;
    chain_angles(q, angle);
    for (int i = CHAIN_N - 1; i >= 0; i--)
        beyond[i] = sum += sin(angle[i]);
    for (int i = 0; i < CHAIN_N; i++)
        for (int j = 0; j < CHAIN_N; j++)
            out[CHAIN_N * i + j] = p[2] * beyond[i > j ? i : j] - (i == j ? p[0] : 0);
}

static const struct refdyn_name chain_coordinates[CHAIN_N] = {
    {"one", "rad", 0}, {"two", "rad", 0}, {"three", "rad", 0}, {"four", "rad", 0}, {"five", "rad", 0}};
static const struct refdyn_name chain_parameters[] = {
    {"s", "N m", 3.17}, {"moment", "N m", 0}, {"P", "N", 0}};

static void unit_mass(const double *p, const double *x, double t, const double *q, const double *qd,
                      double *out) {
    (void)p, (void)x, (void)t, (void)q, (void)qd;
    for (int i = 0; i < CHAIN_N * CHAIN_N; i++)
        out[i] = i % (CHAIN_N + 1) == 0;
}

static struct refdyn_model chain_model(void) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "chain",
        .hash = "",
        .n = CHAIN_N,
        .coordinates = chain_coordinates,
        .parameters = chain_parameters,
        .parameter_count = 3,
        .M = unit_mass,
        .h = unit_mass,
        .Q = chain_Q,
        .Q_q = chain_Q_q,
    };
}

struct outcome {
    int status;
    int guards_hold;
    struct refdyn_statics_result result;
};

static struct outcome solve(struct rig *rig, const struct refdyn_statics_options *options, const int *held,
                            int count, double *hold_force) {
    struct memory_piece memory = guarded(refdyn_statics_size(&rig->model));
    struct outcome outcome;
    outcome.status = refdyn_statics(&rig->work, options, held, count, rig->q, hold_force, &outcome.result,
                                    inside(memory), memory.size);
    outcome.guards_hold = guards_hold(memory);
    free(memory.bytes);
    return outcome;
}

static void test_moment(void) {
    struct rig rig;
    rig_open(&rig, chain_model());
    const struct refdyn_statics_options options = refdyn_statics_default();
    rig.work.p[1] = 2 * acos(-1) * rig.work.p[0] / CHAIN_N; /* forms a closed pentagon */
    const struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status == REFDYN_OK && outcome.guards_hold && outcome.result.load == 1);
    for (int i = 0; i < CHAIN_N; i++)
        CHECK_NEAR(rig.q[i], 2 * acos(-1) / CHAIN_N, 1e-14);
    CHECK(rig_close(&rig));
}

/* Large deflection: forces vanish for any load and any load steps, and all paths end at the same position. */
static void test_tip_load(void) {
    for (double load = 0.1; load < 1e4; load *= 7.3) {
        double q[CHAIN_N], Q[CHAIN_N];
        for (int ways = 0; ways < 2; ways++) {
            struct rig rig;
            rig_open(&rig, chain_model());
            struct refdyn_statics_options options = refdyn_statics_default();
            rig.work.p[2] = load;
            if (ways == 1)
                options.load_step = 0.03;
            const struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
            CHECK(outcome.status == REFDYN_OK && outcome.guards_hold);
            chain_Q(rig.work.p, NULL, 0, rig.q, rig.qd, Q);
            for (int i = 0; i < CHAIN_N; i++) {
                CHECK_NEAR(Q[i], 0, 1e-13 * (1 + load));
                if (ways == 1)
                    CHECK_NEAR(rig.q[i], q[i], 1e-11);
                q[i] = rig.q[i];
            }
            CHECK(rig_close(&rig));
        }
    }
}

static void test_held(void) {
    struct rig rig;
    rig_open(&rig, chain_model());
    const struct refdyn_statics_options options = refdyn_statics_default();
    rig.work.p[2] = 1.713;
    rig.q[1] = 0.317;
    rig.q[3] = -0.217;
    const int held[] = {3, 1};
    double hold[CHAIN_N], Q[CHAIN_N];
    const struct outcome outcome = solve(&rig, &options, held, 2, hold);
    CHECK(outcome.status == REFDYN_OK);
    CHECK_NEAR(rig.q[1], 0.317, 0);
    CHECK_NEAR(rig.q[3], -0.217, 0);
    chain_Q(rig.work.p, NULL, 0, rig.q, rig.qd, Q);
    for (int i = 0; i < CHAIN_N; i++) {
        const int is_held = i == 1 || i == 3;
        CHECK_NEAR(hold[i], is_held ? -Q[i] : 0, 0);
        CHECK_NEAR(is_held ? 0 : Q[i], 0, 1e-14);
    }
    CHECK_NEAR(outcome.result.residual, fmax(fmax(fabs(Q[0]), fabs(Q[2])), fabs(Q[4])), 0);
    const int all[] = {0, 1, 2, 3, 4};
    CHECK(solve(&rig, &options, all, CHAIN_N, hold).status == REFDYN_OK);
    CHECK(rig_close(&rig));
}

/* From a bad start the full load does not converge: the load step is halved, and the solution is the same. */
static void test_spring_pendulum(void) {
    const double starts[] = {0.5313, 1.4, 2.1, -1.9};
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
        struct rig rig;
        rig_open(&rig, spring_model(0));
        const struct refdyn_statics_options options = refdyn_statics_default();
        rig.q[2] = starts[i];
        const struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
        CHECK(outcome.status == REFDYN_OK && outcome.result.residual < 1e-12);
        CHECK_NEAR(sin(rig.q[2]), 0, 1e-12); /* hangs down, or stands upright */
        CHECK_NEAR(rig.q[1], rod_length + cos(rig.q[2]) * tip_mass * gravity / rod_spring, 1e-12);
        CHECK(rig_close(&rig));
    }
}

/* A spring with snap-through: Q = load - (q - 3 q^2 + 2.1 q^3), whose first branch ends at 0.0972. */
static void snap_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                   double *out) {
    (void)x, (void)t, (void)qd;
    for (int i = 0; i < CHAIN_N; i++)
        out[i] = p[2] - q[i] * (1 + q[i] * (-3 + 2.1 * q[i]));
}

static void snap_Q_q(const double *p, const double *x, double t, const double *q, const double *qd,
                     double *out) {
    (void)p, (void)x, (void)t, (void)qd;
    memset(out, 0, CHAIN_N * CHAIN_N * sizeof *out);
    for (int i = 0; i < CHAIN_N; i++)
        out[i * (CHAIN_N + 1)] = -1 + q[i] * (6 - 6.3 * q[i]);
}

static void test_snaps_through(void) {
    struct refdyn_model model = chain_model();
    model.Q = snap_Q;
    model.Q_q = snap_Q_q;
    const struct refdyn_statics_options options = refdyn_statics_default();
    const double loads[] = {0.0713, 0.117};
    struct rig rig;
    rig_open(&rig, model);
    rig.work.p[2] = loads[0];
    struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status == REFDYN_OK && outcome.result.is_followed && outcome.guards_hold);
    CHECK(outcome.result.residual < 1e-15 && rig.q[0] < 0.3);
    /* reported as the fraction of the load for which an equilibrium exists: the limit point */
    memset(rig.q, 0, sizeof rig.q);
    rig.work.p[2] = loads[1];
    outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status == REFDYN_NO_CONVERGENCE || outcome.status == REFDYN_TANGENT_SINGULAR);
    const double q = (6 - sqrt(10.8)) / 12.6; /* 1 - 6 q + 6.3 q^2 = 0 */
    CHECK_NEAR(outcome.result.load, q * (1 + q * (-3 + 2.1 * q)) / loads[1], 1e-6);
    CHECK(rig_close(&rig));
}

static void only_second_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                          double *out) {
    (void)x, (void)t, (void)qd;
    for (int i = 0; i < CHAIN_N; i++)
        out[i] = i == 1 ? 0.713 - 3.1 * q[1] : 0;
    out[3] = p[1];
}

static void only_second_Q_q(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t, (void)q, (void)qd;
    memset(out, 0, CHAIN_N * CHAIN_N * sizeof *out);
    out[CHAIN_N + 1] = -3.1;
}

static void test_free_coordinates(void) {
    struct rig rig;
    struct refdyn_model model = chain_model();
    model.Q = only_second_Q;
    model.Q_q = only_second_Q_q;
    rig_open(&rig, model);
    const struct refdyn_statics_options options = refdyn_statics_default();
    rig.q[2] = 0.917; /* no force acts on it */
    CHECK(solve(&rig, &options, NULL, 0, NULL).status == REFDYN_OK);
    CHECK_NEAR(rig.q[2], 0.917, 0);
    CHECK_NEAR(rig.q[1], 0.23, 1e-15);
    rig.work.p[1] = 0.37; /* a load without any support */
    const struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status == REFDYN_TANGENT_SINGULAR && rig.work.fault.coordinate == 3);
    CHECK(outcome.guards_hold);
    CHECK(rig_close(&rig));
}

static void undefined_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                        double *out) {
    chain_Q(p, x, t, q, qd, out);
    out[2] += log(0.3 - q[2]) - log(0.3);
}

static void test_failures(void) {
    struct rig rig;
    struct refdyn_statics_options options = refdyn_statics_default();
    struct refdyn_model model = chain_model();
    rig_open(&rig, model);
    rig.work.p[2] = 50;
    options.iterations = 1;
    struct outcome outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status == REFDYN_NO_CONVERGENCE && outcome.result.load < 1);
    CHECK(rig.work.fault.coordinate >= 0);
    options = refdyn_statics_default();
    char memory[8];
    CHECK(refdyn_statics(&rig.work, &options, NULL, 0, rig.q, NULL, &outcome.result, memory, 8) ==
          REFDYN_MEMORY_TOO_SMALL);
    options.tol = -1;
    CHECK(solve(&rig, &options, NULL, 0, NULL).status == REFDYN_BAD_OPTION);
    CHECK(rig_close(&rig));

    options = refdyn_statics_default();
    model.Q = undefined_Q; /* log of a negative number on the way */
    rig_open(&rig, model);
    rig.work.p[1] = 40;
    outcome = solve(&rig, &options, NULL, 0, NULL);
    CHECK(outcome.status != REFDYN_OK && outcome.guards_hold);
    for (int i = 0; i < CHAIN_N; i++)
        CHECK(isfinite(rig.q[i]));
    rig.q[2] = 0.4;
    CHECK(solve(&rig, &options, NULL, 0, NULL).status == REFDYN_NOT_FINITE && rig.work.fault.coordinate == 2);
    CHECK(rig_close(&rig));

    model.Q_q = NULL;
    rig_open(&rig, model);
    CHECK(solve(&rig, &options, NULL, 0, NULL).status == REFDYN_FUNCTION_MISSING);
    CHECK(rig_close(&rig));
}

/*
 * A bead of weight w on a spring s along x, on a circle of radius R; the same row again, doubled, with its
 * own radius; and a row of rates. Q = (-s x + turn y, -w), turn: a force without a potential. Parameters: w,
 * s, R, R of the second row, turn.
 */
enum { BEAD_N = 2, BEAD_M = 3 };

static void bead_equations(const double *p, const double *x, double t, const double *q, const double *qd,
                           double *out) {
    double *M = out, *f = M + 4, *u = f + 2, *v = u + 6, *phi = v + 3;
    (void)x, (void)t, (void)qd;
    memset(out, 0, (4 + 2 + 6 + 4 * 3) * sizeof *out);
    M[0] = M[3] = 1;
    f[0] = -p[1] * q[0] + p[4] * q[1];
    f[1] = -p[0];
    for (int j = 0; j < 2; j++) {
        u[j] = 2 * q[j];
        u[2 + j] = 4 * q[j];
        u[4 + j] = 1;
    }
    phi[0] = q[0] * q[0] + q[1] * q[1] - p[2] * p[2];
    phi[1] = 2 * (q[0] * q[0] + q[1] * q[1] - p[3] * p[3]);
}

static void bead_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                   double *out) {
    double equations[24];
    bead_equations(p, x, t, q, qd, equations);
    memcpy(out, equations + 4, 2 * sizeof *out);
}

/* f_t g_t G_q G_qd u K D M, of which statics reads K; the others may be infinite. */
static void bead_tangent(const double *p, const double *x, double t, const double *q, const double *rates,
                         double *out) {
    const double *lambda = rates + 2 * BEAD_N + 1;
    double *K = out + 2 + 3 + 3 * 6;
    (void)x, (void)t, (void)q;
    for (int i = 0; i < 2 + 3 + 3 * 6 + 3 * 4; i++)
        out[i] = NAN;
    K[0] = p[1] - 2 * lambda[0] - 4 * lambda[1];
    K[1] = -p[4];
    K[2] = 0;
    K[3] = -2 * lambda[0] - 4 * lambda[1];
}

static struct refdyn_model bead_model(void) {
    static const struct refdyn_name coordinates[] = {{"x", "m", 0}, {"y", "m", 0}};
    static const struct refdyn_name parameters[] = {
        {"w", "N", 3.17}, {"s", "N/m", 0}, {"R", "m", 1.3}, {"R2", "m", 1.3}, {"turn", "N/m", 0}};
    static const struct refdyn_row rows[] = {
        {"circle", REFDYN_POSITION, 0, ""}, {"again", REFDYN_POSITION, 0, ""}, {"rate", REFDYN_VELOCITY, 0, ""}};
    return (struct refdyn_model){.interface_version = REFDYN_MODEL_VERSION,
                                 .name = "bead",
                                 .hash = "",
                                 .n = BEAD_N,
                                 .m = BEAD_M,
                                 .coordinates = coordinates,
                                 .parameters = parameters,
                                 .parameter_count = 5,
                                 .rows = rows,
                                 .equations = bead_equations,
                                 .Q = bead_Q,
                                 .tangent = bead_tangent};
}

static const int bead_rows[] = {0, 1};

static struct outcome solve_bead(struct rig *rig, double x, double y, int row_count,
                                 enum refdyn_statics_way way, double *lambda) {
    struct refdyn_statics_options options = refdyn_statics_default();
    struct memory_piece memory = guarded(refdyn_statics_size(&rig->model));
    struct outcome outcome;
    options.rows = bead_rows;
    options.row_count = row_count;
    options.way = way;
    rig->q[0] = x;
    rig->q[1] = y;
    outcome.status = refdyn_statics(&rig->work, &options, NULL, 0, rig->q, NULL, &outcome.result,
                                    inside(memory), memory.size);
    outcome.guards_hold = guards_hold(memory);
    if (outcome.result.lambda)
        memcpy(lambda, outcome.result.lambda, (size_t)row_count * sizeof *lambda);
    free(memory.bytes);
    return outcome;
}

/* Below or on top of its circle, from starts off it; with the same row twice one of the multipliers is 0. */
static void test_rows(void) {
    struct rig rig;
    rig_open(&rig, bead_model());
    const double R = rig.work.p[2], w = rig.work.p[0];
    for (int count = 1; count <= 2; count++)
        for (int side = -1; side <= 1; side += 2) {
            double lambda[2] = {0};
            const struct outcome outcome =
                solve_bead(&rig, 0.317, side * 1.1, count, REFDYN_ALONG_LOAD, lambda);
            CHECK(outcome.status == REFDYN_OK && outcome.guards_hold && outcome.result.load == 1);
            CHECK_NEAR(rig.q[0], 0, 1e-14);
            CHECK_NEAR(rig.q[1], side * R, 1e-14);
            CHECK_NEAR(lambda[0] + 2 * lambda[1], w / (2 * side * R), 1e-14);
            CHECK(count == 1 || lambda[0] == 0 || lambda[1] == 0);
            CHECK(outcome.result.residual < 1e-14 && outcome.result.phi < 1e-14);
            CHECK(outcome.result.unstable == (side > 0) && outcome.result.neutral == 0);
            CHECK(outcome.result.has_potential && outcome.result.unstable_coordinate == (side > 0 ? 0 : -1));
        }
    CHECK(rig_close(&rig));
}

/* A spring moves the bead to a side where w = s y. */
static void test_downhill(void) {
    struct rig rig;
    rig_open(&rig, bead_model());
    double lambda[2];
    for (int side = -1; side <= 1; side += 2) { /* the spring pushes */
        rig.work.p[1] = -4.7;
        struct outcome outcome = solve_bead(&rig, side * 1e-3, 1.3, 2, REFDYN_DOWNHILL, lambda);
        CHECK(outcome.status == REFDYN_OK && outcome.guards_hold && outcome.result.unstable == 0);
        CHECK_NEAR(rig.q[1], -rig.work.p[0] / 4.7, 1e-13);
        CHECK_NEAR(rig.q[0], side * sqrt(1.3 * 1.3 - rig.q[1] * rig.q[1]), 1e-13);
        rig.work.p[1] = 0;
        outcome = solve_bead(&rig, 0, 1.3, 1, REFDYN_DOWNHILL, lambda); /* from the topmost point */
        CHECK(outcome.status == REFDYN_OK && outcome.result.unstable == 0);
        CHECK_NEAR(rig.q[1], -1.3, 1e-14);
    }
    CHECK(rig_close(&rig));
}

static void test_stability(void) {
    struct rig rig;
    double lambda[2];
    rig_open(&rig, bead_model());
    rig.work.p[0] = 0; /* without weight: nothing keeps it in place along the circle */
    struct outcome outcome = solve_bead(&rig, 0.5, 1.2, 2, REFDYN_ALONG_LOAD, lambda);
    CHECK(outcome.status == REFDYN_OK && outcome.result.neutral == 1 && outcome.result.unstable == 0);
    CHECK_NEAR(rig.q[0], 0.5, 1e-14);
    CHECK_NEAR(rig.q[1], 1.2, 1e-14);
    CHECK(rig_close(&rig));
}

static void test_rows_that_fail(void) {
    struct rig rig;
    double lambda[2] = {0};
    rig_open(&rig, bead_model());
    rig.work.p[3] = 1.31; /* two circles */
    struct outcome outcome = solve_bead(&rig, 0.3, -1.2, 2, REFDYN_ALONG_LOAD, lambda);
    CHECK(outcome.status == REFDYN_ROWS_INCONSISTENT && rig.work.fault.row >= 0 && outcome.guards_hold);
    CHECK(!outcome.result.force && !outcome.result.lambda);
    CHECK(solve_bead(&rig, 0, 0, 1, REFDYN_ALONG_LOAD, lambda).status == REFDYN_ROWS_INCONSISTENT);
    CHECK(rig.work.fault.row == 0); /* at the centre the row has no direction */
    rig.work.p[2] = NAN;
    CHECK(solve_bead(&rig, 0.3, -1.2, 1, REFDYN_ALONG_LOAD, lambda).status == REFDYN_NOT_FINITE);
    struct refdyn_statics_options options = refdyn_statics_default();
    const int none[] = {3}, rate[] = {2}, twice[] = {1, 1};
    const int *const wrong[] = {none, rate, twice};
    for (int i = 0; i < 3; i++) {
        options.rows = wrong[i];
        options.row_count = 1 + (i == 2);
        CHECK(solve(&rig, &options, NULL, 0, NULL).status == REFDYN_BAD_OPTION);
    }
    CHECK(rig_close(&rig));
    struct refdyn_model model = bead_model();
    model.tangent = NULL;
    rig_open(&rig, model);
    CHECK(solve_bead(&rig, 0.3, -1.2, 1, REFDYN_ALONG_LOAD, lambda).status == REFDYN_FUNCTION_MISSING);
    CHECK(rig_close(&rig));
}

/* Beyond both limit points of the spring with snap-through. */
static void test_path(void) {
    struct refdyn_model model = chain_model();
    const int held[] = {0, 1, 3, 4};
    model.Q = snap_Q;
    model.Q_q = snap_Q_q;
    struct refdyn_statics_options options = refdyn_statics_default();
    options.way = REFDYN_ALONG_PATH;
    struct rig rig;
    rig_open(&rig, model);
    rig.work.p[2] = 0.117;
    struct outcome outcome = solve(&rig, &options, held, 4, NULL);
    CHECK(outcome.status == REFDYN_OK && outcome.result.limit_points == 2 && outcome.guards_hold);
    CHECK(outcome.result.is_followed && outcome.result.unstable == 0 && rig.q[2] > 1);
    CHECK_NEAR(rig.q[2] * (1 + rig.q[2] * (-3 + 2.1 * rig.q[2])), 0.117, 1e-14);
    memset(rig.q, 0, sizeof rig.q);
    rig.work.p[2] = 0.0713; /* reached by load steps: no limit point */
    outcome = solve(&rig, &options, held, 4, NULL);
    CHECK(outcome.status == REFDYN_OK && outcome.result.limit_points == 0 && rig.q[2] < 0.3);
    CHECK(rig_close(&rig));
}

static void test_options(void) {
    struct refdyn_statics_options options = refdyn_statics_default();
    const char *fact = "";
    CHECK(refdyn_statics_validate(&options, &fact) == REFDYN_OK && !fact);
#define REFUSED(field, value)                                     \
    (options = refdyn_statics_default(), options.field = (value), \
     CHECK(refdyn_statics_validate(&options, &fact) == REFDYN_BAD_OPTION && fact))
    REFUSED(tol, 0);
    REFUSED(tol, NAN);
    REFUSED(length, -1);
    REFUSED(reach, 0);
    REFUSED(iterations, 0);
    REFUSED(load_step, 0);
    REFUSED(load_step, 1.5);
    REFUSED(load_least, 0);
    REFUSED(load_least, 2);
    REFUSED(t, INFINITY);
    REFUSED(row_count, -1);
    REFUSED(row_count, 1);
    REFUSED(way, (enum refdyn_statics_way)3);
#undef REFUSED
}

int main(void) {
    test_moment();
    test_tip_load();
    test_held();
    test_spring_pendulum();
    test_snaps_through();
    test_free_coordinates();
    test_failures();
    test_rows();
    test_downhill();
    test_stability();
    test_rows_that_fail();
    test_path();
    test_options();
    return check_summary();
}
