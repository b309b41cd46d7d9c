/* The names that a Lua source declares, so that the one that was meant can be found. */
#ifndef REFDYN_GEN_LOCAL_VARIABLES_H
#define REFDYN_GEN_LOCAL_VARIABLES_H

#include "base/memory.h"

/* Lists up to `room` names of local variables and functions; gives how many. */
int local_variables_list(struct memory *memory, const char *source, size_t length, const char **names,
                         int room);

#endif
