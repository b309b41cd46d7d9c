-- expect: 13: constraints: has named entries (closing); must be a list of rows such as { rd.position { expression } }, or {} for none
-- expect: 14: forces.arm_z: a table; must be a number or an expression
-- expect: 14: forces.arm_zz: unknown coordinate; did you mean "arm_z"?
-- expect: 14: forces[1]: a table; must be COORDINATE = value, or made by rd.spring, damper, actuator, force, torque or energy
-- expect: 15: courses.good: a truth value; must be a number or an expression
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s) return { closing = rd.position { s.q.arm_z } } end,
  forces = function(s) return { { arm_z = 1 }, arm_zz = 2, arm_z = {} } end,
  courses = function(s) return { good = true } end,
}
