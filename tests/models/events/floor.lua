local rd = require "refdyn"
local p = rd.parameters { { "e", 0.6 }, { "floor", 0.3, "m" } }
return rd.model {
  name = "floor", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start = { z = 1 + p.floor } } },
  events = function(s) return { rd.event { s.q.ball_z - p.floor, restitution = p.e, name = "floor" } } end,
}
