/* `refdyn plan`: finds parameters of a motion that minimise an objective within limits, and writes PLAN.json.
 */
#include <math.h>
#include <string.h>

#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/motions/plan/planning.h"
#include "runtime/tool/support/system/system.h"

/* Tolerance of the motions. Their extremes scatter by some multiple of it, which line searches mistake for
 * slopes.
 */
static const double tol_default = 1e-9;
/* Most stretches between time events whose extremes the search knows; the last one has the others. */
static const int stretches_most = 100;
/* Most cases of for_all; every evaluation computes a motion of each. */
static const int cases_most = 1000;

/* ---- Names of the model ---- */

static void refuse_name(struct plan *plan, struct place place, const char *what, const char *name) {
    const struct model *read = &plan->scene->generation.model;
    struct messages *messages = &plan->file->plain.messages;
    for (int i = 0; i < read->option_count; i++)
        if (strcmp(read->options[i].name, name) == 0) {
            message_error(
                messages, place,
                "%s%s: an option of the model, which fixes its structure; use a parameter, an input or "
                "a start value",
                what, name);
            return;
        }
    for (int i = 0; i < read->parameter_count; i++)
        if (strcmp(read->parameters[i].name, name) == 0) {
            message_error(messages, place, "%s%s: nothing in this model reads it; remove it", what, name);
            return;
        }
    if (!message_shows_unknown(messages))
        return;
    const struct refdyn_model *model = plan->scene->model;
    const char **known = format_allocate((size_t)model->parameter_count + 1, sizeof *known);
    for (int i = 0; i < model->parameter_count; i++)
        known[i] = model->parameters[i].name;
    const char *near = message_nearest_name(name, known, model->parameter_count);
    message_error(messages, place, "%s%s: unknown name%s%s%s", what, name, near ? "; did you mean \"" : "",
                  near ? near : "; use a parameter, an input, a coordinate or its rate NAME_d",
                  near ? "\"?" : "");
}

/* Whether the start value has no effect, because statics moves the coordinate. */
static bool is_moved(const struct refdyn_batch *batch, const struct refdyn_variable *variable) {
    bool is_held = false;
    for (int i = 0; i < batch->held_count; i++)
        is_held = is_held || batch->held[i] == variable->place;
    return batch->from_statics && variable->what == REFDYN_VARIED_COORDINATE && !is_held;
}

static void find_variable(struct plan *plan, struct place place, const char *what, const char *name,
                          struct refdyn_variable *variable) {
    const int count = simulate_derivatives_find(plan->scene->model, name, variable);
    if (count == 0)
        refuse_name(plan, place, what, name);
    else if (count > 1)
        message_error(&plan->file->plain.messages, place,
                      "%s%s: the model uses this name for several values; rename one of them", what, name);
    else if (is_moved(&plan->batch, variable))
        message_error(&plan->file->plain.messages, place,
                      "%s%s: statics moves this coordinate; add it to hold", what, name);
}

static int value_named(const struct plan *plan, const char *name) {
    for (int k = 0; k < plan->count; k++)
        if (strcmp(plan->values[k].name, name) == 0)
            return k;
    return -1;
}

/* Reports values that --inputs sets as well. */
static void check_sampled(struct plan *plan) {
    const struct inputs *inputs = plan->scene->inputs;
    for (int k = 0; k < plan->count && inputs; k++)
        for (int i = 0; i < inputs->samples.width; i++)
            if (plan->variables[k].what == REFDYN_VARIED_INPUT &&
                plan->variables[k].place == inputs->samples.place[i])
                message_error(&plan->file->plain.messages, plan->values[k].place,
                              "vary.%s: --inputs has samples of it; remove one of them",
                              plan->values[k].name);
}

static void find_values(struct plan *plan) {
    struct plan_file *file = plan->file;
    plan->values = file->values;
    plan->count = file->value_count;
    plan->variables = format_allocate((size_t)plan->count, sizeof *plan->variables);
    for (int k = 0; k < plan->count; k++) {
        find_variable(plan, plan->values[k].place, "vary.", plan->values[k].name, &plan->values[k].variable);
        plan->variables[k] = plan->values[k].variable;
    }
    check_sampled(plan);
    for (int k = 0; k < file->varied_count; k++) {
        struct plan_varied *varied = &file->varied[k];
        find_variable(plan, varied->place, "for_all.", varied->name, &varied->variable);
        if (value_named(plan, varied->name) >= 0)
            message_error(&file->plain.messages, varied->place,
                          "for_all.%s: vary has it as well; remove one of them", varied->name);
    }
}

