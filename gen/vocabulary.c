/*
 * Courses and sections: see vocabulary.h. Round sections: A = pi d^2 / 4, Iy = Iz = pi d^4 / 64, It = pi d^4
 * /
 * 32. Torsion of a rectangle a >= b (Timoshenko and Goodier, Theory of Elasticity, sect. 109):
 * It = a b^3 / 3 (1 - 192 b / (pi^5 a) sum over odd n of tanh(n pi a / 2b) / n^5).
 */
#include "vocabulary.h"

static const double pi = 3.14159265358979323846;

/* (t - t0) / (t1 - t0), kept between 0 and 1. */
static expression clamped(struct graph *g, expression t, expression t0, expression t1) {
    expression part = quotient(g, sub(g, t, t0), sub(g, t1, t0));
    return apply2(g, OP_MIN, apply2(g, OP_MAX, part, zero(g)), one(g));
}

expression ramp(struct graph *g, expression t, expression t0, expression t1) {
    expression angle = mul(g, number(g, pi), clamped(g, t, t0, t1));
    return mul(g, number(g, 0.5), sub(g, one(g), apply1(g, OP_COS, angle)));
}

expression smoothstep(struct graph *g, expression t, expression t0, expression t1) {
    expression c = clamped(g, t, t0, t1);
    expression rest = sub(g, number(g, 3), mul(g, number(g, 2), c));
    return mul(g, mul(g, c, c), rest);
}

struct section tube_section(struct graph *g, expression outer, expression inner) {
    expression outer2 = mul(g, outer, outer), inner2 = mul(g, inner, inner);
    expression squares = sub(g, outer2, inner2);
    expression fourths = sub(g, mul(g, outer2, outer2), mul(g, inner2, inner2));
    expression bending = mul(g, number(g, pi / 64), fourths);
    return (struct section){.area = mul(g, number(g, pi / 4), squares),
                            .Iy = bending,
                            .Iz = bending,
                            .It = mul(g, number(g, pi / 32), fourths)};
}

struct section round_section(struct graph *g, expression diameter) {
    return tube_section(g, diameter, zero(g));
}

/* The terms from n = 7 on have a tanh of 1 but for 6e-10: their sum is that of 1 / n^5, 31/32 zeta(5),
 * without three. */
static expression torsion_sum(struct graph *g, expression slenderness) {
    const double all = 1.0045237627951383, without = all - 1 - 1 / 243.0 - 1 / 3125.0;
    const expression half_turn = mul(g, number(g, pi / 2), slenderness);
    const expression first = apply1(g, OP_TANH, half_turn);
    const expression third = apply1(g, OP_TANH, mul(g, number(g, 3), half_turn));
    const expression fifth = apply1(g, OP_TANH, mul(g, number(g, 5), half_turn));
    const expression early = add(g, first, quotient(g, third, number(g, 243)));
    return add(g, add(g, early, quotient(g, fifth, number(g, 3125))), number(g, without));
}

struct section rectangle_section(struct graph *g, expression width_y, expression height_z) {
    const double pi5 = pi * pi * pi * pi * pi;
    const expression area = mul(g, width_y, height_z), twelfth = number(g, 1.0 / 12);
    const expression a = apply2(g, OP_MAX, width_y, height_z), b = apply2(g, OP_MIN, width_y, height_z);
    const expression lack =
        mul(g, mul(g, number(g, 192 / pi5), quotient(g, b, a)), torsion_sum(g, quotient(g, a, b)));
    const expression third = quotient(g, mul(g, area, mul(g, b, b)), number(g, 3));
    return (struct section){.area = area,
                            .Iy = mul(g, twelfth, mul(g, area, mul(g, height_z, height_z))),
                            .Iz = mul(g, twelfth, mul(g, area, mul(g, width_y, width_y))),
                            .It = mul(g, third, sub(g, one(g), lack))};
}

expression friction(struct graph *g, expression level, expression rate, expression width) {
    return neg(g, mul(g, level, apply1(g, OP_TANH, quotient(g, rate, width))));
}
