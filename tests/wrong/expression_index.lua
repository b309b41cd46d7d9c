-- expect: 6: field of an expression: it is one value and has no fields
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = s.q.a_x[1] }
  end }
