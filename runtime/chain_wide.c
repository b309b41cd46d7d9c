/*
 * The sweeps over a tree of joints of chain.h: products, elimination, solution. Compiled twice: wide.h.
 *
 * All is by position. A joint's record holds S, then its shift and the rate of it, W of mass, damping and
 * stiffness, Z of the same, and Y. Numbers are real (parts 1) or complex (parts 2: imaginary parts stand
 * behind the real ones of a vector). Components of a wrench are moments, then forces; of what it meets:
 * moment, spin, force, turned. In a plane these are one moment about its normal and two forces, b and c, that
 * follow the normal in x y z x.
 */
#include "chain_wide.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "wide.h"

enum { LEFT_MOST = 6, RIGHT_MOST = 12 };

/* Where vectors stand in a record and components in a vector: constants once planar is one. */
struct layout {
    int moments, forces, left, right;
    int shift, shift_rate, W, Z, Y; /* in a record */
    int spin, force, turned;        /* in Y and Z */
};

INLINE struct layout layout_of(int planar) {
    const int moments = planar ? 1 : 3, forces = planar ? 2 : 3, left = moments + forces,
              right = 3 * moments + forces;
    const int W = left + 2 * forces, Z = W + 3 * left;
    return (struct layout){moments, forces, left,          right,   left,        left + forces,
                           W,       Z,      Z + 3 * right, moments, 2 * moments, 2 * moments + forces};
}

struct scalar {
    double re, im;
};

