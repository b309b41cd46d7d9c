-- expect: 8: more than 100000 different expressions in the model
-- Tries a sum of a million terms.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = 0
    for i = 1, 1e6 do x = x + rd.sin(i * s.t) end
    return { a_x = x }
  end }
