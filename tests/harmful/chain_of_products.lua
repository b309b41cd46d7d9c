-- expect: 8: more than 100000 different expressions in the model
-- Tries an expression 90,000 deep of products.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 90000 do x = x * s.qd.a_x + 1 end
    return { a_x = x }
  end }
