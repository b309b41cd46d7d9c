-- expect: 6: % of an expression: rd has no remainder, rd.atan2(rd.sin(x), rd.cos(x)) keeps an angle x between -pi and pi
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 2 % s.t }
  end }
