/** @file
 * The interface between emitted C and its callers: constant tables and function pointers of one model.
 *
 * Emitted files include only this header. It contains no code and needs no library.
 *
 * All functions have one form:
 *
 *     void f(const double *p, const double *x, double t, const double *q, const double *qd, double *out)
 *
 * - p: struct NAME_parameters as doubles: parameter_count parameters, then the derived_count values that
 *   `prepare` computes from them
 * - x: inputs (input_count); NULL if there are none
 * - t: time [s]
 * - q: coordinates (n) [m, rad]; qd: their rates (n) [m/s, rad/s]
 * - out: the result, with the shape stated at each function; it must not overlap the arguments
 *
 * SI units and radians; points in the ground frame; matrices row by row. Symbols: n coordinates, m constraint
 * rows u qdd + v = 0, M mass matrix, h = -c bias forces, Q generalized forces, points with rd = C qd and
 * rdd = C qdd + d. Equations: gen/theory.md.
 *
 * A pointer is NULL if the model has no such quantity or the quantity was not emitted.
 *
 * Events are instants at which a step of a motion ends. At a time event a formula of time alone has a kink or
 * a jump: `breaks` computes the times that follow from parameters and inputs, `switches` changes a sign at
 * all others. At a state event a value of the state crosses zero, computed by `event`: first the events of
 * the model, which have actions, then kinks, where only a formula has a kink or a jump.
 */
#ifndef REFDYN_MODEL_H
#define REFDYN_MODEL_H

/** Version of struct refdyn_model and of its functions. Emitted files contain the version that they were
 * written for: they do not compile with another one, and the runtime refuses tables of another one. */
#define REFDYN_MODEL_VERSION 7

/** The form of all emitted functions. */
typedef void refdyn_function(const double *p, const double *x, double t, const double *q, const double *qd,
                             double *out);

/** A coordinate, a parameter or an input. */
struct refdyn_name {
    const char *name; /**< as in the model file */
    const char *unit; /**< as in the model file, such as "kg m^2" */
    double value; /**< default of a parameter or input; value of a coordinate at the start of a motion, with
                       default parameters */
};

/** Marks in `parent` of struct refdyn_model. */
enum {
    REFDYN_STATE =
        -2 /**< as the parent of a coordinate: a continuous state z of a controller or a drive. z is
                its rate in qd, z' its acceleration in qdd; no function reads it in q. States
                are the last coordinates */
};

/** The level at which a constraint row is written. */
enum refdyn_row_level {
    REFDYN_POSITION,    /**< phi(q, t) = 0 */
    REFDYN_VELOCITY,    /**< psi(q, qd, t) = 0 */
    REFDYN_ACCELERATION /**< u qdd + v = 0 only */
};

/** A constraint row. */
struct refdyn_row {
    const char *name;            /**< as in the model file */
    enum refdyn_row_level level; /**< of its residual */
    int driven;       /**< 1 + the coordinate whose course the row prescribes (rd.drive, rd.lock); 0: none */
    const char *unit; /**< of its multiplier: "N" or "N m"; "": it depends on the author's formula */
};

/** A state event: the step of a motion ends where its value crosses zero. */
struct refdyn_event {
    const char *name; /**< as in the model file */
    int direction;    /**< 1: the value rises, -1: it falls, 0: both count */
    int ends;         /**< 1: the motion ends at the event */
    int is_impact;    /**< 1: rates jump by an impulse along the gradient of the value, by its coefficient of
                           restitution */
    int first_change; /**< first entry in the model's list of changes */
    int change_count; /**< number of entries */
    int contact; /**< 1 + the row that acts while the contact rests; 0: the event is no contact. The value of
                      a contact is its gap. Its single change sets the parameter that is 1 while the contact
                      rests, else 0. -1: a sample of a controller, which reports do not list */
};

/** The kind of value that an event sets. */
enum refdyn_changed {
    REFDYN_CHANGED_RATE,     /**< in qd */
    REFDYN_CHANGED_INPUT,    /**< in x */
    REFDYN_CHANGED_PARAMETER /**< in p */
};