/* Reports a course that changes during the motion. */
static void check_end_course(struct plan *plan) {
    const struct model *read = &plan->scene->generation.model;
    const struct graph *g = &plan->scene->generation.graph;
    for (int i = 0; i < read->course_count; i++)
        if (strcmp(read->courses[i].name, plan->file->end_name) == 0 &&
            g->nodes[read->courses[i].value].depends & ~(ON_PARAMETER | ON_INPUT))
            message_error(&plan->file->plain.messages, plan->file->end_place,
                          "t_end: the course %s changes during the motion; must depend on parameters alone",
                          plan->file->end_name);
}

/* The end of the motion: a parameter, a course, or a number. */
static void find_end(struct plan *plan) {
    const struct plan_file *file = plan->file;
    const struct refdyn_model *model = plan->scene->model;
    plan->end_parameter = plan->end_course = -1;
    plan->t_end = file->t_end;
    plan->courses = format_allocate((size_t)model->course_count + 1, sizeof *plan->courses);
    if (!file->end_name)
        return;
    plan->end_parameter = refdyn_find_name(model->parameters, model->parameter_count, file->end_name);
    for (int i = 0; i < model->course_count && plan->end_parameter < 0; i++)
        if (strcmp(model->courses[i], file->end_name) == 0)
            plan->end_course = i;
    const int varied = value_named(plan, file->end_name);
    if (plan->end_course >= 0)
        check_end_course(plan);
    else if (plan->end_parameter < 0)
        refuse_name(plan, file->end_place, "t_end: ", file->end_name);
    else if (varied >= 0 && !(plan->values[varied].from > plan->batch.t))
        message_error(&plan->file->plain.messages, plan->values[varied].place,
                      "vary.%s: the end of the motion begins at %.6g; must be after its start at t = %.6g",
                      file->end_name, plan->values[varied].from, plan->batch.t);
}

/* ---- Columns ---- */

/* The signal of a column; a new one if the plan does not have it yet. -1 after an error. */
static int find_signal(struct plan *plan, struct place place, const char *what, const char *column) {
    const struct record_table *table = &plan->table;
    const int found = record_table_find(table, column, strlen(column));
    if (found < 0 && !message_shows_unknown(&plan->file->plain.messages))
        return -1;
    if (found < 0) {
        const char *near = message_nearest_name(column, table->names, table->count);
        message_error(&plan->file->plain.messages, place, "%s: %s is no column of the motion%s%s%s", what,
                      column, near ? "; did you mean \"" : "", near ? near : "", near ? "\"?" : "");
        return -1;
    }
    for (int i = 0; i < plan->signal_count; i++)
        if (plan->signals[i] == found)
            return i;
    plan->signals[plan->signal_count] = found;
    return plan->signal_count++;
}

/* The scale of a limit: the distance of its bounds, or the size of its only bound. */
static double size_of(const struct plan_limit *limit) {
    if (isfinite(limit->from) && isfinite(limit->to) && limit->to > limit->from)
        return limit->to - limit->from;
    const double bound = fabs(isfinite(limit->to) ? limit->to : limit->from);
    return bound > 0 ? bound : 1;
}

/* Limits of the model by name; all of them if the plan names none. */
static void list_limits(struct plan *plan) {
    const struct model *read = &plan->scene->generation.model;
    struct plan_file *file = plan->file;
    const char **known = format_allocate((size_t)read->bound_count + 1, sizeof *known);
    for (int k = 0; k < read->bound_count; k++)
        known[k] = read->bounds[k].name;
    if (!file->has_limits) {
        file->limit_count = read->bound_count;
        file->limits = format_allocate((size_t)read->bound_count + 1, sizeof *file->limits);
        for (int k = 0; k < read->bound_count; k++)
            file->limits[k] = (struct plan_limit){.name = known[k], .place = file->place};
    }
    plan->limits = file->limits;
    plan->limit_count = file->limit_count;
    for (int i = 0; i < plan->limit_count; i++) {
        struct plan_limit *limit = &plan->limits[i];
        const int place = limit->is_at_end ? -1 : text_index(limit->name, known, read->bound_count);
        if (place >= 0) {
            limit->column = read->bounds[place].column;
            limit->from = read->bounds[place].from;
            limit->to = read->bounds[place].to;
        } else if (!limit->is_at_end)
            message_error(&file->plain.messages, limit->place, "within: %s is no limit of the model%s",
                          limit->name,
                          read->bound_count > 0 ? message_advice_on_name(&file->plain.memory, limit->name,
                                                                         known, read->bound_count)
                                                : ", which has none; add the field limits to it");
    }
}

