-- expect: 9: links[1].beam.section.Iy: missing; a section needs it
-- expect: 9: links[1].beam.section.Iz: missing; a section needs it
-- expect: 9: links[1].beam.section.It: missing; a section needs it
-- expect: 9: links[1].beam.nu: value 0.6; must be above -1 and at most 0.5
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { length = 1, section = { area = 1e-4 }, E = 2e11, nu = 0.6, rho = 7800, rfe = 2 } },
  },
}
