-- expect: 3: text "x\x00y": contains control character 0; remove it
local rd = require "refdyn"
local x = rd.option("x\0y", 1)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
