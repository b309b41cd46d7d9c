-- expect: 8: more than 100000 different expressions in the model
-- Tries many rows of one deep expression.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "free", mass = 1, inertia = { xx = 1, yy = 1, zz = 1 } } },
  constraints = function(s)
    local x, t = s.q.a_x, {}
    for i = 1, 90000 do x = rd.sin(x) + 1 end
    for i = 1, 300 do t[i] = rd.position { x * s.q.a_x ^ i } end
    return t
  end }
