/* `refdyn eval`: every quantity of the equations at one state, as one JSON object. */
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/scene/scene.h"

#include <math.h>
#include <string.h>

/* One residual per row; null for rows of the levels in `without` (a set of bits). */
static void put_residual(struct document *document, const char *key, const struct refdyn_model *model,
                         const double *values, unsigned without) {
    format_put_open(document, key, '[');
    for (int i = 0; i < model->m; i++) {
        if (without >> model->rows[i].level & 1)
            format_put_null(document, NULL);
        else
            format_put_number(document, NULL, values[i]);
    }
    format_put_close(document, ']');
}

/* Of a point with `angular = true`. */
static void put_spatial(struct document *document, const struct scene *scene, int point) {
    const struct refdyn_spatial *spatial = scene->compiled.spatial;
    const struct refdyn_workspace *work = &scene->work;
    const int n = scene->model->n;
    for (int i = 0; spatial && i < spatial->count; i++) {
        if (spatial->points[i] != point)
            continue;
        double *room = format_allocate_matrix(6 * spatial->count, n);
        spatial->J(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
        format_put_matrix(document, "J", room + 6 * i * n, 6, n);
        spatial->Jd_qd(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
        format_put_array(document, "Jd_qd", room + 6 * i, 6);
    }
}

static void put_point(struct document *document, const struct scene *scene, int point, double *room) {
    const struct refdyn_model *model = scene->model;
    const struct refdyn_workspace *work = &scene->work;
    int n = model->n;
    format_put_open(document, model->points[point], '{');
    model->r(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_array(document, "r", room + 3 * point, 3);
    model->rd(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_array(document, "rd", room + 3 * point, 3);
    model->C(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_matrix(document, "C", room + 3 * point * n, 3, n);
    model->d(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_array(document, "d", room + 3 * point, 3);
    put_spatial(document, scene, point);
    format_put_close(document, '}');
}

static void put_points(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    double *room = format_allocate_matrix(3 * model->point_count, model->n + 1);
    format_put_open(document, "points", '{');
    for (int i = 0; i < model->point_count; i++)
        put_point(document, scene, i, room);
    format_put_close(document, '}');
}

static void put_equations(struct document *document, const struct scene *scene, double *room) {
    const struct refdyn_model *model = scene->model;
    const struct refdyn_workspace *work = &scene->work;
    int n = model->n, m = model->m;
    format_put_matrix(document, "M", work->M, n, n);
    model->h(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_array(document, "h", room, n);
    model->Q(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    format_put_array(document, "Q", room, n);
    format_put_matrix(document, "u", work->u, m, n);
    format_put_array(document, "v", work->v, m);
    put_residual(document, "phi", model, work->phi, 1u << REFDYN_VELOCITY | 1u << REFDYN_ACCELERATION);
    put_residual(document, "psi", model, work->psi, 1u << REFDYN_ACCELERATION);
    format_put_array(document, "k", work->k, m);
}

/* In the order of the coordinates; the partition lists them in the order of elimination. */
static void put_dependent(struct document *document, const struct scene *scene) {
    const struct refdyn_partition *partition = &scene->work.partition;
    format_put_open(document, "dependent", '[');
    for (int i = 0; i < scene->model->n; i++)
        for (int j = 0; j < partition->rank; j++)
            if (partition->column[j] == i)
                format_put_text(document, NULL, scene->model->coordinates[i].name);
    format_put_close(document, ']');
}

static void put_accelerations(struct document *document, struct scene *scene, const double *qdd,
                              double *room) {
    struct refdyn_workspace *work = &scene->work;
    const int n = scene->model->n;
    bool is_finite = true;
    put_dependent(document, scene);
    format_put_array(document, "qdd", qdd, n);
    scene->model->qdd_free(work->p, work->x, scene->state.t, scene->q, scene->qd, room);
    for (int i = 0; i < n; i++)
        is_finite = is_finite && isfinite(room[i]);
    if (is_finite)
        format_put_array(document, "qdd_free", room, n);
    else
        format_put_null(document, "qdd_free");
    double *lambda = format_allocate_matrix(scene->model->m, 1);
    refdyn_multipliers(work, qdd, lambda);
    refdyn_programme_force(work, lambda, room);
    format_put_array(document, "force", room, n);
}

/* At the qdd of the STATE.json; null in the printed form, which has no inverse dynamics. */
static void put_inverse(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    const size_t n = (size_t)model->n;
    double *rates = format_allocate_matrix(2, model->n), *tau = format_allocate_matrix(model->n, 1);
    if (!scene->state.qdd)
        return;
    if (!model->inverse) {
        format_put_null(document, "inverse");
        return;
    }
    memcpy(rates, scene->qd, n * sizeof *rates);
    memcpy(rates + n, scene->state.qdd, n * sizeof *rates);
    model->inverse(scene->work.p, scene->work.x, scene->state.t, scene->q, rates, tau);
    format_put_array(document, "inverse", tau, model->n);
}

static void put_energy(struct document *document, const struct scene *scene) {
    double energy[2];
    format_put_open(document, "energy", '{');
    if (refdyn_energies(&scene->work, scene->state.t, scene->q, scene->qd, energy) == REFDYN_OK) {
        format_put_number(document, "kinetic", energy[0]);
        format_put_number(document, "potential", energy[1]);
    }
    format_put_close(document, '}');
}

static enum status print_state(struct scene *scene, const double *qdd) {
    struct document document;
    scene_document_open(&document);
    double *room = format_allocate_matrix(scene->model->n, 1);
    format_put_text(&document, "name", scene->model->name);
    int *all = format_allocate((size_t)scene->model->n, sizeof *all);
    for (int i = 0; i < scene->model->n; i++)
        all[i] = 1;
    scene_put_coordinates(&document, "coordinates", scene->model, all);
    put_equations(&document, scene, room);
    put_points(&document, scene);
    put_accelerations(&document, scene, qdd, room);
    put_inverse(&document, scene);
    put_energy(&document, scene);
    format_put_close(&document, '}');
    return scene_finish(scene, &document);
}

static enum status evaluate_state(struct scene *scene, const struct options *options) {
    (void)options;
    double *qdd = format_allocate_matrix(scene->model->n, 1);
    int result = refdyn_accelerate(&scene->work, scene->state.t, scene->q, scene->qd, REFDYN_BAUMGARTE, qdd);
    if (result == REFDYN_OK)
        refdyn_refine(&scene->work, scene->state.t, scene->q, scene->qd, REFDYN_BAUMGARTE, qdd);
    const enum status status = result == REFDYN_OK
                                   ? print_state(scene, qdd)
                                   : scene_numbers_failed(scene, result, scene->state.t, scene->q, scene->qd);
    if (status == STATUS_DONE)
        record_print_redundant_rows(&scene->work, scene->state.t, scene->q, scene->qd, stderr);
    return status;
}

static enum status run_eval(const struct options *options) {
    return scene_run(options, NEEDS_RESULT | NEEDS_ONCE | NEEDS_STATE | NEEDS_POINTS | NEEDS_POINT_RATES,
                     options_text(options, "state"), evaluate_state);
}

const struct command eval_command = {.name = "eval",
                                     .run = run_eval,
                                     .operands = "MODEL.lua",
                                     .options = "output state set loops accelerations fold",
                                     .tables = {scene_rules},
                                     .output = "FILE",
                                     .purpose = "all quantities of the equations at one state",
                                     .help = "Prints one JSON object: M h Q, the rows u v phi psi k, points, "
                                             "accelerations, programme force, energy;\n"
                                             "inverse dynamics if the state has accelerations `qdd`.\n"
                                             "Default of --state: the model's initial state.\n\n"
                                             "  refdyn eval models/manipulator.lua --state state.json\n"};
