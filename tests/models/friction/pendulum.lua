-- A pendulum with a dry joint: its swings die out, and it sticks off the vertical.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "rad/s" } }

return rd.model {
  name = "friction_pendulum", gravity = { 0, -9.81, 0 },
  links = { { "bar", turn = { { "z", -rd.pi / 2 } }, joint = "psi", start = { psi = 1.2 }, mass = 2, center = { 0.5, 0, 0 } } },
  forces = function(s) return { bar_psi = rd.friction(1.1, s.qd.bar_psi, p.w) } end,
}
