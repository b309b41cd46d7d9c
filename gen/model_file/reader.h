/*
 * Shared by the files that read models: the reader, links and beams, and each part that an author's function
 * returns.
 */
#ifndef REFDYN_GEN_READER_H
#define REFDYN_GEN_READER_H

#include "gen/language/language.h"
#include "gen/model_file/model_file.h"

/* ---- read_model.c and read_result.c: from values to the model ---- */

/* What the files read_*.c share. Each reads values of the file and fills its part of the model. */
struct reader {
    struct checker check;
    struct model *model;
    const struct tree *tree; /* while forces, rows and events are read */
    bool lacks_links;        /* some have errors, so that unknown links are not reported */
};

/* Whether the result of the function `name` is a table of the author. Reports an error if it is not. */
bool read_is_result(const struct reader *reader, const struct value *result, const char *name,
                    const char *needed);
/* Reports an unknown coordinate, once for each name. */
void read_refuse_coordinate(const struct reader *reader, struct place place, const char *path,
                            const char *fact, const char *name);

/* Entries made by one function of the module, with the fields of `owner`. */
struct entry_kind {
    const char *tag;
    enum owner owner;
    void (*read)(const struct reader *reader, const struct value *value, const char *path);
};
/* Reads each entry of a list, and of lists within it, by its kind. */
void read_entries(const struct reader *reader, const struct value *list, const char *path,
                  const struct entry_kind *kinds, size_t count, const char *needed);

/* ---- read_link.c, read_beam.c ---- */

/* The next three return false if the place is unknown. The first reads where a link is attached. */
bool read_carrier(const struct reader *reader, const struct value *table, const char *path,
                  struct attachment *at);
/* The name of a link or, if `may_be_point`, of a point of interest, or a table of OWNER_POINT. */
bool read_place(const struct reader *reader, const struct value *value, const char *path, bool may_be_point,
                struct attachment *at);
/* The field `field` of `table`: a place or the name of one. */
bool read_place_field(const struct reader *reader, const struct value *table, enum field field,
                      const char *path, struct attachment *at);
/* "x", "y", "z" or three values. */
struct vector read_direction(const struct reader *reader, const struct value *value);
void read_turns(const struct reader *reader, const struct value *turns, struct placement *placement);
double read_value_now(const struct reader *reader, expression e); /* with the parameters' values */
/* Reports a requirement that is not met, and keeps it for other values of parameters. */
void read_require(const struct reader *reader, struct requirement requirement, const char *path,
                  struct place place);
/* Mass data of a link and its list of bodies. */
void read_solids(const struct reader *reader, const struct value *table, const char *path, struct link *link);
/* Joints of a link and all fields about them. */
void read_joints(const struct reader *reader, const struct value *table, const char *path, struct link *link);
void read_beam(const struct reader *reader, const struct value *table, const char *path, struct beam *beam);

/* ---- read_states.c, read_forces.c, read_drives.c, read_pulls.c, read_constraints.c, read_events.c;
 * warnings.c: doubtful values ---- */

void read_states(const struct reader *reader, const struct value *result);
/* Adds the rates of states to the forces, after all other forces. */
void read_rates_of_states(const struct reader *reader);
void read_forces(const struct reader *reader, const struct value *result);
/* Adds a force along the line between two places, which drives them apart. False if one is unknown. */
bool read_push(const struct reader *reader, const struct value *value, enum field from, enum field to,
               expression force, const char *path);
/* read_drives.c: after the forces. */
void read_drives(const struct reader *reader, const struct value *list);
/* After the rows: no drive may act on a locked coordinate. Then treats the programme as requested. */
void read_drives_end(const struct reader *reader);
/* read_pulls.c: after the drives. */
void read_pulls(const struct reader *reader);
void read_courses(const struct reader *reader, const struct value *table);
/* read_bounds.c: limits of links, then those of the list, which may be NULL. After the courses. */
void read_bounds(const struct reader *reader, const struct value *list);
void read_constraints(const struct reader *reader, const struct value *result);
void read_events(const struct reader *reader, const struct value *result);

/* Warns of rows whose residual does not change its sign where it is zero. */
void read_check_slopes(const struct reader *reader);
/* Warns of values that look like millimetres or degrees, of thick beams, and of coordinates without inertia
 * or load. The model must have no errors. */
void warnings_of_values(const struct model *model, const struct tree *tree, struct messages *messages);

#endif
