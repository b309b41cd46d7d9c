-- expect: 8: more different expressions in the model than 100000
-- Tries an energy of a deep expression.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 60000 do x = rd.sin(x) * x end
    return { rd.energy { x } }
  end }
