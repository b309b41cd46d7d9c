/* What authors write who know other languages, and what Lua has instead. */
#ifndef REFDYN_GEN_SLIPS_H
#define REFDYN_GEN_SLIPS_H

/* What to write instead, to stand after the message of Lua `text`; "": nothing comes to mind. */
const char *slips_advice(const char *text);

#endif
