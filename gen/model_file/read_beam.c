/*
 * The beam of a link: segments, sections, damping and curvature.
 *
 * A segment inherits from its beam the fields that it does not have. A beam without segments is one segment.
 */
#include "gen/model_file/reader.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* The two tables that describe a segment: its own (NULL in a beam without segments) and the beam's. */
struct source {
    const struct reader *reader;
    const struct value *own, *beam;
    const char *own_path, *beam_path;
    int segment_count;
    bool *has_checked_damping; /* the beam's damping, which several segments may share, is checked once */
};

/* The same quantity in both tables. */
struct shared_field {
    enum field own, beam;
};

static const struct shared_field length_field = {FIELD_SEGMENT_length, FIELD_BEAM_length},
                                 section_field = {FIELD_SEGMENT_section, FIELD_BEAM_section},
                                 E_field = {FIELD_SEGMENT_E, FIELD_BEAM_E},
                                 nu_field = {FIELD_SEGMENT_nu, FIELD_BEAM_nu},
                                 rho_field = {FIELD_SEGMENT_rho, FIELD_BEAM_rho},
                                 eta_field = {FIELD_SEGMENT_eta, FIELD_BEAM_eta},
                                 damping_field = {FIELD_SEGMENT_damping, FIELD_BEAM_damping},
                                 curvature_field = {FIELD_SEGMENT_curvature, FIELD_BEAM_curvature},
                                 rfe_field = {FIELD_SEGMENT_rfe, FIELD_BEAM_rfe};

/* The table that has the field, the segment's own first. Reports a needed field that neither has. */
static const struct value *choose_table(const struct source *source, struct shared_field field,
                                        enum field *found, const char **path) {
    const struct checker *check = &source->reader->check;
    const char *name = field_rules[field.beam].name;
    const bool is_own = fields_has(source->own, field.own), is_beam = fields_has(source->beam, field.beam);
    *found = is_own ? field.own : field.beam;
    *path = fields_path_name(check, is_own ? source->own_path : source->beam_path, name);
    if (is_own || is_beam)
        return is_own ? source->own : source->beam;
    const bool is_reported = /* by fields_check */
        (source->own && field_rules[field.own].need == NEED_NEEDED) ||
        (source->own && fields_is_misspelled(source->own, OWNER_SEGMENT, name)) ||
        fields_is_misspelled(source->beam, OWNER_BEAM, name);
    if (field_rules[field.beam].need == NEED_SHARED && !is_reported)
        message_error(check->messages, (source->own ? source->own : source->beam)->place,
                      "%s: missing; a beam needs it",
                      fields_path_name(check, source->own ? source->own_path : source->beam_path, name));
    return source->beam;
}

static expression shared_value(const struct source *source, struct shared_field field) {
    const char *path;
    enum field found;
    const struct value *table = choose_table(source, field, &found, &path);
    return fields_get_value(&source->reader->check, table, found);
}

static const struct value *shared_table(const struct source *source, struct shared_field field,
                                        const char **path) {
    enum field found;
    const struct value *table = choose_table(source, field, &found, path);
    return fields_get(table, found);
}

static void read_section(const struct source *source, struct segment *segment) {
    const struct checker *check = &source->reader->check;
    const char *path;
    const struct value *section = shared_table(source, section_field, &path);
    segment->area = segment->Iy = segment->Iz = segment->It = EXPR_ONE;
    if (!section)
        return;
    segment->area = fields_get_value(check, section, FIELD_SECTION_area);
    segment->Iy = fields_get_value(check, section, FIELD_SECTION_Iy);
    segment->Iz = fields_get_value(check, section, FIELD_SECTION_Iz);
    segment->It = fields_get_value(check, section, FIELD_SECTION_It);
}

/* ---- damping ---- */

/*
 * Frequency equation of a beam that is clamped at its root and carries at its end a point mass of `load`
 * times its own: 1 + cos b cosh b + load b (cos b sinh b - sin b cosh b) = 0 with b = beta L (Blevins,
 * Formulas for Natural Frequency and Mode Shape, 1979, table 8-8).
 */
