/*
 * The model: what a Lua file says, in plain C, after reading and before any derivation.
 *
 * Filled in two steps, since the author's functions need the names of all coordinates:
 *   read_scene      options, parameters, inputs, links, points, names of dependent and held coordinates
 *   expand          frames and coordinates (tree.h)
 *   read_programme  forces and constraint rows, by calling the author's functions
 * Every quantity is an expression of parameters, or, in forces and rows, of time, inputs, coordinates and
 * points. SI units and radians.
 */
#ifndef REFDYN_GEN_MODEL_H
#define REFDYN_GEN_MODEL_H

#include "gen/base/base.h"
#include "gen/graph/graph.h"

enum { AXIS_X, AXIS_Y, AXIS_Z };

/* A frame in its parent's frame: columns of `rotation` (row-major 3 x 3) are its axes, `position` [m] its
 * origin. */
struct placement {
    expression rotation[9];
    expression position[3];
};

/* Of a joint, infinite where there is none; the motion does not feel them. */
struct limits {
    double from, to; /* coordinate [m, rad] */
    double rate;     /* absolute value [m/s, rad/s] */
    double force;    /* of its drive, absolute value [N, N m] */
};

/* An elementary joint coordinate: a slide along or a turn about one local axis. */
struct joint {
    bool is_revolute;
    int axis;
    const char *name; /* as the author calls it: "x" "y" "z" slide, "phi" "theta" "psi" turn about x, y, z */
    bool has_direction;           /* instead of that axis: see tree.h */
    expression direction[3];      /* in the link's axes, of any length */
    expression start, start_rate; /* at the start of a motion [m, rad; m/s, rad/s] */
    expression stiffness, rest,
        damping; /* linear spring and damper, 0 where there is none [N/m or N m; m or rad; N s/m or N m s] */
    expression rotor;            /* what the rotor of its drive adds to M_ii, inertia gear^2 [kg or kg m^2] */
    const struct limits *limits; /* NULL: none */
    struct place place;
};

/* One rigid body of a link. */
struct solid {
    struct placement placement; /* in the link's frame */
    expression mass;            /* [kg] */
    expression center[3];       /* centre of mass [m] */
    expression inertia[6]; /* tensor about the centre of mass: xx yy zz xy xz yz, off the diagonal -int x y dm
                              [kg m^2] */
};

/* A prismatic stretch of a beam, cut into rigid finite elements of its own length: theory, sect. 3.1. */
struct segment {
    int rfe;                     /* number of rigid finite elements, 1: rigid */
    expression length;           /* [m] */
    expression area, Iy, Iz, It; /* section [m^2, m^4]: Iz = int y^2 dA, Iy = int z^2 dA */
    expression E, nu, rho;       /* [Pa, 1, kg/m^3] */
    expression eta;              /* Kelvin-Voigt: damping over stiffness [s] */
    expression damping[3];       /* of one spring-damping element, psi theta phi; adds to eta's [N m s] */
    expression curvature[3];     /* of the unloaded beam: about z, about y, twist [rad/m] */
};

/* A flexible link along its local x axis: segments one behind the other, rigidly joined. */
struct beam {
    bool exists;
    bool keeps[3]; /* which of psi, theta, phi an element has, in this order */
    bool
        has_strains; /* springs of three turns act on strains that are symmetric in them: theory, sect. 3.4 */
    struct segment *segments;
    int segment_count;
};

/* The link's own frame (first element of a beam), the beam's end, or a place along it. */
enum attachment_where { AT_FRAME, AT_TIP, AT_ALONG };

struct attachment {
    int link; /* -1: the ground */
    enum attachment_where where;
    expression along; /* [m], AT_ALONG only */
    struct placement placement;
};

struct link {
    const char *name;
    struct place place;
    bool is_wrong; /* there are complaints about it: what follows from it is not judged */
    struct attachment on;
    struct joint *joints; /* from the parent outward; none: welded on */
    int joint_count;
    struct solid *solids;
    int solid_count;
    struct beam beam;
};

/* A point or, when is_direction, a vector fixed to a link: only the placement's position counts, as its
 * components. */
struct point {
    const char *name;
    struct place place;
    struct attachment at;
    bool is_direction;
    bool is_angular; /* of interest, with a spatial Jacobian */
};

struct model_option {
    const char *name, *value; /* as text */
    bool is_text;             /* no number and no truth value */
    struct place place;
};

struct parameter {
    const char *name, *unit;
    struct place place;
    double value;      /* given, or default */
    bool is_mode;      /* set by contacts: never folded */
    bool is_anchored;  /* value at the start of a motion, unless is_given: theory, sect. 6.5 */
    bool is_given;     /* set from outside */
    bool is_late;      /* anchored, and nothing says its value before the start of a motion */
    expression anchor; /* of t, q, qd, points, inputs and parameters at the start */
};

struct input {
    const char *name, *unit;
    struct place place;
    double value;  /* given, or default */
    bool is_given; /* set from outside */
};

/* A generalized force on one coordinate: adds to Q. */
struct force {
    int coordinate;
    expression value; /* [N or N m] */
    struct place place;
};

/* A force at a point, or a torque on the body that carries it, in the ground frame. */
struct load {
    int point;
    bool is_torque;
    expression value[3]; /* [N] or [N m] */
    const char *path;    /* as messages call it: "forces[1]" */
    struct place place;
};

/* An energy V(q, points): Q_j gains -dV/dq_j; it counts as potential energy. */
struct potential {
    expression energy; /* [J] */
    const char *path;
    struct place place;
};

/* A value that the author wants recorded with a motion. */
struct course {
    const char *name;
    expression value;
    struct place place;
};

enum row_level { ROW_POSITION, ROW_VELOCITY, ROW_ACCELERATION };

