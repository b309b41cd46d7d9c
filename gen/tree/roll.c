/*
 * Finds runs of equal elements, and builds the rolled tree, in which one element replaces each run.
 *
 * Input: the tree. Output: the rolled tree, from which everything is derived. It has the frames that are in
 * no run, and for each run an ENTRY frame, the frames of one element, and an EXIT frame. The ENTRY is fixed
 * to the run's carrier, displaced so that all elements, the first included, are placed alike. The last
 * element may have another inertia (a beam ends with half an element). The EXIT is the last element's last
 * frame, which carries the following frames. Derivations visit the element once, in a loop, for any count.
 * Theory, sect. 4.13.
 */
#include "gen/tree/tree.h"
#include "gen/base/base.h"

#include <assert.h>
#include <limits.h>
#include <string.h>

enum {
    LONGEST_PERIOD = 12, /* frames of one element */
    LEAST_SAVED =
        3 /* frames that a loop saves at least: with fewer, it is no faster than straight-line code */
};

struct rolling {
    struct memory *memory;
    const struct model *model;
    const struct tree *tree;
    struct tree *rolled;
    int least;      /* frames that a run must save */
    bool *is_named; /* by frame of the tree: a point or one of the author's formulas uses it */
    int *children;  /* by frame */
    int *image;     /* by frame: its frame in the rolled tree, or the EXIT of the run that ends with it */
};

/* ---- Frames that the author's formulas use ---- */

static void mark_load(bool *marks, const struct load *load) {
    for (int a = 0; a < 3; a++)
        marks[load->value[a]] = true;
}

static void mark_formulas(const struct model *model, bool *marks) {
    for (int i = 0; i < model->force_count; i++)
        marks[model->forces[i].value] = true;
    for (int i = 0; i < model->load_count; i++)
        mark_load(marks, &model->loads[i]);
    for (int i = 0; i < model->potential_count; i++)
        marks[model->potentials[i].energy] = true;
    for (int i = 0; i < model->course_count; i++)
        marks[model->courses[i].value] = true;
    for (int i = 0; i < model->row_count; i++)
        marks[model->rows[i].residual] = marks[model->rows[i].rests] = marks[model->rows[i].alpha] =
            marks[model->rows[i].beta] = true;
    for (int i = 0; i < model->event_count; i++)
        marks[model->events[i].value] = marks[model->events[i].restitution] = true;
    for (int i = 0; i < model->kink_count; i++)
        marks[model->kinks[i]] = true;
    for (int i = 0; i < model->change_count; i++)
        marks[model->changes[i].value] = true;
    for (int i = 0; i < model->parameter_count; i++)
        marks[model->parameters[i].anchor] = true;
}

static void find_named(struct rolling *x) {
    const struct graph *g = x->model->graph;
    bool *marks = memory_get(x->memory, g->count * sizeof *marks);
    mark_formulas(x->model, marks);
    rewrite_mark_operands(g, marks, g->count);
    for (expression e = g->count; e-- > 0;) {
        const struct symbol *s = marks[e] ? expr_as_symbol(g, e) : NULL;
        if (s && s->kind == SYMBOL_START)
            marks[s->index] = true; /* coordinates exist before values at the start of a motion */
        else if (s && s->kind == SYMBOL_COORDINATE)
            x->is_named[s->index] = true;
    }
    for (int i = 0; i < x->model->force_count; i++)
        x->is_named[x->model->forces[i].coordinate] = true;
    for (int i = 0; i < x->model->change_count; i++)
        if (x->model->changes[i].what == CHANGED_RATE)
            x->is_named[x->model->changes[i].index] = true;
    for (int i = 0; i < x->model->marker_count; i++)
        if (x->tree->points[i].frame >= 0)
            x->is_named[x->tree->points[i].frame] = true;
}

/* ---- Where elements are equal ---- */

static bool same_joint(const struct joint *a, const struct joint *b) {
    return a->is_revolute == b->is_revolute && a->axis == b->axis && a->stiffness == b->stiffness &&
           a->rest == b->rest && a->damping == b->damping && a->rotor == b->rotor && a->start == b->start &&
           a->start_rate == b->start_rate;
}

/* Returns whether entries of a are zero wherever entries of b are. */
static bool is_within(const struct inertia *a, const struct inertia *b) {
    bool within = !a->mass || b->mass;
    for (int i = 0; i < 6; i++)
        within =
            within && (!a->tensor.at[i] || b->tensor.at[i]) && (!a->moment.at[i / 2] || b->moment.at[i / 2]);
    return within;
}

