-- expect: 6: // of an expression: rd has no rounding; write a / b to divide
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.t // 1 }
  end }
