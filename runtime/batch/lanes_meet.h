/*
 * The ends of the steps of LANES motions: brought onto the programme, and their rates.
 *
 * Part of lanes_step.h. Newton along directions, as refdyn_project_along; a motion that it does not serve
 * does that itself.
 */
#include "constraints/programme_distance.h"
#include "linear/elimination_lanes.h"

/* Row terms in lanes->row_terms, of positions or of velocities. */
static struct NAMED(level) NAMED(level_of)(const struct NAMED(taking) * taking, enum refdyn_row_level last) {
    const int n = taking->n, m = taking->m;
    const LANE *u = NAMED(lanes_of)(taking->lanes->row_terms), *phi = u + m * (n + 1);
    return (struct NAMED(level)){n,    m, taking->lanes->model->model->rows,
                                 last, u, last == REFDYN_POSITION ? phi : phi + m};
}

static void NAMED(find_row_terms)(const struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    const double *q = lanes->state_new;
    lanes->model->row_terms(lanes->p, lanes->x, lanes->t, q, q + taking->n * LANES, lanes->row_terms);
}

/* x += the combination of the directions with u dx = -residual, for the rows of a level, of some motions.
 * Gives those whose rows are independent. */
static MASK NAMED(correct_rows)(const struct NAMED(taking) * taking, const struct NAMED(level) * level,
                                const LANE *directions, MASK where, LANE *x) {
    const int n = taking->n, m = taking->m;
    struct lanes *lanes = taking->lanes;
    LANE *products = NAMED(lanes_of)(lanes->small), *wanted = products + m * m, *scale = wanted + m;
    int count = 0, rows = 0;
    for (int a = 0; a < m; a++)
        count += NAMED(has)(level, a);
    for (int a = 0; a < m; a++) {
        if (!NAMED(has)(level, a))
            continue;
        int column = 0;
        wanted[rows] = -level->residual[a];
        for (int b = 0; b < m; b++) {
            if (!NAMED(has)(level, b))
                continue;
            LANE sum = NAMED(every)(0);
            for (int j = 0; j < n; j++)
                sum += level->u[a * n + j] * directions[b * n + j];
            products[rows * count + column++] = sum;
        }
        rows++;
    }
    const struct NAMED(factors)
        factors = {count, products, lanes->small_pivots, lanes->small_pivots + m * LANES};
    const MASK is_regular = NAMED(factor_matrix)(0, &factors, scale);
    NAMED(solve_factored)(0, &factors, wanted);
    rows = 0;
    for (int b = 0; b < m; b++)
        if (NAMED(has)(level, b)) {
            const LANE part = wanted[rows++];
            for (int j = 0; j < n; j++)
                x[j] = NAMED(select)(where, x[j] + part * directions[b * n + j], x[j]);
        }
    return is_regular;
}

static MASK NAMED(are_met)(const struct NAMED(taking) * taking) {
    MASK met = NAMED(every)(0) != NAMED(every)(0);
    for (int lane = 0; lane < LANES; lane++)
        met[lane] = taking->steps[lane].is_met ? -1 : 0;
    return met;
}

static void NAMED(project)(struct NAMED(taking) * taking, const LANE *directions) {
    const struct NAMED(level) positions = NAMED(level_of)(taking, REFDYN_POSITION),
                              velocities = NAMED(level_of)(taking, REFDYN_VELOCITY);
    LANE *q = taking->arrays.state_new, *qd = q + taking->n;
    LANE last_phi = NAMED(every)(INFINITY), last_psi = last_phi;
    MASK waits = NAMED(are_met)(taking);
    MASK positions_are_done = NAMED(every)(0) != NAMED(every)(0), is_good = ~positions_are_done;
    for (int count = 0; count <= CORRECTIONS_MOST; count++) {
        const LANE kept = last_psi;
        positions_are_done |= NAMED(level_is_done)(&positions, q, &last_phi);
        const MASK is_done = positions_are_done & NAMED(level_is_done)(&velocities, qd, &last_psi);
        last_psi = NAMED(select)(positions_are_done, last_psi, kept);
        waits &= ~is_done & is_good;
        if (!NAMED(any)(waits))
            break;
        is_good &= NAMED(correct_rows)(taking, &positions, directions, waits, q);
        is_good &= NAMED(correct_rows)(taking, &velocities, directions, waits, qd);
        NAMED(find_row_terms)(taking);
    }
    waits |= ~is_good;
    for (int lane = 0; lane < LANES; lane++)
        taking->steps[lane].is_met &= !waits[lane];
}

/* Of the step's matrix, or of M where the motions have found them. */
static const LANE *NAMED(load_directions)(struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    if (taking->method->projects_by_matrix)
        return NAMED(lanes_of)(lanes->directions);
    for (int lane = 0; lane < LANES; lane++) {
        struct lane_step *one = &taking->steps[lane];
        if (!one->is_met || !refdyn_lanes_align(lanes, one, lane))
            continue;
        const struct refdyn_directions found = refdyn_linear_found(&one->motion->linear);
        for (int k = 0; k < found.count; k++)
            NAMED(gather)
        (lanes->mass_directions + found.rows[k] * taking->n * LANES, found.vectors + k * taking->n, lane,
         taking->n);
    }
    return NAMED(lanes_of)(lanes->mass_directions);
}

