/*
 * The functions of a live page's module: one motion after another, with values that the page writes into the
 * arrays of the module. It records motions as `sim` does, so that numbers and messages are the same.
 *
 * The page calls live_open once. For each motion it writes parameters, inputs and start, calls live_begin,
 * and then live_advance until this returns no LIVE_GOES_ON. Between the calls it may begin another motion.
 */
#include "runtime/tool/results/live/module/live_module.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Results of live_advance. */
enum { LIVE_GOES_ON = 1, LIVE_DONE = 0, LIVE_FAILED = -1 };

enum {
    RECORD_PAUSED = 2000, /* status of the watch, beyond those of record.h */
    REFUSED_LENGTH = 400
};

/* ---- Memory ---- */

static struct record_memory memory_of(struct live *live) {
    return (struct record_memory){live_get_block, live};
}

static double *new_numbers(size_t count) {
    double *numbers = calloc(count + 1, sizeof *numbers);
    if (!numbers)
        abort();
    return numbers;
}

/* The record calls this for sampled inputs, which are those of the hand. */
#ifdef __wasm__
double refdyn_samples_set(const struct refdyn_samples *samples, double t, double *x) {
    return live_sample_pull((struct live *)samples, t, x);
}
#endif

/* ---- The model ---- */

EXPORT(live_open) struct live *live_open(void) {
    const struct refdyn_model *model = live_model.model;
    const size_t n = (size_t)model->n, size = refdyn_workspace_size(model);
    const size_t parameters = (size_t)model->parameter_count, inputs = (size_t)model->input_count;
    struct live *live = calloc(1, sizeof *live);
    void *memory = malloc(size);
    if (!live || !memory || refdyn_workspace_init(&live->work, model, memory, size) != REFDYN_OK)
        abort();
    live->defaults = new_numbers(parameters + inputs);
    memcpy(live->defaults, live->work.p, parameters * sizeof *live->defaults);
    for (size_t i = 0; i < inputs; i++)
        live->defaults[parameters + i] = live->work.x[i];
    live->start = new_numbers(2 * n);
    live->q = new_numbers(2 * n);
    live->qd = live->q + n;
    live->start_given = (int *)new_numbers(2 * n);
    live->given = (int *)new_numbers((size_t)model->anchored_count);
    live->parameters = new_numbers((size_t)live_model.parameter_count);
    live->numbers =
        new_numbers((size_t)live_model.number_count + LIVE_SHAPE_NUMBERS * (size_t)live_model.shape_count);
    live->residuals = new_numbers((size_t)live_model.curve_count);
    live->points = new_numbers(6 * (size_t)model->point_count);
    live->pull.point = -1;
    return live;
}

/* The arrays that the page writes. Parameters have the default values of the model in its file. */
EXPORT(live_parameters) double *live_parameters(struct live *live) {
    return live->work.p;
}

EXPORT(live_inputs) double *live_inputs(struct live *live) {
    return live->work.x;
}

/* (2 n) positions and rates at the start; those that live_start_given marks are used. */
EXPORT(live_start) double *live_start(struct live *live) {
    return live->start;
}

EXPORT(live_start_given) int *live_start_given(struct live *live) {
    return live->start_given;
}

/* (anchored_count) non-zero: the parameter keeps the value that the page has written. */
EXPORT(live_given) int *live_given(struct live *live) {
    return live->given;
}

/* (2 n) the start of the last motion. */
EXPORT(live_used_start) const double *live_used_start(struct live *live) {
    return live->q;
}

/* ---- Rows ---- */

static void make_room(struct live *live) {
    if (live->row_count < live->room)
        return;
    live->room = live->record.outputs + 2 > live->room ? live->record.outputs + 2 : 2 * live->room;
    const size_t room = (size_t)live->room;
    live->rows = realloc(live->rows, room * (size_t)live_column_count(live) * sizeof *live->rows);
    live->applied =
        realloc(live->applied, room * ((size_t)live_model.applied_count + 1) * sizeof *live->applied);
    if (!live->rows || !live->applied)
        abort();
}

