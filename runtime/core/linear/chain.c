/*
 * The tangent of a tree of joints as vectors: layout, vectors, and the border of couplings and rows.
 * chain_sweeps.c has the formulas and the sweeps over joints.
 */
#include "runtime/core/linear/linear.h"

#include <string.h>

#include "runtime/core/linear/linear_private.h"

/* ---- The scene ---- */

/* Axes, as bits, on which a vector has entries. */
static int axes_of(const struct refdyn_model *model, int vector) {
    int axes = 0;
    for (int a = 0; a < 3; a++)
        axes |= (model->vector_places[3 * vector + a] >= 0) << a;
    return axes;
}

/* Returns the normal of the plane in which all joints move; -1: none. */
static int normal_of(const struct refdyn_model *model) {
    const int turns = axes_of(model, REFDYN_TURN_AXIS) | axes_of(model, REFDYN_TURN_RATE) |
                      axes_of(model, REFDYN_TURN_RATE2);
    const int slides = axes_of(model, REFDYN_SLIDE_AXIS) | axes_of(model, REFDYN_SLIDE_RATE) |
                       axes_of(model, REFDYN_SLIDE_RATE2) | axes_of(model, REFDYN_LEVER);
    for (int a = 0; a < 3; a++)
        if (!(turns & ~(1 << a)) && !(slides & 1 << a))
            return a;
    return -1;
}

static int border_of(const struct refdyn_model *model) {
    return model->coupling_count + model->m;
}

/* ---- Layout ---- */

/* Orders joints so that all joints beyond a joint follow it. */
static void order_joints(struct refdyn_chain *c) {
    const int n = c->n, *parent = c->model->parent;
    int *beyond = c->slot, *begin = c->next; /* scratch until these are set */
    for (int i = 0; i < n; i++)
        beyond[i] = 1;
    for (int i = n - 1; i >= 0; i--)
        if (parent[i] >= 0)
            beyond[parent[i]] += beyond[i];
    int roots = 0;
    for (int i = 0; i < n; i++) {
        int *from = parent[i] < 0 ? &roots : &begin[parent[i]];
        const int position = *from;
        *from += beyond[i];
        begin[i] = position + 1;
        c->order[position] = i;
        c->other[i] = position; /* by coordinate; scratch until `other` is set */
    }
    for (int k = 0; k < n; k++)
        c->parent[k] = parent[c->order[k]] < 0 ? -1 : c->other[parent[c->order[k]]];
}

/* A sibling of a first joint has a separate slot; the joint that carries both adds the slots up. */
static void find_slots(struct refdyn_chain *c) {
    int slots = 0;
    for (int k = 0; k < c->n; k++)
        c->other[k] = c->next[k] = -1;
    for (int k = 0; k < c->n; k++) {
        const int parent = c->parent[k];
        c->slot[k] = parent == k - 1 && parent >= 0 ? c->slot[parent] : slots++;
        if (parent >= 0 && parent != k - 1) {
            c->next[k] = c->other[parent];
            c->other[parent] = k;
        }
    }
}

/* Returns an upper bound on the number of slots: the number of tips. */
static int most_slots(const struct refdyn_model *model) {
    int slots = 1;
    for (int i = 1; i < model->n; i++)
        slots += model->parent[i] != i - 1;
    return slots;
}

static int factors_size(const struct refdyn_chain *c) {
    return c->n * refdyn_chain_numbers(c);
}

static int has_strains(const struct refdyn_model *model) {
    return model->vector_places[3 * REFDYN_STRAIN_ROWS + 2] >= 0;
}

void refdyn_chain_lay_out(struct refdyn_chain *c, const struct refdyn_model *model, int has_wide,
                          struct layout *layout) {
    const int n = model->n, border = border_of(model), is_planar = normal_of(model) >= 0;
    const int width = refdyn_chain_width(has_wide), both = 1 + (has_wide ? width : 0);
    const int corners = 1 + (has_wide ? width : 0), pivots = 1 + (has_wide ? REFDYN_LANES : 0);
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(is_planar);
    *c = (struct refdyn_chain){.model = model, .n = n, .is_planar = is_planar};
    c->left = at.left;
    c->right = at.right;
    c->record = at.record;
    c->records = layout_doubles(layout, n * c->record);
    c->stiffness = layout_doubles(layout, n);
    c->damping = layout_doubles(layout, n);
    c->rotor = layout_doubles(layout, n);
    c->has_strains = has_strains(model);
    c->strains = layout_doubles(layout, c->has_strains ? REFDYN_STRAINS * n : 0);
    c->ends_ball = layout_ints(layout, c->has_strains ? n : 0);
    c->factors = layout_doubles(layout, both * factors_size(c));
    c->responses = layout_doubles(layout, both * border * n);
    c->border_rows = layout_doubles(layout, both * border * n);
    c->corner = layout_doubles(layout, corners * border * border);
    c->inner = layout_doubles(layout, most_slots(model) * width * at.left * at.right);
    c->sweep = layout_doubles(layout, n * width * at.right);
    c->side = layout_doubles(layout, 4 * n + (2 * n + 2 * border) * width);
    c->scale = layout_doubles(layout, border);
    c->order = layout_ints(layout, n);
    c->parent = layout_ints(layout, n);
    c->other = layout_ints(layout, n);
    c->next = layout_ints(layout, n);
    c->slot = layout_ints(layout, n);
    c->moves = layout_ints(layout, n);
    c->pivot = layout_ints(layout, pivots * border);
    if (layout->base) {
        order_joints(c);
        find_slots(c);
    }
}

