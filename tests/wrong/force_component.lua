-- expect: 11: forces[1].value[3]: a text; must be a number or an expression
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      rd.force { "E", { 0, 0, "up" } },
      rd.torque { "a", { 0, 0, s.qdd.a_psi } },
    }
  end,
}
