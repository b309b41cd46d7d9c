/*
 * Lua as a server: runs a model file in a sandbox and gives plain values. Only the files behind it
 * (script_state.h) know Lua.
 *
 * script_open is declared in read_model.h. Errors of the script become complaints.
 */
#ifndef REFDYN_GEN_SCRIPT_H
#define REFDYN_GEN_SCRIPT_H

#include "read/declarations.h"
#include "read/read_model.h"
#include "read/sweep_file.h"
#include "read/value.h"

/* The table that the file returns. */
const struct value *script_result(const struct script *script);
struct declarations *script_declarations(struct script *script);
struct messages *script_messages(struct script *script);
/* The names that the author's functions may use from now on. */
void script_set_names(struct script *script, struct model *model, const char *const *coordinates,
                      int coordinate_count);
/* Calls an author's function, which messages call `name`, with the state `s`; false when it failed (messages
 * say why). */
bool script_call(struct script *script, const struct value *function, const char *name, struct value *result);

/* Calls a sweep's function with the values of each case of `given`; the values that it gives are the columns
 * of `derived`, in the order of their names, which live in `memory`. False as above. */
bool script_derive(struct script *script, const struct value *function, const struct case_table *given,
                   struct memory *memory, struct case_table *derived);

#endif
