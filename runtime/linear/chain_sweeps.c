/*
 * The sweeps over a tree of joints of chain.h: products, elimination, solution. Compiled twice:
 * wide_vectors.h.
 *
 * All is by position. A joint's record holds S, then its shift and the rate of it, W of mass, damping and
 * stiffness, Z of the same, and Y. What is eliminated and solved are numbers: real ones, or (wide) LANES
 * complex ones side by side, one of each eigenvalue of a collocation method, all real parts first: elements
 * of a vector are far fewer than what a processor works on at once. Components of a wrench are moments, then
 * forces; of what it meets: moment, spin, force, turned. In a plane these are one moment about its normal and
 * two forces, b and c, that follow the normal in x y z x.
 */
#include "base/arithmetic.h"

#include "linear/chain_sweeps.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "linear/dense.h"
#include "linear/wide_vectors.h"

enum { LANES = REFDYN_LANES, WIDTH_MOST = 2 * LANES };

/* LANES doubles that are worked on at once, wherever they stand; processors without such vectors take parts
 * of them in turn. */
typedef double numbers
    __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double)), may_alias));

INLINE numbers *lanes_of(double *number) {
    return (numbers *)number;
}

INLINE const numbers *lanes_in(const double *number) {
    return (const numbers *)number;
}

/* ---- Numbers, and vectors of them ---- */

/* y = 1 / a; 0: that is none, or infinite beside `whole` */
INLINE int invert(int wide, const double *a, const double *whole, double *y) {
    for (int l = 0; l < (wide ? LANES : 1); l++) {
        const double re = a[l], im = wide ? a[LANES + l] : 0, size = fabs(re) + fabs(im);
        if (!(size > 4 * DBL_EPSILON * whole[l] && size <= DBL_MAX))
            return 0;
        if (!wide) {
            y[0] = 1 / re;
            return 1;
        }
        const double square = re * re + im * im;
        y[l] = re / square;
        y[LANES + l] = -im / square;
    }
    return 1;
}

/* y += s x with real s */
INLINE void add_real(int wide, int n, double s, const double *restrict x, double *restrict y) {
    for (int i = 0; i < n * refdyn_chain_width(wide); i++)
        y[i] += s * x[i];
}

/* y += a x */
INLINE int chain_add(int wide, int n, const double *a, const double *restrict x, double *restrict y) {
    if (!wide) {
        add_real(0, n, a[0], x, y);
        return 0;
    }
    const numbers a_re = lanes_in(a)[0], a_im = lanes_in(a)[1];
    for (int i = 0; i < 2 * n; i += 2) {
        const numbers re = lanes_in(x)[i], im = lanes_in(x)[i + 1];
        lanes_of(y)[i] += a_re * re - a_im * im;
        lanes_of(y)[i + 1] += a_re * im + a_im * re;
    }
    return 0;
}

/* y += s x with real vectors s and a number x */
INLINE void add_along(int wide, int n, const double *s, const double *x, double *y) {
    if (!wide) {
        add_real(0, n, x[0], s, y);
        return;
    }
    const numbers re = lanes_in(x)[0], im = lanes_in(x)[1];
    for (int i = 0; i < n; i++) {
        lanes_of(y)[2 * i] += s[i] * re;
        lanes_of(y)[2 * i + 1] += s[i] * im;
    }
}

/* sum = sum_i x_i y_i */
INLINE int chain_dot(int wide, int n, const double *x, const double *y, double *restrict sum) {
    if (!wide) {
        sum[0] = dense_dot(x, y, n);
        return 0;
    }
    numbers re = {0}, im = {0};
    for (int i = 0; i < 2 * n; i += 2) {
        const numbers *a = lanes_in(x) + i, *b = lanes_in(y) + i;
        re += a[0] * b[0] - a[1] * b[1];
        im += a[0] * b[1] + a[1] * b[0];
    }
    lanes_of(sum)[0] = re;
    lanes_of(sum)[1] = im;
    return 0;
}

/* The same with real s. */
INLINE int chain_dot_real(int wide, int n, const double *s, const double *y, double *restrict sum) {
    if (!wide) {
        sum[0] = dense_dot(s, y, n);
        return 0;
    }
    numbers re = {0}, im = {0};
    for (int i = 0; i < n; i++) {
        re += s[i] * lanes_in(y)[2 * i];
        im += s[i] * lanes_in(y)[2 * i + 1];
    }
    lanes_of(sum)[0] = re;
    lanes_of(sum)[1] = im;
    return 0;
}

