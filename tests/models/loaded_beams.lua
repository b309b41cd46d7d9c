-- Beams with different numbers of elements, long enough to become loops: a tree of three, one planar, one
-- carried by a slide, with forces of every kind beyond them that depend on positions and rates, and rows. They are so soft
-- that springs do not hide gravity and loads. Without the input, at rest and t = 0, all forces have a potential.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 5, { from = 1 })
local p  = rd.parameters { { "E", 2e6, "Pa" }, { "k", 9, "N/m" }, { "c", 0.7, "N s/m" }, { "eta", 0.01, "s" } }
local on = rd.input("on", 1)

local function beam(length, rfe, dofs)
  return { length = length, section = rd.tube(0.05, 0.02), E = p.E, nu = 0.3, rho = 300, eta = p.eta, rfe = rfe, dofs = dofs }
end

return rd.model {
  name = "loaded_beams", gravity = { 0.3, -0.2, -9.81 },
  links = {
    { "trunk", joint = { "z", "psi" }, start = { psi = 0.2 }, spring = { z = 800 }, damper = { z = 3 },
      mass = 1, inertia = { zz = 0.02 }, beam = beam(0.5, n + 1, "theta psi") },
    { "left", on = "trunk.tip", at = { 0.02, 0.01, 0 }, joint = { "phi" }, beam = beam(0.4, n), mass = 0.1 },
    { "ball", on = "left.tip", at = { 0.03, 0, 0.02 }, mass = 0.3 },
    { "right", on = "trunk.tip", joint = { "x", "theta" }, spring = { theta = 5 }, beam = beam(0.3, n + 3, "psi") },
    { "weight", on = "right.tip", joint = { "y" }, mass = 0.2, center = { 0.1, 0, 0.03 }, spring = { y = 60 } },
  },
  points = { ball = "ball", hand = "right.tip", load = "weight" },
  forces = function(s)
    local P, H = s.points.ball, s.points.hand
    return {
      weight_y = -2 * on * s.q.weight_y^3 - p.c * H.xd * P.y,
      rd.spring { "ball", { on = "ground", at = { 1, 1, 0.3 } }, stiffness = p.k, rest = 0.4 },
      rd.damper { "hand", "ball", damping = p.c },
      rd.force { "hand", { on * P.z, 2 * s.qd.right_x, -3 * on }, axes = "right.tip" },
      rd.torque { "ball", { 0.1 * on * H.y, 0.2 * on, 0.3 * s.t }, axes = "ball", against = "trunk" },
      rd.energy { p.k * P.z^2 * s.q.trunk_psi + H.x^2 },
    }
  end,
  constraints = function(s)
    local E, start = s.points.ball, s.start.points.ball
    local path = rd.parameter("path", start.x^2 + start.y * start.z, "m^2")
    return {
      rd.position { E.x^2 + E.y * E.z - path - 0.1 * s.t^2, alpha = 3, beta = 4, name = "path" },
      rd.velocity { s.points.load.yd * s.points.load.x - s.qd.trunk_z, alpha = 2, name = "speed" },
    }
  end,
}
