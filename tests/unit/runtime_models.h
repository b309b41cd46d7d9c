/*
 * Models for tests of the runtime, written by hand against refdyn_model.h, each with its equations above it.
 *
 * A rig is a model with its workspace and integrator in memory that has guard bytes at both ends.
 */
#ifndef RUNTIME_MODELS_H
#define RUNTIME_MODELS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "refdyn.h"

/*
 * Cart, spring pendulum: cart s on a spring and damper, from it a mass on a spring of length r at angle th.
 * Tip x = s + r sin th, z = -r cos th; tip acceleration = J qdd + b.
 * Row 1 (position): x = x0 + A sin(w t). Row 2 (velocity, nonlinear in qd): xd^2 + zd^2 = V(t)^2, V = V0 + V1
 * sin t.
 */
enum { SPRING_N = 3, SPRING_M = 2 };
static const double cart_mass = 1.37, tip_mass = 0.713, cart_spring = 41.3, cart_damper = 0.87,
                    rod_spring = 93.1, rod_length = 0.8321, gravity = 9.81;
static const double sweep = 0.0713, sweep_rate = 2.385, sweep_middle = 0.3917, speed = 1.293,
                    speed_swing = 0.317;
static const double row_alpha = 11.3, row_beta = 7.9;

struct tip {
    double Jx[3], Jz[3], bx, bz, x, z, xd, zd;
};

static inline struct tip spring_tip(const double *q, const double *qd) {
    const double s = sin(q[2]), c = cos(q[2]), r = q[1], rd = qd[1], thd = qd[2];
    return (struct tip){
        .Jx = {1, s, r * c},
        .Jz = {0, -c, r * s},
        .bx = 2 * rd * thd * c - r * thd * thd * s,
        .bz = 2 * rd * thd * s + r * thd * thd * c,
        .x = q[0] + r * s,
        .z = -r * c,
        .xd = qd[0] + rd * s + r * thd * c,
        .zd = -rd * c + r * thd * s,
    };
}

static inline void spring_M(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t;
    const struct tip tip = spring_tip(q, qd);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = tip_mass * (tip.Jx[i] * tip.Jx[j] + tip.Jz[i] * tip.Jz[j]);
    out[0] += cart_mass;
}

static inline void spring_h(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t;
    const struct tip tip = spring_tip(q, qd);
    for (int i = 0; i < 3; i++)
        out[i] = -tip_mass * (tip.Jx[i] * tip.bx + tip.Jz[i] * tip.bz);
}

static inline void spring_Q(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t;
    const struct tip tip = spring_tip(q, qd);
    for (int i = 0; i < 3; i++)
        out[i] = -tip_mass * gravity * tip.Jz[i];
    out[0] -= cart_spring * q[0] + cart_damper * qd[0];
    out[1] -= rod_spring * (q[1] - rod_length);
}

static inline void spring_Q_q(const double *p, const double *x, double t, const double *q, const double *qd,
                              double *out) {
    (void)p, (void)x, (void)t, (void)qd;
    const double s = sin(q[2]), c = cos(q[2]), weight = tip_mass * gravity;
    memset(out, 0, 9 * sizeof *out);
    out[0] = -cart_spring;
    out[4] = -rod_spring;
    out[5] = out[7] = -weight * s;
    out[8] = -weight * q[1] * c;
}

static inline void spring_u(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x, (void)t;
    const struct tip tip = spring_tip(q, qd);
    for (int j = 0; j < 3; j++) {
        out[j] = tip.Jx[j];
        out[3 + j] = 2 * (tip.xd * tip.Jx[j] + tip.zd * tip.Jz[j]);
    }
}

static inline void spring_v(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    (void)p, (void)x;
    const struct tip tip = spring_tip(q, qd);
    out[0] = tip.bx + sweep * sweep_rate * sweep_rate * sin(sweep_rate * t);
    out[1] =
        2 * (tip.xd * tip.bx + tip.zd * tip.bz) - 2 * (speed + speed_swing * sin(t)) * speed_swing * cos(t);
}

