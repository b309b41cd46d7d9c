/* Does the polynomial of a collocation step follow its accelerations? */
#ifndef REFDYN_SMOOTHNESS_H
#define REFDYN_SMOOTHNESS_H

#include "methods/collocation.h"
#include "methods/step.h"

/*
 * The error of a step of h in its positions, in the step's units, where friction makes a jump or a kink of
 * its accelerations; 0: they are smooth. Told by their divided differences d_k over theta = 0, c_1 ... c_s,
 * of orders k = s - 3 ... s. Those of a vibration of x radians a step are x^k/k! times its acceleration, with
 * sines and cosines in turn, so that with X > x
 *     max(s! d_s/X^s, (s - 1)! d_(s-1)/X^(s-1)) < max((s - 2)! d_(s-2)/X^(s-2), (s - 3)! d_(s-3)/X^(s-3)).
 * Where that is not so, the error is that of a vibration that the step does not resolve: with so many radians
 * x it is share c_1 ... c_s h^2 d_s x^(order - 1 - s): collocation.h, where K = c_1 ... c_s / s!. No matrix
 * of the step stands before the differences, which in a step that begins in rest would damp what tells that
 * sliding has begun.
 *
 * Where the polynomial misses a good part of the accelerations the error is more than the tolerance of the
 * step: no step goes on from beyond a layer of friction that it has not met.
 *
 * accelerations ((s + 1) x n): at theta = 0 and at the stages; they are lost.
 */
double refdyn_unsmooth_error(const struct refdyn_step *step, double *accelerations, double h);

#endif
