-- expect: 6: rd.sine: unknown function, the nearest known one is "sin"
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = rd.sine(s.t) }
  end }
