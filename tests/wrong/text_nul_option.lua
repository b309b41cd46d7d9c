-- expect: 3: text "x\x00y": contains control character 0, a line of text is needed
local rd = require "refdyn"
local x = rd.option("x\0y", 1)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
