-- expect: 3: item 2 of a list is nil; lists must have no gaps
local rd = require "refdyn"
local p = rd.parameters { { "m", nil, "kg" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = p.m } } }
