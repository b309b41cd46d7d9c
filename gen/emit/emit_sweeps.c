/*
 * The C text of the sweeps of a plan (plan.h), which compute derivatives of accelerations.
 *
 * The states of all columns are local arrays, one for each component, and the columns are the inner loops.
 * Compilers turn inner loops into vector instructions only if the number of their iterations is a constant.
 * Columns are therefore passed in blocks of BLOCK. A block may contain columns that have not begun or that
 * belong to another tree; their values are not used. Lanes are vectors already.
 *
 * Responses to unit wrenches on bodies with several branches are carried like the responses of columns, in
 * places before those of the first column: six for each level, level 0 nearest to the column. Columns of
 * earlier trees may be there, which are complete.
 */
#include "gen/emit/emit.h"

#include <string.h>

enum { BLOCK = 4 }; /* columns; with 8, short chains take longer */

struct printer {
    struct emission *x;
    struct text *text;
    const struct function *function;
    const char *local;
    const struct sweeps *s;
};

static const char axes[3] = "xyz";

static const char *name(const struct printer *p, int array) {
    return emit_array_text(p->x, p->function, array, p->local);
}

/* ---- States ---- */

/* A state by the prefix of its arrays. */
struct state {
    const char *prefix;
    struct sweep_state has;
};

enum { MOST_STATES = 3, KEPT_PARTS = 2 }; /* before a branch, accelerations are kept */

static int list_states(const struct printer *p, struct state states[MOST_STATES]) {
    states[0] = (struct state){"response", sweeps_state(p->s, -1)};
    for (int c = 0; c < p->s->column_count; c++)
        states[c + 1] = (struct state){
            memory_format(p->x->plan->memory, "by_%s", p->function->arrays[p->s->columns[c].array].name),
            sweeps_state(p->s, c)};
    return p->s->column_count + 1;
}

/* The parts of a state, and the arrays from which they begin. */
struct state_part {
    const char *name;
    const bool *has;
    const struct vector_arrays *start;
};

static int list_parts(const struct printer *p, const struct state *state, int column,
                      struct state_part parts[4]) {
    const struct sweep_column *of = column < 0 ? NULL : &p->s->columns[column];
    parts[0] =
        (struct state_part){"angular", state->has.angular, of ? &of->start_angular : &p->s->start_angular};
    parts[1] = (struct state_part){"linear", state->has.linear, of ? &of->start_linear : &p->s->start_linear};
    if (!of)
        return 2;
    parts[2] = (struct state_part){"spin", state->has.spin, &of->spin};
    parts[3] = (struct state_part){"turned", state->has.turned, &of->turned};
    return 4;
}

/* The number of places before the first column. */
static int unit_places(const struct printer *p) {
    return UNIT_WRENCHES * p->s->levels;
}

static int padded(const struct printer *p) {
    const int places = p->s->n + unit_places(p);
    return p->x->is_lanes ? places : (places + BLOCK - 1) / BLOCK * BLOCK;
}

/* The place of the column at a position. */
static const char *place(const struct printer *p, const char *position) {
    return unit_places(p) ? memory_format(p->x->plan->memory, "%s + %d", position, unit_places(p)) : position;
}

static const char *first_place(const struct printer *p, bool is_response) {
    return is_response && unit_places(p) ? "first" : place(p, "root");
}

static bool has_kind(const struct sweeps *s, enum stage_kind kind) {
    for (int i = 0; i < s->n; i++)
        if (s->kind[i] == (int)kind)
            return true;
    return false;
}

/* Returns whether the accelerations of the stage's joints are kept for state k: those of the responses are
 * needed for the branches that follow. */
static bool has_rows(const struct printer *p, int k) {
    return k || unit_places(p);
}

