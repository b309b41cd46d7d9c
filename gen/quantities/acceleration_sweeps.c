/*
 * Derivatives of accelerations by q and qd as sweeps over the tree of joints (theory, sect. 7.7).
 *
 * Input: the motion at the accelerations of the equations of motion, and the applied forces. Output: the
 * arrays and the loop (plan.h) of a function. A column costs O(n); neither the mass matrix nor derivatives
 * of the equations of motion are computed.
 */
#include "gen/quantities/quantities.h"

#include <stddef.h>
#include <string.h>

/* The first frame of the stage of each frame. */
static int *first_frames(struct derivation *d, const struct elimination *elimination) {
    int *firsts = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *firsts);
    for (int i = 0; i < d->frames; i++)
        for (int j = elimination->stages[i].first; elimination->ends_stage[i] && j <= i; j++)
            firsts[j] = elimination->stages[i].first;
    return firsts;
}

/* Returns whether turns that share strains are eliminated together. */
static bool strains_are_stages(struct derivation *d) {
    const struct elimination *elimination = accelerations_elimination(d);
    const int *firsts = first_frames(d, elimination);
    for (int i = 0; i < d->frames; i++)
        if (d->kinematics.tree->frames[i].has_strains &&
            firsts[i] != element_strains_first(&d->kinematics, i))
            return false;
    return true;
}

/* Returns whether no force or torque acts on a body between turns that are eliminated together. */
static bool loads_are_on_stages(struct derivation *d, const struct applied_forces *applied) {
    const struct elimination *elimination = accelerations_elimination(d);
    const struct tree *tree = d->kinematics.tree;
    for (int p = 0; p < d->model->marker_count; p++)
        if (tree->points[p].frame >= 0 && !articulated_body_takes_load(elimination, tree->points[p].frame) &&
            !(vector_is_zero(applied->points[p]) && vector_is_zero(applied->torques[p])))
            return false;
    return true;
}

bool acceleration_sweeps_fit(struct derivation *d, const struct applied_forces *applied) {
    return !derivation_has_massless_joint(d) && strains_are_stages(d) && loads_are_on_stages(d, applied);
}

/* ---- Arrays ---- */

struct writer {
    struct builder *b;
    const struct acceleration_columns *columns;
    const struct elimination *elimination;
    const int *firsts;
};

/* Three arrays of one member of the columns. */
static struct vector_arrays add_arrays(const struct writer *w, const char *name, size_t offset) {
    const struct derivation *d = w->b->d;
    struct vector *member = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *member);
    for (int i = 0; i < d->frames; i++)
        memcpy(&member[i], (const char *)&w->columns[i] + offset, sizeof *member);
    return pair_loops_add_arrays(&w->b->arrays, name, member);
}

static const struct vector_arrays no_arrays = {{NOTHING, NOTHING, NOTHING}};

/* The rows of each stage for the columns of the joints at this stage are straight-line values. */
static void set_own_entries(const struct writer *w, int array, int order) {
    const struct derivation *d = w->b->d;
    const struct tree *tree = d->kinematics.tree;
    for (int i = 0; i < d->frames; i++)
        for (int j = w->firsts[i]; w->elimination->ends_stage[i] && j <= i; j++)
            for (int row = w->firsts[i]; row <= i; row++)
                plan_set_frame(d->memory, tree, w->b->f, array,
                               tree->frames[row].coordinate * d->n + tree->frames[j].coordinate,
                               tree->frames[j].step * (d->n + 1), j,
                               w->columns[j].by[order].own.at[row - w->firsts[i]]);
}

static struct sweep_column add_column(const struct writer *w, int array, int order) {
    struct memory *memory = w->b->d->memory;
    const char *by = order ? "qd" : "q";
    const size_t from = offsetof(struct acceleration_columns, by) + (size_t)order * sizeof w->columns->by[0];
    struct sweep_column column = {.array = array, .turned = no_arrays};
    column.spin = add_arrays(w, memory_format(memory, "%s_spin", by),
                             from + offsetof(struct acceleration_column, spin));
    column.push_moment = add_arrays(w, memory_format(memory, "%s_push_moment", by),
                                    from + offsetof(struct acceleration_column, push_moment));
    column.push_force = add_arrays(w, memory_format(memory, "%s_push_force", by),
                                   from + offsetof(struct acceleration_column, push_force));
    column.start_angular = add_arrays(w, memory_format(memory, "%s_start_angular", by),
                                      from + offsetof(struct acceleration_column, start_angular));
    column.start_linear = add_arrays(w, memory_format(memory, "%s_start_linear", by),
                                     from + offsetof(struct acceleration_column, start_linear));
    set_own_entries(w, array, order);
    return column;
}

