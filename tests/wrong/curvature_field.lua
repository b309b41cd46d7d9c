-- expect: 7: links[1].beam.curvature.x: unknown field; use one of psi, theta, phi
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2, curvature = { x = 1 } } },
  },
}
