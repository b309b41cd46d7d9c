/* `refdyn merge`: joins files of runs of the same batch into one, in the order of the cases. */
#include "runtime/tool/support/hdf5/hdf5_files.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char missing_name[] = "missing";

/* Attributes that may differ between parts of one batch: when and how the parts were computed. */
static const char *const free_names[] = {"command", "created", "started", "finished",  "wall_s",
                                         "cpu_s",   "threads", "host",    missing_name};
/* This attribute is copied from the first file; paths of the cases are relative to it. */
static const char folder_name[] = "folder";

struct merge {
    int file_count;
    const char *const *paths;
    struct runs_reader **readers; /* (file_count) NULL while not open */
    long *rows;                   /* (file_count) the next row of each file */
    struct runs_layout layout;    /* of the output */
    long count;                   /* cases of all files */
    struct memory memory;
    struct targets targets;
};

static bool refuse(const char *path, const char *fact) {
    format_complain_line(path, 0, fact);
    return false;
}

/* ---- The same batch ---- */

static bool is_free(const char *name) {
    for (size_t i = 0; i < sizeof free_names / sizeof free_names[0]; i++)
        if (strcmp(name, free_names[i]) == 0)
            return true;
    return false;
}

/* The first attribute of `a` that `b` lacks or that differs there; NULL if there is none. */
static const char *other_attribute(const struct runs_reader *a, const struct runs_reader *b) {
    const struct runs_layout *layout = hdf5_runs_layout(a);
    for (int i = 0; i < layout->attribute_count; i++) {
        const char *name = layout->attributes[i].name, *other = hdf5_runs_attribute(b, name);
        if (!is_free(name) && strcmp(name, folder_name) != 0 &&
            (!other || strcmp(layout->attributes[i].text, other) != 0))
            return name;
    }
    return NULL;
}

static bool is_same_text(const char *a, const char *b) {
    return a == b || (a && b && strcmp(a, b) == 0);
}

static bool is_same_item(const struct kept_item *a, const struct kept_item *b) {
    return is_same_text(a->group, b->group) && is_same_text(a->name, b->name) &&
           is_same_text(a->unit, b->unit) && is_same_text(a->axis, b->axis) && a->size == b->size;
}

static bool is_same_axis(const struct kept_axis *a, const struct kept_axis *b) {
    if (!is_same_text(a->path, b->path) || !is_same_text(a->unit, b->unit) || a->count != b->count ||
        !a->values != !b->values)
        return false;
    for (int i = 0; i < a->count; i++)
        if (a->values ? a->values[i] != b->values[i] : !is_same_text(a->names[i], b->names[i]))
            return false;
    return true;
}

static bool is_same_column(const struct varied *a, const struct varied *b) {
    return is_same_text(a->name, b->name) && is_same_text(a->target, b->target) &&
           is_same_text(a->unit, b->unit) && a->kind == b->kind && !a->texts == !b->texts;
}

/* Words for what differs in the layouts, NULL if nothing does. */
static const char *other_part(const struct runs_layout *a, const struct runs_layout *b) {
    if (a->cases.width != b->cases.width)
        return "the list of varied names";
    for (int i = 0; i < a->cases.width; i++)
        if (!is_same_column(&a->cases.columns[i], &b->cases.columns[i]))
            return "the list of varied names";
    if (a->item_count != b->item_count || a->axis_count != b->axis_count)
        return "the list of kept values";
    for (int i = 0; i < a->item_count; i++)
        if (!is_same_item(&a->items[i], &b->items[i]))
            return "the list of kept values";
    for (int i = 0; i < a->axis_count; i++)
        if (!is_same_axis(&a->axes[i], &b->axes[i]))
            return "an axis of the kept values";
    return NULL;
}

static bool check_same(const struct merge *merge, int file) {
    const struct runs_reader *a = merge->readers[0], *b = merge->readers[file];
    const char *name = other_attribute(a, b);
    name = name ? name : other_attribute(b, a);
    if (name)
        return refuse(
            merge->paths[file],
            format_text("belongs to another batch than %s: attribute '%s' differs", merge->paths[0], name));
    if (hdf5_runs_batch_count(a) != hdf5_runs_batch_count(b))
        return refuse(merge->paths[file],
                      format_text("belongs to another batch than %s: it has %ld cases, not %ld",
                                  merge->paths[0], hdf5_runs_batch_count(b), hdf5_runs_batch_count(a)));
    const char *part = other_part(hdf5_runs_layout(a), hdf5_runs_layout(b));
    return !part || refuse(merge->paths[file], format_text("belongs to another batch than %s: %s differs",
                                                           merge->paths[0], part));
}

/* ---- Numbers of cases as ranges ---- */

/* Text such as "3-5, 9", built number by number. */
struct ranges {
    FILE *out;
    char *text;
    size_t size;
    long first, last; /* the range that is not yet written */
    long count;
};

