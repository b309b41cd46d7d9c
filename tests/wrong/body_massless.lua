-- expect: 6: link a: moments of inertia 1 1 3; each must be at most the sum of the other two
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        { mass = 1, inertia = { xx = 1, yy = 1, zz = 3 } },
      } },
  },
}
