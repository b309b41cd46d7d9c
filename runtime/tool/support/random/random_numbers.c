/*
 * Random and quasi-random numbers: see random.h.
 *
 * Philox: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3",
 * SC11. Normal quantile: M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution",
 * Applied Statistics 37 (1988), PPND16, relative error about 1e-16. Halton: J. H. Halton, Numerische
 * Mathematik 2:84-90 (1960). Sobol: gsl_qrng of GSL.
 */
#include "runtime/tool/support/random/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef REFDYN_HAS_GSL
#include <gsl/gsl_errno.h>
#include <gsl/gsl_qrng.h>
#endif

/* ---- Uniform numbers ---- */

static void philox_round(uint32_t c[4], const uint32_t key[2]) {
    const uint64_t first = (uint64_t)0xD2511F53u * c[0], second = (uint64_t)0xCD9E8D57u * c[2];
    const uint32_t next[4] = {(uint32_t)(second >> 32) ^ c[1] ^ key[0], (uint32_t)second,
                              (uint32_t)(first >> 32) ^ c[3] ^ key[1], (uint32_t)first};
    for (int i = 0; i < 4; i++)
        c[i] = next[i];
}

void random_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t result[4]) {
    uint32_t now[2] = {key[0], key[1]};
    for (int i = 0; i < 4; i++)
        result[i] = counter[i];
    for (int round = 0; round < 10; round++) {
        philox_round(result, now);
        now[0] += 0x9E3779B9u; /* 2^32 times the golden ratio less 1, and 2^32 (sqrt 3 - 1) */
        now[1] += 0xBB67AE85u;
    }
}

/* FNV-1a hash. */
uint64_t random_stream(const char *name) {
    uint64_t hash = 14695981039346656037u;
    for (; *name; name++)
        hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return hash;
}

/* The middle of one of 2^52 equal intervals. */
double random_uniform(uint64_t seed, uint64_t stream, uint64_t number) {
    const uint32_t counter[4] = {(uint32_t)number, (uint32_t)(number >> 32), (uint32_t)stream,
                                 (uint32_t)(stream >> 32)};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t bits[4];
    random_philox(counter, key, bits);
    const uint64_t part = ((uint64_t)bits[0] << 32 | bits[1]) >> 12;
    return ((double)part + 0.5) / 4503599627370496.0;
}

/* ---- Logarithm and exponential ---- */

static const double ln2_high = 0x1.62e42fefa3800p-1, ln2_low = 0x1.ef35793c76730p-45;

/* x = 2^e m, m near 1, and ln m = 2 artanh s with s = (m - 1) / (m + 1). */
double random_log(double x) {
    int e;
    double m = frexp(x, &e);
    if (m < 0.70710678118654752) {
        m *= 2;
        e--;
    }
    const double s = (m - 1) / (m + 1), s2 = s * s;
    double sum = 0;
    for (int k = 23; k >= 3; k -= 2)
        sum = s2 * (sum + 1.0 / k);
    return e * ln2_high + (2 * s + (2 * s * sum + e * ln2_low));
}

/* x = k ln 2 + r, and the series of exp r. */
double random_exp(double x) {
    const double k = floor(x / ln2_high + 0.5), r = (x - k * ln2_high) - k * ln2_low;
    double sum = 1;
    for (int i = 15; i >= 1; i--)
        sum = 1 + r / i * sum;
    return ldexp(sum, (int)k);
}

/* ---- Normal numbers ---- */

/* (a[0] + a[1] x + ... + a[7] x^7) / (b[0] + ...) */
static double ratio(const double a[8], const double b[8], double x) {
    double above = a[7], below = b[7];
    for (int i = 6; i >= 0; i--) {
        above = above * x + a[i];
        below = below * x + b[i];
    }
    return above / below;
}

/* |u - 1/2| <= 0.425. */
static double middle(double q) {
    static const double a[8] = {3.3871328727963666080e0,  1.3314166789178437745e+2, 1.9715909503065514427e+3,
                                1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4,
                                3.3430575583588128105e+4, 2.5090809287301226727e+3};
    static const double b[8] = {1,
                                4.2313330701600911252e+1,
                                6.8718700749205790830e+2,
                                5.3941960214247511077e+3,
                                2.1213794301586595867e+4,
                                3.9307895800092710610e+4,
                                2.8729085735721942674e+4,
                                5.2264952788528545610e+3};
    return q * ratio(a, b, 0.180625 - q * q);
}

/* r = sqrt(-ln of the smaller tail probability). */
static double near_tail(double r) {
    static const double c[8] = {1.42343711074968357734e0,  4.63033784615654529590e0,
                                5.76949722146069140550e0,  3.64784832476320460504e0,
                                1.27045825245236838258e0,  2.41780725177450611770e-1,
                                2.27238449892691845833e-2, 7.74545014278341407640e-4};
    static const double d[8] = {1,
                                2.05319162663775882187e0,
                                1.67638483018380384940e0,
                                6.89767334985100004550e-1,
                                1.48103976427480074590e-1,
                                1.51986665636164571966e-2,
                                5.47593808499534494600e-4,
                                1.05075007164441684324e-9};
    return ratio(c, d, r - 1.6);
}

static double far_tail(double r) {
    static const double e[8] = {6.65790464350110377720e0,  5.46378491116411436990e0,
                                1.78482653991729133580e0,  2.96560571828504891230e-1,
                                2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                2.71155556874348757815e-5, 2.01033439929228813265e-7};
    static const double f[8] = {1,
                                5.99832206555887937690e-1,
                                1.36929880922735805310e-1,
                                1.48753612908506148525e-2,
                                7.86869131145613259100e-4,
                                1.84631831751005468180e-5,
                                1.42151175831644588870e-7,
                                2.04426310338993978564e-15};
    return ratio(e, f, r - 5);
}

double random_normal_quantile(double u) {
    const double q = u - 0.5;
    if (fabs(q) <= 0.425)
        return middle(q);
    const double r = sqrt(-random_log(q < 0 ? u : 1 - u)), size = r <= 5 ? near_tail(r) : far_tail(r);
    return q < 0 ? -size : size;
}

/* ---- Quasi-random sequences ---- */

/* The van der Corput sequence in base b: the digits of `number` after the point, in reverse order. */
static double van_der_corput(long number, int b) {
    const double part_of_digit = 1.0 / b;
    double part = 1, sum = 0;
    for (; number; number /= b) {
        part *= part_of_digit;
        sum += part * (double)(number % b);
    }
    return sum;
}

static int next_prime(int after) {
    for (int p = after + 1;; p++) {
        bool is_prime = p > 1;
        for (int d = 2; d * d <= p; d++)
            is_prime = is_prime && p % d != 0;
        if (is_prime)
            return p;
    }
}

void random_halton(int width, long first, long count, double *points) {
    for (int i = 0, prime = 1; i < width; i++) {
        prime = next_prime(prime);
        for (long k = 0; k < count; k++)
            points[k * width + i] = van_der_corput(first + k, prime);
    }
}

void random_sobol(int width, long count, double *points) {
#ifdef REFDYN_HAS_GSL
    gsl_set_error_handler_off();
    gsl_qrng *generator = gsl_qrng_alloc(gsl_qrng_sobol, (unsigned)width);
    if (!generator) {
        fputs("refdyn: out of memory\n", stderr);
        exit(EXIT_FAILURE);
    }
    for (long k = 0; k < count; k++)
        gsl_qrng_get(generator, points + (size_t)k * (size_t)width);
    gsl_qrng_free(generator);
#else
    (void)width, (void)count, (void)points;
#endif
}
