/*
 * The model: what a Lua file says, in plain C, after reading and before any derivation.
 *
 * The author's functions need the names of all coordinates. These steps fill the model:
 *   read_scene      options, parameters, inputs, links, points, names of dependent and held coordinates;
 *   expand          frames and coordinates (tree.h);
 *   read_programme  forces, drives and constraint rows, by calling the author's functions.
 * Quantities are expressions in parameters. Those of forces and rows may also depend on time, inputs,
 * coordinates and points. Units are SI units and radians.
 */
#ifndef REFDYN_GEN_MODEL_H
#define REFDYN_GEN_MODEL_H

#include "gen/graph/graph.h"

enum { AXIS_X, AXIS_Y, AXIS_Z };

/* A frame in its parent's frame. The columns of `rotation` (3 x 3 by rows) are its axes, `position` [m] is
 * its origin. */
struct placement {
    expression rotation[9];
    expression position[3];
};

/* Limits of a joint, infinite where there is none. They are compared with a motion and do not affect it. */
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
    const char *coordinate;       /* name of the coordinate; NULL: LINK_NAME */
    bool has_direction;           /* the axis is `direction` instead (tree.h) */
    expression direction[3];      /* in the link's axes, of any length */
    expression start, start_rate; /* at the start of a motion [m, rad; m/s, rad/s] */
    expression stiffness, rest;   /* linear spring, 0 if there is none [N/m or N m; m or rad] */
    expression damping;           /* linear damper, 0 if there is none [N s/m or N m s] */
    expression rotor;             /* inertia gear^2 of its drive's rotor, added to M_ii [kg or kg m^2] */
    const struct limits *limits;  /* NULL: none */
    struct place place;
};

/* One rigid body of a link. */
struct solid {
    struct placement placement; /* in the link's frame */
    expression mass;            /* [kg] */
    expression center[3];       /* centre of mass [m] */
    expression inertia[6];      /* tensor about the centre of mass, xx yy zz xy xz yz, xy = -int x y dm
                                   [kg m^2] */
};

/* A prismatic part of a beam, cut into rigid finite elements of equal length: theory, sect. 3.1. */
struct segment {
    int rfe;                     /* number of rigid finite elements, 1: rigid */
    expression length;           /* [m] */
    expression area, Iy, Iz, It; /* section [m^2, m^4]: Iz = int y^2 dA, Iy = int z^2 dA */
    expression E, nu, rho;       /* [Pa, 1, kg/m^3] */
    expression eta;              /* Kelvin-Voigt: damping over stiffness [s] */
    expression damping[3];   /* of one spring-damping element, psi theta phi, in addition to eta [N m s] */
    expression curvature[3]; /* of the unloaded beam: about z, about y, twist [rad/m] */
};

/* A flexible link along its local x axis: a row of segments that are rigidly joined. */
struct beam {
    bool exists;
    bool keeps[3];    /* which of psi, theta, phi an element has, in this order */
    bool has_strains; /* springs act on strains that are symmetric in the three turns: theory, sect. 3.4 */
    struct segment *segments;
    int segment_count;
};

/* A place at the link's own frame (first element of a beam), at the beam's end, or along the beam. */
struct attachment {
    int link; /* -1: the ground */
    enum { AT_FRAME, AT_TIP, AT_ALONG } where;
    expression along; /* [m], AT_ALONG only */
    struct placement placement;
};

struct link {
    const char *name;
    struct place place;
    bool is_wrong; /* it has errors; checks that depend on it are left out */
    struct attachment on;
    struct joint *joints; /* from the parent outward; none: welded on */
    int joint_count;
    struct solid *solids;
    int solid_count;
    struct beam beam;
};

/* A point or, if is_direction, a vector fixed to a link, whose components are the placement's position. */
struct point {
    const char *name;
    struct place place;
    struct attachment at;
    bool is_direction;
    bool is_angular; /* a point of interest with a spatial Jacobian */
};

struct model_option {
    const char *name, *value; /* as text */
    bool is_text;             /* neither a number nor a truth value */
    struct place place;
};

