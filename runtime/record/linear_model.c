/*
 * The linear model about a state in independent coordinates and rates, with the rows in force.
 *
 * Input: the linear equations of the motion (small_motions.c), rows of all three levels included. Output: A,
 * B, C, D and the eigenvalues of A. With s = (y, w), the independent coordinates and rates, the rows leave
 *     x = Z y,   x' = N w + G x,   u x'' + G_q x + G_qd x' + g_x dx = 0
 * (struct record_freedom), and x'' follows from M x'' + D x' + K x + f_x dx = u^T mu in the directions that
 * all rows leave free. Coordinates are measured in 1/sqrt(M_jj).
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "runtime/record/record.h"

/* A linear model under construction. Columns: one for each state, then one for each input. */
struct building {
    struct record_linear_model *model;
    const struct record_algebra *algebra;
    int n, m, inputs, columns; /* free coordinates, rows */
    double *unit;              /* (n) 1/sqrt(M_jj) */
    struct record_freedom position, velocity, acceleration;
    double *x, *v, *a; /* (n x columns) changes of coordinates, rates and accelerations */
};

static const struct refdyn_model *model_of(const struct building *b) {
    return b->model->motions.work->model;
}

static void call(const struct building *b, refdyn_function *function, const double *qd, double *out) {
    const struct record_small_motions *motions = &b->model->motions;
    function(motions->work->p, motions->work->x, motions->t, motions->q, qd, out);
}

/* Rows of a matrix (m x n) up to a level, their columns in units. */
static double *rows_up_to(const struct building *b, const double *matrix, enum refdyn_row_level level,
                          int *count) {
    const struct record_linear *linear = &b->model->motions.linear;
    double *rows = record_allocate_matrix(b->algebra, b->m, b->n);
    *count = 0;
    for (int i = 0; i < b->m; i++) {
        if (linear->level[i] > level)
            continue;
        for (int j = 0; j < b->n; j++)
            rows[*count * b->n + j] = matrix[i * b->n + j] * b->unit[j];
        ++*count;
    }
    return rows;
}

/* ---- States ---- */

static void choose_states(struct building *b) {
    struct record_linear_model *model = b->model;
    const struct record_linear *linear = &model->motions.linear;
    int count;
    double *rows = rows_up_to(b, linear->u, REFDYN_POSITION, &count);
    record_find_freedom(&b->position, b->algebra, rows, count, b->n, NULL, 0);
    record_freedom_drop(&b->position, linear->states);
    double *psi_q = rows_up_to(b, linear->psi_q, REFDYN_VELOCITY, &count);
    rows = rows_up_to(b, linear->u, REFDYN_VELOCITY, &count);
    record_find_freedom(&b->velocity, b->algebra, rows, count, b->n, psi_q, b->n);
    const int positions = b->position.free, rates = b->velocity.free;
    model->position_count = positions;
    model->size = positions + rates;
    b->columns = model->size + b->inputs;
    model->state = record_allocate(b->algebra, (size_t)model->size, sizeof *model->state);
    for (int i = 0; i < model->size; i++)
        model->state[i] = i < positions ? b->position.column[b->position.rank + i]
                                        : b->velocity.column[b->velocity.rank + i - positions];
}

/* x = Z y, x' = N w + G x, in units. */
static void move_states(struct building *b) {
    const int n = b->n, positions = b->model->position_count, rates = b->model->size - positions;
    b->x = record_allocate_matrix(b->algebra, n, b->columns);
    b->v = record_allocate_matrix(b->algebra, n, b->columns);
    for (int i = 0; i < n; i++) {
        memcpy(b->x + i * b->columns, b->position.basis + i * positions, (size_t)positions * sizeof *b->x);
        memcpy(b->v + i * b->columns + positions, b->velocity.basis + i * rates,
               (size_t)rates * sizeof *b->v);
    }
    record_add_product(b->v, 1, b->velocity.drift, b->x, n, n, b->columns);
}

/* ---- Accelerations ---- */

/* rows (count x columns) += the columns of inputs of `by_inputs` (count x inputs), in units if they are
 * forces
 */
