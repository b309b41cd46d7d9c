/*
 * Sines and cosines of the coordinates that are angles: all angles of a call in one pass, which compilers
 * turn into vector instructions. Input: the current function. Output: the range of coordinates, the pass as C
 * text, and its results as entries of two arrays. Angles other than a plain coordinate use libm. Functions of
 * few angles do so, too, because libm is as fast there for pairs of sine and cosine.
 *
 * Reduction: W. J. Cody and W. Waite, Software Manual for the Elementary Functions, 1980, ch. 8, with pi/2 in
 * three parts: 37, 35 and 53 bits, so that the products of the first two with multiples below 2^16 are exact;
 * the rounding error of the last subtraction is carried on as `low`. This requires sums that are rounded one
 * by one. Compilers may be allowed to reorder sums (-funsafe-math-optimizations, -fassociative-math):
 * `rounded` protects each sum that must keep its order. Where doubles are not rounded to doubles at all, as
 * on the x87 unit (FLT_EVAL_METHOD of C11, 5.2.4.2.2), libm replaces the pass. tcc does not define the macro;
 * on x86-64 it rounds doubles to doubles.
 *
 * Polynomials: tests/minimax.py, relative error 4e-18 and 5e-20 on |x| <= pi/4. tests/test_sincos.py derives
 * them again and measures the total error: at most 0.82 units in the last place.
 */
#include "gen/emit/emit.h"

enum { LARGEST = 100000 }; /* [rad] larger angles, and values that are not numbers, use libm */

/* The texts that differ between a loop over a block of angles and a single vector of lanes. */
struct form {
    const char *name, *number, *indent, *angle;
};

/* FLT_EVAL_METHOD is 0 if doubles are rounded to doubles, and 1 or 16 if that is true for all but narrower
 * types. */
static const char rounds_to_doubles[] =
    "#if (defined(__TINYC__) && defined(__x86_64__)) || defined(__FLT_EVAL_METHOD__) && \\\n"
    "    (__FLT_EVAL_METHOD__ == 0 || __FLT_EVAL_METHOD__ == 1 || __FLT_EVAL_METHOD__ == 16)\n";

static void put_line(struct text *text, const struct form *form, const char *line) {
    text_add(text, "%s%s\n", form->indent, line);
}

static void put_opening(struct text *text, const struct form *form, const char *value) {
    text_add(text, "%sconst %s %s\n", form->indent, form->number, value);
}

static void put_value(struct text *text, const struct form *form, const char *value) {
    text_add(text, "%sconst %s %s;\n", form->indent, form->number, value);
}

/* S and C of z = r r: sin r = r + r z S, cos r = 1 - z / 2 + z z C. */
static void put_polynomials(struct text *text, const struct form *form, const char *r) {
    text_add(text, "%sconst %s z = %s * %s, zz = z * z, half = 0.5 * z, level = 1.0 - half;\n", form->indent,
             form->number, r, r);
    put_opening(text, form, "S = (-0.1666666666666663 + z * 0.008333333333322113) +");
    put_line(text, form, "    zz * ((-0.00019841269829584855 + z * 2.7557313619702316e-06) +");
    put_line(text, form, "    zz * (-2.5050747490622132e-08 + z * 1.5896213900738014e-10));");
    put_opening(text, form, "C = (0.0416666666666666 - z * 0.0013888888888874131) +");
    put_line(text, form, "    zz * ((2.4801587289487026e-05 - z * 2.755731435379326e-07) +");
    put_line(text, form, "    zz * (2.0875723479646543e-09 - z * 1.135965887716259e-11));");
}

/* Angles within an eighth of a turn, as most angles of bending are, need no reduction. */
static void put_small(struct text *text, const struct form *form) {
    text_add(text, "    if (small) {\n        for (int i = 0; i < %d; i++) {\n", FEWEST_ANGLES);
    put_polynomials(text, form, form->angle);
    text_add(text, "            s[i] = x[i] + (x[i] * z) * S;\n"
                   "            c[i] = level + (((1.0 - level) - half) + zz * C);\n        }\n");
}

