-- expect: 8: more than 100000 different expressions in the model
-- Tries 300 courses of one deep expression.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s)
    local x, t = s.q.a_x, {}
    for i = 1, 90000 do x = rd.sin(x) + 1; if i % 300 == 0 then t["c" .. i] = x end end
    return t
  end }
