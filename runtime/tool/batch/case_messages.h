/* Complaints about cases on stderr, and the folder that files of theirs are named from. */
#ifndef REFDYN_TOOL_CASE_MESSAGES_H
#define REFDYN_TOOL_CASE_MESSAGES_H

#include "base/memory.h"
#include "base/message.h"

/* FILE:LINE: text, by line. */
void case_messages_print(struct messages *messages);
/* The folder of a file with / at its end, "" for the present one. */
const char *case_folder(struct memory *memory, const char *path);

#endif
