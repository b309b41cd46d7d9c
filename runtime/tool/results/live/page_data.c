/*
 * Writes the data of one structure of a live page as JSON: the drawn model, as for a recorded run but without
 * a motion, and
 *
 *     "live": {"file": , "settings": [[name, value], ...],
 *              "until": , "step": , "tol": , "tolRates": , "shapeNumbers": , "canPull": ,
 *              "parameters": [{"name": , "unit": , "value": , "from": , "to": , "fileValue": ,
 *                              "anchor": , "given": }, ...],
 *              "inputs": [{"name": , "unit": , "value": , "from": , "to": , "fileValue": }, ...],
 *              "starts": [{"name": , "unit": , "value": null, "from": , "to": }, ...],
 *              "states": [name, ...]}
 *
 * - settings: options of the model, for the command line
 * - step: 0 for adaptive steps at first
 * - shapeNumbers: numbers of the tape from which the module computes shapes
 * - parameters: in the order of p; value null if contacts set it
 * - from, to: null without a range; fileValue: the value without --set
 * - anchor: place among the parameters whose default follows the start, -1 for others
 * - starts: the coordinates, then their rates, then the continuous states
 * - states: names of the continuous states
 */
#include "runtime/tool/results/live/live.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <string.h>

/* ---- Sliders ---- */

static const char *rate_name(const char *coordinate) {
    return format_text("%s_d", coordinate);
}

/* read_pulls.c adds them. */
int live_hand_inputs(const struct live *live) {
    const int count = live->scene.model->point_count;
    return options_has(live->options, "pull") && count > 0 ? 2 * count + 3 : 0;
}

bool live_has_slider(const struct live *live, const char *name) {
    const struct refdyn_model *model = live->scene.model;
    for (int i = 0; i < model->n; i++)
        if (strcmp(model->coordinates[i].name, name) == 0 ||
            (i < refdyn_joint_count(model) && strcmp(rate_name(model->coordinates[i].name), name) == 0))
            return true;
    return refdyn_find_name(model->parameters, model->parameter_count, name) >= 0 ||
           refdyn_find_name(model->inputs, model->input_count - live_hand_inputs(live), name) >= 0;
}

static void put_number(FILE *out, double value) {
    if (isfinite(value))
        format_number(out, value);
    else
        fputs("null", out);
}

/* A missing range is NAN, written as null. */
static void put_slider(FILE *out, const char *name, const char *unit, double value, double from, double to,
                       const struct live_range *ranges) {
    for (; ranges->name; ranges++)
        if (strcmp(ranges->name, name) == 0) {
            from = ranges->from;
            to = ranges->to;
        }
    fputs("{\"name\":", out);
    format_json_text(out, name);
    fputs(",\"unit\":", out);
    format_json_text(out, unit ? unit : "");
    fputs(",\"value\":", out);
    put_number(out, value);
    fputs(",\"from\":", out);
    put_number(out, from);
    fputs(",\"to\":", out);
    put_number(out, to);
}

static bool is_mode(const struct model *model, const char *name) {
    for (int i = 0; i < model->parameter_count; i++)
        if (strcmp(model->parameters[i].name, name) == 0)
            return model->parameters[i].is_mode;
    return false;
}

static void put_parameters(FILE *out, const struct live *live, const struct live_range *ranges) {
    const struct refdyn_model *model = live->scene.model;
    fputs("\"parameters\":[", out);
    for (int i = 0; i < model->parameter_count; i++) {
        const struct refdyn_name *parameter = &model->parameters[i];
        const int anchor = refdyn_find_anchored(model, i);
        const bool is_hidden = is_mode(&live->scene.generation.model, parameter->name);
        fputs(i ? ",\n" : "\n", out);
        put_slider(out, parameter->name, parameter->unit, is_hidden ? NAN : live->scene.work.p[i], NAN, NAN,
                   ranges);
        fputs(",\"fileValue\":", out);
        put_number(out, parameter->value);
        fprintf(out, ",\"anchor\":%d,\"given\":%s}", anchor,
                anchor >= 0 && live->scene.given[anchor] ? "true" : "false");
    }
    fputs("],\n\"inputs\":[", out);
    for (int i = 0; i < model->input_count - live_hand_inputs(live); i++) {
        fputs(i ? ",\n" : "\n", out);
        put_slider(out, model->inputs[i].name, model->inputs[i].unit, live->scene.work.x[i], NAN, NAN,
                   ranges);
        fputs(",\"fileValue\":", out);
        put_number(out, model->inputs[i].value);
        fputc('}', out);
    }
    fputs("],\n", out);
}

