/*
 * The shortest vector that meets one-sided conditions:
 *     min |x|^2 / 2   subject to   N x >= b,   N (count x n)
 * In the metric of the mass matrix this is an impact of several contacts at once (x: change of rates) and
 * Gauss's principle of least constraint (x: change of accelerations).
 *
 * Takes the normals N and the bounds b of the conditions that take part; returns x and the multipliers p >= 0
 * of x = N^T p. x is unique. Where normals depend on each other, p is not: it is then nonzero for independent
 * normals only. Dual method of Goldfarb and Idnani (Math. Programming 27:1-33, 1983).
 *
 * The method begins with x = 0 and activates the condition that x violates most. Let z be the part of its
 * normal orthogonal to the normals of the active conditions. x moves along z until the condition is met, or
 * until the multiplier of an active condition has fallen to 0, which is then dropped. Each round increases
 * |x|, so that the rounds end.
 */
#include "runtime/core/constraints/constraints.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/linear/linear.h"

enum { ROUNDS_FREE = 50, ROUNDS_EACH = 20 };           /* a safeguard against cycles by rounding */
static const double product_digits = 64 * DBL_EPSILON; /* rounding of a product, over both lengths */
static const double dependent = 1e-9; /* a normal with a smaller independent part depends on the others */

void refdyn_one_sided_lay_out(struct refdyn_one_sided *problem, int count, int n, struct layout *layout) {
    problem->n = n;
    problem->count = count;
    problem->takes_part = layout_ints(layout, count);
    problem->active = layout_ints(layout, count);
    problem->normals = layout_doubles(layout, count * n);
    problem->bounds = layout_doubles(layout, count);
    problem->slack = layout_doubles(layout, count);
    problem->x = layout_doubles(layout, n);
    problem->multipliers = layout_doubles(layout, count);
    problem->basis = layout_doubles(layout, count * n);
    problem->triangle = layout_doubles(layout, count * count);
    problem->share = layout_doubles(layout, count);
    problem->along = layout_doubles(layout, n);
}

static const double *normal_of(const struct refdyn_one_sided *problem, int i) {
    return problem->normals + i * problem->n;
}

/* z = along, the part of normal i beyond the first `size` basis vectors, and its components along these in
 * `share`. Returns |z| over the length of the normal. */
static double split(struct refdyn_one_sided *problem, int i, int size) {
    const int n = problem->n;
    const double *normal = normal_of(problem, i), length = sqrt(dense_dot(normal, normal, n));
    memcpy(problem->along, normal, (size_t)n * sizeof *normal);
    for (int b = 0; b < size; b++)
        problem->share[b] = 0;
    for (int pass = 0; pass < 2; pass++) /* twice against rounding */
        for (int b = 0; b < size; b++) {
            const double part = dense_dot(problem->along, problem->basis + b * n, n);
            problem->share[b] += part;
            dense_add(problem->along, -part, problem->basis + b * n, n);
        }
    return length > 0 ? sqrt(dense_dot(problem->along, problem->along, n)) / length : 0;
}

/* Adds the split normal to the basis. */
static void extend_basis(struct refdyn_one_sided *problem, int size) {
    const int n = problem->n;
    const double length = sqrt(dense_dot(problem->along, problem->along, n));
    for (int j = 0; j < n; j++)
        problem->basis[size * n + j] = problem->along[j] / length;
    memcpy(problem->triangle + size * problem->count, problem->share, (size_t)size * sizeof(double));
    problem->triangle[size * problem->count + size] = length;
}

/* Computes the change of the active conditions' multipliers for a multiplier 1 of the split normal:
 * N_A^T share = normal - z. */
static void solve_shares(struct refdyn_one_sided *problem) {
    for (int a = problem->active_count - 1; a >= 0; a--) {
        problem->share[a] /= problem->triangle[a * problem->count + a];
        for (int b = 0; b < a; b++)
            problem->share[b] -= problem->share[a] * problem->triangle[a * problem->count + b];
    }
}

static void drop(struct refdyn_one_sided *problem, int place) {
    problem->multipliers[problem->active[place]] = 0;
    problem->active_count--;
    for (int a = place; a < problem->active_count; a++) {
        problem->active[a] = problem->active[a + 1];
        split(problem, problem->active[a], a);
        extend_basis(problem, a);
    }
}

