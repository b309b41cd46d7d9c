/*
 * The contacts that carry a load.
 *
 * With g the gaps of the contacts that take part and p their forces, an equilibrium has g >= 0, p >= 0 and
 * p g = 0. The row of a contact that carries holds; the gaps of the others are checked.
 *
 * In: the model's forces Q, stiffness K = -dQ/dq, rows and gaps. The first guess of the set is empty. Where
 * no equilibrium exists without contacts, or it lies inside one, the bodies are let down from the start by
 * steps d:
 *     min d^T (K + mu D) d / 2 - Q^T d   subject to   g + g_q d >= 0,   phi + phi_q d = 0
 * D contains the units of the coordinates. mu increases until the step is short enough, and decreases from
 * step to step, so that the path begins along the forces and ends as Newton's iteration (proximal point
 * method; Parikh and Boyd, Proximal Algorithms, 2014, sect. 4.1). Contacts with a force at its end carry.
 *
 * Their equilibrium is then computed like any other and corrects the set: the contact with the most negative
 * gap joins; if all gaps are positive, the contact with the largest pulling force leaves.
 */
#include "runtime/core/statics/statics.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "runtime/core/constraints/constraints.h"
#include "runtime/core/linear/linear.h"

enum { STEPS_MOST = 400, MENDS_FREE = 4, MENDS_EACH = 3 };
/* Reach of the first step [rad, length]. It doubles while steps keep their direction, up to reach_turn for
 * rotations [rad]. */
static const double first_reach = 0.1, reach_turn = 0.5;
/* The path ends at a step without mu that is shorter than this [rad, length]. */
static const double arrived = 1e-7;
/* Below this, relative to the largest force and stiffness, mu counts as 0. */
static const double settled = 1e-9;
static const double mu_first = 1e-3, mu_rise = 8, mu_fall = 0.1, mu_least = 1e-12;
/* A gap below minus this [rad, length] counts as negative, and a force below minus this part of the largest.
 */
static const double enters = 1e-9, pulls = 1e-9;
/* A row whose independent part is smaller depends on the others. */
static const double independent = 1e-9;

/* The contacts that carry a load, and scratch to find them. */
struct carrying {
    int first_row;      /* first row of a contact */
    int programme;      /* number of rows that always hold */
    int *rows;          /* (m) rows that always hold, then those of contacts that carry */
    int *has_part;      /* (contacts) the options list the row */
    int *carries;       /* (contacts) */
    int mends;          /* changes of the set so far */
    int is_let_down;    /* the bodies were let down onto their contacts, which provides a guess of the set */
    int is_shared;      /* sharing the load with closed contacts without force was attempted */
    int *joins;         /* (contacts) those that share the load */
    double *lambda;     /* (m) of the options' rows */
    double *gap;        /* (contacts) */
    double *q;          /* (n) on the way down */
    double *stiffness;  /* (n x n) dQ/dq there */
    double size;        /* largest stiffness or force */
    double *factor;     /* (count x count) of K + mu D */
    double *held;       /* (m x count) directions of the rows that always hold */
    double *along;      /* (count) the way to these rows */
    double *d, *d_last; /* (count) steps */
    struct refdyn_one_sided problem;
};

struct carrying *refdyn_carrying_lay_out(const struct refdyn_model *model, struct layout *layout) {
    struct carrying counted;
    const size_t doubles = (sizeof counted + sizeof(double) - 1) / sizeof(double);
    struct carrying *laid_out = (struct carrying *)(void *)layout_doubles(layout, (int)doubles);
    struct carrying *c = laid_out ? laid_out : &counted;
    const int n = model->n, m = model->m, contacts = m - refdyn_programme_rows(model);
    c->first_row = m - contacts;
    c->rows = layout_ints(layout, contacts > 0 ? m : 0);
    c->has_part = layout_ints(layout, contacts);
    c->carries = layout_ints(layout, contacts);
    c->joins = layout_ints(layout, contacts);
    c->lambda = layout_doubles(layout, contacts > 0 ? m : 0);
    c->gap = layout_doubles(layout, contacts);
    c->factor = layout_doubles(layout, contacts > 0 ? n * n : 0);
    c->stiffness = layout_doubles(layout, contacts > 0 ? n * n : 0);
    c->held = layout_doubles(layout, contacts > 0 ? m * n : 0);
    c->d = layout_doubles(layout, contacts > 0 ? n : 0);
    c->d_last = layout_doubles(layout, contacts > 0 ? n : 0);
    c->along = layout_doubles(layout, contacts > 0 ? n : 0);
    c->q = layout_doubles(layout, contacts > 0 ? n : 0);
    refdyn_one_sided_lay_out(&c->problem, contacts, contacts > 0 ? n : 0, layout);
    return laid_out;
}

