/* STATE.json: reads a state with the lines of its entries for messages, and writes states and points; values
 * that a FIT.json or another result of a search has found. The
 * results of `statics` and `modes` are states, too: their other keys are ignored, but `coordinates` must
 * match the model. */
#include "runtime/tool/scene/scene.h"
#include "runtime/tool/support/format/format.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- Lines of a text that is valid JSON ---- */

static const char blanks[] = " \t\r\n";

static const char *end_of_string(const char *quote) {
    const char *at = quote + 1;
    while (*at && *at != '"')
        at += *at == '\\' && at[1] ? 2 : 1;
    return at;
}

/* The place after the value. */
static const char *skip_value(const char *at) {
    int depth = 0;
    for (; *at && (depth > 0 || !strchr(",]}", *at)); at++) {
        if (*at == '"')
            at = end_of_string(at);
        depth += (*at == '{' || *at == '[') - (*at == '}' || *at == ']');
    }
    return at;
}

/* Returns whether the string at `quote` is this key. */
static bool is_key(const char *quote, const char *key) {
    const size_t length = (size_t)(end_of_string(quote) - quote) - 1;
    return strlen(key) == length && strncmp(quote + 1, key, length) == 0;
}

/* The place of member `key` of the object at `at`, or of element `index` of the array if key is NULL; NULL if
 * there is none. */
static const char *find_entry(const char *at, const char *key, int index) {
    at++;
    for (int i = 0; *(at += strspn(at, blanks)) && !strchr("]}", *at); i++) {
        if (key ? is_key(at, key) : i == index)
            return at;
        at = skip_value(at);
        at += *at == ',';
    }
    return NULL;
}

/* The line of member `key` of the outermost object; with `member`, of that member of the object in it; with
 * index >= 0, of that element of the array in it. Line 1 if there is none. */
static int locate_line(const char *text, const char *key, const char *member, int index) {
    const char *at = find_entry(text + strspn(text, blanks), key, 0);
    int line = 1;
    if (at && (member || index >= 0)) {
        at = end_of_string(at) + 1;
        at += strspn(at, blanks) + 1; /* the colon */
        at = find_entry(at + strspn(at, blanks), member, index);
    }
    for (; at && text < at; text++)
        line += *text == '\n';
    return line;
}

/* ---- values ---- */

struct reading {
    const char *path, *text;
    const struct generation *generation;
    bool takes_accelerations;
    int complaints;
};

/* more messages would not help, and each one searches for its line */
enum { COMPLAINTS_MOST = 20 };

