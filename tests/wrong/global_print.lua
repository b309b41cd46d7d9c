-- expect: 4: undefined global "print": a model has no such function or library, models/README.md names what it has
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
print("here")
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    return { a_x = 1 }
  end }