/** A value that an event sets. */
struct refdyn_change {
    enum refdyn_changed what; /**< its kind */
    int place;                /**< index in qd, x or p; -1: no emitted function reads the parameter */
};

/** Sizes for requirements. */
enum {
    REFDYN_REQUIREMENT_NUMBERS = 6 /**< largest number of values that a message prints */
};

/** A rule for parameters, such as a positive mass. */
struct refdyn_requirement {
    const char *subject; /**< where the rule applies, such as "links[1].mass" */
    const char *fact;    /**< printf format of the message about a broken rule, for `count` doubles */
    int count;           /**< number of values in the message, 1 to REFDYN_REQUIREMENT_NUMBERS */
};

/**
 * Vectors of a joint j in the axes of the ground, about its origin, as `tangent_vectors` computes them.
 *
 * With e the axis of a turn or slide, rho the arm of a mass element after j, and C_j = e x rho or e:
 *
 *     mass       int C_j dm, int rho x C_j dm
 *     spin       int rho' x C_j dm
 *     damping    the same with dC_j/dt
 *     stiffness  the same with d2C_j/dt2, and with what turns C along
 *
 * Their products are the tangent: runtime/core/linear/chain_sweeps.c.
 */
enum refdyn_vector {
    REFDYN_TURN_AXIS,        /**< axis of a turn */
    REFDYN_TURN_RATE,        /**< its first time derivative */
    REFDYN_TURN_RATE2,       /**< its second time derivative */
    REFDYN_SLIDE_AXIS,       /**< axis of a slide */
    REFDYN_SLIDE_RATE,       /**< its first time derivative */
    REFDYN_SLIDE_RATE2,      /**< its second time derivative */
    REFDYN_LEVER,            /**< (acceleration of the origin - gravity) x e of a turn */
    REFDYN_SHIFT,            /**< from the origin of the previous joint */
    REFDYN_SHIFT_RATE,       /**< its time derivative */
    REFDYN_MASS_MOMENT,      /**< int rho x C_j dm */
    REFDYN_MASS_FORCE,       /**< int C_j dm */
    REFDYN_SPIN,             /**< int rho' x C_j dm */
    REFDYN_STIFFNESS_MOMENT, /**< moment of the stiffness */
    REFDYN_STIFFNESS_FORCE,  /**< force of the stiffness */
    REFDYN_DAMPING_MOMENT,   /**< moment of the damping */
    REFDYN_DAMPING_FORCE,    /**< force of the damping */
    REFDYN_TURNED_ROWS,      /**< effect of the turns of previous joints on forces at j */
    /** Row of K of this turn by the related turns. For three turns at one point whose springs act on strains
     * instead of axes. In the second and third turn, x belongs to the previous turn and y to the one before.
     * z is 1 for the third turn. */
    REFDYN_STRAIN_ROWS,
    REFDYN_STRAIN_COLUMNS, /**< column of K of the related turns by this turn */
    REFDYN_STRAIN_DAMPING, /**< the same of D, for rows and columns; z, of any joint: REFDYN_ROTOR */
    REFDYN_VECTOR_COUNT    /**< number of vectors */
};

/** Places among the components of the vectors. */
enum {
    REFDYN_ROTOR = 3 * REFDYN_STRAIN_DAMPING + 2 /**< addition of a drive's rotor to the diagonal of M */
};

/** Spatial Jacobians of the points that request them, as NAME_spatial in NAME.h. The first three rows are the
 * velocity of the point, the next three the angular velocity of its body, in the axes of the ground. */
struct refdyn_spatial {
    int count;              /**< number of these points */
    const int *points;      /**< (count) their rows of r, rd and d */
    refdyn_function *J;     /**< (count x 6 x n) (rd, w) = J qd */
    refdyn_function *Jd_qd; /**< (count x 6) (rdd, wd) = J qdd + Jd_qd [m/s^2, rad/s^2] */
};

