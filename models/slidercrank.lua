-- A slider-crank with a flexible rod; the crank is driven from rest to a steady rate. Checked with a rigid rod against
-- x = r cos a + sqrt(l^2 - r^2 sin^2 a). Checked with the flexible one: energy, and the limit of high stiffness.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 4, { from = 1 })
local p  = rd.parameters {
  { "r", 0.15, "m" }, { "l", 0.5, "m" }, { "E", 7e10, "Pa" }, { "nu", 0.33, "1" }, { "rho", 2700, "kg/m^3" },
  { "eta", 1e-4, "s" }, { "m_slider", 1.2, "kg" }, { "angle", 0.6, "rad" }, { "rate", 15, "rad/s" }, { "T", 0.3, "s" },
}
local tilt = -rd.asin(p.r * rd.sin(p.angle) / p.l)                      -- of the rod, at the start

-- The rate rises as 1 - cos until T and then stays constant.
local function crank(t)
  local rising = rd.min(t, p.T)
  return p.angle + p.rate * (rising / 2 - p.T / (2 * rd.pi) * rd.sin(rd.pi * rising / p.T) + rd.max(t - p.T, 0))
end

return rd.model {
  name = "slidercrank",
  links = {
    { "crank", joint = "psi", start = { psi = p.angle },
      bodies = { rd.cylinder { diameter = 0.1, length = 0.02, axis = "z", density = p.rho } } },
    { "rod", on = "crank", at = { p.r, 0, 0 }, joint = "psi", start = { psi = tilt - p.angle },
      beam = { length = p.l, section = rd.rectangle(0.008, 0.02), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta,
               rfe = n, dofs = "psi" } },
    { "slider", on = "rod.tip", mass = p.m_slider },
  },
  points = { slider = "slider", middle = { on = "rod", along = p.l / 2 } },
  constraints = function(s)
    return {
      rd.drive { "crank_psi", crank(s.t), alpha = 100, beta = 100 },
      rd.loop { "slider", "ground", keep = "y", alpha = 100, beta = 100, name = "guide" },
    }
  end,
}
