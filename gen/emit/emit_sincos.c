/*
 * Sines and cosines of the coordinates that are angles: all of a call in one pass, which compilers turn into
 * vector instructions. Takes the function that is printed, gives the range of coordinates, the pass as C
 * text, and its results as entries of two arrays. Angles that are no plain coordinate are left to libm, and
 * so are functions of few angles, where sine and cosine of libm in pairs are as fast.
 *
 * Reduction: W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980, ch. 8, with pi/2 in
 * three parts: 37, 35 and 53 bits, so that the products with multiples below 2^16 are exact in the first two;
 * what the last subtraction rounds away is carried on as `low`. That needs sums which are rounded one by one.
 * Compilers may be allowed to reorder them (-funsafe-math-optimizations, -fassociative-math): each sum that
 * must not be reordered is kept by `rounded`. Where doubles are not rounded to doubles at all, as on the x87
 * unit (FLT_EVAL_METHOD of C11, 5.2.4.2.2), the pass is left to libm. Polynomials: tests/minimax.py, relative
 * error 4e-18 and 5e-20 on |x| <= pi/4. tests/test_sincos.py derives them again and measures the whole: at
 * most 0.82 units in the last place.
 */
#include "emit/emit.h"

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

/* One sum that has to be rounded by itself. */
static void put_sum(struct text *text, const char *model, const char *name, const char *sum) {
    text_add(text, "            const double %s = %s_rounded(%s, ones);\n", name, model, sum);
}

static void put_reduced(const struct emission *x, struct text *text) {
    const char *const name = x->name;
    text_add(text, "    } else if (known) {\n        for (int i = 0; i < %d; i++) {\n", FEWEST_ANGLES);
    put_sum(text, name, "above", "x[i] * 0.6366197723675814 + whole");
    put_sum(text, name, "k", "above - whole");
    put_sum(text, name, "first", "x[i] - k * 1.5707963267923333");
    text_add(text, "            const double second = k * 2.5633441515839558e-12;\n");
    put_sum(text, name, "high", "first - second");
    put_sum(text, name, "lost", "first - high");
    put_sum(text, name, "beyond", "lost - second");
    text_add(text, "            const double rest = k * 1.0562999066987428e-23 - beyond;\n");
    put_sum(text, name, "r", "high - rest");
    put_sum(text, name, "left", "high - r");
    text_add(text, "            const double low = left - rest;\n");
    put_polynomials(text, "r");
    text_add(text, "            const double sin_r = r + ((r * z) * S + low * level);\n"
                   "            const double cos_r = level + (((1.0 - level) - half) + (zz * C - r * low));\n"
                   "            /* k = 2 h + odd, odd = -1, 0 or 1; the sign is that of (-1)^h. */\n");
    put_sum(text, name, "half_k", "0.5 * k + whole");
    put_sum(text, name, "h", "half_k - whole");
    put_sum(text, name, "half_h", "0.5 * h + whole");
    put_sum(text, name, "even_h", "half_h - whole");
    text_add(text, "            const double odd = k - 2.0 * h;\n"
                   "            const double g = h - 2.0 * even_h;\n"
                   "            const double sign = 1.0 - 2.0 * (g * g);\n"
                   "            const double turned = sign * odd;\n"
                   "            const double even = sign - turned * odd;\n"
                   "            s[i] = even * sin_r + turned * cos_r;\n"
                   "            c[i] = even * cos_r - turned * sin_r;\n"
                   "        }\n");
}

/*
 * From version 12 on gcc says whether it may reorder sums; its __builtin_assoc_barrier does not help where it
 * may, since loops that become vectors lose it. clang has an operation for it that costs nothing where sums
 * are not reordered. Elsewhere the bits pass a mask of ones that the compiler does not know.
 */
