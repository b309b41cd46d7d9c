"""Every method on emitted models: two simultaneous motions, in two threads, equal single motions; none allocates memory."""
import subprocess

import pytest

from program import CORE_LIBRARY, REFERENCE, SOURCE, TESTS, refdyn, settings

ARM = TESTS / "models" / "suite" / "arm.lua"
CASES = {"arm_led": (ARM, dict(n_rfe=2, row="swing", E="2e9", omega=4)), "arm_pushed": (ARM, dict(n_rfe=2, E="2e9", push=2)),
         "damped": (REFERENCE, dict(n_rfe=2, eta=1.3e-3, alpha=20, beta=20)), "manipulator": (REFERENCE, dict(n_rfe=1, alpha=20, beta=20))}
CASES |= {f"{name} in O(n)": CASES[name] for name in ("arm_led", "damped")}
ROUNDS = 3

# For each method and each stabilisation, prints whether all motions in threads equal single ones, the allocations, and the steps.
PROGRAM = """
#include "MODEL.h"
#include "refdyn.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OUTPUTS = 20, MOST = 20, ROUNDS = ROUNDS_COUNT };

/* The linker leads every call of these, the runtime's and the model's, to here. */
static _Thread_local long allocations;
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);

void *__wrap_malloc(size_t size) {
    allocations++;
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size) {
    allocations++;
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *old, size_t size) {
    allocations++;
    return __real_realloc(old, size);
}

struct motion {
    struct refdyn_options options;
    double faster;                            /* than the model starts [1] */
    double values[OUTPUTS * (3 * MOST + 2)];  /* what it gives */
    struct refdyn_statistics statistics;
    long allocations;
    int status;
    pthread_barrier_t *together;              /* NULL: alone */
};

static int follow(struct motion *motion, struct refdyn_integrator *integrator, const double *q, const double *qd) {
    const size_t bytes = (size_t)integrator->work->n * sizeof(double);
    int status = refdyn_integrator_start(integrator, 0, q, qd);
    for (int i = 0; i < OUTPUTS && !status; i++) {
        double *values = motion->values + i * (3 * MOST + 2);
        status = refdyn_integrator_to(integrator, 0.02 * (i + 1));
        if (!status)
            status = refdyn_integrator_look(integrator, integrator->t_begin + 0.3 * (integrator->t_end - integrator->t_begin));
        memcpy(values, integrator->q, bytes);
        memcpy(values + MOST, integrator->qd, bytes);
        memcpy(values + 2 * MOST, integrator->qdd, bytes);
        values[3 * MOST] = integrator->t;
        values[3 * MOST + 1] = integrator->work_done;
    }
    return status;
}

static void *run(void *argument) {
    struct motion *motion = argument;
    const struct refdyn_model *model = &MODEL_model;
    const size_t work_size = refdyn_workspace_size(model), size = refdyn_integrator_size(model, &motion->options);
    void *work_memory = malloc(work_size), *memory = malloc(size);
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    double q[MOST], qd[MOST];
    if (refdyn_workspace_init(&work, model, work_memory, work_size) ||
        refdyn_integrator_init(&integrator, &work, &motion->options, memory, size))
        abort();
    if (motion->together)
        pthread_barrier_wait(motion->together);
    const long before = allocations;
    refdyn_initial_state(&work, q, qd);
    for (int i = 0; i < work.n; i++)
        qd[i] = motion->faster * qd[i] + (motion->faster - 1) / 10;
    refdyn_anchor(&work, 0, q, qd, NULL);
    motion->status = follow(motion, &integrator, q, qd);
    motion->allocations = allocations - before;
    motion->statistics = integrator.statistics;
    free(memory);
    free(work_memory);
    return NULL;
}

static int is_equal(const struct motion *a, const struct motion *b) {
    return a->status == b->status && !memcmp(a->values, b->values, sizeof a->values) &&
           a->statistics.steps == b->statistics.steps && a->statistics.evaluations == b->statistics.evaluations &&
           !memcmp(a->statistics.steps_by, b->statistics.steps_by, sizeof a->statistics.steps_by);
}

static int methods_used(const struct motion *motion) {
    int count = 0;
    for (int i = 0; i < REFDYN_METHOD_COUNT; i++)
        count += motion->statistics.steps_by[i] > 0;
    return count;
}

/* Two motions that differ, each ROUNDS times beside the other. */
static void judge(struct refdyn_options options) {
    static struct motion alone[2], beside[2];
    int equal = 1;
    pthread_barrier_t together;
    pthread_barrier_init(&together, NULL, 2);
    for (int i = 0; i < 2; i++) {
        alone[i] = (struct motion){.options = options, .faster = 1 + 0.25 * i};
        alone[i].options.tol *= i ? 0.1 : 1;
        alone[i].options.step *= i ? 0.5 : 1;
        run(&alone[i]);
    }
    for (int round = 0; round < ROUNDS; round++) {
        pthread_t threads[2];
        for (int i = 0; i < 2; i++) {
            beside[i] = (struct motion){.options = alone[i].options, .faster = alone[i].faster, .together = &together};
            if (pthread_create(&threads[i], NULL, run, &beside[i]))
                abort();
        }
        for (int i = 0; i < 2; i++) {
            pthread_join(threads[i], NULL);
            equal = equal && is_equal(&beside[i], &alone[i]);
        }
    }
    pthread_barrier_destroy(&together);
    printf("%s %d status %d %d equal %d allocations %ld steps %ld %ld methods %d apart %d\\n", refdyn_method_name((int)options.method),
           (int)options.stabilise, alone[0].status, alone[1].status, equal, alone[0].allocations + beside[1].allocations,
           alone[0].statistics.steps, alone[1].statistics.steps, methods_used(&alone[0]), !is_equal(&alone[0], &alone[1]));
}

int main(void) {
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        for (int stabilise = REFDYN_NONE; stabilise <= REFDYN_PROJECT; stabilise++) {
            struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
            options.stabilise = (enum refdyn_stabilise)stabilise;
            options.balance = options.project_start = 1;
            options.step = method == REFDYN_RK4 ? 2e-5 : 0;
            judge(options);
        }
    return 0;
}
"""
METHODS = ["auto", "rk4", "rk54", "rk8", "rodas5p", "rodas6p", "radau9", "gauss12", "ros34pw2"]


