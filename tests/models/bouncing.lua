-- A flexible arm whose tip bounces on a moving stop, and a slide that an event pushes: tests the emitted C of events.
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 }, { "s", 400, "N/m" }, { "A", 0.02, "m" } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "bouncing", gravity = { 0, 0, -9.81 },
  links = {
    { "slide", joint = "x", mass = 3, spring = { x = p.s }, damper = { x = 2 } },
    { "arm", on = "slide", turn = { { "x", rd.pi / 2 } }, joint = "psi", spring = { psi = 30 }, damper = { psi = 0.1 },
      beam = { length = 1, section = rd.round(0.012), E = 7e10, nu = 0.3, rho = 2700, eta = 1e-3, rfe = 6 } },
  },
  points = { T = "arm.tip" },
  forces = function(s) return { slide_x = push } end,
  events = function(s)
    local T = s.points.T
    return {
      rd.event { T.z + 0.05 - p.A * rd.sin(9 * s.t), restitution = p.e, name = "stop" },
      rd.event { T.xd - 0.2 * s.qd.arm_psi, direction = "up", rates = { slide_x = -0.5 * s.qd.slide_x },
                 inputs = { push = -push } },
      { rd.event { s.q.slide_x - 2, ends = true, name = "out of reach" } },
    }
  end,
}
