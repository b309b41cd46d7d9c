-- expect: 7: links[1].beam.dofs: "chi" is not a turn of an element; use psi, theta or phi
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = { "psi" },
      beam = { length = 2, section = rd.round(0.01), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 3, dofs = "psi,chi" } },
  },
}
