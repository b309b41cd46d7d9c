/*
 * Functions for lanes compared with those for one motion, for test_lanes.py. Compiled with -DMODEL=NAME and
 * linked with NAME.c and NAME_lanes.c of all widths, or of the width -DONLY. Prints a line for each width and
 * quantity: the largest difference relative to the largest entry of a result, entries with different bits,
 * and lanes whose bits depend on another lane.
 */
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define TEXT_(a) #a
#define TEXT(a) TEXT_(a)
#include TEXT(JOIN(MODEL, _lanes.h))

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 1 << 17, WIDEST = 8, TIMES = 3 };

extern const struct refdyn_model JOIN(MODEL, _model);
static const struct refdyn_model *const model = &JOIN(MODEL, _model);
static const double untouched = 12345.678;

/* One argument of all motions: entry i of lane l at [l][i]. */
struct argument {
    int count;
    double *of[WIDEST];
};

static struct argument p, x, t, q, qd;

static double *doubles(size_t count) {
    double *data = aligned_alloc(64, (count * sizeof(double) + 127) / 64 * 64);
    if (!data)
        exit(3);
    for (size_t i = 0; i < count; i++)
        data[i] = untouched;
    return data;
}

static void open_argument(struct argument *a, int count) {
    a->count = count;
    for (int l = 0; l < WIDEST; l++)
        a->of[l] = doubles((size_t)count);
}

static double *interleaved(const struct argument *a, int width) {
    double *data = doubles((size_t)a->count * (size_t)width);
    for (int i = 0; i < a->count; i++)
        for (int l = 0; l < width; l++)
            data[i * width + l] = a->of[l][i];
    return data;
}

static double uniform(double low, double high) {
    static unsigned long long state = 88172645463325252ULL;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return low + (high - low) * ((double)(state >> 11) / 9007199254740992.0);
}

/* Parameters near their defaults, angles of all sizes, slides near the start. */
static void draw(int l) {
    double *start = doubles(2 * (size_t)model->n), *anchors = doubles((size_t)model->anchored_count + 1);
    for (int i = 0; i < model->parameter_count; i++)
        p.of[l][i] = model->parameters[i].value * uniform(0.99, 1.01);
    for (int i = 0; i < model->input_count; i++)
        x.of[l][i] = model->inputs[i].value + uniform(-1, 1);
    t.of[l][0] = uniform(0, 2);
    if (model->prepare)
        model->prepare(p.of[l]);
    for (int i = 0; i < model->n; i++)
        start[i] = model->coordinates[i].value;
    if (model->start)
        model->start(p.of[l], x.of[l], 0, start, start, start);
    for (int i = 0; i < model->n; i++) {
        const int is_angle = !strcmp(model->coordinates[i].unit, "rad");
        q.of[l][i] = start[i] + (is_angle ? uniform(-1.5, 1.5) : uniform(-0.05, 0.05));
    }
    for (int i = 0; i < qd.count; i++)
        qd.of[l][i] = uniform(-2, 2);
    if (model->anchor && model->start) {
        model->anchor(p.of[l], x.of[l], 0, start, start + model->n, anchors);
        for (int i = 0; i < model->anchored_count; i++)
            p.of[l][model->anchored[i]] = anchors[i];
    }
    if (model->prepare)
        model->prepare(p.of[l]);
    free(start);
    free(anchors);
}

static double *call(const struct refdyn_lane_model *lanes, refdyn_lane_function *f) {
    const int width = lanes->width;
    double *arguments[] = {interleaved(&p, width), interleaved(&x, width), interleaved(&t, width),
                           interleaved(&q, width), interleaved(&qd, width)};
    double *out = doubles((size_t)MOST * (size_t)width);
    if (lanes->prepare)
        lanes->prepare(arguments[0]);
    f(arguments[0], arguments[1], arguments[2], arguments[3], arguments[4], out);
    for (int i = 0; i < 5; i++)
        free(arguments[i]);
    return out;
}

static int is_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

struct outcome {
    double error;
    long entries, different;
};

static void compare(const double *one, const double *lanes, int width, int lane, struct outcome *outcome) {
    double largest = 0;
    int count = 0;
    for (int i = 0; i < MOST; i++)
        if (!is_same(one[i], untouched)) {
            count = i + 1;
            largest = isfinite(one[i]) ? fmax(largest, fabs(one[i])) : largest;
        }
    for (int i = 0; i < MOST; i++) {
        const double a = one[i], b = lanes[i * width + lane];
        outcome->different += !is_same(a, b);
        if (isfinite(a) && isfinite(b) && a != b)
            outcome->error = fmax(outcome->error, fabs(a - b) / largest);
        else if (!is_same(a, b))
            outcome->error = INFINITY;
    }
    outcome->entries += count;
}

