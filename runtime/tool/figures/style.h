/*
 * The one style of all figures: which colour, line and mark stands for what. A quantity and a method are told
 * by their colour, a run and a stabilisation by the line. Neighbours differ to the colour-blind and in grey
 * print, by lightness.
 */
#ifndef REFDYN_TOOL_STYLE_H
#define REFDYN_TOOL_STYLE_H

/* How a curve is drawn. */
struct stroke {
    unsigned colour;  /* 0xRRGGBB */
    double width;     /* pixels */
    const char *dash; /* as in SVG: lengths of line and gap; "": none */
    const char *mark; /* a path of SVG about the point, NULL: none */
};

/* Quantity number `index` of `count` in a panel, in run number `run` of `runs`. */
struct stroke style_quantity(int index, int count, int run, int runs);
/* What stands for a run in the heading of a figure. */
struct stroke style_run(int run, int runs);
/* A method, by its number, 0 for the automatic choice; the same in every figure. line: 0, or that of another
 * stabilisation. */
struct stroke style_method(int method, int line);
/* A value on a map, 0 to 1 from the lowest to the highest; what has none. */
unsigned style_value(double part);
unsigned style_no_value(void);
/* Around the first quantity: band number `index`, 0 the widest, as a sample of it. */
struct stroke style_band(int index);
/* What is no result: limits, floors. */
struct stroke style_limit(void);

#endif
