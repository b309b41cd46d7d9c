/* What this folder offers. */
#ifndef REFDYN_TOOL_IMPORT_H
#define REFDYN_TOOL_IMPORT_H

#include <stdbool.h>
#include <stdio.h>

/*
 * Mass data of rigid bodies as plain numbers.
 *
 * The second moments of a body are the symmetric 4x4 matrix J = int p p^T dm of p = (x, y, z, 1): mass,
 * first moments and int r r^T dm in one. They add up, and there is a body with given J exactly where J has no
 * negative eigenvalue. Source: Wensing, Kim, Slotine (2018), Linear matrix inequalities for physically
 * consistent inertial parameter identification, eq. (8) to (12).
 */

struct pose;

/* A body: its centre [m] and, about it, xx yy zz xy xz yz [kg m^2], along the axes of one frame. */
struct body {
    double mass, center[3], inertia[6];
};

/* Rz(rpy[2]) Ry(rpy[1]) Rx(rpy[0]), by rows. */
void rotation_of_rpy(const double rpy[3], double R[9]);
/* Tensor xx yy zz xy xz yz along axes that R turns into those of the result. */
void inertia_turn(const double R[9], const double tensor[6], double turned[6]);

/* By rows. The mass of `body_of` has to be positive. */
void second_moments(const struct body *body, double J[16]);
struct body body_of(const double J[16]);

/* The largest s for which A - s B is that of a body; 0 where A itself is of none. B is that of a body. */
double second_moments_share(const double A[16], const double B[16]);

/* Makes a tensor that no body has the nearest one, in second moments, that a body has; true: it was none. */
bool inertia_mend(double inertia[6]);

/*
 * A robot as a URDF file tells it: links with mass data, and the joints between them.
 *
 * SI units and radians, the file's own numbers. Complaints go to stderr as FILE:LINE: WHAT: fact, what is
 * needed; reading ends at the first one. Warnings start their text with `warning: `.
 * Source: the format's pages for robot, link and joint (wiki.ros.org/urdf/XML); rotors as Drake's extension
 * <drake:rotor_inertia>, <drake:gear_ratio> has them.
 */

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
    int joint;          /* that carries it, -1: the root's */
    int first, sibling; /* the first link that it carries; the next one on its carrier; -1: none */
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
    struct pose pose;  /* of the child's frame in the parent's where the coordinate is 0 */
    double axis[3];    /* in the child's frame, of any length */
    double damping, friction;
    struct joint_limits limits;
    int leader; /* the joint that it mimics, -1: none; q = multiplier * q of leader + offset */
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

/* "FILE:LINE: " and the text; returns false. */
bool robot_complain(const struct robot *robot, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void robot_warn(const struct robot *robot, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Reads the file whole. False with a complaint. */
bool robot_read(struct robot *robot, const char *path);
/* Links and joints are one tree: sets joint, first, sibling, root and order. False with a complaint. */
bool robot_make_tree(struct robot *robot);
/* Warns of all elements and attributes that robot_read does not take. */
void robot_warn_of_rest(const struct robot *robot, const struct xml_element *root);

/* Where the coordinate of a joint that has one starts: 0, or the middle of its range where 0 is not in it;
 * where it follows another joint, what that makes of it. */
double robot_start(const struct robot *robot, const struct robot_joint *joint);
/* A joint with one coordinate. */
bool joint_is_single(const struct robot_joint *joint);
/* A joint with one coordinate that follows no other. */
bool joint_is_driven(const struct robot_joint *joint);
/* The place of that name, -1: none. */
int robot_find_link(const struct robot *robot, const char *name);
int robot_find_joint(const struct robot *robot, const char *name);

/*
 * A rigid link of a robot as a uniform beam and what the beam does not have of it.
 *
 * The beam runs from the origin of the link's frame to its tip. It takes as much of the link's mass as leaves
 * a body that can exist, less a hundredth of that, or what a given density says; the rest, a body with the
 * remaining mass, first and second moments, is fixed to the section that is nearest to its centre. So the
 * straight beam and the rest have the link's mass, centre and inertia.
 */

struct beam_choice {
    const char *section; /* as the model has it, "rd.round(0.05)" */
    double area, Iy, Iz; /* of it [m^2, m^4] */
    double E, nu, eta;   /* [Pa, 1, s] */
    double rho;          /* [kg/m^3] 0: from the link's mass */
    int rfe;             /* rigid finite elements */
    const double *tip;   /* (3) in the link's frame; NULL: the origin of its child joints */
};

struct flexible {
    int link;
    double tip[3], length;
    double psi, theta;   /* Rz(psi) Ry(theta) turns the link's x axis onto the beam */
    double direction[3]; /* of it in the link's frame */
    double rho;
    struct body rest; /* in the link's frame */
};

/* False with a complaint. */
bool flexible_make(const struct robot *robot, int link, const struct beam_choice *choice,
                   struct flexible *flexible);
/* How far along the beam the section lies that is nearest to a point of the link. */
double flexible_along(const struct flexible *flexible, const double point[3]);
/* A vector of the link's frame along the beam's axes. */
void flexible_turn_back(const struct flexible *flexible, const double vector[3], double turned[3]);

/*
 * Names of a URDF file as identifiers of Lua and C. A name that is one stays. In others each character that
 * may not be there becomes _, a lead is set before what is still none, and the number of the entry in the
 * file behind what is taken: the same file has the same names always.
 */

/* Of `count` names that differ; `lead`: "link". */
const char **identifiers_make(const char *const *names, int count, const char *lead);
/* The name of a model, which is that of its files, too. */
const char *identifiers_model(const char *name);

/*
 * Numbers that were computed from those of a file, as a person would write them: what is rounding beside a
 * scale becomes 0, and a last digit or two that are rounding go: within 1e-15 of its value each.
 */

/* `scale` 0: no number becomes 0. */
void tidy(double *list, int count, double scale);

/*
 * A robot as a Lua model that a person would write: see models/README.md.
 */

struct model_choice {
    const char *source;    /* name of the file that the robot is from */
    bool is_floating;      /* the root moves freely */
    bool has_drives;       /* an input at each joint with one coordinate that follows no other */
    double friction_width; /* rate over which dry friction turns its sign; 0: friction is left out */
    const struct beam_choice *beam;
    const struct flexible *flexible; /* (flexible_count) links that are beams */
    int flexible_count;
};

void write_model(const struct robot *robot, const struct model_choice *choice, FILE *out);

extern const struct command import_command;

#endif
