/* One motion of a scene: its options, its start, the conditions that end it, and its steps from output to
 * output. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gen/base/base.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/system/system.h"
#ifdef REFDYN_HAS_GSL
#include "refdyn_gsl.h"
#include <gsl/gsl_errno.h>
#endif

/* ---- Methods of GSL ---- */

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

/* The stabilisation of such a method by default. */
static enum refdyn_stabilise gsl_stabilise(const char *method) {
    return methods[find(method)].stabilise;
}

/* In a program built without GSL, gsl_open reports REFDYN_BAD_OPTION. Returns a status of the runtime; call
 * gsl_close in any case. */
#ifdef REFDYN_HAS_GSL

static int gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method) {
    gsl_set_error_handler_off();
    *gsl = format_allocate(1, sizeof **gsl);
    return refdyn_gsl_init(*gsl, integrator, (enum refdyn_gsl_method)refdyn_gsl_method_find(method));
}

static int gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    return refdyn_gsl_step(gsl, t_out, steps);
}

static void gsl_close(struct refdyn_gsl *gsl) {
    if (gsl)
        refdyn_gsl_release(gsl);
}

#else

static int gsl_open(struct refdyn_gsl **gsl, struct refdyn_integrator *integrator, const char *method) {
    (void)integrator;
    (void)method;
    *gsl = NULL;
    return REFDYN_BAD_OPTION;
}

static int gsl_step(struct refdyn_gsl *gsl, double t_out, long steps) {
    (void)gsl;
    (void)t_out;
    (void)steps;
    return REFDYN_BAD_OPTION;
}

static void gsl_close(struct refdyn_gsl *gsl) {
    (void)gsl;
}

#endif

/* A multiple of --every that is this near to the end is the end, as a part of --every. */
static const double end_slack = 1e-9;

/* alpha h = beta h of --stabilise baumgarte-auto. With larger gains the stages of a step disturb each other.
 */
static const double automatic_share = 0.05;

static const double steps_max = 1e10; /* some hours with the smallest model */

enum {
    DEFAULT_OUTPUTS = 200,
    OUTPUTS_MAX = 10000000,
    STEPS_PER_LOOK = 64 /* between checks for signals and of the clock */
};

/* ---- Options ---- */

const char *simulate_methods(bool is_explicit) {
    struct text text = {.memory = &format_memory};
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        if (!is_explicit || !refdyn_method_is_implicit((enum refdyn_method)method))
            text_add(&text, "%s%s", text.length ? ", " : "", refdyn_method_name(method));
    return text.data;
}

static const char *list_methods(const struct command *command) {
    return format_text("%s%s", simulate_methods(false),
                       command->has_gsl && HAS_METHODS_OF_GSL ? ", msbdf, bsimp" : "");
}

