-- expect: 9: links[1].bodies[1]: neither density nor mass, one of them is needed
-- expect: 10: links[1].bodies[2]: both density and mass, one of them is needed
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
