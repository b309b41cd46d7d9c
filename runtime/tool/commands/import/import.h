/* Imports a robot from a URDF file: the robot as read; links as beams with a rest; identifiers; numbers
 * without rounding; the Lua model. */
#ifndef REFDYN_TOOL_IMPORT_H
#define REFDYN_TOOL_IMPORT_H

#include <stdbool.h>
#include <stdio.h>

/* A body: its centre of mass [m] and the inertia about it, xx yy zz xy xz yz [kg m^2], along the axes of one
 * frame. */
struct body {
    double mass, center[3], inertia[6];
};

/* Replaces a tensor that no body can have by the nearest one, in second moments, that a body can have.
 * Returns whether it did. */
bool import_inertia_mend(double inertia[6]);

/* A robot as the URDF file describes it: links with mass data, and the joints between them. SI units and
 * radians, with the numbers of the file. Errors go to stderr as FILE:LINE: WHAT: fact; what to do. Warnings
 * start their text with `warning: `. */

/* A frame in another one: the rotation is Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]). */
struct pose {
    double xyz[3], rpy[3];
};

enum joint_kind {
    JOINT_FIXED,
    JOINT_REVOLUTE,
    JOINT_CONTINUOUS,
    JOINT_PRISMATIC,
    JOINT_PLANAR,
    JOINT_FLOATING
};

struct robot_link {
    const char *name;
    int line;
    bool has_mass;
    double mass;
    struct pose pose;   /* of the frame at the centre of mass, in which the inertia is given */
    double inertia[6];  /* xx yy zz xy xz yz */
    int joint;          /* joint that carries it; -1 for the root */
    int first, sibling; /* the first link that it carries; the next link with the same carrier; -1: none */
};

struct joint_limits {
    bool has_range, has_rate, has_force;
    double from, to, rate, force;
};

struct robot_joint {
    const char *name;
    int line;
    enum joint_kind kind;
    int parent, child; /* links */
    struct pose pose;  /* of the child's frame in the parent's at coordinate 0 */
    double axis[3];    /* in the child's frame, of any length */
    double damping, friction;
    struct joint_limits limits;
    int leader; /* the joint that it mimics, or -1; q = multiplier * q of leader + offset */
    double multiplier, offset;
    double rotor_inertia, gear; /* 0: none */
};

struct robot {
    const char *path, *name;
    int line; /* of <robot> */
    struct robot_link *links;
    struct robot_joint *joints;
    int link_count, joint_count;
    int root;
    int *order; /* (link_count) links, carriers before what they carry, in the order of the file */
};

struct xml_element;

/* Prints "FILE:LINE: " and the text; returns false. */
bool import_robot_complain(const struct robot *robot, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void import_robot_warn(const struct robot *robot, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Reads the whole file, up to the first error. Returns false after a reported error. */
bool import_robot_read(struct robot *robot, const char *path);
/* Warns of all elements and attributes that import_robot_read does not read. */
void import_robot_warn_of_rest(const struct robot *robot, const struct xml_element *root);

/* The start of a joint's coordinate: 0, or the middle of its range if 0 is outside. A joint that follows
 * another one starts where that one puts it. */
double import_robot_start(const struct robot *robot, const struct robot_joint *joint);
/* A joint with one coordinate. */
bool import_joint_is_single(const struct robot_joint *joint);
/* A joint with one coordinate that follows no other joint. */
bool import_joint_is_driven(const struct robot_joint *joint);
/* The index of that name; -1 if there is none. */
int import_robot_find_link(const struct robot *robot, const char *name);

/* A rigid link as a uniform beam and a rest, which together have the link's mass, centre and inertia. */

struct beam_choice {
    const char *section; /* in the form of the model, "rd.round(0.05)" */
    double area, Iy, Iz; /* of the section [m^2, m^4] */
    double E, nu, eta;   /* [Pa, 1, s] */
    double rho;          /* [kg/m^3]; 0: from the link's mass */
    int rfe;             /* number of rigid finite elements */
    const double *tip;   /* (3) in the link's frame; NULL: the origin of the child joints */
};

struct flexible {
    int link;
    double tip[3], length;
    double psi, theta;   /* Rz(psi) Ry(theta) turns the link's x axis onto the beam */
    double direction[3]; /* of the beam in the link's frame */
    double rho;
    struct body rest; /* in the link's frame */
};

/* Returns false after a reported error. */
bool import_flexible_make(const struct robot *robot, int link, const struct beam_choice *choice,
                          struct flexible *flexible);
/* The position along the beam of the section that is nearest to a point of the link. */
double import_flexible_along(const struct flexible *flexible, const double point[3]);
/* A vector of the link's frame along the axes of the beam. */
void import_flexible_turn_back(const struct flexible *flexible, const double vector[3], double turned[3]);

/* Names of a URDF file as identifiers of Lua and C. The same file always gives the same names. */

/* Returns whether the name is an identifier of Lua and C. */
bool import_identifiers_is_free(const char *name);
/* For `count` different names; `lead`: "link". */
const char **import_identifiers_make(const char *const *names, int count, const char *lead);
/* The name of a model, and of its files. */
const char *import_identifiers_model(const char *name);

/* Removes rounding from computed numbers, so that they look as a person would write them: numbers that are
 * small against a scale become 0, and last digits within 1e-15 of the value go. With `scale` 0 no number
 * becomes 0. */
void import_tidy(double *list, int count, double scale);

/* A robot as a Lua model that a person would write; models/README.md describes the language. */

struct model_choice {
    const char *source;    /* name of the robot's file */
    bool is_floating;      /* the root moves freely */
    bool has_joint_names;  /* coordinates have the names of their joints */
    bool has_drives;       /* an input at each joint with one coordinate that follows no other */
    double friction_width; /* rate over which dry friction changes its sign; 0: friction is left out */
    const struct beam_choice *beam;
    const struct flexible *flexible; /* (flexible_count) links that become beams */
    int flexible_count;
};

void import_write_model(const struct robot *robot, const struct model_choice *choice, FILE *out);
/* Writes as JSON each joint that moves, with the names of its coordinates in the model. Returns whether all
 * could be written. */
bool import_write_joints(const struct robot *robot, const struct model_choice *choice, FILE *out);

extern const struct command import_command;

#endif
