-- expect: 11: links[1].beam.section.area: missing; a section needs it
-- expect: 11: links[1].beam.section.Iz: missing; a section needs it
-- expect: 11: links[1].beam.section.It: missing; a section needs it
-- expect: 11: links[1].beam.damping.all: unknown field; use one of psi, theta, phi, ratio, mode, tip_mass, frequency
-- expect: 11: links[1].beam.curvature: a number; must be a curvature such as { psi = 0.1 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { E = 2e11, nu = 0.3, rho = 7800, rfe = 2, section = { Iy = 1 }, damping = { all = 1 }, curvature = 3,
               segments = { { length = 1 }, { length = 1 } } } },
  },
}
