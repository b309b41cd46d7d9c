-- expect: 6: undefined global "P"; did you mean "p"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = P.n * s.t }
  end }
