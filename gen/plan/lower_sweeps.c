/*
 * The form of SWEEPS (loops.h), the loop that computes derivatives of accelerations column by column.
 *
 * The loop visits the stages (joints, or three turns at one point) outward. For each coordinate j nearer to
 * the ground it carries the change of acceleration A that the column of j makes, and the acceleration z that
 * a unit force on j makes. A yields the entries of the stage's rows, z those of its columns, as a product
 * with the wrench that the stage passes on. Then the columns of the stage's own joints begin.
 *
 * If a body carries several branches, the loop keeps all A and z before the first branch and restores them
 * before each other branch. A unit moment or force along each axis acts on the body; the accelerations that
 * these six wrenches make are carried through every branch but the last, like z. They pass joint j of that
 * branch. The acceleration of joint j by each wrench is by reciprocity a component of z of the body for j.
 * The product with the wrench that joint j passes on is a component of A. Later branches begin with both.
 * The six belong to a level: 0, or one more than that of the body whose branch, not its last, they are in.
 *
 * The states of all columns are arrays, one for each component. Responses to unit wrenches have the places
 * before that of the first column: six for each level, level 0 nearest to the column. Columns of earlier
 * trees may be there, which are complete.
 */
#include "gen/plan/plan.h"

enum { BLOCK = 4 }; /* columns; with 8, short chains take longer */
/* Before a branch, the first KEPT_PARTS of each state are kept. */
enum { MOST_STATES = 3, KEPT_PARTS = 2, MOST_PARTS_OF_STATE = 4 };
enum { ANGULAR, LINEAR, SPIN, TURNED };

static const char axes[3] = "xyz";

/* ---- States ---- */

/* A state: the response to a unit force, or a column. */
struct state {
    const char *prefix;                /* of the names of its arrays */
    const struct sweep_column *column; /* NULL: the response */
    int part_count;
    const struct vector_arrays *start[MOST_PARTS_OF_STATE];
    struct vector_arrays at[MOST_PARTS_OF_STATE], kept[KEPT_PARTS];
    int rows[3], columns[3]; /* minus the accelerations of the stage's joints, and minus the entries of
                                its columns */
};

struct lowering {
    struct loop_form *form;
    const struct sweeps *s;
    struct state states[MOST_STATES];
    int state_count, places, size; /* places: before the first column; size: of an array of all columns */
    struct loop_index i, j, root, joints, kind; /* i: the position of the stage */
    struct loop_index first;                    /* the first place of a response */
};

static bool has_kind(const struct sweeps *s, int kind) {
    for (int i = 0; i < s->n; i++)
        if (s->kind[i] == kind)
            return true;
    return false;
}

/* The place of the column at a position. */
static struct loop_index place(const struct lowering *l, struct loop_index position) {
    return loop_plus_number(position, l->places);
}

/* Returns whether the accelerations of the stage's joints are kept for a state: those of the responses are
 * needed for the branches that follow. */
static bool has_rows(const struct lowering *l, const struct state *state) {
    return state->column || l->places;
}

static const char *title(const struct lowering *l, const char *before, const struct state *state,
                         const char *part) {
    return memory_format(l->form->memory, "%s%s_%s", before, state->prefix, part);
}

static struct vector_arrays declare_vector(const struct lowering *l, const char *name, const bool has[3],
                                           int size) {
    struct vector_arrays arrays;
    for (int a = 0; a < 3; a++)
        arrays.at[a] =
            !has[a]
                ? NOTHING
                : loop_declare_array(l->form, memory_format(l->form->memory, "%s_%c", name, axes[a]), size);
    return arrays;
}

