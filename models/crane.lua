-- A crane: a flexible boom on a slewing column, and a load on a rope that hoists it smoothly. Checked with a stiff boom: the
-- load swings with the period of a pendulum of any amplitude, 4 sqrt(l/g) K(sin(angle/2)). Checked with the flexible boom:
-- the balance of energy, and the angular momentum about the column, which is the time integral of the slewing torque.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 3, { from = 1 })
local p  = rd.parameters {
  { "E", 2.1e11, "Pa" }, { "nu", 0.3, "1" }, { "rho", 7850, "kg/m^3" }, { "eta", 0, "s" }, { "L", 4, "m" },
  { "luff", 0.5, "rad" }, { "rope", 2.5, "m" }, { "lift", 0.8, "m" }, { "m", 60, "kg" }, { "swing", 0.3, "rad" },
  { "slew", 20, "N m" }, { "g", 9.81, "m/s^2" },
}

return rd.model {
  name = "crane", gravity = { 0, 0, -p.g },
  links = {
    { "column", joint = "psi",
      bodies = { rd.cylinder { diameter = 0.3, length = 2, axis = "z", density = p.rho, at = { 0, 0, 1 } },
                 rd.box { { 0.8, 0.6, 0.5 }, mass = 400, at = { -0.9, 0, 1.8 } } } },
    { "boom", on = "column", at = { 0, 0, 2 }, turn = { { "y", -p.luff } },
      beam = { length = p.L, section = rd.tube(0.09, 0.08), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta, rfe = n } },
    { "rope", on = "boom.tip", turn = { { "y", p.luff } }, joint = "theta, phi", start = { theta = p.swing } },
    { "load", on = "rope", joint = "z", start = { z = -p.rope }, mass = p.m },
  },
  points = { head = "boom.tip", hook = "load" },
  forces = function(s) return { column_psi = p.slew * rd.ramp(s.t, 0, 1) } end,
  constraints = function(s)
    return { rd.drive { "load_z", p.lift * rd.smoothstep(s.t, 1, 4) - p.rope, alpha = 20, beta = 20, name = "hoist" } }
  end,
  hold = "column_psi, load_z",
}
