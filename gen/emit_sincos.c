/*
 * Sines and cosines of the coordinates that are angles: all of a call in one pass, which compilers turn into
 * vector instructions. Takes the function that is printed, gives the range of coordinates, the pass as C
 * text, and its results as entries of two arrays. Angles that are no plain coordinate are left to libm, and
 * so are functions of few angles, where sine and cosine of libm in pairs are as fast.
 *
 * Reduction: W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980, ch. 8, with pi/2 in
 * three parts: 37, 35 and 53 bits, so that the products with multiples below 2^16 are exact in the first two;
 * what the last subtraction rounds away is carried on as `low`. Polynomials: tests/minimax.py, relative error
 * 4e-18 and 5e-20 on |x| <= pi/4. tests/test_sincos.py derives them again and measures the whole: at most
 * 0.82 units in the last place.
 */
#include "emit.h"

enum { LARGEST = 100000 }; /* [rad] beyond, and for what is no number, libm is asked */

/* S and C of z = r r: sin r = r + r z S, cos r = 1 - z / 2 + z z C. */
static void put_polynomials(struct text *text, const char *r) {
    text_add(text, "            const double z = %s * %s, zz = z * z, half = 0.5 * z, level = 1.0 - half;\n",
             r, r);
    text_add(text, "            const double S = (-0.1666666666666663 + z * 0.008333333333322113) +\n"
                   "                zz * ((-0.00019841269829584855 + z * 2.7557313619702316e-06) +\n"
                   "                zz * (-2.5050747490622132e-08 + z * 1.5896213900738014e-10));\n"
                   "            const double C = (0.0416666666666666 - z * 0.0013888888888874131) +\n"
                   "                zz * ((2.4801587289487026e-05 - z * 2.755731435379326e-07) +\n"
                   "                zz * (2.0875723479646543e-09 - z * 1.135965887716259e-11));\n");
}

/* Angles within an eighth of a turn, as those of bending mostly are, need no reduction. */
static void put_small(struct text *text) {
    text_add(text, "    if (small) {\n        for (int i = 0; i < %d; i++) {\n", FEWEST_ANGLES);
    put_polynomials(text, "x[i]");
    text_add(text, "            s[i] = x[i] + (x[i] * z) * S;\n"
                   "            c[i] = level + (((1.0 - level) - half) + zz * C);\n        }\n");
}

static void put_reduced(struct text *text) {
    text_add(text,
             "    } else if (known) {\n        for (int i = 0; i < %d; i++) {\n"
             "            const double k = (x[i] * 0.6366197723675814 + whole) - whole;\n"
             "            const double first = x[i] - k * 1.5707963267923333;\n"
             "            const double second = k * 2.5633441515839558e-12;\n"
             "            const double high = first - second;\n"
             "            const double rest = k * 1.0562999066987428e-23 - ((first - high) - second);\n"
             "            const double r = high - rest, low = (high - r) - rest;\n",
             FEWEST_ANGLES);
    put_polynomials(text, "r");
    text_add(text, "            const double sin_r = r + ((r * z) * S + low * level);\n"
                   "            const double cos_r = level + (((1.0 - level) - half) + (zz * C - r * low));\n"
                   "            /* k = 2 h + odd, odd = -1, 0 or 1; the sign is that of (-1)^h. */\n"
                   "            const double h = (0.5 * k + whole) - whole;\n"
                   "            const double odd = k - 2.0 * h;\n"
                   "            const double g = h - 2.0 * ((0.5 * h + whole) - whole);\n"
                   "            const double sign = 1.0 - 2.0 * (g * g);\n"
                   "            const double turned = sign * odd;\n"
                   "            const double even = sign - turned * odd;\n"
                   "            s[i] = even * sin_r + turned * cos_r;\n"
                   "            c[i] = even * cos_r - turned * sin_r;\n"
                   "        }\n");
}

/* Flags as wide as the angles, and one array written after the other, are vectors without further ado. */
static void put_block(const struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
    text_add(text,
             "static void %s_sincos_libm(const double *angle, double *sine, double *cosine) {\n"
             "    for (int i = 0; i < %d; i++) {\n"
             "        const double x = angle[i];\n"
             "        sine[i] = sin(x);\n        cosine[i] = cos(x);\n    }\n}\n\n",
             x->name, n);
    text_add(text,
             "/* Sines and cosines of %d angles up to %d rad: x = k pi/2 + r, and two polynomials of r, "
             "minimax on\n"
             "   |r| <= pi/4; error at most 0.82 units in the last place. Beyond, and for what is no number, "
             "libm's. */\n"
             "static void %s_sincos_%d(const double *angle, double *sine, double *cosine) {\n",
             n, LARGEST, x->name, n);
    text_add(
        text,
        "    const double whole = 6755399441055744.0; /* 1.5 2^52: beside it only whole numbers exist */\n"
        "    double x[%d], s[%d], c[%d];\n"
        "    long long small = 1, known = 1;\n"
        "    for (int i = 0; i < %d; i++)\n"
        "        x[i] = angle[i];\n"
        "    for (int i = 0; i < %d; i++) {\n"
        "        small &= fabs(x[i]) <= 0.785;\n"
        "        known &= fabs(x[i]) <= %d.0;\n"
        "    }\n",
        n, n, n, n, n, LARGEST);
    put_small(text);
    put_reduced(text);
    text_add(text,
             "    } else {\n        %s_sincos_libm(angle, sine, cosine);\n        return;\n    }\n"
             "    for (int i = 0; i < %d; i++)\n        sine[i] = s[i];\n"
             "    for (int i = 0; i < %d; i++)\n        cosine[i] = c[i];\n}\n\n",
             x->name, n, n);
}

void emit_sincos(struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
    if (x->has_sincos)
        return;
    x->has_sincos = true;
    put_block(x, text);
    text_add(text,
             "/* Of `count` angles, %d at the least; the last block may overlap the one before. */\n"
             "static void %s_sincos(const double *angle, double *sine, double *cosine, int count) {\n"
             "    for (int i = 0; i < count - %d; i += %d)\n"
             "        %s_sincos_%d(angle + i, sine + i, cosine + i);\n"
             "    %s_sincos_%d(angle + count - %d, sine + count - %d, cosine + count - %d);\n}\n\n",
             n, x->name, n, n, x->name, n, x->name, n, n, n, n);
}

void emit_angle_arrays(const struct emission *x, struct text *text) {
    if (x->function->angle_count)
        text_add(text, "    double sine[%d], cosine[%d];\n", x->function->angle_count,
                 x->function->angle_count);
}

void emit_angle_pass(const struct emission *x, struct text *text) {
    const char *within = x->is_cut ? "s." : "";
    if (x->function->angle_count)
        text_add(text, "    %s_sincos(q + %d, %ssine, %scosine, %d);\n", x->name, x->function->first_angle,
                 within, within, x->function->angle_count);
}

bool emit_angle(struct emission *x, struct text *text, expression e) {
    if (!is_in_pass(x->plan, x->function, e))
        return false;
    const struct node *node = &x->g->nodes[e];
    const struct symbol *s = as_symbol(x->g, node->operand[0]);
    const struct frame *frame = s->kind == SYMBOL_ELEMENT ? &x->plan->rolled->frames[s->index] : NULL;
    x->uses_carried |= x->is_cut;
    text_add(text, "%s%s[", x->is_cut ? "s->" : "", node->operation == OP_SIN ? "sine" : "cosine");
    if (frame)
        emit_run_index(text, frame->coordinate - x->function->first_angle, frame->step);
    else
        text_add(text, "%d", s->index - x->function->first_angle);
    text_add(text, "]");
    return true;
}
