/*
 * Random numbers of cases: each a function of the seed, the column's name and the case's number alone, so
 * that neither the order of the work nor another column changes it, and the same to the bit on each machine:
 * nothing but additions, multiplications, divisions and square roots of IEEE numbers, none of libm's
 * functions.
 */
#ifndef REFDYN_TOOL_RANDOM_H
#define REFDYN_TOOL_RANDOM_H

#include <stdint.h>

/* Philox 4x32-10 of a counter and a key, which are as long as its result. */
void random_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t result[4]);
/* Uniform in (0, 1), without the ends. `stream`: random_stream of a name. */
double random_uniform(uint64_t seed, uint64_t stream, uint64_t number);
uint64_t random_stream(const char *name);
/* The value below which a standard normal variable lies with probability u, 0 < u < 1. */
double random_normal_quantile(double u);
/* Natural logarithm and exponential, to a few units in the last place; x > 0 and finite, result finite. */
double random_log(double x);
double random_exp(double x);

#endif
