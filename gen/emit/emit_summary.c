/* Describes the model and the emitted functions for people: the texts of `refdyn check` and `refdyn gen`. */
#include "gen/emit/emit.h"
#include "gen/plan/plan.h"
#include "gen/tree/tree.h"

#include <math.h>
#include <string.h>

static double value_of(const struct generation *gen, expression e) {
    return parameters_evaluate(gen->model.graph, gen->model.parameters, e);
}

static void print_unread(const struct generation *gen, FILE *out) {
    const struct plan *plan = gen->plan;
    const char *separator = "unused parameters:";
    for (int i = 0; i < gen->model.parameter_count; i++) {
        bool read = false;
        for (int k = 0; k < plan->parameter_count; k++)
            read |= plan->parameters[k] == i;
        if (!read && (!gen->model.fold || gen->model.parameters[i].is_anchored)) {
            fprintf(out, "%s %s", separator, gen->model.parameters[i].name);
            separator = "";
        }
    }
    if (!*separator)
        fputc('\n', out);
}

int emit_name_width(const struct plan *plan) {
    size_t width = 10;
    for (int f = 0; f < plan->function_count; f++) {
        const size_t length = strlen(plan->functions[f].operations.quantity);
        width = length > width ? length : width;
    }
    return (int)width;
}

static const char *ending(int count) {
    return count == 1 ? "" : "s";
}

static void print_counts(FILE *out, const struct generation *gen) {
    const int joints = tree_joint_count(&gen->tree), states = gen->model.state_count;
    fprintf(out, "%d coordinate%s, ", joints, ending(joints));
    if (states)
        fprintf(out, "%d state%s, ", states, ending(states));
    fprintf(out, "%d constraint row%s", gen->model.row_count, ending(gen->model.row_count));
}

void gen_print_summary(const struct generation *gen, FILE *out) {
    const struct plan *plan = gen->plan;
    fprintf(out, "%s: ", gen->model.name);
    print_counts(out, gen);
    fprintf(out, ", %d point%s, %d parameter%s%s\n", gen->model.point_count, ending(gen->model.point_count),
            plan->parameter_count, ending(plan->parameter_count),
            gen->model.fold ? " (others folded into numbers)" : "");
    const int width = emit_name_width(plan);
    fprintf(out, "%-*s %8s %8s %6s %6s\n", width, "function", "adds", "muls", "divs", "funcs");
    for (int f = 0; f < plan->function_count; f++) {
        const struct operation_count *count = &plan->functions[f].operations;
        fprintf(out, "%-*s %8ld %8ld %6ld %6ld\n", width, count->quantity, count->adds, count->muls,
                count->divs, count->functions);
    }
    for (int i = 0; i < plan->rolled->run_count; i++)
        fprintf(out, "loop over %d elements of %d coordinates: %s\n", plan->rolled->runs[i].count,
                plan->rolled->runs[i].period, plan->rolled->runs[i].name);
    if (plan->choices)
        fprintf(out, "choices: %s\n", plan->choices);
    if (plan->left_out)
        fprintf(out, "left out: %s\n", plan->left_out);
    print_unread(gen, out);
    for (int i = 0; i < plan->file_count; i++)
        fprintf(out, "%s: %zu bytes\n", plan->files[i].name, plan->files[i].length);
}

/* The mass of its bodies and its beam. */
static double link_mass(const struct generation *gen, const struct link *link) {
    double mass = 0;
    for (int i = 0; i < link->beam.segment_count; i++) {
        const struct segment *segment = &link->beam.segments[i];
        mass += value_of(gen, segment->rho) * value_of(gen, segment->area) * value_of(gen, segment->length);
    }
    for (int i = 0; i < link->solid_count; i++)
        mass += value_of(gen, link->solids[i].mass);
    return mass;
}

static void print_links(const struct generation *gen, FILE *out) {
    fprintf(out, "links:\n");
    for (int i = 0; i < gen->model.link_count; i++) {
        const struct link *link = &gen->model.links[i];
        fprintf(out, "  %s on %s%s", link->name,
                link->on.link < 0 ? "the ground" : gen->model.links[link->on.link].name,
                link->on.where == AT_TIP ? ".tip" : "");
        if (link->on.where == AT_ALONG)
            fprintf(out, " at %g m along it", value_of(gen, link->on.along));
        fprintf(out, ", %g kg", link_mass(gen, link));
        for (int s = 0; s < link->beam.segment_count; s++)
            fprintf(out, ", %s of %g m in %d rigid finite elements", s ? "then" : "beam",
                    value_of(gen, link->beam.segments[s].length), link->beam.segments[s].rfe);
        fputc('\n', out);
    }
}

