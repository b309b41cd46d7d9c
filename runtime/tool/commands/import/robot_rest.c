/* Warns of elements and attributes of a URDF file that a model does not have: one warning for each kind, with
 * the line of the first one and their number. */
#include "runtime/tool/commands/import/import.h"
#include "gen/base/base.h"
#include "runtime/tool/support/xml/xml.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>
#include <stdio.h>
#include <stdarg.h>

void import_robot_warn(const struct robot *robot, int line, const char *format, ...) {
    va_list list;
    va_start(list, format);
    format_complain_line(robot->path, line, format_text("warning: %s", format_vtext(format, list)));
    va_end(list);
}

/* What robot_read.c reads: elements by their parents, and their attributes. */
static const struct taken {
    const char *element, *children, *attributes;
} taken[] = {
    {"robot", "link joint transmission", "name version"},
    {"link", "inertial", "name"},
    {"inertial", "origin mass inertia", ""},
    {"origin", "", "xyz rpy"},
    {"mass", "", "value"},
    {"inertia", "", "ixx ixy ixz iyy iyz izz"},
    {"joint", "origin parent child axis dynamics limit mimic", "name type"},
    {"parent", "", "link"},
    {"child", "", "link"},
    {"axis", "", "xyz"},
    {"dynamics", "", "damping friction"},
    {"limit", "", "lower upper velocity effort"},
    {"mimic", "", "joint multiplier offset"},
    {"type", "", ""},
    {"transmission", "type joint actuator", "name"},
    {"actuator", "drake:rotor_inertia drake:gear_ratio", "name"},
    {"drake:rotor_inertia", "", "value"},
    {"drake:gear_ratio", "", "value"},
};

static const struct {
    const char *element, *why;
} reasons[] = {
    {"visual", "shapes do not enter the dynamics"},
    {"collision", "shapes do not enter the dynamics"},
    {"material", "looks do not enter the dynamics"},
    {"transmission", "only rotors as <drake:rotor_inertia> are read"},
    {"gazebo", "it is for Gazebo"},
    {"safety_controller", "controllers are written in Lua"},
    {"calibration", "coordinates keep the joint's zero"},
};

enum { KINDS_MOST = 40 };

/* Elements, or attributes, of one name in elements of one name. */
struct kind {
    const char *owner, *name;
    bool is_attribute;
    int line, count, meshes;
};

struct rest {
    struct kind kinds[KINDS_MOST];
    int count, more; /* known kinds, and the number of all others */
};

static bool is_word_of(const char *name, const char *list) {
    const size_t length = strlen(name);
    for (const char *at = list; *at && length > 0; at += strspn(at, " ")) {
        const size_t word = strcspn(at, " ");
        if (word == length && strncmp(at, name, word) == 0)
            return true;
        at += word;
    }
    return false;
}

static const struct taken *find_taken(const char *element) {
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        if (strcmp(taken[i].element, element) == 0)
            return &taken[i];
    return NULL;
}

static void count(struct rest *rest, const struct kind *kind) {
    for (int i = 0; i < rest->count; i++) {
        struct kind *known = &rest->kinds[i];
        if (known->is_attribute == kind->is_attribute && strcmp(known->name, kind->name) == 0 &&
            strcmp(known->owner, kind->owner) == 0) {
            known->count++;
            known->meshes += kind->meshes;
            return;
        }
    }
    if (rest->count < KINDS_MOST)
        rest->kinds[rest->count++] = *kind;
    else
        rest->more++;
}

static bool is_taken(const struct xml_element *element) {
    const struct taken *owner = find_taken(element->parent->name);
    return owner && is_word_of(element->name, owner->children) &&
           (strcmp(element->name, "transmission") != 0 || xml_count(element, "drake:rotor_inertia") > 0);
}

static void count_attributes(struct rest *rest, const struct xml_element *element) {
    const struct taken *known = find_taken(element->name);
    for (const struct xml_attribute *at = element->attributes; known && at->name; at++) {
        const bool is_of_xml =
            strncmp(at->name, "xmlns", strlen("xmlns")) == 0 || strncmp(at->name, "xml:", 4) == 0;
        if (!is_of_xml && !is_word_of(at->name, known->attributes))
            count(rest, &(struct kind){element->name, at->name, true, element->line, 1, 0});
    }
}

/* The contents of an unknown element are not examined. */
static void count_in(struct rest *rest, const struct xml_element *root) {
    const struct xml_element *at = root;
    while (at) {
        const bool is_left_out = at != root && !is_taken(at);
        if (is_left_out)
            count(rest,
                  &(struct kind){at->parent->name, at->name, false, at->line, 1, xml_count(at, "mesh")});
        else
            count_attributes(rest, at);
        at = is_left_out ? xml_behind(at, root) : xml_next(at, root);
    }
}

static const char *reason_of(const char *element) {
    for (size_t i = 0; i < sizeof reasons / sizeof *reasons; i++)
        if (strcmp(reasons[i].element, element) == 0)
            return reasons[i].why;
    return "unknown";
}

static void warn_of_kind(const struct robot *robot, const struct kind *kind) {
    const char *meshes = kind->meshes ? format_text(" with %d meshes", kind->meshes) : "";
    if (kind->is_attribute)
        import_robot_warn(robot, kind->line, "<%s>: attribute %s, %d in all, left out: unknown", kind->owner,
                          kind->name, kind->count);
    else
        import_robot_warn(robot, kind->line, "<%s> in <%s>, %d in all%s, left out: %s", kind->name,
                          kind->owner, kind->count, meshes, reason_of(kind->name));
}

void import_robot_warn_of_rest(const struct robot *robot, const struct xml_element *root) {
    struct rest *rest = format_allocate(1, sizeof *rest);
    count_in(rest, root);
    for (int i = 0; i < rest->count; i++)
        warn_of_kind(robot, &rest->kinds[i]);
    if (rest->more > 0)
        import_robot_warn(robot, 0, "%d elements and attributes of other names are left out too", rest->more);
}
