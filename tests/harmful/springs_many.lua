-- expect of gen: 0: more than 16 million operations on expressions to derive its equations
-- Tries 3,000 springs.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local t = {}
    for i = 1, 3000 do t[i] = rd.spring { "a", { on = "ground", at = { i, 0, 1 } }, stiffness = i } end
    return t
  end }
