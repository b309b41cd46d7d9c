-- expect: 3: text "\xC0\xAF": contains byte 192, which is not UTF-8; save the file as UTF-8
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "\xC0\xAF" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
