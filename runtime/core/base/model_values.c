/*
 * Values of a model's parameters, inputs and coordinates by name, and values of parameters that the model
 * refuses.
 */
#include "runtime/core/base/core.h"

#include <math.h>
#include <string.h>

int refdyn_find_name(const struct refdyn_name *names, int count, const char *name) {
    for (int i = 0; names && name && i < count; i++)
        if (strcmp(names[i].name, name) == 0)
            return i;
    return -1;
}

int refdyn_find_row(const struct refdyn_model *model, const char *name) {
    for (int i = 0; name && !refdyn_model_status(model) && i < model->m; i++)
        if (strcmp(model->rows[i].name, name) == 0)
            return i;
    return -1;
}

int refdyn_find_point(const struct refdyn_model *model, const char *name) {
    for (int i = 0; name && !refdyn_model_status(model) && i < model->point_count; i++)
        if (strcmp(model->points[i], name) == 0)
            return i;
    return -1;
}

int refdyn_find_anchored(const struct refdyn_model *model, int parameter) {
    for (int j = 0; !refdyn_model_status(model) && j < model->anchored_count; j++)
        if (model->anchored[j] == parameter)
            return j;
    return -1;
}

/* Sets the value of this name. Returns an error if the name is unknown or the value is not a number. */
static int set(const struct refdyn_name *names, int count, const char *name, double value, double *values) {
    const int place = refdyn_find_name(names, count, name);
    if (place < 0)
        return REFDYN_UNKNOWN_NAME;
    if (!isfinite(value))
        return REFDYN_BAD_VALUE;
    values[place] = value;
    return REFDYN_OK;
}

int refdyn_set_parameter(struct refdyn_workspace *work, const char *name, double value) {
    int status = refdyn_workspace_status(work);
    if (!status)
        status = set(work->model->parameters, work->model->parameter_count, name, value, work->p);
    if (!status)
        refdyn_prepare(work);
    return status;
}

int refdyn_set_input(struct refdyn_workspace *work, const char *name, double value) {
    const int status = refdyn_workspace_status(work);
    return status ? status : set(work->model->inputs, work->model->input_count, name, value, work->x);
}

int refdyn_set_coordinate(const struct refdyn_model *model, double *q, const char *name, double value) {
    const int status = refdyn_model_status(model);
    if (status || !q)
        return status ? status : REFDYN_BAD_MEMORY;
    return set(model->coordinates, model->n, name, value, q);
}

/* ---- Values of parameters that the model refuses ---- */

/*
 * In: the result of the emitted `required`, for each requirement whether it holds, then its numbers. Out: a
 * status, the first requirement that does not hold, and its numbers.
 */

int refdyn_check_parameters(struct refdyn_workspace *work) {
    const int status = refdyn_workspace_status(work);
    if (status)
        return status;
    const struct refdyn_model *model = work->model;
    const double *required = work->required;
    work->refused = -1;
    if (model->requirement_count == 0)
        return REFDYN_OK;
    model->required(work->p, work->x, 0, work->change, work->change, work->required);
    for (int i = 0; i < model->requirement_count && work->refused < 0; i++) {
        if (!(*required > 0))
            work->refused = i;
        required += 1 + model->requirements[i].count;
    }
    return work->refused < 0 ? REFDYN_OK : REFDYN_REFUSED;
}

void refdyn_refused_numbers(const struct refdyn_workspace *work, double numbers[REFDYN_REQUIREMENT_NUMBERS]) {
    if (!numbers)
        return;
    memset(numbers, 0, REFDYN_REQUIREMENT_NUMBERS * sizeof *numbers);
    if (!refdyn_is_laid_out(work) || work->refused < 0)
        return;
    const struct refdyn_requirement *requirements = work->model->requirements;
    const double *required = work->required + 1;
    for (int i = 0; i < work->refused; i++)
        required += 1 + requirements[i].count;
    memcpy(numbers, required, (size_t)requirements[work->refused].count * sizeof *numbers);
}