/* Declares the arrays of all states and of the results of one stage. */
static void put_arrays(const struct printer *p, const struct state *states, int count) {
    const int size = padded(p);
    for (int k = 0; k < count; k++) {
        struct state_part parts[4];
        const int part_count = list_parts(p, &states[k], k - 1, parts);
        for (int part = 0; part < part_count; part++)
            for (int a = 0; a < 3; a++)
                if (parts[part].has[a]) {
                    text_add(p->text, "        %s %s_%s_%c[%d];\n", p->x->number, states[k].prefix,
                             parts[part].name, axes[a], size);
                    if (part < KEPT_PARTS && unit_places(p))
                        text_add(p->text, "        %s kept_%s_%s_%c[%d];\n", p->x->number, states[k].prefix,
                                 parts[part].name, axes[a], p->s->levels * size);
                }
        for (int r = 0; r < (has_kind(p->s, STAGE_BALL) ? 3 : 1); r++) {
            if (has_rows(p, k))
                text_add(p->text, "        %s %s_row_%d[%d];\n", p->x->number, states[k].prefix, r, size);
            if (k)
                text_add(p->text, "        %s %s_column_%d[%d];\n", p->x->number, states[k].prefix, r, size);
        }
    }
}

/* Columns that have not begun are 0. */
static void put_zeros(const struct printer *p, const struct state *states, int count) {
    if (p->x->is_lanes)
        return;
    text_add(p->text, "        for (int j = 0; j < %d; j++) {\n", padded(p));
    for (int k = 0; k < count; k++) {
        struct state_part parts[4];
        const int part_count = list_parts(p, &states[k], k - 1, parts);
        for (int part = 0; part < part_count; part++)
            for (int a = 0; a < 3; a++)
                if (parts[part].has[a])
                    text_add(p->text, "            %s_%s_%c[j] = 0.0;\n", states[k].prefix, parts[part].name,
                             axes[a]);
    }
    text_add(p->text, "        }\n");
}

/* ---- One stage ---- */

static void open_columns(const struct printer *p, bool is_response) {
    const char *first = first_place(p, is_response), *end = place(p, "i");
    if (p->x->is_lanes) {
        text_add(p->text, "                for (int j = %s; j < %s; j++) {\n", first, end);
        return;
    }
    text_add(p->text,
             strchr(first, ' ')
                 ? "                for (int block = (%s) / %d * %d; block < %s; block += %d)\n"
                 : "                for (int block = %s / %d * %d; block < %s; block += %d)\n",
             first, BLOCK, BLOCK, end, BLOCK);
    text_add(p->text, "                    for (int j = block; j < block + %d; j++) {\n", BLOCK);
}

static void close_columns(const struct printer *p) {
    text_add(p->text, "%s}\n", p->x->is_lanes ? "                " : "                    ");
}

static const char *margin(const struct printer *p) {
    return p->x->is_lanes ? "                    " : "                        ";
}

/* Returns whether a text contains a name. */
static bool uses(const char *text, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = text; (at = strstr(at, name)); at += length)
        if (at[-1] == ' ' || at[-1] == '(' || at[-1] == '-')
            if (at[length] == ' ' || at[length] == ';' || at[length] == ')')
                return true;
    return false;
}

/* Copies values of position i + r to constants that the loops over columns use, so that each block does not
 * read them again. */
static void put_constants(const struct printer *p, const char *loops, const char *title,
                          const struct vector_arrays *arrays, int r) {
    for (int a = 0; a < 3; a++) {
        const char *constant = memory_format(p->x->plan->memory, "%s_%d%c", title, r, axes[a]);
        if (arrays->at[a] == NOTHING || !uses(loops, constant))
            continue;
        text_add(p->text, "                const %s %s = %s[i", p->x->number, constant,
                 name(p, arrays->at[a]));
        text_add(p->text, r ? " + %d];\n" : "];\n", r);
    }
}

enum { TERMS_ON_A_LINE = 4 };

static const char *separator(const struct printer *p, int count) {
    if (!count)
        return "";
    return count % TERMS_ON_A_LINE ? " + " : memory_format(p->x->plan->memory, " +\n%s    ", margin(p));
}

/* Adds the terms of a dot product of constants and components of a state to a sum of `count` terms. */
static int put_terms(const struct printer *p, int count, const char *title, int r,
                     const struct vector_arrays *arrays, const char *values, const bool has[3],
                     const char *index) {
    for (int a = 0; a < 3; a++)
        if (has[a] && arrays->at[a] != NOTHING)
            text_add(p->text, "%s%s_%d%c * %s_%c%s", separator(p, count++), title, r, axes[a], values,
                     axes[a], index);
    return count;
}

