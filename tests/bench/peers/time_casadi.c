/*
 * Times C that CasADi generated: time_casadi values|times N_RFE LIBRARY QUANTITY VARIANT.
 * LIBRARY has one function f of q, qd and a third vector, tau or qdd; its results are dense.
 */
#include "timing.h"

#include <dlfcn.h>

typedef long long integer;
typedef int function(const double **arguments, double **results, integer *integers, double *work, int memory);
typedef int sizes_function(integer *arguments, integer *results, integer *integers, integer *work);
typedef integer count_function(void);
typedef const integer *sparsity_function(integer which);

struct subject {
    function *f;
    const double **arguments;
    double **results, *work;
    integer *integers;
};

static void find(void *library, const char *name, void *pointer) {
    void *found = dlsym(library, name);
    if (!found)
        stop("the library lacks it", name);
    memcpy(pointer, &found, sizeof found);
}

static void call_function(void *subject, long times) {
    const struct subject *s = (const struct subject *)subject;
    for (long i = 0; i < times; i++)
        s->f(s->arguments, s->results, s->integers, s->work, 0);
}

int main(int argc, char **argv) {
    struct subject s;
    sizes_function *sizes;
    count_function *count;
    sparsity_function *sparsity;
    integer argument_count, result_count, integer_count, work_count;
    if (argc != 6)
        stop("usage: time_casadi values|times N_RFE LIBRARY QUANTITY VARIANT", "time_casadi");
    const struct bench b = open_bench("casadi", argc, argv);
    void *library = dlopen(argv[3], RTLD_NOW);
    if (!library)
        stop(dlerror(), argv[3]);
    find(library, "f", &s.f);
    find(library, "f_work", &sizes);
    find(library, "f_n_out", &count);
    find(library, "f_sparsity_out", &sparsity);
    sizes(&argument_count, &result_count, &integer_count, &work_count);
    s.arguments = (const double **)calloc((size_t)argument_count + 3, sizeof *s.arguments);
    s.results = (double **)calloc((size_t)result_count + 1, sizeof *s.results);
    s.integers = (integer *)calloc((size_t)integer_count + 1, sizeof *s.integers);
    s.work = new_array((size_t)work_count);
    s.arguments[0] = b.q;
    s.arguments[1] = b.qd;
    s.arguments[2] = strstr(argv[4], "inverse") ? b.qdd : b.tau;
    struct bench_result *results = (struct bench_result *)calloc((size_t)count() + 1, sizeof *results);
    for (integer k = 0; k < count(); k++) {
        const integer *pattern = sparsity(k); /* rows, columns, then 1 for a dense matrix */
        results[k].count = (size_t)(pattern[0] * pattern[1]);
        results[k].values = s.results[k] = new_array(results[k].count);
    }
    measure(&b, argv[4], argv[5], call_function, &s, results);
    return 0;
}
