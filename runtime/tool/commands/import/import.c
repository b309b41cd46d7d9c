/* `refdyn import`: a URDF file as a Lua model. Reads the file and the options for beams; writes the model,
 * and reports on stderr what was read and what was left out. */
#include "gen/base/base.h"
#include "runtime/tool/support/options/options.h"
#include "runtime/tool/commands/import/import.h"
#include "runtime/tool/support/system/system.h"
#include "runtime/tool/support/format/format.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- sections ---- */

/* int y^2 dA and int z^2 dA as in theory, sect. 3.2; the Lua functions of these names compute the same. */
static void set_tube(struct beam_choice *beam, const double v[2]) {
    const double out = v[0] * v[0], in = v[1] * v[1];
    beam->area = pi / 4 * (out - in);
    beam->Iy = beam->Iz = pi / 64 * (out * out - in * in);
}

static void set_rectangle(struct beam_choice *beam, const double v[2]) {
    beam->area = v[0] * v[1];
    beam->Iy = beam->area * v[1] * v[1] / 12;
    beam->Iz = beam->area * v[0] * v[0] / 12;
}

static const struct section {
    const char *name;
    int count;
    void (*set)(struct beam_choice *beam, const double v[2]);
} sections[] = {{"round", 1, set_tube}, {"tube", 2, set_tube}, {"rectangle", 2, set_rectangle}};

/* Reads `count` numbers of a list, separated by `marks`. */
static bool take_numbers(char *rest, const char *marks, double *out, int count) {
    for (int i = 0; i < count; i++) {
        const char *word = strsep(&rest, marks);
        if (!word || !text_to_number(word, &out[i]))
            return false;
    }
    return !rest;
}

/* Reads "tube:0.05:0.044". Returns what is wrong with it; NULL: nothing. */
static const char *take_section(struct beam_choice *beam, const char *text) {
    static const char unknown[] =
        "is not one of round:DIAMETER, tube:OUTER:INNER, rectangle:WIDTH_Y:HEIGHT_Z";
    char *rest = format_text("%s", text), number[NUMBER_LENGTH], second[NUMBER_LENGTH];
    const char *name = strsep(&rest, ":");
    double v[2] = {0};
    for (size_t i = 0; rest && i < sizeof sections / sizeof *sections; i++) {
        if (strcmp(sections[i].name, name) != 0)
            continue;
        if (!take_numbers(rest, ":", v, sections[i].count) || v[0] <= 0 || v[sections[i].count - 1] <= 0)
            return unknown;
        if (sections[i].set == set_tube && v[1] >= v[0])
            return "has an inner diameter that is not smaller than the outer one; write tube:OUTER:INNER";
        sections[i].set(beam, v);
        beam->section = sections[i].count == 1 ? format_text("rd.%s(%s)", name, exact_text(v[0], number))
                                               : format_text("rd.%s(%s, %s)", name, exact_text(v[0], number),
                                                             exact_text(v[1], second));
        return isfinite(beam->Iy) && isfinite(beam->Iz) && beam->Iy > 0 && beam->Iz > 0 ? NULL : unknown;
    }
    return unknown;
}

/* ---- options of beams ---- */

static enum status refuse_without_beam(const struct options *options) {
    const struct {
        const char *name;
        bool is_given;
    } given[] = {{"section", options_text(options, "section")}, {"tip", options_text(options, "tip")},
                 {"E", options_number(options, "E") > 0},       {"nu", options_text(options, "nu")},
                 {"eta", options_text(options, "eta")},         {"rho", options_number(options, "rho") > 0},
                 {"rfe", options_number(options, "rfe") > 0}};
    for (size_t i = 0; i < sizeof given / sizeof *given; i++)
        if (given[i].is_given)
            return options_usage_error(options->command, "--%s: applies to beams only; add --flexible LINK",
                                       given[i].name);
    return STATUS_DONE;
}

