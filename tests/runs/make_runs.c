/*
 * Writes a file of runs with reproducible numbers: `make_runs PATH TOTAL FROM STEP COUNT [NAME=TEXT ...]`,
 * the cases FROM, FROM + STEP ... of a batch of TOTAL, with these attributes. `make_runs PATH` prints the
 * numbers of the cases in a file.
 */
#include "runtime/tool/support/hdf5/hdf5_files.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TIMES = 5, EXTREMES = 4, PLACES_OF_CASES = 1000 };

/* splitmix64 (Steele, Lea and Flood, 2014). */
static uint64_t random_bits(uint64_t index) {
    uint64_t z = (index + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* Any number: huge, tiny, infinite; all NaN have the same bits. */
static double random_number(long number, int place) {
    const uint64_t bits = random_bits((uint64_t)number * PLACES_OF_CASES + (uint64_t)place);
    double value;
    memcpy(&value, &bits, sizeof value);
    return isnan(value) ? NAN : value;
}

static const char *programs[] = {"chapter", "größer als ∂x/∂t", "", "none"};
static const char *const which[] = {"smallest", "its time", "largest", "its time, too"};
static const double times[TIMES] = {0, 0.1, 0.25, 0.5, 1};

static struct kept_axis axes[] = {{"extremes/which", NULL, EXTREMES, NULL, which},
                                  {"history/t", "s", TIMES, times, NULL}};

static struct kept_item items[] = {
    {"final", "t", "s", 1, 0, NULL},
    {"final", "E_x", "m", 1, 1, NULL},
    {"final", "course", NULL, 1, 2, NULL},
    {"extremes", "E_x", "m", EXTREMES, 3, "extremes/which"},
    {"history", "E_x", "m", TIMES, 3 + EXTREMES, "history/t"},
    {"history", "energy", "J", TIMES, 3 + EXTREMES + TIMES, "history/t"},
};

enum { WIDTH = 3 + EXTREMES + 2 * TIMES, ITEMS = sizeof items / sizeof items[0] };

static struct cases make_cases(long total) {
    static struct varied columns[] = {{.name = "m_E", .target = "m_E", .unit = "kg"},
                                      {.name = "arm_psi_d", .target = "arm_psi", .unit = "rad/s"},
                                      {.name = "program", .target = "program", .unit = ""}};
    const enum varied_kind kinds[] = {VARIED_PARAMETER, VARIED_RATE, VARIED_OPTION};
    for (int i = 0; i < 3; i++) {
        columns[i].kind = kinds[i];
        columns[i].values = calloc((size_t)total + 1, sizeof(double));
        for (long k = 0; k < total; k++)
            columns[i].values[k] = i < 2 ? random_number(k, 100 + i) : (double)(random_bits((uint64_t)k) % 4);
    }
    columns[2].texts = programs;
    columns[2].text_count = 4;
    return (struct cases){.count = total, .width = 3, .columns = columns};
}

static bool put(struct runs_writer *writer, long number) {
    double values[WIDTH];
    char reason[100] = "";
    const int status = number % 7 == 3 ? 3 : number % 11 == 5 ? 1 : 0;
    for (int i = 0; i < WIDTH; i++)
        values[i] = status == 3 && i % 2 ? NAN : random_number(number, i);
    if (status == 3)
        snprintf(reason, sizeof reason, "case %ld: Schrittweite zu klein, ∂φ/∂q „singulär“ 𝜑", number);
    const struct case_record record = {.number = number,
                                       .status = status,
                                       .steps = (long)(random_bits((uint64_t)number) >> 12),
                                       .cpu_s = random_number(number, 200),
                                       .reason = reason,
                                       .values = values};
    return hdf5_runs_put(writer, &record);
}

static int print_numbers(const char *path) {
    struct runs_reader *reader = hdf5_runs_open(path);
    if (!reader)
        return 1;
    for (long i = 0; i < hdf5_runs_count(reader); i++)
        printf("%ld\n", hdf5_runs_numbers(reader)[i]);
    hdf5_runs_close(reader);
    return 0;
}

int main(int argc, char **argv) {
    struct attribute attributes[16];
    struct runs_layout layout = {.item_count = ITEMS,
                                 .axis_count = 2,
                                 .items = items,
                                 .axes = axes,
                                 .attributes = attributes,
                                 .width = WIDTH};
    if (argc == 2)
        return print_numbers(argv[1]);
    const long from = atol(argv[3]), step = atol(argv[4]), count = atol(argv[5]);
    layout.cases = make_cases(atol(argv[2]));
    for (int i = 6; i < argc; i++) {
        char *equals = strchr(argv[i], '=');
        *equals = '\0';
        attributes[layout.attribute_count++] = (struct attribute){argv[i], equals + 1};
    }
    struct runs_writer *writer = hdf5_runs_create(argv[1], &layout, count);
    bool is_good = writer != NULL;
    for (long i = 0; i < count && is_good; i++)
        is_good = put(writer, from + i * step);
    if (writer)
        is_good = hdf5_runs_finish(writer) && is_good;
    return is_good ? 0 : 1;
}
