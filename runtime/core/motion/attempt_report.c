/*
 * The report of each attempted step, for callers that ask: why it was refused, and where it ends.
 *
 * The report is complete when the attempt is. Until then its verdict names the part of the step in progress,
 * which is the reason if this part fails.
 */
#include "runtime/core/motion/motion.h"

#include <math.h>

/* ---- Names ---- */

#define NAME(number, name) [number] = (name),
static const char *const kinds[] = {REFDYN_STEP_KINDS(NAME)};
static const char *const verdicts[] = {REFDYN_VERDICTS(NAME)};
static const char *const obstacles[] = {REFDYN_OBSTACLES(NAME)};
#undef NAME

static const char *name_in(const char *const *names, int count, int number) {
    return number >= 0 && number < count ? names[number] : NULL;
}

const char *refdyn_step_kind_name(int kind) {
    return name_in(kinds, REFDYN_STEP_KIND_COUNT, kind);
}

const char *refdyn_verdict_name(int verdict) {
    return name_in(verdicts, REFDYN_VERDICT_COUNT, verdict);
}

const char *refdyn_obstacle_name(int obstacle) {
    return name_in(obstacles, REFDYN_OBSTACLE_COUNT, obstacle);
}

/* ---- One attempt ---- */

void refdyn_tried_begin(struct refdyn_motion *motion, enum refdyn_step_kind kind, enum refdyn_method method,
                        double h) {
    static const enum refdyn_obstacle obstacles_of[REFDYN_STEP_KIND_COUNT] = {
        [REFDYN_STEP_CROSSING] = REFDYN_OBSTACLE_SINGULAR, [REFDYN_STEP_FADING] = REFDYN_OBSTACLE_FADING};
    motion->tried = (struct refdyn_tried){.t = motion->step.t_begin,
                                          .h = h,
                                          .method = method,
                                          .kind = kind,
                                          .error = NAN,
                                          .verdict = REFDYN_TRIED_STAGE,
                                          .obstacle = obstacles_of[kind],
                                          .event = -1};
}

enum refdyn_step_kind refdyn_tried_kind(const struct refdyn_motion *motion) {
    if (motion->step.guide == &motion->fading.guide)
        return REFDYN_STEP_FADING;
    if (motion->step.guide)
        return REFDYN_STEP_CROSSING;
    if (motion->step.is_first)
        return REFDYN_STEP_START;
    return motion->options.method == REFDYN_AUTO && motion->automatic.at >= 0 ? REFDYN_STEP_TRIAL
                                                                              : REFDYN_STEP_ORDINARY;
}

void refdyn_tried_meets(struct refdyn_motion *motion, enum refdyn_obstacle obstacle, int value) {
    const int is_kink = value >= motion->state_events.named;
    const int is_event = obstacle == REFDYN_OBSTACLE_STATE_EVENT;
    motion->tried.obstacle = is_event && is_kink ? REFDYN_OBSTACLE_KINK : obstacle;
    motion->tried.event = is_event && !is_kink ? value : -1;
}

/* Newton iterations, if the method that took the step has them and is still in use. */
static int iterations_of(const struct refdyn_motion *motion) {
    const struct refdyn_step *step = &motion->step;
    int keeps;
    return step->number == motion->tried.method && step->method->kind == &refdyn_collocation
               ? refdyn_collocation_iterations(step, &keeps)
               : -1;
}

/* Parts of the motion also refuse a step by NO_CONVERGENCE. It is a cause only where an iteration has failed.
 */
static int cause_of(const struct refdyn_tried *tried, int status) {
    const int iterates = tried->verdict == REFDYN_TRIED_STAGE || tried->verdict == REFDYN_TRIED_END;
    return status != REFDYN_NO_CONVERGENCE || iterates ? status : REFDYN_OK;
}

void refdyn_tried_end(struct refdyn_motion *motion, int cause) {
    struct refdyn_tried *tried = &motion->tried;
    if (!motion->note)
        return;
    tried->cause = cause_of(tried, cause ? cause : tried->cause);
    tried->order = isfinite(tried->error)
                       ? refdyn_control_order(&motion->control, refdyn_method_definition(tried->method),
                                              tried->h, tried->error)
                       : NAN;
    tried->iterations = iterations_of(motion);
    tried->rank = motion->work->partition.rank;
    motion->note(motion->note_context, tried);
}

void refdyn_tried_accept(struct refdyn_motion *motion) {
    motion->tried.verdict = REFDYN_TRIED_ACCEPTED;
    motion->step.is_first = 0;
    refdyn_tried_end(motion, REFDYN_OK);
}

int refdyn_integrator_watch(struct refdyn_integrator *integrator, refdyn_note *note, void *context) {
    if (!refdyn_integrator_is_laid_out(integrator))
        return REFDYN_NOT_STARTED;
    integrator->motion->note = note;
    integrator->motion->note_context = context;
    return REFDYN_OK;
}
