/*
 * Shows how a sweep file or a table sets a model's names, for test_sweep.py.
 *
 *     sweep_cases MODEL SWEEP.lua or CASES.csv [--brief] [NAME=VALUE ...]
 *
 * prints the cases, the kept results and the options of the motions as JSON; with --brief only the number of
 * cases, seconds of CPU and the program's peak memory. `sweep_cases numbers` reads numbers u and prints, one
 * line each, the normal quantile of u, its logarithm, and the exponential of 100 u - 50. `sweep_cases philox`
 * prints the results of the published test vectors.
 */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "gen/gen.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/random/random.h"

#include <inttypes.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

static int print_numbers(void) {
    double u;
    while (scanf("%lf", &u) == 1)
        printf("%.17g %.17g %.17g\n", random_normal_quantile(u), random_log(u), random_exp(100 * u - 50));
    return 0;
}

static int print_philox(void) {
    static const uint32_t vectors[3][6] = {
        {0},
        {0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF},
        {0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0}};
    for (int i = 0; i < 3; i++) {
        uint32_t result[4];
        random_philox(vectors[i], vectors[i] + 4, result);
        printf("%08" PRIx32 " %08" PRIx32 " %08" PRIx32 " %08" PRIx32 "\n", result[0], result[1], result[2],
               result[3]);
    }
    return 0;
}

static void put_column(struct document *document, const struct varied *column, long count) {
    static const char *const kinds[] = {"parameter", "input", "coordinate", "rate", "option", "samples"};
    format_put_open(document, column->name, '{');
    format_put_text(document, "kind", kinds[column->kind]);
    format_put_text(document, "target", column->target);
    format_put_text(document, "unit", column->unit);
    format_put_open(document, "values", '[');
    for (long i = 0; i < count; i++)
        if (column->texts)
            format_put_text(document, NULL, column->texts[(int)column->values[i]]);
        else
            format_put_number(document, NULL, column->values[i]);
    format_put_close(document, ']');
    format_put_whole(document, "texts", column->text_count);
    format_put_close(document, '}');
}

static void put_names(struct document *document, const char *key, const struct name_list *list) {
    format_put_open(document, key, '[');
    for (int i = 0; i < list->count; i++)
        format_put_text(document, NULL, list->names[i]);
    format_put_close(document, ']');
}

static void put_options(struct document *document, const struct options *options) {
    const char *const texts[][2] = {
        {"method", options_text(options, "method")},       {"from", options_text(options, "from")},
        {"stabilise", options_text(options, "stabilise")}, {"singular", options_text(options, "singular")},
        {"start", options_text(options, "start")},         {"hold", options_text(options, "hold")},
        {"release", options_text(options, "release")},     {"way", options_text(options, "way")}};
    format_put_open(document, "options", '{');
    format_put_number(document, "until", options_number(options, "until"));
    format_put_number(document, "tol", options_number(options, "tol"));
    format_put_number(document, "step", options_number(options, "step"));
    format_put_number(document, "step_max", options_number(options, "step-max"));
    format_put_number(document, "every", options_number(options, "every"));
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        if (texts[i][1])
            format_put_text(document, texts[i][0], texts[i][1]);
    format_put_close(document, '}');
}

static void print_sweep(const struct sweep *sweep, const struct options *options) {
    struct document document;
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    format_put_whole(&document, "count", sweep->cases.count);
    format_put_open(&document, "columns", '{');
    for (int i = 0; i < sweep->cases.width; i++)
        put_column(&document, &sweep->cases.columns[i], sweep->cases.count);
    format_put_close(&document, '}');
    format_put_open(&document, "keep", '{');
    format_put_truth(&document, "final", sweep->keep.final);
    format_put_array(&document, "at", sweep->keep.at, sweep->keep.at_count);
    put_names(&document, "extremes", &sweep->keep.extremes);
    put_names(&document, "norms", &sweep->keep.norms);
    put_names(&document, "history", &sweep->keep.history);
    format_put_close(&document, '}');
    put_options(&document, options);
    format_put_text(&document, "text", sweep->text);
    format_put_close(&document, '}');
    format_document_close(&document, stdout);
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void print_brief(const struct sweep *sweep, double taken) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    printf("{\"count\": %ld, \"seconds\": %g, \"kilobytes\": %ld}\n", sweep->cases.count, taken,
           usage.ru_maxrss);
}

static int read_settings(int argc, char **argv, struct setting *settings, bool *is_brief) {
    int count = 0;
    for (int i = 3; i < argc; i++) {
        char *equals = strchr(argv[i], '=');
        *is_brief = *is_brief || !equals;
        if (!equals)
            continue;
        *equals = 0;
        settings[count++] = (struct setting){.name = argv[i], .value = equals + 1};
    }
    return count;
}

static int print_cases(int argc, char **argv) {
    struct setting settings[8];
    bool is_brief = false;
    struct options options = {.settings = settings};
    options.setting_count = read_settings(argc, argv, settings, &is_brief);
    struct generation model;
    const struct read_request request = {
        .file = argv[1], .settings = settings, .setting_count = options.setting_count};
    if (gen_read(&model, &request, -1) != GEN_OK)
        return 9;
    struct memory memory = format_arena_start();
    struct sweep sweep;
    const size_t length = strlen(argv[2]);
    const bool is_table = length > 4 && strcmp(argv[2] + length - 4, ".csv") == 0;
    const double begin = seconds();
    const enum status status = is_table ? sweeps_read_table(&sweep, &memory, argv[2], &model, &options)
                                        : sweeps_read(&sweep, &memory, argv[2], &model, &options);
    const double taken = seconds() - begin;
    if (status == STATUS_DONE && is_brief)
        print_brief(&sweep, taken);
    else if (status == STATUS_DONE)
        print_sweep(&sweep, &options);
    memory_release(&memory);
    gen_release(&model);
    return (int)status;
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "numbers") == 0)
        return print_numbers();
    if (argc == 2 && strcmp(argv[1], "philox") == 0)
        return print_philox();
    return argc > 2 ? print_cases(argc, argv) : 2;
}
