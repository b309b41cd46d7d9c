-- expect: 8: links[1].joints: unknown field; did you mean "joint"?
-- expect: 9: links[2].joint: a number; must be a list of names such as { "a", "b" }
-- expect: 10: links[3].joint[2]: "w" is not a joint; use x, y, z, phi, theta or psi
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joints = "z", mass = 1, spring = { z = 1 }, start = { z = 1 } },
    { "b", joint = 5, mass = 1, damper = { z = 1 } },
    { "c", joint = { "z", "w" }, mass = 1, spring = { w = 1 } },
  },
}
