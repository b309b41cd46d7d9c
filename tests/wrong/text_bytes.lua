-- expect: 3: text "k\xE9g": contains byte 233, which is not UTF-8, a line of text is needed
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "k\xE9g" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
