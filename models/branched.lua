-- A free body with two arms, one of which branches again. It combines slides and turns at one link, a ball joint, products
-- of inertia, springs with rest values, an input, and one row of each level.
local rd = require "refdyn"
local p  = rd.parameters {
  { "k", 120, "N/m" }, { "rest", 0.15, "m" }, { "c", 1.5, "N s/m" }, { "gain", 20, "1/s" }, { "g", 9.81, "m/s^2" },
}
rd.input("thrust", 12.5, "N")

return rd.model {
  name = "branched", gravity = { 0, 0, -p.g },
  links = {
    { "hand", on = "fore", at = { 0.02, 0, 0.35 }, turn = { { "z", 0.3 }, { "x", -rd.pi / 2 } },
      joint = { "psi", "theta", "phi" }, start = { psi = 0.2, theta = -0.3, phi = 0.1 },
      mass = 0.45, center = { 0.01, 0.12, -0.03 }, inertia = { xx = 3e-3, yy = 1e-3, zz = 3.5e-3, xz = -2e-4, yz = 1e-4 } },
    { "body", joint = { "x", "y", "z", "psi", "theta", "phi" }, start = { z = 1.2, theta = 0.1 },
      start_rate = { x = 0.4, psi = 0.7 }, spring = { z = p.k }, rest = { z = 1 }, damper = { z = p.c },
      mass = 6.5, center = { 0.02, -0.01, 0.05 },
      inertia = { xx = 0.31, yy = 0.27, zz = 0.22, xy = 0.015, xz = -0.02, yz = 0.01 } },
    { "fore", on = "body", at = { 0.25, 0.1, 0 }, turn = { { "y", 0.6 } }, joint = { "theta", "z" },
      start = { theta = 0.5, z = 0.1 }, spring = { z = 2 * p.k, theta = 4.5 }, rest = { z = p.rest, theta = 0.25 },
      damper = { theta = 0.3 }, mass = 1.1, center = { 0, 0.01, 0.17 }, inertia = { xx = 0.012, yy = 0.012, zz = 0.002 } },
    { "plate", on = "fore", at = { 0, 0.05, 0.1 }, mass = 0.2, inertia = { xx = 4e-4, yy = 4e-4, zz = 8e-4 } },
    { "tail", on = "body", at = { -0.3, 0, 0.05 }, joint = { "psi", "phi" }, damper = { psi = 0.2, phi = 0.2 },
      beam = { length = 0.9, section = { area = 2e-4, Iy = 4e-9, Iz = 2e-9, It = 3e-9 }, E = 3e9, nu = 0.35, rho = 1200,
               eta = 2e-3, rfe = 3, dofs = { "psi", "theta" } } },
  },
  points = { hand = { on = "hand", at = { 0, 0.2, 0 } }, tail = "tail.tip", centre = "body" },
  forces = function(s)
    return { body_z = s.inputs.thrust * rd.ramp(s.t, 0, 0.5), tail_psi = -0.4 * rd.tanh(5 * s.qd.tail_psi) }
  end,
  constraints = function(s)
    local hand, body = s.points.hand, s.points.centre
    local reach = rd.parameter("reach", s.start.points.hand.z - s.start.points.centre.z, "m")
    return {
      rd.position { hand.z - body.z - reach, alpha = p.gain, beta = p.gain, name = "reach" },
      rd.velocity { hand.xd - body.xd + 0.2 * s.q.body_psi * body.yd, alpha = p.gain, name = "follow" },
      rd.acceleration { s.qdd.tail_phi + 3 * s.q.tail_phi + 0.5 * rd.sin(s.t), name = "nod" },
    }
  end,
}
