/*
 * Options, parameters and inputs of a model, as its file declares them, with the settings (--set) applied.
 *
 * Takes values with their places; gives the value of an option, or the symbol of a parameter or input. A name
 * may be declared once within its kind; check_model.c complains about doubles.
 */
#ifndef REFDYN_GEN_DECLARATIONS_H
#define REFDYN_GEN_DECLARATIONS_H

#include "base/memory.h"
#include "model/model.h"
#include "read/read_model.h"
#include "read/value.h"

struct declarations {
    struct memory *memory;
    struct graph *graph;
    struct messages *messages;
    const struct read_request *request;
    const char **setting_kind; /* by setting: what it has set, "option" ..., or NULL */
    bool lacks_parameters;     /* some could not be read: a name that is not among them is no mistake */
    struct option *options;
    int option_count, option_capacity;
    struct parameter *parameters;
    int parameter_count, parameter_capacity;
    struct input *inputs;
    int input_count, input_capacity;
    struct requirement *requirements; /* numbers that depend on parameters and have been looked at */
    int requirement_count, requirement_capacity;
};

void declarations_start(struct declarations *declarations, struct memory *memory, struct graph *graph,
                        const struct read_request *request, struct messages *messages);
/* The option's value, of the type of `standard`; `allowed`: a list of values, { from = , to = }, or NULL. */
struct value declarations_add_option(struct declarations *declarations, struct place place, const char *name,
                                     const struct value *standard, const struct value *allowed);
/* `standard`: a number, or an expression of other parameters and of values at the start of a motion. */
expression declarations_add_parameter(struct declarations *declarations, struct place place, const char *name,
                                      const struct value *standard, const char *unit);
/* A parameter that contacts set while a motion runs; it is 0 at the start. It remains a symbol even where
 * parameters are folded. */
expression declarations_add_mode(struct declarations *declarations, struct place place, const char *name);
/* A list of { name, value, unit }. */
void declarations_add_parameters(struct declarations *declarations, const struct value *list);
expression declarations_add_input(struct declarations *declarations, struct place place, const char *name,
                                  double standard, const char *unit);
/* What is wrong with expressions of parameters alone, as a message; NULL: nothing, and where they hang on
 * parameters the requirement is kept for other values of these. */
const char *declarations_require(struct declarations *declarations, struct requirement requirement);
/* The value of an expression that is known while the model is read: of parameters, none of which waits for
 * the start of a motion. */
bool parameters_are_known(const struct declarations *declarations, expression e, double *value);
/* Names of the parameters with values of the state at the start of a motion, and not given, that e reads. */
const char **declarations_start_values(const struct declarations *declarations, expression e, int *count);
/* The expression that stands for parameter number `index`: a number when parameters are folded. */
expression declarations_parameter_expression(const struct declarations *declarations, int index);
/* To be called when all is declared. */
void declarations_refuse_unknown_settings(const struct declarations *declarations,
                                          const char *const *coordinates, int coordinate_count);

#endif
