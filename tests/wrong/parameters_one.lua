-- expect: 3: parameters: one parameter by itself, a list of { "name", value, "unit" } is needed
local rd = require "refdyn"
local p = rd.parameters { "m", 1, "kg" }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = p.m } } }
