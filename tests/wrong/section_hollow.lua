-- expect: 6: rd.tube: inner diameter 0.02; must be less than the outer diameter, 0.01
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.tube(0.01, 0.02), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
  },
}
