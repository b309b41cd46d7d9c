/*
 * Error against time of every integrator on one scene: the runtime's, GSL's msbdf and bsimp, CVODE's BDF.
 *
 * usage: integrate LIBRARY NAME START UNTIL OUTPUTS REPEATS
 * LIBRARY: the emitted C of model NAME, with its tangent, as a shared object; START: q and qd. All of them
 * call the same emitted functions with the same Jacobian. The error is the largest distance, over the output
 * times and the points of interest, from a reference: rk8 at reference_tol, whose distance from rodas5p at
 * that tolerance is printed. Times: CPU seconds of the motion, the shortest of the repeats, which go through
 * all integrators in turn and leave out what is slow. One line each: METHOD TOLERANCE-OR-STEP ERROR SECONDS
 * STEPS EVALUATIONS JACOBIANS.
 *
 * On scenes with rows the runtime's adaptive methods and bsimp project; rk4, msbdf and CVODE integrate the
 * equations of reduced index with the Baumgarte gains of the model. Tolerances of GSL and CVODE are absolute,
 * the same for positions and velocities.
 */
#include "runtime/core/motion/motion.h"
#include "runtime/bindings/gsl/first_order.h"
#include "refdyn_gsl.h"

#include <cvode/cvode.h>
#include <dlfcn.h>
#include <gsl/gsl_errno.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

enum { SETTINGS = 11, STEPS_MOST = 2000000, INTEGRATORS_MOST = 64 };

static const double tol_first = 1e-2, step_first = 2e-2, reference_tol = 3e-13;
static const double patience = 3;        /* [s] tighter tolerances than one that took so long are not tried */
static const double repeated = 0.3;      /* [s] what takes longer is not repeated */
static const double weight_none = 1e100; /* of work_done, which stays 0 */

/* CVODE with the exact Jacobian; with difference quotients; exact, without the orders 3 to 5, whose stability
 * ends where oscillations lie. */
enum kind { CORE, GSL, CVODE_EXACT, CVODE_DIFFERENCES, CVODE_ORDER_2 };

struct integrator {
    enum kind kind;
    int method; /* of the core, of GSL */
    const char *name;
};

struct scene {
    const struct refdyn_model *model;
    double *q, *qd, until;
    int outputs, tracked; /* tracked: numbers of all points at one time */
};

struct trial {
    double setting, error, seconds; /* tolerance or step */
    long steps, evaluations, tangents;
    int is_done;
};

/* What one motion needs. */
struct motion {
    struct scene *scene;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    void *work_memory, *integrator_memory;
    double *by_y, *by_t; /* row-major Jacobian */
    double *track;       /* (outputs x tracked) */
};

static void stop(const char *what, const char *which) {
    fprintf(stderr, "integrate: %s: %s\n", what, which);
    exit(1);
}

static void *room(size_t count, size_t size) {
    void *memory = calloc(count + 1, size);
    if (!memory)
        stop("memory", "none left");
    return memory;
}

static double cpu_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---- A motion ---- */

static void open_motion(struct motion *motion, struct scene *scene, const struct refdyn_options *options) {
    const struct refdyn_model *model = scene->model;
    const size_t work_size = refdyn_workspace_size(model),
                 integrator_size = refdyn_integrator_size(model, options);
    const size_t size = (size_t)(2 * model->n + 1);
    *motion = (struct motion){.scene = scene};
    motion->work_memory = room(1, work_size);
    motion->integrator_memory = room(1, integrator_size);
    motion->by_y = room(size * size, sizeof(double));
    motion->by_t = room(size, sizeof(double));
    motion->track = room((size_t)(scene->outputs * scene->tracked), sizeof(double));
    if (refdyn_workspace_init(&motion->work, model, motion->work_memory, work_size) ||
        refdyn_integrator_init(&motion->integrator, &motion->work, options, motion->integrator_memory,
                               integrator_size))
        stop("integrator", model->name);
    refdyn_prepare(&motion->work);
    refdyn_anchor(&motion->work, 0, scene->q, scene->qd, NULL);
}

static void close_motion(struct motion *motion) {
    free(motion->work_memory);
    free(motion->integrator_memory);
    free(motion->by_y);
    free(motion->by_t);
    free(motion->track);
}

