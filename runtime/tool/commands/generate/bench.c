/* `refdyn bench`: time and operations of each emitted quantity, and the cost of generating and compiling. */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum {
    BATCHES = 41,
    LOW_BATCH = 4,
    HIGH_BATCH = 36 /* quantiles of the sorted batches: one tenth and nine tenths */
};

static const double batch_seconds =
    5e-4; /* long compared with the clock's resolution, short compared with a time slice */

struct quantity {
    const char *name;
    size_t offset; /* of its function in struct refdyn_model */
};

#define QUANTITY(name) {#name, offsetof(struct refdyn_model, name)},
static const struct quantity quantities[] = {REFDYN_QUANTITIES(QUANTITY)};

enum { QUANTITY_COUNT = sizeof quantities / sizeof quantities[0] };

/* A function that is measured, and its arguments. */
struct subject {
    refdyn_function *function;
    struct scene *scene;
    double *rest; /* (3 n + 1 + m) arguments of a tangent: rates and the results of `constrained`; zeros */
    double *out;
};

static void call(const struct subject *subject, long times) {
    const struct scene *scene = subject->scene;
    const struct refdyn_workspace *work = &scene->work;
    for (long i = 0; i < times; i++)
        subject->function(work->p, work->x, scene->state.t, scene->q, subject->rest, subject->out);
}

static double timed(const struct subject *subject, long times) {
    double start = system_cpu_seconds();
    call(subject, times);
    return system_cpu_seconds() - start;
}

/* Nanoseconds per call of each batch, sorted. */
static void measure(const struct subject *subject, double ns[static BATCHES]) {
    long times = 1;
    while (timed(subject, times) < batch_seconds)
        times *= 2;
    for (int i = 0; i < BATCHES; i++)
        ns[i] = 1e9 * timed(subject, times) / (double)times;
    qsort(ns, BATCHES, sizeof *ns, format_ascending);
}

/* Rounds to a tenth of a nanosecond; more digits are noise. */
static double tenths(double ns) {
    return round(10 * ns) / 10;
}

static bool print_quantity(FILE *out, const char *name, const struct subject *subject,
                           const struct operation_count *count) {
    struct document document;
    double ns[BATCHES];
    measure(subject, ns);
    format_document_open(&document);
    document.one_line = true;
    format_put_open(&document, NULL, '{');
    format_put_text(&document, "quantity", name);
    format_put_whole(&document, "n", subject->scene->model->n);
    format_put_whole(&document, "adds", count->adds);
    format_put_whole(&document, "muls", count->muls);
    format_put_whole(&document, "divs", count->divs);
    format_put_whole(&document, "funcs", count->functions);
    format_put_whole(&document, "bytes", count->bytes);
    format_put_number(&document, "ns", tenths(ns[BATCHES / 2]));
    format_put_number(&document, "ns_low", tenths(ns[LOW_BATCH]));
    format_put_number(&document, "ns_high", tenths(ns[HIGH_BATCH]));
    format_put_close(&document, '}');
    return format_document_close(&document, out);
}

static refdyn_function *function_of(const struct refdyn_model *model, const struct quantity *quantity) {
    refdyn_function *function;
    memcpy(&function, (const char *)model + quantity->offset, sizeof function);
    return function;
}

/* A state without symmetry near the initial one, the same in every run, from fractions of multiples of the
 * golden ratio. */
static void disturb(struct scene *scene) {
    const double golden = 0.6180339887498949, angle = 0.1, rate = 0.5; /* rad or m; rad/s or m/s */
    double part = 0.2385;
    for (int i = 0; i < 2 * scene->model->n; i++) {
        part += golden;
        part -= (double)(long)part;
        if (i < scene->model->n)
            scene->q[i] += angle * (part - 0.5);
        else
            scene->qd[i - scene->model->n] += rate * (part - 0.5);
    }
    scene->state.t = 2.385;
}

/* The size of the largest result: equations, columns of points, derivatives, vectors of joints, named values.
 */
static size_t result_size(const struct refdyn_model *model) {
    size_t n = (size_t)model->n, m = (size_t)model->m, points = (size_t)model->point_count;
    size_t variables = 2 * n + 1 + (size_t)model->input_count + (size_t)model->parameter_count;
    size_t named = (size_t)model->course_count + (size_t)model->break_count + (size_t)model->switch_count +
                   1 + (size_t)model->anchored_count + (size_t)model->change_count +
                   ((size_t)model->event_count + (size_t)model->kink_count) * (2 * n + 3);
    size_t vectors = n * (2 + 3 * (REFDYN_VECTOR_COUNT + (size_t)model->coupling_count));
    return (n + 3 * m + 1) * (variables + n + 4) + 3 * points * (n + 1) + vectors + named;
}

