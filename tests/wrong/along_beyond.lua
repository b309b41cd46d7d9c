-- expect: 9: links[2].along: value 1.2; must be at most the length of the beam, 1
-- expect: 10: links[3].along: given together with the tip of the beam; give one of them
-- expect: 11: links[4].along: value -0.2; must not be negative
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
    { "b", on = "rod", along = 1.2, mass = 1 },
    { "c", on = "rod.tip", along = 0.2, mass = 1 },
    { "d", on = "rod", along = -0.2, mass = 1 },
  },
}
