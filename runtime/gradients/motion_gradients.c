/*
 * Derivatives of a motion by differences of copies that repeat its steps.
 *
 * In: a motion and the values by which it is differentiated. Out: derivatives of its outputs, and where they
 * do not exist. Differences are central; where the model refuses one side, such as a negative damping, they
 * are one-sided on the other side and of the same order. repeated_steps.c says how copies repeat steps.
 *
 * The change of a value is about 1e-5 of it, adapted if the motion responds too little or too much for the
 * differences to be accurate. If a copy fails, all sides of its difference are repeated with refined steps;
 * if it meets other events, with a smaller change. Exactly on a kink, both sides have slopes of their own:
 * the second difference then falls like the change, instead of its square.
 */
#include "runtime/gradients/gradients.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    BLOCK = 32, /* variables whose copies are in memory at the same time */
    SIDES = 2,  /* copies of a variable */
    ROUNDS = 5, /* bound on the rounds of one variable */
    REFINED_MOST = 2
};
/* Change of a value relative to its size, as a power of two so that it is added without rounding; and first
 * change of a value of 0, which may be a time constant: small, so that it is raised if need be. */
enum { CHANGE_EXPONENT = -17, CHANGE_OF_ZERO = -30 };
/* Response: the largest change of positions in the motion [rad, length]. A difference between the bounds is
 * accurate; one outside them aims at `response_aim`. If changes with a response above `response_lost` meet
 * other events, there is no derivative: smaller differences would be rounding. */
static const double response_least = 1e-9, response_most = 1e-4, response_aim = 1e-6, response_lost = 1e-10;
/* Bound on the change of a value that is not zero, relative to it. */
static const double change_most = 0x1p-8;
/* Largest curvature relative to the response; curvature from rounding and errors of iterations. */
static const double curved_most = 0.05, curved_least = 1e-7;
/* Factor of the next change after copies have met other events, and bound on all later ones. */
static const double smaller = 1.0 / 64, below_failed = 1.0 / 4;
/* An output is at an event if their times differ by less than this part of the motion. There, a value jumps
 * if its second difference exceeds `jump` of the largest difference between the sides, and rounding. */
static const double near_part = 1e-5, jump = 0.05, rounding = 1e-11;
/* Sides of a value have different slopes if the second difference of a column exceeds this part of its
 * difference and, when the change is divided by `probe`, is divided by `probe` as well, up to the last part:
 * that of a smooth column falls by the square of `probe`, rounding by any factor. At a jump, neither
 * difference falls, and both are equal up to the last part. */
static const double bent_least = 5e-3, probe = 4, unequal = 0.02;
/* Bends below the first part of a column, where accelerations and forces have rounding, must fall more
 * exactly. */
static const double noise = 1e-8, exact = 1e-3;
/* A bend is no rounding in a column that is larger by the first factor. Elsewhere it must exceed these parts
 * of the largest difference and of the largest value of all columns, and its own difference by the last
 * factor, or be equal to that: one side has no slope. */
static const double natural = 100, seen_least = 1e-7, trace = 1e-13, symmetric = 30;

/* Which copies form a difference; x the value and d its change. */
enum form { CENTRAL, /* x + d, x - d */ ONE_SIDED /* x + d, x + 2 d */ };

/* The difference by one variable. */
struct difference {
    enum form form;
    double change;
    double failed; /* first change with which copies have failed; 0: none */
    double good;   /* last change with which they have not; 0: none */
    double most;   /* bound on the magnitude of further changes */
    int tries, is_open;
    int is_probing; /* its sides are compared with those of a larger change */
    int is_lost;    /* there is no derivative: the last copies are those with the change `failed` */
};

/* How a copy has ended. */
struct ending {
    int status, outputs, event, is_at_start;
    double t;
};

struct run {
    struct refdyn_derivatives *given;
    struct recorded_steps recorded;
    int refined;        /* how often the pattern was refined */
    int n, width, rows; /* rows: outputs that memory has */
    double *start;      /* p, x, q, qd of the motion at its start */
    double *q;          /* (rows x n) positions without a change, as `base` */
    double *times;      /* (rows) of its outputs [s] */
    int *is_near;       /* (rows) an event is at this output */
    int needs_base;     /* differences need a copy without a change that repeats the steps of the others */
    int has_base;       /* it has been computed */
    double *base;       /* (rows x width) values without a change: of this copy, otherwise of the motion */

