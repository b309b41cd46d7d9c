/*
 * The interface between emitted C and whatever calls it: constant tables and function pointers of one model.
 *
 * This is the one small header that emitted files include; it has no code and needs no library.
 *
 * All functions share one form:
 *     void f(const double *p, const double *x, double t, const double *q, const double *qd, double *out)
 *   p    struct NAME_parameters as doubles: parameter_count parameters, then derived_count values that
 *        `prepare` computes from them
 *   x    inputs (input_count, NULL when there are none)
 *   t    time [s]
 *   q    coordinates (n) [m, rad], qd their rates (n)
 *   out  result, shape beside each entry; matrices row-major; it shares no memory with what is read
 * A pointer is NULL where the model has no such quantity or it was not emitted. Symbols: M mass matrix, h =
 * -c bias forces, Q generalized forces, rows u qdd + v = 0, point columns C and bias d (rdd = C qdd + d).
 *
 * Events are instants at which a step of a motion ends. At a time event a formula of time alone has a kink or
 * a jump: `breaks` computes the times that follow from parameters and inputs, `switches` changes a sign at
 * all others. At a state event a value of the state crosses zero, computed by `event`: first the events of
 * the model, which have actions, then kinks, where only a formula has a kink or a jump.
 */
#ifndef REFDYN_MODEL_H
#define REFDYN_MODEL_H

/* Of struct refdyn_model and of what its functions take and give. Emitted files carry the number that they
 * were written for: they do not compile with another one, and the runtime refuses tables with another one. */
#define REFDYN_MODEL_VERSION 4

typedef void refdyn_function(const double *p, const double *x, double t, const double *q, const double *qd,
                             double *out);

/* A named scalar: coordinate, parameter or input. */
struct refdyn_name {
    const char *name;
    const char *unit;
    double
        value; /* parameter, input: default; coordinate: at the start of a motion, with default parameters */
};

enum refdyn_row_level { REFDYN_POSITION, REFDYN_VELOCITY, REFDYN_ACCELERATION };

struct refdyn_row {
    const char *name;
    enum refdyn_row_level level;
};

/* A state event with an action. */
struct refdyn_event {
    const char *name;
    int direction; /* 1: it rises, -1: it falls, 0: both */
    int ends;      /* the motion ends there */
    int is_impact; /* rates jump by an impulse along the value's gradient, by its coefficient of restitution
                    */
    int first_change, change_count; /* in the model's list */
    int contact; /* 1 + the row that acts while the contact rests; 0: the event is no contact. The event's
                    value is the gap; its single change sets the parameter that is 1 while the contact
                    rests, else 0 */
};

/* What an event sets. */
enum refdyn_changed { REFDYN_CHANGED_RATE, REFDYN_CHANGED_INPUT, REFDYN_CHANGED_PARAMETER };

struct refdyn_change {
    enum refdyn_changed what;
    int place; /* in qd, x or p; -1: no emitted function reads the parameter */
};

enum { REFDYN_REQUIREMENT_NUMBERS = 6 };

/* A rule for parameters: `fact` is a printf format that says what is wrong with the rule's numbers. */
struct refdyn_requirement {
    const char *subject; /* "links[1].mass" */
    const char *fact;    /* "value %.6g, a positive number is needed" */
    int count;           /* numbers, 1 to REFDYN_REQUIREMENT_NUMBERS */
};

/* clang-format off */
/*
 * Vectors of a joint j in ground axes, about its origin, in `tangent_vectors`: with e the axis of what turns or slides,
 * rho the arm of a mass element beyond j, C_j = e x rho or e,
 *     mass       int C_j dm, int rho x C_j dm
 *     spin       int rho' x C_j dm
 *     damping    of dC_j/dt
 *     stiffness  of d2C_j/dt2, with what turns C along.
 * Their products are the tangent: runtime/core/linear/linear.h.
 */