static void declare_state(const struct lowering *l, struct state *state) {
    static const char *const names[] = {"angular", "linear", "spin", "turned"};
    const struct sweep_column *column = state->column;
    const struct sweep_state has = sweeps_state(l->s, column ? (int)(column - l->s->columns) : -1);
    const bool *const parts[] = {has.angular, has.linear, has.spin, has.turned};
    state->part_count = column ? MOST_PARTS_OF_STATE : KEPT_PARTS;
    state->start[ANGULAR] = column ? &column->start_angular : &l->s->start_angular;
    state->start[LINEAR] = column ? &column->start_linear : &l->s->start_linear;
    state->start[SPIN] = column ? &column->spin : NULL;
    state->start[TURNED] = column ? &column->turned : NULL;
    for (int p = 0; p < state->part_count; p++) {
        state->at[p] = declare_vector(l, title(l, "", state, names[p]), parts[p], l->size);
        if (p < KEPT_PARTS && l->places)
            state->kept[p] =
                declare_vector(l, title(l, "kept_", state, names[p]), parts[p], l->s->levels * l->size);
    }
    for (int r = 0; r < (has_kind(l->s, STAGE_BALL) ? 3 : 1); r++) {
        const char *row = memory_format(l->form->memory, "row_%d", r),
                   *entry = memory_format(l->form->memory, "column_%d", r);
        if (has_rows(l, state))
            state->rows[r] = loop_declare_array(l->form, title(l, "", state, row), l->size);
        if (column)
            state->columns[r] = loop_declare_array(l->form, title(l, "", state, entry), l->size);
    }
}

static void declare_states(struct lowering *l) {
    for (int k = 0; k < l->state_count; k++) {
        struct state *state = &l->states[k];
        state->column = k ? &l->s->columns[k - 1] : NULL;
        state->prefix =
            k ? memory_format(l->form->memory, "by_%s", l->form->function->arrays[state->column->array].name)
              : "response";
        declare_state(l, state);
    }
}

/* Sets one part of a state at a place, from the entries of arrays or to 0. */
static void set_part(const struct lowering *l, const struct vector_arrays *part, struct loop_index at,
                     const struct vector_arrays *from, struct loop_index from_at) {
    for (int a = 0; a < 3; a++) {
        struct loop_sum sum = {.count = 0};
        if (part->at[a] == NOTHING)
            continue;
        if (from && from->at[a] != NOTHING)
            loop_add_entry(&sum, 1, loop_entry(from->at[a], from_at));
        loop_assign(l->form, loop_entry(part->at[a], at), LOOP_SET, &sum);
    }
}

/* Columns that have not begun are 0. */
static void lower_zeros(const struct lowering *l) {
    struct loop_statement *loop = loop_open_range(l->form, "j", loop_number(0), loop_number(l->size));
    for (int k = 0; k < l->state_count; k++)
        for (int p = 0; p < l->states[k].part_count; p++)
            set_part(l, &l->states[k].at[p], l->j, NULL, l->j);
    loop_close(l->form, loop);
}

/* ---- One stage ---- */

/* A block may contain columns that have not begun or that belong to another tree; nothing reads these values.
 */
static struct loop_statement *open_columns(const struct lowering *l, bool is_response) {
    struct loop_statement *loop =
        loop_open_range(l->form, "j", is_response ? l->first : place(l, l->root), place(l, l->i));
    loop->blocks = BLOCKS_UP;
    loop->block = BLOCK;
    return loop;
}

/* Adds the dot product of a vector of position i + r and three values. */
static void add_dot(const struct lowering *l, struct loop_sum *sum, const char *name, int r,
                    const struct vector_arrays *arrays, const struct loop_entry values[3]) {
    for (int a = 0; a < 3; a++)
        if (arrays->at[a] != NOTHING && values[a].array != NOTHING)
            loop_add_product(sum, 1,
                             loop_constant(l->form,
                                           memory_format(l->form->memory, "%s_%d%c", name, r, axes[a]), 1,
                                           loop_entry(arrays->at[a], loop_plus_number(l->i, r))),
                             values[a]);
}

static void add_part(const struct lowering *l, struct loop_sum *sum, const char *name, int r,
                     const struct vector_arrays *arrays, const struct state *state, int part) {
    struct loop_entry values[3];
    for (int a = 0; a < 3; a++)
        values[a] = loop_entry(state->at[part].at[a], l->j);
    add_dot(l, sum, name, r, arrays, values);
}

