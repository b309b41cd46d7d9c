/*
 * Bytes of local arrays of emitted functions, for callers with a small stack. Input: the text of a function
 * and of the functions that it calls. The header and the summary print the result.
 *
 * The count reads the text, in which each declaration has a line of its own: `double NAME[COUNT], ...;`.
 * Values that one piece of a long function passes to the next are members of a local struct and look the
 * same.
 */
#include "gen/emit/emit.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Numbers declared by a line "name[count], name;"; 0 for a line that also assigns a value. */
static long declared_numbers(const char *line, const char *end) {
    long numbers = 0;
    if (memchr(line, '=', (size_t)(end - line)))
        return 0;
    while (line < end) {
        const size_t length = strcspn(line, ",;[");
        numbers += line[length] == '[' ? strtol(line + length + 1, NULL, 10) : 1;
        line += strcspn(line, ",;") + 1;
    }
    return numbers;
}

long local_arrays_count_bytes(const char *text) {
    static const char type[] = "double ";
    long numbers = 0;
    for (const char *end; (end = strchr(text, '\n')); text = end + 1) {
        while (isblank((unsigned char)*text))
            text++;
        if (!strncmp(text, type, sizeof type - 1) && end[-1] == ';')
            numbers += declared_numbers(text + sizeof type - 1, end);
    }
    return numbers * (long)sizeof(double);
}

/* Bytes of a function and all that it calls; a result from which a part is copied is a local array, too. */
long local_arrays_bytes(const struct emission *x, const struct function *function) {
    long bytes = x->own_bytes[function - x->plan->functions];
    for (int i = 0; i < function->part_count; i++) {
        const struct function *from = function->parts[i].from;
        if (i > 0 && function->parts[i - 1].from == from)
            continue;
        bytes += local_arrays_bytes(x, from);
        if (plan_is_struct_result(from))
            bytes += from->out_count * (long)sizeof(double);
    }
    return bytes;
}