/* clang-format on */
enum refdyn_vector {
    REFDYN_TURN_AXIS,
    REFDYN_TURN_RATE,
    REFDYN_TURN_RATE2,
    REFDYN_SLIDE_AXIS,
    REFDYN_SLIDE_RATE,
    REFDYN_SLIDE_RATE2,
    REFDYN_LEVER, /* (acceleration of the origin - gravity) x e of a turn */
    REFDYN_SHIFT, /* from the origin of the joint before */
    REFDYN_SHIFT_RATE,
    REFDYN_MASS_MOMENT,
    REFDYN_MASS_FORCE,
    REFDYN_SPIN,
    REFDYN_STIFFNESS_MOMENT,
    REFDYN_STIFFNESS_FORCE,
    REFDYN_DAMPING_MOMENT,
    REFDYN_DAMPING_FORCE,
    REFDYN_TURNED_ROWS, /* what turns of joints before make of forces felt at j */
    /* Of three turns at one point whose springs act on strains, not axes: of the second and third turn, x by
     * the turn before and y by the one before that; z of the rows: 1 for the third turn. */
    REFDYN_STRAIN_ROWS,    /* K of this turn by those */
    REFDYN_STRAIN_COLUMNS, /* K of those by this turn */
    REFDYN_STRAIN_DAMPING, /* D of both; z, of any joint: REFDYN_ROTOR */
    REFDYN_VECTOR_COUNT
};

/* The place among those of vectors of what the rotors of drives add to M's diagonal beside the vectors. */
enum { REFDYN_ROTOR = 3 * REFDYN_STRAIN_DAMPING + 2 };

/* Spatial Jacobians, which NAME.h lists where points ask for them: NAME_spatial. First three rows velocity of
 * the point, next three angular velocity of what carries it, in the ground's axes. */
struct refdyn_spatial {
    int count;
    const int *points;      /* (count) rows of r, rd and d that they belong to */
    refdyn_function *J;     /* (count x 6 x n) (rd, w) = J qd */
    refdyn_function *Jd_qd; /* (count x 6) (rdd, wd) = J qdd + Jd_qd [m/s^2, rad/s^2] */
};

/* Limits of one joint, which NAME.h lists; infinite where there is none. No function reads them. */
struct refdyn_limits {
    int coordinate;
    double from, to, rate, force; /* [m, rad; m/s, rad/s; N, N m]; the last two of absolute values */
};

struct refdyn_model {
    int interface_version; /* REFDYN_MODEL_VERSION; the first field in every version */
    const char *name;
    const char *hash;    /* of the model: changes whenever the emitted code does */
    int n;               /* coordinates */
    int m;               /* constraint rows; those of contacts come last */
    int parameter_count; /* parameters that are read */
    int derived_count;   /* values behind them in p */
    int input_count;
    int point_count;
    int course_count;      /* values that the author wants recorded */
    int break_count;       /* time events whose times are known */
    int switch_count;      /* values that change sign at the other time events */
    int event_count;       /* state events with an action */
    int kink_count;        /* state events without one: kinks of formulas of coordinates and rates */
    int change_count;      /* values that state events set, in all */
    int requirement_count; /* of parameters */
    int saturates;         /* a rate drives something to its limit, as friction */
    double length;         /* [m] translation that counts as much as 1 rad; 0: 1 m */
    double qdd_cost;     /* operations of one call of constrained, or of qdd_free without rows; 0: unknown */
    double tangent_cost; /* of tangent. A division counts four, a function ten */
    double tangent_vectors_cost;           /* of tangent_vectors */
    int coupling_count;                    /* of tangent_vectors: rows of pulled, pull_by_q, pull_by_qd */
    const struct refdyn_name *coordinates; /* n */
    const struct refdyn_name *parameters;  /* parameter_count */
    const struct refdyn_name *inputs;      /* input_count */
    const char *const *points;             /* point_count names */
    const char *const *courses;            /* course_count names */
    const struct refdyn_row *rows;         /* m */
    const struct refdyn_event *events;     /* event_count */
    const struct refdyn_change *changes;   /* change_count, event by event */
    const struct refdyn_requirement *requirements; /* requirement_count */
    const int *parent;    /* n: the coordinate before this one on the way to the ground, -1: none. M[i][j] is
                             zero unless one of i, j leads to the other */
    const int *dependent; /* m coordinates declared dependent, or NULL: choose */
    const int *gains;     /* (m x 2) places in p of 2 alpha and beta^2 of each row, -1: k does not read it.
                             `prepare` sets them; a caller may replace them behind it */
    const int *vector_places; /* (REFDYN_VECTOR_COUNT x 3) where the array (n) of a vector's axis begins in
                                 the result of tangent_vectors, -1: it is zero for all joints */
    const int *held;          /* held_count coordinates held in statics */
    int held_count;
    const int *anchored; /* anchored_count parameters whose default is a value at the start of a motion */
    int anchored_count;

    void (*prepare)(double *p); /* writes p[parameter_count ...] */
    refdyn_function *start;     /* (2 n): q, then qd, at the start of a motion; reads p alone */
    refdyn_function
        *anchor; /* (anchored_count): start values of the anchored parameters; q, qd, t at the start */

