-- expect: 6: math.random: unknown function; models/README.md lists the functions
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = math.random() }
  end }