/* ---- Vectors ---- */

static int count_arrays(const struct refdyn_model *model) {
    int count = 0;
    for (int i = 0; i < 3 * REFDYN_VECTOR_COUNT; i++)
        count += model->vector_places[i] >= 0;
    return count;
}

int refdyn_chain_result_size(const struct refdyn_model *model) {
    return model->n * (2 + count_arrays(model) + 3 * model->coupling_count);
}

/* Whether the array at this place belongs to M. */
static int is_of_mass(int place) {
    const enum refdyn_vector vector = (enum refdyn_vector)(place / 3);
    return place == REFDYN_ROTOR || vector == REFDYN_TURN_AXIS || vector == REFDYN_SLIDE_AXIS ||
           vector == REFDYN_SHIFT || vector == REFDYN_MASS_MOMENT || vector == REFDYN_MASS_FORCE;
}

void refdyn_chain_keep_mass(const struct refdyn_model *model, double *result, double *diagonals) {
    const size_t bytes = (size_t)model->n * sizeof *result, couplings = (size_t)model->coupling_count;
    const int couplings_at = (2 + count_arrays(model)) * model->n;
    memset(diagonals, 0, 2 * bytes);
    for (int i = 0; i < 3 * REFDYN_VECTOR_COUNT; i++)
        if (model->vector_places[i] >= 0 && !is_of_mass(i))
            memset(result + model->vector_places[i], 0, bytes);
    memset(diagonals + couplings_at + model->coupling_count * model->n, 0, 2 * couplings * bytes);
}

/* Adds factor * vector for all joints to the records from component `at` on, restricted to the axes that
 * rotations or translations use. */
static void take(struct refdyn_chain *c, const double *result, int at, enum refdyn_vector vector,
                 int is_force, double factor) {
    const int normal = c->is_planar ? normal_of(c->model) : 2; /* in the order x, y, z */
    const int first = c->is_planar && !is_force ? normal : normal + 1;
    const int count = !c->is_planar ? 3 : is_force ? 2 : 1;
    for (int a = 0; a < count; a++) {
        const int place = c->model->vector_places[3 * (int)vector + (first + a) % 3];
        for (int k = 0; k < c->n && place >= 0; k++)
            c->records[k * c->record + at + a] += factor * result[place + c->order[k]];
    }
}

static void take_wrench(struct refdyn_chain *c, const double *result, int at, enum refdyn_vector moment,
                        enum refdyn_vector force, double factor) {
    take(c, result, at, moment, 0, factor);
    take(c, result, at + refdyn_chain_layout_of(c->is_planar).moments, force, 1, factor);
}

/* Copies axis a of a vector for all joints into entry `into` of the strains. */
static void take_strain(struct refdyn_chain *c, const double *result, enum refdyn_vector vector, int a,
                        int into) {
    const int place = c->model->vector_places[3 * (int)vector + a];
    for (int k = 0; k < c->n; k++)
        c->strains[k * REFDYN_STRAINS + into] = place < 0 ? 0 : result[place + c->order[k]];
}

static void take_strains(struct refdyn_chain *c, const double *result) {
    const int last = c->model->vector_places[3 * REFDYN_STRAIN_ROWS + 2];
    for (int before = 0; before < 2; before++) {
        take_strain(c, result, REFDYN_STRAIN_ROWS, before, 3 * before);
        take_strain(c, result, REFDYN_STRAIN_COLUMNS, before, 3 * before + 1);
        take_strain(c, result, REFDYN_STRAIN_DAMPING, before, 3 * before + 2);
    }
    for (int k = 0; k < c->n; k++)
        c->ends_ball[k] = result[last + c->order[k]] != 0;
}

