/* What several commands say of a scene: see scene.h. */
#include "runtime/tool/scene/scene.h"

#include <string.h>

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

/* Of several values of one name the last one counts. */
static void put_values(struct document *document, const struct named_value *list, int count) {
    for (int i = 0; i < count; i++) {
        bool is_last = true;
        for (int k = i + 1; k < count; k++)
            is_last = is_last && strcmp(list[k].name, list[i].name) != 0;
        if (is_last)
            put_number(document, list[i].name, list[i].value);
    }
}

/* The inputs of --set, then the STATE.json's. */
static void put_inputs(struct document *document, const struct scene *scene) {
    const struct values *values = &scene->values;
    const struct state *state = &scene->state;
    const size_t count = (size_t)(values->input_count + state->input_count);
    struct named_value *list = allocate(count, sizeof *list);
    for (int i = 0; i < values->input_count; i++)
        list[i] = values->inputs[i];
    for (int i = 0; i < state->input_count; i++)
        list[values->input_count + i] = state->inputs[i];
    put_open(document, "inputs", '{');
    put_values(document, list, (int)count);
    put_close(document, '}');
}

void put_state(struct document *document, const struct scene *scene) {
    put_array(document, "q", scene->q, scene->model->n);
    put_array(document, "qd", scene->qd, scene->model->n);
    put_number(document, "t", scene->state.t);
    put_inputs(document, scene);
    put_open(document, "parameters", '{');
    put_values(document, scene->values.list, scene->values.count);
    put_close(document, '}');
}
