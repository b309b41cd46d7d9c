/* What `export` knows of the FMU that it writes; its parts are made one after the other. */
#ifndef REFDYN_TOOL_FMU_H
#define REFDYN_TOOL_FMU_H

#include "export/catalogue.h"

enum fmi_version { FMI_2, FMI_3 };
extern const char *const fmu_version_words[]; /* as --fmu gives them */

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

#endif
