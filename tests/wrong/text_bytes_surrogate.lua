-- expect: 3: text "\xED\xA0\x80": contains byte 237, which is not UTF-8; save the file as UTF-8
local rd = require "refdyn"
local p = rd.parameters { { "m", 1, "\xED\xA0\x80" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
