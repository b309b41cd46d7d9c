/* Draws figures as SVG: charts with axes, curves, bands, cells and keys. Very many samples of a key become a
 * scale of their colours with as many names as fit. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/format/format.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Pixels. */
enum { LEFT = 74, RIGHT = 18, ABOVE = 44, BELOW = 46, TEXT = 11, HEAD_HEIGHT = 22, MARGIN = 12 };
enum {
    KEY_GAP = 14,
    SAMPLE = 24,
    KEY_HEIGHT = 16,
    KEY_LEAST = 12,
    LETTER = 6 /* approximate width */
};
enum { X_TICK = 52, Y_TICK = 34 /* smallest distances of ticks */ };
enum { TEXT_MOST = 100, NAME_MOST = 28 /* longest texts, in letters */ };

static const char ink[] = "#222222", frame[] = "#555555", grid[] = "#e4e4e4";

/* ---- Lists */

int figures_chart_key(struct chart *chart, const char *name, size_t length) {
    int place = 0;
    for (; place < chart->key_count; place++)
        if (strncmp(chart->keys[place].name, name, length) == 0 && !chart->keys[place].name[length])
            return place;
    chart->keys =
        memory_room(&format_memory, chart->keys, chart->key_count++, &chart->key_room, sizeof *chart->keys);
    chart->keys[place].name = format_text("%.*s", (int)length, name);
    return place;
}

void figures_chart_add_curve(struct chart *chart, struct curve curve) {
    chart->curves = memory_room(&format_memory, chart->curves, chart->curve_count, &chart->curve_room,
                                sizeof *chart->curves);
    chart->curves[chart->curve_count++] = curve;
}

void figures_chart_add_band(struct chart *chart, struct band band) {
    chart->bands =
        memory_room(&format_memory, chart->bands, chart->band_count, &chart->band_room, sizeof *chart->bands);
    chart->bands[chart->band_count++] = band;
}

void figures_chart_add_cell(struct chart *chart, struct cell cell) {
    chart->cells =
        memory_room(&format_memory, chart->cells, chart->cell_count, &chart->cell_room, sizeof *chart->cells);
    chart->cells[chart->cell_count++] = cell;
}

/* ---- Pieces */

static int letters_of(const char *text) {
    int count = 0;
    for (; *text; count++)
        format_utf8_next(&text);
    return count;
}

/* how: further attributes; most: letters after which the text is cut. */
static void put_label(FILE *out, double x, double y, const char *how, const char *text, int most) {
    const char *end = text;
    if (!*text)
        return;
    for (int i = 0; i < most && *end; i++)
        format_utf8_next(&end);
    fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, how);
    format_xml_text(out, format_text("%.*s%s", (int)(end - text), text, *end ? "..." : ""));
    fputs("</text>\n", out);
}

static void put_line(FILE *out, double x, double y, double x_end, double y_end, const char *colour) {
    fprintf(out, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\"/>\n", x, y, x_end, y_end, colour);
}

static void put_stroke(FILE *out, const struct stroke *stroke, double width) {
    fprintf(out, "\" fill=\"none\" stroke=\"#%06x\" stroke-width=\"%.3g\" stroke-linejoin=\"round\"",
            stroke->colour, width);
    if (*stroke->dash)
        fprintf(out, " stroke-dasharray=\"%s\"", stroke->dash);
    fputs("/>\n", out);
}

static void open_marks(FILE *out, const struct stroke *stroke) {
    fprintf(out, "<path fill=\"#%06x\" d=\"", stroke->colour);
}

static void put_sample(FILE *out, double x, double y, const struct stroke *stroke, double width) {
    fprintf(out, "<path d=\"M%.1f %.1fh%d", x, y, SAMPLE);
    put_stroke(out, stroke, width);
    if (!stroke->mark)
        return;
    open_marks(out, stroke);
    fprintf(out, "M%.1f %.1f%s\"/>\n", x + 0.5 * SAMPLE, y, stroke->mark);
}

/* ---- Scales */

/*
 * An axis of a chart: the range that it shows, its ticks, and their numbers.
 *
 * Numbers at ticks are short: a power of ten or a value that all have in common is printed once, as a note at
 * the end of the axis.
 */

