-- expect: 8: more than 100 million steps to read the model; look for a loop without an end
-- Tries an endless number of directions.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = 0
    for i = 1, 1e9 do x = s.axes.a.x.x end
    return {}
  end }
