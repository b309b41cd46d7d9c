-- Tries a loop of repeat.
local rd = require "refdyn"
repeat until false
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
