-- expect: 10: links[1].beam.section.area: value 0, a positive number is needed
-- expect: 10: links[1].beam.section.Iy: value 0, a positive number is needed
-- expect: 10: links[1].beam.section.Iz: value 0, a positive number is needed
-- expect: 10: links[1].beam.section.It: value 0, a positive number is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = { "psi" },
      beam = { length = 2, section = rd.round(0), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 3 } },
  },
}
