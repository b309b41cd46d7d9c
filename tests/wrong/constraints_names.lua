-- expect: 13: constraints: has named entries (closing), a list of rows such as { rd.position { expression } }, {} for none, is needed
-- expect: 14: forces.arm_z: a table, a number or an expression is needed
-- expect: 14: forces.arm_zz: unknown coordinate, the nearest known one is "arm_z"
-- expect: 14: forces[1]: a table, the name of a coordinate before it, or rd.spring damper actuator force torque energy { ... } is needed
-- expect: 15: courses.good: true or false, a number or an expression is needed
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