static enum status take_beam(const struct options *options, struct beam_choice *beam) {
    const double E = options_number(options, "E");
    const char *flexible = options_text(options, "flexible"), *section = options_text(options, "section"),
               *nu = options_text(options, "nu"), *eta = options_text(options, "eta");
    const double rfe = options_number(options, "rfe");
    double *tip = format_allocate(3, sizeof *tip);
    *beam = (struct beam_choice){.E = E, .nu = 0.3, .rho = options_number(options, "rho"), .rfe = 4};
    if (!flexible)
        return refuse_without_beam(options);
    if (!section || !(E > 0))
        return options_usage_error(options->command, "--flexible: add %s", section ? "--E" : "--section");
    const char *wrong = take_section(beam, section);
    if (wrong)
        return options_error(options, "section", ": '%s' %s", section, wrong);
    if (nu && (!text_to_number(nu, &beam->nu) || !(beam->nu > -1 && beam->nu <= 0.5)))
        return options_error(options, "nu", ": '%s' must be a number above -1 and at most 0.5", nu);
    if (eta && (!text_to_number(eta, &beam->eta) || beam->eta < 0))
        return options_error(options, "eta", ": '%s' must be a number of at least 0", eta);
    if (options_text(options, "tip") &&
        !take_numbers(format_text("%s", options_text(options, "tip")), ",", tip, 3))
        return options_error(options, "tip", ": '%s' is not of the form x,y,z", options_text(options, "tip"));
    if (options_text(options, "tip") && strchr(flexible, ','))
        return options_error(options, "tip", ": applies to one link; --flexible has several");
    beam->rfe = rfe > 0 ? (int)rfe : beam->rfe;
    beam->tip = options_text(options, "tip") ? tip : NULL;
    return STATUS_DONE;
}

static bool complain_of_link(const struct robot *robot, const char *name) {
    const char **known = format_allocate((size_t)robot->link_count, sizeof *known);
    for (int i = 0; i < robot->link_count; i++)
        known[i] = robot->links[i].name;
    return import_robot_complain(robot, 0, "--flexible: there is no link '%s'%s", name,
                                 message_nearest_advice(&format_memory, name, known, robot->link_count));
}

static bool make_beams(const struct robot *robot, const struct options *options,
                       struct model_choice *choice) {
    const char **names = options_list(options_text(options, "flexible"));
    struct flexible *flexible = format_allocate((size_t)robot->link_count, sizeof *flexible);
    for (choice->flexible_count = 0; names[choice->flexible_count]; choice->flexible_count++) {
        const char *name = names[choice->flexible_count];
        const int link = import_robot_find_link(robot, name);
        if (link < 0)
            return complain_of_link(robot, name);
        if (!import_flexible_make(robot, link, choice->beam, &flexible[choice->flexible_count]))
            return false;
    }
    choice->flexible = flexible;
    return true;
}

/* ---- what is not as in the file ---- */

static void warn_of_joint(const struct robot *robot, const struct robot_joint *joint,
                          const struct model_choice *choice) {
    const bool is_single = import_joint_is_single(joint);
    if (joint->friction > 0 && (choice->friction_width == 0 || !is_single))
        import_robot_warn(robot, joint->line, "joint %s: friction %g is left out%s", joint->name,
                          joint->friction, is_single ? "; --friction-width RATE includes it" : "");
    const struct joint_limits *limits = &joint->limits;
    const bool is_limited = limits->has_range || limits->has_rate || limits->has_force;
    if (is_limited && !is_single && joint->kind != JOINT_FIXED)
        import_robot_warn(robot, joint->line, "joint %s: limits of several coordinates are left out",
                          joint->name);
    if (choice->has_drives && !is_single && joint->kind != JOINT_FIXED)
        import_robot_warn(robot, joint->line, "joint %s: has several coordinates; they get no inputs",
                          joint->name);
    if (joint->damping > 0 && !is_single && joint->kind != JOINT_FIXED)
        import_robot_warn(robot, joint->line, "joint %s: damping %g of several coordinates is left out",
                          joint->name, joint->damping);
}