void refdyn_chain_take(struct refdyn_chain *c, const double *result, const double *diagonals) {
    const struct refdyn_chain_layout at = refdyn_chain_layout_of(c->is_planar);
    const int rotor = c->model->vector_places[REFDYN_ROTOR];
    const int n = c->n, of_mass = at.Z, of_damping = at.Z + at.right, of_stiffness = at.Z + 2 * at.right;
    memset(c->records, 0, (size_t)(n * c->record) * sizeof *c->records);
    take_wrench(c, result, 0, REFDYN_TURN_AXIS, REFDYN_SLIDE_AXIS, 1);
    take(c, result, at.shift, REFDYN_SHIFT, 1, 1);
    take(c, result, at.shift_rate, REFDYN_SHIFT_RATE, 1, 1);
    take_wrench(c, result, at.W, REFDYN_MASS_MOMENT, REFDYN_MASS_FORCE, 1);
    take_wrench(c, result, at.W + at.left, REFDYN_DAMPING_MOMENT, REFDYN_DAMPING_FORCE, 2);
    take_wrench(c, result, at.W + 2 * at.left, REFDYN_STIFFNESS_MOMENT, REFDYN_STIFFNESS_FORCE, 1);
    take(c, result, of_mass, REFDYN_TURN_AXIS, 0, 1);
    take(c, result, of_mass + at.force, REFDYN_SLIDE_AXIS, 1, 1);
    take(c, result, of_damping, REFDYN_TURN_RATE, 0, 2);
    take(c, result, of_damping + at.spin, REFDYN_TURN_AXIS, 0, 2);
    take(c, result, of_damping + at.force, REFDYN_SLIDE_RATE, 1, 2);
    take(c, result, of_stiffness, REFDYN_TURN_RATE2, 0, 1);
    take(c, result, of_stiffness + at.spin, REFDYN_TURN_RATE, 0, 2);
    take(c, result, of_stiffness + at.force, REFDYN_LEVER, 1, 1);
    take(c, result, of_stiffness + at.force, REFDYN_SLIDE_RATE2, 1, 1);
    take(c, result, of_stiffness + at.turned, REFDYN_TURN_AXIS, 0, 1);
    take(c, result, at.Y, REFDYN_MASS_MOMENT, 0, 1);
    take(c, result, at.Y + at.spin, REFDYN_SPIN, 0, 1);
    take(c, result, at.Y + at.force, REFDYN_MASS_FORCE, 1, 1);
    take(c, result, at.Y + at.turned, REFDYN_TURNED_ROWS, 0, 1);
    for (int k = 0; k < n; k++) {
        const double *way = c->records + k * c->record + at.shift;
        c->moves[k] = 0;
        for (int a = 0; a < 2 * at.forces; a++)
            c->moves[k] |= way[a] != 0;
        c->stiffness[k] = diagonals[c->order[k]];
        c->damping[k] = diagonals[n + c->order[k]];
        c->rotor[k] = rotor < 0 ? 0 : result[rotor + c->order[k]];
    }
    if (c->has_strains)
        take_strains(c, result);
    c->pulled = diagonals + (2 + count_arrays(c->model)) * n;
    c->by_q = c->pulled + c->model->coupling_count * n;
    c->by_qd = c->by_q + c->model->coupling_count * n;
}

/* ---- Products ---- */

void refdyn_chain_times(struct refdyn_chain *c, const double *m, const double *d, const double *k,
                        double *y) {
    const int n = c->n;
    const double *by_coordinate[3] = {m, d, k}, *x[3] = {NULL, NULL, NULL};
    double *result = c->side + 3 * n;
    for (int of = 0; of < 3; of++) {
        double *sorted = c->side + of * n;
        for (int i = 0; i < n && by_coordinate[of]; i++)
            sorted[i] = by_coordinate[of][c->order[i]];
        x[of] = by_coordinate[of] ? sorted : NULL;
    }
    refdyn_chain_multiply(c, 0, x, result);
    for (int i = 0; i < n; i++)
        y[c->order[i]] = result[i];
    for (int s = 0; s < c->model->coupling_count; s++) {
        double pull = d ? dense_dot(c->by_qd + s * n, d, n) : 0;
        pull += k ? dense_dot(c->by_q + s * n, k, n) : 0;
        dense_add(y, pull, c->pulled + s * n, n);
    }
}

/* ---- Factors ---- */

/* The arrays of a matrix of real numbers, or (wide) of LANES complex ones side by side. */
struct factored {
    int wide, width, border;
    double *factors, *responses, *rows, *corner;
    int *pivot;
};

