/* Quasi-random sequences: see sweeps.h. */
#include "runtime/tool/batches/sweeps/sweeps.h"

#ifdef REFDYN_HAS_GSL

#include "runtime/tool/support/format/format.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_qrng.h>

#include <stdio.h>
#include <stdlib.h>

bool quasi_random_is_there(void) {
    return true;
}

void quasi_random_points(enum sequence sequence, int width, long count, double *points) {
    gsl_set_error_handler_off();
    gsl_qrng *generator =
        gsl_qrng_alloc(sequence == SEQUENCE_SOBOL ? gsl_qrng_sobol : gsl_qrng_halton, (unsigned)width);
    if (!generator) {
        fputs("refdyn: out of memory\n", stderr);
        exit(EXIT_FAILURE);
    }
    for (long k = 0; k < count; k++)
        gsl_qrng_get(generator, points + (size_t)k * (size_t)width);
    gsl_qrng_free(generator);
}

#else

bool quasi_random_is_there(void) {
    return false;
}

void quasi_random_points(enum sequence sequence, int width, long count, double *points) {
    (void)sequence, (void)width, (void)count, (void)points;
}

#endif