static double output_time(const struct scene *scene, int i) {
    return scene->until * (i + 1) / scene->outputs;
}

static void look(struct motion *motion, int i, double t, const double *q, const double *qd) {
    const struct scene *scene = motion->scene;
    scene->model->r(motion->work.p, motion->work.x, t, q, qd, motion->track + i * scene->tracked);
}

/* ---- The integrators; each returns 0 when it reached the end ---- */

static int by_core(struct motion *motion) {
    struct refdyn_integrator *integrator = &motion->integrator;
    int status = refdyn_integrator_start(integrator, 0, motion->scene->q, motion->scene->qd);
    refdyn_integrator_until(integrator, motion->scene->until);
    for (int i = 0; i < motion->scene->outputs && !status; i++) {
        status = refdyn_integrator_to(integrator, output_time(motion->scene, i));
        look(motion, i, integrator->t, integrator->q, integrator->qd);
    }
    return status;
}

static int by_gsl(struct motion *motion, enum refdyn_gsl_method method) {
    struct refdyn_integrator *integrator = &motion->integrator;
    struct refdyn_gsl gsl;
    int status = refdyn_gsl_init(&gsl, integrator, method);
    if (!status)
        status = refdyn_integrator_start(integrator, 0, motion->scene->q, motion->scene->qd);
    for (int i = 0; i < motion->scene->outputs && !status; i++) {
        status = refdyn_gsl_to(&gsl, output_time(motion->scene, i));
        look(motion, i, integrator->t, integrator->q, integrator->qd);
    }
    refdyn_gsl_release(&gsl);
    return status;
}

static int cvode_slope(realtype t, N_Vector y, N_Vector dydt, void *data) {
    struct motion *motion = data;
    return refdyn_first_order_rates(&motion->integrator.motion->step, t, N_VGetArrayPointer(y),
                                    N_VGetArrayPointer(dydt));
}

static int cvode_jacobian(realtype t, N_Vector y, N_Vector dydt, SUNMatrix J, void *data, N_Vector a,
                          N_Vector b, N_Vector c) {
    (void)dydt, (void)a, (void)b, (void)c;
    struct motion *motion = data;
    const int size = 2 * motion->work.n + 1;
    const int status = refdyn_first_order_jacobian(&motion->integrator.motion->step, t, N_VGetArrayPointer(y),
                                                   motion->by_y, motion->by_t);
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++)
            SM_ELEMENT_D(J, i, j) = motion->by_y[i * size + j];
    return status;
}

/* Tolerances of the components, and the settings that are not CVODE's defaults. */
static int set_cvode(struct motion *motion, void *cvode, N_Vector y, N_Vector weights, SUNMatrix J,
                     SUNLinearSolver solver, enum kind kind) {
    const int n = motion->work.n;
    for (int i = 0; i < 2 * n; i++)
        NV_Ith_S(weights, i) = motion->integrator.options.tol;
    NV_Ith_S(weights, 2 * n) = weight_none;
    return CVodeInit(cvode, cvode_slope, 0, y) || CVodeSVtolerances(cvode, 0, weights) ||
           CVodeSetUserData(cvode, motion) || CVodeSetLinearSolver(cvode, solver, J) ||
           (kind != CVODE_DIFFERENCES && CVodeSetJacFn(cvode, cvode_jacobian)) ||
           (kind == CVODE_ORDER_2 && CVodeSetMaxOrd(cvode, 2)) || CVodeSetMaxNumSteps(cvode, STEPS_MOST) ||
           CVodeSetStopTime(cvode, motion->scene->until);
}

static int run_cvode(struct motion *motion, void *cvode, N_Vector y) {
    double *state = N_VGetArrayPointer(y), t = 0;
    const int n = motion->work.n;
    for (int i = 0; i < motion->scene->outputs; i++) {
        if (CVode(cvode, output_time(motion->scene, i), y, &t, CV_NORMAL) < 0)
            return 1;
        look(motion, i, t, state, state + n);
    }
    return CVodeGetNumSteps(cvode, &motion->integrator.statistics.steps) ||
           CVodeGetNumJacEvals(cvode, &motion->integrator.statistics.tangents);
}

