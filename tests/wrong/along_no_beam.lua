-- expect: 8: links[2].along: the link is not a beam; only a beam has places along it
-- expect: 9: links[3].along: has no effect without on; add on
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
    { "b", on = "a", along = 0.2, mass = 1 },
    { "c", along = 0.2, mass = 1 },
  },
}
