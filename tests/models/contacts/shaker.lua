local rd = require "refdyn"
local p = rd.parameters { { "e", 0.3 }, { "A", 0.02, "m" }, { "w", 30, "rad/s" } }
return rd.model { name = "shaker", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start_rate = { z = p.A * p.w } } },
  constraints = function(s) return { rd.contact { s.q.ball_z - p.A * rd.sin(p.w * s.t), restitution = p.e, name = "table" } } end }
