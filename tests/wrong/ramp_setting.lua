-- expect: 11: rd.ramp: from 0 to -1; the range must ascend
-- set: t1=-1
local rd = require "refdyn"
local p = rd.parameters { { "t1", 2, "s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return { arm_z = rd.ramp(s.t, 0, p.t1) } end,
}