/* ---- The set ---- */

/* Activates the rows of the contacts in `carries`, or of all contacts to read their gaps. */
static void let_act(const struct statics *statics, int all) {
    struct refdyn_workspace *work = statics->balance.work;
    const struct refdyn_model *model = work->model;
    for (int i = 0; i < model->event_count; i++)
        if (model->events[i].contact > 0)
            work->p[refdyn_contact_mode_place(model, i)] =
                all ||
                statics->carrying->carries[model->events[i].contact - 1 - statics->carrying->first_row];
    refdyn_prepare(work);
}

static void list_rows(struct statics *statics) {
    struct carrying *c = statics->carrying;
    struct balance *balance = &statics->balance;
    balance->rows = c->rows;
    balance->row_count = c->programme;
    for (int k = 0; k < c->problem.count; k++)
        if (c->carries[k])
            c->rows[balance->row_count++] = c->first_row + k;
}

int refdyn_carrying_begin(struct statics *statics) {
    struct carrying *c = statics->carrying;
    const struct refdyn_statics_options *options = statics->options;
    int count = 0;
    c->programme = c->mends = c->is_let_down = c->is_shared = 0;
    if (c->problem.count == 0) /* the model has no rows */
        return 0;
    for (int i = 0; i < options->row_count; i++)
        if (options->rows[i] >= c->first_row)
            count += c->has_part[options->rows[i] - c->first_row] = 1;
        else
            c->rows[c->programme++] = options->rows[i];
    if (count == 0)
        return 0;
    let_act(statics, 1);
    list_rows(statics);
    return 1;
}

/* ---- Letting the bodies down ---- */

/* Evaluates forces, rows and gaps at c->q. */
static int read(struct statics *statics) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    const struct refdyn_workspace *work = b->work;
    refdyn_balance_take_states(b, c->q);
    const int status = refdyn_row_terms(b->work, b->t, c->q, b->rates);
    if (status)
        return status;
    work->model->Q(work->p, work->x, b->t, c->q, b->rates, b->now.Q);
    memset(c->stiffness, 0, (size_t)(b->n * b->n) * sizeof(double));
    if (work->model->Q_q)
        work->model->Q_q(work->p, work->x, b->t, c->q, b->rates, c->stiffness);
    memcpy(c->gap, work->phi + c->first_row, (size_t)c->problem.count * sizeof(double));
    return refdyn_is_finite(b->now.Q, b->n) && refdyn_is_finite(c->stiffness, b->n * b->n)
               ? REFDYN_OK
               : REFDYN_NOT_FINITE;
}

/* Factors K + mu D for the coordinates that are not held. Returns 0 if it is not positive definite. */
static int factor(struct statics *statics, double mu) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    const int n = b->n, count = b->count;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            const int a = b->free[i], o = b->free[j];
            c->factor[i * count + j] = -(c->stiffness[a * n + o] + c->stiffness[o * n + a]) / 2 +
                                       (i == j ? mu * c->size / (b->unit[a] * b->unit[a]) : 0);
        }
    return refdyn_factor(c->factor, count, count) < 0;
}

/* row (count) := L^-1 u of a row of the workspace. */
static void spread(const struct statics *statics, int row, double *spread_row) {
    const struct balance *b = &statics->balance;
    for (int i = 0; i < b->count; i++)
        spread_row[i] = b->work->u[row * b->n + b->free[i]];
    refdyn_factor_half_forward(statics->carrying->factor, b->count, b->count, spread_row);
}

static void take_away(const double *directions, int directions_count, int count, double *x) {
    for (int pass = 0; pass < 2; pass++) /* twice against rounding */
        for (int a = 0; a < directions_count; a++)
            dense_add(x, -dense_dot(directions + a * count, x, count), directions + a * count, count);
}

/* held := orthonormal directions of the rows that always hold; along := the step onto these rows. Returns the
 * number of directions. */
