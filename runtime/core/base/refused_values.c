/*
 * Values of parameters that the model refuses.
 *
 * Takes the result of the emitted `required`: for each requirement whether it holds, then its numbers.
 * Returns a status, the first requirement that does not hold, and its numbers.
 */
#include "runtime/core/base/core.h"

#include <string.h>

int refdyn_check_parameters(struct refdyn_workspace *work) {
    const struct refdyn_model *model = work->model;
    const double *required = work->required;
    const int status = refdyn_workspace_status(work);
    if (status)
        return status;
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
    const struct refdyn_requirement *requirements = work->model->requirements;
    const double *required = work->required + 1;
    memset(numbers, 0, REFDYN_REQUIREMENT_NUMBERS * sizeof *numbers);
    if (work->refused < 0)
        return;
    for (int i = 0; i < work->refused; i++)
        required += 1 + requirements[i].count;
    memcpy(numbers, required, (size_t)requirements[work->refused].count * sizeof *numbers);
}
