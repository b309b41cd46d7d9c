-- expect: 9: links[1].beam.damping.mode: has no effect without ratio; add ratio
-- expect: 9: links[1].beam.damping: has both mode and frequency; give the one to which the ratio belongs
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2,
               damping = { mode = 1, frequency = 10 } } },
  },
}
