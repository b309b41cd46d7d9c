/*
 * What every file of the runtime includes before anything else: the check of its arithmetic, the layout of
 * arrays in one piece of memory, checks of models and workspaces.
 */
#ifndef REFDYN_CORE_H
#define REFDYN_CORE_H

#include "runtime/core/base/arithmetic.h"

#include <stddef.h>
#include <stdint.h>

#include "refdyn.h"

/* A function that the compiler puts into each of its callers. */
#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

/* ---- Layout of arrays in one piece of memory. The same calls first count bytes, then hand out arrays ----
 */

struct layout {
    char *base;  /* NULL: only count */
    size_t used; /* bytes; SIZE_MAX: more than a size_t can count */
};

/* The next array of `count` doubles or ints; NULL while counting. Ints fill whole doubles, so that both stay
 * aligned. */
static inline double *layout_doubles(struct layout *layout, int count) {
    double *array = layout->base ? (double *)(void *)(layout->base + layout->used) : NULL;
    const size_t left = (SIZE_MAX - layout->used) / sizeof(double), wanted = (size_t)count;
    layout->used = wanted > left ? SIZE_MAX : layout->used + wanted * sizeof(double);
    return array;
}

static inline int *layout_ints(struct layout *layout, int count) {
    const int per_double = (int)(sizeof(double) / sizeof(int));
    return (int *)(void *)layout_doubles(layout, count / per_double + (count % per_double != 0));
}

/* Errors: BAD_MEMORY, MEMORY_TOO_SMALL. */
static inline int layout_status(const void *memory, size_t size, size_t needed) {
    if (!memory || (uintptr_t)memory % sizeof(double) != 0)
        return REFDYN_BAD_MEMORY;
    return needed < SIZE_MAX && size >= needed ? REFDYN_OK : REFDYN_MEMORY_TOO_SMALL;
}

/* ---- Models and workspaces ---- */

/* Whether there is a model and it has this version. In other versions only interface_version may be read. */
static inline int refdyn_model_is_readable(const struct refdyn_model *model) {
    return model && model->interface_version == REFDYN_MODEL_VERSION;
}

/* Whether a model may be used. Errors: BAD_MODEL, OTHER_VERSION; for a workspace's model also BAD_MEMORY,
 * when the arrays have not been laid out. */
int refdyn_model_status(const struct refdyn_model *model);
int refdyn_workspace_status(const struct refdyn_workspace *work);

/* The value of `seal` in a struct that its initialisation has seen; other memory has it by chance only. */
#define REFDYN_SEAL 0x52454644594e2e31ULL

/* Returns whether refdyn_workspace_init has succeeded. Unlike refdyn_workspace_status it reads no table, so
 * that functions of the inner loop can afford it. */
static inline int refdyn_is_laid_out(const struct refdyn_workspace *work) {
    return work && work->seal == REFDYN_SEAL && work->equations;
}

/* The status of a call whose workspace is not laid out, or that lacks an array. */
static inline int refdyn_missing_status(const struct refdyn_workspace *work) {
    const int status = refdyn_workspace_status(work);
    return status ? status : REFDYN_BAD_MEMORY;
}
/* Whether two tables are compilations of one model: the same name, hash, sizes and functions. */
int refdyn_models_agree(const struct refdyn_model *model, const struct refdyn_model *other);
/* Number of doubles in the result of `required`. */
int refdyn_required_count(const struct refdyn_model *model);

static inline int refdyn_is_state(const struct refdyn_model *model, int j) {
    return model->parent && model->parent[j] == REFDYN_STATE;
}

/* Place in p of the parameter that says whether the contact of event i rests. */
static inline int refdyn_contact_mode_place(const struct refdyn_model *model, int i) {
    return model->changes[model->events[i].first_change].place;
}
/* Returns whether coordinate j is the angle of a joint. */
int refdyn_is_turn(const struct refdyn_model *model, int j);
/* The change of coordinate j that counts as much as 1 rad: 1 for a rotation; for a translation `length`, or
 * the model's length where that is 0 [m]; for a state the scale of its value. */
double refdyn_coordinate_unit(const struct refdyn_model *model, int j, double length);

#endif
