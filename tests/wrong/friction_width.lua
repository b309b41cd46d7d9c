-- expect: 11: rd.friction: argument 3: value 0; must be positive
-- expect: 12: rd.friction: argument 3: value -0.1; must be positive
local rd = require "refdyn"
local p = rd.parameters { { "width", -0.1, "m/s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return { arm_z = rd.friction(1, s.qd.arm_z, 0) } end,
  courses = function(s) return { drag = rd.friction(1, s.qd.arm_z, p.width) } end,
}
