-- expect: 8: more than 100000 different expressions in the model
-- Tries an expression 190,000 deep.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 190000 do x = rd.sin(x) end
    return { a_x = x }
  end }
