/* Rosenbrock methods as data, in the form without products of matrices and vectors. */
#ifndef REFDYN_ROSENBROCK_H
#define REFDYN_ROSENBROCK_H

/*
 * A step of h from (t, y) with J = df/dy and f_t = df/dt there (Hairer and Wanner, Solving ODEs II, 2nd ed.,
 * IV.7):
 *     (I / (h gamma) - J) U_i = f(t + alpha_i h, y + sum_j a_ij U_j) + sum_j c_ij U_j / h + gamma_sum_i h f_t
 *     y_new = y + sum_j b_j U_j,   error = sum_j e_j U_j
 * with j < i in the sums over a and c. Between the ends of the step, 0 <= theta <= 1,
 *     y(t + theta h) = (1 - theta) y + theta (y_new + (1 - theta) (K_1 + theta (K_2 + theta (K_3 + ...))))
 *     K_k = sum_j interpolant_kj U_j
 * and without such terms the cubic of Hermite.
 *
 * The stages beyond `stages` serve this interpolation alone: they are of the same form, b and e are zero
 * there, and a step that nobody looks into does not need them. `all` is stages + interpolant_stages.
 *
 * A W-method keeps its order with any matrix in place of J and any vector in place of f_t, zeros among them.
 */
struct refdyn_rosenbrock_table {
    const char *name;
    int stages;
    int interpolant_stages;
    int order;
    int order_error;       /* of the embedded formula, whose weights are b - e */
    int order_interpolant; /* of y(t + theta h) */
    int interpolant_terms; /* 0: the cubic of Hermite */
    int is_w_method;
    double gamma;
    const double *a;           /* (all x all) strictly lower triangle, of U_j */
    const double *c;           /* (all x all) strictly lower triangle, of U_j / h */
    const double *alpha;       /* (all) the times of the stages, in steps */
    const double *gamma_sum;   /* (all) of h f_t */
    const double *b;           /* (all) */
    const double *e;           /* (all) */
    const double *interpolant; /* (interpolant_terms x all) */
};

extern const struct refdyn_rosenbrock_table refdyn_rodas5p;  /* 5(4), 8 stages */
extern const struct refdyn_rosenbrock_table refdyn_rodas6p;  /* 6(5), 16 stages, 3 more for the interpolant */
extern const struct refdyn_rosenbrock_table refdyn_ros34pw2; /* 3(2), 4 stages, a W-method */

#endif
