/* What emitted files are made from, for programs that build. Takes what was emitted and the folder of its
 * files; gives one rule as make reads it: the files, and behind the colon the model and all that it requires.
 */
#ifndef REFDYN_TOOL_GENERATE_H
#define REFDYN_TOOL_GENERATE_H

#include "gen/gen.h"

const char *depfile_text(const struct generation *generation, const char *folder);

#endif