static void put_starts(FILE *out, const struct live *live, const struct live_range *ranges) {
    const struct refdyn_model *model = live->scene.model;
    const int n = model->n, joints = refdyn_joint_count(model);
    fputs("\"starts\":[", out);
    for (int i = 0; i < joints + n; i++) {
        const int j = i < joints ? i : i - joints;
        const struct refdyn_name *coordinate = &model->coordinates[j];
        const struct limits *limits = live->drawn.generation.tree.frames[j].joint.limits;
        fputs(i ? ",\n" : "\n", out);
        if (j >= joints)
            put_slider(out, coordinate->name, coordinate->unit, NAN, NAN, NAN, ranges);
        else if (i >= joints)
            put_slider(out, rate_name(coordinate->name), format_text("%s/s", coordinate->unit), NAN,
                       limits ? -limits->rate : NAN, limits ? limits->rate : NAN, ranges);
        else
            put_slider(out, coordinate->name, coordinate->unit, NAN, limits ? limits->from : NAN,
                       limits ? limits->to : NAN, ranges);
        fputc('}', out);
    }
    fputs("],\n\"states\":[", out);
    for (int j = joints; j < n; j++) {
        fputs(j > joints ? "," : "", out);
        format_json_text(out, model->coordinates[j].name);
    }
    fputs("]", out);
}

/* ---- The model ---- */

bool live_has_option(const struct model *model, const char *name) {
    for (int i = 0; i < model->option_count; i++)
        if (strcmp(model->options[i].name, name) == 0)
            return true;
    return false;
}

static void put_settings(FILE *out, const struct live *live) {
    const struct options *options = live->options;
    const char *separator = "";
    fputs("\"settings\":[", out);
    for (int i = 0; i < options->setting_count; i++) {
        if (!live_has_option(&live->scene.generation.model, options->settings[i].name))
            continue;
        fprintf(out, "%s[", separator);
        format_json_text(out, options->settings[i].name);
        fputc(',', out);
        format_json_text(out, options->settings[i].value);
        fputc(']', out);
        separator = ",";
    }
    fputs("],\n", out);
}

static void put_forces(FILE *out, struct live *live) {
    fputs("\"curves\":[],\n\"applied\":[", out);
    for (int i = 0; i < live->force_count; i++) {
        const struct applied_force *force = &live->forces[i];
        fprintf(out, "%s{\"name\":", i ? ",\n" : "\n");
        format_json_text(out, force->name);
        fprintf(out, ",\"kind\":\"%s\",\"frame\":%d,\"count\":%d,\"at\":[", force->kind, force->at.frame,
                force->count);
        for (int k = 0; k < 3; k++) {
            fputs(k ? "," : "", out);
            view_put_length(
                out, view_tape_value(&live->tape, &live->drawn.generation, force->at.placement.position[k]));
        }
        fputs("]}", out);
    }
    fputs("]", out);
}

static void put_options(FILE *out, const struct options *options) {
    const double until = options_number(options, "until"), step = options_number(options, "step"),
                 tol = options_number(options, "tol");
    fputs("\"until\":", out);
    put_number(out, until > 0 ? until : 2);
    fputs(",\"step\":", out);
    put_number(out, step);
    fputs(",\"tol\":", out);
    put_number(out, tol > 0 ? tol : refdyn_options_default(REFDYN_AUTO).tol);
    fputs(",\"tolRates\":", out);
    put_number(out, options_number(options, "tol-rates"));
    fputs(",\n", out);
}

/* The numbers from which the shapes are computed. */
static int count_shape_numbers(const struct drawn_tape *tape) {
    int count = 0;
    for (int i = 0; i < tape->shape_count; i++)
        count +=
            tape->places[i] < 0 ? (int)DRAWN_ELEMENT_NUMBERS : (int)DRAWN_SOLID_NUMBERS + 3 * tape->places[i];
    return count;
}

void live_data_put(FILE *out, struct live *live, const struct live_range *ranges) {
    struct generation *drawn = &live->drawn.generation;
    fputs("{\n", out);
    view_palette_put(out);
    fputs("\"runs\":[{\"name\":", out);
    format_json_text(out, drawn->model.name);
    fputs(",\"model\":", out);
    format_json_text(out, drawn->model.name);
    fprintf(out, ",\"up\":%d,\n", view_upward(drawn));
    view_drawn_model_put(out, drawn, &live->tape);
    fputs(",\n", out);
    view_bounds_put(out, &drawn->model);
    fputs(",\n", out);
    put_forces(out, live);
    fputs("}],\n\"live\":{\"file\":", out);
    format_json_text(out, *live->options->operands);
    fputs(",\n", out);
    put_settings(out, live);
    put_options(out, live->options);
    fprintf(out, "\"shapeNumbers\":%d,\n\"canPull\":%s,\n", count_shape_numbers(&live->tape),
            live_hand_inputs(live) > 0 ? "true" : "false");
    put_parameters(out, live, ranges);
    put_starts(out, live, ranges);
    fputs("}}", out);
}
