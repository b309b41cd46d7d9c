-- expect: 9: links[1].bodies[1].diametre: unknown field; did you mean "diameter"?
-- expect: 9: links[1].bodies[1].radius: unknown field; use one of diameter, axis, length, density, mass, at, turn
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.cylinder { radius = 0.1, diametre = 0.2, length = 1, mass = 1 },
      } },
  },
}
