/* Complaints about cases: see sweeps.h. */
#include "runtime/tool/batches/sweeps/sweeps.h"
#include "runtime/tool/support/format/format.h"
#include "gen/base/base.h"

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

/* ---- Sets of texts ---- */

/* Where the text stands, or would. */
static int *place_of(const struct text_set *set, const char *text) {
    int place = (int)(random_stream(text) % (uint64_t)set->place_count);
    while (set->places[place] && strcmp(set->texts[set->places[place] - 1], text) != 0)
        place = (place + 1) % set->place_count;
    return &set->places[place];
}

/* Room for twice as many places; texts are put in anew. */
static void grow(struct text_set *set) {
    set->place_count = set->place_count ? 2 * set->place_count : 64;
    set->places = memory_get(set->memory, (size_t)set->place_count * sizeof *set->places);
    for (int i = 0; i < set->count; i++)
        *place_of(set, set->texts[i]) = i + 1;
}

int text_set_add(struct text_set *set, const char *text) {
    if (2 * set->count >= set->place_count)
        grow(set);
    int *place = place_of(set, text);
    if (*place)
        return *place - 1;
    set->texts = memory_room(set->memory, set->texts, set->count, &set->room, sizeof *set->texts);
    set->texts[set->count++] = memory_text(set->memory, text);
    *place = set->count;
    return set->count - 1;
}
