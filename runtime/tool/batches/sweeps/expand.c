/*
 * The cases of a sweep: each point of its grids and lists, and for each the draws of its random columns.
 *
 * The first name varies slowest, then the others in the order of their names, then the draws. A random number
 * is a function of the seed, the column's name and the case's number alone: neither the order of work nor
 * another column changes it. It is also the same to the bit on each machine, since it needs only additions,
 * multiplications, divisions and square roots of IEEE numbers and no functions of libm.
 *
 * A quasi-random sequence of GSL (gsl_qrng) fills a cube more evenly than random points. It is the same at
 * each point of the grids. Its dimensions are the random columns in the order of their names, and a seed
 * shifts it (modulo 1, Cranley and Patterson).
 *
 * Philox: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3",
 * SC11. Normal quantile: M. J. Wichura, "Algorithm AS 241: The percentage points of the normal distribution",
 * Applied Statistics 37 (1988), PPND16, relative error about 1e-16.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef REFDYN_HAS_GSL
#include <gsl/gsl_errno.h>
#include <gsl/gsl_qrng.h>
#endif

#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"

/* ---- Uniform numbers ---- */

static void philox_round(uint32_t c[4], const uint32_t key[2]) {
    const uint64_t first = (uint64_t)0xD2511F53u * c[0], second = (uint64_t)0xCD9E8D57u * c[2];
    const uint32_t next[4] = {(uint32_t)(second >> 32) ^ c[1] ^ key[0], (uint32_t)second,
                              (uint32_t)(first >> 32) ^ c[3] ^ key[1], (uint32_t)first};
    for (int i = 0; i < 4; i++)
        c[i] = next[i];
}