    refdyn_function *M;         /* (n x n) mass matrix [kg, kg m, kg m^2] */
    refdyn_function *h;         /* (n) bias forces [N, N m] */
    refdyn_function *Q;         /* (n) generalized forces [N, N m] */
    refdyn_function *u;         /* (m x n) row coefficients: u qdd + v = 0 */
    refdyn_function *v;         /* (m) */
    refdyn_function *phi;       /* (m) residual of position rows, 0 for the others */
    refdyn_function *psi;       /* (m) velocity-level residual: total time derivative of a position row, the
                                   velocity row itself, 0 for acceleration rows */
    refdyn_function *k;         /* (m) stabilised right side: u qdd = k = -v - 2 alpha psi - beta^2 phi */
    refdyn_function *r;         /* (points x 3) positions, ground frame [m] */
    refdyn_function *rd;        /* (points x 3) velocities [m/s] */
    refdyn_function *C;         /* (points x 3 x n) rd = C qd */
    refdyn_function *d;         /* (points x 3) rdd = C qdd + d [m/s^2] */
    refdyn_function *energy;    /* (2) kinetic, potential (gravity and linear springs; gravity's zero is the
                                   ground origin) [J] */
    refdyn_function *power;     /* (1) of all forces in Q without a potential: qd . Q_nonconservative [W] */
    refdyn_function *Q_q;       /* (n x n) dQ_i/dq_j at qd = 0, whatever qd is: the tangent of statics */
    refdyn_function *qdd_free;  /* (n) accelerations without constraints, O(n) */
    refdyn_function *qdd;       /* (n) accelerations with constraints and stabilisation, O(n m) */
    refdyn_function *force;     /* (n) programme force r = M qdd - h - Q at that qdd */
    refdyn_function *equations; /* struct NAME_equations_result as doubles: M (n x n), f = h + Q (n), u (m x
                                   n), v (m), phi (m), psi (m), k (m) */
    /* Exact derivatives, emitted on request: struct NAME_..._result as doubles, parts as NAME.h lists them.
     */
    refdyn_function *M_h;         /* struct NAME_M_h_result as doubles: M (n x n), h (n) */
    refdyn_function *f;           /* (n) h + Q */
    refdyn_function *row_terms;   /* struct NAME_row_terms_result: u (m x n), v, phi, psi, k (m each) */
    refdyn_function *point_terms; /* struct NAME_point_terms_result: r, rd, C, d as above */
    refdyn_function *constrained; /* struct NAME_constrained_result: qdd (n), power (1), lambda (m) */
    refdyn_function *terms; /* struct NAME_terms_result: what row_terms gives, then what point_terms gives */
    refdyn_function
        *accelerations;       /* struct NAME_accelerations_result: what constrained gives, then qdd_free */
    refdyn_function *tangent; /* of M qdd - h - Q - u^T lambda and u qdd - k, at given qdd and lambda: behind
                                 qd stands what `constrained` gives, qd (2 n + 1 + m) */
    refdyn_function
        *tangent_vectors;        /* the same as vectors of joints, O(n): f_t (n), g_t (m), G_q, G_qd, u (m x n
                                    each), diagonals of K and D beside the vectors (n each), arrays of
                                    vector_places, K and D of couplings: + pulled^T pull_by_q, ... */
    refdyn_function *d_qdd;      /* of qdd by q, qd, t, inputs, parameters */
    refdyn_function *d_qdd_free; /* of qdd_free by these */
    refdyn_function *d_force;    /* of force by these */
    refdyn_function *d_statics;  /* of Q at qd = 0 by q, t, inputs, parameters */
    refdyn_function *d_rows;     /* of phi, psi and k by these */
    refdyn_function *course;   /* (course_count) values to record with a motion, in the units of the model */
    refdyn_function *breaks;   /* (break_count) times of time events, in no order; reads p and x alone [s] */
    refdyn_function *switches; /* (switch_count) change sign at the other time events; reads p, x and t */
    refdyn_function *pace;     /* (1) their largest angular frequency; reads p, x and t [rad/s] */
    refdyn_function *event; /* (values) zero at state events: event_count with an action, then kink_count */
    refdyn_function *event_terms; /* struct NAME_event_terms_result as doubles: d/dt of these at qdd = 0,
                                     their derivatives by q and qd (values x n each), coefficients of
                                     restitution (event_count), what events set (change_count), sums of
                                     |terms| of the events' values (event_count) */
    refdyn_function *required;    /* for each requirement: 1 where it holds, else 0, then its numbers; reads
                                     only p */
};

#endif
