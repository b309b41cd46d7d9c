/*
 * Numbers that look random, the same to the bit on each machine, and sequences that fill a cube evenly.
 */
#ifndef REFDYN_TOOL_RANDOM_H
#define REFDYN_TOOL_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

/* ---- Random numbers: functions of their arguments alone ---- */

/* Philox 4x32-10 of a counter and a key. */
void random_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t result[4]);
/* A hash of a name: the number of its stream. */
uint64_t random_stream(const char *name);
/* A number of (0, 1): the middle of one of 2^52 equal intervals. */
double random_uniform(uint64_t seed, uint64_t stream, uint64_t number);
/* The value below which a standard normal variable lies with probability u, 0 < u < 1. */
double random_normal_quantile(double u);
/* Natural logarithm and exponential, to a few units in the last place; x > 0 and finite, result finite. */
double random_log(double x);
double random_exp(double x);

/* ---- Quasi-random points: coordinate i of point k is points[k * width + i], in [0, 1) ---- */

/* Points first, first + 1 ... of Halton's sequence. Point 0 is the origin. */
void random_halton(int width, long first, long count, double *points);
/* The first points of Sobol's sequence, which has RANDOM_SOBOL_MOST coordinates at most and needs GSL. */
enum { RANDOM_SOBOL_MOST = 40 };
void random_sobol(int width, long count, double *points);

#endif
