/*
 * Values of a model by the interpreter of the plan, for test_compilers.py.
 *
 *     interpreted MODEL FOLDER [NAME=VALUE ...]
 *
 * writes the model's C into FOLDER, random values of parameters, inputs and states to FOLDER/values, one
 * number a line, and every quantity at these values to standard output, one line "STATE QUANTITY ENTRY VALUE"
 * for each entry.
 */
#include "runtime/core/linear/linear.h"
#include "gen/gen.h"
#include "tests/judge/judge.h"
#include "emitted_files.h"
#include "quantity_lists.h"

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SETTINGS = 8, SIZES = 3, STATES = 6 };

static double uniform(double size) {
    static unsigned seed = 9176;
    seed = seed * 1664525u + 1013904223u;
    return size * (2.0 * (double)(seed >> 8) / (double)(1u << 24) - 1.0);
}

/* The table of the model, from a library compiled without any of the tested flags. */
static const struct refdyn_model *load(const char *folder, const char *name) {
    char command[4096], symbol[256];
    snprintf(command, sizeof command, "cc -std=c11 -O0 -fPIC -shared -I%s -I%s %s/*.c -o %s/table.so -lm",
             folder, HEADER_FOLDER, folder, folder);
    if (system(command) != 0)
        return NULL;
    snprintf(command, sizeof command, "%s/table.so", folder);
    snprintf(symbol, sizeof symbol, "%s_model", name);
    void *library = dlopen(command, RTLD_NOW | RTLD_LOCAL);
    return library ? dlsym(library, symbol) : NULL;
}

struct values {
    double *p, *x, *state;
    int p_count, x_count, state_count;
    double t;
};

/*
 * Angles of all sizes. Then a state with one NaN angle, and the same state with two other values of this
 * angle, which show the results that do not depend on it. After qd: accelerations and multipliers.
 */
static void choose_state(const struct refdyn_model *model, struct values *v, int index) {
    static const double sizes[] = {0.5, 3, 300, 3}, last[] = {NAN, 0.7, -2.1};
    const int n = model->n;
    for (int i = 0; index <= SIZES && i < v->state_count; i++)
        v->state[i] = i < n ? uniform(sizes[index]) : uniform(2);
    if (index >= SIZES)
        v->state[n - 1] = last[index - SIZES];
    else
        v->t = 0.75 + uniform(0.5);
}

static struct values choose_parameters(const struct refdyn_model *model) {
    struct values v = {.p_count = model->parameter_count,
                       .x_count = model->input_count,
                       .state_count = 3 * model->n + 1 + model->m};
    v.p = calloc((size_t)v.p_count + (size_t)model->derived_count + 1, sizeof *v.p);
    v.x = calloc((size_t)v.x_count + 1, sizeof *v.x);
    v.state = calloc((size_t)v.state_count, sizeof *v.state);
    for (int i = 0; i < v.p_count; i++)
        v.p[i] =
            model->parameters[i].value * (1 + uniform(0.05)) + (model->parameters[i].value == 0 ? 0.3 : 0);
    for (int i = 0; i < v.x_count; i++)
        v.x[i] = uniform(3);
    return v;
}

static void write_list(FILE *out, const double *list, int count) {
    for (int i = 0; i < count; i++)
        fprintf(out, "%a\n", list[i]);
}

static void print_results(const char *quantity, int state, const double *results, int count) {
    for (int i = 0; i < count; i++)
        printf("%d %s %d %.17g\n", state, quantity, i, results[i]);
}

static void interpret(const struct generation *generation, const struct refdyn_model *model, struct values *v,
                      int state) {
    const int n = model->n, m = model->m, points = model->point_count;
    const int variables = 2 * n + 1 + model->input_count + model->parameter_count;
    const size_t most = (size_t)(3 * (points + 1) + 3 * n + 3 * m + 8) * (size_t)(variables + 8);
    double *out = calloc(most, sizeof *out);
#define PRINT(name, count)                                                                 \
    if (model->name && (count) > 0) {                                                      \
        judge_interpret(generation, #name, v->p, v->x, v->t, v->state, v->state + n, out); \
        print_results(#name, state, out, count);                                           \
    }
    QUANTITIES(PRINT)
    free(out);
}

static int print_all(const struct generation *generation, const char *folder) {
    const struct refdyn_model *model = load(folder, generation->model.name);
    char path[4096];
    snprintf(path, sizeof path, "%s/values", folder);
    FILE *out = fopen(path, "w");
    if (!model || !out)
        return 1;
    struct values v = choose_parameters(model);
    write_list(out, v.p, v.p_count);
    write_list(out, v.x, v.x_count);
    for (int state = 0; state < STATES; state++) {
        choose_state(model, &v, state);
        write_list(out, &v.t, 1);
        write_list(out, v.state, v.state_count);
        interpret(generation, model, &v, state);
    }
    free(v.p);
    free(v.x);
    free(v.state);
    return fclose(out) != 0;
}

#define LISTED(name, count) #name ","

int main(int count, char **arguments) {
    struct setting settings[MOST_SETTINGS];
    struct generation generation;
    struct read_request request = {.file = arguments[1], .settings = settings, .loops = LOOPS_ALWAYS};
    for (int i = 3; i < count && i < 3 + MOST_SETTINGS; i++) {
        char *value = strchr(arguments[i], '=');
        *value = 0;
        settings[request.setting_count++] = (struct setting){.name = arguments[i], .value = value + 1};
    }
    int status = gen_read(&generation, &request, -1) != GEN_OK ||
                 gen_plan(&generation, QUANTITIES(LISTED) "course") ||
                 !write_files(&generation, arguments[2]);
    status = status || print_all(&generation, arguments[2]);
    gen_release(&generation);
    return status;
}
