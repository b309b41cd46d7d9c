-- expect: 14: forces[1]: acts on the ground; must act on a link
-- expect: 15: forces[2]: acts on the ground; must act on a link
-- expect: 16: forces[3]: acts on the ground; must act on a link
-- expect: 17: forces[4]: acts on the ground; must act on a link
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  forces = function(s)
    return {
      rd.force { "ground", { 0, 0, 1 } },
      rd.torque { "ground", { 0, 0, 1 } },
      rd.torque { "ground", { 0, 0, 1 }, against = "ground" },
      rd.force { "G", { 0, 0, 1 } },
    }
  end,
  points = { G = { on = "ground", at = { 1, 0, 0 } } },
}
