-- expect: 12: forces[1].to: given by name and as item 2; give it once
-- expect: 13: forces[2].value: given by name and as item 1; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s)
    return {
      rd.spring { "arm", "ground", to = "hand", stiffness = 1 },
      rd.energy { s.q.arm_z, value = s.q.hand_psi },
    }
  end,
}
