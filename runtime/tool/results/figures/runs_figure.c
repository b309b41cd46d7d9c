/* Chooses and draws the charts of a file of runs. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/support/command_line/command_line.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>

enum { RESPONSES_MOST = 6, BANDS_MOST = 6, WIDTH = 520, HEIGHT = 330 };

static const char extremes_group[] = "extremes", history_group[] = "history", final_group[] = "final";

/* ---- The charts ---- */

static bool is_in(const struct kept_item *item, const char *group) {
    return strcmp(item->group, group) == 0;
}

/* Extremes are smallest, its time, largest, its time; the largest is drawn. */
enum { PLACE_OF_LARGEST = 2, EXTREMES = 4 };

static bool add_item(struct runs_charts *figure, const struct kept_item *item) {
    if (is_in(item, history_group))
        return figures_bands_add(figure, item);
    return figures_response_add(figure, item,
                                is_in(item, extremes_group) && item->size == EXTREMES ? PLACE_OF_LARGEST : 0);
}

/* Adds at most `most` items of a group. */
static bool add_group(struct runs_charts *figure, const char *group, int most, int *count) {
    const struct runs_layout *layout = hdf5_runs_layout(figure->reader);
    *count = 0;
    for (int i = 0; i < layout->item_count && *count < most; i++)
        if (is_in(&layout->items[i], group) && strcmp(layout->items[i].name, "t") != 0) {
            if (!add_item(figure, &layout->items[i]))
                return false;
            ++*count;
        }
    return true;
}

/* Adds extremes, or final values if there are no extremes, and histories. */
static bool add_default(struct runs_charts *figure) {
    int count;
    if (!add_group(figure, extremes_group, RESPONSES_MOST, &count))
        return false;
    if (count == 0 && !add_group(figure, final_group, RESPONSES_MOST, &count))
        return false;
    return add_group(figure, history_group, BANDS_MOST, &count);
}

static const struct kept_item *find_item(const struct runs_layout *layout, const char *name) {
    for (int i = 0; i < layout->item_count; i++) {
        const struct kept_item *item = &layout->items[i];
        const size_t length = strlen(item->group);
        if (strncmp(name, item->group, length) == 0 && name[length] == '/' &&
            strcmp(name + length + 1, item->name) == 0)
            return item;
    }
    return NULL;
}

static bool refuse_panel(const struct runs_charts *figure, const char *name, const char *fact) {
    char *text = format_text("--panel: '%s' %s", name, fact);
    format_complain_line(figure->path, 0, text);
    return false;
}

static bool add_named(struct runs_charts *figure, const char *panels) {
    bool is_good = true;
    const char **names = options_list(panels);
    for (int i = 0; is_good && names[i]; i++) {
        const char *name = names[i];
        const struct kept_item *item = find_item(hdf5_runs_layout(figure->reader), name);
        if (!item)
            is_good = refuse_panel(figure, name, "is not in the file; name a kept value as in history/E_x");
        else if (figure->chart_count == RUNS_CHARTS_MOST)
            is_good = refuse_panel(figure, name, "is one too many; a figure has at most 12 panels");
        else
            is_good = add_item(figure, item);
    }
    return is_good;
}

/* ---- The whole ---- */

static void draw(const struct runs_charts *figure, FILE *out) {
    const int count = figure->chart_count;
    const struct figure drawn = {.heads = figure->heads,
                                 .head_count = figure->head_count,
                                 .charts = figure->charts,
                                 .count = count,
                                 .columns = count > 6   ? 3
                                            : count > 1 ? 2
                                                        : 1,
                                 .width = count > 1 ? WIDTH : 3 * WIDTH / 2,
                                 .height = HEIGHT};
    figures_draw(out, &drawn);
}

static void release(struct runs_charts *figure) {
    if (figure->reader)
        hdf5_runs_close(figure->reader);
    memory_release(&figure->memory);
}

static bool make(struct runs_charts *figure, const char *panels) {
    if (!figure->reader || !figures_worst_add(figure))
        return false;
    if (!(panels ? add_named(figure, panels) : add_default(figure)))
        return false;
    if (figure->chart_count > 0)
        return true;
    format_complain_line(figure->path, 0, "no case has a number to draw");
    return false;
}

bool figures_runs_figure_draw(const char *path, const char *panels, FILE *out) {
    struct runs_charts figure = {
        .path = path, .memory = format_arena_start(), .reader = hdf5_runs_open(path)};
    const bool is_made = make(&figure, panels);
    if (is_made)
        draw(&figure, out);
    release(&figure);
    return is_made;
}
