-- expect: 3: links[1].mass: value inf; must be finite
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1e400 } } }
