/* An axis of a chart: see figures.h. */
#include "runtime/tool/results/figures/figures.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double slack = 1e-9; /* of a step: rounding */

void scale_widen(double *low, double *high, double part) {
    const double noise = 1e-9, side = 0.05; /* parts of the value: below the first a change is rounding */
    const double size = fmin(fmax(fabs(*low), fabs(*high)), DBL_MAX / 8), span = *high - *low;
    const bool is_constant = span <= fmax(noise * size, DBL_MIN / DBL_EPSILON);
    const double more =
        is_constant ? (size > DBL_MIN / DBL_EPSILON ? side * size : 1) : part * fmin(span, DBL_MAX / 8);
    *low = fmax(*low, -DBL_MAX / 8) - more;
    *high = fmin(*high, DBL_MAX / 8) + more;
}

/* The least of 1, 2 and 5 times a power of ten that is not below `least`. */
static double round_step(double least) {
    const double power = pow(10, floor(log10(least))), part = least / power;
    return power * (part <= 1 + slack ? 1 : part <= 2 + slack ? 2 : part <= 5 + slack ? 5 : 10);
}

static void place_ticks(struct scale *scale) {
    scale->first = ceil(scale->low / scale->step - slack) * scale->step;
    scale->count = (int)floor((scale->high - scale->first) / scale->step + slack) + 1;
}

struct scale scale_linear(double low, double high, int most) {
    const double long_part = 1e4, large = 1e4, small = 1e-2; /* from here on numbers would be long */
    struct scale scale = {.low = low, .high = high, .step = round_step((high - low) / most)};
    place_ticks(&scale);
    double size = fmax(fabs(low), fabs(high));
    if (size > long_part * (high - low)) {
        scale.base = scale.first;
        size = high - low;
    }
    if (size >= large || size < small)
        scale.exponent = 3 * (int)floor(log10(size) / 3);
    scale.decimals = (int)fmax(0, scale.exponent - floor(log10(scale.step) + slack));
    return scale;
}

struct scale scale_logarithmic(double low, double high, int most) {
    struct scale scale = {
        .is_logarithmic = true, .low = floor(log10(low) + slack), .high = ceil(log10(high) - slack)};
    if (scale.high <= scale.low)
        scale.high = scale.low + 1;
    scale.step = ceil((scale.high - scale.low) / most);
    place_ticks(&scale);
    return scale;
}

double scale_place(const struct scale *scale, double value) {
    const double at = scale->is_logarithmic ? log10(value) : value;
    return (at - scale->low) / (scale->high - scale->low);
}

double scale_tick(const struct scale *scale, int tick) {
    return (scale->first + tick * scale->step - scale->low) / (scale->high - scale->low);
}

/* 10 with the exponent as raised digits. */
static void put_power(int exponent, char text[static SCALE_TEXT]) {
    static const char *const raised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    char digits[SCALE_TEXT / 4];
    snprintf(digits, sizeof digits, "%d", exponent);
    strcpy(text, "10");
    for (const char *at = digits; *at; at++)
        strcat(text, *at == '-' ? "⁻" : raised[*at - '0']);
}

void scale_label(const struct scale *scale, int tick, char text[static SCALE_TEXT]) {
    const double value = scale->first + tick * scale->step;
    if (scale->is_logarithmic) {
        put_power((int)lround(value), text);
        return;
    }
    const double shown = (value - scale->base) / pow(10, scale->exponent);
    const bool is_zero = fabs(shown) < slack * scale->step / pow(10, scale->exponent);
    snprintf(text, SCALE_TEXT, "%.*f", scale->decimals, is_zero ? 0 : shown);
}

void scale_note(const struct scale *scale, char text[static SCALE_TEXT]) {
    char power[SCALE_TEXT] = "";
    *text = '\0';
    if (scale->exponent)
        put_power(scale->exponent, power);
    if (scale->exponent || scale->base != 0)
        snprintf(text, SCALE_TEXT, scale->base != 0 ? "%s%s %+.12g" : "%s%s", scale->exponent ? "× " : "",
                 power, scale->base);
}
