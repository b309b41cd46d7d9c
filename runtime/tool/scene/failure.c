/* Messages about failed computations and redundant rows: the reason, the time, and the state with the names
 * of the coordinates. */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"

#include <lapacke.h>
#include <math.h>
#include <stdio.h>

/* a larger condition number costs accelerations a quarter of their digits */
static const double singular = 1e4;

enum { SHOWN_ALL = 8, SHOWN_LARGEST = 3, SHOWN_ROWS = 3 };

static void print_place(const struct scene *scene) {
    const struct refdyn_fault *fault = &scene->work.fault;
    if (fault->row >= 0 && fault->row < scene->model->m)
        fprintf(stderr, ", %s %s",
                fault->row < refdyn_programme_rows(scene->model) ? "constraint" : "contact",
                scene->model->rows[fault->row].name);
    if (fault->coordinate >= 0 && fault->coordinate < scene->model->n)
        fprintf(stderr, ", coordinate %s", scene->model->coordinates[fault->coordinate].name);
}

/* Selects all values; of many, the one that failed, those that are not finite, and the largest. */
static bool is_shown(const struct refdyn_model *model, const double *values, int i, int fault) {
    int larger = 0;
    if (model->n <= SHOWN_ALL || i == fault || !isfinite(values[i]))
        return true;
    for (int j = 0; j < model->n; j++)
        larger += fabs(values[j]) > fabs(values[i]) || (fabs(values[j]) == fabs(values[i]) && j < i);
    return larger < SHOWN_LARGEST;
}

static void print_values(const char *title, const struct refdyn_model *model, const double *values,
                         const char *suffix, int fault) {
    char text[NUMBER_LENGTH];
    int shown = 0;
    fprintf(stderr, "  %s:", title);
    for (int i = 0; i < model->n && shown < SHOWN_ALL; i++)
        if (is_shown(model, values, i, fault))
            fprintf(stderr, "%s %s%s = %s", shown++ ? "," : "", model->coordinates[i].name, suffix,
                    exact_text(values[i], text));
    if (shown < model->n)
        fprintf(stderr, " (%d of %d: failing, or the largest)", shown, model->n);
    fputc('\n', stderr);
}

/* Prints how deeply bodies penetrate each other. */
static void print_gap(const struct scene *scene, double t, const double *q, const double *qd) {
    const struct refdyn_model *model = scene->model;
    const struct refdyn_workspace *work = &scene->work;
    char text[NUMBER_LENGTH];
    double *values = format_allocate((size_t)model->event_count + (size_t)model->kink_count, sizeof *values);
    model->event(work->p, work->x, t, q, qd, values);
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact == work->fault.row + 1)
            fprintf(stderr, "  gap: %s = %s; it must not be negative\n", model->events[i].name,
                    exact_text(values[i], text));
}

enum status scene_numbers_failed(const struct scene *scene, int result, double t, const double *q,
                                 const double *qd) {
    char text[NUMBER_LENGTH];
    fprintf(stderr, "refdyn: %s: t = %s s: %s", scene->model->name, exact_text(t, text),
            refdyn_status_text(result));
    print_place(scene);
    fputs("\n", stderr);
    if (result == REFDYN_CONTACT_INSIDE)
        print_gap(scene, t, q, qd);
    print_values("q", scene->model, q, "", scene->work.fault.coordinate);
    if (qd)
        print_values("qd", scene->model, qd, "_d", scene->work.fault.coordinate);
    return STATUS_NUMBERS;
}

/* Returns phi of row a, or psi if it is no position row. */
static double residual_of(const struct refdyn_workspace *work, int a) {
    return work->model->rows[a].level == REFDYN_POSITION ? work->phi[a] : work->psi[a];
}

void scene_print_residuals(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                           const char *where) {
    char text[NUMBER_LENGTH];
    double below = INFINITY;
    if (work->m == 0 || refdyn_equations(work, t, q, qd) != REFDYN_OK)
        return;
    fprintf(stderr, "refdyn: %s is off the programme by", where);
    for (int k = 0; k < SHOWN_ROWS && k < work->m; k++) {
        int largest = -1;
        for (int a = 0; a < work->m; a++)
            if (fabs(residual_of(work, a)) < below &&
                (largest < 0 || fabs(residual_of(work, a)) > fabs(residual_of(work, largest))))
                largest = a;
        if (largest < 0)
            break;
        below = fabs(residual_of(work, largest));
        fprintf(stderr, "%s %s: %s = %s", k ? "," : "", work->model->rows[largest].name,
                work->model->rows[largest].level == REFDYN_POSITION ? "phi" : "psi",
                exact_text(residual_of(work, largest), text));
    }
    fputc('\n', stderr);
}

/* The ratio of the largest to the smallest singular value of the independent rows, with columns scaled by
 * 1/sqrt(M_jj); -1 if LAPACK fails. */
static double condition_of_rows(const struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    double *rows = format_allocate_matrix(rank, n), *values = format_allocate_matrix(rank, 1),
           *room = format_allocate_matrix(rank, 1);
    for (int a = 0; a < rank; a++)
        for (int j = 0; j < n; j++)
            rows[a * n + j] = work->u[work->partition.row[a] * n + j] / sqrt(work->M[j * n + j]);
    const lapack_int info =
        LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', rank, n, rows, n, values, NULL, 1, NULL, 1, room);
    return info == 0 ? values[0] / values[rank - 1] : -1;
}

bool scene_print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd) {
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

/* The rows of free contacts, which follow the rows of the programme, are not reported. */
void scene_print_rows_left_out(const struct refdyn_model *model, const int *rows, int count) {
    const int end = refdyn_programme_rows(model);
    int shown = 0;
    for (int i = 0; i < count; i++)
        if (rows[i] < end)
            fprintf(stderr, "%s%s", shown++ ? ", " : "refdyn: warning: redundant rows, left out: ",
                    model->rows[rows[i]].name);
    if (shown > 0)
        fputc('\n', stderr);
}

/* Returns whether no coordinate changes the residual of this row at the state of the last evaluation. */
static bool has_no_slope(const struct refdyn_workspace *work, int row) {
    for (int j = 0; j < work->n; j++)
        if (work->u[row * work->n + j] != 0)
            return false;
    return true;
}

void scene_print_redundant_rows(const struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    if (partition->rank < 0)
        return;
    scene_print_rows_left_out(work->model, partition->row + partition->rank, work->m - partition->rank);
    for (int i = partition->rank; i < work->m; i++)
        if (partition->row[i] < refdyn_programme_rows(work->model) && has_no_slope(work, partition->row[i]))
            fprintf(stderr,
                    "refdyn: warning: %s has no slope there: no coordinate changes its residual; write what "
                    "is to be 0 without powers, products or abs\n",
                    work->model->rows[partition->row[i]].name);
}
