/* Complaints about cases: see sweeps.h. */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>

void case_messages_print(struct messages *messages) {
    message_sort(messages);
    for (int i = 0; i < messages->count; i++)
        complain_line(messages->list[i].place.file, messages->list[i].place.line, messages->list[i].text);
}

const char *case_folder(struct memory *memory, const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? memory_format(memory, "%.*s", (int)(slash + 1 - path), path) : "";
}
