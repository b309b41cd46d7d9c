-- expect: 4: gravity: 2 numbers; must have 3
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
}
