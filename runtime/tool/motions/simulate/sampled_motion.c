/* One motion: see motion.h. */
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A multiple of --every this near to the end (as a part of --every) is the end. */
static const double end_slack = 1e-9;

/* alpha h = beta h of --stabilise baumgarte-auto: larger ones let the stages of a step disturb each other. */
static const double automatic_share = 0.05;

static const double steps_max = 1e10; /* some hours of the smallest model */

enum {
    DEFAULT_OUTPUTS = 200,
    OUTPUTS_MAX = 10000000,
    STEPS_PER_LOOK = 64 /* between looks at signals and the clock */
};

/* ---- Options ---- */

const char *motion_methods(bool is_explicit) {
    struct text text = {.memory = &program_memory};
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (!is_explicit || !refdyn_method_is_implicit((enum refdyn_method)method))
            text_add(&text, "%s%s", text.length ? ", " : "", refdyn_method_name(method));
    return text.data;
}

static const char *list_methods(const struct command *command) {
    return text_format("%s%s", motion_methods(false),
                       command->has_gsl && HAS_METHODS_OF_GSL ? ", msbdf, bsimp" : "");
}

static const char *const stabilise_words[] = {"none", "baumgarte", "baumgarte-auto", "project", NULL};
static const char *const start_words[] = {"as-is", "project", NULL};
static const char *const singular_words[] = {[REFDYN_STOP] = "stop", [REFDYN_PASS] = "pass", NULL};
const struct option_rule motion_rules[] = {
    {"until", "T", OPTION_POSITIVE, "end of the motion [s]", NULL, NULL},
    {"method", "NAME", OPTION_TEXT, "%s (default: rk4 with --step, auto without)", NULL, list_methods},
    {"step", "H", OPTION_POSITIVE, "fixed steps of this size [s]", NULL, NULL},
    {"tol", "TOL", OPTION_POSITIVE,
     "adaptive steps: local error tolerance, relative to 1 rad and the model's length, or 1 m if it "
     "states none (default 1e-6)",
     NULL, NULL},
    {"step-max", "H", OPTION_POSITIVE, "largest adaptive step [s] (default: no bound)", NULL, NULL},
    {"every", "DT", OPTION_POSITIVE, "time between outputs [s] (default T/200)", NULL, NULL},
    {"from", "WHERE", OPTION_TEXT, "initial (default), statics, or a STATE.json", options_places, NULL},
    {"stabilise", "HOW", OPTION_TEXT,
     "none, baumgarte (default with rk4), baumgarte-auto (gains from the step) or project (default "
     "with the "
     "others)",
     stabilise_words, NULL},
    {"singular", "HOW", OPTION_TEXT,
     "where the constraint rows lose rank: stop (default), or pass if a branch can be followed",
     singular_words, NULL},
    {"start", "HOW", OPTION_TEXT, "as-is (default), or project: first moves the start onto the programme",
     start_words, NULL},
    {.name = NULL}};

/* GSL's methods work in the room of an implicit method. */
static enum status choose_gsl(const struct options *options, struct refdyn_options *integration) {
    const char *method = options_text(options, "method");
    const double tol = options_number(options, "tol");
    if (!HAS_METHODS_OF_GSL)
        return option_error(options, "method", ": '%s' needs a refdyn that is built with GSL", method);
    if (options_number(options, "step") > 0)
        return option_error(options, "step", ": %s finds its steps, it takes --tol", method);
    *integration = refdyn_options_default(REFDYN_RODAS5P);
    integration->stabilise = by_gsl_stabilise(method);
    if (tol > 0)
        integration->tol = tol;
    return STATUS_DONE;
}

