-- expect: 4: assignment to a field of an expression: it is one value and has no fields
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
p.n.x = 2
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 1 }
  end }
