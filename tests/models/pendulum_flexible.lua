-- The flexible pendulum of oracle/traj_pendulum_4.json: a rod of 4 elements on a hinge, with an eccentric point mass.
local rd = require "refdyn"
local diameter = 0.01413200743 -- [m]

return rd.model {
  name = "pendulum_flexible", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", turn = { { "x", rd.pi/2 } }, joint = { "psi" },
      beam = { length = 2, section = rd.round(diameter), E = 2.1e11, nu = 0.3, rho = 7801, rfe = 4, springs = "printed" } },
    { "load", on = "arm.tip", mass = 0.5, center = { 0.05, 0.1, -0.08 } },
  },
}