static const char *part_of(const struct printer *p, const struct state *state, const char *part) {
    return memory_format(p->x->plan->memory, "%s_%s", state->prefix, part);
}

static int put_cross(const struct printer *p, int count, const char *title,
                     const struct vector_arrays *arrays, const char *values, const bool has[3], int a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    const bool plus = has[b] && arrays->at[c] != NOTHING, minus = has[c] && arrays->at[b] != NOTHING;
    if (!plus && !minus)
        return count;
    text_add(p->text, "%s(", separator(p, count * TERMS_ON_A_LINE));
    if (plus)
        text_add(p->text, "%s_%c[j] * %s_0%c", values, axes[b], title, axes[c]);
    if (minus)
        text_add(p->text, "%s%s_%c[j] * %s_0%c", plus ? " - " : "-", values, axes[c], title, axes[b]);
    text_add(p->text, ")");
    return count + 1;
}

static bool has_cross(const struct vector_arrays *arrays, const bool has[3], int a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    return (has[b] && arrays->at[c] != NOTHING) || (has[c] && arrays->at[b] != NOTHING);
}

/* The linear acceleration of the stage's origin. */
static void put_move(const struct printer *p, const struct state *state) {
    for (int a = 0; a < 3; a++) {
        if (!state->has.linear[a] ||
            (!has_cross(&p->s->shift, state->has.angular, a) && !has_cross(&p->s->swing, state->has.spin, a)))
            continue;
        text_add(p->text, "%s%s_linear_%c[j] += ", margin(p), state->prefix, axes[a]);
        const int count =
            put_cross(p, 0, "shift", &p->s->shift, part_of(p, state, "angular"), state->has.angular, a);
        put_cross(p, count, "swing", &p->s->swing, part_of(p, state, "spin"), state->has.spin, a);
        text_add(p->text, ";\n");
    }
}

static bool moves(const struct printer *p, const struct state *states, int count) {
    for (int k = 0; k < count; k++)
        for (int a = 0; a < 3; a++)
            if (states[k].has.linear[a] && (has_cross(&p->s->shift, states[k].has.angular, a) ||
                                            has_cross(&p->s->swing, states[k].has.spin, a)))
                return true;
    return false;
}

static void put_moves(const struct printer *p, const struct state *states, int count) {
    struct text loops = {.memory = p->text->memory};
    struct printer inner = *p;
    inner.text = &loops;
    if (!moves(p, states, count))
        return;
    for (int k = 0; k < count; k++) {
        open_columns(&inner, !k);
        put_move(&inner, &states[k]);
        close_columns(&inner);
    }
    text_add(p->text, "            if (moves_on[i]) {\n");
    put_constants(p, loops.data, "shift", &p->s->shift, 0);
    put_constants(p, loops.data, "swing", &p->s->swing, 0);
    text_add(p->text, "%s            }\n", loops.data);
}

/* "= 0" in place of a sum without terms. */
static void end_sum(const struct printer *p, int count) {
    text_add(p->text, "%s;\n", count ? "" : emit_zero(p->x));
}

/* Minus the entries of the stage's columns: products of the response and what the stage passes on. */
static void put_columns(const struct printer *p, const struct state *response, const struct state *state,
                        const struct sweep_column *column, int joints) {
    for (int r = 0; r < joints; r++) {
        text_add(p->text, "%s%s_column_%d[j] = ", margin(p), state->prefix, r);
        int count = put_terms(p, 0, memory_format(p->x->plan->memory, "%s_moment", state->prefix), r,
                              &column->push_moment, "response_angular", response->has.angular, "[j]");
        count = put_terms(p, count, memory_format(p->x->plan->memory, "%s_force", state->prefix), r,
                          &column->push_force, "response_linear", response->has.linear, "[j]");
        end_sum(p, count);
    }
}

/* The joint's response to its carrier's acceleration, and to changes of velocity and direction. */
static int put_held(const struct printer *p, const struct state *state, int r) {
    const struct sweeps *s = p->s;
    int count =
        put_terms(p, 0, "force", r, &s->hold_force, part_of(p, state, "linear"), state->has.linear, "[j]");
    count = put_terms(p, count, "spin", r, &s->hold_spin, part_of(p, state, "spin"), state->has.spin, "[j]");
    return put_terms(p, count, "turned", r, &s->hold_turned, part_of(p, state, "turned"), state->has.turned,
                     "[j]");
}