INLINE struct scalar times(int parts, struct scalar a, struct scalar b) {
    if (parts == 1)
        return (struct scalar){a.re * b.re, 0};
    return (struct scalar){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

INLINE struct scalar inverse(int parts, struct scalar a) {
    if (parts == 1)
        return (struct scalar){1 / a.re, 0};
    const double square = a.re * a.re + a.im * a.im;
    return (struct scalar){a.re / square, -a.im / square};
}

/* y += a x */
INLINE void add_scaled(int parts, int n, struct scalar a, const double *restrict x, double *restrict y) {
    if (parts == 1) {
        for (int i = 0; i < n; i++)
            y[i] += a.re * x[i];
        return;
    }
    for (int i = 0; i < n; i++) {
        const double re = x[i], im = x[n + i];
        y[i] += a.re * re - a.im * im;
        y[n + i] += a.re * im + a.im * re;
    }
}

INLINE struct scalar dot(int parts, int n, const double *x, const double *y) {
    struct scalar sum = {0, 0};
    for (int i = 0; i < n; i++) {
        sum.re += x[i] * y[i];
        if (parts == 2) {
            sum.re -= x[n + i] * y[n + i];
            sum.im += x[i] * y[n + i] + x[n + i] * y[i];
        }
    }
    return sum;
}

/* s real */
INLINE struct scalar dot_real(int parts, int n, const double *s, const double *y) {
    struct scalar sum = {0, 0};
    for (int i = 0; i < n; i++) {
        sum.re += s[i] * y[i];
        if (parts == 2)
            sum.im += s[i] * y[n + i];
    }
    return sum;
}

/* m += s x f, components `step` apart, each of them `count` numbers */
INLINE void add_cross(int planar, const double *s, const double *f, double *m, int step, int count) {
    for (int i = 0; i < count; i++) {
        if (planar) {
            m[i] += s[0] * f[step + i] - s[1] * f[i];
            continue;
        }
        m[i] += s[1] * f[2 * step + i] - s[2] * f[step + i];
        m[step + i] += s[2] * f[i] - s[0] * f[2 * step + i];
        m[2 * step + i] += s[0] * f[step + i] - s[1] * f[i];
    }
}

/* f += m x s: what the move above is on the other side of a product */
INLINE void add_crossed(int planar, const double *s, const double *m, double *f) {
    if (planar) {
        f[0] -= m[0] * s[1];
        f[1] += m[0] * s[0];
        return;
    }
    f[0] += m[1] * s[2] - m[2] * s[1];
    f[1] += m[2] * s[0] - m[0] * s[2];
    f[2] += m[0] * s[1] - m[1] * s[0];
}

/* A wrench to the origin of the joint before. */
INLINE void move_wrench(int parts, int planar, const double *shift, double *w) {
    const struct layout at = layout_of(planar);
    for (int part = 0; part < parts; part++)
        add_cross(planar, shift, w + part * at.left + at.moments, w + part * at.left, 1, 1);
}

/* What wrenches meet, from the joint before: in terms of the same wrench about this joint. */
INLINE void move_out(int parts, int planar, const double *shift, const double *rate, double *z) {
    const struct layout at = layout_of(planar);
    for (int part = 0; part < parts; part++, z += at.right) {
        add_crossed(planar, shift, z, z + at.force);
        add_crossed(planar, rate, z + at.spin, z + at.force);
    }
}

/* X to the origin of the joint before: of both its sides. */
INLINE void move_inner(int parts, int planar, const double *shift, const double *rate, double *X) {
    const struct layout at = layout_of(planar);
    for (int part = 0; part < parts; part++, X += at.left * at.right) {
        add_cross(planar, shift, X + at.moments * at.right, X, at.right, at.right);
        for (int l = 0; l < at.left; l++) {
            double *row = X + l * at.right;
            add_cross(planar, shift, row + at.force, row, 1, 1);
            add_cross(planar, rate, row + at.force, row + at.spin, 1, 1);
        }
    }
}

/* base + g first + g^2 second of three vectors that follow each other */
INLINE void combine(int parts, int n, struct scalar g, const double *three, double *y) {
    const struct scalar square = times(parts, g, g);
    for (int i = 0; i < n; i++) {
        y[i] = three[i] + g.re * three[n + i] + square.re * three[2 * n + i];
        if (parts == 2)
            y[n + i] = g.im * three[n + i] + square.im * three[2 * n + i];
    }
}

/* ---- Elimination ---- */

/* X of what lies beyond: the first joint there has left it in the slot, others are added. */
INLINE double *gather_inner(const struct refdyn_chain *c, int parts, int size, int k) {
    double *X = c->inner + c->slot[k] * 2 * LEFT_MOST * RIGHT_MOST;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        memset(X, 0, (size_t)(parts * size) * sizeof *X);
    for (int i = c->other[k]; i >= 0; i = c->next[i]) {
        const double *other = c->inner + c->slot[i] * 2 * LEFT_MOST * RIGHT_MOST;
        for (int e = 0; e < parts * size; e++)
            X[e] += other[e];
    }
    return X;
}

INLINE int eliminate(const struct refdyn_chain *c, int parts, int planar, struct scalar g, double *factors) {
    const struct layout at = layout_of(planar);
    const int L = at.left, R = at.right, size = L * R;
    const struct scalar square = times(parts, g, g);
    for (int k = c->n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record, *S = record;
        double *W = factors + k * parts * (L + 2 * R + 1), *Y = W + parts * L, *Z = Y + parts * R,
               *pivot = Z + parts * R;
        double *X = gather_inner(c, parts, size, k);
        combine(parts, L, g, record + at.W, W);
        combine(parts, R, g, record + at.Z, Z);
        memset(Y, 0, (size_t)(parts * R) * sizeof *Y);
        memcpy(Y, record + at.Y, (size_t)R * sizeof *Y);
        for (int l = 0; l < L; l++) {
            const double *re = X + l * R, *im = X + size + l * R;
            double left_re = 0, left_im = 0;
            for (int r = 0; r < R; r++) {
                left_re += re[r] * Z[r];
                Y[r] -= S[l] * re[r];
                if (parts == 2) {
                    left_re -= im[r] * Z[R + r];
                    left_im += re[r] * Z[R + r] + im[r] * Z[r];
                    Y[R + r] -= S[l] * im[r];
                }
            }
            W[l] -= left_re;
            if (parts == 2)
                W[L + l] -= left_im;
        }
        const struct scalar product = dot(parts, R, Z, Y);
        const struct scalar D = {product.re + g.re * c->damping[k] + square.re * c->stiffness[k],
                                 product.im + g.im * c->damping[k] + square.im * c->stiffness[k]};
        double whole = fabs(square.re * c->stiffness[k]);
        for (int r = 0; r < R; r++)
            whole += fabs(Z[r] * record[at.Y + r]);
        if (!(fabs(D.re) + fabs(D.im) > 4 * DBL_EPSILON * whole && fabs(D.re) + fabs(D.im) <= DBL_MAX))
            return k;
        const struct scalar one_over = inverse(parts, D);
        pivot[0] = one_over.re;
        if (parts == 2)
            pivot[1] = one_over.im;
        if (c->parent[k] < 0)
            continue;
        for (int l = 0; l < L; l++) {
            const struct scalar a = times(parts, (struct scalar){W[l], parts == 2 ? W[L + l] : 0}, one_over);
            double *re = X + l * R, *im = X + size + l * R;
            for (int r = 0; r < R; r++) {
                if (parts == 1) {
                    re[r] += a.re * Y[r];
                    continue;
                }
                re[r] += a.re * Y[r] - a.im * Y[R + r];
                im[r] += a.re * Y[R + r] + a.im * Y[r];
            }
        }
        move_inner(parts, planar, record + at.shift, record + at.shift_rate, X);
    }
    return -1;
}

/* ---- Solution ---- */

INLINE struct scalar entry_of(int parts, const double *x, int n, int k) {
    return (struct scalar){x[k], parts == 2 ? x[n + k] : 0};
}

INLINE void set_entry(int parts, double *x, int n, int k, struct scalar value) {
    x[k] = value.re;
    if (parts == 2)
        x[n + k] = value.im;
}

INLINE int solve(const struct refdyn_chain *c, int parts, int planar, const double *factors, double *x) {
    const struct layout at = layout_of(planar);
    const int n = c->n, L = at.left, R = at.right, size = parts * (L + 2 * R + 1);
    memset(c->sweep, 0, (size_t)(n * parts * R) * sizeof(double));
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record, *W = factors + k * size, *pivot = W + size - parts;
        double *w = c->sweep + k * parts * R;
        const struct scalar felt = dot_real(parts, L, record, w), right = entry_of(parts, x, n, k);
        const struct scalar y = times(parts, (struct scalar){right.re - felt.re, right.im - felt.im},
                                      entry_of(parts, pivot, 1, 0));
        set_entry(parts, x, n, k, y);
        if (c->parent[k] < 0)
            continue;
        add_scaled(parts, L, y, W, w);
        move_wrench(parts, planar, record + at.shift, w);
        double *into = c->sweep + c->parent[k] * parts * R;
        for (int i = 0; i < parts * L; i++)
            into[i] += w[i];
    }
    for (int k = 0; k < n; k++) {
        const double *record = c->records + k * c->record, *Y = factors + k * size + parts * L,
                     *Z = Y + parts * R, *pivot = Z + parts * R;
        double *z = c->sweep + k * parts * R;
        memset(z, 0, (size_t)(parts * R) * sizeof *z);
        if (c->parent[k] >= 0) {
            memcpy(z, c->sweep + c->parent[k] * parts * R, (size_t)(parts * R) * sizeof *z);
            move_out(parts, planar, record + at.shift, record + at.shift_rate, z);
        }
        const struct scalar left = times(parts, dot(parts, R, Y, z), entry_of(parts, pivot, 1, 0));
        struct scalar y = entry_of(parts, x, n, k);
        y = (struct scalar){y.re - left.re, y.im - left.im};
        set_entry(parts, x, n, k, y);
        add_scaled(parts, R, y, Z, z);
    }
    return 0;
}

/* ---- Products ---- */

INLINE int multiply(const struct refdyn_chain *c, int planar, const double *const x[3], double *y) {
    const struct layout at = layout_of(planar);
    const int n = c->n, L = at.left, R = at.right;
    memset(c->sweep, 0, (size_t)(n * R) * sizeof(double));
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record;
        double *w = c->sweep + k * R;
        y[k] = dot(1, L, record, w).re;
        if (c->parent[k] < 0)
            continue;
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_scaled(1, L, (struct scalar){x[of][k], 0}, record + at.W + of * L, w);
        move_wrench(1, planar, record + at.shift, w);
        double *into = c->sweep + c->parent[k] * R;
        for (int i = 0; i < L; i++)
            into[i] += w[i];
    }
    for (int k = 0; k < n; k++) {
        const double *record = c->records + k * c->record;
        double *z = c->sweep + k * R;
        memset(z, 0, (size_t)R * sizeof *z);
        if (c->parent[k] >= 0) {
            memcpy(z, c->sweep + c->parent[k] * R, (size_t)R * sizeof *z);
            move_out(1, planar, record + at.shift, record + at.shift_rate, z);
        }
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_scaled(1, R, (struct scalar){x[of][k], 0}, record + at.Z + of * R, z);
        y[k] += dot(1, R, record + at.Y, z).re;
        y[k] += (x[1] ? c->damping[k] * x[1][k] : 0) + (x[2] ? c->stiffness[k] * x[2][k] : 0);
    }
    return 0;
}