struct parameter {
    const char *name, *unit;
    struct place place;
    double value;      /* given, or default */
    bool is_mode;      /* set by contacts, therefore never folded */
    bool is_anchored;  /* value at the start of a motion, unless is_given: theory, sect. 6.5 */
    bool is_given;     /* set from outside */
    bool is_late;      /* anchored, and its value is unknown before the start of a motion */
    expression anchor; /* of t, q, qd, points, inputs and parameters at the start */
};

struct input {
    const char *name, *unit;
    struct place place;
    double value;  /* given, or default */
    bool is_given; /* set from outside */
};

/* A generalized force on one coordinate. It is added to Q. */
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
    const char *path;    /* its name in messages: "forces[1]" */
    struct place place;
};

/* An energy V(q, points). -dV/dq_j is added to Q_j, and V to the potential energy. */
struct potential {
    expression energy; /* [J] */
    const char *path;
    struct place place;
};

/* A named value that is recorded with a motion. */
struct course {
    const char *name;
    expression value;
    struct place place;
};

/* Bounds of a column of a motion, infinite where there is none. They are compared with a motion and do not
 * affect it. */
struct bound {
    const char *name;   /* in reports */
    const char *column; /* the column: that of a course of the same name if the author gives an expression */
    bool is_course;
    double from, to;
    struct place place;
};

/* A continuous state z of a controller or a drive, with z' = rate. The tree has a frame for it (tree.h). */
struct model_state {
    const char *name, *unit;
    expression rate, start;
    double scale;     /* change that tolerances equate with a turn of 1 rad */
    int number;       /* in the author's list */
    const char *path; /* its name in messages: "states[1]"; NULL: used but not declared */
    struct place place;
};

/* A drive: its force is an input, which a programme realised by drives determines. */
struct drive {
    const char *name;
    int coordinate; /* on which it acts; -1: along the line between two places */
    int input;
    double limit; /* of its absolute value, infinite if there is none [N or N m] */
    struct place place;
};

/* A programme constraint: residual = 0. */
struct row {
    enum row_level { ROW_POSITION, ROW_VELOCITY, ROW_ACCELERATION } level;
    expression residual;
    expression alpha, beta; /* Baumgarte gains [1/s] */
    const char *name;       /* for reports: "row 1" or the author's name */
    const char *path;       /* its name in messages: "constraints[1]" */
    bool is_programme;      /* the author's own course of the motion, which drives can realise instead */
    int driven;             /* 1 + the coordinate that it drives or locks, or 0 */
    const char *unit;       /* of its multiplier; "" if it depends on the author's formula */
    bool is_closure;        /* part of a closed loop or joint, some of whose rows may be redundant */
    expression rests;       /* of a contact: the parameter that is 1 while the contact rests and its row acts,
                               and 0 otherwise. No expression (0) if the row always acts */
    const char **starts; /* parameters that the row's own formula reads and that have values of the start */
    int start_count;     /* of the motion */
    struct place place;
};

enum number_range { RANGE_ANY, RANGE_POSITIVE, RANGE_NOT_NEGATIVE, RANGE_POISSON, RANGE_SHARE };

/* What an event changes. */
struct change {
    enum changed { CHANGED_RATE, CHANGED_INPUT, CHANGED_PARAMETER } what;
    int index;        /* of the coordinate, input or parameter */
    expression value; /* of the state before the event */
    const char *path; /* its name in messages: "events[1].rates.arm_psi" */
    struct place place;
};

/* A state or time event: an expression that crosses zero, and what happens then. */
struct event {
    const char *name; /* the author's, or "event 1" */
    expression value;
    int direction; /* 1: it rises, -1: it falls, 0: both */
    bool ends;     /* the motion */
    bool is_impact;
    bool is_sampled;                /* at multiples of a time: a controller, not listed with the events */
    expression restitution;         /* of an impact or a contact */
    int contact;                    /* row that acts while the contact rests; -1 if it is not a contact */
    int first_change, change_count; /* in the model's list */
    const char *path;               /* its name in messages: "events[1]" */
    struct place place;
};