static void ranges_start(struct ranges *ranges) {
    *ranges = (struct ranges){.first = -1};
    ranges->out = format_stream(&ranges->text, &ranges->size);
}

static void write_range(struct ranges *ranges) {
    const bool is_first = ranges->count == ranges->last - ranges->first + 1;
    if (ranges->count == 0)
        return;
    fprintf(ranges->out, "%s%ld", is_first ? "" : ", ", ranges->first);
    if (ranges->last > ranges->first)
        fprintf(ranges->out, "-%ld", ranges->last);
}

/* Adds the numbers [from, to). They ascend from call to call. */
static void ranges_add(struct ranges *ranges, long from, long to) {
    if (from >= to)
        return;
    if (ranges->count == 0 || from > ranges->last + 1) {
        write_range(ranges);
        ranges->first = from;
    }
    ranges->last = to - 1;
    ranges->count += to - from;
}

/* Completes ranges->text; the caller frees it. */
static void ranges_end(struct ranges *ranges) {
    write_range(ranges);
    fclose(ranges->out);
}

/* Reports the cases that two files share. */
static bool check_apart(const struct merge *merge, int a, int b) {
    const long *x = hdf5_runs_numbers(merge->readers[a]), *y = hdf5_runs_numbers(merge->readers[b]);
    const long x_count = hdf5_runs_count(merge->readers[a]), y_count = hdf5_runs_count(merge->readers[b]);
    struct ranges ranges;
    ranges_start(&ranges);
    for (long i = 0, j = 0; i < x_count && j < y_count;) {
        if (x[i] == y[j])
            ranges_add(&ranges, x[i], x[i] + 1);
        const bool moves_x = x[i] <= y[j], moves_y = y[j] <= x[i];
        i += moves_x;
        j += moves_y;
    }
    ranges_end(&ranges);
    if (ranges.count > 0)
        refuse(merge->paths[b], format_text("shares cases with %s: %s; merge parts without common cases",
                                            merge->paths[a], ranges.text));
    free(ranges.text);
    return ranges.count == 0;
}

static bool check_all(const struct merge *merge) {
    for (int i = 1; i < merge->file_count; i++)
        if (!check_same(merge, i))
            return false;
    for (int i = 1; i < merge->file_count; i++)
        for (int j = 0; j < i; j++)
            if (!check_apart(merge, j, i))
                return false;
    return true;
}

/* ---- What is written ---- */

/* The file whose next case has the lowest number, -1 after the last case. */
static int next_file(const struct merge *merge) {
    int next = -1;
    long lowest = 0;
    for (int i = 0; i < merge->file_count; i++) {
        if (merge->rows[i] == hdf5_runs_count(merge->readers[i]))
            continue;
        const long number = hdf5_runs_numbers(merge->readers[i])[merge->rows[i]];
        if (next < 0 || number < lowest) {
            next = i;
            lowest = number;
        }
    }
    return next;
}

/* Warns of cases that no file has, and returns them as ranges in heap memory; NULL if all are there. */
static char *find_missing(struct merge *merge, long total) {
    struct ranges ranges;
    long expected = 0;
    ranges_start(&ranges);
    for (int file; (file = next_file(merge)) >= 0;) {
        const long number = hdf5_runs_numbers(merge->readers[file])[merge->rows[file]++];
        ranges_add(&ranges, expected, number);
        expected = number + 1;
    }
    ranges_add(&ranges, expected, total);
    ranges_end(&ranges);
    memset(merge->rows, 0, (size_t)merge->file_count * sizeof *merge->rows);
    if (ranges.count > 0) {
        fprintf(stderr, "refdyn: warning: %ld of %ld cases are missing from all files: %s\n", ranges.count,
                total, ranges.text);
        return ranges.text;
    }
    free(ranges.text);
    return NULL;
}

/* Joins one column of all files, with values by the number of the case. The texts of a file follow those of
 * the files before it. */
static struct varied join_column(struct merge *merge, int column, long total) {
    struct varied joined = hdf5_runs_layout(merge->readers[0])->cases.columns[column];
    joined.values = memory_get(&merge->memory, ((size_t)total + 1) * sizeof *joined.values);
    joined.text_count = 0;
    for (int i = 0; i < merge->file_count; i++)
        joined.text_count += hdf5_runs_layout(merge->readers[i])->cases.columns[column].text_count;
    if (joined.texts)
        joined.texts = memory_get(&merge->memory, ((size_t)joined.text_count + 1) * sizeof *joined.texts);
    for (int i = 0, before = 0; i < merge->file_count; i++) {
        const struct varied *part = &hdf5_runs_layout(merge->readers[i])->cases.columns[column];
        const long *numbers = hdf5_runs_numbers(merge->readers[i]);
        for (int k = 0; k < part->text_count; k++)
            joined.texts[before + k] = part->texts[k];
        for (long row = 0; row < hdf5_runs_count(merge->readers[i]); row++)
            joined.values[numbers[row]] = part->values[row] + (part->texts ? before : 0);
        before += part->text_count;
    }
    return joined;
}

