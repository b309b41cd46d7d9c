-- expect: 3: rd.parameters: 2 arguments; must have at most 1, as in rd.parameters { { "m", 0.5, "kg" } }
local rd = require "refdyn"
local p = rd.parameters({ { "m", 1 } }, { { "k", 2 } })
return rd.model { name = "wrong", links = { { "a", joint = "z", mass = p.m } } }
