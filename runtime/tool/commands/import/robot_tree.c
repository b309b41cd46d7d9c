/* Builds the tree of a robot's links from its joints. */
#include "runtime/tool/commands/import/import.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>

static bool complain_of_roots(const struct robot *robot, int a, int b) {
    return import_robot_complain(
        robot, robot->links[b].line,
        "link %s: no joint carries it, nor link %s in line %d; there must be one root", robot->links[b].name,
        robot->links[a].name, robot->links[a].line);
}

static bool set_carriers(struct robot *robot) {
    for (int i = 0; i < robot->link_count; i++)
        robot->links[i].joint = robot->links[i].first = robot->links[i].sibling = -1;
    for (int i = 0; i < robot->joint_count; i++) {
        struct robot_link *child = &robot->links[robot->joints[i].child];
        if (child->joint >= 0)
            return import_robot_complain(
                robot, robot->joints[i].line,
                "joint %s: link %s is carried by joint %s already, which closes a loop: a "
                "URDF is a tree",
                robot->joints[i].name, child->name, robot->joints[child->joint].name);
        child->joint = i;
    }
    return true;
}

static bool find_root(struct robot *robot) {
    robot->root = -1;
    for (int i = 0; i < robot->link_count; i++) {
        if (robot->links[i].joint >= 0)
            continue;
        if (robot->root >= 0)
            return complain_of_roots(robot, robot->root, i);
        robot->root = i;
    }
    return robot->root >= 0 ||
           import_robot_complain(robot, robot->line,
                                 "robot: a joint carries each link; there must be a root");
}

/* Builds the lists of what each link carries, in the order of the joints. */
static void list_children(struct robot *robot) {
    for (int i = robot->joint_count - 1; i >= 0; i--) {
        struct robot_link *parent = &robot->links[robot->joints[i].parent];
        robot->links[robot->joints[i].child].sibling = parent->first;
        parent->first = robot->joints[i].child;
    }
}

/* The link after `at` in the tree, children first; -1 at the end. */
static int next_link(const struct robot *robot, int at) {
    if (robot->links[at].first >= 0)
        return robot->links[at].first;
    while (at != robot->root && robot->links[at].sibling < 0)
        at = robot->joints[robot->links[at].joint].parent;
    return at == robot->root ? -1 : robot->links[at].sibling;
}

/* A link that cannot be reached from the root is on a loop, or is carried by one. */
static bool complain_of_loop(const struct robot *robot, const bool *is_passed) {
    int at = 0;
    while (is_passed[at])
        at++;
    for (int i = 0; i < robot->link_count; i++)
        at = robot->joints[robot->links[at].joint].parent;
    return import_robot_complain(robot, robot->links[at].line,
                                 "link %s: carries itself in a loop of joints, a URDF is a tree",
                                 robot->links[at].name);
}

/* 0, or the middle of the range if 0 is outside; the middle to six digits if these are within the range. */
static double start_within(const struct joint_limits *limits) {
    double middle = limits->from / 2 + limits->to / 2, near;
    if (!limits->has_range || (limits->from <= 0 && limits->to >= 0))
        return 0;
    const bool is_near =
        text_to_number(format_text("%.6g", middle), &near) && near >= limits->from && near <= limits->to;
    return is_near ? near : middle;
}

double import_robot_start(const struct robot *robot, const struct robot_joint *joint) {
    double offset = 0, multiplier = 1;
    while (joint->leader >= 0) {
        offset += multiplier * joint->offset;
        multiplier *= joint->multiplier;
        joint = &robot->joints[joint->leader];
    }
    return offset + multiplier * start_within(&joint->limits);
}

static bool check_starts(const struct robot *robot) {
    for (int i = 0; i < robot->joint_count; i++)
        if (!isfinite(import_robot_start(robot, &robot->joints[i])))
            return import_robot_complain(robot, robot->joints[i].line,
                                         "joint %s: the joint that it follows gives it an infinite value",
                                         robot->joints[i].name);
    return true;
}

bool import_robot_make_tree(struct robot *robot) {
    if (!set_carriers(robot) || !find_root(robot))
        return false;
    list_children(robot);
    bool *is_passed = format_allocate((size_t)robot->link_count, sizeof *is_passed);
    robot->order = format_allocate((size_t)robot->link_count, sizeof *robot->order);
    int count = 0;
    for (int at = robot->root; at >= 0; at = next_link(robot, at)) {
        is_passed[at] = true;
        robot->order[count++] = at;
    }
    return count == robot->link_count ? check_starts(robot) : complain_of_loop(robot, is_passed);
}
