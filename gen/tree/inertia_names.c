/*
 * Names of inertias among the derived parameters of the emitted C.
 *
 * Input: the expanded tree. Equal values are one value, so that its name must be true for all bodies with
 * this inertia: the name of the frame, of the beam's elements, or "shared" for several links.
 */
#include "gen/base/base.h"
#include "gen/tree/tree.h"

/* The owners of an inertia's value, by handle. */
struct owners {
    const struct frame *first;
    int link;
    bool has_frames, has_links; /* more than one */
};

static void own(struct owners *of, int link, const struct frame *frame) {
    if (!of->first)
        *of = (struct owners){.first = frame, .link = link};
    of->has_frames |= of->first != frame;
    of->has_links |= of->link != link;
}

/* mass, moments and tensor, in the order of struct inertia */
enum { INERTIA_VALUES = sizeof(struct inertia) / sizeof(expression) };

static void own_inertia(struct owners *owners, int link, const struct frame *frame,
                        const struct inertia *inertia) {
    const expression *values = (const expression *)inertia;
    for (int i = 0; i < INERTIA_VALUES; i++)
        own(&owners[values[i]], link, frame);
}

/* "arm_psi" for one frame, "arm_element" or "arm_half_element" for several elements of one beam, "shared"
 * for several links. */
static const char *owner_name(const struct expansion *x, const struct owners *of) {
    const char *link = x->model->links[of->link].name;
    if (of->has_links)
        return "shared";
    if (!of->has_frames)
        return of->first->name;
    return memory_format(x->memory, "%s_%selement", link, of->first->element ? "" : "half_");
}

/* "arm_psi_mass", "arm_psi_moment_x", "arm_psi_inertia_xx" */
static void name_inertia(const struct expansion *x, const struct owners *owners,
                         const struct inertia *inertia) {
    static const char *const names[INERTIA_VALUES] = {"mass",       "moment_x",   "moment_y",   "moment_z",
                                                      "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy",
                                                      "inertia_xz", "inertia_yz"};
    const expression *values = (const expression *)inertia;
    for (int i = 0; i < INERTIA_VALUES; i++)
        graph_name_value(x->g, values[i],
                         memory_format(x->memory, "%s_%s", owner_name(x, &owners[values[i]]), names[i]));
}

void inertia_names_give(const struct expansion *x) {
    const struct tree *tree = x->tree;
    struct owners *owners = memory_get(x->memory, x->g->count * sizeof *owners);
    for (int i = 0; i < x->part_count; i++)
        own_inertia(owners, x->parts[i].link, &tree->frames[x->parts[i].frame], &x->parts[i].inertia);
    for (int i = 0; i < tree->count; i++)
        own_inertia(owners, tree->frames[i].link, &tree->frames[i], &tree->frames[i].inertia);
    for (int i = 0; i < tree->count; i++)
        name_inertia(x, owners, &tree->frames[i].inertia);
}
