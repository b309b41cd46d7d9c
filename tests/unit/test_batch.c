/*
 * Batches: each case equals the single motion to the bit, regardless of threads, order, neighbours and
 * failures.
 */
#include <string.h>

#include "refdyn_batch.h"
#include "check.h"

/* ---- A pendulum with a parameter and an input ---- */

enum { CASES = 57, OUTPUTS = 3, FAILED = 23 };

static void mass(const double *p, const double *x, double t, const double *q, const double *qd, double *out) {
    (void)x, (void)t, (void)q, (void)qd;
    out[0] = p[0] * p[0];
}

static void bias(const double *p, const double *x, double t, const double *q, const double *qd, double *out) {
    (void)p, (void)x, (void)t, (void)q, (void)qd;
    out[0] = 0;
}

/* A length that is NaN affects only its own case. */
static void force(const double *p, const double *x, double t, const double *q, const double *qd,
                  double *out) {
    (void)t;
    out[0] = x[0] - 9.81 * p[0] * sin(q[0]) - 0.03 * qd[0];
}

static void force_tangent(const double *p, const double *x, double t, const double *q, const double *qd,
                          double *out) {
    (void)x, (void)t, (void)qd;
    out[0] = -9.81 * p[0] * cos(q[0]);
}

static void accelerations(const double *p, const double *x, double t, const double *q, const double *qd,
                          double *out) {
    double Q;
    force(p, x, t, q, qd, &Q);
    out[0] = Q / (p[0] * p[0]);
}

static const struct refdyn_name coordinates[] = {{"angle", "rad", 0.4713}};
static const struct refdyn_name parameters[] = {{"length", "m", 0.8317}};
static const struct refdyn_name inputs[] = {{"torque", "N m", 0.1113}};
static const int parents[] = {-1};

static const struct refdyn_model pendulum = {.interface_version = REFDYN_MODEL_VERSION,
                                             .name = "pendulum",
                                             .hash = "",
                                             .n = 1,
                                             .parameter_count = 1,
                                             .input_count = 1,
                                             .coordinates = coordinates,
                                             .parameters = parameters,
                                             .inputs = inputs,
                                             .parent = parents,
                                             .M = mass,
                                             .h = bias,
                                             .Q = force,
                                             .Q_q = force_tangent,
                                             .qdd_free = accelerations};

/* Its functions for lanes: each lane calls the function for one motion, so its bits are the same. */
static int width;

static void in_lanes(const double *p, const double *x, const double *t, const double *q, const double *qd,
                     double *out) {
    for (int lane = 0; lane < width; lane++)
        accelerations(p + lane, x + lane, t[lane], q + lane, qd + lane, out + lane);
}

/* ---- A batch of it ---- */

static const int torque_place[] = {0};
static const double calm_rows[] = {0.2, 0.0713}, gust_rows[] = {0.1, 0.3131, 0.37, -0.5313, 0.71, 0.1717};
static const struct refdyn_samples samples[] = {{1, 1, torque_place, calm_rows},
                                                {3, 1, torque_place, gust_rows}};
static const double times[OUTPUTS] = {0.3131, 0.5717, 1.1313};

struct table {
    double length[CASES], angle[CASES], rate[CASES], file[CASES];
    struct refdyn_batch_column columns[4];
};

static void fill(struct table *table) {
    const struct refdyn_batch_column columns[] = {{REFDYN_VARIED_PARAMETER, 0, table->length},
                                                  {REFDYN_VARIED_COORDINATE, 0, table->angle},
                                                  {REFDYN_VARIED_RATE, 0, table->rate},
                                                  {REFDYN_VARIED_SAMPLES, 0, table->file}};
    for (int i = 0; i < CASES; i++) {
        table->length[i] = 0.61 + 0.0137 * i;
        table->angle[i] = 0.3 + 0.731 * sin(3.7 * i);
        table->rate[i] = 1.31 * cos(2.3 * i);
        table->file[i] = i % 2;
    }
    table->length[FAILED] = NAN;
    memcpy(table->columns, columns, sizeof columns);
}

static struct refdyn_batch batch_of(const struct table *table) {
    struct refdyn_batch batch = {.model = &pendulum,
                                 .options = refdyn_options_default(REFDYN_RK8),
                                 .t = 0.0513,
                                 .times = times,
                                 .time_count = OUTPUTS,
                                 .samples = samples,
                                 .sample_count = 2,
                                 .count = CASES,
                                 .columns = table->columns,
                                 .column_count = 4,
                                 .threads = 1};
    batch.options.tol = 1e-9;
    return batch;
}

