/*
 * Names of a model that reach C: as members of structs, as the lead of functions and as names of files.
 *
 * Takes names with their places; complains about those that a compiler, a header or a library takes for
 * something else, and about those that are taken twice.
 */
#ifndef REFDYN_GEN_NAMES_H
#define REFDYN_GEN_NAMES_H

#include "base/message.h"

struct named {
    const char *name;
    struct place place;
};

/* Identifiers of C and C++, each once within its kind ("link", "point" ...). */
void names_check(struct messages *messages, const char *kind, const struct named *list, int count);
/* The same for members of an emitted struct, which macros would replace. */
void names_check_members(struct messages *messages, const char *kind, const struct named *list, int count);
/* The model's name is that of its files and the lead of its functions: neither may be someone else's. */
void names_check_model(struct messages *messages, struct named named);

#endif
