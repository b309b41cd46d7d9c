-- Tries a tower of powers.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local x = s.q.a_x
    for i = 1, 1000 do x = x ^ x end
    return { a_x = x }
  end }
