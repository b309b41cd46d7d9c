-- A clamped beam, 1 m long, bent by a dead load P at its tip (Mattiasson 1981), or rolled up by a moment M there, fixed
-- in space or turning with the tip. Planar; the load is a slide's weight, the beam's own mass is negligible.
-- E I = 1 N m^2, P in units of E I / L^2, M of E I / L.
local rd = require "refdyn"
local n = rd.option("n_rfe", 11)
local follows = rd.option("follows", false)
local P = rd.parameter("P", 1, "N")
local M = rd.parameter("M", 0, "N m")
local g = rd.parameter("g", 10, "m/s^2")

return rd.model {
  name = "cantilever", gravity = { 0, -g, 0 },
  links = {
    { "root", joint = { "psi" }, beam = { length = 1, section = { area = 1e-6, Iy = 1, Iz = 1, It = 1 }, E = 1, nu = 0,
                                          rho = 1e-9, rfe = n, dofs = { "psi" } } },
    { "load", on = "root.tip", mass = P / 10 },
  },
  points = { E = "root.tip" },
  forces = function() return { rd.torque { "root.tip", { 0, 0, M }, axes = follows and "root.tip" or nil } } end,
  hold = { "root_psi" },
}
