/*
 * What a model's numbers have to be. Takes numbers with the values that parameters have; gives what is wrong
 * with them; declared in model.h.
 */
#include "model/model.h"
#include "base/memory.h"
#include "base/text.h"

#include <math.h>

static bool is_in_range(enum number_range range, double value) {
    switch (range) {
    case RANGE_POSITIVE:
        return value > 0;
    case RANGE_NOT_NEGATIVE:
        return value >= 0;
    case RANGE_POISSON:
        return value > -1 && value <= 0.5;
    case RANGE_SHARE:
        return value >= 0 && value <= 1;
    default:
        return true;
    }
}

const char *requirement_fault(struct memory *memory, enum number_range range, double value) {
    static const char *const needed[] = {[RANGE_ANY] = "a number",
                                         [RANGE_POSITIVE] = "a positive number",
                                         [RANGE_NOT_NEGATIVE] = "a number not below 0",
                                         [RANGE_POISSON] = "a number above -1 and up to 0.5",
                                         [RANGE_SHARE] = "a number from 0 to 1"};
    if (!isfinite(value))
        return memory_format(memory, "value %s, a finite number is needed", text_not_finite(value));
    if (is_in_range(range, value))
        return NULL;
    return memory_format(memory, "value %.6g, %s is needed", value, needed[range]);
}

/* ---- What may be wrong with the numbers of a requirement ---- */

const char *requirement_field(struct memory *memory, const struct requirement *requirement,
                              const double *values) {
    const char *fault = requirement_fault(memory, requirement->range, values[0]);
    return fault ? memory_format(memory, "%s: %s", requirement->path, fault) : NULL;
}

const char *requirement_argument(struct memory *memory, const struct requirement *requirement,
                                 const double *values) {
    const double size = values[0];
    const char *needed = requirement->range == RANGE_POSITIVE ? "a positive number" : "a number not below 0";
    if (!isfinite(size))
        return memory_format(memory, "%s: argument %d is %s, a finite number is needed", requirement->path,
                             requirement->argument, text_not_finite(size));
    if (is_in_range(requirement->range, size))
        return NULL;
    return memory_format(memory, "%s: argument %d is %.6g, %s is needed", requirement->path,
                         requirement->argument, size, needed);
}

const char *requirement_order(struct memory *memory, const struct requirement *requirement,
                              const double *values) {
    if (values[0] < values[1])
        return NULL;
    return memory_format(memory, "%s: from %.6g to %.6g, %s is needed", requirement->path, values[0],
                         values[1], requirement->needed);
}

const char *requirement_hole(struct memory *memory, const struct requirement *requirement,
                             const double *values) {
    if (values[0] < values[1])
        return NULL;
    return memory_format(memory, "%s: value %.6g, less than the outer diameter %.6g is needed",
                         requirement->path, values[0], values[1]);
}

const char *requirement_along(struct memory *memory, const struct requirement *requirement,
                              const double *values) {
    if (!(values[0] > values[1] * (1 + 1e-12)))
        return NULL;
    return memory_format(memory, "%s: value %.6g, the beam ends at %.6g", requirement->path, values[0],
                         values[1]);
}

/* No principal minor of the symmetric tensor xx yy zz xy xz yz is negative, but for rounding. */
static bool is_positive_semidefinite(const double J[6]) {
    const double scale = fmax(fabs(J[0]), fmax(fabs(J[1]), fabs(J[2]))), slack = 1e-9;
    const double xy = J[0] * J[1] - J[3] * J[3], xz = J[0] * J[2] - J[4] * J[4],
                 yz = J[1] * J[2] - J[5] * J[5];
    const double all = J[0] * yz - J[3] * (J[3] * J[2] - J[5] * J[4]) + J[4] * (J[3] * J[5] - J[1] * J[4]);
    return fmin(J[0], fmin(J[1], J[2])) >= -slack * scale &&
           fmin(xy, fmin(xz, yz)) >= -slack * scale * scale && all >= -slack * scale * scale * scale;
}

/*
 * A body has int x^2 dm = (yy + zz - xx) / 2 and so on: that tensor of second moments must not be negative,
 * which contains the triangle inequality. Where a moment is left out, since the link never turns so, only
 * what is given is looked at.
 */
const char *requirement_inertia(struct memory *memory, const struct requirement *requirement,
                                const double *values) {
    const double *I = values, half = (I[0] + I[1] + I[2]) / 2, largest = fmax(I[0], fmax(I[1], I[2]));
    const bool is_complete = I[0] > 0 && I[1] > 0 && I[2] > 0;
    double second[6];
    for (int i = 0; i < 6; i++)
        second[i] = (i < 3 ? half : 0) - I[i];
    if (is_complete && largest > half * (1 + 1e-9))
        return memory_format(memory,
                             "%s: inertia %.6g %.6g %.6g, none may be larger than the sum of the others",
                             requirement->path, I[0], I[1], I[2]);
    if (is_positive_semidefinite(is_complete ? second : I))
        return NULL;
    return memory_format(
        memory, "%s: inertia: products %.6g %.6g %.6g are too large for its moments, no body has such",
        requirement->path, I[3], I[4], I[5]);
}

const char *requirement_direction(struct memory *memory, const struct requirement *requirement,
                                  const double *values) {
    if (fmax(fabs(values[0]), fmax(fabs(values[1]), fabs(values[2]))) > 0)
        return NULL;
    return memory_format(memory, "%s: of length 0, a direction is needed", requirement->path);
}

const char *requirement_length(struct memory *memory, const struct requirement *requirement,
                               const double *values) {
    const double least = 1e-100, largest = 1e100, length = hypot(hypot(values[0], values[1]), values[2]);
    if (length == 0 || (length >= least && length <= largest)) /* 0 is no direction, and told as such */
        return NULL;
    return memory_format(memory, "%s: of length %.6g, from %g to %g is needed", requirement->path, length,
                         least, largest);
}

const char *requirement_broken(struct memory *memory, struct graph *graph, const struct parameter *parameters,
                               const struct requirement *requirement) {
    double values[sizeof requirement->values / sizeof *requirement->values];
    for (int i = 0; i < requirement->count; i++)
        values[i] = parameters_evaluate(graph, parameters, requirement->values[i]);
    return requirement->fault(memory, requirement, values);
}

/* ---- What a requirement hangs on ---- */

/* Is it or one of its operands a marked parameter? */
struct looking {
    const bool *is_marked;
    bool is_found;
};

static double note_parameter(void *context, const struct symbol *symbol) {
    struct looking *looking = context;
    looking->is_found |= symbol->kind == SYMBOL_PARAMETER && looking->is_marked[symbol->index];
    return 1;
}

bool requirement_depends(const struct model *model, const struct requirement *requirement,
                         const bool *is_marked) {
    struct looking looking = {.is_marked = is_marked};
    for (int i = 0; i < requirement->count; i++)
        rewrite_evaluate(model->graph, requirement->values[i], note_parameter, &looking);
    return looking.is_found;
}
