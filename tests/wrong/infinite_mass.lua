-- expect: 3: links[1].mass: value inf, a finite number is needed
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1e400 } } }
