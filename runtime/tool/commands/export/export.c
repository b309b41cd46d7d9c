/*
 * `refdyn export`: a model as an FMU, for other simulators.
 *
 * From a scene and the options of motions, with which Co-Simulation steps, it writes a ZIP archive with
 * sources, libraries and their description.
 */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/motions/equilibria/equilibria.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/commands/export/export.h"
#include "runtime/tool/motions/simulate/simulate.h"

#include <math.h>
#include <string.h>

extern const char fmu_licence[];
extern const size_t fmu_licence_size;

static const double default_span = 10; /* length of the default experiment [s] */

/* The quantities for steps, outputs and directional derivatives, and for the start. */
static const char *quantities(const struct options *options, const struct model *model) {
    const bool has_rows = model->row_count > 0;
    const bool has_inputs = model->input_count > 0;
    const char *derivatives = has_rows ? "d_qdd" : "d_qdd_free";
    return format_text("energy,power,course,M,h,Q,implicit,%s,r,rd,C,d,J,Jd_qd,%s.q,%s.qd%s%s%s%s%s",
                       has_rows ? "constrained,qdd_free" : "qdd_free", derivatives, derivatives,
                       has_inputs ? format_text(",%s.x", derivatives) : "",
                       has_rows ? ",d_force.q,d_force.qd" : "", has_rows && has_inputs ? ",d_force.x" : "",
                       options_is(options, "from", "statics") ? ",Q_q" : "",
                       has_rows ? ",row_terms,row_sizes" : "");
}

/* ---- Options ---- */

static const char *const version_words[] = {[FMI_2] = "2.0", [FMI_3] = "3.0", NULL};

static enum status choose_version(const struct options *options, enum fmi_version *version) {
    int place = 0;
    const enum status status = options_choose(options, "fmu", &place);
    *version = (enum fmi_version)place;
    return status;
}

static enum status check_platforms(const struct options *options, const char *const *list) {
    for (; *list; list++)
        if (!export_platform_find(*list))
            return options_error(options, "platform", ": '%s' is not one of %s", *list,
                                 export_platform_names());
    return STATUS_DONE;
}

/* FMUs contain the core only, which does not have the methods of GSL. */
static enum status check_method(const struct options *options) {
    const char *method = options_text(options, "method");
    return simulate_gsl_has(method)
               ? options_error(options, "method", ": '%s' is a method of GSL, which FMUs do not contain",
                               method)
               : STATUS_DONE;
}

/* ---- The FMU ---- */