static void add_inputs(const struct building *b, double *rows, const double *by_inputs, const int *place,
                       int count, double factor) {
    for (int i = 0; i < count; i++)
        for (int k = 0; k < b->inputs; k++)
            rows[i * b->columns + b->model->size + k] +=
                factor * (place ? b->unit[i] : 1) * by_inputs[(place ? place[i] : i) * b->inputs + k];
}

static double *in_units(const struct building *b, const double *matrix, int rows, bool both) {
    double *out = record_allocate_matrix(b->algebra, rows, b->n);
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < b->n; j++)
            out[i * b->n + j] = (both ? b->unit[i] : 1) * matrix[i * b->n + j] * b->unit[j];
    return out;
}

/* x'' = N a + c with u N = 0 and u c = -(G_q x + G_qd x' + g_x dx), N^T M N a = -N^T (K x + D x' + f_x dx + M
 * c). */
static int accelerate(struct building *b) {
    const struct record_linear *linear = &b->model->motions.linear;
    const int n = b->n, m = b->m, columns = b->columns, all = model_of(b)->n;
    double *by_inputs = record_allocate_matrix(b->algebra, all + m, b->inputs); /* f_x, g_x */
    if (b->inputs)
        call(b, model_of(b)->tangent_x, linear->given, by_inputs);
    double *rows = record_allocate_matrix(b->algebra, m, columns);
    record_add_product(rows, 1, in_units(b, linear->G_q, m, false), b->x, m, n, columns);
    record_add_product(rows, 1, in_units(b, linear->G_qd, m, false), b->v, m, n, columns);
    add_inputs(b, rows, by_inputs + all * b->inputs, NULL, m, 1);
    record_find_freedom(&b->acceleration, b->algebra, in_units(b, linear->u, m, false), m, n, rows, columns);
    const int free = n - b->acceleration.rank;
    const double *N = b->acceleration.basis, *M = in_units(b, linear->M, n, true);
    double *right = record_allocate_matrix(b->algebra, n, columns);
    record_add_product(right, -1, in_units(b, linear->K, n, true), b->x, n, n, columns);
    record_add_product(right, -1, in_units(b, linear->D, n, true), b->v, n, n, columns);
    record_add_product(right, -1, M, b->acceleration.drift, n, n, columns);
    add_inputs(b, right, by_inputs, linear->place, n, -1);
    double *mass =
        record_product_of_columns(b->algebra, N, free, record_product(b->algebra, M, N, n, n, free), free, n);
    double *a = record_product_of_columns(b->algebra, N, free, right, columns, n);
    if (!record_factor(mass, free))
        return REFDYN_MASS_NOT_POSITIVE;
    record_solve_factored(mass, free, a, columns);
    b->a = b->acceleration.drift;
    record_add_product(b->a, 1, N, a, n, free, columns);
    return REFDYN_OK;
}

/* From units to those of the model, states included. */
static void leave_units(struct building *b, double *matrix) {
    for (int i = 0; i < b->n; i++)
        for (int k = 0; k < b->columns; k++)
            matrix[i * b->columns + k] *= b->unit[i] / (k < b->model->size ? b->unit[b->model->state[k]] : 1);
}

/* ---- Matrices ---- */

static void put_row(const struct building *b, const double *row, double *of_states, double *of_inputs) {
    memcpy(of_states, row, (size_t)b->model->size * sizeof *row);
    memcpy(of_inputs, row + b->model->size, (size_t)b->inputs * sizeof *row);
}

static void fill_states(const struct building *b) {
    struct record_linear_model *model = b->model;
    const struct record_small_motions *motions = &model->motions;
    model->A = record_allocate_matrix(b->algebra, model->size, model->size);
    model->B = record_allocate_matrix(b->algebra, model->size, b->inputs);
    model->rate = record_allocate_matrix(b->algebra, model->size, 1);
    for (int i = 0; i < model->size; i++) {
        const int state = model->state[i], place = motions->linear.place[state];
        const double *change = (i < model->position_count ? b->v : b->a) + state * b->columns;
        put_row(b, change, model->A + i * model->size, model->B + i * b->inputs);
        model->rate[i] = motions->linear.given[(i < model->position_count ? 0 : model_of(b)->n) + place];
    }
}

