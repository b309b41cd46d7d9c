/*
 * A robot as a URDF file tells it: links with mass data, and the joints between them.
 *
 * SI units and radians, the file's own numbers. Complaints go to stderr as FILE:LINE: WHAT: fact, what is
 * needed; reading ends at the first one. Warnings start their text with `warning: `.
 * Source: the format's pages for robot, link and joint (wiki.ros.org/urdf/XML); rotors as Drake's extension
 * <drake:rotor_inertia>, <drake:gear_ratio> has them.
 */
#ifndef REFDYN_TOOL_ROBOT_H
#define REFDYN_TOOL_ROBOT_H

#include <stdbool.h>

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

#endif
