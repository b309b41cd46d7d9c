/*
 * Ranges of a model's numbers. Takes numbers with the values that parameters have; gives what is wrong with
 * them; declared in model.h.
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
    default:
        return true;
    }
}

const char *requirement_fault(struct memory *memory, enum number_range range, double value) {
    static const char *const needed[] = {[RANGE_ANY] = "a number",
                                         [RANGE_POSITIVE] = "a positive number",
                                         [RANGE_NOT_NEGATIVE] = "a number not below 0",
                                         [RANGE_POISSON] = "a number above -1 and up to 0.5"};
    if (!isfinite(value))
        return memory_format(memory, "value %s, a finite number is needed", text_not_finite(value));
    if (is_in_range(range, value))
        return NULL;
    return memory_format(memory, "value %.6g, %s is needed", value, needed[range]);
}

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
    rewrite_evaluate(model->graph, requirement->value, note_parameter, &looking);
    return looking.is_found;
}
