/* `refdyn batch`: computes many motions of one model and writes them into one file of runs, HDF5 or CSV. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "runtime/tool/batches/runs/runs.h"
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

/* ---- CSV ---- */

/* One row a case: its number, what varied (a start value under NAME_start), its status, and what is kept of
 * its end, extremes and norms. A last column has reasons, but only if at least one case has a reason. Other
 * files therefore have only numbers, except for varied texts. */

static const char *const extremes_suffixes[] = {"_min", "_min_t", "_max", "_max_t", "_beyond_t", "_beyond_s"};

static bool is_limit(const struct kept_item *item) {
    return strcmp(item->group, "limits") == 0;
}

static bool has_extremes(const struct kept_item *item) {
    return is_limit(item) || strcmp(item->group, "extremes") == 0;
}

/* The first item that does not fit into one row, NULL if all fit. */
static const char *csv_unfit(const struct runs_layout *layout) {
    for (int i = 0; i < layout->item_count; i++)
        if (layout->items[i].axis && !has_extremes(&layout->items[i]))
            return layout->items[i].name;
    return NULL;
}

/* A varied coordinate or rate is a start value; the column with its own name has the value at the end. */
static const char *start_suffix(const struct varied *column) {
    return column->kind == VARIED_COORDINATE || column->kind == VARIED_RATE ? "_start" : "";
}

static void csv_header(const struct runs_layout *layout, bool has_reasons, FILE *out) {
    fputs("case", out);
    for (int i = 0; i < layout->cases.width; i++)
        fprintf(out, ",%s%s", layout->cases.columns[i].name, start_suffix(&layout->cases.columns[i]));
    fputs(",status", out);
    for (int i = 0; i < layout->item_count; i++) {
        const struct kept_item *item = &layout->items[i];
        const bool is_norm = strcmp(item->group, "norms") == 0;
        for (int k = 0; k < item->size; k++)
            fprintf(out, ",%s%s%s", is_limit(item) ? "limit_" : "", item->name,
                    has_extremes(item) ? extremes_suffixes[k]
                    : is_norm          ? "_rms"
                                       : "");
    }
    fputs(has_reasons ? ",reason\n" : "\n", out);
}

/* The first name that two columns would share, NULL if all names differ. */
static const char *csv_twice(const struct runs_layout *layout) {
    struct text_set names = {.memory = &format_memory};
    char *header;
    size_t size;
    const char *twice = NULL;
    FILE *out = format_stream(&header, &size);
    csv_header(layout, true, out);
    fclose(out);
    for (char *rest = header, *name; !twice && (name = strsep(&rest, ",\n"));) {
        const int before = names.count, number = sweeps_text_set_add(&names, name);
        twice = number < before ? names.texts[number] : NULL;
    }
    free(header);
    return twice;
}

/* The field of an unknown value is empty. */
static void print_field(double value, FILE *out) {
    fputc(',', out);
    if (!isnan(value))
        format_number(out, value);
}

/* Prints quotes around a text with a comma, quotes or a line break, and doubles its quotes. */
static void print_text(const char *text, FILE *out) {
    const char *quote = strpbrk(text, ",\"\r\n") ? "\"" : "";
    fprintf(out, ",%s", quote);
    for (; *text; text++)
        fputs(*text == '"' ? "\"\"" : (const char[]){*text, '\0'}, out);
    fputs(quote, out);
}

static void csv_row(const struct runs_layout *layout, bool has_reasons, const struct case_record *record,
                    FILE *out) {
    fprintf(out, "%ld", record->number);
    for (int i = 0; i < layout->cases.width; i++) {
        const struct varied *column = &layout->cases.columns[i];
        const double value = column->values[record->number];
        if (column->texts)
            print_text(column->texts[(int)value], out);
        else
            print_field(value, out);
    }
    fprintf(out, ",%d", record->status);
    for (int k = 0; k < layout->width; k++)
        print_field(record->values[k], out);
    if (has_reasons)
        print_text(record->reason, out);
    fputc('\n', out);
}

/* ---- The command ---- */

/* What a call writes. */
struct results {
    struct targets targets;
    struct target *runs, *summary;
    struct journal journal;
    bool is_csv;
};

/* ---- Opening ---- */