/* out (count x columns) += by (count x all coordinates) * changes of the free coordinates */
static void add_changes(const struct building *b, double *out, const double *by, const double *changes,
                        int count) {
    const int *place = b->model->motions.linear.place;
    const int all = model_of(b)->n;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < b->n; j++)
            record_add_product(out + i * b->columns, by[i * all + place[j]], &(double){1},
                               changes + j * b->columns, 1, 1, b->columns);
}

/* Rows of r, rd and rdd of all points, each (points x 3). */
static void move_points(const struct building *b, double *of_points[3]) {
    const struct refdyn_model *model = model_of(b);
    const int count = 3 * model->point_count, all = model->n;
    double *by = record_allocate_matrix(b->algebra, 5 * count, all); /* r_q, rd_q, rd_qd, rdd_q, rdd_qd */
    const double *C = by;
    call(b, model->d_points, b->model->motions.linear.given, by);
    for (int order = 0; order < 3; order++)
        of_points[order] = record_allocate_matrix(b->algebra, count, b->columns);
    add_changes(b, of_points[0], C, b->x, count);
    add_changes(b, of_points[1], by + count * all, b->x, count);
    add_changes(b, of_points[1], by + 2 * count * all, b->v, count);
    add_changes(b, of_points[2], by + 3 * count * all, b->x, count);
    add_changes(b, of_points[2], by + 4 * count * all, b->v, count);
    add_changes(b, of_points[2], C, b->a, count);
}

static double *move_courses(const struct building *b) {
    const int count = model_of(b)->course_count, all = model_of(b)->n;
    double *by = record_allocate_matrix(b->algebra, count, 2 * all + b->inputs); /* q, qd, x */
    double *out = record_allocate_matrix(b->algebra, count, b->columns);
    call(b, model_of(b)->d_course, b->model->motions.qd, by);
    add_changes(b, out, by, b->x, count);
    add_changes(b, out, by + count * all, b->v, count);
    add_inputs(b, out, by + 2 * count * all, NULL, count, 1);
    return out;
}

static void fill_outputs(const struct building *b) {
    struct record_linear_model *model = b->model;
    const struct refdyn_model *of = model_of(b);
    double *of_points[3], *at_C, *at_D;
    model->output_count = 9 * of->point_count + of->course_count;
    at_C = model->C = record_allocate_matrix(b->algebra, model->output_count, model->size);
    at_D = model->D = record_allocate_matrix(b->algebra, model->output_count, b->inputs);
    if (of->point_count)
        move_points(b, of_points);
    for (int i = 0; i < 9 * of->point_count; i++, at_C += model->size, at_D += b->inputs)
        put_row(b, of_points[i / 3 % 3] + (i / 9 * 3 + i % 3) * b->columns, at_C, at_D);
    const double *courses = of->course_count ? move_courses(b) : NULL;
    for (int i = 0; i < of->course_count; i++, at_C += model->size, at_D += b->inputs)
        put_row(b, courses + i * b->columns, at_C, at_D);
}

/* ---- Eigenvalues ---- */

static int by_size(const void *a, const void *b) {
    const double complex x = *(const double complex *)a, y = *(const double complex *)b;
    const double apart = cabs(x) - cabs(y);
    if (apart != 0)
        return apart < 0 ? -1 : 1;
    return (cimag(x) < cimag(y)) - (cimag(x) > cimag(y)); /* the positive one of a pair first */
}

/* Does the pencil of small motions have the eigenvalues of A? It knows no acceleration rows, no rates and no
 * accelerations. */
static bool is_equilibrium(const struct building *b) {
    const struct record_linear *linear = &b->model->motions.linear;
    const int all = model_of(b)->n;
    for (int j = 0; j < refdyn_joint_count(model_of(b)); j++)
        if (linear->given[j] != 0)
            return false;
    for (int i = 0; i < b->m; i++) {
        if (linear->level[i] == REFDYN_ACCELERATION)
            return false;
        for (int j = 0; j < b->n && linear->level[i] == REFDYN_POSITION; j++)
            if (linear->psi_q[i * b->n + j] != 0)
                return false;
    }
    double *force = record_allocate_matrix(b->algebra, b->n, 1);
    for (int j = 0; j < b->n; j++)
        record_add_product(force + j, 1, linear->M + j * b->n + j, linear->given + all + linear->place[j], 1,
                           1, 1);
    return record_find_unbalanced(linear, force) < 0;
}

