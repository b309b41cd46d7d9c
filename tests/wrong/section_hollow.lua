-- expect: 6: rd.tube: from 0.02 to 0.01, an outer diameter above the inner one is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.tube(0.01, 0.02), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
  },
}