static void put_rounded(const struct emission *x, struct text *text) {
    text_add(
        text,
        "#ifdef __has_builtin\n#define HAS_BUILTIN(name) __has_builtin(name)\n"
        "#else\n#define HAS_BUILTIN(name) 0\n#endif\n"
        "/* A sum as it is rounded, also where the compiler may reorder sums. */\n"
        "static double %s_rounded(double sum, unsigned long long ones) {\n"
        "#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && !defined(__ASSOCIATIVE_MATH__)\n"
        "    (void)ones;\n"
        "    return sum;\n"
        "#elif HAS_BUILTIN(__arithmetic_fence) && defined(__x86_64__)\n"
        "    (void)ones;\n"
        "    return __arithmetic_fence(sum);\n"
        "#else\n"
        "    unsigned long long bits;\n"
        "    memcpy(&bits, &sum, sizeof bits);\n"
        "    bits &= ones;\n"
        "    memcpy(&sum, &bits, sizeof bits);\n"
        "    return sum;\n"
        "#endif\n}\n#undef HAS_BUILTIN\n\n",
        x->name);
}

static void put_libm(const struct emission *x, struct text *text) {
    text_add(text,
             "static void %s_sincos_libm(const double *angle, double *sine, double *cosine) {\n"
             "    for (int i = 0; i < %d; i++) {\n"
             "        const double x = angle[i];\n"
             "        sine[i] = sin(x);\n        cosine[i] = cos(x);\n    }\n}\n\n",
             x->name, FEWEST_ANGLES);
}

/* Flags as wide as the angles, and one array written after the other, are vectors without further ado. */
static void put_block(const struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
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
        "    const volatile unsigned long long mask = ~0ULL; /* volatile: not known while this is compiled "
        "*/\n"
        "    const unsigned long long ones = mask;\n"
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
    put_reduced(x, text);
    text_add(text,
             "    } else {\n        %s_sincos_libm(angle, sine, cosine);\n        return;\n    }\n"
             "    for (int i = 0; i < %d; i++)\n        sine[i] = s[i];\n"
             "    for (int i = 0; i < %d; i++)\n        cosine[i] = c[i];\n}\n",
             x->name, n, n);
}

/* FLT_EVAL_METHOD is 0 where doubles are rounded to doubles, and 1 or 16 where that holds for all but
 * narrower types. */
static void put_pass(const struct emission *x, struct text *text) {
    text_add(text,
             "#if defined(__FLT_EVAL_METHOD__) && \\\n"
             "    (__FLT_EVAL_METHOD__ == 0 || __FLT_EVAL_METHOD__ == 1 || __FLT_EVAL_METHOD__ == 16)\n");
    put_rounded(x, text);
    put_block(x, text);
    text_add(text,
             "#else /* sums may be kept longer than doubles */\n"
             "static void %s_sincos_%d(const double *angle, double *sine, double *cosine) {\n"
             "    %s_sincos_libm(angle, sine, cosine);\n}\n#endif\n\n",
             x->name, FEWEST_ANGLES, x->name);
}

void emit_sincos(struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
    if (x->has_sincos)
        return;
    x->has_sincos = true;
    text_add(text, "#ifndef REFDYN_GENERATED_%s_SINCOS /* parts may be compiled as one */\n", x->name);
    text_add(text, "#define REFDYN_GENERATED_%s_SINCOS\n", x->name);
    put_libm(x, text);
    put_pass(x, text);
    text_add(text,
             "/* Of `count` angles, %d at the least; the last block may overlap the one before. */\n"
             "static void %s_sincos(const double *angle, double *sine, double *cosine, int count) {\n"
             "    for (int i = 0; i < count - %d; i += %d)\n"
             "        %s_sincos_%d(angle + i, sine + i, cosine + i);\n"
             "    %s_sincos_%d(angle + count - %d, sine + count - %d, cosine + count - %d);\n}\n#endif\n\n",
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
    if (!angles_is_in_pass(x->plan, x->function, e))
        return false;
    const struct node *node = &x->g->nodes[e];
    const struct symbol *s = expr_as_symbol(x->g, node->operand[0]);
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