static struct outcome against_one(const struct refdyn_lane_model *lanes, refdyn_lane_function *f,
                                  refdyn_function *one) {
    struct outcome outcome = {0, 0, 0};
    for (int again = 0; again < TIMES; again++) {
        for (int l = 0; l < WIDEST; l++)
            draw(l);
        double *all = call(lanes, f);
        for (int l = 0; l < lanes->width; l++) {
            double *out = doubles(MOST);
            one(p.of[l], x.of[l], t.of[l][0], q.of[l], qd.of[l], out);
            compare(out, all, lanes->width, l, &outcome);
            free(out);
        }
        free(all);
    }
    return outcome;
}

/* Whether another lane has other bits when all entries of this one are `value`. */
static int reaches_neighbours(const struct refdyn_lane_model *lanes, refdyn_lane_function *f,
                              const double *before, int lane, double value) {
    const struct argument *const spoilt[] = {&p, &x, &t, &q, &qd};
    double *kept[5];
    for (int a = 0; a < 5; a++) {
        kept[a] = spoilt[a]->of[lane];
        double *data = doubles((size_t)spoilt[a]->count);
        for (int i = 0; i < spoilt[a]->count; i++)
            data[i] = value;
        ((struct argument *)spoilt[a])->of[lane] = data;
    }
    double *after = call(lanes, f);
    int count = 0;
    for (int i = 0; i < MOST * lanes->width; i++)
        count += i % lanes->width != lane && memcmp(&before[i], &after[i], sizeof *before) != 0;
    for (int a = 0; a < 5; a++) {
        free(spoilt[a]->of[lane]);
        ((struct argument *)spoilt[a])->of[lane] = kept[a];
    }
    free(after);
    return count != 0;
}

static int count_neighbours(const struct refdyn_lane_model *lanes, refdyn_lane_function *f) {
    const double values[] = {NAN, INFINITY, 1e6, 1e22};
    int count = 0;
    double *before = call(lanes, f);
    for (int v = 0; v < 4; v++)
        count += reaches_neighbours(lanes, f, before, (v * 5 + 1) % lanes->width, values[v]);
    free(before);
    return count;
}

static void report(const struct refdyn_lane_model *lanes, const char *name, refdyn_lane_function *f,
                   refdyn_function *one) {
    if (!f != !one) {
        printf("%d %s missing\n", lanes->width, name);
        return;
    }
    if (!f)
        return;
    const struct outcome outcome = against_one(lanes, f, one);
    printf("%d %s %.3g %ld %ld %d\n", lanes->width, name, outcome.error, outcome.different, outcome.entries,
           count_neighbours(lanes, f));
}

#define QUANTITIES(E)                                                                                 \
    E(start)                                                                                          \
    E(anchor)                                                                                         \
    E(M)                                                                                              \
    E(h)                                                                                              \
    E(Q)                                                                                              \
    E(u)                                                                                              \
    E(v)                                                                                              \
    E(phi)                                                                                            \
    E(psi) E(k) E(r) E(rd) E(C) E(d) E(energy) E(power) E(Q_q) E(qdd_free) E(qdd) E(force) E(inverse) \
        E(equations) E(M_h) E(f) E(row_terms) E(point_terms) E(constrained) E(terms) E(accelerations) \
            E(tangent) E(tangent_vectors) E(d_qdd) E(d_qdd_free) E(d_force) E(d_inverse) E(d_statics) \
                E(d_rows) E(course) E(breaks) E(switches) E(pace) E(event) E(event_terms) E(required)

static void report_all(const struct refdyn_lane_model *lanes) {
    if (lanes->interface_version != REFDYN_LANES_VERSION || lanes->model != model)
        printf("%d table wrong\n", lanes->width);
#define REPORT(name) report(lanes, #name, lanes->name, model->name);
    QUANTITIES(REPORT)
}

int main(void) {
    open_argument(&p, model->parameter_count + model->derived_count);
    open_argument(&x, model->input_count);
    open_argument(&t, 1);
    open_argument(&q, model->n);
    open_argument(&qd, 2 * model->n + 1 + model->m);
#ifdef ONLY
    report_all(&JOIN(MODEL, JOIN(_lanes_, ONLY)));
#else
    report_all(&JOIN(MODEL, _lanes_1));
    report_all(&JOIN(MODEL, _lanes_2));
    report_all(&JOIN(MODEL, _lanes_4));
    report_all(&JOIN(MODEL, _lanes_8));
#endif
    return 0;
}
