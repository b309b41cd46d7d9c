/* Derivatives of pulls by q and qd: see pull_pairs.h. */
#include "pull_pairs.h"

#include <string.h>

/* ---- Geometry: pulls that stay what they are while the columns of C turn ---- */

struct turning {
    const struct kinematics *k;
    struct vector *forces, *torques; /* by point */
    struct turned_pulls turned;
};

static void turn_pulls(void *context, int i) {
    const struct turning *x = context;
    const struct kinematics *k = x->k;
    struct graph *g = k->g;
    struct vector *rows = &x->turned.rows[i], *columns = &x->turned.columns[i];
    for (int p = 0; p < k->model->marker_count; p++) {
        if (!is_on_path(k, i, k->tree->points[p].frame))
            continue;
        *columns = vector_add(g, *columns, vector_cross(g, k->points[p].columns[i], x->forces[p]));
        if (k->tree->frames[i].joint.is_turn)
            *rows = vector_add(g, *rows, vector_cross(g, joint_axis(k, i), x->torques[p]));
    }
    *rows = vector_add(g, *columns, *rows);
}

static struct vector *new_vectors(const struct derivation *d, int count) {
    return memory_get(d->memory, ((size_t)count + 1) * sizeof(struct vector));
}

struct turned_pulls derive_turned_pulls(const struct builder *b, double sign) {
    const struct derivation *d = b->d;
    const int markers = d->model->marker_count;
    const expression factor = number(d->g, sign);
    struct turning x = {&d->kinematics,
                        new_vectors(d, markers),
                        new_vectors(d, markers),
                        {new_vectors(d, d->frames), new_vectors(d, d->frames)}};
    for (int p = 0; p < markers; p++) {
        x.forces[p] = vector_scale(d->g, factor, place_vector(b->held, b->pulls->points[p]));
        x.torques[p] = vector_scale(d->g, factor, place_vector(b->held, b->pulls->torques[p]));
    }
    visit_joints(d->g, d->kinematics.tree, turn_pulls, &x);
    return x.turned;
}

struct axes {
    const struct kinematics *k;
    struct vector *axes;
};

static void take_joint_axis(void *context, int i) {
    const struct axes *x = context;
    x->axes[i] = joint_axis(x->k, i);
}

static const struct vector *joint_axes(const struct derivation *d) {
    struct axes x = {&d->kinematics, new_vectors(d, d->frames)};
    visit_joints(d->g, d->kinematics.tree, take_joint_axis, &x);
    return x.axes;
}

static bool has_vector(const struct vector *by_frame, int frames) {
    for (int i = 0; i < frames; i++)
        if (!vector_is_zero(by_frame[i]))
            return true;
    return false;
}

void add_turning_pairs(struct builder *b, const struct turned_pulls *turned, int field) {
    const int frames = b->d->frames;
    struct pair_product product = {.field = field};
    if (!has_vector(turned->rows, frames) && !has_vector(turned->columns, frames))
        return;
    product.is_mirrored = !memcmp(turned->rows, turned->columns, (size_t)frames * sizeof *turned->rows);
    const struct vector_arrays axis = add_arrays(&b->arrays, "axis", joint_axes(b->d));
    add_term(&product.turn.rows, 1, axis, add_arrays(&b->arrays, "turned_rows", turned->rows));
    if (!product.is_mirrored)
        add_term(&product.turn.columns, 1, axis, add_arrays(&b->arrays, "turned_columns", turned->columns));
    struct pairs *pairs =
        add_pairs(&b->arrays, "pairs of coordinates: how j turns what is felt by i beyond it");
    pairs->products[pairs->product_count++] = product;
}

/* ---- Pulls on coordinates ---- */

struct scaling {
    struct graph *g;
    expression factor;
    const expression *values;
    expression *scaled;
};

static void scale(void *context, int i) {
    const struct scaling *x = context;
    x->scaled[i] = mul(x->g, x->factor, x->values[i]);
}

expression *scaled(struct derivation *d, double factor, const expression *by_frame) {
    struct scaling x = {d->g, number(d->g, factor), by_frame, new_values(d, d->frames)};
    visit_joints(d->g, d->kinematics.tree, scale, &x);
    return x.scaled;
}

