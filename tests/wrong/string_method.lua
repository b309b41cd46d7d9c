-- expect: 6: string.uper: unknown function; did you mean "upper"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = #("x"):uper() }
  end }