void sweeps_random_philox(const uint32_t counter[4], const uint32_t key[2], uint32_t result[4]) {
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
uint64_t sweeps_random_stream(const char *name) {
    uint64_t hash = 14695981039346656037u;
    for (; *name; name++)
        hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return hash;
}

/* The middle of one of 2^52 equal intervals. */
static double random_uniform(uint64_t seed, uint64_t stream, uint64_t number) {
    const uint32_t counter[4] = {(uint32_t)number, (uint32_t)(number >> 32), (uint32_t)stream,
                                 (uint32_t)(stream >> 32)};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t bits[4];
    sweeps_random_philox(counter, key, bits);
    const uint64_t part = ((uint64_t)bits[0] << 32 | bits[1]) >> 12;
    return ((double)part + 0.5) / 4503599627370496.0;
}

/* ---- Logarithm and exponential ---- */

static const double ln2_high = 0x1.62e42fefa3800p-1, ln2_low = 0x1.ef35793c76730p-45;

/* x = 2^e m, m near 1, and ln m = 2 artanh s with s = (m - 1) / (m + 1). */
double sweeps_random_log(double x) {
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
double sweeps_random_exp(double x) {
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

double sweeps_random_normal_quantile(double u) {
    const double q = u - 0.5;
    if (fabs(q) <= 0.425)
        return middle(q);
    const double r = sqrt(-sweeps_random_log(q < 0 ? u : 1 - u)), size = r <= 5 ? near_tail(r) : far_tail(r);
    return q < 0 ? -size : size;
}

/* ---- Quasi-random sequences ---- */

/* The first `count` points of a sequence in `width` dimensions. Coordinate i of point k is points[k * width +
 * i], in [0, 1). The sequence must have that many dimensions. */
#ifdef REFDYN_HAS_GSL

static void quasi_random_points(enum sequence sequence, int width, long count, double *points) {
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

static void quasi_random_points(enum sequence sequence, int width, long count, double *points) {
    (void)sequence, (void)width, (void)count, (void)points;
}

#endif

/* ---- Lists and grids ---- */

/* Point `index` of a grid, whose ends are exact. */
static double grid_point(const struct vary *vary, long index) {
    const double last = vary->count - 1;
    if (index == 0 || (double)index == last)
        return index == 0 ? vary->from : vary->to;
    const double part = (double)index / last;
    if (vary->form == VARY_GRID)
        return vary->from + (vary->to - vary->from) * part;
    const double begin = sweeps_random_log(vary->from), end = sweeps_random_log(vary->to);
    return sweeps_random_exp(begin + (end - begin) * part);
}

/* Each value is repeated for `stride` cases. */
static void fill_listed(const struct vary *vary, long stride, long case_count, double *values) {
    const long count = (long)vary->count;
    for (long i = 0; i < case_count; i++)
        values[i] = i % stride > 0            ? values[i - 1]
                    : i >= stride * count     ? values[i - stride * count]
                    : vary->form == VARY_LIST ? vary->list.values[i / stride]
                                              : grid_point(vary, i / stride);
}

/* ---- Draws ---- */

/* The value below which a fraction u of the distribution lies. */
static double quantile(const struct vary *vary, double u) {
    if (vary->form == VARY_NORMAL)
        return vary->from + vary->to * sweeps_random_normal_quantile(u);
    if (vary->form == VARY_UNIFORM)
        return vary->from + (vary->to - vary->from) * u;
    const double begin = sweeps_random_log(vary->from), end = sweeps_random_log(vary->to);
    return sweeps_random_exp(begin + (end - begin) * u);
}

static void fill_random(const struct sweep_file *file, const struct vary *vary, long case_count,
                        double *values) {
    const uint64_t stream = sweeps_random_stream(vary->name);
    for (long i = 0; i < case_count; i++)
        values[i] = quantile(vary, random_uniform((uint64_t)file->seed, stream, (uint64_t)i));
}

/* Fills a column from one coordinate of the points, which are `width` apart in memory. */
static void fill_sequence(const struct sweep_file *file, const struct vary *vary, const double *points,
                          int width, long case_count, double *values) {
    const double least = 0x1p-54; /* the normal distribution has no quantile at 0 */
    const long draws = (long)file->draws;
    const double shift =
        file->has_seed ? random_uniform((uint64_t)file->seed, sweeps_random_stream(vary->name), 0) : 0;
    for (long i = 0; i < draws; i++) {
        double u = points[i * width] + shift;
        u -= floor(u);
        values[i] = quantile(vary, u > least ? u : least);
    }
    for (long i = draws; i < case_count; i++)
        values[i] = values[i - draws];
}

static int random_count(const struct sweep_file *file) {
    int count = 0;
    for (int i = 0; i < file->vary_count; i++)
        count += sweeps_is_random(&file->varies[i]);
    return count;
}

/* Points for all random columns; NULL without a sequence. */
static double *sequence_points(const struct sweep_file *file, int width) {
    if (file->sequence == SEQUENCE_RANDOM)
        return NULL;
    double *points = format_allocate_large((size_t)file->draws * (size_t)width, sizeof *points);
    quasi_random_points(file->sequence, width, (long)file->draws, points);
    return points;
}

static void fill_drawn(const struct sweep_file *file, struct case_table *cases) {
    const int width = random_count(file);
    double *points = sequence_points(file, width);
    for (int i = 0, column = 0; i < file->vary_count; i++) {
        const struct vary *vary = &file->varies[i];
        if (!sweeps_is_random(vary))
            continue;
        if (points)
            fill_sequence(file, vary, points + column, width, cases->count, cases->columns[i].values);
        else
            fill_random(file, vary, cases->count, cases->columns[i].values);
        column++;
    }
    free(points);
}

/* ---- All cases ---- */

static struct case_column column_of(const struct vary *vary, struct memory *memory, long case_count) {
    struct case_column column = {.name = memory_text(memory, vary->name), .place = vary->place};
    column.values = memory_get(memory, (size_t)case_count * sizeof *column.values);
    if (vary->form != VARY_LIST)
        return column;
    column.kind = vary->list.kind;
    column.text_count = column.kind == CASES_TEXTS ? vary->list.text_count : 0;
    column.texts = memory_get(memory, ((size_t)column.text_count + 1) * sizeof *column.texts);
    for (int i = 0; i < column.text_count; i++)
        column.texts[i] = memory_text(memory, vary->list.texts[i]);
    return column;
}

void sweeps_expand_cases(const struct sweep_file *file, struct memory *memory, struct case_table *cases) {
    *cases = (struct case_table){.count = (long)sweeps_file_case_count(file), .width = file->vary_count};
    cases->columns = memory_get(memory, ((size_t)cases->width + 1) * sizeof *cases->columns);
    long stride = (long)file->draws;
    for (int i = file->vary_count - 1; i >= 0; i--) {
        const struct vary *vary = &file->varies[i];
        cases->columns[i] = column_of(vary, memory, cases->count);
        if (sweeps_is_random(vary))
            continue;
        fill_listed(vary, stride, cases->count, cases->columns[i].values);
        stride *= (long)vary->count;
    }
    if (random_count(file) > 0)
        fill_drawn(file, cases);
}
