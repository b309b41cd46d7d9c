-- expect: 5: attempt to index a string value
-- Tries to reach the events of expressions.
local rd = require "refdyn"
local p = rd.parameters { { "m", 1 } }
getmetatable(p.m).__add = function() end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