struct seen {
    double states[CASES][OUTPUTS + 1][2];
    int outputs[CASES], ends[CASES];
    enum refdyn_batch_stage stage;
    long stop_at;
};

static int see(void *context, const struct refdyn_batch_case *one, int number) {
    struct seen *seen = context;
    memcpy(seen->states[one->number][number], one->integrator->q, 2 * sizeof(double));
    seen->outputs[one->number]++;
    return 0;
}

static int note_end(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct seen *seen = context;
    seen->ends[one->number]++;
    if (result->status)
        seen->stage = result->stage;
    return 0;
}

/* ---- The single motion of a case ---- */

static int alone(const struct table *table, int number, double *states) {
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    const struct refdyn_batch batch = batch_of(table);
    static double memory[2][4000];
    double q[1], qd[1];
    CHECK(!refdyn_workspace_init(&work, &pendulum, memory[0], sizeof memory[0]));
    CHECK(!refdyn_integrator_init(&integrator, &work, &batch.options, memory[1], sizeof memory[1]));
    work.p[0] = table->length[number];
    q[0] = table->angle[number];
    qd[0] = table->rate[number];
    const struct refdyn_samples *file = &samples[(int)table->file[number]];
    double next = refdyn_samples_set(file, batch.t, work.x);
    int status = refdyn_integrator_start(&integrator, batch.t, q, qd);
    refdyn_integrator_until(&integrator, times[OUTPUTS - 1]);
    refdyn_integrator_limit(&integrator, next);
    for (int i = 0; i < OUTPUTS && !status; i++) {
        while (!status && integrator.t < times[i]) {
            status = refdyn_integrator_to(&integrator, fmin(times[i], next));
            if (status || integrator.t != next)
                continue;
            next = refdyn_samples_set(file, integrator.t, work.x);
            refdyn_integrator_limit(&integrator, next);
            status = refdyn_integrator_refresh(&integrator);
        }
        memcpy(states + 2 * i, integrator.q, 2 * sizeof(double));
    }
    return status;
}

static void test_each_case_is_as_alone(void) {
    static struct table table;
    static struct seen seen;
    double states[2 * OUTPUTS], end[CASES][2];
    int statuses[CASES];
    long ended;
    fill(&table);
    for (int threads = 1; threads <= 5; threads += 2) {
        struct refdyn_batch batch = batch_of(&table);
        memset(&seen, 0, sizeof seen);
        batch.threads = threads;
        batch.context = &seen;
        batch.output = see;
        batch.end = note_end;
        batch.states = &end[0][0];
        batch.statuses = statuses;
        CHECK(refdyn_batch_run(&batch, &ended) == REFDYN_OK && ended == CASES);
        for (int i = 0; i < CASES; i++) {
            CHECK(seen.ends[i] == 1);
            if (i == FAILED)
                continue;
            CHECK(alone(&table, i, states) == REFDYN_OK && statuses[i] == REFDYN_OK);
            CHECK(seen.outputs[i] == OUTPUTS + 1);
            CHECK(memcmp(seen.states[i][1], states, sizeof states) == 0);
            CHECK(memcmp(end[i], states + 2 * (OUTPUTS - 1), sizeof end[i]) == 0);
        }
        CHECK(statuses[FAILED] == REFDYN_NOT_FINITE && seen.outputs[FAILED] == 0);
        CHECK(seen.stage == REFDYN_AT_START);
    }
}

/* In lanes of any width, also if there are more lanes than cases. */
static void test_lanes(void) {
    static struct table table;
    double all[CASES][2], lanes[CASES][2];
    fill(&table);
    for (int method = REFDYN_RK54; method <= REFDYN_RK8; method++)
        for (width = 2; width <= 8; width *= 2) {
            const struct refdyn_lane_model model = {.interface_version = REFDYN_LANES_VERSION,
                                                    .width = width,
                                                    .model = &pendulum,
                                                    .qdd_free = in_lanes};
            struct refdyn_batch batch = batch_of(&table);
            long ended;
            batch.options = refdyn_options_default((enum refdyn_method)method);
            batch.states = &all[0][0];
            CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_OK);
            batch.lanes = &model;
            batch.states = &lanes[0][0];
            batch.threads = 2;
            CHECK(refdyn_batch_run(&batch, &ended) == REFDYN_OK && ended == CASES);
            for (int i = 0; i < CASES; i++)
                CHECK(i == FAILED || memcmp(all[i], lanes[i], sizeof all[i]) == 0);
            batch.count = 1;
            CHECK(refdyn_batch_run(&batch, &ended) == REFDYN_OK && ended == 1);
            CHECK(memcmp(all[0], lanes[0], sizeof all[0]) == 0);
        }
}