static void no_message(int code, const char *module, const char *function, char *message, void *data) {
    (void)code, (void)module, (void)function, (void)message, (void)data;
}

static int by_cvode(struct motion *motion, enum kind kind) {
    const int n = motion->work.n;
    SUNContext context;
    int status = refdyn_integrator_start(&motion->integrator, 0, motion->scene->q, motion->scene->qd);
    if (status || SUNContext_Create(NULL, &context))
        return 1;
    N_Vector y = N_VNew_Serial(2 * n + 1, context), weights = N_VClone(y);
    SUNMatrix J = SUNDenseMatrix(2 * n + 1, 2 * n + 1, context);
    SUNLinearSolver solver = SUNLinSol_Dense(y, J, context);
    void *cvode = CVodeCreate(CV_BDF, context);
    memcpy(N_VGetArrayPointer(y), motion->integrator.motion->step.state_new,
           (size_t)(2 * n + 1) * sizeof(double));
    CVodeSetErrHandlerFn(cvode, no_message, NULL);
    status = set_cvode(motion, cvode, y, weights, J, solver, kind);
    if (!status)
        status = run_cvode(motion, cvode, y);
    motion->integrator.statistics.evaluations = motion->work.evaluations;
    CVodeFree(&cvode);
    SUNLinSolFree(solver);
    SUNMatDestroy(J);
    N_VDestroy(weights);
    N_VDestroy(y);
    SUNContext_Free(&context);
    return status;
}

/* ---- Trials ---- */

static struct refdyn_options options_of(const struct integrator *integrator, double setting) {
    const int method = integrator->kind == CORE ? integrator->method : REFDYN_RODAS5P;
    struct refdyn_options options = refdyn_options_default((enum refdyn_method)method);
    if (options.tol > 0)
        options.tol = setting;
    else
        options.step = setting;
    if (integrator->kind != CORE && !(integrator->kind == GSL && integrator->method == REFDYN_BSIMP))
        options.stabilise = REFDYN_BAUMGARTE;
    options.step_limit = STEPS_MOST;
    return options;
}

static int integrate(const struct integrator *integrator, struct motion *motion) {
    switch (integrator->kind) {
    case CORE:
        return by_core(motion);
    case GSL:
        return by_gsl(motion, (enum refdyn_gsl_method)integrator->method);
    case CVODE_EXACT:
    case CVODE_DIFFERENCES:
    case CVODE_ORDER_2:
        return by_cvode(motion, integrator->kind);
    }
    return 1;
}

static double distance(const struct scene *scene, const double *a, const double *b) {
    double largest = 0;
    for (int i = 0; i < scene->outputs * scene->tracked; i += 3) {
        const double off =
            sqrt(pow(a[i] - b[i], 2) + pow(a[i + 1] - b[i + 1], 2) + pow(a[i + 2] - b[i + 2], 2));
        if (!(off <= largest))
            largest = off;
    }
    return largest;
}

/* One motion; its track is compared with the reference, or kept where there is none. */
static void try_once(const struct integrator *integrator, struct scene *scene, struct trial *trial,
                     const double *reference, double *kept) {
    const struct refdyn_options options = options_of(integrator, trial->setting);
    struct motion motion;
    open_motion(&motion, scene, &options);
    const double begin = cpu_seconds();
    const int status = integrate(integrator, &motion);
    const double seconds = cpu_seconds() - begin;
    trial->seconds = trial->is_done ? fmin(trial->seconds, seconds) : seconds;
    trial->is_done = 1;
    trial->error = status ? INFINITY : reference ? distance(scene, motion.track, reference) : 0;
    trial->steps = motion.integrator.statistics.steps;
    trial->evaluations = motion.integrator.statistics.evaluations;
    trial->tangents = motion.integrator.statistics.tangents;
    if (kept)
        memcpy(kept, motion.track, (size_t)(scene->outputs * scene->tracked) * sizeof *kept);
    close_motion(&motion);
}

