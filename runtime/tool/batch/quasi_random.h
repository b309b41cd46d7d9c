/* Quasi-random sequences of GSL (gsl_qrng): points that fill a cube more evenly than random ones. */
#ifndef REFDYN_TOOL_QUASI_RANDOM_H
#define REFDYN_TOOL_QUASI_RANDOM_H

#include "read/sweep_file.h"

/* Is the program built with GSL? */
bool quasi_random_is_there(void);
/* The first `count` points of a sequence in `width` dimensions: coordinate i of point k at points[k * width +
 * i], in [0, 1). The width is one that the sequence has. */
void quasi_random_points(enum sequence sequence, int width, long count, double *points);

#endif
