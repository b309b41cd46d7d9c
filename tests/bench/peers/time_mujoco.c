/*
 * Times MuJoCo: time_mujoco values|times N_RFE, with the model models/N.xml.
 */
#include "timing.h"

#include <mujoco/mujoco.h>

struct subject {
    const struct bench *bench;
    mjModel *model;
    mjData *data;
};

static void set_state(const struct subject *s) {
    const size_t bytes = (size_t)s->bench->n * sizeof(double);
    memcpy(s->data->qpos, s->bench->q, bytes);
    memcpy(s->data->qvel, s->bench->qd, bytes);
    memcpy(s->data->qfrc_applied, s->bench->tau, bytes);
}

static void call_forward(void *subject, long times) {
    const struct subject *s = (const struct subject *)subject;
    for (long i = 0; i < times; i++) {
        set_state(s);
        mj_forward(s->model, s->data);
    }
}

static void mass_and_bias(const struct subject *s) {
    set_state(s);
    mj_kinematics(s->model, s->data);
    mj_comPos(s->model, s->data);
    mj_crb(s->model, s->data);
    mj_comVel(s->model, s->data);
    mj_rne(s->model, s->data, 0, s->data->qfrc_bias);
}

/* Only what accelerations without contacts and constraints need. */
static void call_needed(void *subject, long times) {
    const struct subject *s = (const struct subject *)subject;
    mjData *d = s->data;
    for (long i = 0; i < times; i++) {
        mass_and_bias(s);
        mj_factorM(s->model, d);
        mj_passive(s->model, d);
        for (int k = 0; k < s->bench->n; k++)
            d->qfrc_smooth[k] = d->qfrc_passive[k] - d->qfrc_bias[k] + d->qfrc_applied[k];
        mj_solveM(s->model, d, d->qacc, d->qfrc_smooth, 1);
    }
}

static void call_mass_and_bias(void *subject, long times) {
    for (long i = 0; i < times; i++)
        mass_and_bias((const struct subject *)subject);
}

int main(int argc, char **argv) {
    char path[PATH_SIZE], message[PATH_SIZE];
    const struct bench b = open_bench("mujoco", argc, argv);
    snprintf(path, sizeof path, "models/%d.xml", b.n_rfe);
    mjModel *model = mj_loadXML(path, NULL, message, PATH_SIZE);
    if (!model)
        stop(message, path);
    const size_t n = (size_t)b.n;
    struct subject s = {&b, model, mj_makeData(model)};
    measure(&b, "accelerations", "forward", call_forward, &s,
            (struct bench_result[]){{s.data->qacc, n}, {0}});
    measure(&b, "accelerations", "needed", call_needed, &s, (struct bench_result[]){{s.data->qacc, n}, {0}});

    mju_zero3(model->opt.gravity);
    double *mass = new_array(n * n);
    call_mass_and_bias(&s, 1);
    mj_fullM(model, s.data, mass);
    measure(&b, "mass", "crb+rne", call_mass_and_bias, &s,
            (struct bench_result[]){{mass, n * n}, {s.data->qfrc_bias, n}, {0}});
    return 0;
}
