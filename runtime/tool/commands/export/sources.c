/* Collects the sources of an FMU, writes refdyn_fmu.c with its values, and computes its token. */
#include "runtime/tool/commands/export/export.h"

#include <sha2.h>
#include <stdlib.h>
#include <string.h>

void export_files_add(struct fmu_files *files, const char *path, const char *text, size_t size) {
    files->list =
        memory_room(&format_memory, files->list, files->count + 1, &files->room, sizeof *files->list);
    files->list[files->count++] = (struct fmu_file){path, text, size};
}

bool export_is_of_other_version(const char *path, enum fmi_version version) {
    const char *other = version == FMI_2 ? "runtime/bindings/fmi/fmi3." : "runtime/bindings/fmi/fmi2.";
    return strncmp(path, other, strlen(other)) == 0;
}

bool export_is_source(const char *path) {
    return text_ends_with(path, ".c");
}

/* ---- refdyn_fmu.c ---- */

static void put_doubles(FILE *out, const char *name, const double *values, int count) {
    fprintf(out, "static const double %s[] = {", name);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", " : "", out);
        format_number(out, values[i]);
    }
    fputs(count ? "};\n" : "0};\n", out);
}

static void put_given(FILE *out, const struct scene *scene) {
    const int count = scene->model->anchored_count;
    fputs("static const int given[] = {", out);
    for (int i = 0; i < count; i++)
        fprintf(out, "%s%d", i ? ", " : "", scene->given[i] != 0);
    fputs(count ? "};\n" : "0};\n", out);
}

static void put_option(FILE *out, const char *name, double value) {
    fprintf(out, "                .%s = ", name);
    format_number(out, value);
    fputs(",\n", out);
}

static void put_options(FILE *out, const struct refdyn_options *options) {
    fprintf(out,
            "    .options = {.method = (enum refdyn_method)%d, /* %s */\n"
            "                .stabilise = (enum refdyn_stabilise)%d,\n"
            "                .singular = (enum refdyn_singular)%d,\n",
            (int)options->method, refdyn_method_name((int)options->method), (int)options->stabilise,
            (int)options->singular);
    put_option(out, "tol", options->tol);
    put_option(out, "tol_rates", options->tol_rates);
    put_option(out, "step", options->step);
    put_option(out, "step_max", options->step_max);
    put_option(out, "length", options->length);
    put_option(out, "gain_share", options->gain_share);
    fprintf(out, "                .step_limit = %ld},\n", options->step_limit);
}

static void put_model(FILE *out, const struct fmu *fmu) {
    const struct scene *scene = fmu->scene;
    const struct refdyn_model *model = scene->model;
    fprintf(out,
            "/* What this FMU knows of itself: see fmi.h. Written by refdyn. */\n"
            "#include \"runtime/bindings/fmi/fmi.h\"\n#include \"%s.h\"\n\n",
            fmu->name);
    put_doubles(out, "parameters", scene->work.p, model->parameter_count);
    put_doubles(out, "inputs", scene->work.x, model->input_count);
    put_given(out, scene);
    if (fmu->has_start) {
        double *start = format_allocate_matrix(2, model->n);
        memcpy(start, scene->q, (size_t)model->n * sizeof *start);
        memcpy(start + model->n, scene->qd, (size_t)model->n * sizeof *start);
        put_doubles(out, "start", start, 2 * model->n);
    }
    fprintf(out, "\nconst struct refdyn_fmu refdyn_fmu = {\n    .model = &%s_model,\n", fmu->name);
    if (scene->compiled.spatial)
        fprintf(out, "    .spatial = &%s_spatial,\n", fmu->name);
    fprintf(
        out,
        "    .token = \"%s\",\n    .parameters = parameters,\n    .given = given,\n    .inputs = inputs,\n",
        fmu->token);
    if (fmu->has_start)
        fputs("    .start = start,\n", out);
    fputs("    .t_start = ", out);
    format_number(out, scene->state.t);
    fputs(",\n", out);
    put_options(out, &fmu->options);
    fputs("};\n", out);
}

/* Returns the text, which the list of sources contains. */
static char *add_model(struct fmu *fmu) {
    char *text;
    size_t size;
    FILE *out = format_stream(&text, &size);
    put_model(out, fmu);
    fclose(out);
    export_files_add(&fmu->sources, "refdyn_fmu.c", text, size);
    return text;
}

/* ---- The token ---- */

static void hash_file(SHA2_CTX *sha, const struct fmu_file *file) {
    SHA256Update(sha, (const uint8_t *)file->path, strlen(file->path) + 1);
    SHA256Update(sha, (const uint8_t *)file->text, file->size);
}

/* The token has the form of a GUID. It is a hash of all sources, with refdyn_fmu.c before it has the token.
 */
static const char *make_token(const struct fmu *fmu) {
    char digest[SHA256_DIGEST_STRING_LENGTH];
    SHA2_CTX sha;
    SHA256Init(&sha);
    SHA256Update(&sha, (const uint8_t *)&fmu->version, sizeof fmu->version);
    for (int i = 0; i < fmu->sources.count; i++)
        hash_file(&sha, &fmu->sources.list[i]);
    SHA256End(&sha, digest);
    return format_text("{%.8s-%.4s-%.4s-%.4s-%.12s}", digest, digest + 8, digest + 12, digest + 16,
                       digest + 20);
}

void export_make_sources(struct fmu *fmu) {
    struct generation *generation = &fmu->scene->generation;
    const struct emitted_file *emitted = gen_files(generation);
    for (int i = 0; i < carried_file_count; i++)
        if (!export_is_of_other_version(carried_files[i].path, fmu->version))
            export_files_add(&fmu->sources, carried_files[i].path, carried_files[i].text,
                             carried_files[i].size);
    for (int i = 0; i < gen_file_count(generation); i++)
        export_files_add(&fmu->sources, emitted[i].name, emitted[i].text, emitted[i].length);
    fmu->token = "";
    char *without_token = add_model(fmu);
    fmu->token = make_token(fmu);
    fmu->sources.count--;
    free(without_token);
    add_model(fmu);
}
