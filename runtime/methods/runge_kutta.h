/* Explicit Runge-Kutta methods as data. */
#ifndef REFDYN_RUNGE_KUTTA_H
#define REFDYN_RUNGE_KUTTA_H

#include "methods/step.h"

/*
 * Butcher tableau: Y_s = y + h sum_j a_sj f(t + c_j h, Y_j), y_new = y + h sum_s b_s f_s.
 *
 * Between the ends of the step, 0 <= theta <= 1 (Hairer, Norsett and Wanner, Solving ODEs I, 2nd ed., II.6),
 *     y(t + theta h) = y + h sum_s w_s(theta) f_s,   w_s(theta) = sum_k interpolant_sk theta^(k + 1)
 * over `all` = stages + interpolant_stages rates: those beyond `stages` serve the interpolant alone, and a
 * step that nobody looks into does not need them.
 *
 * With two embedded formulas, E = h |sum e_s f_s| and E_low = h |sum e_low_s f_s| count as the error
 * E^2 / sqrt(E^2 + E_low^2 / 100); for rk8 it falls with h^8, E with h^6 and E_low with h^4 (II.10).
 */
struct refdyn_tableau {
    int stages;
    int interpolant_stages;
    int order_error;             /* of the embedded formula; 0: none, the step is fixed */
    int order_error_low;         /* of a second embedded formula; 0: none */
    int order_interpolant;       /* of y(t + theta h) */
    int degree;                  /* of w_s */
    const double *a;             /* (stages x stages) strictly lower triangle */
    const double *b;             /* (stages) */
    const double *c;             /* (stages) */
    const double *e;             /* (stages) b minus the embedded formula's b */
    const double *e_low;         /* (stages) the same of the second one */
    const double *interpolant_a; /* (interpolant_stages x all) their rows of a */
    const double *interpolant_c; /* (interpolant_stages) */
    const double *interpolant;   /* (all x degree) */
};

/* Methods whose table is a tableau. */
extern const struct refdyn_method_kind refdyn_explicit;

/* Derivative of qd (n) of the interpolant at theta, once a state was interpolated in that step. */
void refdyn_explicit_accelerations(const struct refdyn_step *step, double theta, double *qdd);

#endif
