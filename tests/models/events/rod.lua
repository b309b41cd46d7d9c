local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 }, { "tilt", 0, "rad" } }
return rd.model {
  name = "rod", gravity = { 0, 0, -9.81 },
  links = { { "rod", joint = "x, z, theta", bodies = { rd.box { { 1, 0.02, 0.02 }, mass = 1 } }, start = { z = 0.5, theta = p.tilt } } },
  points = { L = { on = "rod", at = { -0.5, 0, 0 } }, R = { on = "rod", at = { 0.5, 0, 0 } } },
  events = function(s) return {
    rd.event { s.points.L.z, restitution = p.e, name = "left" },
    rd.event { s.points.R.z, restitution = p.e, name = "right" } } end,
}