static bool same_inertia(const struct inertia *a, const struct inertia *b, bool is_last) {
    return is_last ? is_within(a, b) : !memcmp(a, b, sizeof *a);
}

/* Returns whether the frames are equal except for inertia and, for the first frame of the first element,
 * its place. */
static bool same_but_inertia(const struct frame *a, const struct frame *b, bool any_place) {
    return same_joint(&a->joint, &b->joint) && a->has_strains == b->has_strains && a->turn == b->turn &&
           !memcmp(a->placement.rotation, b->placement.rotation, sizeof a->placement.rotation) &&
           (any_place || !memcmp(a->placement.position, b->placement.position, sizeof a->placement.position));
}

/* Returns whether frame i is carried by the frame before it, which carries nothing else. */
static bool continues_chain(const struct rolling *x, int i) {
    return x->tree->frames[i].parent == i - 1 && x->children[i - 1] == 1;
}

/* Returns whether the element that begins at `at` equals the one before it; the last one may have another
 * inertia. */
static bool repeats(const struct rolling *x, int first, int at, int period, bool is_last) {
    const struct frame *frames = x->tree->frames;
    if (at + period > x->tree->count)
        return false;
    for (int k = 0; k < period; k++)
        if (!continues_chain(x, at + k) || x->is_named[at + k] ||
            !same_but_inertia(&frames[at + k], &frames[at + k - period], at - period == first && k == 0) ||
            !same_inertia(&frames[at + k].inertia, &frames[at + k - period].inertia, is_last))
            return false;
    return true;
}

/* Number of equal elements of `period` frames from frame `first` on. */
static int count_elements(const struct rolling *x, int first, int period) {
    int count = 1;
    if (x->tree->frames[first].turn > 0)
        return 0; /* turns that share strains stay together */
    for (int k = 0; k < period; k++)
        if (first + k >= x->tree->count || x->is_named[first + k] || (k && !continues_chain(x, first + k)))
            return 0;
    while (repeats(x, first, first + count * period, period, false))
        count++;
    count += count > 1 && repeats(x, first, first + count * period, period, true);
    return count;
}

/* The run that begins at frame `first` and contains most frames; count 0: there is none. */
static struct element_run find_run(const struct rolling *x, int first) {
    struct element_run best = {.first = first};
    for (int period = 1; period <= LONGEST_PERIOD; period++) {
        const int count = count_elements(x, first, period);
        if (count > 1 && (count - 1) * period >= x->least && count * period > best.count * best.period)
            best = (struct element_run){NULL, first, period, count, NULL};
    }
    return best;
}

/* ---- The rolled tree ---- */

static struct frame *append(struct rolling *x, const struct frame *frame) {
    struct frame *copy = &x->rolled->frames[x->rolled->count++];
    *copy = *frame;
    return copy;
}

static int image_of_parent(const struct rolling *x, int frame) {
    const int parent = x->tree->frames[frame].parent;
    assert(parent < 0 || x->image[parent] >= 0); /* only the last frame of a run carries other frames */
    return parent < 0 ? -1 : x->image[parent];
}

static void append_single(struct rolling *x, int i) {
    struct frame *copy = append(x, &x->tree->frames[i]);
    copy->parent = image_of_parent(x, i);
    x->image[i] = x->rolled->frame_of[i] = x->rolled->count - 1;
}

/* "arm_psi_1" -> "arm_psi_e": e counts the elements in the emitted loops. */
static const char *name_in_run(const struct rolling *x, const char *name) {
    size_t length = strlen(name);
    while (length > 0 && name[length - 1] >= '0' && name[length - 1] <= '9')
        length--;
    return memory_format(x->memory, "%.*s%se", (int)length, name,
                         length && name[length - 1] == '_' ? "" : "_");
}

/* The placement of the ENTRY in the run's carrier: the placement of the first element without the common
 * placement. */
static struct placement entry_placement(const struct rolling *x, const struct element_run *run) {
    static const char *const axes[3] = {"entry_x", "entry_y", "entry_z"};
    struct graph *g = x->model->graph;
    const struct placement *first = &x->tree->frames[run->first].placement;
    const struct placement *others = &x->tree->frames[run->first + run->period].placement;
    struct placement entry = placement_identity();
    for (int a = 0; a < 3; a++) {
        entry.position[a] = expr_sub(g, first->position[a], others->position[a]);
        graph_name_shared(g, entry.position[a], run->name, axes[a]);
    }
    return entry;
}