static struct vector_arrays add_swings(const struct writer *w) {
    const struct derivation *d = w->b->d;
    struct vector *swings = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *swings);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        swings[i] = vector_scale(d->g, expr_number(d->g, 2), w->b->given->frames[i].way_rate);
    return pair_loops_add_arrays(&w->b->arrays, "swing", swings);
}

/* ---- Branches ---- */

/* The position of the joint that carries the one at position i. */
static int parent_of(const struct pair_arrays *arrays, int i) {
    const int parent = arrays->plan->tree->frames[arrays->order[i]].parent;
    return parent < 0 ? NOTHING : arrays->position[parent];
}

static void find_branches(const struct pair_arrays *arrays, struct sweeps *s) {
    const size_t n = (size_t)s->n + 1;
    const int *end = arrays->end;
    int *level =
        memory_get(arrays->memory, n * sizeof *level); /* by position: of a branch that begins there */
    int *starts = memory_get(arrays->memory, n * sizeof *starts);
    int *opened = memory_get(arrays->memory, n * sizeof *opened);
    int *levels = memory_get(arrays->memory, n * sizeof *levels);
    int *units = memory_get(arrays->memory, n * sizeof *units), b = 0;
    int *body = memory_get(arrays->memory, n * sizeof *body);
    for (int i = 0; i < s->n; i++) {
        const int parent = parent_of(arrays, i);
        level[i] = parent < 0 ? 0 : level[parent];
        if (parent < 0 || end[parent + 1] == end[parent])
            continue;
        const bool is_last = end[i] == end[parent];
        if (i == parent + 1)
            body[parent] = s->body_count++;
        starts[b] = i;
        opened[b] = parent + 1;
        levels[b] = level[parent];
        units[b++] = is_last ? -1 : UNIT_WRENCHES * body[parent];
        level[i] += !is_last;
        s->levels = level[i] > s->levels ? level[i] : s->levels;
    }
    starts[b] = s->n;
    s->branches = (struct sweep_branches){b, starts, opened, levels, units};
}

/* The position of the joint with whose body a frame moves. */
static int position_of(const struct pair_arrays *arrays, const struct frame *frame) {
    const struct tree *tree = arrays->k->tree;
    if (frame->kind == FRAME_JOINT)
        return arrays->position[frame->coordinate];
    const struct element_run *run = &tree->runs[frame->run];
    return arrays->position[run->first + run->count * run->period - 1];
}

/* The place of the unit wrenches on the body at a position. */
static int units_at(const struct sweeps *s, int position) {
    int b = 0;
    while (s->branches.starts[b] != position + 1)
        b++;
    return s->branches.units[b];
}

/* One component of the responses of all bodies with several branches to unit wrenches. */
static int add_unit_axis(const struct writer *w, const struct sweeps *s, bool is_angular, int axis) {
    struct builder *b = w->b;
    const struct tree *tree = b->d->kinematics.tree;
    const char *name =
        memory_format(b->d->memory, "unit_%s_%c", is_angular ? "angular" : "linear", "xyz"[axis]);
    const int array = pair_loops_add_local(b->d->memory, b->f, name, UNIT_WRENCHES * s->body_count, 0);
    bool is_zero = true;
    for (int i = 0; i < tree->count; i++) {
        if (!acceleration_columns_branch(tree, i))
            continue;
        const int units = units_at(s, position_of(&b->arrays, &tree->frames[i]));
        for (int unit = 0; unit < UNIT_WRENCHES; unit++) {
            const struct wrench *response = &w->columns[i].units[unit];
            const expression value = (is_angular ? response->moment : response->force).at[axis];
            plan_set_entry(b->d->memory, b->f, array, units + unit, value);
            is_zero = is_zero && !value;
        }
    }
    return is_zero ? NOTHING : array;
}

static struct vector_arrays add_units(const struct writer *w, const struct sweeps *s, bool is_angular) {
    struct vector_arrays units = no_arrays;
    for (int axis = 0; axis < 3 && s->body_count; axis++)
        units.at[axis] = add_unit_axis(w, s, is_angular, axis);
    return units;
}