static int meet_programme(struct statics *statics) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    const int count = b->count;
    int held = 0;
    memset(c->along, 0, (size_t)count * sizeof(double));
    for (int i = 0; i < c->programme; i++) {
        double *row = c->held + held * count;
        spread(statics, c->rows[i], row);
        const double missed = -b->work->phi[c->rows[i]] - dense_dot(row, c->along, count);
        const double length = sqrt(dense_dot(row, row, count));
        take_away(c->held, held, count, row);
        const double left = sqrt(dense_dot(row, row, count));
        if (!(left > independent * length))
            continue;
        for (int j = 0; j < count; j++)
            row[j] /= left;
        dense_add(c->along, missed / left, row, count);
        held++;
    }
    return held;
}

/* Computes the step d (count) from the factor. Returns 0 if no step satisfies rows and gaps. */
static int find_step(struct statics *statics) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    struct refdyn_one_sided *problem = &c->problem;
    const int count = b->count, held = meet_programme(statics);
    for (int i = 0; i < count; i++)
        c->d[i] = b->now.Q[b->free[i]];
    refdyn_factor_half_forward(c->factor, count, count, c->d);
    take_away(c->held, held, count, c->d);
    problem->n = count;
    for (int k = 0; k < problem->count; k++) {
        double *normal = problem->normals + k * count;
        spread(statics, c->first_row + k, normal);
        const double along = dense_dot(normal, c->along, count);
        take_away(c->held, held, count, normal);
        problem->takes_part[k] = c->has_part[k] && dense_dot(normal, normal, count) > 0;
        problem->bounds[k] = -c->gap[k] - along - dense_dot(normal, c->d, count);
        problem->slack[k] = DBL_EPSILON * (fabs(c->gap[k]) + fabs(problem->bounds[k]));
    }
    const int is_met = refdyn_one_sided_solve(problem);
    dense_add(c->d, 1, problem->x, count);
    dense_add(c->d, 1, c->along, count);
    refdyn_factor_half_backward(c->factor, count, count, c->d);
    return is_met;
}

/* Returns the largest entry of d in units; rotations count `turns` times. */
static double length_of(const struct balance *b, const double *d, double turns) {
    double longest = 0;
    for (int i = 0; i < b->count; i++) {
        const double size = fabs(d[i]) / b->unit[b->free[i]];
        longest = fmax(longest, size * (refdyn_is_turn(b->work->model, b->free[i]) ? turns : 1));
    }
    return longest;
}

/* Computes a step of at most *reach with the smallest mu that permits it. Returns 0 if there is none. */
static int step_within(struct statics *statics, double *reach, double *mu) {
    const struct balance *b = &statics->balance;
    const double turns = fmax(*reach / reach_turn, 1);
    for (int k = 0; k < STEPS_MOST; k++) {
        if (factor(statics, *mu)) {
            if (!find_step(statics))
                return 0;
            if (length_of(b, statics->carrying->d, turns) <= *reach)
                return 1;
        }
        *mu *= mu_rise;
    }
    return 0;
}

/* Returns the unit of mu: the largest stiffness, or force over length. */
static double size_of(const struct statics *statics) {
    const struct balance *b = &statics->balance;
    double size = 0;
    for (int i = 0; i < b->count; i++) {
        const int j = b->free[i];
        const double stiffness = fabs(statics->carrying->stiffness[j * b->n + j]) * b->unit[j] * b->unit[j];
        size = fmax(size, fmax(stiffness, fabs(b->now.Q[j]) * b->unit[j]));
    }
    return size > 0 ? size : 1;
}

static void move(struct statics *statics, double *reach) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    for (int i = 0; i < b->count; i++)
        c->q[b->free[i]] += c->d[i];
    *reach *= dense_dot(c->d, c->d_last, b->count) >= 0 ? 2 : 0.5;
    memcpy(c->d_last, c->d, (size_t)b->count * sizeof(double));
}

/* Lets the bodies down from c->q until they rest; contacts with a force there carry. Errors: NO_CONVERGENCE,
 * CONTACTS_UNMET, NOT_FINITE. */
static int let_down(struct statics *statics) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    double reach = first_reach, mu = mu_first;
    memset(c->d_last, 0, (size_t)b->count * sizeof(double));
    for (int k = 0; k < STEPS_MOST; k++) {
        int status = read(statics);
        if (status)
            return status;
        c->size = size_of(statics);
        if (!step_within(statics, &reach, &mu))
            return REFDYN_CONTACTS_UNMET;
        move(statics, &reach);
        const double length = length_of(b, c->d, 1);
        if (length <= arrived && mu * length <= settled)
            return REFDYN_OK;
        mu = fmax(mu * mu_fall, mu_least);
    }
    return REFDYN_NO_CONVERGENCE;
}

