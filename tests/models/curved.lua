-- A bar whose unloaded shape is bent and twisted: an arc of 1.2 rad/m about z (option `turn` = psi) or about y (theta),
-- or a twist of 1.2 rad/m (phi). The moment E I 1.2 at its end, here 0.6 N m, against the bend straightens it.
local rd = require "refdyn"
local turn = rd.option("turn", "psi", { "psi", "theta", "phi" })
local M = rd.input("M", 0, "N m")
local axes = { psi = { 0, 0, M }, theta = { 0, M, 0 }, phi = { M, 0, 0 } }

return rd.model {
  name = "curved",
  links = {
    { "bar", beam = { length = 0.9, section = { area = 1e-4, Iy = 5e-10, Iz = 5e-10, It = 1e-9 }, E = 1e9, nu = 0,
                      rho = 1000, curvature = { [turn] = 1.2 }, rfe = 4 } },
  },
  points = { tip = { on = "bar.tip", at = { 0, 0.1, 0 } } },
  forces = function() return { rd.torque { "bar.tip", axes[turn], axes = "bar.tip" } } end,
}
