-- Two bars whose tip moves outward until they are stretched, at sqrt(2 (1 - cos 0.9) / 0.3) = 1.5883 s: afterwards, no
-- position satisfies the programme.
local rd = require "refdyn"
local function bar(l, m) return { rd.box { { l, 0.02, 0.02 }, mass = m, at = { l / 2, 0, 0 } } } end
return rd.model {
  name = "reach", gravity = { 0, -9.81, 0 },
  links = {
    { "upper", joint = "psi", start = { psi = 0.9 }, bodies = bar(1, 1) },
    { "lower", on = "upper", at = { 1, 0, 0 }, joint = "psi", start = { psi = -1.8 }, bodies = bar(1, 1) },
  },
  points = { tip = { on = "lower", at = { 1, 0, 0 } } },
  constraints = function(s)
    return { rd.position { s.points.tip.x - 2 * rd.cos(0.9) - 0.3 * s.t^2, name = "out" }, rd.position { s.points.tip.y, name = "level" } }
  end,
}