static void put_single(const struct printer *p, const struct state *state, bool is_turn, bool has_row) {
    const bool *has = is_turn ? state->has.angular : state->has.linear;
    text_add(p->text, "%sconst %s held = ", margin(p), p->x->number);
    int count = put_held(p, state, 0);
    count = put_terms(p, count, "moment", 0, &p->s->hold_moment, part_of(p, state, "angular"),
                      state->has.angular, "[j]");
    end_sum(p, count);
    for (int a = 0; a < 3; a++)
        if (has[a] && p->s->turn.at[a] != NOTHING)
            text_add(p->text, "%s%s_%s_%c[j] -= turn_0%c * held;\n", margin(p), state->prefix,
                     is_turn ? "angular" : "linear", axes[a], axes[a]);
    if (has_row)
        text_add(p->text, "%s%s_row_0[j] = held;\n", margin(p), state->prefix);
}

static void put_ball(const struct printer *p, const struct state *state, bool has_row) {
    static const bool all[3] = {true, true, true};
    const char *number = p->x->number;
    for (int r = 0; r < 3; r++) {
        text_add(p->text, "%sconst %s after_%c = ", margin(p), number, axes[r]);
        end_sum(p, put_held(p, state, r));
    }
    for (int r = 0; r < 3 && has_row; r++)
        text_add(p->text, "%sconst %s gain_%c = after_%c + %s_angular_%c[j];\n", margin(p), number, axes[r],
                 axes[r], state->prefix, axes[r]);
    for (int r = 0; r < 3 && has_row; r++) {
        text_add(p->text, "%s%s_row_%d[j] = ", margin(p), state->prefix, r);
        end_sum(p, put_terms(p, 0, "turn", r, &p->s->turn, "gain", all, ""));
    }
    for (int r = 0; r < 3; r++)
        text_add(p->text, "%s%s_angular_%c[j] = -after_%c;\n", margin(p), state->prefix, axes[r], axes[r]);
}

static void put_stage_loops(const struct printer *p, const struct state *states, int count,
                            enum stage_kind kind) {
    const struct sweeps *s = p->s;
    for (int c = 0; c < s->column_count; c++) {
        open_columns(p, true);
        put_columns(p, &states[0], &states[c + 1], &s->columns[c], kind == STAGE_BALL ? 3 : 1);
        close_columns(p);
    }
    for (int k = 0; k < count; k++) {
        open_columns(p, !k);
        if (kind == STAGE_BALL)
            put_ball(p, &states[k], has_rows(p, k));
        else
            put_single(p, &states[k], kind == STAGE_TURN, has_rows(p, k));
        close_columns(p);
    }
}

/* What the responses to unit wrenches yield at the stage: for its joints, A and z of the bodies on which the
 * wrenches act. Unit wrench and component have the same number. */
static void put_records(const struct printer *p, const struct state *states, int count, int joints) {
    if (!unit_places(p))
        return;
    text_add(p->text,
             "                for (int unit = root + %d, kept = i + %d; unit >= first; unit -= %d, kept += "
             "%d) {\n",
             unit_places(p) - UNIT_WRENCHES, unit_places(p), UNIT_WRENCHES, padded(p));
    for (int k = 0; k < count; k++) {
        struct state_part parts[4];
        list_parts(p, &states[k], k - 1, parts);
        for (int c = 0; c < UNIT_WRENCHES; c++)
            for (int r = 0; r < joints && parts[c / 3].has[c % 3]; r++)
                text_add(p->text, "                    kept_%s_%s_%c[kept + %d] = -%s_%s_%d[unit + %d];\n",
                         states[k].prefix, parts[c / 3].name, axes[c % 3], r, states[k].prefix,
                         k ? "column" : "row", r, c);
    }
    text_add(p->text, "                }\n");
}