static enum status check_csv(const struct batch_setup *setup) {
    const char *path = options_text(&setup->options, "output"), *unfit = csv_unfit(&setup->layout);
    if (unfit)
        return options_usage_error(setup->options.command,
                                   "-o %s: a CSV has one row a case and cannot keep the times of %s; "
                                   "write a file RUNS.h5",
                                   path, unfit);
    const char *twice = csv_twice(&setup->layout);
    if (twice)
        return options_usage_error(
            setup->options.command,
            "-o %s: two columns would have the name %s; write a file RUNS.h5, which has groups", path, twice);
    return STATUS_DONE;
}

/* Checks that the output file can store what is kept. Without a name, as in a trial, it is an HDF5 file. */
static enum status check_output(const struct batch_setup *setup) {
    const char *path = options_text(&setup->options, "output");
    if (path && text_ends_with(path, ".csv"))
        return check_csv(setup);
    if (path && !format_names_hdf5(path))
        return options_usage_error(setup->options.command,
                                   "-o %s: unknown kind of file; the name must end in .h5 or .csv", path);
    return runs_kept_fits_hdf5(&setup->sweep.keep, &setup->layout) ? STATUS_DONE : STATUS_FAULT;
}

static bool spare(void *context, const char *path) {
    system_targets_spare(context, path);
    return true;
}

/* Outputs must not overwrite inputs. */
static void spare_inputs(struct targets *targets, const struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const char *table = options_text(options, "table");
    scene_spare_sources(&setup->base, targets);
    system_targets_spare(targets, table ? table : options->operands[1]);
    if (setup->sweep.table)
        system_targets_spare(targets, setup->sweep.table);
    runs_for_each_file(setup, spare, targets);
}

/* Returns whether the summary would overwrite the journal. */
static bool is_journal(const struct options *options) {
    const char *summary = options_text(options, "summary");
    return summary && strcmp(summary, format_text("%s.journal", options_text(options, "output"))) == 0;
}

static enum status open_results(struct results *results, struct batch_setup *setup) {
    const struct options *options = &setup->options;
    const char *summary = options_text(options, "summary"), *output = options_text(options, "output");
    results->is_csv = text_ends_with(output, ".csv");
    if (is_journal(options))
        return options_usage_error(
            options->command, "--summary %s: this is the journal of %s; use another name", summary, output);
    spare_inputs(&results->targets, setup);
    system_targets_spare(&results->targets, format_text("%s.journal", output));
    results->runs = system_target_open(&results->targets, output);
    if (results->runs && summary)
        results->summary = system_target_open(&results->targets, summary);
    if (!results->runs || (summary && !results->summary))
        return STATUS_FAULT;
    const bool is_open = runs_journal_open(&results->journal, output, &setup->key, setup->sweep.cases.count,
                                           setup->layout.width, options_has(options, "resume")) &&
                         runs_journal_is_within(&results->journal, setup->first, setup->end);
    return is_open ? STATUS_DONE : STATUS_FAULT;
}

/* ---- A trial ---- */

enum { TRIAL_CASES = 32 };

/* Every `distance`-th case from `first` on. */
struct trial_cases {
    long first, distance;
};

static bool is_left_out(void *context, long number) {
    const struct trial_cases *cases = context;
    return (number - cases->first) % cases->distance != 0;
}

static bool forget(void *context, const struct case_record *record) {
    (void)context;
    (void)record;
    return true;
}

static void print_size(double bytes) {
    static const char *const units[] = {"B", "kB", "MB", "GB", "TB"};
    int unit = 0;
    for (; bytes >= 1000 && unit < 4; unit++)
        bytes /= 1000;
    fprintf(stderr, "file         about %.3g %s\n", bytes, units[unit]);
}

static void print_cases(const struct batch_setup *setup) {
    const struct cases *cases = &setup->sweep.cases;
    fprintf(stderr, "cases        %ld", setup->end - setup->first);
    if (setup->end - setup->first < cases->count)
        fprintf(stderr, " of %ld", cases->count);
    fprintf(stderr, ", %d structure%s; what varies:", setup->structures.count,
            setup->structures.count > 1 ? "s" : "");
    for (int i = 0; i < cases->width; i++)
        fprintf(stderr, " %s", cases->columns[i].name);
    fputc('\n', stderr);
}

