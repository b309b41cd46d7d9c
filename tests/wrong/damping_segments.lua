-- expect: 7: links[1].beam.damping.ratio: the modes of a beam of several segments are not known here; add frequency
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2, damping = { ratio = 0.01 },
               segments = { { length = 1 }, { length = 1 } } } },
  },
}
