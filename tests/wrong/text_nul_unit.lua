-- expect: 3: text "kg\x00": contains control character 0; remove it
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "kg\0" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
