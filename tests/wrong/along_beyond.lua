-- expect: 9: links[2].along: value 1.2, the beam ends at 1
-- expect: 10: links[3].along: beside the tip of the beam, only a beam has places along it
-- expect: 11: links[4].along: value -0.2, a number not below 0 is needed
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