/* Adds component a of part x vector, as one group. */
static void add_cross(const struct lowering *l, struct loop_sum *sum, const char *name,
                      const struct vector_arrays *arrays, const struct vector_arrays *part, int a) {
    sum->opens_group = true;
    for (int sign = 1; sign >= -1; sign -= 2) {
        const int b = (a + (sign > 0 ? 1 : 2)) % 3, c = 3 - a - b;
        if (part->at[b] != NOTHING && arrays->at[c] != NOTHING)
            loop_add_product(sum, sign, loop_entry(part->at[b], l->j),
                             loop_constant(l->form, memory_format(l->form->memory, "%s_0%c", name, axes[c]),
                                           1, loop_entry(arrays->at[c], l->i)));
    }
}

/* The linear accelerations of the stage's origin. */
static void lower_moves(const struct lowering *l) {
    struct loop_statement *condition =
        loop_open_if(l->form, loop_look_up(l->form, "moves_on", l->s->moves_on, l->s->n, l->i), LOOP_EQUAL,
                     loop_number(1));
    loop_open_constants(l->form);
    for (int k = 0; k < l->state_count; k++) {
        const struct state *state = &l->states[k];
        struct loop_statement *loop = open_columns(l, !k);
        for (int a = 0; a < 3; a++) {
            struct loop_sum sum = {.count = 0};
            if (state->at[LINEAR].at[a] == NOTHING)
                continue;
            add_cross(l, &sum, "shift", &l->s->shift, &state->at[ANGULAR], a);
            if (state->column)
                add_cross(l, &sum, "swing", &l->s->swing, &state->at[SPIN], a);
            if (sum.count)
                loop_assign(l->form, loop_entry(state->at[LINEAR].at[a], l->j), LOOP_ADD, &sum);
        }
        loop_close(l->form, loop);
    }
    loop_close(l->form, condition);
}

/* Minus the entries of the stage's columns: products of the response and what the stage passes on. */
static void lower_columns(const struct lowering *l, const struct state *state, int joints) {
    const struct state *response = &l->states[0];
    for (int r = 0; r < joints; r++) {
        struct loop_sum sum = {.count = 0};
        add_part(l, &sum, title(l, "", state, "moment"), r, &state->column->push_moment, response, ANGULAR);
        add_part(l, &sum, title(l, "", state, "force"), r, &state->column->push_force, response, LINEAR);
        loop_assign(l->form, loop_entry(state->columns[r], l->j), LOOP_SET, &sum);
    }
}

/* The joint's response to its carrier's acceleration, and to changes of velocity and direction. */
static struct loop_sum held(const struct lowering *l, const struct state *state, int r) {
    struct loop_sum sum = {.count = 0};
    add_part(l, &sum, "force", r, &l->s->hold_force, state, LINEAR);
    if (!state->column)
        return sum;
    add_part(l, &sum, "spin", r, &l->s->hold_spin, state, SPIN);
    add_part(l, &sum, "turned", r, &l->s->hold_turned, state, TURNED);
    return sum;
}

static void lower_single(const struct lowering *l, const struct state *state, bool is_turn) {
    const int *along = state->at[is_turn ? ANGULAR : LINEAR].at;
    struct loop_sum sum = held(l, state, 0);
    add_part(l, &sum, "moment", 0, &l->s->hold_moment, state, ANGULAR);
    const struct loop_entry x = loop_declare(l->form, "held", &sum);
    for (int a = 0; a < 3; a++) {
        struct loop_sum turn = {.count = 0};
        if (along[a] == NOTHING || l->s->turn.at[a] == NOTHING)
            continue;
        const char *name = memory_format(l->form->memory, "turn_0%c", axes[a]);
        loop_add_product(&turn, -1, loop_constant(l->form, name, 1, loop_entry(l->s->turn.at[a], l->i)), x);
        loop_assign(l->form, loop_entry(along[a], l->j), LOOP_ADD, &turn);
    }
    if (has_rows(l, state))
        loop_assign_entry(l->form, loop_entry(state->rows[0], l->j), LOOP_SET, x);
}

