/* Courses and sections: see vocabulary.h. Round sections: A = pi d^2 / 4, Iy = Iz = pi d^4 / 64, It = pi d^4
 * / 32. */
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
