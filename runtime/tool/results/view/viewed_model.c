/* Reads the model that belongs to a run: from the HDF5 file itself, or for a CSV from --model and --set. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* What an HDF5 file contains about its model. */
struct carried {
    struct setting *settings;
    int count, room;
    const struct scratch *folder;
    const char *run;  /* the HDF5 file */
    const char *file; /* the model in the folder, NULL if it is missing */
    char *path;       /* its path when the motion was computed */
    bool has_failed;
};

/* ---- A model from a file of HDF5 ---- */

static void take_setting(void *context, const struct motion_fact *fact) {
    struct carried *carried = context;
    char number[NUMBER_LENGTH];
    if (!fact->text && !isfinite(fact->number) && !carried->has_failed) {
        format_complain_line(
            carried->run, 0,
            format_text("%s: %s is %g; must be finite", fact->object, fact->name, fact->number));
        carried->has_failed = true;
    }
    carried->settings = memory_room(&format_memory, carried->settings, carried->count, &carried->room,
                                    sizeof *carried->settings);
    carried->settings[carried->count++] = (struct setting){
        .name = format_text("%s", fact->name),
        .value = format_text("%s", fact->text ? fact->text : exact_text(fact->number, number))};
}

static void take_path(void *context, const struct motion_fact *fact) {
    struct carried *carried = context;
    if (fact->text && strcmp(fact->name, "model_file") == 0)
        carried->path = format_text("%s", fact->text);
}

/* Files that a model requires are in its folder, so their names are sufficient. */
static void write_file(void *context, const struct motion_fact *fact) {
    struct carried *carried = context;
    const char *slash = strrchr(fact->name, '/');
    const char *name = slash ? slash + 1 : fact->name;
    if (!fact->text || carried->has_failed)
        return;
    carried->has_failed = !system_scratch_write(carried->folder, name, fact->text, strlen(fact->text));
    if (carried->path && strcmp(carried->path, fact->name) == 0)
        carried->file = system_scratch_file(carried->folder, name);
}

static bool take_all(struct carried *carried) {
    struct motion_reader *reader = hdf5_motion_open(carried->run);
    if (!reader)
        return false;
    hdf5_motion_give_facts(reader, "/", take_path, carried);
    hdf5_motion_give_facts(reader, "/options", take_setting, carried);
    hdf5_motion_give_facts(reader, "/parameters", take_setting, carried);
    hdf5_motion_give_facts(reader, "/model_files", write_file, carried);
    hdf5_motion_close(reader);
    if (!carried->has_failed && !carried->file)
        format_complain_line(carried->run, 0, "the file does not contain its model");
    return !carried->has_failed && carried->file;
}

static enum status read_carried(struct viewed_model *viewed, const char *path,
                                const struct options *options) {
    struct carried carried = {.folder = &viewed->folder, .run = path};
    viewed->has_folder = system_scratch_open(&viewed->folder, system_scratch_parent(), "refdyn-view-");
    if (!viewed->has_folder || !take_all(&carried))
        return STATUS_FAULT;
    struct options reading = {.command = options->command,
                              .operands = &carried.file,
                              .operand_count = 1,
                              .settings = carried.settings,
                              .setting_count = carried.count};
    options_set_flag(&reading, "fold");
    return scene_read(&viewed->scene, &reading, false);
}

/* ---- Any run ---- */

static enum status read_given(struct viewed_model *viewed, const struct options *options) {
    const char *model = options_text(options, "model");
    struct options reading = *options;
    reading.operands = &model;
    reading.operand_count = 1;
    options_set_flag(&reading, "fold");
    return scene_read(&viewed->scene, &reading, true);
}

static enum status refuse_columns(const struct run *run, const char *fact) {
    format_complain_line(run->path, figures_run_is_hdf5(run->path) ? 0 : 1, fact);
    return STATUS_FAULT;
}

static enum status check_columns(const struct viewed_model *viewed, const struct run *run) {
    const struct generation *generation = &viewed->scene.generation;
    const struct tree *tree = &generation->tree;
    const char *model = generation->model.name;
    const int joints = tree_joint_count(tree);
    if (run->coordinate_count != joints)
        return refuse_columns(
            run, format_text("run: has %d coordinates, but model %s has %d; give --model and --set "
                             "of the motion",
                             run->coordinate_count, model, joints));
    for (int i = 0; i < joints; i++)
        if (strcmp(run->columns[run->coordinates + i], tree->frames[i].name) != 0)
            return refuse_columns(run, format_text("run: coordinate %d is '%s', but in model %s it is '%s'; "
                                                   "give --model and --set of the motion",
                                                   i + 1, run->columns[run->coordinates + i], model,
                                                   tree->frames[i].name));
    return STATUS_DONE;
}

enum status view_model_read(struct viewed_model *viewed, const struct run *run,
                            const struct options *options) {
    *viewed = (struct viewed_model){.has_folder = false};
    const enum status status = figures_run_is_hdf5(run->path) ? read_carried(viewed, run->path, options)
                                                              : read_given(viewed, options);
    /* The bound on work applies to reading the model, which is done; only a few numbers are computed now. */
    viewed->scene.generation.memory.work_bound = 0;
    return status == STATUS_DONE ? check_columns(viewed, run) : status;
}

void view_model_release(struct viewed_model *viewed) {
    scene_close(&viewed->scene);
    if (viewed->has_folder)
        system_scratch_close(&viewed->folder);
}