    struct difference differences[BLOCK];
    int first, count; /* variables of the block */
    struct shift shifts[SIDES * BLOCK + 1];
    struct ending endings[SIDES * BLOCK + 1];
    double *bends;     /* (block x width) largest second difference of each column; -1: its sides differ */
    double *apart;     /* (block x width) largest difference */
    double *values;    /* (SIDES * block x rows x width) by copy */
    double *positions; /* (SIDES * block x rows x n) */
    double cpu_s;      /* of the last copies [s]; their ends are counted under the lock of `counted` */
};

static size_t row_size(const struct run *run) {
    return (size_t)run->rows * (size_t)run->width;
}

/* ---- States of the motion and of copies ---- */

static void write_values(const struct refdyn_derivatives *given, const struct refdyn_batch_case *one,
                         double *values) {
    if (given->values)
        given->values(given->context, one, values);
    else
        memcpy(values, one->integrator->q, 2 * (size_t)given->batch->model->n * sizeof *values);
}

/* Keeps what the motion starts with: p, x, q and qd. */
static void keep_start(struct run *run, const struct refdyn_integrator *integrator) {
    const struct refdyn_workspace *work = integrator->work;
    const struct refdyn_model *model = work->model;
    double *start = run->start;
    memcpy(start, work->p, (size_t)model->parameter_count * sizeof *start);
    memcpy(start + model->parameter_count, work->x, (size_t)model->input_count * sizeof *start);
    memcpy(start + model->parameter_count + model->input_count, integrator->q,
           2 * (size_t)run->n * sizeof *start);
}

/* The coordinates of joints, and the values of states. */
static void keep_positions(const struct refdyn_integrator *integrator, double *positions) {
    const struct refdyn_model *model = integrator->work->model;
    const int n = model->n, joints = refdyn_joint_count(model);
    memcpy(positions, integrator->q, (size_t)joints * sizeof *positions);
    memcpy(positions + joints, integrator->qd + joints, (size_t)(n - joints) * sizeof *positions);
}

static int step_of_motion(void *context, const struct refdyn_batch_case *one) {
    const struct refdyn_derivatives *given = ((struct run *)context)->given;
    return given->step(given->context, one);
}

static int see_motion(void *context, const struct refdyn_batch_case *one, int number) {
    struct run *run = context;
    if (number == 0)
        keep_start(run, one->integrator);
    keep_positions(one->integrator, run->q + (size_t)number * (size_t)run->n);
    run->times[number] = one->integrator->t;
    const size_t width = (size_t)run->width, at = (size_t)number * width;
    write_values(run->given, one, run->base + at);
    if (run->given->at)
        memcpy(run->given->at + at, run->base + at, width * sizeof(double));
    run->given->outputs = number + 1;
    return 0;
}

static int end_motion(void *context, const struct refdyn_batch_case *one,
                      const struct refdyn_batch_result *result) {
    struct run *run = context;
    run->given->motion = *result;
    if (result->status == REFDYN_EVENT_ENDS)
        see_motion(run, one, run->given->outputs);
    return 0;
}

static double *values_of(const struct run *run, long copy) {
    return copy == SIDES * BLOCK ? run->base : run->values + (size_t)copy * row_size(run);
}

static int see_copy(void *context, const struct refdyn_batch_case *one, int number) {
    struct run *run = context;
    const size_t n = (size_t)run->n, row = (size_t)number;
    if (number >= run->given->outputs)
        return 0;
    write_values(run->given, one, values_of(run, one->number) + row * (size_t)run->width);
    keep_positions(one->integrator,
                   one->number == SIDES * BLOCK
                       ? run->q + row * n
                       : run->positions + ((size_t)one->number * (size_t)run->rows + row) * n);
    run->endings[one->number].outputs = number + 1;
    return 0;
}

/* The event that has happened on one side only; -1: the model does not name it. */
static int other_event(const struct refdyn_motion *motion) {
    const struct refdyn_state_events *events = &motion->state_events;
    const struct refdyn_repetition *repetition = &motion->repetition;
    const struct refdyn_pattern *pattern = repetition->pattern;
    int event = events->due_count > 0 ? events->due[0] : -1;
    if (event < 0 && repetition->next < pattern->step_count) {
        const int waypoint = pattern->steps[repetition->next].waypoint;
        if (waypoint >= 0 && pattern->waypoints[waypoint].due_count > 0)
            event = pattern->places[pattern->waypoints[waypoint].first_due];
    }
    return event < motion->work->model->event_count ? event : -1;
}