static void test_order_and_selection(void) {
    static struct table table;
    double all[CASES][2], some[20][2];
    long numbers[20];
    fill(&table);
    struct refdyn_batch batch = batch_of(&table);
    batch.states = &all[0][0];
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_OK);
    for (int i = 0; i < 20; i++)
        numbers[i] = CASES - 1 - 2 * i;
    batch.count = 20;
    batch.numbers = numbers;
    batch.states = &some[0][0];
    batch.threads = 2;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_OK);
    for (int i = 0; i < 20; i++)
        CHECK(numbers[i] == FAILED || memcmp(some[i], all[numbers[i]], sizeof some[i]) == 0);
}

/* The equilibrium of each case: sin(angle) = torque / (g length), and no rate. */
static void test_statics(void) {
    static struct table table;
    double end[CASES][2];
    fill(&table);
    table.length[FAILED] = 0.7;
    struct refdyn_batch batch = batch_of(&table);
    batch.column_count = 1;
    batch.from_statics = 1;
    batch.states = &end[0][0];
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_OK);
    for (int i = 0; i < CASES; i++) {
        CHECK_NEAR(end[i][0], asin(inputs[0].value / 9.81 / table.length[i]), 1e-12);
        CHECK_NEAR(end[i][1], 0, 1e-12);
    }
}

static int leave(void *context, const struct refdyn_batch_case *one,
                 const struct refdyn_batch_result *result) {
    (void)result;
    return one->number == ((struct seen *)context)->stop_at;
}

static void test_leaving(void) {
    static struct table table;
    static struct seen seen = {.stop_at = 11};
    long ended;
    fill(&table);
    struct refdyn_batch batch = batch_of(&table);
    batch.context = &seen;
    batch.end = leave;
    CHECK(refdyn_batch_run(&batch, &ended) == REFDYN_OK && ended == 11);
}

static void test_refusals(void) {
    static struct table table;
    const double backward[] = {0.5, 0.4};
    fill(&table);
    const struct refdyn_batch good = batch_of(&table);
    struct refdyn_batch batch = good;
    batch.threads = 0;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    batch = good;
    batch.times = backward;
    batch.time_count = 2;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    batch = good;
    batch.t = times[0];
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    batch = good;
    batch.sample_count = 1;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    batch = good;
    table.columns[0].place = 1;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    table.columns[0].place = 0;
    batch.options.tol = -1;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_BAD_OPTION);
    const struct refdyn_lane_model of_none = {
        .interface_version = REFDYN_LANES_VERSION, .width = 4, .model = &pendulum};
    const struct refdyn_lane_model of_other = {
        .interface_version = REFDYN_LANES_VERSION + 1, .width = 4, .model = &pendulum};
    batch = good;
    batch.lanes = &of_none;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_FUNCTION_MISSING);
    batch.lanes = &of_other;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_OTHER_VERSION);
    batch = good;
    batch.options.method = REFDYN_RODAS5P;
    CHECK(refdyn_batch_run(&batch, NULL) == REFDYN_FUNCTION_MISSING);
}

static void test_samples(void) {
    double x[1] = {0};
    CHECK(refdyn_samples_set(&samples[1], -1, x) == 0.37 && x[0] == 0.3131);
    CHECK(refdyn_samples_set(&samples[1], 0.36, x) == 0.37 && x[0] == 0.3131);
    CHECK(refdyn_samples_set(&samples[1], 0.37, x) == 0.71 && x[0] == -0.5313);
    CHECK(isinf(refdyn_samples_set(&samples[1], 5, x)) && x[0] == 0.1717);
    CHECK(isinf(refdyn_samples_set(&samples[0], 0, x)) && x[0] == 0.0713);
}

int main(void) {
    test_each_case_is_as_alone();
    test_lanes();
    test_order_and_selection();
    test_statics();
    test_leaving();
    test_refusals();
    test_samples();
    return check_summary();
}
