-- expect: 9: links[1].bodies[1]: has neither density nor mass; give one of them
-- expect: 10: links[1].bodies[2]: has both density and mass; give one of them
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.box { { 1, 1, 1 } },
        rd.sphere { diameter = 1, mass = 1, density = 1 },
      } },
  },
}
