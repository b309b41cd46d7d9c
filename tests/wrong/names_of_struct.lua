-- expect: 3: parameter derived: the struct of parameters has what prepare computes there, another name is needed
local rd = require "refdyn"
local a = rd.parameter("derived", 1, "m")
return rd.model { name = "wrong", links = { { "l", joint = "x", mass = a, spring = { x = 2 * a } } } }
