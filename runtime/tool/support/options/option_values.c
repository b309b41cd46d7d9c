/* The values of the options of one call: a list of those that are given, by name. */
#include "runtime/tool/support/options/options.h"
#include "gen/base/base.h"
#include "runtime/tool/support/format/format.h"

#include <string.h>

static const struct option_value *find_value(const struct options *options, const char *name) {
    for (int i = 0; i < options->value_count; i++)
        if (strcmp(options->values[i].name, name) == 0)
            return &options->values[i];
    return NULL;
}

bool options_has(const struct options *options, const char *name) {
    return find_value(options, name) != NULL;
}

const char *options_text(const struct options *options, const char *name) {
    const struct option_value *value = find_value(options, name);
    return value ? value->text : NULL;
}

double options_number(const struct options *options, const char *name) {
    const struct option_value *value = find_value(options, name);
    return value ? value->number : 0;
}

const char *options_repeated(const struct options *options, const char *name, int place) {
    for (int i = 0; i < options->value_count; i++)
        if (strcmp(options->values[i].name, name) == 0 && place-- == 0)
            return options->values[i].text;
    return NULL;
}

bool options_is(const struct options *options, const char *name, const char *text) {
    const char *given = options_text(options, name);
    return given && strcmp(given, text) == 0;
}

/* Puts the value at `place`, in a new list, because copies of the struct may share the present one. */
static void put_value(struct options *options, int place, struct option_value value) {
    const int count = options->value_count > place ? options->value_count : place + 1;
    struct option_value *values = format_allocate((size_t)count, sizeof *values);
    for (int i = 0; i < options->value_count; i++)
        values[i] = options->values[i];
    values[place] = value;
    options->values = values;
    options->value_count = count;
}

static void set_value(struct options *options, struct option_value value) {
    const struct option_value *old = find_value(options, value.name);
    put_value(options, old ? (int)(old - options->values) : options->value_count, value);
}

void options_add_text(struct options *options, const char *name, const char *text) {
    put_value(options, options->value_count, (struct option_value){.name = name, .text = text});
}

void options_set_flag(struct options *options, const char *name) {
    set_value(options, (struct option_value){.name = name});
}

void options_set_text(struct options *options, const char *name, const char *text) {
    set_value(options, (struct option_value){.name = name, .text = text});
}

void options_set_number(struct options *options, const char *name, double number) {
    set_value(options, (struct option_value){.name = name, .number = number});
}
