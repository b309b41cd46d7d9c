/* A motion as CSV: see table.h. */
#include "table.h"
#include "output.h"

#include <stdlib.h>

static const char *const axes[] = {"x", "y", "z"};
static const char *const rates[] = {"", "d", "dd"};

static void put_header(const struct table *table) {
    const struct refdyn_model *model = table->drive->work->model;
    FILE *out = table->out;
    fputc('t', out);
    for (int i = 0; i < model->n; i++)
        fprintf(out, ",%s", model->coordinates[i].name);
    for (int i = 0; i < model->n; i++)
        fprintf(out, ",%s_d", model->coordinates[i].name);
    for (int point = 0; point < model->point_count; point++)
        for (int rate = 0; rate < 3; rate++)
            for (int axis = 0; axis < 3; axis++)
                fprintf(out, ",%s_%s%s", model->points[point], axes[axis], rates[rate]);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level == REFDYN_POSITION)
            fprintf(out, ",phi_%d", i + 1);
    for (int i = 0; i < model->m; i++)
        if (model->rows[i].level != REFDYN_ACCELERATION)
            fprintf(out, ",psi_%d", i + 1);
    fputs(",energy", out);
    for (int i = 0; i < model->n; i++)
        fprintf(out, ",force_%s", model->coordinates[i].name);
    for (int i = 0; i < model->input_count; i++)
        fprintf(out, ",%s", model->inputs[i].name);
    for (int i = 0; i < model->course_count; i++)
        fprintf(out, ",%s", model->courses[i]);
    fputc('\n', out);
}

void table_start(struct table *table, FILE *out, const struct refdyn_drive *drive) {
    const struct refdyn_model *model = drive->work->model;
    size_t n = (size_t)model->n, columns = 3 * (size_t)model->point_count;
    *table = (struct table){.out = out, .drive = drive};
    table->room = allocate(n + columns * (n + 3) + (size_t)model->course_count, sizeof *table->room);
    put_header(table);
}

static void put_value(const struct table *table, double value) {
    fputc(',', table->out);
    print_number(table->out, value);
}

static void put_values(const struct table *table, const double *values, int count) {
    for (int i = 0; i < count; i++)
        put_value(table, values[i]);
}

/* rdd = C qdd + d */
static void add_accelerations(const struct refdyn_drive *drive, const double *C, double *rdd, int rows) {
    int n = drive->work->n;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < n; j++)
            rdd[i] += C[i * n + j] * drive->qdd[j];
}

static void put_points(const struct table *table) {
    const struct refdyn_drive *drive = table->drive;
    const struct refdyn_workspace *work = drive->work;
    const struct refdyn_model *model = work->model;
    int rows = 3 * model->point_count;
    double *r = table->room, *rd = r + rows, *rdd = rd + rows, *C = rdd + rows;
    if (rows == 0)
        return;
    model->r(work->p, work->x, drive->t, drive->q, drive->qd, r);
    model->rd(work->p, work->x, drive->t, drive->q, drive->qd, rd);
    model->d(work->p, work->x, drive->t, drive->q, drive->qd, rdd);
    model->C(work->p, work->x, drive->t, drive->q, drive->qd, C);
    add_accelerations(drive, C, rdd, rows);
    for (int point = 0; point < model->point_count; point++) {
        put_values(table, r + 3 * point, 3);
        put_values(table, rd + 3 * point, 3);
        put_values(table, rdd + 3 * point, 3);
    }
}

static void put_residuals(const struct table *table) {
    const struct refdyn_workspace *work = table->drive->work;
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level == REFDYN_POSITION)
            put_value(table, work->phi[i]);
    for (int i = 0; i < work->m; i++)
        if (work->model->rows[i].level != REFDYN_ACCELERATION)
            put_value(table, work->psi[i]);
}

static void put_courses(const struct table *table) {
    const struct refdyn_drive *drive = table->drive;
    const struct refdyn_workspace *work = drive->work;
    const struct refdyn_model *model = work->model;
    if (!model->course_count)
        return;
    model->course(work->p, work->x, drive->t, drive->q, drive->qd, table->room);
    put_values(table, table->room, model->course_count);
}

void table_row(struct table *table) {
    const struct refdyn_drive *drive = table->drive;
    int n = drive->work->n;
    double energy[2] = {0, 0};
    print_number(table->out, drive->t);
    put_values(table, drive->q, n);
    put_values(table, drive->qd, n);
    put_points(table);
    put_residuals(table);
    refdyn_energies(drive->work, drive->t, drive->q, drive->qd, energy);
    put_value(table, energy[0] + energy[1]);
    refdyn_programme_force(drive->work, drive->qdd, table->room, NULL);
    put_values(table, table->room, n);
    put_values(table, drive->work->x, drive->work->model->input_count);
    put_courses(table);
    fputc('\n', table->out);
}

void table_release(struct table *table) {
    free(table->room);
    table->room = NULL;
}
