/*
 * The functions of the module `refdyn` that a model file calls, on plain values: rd.option, rd.sin, rd.round
 * ... script.c hands them to Lua; those of ops.def are among them.
 */
#ifndef REFDYN_GEN_MODULE_H
#define REFDYN_GEN_MODULE_H

#include "read/declarations.h"
#include "read/value.h"

struct module_call {
    struct declarations *declarations;
    struct place place; /* of the call */
    int function;       /* number of the function */
    const struct value *arguments;
    int argument_count;
    struct value result;
    const char *fault; /* NULL, or a message that ends the script */
};

int module_function_count(void);
const char *module_function_name(struct memory *memory, int function);
/* Example of a call: "rd.tube(outer, inner)". */
const char *module_form(struct memory *memory, int function);
/* Does it take the values of expressions, which takes a pass through all of them? */
bool module_evaluates(int function);
/* Does it take samples, of which there may be more than entries in other lists? */
bool module_takes_samples(int function);
/* Is there a function of values with this name, such as rd.sin? One that makes a table, such as rd.position?
 */
bool module_has(struct memory *memory, const char *name);
bool module_makes(const char *name);
/* What to say of a name that the module does not have. */
const char *module_unknown(struct memory *memory, const char *name);
void module_run(struct module_call *call);

#endif
