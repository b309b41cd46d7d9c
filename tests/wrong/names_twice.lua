-- expect: 9: links[1].beam.dofs[2]: "psi" is given twice; give it once
-- expect: 10: links[2].joint[2]: "z" is given twice; give it once
-- expect: 11: links[3].beam.dofs: has named entries (psi); must be a list of names such as { "a", "b" }
-- expect: 13: hold[3]: "a_z" is given twice; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", beam = { length = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4, dofs = "psi, psi" } },
    { "b", joint = "z, z", mass = 1 },
    { "c", joint = "z", beam = { length = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4, dofs = { psi = true } } },
  },
  hold = "a_z,b_z,a_z",
}
