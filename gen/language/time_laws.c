/*
 * Courses in time for motions from rest to rest: rd.timing and rd.shaper. Reads a table of fields; returns
 * expressions of the time and of parameters. The laws are sums over all pieces, each with the time spent in
 * it, so that no piece is a special case and all derivatives exist.
 */
#include "gen/language/language.h"

#include <math.h>
#include <string.h>

enum { KNOTS_MOST = 60, IMPULSES_MOST = 3, PHASES = 3, HALF_MOST = 3 };

/* ---- input shapers ---- */

/* A shaper sends a share of the course at once and the others later, so that the vibrations that they excite
 * cancel. */
struct impulse {
    expression delay, share;
};

static expression polynomial(struct graph *g, expression x, const double *coefficients, int count) {
    expression sum = expr_number(g, coefficients[count - 1]);
    for (int i = count - 2; i >= 0; i--)
        sum = expr_add(g, expr_number(g, coefficients[i]), expr_mul(g, x, sum));
    return sum;
}

/* Two or three impulses, half a period apart. Their shares are binomial coefficients times powers of the
 * decay over half a period, divided by their sum (Singer and Seering, Preshaping Command Inputs to Reduce
 * System Vibration, J. Dyn. Sys. Meas. Control 112, 1990). */
static int binomial_impulses(struct graph *g, expression half, expression damping, int count,
                             struct impulse *impulses) {
    const expression root = expr_apply1(g, OP_SQRT, expr_sub(g, EXPR_ONE, expr_mul(g, damping, damping)));
    const expression exponent =
        expr_div(g, expr_mul(g, expr_number(g, -3.14159265358979323846), damping), root);
    const expression decay = expr_apply1(g, OP_EXP, exponent), sum = expr_add(g, EXPR_ONE, decay);
    const expression first = expr_div(g, EXPR_ONE, sum), second = expr_div(g, decay, sum);
    impulses[0] = (struct impulse){EXPR_ZERO, first};
    impulses[1] = (struct impulse){half, second};
    if (count == 3) {
        impulses[0].share = expr_mul(g, first, first);
        impulses[1].share = expr_mul(g, expr_number(g, 2), expr_mul(g, first, second));
        impulses[2] = (struct impulse){expr_mul(g, expr_number(g, 2), half), expr_mul(g, second, second)};
    }
    return count;
}

/* Extra-insensitive: 5 % of the vibration remain at the given frequency, and no more over a range of 20 % on
 * both sides. Shares and the second delay are fits in the damping (Singhose, Seering and Singer, Residual
 * Vibration Reduction Using Vector Diagrams to Generate Shaped Inputs, J. Mech. Design 116, 1994), here with
 * V = 0.05. */
static int insensitive_impulses(struct graph *g, expression half, expression damping,
                                struct impulse *impulses) {
    enum { COUNT = 3 };
    static const double V = 0.05;
    const double first[] = {0.24968 + 0.24962 * V, 0.80008 + 1.23328 * V, 0.49599 + 3.17316 * V};
    const double last[] = {0.25149 + 0.21474 * V, -0.83249 + 1.41498 * V, 0.85181 - 4.90094 * V};
    const double delay[] = {0.49990, 0.46159 * V + 8.57843 * V * V, 4.26169 * V - 108.644 * V * V,
                            1.75601 * V + 336.989 * V * V};
    const expression period = expr_mul(g, expr_number(g, 2), half);
    impulses[0] = (struct impulse){EXPR_ZERO, polynomial(g, damping, first, COUNT)};
    impulses[2] = (struct impulse){period, polynomial(g, damping, last, COUNT)};
    impulses[1] = (struct impulse){expr_mul(g, period, polynomial(g, damping, delay, COUNT + 1)),
                                   expr_sub(g, expr_sub(g, EXPR_ONE, impulses[0].share), impulses[2].share)};
    return COUNT;
}

