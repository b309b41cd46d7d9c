/* What several commands say of a scene: see scene.h. */
#include "scene/scene.h"

void put_coordinates(struct document *document, const char *key, const struct refdyn_model *model,
                     const int *which) {
    put_open(document, key, '[');
    for (int i = 0; i < model->n; i++)
        if (!which || which[i])
            put_text(document, NULL, model->coordinates[i].name);
    put_close(document, ']');
}

void put_positions(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    double *r = allocate_matrix(model->point_count, 3);
    if (model->point_count)
        model->r(scene->work.p, scene->work.x, scene->state.t, scene->q, scene->qd, r);
    put_open(document, "points", '{');
    for (int i = 0; i < model->point_count; i++)
        put_array(document, model->points[i], r + 3 * i, 3);
    put_close(document, '}');
}
