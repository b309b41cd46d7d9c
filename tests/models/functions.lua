-- Every function of the language in a separate row: row i is f_i of the i-th coordinate, so that phi, u and v are
-- f_i, its first derivative, and its second derivative times the rate squared. A loop makes the rows.
local rd = require "refdyn"
local spline = rd.spline { { -1, 0.5 }, { 0, -0.25 }, { 0.5, 1 }, { 2, 0 } }
local functions = {
  function(x) return rd.sin(x) end, function(x) return rd.cos(x) end, function(x) return rd.tan(x) end,
  function(x) return rd.asin(x) end, function(x) return rd.acos(x) end, function(x) return rd.atan(x) end,
  function(x) return rd.atan2(x, 2 - x) end, function(x) return rd.sinh(x) end, function(x) return rd.cosh(x) end,
  function(x) return rd.tanh(x) end, function(x) return rd.exp(x) end, function(x) return rd.log(2 + x) end,
  function(x) return rd.sqrt(2 + x) end, function(x) return rd.pow(2 + x, 1.5) end, function(x) return (2 + x)^x end,
  function(x) return rd.abs(x) * x end, function(x) return rd.min(x * x, 0.1) end,
  function(x) return rd.max(x^3, x) end,
  function(x) return rd.where(rd.less(x, 0.1), x^2, 3 * x^3) end, function(x) return rd.ramp(x, -1, 2) end,
  function(x) return rd.smoothstep(x, -1, 2) end, function(x) return spline(x) end,
  function(x) return rd.friction(2, x, 0.3) end, function(x) return (1 - x) / (2 + x) - 3 * -x end,
}

local links = {}
for i = 1, #functions do links[i] = { "part" .. i, joint = "x", mass = 1 } end

return rd.model {
  name = "functions", links = links,
  constraints = function(s)
    local rows = {}
    for i, f in ipairs(functions) do rows[i] = rd.position { f(s.q["part" .. i .. "_x"]), name = "function " .. i } end
    return rows
  end,
}
