-- A flexible arm that falls until its tip hits a stop.
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.6 }, { "stop", -0.35, "m" } }
return rd.model {
  name = "arm", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", turn = { { "x", rd.pi / 2 } }, joint = { "psi" },
      beam = { length = 1, section = rd.rectangle(0.003, 0.03), E = 7e10, nu = 0.3, rho = 2700, rfe = 3, dofs = { "psi" } } },
    { "tip", on = "arm.tip", mass = 0.05 },
  },
  points = { T = "arm.tip" },
  events = function(s) return { rd.event { s.points.T.z - p.stop, restitution = p.e, name = "stop" } } end,
}
