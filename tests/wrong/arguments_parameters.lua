-- expect: 3: rd.parameters: number of arguments is 2, 1 is needed; write rd.parameters { { "m", 0.5, "kg" } }
local rd = require "refdyn"
local p = rd.parameters({ { "m", 1 } }, { { "k", 2 } })
return rd.model { name = "wrong", links = { { "a", joint = "z", mass = p.m } } }