/* Adds a row at the integrator's state. Returns a status of the runtime. */
static int add_row(struct live *live) {
    record_table_fill_row(&live->table);
    live->unfit = record_table_not_finite(&live->table);
    if (live->unfit) {
        live->work.fault = (struct refdyn_fault){.row = -1, .coordinate = -1};
        return REFDYN_NOT_FINITE;
    }
    make_room(live);
    double *row = live->rows + live->row_count * live_column_count(live);
    const int before = live_columns_before_hand(live), after = live_column_count(live) - before;
    memcpy(row, live->table.values, (size_t)before * sizeof *row);
    memcpy(row + before, live->table.values + live->table.count - after, (size_t)after * sizeof *row);
    live_add_applied(live);
    live->row_count++;
    return REFDYN_OK;
}

/* ---- Messages ---- */

static void refused_text(const struct live *live, char *text, size_t size) {
    const struct refdyn_workspace *work = &live->work;
    const struct refdyn_requirement *requirement = &work->model->requirements[work->refused];
    double x[REFDYN_REQUIREMENT_NUMBERS];
    refdyn_refused_numbers(work, x);
    const int length =
        snprintf(text, size, "%s: %s: ", live_model.requirement_places[work->refused], requirement->subject);
    if (length > 0 && (size_t)length < size)
        snprintf(text + length, size - (size_t)length, requirement->fact, x[0], x[1], x[2], x[3], x[4], x[5]);
}

void live_clear_message(struct live *live) {
    free(live->message);
    live->message = NULL;
}

EXPORT(live_message) const char *live_message(struct live *live) {
    return live->message ? live->message : "";
}

/* ---- The motion ---- */

static void end_motion(struct live *live) {
    if (live->integrator.motion)
        record_restore(&live->record);
    live->integrator = (struct refdyn_integrator){.motion = NULL};
    live_release_blocks(live);
}

/* step > 0: fixed steps, as --step; otherwise the tolerances, as --tol and --tol-rates. */
static struct refdyn_options options_of(double step, double tol, double tol_rates) {
    struct refdyn_options options = refdyn_options_default(step > 0 ? REFDYN_RK4 : REFDYN_AUTO);
    if (step > 0) {
        options.step = step;
        options.tol = 0;
    } else {
        options.tol = tol;
        options.tol_rates = tol_rates;
    }
    options.balance = 1;
    return options;
}

/* ---- Its start ---- */

/* Position rows hold, but a row that reads a value from the start does so only if the page has given it. */
static int *list_rows(struct live *live, int *count) {
    const struct refdyn_model *model = live->work.model;
    int *rows = live_get_block(live, (size_t)model->m * sizeof *rows);
    *count = 0;
    for (int i = 0; i < model->m; i++) {
        bool waits = model->rows[i].level != REFDYN_POSITION;
        for (int k = 0; k < model->anchored_count; k++)
            waits = waits || (live_model.row_waits[i * model->anchored_count + k] && !live->given[k]);
        if (!waits)
            rows[(*count)++] = i;
    }
    return rows;
}

static struct record_equilibrium equilibrium_of(struct live *live) {
    const struct refdyn_model *model = live->work.model;
    const char **starts = live_get_block(live, (size_t)model->m * sizeof *starts);
    for (int i = 0; i < model->m; i++)
        for (int k = model->anchored_count - 1; k >= 0; k--)
            if (live_model.row_waits[i * model->anchored_count + k])
                starts[i] = model->parameters[model->anchored[k]].name;
    return (struct record_equilibrium){.work = &live->work,
                                       .options = &live->statics,
                                       .result = &live->equilibrium,
                                       .held = live->held,
                                       .hold_force = live->hold_force,
                                       .q = live->q,
                                       .qd = live->qd,
                                       .starts = starts};
}

/* Moves the start to the equilibrium, as --from statics. Returns a status of the runtime. */
static int find_equilibrium(struct live *live) {
    const struct refdyn_model *model = live->work.model;
    const size_t n = (size_t)model->n, size = refdyn_statics_size(model);
    live->statics = refdyn_statics_default();
    live->statics.rows = list_rows(live, &live->statics.row_count);
    live->held = live_get_block(live, n * sizeof *live->held);
    live->hold_force = live_get_block(live, n * sizeof *live->hold_force);
    for (int i = 0; i < model->held_count; i++)
        live->held[model->held[i]] = 1;
    refdyn_enter_statics(model, live->q, live->qd);
    const int status = refdyn_statics(&live->work, &live->statics, model->held, model->held_count, live->q,
                                      live->hold_force, &live->equilibrium, live_get_block(live, size), size);
    refdyn_leave_statics(model, live->q, live->qd);
    return status;
}

