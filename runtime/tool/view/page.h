/*
 * The page of `refdyn view`: one HTML file that needs no other and no network. In it are three.js as the
 * system has it, with its licence, our own style and scripts as they lie in page/, and the data.
 */
#ifndef REFDYN_TOOL_VIEW_PAGE_H
#define REFDYN_TOOL_VIEW_PAGE_H

#include <stdio.h>

/* The text of three.js; NULL, with a complaint that tells what to install. */
char *page_read_three(void);
/* The page with that title, `data` a JSON text. */
void page_put(FILE *out, const char *title, const char *three, const char *data);

#endif
