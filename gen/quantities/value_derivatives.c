/*
 * Derivatives of values that the model names: rows, points and courses, by q, qd, t, inputs and parameters.
 *
 * Input: the values in symbols of coordinates and points. Output: the quantities d_rows, d_points and
 * d_course. By q and qd they follow from the columns of the points (theory, sect. 7.2), by the other
 * variables from the graph.
 */
#include "gen/quantities/quantities.h"

/* Values whose blocks have a common prefix. */
struct value_group {
    struct block_rows rows;
    bool reads_rates;
    expression *in_symbols; /* (rows.count) */
};

enum { MOST_GROUPS = 3 };

static struct value_group new_group(const struct derivation *d, const char *before, const char *what,
                                    const char *shape, int count, bool reads_rates) {
    return (struct value_group){{before, what, shape, count}, reads_rates, derivation_new_values(d, count)};
}

/* The terms of all groups, one after another, for the builder's motion. */
static struct terms place_groups(const struct builder *b, const struct value_group *groups, int count) {
    struct terms terms = {.count = 0};
    for (int k = 0; k < count; k++)
        terms.count += groups[k].rows.count;
    terms.values = derivation_new_values(b->d, terms.count);
    expression *at = terms.values;
    for (int k = 0; k < count; k++)
        for (int i = 0; i < groups[k].rows.count; i++)
            *at++ = given_motion_place(b->given, groups[k].in_symbols[i]);
    return terms;
}

static void add_group(const struct builder *b, const struct value_group *group, const struct terms *terms,
                      int first, const int widths[BLOCK_COUNT]) {
    int own[BLOCK_COUNT], arrays[BLOCK_COUNT];
    for (int k = 0; k < BLOCK_COUNT; k++)
        own[k] = k == BY_QD && !group->reads_rates ? 0 : widths[k];
    derivatives_add_blocks(b->d, b->f, &group->rows, own, arrays);
    derivatives_fill_by_state(b, group->in_symbols, 0, 1, arrays[BY_Q]);
    derivatives_fill_by_state(b, group->in_symbols, 1, 1, arrays[BY_QD]);
    for (int k = BY_T; k < BLOCK_COUNT; k++)
        derivatives_fill_block(b, terms, first, k, 1, arrays[k]);
}

/* Adds the blocks of all groups; blocks by t and by the inputs only if the values may depend on them. */
static void add_groups(struct builder *b, const struct value_group *groups, int count,
                       bool is_of_state_alone) {
    int widths[BLOCK_COUNT], first = 0;
    struct terms terms = place_groups(b, groups, count);
    derivatives_open_blocks(b->d, &terms, widths);
    if (is_of_state_alone)
        widths[BY_T] = widths[BY_X] = 0;
    for (int k = 0; k < count; k++) {
        add_group(b, &groups[k], &terms, first, widths);
        first += groups[k].rows.count;
    }
}

static struct builder open(struct derivation *d, struct function *f, const expression *accelerations) {
    return (struct builder){
        .d = d, .f = f, .given = given_motion_derive(&d->kinematics, accelerations, NULL)};
}

void quantity_d_rows(struct derivation *d, struct function *f) {
    const int m = d->m;
    struct builder b = open(d, f, derivation_new_values(d, d->frames));
    struct value_group groups[MOST_GROUPS] = {new_group(d, "psi_", "d(psi)", "m", m, true),
                                              new_group(d, "k_", "d(k)", "m", m, true),
                                              new_group(d, "phi_", "d(phi)", "m", m, false)};
    for (int i = 0; i < m; i++) {
        const struct row_symbols symbols = tangent_row_symbols(&d->kinematics, i);
        groups[0].in_symbols[i] = symbols.psi;
        groups[1].in_symbols[i] = expr_neg(d->g, symbols.balance);
        groups[2].in_symbols[i] = symbols.phi;
    }
    add_groups(&b, groups, MOST_GROUPS, false);
}

/* Points depend on neither time nor inputs. */
void quantity_d_points(struct derivation *d, struct function *f) {
    static const char *const names[MOST_GROUPS][2] = {
        {"r_", "d(r)"}, {"rd_", "d(rd)"}, {"rdd_", "d(rdd) at given qdd"}};
    expression *accelerations = derivation_new_values(d, d->frames);
    for (int i = -1; recursion_next_joint(d->g, d->kinematics.tree, &i);)
        accelerations[i] = kinematics_coordinate_of(&d->kinematics, i, 2);
    struct builder b = open(d, f, accelerations);
    struct value_group groups[MOST_GROUPS];
    for (int order = 0; order < MOST_GROUPS; order++) {
        groups[order] =
            new_group(d, names[order][0], names[order][1], "points x 3", 3 * d->points, order > 0);
        for (int i = 0; i < 3 * d->points; i++)
            groups[order].in_symbols[i] = expr_symbol(d->g, SYMBOL_POINT, i, order);
    }
    f->given = GIVEN_ACCELERATIONS;
    add_groups(&b, groups, MOST_GROUPS, true);
}

void quantity_d_course(struct derivation *d, struct function *f) {
    const int count = d->model->course_count;
    struct builder b = open(d, f, derivation_new_values(d, d->frames));
    struct value_group group = new_group(d, "", "d(course)", "courses", count, true);
    for (int i = 0; i < count; i++)
        group.in_symbols[i] = d->model->courses[i].value;
    add_groups(&b, &group, 1, false);
}
