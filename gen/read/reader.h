/*
 * What the parts of the reader share: read_model.c (links, points, names), read_place.c,
 * read_joints.c, read_body.c, read_beam.c, and, once the coordinates are known, read_forces.c,
 * read_constraints.c and read_events.c with read_result.c. Each takes values of the file and fills its part
 * of the model.
 */
#ifndef REFDYN_GEN_READER_H
#define REFDYN_GEN_READER_H

#include "read/fields.h"
#include "read/markers.h"
#include "base/memory.h"

struct reader {
    struct checker check;
    struct model *model;
    const struct tree *tree; /* while forces and rows are read */
    bool lacks_links;        /* some could not be read: what names a link is not judged */
};

/* ---- read_place.c ---- */

/* The fields by which a table says where something is; FIELD_COUNT for one that it does not have. */
struct place_fields {
    enum field on, along, at, turn;
};
extern const struct place_fields link_place;

/* Place of a table with such fields; `may_be_point`: `on` may name a point of interest. False when what
 * carries it is not known, as these two. */
bool read_attachment(const struct reader *reader, const struct value *table,
                     const struct place_fields *fields, const char *path, bool may_be_point,
                     struct attachment *at);
/* The name of a link or point, or a table of OWNER_POINT. */
bool read_place(const struct reader *reader, const struct value *value, const char *path, bool may_be_point,
                struct attachment *at);
/* The field `field` of `table`, a place or the name of one; false when it is missing or wrong. */
bool read_place_field(const struct reader *reader, const struct value *table, enum field field,
                      const char *path, struct attachment *at);
/* "x", "y", "z" or three values. */
struct vector read_direction(const struct reader *reader, const struct value *value);
void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement);

/* ---- read_joints.c, read_body.c, read_beam.c ---- */

/* Joints of a link and all fields about them. */
void read_joints(const struct reader *reader, const struct value *table, const char *path, struct link *link);
double read_value_now(const struct reader *reader, expression e); /* with the parameters' values */
/* Complains when it is not met; keeps it for other values of parameters. */
void read_require(const struct reader *reader, struct requirement requirement, const char *path,
                  struct place place);
/* Mass data of a link and its list of bodies. */
void read_solids(const struct reader *reader, const struct value *table, const char *path, struct link *link);
void read_beam(const struct reader *reader, const struct value *table, const char *path, struct beam *beam);

/* ---- read_result.c ---- */

/* Is what the function `name` gives a table of the author? Complains when it is not. */
bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed);
/* Complains about an unknown coordinate, once for each name. */
void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name);

/* Entries that one function of the module makes, with the fields of `owner`. */
struct entry_kind {
    const char *tag;
    enum owner owner;
    void (*read)(const struct reader *reader, const struct value *value, const char *path);
};
/* Reads each entry of a list, and of lists within it, as what its kind is. */
void read_entries(const struct reader *reader, const struct value *list, const char *path,
                  const struct entry_kind *kinds, size_t count, const char *needed);

/* ---- read_forces.c, read_constraints.c, read_events.c ---- */

void read_forces(const struct reader *reader, const struct value *result);
void read_courses(const struct reader *reader, const struct value *table);
void read_constraints(const struct reader *reader, const struct value *result);
void read_events(const struct reader *reader, const struct value *result);

/* ---- row_slopes.c ---- */

/* Complains about rows whose residual does not change its sign where it is zero. */
void read_check_slopes(const struct reader *reader);

#endif