/* Estimates the time and the size of the batch from a trial of a few cases, whose results are dropped. */
static enum status run_dry(struct batch_setup *setup) {
    const long all = setup->end - setup->first;
    struct trial_cases cases = {setup->first, (all + TRIAL_CASES - 1) / TRIAL_CASES};
    const struct batch_sink sink = {&cases, is_left_out, forget};
    struct batch_count count;
    print_cases(setup);
    const enum status status = runs_compute(setup, &sink, &count);
    if (status != STATUS_DONE || count.cases == 0)
        return status;
    const double width = setup->layout.width + setup->sweep.cases.width + 4;
    fprintf(stderr,
            "time         about %.3g s on %d thread%s, from a trial of %ld cases, of which %ld failed\n",
            count.wall_s * (double)all / (double)count.cases, setup->threads, setup->threads > 1 ? "s" : "",
            count.cases, count.failed.count);
    print_size((double)all * width * sizeof(double));
    return STATUS_DONE;
}

/* ---- The batch ---- */

static bool journal_has(void *context, long number) {
    const struct journal *journal = context;
    return journal->offsets[number] != 0;
}

static bool journal_take(void *context, const struct case_record *record) {
    return runs_journal_put(context, record);
}

static bool write_csv(struct results *results, const struct batch_setup *setup, struct batch_count *count) {
    FILE *out = results->runs->file;
    struct case_record record;
    const bool has_reasons = results->journal.has_reasons;
    csv_header(&setup->layout, has_reasons, out);
    for (long number = setup->first; number < setup->end; number++) {
        if (!runs_journal_get(&results->journal, number, &record))
            return false;
        csv_row(&setup->layout, has_reasons, &record, out);
    }
    runs_time_passed(count);
    return true;
}

/* Scales the times of the cases so that they add up to the processor time of this call. */
static bool share_time(struct runs_writer *writer, struct batch_count *count) {
    runs_time_passed(count);
    return hdf5_runs_share_time(writer, count->cpu_s - count->cases_cpu_s);
}

static bool write_hdf5(struct results *results, const struct batch_setup *setup, struct batch_count *count) {
    struct case_record record;
    struct runs_writer *writer =
        hdf5_runs_create(results->runs->part, &setup->layout, setup->end - setup->first);
    bool is_good = writer != NULL;
    for (long number = setup->first; number < setup->end && is_good; number++)
        is_good = runs_journal_get(&results->journal, number, &record) && hdf5_runs_put(writer, &record);
    is_good = is_good && share_time(writer, count);
    if (is_good)
        return hdf5_runs_finish(writer);
    if (writer)
        hdf5_runs_drop(writer);
    return false;
}

static bool write_summary(const struct batch_setup *setup, const struct batch_count *count,
                          struct target *target) {
    struct document document;
    scene_document_open(&document);
    format_put_whole(&document, "cases", count->cases);
    format_put_whole(&document, "failed", count->failed.count);
    if (setup->structures.count > 0 && setup->structures.list[0].needs & NEEDS_STATICS) {
        format_put_whole(&document, "unstable", count->unstable.count);
        format_put_whole(&document, "beyond_limit_point", count->beyond.count);
    }
    if (count->far.count)
        format_put_whole(&document, "far_starts", count->far.count);
    format_put_number(&document, "wall_s", count->wall_s);
    format_put_number(&document, "cpu_s", count->cpu_s);
    format_put_number(&document, "cases_per_s", count->wall_s > 0 ? (double)count->cases / count->wall_s : 0);
    format_put_whole(&document, "lanes", setup->lanes);
    format_put_whole(&document, "threads", setup->threads);
    format_put_close(&document, '}');
    return format_document_close(&document, target->file) && system_target_finish(target);
}

static void warn_of_starts(const struct noted_cases *noted, const char *equilibrium) {
    if (noted->count)
        fprintf(stderr, "refdyn: warning: %ld case%s from %s, the first is case %ld\n", noted->count,
                noted->count > 1 ? "s start" : " starts", equilibrium, noted->first);
}

static void print_count(const struct batch_setup *setup, const struct batch_count *count) {
    const long all = setup->end - setup->first;
    fprintf(stderr, "cases        %ld, %ld of them computed now, %ld of these failed\n", all, count->cases,
            count->failed.count);
    if (count->failed.count) {
        fprintf(stderr, "failed       case %ld%s: ", count->failed.first,
                count->failed.count > 1 ? ", the first of them" : "");
        format_plain_text(stderr, count->reason);
        fputc('\n', stderr);
    }
    warn_of_starts(&count->unstable, "an unstable equilibrium");
    warn_of_starts(&count->beyond, "an equilibrium that the growing load does not lead to");
    if (count->far.count)
        fprintf(
            stderr,
            "refdyn: warning: %ld case%s far from the programme, the first is case %ld; `refdyn sim` of one "
            "case shows how far its start was moved\n",
            count->far.count, count->far.count > 1 ? "s start" : " starts", count->far.first);
    fprintf(stderr, "time         %.3g s CPU, %.3g s wall on %d thread%s: %.4g cases a second\n",
            count->cpu_s, count->wall_s, setup->threads, setup->threads > 1 ? "s" : "",
            count->wall_s > 0 ? (double)count->cases / count->wall_s : 0);
    if (setup->lanes > 1)
        fprintf(stderr, "lanes        %d; of %ld steps %ld were taken one by one\n", setup->lanes,
                count->steps, count->steps_alone);
}

