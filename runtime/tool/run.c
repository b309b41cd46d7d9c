/* A finished motion's columns: see run.h. */
#include "run.h"
#include "output.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINT_COLUMNS = 9 };

static bool complain_line(const struct run *run, long line, const char *what) {
    fprintf(stderr, "%s:%ld: run: %s, a CSV file of refdyn sim is needed\n", run->path, line, what);
    return false;
}

int run_column(const struct run *run, const char *name) {
    for (int i = 0; i < run->column_count; i++)
        if (strcmp(run->columns[i], name) == 0)
            return i;
    return -1;
}

static void cut_header(struct run *run, char *line) {
    line[strcspn(line, "\r\n")] = '\0';
    run->header = line;
    run->columns = allocate(strlen(line) + 1, sizeof *run->columns);
    for (char *at = line; at; run->column_count++) {
        char *comma = strchr(at, ',');
        run->columns[run->column_count] = at;
        if (comma)
            *comma++ = '\0';
        at = comma;
    }
    run->largest = allocate((size_t)run->column_count, sizeof *run->largest);
    run->lowest = allocate((size_t)run->column_count, sizeof *run->lowest);
    run->highest = allocate((size_t)run->column_count, sizeof *run->highest);
}

static bool is_named(const struct run *run, int column, const char *stem, size_t length, const char *ending) {
    if (column < 0 || column >= run->column_count)
        return false;
    const char *name = run->columns[column];
    return strlen(name) == length + strlen(ending) && strncmp(name, stem, length) == 0 &&
           strcmp(name + length, ending) == 0;
}

/* Coordinates stand behind t, as many as there are columns before the first one's rate. */
static void find_coordinates(struct run *run) {
    run->coordinates = 1;
    for (int i = 2; i < run->column_count && run->coordinate_count == 0; i++)
        if (is_named(run, i, run->columns[1], strlen(run->columns[1]), "_d"))
            run->coordinate_count = i - 1;
}

/* A point is NAME_x with NAME_xd three columns on and NAME_xdd six. */
static void find_points(struct run *run) {
    run->points = allocate((size_t)run->column_count / POINT_COLUMNS + 1, sizeof *run->points);
    for (int i = 1 + 2 * run->coordinate_count; i + POINT_COLUMNS <= run->column_count; i += POINT_COLUMNS) {
        size_t length = strlen(run->columns[i]);
        if (length < 3 || strcmp(run->columns[i] + length - 2, "_x") != 0 ||
            !is_named(run, i + 3, run->columns[i], length, "d") ||
            !is_named(run, i + 6, run->columns[i], length, "dd"))
            return;
        run->points[run->point_count++] = i;
    }
}

static void find_columns(struct run *run) {
    find_coordinates(run);
    find_points(run);
    run->energy = run_column(run, "energy");
    run->forces = run->energy < 0 ? run->column_count : run->energy + 1;
    while (run->forces + run->force_count < run->column_count &&
           strncmp(run->columns[run->forces + run->force_count], "force_", 6) == 0)
        run->force_count++;
    run->inputs = run->forces + run->force_count;
    run->input_count = run->column_count - run->inputs;
}

static bool read_row(struct run *run, const char *line, long number) {
    const char *at = line;
    for (int i = 0; i < run->column_count; i++) {
        char *end;
        double value = strtod(at, &end);
        if (end == at)
            return complain_line(run, number, "a number is missing");
        run->largest[i] = fmax(run->largest[i], fabs(value));
        run->lowest[i] = run->rows ? fmin(run->lowest[i], value) : value;
        run->highest[i] = run->rows ? fmax(run->highest[i], value) : value;
        at = end + (*end == ',');
    }
    run->rows++;
    return true;
}

/* The last line of an interrupted run may be cut short: it does not count. */
static bool read_rows(struct run *run, FILE *file) {
    char *line = NULL;
    size_t size = 0;
    bool is_good = true;
    ssize_t length;
    for (long number = 2; is_good && (length = getline(&line, &size, file)) > 0; number++)
        if (line[length - 1] == '\n')
            is_good = read_row(run, line, number);
    free(line);
    return is_good;
}

static bool read_file(struct run *run, FILE *file) {
    char *line = NULL;
    size_t size = 0;
    if (getline(&line, &size, file) < 2 || strncmp(line, "t,", 2) != 0) {
        free(line);
        return complain_line(run, 1, "the header does not begin with t");
    }
    cut_header(run, line);
    find_columns(run);
    if (!read_rows(run, file))
        return false;
    return run->rows > 0 ? true : complain_line(run, 2, "there are no rows");
}

bool run_read(struct run *run, const char *path) {
    const char *slash = strrchr(path, '/');
    *run = (struct run){.path = path, .name = slash ? slash + 1 : path, .energy = -1};
    FILE *file = fopen(path, "r");
    if (!file) {
        fprintf(stderr, "%s: run: %s, a readable file is needed\n", path, strerror(errno));
        return false;
    }
    bool is_good = read_file(run, file);
    fclose(file);
    return is_good;
}

void run_release(struct run *run) {
    free(run->points);
    free(run->highest);
    free(run->lowest);
    free(run->largest);
    free(run->columns);
    free(run->header);
    *run = (struct run){.path = NULL};
}