static struct factored factored_of(const struct refdyn_chain *c, int wide) {
    const int most = border_of(c->model);
    return (struct factored){.wide = wide,
                             .width = refdyn_chain_width(wide),
                             .border = c->border,
                             .factors = c->factors + (wide ? factors_size(c) : 0),
                             .responses = c->responses + (wide ? most * c->n : 0),
                             .rows = c->border_rows + (wide ? most * c->n : 0),
                             .corner = c->corner + (wide ? most * most : 0),
                             .pivot = c->pivot + (wide ? most : 0)};
}

/* Converts real values of all coordinates to numbers by position. */
static void sort(const struct refdyn_chain *c, int wide, const double *values, double *numbers) {
    const int width = refdyn_chain_width(wide);
    memset(numbers, 0, (size_t)(c->n * width) * sizeof *numbers);
    for (int k = 0; k < c->n; k++)
        for (int l = 0; l < (wide ? REFDYN_LANES : 1); l++)
            numbers[k * width + l] = values[c->order[k]];
}

/* base + g first + g^2 second of a row; base NULL: zero */
static void combine_row(const struct refdyn_chain *c, int wide, const double *g, const double *base,
                        const double *first, const double *second, double *row) {
    const int width = refdyn_chain_width(wide);
    double square[2 * REFDYN_LANES] = {0};
    refdyn_chain_add(wide, 1, g, g, square);
    for (int k = 0; k < c->n; k++) {
        const int i = c->order[k];
        for (int p = 0; p < width; p++)
            row[k * width + p] = g[p] * first[i] + square[p] * second[i];
        for (int l = 0; l < (wide ? REFDYN_LANES : 1) && base; l++)
            row[k * width + l] += base[i];
    }
}

/* Computes A^-1 times a real column. */
static void respond(const struct refdyn_chain *c, const struct factored *f, const double *column,
                    double *response) {
    sort(c, f->wide, column, response);
    refdyn_chain_solve_tree(c, f->wide, f->factors, response);
}

/* Returns the matrix of the border in lane l, complex if numbers are wide. */
static double *corner_of(const struct factored *f, int l) {
    return f->corner + l * 2 * f->border * f->border;
}

/* Factors the matrix that remains after elimination of all joints: the rows times the responses, plus 1 for
 * couplings. */
static int factor_corner(struct refdyn_chain *c, const struct factored *f) {
    const int b = f->border, size = c->n * f->width, lanes = f->wide ? REFDYN_LANES : 1;
    for (int i = 0; i < b; i++)
        for (int j = 0; j < b; j++) {
            double entry[2 * REFDYN_LANES];
            refdyn_chain_dot(f->wide, c->n, f->rows + i * size, f->responses + j * size, entry);
            for (int l = 0; l < lanes; l++) {
                double *re = corner_of(f, l) + i * b + j;
                *re = entry[l] + (i == j && i < c->model->coupling_count);
                if (f->wide)
                    re[b * b] = entry[REFDYN_LANES + l];
            }
        }
    int is_regular = 1;
    for (int l = 0; l < lanes && is_regular; l++)
        is_regular = refdyn_lu_factor(f->wide, corner_of(f, l), b, f->pivot + l * b, c->scale);
    return is_regular ? REFDYN_OK : REFDYN_MATRIX_SINGULAR;
}

static int factor(struct refdyn_chain *c, int wide, const double *g, const struct refdyn_border *border) {
    const int n = c->n, couplings = c->model->coupling_count;
    c->border = couplings + border->count;
    const struct factored f = factored_of(c, wide);
    const int size = f.width * n;
    if (refdyn_chain_eliminate(c, wide, g, f.factors) >= 0)
        return REFDYN_MATRIX_SINGULAR;
    for (int s = 0; s < couplings; s++) {
        combine_row(c, wide, g, NULL, c->by_qd + s * n, c->by_q + s * n, f.rows + s * size);
        respond(c, &f, c->pulled + s * n, f.responses + s * size);
    }
    for (int k = 0; k < border->count; k++) {
        const int a = border->places[k] * n, at = (couplings + k) * size;
        combine_row(c, wide, g, border->u + a, border->by_qd + a, border->by_q + a, f.rows + at);
        respond(c, &f, border->u + a, f.responses + at);
    }
    return factor_corner(c, &f);
}

int refdyn_chain_factor(struct refdyn_chain *c, double g, const struct refdyn_border *border) {
    return factor(c, 0, &g, border);
}

