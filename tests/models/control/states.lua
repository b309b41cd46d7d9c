-- Continuous states: read by forces, points and courses, with kinks, next to a closed loop and a beam.
local rd = require "refdyn"
local p = rd.parameters {
  { "m", 1.3, "kg" }, { "R", 0.8, "ohm" }, { "L", 0.04, "H" }, { "k", 0.3, "N m/A" }, { "most", 2, "A" }, { "i0", 0.2, "A" }, { "tau", 0.05, "s" },
}
local u = rd.input("u", 3, "V")

return rd.model {
  name = "states", gravity = { 0, 0, -9.81 },
  links = {
    { "base", joint = { "x", "theta" }, mass = p.m, center = { 0.1, 0, 0.2 }, inertia = { xx = 0.01, yy = 0.02, zz = 0.03 }, spring = { x = 40 },
      damper = { theta = 0.2 }, start = { x = 0.1, theta = 0.2 }, start_rate = { theta = 0.3 } },
    { "arm", on = "base", at = { 0, 0, 0.3 }, joint = { "psi" },
      beam = { length = 0.8, section = rd.round(0.02), E = 2e9, nu = 0.3, rho = 1200, eta = 1e-3, rfe = 3 } },
  },
  points = { E = "arm.tip" },
  states = function(s)
    return {
      rd.state { "i", rate = (u - p.R * s.states.i - p.k * s.qd.arm_psi) / p.L, start = p.i0, unit = "A" },
      rd.state { "filtered", rate = (s.points.E.xd * s.states.i - s.states.filtered) / p.tau + rd.sin(s.t) },
      rd.state { "sum", rate = rd.max(s.states.filtered, -0.1) + s.q.base_theta^2, start = -0.3, scale = 10 },
    }
  end,
  forces = function(s)
    return {
      arm_psi = p.k * rd.min(s.states.i, p.most), base_theta = -0.4 * s.states.sum * rd.cos(s.q.arm_psi),
      rd.force { "arm.tip", { s.states.filtered * s.q.base_x, 0, s.states.i * s.states.sum } },
    }
  end,
  constraints = function(s) return { rd.velocity { s.qd.base_theta - 0.3 * rd.cos(s.t) + 0.1 * s.qd.base_x } } end,
  courses = function(s) return { heat = p.R * s.states.i^2 } end,
}
