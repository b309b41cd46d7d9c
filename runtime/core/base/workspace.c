/*
 * The workspace of one model instance: layout, parameters, start of a motion.
 *
 * In: a model and memory of the caller. Out: a workspace with arrays in that memory.
 */
#include "runtime/core/base/core.h"

#include "refdyn.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* M f u v phi psi k, in the order of the model's `equations` */
static void lay_out_equations(struct refdyn_workspace *work, struct layout *layout) {
    const int n = work->n, m = work->m;
    work->M = work->equations = layout_doubles(layout, n * n);
    work->f = layout_doubles(layout, n);
    work->u = layout_doubles(layout, m * n);
    work->v = layout_doubles(layout, m);
    work->phi = layout_doubles(layout, m);
    work->psi = layout_doubles(layout, m);
    work->k = layout_doubles(layout, m);
}

/* The only list of a workspace's arrays; returns their bytes. */
static size_t lay_out(struct refdyn_workspace *work, char *base) {
    const struct refdyn_model *model = work->model;
    const int n = work->n, m = work->m;
    struct layout layout = {base, 0};
    work->p = layout_doubles(&layout, model->parameter_count + model->derived_count);
    work->x = layout_doubles(&layout, model->input_count);
    lay_out_equations(work, &layout);
    work->anchored = layout_doubles(&layout, model->anchored_count);
    work->rows = layout_doubles(&layout, m * n);
    work->P = layout_doubles(&layout, m * (n + 1));
    work->scale = layout_doubles(&layout, n);
    work->mass_d = layout_doubles(&layout, m * n);
    work->coupling = layout_doubles(&layout, m * n);
    work->reduced = layout_doubles(&layout, n * n);
    work->weight = layout_doubles(&layout, n);
    work->row_state = layout_doubles(&layout, 1 + 2 * n);
    work->sizes = layout_doubles(&layout, m * n);
    work->row_size = layout_doubles(&layout, m);
    work->side = layout_doubles(&layout, n);
    work->lambda = layout_doubles(&layout, m);
    work->basis = layout_doubles(&layout, m * n);
    work->wanted = layout_doubles(&layout, m);
    work->change = layout_doubles(&layout, 2 * n);
    work->away = layout_doubles(&layout, 7 * n + m);
    work->emitted = layout_doubles(&layout, n + 1 + m);
    work->required = layout_doubles(&layout, refdyn_required_count(model));
    work->partition.column = layout_ints(&layout, n);
    work->partition.row = layout_ints(&layout, m);
    work->exchange = layout_ints(&layout, m);
    work->mark = layout_ints(&layout, n + m);
    return layout.used;
}

size_t refdyn_workspace_size(const struct refdyn_model *model) {
    if (refdyn_model_status(model))
        return 0;
    struct refdyn_workspace work = {.model = model, .n = model->n, .m = model->m};
    return lay_out(&work, NULL);
}

void refdyn_partition_reset(struct refdyn_workspace *work) {
    if (!refdyn_is_laid_out(work))
        return;
    struct refdyn_partition *partition = &work->partition;
    partition->rank = -1;
    partition->rank_most = work->m;
    partition->is_declared = partition->changes = partition->choices = 0;
    partition->condition = partition->condition_chosen = partition->condition_max = 1;
    partition->share_chosen = 1;
    partition->pivot = partition->pivot_min = 1;
}

static int has_equations(const struct refdyn_model *model) {
    if (model->equations)
        return 1;
    return model->M && model->h && model->Q && (model->m == 0 || (model->u && model->v && model->k));
}

int refdyn_workspace_init(struct refdyn_workspace *work, const struct refdyn_model *model, void *memory,
                          size_t size) {
    if (!work)
        return REFDYN_BAD_MEMORY;
    *work = (struct refdyn_workspace){.seal = REFDYN_SEAL, .model = model};
    int status = refdyn_model_status(model);
    if (status)
        return status;
    if (!refdyn_arithmetic_is_exact())
        return REFDYN_BAD_ARITHMETIC;
    if (!has_equations(model))
        return REFDYN_FUNCTION_MISSING;
    status = layout_status(memory, size, refdyn_workspace_size(model));
    if (status)
        return status;
    memset(memory, 0, refdyn_workspace_size(model));
    work->n = model->n;
    work->m = model->m;
    lay_out(work, memory);
    /* a pivot without half of its digits cannot be distinguished from the drift of its rows */
    work->rank_tol = sqrt(DBL_EPSILON);
    /* stabilisation multiplies this drift, so that redundant rows agree to half of these digits only */
    work->consistency_tol = sqrt(sqrt(DBL_EPSILON));
    work->refused = -1;
    work->fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
    refdyn_partition_reset(work);
    for (int i = 0; i < model->parameter_count; i++)
        work->p[i] = model->parameters[i].value;
    for (int i = 0; i < model->input_count; i++)
        work->x[i] = model->inputs[i].value;
    refdyn_prepare(work);
    return REFDYN_OK;
}

int refdyn_workspace_status(const struct refdyn_workspace *work) {
    if (!work || work->seal != REFDYN_SEAL)
        return REFDYN_BAD_MEMORY;
    const int status = refdyn_model_status(work->model);
    return !status && !work->equations ? REFDYN_BAD_MEMORY : status;
}

int refdyn_exchange_model(struct refdyn_workspace *work, const struct refdyn_model *model) {
    const int status = refdyn_workspace_status(work), other = refdyn_model_status(model);
    if (status || other)
        return status ? status : other;
    if (!refdyn_models_agree(work->model, model))
        return REFDYN_BAD_MODEL;
    work->model = model;
    return REFDYN_OK;
}

void refdyn_prepare(struct refdyn_workspace *work) {
    if (!refdyn_workspace_status(work) && work->model->prepare)
        work->model->prepare(work->p);
}

void refdyn_initial_state(const struct refdyn_workspace *work, double *q, double *qd) {
    if (refdyn_workspace_status(work) || !q || !qd)
        return;
    const struct refdyn_model *model = work->model;
    const int n = work->n;
    for (int j = 0; j < n; j++) {
        q[j] = model->coordinates[j].value;
        qd[j] = 0;
    }
    if (model->start) {
        double *state = work->change; /* (2 n) */
        model->start(work->p, work->x, 0, q, qd, state);
        memcpy(q, state, (size_t)n * sizeof *q);
        memcpy(qd, state + n, (size_t)n * sizeof *qd);
    }
}

void refdyn_anchor(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                   const int *given) {
    if (refdyn_workspace_status(work) || !work->model->anchor || !q || !qd)
        return;
    const struct refdyn_model *model = work->model;
    model->anchor(work->p, work->x, t, q, qd, work->anchored);
    for (int i = 0; i < model->anchored_count; i++)
        if (!given || !given[i])
            work->p[model->anchored[i]] = work->anchored[i];
    refdyn_prepare(work);
}
