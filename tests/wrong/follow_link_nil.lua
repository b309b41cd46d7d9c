-- expect: 5: item 2 of a list is nil; lists must have no gaps
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    nil,
    { "hand", on = "finger", joint = "psi", mass = 1, inertia = { zz = 1 } },
    { "finger", on = "arm", mass = 1 },
  },
  points = { E = "finger" },
}