/* A conjugate pair occurs once in the spectrum. The remaining eigenvalues are 0. */
static int list_spectrum(struct building *b) {
    struct record_small_motions *motions = &b->model->motions;
    const int status = record_find_spectrum(&motions->spectrum, &motions->linear, b->algebra);
    int count = 0;
    for (int i = 0; status == REFDYN_OK && i < motions->spectrum.count; i++) {
        const double complex value = motions->spectrum.modes[i].eigenvalue;
        if (value != 0)
            b->model->eigenvalues[count++] = value;
        if (cimag(value) != 0)
            b->model->eigenvalues[count++] = conj(value);
    }
    return status;
}

static int list_eigenvalues_of_A(struct building *b) {
    const int size = b->model->size;
    double *T = record_allocate_matrix(b->algebra, size, size),
           *re = record_allocate_matrix(b->algebra, 2, size),
           *vectors = record_allocate_matrix(b->algebra, 2 * size, size);
    memcpy(T, b->model->A, (size_t)size * (size_t)size * sizeof *T);
    if (!b->algebra->eigen(b->algebra->context, size, T, re, re + size, vectors, vectors + size * size))
        return REFDYN_NOT_FINITE;
    for (int i = 0; i < size; i++)
        b->model->eigenvalues[i] = re[i] + I * re[size + i];
    return REFDYN_OK;
}

static int find_eigenvalues(struct building *b) {
    struct record_linear_model *model = b->model;
    int status = REFDYN_OK;
    model->eigenvalues = record_allocate(b->algebra, (size_t)model->size, sizeof *model->eigenvalues);
    if (model->size)
        status = is_equilibrium(b) ? list_spectrum(b) : list_eigenvalues_of_A(b);
    qsort(model->eigenvalues, (size_t)model->size, sizeof *model->eigenvalues, by_size);
    return status;
}

/* ---- The model ---- */

/* Finds a position or velocity row whose residual depends on an input. d_rows: psi and k by q, qd and x,
 * then phi by q and x. */
static void find_moved_row(const struct building *b) {
    const struct refdyn_model *of = model_of(b);
    const int n = of->n, m = b->m, inputs = b->inputs;
    if (!m || !inputs)
        return;
    double *rows = record_allocate_matrix(b->algebra, 3 * m, 2 * n + inputs);
    call(b, of->d_rows, b->model->motions.qd, rows);
    const double *psi_x = rows + 2 * m * n, *phi_x = rows + m * (5 * n + 2 * inputs);
    for (int i = m * inputs - 1; i >= 0; i--)
        if (b->model->motions.linear.level[i / inputs] != REFDYN_ACCELERATION &&
            (psi_x[i] != 0 || phi_x[i] != 0)) {
            b->model->moved_row = i / inputs;
            b->model->moving_input = i % inputs;
        }
}

/* Without gains, k is -v: the linear model has no poles of the stabilisation. */
static void clear_gains(struct refdyn_workspace *work) {
    for (int i = 0; i < 2 * work->m; i++)
        if (work->model->gains && work->model->gains[i] >= 0)
            work->p[work->model->gains[i]] = 0;
}

/* Linearises the motion. If held coordinates may move, a second pass uses the accelerations and multipliers
 * of the first. */
static int linearise(struct record_linear_model *model, const struct record_algebra *algebra) {
    struct record_small_motions *motions = &model->motions;
    motions->accelerates = true;
    const int status = record_linearise(motions, algebra);
    if (status != REFDYN_OK || !model->moves_held)
        return status;
    motions->given = motions->linear.given;
    motions->held = record_allocate(algebra, (size_t)motions->work->n, sizeof *motions->held);
    return record_linearise(motions, algebra);
}

