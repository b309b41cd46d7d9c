-- A flexible pendulum that bends and twists: a steel rod on a hinge, with an eccentric mass at its tip. Only gravity acts.
-- Its energy is constant.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 4, { from = 1 })
local p  = rd.parameters {
  { "L", 2, "m" }, { "d", 0.01413200743, "m" }, { "E", 2.1e11, "Pa" }, { "nu", 0.3, "1" }, { "rho", 7801, "kg/m^3" },
  { "g", 9.81, "m/s^2" }, { "m_bob", 0.5, "kg" },
}

return rd.model {
  name = "pendulum", gravity = { 0, 0, -p.g },
  links = {
    { "arm", turn = { { "x", rd.pi / 2 } }, joint = { "psi" },
      beam = { length = p.L, section = rd.round(p.d), E = p.E, nu = p.nu, rho = p.rho, rfe = n, springs = "printed" } },
    { "bob", on = "arm.tip", at = { 0.05, 0.1, -0.08 }, mass = p.m_bob },
  },
  points = { E = "bob" },
}