/** Limits of one joint, listed in NAME.h; infinite where there is none. No function reads them. */
struct refdyn_limits {
    int coordinate; /**< index of the joint's coordinate */
    double from;    /**< smallest position [m, rad] */
    double to;      /**< largest position [m, rad] */
    double rate;    /**< largest absolute value of the rate [m/s, rad/s] */
    double force;   /**< largest absolute value of the force [N, N m] */
};

/** A model: sizes, tables and functions, all constant. */
struct refdyn_model {
    int interface_version; /**< REFDYN_MODEL_VERSION; the first field in every version */
    const char *name;      /**< of the model */
    const char *hash;      /**< of the model; it changes whenever the emitted code does */
    int n;                 /**< coordinates */
    int m;                 /**< constraint rows; rows of contacts come last */
    int parameter_count;   /**< parameters that a function reads */
    int derived_count;     /**< derived values, which follow the parameters in p */
    int input_count;       /**< inputs */
    int point_count;       /**< points of interest */
    int course_count;      /**< courses, values that a motion records */
    int break_count;       /**< time events whose times are known: kinks and jumps of formulas of time */
    int switch_count;      /**< values that change sign at the other time events */
    int event_count;       /**< values whose zeros are state events */
    int kink_count;        /**< further values, at whose zeros formulas of coordinates and rates have kinks */
    int change_count;      /**< values that events set in all */
    int requirement_count; /**< rules for parameters */
    int saturates;         /**< 1: a rate drives a value to its limit, as friction does */
    double length;         /**< translation that counts as much as 1 rad [m]; 0: 1 m */
    double qdd_cost; /**< operations of a call of `constrained`, or of `qdd_free` without rows; 0: unknown.
                          A division counts as four, a function of libm as ten */
    double tangent_cost;         /**< of `tangent`, counted in the same way */
    double tangent_vectors_cost; /**< of `tangent_vectors`, counted in the same way */
    int coupling_count;          /**< couplings in `tangent_vectors`: rows of pulled, pull_by_q, pull_by_qd */
    const struct refdyn_name *coordinates; /**< (n), then one more for each state, with the change of it that
                                                counts as much as 1 rad. The unit of a state is that of z */
    const struct refdyn_name *parameters;  /**< (parameter_count) */
    const struct refdyn_name *inputs;      /**< (input_count) */
    const char *const *points;             /**< (point_count) names */
    const char *const *courses;            /**< (course_count) names */
    const struct refdyn_row *rows;         /**< (m) */
    const struct refdyn_event *events;     /**< (event_count) */
    const struct refdyn_change *changes;   /**< (change_count) event by event */
    const struct refdyn_requirement *requirements; /**< (requirement_count) */
    const int *parent; /**< (n) previous coordinate on the way to the ground, -1: none, REFDYN_STATE: it is a
                            state. M[i][j] is zero unless one of i, j leads to the other */
    const int *dependent; /**< (m) coordinates declared dependent; NULL: the runtime chooses them */
    const int *gains;     /**< (m x 2) places in p of 2 alpha and beta^2 of each row, -1: k does not read it.
                               `prepare` sets them; a caller may replace them afterwards */
    const int *vector_places; /**< (REFDYN_VECTOR_COUNT x 3) start of the array (n) of each vector component
                                 in the result of `tangent_vectors`, -1: zero for all joints */
    const int *held;          /**< (held_count) coordinates held in statics */
    int held_count;           /**< number of them */
    const int *anchored; /**< (anchored_count) parameters whose default is a value at the start of a motion */
    int anchored_count;  /**< number of them */

    void (*prepare)(double *p); /**< writes the derived values p[parameter_count] and following */
    refdyn_function *start;     /**< (2 n) q, then qd, of the initial state; reads p only */
    refdyn_function *anchor; /**< (anchored_count) values of the anchored parameters for the start t, q, qd */

