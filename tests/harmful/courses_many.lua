-- expect: 8: more than 100000 different expressions in the model
-- Tries 100,000 courses.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s)
    local t = {}
    for i = 1, 1e5 do t["c" .. i] = s.t + i end
    return t
  end }
