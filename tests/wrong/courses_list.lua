-- expect: 8: courses: has entries without a name; must be a table of values by name such as { speed = s.qd.arm_psi }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  courses = function(s) return { s.t } end,
}
