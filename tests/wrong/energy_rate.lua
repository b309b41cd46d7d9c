-- expect: 12: forces[1]: an energy may depend on coordinates and positions only; write such forces as rd.force or forces on coordinates
-- expect: 13: forces[2]: an energy may depend on coordinates and positions only; write such forces as rd.force or forces on coordinates
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