static int end_copy(void *context, const struct refdyn_batch_case *one,
                    const struct refdyn_batch_result *result) {
    struct run *run = context;
    struct ending *ending = &run->endings[one->number];
    const struct refdyn_integrator *integrator = one->integrator;
    const struct refdyn_repetition *repetition = &integrator->motion->repetition;
    const int has_left = result->stage == REFDYN_AT_STEPS && repetition->status;
    ending->status = has_left ? repetition->status : result->status;
    ending->t = has_left                              ? repetition->t_failed
                : result->status == REFDYN_EVENT_ENDS ? result->t
                                                      : integrator->failed_t;
    if (ending->status == REFDYN_EVENT_ENDS && run->given->motion.status == REFDYN_EVENT_ENDS)
        see_copy(run, one, ending->outputs);
    if (ending->status == REFDYN_NO_DERIVATIVE) {
        ending->event = other_event(integrator->motion);
        ending->is_at_start = repetition->next == 0;
    }
    return 0;
}

/* ---- The motion ---- */

static int run_motion(struct run *run) {
    const struct shift none = {.what = REFDYN_VARIED_SAMPLES};
    struct refdyn_derivatives *given = run->given;
    struct refdyn_batch batch = *given->batch;
    const struct refdyn_copies copies = {given->number, &none, NULL, &run->recorded.watch};
    const long first = 0;
    long ended;
    batch.lanes = NULL;
    batch.count = batch.threads = 1;
    batch.numbers = &first;
    batch.copies = &copies;
    batch.context = run;
    batch.output = see_motion;
    batch.step = given->step ? step_of_motion : NULL;
    batch.end = end_motion;
    batch.states = NULL;
    batch.statuses = NULL;
    const int status = refdyn_batch_run(&batch, &ended);
    if (status)
        return status;
    given->cpu_s = given->motion.cpu_s;
    if (given->motion.status && given->motion.status != REFDYN_EVENT_ENDS)
        return given->motion.status;
    return ended < 1 ? REFDYN_BAD_OPTION : refdyn_recorded_end(&run->recorded);
}

/* Marks outputs at events, where values may jump. Outputs and waypoints ascend. */
static void find_near(struct run *run) {
    const struct refdyn_pattern *pattern = &run->recorded.pattern;
    const int last = run->given->outputs - 1, is_ended = run->given->motion.status == REFDYN_EVENT_ENDS;
    const double width = near_part * (run->times[last] - run->times[0]);
    for (int i = 1, first = 1; i <= last; i++) {
        while (first < pattern->waypoint_count && pattern->waypoints[first].t < run->times[i] - width)
            first++;
        for (int k = first; k < pattern->waypoint_count && pattern->waypoints[k].t <= run->times[i] + width;
             k++) {
            const struct refdyn_waypoint *there = &pattern->waypoints[k];
            run->is_near[i] |=
                there->break_count + there->is_switch + there->due_count > 0 && !(is_ended && i == last);
        }
    }
}

/* ---- Changes of values ---- */

static double value_of(const struct run *run, const struct refdyn_variable *variable) {
    const struct refdyn_model *model = run->given->batch->model;
    const double *x = run->start + model->parameter_count, *q = x + model->input_count;
    switch (variable->what) {
    case REFDYN_VARIED_PARAMETER:
        return run->start[variable->place];
    case REFDYN_VARIED_INPUT:
        return x[variable->place];
    case REFDYN_VARIED_COORDINATE:
        return q[variable->place];
    default:
        return q[run->n + variable->place];
    }
}

static int is_of_state(const struct refdyn_variable *variable) {
    return variable->what == REFDYN_VARIED_COORDINATE || variable->what == REFDYN_VARIED_RATE;
}

/* The largest power of two that is not larger than x in magnitude, with its sign. */
static double power_of_two(double x) {
    return copysign(ldexp(1, ilogb(x)), x);
}

/* The first change of a variable. A value of 0 says nothing about its size; its change follows the response.
 */
