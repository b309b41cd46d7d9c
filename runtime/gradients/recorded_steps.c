/*
 * Records the steps of a motion as a pattern for its copies.
 *
 * In: the accepted steps of a motion, one by one. Out: the pattern of repeated_steps.c. The event to which
 * steps lead moves in the copies, so that short steps near it would be on its wrong side. They and the step
 * before them become equally long.
 */
#include "runtime/gradients/gradients.h"

#include <math.h>
#include <stdlib.h>

/* Steps shorter than this part of the longest one on their way are tiny. */
static const double tiny = 1e-3;

/* ---- Growing arrays ---- */

/* Makes room for one more entry. Returns 0 without memory. */
static int grow(void **list, int count, int *room, size_t size) {
    if (count < *room)
        return 1;
    const int most = *room > 0 ? 2 * *room : 64;
    void *more = realloc(*list, (size_t)most * size);
    if (!more)
        return 0;
    *list = more;
    *room = most;
    return 1;
}

static struct refdyn_repeated_step *add_step(struct recorded_steps *recorded) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    void *steps = pattern->steps;
    if (!grow(&steps, pattern->step_count, &recorded->step_room, sizeof *pattern->steps))
        return NULL;
    pattern->steps = steps;
    return &pattern->steps[pattern->step_count++];
}

static struct refdyn_waypoint *add_waypoint(struct recorded_steps *recorded) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    void *waypoints = pattern->waypoints;
    if (!grow(&waypoints, pattern->waypoint_count, &recorded->waypoint_room, sizeof *pattern->waypoints))
        return NULL;
    pattern->waypoints = waypoints;
    return &pattern->waypoints[pattern->waypoint_count++];
}

/* Makes room for `count` more places. */
static int has_places(struct recorded_steps *recorded, int count) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    void *places = pattern->places;
    int is_grown = 1;
    while (is_grown && pattern->place_count + count > recorded->place_room)
        is_grown = grow(&places, recorded->place_room, &recorded->place_room, sizeof *pattern->places);
    pattern->places = places;
    return is_grown;
}

/* ---- Steps of a motion ---- */

/* Adds events that are due at the waypoint as places. */
static void add_due(struct refdyn_pattern *pattern, const struct refdyn_state_events *events, const int *due,
                    int count, struct refdyn_waypoint *waypoint) {
    waypoint->first_due = pattern->place_count;
    waypoint->due_count = count;
    for (int k = 0; k < count; k++) {
        pattern->places[pattern->place_count++] = due[k];
        waypoint->has_kinks |= refdyn_state_events_is_kink(events, due[k]);
    }
}

/* Does the last step end where the caller or the end of the motion has asked for it? */
static int is_at_fixed(const struct refdyn_motion *motion, const struct refdyn_ahead *ahead) {
    const struct refdyn_step *step = &motion->step;
    return step->t_end > step->t_begin &&
           ((refdyn_steps_end_at_outputs(motion) && step->t_end == ahead->t_out) ||
            step->t_end == ahead->bound);
}

/* Adds the waypoint at the end of the last step. Returns its index, -1 if there is none, -2 without memory.
 */
static int note_waypoint(struct recorded_steps *recorded, struct refdyn_motion *motion,
                         const struct refdyn_ahead *ahead) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    const struct refdyn_step *step = &motion->step;
    const struct refdyn_state_events *events = &motion->state_events;
    const int is_start = !ahead, is_fixed = !is_start && is_at_fixed(motion, ahead);
    const int is_time_event = !is_start && step->t_end > step->t_begin && step->t_end >= step->t_limit;
    const int is_free = motion->step.guide && !is_time_event;
    if (!is_start && !is_fixed && !is_time_event && !is_free && events->due_count == 0)
        return -1;
    struct refdyn_waypoint *waypoint = add_waypoint(recorded);
    if (!waypoint || !has_places(recorded, events->due_count + motion->work->model->break_count))
        return -2;
    *waypoint = (struct refdyn_waypoint){.t = step->t_end, .is_fixed = is_fixed};
    if (is_time_event) {
        waypoint->first_break = pattern->place_count;
        waypoint->break_count = refdyn_pattern_breaks(motion, step->t_end, recorded->breaks,
                                                      pattern->places + pattern->place_count);
        pattern->place_count += waypoint->break_count;
        waypoint->is_switch =
            fabs(motion->time_events.switched - step->t_end) <= refdyn_motion_resolution(motion, step->t_end);
    }
    add_due(pattern, events, events->due, events->due_count, waypoint);
    return pattern->waypoint_count - 1;
}

