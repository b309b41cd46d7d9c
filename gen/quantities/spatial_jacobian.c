/* The quantities J and Jd_qd: spatial Jacobians of points, and their rates times qd. */
#include "gen/quantities/quantities.h"
#include "gen/base/base.h"

static int count_points(const struct derivation *d) {
    int count = 0;
    for (int p = 0; p < d->points; p++)
        count += d->model->points[p].is_angular;
    return count;
}

bool spatial_jacobian_exists(const struct derivation *d) {
    return count_points(d) > 0;
}

/* e_j, in ground axes, of each revolute joint on the way to the ground: w = sum of e_j qd_j. */
static struct vector *angular_columns(const struct derivation *d, int point) {
    const struct kinematics *k = &d->kinematics;
    struct vector *columns = memory_get(d->memory, ((size_t)d->frames + 1) * sizeof *columns);
    for (int j = -1; recursion_next_joint(d->g, k->tree, &j);)
        if (k->tree->frames[j].joint.is_revolute && kinematics_is_on_path(k, j, k->tree->points[point].frame))
            columns[j] = kinematics_joint_axis(k, j);
    return columns;
}

static void spread_rows(struct derivation *d, struct function *f, int first, const struct vector *columns) {
    expression *row = derivation_new_values(d, d->frames);
    for (int a = 0; a < 3; a++) {
        for (int j = 0; j < d->frames; j++)
            row[j] = columns[j].at[a];
        derivation_spread(d, f, f->array_count - 1, (first + a) * d->n, 1, row);
    }
}

void quantity_J(struct derivation *d, struct function *f) {
    int row = 0;
    derivation_add_array(d, f, "J", "(angular points x 6 x n) (rd, w) = J qd", 6 * count_points(d) * d->n,
                         d->n);
    for (int p = 0; p < d->points; p++) {
        if (!d->model->points[p].is_angular)
            continue;
        spread_rows(d, f, row, d->kinematics.points[p].columns);
        spread_rows(d, f, row + 3, angular_columns(d, p));
        row += 6;
    }
}

/* dw/dt at qdd = 0 of the body that carries the point, in ground axes. */
static struct vector angular_drift(const struct derivation *d, int point) {
    const struct kinematics *k = &d->kinematics;
    const int frame = k->tree->points[point].frame;
    const struct vector still = {{0, 0, 0}};
    return frame < 0 ? still
                     : matrix_times(d->g, k->frames[frame].rotation.at, k->frames[frame].bias_angular);
}

void quantity_Jd_qd(struct derivation *d, struct function *f) {
    int row = 0;
    derivation_add_array(d, f, "Jd_qd", "(angular points x 6) (rdd, wd) = J qdd + Jd_qd [m/s^2, rad/s^2]",
                         6 * count_points(d), 6);
    for (int p = 0; p < d->points; p++) {
        if (!d->model->points[p].is_angular)
            continue;
        const struct vector drift = angular_drift(d, p);
        plan_set_entries(d->memory, f, f->array_count - 1, row, d->kinematics.points[p].d.at, 3);
        plan_set_entries(d->memory, f, f->array_count - 1, row + 3, drift.at, 3);
        row += 6;
    }
}
