-- A crank whose rod ends on an inclined rail; the row has no gains.
local rd = require "refdyn"
return rd.model { name = "crank", gravity = { 0, 0, -9.81 },
  links = { { "arm", joint = "theta", start = { theta = 0.4 }, mass = 1.3, center = { 0.3, 0, 0 }, inertia = { yy = 0.1 } },
            { "rod", on = "arm", at = { 0.5, 0, 0 }, joint = "theta", start = { theta = -0.9 }, mass = 0.7, center = { 0.2, 0, 0.05 }, inertia = { yy = 0.04 } } },
  points = { E = { on = "rod", at = { 0.7, 0, 0 } } },
  constraints = function(s) return { rd.position { s.points.E.z + 0.1 * s.points.E.x } } end,
}
