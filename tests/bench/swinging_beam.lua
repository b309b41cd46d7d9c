-- A steel rod on a hinge, let go level: planar, undamped, 8 elements.
local rd = require "refdyn"

return rd.model {
  name = "swinging_beam", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", turn = { { "x", rd.pi / 2 } }, joint = { "psi" },
      beam = { length = 2, section = rd.round(0.0141), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 8, dofs = { "psi" } } },
  },
  points = { E = "arm.tip" },
}