static enum status choose_method(const struct options *options, struct refdyn_options *integration) {
    const double step = options_number(options, "step"), tol = options_number(options, "tol"),
                 step_max = options_number(options, "step-max");
    const char *name = options_text(options, "method");
    int method = step > 0 ? REFDYN_RK4 : REFDYN_AUTO;
    if (by_gsl_has(name))
        return choose_gsl(options, integration);
    if (name)
        method = refdyn_method_find(name);
    if (method < 0)
        return option_error(options, "method", ": '%s' is none of %s", name, motion_methods(false));
    if (tol > 0 && step > 0)
        return usage_error(options->command, "--step is for fixed steps, --tol for steps that are found");
    if (step_max > 0 && step > 0)
        return usage_error(options->command,
                           "--step is for fixed steps, --step-max for steps that are found");
    *integration = refdyn_options_default((enum refdyn_method)method);
    if ((tol > 0 || step_max > 0) && integration->tol == 0)
        return option_error(options, tol > 0 ? "tol" : "step-max", ": %s has fixed steps, it takes --step",
                            refdyn_method_name(method));
    integration->step_max = step_max;
    if (step > 0) {
        integration->step = step;
        integration->tol = 0;
    }
    if (tol > 0)
        integration->tol = tol;
    return STATUS_DONE;
}

const char *const stabilise_names[STABILISE_COUNT] = {
    [REFDYN_NONE] = "none", [REFDYN_BAUMGARTE] = "baumgarte", [REFDYN_PROJECT] = "project"};

/* --stabilise; baumgarte-auto is baumgarte with gains from the step. */
static enum status choose_stabilisation(const struct options *options, struct refdyn_options *integration) {
    const char *method = options_text(options, "method");
    static const enum refdyn_stabilise stabilise[] = {REFDYN_NONE, REFDYN_BAUMGARTE, REFDYN_BAUMGARTE,
                                                      REFDYN_PROJECT};
    int place;
    const enum status status = options_choose(options, "stabilise", &place);
    if (status != STATUS_DONE || !options_has(options, "stabilise"))
        return status;
    integration->stabilise = stabilise[place];
    if (options_is(options, "stabilise", "baumgarte-auto"))
        integration->gain_share = automatic_share;
    if (integration->stabilise == REFDYN_PROJECT && by_gsl_has(method) &&
        by_gsl_stabilise(method) != REFDYN_PROJECT)
        return option_error(options, "stabilise", ": a projection would make %s start again after each step",
                            method);
    return STATUS_DONE;
}

/* A fact begins with the name of what is wrong. */
static enum status validate(const struct options *options, const struct refdyn_options *integration) {
    const char *fact;
    if (refdyn_options_validate(integration, &fact) == REFDYN_OK)
        return STATUS_DONE;
    const int length = (int)strcspn(fact, " ");
    return option_error(options, text_format("%.*s", length, fact), "%s", fact + length);
}

enum status motion_options(const struct options *options, struct refdyn_options *integration) {
    int start = 0, way = REFDYN_STOP;
    enum status status = choose_method(options, integration);
    if (status == STATUS_DONE)
        status = choose_stabilisation(options, integration);
    if (status == STATUS_DONE)
        status = options_choose(options, "start", &start);
    if (status == STATUS_DONE)
        status = options_choose(options, "singular", &way);
    if (status != STATUS_DONE)
        return status;
    integration->singular = (enum refdyn_singular)way;
    integration->project_start = start;
    integration->balance = 1;
    return validate(options, integration);
}

enum status motion_fit(const struct scene *scene, const struct options *options,
                       const struct refdyn_options *integration) {
    const char *method = options_text(options, "method");
    if (by_gsl_has(method) && scene->model->event_count > 0) {
        fprintf(stderr, "refdyn: %s: --method %s finds no events of the state, without it go %s\n",
                scene->model->name, method, motion_methods(false));
        return STATUS_FAULT;
    }
    if (refdyn_can_run(scene->model, integration->method))
        return STATUS_DONE;
    fprintf(stderr,
            "refdyn: %s: --method %s needs the exact tangent, which the printed form does not have; without "
            "it go "
            "%s\n",
            scene->model->name, method, motion_methods(true));
    return STATUS_FAULT;
}

static bool is_from_statics(const struct options *options) {
    return options_is(options, "from", "statics");
}

unsigned motion_needs(const struct options *options) {
    return NEEDS_MOTION | NEEDS_POINTS | (is_from_statics(options) ? NEEDS_STATICS : 0);
}

