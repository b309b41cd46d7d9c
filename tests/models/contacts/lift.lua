local rd = require "refdyn"
local p = rd.parameters { { "e", 0.3 }, { "v", 0.4, "m/s" } }
return rd.model { name = "lift", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1 } },
  constraints = function(s) return { rd.contact { s.q.ball_z - p.v * rd.max(0, s.t - 0.5), restitution = p.e, name = "table" } } end }