static void find_columns(struct plan *plan) {
    struct plan_file *file = plan->file;
    list_limits(plan);
    plan->signals = format_allocate((size_t)plan->limit_count + 1, sizeof *plan->signals);
    for (int i = 0; i < plan->limit_count; i++) {
        struct plan_limit *limit = &plan->limits[i];
        if (limit->column)
            limit->signal = find_signal(plan, limit->place, "within", limit->column);
        limit->size = size_of(limit);
    }
    if (file->measure != PLAN_PARAMETER) {
        plan->objective = find_signal(plan, file->objective_place, "minimise", file->objective);
        return;
    }
    plan->objective = value_named(plan, file->objective);
    if (plan->objective < 0 && plan->end_course >= 0 && strcmp(file->objective, file->end_name) == 0) {
        file->measure = PLAN_AT_END;
        plan->objective = find_signal(plan, file->objective_place, "minimise", file->objective);
    } else if (plan->objective < 0)
        message_error(&file->plain.messages, file->objective_place,
                      "minimise: %s does not vary; name a value of vary, or a column as in rd.at_end(\"%s\")",
                      file->objective, file->objective);
}

/* ---- Cases ---- */

/* All combinations of the values of for_all. */
static void make_cases(struct plan *plan) {
    struct plan_file *file = plan->file;
    const int width = file->varied_count;
    double count = 1;
    for (int k = 0; k < width; k++)
        count *= file->varied[k].count;
    if (count > cases_most) {
        message_error(&file->plain.messages, file->varied[0].place, "for_all: %.0f cases; must be at most %d",
                      count, cases_most);
        return;
    }
    plan->case_count = (int)count;
    const int stretches = plan_break_count(plan) + 1;
    plan->stretches_most = stretches < stretches_most ? stretches : stretches_most;
    plan->part_count = plan_part(plan, plan->case_count, 0, PLAN_BEGIN);
    plan->cases = format_allocate_matrix(plan->case_count, width + 1);
    for (int i = 0; i < plan->case_count; i++)
        for (int k = 0, rest = i; k < width; k++) {
            plan->cases[i * width + k] = file->varied[k].list[rest % file->varied[k].count];
            rest /= file->varied[k].count;
        }
}

/* ---- Preparation ---- */

static void start_tables(struct plan *plan) {
    plan->rooms_of_thread = plan->batch.lanes ? plan->batch.lanes->width : 1;
    const int rooms = plan->batch.threads * plan->rooms_of_thread;
    bool *is_wanted = format_allocate((size_t)plan->table.count, sizeof *is_wanted);
    for (int k = 0; k < plan->signal_count; k++)
        is_wanted[plan->signals[k]] = true;
    plan->tables = format_allocate((size_t)rooms, sizeof *plan->tables);
    for (int i = 0; i < rooms; i++) {
        simulate_table_start(&plan->tables[i], plan->table.integrator, plan->scene->compiled.spatial);
        record_table_want(&plan->tables[i], is_wanted);
    }
    plan->integrals = format_allocate((size_t)rooms, sizeof *plan->integrals);
}

/* The batch has copies of the scene's parameters and inputs, which each motion sets. */
static enum status start_batch(struct plan *plan) {
    struct scene *scene = plan->scene;
    const struct refdyn_model *model = scene->model;
    const struct motion_derivatives names = {.option = "vary"};
    const enum status status =
        simulate_derivatives_batch(&names, scene, plan->options, &plan->integration, &plan->batch);
    double *p = format_allocate((size_t)model->parameter_count + 1, sizeof *p),
           *x = format_allocate((size_t)model->input_count + 1, sizeof *x);
    memcpy(p, scene->work.p, (size_t)model->parameter_count * sizeof *p);
    memcpy(x, scene->work.x, (size_t)model->input_count * sizeof *x);
    plan->batch.p = p;
    plan->batch.x = x;
    plan->batch.threads = system_processors();
    return status;
}

/* Reads --inputs. */
static enum status read_inputs(struct scene *scene, const struct options *options, struct inputs *inputs) {
    const char *path = options_text(options, "inputs");
    if (!path)
        return STATUS_DONE;
    scene->inputs = inputs;
    if (!scene_inputs_read(inputs, path, scene->model))
        return STATUS_FAULT;
    scene_inputs_set(inputs, scene->state.t, scene->work.x);
    return STATUS_DONE;
}

