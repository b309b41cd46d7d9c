-- expect: 6: % of an expression: rd has no remainder; to keep an angle x between -pi and pi write rd.atan2(rd.sin(x), rd.cos(x))
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.t % 2 }
  end }