/* The inertia of the last element if it differs from the first one's. */
static const struct inertia *last_inertia(const struct rolling *x, const struct element_run *run) {
    const struct frame *first = &x->tree->frames[run->first];
    const struct frame *last = first + (run->count - 1) * run->period;
    struct inertia *inertia = memory_get(x->memory, (size_t)run->period * sizeof *inertia);
    bool differs = false;
    for (int k = 0; k < run->period; k++) {
        inertia[k] = last[k].inertia;
        differs |= memcmp(&first[k].inertia, &last[k].inertia, sizeof *inertia) != 0;
    }
    return differs ? inertia : NULL;
}

static void append_run(struct rolling *x, struct element_run run) {
    assert(run.count > 1 && run.first + run.count * run.period <= x->tree->count);
    struct tree *rolled = x->rolled;
    const int index = rolled->run_count, entry = rolled->count, exit = entry + run.period + 1;
    const struct frame *elements = &x->tree->frames[run.first];
    run.name = name_in_run(x, elements->name);
    run.last = last_inertia(x, &run);
    rolled->runs[rolled->run_count++] = run;
    append(x, &(struct frame){.name = run.name,
                              .parent = image_of_parent(x, run.first),
                              .kind = FRAME_ENTRY,
                              .run = index,
                              .partner = exit,
                              .placement = entry_placement(x, &run)});
    for (int k = 0; k < run.period; k++) {
        struct frame *frame = append(x, &elements[k]);
        frame->parent = entry + k;
        frame->run = index;
        frame->step = run.period;
        frame->name = name_in_run(x, elements[k].name);
        frame->placement = elements[run.period + k].placement;
    }
    append(x, &(struct frame){.name = run.name,
                              .parent = exit - 1,
                              .kind = FRAME_EXIT,
                              .run = index,
                              .partner = entry,
                              .placement = placement_identity()});
    x->image[run.first + run.count * run.period - 1] = exit;
}

static void place_rolled_points(struct rolling *x) {
    const int count = x->model->marker_count;
    x->rolled->points = memory_get(x->memory, ((size_t)count + 1) * sizeof *x->rolled->points);
    for (int i = 0; i < count; i++) {
        x->rolled->points[i] = x->tree->points[i];
        if (x->tree->points[i].frame >= 0)
            x->rolled->points[i].frame = x->image[x->tree->points[i].frame];
    }
}

static void count_children(struct rolling *x) {
    for (int i = 0; i < x->tree->count; i++)
        if (x->tree->frames[i].parent >= 0)
            x->children[x->tree->frames[i].parent]++;
}

void roll_tree(struct memory *memory, const struct model *model, const struct tree *tree, enum loops loops,
               struct tree *rolled) {
    static const int least[] = {[LOOPS_AUTO] = LEAST_SAVED, [LOOPS_ALWAYS] = 1, [LOOPS_NEVER] = INT_MAX};
    _Static_assert(sizeof least / sizeof *least == LOOPS_NEVER + 1, "each choice has its least saving");
    const size_t n = (size_t)tree->count + 1;
    struct rolling x = {
        .memory = memory, .model = model, .tree = tree, .rolled = rolled, .least = least[loops]};
    *rolled = (struct tree){.frames = memory_get(memory, 3 * n * sizeof *rolled->frames),
                            .runs = memory_get(memory, n * sizeof *rolled->runs)};
    x.is_named = memory_get(memory, n * sizeof *x.is_named);
    x.children = memory_get(memory, n * sizeof *x.children);
    x.image = memory_get(memory, n * sizeof *x.image);
    rolled->frame_of = memory_get(memory, n * sizeof *rolled->frame_of);
    for (int i = 0; i < tree->count; i++)
        x.image[i] = rolled->frame_of[i] = -1;
    count_children(&x);
    find_named(&x);
    for (int i = 0; i < tree->count;) {
        const struct element_run run = find_run(&x, i);
        if (run.count)
            append_run(&x, run);
        else
            append_single(&x, i);
        i += run.count ? run.count * run.period : 1;
    }
    place_rolled_points(&x);
}