static void lower_ball(const struct lowering *l, const struct state *state) {
    struct memory *memory = l->form->memory;
    struct loop_entry after[3], gain[3];
    for (int r = 0; r < 3; r++) {
        const struct loop_sum sum = held(l, state, r);
        after[r] = loop_declare(l->form, memory_format(memory, "after_%c", axes[r]), &sum);
    }
    for (int r = 0; r < 3 && has_rows(l, state); r++) {
        struct loop_sum sum = {.count = 0};
        loop_add_entry(&sum, 1, after[r]);
        loop_add_entry(&sum, 1, loop_entry(state->at[ANGULAR].at[r], l->j));
        gain[r] = loop_declare(l->form, memory_format(memory, "gain_%c", axes[r]), &sum);
    }
    for (int r = 0; r < 3 && has_rows(l, state); r++) {
        struct loop_sum sum = {.count = 0};
        add_dot(l, &sum, "turn", r, &l->s->turn, gain);
        loop_assign(l->form, loop_entry(state->rows[r], l->j), LOOP_SET, &sum);
    }
    for (int r = 0; r < 3; r++) {
        struct loop_sum sum = {.count = 0};
        loop_add_entry(&sum, -1, after[r]);
        loop_assign(l->form, loop_entry(state->at[ANGULAR].at[r], l->j), LOOP_SET, &sum);
    }
}

/* What the responses to unit wrenches yield at the stage: for its joints, A and z of the bodies on which the
 * wrenches act. Unit wrench and component have the same number. */
static void lower_records(const struct lowering *l, int joints) {
    const struct loop_index unit = loop_variable(l->form, "unit");
    if (!l->places)
        return;
    const struct loop_index kept = loop_declare_integer(l->form, "kept", place(l, l->i));
    struct loop_statement *loop =
        loop_open_for(l->form, unit, loop_plus_number(l->root, l->places - UNIT_WRENCHES), LOOP_AT_LEAST,
                      l->first, loop_number(-UNIT_WRENCHES));
    for (int k = 0; k < l->state_count; k++)
        for (int c = 0; c < UNIT_WRENCHES; c++)
            for (int r = 0; r < joints && l->states[k].at[c / 3].at[c % 3] != NOTHING; r++) {
                const struct state *state = &l->states[k];
                struct loop_sum sum = {.count = 0};
                loop_add_entry(&sum, -1,
                               loop_entry(k ? state->columns[r] : state->rows[r], loop_plus_number(unit, c)));
                loop_assign(l->form, loop_entry(state->kept[c / 3].at[c % 3], loop_plus_number(kept, r)),
                            LOOP_SET, &sum);
            }
    loop_set_integer(l->form, kept, loop_plus_number(kept, l->size));
    loop_close(l->form, loop);
}

static void lower_stage(const struct lowering *l, int kind) {
    const int joints = kind == STAGE_BALL ? 3 : 1;
    loop_open_constants(l->form);
    for (int k = 1; k < l->state_count; k++) {
        struct loop_statement *loop = open_columns(l, true);
        lower_columns(l, &l->states[k], joints);
        loop_close(l->form, loop);
    }
    for (int k = 0; k < l->state_count; k++) {
        struct loop_statement *loop = open_columns(l, !k);
        if (kind == STAGE_BALL)
            lower_ball(l, &l->states[k]);
        else
            lower_single(l, &l->states[k], kind == STAGE_TURN);
        loop_close(l->form, loop);
    }
    lower_records(l, joints);
}

static void lower_stages(const struct lowering *l) {
    struct loop_list *outer = l->form->at;
    int left = has_kind(l->s, STAGE_TURN) + has_kind(l->s, STAGE_SLIDE) + has_kind(l->s, STAGE_BALL);
    for (int kind = STAGE_TURN; kind <= STAGE_BALL; kind++) {
        if (!has_kind(l->s, kind))
            continue;
        struct loop_statement *condition =
            --left ? loop_open_if(l->form, l->kind, LOOP_EQUAL, loop_number(kind)) : NULL;
        lower_stage(l, kind);
        if (condition)
            loop_open_else(l->form, condition);
    }
    l->form->at = outer;
}

