local rd = require "refdyn"
local p = rd.parameters { { "e", 0.4 } }
return rd.model {
  name = "wall", gravity = { 0, 0, -9.81 },
  links = { { "pend", joint = "theta", bodies = { rd.box { { 0.05, 0.05, 1 }, mass = 1, at={0,0,-0.5} } }, start = { theta = -0.8 } } },
  points = { tip = { on = "pend", at = { 0, 0, -1 } } },
  forces = function(s) return { pend_theta = 6 * rd.sin(1.3 * s.t) } end,
  constraints = function(s) return { rd.contact { s.points.tip.x + 0.1, restitution = p.e, name = "wall" } } end,
}
