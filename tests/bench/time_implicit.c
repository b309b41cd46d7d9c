/*
 * Times what an implicit step is made of, with matrices and in O(n): MODEL_model with both forms of the
 * tangent.
 *
 * Prints n, then for each form the microseconds of the tangent, a factorisation and a solution with the
 * products of its right side, the least of some batches that take turns, as CPU time.
 */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "runtime/core/implicit/implicit.h"

extern const struct refdyn_model MODEL;

enum { FORMS = 2, PARTS = 3, BATCHES = 12 };

static const double batch_seconds = 0.002;
static const double g = 0.003; /* [s] */

/* One form at a state without symmetry. */
struct form {
    struct refdyn_model model;
    struct refdyn_workspace *work;
    struct refdyn_linear linear;
    double *q, *slope, *sides;
};

static void *room_for(size_t bytes) {
    void *room = calloc(bytes + 8, 1);
    if (!room)
        exit(1);
    return room;
}

static void set_state(struct form *form) {
    const double golden = 0.6180339887498949;
    const int n = form->model.n;
    double part = 0.2385;
    for (int i = 0; i < 2 * n; i++) {
        part += golden;
        part -= (double)(long)part;
        if (i < n)
            form->q[i] = form->model.coordinates[i].value + 0.2 * (part - 0.5);
        else
            form->slope[i - n] = part - 0.5;
        form->sides[i] = part;
    }
    if (refdyn_equations(form->work, 0.3, form->q, form->slope) ||
        refdyn_solve(form->work, REFDYN_NONE, form->slope + n))
        exit(1);
    refdyn_multipliers(form->work, form->slope + n, form->slope + 2 * n + 1);
}

static void open_form(struct form *form, int is_chain) {
    struct layout layout = {NULL, 0};
    const int n = MODEL.n;
    form->model = MODEL;
    if (is_chain)
        form->model.tangent = NULL;
    form->work = room_for(sizeof *form->work);
    const size_t size = refdyn_workspace_size(&form->model);
    if (refdyn_workspace_init(form->work, &form->model, room_for(size), size))
        exit(1);
    refdyn_prepare(form->work);
    refdyn_linear_lay_out(&form->linear, &form->model, 1, 0, &layout);
    layout = (struct layout){room_for(layout.used), 0};
    refdyn_linear_lay_out(&form->linear, &form->model, 1, 0, &layout);
    form->q = room_for((size_t)n * sizeof *form->q);
    form->slope = room_for((size_t)(2 * n + 1 + form->model.m) * sizeof *form->slope);
    form->sides = room_for((size_t)(4 * n) * sizeof *form->sides);
    set_state(form);
}

static void call(struct form *form, int part) {
    const int n = form->model.n;
    double *r = form->sides, *x = r + 2 * n;
    if (part == 0 && refdyn_linear_evaluate(&form->linear, form->work, 0.3, form->q, form->slope))
        exit(1);
    if (part == 1 && refdyn_linear_factor(&form->linear, form->work, g))
        exit(1);
    if (part == 2)
        refdyn_linear_solve(&form->linear, r, r + n, g, x, x + n);
}

static double timed(struct form *form, int part, long times) {
    struct timespec from, to;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
    for (long i = 0; i < times; i++)
        call(form, part);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
    return (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
}

int main(void) {
    static struct form forms[FORMS];
    double least[FORMS][PARTS];
    long times[FORMS][PARTS];
    for (int f = 0; f < FORMS; f++) {
        open_form(&forms[f], f);
        for (int part = 0; part < PARTS; part++) {
            times[f][part] = 1;
            while (timed(&forms[f], part, times[f][part]) < batch_seconds)
                times[f][part] *= 2;
            least[f][part] = 1;
        }
    }
    for (int batch = 0; batch < BATCHES; batch++)
        for (int f = 0; f < FORMS; f++)
            for (int part = 0; part < PARTS; part++) {
                const double now = timed(&forms[f], part, times[f][part]) / (double)times[f][part];
                least[f][part] = now < least[f][part] ? now : least[f][part];
            }
    printf("%d", MODEL.n);
    for (int f = 0; f < FORMS; f++)
        for (int part = 0; part < PARTS; part++)
            printf(" %.3f", 1e6 * least[f][part]);
    printf("\n");
    return 0;
}