/* Prepares the values of the page, and sets the start to the initial state. Returns a status of the runtime.
 */
static int set_initial(struct live *live) {
    refdyn_prepare(&live->work);
    const int checked = refdyn_check_parameters(&live->work);
    if (checked == REFDYN_OK)
        refdyn_initial_state(&live->work, live->q, live->qd);
    return checked;
}

static int move_to_equilibrium(struct live *live) {
    refdyn_anchor(&live->work, 0, live->q, live->qd, live->given);
    live->has_equilibrium = true;
    const int status = find_equilibrium(live);
    refdyn_anchor(&live->work, 0, live->q, live->qd, live->given);
    return status;
}

static int set_start(struct live *live, bool from_statics) {
    const int status = set_initial(live);
    if (status != REFDYN_OK || from_statics)
        return status == REFDYN_OK ? move_to_equilibrium(live) : status;
    for (int i = 0; i < 2 * live->work.n; i++)
        if (live->start_given[i])
            live->q[i] = live->start[i];
    refdyn_anchor(&live->work, 0, live->q, live->qd, live->given);
    return REFDYN_OK;
}

int live_set_equilibrium(struct live *live) {
    end_motion(live);
    live->pull.point = -1;
    live_start_pull(live);
    return set_start(live, true);
}

static int start(struct live *live, const struct refdyn_options *options, double until, double every) {
    const size_t size = refdyn_integrator_size(live->work.model, options);
    void *memory = live_get_block(live, size);
    live->record = (struct record_motion){.work = &live->work,
                                          .integrator = &live->integrator,
                                          .until = until,
                                          .every = every,
                                          .samples = live->pull.point >= 0 ? &live->samples : NULL,
                                          .q = live->q,
                                          .qd = live->qd};
    const int status = refdyn_integrator_init(&live->integrator, &live->work, options, memory, size);
    return status == REFDYN_OK ? record_start(&live->record, memory_of(live)) : status;
}

/* What is written to the stream replaces the text, once the stream is closed. */
static FILE *open_text(struct live *live, char **text) {
    free(*text);
    *text = NULL;
    FILE *out = open_memstream(text, &live->text_size);
    if (!out)
        abort();
    return out;
}

/* Writes why the motion has failed, or its warnings, into live->message. */
static void explain(struct live *live, int status, bool is_started) {
    char refused[REFUSED_LENGTH] = "";
    FILE *out = open_text(live, &live->message);
    if (status == REFDYN_REFUSED)
        refused_text(live, refused, sizeof refused);
    if (live->has_equilibrium) {
        const struct record_equilibrium equilibrium = equilibrium_of(live);
        record_print_equilibrium(&equilibrium, out);
    }
    if (status != REFDYN_OK)
        record_print_failure(&live->record, status, is_started, live->unfit, refused, out);
    else {
        fputs(live->start_message, out);
        record_print_rows_warning(&live->integrator, out);
        record_print_balance_warning(&live->record, out);
    }
    fclose(out);
}

/* Keeps the warnings of a start, before steps change the residuals that they state. */
static void note_start(struct live *live) {
    FILE *out = open_text(live, &live->start_message);
    record_print_start(&live->record, false, out);
    fclose(out);
}

void live_explain_start(struct live *live, int status) {
    char refused[REFUSED_LENGTH];
    FILE *out = open_text(live, &live->message);
    if (status == REFDYN_REFUSED) {
        refused_text(live, refused, sizeof refused);
        fprintf(out, "%s\n", refused);
    } else {
        const struct record_equilibrium equilibrium = equilibrium_of(live);
        record_print_no_equilibrium(&equilibrium, status, out);
    }
    fclose(out);
}

