/* Units of a model, as texts like "N s/m" and "kg m^2", in the base units of FMI. */
#ifndef REFDYN_TOOL_UNITS_H
#define REFDYN_TOOL_UNITS_H

#include <stdbool.h>

enum { BASE_UNIT_COUNT = 8 };
extern const char *const base_unit_names[BASE_UNIT_COUNT]; /* kg m s A K mol cd rad */

struct base_unit {
    double factor; /* one of the unit is so many of the base units */
    int exponents[BASE_UNIT_COUNT];
};

/* False: a part of the text is no unit that is known here. */
bool unit_in_base(const char *unit, struct base_unit *base);

#endif
