/* The place of an element's value in an array, as C text: "4 + 3 * e". Declared in emit.h. */
#include "gen/emit/emit.h"

void emit_run_index(struct text *text, int first, int stride) {
    if (first)
        text_add(text, "%d + ", first);
    if (stride > 1)
        text_add(text, "%d * ", stride);
    text_add(text, "e");
}
