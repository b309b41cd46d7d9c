/* What is said when the numbers fail or rows are redundant: the reason, the time and the state by the
 * coordinates' names. */
#include "commands.h"
#include "output.h"

#include <lapacke.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Beyond this, accelerations have lost a quarter of their digits. */
static const double singular = 1e4;

static void print_place(const struct scene *scene) {
    const struct refdyn_fault *fault = &scene->work.fault;
    if (fault->row >= 0 && fault->row < scene->model->m)
        fprintf(stderr, ", constraint %s", scene->model->rows[fault->row].name);
    if (fault->coordinate >= 0 && fault->coordinate < scene->model->n)
        fprintf(stderr, ", coordinate %s", scene->model->coordinates[fault->coordinate].name);
}

static void print_values(const char *title, const struct refdyn_model *model, const double *values,
                         const char *suffix) {
    char text[NUMBER_LENGTH];
    fprintf(stderr, "  %s:", title);
    for (int i = 0; i < model->n; i++)
        fprintf(stderr, " %s%s = %s%s", model->coordinates[i].name, suffix, exact_text(values[i], text),
                i + 1 < model->n ? "," : "\n");
}

enum status numbers_failed(const struct scene *scene, int result, double t, const double *q,
                           const double *qd) {
    char text[NUMBER_LENGTH];
    fprintf(stderr, "refdyn: %s: t = %s s: %s", scene->model->name, exact_text(t, text),
            refdyn_status_text(result));
    print_place(scene);
    fputs("\n", stderr);
    print_values("q", scene->model, q, "");
    if (qd)
        print_values("qd", scene->model, qd, "_d");
    return STATUS_NUMBERS;
}

/* Largest over smallest singular value of the independent rows, columns scaled by 1/sqrt(M_jj); -1: not
 * found. */
static double condition_of_rows(const struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    double *rows = allocate((size_t)(rank * n), sizeof *rows),
           *values = allocate((size_t)rank, sizeof *values);
    double *room = allocate((size_t)rank, sizeof *room);
    for (int a = 0; a < rank; a++)
        for (int j = 0; j < n; j++)
            rows[a * n + j] = work->u[work->partition.row[a] * n + j] / sqrt(work->M[j * n + j]);
    const lapack_int info =
        LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', rank, n, rows, n, values, NULL, 1, NULL, 1, room);
    const double condition = info == 0 ? values[0] / values[rank - 1] : -1;
    free(room);
    free(values);
    free(rows);
    return condition;
}

bool print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
    if (work->partition.rank <= 0 || refdyn_equations(work, t, q, qd) != REFDYN_OK)
        return false;
    const double condition = condition_of_rows(work);
    if (!(condition > 0))
        return false;
    fprintf(stderr, "refdyn: the condition of the constraint rows there is %.3g%s\n", condition,
            condition > singular
                ? ": a singular position, or the end of what the programme lets the links reach"
                : "");
    return condition > singular;
}

void print_redundant_rows(const struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    for (int a = partition->rank; partition->rank >= 0 && a < work->m; a++)
        fprintf(stderr, "%s%s", a == partition->rank ? "refdyn: warning: redundant rows, left out: " : ", ",
                work->model->rows[partition->row[a]].name);
    if (partition->rank >= 0 && partition->rank < work->m)
        fputs("\n", stderr);
}
