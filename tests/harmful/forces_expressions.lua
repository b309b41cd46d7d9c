-- expect: 8: more than 100000 different expressions in the model
-- Tries an endless number of expressions in forces.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    while true do x = rd.sin(x) * x end
  end }
