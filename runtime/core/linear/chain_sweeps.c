/* clang-format off */
/*
 * Sweeps over a tree of joints: products with its tangent, and L U in O(n) (theory, sect. 8.5).
 *
 * In: the result of `tangent_vectors` (refdyn_model.h). Out: products with M, D and K, and solutions with
 * A = M + g D + g^2 K + pulled^T (g pull_by_qd + g^2 pull_by_q), bordered by rows. For a joint i beyond j, with wrenches
 * moved to the origin of j,
 *     A_ji = S_j . W_i,   A_ij = Z_j . Y_i
 *     S = (e | e), where e turns | slides
 *     W = (moment | force) of mass + 2 g damping + g^2 stiffness
 *     Y = (mass moment, spin, mass force, turned rows)
 *     Z = (e + 2 g e' + g^2 e'', 2 g e + 2 g^2 e', g^2 lever + [e + 2 g e' + g^2 e''], g^2 e), only the brackets of a slide.
 * Products of all pairs are sums carried from joint to joint. Eliminated from the tips (no pivoting, as in
 * L^T D L of M), x_i adds -S_l . W_i Y_i . Z_k / A_ii to every entry (l, k) of joints nearer the ground. One matrix
 * X = sum W_i Y_i^T / A_ii, moved along, sums this over all joints beyond j, so that at j
 *     W_j -= X Z_j,   Y_j -= X^T S_j,   A_jj = Z_j . Y_j + rotor_j + g damping_j + g^2 stiffness_j.
 * Three turns that share springs (strains) are eliminated together: their entries A_tu are computed, K and D of the
 * strains added, and rows and columns combined, Y_l -= A_lk Y_k / A_kk, W_l -= W_k A_kl / A_kk, A_lj -= A_lk A_kj / A_kk.
 * Couplings and rows are a border, eliminated last. In a plane X is 3 x 5, in space 6 x 12. The matrices of a collocation
 * method, one real or complex g for each eigenvalue, are worked on side by side.
 *
 * All arrays are by position. The record of a joint contains S, the shift and its rate, W of mass, damping
 * and stiffness, Z of the same, and Y. A "number" is a real number or (wide) LANES complex numbers side by
 * side, one for each eigenvalue of a collocation method, all real parts first. Wide numbers fill the
 * processor's vectors, which the few components of a wrench would not. Components of a wrench: moments,
 * forces. Components of Y and Z: moment, spin, force, turned. In a plane there are one moment about the
 * normal and two forces, along the axes that follow the normal in the cycle x y z x.
 * COMPILE (linear_private.h) compiles the functions twice.
 */
/* clang-format on */
#include "runtime/core/linear/linear_private.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

enum { LANES = REFDYN_LANES, WIDTH_MOST = 2 * LANES };

/* LANES unaligned doubles that one operation processes; compilers split them for processors with shorter
 * vectors. */
typedef double numbers
    __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double)), may_alias));

INLINE numbers *lanes_of(double *number) {
    return (numbers *)number;
}

INLINE const numbers *lanes_in(const double *number) {
    return (const numbers *)number;
}

/* ---- Numbers, and vectors of them ---- */

/* y = 1 / a. Returns 0 if a is zero, or negligible compared with `whole`. */
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

/* f += m x s: the transpose of the move above */
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

/* Moves a wrench to the origin of the joint before. */
INLINE void move_wrench(int wide, int planar, const double *shift, double *w) {
    const int width = refdyn_chain_width(wide);
    add_cross(wide, planar, shift, w + refdyn_chain_layout_of(planar).moments * width, w, 1);
}

/* Moves the factor of a wrench (Y, Z) from the joint before to this one. */
INLINE void move_out(int wide, int planar, const double *shift, const double *rate, double *z) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide);
    add_crossed(wide, planar, shift, z, z + at.force * width);
    add_crossed(wide, planar, rate, z + at.spin * width, z + at.force * width);
}

/* Moves both sides of X to the origin of the joint before. */
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

/* base + g first + g^2 second for three consecutive real vectors */
INLINE void combine(int wide, int n, const double *g, const double *square, const double *three, double *y) {
    const int width = refdyn_chain_width(wide);
    for (int i = 0; i < n; i++)
        for (int p = 0; p < width; p++)
            y[i * width + p] =
                (p < (wide ? LANES : 1) ? three[i] : 0) + g[p] * three[n + i] + square[p] * three[2 * n + i];
}

/* ---- Elimination ---- */

