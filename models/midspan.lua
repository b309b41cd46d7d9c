-- A clamped beam with a pendulum on a hinge between its ends, at x = a. Checked against the deflection of a cantilever
-- under its own weight and a single load P, which beyond the load adds P a^2 (3 x - a) / (6 E I).
local rd = require "refdyn"
local n  = rd.option("n_rfe", 4, { from = 2 })
local p  = rd.parameters {
  { "L", 1.5, "m" }, { "a", 0.9, "m" }, { "d", 0.02, "m" }, { "E", 2.1e11, "Pa" }, { "nu", 0.3, "1" },
  { "rho", 7800, "kg/m^3" }, { "eta", 1e-4, "s" }, { "rope", 0.4, "m" }, { "m", 3, "kg" }, { "g", 9.81, "m/s^2" },
}

return rd.model {
  name = "midspan", gravity = { 0, 0, -p.g },
  links = {
    { "beam", beam = { length = p.L, section = rd.round(p.d), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta, rfe = n,
                     dofs = "psi, theta" } },
    { "rope", on = "beam", along = p.a, joint = "theta, phi", start = { theta = 0.2 },
      bodies = { { mass = p.m, center = { 0, 0, -p.rope } } } },
  },
  points = { hinge = { on = "beam", along = p.a }, tip = "beam.tip", load = { on = "rope", at = { 0, 0, -p.rope } } },
}
