-- expect: 12: links[1].beam.segments[2].length: missing; a segment needs it
-- expect: 13: links[1].beam.segments[3].E: missing; a beam needs it
-- expect: 13: links[1].beam.segments[3].rfe: missing; a beam needs it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { section = rd.round(0.01), nu = 0.3, rho = 7800,
               segments = {
                 { length = 1, E = 2e11, rfe = 2 },
                 { rfe = 2, E = 2e11 },
                 { length = 1 },
               } } },
  },
}
