/* The version of the library, and the text of a status. */
#include "runtime/core/base/core.h"

#include "refdyn.h"

const char *refdyn_version(void) {
    return REFDYN_VERSION;
}

enum { LOWEST = REFDYN_CONTACT_PULLS };

static const char *const texts[] = {
    [REFDYN_OK - LOWEST] = "done",
    [REFDYN_NOT_FINITE - LOWEST] = "the equations gave an infinite or undefined value",
    [REFDYN_MASS_NOT_POSITIVE - LOWEST] =
        "the mass matrix is not positive definite for the admissible motions",
    [REFDYN_ROWS_INCONSISTENT - LOWEST] = "a constraint row depends on others but contradicts them",
    [REFDYN_NO_CONVERGENCE - LOWEST] = "Newton's iteration did not converge",
    [REFDYN_MATRIX_SINGULAR - LOWEST] = "the matrix of an implicit step is singular",
    [REFDYN_ROWS_UNMET - LOWEST] = "rows that begin to act or jump at this time, or a changed parameter, "
                                   "require positions other than those of the motion",
    [REFDYN_STEP_TOO_SMALL - LOWEST] = "the step fell below the resolution of the time",
    [REFDYN_TANGENT_SINGULAR - LOWEST] = "the tangent stiffness is singular: nothing holds the coordinate",
    [REFDYN_BAD_OPTION - LOWEST] = "an option is out of its range",
    [REFDYN_BAD_MEMORY - LOWEST] = "memory is missing or misaligned",
    [REFDYN_FUNCTION_MISSING - LOWEST] =
        "the model lacks a function that is needed; emit it, for implicit methods by --emit all,implicit",
    [REFDYN_TOO_MANY_STEPS - LOWEST] = "the limit on the number of steps was reached",
    [REFDYN_UNKNOWN_NAME - LOWEST] = "the model has nothing of that name, or no emitted function reads it",
    [REFDYN_BAD_VALUE - LOWEST] = "the value given is infinite or undefined",
    [REFDYN_OTHER_VERSION - LOWEST] =
        "the model was emitted for another version of this library: emit it again",
    [REFDYN_BAD_MODEL - LOWEST] = "the model is missing, or a count or an index in its table is out of range",
    [REFDYN_BAD_ARITHMETIC - LOWEST] =
        "the library was compiled with flags that change arithmetic, such as -ffast-math",
    [REFDYN_EVENT_ENDS - LOWEST] = "an event has ended the motion",
    [REFDYN_EVENTS_ACCUMULATE - LOWEST] = "events follow each other without time between",
    [REFDYN_SLIDES - LOWEST] = "forces or rows jump here, and lead back to the jump from both sides",
    [REFDYN_CONTACT_INSIDE - LOWEST] = "the gap of a contact is negative",
    [REFDYN_CONTACT_DRIVEN - LOWEST] = "the programme drives the bodies of a closed contact into each other",
    [REFDYN_CONTACTS_UNMET - LOWEST] = "no impulses or forces keep all closed contacts from closing further",
    [REFDYN_REFUSED - LOWEST] = "the model refuses a value of its parameters",
    [REFDYN_CONTACT_PULLS - LOWEST] = "a contact that rests would have to pull: a step has missed where it "
                                      "opens; take smaller steps or a smaller tolerance",
    [REFDYN_NO_DERIVATIVE - LOWEST] = "events differ when a value is slightly larger or smaller",
    [REFDYN_NOT_STARTED - LOWEST] = "the motion has not started: refdyn_integrator_init and then "
                                    "refdyn_integrator_start must succeed first",
    [REFDYN_BAD_TIME - LOWEST] =
        "the requested time is before the time of the motion, outside its last step, or "
        "not finite",
    [REFDYN_MEMORY_TOO_SMALL - LOWEST] = "the memory is smaller than refdyn_workspace_size, "
                                         "refdyn_integrator_size or refdyn_statics_size requires",
    [REFDYN_EVENT_NOT_MET - LOWEST] = "what an event sets is not finite, or the rows do not allow it",
};

const char *refdyn_status_text(int status) {
    enum { COUNT = sizeof texts / sizeof texts[0] };
    return status >= LOWEST && status < LOWEST + COUNT ? texts[status - LOWEST] : "unknown status";
}
