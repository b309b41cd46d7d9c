-- expect: 9: links[1].beam.damping.mode: value 4; must be 1, 2 or 3
-- expect: 9: links[1].beam.damping.ratio: eta is given too; give one of them
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "rod", joint = "psi",
      beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 2, eta = 1e-3,
               damping = { ratio = 0.01, mode = 4 } } },
  },
}