/* ---- Entries ---- */

static struct loop_index coordinate(const struct lowering *l, struct loop_index position) {
    return loop_look_up(l->form, "order", l->s->order, l->s->n, position);
}

/* Rows of the stage for the columns before it, and columns of the stage for the rows before it: those of a
 * ball are neighbours. */
static void lower_entries(const struct lowering *l, const struct state *state, int joints, bool is_rows) {
    const struct loop_index i = coordinate(l, l->i), j = coordinate(l, l->j);
    const int array = state->column->array, n = l->s->n;
    struct loop_statement *loop = NULL;
    for (int r = 0; r < joints; r++) {
        struct loop_sum sum = {.count = 0};
        if (!r || is_rows)
            loop = loop_open_range(l->form, "j", l->root, l->i);
        const struct loop_index own = loop_plus_number(i, r);
        loop_add_entry(&sum, -1, loop_entry((is_rows ? state->rows : state->columns)[r], place(l, l->j)));
        loop_assign(
            l->form,
            loop_entry(array, is_rows ? loop_plus(loop_times(own, n), j) : loop_plus(loop_times(j, n), own)),
            LOOP_SET, &sum);
        if (is_rows || r == joints - 1)
            loop_close(l->form, loop);
    }
}

static void lower_stores(const struct lowering *l) {
    struct loop_statement *condition = loop_open_if(l->form, l->joints, LOOP_EQUAL, loop_number(3));
    for (int joints = 3; joints > 0; joints -= 2) {
        for (int k = 1; k < l->state_count && (joints == 1 || has_kind(l->s, STAGE_BALL)); k++) {
            lower_entries(l, &l->states[k], joints, true);
            lower_entries(l, &l->states[k], joints, false);
        }
        loop_open_else(l->form, condition);
    }
    loop_close(l->form, condition);
}

/* Begins the columns of the stage's own joints. */
static void lower_starts(const struct lowering *l) {
    const struct loop_index own = loop_variable(l->form, "own");
    struct loop_statement *loop = loop_open_range(l->form, "own", l->i, loop_plus(l->i, l->joints));
    for (int k = 0; k < l->state_count; k++)
        for (int p = 0; p < l->states[k].part_count; p++)
            set_part(l, &l->states[k].at[p], place(l, own), l->states[k].start[p], own);
    loop_close(l->form, loop);
}

/* ---- Branches ---- */

/* Keeps the states before the body's first branch, and restores them before the others. */
static void lower_kept(const struct lowering *l, struct loop_index from, struct loop_index kept,
                       bool restores) {
    for (int k = 0; k < l->state_count; k++) {
        struct loop_statement *loop =
            loop_open_range(l->form, "j", k ? place(l, l->root) : from, place(l, l->i));
        for (int p = 0; p < KEPT_PARTS; p++) {
            const struct vector_arrays *at = &l->states[k].at[p], *copy = &l->states[k].kept[p];
            const struct loop_index copy_at = loop_plus(kept, l->j);
            if (restores)
                set_part(l, at, l->j, copy, copy_at);
            else
                set_part(l, copy, copy_at, at, l->j);
        }
        loop_close(l->form, loop);
    }
}

/* In other branches, no column of an earlier branch changes velocities or directions. */
static void lower_ends_of_changes(const struct lowering *l, struct loop_index opened) {
    struct loop_statement *loop = loop_open_range(l->form, "j", opened, l->i);
    for (int k = 1; k < l->state_count; k++)
        for (int p = KEPT_PARTS; p < l->states[k].part_count; p++)
            set_part(l, &l->states[k].at[p], place(l, l->j), NULL, l->j);
    loop_close(l->form, loop);
}

