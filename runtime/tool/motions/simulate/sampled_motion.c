/* One motion of a scene: its options, its start, and its steps from output to output. */
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

static int gsl_step(void *gsl, double t_out, long steps) {
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

static int gsl_step(void *gsl, double t_out, long steps) {
    (void)gsl;
    (void)t_out;
    (void)steps;
    return REFDYN_BAD_OPTION;
}

static void gsl_close(struct refdyn_gsl *gsl) {
    (void)gsl;
}

#endif

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
    {"tol-rates", "TOL", OPTION_POSITIVE,
     "adaptive steps: local error tolerance of rates, accelerations and forces as well, relative to the "
     "largest of each kind so far (default: their errors do not count)",
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
    if (options_number(options, "tol-rates") > 0)
        return options_error(options, "tol-rates", ": %s has one tolerance; use --tol", method);
    *integration = refdyn_options_default(REFDYN_RODAS5P);
    integration->stabilise = gsl_stabilise(method);
    if (tol > 0)
        integration->tol = tol;
    return STATUS_DONE;
}

enum status simulate_check_tol_rates(const struct options *options, bool is_fixed) {
    const double tol_rates = options_number(options, "tol-rates");
    if (tol_rates > 0 && is_fixed)
        return options_error(options, "tol-rates",
                             ": fixed steps have no tolerance; omit --step, or name a "
                             "method with adaptive steps");
    if (tol_rates >= 1)
        return options_error(options, "tol-rates", ": must be below 1, because it is relative");
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
    if (method == REFDYN_AUTO && step > 0)
        return options_error(options, "step", ": %s chooses its steps; use --tol", name);
    *integration = refdyn_options_default((enum refdyn_method)method);
    if ((tol > 0 || step_max > 0) && integration->tol == 0)
        return options_error(options, tol > 0 ? "tol" : "step-max", ": %s has fixed steps; use --step",
                             refdyn_method_name(method));
    integration->step_max = step_max;
    integration->tol_rates = options_number(options, "tol-rates");
    if (step > 0) {
        integration->step = step;
        integration->tol = 0;
    }
    if (tol > 0)
        integration->tol = tol;
    return simulate_check_tol_rates(options, integration->tol == 0);
}

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
        integration->gain_share = record_gain_share;
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
    if (status == STATUS_DONE && options_is(options, "from", "held") && !options_has(options, "realise"))
        status =
            options_error(options, "from", " held needs --realise; write ./held for a file of this name");
    if (status != STATUS_DONE)
        return status;
    integration->singular = (enum refdyn_singular)way;
    integration->project_start = start;
    integration->balance = 1;
    integration->step_limit = RECORD_STEPS_MAX;
    return validate(options, integration);
}