/* The impulses of the table's kind; 0 after an error, which is reported. */
static int read_impulses(const struct checker *checker, const struct value *table, struct impulse *impulses) {
    static const char *const kinds[] = {"zv", "zvd", "ei"};
    static const double ei_most = 0.3;
    struct graph *g = checker->graph;
    const expression period = expr_div(g, EXPR_ONE, fields_get_value(checker, table, FIELD_SHAPER_frequency));
    const expression half = expr_mul(g, expr_number(g, 0.5), period),
                     damping = fields_get_value(checker, table, FIELD_SHAPER_damping);
    const struct value *kind = fields_get(table, FIELD_SHAPER_kind);
    const int number = kind ? text_index(kind->text, kinds, 3) : 0;
    double known;
    if (number < 0)
        fields_refuse_name(checker, kind->place, "rd.shaper.kind",
                           memory_format(checker->memory, "\"%s\" is no shaper", kind->text), kind->text,
                           kinds, 3);
    if (number == 2 && parameters_are_known(checker->declarations, damping, &known) && known > ei_most) {
        message_error(checker->messages, table->place,
                      "rd.shaper.damping: value %.6g; must be at most %g with kind \"ei\"", known, ei_most);
        return 0;
    }
    if (number == 2)
        return insensitive_impulses(g, half, damping, impulses);
    return number < 0 ? 0 : binomial_impulses(g, half, damping, number + 2, impulses);
}

/* The time of a delayed course. */
static expression delayed(void *context, struct graph *g, expression e) {
    const expression delay = *(const expression *)context;
    return expr_as_symbol(g, e)->kind == SYMBOL_TIME ? expr_sub(g, e, delay) : e;
}

expression time_laws_shaper(const struct checker *checker, const struct value *table) {
    const int errors = checker->messages->errors;
    struct graph *g = checker->graph;
    struct impulse impulses[IMPULSES_MOST];
    fields_check(checker, table, OWNER_SHAPER, "rd.shaper");
    if (checker->messages->errors > errors)
        return EXPR_ZERO;
    const expression course = fields_get_value(checker, table, FIELD_SHAPER_course);
    if (g->nodes[course].depends & ~(ON_TIME | ON_PARAMETER))
        message_error(checker->messages, table->place,
                      "rd.shaper.course: depends on the state or on inputs; must be a course in time");
    const int count = read_impulses(checker, table, impulses);
    expression sum = EXPR_ZERO;
    for (int i = 0; i < count && checker->messages->errors == errors; i++) {
        expression part;
        rewrite_substitute(g, delayed, &impulses[i].delay, &course, &part, 1);
        sum = expr_add(g, sum, expr_mul(g, impulses[i].share, part));
    }
    return sum;
}

/* ---- time laws ---- */

/* A way over time and the time that it takes. */
struct law {
    expression way, duration;
};

/* The part of the duration `length` that begins at `from` and has passed at `t`. */
static expression time_within(struct graph *g, expression t, expression from, expression length) {
    return expr_apply2(g, OP_MIN, expr_apply2(g, OP_MAX, expr_sub(g, t, from), EXPR_ZERO), length);
}

/*
 * Bounded rate, acceleration and perhaps jerk: the mean of a jump over length/rate, then the mean of that
 * over rate/acceleration, then over acceleration/jerk. Each mean bounds one more derivative, in any
 * order of the three times. The result is a sum over the corners, at which the highest derivative jumps: with
 * k means and the time x since a corner, x^k/k! divided by the product of the times.
 */
static struct law bounded_law(const struct checker *checker, const struct value *table, expression t) {
    static const enum field fields[] = {FIELD_TIMING_length, FIELD_TIMING_rate, FIELD_TIMING_acceleration,
                                        FIELD_TIMING_jerk};
    struct graph *g = checker->graph;
    const int means = fields_has(table, FIELD_TIMING_jerk) ? PHASES : PHASES - 1;
    expression times[PHASES], product = EXPR_ONE, sum = EXPR_ZERO;
    struct law law = {EXPR_ZERO, EXPR_ZERO};
    for (int i = 0; i < means; i++) {
        times[i] = expr_div(g, fields_get_value(checker, table, fields[i]),
                            fields_get_value(checker, table, fields[i + 1]));
        product = expr_mul(g, product, expr_mul(g, times[i], expr_number(g, i + 1)));
        law.duration = expr_add(g, law.duration, times[i]);
    }
    const expression within = time_within(g, t, EXPR_ZERO, law.duration);
    for (unsigned corner = 0; corner < 1u << means; corner++) {
        expression from = EXPR_ZERO, power = EXPR_ONE;
        bool is_minus = false;
        for (int i = 0; i < means; i++)
            if (corner >> i & 1) {
                from = expr_add(g, from, times[i]);
                is_minus = !is_minus;
            }
        const expression since = expr_apply2(g, OP_MAX, expr_sub(g, within, from), EXPR_ZERO);
        for (int i = 0; i < means; i++)
            power = expr_mul(g, power, since);
        sum = is_minus ? expr_sub(g, sum, power) : expr_add(g, sum, power);
    }
    law.way = expr_mul(g, expr_div(g, fields_get_value(checker, table, FIELD_TIMING_length), product), sum);
    return law;
}