static inline void spring_phi(const double *p, const double *x, double t, const double *q, const double *qd,
                              double *out) {
    (void)p, (void)x;
    out[0] = spring_tip(q, qd).x - sweep_middle - sweep * sin(sweep_rate * t);
    out[1] = 0;
}

static inline void spring_psi(const double *p, const double *x, double t, const double *q, const double *qd,
                              double *out) {
    (void)p, (void)x;
    const struct tip tip = spring_tip(q, qd);
    const double wanted = speed + speed_swing * sin(t);
    out[0] = tip.xd - sweep * sweep_rate * cos(sweep_rate * t);
    out[1] = tip.xd * tip.xd + tip.zd * tip.zd - wanted * wanted;
}

static inline void spring_k(const double *p, const double *x, double t, const double *q, const double *qd,
                            double *out) {
    double v[2], phi[2], psi[2];
    spring_v(p, x, t, q, qd, v);
    spring_phi(p, x, t, q, qd, phi);
    spring_psi(p, x, t, q, qd, psi);
    for (int a = 0; a < 2; a++)
        out[a] = -v[a] - 2 * row_alpha * psi[a] - row_beta * row_beta * phi[a];
}

static inline void spring_energy(const double *p, const double *x, double t, const double *q,
                                 const double *qd, double *out) {
    (void)p, (void)x, (void)t;
    const struct tip tip = spring_tip(q, qd);
    out[0] = (cart_mass * qd[0] * qd[0] + tip_mass * (tip.xd * tip.xd + tip.zd * tip.zd)) / 2;
    out[1] = tip_mass * gravity * tip.z +
             (cart_spring * q[0] * q[0] + rod_spring * (q[1] - rod_length) * (q[1] - rod_length)) / 2;
}

static inline void spring_power(const double *p, const double *x, double t, const double *q, const double *qd,
                                double *out) {
    (void)p, (void)x, (void)t, (void)q;
    out[0] = -cart_damper * qd[0] * qd[0];
}

static const struct refdyn_name spring_coordinates[] = {
    {"cart", "m", 0.0713}, {"rod", "m", 0.9171}, {"angle", "rad", 0.5313}};
static const struct refdyn_row spring_rows[] = {{"sweep", REFDYN_POSITION, 0, ""},
                                                {"speed", REFDYN_VELOCITY, 0, ""}};

static inline struct refdyn_model spring_model(int rows) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "spring",
        .hash = "",
        .n = SPRING_N,
        .m = rows,
        .coordinates = spring_coordinates,
        .rows = spring_rows,
        .M = spring_M,
        .h = spring_h,
        .Q = spring_Q,
        .Q_q = spring_Q_q,
        .u = spring_u,
        .v = spring_v,
        .phi = spring_phi,
        .psi = spring_psi,
        .k = spring_k,
        .energy = spring_energy,
        .power = spring_power,
    };
}

/*
 * Three cranks (angles a, b, e) under one coupler (angle c): a parallelogram with an additional middle crank.
 * All four loop rows are satisfied, but only three are independent while c = 0. D: distance, L: length, rods
 * with their mass in the middle. Rows: L cos a + D cos c - D - L cos b, L sin a + D sin c - L sin b, and the
 * same with D/2 and e.
 */
enum { CRANKS_N = 4, CRANKS_M = 4 };
static const double crank_length = 0.613, crank_mass = 0.817, crank_inertia = 0.0931, coupler_length = 1.117,
                    coupler_mass = 1.943, coupler_inertia = 0.217;

