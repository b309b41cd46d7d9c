-- expect: 5: constraints: number of rows is 10000; must be at most that of coordinates, 1
-- Tries 10,000 rows.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    local t = {}
    for i = 1, 10000 do t[i] = rd.position { s.q.a_x - i } end
    return t
  end }
