/* Messages about failed computations and redundant rows: the reason, the time, and the state with the names
 * of the coordinates. */
#include "runtime/record/record.h"

#include <math.h>
#include <stdlib.h>

enum { FEWEST_DIGITS = 15, MOST_DIGITS = 17 };

const char *record_number(double value, char text[static RECORD_NUMBER_LENGTH]) {
    for (int digits = FEWEST_DIGITS; digits <= MOST_DIGITS; digits++) {
        snprintf(text, RECORD_NUMBER_LENGTH, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}

/* a larger condition number costs accelerations a quarter of their digits */
static const double singular = 1e4;

enum { SHOWN_ALL = 8, SHOWN_LARGEST = 3, SHOWN_ROWS = 3 };

static void print_place(const struct refdyn_workspace *work, FILE *out) {
    const struct refdyn_fault *fault = &work->fault;
    if (fault->row >= 0 && fault->row < work->model->m)
        fprintf(out, ", %s %s", fault->row < refdyn_programme_rows(work->model) ? "constraint" : "contact",
                work->model->rows[fault->row].name);
    if (fault->coordinate >= 0 && fault->coordinate < work->model->n)
        fprintf(out, ", %s %s", fault->coordinate < refdyn_joint_count(work->model) ? "coordinate" : "state",
                work->model->coordinates[fault->coordinate].name);
}

/* Selects all values from `first` to before `end`; of many, the one that failed, those that are not finite,
 * and the largest. */
static bool is_shown(const double *values, int first, int end, int i, int fault) {
    int larger = 0;
    if (end - first <= SHOWN_ALL || i == fault || !isfinite(values[i]))
        return true;
    for (int j = first; j < end; j++)
        larger += fabs(values[j]) > fabs(values[i]) || (fabs(values[j]) == fabs(values[i]) && j < i);
    return larger < SHOWN_LARGEST;
}

/* Prints the values of joints, or of states. */
static void print_values(const char *title, const struct refdyn_model *model, bool are_states,
                         const double *values, const char *suffix, int fault, FILE *out) {
    const int joints = refdyn_joint_count(model), first = are_states ? joints : 0,
              end = are_states ? model->n : joints;
    char text[RECORD_NUMBER_LENGTH];
    int shown = 0;
    if (first == end)
        return;
    fprintf(out, "  %s:", title);
    for (int i = first; i < end && shown < SHOWN_ALL; i++)
        if (is_shown(values, first, end, i, fault))
            fprintf(out, "%s %s%s = %s", shown++ ? "," : "", model->coordinates[i].name, suffix,
                    record_number(values[i], text));
    if (shown < end - first)
        fprintf(out, " (%d of %d: failing, or the largest)", shown, end - first);
    fputc('\n', out);
}

/* Prints how deeply bodies penetrate each other. */
static void print_gap(const struct refdyn_workspace *work, double t, const double *q, const double *qd,
                      FILE *out) {
    const struct refdyn_model *model = work->model;
    char text[RECORD_NUMBER_LENGTH];
    double *values = malloc(((size_t)model->event_count + (size_t)model->kink_count) * sizeof *values);
    if (!values)
        return;
    model->event(work->p, work->x, t, q, qd, values);
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact == work->fault.row + 1)
            fprintf(out, "  gap: %s = %s; it must not be negative\n", model->events[i].name,
                    record_number(values[i], text));
    free(values);
}

/* Two turns count as parallel if 1 - M_ij^2/(M_ii M_jj) is at most this. */
static const double parallel = 1e-12;

static bool are_parallel(const double *M, int n, int i, int j) {
    return M[i * n + i] * M[j * n + j] - M[i * n + j] * M[i * n + j] <=
           parallel * M[i * n + i] * M[j * n + j];
}

/* A singular position of three turns at one point: the middle one has brought the axes of the others onto one
 * line, so that no rates of the angles belong to a turn about the third direction. Returns the last of the
 * three turns, the failing one or one after it; -1: the failure has another reason. */
static int find_parallel_turns(const struct refdyn_model *model, const double *M, int failing) {
    for (int last = failing; last < refdyn_joint_count(model); last++) {
        const int middle = model->parent[last], first = middle >= 0 ? model->parent[middle] : -1;
        if (first >= 0 && (failing == first || failing == last) && are_parallel(M, model->n, first, last))
            return last;
    }
    return -1;
}

/* After MASS_NOT_POSITIVE: names the turns about the same axis, and the remedy. */
static void print_parallel_turns(const struct refdyn_workspace *work, double t, const double *q,
                                 const double *qd, FILE *out) {
    const struct refdyn_model *model = work->model;
    const size_t n = (size_t)model->n;
    double *M = model->M && qd ? malloc(n * n * sizeof *M) : NULL;
    if (!M)
        return;
    model->M(work->p, work->x, t, q, qd, M);
    const int last = work->fault.coordinate < 0 ? -1 : find_parallel_turns(model, M, work->fault.coordinate);
    if (last >= 0) {
        const int middle = model->parent[last];
        fprintf(out,
                "refdyn: %s and %s turn about the same axis at %s = %.4g degrees, where three turns do not "
                "describe all rotations; list the turns of the joint in another order, or put a constant "
                "`turn` before the joint, so that %s stays away from this value\n",
                model->coordinates[model->parent[middle]].name, model->coordinates[last].name,
                model->coordinates[middle].name, q[middle] * 180 / 3.14159265358979323846,
                model->coordinates[middle].name);
    }
    free(M);
}

void record_print_failed(const struct refdyn_workspace *work, int result, double t, const double *q,
                         const double *qd, FILE *out) {
    char text[RECORD_NUMBER_LENGTH];
    fprintf(out, "refdyn: %s: t = %s s: %s", work->model->name, record_number(t, text),
            refdyn_status_text(result));
    print_place(work, out);
    fputs("\n", out);
    if (result == REFDYN_CONTACT_INSIDE)
        print_gap(work, t, q, qd, out);
    print_values("q", work->model, false, q, "", work->fault.coordinate, out);
    if (qd)
        print_values("qd", work->model, false, qd, "_d", work->fault.coordinate, out);
    if (qd)
        print_values("states", work->model, true, qd, "", work->fault.coordinate, out);
    if (result == REFDYN_MASS_NOT_POSITIVE)
        print_parallel_turns(work, t, q, qd, out);
}

void record_print_value_advice(int status, FILE *out) {
    if (status == REFDYN_NOT_FINITE)
        fputs(
            "refdyn: such a value comes from a division by 0, the root or logarithm of a negative number, or "
            "an overflow; bound the argument, as in rd.max(x, 1e-9)\n",
            out);
}

/* Returns phi of row a, or psi if it is no position row. */
static double residual_of(const struct refdyn_workspace *work, int a) {
    return work->model->rows[a].level == REFDYN_POSITION ? work->phi[a] : work->psi[a];
}

void record_print_residuals(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                            const char *where, FILE *out) {
    char text[RECORD_NUMBER_LENGTH];
    double below = INFINITY;
    if (work->m == 0 || refdyn_equations(work, t, q, qd) != REFDYN_OK)
        return;
    fprintf(out, "refdyn: %s is off the programme by", where);
    for (int k = 0; k < SHOWN_ROWS && k < work->m; k++) {
        int largest = -1;
        for (int a = 0; a < work->m; a++)
            if (fabs(residual_of(work, a)) < below &&
                (largest < 0 || fabs(residual_of(work, a)) > fabs(residual_of(work, largest))))
                largest = a;
        if (largest < 0)
            break;
        below = fabs(residual_of(work, largest));
        fprintf(out, "%s %s: %s = %s", k ? "," : "", work->model->rows[largest].name,
                work->model->rows[largest].level == REFDYN_POSITION ? "phi" : "psi",
                record_number(residual_of(work, largest), text));
    }
    fputc('\n', out);
}

void record_print_start_advice(FILE *out) {
    fputs("refdyn: no state near the start satisfies the rows; check that lengths and angles can reach "
          "them, or choose a start nearer to them\n",
          out);
}

enum { SWEEPS_MOST = 60 };

/* Makes two rows (n) orthogonal by a rotation. Returns the cosine between them before. */
static double rotate(double *x, double *y, int n) {
    double xx = 0, yy = 0, xy = 0;
    for (int j = 0; j < n; j++) {
        xx += x[j] * x[j];
        yy += y[j] * y[j];
        xy += x[j] * y[j];
    }
    if (xy == 0)
        return 0;
    const double zeta = (yy - xx) / (2 * xy),
                 slope = copysign(1, zeta) / (fabs(zeta) + sqrt(1 + zeta * zeta));
    const double c = 1 / sqrt(1 + slope * slope), s = c * slope;
    for (int j = 0; j < n; j++) {
        const double old = x[j];
        x[j] = c * old - s * y[j];
        y[j] = s * old + c * y[j];
    }
    return fabs(xy) / sqrt(xx * yy);
}

/* The ratio of the largest to the smallest singular value of the rows (rank x n), which are made orthogonal:
 * one-sided Jacobi (Golub and Van Loan, Matrix Computations, 8.6.3). */
static double condition_of(double *rows, int rank, int n) {
    double largest = 1, least = INFINITY, most = 0;
    for (int sweep = 0; sweep < SWEEPS_MOST && largest > 1e-15; sweep++) {
        largest = 0;
        for (int a = 0; a < rank; a++)
            for (int b = a + 1; b < rank; b++)
                largest = fmax(largest, rotate(rows + a * n, rows + b * n, n));
    }
    for (int a = 0; a < rank; a++) {
        double square = 0;
        for (int j = 0; j < n; j++)
            square += rows[a * n + j] * rows[a * n + j];
        least = fmin(least, sqrt(square));
        most = fmax(most, sqrt(square));
    }
    return most / least;
}

/* The condition of the independent rows, with columns scaled by 1/sqrt(M_jj); -1 without memory. */
static double condition_of_rows(const struct refdyn_workspace *work) {
    const int n = work->n, rank = work->partition.rank;
    double *rows = malloc((size_t)rank * (size_t)n * sizeof *rows);
    if (!rows)
        return -1;
    for (int a = 0; a < rank; a++)
        for (int j = 0; j < n; j++)
            rows[a * n + j] = work->u[work->partition.row[a] * n + j] / sqrt(work->M[j * n + j]);
    const double condition = condition_of(rows, rank, n);
    free(rows);
    return condition;
}

bool record_print_condition(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                            FILE *out) {
    if (work->partition.rank <= 0 || refdyn_equations(work, t, q, qd) != REFDYN_OK)
        return false;
    const double condition = condition_of_rows(work);
    if (!(condition > 0))
        return false;
    fprintf(out, "refdyn: the condition of the constraint rows there is %.3g%s\n", condition,
            condition > singular
                ? ": a singular position, or the end of what the programme lets the links reach"
                : "");
    return condition > singular;
}

/* The rows of free contacts, which follow the rows of the programme, are not reported. */
void record_print_rows_left_out(const struct refdyn_model *model, const int *rows, int count, FILE *out) {
    const int end = refdyn_programme_rows(model);
    int shown = 0;
    for (int i = 0; i < count; i++)
        if (rows[i] < end)
            fprintf(out, "%s%s", shown++ ? ", " : "refdyn: warning: redundant rows, left out: ",
                    model->rows[rows[i]].name);
    if (shown > 0)
        fputc('\n', out);
}

/* Returns whether the formula of this row has no slope at the state of the last evaluation. A row of a joint
 * has one even where the joint's axes keep every coordinate from changing the residual. */
static bool has_no_slope(const struct refdyn_workspace *work, int row) {
    for (int j = 0; j < work->n; j++)
        if (work->u[row * work->n + j] != 0 || work->sizes[row * work->n + j] != 0)
            return false;
    return true;
}

/* Warns of redundant rows that have no slope at q, but have one elsewhere. Rows without any, such as those
 * that keep a plane mechanism in its plane, are no mistake. */
static void warn_of_rows_without_slope(struct refdyn_workspace *work, double t, const double *q,
                                       const double *qd, FILE *out) {
    const struct refdyn_partition *partition = &work->partition;
    const int end = refdyn_programme_rows(work->model);
    int *rows = malloc((size_t)work->m * sizeof *rows), count = 0, shown = 0;
    double *beside = malloc((size_t)work->n * sizeof *beside);
    for (int i = partition->rank; i < work->m && rows; i++)
        if (partition->row[i] < end && has_no_slope(work, partition->row[i]))
            rows[count++] = partition->row[i];
    for (int j = 0; j < work->n && beside; j++)
        beside[j] = q[j] + 0.1 * cos(1 + 2.3 * j); /* no special place */
    const bool is_moved = count > 0 && beside && refdyn_equations(work, t, beside, qd) == REFDYN_OK;
    for (int i = 0; i < count && is_moved; i++)
        if (!has_no_slope(work, rows[i]))
            fprintf(out, "%s%s", shown++ ? ", " : "refdyn: warning: ", work->model->rows[rows[i]].name);
    if (shown > 0)
        fprintf(out,
                " %s no slope there: no coordinate changes %s residual; write what is to be 0 without "
                "powers, products or abs\n",
                shown > 1 ? "have" : "has", shown > 1 ? "their" : "its");
    if (count > 0)
        refdyn_equations(work, t, q, qd);
    free(rows);
    free(beside);
}

void record_print_redundant_rows(struct refdyn_workspace *work, double t, const double *q, const double *qd,
                                 FILE *out) {
    const struct refdyn_partition *partition = &work->partition;
    if (partition->rank < 0)
        return;
    record_print_rows_left_out(work->model, partition->row + partition->rank, work->m - partition->rank, out);
    if (work->m > 0)
        warn_of_rows_without_slope(work, t, q, qd, out);
}
