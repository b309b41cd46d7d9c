-- expect: 6: # of an expression: it is one value and has no length; only a list or a text has
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = #s.t }
  end }
