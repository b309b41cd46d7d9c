/* Motions by methods of GSL: their names and stabilisation, and the calls of refdyn_gsl.h in a build with
 * GSL. */
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

#include <stdlib.h>
#include <string.h>

/* msbdf continues from earlier states, so a projection would force it to start again. */
static const struct {
    const char *name;
    enum refdyn_stabilise stabilise;
} methods[] = {{"msbdf", REFDYN_BAUMGARTE}, {"bsimp", REFDYN_PROJECT}};

enum { METHOD_COUNT = sizeof methods / sizeof *methods };

static int find(const char *method) {
    for (int i = 0; method && i < METHOD_COUNT; i++)
        if (strcmp(methods[i].name, method) == 0)
            return i;
    return -1;
}

bool simulate_gsl_has(const char *method) {
    return find(method) >= 0;
}

enum refdyn_stabilise simulate_gsl_stabilise(const char *method) {
    return methods[find(method)].stabilise;
}

#ifdef REFDYN_HAS_GSL

#include "refdyn_gsl.h"

#include <gsl/gsl_errno.h>

int simulate_gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method) {
    gsl_set_error_handler_off();
    *gsl = format_allocate(1, sizeof **gsl);
    return refdyn_gsl_init(*gsl, integrator, (enum refdyn_gsl_method)refdyn_gsl_method_find(method));
}

int simulate_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    return refdyn_gsl_step(gsl, t_out, steps);
}

void simulate_gsl_close(struct refdyn_gsl *gsl) {
    if (gsl)
        refdyn_gsl_release(gsl);
}

#else

int simulate_gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method) {
    (void)integrator;
    (void)method;
    *gsl = NULL;
    return REFDYN_BAD_OPTION;
}

int simulate_gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    (void)gsl;
    (void)t_out;
    (void)steps;
    return REFDYN_BAD_OPTION;
}

void simulate_gsl_close(struct refdyn_gsl *gsl) {
    (void)gsl;
}

#endif
