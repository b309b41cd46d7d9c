/* Computed numbers without rounding: see import.h. */
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>

static const double rounding = 1e-14;

void tidy(double *list, int count, double scale) {
    char text[NUMBER_LENGTH];
    for (int i = 0; i < count; i++)
        if (fabs(list[i]) < rounding * scale)
            list[i] = 0;
        else
            text_to_number(near_text(list[i], text), &list[i]);
}
