/*
 * From a Lua file to the model: see model.h for the two steps. Complaints go to `messages`; a model with
 * errors is not used further.
 */
#ifndef REFDYN_GEN_READ_MODEL_H
#define REFDYN_GEN_READ_MODEL_H

#include "model/model.h"
#include "read/setting.h"
#include "tree/tree.h"

/* What a Lua file describes: each kind has functions of its own in rd. */
enum file_kind { FILE_MODEL, FILE_SWEEP };

struct read_request {
    const char *file;
    enum file_kind kind;
    const struct setting *settings; /* --set NAME=VALUE, later ones win */
    int setting_count;
    bool fold; /* parameters become numbers; anchored ones stay parameters */
    enum accelerations accelerations;
    enum loops loops;
};

struct script;

/*
 * Opens the file and runs it up to the model's table; NULL when that failed (messages say why). Complaints
 * that leave something to read leave a script too. It is never closed: what it takes lives in `memory` and
 * goes with it, and no code of the model runs any more.
 */
struct script *script_open(struct memory *memory, struct graph *graph, const struct read_request *request,
                           struct messages *messages);
/* Fills the model; after complaints it is whole, with harmless values for what is missing, but not to be
 * expanded. */
void read_scene(struct script *script, struct model *model);
/* Of a model and a tree without complaints; complains about unknown settings too. */
void read_programme(struct script *script, const struct tree *tree, struct model *model);
/* The files that it was read from; they outlive the script. */
const struct sources *script_sources(const struct script *script);

/* Checks that need no Lua: names, values at the parameters' defaults, references. */
void check_scene(const struct model *model, struct messages *messages);
void check_programme(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