static double clamped_equation(double b, double load) {
    return 1 / cosh(b) + cos(b) + load * b * (cos(b) * tanh(b) - sin(b));
}

/* Root number `mode`: between that of the beam without load and that of the beam with its end held. */
static double clamped_root(int mode, double load) {
    static const double without[] = {1.8751040687, 4.6940911330, 7.8547574382},
                        held[] = {0, 3.9266023120, 7.0685827456};
    double low = held[mode - 1], high = without[mode - 1] + 1e-9;
    const bool is_positive = clamped_equation(high, load) > 0;
    for (int i = 0; i < 60; i++) {
        const double middle = (low + high) / 2;
        if ((clamped_equation(middle, load) > 0) == is_positive)
            high = middle;
        else
            low = middle;
    }
    return low;
}

/* omega = b^2 sqrt(E I / (rho A L^4)), of bending about z if the elements bend about it, else about y. */
static expression mode_frequency(const struct source *source, const struct value *damping,
                                 const struct segment *segment, const struct beam *beam) {
    const struct reader *reader = source->reader;
    struct graph *g = reader->check.graph;
    const struct value *mode = fields_get(damping, FIELD_DAMPING_mode);
    const int number_of_mode = mode && mode->number >= 1 && mode->number <= 3 ? (int)mode->number : 1;
    const expression line = expr_mul(g, segment->rho, segment->area), length = segment->length;
    const expression own = expr_mul(g, line, length);
    const double load =
        read_value_now(reader, fields_get_value(&reader->check, damping, FIELD_DAMPING_tip_mass)) /
        read_value_now(reader, own);
    const double b = clamped_root(number_of_mode, load >= 0 ? load : 0);
    const expression rigidity = expr_mul(g, segment->E, beam->keeps[0] ? segment->Iz : segment->Iy);
    const expression square = expr_mul(g, length, length);
    return expr_mul(g, expr_number(g, b * b),
                    expr_sqrt(g, expr_div(g, rigidity, expr_mul(g, line, expr_mul(g, square, square)))));
}

static void check_damping(const struct source *source, const struct value *damping, const char *path) {
    const struct checker *check = &source->reader->check;
    if (!fields_has(source->own, FIELD_SEGMENT_damping)) {
        const bool has_checked = *source->has_checked_damping;
        *source->has_checked_damping = true;
        if (has_checked)
            return;
    }
    const bool has_ratio = fields_has(damping, FIELD_DAMPING_ratio);
    const bool has_frequency = fields_has(damping, FIELD_DAMPING_frequency);
    const struct value *mode = fields_get(damping, FIELD_DAMPING_mode);
    const bool has_mode = mode || fields_has(damping, FIELD_DAMPING_tip_mass);
    if (has_mode && has_frequency)
        message_error(check->messages, damping->place,
                      "%s: has both mode and frequency; give the one to which the ratio belongs", path);
    if (mode && mode->number > 3)
        message_error(check->messages, mode->place, "%s.mode: value %.6g; must be 1, 2 or 3", path,
                      mode->number);
    if (has_ratio && !has_frequency && source->segment_count > 1)
        message_error(check->messages, damping->place,
                      "%s.ratio: the modes of a beam of several segments are not known here; add frequency",
                      path);
    if (has_ratio && shared_value(source, eta_field))
        message_error(check->messages, damping->place, "%s.ratio: eta is given too; give one of them", path);
}