/* ---- With constants in place of what is the same for all joints ---- */

INLINE int chain_eliminate(const struct refdyn_chain *c, int parts, double re, double im, double *factors) {
    const struct scalar g = {re, im};
    if (c->is_planar)
        return parts == 1 ? eliminate(c, 1, 1, g, factors) : eliminate(c, 2, 1, g, factors);
    return parts == 1 ? eliminate(c, 1, 0, g, factors) : eliminate(c, 2, 0, g, factors);
}

INLINE int chain_solve_tree(const struct refdyn_chain *c, int parts, const double *factors, double *x) {
    if (c->is_planar)
        return parts == 1 ? solve(c, 1, 1, factors, x) : solve(c, 2, 1, factors, x);
    return parts == 1 ? solve(c, 1, 0, factors, x) : solve(c, 2, 0, factors, x);
}

INLINE int chain_multiply(const struct refdyn_chain *c, const double *const x[3], double *y) {
    return c->is_planar ? multiply(c, 1, x, y) : multiply(c, 0, x, y);
}

COMPILE(int, chain_eliminate,
        (const struct refdyn_chain *c, int parts, double re, double im, double *factors),
        (c, parts, re, im, factors))
COMPILE(int, chain_solve_tree, (const struct refdyn_chain *c, int parts, const double *factors, double *x),
        (c, parts, factors, x))
COMPILE(int, chain_multiply, (const struct refdyn_chain *c, const double *const x[3], double *y), (c, x, y))
