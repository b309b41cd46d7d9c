-- expect: 6: rd.rectangle: argument 2 is nothing; must be a number or an expression, as in rd.rectangle(width_y, height_z)
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.rectangle(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
  },
}
