-- expect: 3: parameters: a single parameter; must be a list of { "name", value, "unit" }
local rd = require "refdyn"
local p = rd.parameters { "m", 1, "kg" }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = p.m } } }
