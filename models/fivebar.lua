-- A planar parallel robot of five bars: two driven hinges on the ground, each with two bars in series that meet at the tool.
-- Checked along a driven motion against its direct kinematics, the intersection of two circles.
local rd = require "refdyn"
local p  = rd.parameters {
  { "base", 0.3, "m" }, { "upper", 0.35, "m" }, { "lower", 0.5, "m" }, { "m_tool", 0.6, "kg" },
  { "rho", 2700, "kg/m^3" }, { "left", 2.3, "rad" }, { "right", 0.9, "rad" }, { "swing", 0.5, "rad" },
  { "rate", 4, "rad/s" },
}

-- The lower bars meet above the line between the elbows.
local x     = p.base + p.upper * (rd.cos(p.right) - rd.cos(p.left))
local y     = p.upper * (rd.sin(p.right) - rd.sin(p.left))
local lift  = rd.acos(rd.sqrt(x^2 + y^2) / (2 * p.lower))
local slope = rd.atan2(y, x)

local function bar(length)
  return { rd.tube { outer = 0.03, inner = 0.024, length = length, density = p.rho, at = { length / 2, 0, 0 } } }
end
local function course(t) return p.swing * (1 - rd.cos(p.rate * t)) / 2 end

return rd.model {
  name = "fivebar",
  links = {
    { "left", at = { -p.base / 2, 0, 0 }, joint = "psi", start = { psi = p.left }, bodies = bar(p.upper) },
    { "left_lower", on = "left", at = { p.upper, 0, 0 }, joint = "psi",
      start = { psi = slope + lift - p.left }, bodies = bar(p.lower) },
    { "right", at = { p.base / 2, 0, 0 }, joint = "psi", start = { psi = p.right }, bodies = bar(p.upper) },
    { "right_lower", on = "right", at = { p.upper, 0, 0 }, joint = "psi",
      start = { psi = rd.pi + slope - lift - p.right }, bodies = bar(p.lower) },
    { "tool", on = "left_lower", at = { p.lower, 0, 0 }, mass = p.m_tool },
  },
  points = { tool = "tool" },
  constraints = function(s)
    return {
      rd.loop { "tool", { on = "right_lower", at = { p.lower, 0, 0 } }, keep = "x, y" },
      rd.drive { "left_psi", p.left + course(s.t) }, rd.drive { "right_psi", p.right - 0.6 * course(1.7 * s.t) },
    }
  end,
}