/* A kink that the motion passes at the very beginning of a step is farther from there in the copies, which
 * must end a step at it. So it becomes due at the end of the step before. Returns 0 if memory is short. */
static int note_passed(struct recorded_steps *recorded, struct refdyn_motion *motion) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    const struct refdyn_state_events *events = &motion->state_events;
    if (events->passed_count == 0 || pattern->step_count == 0 ||
        pattern->steps[pattern->step_count - 1].waypoint >= 0)
        return 1;
    struct refdyn_repeated_step *before = &pattern->steps[pattern->step_count - 1];
    struct refdyn_waypoint *waypoint = add_waypoint(recorded);
    if (!waypoint || !has_places(recorded, events->passed_count))
        return 0;
    *waypoint = (struct refdyn_waypoint){.t = before->t};
    before->waypoint = pattern->waypoint_count - 1;
    add_due(pattern, events, events->passed, events->passed_count, waypoint);
    return 1;
}

/* Has no step led away from the end of the last one, where nothing was due? In the copies, a step ends there.
 */
static int is_at_last(const struct recorded_steps *recorded, const struct refdyn_step *step) {
    const struct refdyn_pattern *pattern = &recorded->pattern;
    return step->t_end == step->t_begin && pattern->step_count > 0 &&
           pattern->steps[pattern->step_count - 1].waypoint < 0;
}

static void note(void *context, struct refdyn_motion *motion, const struct refdyn_ahead *ahead) {
    struct recorded_steps *recorded = context;
    const struct refdyn_step *step = &motion->step;
    if (recorded->status)
        return;
    const int is_noted = note_passed(recorded, motion),
              waypoint = is_noted ? note_waypoint(recorded, motion, ahead) : -2;
    if (waypoint >= 0 && ahead && is_at_last(recorded, step)) {
        recorded->pattern.steps[recorded->pattern.step_count - 1].waypoint = waypoint;
        return;
    }
    struct refdyn_repeated_step *taken = waypoint > -2 && ahead ? add_step(recorded) : NULL;
    const long rejected = motion->statistics.rejected;
    recorded->aligned = ahead ? recorded->aligned : motion->programme.aligned;
    if (!ahead)
        refdyn_kinks_watch(motion);
    if (!taken && !ahead && waypoint >= 0)
        return;
    if (!taken) {
        recorded->status = REFDYN_BAD_MEMORY;
        return;
    }
    *taken = (struct refdyn_repeated_step){.t = step->t_end,
                                           .method = step->number,
                                           .waypoint = waypoint,
                                           .is_empty = step->t_end == step->t_begin,
                                           .is_special = step->guide != NULL,
                                           .is_cut = rejected > recorded->rejected,
                                           .sees_beyond = refdyn_kinks_saw_beyond(motion),
                                           .aligns = motion->programme.aligned != recorded->aligned};
    if (step->method->kind == &refdyn_collocation && !motion->work->model->saturates)
        taken->iterations = refdyn_collocation_iterations(step, &taken->keeps);
    recorded->aligned = motion->programme.aligned;
    recorded->rejected = rejected;
}

int refdyn_recorded_start(struct recorded_steps *recorded, const struct refdyn_model *model) {
    *recorded = (struct recorded_steps){.watch = {note, recorded}};
    recorded->breaks = malloc(((size_t)model->break_count + 1) * sizeof *recorded->breaks);
    return recorded->breaks ? REFDYN_OK : REFDYN_BAD_MEMORY;
}

