-- expect: 6: call of an expression: it is a value; write * to multiply, and call functions as rd.sin(x)
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = p.n(2) }
  end }
