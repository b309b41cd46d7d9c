/* The colours, lines and marks of all figures. */
#include "runtime/tool/results/figures/figures.h"

#include <stddef.h>

enum { COLOURS = 10, DASHES = 5, MARKS = 10, MAP_STOPS = 6 };

/* After Okabe and Ito (jfly.uni-koeln.de/color, 2008), some of them darker; dark and light alternate. */
static const unsigned colours[COLOURS] = {0x0072b2, 0xe69f00, 0x00604a, 0xcc79a7, 0x333333,
                                          0x56b4e9, 0xa84400, 0xb5b52f, 0x6a3d9a, 0xf08f80};
/* For many curves: from dark to light in equal steps, like viridis (van der Walt and Smith, matplotlib 1.5,
 * 2015). It ends before the yellow that is too pale for a line. */
static const unsigned map[MAP_STOPS] = {0x440154, 0x414487, 0x2a788e, 0x22a884, 0x7ad151, 0xb8be14};
static const char *const dashes[DASHES] = {"", "6 3", "2 2", "8 2 2 2", "12 4"};
static const char *const marks[MARKS] = {
    "m-3.4 0a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0-6.8 0z",
    "m-3-3h6v6h-6z",
    "m0-4.4l4.4 4.4l-4.4 4.4l-4.4-4.4z",
    "m0-4.2l4.2 7.2h-8.4z",
    "m0 4.2l-4.2-7.2h8.4z",
    "m-1.3-4.2h2.6v2.9h2.9v2.6h-2.9v2.9h-2.6v-2.9h-2.9v-2.6h2.9z",
    "m0-1.9l2.1-2.1l1.9 1.9l-2.1 2.1l2.1 2.1l-1.9 1.9l-2.1-2.1l-2.1 2.1l-1.9-1.9l2.1-2.1l-2.1-2.1l1.9-1.9z",
    "m4.2 0l-7.2 4.2v-8.4z",
    "m-4.2 0l7.2-4.2v8.4z",
    "m-3.4-3.4h6.8l-6.8 6.8h6.8z"};

static const double plain_width = 1.5, thin_width = 1, band_width = 3.6;

/* (1 - part) a + part b, for each colour. */
static unsigned mix(unsigned a, unsigned b, double part) {
    unsigned mixed = 0;
    for (int shift = 0; shift <= 16; shift += 8) {
        const double x = a >> shift & 0xff, y = b >> shift & 0xff;
        mixed |= (unsigned)(x + part * (y - x) + 0.5) << shift;
    }
    return mixed;
}

static unsigned colour_on_map(double part) {
    const double at = part * (MAP_STOPS - 1);
    const int stop = at < MAP_STOPS - 1 ? (int)at : MAP_STOPS - 2;
    return mix(map[stop], map[stop + 1], at - stop);
}

static struct stroke band(struct stroke stroke) {
    const double paleness = 0.55;
    stroke.colour = mix(stroke.colour, 0xffffff, paleness);
    stroke.width = band_width;
    return stroke;
}

/* With several runs, every second one is a pale band. The next one remains visible on it where both coincide.
 */
static struct stroke in_run(struct stroke stroke, int run, int runs) {
    if (runs == 1)
        return stroke;
    stroke.dash = dashes[run / 2 % DASHES];
    return run % 2 == 0 ? band(stroke) : stroke;
}

struct stroke figures_style_quantity(int index, int count, int run, int runs) {
    struct stroke stroke = {colours[index % COLOURS], plain_width, dashes[0], NULL};
    if (count > COLOURS) {
        stroke.colour = colour_on_map((double)index / (count - 1));
        stroke.width = thin_width;
    }
    return in_run(stroke, run, runs);
}

struct stroke figures_style_run(int run, int runs) {
    return in_run((struct stroke){0x000000, plain_width, dashes[0], NULL}, run, runs);
}

struct stroke figures_style_method(int method, int line) {
    struct stroke stroke = {colours[method % COLOURS], plain_width, dashes[line % DASHES],
                            marks[method % MARKS]};
    return method == 0 ? band(stroke) : stroke;
}

unsigned figures_style_value(double part) {
    return colour_on_map(part);
}

unsigned figures_style_no_value(void) {
    return 0xd4d4d4;
}

struct stroke figures_style_band(int index) {
    const double paleness = 0.8, step = 0.3, height = 12;
    return (struct stroke){mix(colours[0], 0xffffff, paleness - step * index), height, dashes[0], NULL};
}

struct stroke figures_style_limit(void) {
    return (struct stroke){0x888888, thin_width, dashes[2], NULL};
}
