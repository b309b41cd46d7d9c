/*
 * The emitted C against the interpreter of the plan: at random states every quantity agrees to 4 units in the
 * last place of its largest entry. In addition, the emitted accelerations solve the emitted equations and
 * equal those of the runtime.
 *
 *     test_interpreter
 *     test_interpreter MODEL [fold] [loops=always|never] [NAME=VALUE ...]
 *
 * Without arguments it compares two small models in less than a second. test_interpreter.py gives it others.
 */
#include "runtime/core/linear/linear.h"
#include "gen/gen.h"
#include "tests/judge/judge.h"
#include "emitted_files.h"
#include "quantity_lists.h"
#include "refdyn.h"

#include <dlfcn.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_SETTINGS = 8, STATES = 4, ULPS = 4 };

struct scene {
    const char *file;
    struct setting settings[MOST_SETTINGS];
    bool fold;
    enum loops loops;
};

#define TEST_MODEL(name) SOURCE_FOLDER "/tests/models/" name ".lua"

static const struct scene small_scenes[] = {
    {.file = TEST_MODEL("solid")},
    {.file = TEST_MODEL("programme"), .fold = true},
};

#define LISTED(name, count) #name ","
/* Each quantity alone, and all together: then more of them share functions. */
static const char *const emitted[] = {QUANTITIES(LISTED) "course", "all"};

static double uniform(unsigned *seed, double size) {
    *seed = *seed * 1664525u + 1013904223u;
    return size * (2.0 * (double)(*seed >> 8) / (double)(1u << 24) - 1.0);
}

/*
 * Emits into a fresh folder, compiles and loads; returns NULL if one of these fails. The pass over sines and
 * cosines is set to find no angle small enough for it, so it uses libm like the interpreter; test_sincos.py
 * tests the pass itself.
 */
static void *load(struct generation *generation, char *folder) {
    char command[4096];
    if (!mkdtemp(folder) || !write_files(generation, folder))
        return NULL;
    snprintf(command, sizeof command,
             "sed -i 's/fabs(x.i.) <= [0-9.]*;/fabs(x[i]) <= -1.0;/' %s/*.c && "
             "${CC:-cc} -std=c11 -O0 -ffp-contract=off -fno-math-errno -fPIC -shared -I%s -I%s/runtime "
             "%s/*.c -o %s/model.so -lm",
             folder, folder, SOURCE_FOLDER, folder, folder);
    if (system(command) != 0)
        return NULL;
    snprintf(command, sizeof command, "%s/model.so", folder);
    return dlopen(command, RTLD_NOW | RTLD_LOCAL);
}

static void remove_folder(const char *folder) {
    char command[4096];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    if (system(command) != 0)
        perror(folder);
}

static int differs(const char *what, const double *found, const double *expected, int count) {
    double largest = 0, worst = 0;
    for (int i = 0; i < count; i++) {
        if (!isfinite(found[i]) || !isfinite(expected[i])) {
            printf("  %s[%d] is not finite\n", what, i);
            return 1;
        }
        largest = fmax(largest, fabs(expected[i]));
        worst = fmax(worst, fabs(found[i] - expected[i]));
    }
    if (worst <= ULPS * DBL_EPSILON * largest)
        return 0;
    printf("  %s: emitted C and interpreter differ by %.2e, largest entry %.2e\n", what, worst, largest);
    return 1;
}

/* Random values near the defaults; the model's own `prepare` computes the derived parameters. */
static void set_values(const struct refdyn_model *model, unsigned *seed, double *p, double *x,
                       double *state) {
    const int n = model->n;
    for (int i = 0; i < model->parameter_count; i++)
        p[i] = model->parameters[i].value * (1 + uniform(seed, 0.05));
    for (int i = 0; i < model->input_count; i++)
        x[i] = uniform(seed, 3);
    for (int i = 0; i < 2 * n; i++)
        state[i] = i < n ? uniform(seed, 0.4) : uniform(seed, 1.5);
    if (model->anchored_count) {
        double anchors[64];
        if (model->prepare)
            model->prepare(p);
        model->anchor(p, x, 0.25, state, state + n, anchors);
        for (int i = 0; i < model->anchored_count; i++)
            p[model->anchored[i]] = anchors[i] + 0.1;
    }
    if (model->prepare)
        model->prepare(p);
}

