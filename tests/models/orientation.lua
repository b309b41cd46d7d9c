-- Directions in programmes: two turns, the second of which keeps the hand's x axis level.
-- By hand: the hand's x axis is (cos(a + b), 0, -sin(a + b)) with a, b both about y, so the row is -sin(a + b), its
-- rate at a = b = 0 -(ad + bd), and b follows -a. The same at the point E. Rate: s.axes.hand.x.zd.
local rd = require "refdyn"

local function bar(length, mass)
  return rd.box { { length, 0.05, 0.05 }, mass = mass, at = { length / 2, 0, 0 } }
end

return rd.model {
  name = "orientation", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "theta", start = { theta = 0.2 }, bodies = { bar(1, 2) } },
    { "hand", on = "arm", at = { 1, 0, 0 }, joint = "theta", start = { theta = -0.2 }, bodies = { bar(0.2, 0.5) } },
  },
  points = { E = { on = "hand", at = { 0.2, 0, 0 } } },
  courses = function(s) return { level = s.points.E.axes.x.z, rate = s.axes.hand.x.zd } end,
  constraints = function(s) return { rd.position { s.axes.hand.x.z, alpha = 20, beta = 20, name = "level" } } end,
}
