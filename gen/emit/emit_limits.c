/*
 * The table NAME_limits of joint limits, for planning and control. It has one entry for each joint with
 * limits; the header declares it if there are any.
 */
#include "gen/emit/emit.h"

#include <math.h>

static int count_limits(const struct emission *x) {
    int count = 0;
    for (int i = 0; i < x->plan->tree->count; i++)
        count += x->plan->tree->frames[i].joint.limits != NULL;
    return count;
}

void emit_limits_declaration(const struct emission *x, struct text *text) {
    const int count = count_limits(x);
    if (!count)
        return;
    text_add(text, "/* Limits of joints; no function in this file reads them. */\n");
    text_add(text, "enum { %s_limit_count = %d };\n", x->name, count);
    text_add(text, "extern const struct refdyn_limits %s_limits[%d];\n\n", x->name, count);
}

static const char *limit_text(double limit, char digits[32]) {
    if (isinf(limit))
        return limit < 0 ? "-HUGE_VAL" : "HUGE_VAL";
    return text_of_number(limit, digits);
}

void emit_limits(const struct emission *x, struct text *text) {
    const int count = count_limits(x);
    if (!count)
        return;
    text_add(text, "const struct refdyn_limits %s_limits[%d] = {\n", x->name, count);
    for (int i = 0; i < x->plan->tree->count; i++) {
        const struct limits *limits = x->plan->tree->frames[i].joint.limits;
        char digits[4][32];
        if (limits)
            text_add(text, "    {%d, %s, %s, %s, %s},\n", i, limit_text(limits->from, digits[0]),
                     limit_text(limits->to, digits[1]), limit_text(limits->rate, digits[2]),
                     limit_text(limits->force, digits[3]));
    }
    text_add(text, "};\n\n");
}
