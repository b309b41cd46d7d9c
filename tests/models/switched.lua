-- An oscillator that is pushed from certain times on, given by formulas in many forms, and a second one whose speed a programme
-- raises from `at` on. All solutions are known.
local rd = require "refdyn"
local form = rd.option("form", "left")
local p = rd.parameters { { "at", 0.25, "s" }, { "push", 5, "N" }, { "stiffness", 30, "N/m" } }
local begin = rd.input("begin", 0.25, "s")

local pushes = {
  left     = function(t) return rd.where(rd.less(t, p.at), 0, 1) end,
  right    = function(t) return rd.where(rd.less(p.at, t), 1, 0) end,
  product  = function(t) return rd.less(p.at - t, 0) end,
  rounded  = function(t) return rd.less(3 * p.at, 3 * t) end,
  input    = function(t) return rd.less(begin, t) end,
  twice    = function(t) return rd.less(0.1 + 0.2, t) + rd.less(0.3, t) end,
  wave     = function(t) return rd.where(rd.less(rd.sin(20 * t), 0), 0, 1) end,
  pulse    = function(t) return rd.less(rd.abs(t - 0.5)^2, 0.04) end,
  ramp     = function(t) return rd.less(0.6, rd.ramp(t, 0, 0.7)) end,
}
local speeds = {
  left  = function(t) return rd.max(t - p.at, 0) end,
  right = function(t) return rd.max(0, t - p.at) end,
}

return rd.model { name = "switched",
  links = { { "pushed", joint = "x", mass = 1, spring = { x = p.stiffness } }, { "driven", joint = "x", mass = 1, spring = { x = 20 } } },
  forces = function(s) return { pushed_x = p.push * pushes[form](s.t) } end,
  constraints = function(s) return { rd.velocity { s.qd.driven_x - (speeds[form] or speeds.right)(s.t) } } end,
}