static double first_change(const struct run *run, const struct refdyn_variable *variable) {
    const struct refdyn_batch *batch = run->given->batch;
    double size = fabs(value_of(run, variable));
    if (is_of_state(variable))
        size = fmax(size, refdyn_coordinate_unit(batch->model, variable->place, batch->options.length));
    return size > 0 ? ldexp(power_of_two(size), CHANGE_EXPONENT) : ldexp(1, CHANGE_OF_ZERO);
}

/* What a copy of this side adds to the value. */
static double change_of(const struct difference *difference, int side) {
    if (difference->form == ONE_SIDED)
        return (side + 1) * difference->change;
    return side == 0 ? difference->change : -difference->change;
}

static void set_shifts(struct run *run) {
    for (int i = 0; i < run->count; i++)
        for (int side = 0; side < SIDES; side++) {
            const struct refdyn_variable *variable = &run->given->variables[run->first + i];
            const double change = change_of(&run->differences[i], side);
            run->shifts[SIDES * i + side] =
                (struct shift){variable->what, variable->place, change,
                               run->given->end_rates ? run->given->end_rates[run->first + i] * change : 0};
        }
    run->shifts[SIDES * BLOCK] = (struct shift){.what = REFDYN_VARIED_SAMPLES};
}

/* ---- Copies ---- */

/* Computes these copies. */
static int run_copies(struct run *run, const long *numbers, long count) {
    struct refdyn_derivatives *given = run->given;
    const struct refdyn_copies copies = {given->number, run->shifts, &run->recorded.pattern, NULL};
    struct refdyn_batch batch = *given->batch;
    const clock_t began = clock();
    long ended;
    batch.copies = &copies;
    batch.count = count;
    batch.numbers = numbers;
    batch.options.balance = 0;
    batch.options.project_start |= batch.model->m > 0 && batch.options.stabilise == REFDYN_PROJECT;
    batch.context = run;
    batch.output = see_copy;
    batch.step = given->step ? step_of_motion : NULL;
    batch.end = end_copy;
    batch.states = NULL;
    batch.statuses = NULL;
    for (long i = 0; i < count; i++)
        run->endings[numbers[i]] = (struct ending){.event = -1};
    const int status = refdyn_batch_run(&batch, &ended);
    given->copies += count;
    given->copies_cpu_s += (double)(clock() - began) / CLOCKS_PER_SEC;
    return status ? status : ended < count ? REFDYN_BAD_OPTION : REFDYN_OK;
}

/* Computes the copies of all open differences. */
static int run_open(struct run *run) {
    long numbers[SIDES * BLOCK + 1], count = 0;
    set_shifts(run);
    for (int i = 0; i < run->count; i++)
        for (int side = 0; side < SIDES && run->differences[i].is_open; side++)
            numbers[count++] = SIDES * i + side;
    run->needs_base |= run->recorded.has_other_steps;
    for (int i = 0; i < run->count; i++)
        run->needs_base |= run->differences[i].is_open && run->differences[i].form == ONE_SIDED;
    if (run->needs_base && !run->has_base)
        numbers[count++] = SIDES * BLOCK;
    run->has_base = run->needs_base;
    return run_copies(run, numbers, count);
}

/* ---- Judgement ---- */

static const struct ending *ending_of(const struct run *run, int i, int side) {
    return &run->endings[SIDES * i + side];
}

/* Has a copy ended like the motion? */
static int is_like_motion(const struct run *run, const struct ending *ending) {
    return ending->status == run->given->motion.status && ending->outputs == run->given->outputs;
}

/* Response of the positions to the change, and its curvature. */
static void find_response(const struct run *run, int i, double *response, double *curvature) {
    const struct refdyn_batch *batch = run->given->batch;
    const size_t n = (size_t)run->n, size = (size_t)run->rows * n;
    const double *a = run->positions + (size_t)(SIDES * i) * size, *b = a + size;
    const int is_ended = run->given->motion.status == REFDYN_EVENT_ENDS;
    *response = *curvature = 0;
    for (size_t k = 0; k < (size_t)(run->given->outputs - is_ended) * n; k++) {
        const double unit = refdyn_coordinate_unit(batch->model, (int)(k % n), batch->options.length);
        *response = fmax(*response, fabs(a[k] - b[k]) / 2 / unit);
        *curvature = fmax(*curvature, fabs(a[k] - 2 * run->q[k] + b[k]) / 2 / unit);
    }
}

