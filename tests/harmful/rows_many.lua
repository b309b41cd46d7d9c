-- expect: 7: more than 10000 entries in a table
-- Tries 20,000 rows.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    local t = {}
    for i = 1, 20000 do t[i] = rd.position { s.q.a_x - i } end
    return t
  end }