/* A sum that must be rounded separately. */
static void put_sum(struct text *text, const struct form *form, const char *name, const char *sum) {
    text_add(text, "%sconst %s %s = %s_rounded(%s, ones);\n", form->indent, form->number, name, form->name,
             sum);
}

static void put_reduction(struct text *text, const struct form *form) {
    struct memory *memory = text->memory;
    put_sum(text, form, "above", memory_format(memory, "%s * 0.6366197723675814 + whole", form->angle));
    put_sum(text, form, "k", "above - whole");
    put_sum(text, form, "first", memory_format(memory, "%s - k * 1.5707963267923333", form->angle));
    put_value(text, form, "second = k * 2.5633441515839558e-12");
    put_sum(text, form, "high", "first - second");
    put_sum(text, form, "lost", "first - high");
    put_sum(text, form, "beyond", "lost - second");
    put_value(text, form, "rest = k * 1.0562999066987428e-23 - beyond");
    put_sum(text, form, "r", "high - rest");
    put_sum(text, form, "left", "high - r");
    put_value(text, form, "low = left - rest");
}

/* Computes s and c of the angle from those of r. */
static void put_quadrant(struct text *text, const struct form *form) {
    put_value(text, form, "sin_r = r + ((r * z) * S + low * level)");
    put_value(text, form, "cos_r = level + (((1.0 - level) - half) + (zz * C - r * low))");
    put_line(text, form, "/* k = 2 h + odd, odd = -1, 0 or 1; the sign is that of (-1)^h. */");
    put_sum(text, form, "half_k", "0.5 * k + whole");
    put_sum(text, form, "h", "half_k - whole");
    put_sum(text, form, "half_h", "0.5 * h + whole");
    put_sum(text, form, "even_h", "half_h - whole");
    put_value(text, form, "odd = k - 2.0 * h");
    put_value(text, form, "g = h - 2.0 * even_h");
    put_value(text, form, "sign = 1.0 - 2.0 * (g * g)");
    put_value(text, form, "turned = sign * odd");
    put_value(text, form, "even = sign - turned * odd");
}

static void put_reduced(struct text *text, const struct form *form) {
    put_reduction(text, form);
    put_polynomials(text, form, "r");
    put_quadrant(text, form);
}

/*
 * Since version 12, gcc says whether it may reorder sums. Its __builtin_assoc_barrier does not help if it
 * may, because it is lost in loops that become vectors. clang has an operation for this purpose that costs
 * nothing if sums are not reordered. With other compilers the bits pass a mask of ones that the compiler does
 * not know.
 */
static void put_rounded(const struct emission *x, struct text *text) {
    const char *number = x->number, *bits = x->is_lanes ? "lane_mask" : "unsigned long long";
    text_add(
        text,
        "#ifdef __has_builtin\n#define HAS_BUILTIN(name) __has_builtin(name)\n"
        "#else\n#define HAS_BUILTIN(name) 0\n#endif\n"
        "/* A rounded sum, even if the compiler may reorder sums. */\n"
        "%s %s %s_rounded(%s sum, %s ones) {\n"
        "#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && !defined(__ASSOCIATIVE_MATH__)\n"
        "    (void)ones;\n"
        "    return sum;\n"
        "#elif HAS_BUILTIN(__arithmetic_fence) && defined(__x86_64__)\n"
        "    (void)ones;\n"
        "    return __arithmetic_fence(sum);\n"
        "#else\n"
        "    %s bits;\n"
        "    memcpy(&bits, &sum, sizeof bits);\n"
        "    bits &= ones;\n"
        "    memcpy(&sum, &bits, sizeof bits);\n"
        "    return sum;\n"
        "#endif\n}\n#undef HAS_BUILTIN\n\n",
        x->is_lanes ? "INLINE" : "static", number, x->name, number, x->is_lanes ? "long long" : bits, bits);
}