/* Is the curvature of a difference too large? */
static int is_curved(const struct difference *difference, double response, double curvature) {
    return difference->form == CENTRAL && curvature > curved_least && curvature > curved_most * response;
}

/* The change with which to form the difference again; the same change if it is good, with its response. */
static double better_change(const struct run *run, int i, double *response, double *curvature) {
    const struct difference *difference = &run->differences[i];
    const double value = value_of(run, &run->given->variables[run->first + i]);
    double change = difference->change;
    find_response(run, i, response, curvature);
    if (*response == 0)
        return change;
    if (*response > response_most)
        change *= response_aim / *response;
    else if (is_curved(difference, *response, *curvature))
        change *= fmax(smaller, curved_most * *response / *curvature / 4);
    else if (*response < response_least)
        change *= response_aim / *response;
    if (fabs(change) > fabs(difference->change)) {
        const double most = fmin(difference->most, value != 0 ? change_most * fabs(value) : INFINITY);
        change = copysign(fmax(fabs(difference->change), fmin(fabs(change), most)), change);
    }
    return change == difference->change ? change : power_of_two(change);
}

/* Notes how a copy has failed, and from when on its outputs are missing. */
static void note_failure(struct run *run, int i, const struct ending *ending, double change) {
    struct refdyn_underivable *found = &run->given->underivable[run->first + i];
    const double t =
        ending->outputs < run->given->outputs ? fmin(ending->t, run->times[ending->outputs]) : ending->t;
    if (is_like_motion(run, ending) || (found->status && found->t <= t))
        return;
    *found = (struct refdyn_underivable){.status = ending->status ? ending->status : REFDYN_NO_DERIVATIVE,
                                         .t = t,
                                         .change = change,
                                         .event = ending->event,
                                         .is_at_start = ending->is_at_start};
}

static void note_failures(struct run *run, int i) {
    for (int side = 0; side < SIDES; side++)
        note_failure(run, i, ending_of(run, i, side), change_of(&run->differences[i], side));
    if (run->has_base)
        note_failure(run, i, &run->endings[SIDES * BLOCK], 0);
}

/* Has one of the copies that form the difference not ended like the motion? */
static int has_failed(const struct run *run, int i) {
    return !is_like_motion(run, ending_of(run, i, 0)) || !is_like_motion(run, ending_of(run, i, 1)) ||
           (run->has_base && !is_like_motion(run, &run->endings[SIDES * BLOCK]));
}

/* Has a copy not been able to take a step? */
static int is_stuck(const struct ending *ending) {
    return ending->status == REFDYN_NO_CONVERGENCE || ending->status == REFDYN_NOT_FINITE;
}

/* Prepares another round of a difference after one of its sides has failed; *refines: with refined steps.
 * Returns 0 if there is no remedy. */
static int remedy(const struct run *run, struct difference *difference, const struct ending *a,
                  const struct ending *b, int *refines) {
    const int is_refused = a->status == REFDYN_REFUSED || b->status == REFDYN_REFUSED;
    if (is_refused && difference->form == CENTRAL) {
        difference->form = ONE_SIDED;
        difference->change *= a->status == REFDYN_REFUSED ? -1 : 1;
        return 1;
    }
    if (is_refused)
        return 0;
    if (run->refined < REFINED_MOST &&
        ((is_stuck(a) && is_stuck(b)) || (difference->tries > 1 && (is_stuck(a) || is_stuck(b))))) {
        *refines = 1;
        return 1;
    }
    const int was_good = difference->good != 0;
    difference->failed = difference->failed == 0 ? difference->change : difference->failed;
    difference->most = was_good ? fabs(difference->good) : below_failed * fabs(difference->change);
    difference->change = was_good ? difference->good : smaller * difference->change;
    return was_good || difference->tries < 3;
}

/* There is no derivative from the time of a failure on. Before it, differences are most accurate with the
 * first change, whose copies are computed again. */
static void lose(struct run *run, int i) {
    struct difference *difference = &run->differences[i];
    note_failures(run, i);
    difference->is_lost = 1;
    difference->is_open = difference->failed != 0 && difference->failed != difference->change;
    difference->change = difference->is_open ? difference->failed : difference->change;
}

