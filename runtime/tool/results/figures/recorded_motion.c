/* Reads a finished motion from a CSV or HDF5 file: what its columns are, and rows at equal distances. */
#include "runtime/tool/results/figures/figures.h"
#include "runtime/tool/motions/simulate/simulate.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

enum {
    RUN_ROWS_MOST = 4000,      /* rows that are kept; a figure cannot show more */
    RUN_NUMBERS_MOST = 1 << 22 /* numbers in these rows; limits the rows of many columns */
};

enum { POINT_COLUMNS = 9 };

static bool is_named(const struct run *run, int column, const char *stem, size_t length, const char *ending) {
    if (column < 0 || column >= run->column_count)
        return false;
    const char *name = run->columns[column];
    return strlen(name) == length + strlen(ending) && strncmp(name, stem, length) == 0 &&
           strcmp(name + length, ending) == 0;
}

/* Coordinates follow t; the rate of the first one marks their end. */
static void find_coordinates(struct run *run) {
    run->coordinates = 1;
    for (int i = 2; i < run->column_count && run->coordinate_count == 0; i++)
        if (is_named(run, i, run->columns[1], strlen(run->columns[1]), "_d"))
            run->coordinate_count = i - 1;
}

/* A point is NAME_x, with NAME_xd three columns later and NAME_xdd six columns later. */
static void find_points(struct run *run) {
    run->points = format_allocate((size_t)run->column_count / POINT_COLUMNS + 1, sizeof *run->points);
    for (int i = 1 + 2 * run->coordinate_count; i + POINT_COLUMNS <= run->column_count; i += POINT_COLUMNS) {
        size_t length = strlen(run->columns[i]);
        if (length < 3 || strcmp(run->columns[i] + length - 2, "_x") != 0 ||
            !is_named(run, i + 3, run->columns[i], length, "d") ||
            !is_named(run, i + 6, run->columns[i], length, "dd"))
            return;
        run->points[run->point_count++] = i;
    }
}

/* Returns whether the columns from `first` on are the accelerations of all coordinates. */
static bool begin_accelerations(const struct run *run, int first) {
    const size_t lead = strlen(record_acceleration_lead);
    for (int i = 0; i < run->coordinate_count; i++) {
        const char *q = run->columns[run->coordinates + i], *name = run->columns[first + i];
        name += strncmp(name, record_acceleration_lead, lead) == 0 ? lead : 0;
        if (strncmp(name, q, strlen(q)) != 0 || strcmp(name + strlen(q), record_acceleration_ending) != 0)
            return false;
    }
    return run->coordinate_count > 0;
}

/* Inputs end where accelerations begin; files of earlier versions have no accelerations. */
static int count_inputs(const struct run *run) {
    for (int i = run->inputs; i + run->coordinate_count <= run->column_count; i++)
        if (begin_accelerations(run, i))
            return i - run->inputs;
    return run->column_count - run->inputs;
}

static void find_columns(struct run *run) {
    find_coordinates(run);
    find_points(run);
    run->energy = text_index("energy", (const char *const *)run->columns, run->column_count);
    run->forces = run->energy < 0 ? run->column_count : run->energy + 1;
    while (run->forces + run->force_count < run->column_count &&
           strncmp(run->columns[run->forces + run->force_count], record_force_lead,
                   strlen(record_force_lead)) == 0)
        run->force_count++;
    run->inputs = run->forces + run->force_count;
    run->input_count = count_inputs(run);
}

/* ---- Rows ---- */

/* Drops every second row that is kept. */
static void thin_out(struct run *run) {
    const size_t width = (size_t)run->column_count;
    for (long i = 1; 2 * i < run->kept_count; i++)
        memcpy(run->kept + (size_t)i * width, run->kept + 2 * (size_t)i * width, width * sizeof *run->kept);
    run->kept_count = (run->kept_count + 1) / 2;
    run->stride *= 2;
}

/* Keeps the row, which follows the kept ones in memory, if it is one of the equally spaced ones. */
static void take_row(struct run *run, const double *row) {
    for (int i = 0; i < run->column_count; i++) {
        run->largest[i] = fmax(run->largest[i], fabs(row[i]));
        run->is_open[i] |= isnan(row[i]);
    }
    if (run->rows++ % run->stride == 0 && ++run->kept_count == run->room)
        thin_out(run);
}