static double *make_reference(struct scene *scene) {
    const size_t count = (size_t)(scene->outputs * scene->tracked);
    double *reference = room(count, sizeof *reference), *other = room(count, sizeof *other);
    const struct integrator first = {CORE, REFDYN_RK8, "rk8"}, second = {CORE, REFDYN_RODAS5P, "rodas5p"};
    struct trial trial = {.setting = reference_tol};
    try_once(&first, scene, &trial, NULL, reference);
    if (trial.error > 0)
        stop("the reference failed", scene->model->name);
    try_once(&second, scene, &trial, reference, other);
    printf("# reference: rk8 and rodas5p at %g differ by %.2g m; last points", reference_tol, trial.error);
    for (int i = (scene->outputs - 1) * scene->tracked; i < scene->outputs * scene->tracked; i++)
        printf(" %.16g", reference[i]);
    printf("\n");
    free(other);
    return reference;
}

static int list_integrators(struct integrator *list) {
    int count = 0;
    for (int method = 0; method < REFDYN_METHOD_COUNT; method++)
        list[count++] = (struct integrator){CORE, method, refdyn_method_name(method)};
    for (int method = 0; method < REFDYN_GSL_METHOD_COUNT; method++)
        list[count++] = (struct integrator){GSL, method, refdyn_gsl_method_name(method)};
    list[count++] = (struct integrator){CVODE_EXACT, 0, "cvode"};
    list[count++] = (struct integrator){CVODE_DIFFERENCES, 0, "cvode_differences"};
    list[count++] = (struct integrator){CVODE_ORDER_2, 0, "cvode_order_2"};
    return count;
}

/* Tolerances by decades, steps by factors of two. */
static double setting_of(const struct integrator *integrator, int i) {
    const int is_fixed =
        integrator->kind == CORE && refdyn_options_default((enum refdyn_method)integrator->method).tol == 0;
    return is_fixed ? step_first * pow(0.5, i) : tol_first * pow(0.1, i);
}

static void measure(struct scene *scene, int repeats) {
    static struct trial trials[INTEGRATORS_MOST][SETTINGS];
    struct integrator list[INTEGRATORS_MOST];
    const int count = list_integrators(list);
    double *reference = make_reference(scene);
    for (int repeat = 0; repeat < repeats; repeat++)
        for (int i = 0; i < SETTINGS; i++)
            for (int k = 0; k < count; k++) {
                struct trial *trial = &trials[k][i];
                trial->setting = setting_of(&list[k], i);
                const int is_due = repeat > 0 ? trial->is_done && trial->seconds < repeated
                                              : i == 0 || (trial[-1].is_done && trial[-1].seconds < patience);
                if (is_due)
                    try_once(&list[k], scene, trial, reference, NULL);
            }
    for (int k = 0; k < count; k++)
        for (int i = 0; i < SETTINGS && trials[k][i].is_done; i++) {
            const struct trial *trial = &trials[k][i];
            printf("%s %.6g %.3e %.4e %ld %ld %ld\n", list[k].name, trial->setting, trial->error,
                   trial->seconds, trial->steps, trial->evaluations, trial->tangents);
        }
    free(reference);
}

/* ---- Scene ---- */

static void read_start(struct scene *scene, const char *path) {
    const int n = scene->model->n;
    FILE *file = fopen(path, "r");
    scene->q = room((size_t)(2 * n), sizeof(double));
    scene->qd = scene->q + n;
    for (int j = 0; file && j < 2 * n; j++)
        if (fscanf(file, "%lf", &scene->q[j]) != 1)
            stop("too few numbers", path);
    if (!file)
        stop("cannot be read", path);
    fclose(file);
}

int main(int argc, char **argv) {
    char symbol[200];
    struct scene scene = {0};
    if (argc != 7)
        stop("usage", "integrate LIBRARY NAME START UNTIL OUTPUTS REPEATS");
    void *library = dlopen(argv[1], RTLD_NOW);
    snprintf(symbol, sizeof symbol, "%s_model", argv[2]);
    scene.model = library ? dlsym(library, symbol) : NULL;
    if (!scene.model || !scene.model->tangent || scene.model->point_count == 0)
        stop("no model with tangent and points", argv[1]);
    read_start(&scene, argv[3]);
    scene.until = strtod(argv[4], NULL);
    scene.outputs = atoi(argv[5]);
    scene.tracked = 3 * scene.model->point_count;
    gsl_set_error_handler_off();
    measure(&scene, atoi(argv[6]));
    free(scene.q);
    dlclose(library);
    return 0;
}