enum status motion_place(struct scene *scene, const struct options *options) {
    enum status status = STATUS_DONE;
    if (is_from_statics(options)) {
        struct equilibrium *equilibrium = allocate(1, sizeof *equilibrium);
        status = equilibria_find(scene, options, equilibrium);
        scene->equilibrium = &equilibrium->result;
    } else if (options_text(options, "hold"))
        return option_error(options, "hold", " goes with --from statics");
    else
        status = equilibria_refuse_options(options, "--from statics");
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
    return status;
}

enum status motion_check_times(const struct scene *scene, const struct options *options) {
    const double until = options_number(options, "until"), every = options_number(options, "every"),
                 step = options_number(options, "step");
    const double from = scene->state.t, span = until - from;
    if (span <= 0)
        return option_error(options, "until", " %g: the motion starts at t = %g", until, from);
    if (every > 0 && span / every > OUTPUTS_MAX)
        return option_error(options, "every", " %g: %.3g outputs, at most %d are taken", every, span / every,
                            OUTPUTS_MAX);
    if (step > 0 && span / step > steps_max)
        return option_error(options, "step", " %g: %.3g steps, at most %.3g are taken", step, span / step,
                            steps_max);
    return STATUS_DONE;
}

double motion_distance(double span, double every) {
    return every > 0 ? every : span / DEFAULT_OUTPUTS;
}

long motion_count_outputs(double span, double every) {
    return (long)ceil(span / every - end_slack) + 1;
}

/* When the inputs change next, INFINITY: never. */
static double next_sample(const struct motion *motion) {
    return motion->scene->inputs ? motion->scene->inputs->next : INFINITY;
}

/* Of the scene: how many parameters and inputs. */
static size_t count_values(const struct refdyn_model *model, size_t *parameters) {
    *parameters = (size_t)model->parameter_count + (size_t)model->derived_count;
    return *parameters + (size_t)model->input_count;
}

static void keep_values(struct motion *motion) {
    const struct refdyn_workspace *work = &motion->scene->work;
    size_t parameters;
    const size_t count = count_values(work->model, &parameters);
    if (work->model->change_count == 0)
        return;
    motion->values = allocate_large(count, sizeof *motion->values);
    memcpy(motion->values, work->p, parameters * sizeof *work->p);
    memcpy(motion->values + parameters, work->x, (count - parameters) * sizeof *work->x);
}

void motion_restore(const struct motion *motion) {
    if (!motion->values) /* nothing that an event sets */
        return;
    struct refdyn_workspace *work = &motion->scene->work;
    size_t parameters;
    const size_t count = count_values(work->model, &parameters);
    memcpy(work->p, motion->values, parameters * sizeof *work->p);
    memcpy(work->x, motion->values + parameters, (count - parameters) * sizeof *work->x);
}

int motion_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                 double until, double every) {
    double span = until - scene->state.t;
    *motion =
        (struct motion){.scene = scene, .from = scene->state.t, .until = until, .started = wall_seconds()};
    motion->method = refdyn_method_name((int)integration->method);
    motion->every = motion_distance(span, every);
    motion->outputs = motion_count_outputs(span, motion->every);
    size_t size = refdyn_integrator_size(scene->model, integration);
    motion->memory = allocate_large(1, size);
    int status = refdyn_integrator_init(&motion->integrator, &scene->work, integration, motion->memory, size);
    double begin = cpu_seconds();
    if (scene->inputs)
        scene_inputs_set(scene->inputs, motion->from, scene->work.x);
    if (status == REFDYN_OK)
        keep_values(motion);
    if (status == REFDYN_OK)
        status = refdyn_integrator_start(&motion->integrator, motion->from, scene->q, scene->qd);
    refdyn_integrator_until(&motion->integrator, until);
    refdyn_integrator_limit(&motion->integrator, next_sample(motion));
    motion->cpu_s = cpu_seconds() - begin;
    return status == REFDYN_OK ? refdyn_energy_start(&motion->energy, &motion->integrator) : status;
}

int motion_by_gsl(struct motion *motion, const char *method) {
    motion->method = method;
    return by_gsl_open(&motion->gsl, &motion->integrator, method);
}