/* The row of frame i; where no named force pulls on it, the diagonal term of spring or damper alone. */
static void give_slopes_of(struct builder *b, int i, int order, double sign, int field) {
    struct derivation *d = b->d;
    const struct frame *frame = &d->kinematics.tree->frames[i];
    const expression pull = b->pulls->coordinates[i];
    const expression slope = order ? frame->joint.damping : frame->joint.stiffness;
    const expression own = b->pulls->has_springs ? mul(d->g, number(d->g, -sign), slope) : 0;
    if (!pull) {
        give(d->memory, d->kinematics.tree, b->f, field, frame->coordinate * (d->n + 1),
             frame->step * (d->n + 1), i, own);
        return;
    }
    expression *row = scaled(d, sign, held_slopes(b->held, pull, order));
    row[i] = add(d->g, row[i], own);
    spread(d, b->f, field, frame->coordinate * d->n, 1, row);
}

void give_coordinate_slopes(struct builder *b, const struct targets *targets) {
    const struct tree *tree = b->d->kinematics.tree;
    const int fields[] = {targets->by_q, targets->by_qd};
    for (int order = 0; order < 2; order++)
        for (int i = 0; i < tree->count && fields[order] != NOTHING; i++)
            if (tree->frames[i].kind == FRAME_JOINT)
                give_slopes_of(b, i, order, targets->sign, fields[order]);
}

/* ---- Pulls at points that depend on the state ---- */

/* A pull on one column of C, and its derivatives, by frame. */
struct slope {
    const expression *column, *by[2]; /* by q, by qd */
};

struct slopes {
    struct slope *list;
    int count, capacity;
};

static bool is_all_zero(const expression *values, int count) {
    for (int i = 0; i < count; i++)
        if (values[i])
            return false;
    return true;
}

/* One axis of the columns of a point, or of a body's turns. */
struct column_axis {
    const struct kinematics *k;
    int point, axis;
    bool is_torque;
    expression *column;
};

static void take_axis(void *context, int i) {
    const struct column_axis *x = context;
    const struct kinematics *k = x->k;
    if (!x->is_torque)
        x->column[i] = k->points[x->point].columns[i].at[x->axis];
    else if (k->tree->frames[i].joint.is_turn && is_on_path(k, i, k->tree->points[x->point].frame))
        x->column[i] = joint_axis(k, i).at[x->axis];
}

static void add_slope(struct builder *b, const struct targets *targets, struct slopes *slopes,
                      struct column_axis of) {
    const expression pull = (of.is_torque ? b->pulls->torques : b->pulls->points)[of.point].at[of.axis];
    const int fields[] = {targets->by_q, targets->by_qd};
    struct slope slope = {.by = {NULL}};
    if (!pull)
        return;
    for (int order = 0; order < 2; order++)
        slope.by[order] =
            fields[order] == NOTHING ? new_values(b->d, b->d->frames) : held_slopes(b->held, pull, order);
    if (is_all_zero(slope.by[0], b->d->frames) && is_all_zero(slope.by[1], b->d->frames))
        return;
    slope.column = of.column = new_values(b->d, b->d->frames);
    visit_joints(b->d->g, b->d->kinematics.tree, take_axis, &of);
    slopes->list = memory_room(b->d->memory, slopes->list, slopes->count, &slopes->capacity, sizeof slope);
    slopes->list[slopes->count++] = slope;
}

static struct slopes slopes_of_points(struct builder *b, const struct targets *targets) {
    struct slopes slopes = {0};
    for (int p = 0; p < b->d->model->marker_count; p++)
        for (int axis = 0; axis < 3; axis++)
            for (int is_torque = 0; is_torque < 2; is_torque++)
                add_slope(b, targets, &slopes,
                          (struct column_axis){&b->d->kinematics, p, axis, is_torque, NULL});
    return slopes;
}

/* order -1: the columns. */
static const expression *values_of(const struct slope *slope, int order) {
    return order < 0 ? slope->column : slope->by[order];
}

static int add_slope_array(struct builder *b, const struct slopes *slopes, const char *name, int order) {
    const int n = b->d->n;
    const int field = add_local(b->d->memory, b->f, name, slopes->count * n, n);
    for (int s = 0; s < slopes->count; s++)
        spread(b->d, b->f, field, s * n, 1, values_of(&slopes->list[s], order));
    return field;
}