static void print_limit(const char *what, double limit, FILE *out) {
    if (isfinite(limit))
        fprintf(out, "%s %g", what, limit);
}

static void print_limits(const struct limits *limits, FILE *out) {
    if (!limits)
        return;
    fputs(", limits", out);
    print_limit(" from", limits->from, out);
    print_limit(" to", limits->to, out);
    print_limit(" rate", limits->rate, out);
    print_limit(" force", limits->force, out);
}

static void print_coordinate(const struct generation *gen, const struct frame *frame, FILE *out) {
    if (frame->joint.has_direction)
        fprintf(out, ", %s %s", frame->joint.is_revolute ? "about" : "along",
                joint_axis_text(gen->model.graph->memory, &gen->model, &frame->joint));
    if (frame->joint.rotor)
        fprintf(out, ", rotor %g", value_of(gen, frame->joint.rotor));
    if (frame->joint.stiffness)
        fprintf(out, ", spring %g", value_of(gen, frame->joint.stiffness));
    if (frame->joint.damping)
        fprintf(out, ", damper %g", value_of(gen, frame->joint.damping));
    print_limits(frame->joint.limits, out);
    fputc('\n', out);
}

static void print_coordinates(const struct generation *gen, FILE *out) {
    fprintf(out, "coordinates:\n");
    const int joints = tree_joint_count(&gen->tree);
    for (int i = 0; i < joints; i++) {
        const struct frame *frame = &gen->tree.frames[i];
        fprintf(out, "  %d %s [%s] on %s, starts at %g", i, frame->name,
                frame->joint.is_revolute ? "rad" : "m",
                frame->parent < 0 ? "the ground" : gen->tree.frames[frame->parent].name,
                value_of(gen, frame->joint.start));
        print_coordinate(gen, frame, out);
    }
    if (gen->model.state_count)
        fprintf(out, "states:\n");
    for (int i = 0; i < gen->model.state_count; i++)
        fprintf(out, "  %d %s [%s], starts at %g\n", joints + i, gen->model.states[i].name,
                gen->model.states[i].unit, value_of(gen, gen->model.states[i].start));
}

static void print_programme(const struct generation *gen, FILE *out) {
    static const char *const levels[] = {"position level", "velocity level", "acceleration level"};
    _Static_assert(sizeof levels / sizeof *levels == ROW_ACCELERATION + 1, "each level has a name");
    const struct model *model = &gen->model;
    if (model->row_count)
        fprintf(out, "constraints:\n");
    for (int i = 0; i < model->row_count; i++)
        fprintf(out, "  %d %s: %s, alpha %g, beta %g\n", i + 1,
                model->rows[i].rests ? "contact" : levels[model->rows[i].level], model->rows[i].name,
                value_of(gen, model->rows[i].alpha), value_of(gen, model->rows[i].beta));
    if (model->point_count)
        fprintf(out, "points:\n");
    for (int i = 0; i < model->point_count; i++)
        fprintf(out, "  %s\n", model->points[i].name);
}

static void print_values(const struct generation *gen, FILE *out) {
    const struct model *model = &gen->model;
    if (model->option_count)
        fprintf(out, "options:\n");
    for (int i = 0; i < model->option_count; i++)
        fprintf(out, "  %s = %s\n", model->options[i].name, model->options[i].value);
    if (model->parameter_count)
        fprintf(out, "parameters:\n");
    for (int i = 0; i < model->parameter_count; i++) {
        const struct parameter *p = &model->parameters[i];
        if (p->is_anchored && !p->is_given)
            fprintf(out, "  %s [%s] from the start of the motion\n", p->name, p->unit);
        else
            fprintf(out, "  %s = %g [%s]\n", p->name, p->value, p->unit);
    }
    if (model->input_count)
        fprintf(out, "inputs:\n");
    for (int i = 0; i < model->input_count; i++)
        fprintf(out, "  %s = %g [%s]\n", model->inputs[i].name, model->inputs[i].value,
                model->inputs[i].unit);
}

void gen_print_model(const struct generation *gen, FILE *out) {
    fprintf(out, "%s: %d link%s, ", gen->model.name, gen->model.link_count, ending(gen->model.link_count));
    print_counts(out, gen);
    fputc('\n', out);
    print_links(gen, out);
    print_coordinates(gen, out);
    print_programme(gen, out);
    print_values(gen, out);
}