int record_find_linear_model(struct record_linear_model *model, const struct record_algebra *algebra) {
    struct building b = {.model = model, .algebra = algebra};
    model->moved_row = model->moving_input = -1;
    clear_gains(model->motions.work);
    int status = linearise(model, algebra);
    if (status != REFDYN_OK)
        return status;
    b.n = model->motions.linear.n;
    b.m = model->motions.linear.m;
    b.inputs = model_of(&b)->input_count;
    find_moved_row(&b);
    if (model->moved_row >= 0)
        return REFDYN_OK;
    b.unit = record_allocate_matrix(algebra, b.n, 1);
    for (int j = 0; j < b.n; j++)
        b.unit[j] = 1 / sqrt(model->motions.linear.M[j * (b.n + 1)]);
    choose_states(&b);
    move_states(&b);
    status = accelerate(&b);
    if (status != REFDYN_OK)
        return status;
    leave_units(&b, b.x);
    leave_units(&b, b.v);
    leave_units(&b, b.a);
    fill_states(&b);
    fill_outputs(&b);
    return find_eigenvalues(&b);
}

/* ---- Entries ---- */

static void put_matrix(const struct record_writer *writer, const char *key, const double *matrix, int rows,
                       int columns) {
    writer->open(writer->context, key, '[');
    for (int i = 0; i < rows; i++)
        record_put_array(writer, NULL, matrix + i * columns, columns);
    writer->close(writer->context, ']');
}

static void put_states(const struct record_linear_model *model, const struct record_writer *writer) {
    const struct refdyn_model *of = model->motions.work->model;
    char name[256];
    writer->open(writer->context, "states", '[');
    for (int i = 0; i < model->size; i++) {
        const int place = model->motions.linear.place[model->state[i]];
        const int is_rate = i >= model->position_count && place < refdyn_joint_count(of);
        snprintf(name, sizeof name, "%s%s", of->coordinates[place].name, is_rate ? "_d" : "");
        writer->text(writer->context, NULL, name);
    }
    writer->close(writer->context, ']');
}

static void put_inputs(const struct refdyn_model *of, const struct record_writer *writer) {
    writer->open(writer->context, "inputs", '[');
    for (int i = 0; i < of->input_count; i++)
        writer->text(writer->context, NULL, of->inputs[i].name);
    writer->close(writer->context, ']');
}

/* As the columns of a motion. */
static void put_outputs(const struct refdyn_model *of, const struct record_writer *writer) {
    static const char *const rates[] = {"", "d", "dd"};
    char name[256];
    writer->open(writer->context, "outputs", '[');
    for (int i = 0; i < 9 * of->point_count; i++) {
        snprintf(name, sizeof name, "%s_%c%s", of->points[i / 9], "xyz"[i % 3], rates[i / 3 % 3]);
        writer->text(writer->context, NULL, name);
    }
    for (int i = 0; i < of->course_count; i++)
        writer->text(writer->context, NULL, of->courses[i]);
    writer->close(writer->context, ']');
}

void record_put_linear_model(const struct record_linear_model *model, const struct record_writer *writer) {
    const struct record_small_motions *motions = &model->motions;
    const int size = model->size, inputs = motions->work->model->input_count, outputs = model->output_count;
    put_states(model, writer);
    put_inputs(motions->work->model, writer);
    put_outputs(motions->work->model, writer);
    put_matrix(writer, "A", model->A, size, size);
    put_matrix(writer, "B", model->B, size, inputs);
    put_matrix(writer, "C", model->C, outputs, size);
    put_matrix(writer, "D", model->D, outputs, inputs);
    record_put_array(writer, "rate", model->rate, size);
    record_put_state(motions->work->model, motions->q, motions->qd, "state_values", writer);
    writer->number(writer->context, "t", motions->t);
    writer->open(writer->context, "eigenvalues", '[');
    for (int i = 0; i < size; i++)
        record_put_array(
            writer, NULL,
            (const double[]){creal(model->eigenvalues[i]) + 0.0, cimag(model->eigenvalues[i]) + 0.0}, 2);
    writer->close(writer->context, ']');
}
