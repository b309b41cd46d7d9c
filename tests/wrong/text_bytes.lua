-- expect: 3: text "k\xE9g": contains byte 233, which is not UTF-8; save the file as UTF-8
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "k\xE9g" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
