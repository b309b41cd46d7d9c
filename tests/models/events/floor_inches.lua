local rd = require "refdyn"
local p = rd.parameters { { "e", 0.6 }, { "floor", 0.3, "m" } }
return rd.model {
  name = "floor_inches", gravity = { 0, 0, -9.81 },
  links = { { "base", at = {0,0,p.floor}, turn = {{"y", 0.3}, {"x", 0.2}} }, { "ball", on = "base", joint = "z", mass = 1, start = { z = 1 } } },
  points = { b = "ball" },
  events = function(s) return { rd.event { 25.4 * (s.points.b.z - p.floor), restitution = p.e, name = "floor" } } end,
}