static int begin(struct live *live, const struct refdyn_options *options, double until, double every,
                 bool from_statics) {
    end_motion(live);
    live->row_count = 0;
    live->output = 1;
    live->unfit = NULL;
    live->record = (struct record_motion){.work = &live->work, .integrator = &live->integrator};
    refdyn_partition_reset(&live->work);
    live->has_equilibrium = false;
    int status = set_start(live, from_statics);
    if (status != REFDYN_OK) {
        live_explain_start(live, status);
        return LIVE_FAILED;
    }
    live_start_pull(live);
    status = start(live, options, until, every);
    if (status == REFDYN_OK) {
        note_start(live);
        record_table_start(&live->table, memory_of(live), &live->integrator, live_model.spatial);
        live_draw(live);
        status = add_row(live);
    }
    if (status != REFDYN_OK)
        explain(live, status, live->unfit != NULL);
    return status == REFDYN_OK ? LIVE_GOES_ON : LIVE_FAILED;
}

/* Begins a motion from t = 0 with the values in the arrays, from the initial state with the given start
 * values or from the equilibrium. Returns LIVE_GOES_ON or LIVE_FAILED. */
EXPORT(live_begin)
int live_begin(struct live *live, double until, double every, double step, double tol, double tol_rates,
               int from_statics) {
    const struct refdyn_options options = options_of(step, tol, tol_rates);
    return begin(live, &options, until, every, from_statics);
}

/* Begins to repeat the last motion that was done more accurately, with the same values in the arrays.
 * has_kinds: it bounds the errors of rates, accelerations and forces, too. */
EXPORT(live_begin_finer)
int live_begin_finer(struct live *live, double until, double every, int from_statics, int has_kinds) {
    struct refdyn_options options = live->finer;
    if (has_kinds)
        options.tol_rates = record_finer_rates(&options);
    return begin(live, &options, until, every, from_statics);
}

static int pause_motion(void *context, const struct record_motion *motion) {
    (void)context;
    (void)motion;
    return RECORD_PAUSED;
}

static int finish(struct live *live, int status) {
    if (status == REFDYN_OK) {
        refdyn_energy_scale(&live->record.energy, &live->integrator);
        live->finer = record_finer_options(&live->integrator, &live->facts[LIVE_SHARE]);
    }
    explain(live, status, true);
    return status == REFDYN_OK ? LIVE_DONE : LIVE_FAILED;
}

/* Takes a few steps. */
EXPORT(live_advance) int live_advance(struct live *live) {
    const struct record_watch watch = {pause_motion, NULL};
    const struct record_motion *record = &live->record;
    if (live->output >= record->outputs || record_is_stopped(record))
        return finish(live, REFDYN_OK);
    const double last = live->rows[(live->row_count - 1) * live_column_count(live)];
    int status = record_to(&live->record, live->output, &watch);
    const bool is_there = live->output < record->outputs - 1
                              ? live->integrator.t >= record->from + (double)live->output * record->every
                              : live->integrator.t >= record->until;
    if (status == RECORD_PAUSED && !is_there && !record_is_stopped(record))
        return LIVE_GOES_ON;
    if (status == RECORD_PAUSED) /* the output is reached: adds it to the balance */
        status = record_to(&live->record, live->output, &watch);
    if (status == REFDYN_OK && live->integrator.t > last)
        status = add_row(live);
    live->output++;
    return status == REFDYN_OK ? LIVE_GOES_ON : finish(live, status);
}

/* ---- Results ---- */

EXPORT(live_rows) const double *live_rows(struct live *live) {
    return live->rows;
}

EXPORT(live_row_count) long live_row_count(struct live *live) {
    return live->row_count;
}

EXPORT(live_applied) const double *live_applied(struct live *live) {
    return live->applied;
}

/* Steps, rejected steps, largest error of the energy balance, time reached; 1 if an event has ended it; the
 * error of a finer motion divided by that of this one. */
EXPORT(live_facts) const double *live_facts(struct live *live) {
    const struct refdyn_statistics *statistics = &live->integrator.statistics;
    live->facts[0] = (double)statistics->steps;
    live->facts[1] = (double)statistics->rejected;
    live->facts[2] = live->record.energy.largest_error;
    live->facts[3] = live->integrator.t;
    live->facts[4] = live->record.events.has_ended;
    return live->facts;
}
