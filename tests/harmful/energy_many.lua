-- expect of gen: 0: more than 448 MB of memory to derive its equations
-- Tries 3,000 energies.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local t, x = {}, s.q.a_x
    for i = 1, 3000 do x = rd.sin(x); t[i] = rd.energy { x } end
    return t
  end }
