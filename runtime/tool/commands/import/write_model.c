/* Writes a robot as a Lua model. Links come in the order of the tree, each with its joint. */
#include "runtime/tool/commands/import/import.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 120 };

struct writer {
    const struct robot *robot;
    const struct model_choice *choice;
    FILE *out;
    const char **names; /* (link_count) of the links */
    int column;         /* column in the present line */
    int indent;         /* indent of continuation lines */
    bool is_first;      /* the next item is the first one of a list */
};

/* ---- numbers and fields ---- */

/* "7e10" if it has exactly that value. */
static const char *number(double value) {
    char text[NUMBER_LENGTH];
    double same;
    snprintf(text, sizeof text, "%g", value);
    const char *plus = strstr(text, "e+");
    if (plus && text_to_number(text, &same) && same == value)
        return format_text("%.*se%d", (int)(plus - text), text, atoi(plus + 2));
    return format_text("%s", exact_text(value, text));
}

/* rd.pi as a quotient that has the same value to the last bit; otherwise the number. */
static const char *angle(double value) {
    static const double pi = 3.14159265358979323846;
    static const int parts[] = {1, 2, 3, 4, 6};
    const char *sign = value < 0 ? "-" : "";
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (fabs(value) == pi / parts[i])
            return parts[i] == 1 ? format_text("%srd.pi", sign) : format_text("%srd.pi / %d", sign, parts[i]);
    return number(value);
}

static const char *vector(const double v[3]) {
    return format_text("{ %s, %s, %s }", number(v[0]), number(v[1]), number(v[2]));
}

static const char *computed(double value) {
    import_tidy(&value, 1, 0);
    return number(value);
}

