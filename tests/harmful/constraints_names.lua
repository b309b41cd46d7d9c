-- expect: 8: more than 100 million steps to read the model; look for a loop without an end
-- Tries to look up an endless number of names in constraints.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    local x
    while true do x = s.q.a_x end
  end }
