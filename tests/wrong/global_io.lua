-- expect: 4: undefined global "io": not available in a model; models/README.md lists the functions
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
io.write("here")
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 1 }
  end }