/* Reports a list with a wrong number of entries. */
static bool has_room(const struct checker *checker, const struct value *table, enum field field) {
    const struct value *list = fields_get(table, field);
    const bool fits = list->item_count >= 2 && list->item_count <= KNOTS_MOST;
    if (!fits)
        message_error(checker->messages, list->place, "rd.timing.%s: has %d; must have 2 to %d",
                      field_rules[field].name, list->item_count, KNOTS_MOST);
    return fits;
}

/* Reports a wrong number of speeds, and neighbours that are both 0, between which the motion would stop. */
static bool has_speeds(const struct checker *checker, const struct value *table) {
    const struct value *speeds = fields_get(table, FIELD_TIMING_speeds);
    const int errors = checker->messages->errors;
    double before = 1, now;
    has_room(checker, table, FIELD_TIMING_speeds);
    for (int i = 0; i < speeds->item_count; i++, before = now) {
        expression e = EXPR_ZERO;
        value_expression(checker->graph, &speeds->items[i], &e);
        if (!parameters_are_known(checker->declarations, e, &now))
            now = 1;
        if (before == 0 && now == 0)
            message_error(checker->messages, speeds->place,
                          "rd.timing.speeds[%d]: 0 as the one before it; one of them must be positive",
                          i + 1);
    }
    return checker->messages->errors == errors;
}

/* Speeds at knots along the way, the square of the speed linear in the way between them: constant
 * acceleration, so that each piece takes its length over the mean of its two speeds. */
static struct law law_of_speeds(const struct checker *checker, const struct value *table, expression t) {
    struct graph *g = checker->graph;
    const struct value *speeds = fields_get(table, FIELD_TIMING_speeds);
    const int pieces = speeds->item_count - 1;
    struct law law = {EXPR_ZERO, EXPR_ZERO};
    const expression piece =
        expr_div(g, fields_get_value(checker, table, FIELD_TIMING_length), expr_number(g, pieces));
    for (int i = 0; i < pieces; i++) {
        expression v0 = EXPR_ZERO, v1 = EXPR_ZERO;
        value_expression(g, &speeds->items[i], &v0);
        value_expression(g, &speeds->items[i + 1], &v1);
        const expression mean = expr_mul(g, expr_number(g, 0.5), expr_add(g, v0, v1));
        const expression length = expr_div(g, piece, mean);
        const expression x = time_within(g, t, law.duration, length);
        const expression half = expr_div(g, expr_sub(g, v1, v0), expr_mul(g, expr_number(g, 2), length));
        law.way = expr_add(g, law.way, expr_mul(g, x, expr_add(g, v0, expr_mul(g, half, x))));
        law.duration = expr_add(g, law.duration, length);
    }
    return law;
}

/* ---- splines through knots in time, at rest at both ends ---- */

/*
 * Polynomials of degree 2 k - 1 between the knots, k = 2 or 3. The derivatives 1 to k - 1 vanish at both ends
 * of the spline and are unknown at the inner knots, where the derivatives k to 2 k - 2 do not jump. All are
 * linear in the knots' values, so that the system has numbers alone and the values may be expressions.
 */
struct knots {
    int count, half; /* knots; k */
    const double *times;
    const struct value *list;
    double inverse[HALF_MOST]
                  [HALF_MOST]; /* the upper coefficients from what the lower ones lack at the end */
    double *slopes; /* (count x (half - 1) x count): derivatives at the knots by the knots' values */
};

static double falling(int i, int order) {
    double product = 1;
    for (int k = 0; k < order; k++)
        product *= i - k;
    return product;
}

/* Solves the n equations in `matrix` (n x n) for `sides` right sides (n x sides), in place, by elimination
 * with the largest pivot. */
