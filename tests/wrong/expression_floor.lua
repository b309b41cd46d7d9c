-- expect: 6: // of an expression: rd has no rounding, a / b divides
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.t // 1 }
  end }
