-- expect: 24: parameter HUGE_VALF: a macro of math.h; choose another name
-- expect: 24: parameter M_E: a macro of math.h; choose another name
-- expect: 24: parameter M_PI: a macro of math.h; choose another name
-- expect: 24: parameter M_SQRT2f64x: a macro of math.h; choose another name
-- expect: 24: parameter NAN: a macro of math.h; choose another name
-- expect: 24: parameter INFINITY: a macro of math.h; choose another name
-- expect: 24: parameter FP_NAN: a macro of math.h; choose another name
-- expect: 24: parameter MATH_ERRNO: a macro of math.h; choose another name
-- expect: 24: parameter math_errhandling: a macro of math.h; choose another name
-- expect: 24: parameter signgam: a macro of math.h; choose another name
-- expect: 24: parameter NULL: a macro of stddef.h; choose another name
-- expect: 24: parameter errno: a macro of errno.h; choose another name
-- expect: 24: parameter RAND_MAX: a macro of stdlib.h, which math.h includes in C++; choose another name
-- expect: 24: parameter BIG_ENDIAN: a macro of stdlib.h, which math.h includes in C++; choose another name
-- expect: 24: parameter unix: a macro that compilers define for some machines; choose another name
-- expect: 24: parameter linux: a macro that compilers define for some machines; choose another name
-- expect: 24: parameter i386: a macro that compilers define for some machines; choose another name
-- expect: 24: parameter REFDYN_MODEL_H: names that begin with REFDYN_ belong to the runtime; choose another name
-- expect: 26: input HUGE_VAL: a macro of math.h; choose another name
local rd = require "refdyn"
local names = { "HUGE_VALF", "M_E", "M_PI", "M_SQRT2f64x", "NAN", "INFINITY", "FP_NAN", "MATH_ERRNO", "math_errhandling", "signgam",
  "NULL", "errno", "RAND_MAX", "BIG_ENDIAN", "unix", "linux", "i386", "REFDYN_MODEL_H" }
local list = {}
for i, name in ipairs(names) do list[i] = { name, 1 } end
local p = rd.parameters(list)
rd.input("HUGE_VAL")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = p.M_PI },
  },
}
