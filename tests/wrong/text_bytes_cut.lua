-- expect: 3: text "\xE2\x82": contains byte 226, which is not UTF-8; save the file as UTF-8
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "\xE2\x82" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
