local rd = require "refdyn"
local p = rd.parameters { { "e", 0.6 }, { "floor", 0.3, "m" } }
return rd.model {
  name = "ball", gravity = { 0, 0, -9.81 },
  links = { { "ball", joint = "z", mass = 1, start = { z = p.floor + 1 } } },
  constraints = function(s)
    return { rd.contact { s.q.ball_z - p.floor, restitution = p.e, name = "floor" } }
  end,
}