/* Rates, accelerations and multipliers of the state; missing ones are 0. */
static double *find_rest(struct scene *scene) {
    const size_t n = (size_t)scene->model->n;
    double *rest = format_allocate(3 * n + 1 + (size_t)scene->model->m, sizeof *rest);
    memcpy(rest, scene->qd, n * sizeof *rest);
    if (!refdyn_accelerate(&scene->work, scene->state.t, scene->q, scene->qd, REFDYN_BAUMGARTE, rest + n))
        refdyn_multipliers(&scene->work, rest + n, rest + 2 * n + 1);
    return rest;
}

/* Refuses results that are infinite or NaN, whose times mean nothing. The time of an event that never comes
 * may be infinite. */
static bool is_finite(const struct subject *subject, const char *name) {
    const size_t size = result_size(subject->scene->model);
    if (strcmp(name, "breaks") == 0)
        return true;
    memset(subject->out, 0, size * sizeof *subject->out);
    call(subject, 1);
    for (size_t i = 0; i < size; i++)
        if (!isfinite(subject->out[i])) {
            fprintf(stderr, "refdyn: %s: %s is not finite\n", subject->scene->model->name, name);
            return false;
        }
    return true;
}

/* `emit`: the quantities to measure; NULL: all. */
static enum status print_quantities(struct scene *scene, const char *emit, FILE *out) {
    struct subject subject = {.scene = scene, .rest = find_rest(scene)};
    subject.out = format_allocate(result_size(scene->model), sizeof *subject.out);
    enum status status = STATUS_DONE;
    for (int i = 0; i < QUANTITY_COUNT && status == STATUS_DONE; i++) {
        const char *name = quantities[i].name;
        subject.function = function_of(scene->model, &quantities[i]);
        if (!subject.function || !gen_is_named(emit, name))
            continue;
        if (!is_finite(&subject, name) ||
            !print_quantity(out, name, &subject, gen_count(&scene->generation, name)))
            status = scene_numbers_failed(scene, REFDYN_NOT_FINITE, scene->state.t, scene->q, scene->qd);
    }
    return status;
}

/* Generates the same model again with a clock, and compiles it in its own folder. */
static enum status print_build(const struct options *options, FILE *out) {
    struct scene scene;
    struct build_cost cost = {.seconds = 0};
    double start = system_wall_seconds();
    long source_bytes = 0;
    enum status status = scene_read(&scene, options, false);
    if (status == STATUS_DONE)
        status = scene_outcome(&scene, options, gen_plan(&scene.generation, options_text(options, "emit")));
    if (status == STATUS_DONE && options_has(options, "emit") && gen_left_out(&scene.generation))
        fprintf(stderr, "refdyn: %s: left out: %s\n", scene.generation.model.name,
                gen_left_out(&scene.generation));
    const struct emitted_file *files = status == STATUS_DONE ? gen_files(&scene.generation) : NULL;
    int count = files ? gen_file_count(&scene.generation) : 0;
    double gen_seconds = system_wall_seconds() - start;
    const struct emitted emitted = {.files = files, .count = count};
    for (int i = 0; i < count; i++)
        source_bytes += (long)files[i].length;
    if (status == STATUS_DONE && !compile_measure(&emitted, &cost))
        status = STATUS_FAULT;
    scene_close(&scene);
    if (status != STATUS_DONE)
        return status;
    struct document document;
    format_document_open(&document);
    document.one_line = true;
    format_put_open(&document, NULL, '{');
    format_put_text(&document, "quantity", "build");
    format_put_number(&document, "gen_s", gen_seconds);
    format_put_number(&document, "cc_s", cost.seconds);
    format_put_whole(&document, "source_bytes", source_bytes);
    format_put_whole(&document, "object_bytes", cost.object_bytes);
    format_put_whole(&document, "peak_kb", cost.peak_kb);
    format_put_close(&document, '}');
    return format_document_close(&document, out) ? STATUS_DONE : STATUS_NUMBERS;
}

static enum status bench(struct scene *scene, const struct options *options) {
    disturb(scene);
    enum status status = print_quantities(scene, options_text(options, "emit"), scene->result->file);
    if (status == STATUS_DONE)
        status = print_build(options, scene->result->file);
    if (status == STATUS_DONE && !system_target_finish(scene->result))
        status = STATUS_FAULT;
    return status;
}

static enum status run_bench(const struct options *options) {
    const char *emit = options_text(options, "emit");
    if (emit && gen_has_steps(emit))
        return options_usage_error(
            options->command, "--emit: steps are not measured, because their time depends on their length; "
                              "name the functions that they call, qdd and d_qdd");
    return scene_run(options, NEEDS_RESULT | NEEDS_ALL | NEEDS_OPTIMISED, NULL, bench);
}

const struct command bench_command = {
    .name = "bench",
    .run = run_bench,
    .operands = "MODEL.lua",
    .options = "output emit set loops accelerations fold",
    .tables = {scene_rules},
    .output = "FILE",
    .purpose = "time and operations of each emitted quantity",
    .help = "One JSON object a line; the last one has the cost of generating and compiling.\n\n"
            "  refdyn bench models/manipulator.lua --set n_rfe=4\n"
            "  refdyn bench models/manipulator.lua --emit qdd,tangent,d_qdd\n"};
