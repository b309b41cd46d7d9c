-- Tries an expression as deep as it may be.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 95000 do x = rd.sin(x) end
    return { a_x = x }
  end }