static void put_stage(const struct printer *p, const struct state *states, int count, enum stage_kind kind) {
    const struct sweeps *s = p->s;
    struct memory *memory = p->x->plan->memory;
    struct text loops = {.memory = p->text->memory};
    struct printer inner = *p;
    inner.text = &loops;
    put_stage_loops(&inner, states, count, kind);
    for (int r = 0; r < (kind == STAGE_BALL ? 3 : 1); r++) {
        put_constants(p, loops.data, "turn", &s->turn, r);
        put_constants(p, loops.data, "moment", &s->hold_moment, r);
        put_constants(p, loops.data, "force", &s->hold_force, r);
        put_constants(p, loops.data, "spin", &s->hold_spin, r);
        put_constants(p, loops.data, "turned", &s->hold_turned, r);
        for (int c = 0; c < s->column_count; c++) {
            const char *prefix = states[c + 1].prefix;
            put_constants(p, loops.data, memory_format(memory, "%s_moment", prefix),
                          &s->columns[c].push_moment, r);
            put_constants(p, loops.data, memory_format(memory, "%s_force", prefix), &s->columns[c].push_force,
                          r);
        }
    }
    text_add(p->text, "%s", loops.data);
    put_records(p, states, count, kind == STAGE_BALL ? 3 : 1);
}

/* ---- The loop ---- */

static void put_stages(const struct printer *p, const struct state *states, int count) {
    int left = has_kind(p->s, STAGE_TURN) + has_kind(p->s, STAGE_SLIDE) + has_kind(p->s, STAGE_BALL);
    const char *before = "            ";
    for (int kind = STAGE_TURN; kind <= STAGE_BALL; kind++) {
        if (!has_kind(p->s, (enum stage_kind)kind))
            continue;
        if (--left)
            text_add(p->text, "%sif (kind[i] == %d) {\n", before, kind);
        else
            text_add(p->text, "%s{\n", before);
        put_stage(p, states, count, (enum stage_kind)kind);
        text_add(p->text, "            }");
        before = " else ";
        if (!left)
            text_add(p->text, "\n");
    }
}

static bool is_ordered(const struct sweeps *s) {
    for (int i = 0; i < s->n; i++)
        if (s->order[i] != i)
            return false;
    return true;
}

/* Rows of the stage for the columns before it. */
static void put_rows(const struct printer *p, const struct state *state, const char *entries, int joints,
                     const char *indent) {
    const bool ordered = is_ordered(p->s);
    for (int r = 0; r < joints; r++) {
        text_add(p->text, "%sfor (int j = root; j < i; j++)\n", indent);
        text_add(p->text,
                 ordered ? "%s    %s[(i + %d) * %d + j] = " : "%s    %s[(order[i] + %d) * %d + order[j]] = ",
                 indent, entries, r, p->s->n);
        text_add(p->text, "-%s_row_%d[%s];\n", state->prefix, r, place(p, "j"));
    }
}

/* Columns of the stage for the rows before it: those of a ball are neighbours. */
static void put_transposed(const struct printer *p, const struct state *state, const char *entries,
                           int joints, const char *indent) {
    const bool ordered = is_ordered(p->s);
    text_add(p->text, "%sfor (int j = root; j < i; j++) {\n", indent);
    for (int r = 0; r < joints; r++) {
        text_add(p->text,
                 ordered ? "%s    %s[j * %d + i + %d] = " : "%s    %s[order[j] * %d + order[i] + %d] = ",
                 indent, entries, p->s->n, r);
        text_add(p->text, "-%s_column_%d[%s];\n", state->prefix, r, place(p, "j"));
    }
    text_add(p->text, "%s}\n", indent);
}

static void put_stores(const struct printer *p, const struct state *states, int count) {
    const bool has_balls = has_kind(p->s, STAGE_BALL);
    for (int joints = 3; joints > 0; joints -= 2) {
        if (joints == 3 && !has_balls)
            continue;
        if (has_balls)
            text_add(p->text, joints == 3 ? "            if (joints == 3) {\n" : "            } else {\n");
        for (int k = 1; k < count; k++) {
            const char *entries = name(p, p->s->columns[k - 1].array);
            const char *indent = has_balls ? "                " : "            ";
            put_rows(p, &states[k], entries, joints, indent);
            put_transposed(p, &states[k], entries, joints, indent);
        }
    }
    if (has_balls)
        text_add(p->text, "            }\n");
}

