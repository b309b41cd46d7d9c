-- expect: 8: more than 100000 different expressions in the model
-- Tries a thousand courses in time with kinks.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = 0
    for i = 1, 10000 do x = x + rd.ramp(s.t, i, i + 1) * rd.abs(s.t - i) end
    return { a_x = x }
  end }
