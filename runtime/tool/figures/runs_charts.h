/*
 * The charts of a file of runs in the making, and how the numbers for them are read.
 */
#ifndef REFDYN_TOOL_RUNS_CHARTS_H
#define REFDYN_TOOL_RUNS_CHARTS_H

#include "base/memory.h"
#include "batch/runs_file.h"
#include "figures/chart.h"

enum { RUNS_CHARTS_MOST = 12 };

struct runs_charts {
    struct runs_reader *reader;
    const char *path;
    struct memory memory; /* of the numbers that the charts show */
    struct chart charts[RUNS_CHARTS_MOST];
    int chart_count;
    struct key *heads; /* along the top: texts */
    int head_count, head_room;
};

/* One more head, in heap memory, which belongs to the figure. */
void runs_charts_add_head(struct runs_charts *figure, char *text);
/* "E_x [m]", in heap memory; `lead` stands before. */
char *runs_charts_label(const char *lead, const char *name, const char *unit);
/* Whether a number can be drawn: one so large that sums of such numbers have no value is as good as none. */
bool runs_charts_can_draw(double value);
/* `count` numbers from `place` of an item on, of all cases: (cases x count), in the figure's memory. NULL,
 * with a complaint. */
double *runs_charts_read(struct runs_charts *figure, const struct kept_item *item, int place, int count);

#endif