/* equations: M f u v phi psi k; order of q: a, c, b, e */
static inline void cranks_equations(const double *p, const double *x, double t, const double *q,
                                    const double *qd, double *out) {
    (void)p, (void)x, (void)t;
    const double L = crank_length, D = coupler_length;
    double *M = out, *f = M + 16, *u = f + 4, *v = u + 16, *phi = v + 4, *psi = phi + 4, *k = psi + 4;
    const double s[4] = {sin(q[0]), sin(q[1]), sin(q[2]), sin(q[3])};
    const double c[4] = {cos(q[0]), cos(q[1]), cos(q[2]), cos(q[3])};
    memset(out, 0, (16 + 4 + 16 + 4 * 4) * sizeof *out);
    const double half = D / 2, crank = crank_inertia + crank_mass * L * L / 4;
    M[0] = crank + coupler_mass * L * L;
    M[5] = coupler_inertia + coupler_mass * half * half;
    M[1] = M[4] = coupler_mass * L * half * (c[0] * c[1] + s[0] * s[1]);
    M[10] = M[15] = crank;
    /* coupler centre: bias acceleration and columns */
    const double bx = -L * qd[0] * qd[0] * c[0] - half * qd[1] * qd[1] * c[1];
    const double by = -L * qd[0] * qd[0] * s[0] - half * qd[1] * qd[1] * s[1];
    f[0] = -coupler_mass * (-L * s[0] * bx + L * c[0] * (by + gravity)) - crank_mass * gravity * L / 2 * c[0];
    f[1] = -coupler_mass * (-half * s[1] * bx + half * c[1] * (by + gravity));
    f[2] = -crank_mass * gravity * L / 2 * c[2];
    f[3] = -crank_mass * gravity * L / 2 * c[3];
    for (int loop = 0; loop < 2; loop++) {
        const double d = loop ? half : D;
        const int other = 2 + loop, row = 2 * loop;
        double *ux = u + 4 * row, *uy = ux + 4;
        phi[row] = L * c[0] + d * c[1] - d - L * c[other];
        phi[row + 1] = L * s[0] + d * s[1] - L * s[other];
        ux[0] = -L * s[0], ux[1] = -d * s[1], ux[other] = L * s[other];
        uy[0] = L * c[0], uy[1] = d * c[1], uy[other] = -L * c[other];
        for (int j = 0; j < 4; j++) {
            psi[row] += ux[j] * qd[j];
            psi[row + 1] += uy[j] * qd[j];
        }
        v[row] = -L * c[0] * qd[0] * qd[0] - d * c[1] * qd[1] * qd[1] + L * c[other] * qd[other] * qd[other];
        v[row + 1] =
            -L * s[0] * qd[0] * qd[0] - d * s[1] * qd[1] * qd[1] + L * s[other] * qd[other] * qd[other];
    }
    for (int a = 0; a < 4; a++)
        k[a] = -v[a] - 2 * row_alpha * psi[a] - row_beta * row_beta * phi[a];
}

/* Kinetic and potential energy of the cranks for c = 0, where all cranks turn alike. */
static inline double cranks_energy(const double *q, const double *qd) {
    const double crank = crank_inertia + crank_mass * crank_length * crank_length / 4;
    const double turning = 3 * crank + coupler_mass * crank_length * crank_length;
    const double height = crank_length * sin(q[0]);
    return turning * qd[0] * qd[0] / 2 + gravity * height * (coupler_mass + 3 * crank_mass / 2);
}

static const struct refdyn_name cranks_coordinates[] = {{"crank_1", "rad", 0.9131},
                                                        {"coupler", "rad", 0},
                                                        {"crank_2", "rad", 0.9131},
                                                        {"crank_3", "rad", 0.9131}};
static const struct refdyn_row cranks_rows[] = {{"far_x", REFDYN_POSITION, 0, ""},
                                                {"far_y", REFDYN_POSITION, 0, ""},
                                                {"near_x", REFDYN_POSITION, 0, ""},
                                                {"near_y", REFDYN_POSITION, 0, ""}};

static inline struct refdyn_model cranks_model(void) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "cranks",
        .hash = "",
        .n = CRANKS_N,
        .m = CRANKS_M,
        .coordinates = cranks_coordinates,
        .rows = cranks_rows,
        .equations = cranks_equations,
    };
}

/*
 * Point mass 1 kg on a rod of 1 m in Cartesian coordinates (IFToMM benchmark A01): x^2 + y^2 - 1 = 0.
 * Parameter g.
 */
