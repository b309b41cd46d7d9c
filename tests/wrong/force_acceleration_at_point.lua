-- expect: 11: forces[1]: depends on accelerations; a force may depend on t, q, qd and inputs only
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      rd.torque { "a", { 0, 0, s.qdd.a_psi } },
    }
  end,
}
