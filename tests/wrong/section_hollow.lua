-- expect: 9: links[1].beam.section.area: value -0.000235619, a positive number is needed
-- expect: 9: links[1].beam.section.Iy: value -7.36311e-09, a positive number is needed
-- expect: 9: links[1].beam.section.Iz: value -7.36311e-09, a positive number is needed
-- expect: 9: links[1].beam.section.It: value -1.47262e-08, a positive number is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = rd.tube(0.01, 0.02), E = 2e11, nu = 0.3, rho = 7800, rfe = 2 } },
  },
}
