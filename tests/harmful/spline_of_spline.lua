-- Tries a spline of a spline of a spline.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local c, x = rd.spline { { 0, 0 }, { 1, 1 }, { 2, 0 } }, s.t
    for i = 1, 30000 do x = c(x) end
    return { a_x = x }
  end }