/* Writes the file once all cases are in the journal. */
static enum status finish(struct results *results, const struct batch_setup *setup,
                          struct batch_count *count) {
    const bool is_written =
        results->is_csv ? write_csv(results, setup, count) : write_hdf5(results, setup, count);
    if (!is_written || !system_target_finish(results->runs)) {
        format_complain("refdyn: the cases are in %s; --resume writes the file from it\n",
                        results->journal.path);
        return STATUS_FAULT;
    }
    runs_journal_remove(&results->journal);
    print_count(setup, count);
    return !results->summary || write_summary(setup, count, results->summary) ? STATUS_DONE : STATUS_FAULT;
}

static enum status compute(struct results *results, struct batch_setup *setup) {
    const struct batch_sink sink = {&results->journal, journal_has, journal_take};
    struct batch_count count;
    system_interrupt_defer(true);
    const enum status status = runs_compute(setup, &sink, &count);
    if (status == STATUS_DONE)
        return finish(results, setup, &count);
    fprintf(stderr, "refdyn: %s%ld of %ld cases are in %s; --resume computes the others\n",
            system_interrupted ? "interrupted: " : "", results->journal.count, setup->end - setup->first,
            results->journal.path);
    return status;
}

/* With --resume and without a journal, an existing file is either the complete result or must not be
 * replaced. A CSV does not identify its batch. */
static enum runs_present_result find_present(const struct batch_setup *setup) {
    const char *path = options_text(&setup->options, "output");
    if (!options_has(&setup->options, "resume") || text_ends_with(path, ".csv"))
        return PRESENT_NONE;
    const bool has_journal = access(format_text("%s.journal", path), F_OK) == 0;
    return has_journal ? PRESENT_NONE : runs_present_result(setup, path, setup->first, setup->end);
}

static enum status compute_missing(struct results *results, struct batch_setup *setup) {
    const enum runs_present_result present = find_present(setup);
    if (present == PRESENT_OTHER) {
        fprintf(stderr,
                "refdyn: --resume continues only the same batch; without --resume the file is replaced\n");
        return STATUS_FAULT;
    }
    if (present == PRESENT_COMPLETE) {
        format_complain("refdyn: %s already has all %ld cases\n", options_text(&setup->options, "output"),
                        setup->end - setup->first);
        return STATUS_DONE;
    }
    const enum status status = open_results(results, setup);
    return status == STATUS_DONE ? compute(results, setup) : status;
}

enum status runs_batch(const struct options *options) {
    const bool has_dry_run = options_has(options, "dry-run");
    struct batch_setup setup;
    struct results results = {.journal = {.file = -1}};
    if (!options_text(options, "output") && !has_dry_run)
        return options_usage_error(options->command, "-o is missing");
    enum status status = runs_setup_open(&setup, options);
    if (status == STATUS_DONE)
        status = check_output(&setup);
    if (status == STATUS_DONE)
        status = has_dry_run ? run_dry(&setup) : compute_missing(&results, &setup);
    runs_journal_close(&results.journal);
    system_targets_release(&results.targets);
    runs_setup_close(&setup);
    return status;
}

const struct option_rule runs_batch_rules[] = {
    {"table", "CASES.csv", OPTION_TEXT,
     "replaces SWEEP.lua: a row for each case, a column for each name that varies", NULL, NULL},
    {"threads", "N", OPTION_COUNT, "threads that compute cases (default: one for each processor)", NULL,
     NULL},
    {"cases", "A:B", OPTION_TEXT, "only the cases from A to B - 1", NULL, NULL},
    {"resume", NULL, OPTION_FLAG, "resume an interrupted batch", NULL, NULL},
    {"dry-run", NULL, OPTION_FLAG,
     "check, compile and try a few cases; print the number of cases, and the time and size of the "
     "whole batch",
     NULL, NULL},
    {.name = NULL}};