/* y += s x - t z with real s and t */
INLINE void add_difference(int wide, int n, double s, const double *restrict x, double t,
                           const double *restrict z, double *restrict y) {
    for (int i = 0; i < n * refdyn_chain_width(wide); i++)
        y[i] += s * x[i] - t * z[i];
}

/* m += s x f of wrenches, whose components are `count` numbers each */
INLINE void add_cross(int wide, int planar, const double *s, const double *f, double *m, int count) {
    const int step = count * refdyn_chain_width(wide);
    const double *fy = f + step, *fz = fy + step;
    if (planar) {
        add_difference(wide, count, s[0], fy, s[1], f, m);
        return;
    }
    add_difference(wide, count, s[1], fz, s[2], fy, m);
    add_difference(wide, count, s[2], f, s[0], fz, m + step);
    add_difference(wide, count, s[0], fy, s[1], f, m + 2 * step);
}

/* f += m x s: what the move above is on the other side of a product */
INLINE void add_crossed(int wide, int planar, const double *s, const double *m, double *f) {
    const int step = refdyn_chain_width(wide);
    const double *my = m + step, *mz = my + step;
    if (planar) {
        add_real(wide, 1, -s[1], m, f);
        add_real(wide, 1, s[0], m, f + step);
        return;
    }
    add_difference(wide, 1, s[2], my, s[1], mz, f);
    add_difference(wide, 1, s[0], mz, s[2], m, f + step);
    add_difference(wide, 1, s[1], m, s[0], my, f + 2 * step);
}

/* A wrench to the origin of the joint before. */
INLINE void move_wrench(int wide, int planar, const double *shift, double *w) {
    const int width = refdyn_chain_width(wide);
    add_cross(wide, planar, shift, w + refdyn_chain_layout_of(planar).moments * width, w, 1);
}

/* What wrenches meet, from the joint before: in terms of the same wrench about this joint. */
INLINE void move_out(int wide, int planar, const double *shift, const double *rate, double *z) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide);
    add_crossed(wide, planar, shift, z, z + at.force * width);
    add_crossed(wide, planar, rate, z + at.spin * width, z + at.force * width);
}

/* X to the origin of the joint before: of both its sides. */
INLINE void move_inner(int wide, int planar, const double *shift, const double *rate, double *X) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide), across = at.right * width;
    add_cross(wide, planar, shift, X + at.moments * across, X, at.right);
    for (int l = 0; l < at.left; l++) {
        double *row = X + l * across, *force = row + at.force * width;
        add_cross(wide, planar, shift, force, row, 1);
        add_cross(wide, planar, rate, force, row + at.spin * width, 1);
    }
}

/* base + g first + g^2 second of three real vectors that follow each other */
INLINE void combine(int wide, int n, const double *g, const double *square, const double *three, double *y) {
    const int width = refdyn_chain_width(wide);
    for (int i = 0; i < n; i++)
        for (int p = 0; p < width; p++)
            y[i * width + p] =
                (p < (wide ? LANES : 1) ? three[i] : 0) + g[p] * three[n + i] + square[p] * three[2 * n + i];
}

/* ---- Elimination ---- */

/* X of what lies beyond: the first joint there has left it in the slot, others are added. */
INLINE double *gather_inner(const struct refdyn_chain *c, int wide, int size, int k) {
    const int width = refdyn_chain_width(wide);
    double *X = c->inner + c->slot[k] * size * width;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        memset(X, 0, (size_t)(size * width) * sizeof *X);
    for (int i = c->other[k]; i >= 0; i = c->next[i])
        add_real(wide, size, 1, c->inner + c->slot[i] * size * width, X);
    return X;
}

/* A_kk = Z . Y + g damping + g^2 stiffness, and what is summed in it. */
INLINE void find_pivot(const struct refdyn_chain *c, int wide, int planar, const double *g,
                       const double *square, int k, const double *Z, const double *Y, double *D,
                       double *whole) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide);
    const double *mass = c->records + k * c->record + at.Y;
    chain_dot(wide, at.right, Z, Y, D);
    for (int p = 0; p < width; p++)
        D[p] += g[p] * c->damping[k] + square[p] * c->stiffness[k];
    for (int l = 0; l < (wide ? LANES : 1); l++) {
        whole[l] = fabs(square[l] * c->stiffness[k]);
        for (int r = 0; r < at.right; r++)
            whole[l] += fabs(Z[r * width + l] * mass[r]);
    }
}

