-- expect: 11: forces: the function returns 2 values; must return one
-- expect: 12: courses: the function returns 3 values; must return one
-- expect: 13: constraints: the function returns 2 values; must return one
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return {}, {} end,
  courses = function(s) return { speed = s.qd.arm_z }, 1, 2 end,
  constraints = function(s) return {}, { rd.position { s.q.arm_z } } end,
}