/* (link_count) whether the link, or what it carries, has mass */
static bool *find_loaded(const struct robot *robot) {
    bool *is_loaded = format_allocate((size_t)robot->link_count, sizeof *is_loaded);
    for (int k = robot->link_count - 1; k >= 0; k--) {
        const int i = robot->order[k], joint = robot->links[i].joint;
        is_loaded[i] = is_loaded[i] || robot->links[i].has_mass;
        if (joint >= 0 && is_loaded[i])
            is_loaded[robot->joints[joint].parent] = true;
    }
    return is_loaded;
}

/* A joint that moves no mass has no acceleration: lidars and wheels without <inertial> are examples. Of
 * nested ones the first is reported. */
static void warn_of_massless(const struct robot *robot) {
    const bool *is_loaded = find_loaded(robot);
    bool *is_told = format_allocate((size_t)robot->link_count, sizeof *is_told);
    for (int k = 0; k < robot->link_count; k++) {
        const int i = robot->order[k];
        if (robot->links[i].joint < 0 || is_loaded[i])
            continue;
        const struct robot_joint *joint = &robot->joints[robot->links[i].joint];
        if (joint->kind != JOINT_FIXED && !is_told[joint->parent])
            import_robot_warn(robot, joint->line,
                              "joint %s: moves no mass; add mass, or make the joint fixed", joint->name);
        is_told[i] = is_told[joint->parent] || joint->kind != JOINT_FIXED;
    }
}

static void mend_inertias(struct robot *robot) {
    for (int i = 0; i < robot->link_count; i++) {
        struct robot_link *link = &robot->links[i];
        const double *I = link->inertia, was[6] = {I[0], I[1], I[2], I[3], I[4], I[5]};
        if (!import_inertia_mend(link->inertia))
            continue;
        import_tidy(link->inertia, 6, I[0] + I[1] + I[2]);
        import_robot_warn(robot, link->line,
                          "link %s: no body has the moments %g %g %g with the products %g %g %g; the nearest "
                          "possible ones replace them: %g %g %g with %g %g %g",
                          link->name, was[0], was[1], was[2], was[3], was[4], was[5], I[0], I[1], I[2], I[3],
                          I[4], I[5]);
    }
}

static const double right_angles_most = 0.01; /* [rad] */

/* Frames as they are read: how many are nearly at right angles, and by how much they miss them. */
struct nearly_right {
    double within;  /* angles within this of a right angle become exact */
    int set;        /* how many of them there were */
    double changed; /* by how much at most */
    int count;      /* of those that are nearly right and stay */
    double farthest;
};

static void set_right(struct nearly_right *angles, double rpy[3]) {
    const double nearly = 1e-4, right = pi / 2;
    for (int i = 0; i < 3; i++) {
        const double turns = nearbyint(rpy[i] / right), off = fabs(rpy[i] - turns * right);
        const double around = fmod(turns, 4), nearest = around > 2    ? around - 4
                                                        : around < -2 ? around + 4
                                                                      : around;
        if (off > 0 && off <= angles->within) {
            rpy[i] = nearest * right;
            angles->set++;
            angles->changed = fmax(angles->changed, off);
        } else if (off > 0 && off <= nearly) {
            angles->count++;
            angles->farthest = fmax(angles->farthest, off);
        }
    }
}

