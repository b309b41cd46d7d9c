-- A clamped beam that bends in one plane: slender (d/L = 5e-5) and weightless, or upright under its own
-- weight. E I, rho A and L are 1, so that omega = (beta L)^2; `g` is in units of E I / (rho A L^3).
local rd = require "refdyn"
local n = rd.option("n_rfe", 5)
local d = 5e-5
local area, I = rd.pi * d^2 / 4, rd.pi * d^4 / 64
local g = rd.parameter("g", 0, "m/s^2")

return rd.model {
  name = "clamped_beam", gravity = { -g, 0, 0 },
  links = { { "rod", beam = { length = 1, section = { area = area, Iy = I, Iz = I, It = 2 * I }, E = 1 / I, nu = 0,
                              rho = 1 / area, rfe = n, dofs = "psi" } } },
  points = { E = "rod.tip" },
}
