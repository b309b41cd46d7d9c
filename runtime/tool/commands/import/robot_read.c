/*
 * Reads the elements of a URDF file into a struct robot, and builds the tree of its links from its joints.
 * robot_rest.c reports other elements; its table names those that are read here.
 *
 * Source: the format's pages for robot, link and joint (wiki.ros.org/urdf/XML); rotors as in Drake's
 * extensions <drake:rotor_inertia> and <drake:gear_ratio>.
 */
#include <math.h>
#include <stdarg.h>
#include <string.h>

#include "gen/base/base.h"
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/format/format.h"
#include "runtime/tool/support/xml/xml.h"

/* ---- The tree ---- */

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

/* Checks that links and joints are one tree; sets joint, first, sibling, root and order. */
static bool make_tree(struct robot *robot) {
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

/* ---- Messages, entries by name ---- */

bool import_robot_complain(const struct robot *robot, int line, const char *format, ...) {
    va_list list;
    va_start(list, format);
    format_complain_line(robot->path, line, format_vtext(format, list));
    va_end(list);
    return false;
}

bool import_joint_is_single(const struct robot_joint *joint) {
    return joint->kind == JOINT_REVOLUTE || joint->kind == JOINT_CONTINUOUS || joint->kind == JOINT_PRISMATIC;
}

bool import_joint_is_driven(const struct robot_joint *joint) {
    return import_joint_is_single(joint) && joint->leader < 0;
}

int import_robot_find_link(const struct robot *robot, const char *name) {
    for (int i = 0; i < robot->link_count; i++)
        if (strcmp(robot->links[i].name, name) == 0)
            return i;
    return -1;
}

static int find_joint(const struct robot *robot, const char *name) {
    for (int i = 0; i < robot->joint_count; i++)
        if (strcmp(robot->joints[i].name, name) == 0)
            return i;
    return -1;
}

/* ---- Reading ---- */

enum { COUNT_MOST = 10000 };

static const char xacro_advice[] = "run `xacro FILE > FILE.urdf` first";

/* An element, and the words by which messages call its owner. */
struct part {
    const struct robot *robot;
    const struct xml_element *element;
    const char *owner; /* "link arm" */
};

/* ---- attributes ---- */

/* Reads `count` numbers separated by blanks; `out` stays if the attribute is missing. */
static bool take_numbers(const struct part *part, const char *name, double *out, int count) {
    const char *given = xml_attribute(part->element, name);
    const char *where = format_text("%s: <%s>: %s", part->owner, part->element->name, name);
    const int line = part->element->line;
    if (!given)
        return true;
    char *rest = format_text("%s", given), *word;
    int found = 0;
    static const double largest = 1e100; /* so that products of the numbers stay finite */
    while ((word = strtok_r(rest, " \t\r\n", &rest))) {
        double number;
        if (strstr(given, "${"))
            return import_robot_complain(part->robot, line, "%s: '%s' belongs to xacro; %s", where, given,
                                         xacro_advice);
        if (!text_to_number(word, &number) || fabs(number) > largest)
            return import_robot_complain(part->robot, line, "%s: '%s' is not a number up to 1e100%s", where,
                                         word, strchr(word, ',') ? "; write blanks between numbers" : "");
        if (found++ < count)
            out[found - 1] = number;
    }
    return found == count || import_robot_complain(part->robot, line, "%s: '%s' has %d numbers; must have %d",
                                                   where, given, found, count);
}

static bool need_attribute(const struct part *part, const char *name) {
    return xml_attribute(part->element, name) ||
           import_robot_complain(part->robot, part->element->line, "%s: <%s> has no %s; add it", part->owner,
                                 part->element->name, name);
}

static bool take_number(const struct part *part, const char *name, double *out) {
    return take_numbers(part, name, out, 1);
}

static bool need_number(const struct part *part, const char *name, double *out) {
    return need_attribute(part, name) && take_number(part, name, out);
}

static bool need_not_negative(const struct part *part, const char *name, double value) {
    return value >= 0 ||
           import_robot_complain(part->robot, part->element->line, "%s: <%s>: %s is %g; must be at least 0",
                                 part->owner, part->element->name, name, value);
}

/* Finds the child of that name; its element is NULL if there is none. */
static bool take_child(const struct part *part, const char *name, struct part *child) {
    *child = (struct part){part->robot, xml_child(part->element, name), part->owner};
    for (const struct xml_element *at = child->element ? child->element->next : NULL; at; at = at->next)
        if (strcmp(at->name, name) == 0)
            return import_robot_complain(part->robot, at->line, "%s: a second <%s>; the first is in line %d",
                                         part->owner, name, child->element->line);
    return true;
}

static bool need_child(const struct part *part, const char *name, struct part *child) {
    return take_child(part, name, child) &&
           (child->element ||
            import_robot_complain(part->robot, part->element->line, "%s: <%s> has no <%s>; add it",
                                  part->owner, part->element->name, name));
}

static bool take_pose(const struct part *part, struct pose *pose) {
    struct part origin;
    if (!take_child(part, "origin", &origin))
        return false;
    return !origin.element ||
           (take_numbers(&origin, "xyz", pose->xyz, 3) && take_numbers(&origin, "rpy", pose->rpy, 3));
}

/* ---- links ---- */

static bool take_inertia(const struct part *part, double inertia[6]) {
    static const char *const names[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
    for (int i = 0; i < 6; i++)
        if (!need_number(part, names[i], &inertia[i]))
            return false;
    return true;
}

static bool take_mass(const struct part *inertial, struct robot_link *link) {
    struct part mass, inertia;
    if (!need_child(inertial, "mass", &mass) || !need_child(inertial, "inertia", &inertia) ||
        !need_number(&mass, "value", &link->mass) || !need_not_negative(&mass, "value", link->mass) ||
        !take_inertia(&inertia, link->inertia))
        return false;
    const double *I = link->inertia;
    link->has_mass = link->mass > 0;
    if (!link->has_mass && (I[0] != 0 || I[1] != 0 || I[2] != 0))
        import_robot_warn(inertial->robot, mass.element->line, "%s: an inertia without mass is left out",
                          inertial->owner);
    return true;
}

static bool take_link(struct robot *robot, const struct xml_element *element) {
    struct robot_link *link = &robot->links[robot->link_count];
    struct part part = {robot, element, "link"}, inertial;
    if (!need_attribute(&part, "name"))
        return false;
    *link = (struct robot_link){.name = xml_attribute(element, "name"), .line = element->line};
    part.owner = format_text("link %s", link->name);
    const int same = import_robot_find_link(robot, link->name);
    if (!*link->name)
        return import_robot_complain(robot, element->line, "link: its name is empty; each link needs one");
    if (same >= 0)
        return import_robot_complain(robot, element->line,
                                     "%s: line %d has the same name; each link must have its own", part.owner,
                                     robot->links[same].line);
    robot->link_count++;
    if (!take_child(&part, "inertial", &inertial))
        return false;
    return !inertial.element || (take_pose(&inertial, &link->pose) && take_mass(&inertial, link));
}

/* ---- joints ---- */

static const char *const kind_names[] = {"fixed",  "revolute", "continuous", "prismatic",
                                         "planar", "floating", NULL};

static bool take_kind(const struct part *part, enum joint_kind *kind) {
    if (!need_attribute(part, "type"))
        return false;
    const char *given = xml_attribute(part->element, "type");
    const int place = text_index(given, kind_names, sizeof kind_names / sizeof *kind_names - 1);
    *kind = (enum joint_kind)place;
    return place >= 0 || import_robot_complain(
                             part->robot, part->element->line,
                             "%s: type '%s' is not one of fixed, revolute, continuous, prismatic, planar, "
                             "floating%s",
                             part->owner, given,
                             message_nearest_advice(&format_memory, given, kind_names,
                                                    sizeof kind_names / sizeof *kind_names - 1));
}

static bool complain_of_link(const struct part *part, const char *name) {
    const struct robot *robot = part->robot;
    const char **known = format_allocate((size_t)robot->link_count + 1, sizeof *known);
    for (int i = 0; i < robot->link_count; i++)
        known[i] = robot->links[i].name;
    return import_robot_complain(robot, part->element->line, "%s: <%s>: there is no link '%s'%s", part->owner,
                                 part->element->name, name,
                                 message_nearest_advice(&format_memory, name, known, robot->link_count));
}

static bool take_end(const struct part *part, const char *name, int *link) {
    struct part end;
    if (!need_child(part, name, &end) || !need_attribute(&end, "link"))
        return false;
    const char *given = xml_attribute(end.element, "link");
    *link = import_robot_find_link(part->robot, given);
    return *link >= 0 || complain_of_link(&end, given);
}

static bool has_axis(enum joint_kind kind) {
    return kind != JOINT_FIXED && kind != JOINT_FLOATING;
}

static bool take_axis(const struct part *part, struct robot_joint *joint) {
    struct part axis;
    joint->axis[0] = 1; /* default of the format */
    if (!has_axis(joint->kind) || !take_child(part, "axis", &axis))
        return !has_axis(joint->kind);
    if (axis.element && !take_numbers(&axis, "xyz", joint->axis, 3))
        return false;
    const double length = hypot(hypot(joint->axis[0], joint->axis[1]), joint->axis[2]);
    return (length > 1e-100 && length < 1e100) ||
           import_robot_complain(part->robot, axis.element->line,
                                 "%s: <axis>: xyz has length %g; must be a direction", part->owner, length);
}

static bool take_dynamics(const struct part *part, struct robot_joint *joint) {
    struct part dynamics;
    if (!take_child(part, "dynamics", &dynamics))
        return false;
    return !dynamics.element || (take_number(&dynamics, "damping", &joint->damping) &&
                                 take_number(&dynamics, "friction", &joint->friction) &&
                                 need_not_negative(&dynamics, "damping", joint->damping) &&
                                 need_not_negative(&dynamics, "friction", joint->friction));
}

/* A continuous joint has no range. An effort or a rate of 0 means that it is unknown. */
static bool take_limits(const struct part *part, struct robot_joint *joint) {
    struct part limit;
    struct joint_limits *limits = &joint->limits;
    if (!take_child(part, "limit", &limit))
        return false;
    if (!limit.element)
        return true;
    if (!take_number(&limit, "lower", &limits->from) || !take_number(&limit, "upper", &limits->to) ||
        !take_number(&limit, "velocity", &limits->rate) || !take_number(&limit, "effort", &limits->force) ||
        !need_not_negative(&limit, "velocity", limits->rate) ||
        !need_not_negative(&limit, "effort", limits->force))
        return false;
    limits->has_range = joint->kind != JOINT_CONTINUOUS &&
                        (xml_attribute(limit.element, "lower") || xml_attribute(limit.element, "upper"));
    if (limits->has_range && limits->from == limits->to) {
        import_robot_warn(part->robot, limit.element->line,
                          "%s: <limit>: lower and upper are both %g; the range is left out", part->owner,
                          limits->from);
        limits->has_range = false;
    }
    limits->has_rate = limits->rate > 0;
    limits->has_force = limits->force > 0;
    return limits->from <= limits->to ||
           import_robot_complain(part->robot, limit.element->line, "%s: <limit>: lower %g is above upper %g",
                                 part->owner, limits->from, limits->to);
}

/* <origin> and <axis> define the child's frame. */
static bool take_joint(struct robot *robot, const struct xml_element *element) {
    struct robot_joint *joint = &robot->joints[robot->joint_count];
    struct part part = {robot, element, "joint"};
    if (!need_attribute(&part, "name"))
        return false;
    *joint =
        (struct robot_joint){.name = xml_attribute(element, "name"), .line = element->line, .leader = -1};
    part.owner = format_text("joint %s", joint->name);
    const int same = find_joint(robot, joint->name);
    if (same >= 0)
        return import_robot_complain(robot, element->line,
                                     "%s: line %d has the same name; each joint must have its own",
                                     part.owner, robot->joints[same].line);
    robot->joint_count++;
    return take_kind(&part, &joint->kind) && take_end(&part, "parent", &joint->parent) &&
           take_end(&part, "child", &joint->child) && take_pose(&part, &joint->pose) &&
           take_axis(&part, joint) && take_dynamics(&part, joint) && take_limits(&part, joint);
}

/* ---- Elements that name other joints: rows between them, rotors ---- */

static bool find_single(const struct part *part, const char *name, int *found) {
    *found = find_joint(part->robot, name);
    if (*found < 0)
        return import_robot_complain(part->robot, part->element->line, "%s: <%s>: there is no joint '%s'",
                                     part->owner, part->element->name, name);
    return import_joint_is_single(&part->robot->joints[*found]) ||
           import_robot_complain(part->robot, part->element->line,
                                 "%s: <%s>: joint %s is %s; must have one coordinate", part->owner,
                                 part->element->name, name, kind_names[part->robot->joints[*found].kind]);
}

static bool take_mimic(struct robot *robot, struct robot_joint *joint, const struct xml_element *element) {
    const struct part part = {robot, element, format_text("joint %s", joint->name)};
    struct part mimic;
    if (!take_child(&part, "mimic", &mimic) || !mimic.element)
        return !mimic.element;
    joint->multiplier = 1;
    if (joint->kind == JOINT_FIXED) {
        import_robot_warn(robot, mimic.element->line,
                          "%s: <mimic>: a fixed joint cannot follow another; left out", part.owner);
        return true;
    }
    if (!import_joint_is_single(joint))
        return import_robot_complain(robot, mimic.element->line,
                                     "%s: <mimic>: it is %s; must have one coordinate", part.owner,
                                     kind_names[joint->kind]);
    if (!need_attribute(&mimic, "joint") ||
        !find_single(&mimic, xml_attribute(mimic.element, "joint"), &joint->leader) ||
        !take_number(&mimic, "multiplier", &joint->multiplier) ||
        !take_number(&mimic, "offset", &joint->offset))
        return false;
    int leader = joint->leader;
    for (int i = 0; i < robot->joint_count && leader >= 0 && &robot->joints[leader] != joint; i++)
        leader = robot->joints[leader].leader;
    return leader < 0 || import_robot_complain(robot, mimic.element->line,
                                               "%s: <mimic>: it follows itself; name a joint that "
                                               "does not follow this one",
                                               part.owner);
}

static bool take_drake_number(const struct part *actuator, const char *name, double *value) {
    struct part element;
    if (!take_child(actuator, name, &element))
        return false;
    return !element.element ||
           (need_number(&element, "value", value) && need_not_negative(&element, "value", *value));
}

/* <transmission><joint name><actuator><drake:rotor_inertia value><drake:gear_ratio value> */
static bool take_rotor(struct robot *robot, const struct xml_element *element) {
    const struct part part = {robot, element, "transmission"};
    struct part actuator, named;
    double inertia = 0, gear = 1;
    int place;
    if (xml_count(element, "drake:rotor_inertia") == 0)
        return true;
    if (!take_child(&part, "actuator", &actuator) || !actuator.element)
        return !actuator.element;
    if (!take_drake_number(&actuator, "drake:rotor_inertia", &inertia) ||
        !take_drake_number(&actuator, "drake:gear_ratio", &gear))
        return false;
    if (inertia == 0)
        return true;
    if (!need_child(&part, "joint", &named) || !need_attribute(&named, "name") ||
        !find_single(&named, xml_attribute(named.element, "name"), &place))
        return false;
    struct robot_joint *joint = &robot->joints[place];
    if (joint->rotor_inertia > 0)
        return import_robot_complain(robot, element->line, "joint %s: a second rotor; a joint has one",
                                     joint->name);
    joint->rotor_inertia = inertia;
    joint->gear = gear;
    return true;
}

/* ---- the file ---- */

static bool take_each(struct robot *robot, const struct xml_element *root, const char *name, int *count,
                      bool take(struct robot *robot, const struct xml_element *element)) {
    for (const struct xml_element *at = root->first; at; at = at->next)
        if (strcmp(at->name, name) == 0 && (++*count > COUNT_MOST || !take(robot, at)))
            return *count > COUNT_MOST &&
                   import_robot_complain(robot, at->line, "robot: more than %d <%s>", COUNT_MOST, name);
    return true;
}

static bool take_mimics(struct robot *robot, const struct xml_element *root) {
    int i = 0;
    for (const struct xml_element *at = root->first; at; at = at->next)
        if (strcmp(at->name, "joint") == 0 && !take_mimic(robot, &robot->joints[i++], at))
            return false;
    return true;
}

static bool refuse_macros(const struct robot *robot, const struct xml_element *root) {
    for (const struct xml_element *at = root; at; at = xml_next(at, root))
        if (strncmp(at->name, "xacro:", strlen("xacro:")) == 0)
            return import_robot_complain(robot, at->line, "xacro: <%s> is a macro; %s", at->name,
                                         xacro_advice);
    return true;
}

bool import_robot_read(struct robot *robot, const char *path) {
    *robot = (struct robot){.path = path};
    if (text_ends_with(path, ".xacro"))
        return import_robot_complain(robot, 0, "xacro: a file of macros; %s", xacro_advice);
    const struct xml_element *root = xml_read(path);
    if (!root)
        return false;
    int links = 0, joints = 0, transmissions = 0;
    robot->line = root->line;
    if (strcmp(root->name, "robot") != 0)
        return import_robot_complain(robot, root->line,
                                     "robot: the outermost element is <%s>; must be <robot>", root->name);
    if (!refuse_macros(robot, root))
        return false;
    const struct part part = {robot, root, "robot"};
    if (!need_attribute(&part, "name"))
        return false;
    robot->name = xml_attribute(root, "name");
    robot->links = format_allocate(COUNT_MOST, sizeof *robot->links);
    robot->joints = format_allocate(COUNT_MOST, sizeof *robot->joints);
    if (!take_each(robot, root, "link", &links, take_link) ||
        !take_each(robot, root, "joint", &joints, take_joint) || !take_mimics(robot, root) ||
        !take_each(robot, root, "transmission", &transmissions, take_rotor))
        return false;
    if (links == 0)
        return import_robot_complain(robot, root->line, "robot: it has no <link>; add at least one");
    import_robot_warn_of_rest(robot, root);
    return make_tree(robot);
}
