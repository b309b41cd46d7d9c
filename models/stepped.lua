-- A clamped beam of three sections, thinner towards the tip, with a load at the tip. Checked against the deflection of a
-- stepped Euler-Bernoulli cantilever: the integral of P (L - x)^2 / (E I(x)).
local rd = require "refdyn"
local n  = rd.option("n", 1, { from = 1 })                              -- refines all three sections
local p  = rd.parameters {
  { "E", 7e10, "Pa" }, { "nu", 0.33, "1" }, { "rho", 2700, "kg/m^3" } }
local P_down, P_across, T_tip = rd.input("P_down", 20, "N"), rd.input("P_across", 5, "N"), rd.input("T_tip", 0, "N m")

return rd.model {
  name = "stepped",
  links = {
    { "boom", beam = { E = p.E, nu = p.nu, rho = p.rho, damping = { ratio = 0.01, frequency = 20 },
      segments = {
        { length = 0.6, section = rd.rectangle(0.03, 0.05), rfe = 2 * n },
        { length = 0.4, section = rd.tube(0.03, 0.02), rfe = 2 * n },
        { length = 0.3, section = rd.round(0.016), rfe = 2 * n },
      } } },
  },
  points = { tip = "boom.tip", first = { on = "boom", along = 0.6 }, second = { on = "boom", along = 1 } },
  forces = function()
    return { rd.force { "tip", { 0, P_across, -P_down } }, rd.torque { "boom.tip", { T_tip, 0, 0 } } }
  end,
}
