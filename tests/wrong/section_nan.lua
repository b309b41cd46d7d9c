-- expect: 6: rd.round: argument 1: value nan; must be finite
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", beam = { length = 1, section = rd.round(0 / 0), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
  },
}
