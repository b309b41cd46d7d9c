-- expect: 12: links[1].beam.section.Iz: value -1; must be positive
-- expect: 12: links[1].beam.section.It: missing; a section needs it
-- expect: 12: links[1].beam.E: value -1; must be positive
-- expect: 12: links[1].beam.nu: value 0.7; must be above -1 and at most 0.5
-- expect: 12: links[1].beam.rho: value 0; must be positive
-- expect: 12: links[1].beam.eta: value -0.001; must not be negative
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = { "psi" },
      beam = { length = 2, section = { area = 1, Iy = 1, Iz = -1 }, E = -1, nu = 0.7, rho = 0, rfe = 3, eta = -1e-3 } },
  },
}