INLINE int eliminate(const struct refdyn_chain *c, int wide, int planar, const double *g, double *factors) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide), across = R * width;
    double square[WIDTH_MOST] = {0}, sum[WIDTH_MOST], whole[LANES];
    chain_add(wide, 1, g, g, square);
    for (int k = c->n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record, *S = record;
        double *W = factors + k * width * (L + 2 * R + 1), *Y = W + L * width, *Z = Y + across,
               *pivot = Z + across;
        double *X = gather_inner(c, wide, L * R, k);
        combine(wide, L, g, square, record + at.W, W);
        combine(wide, R, g, square, record + at.Z, Z);
        for (int r = 0; r < R; r++)
            for (int p = 0; p < width; p++)
                Y[r * width + p] = !wide || p < LANES ? record[at.Y + r] : 0;
        for (int l = 0; l < L; l++) {
            chain_dot(wide, R, X + l * across, Z, sum);
            add_real(wide, 1, -1, sum, W + l * width);
            add_real(wide, R, -S[l], X + l * across, Y);
        }
        find_pivot(c, wide, planar, g, square, k, Z, Y, sum, whole);
        if (!invert(wide, sum, whole, pivot))
            return k;
        if (c->parent[k] < 0)
            continue;
        for (int l = 0; l < L; l++) {
            double a[WIDTH_MOST] = {0};
            chain_add(wide, 1, W + l * width, pivot, a);
            chain_add(wide, R, a, Y, X + l * across);
        }
        if (c->moves[k])
            move_inner(wide, planar, record + at.shift, record + at.shift_rate, X);
    }
    return -1;
}

/* ---- What is carried from joint to joint stays in local variables; in c->sweep where the tree branches ----
 */

INLINE void copy(int count, const double *from, double *to) {
    for (int i = 0; i < count; i++)
        to[i] = from[i];
}

INLINE double *swept(const struct refdyn_chain *c, int width, int k) {
    return c->sweep + k * width * c->right;
}

/* Inward, at joint k: w is that of the first joint beyond it; those of the others are added. */
INLINE void gather_wrench(const struct refdyn_chain *c, int wide, int planar, int k, double *w) {
    const int width = refdyn_chain_width(wide), left = refdyn_chain_layout_of(planar).left;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        for (int i = 0; i < width * left; i++)
            w[i] = 0;
    for (int other = c->other[k]; other >= 0; other = c->next[other])
        add_real(wide, left, 1, swept(c, width, other), w);
}

/* Moved to the joint before; kept where that is not the next one in turn. */
INLINE void pass_wrench(const struct refdyn_chain *c, int wide, int planar, int k, double *w) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide);
    if (c->moves[k])
        move_wrench(wide, planar, c->records + k * c->record + at.shift, w);
    if (c->parent[k] != k - 1)
        copy(width * at.left, w, swept(c, width, k));
}

/* Outward, at joint k: z is that of the joint before. */
INLINE void take_up(const struct refdyn_chain *c, int wide, int planar, int k, double *z) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const double *record = c->records + k * c->record;
    const int width = refdyn_chain_width(wide);
    if (c->parent[k] < 0)
        for (int i = 0; i < width * at.right; i++)
            z[i] = 0;
    else if (c->parent[k] != k - 1)
        copy(width * at.right, swept(c, width, c->parent[k]), z);
    if (c->moves[k])
        move_out(wide, planar, record + at.shift, record + at.shift_rate, z);
}

INLINE void leave(const struct refdyn_chain *c, int width, int count, int k, const double *z) {
    if (c->other[k] >= 0)
        copy(count, z, swept(c, width, k));
}

/* ---- Solution ---- */