static bool is_zero(const double v[3]) {
    return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

/* Adds an item to an entry or a list, on the next line if this one is full. */
static void put(struct writer *w, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void put(struct writer *w, const char *format, ...) {
    va_list list;
    va_start(list, format);
    const char *text = format_vtext(format, list), *comma = w->is_first ? "" : ",";
    va_end(list);
    const int length = (int)(strlen(comma) + 1 + strlen(text));
    const bool is_full = w->column + length > WIDTH;
    w->column = (is_full ? w->indent : w->column) + length;
    fprintf(w->out, "%s%s%*s %s", comma, is_full ? "\n" : "", is_full ? w->indent : 0, "", text);
    w->is_first = false;
}

/* Begins a new line. */
static void break_line(struct writer *w) {
    w->column = WIDTH;
}

static void open_list(struct writer *w, const char *name) {
    w->column = fprintf(w->out, "  %s = {", name);
    w->indent = 3;
    w->is_first = true;
}

static void open_entry(struct writer *w, const char *name) {
    w->column = fprintf(w->out, "    { \"%s\"", name);
    w->indent = 5;
    w->is_first = false;
}

static void close_entry(struct writer *w) {
    fputs(" },\n", w->out);
}

/* A name from `lead` and `end` that no link has. */
static const char *helper_name(const struct writer *w, const char *lead, const char *end) {
    const char *name = format_text("%s_%s", lead, end);
    for (int i = 2; text_index(name, w->names, w->robot->link_count) >= 0; i++)
        name = format_text("%s_%s_%d", lead, end, i);
    return name;
}

/* ---- placement ---- */

static const struct flexible *flexible_of(const struct writer *w, int link) {
    for (int i = 0; i < w->choice->flexible_count; i++)
        if (w->choice->flexible[i].link == link)
            return &w->choice->flexible[i];
    return NULL;
}

static void add_turn(struct text *turns, const char *axis, double by) {
    if (by != 0)
        text_add(turns, "%s{ \"%s\", %s }", turns->length ? ", " : "", axis, angle(by));
}

static void put_turns(struct writer *w, const struct text *turns) {
    if (turns->length)
        put(w, "turn = { %s }", turns->data);
}

/* Rz Ry Rx; turns by 0 are left out. */
static void add_rpy(struct text *turns, const double rpy[3]) {
    add_turn(turns, "z", rpy[2]);
    add_turn(turns, "y", rpy[1]);
    add_turn(turns, "x", rpy[0]);
}

static const char *beam_name(const struct writer *w, int link) {
    return helper_name(w, w->names[link], "beam");
}

/* A frame that is fixed to a section of the beam, given in the link's frame. */
static void put_place_on_beam(struct writer *w, const struct flexible *beam, const struct pose *pose,
                              struct text *turns) {
    const double along = import_flexible_along(beam, pose->xyz);
    const bool is_tip = along == beam->length;
    double offset[3], at[3];
    for (int i = 0; i < 3; i++)
        offset[i] = pose->xyz[i] - (is_tip ? beam->tip[i] : along * beam->direction[i]);
    put(w, "on = \"%s%s\"", beam_name(w, beam->link), is_tip ? ".tip" : "");
    if (!is_tip)
        put(w, "along = %s", computed(along));
    import_flexible_turn_back(beam, offset, at);
    import_tidy(at, 3, beam->length);
    if (!is_zero(at))
        put(w, "at = %s", vector(at));
    add_turn(turns, "y", -beam->theta);
    add_turn(turns, "z", -beam->psi);
}

/* A frame on a link, with turns about its z and its y axis. */
static void put_place(struct writer *w, int carrier, const struct pose *pose, double psi, double theta) {
    const struct flexible *beam = flexible_of(w, carrier);
    struct text turns = {.memory = &format_memory};
    if (beam) {
        put_place_on_beam(w, beam, pose, &turns);
    } else {
        put(w, "on = \"%s\"", w->names[carrier]);
        if (!is_zero(pose->xyz))
            put(w, "at = %s", vector(pose->xyz));
    }
    add_rpy(&turns, pose->rpy);
    add_turn(&turns, "z", psi);
    add_turn(&turns, "y", theta);
    put_turns(w, &turns);
}

/* ---- joints ---- */

/* Number of the axis that is nearest to the joint's axis. */
static int nearest_axis(const struct robot_joint *joint) {
    const double x = fabs(joint->axis[0]), y = fabs(joint->axis[1]), z = fabs(joint->axis[2]);
    return x > y && x > z ? 0 : y > z ? 1 : 2;
}

static bool is_positive_axis(const struct robot_joint *joint) {
    const int i = nearest_axis(joint);
    return joint->axis[i] > 0 && joint->axis[(i + 1) % 3] == 0 && joint->axis[(i + 2) % 3] == 0;
}

static const char *letter(const struct robot_joint *joint) {
    static const char *const turns[] = {"phi", "theta", "psi"}, *const slides[] = {"x", "y", "z"};
    return (joint->kind == JOINT_PRISMATIC ? slides : turns)[nearest_axis(joint)];
}

/* Returns whether a link has a coordinate, or a point of its name a column, of this name. */
static bool is_of_link(const struct writer *w, const char *name) {
    static const char *const ends[] = {"x",   "y",   "z",   "xd",  "yd",  "zd",
                                       "xdd", "ydd", "zdd", "phi", "psi", "theta"};
    const char *end = strrchr(name, '_');
    if (!end || text_index(end + 1, ends, sizeof ends / sizeof *ends) < 0)
        return false;
    return text_index(format_text("%.*s", (int)(end - name), name), w->names, w->robot->link_count) >= 0;
}

/* Names that end in _d belong to rates, and t is the time. */
static bool has_own_name(const struct writer *w, const struct robot_joint *joint) {
    return w->choice->has_joint_names && import_identifiers_is_free(joint->name) &&
           !text_ends_with(joint->name, "_d") && strcmp(joint->name, "t") != 0 && !is_of_link(w, joint->name);
}

/* The name of the coordinate of a joint with one coordinate. */
static const char *coordinate(const struct writer *w, const struct robot_joint *joint) {
    return has_own_name(w, joint) ? joint->name : format_text("%s_%s", w->names[joint->child], letter(joint));
}

static void put_limits(struct writer *w, const struct robot_joint *joint) {
    const struct joint_limits *limits = &joint->limits;
    struct text text = {.memory = &format_memory};
    if (limits->has_range)
        text_add(&text, "from = %s, to = %s", angle(limits->from), angle(limits->to));
    if (limits->has_rate)
        text_add(&text, "%srate = %s", text.length ? ", " : "", angle(limits->rate));
    if (limits->has_force)
        text_add(&text, "%sforce = %s", text.length ? ", " : "", number(limits->force));
    if (text.length)
        put(w, "limits = { %s = { %s } }", letter(joint), text.data);
}

static void put_single(struct writer *w, const struct robot_joint *joint) {
    const char *name = letter(joint);
    const double start = import_robot_start(w->robot, joint);
    put(w, "joint = \"%s\"", name);
    if (!is_positive_axis(joint))
        put(w, "axis = %s", vector(joint->axis));
    if (has_own_name(w, joint))
        put(w, "coordinate = \"%s\"", joint->name);
    if (start != 0)
        put(w, "start = { %s = %s }", name, angle(start));
    if (joint->damping > 0)
        put(w, "damper = { %s = %s }", name, number(joint->damping));
    put_limits(w, joint);
    if (joint->rotor_inertia > 0)
        put(w, "rotor = { %s = { inertia = %s, gear = %s } }", name, number(joint->rotor_inertia),
            number(joint->gear));
}

static const char *const planar_names[] = {"y, z, phi", "z, x, theta", "x, y, psi"};

/* Slides in the plane whose normal is the axis, and a turn about it. */
static void put_planar(struct writer *w, const struct robot_joint *joint) {
    put(w, "joint = \"%s\"", planar_names[nearest_axis(joint)]);
}

/* If the normal of the plane is no coordinate axis, a frame whose z axis is the normal precedes the link. */
static void write_plane(struct writer *w, const struct robot_joint *joint) {
    const char *plane = helper_name(w, w->names[joint->child], "plane");
    const double psi = atan2(joint->axis[1], joint->axis[0]),
                 theta = atan2(hypot(joint->axis[0], joint->axis[1]), joint->axis[2]);
    struct text back = {.memory = &format_memory};
    open_entry(w, plane);
    put_place(w, joint->parent, &joint->pose, psi, theta);
    put(w, "joint = \"x, y, psi\"");
    close_entry(w);
    open_entry(w, w->names[joint->child]);
    put(w, "on = \"%s\"", plane);
    add_turn(&back, "y", -theta);
    add_turn(&back, "z", -psi);
    put_turns(w, &back);
}

static void put_joint(struct writer *w, const struct robot_joint *joint) {
    if (import_joint_is_single(joint))
        put_single(w, joint);
    else if (joint->kind == JOINT_PLANAR)
        put_planar(w, joint);
    else if (joint->kind == JOINT_FLOATING)
        put(w, "joint = \"free\"");
}

/* ---- links ---- */

/* Moments, and products if there are any, on the next line if this one is full. */
static void put_inertia(struct writer *w, const double inertia[6]) {
    static const char *const names[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    struct text parts[2] = {{.memory = &format_memory}, {.memory = &format_memory}};
    for (int i = 0; i < 6; i++)
        if (inertia[i] != 0)
            text_add(&parts[i / 3], "%s%s = %s", parts[i / 3].length ? ", " : "", names[i],
                     number(inertia[i]));
    put(w, "inertia = { %s", parts[0].data);
    w->indent += 4;
    if (parts[1].length)
        put(w, "%s", parts[1].data);
    w->indent -= 4;
    fputs(" }", w->out);
}

/* Mass data along the axes of the frame that `pose` puts at the centre of mass. */
static void put_mass(struct writer *w, double mass, const struct pose *pose, const double inertia[6]) {
    struct text turns = {.memory = &format_memory};
    const bool has_inertia = inertia[0] != 0 || inertia[1] != 0 || inertia[2] != 0;
    add_rpy(&turns, pose->rpy);
    const bool is_body = turns.length && has_inertia;
    break_line(w);
    put(w, is_body ? "bodies = { { mass = %s" : "mass = %s", number(mass));
    w->indent += is_body ? 4 : 0;
    if (!is_zero(pose->xyz))
        put(w, is_body ? "at = %s" : "center = %s", vector(pose->xyz));
    if (is_body)
        put_turns(w, &turns);
    if (has_inertia)
        put_inertia(w, inertia);
    if (is_body)
        fputs(" } }", w->out);
}

/* The beam and the rest of its link. */
static void write_flexible(struct writer *w, const struct flexible *beam) {
    const char *name = beam_name(w, beam->link);
    const struct beam_choice *choice = w->choice->beam;
    struct text turns = {.memory = &format_memory};
    struct pose pose = {.rpy = {0}};
    double inertia[6], mass = beam->rest.mass;
    memcpy(pose.xyz, beam->rest.center, sizeof pose.xyz);
    import_tidy(pose.xyz, 3, beam->length);
    open_entry(w, name);
    put(w, "on = \"%s\"", w->names[beam->link]);
    add_turn(&turns, "z", beam->psi);
    add_turn(&turns, "y", beam->theta);
    put_turns(w, &turns);
    break_line(w);
    put(w, "beam = { length = %s", computed(beam->length));
    w->indent += 4;
    put(w, "section = %s", choice->section);
    put(w, "E = p.E, nu = p.nu");
    put(w, "rho = %s", computed(beam->rho));
    put(w, "eta = p.eta, rfe = n }");
    close_entry(w);
    open_entry(w, helper_name(w, w->names[beam->link], "rest"));
    put_place(w, beam->link, &pose, 0, 0);
    memcpy(inertia, beam->rest.inertia, sizeof inertia);
    import_tidy(inertia, 6, inertia[0] + inertia[1] + inertia[2]);
    import_tidy(&mass, 1, 0);
    put_mass(w, mass, &(struct pose){.rpy = {0}}, inertia);
    close_entry(w);
}

static const char *safe(const char *text) {
    return message_safe_text(&format_memory, text, strlen(text));
}

static void write_link(struct writer *w, int i) {
    const struct robot_link *link = &w->robot->links[i];
    const struct robot_joint *joint = link->joint >= 0 ? &w->robot->joints[link->joint] : NULL;
    const struct flexible *beam = flexible_of(w, i);
    if (joint && joint->kind != JOINT_FIXED)
        fprintf(w->out, "    -- joint %s\n", safe(joint->name));
    if (joint && joint->kind == JOINT_PLANAR && !is_positive_axis(joint)) {
        write_plane(w, joint);
    } else {
        open_entry(w, w->names[i]);
        if (joint)
            put_place(w, joint->parent, &joint->pose, 0, 0);
        if (joint)
            put_joint(w, joint);
        else if (w->choice->is_floating)
            put(w, "joint = \"free\"");
    }
    if (link->has_mass && !beam)
        put_mass(w, link->mass, &link->pose, link->inertia);
    close_entry(w);
    if (beam)
        write_flexible(w, beam);
}

/* ---- the model ---- */

static void write_names(const struct writer *w) {
    const struct robot *robot = w->robot;
    for (int i = 0; i < robot->link_count; i++)
        if (strcmp(w->names[i], robot->links[i].name) != 0)
            fprintf(w->out, "-- Link '%s' of the file is %s.\n", safe(robot->links[i].name), w->names[i]);
}

static void write_parameters(const struct writer *w) {
    const struct beam_choice *beam = w->choice->beam;
    if (w->choice->flexible_count == 0)
        return;
    fprintf(w->out, "local n  = rd.option(\"n_rfe\", %d, { from = 1 })\n", beam->rfe);
    fprintf(
        w->out,
        "local p  = rd.parameters { { \"E\", %s, \"Pa\" }, { \"nu\", %s, \"1\" }, { \"eta\", %s, \"s\" } }\n",
        number(beam->E), number(beam->nu), number(beam->eta));
}

/* ---- points ---- */

/* A fixed frame of the file, such as that of a tool: no joint moves it, and it has no mass. */
static bool is_frame(const struct writer *w, int link) {
    const struct robot_link *at = &w->robot->links[link];
    return !at->has_mass && at->joint >= 0 && w->robot->joints[at->joint].kind == JOINT_FIXED;
}

static bool is_on_ground(const struct writer *w, int link) {
    const struct robot *robot = w->robot;
    for (int at = robot->links[link].joint; at >= 0; at = robot->links[robot->joints[at].parent].joint)
        if (robot->joints[at].kind != JOINT_FIXED)
            return false;
    return !w->choice->is_floating;
}

/* A point's columns end in _x _y _z, and so do columns of slides. */
static bool has_slides(const struct writer *w, int link) {
    const int joint = w->robot->links[link].joint;
    if (joint < 0)
        return w->choice->is_floating;
    const enum joint_kind kind = w->robot->joints[joint].kind;
    return kind == JOINT_PRISMATIC || kind == JOINT_PLANAR || kind == JOINT_FLOATING;
}

static const char *point_name(const struct writer *w, int link) {
    return has_slides(w, link) ? helper_name(w, w->names[link], "end") : w->names[link];
}

/* Frames, and links that carry nothing, which hold tools. */
static void write_points(struct writer *w) {
    open_list(w, "points");
    for (int k = 0; k < w->robot->link_count; k++) {
        const int i = w->robot->order[k];
        const bool is_leaf = w->robot->links[i].first < 0;
        if (is_leaf && flexible_of(w, i))
            put(w, "%s = \"%s.tip\"", point_name(w, i), beam_name(w, i));
        else if (is_leaf || (is_frame(w, i) && !is_on_ground(w, i)))
            put(w, "%s = \"%s\"", point_name(w, i), w->names[i]);
    }
    close_entry(w);
}

/* ---- forces ---- */

static bool has_drive(const struct writer *w, const struct robot_joint *joint) {
    return w->choice->has_drives && import_joint_is_driven(joint);
}

/* "tau_arm_psi" for a torque, "f_arm_x" for a force. */
static const char *input_name(const struct writer *w, const struct robot_joint *joint) {
    return format_text("%s_%s", joint->kind == JOINT_PRISMATIC ? "f" : "tau", coordinate(w, joint));
}

static bool has_any_drive(const struct writer *w) {
    for (int i = 0; i < w->robot->joint_count; i++)
        if (has_drive(w, &w->robot->joints[i]))
            return true;
    return false;
}

static void write_inputs(const struct writer *w) {
    if (has_any_drive(w))
        fputs("local driven = rd.option(\"driven\", false)\n", w->out);
    for (int k = 0; k < w->robot->link_count; k++) {
        const int joint = w->robot->links[w->robot->order[k]].joint;
        if (joint >= 0 && has_drive(w, &w->robot->joints[joint]))
            fprintf(w->out, "rd.input(\"%s\", 0, \"%s\")\n", input_name(w, &w->robot->joints[joint]),
                    w->robot->joints[joint].kind == JOINT_PRISMATIC ? "N" : "N m");
    }
}

/* The input of a joint, limited to the effort in the file. */
static const char *drive_text(const struct writer *w, const struct robot_joint *joint) {
    const char *input = format_text("s.inputs.%s", input_name(w, joint));
    return joint->limits.has_force ? format_text("rd.min(rd.max(%s, %s), %s)", input,
                                                 number(-joint->limits.force), number(joint->limits.force))
                                   : input;
}

static const char *friction_text(const struct writer *w, const struct robot_joint *joint) {
    return format_text("rd.friction(%s, s.qd.%s, %s)", number(joint->friction), coordinate(w, joint),
                       number(w->choice->friction_width));
}

static void write_forces(const struct writer *w) {
    bool has_any = false;
    for (int i = 0; i < w->robot->joint_count; i++) {
        const struct robot_joint *joint = &w->robot->joints[i];
        const bool is_driven = has_drive(w, joint), is_rubbed = joint->friction > 0 &&
                                                                import_joint_is_single(joint) &&
                                                                w->choice->friction_width > 0;
        if (!is_driven && !is_rubbed)
            continue;
        if (!has_any)
            fputs("  forces = function(s)\n    return {\n", w->out);
        has_any = true;
        fprintf(w->out, "      %s = %s%s%s,\n", coordinate(w, joint), is_driven ? drive_text(w, joint) : "",
                is_driven && is_rubbed ? "\n        + " : "", is_rubbed ? friction_text(w, joint) : "");
    }
    if (has_any)
        fputs("    }\n  end,\n", w->out);
}

/* Columns for limited drives: the forces after the limits, in addition to the inputs. */
static void write_courses(const struct writer *w) {
    bool has_any = false;
    for (int i = 0; i < w->robot->joint_count; i++) {
        const struct robot_joint *joint = &w->robot->joints[i];
        if (!has_drive(w, joint) || !joint->limits.has_force)
            continue;
        if (!has_any)
            fputs("  courses = function(s)\n    return {\n", w->out);
        has_any = true;
        fprintf(w->out, "      %s_applied = %s,\n", input_name(w, joint), drive_text(w, joint));
    }
    if (has_any)
        fputs("    }\n  end,\n", w->out);
}

/* ---- rows ---- */

/* "", " + value what", " - what" ...: one more summand. */
static const char *summand(double value, const char *what) {
    if (value == 0)
        return "";
    const char *sign = value < 0 ? "-" : "+";
    if (!*what)
        return format_text(" %s %s", sign, angle(fabs(value)));
    return fabs(value) == 1 ? format_text(" %s %s", sign, what)
                            : format_text(" %s %s * %s", sign, number(fabs(value)), what);
}

static void write_mimics(const struct writer *w) {
    bool has_any = false;
    for (int i = 0; i < w->robot->joint_count; i++) {
        const struct robot_joint *joint = &w->robot->joints[i];
        if (joint->leader < 0)
            continue;
        const struct robot_joint *leader = &w->robot->joints[joint->leader];
        if (!has_any)
            fputs("  constraints = function(s)\n    return {\n", w->out);
        has_any = true;
        fprintf(w->out, "      rd.position { s.q.%s%s%s,\n        name = \"%s follows %s\" },\n",
                coordinate(w, joint),
                summand(-joint->multiplier, format_text("s.q.%s", coordinate(w, leader))),
                summand(-joint->offset, ""), w->names[joint->child], w->names[leader->child]);
    }
    if (has_any)
        fputs("    }\n  end,\n", w->out);
}

/* Statics holds all joints that follow no others; their holding torques balance gravity. */
static void write_hold(struct writer *w) {
    open_list(w, "hold");
    for (int k = 0; k < w->robot->link_count; k++) {
        const struct robot_link *link = &w->robot->links[w->robot->order[k]];
        const struct robot_joint *joint = link->joint >= 0 ? &w->robot->joints[link->joint] : NULL;
        if (joint && import_joint_is_driven(joint))
            put(w, "\"%s\"", coordinate(w, joint));
    }
    close_entry(w);
}

/* With the option `driven`, the same joints can perform a programme; each limit of force bounds its drive. */
static void write_drives(struct writer *w) {
    w->column = fprintf(w->out, "  drives = driven and {");
    w->indent = 3;
    w->is_first = true;
    for (int k = 0; k < w->robot->link_count; k++) {
        const int joint = w->robot->links[w->robot->order[k]].joint;
        if (joint >= 0 && has_drive(w, &w->robot->joints[joint]))
            put(w, "\"%s\"", coordinate(w, &w->robot->joints[joint]));
    }
    fputs(" } or nil,\n", w->out);
}

static struct writer writer_of(const struct robot *robot, const struct model_choice *choice, FILE *out) {
    const char **names = format_allocate((size_t)robot->link_count, sizeof *names);
    for (int i = 0; i < robot->link_count; i++)
        names[i] = robot->links[i].name;
    return (struct writer){.robot = robot,
                           .choice = choice,
                           .out = out,
                           .names = import_identifiers_make(names, robot->link_count, "link")};
}

/* ---- names of joints ---- */

/* The coordinates of a planar or floating joint: "LINK_x" ... from the list of its letters. */
static void put_coordinates(struct document *document, const char *link, const char *letters) {
    char *rest = format_text("%s", letters);
    for (char *name; (name = strsep(&rest, ", "));)
        if (*name)
            format_put_text(document, NULL, format_text("%s_%s", link, name));
}

static void put_joint_names(const struct writer *w, const struct robot_joint *joint,
                            struct document *document) {
    const char *link = w->names[joint->child];
    if (import_joint_is_single(joint))
        format_put_text(document, NULL, coordinate(w, joint));
    else if (joint->kind == JOINT_FLOATING)
        put_coordinates(document, link, "x, y, z, psi, theta, phi");
    else if (is_positive_axis(joint))
        put_coordinates(document, link, planar_names[nearest_axis(joint)]);
    else
        put_coordinates(document, helper_name(w, link, "plane"), "x, y, psi");
}

bool import_write_joints(const struct robot *robot, const struct model_choice *choice, FILE *out) {
    const struct writer w = writer_of(robot, choice, out);
    struct document document;
    format_document_open(&document);
    format_put_open(&document, NULL, '{');
    for (int i = 0; i < robot->joint_count; i++) {
        if (robot->joints[i].kind == JOINT_FIXED)
            continue;
        format_put_open(&document, robot->joints[i].name, '[');
        put_joint_names(&w, &robot->joints[i], &document);
        format_put_close(&document, ']');
    }
    format_put_close(&document, '}');
    return format_document_close(&document, out);
}

void import_write_model(const struct robot *robot, const struct model_choice *choice, FILE *out) {
    struct writer w = writer_of(robot, choice, out);
    fprintf(out, "-- Robot %s, from %s.\n", safe(robot->name), safe(choice->source));
    write_names(&w);
    fputs("local rd = require \"refdyn\"\n", out);
    write_parameters(&w);
    write_inputs(&w);
    fprintf(out, "\nreturn rd.model {\n  name = \"%s\", gravity = { 0, 0, -9.81 },\n  links = {\n",
            import_identifiers_model(robot->name));
    for (int k = 0; k < robot->link_count; k++)
        write_link(&w, robot->order[k]);
    fputs("  },\n", out);
    write_points(&w);
    write_forces(&w);
    write_courses(&w);
    write_mimics(&w);
    write_hold(&w);
    if (has_any_drive(&w))
        write_drives(&w);
    fputs("}\n", out);
}
