/*
 * Courses and sections: see reader.h. Round sections: A = pi d^2 / 4, Iy = Iz = pi d^4 / 64, It = pi d^4
 * /
 * 32. Torsion of a rectangle a >= b (Timoshenko and Goodier, Theory of Elasticity, sect. 109):
 * It = a b^3 / 3 (1 - 192 b / (pi^5 a) sum over odd n of tanh(n pi a / 2b) / n^5).
 */
#include "gen/read/reader.h"

static const double pi = 3.14159265358979323846;

/* (t - t0) / (t1 - t0), kept between 0 and 1. */
static expression clamped(struct graph *g, expression t, expression t0, expression t1) {
    expression part = expr_div(g, expr_sub(g, t, t0), expr_sub(g, t1, t0));
    return expr_apply2(g, OP_MIN, expr_apply2(g, OP_MAX, part, expr_zero(g)), expr_one(g));
}

expression vocabulary_ramp(struct graph *g, expression t, expression t0, expression t1) {
    expression angle = expr_mul(g, expr_number(g, pi), clamped(g, t, t0, t1));
    return expr_mul(g, expr_number(g, 0.5), expr_sub(g, expr_one(g), expr_apply1(g, OP_COS, angle)));
}

expression vocabulary_smoothstep(struct graph *g, expression t, expression t0, expression t1) {
    expression c = clamped(g, t, t0, t1);
    expression rest = expr_sub(g, expr_number(g, 3), expr_mul(g, expr_number(g, 2), c));
    return expr_mul(g, expr_mul(g, c, c), rest);
}

struct section vocabulary_tube_section(struct graph *g, expression outer, expression inner) {
    expression outer2 = expr_mul(g, outer, outer), inner2 = expr_mul(g, inner, inner);
    expression squares = expr_sub(g, outer2, inner2);
    expression fourths = expr_sub(g, expr_mul(g, outer2, outer2), expr_mul(g, inner2, inner2));
    expression bending = expr_mul(g, expr_number(g, pi / 64), fourths);
    return (struct section){.area = expr_mul(g, expr_number(g, pi / 4), squares),
                            .Iy = bending,
                            .Iz = bending,
                            .It = expr_mul(g, expr_number(g, pi / 32), fourths)};
}

struct section vocabulary_round_section(struct graph *g, expression diameter) {
    return vocabulary_tube_section(g, diameter, expr_zero(g));
}

/* The terms from n = 7 on have a tanh of 1 but for 6e-10: their sum is that of 1 / n^5, 31/32 zeta(5),
 * without three. */
static expression torsion_sum(struct graph *g, expression slenderness) {
    const double all = 1.0045237627951383, without = all - 1 - 1 / 243.0 - 1 / 3125.0;
    const expression half_turn = expr_mul(g, expr_number(g, pi / 2), slenderness);
    const expression first = expr_apply1(g, OP_TANH, half_turn);
    const expression third = expr_apply1(g, OP_TANH, expr_mul(g, expr_number(g, 3), half_turn));
    const expression fifth = expr_apply1(g, OP_TANH, expr_mul(g, expr_number(g, 5), half_turn));
    const expression early = expr_add(g, first, expr_div(g, third, expr_number(g, 243)));
    return expr_add(g, expr_add(g, early, expr_div(g, fifth, expr_number(g, 3125))), expr_number(g, without));
}

struct section vocabulary_rectangle_section(struct graph *g, expression width_y, expression height_z) {
    const double pi5 = pi * pi * pi * pi * pi;
    const expression area = expr_mul(g, width_y, height_z), twelfth = expr_number(g, 1.0 / 12);
    const expression a = expr_apply2(g, OP_MAX, width_y, height_z),
                     b = expr_apply2(g, OP_MIN, width_y, height_z);
    const expression lack = expr_mul(g, expr_mul(g, expr_number(g, 192 / pi5), expr_div(g, b, a)),
                                     torsion_sum(g, expr_div(g, a, b)));
    const expression third = expr_div(g, expr_mul(g, area, expr_mul(g, b, b)), expr_number(g, 3));
    return (struct section){.area = area,
                            .Iy = expr_mul(g, twelfth, expr_mul(g, area, expr_mul(g, height_z, height_z))),
                            .Iz = expr_mul(g, twelfth, expr_mul(g, area, expr_mul(g, width_y, width_y))),
                            .It = expr_mul(g, third, expr_sub(g, expr_one(g), lack))};
}

expression vocabulary_friction(struct graph *g, expression level, expression rate, expression width) {
    return expr_neg(g, expr_mul(g, level, expr_apply1(g, OP_TANH, expr_div(g, rate, width))));
}