/* The largest difference between the two sides of column k, over all outputs. */
static double largest_difference(const struct run *run, const double *a, const double *b, int k) {
    double largest = 0;
    for (int row = 0; row < run->given->outputs; row++)
        largest = fmax(largest, fabs(a[(size_t)row * (size_t)run->width + (size_t)k] -
                                     b[(size_t)row * (size_t)run->width + (size_t)k]));
    return largest;
}

/* The largest value of column k, except at events. */
static double largest_value(const struct run *run, int k) {
    double largest = 0;
    for (int row = 0; row < run->given->outputs; row++)
        if (!run->is_near[row])
            largest = fmax(largest, fabs(run->base[(size_t)row * (size_t)run->width + (size_t)k]));
    return largest;
}

/* The largest difference and second difference of column k, except at events, where values jump. Returns
 * whether the sides may have different slopes; `least` is that of least_bend. */
static int find_bend(const struct run *run, int i, int k, double least, double *apart, double *bend) {
    const double *a = values_of(run, SIDES * i), *b = values_of(run, SIDES * i + 1);
    const double size = largest_value(run, k);
    *apart = *bend = 0;
    for (int row = 0; row < run->given->outputs; row++) {
        const size_t at = (size_t)row * (size_t)run->width + (size_t)k;
        if (run->is_near[row])
            continue;
        *apart = fmax(*apart, fabs(a[at] - b[at]));
        *bend = fmax(*bend, fabs(a[at] - 2 * run->base[at] + b[at]));
    }
    const int is_clear = *bend > least && (*bend > symmetric * *apart || *bend == *apart);
    return *bend > rounding * size && *bend > bent_least * *apart && (size > natural * *bend || is_clear);
}

/* The least second difference that is no rounding in a column that is 0 otherwise. */
static double least_bend(const struct run *run, int i) {
    const double *a = values_of(run, SIDES * i), *b = values_of(run, SIDES * i + 1);
    double least = 0;
    for (int k = 0; k < run->width; k++)
        least =
            fmax(least, fmax(seen_least * largest_difference(run, a, b, k), trace * largest_value(run, k)));
    return least;
}

/* Looks for columns whose sides may have different slopes: these copies are compared with those of a smaller
 * change, and with one without a change. */
static void compare_sides(struct run *run, int i) {
    struct difference *difference = &run->differences[i];
    const size_t first = (size_t)i * (size_t)run->width;
    const double least = least_bend(run, i);
    int count = 0;
    for (int k = 0; k < run->width && difference->form == CENTRAL && !run->given->keeps_means; k++) {
        double *bend = &run->bends[first + (size_t)k];
        if (find_bend(run, i, k, least, &run->apart[first + (size_t)k], bend))
            count++;
        else
            *bend = 0;
    }
    if (count == 0)
        return;
    run->needs_base = difference->is_open = 1;
    difference->is_probing = run->has_base;
    difference->change /= run->has_base ? probe : 1;
}

/* Marks columns whose sides have different slopes. */
static void judge_probe(struct run *run, int i) {
    const double least = least_bend(run, i);
    for (int k = 0; k < run->width; k++) {
        const size_t at = (size_t)i * (size_t)run->width + (size_t)k;
        double apart, bend;
        const int is_seen = find_bend(run, i, k, least, &apart, &bend) && run->bends[at] > 0;
        const double off = bend > noise * largest_value(run, k) ? unequal : exact;
        const int is_kink = fabs(run->bends[at] - probe * bend) < off * probe * bend,
                  is_jump =
                      fabs(run->apart[at] - apart) < unequal * apart && fabs(apart - bend) < unequal * apart;
        run->bends[at] = is_seen && (is_kink || is_jump) ? -1 : 0;
    }
}

/* Judges a difference whose copies have ended like the motion. If it is curved, the motion itself may differ
 * from its copies, whose iterations end at another tolerance: a copy without a change shows this. */
static void judge_good(struct run *run, int i) {
    struct difference *difference = &run->differences[i];
    double response, curvature;
    const double change = better_change(run, i, &response, &curvature);
    if (!run->has_base && is_curved(difference, response, curvature)) {
        run->needs_base = difference->is_open = 1;
        return;
    }
    difference->good = difference->change;
    difference->is_open = change != difference->change && difference->tries < ROUNDS;
    if (difference->is_open)
        difference->change = change;
    else if (difference->failed != 0 && response < response_lost)
        lose(run, i);
    else
        compare_sides(run, i);
}

