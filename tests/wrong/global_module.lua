-- expect: 6: undefined global "Rd"; did you mean "rd"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = Rd.sin(s.t) }
  end }