@pytest.mark.parametrize("case", CASES)
def test_motions_in_two_threads(case, tmp_path):
    model, options = CASES[case]
    refdyn("gen", model, *settings(options), "--emit",
           f"all,{'tangent_vectors' if case.endswith('O(n)') else 'tangent'}", "-o", tmp_path)
    name = next(tmp_path.glob("*.h")).stem
    (tmp_path / "program.c").write_text(PROGRAM.replace("MODEL", name).replace("ROUNDS_COUNT", str(ROUNDS)))
    subprocess.run(["gcc", "-std=gnu11", "-O1", "-Wall", "-Wextra", "-pthread", "-I", SOURCE, "-I", SOURCE / "runtime", *tmp_path.glob("*.c"), CORE_LIBRARY,
                    "-Wl,--wrap=malloc,--wrap=calloc,--wrap=realloc", "-lm", "-o", tmp_path / "program"], check=True)
    text = subprocess.run([tmp_path / "program"], check=True, capture_output=True, text=True, timeout=300).stdout
    print(text)
    lines = text.splitlines()
    assert [line.split()[0] for line in lines[::3]] == METHODS
    for line in lines:
        assert "status 0 0 equal 1 allocations 0 " in line, line
        assert line.endswith("apart 1"), line
    if case.startswith("damped"):   # the automatic choice runs trials there
        assert all(" methods 2 " in line for line in lines[:3]), lines[:3]
