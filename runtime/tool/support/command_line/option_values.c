/* The values of the options of one call: a list of those that are given, by name. */
#include "runtime/tool/support/command_line/command_line.h"
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

/* Into a new list, because copies of the struct may share the present one. */
static void add_value(struct options *options, struct option_value value) {
    struct option_value *values = allocate((size_t)options->value_count + 1, sizeof *values);
    if (options->value_count > 0)
        memcpy(values, options->values, (size_t)options->value_count * sizeof *values);
    values[options->value_count++] = value;
    options->values = values;
}

static void set_value(struct options *options, struct option_value value) {
    const struct option_value *old = find_value(options, value.name);
    const ptrdiff_t place = old ? old - options->values : options->value_count;
    add_value(options, value);
    if (old) {
        ((struct option_value *)options->values)[place] = value;
        options->value_count--;
    }
}

void options_add_text(struct options *options, const char *name, const char *text) {
    add_value(options, (struct option_value){.name = name, .text = text});
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
