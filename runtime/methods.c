/* The methods by name, and their tables: see step.h. */
#include "base/arithmetic.h"

#include <string.h>

#include "private/collocation.h"
#include "base/model_check.h"
#include "private/rosenbrock.h"
#include "private/runge_kutta.h"
#include "private/step.h"

static const struct refdyn_tableau *const tableaus[REFDYN_METHOD_COUNT] = {
    [REFDYN_RK4] = &refdyn_rk4, [REFDYN_RK54] = &refdyn_rk54, [REFDYN_RK8] = &refdyn_rk8};

static const struct refdyn_rosenbrock_table *const rosenbrocks[REFDYN_METHOD_COUNT] = {
    [REFDYN_RODAS5P] = &refdyn_rodas5p,
    [REFDYN_RODAS6P] = &refdyn_rodas6p,
    [REFDYN_ROS34PW2] = &refdyn_ros34pw2};

static const struct refdyn_collocation_table *const collocations[REFDYN_METHOD_COUNT] = {
    [REFDYN_RADAU9] = &refdyn_radau9, [REFDYN_GAUSS12] = &refdyn_gauss12};

/* The weaker of two embedded formulas only scales the error of the other one, which then falls as order 7
 * does. */
static int order_of_error(const struct refdyn_tableau *tableau) {
    return tableau->order_error_low ? tableau->order - 1 : tableau->order_error;
}

struct refdyn_method_facts refdyn_method_facts(enum refdyn_method method) {
    if ((int)method < 0 || (int)method >= REFDYN_METHOD_COUNT)
        return (struct refdyn_method_facts){.name = NULL};
    const struct refdyn_tableau *tableau = tableaus[method];
    const struct refdyn_rosenbrock_table *rosenbrock = rosenbrocks[method];
    if (tableau)
        return (struct refdyn_method_facts){.name = tableau->name,
                                            .order = tableau->order,
                                            .order_error = order_of_error(tableau),
                                            .is_last_new = tableau->is_last_new,
                                            .tableau = tableau};
    if (method == REFDYN_AUTO)
        return (struct refdyn_method_facts){.name = "auto", .order = 5, .order_error = 4};
    if (collocations[method])
        return (struct refdyn_method_facts){.name = collocations[method]->name,
                                            .order = collocations[method]->order,
                                            .order_error = collocations[method]->order,
                                            .is_implicit = 1,
                                            .collocation = collocations[method]};
    return (struct refdyn_method_facts){.name = rosenbrock->name,
                                        .is_implicit = 1,
                                        .order = rosenbrock->order,
                                        .order_error = rosenbrock->order_error,
                                        .rosenbrock = rosenbrock};
}

const char *refdyn_method_name(int method) {
    return refdyn_method_facts((enum refdyn_method)method).name;
}

int refdyn_method_order(enum refdyn_method method) {
    return refdyn_method_facts(method).order;
}

int refdyn_method_find(const char *name) {
    for (int method = 0; name && method < REFDYN_METHOD_COUNT; method++)
        if (strcmp(name, refdyn_method_name(method)) == 0)
            return method;
    return -1;
}

int refdyn_method_is_implicit(enum refdyn_method method) {
    return method == REFDYN_AUTO || refdyn_method_facts(method).is_implicit;
}

int refdyn_has_tangent(const struct refdyn_model *model) {
    return refdyn_model_is_readable(model) && (model->tangent || model->tangent_vectors);
}

int refdyn_can_run(const struct refdyn_model *model, enum refdyn_method method) {
    const struct refdyn_method_facts facts = refdyn_method_facts(method);
    if (!facts.name || !refdyn_model_is_readable(model))
        return 0;
    return !facts.is_implicit || refdyn_has_tangent(model);
}
