/* Numbers of a page: see view.h. */
#include "runtime/tool/results/view/view.h"

#include <math.h>

void view_put_length(FILE *out, double value) {
    fprintf(out, "%.7g", isfinite(value) ? value + 0.0 : 0);
}

void view_put_cosine(FILE *out, double value) {
    const double unit = 1e8, rounded = round(value * unit) / unit;
    view_put_length(out, rounded == 0 ? 0 : rounded); /* no -0 */
}

double view_rounded_unit(double largest, int digits) {
    return largest > 0 && isfinite(largest) ? pow(10, floor(log10(largest)) + 1 - digits) : 1;
}

void view_put_course(FILE *out, const double *values, long count, long stride, double unit) {
    long long before = 0;
    fputc('[', out);
    for (long i = 0; i < count; i++) {
        const long long now = llround(values[i * stride] / unit);
        fprintf(out, "%s%lld", i ? "," : "", now - before);
        before = now;
    }
    fputc(']', out);
}
