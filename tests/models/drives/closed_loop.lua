local rd = require "refdyn"
local p = rd.parameters { { "T", 1, "s" } }
return rd.model {
  name = "four", gravity = { 0, -9.81, 0 },
  links = {
    { "crank", joint = "psi", mass = 1, center = {0.25,0,0}, inertia = { zz = 0.02 }, start = { psi = 1.2 } },
    { "coupler", on = "crank", at = {0.5,0,0}, joint = "psi", mass = 2, center = {0.5,0,0}, inertia = { zz = 0.16 }, start = { psi = -0.8632121961010154 } },
    { "rocker", at = {1.2,0,0}, joint = "psi", mass = 1.5, center = {0.4,0,0}, inertia = { zz = 0.08 }, start = { psi = 1.6646843235652324 } },
  },
  points = { C = { on = "coupler", at = { 1, 0, 0 } } },
  drives = { "crank_psi" },
  constraints = function(s)
    local r0 = rd.parameter("r0", s.start.q.rocker_psi, "rad")
    return { rd.loop { { on = "coupler", at = {1,0,0} }, { on = "rocker", at = {0.8,0,0} }, keep = {"x","y"} },
     rd.position { s.q.rocker_psi - r0 - 0.4 * rd.smoothstep(s.t, 0, p.T, 9) } }
  end,
}
