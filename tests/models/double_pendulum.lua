-- Two bodies on two hinges that are not parallel, from a raised position: a smooth motion without constraints.
local rd = require "refdyn"

return rd.model {
  name = "double_pendulum", gravity = { 0, 0, -9.81 },
  links = {
    { "upper", joint = { "theta" }, start = { theta = 1.35 }, mass = 1.2, center = { 0.35, 0, -0.1 },
      inertia = { xx = 0.02, yy = 0.05, zz = 0.06, xy = 0.004 } },
    { "lower", on = "upper", at = { 0.7, 0, 0 }, turn = { { "x", 0.45 } }, joint = { "theta" }, start = { theta = -0.65 },
      mass = 0.8, center = { 0.25, 0.06, 0 }, inertia = { xx = 0.01, yy = 0.03, zz = 0.035, yz = -0.002 } },
  },
  points = { E = "lower" },
}
