/*
 * Names of a URDF file as identifiers of Lua and C. A name that is one stays. In others each character that
 * may not be there becomes _, a lead is set before what is still none, and the number of the entry in the
 * file behind what is taken: the same file has the same names always.
 */
#ifndef REFDYN_TOOL_IDENTIFIERS_H
#define REFDYN_TOOL_IDENTIFIERS_H

/* Of `count` names that differ; `lead`: "link". */
const char **identifiers_make(const char *const *names, int count, const char *lead);
/* The name of a model, which is that of its files, too. */
const char *identifiers_model(const char *name);

#endif
