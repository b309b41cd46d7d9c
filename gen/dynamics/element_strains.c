/* Springs and dampers of an element's three turns in a symmetric form (theory, sect. 3.4). */
#include "gen/dynamics/dynamics.h"

#include "gen/graph/graph.h"

/* sign_a e, of w_a = q_a + sign_a q_b q_c / 2 */
static expression with_sign(struct graph *g, int a, expression e) {
    return a == 1 ? e : expr_neg(g, e);
}

static expression half_of(struct graph *g, expression e) {
    return expr_mul(g, expr_number(g, 0.5), e);
}

bool element_strains_has(const struct kinematics *k, int i) {
    return k->tree->frames[i].has_strains;
}

int element_strains_first(const struct kinematics *k, int i) {
    return i - k->tree->frames[i].turn;
}

static const struct joint *joint_of(const struct kinematics *k, int first, int turn) {
    return &k->tree->frames[first + turn].joint;
}

static expression turn_of(const struct kinematics *k, int first, int turn, int order) {
    return kinematics_coordinate_of(k, first + turn, order);
}

/* dw_a/dq_b = sign_a q_c / 2 for three turns a, b, c; 1 for a = b. */
static expression strain_by_turn(const struct kinematics *k, int first, int a, int b) {
    if (a == b)
        return expr_one(k->g);
    return with_sign(k->g, a, half_of(k->g, turn_of(k, first, 3 - a - b, 0)));
}

/* q_a + sign_a q_b q_c / 2 of any three values. */
static expression strain_of(struct graph *g, const expression q[3], int a) {
    const expression product = expr_mul(g, half_of(g, q[(a + 1) % 3]), q[(a + 2) % 3]);
    return expr_add(g, q[a], with_sign(g, a, product));
}

/* w - w_rest */
static expression strain(const struct kinematics *k, int first, int a) {
    expression q[3], rest[3];
    for (int turn = 0; turn < 3; turn++) {
        q[turn] = turn_of(k, first, turn, 0);
        rest[turn] = joint_of(k, first, turn)->rest;
    }
    return expr_sub(k->g, strain_of(k->g, q, a), strain_of(k->g, rest, a));
}

/* J qd */
static expression strain_rate(const struct kinematics *k, int first, int a) {
    expression rate = 0;
    for (int b = 0; b < 3; b++)
        rate = expr_add(k->g, rate, expr_mul(k->g, strain_by_turn(k, first, a, b), turn_of(k, first, b, 1)));
    return rate;
}

/* S (w - w_rest), D J qd, or their sum. */
static expression strain_moment(const struct kinematics *k, int first, int a, enum strain_part part) {
    const struct joint *joint = joint_of(k, first, a);
    expression moment = 0;
    if (part & STRAIN_ELASTIC)
        moment = expr_mul(k->g, joint->stiffness, strain(k, first, a));
    if (part & STRAIN_VISCOUS)
        moment = expr_add(k->g, moment, expr_mul(k->g, joint->damping, strain_rate(k, first, a)));
    return moment;
}

expression element_strains_force(const struct kinematics *k, int i, enum strain_part part) {
    const int first = element_strains_first(k, i), b = i - first;
    expression force = 0;
    for (int a = 0; a < 3; a++)
        force = expr_add(k->g, force,
                         expr_mul(k->g, strain_by_turn(k, first, a, b), strain_moment(k, first, a, part)));
    return expr_neg(k->g, force);
}

expression element_strains_energy(const struct kinematics *k, int i) {
    const int first = element_strains_first(k, i), a = i - first;
    const expression w = strain(k, first, a);
    return expr_mul(k->g, half_of(k->g, joint_of(k, first, a)->stiffness), expr_mul(k->g, w, w));
}

void element_strains_derivatives(const struct kinematics *k, int i, int order, bool is_resting,
                                 expression by_turn[3]) {
    const int first = element_strains_first(k, i);
    const enum strain_part part = order == 0 && is_resting ? STRAIN_ELASTIC : STRAIN_BOTH;
    expression by[3];
    for (int turn = 0; turn < 3; turn++)
        by[turn] = turn_of(k, first, turn, order);
    rewrite_gradient(k->g, element_strains_force(k, i, part), by, by_turn, 3);
}
