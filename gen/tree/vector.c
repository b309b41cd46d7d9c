/*
 * The algebra of 3-vectors, rotations and inertia tensors of expressions, for kinematics and dynamics.
 * Everything folds in the graph, so that a zero component costs nothing.
 */
#include "gen/tree/tree.h"

#include <string.h>

struct vector vector_of(const expression at[3]) {
    return (struct vector){{at[0], at[1], at[2]}};
}

struct vector vector_unit(int axis) {
    struct vector e = {{0, 0, 0}};
    e.at[axis] = EXPR_ONE;
    return e;
}

struct vector vector_add(struct graph *g, struct vector a, struct vector b) {
    for (int i = 0; i < 3; i++)
        a.at[i] = expr_add(g, a.at[i], b.at[i]);
    return a;
}

struct vector vector_sub(struct graph *g, struct vector a, struct vector b) {
    for (int i = 0; i < 3; i++)
        a.at[i] = expr_sub(g, a.at[i], b.at[i]);
    return a;
}

struct vector vector_scale(struct graph *g, expression s, struct vector a) {
    for (int i = 0; i < 3; i++)
        a.at[i] = expr_mul(g, s, a.at[i]);
    return a;
}

struct vector vector_cross(struct graph *g, struct vector a, struct vector b) {
    struct vector c;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        c.at[i] = expr_sub(g, expr_mul(g, a.at[j], b.at[k]), expr_mul(g, a.at[k], b.at[j]));
    }
    return c;
}

expression vector_dot(struct graph *g, struct vector a, struct vector b) {
    expression sum = 0;
    for (int i = 0; i < 3; i++)
        sum = expr_add(g, sum, expr_mul(g, a.at[i], b.at[i]));
    return sum;
}

bool vector_is_zero(struct vector a) {
    return !a.at[0] && !a.at[1] && !a.at[2];
}

struct vector matrix_times(struct graph *g, const expression matrix[9], struct vector a) {
    struct vector b;
    for (int i = 0; i < 3; i++)
        b.at[i] = vector_dot(g, vector_of(matrix + 3 * i), a);
    return b;
}

struct vector matrix_transpose_times(struct graph *g, const expression matrix[9], struct vector a) {
    struct vector b;
    for (int i = 0; i < 3; i++)
        b.at[i] = vector_dot(g, (struct vector){{matrix[i], matrix[3 + i], matrix[6 + i]}}, a);
    return b;
}

struct matrix matrix_product(struct graph *g, const expression a[9], const expression b[9]) {
    struct matrix c;
    for (int j = 0; j < 3; j++) {
        struct vector column = matrix_times(g, a, (struct vector){{b[j], b[3 + j], b[6 + j]}});
        for (int i = 0; i < 3; i++)
            c.at[3 * i + j] = column.at[i];
    }
    return c;
}

int tensor_index(int row, int column) {
    return row == column ? row : row + column + 2;
}

struct vector tensor_times(struct graph *g, struct tensor t, struct vector a) {
    struct vector b = {{0, 0, 0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            b.at[i] = expr_add(g, b.at[i], expr_mul(g, t.at[tensor_index(i, j)], a.at[j]));
    return b;
}

struct tensor tensor_add(struct graph *g, struct tensor a, struct tensor b) {
    for (int i = 0; i < 6; i++)
        a.at[i] = expr_add(g, a.at[i], b.at[i]);
    return a;
}

struct tensor tensor_turn(struct graph *g, const expression rotation[9], struct tensor t) {
    struct tensor turned;
    struct vector half[3]; /* rows of R T */
    for (int i = 0; i < 3; i++)
        half[i] = tensor_times(g, t, vector_of(rotation + 3 * i));
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            turned.at[tensor_index(i, j)] = vector_dot(g, half[i], vector_of(rotation + 3 * j));
    return turned;
}

/*
 * The increase of an inertia when its reference point moves by r (Steiner, both points off the centre), from
 * the moments before, mc, and after, mc + m r: 2 (r.d) 1 - r d^T - d r^T with d = mc + m r / 2.
 */
static struct tensor shift_increase(struct graph *g, struct vector r, struct vector before,
                                    struct vector after) {
    struct tensor t;
    const struct vector sum = vector_add(g, before, after);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        t.at[i] = expr_add(g, expr_mul(g, r.at[j], sum.at[j]), expr_mul(g, r.at[k], sum.at[k]));
        t.at[tensor_index(j, k)] =
            expr_neg(g, expr_add(g, expr_mul(g, r.at[j], before.at[k]), expr_mul(g, r.at[k], after.at[j])));
    }
    return t;
}

struct placement placement_identity(void) {
    return (struct placement){.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

struct placement placement_shift_x(expression distance) {
    struct placement p = placement_identity();
    p.position[0] = distance;
    return p;
}

struct placement placement_compose(struct graph *g, const struct placement *outer,
                                   const struct placement *inner) {
    struct placement p;
    const struct matrix rotation = matrix_product(g, outer->rotation, inner->rotation);
    const struct vector shift = matrix_times(g, outer->rotation, vector_of(inner->position));
    const struct vector position = vector_add(g, vector_of(outer->position), shift);
    memcpy(p.rotation, rotation.at, sizeof p.rotation);
    memcpy(p.position, position.at, sizeof p.position);
    return p;
}

struct inertia inertia_place(struct graph *g, const struct placement *placement, struct inertia inner) {
    const struct vector r = vector_of(placement->position);
    const struct vector moment = matrix_times(g, placement->rotation, inner.moment);
    const struct vector shifted = vector_add(g, moment, vector_scale(g, inner.mass, r));
    const struct tensor turned = tensor_turn(g, placement->rotation, inner.tensor);
    return (struct inertia){.mass = inner.mass,
                            .moment = shifted,
                            .tensor = tensor_add(g, turned, shift_increase(g, r, moment, shifted))};
}

struct inertia inertia_add(struct graph *g, struct inertia a, struct inertia b) {
    a.mass = expr_add(g, a.mass, b.mass);
    a.moment = vector_add(g, a.moment, b.moment);
    a.tensor = tensor_add(g, a.tensor, b.tensor);
    return a;
}

bool inertia_is_zero(const struct inertia *inertia) {
    bool is_zero = !inertia->mass;
    for (int i = 0; i < 6; i++)
        is_zero = is_zero && !inertia->tensor.at[i] && !inertia->moment.at[i / 2];
    return is_zero;
}