enum status simulate_check_lanes(const struct options *options) {
    const double lanes = options_number(options, "lanes");
    return lanes == 0 || lanes == 1 || lanes == 2 || lanes == 4 || lanes == 8
               ? STATUS_DONE
               : options_usage_error(options->command, "--lanes: %.0f is not a lane width; use 1, 2, 4 or 8",
                                     lanes);
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

enum status simulate_run_search(struct options *options,
                                enum status (*work)(struct scene *scene, const struct options *options,
                                                    const struct refdyn_options *integration, void *context),
                                void *context) {
    struct refdyn_options integration;
    struct scene scene;
    if (options_number(options, "lanes") == 0)
        options_set_number(options, "lanes", refdyn_batch_widest());
    enum status status = simulate_options(options, &integration);
    if (status == STATUS_DONE)
        status = simulate_check_lanes(options);
    if (status != STATUS_DONE)
        return status;
    if (simulate_gsl_has(options_text(options, "method")))
        return options_usage_error(options->command, "%s excludes the methods of GSL",
                                   options->command->name);
    const unsigned tangent = refdyn_method_is_implicit(integration.method) ? NEEDS_TANGENT : 0;
    status =
        scene_open(&scene, options,
                   NEEDS_RESULT | NEEDS_POINT_RATES | NEEDS_OPTIMISED | simulate_needs(options) | tangent,
                   options_state_path(options_text(options, "from")));
    if (status == STATUS_DONE)
        status = work(&scene, options, &integration, context);
    scene_close(&scene);
    return status;
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

enum status simulate_check_count(const struct options *options, const char *name, double count,
                                 const char *what, double most) {
    if (count <= most)
        return STATUS_DONE;
    return options_error(options, name, " %g: %.3g %s; must be at most %.0f", options_number(options, name),
                         count, what, most);
}

enum status simulate_check_steps(const struct options *options, double span) {
    static const char *const names[] = {"step", "step-max"};
    enum status status = STATUS_DONE;
    for (int i = 0; i < 2 && status == STATUS_DONE; i++)
        if (options_number(options, names[i]) > 0)
            status = simulate_check_count(options, names[i], span / options_number(options, names[i]),
                                          "steps", RECORD_STEPS_MAX);
    return status;
}

enum status simulate_check_times(const struct scene *scene, const struct options *options, double most) {
    const double until = options_number(options, "until"), every = options_number(options, "every");
    const double from = scene->state.t, span = until - from;
    if (!(span > 0))
        return options_error(options, "until", " %g: must be after the start of the motion at t = %g", until,
                             from);
    enum status status = STATUS_DONE;
    if (every > 0)
        status = simulate_check_count(options, "every", span / every, "outputs", most);
    return status == STATUS_DONE ? simulate_check_steps(options, span) : status;
}

/* ---- A motion ---- */

static void *allocate(void *arena, size_t size) {
    return memory_get(arena, size);
}

static struct record_memory memory_of(struct memory *arena) {
    return (struct record_memory){allocate, arena};
}

struct record_memory simulate_memory(struct motion *motion) {
    return memory_of(motion ? &motion->arena : &format_memory);
}

int simulate_start(struct motion *motion, struct scene *scene, const struct refdyn_options *integration,
                   double until, double every) {
    *motion =
        (struct motion){.scene = scene, .arena = format_arena_start(), .started = system_wall_seconds()};
    motion->method = refdyn_method_name((int)integration->method);
    const size_t size = refdyn_integrator_size(scene->model, integration);
    motion->memory = format_allocate_large(1, size);
    motion->record = (struct record_motion){.work = &scene->work,
                                            .integrator = &motion->integrator,
                                            .from = scene->state.t,
                                            .until = until,
                                            .every = every,
                                            .q = scene->q,
                                            .qd = scene->qd,
                                            .samples = scene->inputs ? &scene->inputs->samples : NULL};
    int status = refdyn_integrator_init(&motion->integrator, &scene->work, integration, motion->memory, size);
    const double begin = system_cpu_seconds();
    if (status == REFDYN_OK)
        status = record_start(&motion->record, simulate_memory(motion));
    motion->cpu_s = system_cpu_seconds() - begin;
    return status;
}

int simulate_by_gsl(struct motion *motion, const char *method) {
    motion->method = method;
    const int status = gsl_open(&motion->gsl, &motion->integrator, method);
    motion->record.step = gsl_step;
    motion->record.stepper = motion->gsl;
    return status;
}

double simulate_fraction(const struct motion *motion) {
    const struct record_motion *record = &motion->record;
    return (motion->integrator.t - record->from) / (record->until - record->from);
}

/* Returns whether the motion exceeds its CPU limit, or will: after a tenth of it, even twice the speed would
 * be too slow. */
static bool is_too_slow(const struct motion *motion, double cpu_s) {
    const double limit = motion->cpu_limit;
    return limit > 0 && motion->integrator.t < motion->record.until &&
           (cpu_s > limit || (cpu_s > limit / 10 && cpu_s > 2 * limit * simulate_fraction(motion)));
}

/* Continues with the optimised functions as soon as they have been compiled. They compute the same bits. */
static void change_over(struct motion *motion) {
    const struct refdyn_model *model = compile_follow(&motion->scene->compiled);
    if (model && refdyn_integrator_exchange_model(&motion->integrator, model) == REFDYN_OK)
        motion->scene->model = model;
}

/* Between portions of steps: shows progress, changes over, and asks whether the motion may continue. */
static int watch(void *context, const struct record_motion *record) {
    struct motion *motion = context;
    (void)record;
    if (motion->progress)
        system_progress_show(motion->progress, simulate_fraction(motion));
    change_over(motion);
    if (system_interrupted)
        return RECORD_INTERRUPTED;
    return is_too_slow(motion, motion->cpu_s + system_cpu_seconds() - motion->began) ? RECORD_TOO_SLOW
                                                                                     : REFDYN_OK;
}

/* Before and after a portion of the motion. */
static void begin_portion(struct motion *motion, struct progress *progress) {
    motion->progress = progress;
    motion->began = system_cpu_seconds();
}

static int end_portion(struct motion *motion, int status) {
    motion->cpu_s += system_cpu_seconds() - motion->began;
    motion->wall_s = system_wall_seconds() - motion->started;
    return status == REFDYN_OK && system_interrupted ? RECORD_INTERRUPTED : status;
}

int simulate_advance(struct motion *motion, double t, struct progress *progress) {
    const struct record_watch own = {watch, motion};
    begin_portion(motion, progress);
    return end_portion(motion, record_advance(&motion->record, t, &own));
}

int simulate_to(struct motion *motion, long i, struct progress *progress) {
    const struct record_watch own = {watch, motion};
    begin_portion(motion, progress);
    return end_portion(motion, record_to(&motion->record, i, &own));
}

void simulate_release(struct motion *motion) {
    gsl_close(motion->gsl);
    record_restore(&motion->record);
    memory_release(&motion->arena);
    free(motion->memory);
    *motion = (struct motion){.memory = NULL};
}

/* ---- Columns ---- */

void simulate_table_start(struct record_table *table, struct refdyn_integrator *integrator,
                          const struct refdyn_spatial *spatial) {
    record_table_start(table, memory_of(&format_memory), integrator, spatial);
}

void simulate_limits_start(struct record_limits *limits, struct record_memory memory,
                           const struct scene *scene, struct refdyn_integrator *integrator) {
    const struct model *model = &scene->generation.model;
    struct record_bound *bounds =
        memory.get(memory.context, ((size_t)model->bound_count + 1) * sizeof *bounds);
    for (int i = 0; i < model->bound_count; i++)
        bounds[i] = (struct record_bound){model->bounds[i].name, model->bounds[i].column,
                                          model->bounds[i].from, model->bounds[i].to};
    record_limits_start(limits, memory, integrator, scene->compiled.spatial, bounds, model->bound_count);
}

void simulate_table_header(const struct record_table *table, FILE *out) {
    for (int i = 0; i < table->count; i++)
        fprintf(out, "%s%s", i ? "," : "", table->names[i]);
    fputc('\n', out);
}

void simulate_table_row(const struct record_table *table, FILE *out) {
    for (int i = 0; i < table->count; i++) {
        if (i)
            fputc(',', out);
        format_number(out, table->values[i]);
    }
    fputc('\n', out);
}

/* ---- Conditions that end a motion ---- */

static enum status wrong_column(const struct record_table *table, const struct options *options,
                                const char *name) {
    const char *near = message_nearest_name(name, table->names, table->count);
    return options_usage_error(options->command, "--stop: the CSV has no column '%s'%s%s", name,
                               near ? "; the nearest is " : "", near ? near : "");
}

enum status simulate_stops_read(struct record_stops *stops, const struct options *options,
                                struct refdyn_integrator *integrator, const struct refdyn_spatial *spatial) {
    const char *text;
    record_stops_start(stops, memory_of(&format_memory), options->value_count, integrator, spatial);
    for (int i = 0; (text = options_repeated(options, "stop", i)); i++) {
        const enum record_stop_fault fault = record_stops_add(stops, text);
        if (fault == RECORD_STOP_NO_CONDITION)
            return options_usage_error(options->command,
                                       "--stop: '%s' is not of the form NAME<VALUE or NAME>VALUE", text);
        if (fault == RECORD_STOP_NO_COLUMN)
            return wrong_column(&stops->table, options, format_text("%.*s", (int)strcspn(text, "<>"), text));
    }
    return STATUS_DONE;
}
