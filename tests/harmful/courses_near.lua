-- Tries courses of an expression as deep as it may be.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s)
    local x, t = s.q.a_x, {}
    for i = 1, 45000 do x = rd.sin(x) + 1; if i % 300 == 0 then t["c" .. i] = x end end
    return t
  end }
