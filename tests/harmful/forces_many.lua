-- expect: 7: more than 10000 entries in a table
-- Tries 20,000 forces.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local t = {}
    for i = 1, 20000 do t[i] = rd.force { "a", { i, 0, s.q.a_x } } end
    return t
  end }