/* Returns X of all joints beyond: the first of them has left it in the slot, its siblings are added. */
INLINE double *gather_inner(const struct refdyn_chain *c, int wide, int size, int k) {
    const int width = refdyn_chain_width(wide);
    double *X = c->inner + c->slot[k] * size * width;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        memset(X, 0, (size_t)(size * width) * sizeof *X);
    for (int i = c->other[k]; i >= 0; i = c->next[i])
        add_real(wide, size, 1, c->inner + c->slot[i] * size * width, X);
    return X;
}

/* A_kk = Z . Y + rotor + g damping + g^2 stiffness, and the sum of the absolute terms. */
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
        D[l] += c->rotor[k];
        whole[l] = fabs(square[l] * c->stiffness[k]) + fabs(c->rotor[k]);
        for (int r = 0; r < at.right; r++)
            whole[l] += fabs(Z[r * width + l] * mass[r]);
    }
}

/* W -= X Z and Y -= X^T S for joint k, with X of all eliminated joints. */
INLINE void meet_inner(const struct refdyn_chain *c, int wide, int planar, const double *g,
                       const double *square, int k, const double *X, double *W) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide), across = R * width;
    const double *record = c->records + k * c->record, *S = record;
    double *Y = W + L * width, *Z = Y + across, sum[WIDTH_MOST];
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
}

/* X += W Y^T / A_kk */
INLINE void leave_inner(int wide, int planar, const double *W, double *X) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide), across = R * width;
    const double *Y = W + L * width, *pivot = Y + 2 * across;
    for (int l = 0; l < L; l++) {
        double a[WIDTH_MOST] = {0};
        chain_add(wide, 1, W + l * width, pivot, a);
        chain_add(wide, R, a, Y, X + l * across);
    }
}

/* ---- Three turns that share strains ---- */

INLINE int is_ball(const struct refdyn_chain *c, int planar, int last) {
    return !planar && c->has_strains && last < c->n && c->ends_ball[last];
}

/* Places of A_kl (row) and A_lk (column), for the turn k - l places before k, after the pivot of k. */
INLINE int row_place(int wide, int before) {
    return (2 * before - 1) * refdyn_chain_width(wide);
}

INLINE int column_place(int wide, int before) {
    return 2 * before * refdyn_chain_width(wide);
}

/* y -= a b */
INLINE void subtract_product(int wide, int n, const double *a, const double *b, double *y) {
    double minus[WIDTH_MOST];
    for (int p = 0; p < refdyn_chain_width(wide); p++)
        minus[p] = -a[p];
    chain_add(wide, n, minus, b, y);
}

/* A_kl = Z_l . Y_k and A_lk = S_l . W_k with K and D of the strains, l `before` places before k. */
INLINE void find_entries(const struct refdyn_chain *c, int wide, const double *g, const double *square, int k,
                         int before, double *W) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(0);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide);
    const double *S = c->records + (k - before) * c->record;
    const double *strain = c->strains + k * REFDYN_STRAINS + 3 * (before - 1);
    const double *Z = W - before * width * refdyn_chain_numbers(c) + (L + R) * width;
    double *pivot = W + (L + 2 * R) * width, *row = pivot + row_place(wide, before),
           *column = pivot + column_place(wide, before);
    chain_dot(wide, R, Z, W + L * width, row);
    chain_dot_real(wide, L, S, W, column);
    for (int p = 0; p < width; p++) {
        row[p] += g[p] * strain[2] + square[p] * strain[0];
        column[p] += g[p] * strain[2] + square[p] * strain[1];
    }
}

/* Subtracts the contribution of the eliminated turn from the turns before it; entries[t]: factors of turn t.
 */
INLINE void leave_turn(int wide, int turn, double *const entries[3]) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(0);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide), pivot_at = (L + 2 * R) * width;
    const double *W = entries[turn], *pivot = W + pivot_at;
    for (int l = 0; l < turn; l++) {
        double row[WIDTH_MOST] = {0}, column[WIDTH_MOST] = {0};
        chain_add(wide, 1, pivot + row_place(wide, turn - l), pivot, row);
        chain_add(wide, 1, pivot + column_place(wide, turn - l), pivot, column);
        subtract_product(wide, R, column, W + L * width, entries[l] + L * width);
        subtract_product(wide, L, row, W, entries[l]);
    }
    if (turn < 2)
        return;
    double *of = entries[1] + pivot_at, column[WIDTH_MOST] = {0}, second[WIDTH_MOST] = {0};
    chain_add(wide, 1, pivot + column_place(wide, 1), pivot, column);
    chain_add(wide, 1, pivot + column_place(wide, 2), pivot, second);
    subtract_product(wide, 1, column, pivot + row_place(wide, 2), of + row_place(wide, 1));
    subtract_product(wide, 1, second, pivot + row_place(wide, 1), of + column_place(wide, 1));
}