struct scale {
    bool is_logarithmic;
    double low, high;   /* ends; on a logarithmic axis the decimal logarithm, like all members below */
    double first, step; /* ticks */
    int count;
    double base;  /* the numbers are (value - base)/10^exponent */
    int exponent; /* multiple of 3 */
    int decimals;
};

enum { SCALE_TEXT = 48 };

static const double slack = 1e-9; /* rounding, as a part of a step */

static void scale_widen(double *low, double *high, double part) {
    const double noise = 1e-9,
                 side = 0.05; /* parts of the value: smaller changes are rounding; margin of a constant */
    const double size = fmin(fmax(fabs(*low), fabs(*high)), DBL_MAX / 8), span = *high - *low;
    const bool is_constant = span <= fmax(noise * size, DBL_MIN / DBL_EPSILON);
    const double more =
        is_constant ? (size > DBL_MIN / DBL_EPSILON ? side * size : 1) : part * fmin(span, DBL_MAX / 8);
    *low = fmax(*low, -DBL_MAX / 8) - more;
    *high = fmin(*high, DBL_MAX / 8) + more;
}

/* The smallest of 1, 2 and 5 times a power of ten that is at least `least`. */
static double round_step(double least) {
    const double power = pow(10, floor(log10(least))), part = least / power;
    return power * (part <= 1 + slack ? 1 : part <= 2 + slack ? 2 : part <= 5 + slack ? 5 : 10);
}

static void place_ticks(struct scale *scale) {
    scale->first = ceil(scale->low / scale->step - slack) * scale->step;
    scale->count = (int)floor((scale->high - scale->first) / scale->step + slack) + 1;
}

