/* Messages about a robot's file, and its entries by name: see import.h. */
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/format/format.h"

#include <stdarg.h>
#include <string.h>

bool robot_complain(const struct robot *robot, int line, const char *format, ...) {
    va_list list;
    va_start(list, format);
    complain_line(robot->path, line, text_vformat(format, list));
    va_end(list);
    return false;
}

void robot_warn(const struct robot *robot, int line, const char *format, ...) {
    va_list list;
    va_start(list, format);
    complain_line(robot->path, line, text_format("warning: %s", text_vformat(format, list)));
    va_end(list);
}

bool joint_is_single(const struct robot_joint *joint) {
    return joint->kind == JOINT_REVOLUTE || joint->kind == JOINT_CONTINUOUS || joint->kind == JOINT_PRISMATIC;
}

bool joint_is_driven(const struct robot_joint *joint) {
    return joint_is_single(joint) && joint->leader < 0;
}

int robot_find_link(const struct robot *robot, const char *name) {
    for (int i = 0; i < robot->link_count; i++)
        if (strcmp(robot->links[i].name, name) == 0)
            return i;
    return -1;
}

int robot_find_joint(const struct robot *robot, const char *name) {
    for (int i = 0; i < robot->joint_count; i++)
        if (strcmp(robot->joints[i].name, name) == 0)
            return i;
    return -1;
}
