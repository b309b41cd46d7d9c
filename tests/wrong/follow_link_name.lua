-- expect: 7: links[2].on: no link "arm"; did you mean "amr"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "amr", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
    { "finger", on = "arm", at = { 0, 0, 1 }, mass = 1 },
  },
  points = { E = "arm", F = { on = "arm", along = 0.5 }, G = "arm.tip" },
  forces = function(s) return { arm_z = 1 } end,
  hold = { "arm_z" },
}