/* A programme constraint: residual = 0. */
struct row {
    enum row_level level;
    expression residual;
    expression alpha, beta; /* Baumgarte gains [1/s] */
    const char *name;       /* for reports: "row 1" or the author's name */
    const char *path;       /* as messages call it: "constraints[1]" */
    bool is_closure;        /* of a loop or joint that is closed: some of its rows may be redundant */
    expression rests; /* of a contact: the parameter that is 1 while the contact rests and its row acts, and 0
                         otherwise. No expression (0): the row always acts */
    const char *
        *starts;     /* (start_count) of a position or drive that the author writes: the parameters with */
    int start_count; /* values at the start of the motion that it reads */
    struct place place;
};

enum number_range { RANGE_ANY, RANGE_POSITIVE, RANGE_NOT_NEGATIVE, RANGE_POISSON, RANGE_SHARE };

/* What an event changes. */
enum changed { CHANGED_RATE, CHANGED_INPUT, CHANGED_PARAMETER };

struct change {
    enum changed what;
    int index;        /* of the coordinate, input or parameter */
    expression value; /* of the state before the event */
    const char *path; /* as messages call it: "events[1].rates.arm_psi" */
    struct place place;
};

/* Where an expression crosses zero, and what happens there. */
struct event {
    const char *name; /* the author's, or "event 1" */
    expression value;
    int direction; /* 1: it rises, -1: it falls, 0: both */
    bool ends;     /* the motion */
    bool is_impact;
    expression restitution;         /* of an impact or a contact */
    int contact;                    /* row that acts while the contact rests; -1: the event is no contact */
    int first_change, change_count; /* in the model's list */
    const char *path;               /* as messages call it: "events[1]" */
    struct place place;
};

/* What numbers of the model that depend on parameters have to be with all their values. */
struct requirement {
    /* The rule, as an expression in `numbers`: 1 where it holds, else 0. */
    expression (*holds)(struct graph *graph, const struct requirement *requirement,
                        const expression *numbers);
    expression values[6]; /* the numbers */
    int count;
    enum number_range range; /* of one number */
    const char *path;        /* as messages call it: "links[1].mass", "rd.tube", "link arm" */
    const char *fact;        /* what is wrong: a printf format that takes the numbers */
    struct place place;
};

/* Loops over equal elements (tree.h): where they pay, wherever there are two, or none. */
enum loops { LOOPS_AUTO, LOOPS_ALWAYS, LOOPS_NEVER };

/* How M x = f is solved for the accelerations: by recursion in O(n), with M as a matrix, or by what is
 * cheaper. */
enum accelerations { ACCELERATIONS_AUTO, ACCELERATIONS_RECURSIVE, ACCELERATIONS_DENSE };

struct model {
    const char *name;
    const char *file;
    const struct sources *sources; /* all files that it was read from: read.h */
    struct place place;
    struct graph *graph;
    bool printed_form; /* h and Q as the chapter prints them: theory, sect. 9 */
    bool fold;         /* parameters are numbers in the graph */
    enum accelerations accelerations;
    enum loops loops;
    expression gravity[3]; /* [m/s^2], ground frame */
    double length;         /* [m] translation that counts as much as a turn of 1 rad */
    struct model_option *options;
    int option_count;
    struct parameter *parameters;
    int parameter_count;
    struct input *inputs;
    int input_count;
    struct link *links; /* each after the link that it stands on */
    int link_count;
    struct point *points; /* the first point_count are points of interest, others serve forces and rows */
    int point_count, marker_count, marker_capacity;
    struct force *forces;
    int force_count;
    struct load *loads;
    int load_count, load_capacity;
    struct potential *potentials;
    int potential_count, potential_capacity;
    struct course *courses; /* in the order of their names */
    int course_count;
    struct row *rows;
    int row_count, row_capacity;
    struct event *events;
    int event_count, event_capacity;
    expression *kinks; /* of formulas in coordinates and rates: read.h */
    int kink_count;
    struct change *changes; /* event by event */
    int change_count, change_capacity;
    const char **dependent; /* coordinate names, row_count of them, or none: chosen at run time */
    int dependent_count;
    struct place dependent_place;
    const char **hold; /* coordinates held in statics */
    int hold_count;
    struct place hold_place;
    struct requirement *requirements;
    int requirement_count;
};

/* Value of an expression of parameters. */
double parameters_evaluate(struct graph *graph, const struct parameter *parameters, expression e);

/* ---- requirements.c ---- */

/* What is wrong with a number, as "value -5, a positive number is needed"; NULL: nothing. */
const char *requirement_fault(struct memory *memory, enum number_range range, double value);

/* Requirements without path and place, in this order: a number of a field within its range; argument number
 * `argument` of a function, from 1; two numbers that ascend; the diameter of a hole and the outer one; a
 * place along a beam and the beam's length; moments xx yy zz of a body; these with its products xy xz yz;
 * three components of a direction; components whose squares are computed. */
struct requirement requirement_field(enum number_range range, expression value);
struct requirement requirement_argument(struct memory *memory, enum number_range range, int argument,
                                        expression value);
struct requirement requirement_order(struct memory *memory, const char *needed, expression below,
                                     expression above);
struct requirement requirement_hole(expression inner, expression outer);
struct requirement requirement_along(expression along, expression length);
struct requirement requirement_moments(const expression inertia[6]);
struct requirement requirement_products(const expression inertia[6]);
struct requirement requirement_direction(const expression components[3]);
struct requirement requirement_length(struct graph *g, const expression components[3]);

/* What is wrong with a requirement at the parameters' values, as the message without its place; NULL:
 * nothing.
 */
const char *requirement_broken(struct memory *memory, struct graph *graph, const struct parameter *parameters,
                               const struct requirement *requirement);

#endif