/* Time of output number i, 0 to outputs - 1: a multiple of `every`, or the end. */
static double motion_time(const struct motion *motion, long i) {
    return i >= motion->outputs - 1 ? motion->until : motion->from + (double)i * motion->every;
}

double motion_fraction(const struct motion *motion) {
    return (motion->integrator.t - motion->from) / (motion->until - motion->from);
}

/* Beyond its limit, or on the way there: at a tenth of it, twice as fast would still be too slow. */
static bool is_too_slow(const struct motion *motion, double cpu_s) {
    const double limit = motion->cpu_limit;
    return limit > 0 && motion->integrator.t < motion->until &&
           (cpu_s > limit || (cpu_s > limit / 10 && cpu_s > 2 * limit * motion_fraction(motion)));
}

bool motion_is_stopped(const struct motion *motion) {
    return motion->events.has_ended || (motion->stops && motion->stops->reached);
}

/* The inputs of the sample at the integration's time, from which the state is met anew. */
static int take_sample(struct motion *motion) {
    struct refdyn_integrator *integrator = &motion->integrator;
    scene_inputs_set(motion->scene->inputs, integrator->t, integrator->work->x);
    refdyn_integrator_limit(integrator, next_sample(motion));
    const int status = refdyn_integrator_refresh(integrator);
    if (status == REFDYN_OK && motion->stops)
        stops_hold(motion->stops);
    return status;
}

/* The events at which steps have stopped, which are about to happen. */
static int take_events(struct motion *motion, int status) {
    return events_take(&motion->events, &motion->integrator, status);
}

/* Behind steps that led to the integration's time: whether one of the stops was reached since `before`, and
 * else at which events they have stopped. */
static int look_back(struct motion *motion, double before, int status) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const double t = integrator->t;
    int stopped = REFDYN_OK;
    if (motion->stops && (status == REFDYN_OK || status == REFDYN_EVENT_ENDS))
        stopped = stops_meet(motion->stops, before);
    return stopped != REFDYN_OK || integrator->t < t ? stopped : take_events(motion, status);
}

/* Some steps towards `goal`; with stops to watch, to the next end of a step and no further. */
static int go_on(struct motion *motion, double goal) {
    struct refdyn_integrator *integrator = &motion->integrator;
    const double before = integrator->t, sample = next_sample(motion);
    double bound = fmin(goal, sample);
    if (motion->stops && before < integrator->t_end)
        bound = fmin(bound, integrator->t_end);
    const long steps = motion->stops ? 1 : STEPS_PER_LOOK;
    int status = motion->gsl ? by_gsl_step(motion->gsl, bound, steps)
                             : refdyn_integrator_step(integrator, bound, steps);
    status = look_back(motion, before, status);
    if (status == REFDYN_OK && integrator->t == sample && !motion_is_stopped(motion))
        status = take_sample(motion);
    return status;
}

int motion_to(struct motion *motion, long i, struct progress *progress) {
    double goal = motion_time(motion, i), begin = cpu_seconds();
    int status = REFDYN_OK;
    while (status == REFDYN_OK && motion->integrator.t < goal && !motion_is_stopped(motion)) {
        status = go_on(motion, goal);
        if (progress)
            progress_show(progress, motion_fraction(motion));
        if (interrupted && status == REFDYN_OK)
            status = MOTION_INTERRUPTED;
        if (status == REFDYN_OK && is_too_slow(motion, motion->cpu_s + cpu_seconds() - begin))
            status = MOTION_TOO_SLOW;
    }
    motion->cpu_s += cpu_seconds() - begin;
    motion->wall_s = wall_seconds() - motion->started;
    if (status == REFDYN_OK)
        status = refdyn_energy_add(&motion->energy, &motion->integrator);
    return status == REFDYN_OK && interrupted ? MOTION_INTERRUPTED : status;
}

void motion_release(struct motion *motion) {
    by_gsl_close(motion->gsl);
    motion_restore(motion);
    free(motion->values);
    motion->values = NULL;
    events_release(&motion->events);
    free(motion->memory);
    motion->gsl = NULL;
    motion->memory = NULL;
}
