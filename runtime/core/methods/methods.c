/* The methods by number and by name. */
#include "runtime/core/base/core.h"

#include <string.h>

#include "runtime/core/methods/methods.h"

#define REFDYN_DECLARED(number, method) extern const struct refdyn_method_definition refdyn_method_##method;
REFDYN_METHODS(REFDYN_DECLARED)

#define REFDYN_LISTED(number, method) [number] = &refdyn_method_##method,
static const struct refdyn_method_definition *const methods[] = {REFDYN_METHODS(REFDYN_LISTED)};

/* `auto`: its properties of steps are those of its Rosenbrock method. */
const struct refdyn_method_definition refdyn_method_automatic = {
    .name = "auto", .order = 5, .order_error = 4};

const struct refdyn_method_definition *refdyn_method_definition(enum refdyn_method method) {
    return (unsigned)method < REFDYN_METHOD_COUNT ? methods[method] : NULL;
}

void refdyn_method_use(enum refdyn_method method, struct refdyn_step *step) {
    step->number = method;
    step->method = methods[method];
    refdyn_linear_drop_factors(step->linear);
    if (step->method->kind->begin)
        step->method->kind->begin(step, 1);
}

const char *refdyn_method_name(int method) {
    const struct refdyn_method_definition *definition = refdyn_method_definition((enum refdyn_method)method);
    return definition ? definition->name : NULL;
}

int refdyn_method_order(enum refdyn_method method) {
    const struct refdyn_method_definition *definition = refdyn_method_definition(method);
    return definition ? definition->order : 0;
}

int refdyn_method_find(const char *name) {
    for (int method = 0; name && method < REFDYN_METHOD_COUNT; method++)
        if (strcmp(name, refdyn_method_name(method)) == 0)
            return method;
    return -1;
}

/* Returns whether the method needs the tangent. `auto` does not: without a tangent it uses explicit methods.
 */
static int needs_tangent(enum refdyn_method method) {
    const struct refdyn_method_definition *definition = refdyn_method_definition(method);
    return definition && definition->kind && definition->kind->is_implicit;
}

int refdyn_method_is_implicit(enum refdyn_method method) {
    return method == REFDYN_AUTO || needs_tangent(method);
}

int refdyn_has_tangent(const struct refdyn_model *model) {
    return refdyn_model_is_readable(model) && (model->tangent || model->tangent_vectors);
}

int refdyn_can_run(const struct refdyn_model *model, enum refdyn_method method) {
    if (!refdyn_method_name((int)method) || !refdyn_model_is_readable(model))
        return 0;
    return !needs_tangent(method) || refdyn_has_tangent(model);
}
