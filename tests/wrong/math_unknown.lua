-- expect: 6: math.sinn: unknown function; did you mean "sin"?
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = math.sinn(1) }
  end }