/* ---- The loop ---- */

static void mark_stages(const struct writer *w, int *kind) {
    const struct derivation *d = w->b->d;
    const struct tree *tree = d->kinematics.tree;
    for (int i = 0; i < d->frames; i++) {
        const struct frame *frame = &tree->frames[i];
        const int elements = frame->kind != FRAME_JOINT ? 0
                             : frame->run < 0           ? 1
                                                        : tree->runs[frame->run].count;
        const int first = w->firsts[i];
        const bool is_ball = elements && first + 2 < d->frames && w->elimination->ends_stage[first + 2] &&
                             w->elimination->stages[first + 2].first == first;
        for (int e = 0; e < elements; e++)
            kind[w->b->arrays.position[frame->coordinate + e * frame->step]] =
                is_ball ? (i == first ? STAGE_BALL : STAGE_PART)
                        : (frame->joint.is_revolute ? STAGE_TURN : STAGE_SLIDE);
    }
}

static void add_loop(const struct writer *w, const int arrays[2]) {
    struct builder *b = w->b;
    const int n = b->d->n;
    struct sweeps s = {.n = n, .order = b->arrays.order, .moves_on = b->arrays.moves_on};
    int *root = memory_get(b->d->memory, ((size_t)n + 1) * sizeof *root);
    int *kind = memory_get(b->d->memory, ((size_t)n + 1) * sizeof *kind);
    for (int i = 1; i < n; i++)
        root[i] = i < b->arrays.end[root[i - 1]] ? root[i - 1] : i;
    mark_stages(w, kind);
    s.root = root;
    s.kind = kind;
    find_branches(&b->arrays, &s);
    s.turn = add_arrays(w, "turn", offsetof(struct acceleration_columns, turn));
    s.shift = pair_loops_add_arrays(&b->arrays, "shift", b->shifts);
    s.swing = add_swings(w);
    s.hold_moment = add_arrays(w, "hold_moment", offsetof(struct acceleration_columns, hold_moment));
    s.hold_force = add_arrays(w, "hold_force", offsetof(struct acceleration_columns, hold_force));
    s.hold_spin = add_arrays(w, "hold_spin", offsetof(struct acceleration_columns, hold_spin));
    s.hold_turned = add_arrays(w, "hold_turned", offsetof(struct acceleration_columns, hold_turned));
    s.start_angular = add_arrays(w, "start_angular", offsetof(struct acceleration_columns, start_angular));
    s.start_linear = add_arrays(w, "start_linear", offsetof(struct acceleration_columns, start_linear));
    s.unit_angular = add_units(w, &s, true);
    s.unit_linear = add_units(w, &s, false);
    for (int order = 0; order < 2; order++)
        if (arrays[order] != NOTHING)
            s.columns[s.column_count++] = add_column(w, arrays[order], order);
    if (arrays[0] != NOTHING &&
        (s.hold_turned.at[0] != NOTHING || s.hold_turned.at[1] != NOTHING || s.hold_turned.at[2] != NOTHING))
        s.columns[0].turned = add_arrays(w, "turned", offsetof(struct acceleration_columns, turned));
    pair_loops_add_loop(b->d->memory, b->f, LOOP_SWEEPS, "columns of d(qdd) (7.7), from the ground")
        ->of.sweeps = s;
}

void acceleration_sweeps_add(struct builder *b, int by_q, int by_qd) {
    struct derivation *d = b->d;
    const int arrays[2] = {by_q, by_qd};
    if (by_q == NOTHING && by_qd == NOTHING)
        return;
    struct writer w = {.b = b, .elimination = accelerations_elimination(d)};
    w.firsts = first_frames(d, w.elimination);
    struct vector *const own[2] = {force_derivatives_of_stages(b, w.firsts, 0, -1),
                                   force_derivatives_of_stages(b, w.firsts, 1, -1)};
    w.columns = acceleration_columns_derive(b->given, w.elimination, b->applied_forces, own);
    b->shifts = kinematics_ground_shifts(&d->kinematics);
    b->arrays = pair_loops_open_sweeps(d->plan, &d->kinematics, b->f, b->shifts);
    add_loop(&w, arrays);
    force_derivatives_add_coupled_accelerations(b, &(struct targets){by_q, by_qd, NOTHING, false, -1});
}