static void put_libm(const struct emission *x, struct text *text) {
    text_add(text,
             "static void %s_sincos_libm(const double *angle, double *sine, double *cosine) {\n"
             "    for (int i = 0; i < %d; i++) {\n"
             "        const double x = angle[i];\n"
             "        sine[i] = sin(x);\n        cosine[i] = cos(x);\n    }\n}\n\n",
             x->name, FEWEST_ANGLES);
}

/* Compilers vectorise this form without further hints: flags are as wide as the angles, and one array is
 * written after the other. */
static void put_block(const struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
    text_add(text,
             "/* Sines and cosines of %d angles up to %d rad: x = k pi/2 + r, and two polynomials of r, "
             "minimax on\n"
             "   |r| <= pi/4; error at most 0.82 units in the last place. For larger angles and values "
             "that are not numbers libm. */\n"
             "static void %s_sincos_%d(const double *angle, double *sine, double *cosine) {\n",
             n, LARGEST, x->name, n);
    text_add(text,
             "    const double whole = 6755399441055744.0; /* 1.5 2^52: doubles of this size are whole "
             "numbers */\n"
             "    const volatile unsigned long long mask = ~0ULL; /* volatile: unknown to the compiler "
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
    const struct form form = {x->name, "double", "            ", "x[i]"};
    put_small(text, &form);
    text_add(text, "    } else if (known) {\n        for (int i = 0; i < %d; i++) {\n", n);
    put_reduced(text, &form);
    text_add(text,
             "            s[i] = even * sin_r + turned * cos_r;\n"
             "            c[i] = even * cos_r - turned * sin_r;\n"
             "        }\n"
             "    } else {\n        %s_sincos_libm(angle, sine, cosine);\n        return;\n    }\n"
             "    for (int i = 0; i < %d; i++)\n        sine[i] = s[i];\n"
             "    for (int i = 0; i < %d; i++)\n        cosine[i] = c[i];\n}\n",
             x->name, n, n);
}

static void put_pass(const struct emission *x, struct text *text) {
    text_add(text, "%s", rounds_to_doubles);
    put_rounded(x, text);
    put_block(x, text);
    text_add(text,
             "#else /* sums may be wider than doubles */\n"
             "static void %s_sincos_%d(const double *angle, double *sine, double *cosine) {\n"
             "    %s_sincos_libm(angle, sine, cosine);\n}\n#endif\n\n",
             x->name, FEWEST_ANGLES, x->name);
}

void emit_sincos(struct emission *x, struct text *text) {
    const int n = FEWEST_ANGLES;
    if (x->has_sincos)
        return;
    x->has_sincos = true;
    text_add(text, "#ifndef REFDYN_GENERATED_%s_SINCOS /* parts may be compiled as one file */\n", x->name);
    text_add(text, "#define REFDYN_GENERATED_%s_SINCOS\n", x->name);
    put_libm(x, text);
    put_pass(x, text);
    text_add(text,
             "/* For `count` angles, at least %d; the last block may overlap the one before. */\n"
             "static void %s_sincos(const double *angle, double *sine, double *cosine, int count) {\n"
             "    for (int i = 0; i < count - %d; i += %d)\n"
             "        %s_sincos_%d(angle + i, sine + i, cosine + i);\n"
             "    %s_sincos_%d(angle + count - %d, sine + count - %d, cosine + count - %d);\n}\n#endif\n\n",
             n, x->name, n, n, x->name, n, x->name, n, n, n, n);
}

/* ---- In lanes ---- */

/* The result of a lane does not depend on the other lanes: if the angles of all lanes are small, the
 * shorter way computes the bits of the longer one with k = 0. */
static void put_lane_small(const struct emission *x, struct text *text) {
    const struct form form = {x->name, "lane", "    ", "x"};
    text_add(text,
             "/* The same bits if the angles of all lanes are within an eighth of a turn. */\n"
             "INLINE void %s_small_angle(lane x, lane *sine, lane *cosine) {\n",
             x->name);
    put_polynomials(text, &form, form.angle);
    text_add(text, "    *sine = x + (x * z) * S;\n"
                   "    *cosine = level + (((1.0 - level) - half) + zz * C);\n}\n\n");
}

static void put_lane_angle(const struct emission *x, struct text *text) {
    const struct form form = {x->name, "lane", "    ", "x"};
    text_add(text,
             "/* Sine and cosine of an angle within the range of the pass, computed as in %s.c. */\n"
             "INLINE void %s_angle(lane x, lane *sine, lane *cosine) {\n"
             "    const double whole = 6755399441055744.0; /* 1.5 2^52: doubles of this size are whole "
             "numbers */\n"
             "    const volatile long long mask = -1; /* volatile: unknown to the "
             "compiler */\n"
             "    const long long ones = mask;\n",
             x->plan->model->name, x->name);
    put_reduced(text, &form);
    text_add(text, "    *sine = even * sin_r + turned * cos_r;\n"
                   "    *cosine = even * cos_r - turned * sin_r;\n}\n\n");
}

/* Few angles need it, but each lane must be handled alone. */
static void put_lane_repair(const struct emission *x, struct text *text) {
    const char *name = x->name;
    text_add(text,
             "INLINE lane_mask %s_is_within(lane x, double limit) {\n"
             "    return (lane_mask)(x <= limit) & (lane_mask)(x >= -limit);\n}\n\n"
             "INLINE lane_mask %s_is_known(lane x) {\n"
             "    return %s_is_within(x, %s_largest);\n}\n\n"
             "INLINE int %s_is_in_all_lanes(lane_mask mask) {\n"
             "#if LANES == 4 && defined(__AVX__) /* compilers do not turn the loop into this */\n"
             "    return __builtin_ia32_movmskpd256((lane)mask) == 15;\n"
             "#else\n"
             "    long long all = -1;\n    for (int l = 0; l < LANES; l++)\n        all &= AT(mask, l);\n"
             "    return all != 0;\n#endif\n}\n\n",
             name, name, name, name, name);
    text_add(text,
             "/* Lanes with a larger angle, or a value that is not a number, get the results of libm. */\n"
             "static void %s_ask_libm(const lane *angle, lane *sine, lane *cosine) {\n"
             "    const lane x = *angle;\n    const lane_mask known = %s_is_known(x);\n    for (int l = 0; l "
             "< LANES; l++)\n"
             "        if (!AT(known, l)) {\n            AT(*sine, l) = sin(AT(x, l));\n"
             "            AT(*cosine, l) = cos(AT(x, l));\n        }\n}\n\n",
             name, name);
}

/* The sine or cosine of a formula. The common part of both for one angle is computed once, because
 * compilers see it before any branch. */
static void put_lane_function(const struct emission *x, struct text *text, enum operation operation) {
    const char *name = x->name;
    if (!x->uses_operation[operation])
        return;
    text_add(text,
             "INLINE lane %s_lanes(lane x) {\n    lane sine, cosine;\n"
             "    %s_angle(x, &sine, &cosine);\n    if (!%s_is_in_all_lanes(%s_is_known(x)))\n"
             "        %s_ask_libm(&x, &sine, &cosine);\n    return %s;\n}\n\n",
             operation_text(operation), name, name, name, name, operation == OP_SIN ? "sine" : "cosine");
}

static void put_lane_pass(const struct emission *x, struct text *text) {
    const char *name = x->name;
    if (!x->has_sincos)
        return;
    put_lane_small(x, text);
    text_add(text,
             "static void %s_sincos(const lane *angle, lane *sine, lane *cosine, int count) {\n"
             "    lane_mask known = %s_is_known(every_lane(0.0));\n"
             "    for (int i = 0; i < count; i++)\n"
             "        if (%s_is_in_all_lanes(%s_is_within(angle[i], 0.785))) {\n"
             "            %s_small_angle(angle[i], sine + i, cosine + i);\n"
             "        } else {\n"
             "            %s_angle(angle[i], sine + i, cosine + i);\n"
             "            known &= %s_is_known(angle[i]);\n        }\n"
             "    if (%s_is_in_all_lanes(known))\n        return;\n"
             "    for (int i = 0; i < count; i++)\n"
             "        %s_ask_libm(angle + i, sine + i, cosine + i);\n}\n\n",
             name, name, name, name, name, name, name, name, name);
}

void emit_lane_sincos(struct emission *x, struct text *text) {
    if (!x->has_sincos && !x->uses_operation[OP_SIN] && !x->uses_operation[OP_COS])
        return;
    text_add(text,
             "%sstatic const double %s_largest = %d.0;\n"
             "#else /* sums may be wider than doubles: libm computes all */\n"
             "static const double %s_largest = -1.0;\n#endif\n",
             rounds_to_doubles, x->name, LARGEST, x->name);
    put_rounded(x, text);
    put_lane_angle(x, text);
    put_lane_repair(x, text);
    put_lane_pass(x, text);
    put_lane_function(x, text, OP_SIN);
    put_lane_function(x, text, OP_COS);
}

/* ---- In a function ---- */

/* In lanes one angle fills a vector, so that the pass may have any number of angles. */
void emit_begin_angles(struct emission *x) {
    const struct function *function = x->function;
    if (x->is_lanes)
        x->angles = angles_range(x->plan, function);
    else
        x->angles = (struct angle_range){.first = function->first_angle, .count = function->angle_count};
}

void emit_angle_arrays(const struct emission *x, struct text *text) {
    if (x->angles.count)
        text_add(text, "    %s sine[%d], cosine[%d];\n", x->number, x->angles.count, x->angles.count);
}

static void emit_pass_call(const struct emission *x, struct text *text, int first, int count) {
    const char *within = x->is_cut ? "s." : "";
    const int at = first - x->angles.first;
    const char *place = at ? memory_format(x->plan->memory, " + %d", at) : "";
    text_add(text, "    %s_sincos(q + %d, %ssine%s, %scosine%s, %d);\n", x->name, first, within, place,
             within, place, count);
}

/* In lanes a sliding coordinate in the range costs as much as an angle. */
void emit_angle_pass(struct emission *x, struct text *text) {
    const struct angle_range *angles = &x->angles;
    const int end = angles->first + angles->count;
    x->has_sincos |= angles->count > 0;
    if (!x->is_lanes || angles->is_dense) {
        if (angles->count)
            emit_pass_call(x, text, angles->first, angles->count);
        return;
    }
    for (int i = angles->first, first = i; i < end; i++) {
        if (!angles->is_angle[i])
            first = i + 1;
        else if (i + 1 == end || !angles->is_angle[i + 1])
            emit_pass_call(x, text, first, i + 1 - first);
    }
}

bool emit_angle(struct emission *x, struct text *text, expression e) {
    if (!x->angles.count || !angles_is_plain(x->plan, e))
        return false;
    const struct node *node = &x->g->nodes[e];
    const struct symbol *s = expr_as_symbol(x->g, node->operand[0]);
    const struct frame *frame = s->kind == SYMBOL_ELEMENT ? &x->plan->rolled->frames[s->index] : NULL;
    x->uses_carried |= x->is_cut;
    text_add(text, "%s%s[", x->is_cut ? "s->" : "", node->operation == OP_SIN ? "sine" : "cosine");
    if (frame)
        emit_run_index(text, frame->coordinate - x->angles.first, frame->step);
    else
        text_add(text, "%d", s->index - x->angles.first);
    text_add(text, "]");
    return true;
}
