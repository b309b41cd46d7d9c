/*
 * Times functions that Refdyn emitted: time_emitted values|times N_RFE LIBRARY MODEL QUANTITY VARIANT
 * FUNCTION[,FUNCTION] COUNT[,COUNT]. LIBRARY is the emitted C of MODEL as a shared object, COUNT the doubles
 * of each function's result. All functions are called one after another. The input of the model is the
 * torque on the column; inverse dynamics computes all forces, so that the input is 0 there.
 */
#include "timing.h"

#include "refdyn_model.h"

#include <dlfcn.h>

enum { FUNCTIONS = 4, NAME_SIZE = 200 };

struct subject {
    const struct refdyn_model *model;
    refdyn_function *functions[FUNCTIONS];
    int function_count;
    double *p, *x, *q, *qd, *out[FUNCTIONS];
    struct bench_result results[FUNCTIONS + 1];
};

static void *find(void *library, const char *name, const char *what) {
    char symbol[NAME_SIZE];
    snprintf(symbol, sizeof symbol, "%s_%s", name, what);
    void *found = dlsym(library, symbol);
    if (!found)
        stop("the library lacks it", symbol);
    return found;
}

/* Inverse dynamics expects accelerations as one more argument; in the model's table they follow qd as all
 * callers have it. */
static refdyn_function *function_of(const struct subject *s, void *library, const char *name,
                                    const char *what) {
    refdyn_function *function;
    if (!strcmp(what, "inverse") || !strcmp(what, "d_inverse"))
        return *what == 'd' ? s->model->d_inverse : s->model->inverse;
    void *found = find(library, name, what);
    memcpy(&function, &found, sizeof function);
    return function;
}

static void open_functions(struct subject *s, const char *path, const char *name, char *functions,
                           char *counts) {
    void *library = dlopen(path, RTLD_NOW);
    if (!library)
        stop(dlerror(), path);
    s->model = (const struct refdyn_model *)find(library, name, "model");
    for (char *f = strtok(functions, ","); f && s->function_count < FUNCTIONS; f = strtok(NULL, ","))
        s->functions[s->function_count++] = function_of(s, library, name, f);
    for (int k = 0; k < s->function_count; k++) {
        char *count = strtok(k ? NULL : counts, ",");
        if (!count)
            stop("must have a count for each function", path);
        s->results[k].count = (size_t)atol(count);
        s->results[k].values = s->out[k] = new_array(s->results[k].count);
    }
}

static void set_parameters(struct subject *s) {
    const struct refdyn_model *model = s->model;
    s->p = new_array((size_t)model->parameter_count + (size_t)model->derived_count);
    for (int i = 0; i < model->parameter_count; i++)
        s->p[i] = model->parameters[i].value;
    if (model->prepare)
        model->prepare(s->p);
}

static void set_state(struct subject *s, const struct bench *b, const char *quantity) {
    const struct refdyn_model *model = s->model;
    if (model->n != b->n || model->input_count != 1)
        stop("the model has other coordinates or inputs", b->program);
    s->x = new_array(1);
    s->x[0] = strcmp(quantity, "inverse") ? b->tau[1] : 0; /* the torque on the column */
    s->q = b->q;
    s->qd = new_array(2 * (size_t)b->n);
    memcpy(s->qd, b->qd, (size_t)b->n * sizeof(double));
    memcpy(s->qd + b->n, b->qdd, (size_t)b->n * sizeof(double));
}

static void call_all(void *subject, long times) {
    const struct subject *s = (const struct subject *)subject;
    for (long i = 0; i < times; i++)
        for (int k = 0; k < s->function_count; k++)
            s->functions[k](s->p, s->x, 0, s->q, s->qd, s->out[k]);
}

int main(int argc, char **argv) {
    struct subject s = {.function_count = 0};
    if (argc != 9)
        stop("usage: time_emitted values|times N_RFE LIBRARY MODEL QUANTITY VARIANT FUNCTION,... COUNT,...",
             "time_emitted");
    const struct bench b = open_bench("refdyn", argc, argv);
    open_functions(&s, argv[3], argv[4], argv[7], argv[8]);
    set_parameters(&s);
    set_state(&s, &b, argv[5]);
    measure(&b, argv[5], argv[6], call_all, &s, s.results);
    return 0;
}