static inline void rod_equations(const double *p, const double *x, double t, const double *q,
                                 const double *qd, double *out) {
    (void)x, (void)t;
    const double phi = q[0] * q[0] + q[1] * q[1] - 1, psi = 2 * (q[0] * qd[0] + q[1] * qd[1]);
    const double v = 2 * (qd[0] * qd[0] + qd[1] * qd[1]);
    const double values[] = {1, 0,     0,        1,
                             0, -p[0], 2 * q[0], 2 * q[1],
                             v, phi,   psi,      -v - 2 * row_alpha * psi - row_beta * row_beta * phi};
    memcpy(out, values, sizeof values);
}

static inline void rod_energy(const double *p, const double *x, double t, const double *q, const double *qd,
                              double *out) {
    (void)x, (void)t;
    out[0] = (qd[0] * qd[0] + qd[1] * qd[1]) / 2;
    out[1] = p[0] * q[1];
}

static const struct refdyn_name rod_coordinates[] = {{"x", "m", -1}, {"y", "m", 0}};
static const struct refdyn_name rod_parameters[] = {{"g", "m/s^2", 9.81}};
static const struct refdyn_row rod_rows[] = {{"rod", REFDYN_POSITION, 0, ""}};
static const int rod_dependent[] = {0};

static inline struct refdyn_model rod_model(const int *dependent) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "rod",
        .hash = "",
        .n = 2,
        .m = 1,
        .coordinates = rod_coordinates,
        .parameters = rod_parameters,
        .parameter_count = 1,
        .rows = rod_rows,
        .dependent = dependent,
        .equations = rod_equations,
        .energy = rod_energy,
    };
}

/*
 * Car axis (IVP test set, Mazzia and Magherini 2008): masses 5 at l = (q0, q1), r = (q2, q3), springs 1e4 of
 * rest length 0.5 from l to (0, 0) and from r to (xb, yb), yb = 0.1 sin 10 t, xb = sqrt(1 - yb^2), gravity 1.
 * Rows: xb xl + yb yl = 0, |l - r|^2 = 1. Given as equations with their exact derivatives by t.
 */
static inline void axis_spring(const double *from, const double *to, double *force) {
    const double x = to[0] - from[0], y = to[1] - from[1], length = sqrt(x * x + y * y);
    const double pull = 1e4 * (0.5 - length) / length;
    force[0] = pull * x;
    force[1] = pull * y;
}

static inline void axis_equations(const double *p, const double *x, double t, const double *q,
                                  const double *qd, double *out) {
    (void)p, (void)x;
    const double w = 10, yb = 0.1 * sin(w * t), ybd = 0.1 * w * cos(w * t), ybdd = -w * w * yb;
    const double xb = sqrt(1 - yb * yb), xbd = -yb * ybd / xb,
                 xbdd = -(ybd * ybd + yb * ybdd + xbd * xbd) / xb;
    const double origin[] = {0, 0}, corner[] = {xb, yb};
    double *f = out + 16, *u = f + 4, *v = u + 8, *phi = v + 2, *psi = phi + 2, *k = psi + 2;
    memset(out, 0, (16 + 4 + 8 + 4 * 2) * sizeof *out);
    for (int i = 0; i < 4; i++)
        out[5 * i] = 5;
    axis_spring(origin, q, f);
    axis_spring(corner, q + 2, f + 2);
    f[1] -= 5;
    f[3] -= 5;
    const double dx = q[0] - q[2], dy = q[1] - q[3], dxd = qd[0] - qd[2], dyd = qd[1] - qd[3];
    const double rows[] = {xb, yb, 0, 0, 2 * dx, 2 * dy, -2 * dx, -2 * dy};
    memcpy(u, rows, sizeof rows);
    v[0] = xbdd * q[0] + ybdd * q[1] + 2 * (xbd * qd[0] + ybd * qd[1]);
    v[1] = 2 * (dxd * dxd + dyd * dyd);
    phi[0] = xb * q[0] + yb * q[1];
    phi[1] = dx * dx + dy * dy - 1;
    psi[0] = xb * qd[0] + yb * qd[1] + xbd * q[0] + ybd * q[1];
    psi[1] = 2 * (dx * dxd + dy * dyd);
    for (int a = 0; a < 2; a++)
        k[a] = -v[a] - 2 * row_alpha * psi[a] - row_beta * row_beta * phi[a];
}