static enum status prepare(struct plan *plan, struct motion *motion, struct inputs *inputs) {
    struct scene *scene = plan->scene;
    enum status status = simulate_fit(scene, plan->options, &plan->integration);
    if (status == STATUS_DONE)
        status = read_inputs(scene, plan->options, inputs);
    if (status == STATUS_DONE)
        status = start_batch(plan);
    if (status == STATUS_DONE)
        status = simulate_place(scene, plan->options);
    if (status != STATUS_DONE)
        return status;
    const int result = simulate_start(motion, scene, &plan->integration, scene->state.t + 1, 0);
    if (result != REFDYN_OK)
        return scene_numbers_failed(scene, result, scene->state.t, scene->q, scene->qd);
    simulate_table_start(&plan->table, &motion->integrator, scene->compiled.spatial);
    find_values(plan);
    find_end(plan);
    find_columns(plan);
    make_cases(plan);
    if (!plan_file_print(plan->file))
        return STATUS_FAULT;
    start_tables(plan);
    return STATUS_DONE;
}

static enum status run_scene(struct scene *scene, const struct options *options,
                             const struct refdyn_options *integration, void *file) {
    struct plan plan = {.options = options, .scene = scene, .file = file, .integration = *integration};
    struct plan_result result = {.searches = 0};
    struct motion motion = {.memory = NULL};
    struct inputs inputs = {.path = NULL};
    plan.integration.balance = 0;
    enum status status = prepare(&plan, &motion, &inputs);
    if (status == STATUS_DONE)
        status = simulate_check_steps(options, plan_longest(&plan) - plan.batch.t);
    if (status == STATUS_DONE)
        status = plan_reference_open(&plan);
    if (status == STATUS_DONE && options_has(options, "resume"))
        status = plan_resume(&plan);
    if (status == STATUS_DONE) {
        system_interrupt_defer(true);
        system_progress_start(&plan.progress, "plan");
        plan_search(&plan, &result);
        system_progress_end(&plan.progress);
        status = plan_report(&plan, &result);
    }
    simulate_release(&motion);
    scene->inputs = NULL;
    return status;
}

/* ---- The command ---- */

/* Options from the file; those of the command line take precedence. */
static void take_options(struct options *options, const struct plan_file *file) {
    const char *const names[] = {"from", "method", "hold"}, *const texts[] = {file->from, file->method,
                                                                              file->hold};
    struct option_origin *origins = format_allocate(3, sizeof *origins);
    options->origins = origins;
    for (int i = 0; i < 3; i++)
        if (texts[i] && !options_has(options, names[i])) {
            const struct place place = value_find_field(script_result(file->plain.script), names[i])->place;
            options_set_text(options, names[i], texts[i]);
            origins[options->origin_count++] =
                (struct option_origin){names[i], names[i], format_text("%s:%d", place.file, place.line)};
        }
    const bool has_steps = options_has(options, "tol") || options_has(options, "step");
    if (!has_steps)
        options_set_number(options, "tol", file->tol > 0 ? file->tol : tol_default);
    if (file->tol_rates > 0 && !options_has(options, "tol-rates") && !options_has(options, "step"))
        options_set_number(options, "tol-rates", file->tol_rates);
}

static enum status run_plan(const struct options *given) {
    struct options own = *given;
    struct plan_file file;
    if (given->operand_count != 2)
        return options_usage_error(given->command,
                                   given->operand_count < 2 ? "PLAN.lua is missing" : "one PLAN.lua only");
    if (!plan_has_optimiser()) {
        fputs(
            "refdyn: plan needs NLopt; install Debian's libnlopt-dev and build refdyn again (for Python: pip "
            "install . -C cmake.define.REFDYN_NLOPT=ON)\n",
            stderr);
        return STATUS_FAULT;
    }
    enum status status = STATUS_FAULT;
    if (plan_file_read(&file, given->operands[1])) {
        take_options(&own, &file);
        status = simulate_run_search(&own, run_scene, &file);
    }
    plan_file_release(&file);
    return status;
}

static const struct option_rule plan_rules[] = {
    {"reference", "REF.csv", OPTION_TEXT,
     "also the motion of the plan for a controller: t, coordinates, rates, accelerations, programme forces",
     NULL, NULL},
    {"resume", NULL, OPTION_FLAG, "begin with the result that PLAN.json already has", NULL, NULL},
    {.name = NULL}};

const struct command plan_command = {
    .name = "plan",
    .run = run_plan,
    .operands = "MODEL.lua PLAN.lua",
    .options = "output! reference every resume method step tol tol-rates step-max from inputs stabilise "
               "singular start hold release way lanes parameters set",
    .tables = {plan_rules, simulate_rules, equilibria_rules, scene_rules},
    .output = "PLAN.json",
    .purpose = "the best parameters of a motion within limits",
    .help = "PLAN.lua says what varies, what is minimised and which limits hold; PLAN.json has the result, "
            "which sim --parameters takes.\n\n"
            "  refdyn plan models/manipulator.lua plan.lua -o plan.json\n"
            "  refdyn sim models/manipulator.lua --parameters plan.json --until 2 -o planned.csv\n"};