/* The row whose positions are off most. */
static int NAMED(row_off_most)(const struct NAMED(taking) * taking, int lane) {
    const struct NAMED(level) positions = NAMED(level_of)(taking, REFDYN_POSITION);
    int row = -1;
    double most = 0;
    for (int a = 0; a < taking->m; a++) {
        const double size = fabs(positions.residual[a][lane]);
        if (NAMED(has)(&positions, a) && (row < 0 || size > most)) {
            row = a;
            most = size;
        }
    }
    return row;
}

/* NaN in the lanes where some entry is not finite. */
static LANE NAMED(not_finite)(const LANE *x, int count) {
    LANE sum = NAMED(every)(0);
    for (int i = 0; i < count; i++)
        sum += 0 * x[i];
    return sum;
}

/* Where an end that is kept goes, beside the motion's state before it was moved; others go nowhere. */
struct NAMED(ends) {
    double *rates[LANES], *row_terms[LANES], *states[LANES];
};

static void NAMED(place_end)(const struct NAMED(taking) * taking, int lane, int is_kept,
                             struct NAMED(ends) * ends) {
    double *nowhere = taking->lanes->nowhere;
    struct refdyn_motion *motion = is_kept ? taking->steps[lane].motion : NULL;
    ends->rates[lane] = is_kept ? motion->step.rates_new : nowhere;
    ends->row_terms[lane] = is_kept ? motion->work->u : nowhere;
    ends->states[lane] = is_kept ? motion->step.state_new : nowhere;
    if (is_kept && taking->m > 0)
        memcpy(motion->step.side, motion->step.state_new, (size_t)(2 * taking->n) * sizeof(double));
}

static void NAMED(unload_met)(const struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    const int n = taking->n, m = taking->m, rates = 2 * n + 1 + m, terms = m * (n + 4);
    const LANE *rates_new = NAMED(lanes_of)(lanes->rates_new), *row_terms = NAMED(lanes_of)(lanes->row_terms);
    const LANE doubt = NAMED(not_finite)(rates_new, rates) + NAMED(not_finite)(row_terms, terms);
    struct NAMED(ends) ends;
    for (int lane = 0; lane < LANES; lane++) {
        const int is_kept = taking->steps[lane].is_met && doubt[lane] == 0;
        NAMED(place_end)(taking, lane, is_kept, &ends);
        if (taking->steps[lane].is_met)
            taking->steps[lane].motion->step.is_met = is_kept;
    }
    NAMED(scatter_all)(ends.rates, rates_new, rates);
    if (m == 0)
        return;
    NAMED(scatter_all)(ends.row_terms, row_terms, terms);
    NAMED(scatter_all)(ends.states, taking->arrays.state_new, 2 * n);
}

/* Those of a step's matrix, for states that the motion itself brings onto the programme. */
static void NAMED(unload_directions)(const struct NAMED(taking) * taking, int lane) {
    struct refdyn_motion *motion = taking->steps[lane].motion;
    if (taking->m > 0 && taking->method->projects_by_matrix)
        NAMED(scatter)
    (refdyn_programme_take_directions(&motion->programme, &motion->linear), taking->lanes->directions, lane,
     taking->m * taking->n);
}

/* The ends that are good enough to be kept: is_met of their steps. */
static void NAMED(meet)(struct NAMED(taking) * taking) {
    struct lanes *lanes = taking->lanes;
    int is_projected = 0;
    for (int lane = 0; lane < LANES; lane++) {
        struct lane_step *one = &taking->steps[lane];
        one->is_met =
            one->motion && !one->status && one->attempt->size <= 1 && refdyn_lanes_can_meet(lanes, one);
        if (one->motion && !one->status)
            NAMED(unload_directions)(taking, lane);
        if (one->motion)
            lanes->t[lane] = one->attempt->t_new;
        is_projected |= one->is_met && one->motion->options.stabilise == REFDYN_PROJECT;
    }
    if (!NAMED(any)(NAMED(are_met)(taking)))
        return;
    if (taking->m > 0) {
        NAMED(find_row_terms)(taking);
        for (int lane = 0; lane < LANES; lane++)
            if (taking->steps[lane].is_met)
                taking->steps[lane].motion->step.met_row = NAMED(row_off_most)(taking, lane);
    }
    if (taking->m > 0 && is_projected)
        NAMED(project)(taking, NAMED(load_directions)(taking));
    NAMED(find_rates)(taking, taking->arrays.state_new, NAMED(lanes_of)(lanes->rates_new));
    NAMED(unload_met)(taking);
}
