/*
 * The solution of M x = f with M written out: M = L^T D L, then substitutions (theory, sect. 5.7;
 * Featherstone, Rigid Body Dynamics Algorithms, 2008, sect. 6.5).
 *
 * Input: M and right sides f. Result: x. M_ij is zero unless one of both joints carries the other. The
 * factorisation proceeds from the tips inward, so that L has no entry where M has none. For trees without
 * loops over equal elements.
 */
#include "gen/dynamics/dynamics.h"
#include "gen/base/base.h"

#include <string.h>

struct factors {
    const struct kinematics *k;
    expression *L;         /* n x n, L_ij for j nearer to the ground; its diagonal of ones is not stored */
    expression *D_inverse; /* by coordinate */
};

static int parent_of(const struct factors *x, int i) {
    return x->k->tree->frames[i].parent;
}

/* 1 / D_i = 1 / M_ii, L_ij = M_ij / D_i, M_jl -= L_ij M_il for j, l on the way from i to the ground. */
static void eliminate_row(struct factors *x, expression *M, int i) {
    struct graph *g = x->k->g;
    const int n = x->k->tree->count;
    x->D_inverse[i] = expr_div(g, expr_one(g), M[i * n + i]);
    kinematics_name_scalar(x->k, i, "pivot_inverse", x->D_inverse[i]);
    for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j)) {
        const expression ratio = x->L[i * n + j] = expr_mul(g, M[i * n + j], x->D_inverse[i]);
        for (int l = j; l >= 0; l = parent_of(x, l))
            M[j * n + l] = expr_sub(g, M[j * n + l], expr_mul(g, ratio, M[i * n + l]));
    }
}

struct factors *mass_factor(const struct kinematics *k, const expression *mass_matrix) {
    const size_t n = (size_t)k->tree->count, size = n * n * sizeof(expression);
    struct factors *x = memory_get(k->memory, sizeof *x);
    x->k = k;
    x->L = memory_get(k->memory, size + sizeof *x->L);
    x->D_inverse = memory_get(k->memory, (n + 1) * sizeof *x->D_inverse);
    expression *rest = memory_grow(k->memory, mass_matrix, size, size + sizeof *rest);
    for (int i = k->tree->count - 1; i >= 0; i--) {
        kinematics_remark(k, i, "its row of M = L^T D L (5.7)");
        eliminate_row(x, rest, i);
    }
    return x;
}

/* y = L^-T f and z = D^-1 y inward, x = L^-1 z outward. */
expression *mass_factor_solve(const struct factors *x, const expression *f) {
    struct graph *g = x->k->g;
    const int n = x->k->tree->count;
    const size_t size = (size_t)n * sizeof *f;
    expression *solution = memory_grow(x->k->memory, f, size, size + sizeof *f);
    graph_remark(g, "L^T D L x = f (5.7)");
    for (int i = n - 1; i >= 0; i--) {
        for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j))
            solution[j] = expr_sub(g, solution[j], expr_mul(g, x->L[i * n + j], solution[i]));
        solution[i] = expr_mul(g, x->D_inverse[i], solution[i]);
    }
    for (int i = 0; i < n; i++)
        for (int j = parent_of(x, i); j >= 0; j = parent_of(x, j))
            solution[i] = expr_sub(g, solution[i], expr_mul(g, x->L[i * n + j], solution[j]));
    return solution;
}

long mass_factor_operations(const struct tree *tree) {
    long operations = 0;
    for (int i = 0; i < tree->count; i++) {
        long depth = 0;
        for (int j = tree->frames[i].parent; j >= 0; j = tree->frames[j].parent)
            depth++;
        operations += depth * (depth + 1);
    }
    return operations;
}