    refdyn_function *M;        /**< (n x n) mass matrix [kg, kg m, kg m^2] */
    refdyn_function *h;        /**< (n) bias forces [N, N m] */
    refdyn_function *Q;        /**< (n) generalized forces [N, N m] */
    refdyn_function *u;        /**< (m x n) row coefficients: u qdd + v = 0 */
    refdyn_function *v;        /**< (m) right part of the rows */
    refdyn_function *phi;      /**< (m) residual of position rows, 0 for the others */
    refdyn_function *psi;      /**< (m) velocity-level residual: total time derivative of a position row, the
                                  residual      of a velocity row, 0 for acceleration rows */
    refdyn_function *k;        /**< (m) stabilised right side: u qdd = k = -v - 2 alpha psi - beta^2 phi */
    refdyn_function *r;        /**< (points x 3) positions, ground frame [m] */
    refdyn_function *rd;       /**< (points x 3) velocities [m/s] */
    refdyn_function *C;        /**< (points x 3 x n) rd = C qd */
    refdyn_function *d;        /**< (points x 3) rdd = C qdd + d [m/s^2] */
    refdyn_function *energy;   /**< (2) kinetic, potential (gravity and linear springs; gravity's zero is the
                                  ground   origin) [J] */
    refdyn_function *power;    /**< (1) of all forces in Q without a potential: qd . Q_nonconservative [W] */
    refdyn_function *Q_q;      /**< (n x n) dQ_i/dq_j at qd = 0, for any qd: the tangent of statics. States
                                  keep their values, and their columns are derivatives by these */
    refdyn_function *qdd_free; /**< (n) accelerations without constraints, O(n) [m/s^2, rad/s^2] */
    refdyn_function
        *qdd; /**< (n) accelerations with constraints and stabilisation, O(n m) [m/s^2, rad/s^2] */
    refdyn_function *force; /**< (n) programme force r = M qdd - h - Q at that qdd [N, N m] */
    /** (n) M qdd - h - Q at given qdd [N, N m], O(n): the forces that cause these accelerations in addition
     * to Q, which has the model's own forces at the inputs x. They are those of drives and of rows, u^T
     * lambda, together. Emitted on request. qd (2 n): the rates, followed by qdd. */
    refdyn_function *inverse;
    refdyn_function *equations; /**< struct NAME_equations_result as doubles: M (n x n), f = h + Q (n), u (m x
                                   n), v, phi, psi, k (m each) */
    refdyn_function *M_h;       /**< struct NAME_M_h_result as doubles: M (n x n), h (n) */
    refdyn_function *f;         /**< (n) h + Q [N, N m] */
    refdyn_function *row_terms; /**< struct NAME_row_terms_result: u (m x n), v, phi, psi, k (m each) */
    refdyn_function *row_sizes; /**< (m x n) sizes of u without cancellation, at least about |u|. By them the
                                   runtime recognises coefficients that are rounding alone */
    refdyn_function *point_terms; /**< struct NAME_point_terms_result: r, rd, C, d */
    refdyn_function *constrained; /**< struct NAME_constrained_result: qdd (n), power (1), lambda (m) */
    refdyn_function *terms; /**< struct NAME_terms_result: the results of row_terms, then of point_terms */
    refdyn_function
        *accelerations; /**< struct NAME_accelerations_result: the results of constrained, then qdd_free */
    /** Exact tangent of M qdd - h - Q - u^T lambda and of u qdd - k at given qdd and lambda. Emitted on
     * request. qd (2 n + 1 + m): the rates, followed by the result of `constrained`. Parts as in NAME.h. */
    refdyn_function *tangent;
    /** The same as vectors of joints, O(n). Emitted on request. f_t (n), g_t (m), G_q, G_qd, u (m x n each),
     * diagonals of K and D in addition to the vectors (n each), the arrays of vector_places, and K and D of
     * couplings: + pulled^T pull_by_q, ... */
    refdyn_function *tangent_vectors;
    refdyn_function *tangent_x; /**< the same by the inputs, on request: f_x (n x inputs), g_x (m x inputs) */
    refdyn_function *d_qdd;     /**< of qdd by q, qd, t, inputs, parameters; on request, parts as in NAME.h */
    refdyn_function *d_qdd_free; /**< of qdd_free by the same, on request */
    refdyn_function *d_force;    /**< of force by the same, on request */
    refdyn_function
        *d_inverse; /**< of inverse by q, qd, t, inputs, parameters, qdd, on request; qd as for inverse */
    refdyn_function *d_statics; /**< of Q at qd = 0 by q, t, inputs, parameters, on request */
    refdyn_function *d_rows;    /**< of phi, psi and k by q, qd, t, inputs, parameters, on request */
    refdyn_function *d_points;  /**< of r and rd by q, qd, parameters, and of rdd at given qdd, on request; qd
                                   as for inverse */
    refdyn_function *d_course;  /**< of course by q, qd, t, inputs, parameters, on request */
    refdyn_function *course;    /**< (course_count) courses, in the units of the model */
    refdyn_function *breaks; /**< (break_count) times of time events, in no order; reads p and x only [s] */
    refdyn_function
        *switches;          /**< (switch_count) values whose sign changes at time events; reads p, x and t */
    refdyn_function *pace;  /**< (2) largest angular frequencies of these values, and of events that depend on
                               the state [rad/s] */
    refdyn_function *event; /**< (values) event_count whose zeros are state events, then kink_count */
    refdyn_function *event_terms; /**< struct NAME_event_terms_result as doubles: d/dt of these values at qdd
                                     = 0, their derivatives by q and by qd (values x n each), coefficients of
                                     restitution (event_count), the values that events set (change_count),
                                     sums of |terms| of the events' values (event_count) */
    refdyn_function
        *required; /**< for each requirement: 1 if it is met, else 0, then its numbers; reads p only */
};