static void lower_units(const struct lowering *l, struct loop_index units) {
    const struct loop_index unit = loop_variable(l->form, "unit");
    struct loop_statement *condition = loop_open_if(l->form, units, LOOP_AT_LEAST, loop_number(0));
    loop_set_integer(l->form, l->first, loop_plus_number(l->first, -UNIT_WRENCHES));
    loop_open_range(l->form, "unit", loop_number(0), loop_number(UNIT_WRENCHES));
    set_part(l, &l->states[0].at[ANGULAR], loop_plus(l->first, unit), &l->s->unit_angular,
             loop_plus(units, unit));
    set_part(l, &l->states[0].at[LINEAR], loop_plus(l->first, unit), &l->s->unit_linear,
             loop_plus(units, unit));
    loop_close(l->form, condition);
}

static void lower_branches(const struct lowering *l) {
    if (!l->places)
        return;
    const struct loop_index branch = loop_variable(l->form, "branch");
    const struct sweep_branches *b = &l->s->branches;
    const struct loop_index opened = loop_look_up(l->form, "opened", b->opened, b->count, branch),
                            level = loop_look_up(l->form, "levels", b->levels, b->count, branch);
    struct loop_statement *condition = loop_open_if(
        l->form, l->i, LOOP_EQUAL, loop_look_up(l->form, "starts", b->starts, b->count + 1, branch));
    const struct loop_index from =
        loop_name_integer(l->form, "from", loop_plus(place(l, l->root), loop_times(level, -UNIT_WRENCHES)));
    const struct loop_index kept = loop_name_integer(l->form, "kept", loop_times(level, l->size));
    struct loop_statement *is_first = loop_open_if(l->form, l->i, LOOP_EQUAL, opened);
    lower_kept(l, from, kept, false);
    loop_open_else(l->form, is_first);
    lower_kept(l, from, kept, true);
    lower_ends_of_changes(l, opened);
    loop_close(l->form, is_first);
    loop_set_integer(l->form, l->first, from);
    lower_units(l, loop_look_up(l->form, "units", b->units, b->count, branch));
    loop_set_integer(l->form, branch, loop_plus_number(branch, 1));
    loop_close(l->form, condition);
}

/* ---- The loop ---- */

static void look_up_stage(struct lowering *l) {
    const struct sweeps *s = l->s;
    int *joints = memory_get(l->form->memory, ((size_t)s->n + 1) * sizeof *joints);
    for (int i = 0; i < s->n; i++)
        joints[i] = s->kind[i] == STAGE_BALL || s->kind[i] == STAGE_PART ? 3 : 1;
    l->i = loop_variable(l->form, "i");
    l->j = loop_variable(l->form, "j");
    l->joints = loop_look_up(l->form, "joints", joints, s->n, l->i);
    l->kind = loop_look_up(l->form, "kind", s->kind, s->n, l->i);
    l->root = loop_look_up(l->form, "roots", s->root, s->n, l->i);
}

void loops_lower_sweeps(struct loop_form *form, const struct sweeps *s) {
    const int places = UNIT_WRENCHES * s->levels;
    struct lowering l = {.form = form,
                         .s = s,
                         .state_count = s->column_count + 1,
                         .places = places,
                         .size = (s->n + places + BLOCK - 1) / BLOCK * BLOCK};
    declare_states(&l);
    lower_zeros(&l);
    look_up_stage(&l);
    if (places) {
        loop_declare_integer(form, "branch", loop_number(0));
        l.first = loop_declare_integer(form, "first", loop_number(places));
    }
    loop_open_for(form, l.i, loop_number(0), LOOP_LESS, loop_number(s->n), l.joints);
    l.root = loop_name_integer(form, "root", l.root);
    if (!places) {
        l.first = l.root;
    } else if (l.root.count) {
        struct loop_statement *begins = loop_open_if(form, l.i, LOOP_EQUAL, l.root);
        loop_set_integer(form, l.first, place(&l, l.root));
        loop_close(form, begins);
    }
    lower_branches(&l);
    lower_moves(&l);
    lower_stages(&l);
    lower_stores(&l);
    lower_starts(&l);
}
