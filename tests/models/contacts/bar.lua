-- Two contacts and a row: a bar on springs above a floor, with a tool on a prescribed motion.
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.35 }, { "s", 230, "N/m" }, { "floor", -0.385, "m" } }
return rd.model {
  name = "bar", gravity = { 0.3, 0, -9.81 },
  links = {
    { "bar", joint = "x, z, theta", bodies = { rd.box { { 0.8, 0.05, 0.04 }, mass = 1.7 } }, spring = { x = p.s, z = p.s }, start = { theta = 0.12 } },
    { "tool", on = "bar", at = { 0.4, 0, 0 }, joint = "theta", mass = 0.3, center = { 0.1, 0, 0.02 }, inertia = { yy = 0.01 } },
  },
  points = { left = { on = "bar", at = { -0.4, 0, 0 } }, tip = { on = "tool", at = { 0.2, 0, 0 } } },
  constraints = function(s)
    return {
      rd.contact { s.points.left.z - p.floor, restitution = p.e, name = "left" },
      rd.position { s.q.tool_theta - 0.3 * rd.sin(2 * s.t), name = "course" },
      rd.contact { s.points.tip.z - p.floor + 0.1 * rd.sin(s.t), name = "tip" },
    }
  end,
}
