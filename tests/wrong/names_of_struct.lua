-- expect: 3: parameter derived: the emitted struct of parameters has a member of this name; choose another name
local rd = require "refdyn"
local a = rd.parameter("derived", 1, "m")
return rd.model { name = "wrong", links = { { "l", joint = "x", mass = a, spring = { x = 2 * a } } } }