static struct scale scale_linear(double low, double high, int most) {
    const double long_part = 1e4, large = 1e4, small = 1e-2; /* beyond these, numbers would be long */
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

static struct scale scale_logarithmic(double low, double high, int most) {
    struct scale scale = {
        .is_logarithmic = true, .low = floor(log10(low) + slack), .high = ceil(log10(high) - slack)};
    if (scale.high <= scale.low)
        scale.high = scale.low + 1;
    scale.step = ceil((scale.high - scale.low) / most);
    place_ticks(&scale);
    return scale;
}

static double scale_place(const struct scale *scale, double value) {
    const double at = scale->is_logarithmic ? log10(value) : value;
    return (at - scale->low) / (scale->high - scale->low);
}

static double scale_tick(const struct scale *scale, int tick) {
    return (scale->first + tick * scale->step - scale->low) / (scale->high - scale->low);
}

/* Writes 10 with the exponent as superscript digits. */
static void put_power(int exponent, char text[static SCALE_TEXT]) {
    static const char *const raised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    char digits[SCALE_TEXT / 4];
    snprintf(digits, sizeof digits, "%d", exponent);
    strcpy(text, "10");
    for (const char *at = digits; *at; at++)
        strcat(text, *at == '-' ? "⁻" : raised[*at - '0']);
}

static void scale_label(const struct scale *scale, int tick, char text[static SCALE_TEXT]) {
    const double value = scale->first + tick * scale->step;
    if (scale->is_logarithmic) {
        put_power((int)lround(value), text);
        return;
    }
    const double shown = (value - scale->base) / pow(10, scale->exponent);
    const bool is_zero = fabs(shown) < slack * scale->step / pow(10, scale->exponent);
    snprintf(text, SCALE_TEXT, "%.*f", scale->decimals, is_zero ? 0 : shown);
}

static void scale_note(const struct scale *scale, char text[static SCALE_TEXT]) {
    char power[SCALE_TEXT] = "";
    *text = '\0';
    if (scale->exponent)
        put_power(scale->exponent, power);
    if (scale->exponent || scale->base != 0)
        snprintf(text, SCALE_TEXT, scale->base != 0 ? "%s%s %+.12g" : "%s%s", scale->exponent ? "× " : "",
                 power, scale->base);
}

/* ---- Axes */

/* The box of a chart's axes in pixels, and its scales. */
struct box {
    double left, top, width, height;
    struct scale x, y;
};

static double y_of(const struct chart *chart, const struct curve *curve, long i) {
    const double value = curve->y[i * curve->stride];
    return chart->is_y_logarithmic ? fabs(value) : value;
}

struct range {
    double low, high;
};

static void extend(struct range *range, double low, double high) {
    range->low = fmin(range->low, low);
    range->high = fmax(range->high, high);
}

static void extend_by_areas(const struct chart *chart, bool is_x, struct range *range) {
    for (int i = 0; i < chart->cell_count; i++) {
        const struct cell *cell = &chart->cells[i];
        extend(range, is_x ? cell->left : cell->low, is_x ? cell->right : cell->high);
    }
    for (int i = 0; i < chart->band_count; i++)
        for (long k = 0; k < chart->bands[i].count; k++) {
            const struct band *band = &chart->bands[i];
            extend(range, is_x ? band->x[k] : band->low[k], is_x ? band->x[k] : band->high[k]);
        }
}

static struct range find_range(const struct chart *chart, bool is_x) {
    struct range range = {INFINITY, -INFINITY};
    extend_by_areas(chart, is_x, &range);
    for (int k = 0; k < chart->curve_count; k++)
        for (long i = 0; i < chart->curves[k].count; i++) {
            const struct curve *curve = &chart->curves[k];
            const double value = is_x ? curve->x[i * curve->stride] : y_of(chart, curve, i);
            if (!is_x && chart->is_y_logarithmic && value <= chart->floor)
                continue;
            extend(&range, value, value);
        }
    return range.low <= range.high ? range : (struct range){chart->floor, chart->floor};
}

/* Gives both directions the same scale; one of them then has margins. */
static void make_equal(const struct box *box, struct range *x, struct range *y) {
    const double pixel = fmax((x->high - x->low) / box->width, (y->high - y->low) / box->height);
    const double x_more = pixel * box->width - (x->high - x->low),
                 y_more = pixel * box->height - (y->high - y->low);
    *x = (struct range){x->low - 0.5 * x_more, x->high + 0.5 * x_more};
    *y = (struct range){y->low - 0.5 * y_more, y->high + 0.5 * y_more};
}

static struct scale make_scale(bool is_logarithmic, struct range range, double length, int tick) {
    return (is_logarithmic ? scale_logarithmic : scale_linear)(range.low, range.high, (int)length / tick);
}

static void make_scales(struct box *box, const struct chart *chart) {
    const double room = 0.04; /* margin at each end, as a part of the width */
    struct range x = find_range(chart, true), y = find_range(chart, false);
    if (!chart->is_x_logarithmic)
        scale_widen(&x.low, &x.high, chart->is_path ? room : 0);
    if (!chart->is_y_logarithmic)
        scale_widen(&y.low, &y.high, chart->cell_count > 0 ? 0 : room);
    if (chart->is_equal)
        make_equal(box, &x, &y);
    box->x = make_scale(chart->is_x_logarithmic, x, box->width, X_TICK);
    box->y = make_scale(chart->is_y_logarithmic, y, box->height, Y_TICK);
}

static double pixel_x(const struct box *box, double place) {
    return box->left + place * box->width;
}

/* Values below the axis are drawn on it. */
static double pixel_y(const struct box *box, double place) {
    return box->top + (1 - fmax(place, 0)) * box->height;
}

static void put_x_axis(FILE *out, const struct box *box, const char *label) {
    const double bottom = box->top + box->height;
    char text[SCALE_TEXT];
    for (int i = 0; i < box->x.count; i++) {
        const double x = pixel_x(box, scale_tick(&box->x, i));
        put_line(out, x, box->top, x, bottom, grid);
        put_line(out, x, bottom, x, bottom - 4, frame);
        scale_label(&box->x, i, text);
        put_label(out, x, bottom + 15, "text-anchor=\"middle\"", text, TEXT_MOST);
    }
    scale_note(&box->x, text);
    put_label(out, box->left + box->width, bottom + 32, "text-anchor=\"end\"", text, TEXT_MOST);
    put_label(out, box->left + 0.5 * box->width, bottom + 34, "text-anchor=\"middle\"", label, TEXT_MOST);
}

static void put_y_axis(FILE *out, const struct box *box, const char *label) {
    char text[SCALE_TEXT];
    for (int i = 0; i < box->y.count; i++) {
        const double y = pixel_y(box, scale_tick(&box->y, i));
        put_line(out, box->left, y, box->left + box->width, y, grid);
        put_line(out, box->left, y, box->left + 4, y, frame);
        scale_label(&box->y, i, text);
        put_label(out, box->left - 6, y + 4, "text-anchor=\"end\"", text, TEXT_MOST);
    }
    scale_note(&box->y, text);
    put_label(out, box->left, box->top - 6, "", text, TEXT_MOST);
    put_label(out, 0, 0,
              format_text("text-anchor=\"middle\" transform=\"translate(%.1f %.1f) rotate(-90)\"",
                          box->left - LEFT + 16, box->top + 0.5 * box->height),
              label, TEXT_MOST);
}

static void put_frame(FILE *out, const struct box *box) {
    fprintf(out, "<path d=\"M%.1f %.1fv%.1fh%.1f\" fill=\"none\" stroke=\"%s\"/>\n", box->left, box->top,
            box->height, box->width, frame);
}

static void put_axes(FILE *out, const struct box *box, const struct chart *chart) {
    put_x_axis(out, box, chart->x_label);
    put_y_axis(out, box, chart->y_label);
    put_frame(out, box);
}

/* ---- Curves */

/* Writes each point relative to the one before, in whole tenths of a pixel, so that rounding does not add up.
 * Repeated points are omitted, and so are points without a value, where the curve is broken. */
static void put_way(FILE *out, const struct box *box, const struct chart *chart, const struct curve *curve) {
    const double unit = 10;
    double x = 0, y = 0;
    bool is_first = true, is_broken = true; /* no point yet; none since the last gap */
    for (long i = 0; i < curve->count; i++) {
        const double value = y_of(chart, curve, i);
        const double new_x = round(unit * pixel_x(box, scale_place(&box->x, curve->x[i * curve->stride])));
        const double new_y = round(unit * pixel_y(box, scale_place(&box->y, value)));
        if (isnan(value)) {
            is_broken = true;
            continue;
        }
        if (is_broken || new_x != x || new_y != y)
            fprintf(out,
                    is_first    ? "M%g %gh0"
                    : is_broken ? "m%g %gh0"
                                : "l%g %g",
                    (new_x - x) / unit, (new_y - y) / unit);
        is_first = is_broken = false;
        x = new_x;
        y = new_y;
    }
}

static void put_curve(FILE *out, const struct box *box, const struct chart *chart,
                      const struct curve *curve) {
    fputs(*curve->stroke.dash ? "<path d=\"" : "<path stroke-linecap=\"round\" d=\"", out);
    put_way(out, box, chart, curve);
    put_stroke(out, &curve->stroke, curve->stroke.width);
    if (!curve->stroke.mark)
        return;
    open_marks(out, &curve->stroke);
    for (long i = 0; i < curve->count; i++)
        fprintf(out, "M%.1f %.1f%s", pixel_x(box, scale_place(&box->x, curve->x[i * curve->stride])),
                pixel_y(box, scale_place(&box->y, y_of(chart, curve, i))), curve->stroke.mark);
    fputs("\"/>\n", out);
}

/* ---- Areas */

static void put_cell(FILE *out, const struct box *box, const struct cell *cell) {
    const double left = pixel_x(box, scale_place(&box->x, cell->left)),
                 right = pixel_x(box, scale_place(&box->x, cell->right));
    const double top = pixel_y(box, scale_place(&box->y, cell->high)),
                 bottom = pixel_y(box, scale_place(&box->y, cell->low));
    fprintf(out, "<path fill=\"#%06x\" shape-rendering=\"crispEdges\" d=\"M%.1f %.1fH%.1fV%.1fH%.1fz\"/>\n",
            cell->colour, left, top, right, bottom, left);
}

/* Along the low side, and back along the high one. */
static void put_band(FILE *out, const struct box *box, const struct band *band) {
    fprintf(out, "<path fill=\"#%06x\" d=\"", band->colour);
    for (long i = 0; i < 2 * band->count; i++) {
        const bool is_back = i >= band->count;
        const long at = is_back ? 2 * band->count - 1 - i : i;
        const double y = is_back ? band->high[at] : band->low[at];
        fprintf(out, "%c%.1f %.1f", i == 0 ? 'M' : 'L', pixel_x(box, scale_place(&box->x, band->x[at])),
                pixel_y(box, scale_place(&box->y, y)));
    }
    fputs("z\"/>\n", out);
}

/* ---- The key */

/* If the samples do not all fit, they touch and form a scale of colours. Then only some have a name, always
 * the first and the last. */
static void put_key(FILE *out, const struct box *box, const struct chart *chart) {
    const int count = chart->key_count;
    const double left = box->left + box->width + KEY_GAP;
    const double height = fmin(KEY_HEIGHT, box->height / count);
    const int step = (int)ceil(KEY_LEAST / height);
    if (count == 1 && !*chart->keys[0].name)
        return;
    for (int i = 0; i < count; i++) {
        const struct stroke *stroke = &chart->keys[i].stroke;
        put_sample(out, left, box->top + (i + 0.5) * height, stroke,
                   height < KEY_HEIGHT ? height : stroke->width);
    }
    for (int i = 0; i < count; i += step) {
        const int named = i + step < count ? i : count - 1;
        put_label(out, left + SAMPLE + 6, box->top + (named + 0.5) * height + 4, "", chart->keys[named].name,
                  NAME_MOST);
    }
}

/* Width of the widest key of all charts, so that their boxes are equal; 0 without keys. */
static double key_width(const struct figure *figure) {
    int letters = 0;
    for (int i = 0; i < figure->count; i++)
        for (int j = 0; j < figure->charts[i].key_count; j++) {
            const int count = letters_of(figure->charts[i].keys[j].name);
            letters = count > letters ? count : letters;
        }
    return letters == 0 ? 0 : KEY_GAP + SAMPLE + 6 + LETTER * (letters < NAME_MOST ? letters : NAME_MOST + 3);
}

/* ---- The figure */

static void put_chart(FILE *out, const struct figure *figure, int place, int top) {
    const struct chart *chart = &figure->charts[place];
    struct box box = {.left = place % figure->columns * figure->width + LEFT,
                      .top = top + place / figure->columns * figure->height + ABOVE,
                      .width = figure->width - LEFT - RIGHT - key_width(figure),
                      .height = figure->height - ABOVE - BELOW};
    make_scales(&box, chart);
    put_label(out, box.left, box.top - 22, "font-size=\"13\" font-weight=\"bold\"", chart->title, TEXT_MOST);
    put_axes(out, &box, chart);
    for (int i = 0; i < chart->cell_count; i++)
        put_cell(out, &box, &chart->cells[i]);
    for (int i = 0; i < chart->band_count; i++)
        put_band(out, &box, &chart->bands[i]);
    if (chart->cell_count > 0)
        put_frame(out, &box); /* again, since the cells hide it */
    for (int i = 0; i < chart->curve_count; i++)
        put_curve(out, &box, chart, &chart->curves[i]);
    put_key(out, &box, chart);
}

/* Draws line number `line` at the top. */
static void put_head(FILE *out, const struct key *head, int line) {
    const int y = (line + 1) * HEAD_HEIGHT, left = head->stroke.width > 0 ? SAMPLE + 6 : 0;
    if (left > 0)
        put_sample(out, MARGIN, y - 4, &head->stroke, head->stroke.width);
    put_label(out, MARGIN + left, y, "font-size=\"13\"", head->name, TEXT_MOST);
}

void figures_draw(FILE *out, const struct figure *figure) {
    const int top = MARGIN + figure->head_count * HEAD_HEIGHT, width = figure->columns * figure->width;
    const int height = top + (figure->count + figure->columns - 1) / figure->columns * figure->height;
    fputs("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
          "font-family=\"Helvetica, Arial, sans-serif\"",
          out);
    fprintf(out, " width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" font-size=\"%d\" fill=\"%s\">\n", width,
            height, width, height, TEXT, ink);
    fputs("<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n", out);
    for (int i = 0; i < figure->head_count; i++)
        put_head(out, &figure->heads[i], i);
    for (int i = 0; i < figure->count; i++)
        put_chart(out, figure, i, top);
    fputs("</svg>\n", out);
}
