-- expect: 7: links[1].damper.x: value -1; must not be negative
-- expect: 7: links[1].start.y: the link has no such joint; use x
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "x", start = { y = 1 }, damper = { x = -1 }, mass = 1 },
  },
}