/** Applies REFDYN_ENTRY to the name of each function of struct refdyn_model from `start` on, in its order. */
/* clang-format off */
#define REFDYN_QUANTITIES(REFDYN_ENTRY) \
    REFDYN_ENTRY(start) REFDYN_ENTRY(anchor) REFDYN_ENTRY(M) REFDYN_ENTRY(h) REFDYN_ENTRY(Q) REFDYN_ENTRY(u) \
    REFDYN_ENTRY(v) REFDYN_ENTRY(phi) REFDYN_ENTRY(psi) REFDYN_ENTRY(k) REFDYN_ENTRY(r) REFDYN_ENTRY(rd) \
    REFDYN_ENTRY(C) REFDYN_ENTRY(d) REFDYN_ENTRY(energy) REFDYN_ENTRY(power) REFDYN_ENTRY(Q_q) \
    REFDYN_ENTRY(qdd_free) REFDYN_ENTRY(qdd) REFDYN_ENTRY(force) REFDYN_ENTRY(inverse) REFDYN_ENTRY(equations) \
    REFDYN_ENTRY(M_h) REFDYN_ENTRY(f) REFDYN_ENTRY(row_terms) REFDYN_ENTRY(row_sizes) REFDYN_ENTRY(point_terms) \
    REFDYN_ENTRY(constrained) REFDYN_ENTRY(terms) REFDYN_ENTRY(accelerations) REFDYN_ENTRY(tangent) \
    REFDYN_ENTRY(tangent_vectors) REFDYN_ENTRY(tangent_x) REFDYN_ENTRY(d_qdd) REFDYN_ENTRY(d_qdd_free) REFDYN_ENTRY(d_force) \
    REFDYN_ENTRY(d_inverse) REFDYN_ENTRY(d_statics) REFDYN_ENTRY(d_rows) REFDYN_ENTRY(d_points) REFDYN_ENTRY(d_course) REFDYN_ENTRY(course) \
    REFDYN_ENTRY(breaks) REFDYN_ENTRY(switches) REFDYN_ENTRY(pace) REFDYN_ENTRY(event) \
    REFDYN_ENTRY(event_terms) REFDYN_ENTRY(required)
/* clang-format on */

#endif
