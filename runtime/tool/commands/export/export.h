/* Exports a model as an FMU: the catalogue of variables; the FMU; its ZIP archive; its libraries; its
 * sources; modelDescription.xml. */
#ifndef REFDYN_TOOL_EXPORT_H
#define REFDYN_TOOL_EXPORT_H

#include <stdbool.h>
#include <stddef.h>

#include "runtime/bindings/fmi/variables.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/compile/compile.h"

/* The variables of an FMU as importers see them. Names are those of the columns of `refdyn sim`; der(NAME) is
 * the derivative of a coordinate. A name that is taken gets its kind in front, as in a CSV. */

enum causality { AS_INDEPENDENT, AS_PARAMETER, AS_INPUT, AS_OUTPUT, AS_LOCAL };
enum variability { IS_FIXED, IS_TUNABLE, IS_DISCRETE, IS_CONTINUOUS };
enum initial { INITIAL_NONE, INITIAL_EXACT, INITIAL_APPROXIMATE, INITIAL_CALCULATED };

struct catalogue_entry {
    struct fmu_variable variable;
    unsigned reference;
    const char *name, *unit, *about; /* unit NULL: there is none, or the model does not give it */
    enum causality causality;
    enum variability variability;
    enum initial initial; /* exact or approximate: it has a start value */
    double start;
    int state; /* the entry whose derivative it is; -1: it is no derivative */
};

struct catalogue {
    struct catalogue_entry *entries;
    int count, room;
    int first[FMU_KIND_COUNT]; /* the entry of the first variable of a kind */
};

/* Describes the variables at the start of the scene. */
void export_catalogue_make(struct catalogue *catalogue, struct scene *scene, bool has_indicators);
/* (3 points x n) Which coordinates the position of each point depends on. */
bool *export_catalogue_dependencies(const struct scene *scene);

/* The FMU that `export` writes. */

enum fmi_version { FMI_2, FMI_3 };
struct fmu_file {
    const char *path; /* in the FMU, or under its sources/ */
    const char *text;
    size_t size;
};

struct fmu_files {
    struct fmu_file *list;
    int count, room;
};

struct fmu {
    struct scene *scene;
    enum fmi_version version;
    const char *name;  /* name of the model and of the library */
    const char *token; /* GUID of FMI 2.0, instantiation token of FMI 3.0 */
    struct refdyn_options options;
    double until;                   /* default stop time [s] */
    bool has_start;                 /* the start differs from the model's own */
    const char *why_no_derivatives; /* NULL if there are directional derivatives */
    struct catalogue catalogue;
    struct fmu_files sources; /* with paths under sources/ */
    struct fmu_files files;   /* of the whole FMU */
};

void export_files_add(struct fmu_files *files, const char *path, const char *text, size_t size);
/* Returns whether a file belongs only to the other version of FMI, by its name. */
bool export_is_of_other_version(const char *path, enum fmi_version version);

/* A ZIP archive of files; equal files give equal bytes. */

/* Returns whether this refdyn is built with minizip; otherwise reports it on stderr. */
bool export_archive_is_there(void);
/* Returns false and reports on stderr if it fails. */
bool export_archive_put(FILE *out, const struct fmu_files *files);

/* The libraries of an FMU, one for each platform. */

struct platform {
    const char *name;             /* the value of --platform, and the folder of FMI 2.0 */
    const char *folder_3;         /* the folder of FMI 3.0 */
    const char *ending;           /* of the file name */
    const char *compiler;         /* NULL for $CC */
    const char *package;          /* the package of Debian that has the compiler */
    const char *machine;          /* a condition on macros of $CC that holds for the platform */
    const char *compile_flags[4]; /* in addition to the common ones; NULL at the end */
    const char *link_flags[6];
};

/* Returns NULL if there is no platform of that name. */
const struct platform *export_platform_find(const char *name);
/* "linux64, win64" */
const char *export_platform_names(void);
/* Compiles the sources and adds the library to fmu->files. The part that is the same in all FMUs is compiled
 * once and kept in the cache. Returns false and reports on stderr if it fails. */
bool export_binary_make(struct fmu *fmu, const struct platform *platform);

/* modelDescription.xml of an FMU, and sources/buildDescription.xml of FMI 3.0. Call these after
 * export_make_sources. */
void export_description_put_2(FILE *out, const struct fmu *fmu);
void export_description_put_3(FILE *out, const struct fmu *fmu);
void export_description_put_build(FILE *out, const struct fmu *fmu);

/* Fills fmu->sources: those in every FMU, the emitted model, and the values that it is exported with. Sets
 * fmu->token, which is computed from all sources. */
void export_make_sources(struct fmu *fmu);
/* Returns whether the file is compiled; headers are not. */
bool export_is_source(const char *path);

extern const struct command export_command;

#endif