/* If M is singular, derivatives of accelerations divide by zero. */
static bool are_finite(const struct scene *scene, refdyn_function *function, int count) {
    double *values = format_allocate((size_t)count, sizeof *values);
    function(scene->work.p, scene->work.x, scene->state.t, scene->q, scene->qd, values);
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

/* Why the FMU has no directional derivatives; NULL if it has them, with a column for each coordinate, rate
 * and input. */
static const char *find_why_no_derivatives(const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    const int n = model->n;
    struct emitted_function function;
    const char *wanted = model->m > 0 ? "d_qdd" : "d_qdd_free";
    for (int i = 0; gen_function(&scene->generation, i, &function); i++) {
        int count = 0;
        for (int k = 0; k < function.part_count; k++)
            count += gen_result_part(&scene->generation, i, k).count;
        if (strcmp(function.quantity, wanted) != 0)
            continue;
        if (count != n * (2 * n + model->input_count))
            break;
        const bool is_good = are_finite(scene, model->m > 0 ? model->d_qdd : model->d_qdd_free, count);
        return is_good ? NULL : "those of the accelerations are not finite at the start";
    }
    return "the model has none of its accelerations";
}

static void add_text(struct fmu *fmu, const char *path, void (*put)(FILE *out, const struct fmu *fmu)) {
    char *text;
    size_t size;
    FILE *out = format_stream(&text, &size);
    put(out, fmu);
    fclose(out);
    export_files_add(&fmu->files, path, text, size);
}

static void add_sources(struct fmu *fmu) {
    for (int i = 0; i < fmu->sources.count; i++) {
        const struct fmu_file *source = &fmu->sources.list[i];
        export_files_add(&fmu->files, format_text("sources/%s", source->path), source->text, source->size);
    }
}

static enum status write_fmu(struct fmu *fmu, const char *const *platforms) {
    struct scene *scene = fmu->scene;
    export_catalogue_make(&fmu->catalogue, scene, fmu->version == FMI_3);
    fmu->why_no_derivatives = find_why_no_derivatives(scene);
    export_make_sources(fmu);
    add_text(fmu, "modelDescription.xml",
             fmu->version == FMI_2 ? export_description_put_2 : export_description_put_3);
    for (; *platforms; platforms++)
        if (!export_binary_make(fmu, export_platform_find(*platforms)))
            return STATUS_FAULT;
    add_sources(fmu);
    if (fmu->version == FMI_3)
        add_text(fmu, "sources/buildDescription.xml", export_description_put_build);
    export_files_add(&fmu->files, "documentation/licenses/license.txt", fmu_licence, fmu_licence_size);
    return export_archive_put(scene->result->file, &fmu->files) && system_target_finish(scene->result)
               ? STATUS_DONE
               : STATUS_FAULT;
}

static void print_summary(const struct fmu *fmu) {
    const struct refdyn_model *model = fmu->scene->model;
    fprintf(stderr, "%s: FMI %s, Model Exchange and Co-Simulation (%s, tolerance %g)\n", fmu->name,
            fmu->version == FMI_2 ? "2.0" : "3.0", refdyn_method_name((int)fmu->options.method),
            fmu->options.tol);
    fprintf(stderr, "states %d, inputs %d, variables %d, event indicators %d%s%s\n", fmu_count_states(model),
            model->input_count, fmu->catalogue.count, fmu_count_indicators(model),
            fmu->why_no_derivatives ? "; no directional derivatives: " : "",
            fmu->why_no_derivatives ? fmu->why_no_derivatives : "");
}

/* Computes the start of the motion and its options, then writes the FMU. */
static enum status export_scene(struct scene *scene, const struct options *options, struct fmu *fmu,
                                const char *const *platforms) {
    const char *from = options_text(options, "from");
    const double until = options_number(options, "until");
    enum status status = simulate_fit(scene, options, &fmu->options);
    if (status == STATUS_DONE)
        status = simulate_place(scene, options);
    if (status != STATUS_DONE)
        return status;
    fmu->options.step_limit = 0; /* its importer decides how long it runs */
    fmu->scene = scene;
    fmu->name = scene->model->name;
    fmu->has_start = from && strcmp(from, "initial") != 0;
    fmu->until = until > 0 ? until : scene->state.t + default_span;
    struct options timed = *options;
    options_set_number(&timed, "until", fmu->until);
    status = simulate_check_times(scene, &timed, RECORD_OUTPUTS_MAX);
    if (status == STATUS_DONE)
        status = write_fmu(fmu, platforms);
    if (status == STATUS_DONE)
        print_summary(fmu);
    return status;
}

/* Reads the model to know which quantities it has, then reads and compiles it with these. */
static enum status open_and_export(const struct options *options, struct fmu *fmu,
                                   const char *const *platforms) {
    struct scene scene;
    struct options own = *options;
    enum status status = scene_read(&scene, options, false);
    if (status == STATUS_DONE)
        options_set_text(&own, "emit", quantities(options, &scene.generation.model));
    scene_close(&scene);
    if (status != STATUS_DONE)
        return status;
    status = scene_open(&scene, &own, NEEDS_RESULT | NEEDS_ONCE | NEEDS_ALL,
                        options_state_path(options_text(options, "from")));
    if (status == STATUS_DONE)
        status = export_scene(&scene, options, fmu, platforms);
    scene_close(&scene);
    return status;
}

static enum status run_export(const struct options *options) {
    const char *platform = options_text(options, "platform");
    struct fmu fmu = {.version = FMI_2};
    const char *list = platform ? platform : "linux64";
    const char **platforms = options_list(list);
    enum status status = choose_version(options, &fmu.version);
    if (status == STATUS_DONE)
        status = check_platforms(options, platforms);
    if (status == STATUS_DONE)
        status = check_method(options);
    if (status == STATUS_DONE)
        status = simulate_options(options, &fmu.options);
    if (status != STATUS_DONE)
        return status;
    return export_archive_is_there() ? open_and_export(options, &fmu, platforms) : STATUS_FAULT;
}

static const char *list_platforms(const struct command *command) {
    (void)command;
    return export_platform_names();
}

static const struct option_rule export_rules[] = {
    {"fmu", "VERSION", OPTION_TEXT, "version of FMI: 2.0 or 3.0", version_words, NULL},
    {"platform", "a,b", OPTION_LIST,
     "libraries in the FMU: linux64 (default), win64, which needs gcc-mingw-w64", NULL, list_platforms},
    {.name = NULL}};

const struct command export_command = {
    .name = "export",
    .run = run_export,
    .operands = "MODEL.lua",
    .options = "output! until method step tol tol-rates step-max from stabilise singular hold release "
               "way fmu! platform set fold",
    .tables = {export_rules, simulate_rules, equilibria_rules, scene_rules},
    .output = "FILE.fmu",
    .purpose = "a model as an FMU, for other simulators",
    .help = "Model Exchange and Co-Simulation in one file, with libraries and all sources. Variables have "
            "the names of\n"
            "the columns of sim. Co-Simulation steps as sim does, with the given method and tolerance.\n\n"
            "  refdyn export models/manipulator.lua --set n_rfe=1 --fmu 2.0 -o manipulator.fmu\n"
            "  refdyn export models/fourbar.lua --fmu 2.0 --platform linux64,win64 -o fourbar.fmu\n"};
