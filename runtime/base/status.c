/* The status of a call as a sentence. */
#include "base/arithmetic.h"

#include "refdyn.h"

const char *refdyn_status_text(int status) {
    switch (status) {
    case REFDYN_OK:
        return "done";
    case REFDYN_NOT_FINITE:
        return "the equations gave an infinite or undefined value";
    case REFDYN_MASS_NOT_POSITIVE:
        return "the mass matrix is not positive definite for the admissible motions";
    case REFDYN_ROWS_INCONSISTENT:
        return "a constraint row depends on others but contradicts them";
    case REFDYN_NO_CONVERGENCE:
        return "Newton's iteration did not converge";
    case REFDYN_MATRIX_SINGULAR:
        return "the matrix of an implicit step is singular";
    case REFDYN_STEP_TOO_SMALL:
        return "the step fell below the resolution of the time";
    case REFDYN_TANGENT_SINGULAR:
        return "the tangent stiffness is singular: nothing holds the coordinate";
    case REFDYN_BAD_OPTION:
        return "an option is out of its range";
    case REFDYN_BAD_MEMORY:
        return "the memory given is missing, misaligned or too small";
    case REFDYN_FUNCTION_MISSING:
        return "the model lacks a function that is needed";
    case REFDYN_TOO_MANY_STEPS:
        return "the limit on the number of steps was reached";
    case REFDYN_UNKNOWN_NAME:
        return "the model has nothing of that name, or no emitted function reads it";
    case REFDYN_BAD_VALUE:
        return "the value given is infinite or undefined";
    case REFDYN_OTHER_VERSION:
        return "the model was emitted for another version of this library: emit it again";
    case REFDYN_BAD_MODEL:
        return "the model is missing, or a count or an index in its table is out of range";
    case REFDYN_BAD_ARITHMETIC:
        return "the library was compiled with flags that change arithmetic, such as -ffast-math";
    default:
        return "unknown status";
    }
}
