/* The numbers of a run as the page draws them: see view.h. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* A screen has some thousand columns. Of all numbers together the page has a megabyte. */
enum { ROWS_MOST = 1200, NUMBERS_MOST = 250000 };
enum { TIME_DIGITS = 7, SLIDE_DIGITS = 5, COURSE_DIGITS = 4 };

static const double turn_unit = 1e-5; /* [rad] */

struct drawn_rows view_drawn_run_rows(const struct run *run, int share) {
    const long width = run->column_count, room = NUMBERS_MOST / width / share;
    const long most = room < RUN_ROWS_LEAST ? RUN_ROWS_LEAST : room < ROWS_MOST ? room : ROWS_MOST;
    const long stride = (run->kept_count + most - 1) / most;
    struct drawn_rows rows = {.width = width};
    rows.values = allocate((size_t)(run->kept_count / stride + 2) * (size_t)width, sizeof *rows.values);
    for (long i = 0; i < run->kept_count; i++)
        if (i % stride == 0 || i == run->kept_count - 1)
            memcpy(rows.values + rows.count++ * width, run->kept + i * width,
                   (size_t)width * sizeof *rows.values);
    return rows;
}

static void put_numbers(FILE *out, const struct drawn_rows *rows, int column, double unit) {
    fprintf(out, "\"unit\":%.9g,\"steps\":", unit);
    view_put_course(out, rows->values + column, rows->count, rows->width, unit);
    fputc('}', out);
}

static double unit_of_coordinate(const struct run *run, int column, bool is_revolute) {
    return is_revolute ? fmin(turn_unit, view_rounded_unit(run->largest[column], COURSE_DIGITS))
                       : view_rounded_unit(run->largest[column], SLIDE_DIGITS);
}

static void put_coordinate_rows(FILE *out, const struct run *run, const struct tree *tree,
                                const struct drawn_rows *rows) {
    fputs("\"q\":[", out);
    for (int i = 0; i < tree->count; i++) {
        const int column = run->coordinates + i;
        fputs(i ? ",\n{" : "\n{", out);
        put_numbers(out, rows, column, unit_of_coordinate(run, column, tree->frames[i].joint.is_revolute));
    }
    fputs("],\n", out);
}

/* What a column behind the points is; NULL: it is not drawn. */
static const char *kind_of(const struct run *run, int column) {
    const char *name = run->columns[column];
    const bool is_force = column >= run->forces && column < run->forces + run->force_count;
    if (is_force)
        return run->largest[column] > 0 ? "force" : NULL;
    if (column == run->energy)
        return "energy";
    if (column >= run->inputs)
        return "course";
    return strncmp(name, "phi_", 4) == 0 ? "phi" : strncmp(name, "psi_", 4) == 0 ? "psi" : NULL;
}

static void put_courses(FILE *out, const struct run *run, const struct drawn_rows *rows) {
    enum { POINT_COLUMNS = 9 };
    const int first = run->coordinates + 2 * run->coordinate_count + POINT_COLUMNS * run->point_count;
    const char *separator = "\n";
    fputs("\"courses\":[", out);
    for (int i = first; i < run->column_count; i++) {
        const char *kind = kind_of(run, i);
        if (!kind)
            continue;
        fprintf(out, "%s{\"name\":", separator);
        put_json_text(out, run->columns[i]);
        fprintf(out, ",\"kind\":\"%s\",", kind);
        put_numbers(out, rows, i, view_rounded_unit(run->largest[i], COURSE_DIGITS));
        separator = ",\n";
    }
    fputs("]", out);
}

void view_drawn_run_put(FILE *out, const struct run *run, const struct tree *tree,
                        const struct drawn_rows *rows) {
    fputs("\"t\":{", out);
    put_numbers(out, rows, 0, view_rounded_unit(run->largest[0], TIME_DIGITS));
    fputs(",\n", out);
    put_coordinate_rows(out, run, tree, rows);
    put_courses(out, run, rows);
}
