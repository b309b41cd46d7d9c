-- expect: 6: link a: moments of inertia 3 1 1; each must be at most the sum of the other two
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "phi" }, mass = 1, inertia = { xx = 3, yy = 1, zz = 1 } },
  },
}