/* Judges a difference whose copies were computed. */
static void judge(struct run *run, int i, int *refines) {
    struct difference *difference = &run->differences[i];
    difference->tries++;
    difference->is_open = 0;
    if (difference->is_lost)
        note_failures(run, i);
    else if (!has_failed(run, i) && difference->is_probing)
        judge_probe(run, i);
    else if (!has_failed(run, i))
        judge_good(run, i);
    else if (difference->tries < ROUNDS &&
             remedy(run, difference, ending_of(run, i, 0), ending_of(run, i, 1), refines))
        difference->is_open = 1;
    else
        lose(run, i);
}

static int has_open(const struct run *run) {
    int has = 0;
    for (int i = 0; i < run->count; i++)
        has |= run->differences[i].is_open;
    return has;
}

/* ---- Differences ---- */

/* Does value number `at` jump at the event that is at its output? */
static int jumps(const struct run *run, enum form form, const double *a, const double *b, size_t at) {
    const double base = run->base[at],
                 twice = fabs(form == CENTRAL ? a[at] - 2 * base + b[at] : base - 2 * a[at] + b[at]);
    return twice > rounding * fabs(base) &&
           twice > jump * largest_difference(run, a, b, (int)(at % (size_t)run->width));
}

/* Does value number `at` have different slopes on the sides of the variable? */
static int is_bent(const struct run *run, int i, const double *a, const double *b, size_t at) {
    const double bend = fabs(a[at] - 2 * run->base[at] + b[at]);
    return run->bends[(size_t)i * (size_t)run->width + at % (size_t)run->width] < 0 &&
           bend > rounding * fabs(run->base[at]) && bend > bent_least * fabs(a[at] - b[at]);
}

/* Notes such a value; the last one of the first column is kept with its slopes. */
static void note_bend(const struct run *run, struct refdyn_underivable *found, const double *a,
                      const double *b, int row, int k, double change) {
    const size_t at = (size_t)row * (size_t)run->width + (size_t)k;
    if (found->bends++ == 0) {
        found->t_bend = run->times[row];
        found->column = k;
    }
    if (k <= found->column) {
        found->column = k;
        found->t_slopes = run->times[row];
        found->above = (a[at] - run->base[at]) / change;
        found->below = (run->base[at] - b[at]) / change;
    }
}

/* Writes the derivatives by variable i of the block. */
static void write_derivatives(struct run *run, int i) {
    struct refdyn_derivatives *given = run->given;
    const struct difference *difference = &run->differences[i];
    struct refdyn_underivable *found = &given->underivable[run->first + i];
    const double value = value_of(run, &given->variables[run->first + i]);
    const double by[SIDES] = {change_of(difference, 0), change_of(difference, 1)};
    const double *a = values_of(run, SIDES * i), *b = values_of(run, SIDES * i + 1);
    double *out = given->derivatives + (size_t)(run->first + i) * row_size(run);
    const double apart = (value + by[0]) - (value + by[1]);
    for (int row = 0; row < given->outputs; row++)
        for (int k = 0; k < run->width; k++) {
            const size_t at = (size_t)row * (size_t)run->width + (size_t)k;
            const int is_lost = found->status && (run->times[row] >= found->t || found->is_at_start);
            out[at] = is_lost ? NAN
                      : difference->form == CENTRAL
                          ? (a[at] - b[at]) / apart
                          : (4 * a[at] - b[at] - 3 * run->base[at]) / (2 * difference->change);
            if (!is_lost && run->is_near[row] && jumps(run, difference->form, a, b, at)) {
                found->t_jump = found->jumps++ == 0 ? run->times[row] : found->t_jump;
                out[at] = NAN;
            } else if (!is_lost && is_bent(run, i, a, b, at)) {
                note_bend(run, found, a, b, row, k, difference->change);
                out[at] = NAN;
            }
        }
}

/* ---- All variables, block by block ---- */

/* Refines the steps. All differences that exist are formed again, with the same steps as `base`. */
static int refine(struct run *run) {
    run->refined++;
    run->has_base = 0;
    for (int i = 0; i < run->count; i++)
        run->differences[i].is_open = !run->differences[i].is_lost;
    return refdyn_recorded_refine(&run->recorded);
}