/* Frames at exactly right angles need less computation. */
static void set_right_angles(struct robot *robot, double within) {
    struct nearly_right angles = {.within = within};
    for (int i = 0; i < robot->joint_count; i++)
        set_right(&angles, robot->joints[i].pose.rpy);
    for (int i = 0; i < robot->link_count; i++)
        set_right(&angles, robot->links[i].pose.rpy);
    if (angles.set > 0)
        fprintf(stderr, "%d angle%s set to right angles, changed by at most %.2g rad\n", angles.set,
                angles.set == 1 ? " is" : "s are", angles.changed);
    if (angles.count > 0)
        fprintf(
            stderr,
            "%d angle%s within %.2g rad of a right angle; --right-angles %.1g makes %s exact, which saves "
            "operations\n",
            angles.count, angles.count == 1 ? " is" : "s are", angles.farthest, 1.5 * angles.farthest,
            angles.count == 1 ? "it" : "them");
}

static void print_beam(const struct robot *robot, const struct flexible *beam) {
    const struct robot_link *link = &robot->links[beam->link];
    fprintf(stderr,
            "link %s: a beam of %.6g m with %.6g of %.6g kg, rho %.6g kg/m^3; the rest, %.6g kg, is fixed to "
            "it at "
            "%.6g m\n",
            link->name, beam->length, link->mass - beam->rest.mass, link->mass, beam->rho, beam->rest.mass,
            import_flexible_along(beam, beam->rest.center));
}

/* ---- the command ---- */

static int count_coordinates(const struct robot *robot, const struct model_choice *choice) {
    int count = choice->is_floating ? 6 : 0;
    for (int i = 0; i < robot->joint_count; i++) {
        const enum joint_kind kind = robot->joints[i].kind;
        count += kind == JOINT_FIXED ? 0 : kind == JOINT_PLANAR ? 3 : kind == JOINT_FLOATING ? 6 : 1;
    }
    return count;
}

static bool read_robot(struct robot *robot, const struct options *options, struct model_choice *choice) {
    if (!import_robot_read(robot, options->operands[0]))
        return false;
    if (count_coordinates(robot, choice) == 0 && !options_text(options, "flexible"))
        return import_robot_complain(robot, robot->line,
                                     "robot: no joint moves; add one, or give --floating for the root");
    mend_inertias(robot);
    set_right_angles(robot, options_number(options, "right-angles"));
    for (int i = 0; i < robot->joint_count; i++)
        warn_of_joint(robot, &robot->joints[i], choice);
    if (!make_beams(robot, options, choice))
        return false;
    warn_of_massless(robot);
    return true;
}

/* "1 joint", "7 joints" */
static const char *counted(int count, const char *what) {
    return format_text("%d %s%s", count, what, count == 1 ? "" : "s");
}

static int count_inputs(const struct robot *robot, const struct model_choice *choice) {
    int count = 0;
    for (int i = 0; i < robot->joint_count && choice->has_drives; i++)
        count += import_joint_is_driven(&robot->joints[i]);
    return count;
}

static void print_summary(const struct robot *robot, const struct model_choice *choice) {
    for (int i = 0; i < choice->flexible_count; i++)
        print_beam(robot, &choice->flexible[i]);
    fprintf(stderr, "%s, %s, %s without those of beams", counted(robot->link_count, "link"),
            counted(robot->joint_count, "joint"), counted(count_coordinates(robot, choice), "coordinate"));
    fprintf(stderr, "%s%s\n", choice->has_drives ? ", " : "",
            choice->has_drives ? counted(count_inputs(robot, choice), "input") : "");
}