INLINE int solve(const struct refdyn_chain *c, int wide, int planar, const double *factors, double *x) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int n = c->n, L = at.left, R = at.right, width = refdyn_chain_width(wide);
    const int size = width * (L + 2 * R + 1);
    double w[WIDTH_MOST * REFDYN_LEFT_MOST] = {0}, z[WIDTH_MOST * REFDYN_RIGHT_MOST] = {0}, sum[WIDTH_MOST];
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record, *W = factors + k * size, *pivot = W + size - width;
        double y[WIDTH_MOST] = {0};
        gather_wrench(c, wide, planar, k, w);
        chain_dot_real(wide, L, record, w, sum);
        for (int p = 0; p < width; p++)
            sum[p] = x[k * width + p] - sum[p];
        chain_add(wide, 1, sum, pivot, y);
        copy(width, y, x + k * width);
        chain_add(wide, L, y, W, w);
        pass_wrench(c, wide, planar, k, w);
    }
    for (int k = 0; k < n; k++) {
        const double *Y = factors + k * size + L * width, *Z = Y + R * width, *pivot = Z + R * width;
        double y[WIDTH_MOST] = {0};
        take_up(c, wide, planar, k, z);
        chain_dot(wide, R, Y, z, sum);
        chain_add(wide, 1, sum, pivot, y);
        for (int p = 0; p < width; p++)
            x[k * width + p] = y[p] = x[k * width + p] - y[p];
        chain_add(wide, R, y, Z, z);
        leave(c, width, width * R, k, z);
    }
    return 0;
}

/* ---- Products: of each part of a number alone ---- */

INLINE int multiply(const struct refdyn_chain *c, int wide, int planar, const double *const x[3], double *y) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int n = c->n, L = at.left, R = at.right, width = refdyn_chain_width(wide);
    double w[WIDTH_MOST * REFDYN_LEFT_MOST] = {0}, z[WIDTH_MOST * REFDYN_RIGHT_MOST] = {0};
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record;
        gather_wrench(c, wide, planar, k, w);
        chain_dot_real(wide, L, record, w, y + k * width);
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_along(wide, L, record + at.W + of * L, x[of] + k * width, w);
        pass_wrench(c, wide, planar, k, w);
    }
    for (int k = 0; k < n; k++) {
        const double *record = c->records + k * c->record;
        double sum[WIDTH_MOST];
        take_up(c, wide, planar, k, z);
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_along(wide, R, record + at.Z + of * R, x[of] + k * width, z);
        leave(c, width, width * R, k, z);
        chain_dot_real(wide, R, record + at.Y, z, sum);
        add_real(wide, 1, 1, sum, y + k * width);
        if (x[1])
            add_real(wide, 1, c->damping[k], x[1] + k * width, y + k * width);
        if (x[2])
            add_real(wide, 1, c->stiffness[k], x[2] + k * width, y + k * width);
    }
    return 0;
}

/* ---- With constants in place of what is the same for all joints ---- */

INLINE int chain_eliminate(const struct refdyn_chain *c, int wide, const double *g, double *factors) {
    if (c->is_planar)
        return wide ? eliminate(c, 1, 1, g, factors) : eliminate(c, 0, 1, g, factors);
    return wide ? eliminate(c, 1, 0, g, factors) : eliminate(c, 0, 0, g, factors);
}

INLINE int chain_solve_tree(const struct refdyn_chain *c, int wide, const double *factors, double *x) {
    if (c->is_planar)
        return wide ? solve(c, 1, 1, factors, x) : solve(c, 0, 1, factors, x);
    return wide ? solve(c, 1, 0, factors, x) : solve(c, 0, 0, factors, x);
}

INLINE int chain_multiply(const struct refdyn_chain *c, int wide, const double *const x[3], double *y) {
    if (c->is_planar)
        return wide ? multiply(c, 1, 1, x, y) : multiply(c, 0, 1, x, y);
    return wide ? multiply(c, 1, 0, x, y) : multiply(c, 0, 0, x, y);
}

COMPILE(int, chain_eliminate, (const struct refdyn_chain *c, int wide, const double *g, double *factors),
        (c, wide, g, factors))
COMPILE(int, chain_solve_tree, (const struct refdyn_chain *c, int wide, const double *factors, double *x),
        (c, wide, factors, x))
COMPILE(int, chain_multiply, (const struct refdyn_chain *c, int wide, const double *const x[3], double *y),
        (c, wide, x, y))
COMPILE(int, chain_dot, (int wide, int n, const double *x, const double *y, double *sum),
        (wide, n, x, y, sum))
COMPILE(int, chain_dot_real, (int wide, int n, const double *s, const double *y, double *sum),
        (wide, n, s, y, sum))
COMPILE(int, chain_add, (int wide, int n, const double *a, const double *x, double *y), (wide, n, a, x, y))
