/* What is said when the numbers fail or rows are redundant: the reason, the time and the state by the
 * coordinates' names. */
#include "commands.h"
#include "output.h"

#include <stdio.h>

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

void print_redundant_rows(const struct refdyn_workspace *work) {
    const struct refdyn_partition *partition = &work->partition;
    for (int a = partition->rank; partition->rank >= 0 && a < work->m; a++)
        fprintf(stderr, "%s%s", a == partition->rank ? "refdyn: warning: redundant rows, left out: " : ", ",
                work->model->rows[partition->row[a]].name);
    if (partition->rank >= 0 && partition->rank < work->m)
        fputs("\n", stderr);
}
