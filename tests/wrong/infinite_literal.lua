-- expect: 6: forces.a_x: contains inf; all numbers must be finite
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 1e400 * s.t }
  end }