/* Copies the attributes of the first file that concern the whole batch. */
static void join_attributes(struct merge *merge, const char *missing) {
    const struct runs_layout *first = hdf5_runs_layout(merge->readers[0]);
    struct attribute *attributes =
        memory_get(&merge->memory, ((size_t)first->attribute_count + 1) * sizeof *attributes);
    int count = 0;
    for (int i = 0; i < first->attribute_count; i++)
        if (!is_free(first->attributes[i].name))
            attributes[count++] = first->attributes[i];
    if (missing)
        attributes[count++] = (struct attribute){missing_name, missing};
    merge->layout.attributes = attributes;
    merge->layout.attribute_count = count;
}

/* Refuses a number of cases that is far too large, as a damaged file may have it. */
static bool check_total(const struct merge *merge, long total) {
    enum { MOST = 100000000 };
    return total <= MOST ||
           refuse(merge->paths[0],
                  format_text("belongs to a batch of %ld cases; at most %d can be merged", total, (int)MOST));
}

static void join_layout(struct merge *merge, long total, const char *missing) {
    struct cases *cases = &merge->layout.cases;
    merge->layout = *hdf5_runs_layout(merge->readers[0]);
    cases->count = total;
    cases->columns = memory_get(&merge->memory, ((size_t)cases->width + 1) * sizeof *cases->columns);
    for (int i = 0; i < cases->width; i++)
        cases->columns[i] = join_column(merge, i, total);
    for (int i = 0; i < merge->file_count; i++)
        merge->count += hdf5_runs_count(merge->readers[i]);
    join_attributes(merge, missing);
}

static bool copy_cases(struct merge *merge, struct runs_writer *writer) {
    for (int file; (file = next_file(merge)) >= 0;) {
        struct case_record record;
        if (!hdf5_runs_get(merge->readers[file], merge->rows[file]++, &record) ||
            !hdf5_runs_put(writer, &record))
            return false;
    }
    return true;
}

static bool write_all(struct merge *merge, struct target *target) {
    struct runs_writer *writer = hdf5_runs_create(target->part, &merge->layout, merge->count);
    if (!writer)
        return false;
    if (copy_cases(merge, writer))
        return hdf5_runs_finish(writer) && system_target_finish(target);
    hdf5_runs_drop(writer);
    return false;
}

/* ---- The command ---- */

static bool open_files(struct merge *merge) {
    for (int i = 0; i < merge->file_count; i++) {
        merge->readers[i] = hdf5_runs_open(merge->paths[i]);
        if (!merge->readers[i])
            return false;
    }
    return true;
}

static bool merge_into(struct merge *merge, const char *path) {
    for (int i = 0; i < merge->file_count; i++)
        system_targets_spare(&merge->targets, merge->paths[i]);
    struct target *target = system_target_open(&merge->targets, path);
    if (!target)
        return false;
    if (!target->part)
        return refuse(target->name, "output: not a regular file; HDF5 needs one");
    if (!format_names_hdf5(path))
        return refuse(path, "output: an HDF5 file is written; its name must end in .h5");
    if (!open_files(merge) || !check_all(merge))
        return false;
    const long total = hdf5_runs_batch_count(merge->readers[0]);
    if (!check_total(merge, total))
        return false;
    char *missing = find_missing(merge, total);
    join_layout(merge, total, missing);
    const bool is_written = write_all(merge, target);
    free(missing);
    return is_written;
}

static enum status run_merge(const struct options *options) {
    const size_t count = (size_t)options->operand_count;
    struct merge merge = {.file_count = options->operand_count,
                          .paths = options->operands,
                          .readers = format_allocate(count, sizeof *merge.readers),
                          .rows = format_allocate(count, sizeof *merge.rows),
                          .memory = format_arena_start()};
    const bool is_good = merge_into(&merge, options_text(options, "output"));
    for (int i = 0; i < merge.file_count; i++)
        if (merge.readers[i])
            hdf5_runs_close(merge.readers[i]);
    system_targets_release(&merge.targets);
    memory_release(&merge.memory);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

const struct command merge_command = {
    .name = "merge",
    .run = run_merge,
    .operands = "RUNS.h5...",
    .options = "output!",
    .output = "FILE.h5",
    .purpose = "join files of runs of the same batch",
    .help = "Cases are in the order of their numbers. Files of another batch, and cases that two files have, "
            "are refused.\n"
            "Cases that no file has are reported, and listed in the attribute 'missing'.\n\n"
            "  refdyn merge part_1.h5 part_2.h5 -o runs.h5\n"};
