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

/* sum_i x_i y_i in four sums, which fit a vector and do not wait for each other */
INLINE double sum_of(int n, const double *x, const double *y) {
    double s[4] = {0, 0, 0, 0}, rest = 0;
    int i = 0;
    for (; i + 3 < n; i += 4)
        for (int j = 0; j < 4; j++)
            s[j] += x[i + j] * y[i + j];
    for (; i < n; i++)
        rest += x[i] * y[i];
    return s[0] + s[1] + (s[2] + s[3]) + rest;
}

INLINE struct scalar dot(int parts, int n, const double *x, const double *y) {
    if (parts == 1)
        return (struct scalar){sum_of(n, x, y), 0};
    return (struct scalar){sum_of(n, x, y) - sum_of(n, x + n, y + n),
                           sum_of(n, x, y + n) + sum_of(n, x + n, y)};
}

/* s real */
INLINE struct scalar dot_real(int parts, int n, const double *s, const double *y) {
    return (struct scalar){sum_of(n, s, y), parts == 2 ? sum_of(n, s, y + n) : 0};
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
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    for (int part = 0; part < parts; part++)
        add_cross(planar, shift, w + part * at.left + at.moments, w + part * at.left, 1, 1);
}

/* What wrenches meet, from the joint before: in terms of the same wrench about this joint. */
INLINE void move_out(int parts, int planar, const double *shift, const double *rate, double *z) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    for (int part = 0; part < parts; part++, z += at.right) {
        add_crossed(planar, shift, z, z + at.force);
        add_crossed(planar, rate, z + at.spin, z + at.force);
    }
}

/* X to the origin of the joint before: of both its sides. */
INLINE void move_inner(int parts, int planar, const double *shift, const double *rate, double *X) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
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
    double *X = c->inner + c->slot[k] * 2 * REFDYN_LEFT_MOST * REFDYN_RIGHT_MOST;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        memset(X, 0, (size_t)(parts * size) * sizeof *X);
    for (int i = c->other[k]; i >= 0; i = c->next[i]) {
        const double *other = c->inner + c->slot[i] * 2 * REFDYN_LEFT_MOST * REFDYN_RIGHT_MOST;
        for (int e = 0; e < parts * size; e++)
            X[e] += other[e];
    }
    return X;
}

INLINE int eliminate(const struct refdyn_chain *c, int parts, int planar, struct scalar g, double *factors) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
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
            W[l] -= sum_of(R, re, Z) - (parts == 2 ? sum_of(R, im, Z + R) : 0);
            if (parts == 2)
                W[L + l] -= sum_of(R, re, Z + R) + sum_of(R, im, Z);
            for (int r = 0; r < R; r++) {
                Y[r] -= S[l] * re[r];
                if (parts == 2)
                    Y[R + r] -= S[l] * im[r];
            }
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
        if (c->moves[k])
            move_inner(parts, planar, record + at.shift, record + at.shift_rate, X);
    }
    return -1;
}

/* ---- What is carried from joint to joint stays in local variables; in c->sweep where the tree branches ----
 */

/* Inward, at joint k: w is that of the first joint beyond it; those of the others are added. */
INLINE void gather_wrench(const struct refdyn_chain *c, int count, int k, double *w) {
    if (k + 1 == c->n || c->parent[k + 1] != k)
        for (int i = 0; i < count; i++)
            w[i] = 0;
    for (int other = c->other[k]; other >= 0; other = c->next[other])
        for (int i = 0; i < count; i++)
            w[i] += c->sweep[other * 2 * REFDYN_RIGHT_MOST + i];
}

/* Moved to the joint before; kept where that is not the next one in turn. */
INLINE void pass_wrench(const struct refdyn_chain *c, int parts, int planar, int k, double *w) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    if (c->moves[k])
        move_wrench(parts, planar, c->records + k * c->record + at.shift, w);
    if (c->parent[k] != k - 1)
        for (int i = 0; i < parts * at.left; i++)
            c->sweep[k * 2 * REFDYN_RIGHT_MOST + i] = w[i];
}

/* Outward, at joint k: z is that of the joint before. */
INLINE void take_up(const struct refdyn_chain *c, int parts, int planar, int k, double *z) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const double *record = c->records + k * c->record;
    if (c->parent[k] < 0 || c->parent[k] != k - 1)
        for (int i = 0; i < parts * at.right; i++)
            z[i] = c->parent[k] < 0 ? 0 : c->sweep[c->parent[k] * 2 * REFDYN_RIGHT_MOST + i];
    if (c->moves[k])
        move_out(parts, planar, record + at.shift, record + at.shift_rate, z);
}

INLINE void leave(const struct refdyn_chain *c, int count, int k, const double *z) {
    if (c->other[k] >= 0)
        for (int i = 0; i < count; i++)
            c->sweep[k * 2 * REFDYN_RIGHT_MOST + i] = z[i];
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
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int n = c->n, L = at.left, R = at.right, size = parts * (L + 2 * R + 1);
    double w[2 * REFDYN_LEFT_MOST] = {0}, z[2 * REFDYN_RIGHT_MOST] = {0};
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record, *W = factors + k * size, *pivot = W + size - parts;
        gather_wrench(c, parts * L, k, w);
        const struct scalar felt = dot_real(parts, L, record, w), right = entry_of(parts, x, n, k);
        const struct scalar y = times(parts, (struct scalar){right.re - felt.re, right.im - felt.im},
                                      entry_of(parts, pivot, 1, 0));
        set_entry(parts, x, n, k, y);
        add_scaled(parts, L, y, W, w);
        pass_wrench(c, parts, planar, k, w);
    }
    for (int k = 0; k < n; k++) {
        const double *Y = factors + k * size + parts * L, *Z = Y + parts * R, *pivot = Z + parts * R;
        take_up(c, parts, planar, k, z);
        const struct scalar left = times(parts, dot(parts, R, Y, z), entry_of(parts, pivot, 1, 0));
        struct scalar y = entry_of(parts, x, n, k);
        y = (struct scalar){y.re - left.re, y.im - left.im};
        set_entry(parts, x, n, k, y);
        add_scaled(parts, R, y, Z, z);
        leave(c, parts * R, k, z);
    }
    return 0;
}

/* ---- Products ---- */

INLINE int multiply(const struct refdyn_chain *c, int planar, const double *const x[3], double *y) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int n = c->n, L = at.left, R = at.right;
    double w[REFDYN_LEFT_MOST] = {0}, z[REFDYN_RIGHT_MOST] = {0};
    for (int k = n - 1; k >= 0; k--) {
        const double *record = c->records + k * c->record;
        gather_wrench(c, L, k, w);
        y[k] = sum_of(L, record, w);
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_scaled(1, L, (struct scalar){x[of][k], 0}, record + at.W + of * L, w);
        pass_wrench(c, 1, planar, k, w);
    }
    for (int k = 0; k < n; k++) {
        const double *record = c->records + k * c->record;
        take_up(c, 1, planar, k, z);
        for (int of = 0; of < 3; of++)
            if (x[of])
                add_scaled(1, R, (struct scalar){x[of][k], 0}, record + at.Z + of * R, z);
        leave(c, R, k, z);
        y[k] += sum_of(R, record + at.Y, z);
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
