-- expect: 7: rd.round: argument 1: value 0; must be positive
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = { "psi" },
      beam = { length = 2, section = rd.round(0), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 3 } },
  },
}