static int differentiate_block(struct run *run) {
    memset(run->bends, 0, BLOCK * (size_t)run->width * sizeof *run->bends);
    for (int i = 0; i < run->count; i++)
        run->differences[i] =
            (struct difference){.form = CENTRAL,
                                .change = first_change(run, &run->given->variables[run->first + i]),
                                .most = INFINITY,
                                .is_open = 1};
    while (has_open(run)) {
        int refines = 0, status = run_open(run);
        for (int i = 0; i < run->count && !status; i++)
            if (run->differences[i].is_open)
                judge(run, i, &refines);
        if (!status && refines)
            status = refine(run);
        if (status)
            return status;
    }
    for (int i = 0; i < run->count; i++)
        write_derivatives(run, i);
    return REFDYN_OK;
}

/* Allocates the memory of the motion and of the copies of a block. */
static int allocate(struct run *run) {
    const struct refdyn_derivatives *given = run->given;
    const struct refdyn_model *model = given->batch->model;
    const size_t rows = (size_t)run->rows, n = (size_t)run->n,
                 copies = SIDES * (size_t)(given->count < BLOCK ? given->count : BLOCK);
    const size_t start = (size_t)model->parameter_count + (size_t)model->input_count + 2 * n;
    run->start = malloc(start * sizeof(double));
    run->q = malloc((rows * n + 1) * sizeof(double));
    run->times = malloc(rows * sizeof(double));
    run->is_near = calloc(rows, sizeof *run->is_near);
    run->base = malloc((row_size(run) + 1) * sizeof(double));
    run->bends = calloc(BLOCK * (size_t)run->width + 1, sizeof(double));
    run->apart = malloc((BLOCK * (size_t)run->width + 1) * sizeof(double));
    run->values = malloc((copies * row_size(run) + 1) * sizeof(double));
    run->positions = malloc((copies * rows * n + 1) * sizeof(double));
    return run->start && run->q && run->times && run->is_near && run->base && run->bends && run->apart &&
                   run->values && run->positions
               ? refdyn_recorded_start(&run->recorded, model)
               : REFDYN_BAD_MEMORY;
}

static void release(struct run *run) {
    refdyn_recorded_release(&run->recorded);
    free(run->start);
    free(run->q);
    free(run->times);
    free(run->is_near);
    free(run->base);
    free(run->bends);
    free(run->apart);
    free(run->values);
    free(run->positions);
    free(run);
}

static int are_variables(const struct refdyn_derivatives *given) {
    const struct refdyn_model *model = given->batch->model;
    for (int i = 0; i < given->count; i++) {
        const struct refdyn_variable *variable = &given->variables[i];
        const int most = variable->what == REFDYN_VARIED_PARAMETER ? model->parameter_count
                         : variable->what == REFDYN_VARIED_INPUT   ? model->input_count
                         : variable->what == REFDYN_VARIED_SAMPLES ? 0
                                                                   : model->n;
        if (variable->place < 0 || variable->place >= most)
            return 0;
    }
    return given->count >= 0 && (given->values ? given->width >= 0 : given->width == 2 * model->n);
}

int refdyn_derivatives_run(struct refdyn_derivatives *given) {
    int status = given && given->batch ? refdyn_model_status(given->batch->model) : REFDYN_BAD_MEMORY;
    if (status)
        return status;
    if (given->count > 0 && !(given->variables && given->derivatives && given->underivable))
        return REFDYN_BAD_MEMORY;
    if (!are_variables(given) || given->batch->time_count < 1 || given->number < 0)
        return REFDYN_BAD_OPTION;
    struct run *run = calloc(1, sizeof *run);
    if (!run)
        return REFDYN_BAD_MEMORY;
    run->given = given;
    run->n = given->batch->model->n;
    run->width = given->width;
    run->rows = given->batch->time_count + 2;
    given->outputs = 0;
    given->cpu_s = given->copies_cpu_s = 0;
    given->copies = 0;
    for (int i = 0; i < given->count; i++)
        given->underivable[i] = (struct refdyn_underivable){.event = -1};
    status = allocate(run);
    if (!status)
        status = run_motion(run);
    if (!status)
        find_near(run);
    for (; run->first < given->count && !status; run->first += BLOCK) {
        run->count = given->count - run->first < BLOCK ? given->count - run->first : BLOCK;
        status = differentiate_block(run);
    }
    release(run);
    return status;
}
