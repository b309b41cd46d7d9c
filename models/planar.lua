-- An arm with two flexible links in a horizontal plane, driven at both hinges. Its tip moves along a line x + y = const at
-- the rate that the second row prescribes.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 3, { from = 1 })
local p  = rd.parameters {
  { "L1", 0.8, "m" }, { "L2", 0.6, "m" }, { "m_load", 0.4, "kg" }, { "E", 7e10, "Pa" }, { "nu", 0.33, "1" },
  { "rho", 2700, "kg/m^3" }, { "eta", 1e-3, "s" }, { "speed", 0.1, "m/s" }, { "alpha", 50, "1/s" }, { "beta", 50, "1/s" },
}
rd.input("tau_1", 0, "N m")
rd.input("tau_2", 0, "N m")

local function beam(length, width)
  return { length = length, section = rd.tube(width, 0.7 * width), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta,
           rfe = n, dofs = "psi" }
end

return rd.model {
  name = "planar",
  links = {
    { "upper", joint = { "psi" }, start = { psi = 0.4 }, beam = beam(p.L1, 0.02), mass = 0.3,
      inertia = { zz = 1e-3 } },                                        -- the hub of the first motor
    { "lower", on = "upper.tip", joint = { "psi" }, start = { psi = 1.1 }, damper = { psi = 0.02 },
      beam = beam(p.L2, 0.015), mass = 0.5 },
    { "load", on = "lower.tip", at = { 0.03, 0, 0 }, mass = p.m_load },
  },
  points = { elbow = "upper.tip", tip = "load" },
  forces = function(s) return { upper_psi = s.inputs.tau_1, lower_psi = s.inputs.tau_2 } end,
  constraints = function(s)
    local E, start = s.points.tip, s.start.points.tip
    local line = rd.parameter("line", start.x + start.y, "m")
    return {
      rd.position { E.x + E.y - line, alpha = p.alpha, beta = p.beta, name = "line" },
      rd.velocity { E.xd - p.speed * rd.smoothstep(s.t, 0, 1), alpha = p.alpha, name = "speed" },
    }
  end,
}
