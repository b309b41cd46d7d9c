/* Forms that authors write out of habit from other languages, and what Lua has instead. */
#ifndef REFDYN_GEN_SLIPS_H
#define REFDYN_GEN_SLIPS_H

/* What to write instead, to follow Lua's message `text`; "": there is no advice. */
const char *slips_advice(const char *text);

#endif
