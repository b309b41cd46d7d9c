-- expect: 4: links[1].beam.u: unknown field; did you mean "nu"?
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "psi", beam = {
  length = 1, section = rd.round(0.01), E = 2e11, u = 0.3, rho = 7800, rfe = 2 } } } }
