-- expect: 10: links[1].bodies[1].size[2]: value 0; must be positive
-- expect: 11: links[1].bodies[2].size: 2 numbers; must have 3
-- expect: 12: links[1].bodies[3].size: missing; a box needs it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.box { { 1, 0, 1 }, mass = 1 },
        rd.box { { 1, 1 }, mass = 1 },
        rd.box { mass = 1 },
      } },
  },
}
