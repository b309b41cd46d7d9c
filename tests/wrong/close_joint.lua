-- expect: 13: constraints[1].joint: "hinge" is not a joint; use x, y, z, phi, theta, psi, ball or weld
-- expect: 14: constraints[2].joint: "x" slides after a turn; name slides first
-- expect: 15: constraints[3].joint: missing; rd.close needs it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  constraints = function(s)
    return {
      rd.close { "E", "ground", joint = "hinge" },
      rd.close { "E", "ground", joint = { "psi", "x" } },
      rd.close { "E", "ground" },
    }
  end,
}
