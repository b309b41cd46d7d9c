/* What this folder offers. */
#ifndef REFDYN_TOOL_EXPORT_H
#define REFDYN_TOOL_EXPORT_H

#include <stdbool.h>
#include <stddef.h>

#include "runtime/bindings/fmi/variables.h"
#include "runtime/tool/scene/scene.h"

/*
 * The variables of an FMU as importers see them: names, units, roles, start values.
 *
 * Names are those of the columns of `refdyn sim`; der(NAME) is the derivative of a coordinate. Where a name
 * is taken already, it gets its kind before it, as in a CSV.
 */

enum causality { AS_INDEPENDENT, AS_PARAMETER, AS_INPUT, AS_OUTPUT, AS_LOCAL };
enum variability { IS_FIXED, IS_TUNABLE, IS_DISCRETE, IS_CONTINUOUS };
enum initial { INITIAL_NONE, INITIAL_EXACT, INITIAL_APPROXIMATE, INITIAL_CALCULATED };

struct catalogue_entry {
    struct fmu_variable variable;
    unsigned reference;
    const char *name, *unit, *about; /* unit NULL: none, or the model does not say */
    enum causality causality;
    enum variability variability;
    enum initial initial; /* exact, approximate: it has a start value */
    double start;
    int state; /* the entry whose derivative it is; -1: it is none */
};

struct catalogue {
    struct catalogue_entry *entries;
    int count, room;
    int first[FMU_KIND_COUNT]; /* the entry of the first variable of a kind */
};

/* Of the scene's start. */
void catalogue_make(struct catalogue *catalogue, struct scene *scene, bool has_indicators);
/* (3 points x n) Which coordinates the position of each point depends on. */
bool *catalogue_dependencies(const struct scene *scene);

/* What `export` knows of the FMU that it writes; its parts are made one after the other. */

enum fmi_version { FMI_2, FMI_3 };
extern const struct command export_command;

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
    const char *name;  /* of the model, which is that of the library */
    const char *token; /* GUID of FMI 2.0, instantiation token of FMI 3.0 */
    struct refdyn_options options;
    double until;                   /* default stop time [s] */
    bool has_start;                 /* the start is not the model's own */
    const char *why_no_derivatives; /* NULL: there are directional ones */
    struct catalogue catalogue;
    struct fmu_files sources; /* paths under sources/ */
    struct fmu_files files;   /* all of the FMU */
};

void fmu_files_add(struct fmu_files *files, const char *path, const char *text, size_t size);
/* Are two versions told apart by its name, and is it of the other one? */
bool fmu_is_of_other_version(const char *path, enum fmi_version version);

/* Files as one ZIP archive, the same byte for byte for the same files. */

/* Is this refdyn built with what archives need? Complains on stderr when it is not. */
bool archive_is_there(void);
/* Complains on stderr when it fails. */
bool archive_put(FILE *out, const struct fmu_files *files);

/* The libraries of an FMU, one for each platform. */

struct platform {
    const char *name;             /* as --platform gives it, and the folder of FMI 2.0 */
    const char *folder_3;         /* the folder of FMI 3.0 */
    const char *ending;           /* of the library */
    const char *compiler;         /* NULL: $CC */
    const char *package;          /* of Debian, that has the compiler */
    const char *machine;          /* what macros of $CC say where it builds for the platform */
    const char *compile_flags[4]; /* beside those of all; end with NULL */
    const char *link_flags[6];
};

/* NULL: there is none of that name. */
const struct platform *platform_find(const char *name);
/* "linux64, win64" */
const char *platform_names(void);
/* Compiles the sources and adds the library to fmu->files. What is the same in all FMUs is compiled once and
 * kept in the cache. Complains on stderr when it fails. */
bool binary_make(struct fmu *fmu, const struct platform *platform);

/* The sources that every FMU carries: the core of the runtime and the layer of runtime/bindings/fmi, put in
 * at build time. */

struct carried_file {
    const char *path; /* under runtime/, as sources include it */
    const char *text;
    size_t size;
};

extern const struct carried_file carried_files[];
extern const int carried_file_count;

/* modelDescription.xml of an FMU. */

/* After fmu_make_sources. */
void description_put_2(FILE *out, const struct fmu *fmu);
void description_put_3(FILE *out, const struct fmu *fmu);
/* sources/buildDescription.xml of FMI 3.0. */
void description_put_build(FILE *out, const struct fmu *fmu);

/* ---- Parts of both versions ---- */

/* NAME="VALUE", a blank before it. */
void put_attribute(FILE *out, const char *name, const char *value);
void put_number_attribute(FILE *out, const char *name, double value);
extern const char *const causality_names[], *const variability_names[], *const initial_names[];
/* Each unit in use, with its base units. */
void description_put_units(FILE *out, const struct fmu *fmu);
void description_put_experiment(FILE *out, const struct fmu *fmu);
void description_put_categories(FILE *out);
/* Attributes that say what an unknown depends on; nothing where that is all states and inputs. depends:
 * catalogue_dependencies. */
void description_put_dependencies(FILE *out, const struct fmu *fmu, const bool *depends,
                                  const struct catalogue_entry *entry);
bool catalogue_has_start(const struct catalogue_entry *entry);
bool catalogue_is_output(const struct catalogue_entry *entry);
bool catalogue_is_derivative(const struct catalogue_entry *entry);
/* Is it an output, a derivative or a state that initialisation computes? */
bool catalogue_is_unknown_at_start(const struct catalogue_entry *entry);

/* The sources of an FMU: what every one carries, the emitted model, and the values that it is exported with.
 */

/* Fills fmu->sources, and fmu->token, which follows from all of them. */
void fmu_make_sources(struct fmu *fmu);
/* Is it a source to compile, and not a header? */
bool fmu_is_source(const char *path);

#endif