/* A rule that numbers of the model must satisfy for all values of the parameters. */
struct requirement {
    /* The rule as an expression in `numbers`: 1 if it is satisfied, else 0. */
    expression (*holds)(struct graph *graph, const struct requirement *requirement,
                        const expression *numbers);
    expression values[6]; /* the numbers */
    int count;
    enum number_range range; /* of one number */
    const char *path;        /* its name in messages: "links[1].mass", "rd.tube", "link arm" */
    const char *fact;        /* message for numbers that break it: a printf format of the numbers */
    struct place place;
};

/* Loops over equal elements (tree.h): where they save operations, wherever there are two, or none. */
enum loops { LOOPS_AUTO, LOOPS_ALWAYS, LOOPS_NEVER };

/* How M x = f is solved for the accelerations: by recursion in O(n), with M as a matrix, or by the cheaper of
 * the two. */
enum accelerations { ACCELERATIONS_AUTO, ACCELERATIONS_RECURSIVE, ACCELERATIONS_DENSE };

struct model {
    const char *name;
    bool is_renamed; /* the name was requested and is not the one in the file */
    const char *file;
    const struct sources *sources; /* all files that it was read from (script.h) */
    struct place place;
    struct graph *graph;
    bool printed_form; /* h and Q as the chapter prints them: theory, sect. 9 */
    bool fold;         /* parameters become numbers in the graph */
    enum accelerations accelerations;
    enum loops loops;
    expression gravity[3]; /* [m/s^2], ground frame */
    double length;         /* [m] translation that tolerances equate with a turn of 1 rad */
    struct model_option *options;
    int option_count;
    struct parameter *parameters;
    int parameter_count;
    struct input *inputs;
    int input_count;
    struct link *links; /* each after the link that carries it */
    int link_count;
    struct point *points; /* the first point_count are points of interest; forces and rows use the others */
    int point_count, marker_count, marker_capacity;
    struct force *forces; /* of the author and of drives, then the rates of all states */
    int force_count;
    struct load *loads;
    int load_count, load_capacity;
    struct potential *potentials;
    int potential_count, potential_capacity;
    struct course *courses; /* in the order of their names, then those of bounds in the author's order */
    int course_count;
    struct bound *bounds;
    int bound_count;
    struct drive *drives;
    int drive_count;
    struct model_state *states; /* in the author's order */
    int state_count, state_capacity;
    struct row *rows;
    int row_count, row_capacity;
    struct event *events;
    int event_count, event_capacity;
    expression *kinks; /* of formulas in coordinates and rates (language.h) */
    int kink_count;
    struct change *changes; /* event by event */
    int change_count, change_capacity;
    const char **dependent; /* row_count coordinate names; if there are none, the runtime chooses */
    int dependent_count;
    struct place dependent_place;
    const char **hold; /* coordinates held in statics */
    int hold_count;
    struct place hold_place;
    struct requirement *requirements;
    int requirement_count;
};

/* Value of an expression in parameters, with their values in the model file and on the command line. */
double parameters_evaluate(struct graph *graph, const struct parameter *parameters, expression e);
/* The error message for a number, such as "value -5; must be positive"; NULL if it is in its range. */
const char *requirement_fault(struct memory *memory, enum number_range range, double value);

/*
 * Requirements without path and place, in this order:
 *   a number of a field within its range; argument number `argument` (from 1) of a function
 *   two numbers that ascend; the diameter of a hole and the outer diameter
 *   a place along a beam and the beam's length
 *   moments xx yy zz of a body; these with its products xy xz yz
 *   three components of a direction; components whose squares are computed
 */
struct requirement requirement_field(enum number_range range, expression value);
struct requirement requirement_argument(struct memory *memory, enum number_range range, int argument,
                                        expression value);
struct requirement requirement_order(expression below, expression above);
struct requirement requirement_hole(expression inner, expression outer);
struct requirement requirement_along(expression along, expression length);
struct requirement requirement_moments(const expression inertia[6]);
struct requirement requirement_products(const expression inertia[6]);
struct requirement requirement_direction(const expression components[3]);
struct requirement requirement_length(struct graph *g, const expression components[3]);
/* The error message, without its place, if the parameters' values break the requirement; NULL otherwise. */
const char *requirement_broken(struct memory *memory, struct graph *graph, const struct parameter *parameters,
                               const struct requirement *requirement);

#endif
