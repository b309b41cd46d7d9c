-- expect: 10: points.F: a number; must be the name of a link, or { on = ..., at = ... }
-- expect: 10: points.G.on: missing; a point needs it
-- expect: 10: points.E: no link "b"; use a
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  points = { E = "b", F = 3, G = { at = { 0, 0, 0 } } },
}