/* ---- Correcting the set ---- */

/* Returns the contact with the most negative gap at q, or -1. */
static int find_entered(struct statics *statics, const double *q) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    double farthest = enters;
    int worst = -1;
    if (refdyn_row_terms(b->work, b->t, q, b->rates))
        return -1;
    memcpy(c->gap, b->work->phi + c->first_row, (size_t)c->problem.count * sizeof(double));
    for (int k = 0; k < c->problem.count; k++) {
        double scale = 0;
        for (int i = 0; i < b->n; i++)
            scale = fmax(scale, fabs(b->work->u[(c->first_row + k) * b->n + i]) * b->unit[i]);
        if (c->has_part[k] && !c->carries[k] && -c->gap[k] > farthest * scale) {
            farthest = -c->gap[k] / scale;
            worst = k;
        }
    }
    return worst;
}

/* Returns the contact with the largest pulling force, or -1. */
static int find_pulling(const struct statics *statics) {
    const struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    double largest = 0, lowest = 0;
    int worst = -1;
    for (int a = 0; a < b->row_count; a++)
        largest = fmax(largest, fabs(b->now.lambda[a]));
    for (int a = c->programme; a < b->row_count; a++)
        if (b->now.lambda[a] < lowest && b->now.lambda[a] < -pulls * largest) {
            lowest = b->now.lambda[a];
            worst = b->rows[a] - c->first_row;
        }
    return worst;
}

static int mend(struct statics *statics, const double *q, int *status) {
    struct carrying *c = statics->carrying;
    const int entered = find_entered(statics, q), pulling = entered < 0 ? find_pulling(statics) : -1;
    if (entered < 0 && pulling < 0)
        return 0;
    if (c->mends++ >= MENDS_FREE + MENDS_EACH * c->problem.count) {
        const int fault = c->first_row + (entered < 0 ? pulling : entered);
        statics->balance.work->fault = (struct refdyn_fault){.row = fault, .coordinate = -1};
        *status = REFDYN_CONTACTS_UNMET;
        return 0;
    }
    c->carries[entered < 0 ? pulling : entered] = entered >= 0;
    return 1;
}

/* ---- Forces that are not unique ---- */

/* normals of the problem := gradients of the gaps at q in units, without their components along the
 * programme's rows. Returns 0 if there are none. */
static int find_normals(struct statics *statics, const double *q) {
    struct carrying *c = statics->carrying;
    const struct balance *b = &statics->balance;
    const int count = b->count;
    if (refdyn_row_terms(b->work, b->t, q, b->rates))
        return 0;
    memset(c->stiffness, 0, (size_t)(b->n * b->n) * sizeof(double));
    c->size = 1;
    if (count == 0 || !factor(statics, 1))
        return 0;
    const int held = meet_programme(statics);
    for (int k = 0; k < c->problem.count; k++) {
        spread(statics, c->first_row + k, c->problem.normals + k * count);
        take_away(c->held, held, count, c->problem.normals + k * count);
    }
    return 1;
}

/* Replaces p (contacts) by the smallest forces with the same resultants: removes the component orthogonal to
 * the columns of the normals. Returns 1 if the forces are not unique. */
static int find_least_forces(struct carrying *c, int count, double *p) {
    const int contacts = c->problem.count;
    int rank = 0, carrying = 0;
    for (int j = 0; j < count && rank < contacts; j++) {
        double *column = c->problem.basis + rank * contacts;
        for (int k = 0; k < contacts; k++)
            column[k] = c->carries[k] ? c->problem.normals[k * count + j] : 0;
        const double length = sqrt(dense_dot(column, column, contacts));
        take_away(c->problem.basis, rank, contacts, column);
        const double left = sqrt(dense_dot(column, column, contacts));
        if (!(left > independent * length))
            continue;
        for (int k = 0; k < contacts; k++)
            column[k] /= left;
        rank++;
    }
    memcpy(c->problem.share, p, (size_t)contacts * sizeof *p);
    memset(p, 0, (size_t)contacts * sizeof *p);
    for (int a = 0; a < rank; a++) {
        const double *column = c->problem.basis + a * contacts;
        dense_add(p, dense_dot(column, c->problem.share, contacts), column, contacts);
    }
    for (int k = 0; k < contacts; k++)
        carrying += c->carries[k];
    return carrying > rank;
}

