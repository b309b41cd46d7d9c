/*
 * What a model's Lua has done so far, counted in steps of Lua and not in seconds, so that a model is read or
 * refused the same way on each machine.
 *
 * Takes what happened: steps, calls, memory taken, names looked through. A step may compare, convert or hash
 * a text as long as the longest so far, which is slow where texts hold bytes 0, and may take a remainder,
 * which is slow for distant numbers; it is counted as what it then may cost. Library functions that do more
 * than one pass over their arguments are counted by what they may do at most.
 */
#ifndef REFDYN_GEN_WORK_LIMITS_H
#define REFDYN_GEN_WORK_LIMITS_H

#include <stdbool.h>
#include <stddef.h>

enum { WORK_MILLIONS = 100 }; /* of steps that a file may take while it is read */

struct work {
    double steps;
    int millions;        /* of steps that it may take: WORK_MILLIONS, or more for what comes behind reading */
    size_t longest_text; /* bytes */
    bool has_remainders; /* a source contains the operator % */
    bool has_zeros;      /* a text may hold bytes 0: Lua orders such texts piece by piece */
};

void work_add(struct work *work, double steps);
void work_add_steps(struct work *work, int count);
/* A call of a function, or its return, with `count` arguments or results. */
void work_add_call(struct work *work, int count);
void work_add_memory(struct work *work, size_t bytes);
void work_add_text(struct work *work, size_t length);
/* A text that a library function gave. */
void work_note_zeros(struct work *work, const char *text, size_t length);
bool work_is_over(const struct work *work);

/* A source that will be compiled, before that. */
void work_add_source(struct work *work, const char *source, size_t length);

/* Steps that the search for a pattern in a text of `length` bytes may take. */
double work_pattern_steps(size_t length, const char *pattern, size_t pattern_length);
/* The same for a text that is searched as it is. */
double work_search_steps(size_t length, size_t searched);

#endif
