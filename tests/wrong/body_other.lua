-- expect: 10: links[1].bodies[1]: made by rd.spring; must be a body such as rd.box { ... } or { mass = 1 }
-- expect: 11: links[1].bodies[2].mass: missing; a body needs it
-- expect: 12: links[1].bodies[3]: a number; must be a table
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.spring { mass = 1 },
        { center = { 0, 0, 0 } },
        7,
      } },
  },
}
