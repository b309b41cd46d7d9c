-- A planar four-bar of hinges about z, closed by a hinge in space: three of its five rows are redundant. A
-- parallelogram: crank and rocker 0.3 m, coupler 0.8 m, so that rocker_psi = crank_psi and the coupler stays level,
-- coupler_psi = -crank_psi. The loop closes in every position: with T = crank_psi alone,
-- M = 0.3^2 (m_coupler + 2 m_bar / 3) = 0.09 (1.2 + 0.5) = 0.153 kg m^2.
local rd = require "refdyn"
local function bar(length, mass)
  return { rd.box { { length, 0.02, 0.02 }, mass = mass, at = { length / 2, 0, 0 } } }
end

return rd.model {
  name = "four_bar", gravity = { 0, -9.81, 0 },
  links = {
    { "crank", joint = "psi", start = { psi = 1 }, bodies = bar(0.3, 0.75) },
    { "coupler", on = "crank", at = { 0.3, 0, 0 }, joint = "psi", start = { psi = -1 }, bodies = bar(0.8, 1.2) },
    { "rocker", at = { 0.8, 0, 0 }, joint = "psi", start = { psi = 1 }, bodies = bar(0.3, 0.75) },
  },
  points = { pin = { on = "coupler", at = { 0.8, 0, 0 } } },
  constraints = function(s)
    return { rd.close { "pin", { on = "rocker", at = { 0.3, 0, 0 } }, joint = "psi", alpha = 20, beta = 20 } }
  end,
}
