-- expect: 8: more than 100000 different expressions in the model
-- Tries a sum of 60,000 terms.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = 0
    for i = 1, 60000 do x = x + rd.sin(i * s.q.a_x) end
    return { a_x = x }
  end }
