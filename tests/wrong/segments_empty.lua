-- expect: 6: links[1].beam.segments: empty; a beam needs at least one
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi", beam = { section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2, segments = {} } },
  },
}
