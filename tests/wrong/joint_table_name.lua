-- expect: 7: links[1].start.x: a text, a number or an expression is needed
-- expect: 7: links[1].spring.z: the link has no such joint, it has x
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1, spring = { z = 3 }, start = { x = "far" } },
  },
}