static void solve(double *matrix, double *right, int n, int sides) {
    for (int i = 0; i < n; i++) {
        int pivot = i;
        for (int k = i + 1; k < n; k++)
            pivot = fabs(matrix[k * n + i]) > fabs(matrix[pivot * n + i]) ? k : pivot;
        for (int j = 0; j < n + sides; j++) {
            double *a = j < n ? &matrix[i * n + j] : &right[i * sides + j - n],
                   *b = j < n ? &matrix[pivot * n + j] : &right[pivot * sides + j - n];
            const double own = *a;
            *a = *b;
            *b = own;
        }
        for (int k = 0; k < n; k++) {
            const double factor = k == i ? 0 : matrix[k * n + i] / matrix[i * n + i];
            for (int j = 0; j < n; j++)
                matrix[k * n + j] -= factor * matrix[i * n + j];
            for (int j = 0; j < sides; j++)
                right[k * sides + j] -= factor * right[i * sides + j];
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < sides; j++)
            right[i * sides + j] /= matrix[i * n + i];
}

/* Coefficient i of piece `piece`, over the share of its time, by derivative `order` at its start (end 0) or
 * at its end (end 1). */
static double coefficient(const struct knots *k, int piece, int i, int end, int order) {
    const double scale = pow(k->times[piece + 1] - k->times[piece], order);
    if (i < k->half)
        return end == 0 && i == order ? scale / falling(i, i) : 0;
    double sum = 0;
    for (int r = 0; r < k->half; r++)
        sum +=
            k->inverse[i - k->half][r] * (end == 1 ? r == order : -falling(order, r) / falling(order, order));
    return sum * scale;
}

/* Derivative r at the end `at` of a piece, by derivative `order` at its end `end`. */
static double derivative(const struct knots *k, int piece, int at, int r, int end, int order) {
    double sum = 0;
    for (int i = r; i < 2 * k->half; i++)
        sum += at == 1 || i == r ? falling(i, r) * coefficient(k, piece, i, end, order) : 0;
    return sum / pow(k->times[piece + 1] - k->times[piece], r);
}

static void find_inverse(struct knots *k) {
    double matrix[HALF_MOST * HALF_MOST], unit[HALF_MOST * HALF_MOST];
    for (int r = 0; r < k->half; r++)
        for (int i = 0; i < k->half; i++) {
            matrix[r * k->half + i] = falling(i + k->half, r);
            unit[r * k->half + i] = r == i;
        }
    solve(matrix, unit, k->half, k->half);
    for (int i = 0; i < k->half; i++)
        for (int r = 0; r < k->half; r++)
            k->inverse[i][r] = unit[i * k->half + r];
}

/* Adds what derivative `r` at the knot `knot` of `piece` has by the unknowns and by the values, times `sign`.
 */
static void add_continuity(const struct knots *k, int piece, int knot, int r, double sign, double *unknown,
                           double *value) {
    for (int end = 0; end < 2; end++) {
        const int inner = piece + end - 1; /* number of the inner knot; the ends are at rest */
        value[piece + end] -= sign * derivative(k, piece, knot - piece, r, end, 0);
        for (int order = 1; order < k->half && inner >= 0 && inner < k->count - 2; order++)
            unknown[inner * (k->half - 1) + order - 1] +=
                sign * derivative(k, piece, knot - piece, r, end, order);
    }
}

static void find_slopes(struct memory *memory, struct knots *k) {
    const int each = k->half - 1, n = each * (k->count - 2);
    double *matrix = memory_get(memory, ((size_t)n * (size_t)n + 1) * sizeof *matrix);
    k->slopes = memory_get(memory, (size_t)k->count * (size_t)each * (size_t)k->count * sizeof *k->slopes);
    double *inner = k->slopes + each * k->count; /* those of the first knot, 0, come before */
    find_inverse(k);
    for (int row = 0; row < n; row++) {
        const int knot = row / each + 1, r = k->half + row % each;
        add_continuity(k, knot - 1, knot, r, 1, matrix + row * n, inner + row * k->count);
        add_continuity(k, knot, knot, r, -1, matrix + row * n, inner + row * k->count);
    }
    solve(matrix, inner, n, k->count);
}

/* Derivative `order` at a knot: a sum over the knots' values. */
static expression at_knot(struct graph *g, const struct knots *k, const expression *values, int knot,
                          int order) {
    if (order == 0)
        return values[knot];
    const double *factors = k->slopes + ((k->half - 1) * knot + order - 1) * k->count;
    expression sum = EXPR_ZERO;
    for (int j = 0; j < k->count; j++)
        if (factors[j] != 0)
            sum = expr_add(g, sum, expr_mul(g, expr_number(g, factors[j]), values[j]));
    return sum;
}

/* The change of the way in a piece over its share x of time. */
static expression piece_of_spline(struct graph *g, const struct knots *k, const expression *values, int piece,
                                  expression x) {
    expression sum = EXPR_ZERO;
    for (int i = 2 * k->half - 1; i > 0; i--) {
        expression own = EXPR_ZERO;
        for (int order = 0; order < k->half; order++)
            for (int end = 0; end < 2; end++)
                own = expr_add(g, own,
                               expr_mul(g, expr_number(g, coefficient(k, piece, i, end, order)),
                                        at_knot(g, k, values, piece + end, order)));
        sum = expr_mul(g, x, expr_add(g, own, sum));
    }
    return sum;
}

/* Reads the knots; false after an error, which is reported. */
static bool read_knots(const struct checker *checker, const struct value *list, double *times,
                       expression *values) {
    const char *path = "rd.timing.knots";
    for (int i = 0; i < list->item_count; i++) {
        const struct value *knot = &list->items[i];
        const char *own = fields_path_item(checker, path, i);
        if (knot->item_count != 2 || knot->field_count > 0 || knot->items[0].kind != VALUE_NUMBER ||
            !value_expression(checker->graph, &knot->items[1], &values[i]) ||
            checker->graph->nodes[values[i]].depends & ~ON_PARAMETER) {
            message_error(checker->messages, knot->place,
                          "%s: must be { time, way }, a plain number and an expression in parameters", own);
            return false;
        }
        times[i] = knot->items[0].number;
        if (!(i == 0 ? times[i] == 0 : times[i] > times[i - 1]) || !isfinite(times[i])) {
            message_error(checker->messages, knot->place, "%s: at %.6g; times must begin with 0 and ascend",
                          own, times[i]);
            return false;
        }
    }
    return true;
}

static struct law law_of_knots(const struct checker *checker, const struct value *table, expression t) {
    struct graph *g = checker->graph;
    const struct value *degree = fields_get(table, FIELD_TIMING_degree);
    double times[KNOTS_MOST];
    expression values[KNOTS_MOST];
    struct knots k = {.list = fields_get(table, FIELD_TIMING_knots), .half = 2, .times = times};
    struct law law = {EXPR_ZERO, EXPR_ZERO};
    if (degree && degree->number != 3 && degree->number != 5)
        message_error(checker->messages, degree->place, "rd.timing.degree: value %.6g; must be 3 or 5",
                      degree->number);
    else if (degree)
        k.half = degree->number == 5 ? 3 : 2;
    if (!has_room(checker, table, FIELD_TIMING_knots) || !read_knots(checker, k.list, times, values))
        return law;
    k.count = k.list->item_count;
    find_slopes(checker->memory, &k);
    const expression end = expr_number(g, times[k.count - 1]);
    law.duration = fields_has(table, FIELD_TIMING_duration)
                       ? fields_get_value(checker, table, FIELD_TIMING_duration)
                       : end;
    const expression now = expr_mul(g, t, expr_div(g, end, law.duration));
    law.way = values[0];
    for (int i = 0; i + 1 < k.count; i++) {
        const expression from = expr_number(g, times[i]), length = expr_number(g, times[i + 1] - times[i]);
        const expression x = expr_div(g, time_within(g, now, from, length), length);
        law.way = expr_add(g, law.way, piece_of_spline(g, &k, values, i, x));
    }
    return law;
}

/* ---- control points, at rest and without acceleration at both ends ---- */

/* A uniform cubic B-spline. Its first and last control points count three times, so that it begins and ends
 * there without rate and acceleration. In piece k, with the share x of its time, the way grows by
 *     e_k x^3/6 + e_(k-1) (3 x + 3 x^2 - 2 x^3)/6 + e_(k-2) (3 x - 3 x^2 + x^3)/6,
 * where e_k is the difference of the control points k and k + 1 (de Boor, A Practical Guide to Splines,
 * 1978).
 */
static struct law law_of_control(const struct checker *checker, const struct value *table, expression t) {
    enum { WIDTH = 3, DEGREE = 3 };
    static const double shares[WIDTH][DEGREE] = {{0, 0, 1}, {3, 3, -2}, {3, -3, 1}}; /* of x, x^2, x^3 */
    struct graph *g = checker->graph;
    const struct value *control = fields_get(table, FIELD_TIMING_control);
    const int count = control->item_count, pieces = count + 1;
    struct law law = {EXPR_ZERO, fields_get_value(checker, table, FIELD_TIMING_duration)};
    expression points[KNOTS_MOST];
    for (int i = 0; i < count; i++)
        value_expression(g, &control->items[i], &points[i]);
    const expression now = expr_mul(g, t, expr_div(g, expr_number(g, pieces), law.duration));
    law.way = points[0];
    for (int k = 0; k < pieces; k++) {
        const expression x = time_within(g, now, expr_number(g, k), EXPR_ONE);
        expression sum = EXPR_ZERO;
        for (int power = DEGREE - 1; power >= 0; power--) {
            expression own = EXPR_ZERO;
            for (int i = 0; i < WIDTH; i++)
                if (k - i >= 0 && k - i + 1 < count && shares[i][power] != 0)
                    own = expr_add(g, own,
                                   expr_mul(g, expr_number(g, shares[i][power] / 6),
                                            expr_sub(g, points[k - i + 1], points[k - i])));
            sum = expr_mul(g, x, expr_add(g, own, sum));
        }
        law.way = expr_add(g, law.way, sum);
    }
    return law;
}

/* ---- the function ---- */

/* Reports a field that the form, chosen by `chosen`, needs and the table lacks. */
static bool lacks(const struct checker *checker, const struct value *table, enum field chosen,
                  enum field needed) {
    const bool is_missing = !fields_has(table, needed);
    if (is_missing)
        message_error(checker->messages, table->place, "rd.timing.%s: missing; a law by %s needs it",
                      field_rules[needed].name, field_rules[chosen].name);
    return is_missing;
}

static struct law read_law(const struct checker *checker, const struct value *table, expression t) {
    static const struct law none = {EXPR_ZERO, EXPR_ZERO};
    const bool by_rate = fields_has(table, FIELD_TIMING_rate),
               by_speeds = fields_has(table, FIELD_TIMING_speeds),
               by_knots = fields_has(table, FIELD_TIMING_knots),
               by_control = fields_has(table, FIELD_TIMING_control);
    if (by_rate + by_speeds + by_knots + by_control != 1) {
        message_error(checker->messages, table->place,
                      "rd.timing: has %s of rate, speeds, knots and control; give one",
                      by_rate + by_speeds + by_knots + by_control ? "several" : "none");
        return none;
    }
    if (fields_has(table, FIELD_TIMING_duration) && !by_knots && !by_control) {
        message_error(checker->messages, fields_get(table, FIELD_TIMING_duration)->place,
                      "rd.timing.duration: has no effect without knots or control; remove it");
        return none;
    }
    if (by_knots)
        return law_of_knots(checker, table, t);
    if (by_control)
        return lacks(checker, table, FIELD_TIMING_control, FIELD_TIMING_duration) ||
                       !has_room(checker, table, FIELD_TIMING_control)
                   ? none
                   : law_of_control(checker, table, t);
    if (lacks(checker, table, by_rate ? FIELD_TIMING_rate : FIELD_TIMING_speeds, FIELD_TIMING_length) ||
        (by_rate && lacks(checker, table, FIELD_TIMING_rate, FIELD_TIMING_acceleration)))
        return none;
    if (by_rate)
        return bounded_law(checker, table, t);
    return has_speeds(checker, table) ? law_of_speeds(checker, table, t) : none;
}

struct value time_laws_timing(const struct checker *checker, const struct value *table) {
    const int errors = checker->messages->errors;
    struct law law = {EXPR_ZERO, EXPR_ZERO};
    fields_check(checker, table, OWNER_TIMING, "rd.timing");
    if (checker->messages->errors == errors)
        law = read_law(checker, table, fields_get_value(checker, table, FIELD_TIMING_t));
    struct value_field *fields = memory_get(checker->memory, 2 * sizeof *fields);
    fields[0] = (struct value_field){"duration", {.kind = VALUE_EXPRESSION, .expression = law.duration}};
    fields[1] = (struct value_field){"way", {.kind = VALUE_EXPRESSION, .expression = law.way}};
    return (struct value){.kind = VALUE_TABLE, .fields = fields, .field_count = 2};
}
