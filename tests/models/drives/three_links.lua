-- More drives than rows: the third joint is free to reduce the torques.
local rd = require "refdyn"
local p = rd.parameters { { "T", 1, "s" }, { "g", 0, "m/s^2" } }
return rd.model {
  name = "three", gravity = { 0, -p.g, 0 },
  links = {
    { "a", joint = "psi", mass = 5, center = {0.4,0,0}, inertia = { zz = 0.3 }, start = { psi = -0.5 } },
    { "b", on = "a", at = {0.8,0,0}, joint = "psi", mass = 3, center = {0.3,0,0}, inertia = { zz = 0.12 }, start = { psi = 1 } },
    { "c", on = "b", at = {0.6,0,0}, joint = "psi", mass = 1, center = {0.2,0,0}, inertia = { zz = 0.02 }, start = { psi = 0.7 } },
  },
  points = { E = { on = "c", at = { 0.4, 0, 0 } } },
  drives = { { "a_psi", limit = rd.option("limit_a", 1.0) }, { "b_psi", limit = 1 }, { "c_psi", limit = 1 } },
  constraints = function(s)
    local E, E0 = s.points.E, s.start.points.E
    local x0, y0 = rd.parameter("x0", E0.x, "m"), rd.parameter("y0", E0.y, "m")
    local f = rd.smoothstep(s.t, 0, p.T, 9)
    return { rd.position { E.x - x0 + 0.3 * f }, rd.position { E.y - y0 - 0.4 * f } }
  end,
}