void refdyn_recorded_release(struct recorded_steps *recorded) {
    free(recorded->pattern.steps);
    free(recorded->pattern.waypoints);
    free(recorded->pattern.places);
    free(recorded->breaks);
    *recorded = (struct recorded_steps){.status = 0};
}

/* ---- The pattern ---- */

static int leads_to_event(const struct refdyn_pattern *pattern, int i) {
    const int waypoint = pattern->steps[i].waypoint;
    return waypoint >= 0 && !pattern->steps[i].is_empty && pattern->waypoints[waypoint].due_count > 0;
}

static double begin_of(const struct refdyn_pattern *pattern, int i) {
    return i > 0 ? pattern->steps[i - 1].t : pattern->waypoints[0].t;
}

static double length_of(const struct refdyn_pattern *pattern, int i) {
    return pattern->steps[i].t - begin_of(pattern, i);
}

/* Does step i belong to the same way, by the same method, as the one after it? */
static int is_on_way(const struct refdyn_pattern *pattern, int i) {
    return i >= 0 && pattern->steps[i].waypoint < 0 && !pattern->steps[i].is_special &&
           pattern->steps[i].method == pattern->steps[i + 1].method;
}

/* The first of the steps that share their way with step `last` to an event: back to the first that was cut
 * short or is tiny, and the step before it if it is longer than their mean. */
static int first_that_shares(const struct refdyn_pattern *pattern, int last) {
    const double end = pattern->steps[last].t;
    double longest = 0;
    int first = last;
    for (int i = last; i == last || is_on_way(pattern, i); i--)
        longest = fmax(longest, length_of(pattern, i));
    while (is_on_way(pattern, first - 1) &&
           (pattern->steps[first - 1].is_cut || length_of(pattern, first - 1) < tiny * longest))
        first--;
    return is_on_way(pattern, first - 1) &&
                   length_of(pattern, first - 1) > (end - begin_of(pattern, first)) / (last - first + 1)
               ? first - 1
               : first;
}

/* Steps to an event become equally long. Their own numbers of iterations no longer suit them, and only the
 * last one is near the event. */
static void share_way(struct recorded_steps *recorded, int last) {
    const struct refdyn_pattern *pattern = &recorded->pattern;
    const int first = first_that_shares(pattern, last);
    const double begin = begin_of(pattern, first), end = pattern->steps[last].t;
    for (int i = first; i < last; i++)
        pattern->steps[i].t = begin + (end - begin) * (i - first + 1) / (last - first + 1);
    for (int i = first; i <= last && first < last; i++)
        pattern->steps[i].iterations = pattern->steps[i].sees_beyond = 0;
    recorded->has_other_steps |= first < last;
}

int refdyn_recorded_end(struct recorded_steps *recorded) {
    const struct refdyn_pattern *pattern = &recorded->pattern;
    for (int i = 1; i < pattern->step_count && !recorded->status; i++)
        if (leads_to_event(pattern, i))
            share_way(recorded, i);
    return recorded->status;
}

int refdyn_recorded_refine(struct recorded_steps *recorded) {
    struct refdyn_pattern *pattern = &recorded->pattern;
    const int count = pattern->step_count;
    struct refdyn_repeated_step *steps = malloc(2 * ((size_t)count + 1) * sizeof *steps);
    double begin = pattern->waypoints[0].t;
    if (!steps)
        return REFDYN_BAD_MEMORY;
    recorded->has_other_steps = 1;
    pattern->step_count = 0;
    for (int i = 0; i < count; i++) {
        const struct refdyn_repeated_step *whole = &pattern->steps[i];
        if (!whole->is_empty && !whole->is_special)
            steps[pattern->step_count++] = (struct refdyn_repeated_step){.t = begin + (whole->t - begin) / 2,
                                                                         .method = whole->method,
                                                                         .waypoint = -1,
                                                                         .sees_beyond = whole->sees_beyond};
        steps[pattern->step_count++] = *whole;
        begin = whole->t;
    }
    free(pattern->steps);
    pattern->steps = steps;
    recorded->step_room = 2 * (count + 1);
    return REFDYN_OK;
}