static void read_damping(const struct source *source, struct segment *segment, const struct beam *beam) {
    static const enum field turns[] = {FIELD_DAMPING_psi, FIELD_DAMPING_theta, FIELD_DAMPING_phi};
    const struct checker *check = &source->reader->check;
    struct graph *g = check->graph;
    const char *path;
    const struct value *damping = shared_table(source, damping_field, &path);
    segment->eta = shared_value(source, eta_field);
    if (!damping)
        return;
    check_damping(source, damping, path);
    for (int i = 0; i < 3; i++)
        segment->damping[i] = fields_get_value(check, damping, turns[i]);
    if (!fields_has(damping, FIELD_DAMPING_ratio))
        return;
    const expression omega =
        fields_has(damping, FIELD_DAMPING_frequency)
            ? expr_mul(g, expr_number(g, 2 * pi), fields_get_value(check, damping, FIELD_DAMPING_frequency))
            : mode_frequency(source, damping, segment, beam);
    segment->eta = expr_div(
        g, expr_mul(g, expr_number(g, 2), fields_get_value(check, damping, FIELD_DAMPING_ratio)), omega);
}

static void read_curvature(const struct source *source, struct segment *segment) {
    static const enum field turns[] = {FIELD_CURVATURE_psi, FIELD_CURVATURE_theta, FIELD_CURVATURE_phi};
    const struct checker *check = &source->reader->check;
    const char *path;
    const struct value *curvature = shared_table(source, curvature_field, &path);
    for (int i = 0; curvature && i < 3; i++)
        segment->curvature[i] = fields_get_value(check, curvature, turns[i]);
}

/* ---- segments ---- */

static void read_segment(const struct source *source, const struct beam *beam, struct segment *segment) {
    const char *path;
    if (source->own)
        fields_check(&source->reader->check, source->own, OWNER_SEGMENT, source->own_path);
    segment->length = shared_value(source, length_field);
    read_section(source, segment);
    segment->E = shared_value(source, E_field);
    segment->nu = shared_value(source, nu_field);
    segment->rho = shared_value(source, rho_field);
    const struct value *rfe = shared_table(source, rfe_field, &path);
    segment->rfe = rfe && rfe->number >= 1 && rfe->number <= 10000 ? (int)rfe->number : 1;
    read_damping(source, segment, beam);
    read_curvature(source, segment);
}

static void read_dofs(const struct reader *reader, const struct value *value, const char *path,
                      struct beam *beam) {
    static const char *const turns[] = {"psi", "theta", "phi"};
    const char **names;
    int count = fields_get_names(&reader->check, value, &names);
    for (int turn = 0; turn < 3; turn++)
        beam->keeps[turn] = !value;
    for (int i = 0; i < count; i++) {
        const int turn = text_index(names[i], turns, 3);
        if (turn < 0)
            message_error(reader->check.messages, value->place,
                          "%s: \"%s\" is not a turn of an element; use psi, theta or phi", path, names[i]);
        else
            beam->keeps[turn] = true;
    }
    if (value && count == 0 && value->item_count + value->field_count == 0)
        message_error(reader->check.messages, value->place,
                      "%s: empty; name psi, theta, phi or some of them (for a rigid link set rfe = 1)", path);
}

/* Strains are symmetric in all three turns, so that elements with fewer turns do not need them. */
static void read_springs(const struct reader *reader, const struct value *value, const char *path,
                         struct beam *beam) {
    const bool has_all = beam->keeps[0] && beam->keeps[1] && beam->keeps[2];
    const bool is_printed = value && strcmp(value->text, "printed") == 0;
    beam->has_strains = has_all && !is_printed;
    if (value && !is_printed && strcmp(value->text, "symmetric") != 0)
        message_error(reader->check.messages, value->place,
                      "%s: \"%s\"; must be \"symmetric\" or \"printed\"", path, value->text);
    else if (value && !has_all)
        message_warning(reader->check.messages, value->place,
                        "%s: has no effect, since the elements have fewer than three turns (dofs)", path);
}