/* Eliminates the three turns up to k. Returns -1, or the turn without a pivot. A_lk A_kl / A_kk is subtracted
 * from A_ll = Z_l . Y_l separately, because Y_l is combined with Y_k before its product with Z_l is formed.
 */
INLINE int eliminate_ball(const struct refdyn_chain *c, int wide, const double *g, const double *square,
                          int k, double *factors, double *X) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(0);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide);
    double *entries[3], diagonal[3][WIDTH_MOST], whole[3][LANES];
    for (int turn = 0; turn < 3; turn++) {
        double *W = entries[turn] = factors + (k - 2 + turn) * width * refdyn_chain_numbers(c);
        meet_inner(c, wide, 0, g, square, k - 2 + turn, X, W);
        find_pivot(c, wide, 0, g, square, k - 2 + turn, W + (L + R) * width, W + L * width, diagonal[turn],
                   whole[turn]);
    }
    for (int turn = 1; turn < 3; turn++)
        for (int before = 1; before <= turn; before++)
            find_entries(c, wide, g, square, k - 2 + turn, before, entries[turn]);
    for (int turn = 2; turn >= 0; turn--) {
        double *pivot = entries[turn] + (L + 2 * R) * width;
        if (!invert(wide, diagonal[turn], whole[turn], pivot))
            return k - 2 + turn;
        for (int l = 0; l < turn; l++) {
            double column[WIDTH_MOST] = {0};
            chain_add(wide, 1, pivot + column_place(wide, turn - l), pivot, column);
            subtract_product(wide, 1, column, pivot + row_place(wide, turn - l), diagonal[l]);
        }
        leave_turn(wide, turn, entries);
    }
    return -1;
}

INLINE int eliminate(const struct refdyn_chain *c, int wide, int planar, const double *g, double *factors) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int L = at.left, R = at.right, width = refdyn_chain_width(wide);
    double square[WIDTH_MOST] = {0}, sum[WIDTH_MOST], whole[LANES];
    chain_add(wide, 1, g, g, square);
    for (int k = c->n - 1; k >= 0; k--) {
        const int turns = is_ball(c, planar, k) ? 3 : 1;
        double *W = factors + k * width * refdyn_chain_numbers(c);
        double *X = gather_inner(c, wide, L * R, k);
        if (turns == 3) {
            const int failed = eliminate_ball(c, wide, g, square, k, factors, X);
            if (failed >= 0)
                return failed;
            k -= 2;
        } else {
            meet_inner(c, wide, planar, g, square, k, X, W);
            find_pivot(c, wide, planar, g, square, k, W + (L + R) * width, W + L * width, sum, whole);
            if (!invert(wide, sum, whole, W + (L + 2 * R) * width))
                return k;
        }
        if (c->parent[k] < 0)
            continue;
        for (int turn = turns - 1; turn >= 0; turn--)
            leave_inner(wide, planar, factors + (k + turn) * width * refdyn_chain_numbers(c), X);
        const double *record = c->records + k * c->record;
        if (c->moves[k])
            move_inner(wide, planar, record + at.shift, record + at.shift_rate, X);
    }
    return -1;
}

/* ---- Sums carried from joint to joint: local variables, stored in c->sweep where the tree branches ---- */

INLINE void copy(int count, const double *from, double *to) {
    for (int i = 0; i < count; i++)
        to[i] = from[i];
}

INLINE double *swept(const struct refdyn_chain *c, int width, int k) {
    return c->sweep + k * width * c->right;
}

/* Inward, at joint k: w is the wrench of the first joint beyond; adds those of its siblings. */
INLINE void gather_wrench(const struct refdyn_chain *c, int wide, int planar, int k, double *w) {
    const int width = refdyn_chain_width(wide), left = refdyn_chain_layout_of(planar).left;
    if (k + 1 == c->n || c->parent[k + 1] != k)
        for (int i = 0; i < width * left; i++)
            w[i] = 0;
    for (int other = c->other[k]; other >= 0; other = c->next[other])
        add_real(wide, left, 1, swept(c, width, other), w);
}

/* Moves the wrench to the joint before; stores it if that joint is not the next position. */
INLINE void pass_wrench(const struct refdyn_chain *c, int wide, int planar, int k, double *w) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide);
    if (c->moves[k])
        move_wrench(wide, planar, c->records + k * c->record + at.shift, w);
    if (c->parent[k] != k - 1)
        copy(width * at.left, w, swept(c, width, k));
}

/* Outward, at joint k: z belongs to the joint before. */
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

/* x_k := (x_k - S_k . w - sum of A_km x_m over the turns m after k that share strains) / A_kk; `behind`:
 * their number. */