static int compare(const struct generation *generation, const struct refdyn_model *model, unsigned *seed,
                   int *compared) {
    const int n = model->n, m = model->m, points = model->point_count;
    const int variables = 2 * n + 1 + model->input_count + model->parameter_count;
    const size_t most = (size_t)(3 * (points + 1) + 3 * n + 3 * m + 8) * (size_t)(variables + 8);
    double *p = calloc((size_t)(model->parameter_count + model->derived_count) + 1, sizeof *p);
    double *x = calloc((size_t)model->input_count + 1, sizeof *x),
           *state = calloc(3 * (size_t)n + 1 + (size_t)m, sizeof *state);
    double *found = calloc(most, sizeof *found), *expected = calloc(most, sizeof *expected);
    const double t = 0.75 + uniform(seed, 0.5);
    int failed = 0;
    set_values(model, seed, p, x, state);
    for (int i = 2 * n; i < 3 * n + 1 + m; i++) /* qdd, power and lambda */
        state[i] = uniform(seed, 3);
#define COMPARE(name, count)                                                                \
    if (model->name && (count) > 0) {                                                       \
        model->name(p, x, t, state, state + n, found);                                      \
        if (judge_interpret(generation, #name, p, x, t, state, state + n, expected) != 0) { \
            printf("  %s: emitted, but not known to the interpreter\n", #name);             \
            failed++;                                                                       \
        } else                                                                              \
            failed += differs(#name, found, expected, count);                               \
        ++*compared;                                                                        \
    }
    QUANTITIES(COMPARE)
    free(expected);
    free(found);
    free(state);
    free(x);
    free(p);
    return failed;
}

static double largest(const double *values, int count) {
    double result = 0;
    for (int i = 0; i < count; i++)
        result = fmax(result, fabs(values[i]));
    return result;
}

/* Largest |a b - c| over the largest |a_ij b_j|; a (rows x n). */
static double residual(const double *a, const double *b, const double *c, int rows, int n) {
    double worst = 0, size = 0;
    for (int i = 0; i < rows; i++) {
        double sum = -c[i];
        for (int j = 0; j < n; j++) {
            sum += a[i * n + j] * b[j];
            size = fmax(size, fabs(a[i * n + j] * b[j]));
        }
        worst = fmax(worst, fabs(sum));
    }
    return size > 0 ? worst / size : worst;
}

static int exceeds(const char *what, double value, double limit) {
    if (value <= limit)
        return 0;
    printf("  %s: %.2e, allowed %.0e\n", what, value, limit);
    return 1;
}

/* M qdd_free = f; with rows u qdd = k, M qdd = f + force, and qdd as the runtime solves it. work: p and x. */
static int check_accelerations(struct refdyn_workspace *work, double t, const double *state, double *room) {
    const struct refdyn_model *model = work->model;
    const int n = work->n, m = work->m;
    double *qdd = room, *side = room + n, *force = room + 2 * n, *solved = room + 3 * n;
    const double *q = state, *qd = state + n;
    if (refdyn_accelerate(work, t, q, qd, REFDYN_BAUMGARTE, solved) != REFDYN_OK) {
        printf("  the runtime finds no accelerations\n");
        return 1;
    }
    model->qdd_free(work->p, work->x, t, q, qd, qdd);
    int failed = exceeds("M qdd_free = f", residual(work->M, qdd, work->f, n, n), 1e-11);
    if (m == 0)
        return failed;
    model->qdd(work->p, work->x, t, q, qd, qdd);
    model->force(work->p, work->x, t, q, qd, force);
    for (int i = 0; i < n; i++) {
        side[i] = work->f[i] + force[i];
        solved[i] -= qdd[i];
    }
    failed += exceeds("u qdd = k", residual(work->u, qdd, work->k, m, n), 1e-11);
    failed += exceeds("M qdd = f + force", residual(work->M, qdd, side, n, n), 1e-11);
    return failed + exceeds("qdd of the runtime", largest(solved, n) / largest(qdd, n), 1e-8);
}

/*
 * Q_q is dQ/dq at qd = 0, and power is qd . (Q + dV/dq), by differences of order four. room: scratch (4 n).
 * In the printed form Q has terms that are not the work of any force, so its power is not checked.
 */
static int check_derivatives(struct refdyn_workspace *work, bool is_printed, double t, double *state,
                             double *room) {
    const struct refdyn_model *model = work->model;
    const int n = work->n;
    const double step = 1e-3, weights[] = {1, -8, 8, -1};
    double *Q = room, *slope = room + n, *still = room + 2 * n, *force = room + 3 * n, energy[2], power = 0;
    double *tangent = calloc((size_t)(n * n), sizeof *tangent), worst = 0, rate = 0, size = 0;
    model->Q_q(work->p, work->x, t, state, still, tangent);
    model->Q(work->p, work->x, t, state, state + n, force);
    for (int j = 0; j < n; j++) {
        const double q = state[j];
        double potential = 0;
        for (int i = 0; i < n; i++)
            slope[i] = 0;
        for (int k = 0; k < 4; k++) {
            state[j] = q + step * (k < 2 ? k - 2 : k - 1);
            model->Q(work->p, work->x, t, state, still, Q);
            model->energy(work->p, work->x, t, state, still, energy);
            for (int i = 0; i < n; i++)
                slope[i] += weights[k] * Q[i] / (12 * step);
            potential += weights[k] * energy[1] / (12 * step);
        }
        state[j] = q;
        for (int i = 0; i < n; i++)
            worst = fmax(worst, fabs(slope[i] - tangent[i * n + j]));
        rate += state[n + j] * (force[j] + potential);
        size = fmax(size, fabs(state[n + j] * force[j]));
    }
    if (is_printed)
        rate = 0;
    else if (model->power)
        model->power(work->p, work->x, t, state, state + n, &power);
    int failed = exceeds("Q_q", worst / fmax(largest(tangent, n * n), 1e-300), 1e-8);
    failed += exceeds("power", fabs(rate - power) / fmax(size, 1e-300), 1e-8);
    free(tangent);
    return failed;
}

static int compare_with_runtime(const struct refdyn_model *model, bool is_printed, unsigned *seed) {
    const size_t size = refdyn_workspace_size(model);
    void *memory = malloc(size);
    double *state = calloc(10 * (size_t)model->n, sizeof *state);
    struct refdyn_workspace work;
    int failed = refdyn_workspace_init(&work, model, memory, size) != REFDYN_OK;
    if (!failed) {
        set_values(model, seed, work.p, work.x, state);
        failed = check_accelerations(&work, 0.75, state, state + 2 * model->n);
        failed += check_derivatives(&work, is_printed, 0.75, state, state + 6 * model->n);
    }
    free(state);
    free(memory);
    return failed;
}

static int judge(struct generation *generation, unsigned *seed) {
    char folder[] = "/tmp/refdyn_interpreter_XXXXXX", symbol[256];
    void *library = load(generation, folder);
    int failed = 1, compared = 0;
    snprintf(symbol, sizeof symbol, "%s_model", generation->model.name);
    const struct refdyn_model *model = library ? dlsym(library, symbol) : NULL;
    if (model) {
        failed = 0;
        for (int state = 0; state < STATES; state++)
            failed += compare(generation, model, seed, &compared) +
                      compare_with_runtime(model, generation->model.printed_form, seed);
        printf("  %d results compared\n", compared);
        failed += compared < STATES * 6; /* at least M h Q energy qdd_free equations */
    } else {
        printf("  not compiled or not loaded: %s\n", folder);
    }
    if (library)
        dlclose(library);
    remove_folder(folder);
    return failed;
}

static int judge_scene(const struct scene *scene, const char *emit, unsigned *seed) {
    struct generation generation;
    struct read_request request = {
        .file = scene->file, .settings = scene->settings, .fold = scene->fold, .loops = scene->loops};
    while (request.setting_count < MOST_SETTINGS && scene->settings[request.setting_count].name)
        request.setting_count++;
    printf("%s, %s\n", scene->file, emit);
    enum gen_status status = gen_read(&generation, &request, -1);
    if (status == GEN_OK)
        status = gen_plan(&generation, emit);
    int failed = 1;
    if (status == GEN_OK)
        failed = judge(&generation, seed);
    else
        for (int i = 0; i < generation.messages.count; i++)
            printf("  line %d: %s\n", generation.messages.list[i].place.line,
                   generation.messages.list[i].text);
    gen_release(&generation);
    return failed;
}

static int judge_both(const struct scene *scene, unsigned *seed) {
    int failed = 0;
    for (int list = 0; list < 2; list++)
        failed += judge_scene(scene, emitted[list], seed);
    return failed;
}

/* The scene of the command line; its texts stay there. */
static bool scene_of(char **words, int count, struct scene *scene) {
    int settings = 0;
    *scene = (struct scene){.file = words[0]};
    for (int i = 1; i < count; i++) {
        char *equals = strchr(words[i], '=');
        if (!strcmp(words[i], "fold"))
            scene->fold = true;
        else if (!strcmp(words[i], "loops=always"))
            scene->loops = LOOPS_ALWAYS;
        else if (!strcmp(words[i], "loops=never"))
            scene->loops = LOOPS_NEVER;
        else if (equals && settings < MOST_SETTINGS) {
            *equals = '\0';
            scene->settings[settings++] = (struct setting){.name = words[i], .value = equals + 1};
        } else
            return false;
    }
    return true;
}

int main(int count, char **words) {
    unsigned seed = 2385;
    int failed = 0;
    struct scene scene;
    if (count == 1)
        for (int i = 0; i < (int)(sizeof small_scenes / sizeof *small_scenes); i++)
            failed += judge_both(&small_scenes[i], &seed);
    else if (scene_of(words + 1, count - 1, &scene))
        failed = judge_both(&scene, &seed);
    else
        failed = 1;
    printf("%s\n", failed ? "failed" : "passed");
    return failed != 0;
}
