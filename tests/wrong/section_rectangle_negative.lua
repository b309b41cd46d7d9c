-- expect: 7: rd.rectangle: argument 1: value -0.1; must be positive
local rd = require "refdyn"
local p = rd.parameters { { "d", 0.1, "m" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.rectangle(-p.d, -p.d), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
  },
}
