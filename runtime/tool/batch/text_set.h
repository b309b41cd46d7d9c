/* Different texts, numbered in the order in which they came. */
#ifndef REFDYN_TOOL_TEXT_SET_H
#define REFDYN_TOOL_TEXT_SET_H

struct memory;

struct text_set {
    struct memory *memory; /* of the texts; set by the user, all else 0 */
    const char **texts;    /* (count) */
    int count, room;
    int *places; /* (place_count) a hash table: number of a text plus one, 0: free */
    int place_count;
};

/* The number of the text, of which the set keeps a copy. */
int text_set_add(struct text_set *set, const char *text);

#endif