static enum status run_import(const struct options *options) {
    const double right_angles = options_number(options, "right-angles");
    struct robot robot;
    struct beam_choice beam;
    struct targets targets = {.first = NULL};
    const char *path = options->operands[0], *slash = strrchr(path, '/');
    struct model_choice choice = {.source = slash ? slash + 1 : path,
                                  .is_floating = options_has(options, "floating"),
                                  .has_joint_names = options_has(options, "joint-names"),
                                  .has_drives = options_has(options, "drives"),
                                  .friction_width = options_number(options, "friction-width"),
                                  .beam = &beam};
    if (right_angles > right_angles_most)
        return options_error(options, "right-angles",
                             ": %g rad is larger than any rounding of an angle; must be at most %g",
                             right_angles, right_angles_most);
    const enum status status = take_beam(options, &beam);
    if (status != STATUS_DONE)
        return status;
    system_targets_spare(&targets, path);
    const char *joints_path = options_text(options, "joints");
    struct target *target = system_target_open(&targets, options_text(options, "output")), *joints = NULL;
    if (target && joints_path)
        joints = system_target_open(&targets, joints_path);
    bool is_good = target && (joints || !joints_path) && read_robot(&robot, options, &choice);
    if (is_good) {
        print_summary(&robot, &choice);
        import_write_model(&robot, &choice, target->file);
        is_good = (!joints || import_write_joints(&robot, &choice, joints->file)) &&
                  system_target_finish(target) && (!joints || system_target_finish(joints));
    }
    system_targets_release(&targets);
    return is_good ? STATUS_DONE : STATUS_FAULT;
}

static const struct option_rule import_rules[] = {
    {"flexible", "a,b", OPTION_LIST, "links that become beams, from their origin to --tip", NULL, NULL},
    {"section", "SHAPE", OPTION_TEXT,
     "their section: round:DIAMETER, tube:OUTER:INNER or rectangle:WIDTH_Y:HEIGHT_Z [m]", NULL, NULL},
    {"tip", "x,y,z", OPTION_TEXT,
     "their tip in the link's frame [m] (default: the origin of the joints that the link carries)", NULL,
     NULL},
    {"E", "E", OPTION_POSITIVE, "Young's modulus [Pa]", NULL, NULL},
    {"nu", "NU", OPTION_TEXT, "Poisson's ratio (default 0.3)", NULL, NULL},
    {"eta", "ETA", OPTION_TEXT, "damping over stiffness (default 0) [s]", NULL, NULL},
    {"rho", "RHO", OPTION_POSITIVE,
     "density [kg/m^3] (default: from the largest mass that leaves a possible body of the link)", NULL, NULL},
    {"rfe", "N", OPTION_COUNT, "rigid finite elements of a beam (default 4)", NULL, NULL},
    {"friction-width", "RATE", OPTION_POSITIVE,
     "include dry friction, smooth over this rate [rad/s, m/s] (default: left out)", NULL, NULL},
    {"right-angles", "TOL", OPTION_POSITIVE,
     "make angles of frames exact that are this close to right angles [rad]", NULL, NULL},
    {"joint-names", NULL, OPTION_FLAG,
     "coordinates have the names of their joints where the model allows them (default: LINK_psi and the "
     "like)",
     NULL, NULL},
    {"joints", "FILE.json", OPTION_TEXT, "write the names of the joints and of their coordinates as JSON",
     NULL, NULL},
    {"drives", NULL, OPTION_FLAG,
     "each joint has an input, limited to the joint's effort, and with --set driven=true is a drive "
     "(default: "
     "nothing drives the joints)",
     NULL, NULL},
    {"floating", NULL, OPTION_FLAG, "the root moves freely (default: it is fixed to the ground)", NULL, NULL},
    {.name = NULL}};

const struct command import_command = {
    .name = "import",
    .run = run_import,
    .operands = "FILE.urdf",
    .options = "output flexible section tip E nu eta rho rfe friction-width right-angles joint-names "
               "joints drives floating",
    .tables = {import_rules},
    .output = "MODEL.lua",
    .purpose = "write a robot's URDF file as a Lua model",
    .help =
        "Links, joints and inertias; stderr reports what is left out. Links of --flexible become beams. "
        "Together with a rest\n"
        "that is fixed to it, each beam keeps the link's mass, centre and inertia.\n\n"
        "  refdyn import robot.urdf -o robot.lua\n"
        "  refdyn import robot.urdf --flexible forearm --section tube:0.08:0.076 --E 7e10 -o robot.lua\n"};
