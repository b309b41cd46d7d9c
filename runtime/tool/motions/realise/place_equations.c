/* The equations of a programme realised by drives at one place of the motion, from the emitted functions:
 * `equations` for their values, `tangent` and `tangent_x` for their derivatives. */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/realise/realise.h"
#include "runtime/tool/support/format/format.h"

static void find_rows(struct realise_problem *problem) {
    const struct model *model = &problem->scene->generation.model;
    int *loop = format_allocate((size_t)problem->m, sizeof *loop);
    for (int i = 0; i < problem->m; i++)
        if (!model->rows[i].is_programme)
            loop[problem->loops++] = i;
    problem->loop = loop;
}

static void find_inputs(struct realise_problem *problem) {
    const struct model *model = &problem->scene->generation.model;
    int *input = format_allocate((size_t)model->drive_count, sizeof *input);
    for (int i = 0; i < model->drive_count; i++)
        input[i] = refdyn_find_name(problem->scene->model->inputs, problem->scene->model->input_count,
                                    model->inputs[model->drives[i].input].name);
    problem->drives = model->drive_count;
    problem->input = input;
}

/* The force of a drive with a limit counts as a share of the limit. */
static void find_weights(struct realise_problem *problem) {
    const struct model *model = &problem->scene->generation.model;
    double *weights = format_allocate((size_t)problem->drives, sizeof *weights);
    for (int i = 0; i < problem->drives; i++) {
        weights[i] = 1;
        for (int j = 0; j < model->bound_count; j++)
            if (strcmp(model->bounds[j].column, model->inputs[model->drives[i].input].name) == 0)
                weights[i] = 1 / model->bounds[j].to;
    }
    problem->weights = weights;
}

void realise_problem_start(struct realise_problem *problem, struct scene *scene) {
    const int n = scene->model->n, m = scene->model->m, inputs = scene->model->input_count;
    *problem = (struct realise_problem){.scene = scene, .n = n, .m = m};
    realise_gauss_start(&problem->gauss);
    find_rows(problem);
    find_inputs(problem);
    problem->spare = problem->drives - (m - problem->loops);
    find_weights(problem);
    problem->width = n + problem->drives + problem->loops;
    problem->gains = format_allocate_matrix(2, m);
    problem->given = format_allocate_matrix(1, 2 * n + 1 + m);
    problem->tangent = format_allocate_matrix(1, n + m + 3 * (n + m) * n);
    problem->by_inputs = format_allocate_matrix(n + m, inputs);
}

void realise_problem_release(struct realise_problem *problem) {
    const struct refdyn_model *model = problem->scene->model;
    for (int i = 0; i < 2 * problem->m; i++) {
        const int place = model->gains ? model->gains[i] : -1;
        problem->gains[i] = place < 0 ? 0 : problem->scene->work.p[place];
        if (place >= 0)
            problem->scene->work.p[place] = 0;
    }
}

void realise_problem_end(struct realise_problem *problem) {
    const struct refdyn_model *model = problem->scene->model;
    for (int i = 0; i < 2 * problem->m; i++)
        if (model->gains && model->gains[i] >= 0)
            problem->scene->work.p[model->gains[i]] = problem->gains[i];
    for (int i = 0; i < problem->drives; i++)
        problem->scene->work.x[problem->input[i]] = 0;
}

static void find_residual(struct realise_problem *problem, const double *qdd, const double *lambda,
                          double *residual) {
    const struct refdyn_workspace *work = &problem->scene->work;
    const int n = problem->n, m = problem->m;
    for (int i = 0; i < n; i++) {
        residual[i] = -work->f[i];
        for (int j = 0; j < n; j++)
            residual[i] += work->M[i * n + j] * qdd[j];
        for (int l = 0; l < problem->loops; l++)
            residual[i] -= work->u[problem->loop[l] * n + i] * lambda[l];
    }
    for (int i = 0; i < m; i++) {
        residual[n + i] = work->v[i];
        for (int j = 0; j < n; j++)
            residual[n + i] += work->u[i * n + j] * qdd[j];
    }
}

/* The parts of struct NAME_tangent_result: f_t, g_t, G_q, G_qd, u, K, D, M. */
static void find_derivatives(struct realise_problem *problem, double t, const double *q,
                             struct realise_place *place) {
    const struct refdyn_workspace *work = &problem->scene->work;
    const struct refdyn_model *model = problem->scene->model;
    const int n = problem->n, m = problem->m;
    model->tangent(work->p, work->x, t, q, problem->given, problem->tangent);
    model->tangent_x(work->p, work->x, t, q, problem->given, problem->by_inputs);
    const double *part = problem->tangent + n + m;
    place->G_q = part;
    place->G_qd = part + m * n;
    place->u = part + 2 * m * n;
    place->K = part + 3 * m * n;
    place->D = place->K + n * n;
    place->M = place->D + n * n;
    place->f_x = problem->by_inputs;
}

int realise_place_find(struct realise_problem *problem, double t, const double *q, const double *qd,
                       const double *unknowns, struct realise_place *place) {
    struct refdyn_workspace *work = &problem->scene->work;
    const int n = problem->n;
    const double *tau = unknowns + n, *lambda = tau + problem->drives;
    for (int i = 0; i < problem->drives; i++)
        work->x[problem->input[i]] = tau[i];
    memset(problem->given, 0, (size_t)(2 * n + 1 + problem->m) * sizeof *problem->given);
    memcpy(problem->given, qd, (size_t)n * sizeof *qd);
    memcpy(problem->given + n, unknowns, (size_t)n * sizeof *qd);
    for (int l = 0; l < problem->loops; l++)
        problem->given[2 * n + 1 + problem->loop[l]] = lambda[l];
    const int status = refdyn_equations(work, t, q, qd);
    if (status != REFDYN_OK)
        return status;
    find_residual(problem, unknowns, lambda, place->residual);
    find_derivatives(problem, t, q, place);
    return REFDYN_OK;
}
