-- A body that turns about a fixed point by three angles. It rolls over so that theta comes within about `miss` of pi/2,
-- where psi and phi turn about one axis.
local rd = require "refdyn"
local p = rd.parameters { { "miss", 0.01, "rad" } }

return rd.model {
  name = "suite_top", gravity = { 0, 0, -9.81 },
  links = {
    { "top", joint = "psi, theta, phi", start = { theta = 0.8 }, start_rate = { psi = p.miss, theta = 1.5 }, mass = 1,
      center = { 0.02, 0, 0 }, inertia = { xx = 0.02, yy = 0.05, zz = 0.06 } },
  },
  points = { E = { on = "top", at = { 0.3, 0.1, 0 } } },
}
