-- expect: 10: hold: has named entries (arm_z); must be a list of names such as { "a", "b" }
-- expect: 11: dependent: has named entries (hand_psi); must be a list of names such as { "a", "b" }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  hold = { arm_z = true },
  dependent = { "arm_z", hand_psi = 1 },
}
