-- expect: 7: links[1].start.x: a text; must be a number or an expression
-- expect: 7: links[1].spring.z: the link has no such joint; use x
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1, spring = { z = 3 }, start = { x = "far" } },
  },
}
