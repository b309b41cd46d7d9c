-- expect: 12: forces[1]: depends on more than coordinates and positions, such forces are no energy
-- expect: 13: forces[2]: depends on more than coordinates and positions, such forces are no energy
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      rd.energy { s.qd.a_x^2 },
      rd.energy { s.q.a_x * s.t },
    }
  end,
}