int refdyn_chain_factor_all(struct refdyn_chain *c, int count, const double *lambda, double h,
                            const struct refdyn_border *border) {
    double g[2 * REFDYN_LANES];
    for (int l = 0; l < REFDYN_LANES; l++) {
        const int k = l < count ? l : 0; /* unused lanes repeat the first */
        g[l] = h * lambda[2 * k];
        g[REFDYN_LANES + l] = h * lambda[2 * k + 1];
    }
    return factor(c, 1, g, border);
}

/* z = (corner)^-1 z, numbers of the border, lane by lane */
static void solve_corner(const struct factored *f, double *z) {
    const int b = f->border, parts = 1 + f->wide, lanes = f->wide ? REFDYN_LANES : 1;
    double *x = z + b * f->width; /* one lane */
    for (int l = 0; l < lanes; l++) {
        for (int i = 0; i < parts * b; i++)
            x[i] = z[i % b * f->width + i / b * lanes + l];
        refdyn_lu_solve(f->wide, corner_of(f, l), b, f->pivot + l * b, x);
        for (int i = 0; i < parts * b; i++)
            z[i % b * f->width + i / b * lanes + l] = x[i];
    }
}

/*
 * x = x_0 - responses z with x_0 = A^-1 of the right side: couplings need pull = row . x, which acts as z,
 * rows row . x = r with z = -lambda: (row . responses [+ 1]) z = row . x_0 [- r]. In place; z: minus the
 * right sides of the border, followed by scratch. */
static void solve(const struct refdyn_chain *c, const struct factored *f, double *x, double *z) {
    const int n = c->n, size = n * f->width;
    double number[2 * REFDYN_LANES];
    refdyn_chain_solve_tree(c, f->wide, f->factors, x);
    for (int i = 0; i < f->border; i++) {
        refdyn_chain_dot(f->wide, n, f->rows + i * size, x, number);
        dense_add(z + i * f->width, 1, number, f->width);
    }
    solve_corner(f, z);
    for (int i = 0; i < f->border; i++) {
        for (int p = 0; p < f->width; p++)
            number[p] = -z[i * f->width + p];
        refdyn_chain_add(f->wide, n, number, f->responses + i * size, x);
    }
}

void refdyn_chain_solve(struct refdyn_chain *c, double *x) {
    const struct factored f = factored_of(c, 0);
    const int couplings = c->model->coupling_count;
    double *y = c->side, *z = c->side + c->n;
    for (int k = 0; k < c->n; k++)
        y[k] = x[c->order[k]];
    for (int i = 0; i < f.border; i++)
        z[i] = i < couplings ? 0 : -x[c->n + i - couplings];
    solve(c, &f, y, z);
    for (int k = 0; k < c->n; k++)
        x[c->order[k]] = y[k];
}

/* Copies the values of eigenvalue k, one or two for each coordinate, to or from the numbers y. */
static double *exchange(const struct refdyn_chain *c, int is_back, int l, int is_real, double *x, double *y) {
    const int width = refdyn_chain_width(1);
    for (int part = 0; part < (is_real ? 1 : 2); part++, x += c->n)
        for (int k = 0; k < c->n; k++) {
            double *place = y + k * width + part * REFDYN_LANES + l;
            if (is_back)
                x[c->order[k]] = *place;
            else
                *place = x[c->order[k]];
        }
    return x;
}

void refdyn_chain_solve_all(struct refdyn_chain *c, int count, const double *lambda,
                            const struct refdyn_border *border, double *x) {
    const struct factored f = factored_of(c, 1);
    const int n = c->n, couplings = c->model->coupling_count;
    double *row = c->side, *right = row + 4 * n, *y = right + n * f.width, *z = y + n * f.width, *at = x;
    const double *const mass[3] = {right, NULL, NULL};
    memset(right, 0, (size_t)(n * f.width) * sizeof *right);
    for (int l = 0; l < count; l++)
        at = exchange(c, 0, l, lambda[2 * l + 1] == 0, at, right);
    refdyn_chain_multiply(c, 1, mass, y);
    memset(z, 0, (size_t)(couplings * f.width) * sizeof *z);
    for (int k = 0; k < border->count; k++) {
        double *met = z + (couplings + k) * f.width;
        sort(c, 0, border->u + border->places[k] * n, row);
        refdyn_chain_dot_real(1, n, row, right, met);
        for (int p = 0; p < f.width; p++)
            met[p] = -met[p];
    }
    solve(c, &f, y, z);
    at = x;
    for (int l = 0; l < count; l++)
        at = exchange(c, 1, l, lambda[2 * l + 1] == 0, at, y);
}