/* The last line of an interrupted run may be cut short in the middle of a number. */
static bool warn_of_cut(const struct csv *csv) {
    format_complain_line(csv->path, csv->line, "warning: run: the last line is incomplete and ignored");
    return true;
}

/* A force that is not unique is written as nan. */
static bool is_open(const struct run *run, int column) {
    return strcmp(run->csv.fields[column], "nan") == 0 && record_may_be_open(run->columns[column]);
}

/* Like motion_next. */
static int next_line(struct run *run, double *row) {
    struct csv *csv = &run->csv;
    const int answer = format_csv_next(csv);
    if (answer <= 0 || (csv->is_cut && warn_of_cut(csv)))
        return answer < 0 ? -1 : 0;
    for (int i = 0; i < run->column_count; i++)
        if (is_open(run, i))
            row[i] = NAN;
        else if (!format_csv_number(csv, i, &row[i]))
            return -1;
    return 1;
}

static bool read_rows(struct run *run) {
    const size_t width = (size_t)run->column_count;
    double *last = format_allocate(width, sizeof *last);
    int answer;
    while ((answer = run->motion ? hdf5_motion_next(run->motion, last) : next_line(run, last)) > 0) {
        memcpy(run->kept + (size_t)run->kept_count * width, last, width * sizeof *last);
        take_row(run, last);
    }
    if (answer == 0 && run->rows > 0 && (run->rows - 1) % run->stride != 0)
        memcpy(run->kept + (size_t)run->kept_count++ * width, last, width * sizeof *last);
    return answer == 0;
}

/* ---- The file ---- */

static void get_room(struct run *run) {
    const size_t width = (size_t)run->column_count;
    run->stride = 1;
    run->largest = format_allocate(width, sizeof *run->largest);
    run->is_open = format_allocate(width, sizeof *run->is_open);
    run->room = RUN_NUMBERS_MOST / run->column_count;
    run->room = run->room > RUN_ROWS_MOST    ? RUN_ROWS_MOST
                : run->room < RUN_ROWS_LEAST ? RUN_ROWS_LEAST
                                             : run->room;
    run->kept = format_allocate((size_t)(run->room + 1) * width, sizeof *run->kept);
}

static bool open_csv(struct run *run, const char *path) {
    if (!format_csv_open(&run->csv, path, "run"))
        return false;
    if (strcmp(run->csv.names[0], "t") != 0 || run->csv.count < 2)
        return format_csv_complain(
            &run->csv, "the header does not begin with t and a name; give a CSV file of refdyn sim");
    run->columns = run->csv.names;
    run->column_count = run->csv.count;
    return true;
}

static bool open_hdf5(struct run *run, const char *path) {
    run->motion = hdf5_motion_open(path);
    if (!run->motion)
        return false;
    const char *const *names = hdf5_motion_names(run->motion, &run->column_count);
    char **kept = format_allocate((size_t)run->column_count, sizeof *kept);
    for (int i = 0; i < run->column_count; i++)
        kept[i] = format_text("%s", names[i]);
    run->columns = kept;
    return true;
}

bool figures_run_is_hdf5(const char *path) {
    static const char *const endings[] = {".h5", ".hdf5", ".h5.part", ".hdf5.part"};
    const size_t length = strlen(path);
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++)
        if (length > strlen(endings[i]) && strcmp(path + length - strlen(endings[i]), endings[i]) == 0)
            return true;
    return false;
}

static bool read_run(struct run *run, const char *path) {
    if (!(figures_run_is_hdf5(path) ? open_hdf5 : open_csv)(run, path))
        return false;
    get_room(run);
    find_columns(run);
    if (!read_rows(run))
        return false;
    run->csv.line += run->csv.line == 1;
    return run->rows > 0 ||
           format_csv_complain(&run->csv, "there are no rows; give a CSV file of refdyn sim");
}

bool figures_run_read(struct run *run, const char *path) {
    const char *slash = strrchr(path, '/');
    *run = (struct run){.path = path, .name = slash ? slash + 1 : path, .energy = -1};
    const bool is_good = read_run(run, path);
    format_csv_close(&run->csv);
    hdf5_motion_close(run->motion);
    run->motion = NULL;
    return is_good;
}
