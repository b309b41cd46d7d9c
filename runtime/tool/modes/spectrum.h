/*
 * Eigenvalues and shapes of small motions (theory, sect. 8.10).
 *
 * Takes the linear equations (linear_model.h), gives each x = shape e^(eigenvalue t) once: of a conjugate
 * pair the one with a positive imaginary part.
 */
#ifndef REFDYN_TOOL_SPECTRUM_H
#define REFDYN_TOOL_SPECTRUM_H

#include "scene/linear_model.h"

#include <complex.h>

struct mode {
    double complex eigenvalue;   /* [1/s]; its parts exactly 0 where they are within rounding */
    const double complex *shape; /* (n) the largest entry is 1 */
};

struct spectrum {
    struct mode *modes; /* by |eigenvalue|, ascending; a growing one before a decaying one */
    int count;
    const int *redundant; /* (redundant_count) rows that say what others say, or nothing at rest */
    int redundant_count;
};

/* Returns a status of the runtime. */
int find_spectrum(struct spectrum *spectrum, const struct linear *linear);

#endif
