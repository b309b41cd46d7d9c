-- Two flexible links in space, each driven at its hub: the first turns about the vertical, the second lifts the tip.
local rd = require "refdyn"
local n = rd.option("n_rfe", 3, { from = 1 })
local p = rd.parameters { { "T", 1, "s" }, { "eta", 0, "s" }, { "g", 9.81, "m/s^2" }, { "turn", 1, "rad" }, { "rise", 0.2, "m" } }

local function beam(width, height)
  return { length = 0.5, section = rd.rectangle(width, height), E = 7e10, nu = 0.33, rho = 2700, eta = p.eta, rfe = n, dofs = "psi,theta" }
end

return rd.model {
  name = "two_flexible", gravity = { 0, 0, -p.g },
  links = {
    { "hub", joint = "psi", inertia = { zz = 0.05 }, mass = 1 },
    { "first", on = "hub", beam = beam(0.01, 0.02) },
    { "elbow", on = "first.tip", joint = "theta", start = { theta = 0.5 }, mass = 0.3, inertia = { xx = 0.01, yy = 0.01, zz = 0.01 } },
    { "second", on = "elbow", beam = beam(0.008, 0.01) },
    { "tip", on = "second.tip", mass = 0.2 },
  },
  points = { tip = "tip" },
  drives = { "hub_psi", "elbow_theta" },
  constraints = function(s)
    local tip, at = s.points.tip, s.start.points.tip
    local z0, f = rd.parameter("z0", at.z, "m"), rd.smoothstep(s.t, 0, p.T, 9)
    return { rd.position { rd.atan2(tip.y, tip.x) - p.turn * f, name = "azimuth" }, rd.position { tip.z - z0 - p.rise * f, name = "height" } }
  end,
}
