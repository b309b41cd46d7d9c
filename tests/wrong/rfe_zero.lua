-- expect: 7: links[1].beam.rfe: value 0; must be a whole number from 1 to 10000
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = { "psi" },
      beam = { length = 2, section = rd.round(0.01), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 0 } },
  },
}