static const struct refdyn_name axis_coordinates[] = {
    {"left_x", "m", 0}, {"left_y", "m", 0.5}, {"right_x", "m", 1}, {"right_y", "m", 0.5}};
static const struct refdyn_row axis_rows[] = {{"corner", REFDYN_POSITION, 0, ""},
                                              {"axis", REFDYN_POSITION, 0, ""}};

static inline struct refdyn_model axis_model(void) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "axis",
        .hash = "",
        .n = 4,
        .m = 2,
        .coordinates = axis_coordinates,
        .rows = axis_rows,
        .equations = axis_equations,
    };
}

/* A mass on an oil film whose force becomes undefined: qdd = -3.1 sqrt(t_end - t) qd; input t_end. */
static inline void film_equations(const double *p, const double *x, double t, const double *q,
                                  const double *qd, double *out) {
    (void)p, (void)q;
    out[0] = 1;
    out[1] = -3.1 * sqrt(x[0] - t) * qd[0];
}

static const struct refdyn_name film_coordinates[] = {{"x", "m", 0.237}};
static const struct refdyn_name film_inputs[] = {{"t_end", "s", 0.5173}};

static inline struct refdyn_model film_model(void) {
    return (struct refdyn_model){
        .interface_version = REFDYN_MODEL_VERSION,
        .name = "film",
        .hash = "",
        .n = 1,
        .coordinates = film_coordinates,
        .inputs = film_inputs,
        .input_count = 1,
        .equations = film_equations,
    };
}

/* ---- Rigs ---- */

enum { GUARD = 64, GUARD_BYTE = 0xa5 };

struct memory_piece {
    unsigned char *bytes;
    size_t size;
};

static inline struct memory_piece guarded(size_t size) {
    struct memory_piece piece = {malloc(size + 2 * GUARD), size};
    if (!piece.bytes)
        abort();
    memset(piece.bytes, GUARD_BYTE, size + 2 * GUARD);
    return piece;
}

static inline void *inside(struct memory_piece piece) {
    return piece.bytes + GUARD;
}

static inline int guards_hold(struct memory_piece piece) {
    for (size_t i = 0; i < GUARD; i++)
        if (piece.bytes[i] != GUARD_BYTE || piece.bytes[GUARD + piece.size + i] != GUARD_BYTE)
            return 0;
    return 1;
}

struct rig {
    struct refdyn_model model;
    struct refdyn_workspace work;
    struct refdyn_integrator integrator;
    struct memory_piece work_memory, integrator_memory;
    double q[8], qd[8], qdd[8]; /* start values; enough for the largest model above */
};

/* Workspace of a model, start values, no integrator yet. */
static inline void rig_open(struct rig *rig, struct refdyn_model model) {
    memset(rig, 0, sizeof *rig);
    rig->model = model;
    rig->work_memory = guarded(refdyn_workspace_size(&rig->model));
    if (refdyn_workspace_init(&rig->work, &rig->model, inside(rig->work_memory), rig->work_memory.size))
        abort();
    refdyn_initial_state(&rig->work, rig->q, rig->qd);
}

static inline int rig_integrator(struct rig *rig, const struct refdyn_options *options) {
    free(rig->integrator_memory.bytes);
    rig->integrator_memory = guarded(refdyn_integrator_size(&rig->model, options));
    return refdyn_integrator_init(&rig->integrator, &rig->work, options, inside(rig->integrator_memory),
                                  rig->integrator_memory.size);
}

/* True if nothing was written outside the requested memory. */
static inline int rig_close(struct rig *rig) {
    const int holds = guards_hold(rig->work_memory) &&
                      (!rig->integrator_memory.bytes || guards_hold(rig->integrator_memory));
    free(rig->work_memory.bytes);
    free(rig->integrator_memory.bytes);
    return holds;
}

#endif