/* Begins the columns of the stage's own joints. */
static void put_starts(const struct printer *p, const struct state *states, int count) {
    text_add(p->text, "            for (const int end = i + joints; i < end; i++) {\n");
    for (int k = 0; k < count; k++) {
        struct state_part parts[4];
        const int part_count = list_parts(p, &states[k], k - 1, parts);
        for (int part = 0; part < part_count; part++)
            for (int a = 0; a < 3; a++)
                if (parts[part].has[a])
                    text_add(p->text, "                %s_%s_%c[%s] = %s%s;\n", states[k].prefix,
                             parts[part].name, axes[a], place(p, "i"),
                             parts[part].start->at[a] == NOTHING ? emit_zero(p->x)
                                                                 : name(p, parts[part].start->at[a]),
                             parts[part].start->at[a] == NOTHING ? "" : "[i]");
    }
    text_add(p->text, "            }\n");
}

static bool is_single_tree(const struct sweeps *s) {
    for (int i = 0; i < s->n; i++)
        if (s->root[i])
            return false;
    return true;
}

bool emit_is_swept(const struct function *function, int array) {
    for (int l = 0; l < function->loop_count; l++) {
        const struct sweeps *s = &function->loops[l].of.sweeps;
        for (int c = 0; function->loops[l].kind == LOOP_SWEEPS && c < s->column_count; c++)
            if (s->columns[c].array == array && is_single_tree(s))
                return true;
    }
    return false;
}

/* ---- Branches ---- */

/* A loop over the states that are kept, which keeps or restores them. */
static void put_kept(const struct printer *p, const struct state *states, int count, bool restores) {
    for (int k = 0; k < count; k++) {
        struct state_part parts[4];
        list_parts(p, &states[k], k - 1, parts);
        text_add(p->text, "                    for (int j = %s; j < %s; j++) {\n",
                 k ? place(p, "root") : "from", place(p, "i"));
        for (int c = 0; c < 3 * KEPT_PARTS; c++) {
            const char *title = memory_format(p->x->plan->memory, "%s_%s_%c", states[k].prefix,
                                              parts[c / 3].name, axes[c % 3]);
            if (parts[c / 3].has[c % 3])
                text_add(p->text,
                         restores ? "                        %s[j] = kept_%s[kept + j];\n"
                                  : "                        kept_%s[kept + j] = %s[j];\n",
                         title, title);
        }
        text_add(p->text, "                    }\n");
    }
}

/* In other branches, no column of an earlier branch changes velocities or directions. */
static void put_ends_of_changes(const struct printer *p, const struct state *states, int count) {
    struct text ends = {.memory = p->text->memory};
    for (int k = 1; k < count; k++) {
        struct state_part parts[4];
        const int part_count = list_parts(p, &states[k], k - 1, parts);
        for (int part = KEPT_PARTS; part < part_count; part++)
            for (int a = 0; a < 3; a++)
                if (parts[part].has[a])
                    text_add(&ends, "                        %s_%s_%c[%s] = %s;\n", states[k].prefix,
                             parts[part].name, axes[a], place(p, "j"), emit_zero(p->x));
    }
    if (ends.data)
        text_add(p->text,
                 "                    for (int j = opened[branch]; j < i; j++) {\n%s                    }\n",
                 ends.data);
}

static void put_units(const struct printer *p, const struct state *response) {
    struct state_part parts[4];
    const struct vector_arrays *const units[KEPT_PARTS] = {&p->s->unit_angular, &p->s->unit_linear};
    list_parts(p, response, -1, parts);
    text_add(p->text, "                if (units[branch] >= 0) {\n");
    text_add(p->text, "                    first -= %d;\n", UNIT_WRENCHES);
    text_add(p->text, "                    for (int unit = 0; unit < %d; unit++) {\n", UNIT_WRENCHES);
    for (int c = 0; c < 3 * KEPT_PARTS; c++) {
        const int array = units[c / 3]->at[c % 3];
        if (!parts[c / 3].has[c % 3])
            continue;
        text_add(p->text, "                        %s_%s_%c[first + unit] = ", response->prefix,
                 parts[c / 3].name, axes[c % 3]);
        text_add(p->text, array == NOTHING ? "%s;\n" : "%s[units[branch] + unit];\n",
                 array == NOTHING ? emit_zero(p->x) : name(p, array));
    }
    text_add(p->text, "                    }\n                }\n");
}