static const char *const stabilise_words[] = {"none", "baumgarte", "baumgarte-auto", "project", NULL};
static const char *const start_words[] = {"as-is", "project", NULL};
static const char *const singular_words[] = {[REFDYN_STOP] = "stop", [REFDYN_PASS] = "pass", NULL};
const struct option_rule simulate_rules[] = {
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

/* GSL's methods use the memory of an implicit method. */
static enum status choose_gsl(const struct options *options, struct refdyn_options *integration) {
    const char *method = options_text(options, "method");
    const double tol = options_number(options, "tol");
    if (!HAS_METHODS_OF_GSL)
        return options_error(options, "method", ": '%s' needs GSL; build refdyn with it", method);
    if (options_number(options, "step") > 0)
        return options_error(options, "step", ": %s chooses its steps; use --tol", method);
    *integration = refdyn_options_default(REFDYN_RODAS5P);
    integration->stabilise = gsl_stabilise(method);
    if (tol > 0)
        integration->tol = tol;
    return STATUS_DONE;
}

static enum status choose_method(const struct options *options, struct refdyn_options *integration) {
    const double step = options_number(options, "step"), tol = options_number(options, "tol"),
                 step_max = options_number(options, "step-max");
    const char *name = options_text(options, "method");
    int method = step > 0 ? REFDYN_RK4 : REFDYN_AUTO;
    if (simulate_gsl_has(name))
        return choose_gsl(options, integration);
    if (name)
        method = refdyn_method_find(name);
    if (method < 0)
        return options_error(options, "method", ": '%s' is not one of %s", name, simulate_methods(false));
    if (tol > 0 && step > 0)
        return options_usage_error(options->command,
                                   "--step sets fixed steps and --tol adaptive ones; omit one of them");
    if (step_max > 0 && step > 0)
        return options_usage_error(
            options->command,
            "--step sets fixed steps and --step-max bounds adaptive ones; omit one of them");
    *integration = refdyn_options_default((enum refdyn_method)method);
    if ((tol > 0 || step_max > 0) && integration->tol == 0)
        return options_error(options, tol > 0 ? "tol" : "step-max", ": %s has fixed steps; use --step",
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

const char *const simulate_stabilise_names[STABILISE_COUNT] = {
    [REFDYN_NONE] = "none", [REFDYN_BAUMGARTE] = "baumgarte", [REFDYN_PROJECT] = "project"};

/* baumgarte-auto is baumgarte with gains computed from the step. */
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
    if (integration->stabilise == REFDYN_PROJECT && simulate_gsl_has(method) &&
        gsl_stabilise(method) != REFDYN_PROJECT)
        return options_error(options, "stabilise",
                             ": project would make %s start again after each step; use baumgarte or none",
                             method);
    return STATUS_DONE;
}

/* A fact begins with the name of what is wrong. */
static enum status validate(const struct options *options, const struct refdyn_options *integration) {
    const char *fact;
    if (refdyn_options_validate(integration, &fact) == REFDYN_OK)
        return STATUS_DONE;
    const int length = (int)strcspn(fact, " ");
    return options_error(options, format_text("%.*s", length, fact), "%s", fact + length);
}

enum status simulate_options(const struct options *options, struct refdyn_options *integration) {
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

enum status simulate_fit(const struct scene *scene, const struct options *options,
                         const struct refdyn_options *integration) {
    const char *method = options_text(options, "method");
    if (simulate_gsl_has(method) && scene->model->event_count > 0) {
        fprintf(stderr, "refdyn: %s: --method %s does not detect state events; use one of %s\n",
                scene->model->name, method, simulate_methods(false));
        return STATUS_FAULT;
    }
    if (refdyn_can_run(scene->model, integration->method))
        return STATUS_DONE;
    fprintf(stderr,
            "refdyn: %s: --method %s needs the exact tangent, which the printed form lacks; use one of %s\n",
            scene->model->name, method, simulate_methods(true));
    return STATUS_FAULT;
}

/* ---- The start, and the times of outputs ---- */

static bool is_from_statics(const struct options *options) {
    return options_is(options, "from", "statics");
}

unsigned simulate_needs(const struct options *options) {
    return NEEDS_MOTION | NEEDS_POINTS | (is_from_statics(options) ? NEEDS_STATICS : 0);
}

enum status simulate_place(struct scene *scene, const struct options *options) {
    enum status status = STATUS_DONE;
    if (is_from_statics(options)) {
        struct equilibrium *equilibrium = format_allocate(1, sizeof *equilibrium);
        status = equilibria_find(scene, options, equilibrium);
        scene->equilibrium = &equilibrium->result;
    } else if (options_text(options, "hold"))
        return options_error(options, "hold", " needs --from statics");
    else
        status = equilibria_refuse_options(options, "--from statics");
    refdyn_anchor(&scene->work, scene->state.t, scene->q, scene->qd, scene->given);
    return status;
}

enum status simulate_check_times(const struct scene *scene, const struct options *options) {
    const double until = options_number(options, "until"), every = options_number(options, "every"),
                 step = options_number(options, "step");
    const double from = scene->state.t, span = until - from;
    if (span <= 0)
        return options_error(options, "until", " %g: must be after the start of the motion at t = %g", until,
                             from);
    if (every > 0 && span / every > OUTPUTS_MAX)
        return options_error(options, "every", " %g: %.3g outputs; must be at most %d", every, span / every,
                             OUTPUTS_MAX);
    if (step > 0 && span / step > steps_max)
        return options_error(options, "step", " %g: %.3g steps; must be at most %.3g", step, span / step,
                             steps_max);
    return STATUS_DONE;
}

double simulate_distance(double span, double every) {
    return every > 0 ? every : span / DEFAULT_OUTPUTS;
}

long simulate_count_outputs(double span, double every) {
    return (long)ceil(span / every - end_slack) + 1;
}

/* ---- Conditions that end a motion ---- */

struct stop {
    const char *text; /* as given */
    int column;
    bool is_below; /* '<' */
    double value;
};

static enum status wrong_column(const struct stops *stops, const struct options *options, const char *name) {
    const char *near = message_nearest_name(name, stops->table.names, stops->table.count);
    return options_usage_error(options->command, "--stop: the CSV has no column '%s'%s%s", name,
                               near ? "; the nearest is " : "", near ? near : "");
}

static enum status read_stop(struct stops *stops, const struct options *options, const char *text) {
    const size_t length = strcspn(text, "<>");
    const char *number = text + length + (text[length] != '\0');
    struct stop stop = {.text = text, .is_below = text[length] == '<'};
    if (length == 0 || !text_to_number(number, &stop.value))
        return options_usage_error(options->command,
                                   "--stop: '%s' is not of the form NAME<VALUE or NAME>VALUE", text);
    const char *name = format_text("%.*s", (int)length, text);
    stop.column = text_index(name, stops->table.names, stops->table.count);
    stops->list[stops->count++] = stop;
    return stop.column < 0 ? wrong_column(stops, options, name) : STATUS_DONE;
}

enum status simulate_stops_read(struct stops *stops, const struct options *options,
                                struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial) {
    enum status status = STATUS_DONE;
    *stops = (struct stops){.integrator = integrator};
    stops->list = format_allocate((size_t)options->value_count, sizeof *stops->list);
    simulate_table_start(&stops->table, integrator, spatial);
    const char *text;
    for (int i = 0; status == STATUS_DONE && (text = options_repeated(options, "stop", i)); i++)
        status = read_stop(stops, options, text);
    return status;
}

bool simulate_stops_hold(struct stops *stops) {
    simulate_table_fill(&stops->table);
    for (int i = 0; i < stops->count; i++) {
        const struct stop *stop = &stops->list[i];
        const double value = stops->table.values[stop->column];
        if (stop->is_below ? value < stop->value : value > stop->value) {
            stops->reached = stop->text;
            stops->t = stops->integrator->t;
            return true;
        }
    }
    return false;
}

/* If a condition holds now, moves the integrator back to the first time at which one does. No condition held
 * at t_before, which is within the last step or at its beginning. Returns a status of the runtime. Bisects
 * down to neighbouring times, also across a jump, where the later side counts. */
static int stops_meet(struct stops *stops, double t_before) {
    double before = t_before, after = stops->integrator->t;
    if (!simulate_stops_hold(stops))
        return REFDYN_OK;
    while (after - before > DBL_EPSILON * fmax(fabs(before), fabs(after))) {
        const double middle = before + (after - before) / 2;
        if (!(middle > before && middle < after))
            break;
        const int status = refdyn_integrator_look(stops->integrator, middle);
        if (status != REFDYN_OK)
            return status;
        *(simulate_stops_hold(stops) ? &after : &before) = middle;
    }
    const int status = refdyn_integrator_look(stops->integrator, after);
    if (status == REFDYN_OK)
        simulate_stops_hold(stops);
    return status;
}

/* ---- A motion ---- */

/* The time of the next sample of inputs, INFINITY if there is none. */
static double next_sample(const struct motion *motion) {
    return motion->scene->inputs ? motion->scene->inputs->next : INFINITY;
}

/* The number of parameters, derived ones included, and inputs; *parameters without inputs. */
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
    motion->values = format_allocate_large(count, sizeof *motion->values);
    memcpy(motion->values, work->p, parameters * sizeof *work->p);
    memcpy(motion->values + parameters, work->x, (count - parameters) * sizeof *work->x);
}

void simulate_restore(const struct motion *motion) {
    if (!motion->values) /* no event sets a value */
        return;
    struct refdyn_workspace *work = &motion->scene->work;
    size_t parameters;
    const size_t count = count_values(work->model, &parameters);
    memcpy(work->p, motion->values, parameters * sizeof *work->p);
    memcpy(work->x, motion->values + parameters, (count - parameters) * sizeof *work->x);
}

int simulate_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                   double until, double every) {
    double span = until - scene->state.t;
    *motion = (struct motion){
        .scene = scene, .from = scene->state.t, .until = until, .started = system_wall_seconds()};
    motion->events = simulate_events_start();
    motion->method = refdyn_method_name((int)integration->method);
    motion->every = simulate_distance(span, every);
    motion->outputs = simulate_count_outputs(span, motion->every);
    size_t size = refdyn_integrator_size(scene->model, integration);
    motion->memory = format_allocate_large(1, size);
    int status = refdyn_integrator_init(&motion->integrator, &scene->work, integration, motion->memory, size);
    double begin = system_cpu_seconds();
    if (scene->inputs)
        scene_inputs_set(scene->inputs, motion->from, scene->work.x);
    if (status == REFDYN_OK)
        keep_values(motion);
    if (status == REFDYN_OK)
        status = refdyn_integrator_start(&motion->integrator, motion->from, scene->q, scene->qd);
    refdyn_integrator_until(&motion->integrator, until);
    refdyn_integrator_limit(&motion->integrator, next_sample(motion));
    motion->cpu_s = system_cpu_seconds() - begin;
    return status == REFDYN_OK ? refdyn_energy_start(&motion->energy, &motion->integrator) : status;
}

int simulate_by_gsl(struct motion *motion, const char *method) {
    motion->method = method;
    return gsl_open(&motion->gsl, &motion->integrator, method);
}

/* Time of output number i, 0 to outputs - 1: a multiple of `every`, or the end. */
static double motion_time(const struct motion *motion, long i) {
    return i >= motion->outputs - 1 ? motion->until : motion->from + (double)i * motion->every;
}

double simulate_fraction(const struct motion *motion) {
    return (motion->integrator.t - motion->from) / (motion->until - motion->from);
}

/* Returns whether the motion exceeds its CPU limit, or will: after a tenth of it, even twice the speed would
 * be too slow. */
static bool is_too_slow(const struct motion *motion, double cpu_s) {
    const double limit = motion->cpu_limit;
    return limit > 0 && motion->integrator.t < motion->until &&
           (cpu_s > limit || (cpu_s > limit / 10 && cpu_s > 2 * limit * simulate_fraction(motion)));
}

bool simulate_is_stopped(const struct motion *motion) {
    return simulate_events_have_ended(motion->events) || (motion->stops && motion->stops->reached);
}

/* Sets the inputs of the sample at the integrator's time and evaluates the state again. */
static int take_sample(struct motion *motion) {
    struct refdyn_integrator *integrator = &motion->integrator;
    scene_inputs_set(motion->scene->inputs, integrator->t, integrator->work->x);
    refdyn_integrator_limit(integrator, next_sample(motion));
    const int status = refdyn_integrator_refresh(integrator);
    if (status == REFDYN_OK && motion->stops)
        simulate_stops_hold(motion->stops);
    return status;
}

static int take_events(struct motion *motion, int status) {
    return simulate_events_take(motion->events, &motion->integrator, status);
}

/* After steps from `before`: looks for a stop that was reached on the way, and otherwise records the events
 * at which they have stopped. */
static int look_back(struct motion *motion, double before, int status) {
    const struct refdyn_integrator *integrator = &motion->integrator;
    const double t = integrator->t;
    int stopped = REFDYN_OK;
    if (motion->stops && (status == REFDYN_OK || status == REFDYN_EVENT_ENDS))
        stopped = stops_meet(motion->stops, before);
    return stopped != REFDYN_OK || integrator->t < t ? stopped : take_events(motion, status);
}

/* Continues with the optimised functions as soon as they have been compiled. They compute the same bits. */
static void change_over(struct motion *motion) {
    const struct refdyn_model *model = compile_follow(&motion->scene->compiled);
    if (model && refdyn_integrator_exchange_model(&motion->integrator, model) == REFDYN_OK)
        motion->scene->model = model;
}

/* Takes some steps towards `goal`; with stops, only to the end of the next step. */
static int go_on(struct motion *motion, double goal) {
    struct refdyn_integrator *integrator = &motion->integrator;
    const double before = integrator->t, sample = next_sample(motion);
    double bound = fmin(goal, sample);
    if (motion->stops && before < integrator->t_end)
        bound = fmin(bound, integrator->t_end);
    const long steps = motion->stops ? 1 : STEPS_PER_LOOK;
    change_over(motion);
    int status =
        motion->gsl ? gsl_step(motion->gsl, bound, steps) : refdyn_integrator_step(integrator, bound, steps);
    status = look_back(motion, before, status);
    if (status == REFDYN_OK && integrator->t == sample && !simulate_is_stopped(motion))
        status = take_sample(motion);
    return status;
}

int simulate_to(struct motion *motion, long i, struct progress *progress) {
    double goal = motion_time(motion, i), begin = system_cpu_seconds();
    int status = REFDYN_OK;
    while (status == REFDYN_OK && motion->integrator.t < goal && !simulate_is_stopped(motion)) {
        status = go_on(motion, goal);
        if (progress)
            system_progress_show(progress, simulate_fraction(motion));
        if (system_interrupted && status == REFDYN_OK)
            status = MOTION_INTERRUPTED;
        if (status == REFDYN_OK && is_too_slow(motion, motion->cpu_s + system_cpu_seconds() - begin))
            status = MOTION_TOO_SLOW;
    }
    motion->cpu_s += system_cpu_seconds() - begin;
    motion->wall_s = system_wall_seconds() - motion->started;
    if (status == REFDYN_OK)
        status = refdyn_energy_add(&motion->energy, &motion->integrator);
    return status == REFDYN_OK && system_interrupted ? MOTION_INTERRUPTED : status;
}

void simulate_release(struct motion *motion) {
    gsl_close(motion->gsl);
    simulate_restore(motion);
    free(motion->values);
    motion->values = NULL;
    simulate_events_release(motion->events);
    motion->events = NULL;
    free(motion->memory);
    motion->gsl = NULL;
    motion->memory = NULL;
}