void add_product(struct builder *b, int target, int left, int right, double factor, const char *about) {
    add_loop(b->d->memory, b->f, LOOP_PRODUCT, about)->of.product =
        (struct product){target, left, right, factor};
}

static bool has_slope(const struct builder *b, const struct slopes *slopes, int order) {
    for (int s = 0; s < slopes->count; s++)
        if (!is_all_zero(slopes->list[s].by[order], b->d->frames))
            return true;
    return false;
}

void add_slope_loops(struct builder *b, const struct targets *targets) {
    static const char *const names[] = {"pull_by_q", "pull_by_qd"};
    static const char *const about[] = {"forces at points that depend on q",
                                        "forces at points that depend on qd"};
    const struct slopes slopes = slopes_of_points(b, targets);
    const int fields[] = {targets->by_q, targets->by_qd};
    const int left = slopes.count ? add_slope_array(b, &slopes, "pulled", -1) : NOTHING;
    for (int order = 0; order < 2; order++)
        if (has_slope(b, &slopes, order))
            add_product(b, fields[order], left, add_slope_array(b, &slopes, names[order], order),
                        targets->sign, about[order]);
}

/* ---- Pulls of a tangent in vectors ---- */

static bool is_own(const struct builder *b, const expression *slopes, int i) {
    for (int j = 0; j < b->d->frames; j++)
        if (j != i && slopes[j])
            return false;
    return true;
}

/* Does the named force on frame i, which stands alone, depend on other coordinates, too? */
static bool couples(const struct builder *b, int i) {
    const expression pull = b->pulls->coordinates[i];
    return pull &&
           !(is_own(b, held_slopes(b->held, pull, 0), i) && is_own(b, held_slopes(b->held, pull, 1), i));
}

static expression own_slope(const struct builder *b, int i, int order, double sign) {
    struct graph *g = b->d->g;
    const struct joint *joint = &b->d->kinematics.tree->frames[i].joint;
    const expression spring = mul(g, number(g, -sign), order ? joint->damping : joint->stiffness);
    const expression pull = b->pulls->coordinates[i];
    if (!pull || couples(b, i))
        return spring;
    return add(g, mul(g, number(g, sign), held_slopes(b->held, pull, order)[i]), spring);
}

void give_own_slopes(struct builder *b, double sign, int stiffness, int damping) {
    const struct tree *tree = b->d->kinematics.tree;
    const int fields[] = {stiffness, damping};
    for (int order = 0; order < 2; order++)
        for (int i = 0; i < tree->count; i++)
            if (tree->frames[i].kind == FRAME_JOINT)
                give(b->d->memory, tree, b->f, fields[order], tree->frames[i].coordinate,
                     tree->frames[i].step, i, own_slope(b, i, order, sign));
}

static void add_coupled_coordinates(struct builder *b, struct slopes *slopes) {
    for (int i = 0; i < b->d->frames; i++) {
        if (!couples(b, i))
            continue;
        expression *column = new_values(b->d, b->d->frames);
        column[i] = one(b->d->g);
        const expression pull = b->pulls->coordinates[i];
        slopes->list =
            memory_room(b->d->memory, slopes->list, slopes->count, &slopes->capacity, sizeof *slopes->list);
        slopes->list[slopes->count++] =
            (struct slope){column, {held_slopes(b->held, pull, 0), held_slopes(b->held, pull, 1)}};
    }
}

int add_couplings(struct builder *b, double sign) {
    static const char *const names[] = {"pulled", "pull_by_q", "pull_by_qd"};
    static const char *const about[] = {"columns that forces with such a dependence act on",
                                        "these forces by q, as they stand in K", "the same by qd, in D"};
    struct slopes slopes = slopes_of_points(b, &(struct targets){0, 0, NOTHING, true, sign});
    add_coupled_coordinates(b, &slopes);
    for (int order = -1; order < 2 && slopes.count; order++) {
        const int field =
            open_part(b->d->memory, b->f, names[order + 1],
                      memory_format(b->d->memory, "(%d x n) %s", slopes.count, about[order + 1]),
                      slopes.count * b->d->n, b->d->n);
        for (int s = 0; s < slopes.count; s++)
            spread(b->d, b->f, field, s * b->d->n, 1,
                   order < 0 ? values_of(&slopes.list[s], order)
                             : scaled(b->d, sign, values_of(&slopes.list[s], order)));
    }
    return slopes.count;
}
