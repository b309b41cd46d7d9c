-- expect: 12: rd.ramp: from 2 to 0; the range must ascend
-- expect: 13: rd.smoothstep: from 2 to 2; the range must ascend
-- expect: 14: rd.ramp: from 1 to 1; the range must ascend
local rd = require "refdyn"
local p = rd.parameters { { "t0", 0, "s" }, { "t1", 2, "s" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s) return { arm_z = rd.ramp(s.t, p.t1, p.t0) } end,
  courses = function(s) return { rise = rd.smoothstep(s.t, 2, p.t1) } end,
  constraints = function(s) return { rd.velocity { s.qd.hand_psi - rd.ramp(s.t, 1, 1) } } end,
}