INLINE void solve_inward(const struct refdyn_chain *c, int wide, int planar, int k, int behind,
                         const double *factors, const double *w, double *x) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide), size = width * refdyn_chain_numbers(c);
    const int pivot_at = (at.left + 2 * at.right) * width;
    const double *pivot = factors + k * size + pivot_at;
    double sum[WIDTH_MOST], y[WIDTH_MOST] = {0};
    chain_dot_real(wide, at.left, c->records + k * c->record, w, sum);
    for (int p = 0; p < width; p++)
        sum[p] = x[k * width + p] - sum[p];
    for (int m = 1; m <= behind; m++)
        subtract_product(wide, 1, pivot + m * size + column_place(wide, m), x + (k + m) * width, sum);
    chain_add(wide, 1, sum, pivot, y);
    copy(width, y, x + k * width);
}

/* x_k -= (Y_k . z + sum of A_kl x_l of turns l before k that share strains) / A_kk */
INLINE void solve_outward(const struct refdyn_chain *c, int wide, int planar, int k, int before,
                          const double *factors, const double *z, double *x) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int width = refdyn_chain_width(wide), size = width * refdyn_chain_numbers(c);
    const double *Y = factors + k * size + at.left * width, *pivot = Y + 2 * at.right * width;
    double sum[WIDTH_MOST], y[WIDTH_MOST] = {0};
    chain_dot(wide, at.right, Y, z, sum);
    for (int l = 1; l <= before; l++)
        chain_add(wide, 1, pivot + row_place(wide, l), x + (k - l) * width, sum);
    chain_add(wide, 1, sum, pivot, y);
    add_real(wide, 1, -1, y, x + k * width);
}

INLINE int solve(const struct refdyn_chain *c, int wide, int planar, const double *factors, double *x) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(planar);
    const int n = c->n, L = at.left, R = at.right, width = refdyn_chain_width(wide);
    const int size = width * refdyn_chain_numbers(c);
    double w[WIDTH_MOST * REFDYN_LEFT_MOST] = {0}, z[WIDTH_MOST * REFDYN_RIGHT_MOST] = {0};
    for (int k = n - 1; k >= 0; k--) {
        const int turns = is_ball(c, planar, k) ? 3 : 1;
        gather_wrench(c, wide, planar, k, w);
        for (int behind = 0; behind < turns; behind++)
            solve_inward(c, wide, planar, k - behind, behind, factors, w, x);
        for (int behind = 0; behind < turns; behind++)
            chain_add(wide, L, x + (k - behind) * width, factors + (k - behind) * size, w);
        k -= turns - 1;
        pass_wrench(c, wide, planar, k, w);
    }
    for (int k = 0; k < n; k++) {
        const int turns = is_ball(c, planar, k + 2) ? 3 : 1;
        take_up(c, wide, planar, k, z);
        for (int before = 0; before < turns; before++)
            solve_outward(c, wide, planar, k + before, before, factors, z, x);
        for (int before = 0; before < turns; before++)
            chain_add(wide, R, x + (k + before) * width, factors + (k + before) * size + (L + R) * width, z);
        k += turns - 1;
        leave(c, width, width * R, k, z);
    }
    return 0;
}

/* ---- Products, separately for each part of a number ---- */

/* y += D x_1 + K x_2 for the off-diagonal entries of turns that share strains. */
INLINE void multiply_strains(const struct refdyn_chain *c, int wide, const double *const x[3], double *y) {
    const int width = refdyn_chain_width(wide);
    for (int k = 2; k < c->n; k++)
        for (int entry = 0; entry < 3 && c->ends_ball[k]; entry++) {
            const int i = entry < 2 ? k : k - 1, before = entry < 2 ? entry + 1 : 1;
            const double *strain = c->strains + i * REFDYN_STRAINS + 3 * (before - 1);
            double *own = y + i * width, *other = y + (i - before) * width;
            if (x[1]) {
                add_real(wide, 1, strain[2], x[1] + (i - before) * width, own);
                add_real(wide, 1, strain[2], x[1] + i * width, other);
            }
            if (x[2]) {
                add_real(wide, 1, strain[0], x[2] + (i - before) * width, own);
                add_real(wide, 1, strain[1], x[2] + i * width, other);
            }
        }
}

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
        if (x[0])
            add_real(wide, 1, c->rotor[k], x[0] + k * width, y + k * width);
        if (x[1])
            add_real(wide, 1, c->damping[k], x[1] + k * width, y + k * width);
        if (x[2])
            add_real(wide, 1, c->stiffness[k], x[2] + k * width, y + k * width);
    }
    if (!planar && c->has_strains)
        multiply_strains(c, wide, x, y);
    return 0;
}

/* ---- Versions with constants for the properties that all joints share ---- */

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
