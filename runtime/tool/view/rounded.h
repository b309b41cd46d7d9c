/*
 * Numbers of a page, rounded to what a picture needs, as JSON. None of them is NaN or infinite: what is not
 * finite becomes 0, since no motion was computed with it.
 */
#ifndef REFDYN_TOOL_ROUNDED_H
#define REFDYN_TOOL_ROUNDED_H

#include <stdio.h>

/* A length, or another number of a scale of its own: seven digits. */
void put_length(FILE *out, double value);
/* An entry of a rotation, to 1e-8. */
void put_cosine(FILE *out, double value);
/* `digits` of the largest absolute value: a power of ten. 1 where that is 0. */
double rounded_unit(double largest, int digits);
/* Values at that distance from each other as whole numbers of `unit`, each but the first less the one before:
 * "[3,0,-1]". */
void put_course(FILE *out, const double *values, long count, long stride, double unit);

#endif
