-- expect: 11: forces: the function returns nothing; must return a table such as { arm_psi = 1 }, or {} for none
-- expect: 12: courses: the function returns nothing; must return a table of values by name such as { speed = s.qd.arm_psi }
-- expect: 13: constraints: the function returns nothing; must return a list of rows such as { rd.position { expression } }, or {} for none
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) local unused = { arm_z = 1 } end,
  courses = function(s) return nil end,
  constraints = function(s) end,
}