/* Warns of fields of the beam that have no effect, since every segment has its own. */
static void check_overridden(const struct reader *reader, const struct value *table,
                             const struct value *segments, const char *path) {
    static const struct shared_field *const fields[] = {&section_field,   &E_field,   &nu_field,
                                                        &rho_field,       &eta_field, &damping_field,
                                                        &curvature_field, &rfe_field};
    for (size_t k = 0; k < sizeof fields / sizeof *fields; k++) {
        const struct value *value = fields_get(table, fields[k]->beam);
        int own = 0;
        for (int i = 0; i < segments->item_count; i++)
            own += fields_has(&segments->items[i], fields[k]->own);
        if (value && own > 0 && own == segments->item_count)
            message_warning(reader->check.messages, value->place,
                            "%s: has no effect, since each segment has its own",
                            fields_path_name(&reader->check, path, field_rules[fields[k]->beam].name));
    }
}

/* Warns of values for turns that the elements do not have. */
static void warn_of_turns(const struct reader *reader, const struct value *table, const enum field fields[3],
                          const char *path, const struct beam *beam) {
    for (int i = 0; table && i < 3; i++) {
        const char *name = field_rules[fields[i]].name;
        if (fields_get_value(&reader->check, table, fields[i]) && !beam->keeps[i])
            message_warning(reader->check.messages, fields_get(table, fields[i])->place,
                            "%s: has no effect, since the elements do not turn by %s (dofs)",
                            fields_path_name(&reader->check, path, name), name);
    }
}

static void check_turns(const struct reader *reader, const struct value *damping,
                        const struct value *curvature, const char *path, const struct beam *beam) {
    static const enum field dampings[] = {FIELD_DAMPING_psi, FIELD_DAMPING_theta, FIELD_DAMPING_phi},
                            bends[] = {FIELD_CURVATURE_psi, FIELD_CURVATURE_theta, FIELD_CURVATURE_phi};
    warn_of_turns(reader, damping, dampings, fields_path_name(&reader->check, path, "damping"), beam);
    warn_of_turns(reader, curvature, bends, fields_path_name(&reader->check, path, "curvature"), beam);
}

static void read_segments(const struct reader *reader, const struct value *table,
                          const struct value *segments, const char *path, struct beam *beam) {
    const struct checker *check = &reader->check;
    const char *list = fields_path_name(check, path, "segments");
    bool has_checked_damping = false;
    struct source source = {
        .reader = reader, .beam = table, .beam_path = path, .has_checked_damping = &has_checked_damping};
    source.segment_count = segments ? segments->item_count : 1;
    beam->segments = memory_get(check->memory, ((size_t)source.segment_count + 1) * sizeof *beam->segments);
    for (int i = 0; i < source.segment_count; i++) {
        if (segments && segments->items[i].kind != VALUE_TABLE)
            continue;
        source.own = segments ? &segments->items[i] : NULL;
        source.own_path = fields_path_item(check, list, i);
        if (source.own)
            check_turns(reader, fields_get(source.own, FIELD_SEGMENT_damping),
                        fields_get(source.own, FIELD_SEGMENT_curvature), source.own_path, beam);
        read_segment(&source, beam, &beam->segments[beam->segment_count++]);
    }
}

void read_beam(const struct reader *reader, const struct value *table, const char *path, struct beam *beam) {
    const struct checker *check = &reader->check;
    const struct value *segments = fields_get(table, FIELD_BEAM_segments);
    beam->exists = true;
    if (fields_is_stranger(table, OWNER_BEAM))
        return;
    read_dofs(reader, fields_get(table, FIELD_BEAM_dofs), fields_path_name(check, path, "dofs"), beam);
    read_springs(reader, fields_get(table, FIELD_BEAM_springs), fields_path_name(check, path, "springs"),
                 beam);
    if (segments && fields_has(table, FIELD_BEAM_length))
        message_error(check->messages, table->place,
                      "%s.length: given together with segments, whose lengths add up to it; remove it", path);
    if (segments && segments->item_count == 0)
        message_error(check->messages, segments->place, "%s.segments: empty; a beam needs at least one",
                      path);
    check_turns(reader, fields_get(table, FIELD_BEAM_damping), fields_get(table, FIELD_BEAM_curvature), path,
                beam);
    if (segments)
        check_overridden(reader, table, segments, path);
    read_segments(reader, table, segments, path, beam);
}
