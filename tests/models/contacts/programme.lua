local rd = require "refdyn"
local p = rd.parameters { { "e", 0.3 }, {"depth", 0.1, "m"} }
return rd.model {
  name = "programme", gravity = { 0, 0, -9.81 },
  links = { { "upper", joint = "theta", bodies = { rd.box { { 1, 0.05, 0.05 }, mass = 2, at = { 0.5, 0, 0 } } }, start = { theta = -0.6 } },
            { "lower", on = "upper", at = { 1, 0, 0 }, joint = "theta", bodies = { rd.box { { 0.8, 0.05, 0.05 }, mass = 1, at = { 0.4, 0, 0 } } }, start = { theta = 1.4 } } },
  points = { tool = { on = "lower", at = { 0.8, 0, 0 } } },
  constraints = function(s)
    local x0 = rd.parameter("x0", s.start.points.tool.x, "m")
    return { rd.position { s.points.tool.x - x0 - 0.2 * rd.smoothstep(s.t, 0, 2) },
             rd.contact { s.points.tool.z + 0.3, restitution = p.e, name = "surface" } }
  end,
}
