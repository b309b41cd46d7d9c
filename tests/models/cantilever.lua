-- A clamped beam, 1 m long, bent by a dead load P at its tip (Mattiasson 1981). Planar; the load is a slide's weight,
-- the beam's own mass next to nothing. E I = 1 N m^2, P in units of E I / L^2.
local rd = require "refdyn"
local n = rd.option("n_rfe", 11)
local P = rd.parameter("P", 1, "N")

return rd.model {
  name = "cantilever", gravity = { 0, -10, 0 },
  links = {
    { "root", joint = { "psi" }, beam = { length = 1, section = { area = 1e-6, Iy = 1, Iz = 1, It = 1 }, E = 1, nu = 0,
                                          rho = 1e-9, rfe = n, dofs = { "psi" } } },
    { "load", on = "root.tip", mass = P / 10 },
  },
  points = { E = "root.tip" },
  hold = { "root_psi" },
}
