-- expect: 8: links[1].beam.length: given together with segments, whose lengths add up to it; remove it
-- expect: 9: links[1].beam.segments[2].rfe: value 0; must be a whole number from 1 to 10000
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2,
               segments = { { length = 1 }, { length = 2, rfe = 0 } } } },
  },
}