static void complain_at(struct reading *reading, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void complain_at(struct reading *reading, int line, const char *format, ...) {
    va_list list;
    va_start(list, format);
    format_complain_line(reading->path, line, format_vtext(format, list));
    va_end(list);
    reading->complaints++;
}

static const char *kind_of(const json_t *value) {
    static const char *const kinds[] = {"an object", "an array", "a text", "a number",
                                        "a number",  "true",     "false",  "null"};
    return kinds[json_typeof(value)];
}

static void unknown_name(struct reading *reading, int line, const char *what, const char *name,
                         const char *const *known, int count) {
    complain_at(reading, line, "%s: unknown %s%s", name, what,
                count ? message_nearest_advice(&format_memory, name, known, count) : "; the model has none");
}

static double *read_vector(struct reading *reading, const char *key, const json_t *array) {
    const struct tree *tree = &reading->generation->tree;
    const int joints = tree_joint_count(tree);
    int line = locate_line(reading->text, key, NULL, -1);
    if (!json_is_array(array)) {
        complain_at(reading, line, "%s: %s; must be an array of %d numbers", key, kind_of(array), joints);
        return NULL;
    }
    if (json_array_size(array) != (size_t)joints) {
        complain_at(reading, line,
                    "%s: has %zu values; must have %d, one for each coordinate from %s to %s%s", key,
                    json_array_size(array), joints, joints ? tree->frames[0].name : "none",
                    joints ? tree->frames[joints - 1].name : "none",
                    json_array_size(array) > (size_t)joints ? "; numbers are written with a point" : "");
        return NULL;
    }
    double *values = format_allocate((size_t)tree->count, sizeof *values);
    for (int i = 0; i < joints && reading->complaints < COMPLAINTS_MOST; i++) {
        const json_t *value = json_array_get(array, (size_t)i);
        values[i] = json_number_value(value);
        if (!json_is_number(value))
            complain_at(reading, locate_line(reading->text, key, NULL, i),
                        "%s[%d] (%s): %s; must be a number", key, i, tree->frames[i].name, kind_of(value));
    }
    return values;
}

/* Reads an object of numbers whose keys are among `known`. */
static struct named_value *read_values(struct reading *reading, const char *key, const char *what,
                                       json_t *object, const char *const *known, int known_count,
                                       int *count) {
    struct named_value *values = format_allocate(json_object_size(object), sizeof *values);
    const char *name;
    json_t *value;
    *count = 0;
    if (!json_is_object(object))
        complain_at(reading, locate_line(reading->text, key, NULL, -1),
                    "%s: %s; must be an object of numbers", key, kind_of(object));
    json_object_foreach(object, name, value) {
        if (reading->complaints == COMPLAINTS_MOST)
            break;
        int line = locate_line(reading->text, key, name, -1);
        if (text_index(name, known, known_count) < 0)
            unknown_name(reading, line, what, name, known, known_count);
        else if (!json_is_number(value))
            complain_at(reading, line, "%s: %s; must be a number", name, kind_of(value));
        else
            values[(*count)++] = (struct named_value){format_text("%s", name), json_number_value(value)};
    }
    return values;
}

static void read_inputs(struct reading *reading, struct state *state, json_t *object) {
    const struct model *model = &reading->generation->model;
    const char **names = format_allocate((size_t)model->input_count, sizeof *names);
    for (int i = 0; i < model->input_count; i++)
        names[i] = model->inputs[i].name;
    state->inputs =
        read_values(reading, "inputs", "input", object, names, model->input_count, &state->input_count);
}

static void read_states(struct reading *reading, struct state *state, json_t *object) {
    const struct tree *tree = &reading->generation->tree;
    const int joints = tree_joint_count(tree), count = tree->count - joints;
    const char **names = tree_coordinate_names(&format_memory, tree);
    state->states =
        read_values(reading, "states", "state", object, names + joints, count, &state->state_count);
}

static void read_parameters(struct reading *reading, struct state *state, json_t *object) {
    const struct model *model = &reading->generation->model;
    const char **names = format_allocate((size_t)model->parameter_count, sizeof *names);
    for (int i = 0; i < model->parameter_count; i++)
        names[i] = model->parameters[i].name;
    state->parameters = read_values(reading, "parameters", "parameter", object, names, model->parameter_count,
                                    &state->parameter_count);
}

/* A name of the model is not a key: reports the key under which it belongs. */
static bool is_of_model(struct reading *reading, int line, const char *name) {
    const struct generation *generation = reading->generation;
    const char *key = NULL;
    if (tree_find_coordinate(&generation->tree, name) >= 0)
        key = "the array q, in the order of the coordinates";
    if (tree_find_state(&generation->tree, name) >= 0)
        key = "the object states";
    for (int i = 0; i < generation->model.input_count; i++)
        if (strcmp(generation->model.inputs[i].name, name) == 0)
            key = "the object inputs";
    for (int i = 0; i < generation->model.parameter_count; i++)
        if (strcmp(generation->model.parameters[i].name, name) == 0)
            key = "the object parameters";
    if (key)
        complain_at(reading, line, "%s: not a key of a state; it belongs in %s", name, key);
    return key;
}

/* A result names its coordinates. Without this check, values for another model, or for another structure of
 * this one, would go to the wrong coordinates. */
static void check_coordinates(struct reading *reading, const json_t *array) {
    const struct tree *tree = &reading->generation->tree;
    for (int i = 0; i < tree_joint_count(tree) && reading->complaints < COMPLAINTS_MOST; i++) {
        const char *name = json_string_value(json_array_get(array, (size_t)i));
        if (!name || strcmp(name, tree->frames[i].name) != 0)
            complain_at(
                reading, locate_line(reading->text, "coordinates", NULL, -1),
                "coordinates[%d]: %s, but the model has %s; use a state of the same model and options", i,
                name ? name : "no name", tree->frames[i].name);
    }
}

/* Keys that `statics` and `modes` write in addition to the state: their results are states, too. */
static bool is_of_result(const char *key) {
    static const char *const keys[] = {"refdyn",   "name",    "at",   "points",    "hold_force", "residual",
                                       "rows",     "lambda",  "phi",  "stability", "criterion",  "potential",
                                       "unstable", "neutral", "held", "modes",     "contacts",   "limits"};
    return text_index(key, keys, sizeof keys / sizeof keys[0]) >= 0;
}

static void read_member(struct reading *reading, struct state *state, const char *key, json_t *value) {
    static const char *const keys[] = {"t", "q", "qd", "states", "inputs", "parameters", "qdd"};
    const bool takes_qdd = reading->takes_accelerations;
    int line = locate_line(reading->text, key, NULL, -1);
    if (strcmp(key, "t") == 0) {
        state->t = json_number_value(value);
        if (!json_is_number(value))
            complain_at(reading, line, "t: %s; must be a number", kind_of(value));
    } else if (strcmp(key, "q") == 0)
        state->q = read_vector(reading, key, value);
    else if (strcmp(key, "qd") == 0)
        state->qd = read_vector(reading, key, value);
    else if (strcmp(key, "qdd") == 0 && takes_qdd)
        state->qdd = read_vector(reading, key, value);
    else if (strcmp(key, "states") == 0)
        read_states(reading, state, value);
    else if (strcmp(key, "inputs") == 0)
        read_inputs(reading, state, value);
    else if (strcmp(key, "parameters") == 0)
        read_parameters(reading, state, value);
    else if (strcmp(key, "coordinates") == 0)
        check_coordinates(reading, value);
    else if (!is_of_result(key) && !is_of_model(reading, line, key))
        unknown_name(reading, line,
                     takes_qdd ? "key of a state (t, q, qd, qdd, states, inputs, parameters)"
                               : "key of a state (t, q, qd, states, inputs, parameters)",
                     key, keys, sizeof keys / sizeof keys[0] - !takes_qdd);
}

/* Shows the token that jansson names, and a character beyond ASCII in it. */
static void complain_of_syntax(struct reading *reading, const char *what, const json_error_t *error) {
    const char *token = strstr(error->text, "near '"), *instead;
    const char *strange = token ? message_beyond_ascii(&format_memory, token, strlen(token), &instead) : NULL;
    complain_at(reading, error->line > 0 ? error->line : 1,
                "%s: %s; must be one JSON object of finite numbers%s%s%s%s", what, error->text,
                strange ? "; it has " : "", strange ? strange : "", strange ? "; " : "",
                strange ? instead : "");
}

/* Reads the file as an object; `what` names its purpose. Calls `take` for each member. */
static bool read_object(struct reading *reading, const char *what,
                        void take(struct reading *reading, struct state *state, const char *key,
                                  json_t *value),
                        struct state *state) {
    static const char mark[] = "\xEF\xBB\xBF"; /* byte order mark of UTF-8, which some editors write first */
    const char *text = format_read_file(reading->path, what);
    if (!text)
        return false;
    text += strncmp(text, mark, strlen(mark)) == 0 ? strlen(mark) : 0;
    reading->text = text;
    json_error_t error;
    json_t *root = json_loads(text, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, &error);
    const char *key;
    json_t *value;
    if (!root)
        complain_of_syntax(reading, what, &error);
    else if (!json_is_object(root))
        complain_at(reading, 1, "%s: %s; must be an object", what, kind_of(root));
    json_object_foreach(root, key, value) {
        if (reading->complaints < COMPLAINTS_MOST)
            take(reading, state, key, value);
    }
    json_decref(root);
    return reading->complaints == 0;
}

bool scene_state_read(struct state *state, const char *path, const struct generation *generation,
                      bool takes_accelerations) {
    struct reading reading = {
        .path = path, .generation = generation, .takes_accelerations = takes_accelerations};
    *state = (struct state){.t = 0};
    if (!strpbrk(path, "./") && access(path, F_OK) != 0) {
        format_complain_line(
            path, 0,
            format_text("no file has this name; must be initial, statics or a readable STATE.json%s",
                        message_nearest_advice(&format_memory, path, options_places, 2)));
        return false;
    }
    return read_object(&reading, "state", read_member, state);
}

/* ---- Values that a search has found ---- */

/* Parameters, inputs, coordinates and rates NAME_d. */
static const char **list_names(const struct generation *generation, int *count) {
    const struct model *model = &generation->model;
    const struct tree *tree = &generation->tree;
    const char **names = format_allocate(
        (size_t)(model->parameter_count + model->input_count + 2 * tree->count), sizeof *names);
    *count = 0;
    for (int i = 0; i < model->parameter_count; i++)
        names[(*count)++] = model->parameters[i].name;
    for (int i = 0; i < model->input_count; i++)
        names[(*count)++] = model->inputs[i].name;
    for (int i = 0; i < tree->count; i++) {
        names[(*count)++] = tree->frames[i].name;
        if (!tree->frames[i].is_state)
            names[(*count)++] = format_text("%s_d", tree->frames[i].name);
    }
    return names;
}

static void read_found(struct reading *reading, struct state *state, const char *key, json_t *value) {
    int count;
    if (strcmp(key, "values") != 0 && strcmp(key, "parameters") != 0)
        return;
    const char **names = list_names(reading->generation, &count);
    state->found = read_values(reading, key, "value of this model", value, names, count, &state->found_count);
}

bool scene_found_read(struct state *state, const char *path, const struct generation *generation) {
    struct reading reading = {.path = path, .generation = generation};
    if (!read_object(&reading, "parameters", read_found, state))
        return false;
    if (state->found_count > 0)
        return true;
    format_complain_line(path, 1, "parameters: no values; must be a FIT.json with the object values");
    return false;
}

/* ---- Writing ---- */

void scene_put_coordinates(struct document *document, const char *key, const struct refdyn_model *model,
                           const int *which) {
    format_put_open(document, key, '[');
    for (int i = 0; i < model->n; i++)
        if (which ? which[i] : i < refdyn_joint_count(model))
            format_put_text(document, NULL, model->coordinates[i].name);
    format_put_close(document, ']');
}

void scene_put_positions(struct document *document, const struct scene *scene) {
    const struct refdyn_model *model = scene->model;
    double *r = format_allocate_matrix(model->point_count, 3);
    if (model->point_count)
        model->r(scene->work.p, scene->work.x, scene->state.t, scene->q, scene->qd, r);
    format_put_open(document, "points", '{');
    for (int i = 0; i < model->point_count; i++)
        format_put_array(document, model->points[i], r + 3 * i, 3);
    format_put_close(document, '}');
}

/* Of several values of one name, the last one counts. */
static void put_values(struct document *document, const struct named_value *list, int count) {
    for (int i = 0; i < count; i++) {
        bool is_last = true;
        for (int k = i + 1; k < count; k++)
            is_last = is_last && strcmp(list[k].name, list[i].name) != 0;
        if (is_last)
            format_put_number(document, list[i].name, list[i].value);
    }
}

/* The inputs of --set come first, then the inputs of the STATE.json. */
static void put_inputs(struct document *document, const struct scene *scene) {
    const struct values *values = &scene->values;
    const struct state *state = &scene->state;
    const size_t count = (size_t)(values->input_count + state->input_count);
    struct named_value *list = format_allocate(count, sizeof *list);
    for (int i = 0; i < values->input_count; i++)
        list[i] = values->inputs[i];
    for (int i = 0; i < state->input_count; i++)
        list[values->input_count + i] = state->inputs[i];
    format_put_open(document, "inputs", '{');
    put_values(document, list, (int)count);
    format_put_close(document, '}');
}

void scene_put_state(struct document *document, const struct scene *scene) {
    const struct record_writer writer = scene_writer(document);
    record_put_state(scene->model, scene->q, scene->qd, "states", &writer);
    format_put_number(document, "t", scene->state.t);
    put_inputs(document, scene);
    format_put_open(document, "parameters", '{');
    put_values(document, scene->values.list, scene->values.count);
    format_put_close(document, '}');
}

/* ---- Entries of records ---- */

static void put_open(void *document, const char *key, char bracket) {
    format_put_open(document, key, bracket);
}

static void put_close(void *document, char bracket) {
    format_put_close(document, bracket);
}

static void put_number(void *document, const char *key, double value) {
    format_put_number(document, key, value);
}

static void put_whole(void *document, const char *key, long value) {
    format_put_whole(document, key, value);
}

static void put_text(void *document, const char *key, const char *text) {
    format_put_text(document, key, text);
}

static void put_truth(void *document, const char *key, bool value) {
    format_put_truth(document, key, value);
}

static void put_null(void *document, const char *key) {
    format_put_null(document, key);
}

struct record_writer scene_writer(struct document *document) {
    return (struct record_writer){document,  put_open, put_close, put_number,
                                  put_whole, put_text, put_truth, put_null};
}
