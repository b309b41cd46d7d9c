-- expect: 8: links[1].mass: value -1; must be positive
-- expect: 9: links[2].bodies[1].densty: unknown field; did you mean "density"?
-- expect: 10: links[3].bodies[1].diametre: unknown field; did you mean "diameter"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = -1, inertia = { xx = 1, yy = 1, zz = 5 } },
    { "b", joint = "z", bodies = { rd.box { { 1, 1, 1 }, densty = 100 } } },
    { "c", joint = "z", bodies = { rd.cylinder { diametre = 1, length = 1, mass = 1 } } },
  },
}
