-- expect: 4: string.format: argument 2 is of type userdata; must be a text, number or boolean
local rd = require "refdyn"
local p = rd.parameters { { "n", 3 } }
return rd.model { name = ("wrong%s"):format(p.n), links = { { "a", joint = "x", mass = 1 } } }