/* p (contacts) := forces of the contacts that carry. */
static void list_forces(const struct statics *statics, double *p) {
    const struct carrying *c = statics->carrying;
    memset(p, 0, (size_t)c->problem.count * sizeof *p);
    for (int a = c->programme; a < statics->balance.row_count; a++)
        p[statics->balance.rows[a] - c->first_row] = statics->balance.now.lambda[a];
}

/* Lets contacts that are closed without force at an equilibrium share the load if their smallest forces are
 * positive. Returns 1 if some do. */
static int share_load(struct statics *statics, const double *q) {
    struct carrying *c = statics->carrying;
    const int contacts = c->problem.count;
    double *p = c->problem.multipliers;
    int added = 0;
    c->is_shared = 1;
    find_entered(statics, q);
    if (!find_normals(statics, q))
        return 0;
    for (int k = 0; k < contacts; k++) {
        const double *normal = c->problem.normals + k * statics->balance.count;
        const double scale = sqrt(dense_dot(normal, normal, statics->balance.count));
        c->joins[k] = c->has_part[k] && !c->carries[k] && fabs(c->gap[k]) <= enters * scale;
        c->carries[k] |= c->joins[k];
        added += c->joins[k];
    }
    while (added > 0) {
        int lowest = -1, is_negative = 0;
        list_forces(statics, p);
        find_least_forces(c, statics->balance.count, p);
        const double least = pulls * refdyn_largest(p, contacts, NULL);
        for (int k = 0; k < contacts; k++) {
            is_negative |= c->carries[k] && !(p[k] > least);
            if (c->joins[k] && (lowest < 0 || p[k] < p[lowest]))
                lowest = k;
        }
        if (!is_negative)
            break;
        c->joins[lowest] = c->carries[lowest] = 0;
        added--;
    }
    return added > 0;
}

/* ---- The next set ---- */

/* Finds the contacts on which the bodies come to rest from the start. Returns 0 if there are none, or if the
 * bodies do not come to rest. */
static int guess(struct statics *statics, const double *start, double *q) {
    struct carrying *c = statics->carrying;
    const struct refdyn_fault fault = statics->balance.work->fault;
    int count = 0;
    memcpy(c->q, start, (size_t)statics->balance.n * sizeof *q);
    const int status = let_down(statics);
    statics->balance.work->fault = fault;
    for (int k = 0; k < c->problem.count && !status; k++)
        count += c->carries[k] = c->problem.multipliers[k] > 0;
    if (count > 0)
        memcpy(q, c->q, (size_t)statics->balance.n * sizeof *q);
    return count > 0;
}

int refdyn_carrying_next(struct statics *statics, const double *start, double *q, int *status) {
    struct carrying *c = statics->carrying;
    int is_other;
    if (!c->is_let_down && (*status || find_entered(statics, q) >= 0)) {
        c->is_let_down = 1;
        is_other = guess(statics, start, q) || (!*status && mend(statics, q, status));
    } else
        is_other = !*status && !c->is_shared && mend(statics, q, status);
    if (!is_other && !*status && !c->is_shared)
        is_other = share_load(statics, q);
    list_rows(statics);
    return is_other;
}

void refdyn_carrying_report(struct statics *statics, const double *q, int status) {
    struct carrying *c = statics->carrying;
    struct refdyn_statics_result *result = statics->result;
    const struct refdyn_statics_options *options = statics->options;
    const struct refdyn_fault fault = statics->balance.work->fault;
    double *p = c->problem.multipliers;
    find_entered(statics, q);
    list_forces(statics, p);
    if (!status && find_normals(statics, q))
        result->is_indeterminate = find_least_forces(c, statics->balance.count, p);
    for (int i = 0, a = 0; i < options->row_count; i++)
        c->lambda[i] = options->rows[i] >= c->first_row ? p[options->rows[i] - c->first_row]
                                                        : statics->balance.now.lambda[a++];
    for (int k = 0; k < c->problem.count; k++)
        c->carries[k] = !status && c->carries[k];
    let_act(statics, 0);
    statics->balance.work->fault = fault;
    result->lambda = result->lambda ? c->lambda : NULL;
    result->contact_gap = c->gap;
}
