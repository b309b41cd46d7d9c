-- A ball that bounces on a stiff spring, and nothing else.
local rd = require "refdyn"
local p = rd.parameters { { "k", 1e5, "N/m" }, { "h", 1, "m" } }
return rd.model {
  name = "stiff", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start = { z = p.h } } },
  forces = function(s) return { ball_z = p.k * rd.max(0, -s.q.ball_z) } end,
}
