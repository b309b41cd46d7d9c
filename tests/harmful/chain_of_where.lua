-- expect: 8: more than 100000 different expressions in the model
-- Tries a chain of choices.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 60000 do x = rd.where(rd.less(x, i), x + 1, x - 1) end
    return { a_x = x }
  end }