/* By how much x violates condition i. */
static double miss(const struct refdyn_one_sided *problem, int i) {
    return problem->bounds[i] - dense_dot(normal_of(problem, i), problem->x, problem->n);
}

static int is_active(const struct refdyn_one_sided *problem, int i) {
    for (int a = 0; a < problem->active_count; a++)
        if (problem->active[a] == i)
            return 1;
    return 0;
}

/* The condition that x violates most, as a distance; -1: x meets all of them. Active conditions are met
 * within the rounding of their products. */
static int find_missed(const struct refdyn_one_sided *problem) {
    const int n = problem->n;
    const double size = sqrt(dense_dot(problem->x, problem->x, n));
    double farthest = 0;
    int worst = -1;
    for (int i = 0; i < problem->count; i++) {
        const double *normal = normal_of(problem, i), length = sqrt(dense_dot(normal, normal, n));
        if (!problem->takes_part[i] || is_active(problem, i))
            continue;
        const double missed = miss(problem, i), far = missed / length;
        if (missed > problem->slack[i] + product_digits * length * size && !(far <= farthest)) {
            farthest = far;
            worst = i;
        }
    }
    return worst;
}

/* The first multiplier that falls to 0 along the shares, and after which part of the way; -1: none. */
static int find_blocking(const struct refdyn_one_sided *problem, double *part) {
    int place = -1;
    *part = INFINITY;
    for (int a = 0; a < problem->active_count; a++) {
        const double left = problem->multipliers[problem->active[a]] / problem->share[a];
        if (problem->share[a] > 0 && left < *part) {
            *part = left;
            place = a;
        }
    }
    return place;
}

static void move(struct refdyn_one_sided *problem, int i, double part) {
    for (int a = 0; a < problem->active_count; a++) {
        double *p = &problem->multipliers[problem->active[a]];
        *p = fmax(*p - part * problem->share[a], 0);
    }
    problem->multipliers[i] += part;
}

/* Activates condition i; others may become inactive. 0: no x can meet it. */
static int take_up(struct refdyn_one_sided *problem, int i) {
    for (;;) {
        const double rest = split(problem, i, problem->active_count);
        const double square = dense_dot(problem->along, problem->along, problem->n);
        const double whole = rest > dependent ? miss(problem, i) / square : INFINITY;
        double part;
        solve_shares(problem);
        const int blocking = find_blocking(problem, &part);
        if (isinf(whole) && blocking < 0)
            return 0;
        const double step = fmin(whole, part);
        if (!isinf(whole))
            dense_add(problem->x, step, problem->along, problem->n);
        move(problem, i, step);
        if (whole <= part)
            break;
        drop(problem, blocking);
    }
    split(problem, i, problem->active_count);
    extend_basis(problem, problem->active_count);
    problem->active[problem->active_count++] = i;
    return 1;
}

static void clear(struct refdyn_one_sided *problem) {
    problem->active_count = 0;
    memset(problem->x, 0, (size_t)problem->n * sizeof *problem->x);
    memset(problem->multipliers, 0, (size_t)problem->count * sizeof *problem->multipliers);
}

int refdyn_one_sided_solve(struct refdyn_one_sided *problem) {
    const int rounds = ROUNDS_FREE + ROUNDS_EACH * problem->count;
    clear(problem);
    for (int round = 0; round < rounds; round++) {
        const int i = find_missed(problem);
        if (i < 0)
            return 1;
        if (!take_up(problem, i))
            return 0;
    }
    return 0;
}

int refdyn_one_sided_meet(struct refdyn_one_sided *problem) {
    clear(problem);
    for (int i = 0; i < problem->count; i++) {
        if (!problem->takes_part[i] || !(split(problem, i, problem->active_count) > dependent))
            continue;
        const double square = dense_dot(problem->along, problem->along, problem->n);
        dense_add(problem->x, miss(problem, i) / square, problem->along, problem->n);
        extend_basis(problem, problem->active_count);
        problem->active[problem->active_count++] = i;
    }
    return problem->active_count;
}
