/* The six Gauss points on [0, 1], and integrals of the polynomial through values at them. */
#include <math.h>

#include "runtime/tool/motions/realise/realise.h"

/* The value of the Legendre polynomial of degree 6 at x, and its slope. */
static double legendre(double x, double *slope) {
    double before = 1, value = x;
    for (int k = 1; k < REALISE_STAGES; k++) {
        const double next = ((2 * k + 1) * x * value - k * before) / (k + 1);
        before = value;
        value = next;
    }
    *slope = REALISE_STAGES * (x * value - before) / (x * x - 1);
    return value;
}

static void find_points(double c[static REALISE_STAGES]) {
    const double pi = 3.14159265358979323846;
    for (int i = 0; i < REALISE_STAGES; i++) {
        double x = -cos(pi * (i + 0.75) / (REALISE_STAGES + 0.5)), slope;
        for (int k = 0; k < 8; k++)
            x -= legendre(x, &slope) / slope;
        c[i] = (1 + x) / 2;
    }
}

/* Coefficients of the polynomial that is 1 at point j and 0 at the others. */
static void find_lagrange(struct realise_gauss *gauss, int j) {
    double *a = gauss->lagrange[j];
    a[0] = 1;
    for (int i = 0, degree = 0; i < REALISE_STAGES; i++) {
        if (i == j)
            continue;
        const double size = gauss->c[j] - gauss->c[i];
        for (int k = ++degree; k >= 0; k--)
            a[k] = ((k > 0 ? a[k - 1] : 0) - gauss->c[i] * (k < degree ? a[k] : 0)) / size;
    }
}

void realise_gauss_weights(const struct realise_gauss *gauss, double x, int order,
                           double weights[static REALISE_STAGES]) {
    for (int j = 0; j < REALISE_STAGES; j++) {
        double power = order == 0 ? 1 : order == 1 ? x : x * x;
        weights[j] = 0;
        for (int k = 0; k < REALISE_STAGES; k++, power *= x)
            weights[j] += gauss->lagrange[j][k] * power /
                          (order == 0   ? 1
                           : order == 1 ? k + 1
                                        : (k + 1) * (k + 2));
    }
}

void realise_gauss_start(struct realise_gauss *gauss) {
    *gauss = (struct realise_gauss){.c = {0}};
    find_points(gauss->c);
    for (int j = 0; j < REALISE_STAGES; j++)
        find_lagrange(gauss, j);
    for (int i = 0; i <= REALISE_STAGES; i++) {
        const double x = i < REALISE_STAGES ? gauss->c[i] : 1;
        realise_gauss_weights(gauss, x, 1, gauss->once[i]);
        realise_gauss_weights(gauss, x, 2, gauss->twice[i]);
    }
}