static void put_branches(const struct printer *p, const struct state *states, int count) {
    const int places = unit_places(p);
    if (!places)
        return;
    text_add(p->text, "            if (i == starts[branch]) { /* a branch of a body that has several */\n");
    text_add(
        p->text,
        "                const int from = root + %d - %d * levels[branch], kept = %d * levels[branch];\n",
        places, UNIT_WRENCHES, padded(p));
    text_add(p->text, "                if (i == opened[branch]) {\n");
    put_kept(p, states, count, false);
    text_add(p->text, "                } else {\n");
    put_kept(p, states, count, true);
    put_ends_of_changes(p, states, count);
    text_add(p->text, "                }\n                first = from;\n");
    put_units(p, &states[0]);
    text_add(p->text, "                branch++;\n            }\n");
}

static void put_branch_tables(const struct printer *p) {
    const struct sweeps *s = p->s;
    const int count = s->branch_count;
    int *values = memory_get(p->x->plan->memory, ((size_t)count + 1) * sizeof *values);
    for (int b = 0; b < count; b++)
        values[b] = s->branches[b].position;
    values[count] = s->n;
    emit_local_table(p->text, "int", "starts", values, count + 1);
    for (int b = 0; b < count; b++)
        values[b] = s->branches[b].first;
    emit_local_table(p->text, "int", "opened", values, count);
    for (int b = 0; b < count; b++)
        values[b] = s->branches[b].level;
    emit_local_table(p->text, "unsigned char", "levels", values, count);
    for (int b = 0; b < count; b++)
        values[b] = s->branches[b].is_last ? -1 : UNIT_WRENCHES * s->branches[b].body;
    emit_local_table(p->text, "int", "units", values, count);
}

/* ---- The loop ---- */

static void put_tables(const struct printer *p, const struct state *states, int count) {
    const struct sweeps *s = p->s;
    int *values = memory_get(p->x->plan->memory, ((size_t)s->n + 1) * sizeof *values);
    if (!is_ordered(s))
        emit_local_table(p->text, "int", "order", s->order, s->n);
    if (!is_single_tree(s))
        emit_local_table(p->text, "int", "roots", s->root, s->n);
    if (has_kind(s, STAGE_BALL) || has_kind(s, STAGE_TURN) == has_kind(s, STAGE_SLIDE))
        emit_local_table(p->text, "unsigned char", "kind", s->kind, s->n);
    for (int i = 0; i < s->n; i++)
        values[i] = s->moves_on[i];
    if (moves(p, states, count))
        emit_local_table(p->text, "unsigned char", "moves_on", values, s->n);
    if (unit_places(p))
        put_branch_tables(p);
}

void emit_sweeps(struct emission *x, struct text *text, const struct function *function, const char *local,
                 const struct sweeps *sweeps) {
    const struct printer p = {x, text, function, local, sweeps};
    struct state states[MOST_STATES];
    const int count = list_states(&p, states);
    put_tables(&p, states, count);
    put_arrays(&p, states, count);
    put_zeros(&p, states, count);
    if (unit_places(&p))
        text_add(text, "        int branch = 0, first = %d;\n", unit_places(&p));
    text_add(text, "        for (int i = 0; i < %d;) {\n", sweeps->n);
    text_add(text, "            const int root = %s, joints = %s;\n",
             is_single_tree(sweeps) ? "0" : "roots[i]",
             has_kind(sweeps, STAGE_BALL) ? "kind[i] == 2 ? 3 : 1" : "1");
    if (unit_places(&p) && !is_single_tree(sweeps))
        text_add(text, "            if (i == root)\n                first = %s;\n", place(&p, "root"));
    put_branches(&p, states, count);
    put_moves(&p, states, count);
    put_stages(&p, states, count);
    put_stores(&p, states, count);
    put_starts(&p, states, count);
    text_add(text, "        }\n");
}
